// Groups of a solid's facets, and their corners as fibres read them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/cutting/layer_solid.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// The disc lies along the facets' areas together.
void lay_disc(std::span<const SolidFacet> facets, FacetGroup& group) {
    Vec3d area{0, 0, 0}, low = facets[0].p[0], high = low;
    for (const SolidFacet& f : facets) {
        const Vec3d n = cross(minus(f.p[1], f.p[0]), minus(f.p[2], f.p[0]));
        for (std::size_t k = 0; k < 3; ++k) {
            area[k] += n[k];
            low[k] = std::min({low[k], f.p[0][k], f.p[1][k], f.p[2][k]});
            high[k] = std::max({high[k], f.p[0][k], f.p[1][k], f.p[2][k]});
        }
    }
    const double length = std::sqrt(dot(area, area));
    for (std::size_t k = 0; k < 3; ++k) {
        group.middle[k] = static_cast<float>((low[k] + high[k]) / 2);
        group.axis[k] = length > 0 ? static_cast<float>(area[k] / length) : (k == 2 ? 1.0F : 0.0F);
    }
    const Vec3d middle{group.middle[0], group.middle[1], group.middle[2]},
        axis{group.axis[0], group.axis[1], group.axis[2]};
    double radius2 = 0, thickness = 0, far2 = 0;
    for (const SolidFacet& f : facets)
        for (const Vec3d& p : f.p) {
            const Vec3d d = minus(p, middle);
            const double along = dot(axis, d), d2 = dot(d, d);
            thickness = std::max(thickness, std::abs(along));
            radius2 = std::max(radius2, d2 - along * along);
            far2 = std::max(far2, d2);
        }
    // The axis is rounded, and so is what comes of it.
    const double rounding = 1e-6 * (1 + std::sqrt(far2));
    group.radius = static_cast<float>(std::sqrt(radius2) + rounding);
    group.thickness = static_cast<float>(thickness + rounding);
}

constexpr FacetNormals kAnyNormals;

// Of a facet, of its edges and of its corners that are to be tested.
Facing facing_of(const SolidFacet& facet, const FacetNormals& normals) {
    if (facet.normal == Vec3d{0, 0, 0}) return {{-1, -1, -1}, {1, 1, 1}};
    std::array<double, 3> low = facet.normal, high = low;
    const auto add = [&](const NormalBox& box) {
        for (std::size_t k = 0; k < 3; ++k)
            low[k] = std::min(low[k], box.low[k] * SolidFacet::kTurn),
            high[k] = std::max(high[k], box.high[k] * SolidFacet::kTurn);
    };
    for (std::size_t k = 0; k < 3; ++k) {
        if ((facet.edges >> k & 1) != 0) add(normals.edge[k]);
        if ((facet.ends >> k & 1) != 0) add(normals.corner[k]);
    }
    Facing facing{};
    for (std::size_t k = 0; k < 3; ++k)
        facing.low[k] = static_cast<float>(low[k] - SolidFacet::kNormalRounding),
        facing.high[k] = static_cast<float>(high[k] + SolidFacet::kNormalRounding);
    return facing;
}

// GroupCorners::aside.
float aside_at(const SolidFacet& facet, std::size_t corner) {
    constexpr double rounding = 2e-6;
    return facet.aside[corner] == SolidFacet::kAnyTurn
               ? GroupCorners::kAny
               : static_cast<float>(facet.aside[corner] * SolidFacet::kTurn + rounding);
}

}  // namespace

std::vector<FacetGroup> facet_groups(Context& context, std::span<const SolidFacet> facets,
                                     std::span<const FacetNormals> normals) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    auto down = [](double v) { return std::nextafter(static_cast<float>(v), -inf); };
    auto up = [](double v) { return std::nextafter(static_cast<float>(v), inf); };
    std::vector<FacetGroup> groups((facets.size() + FacetGroup::kFacets - 1) / FacetGroup::kFacets);
    parallel_for(context, groups.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) {
            FacetGroup group{{inf, inf}, {-inf, -inf}, inf, -inf, -inf, {}, {}, 0, 0, {}};
            const std::span<const SolidFacet> own =
                facets.subspan(g * FacetGroup::kFacets,
                               std::min(FacetGroup::kFacets, facets.size() - g * FacetGroup::kFacets));
            for (const SolidFacet& f : own) {
                for (const Vec3d& p : f.p)
                    for (std::size_t k = 0; k < 2; ++k) {
                        group.low[k] = std::min(group.low[k], down(p[k]));
                        group.high[k] = std::max(group.high[k], up(p[k]));
                    }
                group.z_min = std::min(group.z_min, down(f.z_min));
                group.z_max = std::max(group.z_max, up(f.z_max));
                if (f.nz < 0) group.overhang = std::max(group.overhang, up(f.z_max));
            }
            lay_disc(own, group);
            group.facing = {{1, 1, 1}, {-1, -1, -1}};
            for (const SolidFacet& f : own) {
                const std::size_t i = g * FacetGroup::kFacets + static_cast<std::size_t>(&f - own.data());
                const Facing facing = facing_of(f, i < normals.size() ? normals[i] : kAnyNormals);
                for (std::size_t k = 0; k < 3; ++k) {
                    group.facing.low[k] = std::min(group.facing.low[k], facing.low[k]);
                    group.facing.high[k] = std::max(group.facing.high[k], facing.high[k]);
                }
            }
            groups[g] = group;
        }
    });
    return groups;
}

BulkVector<GroupCorners> group_corners(Context& context, std::span<const SolidFacet> facets,
                                       std::span<const FacetGroup> groups,
                                       std::span<const FacetNormals> normals) {
    constexpr float far_below = -1e15F;
    BulkVector<GroupCorners> corners(groups.size());
    parallel_for(context, groups.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t g = begin; g < end; ++g) {
            GroupCorners& to = corners[g];
            for (std::size_t i = 0; i < FacetGroup::kFacets; ++i) {
                const std::size_t f = g * FacetGroup::kFacets + i;
                for (std::size_t k = 0; k < 3; ++k)
                    for (std::size_t c = 0; c < 3; ++c)
                        to.p[c][k][i] = f < facets.size()
                                            ? static_cast<float>(facets[f].p[c][k] - groups[g].middle[k])
                                            : (k == 2 ? far_below : 0.0F);
                for (std::size_t k = 0; k < 3; ++k)
                    to.normal[k][i] = f < facets.size() ? static_cast<float>(facets[f].normal[k]) : 0.0F;
                to.nz[i] = f < facets.size() ? facets[f].nz : 0.0F;
                for (std::size_t c = 0; c < 3; ++c)
                    to.aside[c][i] = f < facets.size() ? aside_at(facets[f], c) : 0.0F;
                to.edges[i] = f < facets.size() ? facets[f].edges | facets[f].ends << 3 : 0;
                const FacetNormals& own = f < normals.size() ? normals[f] : kAnyNormals;
                for (std::size_t e = 0; e < 3; ++e)
                    for (std::size_t k = 0; k < 3; ++k) {
                        to.edge.low[e][k][i] = own.edge[e].low[k],
                        to.edge.high[e][k][i] = own.edge[e].high[k];
                        to.corner.low[e][k][i] = own.corner[e].low[k],
                        to.corner.high[e][k][i] = own.corner[e].high[k];
                    }
            }
        }
    });
    return corners;
}

}  // namespace slabwright
