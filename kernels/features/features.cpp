#include "kernels/features/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>

#include "kernels/errors.h"
#include "kernels/features/finders.h"
#include "kernels/mesh/windings.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

std::string_view name(FeatureType type) {
    switch (type) {
        case FeatureType::peak:
            return "peak";
        case FeatureType::valley:
            return "valley";
        case FeatureType::up_flat:
            return "up_flat";
        case FeatureType::down_flat:
            return "down_flat";
        case FeatureType::shallow:
            return "shallow";
        case FeatureType::saddle:
            return "saddle";
        case FeatureType::undercut:
            return "undercut";
    }
    return "unknown";
}

std::string_view name(FoundBy found_by) {
    switch (found_by) {
        case FoundBy::exact:
            return "exact";
        case FoundBy::halving:
            return "halving";
        case FoundBy::facets:
            return "facets";
    }
    return "unknown";
}

namespace {

void check(const FeatureOptions& o) {
    auto fail = [](const char* key) {
        throw Error(ErrorKind::usage, "features.options",
                    std::string("feature option ") + key + " is out of range", {},
                    "lengths are positive (coarse from 0.001, resolution from 0.0001 mm), angles between 0 "
                    "and 90 degrees");
    };
    auto positive = [](double v) { return v > 0 && std::isfinite(v); };
    if (!(o.chordal_deviation_mm >= 0)) fail("chordal_deviation_mm");
    if (!(o.flat_merge_mm >= 0)) fail("flat_merge_mm");
    // Halving ends because brackets stay wider than the path unit, 0.1 µm.
    if (!positive(o.halving_coarse_mm) || o.halving_coarse_mm < 1e-3) fail("halving_coarse_mm");
    if (!positive(o.halving_resolution_mm) || o.halving_resolution_mm < 1e-4) fail("halving_resolution_mm");
    if (!positive(o.horizontal_rad) || o.horizontal_rad >= std::numbers::pi / 4) fail("horizontal_rad");
    if (!positive(o.shallow_limit_rad) || o.shallow_limit_rad >= std::numbers::pi / 2)
        fail("shallow_limit_rad");
}

auto sort_key(const Feature& f) {
    return std::tuple(f.type, f.z_low, f.z_high, f.x, f.y, f.facets.empty() ? kNoFacet : f.facets.front());
}

void sort_features(std::vector<Feature>& features) {
    std::stable_sort(features.begin(), features.end(),
                     [](const Feature& a, const Feature& b) { return sort_key(a) < sort_key(b); });
}

// Pairs what both finders saw: same type, heights within the bracket that halving ends with; each of
// halving's takes the nearest in plan that is left. What stays alone is a disagreement. Both lists are
// sorted.
std::vector<FinderDisagreement> compare(const std::vector<Feature>& exact,
                                        const std::vector<Feature>& halving, double resolution) {
    std::vector<std::uint8_t> seen_e(exact.size(), 0), seen_h(halving.size(), 0);
    for (std::size_t h = 0; h < halving.size(); ++h) {
        const Feature& mine = halving[h];
        auto it = std::lower_bound(
            exact.begin(), exact.end(), std::pair(mine.type, mine.z_low - resolution),
            [](const Feature& f, const auto& key) { return std::pair(f.type, f.z_low) < key; });
        std::size_t best = exact.size();
        double least = HUGE_VAL;
        for (; it != exact.end() && it->type == mine.type && it->z_low <= mine.z_low + resolution; ++it) {
            const auto e = static_cast<std::size_t>(it - exact.begin());
            const double dx = it->x - mine.x, dy = it->y - mine.y, d = dx * dx + dy * dy;
            if (seen_e[e] || d >= least) continue;
            least = d;
            best = e;
        }
        if (best < exact.size()) seen_e[best] = seen_h[h] = 1;
    }
    std::vector<FinderDisagreement> alone;
    for (std::size_t e = 0; e < exact.size(); ++e)
        if (!seen_e[e])
            alone.push_back({exact[e].type, exact[e].z_low, exact[e].x, exact[e].y, FoundBy::exact});
    for (std::size_t h = 0; h < halving.size(); ++h)
        if (!seen_h[h])
            alone.push_back(
                {halving[h].type, halving[h].z_low, halving[h].x, halving[h].y, FoundBy::halving});
    std::sort(alone.begin(), alone.end(), [](const FinderDisagreement& a, const FinderDisagreement& b) {
        return std::tie(a.type, a.z, a.x, a.y, a.found_by) < std::tie(b.type, b.z, b.x, b.y, b.found_by);
    });
    return alone;
}

// Leaves out peaks, valleys and saddles that lie inside the solid: what is just above them is wood.
void drop_inner(Context& context, MeshView mesh, std::vector<Feature>& features) {
    if (mesh.roles.empty()) return;
    constexpr double above = 2e-6;  // mm
    std::vector<std::array<double, 3>> places;
    for (const Feature& f : features) places.push_back({f.x, f.y, f.z_high + above});
    const std::vector<int> winding = windings_at(context, mesh, places);
    std::size_t i = 0;
    std::erase_if(features, [&](const Feature&) { return winding[i++] != 0; });
}

}  // namespace

FeatureSet find_features(Context& context, MeshView mesh, const FeatureOptions& options) {
    check(options);
    FeatureSet set;
    const FacetClasses classes = classify_facets(context, mesh, options);
    const bool search = options.finder != Finder::halving;
    const MemoryCharge charge(context, search ? VertexStars::bytes(mesh) : 0,
                              "the search for peaks and valleys");
    VertexStars stars;
    std::vector<Feature> flats;
    // Patches grow facet by facet, which takes one thread; meanwhile others gather the facets around
    // vertices.
    parallel_each(context, 2, [&](std::size_t task) {
        if (task == 1) {
            if (search) stars = vertex_stars(context, mesh);
            return;
        }
        std::vector<Patch> patches = connected_patches(context, mesh, classes);
        set.features = flats = find_flats(context, mesh, patches, options);
        for (auto find : {find_shallow, find_undercuts}) {
            std::vector<Feature> found = find(context, mesh, patches);
            set.features.insert(set.features.end(), std::make_move_iterator(found.begin()),
                                std::make_move_iterator(found.end()));
        }
    });
    std::vector<Feature> exact, halving;
    if (options.finder != Finder::halving) {
        exact = find_exact(context, mesh, std::move(stars), flats, options.flat_merge_mm);
        drop_inner(context, mesh, exact);
        drop_near_flats(context, mesh, flats, options.flat_merge_mm, options.flat_merge_mm, exact);
        sort_features(exact);
    }
    if (options.finder != Finder::exact) {
        halving = find_halving(context, mesh, options);
        // Halving knows heights to its resolution only, and its places are those of the section, not of the
        // flat.
        drop_near_flats(context, mesh, flats, options.flat_merge_mm + options.halving_resolution_mm / 2,
                        options.flat_merge_mm + options.halving_resolution_mm, halving);
        // Where a flat parts or joins loops the count test fires too, at a place the sections do not tell.
        std::erase_if(halving, [&](const Feature& f) {
            return f.type == FeatureType::saddle &&
                   std::any_of(flats.begin(), flats.end(), [&](const Feature& flat) {
                       return std::abs(flat.z_low - f.z_low) <=
                              options.flat_merge_mm + options.halving_resolution_mm / 2;
                   });
        });
        sort_features(halving);
    }
    if (options.finder == Finder::both)
        set.disagreements = compare(exact, halving, options.halving_resolution_mm);
    const std::vector<Feature>& points = options.finder == Finder::halving ? halving : exact;
    set.features.insert(set.features.end(), points.begin(), points.end());
    sort_features(set.features);
    return set;
}

}  // namespace slabwright
