#include "kernels/mesh/report.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "kernels/mesh/clusters.h"
#include "kernels/mesh/edges.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kGrain = std::size_t{1} << 15;

void note(Finding& finding, std::uint32_t facet, std::uint64_t count = 1) {
    if (count == 0) return;
    finding.count += count;
    finding.first_facet = std::min(finding.first_facet, facet);
}

void add(Finding& finding, const Finding& more) { note(finding, more.first_facet, more.count); }

bool collapsed(const Index3& facet) {
    return facet[0] == facet[1] || facet[1] == facet[2] || facet[2] == facet[0];
}

/// Twice the vector area. Differences and products of float32 coordinates of like size are exact in double,
/// so three points on a line give exactly zero.
Vec3d twice_area(MeshView mesh, const Index3& facet) {
    const Vec3d a = to_double(mesh.vertices[facet[0]]);
    return cross(minus(to_double(mesh.vertices[facet[1]]), a), minus(to_double(mesh.vertices[facet[2]]), a));
}

struct EdgeFindings {
    Finding open, open_off_base, non_manifold, misoriented, duplicate;
};

EdgeFindings join(EdgeFindings a, const EdgeFindings& b) {
    add(a.open, b.open);
    add(a.open_off_base, b.open_off_base);
    add(a.non_manifold, b.non_manifold);
    add(a.misoriented, b.misoriented);
    add(a.duplicate, b.duplicate);
    return a;
}

/// A facet is counted as a duplicate at one of its edges only, that between its two lowest vertices. Takes
/// n log n of n uses: files there are whose facets all hang on one edge, or are given a thousand times.
void find_duplicates(MeshView mesh, std::span<const EdgeUse> uses, Finding& duplicate) {
    const auto third = [&](const EdgeUse& use) { return mesh.facets[use.facet()][(use.corner() + 2) % 3]; };
    if (uses.size() == 2) {  // as nearly all edges are
        if (third(uses[0]) == third(uses[1]) && third(uses[1]) > uses[1].high)
            note(duplicate, uses[1].facet());
        return;
    }
    std::vector<std::array<std::uint32_t, 2>> facets;  // third corner and place among the uses
    facets.reserve(uses.size());
    for (std::uint32_t i = 0; i < uses.size(); ++i)
        if (third(uses[i]) > uses[i].high) facets.push_back({third(uses[i]), i});
    std::sort(facets.begin(), facets.end());
    for (std::size_t i = 1; i < facets.size(); ++i)
        if (facets[i][0] == facets[i - 1][0]) note(duplicate, uses[facets[i][1]].facet());
}

/// Counts what is wrong at one edge, and joins the facets that meet there without a partner into one
/// component.
void inspect_edge(MeshView mesh, float base, std::span<const EdgeUse> uses,
                  std::span<std::uint32_t> component, EdgeFindings& found) {
    // A facet with two equal corners runs along the edge in both directions and cancels itself.
    std::size_t facets = 0, forward = 0;
    std::uint32_t first = kNoFacet;
    for (const EdgeUse& use : uses) {
        if (collapsed(mesh.facets[use.facet()])) continue;
        if (facets++ == 0) first = use.facet();
        forward += use.reversed() ? 0 : 1;
    }
    if (facets == 1) {
        note(found.open, first);
        if (std::max(mesh.vertices[uses[0].low].z, mesh.vertices[uses[0].high].z) > base + kBaseFlatness)
            note(found.open_off_base, first);
    }
    if (facets > 2) note(found.non_manifold, first);
    if (facets >= 2 && 2 * forward != facets) {
        note(found.misoriented, first);
        for (const EdgeUse& use : uses) join_clusters(component, uses[0].facet(), use.facet());
    }
    if (uses.size() > 1) find_duplicates(mesh, uses, found.duplicate);
}

/// Sums of one run of consecutive facets of one component.
struct Run {
    std::uint32_t component;
    double volume;
};

/// What one pass over the facets adds up.
struct Sums {
    Finding degenerate;
    double area = 0;
    std::vector<Run> runs;
    std::vector<std::uint32_t> open;  ///< components seen with an edge that has no partner
};

/// A point of a component of which it is asked how much material of the other components surrounds it.
struct Query {
    Vec3d p{};
    std::uint32_t component;
};

/// Whether the step from a to b crosses the ray from q towards +x in the plane, and in which direction. The
/// side is computed from the lower end, so that two facets that share the edge agree to the last bit.
int crossing(const Vec3d& a, const Vec3d& b, const Vec3d& q) {
    if ((a[1] <= q[1]) == (b[1] <= q[1])) return 0;
    const bool up = a[1] <= q[1];
    const Vec3d& low = up ? a : b;
    const Vec3d& high = up ? b : a;
    const double side = (high[0] - low[0]) * (q[1] - low[1]) - (high[1] - low[1]) * (q[0] - low[0]);
    if (!(side > 0)) return 0;
    return up ? 1 : -1;
}

/// Winding number of all other components around each query, counted along a ray to +z: material that lies
/// above ends with a facet facing up. An opening in the base plane does not matter to that ray.
std::vector<int> material_around(Context& context, MeshView mesh, std::span<const std::uint32_t> component_of,
                                 const std::vector<Query>& queries) {
    if (queries.empty()) return {};
    std::vector<std::size_t> by_x(queries.size());
    for (std::size_t i = 0; i < by_x.size(); ++i) by_x[i] = i;
    std::sort(by_x.begin(), by_x.end(), [&](std::size_t a, std::size_t b) {
        return queries[a].p[0] != queries[b].p[0] ? queries[a].p[0] < queries[b].p[0] : a < b;
    });
    std::vector<std::atomic<int>> winding(queries.size());
    parallel_for(context, mesh.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            const Index3& facet = mesh.facets[f];
            const Vec3d a = to_double(mesh.vertices[facet[0]]), b = to_double(mesh.vertices[facet[1]]),
                        c = to_double(mesh.vertices[facet[2]]);
            const auto [x0, x1] = std::minmax({a[0], b[0], c[0]});
            const auto [y0, y1] = std::minmax({a[1], b[1], c[1]});
            auto at = std::lower_bound(by_x.begin(), by_x.end(), x0,
                                       [&](std::size_t i, double x) { return queries[i].p[0] < x; });
            for (; at != by_x.end() && queries[*at].p[0] <= x1; ++at) {
                const Query& query = queries[*at];
                const Vec3d& q = query.p;
                if (q[1] < y0 || q[1] > y1 || query.component == component_of[f]) continue;
                const int turns = crossing(a, b, q) + crossing(b, c, q) + crossing(c, a, q);
                if (turns == 0) continue;
                const Vec3d normal = cross(minus(b, a), minus(c, a));
                const auto [z0, z1] = std::minmax({a[2], b[2], c[2]});
                double z = z1;
                if (normal[2] != 0)
                    z = std::clamp(a[2] - ((q[0] - a[0]) * normal[0] + (q[1] - a[1]) * normal[1]) / normal[2],
                                   z0, z1);
                if (z > q[2]) winding[*at].fetch_add(turns, std::memory_order_relaxed);
            }
        }
    });
    std::vector<int> result;
    for (const std::atomic<int>& w : winding) result.push_back(w.load(std::memory_order_relaxed));
    return result;
}

// Facets that share an edge are joined into components, by their roots.
void join_components(Context& context, MeshView mesh, std::span<std::uint32_t> component) {
    const std::size_t n = mesh.size();
    parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) component[f] = static_cast<std::uint32_t>(f);
    });
    parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f)
            for (const std::uint32_t g : mesh.neighbours[f])
                if (g != kNoFacet && g < f) join_clusters(component, static_cast<std::uint32_t>(f), g);
    });
}

// @param odd the vertices whose edges are asked; null: all
EdgeFindings find_edges(Context& context, MeshView mesh, float base, const std::vector<std::uint32_t>* odd,
                        std::span<std::uint32_t> component) {
    EdgeFindings edges;
    if (odd == nullptr || !odd->empty()) {
        std::vector<bool> asked(odd == nullptr ? 0 : mesh.vertices.size(), false);
        if (odd != nullptr)
            for (const std::uint32_t v : *odd) asked[v] = true;
        EdgeScratch scratch;
        edges = reduce_fans(
            context, mesh.facets, mesh.vertices.size(), scratch, EdgeFindings{},
            [&](std::uint32_t v) { return asked.empty() || asked[v]; },
            [&](EdgeFindings& found, std::span<const EdgeUse> fan) {
                each_edge(fan, [&](std::span<const EdgeUse> uses) {
                    inspect_edge(mesh, base, uses, component, found);
                });
            },
            join);
    }
    return edges;
}

// Area, volumes by component, degenerate facets, and which components are open off the base.
Sums sum_up(Context& context, MeshView mesh, const MeshReport& report) {
    const float base = report.box.min.z;
    // Volume is summed from tetrahedra to the middle of the base: exact for a mesh that is open in its base
    // plane only, and without loss of digits for a mesh far from the origin.
    const Vec3d origin{(double(report.box.min.x) + report.box.max.x) / 2,
                       (double(report.box.min.y) + report.box.max.y) / 2, base};
    return parallel_reduce(
        context, mesh.size(), kGrain, Sums{},
        [&](std::size_t begin, std::size_t end) {
            Sums part;
            for (std::size_t f = begin; f < end; ++f) {
                const Index3& facet = mesh.facets[f];
                const std::uint32_t mine = report.component_of[f];
                const Vec3d area = twice_area(mesh, facet);
                const double squared = dot(area, area);
                if (collapsed(facet) || squared == 0) note(part.degenerate, static_cast<std::uint32_t>(f));
                part.area += std::sqrt(squared) / 2;
                const double volume = dot(area, minus(to_double(mesh.vertices[facet[0]]), origin)) / 6;
                if (part.runs.empty() || part.runs.back().component != mine) part.runs.push_back({mine, 0});
                part.runs.back().volume += volume;
                for (int k = 0; k < 3; ++k) {
                    const std::uint32_t a = facet[k], b = facet[(k + 1) % 3];
                    if (mesh.neighbours[f][k] != kNoFacet || a == b) continue;
                    if (std::max(mesh.vertices[a].z, mesh.vertices[b].z) <= base + kBaseFlatness) continue;
                    if (part.open.empty() || part.open.back() != mine) part.open.push_back(mine);
                }
            }
            return part;
        },
        [](Sums a, Sums b) {
            add(a.degenerate, b.degenerate);
            a.area += b.area;
            a.runs.insert(a.runs.end(), b.runs.begin(), b.runs.end());
            a.open.insert(a.open.end(), b.open.begin(), b.open.end());
            return a;
        });
}

// Components whose outside is in. @param may_be by component: whether it may be one
void find_inverted(Context& context, MeshView mesh, std::vector<std::uint32_t> may_be, MeshReport& report) {
    // One query per component that may be inverted: the centroid of its first facet with an area.
    std::vector<Query> queries;
    std::vector<std::uint32_t> first_facets;
    if (std::find(may_be.begin(), may_be.end(), 1u) != may_be.end()) {
        for (std::size_t f = 0; f < mesh.size(); ++f) {
            const std::uint32_t c = report.component_of[f];
            if (may_be[c] == 0) continue;
            const Vec3d area = twice_area(mesh, mesh.facets[f]);
            if (dot(area, area) == 0) continue;
            may_be[c] = 0;
            Query query{{}, c};
            for (const std::uint32_t v : mesh.facets[f]) {
                query.p[0] += mesh.vertices[v].x / 3.0;
                query.p[1] += mesh.vertices[v].y / 3.0;
                query.p[2] += mesh.vertices[v].z / 3.0;
            }
            queries.push_back(query);
            first_facets.push_back(static_cast<std::uint32_t>(f));
        }
    }
    const std::vector<int> winding = material_around(context, mesh, report.component_of, queries);
    for (std::size_t i = 0; i < queries.size(); ++i)
        if (winding[i] <= 0) note(report.inverted_components, first_facets[i]);
}

}  // namespace

MeshReport report_mesh(Context& context, MeshView mesh, const std::vector<std::uint32_t>* odd) {
    MeshReport report;
    report.facets = mesh.size();
    report.vertices = mesh.vertices.size();
    report.box = bounds(context, mesh);
    const float base = report.box.min.z;
    const std::size_t n = mesh.size();

    report.component_of.resize(n);
    join_components(context, mesh, report.component_of);
    const EdgeFindings edges = find_edges(context, mesh, base, odd, report.component_of);
    report.open_edges = edges.open;
    report.open_edges_off_base = edges.open_off_base;
    report.non_manifold_edges = edges.non_manifold;
    report.misoriented_edges = edges.misoriented;
    report.duplicate_facets = edges.duplicate;

    // Paths are flattened into a second array: reading and writing one array would let threads see each
    // other's work.
    {
        const std::span<std::uint32_t> component(report.component_of);
        BulkVector<std::uint32_t> roots(n);
        parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t f = begin; f < end; ++f)
                roots[f] = cluster_root(component, static_cast<std::uint32_t>(f));
        });
        report.component_of = std::move(roots);
    }
    report.components = number_by_first(
        context, report.component_of, [](std::uint32_t) {}, [](std::size_t, std::uint32_t) {});

    const Sums sums = sum_up(context, mesh, report);
    report.degenerate_facets = sums.degenerate;
    report.area_mm2 = sums.area;
    std::vector<double> volume(report.components, 0);
    std::vector<bool> open(report.components, false);
    for (const Run& run : sums.runs) {
        volume[run.component] += run.volume;
        report.volume_mm3 += run.volume;
    }
    for (const std::uint32_t c : sums.open) open[c] = true;

    std::vector<std::uint32_t> may_be_inverted(report.components, 0);
    for (std::size_t c = 0; c < may_be_inverted.size(); ++c) may_be_inverted[c] = !open[c] && volume[c] < 0;
    find_inverted(context, mesh, std::move(may_be_inverted), report);
    return report;
}

}  // namespace slabwright
