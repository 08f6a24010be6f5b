// Areas of the table that no tool may enter: bolts and fences on the base board, clamps on a slab.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace slabwright {

/// What the height of a keep-out counts from: the base board's top, or the top of the slab that its layer is
/// cut from, before that is faced.
enum class KeepOutBase : std::uint8_t { board, slab };

/// An area, mm, in the X and Y of the programs (machine.zero), with what stands on it. One of the three
/// shapes is given.
struct KeepOut {
    std::string name;
    std::vector<double> rectangle;               ///< x and y of its least corner, then of its greatest
    std::vector<std::array<double, 2>> polygon;  ///< simple, either way round, not repeated at its end
    std::vector<double> circle;                  ///< x, y, radius
    double height = 0;                           ///< mm that it stands up from its base
    KeepOutBase from = KeepOutBase::board;
    double clearance = 5;  ///< mm that tools keep away from it, and that they pass over it
    friend bool operator==(const KeepOut&, const KeepOut&) = default;
};

/// @throws Error(usage, "job.range") whose place is the key, "machine.keep_out[1].circle", where a keep-out
/// has no name or another's, no shape or two, a shape of no area, a polygon that meets itself, or a number
/// out of range
void validate_keep_outs(const std::vector<KeepOut>& keep_outs);

}  // namespace slabwright
