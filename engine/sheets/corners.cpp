#include "engine/sheets/corners.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slabwright {

namespace {

constexpr double kShortest = 0.01;  ///< mm: a piece of the way that is not worth a point

struct Stretch {
    double from = 0, to = 0;  // mm along the way
};

double length_of(const HeadPoint& p, const HeadPoint& q) {
    return std::hypot(to_mm(q.top.x) - to_mm(p.top.x), to_mm(q.top.y) - to_mm(p.top.y));
}

/// Of a closed way the lengths before its points and, at each, by how much it turns, in degrees.
struct Course {
    std::vector<double> along, turns;
    double length = 0;

    explicit Course(const std::vector<HeadPoint>& way) : along(way.size(), 0), turns(way.size(), 0) {
        for (std::size_t i = 1; i < way.size(); ++i) along[i] = along[i - 1] + length_of(way[i - 1], way[i]);
        length = along.back();
        const std::size_t n = way.size() - 1;  // the last point is the first
        const auto heading = [&](std::size_t i) {
            const Point2 a = way[i % n].top, b = way[i % n + 1].top;
            return std::atan2(double(b.y) - a.y, double(b.x) - a.x);
        };
        for (std::size_t i = 0; i < n; ++i) {
            const double turn = std::remainder(heading(i) - heading(i + n - 1), 2 * std::numbers::pi);
            turns[i] = std::abs(turn) * 180 / std::numbers::pi;
        }
        turns[n] = turns[0];
    }
};

/// Where the way is near a corner: ascending, apart, within [0, length].
std::vector<Stretch> near_corners(const Course& course, const CornerRules& rules) {
    const std::size_t n = course.turns.size() - 1;
    std::vector<Stretch> found;
    const auto add = [&](double from, double to) {
        for (const double shift : {-course.length, 0.0, course.length}) {
            const Stretch in{std::max(0.0, from + shift), std::min(course.length, to + shift)};
            if (in.from < in.to) found.push_back(in);
        }
    };
    for (std::size_t i = 0; i < n; ++i) {
        double turn = course.turns[i];
        // What turns within half of the reach behind it belongs to the same corner.
        for (std::size_t k = 1; k < n; ++k) {
            const std::size_t j = (i + n - k) % n;
            const double behind = course.along[i] - course.along[j] + (j > i ? course.length : 0);
            if (behind > rules.reach / 2) break;
            turn += course.turns[j];
        }
        if (turn > rules.turn_deg && course.turns[i] > 0)
            add(course.along[i] - rules.reach, course.along[i] + rules.reach);
    }
    std::sort(found.begin(), found.end(), [](const Stretch& a, const Stretch& b) { return a.from < b.from; });
    std::vector<Stretch> apart;
    for (const Stretch& s : found) {
        if (!apart.empty() && s.from <= apart.back().to + kShortest)
            apart.back().to = std::max(apart.back().to, s.to);
        else apart.push_back(s);
    }
    return apart;
}

HeadPoint between(const HeadPoint& p, const HeadPoint& q, double t) {
    const auto mix = [t](double a, double b) { return a + t * (b - a); };
    return {{static_cast<std::int32_t>(std::lround(mix(p.top.x, q.top.x))),
             static_cast<std::int32_t>(std::lround(mix(p.top.y, q.top.y)))},
            mix(p.a_deg, q.a_deg),
            mix(p.c_deg, q.c_deg)};
}

}  // namespace

PacedWay slowed_at_corners(const std::vector<HeadPoint>& way, const CornerRules& rules) {
    PacedWay paced;
    if (way.size() < 3 || rules.share >= 1 || rules.reach <= 0) {
        paced.points = way;
        paced.shares.assign(way.size(), 1);
        return paced;
    }
    const Course course(way);
    const std::vector<Stretch> slow = near_corners(course, rules);
    paced.points.push_back(way[0]);
    paced.shares.push_back(1);
    std::size_t s = 0;
    for (std::size_t i = 1; i < way.size(); ++i) {
        const double from = course.along[i - 1], to = course.along[i];
        double at = from;
        const auto advance = [&](double end, double share) {
            const bool ends_here = to - end < kShortest;
            if (end - at < kShortest && !ends_here) return;
            paced.points.push_back(ends_here ? way[i]
                                             : between(way[i - 1], way[i], (end - from) / (to - from)));
            paced.shares.push_back(share);
            at = ends_here ? to : end;
        };
        while (s < slow.size() && slow[s].to <= from + kShortest) ++s;
        for (std::size_t k = s; k < slow.size() && slow[k].from < to - kShortest && at < to; ++k) {
            if (slow[k].from > at + kShortest) advance(slow[k].from, 1);
            advance(std::min(to, slow[k].to), rules.share);
        }
        if (at < to || from == to) advance(to, 1);
    }
    return paced;
}

}  // namespace slabwright
