// The feeds that the cuts of one operation bear (METHOD.md sections 8 and 9).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "engine/forces/bent_cutter.h"
#include "engine/forces/cut_class.h"
#include "engine/forces/wall_map.h"
#include "engine/job.h"
#include "engine/plan.h"
#include "kernels/parallel/context.h"

namespace slabwright {

inline constexpr double kBentAccuracy = 0.01;  ///< of the peaks that feeds are chosen by (BentCutter::at)

inline constexpr int kMostPasses = 4;  ///< into which a cut is divided at once, as it must be

/// A stretch of an operation's way, as far as its feed and its forces depend on it.
struct SeenStretch {
    CutClass coarse, fine;
    std::uint32_t first = 0, last = 0;
    bool cuts = false;
    float length = 0;          ///< in the plane, mm
    float low = 0, depth = 0;  ///< over the tip, mm: between which something is taken away
    float height = 0;          ///< of the cut's middle above the joint, mm
    float wood = 0,
          overhang =
              0;       ///< what carries the cut, and how far from what carries it; 0 where nothing hangs over
    float wall_n = 0;  ///< the side force that a thin wall beside it bears; 0 where none stands
    bool wall_lost = false;  ///< neither feed nor passes would save it
    std::array<float, 3> at{};
    std::uint32_t feed = 0;  ///< that was chosen for it; 0: none yet
    const Bent* bent =
        nullptr;           ///< what it bears at that feed, of its coarse class; null where nothing is cut
    double wood_load = 0;  ///< and the wood, as a share of what there is
    double stated = 0;     ///< the cutter's load as a plan states it, where feed alone does not settle it
    [[nodiscard]] std::array<double, 3> place() const { return {at[0], at[1], at[2]}; }
    [[nodiscard]] double wall_load(const Bent& by) const { return wall_n > 0 ? by.in_plane_n / wall_n : 0; }
    /// Of a wall that can be saved.
    [[nodiscard]] double saved_wall_load(const Bent& by) const { return wall_lost ? 0 : wall_load(by); }
};

/// How a stretch pushes at what stands beside it.
[[nodiscard]] WallPush wall_push(const SeenStretch& stretch, const Operation& op, const Tool& tool);

/// By how much a cut passes what it may do: its wall error and the cutter's stress, what a thin wall of the
/// pattern bears, and what the wood that carries the cut does, each as a share of its limit.
struct CutLoad {
    double cutter = 0, wall = 0, wood = 0;
    /// Of what several passes make less whatever carries the cut.
    [[nodiscard]] double side() const { return std::max(cutter, wall); }
    [[nodiscard]] double worst() const { return std::max(side(), wood); }
};

/// What the cuts of one operation bear, and the feeds that they may have. One thread.
class FeedChoice {
public:
    /// @param shared of this very plan, or null. All that it borrows outlives it
    /// @param never_faster than planned
    FeedChoice(Context& context, const Job& job, const Operation& op, const Tool& tool, SharedBents* shared,
               bool never_faster);

    [[nodiscard]] BentCutter& cutting() { return cutting_; }
    [[nodiscard]] double wood_load(const SeenStretch& s, const Bent& bent) const;
    /// Of a cut whose feed is chosen, in the lowest of so many passes.
    [[nodiscard]] CutLoad load(const SeenStretch& s, int passes);
    /// Sets feed, bent, stated, wood_load and wall_lost.
    void choose(SeenStretch& s);
    /// The time that a cut takes whose feed is chosen, s/mm, in so many passes that share its depth alike.
    /// @param walls thin walls that stand in the layer; null: none
    [[nodiscard]] double pace(const SeenStretch& s, int passes, const WallMap* walls);

private:
    /// A feed that a class of cuts may have, with what it bears there once that was asked.
    struct FeedStep {
        std::uint32_t feed = 0;
        const Bent* bent = nullptr;
    };
    /// The steps of a class, fastest first, are the same wherever it is met.
    struct ClassFeeds {
        std::vector<FeedStep> steps;
        FeedStep* chosen = nullptr;  // where nothing hangs over and no thin wall stands
    };

    [[nodiscard]] double share(const Bent& bent) const { return cutting_.share(bent, limit_); }
    [[nodiscard]] CutLoad load_of(const SeenStretch& s, const Bent& bent);
    [[nodiscard]] double stated_share(const SeenStretch& s, double feed);
    [[nodiscard]] std::uint32_t most_of(std::uint32_t planned) const;
    [[nodiscard]] ClassFeeds& feeds_of(const SeenStretch& s, std::uint32_t planned);
    [[nodiscard]] const Bent& bent_at(const SeenStretch& s, FeedStep& step);
    [[nodiscard]] bool wall_is_lost(const SeenStretch& s, double least_feed);
    [[nodiscard]] FeedStep* slow_enough(const SeenStretch& s, std::vector<FeedStep>& steps);
    [[nodiscard]] FeedStep* as_stated(const SeenStretch& s, std::vector<FeedStep>& steps, FeedStep* step);

    Context& context_;
    const Job& job_;
    const Operation& op_;
    const Tool& tool_;
    BentCutter cutting_;
    const double limit_;  // mm, of the wall's error
    const bool never_faster_;
    const std::uint32_t fastest_;
    ByClassAndFeed<ClassFeeds> known_;
    ClassAndFeed last_key_;
    ClassFeeds* last_ = nullptr;
    std::size_t looked_at_ = 0;
};

}  // namespace slabwright
