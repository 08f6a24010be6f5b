// The exact envelope of a cutter along a straight way or a level arc: over each cell's centre, the lowest z
// that the cutter reaches.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <type_traits>
#include <utility>

#include "kernels/stock/cell_grid.h"
#include "kernels/stock/cutter_end.h"
#include "kernels/stock/sweep_rows.h"

namespace slabwright {

/// What else of a chain of straight motions is swept, so that no cell is asked twice about the place where
/// two of them meet.
struct ChainedSweep {
    const std::array<double, 3>* before =
        nullptr;  ///< where the motion into `from` began, if that has been swept, or will be
    const std::array<double, 3>* after =
        nullptr;        ///< where the motion out of `to` ends, if that is swept too
    bool been = false;  ///< instead of `before`: the cutter has already taken away what it covers at `from`
};

/// A straight motion as sweep_above sees it: its direction in the plane, its length there and its slope.
struct StraightWay {
    double x, y, z;  ///< of the begin; of the lower end, if it runs straight up or down
    double dx = 1, dy = 0, run = 0, slope = 0;
    double ball_lead;  ///< m / √(1 + m²): the share of √(R² − q²) by which the ball's lowest place precedes
                       ///< the foot of a centre

    StraightWay(const std::array<double, 3>& from, const std::array<double, 3>& to)
        : x(from[0]), y(from[1]), z(from[2]) {
        dx = to[0] - x, dy = to[1] - y;
        const double length = std::sqrt(dx * dx + dy * dy);
        if (length > 1e-9) dx /= length, dy /= length, run = length, slope = (to[2] - z) / length;
        else dx = 1, dy = 0, z = std::min(z, to[2]);
        ball_lead = slope / std::sqrt(1 + slope * slope);
    }
    /// Whether a chain may share its ends: a ball on a slope, or a level disc. (All others cover all of their
    /// way by themselves.)
    [[nodiscard]] bool shares_ends(const CutterEnd& end) const {
        return run > 0 &&
               (end.form == CutterEnd::Form::ball || (end.form == CutterEnd::Form::flat && slope == 0));
    }
};

/// ⌈v⌉ and ⌊v⌋ of what an int holds.
inline int ceiling(double v) {
    const int i = static_cast<int>(v);
    return i + static_cast<int>(i < v);
}
inline int floor_of(double v) {
    const int i = static_cast<int>(v);
    return i - static_cast<int>(i > v);
}

/// Calls fn(cell, z) for all of n cells in a row from `first` on over which h is finite, or once
/// fn.row(first, n, h, lowest) where it has that: it then compares with what stands by itself, many cells at
/// once. No h is under `lowest` but by rounding.
template <class Fn>
void take_row(Fn& fn, std::size_t first, int n, const double* h, double lowest) {
    if constexpr (requires { fn.row(first, n, h, lowest); }) fn.row(first, n, h, lowest);
    else
        for (int i = 0; i < n; ++i)
            if (h[i] < kUncovered) fn(first + static_cast<std::size_t>(i), h[i]);
}
/// The same at one height of cells of which at least one stands higher: fn.level(first, n, z), or fn(cell, z)
/// for those that do.
template <class Fn>
void take_level(Fn& fn, std::size_t first, int n, double z, const StandingHeights& standing) {
    if constexpr (requires { fn.level(first, n, z); }) fn.level(first, n, z);
    else
        for (std::size_t c = first; c < first + static_cast<std::size_t>(n); ++c)
            if (standing(c) > z) fn(c, z);
}

/// Whether fn asks for no more cells: fn.enough(), where it has that.
template <class Fn>
[[nodiscard]] bool has_enough(const Fn& fn) {
    if constexpr (requires { fn.enough(); }) return fn.enough();
    else return false;
}

/// The first and the last row whose centres lie within [y_low, y_high]; first > last: none.
inline std::pair<int, int> rows_between(const CellGrid& grid, double y_low, double y_high) {
    const double beyond = grid.ny + 1.0;
    return {std::max(0, ceiling(std::clamp((y_low - grid.y0) / grid.cell, -1.0, beyond))),
            std::min(grid.ny - 1, floor_of(std::clamp((y_high - grid.y0) / grid.cell, -2.0,
                                                      static_cast<double>(grid.ny))))};
}

/// A disc at one height: see sweep_above.
template <class Fn>
void sweep_level_disc(const CellGrid& grid, double radius, const std::array<double, 2>& from,
                      const std::array<double, 2>& to, double z, bool been, const StandingHeights& standing,
                      Fn&& fn) {
    const auto [j0, j1] =
        rows_between(grid, std::min(from[1], to[1]) - radius, std::max(from[1], to[1]) + radius);
    RowSpans spans;
    for (int j = j0; j <= j1; j += RowSpans::kRows) {
        const int rows = std::min(RowSpans::kRows, j1 - j + 1);
        const std::size_t row = grid.index(0, j), nx = static_cast<std::size_t>(grid.nx);
        spans_of_rows(grid, j, rows, from, to, radius, been, spans);
        if constexpr (requires { fn.spans(row, rows, spans, z); }) {
            fn.spans(row, rows, spans, z);
            continue;
        }
        const OverSpans over =
            spans_over(standing.height + row, nx, rows, spans, level_over(standing.bottom, z));
        for (std::uint64_t left = over.left | over.right; left != 0; left &= left - 1) {
            if (has_enough(fn)) return;
            const auto k = static_cast<std::size_t>(std::countr_zero(left));
            const std::size_t at = row + k * nx;
            if ((over.left >> k & 1) != 0)
                take_level(fn, at + static_cast<std::size_t>(spans.low[k]), spans.left[k] - spans.low[k] + 1,
                           z, standing);
            if ((over.right >> k & 1) != 0)
                take_level(fn, at + static_cast<std::size_t>(spans.right[k]),
                           spans.high[k] - spans.right[k] + 1, z, standing);
        }
    }
}

/// A straight way of sweep_above, row by row.
template <class Standing, class Fn>
class StraightSweep {
    static constexpr bool kHeights = std::is_same_v<std::remove_cvref_t<Standing>, StandingHeights>;
    using Form = CutterEnd::Form;

public:
    StraightSweep(const CellGrid& grid, const CutterEnd& end, const StraightWay& way,
                  const std::array<double, 3>& from, const std::array<double, 3>& to,
                  const ChainedSweep& chain, Standing& standing, Fn& fn)
        : grid_(grid),
          end_(end),
          way_(way),
          from_(from),
          standing_(standing),
          fn_(fn),
          R_(end.radius),
          lowest_(std::min(from[2], to[2])),
          shares_(way.shares_ends(end)),
          own_end_(!shares_ || chain.after == nullptr),
          own_begin_(!shares_ || (chain.before == nullptr && !chain.been)),
          before_(own_begin_ || chain.before == nullptr ? from : *chain.before, from) {
        if (end.slope > std::abs(way.slope))
            cone_lead_ = way.slope / std::sqrt(end.slope * end.slope - way.slope * way.slope);
        y_low_ = std::min(from[1], to[1]) - R_, y_high_ = std::max(from[1], to[1]) + R_;
        x_low_ = std::min(from[0], to[0]) - R_, x_high_ = std::max(from[0], to[0]) + R_;
    }

    void run() {
        const int j0 =
            std::max(0, static_cast<int>(std::ceil(std::max(-1.0, (y_low_ - grid_.y0) / grid_.cell))));
        const int j1 = std::min(
            grid_.ny - 1,
            static_cast<int>(std::floor(std::min<double>(grid_.ny, (y_high_ - grid_.y0) / grid_.cell))));
        const bool wedge = !own_begin_ && before_.shares_ends(end_);
        // Most rows hold nothing as high as the way's lowest place; of several at once that is soon known.
        RowSpans spans;
        float level = 0;
        if constexpr (kHeights) level = level_over(standing_.bottom, lowest_);
        for (int j = j0; j <= j1; j += RowSpans::kRows) {
            const int count = std::min(RowSpans::kRows, j1 - j + 1);
            strips_of_rows(grid_, j, count, {from_[0], from_[1]}, strips_, x_low_ - from_[0],
                           x_high_ - from_[0], wedge ? &near_begin_ : nullptr, R_, spans);
            OverSpans over{~std::uint64_t{0}, ~std::uint64_t{0}};
            if constexpr (kHeights)
                over = spans_over(standing_.height + grid_.index(0, j), static_cast<std::size_t>(grid_.nx),
                                  count, spans, level);
            else if (count < RowSpans::kRows) over.left = over.right = (std::uint64_t{1} << count) - 1;
            for (std::uint64_t left = over.left | over.right; left != 0; left &= left - 1) {
                if (has_enough(fn_)) return;
                const auto k = static_cast<std::size_t>(std::countr_zero(left));
                if ((over.left >> k & 1) != 0)
                    along_row(j + static_cast<int>(k), spans.low[k], spans.left[k]);
                if ((over.right >> k & 1) != 0)
                    round_begin(j + static_cast<int>(k), spans.right[k], spans.high[k]);
            }
        }
    }

private:
    [[nodiscard]] int first_cell(double low) const {
        return std::max(0, ceiling(std::clamp((low + from_[0] - grid_.x0) * per_mm_, -1.0, grid_.nx + 1.0)));
    }
    [[nodiscard]] int last_cell(double high) const {
        return std::min(grid_.nx - 1,
                        floor_of(std::clamp((high + from_[0] - grid_.x0) * per_mm_, -1.0, grid_.nx + 1.0)));
    }

    /// One cell of a drill, or of a cutter whose under side is none of the simple ones.
    void one(std::size_t cell, double px, double py) {
        const double stands = standing_(cell);
        if (stands <= lowest_) return;
        const double slope = way_.slope, s0 = px * way_.dx + py * way_.dy,
                     q2 = std::max(0.0, px * px + py * py - s0 * s0), w2 = R_ * R_ - q2;
        if (w2 < 0) return;
        const double w = std::sqrt(w2), s_low = std::max(0.0, s0 - w), s_high = std::min(way_.run, s0 + w);
        if (s_low > s_high) return;
        if (end_.form == Form::other) {
            const double height = way_.z + least_height(end_.under, slope, s0, q2, s_low, s_high);
            if (stands > height) fn_(cell, height);
            return;
        }
        double s = slope >= 0 ? s_low : s_high;
        if (end_.slope > std::abs(slope)) s = std::clamp(s0 - std::sqrt(q2) * cone_lead_, s_low, s_high);
        const double height = end_.slope * std::sqrt(q2 + (s - s0) * (s - s0)) + (way_.z + slope * s);
        if (stands > height) fn_(cell, height);
    }

    /// Cells of a row, whatever the way does there.
    void together(int j, int left, int right) {
        const double py = grid_.y(j) - from_[1];
        const std::size_t row = grid_.index(0, j);
        if (end_.form == Form::cone || end_.form == Form::other) {
            for (int i = left; i <= right; ++i)
                one(row + static_cast<std::size_t>(i), grid_.x(i) - from_[0], py);
            return;
        }
        constexpr int few = 4;  // not worth to be done together
        if (right - left < few) {
            for (int i = left; i <= right; ++i) {
                const std::size_t cell = row + static_cast<std::size_t>(i);
                const double stands = standing_(cell);
                if (stands <= lowest_) continue;
                if (const double height = height_over(row_way_, grid_.x(i) - from_[0], py); stands > height)
                    fn_(cell, height);
            }
            return;
        }
        std::array<double, kSweptTogether> h;
        for (int k = left; k <= right; k += kSweptTogether) {
            const int n = std::min(kSweptTogether, right + 1 - k);
            const std::size_t first = row + static_cast<std::size_t>(k);
            if constexpr (kHeights) {
                if (row_heights(row_way_, k, n, py, standing_.height + first, standing_.bottom, h.data()))
                    take_row(fn_, first, n, h.data(), lowest_);
            } else {
                if (!row_heights(row_way_, k, n, py, nullptr, 0, h.data())) continue;
                for (int i = 0; i < n; ++i)
                    if (const double z_cell = h[static_cast<std::size_t>(i)];
                        z_cell < kUncovered && standing_(first + static_cast<std::size_t>(i)) > z_cell)
                        fn_(first + static_cast<std::size_t>(i), z_cell);
            }
        }
    }

    /// Cells of a row whose least height lies within the way: there it is linear along the way and a circle's
    /// across it, and a level disc's is its own.
    void within(int j, int left, int right) {
        const double py = grid_.y(j) - from_[1], dx = way_.dx, dy = way_.dy;
        const std::size_t row = grid_.index(0, j);
        std::array<double, kSweptTogether> h;
        for (int k = left; k <= right; k += kSweptTogether) {
            const int n = std::min(kSweptTogether, right + 1 - k);
            const std::size_t first = row + static_cast<std::size_t>(k);
            if constexpr (kHeights)
                if (!any_over(standing_.height + first, standing_.bottom, n, lowest_)) continue;
            if (end_.form == Form::flat) {
                std::fill_n(h.begin(), n, lowest_);
            } else {
                const double px = grid_.x(k) - from_[0];
                ball_row(way_.z + R_ + way_.slope * (px * dx + py * dy), way_.slope * dx * grid_.cell, steep_,
                         R_ * R_, py * dx - px * dy, -dy * grid_.cell, n, h.data());
            }
            if constexpr (kHeights) {
                if (keep_lower(standing_.height + first, standing_.bottom, n, h.data()))
                    take_row(fn_, first, n, h.data(), lowest_);
            } else {
                for (int i = 0; i < n; ++i)
                    if (const double z_cell = h[static_cast<std::size_t>(i)];
                        standing_(first + static_cast<std::size_t>(i)) > z_cell)
                        fn_(first + static_cast<std::size_t>(i), z_cell);
            }
        }
    }

    void along_row(int j, int i0, int i1) {
        const double py = grid_.y(j) - from_[1];
        int k0 = i1 + 1, k1 = i1;  // the cells whose least lies within the way for certain
        if (shares_ && way_.run > 4 * grid_.cell) {
            double low = x_low_ - from_[0], high = x_high_ - from_[0];
            strips_.a.narrow(py * way_.dy, low, high);
            strips_.b.narrow(py * way_.dx, low, high);
            along_within_.narrow(py * way_.dy, low, high);
            across_within_.narrow(py * way_.dx, low, high);
            if (low <= high)
                k0 = std::clamp(first_cell(low), i0, i1 + 1), k1 = std::clamp(last_cell(high), k0 - 1, i1);
        }
        together(j, i0, k0 - 1);
        within(j, k0, k1);
        together(j, k1 + 1, i1);
    }

    /// Cells around the begin, where neither motion of a chain has its least within: beyond the end of the
    /// one before and before the begin of this.
    void round_begin(int j, int i0, int i1) {
        constexpr double hair = 1e-9;
        const double py = grid_.y(j) - from_[1], R2 = R_ * R_;
        const std::size_t row = grid_.index(0, j);
        for (int i = i0; i <= i1; ++i) {
            const std::size_t cell = row + static_cast<std::size_t>(i);
            const double px = grid_.x(i) - from_[0], stands = standing_(cell);
            if (stands <= from_[2]) continue;
            const double d2 = px * px + py * py;
            if (d2 > R2) continue;
            auto foot = [&](const StraightWay& of, double of_lead) {
                const double s0 = px * of.dx + py * of.dy;
                return of_lead == 0 ? s0 : s0 - std::sqrt(std::max(0.0, R2 - d2 + s0 * s0)) * of_lead;
            };
            if (foot(way_, lead_) > hair || foot(before_, before_lead_) < -hair) continue;
            const double height = end_.form == Form::ball ? from_[2] + R_ - std::sqrt(R2 - d2) : from_[2];
            if (stands > height) fn_(cell, height);
        }
    }

    static constexpr double kWide = 1e-6;
    const CellGrid& grid_;
    const CutterEnd& end_;
    const StraightWay& way_;
    const std::array<double, 3>& from_;
    Standing& standing_;
    Fn& fn_;
    const double R_, lowest_;
    const bool shares_, own_end_, own_begin_;  // in a chain: is the end's place asked, and is the begin's?
    const StraightWay before_;
    double cone_lead_ = 0, x_low_, x_high_, y_low_, y_high_;
    const double per_mm_ = 1 / grid_.cell, steep_ = std::sqrt(1 + way_.slope * way_.slope);
    // The least place on the way, before it is moved into it, lies within [s0 − R·lead, s0] or the other way
    // round.
    const double lead_ = end_.form == Form::ball ? way_.ball_lead : 0,
                 before_lead_ = end_.form == Form::ball ? before_.ball_lead : 0;
    const double s0_least_ = own_begin_ ? -R_ : std::min(0.0, R_*lead_),
                 s0_most_ = own_end_ ? way_.run + R_ : way_.run + std::max(0.0, R_*lead_);
    const RowWay row_way_{way_.dx,
                          way_.dy,
                          way_.run,
                          way_.slope,
                          way_.z,
                          R_,
                          lead_,
                          own_begin_ ? -kUncovered : 0.0,
                          own_end_ ? kUncovered : way_.run,
                          lowest_,
                          end_.form == Form::ball,
                          grid_.x0,
                          grid_.cell,
                          from_[0]};
    const CrossedStrips strips_{{way_.dx, s0_least_, s0_most_}, {-way_.dy, -R_, R_}, way_.dy, way_.dx};
    const Strip along_within_{way_.dx, std::max(0.0, R_*lead_) + kWide,
                              way_.run + std::min(0.0, R_*lead_) - kWide},
        across_within_{-way_.dy, kWide - R_, R_ - kWide};
    const CrossedStrips near_begin_{{way_.dx, -2 * R_, std::max(0.0, R_* lead_)},
                                    {before_.dx, std::min(0.0, R_* before_lead_), 2 * R_},
                                    way_.dy,
                                    before_.dy};
};

/// Calls fn(cell index, z) for every cell whose centre the cutter covers while its tip goes straight from
/// `from` to `to`, unless standing(cell index) ≤ z: what stands lower than the cutter gets is left out,
/// mostly before anything costly is computed. With s the way along the motion in the plane, s0 the foot of
/// the centre on it, q its distance from it and m the way's slope, the height over the centre at s is z + m·s
/// + end(√(q² + (s − s0)²)): convex in s, so its least value lies where the derivative vanishes, moved into
/// [0, L] and to where the cutter covers the centre at all. The result is exact, not sampled.
///
/// In a chain (all of whose motions are given to this function with their neighbours, and none is left out
/// that a cell needs) a cell whose least value over this motion lies at its end is left to the motion after,
/// and one whose least lies at its begin is asked only if the motion before has its least there too: of both
/// motions one gets as low or lower. All of a chain together call fn with the same least value for every cell
/// as without, but go to most cells once instead of 2R / L times.
///
/// Given StandingHeights many cells are compared at once; fn may then take rows of them instead (take_row,
/// take_level), and of a level disc all spans of many rows, compared or not: fn.spans(cell where the first
/// row begins, rows, spans, z). A level disc in a chain leaves out what it covers at its begin then, and that
/// only. Once fn.enough(), no further row is looked at.
template <class Standing, class Fn>
void sweep_above(const CellGrid& grid, const CutterEnd& end, const std::array<double, 3>& from,
                 const std::array<double, 3>& to, Standing&& standing, Fn&& fn,
                 const ChainedSweep& chain = {}) {
    constexpr bool heights = std::is_same_v<std::remove_cvref_t<Standing>, StandingHeights>;
    const bool flat = end.form == CutterEnd::Form::flat;
    if constexpr (heights)
        if (flat && from[2] == to[2]) {
            const double x = to[0] - from[0], y = to[1] - from[1];
            const bool moves = std::sqrt(x * x + y * y) > 1e-9;
            return sweep_level_disc(grid, end.radius, {from[0], from[1]}, {to[0], to[1]}, from[2],
                                    moves && (chain.before != nullptr || chain.been), standing, fn);
        }
    const StraightWay way(from, to);
    if constexpr (heights)
        if (flat && (way.run == 0 || way.slope == 0))
            return sweep_level_disc(grid, end.radius, {from[0], from[1]}, {to[0], to[1]},
                                    std::min(from[2], to[2]),
                                    way.run > 0 && (chain.before != nullptr || chain.been), standing, fn);
    StraightSweep<std::remove_reference_t<Standing>, std::remove_reference_t<Fn>>(grid, end, way, from, to,
                                                                                  chain, standing, fn)
        .run();
}

/// The same along an arc: at one height the least value lies where the arc is nearest to the centre, at the
/// radius or at an end.
template <class Standing, class Fn>
void sweep_above(const CellGrid& grid, const CutterEnd& end, const LevelArc& arc, Standing&& standing,
                 Fn&& fn) {
    const double R = end.radius, R2 = R * R, r = arc.radius;
    const double half = std::abs(arc.turn) / 2, middle = arc.start + arc.turn / 2;
    const double mx = std::cos(middle), my = std::sin(middle),
                 opening = half >= std::numbers::pi ? -2 : std::cos(half);
    const std::array<double, 2> a{arc.x + r * std::cos(arc.start), arc.y + r * std::sin(arc.start)};
    const std::array<double, 2> b{arc.x + r * std::cos(arc.start + arc.turn),
                                  arc.y + r * std::sin(arc.start + arc.turn)};
    // A direction lies within the arc's angle if its cosine with the middle is not less than the opening's.
    auto within = [&](double px, double py, double d) { return px * mx + py * my >= opening * d; };
    double x_low = std::min(a[0], b[0]), x_high = std::max(a[0], b[0]), y_low = std::min(a[1], b[1]),
           y_high = std::max(a[1], b[1]);
    if (within(1, 0, 1)) x_high = arc.x + r;
    if (within(-1, 0, 1)) x_low = arc.x - r;
    if (within(0, 1, 1)) y_high = arc.y + r;
    if (within(0, -1, 1)) y_low = arc.y - r;
    const int j0 =
        std::max(0, static_cast<int>(std::ceil(std::max(-1.0, (y_low - R - grid.y0) / grid.cell))));
    const int j1 =
        std::min(grid.ny - 1,
                 static_cast<int>(std::floor(std::min<double>(grid.ny, (y_high + R - grid.y0) / grid.cell))));
    const double inner = std::max(0.0, r - R);
    for (int j = j0; j <= j1; ++j) {
        const double y = grid.y(j), py = y - arc.y, out2 = (r + R) * (r + R) - py * py;
        if (out2 < 0) continue;
        const double out = std::sqrt(out2), hole = std::sqrt(std::max(0.0, inner * inner - py * py));
        const double low = std::max(x_low - R, arc.x - out), high = std::min(x_high + R, arc.x + out);
        if (low > high) continue;
        const int i0 = std::max(
            0, static_cast<int>(std::floor(std::clamp((low - grid.x0) / grid.cell, -1.0, grid.nx + 1.0))));
        const int i1 = std::min(
            grid.nx - 1,
            static_cast<int>(std::ceil(std::clamp((high - grid.x0) / grid.cell, -1.0, grid.nx + 1.0))));
        const std::size_t row = grid.index(0, j);
        for (int i = i0; i <= i1; ++i) {
            const double px = grid.x(i) - arc.x;
            if (px > -hole && px < hole) {  // to the hole's far side at once
                i = std::max(i, static_cast<int>(std::min<double>(
                                    i1, std::ceil((arc.x + hole - grid.x0) / grid.cell) - 1)));
                continue;
            }
            const std::size_t cell = row + static_cast<std::size_t>(i);
            const double stands = standing(cell);
            if (stands <= arc.z) continue;
            const double d = std::sqrt(px * px + py * py);
            double distance2 = (d - r) * (d - r);
            if (distance2 > R2) continue;
            if (!within(px, py, d)) {
                const double ax = grid.x(i) - a[0], ay = y - a[1], bx = grid.x(i) - b[0], by = y - b[1];
                distance2 = std::min(ax * ax + ay * ay, bx * bx + by * by);
                if (distance2 > R2) continue;
            }
            double height = arc.z;
            if (end.form == CutterEnd::Form::ball) height += R - std::sqrt(R2 - distance2);
            else if (end.form == CutterEnd::Form::cone) height += end.slope * std::sqrt(distance2);
            else if (end.form == CutterEnd::Form::other) height += end.under.height(std::sqrt(distance2));
            if (stands > height) fn(cell, height);
        }
    }
}

/// Calls fn(cell index, z) for every cell whose centre the cutter covers.
template <class Fn>
void sweep(const CellGrid& grid, const CutterEnd& end, const LevelArc& arc, Fn&& fn) {
    sweep_above(
        grid, end, arc, [](std::size_t) { return std::numeric_limits<double>::infinity(); }, fn);
}
template <class Fn>
void sweep(const CellGrid& grid, const CutterEnd& end, const std::array<double, 3>& from,
           const std::array<double, 3>& to, Fn&& fn) {
    sweep_above(
        grid, end, from, to, [](std::size_t) { return std::numeric_limits<double>::infinity(); }, fn);
}

}  // namespace slabwright
