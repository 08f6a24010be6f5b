#include "kernels/cutting/drop.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

struct Best {
    double tip_z = -std::numeric_limits<double>::infinity();
    double nx = 0, ny = 0, nz = 0;
    void offer(double z, double up, double east = 0, double north = 0) {
        if (z > tip_z) {
            tip_z = z;
            nx = east;
            ny = north;
            nz = up;
        }
    }
};

// A ball's tip over one facet: the plane where the contact falls inside, then the edges it owns and their ends.
void drop_ball(const SolidFacet& f, double r, double x, double y, Best& best) {
    const Vec3d& n = f.normal;
    if (n[2] > 1e-9) {
        // Centre above the plane by r: contact p = c − r·n, p inside the triangle.
        const double px = x - r * n[0], py = y - r * n[1];
        bool inside = true;
        for (int k = 0; k < 3 && inside; ++k) {
            const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
            inside = (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0]) >= 0;
        }
        if (inside) {
            const double pz = f.p[0][2] - (n[0] * (px - f.p[0][0]) + n[1] * (py - f.p[0][1])) / n[2];
            best.offer(pz + r * n[2] - r, n[2], n[0], n[1]);
            return;  // inside the prism no edge of this facet stands higher
        }
    }
    for (int k = 0; k < 3; ++k) {
        if (!(f.edges >> k & 1)) continue;
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        for (const Vec3d* v : {&a, &b}) {
            const double d2 = (x - (*v)[0]) * (x - (*v)[0]) + (y - (*v)[1]) * (y - (*v)[1]);
            if (d2 >= r * r) continue;
            const double h = std::sqrt(r * r - d2);
            best.offer((*v)[2] + h - r, h / r, (x - (*v)[0]) / r, (y - (*v)[1]) / r);
        }
        const double dx = b[0] - a[0], dy = b[1] - a[1], dz = b[2] - a[2], l2 = dx * dx + dy * dy;
        if (l2 < 1e-18) continue;
        const double l = std::sqrt(l2), wx = x - a[0], wy = y - a[1];
        const double across = (dx * wy - dy * wx) / l;  // horizontal distance from the edge's line
        const double q = r * r - across * across;
        if (q <= 0) continue;
        // In the vertical plane along the edge: a circle of radius √q over a line of slope dz/l.
        const double l3 = std::sqrt(l2 + dz * dz), s = std::sqrt(q), along = (dx * wx + dy * wy) / l;
        const double foot = along + s * dz / l3;  // horizontal place of the contact
        if (foot < 0 || foot > l) continue;
        const double pz = a[2] + dz * foot / l;
        const double up = s * l / l3;
        best.offer(pz + up - r, up / r, (x - a[0] - foot * dx / l) / r, (y - a[1] - foot * dy / l) / r);
    }
}

// A flat tip over one facet: the highest point of the facet within the disc.
void drop_flat(const SolidFacet& f, double r, double x, double y, Best& best) {
    const Vec3d& n = f.normal;
    auto in_triangle = [&](double px, double py) {
        bool positive = false, negative = false;
        for (int k = 0; k < 3; ++k) {
            const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
            const double s = (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0]);
            positive |= s > 0;
            negative |= s < 0;
        }
        return !(positive && negative);
    };
    if (std::abs(n[2]) > 1e-9) {
        // On the plane the disc touches at its uphill rim (anywhere, where the plane is level: at its middle).
        const double slope = std::sqrt(n[0] * n[0] + n[1] * n[1]), up = n[2] > 0 ? -1.0 : 1.0;
        const double px = slope > 1e-12 ? x + up * r * n[0] / slope : x, py = slope > 1e-12 ? y + up * r * n[1] / slope : y;
        if (in_triangle(px, py)) best.offer(f.p[0][2] - (n[0] * (px - f.p[0][0]) + n[1] * (py - f.p[0][1])) / n[2], f.nz);
    }
    for (int k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const double dx = b[0] - a[0], dy = b[1] - a[1], l2 = dx * dx + dy * dy, wx = a[0] - x, wy = a[1] - y;
        if (wx * wx + wy * wy < r * r) best.offer(a[2], f.nz);
        if (l2 < 1e-18) continue;
        // Where the edge crosses the disc's rim.
        const double half = dx * wx + dy * wy, discriminant = half * half - l2 * (wx * wx + wy * wy - r * r);
        if (discriminant <= 0) continue;
        const double root = std::sqrt(discriminant);
        for (const double t : {(-half - root) / l2, (-half + root) / l2})
            if (t >= 0 && t <= 1) best.offer(a[2] + t * (b[2] - a[2]), f.nz);
    }
}

}  // namespace

DropIndex::DropIndex(Context& context, const LayerSolid& solid, const Cutter& cutter) : solid_(solid), cutter_(cutter) {
    if (solid.facets.empty()) return;
    const double width = solid.max[0] - solid.min[0], depth = solid.max[1] - solid.min[1];
    cell_ = std::max({cutter.radius / 2, width / 1024, depth / 1024, 1e-3});
    x0_ = solid.min[0];
    y0_ = solid.min[1];
    columns_ = static_cast<std::size_t>(width / cell_) + 1;
    rows_ = static_cast<std::size_t>(depth / cell_) + 1;
    auto column = [&](double x) { return std::min(columns_ - 1, static_cast<std::size_t>(std::max(0.0, (x - x0_) / cell_))); };
    auto row = [&](double y) { return std::min(rows_ - 1, static_cast<std::size_t>(std::max(0.0, (y - y0_) / cell_))); };
    bounds_.resize(solid.facets.size());
    parallel_for(context, solid.facets.size(), std::size_t{1} << 14, [&](std::size_t begin, std::size_t end) {
        constexpr float inf = std::numeric_limits<float>::infinity();
        for (std::size_t i = begin; i < end; ++i) {
            const SolidFacet& f = solid.facets[i];
            const auto [xl, xh] = std::minmax({f.p[0][0], f.p[1][0], f.p[2][0]});
            const auto [yl, yh] = std::minmax({f.p[0][1], f.p[1][1], f.p[2][1]});
            bounds_[i] = {std::nextafter(static_cast<float>(xl), -inf),
                          std::nextafter(static_cast<float>(xh), inf),
                          std::nextafter(static_cast<float>(yl), -inf),
                          std::nextafter(static_cast<float>(yh), inf),
                          std::nextafter(static_cast<float>(f.z_max), inf),
                          static_cast<std::uint16_t>(column(xl)),
                          static_cast<std::uint16_t>(row(yl))};
        }
    });
    starts_.assign(columns_ * rows_ + 1, 0);
    for (int pass = 0; pass < 2; ++pass) {
        for (std::size_t i = 0; i < solid.facets.size(); ++i) {
            const SolidFacet& f = solid.facets[i];
            const auto [xl, xh] = std::minmax({f.p[0][0], f.p[1][0], f.p[2][0]});
            const auto [yl, yh] = std::minmax({f.p[0][1], f.p[1][1], f.p[2][1]});
            for (std::size_t r = row(yl), r1 = row(yh); r <= r1; ++r)
                for (std::size_t c = column(xl), c1 = column(xh); c <= c1; ++c) {
                    std::uint32_t& slot = starts_[r * columns_ + c + (pass == 0 ? 1 : 0)];
                    if (pass == 1) members_[slot] = static_cast<std::uint32_t>(i);
                    ++slot;
                }
        }
        if (pass == 0) {
            for (std::size_t k = 1; k < starts_.size(); ++k) starts_[k] += starts_[k - 1];
            members_.resize(starts_.back());
        } else {
            for (std::size_t k = starts_.size() - 1; k > 0; --k) starts_[k] = starts_[k - 1];
            starts_[0] = 0;
        }
    }
    // Highest first: a drop may stop at the first facet that lies below what it already rests on.
    parallel_for(context, columns_ * rows_, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            std::sort(members_.begin() + starts_[k], members_.begin() + starts_[k + 1], [&](std::uint32_t a, std::uint32_t b) {
                const double za = solid.facets[a].z_max, zb = solid.facets[b].z_max;
                return za != zb ? za > zb : a < b;
            });
    });
    cap_starts_.assign(rows_ + 1, 0);
    for (int pass = 0; pass < 2; ++pass) {
        for (std::size_t l = 0; l < solid.cap.size(); ++l) {
            const auto loop = solid.cap.loop(l);
            for (std::size_t i = 0; i < loop.size(); ++i) {
                const Point2 a = loop[i], b = loop[i + 1 == loop.size() ? 0 : i + 1];
                if (a.y == b.y) continue;
                for (std::size_t r = row(to_mm(std::min(a.y, b.y))), r1 = row(to_mm(std::max(a.y, b.y))); r <= r1; ++r) {
                    std::uint32_t& slot = cap_starts_[r + (pass == 0 ? 1 : 0)];
                    if (pass == 1) cap_segments_[slot] = {a, b};
                    ++slot;
                }
            }
        }
        if (pass == 0) {
            for (std::size_t k = 1; k < cap_starts_.size(); ++k) cap_starts_[k] += cap_starts_[k - 1];
            cap_segments_.resize(cap_starts_.back());
        } else {
            for (std::size_t k = cap_starts_.size() - 1; k > 0; --k) cap_starts_[k] = cap_starts_[k - 1];
            cap_starts_[0] = 0;
        }
    }
}

bool DropIndex::in_cap(double x, double y) const {
    if (y < y0_ || y > y0_ + static_cast<double>(rows_) * cell_) return false;
    const std::size_t row = std::min(rows_ - 1, static_cast<std::size_t>((y - y0_) / cell_));
    const double ux = x * kUnitsPerMm, uy = y * kUnitsPerMm;
    int winding = 0;
    for (std::uint32_t k = cap_starts_[row]; k < cap_starts_[row + 1]; ++k) {
        const CapSegment& s = cap_segments_[k];
        if ((s.a.y <= uy) == (s.b.y <= uy)) continue;
        const double at = s.a.x + (uy - s.a.y) / (static_cast<double>(s.b.y) - s.a.y) * (static_cast<double>(s.b.x) - s.a.x);
        if (at > ux) winding += s.b.y > s.a.y ? 1 : -1;
    }
    return winding > 0;
}

Rest DropIndex::drop(double x, double y) const {
    Rest rest;
    rest.tip_z = -std::numeric_limits<double>::infinity();
    if (columns_ == 0) return rest;
    if (in_cap(x, y)) return {solid_.z_top, 0.0F, 0.0F, 1.0F, true};
    const double r = cutter_.radius;
    if (x < solid_.min[0] - r || x > solid_.max[0] + r || y < solid_.min[1] - r || y > solid_.max[1] + r) return rest;
    auto clamp = [](double v, std::size_t n) { return std::min(n - 1, static_cast<std::size_t>(std::max(0.0, v))); };
    const std::size_t c0 = clamp((x - r - x0_) / cell_, columns_), c1 = clamp((x + r - x0_) / cell_, columns_);
    const std::size_t r0 = clamp((y - r - y0_) / cell_, rows_), r1 = clamp((y + r - y0_) / cell_, rows_);
    Best best;
    const bool ball = cutter_.profile == Cutter::Profile::ball;
    // At a distance d from the axis a ball's surface is at least d² / 2R above its tip, so what stands there lifts the tip by that much less.
    // The cell under the axis comes first: what it gives leaves out most of the others.
    const double bend = ball ? 1 / (2 * r) : 0;
    const std::size_t c_mid = clamp((x - x0_) / cell_, columns_), r_mid = clamp((y - y0_) / cell_, rows_);
    auto visit = [&](std::size_t row, std::size_t column, bool middle) {
        const std::uint32_t *first = members_.data() + starts_[row * columns_ + column],
                            *last = members_.data() + starts_[row * columns_ + column + 1];
        for (; first != last; ++first) {
            const Bounds& b = bounds_[*first];
            if (b.z_max <= best.tip_z) break;
            // Listed in several cells of this window it is looked at in the first of them.
            if (!middle && (column != std::max<std::size_t>(c0, b.column) || row != std::max<std::size_t>(r0, b.row))) continue;
            const double dx = std::max({0.0, b.x_low - x, x - b.x_high}), dy = std::max({0.0, b.y_low - y, y - b.y_high}), d2 = dx * dx + dy * dy;
            if (d2 > r * r || b.z_max - d2 * bend <= best.tip_z) continue;
            const SolidFacet& f = solid_.facets[*first];
            if (ball) drop_ball(f, r, x, y, best);
            else drop_flat(f, r, x, y, best);
        }
    };
    visit(r_mid, c_mid, true);
    for (std::size_t row = r0; row <= r1; ++row)
        for (std::size_t column = c0; column <= c1; ++column) visit(row, column, false);
    rest.tip_z = best.tip_z;
    rest.nx = static_cast<float>(best.nx);
    rest.ny = static_cast<float>(best.ny);
    rest.nz = static_cast<float>(best.nz);
    return rest;
}

}  // namespace slabwright
