#include "engine/paths/rings.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slabwright {

namespace {

constexpr double kBeyond = 20;           // mm that the flask's region reaches past the stock
constexpr double kRingTolerance = 0.02;  // mm, as that of roughing's borders
constexpr double kStepShare = 0.45;      // of the diameter: less than the radius by what offsets and thinning may add

double length(const PathPoint& a, const PathPoint& b) { return std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y); }

// What a ring shows within a rectangle: the whole ring, or pieces of it.
struct Piece {
    std::vector<PathPoint> points;
    bool closed = false;
    bool done = false;
};

struct Rect {
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // 0.1 µm
};

// Liang and Barsky: the part of a segment within the rectangle, as parameters.
bool clip(const Rect& r, const PathPoint& a, const PathPoint& b, double& t0, double& t1) {
    const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y;
    t0 = 0, t1 = 1;
    for (const auto& [p, q] : {std::pair{-dx, a.x - r.x0}, {dx, r.x1 - a.x}, {-dy, a.y - r.y0}, {dy, r.y1 - a.y}}) {
        if (p == 0) {
            if (q < 0) return false;
        } else if (p < 0) {
            t0 = std::max(t0, q / p);
        } else {
            t1 = std::min(t1, q / p);
        }
    }
    return t0 <= t1;
}

// Travelled with the region on the right, so that the cutter climbs.
void append_pieces(std::span<const Point2> loop, std::int32_t z, const Rect& rect, std::vector<Piece>& out) {
    std::vector<PathPoint> ring;
    for (std::size_t k = loop.size(); k-- > 0;) ring.push_back({loop[k].x, loop[k].y, z});
    auto outside = [&](const PathPoint& p) { return p.x < rect.x0 || p.x > rect.x1 || p.y < rect.y0 || p.y > rect.y1; };
    const auto first_out = std::find_if(ring.begin(), ring.end(), outside);
    const double tolerance = kRingTolerance * kUnitsPerMm;
    if (first_out == ring.end()) {
        ring.push_back(ring.front());
        out.push_back({simplify(ring, tolerance), true, false});
        return;
    }
    std::rotate(ring.begin(), first_out, ring.end());
    ring.push_back(ring.front());
    Piece piece;
    auto close = [&] {
        if (piece.points.size() > 1) out.push_back({simplify(piece.points, tolerance), false, false});
        piece.points.clear();
    };
    for (std::size_t k = 0; k + 1 < ring.size(); ++k) {
        const PathPoint &a = ring[k], &b = ring[k + 1];
        double t0 = 0, t1 = 0;
        if (!clip(rect, a, b, t0, t1)) {
            close();
            continue;
        }
        auto at = [&](double t) {
            return PathPoint{static_cast<std::int32_t>(std::lround(a.x + t * (static_cast<double>(b.x) - a.x))),
                             static_cast<std::int32_t>(std::lround(a.y + t * (static_cast<double>(b.y) - a.y))), z};
        };
        if (t0 > 0) close();
        if (piece.points.empty()) piece.points.push_back(t0 > 0 ? at(t0) : a);
        piece.points.push_back(t1 < 1 ? at(t1) : b);
        if (t1 < 1) close();
    }
    close();
}

// The nearest point of a piece: of an open one, its start only.
double nearest(const Piece& piece, Point2 from, std::size_t& segment, PathPoint& at) {
    const PathPoint q{from.x, from.y, 0};
    segment = 0;
    at = piece.points.front();
    double best = length(q, at);
    if (!piece.closed) return best;
    for (std::size_t k = 0; k + 1 < piece.points.size(); ++k) {
        const PathPoint &a = piece.points[k], &b = piece.points[k + 1];
        const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y, l2 = dx * dx + dy * dy;
        const double t = l2 > 0 ? std::clamp(((static_cast<double>(q.x) - a.x) * dx + (static_cast<double>(q.y) - a.y) * dy) / l2, 0.0, 1.0) : 0;
        const PathPoint p{static_cast<std::int32_t>(std::lround(a.x + t * dx)), static_cast<std::int32_t>(std::lround(a.y + t * dy)), a.z};
        if (const double d = length(q, p); d < best) best = d, segment = k, at = p;
    }
    return best;
}

// A closed ring that starts and ends at a point of one of its segments.
std::vector<PathPoint> started_at(const std::vector<PathPoint>& ring, std::size_t segment, const PathPoint& at) {
    std::vector<PathPoint> result{at};
    const std::size_t n = ring.size() - 1;
    for (std::size_t k = 1; k <= n; ++k) {
        const PathPoint& p = ring[(segment + k) % n];
        if (!(p == result.back())) result.push_back(p);
    }
    if (!(result.back() == at)) result.push_back(at);
    return result;
}

// A rectangle well past the stock and the tool's reach.
Loops around_stock(const LayerCut& cut, double r) {
    const auto &lo = cut.layer.stock_min, &hi = cut.layer.stock_max;
    const double beyond = 2 * r + kBeyond;
    Loops around;
    around.points = {{to_units(lo[0] - beyond), to_units(lo[1] - beyond)},
                     {to_units(hi[0] + beyond), to_units(lo[1] - beyond)},
                     {to_units(hi[0] + beyond), to_units(hi[1] + beyond)},
                     {to_units(lo[0] - beyond), to_units(hi[1] + beyond)}};
    around.close_loop();
    return around;
}

}  // namespace

Loops forbidden_region(const Contours& contours) {
    Loops region;  // contours have the solid on their right, loops on their left
    for (std::size_t c = 0; c < contours.size(); ++c) {
        if (contours.starts[c + 1] - contours.starts[c] < 3) continue;
        for (std::size_t k = contours.starts[c + 1]; k-- > contours.starts[c];) region.points.push_back(contours.points[k]);
        region.close_loop();
    }
    return region;
}

Loops flask_room(const LayerCut& cut, double r) {
    return subtract(cut.layer.opening, offset(subtract(around_stock(cut, r), cut.layer.opening), r, 0.01));
}

Loops beyond_room(const LayerCut& cut, double r, const Loops& room) { return subtract(around_stock(cut, r), room); }

Fibres beside_flask(const LayerCut& cut, const Loops& room, Fibres forbidden, Axis axis, std::span<const std::int32_t> lines) {
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
    for (std::size_t i = 0; i < lines.size(); ++i) {
        std::vector<Forbidden> all(forbidden.line(i).begin(), forbidden.line(i).end());
        double end = -far;
        for (const Span& s : line_spans(seen, lines[i])) {
            all.push_back({end, s.low / kUnitsPerMm, 0, 0});
            end = s.high / kUnitsPerMm;
        }
        all.push_back({end, far, 0, 0});
        std::sort(all.begin(), all.end(), [](const Forbidden& a, const Forbidden& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; });
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

void cut_ring(PathBuilder& path, const std::vector<PathPoint>& ring, std::int32_t above, std::int32_t z, double ramp_deg) {
    path.sink(above);
    double around = 0;
    for (std::size_t k = 1; k < ring.size(); ++k) around += length(ring[k - 1], ring[k]);
    const double drop = static_cast<double>(above) - z;
    if (around < 1 || drop <= 0) {
        path.plunge(z);
        for (const PathPoint& p : ring) path.cut({p.x, p.y}, z);
        return;
    }
    const double ramp = drop / std::tan(ramp_deg * std::numbers::pi / 180);
    double done = 0;
    bool down = false;
    for (std::size_t k = 1; done < ramp + around; k = k + 1 < ring.size() ? k + 1 : 1) {
        const double l = length(ring[k - 1], ring[k]);
        if (!down && done + l >= ramp) {  // the bottom is reached on this segment; from here once around
            const double t = l > 0 ? (ramp - done) / l : 1;
            path.cut({static_cast<std::int32_t>(std::lround(ring[k - 1].x + t * (static_cast<double>(ring[k].x) - ring[k - 1].x))),
                      static_cast<std::int32_t>(std::lround(ring[k - 1].y + t * (static_cast<double>(ring[k].y) - ring[k - 1].y)))},
                     z);
            down = true;
        }
        done += l;
        path.cut({ring[k].x, ring[k].y}, down ? z : std::max(z, above - static_cast<std::int32_t>(drop * done / ramp)));
    }
}

double clear_from_afar(PathBuilder& path, const LayerCut& cut, const Tool& tool, const Loops& forbidden, double tip_z) {
    const double r = tool.diameter / 2, step = std::min(kStepShare, tool.stepover) * tool.diameter;
    const Rect rect{cut.low(0, r + 2) * kUnitsPerMm, cut.low(1, r + 2) * kUnitsPerMm, cut.high(0, r + 2) * kUnitsPerMm,
                    cut.high(1, r + 2) * kUnitsPerMm};
    const std::int32_t z = to_units(tip_z);
    std::vector<std::vector<Piece>> rings;
    for (Loops region = simplify(forbidden);;) {
        std::vector<Piece> pieces;
        for (std::size_t l = 0; l < region.size(); ++l) append_pieces(region.loop(l), z, rect, pieces);
        if (pieces.empty()) break;
        rings.push_back(std::move(pieces));
        region = offset(region, step, kRingTolerance);
        cut.context.throw_if_cancelled();
    }
    for (std::size_t k = rings.size(); k-- > 0;) {
        std::vector<Piece>& pieces = rings[k];
        for (std::size_t n = 0; n < pieces.size(); ++n) {
            Piece* next = nullptr;
            double way = 0;
            std::size_t segment = 0;
            PathPoint at;
            for (Piece& piece : pieces) {
                if (piece.done) continue;
                std::size_t s = 0;
                PathPoint p;
                const double d = nearest(piece, path.at(), s, p);
                if (!next || d < way) next = &piece, way = d, segment = s, at = p;
            }
            next->done = true;
            if (next->closed) next->points = started_at(next->points, segment, at);
            const PathPoint& start = next->points.front();
            // From ring to ring the straight way of one step is free: it runs from a point a step away from the inner region to
            // the nearest point of that region.
            const bool along = path.is_down() && path.z() == z && next->closed && way <= 1.02 * step * kUnitsPerMm;
            if (along) {
                path.cut({start.x, start.y}, z);
                for (const PathPoint& p : next->points) path.cut({p.x, p.y}, z);
                continue;
            }
            path.follow(next->points);
        }
    }
    path.retract();
    return step;
}

}  // namespace slabwright
