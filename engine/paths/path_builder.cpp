#include "engine/paths/path_builder.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

PathBuilder::PathBuilder(Operation& operation, const Tool& tool, double feed, double clearance_z, double link_z)
    : operation_(operation),
      feed_(static_cast<std::uint32_t>(std::lround(std::min(feed, tool.max_feed)))),
      plunge_feed_(static_cast<std::uint32_t>(std::lround(tool.plunge_feed))),
      sink_feed_(static_cast<std::uint32_t>(std::lround(tool.max_feed))),
      clearance_(to_units(clearance_z)),
      link_(to_units(link_z)) {
    operation_.clearance_z = clearance_z;
}

void PathBuilder::add(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t feed) {
    if (started_ && x == x_ && y == y_ && z == z_) return;
    if (feed > 0 && !operation_.moves.empty()) {  // one long move instead of two that go on the same way along one axis
        Move& last = operation_.moves.back();
        const std::size_t n = operation_.moves.size();
        if (n >= 2 && last.feed == feed) {
            const Move& before = operation_.moves[n - 2];
            const std::int64_t ax = std::int64_t{last.x} - before.x, ay = std::int64_t{last.y} - before.y, az = std::int64_t{last.z} - before.z;
            const std::int64_t bx = std::int64_t{x} - last.x, by = std::int64_t{y} - last.y, bz = std::int64_t{z} - last.z;
            const int axes = (ax != 0) + (ay != 0) + (az != 0);
            const bool same = axes == 1 && (ax == 0) == (bx == 0) && (ay == 0) == (by == 0) && (az == 0) == (bz == 0);
            if (same && (ax > 0) == (bx > 0) && (ay > 0) == (by > 0) && (az > 0) == (bz > 0)) {
                last = {x, y, z, feed};
                x_ = x, y_ = y, z_ = z;
                return;
            }
        }
    }
    operation_.moves.push_back({x, y, z, feed});
    x_ = x, y_ = y, z_ = z;
    started_ = true;
}

void PathBuilder::go_above(Point2 p) {
    if (!started_) {
        add(p.x, p.y, clearance_, 0);
        z_ = clearance_;
        add(p.x, p.y, link_, 0);
        return;
    }
    if (down_) retract();
    add(p.x, p.y, link_, 0);
}

void PathBuilder::plunge(std::int32_t z) {
    add(x_, y_, z, plunge_feed_);
    down_ = true;
}

void PathBuilder::sink(std::int32_t z) {
    add(x_, y_, z, sink_feed_);
    down_ = true;
}

void PathBuilder::cut(Point2 to, std::int32_t z) {
    add(to.x, to.y, z, feed_);
    down_ = true;
}

void PathBuilder::retract() {
    if (!down_) return;
    add(x_, y_, link_, 0);
    down_ = false;
}

bool PathBuilder::finish() {
    if (!started_) return false;
    retract();
    add(x_, y_, clearance_, 0);
    return true;
}

std::vector<PathPoint> simplify(std::span<const PathPoint> line, double tolerance) {
    if (line.size() < 3) return {line.begin(), line.end()};
    std::vector<char> keep(line.size(), 0);
    keep.front() = keep.back() = 1;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, line.size() - 1}};
    const double tolerance2 = tolerance * tolerance;
    while (!open.empty()) {
        const auto [first, last] = open.back();
        open.pop_back();
        if (last - first < 2) continue;
        const double ax = line[first].x, ay = line[first].y, az = line[first].z;
        const double dx = line[last].x - ax, dy = line[last].y - ay, dz = line[last].z - az, l2 = dx * dx + dy * dy + dz * dz;
        double worst = -1;
        std::size_t at = first;
        for (std::size_t i = first + 1; i < last; ++i) {
            const double wx = line[i].x - ax, wy = line[i].y - ay, wz = line[i].z - az;
            const double t = l2 > 0 ? std::clamp((wx * dx + wy * dy + wz * dz) / l2, 0.0, 1.0) : 0.0;
            const double ex = wx - t * dx, ey = wy - t * dy, ez = wz - t * dz, d2 = ex * ex + ey * ey + ez * ez;
            if (d2 > worst) {
                worst = d2;
                at = i;
            }
        }
        if (worst <= tolerance2) continue;
        keep[at] = 1;
        open.push_back({first, at});
        open.push_back({at, last});
    }
    std::vector<PathPoint> result;
    for (std::size_t i = 0; i < line.size(); ++i)
        if (keep[i] && (result.empty() || !(result.back() == line[i]))) result.push_back(line[i]);
    return result;
}

}  // namespace slabwright
