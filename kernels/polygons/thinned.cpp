#include "kernels/polygons/thinned.h"

#include <cstddef>
#include <utility>

namespace slabwright {

std::vector<char> kept_within(const PointRows& line, double tolerance) {
    const std::size_t count = line.x.size();
    std::vector<char> keep(count, 0);
    keep.front() = keep.back() = 1;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, count - 1}};
    const double tolerance2 = tolerance * tolerance;
    while (!open.empty()) {
        const auto [first, last] = open.back();
        open.pop_back();
        if (last - first < 2) continue;
        const Farthest farthest = farthest_between(line, first, last);
        if (farthest.distance2 <= tolerance2) continue;
        keep[farthest.at] = 1;
        open.push_back({first, farthest.at});
        open.push_back({farthest.at, last});
    }
    return keep;
}

Loops thinned(const Loops& loops, double mm) {
    Loops result;
    PointRows rows;
    for (std::size_t i = 0; i < loops.size(); ++i) {
        const auto loop = loops.loop(i);
        if (loop.size() < 3) continue;
        for (std::vector<double>* row : {&rows.x, &rows.y, &rows.z}) row->clear();
        const auto add = [&](Point2 p) { rows.x.push_back(p.x), rows.y.push_back(p.y), rows.z.push_back(0); };
        for (const Point2 p : loop) add(p);
        add(loop.front());
        const std::vector<char> keep = kept_within(rows, mm * kUnitsPerMm);
        const std::size_t begin = result.points.size();
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const bool repeats = result.points.size() > begin && result.points.back() == loop[k];
            if (keep[k] != 0 && !repeats) result.points.push_back(loop[k]);
        }
        if (result.points.size() > begin && result.points.back() == loop.front()) result.points.pop_back();
        if (result.points.size() < begin + 3) result.points.resize(begin);
        else result.close_loop();
    }
    return result;
}

Loops lighter(Loops loops) {
    constexpr std::size_t most = 20'000;
    constexpr double gap_mm = 0.005;
    if (loops.points.size() > most) loops = simplify(thinned(loops, gap_mm));
    return loops;
}

}  // namespace slabwright
