#include "engine/paths/runs/chains.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/moves/order.h"

namespace slabwright {

namespace {

constexpr double kMostParts =
    8;  // of a way along the surface; one that is longer is a wall's, and is hopped over

double length(const PathPoint& a, const PathPoint& b) {
    return std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y,
                      static_cast<double>(b.z) - a.z);
}

Point2 flat_of(const PathPoint& p) { return {p.x, p.y}; }

double way(const PathPoint& a, Point2 b) {
    return std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y);
}

// Whether a flat end mill may go from one place to another as straight as a slope.
bool slope_is_free(const PathPoint& from, const PathPoint& to, const Slide& slide) {
    const Vec3d a{to_mm(from.x), to_mm(from.y), to_mm(from.z)}, b{to_mm(to.x), to_mm(to.y), to_mm(to.z)};
    return std::abs(b[2] - a[2]) <= slide.steepest * std::hypot(b[0] - a[0], b[1] - a[1]) &&
           slide.part->way_is_free(a, b, slide.over);
}

// Appends a free place to a line whose last place is free, over the corner above the lower of the two where
// the straight way may not be free.
void append_by_steps(std::vector<PathPoint>& line, PathPoint p, const Slide& slide) {
    if (!line.empty()) {
        const PathPoint& q = line.back();
        const double dz = static_cast<double>(p.z) - q.z;
        if (slide.ball ? length(q, p) > slide.chord * kUnitsPerMm : dz != 0) {
            const PathPoint corner = dz > 0 ? PathPoint{q.x, q.y, p.z} : PathPoint{p.x, p.y, q.z};
            if (!(corner == q) && !(corner == p)) line.push_back(corner);
        }
    }
    line.push_back(p);
}

// A place between two, on the straight way or on the surface where that is higher; none on the top.
std::optional<PathPoint> free_between(const PathPoint& from, const PathPoint& to, double t,
                                      const Slide& slide) {
    PathPoint p{static_cast<std::int32_t>(from.x + t * (static_cast<double>(to.x) - from.x)),
                static_cast<std::int32_t>(from.y + t * (static_cast<double>(to.y) - from.y)), 0};
    const double lerp = from.z + t * (static_cast<double>(to.z) - from.z),
                 matters = std::min(lerp / kUnitsPerMm, slide.top) - slide.under - 0.01,
                 rest = slide.part->drop(to_mm(p.x), to_mm(p.y), matters).tip_z + slide.under;
    if (rest >= slide.top - 1e-3) return std::nullopt;
    p.z = static_cast<std::int32_t>(std::ceil(std::max(lerp, rest * kUnitsPerMm))) + 1;
    return p;
}

// The places from one to another, the first left out; none where the way along the surface climbs onto the
// top.
std::optional<std::vector<PathPoint>> slide_between(const PathPoint& from, const PathPoint& to,
                                                    const Slide& slide) {
    std::vector<PathPoint> link{from};
    std::int32_t highest = std::max(from.z, to.z);
    const auto n =
        static_cast<std::size_t>(std::ceil(way(from, flat_of(to)) / (0.75 * slide.chord * kUnitsPerMm)));
    for (std::size_t i = 1; i < n; ++i) {
        const auto p = free_between(from, to, static_cast<double>(i) / static_cast<double>(n), slide);
        if (!p) return std::nullopt;
        highest = std::max(highest, p->z);
        append_by_steps(link, *p, slide);
    }
    append_by_steps(link, to, slide);
    if (slide.hops && link.size() > n + 1) {  // by steps
        link = {from};
        if (slide.ball || !slope_is_free(from, to, slide))
            for (const PathPoint& p : {PathPoint{from.x, from.y, highest}, {to.x, to.y, highest}})
                if (!(p == link.back()) && !(p == to)) link.push_back(p);
        link.push_back(to);
    }
    link.erase(link.begin());
    return link;
}

std::vector<Beginning> both_ends(const std::vector<std::vector<PathPoint>>& runs) {
    std::vector<Beginning> ends;
    for (std::uint32_t k = 0; k < runs.size(); ++k) {
        const Point2 a = flat_of(runs[k].front()), b = flat_of(runs[k].back());
        ends.push_back({a, b, k, 0});
        if (!(a == b)) ends.push_back({b, a, k, 1});
    }
    return ends;
}

}  // namespace

void append_free(std::vector<PathPoint>& line, PathPoint p, const Slide& slide) {
    if (slide.ball && !line.empty()) {
        const PathPoint from = line.back();
        const double parts = std::ceil(length(from, p) / (slide.chord * kUnitsPerMm));
        for (double k = 1; k < parts && parts <= kMostParts; ++k)
            if (const auto between = free_between(from, p, k / parts, slide))
                append_by_steps(line, *between, slide);
    }
    append_by_steps(line, p, slide);
}

std::vector<std::vector<PathPoint>> chained(std::vector<std::vector<PathPoint>> runs, const Slide& slide) {
    NearestRuns left(both_ends(runs), runs.size());
    std::vector<char> done(runs.size(), 0);
    std::vector<std::vector<PathPoint>> chains;
    for (std::uint32_t first = 0; first < runs.size(); ++first) {
        if (done[first]) continue;
        std::vector<PathPoint> chain = runs[first];
        done[first] = 1;
        left.remove(first);
        while (!left.empty()) {
            const Beginning next = left.nearest(flat_of(chain.back()));
            if (way(chain.back(), next.at) > slide.near * kUnitsPerMm) break;
            std::vector<PathPoint>& run = runs[next.run];
            if (next.place == 1) std::reverse(run.begin(), run.end());
            const auto link = slide_between(chain.back(), run.front(), slide);
            if (!link) {
                if (next.place == 1) std::reverse(run.begin(), run.end());
                break;
            }
            chain.insert(chain.end(), link->begin(), link->end());
            chain.insert(chain.end(), run.begin() + 1, run.end());
            done[next.run] = 1;
            left.remove(next.run);
        }
        chains.push_back(std::move(chain));
    }
    return chains;
}

void follow_nearest(PathBuilder& path, const std::vector<std::vector<PathPoint>>& chains) {
    const std::size_t left_out = path.left_out();
    for (const Beginning& next :
         shortened(nearest_order(both_ends(chains), chains.size(), path.at()), path.at())) {
        std::vector<PathPoint> chain = chains[next.run];
        if (next.place == 1) std::reverse(chain.begin(), chain.end());
        path.follow(chain);
    }
    path.follow_left_out(left_out);
}

}  // namespace slabwright
