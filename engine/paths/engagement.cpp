#include "engine/paths/engagement.h"

#include <algorithm>
#include <cmath>

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
    auto take = [&](int j, double low, double high) {
        const double first = std::ceil((low - grid_.x0) / grid_.cell), last = std::floor((high - grid_.x0) / grid_.cell);
        float* const row = height_.data() + grid_.index(0, j);
        for (int i = static_cast<int>(std::clamp(first, 0.0, static_cast<double>(grid_.nx))); i <= std::min<double>(last, grid_.nx - 1); ++i)
            if (static_cast<double>(row[i]) > z) {
                sum += static_cast<double>(row[i]) - z;
                row[i] = static_cast<float>(z);
            }
    };
    for (int j = j0; j <= j1; ++j) {
        // The capsule's span on this row: where the row meets either disc, or the strip between them.
        const double y = grid_.y(j);
        double low = 1e300, high = -1e300;
        for (const auto* p : {&from, &to}) {
            const double w2 = R * R - (y - (*p)[1]) * (y - (*p)[1]);
            if (w2 < 0) continue;
            const double w = std::sqrt(w2);
            low = std::min(low, (*p)[0] - w), high = std::max(high, (*p)[0] + w);
        }
        if (run > 1e-9)
            for (const double side : {-R, R}) {
                const double ax = from[0] - side * dy, ay = from[1] + side * dx, bx = to[0] - side * dy, by = to[1] + side * dx;
                if ((ay <= y) == (by <= y)) continue;
                const double x = ax + (y - ay) / (by - ay) * (bx - ax);
                low = std::min(low, x), high = std::max(high, x);
            }
        if (low > high) continue;
        const double w2 = R * R - (y - from[1]) * (y - from[1]);
        if (!been || w2 < 0) {
            take(j, low, high);
            continue;
        }
        const double w = std::sqrt(w2);
        take(j, low, from[0] - w);
        take(j, from[0] + w, high);
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
