// Horizontal flats, both ways up, and what is too near to one to count beside it.
#include <algorithm>
#include <cmath>

#include "kernels/features/finders.h"
#include "kernels/features/plan_bins.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

std::vector<Feature> find_flats(Context& context, MeshView mesh, std::vector<Patch>& patches,
                                const FeatureOptions& options) {
    std::vector<Feature> flats;
    for (Patch& patch : patches) {
        const bool up = patch.facet_class == FacetClass::up_flat;
        if (!up && patch.facet_class != FacetClass::down_flat) continue;
        if (patch.facets.size() == 1 &&
            smallest_height(mesh, patch.facets.front()) < options.chordal_deviation_mm)
            continue;
        flats.push_back(feature_of_patch(context, mesh, up ? FeatureType::up_flat : FeatureType::down_flat,
                                         std::move(patch)));
    }
    return flats;
}

namespace {

constexpr std::size_t kGrain = 8192;

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

// Where points lie in plan, to within a cell of a coarse grid: tells of a box, at once, that there are none
// in it.
class PointGrid {
public:
    explicit PointGrid(std::span<const Feature> points) : sums_((kCells + 1) * (kCells + 1), 0) {
        double x1 = -HUGE_VAL, y1 = -HUGE_VAL;
        for (const Feature& p : points)
            x0_ = std::min(x0_, p.x), y0_ = std::min(y0_, p.y), x1 = std::max(x1, p.x),
            y1 = std::max(y1, p.y);
        per_mm_ = static_cast<double>(kCells) / std::max({x1 - x0_, y1 - y0_, 1e-3});
        for (const Feature& p : points) ++sums_[(cell(p.y - y0_) + 1) * (kCells + 1) + cell(p.x - x0_) + 1];
        // How many lie left of and below every corner of the grid.
        for (std::size_t r = 1; r <= kCells; ++r)
            for (std::size_t c = 1; c <= kCells; ++c)
                sums_[r * (kCells + 1) + c] += sums_[(r - 1) * (kCells + 1) + c] +
                                               sums_[r * (kCells + 1) + c - 1] -
                                               sums_[(r - 1) * (kCells + 1) + c - 1];
    }
    [[nodiscard]] bool any(double x0, double y0, double x1, double y1) const {
        const std::size_t c0 = cell(x0 - x0_), r0 = cell(y0 - y0_), c1 = cell(x1 - x0_) + 1,
                          r1 = cell(y1 - y0_) + 1;
        auto below = [&](std::size_t r, std::size_t c) { return sums_[r * (kCells + 1) + c]; };
        return below(r1, c1) + below(r0, c0) != below(r0, c1) + below(r1, c0);
    }

private:
    static constexpr std::size_t kCells = 256;
    [[nodiscard]] std::size_t cell(double d) const {
        return d > 0 ? static_cast<std::size_t>(std::min(d * per_mm_, static_cast<double>(kCells - 1))) : 0;
    }
    double x0_ = HUGE_VAL, y0_ = HUGE_VAL, per_mm_ = 1;
    std::vector<std::uint32_t> sums_;
};

}  // namespace

void drop_near_flats(Context& context, MeshView mesh, std::span<const Feature> flats, double reach_z,
                     double reach_xy, std::vector<Feature>& points) {
    // Only flats at the height of some point are looked at, and of these only facets near one in plan: of
    // millions mostly few.
    if (points.empty()) return;
    std::vector<double> levels(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) levels[i] = points[i].z_low;
    std::sort(levels.begin(), levels.end());
    auto has_points = [&](double height) {
        // A bound a little lower than the test below needs none of its rounding.
        const auto first = std::lower_bound(levels.begin(), levels.end(), height - 2 * reach_z);
        return first != levels.end() && *first <= height + 2 * reach_z;
    };
    const PointGrid places(points);
    std::vector<std::uint32_t> facets;
    std::vector<double> heights;  // of each facet's flat
    for (const Feature& flat : flats) {
        if (flat.type != FeatureType::up_flat || !has_points(flat.z_low)) continue;
        const std::vector<std::uint32_t> near = parallel_reduce(
            context, flat.facets.size(), kGrain, std::vector<std::uint32_t>{},
            [&](std::size_t begin, std::size_t end) {
                std::vector<std::uint32_t> part;
                for (std::size_t i = begin; i < end; ++i) {
                    const Index3 t = mesh.facets[flat.facets[i]];
                    const Vec3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
                    if (places.any(std::min({a.x, b.x, c.x}) - reach_xy, std::min({a.y, b.y, c.y}) - reach_xy,
                                   std::max({a.x, b.x, c.x}) + reach_xy,
                                   std::max({a.y, b.y, c.y}) + reach_xy))
                        part.push_back(flat.facets[i]);
                }
                return part;
            },
            [](std::vector<std::uint32_t> a, const std::vector<std::uint32_t>& b) {
                a.insert(a.end(), b.begin(), b.end());
                return a;
            });
        facets.insert(facets.end(), near.begin(), near.end());
        heights.resize(facets.size(), flat.z_low);
    }
    if (facets.empty()) return;
    const PlanBins bins(context, mesh, facets);
    auto near_flat = [&](const Feature& p) {
        bool near = false;
        bins.visit(p.x - reach_xy, p.y - reach_xy, p.x + reach_xy, p.y + reach_xy, [&](std::uint32_t i) {
            near = near || (std::abs(heights[i] - p.z_low) <= reach_z &&
                            plan_distance(mesh, facets[i], p.x, p.y) <= reach_xy);
        });
        return near;
    };
    std::erase_if(points, near_flat);
}

}  // namespace slabwright
