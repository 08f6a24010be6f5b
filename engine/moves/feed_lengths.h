// How far a program's tool goes at each of its feeds, and where: what a program can be held against without
// its moves.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/plan.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

/// What the tool does at one feed.
struct FeedLength {
    double feed = 0;                 ///< mm/min; 0: rapids
    double mm = 0;                   ///< how far it goes
    std::array<double, 3> moment{};  ///< mm²: over that way, the integral of where it is

    /// The middle of that way, mm.
    [[nodiscard]] std::array<double, 3> centre() const {
        return {moment[0] / mm, moment[1] / mm, moment[2] / mm};
    }
};

/// Adds what is done at one feed; `lengths` stays in ascending order of feeds.
void add_length(std::vector<FeedLength>& lengths, const FeedLength& more);

/// A straight way.
[[nodiscard]] FeedLength straight_length(double feed, const std::array<double, 3>& from,
                                         const std::array<double, 3>& to);
/// A level arc: centre x, y, height z, radius and angles as in LevelArc.
[[nodiscard]] FeedLength arc_length(double feed, const LevelArc& arc);

/// By ascending feed, of moves as write_program() writes them: the way to the first place whose x and y are
/// written does not count, as nobody knows where it begins. An arc has the mean of its two radii.
/// @param moves begin at the clearance height (Operation::moves)
[[nodiscard]] std::vector<FeedLength> feed_lengths(std::span<const Move> moves);

}  // namespace slabwright
