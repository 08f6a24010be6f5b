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

// Signed, of the part of a facet above z; facets at z belong below (the section is taken just above).
struct PartAbove {
    double area = 0;    // in plan, mm²
    double volume = 0;  // between the part and z, mm³
};

PartAbove part_above(MeshView mesh, std::uint32_t f, double z) {
    std::array<Vec3d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = to_double(mesh.vertices[mesh.facets[f][k]]);
    // The clipped polygon about p[0] in plan, its third coordinate the height over z; where the facet dips
    // below z two crossings join each other.
    std::array<std::array<double, 3>, 4> q;
    std::size_t n = 0;
    for (int k = 0; k < 3; ++k) {
        const Vec3d &a = p[k], &b = p[(k + 1) % 3];
        if (a[2] > z) q[n++] = {a[0] - p[0][0], a[1] - p[0][1], a[2] - z};
        if ((a[2] > z) != (b[2] > z)) {
            const double u = (z - a[2]) / (b[2] - a[2]);
            q[n++] = {a[0] + u * (b[0] - a[0]) - p[0][0], a[1] + u * (b[1] - a[1]) - p[0][1], 0};
        }
    }
    double twice = 0, sixfold = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const auto &a = q[i], &b = q[(i + 1) % n];
        twice += a[0] * b[1] - a[1] * b[0];
    }
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const auto &o = q[0], &a = q[i], &b = q[i + 1];
        sixfold += ((a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])) * (o[2] + a[2] + b[2]);
    }
    return {twice / 2, sixfold / 6};
}

/// Of the facets that begin in each slab.
struct SlabSums {
    explicit SlabSums(std::size_t slabs) : areas(slabs, 0), moments(slabs, 0) {}
    std::uint64_t entries = 0;    // in all slabs that facets reach into
    std::vector<double> areas;    // in plan
    std::vector<double> moments;  // the same, each times its centroid's height
};

SlabSums sum(SlabSums x, const SlabSums& y) {
    x.entries += y.entries;
    for (std::size_t k = 0; k < x.areas.size(); ++k) {
        x.areas[k] += y.areas[k];
        x.moments[k] += y.moments[k];
    }
    return x;
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
    SlabSums sums(0);
    // Fewer slabs where tall facets would be listed in too many of them.
    for (std::size_t slabs = 1024;; slabs /= 4) {
        pitch_ = height / static_cast<double>(slabs);
        whole_.assign(slabs, 0);
        sums = parallel_reduce(
            context, mesh.size(), grain, SlabSums(slabs),
            [&](std::size_t begin, std::size_t end) {
                SlabSums part(slabs);
                for (std::size_t f = begin; f < end; ++f) {
                    reaches[f] = {};
                    const double area = area_normal(mesh, static_cast<std::uint32_t>(f))[2] / 2;
                    if (area == 0) continue;
                    const Index3& t = mesh.facets[f];
                    const double a = mesh.vertices[t[0]].z, b = mesh.vertices[t[1]].z,
                                 c = mesh.vertices[t[2]].z;
                    const auto [low, high] = std::minmax({a, b, c});
                    const Reach reach{static_cast<std::uint16_t>(slab(low)),
                                      static_cast<std::uint16_t>(slab(high))};
                    reaches[f] = reach;
                    part.entries += reach.last - reach.first + 1u;
                    part.areas[reach.first] += area;
                    part.moments[reach.first] += area * (a + b + c) / 3;
                }
                return part;
            },
            sum);
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
    moments_.assign(whole_.size(), 0);
    for (std::size_t k = whole_.size() - 1; k-- > 0;) {
        whole_[k] = whole_[k + 1] + sums.areas[k + 1];
        moments_[k] = moments_[k + 1] + sums.moments[k + 1];
    }
}

double SectionAreas::operator()(double z) const {
    if (mesh_.size() == 0 || z < bottom_) return 0;
    if (context_ != nullptr) {
        const Plane plane{z, Side::above};
        return area(slice(*context_, mesh_, {&plane, 1})[0].loops);
    }
    const std::size_t k = slab(z);
    double area = whole_[k];
    for (std::uint32_t i = starts_[k]; i < starts_[k + 1]; ++i) area += part_above(mesh_, facets_[i], z).area;
    return std::max(0.0, area);
}

double SectionAreas::volume_above(double z) const {
    const std::size_t k = slab(z);
    double volume = moments_[k] - whole_[k] * z;
    for (std::uint32_t i = starts_[k]; i < starts_[k + 1]; ++i)
        volume += part_above(mesh_, facets_[i], z).volume;
    return volume;
}

double SectionAreas::volume_between(double low, double high) const {
    low = std::max(low, bottom_);
    if (mesh_.size() == 0 || !(high > low)) return 0;
    if (context_ == nullptr) return std::max(0.0, volume_above(low) - volume_above(high));
    constexpr int pieces = 64;
    const double step = (high - low) / pieces, inside = 1e-7 * (high - low);
    double sum = 0;
    for (int i = 0; i < pieces; ++i) {
        const double a = low + i * step;
        sum += (*this)(a + inside) + 4 * (*this)(a + step / 2) + (*this)(a + step - inside);
    }
    return sum * step / 6;
}

}  // namespace slabwright
