#include "kernels/features/facet_classes.h"

#include <algorithm>
#include <cmath>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kGrain = 4096;

struct Extent {
    double lowest = HUGE_VAL, largest = 0;  // lowest z; largest magnitude of any coordinate
};

Extent extent_of(Context& context, MeshView mesh) {
    return parallel_reduce(
        context, mesh.size(), kGrain, Extent{},
        [&](std::size_t begin, std::size_t end) {
            Extent e;
            for (std::size_t f = begin; f < end; ++f)
                for (const std::uint32_t v : mesh.facets[f]) {
                    const Vec3d p = to_double(mesh.vertices[v]);
                    e.lowest = std::min(e.lowest, p[2]);
                    for (const double c : p) e.largest = std::max(e.largest, std::abs(c));
                }
            return e;
        },
        [](Extent a, Extent b) {
            return Extent{std::min(a.lowest, b.lowest), std::max(a.largest, b.largest)};
        });
}

// Of its three edges, squared.
double longest_edge2(const Vec3d& p, const Vec3d& q, const Vec3d& r) {
    double longest = 0;
    for (const Vec3d& e : {minus(q, p), minus(r, q), minus(p, r)}) longest = std::max(longest, dot(e, e));
    return longest;
}

// Twice the area times the outward unit normal.
Vec3d normal_of(const Vec3d& p, const Vec3d& q, const Vec3d& r) { return cross(minus(q, p), minus(r, p)); }

// Whether a ≤ b, told from their squares, which need no roots; exact() decides where the two are so near, or
// so small, that rounding could.
template <class Exact>
bool at_most(double a2, double b2, Exact&& exact) {
    constexpr double near = 1e-6, smallest = 1e-280;
    if (b2 > smallest && a2 < (1 - near) * b2) return true;
    if (a2 > smallest && a2 > (1 + near) * b2) return false;
    return exact();
}

Vec3d centroid_of(MeshView mesh, std::uint32_t facet) {
    Vec3d c{};
    for (const std::uint32_t v : mesh.facets[facet]) {
        const Vec3d p = to_double(mesh.vertices[v]);
        for (int i = 0; i < 3; ++i) c[i] += p[i] / 3;
    }
    return c;
}

}  // namespace

Vec3d area_normal(MeshView mesh, std::uint32_t facet) {
    const Index3 t = outward(mesh, facet);
    return normal_of(to_double(mesh.vertices[t[0]]), to_double(mesh.vertices[t[1]]),
                     to_double(mesh.vertices[t[2]]));
}

Index3 outward(MeshView mesh, std::uint32_t facet) {
    const Index3 t = mesh.facets[facet];
    return mesh.role(facet) == FacetRole::turned ? Index3{t[0], t[2], t[1]} : t;
}

double smallest_height(MeshView mesh, std::uint32_t facet) {
    const Index3 t = mesh.facets[facet];
    const Vec3d p = to_double(mesh.vertices[t[0]]), q = to_double(mesh.vertices[t[1]]),
                r = to_double(mesh.vertices[t[2]]);
    const double longest = std::sqrt(longest_edge2(p, q, r));
    const Vec3d n = normal_of(p, q, r);
    return longest > 0 ? std::sqrt(dot(n, n)) / longest : 0;
}

FacetClasses classify_facets(Context& context, MeshView mesh, const FeatureOptions& options) {
    FacetClasses classes;
    classes.of.assign(mesh.size(), FacetClass::other);
    if (mesh.size() == 0) return classes;
    const Extent extent = extent_of(context, mesh);
    classes.z_base = extent.lowest;
    // Corners are rounded to float, so lengths under two units in the last place of the largest coordinate
    // say nothing: a facet thinner than that has no normal, and a wall that overhangs by less is vertical.
    const double noise = extent.largest * std::ldexp(1.0, -22);
    const double horizontal = std::tan(options.horizontal_rad), shallow = std::tan(options.shallow_limit_rad);
    const double noise2 = noise * noise;
    parallel_for(context, mesh.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto f = static_cast<std::uint32_t>(i);
            const Index3 t = outward(mesh, f);
            const Vec3d p = to_double(mesh.vertices[t[0]]), q = to_double(mesh.vertices[t[1]]),
                        r = to_double(mesh.vertices[t[2]]);
            if (mesh.role(i) == FacetRole::inner) continue;  // no part of the surface
            const Vec3d n = normal_of(p, q, r);
            const double across2 = n[0] * n[0] + n[1] * n[1], low = std::min({p[2], q[2], r[2]}),
                         high = std::max({p[2], q[2], r[2]});
            auto across = [&] { return std::hypot(n[0], n[1]); };
            FacetClass& facet = classes.of[f];
            if (at_most(dot(n, n), noise2 * longest_edge2(p, q, r),
                        [&] { return smallest_height(mesh, f) <= noise; })) {
                facet = FacetClass::sliver;
                continue;
            }
            const double lying = horizontal * std::abs(n[2]), sloping = shallow * n[2],
                         overhang = (high - low) * -n[2];
            if (at_most(across2, lying * lying, [&] { return across() <= lying; })) {
                if (n[2] > 0) facet = FacetClass::up_flat;
                else
                    facet =
                        high - classes.z_base <= kBaseTolerance ? FacetClass::base : FacetClass::down_flat;
            } else if (n[2] > 0) {
                if (!at_most(sloping * sloping, across2, [&] { return sloping <= across(); }))
                    facet = FacetClass::shallow;
            } else if (n[2] < 0) {
                if (!at_most(overhang * overhang, noise2 * across2,
                             [&] { return overhang <= noise * across(); }))
                    facet = FacetClass::undercut;
            }
        }
    });
    return classes;
}

std::vector<Patch> connected_patches(Context& context, MeshView mesh, const FacetClasses& classes) {
    auto forms_patches = [](FacetClass c) { return c >= FacetClass::up_flat; };
    std::vector<std::uint8_t> done(
        mesh.size(), 0);  // facets of patches: 1; slivers: a bit for each class that crossed them
    std::vector<Patch> patches;
    std::vector<std::uint32_t> stack;
    for (std::uint32_t seed = 0; seed < mesh.size(); ++seed) {
        if (seed % (1u << 16) == 0) context.throw_if_cancelled();
        const FacetClass c = classes.of[seed];
        if (!forms_patches(c) || done[seed]) continue;
        Patch patch{c, {}};
        const auto bit = static_cast<std::uint8_t>(1u << static_cast<unsigned>(c));
        done[seed] = 1;
        stack.assign(1, seed);
        for (std::size_t met = 1; !stack.empty(); ++met) {
            if (met % (1u << 16) == 0) context.throw_if_cancelled();
            const std::uint32_t f = stack.back();
            stack.pop_back();
            if (classes.of[f] == c) patch.facets.push_back(f);
            for (const std::uint32_t g : mesh.neighbours[f]) {
                if (g == kNoFacet) continue;
                // A sliver may join patches of several classes; each class crosses it once, because whatever
                // that class reaches through it belongs to the one patch anyway.
                if (classes.of[g] == c) {
                    if (done[g]) continue;
                    done[g] = 1;
                } else if (classes.of[g] == FacetClass::sliver) {
                    if (done[g] & bit) continue;
                    done[g] = static_cast<std::uint8_t>(done[g] | bit);
                } else continue;
                stack.push_back(g);
            }
        }
        context.throw_if_cancelled();
        std::sort(patch.facets.begin(), patch.facets.end());
        patches.push_back(std::move(patch));
    }
    return patches;
}

Feature feature_of_patch(Context& context, MeshView mesh, FeatureType type, Patch patch) {
    Feature feature;
    feature.type = type;
    feature.found_by = FoundBy::facets;
    feature.z_low = HUGE_VAL;
    feature.z_high = -HUGE_VAL;
    const bool flat = type == FeatureType::up_flat || type == FeatureType::down_flat;
    double total = 0;
    Vec3d middle{};
    std::size_t looked_at = 0;
    auto check = [&] {
        if (++looked_at % (1u << 16) == 0) context.throw_if_cancelled();
    };
    for (const std::uint32_t f : patch.facets) {
        check();
        const Vec3d n = area_normal(mesh, f), c = centroid_of(mesh, f);
        const double area = std::sqrt(dot(n, n)) / 2;
        feature.area += flat ? std::abs(n[2]) / 2 : area;
        total += area;
        for (int i = 0; i < 3; ++i) middle[i] += area * c[i];
        for (const std::uint32_t v : mesh.facets[f]) {
            feature.z_low = std::min<double>(feature.z_low, mesh.vertices[v].z);
            feature.z_high = std::max<double>(feature.z_high, mesh.vertices[v].z);
        }
    }
    for (double& m : middle) m /= total;
    double best = HUGE_VAL;
    for (const std::uint32_t f : patch.facets) {
        check();
        const Vec3d c = centroid_of(mesh, f), d = minus(c, middle);
        if (dot(d, d) >= best) continue;
        best = dot(d, d);
        feature.x = c[0];
        feature.y = c[1];
    }
    // A flat has one height; facets that tilt within the limit share the area's mean.
    if (flat && feature.z_low < feature.z_high)
        feature.z_low = feature.z_high = std::clamp(middle[2], feature.z_low, feature.z_high);
    feature.facets = std::move(patch.facets);
    return feature;
}

}  // namespace slabwright
