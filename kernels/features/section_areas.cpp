#include "kernels/features/section_areas.h"

#include <algorithm>
#include <cmath>

#include "kernels/features/facet_classes.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// Signed area in plan of the part of a facet above z. Facets at z belong below (the section is taken just above).
double plan_area_above(MeshView mesh, std::uint32_t f, double z) {
    std::array<Vec3d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = to_double(mesh.vertices[mesh.facets[f][k]]);
    double twice = 0;
    // The clipped polygon's area about p[0], edge by edge; where the facet dips below z two crossings join each other.
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
    const double height = std::max(1e-3, static_cast<double>(box.max.z) - bottom_);
    constexpr std::size_t grain = std::size_t{1} << 16;
    // Calls take(first slab, last slab, plan area) for a facet that is seen from above or below.
    auto with_slabs = [&](std::size_t f, auto&& take) {
        const double area = area_normal(mesh, static_cast<std::uint32_t>(f))[2] / 2;
        if (area == 0) return;
        const Index3 t = mesh.facets[f];
        const auto [low, high] = std::minmax({mesh.vertices[t[0]].z, mesh.vertices[t[1]].z, mesh.vertices[t[2]].z});
        take(slab(low), slab(high), area);
    };
    // Fewer slabs where tall facets would be listed in too many of them.
    for (std::size_t slabs = 1024;; slabs /= 4) {
        pitch_ = height / static_cast<double>(slabs);
        whole_.assign(slabs, 0);
        const std::uint64_t entries = parallel_reduce(
            context, mesh.size(), grain, std::uint64_t{0},
            [&](std::size_t begin, std::size_t end) {
                std::uint64_t count = 0;
                for (std::size_t f = begin; f < end; ++f)
                    with_slabs(f, [&](std::size_t first, std::size_t last, double) { count += last - first + 1; });
                return count;
            },
            [](std::uint64_t x, std::uint64_t y) { return x + y; });
        if (slabs == 1 || entries <= 8 * mesh.size() + 4096) break;
    }
    auto each_slab = [&](std::size_t begin, std::size_t end, auto&& take) {
        for (std::size_t f = begin; f < end; ++f)
            with_slabs(f, [&](std::size_t first, std::size_t last, double) {
                for (std::size_t k = first; k <= last; ++k) take(k, static_cast<std::uint32_t>(f));
            });
    };
    starts_.assign(whole_.size() + 1, 0);
    deal(
        context, mesh.size(), grain, whole_.size(),
        [&](std::size_t begin, std::size_t end, auto&& take) { each_slab(begin, end, [&](std::size_t k, std::uint32_t) { take(k); }); }, each_slab,
        [&](std::uint64_t total, std::uint64_t) {
            charge_ = std::make_shared<MemoryCharge>(context, total * sizeof(std::uint32_t), "the areas of sections");
            facets_.resize(total);
            return std::pair(facets_.data(), total);
        },
        [&](std::size_t, std::size_t, std::span<const std::uint32_t> starts) { starts_.assign(starts.begin(), starts.end()); });
    // Plan area of the facets that begin in each slab.
    const std::vector<double> begins = parallel_reduce(
        context, mesh.size(), std::max(grain, mesh.size() / 64), std::vector<double>(whole_.size(), 0),
        [&](std::size_t begin, std::size_t end) {
            std::vector<double> part(whole_.size(), 0);
            for (std::size_t f = begin; f < end; ++f) with_slabs(f, [&](std::size_t first, std::size_t, double area) { part[first] += area; });
            return part;
        },
        [](std::vector<double> x, const std::vector<double>& y) {
            for (std::size_t k = 0; k < x.size(); ++k) x[k] += y[k];
            return x;
        });
    for (std::size_t k = whole_.size() - 1; k-- > 0;) whole_[k] = whole_[k + 1] + begins[k + 1];
}

double SectionAreas::operator()(double z) const {
    if (mesh_.size() == 0 || z < bottom_) return 0;
    const std::size_t k = slab(z);
    double area = whole_[k];
    for (std::uint32_t i = starts_[k]; i < starts_[k + 1]; ++i) area += plan_area_above(mesh_, facets_[i], z);
    return std::max(0.0, area);
}

}  // namespace slabwright
