// Finishing by projected offsets (SHAPING 3): the border of what is to be finished is offset inwards again
// and again by one step-over, and the ball is dropped on the surface along these curves.
#include "engine/paths/operations/offsets.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/cutting/cusp.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// The outline, seen from above, of the mesh's facets that are chosen: edges between two of them cancel out.
Loops outline(const MeshView& mesh, const std::vector<std::uint32_t>& chosen) {
    struct Edge {
        std::uint32_t from, to;
    };
    std::vector<Edge> edges;
    for (const std::uint32_t f : chosen)
        for (int k = 0; k < 3; ++k) edges.push_back({mesh.facets[f][k], mesh.facets[f][(k + 1) % 3]});
    auto key = [](const Edge& e) { return std::pair(std::min(e.from, e.to), std::max(e.from, e.to)); };
    std::sort(edges.begin(), edges.end(), [&](const Edge& a, const Edge& b) {
        return std::pair(key(a), a.from) < std::pair(key(b), b.from);
    });
    std::vector<Edge> border;
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i;
        std::ptrdiff_t forward = 0;
        for (; end < edges.size() && key(edges[end]) == key(edges[i]); ++end)
            forward += edges[end].from < edges[end].to ? 1 : -1;
        const auto [low, high] = key(edges[i]);
        for (; forward > 0; --forward) border.push_back({low, high});
        for (; forward < 0; ++forward) border.push_back({high, low});
        i = end;
    }
    // As many edges of the border leave a vertex as come to it, so any chain that goes on closes.
    std::sort(border.begin(), border.end(),
              [](const Edge& a, const Edge& b) { return std::pair(a.from, a.to) < std::pair(b.from, b.to); });
    std::vector<char> used(border.size(), 0);
    Loops loops;
    for (std::size_t i = 0; i < border.size(); ++i) {
        if (used[i]) continue;
        for (std::size_t at = i;;) {
            used[at] = 1;
            const Vec3f& v = mesh.vertices[border[at].from];
            loops.points.push_back({to_units(v.x), to_units(v.y)});
            auto next = std::lower_bound(border.begin(), border.end(), border[at].to,
                                         [](const Edge& e, std::uint32_t value) { return e.from < value; });
            while (next != border.end() && next->from == border[at].to &&
                   used[static_cast<std::size_t>(next - border.begin())])
                ++next;
            if (next == border.end() || next->from != border[at].to) break;
            at = static_cast<std::size_t>(next - border.begin());
        }
        loops.close_loop();
    }
    return simplify(loops);
}

struct Place {
    std::int32_t x = 0, y = 0, z = 0;
    double tip = 0;  // mm
    bool wanted = false, reachable = false, cut = false;
};

}  // namespace

Operation finish_offsets(const LayerCut& cut, std::vector<Diagnostic>& diagnostics) {
    const Tool& tool = cut.layer.tools.finish;
    Operation op = cut.operation(OperationKind::finish, "projected offsets", tool);
    const double r = tool.diameter / 2, gouge = cut.job.tolerances.gouge, cusp = cut.job.tolerances.cusp;
    const FinishSlopes slopes = finish_slopes(cut.job.cutting);
    if (slopes.projection_to < 0) return op;
    const double keep_nz = std::cos(slopes.projection_to), step_nz = std::cos(slopes.projection_keep) - 1e-9;
    constexpr double level_nz = 0.999999;

    const MeshView& mesh = cut.layer.mesh;
    std::vector<std::uint32_t> chosen;
    double steepest_nz = 1;  // of those whose cusp decides
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
        std::array<Vec3d, 3> p;
        for (int k = 0; k < 3; ++k) {
            const Vec3f& v = mesh.vertices[mesh.facets[f][k]];
            p[k] = {v.x, v.y, v.z};
        }
        const auto [low, high] = std::minmax({p[0][2], p[1][2], p[2][2]});
        if (high <= cut.layer.z_bottom || low >= cut.layer.z_top) continue;
        const Vec3d a{p[1][0] - p[0][0], p[1][1] - p[0][1], p[1][2] - p[0][2]},
            b{p[2][0] - p[0][0], p[2][1] - p[0][1], p[2][2] - p[0][2]};
        const Vec3d n{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        const double area = std::hypot(n[0], n[1], n[2]), nz = area > 0 ? n[2] / area : -1;
        if (nz < keep_nz) continue;
        chosen.push_back(static_cast<std::uint32_t>(f));
        if (nz >= step_nz) steepest_nz = std::min(steepest_nz, nz);
    }
    if (chosen.empty()) return op;
    double d = raster_stepover(r, cusp, std::sqrt(std::max(0.0, 1 - steepest_nz * steepest_nz)));
    if (d < cut.job.cutting.min_stepover) {
        d = cut.job.cutting.min_stepover;
        diagnostics.push_back(
            {Severity::warning,
             "finish.stepover_floor",
             fmt::format(
                 "layer {}: the offsets' step-over was kept at {:.2f} mm, cusps there exceed {:.3f} mm",
                 cut.layer.index, d, cusp),
             {}});
    }
    op.stepover = d;

    // The ball stands beside its contact, so its places reach past the border by that much.
    Loops travel;
    for (const auto& [x, y] : {std::pair{cut.low(0, r), cut.low(1, r)},
                               {cut.high(0, r), cut.low(1, r)},
                               {cut.high(0, r), cut.high(1, r)},
                               {cut.low(0, r), cut.high(1, r)}})
        travel.points.push_back({to_units(x), to_units(y)});
    travel.close_loop();
    constexpr double fine = 0.001;
    const Loops region =
        intersect(offset(outline(mesh, chosen), r * std::sqrt(1 - keep_nz * keep_nz), fine), travel);
    const double across = std::hypot(cut.high(0, r) - cut.low(0, r), cut.high(1, r) - cut.low(1, r));
    std::vector<Loops> curves;
    Loops outer = region;
    for (int k = 1; !outer.empty() && (k - 1) * d <= across; ++k) {
        Loops inner = offset(region, -k * d, fine);
        // What lies farther than half a step from both curves, in their corners and where the inner one ends:
        // once around it.
        const Loops far = subtract(offset(outer, -d / 2, fine), offset(inner, d / 2, fine));
        Loops between = offset(offset(far, -0.02, fine), 0.02, fine);
        curves.push_back(std::move(outer));
        if (!between.empty()) curves.push_back(std::move(between));
        outer = std::move(inner);
    }

    const DropIndex ball(cut.solid, {Cutter::Profile::ball, r});
    const DropIndex flat(cut.solid, {Cutter::Profile::flat, cut.layer.tools.rough.diameter / 2 - 0.02});
    const double chord = safe_chord_mm(r, gouge);
    auto floor_done = [&](double z) {
        return std::any_of(cut.floors.begin(), cut.floors.end(),
                           [&](double floor) { return z <= floor + 1e-6 && z >= floor - kSameFloor; });
    };
    auto place = [&](Point2 at) {
        const double x = to_mm(at.x), y = to_mm(at.y);
        const Rest rest = ball.drop(x, y);
        const double contact = rest.contact_z(r);
        Place p{at.x, at.y, 0, rest.tip_z, false, rest.tip_z >= cut.layer.floor_below && !rest.on_cap, false};
        p.wanted = p.reachable && rest.nz >= keep_nz && contact >= cut.layer.z_bottom - 0.02 &&
                   contact < cut.layer.z_top - 1e-6;
        if (p.wanted && rest.nz > level_nz && floor_done(contact) && !flat.stands_over(x, y, contact + 1e-3))
            p.wanted = false;
        if (p.reachable) p.z = to_units(p.tip) + 1;
        return p;
    };
    const std::int32_t finest = to_units(0.02);
    auto append_places = [&](auto&& self, std::vector<Place>& line, const Place& b) -> void {
        if (!line.empty()) {
            const Place& a = line.back();
            const double way = std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y);
            const bool both = a.reachable && b.reachable;
            const bool apart = way > 0.75 * chord * kUnitsPerMm ||
                               (way > 2 * finest && (both ? std::hypot(to_mm(static_cast<std::int64_t>(way)),
                                                                       a.tip - b.tip) > chord
                                                          : a.reachable != b.reachable));
            if (apart) {
                self(self, line, place({a.x + (b.x - a.x) / 2, a.y + (b.y - a.y) / 2}));
                self(self, line, b);
                return;
            }
        }
        line.push_back(b);
    };
    const Slide slide{&ball, true, chord, cut.layer.z_top, 3};
    std::vector<std::vector<std::vector<PathPoint>>> runs(curves.size());
    parallel_each(cut.context, curves.size(), [&](std::size_t c) {
        const Loops& loops = curves[c];
        for (std::size_t l = 0; l + 1 < loops.starts.size(); ++l) {
            std::vector<Place> ring;
            for (std::size_t k = loops.starts[l]; k < loops.starts[l + 1]; ++k)
                append_places(append_places, ring, place(loops.points[k]));
            append_places(append_places, ring, Place(ring.front()));
            ring.pop_back();
            const std::size_t n = ring.size();
            std::size_t start = n;
            for (std::size_t k = 0; k < n; ++k) {
                ring[k].cut = ring[k].wanted || (ring[k].reachable &&
                                                 (ring[(k + 1) % n].wanted || ring[(k + n - 1) % n].wanted));
                if (!ring[k].cut && start == n) start = k;
            }
            const bool closed = start == n;
            std::vector<PathPoint> run;
            auto close = [&] {
                if (run.size() > 1) runs[c].push_back(simplify(run, simplify_tolerance_units(gouge)));
                run.clear();
            };
            for (std::size_t k = 0; k < n + (closed ? 1 : 0); ++k) {
                const Place& p = ring[(start + k) % n];
                if (p.cut) append_free(run, {p.x, p.y, p.z}, slide);
                else close();
            }
            close();
        }
    });
    std::vector<std::vector<PathPoint>> inwards;
    for (auto& group : runs)
        for (auto& run : group) inwards.push_back(std::move(run));

    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed),
                     cut.layer.z_top + cut.job.machine.clearance, cut.layer.z_top + 2);
    path.set_surroundings(cut.around(tool, &ball));
    follow_nearest(path, chained(std::move(inwards), slide));
    path.finish();
    return op;
}

}  // namespace slabwright
