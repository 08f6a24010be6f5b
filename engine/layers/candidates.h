// The placements among which the strategy `combined` chooses.
#pragma once

#include <string>
#include <vector>

#include "engine/layers/layers.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct LayerCandidate {
    std::string name;      ///< in words
    double max_layer = 0;  ///< what the placement kept to, mm
    LayerPlacement placement;
};

/// What the other strategies give, so that none of these is ever faster, and beside them what slabs bonded to
/// any thickness allow: layers as tall as every tool makes them, and those of the tool map (LUO 6.4.2), each
/// as tall as its own finish tool is allowed to be long. Left out is what has the boundaries of one before
/// it, and of the bonded ones what breaks more down-facing flats or Type I features, or has more thin layers,
/// than `optimal`: no gain, however fast it is made.
/// @throws Error(usage, "layers.request"), and what tool_map() throws
[[nodiscard]] std::vector<LayerCandidate> layer_candidates(Context& context, MeshView mesh, const Job& job,
                                                           const LayerRequest& request);

}  // namespace slabwright
