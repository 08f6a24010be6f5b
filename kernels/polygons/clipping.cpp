// Booleans and offsets, by polyclipping. Its units are ours (0.1 µm), which keeps it in its fast range up to
// 107 m.
#include <polyclipping/clipper.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "kernels/errors.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

namespace {

using ClipperLib::cInt;
using ClipperLib::IntPoint;
using ClipperLib::Path;
using ClipperLib::Paths;

/// Loops without repeated points; what has fewer than three left encloses nothing.
Paths to_paths(const Loops& loops) {
    Paths paths;
    paths.reserve(loops.size());
    for (std::size_t i = 0; i < loops.size(); ++i) {
        Path path;
        path.reserve(loops.loop(i).size());
        for (const Point2 p : loops.loop(i))
            if (path.empty() || path.back() != IntPoint(p.x, p.y)) path.emplace_back(p.x, p.y);
        while (path.size() > 1 && path.back() == path.front()) path.pop_back();
        if (path.size() >= 3) paths.push_back(std::move(path));
    }
    return paths;
}

std::int32_t checked(cInt value) {
    if (value < std::numeric_limits<std::int32_t>::min() ||
        value > std::numeric_limits<std::int32_t>::max()) {
        throw Error(ErrorKind::usage, "polygons.range", "a polygon reaches past 214 m from the origin", {},
                    "check the units, or use a smaller offset");
    }
    return static_cast<std::int32_t>(value);
}

/// Turns loops as they lie: outer ones counter-clockwise, holes clockwise. polyclipping decides which is
/// which by what lies to the left of a loop's start, and where edges run within its unit of one another that
/// may be wrong: an outline of a quarter of a square metre came back as a hole. Loops that its rounding alone
/// explains stay as they are.
void turn_as_nested(Loops& loops) {
    std::vector<bool> hole(loops.size());
    std::vector<std::size_t> by_size(loops.size());
    std::iota(by_size.begin(), by_size.end(), std::size_t{0});
    std::vector<double> areas(loops.size());
    for (std::size_t i = 0; i < loops.size(); ++i) areas[i] = signed_area(loops.loop(i));
    // A parent is never smaller than what it holds, and of two alike the one of the lower number.
    std::stable_sort(by_size.begin(), by_size.end(),
                     [&](std::size_t a, std::size_t b) { return std::fabs(areas[a]) > std::fabs(areas[b]); });
    for (const std::size_t i : by_size) {
        const std::int32_t parent = loops.parents[i];
        hole[i] = parent >= 0 && !hole[static_cast<std::size_t>(parent)];
        if (hole[i] == (areas[i] < 0)) continue;
        const auto first = loops.points.begin() + loops.starts[i],
                   last = loops.points.begin() + loops.starts[i + 1];
        double around = 0;  // mm
        for (auto p = first; p != last; ++p) {
            const Point2 q = p + 1 == last ? *first : *(p + 1);
            around += std::hypot(to_mm(std::int64_t{q.x} - p->x), to_mm(std::int64_t{q.y} - p->y));
        }
        constexpr double rounding = 4 / static_cast<double>(kUnitsPerMm);
        if (std::fabs(areas[i]) > rounding * around) std::reverse(first, last);
    }
}

Loops to_loops(const Paths& paths) {
    Loops loops;
    for (const Path& path : paths) {
        if (path.size() < 3) continue;
        for (const IntPoint& p : path) loops.points.push_back({checked(p.X), checked(p.Y)});
        loops.close_loop();
    }
    nest(loops);
    turn_as_nested(loops);
    return loops;
}

Paths execute(ClipperLib::ClipType type, const Paths& subject, const Paths& clip,
              ClipperLib::PolyFillType fill) {
    Paths result;
    try {
        ClipperLib::Clipper clipper;
        // It skips paths that enclose nothing, and takes it for a failure when none is left.
        const bool subjects = clipper.AddPaths(subject, ClipperLib::ptSubject, true),
                   clips = clipper.AddPaths(clip, ClipperLib::ptClip, true);
        if (!subjects && !clips) return result;
        if (!clipper.Execute(type, result, fill, fill)) {
            throw Error(ErrorKind::no_plan, "polygons.failed",
                        "polyclipping could not combine these polygons", {},
                        "report the model; a slightly different height or tolerance avoids it");
        }
    } catch (const ClipperLib::clipperException& error) {
        throw Error(ErrorKind::no_plan, "polygons.failed",
                    std::string("polyclipping refused these polygons: ") + error.what(), {},
                    "check the units of the model");
    }
    return result;
}

Loops combine(ClipperLib::ClipType type, const Loops& a, const Loops& b) {
    return to_loops(execute(type, to_paths(a), to_paths(b), ClipperLib::pftNonZero));
}

/// Drops points on the straight line between their neighbours, spikes included, until there is none.
void drop_straight(Path& path) {
    auto straight = [](const IntPoint& a, const IntPoint& b, const IntPoint& c) {
        return static_cast<__int128>(b.X - a.X) * (c.Y - b.Y) ==
               static_cast<__int128>(b.Y - a.Y) * (c.X - b.X);
    };
    Path kept;
    kept.reserve(path.size());
    for (const IntPoint& p : path) {
        while (kept.size() >= 2 && straight(kept[kept.size() - 2], kept.back(), p)) kept.pop_back();
        if (kept.empty() || kept.back() != p) kept.push_back(p);
    }
    // The seam: the first points have not seen the last ones yet.
    std::size_t first = 0;
    for (bool again = true; again && kept.size() - first >= 3;) {
        again = false;
        if (straight(kept[kept.size() - 2], kept.back(), kept[first])) {
            kept.pop_back();
            again = true;
        } else if (straight(kept.back(), kept[first], kept[first + 1])) {
            ++first;
            again = true;
        }
    }
    path.assign(kept.begin() + static_cast<std::ptrdiff_t>(first), kept.end());
    if (path.size() < 3) path.clear();
}

/// The loop moved by `delta` units to its outside, not yet freed of its crossings: an edge keeps its length,
/// and moves along its normal; where the moved edges part, an arc joins them; where they cross, the path goes
/// through the vertex, so that all that is swept too far winds the other way and the positive filling drops
/// it.
///
/// polyclipping's own arcs are chords whose number is rounded down, on the inner side. Here the number is
/// rounded up, and the side chosen: the region must not come out too small. Growing, tangents around the arc
/// stand outside of it; shrinking, the arcs belong to what is taken away, and chords inside of them take too
/// little.
Path moved(const Path& loop, double delta, double tolerance) {
    const std::size_t n = loop.size();
    const double radius = std::abs(delta);
    const double largest = delta > 0 ? 2 * std::acos(radius / (radius + tolerance))
                                     : 2 * std::acos(std::max(0.0, 1 - tolerance / radius));
    const double largest_step = std::min(largest, std::numbers::pi / 2), one_step = std::cos(largest_step);
    auto rounded = [](double x, double y) {
        return IntPoint(static_cast<cInt>(std::llround(x)), static_cast<cInt>(std::llround(y)));
    };

    Path path;
    path.reserve(2 * n);
    for (std::size_t i = 0; i < n; ++i) {
        const IntPoint &a = loop[i == 0 ? n - 1 : i - 1], &b = loop[i], &c = loop[i + 1 == n ? 0 : i + 1];
        const double x = static_cast<double>(b.X), y = static_cast<double>(b.Y);
        double ux = x - static_cast<double>(a.X), uy = y - static_cast<double>(a.Y);
        double vx = static_cast<double>(c.X) - x, vy = static_cast<double>(c.Y) - y;
        const double u = std::sqrt(ux * ux + uy * uy), v = std::sqrt(vx * vx + vy * vy);
        ux /= u, uy /= u, vx /= v, vy /= v;
        const double sine = ux * vy - uy * vx, cosine = ux * vx + uy * vy;
        // Where the moved edges, or the lines that they lie on, meet: 1 + cos is twice the square of the half
        // turn's cosine.
        const auto meeting = [&] {
            return rounded(x + delta * (uy + vy) / (1 + cosine), y - delta * (ux + vx) / (1 + cosine));
        };
        // Outward normals are (uy, −ux) and (vy, −vx); delta < 0 turns them inward.
        if (sine * delta <= 0 || cosine == -1) {
            // Edges that both reach beyond where they cross, and by more than half of their length so that
            // the one at their other end leaves them something, need not go there: what they would sweep
            // beside it the two of them sweep anyway.
            if (2 * radius * std::abs(sine) < (1 + cosine) * std::min(u, v)) {
                path.push_back(meeting());
                continue;
            }
            path.push_back(rounded(x + delta * uy, y - delta * ux));
            path.push_back(b);
            path.push_back(rounded(x + delta * vy, y - delta * vx));
            continue;
        }
        if (cosine >= one_step) {
            if (delta > 0) {
                path.push_back(meeting());
            } else {
                path.push_back(rounded(x + delta * uy, y - delta * ux));
                path.push_back(rounded(x + delta * vy, y - delta * vx));
            }
            continue;
        }
        const double turn = std::atan2(sine, cosine);
        const auto steps = static_cast<std::size_t>(std::max(1.0, std::ceil(std::abs(turn) / largest_step)));
        const double step = turn / static_cast<double>(steps);
        if (delta > 0) {
            const double reach = delta / std::cos(step / 2);
            for (std::size_t k = 0; k < steps; ++k) {
                const double angle = (static_cast<double>(k) + 0.5) * step, across = std::cos(angle),
                             along = std::sin(angle);
                path.push_back(
                    rounded(x + reach * (uy * across + ux * along), y + reach * (uy * along - ux * across)));
            }
        } else {
            for (std::size_t k = 0; k <= steps; ++k) {
                const double angle = static_cast<double>(k) * step, across = std::cos(angle),
                             along = std::sin(angle);
                path.push_back(
                    rounded(x + delta * (uy * across + ux * along), y + delta * (uy * along - ux * across)));
            }
        }
    }
    return path;
}

void check_offset(double delta_mm, double tolerance_mm) {
    if (!std::isfinite(delta_mm) ||
        std::abs(delta_mm) * kUnitsPerMm > std::numeric_limits<std::int32_t>::max()) {
        throw Error(ErrorKind::usage, "polygons.offset", "an offset must be finite and under 214 m", {},
                    "check the tool's diameter");
    }
    if (!(tolerance_mm * kUnitsPerMm >= 1) || !std::isfinite(tolerance_mm)) {
        throw Error(ErrorKind::usage, "polygons.tolerance",
                    "the tolerance of an offset must be 0.0001 mm or more");
    }
}

// An outline moved and freed of what is swept too far.
Loops moved(Paths outline, double delta_mm, double tolerance_mm) {
    const double delta = delta_mm * kUnitsPerMm;
    if (delta == 0) return to_loops(outline);
    Paths raw;
    raw.reserve(outline.size());
    for (Path& loop : outline) {
        drop_straight(loop);
        if (!loop.empty()) raw.push_back(moved(loop, delta, tolerance_mm * kUnitsPerMm));
    }
    return to_loops(execute(ClipperLib::ctUnion, raw, {}, ClipperLib::pftPositive));
}

}  // namespace

Loops unite(const Loops& a, const Loops& b) { return combine(ClipperLib::ctUnion, a, b); }
Loops intersect(const Loops& a, const Loops& b) { return combine(ClipperLib::ctIntersection, a, b); }
Loops subtract(const Loops& a, const Loops& b) { return combine(ClipperLib::ctDifference, a, b); }
Loops simplify(const Loops& loops) { return combine(ClipperLib::ctUnion, loops, {}); }

Loops offset(const Loops& region, double delta_mm, double tolerance_mm) {
    check_offset(delta_mm, tolerance_mm);
    // Regions may overlap themselves; only the outline of what they cover may be moved.
    return moved(execute(ClipperLib::ctUnion, to_paths(region), {}, ClipperLib::pftNonZero), delta_mm,
                 tolerance_mm);
}

Loops offset_outline(const Loops& outline, double delta_mm, double tolerance_mm) {
    check_offset(delta_mm, tolerance_mm);
    return moved(to_paths(outline), delta_mm, tolerance_mm);
}

}  // namespace slabwright
