#include "engine/moves/thinning.h"

#include <algorithm>
#include <cmath>

#include "kernels/polygons/thinned.h"

namespace slabwright {

namespace {

PointRows rows_of(std::span<const PathPoint> line) {
    PointRows rows;
    for (std::vector<double>* row : {&rows.x, &rows.y, &rows.z}) row->reserve(line.size());
    for (const PathPoint& p : line) rows.x.push_back(p.x), rows.y.push_back(p.y), rows.z.push_back(p.z);
    return rows;
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
    return kept_points(line, kept_within(rows_of(line), tolerance));
}

std::vector<PathPoint> simplify(std::span<const PathPoint> line, double fine, double loose, double turn) {
    if (line.size() < 3) return {line.begin(), line.end()};
    // What stays of the finely thinned line within the wider tolerance is a part of it.
    std::vector<PathPoint> finely = kept_points(line, kept_within(rows_of(line), fine));
    if (finely.size() < 3) return finely;
    std::vector<char> keep = kept_within(rows_of(finely), loose);
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
