// What a sweep does with many cells of a row at once. Internal to sweep.h and to the stocks that take rows of
// it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "kernels/cutting/tool_shape.h"
#include "kernels/geometry/vectors.h"
#include "kernels/stock/cell_grid.h"

namespace slabwright {

/// Heights of a ball's tip side over n centres in a row: h[k] = a + b·k − c·√(r² − (q + k·dq)²), mm. @pre (q
/// + k·dq)² ≤ r²
void ball_row(double a, double b, double c, double r2, double q, double dq, int n, double* h);

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

}  // namespace slabwright
