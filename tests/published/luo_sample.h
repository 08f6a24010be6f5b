// The job and the layers of LUO's sample part (LUO 5.6), as print states them.
#pragma once

#include <vector>

#include "engine/job.h"
#include "engine/layer_job.h"
#include "engine/tools/libraries.h"
#include "kernels/features/features.h"
#include "kernels/mesh/mesh.h"

namespace slabwright {

inline Job luo_job() {
    Job job;
    job.tools = luo_library();
    job.tolerances.cusp = 0.002 * kInch;  // from which .0445 in follows
    job.tolerances.rough_cusp = 0.01 * kInch;
    job.slabs.thicknesses = {0.75 * kInch};
    job.slabs.length = 10 * kInch;  // "0.75 inch thick 10 × 8 inch MDF"
    job.slabs.width = 8 * kInch;
    job.slabs.facing_allowance = 0;
    job.selection.compare = false;
    job.selection.accessibility = AccessRule::printed;
    return job;
}

/// A layer between two heights, inches, the part in the middle of its slab.
inline LayerJob luo_layer(const Mesh& mesh, const Job& job, const std::vector<Feature>& features,
                          double z_bottom_in, double z_top_in) {
    LayerJob layer;
    layer.mesh = mesh.view();
    layer.job = &job;
    layer.z_bottom = z_bottom_in * kInch;
    layer.z_top = z_top_in * kInch;
    layer.slab_thickness = 0.75 * kInch;
    const Box3 box = bounds(mesh.view());
    const double dx = (job.slabs.length - (box.max.x - box.min.x)) / 2,
                 dy = (job.slabs.width - (box.max.y - box.min.y)) / 2;
    layer.stock_min = {box.min.x - dx, box.min.y - dy};
    layer.stock_max = {box.max.x + dx, box.max.y + dy};
    for (const Feature& f : features)
        if (f.type == FeatureType::up_flat && f.z_low > layer.z_bottom && f.z_low < layer.z_top)
            layer.flats.push_back({f.z_low, f.z_low});
    return layer;
}

}  // namespace slabwright
