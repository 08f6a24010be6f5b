#include "engine/paths/runs/rings.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/paths/runs/plan_view.h"
#include "kernels/geometry/vectors.h"
#include "kernels/polygons/runs_inside.h"

namespace slabwright {

namespace {

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
constexpr double kMostBreadth = 0.8;  // of its diameter
constexpr double kBeside = 0.5;       // mm of air between the stock and a cutter that goes down beside it
constexpr double kOnEdge = 0.1;       // mm
constexpr std::size_t kRingsBesideStrips =
    2;  // steps from the forbidden region to the farthest ring, where strips lie beyond
constexpr double kMostBetweenStrips = 0.1;  // of the strips' length: the ways between them
constexpr double kShortestTerrace =
    2;  // mm of a terrace's border ring: shorter ones are corners of walls that need none

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

void cut_ring(PathBuilder& path, const std::vector<PathPoint>& ring, std::int32_t above, std::int32_t z,
              double ramp_deg) {
    const double around = plan_length(ring);
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
        const double l = plan_length(ring[k - 1], ring[k]);
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
        b = &c;
        ux = vx;
        uy = vy;
        u2 = v2;
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

// Where the middle of a cutter of radius `r` is of use on what stands in a rectangle (smallest x and y,
// largest x and y), mm.
Loops useful_area(const LayerCut& cut, double r, const std::array<double, 4>& stands) {
    const double far = r + 2;
    return intersect(
        offset_outline(rectangle(stands[0], stands[1], stands[2], stands[3]), r + kBeside, kFineRing),
        rectangle(cut.low(0, far), cut.low(1, far), cut.high(0, far), cut.high(1, far)));
}

// Splits loops, none of which crosses another, into those surely inside a convex region of one loop and the
// rest.
struct LoopsByConvex {
    Loops within, others;
    LoopsByConvex(const Loops& convex, const Loops& loops) {
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
    const LoopsByConvex parted(convex, loops);
    return joined(parted.others.empty() ? Loops{} : intersect(convex, parted.others), parted.within, false);
}
Loops beside_in_convex(const Loops& convex, const Loops& loops) {
    const LoopsByConvex parted(convex, loops);
    return joined(parted.others.empty() ? convex : subtract(convex, parted.others), parted.within, true);
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
        cut +=
            plan_length(run.points) + (run.closed ? plan_length(run.points.back(), run.points.front()) : 0);
        if (last != nullptr && !last->closed && !run.closed)
            between += plan_length(last->points.back(), run.points.front());
        last = &run;
    }
    if (runs.empty() || between > kMostBetweenStrips * cut) return false;
    for (const RunInside& run : runs) {
        std::vector<PathPoint> strip;
        // From the rectangle before, where the cutter has room; farther along where that begins later. So
        // near to its beginning, which is two steps from what is forbidden, the way is free.
        const Point2 a = run.points[0], b = run.points[1];
        const double l = plan_length(a, b), ux = (static_cast<double>(b.x) - a.x) / l,
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

// What stands, and how much of it a ring takes beyond its own line, mm, so that no farther ring is cut for
// it.
struct Beyond {
    Loops stands{};
    double takes = 0, radius = 0;

    // Where the next ring is of use.
    [[nodiscard]] Loops next(const Loops& region) const {
        return offset_outline(subtract(stands, offset_outline(region, takes, kFineRing)), radius, kFineRing);
    }
};

// Where rings around a region are of use.
struct Use {
    Loops border, others;            // of the ring on the region's border, and of all others
    double shortest = 0;             // mm of the border: shorter pieces are left out
    std::optional<Beyond> beyond{};  // of those others that take something else than the ring before
};

// Rings around a region, a step apart, as far as they are of use; no farther than `last` steps.
void append_rings(RingPlan& plan, const LayerCut& cut, const Thinning& thinning, Loops region, const Use& use,
                  std::size_t last) {
    Loops others = use.others;
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
        for (const RunInside& run : runs_inside(around, ring == 0 ? use.border : others)) {
            std::vector<PathPoint> points;
            for (const Point2 p : run.points) points.push_back({p.x, p.y, plan.z});
            if (run.closed) points.push_back(points.front());
            if (ring == 0 && !run.closed && plan_length(points) < use.shortest * kUnitsPerMm) continue;
            plan.pieces.push_back({ring == 0 ? simplify(points, kFineRing * kUnitsPerMm) : std::move(points),
                                   {},
                                   ring,
                                   0,
                                   run.closed});
            note_box(plan.pieces.back());
        }
        if (plan.pieces.size() == first && ring > 0) return;
        cut.context.throw_if_cancelled();
        if (use.beyond) others = intersect(use.others, use.beyond->next(region));
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
    return std::min(clearing_step(tool), std::max(widest, kLeastStep * tool.diameter));
}

double ring_tolerance(const Tool& tool) { return std::max(kFineRing, kRingShare * tool.diameter); }

namespace {

// What a face mill's ring takes beyond its line, where a farther one would find little: more than it may meet
// at full feed, for to go a little slower costs less than another ring.
Beyond beyond_of(const LayerCut& cut, const Tool& tool, const std::array<double, 4>& stands) {
    const double r = tool.diameter / 2, sure = r - 2 * ring_tolerance(tool) - kOffLine;
    return {rectangle(stands[0], stands[1], stands[2], stands[3]),
            std::min(sure, (2 * std::max(kMostBreadth, cut.job.cutting.max_engagement) - 1) * r), r};
}

}  // namespace

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
        Use use{useful, useful};
        if (tool.kind == ToolKind::face) use.beyond = beyond_of(cut, tool, stands);
        append_rings(plan, cut, thinning, forbidden, use, round ? kRingsBesideStrips : SIZE_MAX);
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

}  // namespace slabwright
