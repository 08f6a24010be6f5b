// A raster of drops over what is left, refined where the cutter's rest jumps and something stands that could
// be lowered there; of all places only those are kept that lower the stock, and finer lines are laid over
// what coarser ones leave. So a wide rest is cleared by an even raster, and a corner by the few places along
// it.
#include "engine/paths/operations/rest.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>

#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/operations/roughing.h"
#include "engine/paths/operations/semi_rough.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/rings.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/cutting/drop.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kFinest = 0.04;  // mm between places where the rest jumps: a wall is met within this, or
                                  // within twice the allowance kept off it
constexpr double kJump = 0.05;    // mm by which a flat end mill's tip may step between neighbouring places
constexpr double kSettle = 0.01;  // mm by which a low point of a line lies under its neighbours
constexpr float kRise = 0.5F;     // mm: a wall that is lower than what stands beside it by less is as high
constexpr double kOver = 0.5;     // mm over all that stands for it: how much higher a place lies is not asked
constexpr float kMuch = 0.25F;    // mm left that are worth a search for a place (probe)
constexpr double kProbed = 1.0;   // mm: of squares of this side one cell is
constexpr int kProbes = 32;       // places around it
constexpr double kBridge = 3.0;   // mm between two useful stretches that are travelled along the surface

// The greatest number under a height: what stands over it is as high or higher.
double just_under(double z) { return std::nextafter(z, -std::numeric_limits<double>::infinity()); }

// A place of the cutter on the surface.
struct Place {
    std::int32_t x = 0, y = 0, z = 0;  // 0.1 µm
    double tip = 0;  // mm; of a ball's place that lies over all that stands near, that height: it lies as
                     // high or higher
    std::array<double, 3> contact{};  // mm, where `touches`: a point of the surface
    bool reachable = false, touches = false, useful = false, cut = false;
};

struct Line {
    std::int32_t y = 0;
    std::vector<Place> places;
};

using Spans = std::vector<std::array<std::int32_t, 2>>;  // 0.1 µm, ascending and disjoint

// The cells worth a visit, row by row, and the stretches of a line from which a cutter covers some of them.
class Targets {
public:
    /// @param probe a flat cutter as wide as the limit, or less: where its rest is as high as what stands,
    /// that is as near to a wall beside it
    /// @param reach of the cutter, mm
    Targets(Context& context, const LayerStock& stock, const RestPass& pass, double steep,
            const DropIndex* probe, double reach_mm)
        : stock_(stock), rows_(static_cast<std::size_t>(stock.grid().ny)) {
        const CellGrid& grid = stock.grid();
        // Places around a cell, the nearest first.
        std::vector<std::array<int, 3>> around;
        const int reach = static_cast<int>(pass.swath / grid.cell);
        for (int dj = -reach; dj <= reach; ++dj)
            for (int di = -reach; di <= reach; ++di)
                if (di * di + dj * dj <= reach * reach) around.push_back({di * di + dj * dj, di, dj});
        std::sort(around.begin(), around.end());
        // Whether the nearest of the surface that is as high as what stands here rises steeply.
        auto beside_wall = [&](int i, int j) {
            const std::size_t here = grid.index(i, j);
            for (const auto& [far, di, dj] : around) {
                if (i + di < 0 || i + di >= grid.nx || j + dj < 0 || j + dj >= grid.ny) continue;
                const std::size_t c = grid.index(i + di, j + dj);
                const double rise = static_cast<double>(stock.surface(c)) - stock.surface(here);
                if (stock.surface(c) >= stock.height(here) - kRise && rise > 0)
                    return rise >= std::tan(steep) * std::sqrt(far) * grid.cell;
            }
            return false;
        };
        constexpr std::size_t grain = 16;  // rows
        count_ = parallel_reduce(
            context, rows_.size(), grain, std::size_t{0},
            [&](std::size_t begin, std::size_t end) {
                std::size_t count = 0;
                for (std::size_t r = begin; r < end; ++r)
                    stock.each_left(static_cast<int>(r), pass.limit, [&, j = static_cast<int>(r)](int i) {
                        if (reach > 0 && beside_wall(i, j)) return;
                        const double stands = stock.z_bottom() + stock.height(grid.index(i, j));
                        if (probe && probe->stands_over(grid.x(i), grid.y(j), just_under(stands - 1e-3)))
                            return;
                        ++count;
                        if (!rows_[r].empty() && rows_[r].back()[1] + 1 == i) rows_[r].back()[1] = i;
                        else rows_[r].push_back({i, i});
                    });
                return count;
            },
            std::plus<>());
        find_highest(reach_mm);
    }
    [[nodiscard]] std::size_t count() const { return count_; }
    /// No cell that is marked within the cutter's reach stands higher, mm above the layer's bottom; −infinity
    /// where none is.
    [[nodiscard]] float highest_near(double x, double y) const {
        const CellGrid& grid = stock_.grid();
        const auto tile = [&](double at, double from, int n) {
            return std::clamp(static_cast<int>((at - from) / grid.cell + 0.5), 0, n - 1) / kTile;
        };
        return highest_[static_cast<std::size_t>(tile(y, grid.y0, grid.ny)) * tiles_x_ +
                        static_cast<std::size_t>(tile(x, grid.x0, grid.nx))];
    }
    /// Calls fn(i, j) for marked cells within `reach` mm of a place, all that stand over `above` mm among
    /// them, until one returns true; whether one did.
    template <class Fn>
    [[nodiscard]] bool any_near(double x, double y, double reach, double above, Fn&& fn) const {
        const CellGrid& grid = stock_.grid();
        const int i0 = std::max(0, static_cast<int>(std::ceil((x - reach - grid.x0) / grid.cell))),
                  i1 = std::min(grid.nx - 1, static_cast<int>(std::floor((x + reach - grid.x0) / grid.cell))),
                  j0 = std::max(0, static_cast<int>(std::ceil((y - reach - grid.y0) / grid.cell))),
                  j1 = std::min(grid.ny - 1, static_cast<int>(std::floor((y + reach - grid.y0) / grid.cell)));
        for (int tj = j0 / kTile; tj * kTile <= j1; ++tj)
            for (int ti = i0 / kTile; ti * kTile <= i1; ++ti) {
                const Tile& tile =
                    tiles_[static_cast<std::size_t>(tj) * tiles_x_ + static_cast<std::size_t>(ti)];
                if (tile.highest <= above) continue;
                for (int j = std::max(j0, tj * kTile); j <= std::min(j1, tj * kTile + kTile - 1); ++j) {
                    auto marked = static_cast<std::uint8_t>(tile.marked >> kTile * (j % kTile));
                    if (marked == 0) continue;
                    const double dy = grid.y(j) - y, w = std::sqrt(std::max(0.0, reach * reach - dy * dy));
                    const int first = static_cast<int>(std::ceil((x - w - grid.x0) / grid.cell)),
                              last = static_cast<int>(std::floor((x + w - grid.x0) / grid.cell));
                    for (; marked != 0; marked &= static_cast<std::uint8_t>(marked - 1))
                        if (const int i = ti * kTile + std::countr_zero(marked);
                            i >= first && i <= last && fn(i, j))
                            return true;
                }
            }
        return false;
    }
    [[nodiscard]] std::array<int, 2> rows() const {
        int first = 0, last = stock_.grid().ny - 1;
        while (first <= last && rows_[static_cast<std::size_t>(first)].empty()) ++first;
        while (last >= first && rows_[static_cast<std::size_t>(last)].empty()) --last;
        return {first, last};
    }
    /// The marked cells of a row, first and last of each run.
    [[nodiscard]] std::span<const std::array<int, 2>> row(int j) const {
        return rows_[static_cast<std::size_t>(j)];
    }
    [[nodiscard]] Spans around(double y, double radius, double x_low, double x_high) const {
        const CellGrid& grid = stock_.grid();
        const int j0 = std::max(0, static_cast<int>(std::ceil((y - radius - grid.y0) / grid.cell)));
        const int j1 =
            std::min(grid.ny - 1, static_cast<int>(std::floor((y + radius - grid.y0) / grid.cell)));
        Spans all;
        for (int j = j0; j <= j1; ++j) {
            const double dy = grid.y(j) - y, w = std::sqrt(std::max(0.0, radius * radius - dy * dy));
            for (const auto& run : rows_[static_cast<std::size_t>(j)]) {
                const double low = std::max(grid.x(run[0]) - w, x_low),
                             high = std::min(grid.x(run[1]) + w, x_high);
                if (low < high) all.push_back({to_units(low), to_units(high)});
            }
        }
        std::sort(all.begin(), all.end());
        Spans merged;
        for (const auto& s : all)
            if (!merged.empty() && s[0] <= merged.back()[1])
                merged.back()[1] = std::max(merged.back()[1], s[1]);
            else merged.push_back(s);
        return merged;
    }

private:
    void find_highest(double reach) {
        if (count_ == 0) return;
        const CellGrid& grid = stock_.grid();
        const int nx = (grid.nx + kTile - 1) / kTile, ny = (grid.ny + kTile - 1) / kTile;
        tiles_x_ = static_cast<std::size_t>(nx);
        tiles_.assign(tiles_x_ * static_cast<std::size_t>(ny), {});
        for (std::size_t j = 0; j < rows_.size(); ++j)
            for (const auto& [first, last] : rows_[j])
                for (int i = first; i <= last; ++i) {
                    Tile& tile = tiles_[j / kTile * tiles_x_ + static_cast<std::size_t>(i / kTile)];
                    tile.highest = std::max(tile.highest, stock_.height(grid.index(i, static_cast<int>(j))));
                    tile.marked |= std::uint64_t{1}
                                   << (kTile * (j % kTile) + static_cast<std::size_t>(i % kTile));
                }
        highest_.assign(tiles_.size(), kNone);
        const double far = reach / grid.cell;  // cells
        const int tiles = static_cast<int>(far / kTile) + 1;
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                const float here =
                    tiles_[static_cast<std::size_t>(j) * tiles_x_ + static_cast<std::size_t>(i)].highest;
                if (here == kNone) continue;
                for (int dj = -std::min(tiles, j); dj <= std::min(tiles, ny - 1 - j); ++dj)
                    for (int di = -std::min(tiles, i); di <= std::min(tiles, nx - 1 - i); ++di) {
                        float& there = highest_[static_cast<std::size_t>(j + dj) * tiles_x_ +
                                                static_cast<std::size_t>(i + di)];
                        there = std::max(there, here);
                    }
            }
    }

    static constexpr int kTile = 8;  // cells
    static constexpr float kNone = -std::numeric_limits<float>::infinity();
    // Of the cells that are marked.
    struct Tile {
        std::uint64_t marked = 0;  // a bit each, eight a row
        float highest = kNone;     // when they were marked: cutting only lowers them
    };
    const LayerStock& stock_;
    std::vector<std::vector<std::array<int, 2>>> rows_;
    std::size_t count_ = 0, tiles_x_ = 0;
    std::vector<Tile> tiles_;
    std::vector<float> highest_;  // by tile
};

class Rester {
public:
    Rester(const LayerCut& cut, LayerStock& stock, const Tool& tool, const RestPass& pass)
        : cut_(cut),
          stock_(stock),
          tool_(tool),
          pass_(pass),
          ball_(tool.kind == ToolKind::ball),
          r_(tool.diameter / 2),
          wide_(r_ + pass.allowance),
          under_(ball_ ? pass.allowance : 0),
          end_(cutter_end(tool)),
          targets_(cut.context, stock, pass, finish_slopes(cut.job.cutting).levels_from,
                   (!pass.in_steps || pass.skin > 0)
                       ? &cut.drops({Cutter::Profile::flat,
                                     pass.in_steps ? std::min(pass.limit, r_ / 2) : pass.limit})
                       : nullptr,
                   r_),
          tolerance_(std::max(cut.job.tolerances.gouge, pass.allowance)),
          chord_(safe_chord_mm(wide_, tolerance_)),
          step_(safe_step(wide_, tolerance_)),
          finest_(to_units(std::max(kFinest, 2 * pass.allowance))),
          finest_step_(safe_step(r_, cut.job.tolerances.gouge)) {}

    Operation run() {
        Operation op = cut_.operation(pass_.kind, pass_.purpose, tool_);
        op.spare = pass_.allowance;
        if (targets_.count() == 0) return op;
        find_room();
        index_ = &cut_.drops({ball_ ? Cutter::Profile::ball : Cutter::Profile::flat, wide_});
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
    // What a cell must lose, mm along the normal, for a place to be visited.
    [[nodiscard]] double worth(std::size_t cell) const {
        return pass_.in_steps ? pass_.limit / 2
                              : std::clamp(0.2 * static_cast<double>(stock_.left(cell)), 0.015, 0.05);
    }

    // Whether the cutter, here or up to `slack` mm beside, lowers a cell that is worth it.
    [[nodiscard]] bool lowers(double x, double y, double tip, double slack = 0) const {
        const CellGrid& grid = stock_.grid();
        const double core = r_ - pass_.skin;
        const double above = tip + (ball_ ? pass_.skin : 0) - stock_.z_bottom();
        return targets_.any_near(x, y, core + slack, above, [&](int i, int j) {
            const std::size_t c = grid.index(i, j);
            if (stock_.height(c) <= above) return false;
            double z = above;
            if (ball_) {
                const double dx = grid.x(i) - x, dy = grid.y(j) - y,
                             from_axis = std::max(0.0, std::sqrt(dx * dx + dy * dy) - slack);
                z += core - std::sqrt(std::max(0.0, core * core - from_axis * from_axis));
            } else if (end_.form == CutterEnd::Form::other) {
                const double from_axis = std::max(0.0, std::hypot(grid.x(i) - x, grid.y(j) - y) - slack);
                z += end_.under.height(std::min(r_, from_axis));
            }
            z = std::max(z, static_cast<double>(stock_.surface(c)));
            return (stock_.height(c) - z) * stock_.nz(c) > worth(c);
        });
    }

    // Whether the cutter stands clear of the flask, by the cell that its middle is in.
    [[nodiscard]] bool beside_flask(double x, double y) const {
        if (room_.empty()) return true;
        const CellGrid& grid = stock_.grid();
        const long i = std::lround((x - grid.x0) / grid.cell), j = std::lround((y - grid.y0) / grid.cell);
        return i >= 0 && j >= 0 && i < grid.nx && j < grid.ny &&
               room_[grid.index(static_cast<int>(i), static_cast<int>(j))];
    }

    void find_room() {
        if (cut_.layer.opening.empty()) return;
        const CellGrid& grid = stock_.grid();
        const Loops room =
            flask_room(cut_, r_ + 0.75 * grid.cell);  // a cell's corners are as clear as its middle
        room_.assign(grid.count(), 0);
        const std::vector<std::vector<Span>> inside = line_spans(room, rows_of(grid));
        for (int j = 0; j < grid.ny; ++j)
            for (const Span& s : inside[static_cast<std::size_t>(j)])
                for (int i = 0; i < grid.nx; ++i)
                    if (const double x = grid.x(i) * kUnitsPerMm; x >= s.low && x <= s.high)
                        room_[grid.index(i, j)] = 1;
    }

    // @param high also where a ball lies over all that stands for it
    [[nodiscard]] Place place(std::int32_t ux, std::int32_t uy, MetPoints& met, bool high = false) const {
        const double x = to_mm(ux), y = to_mm(uy);
        // How far a flat end mill would go under the layer's bottom does not matter.
        const double matters = ball_ ? -std::numeric_limits<double>::infinity()
                                     : std::max(cut_.layer.z_bottom, cut_.layer.floor_below);
        Place p;
        p.x = ux;
        p.y = uy;
        // A flat end mill's leaning walls lead down into slots that are hardly wider (settle), from as high
        // as they are.
        p.tip = ball_ && !high ? stock_.z_bottom() +
                                     std::max(0.0, static_cast<double>(targets_.highest_near(x, y))) + kOver
                               : std::numeric_limits<double>::infinity();
        const std::optional<Rest> found = index_->drop_within(x, y, matters, p.tip - under_, &met);
        if (!found) return p;
        const Rest& rest = *found;
        const double on_surface = rest.tip_z + under_;
        const auto stand = [&](double lowest) {
            p.tip = std::max(on_surface, std::max(lowest, cut_.layer.floor_below));
            p.touches = p.tip == on_surface;
            p.contact = {x - wide_ * rest.nx, y - wide_ * rest.ny, p.tip - under_ + wide_ * (1 - rest.nz)};
            p.reachable = !rest.on_cap && p.tip < cut_.layer.z_top - 1e-3 && beside_flask(x, y);
            if (!p.reachable) return;
            p.z = to_units(p.tip) + 1;
            p.useful = lowers(x, y, p.tip);
        };
        // A flat end mill stands on the layer's bottom; a ball may pass it where its shape needs it, over
        // waste only for what it leaves beside its tip there.
        const bool waste = ball_ && on_surface <= cut_.layer.z_bottom - r_;
        stand(ball_ && !waste ? cut_.layer.floor_below : cut_.layer.z_bottom);
        if (waste && p.reachable && !p.useful && !pass_.in_steps &&
            lowers(x, y, std::max(on_surface, cut_.layer.floor_below)))
            stand(cut_.layer.floor_below);
        return p;
    }

    // No higher than a ball's tip anywhere in the rectangle between two places and `beside` (mm) to their
    // sides: where it touched at either of them keeps it up, the less the farther away it is, and nothing of
    // a rectangle is farther away than one of its corners.
    [[nodiscard]] double lowest_between(const Place& a, const Place& b, double beside) const {
        double lowest = std::max(cut_.layer.floor_below, -std::numeric_limits<double>::max());
        const double along_x = a.y < b.y ? beside : 0, along_y = a.y < b.y ? 0 : beside;
        const double x0 = to_mm(std::min(a.x, b.x)) - along_x, x1 = to_mm(std::max(a.x, b.x)) + along_x,
                     y0 = to_mm(std::min(a.y, b.y)) - along_y, y1 = to_mm(std::max(a.y, b.y)) + along_y;
        for (const Place* p : {&a, &b}) {
            if (!p->touches) continue;
            const double dx = std::max(std::abs(x0 - p->contact[0]), std::abs(x1 - p->contact[0])),
                         dy = std::max(std::abs(y0 - p->contact[1]), std::abs(y1 - p->contact[1])),
                         over2 = wide_ * wide_ - dx * dx - dy * dy;
            if (over2 > 0) lowest = std::max(lowest, p->contact[2] + std::sqrt(over2) - wide_ + under_);
        }
        return lowest;
    }

    // Whether places between these two are worth a look, and `beside` (mm) to their sides.
    [[nodiscard]] bool too_far(const Place& a, const Place& b, double beside) const {
        if (!a.reachable && !b.reachable) return false;
        const double apart = to_mm(std::max(std::abs(b.x - a.x), std::abs(b.y - a.y)));
        if (!ball_) {
            if (std::abs(a.tip - b.tip) <= kJump) return false;
            if (a.useful || b.useful) return true;
            // Neither place helps, but one between them may, where the lower of them is stopped by a wall.
            const Place& low = a.tip < b.tip ? a : b;
            return lowers(to_mm(low.x), to_mm(low.y), low.tip, apart);
        }
        if (a.reachable && b.reachable) {
            const double c = std::hypot(a.contact[0] - b.contact[0], a.contact[1] - b.contact[1],
                                        a.contact[2] - b.contact[2]);
            const double d = std::hypot(to_mm(a.x) - to_mm(b.x), to_mm(a.y) - to_mm(b.y), a.tip - b.tip);
            if (c * d <= 8 * wide_ * (pass_.in_steps ? pass_.limit / 2 : cut_.job.tolerances.cusp))
                return false;
        }
        if (a.useful || b.useful) return true;
        return lowers((to_mm(a.x) + to_mm(b.x)) / 2, (to_mm(a.y) + to_mm(b.y)) / 2,
                      lowest_between(a, b, beside), std::hypot(apart / 2, beside));
    }

    // Whether a ball would go over a corner from one place to the next (append) although places between them
    // may do without.
    [[nodiscard]] bool too_steep(const Place& a, const Place& b) const {
        if (!ball_ || !(a.useful || b.useful) || b.x - a.x <= finest_step_ || !a.reachable || !b.reachable)
            return false;
        return std::hypot(to_mm(a.x) - to_mm(b.x), to_mm(a.y) - to_mm(b.y), a.tip - b.tip) > chord_;
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
        spacing_ = std::max(1, to_units(pass_.in_steps ? 0.7 * r_
                                        : ball_        ? std::sqrt(8 * r_ * cut_.job.tolerances.cusp)
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

    [[nodiscard]] Place slide(const Place& from) const {
        std::int32_t x = from.x, y = from.y;
        double tip = from.tip - under_;  // of the cutter that is dropped
        MetPoints met;
        for (std::int32_t stride = to_units(0.1); stride >= to_units(0.0005); stride /= 2)
            for (bool moved = true; moved;) {
                moved = false;
                for (const auto& [dx, dy] :
                     {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}) {
                    const double at_x = to_mm(x + dx * stride), at_y = to_mm(y + dy * stride),
                                 less = tip - 1e-4;
                    if (!(less < tip)) continue;  // under nothing there is no lower
                    const std::optional<double> lower =
                        index_->tip_within(at_x, at_y, just_under(less), &met);
                    if (!lower) continue;
                    x += dx * stride, y += dy * stride, tip = *lower, moved = true;
                    break;
                }
                if (tip + under_ < cut_.layer.floor_below) break;
            }
        return place(x, y, met);
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
        std::vector<PathPoint> points;
        std::size_t last_cut = 0;
        const Place* before = nullptr;
        const Place* last = nullptr;  // that cuts
        auto close = [&] {
            points.resize(last_cut);
            if (!points.empty())
                runs.push_back(pass_.in_steps ? points
                                              : simplify(points, simplify_tolerance_units(tolerance_)));
            points.clear();
            last_cut = 0;
        };
        for (const Place& p : line.places) {
            const bool gap = before && apart(p, *before) > chord_ * kUnitsPerMm;
            if (!points.empty() && (gap || !p.reachable || (!p.cut && apart(p, *last) > to_units(kBridge))))
                close();
            if (p.reachable && (p.cut || !points.empty())) {
                // One place beside the first: the cutter comes in along the surface instead of straight down.
                if (points.empty() && before && !gap && before->reachable)
                    append(points, {before->x, before->y, before->z});
                append(points, {p.x, p.y, p.z});
                if (p.cut) last_cut = points.size(), last = &p;
            }
            before = &p;
        }
        close();
    }

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

    const LayerCut& cut_;
    LayerStock& stock_;
    const Tool& tool_;
    const RestPass& pass_;
    bool ball_;
    double r_;
    double wide_,
        under_;  // mm: the radius of the cutter that is dropped, and how far its tip then lies under this
                 // one's
    CutterEnd end_;
    Targets targets_;
    double tolerance_;  // mm of which chords and thinning take their shares: the gouge tolerance, or the
                        // allowance
    double chord_;
    std::int32_t step_, finest_, finest_step_;
    std::int32_t spacing_ = 0;
    const DropIndex* index_ = nullptr;
    std::vector<Line> lines_;
    std::vector<char> room_;  // by the stock's cells, with a flask only
};

}  // namespace

double semi_rough_allowance(const Job& job, const Tool& tool, double limit) {
    const double allowance = std::min({std::min(job.cutting.wall_allowance, job.cutting.floor_allowance) / 3,
                                       tool.diameter / 10, limit / 5});
    return allowance < 2 * job.tolerances.gouge ? 0 : allowance;
}

Operation cut_rest(const LayerCut& cut, LayerStock& stock, const Tool& tool, const RestPass& pass) {
    if (!(pass.allowance > 0)) return Rester(cut, stock, tool, pass).run();
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
    add(Rester(cut, stock, tool, pass).run());
    // What only the cutter itself enters: slots hardly wider, the depth of narrow valleys. The wall of what
    // was kept is no reason to go there.
    RestPass narrow = pass;
    narrow.allowance = 0;
    narrow.skin = 2 * pass.allowance;
    add(Rester(cut, stock, tool, narrow).run());
    return all;
}

}  // namespace slabwright
