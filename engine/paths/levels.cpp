// Finishing by level contours: the ball end mill on slopes of 45° and more, the flat end mill on vertical walls. Of every
// contour only the stretches are cut whose contact lies on such a surface, within the layer.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include <fmt/format.h>

#include "engine/paths/layer_cut.h"
#include "engine/paths/order.h"
#include "kernels/cutting/cusp.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// An open or closed stretch of a contour; closed ones repeat their first point at the end.
struct Run {
    std::vector<PathPoint> points;
    bool closed = false;
};

// Cuts one contour into the stretches of its wanted points.
void append_runs(const Contours& contours, std::size_t c, std::int32_t z, const std::vector<char>& wanted, double tolerance, std::vector<Run>& out) {
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
        Run run;
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
        Run run;
        for (; k < n && wanted[(start + k) % n]; ++k) run.points.push_back(point(start + k));
        if (run.points.size() < 2) continue;
        run.points = simplify(run.points, tolerance);
        out.push_back(std::move(run));
    }
}

// Runs that lie within `reach` (0.1 µm) of each other, on whichever level, belong to one region, and so do those that a chain
// of such neighbours joins (some that lie up to four times as far apart as well). Regions may be cut one after the other, each
// from its top down. Gives the lowest run of each run's region, runs counted through all levels.
std::vector<std::uint32_t> regions(const std::vector<std::vector<Run>>& levels, std::int32_t reach) {
    std::vector<std::uint32_t> parent;
    auto root = [&](std::uint32_t k) {
        while (parent[k] != k) k = parent[k] = parent[parent[k]];
        return k;
    };
    auto join = [&](std::uint32_t a, std::uint32_t b) {
        a = root(a), b = root(b);
        parent[std::max(a, b)] = std::min(a, b);
    };
    struct Visit {
        std::int32_t x, y;
        std::uint32_t run;
    };
    std::vector<Visit> cells;
    auto cell = [&](double v) { return static_cast<std::int32_t>(std::floor(v / reach)); };
    for (const std::vector<Run>& level : levels)
        for (const Run& run : level) {
            const auto id = static_cast<std::uint32_t>(parent.size());
            parent.push_back(id);
            for (std::size_t k = 0; k < run.points.size(); ++k) {
                const PathPoint &p = run.points[k], &q = run.points[k == 0 ? 0 : k - 1];
                const int steps = 1 + static_cast<int>(std::hypot(static_cast<double>(p.x) - q.x, static_cast<double>(p.y) - q.y) / reach * 2);
                for (int s = 0; s < steps; ++s) {
                    const double t = static_cast<double>(s) / steps;
                    const Visit v{cell(p.x + t * (static_cast<double>(q.x) - p.x)), cell(p.y + t * (static_cast<double>(q.y) - p.y)), id};
                    if (cells.empty() || cells.back().x != v.x || cells.back().y != v.y || cells.back().run != id) cells.push_back(v);
                }
            }
        }
    std::sort(cells.begin(), cells.end(), [](const Visit& a, const Visit& b) { return std::tie(a.x, a.y, a.run) < std::tie(b.x, b.y, b.run); });
    auto first_of = [&](std::int32_t x, std::int32_t y) {
        return std::lower_bound(cells.begin(), cells.end(), std::pair{x, y}, [](const Visit& v, const std::pair<std::int32_t, std::int32_t>& at) {
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
            if (near != cells.end() && near->x == cells[k].x + dx && near->y == cells[k].y + dy) join(near->run, cells[k].run);
        }
    }
    for (std::uint32_t k = 0; k < parent.size(); ++k) parent[k] = root(k);
    return parent;
}

// One level of one region, the nearest run first; `runs` has as many entries as there are beginnings of theirs. Open runs keep
// their direction, with the part on the right; closed ones are begun at their point nearest to the tool.
void cut_level(PathBuilder& path, const LayerCut& cut, const DropIndex& part, double chord, std::vector<Run*>& runs) {
    std::vector<Beginning> beginnings;
    for (std::uint32_t i = 0; i < runs.size(); ++i) {
        const std::vector<PathPoint>& points = runs[i]->points;
        if (!runs[i]->closed) {
            beginnings.push_back({{points[0].x, points[0].y}, {points.back().x, points.back().y}, i, 0});
            continue;
        }
        double since = 1e300;
        for (std::uint32_t p = 0; p + 1 < points.size(); ++p) {
            if (p > 0) since += std::hypot(static_cast<double>(points[p].x) - points[p - 1].x, static_cast<double>(points[p].y) - points[p - 1].y);
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
        const Run& run = *runs[next.run];
        std::vector<PathPoint> points = run.points;
        if (!run.closed) {
            add_leads(path, cut, part, chord, points);
        } else {
            // Where there is no room for an arc, perhaps elsewhere around the contour.
            constexpr std::size_t tries = 6;
            const std::size_t n = run.points.size() - 1;
            for (std::size_t attempt = 0; attempt <= tries; ++attempt) {
                const std::size_t first = (next.place + attempt % tries * n / tries) % n;
                points.assign(run.points.begin(), run.points.end() - 1);
                std::rotate(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(first), points.end());
                points.push_back(points.front());
                if (add_leads(path, cut, part, chord, points)) break;
            }
        }
        path.follow(points);
    }
}

void cut_levels(PathBuilder& path, const LayerCut& cut, const Tool& tool, const DropIndex& part, std::vector<std::vector<Run>>& levels) {
    const double chord = safe_chord_mm(tool.diameter / 2, cut.job.tolerances.gouge);
    const std::vector<std::uint32_t> region = regions(levels, to_units(tool.diameter));
    struct Member {
        std::uint32_t region;
        std::size_t level;
        Run* run;
    };
    std::vector<Member> members;
    for (std::size_t l = 0; l < levels.size(); ++l)
        for (Run& run : levels[l]) members.push_back({region[members.size()], l, &run});
    std::stable_sort(members.begin(), members.end(),
                     [](const Member& a, const Member& b) { return std::tie(a.region, a.level) < std::tie(b.region, b.level); });
    std::vector<std::size_t> first;
    std::vector<Beginning> beginnings;
    for (std::size_t k = 0; k < members.size(); ++k) {
        if (k == 0 || members[k].region != members[k - 1].region) first.push_back(k);
        if (members[k].level != members[first.back()].level) continue;
        const PathPoint& p = members[k].run->points.front();
        beginnings.push_back({{p.x, p.y}, {p.x, p.y}, static_cast<std::uint32_t>(first.size() - 1), static_cast<std::uint32_t>(k)});
    }
    NearestRuns left(std::move(beginnings), first.size());
    first.push_back(members.size());
    while (!left.empty()) {
        const std::uint32_t next = left.nearest(path.at()).run;
        left.remove(next);
        std::vector<Run*> level;
        for (std::size_t k = first[next]; k < first[next + 1]; ++k) {
            level.push_back(members[k].run);
            if (k + 1 < first[next + 1] && members[k + 1].level == members[k].level) continue;
            cut_level(path, cut, part, chord, level);
            level.clear();
        }
        cut.context.throw_if_cancelled();
    }
}

// Whether a ball that touches a wall this far over the layer's bottom, and none below, leaves more than the cusp where the wall
// reaches the bottom: the pass under it is needed then, though its contact lies in the layer below, on the wall that is there already.
bool leaves_foot(double r, double nz, double above_bottom, double cusp) {
    const double along = above_bottom / std::sqrt(1 - nz * nz);
    return along > 0 && (along >= r || r - std::sqrt(r * r - along * along) > cusp);
}

double vertical_nz(const LayerCut& cut) { return std::cos(cut.job.cutting.vertical_deg * std::numbers::pi / 180); }

}  // namespace

Operation finish_walls(const LayerCut& cut) {
    const Tool& tool = cut.layer.tools.rough;
    Operation op = cut.operation(OperationKind::finish, "vertical walls", tool);
    const double r = tool.diameter / 2, gouge = cut.job.tolerances.gouge, vertical = vertical_nz(cut);
    double low = 1e300, high = -1e300;  // of the vertical facets
    for (const SolidFacet& f : cut.solid.facets) {
        if (f.nz > vertical || f.z_max <= cut.layer.z_bottom || (f.normal[0] == 0 && f.normal[1] == 0 && f.nz >= 0)) continue;
        low = std::min(low, std::max(f.z_min, cut.layer.z_bottom));
        high = std::max(high, f.z_max);
    }
    if (low >= high) return op;
    // One level on every floor and on the layer's bottom, so that a wall is cut down to where it stands.
    std::vector<double> fixed{cut.layer.z_bottom};
    fixed.insert(fixed.end(), cut.floors.begin(), cut.floors.end());
    std::sort(fixed.begin(), fixed.end(), std::greater<>());
    fixed.erase(std::unique(fixed.begin(), fixed.end()), fixed.end());
    std::vector<double> tips;
    double z = high;
    for (const double f : fixed) {
        if (f >= high) continue;
        const int steps = std::max(1, static_cast<int>(std::ceil((z - f) / tool.stepdown_max - 1e-9)));
        for (int k = 1; k <= steps; ++k) {
            const double tip = k == steps ? f : z - (z - f) * k / steps;
            op.stepdown = std::max(op.stepdown, (z - f) / steps);
            tips.push_back(tip);
            if (tip < low) break;
        }
        z = f;
        if (tips.back() < low) break;
    }
    const Cutter cutter{Cutter::Profile::flat, r};
    const std::vector<Contours> contours = cut.contours(cutter, tips, safe_pitch(r, gouge));
    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed), cut.layer.z_top + cut.job.machine.clearance,
                     cut.layer.z_top + 2);
    const DropIndex& part = cut.drops(cutter);
    path.know(cut.around(tool, &part));
    std::vector<std::vector<Run>> runs(tips.size());
    for (std::size_t i = 0; i < tips.size(); ++i)
        for (std::size_t c = 0; c < contours[i].size(); ++c) {
            std::vector<char> wanted;
            for (std::size_t k = contours[i].starts[c]; k < contours[i].starts[c + 1]; ++k)
                wanted.push_back(contours[i].nz[k] <= vertical);  // under an overhang the shadow's border is the wall
            append_runs(contours[i], c, to_units(tips[i]), wanted, simplify_tolerance_units(gouge), runs[i]);
        }
    cut_levels(path, cut, tool, part, runs);
    path.finish();
    return op;
}

Operation finish_levels(const LayerCut& cut, std::vector<Diagnostic>& diagnostics) {
    const Tool& tool = cut.layer.tools.finish;
    Operation op = cut.operation(OperationKind::finish, "level contours", tool);
    const double r = tool.diameter / 2, gouge = cut.job.tolerances.gouge, vertical = vertical_nz(cut), degree = std::numbers::pi / 180;
    const FinishSlopes slopes = finish_slopes(cut.job.cutting);
    const double split = slopes.levels_from;
    if (split > std::numbers::pi / 2) return op;
    double low = 1e300, high = -1e300;
    bool any_vertical = false;
    for (const SolidFacet& f : cut.solid.facets) {
        if (f.nz > std::cos(split) || f.z_max <= cut.layer.z_bottom || (f.normal[0] == 0 && f.normal[1] == 0 && f.nz >= 0)) continue;
        any_vertical |= f.nz <= vertical;
        low = std::min(low, std::max(f.z_min, cut.layer.z_bottom));
        high = std::max(high, f.z_max);
    }
    if (low >= high) return op;

    // From the highest tip that may touch, down to the lowest whose contact is still in the layer.
    std::vector<double> tips;
    const double lowest = std::max(cut.layer.floor_below, low - r);
    double bite = 0;
    for (double z = high; z > lowest;) {
        const bool everywhere = cut.job.cutting.uniform_steps;
        const double alpha = cut.least_slope(everywhere ? low : z - tool.stepdown_max, everywhere ? high : std::min(high, z + r), slopes.levels_keep);
        double step = std::min(ball_level_stepdown(r, alpha, cut.job.tolerances.cusp), tool.stepdown_max);
        if (step < cut.job.cutting.min_stepdown) {
            bite = std::max(bite, ball_level_cusp(r, alpha, cut.job.cutting.min_stepdown));
            step = cut.job.cutting.min_stepdown;
        }
        z = std::max(z - step, lowest);
        op.stepdown = std::max(op.stepdown, step);
        tips.push_back(z);
    }
    // The foot of a wall on a floor is a hollow: the ball turns from wall to floor within a small part of a step. Levels
    // close above every floor cut what lies there, and only that.
    const std::size_t regular = tips.size();
    for (const Feature* flat : cut.layer.feet)
        for (double above = tool.stepdown_max / 4; above > 0.02; above /= 2)
            if (flat->z_low + above < high && flat->z_low + above > lowest) tips.push_back(flat->z_low + above);
    std::sort(tips.begin() + static_cast<std::ptrdiff_t>(regular), tips.end(), std::greater<>());
    tips.erase(std::unique(tips.begin() + static_cast<std::ptrdiff_t>(regular), tips.end()), tips.end());
    const double foot_nz = std::cos(80 * degree);

    if (bite > 0)
        diagnostics.push_back({Severity::warning,
                               "finish.stepdown_floor",
                               fmt::format("layer {}: the smallest stepdown {:.2f} mm leaves a cusp of up to {:.3f} mm", cut.layer.index,
                                           cut.job.cutting.min_stepdown, bite),
                               {}});

    const Cutter cutter{Cutter::Profile::ball, r};
    const std::vector<Contours> contours = cut.contours(cutter, tips, safe_pitch(r, gouge));
    // A vertical wall belongs to the flat end mill wherever that can stand against the place of contact.
    std::unique_ptr<DropIndex> flat;
    double flat_r = 0;
    if (any_vertical) {
        flat_r = cut.layer.tools.rough.diameter / 2;
        flat = std::make_unique<DropIndex>(cut.context, cut.solid, Cutter{Cutter::Profile::flat, flat_r - 0.02});
    }
    std::vector<std::vector<Run>> runs(tips.size());
    parallel_each(cut.context, tips.size(), [&](std::size_t i) {
        const Contours& level = contours[i];
        for (std::size_t c = 0; c < level.size(); ++c) {
            const std::size_t first = level.starts[c], n = level.starts[c + 1] - first;
            std::vector<char> wanted(n, 0);
            for (std::size_t k = 0; k < n; ++k) {
                const double nz = std::max(0.0F, level.nz[first + k]), contact = tips[i] + r * (1 - nz);
                if (nz > std::cos(split) || contact > cut.layer.z_top + 1e-6) continue;
                if (contact < cut.layer.z_bottom - 0.05 &&
                    (i == 0 || i >= regular || !leaves_foot(r, nz, tips[i - 1] + r * (1 - nz) - cut.layer.z_bottom, cut.job.tolerances.cusp)))
                    continue;
                if (i >= regular && nz < foot_nz) continue;
                wanted[k] = 1;
                if (!flat || nz > vertical) continue;
                const Point2 a = level.points[first + (k + n - 1) % n], p = level.points[first + k], b = level.points[first + (k + 1) % n];
                const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y, l = std::hypot(dx, dy);
                if (l == 0) continue;
                // The solid is on the right, so the free side is on the left.
                const Rest rest = flat->drop(to_mm(p.x) - dy / l * (flat_r - r), to_mm(p.y) + dx / l * (flat_r - r));
                if (rest.tip_z <= contact) wanted[k] = 0;
            }
            append_runs(level, c, to_units(tips[i]), wanted, simplify_tolerance_units(gouge), runs[i]);
        }
    });
    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed), cut.layer.z_top + cut.job.machine.clearance,
                     cut.layer.z_top + 2);
    const DropIndex& part = cut.drops(cutter);
    path.know(cut.around(tool, &part));
    cut_levels(path, cut, tool, part, runs);
    path.finish();
    return op;
}

}  // namespace slabwright
