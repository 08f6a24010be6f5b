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

#include "kernels/cutting/tool_shape.h"
#include "kernels/geometry/cutter_shape.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

/// Cells of one size; cell (i, j) stands for the point at its centre, (x0 + i·cell, y0 + j·cell), mm.
struct CellGrid {
    double x0 = 0, y0 = 0, cell = 1;
    int nx = 0, ny = 0;

    [[nodiscard]] double x(int i) const { return x0 + i * cell; }
    [[nodiscard]] double y(int j) const { return y0 + j * cell; }
    [[nodiscard]] std::size_t count() const {
        return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
    }
    [[nodiscard]] std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
    }
};

/// The lower end of a cutter: height over its tip at radius r is 0 (flat and face), R − √(R² − r²) (ball),
/// r·slope (drill) or the under side's (bull-nose, tapered ball).
struct CutterEnd {
    enum class Form : std::uint8_t { flat, ball, cone, other } form = Form::flat;
    double radius = 0;  ///< mm
    double slope = 0;   ///< of the cone
    Envelope under{};   ///< of what is none of these
};

/// @throws Error(usage, "tool.shape") for measures that make no cutter
[[nodiscard]] CutterEnd cutter_end(const CutterShape& shape);

/// A part of a circle at one height that the tip runs along, mm and radians: from the angle `start` (from +x,
/// counter-clockwise) on over `turn`, negative for clockwise, a whole circle at most.
struct LevelArc {
    double x = 0, y = 0, z = 0, radius = 0;
    double start = 0, turn = 0;

    [[nodiscard]] double length() const { return radius * std::abs(turn); }
};

/// Heights of a ball's tip side over n centres in a row: h[k] = a + b·k − c·√(r² − (q + k·dq)²), mm. @pre (q
/// + k·dq)² ≤ r²
void ball_row(double a, double b, double c, double r2, double q, double dq, int n, double* h);

/// What stands in cells: heights over a level `bottom`, mm. Given as such to sweep_above, many cells are
/// compared at once.
struct StandingHeights {
    const float* height = nullptr;
    double bottom = 0;
    double operator()(std::size_t cell) const { return bottom + height[cell]; }
};

inline constexpr double kUncovered = std::numeric_limits<double>::infinity();

/// A straight way of a ball or a level disc over cells of a row: see sweep_above. Lengths mm, relative to the
/// way's begin.
struct RowWay {
    double dx = 1, dy = 0, run = 0, slope = 0, z = 0, radius = 0, lead = 0;
    double s_least = 0, s_most = 0;  ///< where on the way the least height must lie for a cell to be asked
    double lowest = 0;               ///< of the way's tips
    bool ball = true;
    double x0 = 0, cell = 1, from_x = 0;  ///< cell i has its centre at x0 + i·cell − from_x
};
/// Height of the cutter over a centre at (px, py) from the begin; infinite where it does not cover it, or the
/// cell is not asked. One for each kind of way, without branches, so that a loop over them can be done
/// several at a time.
inline double level_ball_height(const RowWay& way, double px, double py) {
    const double s0 = px * way.dx + py * way.dy, d2 = px * px + py * py - s0 * s0,
                 w2 = way.radius * way.radius - (d2 > 0 ? d2 : 0.0);
    const double s_up = s0 > 0 ? s0 : 0.0, over = s0 - (s_up < way.run ? s_up : way.run),
                 h2 = w2 - over * over;
    const double height = way.z + way.radius - std::sqrt(h2 > 0 ? h2 : 0.0);
    const bool asked = (h2 >= 0) & (s0 <= way.s_most) & (s0 >= way.s_least);
    return asked ? height : kUncovered;
}
inline double sloped_ball_height(const RowWay& way, double px, double py) {
    const double s0 = px * way.dx + py * way.dy, d2 = px * px + py * py - s0 * s0,
                 w2 = way.radius * way.radius - (d2 > 0 ? d2 : 0.0);
    const double w = std::sqrt(w2 > 0 ? w2 : 0.0), low = s0 - w > 0 ? s0 - w : 0.0,
                 high = s0 + w < way.run ? s0 + w : way.run;
    const double at = s0 - w * way.lead, s_up = at < low ? low : at, s = high < s_up ? high : s_up,
                 h2 = w2 - (s - s0) * (s - s0);
    const double height = (way.radius - std::sqrt(h2 > 0 ? h2 : 0.0)) + (way.z + way.slope * s);
    const bool asked = (w2 >= 0) & (low <= high) & (at <= way.s_most) & (at >= way.s_least);
    return asked ? height : kUncovered;
}
inline double flat_height(const RowWay& way, double px, double py) {
    const double s0 = px * way.dx + py * way.dy, d2 = px * px + py * py - s0 * s0,
                 w2 = way.radius * way.radius - (d2 > 0 ? d2 : 0.0);
    const double w = std::sqrt(w2 > 0 ? w2 : 0.0), low = s0 - w > 0 ? s0 - w : 0.0,
                 high = s0 + w < way.run ? s0 + w : way.run;
    const double height = way.z + way.slope * (way.slope >= 0 ? low : high);
    const bool asked = (w2 >= 0) & (low <= high) & (s0 <= way.s_most) & (s0 >= way.s_least);
    return asked ? height : kUncovered;
}
inline double height_over(const RowWay& way, double px, double py) {
    if (!way.ball) return flat_height(way, px, py);
    return way.slope == 0 ? level_ball_height(way, px, py) : sloped_ball_height(way, px, py);
}

/// Heights of the cutter over cells i0 … i0 + n − 1, whose centres lie py beside the begin; infinite where it
/// does not cover the centre, the cell is not asked, or `stands` (unless null) over `bottom` is not higher. h
/// has room for whole eights of cells. @returns whether any is finite
bool row_heights(const RowWay& way, int i0, int n, double py, const float* stands, double bottom, double* h);

/// Lowers n heights to max(0, z), or to max(0, h − bottom), where they are over it.
void lower_to(float* height, int n, double z);
void lower_to(float* height, int n, const double* h, double bottom = 0);

/// The highest of heights in `rows` rows, n of each, that begin nx apart; 0 at least.
[[nodiscard]] float highest_of(const float* height, std::size_t nx, int n, int rows);
/// What heights lost, each times its share (of 255) of a height that is a distance: at most and in all; how
/// many lost more than `least` of height.
struct Lost {
    float most = 0;
    double sum = 0;
    std::size_t cells = 0;
};
void add_lost(const float* before, const float* now, const std::uint8_t* share, int n, float least,
              Lost& lost);

/// A straight way in equal parts: dx, dy its direction, `per_mm` parts a mm.
struct PartedWay {
    double dx = 1, dy = 0, radius = 0, per_mm = 0;
    int count = 1;
};
/// Of n cells in a row, whose centres lie from (px, py) on `cell` apart as seen from the way's begin: on
/// which part the edge of a disc comes to each, or the first where it is there already; and how far each lies
/// left of the way, mm. Both have room for whole eights of cells.
void edge_parts(const PartedWay& way, double px, double cell, double py, int n, std::int32_t* part,
                double* across);

/// Whether any of n heights over `bottom` is over a level.
[[nodiscard]] bool any_over(const float* stands, double bottom, int n, double level);
/// Makes those of n heights infinite over which nothing stands. h has room for whole eights. @returns whether
/// any is left
bool keep_lower(const float* stands, double bottom, int n, double* h);

/// Which of n ≤ 64 heights stand at least `least` over h, or over max(floor, h): a bit for each, the first
/// one's lowest. There h has room for whole eights.
[[nodiscard]] std::uint64_t cells_over(const float* stands, int n, double h, double least);
[[nodiscard]] std::uint64_t cells_over(const float* stands, int n, const double* h, double floor,
                                       double least);

/// Of which of n ≤ 64 cells more than `most` is left: of what stands over a surface, mm, the share nz / 255.
/// A bit for each, the first one's lowest.
/// @pre most ≥ 0
[[nodiscard]] std::uint64_t cells_left(const float* stands, const float* surface, const std::uint8_t* nz,
                                       int n, float most);
/// The most that is left of any of n cells, as cells_left() compares it; 0 at least.
[[nodiscard]] float most_left(const float* stands, const float* surface, const std::uint8_t* nz, int n);

/// The least height of an under side over a centre, mm, as its axis goes along a way of a slope: `foot` is
/// the centre's place on the way and `aside2` the square of its distance from it; heights are over the tip at
/// place 0. @param low, high of the places at which the cutter covers the centre
[[nodiscard]] double least_height(const Envelope& under, double slope, double foot, double aside2, double low,
                                  double high);

/// The cells of some rows that a level disc comes over on its way, but for those that it has been over where
/// it starts: [low, left] and [right, high] along each row; low > left, right > high: none.
struct RowSpans {
    static constexpr int kRows = 64;  ///< that are looked at together
    alignas(64) std::array<std::int32_t, kRows> low, left, right, high;
};
/// @param rows at most RowSpans::kRows, from first_row on  @param been whether the disc has been where it
/// starts; else nothing is left out
void spans_of_rows(const CellGrid& grid, int first_row, int rows, const std::array<double, 2>& from,
                   const std::array<double, 2>& to, double radius, bool been, RowSpans& spans);

/// The greatest float h with bottom + h ≤ level: heights over `bottom` are over the level if they are over
/// it.
[[nodiscard]] float level_over(double bottom, double level);
/// Of which rows the left and the right span hold a height over a level: a bit for each row, the first row's
/// lowest.
struct OverSpans {
    std::uint64_t left = 0, right = 0;
};
/// @param height of the first row's first cell; rows lie nx apart
[[nodiscard]] OverSpans spans_over(const float* height, std::size_t nx, int rows, const RowSpans& spans,
                                   float level);
/// The highest of the heights in all spans; −infinity where they hold none.
[[nodiscard]] float highest_in(const float* height, std::size_t nx, int rows, const RowSpans& spans);
/// Lowers the heights in all spans to a level, or to max(0, z), where they are over it.
void lower_spans(float* height, std::size_t nx, int rows, const RowSpans& spans, float level);
void lower_spans(float* height, std::size_t nx, int rows, const RowSpans& spans, double z);

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

inline constexpr int kSweptTogether = 64;  ///< cells of a row

/// The places of a line at which a value that grows by `step` a mm lies within [least, most], a hair more.
struct Strip {
    static constexpr double kHair = 1e-7;
    double inverse, least, most;  ///< inverse 0: the value is the same everywhere

    Strip(double step, double least_value, double most_value)
        : inverse(std::abs(step) < 1e-9 ? 0 : 1 / step),
          least(least_value <= most_value ? least_value - kHair : kUncovered),
          most(most_value + kHair) {}
    /// Whether the line is within everywhere or nowhere.
    [[nodiscard]] bool everywhere_or_nowhere() const { return inverse == 0 || least > most; }
    /// Narrows [low, high] to them, on a line whose value is `value` at 0; to nothing where there are none.
    void narrow(double value, double& low, double& high) const {
        if (everywhere_or_nowhere()) {
            if (!(value >= least && value <= most)) high = -kUnbounded;
            return;
        }
        const double a = (least - value) * inverse, b = (most - value) * inverse;
        low = std::max(low, std::min(a, b)), high = std::min(high, std::max(a, b));
    }
};

/// What lies in two strips at once, on lines along x beside a point: the strips' values at the point's x grow
/// by a_rise and b_rise a mm of y.
struct CrossedStrips {
    Strip a, b;
    double a_rise = 0, b_rise = 0;
};
/// The cells of some rows in crossed strips about `from`: between low and high, mm from there, as spans.low
/// and spans.left; within a radius of it as spans.right and spans.high, or none there for a null.
/// @param rows at most RowSpans::kRows, from first_row on
void strips_of_rows(const CellGrid& grid, int first_row, int rows, const std::array<double, 2>& from,
                    const CrossedStrips& strips, double low, double high, const CrossedStrips* near,
                    double radius, RowSpans& spans);

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
/// only.
template <class Standing, class Fn>
void sweep_above(const CellGrid& grid, const CutterEnd& end, const std::array<double, 3>& from,
                 const std::array<double, 3>& to, Standing&& standing, Fn&& fn,
                 const ChainedSweep& chain = {}) {
    using Form = CutterEnd::Form;
    constexpr double hair = 1e-9;
    const double R = end.radius, R2 = R * R;
    if constexpr (std::is_same_v<std::remove_cvref_t<Standing>, StandingHeights>)
        if (end.form == Form::flat && from[2] == to[2]) {
            const double x = to[0] - from[0], y = to[1] - from[1];
            const bool moves = std::sqrt(x * x + y * y) > 1e-9;
            return sweep_level_disc(grid, R, {from[0], from[1]}, {to[0], to[1]}, from[2],
                                    moves && (chain.before != nullptr || chain.been), standing, fn);
        }
    const StraightWay way(from, to);
    const double dx = way.dx, dy = way.dy, run = way.run, slope = way.slope, z = way.z,
                 lowest = std::min(from[2], to[2]);
    const bool shares = way.shares_ends(end);
    if constexpr (std::is_same_v<std::remove_cvref_t<Standing>, StandingHeights>)
        if (end.form == Form::flat && (run == 0 || slope == 0))
            return sweep_level_disc(grid, R, {from[0], from[1]}, {to[0], to[1]}, lowest,
                                    run > 0 && (chain.before != nullptr || chain.been), standing, fn);
    const double cone_lead =
        end.slope > std::abs(slope) ? slope / std::sqrt(end.slope * end.slope - slope * slope) : 0;
    // In a chain: is the begin's place asked, and is the end's?
    const bool own_end = !shares || chain.after == nullptr,
               own_begin = !shares || (chain.before == nullptr && !chain.been);
    const StraightWay before(own_begin || chain.before == nullptr ? from : *chain.before, from);
    const bool wedge = !own_begin && before.shares_ends(end);
    // Within the way a ball's least height is linear along it and a circle's across it, and a level disc's is
    // its own: many cells of a row are done at once.
    constexpr double wide = 1e-6;
    const bool rows = shares && run > 4 * grid.cell;
    const double steep = std::sqrt(1 + slope * slope);
    // The least place on the way, before it is moved into it, lies within [s0 − R·lead, s0] or the other way
    // round.
    const double lead = end.form == Form::ball ? way.ball_lead : 0;
    const double s0_least = own_begin ? -R : std::min(0.0, R * lead),
                 s0_most = own_end ? run + R : run + std::max(0.0, R * lead);
    const RowWay row_way{dx,
                         dy,
                         run,
                         slope,
                         z,
                         R,
                         lead,
                         own_begin ? -kUncovered : 0.0,
                         own_end ? kUncovered : run,
                         lowest,
                         end.form == Form::ball,
                         grid.x0,
                         grid.cell,
                         from[0]};
    const double y_low = std::min(from[1], to[1]) - R, y_high = std::max(from[1], to[1]) + R;
    const int j0 = std::max(0, static_cast<int>(std::ceil(std::max(-1.0, (y_low - grid.y0) / grid.cell))));
    const int j1 = std::min(
        grid.ny - 1, static_cast<int>(std::floor(std::min<double>(grid.ny, (y_high - grid.y0) / grid.cell))));
    const double x_low = std::min(from[0], to[0]) - R, x_high = std::max(from[0], to[0]) + R;
    const double per_mm = 1 / grid.cell, beyond = grid.nx + 1.0;
    auto first_cell = [&](double low) {
        return std::max(0, ceiling(std::clamp((low + from[0] - grid.x0) * per_mm, -1.0, beyond)));
    };
    auto last_cell = [&](double high) {
        return std::min(grid.nx - 1, floor_of(std::clamp((high + from[0] - grid.x0) * per_mm, -1.0, beyond)));
    };
    const CrossedStrips strips{{dx, s0_least, s0_most}, {-dy, -R, R}, dy, dx};
    const Strip along_within(dx, std::max(0.0, R * lead) + wide, run + std::min(0.0, R * lead) - wide),
        across_within(-dy, wide - R, R - wide);
    // Around the begin, where neither motion has its least within: beyond the end of the one before and
    // before the begin of this.
    const double before_lead = end.form == Form::ball ? before.ball_lead : 0;
    const CrossedStrips near_begin{{dx, -2 * R, std::max(0.0, R * lead)},
                                   {before.dx, std::min(0.0, R * before_lead), 2 * R},
                                   dy,
                                   before.dy};
    const auto cells = [&](std::size_t row, int i0, int i1, auto&& each) {
        for (int i = i0; i <= i1; ++i) each(row + static_cast<std::size_t>(i), grid.x(i) - from[0]);
    };
    const auto along_row = [&](int j, int i0, int i1) {
        const double py = grid.y(j) - from[1];
        const std::size_t row = grid.index(0, j);
        auto one = [&](std::size_t cell, double px) {
            const double stands = standing(cell);
            if (stands <= lowest) return;
            const double s0 = px * dx + py * dy, q2 = std::max(0.0, px * px + py * py - s0 * s0),
                         w2 = R2 - q2;
            if (w2 < 0) return;
            const double w = std::sqrt(w2), s_low = std::max(0.0, s0 - w), s_high = std::min(run, s0 + w);
            if (s_low > s_high) return;
            if (end.form == Form::other) {
                const double height = z + least_height(end.under, slope, s0, q2, s_low, s_high);
                if (stands > height) fn(cell, height);
                return;
            }
            double s = slope >= 0 ? s_low : s_high;
            if (end.slope > std::abs(slope)) s = std::clamp(s0 - std::sqrt(q2) * cone_lead, s_low, s_high);
            const double height = end.slope * std::sqrt(q2 + (s - s0) * (s - s0)) + (z + slope * s);
            if (stands > height) fn(cell, height);
        };
        auto together = [&](int left, int right) {
            if (end.form == Form::cone || end.form == Form::other) {
                cells(row, left, right, one);
                return;
            }
            constexpr int few = 4;  // not worth to be done together
            if (right - left < few) {
                cells(row, left, right, [&](std::size_t cell, double px) {
                    const double stands = standing(cell);
                    if (stands <= lowest) return;
                    if (const double height = height_over(row_way, px, py); stands > height) fn(cell, height);
                });
                return;
            }
            std::array<double, kSweptTogether> h;
            for (int k = left; k <= right; k += kSweptTogether) {
                const int n = std::min(kSweptTogether, right + 1 - k);
                const std::size_t first = row + static_cast<std::size_t>(k);
                if constexpr (std::is_same_v<std::remove_cvref_t<Standing>, StandingHeights>) {
                    if (row_heights(row_way, k, n, py, standing.height + first, standing.bottom, h.data()))
                        take_row(fn, first, n, h.data(), lowest);
                } else {
                    if (!row_heights(row_way, k, n, py, nullptr, 0, h.data())) continue;
                    for (int i = 0; i < n; ++i)
                        if (const double z_cell = h[static_cast<std::size_t>(i)];
                            z_cell < kUncovered && standing(first + static_cast<std::size_t>(i)) > z_cell)
                            fn(first + static_cast<std::size_t>(i), z_cell);
                }
            }
        };
        int k0 = i1 + 1, k1 = i1;  // the cells whose least lies within the way for certain
        if (rows) {
            double low = x_low - from[0], high = x_high - from[0];
            strips.a.narrow(py * dy, low, high);
            strips.b.narrow(py * dx, low, high);
            along_within.narrow(py * dy, low, high);
            across_within.narrow(py * dx, low, high);
            if (low <= high)
                k0 = std::clamp(first_cell(low), i0, i1 + 1), k1 = std::clamp(last_cell(high), k0 - 1, i1);
        }
        together(i0, k0 - 1);
        for (int k = k0; k <= k1; k += kSweptTogether) {
            const int n = std::min(kSweptTogether, k1 + 1 - k);
            const std::size_t first = row + static_cast<std::size_t>(k);
            std::array<double, kSweptTogether> h;
            const auto rest_of_row = [&] {
                if (end.form == Form::flat) {
                    std::fill_n(h.begin(), n, lowest);
                    return;
                }
                const double px = grid.x(k) - from[0];
                ball_row(z + R + slope * (px * dx + py * dy), slope * dx * grid.cell, steep, R2,
                         py * dx - px * dy, -dy * grid.cell, n, h.data());
            };
            if constexpr (std::is_same_v<std::remove_cvref_t<Standing>, StandingHeights>) {
                if (!any_over(standing.height + first, standing.bottom, n, lowest)) continue;
                rest_of_row();
                if (keep_lower(standing.height + first, standing.bottom, n, h.data()))
                    take_row(fn, first, n, h.data(), lowest);
            } else {
                rest_of_row();
                for (int i = 0; i < n; ++i)
                    if (const double z_cell = h[static_cast<std::size_t>(i)];
                        standing(first + static_cast<std::size_t>(i)) > z_cell)
                        fn(first + static_cast<std::size_t>(i), z_cell);
            }
        }
        together(k1 + 1, i1);
    };
    const auto round_begin = [&](int j, int i0, int i1) {
        const double py = grid.y(j) - from[1];
        cells(grid.index(0, j), i0, i1, [&](std::size_t cell, double px) {
            const double stands = standing(cell);
            if (stands <= from[2]) return;
            const double d2 = px * px + py * py;
            if (d2 > R2) return;
            auto foot = [&](const StraightWay& of, double of_lead) {
                const double s0 = px * of.dx + py * of.dy;
                return of_lead == 0 ? s0 : s0 - std::sqrt(std::max(0.0, R2 - d2 + s0 * s0)) * of_lead;
            };
            if (foot(way, lead) > hair || foot(before, before_lead) < -hair) return;
            const double height = end.form == Form::ball ? from[2] + R - std::sqrt(R2 - d2) : from[2];
            if (stands > height) fn(cell, height);
        });
    };
    // Most rows hold nothing as high as the way's lowest place; of several at once that is soon known.
    RowSpans spans;
    float level = 0;
    if constexpr (std::is_same_v<std::remove_cvref_t<Standing>, StandingHeights>)
        level = level_over(standing.bottom, lowest);
    for (int j = j0; j <= j1; j += RowSpans::kRows) {
        const int count = std::min(RowSpans::kRows, j1 - j + 1);
        strips_of_rows(grid, j, count, {from[0], from[1]}, strips, x_low - from[0], x_high - from[0],
                       wedge ? &near_begin : nullptr, R, spans);
        OverSpans over{~std::uint64_t{0}, ~std::uint64_t{0}};
        if constexpr (std::is_same_v<std::remove_cvref_t<Standing>, StandingHeights>)
            over = spans_over(standing.height + grid.index(0, j), static_cast<std::size_t>(grid.nx), count,
                              spans, level);
        else if (count < RowSpans::kRows) over.left = over.right = (std::uint64_t{1} << count) - 1;
        for (std::uint64_t left = over.left | over.right; left != 0; left &= left - 1) {
            const auto k = static_cast<std::size_t>(std::countr_zero(left));
            if ((over.left >> k & 1) != 0) along_row(j + static_cast<int>(k), spans.low[k], spans.left[k]);
            if ((over.right >> k & 1) != 0)
                round_begin(j + static_cast<int>(k), spans.right[k], spans.high[k]);
        }
    }
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
