#include "engine/sheets/near_part.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace slabwright {

namespace {

struct Vec2 {
    double x = 0, y = 0;
};

Vec2 to_vec(Point2 p) { return {p.x / kUnitsPerMm, p.y / kUnitsPerMm}; }
double length(Vec2 v) { return std::hypot(v.x, v.y); }

/// By how much the axis leans at a place, mm aside for each mm up.
Vec2 lean_of(const AxisLoop& axis, std::size_t i, double height) {
    const Vec2 top = to_vec(axis.top[i]), bottom = to_vec(axis.bottom[i]);
    return {(top.x - bottom.x) / height, (top.y - bottom.y) / height};
}

/// How far in the level the part must lie from a piece of the axis: half a kerf square to the surface that
/// the axis sweeps there. @param level the axis' points at a height
double need_beside(const AxisLoop& axis, const std::vector<Point2>& level, std::size_t i, double height,
                   double kerf) {
    const std::size_t next = (i + 1) % level.size();
    const Vec2 a = to_vec(level[i]), b = to_vec(level[next]);
    const double l = std::max(1e-6, std::hypot(b.x - a.x, b.y - a.y));
    double most = 0;
    for (const std::size_t end : {i, next}) {
        const Vec2 lean = lean_of(axis, end, height);
        most = std::max(most, std::abs(lean.x * (b.y - a.y) - lean.y * (b.x - a.x)) / l);
    }
    return kerf / 2 * std::hypot(1, most);
}

/// Of each point whether the region winds around it; those on its border count as either.
std::vector<bool> wound_around(const Loops& region, std::span<const Point2> points) {
    std::vector<std::size_t> order(points.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return points[a].y != points[b].y ? points[a].y < points[b].y : a < b;
    });
    std::vector<double> heights;
    for (const std::size_t i : order)
        if (heights.empty() || heights.back() != points[i].y) heights.push_back(points[i].y);
    const std::vector<std::vector<Span>> spans = line_spans(region, heights);
    std::vector<bool> inside(points.size(), false);
    std::size_t row = 0;
    for (const std::size_t i : order) {
        while (heights[row] < points[i].y) ++row;
        const auto& line = spans[row];
        const auto after = std::upper_bound(line.begin(), line.end(), double(points[i].x),
                                            [](double x, const Span& span) { return x < span.low; });
        inside[i] = after != line.begin() && points[i].x <= std::prev(after)->high;
    }
    return inside;
}

/// Of every vertex of every section, section by section, the loop of the outline that is nearest.
std::vector<std::size_t> nearest_loops(const Fitted& sheet) {
    std::vector<Loops> single(sheet.outline.size());
    std::vector<BorderDistance> borders;
    for (std::size_t l = 0; l < single.size(); ++l) {
        const auto loop = sheet.outline.loop(l);
        single[l].points.assign(loop.begin(), loop.end());
        single[l].close_loop();
        borders.emplace_back(single[l]);
    }
    std::vector<std::size_t> owners;
    for (const Loops* section : sheet.sections)
        for (const Point2 p : section->points) {
            std::size_t owner = 0;
            double nearest = 1e300;
            for (std::size_t l = 0; l < borders.size(); ++l) {
                const double d = borders.size() == 1 ? 0 : borders[l](p);
                if (d < nearest) nearest = d, owner = l;
            }
            owners.push_back(owner);
        }
    return owners;
}

}  // namespace

NearPart::NearPart(const Fitted& sheet, const Kerf& kerf)
    : sheet_(sheet), kerf_(kerf), owners_(nearest_loops(sheet)) {
    for (const Loops* section : sheet.sections) borders_.emplace_back(*section);
}

std::vector<double> NearPart::too_near(const AxisLoop& axis, double allowed) const {
    const double height = sheet_.heights.back() - sheet_.heights.front();
    const std::size_t n = axis.top.size();
    std::vector<double> lacks(n, 0);
    double widest = 0;
    for (std::size_t i = 0; i < n; ++i)
        widest = std::max(widest, kerf_.widest() / 2 * std::hypot(1, length(lean_of(axis, i, height))));
    std::size_t vertex = 0;
    for (std::size_t k = 0; k < sheet_.heights.size(); ++k) {
        Loops own;
        const double share = (sheet_.heights[k] - sheet_.heights.front()) / height, kerf = kerf_.at(share);
        own.points = axis_at(axis, share);
        own.close_loop();
        const BorderDistance to_axis(own);
        Loops around = own;  // what an outline holds, what a hole takes away
        if (axis.is_hole) std::reverse(around.points.begin(), around.points.end());
        const std::vector<bool> is_around = wound_around(around, sheet_.sections[k]->points);
        const std::vector<bool> is_in_part = wound_around(*sheet_.sections[k], own.points);
        for (std::size_t v = 0; v < sheet_.sections[k]->points.size(); ++v) {
            const Point2 p = sheet_.sections[k]->points[v];
            const bool is_own = owners_[vertex++] == static_cast<std::size_t>(axis.loop);
            const bool stays = !is_own || is_around[v] != axis.is_hole;
            const NearestEdge near = stays ? to_axis.nearest_within(p, widest) : to_axis.nearest(p);
            if (stays && near.distance >= widest - allowed) continue;
            const std::size_t next = (near.edge + 1) % own.points.size();
            const double need = need_beside(axis, own.points, near.edge, height, kerf);
            const double more = need + (stays ? -near.distance : near.distance);
            if (more <= allowed) continue;
            lacks[near.edge] = std::max(lacks[near.edge], more);
            lacks[next] = std::max(lacks[next], more);
        }
        for (std::size_t i = 0; i < own.points.size(); ++i) {
            const double need = std::max(need_beside(axis, own.points, i, height, kerf),
                                         need_beside(axis, own.points, (i + n - 1) % n, height, kerf));
            const double distance = is_in_part[i] ? borders_[k](own.points[i])
                                                  : borders_[k].nearest_within(own.points[i], need).distance;
            const double more = need + (is_in_part[i] ? distance : -distance);
            if (more > allowed) lacks[i] = std::max(lacks[i], more);
        }
    }
    return lacks;
}

}  // namespace slabwright
