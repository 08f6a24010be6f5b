// What cannot be milled from above: the patches that face down, and how much of it given layer boundaries
// leave unmade.
//
// Measuring: within a layer (bottom, top) a point outside the solid keeps its material exactly when some
// down-facing facet of the layer lies straight above it. From a point s of such a facet we follow the facet's
// outward unit normal n. Over each facet g that the path passes beneath, "g is above q(t) = s + t·n" is a set
// of linear inequalities in t: three for the edges of g in plan, one for the height of g above q, one for g
// being under the layer's top. Each facet thus covers one interval of t; the leftover reaches as far as
// intervals join on to t = 0. Facets are found through plan bins, a cell's width of the path at a time.
//
// That is the thickness. Height and volume of the air that stays filled come from columns (filled_columns.h).
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "kernels/errors.h"
#include "kernels/features/filled_columns.h"
#include "kernels/features/finders.h"
#include "kernels/features/plan_bins.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

std::vector<Feature> find_undercuts(Context& context, MeshView mesh, std::vector<Patch>& patches) {
    std::vector<Feature> found;
    for (Patch& patch : patches)
        if (patch.facet_class == FacetClass::undercut)
            found.push_back(feature_of_patch(context, mesh, FeatureType::undercut, std::move(patch)));
    return found;
}

namespace {

constexpr double kAtBoundary = 1e-3;  // mm: a flat this near a boundary is made by it
constexpr double kLeastDepth = 1e-3;  // mm: less than this left standing is rounding
constexpr double kJoin =
    1e-3;  // mm: intervals this near are one; edges of neighbours agree to float rounding only
constexpr double kInside = 1e-5;  // mm: a point this near a facet's edge in plan is under the facet

struct Interval {
    double from, to;
    // Keeps the part where a + b·t ≥ 0.
    void keep(double a, double b) {
        if (b == 0) {
            if (a < 0) to = -HUGE_VAL;
        } else if (b > 0) from = std::max(from, -a / b);
        else to = std::min(to, -a / b);
    }
};

struct Path {
    Vec3d start, direction;  // unit
    double length;
};

struct Depth {
    double mm = 0;
    Vec3d at{}, middle{};  // on the facet, and half as deep
};

class Measure {
public:
    Measure(Context& context, MeshView mesh, std::span<const std::uint32_t> all)
        : mesh_(mesh), bins_(context, mesh, all), spans_(mesh.size()) {
        parallel_for(context, mesh.size(), 4096, [&](std::size_t begin, std::size_t end) {
            for (std::size_t f = begin; f < end; ++f) {
                const Index3 t = mesh.facets[f];
                const auto [low, high] =
                    std::minmax({mesh.vertices[t[0]].z, mesh.vertices[t[1]].z, mesh.vertices[t[2]].z});
                spans_[f] = {low, high};
            }
        });
    }

    // How far the path stays under down-facing facets that lie under `top`, before it meets solid.
    [[nodiscard]] double covered(const Path& path, double top, std::vector<Interval>& intervals) const {
        const double across =
            std::sqrt(path.direction[0] * path.direction[0] + path.direction[1] * path.direction[1]);
        const double step = across > 0 ? std::max(bins_.cell() / across, kJoin) : path.length;
        double reached = 0;
        for (double from = 0; from < path.length; from += step) {
            const double to = std::min(path.length, from + step);
            const double xa = path.start[0] + from * path.direction[0],
                         xb = path.start[0] + to * path.direction[0];
            const double ya = path.start[1] + from * path.direction[1],
                         yb = path.start[1] + to * path.direction[1];
            const double lowest = path.start[2] + to * path.direction[2] - kInside;
            double hit = path.length;
            intervals.clear();
            const double x0 = std::min(xa, xb) - kInside, x1 = std::max(xa, xb) + kInside;
            const double y0 = std::min(ya, yb) - kInside, y1 = std::max(ya, yb) + kInside;
            bins_.visit(x0, y0, x1, y1, [&](std::uint32_t f) {
                // Facets wholly under this stretch or over the layer neither cover nor stop it.
                if (spans_[f].high < lowest || spans_[f].low > top) return;
                if (mesh_.role(f) == FacetRole::inner) return;
                const Index3 t = mesh_.facets[f];
                const Vec3f &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
                if (std::max({a.x, b.x, c.x}) < x0 || std::min({a.x, b.x, c.x}) > x1 ||
                    std::max({a.y, b.y, c.y}) < y0 || std::min({a.y, b.y, c.y}) > y1)
                    return;
                const Vec3d n = area_normal(mesh_, f);
                if (n[2] < 0) cover(f, n, path, top, reached, intervals);
                if (dot(n, path.direction) < 0) hit = std::min(hit, meet(f, n, path));
            });
            std::sort(intervals.begin(), intervals.end(),
                      [](const Interval& a, const Interval& b) { return a.from < b.from; });
            for (const Interval& i : intervals) {
                if (i.from > reached + kJoin) break;
                reached = std::max(reached, i.to);
            }
            // Only what happens within this stretch is final: facets of later cells may come before the rest.
            if (hit <= to) return std::min(hit, reached);
            if (reached + kJoin < to) return reached;
        }
        return std::min(reached, path.length);
    }

    // How much air is straight under a place of a roof, down to solid or to the bottom of its layer.
    [[nodiscard]] double height_under(const Vec3d& roof, std::span<const double> borders) const {
        const auto above = std::upper_bound(borders.begin(), borders.end(), roof[2]);
        if (above == borders.begin() || above == borders.end()) return 0;
        std::vector<Interval> intervals;
        return covered({roof, {0, 0, -1}, roof[2] - *(above - 1)}, *above - kAtBoundary, intervals);
    }

    // The facet straight above q that is nearest; kNoFacet when there is none.
    [[nodiscard]] std::uint32_t facet_over(const Vec3d& q) const {
        std::uint32_t nearest = kNoFacet;
        double height = HUGE_VAL;
        bins_.visit(q[0], q[1], q[0], q[1], [&](std::uint32_t f) {
            if (spans_[f].high < q[2] || f == nearest) return;
            std::vector<Interval> shadow;
            const Vec3d n = area_normal(mesh_, f);
            if (!(n[2] < 0)) return;
            const Vec3d a = to_double(mesh_.vertices[mesh_.facets[f][0]]);
            const double z = a[2] - (n[0] * (q[0] - a[0]) + n[1] * (q[1] - a[1])) / n[2];
            if (z < q[2] || z > height || (z == height && f > nearest)) return;
            cover(f, n, {q, {0, 0, -1}, kJoin}, HUGE_VAL, 0, shadow);
            if (shadow.empty()) return;
            nearest = f;
            height = z;
        });
        return nearest;
    }

    // True when q lies in the solid: facets above it, each counted by the winding of its projection around q.
    // Corners decide by y alone and both facets of an edge compute one crossing, so no point is counted twice
    // or missed.
    [[nodiscard]] bool inside_solid(const Vec3d& q) const {
        int winding = 0;
        std::vector<std::uint32_t> near;
        bins_.visit(q[0], q[1], q[0], q[1], [&](std::uint32_t f) {
            if (spans_[f].high >= q[2]) near.push_back(f);
        });
        for (const std::uint32_t f : near) {
            int turns = 0;
            for (int k = 0; k < 3; ++k) {
                const Vec3d a = to_double(mesh_.vertices[mesh_.facets[f][k]]),
                            b = to_double(mesh_.vertices[mesh_.facets[f][(k + 1) % 3]]);
                if ((a[1] <= q[1]) == (b[1] <= q[1])) continue;
                const Vec3d &low = a[1] < b[1] ? a : b, &high = a[1] < b[1] ? b : a;
                if (low[0] + (high[0] - low[0]) * ((q[1] - low[1]) / (high[1] - low[1])) > q[0])
                    turns += a[1] < b[1] ? 1 : -1;
            }
            if (turns == 0) continue;
            const Vec3d n = area_normal(mesh_, f), a = to_double(mesh_.vertices[mesh_.facets[f][0]]);
            if (n[2] != 0 && a[2] - (n[0] * (q[0] - a[0]) + n[1] * (q[1] - a[1])) / n[2] > q[2])
                winding += turns;
        }
        return winding != 0;
    }

private:
    void cover(std::uint32_t f, const Vec3d& n, const Path& path, double top, double reached,
               std::vector<Interval>& intervals) const {
        Interval i{0, path.length};
        const Vec3d &s = path.start, &d = path.direction;
        const Index3 t = outward(mesh_, f);
        const Vec3d origin = to_double(mesh_.vertices[t[0]]), from = minus(s, origin);
        // Signed height of q over the facet's plane, as a + b·t; the facet faces down, so dividing by n_z
        // turns it over.
        const double above = dot(n, from) / n[2], above_per_t = dot(n, d) / n[2];
        i.keep(-above + kInside, -above_per_t);
        // Height of the plane over q's place in plan must stay under the layer's top.
        i.keep(top - (s[2] - above), -(d[2] - above_per_t));
        if (!(i.to > reached - kJoin) || !(i.to >= i.from)) return;
        for (int k = 0; k < 3; ++k) {
            const Vec3d a = to_double(mesh_.vertices[t[k]]), b = to_double(mesh_.vertices[t[(k + 1) % 3]]);
            const double ex = b[0] - a[0], ey = b[1] - a[1], length = std::sqrt(ex * ex + ey * ey);
            if (length == 0) return;
            // Down-facing facets run clockwise in plan: their inside is on the right.
            i.keep((ey * (s[0] - a[0]) - ex * (s[1] - a[1])) / length + kInside,
                   (ey * d[0] - ex * d[1]) / length);
        }
        // Moved outwards by kInside, two long edges of a sliver in plan meet far away.
        for (std::size_t k = 0; k < 2; ++k) {
            double low = origin[k], high = low;
            for (const std::uint32_t v : t)
                low = std::min(low, to_double(mesh_.vertices[v])[k]),
                high = std::max(high, to_double(mesh_.vertices[v])[k]);
            i.keep(s[k] - low + kInside, d[k]);
            i.keep(high - s[k] + kInside, -d[k]);
        }
        if (i.to >= i.from) intervals.push_back(i);
    }

    // Where the path enters the solid through this facet; the path's length where it does not.
    [[nodiscard]] double meet(std::uint32_t f, const Vec3d& n, const Path& path) const {
        const Index3 t = outward(mesh_, f);
        const Vec3d a = to_double(mesh_.vertices[t[0]]);
        const double at = dot(n, minus(a, path.start)) / dot(n, path.direction);
        if (!(at > kInside) || at >= path.length) return path.length;
        const Vec3d q{path.start[0] + at * path.direction[0], path.start[1] + at * path.direction[1],
                      path.start[2] + at * path.direction[2]};
        for (int k = 0; k < 3; ++k) {
            const Vec3d u = to_double(mesh_.vertices[t[k]]), v = to_double(mesh_.vertices[t[(k + 1) % 3]]);
            if (dot(cross(minus(v, u), minus(q, u)), n) < 0) return path.length;
        }
        return at;
    }

    struct Span {
        float low, high;
    };
    MeshView mesh_;
    PlanBins bins_;
    std::vector<Span> spans_;  // of every facet in z
};

using Polygon = std::vector<Vec3d>;

// The part of a convex polygon with sign·z ≥ sign·level.
Polygon cut(const Polygon& polygon, double level, double sign) {
    Polygon part;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const double da = sign * (a[2] - level), db = sign * (b[2] - level);
        if (da >= 0) part.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            const double u = da / (da - db);
            part.push_back({a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1]), level});
        }
    }
    return part;
}

struct FacetUnmade {
    double area = 0;
    Depth deepest;
};

// The facet, cut to each layer it reaches into, measured at its corners, edge middles and centroid, and under
// its tallest column. Corners and middles are drawn in by a fiftieth: on an outline the path leaves the
// shadow at once, a little within it does not.
FacetUnmade measure_facet(const Measure& measure, MeshView mesh, std::uint32_t f,
                          std::span<const double> borders, bool horizontal, const FilledUnder& tallest) {
    FacetUnmade unmade;
    Vec3d n = area_normal(mesh, f);
    const double length = std::sqrt(dot(n, n));
    for (double& c : n) c /= length;
    Polygon facet;
    for (const std::uint32_t v : mesh.facets[f]) facet.push_back(to_double(mesh.vertices[v]));
    const auto [low, high] = std::minmax({facet[0][2], facet[1][2], facet[2][2]});
    std::vector<Interval> intervals;
    auto layer =
        static_cast<std::size_t>(std::upper_bound(borders.begin(), borders.end(), low) - borders.begin());
    for (layer = layer == 0 ? 0 : layer - 1; layer + 1 < borders.size() && borders[layer] <= high; ++layer) {
        const double bottom = borders[layer], top = borders[layer + 1] - kAtBoundary;
        Polygon piece;
        if (horizontal) {
            // A flat lies in one layer as a whole, or on the boundary that makes it.
            const double z = (facet[0][2] + facet[1][2] + facet[2][2]) / 3;
            if (z - bottom > kAtBoundary && z < top) piece = facet;
        } else piece = cut(cut(facet, bottom, 1), top, -1);
        if (piece.size() < 3) continue;
        double area = 0;
        Depth deepest;
        auto sample = [&](const Vec3d& s) {
            const double room = (s[2] - bottom) / -n[2];
            if (!(room > kLeastDepth)) return;
            const double depth = measure.covered({s, n, room}, top, intervals);
            if (depth <= std::max(kLeastDepth, deepest.mm)) return;
            const double half = depth / 2;
            const Vec3d middle{s[0] + half * n[0], s[1] + half * n[1], s[2] + half * n[2]};
            if (measure.inside_solid(middle)) return;
            deepest = {depth, s, middle};
        };
        for (std::size_t i = 1; i + 1 < piece.size(); ++i) {
            const std::array<Vec3d, 3> corner{piece[0], piece[i], piece[i + 1]};
            const Vec3d w = cross(minus(corner[1], corner[0]), minus(corner[2], corner[0]));
            if (!(dot(w, w) > 0)) continue;
            area += std::sqrt(dot(w, w)) / 2;
            auto point = [&](double a, double b, double c) {
                Vec3d p{};
                for (int k = 0; k < 3; ++k) p[k] = a * corner[0][k] + b * corner[1][k] + c * corner[2][k];
                return p;
            };
            constexpr double in = 0.02, half = (1 - in) / 2;
            sample(point(1.0 / 3, 1.0 / 3, 1.0 / 3));
            sample(point(half, half, in));
            sample(point(in, half, half));
            sample(point(half, in, half));
            sample(point(1 - in, in / 2, in / 2));
            sample(point(in / 2, 1 - in, in / 2));
            sample(point(in / 2, in / 2, 1 - in));
        }
        if (tallest.height_mm > 0 && borders[tallest.layer] == bottom)
            sample({tallest.x, tallest.y, tallest.z});
        if (deepest.mm <= kLeastDepth) continue;
        unmade.area += area;
        if (deepest.mm > unmade.deepest.mm) unmade.deepest = deepest;
    }
    return unmade;
}

struct UnmadePatches {
    std::vector<UnmadeUndercut> patches;
    std::vector<Depth> thickest;    ///< of each patch
    std::vector<std::uint32_t> of;  ///< the patch of each facet, or kNoFacet
};

// Facets that leave something, joined across their edges, each patch from its lowest facet.
// @param down facets that face down; unmade belongs to them, columns to all facets
UnmadePatches joined(MeshView mesh, const FacetClasses& classes, std::span<const std::uint32_t> down,
                     std::span<const FacetUnmade> unmade, std::span<const FilledUnder> columns) {
    UnmadePatches found;
    found.of.assign(mesh.size(), kNoFacet);
    std::vector<std::uint32_t> slot(mesh.size(), kNoFacet), stack;
    for (std::uint32_t i = 0; i < down.size(); ++i)
        if (unmade[i].deepest.mm > 0) slot[down[i]] = i;
    for (const std::uint32_t seed : down) {
        if (slot[seed] == kNoFacet) continue;
        UnmadeUndercut& patch = found.patches.emplace_back();
        Depth& thickest = found.thickest.emplace_back();
        patch.type = FeatureType::down_flat;
        patch.z_low = HUGE_VAL;
        patch.z_high = -HUGE_VAL;
        std::vector<std::uint32_t> slots{slot[seed]};
        stack.assign(1, seed);
        slot[seed] = kNoFacet;
        while (!stack.empty()) {
            const std::uint32_t f = stack.back();
            stack.pop_back();
            for (const std::uint32_t g : mesh.neighbours[f]) {
                if (g == kNoFacet || slot[g] == kNoFacet) continue;
                slots.push_back(slot[g]);
                slot[g] = kNoFacet;
                stack.push_back(g);
            }
        }
        std::sort(slots.begin(), slots.end());
        for (const std::uint32_t i : slots) {
            const std::uint32_t f = down[i];
            found.of[f] = static_cast<std::uint32_t>(found.patches.size() - 1);
            patch.facets.push_back(f);
            patch.area_mm2 += unmade[i].area;
            if (classes.of[f] == FacetClass::undercut) patch.type = FeatureType::undercut;
            patch.volume_mm3 += columns[f].volume_mm3;
            if (columns[f].height_mm > patch.height_mm) {
                patch.height_mm = columns[f].height_mm;
                patch.x = columns[f].x;
                patch.y = columns[f].y;
                patch.z = columns[f].z;
            }
            if (unmade[i].deepest.mm > thickest.mm) thickest = unmade[i].deepest;
            for (const std::uint32_t v : mesh.facets[f]) {
                patch.z_low = std::min<double>(patch.z_low, mesh.vertices[v].z);
                patch.z_high = std::max<double>(patch.z_high, mesh.vertices[v].z);
            }
        }
    }
    return found;
}

// Walls that lean in under a ceiling have no column of their own: the air is the ceiling's, told once.
std::vector<UnmadeUndercut> told_once(const Measure& measure, std::span<const double> borders,
                                      UnmadePatches&& found) {
    auto& [patches, thickest, of] = found;
    std::vector<char> told(patches.size(), 1);
    for (std::size_t k = 0; k < patches.size(); ++k) {
        UnmadeUndercut& patch = patches[k];
        if (patch.height_mm > 0) continue;
        const std::uint32_t roof = measure.facet_over(thickest[k].middle);
        const std::uint32_t owner = roof == kNoFacet ? kNoFacet : of[roof];
        if (owner != kNoFacet && owner != k && patches[owner].height_mm > 0) {
            UnmadeUndercut& ceiling = patches[owner];
            ceiling.area_mm2 += patch.area_mm2;
            ceiling.z_low = std::min(ceiling.z_low, patch.z_low);
            ceiling.z_high = std::max(ceiling.z_high, patch.z_high);
            ceiling.facets.insert(ceiling.facets.end(), patch.facets.begin(), patch.facets.end());
            if (thickest[k].mm > thickest[owner].mm) thickest[owner] = thickest[k];
            told[k] = 0;
            continue;
        }
        // Too narrow for columns: what stands under the thickest place counts.
        patch.x = thickest[k].at[0];
        patch.y = thickest[k].at[1];
        patch.z = thickest[k].at[2];
        patch.height_mm = measure.height_under(thickest[k].at, borders);
    }
    std::vector<UnmadeUndercut> list;
    for (std::size_t k = 0; k < patches.size(); ++k) {
        if (!told[k]) continue;
        patches[k].thickness_mm = std::min(thickest[k].mm, patches[k].height_mm);
        std::sort(patches[k].facets.begin(), patches[k].facets.end());
        list.push_back(std::move(patches[k]));
    }
    return list;
}

}  // namespace

std::vector<UnmadeUndercut> measure_undercuts(Context& context, MeshView mesh,
                                              std::span<const double> layer_tops,
                                              const FeatureOptions& options) {
    if (mesh.size() == 0) return {};
    const FacetClasses classes = classify_facets(context, mesh, options);
    const std::vector<double> borders = layer_borders(classes.z_base, layer_tops);

    auto faces_down = [&](std::uint32_t f) {
        return classes.of[f] == FacetClass::undercut || classes.of[f] == FacetClass::down_flat;
    };
    std::vector<std::uint32_t> down;
    for (std::uint32_t f = 0; f < mesh.size(); ++f)
        if (faces_down(f)) down.push_back(f);
    if (down.empty()) return {};
    const MemoryCharge charge(context, mesh.size() * 48, "measuring undercuts");
    std::vector<std::uint32_t> all(mesh.size());
    std::iota(all.begin(), all.end(), 0U);
    const Measure measure(context, mesh, all);
    const std::vector<FilledUnder> columns = filled_under(context, mesh, borders, filled_cell(mesh));
    std::vector<FacetUnmade> unmade(down.size());
    parallel_for(context, down.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            unmade[i] = measure_facet(measure, mesh, down[i], borders,
                                      classes.of[down[i]] == FacetClass::down_flat, columns[down[i]]);
    });

    UnmadePatches found = joined(mesh, classes, down, unmade, columns);
    std::vector<UnmadeUndercut> patches = told_once(measure, borders, std::move(found));
    std::sort(patches.begin(), patches.end(), [](const UnmadeUndercut& a, const UnmadeUndercut& b) {
        return std::tie(b.thickness_mm, b.volume_mm3, a.facets.front()) <
               std::tie(a.thickness_mm, a.volume_mm3, b.facets.front());
    });
    return patches;
}

}  // namespace slabwright
