// What of every facet a tool reaches, layer by layer: the map behind AR.
#pragma once

#include <functional>
#include <vector>

#include "engine/plan.h"
#include "kernels/access/accessibility.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Of one tool in one layer.
struct AccessMap {
    int layer = 0;                ///< Layer::index
    int tool = 0;                 ///< Tool::number
    Accessibility accessibility;  ///< with `share`: per facet of the mesh, −1 where nothing of it is to be
                                  ///< machined in the layer
};

/// Of each layer of a plan, for the flat and ball end mills that were looked at for it or cut it, in the
/// order of their numbers. By the exact rule, with shank and holder, whichever rule the job names, and up to
/// tolerances.cusp, which finish passes may leave.
/// @param mesh the pattern that was planned, pattern-base
/// @param take called with one map after the other
/// @throws Error(cancelled)
void access_maps(Context& context, MeshView mesh, const Plan& plan,
                 const std::function<void(const AccessMap&)>& take);

}  // namespace slabwright
