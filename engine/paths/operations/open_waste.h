// What lies open from beside the stock, clear of the part: the face mill, which has just faced the slab,
// roughs it before the end mill does.
#pragma once

#include <span>
#include <vector>

#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/rings.h"
#include "engine/stock/engagement.h"

namespace slabwright {

/// A level of roughing, or a part of one, as the face mill takes it.
struct OpenLevel {
    bool whole = false;  ///< of roughing; terraces are not looked at
    RingPlan rings;      ///< of the face mill; no pieces where it has nothing to do
    double above = 0;    ///< mm: what stands there stands this high
    Loops left;  ///< where the middle of the end mill, which comes after it, still meets something; with
                 ///< rings only
    double saved = 0;  ///< minutes that the end mill would take longer
};

/// The face mill of a job that has it rough (Cutting::open_waste), where it can: in a layer no deeper than
/// its holder leaves room for, with levels for an end mill's rings, and without a flask, which leaves no way
/// in. Null where not.
[[nodiscard]] const Tool* open_waste_tool(const LayerCut& cut);

/// Plans what the face mill takes of a level: all places at which it is kCollar farther from what the end
/// mill must spare than that is, and to which a way leads from beside the stock; rings around the rest, as
/// plan_rings() makes them.
/// @param tool      the end mill
/// @param forbidden of the end mill's middle, as simplify() or unite() give it
/// @param tip_z     mm; @param above_z mm, what stands there
/// @param hold      as for plan_rings()
[[nodiscard]] OpenLevel plan_open_level(const LayerCut& cut, const Tool& face, const Tool& tool,
                                        const Loops& forbidden, double tip_z, double above_z, bool hold);

/// Below a level that the face mill does not take it takes none: it would meet what stands of that one too.
/// @param levels descending
void leave_below_first_gap(std::span<OpenLevel> levels);

/// Cuts levels, which descend. One with a run that has no way in is left to the end mill, and so are those
/// below it: they are made empty. No moves, and nothing changed, where there are none left, or where they are
/// not worth the face mill's time.
/// @param stock what the feed is lowered by (engagement.h), which is cut; null: it is not lowered
[[nodiscard]] Operation clear_open_waste(const LayerCut& cut, const Tool& face, std::span<OpenLevel> levels,
                                         EngagedStock* stock);

}  // namespace slabwright
