#include "kernels/cutting/drop.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "kernels/cutting/revolved.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kNoEnd = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-6;  // mm: more than rounding takes from a height over a plane, a sliver's too
constexpr double kSurely = 1e-5;    // mm: less than this is not said of what a point that was met keeps up

struct Best {
    double tip_z = -std::numeric_limits<double>::infinity();
    double nz = 0;
    double x = 0, y = 0;  // of the normal for a ball, of the contact for a flat cutter
    void offer(double z, double up, double to_x, double to_y) {
        if (!(z > tip_z)) return;
        tip_z = z, nz = up;
        x = to_x, y = to_y;
    }
};

// A ball's tip over one facet: the plane where the contact falls inside, then the edges it owns and their
// ends.
void drop_ball(const SolidFacet& f, double r, double x, double y, Best& best) {
    const Vec3d& n = f.normal;
    if (n[2] > 1e-9) {
        // Centre above the plane by r: contact p = c − r·n, p inside the triangle.
        const double px = x - r * n[0], py = y - r * n[1];
        const double pz = f.p[0][2] - (n[0] * (px - f.p[0][0]) + n[1] * (py - f.p[0][1])) / n[2],
                     tip = pz + r * n[2] - r;
        if (tip + kRounding <= best.tip_z)
            return;           // nor does anything of the facet lift the ball more than its plane
        double outside2 = 0;  // how far p lies beyond one of the edges, squared
        bool inside = true;
        for (int k = 0; k < 3; ++k) {
            const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
            const double dx = b[0] - a[0], dy = b[1] - a[1], across = dx * (py - a[1]) - dy * (px - a[0]);
            if (across >= 0) continue;
            inside = false;
            if (across * across > outside2 * (dx * dx + dy * dy))
                outside2 = across * across / (dx * dx + dy * dy);
        }
        if (inside) {
            best.offer(tip, n[2], n[0], n[1]);
            return;  // inside the prism no edge of this facet stands higher
        }
        if (tip - outside2 / (2 * r) + kRounding <= best.tip_z) return;  // see ball_bounds
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
        // On the plane the disc touches at its uphill rim (anywhere, where the plane is level: at its
        // middle).
        const double slope = std::sqrt(n[0] * n[0] + n[1] * n[1]), up = n[2] > 0 ? -1.0 : 1.0;
        const double px = slope > 1e-12 ? x + up * r * n[0] / slope : x,
                     py = slope > 1e-12 ? y + up * r * n[1] / slope : y;
        const double z = f.p[0][2] - (n[0] * (px - f.p[0][0]) + n[1] * (py - f.p[0][1])) / n[2];
        if (z > best.tip_z && in_triangle(px, py)) best.offer(z, f.nz, px, py);
    }
    for (int k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        if (a[2] <= best.tip_z && b[2] <= best.tip_z) continue;
        const double dx = b[0] - a[0], dy = b[1] - a[1], l2 = dx * dx + dy * dy, wx = a[0] - x, wy = a[1] - y;
        if (wx * wx + wy * wy < r * r) best.offer(a[2], f.nz, a[0], a[1]);
        if (l2 < 1e-18) continue;
        // Where the edge crosses the disc's rim.
        const double half = dx * wx + dy * wy, discriminant = half * half - l2 * (wx * wx + wy * wy - r * r);
        if (discriminant <= 0) continue;
        const double root = std::sqrt(discriminant);
        for (const double t : {(-half - root) / l2, (-half + root) / l2})
            if (t >= 0 && t <= 1) best.offer(a[2] + t * (b[2] - a[2]), f.nz, a[0] + t * dx, a[1] + t * dy);
    }
}

// The greatest float that is no more: floats over the one are over the other.
float rounded_down(double v) {
    const auto f = static_cast<float>(v);
    return static_cast<double>(f) > v ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}

// The contact that lifts the cutter most, if that is above what it begins with. @param enough mm: the first
// one above that will do
/// @param meet raises `best` by what a facet lifts the cutter to
template <bool ball, class Found, class Meet>
void search(const LayerSolid& solid, const DropProbe& probe, double enough, Found& best, Meet&& meet) {
    struct Waiting {
        float bound;
        std::uint32_t level, node;
    };
    constexpr int most_levels = 12, k_all = FacetTree::kTogether;
    std::array<Waiting, most_levels * k_all> waiting;  // the highest bound of each level last
    float least = rounded_down(best.tip_z);
    for (const FacetTree::Tier& tier : solid.tree.tiers) {
        std::size_t count = 0;
        Waiting now{std::numeric_limits<float>::infinity(),
                    static_cast<std::uint32_t>(tier.starts.size() - 2), 0};
        while (true) {
            alignas(64) std::array<float, k_all> bounds;
            const FacetTree::Node& node = tier.nodes[tier.starts[now.level] + now.node];
            std::uint32_t over = ball ? ball_bounds(node, probe, least, bounds.data())
                                      : flat_bounds(node, probe, least, bounds.data());
            // The children worth a look, ascending.
            std::array<std::uint32_t, k_all> order;
            std::size_t n = 0;
            for (; over != 0; over &= over - 1) {
                const auto k = static_cast<std::uint32_t>(std::countr_zero(over));
                std::size_t at = n++;
                for (; at > 0 && bounds[order[at - 1]] > bounds[k]; --at) order[at] = order[at - 1];
                order[at] = k;
            }
            if (now.level > 0 && n > 0) {
                for (std::size_t i = 0; i + 1 < n; ++i)
                    waiting[count++] = {bounds[order[i]], now.level - 1, k_all * now.node + order[i]};
                now = {bounds[order[n - 1]], now.level - 1, k_all * now.node + order[n - 1]};
                continue;
            }
            // Most of them are looked at, and far apart in memory.
            const std::uint32_t* const facets = tier.facets.data() + std::size_t{k_all} * now.node;
            for (std::size_t i = 0; i < n; ++i) {
                const SolidFacet& f = solid.facets[facets[order[i]]];
                __builtin_prefetch(&f);
                __builtin_prefetch(&f.z_max);
            }
            while (n-- > 0 && bounds[order[n]] > least) {
                const SolidFacet& f = solid.facets[facets[order[n]]];
                const double before = best.tip_z;
                meet(f);
                if (best.tip_z > enough) return;
                if (best.tip_z > before) least = rounded_down(best.tip_z);
            }
            while (count > 0 && !(waiting[count - 1].bound > least)) --count;
            if (count == 0) break;
            now = waiting[--count];
        }
    }
}

// The same for a cutter that is neither. Its tip rests no higher than that of the flat cutter around it,
// whose bounds serve.
void search_other(const LayerSolid& solid, const DropProbe& probe, const Envelope& under, double x, double y,
                  double enough, double kept_up, Best& best, MetPoints* met) {
    RevolvedContact contact{std::max(kept_up, best.tip_z), {}, 0, 0, 0};
    const auto found_over = [&](double from) {
        contact.tip_z = from;
        search<false>(solid, probe, enough, contact,
                      [&](const SolidFacet& f) { drop_revolved(f, under, x, y, contact); });
        return contact.tip_z > from;
    };
    const double above = best.tip_z;
    if (!(kept_up > above && found_over(kept_up)) && !found_over(above)) return;
    best.offer(contact.tip_z, contact.nz, contact.nx, contact.ny);
    if (met != nullptr) met->add(contact.point);
}

// The same, and what was met there before spares most of it; `best` begins with what need not be found.
void search(const LayerSolid& solid, const DropProbe& probe, const CutterShape& cutter, double x, double y,
            double enough, double kept_up, Best& best, MetPoints* met) {
    if (!cutter.is_plain())
        return search_other(solid, probe, under_side(cutter), x, y, enough, kept_up, best, met);
    const double above = best.tip_z, r = cutter.radius;
    const bool ball = cutter.is_ball();
    auto found_over = [&](double from) {
        best.tip_z = from;
        if (ball)
            search<true>(solid, probe, enough, best,
                         [&](const SolidFacet& f) { drop_ball(f, r, x, y, best); });
        else
            search<false>(solid, probe, enough, best,
                          [&](const SolidFacet& f) { drop_flat(f, r, x, y, best); });
        return best.tip_z > from;
    };
    if (!(kept_up > above && found_over(kept_up)) && !found_over(above)) return;
    if (met == nullptr) return;
    if (ball) met->add({x - r * best.x, y - r * best.y, best.tip_z + r * (1 - best.nz)});
    else met->add({best.x, best.y, best.tip_z});
}

}  // namespace

double MetPoints::keep_up(const CutterShape& cutter, double x, double y) const {
    if (!cutter.is_plain()) {
        const Envelope under = under_side(cutter);
        double most = -kNoEnd;
        for (const Vec3d& p : points_) {
            const double distance = std::hypot(x - p[0], y - p[1]) + kSurely;
            if (distance < cutter.radius) most = std::max(most, p[2] - under.height(distance));
        }
        return most - kSurely;
    }
    const double reach = cutter.radius - kSurely;
    double most = -kNoEnd;
    for (const Vec3d& p : points_) {
        const double dx = x - p[0], dy = y - p[1], room2 = reach * reach - dx * dx - dy * dy;
        if (room2 > 0)
            most = std::max(most, p[2] + (cutter.is_ball() ? std::sqrt(room2) - cutter.radius : 0));
    }
    return most - kSurely;
}

DropIndex::DropIndex(const LayerSolid& solid, const CutterShape& cutter) : solid_(solid), cutter_(cutter) {
    if (!(cutter.radius > 0 && cutter.radius <= FacetTree::kWidestCutter))
        throw Error(ErrorKind::usage, "drop.radius", "a cutter's radius is not between 0 and 1 m", "cutter",
                    "correct the tool's diameter");
    (void)under_side(cutter);  // refuses measures that make no cutter
    const double unit = solid.tree.unit, r = cutter.radius;
    probe_.radius = static_cast<float>(r / unit);
    probe_.unit = static_cast<float>(unit);
    probe_.inverse = static_cast<float>(1 / (2 * r));
    // Float has 24 bits, and no term of a bound is much larger than these.
    probe_.spare =
        static_cast<float>(5e-7 * (std::abs(solid.z_low) + std::abs(solid.z_top) + 4 * r) + 8 * unit);
}

bool DropIndex::nothing_near(double x, double y) const {
    const double r = cutter_.radius;
    return solid_.tree.tiers.empty() || !(x >= solid_.min[0] - r && x <= solid_.max[0] + r &&
                                          y >= solid_.min[1] - r && y <= solid_.max[1] + r);
}

DropProbe DropIndex::probe_at(double x, double y) const {
    DropProbe probe = probe_;
    probe.x = solid_.tree.x_units(x), probe.y = solid_.tree.y_units(y);
    return probe;
}

Rest DropIndex::drop(double x, double y, double above, MetPoints* met) const {
    return *drop_within(x, y, above, kNoEnd, met);
}

std::optional<Rest> DropIndex::drop_within(double x, double y, double above, double most,
                                           MetPoints* met) const {
    Rest rest;
    rest.tip_z = -kNoEnd;
    if (nothing_near(x, y)) return rest;
    const double kept_up = met != nullptr ? met->keep_up(cutter_, x, y) : -kNoEnd;
    if (kept_up > most) return std::nullopt;
    if (solid_.cap_cells.inside(x, y)) rest = {solid_.z_top, 0.0F, 0.0F, 1.0F, true};
    else {
        Best best;
        best.tip_z = above;
        search(solid_, probe_at(x, y), cutter_, x, y, most, kept_up, best, met);
        if (best.tip_z > above) {
            const bool has_normal = !cutter_.is_flat();
            rest = {best.tip_z, has_normal ? static_cast<float>(best.x) : 0.0F,
                    has_normal ? static_cast<float>(best.y) : 0.0F, static_cast<float>(best.nz), false};
        }
    }
    if (rest.tip_z > most) return std::nullopt;
    return rest;
}

bool DropIndex::stands_over(double x, double y, double z, MetPoints* met) const {
    if (nothing_near(x, y)) return false;
    if (met != nullptr && met->keep_up(cutter_, x, y) > z) return true;
    if (solid_.cap_cells.inside(x, y)) return solid_.z_top > z;
    Best best;
    best.tip_z = z;
    search(solid_, probe_at(x, y), cutter_, x, y, z, -kNoEnd, best, met);
    return best.tip_z > z;
}

std::optional<double> DropIndex::tip_within(double x, double y, double most, MetPoints* met) const {
    Best best;
    if (nothing_near(x, y)) return best.tip_z;
    const double kept_up = met != nullptr ? met->keep_up(cutter_, x, y) : -kNoEnd;
    if (kept_up > most) return std::nullopt;
    if (solid_.cap_cells.inside(x, y)) best.tip_z = solid_.z_top;
    else search(solid_, probe_at(x, y), cutter_, x, y, most, kept_up, best, met);
    if (best.tip_z > most) return std::nullopt;
    return best.tip_z;
}

}  // namespace slabwright
