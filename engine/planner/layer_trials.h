// Planning a layer with one set of tools after another.
#pragma once

#include <limits>
#include <optional>

#include "engine/forces/min_material.h"
#include "engine/forces/wall_map.h"
#include "engine/paths/paths.h"
#include "engine/planner/layer_plan.h"
#include "engine/tool_choice/select.h"

namespace slabwright {

/// A layer as one set of tools makes it, with the forces of its programs and the feeds that they allow.
struct Trial {
    PlannedLayer planned;
    double minutes = 0;  ///< of its programs and the changes of tool between them, where it is asked for
    LayerPace pace{};    ///< where it is asked for
    bool floors_slowed = false;      ///< what thin walls bear made its floors take notably longer
    std::optional<double> left_mm2;  ///< none: given up before all its paths were planned
    bool leaves_more = false;        ///< than it may
    bool whole = true;               ///< false: given up, its feeds were not adapted
    bool strained = false;           ///< cutter, spindle or a thin wall bear more than they may
    bool only_walls = false;         ///< and of them only thin walls
};

/// When a set of tools is not followed any further.
struct TrialLimits {
    std::optional<PaceAhead> ahead;
    double left_mm2 = std::numeric_limits<double>::infinity();
};

/// What all trials of a layer share.
class LayerTrials {
public:
    /// @param ground outlives this
    LayerTrials(Context& context, const LayerGround& ground, std::size_t index);

    /// The job with tools that may be used in this layer.
    [[nodiscard]] const Job& job() const { return fitted_; }
    /// All but its tools.
    [[nodiscard]] const LayerJob& layer() const { return work_; }
    [[nodiscard]] const Overrun& overrun() const { return overrun_; }
    /// From now on the minutes and paces of trials are asked for.
    void compare() { compared_ = true; }

    /// Paths of a set, none of them laid yet.
    [[nodiscard]] LayerPaths begin(const LayerTools& tools);
    /// Plans the layer with a set. A floor's cutter takes what roughing has left on the walls beside it at
    /// once, up to their tops: for all walls that bear it the quickest. Where thin ones do not, and its feed
    /// falls or it goes in several passes, the walls are tried first: level by level, around them and so from
    /// both sides, and nothing of them is left to the floors.
    /// @param cleared its paths up to where the waste is cleared; null: they are to be laid
    [[nodiscard]] Trial plan(const LayerTools& tools, const TrialLimits& limits, ProgressPart& part,
                             LayerPaths* cleared = nullptr);

private:
    [[nodiscard]] std::vector<Flat> flats_between(double z) const;
    void set_tools(const LayerTools& tools);
    [[nodiscard]] Trial plan_once(const LayerTools& tools, const TrialLimits& limits, ProgressPart& part);
    [[nodiscard]] Trial with_forces(LayerResult result, const TrialLimits& limits);

    Context& context_;
    const LayerGround& ground_;
    const Layer& layer_;
    Job fitted_;  // a layer may be taller than the shortest tools make; the others make it then
    const Overrun overrun_;
    Mesh near_;  // what of the ground the layer's cutters may meet
    LayerJob work_;
    bool compared_ = false;
    std::optional<OverhangMap> overhang_;
    std::optional<WallMap> walls_;
};

/// What is over its most by no more than differently fine cells see, mm².
inline constexpr double kMoreLeft = 1.1, kFewLeft = 5;

}  // namespace slabwright
