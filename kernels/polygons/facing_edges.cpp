#include "kernels/polygons/facing_edges.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <utility>

#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr std::size_t kMostEdges = 16;  // of a stretch
constexpr double kAngle = 1e-6;         // rad, of rounding

/// Some edges of a loop, one after the other.
struct Stretch {
    std::size_t loop = 0, first = 0, count = 0;
    Vec2d low{}, high{};          // units
    double middle = 0, half = 0;  // rad: the normals lie so far about that direction, at corners too
};

/// Cuts one loop into stretches, each no longer than `width` unless it is one edge.
class LoopDivider {
public:
    LoopDivider(const Loops& loops, double width) : loops_(loops), width_(width) {}

    std::vector<Stretch> run() {
        for (std::size_t l = 0; l < loops_.size(); ++l)
            for (std::size_t first = 0, n = loops_.loop(l).size(); first < n;
                 first += stretches_.back().count)
                add(l, first);
        return std::move(stretches_);
    }

private:
    [[nodiscard]] static Vec2d corner(std::span<const Point2> loop, std::size_t i) {
        const Point2 p = loop[i % loop.size()];
        return {static_cast<double>(p.x), static_cast<double>(p.y)};
    }

    void add(std::size_t l, std::size_t first) {
        const auto loop = loops_.loop(l);
        Stretch s{.loop = l, .first = first, .low = corner(loop, first), .high = corner(loop, first)};
        double length_so_far = 0;
        while (s.count < kMostEdges && first + s.count < loop.size()) {
            const Vec2d to = corner(loop, first + s.count + 1);
            length_so_far += length(to - corner(loop, first + s.count));
            if (s.count > 0 && length_so_far > width_) break;
            s.low = {std::min(s.low.x, to.x), std::min(s.low.y, to.y)};
            s.high = {std::max(s.high.x, to.x), std::max(s.high.y, to.y)};
            ++s.count;
        }
        // From the edge before to the one after: at a corner between two edges the normals turn from one to
        // the other.
        double angle = 0, least = 0, most = 0;
        Vec2d before = corner(loop, first) - corner(loop, first + loop.size() - 1);
        const double begin = std::atan2(-before.x, before.y);
        for (std::size_t i = first; i <= first + s.count; ++i) {
            const Vec2d next = corner(loop, i + 1) - corner(loop, i);
            angle += std::atan2(cross(before, next), dot(before, next));
            least = std::min(least, angle);
            most = std::max(most, angle);
            before = next;
        }
        s.middle = begin + (least + most) / 2;
        s.half = (most - least) / 2;
        stretches_.push_back(s);
    }

    const Loops& loops_;
    double width_;
    std::vector<Stretch> stretches_;
};

/// The widest angle between a normal of the one and one of the other.
double widest_angle(const Stretch& a, const Stretch& b) {
    const double between = std::abs(std::remainder(a.middle - b.middle, 2 * std::numbers::pi));
    return between + a.half + b.half;
}

bool near(const Stretch& a, const Stretch& b, double width) {
    const double dx = std::max({0.0, a.low.x - b.high.x, b.low.x - a.high.x}),
                 dy = std::max({0.0, a.low.y - b.high.y, b.low.y - a.high.y});
    return dx * dx + dy * dy <= width * width;
}

/// take(i, j), i before j, for all pairs of stretches no farther apart than `width`; and for each with
/// itself.
template <class Take>
void each_near(const std::vector<Stretch>& by_low_x, double width, Take&& take) {
    for (std::size_t i = 0; i < by_low_x.size(); ++i)
        for (std::size_t j = i; j < by_low_x.size() && by_low_x[j].low.x <= by_low_x[i].high.x + width; ++j)
            if (near(by_low_x[i], by_low_x[j], width)) take(i, j);
}

}  // namespace

std::vector<PlaneEdge> facing_edges(const Loops& solid, double width, double spread_rad) {
    std::vector<Stretch> stretches = LoopDivider(solid, width).run();
    std::sort(stretches.begin(), stretches.end(), [](const Stretch& a, const Stretch& b) {
        return a.low.x != b.low.x ? a.low.x < b.low.x
               : a.loop != b.loop ? a.loop < b.loop
                                  : a.first < b.first;
    });
    const double reach = width + 1;
    std::vector<char> faces(stretches.size(), 0), kept(stretches.size(), 0);
    each_near(stretches, reach, [&](std::size_t i, std::size_t j) {
        if (widest_angle(stretches[i], stretches[j]) >= spread_rad - kAngle) faces[i] = faces[j] = 1;
    });
    each_near(stretches, reach, [&](std::size_t i, std::size_t j) {
        kept[i] = static_cast<char>(kept[i] | faces[i] | faces[j]);
        kept[j] = static_cast<char>(kept[j] | faces[i] | faces[j]);
    });
    std::vector<PlaneEdge> edges;
    for (std::size_t s = 0; s < stretches.size(); ++s) {
        if (kept[s] == 0) continue;
        const auto loop = solid.loop(stretches[s].loop);
        for (std::size_t i = stretches[s].first; i < stretches[s].first + stretches[s].count; ++i)
            edges.push_back({loop[i], loop[i + 1 < loop.size() ? i + 1 : 0]});
    }
    return edges;
}

}  // namespace slabwright
