#include "tests/data/sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace slabwright {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kGrid = 4096;  // steps per mm: 24 bits reach 4 m

/// Segments for an arc so that its chords miss it by at most `chord`.
int arc_steps(double radius, double angle, double chord) {
    if (radius <= 0) return 1;
    const double step = 2 * std::acos(std::max(0.0, 1 - chord / radius));
    return std::max(1, static_cast<int>(std::ceil(std::abs(angle) / step - 1e-9)));
}

void append_arc(Profile& profile, double centre_o, double centre_z, double radius, double from, double to,
                double chord) {
    const int steps = arc_steps(radius, to - from, chord);
    for (int i = 0; i <= steps; ++i) {
        const double a = from + (to - from) * i / steps;
        profile.push_back({centre_o + radius * std::cos(a), centre_z + radius * std::sin(a)});
    }
}

/// A vertex of a polygon in grid steps, where orientation is exact.
struct GridPoint {
    std::int64_t x = 0, y = 0;
    friend bool operator==(const GridPoint&, const GridPoint&) = default;
};

std::int64_t orient(GridPoint a, GridPoint b, GridPoint c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool in_triangle(GridPoint a, GridPoint b, GridPoint c, GridPoint p) {
    return orient(a, b, p) >= 0 && orient(b, c, p) >= 0 && orient(c, a, p) >= 0;
}

bool crosses(GridPoint a, GridPoint b, GridPoint c, GridPoint d) {
    const auto sign = [](std::int64_t v) { return (v > 0) - (v < 0); };
    return sign(orient(a, b, c)) * sign(orient(a, b, d)) < 0 &&
           sign(orient(c, d, a)) * sign(orient(c, d, b)) < 0;
}

/// How well shaped a triangle is: twice its area over the square of its longest side.
double shape(GridPoint a, GridPoint b, GridPoint c) {
    const auto squared = [](GridPoint p, GridPoint q) {
        const double dx = static_cast<double>(p.x - q.x), dy = static_cast<double>(p.y - q.y);
        return dx * dx + dy * dy;
    };
    return static_cast<double>(orient(a, b, c)) / std::max({squared(a, b), squared(b, c), squared(c, a)});
}

/// Polygon as a chain of vertex numbers; holes are joined to it by bridges walked twice.
struct Chain {
    std::vector<GridPoint> points;
    std::vector<std::size_t> order;
};

/// Joins a hole (clockwise in `order`) to the chain by the shortest bridge that crosses no edge of either nor
/// of the holes still to come.
void bridge(Chain& chain, const std::vector<std::size_t>& hole,
            const std::vector<std::vector<std::size_t>>& others) {
    const auto& p = chain.points;
    const auto free = [&](GridPoint a, GridPoint b) {
        const auto blocked_by = [&](const std::vector<std::size_t>& loop) {
            for (std::size_t i = 0; i < loop.size(); ++i) {
                const GridPoint c = p[loop[i]], d = p[loop[(i + 1) % loop.size()]];
                if (crosses(a, b, c, d)) return true;
                // A vertex in the middle of the bridge would be touched by it.
                if (c != a && c != b && orient(a, b, c) == 0 && std::min(a.x, b.x) <= c.x &&
                    c.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= c.y && c.y <= std::max(a.y, b.y))
                    return true;
            }
            return false;
        };
        if (blocked_by(chain.order) || blocked_by(hole)) return false;
        return std::none_of(others.begin(), others.end(), blocked_by);
    };
    double best = std::numeric_limits<double>::infinity();
    std::size_t best_outer = 0, best_hole = 0;
    for (std::size_t i = 0; i < chain.order.size(); ++i) {
        for (std::size_t j = 0; j < hole.size(); ++j) {
            const GridPoint a = p[chain.order[i]], b = p[hole[j]];
            const double d = std::hypot(static_cast<double>(a.x - b.x), static_cast<double>(a.y - b.y));
            if (d >= best) continue;
            // Where a vertex stands twice in the chain (an earlier bridge), the new one must leave within
            // this occurrence's angle.
            const GridPoint before = p[chain.order[(i + chain.order.size() - 1) % chain.order.size()]];
            const GridPoint after = p[chain.order[(i + 1) % chain.order.size()]];
            const bool convex = orient(before, a, after) > 0;
            const bool left_in = orient(before, a, b) > 0, left_out = orient(a, after, b) > 0;
            if (convex ? !(left_in && left_out) : !(left_in || left_out)) continue;
            if (!free(a, b)) continue;
            best = d, best_outer = i, best_hole = j;
        }
    }
    if (!std::isfinite(best)) throw std::logic_error("flat: a hole cannot be joined to the outline");
    std::vector<std::size_t> joined(chain.order.begin(),
                                    chain.order.begin() + static_cast<std::ptrdiff_t>(best_outer) + 1);
    for (std::size_t j = 0; j <= hole.size(); ++j) joined.push_back(hole[(best_hole + j) % hole.size()]);
    joined.insert(joined.end(), chain.order.begin() + static_cast<std::ptrdiff_t>(best_outer),
                  chain.order.end());
    chain.order = std::move(joined);
}

}  // namespace

float on_grid(double mm) { return static_cast<float>(static_cast<double>(std::llround(mm * kGrid)) / kGrid); }

Outline rounded_polygon(std::span<const Corner> corners, double chord_mm) {
    const std::size_t n = corners.size();
    // How much of the edges at a corner its arc takes.
    std::vector<double> tangent(n), turn(n), heading(n);
    for (std::size_t i = 0; i < n; ++i) {
        const Corner &a = corners[i], &b = corners[(i + 1) % n];
        heading[i] = std::atan2(b.y - a.y, b.x - a.x);
    }
    for (std::size_t i = 0; i < n; ++i) {
        turn[i] = std::remainder(heading[i] - heading[(i + n - 1) % n], 2 * kPi);
        tangent[i] = corners[i].radius * std::tan(std::abs(turn[i]) / 2);
    }
    Outline outline;
    for (std::size_t i = 0; i < n; ++i) {
        const Corner &c = corners[i], &next = corners[(i + 1) % n];
        const double length = std::hypot(next.x - c.x, next.y - c.y);
        if (tangent[i] + tangent[(i + 1) % n] > length + 1e-9)
            throw std::logic_error("rounded_polygon: the arcs of an edge overlap");
        const double before = heading[(i + n - 1) % n];
        const double side = turn[i] > 0 ? 1 : -1;
        const double start_x = c.x - tangent[i] * std::cos(before),
                     start_y = c.y - tangent[i] * std::sin(before);
        // The centre lies to the left of a left turn, to the right of a right turn.
        const double centre_x = start_x - side * c.radius * std::sin(before),
                     centre_y = start_y + side * c.radius * std::cos(before);
        const int steps = arc_steps(c.radius, turn[i], chord_mm);
        for (int k = 0; k <= steps; ++k) {
            const double h = before + turn[i] * k / steps;  // heading along the arc; outward is to its right
            const OutlinePoint p{centre_x + side * c.radius * std::sin(h),
                                 centre_y - side * c.radius * std::cos(h), std::sin(h), -std::cos(h)};
            // Arcs that use an edge up meet in one point.
            if (!outline.empty() && std::hypot(outline.back().x - p.x, outline.back().y - p.y) < 1e-6)
                continue;
            outline.push_back(p);
        }
    }
    if (std::hypot(outline.back().x - outline.front().x, outline.back().y - outline.front().y) < 1e-6)
        outline.pop_back();
    return outline;
}

Outline circle(double x, double y, double radius, double chord_mm) {
    const int steps = (std::max(12, arc_steps(radius, 2 * kPi, chord_mm)) + 3) / 4 * 4;
    Outline outline;
    for (int i = 0; i < steps; ++i) {
        const double a = 2 * kPi * i / steps;
        outline.push_back({x + radius * std::cos(a), y + radius * std::sin(a), std::cos(a), std::sin(a)});
    }
    return outline;
}

Outline stadium(double x0, double y0, double x1, double y1, double radius, double chord_mm) {
    const double heading = std::atan2(y1 - y0, x1 - x0);
    const int steps = std::max(4, arc_steps(radius, kPi, chord_mm));
    Outline outline;
    for (int end = 0; end < 2; ++end) {
        for (int i = 0; i <= steps; ++i) {
            const double a = heading - kPi / 2 + kPi * (end + static_cast<double>(i) / steps);
            outline.push_back({(end ? x0 : x1) + radius * std::cos(a), (end ? y0 : y1) + radius * std::sin(a),
                               std::cos(a), std::sin(a)});
        }
    }
    return outline;
}

Profile drafted_wall(double z0, double z1, double draft_deg, double fillet_mm, double round_mm,
                     double chord_mm) {
    const double d = draft_deg * kPi / 180;
    const double tangent =
        1 / std::tan((kPi / 2 + d) / 2);  // per mm of radius; floor and wall, wall and top enclose 90° + d
    Profile profile;
    if (fillet_mm > 0)
        append_arc(profile, tangent * fillet_mm, z0 + fillet_mm, fillet_mm, 1.5 * kPi, kPi + d, chord_mm);
    else profile.push_back({0, z0});
    const double top = -(z1 - z0) * std::tan(d);
    if (round_mm > 0)
        append_arc(profile, top - tangent * round_mm, z1 - round_mm, round_mm, d, kPi / 2, chord_mm);
    else profile.push_back({top, z1});
    profile.front().z = z0, profile.back().z = z1;
    return profile;
}

Profile drafted_pocket(double z1, double z0, double draft_deg, double fillet_mm, double chord_mm) {
    const double d = draft_deg * kPi / 180;
    const double foot = -(z1 - z0) * std::tan(d);
    Profile profile{{0, z1}};
    if (fillet_mm > 0)
        append_arc(profile, foot - fillet_mm / std::tan((kPi / 2 + d) / 2), z0 + fillet_mm, fillet_mm, -d,
                   -kPi / 2, chord_mm);
    else profile.push_back({foot, z0});
    profile.back().z = z0;
    return profile;
}

Ring ring(const Outline& outline, ProfilePoint at) {
    Ring ring;
    for (const OutlinePoint& p : outline)
        ring.push_back({on_grid(p.x + at.offset * p.nx), on_grid(p.y + at.offset * p.ny), on_grid(at.z)});
    return ring;
}

void strip(std::vector<Facet>& facets, const Ring& from, const Ring& to) {
    for (std::size_t i = 0; i < from.size(); ++i) {
        const std::size_t j = (i + 1) % from.size();
        // Where an offset shrinks an edge to nothing on the grid, the other triangle is all that is left.
        if (from[i] != from[j]) facets.push_back({from[i], from[j], to[j]});
        if (to[i] != to[j]) facets.push_back({from[i], to[j], to[i]});
    }
}

Ring sweep(std::vector<Facet>& facets, const Outline& outline, const Profile& profile) {
    Ring last = ring(outline, profile.front());
    for (std::size_t i = 1; i < profile.size(); ++i) {
        Ring next = ring(outline, profile[i]);
        strip(facets, last, next);
        last = std::move(next);
    }
    return last;
}

void flat(std::vector<Facet>& facets, const Ring& outer, const std::vector<Ring>& holes, bool up) {
    Chain chain;
    const auto add = [&](const Ring& ring) {
        std::vector<std::size_t> loop;
        for (const Vec3f& v : ring) {
            const GridPoint p{std::llround(static_cast<double>(v.x) * kGrid),
                              std::llround(static_cast<double>(v.y) * kGrid)};
            if (!loop.empty() && chain.points[loop.back()] == p) continue;
            loop.push_back(chain.points.size());
            chain.points.push_back(p);
        }
        if (chain.points[loop.front()] == chain.points[loop.back()]) loop.pop_back();
        return loop;
    };
    chain.order = add(outer);
    std::vector<std::vector<std::size_t>> loops;
    for (const Ring& hole : holes) {
        loops.push_back(add(hole));
        std::reverse(loops.back().begin(), loops.back().end());
    }
    while (!loops.empty()) {
        const std::vector<std::size_t> hole = std::move(loops.back());
        loops.pop_back();
        bridge(chain, hole, loops);
    }

    // Ear clipping, the best-shaped ear first, so that flats do not fall into needles.
    const auto& p = chain.points;
    auto& order = chain.order;
    const auto quality = [&](std::size_t i) {
        const std::size_t n = order.size();
        const GridPoint a = p[order[(i + n - 1) % n]], b = p[order[i]], c = p[order[(i + 1) % n]];
        if (orient(a, b, c) <= 0) return -1.0;
        for (std::size_t k : order) {
            const GridPoint q = p[k];
            if (q != a && q != b && q != c && in_triangle(a, b, c, q)) return -1.0;
        }
        return shape(a, b, c);
    };
    std::vector<double> ears(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) ears[i] = quality(i);
    const float z = outer.front().z;
    const auto vertex = [&](std::size_t k) {
        return Vec3f{static_cast<float>(static_cast<double>(p[k].x) / kGrid),
                     static_cast<float>(static_cast<double>(p[k].y) / kGrid), z};
    };
    while (order.size() > 2) {
        const std::size_t i =
            static_cast<std::size_t>(std::max_element(ears.begin(), ears.end()) - ears.begin());
        if (ears[i] <= 0) throw std::logic_error("flat: no ear left, the loops cross");
        const std::size_t n = order.size();
        const Vec3f a = vertex(order[(i + n - 1) % n]), b = vertex(order[i]), c = vertex(order[(i + 1) % n]);
        facets.push_back(up ? Facet{a, b, c} : Facet{a, c, b});
        order.erase(order.begin() + static_cast<std::ptrdiff_t>(i));
        ears.erase(ears.begin() + static_cast<std::ptrdiff_t>(i));
        if (order.size() < 3) break;
        ears[(i + order.size() - 1) % order.size()] = quality((i + order.size() - 1) % order.size());
        ears[i % order.size()] = quality(i % order.size());
    }
}

void fan(std::vector<Facet>& facets, const Ring& ring, Vec3f tip) {
    for (std::size_t i = 0; i < ring.size(); ++i)
        facets.push_back({ring[i], ring[(i + 1) % ring.size()], tip});
}

}  // namespace slabwright
