// What lies beyond the end of a hole's wall: a mouth, a shelf, a floor, a cone. Internal to features.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kernels/features/round_walls.h"

namespace slabwright {

/// No wall.
inline constexpr std::uint32_t kNoWall = 0xFFFFFFFFu;

struct WallEnd {
    enum class Beyond : std::uint8_t {
        mouth,  ///< the surface turns away from the axis
        floor,  ///< a plane across the axis: a bottom, or a shelf to a narrower wall
        cone,
        other,
    };
    Beyond beyond{};
    bool turns_in = false;         ///< towards the axis: what lies beyond is no mouth
    bool is_smooth = false;        ///< goes on by less than 20°
    std::uint32_t next = kNoWall;  ///< the wall that the floor or cone leads to
    /// Of a cone: its border away from the wall, along the wall's axis and from it; radius 0 at a point.
    AxisPlace far_end{};
    bool is_open = false;               ///< of a cone: it ends at an edge that turns outward (a countersink)
    std::vector<std::uint32_t> facets;  ///< of the floor or cone, ascending
};

/// Looks beyond end 0 (low) or 1 (high) of walls[wall].
/// @param wall_of per facet, its wall or kNoWall
[[nodiscard]] WallEnd look_beyond(const FacetBends& bends, std::span<const RoundWall> walls,
                                  std::span<const std::uint32_t> wall_of, std::uint32_t wall, int end);

/// Whether two walls turn about one axis, as well as their corners can tell.
[[nodiscard]] bool are_coaxial(const RoundWall& a, const RoundWall& b);

}  // namespace slabwright
