// At which heights the cuts of a sheet are fitted to the part (METHOD.md section 13).
#pragma once

#include <vector>

#include "engine/sheets/sheet_slicing.h"
#include "kernels/mesh/mesh.h"

namespace slabwright {

/// Of every span heights, ascending, from its bottom to its top: the ends of kCutSections even parts; those
/// of level facets and just below, where sections change at once (kMostSteps of them); and of the vertices
/// where those are no more than kMostVertexHeights. Where facets lean more than the head does, parts are
/// split into kFinerSections, since what a cut there leaves beyond what it must grows with them.
/// @param most_tilt_deg of the head from upright; 0: no part is split
[[nodiscard]] std::vector<std::vector<double>> heights_to_fit(MeshView mesh,
                                                              const std::vector<SheetSpan>& spans,
                                                              double most_tilt_deg);

}  // namespace slabwright
