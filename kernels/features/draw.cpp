#include "kernels/features/draw.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "kernels/access/wall_thickness.h"
#include "kernels/errors.h"
#include "kernels/features/facet_classes.h"
#include "kernels/features/round_walls.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kSameDraft = 0.01;  // degrees
constexpr double kPoints = 500'000;  // of thickness, over the whole surface
constexpr double kLeastWall = 0.1;   // mm²: what is smaller are slivers beside edges
constexpr std::size_t kGrain = 8192;

void check(const DrawLimits& limits) {
    const auto within = [](double x, double low, double high) { return x >= low && x <= high; };
    if (!within(limits.draft_deg, 0, 45) || !within(limits.thin_mm, 0, 1e6) ||
        !within(limits.corner_deg, 1, 179))
        throw Error(ErrorKind::usage, "draw.limits", "a limit of draft, thickness or corners is out of range",
                    {},
                    "give a draft from 0 to 45 and a corner from 1 to 179 degrees, and a thickness in mm");
}

double area_of(MeshView mesh, std::uint32_t f) { return length(area_normal(mesh, f)) / 2; }

Point3 middle_of(MeshView mesh, std::uint32_t f) {
    Point3 middle{};
    for (const std::uint32_t v : mesh.facets[f]) middle = plus(middle, to_double(mesh.vertices[v]), 1.0 / 3);
    return middle;
}

void find_draft(Context& context, MeshView mesh, DrawReport& report) {
    const FacetClasses classes = classify_facets(context, mesh, {});
    parallel_for(context, mesh.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto f = static_cast<std::uint32_t>(i);
            const FacetClass c = classes.of[f];
            if (c == FacetClass::sliver || c == FacetClass::base || mesh.role(f) == FacetRole::inner)
                continue;
            const Vec3d n = area_normal(mesh, f);
            const double draft = std::atan2(n[2], std::hypot(n[0], n[1])) * kDegrees;
            // What leans in by next to nothing is upright.
            const bool under =
                (c == FacetClass::undercut || c == FacetClass::down_flat) && draft < -kSameDraft;
            report.draft_deg[f] = static_cast<float>(under ? draft : std::max(0.0, draft));
            if (under) report.finding[f] = DrawFinding::undercut;
            else if (draft < report.limits.draft_deg - kSameDraft)
                report.finding[f] = DrawFinding::little_draft;
        }
    });
}

/// Joins facets across their edges where belongs(f); value(f) is least where it is worst.
template <class Belongs, class Area, class Value, class Place>
std::vector<DrawPatch> patches(Context& context, MeshView mesh, Belongs&& belongs, Area&& area, Value&& value,
                               Place&& place) {
    std::vector<DrawPatch> found;
    std::vector<std::uint8_t> done(mesh.size(), 0);
    std::vector<std::uint32_t> stack;
    for (std::uint32_t seed = 0; seed < mesh.size(); ++seed) {
        if (seed % (1U << 16U) == 0) context.throw_if_cancelled();
        if (done[seed] != 0 || !belongs(seed)) continue;
        DrawPatch patch{0, kUnbounded, {}, seed};
        std::uint32_t worst = seed;
        done[seed] = 1;
        stack.assign(1, seed);
        while (!stack.empty()) {
            const std::uint32_t f = stack.back();
            stack.pop_back();
            patch.area_mm2 += area(f);
            const double v = value(f);
            if (v < patch.worst || (v == patch.worst && f < worst)) patch.worst = v, worst = f;
            for (const std::uint32_t g : mesh.neighbours[f])
                if (g != kNoFacet && done[g] == 0 && belongs(g)) done[g] = 1, stack.push_back(g);
        }
        patch.at = place(worst);
        found.push_back(patch);
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const DrawPatch& a, const DrawPatch& b) { return a.area_mm2 > b.area_mm2; });
    return found;
}

double sum_of(const std::vector<DrawPatch>& patches) {
    return std::accumulate(patches.begin(), patches.end(), 0.0,
                           [](double sum, const DrawPatch& p) { return sum + p.area_mm2; });
}

void find_thin(Context& context, MeshView mesh, DrawReport& report) {
    if (report.limits.thin_mm == 0) return;
    double surface = 0;
    for (std::uint32_t f = 0; f < mesh.size(); ++f) surface += area_of(mesh, f);
    const double spacing = std::max(report.limits.thin_mm / 2, std::sqrt(surface / kPoints));
    const std::vector<ThinFacet> thin = thin_facets(context, mesh, report.limits.thin_mm, spacing);
    std::vector<std::uint32_t> of(mesh.size(), kNoFacet);
    for (std::uint32_t i = 0; i < thin.size(); ++i) {
        of[thin[i].facet] = i;
        report.thickness_mm[thin[i].facet] = thin[i].thickness_mm;
    }
    report.thin = patches(
        context, mesh, [&](std::uint32_t f) { return of[f] != kNoFacet; },
        [&](std::uint32_t f) { return thin[of[f]].share * area_of(mesh, f); },
        [&](std::uint32_t f) { return static_cast<double>(thin[of[f]].thickness_mm); },
        [&](std::uint32_t f) { return thin[of[f]].at; });
    std::erase_if(report.thin, [](const DrawPatch& p) { return p.area_mm2 < kLeastWall; });
    report.thin_mm2 = sum_of(report.thin);
}

struct SharpEdge {
    std::uint32_t a = 0, b = 0;  ///< vertices
    double angle_deg = 0;
};

std::vector<SharpEdge> sharp_edges(Context& context, MeshView mesh, double corner_deg) {
    const FacetBends bends(context, mesh);
    using Found = std::vector<SharpEdge>;
    return parallel_reduce(
        context, mesh.size(), kGrain, Found{},
        [&](std::size_t begin, std::size_t end) {
            Found found;
            for (std::size_t i = begin; i < end; ++i)
                for (std::uint32_t k = 0; k < 3; ++k) {
                    const auto f = static_cast<std::uint32_t>(i);
                    const std::uint32_t g = mesh.neighbours[f][k];
                    if (g == kNoFacet || g < f) continue;
                    const Bend bend = bends.at({f, k});
                    if (!bend.is_sure || bend.rad * kDegrees < corner_deg - kSameDraft) continue;
                    found.push_back(
                        {mesh.facets[f][k], mesh.facets[f][(k + 1) % 3], 180 - bend.rad * kDegrees});
                }
            return found;
        },
        [](Found a, const Found& b) {
            a.insert(a.end(), b.begin(), b.end());
            return a;
        });
}

void find_corners(Context& context, MeshView mesh, DrawReport& report) {
    const std::vector<SharpEdge> edges = sharp_edges(context, mesh, report.limits.corner_deg);
    std::vector<std::uint32_t> parent(mesh.vertices.size());
    std::iota(parent.begin(), parent.end(), 0U);
    const auto root = [&](std::uint32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const SharpEdge& e : edges) {
        const std::uint32_t a = root(e.a), b = root(e.b);
        parent[std::max(a, b)] = std::min(a, b);
    }
    std::vector<std::uint32_t> of(mesh.vertices.size(), kNoFacet);
    for (const SharpEdge& e : edges) {
        std::uint32_t& chain = of[root(e.a)];
        if (chain == kNoFacet) {
            chain = static_cast<std::uint32_t>(report.corners.size());
            report.corners.push_back({0, kUnbounded, {}});
        }
        InnerCorner& corner = report.corners[chain];
        const Point3 a = to_double(mesh.vertices[e.a]), b = to_double(mesh.vertices[e.b]);
        corner.length_mm += length(minus(b, a));
        if (e.angle_deg < corner.angle_deg) corner.angle_deg = e.angle_deg, corner.at = between(a, b, 0.5);
    }
    std::stable_sort(report.corners.begin(), report.corners.end(),
                     [](const InnerCorner& a, const InnerCorner& b) { return a.length_mm > b.length_mm; });
    for (const InnerCorner& c : report.corners) report.corners_mm += c.length_mm;
}

}  // namespace

DrawReport check_draw(Context& context, MeshView mesh, const DrawLimits& limits) {
    check(limits);
    DrawReport report;
    report.limits = limits;
    const MemoryCharge charge(context, mesh.size() * 40, "looking at the draw");
    report.draft_deg.assign(mesh.size(), 90);
    report.finding.assign(mesh.size(), DrawFinding::none);
    report.thickness_mm.assign(mesh.size(), 0);
    if (mesh.size() == 0) return report;
    find_draft(context, mesh, report);
    const auto of_finding = [&](DrawFinding finding) {
        return patches(
            context, mesh, [&](std::uint32_t f) { return report.finding[f] == finding; },
            [&](std::uint32_t f) { return area_of(mesh, f); },
            [&](std::uint32_t f) { return static_cast<double>(report.draft_deg[f]); },
            [&](std::uint32_t f) { return middle_of(mesh, f); });
    };
    report.little_draft = of_finding(DrawFinding::little_draft);
    report.undercuts = of_finding(DrawFinding::undercut);
    report.little_draft_mm2 = sum_of(report.little_draft);
    report.undercut_mm2 = sum_of(report.undercuts);
    find_thin(context, mesh, report);
    find_corners(context, mesh, report);
    return report;
}

}  // namespace slabwright
