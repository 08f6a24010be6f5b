#include "engine/paths/engagement.h"

#include <algorithm>
#include <cmath>

#include "kernels/wide.h"

namespace slabwright {

namespace {

constexpr double kCellsARadius = 12;
constexpr int kFeeds = 20;  // steps between a feed and rest: finer ones only lengthen the program

// A stretch of a move, and the steps of its feed that are left to it.
struct Stretch {
    std::size_t move = 0;
    std::array<double, 3> to{};
    double length = 0;  // mm, in the plane
    int steps = kFeeds;
};

constexpr int kRows = 64;  // that are looked at together

// The cells on each row that a disc comes over on its way, but for those that it has been over where it starts: [low, left] and [right,
// high], along the row; low > left, right > high: none.
struct RowSpans {
    alignas(64) std::array<std::int32_t, kRows> low, left, right, high;
};

// The capsule's span on a row is where the row meets either disc, or the strip between them.
SLABWRIGHT_WIDE void spans_of_rows(const CellGrid& grid, int first_row, int rows, const std::array<double, 2>& from, const std::array<double, 2>& to,
                                   double radius, double dx, double dy, bool moves, bool been, RowSpans& spans) {
    const double inf = 1e300, r2 = radius * radius, nx = grid.nx;
    const std::array<double, 2> side{-radius, radius};
    for (int k = 0; k < rows; ++k) {
        const double y = grid.y0 + (first_row + k) * grid.cell;
        const double a2 = r2 - (y - from[1]) * (y - from[1]), b2 = r2 - (y - to[1]) * (y - to[1]);
        const double a = std::sqrt(a2 > 0 ? a2 : 0.0), b = std::sqrt(b2 > 0 ? b2 : 0.0);
        double low = a2 < 0 ? inf : from[0] - a, high = a2 < 0 ? -inf : from[0] + a;
        const double low_b = b2 < 0 ? inf : to[0] - b, high_b = b2 < 0 ? -inf : to[0] + b;
        low = low_b < low ? low_b : low, high = high_b > high ? high_b : high;
        for (const double s : side) {
            const double ax = from[0] - s * dy, ay = from[1] + s * dx, bx = to[0] - s * dy, by = to[1] + s * dx;
            const bool met = moves && (ay <= y) != (by <= y);
            const double x = ax + (y - ay) / (met ? by - ay : 1.0) * (bx - ax);
            low = met && x < low ? x : low, high = met && x > high ? x : high;
        }
        // What is left of where the disc starts, and what is right of it; all in one where it is not known to have been there.
        const bool hole = been && !(a2 < 0), none = low > high;
        const double left = hole ? from[0] - a : high, right = from[0] + a;
        const double i_low = std::ceil((low - grid.x0) / grid.cell), i_left = std::floor((left - grid.x0) / grid.cell);
        const double i_right = std::ceil((right - grid.x0) / grid.cell), i_high = std::floor((high - grid.x0) / grid.cell);
        auto within = [](double v, double least, double most) { return static_cast<std::int32_t>(v < least ? least : v > most ? most : v); };
        const auto r = static_cast<std::size_t>(k);
        spans.low[r] = none ? 0 : within(i_low, 0, nx);
        spans.left[r] = none ? -1 : within(i_left, -1, nx - 1);
        spans.right[r] = none || !hole ? 0 : within(i_right, 0, nx);
        spans.high[r] = none || !hole ? -1 : within(i_high, -1, nx - 1);
    }
}

std::array<double, 3> place(const Move& m) { return {to_mm(m.x), to_mm(m.y), to_mm(m.z)}; }

}  // namespace

EngagedStock::EngagedStock(std::array<double, 2> min, std::array<double, 2> max, double top, double radius)
    : end_{CutterEnd::Form::flat, radius, 0}, top_(top) {
    const double cell = std::max(radius / kCellsARadius, std::sqrt((max[0] - min[0]) * (max[1] - min[1]) / kMostCells));
    grid_ = {min[0] + cell / 2, min[1] + cell / 2, cell, std::max(1, static_cast<int>(std::lround((max[0] - min[0]) / cell))),
             std::max(1, static_cast<int>(std::lround((max[1] - min[1]) / cell)))};
    height_.assign(grid_.count(), 0.0F);
}

// At one height only the cells between where the cutter is and where it gets need a look: under it nothing stands any more.
double EngagedStock::cut_level(const std::array<double, 3>& from, const std::array<double, 3>& to) {
    const double R = end_.radius, z = from[2] - top_;
    const bool been = from == last_;
    double dx = to[0] - from[0], dy = to[1] - from[1];
    const double run = std::hypot(dx, dy);
    if (run > 1e-9) dx /= run, dy /= run;
    const int j0 = std::max(0, static_cast<int>(std::ceil(std::max(-1.0, (std::min(from[1], to[1]) - R - grid_.y0) / grid_.cell))));
    const int j1 =
        std::min(grid_.ny - 1, static_cast<int>(std::floor(std::min<double>(grid_.ny, (std::max(from[1], to[1]) + R - grid_.y0) / grid_.cell))));
    double sum = 0;
    const auto level = static_cast<float>(z);
    auto take = [&](float* row, std::int32_t first, std::int32_t last) {
        for (std::int32_t i = first; i <= last; ++i)
            if (static_cast<double>(row[i]) > z) {
                sum += static_cast<double>(row[i]) - z;
                row[i] = level;
            }
    };
    RowSpans spans;
    for (int j = j0; j <= j1; j += kRows) {
        const int rows = std::min(kRows, j1 - j + 1);
        spans_of_rows(grid_, j, rows, {from[0], from[1]}, {to[0], to[1]}, R, dx, dy, run > 1e-9, been, spans);
        for (int k = 0; k < rows; ++k) {
            const auto r = static_cast<std::size_t>(k);
            float* const row = height_.data() + grid_.index(0, j + k);
            take(row, spans.low[r], spans.left[r]);
            take(row, spans.right[r], spans.high[r]);
        }
    }
    return sum * grid_.cell * grid_.cell;
}

double EngagedStock::cut(const std::array<double, 3>& from, const std::array<double, 3>& to) {
    if (from[2] == to[2]) {
        const double volume = cut_level(from, to);
        last_ = to;
        return volume;
    }
    last_ = to;
    double sum = 0;
    sweep_above(grid_, end_, {from[0], from[1], from[2] - top_}, {to[0], to[1], to[2] - top_}, StandingHeights{height_.data(), 0},
                [&](std::size_t c, double z) {
                    sum += static_cast<double>(height_[c]) - z;
                    height_[c] = static_cast<float>(z);
                });
    return sum * grid_.cell * grid_.cell;
}

double cap_engagement(Context& context, std::vector<Move>& moves, EngagedStock& stock, const EngagementCap& cap) {
    if (moves.size() < 2) return 0;
    const double window = cap.diameter / 8, slot = cap.diameter * cap.stepdown;
    std::vector<Stretch> way;
    std::size_t begun = 0;  // first stretch of the window
    double volume = 0, length = 0;
    auto close = [&] {
        // The cutter is slowed by what it has met over the whole window.
        const double section = length > 0 ? volume / length : 0;
        int steps = kFeeds;
        if (section > cap.share * slot) steps = std::max(1, static_cast<int>(std::floor(kFeeds * cap.share * slot / section)));
        for (std::size_t k = begun; k < way.size(); ++k) way[k].steps = steps;
        begun = way.size();
        volume = length = 0;
    };
    for (std::size_t i = 1; i < moves.size(); ++i) {
        const std::array<double, 3> a = place(moves[i - 1]), b = place(moves[i]);
        const double run = std::hypot(b[0] - a[0], b[1] - a[1]);
        if (moves[i].feed == 0 || run == 0) {
            close();
            if (moves[i].feed > 0) stock.cut(a, b);
            way.push_back({i, b, 0, kFeeds});
            begun = way.size();
            continue;
        }
        const int parts = std::max(1, static_cast<int>(std::ceil(run / window)));
        std::array<double, 3> from = a;
        for (int k = 1; k <= parts; ++k) {
            const double t = static_cast<double>(k) / parts;
            const std::array<double, 3> to =
                k == parts ? b : std::array<double, 3>{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
            way.push_back({i, to, run / parts, kFeeds});
            if (way.size() % 256 == 0) context.throw_if_cancelled();
            volume += stock.cut(from, to);
            length += run / parts;
            if (length >= window - 1e-9) close();
            from = to;
        }
    }
    close();
    // Short ways at full feed between slow ones gain nothing but two changes of speed.
    for (std::size_t k = 0; k < way.size();) {
        if (way[k].steps == kFeeds || way[k].length == 0) {
            ++k;
            continue;
        }
        std::size_t next = k + 1;
        double between = 0;
        while (next < way.size() && way[next].length > 0 && way[next].steps == kFeeds && between <= 2 * window) between += way[next++].length;
        if (next > k + 1 && next < way.size() && way[next].length > 0 && way[next].steps < kFeeds)
            for (std::size_t j = k + 1; j < next; ++j) way[j].steps = std::max(way[k].steps, way[next].steps);
        k = next;
    }
    std::vector<Move> result{moves.front()};
    double slowed = 0;
    for (std::size_t k = 0; k < way.size(); ++k) {
        const Move& whole = moves[way[k].move];
        const bool last = k + 1 == way.size() || way[k + 1].move != way[k].move;
        if (way[k].steps < kFeeds) slowed += way[k].length;
        if (!last && way[k + 1].steps == way[k].steps) continue;
        Move m = whole;
        if (!last) m.x = to_units(way[k].to[0]), m.y = to_units(way[k].to[1]), m.z = to_units(way[k].to[2]);
        if (way[k].steps < kFeeds) m.feed = std::max<std::uint32_t>(1, whole.feed * static_cast<std::uint32_t>(way[k].steps) / kFeeds);
        result.push_back(m);
    }
    moves = std::move(result);
    return slowed;
}

}  // namespace slabwright
