// Pieces of an operation's moves, replaced so that they no longer do what they must not. A cutter that may be
// somewhere may be anywhere straight above it: all that is done here is done by raising, by going the same
// way several times, or by not going at all.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/mend/free_cutter.h"
#include "engine/plan.h"

namespace slabwright {

/// Moves [first, last) are replaced by others. The first and the last move of an operation never are.
struct MovePatch {
    std::size_t first = 0, last = 0;
    std::vector<Move> moves;
};

/// The moves with these patches; of two that overlap the later one is left out.
/// @param patches in any order
/// @returns how many were applied
std::size_t apply_patches(std::vector<Move>& moves, std::vector<MovePatch> patches);

/// The way of feed moves [first, last), raised point by point as far as the cutter must be to be free of the
/// part. Where it does not end free it ends raised, and what follows begins there: straight over where it
/// did.
[[nodiscard]] MovePatch lifted_over_part(const std::vector<Move>& moves, std::size_t first, std::size_t last,
                                         const FreeCutter& cutter);
/// The same way, raised by `up` mm as a whole.
[[nodiscard]] MovePatch raised_by(const std::vector<Move>& moves, std::size_t first, std::size_t last,
                                  double up);
/// The rapids about `at` as rapids at the clearance height, with a feed move down to where they ended, or
/// straight over that where the cutter is not free of the part there.
/// @param clearance 0.1 µm. @param feed mm/min, for going down
[[nodiscard]] MovePatch rapids_above(const std::vector<Move>& moves, std::size_t at, std::int32_t clearance,
                                     std::uint32_t feed, const FreeCutter& cutter);
/// The way of moves [first, last) in several passes (split_runs). @param depth mm
[[nodiscard]] MovePatch in_passes(const std::vector<Move>& moves, std::size_t first, std::size_t last,
                                  double depth, int passes, std::uint32_t plunge_feed);
/// Down to the end of move `at` on a ramp to and fro over the way that follows, so gentle that no more stands
/// under the tool's core than its recess; empty where that way is too short, leaves its level, or the tool
/// has no core. @param depth mm that stands there
[[nodiscard]] MovePatch ramped_in(const std::vector<Move>& moves, std::size_t at, double depth,
                                  const Tool& tool, double ramp_deg);
/// Without the feed moves from `at` to the next rapid; the rapids after it go at the clearance height.
[[nodiscard]] MovePatch left_out(const std::vector<Move>& moves, std::size_t at, std::int32_t clearance);

}  // namespace slabwright
