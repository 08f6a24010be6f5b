#include "engine/paths/runs/level_runs.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/moves/order.h"
#include "engine/paths/runs/leads.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

// Runs that lie within `reach` (0.1 µm) of each other, on whichever level, belong to one region, and so do
// those that a chain of such neighbours joins (some that lie up to four times as far apart as well). Regions
// may be cut one after the other, each from its top down. Gives the lowest run of each run's region, runs
// counted through all levels.
std::vector<std::uint32_t> regions(const std::vector<std::vector<LevelRun>>& levels, std::int32_t reach) {
    std::vector<std::uint32_t> parent;
    auto root = [&](std::uint32_t k) {
        while (parent[k] != k) k = parent[k] = parent[parent[k]];
        return k;
    };
    auto join = [&](std::uint32_t a, std::uint32_t b) {
        a = root(a);
        b = root(b);
        parent[std::max(a, b)] = std::min(a, b);
    };
    struct Visit {
        std::int32_t x, y;
        std::uint32_t run;
    };
    std::vector<Visit> cells;
    auto cell = [&](double v) { return static_cast<std::int32_t>(std::floor(v / reach)); };
    for (const std::vector<LevelRun>& level : levels)
        for (const LevelRun& run : level) {
            const auto id = static_cast<std::uint32_t>(parent.size());
            parent.push_back(id);
            for (std::size_t k = 0; k < run.points.size(); ++k) {
                const PathPoint &p = run.points[k], &q = run.points[k == 0 ? 0 : k - 1];
                const int steps = 1 + static_cast<int>(std::hypot(static_cast<double>(p.x) - q.x,
                                                                  static_cast<double>(p.y) - q.y) /
                                                       reach * 2);
                for (int s = 0; s < steps; ++s) {
                    const double t = static_cast<double>(s) / steps;
                    const Visit v{cell(p.x + t * (static_cast<double>(q.x) - p.x)),
                                  cell(p.y + t * (static_cast<double>(q.y) - p.y)), id};
                    if (cells.empty() || cells.back().x != v.x || cells.back().y != v.y ||
                        cells.back().run != id)
                        cells.push_back(v);
                }
            }
        }
    std::sort(cells.begin(), cells.end(), [](const Visit& a, const Visit& b) {
        return std::tie(a.x, a.y, a.run) < std::tie(b.x, b.y, b.run);
    });
    auto first_of = [&](std::int32_t x, std::int32_t y) {
        return std::lower_bound(cells.begin(), cells.end(), std::pair{x, y},
                                [](const Visit& v, const std::pair<std::int32_t, std::int32_t>& at) {
                                    return std::pair{v.x, v.y} < at;
                                });
    };
    for (std::size_t k = 0; k < cells.size(); ++k) {
        if (k > 0 && cells[k - 1].x == cells[k].x && cells[k - 1].y == cells[k].y) {
            join(cells[k - 1].run, cells[k].run);
            continue;
        }
        for (const auto& [dx, dy] : {std::pair{0, 1}, {1, -1}, {1, 0}, {1, 1}}) {
            const auto near = first_of(cells[k].x + dx, cells[k].y + dy);
            if (near != cells.end() && near->x == cells[k].x + dx && near->y == cells[k].y + dy)
                join(near->run, cells[k].run);
        }
    }
    for (std::uint32_t k = 0; k < parent.size(); ++k) parent[k] = root(k);
    return parent;
}

// One level of one region, the nearest run first; `runs` has as many entries as there are beginnings of
// theirs. Open runs keep their direction, with the part on the right; closed ones are begun at their point
// nearest to the tool.
void cut_level(PathBuilder& path, const LayerCut& cut, const DropIndex& part, double chord, bool leads,
               std::vector<LevelRun*>& runs) {
    std::vector<Beginning> beginnings;
    for (std::uint32_t i = 0; i < runs.size(); ++i) {
        const std::vector<PathPoint>& points = runs[i]->points;
        if (!runs[i]->closed) {
            beginnings.push_back({{points[0].x, points[0].y}, {points.back().x, points.back().y}, i, 0});
            continue;
        }
        double since = kUnbounded;
        for (std::uint32_t p = 0; p + 1 < points.size(); ++p) {
            if (p > 0)
                since += std::hypot(static_cast<double>(points[p].x) - points[p - 1].x,
                                    static_cast<double>(points[p].y) - points[p - 1].y);
            if (since < 2 * kUnitsPerMm) continue;
            since = 0;
            const Point2 at{points[p].x, points[p].y};
            beginnings.push_back({at, at, i, p});
        }
    }
    NearestRuns left(std::move(beginnings), runs.size());
    while (!left.empty()) {
        const Beginning next = left.nearest(path.at());
        left.remove(next.run);
        const LevelRun& run = *runs[next.run];
        std::vector<PathPoint> points = run.points;
        if (!run.closed) {
            if (leads) add_leads(path, cut, part, chord, points);
        } else {
            // Where there is no room for an arc, perhaps elsewhere around the contour.
            constexpr std::size_t tries = 6;
            const std::size_t n = run.points.size() - 1;
            for (std::size_t attempt = 0; attempt <= tries; ++attempt) {
                const std::size_t first = (next.place + attempt % tries * n / tries) % n;
                points.assign(run.points.begin(), run.points.end() - 1);
                std::rotate(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(first),
                            points.end());
                points.push_back(points.front());
                if (!leads || add_leads(path, cut, part, chord, points)) break;
            }
        }
        path.follow(points);
    }
}

}  // namespace

void append_level_runs(const Contours& contours, std::size_t c, std::int32_t z,
                       const std::vector<char>& wanted, double tolerance, std::vector<LevelRun>& out) {
    const std::size_t first = contours.starts[c], n = contours.starts[c + 1] - first;
    if (n < 2) return;
    std::size_t start = n;
    for (std::size_t k = 0; k < n && start == n; ++k)
        if (!wanted[k]) start = k;
    auto point = [&](std::size_t k) {
        const Point2 p = contours.points[first + k % n];
        return PathPoint{p.x, p.y, z};
    };
    if (start == n) {
        LevelRun run;
        for (std::size_t k = 0; k <= n; ++k) run.points.push_back(point(k));
        run.points = simplify(run.points, tolerance);
        run.closed = true;
        if (run.points.size() > 2) out.push_back(std::move(run));
        return;
    }
    for (std::size_t k = 0; k < n;) {
        if (!wanted[(start + k) % n]) {
            ++k;
            continue;
        }
        LevelRun run;
        for (; k < n && wanted[(start + k) % n]; ++k) run.points.push_back(point(start + k));
        if (run.points.size() < 2) continue;
        run.points = simplify(run.points, tolerance);
        out.push_back(std::move(run));
    }
}

void cut_levels(PathBuilder& path, const LayerCut& cut, const Tool& tool, const DropIndex& part,
                std::vector<std::vector<LevelRun>>& levels, bool leads) {
    const double chord = safe_chord_mm(tool.diameter / 2, cut.job.tolerances.gouge);
    const std::vector<std::uint32_t> region = regions(levels, to_units(tool.diameter));
    struct Member {
        std::uint32_t region;
        std::size_t level;
        LevelRun* run;
    };
    std::vector<Member> members;
    for (std::size_t l = 0; l < levels.size(); ++l)
        for (LevelRun& run : levels[l]) members.push_back({region[members.size()], l, &run});
    std::stable_sort(members.begin(), members.end(), [](const Member& a, const Member& b) {
        return std::tie(a.region, a.level) < std::tie(b.region, b.level);
    });
    std::vector<std::size_t> first;
    std::vector<Beginning> beginnings;
    for (std::size_t k = 0; k < members.size(); ++k) {
        if (k == 0 || members[k].region != members[k - 1].region) first.push_back(k);
        if (members[k].level != members[first.back()].level) continue;
        const PathPoint& p = members[k].run->points.front();
        beginnings.push_back({{p.x, p.y},
                              {p.x, p.y},
                              static_cast<std::uint32_t>(first.size() - 1),
                              static_cast<std::uint32_t>(k)});
    }
    NearestRuns left(std::move(beginnings), first.size());
    first.push_back(members.size());
    while (!left.empty()) {
        const std::uint32_t next = left.nearest(path.at()).run;
        left.remove(next);
        std::vector<LevelRun*> level;
        for (std::size_t k = first[next]; k < first[next + 1]; ++k) {
            level.push_back(members[k].run);
            if (k + 1 < first[next + 1] && members[k + 1].level == members[k].level) continue;
            cut_level(path, cut, part, chord, leads, level);
            level.clear();
        }
        cut.context.throw_if_cancelled();
    }
}

}  // namespace slabwright
