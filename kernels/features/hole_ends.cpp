#include "kernels/features/hole_ends.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_set>

namespace slabwright {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLevel = 2 * kDegree;    // of a floor against the axis
constexpr double kFlat = 2 * kDegree;     // between the facets of a floor
constexpr double kSmooth = 20 * kDegree;  // less than this is no edge
constexpr double kCone = 5 * kDegree;     // by which normals of a cone's facets differ in slope
constexpr double kConeRound = 46.5 * kDegree;
constexpr double kLeastCone = 8 * kDegree;  // a cone's flank against the axis, and against a plane across it
constexpr double kMostOfAll = 0.9;          // the share of an end's length that must agree

// Facets joined from those beyond an end, as far as a test lets them.
template <class Test>
std::vector<std::uint32_t> spread(const FacetBends& bends, const std::vector<std::uint32_t>& first,
                                  Test&& belongs) {
    std::unordered_set<std::uint32_t> seen;
    std::vector<std::uint32_t> found;
    for (const std::uint32_t f : first)
        if (belongs(f) && seen.insert(f).second) found.push_back(f);
    for (std::size_t i = 0; i < found.size(); ++i)
        for (const std::uint32_t g : bends.mesh().neighbours[found[i]])
            if (g != kNoFacet && belongs(g) && seen.insert(g).second) found.push_back(g);
    std::sort(found.begin(), found.end());
    return found;
}

class Beyond {
public:
    Beyond(const FacetBends& bends, std::span<const RoundWall> walls, std::span<const std::uint32_t> wall_of,
           std::uint32_t wall, int end)
        : bends_(bends),
          walls_(walls),
          wall_of_(wall_of),
          id_(wall),
          wall_(walls[wall]),
          edges_(wall_.ends[static_cast<std::size_t>(end)]),
          outward_(scaled(end == 1 ? 1 : -1, wall_.cylinder.axis)) {}

    WallEnd look() {
        WallEnd result;
        double bent = 0, steep = 0;
        for (const FacetEdge& e : edges_) {
            const Bend bend = bends_.at(e);
            const double share = edge_length(e);
            whole_ += share;
            if (!bend.is_sure) continue;
            bent += bend.rad * share;
            steep += std::abs(bend.rad) * share;
            first_.push_back(bends_.mesh().neighbours[e.facet][e.corner]);
        }
        result.turns_in = bent > 0;
        result.is_smooth = steep < kSmooth * whole_;
        result.beyond = result.turns_in ? WallEnd::Beyond::other : WallEnd::Beyond::mouth;
        if (result.turns_in && find_floor(result)) return result;
        find_cone(result);
        return result;
    }

private:
    double edge_length(const FacetEdge& e) const {
        return length(minus(bends_.corner(e.facet, e.corner + 1), bends_.corner(e.facet, e.corner)));
    }

    // The share of this end's length beyond which facets of the sorted list lie.
    double share_of(const std::vector<std::uint32_t>& facets) const {
        double sum = 0;
        for (const FacetEdge& e : edges_) {
            const std::uint32_t g = bends_.mesh().neighbours[e.facet][e.corner];
            if (g != kNoFacet && std::binary_search(facets.begin(), facets.end(), g)) sum += edge_length(e);
        }
        return sum / whole_;
    }

    bool find_floor(WallEnd& result) const {
        const double most = wall_.cylinder.radius + 2 * wall_.tolerance_mm;
        const auto belongs = [&](std::uint32_t f) {
            if (wall_of_[f] != kNoWall) return false;
            if (bends_.is_sure(f) && std::abs(dot(bends_.normal(f), outward_) + 1) > 1 - std::cos(kLevel))
                return false;
            for (std::uint32_t k = 0; k < 3; ++k)
                if (wall_.cylinder.place(bends_.corner(f, k)).radius > most) return false;
            return true;
        };
        std::vector<std::uint32_t> floor = spread(bends_, first_, belongs);
        if (share_of(floor) < kMostOfAll) return false;
        result.beyond = WallEnd::Beyond::floor;
        result.next = narrower(floor);
        result.facets = std::move(floor);
        return true;
    }

    // The coaxial wall that the facets touch, other than this one.
    std::uint32_t narrower(const std::vector<std::uint32_t>& facets) const {
        for (const std::uint32_t f : facets)
            for (const std::uint32_t g : bends_.mesh().neighbours[f]) {
                if (g == kNoFacet || wall_of_[g] == kNoWall || wall_of_[g] == id_) continue;
                if (are_coaxial(wall_, walls_[wall_of_[g]])) return wall_of_[g];
            }
        return kNoWall;
    }

    // A cone's normals all lean as much against the axis, and look at it.
    void find_cone(WallEnd& result) const {
        double lean = 0, known = 0;
        for (const FacetEdge& e : edges_) {
            const std::uint32_t g = bends_.mesh().neighbours[e.facet][e.corner];
            if (g == kNoFacet || !bends_.is_sure(g)) continue;
            lean += edge_length(e) * std::acos(std::clamp(dot(bends_.normal(g), outward_), -1.0, 1.0));
            known += edge_length(e);
        }
        if (!(known > 0)) return;
        lean /= known;
        const double steepness = std::abs(lean - std::numbers::pi / 2);
        if (steepness < kLeastCone || steepness > std::numbers::pi / 2 - kLeastCone) return;
        const Cylinder& c = wall_.cylinder;
        const auto belongs = [&](std::uint32_t f) {
            if (wall_of_[f] != kNoWall || !bends_.is_sure(f)) return false;
            const Vec3d& n = bends_.normal(f);
            if (std::abs(std::acos(std::clamp(dot(n, outward_), -1.0, 1.0)) - lean) > kCone) return false;
            Vec3d middle{};
            for (std::uint32_t k = 0; k < 3; ++k) middle = plus(middle, bends_.corner(f, k), 1.0 / 3);
            const Vec3d d = minus(middle, c.at);
            const Vec3d out = plus(d, c.axis, -dot(d, c.axis)), flat = plus(n, c.axis, -dot(n, c.axis));
            return dot(flat, out) <= -std::cos(kConeRound) * length(flat) * length(out);
        };
        std::vector<std::uint32_t> cone = spread(bends_, first_, belongs);
        if (share_of(cone) < kMostOfAll || !lies_on_cone(cone)) return;
        end_of_cone(std::move(cone), result);
    }

    // Whether the corners' distances from the axis are a straight line along it.
    bool lies_on_cone(const std::vector<std::uint32_t>& facets) const {
        double n = 0, t = 0, r = 0, tt = 0, tr = 0;
        const auto each = [&](auto&& take) {
            for (const std::uint32_t f : facets)
                for (const std::uint32_t corner : {0U, 1U, 2U})
                    take(wall_.cylinder.place(bends_.corner(f, corner)));
        };
        each([&](const AxisPlace& p) {
            n += 1;
            t += p.along;
            r += p.radius;
            tt += p.along * p.along;
            tr += p.along * p.radius;
        });
        const double slope = (n * tr - t * r) / (n * tt - t * t), start = (r - slope * t) / n;
        if (!std::isfinite(slope)) return false;
        bool lies = true;
        const double most = std::max(2 * wall_.tolerance_mm, 0.02 * wall_.cylinder.radius);
        each(
            [&](const AxisPlace& p) { lies = lies && std::abs(start + slope * p.along - p.radius) <= most; });
        return lies;
    }

    void end_of_cone(std::vector<std::uint32_t> cone, WallEnd& result) const {
        double bent = 0, steep = 0, whole = 0;
        AxisPlace far{0, 0};
        double farthest = -kUnbounded;
        const auto note = [&](const Point3& p) {
            const AxisPlace place = wall_.cylinder.place(p);
            const double out = dot(minus(p, wall_.cylinder.at), outward_);
            if (out > farthest) farthest = out, far = place;
        };
        for (const std::uint32_t f : cone)
            for (std::uint32_t k = 0; k < 3; ++k) {
                note(bends_.corner(f, k));
                const std::uint32_t g = bends_.mesh().neighbours[f][k];
                if (g == kNoFacet || wall_of_[g] == id_) continue;
                if (std::binary_search(cone.begin(), cone.end(), g)) continue;
                const Bend bend = bends_.at({f, k});
                const double share = edge_length({f, k});
                whole += share;
                bent += bend.rad * share;
                steep += std::abs(bend.rad) * share;
            }
        result.next = narrower(cone);
        result.far_end = far;
        if (whole == 0) result.far_end.radius = 0;  // it closes in a point
        else if (result.next == kNoWall) {
            if (steep < kSmooth * whole) return;      // a ring of something rounded
            if (result.turns_in || bent > 0) return;  // a bowl
            result.is_open = true;
        }
        if (whole == 0 && !result.turns_in) return;
        result.beyond = WallEnd::Beyond::cone;
        result.facets = std::move(cone);
    }

    const FacetBends& bends_;
    std::span<const RoundWall> walls_;
    std::span<const std::uint32_t> wall_of_;
    std::uint32_t id_;
    const RoundWall& wall_;
    const std::vector<FacetEdge>& edges_;
    Vec3d outward_;
    double whole_ = 0;
    std::vector<std::uint32_t> first_;  // facets beyond the end
};

}  // namespace

bool are_coaxial(const RoundWall& a, const RoundWall& b) {
    const RoundWall& longer = a.high - a.low >= b.high - b.low ? a : b;
    const RoundWall& shorter = &longer == &a ? b : a;
    // Of the shorter wall's axis the direction is known the less: only where it stands is asked, and whether
    // it is roughly parallel.
    const Cylinder& c = shorter.cylinder;
    const double middle = (shorter.low + shorter.high) / 2;
    const double off = longer.cylinder.place(plus(c.at, c.axis, middle)).radius;
    const double tolerance = std::max({a.tolerance_mm, b.tolerance_mm, 0.01 * shorter.cylinder.radius});
    return off <= tolerance && std::abs(dot(longer.cylinder.axis, c.axis)) >= std::cos(2 * kDegree);
}

WallEnd look_beyond(const FacetBends& bends, std::span<const RoundWall> walls,
                    std::span<const std::uint32_t> wall_of, std::uint32_t wall, int end) {
    return Beyond(bends, walls, wall_of, wall, end).look();
}

}  // namespace slabwright
