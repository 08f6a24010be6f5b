#include "engine/simulate/reach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {
constexpr double kRests = 1e-3;             // mm: a floor this near under a flat end mill is touched, not cut
constexpr double kCovered = Reach::kTouch;  // mm by which covering a point may fall short
constexpr std::size_t kPlaces = 12;         // free places remembered
constexpr std::size_t kObstacles = 48;      // obstacles remembered
constexpr int kSettlings = 3;               // narrowest places that are settled into, of one tool and point
constexpr int kRounds = 30;                 // of settling
constexpr double kStuck = 0.99;             // of the round before: settling has ended
constexpr std::size_t kMostPatches = 20000;  // of one tool and point; a dozen to some hundreds are usual

constexpr double kFarthest = std::numeric_limits<double>::infinity();

/// All places of a tool that may be worth trying for one point: for a ball its centre on the upper half
/// sphere about the point (lower ones are more in the way, higher ones do not cover it); for a flat end mill
/// the middle of its floor on the disc about the point, at the point's height. A patch is a range of the
/// polar angle, or of the distance, and one of the azimuth.
struct Patch {
    double u, v;    // middle: polar angle or distance, azimuth
    double du, dv;  // half the ranges
    double out = 0, up = 0,
           width = 0;  // mm from the point to the middle, aside and up; of the patch for dv = 1
    double cos_v = 0, sin_v = 0;
    Point3 centre{};
    double spread = 0;   // mm: no place of the patch is farther from its centre
    double nearest = 0;  // mm from the centre to the nearest obstacle known
    double nearest2 = kFarthest,
           most2 = kFarthest;  // as Near::Distances, of the obstacles that were looked at
    std::size_t looked_at = 0;
};

/// Obstacles about one point, several at once. All places that are asked for lie on the tool's sphere about
/// the point (a flat end mill's: on discs about it, level with it).
class Near {
public:
    Near(const Point3& point, bool ball) : point_(point), ball_(ball) {}
    void add(const Point3& q) {
        if (count_ % kLanes == 0)
            groups_.push_back({Doubles4{} + kFar, Doubles4{} + kFar, Doubles4{} + kFar, Doubles4{}});
        const double dx = q[0] - point_[0], dy = q[1] - point_[1], dz = ball_ ? q[2] - point_[2] : 0;
        const std::array<double, 4> all{q[0], q[1], q[2], std::sqrt(dx * dx + dy * dy + dz * dz)};
        for (int k = 0; k < 4; ++k) groups_[count_ / kLanes][k][count_ % kLanes] = all[k];
        ++count_;
    }
    [[nodiscard]] std::size_t count() const { return count_; }
    struct Distances {
        double nearest;  ///< mm² from a place to the nearest obstacle
        double most;  ///< mm² that no place within `spread` of it and as far from the point exceeds, of one
                      ///< obstacle
    };
    /// What lies higher than a ball's centre counts as even with it, and all counts so for a flat end mill.
    /// Of places c and c' as far from the point p, and an obstacle o, |c' − o|² − |c − o|² = 2 (c − c')·(o −
    /// p).
    /// @param first of the obstacles, in their order, that need be looked at
    [[nodiscard]] Distances distances(const Point3& c, double spread, std::size_t first) const {
        Doubles4 least = Doubles4{} + kFarthest, most = least;
        for (std::size_t g = first / kLanes; g < groups_.size(); ++g) {
            const auto& [x, y, z, off] = groups_[g];
            const Doubles4 dx = c[0] - x, dy = c[1] - y, below = c[2] - z,
                           dz = ball_ ? (below > 0.0 ? below : Doubles4{}) : Doubles4{};
            const Doubles4 d2 = dx * dx + dy * dy + dz * dz, far = d2 + 2 * spread * off;
            least = d2 < least ? d2 : least;
            most = far < most ? far : most;
        }
        const auto smallest = [](const Doubles4& v) {
            return std::min(std::min(v[0], v[1]), std::min(v[2], v[3]));
        };
        return {smallest(least), smallest(most)};
    }

private:
    static constexpr std::size_t kLanes = 4;
    static constexpr double kFar = 1e100;  // mm
    Point3 point_;
    bool ball_;
    std::vector<std::array<Doubles4, 4>>
        groups_;  // x, y, z, distance from the point (a higher one's counts all the more)
    std::size_t count_ = 0;
};

bool worse(const Patch& a, const Patch& b) {
    return a.nearest != b.nearest ? a.nearest < b.nearest : a.spread < b.spread;
}
// The flank of a tapered ball as cylinders that hold it, over the ball of its tip.
std::vector<ToolSection> flank_of(const Tool& tool) {
    constexpr double kStep = 0.1;  // mm
    const CutterShape shape = cutter_shape(tool);
    const double tangent = std::tan(shape.taper_rad), from = shape.corner * std::cos(shape.taper_rad),
                 low = shape.corner * (1 - std::sin(shape.taper_rad));
    std::vector<ToolSection> steps;
    for (double r = shape.corner; r < shape.radius; r += kStep)
        steps.push_back({"flank", low + (r - from) / tangent, 0, std::min(shape.radius, r + kStep), 0});
    return steps;
}

}  // namespace

Reach::Reach(const StandingPart& part, const std::vector<Tool>& tools, double z_bottom, double z_top,
             double lowest)
    : part_(part), z_bottom_(z_bottom), z_top_(z_top), lowest_(lowest) {
    // What a bull-nose reaches, a ball no wider than its floor or the flat around it reaches too, but for its
    // corners.
    std::vector<const Tool*> sorted;
    for (const Tool& tool : tools)
        if (tool.kind == ToolKind::flat || has_ball_tip(tool.kind)) sorted.push_back(&tool);
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Tool* a, const Tool* b) { return tip_diameter(*a) < tip_diameter(*b); });
    for (const Tool* const tool : sorted) {
        above_.push_back(has_taper(tool->kind) ? flank_of(*tool) : std::vector<ToolSection>{});
        const std::vector<ToolSection> sections = cylinders_of(*tool);
        above_.back().insert(above_.back().end(), sections.begin(), sections.end());
        tools_.push_back(*tool);
        if (has_taper(tool->kind))
            tools_.back().kind = ToolKind::ball, tools_.back().diameter = tip_diameter(*tool);
    }
}

bool Reach::reachable(const Point3& point) {
    // A place found for a neighbour mostly does for this point too.
    for (const Place& place : places_) {
        const Tool& tool = tools_[place.tool];
        const Point3& c = place.centre;
        const double R = tool.diameter / 2 + kCovered, dx = point[0] - c[0], dy = point[1] - c[1];
        const double dz = tool.kind == ToolKind::ball ? std::max(0.0, c[2] - point[2]) : 0;
        if (tool.kind != ToolKind::ball && point[2] < c[2]) continue;
        if (dx * dx + dy * dy + dz * dz > R * R) continue;
        found_ = place;
        return true;
    }
    // In a larger ball that covers the point lies a smaller one that covers it too, with its middle on the
    // way to the larger one's; in a flat end mill's cylinder likewise. So what blocks the cutter of the
    // smaller blocks the larger.
    bool ball_blocked = false, flat_blocked = false;
    for (std::size_t tool = 0; tool < tools_.size(); ++tool) {
        bool& blocked = tools_[tool].kind == ToolKind::ball ? ball_blocked : flat_blocked;
        if (blocked) continue;
        const Found found = by(tool, point);
        if (found == Found::covers) return true;
        blocked = found == Found::blocked && point[2] >= z_bottom_;
    }
    return false;
}

std::optional<Reach::Covering> Reach::covering(const Point3& point) {
    if (!reachable(point)) return std::nullopt;
    const Tool& tool = tools_[found_.tool];
    Point3 tip = found_.centre;
    if (tool.kind == ToolKind::ball) tip[2] -= tool.diameter / 2;
    return Covering{tool.number, tip};
}

void Reach::remember(const Point3& obstacle) {
    if (obstacles_.size() < kObstacles) obstacles_.push_back(obstacle);
    else obstacles_[next_obstacle_++ % kObstacles] = obstacle;
}

bool Reach::holder_free(std::size_t tool, const Point3& tip) const {
    for (const ToolSection& s : above_[tool]) {
        const Point3 at{tip[0], tip[1], tip[2] + s.above};
        if (part_.cylinder(z_top_, at, at, s.radius, kTouch).found) return false;
    }
    return true;
}

/// Whether one tool covers one point.
///
/// Branch and bound. Each place that is tried and found blocked yields an obstacle, a point with part at or
/// above it, which blocks every place nearer to it than the radius: patches that one obstacle hides are gone,
/// others are halved. Obstacles hold for all points and tools of the layer, so those of the neighbours mostly
/// decide before the part itself is asked.
class Reach::Search {
public:
    Search(Reach& reach, std::size_t index, const Point3& point)
        : reach_(reach),
          tool_(reach.tools_[index]),
          index_(index),
          point_(point),
          ball_(tool_.kind == ToolKind::ball),
          R_(tool_.diameter / 2),
          floor_(ball_ ? std::max(reach.lowest_, reach.z_bottom_ - R_) + R_
                       : std::max(reach.lowest_, reach.z_bottom_)),
          near_(point, ball_) {
        for (const Point3& q : reach.obstacles_) {
            const double dx = q[0] - point[0], dy = q[1] - point[1], dz = q[2] - point[2];
            if (ball_ ? dx * dx + dy * dy + std::pow(std::max(0.0, -dz), 2) < 4 * R_ * R_
                      : dz >= kRests && dx * dx + dy * dy < 4 * R_ * R_)
                near_.add(q);
        }
    }

    Found run() {
        if (point_[2] + (ball_ ? R_ : 0) < floor_) return Found::held;
        const double u_end = ball_ ? std::acos(std::clamp((floor_ - point_[2]) / R_, 0.0, 1.0)) : R_;
        for (int k = 0; k < 3; ++k) {
            Patch third{u_end / 2, (2 * k + 1) * std::numbers::pi / 3, u_end / 2, std::numbers::pi / 3};
            place_u(third), place_v(third);
            consider(third);
        }
        int settlings = 0;
        for (std::size_t patches = 0; !heap_.empty() && patches < kMostPatches; ++patches) {
            std::pop_heap(heap_.begin(), heap_.end(), worse);
            Patch p = heap_.back();
            heap_.pop_back();
            if (hidden(p)) continue;  // by what was met since
            if (p.nearest >= R_ - kTouch) {
                const auto found = clearance(p.centre);
                if (found.distance >= R_ - kTouch) {
                    if (takes(p.centre)) return Found::covers;
                    if (held_everywhere(p)) continue;
                } else {
                    meet(p.centre, found);
                    if (hidden(p)) continue;
                }
            }
            if (p.spread >= kResolution) {
                halve(p);
            } else if (settlings < kSettlings && p.nearest < R_ - kTouch) {
                ++settlings;
                if (settles(p.centre)) return Found::covers;
            }
        }
        return heap_.empty() ? blocked_ : Found::held;
    }

private:
    [[nodiscard]] StandingPart::Clearance clearance(const Point3& c) const {
        if (ball_) return reach_.part_.from_shadow(c, reach_.z_top_, R_);
        return reach_.part_.beside({c[0], c[1], c[2] + kRests}, reach_.z_top_,
                                   R_);  // what it stands on is not in its way
    }

    /// Remembers the nearest of the part to a place.
    void meet(const Point3& c, const StandingPart::Clearance& found) {
        const Point3 q{c[0] - found.away[0], c[1] - found.away[1],
                       ball_ ? c[2] - found.away[2] : c[2] + kRests};
        reach_.remember(q);
        near_.add(q);
    }

    /// Whether shank and holder are free too where the cutter is.
    bool takes(const Point3& c) {
        blocked_ = Found::held;
        if (!reach_.holder_free(index_, {c[0], c[1], ball_ ? c[2] - R_ : c[2]})) return false;
        reach_.found_ = {index_, c};
        if (reach_.places_.size() < kPlaces) reach_.places_.push_back({index_, c});
        else reach_.places_[reach_.next_place_++ % kPlaces] = {index_, c};
        return true;
    }

    /// Whether shank or holder is in the way in all of a patch: even with the tip as high as the patch goes,
    /// by more than the patch's size.
    [[nodiscard]] bool held_everywhere(const Patch& p) const {
        const double tip = ball_ ? point_[2] + R_ * std::cos(p.u - p.du) - R_ : point_[2];
        const std::vector<ToolSection>& above = reach_.above_[index_];
        return std::any_of(above.begin(), above.end(), [&](const ToolSection& s) {
            const Point3 at{p.centre[0], p.centre[1], tip + s.above};
            return reach_.part_.beside(at, reach_.z_top_, s.radius).distance + p.spread < s.radius - kTouch;
        });
    }

    /// Whether one obstacle blocks all of a patch, by what is known now.
    bool hidden(Patch& p) const {
        if (p.looked_at < near_.count()) {
            const auto [nearest, most] = near_.distances(p.centre, p.spread, p.looked_at);
            p.nearest2 = std::min(p.nearest2, nearest);
            p.most2 = std::min(p.most2, most);
            p.nearest = std::sqrt(p.nearest2);
            p.looked_at = near_.count();
        }
        // A flat end mill's places are up to the patch's outer edge from the point.
        const double outer = std::min(p.u + p.du, R_), farther = ball_ ? 0 : outer * outer - p.u * p.u;
        return p.nearest + p.spread < R_ - kTouch || p.most2 + farther < (R_ - kTouch) * (R_ - kTouch);
    }

    /// Of a patch whose u is new.
    void place_u(Patch& p) const {
        const double u_most = std::min(p.u + p.du, ball_ ? std::numbers::pi / 2 : R_);
        const double sine = ball_ ? std::sin(p.u) : p.u;
        p.out = ball_ ? R_ * sine : p.u;
        p.up = ball_ ? R_ * std::cos(p.u) : 0;
        p.width = (ball_ ? std::sin(u_most) : u_most) * sine;
    }
    static void place_v(Patch& p) { p.cos_v = std::cos(p.v), p.sin_v = std::sin(p.v); }

    /// Puts a patch among those to look at unless it is hidden.
    void consider(Patch p) {
        p.centre = {point_[0] + p.out * p.cos_v, point_[1] + p.out * p.sin_v, point_[2] + p.up};
        // Of two places: 4 sin²(Δu/2) + 4 sin u₁ sin u₂ sin²(Δv/2).
        p.spread = (ball_ ? R_ : 1) * std::sqrt(p.du * p.du + p.width * p.dv * p.dv);
        p.nearest2 = p.most2 = p.nearest = kFarthest;
        p.looked_at = 0;
        if (hidden(p)) return;
        heap_.push_back(p);
        std::push_heap(heap_.begin(), heap_.end(), worse);
    }

    /// Considers the halves of a patch, across its longer side.
    void halve(const Patch& p) {
        Patch a = p, b = p;
        const double across = ball_ ? std::sin(std::min(p.u + p.du, std::numbers::pi / 2)) : p.u + p.du;
        if (p.du >= across * p.dv) {
            a.du = b.du = p.du / 2;
            a.u -= a.du, b.u += b.du;
            place_u(a), place_u(b);
        } else {
            a.dv = b.dv = p.dv / 2;
            a.v -= a.dv, b.v += b.dv;
            place_v(a), place_v(b);
        }
        consider(a);
        consider(b);
    }

    /// From a place that lacks little: off the nearest of the part, and back to where the point is covered,
    /// in turn.
    bool settles(Point3 c) {
        double lacking = std::numeric_limits<double>::infinity();
        for (int round = 0; round < kRounds; ++round) {
            const auto found = clearance(c);
            if (found.distance >= R_ - kTouch) return takes(c);
            meet(c, found);
            const double lack = R_ - found.distance, away = length(found.away);
            if (away <= 0 || lack > kStuck * lacking) return false;
            lacking = lack;
            for (int k = 0; k < 3; ++k) c[k] += found.away[k] * (lack / away);
            if (!ball_) c[2] = point_[2];
            const Point3 v{c[0] - point_[0], c[1] - point_[1], ball_ ? std::max(0.0, c[2] - point_[2]) : 0};
            const double d = length(v);
            if (d > R_)
                for (int k = 0; k < 3; ++k) c[k] = point_[k] + v[k] * (R_ / d);
            if (ball_ && c[2] < floor_) return false;
        }
        return false;
    }

    Reach& reach_;
    const Tool& tool_;
    std::size_t index_;
    Point3 point_;
    bool ball_;
    double R_, floor_;                ///< mm; no place is lower than the floor
    Near near_;                       ///< obstacles that can be in the way
    Found blocked_ = Found::blocked;  ///< until a place is met that the cutter has for itself
    std::vector<Patch> heap_;         ///< the farthest from what is known to be in the way first
};

Reach::Found Reach::by(std::size_t index, const Point3& point) { return Search(*this, index, point).run(); }

}  // namespace slabwright
