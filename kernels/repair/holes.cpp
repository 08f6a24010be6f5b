#include "kernels/repair/holes.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "kernels/mesh/clusters.h"
#include "kernels/parallel/parallel.h"
#include "kernels/repair/boundary_loops.h"
#include "kernels/repair/triangulate.h"

namespace slabwright {

namespace {

constexpr std::size_t kMostFlatPoints = 20'000;  // ears are clipped in the square of their number
constexpr std::size_t kMostNested = 4000;        // flat loops that are looked for inside one another
constexpr double kStrayShare = 0.05;             // of all area, that fragments may have to be dropped

using Triangle = std::array<std::uint32_t, 3>;

/// What is done with one loop.
struct Patch {
    bool left = false;      ///< not closed
    bool in_other = false;  ///< a hole of another loop, closed with that
    std::vector<std::uint32_t> holes;
    std::vector<Triangle> facets;  ///< of vertices of the soup
    double area = 0;
};

/// Whether a point in the plane of a loop lies inside it, by its crossings.
bool inside(const FacetSoup& soup, const BoundaryLoop& loop, const Xyz& p) {
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (std::abs(loop.normal[k]) > std::abs(loop.normal[axis])) axis = k;
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    bool in = false;
    const std::size_t n = loop.vertices.size();
    for (std::size_t i = 0; i < n; ++i) {
        const Xyz a = soup.at(loop.vertices[i]), b = soup.at(loop.vertices[(i + 1) % n]);
        if ((a[v] > p[v]) == (b[v] > p[v])) continue;
        if (p[u] < a[u] + (p[v] - a[v]) / (b[v] - a[v]) * (b[u] - a[u])) in = !in;
    }
    return in;
}

/// Closes loops: finds which are holes of others, and the triangles of each.
class Filler {
public:
    Filler(Context& context, const FacetSoup& soup, const std::vector<BoundaryLoop>& loops,
           const HoleLimits& limits)
        : context_(context), soup_(soup), loops_(loops), limits_(limits), patches_(loops.size()) {}

    std::vector<Patch> run() {
        nest();
        parallel_for(context_, loops_.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                if (!patches_[i].in_other) close(i);
        });
        return std::move(patches_);
    }

private:
    [[nodiscard]] bool flat(const BoundaryLoop& loop) const {
        return loop.area_mm2 > 0 && loop.flatness_mm <= limits_.flat_mm;
    }

    /// Finds for every flat loop the smallest one around it in the same plane; where that runs the other
    /// way, it is a hole of that.
    void nest() {
        std::vector<std::uint32_t> order;
        for (std::uint32_t i = 0; i < loops_.size(); ++i)
            if (flat(loops_[i])) order.push_back(i);
        if (order.size() > kMostNested) return;
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::tie(loops_[a].area_mm2, a) < std::tie(loops_[b].area_mm2, b);
        });
        // From the largest on: what lies in a hole of another is an outline again.
        for (std::size_t i = order.size(); i-- > 0;) {
            context_.throw_if_cancelled();
            std::size_t around = i + 1;
            while (around < order.size() && !holds(loops_[order[around]], loops_[order[i]])) ++around;
            if (around == order.size() || patches_[order[around]].in_other) continue;
            if (inner(loops_[order[i]].normal, loops_[order[around]].normal) >= 0) continue;
            patches_[order[i]].in_other = true;
            patches_[order[around]].holes.push_back(order[i]);
        }
    }

    [[nodiscard]] bool holds(const BoundaryLoop& around, const BoundaryLoop& loop) const {
        constexpr double parallel = 0.999;
        if (length(minus(loop.middle, around.middle)) > around.diagonal_mm) return false;
        if (std::abs(inner(loop.normal, around.normal)) < parallel) return false;
        if (std::abs(inner(minus(loop.middle, around.middle), around.normal)) > limits_.flat_mm) return false;
        // A point that both share tells nothing.
        for (const std::uint32_t v : loop.vertices)
            if (std::find(around.vertices.begin(), around.vertices.end(), v) == around.vertices.end())
                return inside(soup_, around, soup_.at(v));
        return false;
    }

    void close(std::size_t i) {
        const BoundaryLoop& loop = loops_[i];
        Patch& patch = patches_[i];
        context_.throw_if_cancelled();
        if (flat(loop) && (loop.vertices.size() > 3 || !patch.holes.empty())) close_flat(i);
        if (patch.facets.empty() && patch.holes.empty()) close_bent(i);
        if (patch.facets.empty() && !patch.holes.empty()) {
            // The holes then are loops of their own.
            for (const std::uint32_t h : patch.holes) close_bent(h);
            patch.holes.clear();
            close_bent(i);
        }
    }

    void close_flat(std::size_t i) {
        std::vector<std::vector<std::uint32_t>> rings;
        std::vector<std::uint32_t> vertices;
        const auto add = [&](std::size_t l) {
            std::vector<std::uint32_t>& ring = rings.emplace_back();
            for (const std::uint32_t v : loops_[l].vertices) {
                ring.push_back(static_cast<std::uint32_t>(vertices.size()));
                vertices.push_back(v);
            }
        };
        add(i);
        for (const std::uint32_t h : patches_[i].holes) add(h);
        if (vertices.size() > kMostFlatPoints) return;
        std::vector<Xyz> points;
        for (const std::uint32_t v : vertices) points.push_back(soup_.at(v));
        take(i, clip_ears(points, rings, loops_[i].normal), vertices);
    }

    void close_bent(std::size_t i) {
        const BoundaryLoop& loop = loops_[i];
        std::vector<Xyz> points;
        for (const std::uint32_t v : loop.vertices) points.push_back(soup_.at(v));
        take(i, least_area(points), loop.vertices);
        Patch& patch = patches_[i];
        const bool thin = 2 * patch.area <=
                          std::max(limits_.thin_mm, limits_.bent_share * loop.diagonal_mm) * loop.length_mm;
        const bool nearly_flat = loop.flatness_mm <= limits_.bent_share * loop.diagonal_mm;
        if (patch.facets.empty() || (!nearly_flat && !thin && loop.diagonal_mm > limits_.size_mm)) {
            patch.left = true;
            patch.facets.clear();
        }
    }

    void take(std::size_t i, const std::vector<Triangle>& triangles,
              const std::vector<std::uint32_t>& vertices) {
        Patch& patch = patches_[i];
        patch.area = 0;
        for (const Triangle& t : triangles) {
            patch.facets.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
            const Triangle& f = patch.facets.back();
            patch.area += length(twice_area(soup_.at(f[0]), soup_.at(f[1]), soup_.at(f[2]))) / 2;
        }
    }

    Context& context_;
    const FacetSoup& soup_;
    const std::vector<BoundaryLoop>& loops_;
    const HoleLimits& limits_;
    std::vector<Patch> patches_;
};

/// Fragments: facets that are connected across edges, or that one loop borders.
struct Fragments {
    std::vector<std::uint32_t> of;  ///< by facet: its lowest facet
    std::vector<double> area, volume;
    std::vector<bool> open;  ///< by lowest facet: has a loop that is closed

    Fragments(const FacetSoup& soup, std::span<const EdgeUse> uses) {
        of.resize(soup.facets.size());
        std::iota(of.begin(), of.end(), 0u);
        for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
            for (const EdgeUse& use : edge) join_clusters(of, edge[0].facet(), use.facet());
        });
    }
    void measure(const FacetSoup& soup, const std::vector<BoundaryLoop>& loops,
                 const std::vector<Patch>& patches) {
        const std::size_t n = of.size();
        area.assign(n, 0), volume.assign(n, 0), open.assign(n, false);
        std::vector<std::uint32_t> root(n);
        for (std::uint32_t f = 0; f < n; ++f) root[f] = cluster_root(of, f);
        of = std::move(root);
        const auto add = [&](std::uint32_t fragment, const Index3& f) {
            // From a corner of its own, so that no digits are lost far from the origin.
            const Xyz origin = soup.at(soup.facets[fragment][0]), a = soup.at(f[0]);
            const Xyz twice = twice_area(a, soup.at(f[1]), soup.at(f[2]));
            volume[fragment] += inner(twice, minus(a, origin)) / 6;
            area[fragment] += length(twice) / 2;
        };
        for (std::size_t f = 0; f < n; ++f) add(of[f], soup.facets[f]);
        for (std::size_t i = 0; i < loops.size(); ++i) {
            const std::uint32_t fragment = of[loops[i].beside];
            if (!patches[i].left) open[fragment] = true;
            for (const Triangle& t : patches[i].facets) add(fragment, t);
        }
        for (std::size_t i = 0; i < loops.size(); ++i)
            if (patches[i].left) open[of[loops[i].beside]] = false;
    }
    /// Whether it encloses nothing, once its loops are closed.
    [[nodiscard]] bool is_sheet(std::uint32_t fragment, double thin_mm) const {
        return open[fragment] && std::abs(volume[fragment]) <= thin_mm * area[fragment] / 2;
    }
};

/// Tells of fragments that enclose nothing, and marks them. @return whether they are to be dropped
bool find_sheets(const FacetSoup& soup, const Fragments& fragments, double thin_mm, std::vector<bool>& sheet,
                 Filled& filled) {
    double all = 0, sheets = 0, largest = 0;
    std::uint64_t count = 0;
    Xyz where{};
    for (std::uint32_t f = 0; f < sheet.size(); ++f) {
        sheet[f] = fragments.is_sheet(fragments.of[f], thin_mm);
        if (fragments.of[f] != f) continue;
        all += fragments.area[f];
        if (!sheet[f]) continue;
        // Its area counts once, without what would close it.
        sheets += fragments.area[f] / 2;
        if (count++ > 0 && fragments.area[f] / 2 <= largest) continue;
        largest = fragments.area[f] / 2;
        where = {};
        for (const std::uint32_t v : soup.facets[f]) where = plus(where, soup.at(v), 1.0 / 3);
    }
    const bool drop = count > 0 && sheets <= kStrayShare * all;
    if (drop) {
        filled.strays = count;
        filled.stray_mm2 = largest;
        filled.stray_at = where;
    } else if (count > 0) {
        filled.sheets_left = count;
        filled.sheet_mm2 = sheets;
        filled.sheet_at = where;
    }
    return drop;
}

}  // namespace

Filled fill_holes(Context& context, FacetSoup& soup, const HoleLimits& limits) {
    Filled filled;
    const std::vector<EdgeUse> uses = sorted_uses(context, soup);
    const std::vector<BoundaryLoop> loops = boundary_loops(soup, uses);
    if (loops.empty()) return filled;
    const std::vector<Patch> patches = Filler(context, soup, loops, limits).run();
    Fragments fragments(soup, uses);
    // A hole between two fragments makes one of them.
    for (std::size_t i = 0; i < loops.size(); ++i)
        for (const std::uint32_t h : patches[i].holes)
            join_clusters(fragments.of, loops[i].beside, loops[h].beside);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> at_vertex;
    for (const BoundaryLoop& loop : loops)
        for (const std::uint32_t v : loop.vertices) at_vertex.emplace_back(v, loop.beside);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (excess(edge) == 0) return;
        at_vertex.emplace_back(edge[0].low, edge[0].facet());
        at_vertex.emplace_back(edge[0].high, edge[0].facet());
    });
    std::sort(at_vertex.begin(), at_vertex.end());
    for (std::size_t i = 1; i < at_vertex.size(); ++i)
        if (at_vertex[i].first == at_vertex[i - 1].first)
            join_clusters(fragments.of, at_vertex[i].second, at_vertex[i - 1].second);
    fragments.measure(soup, loops, patches);
    const std::size_t facets = soup.facets.size();
    std::vector<bool> sheet(facets, false);
    const bool drop = find_sheets(soup, fragments, limits.flat_mm, sheet, filled);
    for (std::size_t i = 0; i < loops.size(); ++i) {
        const BoundaryLoop& loop = loops[i];
        const Patch& patch = patches[i];
        if (sheet[loop.beside]) continue;
        if (patch.left) {
            if (filled.left++ == 0 || loop.diagonal_mm > filled.left_mm)
                filled.left_mm = loop.diagonal_mm, filled.left_at = loop.middle;
            continue;
        }
        for (const Triangle& t : patch.facets) soup.facets.push_back({t[0], t[1], t[2]});
        if (patch.facets.empty()) continue;  // closed with the loop around it
        if (filled.holes++ == 0 || patch.area > filled.area_mm2)
            filled.area_mm2 = patch.area, filled.hole_at = loop.middle;
    }
    if (drop) {
        sheet.resize(soup.facets.size(), false);
        soup.drop(sheet);
        sheet.resize(facets);
        filled.dropped = std::move(sheet);
    }
    return filled;
}

}  // namespace slabwright
