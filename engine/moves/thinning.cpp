#include "engine/moves/thinning.h"

#include <algorithm>
#include <cmath>

#include "kernels/polygons/farthest.h"

namespace slabwright {

namespace {

// Of each point of a line, whether it stays.
std::vector<char> kept_within(std::span<const PathPoint> line, double tolerance) {
    std::vector<char> keep(line.size(), 0);
    keep.front() = keep.back() = 1;
    PointRows rows;
    for (std::vector<double>* row : {&rows.x, &rows.y, &rows.z}) row->reserve(line.size());
    for (const PathPoint& p : line) rows.x.push_back(p.x), rows.y.push_back(p.y), rows.z.push_back(p.z);
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, line.size() - 1}};
    const double tolerance2 = tolerance * tolerance;
    while (!open.empty()) {
        const auto [first, last] = open.back();
        open.pop_back();
        if (last - first < 2) continue;
        const Farthest farthest = farthest_between(rows, first, last);
        if (farthest.distance2 <= tolerance2) continue;
        keep[farthest.at] = 1;
        open.push_back({first, farthest.at});
        open.push_back({farthest.at, last});
    }
    return keep;
}

std::vector<PathPoint> kept_points(std::span<const PathPoint> line, std::span<const char> keep) {
    std::vector<PathPoint> result;
    for (std::size_t i = 0; i < line.size(); ++i)
        if (keep[i] && (result.empty() || !(result.back() == line[i]))) result.push_back(line[i]);
    return result;
}

// The change of direction from a to b to c, seen from above; none where two of them are one.
double turn_at(const PathPoint& a, const PathPoint& b, const PathPoint& c) {
    const double ux = static_cast<double>(b.x) - a.x, uy = static_cast<double>(b.y) - a.y,
                 vx = static_cast<double>(c.x) - b.x, vy = static_cast<double>(c.y) - b.y;
    return std::abs(std::atan2(ux * vy - uy * vx, ux * vx + uy * vy));
}

}  // namespace

std::vector<PathPoint> simplify(std::span<const PathPoint> line, double tolerance) {
    if (line.size() < 3) return {line.begin(), line.end()};
    return kept_points(line, kept_within(line, tolerance));
}

Loops thinned(const Loops& loops, double mm) {
    Loops result;
    std::vector<PathPoint> ring;
    for (std::size_t i = 0; i < loops.size(); ++i) {
        ring.clear();
        for (const Point2 p : loops.loop(i)) ring.push_back({p.x, p.y, 0});
        if (ring.empty()) continue;
        ring.push_back(ring.front());
        const std::vector<PathPoint> kept = simplify(ring, mm * kUnitsPerMm);
        if (kept.size() < 4) continue;
        for (std::size_t k = 0; k + 1 < kept.size(); ++k) result.points.push_back({kept[k].x, kept[k].y});
        result.close_loop();
    }
    return result;
}

std::vector<PathPoint> simplify(std::span<const PathPoint> line, double fine, double loose, double turn) {
    if (line.size() < 3) return {line.begin(), line.end()};
    // What stays of the finely thinned line within the wider tolerance is a part of it.
    std::vector<PathPoint> finely = kept_points(line, kept_within(line, fine));
    if (finely.size() < 3) return finely;
    std::vector<char> keep = kept_within(finely, loose);
    std::vector<std::size_t> corners;
    for (std::size_t i = 0; i < finely.size(); ++i)
        if (keep[i]) corners.push_back(i);
    for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
        const std::size_t a = corners[k - 1], b = corners[k], c = corners[k + 1];
        const double sharp = turn_at(finely[a], finely[b], finely[c]);
        // A corner of the line itself is no less sharp between short chords.
        if (sharp <= turn || turn_at(finely[b - 1], finely[b], finely[b + 1]) > 0.9 * sharp) continue;
        std::fill(keep.begin() + static_cast<std::ptrdiff_t>(a),
                  keep.begin() + static_cast<std::ptrdiff_t>(c), 1);
    }
    return kept_points(finely, keep);
}

double fast_turn(const Machine& machine, double feed, double blend) {
    return std::sqrt(8 * level_acceleration(machine) * blend) * 60 / feed;
}

}  // namespace slabwright
