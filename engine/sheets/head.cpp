#include "engine/sheets/head.h"

#include <cmath>
#include <numbers>

namespace slabwright {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kDeepest = 8;          ///< halvings of one piece
constexpr double kUpright = 0.0015;  ///< mm between the ends of an axis for which no head need turn

/// The head with the jet from top to bottom; C as near to `before` as full turns allow.
HeadPoint head_at(Point2 top, Point2 bottom, double thickness, double before) {
    const double vx = (double(bottom.x) - top.x) / kUnitsPerMm, vy = (double(bottom.y) - top.y) / kUnitsPerMm;
    const double aside = std::hypot(vx, vy);
    HeadPoint point{top, std::atan2(aside, thickness) / kDegree, before};
    if (aside < kUpright) {
        point.a_deg = 0;
        return point;
    }
    const double c = std::atan2(vy, vx) / kDegree;
    point.c_deg = c + 360 * std::round((before - c) / 360);
    return point;
}

Point2 middle(Point2 p, Point2 q) {
    return {static_cast<std::int32_t>((std::int64_t{p.x} + q.x) / 2),
            static_cast<std::int32_t>((std::int64_t{p.y} + q.y) / 2)};
}

struct Ends {
    Point2 top, bottom;
};

/// How a way is made of points.
struct HeadRules {
    double thickness = 0, tolerance = 0, pivot = 0;
};

/// mm by which the top leaves its line in the middle of a move of the pivot.
double swing_of(const HeadPoint& p, const HeadPoint& q, double pivot) {
    if (pivot == 0) return 0;
    const PivotPlace a = pivot_place({}, p.a_deg, p.c_deg, pivot),
                     b = pivot_place({}, q.a_deg, q.c_deg, pivot);
    const PivotPlace m = pivot_place({}, (p.a_deg + q.a_deg) / 2, (p.c_deg + q.c_deg) / 2, pivot);
    return std::hypot(m.x - (a.x + b.x) / 2, m.y - (a.y + b.y) / 2, m.z - (a.z + b.z) / 2);
}

void append_between(std::vector<HeadPoint>& way, const Ends& from, const Ends& to, const HeadRules& rules,
                    int depth) {
    const HeadPoint last = way.back();
    const HeadPoint next = head_at(to.top, to.bottom, rules.thickness, last.c_deg);
    const Ends half{middle(from.top, to.top), middle(from.bottom, to.bottom)};
    const HeadPoint even{half.top, (last.a_deg + next.a_deg) / 2, (last.c_deg + next.c_deg) / 2};
    const Point2 swung = bottom_of(even, rules.thickness);
    const double off = std::hypot(double(swung.x) - half.bottom.x, double(swung.y) - half.bottom.y);
    if ((off > rules.tolerance * kUnitsPerMm || swing_of(last, next, rules.pivot) > rules.tolerance) &&
        depth < kDeepest) {
        append_between(way, from, half, rules, depth + 1);
        append_between(way, half, to, rules, depth + 1);
        return;
    }
    way.push_back(next);
}

}  // namespace

Point2 bottom_of(const HeadPoint& point, double thickness) {
    const double aside = thickness * std::tan(point.a_deg * kDegree);
    return {to_units(to_mm(point.top.x) + aside * std::cos(point.c_deg * kDegree)),
            to_units(to_mm(point.top.y) + aside * std::sin(point.c_deg * kDegree))};
}

PivotPlace pivot_place(Point2 top, double a_deg, double c_deg, double pivot) {
    const double aside = pivot * std::sin(a_deg * kDegree);
    return {to_mm(top.x) - aside * std::cos(c_deg * kDegree),
            to_mm(top.y) - aside * std::sin(c_deg * kDegree), pivot * (std::cos(a_deg * kDegree) - 1)};
}

std::vector<HeadPoint> head_way(const AxisLoop& loop, double thickness, double tolerance, double pivot) {
    std::vector<HeadPoint> way;
    const std::size_t n = loop.top.size();
    if (n == 0) return way;
    // C where the head first leans, so that it need not turn before.
    double c = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const HeadPoint point = head_at(loop.top[i], loop.bottom[i], thickness, 0);
        if (point.a_deg > 0) {
            c = point.c_deg;
            break;
        }
    }
    way.push_back(head_at(loop.top[0], loop.bottom[0], thickness, c));
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t next = (i + 1) % n;
        append_between(way, {loop.top[i], loop.bottom[i]}, {loop.top[next], loop.bottom[next]},
                       {thickness, tolerance, pivot}, 0);
    }
    return way;
}

}  // namespace slabwright
