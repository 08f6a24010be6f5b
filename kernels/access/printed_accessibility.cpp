#include "kernels/access/printed_accessibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "kernels/errors.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kUpright = 1e-4;  // rad: what faces down by less counts as upright
constexpr double kSame = 0.001;    // mm: an edge's middle this near to the cut of a facet is that facet's

Vec2d place_mm(Point2 p) { return {to_mm(p.x), to_mm(p.y)}; }

struct Segment {
    Vec2d a, b;
};

/// Segments by square cells, for those near a box.
class Cells {
public:
    Cells(const std::vector<Segment>& segments, double least_cell) {
        if (segments.empty()) return;
        double x1 = -HUGE_VAL, y1 = -HUGE_VAL, sum = 0;
        x0_ = y0_ = HUGE_VAL;
        for (const Segment& s : segments) {
            x0_ = std::min({x0_, s.a.x, s.b.x});
            x1 = std::max({x1, s.a.x, s.b.x});
            y0_ = std::min({y0_, s.a.y, s.b.y});
            y1 = std::max({y1, s.a.y, s.b.y});
            sum += length(s.b - s.a);
        }
        // About as many cells as segments, and none much smaller than a segment is long.
        const double n = static_cast<double>(segments.size());
        cell_ = std::max({least_cell, std::sqrt((x1 - x0_) * (y1 - y0_) / n), sum / n, 1e-3});
        columns_ = static_cast<std::size_t>((x1 - x0_) / cell_) + 1;
        rows_ = static_cast<std::size_t>((y1 - y0_) / cell_) + 1;
        starts_.assign(columns_ * rows_ + 1, 0);
        auto each = [&](auto&& take) {
            for (std::uint32_t i = 0; i < segments.size(); ++i) {
                const auto [ax, bx] = std::minmax(segments[i].a.x, segments[i].b.x);
                const auto [ay, by] = std::minmax(segments[i].a.y, segments[i].b.y);
                for (std::size_t r = row(ay); r <= row(by); ++r)
                    for (std::size_t c = column(ax); c <= column(bx); ++c) take(r * columns_ + c, i);
            }
        };
        each([&](std::size_t cell, std::uint32_t) { ++starts_[cell + 1]; });
        for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
        members_.resize(starts_.back());
        std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
        each([&](std::size_t cell, std::uint32_t i) { members_[next[cell]++] = i; });
    }
    /// Calls f(segment); a segment of several cells comes repeatedly.
    template <class F>
    void visit(double ax, double ay, double bx, double by, F&& f) const {
        if (members_.empty()) return;
        for (std::size_t r = row(ay); r <= row(by); ++r)
            for (std::size_t c = column(ax); c <= column(bx); ++c)
                for (std::uint32_t m = starts_[r * columns_ + c]; m < starts_[r * columns_ + c + 1]; ++m)
                    f(members_[m]);
    }

private:
    [[nodiscard]] std::size_t column(double x) const { return place(x - x0_, columns_); }
    [[nodiscard]] std::size_t row(double y) const { return place(y - y0_, rows_); }
    [[nodiscard]] std::size_t place(double d, std::size_t n) const {
        return d <= 0 ? 0 : std::min(n - 1, static_cast<std::size_t>(d / cell_));
    }
    double x0_ = 0, y0_ = 0, cell_ = 1;
    std::size_t columns_ = 0, rows_ = 0;
    std::vector<std::uint32_t> starts_, members_;
};

using Interval = std::pair<double, double>;

/// Where a point that runs from `from` along the unit vector `along` is nearer than `radius` to a segment: it
/// is in the convex hull of two discs, so this is one interval, the hull of what the discs and the rectangle
/// between them give.
Interval near(Vec2d from, Vec2d along, const Segment& s, double radius) {
    Interval in{HUGE_VAL, -HUGE_VAL};
    auto take = [&](double low, double high) {
        if (low < high) in = {std::min(in.first, low), std::max(in.second, high)};
    };
    for (const Vec2d end : {s.a, s.b}) {
        const Vec2d w = end - from;
        const double middle = dot(w, along), off = cross(along, w), root = radius * radius - off * off;
        if (root > 0) take(middle - std::sqrt(root), middle + std::sqrt(root));
    }
    const Vec2d d = s.b - s.a;
    const double l = length(d);
    if (l > 0) {
        double low = -HUGE_VAL, high = HUGE_VAL;
        // Keeps what lies between two parallel lines.
        auto keep = [&](double at, double rate, double least, double most) {
            if (rate == 0) {
                if (at <= least || at >= most) high = -HUGE_VAL;
                return;
            }
            const double t0 = (least - at) / rate, t1 = (most - at) / rate;
            low = std::max(low, std::min(t0, t1));
            high = std::min(high, std::max(t0, t1));
        };
        const Vec2d u{d.x / l, d.y / l}, w = from - s.a;
        keep(dot(w, u), dot(along, u), 0, l);
        keep(cross(u, w), cross(u, along), -radius, radius);
        take(low, high);
    }
    return in;
}

}  // namespace

PrintedAccessibility printed_accessibility(const Loops& section, double radius, double weight,
                                           std::span<const std::uint8_t> left_out, double touch) {
    if (!(radius > 0) || !std::isfinite(radius))
        throw Error(ErrorKind::usage, "access.printed", "the tool's radius is not over 0");
    if (!left_out.empty() && left_out.size() != section.points.size())
        throw Error(ErrorKind::usage, "access.printed",
                    "left_out has another length than the section's points");
    PrintedAccessibility result;
    result.weight = weight;
    std::vector<Segment> edges;
    for (std::size_t l = 0; l < section.size(); ++l) {
        const auto loop = section.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i)
            edges.push_back({place_mm(loop[i]), place_mm(loop[(i + 1) % loop.size()])});
    }
    const Cells cells(edges, radius);
    std::vector<Interval> lost;
    for (std::size_t l = 0; l < section.size(); ++l) {
        const std::size_t first = section.starts[l], n = section.starts[l + 1] - first;
        for (std::size_t i = 0; i < n; ++i) {
            if (!left_out.empty() && left_out[first + i] != 0) continue;
            const Segment& e = edges[first + i];
            const Vec2d d = e.b - e.a;
            const double whole = length(d);
            if (!(whole > 0)) continue;
            result.all += whole;
            // Solid is on the left, so a corner that turns right is concave; it takes R/tan(θ/2) of both its
            // edges, θ = π − turn.
            auto corner = [&](Vec2d in, Vec2d out) {
                const double turn = -std::atan2(cross(in, out), dot(in, out));
                return turn > 0 ? radius * std::tan(turn / 2) : 0;
            };
            const Segment &before = edges[first + (i + n - 1) % n], &after = edges[first + (i + 1) % n];
            const double from = std::min(whole, corner(before.b - before.a, d)),
                         to = std::max(from, whole - corner(d, after.b - after.a));
            result.corners += whole - (to - from);
            if (!(to > from)) continue;
            // The tool's centre runs beside the edge.
            const Vec2d along{d.x / whole, d.y / whole}, out{along.y, -along.x};
            const Vec2d centre{e.a.x + radius * out.x, e.a.y + radius * out.y};
            const Vec2d p{centre.x + from * along.x, centre.y + from * along.y},
                q{centre.x + to * along.x, centre.y + to * along.y};
            lost.clear();
            cells.visit(std::min(p.x, q.x) - radius, std::min(p.y, q.y) - radius, std::max(p.x, q.x) + radius,
                        std::max(p.y, q.y) + radius, [&](std::uint32_t k) {
                            if (k == first + i) return;
                            Interval in = near(centre, along, edges[k], radius - touch);
                            in = {std::max(in.first, from), std::min(in.second, to)};
                            if (in.first < in.second) lost.push_back(in);
                        });
            std::sort(lost.begin(), lost.end());
            // Between them the centre is clear of all edges: in the open, or deep in the solid all the way.
            double reached = from;
            auto gap = [&](double until) {
                if (until <= reached) return;
                const double t = (reached + until) / 2;
                const Point2 c{to_units(centre.x + t * along.x), to_units(centre.y + t * along.y)};
                if (winding(section, c) > 0) result.intersecting += until - reached;
            };
            for (const auto& [low, high] : lost) {
                gap(low);
                result.intersecting += std::max(0.0, high - std::max(low, reached));
                reached = std::max(reached, high);
            }
            gap(to);
        }
    }
    return result;
}

namespace {

/// The edges of a section that belong to facets which face down: their middles lie on such a facet's cut.
std::vector<std::uint8_t> undercut_edges(MeshView mesh, double z, const Loops& section) {
    std::vector<Segment> cuts;
    for (const Index3& f : mesh.facets) {
        std::array<std::array<double, 3>, 3> p;
        for (int k = 0; k < 3; ++k)
            p[k] = {mesh.vertices[f[k]].x, mesh.vertices[f[k]].y, mesh.vertices[f[k]].z};
        const auto [low, high] = std::minmax({p[0][2], p[1][2], p[2][2]});
        if (low > z || high < z || low == high) continue;
        const double ux = p[1][0] - p[0][0], uy = p[1][1] - p[0][1], uz = p[1][2] - p[0][2];
        const double vx = p[2][0] - p[0][0], vy = p[2][1] - p[0][1], vz = p[2][2] - p[0][2];
        const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        if (!(nz < -kUpright * std::sqrt(nx * nx + ny * ny + nz * nz))) continue;
        std::vector<Vec2d> ends;
        for (int k = 0; k < 3; ++k) {
            const auto &a = p[k], &b = p[(k + 1) % 3];
            if ((a[2] <= z) == (b[2] <= z)) continue;
            const double t = (z - a[2]) / (b[2] - a[2]);
            ends.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])});
        }
        if (ends.size() == 2) cuts.push_back({ends[0], ends[1]});
    }
    std::vector<std::uint8_t> marks;
    if (cuts.empty()) return marks;
    marks.assign(section.points.size(), 0);
    const Cells cells(cuts, 2 * kSame);
    for (std::size_t l = 0; l < section.size(); ++l) {
        const auto loop = section.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Vec2d a = place_mm(loop[i]), b = place_mm(loop[(i + 1) % loop.size()]),
                        m{(a.x + b.x) / 2, (a.y + b.y) / 2};
            cells.visit(m.x - kSame, m.y - kSame, m.x + kSame, m.y + kSame, [&](std::uint32_t c) {
                const Vec2d d = cuts[c].b - cuts[c].a, w = m - cuts[c].a;
                const double dd = dot(d, d), t = dd > 0 ? std::clamp(dot(w, d) / dd, 0.0, 1.0) : 0;
                if (length(Vec2d{w.x - t * d.x, w.y - t * d.y}) <= kSame) marks[section.starts[l] + i] = 1;
            });
        }
    }
    return marks;
}

}  // namespace

PrintedAccessibility printed_accessibility(Context& context, MeshView mesh, double z_low, double z_high,
                                           double radius, double weight, int sections) {
    sections = std::max(1, sections);
    std::vector<Plane> planes;
    for (int i = 0; i < sections; ++i)
        planes.push_back({z_low + (z_high - z_low) * (i + 0.5) / sections, Side::above});
    const std::vector<Section> cut = slice(context, mesh, planes);
    std::vector<PrintedAccessibility> parts(cut.size());
    parallel_each(context, cut.size(), [&](std::size_t i) {
        const std::vector<std::uint8_t> undercut = undercut_edges(mesh, planes[i].z, cut[i].loops);
        parts[i] = printed_accessibility(cut[i].loops, radius, weight, undercut);
    });
    PrintedAccessibility sum;
    sum.weight = weight;
    for (const PrintedAccessibility& part : parts)
        sum.all += part.all, sum.intersecting += part.intersecting, sum.corners += part.corners;
    return sum;
}

}  // namespace slabwright
