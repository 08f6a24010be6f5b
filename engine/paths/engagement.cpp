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

// Lowers cells and adds up by how much, by the part of the way on which the cutter's edge comes to them.
struct Taking {
    const CellGrid& grid;
    float* height;
    PartedWay way;
    std::array<double, 2> from;
    std::vector<double>& sums;

    void operator()(std::size_t cell, double z) {
        sums.front() += static_cast<double>(height[cell]) - z;
        height[cell] = static_cast<float>(z);
    }
    void level(std::size_t first, int n, double z) {
        const auto nx = static_cast<std::size_t>(grid.nx);
        const double py = grid.y(static_cast<int>(first / nx)) - from[1];
        const auto level = static_cast<float>(z);
        std::array<std::int32_t, kSweptTogether> part{};
        std::array<double, kSweptTogether> across;
        for (int begin = 0; begin < n; begin += kSweptTogether) {
            const int cells = std::min(kSweptTogether, n - begin);
            float* const row = height + first + begin;
            if (n > cells && !any_over(row, 0, cells, z)) continue;
            if (way.count > 1)
                edge_parts(way, grid.x(static_cast<int>(first % nx) + begin) - from[0], grid.cell, py, cells, part.data(), across.data());
            for (int k = 0; k < cells; ++k) {
                const double over = static_cast<double>(row[k]) - z;
                if (over <= 0) continue;
                sums[static_cast<std::size_t>(part[static_cast<std::size_t>(k)])] += over;
                row[k] = level;
            }
        }
    }
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

double EngagedStock::cut(const std::array<double, 3>& from, const std::array<double, 3>& to) {
    std::vector<double> volume(1);
    cut(from, to, volume);
    return volume.front();
}

void EngagedStock::cut(const std::array<double, 3>& from, const std::array<double, 3>& to, std::vector<double>& volumes) {
    const auto count = static_cast<int>(volumes.size());
    if (count > 1 && from[2] != to[2]) {  // a ramp, part by part
        std::array<double, 3> at = from;
        for (int k = 1; k <= count; ++k) {
            const double t = static_cast<double>(k) / count;
            const std::array<double, 3> next{from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1]), from[2] + t * (to[2] - from[2])};
            volumes[static_cast<std::size_t>(k - 1)] = cut(at, k == count ? to : next);
            at = next;
        }
        return;
    }
    // At one height only the cells between where the cutter is and where it gets need a look: under it nothing stands any more.
    const bool been = from == last_;
    last_ = to;
    const double dx = to[0] - from[0], dy = to[1] - from[1], run = std::hypot(dx, dy);
    std::fill(volumes.begin(), volumes.end(), 0.0);
    Taking taking{grid_, height_.data(), {}, {from[0], from[1]}, volumes};
    if (run > 0) taking.way = {dx / run, dy / run, end_.radius, count / run, count};
    sweep_above(grid_, end_, {from[0], from[1], from[2] - top_}, {to[0], to[1], to[2] - top_}, StandingHeights{height_.data(), 0}, taking,
                {.been = been});
    for (double& volume : volumes) volume *= grid_.cell * grid_.cell;
}

double cap_engagement(Context& context, std::vector<Move>& moves, EngagedStock& stock, const EngagementCap& cap) {
    if (moves.size() < 2) return 0;
    const double window = cap.diameter / 8, slot = cap.diameter * cap.stepdown;
    std::vector<Stretch> way;
    std::size_t begun = 0;  // first stretch of the window
    double volume = 0, length = 0;
    std::vector<double> volumes;
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
        if (i % 64 == 0) context.throw_if_cancelled();
        if (moves[i].feed == 0 || run == 0) {
            close();
            if (moves[i].feed > 0) stock.cut(a, b);
            way.push_back({i, b, 0, kFeeds});
            begun = way.size();
            continue;
        }
        const int parts = std::max(1, static_cast<int>(std::ceil(run / window)));
        volumes.assign(static_cast<std::size_t>(parts), 0);
        stock.cut(a, b, volumes);
        for (int k = 1; k <= parts; ++k) {
            const double t = static_cast<double>(k) / parts;
            const std::array<double, 3> to =
                k == parts ? b : std::array<double, 3>{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
            way.push_back({i, to, run / parts, kFeeds});
            volume += volumes[static_cast<std::size_t>(k - 1)];
            length += run / parts;
            if (length >= window - 1e-9) close();
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
