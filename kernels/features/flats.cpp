// Horizontal flats, both ways up, and what is too near to one to count beside it.
#include <algorithm>
#include <cmath>

#include "kernels/features/finders.h"
#include "kernels/features/plan_bins.h"

namespace slabwright {

std::vector<Feature> find_flats(MeshView mesh, std::vector<Patch>& patches, const FeatureOptions& options) {
    std::vector<Feature> flats;
    for (Patch& patch : patches) {
        const bool up = patch.facet_class == FacetClass::up_flat;
        if (!up && patch.facet_class != FacetClass::down_flat) continue;
        if (patch.facets.size() == 1 && smallest_height(mesh, patch.facets.front()) < options.chordal_deviation_mm) continue;
        flats.push_back(feature_of_patch(mesh, up ? FeatureType::up_flat : FeatureType::down_flat, std::move(patch)));
    }
    return flats;
}

namespace {

// Distance in plan from a point to a facet's projection, 0 inside.
double plan_distance(MeshView mesh, std::uint32_t facet, double x, double y) {
    const Index3 t = mesh.facets[facet];
    double nearest = HUGE_VAL;
    bool left = true, right = true;
    for (int k = 0; k < 3; ++k) {
        const Vec3d a = to_double(mesh.vertices[t[k]]), b = to_double(mesh.vertices[t[(k + 1) % 3]]);
        const double ex = b[0] - a[0], ey = b[1] - a[1], px = x - a[0], py = y - a[1];
        const double side = ex * py - ey * px, length2 = ex * ex + ey * ey;
        left = left && side >= 0;
        right = right && side <= 0;
        const double u = length2 > 0 ? std::clamp((px * ex + py * ey) / length2, 0.0, 1.0) : 0;
        nearest = std::min(nearest, std::hypot(px - u * ex, py - u * ey));
    }
    return left || right ? 0 : nearest;
}

}  // namespace

void drop_near_flats(Context& context, MeshView mesh, std::span<const Feature> flats, double reach_z, double reach_xy, std::vector<Feature>& points) {
    std::vector<std::uint32_t> facets;
    std::vector<double> heights;  // of each facet's flat
    for (const Feature& flat : flats)
        if (flat.type == FeatureType::up_flat)
            for (const std::uint32_t f : flat.facets) {
                facets.push_back(f);
                heights.push_back(flat.z_low);
            }
    if (facets.empty() || points.empty()) return;
    const PlanBins bins(context, mesh, facets);
    auto near_flat = [&](const Feature& p) {
        bool near = false;
        bins.visit(p.x - reach_xy, p.y - reach_xy, p.x + reach_xy, p.y + reach_xy, [&](std::uint32_t i) {
            near = near || (std::abs(heights[i] - p.z_low) <= reach_z && plan_distance(mesh, facets[i], p.x, p.y) <= reach_xy);
        });
        return near;
    };
    std::erase_if(points, near_flat);
}

}  // namespace slabwright
