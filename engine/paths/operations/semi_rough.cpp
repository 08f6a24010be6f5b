#include "engine/paths/operations/semi_rough.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "engine/paths/operations/level_targets.h"
#include "engine/paths/operations/roughing.h"
#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/rings.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/thinned.h"

namespace slabwright {

namespace {

constexpr double kStepShare = 0.45;  // of the diameter, between rings
constexpr double kRingTolerance =
    0.02;                        // mm, of the ring that keeps off the finished surface by its allowance
constexpr double kSample = 0.4;  // mm between places of a ring that are looked at
constexpr int kLevelsAStep = 2;  // of a ball
constexpr int kMostRings = 4000;
constexpr std::size_t kMostPairs =
    4'000'000;  // of cells and edges whose distance is asked for at once: some milliseconds

// Where the rows of a grid run inside a region (winding number over 0): first and last cell of each stretch.
std::vector<std::vector<std::array<int, 2>>> rows_inside(const CellGrid& grid, const Loops& region) {
    std::vector<std::vector<std::pair<double, int>>> crossings(static_cast<std::size_t>(grid.ny));
    for (std::size_t l = 0; l < region.size(); ++l) {
        const auto loop = region.loop(l);
        for (std::size_t k = 0; k < loop.size(); ++k) {
            Point2 a = loop[k], b = loop[(k + 1) % loop.size()];
            const int turn = a.y > b.y ? 1 : -1;  // downwards, the region is to the right
            if (a.y > b.y) std::swap(a, b);
            const double ax = to_mm(a.x), ay = to_mm(a.y), bx = to_mm(b.x), by = to_mm(b.y);
            const int j0 = std::max(0, static_cast<int>(std::ceil((ay - grid.y0) / grid.cell)));
            for (int j = j0; j < grid.ny && grid.y(j) < by; ++j)
                crossings[static_cast<std::size_t>(j)].emplace_back(
                    ax + (bx - ax) * (grid.y(j) - ay) / (by - ay), turn);
        }
    }
    std::vector<std::vector<std::array<int, 2>>> rows(crossings.size());
    for (std::size_t j = 0; j < rows.size(); ++j) {
        std::sort(crossings[j].begin(), crossings[j].end());
        int winding = 0;
        double from = 0;
        for (const auto& [x, turn] : crossings[j]) {
            const int before = winding;
            winding += turn;
            if (before <= 0 && winding > 0) from = x;
            if (before <= 0 || winding > 0) continue;
            const int first = std::max(0, static_cast<int>(std::ceil((from - grid.x0) / grid.cell))),
                      last = std::min(grid.nx - 1, static_cast<int>(std::floor((x - grid.x0) / grid.cell)));
            if (first <= last) rows[j].push_back({first, last});
        }
    }
    return rows;
}

// Millimetres from an outline's edges to the nearest of these cells' middles.
double nearest(const CellGrid& grid, std::span<const std::array<int, 2>> cells, const Loops& outline) {
    double least2 = std::numeric_limits<double>::infinity();
    for (std::size_t l = 0; l < outline.size(); ++l) {
        const auto loop = outline.loop(l);
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const Point2 a = loop[k], b = loop[(k + 1) % loop.size()];
            const double ax = to_mm(a.x), ay = to_mm(a.y), ux = to_mm(b.x) - ax, uy = to_mm(b.y) - ay,
                         length2 = ux * ux + uy * uy;
            const double share = length2 > 0 ? 1 / length2 : 0;
            for (const auto& [i, j] : cells) {
                const double x = grid.x(i) - ax, y = grid.y(j) - ay,
                             t = std::clamp((x * ux + y * uy) * share, 0.0, 1.0);
                const double dx = x - t * ux, dy = y - t * uy;
                least2 = std::min(least2, dx * dx + dy * dy);
            }
        }
    }
    return std::sqrt(least2);
}

// A place of the cutter on a ring; corners of the ring, and places between them that are looked at.
struct RingPlace {
    PathPoint at;
    bool corner = false, useful = false;
};

std::vector<RingPlace> places_of(std::span<const Point2> loop, std::int32_t z) {
    std::vector<RingPlace> places;
    for (std::size_t k = loop.size(); k-- > 0;) {  // backwards: what must stay on the right
        const Point2 a = loop[(k + 1) % loop.size()], b = loop[k];
        const double l = std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y);
        const int parts = std::max(1, static_cast<int>(std::ceil(l / (kSample * kUnitsPerMm))));
        for (int s = 1; s <= parts; ++s) {
            const double t = static_cast<double>(s) / parts;
            places.push_back(
                {{static_cast<std::int32_t>(std::lround(a.x + t * (static_cast<double>(b.x) - a.x))),
                  static_cast<std::int32_t>(std::lround(a.y + t * (static_cast<double>(b.y) - a.y))), z},
                 s == parts,
                 false});
        }
    }
    return places;
}

class SemiRougher {
public:
    SemiRougher(const LayerCut& cut, LayerStock& stock, const Tool& tool, const SemiRoughPass& pass)
        : cut_(cut),
          stock_(stock),
          tool_(tool),
          pass_(pass),
          ball_(tool.kind == ToolKind::ball),
          r_(tool.diameter / 2) {}

    Operation run() {
        Operation op = cut_.operation(OperationKind::semi_rough, pass_.purpose, tool_);
        op.spare = pass_.allowance;
        LevelTargets targets(cut_.context, stock_, pass_.limit, tool_);
        if (targets.none()) return op;
        const MemoryCharge memory(cut_.context, targets.bytes(), "what semi-roughing is to cut");
        LayerStock::Trial rings(stock_);
        const std::vector<Level> levels = levels_of();
        std::vector<double> tips;
        for (const Level& l : levels) tips.push_back(l.tip);
        const auto tip_over = [&](double z) { return z - stock_.z_bottom(); };
        if (pass_.swath > 0)
            targets.leave_walls(cut_.context, cut_.drops(flat_cutter(pass_.swath)), pass_.swath,
                                tip_over(*std::min_element(tips.begin(), tips.end())), cut_.floors);
        // What no level has now none will have.
        std::vector<char> wanted(tips.size());
        parallel_each(cut_.context, tips.size(), [&](std::size_t i) {
            wanted[i] = targets.any(tip_over(tips[i]), tip_over(levels[i].over));
        });
        const bool flask = !cut_.layer.opening.empty();
        const Loops room = flask ? flask_room(cut_, r_ + pass_.allowance) : Loops{};
        const Loops beyond = flask ? beyond_room(cut_, r_ + pass_.allowance, room) : Loops{};
        // A floor is finished with its level, so there a flat end mill goes up to the walls.
        const auto on_floor = [&](double tip) {
            return !ball_ && std::find(cut_.floors.begin(), cut_.floors.end(), tip) != cut_.floors.end();
        };
        std::vector<double> allowances;
        for (const double tip : tips) allowances.push_back(on_floor(tip) ? 0 : pass_.allowance);
        std::vector<std::optional<Contours>> borders(tips.size());
        const Tool& rough = cut_.layer.tools.rough;
        const std::array<std::pair<const DropIndex*, double>, 1> wider{
            std::pair{&cut_.drops(flat_cutter(rough.diameter / 2)), rough.diameter / 2}};
        std::vector<std::vector<LevelRun>> runs;
        for (std::size_t i = 0; i < tips.size(); ++i) {
            cut_.context.throw_if_cancelled();
            if (!wanted[i]) continue;
            targets.mark(tip_over(tips[i]), tip_over(levels[i].over));
            if (targets.cells().empty()) continue;
            const bool floor = on_floor(tips[i]);
            const double allowance = allowances[i];
            const FibreGrid grid = grid_of(allowance);
            if (!borders[i]) borders_from(i, tips, allowances, wanted, grid, borders);
            Loops border = forbidden_region(*borders[i]);
            borders[i].reset();
            if (flask) border = unite(border, beyond);
            const std::size_t first = runs.size();
            cut_rings(targets, border, tips[i], allowance > 0, runs);
            if (runs.size() == first) continue;
            op.stepdown = std::max(op.stepdown, ball_ ? tool_.stepdown_max : levels[i].down);
            op.stepover = step();
            if (floor) append_foot_runs(cut_, tool_, tips[i], grid, wider, runs);
        }
        emit(op, runs);
        rings.undo();
        if (stock_.cut(cut_.context, op, tool_).nothing()) op.moves.clear();
        return op;
    }

private:
    struct Level {
        double tip = 0,
               over = -kUnbounded,  // mm: what lies over a surface that is no higher than `over` is left to
                                    // other levels
            down = 0;               // mm that the tip may go down at once
    };
    // In the order in which they are cut. A flat end mill's terraces are no closer than the stairs that they
    // leave on slopes are a reason to go there. Between two of a ball's lie others, for the waste
    // that does not reach down to the next.
    [[nodiscard]] std::vector<Level> levels_of() const {
        std::vector<Level> levels;
        if (!ball_) {
            for (const RoughStep& step : terraced_steps(cut_, tool_, 0, pass_.limit / 2, {}))
                levels.push_back({.tip = step.level.tip, .down = step.above - step.level.tip});
            return levels;
        }
        // As far below the layer as its rings leave ridges between them, so that none stays there as a film
        // that comes loose.
        const double half_step = kStepShare * r_, ridge = r_ - std::sqrt(r_ * r_ - half_step * half_step);
        const double deepest = std::min(cut_.layer.z_bottom, cut_.layer.floor_below + pass_.allowance),
                     top = cut_.layer.z_top,
                     bottom = std::max(cut_.layer.z_bottom - ridge - kStandsOverLevel, deepest);
        const int steps =
            tool_.stepdown_max > 0
                ? std::max(1, static_cast<int>(std::ceil((top - bottom) / tool_.stepdown_max - 1e-9)))
                : 1;
        auto at = [&](double step) { return top - (top - bottom) * step / steps; };
        for (int k = 0; k < steps; ++k) {
            for (int part = 1; part < kLevelsAStep; ++part)
                levels.push_back({at(k + static_cast<double>(part) / kLevelsAStep), at(k + 1)});
            levels.push_back({at(k + 1)});
        }
        // Walls that go on below the layer are met by its lower half too.
        if (const double under = std::max(cut_.layer.z_bottom - r_ + pass_.limit, deepest);
            under < bottom - kStandsOverLevel)
            levels.push_back({under});
        return levels;
    }

    [[nodiscard]] CutterShape wider_by(double allowance) const {
        return ball_ ? ball_cutter(r_ + allowance) : flat_cutter(r_ + allowance);
    }
    [[nodiscard]] FibreGrid grid_of(double allowance) const {
        const double gouge = cut_.job.tolerances.gouge;
        return fibre_grid(cut_.solid, wider_by(allowance),
                          safe_pitch(r_, allowance > 0 ? std::max(gouge, 0.2 * allowance) : gouge));
    }

    // What the wider cutter must not enter, on this level and those of the same allowance that follow and are
    // wanted: each is found from the one above.
    void borders_from(std::size_t first, std::span<const double> tips, std::span<const double> allowances,
                      std::span<const char> wanted, const FibreGrid& grid,
                      std::vector<std::optional<Contours>>& borders) const {
        const double allowance = allowances[first];
        const CutterShape cutter = wider_by(allowance);
        std::vector<std::size_t> which;
        std::vector<double> at;  // of the wider cutter's tip
        for (std::size_t i = first; i < tips.size(); ++i) {
            if (allowances[i] != allowance || borders[i] || !wanted[i]) continue;
            which.push_back(i);
            at.push_back(ball_ ? tips[i] - allowance : tips[i]);
        }
        const std::vector<Section> inside = cut_.insides(cutter, at);
        std::vector<FibreLevel> levels;
        for (std::size_t k = 0; k < at.size(); ++k) levels.push_back({at[k], &inside[k].loops});
        std::vector<Contours> contours = level_contours(cut_.context, cut_.solid, levels, cutter, grid);
        for (std::size_t k = 0; k < which.size(); ++k) borders[which[k]] = std::move(contours[k]);
    }

    // From the farthest ring whose cutter meets a target inwards; what a ring cuts the next need not.
    void cut_rings(LevelTargets& targets, const Loops& border, double tip, bool keeps_off,
                   std::vector<std::vector<LevelRun>>& runs) {
        const CellGrid& grid = stock_.grid();
        const double step = this->step();
        std::vector<Loops> rings{border};
        const double loose = ring_tolerance(tool_);
        const Loops thin = thinned(border, kRingTolerance);
        const double reach =
            r_ + loose + kSample;  // how far at most from a ring's distance to the border it meets a target
        std::vector<std::array<int, 2>> outside = targets.cells();
        double passed = 0;  // mm from the border: no target that a ring went past lies farther
        for (int k = 1; k < kMostRings; ++k) {
            cut_.context.throw_if_cancelled();
            const auto inside = rows_inside(grid, rings.back());
            const std::size_t gone = std::erase_if(outside, [&](const std::array<int, 2>& c) {
                const auto& row = inside[static_cast<std::size_t>(c[1])];
                return std::any_of(row.begin(), row.end(),
                                   [&](const std::array<int, 2>& s) { return s[0] <= c[0] && c[0] <= s[1]; });
            });
            if (outside.empty()) break;
            if (gone > 0) passed = (k - 1) * step;
            // Rings that lie beyond all targets that were passed and short of all others meet none.
            if (k * step > passed + reach && outside.size() * thin.points.size() < kMostPairs) {
                const double next = nearest(grid, outside, thin);
                for (; k + 1 < kMostRings && k * step + reach < next; ++k) rings.emplace_back();
            }
            rings.push_back(offset_outline(thin, k * step, loose));
        }
        const std::int32_t z = to_units(tip) + 1;
        const CutterEnd end = cutter_end(tool_);
        for (std::size_t k = rings.size(); k-- > 0;) {
            cut_.context.throw_if_cancelled();
            runs.emplace_back();
            const double tolerance = k > 0 || keeps_off ? kRingTolerance * kUnitsPerMm
                                                        : simplify_tolerance_units(cut_.job.tolerances.gouge);
            const double most = k > 0 ? loose * kUnitsPerMm : tolerance;
            for (std::size_t l = 0; l < rings[k].size(); ++l) {
                std::vector<RingPlace> places = places_of(rings[k].loop(l), z);
                for (RingPlace& p : places)
                    p.useful = within_travel(p.at) && targets.met(to_mm(p.at.x), to_mm(p.at.y));
                append_useful(places, tolerance, most, runs.back());
            }
            for (const LevelRun& run : runs.back())
                for (std::size_t p = 1; p < run.points.size(); ++p) {
                    const PathPoint &a = run.points[p - 1], &b = run.points[p];
                    stock_.cut_along(end, {to_mm(a.x), to_mm(a.y), to_mm(z)},
                                     {to_mm(b.x), to_mm(b.y), to_mm(z)}, p > 1);
                }
        }
    }

    [[nodiscard]] bool within_travel(const PathPoint& p) const {
        return to_mm(p.x) >= cut_.low(0, r_ + 2) && to_mm(p.x) <= cut_.high(0, r_ + 2) &&
               to_mm(p.y) >= cut_.low(1, r_ + 2) && to_mm(p.y) <= cut_.high(1, r_ + 2);
    }

    // Useful stretches with a place before and after them; short gaps are travelled along the ring, which is
    // free.
    void append_useful(std::vector<RingPlace>& places, double tolerance, double most,
                       std::vector<LevelRun>& out) const {
        const double turn = fast_turn(cut_.job.machine, feed());
        const std::size_t n = places.size();
        std::vector<std::size_t> useful;
        for (std::size_t k = 0; k < n; ++k)
            if (places[k].useful) useful.push_back(k);
        if (useful.empty()) return;
        auto way = [&](std::size_t from,
                       std::size_t to) {  // 0.1 µm along the ring; the whole ring where they are one
            double sum = 0;
            for (std::size_t k = from;;) {
                const std::size_t next = (k + 1) % n;
                sum += std::hypot(static_cast<double>(places[next].at.x) - places[k].at.x,
                                  static_cast<double>(places[next].at.y) - places[k].at.y);
                if ((k = next) == to) return sum;
            }
        };
        std::vector<std::size_t> ends;  // indices into `useful` after which a gap is too wide
        for (std::size_t u = 0; u < useful.size(); ++u) {
            const std::size_t next = useful[(u + 1) % useful.size()];
            if ((useful[u] + 1) % n == next && useful.size() > 1) continue;
            bool travels = true;
            for (std::size_t k = (useful[u] + 1) % n; k != next && travels; k = (k + 1) % n)
                travels = within_travel(places[k].at);
            if (!travels || way(useful[u], next) > 2 * r_ * kUnitsPerMm) ends.push_back(u);
        }
        auto append = [&](std::size_t from, std::size_t count, bool closed) {
            LevelRun run;
            run.closed = closed;
            for (std::size_t k = 0; k < count; ++k) {
                const RingPlace& p = places[(from + k) % n];
                if (p.corner || k == 0 || k + 1 == count) run.points.push_back(p.at);
            }
            if (closed) run.points.push_back(run.points.front());
            run.points = simplify(run.points, tolerance, most, turn);
            if (run.points.size() > (closed ? 2U : 1U)) out.push_back(std::move(run));
        };
        if (ends.empty()) return append(0, n, true);
        for (std::size_t e = 0; e < ends.size(); ++e) {
            const std::size_t first = useful[(ends[e == 0 ? ends.size() - 1 : e - 1] + 1) % useful.size()],
                              last = useful[ends[e]];
            std::size_t from = (first + n - 1) % n, count = (last + n - first) % n + 3;
            if (!within_travel(places[from].at)) from = first, --count;
            if (!within_travel(places[(last + 1) % n].at)) --count;
            append(from, std::min(count, n), false);
        }
    }

    // mm between rings; floors must not leave ridges between them.
    [[nodiscard]] double step() const {
        return std::min(kStepShare * tool_.diameter, 2 * clearing_radius(tool_));
    }

    // mm/min: the first cut through a place is as wide as the cutter.
    [[nodiscard]] double feed() const {
        if (ball_) return std::min(cut_.job.cutting.finish_feed, cut_.job.machine.max_feed);
        return std::min(tool_.max_feed, cut_.job.machine.max_feed) * cut_.job.cutting.max_engagement;
    }

    void emit(Operation& op, std::vector<std::vector<LevelRun>>& runs) const {
        PathBuilder path(op, tool_, feed(), cut_.layer.z_top + cut_.job.machine.clearance,
                         cut_.layer.z_top + 2);
        const DropIndex& part = cut_.drops(ball_ ? ball_cutter(r_ + pass_.allowance) : flat_cutter(r_));
        path.set_surroundings(cut_.around(tool_, &part));
        cut_levels(path, cut_, tool_, part, runs, false, ball_ ? LevelWays::either : LevelWays::climbing);
        path.finish();
    }

    const LayerCut& cut_;
    LayerStock& stock_;
    const Tool& tool_;
    const SemiRoughPass& pass_;
    bool ball_;
    double r_;
};

}  // namespace

Operation semi_rough_layer(const LayerCut& cut, LayerStock& stock, const Tool& tool,
                           const SemiRoughPass& pass) {
    return SemiRougher(cut, stock, tool, pass).run();
}

}  // namespace slabwright
