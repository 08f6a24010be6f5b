// The forces of every stretch of a layer's programs, and feeds that fit them (METHOD.md sections 8 and 9).
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "engine/forces/min_material.h"
#include "engine/forces/wall_map.h"
#include "engine/plan.h"
#include "engine/stock/cut_stretches.h"
#include "kernels/forces/forces.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The cut of a stretch at this feed (mm/min). Depth and width are rounded up to classes (64 to a doubling of
/// the depth, a 240th of the diameter), so that a layer of any length has some thousands of different cuts. A
/// ball that engages no higher than its radius is as wide as its circle there.
[[nodiscard]] CutSegment cut_of(const CutStretch& stretch, const Tool& tool, const Job& job, double feed);

/// What an operation may bend its cutter, normal to the way, mm: roughing as much as it leaves for finishing,
/// less what wider corners than a finish pass's (Operation::blend) and arcs (rough_fit) may take of that,
/// semi-roughing what it leaves itself (Operation::spare), finishing the cusp, facing what facing takes off.
[[nodiscard]] double bending_limit(const Operation& operation, const Job& job);

/// Feeds come in this many steps of the fastest that tool and machine allow.
inline constexpr int kFeedSteps = 16;

/// The least share of a planned feed: slower, a cutter rubs.
inline constexpr double kLeastFeedShare = 0.125;

/// The different cuts of a layer's operations, in the order in which they are met first.
struct LayerCuts {
    std::vector<CutSegment> cuts;
    std::vector<std::array<float, 3>> places;  ///< mm, where each is met first
    std::vector<std::uint32_t> moves;          ///< and by which move
    std::vector<std::size_t> starts;           ///< of each operation's, and their end
    double strain = 0;  ///< the largest share of a limit of cutter, spindle or wall that is still borne
    double cutter_strain = 0;  ///< of cutter and spindle alone
};

/// What the cuts of a plan's tools bear, for the layers of one plan to tell each other: most of a layer's
/// cuts are met in others too. Several threads may use it at once.
class KnownCuts {
public:
    KnownCuts();
    ~KnownCuts();
    KnownCuts(const KnownCuts&) = delete;
    KnownCuts& operator=(const KnownCuts&) = delete;
    struct Impl;
    [[nodiscard]] Impl& impl() { return *impl_; }

private:
    std::unique_ptr<Impl> impl_;
};

/// What adapt_layer may do to the feeds, where the job adapts them.
enum class FeedChange : std::uint8_t {
    any,
    lower  ///< of a layer whose feeds have been adapted before: faster than that they were found too fast
};

/// What of the wood limits a layer's cuts.
struct WoodLimits {
    const OverhangMap* overhang = nullptr;  ///< how far each place lies from what carries this slab; null:
                                            ///< nothing hangs over
    const WallMap* walls = nullptr;         ///< thin walls that stand in it; null: none
};

/// Runs a layer's operations, in their order, through a standing slab. Four things are looked at for every
/// stretch: what the bending cutter leaves on a wall against the operation's limit, the cutter's stress
/// against its strength where the job states one, the stress at the foot of a thin wall beside the cut
/// (WallMap), and, where the slab hangs over, the wood against what the
/// cut needs (section 9): roughing is carried by what stands, floors by what stays under them.
///   * Where the job adapts feeds, every move gets the fastest of kFeedSteps steps at which all four hold,
///   but not under an eighth of what was planned,
///     and at which the thickest chip is no thicker than planned: that of a slot at the planned feed, the
///     finish feed or the tool's. A faster feed is taken only where it lasts for at least 20 mm; roughing,
///     facing and entries at the plunge feed are never made faster than planned. Where it is the wood that
///     holds at no feed, the planned one stays: slower, it would break as well.
///   * Where the job adapts stepdowns, what holds at no feed is cut in several passes (split_cuts.h); for
///   wood only where the lowest of them then holds, and where none of the operation's cuts
///     breaks it all the same.
/// Moves straight down that meet more than a cubic millimetre of wood go no faster than Tool::plunge_feed.
/// Drills are left alone.
/// @param known of this very plan, or null
/// @param diagnostics gets, per operation, "stepdown.lowered" (how many, how long, the deepest),
/// "feed.lowered" (where and how far), and
///                    "cut.overhang" where the wood would break all the same; of the layer "wall.weak", where
///                    the foot of a wall would
/// @throws Error(usage, "forces.spindle") when an operation mills with its spindle at rest; Error(usage,
/// "forces.segment"); Error(cancelled)
[[nodiscard]] LayerCuts adapt_layer(Context& context, Layer& layer, const Plan& plan,
                                    const WoodLimits& limits, std::vector<Diagnostic>& diagnostics,
                                    KnownCuts* known = nullptr, FeedChange change = FeedChange::any);

/// Sets of every operation peak_force_n (resultant), deflection_mm (of the tip, in the plane), wall_error_mm
/// (normal to the way), peak_at and peak_move, from the closed form or the double reference; many cuts are
/// screened on a device, and the plan says so when there was none.
/// @param layers as adapt_layer gave them, one for each layer of the plan
/// @param solver a SolverAhead's (kernels/forces/hardest.h); none: the double model looks at all
/// @returns for each layer "cut.deflection" and "cut.strength", per operation, where a limit is passed all
/// the same
/// @throws Error(usage, "forces.segment"), Error(usage, "forces.device"), Error(cancelled)
[[nodiscard]] std::vector<std::vector<Diagnostic>> rate_layers(Context& context, Plan& plan,
                                                               std::span<const LayerCuts> layers,
                                                               ForceSolver* solver);

/// adapt_layer and rate_layers of one layer over nothing that hangs over.
void rate_layer(Context& context, Layer& layer, const Plan& plan, std::vector<Diagnostic>& diagnostics);

/// The longest that the operation's tool might be, mm from holder to tip: where it would bend by the
/// operation's limit (LUO eq. 11); 0 where it bends nowhere.
[[nodiscard]] double allowed_length(const Operation& operation, const Tool& tool, const Job& job);

}  // namespace slabwright
