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

constexpr double kFine = 0.001;  // mm by which an offset's arcs are coarser than arcs

// The offsets of one layer.
class ProjectedOffsets {
public:
    explicit ProjectedOffsets(const LayerCut& cut)
        : cut_(cut),
          tool_(cut.layer.tools.finish),
          r_(tool_.diameter / 2),
          slopes_(finish_slopes(cut.job.cutting)),
          op_(cut.operation(OperationKind::finish, "projected offsets", tool_)) {}

    Operation run(std::vector<Diagnostic>& diagnostics) {
        if (slopes_.projection_to < 0) return op_;
        const std::vector<std::uint32_t> chosen = shallow_facets();
        if (chosen.empty()) return op_;
        choose_step(diagnostics);
        const std::vector<Loops> curves = curves_in(chosen);
        const DropIndex ball(cut_.solid, ball_cutter(r_));
        const DropIndex flat(cut_.solid, flat_cutter(cut_.layer.tools.rough.diameter / 2 - 0.02));
        ball_ = &ball, flat_ = &flat;
        const Slide slide{.part = &ball, .chord = chord_, .top = cut_.layer.z_top, .hops = true};
        std::vector<std::vector<std::vector<PathPoint>>> runs(curves.size());
        parallel_each(cut_.context, curves.size(), [&](std::size_t c) {
            for (std::size_t l = 0; l + 1 < curves[c].starts.size(); ++l)
                append_runs(curves[c].loop(l), slide, runs[c]);
        });
        std::vector<std::vector<PathPoint>> inwards;
        for (auto& group : runs)
            for (auto& run : group) inwards.push_back(std::move(run));
        PathBuilder path(op_, tool_, std::min(cut_.job.cutting.finish_feed, cut_.job.machine.max_feed),
                         cut_.layer.z_top + cut_.job.machine.clearance, cut_.layer.z_top + 2);
        path.set_surroundings(cut_.around(tool_, &ball));
        follow_nearest(path, chained(std::move(inwards), slide));
        path.finish();
        return std::move(op_);
    }

private:
    // The facets that the ball finishes by projection.
    std::vector<std::uint32_t> shallow_facets() {
        const double step_nz = std::cos(slopes_.projection_keep) - 1e-9;
        const MeshView& mesh = cut_.layer.mesh;
        std::vector<std::uint32_t> chosen;
        for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
            std::array<Vec3d, 3> p;
            for (int k = 0; k < 3; ++k) {
                const Vec3f& v = mesh.vertices[mesh.facets[f][k]];
                p[k] = {v.x, v.y, v.z};
            }
            const auto [low, high] = std::minmax({p[0][2], p[1][2], p[2][2]});
            if (high <= cut_.layer.z_bottom || low >= cut_.layer.z_top) continue;
            const Vec3d a{p[1][0] - p[0][0], p[1][1] - p[0][1], p[1][2] - p[0][2]},
                b{p[2][0] - p[0][0], p[2][1] - p[0][1], p[2][2] - p[0][2]};
            const Vec3d n{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
            const double area = std::hypot(n[0], n[1], n[2]), nz = area > 0 ? n[2] / area : -1;
            if (nz < keep_nz_) continue;
            chosen.push_back(static_cast<std::uint32_t>(f));
            if (nz >= step_nz) steepest_nz_ = std::min(steepest_nz_, nz);
        }
        return chosen;
    }

    void choose_step(std::vector<Diagnostic>& diagnostics) {
        const double cusp = cut_.job.tolerances.cusp;
        step_ = raster_stepover(r_, cusp, std::sqrt(std::max(0.0, 1 - steepest_nz_ * steepest_nz_)));
        if (step_ < cut_.job.cutting.min_stepover) {
            step_ = cut_.job.cutting.min_stepover;
            diagnostics.push_back(
                {Severity::warning,
                 "finish.stepover_floor",
                 fmt::format(
                     "layer {}: the offsets' step-over was kept at {:.2f} mm, cusps there exceed {:.3f} mm",
                     cut_.layer.index, step_, cusp),
                 {}});
        }
        op_.stepover = step_;
    }

    // Offsets of the facets' outline, inwards, and what they leave between them.
    [[nodiscard]] std::vector<Loops> curves_in(const std::vector<std::uint32_t>& chosen) const {
        // The ball stands beside its contact, so its places reach past the border by that much.
        Loops travel;
        for (const auto& [x, y] : {std::pair{cut_.low(0, r_), cut_.low(1, r_)},
                                   {cut_.high(0, r_), cut_.low(1, r_)},
                                   {cut_.high(0, r_), cut_.high(1, r_)},
                                   {cut_.low(0, r_), cut_.high(1, r_)}})
            travel.points.push_back({to_units(x), to_units(y)});
        travel.close_loop();
        const Loops region = intersect(
            offset(outline(cut_.layer.mesh, chosen), r_ * std::sqrt(1 - keep_nz_ * keep_nz_), kFine), travel);
        const double across =
            std::hypot(cut_.high(0, r_) - cut_.low(0, r_), cut_.high(1, r_) - cut_.low(1, r_));
        std::vector<Loops> curves;
        Loops outer = region;
        for (int k = 1; !outer.empty() && (k - 1) * step_ <= across; ++k) {
            Loops inner = offset(region, -k * step_, kFine);
            // What lies farther than half a step from both curves, in their corners and where the inner one
            // ends: once around it.
            const Loops far = subtract(offset(outer, -step_ / 2, kFine), offset(inner, step_ / 2, kFine));
            Loops between = offset(offset(far, -0.02, kFine), 0.02, kFine);
            curves.push_back(std::move(outer));
            if (!between.empty()) curves.push_back(std::move(between));
            outer = std::move(inner);
        }
        return curves;
    }

    [[nodiscard]] bool is_floor(double z) const {
        return std::any_of(cut_.floors.begin(), cut_.floors.end(),
                           [&](double floor) { return z <= floor + 1e-6 && z >= floor - kSameFloor; });
    }
    [[nodiscard]] Place place(Point2 at) const {
        constexpr double level_nz = 0.999999;
        const double x = to_mm(at.x), y = to_mm(at.y);
        const Rest rest = ball_->drop(x, y);
        const double contact = rest.contact_z(r_);
        Place p{at.x, at.y, 0, rest.tip_z, false, rest.tip_z >= cut_.layer.floor_below && !rest.on_cap,
                false};
        p.wanted = p.reachable && rest.nz >= keep_nz_ && contact >= cut_.layer.z_bottom - 0.02 &&
                   contact < cut_.layer.z_top - 1e-6;
        if (p.wanted && rest.nz > level_nz && is_floor(contact) && !flat_->stands_over(x, y, contact + 1e-3))
            p.wanted = false;
        if (p.reachable) p.z = to_units(p.tip) + 1;
        return p;
    }
    void append_places(std::vector<Place>& line, const Place& b) const {
        const std::int32_t finest = to_units(0.02);
        if (!line.empty()) {
            const Place& a = line.back();
            const double way = std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y);
            const bool both = a.reachable && b.reachable;
            const bool apart = way > 0.75 * chord_ * kUnitsPerMm ||
                               (way > 2 * finest && (both ? std::hypot(to_mm(static_cast<std::int64_t>(way)),
                                                                       a.tip - b.tip) > chord_
                                                          : a.reachable != b.reachable));
            if (apart) {
                append_places(line, place({a.x + (b.x - a.x) / 2, a.y + (b.y - a.y) / 2}));
                append_places(line, b);
                return;
            }
        }
        line.push_back(b);
    }

    // The stretches of a loop on which the ball has something to make.
    void append_runs(std::span<const Point2> loop, const Slide& slide,
                     std::vector<std::vector<PathPoint>>& runs) const {
        std::vector<Place> ring;
        for (const Point2 p : loop) append_places(ring, place(p));
        append_places(ring, Place(ring.front()));
        ring.pop_back();
        const std::size_t n = ring.size();
        std::size_t start = n;
        for (std::size_t k = 0; k < n; ++k) {
            ring[k].cut = ring[k].wanted ||
                          (ring[k].reachable && (ring[(k + 1) % n].wanted || ring[(k + n - 1) % n].wanted));
            if (!ring[k].cut && start == n) start = k;
        }
        const bool closed = start == n;
        std::vector<PathPoint> run;
        auto close = [&] {
            if (run.size() > 1)
                runs.push_back(simplify(run, simplify_tolerance_units(cut_.job.tolerances.gouge)));
            run.clear();
        };
        for (std::size_t k = 0; k < n + (closed ? 1 : 0); ++k) {
            const Place& p = ring[(start + k) % n];
            if (p.cut) append_free(run, {p.x, p.y, p.z}, slide);
            else close();
        }
        close();
    }

    const LayerCut& cut_;
    const Tool& tool_;
    const double r_;
    const FinishSlopes slopes_;
    Operation op_;
    const double keep_nz_ = std::cos(slopes_.projection_to);
    const double chord_ = safe_chord_mm(r_, cut_.job.tolerances.gouge);
    double steepest_nz_ = 1;  // of the facets whose cusp decides
    double step_ = 0;         // mm
    const DropIndex* ball_ = nullptr;
    const DropIndex* flat_ = nullptr;
};

}  // namespace

Operation finish_offsets(const LayerCut& cut, std::vector<Diagnostic>& diagnostics) {
    return ProjectedOffsets(cut).run(diagnostics);
}

}  // namespace slabwright
