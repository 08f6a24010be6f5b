#include "kernels/access/deviation.h"

#include <algorithm>
#include <limits>

#include "kernels/access/closest_point.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

double farthest(Context& context, MeshView from, MeshView to) {
    const ClosestPoint closest(context, to);
    const std::size_t vertices = from.vertices.size();
    return parallel_reduce(
        context, vertices + from.facets.size(), 4096, 0.0,
        [&](std::size_t begin, std::size_t end) {
            double most = 0;
            for (std::size_t i = begin; i < end; ++i) {
                Point3 p{};
                if (i < vertices) {
                    p = {from.vertices[i].x, from.vertices[i].y, from.vertices[i].z};
                } else {
                    for (const std::uint32_t v : from.facets[i - vertices])
                        p[0] += from.vertices[v].x / 3.0, p[1] += from.vertices[v].y / 3.0, p[2] += from.vertices[v].z / 3.0;
                }
                most = std::max(most, closest.query_unsigned(p, std::numeric_limits<double>::infinity()).distance);
            }
            return most;
        },
        [](double a, double b) { return std::max(a, b); });
}

}  // namespace

double surface_deviation(Context& context, MeshView a, MeshView b) {
    if (a.facets.empty() || b.facets.empty()) return 0;
    return std::max(farthest(context, a, b), farthest(context, b, a));
}

}  // namespace slabwright
