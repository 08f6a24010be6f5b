// Greedy: from every point the longest arc that fits, found by doubling and bisection. The centre is rounded
// to 0.1 µm and the arc judged as rounded, so the program says exactly what was judged.
#include "engine/moves/arcs.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "engine/moves/thinning.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

/// From the arc's begin to its centre, 0.1 µm.
struct Centre {
    std::int32_t i = 0, j = 0;
};

/// The arc through the first and the last point that lies within the tolerance of all chords between, if
/// there is one. Its centre lies on the chord's bisector at the height h that is best in the least squares of
/// |q − c|² − r², taken along the chords (Simpson's rule); that is linear in h: with q from the chord's
/// middle and n its normal, |q|² − L²/4 − 2h·n·q.
std::optional<Centre> arc_through(std::span<const PathPoint> line, const ArcFit& fit) {
    const PathPoint &first = line.front(), &last = line.back();
    auto from_first = [&](const PathPoint& p) {
        return Vec2d{static_cast<double>(p.x) - first.x, static_cast<double>(p.y) - first.y};
    };
    const Vec2d end = from_first(last), middle{end.x / 2, end.y / 2};
    const double chord = length(end);
    if (chord == 0) return std::nullopt;
    const Vec2d normal{-end.y / chord, end.x / chord};
    double ww = 0, wb = 0;
    for (std::size_t m = 1; m < line.size(); ++m) {
        const Vec2d a = from_first(line[m - 1]) - middle, b = from_first(line[m]) - middle,
                    half{(a.x + b.x) / 2, (a.y + b.y) / 2};
        const double share = length(b - a);
        for (const auto& [q, simpson] : {std::pair{a, 1.0}, {half, 4.0}, {b, 1.0}}) {
            const double w = 2 * dot(normal, q);
            ww += share * simpson * w * w;
            wb += share * simpson * w * (dot(q, q) - chord * chord / 4);
        }
    }
    if (!(ww > 0)) return std::nullopt;
    const double h = wb / ww;
    if (!(std::hypot(h, chord / 2) <= fit.max_radius)) return std::nullopt;
    const Centre centre{static_cast<std::int32_t>(std::lround(middle.x + h * normal.x)),
                        static_cast<std::int32_t>(std::lround(middle.y + h * normal.y))};

    const Vec2d c{static_cast<double>(centre.i), static_cast<double>(centre.j)}, begin{-c.x, -c.y};
    const double radius = length(begin), slack = fit.tolerance - std::abs(length(end - c) - radius);
    const double turn = cross(end, c) > 0 ? 1 : -1;
    const double sweep = std::atan2(turn * cross(begin, end - c), dot(begin, end - c));
    if (radius < fit.min_radius || slack <= 0 || !(sweep > 0) || sweep > fit.max_sweep) return std::nullopt;
    if (radius * (1 - std::cos(sweep / 2)) <= fit.tolerance) return std::nullopt;  // a chord does
    // Each chord goes on round the centre and the whole stays under half a turn, so arc and chords can be
    // compared angle by angle; a chord is farthest from the centre at an end, nearest at the foot of the
    // perpendicular or at an end.
    Vec2d before = begin;
    for (std::size_t m = 1; m < line.size(); ++m) {
        const Vec2d p = from_first(line[m]) - c, way = p - before;
        if (turn * cross(before, p) <= 0 || turn * cross(begin, p) <= 0) return std::nullopt;
        double nearest = length(p);
        if (std::abs(nearest - radius) > slack) return std::nullopt;
        const double t = -dot(before, way) / dot(way, way);
        if (t > 0 && t < 1) nearest = std::abs(cross(before, way)) / length(way);
        if (radius - nearest > slack) return std::nullopt;
        before = p;
    }
    return centre;
}

/// The path of one chain as it is put together: arcs at once, chords when the next arc or the end shows how
/// far they go.
class Chain {
public:
    Chain(std::vector<Move>& out, std::span<const PathPoint> line, std::uint32_t feed, const ArcFit& fit)
        : out_(out), line_(line), feed_(feed), fit_(fit) {
        const double speed = feed / 60.0;  // mm/s
        if (fit.acceleration > 0)
            fit_.min_radius = std::max(fit.min_radius, speed * speed / fit.acceleration * kUnitsPerMm);
    }

    void run() {
        std::size_t at = 0, chords_from = 0;
        while (at + 1 < line_.size()) {
            const auto [to, centre] = longest_arc(at);
            if (to == at) {
                ++at;
                continue;
            }
            chords(chords_from, at);
            out_.push_back({line_[to].x, line_[to].y, line_[to].z, feed_, centre.i, centre.j});
            at = chords_from = to;
        }
        chords(chords_from, line_.size() - 1);
    }

private:
    std::pair<std::size_t, Centre> longest_arc(std::size_t from) const {
        const std::size_t shortest = static_cast<std::size_t>(fit_.min_chords);
        std::size_t level = from;  // the last point at this z
        const std::size_t limit = line_.size() - 1;
        auto extend = [&](std::size_t to) {
            while (level < to && line_[level + 1].z == line_[from].z) ++level;
            return level >= to;
        };
        std::size_t good = from, bad = limit + 1;
        Centre best;
        auto fits = [&](std::size_t to) {
            if (!extend(to)) return false;
            const auto centre = arc_through(line_.subspan(from, to - from + 1), fit_);
            if (centre) best = *centre, good = to;
            return centre.has_value();
        };
        if (!fit_.arcs) return {from, best};
        for (std::size_t count = shortest; from + count <= limit; count *= 2)
            if (!fits(from + count)) {
                bad = from + count;
                break;
            }
        if (good == from) return {from, best};
        while (bad - good > 1) {
            const std::size_t middle = good + (bad - good) / 2;
            if (!fits(middle)) bad = middle;
        }
        return {good, best};
    }

    /// In pieces, for the time of `simplify` may grow with the square of the points.
    void chords(std::size_t from, std::size_t to) {
        constexpr std::size_t piece = 128;
        while (from < to) {
            const std::size_t end = std::min(to, from + piece);
            const std::vector<PathPoint> kept = simplify(line_.subspan(from, end - from + 1), fit_.tolerance);
            for (std::size_t m = 1; m < kept.size(); ++m)
                out_.push_back({kept[m].x, kept[m].y, kept[m].z, feed_});
            from = end;
        }
    }

    std::vector<Move>& out_;
    std::span<const PathPoint> line_;
    std::uint32_t feed_;
    ArcFit fit_;  // at this feed
};

}  // namespace

void fit_arcs(std::vector<Move>& moves, const ArcFit& fit) {
    if (moves.empty()) return;
    std::vector<Move> out{moves.front()};
    std::vector<PathPoint> line;
    for (std::size_t m = 1; m < moves.size();) {
        const std::uint32_t feed = moves[m].feed;
        if (feed == 0 || moves[m].is_arc()) {
            out.push_back(moves[m++]);
            continue;
        }
        line.assign(1, {moves[m - 1].x, moves[m - 1].y, moves[m - 1].z});
        for (; m < moves.size() && moves[m].feed == feed && !moves[m].is_arc(); ++m)
            line.push_back({moves[m].x, moves[m].y, moves[m].z});
        Chain(out, line, feed, fit).run();
    }
    out.shrink_to_fit();
    moves = std::move(out);
}

}  // namespace slabwright
