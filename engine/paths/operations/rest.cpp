// How the lines of a rest pass are travelled: of all places only those that lower the stock, in runs along
// the surface, and in steps from above where waste is deep.
#include "engine/paths/operations/rest.h"

#include <algorithm>
#include <cmath>

#include "engine/paths/operations/rest_lines.h"
#include "engine/paths/operations/roughing.h"
#include "engine/paths/operations/semi_rough.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/rings.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/cutting/drop.h"

namespace slabwright {

namespace {

constexpr double kOver = 0.005;  // mm by which a straight way may leave the places between its ends, and cut,
constexpr double kOverShare = 0.25;  // and what share of the gouge tolerance
constexpr double kSteepestWay = 3;   // slope up which it goes straight; up walls by steps
constexpr double kLift = 0.02;       // mm by which a straight way may stand over them,
constexpr double kLiftShare = 0.25;  // and what share of the pass's limit
constexpr double kBridge = 3.0;      // mm between two useful stretches that are travelled along the surface

double over_of(const Job& job) { return std::min(kOver, kOverShare * job.tolerances.gouge); }

class RestPaths : private RestLines {
public:
    using RestLines::RestLines;

    Operation run() {
        Operation op = cut_.operation(pass_.kind, pass_.purpose, tool_);
        op.spare = pass_.allowance;
        if (targets_.count() == 0) return op;
        lay();
        std::vector<std::vector<PathPoint>> runs;
        for (const RestLine& line : lines_) {
            cut_.context.throw_if_cancelled();
            append_runs(line, runs);
        }
        op.stepover = to_mm(spacing_);
        op.stepdown = pass_.in_steps ? tool_.stepdown_max : 0;
        emit(op, runs);
        const Taken taken = stock_.cut(cut_.context, op, tool_);
        if (taken.nothing()) op.moves.clear();
        return op;
    }

private:
    [[nodiscard]] Slide slide() const {
        return {.part = index_,
                .ball = ball_,
                .chord = chord_,
                .top = cut_.layer.z_top,
                .near = kBridge,
                .under = under_,
                .hops = !pass_.in_steps,
                .steepest = kSteepestWay,
                .over = over_of(cut_.job)};
    }

    void append_runs(const RestLine& line, std::vector<std::vector<PathPoint>>& runs) const {
        std::vector<Place> run;
        std::size_t last_cut = 0;
        const Place* before = nullptr;
        auto close = [&] {
            run.resize(last_cut);
            if (!run.empty()) {
                std::vector<PathPoint> points = points_along(run);
                runs.push_back(pass_.in_steps ? std::move(points)
                                              : simplify(points, simplify_tolerance_units(tolerance_)));
            }
            run.clear();
            last_cut = 0;
        };
        for (const Place& p : line.places) {
            const bool gap = before && apart(p, *before) > chord_ * kUnitsPerMm;
            if (!run.empty() &&
                (gap || !p.reachable || (!p.cut && apart(p, run[last_cut - 1]) > to_units(kBridge))))
                close();
            if (p.reachable && (p.cut || !run.empty())) {
                // One place beside the first: the cutter comes in along the surface instead of straight down.
                if (run.empty() && before && !gap && before->reachable) run.push_back(*before);
                run.push_back(p);
                if (p.cut) last_cut = run.size();
            }
            before = &p;
        }
        close();
    }

    // A flat end mill goes up and down slopes as straight as it may, not by steps, no more than kLift over
    // the places of the run.
    std::vector<PathPoint> points_along(const std::vector<Place>& run) const {
        std::vector<PathPoint> points;
        const Slide along = slide();
        const bool straight = !ball_ && !pass_.in_steps;
        for (std::size_t i = 0; i < run.size(); ++i) {
            append_free(points, {run[i].x, run[i].y, run[i].z}, along);
            while (straight) {
                const auto [j, z] = farthest_straight(run, i, points.back().z);
                if (j == i) break;
                points.push_back({run[j].x, run[j].y, z});
                i = j;
            }
        }
        return points;
    }

    struct Straight {
        std::size_t end;  // of a run's places
        std::int32_t z;   // 0.1 µm, there
    };

    // The farthest place of a run, at the lowest height there, that a flat end mill may go straight to from
    // height z at the place i; i itself where there is none.
    Straight farthest_straight(const std::vector<Place>& run, std::size_t i, std::int32_t z) const {
        Straight found{i, z};
        if (i + 1 >= run.size() || (z == run[i].z && z == run[i + 1].z)) return found;
        const double over = over_of(cut_.job), lift = std::min(kLift, kLiftShare * pass_.limit);
        const Point3 a{to_mm(run[i].x), to_mm(run[i].y), to_mm(z)};
        // Slopes that lead to each place between its own height and the lift over it, and so over those
        // before it.
        std::vector<double> slopes;
        double low = -kSteepestWay, high = kSteepestWay;
        for (std::size_t j = i + 1; j < run.size(); ++j) {
            const Point3 p = middle_of(run[j]);
            const double l = std::hypot(p[0] - a[0], p[1] - a[1]);
            if (!(l > 0)) break;
            low = std::max(low, (p[2] - a[2]) / l);
            high = std::min(high, (p[2] + lift - a[2]) / l);
            if (low > high) break;
            slopes.push_back(low);
        }
        for (std::size_t steps = slopes.size(); steps > 0; steps /= 2) {
            const Point3 p = middle_of(run[i + steps]);
            const double l = std::hypot(p[0] - a[0], p[1] - a[1]);
            const Point3 b{p[0], p[1], std::max(p[2], a[2] + slopes[steps - 1] * l)};
            if (lies_along(run, i, i + steps, over) && index_->way_is_free(a, b, over))
                return {i + steps, to_units(b[2]) + (b[2] > p[2] ? 1 : 0)};
        }
        return found;
    }

    // Whether the places between two of a run lie on the straight line between these, seen from above.
    static bool lies_along(const std::vector<Place>& run, std::size_t i, std::size_t j, double over) {
        const Point3 a = middle_of(run[i]), b = middle_of(run[j]);
        const double l = std::hypot(b[0] - a[0], b[1] - a[1]), c = (b[0] - a[0]) / l, s = (b[1] - a[1]) / l;
        for (std::size_t k = i + 1; k < j; ++k) {
            const Point3 p = middle_of(run[k]);
            if (std::abs(c * (p[1] - a[1]) - s * (p[0] - a[0])) > over) return false;
        }
        return true;
    }

    static Point3 middle_of(const Place& p) { return {to_mm(p.x), to_mm(p.y), to_mm(p.z)}; }

    // The highest stock under the cutter before this pass, mm.
    [[nodiscard]] double stood(std::int32_t ux, std::int32_t uy) const {
        const CellGrid& grid = stock_.grid();
        const double x = to_mm(ux), y = to_mm(uy);
        double top = -kUnbounded;
        sweep(grid, {CutterEnd::Form::flat, r_, 0}, {x, y, 0}, {x, y, 0},
              [&](std::size_t c, double) { top = std::max(top, static_cast<double>(stock_.height(c))); });
        return top + stock_.z_bottom();
    }

    void emit(Operation& op, const std::vector<std::vector<PathPoint>>& runs) const {
        PathBuilder path(op, tool_, std::min(cut_.job.cutting.finish_feed, cut_.job.machine.max_feed),
                         cut_.layer.z_top + cut_.job.machine.clearance, cut_.layer.z_top + 2);
        path.set_surroundings(cut_.around(tool_, index_));
        if (!pass_.in_steps) {
            cut_.context.throw_if_cancelled();
            follow_nearest(path, chained(runs, slide()));
            path.finish();
            return;
        }
        // Level by level from the layer's top, so that beside the cutter nothing stands by more than a step.
        std::vector<std::vector<double>> stood_at(runs.size());
        std::vector<double> tops(runs.size(), -kUnbounded);
        double lowest = cut_.layer.z_top;
        for (std::size_t r = 0; r < runs.size(); ++r) {
            cut_.context.throw_if_cancelled();
            for (const PathPoint& p : runs[r]) {
                stood_at[r].push_back(stood(p.x, p.y));
                tops[r] = std::max(tops[r], stood_at[r].back());
                lowest = std::min(lowest, to_mm(p.z));
            }
        }
        const double step =
            tool_.stepdown_max > 0 ? tool_.stepdown_max : cut_.layer.z_top - cut_.layer.z_bottom;
        for (double above = cut_.layer.z_top; above > lowest + 1e-6; above -= step) {
            cut_.context.throw_if_cancelled();
            const double level = above - step;
            std::vector<std::vector<PathPoint>> parts;
            for (std::size_t r = 0; r < runs.size(); ++r) {
                if (tops[r] <= level + 1e-3) continue;
                std::vector<PathPoint> part;
                for (std::size_t i = 0; i <= runs[r].size(); ++i) {
                    // Nothing to do here on this level: it was cut on the one before, or nothing stands above
                    // it.
                    const bool nothing = i == runs[r].size() || to_mm(runs[r][i].z) >= above - 1e-6 ||
                                         stood_at[r][i] <= level + 1e-3;
                    if (!nothing)
                        part.push_back({runs[r][i].x, runs[r][i].y, std::max(runs[r][i].z, to_units(level))});
                    else if (!part.empty())
                        parts.push_back(simplify(part, simplify_tolerance_units(tolerance_))), part.clear();
                }
            }
            follow_nearest(path, chained(std::move(parts), slide()));
        }
        path.finish();
    }
};

}  // namespace

double semi_rough_allowance(const Job& job, const Tool& tool, double limit) {
    const double allowance = std::min({std::min(job.cutting.wall_allowance, job.cutting.floor_allowance) / 3,
                                       tool.diameter / 10, limit / 5});
    return allowance < 2 * job.tolerances.gouge ? 0 : allowance;
}

Operation cut_rest(const LayerCut& cut, LayerStock& stock, const Tool& tool, const RestPass& pass) {
    if (!(pass.allowance > 0)) return RestPaths(cut, stock, tool, pass).run();
    Operation all;
    auto add = [&](Operation&& op) {
        if (all.moves.empty()) {
            all = std::move(op);
            return;
        }
        if (op.moves.empty()) return;
        all.stepdown = std::max(all.stepdown, op.stepdown);
        all.moves.insert(all.moves.end(), op.moves.begin(), op.moves.end());
    };
    // Rings first, which are long and level; what they leave on flat slopes is crossed.
    if (pass.in_steps && tool.kind == ToolKind::ball)
        add(semi_rough_layer(cut, stock, tool, {pass.purpose, pass.limit, pass.swath, pass.allowance}));
    add(RestPaths(cut, stock, tool, pass).run());
    // What only the cutter itself enters: slots hardly wider, the depth of narrow valleys. The wall of what
    // was kept is no reason to go there.
    RestPass narrow = pass;
    narrow.allowance = 0;
    narrow.skin = 2 * pass.allowance;
    add(RestPaths(cut, stock, tool, narrow).run());
    return all;
}

}  // namespace slabwright
