// What a tool has met, and which of the places around a point that forbids.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "kernels/access/cap_cover.h"

namespace slabwright {

/// Points of the part, those used last first, and what each forbids a ball or a flat end mill that touches a
/// point p from a direction u.
///
/// A ball that touches p lies in a direction from it. A flat's axis passes p at up to its radius, and
/// stereographic projection makes a direction of that, discs becoming caps. In either case what an obstacle
/// forbids is a cap of directions: where it is deeper in the tool than half of the tolerance. Where something
/// is deeper than all of it there is a cap around the direction.
class Obstacles {
public:
    static constexpr std::size_t kMost = 12;
    enum class Tool : unsigned char { ball, flat };

    Obstacles(Tool tool, double radius, double tolerance);

    void remember(const Point3& obstacle);
    void use(std::size_t i);  ///< makes it the first
    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] Point3 point(std::size_t i) const { return {x_[i], y_[i], z_[i]}; }

    /// The one that forbids most around u, or kMost where none forbids it. A ball's: of those that forbid it
    /// all points within `around` of p.
    [[nodiscard]] std::size_t strongest(const Point3& p, const Point3& u, double around) const;
    /// The cap of an obstacle that forbids u, or that just does not, so that its margin is not over 0.
    [[nodiscard]] Cap cap(const Point3& obstacle, const Point3& p, const Point3& u, double around) const;

private:
    Tool tool_;
    double tolerance_, reach_, clear2_;
    std::size_t size_ = 0;
    std::array<double, kMost> x_{}, y_{}, z_{};
};

}  // namespace slabwright
