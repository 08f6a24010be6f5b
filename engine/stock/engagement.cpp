#include "engine/stock/engagement.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr double kCellsARadius = 12;
constexpr int kFeeds = 20;  // steps between a feed and rest: finer ones only lengthen the program

// The equal parts of every move, told apart by their numbers through all moves; of each only the steps of its
// move's feed that are left to it are kept, for there is one for every millimetre or so of the way.
struct Way {
    std::vector<std::uint8_t> steps;    // by part
    std::vector<std::uint32_t> starts;  // by move: its first part
    std::vector<double> lengths;        // by move: of one part in the plane, mm; 0: a rapid, or straight down

    void add(int parts, double length) {
        starts.push_back(static_cast<std::uint32_t>(steps.size()));
        lengths.push_back(length);
        steps.resize(steps.size() + static_cast<std::size_t>(parts), kFeeds);
    }
    [[nodiscard]] std::size_t end(std::size_t move) const {
        return move + 1 < starts.size() ? starts[move + 1] : steps.size();
    }
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
        std::array<std::int32_t, kSweptTogether> part;
        if (way.count <= 1) part.fill(0);
        std::array<double, kSweptTogether> across;
        for (int begin = 0; begin < n; begin += kSweptTogether) {
            const int cells = std::min(kSweptTogether, n - begin);
            float* const row = height + first + begin;
            constexpr double any = std::numeric_limits<double>::denorm_min();
            std::uint64_t over = cells_over(row, cells, z, any);
            if (over == 0) continue;
            if (way.count > 1)
                edge_parts(way, grid.x(static_cast<int>(first % nx) + begin) - from[0], grid.cell, py,
                           64 - std::countl_zero(over), part.data(), across.data());
            std::int32_t p = part[static_cast<std::size_t>(std::countr_zero(over))];
            double sum = sums[static_cast<std::size_t>(p)];
            for (; over != 0; over &= over - 1) {
                const int k = std::countr_zero(over);
                if (const std::int32_t here = part[static_cast<std::size_t>(k)]; here != p) {
                    sums[static_cast<std::size_t>(p)] = sum;
                    p = here;
                    sum = sums[static_cast<std::size_t>(p)];
                }
                sum += static_cast<double>(row[k]) - z;
                row[k] = level;
            }
            sums[static_cast<std::size_t>(p)] = sum;
        }
    }
};

std::array<double, 3> place(const Move& m) { return {to_mm(m.x), to_mm(m.y), to_mm(m.z)}; }

}  // namespace

EngagedStock::EngagedStock(std::array<double, 2> min, std::array<double, 2> max, double top, double radius)
    : end_{CutterEnd::Form::flat, radius, 0}, top_(top) {
    const double cell =
        std::max(radius / kCellsARadius, std::sqrt((max[0] - min[0]) * (max[1] - min[1]) / kMostCells));
    grid_ = {min[0] + cell / 2, min[1] + cell / 2, cell,
             std::max(1, static_cast<int>(std::lround((max[0] - min[0]) / cell))),
             std::max(1, static_cast<int>(std::lround((max[1] - min[1]) / cell)))};
    height_.assign(grid_.count(), 0.0F);
}

double EngagedStock::cut(const std::array<double, 3>& from, const std::array<double, 3>& to) {
    std::vector<double> volume(1);
    cut(from, to, volume);
    return volume.front();
}

void EngagedStock::cut(const std::array<double, 3>& from, const std::array<double, 3>& to,
                       std::vector<double>& volumes) {
    const auto count = static_cast<int>(volumes.size());
    if (count > 1 && from[2] != to[2]) {  // a ramp, part by part
        std::array<double, 3> at = from;
        for (int k = 1; k <= count; ++k) {
            const double t = static_cast<double>(k) / count;
            const std::array<double, 3> next{from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1]),
                                             from[2] + t * (to[2] - from[2])};
            volumes[static_cast<std::size_t>(k - 1)] = cut(at, k == count ? to : next);
            at = next;
        }
        return;
    }
    // At one height only the cells between where the cutter is and where it gets need a look: under it
    // nothing stands any more.
    const bool been = from == last_;
    last_ = to;
    const double dx = to[0] - from[0], dy = to[1] - from[1], run = std::hypot(dx, dy);
    std::fill(volumes.begin(), volumes.end(), 0.0);
    Taking taking{grid_, height_.data(), {}, {from[0], from[1]}, volumes};
    if (run > 0) taking.way = {dx / run, dy / run, end_.radius, count / run, count};
    sweep_above(grid_, end_, {from[0], from[1], from[2] - top_}, {to[0], to[1], to[2] - top_},
                StandingHeights{height_.data(), 0}, taking, {.been = been});
    for (double& volume : volumes) volume *= grid_.cell * grid_.cell;
}

void EngagedStock::change_cutter(double radius) {
    end_.radius = radius;
    last_.fill(kUnbounded);
}

double cap_engagement(Context& context, std::vector<Move>& moves, EngagedStock& stock,
                      const EngagementCap& cap) {
    if (moves.size() < 2) return 0;
    const double window = cap.diameter / 8, slot = cap.diameter * cap.stepdown;
    Way way;
    way.starts.reserve(moves.size());
    way.lengths.reserve(moves.size());
    way.add(0, 0);          // there is no way to the first
    std::size_t begun = 0;  // first part of the window
    double volume = 0, length = 0;
    std::vector<double> volumes;
    auto close = [&](std::size_t end) {
        // The cutter is slowed by what it has met over the whole window.
        const double section = length > 0 ? volume / length : 0;
        int steps = kFeeds;
        if (section > cap.share * slot)
            steps = std::max(1, static_cast<int>(std::floor(kFeeds * cap.share * slot / section)));
        for (; begun < end; ++begun) way.steps[begun] = static_cast<std::uint8_t>(steps);
        volume = length = 0;
    };
    for (std::size_t i = 1; i < moves.size(); ++i) {
        const std::array<double, 3> a = place(moves[i - 1]), b = place(moves[i]);
        const double run = std::hypot(b[0] - a[0], b[1] - a[1]);
        if (i % 64 == 0) context.throw_if_cancelled();
        if (moves[i].feed == 0 || run == 0) {
            close(way.steps.size());
            if (moves[i].feed > 0) stock.cut(a, b);
            way.add(1, 0);
            begun = way.steps.size();
            continue;
        }
        const int parts = std::max(1, static_cast<int>(std::ceil(run / window)));
        volumes.resize(static_cast<std::size_t>(parts));
        stock.cut(a, b, volumes);
        std::size_t part = way.steps.size();
        way.add(parts, run / parts);
        for (const double taken : volumes) {
            volume += taken;
            length += run / parts;
            ++part;
            if (length >= window - 1e-9) close(part);
        }
    }
    close(way.steps.size());
    // Short ways at full feed between slow ones gain nothing but two changes of speed.
    for (std::size_t k = 0, move = 0; k < way.steps.size();) {
        while (way.end(move) <= k) ++move;
        if (way.steps[k] == kFeeds || way.lengths[move] == 0) {
            ++k;
            continue;
        }
        std::size_t next = k + 1, at = move;
        double between = 0;
        const auto cuts = [&] {  // whether there is a next part, and no rapid
            while (at < way.starts.size() && way.end(at) <= next) ++at;
            return at < way.starts.size() && way.lengths[at] > 0;
        };
        while (cuts() && way.steps[next] == kFeeds && between <= 2 * window)
            between += way.lengths[at], ++next;
        if (next > k + 1 && cuts() && way.steps[next] < kFeeds)
            for (std::size_t j = k + 1; j < next; ++j) way.steps[j] = std::max(way.steps[k], way.steps[next]);
        k = next;
    }
    std::vector<Move> result{moves.front()};
    result.reserve(moves.size());
    double slowed = 0;
    for (std::size_t i = 1; i < moves.size(); ++i) {
        const std::size_t first = way.starts[i], end = way.end(i);
        const std::array<double, 3> a = place(moves[i - 1]), b = place(moves[i]);
        for (std::size_t k = first; k < end; ++k) {
            const std::uint32_t steps = way.steps[k];
            const bool last = k + 1 == end;
            if (steps < kFeeds) slowed += way.lengths[i];
            if (!last && way.steps[k + 1] == steps) continue;
            Move m = moves[i];
            if (!last) {
                const double t = static_cast<double>(k + 1 - first) / static_cast<double>(end - first);
                m.x = to_units(a[0] + t * (b[0] - a[0]));
                m.y = to_units(a[1] + t * (b[1] - a[1]));
                m.z = to_units(a[2] + t * (b[2] - a[2]));
            }
            if (steps < kFeeds) m.feed = std::max<std::uint32_t>(1, moves[i].feed * steps / kFeeds);
            result.push_back(m);
        }
    }
    moves = std::move(result);
    return slowed;
}

}  // namespace slabwright
