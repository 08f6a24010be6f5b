#include "kernels/mesh/mesh.h"

#include <algorithm>

namespace slabwright {

Box3 bounds(MeshView mesh) {
    if (mesh.facets.empty()) return {};
    const Vec3f first = mesh.vertices[mesh.facets[0][0]];
    Box3 box{first, first};
    for (const Index3& facet : mesh.facets) {
        for (const std::uint32_t v : facet) {
            const Vec3f p = mesh.vertices[v];
            box.min = {std::min(box.min.x, p.x), std::min(box.min.y, p.y), std::min(box.min.z, p.z)};
            box.max = {std::max(box.max.x, p.x), std::max(box.max.y, p.y), std::max(box.max.z, p.z)};
        }
    }
    return box;
}

}  // namespace slabwright
