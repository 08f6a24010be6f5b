#include "engine/paths/runs/rings.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "kernels/geometry/vectors.h"
#include "kernels/polygons/runs_inside.h"

namespace slabwright {

namespace {

constexpr double kBeyond = 20;      // mm that the flask's region reaches past the stock
constexpr double kFineRing = 0.02;  // mm: what a ring may leave its line by, at least
constexpr double kRingShare =
    0.008;  // of the diameter: by what all others may, for they meet nothing but waste
constexpr double kHoldShare = 0.45;  // of the diameter, at most between rings that keep what stands held
constexpr double kLeastStep = 0.4;   // of the diameter
constexpr double kOffLine = 0.2;     // mm that offsets, rounded corners and fitted chords may add to what
                                     // thinning does between two rings
// The same between a face mill's rectangles, between whose corners nothing is farther from the inner one than
// the radius. An end mill's lie no farther apart than its rings: what it takes then overhanging wood bears at
// full feed.
constexpr double kFaceShare = 0.6;
constexpr double kBeside = 0.5;  // mm of air between the stock and a cutter that goes down beside it
constexpr double kOnEdge = 0.1;  // mm
constexpr std::size_t kRingsBesideStrips =
    2;  // steps from the forbidden region to the farthest ring, where strips lie beyond
constexpr double kMostBetweenStrips = 0.1;  // of the strips' length: the ways between them
constexpr double kShortestTerrace =
    2;  // mm of a terrace's border ring: shorter ones are corners of walls that need none
constexpr double kBesideSteps =
    1.2;  // steps between rings that lie next to each other, at most, where they are nearest
constexpr double kWedgeStep = 7.5;  // mm: where rings are a smaller step apart, what stays where one closes
                                    // is no more than a chip (kChip)
constexpr double kSlide = 1.2;      // steps along the next ring that the way to it slants

// Of a segment of Point2 or PathPoint, seen from above, and of a line of them; 0.1 µm.
template <class Point>
double length(const Point& a, const Point& b) {
    return std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y);
}
template <class Point>
double length(const std::vector<Point>& line) {
    double sum = 0;
    for (std::size_t k = 1; k < line.size(); ++k) sum += length(line[k - 1], line[k]);
    return sum;
}

// Where the middle of a cutter may be of use: the stock grown by `reach`, its corners rounded, as far as the
// machine travels.
struct Bound {
    std::array<double, 4> stock{}, travel{};  // 0.1 µm: smallest x and y, largest x and y
    double reach = 0;

    // Whether a point lies on the edge, or within a hair of it.
    [[nodiscard]] bool on_edge(double x, double y) const {
        const double dx = std::max({stock[0] - x, x - stock[2], 0.0}),
                     dy = std::max({stock[1] - y, y - stock[3], 0.0});
        const double inside = std::min(
            {reach - std::hypot(dx, dy), x - travel[0], travel[2] - x, y - travel[1], travel[3] - y});
        return inside < kOnEdge * kUnitsPerMm;
    }
};

void note_box(RingPlan::Piece& piece) {
    piece.box = {kUnbounded, kUnbounded, -kUnbounded, -kUnbounded};
    for (const PathPoint& p : piece.points)
        piece.box = {std::min<double>(piece.box[0], p.x), std::min<double>(piece.box[1], p.y),
                     std::max<double>(piece.box[2], p.x), std::max<double>(piece.box[3], p.y)};
}

// The pieces of one loop of the free area that are no edge of the bound. Outer loops run counter-clockwise
// and holes clockwise, so the free area is on the left, what stays on the right, and the cutter climbs.
void append_pieces(std::span<const Point2> loop, std::int32_t z, const Bound& bound, std::size_t ring,
                   std::size_t region, double tolerance, std::vector<RingPlan::Piece>& out) {
    const std::size_t n = loop.size();
    auto on_edge = [&](std::size_t k) {
        const Point2 &a = loop[k % n], &b = loop[(k + 1) % n];
        return bound.on_edge(a.x, a.y) && bound.on_edge(b.x, b.y) &&
               bound.on_edge(0.5 * (a.x + static_cast<double>(b.x)), 0.5 * (a.y + static_cast<double>(b.y)));
    };
    auto point = [&](std::size_t k) { return PathPoint{loop[k % n].x, loop[k % n].y, z}; };
    auto take = [&](std::vector<PathPoint>& points, bool closed) {
        if (points.size() > 1) {
            out.push_back({simplify(points, tolerance), {}, ring, region, closed});
            note_box(out.back());
        }
        points.clear();
    };
    std::size_t first = 0;
    while (first < n && !on_edge(first)) ++first;
    std::vector<PathPoint> points;
    if (first == n) {
        for (std::size_t k = 0; k <= n; ++k) points.push_back(point(k));
        return take(points, true);
    }
    for (std::size_t k = first + 1; k <= first + n; ++k) {
        if (on_edge(k)) {
            take(points, false);
            continue;
        }
        if (points.empty()) points.push_back(point(k));
        points.push_back(point(k + 1));
    }
    take(points, false);
}

// The place at share t of the way from a to b.
PathPoint between(const PathPoint& a, const PathPoint& b, double t) {
    return {static_cast<std::int32_t>(std::lround(a.x + t * (static_cast<double>(b.x) - a.x))),
            static_cast<std::int32_t>(std::lround(a.y + t * (static_cast<double>(b.y) - a.y))), b.z};
}

// Where a piece may begin.
struct Start {
    double way = kUnbounded;  // 0.1 µm, from where the tool is
    std::size_t segment = 0;
    PathPoint at;
    bool reversed = false;
};

// The nearest beginning of a piece, as long as that is nearer than `best`: of a closed one, the nearest
// point; of an open one its first, or either end.
bool nearer(const RingPlan::Piece& piece, Point2 from, bool either_end, Start& best) {
    const PathPoint q{from.x, from.y, 0};
    const double bx = std::max({piece.box[0] - q.x, q.x - piece.box[2], 0.0}),
                 by = std::max({piece.box[1] - q.y, q.y - piece.box[3], 0.0});
    if (std::hypot(bx, by) >= best.way) return false;
    bool found = false;
    auto offer = [&](std::size_t segment, const PathPoint& p, bool reversed) {
        if (const double d = length(q, p); d < best.way) best = {d, segment, p, reversed}, found = true;
    };
    offer(0, piece.points.front(), false);
    if (!piece.closed) {
        if (either_end) offer(0, piece.points.back(), true);
        return found;
    }
    for (std::size_t k = 0; k + 1 < piece.points.size(); ++k) {
        const PathPoint &a = piece.points[k], &b = piece.points[k + 1];
        const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y,
                     l2 = dx * dx + dy * dy;
        const double t =
            l2 > 0 ? std::clamp(
                         ((static_cast<double>(q.x) - a.x) * dx + (static_cast<double>(q.y) - a.y) * dy) / l2,
                         0.0, 1.0)
                   : 0;
        const double ex = a.x + t * dx - q.x, ey = a.y + t * dy - q.y,
                     reach = best.way + 1;  // a unit more: the place is rounded
        if (ex * ex + ey * ey > reach * reach) continue;
        offer(k, between(a, b, t), false);
    }
    return found;
}

// The place `ahead` (0.1 µm) farther along a closed ring than a start on it.
void advance(const std::vector<PathPoint>& ring, double ahead, Start& start) {
    const std::size_t n = ring.size() - 1;
    for (std::size_t passed = 0; passed <= n; ++passed) {
        const PathPoint& b = ring[start.segment + 1];
        const double left = length(start.at, b);
        if (left >= ahead && left > 0) {
            start.at = between(start.at, b, ahead / left);
            return;
        }
        ahead -= left;
        start.at = b;
        start.segment = (start.segment + 1) % n;
    }
}

// A closed ring that starts and ends at a point of one of its segments.
std::vector<PathPoint> started_at(const std::vector<PathPoint>& ring, std::size_t segment,
                                  const PathPoint& at) {
    std::vector<PathPoint> result{at};
    const std::size_t n = ring.size() - 1;
    for (std::size_t k = 1; k <= n; ++k) {
        const PathPoint& p = ring[(segment + k) % n];
        if (!(p == result.back())) result.push_back(p);
    }
    if (!(result.back() == at)) result.push_back(at);
    return result;
}

Loops rectangle(double x0, double y0, double x1, double y1) {
    Loops loops;
    loops.points = {{to_units(x0), to_units(y0)},
                    {to_units(x1), to_units(y0)},
                    {to_units(x1), to_units(y1)},
                    {to_units(x0), to_units(y1)}};
    loops.close_loop();
    return loops;
}

// A rectangle well past the stock and the tool's reach.
Loops around_stock(const LayerCut& cut, double r) {
    const auto &lo = cut.layer.stock_min, &hi = cut.layer.stock_max;
    const double beyond = 2 * r + kBeyond;
    return rectangle(lo[0] - beyond, lo[1] - beyond, hi[0] + beyond, hi[1] + beyond);
}

}  // namespace

Loops forbidden_region(const Contours& contours) {
    Loops region;  // contours have the solid on their right, loops on their left
    for (std::size_t c = 0; c < contours.size(); ++c) {
        if (contours.starts[c + 1] - contours.starts[c] < 3) continue;
        for (std::size_t k = contours.starts[c + 1]; k-- > contours.starts[c];)
            region.points.push_back(contours.points[k]);
        region.close_loop();
    }
    return region;
}

Loops flask_room(const LayerCut& cut, double r) {
    return subtract(cut.layer.opening, offset(subtract(around_stock(cut, r), cut.layer.opening), r, 0.01));
}

Loops beyond_room(const LayerCut& cut, double r, const Loops& room) {
    return subtract(around_stock(cut, r), room);
}

Fibres beside_flask(const LayerCut& cut, const Loops& room, Fibres forbidden, Axis axis,
                    std::span<const std::int32_t> lines) {
    if (cut.layer.opening.empty()) return forbidden;
    // Along y, the room is looked at with its axes swapped, which turns its loops over.
    Loops turned;
    if (axis == Axis::y)
        for (std::size_t l = 0; l < room.size(); ++l) {
            const auto loop = room.loop(l);
            for (std::size_t k = loop.size(); k-- > 0;) turned.points.push_back({loop[k].y, loop[k].x});
            turned.close_loop();
        }
    const Loops& seen = axis == Axis::y ? turned : room;
    constexpr double far = 1e6;  // mm
    Fibres result;
    const std::vector<std::vector<Span>> inside =
        line_spans(seen, std::vector<double>(lines.begin(), lines.end()));
    for (std::size_t i = 0; i < lines.size(); ++i) {
        std::vector<Forbidden> all(forbidden.line(i).begin(), forbidden.line(i).end());
        double end = -far;
        for (const Span& s : inside[i]) {
            all.push_back({end, s.low / kUnitsPerMm, 0, 0});
            end = s.high / kUnitsPerMm;
        }
        all.push_back({end, far, 0, 0});
        std::sort(all.begin(), all.end(), [](const Forbidden& a, const Forbidden& b) {
            return a.low != b.low ? a.low < b.low : a.high < b.high;
        });
        for (const Forbidden& f : all) {
            if (result.intervals.size() > result.starts.back() && f.low < result.intervals.back().high) {
                Forbidden& last = result.intervals.back();
                if (f.high > last.high) last.high = f.high, last.nz_high = f.nz_high;
            } else {
                result.intervals.push_back(f);
            }
        }
        result.starts.push_back(static_cast<std::uint32_t>(result.intervals.size()));
    }
    return result;
}

void cut_ring(PathBuilder& path, const std::vector<PathPoint>& ring, std::int32_t above, std::int32_t z,
              double ramp_deg) {
    const double around = length(ring);
    const double drop = static_cast<double>(above) - z;
    if (around < 1) return;
    const double slope = std::min(std::tan(ramp_deg * std::numbers::pi / 180), path.slope_around(ring));
    if (drop > 0 && slope <= 0) {
        path.follow(ring);
        return;
    }
    path.sink(above);
    if (drop <= 0) {
        for (const PathPoint& p : ring) path.cut({p.x, p.y}, z);
        return;
    }
    const double ramp = drop / slope;
    double done = 0;
    bool down = false;
    for (std::size_t k = 1; done < ramp + around; k = k + 1 < ring.size() ? k + 1 : 1) {
        const double l = length(ring[k - 1], ring[k]);
        if (!down && done + l >= ramp) {  // the bottom is reached on this segment; from here once around
            const double t = l > 0 ? (ramp - done) / l : 1;
            path.cut({static_cast<std::int32_t>(
                          std::lround(ring[k - 1].x + t * (static_cast<double>(ring[k].x) - ring[k - 1].x))),
                      static_cast<std::int32_t>(
                          std::lround(ring[k - 1].y + t * (static_cast<double>(ring[k].y) - ring[k - 1].y)))},
                     z);
            down = true;
        }
        done += l;
        path.cut({ring[k].x, ring[k].y},
                 down ? z : std::max(z, above - static_cast<std::int32_t>(drop * done / ramp)));
    }
}

namespace {

// The point of a loop at which it turns most: where a loop is thinned, its first point stays.
std::size_t sharpest(std::span<const Point2> loop) {
    std::size_t best = 0;
    double least = 2;  // cosine of the turn
    const Point2 *a = &loop[loop.size() - 1], *b = &loop[0];
    double ux = static_cast<double>(b->x) - a->x, uy = static_cast<double>(b->y) - a->y,
           u2 = ux * ux + uy * uy;
    for (std::size_t k = 0; k < loop.size(); ++k) {
        const Point2& c = loop[k + 1 < loop.size() ? k + 1 : 0];
        const double vx = static_cast<double>(c.x) - b->x, vy = static_cast<double>(c.y) - b->y,
                     v2 = vx * vx + vy * vy;
        if (u2 > 0 && v2 > 0)
            if (const double cosine = (ux * vx + uy * vy) / std::sqrt(u2 * v2); cosine < least)
                least = cosine, best = k;
        b = &c, ux = vx, uy = vy, u2 = v2;
    }
    return best;
}

// The region's loops with fewer points (0.1 µm). Small loops stay as they are.
Loops thinned(const Loops& region, double fine, double loose, double turn) {
    Loops result;
    std::vector<PathPoint> line;
    for (std::size_t l = 0; l < region.size(); ++l) {
        const std::span<const Point2> loop = region.loop(l);
        if (loop.empty()) continue;
        line.clear();
        const std::size_t first = sharpest(loop);
        for (std::size_t k = 0; k <= loop.size(); ++k)
            line.push_back({loop[(first + k) % loop.size()].x, loop[(first + k) % loop.size()].y, 0});
        if (std::vector<PathPoint> fewer = simplify(line, fine, loose, turn); fewer.size() > 3)
            line = std::move(fewer);
        for (std::size_t k = 0; k + 1 < line.size(); ++k) result.points.push_back({line[k].x, line[k].y});
        result.close_loop();
    }
    return result;
}

// Of each loop: smallest x and y, largest x and y.
std::vector<std::array<std::int32_t, 4>> boxes_of(const Loops& loops) {
    std::vector<std::array<std::int32_t, 4>> boxes;
    for (std::size_t l = 0; l < loops.size(); ++l) {
        std::array<std::int32_t, 4> box{INT32_MAX, INT32_MAX, INT32_MIN, INT32_MIN};
        for (const Point2 p : loops.loop(l))
            box = {std::min(box[0], p.x), std::min(box[1], p.y), std::max(box[2], p.x),
                   std::max(box[3], p.y)};
        boxes.push_back(box);
    }
    return boxes;
}

bool within(const std::array<std::int32_t, 4>& box, const PathPoint& p) {
    return p.x >= box[0] && p.x <= box[2] && p.y >= box[1] && p.y <= box[3];
}

// The rectangles from the stock's edge inwards, as far as they surround the forbidden region and what is
// within it.
std::vector<std::array<double, 4>> frames_around(const LayerCut& cut, double r, double step,
                                                 const Loops& forbidden) {
    std::vector<std::array<double, 4>> frames;
    std::array<double, 4> stands{cut.layer.stock_min[0], cut.layer.stock_min[1], cut.layer.stock_max[0],
                                 cut.layer.stock_max[1]};
    const double out = r + kBeside;
    for (int axis = 0; axis < 2; ++axis)  // without room beside the stock there is no way in
        if (cut.low(axis, out) > cut.layer.stock_min[axis] - out ||
            cut.high(axis, out) < cut.layer.stock_max[axis] + out)
            return frames;
    std::array<double, 4> keep{kUnbounded, kUnbounded, -kUnbounded, -kUnbounded};
    for (const Point2 p : forbidden.points)
        keep = {std::min(keep[0], to_mm(p.x)), std::min(keep[1], to_mm(p.y)), std::max(keep[2], to_mm(p.x)),
                std::max(keep[3], to_mm(p.y))};
    for (;;) {
        const std::array<double, 4> ring{stands[0] + step - r, stands[1] + step - r, stands[2] - step + r,
                                         stands[3] - step + r};
        if (ring[0] > keep[0] || ring[1] > keep[1] || ring[2] < keep[2] || ring[3] < keep[3]) return frames;
        frames.push_back(ring);
        stands = {stands[0] + step, stands[1] + step, stands[2] - step, stands[3] - step};
    }
}

// Cuts them in one spiral with the stock on its right: what still stands is one piece then.
void cut_frames(PathBuilder& path, const RingPlan& plan) {
    double south = plan.south;
    for (const std::array<double, 4>& ring : plan.frames) {
        const std::int32_t x0 = to_units(ring[0]), x1 = to_units(ring[2]), y0 = to_units(ring[1]),
                           y1 = to_units(ring[3]), z = plan.z;
        const std::array<PathPoint, 5> run{
            {{x0, to_units(south), z}, {x0, y1, z}, {x1, y1, z}, {x1, y0, z}, {x0, y0, z}}};
        // Beside the stock nothing stands, but the machine's travel may not reach so far.
        if (&ring == &plan.frames.front() || path.z() != z) path.follow(run);
        else
            for (const PathPoint& p : run) path.cut({p.x, p.y}, z);
        south = ring[1];
    }
}

// Where the middle of a cutter of radius `r` is of use on what stands in a rectangle (smallest x and y,
// largest x and y), mm.
Loops useful_area(const LayerCut& cut, double r, const std::array<double, 4>& stands) {
    const double far = r + 2;
    return intersect(
        offset_outline(rectangle(stands[0], stands[1], stands[2], stands[3]), r + kBeside, kFineRing),
        rectangle(cut.low(0, far), cut.low(1, far), cut.high(0, far), cut.high(1, far)));
}

// Loops, none of which crosses another, told by whether a convex region of one loop holds them for certain.
struct ToldLoops {
    Loops within, others;
    ToldLoops(const Loops& convex, const Loops& loops) {
        const std::vector<std::array<std::int32_t, 4>> boxes = boxes_of(loops);
        for (std::size_t l = 0; l < loops.size(); ++l) {
            Loops& to = convex.size() == 1 && holds(convex, boxes[l]) ? within : others;
            to.points.insert(to.points.end(), loops.loop(l).begin(), loops.loop(l).end());
            to.close_loop();
        }
    }

private:
    // Whether all corners of a box lie on the left of all edges.
    static bool holds(const Loops& convex, const std::array<std::int32_t, 4>& box) {
        for (std::size_t k = 0; k < convex.points.size(); ++k) {
            const Point2 a = convex.points[k], b = convex.points[k + 1 < convex.points.size() ? k + 1 : 0];
            const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y;
            for (const std::int32_t x : {box[0], box[2]})
                for (const std::int32_t y : {box[1], box[3]})
                    if (dx * (static_cast<double>(y) - a.y) - dy * (static_cast<double>(x) - a.x) <= 0)
                        return false;
        }
        return true;
    }
};

// Loops followed by others, which may be turned over.
Loops joined(Loops loops, const Loops& others, bool turned) {
    for (std::size_t l = 0; l < others.size(); ++l) {
        const std::span<const Point2> loop = others.loop(l);
        if (turned) loops.points.insert(loops.points.end(), loop.rbegin(), loop.rend());
        else loops.points.insert(loops.points.end(), loop.begin(), loop.end());
        loops.close_loop();
    }
    return loops;
}

// What of disjoint loops lies in a convex region, and what of that region beside them. What the region holds
// need not be clipped: nearly all.
Loops inside_convex(const Loops& convex, const Loops& loops) {
    const ToldLoops told(convex, loops);
    return joined(told.others.empty() ? Loops{} : intersect(convex, told.others), told.within, false);
}
Loops beside_in_convex(const Loops& convex, const Loops& loops) {
    const ToldLoops told(convex, loops);
    return joined(told.others.empty() ? convex : subtract(convex, told.others), told.within, true);
}

// How rings that meet nothing but waste are thinned: chords that leave a curve by no more than the machine
// may are run as fast as the curve.
struct Thinning {
    double fine = 0, loose = 0, turn = 0;  // mm, mm, radians
    Thinning(const LayerCut& cut, const Tool& tool, double blend)
        : fine(std::min(ring_tolerance(tool), std::max(kFineRing, blend))),
          loose(ring_tolerance(tool)),
          turn(fast_turn(cut.job.machine, std::min(tool.max_feed, cut.job.machine.max_feed), blend)) {}
    [[nodiscard]] Loops of(const Loops& region) const {
        return thinned(region, fine * kUnitsPerMm, loose * kUnitsPerMm, turn);
    }
};

// Whether a place lies nearer to a line than `reach`, 0.1 µm.
bool near_line(const PathPoint& p, std::span<const PathPoint> line, double reach) {
    for (std::size_t k = 1; k < line.size(); ++k) {
        const double ax = line[k - 1].x, ay = line[k - 1].y, dx = line[k].x - ax, dy = line[k].y - ay,
                     l2 = dx * dx + dy * dy;
        const double t = l2 > 0 ? std::clamp(((p.x - ax) * dx + (p.y - ay) * dy) / l2, 0.0, 1.0) : 0;
        const double ex = p.x - ax - t * dx, ey = p.y - ay - t * dy;
        if (ex * ex + ey * ey < reach * reach) return true;
    }
    return false;
}

// Rectangles from `stands` (smallest x and y, largest x and y, mm) inwards, with the stock on their right, as
// far as they lie outside of the rings next to the forbidden region. False, and none, where these would cut
// them to pieces.
bool go_round(RingPlan& plan, const std::array<double, 4>& stands, double r, const Loops& forbidden,
              const Loops& useful) {
    const Loops outside =
        beside_in_convex(useful, offset_outline(forbidden, kRingsBesideStrips * plan.step, kFineRing));
    Loops around;
    const double narrow = std::min(stands[2] - stands[0], stands[3] - stands[1]);
    for (int k = 1; 2 * (k - 1) * plan.frame_step < narrow; ++k) {
        const double in = k * plan.frame_step - r;
        const Loops corners = rectangle(stands[0] + in, stands[1] + in, stands[2] - in, stands[3] - in);
        around.points.insert(around.points.end(), corners.points.rbegin(), corners.points.rend());
        around.close_loop();
    }
    std::vector<RunInside> runs = runs_inside(around, outside);
    double cut = 0, between = 0;
    const RunInside* last = nullptr;
    for (const RunInside& run : runs) {
        cut += length(run.points) + (run.closed ? length(run.points.back(), run.points.front()) : 0);
        if (last != nullptr && !last->closed && !run.closed)
            between += length(last->points.back(), run.points.front());
        last = &run;
    }
    if (runs.empty() || between > kMostBetweenStrips * cut) return false;
    for (const RunInside& run : runs) {
        std::vector<PathPoint> strip;
        // From the rectangle before, where the cutter has room; farther along where that begins later. So
        // near to its beginning, which is two steps from what is forbidden, the way is free.
        const Point2 a = run.points[0], b = run.points[1];
        const double l = length(a, b), ux = (static_cast<double>(b.x) - a.x) / l,
                     uy = (static_cast<double>(b.y) - a.y) / l;
        for (const double along : {0.0, 0.5, 1.0, 1.5}) {
            const double step = plan.frame_step * kUnitsPerMm;
            const Point2 beside{static_cast<std::int32_t>(std::lround(a.x + step * (along * ux - uy))),
                                static_cast<std::int32_t>(std::lround(a.y + step * (along * uy + ux)))};
            if (winding(outside, beside) <= 0) continue;
            strip.push_back({beside.x, beside.y, plan.z});
            break;
        }
        for (const Point2 p : run.points) strip.push_back({p.x, p.y, plan.z});
        if (run.closed) strip.push_back({a.x, a.y, plan.z});
        plan.strips.push_back(std::move(strip));
    }
    return true;
}

// Where rings around a region are of use.
struct Use {
    Loops border, others;  // of the ring on the region's border, and of all others
    double shortest = 0;   // mm of the border: shorter pieces are left out
};

// Rings around a region, a step apart, as far as they are of use; no farther than `last` steps.
void append_rings(RingPlan& plan, const LayerCut& cut, const Thinning& thinning, Loops region, const Use& use,
                  std::size_t last) {
    for (std::size_t ring = 0; ring <= last; ++ring) {
        cut.context.throw_if_cancelled();
        // Around the region, so that it is on the right: its loops are turned over.
        Loops around;
        for (std::size_t l = 0; l < region.size(); ++l) {
            const std::span<const Point2> loop = region.loop(l);
            around.points.insert(around.points.end(), loop.rbegin(), loop.rend());
            around.close_loop();
        }
        const std::size_t first = plan.pieces.size();
        for (const RunInside& run : runs_inside(around, ring == 0 ? use.border : use.others)) {
            std::vector<PathPoint> points;
            for (const Point2 p : run.points) points.push_back({p.x, p.y, plan.z});
            if (run.closed) points.push_back(points.front());
            if (ring == 0 && !run.closed && length(points) < use.shortest * kUnitsPerMm) continue;
            plan.pieces.push_back({ring == 0 ? simplify(points, kFineRing * kUnitsPerMm) : std::move(points),
                                   {},
                                   ring,
                                   0,
                                   run.closed});
            note_box(plan.pieces.back());
        }
        if (plan.pieces.size() == first && ring > 0) return;
        cut.context.throw_if_cancelled();
        region = thinning.of(offset_outline(region, plan.step, kFineRing));
    }
}

}  // namespace

Loops thinned_rings(const LayerCut& cut, const Tool& tool, const Loops& region, double blend) {
    return Thinning(cut, tool, blend).of(region);
}

double ring_step(const Tool& tool) {
    // Nowhere is farther from a ring than the radius: where the innermost leaves room for none, that is a
    // step from it.
    const double widest = tool.diameter / 2 - 2 * ring_tolerance(tool) - kOffLine;
    return std::min(tool.stepover * tool.diameter, std::max(widest, kLeastStep * tool.diameter));
}

double ring_tolerance(const Tool& tool) { return std::max(kFineRing, kRingShare * tool.diameter); }

RingPlan plan_rings(const LayerCut& cut, const Tool& tool, const Loops& forbidden, double tip_z, double blend,
                    bool hold) {
    RingPlan plan;
    plan.hold = hold;
    const double r = tool.diameter / 2;
    plan.radius = r;
    plan.step = hold ? std::min(ring_step(tool), kHoldShare * tool.diameter) : ring_step(tool);
    plan.frame_step =
        tool.kind == ToolKind::face ? std::min(kFaceShare, tool.stepover) * tool.diameter : ring_step(tool);
    plan.z = to_units(tip_z);
    if (forbidden.empty()) return plan;
    plan.frames = frames_around(cut, r, plan.frame_step, forbidden);
    plan.south = cut.layer.stock_min[1] - r - kBeside;
    // What stands within them.
    const double cleared = static_cast<double>(plan.frames.size()) * plan.frame_step;
    const std::array<double, 4> stands{cut.layer.stock_min[0] + cleared, cut.layer.stock_min[1] + cleared,
                                       cut.layer.stock_max[0] - cleared, cut.layer.stock_max[1] - cleared};
    Bound bound;
    for (std::size_t k = 0; k < 4; ++k) bound.stock[k] = stands[k] * kUnitsPerMm;
    bound.reach = (r + kBeside) * kUnitsPerMm;
    const double far = r + 2;
    bound.travel = {cut.low(0, far) * kUnitsPerMm, cut.low(1, far) * kUnitsPerMm,
                    cut.high(0, far) * kUnitsPerMm, cut.high(1, far) * kUnitsPerMm};
    const Loops useful = useful_area(cut, r, stands);
    const Thinning thinning(cut, tool, blend);
    if (!hold) {
        const bool round = go_round(plan, stands, r, forbidden, useful);
        append_rings(plan, cut, thinning, forbidden, {useful, useful, 0},
                     round ? kRingsBesideStrips : SIZE_MAX);
        return plan;
    }
    Loops nearer_free;
    std::vector<std::size_t> nearer_region;  // by loop of nearer_free; SIZE_MAX for holes
    std::vector<std::array<std::int32_t, 4>> nearer_boxes;
    std::size_t ring = 0;
    for (Loops region = forbidden;; ++ring) {
        cut.context.throw_if_cancelled();
        Loops free = subtract(useful, region);
        cut.context.throw_if_cancelled();
        if (free.empty()) break;
        std::vector<std::size_t> region_of(free.size(), SIZE_MAX);
        const std::size_t first_piece = plan.pieces.size();
        for (const bool holes : {false, true})
            for (std::size_t l = 0; l < free.size(); ++l) {
                if ((signed_area(free.loop(l)) < 0) != holes) continue;
                if (!holes) {
                    region_of[l] = plan.regions.size();
                    plan.regions.emplace_back();
                } else if (free.parents[l] < 0) {
                    continue;
                }
                const std::size_t of =
                    holes ? region_of[static_cast<std::size_t>(free.parents[l])] : region_of[l];
                if (of != SIZE_MAX)
                    append_pieces(free.loop(l), plan.z, bound, ring, of,
                                  ring == 0 ? kFineRing * kUnitsPerMm : 0, plan.pieces);
            }
        for (std::size_t p = first_piece; p < plan.pieces.size(); ++p)
            plan.regions[plan.pieces[p].region].pieces.push_back(p);
        // Which nearer region holds each of these: by a point off the bound's edge, which both may share.
        for (std::size_t l = 0; ring > 0 && l < free.size(); ++l) {
            if (region_of[l] == SIZE_MAX) continue;
            RingPlan::Region& inner = plan.regions[region_of[l]];
            if (inner.pieces.empty()) continue;
            const PathPoint& p =
                plan.pieces[inner.pieces.front()].points[plan.pieces[inner.pieces.front()].points.size() / 2];
            double least = kUnbounded;
            for (std::size_t m = 0; m < nearer_free.size(); ++m) {
                if (nearer_region[m] == SIZE_MAX || !within(nearer_boxes[m], p)) continue;
                Loops one;
                one.points.assign(nearer_free.loop(m).begin(), nearer_free.loop(m).end());
                one.close_loop();
                if (const double size = area(one); size < least && winding(one, {p.x, p.y}) > 0)
                    least = size, inner.around = nearer_region[m];
            }
            if (inner.around != SIZE_MAX) ++plan.regions[inner.around].waits_for;
        }
        if (plan.pieces.size() == first_piece) break;
        nearer_boxes = boxes_of(free);
        nearer_free = std::move(free);
        nearer_region = std::move(region_of);
        region = thinning.of(offset_outline(region, plan.step, kFineRing));
        cut.context.throw_if_cancelled();
    }
    return plan;
}

RingPlan plan_terrace(const LayerCut& cut, const Tool& tool, const Loops& forbidden, const Loops& border_over,
                      const Loops& over, double tip_z, double blend) {
    RingPlan plan;
    const double r = tool.diameter / 2;
    plan.radius = r;
    plan.step = ring_step(tool);
    plan.z = to_units(tip_z);
    const Loops useful = useful_area(
        cut, r,
        {cut.layer.stock_min[0], cut.layer.stock_min[1], cut.layer.stock_max[0], cut.layer.stock_max[1]});
    const Thinning thinning(cut, tool, blend);
    append_rings(plan, cut, thinning, forbidden,
                 {inside_convex(useful, border_over), inside_convex(useful, over), kShortestTerrace},
                 SIZE_MAX);
    return plan;
}

namespace {

// Whose turn it is: pieces that wait for nothing. With RingPlan::hold a piece waits for all regions within
// its own, without it for the pieces beside it that lie a step farther off: so one place is finished before
// the next is gone to. With RingPlan::from_open it waits for any piece beside it, unless it begins at the
// stock's edge.
class Turns {
public:
    std::vector<std::size_t> ready;

    explicit Turns(RingPlan& plan) : plan_(plan) {
        if (plan.from_open) {
            find_neighbours();
            return;
        }
        if (!plan.hold) {
            wait_for_neighbours();
            return;
        }
        for (const RingPlan::Region& region : plan.regions) left_.push_back(region.pieces.size());
        // Regions without a region within them; the others follow from these.
        std::vector<std::size_t> farthest;
        for (std::size_t k = 0; k < plan.regions.size(); ++k)
            if (plan.regions[k].waits_for == 0) farthest.push_back(k);
        for (const std::size_t k : farthest) release(k);
    }

    /// To be called when a piece has been cut; its points may have been put in another order.
    void cut(std::size_t piece) {
        if (plan_.from_open) {
            state_[piece] = State::cut;
            for (const std::size_t k : waiting_[piece])
                if (state_[k] == State::waits) state_[k] = State::ready, ready.push_back(k);
            if (ready.empty()) make_farthest_ready();
            return;
        }
        if (!plan_.hold) {
            for (const std::size_t k : waiting_[piece])
                if (--waits_for_[k] == 0) ready.push_back(k);
            return;
        }
        const std::size_t region = plan_.pieces[piece].region, around = plan_.regions[region].around;
        if (--left_[region] > 0 || around == SIZE_MAX) return;
        --plan_.regions[around].waits_for;
        release(around);
    }

    /// With RingPlan::from_open, of a piece whose turn it is: whether one beside it has been cut, and whether
    /// one that is farther from the forbidden region has.
    struct Beside {
        bool any = false, farther = false;
    };
    [[nodiscard]] Beside cut_beside(std::size_t piece) const {
        Beside found;
        for (const std::size_t k : waiting_[piece])
            if (state_[k] == State::cut)
                found.any = true, found.farther |= plan_.pieces[k].ring > plan_.pieces[piece].ring;
        return found;
    }
    /// The same: whether a place of it lies beside one that has been cut.
    [[nodiscard]] bool beside_cut(std::size_t piece, const PathPoint& p) const {
        const double reach = kBesideSteps * plan_.step * kUnitsPerMm;
        return std::any_of(waiting_[piece].begin(), waiting_[piece].end(), [&](std::size_t k) {
            return state_[k] == State::cut && near_line(p, plan_.pieces[k].points, reach);
        });
    }

private:
    enum class State : char { waits, ready, cut };
    // Pieces that lie beside each other, on one ring or on the next.
    void find_neighbours() {
        const std::size_t n = plan_.pieces.size();
        waiting_.resize(n), boxes_.resize(n), state_.assign(n, State::waits);
        for (std::size_t k = 0; k < n; ++k)
            for (std::size_t m = k + 1; m < n && plan_.pieces[m].ring <= plan_.pieces[k].ring + 1; ++m)
                if (beside(plan_.pieces[k], plan_.pieces[m]))
                    waiting_[k].push_back(m), waiting_[m].push_back(k);
        for (std::size_t k = 0; k < n; ++k)
            if (!plan_.pieces[k].closed) state_[k] = State::ready, ready.push_back(k);
        if (ready.empty()) make_farthest_ready();
    }
    // Where no way leads from the edge: of those that wait, the farthest from the forbidden region.
    void make_farthest_ready() {
        std::size_t far = 0;
        for (std::size_t k = 0; k < state_.size(); ++k)
            if (state_[k] == State::waits) far = std::max(far, plan_.pieces[k].ring);
        for (std::size_t k = 0; k < state_.size(); ++k)
            if (state_[k] == State::waits && plan_.pieces[k].ring == far)
                state_[k] = State::ready, ready.push_back(k);
    }

    void release(std::size_t region) {
        RingPlan::Region& of = plan_.regions[region];
        if (of.waits_for > 0) return;
        if (left_[region] > 0) {
            ready.insert(ready.end(), of.pieces.begin(), of.pieces.end());
        } else if (of.around != SIZE_MAX) {
            --plan_.regions[of.around].waits_for;
            release(of.around);
        }
    }

    void wait_for_neighbours() {
        const std::size_t n = plan_.pieces.size();
        waits_for_.assign(n, 0), waiting_.resize(n), boxes_.resize(n);
        auto ring = [&](std::size_t k) { return plan_.pieces[k].ring; };
        for (std::size_t first = 0, farther = 0, end = 0; first < n;
             first = farther) {  // pieces lie in the order of their rings
            for (farther = first; farther < n && ring(farther) == ring(first);) ++farther;
            for (end = farther; end < n && ring(end) == ring(first) + 1;) ++end;
            for (std::size_t k = first; k < farther; ++k)
                for (std::size_t m = farther; m < end; ++m)
                    if (beside(plan_.pieces[k], plan_.pieces[m])) ++waits_for_[k], waiting_[m].push_back(k);
        }
        for (std::size_t k = 0; k < n; ++k)
            if (waits_for_[k] == 0) ready.push_back(k);
    }

    using Box = std::array<double, 4>;        // smallest x and y, largest x and y
    static constexpr std::size_t kPart = 16;  // segments of a piece that share a box
    static bool apart(const Box& a, const Box& b, double reach) {
        return a[0] > b[2] + reach || b[0] > a[2] + reach || a[1] > b[3] + reach || b[1] > a[3] + reach;
    }
    // The boxes of a piece's parts.
    [[nodiscard]] const std::vector<Box>& boxes_of_parts(const RingPlan::Piece& piece) {
        std::vector<Box>& boxes = boxes_[static_cast<std::size_t>(&piece - plan_.pieces.data())];
        for (std::size_t first = boxes.size() * kPart; first + 1 < piece.points.size(); first += kPart) {
            Box& box = boxes.emplace_back(Box{kUnbounded, kUnbounded, -kUnbounded, -kUnbounded});
            for (std::size_t k = first; k <= std::min(first + kPart, piece.points.size() - 1); ++k) {
                const PathPoint& p = piece.points[k];
                box = {std::min<double>(box[0], p.x), std::min<double>(box[1], p.y),
                       std::max<double>(box[2], p.x), std::max<double>(box[3], p.y)};
            }
        }
        return boxes;
    }

    [[nodiscard]] bool beside(const RingPlan::Piece& a, const RingPlan::Piece& b) {
        const double reach = kBesideSteps * plan_.step * kUnitsPerMm;
        if (apart(a.box, b.box, reach)) return false;
        auto near = [&](const RingPlan::Piece& from, const RingPlan::Piece& to) {
            const std::vector<Box>&from_boxes = boxes_of_parts(from), &to_boxes = boxes_of_parts(to);
            for (std::size_t f = 0; f < from_boxes.size(); ++f) {
                if (apart(from_boxes[f], to.box, reach)) continue;
                for (std::size_t k = f * kPart; k <= std::min((f + 1) * kPart, from.points.size() - 1); ++k) {
                    const PathPoint& p = from.points[k];
                    const Box at{static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.x),
                                 static_cast<double>(p.y)};
                    if (apart(at, to.box, reach)) continue;
                    for (std::size_t t = 0; t < to_boxes.size(); ++t)
                        if (!apart(at, to_boxes[t], reach) &&
                            near_line(p,
                                      std::span(to.points).subspan(
                                          t * kPart, std::min(kPart + 1, to.points.size() - t * kPart)),
                                      reach))
                            return true;
                }
            }
            return false;
        };
        return near(a, b) || near(b, a);
    }

    RingPlan& plan_;
    std::vector<std::size_t> left_;       // by region: pieces not cut yet; with hold
    std::vector<std::size_t> waits_for_;  // by piece, without it: how many others
    std::vector<std::vector<std::size_t>>
        waiting_;                          // and who waits for it; with from_open: who lies beside it
    std::vector<State> state_;             // by piece, with from_open
    std::vector<std::vector<Box>> boxes_;  // of its parts, once they were asked for
};

// With RingPlan::from_open: a closed piece begins at its point nearest to where the tool is of those beside a
// piece that has been cut, and is turned over where that piece is the nearer one to the forbidden region: so
// the stock is on the right again.
void begin_beside(const Turns& turns, std::size_t chosen, Point2 at, RingPlan::Piece& piece, Start& start) {
    const Turns::Beside beside = turns.cut_beside(chosen);
    if (!beside.any) return;
    if (!beside.farther) std::reverse(piece.points.begin(), piece.points.end());
    if (!piece.closed) return;
    const PathPoint from{at.x, at.y, piece.points.front().z};
    start = {};
    for (std::size_t k = 0; k + 1 < piece.points.size(); ++k) {
        const double way = length(from, piece.points[k]);
        if (way < start.way && turns.beside_cut(chosen, piece.points[k]))
            start = {way, k, piece.points[k], false};
    }
    if (start.way == kUnbounded)
        (void)nearer(piece, at, false, start);  // only a place between two points lies beside one
}

// Where a closed piece had better close, with RingPlan::hold. There the cutter meets its own way when it is
// still as far from the beginning as it is wide, and what then stands between that place, halfway, and what
// is clear on the side away from the forbidden region is a wedge that hangs on nothing. It is but a chip
// where the swath of another ring comes near to that place.
class Closing {
public:
    Closing(const RingPlan& plan, const std::vector<std::size_t>& cut, const RingPlan::Piece& piece)
        : piece_(piece), radius_(plan.radius * kUnitsPerMm) {
        for (const std::size_t c : cut)
            if (plan.pieces[c].ring == piece.ring || plan.pieces[c].ring == piece.ring + 1)
                beside_.push_back(&plan.pieces[c]);
    }
    /// Whether a wedge that begins there is low, or none would be lower anywhere.
    [[nodiscard]] bool good(const Start& start) const {
        return beside_.empty() || wedge_within(kLowWedge, start.segment, start.at);
    }
    /// Of the points with the lowest wedges, as far as these are told apart, the nearest to where the tool
    /// is; else `otherwise`.
    [[nodiscard]] Start nearest(Point2 at, const Start& otherwise) const {
        std::vector<std::pair<double, std::size_t>> points;
        for (std::size_t k = 0; k + 1 < piece_.points.size(); ++k)
            points.emplace_back(length(PathPoint{at.x, at.y, 0}, piece_.points[k]), k);
        std::sort(points.begin(), points.end());
        for (const double height : {kLowWedge, 2 * kLowWedge, 4 * kLowWedge, 6 * kLowWedge})
            for (const auto& [way, k] : points)
                if (wedge_within(height, k, piece_.points[k])) return {way, k, piece_.points[k], false};
        return otherwise;
    }

private:
    static constexpr double kLowWedge = 2;  // mm

    // Whether what is clear comes within `height` of halfway between a beginning and where the cutter meets
    // its own way.
    [[nodiscard]] bool wedge_within(double height, std::size_t segment, const PathPoint& at) const {
        const std::size_t n = piece_.points.size() - 1;
        PathPoint meets = at;
        for (std::size_t passed = 0; passed < n && length(at, meets) < 2 * radius_; ++passed)
            meets = piece_.points[(segment + n - passed) % n];
        const PathPoint halfway =
            between(at, meets, std::min(0.5, radius_ / std::max(1.0, length(at, meets))));
        const double reach = radius_ + height * kUnitsPerMm;
        return std::any_of(beside_.begin(), beside_.end(), [&](const RingPlan::Piece* f) {
            return halfway.x > f->box[0] - reach && halfway.x < f->box[2] + reach &&
                   halfway.y > f->box[1] - reach && halfway.y < f->box[3] + reach &&
                   near_line(halfway, f->points, reach);
        });
    }

    const RingPlan::Piece& piece_;
    const double radius_;                           // 0.1 µm
    std::vector<const RingPlan::Piece*> beside_{};  // those that have been cut, as far off and a step farther
};

}  // namespace

void clear_from_afar(PathBuilder& path, const LayerCut& cut, RingPlan plan) {
    if (plan.pieces.empty()) return;
    const double step_units = plan.step * kUnitsPerMm;
    const std::int32_t z = plan.z;
    cut_frames(path, plan);
    for (const std::vector<PathPoint>& strip : plan.strips) path.follow(strip);
    Turns turns(plan);
    std::size_t ring = 0;  // that the tool is on, while it is down; none yet
    std::vector<std::size_t> cut_already;
    while (!turns.ready.empty()) {
        cut.context.throw_if_cancelled();
        std::size_t next = SIZE_MAX;
        Start start;
        std::size_t far = 0;
        for (const std::size_t k : turns.ready) far = std::max(far, plan.pieces[k].ring);
        for (std::size_t k = 0; k < turns.ready.size(); ++k)
            if ((!plan.hold || plan.pieces[turns.ready[k]].ring == far) &&
                nearer(plan.pieces[turns.ready[k]], path.at(), !cut.job.cutting.climb, start))
                next = k;
        const std::size_t chosen = turns.ready[next];
        RingPlan::Piece& piece = plan.pieces[chosen];
        turns.ready.erase(turns.ready.begin() + static_cast<std::ptrdiff_t>(next));
        const std::size_t on = piece.ring;
        if (plan.from_open) begin_beside(turns, chosen, path.at(), piece, start);
        std::optional<Closing> closing;
        if (plan.hold && piece.closed && plan.step > kWedgeStep) closing.emplace(plan, cut_already, piece);
        if (closing && !closing->good(start)) start = closing->nearest(path.at(), start);
        // From ring to ring straight: a place `ring` steps from the forbidden region has that much room on
        // all sides. Slantwise, so that the cutter slides into the next ring, where there is room for the
        // longer way too.
        const bool along = path.is_down() && path.z() == z && piece.closed &&
                           start.way <= 1.02 * step_units &&
                           start.way <= 1.02 * static_cast<double>(ring) * step_units;
        if (along && static_cast<double>(ring) * step_units >
                         std::hypot(start.way, kSlide * step_units) + 0.05 * step_units) {
            Start slid = start;
            advance(piece.points, kSlide * step_units, slid);
            if (!closing || closing->good(slid)) start = slid;
        }
        if (piece.closed) piece.points = started_at(piece.points, start.segment, start.at);
        else if (start.reversed) std::reverse(piece.points.begin(), piece.points.end());
        if (along)
            for (const PathPoint& p : piece.points) path.cut({p.x, p.y}, z);
        else path.follow(piece.points);
        ring = on;
        turns.cut(chosen);
        if (plan.hold) cut_already.push_back(chosen);
    }
    path.retract();
}

}  // namespace slabwright
