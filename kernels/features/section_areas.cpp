#include "kernels/features/section_areas.h"

#include <algorithm>
#include <cmath>

#include "kernels/features/facet_classes.h"

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
    const Box3 box = bounds(mesh);
    bottom_ = box.min.z;
    const double height = std::max(1e-3, static_cast<double>(box.max.z) - bottom_);
    struct Span {
        double low, high;
    };
    auto span_of = [&](std::uint32_t f) {
        const Index3 t = mesh.facets[f];
        const auto [low, high] = std::minmax({mesh.vertices[t[0]].z, mesh.vertices[t[1]].z, mesh.vertices[t[2]].z});
        return Span{low, high};
    };
    // Fewer slabs where tall facets would be listed in too many of them.
    for (std::size_t slabs = 1024;; slabs /= 4) {
        pitch_ = height / static_cast<double>(slabs);
        whole_.assign(slabs, 0);
        starts_.assign(slabs + 1, 0);
        std::uint64_t entries = 0;
        for (std::uint32_t f = 0; f < mesh.size(); ++f) {
            if (area_normal(mesh, f)[2] == 0) continue;
            const Span s = span_of(f);
            for (std::size_t i = slab(s.low); i <= slab(s.high); ++i) ++starts_[i];
            entries += slab(s.high) - slab(s.low) + 1;
        }
        context.throw_if_cancelled();
        if (slabs == 1 || entries <= 8 * mesh.size() + 4096) break;
    }
    std::uint32_t sum = 0;
    for (std::uint32_t& s : starts_) s = sum += s;
    facets_.resize(sum);
    std::vector<double> begins(whole_.size(), 0);  // plan area of the facets that begin in each slab
    for (std::size_t i = mesh.size(); i-- > 0;) {
        const auto f = static_cast<std::uint32_t>(i);
        const double area = area_normal(mesh, f)[2] / 2;
        if (area == 0) continue;
        const Span s = span_of(f);
        for (std::size_t k = slab(s.low); k <= slab(s.high); ++k) facets_[--starts_[k]] = f;
        begins[slab(s.low)] += area;
    }
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
