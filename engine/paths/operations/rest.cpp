// A raster of drops over what is left, refined where the cutter's rest jumps and something stands that could
// be lowered there; of all places only those are kept that lower the stock, and finer lines are laid over
// what coarser ones leave. So a wide rest is cleared by an even raster, and a corner by the few places along
// it.
#include "engine/paths/operations/rest.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "engine/paths/operations/rest_places.h"
#include "engine/paths/operations/roughing.h"
#include "engine/paths/operations/semi_rough.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/rings.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/cutting/drop.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kSettle = 0.01;  // mm by which a low point of a line lies under its neighbours
constexpr float kMuch = 0.25F;    // mm left that are worth a search for a place (probe)
constexpr double kProbed = 1.0;   // mm: of squares of this side one cell is
constexpr int kProbes = 32;       // places around it
constexpr double kOver = 0.005;  // mm by which a straight way may leave the places between its ends, and cut,
constexpr double kOverShare = 0.25;  // and what share of the gouge tolerance
constexpr double kSteepestWay = 3;   // slope up which it goes straight; up walls by steps
constexpr double kBridge = 3.0;      // mm between two useful stretches that are travelled along the surface

struct Line {
    std::int32_t y = 0;
    std::vector<RestPlace> places;
};

class RestPaths : private RestPlaces {
public:
    using RestPlaces::RestPlaces;

    Operation run() {
        Operation op = cut_.operation(pass_.kind, pass_.purpose, tool_);
        op.spare = pass_.allowance;
        if (targets_.count() == 0) return op;
        find_room();
        index_ = &cut_.drops(dropped());
        {
            LayerStock::Trial places(stock_);  // the stock stands as before when its lines are known
            lay_lines();
            settle();
            if (!(pass_.allowance > 0))
                probe();  // the pass after one that keeps off the walls is the one for narrow slots
            places.undo();
        }
        std::vector<std::vector<PathPoint>> runs;
        for (const Line& line : lines_) {
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
    // The cutter, thicker all around by what is kept off walls; a flat end mill on its side alone.
    [[nodiscard]] CutterShape dropped() const {
        if (!ball_) return flat_cutter(wide_);
        if (!has_taper(tool_.kind)) return ball_cutter(wide_);
        return {r_ + pass_.allowance, wide_, cutter_shape(tool_).taper_rad};
    }

    void append_between(std::vector<Place>& line, std::int32_t y, Place b, MetPoints& met) const {
        if (!line.empty() && b.x - line.back().x <= step_ && b.x - line.back().x > 2 * finest_ &&
            (too_far(line.back(), b, 0) || too_steep(line.back(), b))) {
            append_between(line, y, place(line.back().x + (b.x - line.back().x) / 2, y, met), met);
            append_between(line, y, b, met);
            return;
        }
        line.push_back(b);
    }

    static const Place* at(const Line& line, std::int32_t x) {
        const auto it = std::lower_bound(line.places.begin(), line.places.end(), x,
                                         [](const Place& p, std::int32_t v) { return p.x < v; });
        return it != line.places.end() && it->x == x ? &*it : nullptr;
    }

    // An even raster over the targets, then lines between its lines where the rest jumps from one to the
    // next.
    void lay_lines() {
        const CellGrid& grid = stock_.grid();
        const auto [first, last] = targets_.rows();
        spacing_ = std::max(1, to_units(pass_.in_steps ? 0.7 * tip_r_
                                        : ball_        ? std::sqrt(8 * tip_r_ * cut_.job.tolerances.cusp)
                                                       : std::min(1.0, r_ / 4)));
        const auto low = static_cast<std::int32_t>(std::floor((grid.y(first) - r_) * kUnitsPerMm / spacing_)),
                   high = static_cast<std::int32_t>(std::ceil((grid.y(last) + r_) * kUnitsPerMm / spacing_));
        const double y_low = cut_.low(1, r_), y_high = cut_.high(1, r_);
        std::vector<Line> even;
        for (std::int32_t k = low; k <= high; ++k)
            if (to_mm(k * spacing_) >= y_low && to_mm(k * spacing_) <= y_high)
                even.push_back({k * spacing_, {}});
        const double x_low = cut_.low(0, r_), x_high = cut_.high(0, r_);
        // A place that helps may lie between the last line that covers a target and the next, which is looked
        // at only where both have places.
        const double covers = pass_.in_steps ? r_ : r_ + to_mm(spacing_);
        parallel_each(cut_.context, even.size(), [&](std::size_t l) {
            MetPoints met;
            for (const auto& span : targets_.around(to_mm(even[l].y), covers, x_low, x_high)) {
                const std::int32_t from =
                                       (span[0] >= 0 ? span[0] / step_ : -((-span[0] + step_ - 1) / step_)),
                                   to = span[1] / step_ + 1;
                for (std::int32_t k = from; k <= to; ++k) {
                    if (!even[l].places.empty() && k * step_ <= even[l].places.back().x) continue;
                    append_between(even[l].places, even[l].y, place(k * step_, even[l].y, met), met);
                }
            }
        });
        keep_what_lowers(even);
        lines_ = std::move(even);
        // What the lines so far leave decides where the next ones go.
        std::vector<std::array<std::size_t, 2>> neighbours;
        for (std::size_t l = 0; l + 1 < lines_.size(); ++l) neighbours.push_back({l, l + 1});
        while (!neighbours.empty()) {
            std::vector<Line> middles(neighbours.size());
            parallel_each(cut_.context, neighbours.size(), [&](std::size_t n) {
                middles[n] = middle(lines_[neighbours[n][0]], lines_[neighbours[n][1]]);
            });
            keep_what_lowers(middles);
            std::vector<std::array<std::size_t, 2>> next;
            for (std::size_t n = 0; n < neighbours.size(); ++n) {
                if (middles[n].places.empty()) continue;
                next.push_back({neighbours[n][0], lines_.size()});
                next.push_back({lines_.size(), neighbours[n][1]});
                lines_.push_back(std::move(middles[n]));
            }
            neighbours = std::move(next);
        }
    }

    // Whether a line ends at a place of a flat end mill, or is stopped by a wall there, short of something
    // that stands: in a channel that narrows a line between it and the next goes on.
    [[nodiscard]] bool ends(const Place& p, const Line& line) const {
        if (ball_ || !p.reachable) return false;
        const auto goes_on = [&](std::int32_t x) {
            const Place* next = at(line, x);
            return next && next->tip <= p.tip + kJump;
        };
        return !(goes_on(p.x - step_) && goes_on(p.x + step_)) &&
               lowers(to_mm(p.x), to_mm(p.y), p.tip, to_mm(step_));
    }

    // A line between two, over what is too far from one to the other; without places where nothing is.
    [[nodiscard]] Line middle(const Line& a, const Line& b) const {
        Line line{a.y + (b.y - a.y) / 2, {}};
        if (b.y - a.y < 2 * finest_) return line;
        std::vector<std::int32_t> over;
        for (const Place& p : a.places) {
            if (p.x % step_ != 0) continue;
            if (const Place* other = at(b, p.x);
                (other && too_far(p, *other, to_mm(step_) / 2)) || ends(p, a))
                over.push_back(p.x);
        }
        for (const Place& p : b.places)
            if (p.x % step_ == 0 && ends(p, b)) over.push_back(p.x);
        std::sort(over.begin(), over.end());
        MetPoints met;
        for (const std::int32_t middle : over)
            for (const std::int32_t x : {middle - step_, middle, middle + step_})
                if (line.places.empty() || x > line.places.back().x)
                    append_between(line.places, line.y, place(x, line.y, met), met);
        return line;
    }

    // Where the cutter sinks deepest between walls (a slot hardly wider than itself, a hole narrower, the
    // meeting of three faces) no raster hits the place: from where a line, or the lines beside it, are higher
    // on both sides it slides down to where it rests on all sides. What lies in a row is travelled as a line.
    void settle() {
        std::vector<std::size_t> by_y(lines_.size());
        std::iota(by_y.begin(), by_y.end(), std::size_t{0});
        std::sort(by_y.begin(), by_y.end(), [&](std::size_t a, std::size_t b) {
            return std::pair(lines_[a].y, a) < std::pair(lines_[b].y, b);
        });
        // A place past a wall's foot that only the layer's bottom keeps as high is no wall.
        auto higher = [&](const Place* beside, const Place& p) {
            return beside && (beside->touches || !beside->reachable) && p.tip < beside->tip - kSettle;
        };
        // Up to the next line of the even raster: lines between may not come by here.
        auto beside = [&](std::size_t rank, bool after, std::int32_t x) -> const Place* {
            const std::int32_t y = lines_[by_y[rank]].y;
            for (std::size_t k = rank; after ? k + 1 < by_y.size() : k > 0;) {
                const Line& line = lines_[by_y[after ? ++k : --k]];
                if (std::abs(line.y - y) > spacing_) break;
                if (const Place* p = at(line, x)) return p;
            }
            return nullptr;
        };
        std::vector<std::vector<Line>> found(lines_.size());
        parallel_each(cut_.context, lines_.size(), [&](std::size_t rank) {
            const std::size_t l = by_y[rank];
            const std::vector<Place>& places = lines_[l].places;
            for (std::size_t i = 0; i < places.size(); ++i) {
                const Place& p = places[i];
                if (!p.reachable) continue;
                const bool in_line = i > 0 && i + 1 < places.size() &&
                                     places[i + 1].x - places[i - 1].x <= 2 * step_ &&
                                     higher(&places[i - 1], p) && higher(&places[i + 1], p);
                const bool across = !in_line && p.x % step_ == 0 && higher(beside(rank, false, p.x), p) &&
                                    higher(beside(rank, true, p.x), p);
                if (!in_line && !across) continue;
                const Place low = slide(p);
                if (!low.useful) continue;
                std::vector<Line>& lines = found[l];
                if (!lines.empty() && apart(lines.back().places.back(), low) <= chord_ * kUnitsPerMm)
                    lines.back().places.push_back(low);
                else lines.push_back({low.y, {low}});
            }
        });
        std::vector<Line> all;
        for (std::size_t rank = 0; rank < by_y.size(); ++rank)
            for (Line& line : found[by_y[rank]]) all.push_back(std::move(line));
        keep_what_lowers(all);
        for (Line& line : all) lines_.push_back(std::move(line));
    }

    // A slot so narrow that the raster's places on both sides of it stand on its walls' tops, which are
    // level, shows nowhere. Where much is left, a flat end mill is held with its rim over it, all around, and
    // slides down from where it is lowest. A ball slides from over what is left: where its places on a slot's
    // walls lie over all that still stands, the raster has not looked at them.
    void probe() {
        const std::array<int, 2> rows = targets_.rows();
        const int first = rows[0], last = rows[1];
        if (first > last) return;
        const CellGrid& grid = stock_.grid();
        const int side =
            std::max(1, static_cast<int>(kProbed / grid.cell));  // cells of a square, of which one is probed
        const double much = std::max(double{kMuch}, pass_.limit);
        const double beside = r_ - 0.7 * grid.cell, x_low = cut_.low(0, r_), x_high = cut_.high(0, r_),
                     y_low = cut_.low(1, r_), y_high = cut_.high(1, r_);
        std::vector<std::vector<Line>> found(static_cast<std::size_t>((last - first) / side + 1));
        parallel_each(cut_.context, found.size(), [&](std::size_t b) {
            cut_.context.throw_if_cancelled();
            std::vector<std::array<int, 2>> cells;  // one of each square
            std::vector<char> taken(static_cast<std::size_t>(grid.nx / side + 1), 0);
            const int row = first + static_cast<int>(b) * side;
            for (int j = row; j <= std::min(last, row + side - 1); ++j)
                for (const auto& [begin, end] : targets_.row(j))
                    for (int i = begin; i <= end; ++i) {
                        char& square = taken[static_cast<std::size_t>(i / side)];
                        if (square == 0 && static_cast<double>(stock_.left(grid.index(i, j))) > much)
                            square = 1, cells.push_back({i, j});
                    }
            MetPoints met;
            for (const auto& [i, j] : cells) {
                Place lowest;
                lowest.tip = std::numeric_limits<double>::infinity();
                const int probes = ball_ ? 1 : kProbes;
                const double off = ball_ ? 0 : beside;
                for (int k = 0; k < probes; ++k) {
                    const double turn = 2 * std::numbers::pi * k / probes,
                                 x = grid.x(i) + off * std::cos(turn), y = grid.y(j) + off * std::sin(turn);
                    if (x < x_low || x > x_high || y < y_low || y > y_high) continue;
                    const Place p = place(to_units(x), to_units(y), met, true);
                    if (p.reachable && p.tip < lowest.tip) lowest = p;
                }
                if (std::isinf(lowest.tip)) continue;
                if (const Place low = lowest.useful ? lowest : slide(lowest); low.useful)
                    found[b].push_back({low.y, {low}});
            }
        });
        std::vector<Line> all;
        for (std::vector<Line>& lines : found)
            for (Line& line : lines) all.push_back(std::move(line));
        keep_what_lowers(all);
        for (Line& line : all) lines_.push_back(std::move(line));
    }

    static double apart(const Place& a, const Place& b) {
        return std::hypot(static_cast<double>(a.x) - b.x, static_cast<double>(a.y) - b.y);
    }

    // What a place no longer lowers after those before it is not visited.
    void keep_what_lowers(std::vector<Line>& lines) {
        for (Line& line : lines) {
            cut_.context.throw_if_cancelled();
            for (Place& p : line.places) {
                if (!p.useful) continue;
                p.useful = false;
                if (!lowers(to_mm(p.x), to_mm(p.y), p.tip)) continue;
                p.cut = true;
                stock_.cut_at(end_, to_mm(p.x), to_mm(p.y), p.tip);
            }
        }
    }

    // Straight up is always free, and so is a level chord of safe length at the height of the higher rest.
    void append(std::vector<PathPoint>& points, PathPoint p) const {
        if (!points.empty()) {
            const PathPoint& q = points.back();
            const double dx = static_cast<double>(p.x) - q.x, dy = static_cast<double>(p.y) - q.y,
                         dz = static_cast<double>(p.z) - q.z;
            const bool corner =
                ball_ ? dx * dx + dy * dy + dz * dz > chord_ * chord_ * kUnitsPerMm * kUnitsPerMm : dz != 0;
            if (corner) {
                const PathPoint c = dz > 0 ? PathPoint{q.x, q.y, p.z} : PathPoint{p.x, p.y, q.z};
                if (!(c == q) && !(c == p)) points.push_back(c);
            }
        }
        points.push_back(p);
    }

    void append_runs(const Line& line, std::vector<std::vector<PathPoint>>& runs) const {
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

    std::vector<PathPoint> points_along(const std::vector<Place>& run) const {
        std::vector<PathPoint> points;
        for (std::size_t i = 0, straight = 0; i < run.size(); ++i) {
            const PathPoint p{run[i].x, run[i].y, run[i].z};
            // A flat end mill goes up a slope as straight as it may, not by steps.
            if (i > 0 && i <= straight) {
                if (i == straight) points.push_back(p);
            } else {
                append(points, p);
            }
            if (i >= straight && !ball_ && !pass_.in_steps) straight = farthest_straight(run, i);
        }
        return points;
    }

    // The farthest place of a run that a flat end mill may go straight to from the place i, which is itself
    // where there is none: it grows by doubling, then is looked for between what is free and what is not.
    std::size_t farthest_straight(const std::vector<Place>& run, std::size_t i) const {
        if (i + 1 >= run.size() || run[i].z == run[i + 1].z) return i;
        const double over = std::min(kOver, kOverShare * cut_.job.tolerances.gouge);
        const auto is_straight = [&](std::size_t j) {
            const Point3 a = middle_of(run[i]), b = middle_of(run[j]);
            const double l = std::hypot(b[0] - a[0], b[1] - a[1]);
            if (std::abs(b[2] - a[2]) > kSteepestWay * l) return false;
            for (std::size_t k = i + 1; k < j; ++k) {
                const Point3 p = middle_of(run[k]);
                const double share = std::hypot(p[0] - a[0], p[1] - a[1]) / l;
                if (length(minus(plus(a, minus(b, a), share), p)) > over) return false;
            }
            return index_->way_is_free(a, b, over);
        };
        std::size_t good = i, bad = run.size();
        for (std::size_t step = 1; i + step < run.size(); step *= 2) {
            if (!is_straight(i + step)) {
                bad = i + step;
                break;
            }
            good = i + step;
        }
        while (good > i && bad - good > 1) {
            const std::size_t between = good + (bad - good) / 2;
            (is_straight(between) ? good : bad) = between;
        }
        return good;
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
        const Slide slide{index_, ball_, chord_, cut_.layer.z_top, kBridge, under_};
        if (!pass_.in_steps) {
            cut_.context.throw_if_cancelled();
            follow_nearest(path, chained(runs, slide));
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
            follow_nearest(path, chained(std::move(parts), slide));
        }
        path.finish();
    }

    std::int32_t spacing_ = 0;
    std::vector<Line> lines_;
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
