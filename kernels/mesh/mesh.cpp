#include "kernels/mesh/mesh.h"

#include <algorithm>

#include "kernels/parallel/parallel.h"

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

Box3 bounds(Context& context, MeshView mesh) {
    if (mesh.facets.empty()) return {};
    auto part = [&](std::size_t begin, std::size_t end) {
        return bounds(MeshView{mesh.vertices, mesh.facets.subspan(begin, end - begin), {}});
    };
    return parallel_reduce(
        context, mesh.size(), std::size_t{1} << 16, part(0, 1), part, [](const Box3& a, const Box3& b) {
            return Box3{{std::min(a.min.x, b.min.x), std::min(a.min.y, b.min.y), std::min(a.min.z, b.min.z)},
                        {std::max(a.max.x, b.max.x), std::max(a.max.y, b.max.y), std::max(a.max.z, b.max.z)}};
        });
}

}  // namespace slabwright
