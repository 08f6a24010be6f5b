// Cuts that are too deep for their cutter, taken in several passes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// How the passes of a run divide its depth: alike, or as the squares 1, 4, 9 … of it from below. A ball
/// that is raised a little no longer meets the floor, and of a wall it leaves up²/2R, up that it is raised.
enum class PassShares : std::uint8_t { equal, growing };

/// A run of feed moves that is to be cut in several passes.
struct DeepRun {
    std::uint32_t first = 0, last = 0;  ///< moves, both included; all by feed
    double depth_mm = 0;                ///< over the tip, that the passes divide
    int passes = 2;                     ///< at least 2
    PassShares shares = PassShares::equal;
    friend bool operator==(const DeepRun&, const DeepRun&) = default;
};

/// The moves with `passes` − 1 more passes before each run: the same way, raised by shares of the
/// depth, highest first; after each the cutter goes back on the raised way, where it has just cut, and down
/// where it stood before the run. A cutter that may be somewhere may be anywhere straight above it, so
/// nothing else need be known of part, flask and holder, and what stands after the run is what would have
/// stood. Vertical ways go at `plunge_feed`, mm/min, backward ways at the run's own feeds.
/// @param runs ascending, apart from each other, none with move 0
[[nodiscard]] std::vector<Move> split_runs(const std::vector<Move>& moves, std::span<const DeepRun> runs,
                                           std::uint32_t plunge_feed);

}  // namespace slabwright
