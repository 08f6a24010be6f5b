// Caps on a sphere: is all of it covered, and where not?
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "kernels/geometry/triangle.h"

namespace slabwright {

/// The directions u, of length 1, with dot(axis, u) > cosine; the axis has length 1.
struct Cap {
    Point3 axis{};
    double cosine = 0;
    [[nodiscard]] double margin(const Point3& u) const {
        return axis[0] * u[0] + axis[1] * u[1] + axis[2] * u[2] - cosine;
    }
};

/// Grows cap by cap. Where something is uncovered, a corner of it lies where two circles cross, or a whole
/// circle is uncovered: so it is enough to keep the crossings, and one point of each circle that crosses none
/// before it, that lie in no cap.
class CapCover {
public:
    static constexpr double kInside = 1e-9;  ///< of a cosine: what is in a cap by less counts as uncovered

    /// Starts again, with one cap.
    void begin(const Cap& cap);
    void add(const Cap& cap);

    /// A direction in no cap, within kInside, of those kept the nearest to `wanted`; none where the caps
    /// cover the sphere.
    [[nodiscard]] std::optional<Point3> uncovered(const Point3& wanted) const;
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    void keep_own(const Cap& cap);
    void leave_out_own(const Cap& cap, std::size_t n);
    [[nodiscard]] Cap cap_at(std::size_t i) const {
        return {{caps_[0][i], caps_[1][i], caps_[2][i]}, caps_[3][i]};
    }

    std::size_t size_ = 0;
    std::array<std::vector<double>, 4> caps_;  // rows: axes and cosines
    std::array<std::vector<double>, 4>
        crossings_;  // rows: directions, and how deep each is in the caps; room for the circle in hand
    std::vector<Point3> corners_;
    bool all_ = false;  // one cap is the whole sphere
};

}  // namespace slabwright
