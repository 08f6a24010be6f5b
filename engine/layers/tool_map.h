// Which finish tool reaches what, over the pattern's height (LUO 6.4.2).
#pragma once

#include <vector>

#include "engine/layers/combined.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct ToolMap {
    std::vector<Tool> tools;         ///< the job's ball end mills, in rising diameter
    std::vector<double> allowed_mm;  ///< how tall a layer each may make: see allowed_layer
    std::vector<ToolSlice> slices;   ///< of one tool each, from 0 to the pattern's height
};

/// How tall a layer an end mill of the job may make, mm: as long as it may be until its hardest cut bends it
/// by the cusp (LUO eq. 11), at most as its flutes are, less what it must reach past the layer's bottom and
/// its distance from the holder.
/// @throws Error(usage, "forces.segment") for a tool or material that the force model does not take
[[nodiscard]] double allowed_layer(const Job& job, const Tool& tool);

/// For slices of 1/64 of the height, at least 1.27 mm, cut at the flats' heights too: the largest ball end
/// mill that reaches the job's share (selection.threshold) of the border of the section in the slice's
/// middle, else the smallest.
/// @throws Error(usage, "job.tool") when the job has no ball end mill; Error(cancelled)
[[nodiscard]] ToolMap tool_map(Context& context, MeshView mesh, const Job& job,
                               const std::vector<Feature>& features);

}  // namespace slabwright
