// Rest machining: what earlier operations of the layer left standing, and only that, is cut by a cutter
// dropped onto the surface over it (METHOD.md section 11: corners that a ball does not reach; waste where the
// roughing cutter does not fit).
#pragma once

#include "engine/paths/runs/layer_cut.h"
#include "engine/stock/layer_stock.h"

namespace slabwright {

struct RestPass {
    OperationKind kind = OperationKind::corner;
    const char* purpose = "";
    double limit = 0;  ///< mm along the normal: what stands higher over the finished surface is worth a visit
    bool in_steps = false;  ///< level by level from the top, no deeper at once than the tool's stepdown
    double swath = 0;  ///< mm: what stands so near to a steep wall that rises as high is left to the level
                       ///< contours there
    /// mm along the normal that a ball's places keep off the surface, and a flat end mill's off walls: chords
    /// between them may take 0.95 of it, so the cutter never touches. What only the cutter itself enters is
    /// cut to the surface, within the gouge tolerance. 0: all is.
    double allowance = 0;
    double skin =
        0;  ///< mm: what only the cutter's outermost lowers, as thick as this, is no reason to go anywhere
    bool followed = false;  ///< by a narrower cutter of its kind: what no line meets is left to that
    bool on_slopes = true;  ///< false: what stands on slopes or near them is left to a ball; floors and
                            ///< upright walls only
};

/// The allowance of semi-roughing in steps, mm: a third of what roughing leaves, no more than a tenth of the
/// cutter's diameter and a fifth of `limit` (RestPass), so that it is no reason to go anywhere. 0 where that
/// is too little against the gouge tolerance to be of use.
[[nodiscard]] double semi_rough_allowance(const Job& job, const Tool& tool, double limit);

/// Cuts what is left over the limit wherever this tool can lower it, and takes it off the stock.
[[nodiscard]] Operation cut_rest(const LayerCut& cut, LayerStock& stock, const Tool& tool,
                                 const RestPass& pass);

}  // namespace slabwright
