#include "kernels/features/holes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "kernels/errors.h"
#include "kernels/features/hole_ends.h"
#include "kernels/features/round_walls.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

std::string_view name(HoleKind kind) {
    switch (kind) {
        case HoleKind::plain:
            return "plain";
        case HoleKind::counterbored:
            return "counterbored";
        case HoleKind::countersunk:
            return "countersunk";
        case HoleKind::stepped:
            return "stepped";
    }
    return "";
}

std::string_view name(HoleBottom bottom) {
    switch (bottom) {
        case HoleBottom::open:
            return "open";
        case HoleBottom::flat:
            return "flat";
        case HoleBottom::cone:
            return "cone";
        case HoleBottom::other:
            return "other";
    }
    return "";
}

namespace {

using Beyond = WallEnd::Beyond;

constexpr double kClearShare = 0.9;    // of the radius: nothing may stand this near to the axis
constexpr double kShallowShare = 0.5;  // of the radius: a wall lower than this with a smooth end is a dish's

// The distance from a wall's axis to the part of a facet between two places along it.
double distance_between(const Cylinder& cylinder, const std::array<Vec3d, 2>& uv, double low, double high,
                        const std::array<Point3, 3>& facet) {
    struct Corner {
        double x, y, t;
    };
    std::array<Corner, 8> polygon, clipped;
    std::size_t n = 0;
    for (const Point3& p : facet) {
        const Vec3d d = minus(p, cylinder.at);
        polygon[n++] = {dot(d, uv[0]), dot(d, uv[1]), dot(d, cylinder.axis)};
    }
    for (const int side : {0, 1}) {
        const auto inside = [&](const Corner& c) { return side == 0 ? c.t - low : high - c.t; };
        std::size_t m = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const Corner &a = polygon[i], &b = polygon[(i + 1) % n];
            const double ia = inside(a), ib = inside(b);
            if (ia >= 0) clipped[m++] = a;
            if ((ia >= 0) != (ib >= 0)) {
                const double s = ia / (ia - ib);
                clipped[m++] = {a.x + s * (b.x - a.x), a.y + s * (b.y - a.y), a.t + s * (b.t - a.t)};
            }
        }
        polygon = clipped;
        n = m;
    }
    double nearest = HUGE_VAL;
    bool left = n > 2, right = n > 2;
    for (std::size_t i = 0; i < n; ++i) {
        const Corner &a = polygon[i], &b = polygon[(i + 1) % n];
        const double ex = b.x - a.x, ey = b.y - a.y, length2 = ex * ex + ey * ey;
        const double turn = a.x * b.y - a.y * b.x;
        left = left && turn >= 0;
        right = right && turn <= 0;
        const double s = length2 > 0 ? std::clamp(-(a.x * ex + a.y * ey) / length2, 0.0, 1.0) : 0;
        nearest = std::min(nearest, std::hypot(a.x + s * ex, a.y + s * ey));
    }
    return left != right && n > 2 ? 0 : nearest;
}

// Whether nothing of the mesh stands inside a wall, where it is whole all around.
bool is_clear(const MeshView& mesh, const RoundWall& wall) {
    const double margin = 0.01 + 0.02 * (wall.round_high - wall.round_low);
    const double low = wall.round_low + margin, high = wall.round_high - margin;
    if (!(low < high)) return true;
    const auto uv = across(wall.cylinder.axis);
    const double most = kClearShare * wall.cylinder.radius;
    const Point3 middle = plus(wall.cylinder.at, wall.cylinder.axis, (low + high) / 2);
    const double half = (high - low) / 2;
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        std::array<Point3, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) corners[k] = to_double(mesh.vertices[mesh.facets[f][k]]);
        const double reach = std::sqrt(
            std::max(squared_distance(corners[0], corners[1]), squared_distance(corners[0], corners[2])));
        const double far = reach + half + most;
        if (squared_distance(corners[0], middle) > far * far) continue;
        if (std::binary_search(wall.facets.begin(), wall.facets.end(), static_cast<std::uint32_t>(f)))
            continue;
        if (distance_between(wall.cylinder, uv, low, high, corners) < most) return false;
    }
    return true;
}

// A wall in a hole, its ends in the order in which the hole is gone through.
struct Link {
    std::uint32_t wall;
    int mouth_end;  // 0: its low end lies towards the mouth
};

class HoleMaker {
public:
    HoleMaker(Context& context, const FacetBends& bends, std::vector<RoundWall> walls)
        : bends_(bends), walls_(std::move(walls)), ends_(walls_.size()), clear_(walls_.size(), 0) {
        std::vector<std::uint32_t> wall_of(bends.mesh().size(), kNoWall);
        for (std::size_t w = 0; w < walls_.size(); ++w)
            for (const std::uint32_t f : walls_[w].facets) wall_of[f] = static_cast<std::uint32_t>(w);
        parallel_each(context, walls_.size(), [&](std::size_t w) {
            for (const int end : {0, 1})
                ends_[w][static_cast<std::size_t>(end)] =
                    look_beyond(bends_, walls_, wall_of, static_cast<std::uint32_t>(w), end);
            clear_[w] = is_clear(bends_.mesh(), walls_[w]) ? 1 : 0;
        });
        join();
    }

    std::vector<RoundHole> all() {
        std::vector<RoundHole> holes;
        std::vector<bool> seen(walls_.size(), false);
        for (std::uint32_t w = 0; w < walls_.size(); ++w) {
            if (seen[w]) continue;
            std::vector<Link> chain = chain_of(w);
            for (const Link& link : chain) seen[link.wall] = true;
            if (is_hole(chain)) holes.push_back(made_of(std::move(chain)));
        }
        std::sort(holes.begin(), holes.end(),
                  [](const RoundHole& a, const RoundHole& b) { return a.facets.front() < b.facets.front(); });
        return holes;
    }

private:
    struct Partner {
        std::uint32_t wall = kNoWall;
        int end = 0;
    };

    const WallEnd& end_of(std::uint32_t wall, int end) const {
        return ends_[wall][static_cast<std::size_t>(end)];
    }
    Partner& partner(std::uint32_t wall, int end) { return partners_[wall][static_cast<std::size_t>(end)]; }

    // Both walls of a joint come to know it. The nearer end of the other wall is the one that faces this.
    void join() {
        partners_.resize(walls_.size());
        for (std::uint32_t w = 0; w < walls_.size(); ++w)
            for (const int end : {0, 1}) {
                const std::uint32_t other = end_of(w, end).next;
                if (other == kNoWall) continue;
                const RoundWall& wall = walls_[w];
                const Cylinder& c = walls_[other].cylinder;
                const Point3 here =
                    plus(wall.cylinder.at, wall.cylinder.axis, end == 1 ? wall.high : wall.low);
                const double along = c.place(here).along;
                const int facing =
                    std::abs(along - walls_[other].high) < std::abs(along - walls_[other].low) ? 1 : 0;
                if (partner(w, end).wall != kNoWall || partner(other, facing).wall != kNoWall) continue;
                partner(w, end) = {other, facing};
                partner(other, facing) = {w, end};
            }
    }

    // From one end to the other; a ring of walls cannot be, since each lies farther along the axis.
    std::vector<Link> chain_of(std::uint32_t wall) {
        Link at{wall, 0};
        for (std::size_t i = 0; i < walls_.size(); ++i) {
            const Partner back = partner(at.wall, at.mouth_end);
            if (back.wall == kNoWall) break;
            at = {back.wall, 1 - back.end};
        }
        std::vector<Link> chain{at};
        while (chain.size() <= walls_.size()) {
            const Partner on = partner(chain.back().wall, 1 - chain.back().mouth_end);
            if (on.wall == kNoWall) break;
            chain.push_back({on.wall, on.end});
        }
        return chain;
    }

    static bool is_open(const WallEnd& end) {
        return end.beyond == Beyond::mouth || (end.beyond == Beyond::cone && end.is_open);
    }
    const WallEnd& first_end(const std::vector<Link>& chain) const {
        return end_of(chain.front().wall, chain.front().mouth_end);
    }
    const WallEnd& last_end(const std::vector<Link>& chain) const {
        return end_of(chain.back().wall, 1 - chain.back().mouth_end);
    }

    bool is_hole(const std::vector<Link>& chain) const {
        if (!is_open(first_end(chain)) && !is_open(last_end(chain))) return false;
        for (const Link& link : chain) {
            if (clear_[link.wall] == 0) return false;
            const RoundWall& wall = walls_[link.wall];
            const bool is_smooth = end_of(link.wall, 0).is_smooth || end_of(link.wall, 1).is_smooth;
            if (is_smooth && wall.high - wall.low < kShallowShare * wall.cylinder.radius) return false;
        }
        return true;
    }

    static void turn_around(std::vector<Link>& chain) {
        std::reverse(chain.begin(), chain.end());
        for (Link& link : chain) link.mouth_end = 1 - link.mouth_end;
    }

    // The radius with which a hole begins at an end.
    double mouth_radius(std::uint32_t wall, const WallEnd& end) const {
        return end.beyond == Beyond::cone && end.is_open ? end.far_end.radius : walls_[wall].cylinder.radius;
    }

    Vec3d into(const Link& link) const {
        return scaled(link.mouth_end == 0 ? 1 : -1, walls_[link.wall].cylinder.axis);
    }

    // The chain from its mouth on; of two mouths the wider, else the one that is drilled downward.
    std::vector<Link> from_mouth(std::vector<Link> chain) const {
        const bool first = is_open(first_end(chain)), last = is_open(last_end(chain));
        if (!first) turn_around(chain);
        if (!first || !last) return chain;
        const double here = mouth_radius(chain.front().wall, first_end(chain));
        const double there = mouth_radius(chain.back().wall, last_end(chain));
        const double same = 0.001 * std::max(here, there);
        const Vec3d way = into(chain.front());
        const bool is_upward = std::tie(way[2], way[1], way[0]) > std::tuple(-way[2], -way[1], -way[0]);
        if (there > here + same || (there > here - same && is_upward)) turn_around(chain);
        return chain;
    }

    RoundHole made_of(std::vector<Link> chain) const;
    HoleBottom bottom_of(const WallEnd& end) const {
        if (is_open(end)) return HoleBottom::open;
        if (end.beyond == Beyond::floor) return HoleBottom::flat;
        return end.beyond == Beyond::cone ? HoleBottom::cone : HoleBottom::other;
    }

    const FacetBends& bends_;
    std::vector<RoundWall> walls_;
    std::vector<std::array<WallEnd, 2>> ends_;
    std::vector<std::array<Partner, 2>> partners_;
    std::vector<std::uint8_t> clear_;
};

HoleKind kind_of(const std::vector<HoleStep>& steps, HoleBottom bottom) {
    std::vector<double> walls;
    bool has_inner_cone = false, has_mouth_cone = false;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const bool is_wall = steps[i].diameter_mm == steps[i].end_diameter_mm;
        const bool is_tip = i + 1 == steps.size() && bottom == HoleBottom::cone;
        if (is_wall) walls.push_back(steps[i].diameter_mm);
        else if (i == 0 || (i + 1 == steps.size() && !is_tip)) has_mouth_cone = true;
        else if (!is_tip) has_inner_cone = true;
    }
    if (walls.size() == 1) return has_mouth_cone ? HoleKind::countersunk : HoleKind::plain;
    const bool is_bored = walls.size() == 2 && walls[0] > walls[1] && !has_inner_cone && !has_mouth_cone;
    return is_bored ? HoleKind::counterbored : HoleKind::stepped;
}

RoundHole HoleMaker::made_of(std::vector<Link> chain) const {
    chain = from_mouth(std::move(chain));
    RoundHole hole;
    // The wall whose axis is known best speaks for all.
    const auto surer = [&](const Link& a, const Link& b) {
        const auto area = [&](const Link& l) {
            return walls_[l.wall].cylinder.radius * (walls_[l.wall].high - walls_[l.wall].low);
        };
        return area(a) < area(b);
    };
    const Link best = *std::max_element(chain.begin(), chain.end(), surer);
    const Point3 at = walls_[best.wall].cylinder.at;
    hole.into = into(best);
    const auto along = [&](const Point3& p) { return dot(minus(p, at), hole.into); };
    const auto on_axis = [&](std::uint32_t w, double t) {
        return along(plus(walls_[w].cylinder.at, walls_[w].cylinder.axis, t));
    };
    const auto cone = [&](std::uint32_t w, const WallEnd& end, double wall_end, bool is_first) {
        const double far = on_axis(w, end.far_end.along), wide = 2 * walls_[w].cylinder.radius;
        if (is_first) hole.steps.push_back({far, wall_end, 2 * end.far_end.radius, wide, 0, end.facets});
        else hole.steps.push_back({wall_end, far, wide, 2 * end.far_end.radius, 0, end.facets});
    };
    hole.diameter_mm = kUnbounded;
    for (std::size_t i = 0; i < chain.size(); ++i) {
        const std::uint32_t w = chain[i].wall;
        const RoundWall& wall = walls_[w];
        const bool is_up = chain[i].mouth_end == 0;
        const double from = on_axis(w, is_up ? wall.low : wall.high);
        const double to = on_axis(w, is_up ? wall.high : wall.low), wide = 2 * wall.cylinder.radius;
        const WallEnd &near = end_of(w, chain[i].mouth_end), &far = end_of(w, 1 - chain[i].mouth_end);
        if (i == 0 && near.beyond == Beyond::cone) cone(w, near, from, true);
        // Between two walls a cone spans what they leave.
        if (i > 0) {
            const HoleStep last = hole.steps.back();
            const bool is_cone = near.beyond == Beyond::cone ||
                                 end_of(chain[i - 1].wall, 1 - chain[i - 1].mouth_end).beyond == Beyond::cone;
            if (is_cone) hole.steps.push_back({last.to_mm, from, last.end_diameter_mm, wide, 0, {}});
        }
        hole.steps.push_back({from, to, wide, wide, wall.chord_mm, wall.facets});
        if (i + 1 == chain.size() && far.beyond == Beyond::cone) cone(w, far, to, false);
        hole.diameter_mm = std::min(hole.diameter_mm, wide);
        hole.chord_mm = std::max(hole.chord_mm, wall.chord_mm);
        for (const std::vector<std::uint32_t>* facets : {&wall.facets, &near.facets, &far.facets})
            hole.facets.insert(hole.facets.end(), facets->begin(), facets->end());
    }
    std::sort(hole.facets.begin(), hole.facets.end());
    hole.facets.erase(std::unique(hole.facets.begin(), hole.facets.end()), hole.facets.end());
    hole.bottom = bottom_of(last_end(chain));
    const double start = hole.steps.front().from_mm;
    for (HoleStep& step : hole.steps) {
        step.from_mm -= start;
        step.to_mm -= start;
    }
    hole.mouth = plus(at, hole.into, start);
    hole.depth_mm = hole.steps.back().to_mm;
    hole.kind = kind_of(hole.steps, hole.bottom);
    return hole;
}

}  // namespace

std::optional<RoundHole> narrowest_part(const RoundHole& hole) {
    if (hole.kind == HoleKind::plain) return hole;
    const auto is_wall = [](const HoleStep& step) { return step.diameter_mm == step.end_diameter_mm; };
    const bool has_point = hole.bottom == HoleBottom::cone;
    const std::size_t last = hole.steps.size() - (has_point ? 2 : 1);
    if (last >= hole.steps.size() || !is_wall(hole.steps[last])) return std::nullopt;
    for (std::size_t i = 0; i < last; ++i)
        if (is_wall(hole.steps[i]) && hole.steps[i].diameter_mm <= hole.steps[last].diameter_mm)
            return std::nullopt;
    RoundHole part = hole;
    part.kind = HoleKind::plain;
    part.steps.assign(hole.steps.begin() + static_cast<std::ptrdiff_t>(last), hole.steps.end());
    const double start = part.steps.front().from_mm;
    part.mouth = plus(hole.mouth, hole.into, start);
    part.depth_mm -= start;
    part.diameter_mm = part.steps.front().diameter_mm;
    part.chord_mm = part.steps.front().chord_mm;
    part.facets.clear();
    for (HoleStep& step : part.steps) {
        step.from_mm -= start;
        step.to_mm -= start;
        part.facets.insert(part.facets.end(), step.facets.begin(), step.facets.end());
    }
    std::sort(part.facets.begin(), part.facets.end());
    return part;
}

std::vector<RoundHole> find_holes(Context& context, MeshView mesh, const HoleOptions& options) {
    if (!(options.least_diameter_mm > 0 && options.most_diameter_mm > options.least_diameter_mm &&
          std::isfinite(options.most_diameter_mm) && options.noise_mm >= 0 &&
          std::isfinite(options.noise_mm)))
        throw Error(ErrorKind::usage, "holes.options", "diameters of holes must be positive and in order", "",
                    "give a least diameter below the largest");
    const MemoryCharge charge(context, mesh.size() * 40, "the holes of the mesh");
    const FacetBends bends(context, mesh);
    return HoleMaker(context, bends, find_round_walls(context, bends, options)).all();
}

}  // namespace slabwright
