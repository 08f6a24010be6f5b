// Into a finish cut and out of it on arcs that touch the run.
#include "engine/paths/runs/leads.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

namespace {

constexpr double kOverlap = 1.0;              // mm: a closed run goes on past its beginning
constexpr double kRadii[] = {2.0, 1.0, 0.5};  // mm: the widest arc that has room
constexpr double kTangent = 0.3;              // mm of the run that tell its direction

// A quarter of a circle that touches a run at its `end`, on the left of the direction (tx, ty) of travel,
// from the point away from the run to the last before it. Going out of a cut is going into it mirrored:
// `side` is then −1 and the direction reversed.
std::optional<std::vector<PathPoint>> quarter(PathBuilder& path, const LayerCut& cut, const DropIndex& part,
                                              double chord, PathPoint end, double tx, double ty,
                                              double side) {
    const double x = to_mm(end.x), y = to_mm(end.y), z = to_mm(end.z), nx = -side * ty, ny = side * tx;
    for (const double r : kRadii) {
        const int steps = std::max(4, static_cast<int>(std::ceil(r * std::numbers::pi / 2 / chord)));
        std::vector<PathPoint> arc;
        bool free = true;
        for (int k = 0; k < steps && free; ++k) {
            const double a = std::numbers::pi / 2 *
                             (1 - static_cast<double>(k) / steps);  // from the touching point backwards
            const double px = x - r * std::sin(a) * tx + r * (1 - std::cos(a)) * nx,
                         py = y - r * std::sin(a) * ty + r * (1 - std::cos(a)) * ny;
            const PathPoint p{to_units(px), to_units(py), end.z};
            free = px >= cut.low(0, 1e9) && px <= cut.high(0, 1e9) && py >= cut.low(1, 1e9) &&
                   py <= cut.high(1, 1e9) && path.has_room({p.x, p.y}) &&
                   !part.stands_over(to_mm(p.x), to_mm(p.y), z);
            arc.push_back(p);
        }
        if (free && path.standing_middle({arc.front().x, arc.front().y}) <= z + PathBuilder::kPlunge)
            return arc;
    }
    return std::nullopt;
}

}  // namespace

bool add_leads(PathBuilder& path, const LayerCut& cut, const DropIndex& part, double chord,
               std::vector<PathPoint>& run, PartSide side) {
    if (run.size() < 2) return false;
    const double free_side = side == PartSide::right ? 1 : -1;  // 1: the left
    // The direction over a stretch of the run, not over its first chord, which may be of any length.
    auto direction = [&](bool at_end, double& tx, double& ty) {
        const PathPoint from = at_end ? run.back() : run.front();
        for (std::size_t k = 1; k < run.size(); ++k) {
            const PathPoint& to = at_end ? run[run.size() - 1 - k] : run[k];
            tx = to_mm(std::int64_t{to.x} - from.x);
            ty = to_mm(std::int64_t{to.y} - from.y);
            const double l = std::hypot(tx, ty);
            if (l < kTangent && k + 1 < run.size()) continue;
            if (l == 0) return false;
            tx /= l;
            ty /= l;
            return true;
        }
        return false;
    };
    const bool closed = run.front() == run.back();
    double tx = 0, ty = 0;
    const bool has_start = direction(false, tx, ty);
    if (closed) {
        double past = 0;
        for (std::size_t k = 1, n = run.size(); k < n && past < kOverlap; ++k) {
            const double way = to_mm(1) * std::hypot(static_cast<double>(run[k].x) - run[k - 1].x,
                                                     static_cast<double>(run[k].y) - run[k - 1].y);
            PathPoint p = run[k];
            if (past + way > kOverlap) {  // on the chord, which is as good as its ends
                const double t = (kOverlap - past) / way;
                p = {run[k - 1].x + static_cast<std::int32_t>(
                                        std::lround(t * (static_cast<double>(p.x) - run[k - 1].x))),
                     run[k - 1].y + static_cast<std::int32_t>(
                                        std::lround(t * (static_cast<double>(p.y) - run[k - 1].y))),
                     p.z};
            }
            past += way;
            run.push_back(p);
        }
    }
    double ex = 0, ey = 0;
    if (direction(true, ex, ey))
        if (auto out = quarter(path, cut, part, chord, run.back(), ex, ey, -free_side))
            run.insert(run.end(), out->rbegin(), out->rend());
    if (!has_start) return false;
    const auto in = quarter(path, cut, part, chord, run.front(), tx, ty, free_side);
    if (in) run.insert(run.begin(), in->begin(), in->end());
    return in.has_value();
}

}  // namespace slabwright
