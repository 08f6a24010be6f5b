// Cuts that are too deep for their cutter, taken in several passes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/plan.h"
#include "engine/stock/cut_stretches.h"

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

/// A run with the passes that are made above it.
struct Passes {
    std::uint32_t first = 0, last = 0;  ///< moves, both included; all by feed
    std::vector<std::int32_t> up;  ///< .1 µm by which each pass is raised, highest first; none: not split
};

/// The passes that share a run's depth.
[[nodiscard]] Passes passes_of(const DeepRun& run);

/// A run among the moves that it has become.
struct SplitRun {
    MoveRange all;                  ///< with its passes
    std::vector<MoveRange> passes;  ///< what each of them cuts, in the order of Passes::up
};

/// Moves, and where the runs that were split lie in them.
struct SplitMoves {
    std::vector<Move> moves;
    std::vector<SplitRun> runs;
};

/// The moves with more passes before each run: the same way, raised, highest first; then the cutter goes
/// straight down to where the run begins. Closed ways go round and round. Level ones go there and back by
/// turns, if the cutter may go down where they end; otherwise each pass leads back where it has just cut.
/// A cutter that may be somewhere may be anywhere straight above it, so nothing else need be known of part,
/// flask and holder, and what stands after the run is what would have stood. Vertical ways go at
/// `plunge_feed`, mm/min, backward ways at the run's own feeds.
/// @param runs ascending, apart from each other, none with move 0
/// @param by_turns the cutter cuts to its centre
[[nodiscard]] SplitMoves split_runs(const std::vector<Move>& moves, std::span<const Passes> runs,
                                    std::uint32_t plunge_feed, bool by_turns);

}  // namespace slabwright
