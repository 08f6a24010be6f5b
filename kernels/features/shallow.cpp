// Type III: shallow slopes, as the z ranges of connected patches.
#include "kernels/features/finders.h"

namespace slabwright {

std::vector<Feature> find_shallow(Context& context, MeshView mesh, std::vector<Patch>& patches) {
    std::vector<Feature> found;
    for (Patch& patch : patches)
        if (patch.facet_class == FacetClass::shallow)
            found.push_back(feature_of_patch(context, mesh, FeatureType::shallow, std::move(patch)));
    return found;
}

}  // namespace slabwright
