#include "io/thinned_path.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace slabwright {

namespace {

constexpr std::size_t kRun = 1024;

double distance_from_line(const ReplayPoint& p, const ReplayPoint& a, const ReplayPoint& b) {
    const double ux = b.x - a.x, uy = b.y - a.y, uz = b.z - a.z, wx = p.x - a.x, wy = p.y - a.y, wz = p.z - a.z;
    const double uu = ux * ux + uy * uy + uz * uz;
    const double t = uu > 0 ? std::clamp((wx * ux + wy * uy + wz * uz) / uu, 0.0, 1.0) : 0;
    return std::hypot(wx - t * ux, wy - t * uy, wz - t * uz);
}

}  // namespace

std::vector<ReplayPoint> path_of(const Program& program, double rapid_feed) {
    std::vector<ReplayPoint> path;
    for (const ProgramStep& s : program.steps) {
        if (!s.known()) continue;
        ReplayPoint p{s.x, s.y, s.z, 0, s.rapid(), true};
        if (!path.empty()) {
            const ReplayPoint& from = path.back();
            const double way = std::hypot(p.x - from.x, p.y - from.y, p.z - from.z);
            if (way == 0) continue;
            p.seconds = from.seconds + way / (s.rapid() ? rapid_feed : s.feed) * 60;
        }
        path.push_back(p);
    }
    return path;
}

void thin(std::vector<ReplayPoint>& path, double tolerance_mm) {
    if (path.size() < 3) return;
    for (ReplayPoint& p : path) p.kept = false;
    path.front().kept = path.back().kept = true;
    std::vector<std::pair<std::size_t, std::size_t>> open;
    for (std::size_t begin = 0; begin + 1 < path.size();) {
        std::size_t end = begin + 1;
        while (end + 1 < path.size() && end - begin < kRun && path[end + 1].rapid == path[end].rapid) ++end;
        path[begin].kept = path[end].kept = true;
        open.emplace_back(begin, end);
        while (!open.empty()) {
            const auto [a, b] = open.back();
            open.pop_back();
            std::size_t farthest = a;
            double most = tolerance_mm;
            for (std::size_t k = a + 1; k < b; ++k)
                if (const double d = distance_from_line(path[k], path[a], path[b]); d > most) most = d, farthest = k;
            if (farthest == a) continue;
            path[farthest].kept = true;
            open.emplace_back(a, farthest);
            open.emplace_back(farthest, b);
        }
        begin = end;
    }
    std::erase_if(path, [](const ReplayPoint& p) { return !p.kept; });
}

}  // namespace slabwright
