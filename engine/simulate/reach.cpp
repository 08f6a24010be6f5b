#include "engine/simulate/reach.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slabwright {

namespace {
constexpr int kRounds = 40;        // of alternating projection from one start
constexpr double kTouch = 1e-4;    // mm: a tool may touch the part, and this much is touching
constexpr double kRests = 1e-3;    // mm: a floor this near under a flat end mill is touched, not cut
constexpr double kCovered = 2e-4;  // mm by which covering a point may fall short
constexpr double kStuck = 0.99;    // of the round before: the search has ended
constexpr int kSides = 4;          // starts beside the point
}  // namespace

Reach::Reach(const StandingPart& part, const std::vector<Tool>& tools, double z_bottom, double z_top, double lowest)
    : part_(part), z_bottom_(z_bottom), z_top_(z_top), lowest_(lowest) {
    for (const Tool& tool : tools)
        if (tool.kind == ToolKind::flat || tool.kind == ToolKind::ball) tools_.push_back(tool);
    std::stable_sort(tools_.begin(), tools_.end(), [](const Tool& a, const Tool& b) { return a.diameter < b.diameter; });
}

bool Reach::reachable(const Point3& point) const {
    for (const Tool& tool : tools_)
        if (by(tool, point)) return true;
    return false;
}

bool Reach::by(const Tool& tool, const Point3& point) const {
    const double R = tool.diameter / 2;
    const bool ball = tool.kind == ToolKind::ball;
    // For a ball c is its centre, for a flat end mill the middle of its floor, which lies at the point's own height: lower would
    // only be in the way, and higher would not cover it.
    const double floor = ball ? std::max(lowest_, z_bottom_ - R) + R : std::max(lowest_, z_bottom_);
    if (!ball && point[2] < floor) return false;
    auto clear_of = [&](const Point3& c) {
        if (ball) return part_.from_shadow(c, z_top_, R);
        return part_.beside({c[0], c[1], c[2] + kRests}, z_top_, R);  // what it stands on is not in its way
    };
    auto length = [](const Point3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); };
    auto holder_free = [&](const Point3& c) {
        const double tip = ball ? c[2] - R : c[2];
        for (const auto& [radius, above] :
             {std::pair{tool.shank_diameter / 2, tool.flute_length}, std::pair{tool.holder_diameter / 2, tool.stickout}}) {
            if (radius <= R || above <= 0) continue;
            const Point3 at{c[0], c[1], tip + above};
            if (part_.cylinder(z_top_, at, at, radius, kTouch).found) return false;
        }
        return true;
    };
    auto search = [&](Point3 c) {
        double lacking = 1e300;
        for (int round = 0; round < kRounds; ++round) {
            // Cover the point: the nearest place from which the ball, or the shank above its centre, holds it.
            if (ball && c[2] < floor) c[2] = floor;
            const Point3 v{c[0] - point[0], c[1] - point[1], ball ? std::max(0.0, c[2] - point[2]) : 0};
            const double d = length(v);
            if (d > R + kCovered) {
                for (int k = 0; k < 3; ++k) c[k] -= v[k] * (1 - R / d);
                if (ball && c[2] < floor) {  // the floor leaves less room sideways
                    c[2] = floor;
                    const double over = std::max(0.0, c[2] - point[2]), room = R * R - over * over;
                    if (room < 0) return false;
                    const double r = std::hypot(c[0] - point[0], c[1] - point[1]);
                    if (r * r > room) {
                        const double s = std::sqrt(room) / r;
                        c[0] = point[0] + (c[0] - point[0]) * s, c[1] = point[1] + (c[1] - point[1]) * s;
                    }
                }
            }
            const auto clearance = clear_of(c);
            if (clearance.distance >= R - kTouch) return holder_free(c);
            // What is lacking shrinks by a factor each round where the two meet, and stays where they do not.
            const double lack = R - clearance.distance;
            if (round > 1 && lack > kStuck * lacking) return false;
            lacking = lack;
            const double away = length(clearance.away);
            if (away <= 0) return false;  // inside the part: no way out is known
            for (int k = 0; k < 3; ++k) c[k] += clearance.away[k] * (lack / away);
        }
        return false;
    };
    const auto near = clear_of(point);
    Point3 start = point;
    const double d = length(near.away);
    if (near.distance < R && d > 0)  // as far out as the tool still covers the point
        for (int k = 0; k < 3; ++k) start[k] += near.away[k] * (R / d);
    if (search(start)) return true;
    if (ball && search({point[0], point[1], point[2] + R})) return true;
    for (int i = 0; i < kSides; ++i) {
        const double a = 2 * std::numbers::pi * i / kSides;
        if (search({point[0] + R * std::cos(a), point[1] + R * std::sin(a), point[2]})) return true;
    }
    return false;
}

}  // namespace slabwright
