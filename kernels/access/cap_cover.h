// Caps on a sphere: is all of it covered, and where not?
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "kernels/access/triangle.h"

namespace slabwright {

/// The directions u, of length 1, with dot(axis, u) > cosine; the axis has length 1.
struct Cap {
    Point3 axis{};
    double cosine = 0;
    [[nodiscard]] double margin(const Point3& u) const { return axis[0] * u[0] + axis[1] * u[1] + axis[2] * u[2] - cosine; }
};

/// Grows cap by cap. Where something is uncovered, a corner of it lies where two circles cross, or a whole circle is uncovered: so it is
/// enough to keep the crossings, and one point of each circle, that lie in no cap.
class CapCover {
public:
    static constexpr double kInside = 1e-9;  ///< of a cosine: what is in a cap by less counts as uncovered

    /// Starts again, with one cap.
    void begin(const Cap& cap);
    void add(const Cap& cap);

    /// A direction in no cap, within kInside, of those kept the nearest to `wanted`; none where the caps cover the sphere.
    [[nodiscard]] std::optional<Point3> uncovered(const Point3& wanted) const;
    [[nodiscard]] std::size_t size() const { return caps_.size(); }

private:
    void keep(const Point3& u, std::size_t a, std::size_t b);

    std::vector<Cap> caps_;
    std::vector<Point3> corners_;
    bool all_ = false;  // one cap is the whole sphere
};

}  // namespace slabwright
