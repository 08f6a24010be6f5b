// What the report tells of slabs' undersides.
#pragma once

#include <string>
#include <vector>

#include "io/read/planned_folder.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// By layer, whether its slab is milled from below too.
[[nodiscard]] std::vector<bool> milled_below(const PlannedFolder& folder);

/// A JSON list, for each underside: its slab as it lies turned over, mm, where it is milled (`region`,
/// outlines in hundredths of a millimetre), its dowels' holes, and its programs.
/// @param mesh the pattern. @throws Error(input) where a plan of an underside cannot be read
[[nodiscard]] std::string report_undersides(Context& context, const PlannedFolder& folder, MeshView mesh,
                                            const FolderRefusal& refusal);

}  // namespace slabwright
