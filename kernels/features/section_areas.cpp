#include "kernels/features/section_areas.h"

#include <algorithm>
#include <cmath>

#include "kernels/features/facet_classes.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

// Signed area in plan of the part of a facet above z. Facets at z belong below (the section is taken just
// above).
double plan_area_above(MeshView mesh, std::uint32_t f, double z) {
    std::array<Vec3d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = to_double(mesh.vertices[mesh.facets[f][k]]);
    double twice = 0;
    // The clipped polygon's area about p[0], edge by edge; where the facet dips below z two crossings join
    // each other.
    std::array<std::array<double, 2>, 4> q;
    std::size_t n = 0;
    for (int k = 0; k < 3; ++k) {
        const Vec3d &a = p[k], &b = p[(k + 1) % 3];
        if (a[2] > z) q[n++] = {a[0] - p[0][0], a[1] - p[0][1]};
        if ((a[2] > z) != (b[2] > z)) {
            const double u = (z - a[2]) / (b[2] - a[2]);
            q[n++] = {a[0] + u * (b[0] - a[0]) - p[0][0], a[1] + u * (b[1] - a[1]) - p[0][1]};
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        const auto &a = q[i], &b = q[(i + 1) % n];
        twice += a[0] * b[1] - a[1] * b[0];
    }
    return twice / 2;
}

}  // namespace

std::size_t SectionAreas::slab(double z) const {
    const double i = (z - bottom_) / pitch_;
    if (!(i > 0)) return 0;
    return std::min(static_cast<std::size_t>(std::min(i, 1e9)), whole_.size() - 1);
}

SectionAreas::SectionAreas(Context& context, MeshView mesh) : mesh_(mesh) {
    const Box3 box = bounds(context, mesh);
    bottom_ = box.min.z;
    if (!mesh.roles.empty()) {  // what facets cover in plan then counts overlaps twice
        context_ = &context;
        return;
    }
    const double height = std::max(1e-3, static_cast<double>(box.max.z) - bottom_);
    const std::size_t grain = std::max(std::size_t{1} << 16, mesh.size() / 64);
    // The slabs [first, last] that a facet reaches into; last < first of one that is seen from the side.
    struct Reach {
        std::uint16_t first = 1, last = 0;
    };
    const MemoryCharge reach_charge(context, mesh.size() * sizeof(Reach), "the areas of sections");
    RawArray<Reach> reaches(mesh.size());
    struct Sums {
        std::uint64_t entries = 0;
        std::vector<double> begins;  // plan area of the facets that begin in each slab
    } sums;
    // Fewer slabs where tall facets would be listed in too many of them.
    for (std::size_t slabs = 1024;; slabs /= 4) {
        pitch_ = height / static_cast<double>(slabs);
        whole_.assign(slabs, 0);
        sums = parallel_reduce(
            context, mesh.size(), grain, Sums{0, std::vector<double>(slabs, 0)},
            [&](std::size_t begin, std::size_t end) {
                Sums part{0, std::vector<double>(slabs, 0)};
                for (std::size_t f = begin; f < end; ++f) {
                    reaches[f] = {};
                    const double area = area_normal(mesh, static_cast<std::uint32_t>(f))[2] / 2;
                    if (area == 0) continue;
                    const Index3& t = mesh.facets[f];
                    const auto [low, high] =
                        std::minmax({mesh.vertices[t[0]].z, mesh.vertices[t[1]].z, mesh.vertices[t[2]].z});
                    const Reach reach{static_cast<std::uint16_t>(slab(low)),
                                      static_cast<std::uint16_t>(slab(high))};
                    reaches[f] = reach;
                    part.entries += reach.last - reach.first + 1u;
                    part.begins[reach.first] += area;
                }
                return part;
            },
            [](Sums x, const Sums& y) {
                x.entries += y.entries;
                for (std::size_t k = 0; k < x.begins.size(); ++k) x.begins[k] += y.begins[k];
                return x;
            });
        if (slabs == 1 || sums.entries <= 8 * mesh.size() + 4096) break;
    }
    const auto each_slab = [&](std::size_t begin, std::size_t end, auto&& take) {
        for (std::size_t f = begin; f < end; ++f)
            for (std::size_t k = reaches[f].first; k <= reaches[f].last; ++k)
                take(k, static_cast<std::uint32_t>(f));
    };
    starts_.assign(whole_.size() + 1, 0);
    deal(
        context, mesh.size(), grain, whole_.size(),
        [&](std::size_t begin, std::size_t end, auto&& take) {
            each_slab(begin, end, [&](std::size_t k, std::uint32_t) { take(k); });
        },
        each_slab,
        [&](std::uint64_t total, std::uint64_t) {
            charge_ = std::make_shared<MemoryCharge>(context, total * sizeof(std::uint32_t),
                                                     "the areas of sections");
            facets_.resize(total);
            return std::pair(facets_.data(), total);
        },
        [&](std::size_t, std::size_t, std::span<const std::uint32_t> starts) {
            starts_.assign(starts.begin(), starts.end());
        });
    for (std::size_t k = whole_.size() - 1; k-- > 0;) whole_[k] = whole_[k + 1] + sums.begins[k + 1];
}

double SectionAreas::operator()(double z) const {
    if (mesh_.size() == 0 || z < bottom_) return 0;
    if (context_ != nullptr) {
        const Plane plane{z, Side::above};
        return area(slice(*context_, mesh_, {&plane, 1})[0].loops);
    }
    const std::size_t k = slab(z);
    double area = whole_[k];
    for (std::uint32_t i = starts_[k]; i < starts_[k + 1]; ++i) area += plan_area_above(mesh_, facets_[i], z);
    return std::max(0.0, area);
}

}  // namespace slabwright
