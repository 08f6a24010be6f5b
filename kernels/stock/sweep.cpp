#include "kernels/stock/sweep.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "kernels/geometry/vectors.h"
#include "kernels/geometry/wide.h"

namespace slabwright {

CutterEnd cutter_end(const CutterShape& shape) {
    const Envelope under = under_side(shape);
    if (shape.is_flat()) return {CutterEnd::Form::flat, shape.radius, 0};
    if (shape.is_ball()) return {CutterEnd::Form::ball, shape.radius, 0};
    if (shape.form() == CutterForm::cone)
        return {CutterEnd::Form::cone, shape.radius, std::tan(std::numbers::pi / 2 - shape.taper_rad)};
    return {CutterEnd::Form::other, shape.radius, 0, under};
}

double least_height(const Envelope& under, double slope, double foot, double aside2, double low,
                    double high) {
    const auto distance = [&](double s) {
        return std::min(under.radius, std::sqrt(aside2 + (s - foot) * (s - foot)));
    };
    const auto height = [&](double s) { return slope * s + under.height(distance(s)); };
    if (slope == 0) return height(std::clamp(foot, low, high));
    constexpr double bracket = 1e-9;  // mm: of the height
    double least = std::min(height(low), height(high));
    // Convex along the way, so that a tangent is under it.
    for (int i = 0; i < 80; ++i) {
        const double s = (low + high) / 2, d = distance(s), off = s - foot;
        const double h = height(s), rise = d > 0 && off != 0 ? slope + under.slope(d) * off / d : slope;
        least = std::min(least, h);
        const double room = std::abs(rise) * (high - low) / 2;
        if (rise == 0 || room < bracket) break;
        (rise > 0 ? high : low) = s;
    }
    return least;
}

namespace {

constexpr int kLanes = 8;

// (Vectors are handed on by reference: how one is passed by value depends on the instruction set.)
template <class T, class Vector>
[[gnu::always_inline]] inline void load(const T* from, Vector& v) {
    std::memcpy(&v, from, sizeof v);
}

// Calls eight(first, stands) for n cells, eight at a time; past the last nothing stands.
template <class Eight>
[[gnu::always_inline]] inline void each_eight(const float* stands, int n, Eight&& eight) {
    Floats8 f;
    int k = 0;
    for (; k + kLanes <= n; k += kLanes) {
        load(stands + k, f);
        eight(k, __builtin_convertvector(f, Doubles8));
    }
    if (k == n) return;
    std::array<float, kLanes> rest;
    for (int i = 0; i < kLanes; ++i)
        rest[static_cast<std::size_t>(i)] =
            k + i < n ? stands[k + i] : -std::numeric_limits<float>::infinity();
    load(rest.data(), f);
    eight(k, __builtin_convertvector(f, Doubles8));
}

[[gnu::always_inline]] inline bool any_of(const Longs8& bits) {
    std::array<std::uint64_t, kLanes> words;
    std::memcpy(words.data(), &bits, sizeof bits);
    return (words[0] | words[1] | words[2] | words[3] | words[4] | words[5] | words[6] | words[7]) != 0;
}

}  // namespace

SLABWRIGHT_WIDE void ball_row(double a, double b, double c, double r2, double q, double dq, int n,
                              double* h) {
    for (int k = 0; k < n; ++k) {
        const double across = q + k * dq;
        h[k] = a + b * k - c * std::sqrt(r2 - across * across);
    }
}

namespace {

[[gnu::always_inline]] inline bool some_over(const float* stands, double bottom, int n, double level) {
    Longs8 over{};
    each_eight(stands, n, [&](int, const Doubles8& f) { over |= bottom + f > level; });
    return any_of(over);
}

[[gnu::always_inline]] inline bool some_lower(const float* __restrict stands, double bottom, int n,
                                              double* __restrict h) {
    Longs8 any{};
    each_eight(stands, n, [&](int k, const Doubles8& f) {
        Doubles8 height;
        load(h + k, height);
        const Longs8 lower = bottom + f > height;
        height = lower ? height : Doubles8{} + kUncovered;
        std::memcpy(h + k, &height, sizeof height);
        any |= lower;
    });
    return any_of(any);
}

// Ints8 of those of n cells that stand at least `least` over max(floor, h).
template <class Left>
[[gnu::always_inline]] inline std::uint64_t bits_over(const float* stands, int n, double floor, double least,
                                                      Left&& left) {
    constexpr Longs8 lane{1, 2, 4, 8, 16, 32, 64, 128};
    std::uint64_t over = 0;
    each_eight(stands, n, [&](int k, const Doubles8& f) {
        Doubles8 h;
        left(k, h);
        h = h > floor ? h : Doubles8{} + floor;
        const Longs8 bits = (f - h >= least) & lane;
        std::array<std::uint64_t, kLanes> words;
        std::memcpy(words.data(), &bits, sizeof bits);
        over |= (words[0] | words[1] | words[2] | words[3] | words[4] | words[5] | words[6] | words[7]) << k;
    });
    return over;
}

}  // namespace

SLABWRIGHT_WIDE std::uint64_t cells_over(const float* stands, int n, const double* h, double floor,
                                         double least) {
    return bits_over(stands, n, floor, least, [&](int k, Doubles8& left) { load(h + k, left); });
}
SLABWRIGHT_WIDE std::uint64_t cells_over(const float* stands, int n, double h, double least) {
    return bits_over(stands, n, h, least, [&](int, Doubles8& left) { left = Doubles8{} + h; });
}

SLABWRIGHT_WIDE bool any_over(const float* stands, double bottom, int n, double level) {
    return some_over(stands, bottom, n, level);
}
SLABWRIGHT_WIDE bool keep_lower(const float* stands, double bottom, int n, double* h) {
    return some_lower(stands, bottom, n, h);
}

SLABWRIGHT_WIDE std::uint64_t cells_left(const float* __restrict stands, const float* __restrict surface,
                                         const std::uint8_t* __restrict nz, int n, float most) {
    std::int32_t any = 0;
    for (int k = 0; k < n; ++k) any |= stands[k] - surface[k] > most ? 1 : 0;
    if (any == 0) return 0;
    std::uint64_t bits = 0;
    for (int k = 0; k < n; ++k)
        bits |= std::uint64_t{(stands[k] - surface[k]) * (static_cast<float>(nz[k]) / 255.0F) > most} << k;
    return bits;
}

SLABWRIGHT_WIDE float most_left(const float* stands, const float* surface, const std::uint8_t* nz, int n) {
    Floats8 most{};
    float of_rest = 0;
    int k = 0;
    for (; k + kLanes <= n; k += kLanes) {
        Floats8 high, low;
        Bytes8 share;
        load(stands + k, high);
        load(surface + k, low);
        load(nz + k, share);
        const Floats8 left = (high - low) * (__builtin_convertvector(share, Floats8) / 255.0F);
        most = left > most ? left : most;
    }
    for (; k < n; ++k)
        of_rest = std::max(of_rest, (stands[k] - surface[k]) * (static_cast<float>(nz[k]) / 255.0F));
    for (int i = 0; i < kLanes; ++i) of_rest = std::max(of_rest, most[i]);
    return of_rest;
}

// The loops hold no branch, so that a compiler does several cells in one step; what does not depend on the
// cell is decided outside. Whole eights of cells: what is past the last is not asked for.
SLABWRIGHT_WIDE bool row_heights(const RowWay& way, int i0, int n, double py, const float* __restrict stands,
                                 double bottom, double* __restrict h) {
    if (stands != nullptr && !some_over(stands, bottom, n, way.lowest)) return false;
    const RowWay w = way;
    const int cells = (n + kLanes - 1) / kLanes * kLanes;
    auto centre = [&](int k) { return w.x0 + (i0 + k) * w.cell - w.from_x; };
    if (!w.ball) {
        for (int k = 0; k < cells; ++k) h[k] = flat_height(w, centre(k), py);
    } else if (w.slope == 0) {
        for (int k = 0; k < cells; ++k) h[k] = level_ball_height(w, centre(k), py);
    } else {
        for (int k = 0; k < cells; ++k) h[k] = sloped_ball_height(w, centre(k), py);
    }
    if (stands != nullptr) return some_lower(stands, bottom, n, h);
    int any = 0;
    for (int k = 0; k < n; ++k) any |= static_cast<int>(h[k] < kUncovered);
    return any != 0;
}

// The capsule's span on a row is where the row meets either disc, or the strip between them; with a hole,
// what is left of where the disc starts and what is right of it. No branch, and whole vectors of rows: what
// is past the last is not asked for.
SLABWRIGHT_WIDE void spans_of_rows(const CellGrid& grid, int first_row, int rows,
                                   const std::array<double, 2>& from, const std::array<double, 2>& to,
                                   double radius, bool been, RowSpans& spans) {
    constexpr int lanes = 8;
    const double inf = kUnbounded, r2 = radius * radius, nx = grid.nx, per_mm = 1 / grid.cell;
    const double fx = from[0], fy = from[1], tx = to[0], ty = to[1];
    double dx = tx - fx, dy = ty - fy;
    const double run = std::sqrt(dx * dx + dy * dy), rise = dy;
    const bool moves = run > 1e-9;
    if (moves) dx /= run, dy /= run;
    const double inverse = rise == 0 ? 0 : (tx - fx) / rise, x0 = grid.x0, y0 = grid.y0, cell = grid.cell;
    // The sides of the strip; of one that runs along the rows, or nowhere, none is met.
    const double lx = fx - radius * dy, ly = fy + radius * dx, rx = fx + radius * dy, ry = fy - radius * dx;
    const double l_from = rise == 0 ? inf : std::min(ly, ly + rise),
                 l_to = rise == 0 ? -inf : std::max(ly, ly + rise);
    const double r_from = rise == 0 ? inf : std::min(ry, ry + rise),
                 r_to = rise == 0 ? -inf : std::max(ry, ry + rise);
    const double hole = been ? 0.0 : inf;
    const int count = (rows + lanes - 1) / lanes * lanes;
    std::int32_t *const low_out = spans.low.data(), *const left_out = spans.left.data(),
                        *const right_out = spans.right.data(), *const high_out = spans.high.data();
    for (int k = 0; k < count; ++k) {
        const double y = y0 + (first_row + k) * cell;
        const double a2 = r2 - (y - fy) * (y - fy), b2 = r2 - (y - ty) * (y - ty);
        const double a = std::sqrt(a2 > 0 ? a2 : 0.0), b = std::sqrt(b2 > 0 ? b2 : 0.0);
        const double on_a = a2 < 0 ? inf : 0.0, on_b = b2 < 0 ? inf : 0.0;
        double low = fx - a + on_a, high = fx + a - on_a;
        const double low_b = tx - b + on_b, high_b = tx + b - on_b;
        low = low_b < low ? low_b : low;
        high = high_b > high ? high_b : high;
        const double l = lx + (y - ly) * inverse, r = rx + (y - ry) * inverse;
        const double l_off = ((y < l_from) | (y > l_to)) ? inf : 0.0,
                     r_off = ((y < r_from) | (y > r_to)) ? inf : 0.0;
        low = l + l_off < low ? l + l_off : low;
        high = l - l_off > high ? l - l_off : high;
        low = r + r_off < low ? r + r_off : low;
        high = r - r_off > high ? r - r_off : high;
        const double off = on_a + hole;
        const double left = off > 0 ? high : fx - a, right = fx + a + off;
        const double i_low = std::ceil((low - x0) * per_mm), i_left = std::floor((left - x0) * per_mm);
        const double i_right = std::ceil((right - x0) * per_mm), i_high = std::floor((high - x0) * per_mm);
        low_out[k] = static_cast<std::int32_t>(i_low < 0 ? 0.0 : i_low > nx ? nx : i_low);
        left_out[k] = static_cast<std::int32_t>(i_left < -1 ? -1.0 : i_left > nx - 1 ? nx - 1 : i_left);
        right_out[k] = static_cast<std::int32_t>(i_right < 0 ? 0.0 : i_right > nx ? nx : i_right);
        high_out[k] = static_cast<std::int32_t>(i_high < -1 ? -1.0 : i_high > nx - 1 ? nx - 1 : i_high);
    }
}

namespace {

// Narrows [low, high] of eight lines to a strip, as Strip does.
[[gnu::always_inline]] inline void narrow(const Strip& strip, const Doubles8& value, Doubles8& low,
                                          Doubles8& high) {
    if (strip.everywhere_or_nowhere()) {
        high = ((value >= strip.least) & (value <= strip.most)) ? high : Doubles8{} - kUnbounded;
        return;
    }
    const Doubles8 a = (strip.least - value) * strip.inverse, b = (strip.most - value) * strip.inverse;
    const Doubles8 from = b < a ? b : a, to = a < b ? b : a;
    low = low < from ? from : low;
    high = to < high ? to : high;
}
[[gnu::always_inline]] inline void narrow(const CrossedStrips& strips, const Doubles8& py, Doubles8& low,
                                          Doubles8& high) {
    narrow(strips.a, py * strips.a_rise, low, high);
    narrow(strips.b, py * strips.b_rise, low, high);
}

// The whole numbers next to those of what an int holds.
[[gnu::always_inline]] inline void whole(Doubles8& v, bool up) {
    const Doubles8 cut = __builtin_convertvector(__builtin_convertvector(v, Ints8), Doubles8);
    const Doubles8 one = Doubles8{} + 1.0;
    v = up ? (cut < v ? cut + one : cut) : (cut > v ? cut - one : cut);
}

// The cells between low and high of eight rows, mm from fx; none where low > high.
[[gnu::always_inline]] inline void cells_between(const CellGrid& grid, double fx, const Doubles8& low,
                                                 const Doubles8& high, std::int32_t* first,
                                                 std::int32_t* last) {
    const double per_mm = 1 / grid.cell, beyond = grid.nx + 1.0, most = grid.nx - 1.0;
    Doubles8 a = (low + fx - grid.x0) * per_mm, b = (high + fx - grid.x0) * per_mm;
    a = a < -1.0 ? Doubles8{} - 1.0 : a > beyond ? Doubles8{} + beyond : a;
    b = b < -1.0 ? Doubles8{} - 1.0 : b > beyond ? Doubles8{} + beyond : b;
    whole(a, true);
    whole(b, false);
    a = a > 0.0 ? a : Doubles8{};
    b = low <= high ? (b < most ? b : Doubles8{} + most) : Doubles8{} - 1.0;
    const Ints8 i0 = __builtin_convertvector(a, Ints8), i1 = __builtin_convertvector(b, Ints8);
    std::memcpy(first, &i0, sizeof i0), std::memcpy(last, &i1, sizeof i1);
}

}  // namespace

SLABWRIGHT_WIDE void strips_of_rows(const CellGrid& grid, int first_row, int rows,
                                    const std::array<double, 2>& from, const CrossedStrips& strips,
                                    double low, double high, const CrossedStrips* near, double radius,
                                    RowSpans& spans) {
    constexpr Doubles8 lane{0, 1, 2, 3, 4, 5, 6, 7};
    const double r2 = radius * radius;
    for (std::size_t k = 0; k < static_cast<std::size_t>(rows); k += kLanes) {
        const Doubles8 py = grid.y0 + (first_row + static_cast<double>(k) + lane) * grid.cell - from[1];
        Doubles8 from_x = Doubles8{} + low, to_x = Doubles8{} + high;
        narrow(strips, py, from_x, to_x);
        cells_between(grid, from[0], from_x, to_x, spans.low.data() + k, spans.left.data() + k);
        if (near == nullptr) {
            for (std::size_t i = k; i < k + kLanes; ++i) spans.right[i] = 0, spans.high[i] = -1;
            continue;
        }
        const Doubles8 w2 = r2 - py * py;
        std::array<double, kLanes> w;
        std::memcpy(w.data(), &w2, sizeof w2);
        for (double& v : w) v = std::sqrt(v > 0 ? v : 0.0);
        load(w.data(), to_x);
        from_x = -to_x;
        to_x = w2 < 0.0 ? Doubles8{} - kUnbounded : to_x;
        narrow(*near, py, from_x, to_x);
        cells_between(grid, from[0], from_x, to_x, spans.right.data() + k, spans.high.data() + k);
    }
}

float level_over(double bottom, double level) {
    const auto under = [&](float h) { return bottom + static_cast<double>(h) <= level; };
    constexpr float inf = std::numeric_limits<float>::infinity();
    const auto near = static_cast<float>(level - bottom), below = std::nextafter(near, -inf),
               above = std::nextafter(near, inf);
    if (under(near) && !under(above)) return near;
    if (under(below) && !under(near)) return below;
    // Where many heights near nothing make the same sum: halving among all floats, whose bits are ordered as
    // they are.
    const auto of = [](std::int32_t order) {
        return std::bit_cast<float>(order >= 0 ? order : std::numeric_limits<std::int32_t>::min() - order);
    };
    std::int64_t low = -std::bit_cast<std::int32_t>(inf), high = -low;
    while (low < high) {
        const std::int64_t middle = low + (high - low + 1) / 2;
        if (under(of(static_cast<std::int32_t>(middle)))) low = middle;
        else high = middle - 1;
    }
    return of(static_cast<std::int32_t>(low));
}

namespace {

// Calls fn(eight, mask) for all of the cells [first, last] of a row, eight at a time; the last eight may hold
// cells that came before. In a shorter span the mask tells which of the eight that end with it are its own.
// fn(cell) where a row has too few before them.
template <class Eight, class One>
[[gnu::always_inline]] inline void by_eights(std::int32_t first, std::int32_t last, Eight&& eight,
                                             One&& one) {
    constexpr Ints8 lane{0, 1, 2, 3, 4, 5, 6, 7};
    if (first > last) return;
    const std::int32_t end = last + 1 - kLanes;
    if (first <= end) {
        for (std::int32_t i = first; i < end; i += kLanes) eight(i, Ints8{} == Ints8{});
        eight(end, Ints8{} == Ints8{});
    } else if (end >= 0) {
        eight(end, lane >= first - end);
    } else {
        for (std::int32_t i = first; i <= last; ++i) one(i);
    }
}

[[gnu::always_inline]] inline bool over_in(const float* row, std::int32_t first, std::int32_t last,
                                           float level) {
    Ints8 over{};
    bool any = false;
    by_eights(
        first, last,
        [&](std::int32_t i, const Ints8& mask) {
            Floats8 h;
            load(row + i, h);
            over |= (h > level) & mask;
        },
        [&](std::int32_t i) { any |= row[i] > level; });
    std::array<std::uint64_t, sizeof over / sizeof(std::uint64_t)> words;
    std::memcpy(words.data(), &over, sizeof over);
    return any || (words[0] | words[1] | words[2] | words[3]) != 0;
}

[[gnu::always_inline]] inline void lower_in(float* row, std::int32_t first, std::int32_t last, float level) {
    by_eights(
        first, last,
        [&](std::int32_t i, const Ints8& mask) {
            Floats8 h;
            load(row + i, h);
            const Floats8 lowered = ((h > level) & mask) ? Floats8{} + level : h;
            std::memcpy(row + i, &lowered, sizeof lowered);
        },
        [&](std::int32_t i) { row[i] = level < row[i] ? level : row[i]; });
}

}  // namespace

SLABWRIGHT_WIDE OverSpans spans_over(const float* height, std::size_t nx, int rows, const RowSpans& spans,
                                     float level) {
    OverSpans over;
    for (std::size_t k = 0; k < static_cast<std::size_t>(rows); ++k, height += nx) {
        over.left |= std::uint64_t{over_in(height, spans.low[k], spans.left[k], level)} << k;
        over.right |= std::uint64_t{over_in(height, spans.right[k], spans.high[k], level)} << k;
    }
    return over;
}

SLABWRIGHT_WIDE float highest_in(const float* height, std::size_t nx, int rows, const RowSpans& spans) {
    constexpr float none = -std::numeric_limits<float>::infinity();
    Floats8 most = Floats8{} + none;
    float of_rest = none;
    for (std::size_t k = 0; k < static_cast<std::size_t>(rows); ++k, height += nx) {
        const auto in_span = [&](std::int32_t first, std::int32_t last) {
            by_eights(
                first, last,
                [&](std::int32_t i, const Ints8& mask) {
                    Floats8 h;
                    load(height + i, h);
                    most = ((h > most) & mask) ? h : most;
                },
                [&](std::int32_t i) { of_rest = std::max(of_rest, height[i]); });
        };
        in_span(spans.low[k], spans.left[k]);
        in_span(spans.right[k], spans.high[k]);
    }
    for (int k = 0; k < kLanes; ++k) of_rest = std::max(of_rest, most[k]);
    return of_rest;
}

void lower_spans(float* height, std::size_t nx, int rows, const RowSpans& spans, double z) {
    lower_spans(height, nx, rows, spans, static_cast<float>(z > 0 ? z : 0.0));
}

SLABWRIGHT_WIDE void lower_spans(float* height, std::size_t nx, int rows, const RowSpans& spans,
                                 float level) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(rows); ++k, height += nx) {
        lower_in(height, spans.low[k], spans.left[k], level);
        lower_in(height, spans.right[k], spans.high[k], level);
    }
}

SLABWRIGHT_WIDE void lower_to(float* __restrict height, int n, const double* __restrict h, double bottom) {
    for (int k = 0; k < n; ++k) {
        const double over = h[k] - bottom;
        const auto left = static_cast<float>(over > 0 ? over : 0.0);
        height[k] = left < height[k] ? left : height[k];
    }
}

SLABWRIGHT_WIDE void lower_to(float* height, int n, double z) {
    const auto level = static_cast<float>(z > 0 ? z : 0.0);
    for (int k = 0; k < n; ++k) height[k] = level < height[k] ? level : height[k];
}

SLABWRIGHT_WIDE float highest_of(const float* height, std::size_t nx, int n, int rows) {
    Floats8 most{};
    float of_rest = 0;
    for (int row = 0; row < rows; ++row, height += nx) {
        int k = 0;
        for (; k + kLanes <= n; k += kLanes) {
            Floats8 h;
            load(height + k, h);
            most = h > most ? h : most;
        }
        for (; k < n; ++k) of_rest = std::max(of_rest, height[k]);
    }
    for (int k = 0; k < kLanes; ++k) of_rest = std::max(of_rest, most[k]);
    return of_rest;
}

SLABWRIGHT_WIDE void add_lost(const float* before, const float* now, const std::uint8_t* share, int n,
                              float least, Lost& lost) {
    constexpr float whole = 255;
    Floats8 most{}, sum{};
    Ints8 cells{};
    int k = 0;
    for (; k + kLanes <= n; k += kLanes) {
        Floats8 b, a;
        Bytes8 s;
        load(before + k, b), load(now + k, a), std::memcpy(&s, share + k, sizeof s);
        const Floats8 off = b - a, along = off * (__builtin_convertvector(s, Floats8) / whole);
        most = along > most ? along : most;
        sum += along;
        cells -= off > least;  // true is -1
    }
    for (; k < n; ++k) {
        const float off = before[k] - now[k], along = off * (static_cast<float>(share[k]) / whole);
        lost.most = std::max(lost.most, along);
        lost.sum += static_cast<double>(along);
        lost.cells += off > least;
    }
    for (int i = 0; i < kLanes; ++i)
        lost.most = std::max(lost.most, most[i]), lost.sum += static_cast<double>(sum[i]),
        lost.cells += static_cast<std::size_t>(cells[i]);
}

SLABWRIGHT_WIDE void edge_parts(const PartedWay& way, double px, double cell, double py, int n,
                                std::int32_t* __restrict part, double* __restrict across) {
    const double r2 = way.radius * way.radius, last = way.count - 1;
    const int cells = (n + kLanes - 1) / kLanes * kLanes;
    for (int k = 0; k < cells; ++k) {
        const double x = px + k * cell, aside = way.dx * py - way.dy * x, w2 = r2 - aside * aside;
        const double met = (x * way.dx + py * way.dy - std::sqrt(w2 > 0 ? w2 : 0.0)) * way.per_mm,
                     from_begin = met > 0 ? met : 0.0;
        part[k] = static_cast<std::int32_t>(from_begin < last ? from_begin : last);
        across[k] = aside;
    }
}

}  // namespace slabwright
