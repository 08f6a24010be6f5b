#include "kernels/cutting/revolved.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace slabwright {

namespace {

constexpr double kBracket = 1e-8;  // mm: of a height or a place, far under what a plan's text tells
constexpr int kHalvings = 80;
constexpr double kLevel = 1e-9;  // of a unit normal

// The distance from the axis at which a plane of this steepness touches from below.
double contact_distance(const Envelope& e, double steep) {
    const double sine = steep / std::sqrt(1 + steep * steep);
    return sine <= e.cos_taper ? std::min(e.radius, e.core + e.rounding * sine) : e.radius;
}

// Gives `best` a contact with the normal that the under side has there.
void take(const Envelope& e, double facet_nz, double x, double y, const Vec3d& p, double tip_z,
          RevolvedContact& best) {
    const double dx = x - p[0], dy = y - p[1], d = std::sqrt(dx * dx + dy * dy);
    best.tip_z = tip_z;
    best.point = p;
    if (d <= e.core || d == 0) {
        best.nx = best.ny = 0;
        best.nz = e.core > 0 ? facet_nz : 1;
        return;
    }
    const double slope = e.slope(std::min(d, e.radius));
    const double out = std::isfinite(slope) ? slope / std::sqrt(1 + slope * slope) : 1;
    best.nx = out * dx / d;
    best.ny = out * dy / d;
    best.nz = std::sqrt(std::max(0.0, 1 - out * out));
}

// The place on the segment from a to b that holds the tip highest, as its share of the way, if it is above
// `least`; negative else.
double highest_on_edge(const Vec3d& a, const Vec3d& b, const Envelope& e, double x, double y, double least) {
    const double dx = b[0] - a[0], dy = b[1] - a[1], dz = b[2] - a[2], ax = a[0] - x, ay = a[1] - y;
    const double l2 = dx * dx + dy * dy, along = ax * dx + ay * dy,
                 c = ax * ax + ay * ay - e.radius * e.radius;
    double from = 0, to = 1;
    if (l2 > 0) {
        const double root = along * along - l2 * c;
        if (root < 0) return -1;
        from = std::max(0.0, (-along - std::sqrt(root)) / l2);
        to = std::min(1.0, (-along + std::sqrt(root)) / l2);
        if (!(from <= to)) return -1;
    } else if (c > 0) return -1;
    const auto z = [&](double t) { return a[2] + t * dz; };
    if (std::max(z(from), z(to)) - e.low <= least) return -1;
    const auto distance = [&](double t) {
        const double px = ax + t * dx, py = ay + t * dy;
        return std::min(e.radius, std::sqrt(px * px + py * py));
    };
    const auto tip = [&](double t) { return z(t) - e.height(distance(t)); };
    double best = from, most = tip(from);
    const auto offer = [&](double t) {
        const double over = tip(t);
        if (over > most) best = t, most = over;
    };
    offer(to);
    double low = from, high = to;
    for (int i = 0; i < kHalvings; ++i) {
        const double t = (low + high) / 2, d = distance(t), outward = along + t * l2;
        offer(t);
        const double rise = d > 0 && outward != 0 ? dz - e.slope(d) * outward / d : dz;
        // A concave function stays under its tangent.
        const double room = std::abs(rise) * (high - low) / 2;
        if (rise == 0 || room < kBracket || tip(t) + room <= least) break;
        (rise > 0 ? low : high) = t;
    }
    return most > least ? best : -1;
}

}  // namespace

bool drop_revolved(const SolidFacet& f, const Envelope& e, double x, double y, RevolvedContact& best) {
    if (f.z_max - e.low <= best.tip_z) return false;
    const Vec3d& n = f.normal;
    bool raised = false;
    if (std::abs(n[2]) > kLevel) {
        const double gx = -n[0] / n[2], gy = -n[1] / n[2], steep = std::sqrt(gx * gx + gy * gy);
        const double d = steep > 0 ? contact_distance(e, steep) : 0;
        const double px = steep > 0 ? x + d * gx / steep : x, py = steep > 0 ? y + d * gy / steep : y;
        const double pz = f.p[0][2] + gx * (px - f.p[0][0]) + gy * (py - f.p[0][1]), tip = pz - e.height(d);
        if (tip <= best.tip_z) return false;  // nor does anything else of the plane hold it higher
        bool positive = false, negative = false;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
            const double side = (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0]);
            positive |= side > 0;
            negative |= side < 0;
        }
        if (!(positive && negative)) {
            take(e, f.nz, x, y, {px, py, pz}, tip, best);
            return true;
        }
    }
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const double t = highest_on_edge(a, b, e, x, y, best.tip_z);
        if (t < 0) continue;
        const Vec3d p{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
        const double dx = p[0] - x, dy = p[1] - y;
        const double tip = p[2] - e.height(std::min(e.radius, std::sqrt(dx * dx + dy * dy)));
        if (tip <= best.tip_z) continue;
        take(e, f.nz, x, y, p, tip, best);
        raised = true;
    }
    return raised;
}

// What is known of a line's stretch so far: both ends are places of the cutter at which it touches the facet
// or holds some of it.
struct FacetOverTip::Ends {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    double nz_low = 0, nz_high = 0;
    bool low_is_sure = false, high_is_sure = false;  ///< found on the plane: no edge reaches farther

    void offer_low(double u, double nz) {
        if (u < low) low = u, nz_low = nz;
    }
    void offer_high(double u, double nz) {
        if (u > high) high = u, nz_high = nz;
    }
};

FacetOverTip::FacetOverTip(const SolidFacet& f, const Envelope& under, double tip_z, int axis_u)
    : under_(under), facet_nz_(f.nz) {
    const auto U = static_cast<std::size_t>(axis_u), V = 1 - U;
    const auto at = [&](const Vec3d& p) { return Corner{p[U], p[V], p[2] - tip_z - under.low}; };
    for (std::size_t k = 0; k < 3; ++k) {
        const Corner a = at(f.p[k]), b = at(f.p[(k + 1) % 3]);
        if (a.z > 0) corners_[count_++] = a;
        if ((a.z > 0) == (b.z > 0)) continue;
        const Corner &low = a.z > 0 ? b : a, &high = a.z > 0 ? a : b;
        const double t = -low.z / (high.z - low.z);
        corners_[count_++] = {low.u + t * (high.u - low.u), low.v + t * (high.v - low.v), 0};
    }
    if (count_ == 0) return;
    u_low_ = v_low_ = std::numeric_limits<double>::infinity();
    u_high_ = v_high_ = -u_low_;
    double top = 0;
    for (int k = 0; k < count_; ++k) {
        const Corner& c = corners_[k];
        u_low_ = std::min(u_low_, c.u), u_high_ = std::max(u_high_, c.u);
        v_low_ = std::min(v_low_, c.v), v_high_ = std::max(v_high_, c.v);
        top = std::max(top, c.z);
    }
    const double reach = std::max(0.0, under.width(top + under.low));
    u_low_ -= reach, u_high_ += reach, v_low_ -= reach, v_high_ += reach;
    has_plane_ = std::abs(f.normal[2]) > kLevel && count_ >= 3;
    if (!has_plane_) return;
    gu_ = -f.normal[U] / f.normal[2];
    gv_ = -f.normal[V] / f.normal[2];
    steep_ = std::sqrt(gu_ * gu_ + gv_ * gv_);
    away_ = steep_ > 0 ? contact_distance(under, steep_) : 0;
    height_ = under.height(away_) - under.low;
}

double FacetOverTip::nz_at(double distance) const {
    if (distance <= under_.core && under_.core > 0) return facet_nz_;
    const double slope = under_.slope(std::min(distance, under_.radius));
    return std::isfinite(slope) ? 1 / std::sqrt(1 + slope * slope) : 0;
}

// Where the plane's contact lies in the facet no edge of it reaches farther.
void FacetOverTip::meet_plane(double v, Ends& ends) const {
    if (steep_ <= 0 || gu_ == 0) return;
    const double au = away_ * gu_ / steep_, av = away_ * gv_ / steep_;  // from the axis to the contact
    const Corner& c = corners_[0];
    const double pv = v + av, pu = c.u + (height_ - c.z - gv_ * (pv - c.v)) / gu_;
    bool positive = false, negative = false;
    for (int k = 0; k < count_; ++k) {
        const Corner &a = corners_[k], &b = corners_[(k + 1) % count_];
        const double side = (b.u - a.u) * (pv - a.v) - (b.v - a.v) * (pu - a.u);
        positive |= side > 0;
        negative |= side < 0;
    }
    if (positive && negative) return;
    const double nz = away_ > under_.core ? nz_at(away_) : facet_nz_;
    if (gu_ > 0) ends.offer_low(pu - au, nz), ends.low_is_sure = true;
    else ends.offer_high(pu - au, nz), ends.high_is_sure = true;
}

void FacetOverTip::meet_corner(const Corner& a, double v, Ends& ends) const {
    const double w = under_.width(a.z + under_.low), off = v - a.v;
    if (!(w > std::abs(off))) return;
    const double reach = std::sqrt(w * w - off * off), nz = nz_at(w);
    ends.offer_low(a.u - reach, nz);
    ends.offer_high(a.u + reach, nz);
}

// At a place t of the edge the cutter holds it within the half-chord s(t) of the disc as wide as the cutter
// is at its height: u(t) ± s(t) are concave and convex where there is a chord at all, which is where the
// concave width(t) − |v − v(t)| is positive.
void FacetOverTip::meet_edge(const Corner& a, const Corner& b, double v, Ends& ends) const {
    const double du = b.u - a.u, dv = b.v - a.v, dz = b.z - a.z;
    if (du == 0 && dv == 0) return;  // its upper end reaches farthest
    const double low_v = std::min(a.v, b.v), high_v = std::max(a.v, b.v);
    const double widest = under_.width(std::max(a.z, b.z) + under_.low);
    if (v <= low_v - widest || v >= high_v + widest) return;
    const auto widening = [&](double width) {  // of the width, by height
        if (width >= under_.radius) return 0.0;
        const double slope = under_.slope(width);
        return slope > 0 ? 1 / slope : std::numeric_limits<double>::infinity();
    };
    const auto farthest = [&](double sign, double known) {
        double from = 0, to = 1, best = -std::numeric_limits<double>::infinity(), best_width = 0;
        for (int i = 0; i < kHalvings; ++i) {
            const double t = (from + to) / 2, w = under_.width(a.z + t * dz + under_.low),
                         off = v - a.v - t * dv, s2 = w * w - off * off;
            const double grows = dz != 0 ? widening(w) * dz : 0;
            double rise = 0;
            if (s2 <= 0) {
                rise = grows + (off > 0 ? dv : -dv);
            } else {
                const double s = std::sqrt(s2), place = sign * (a.u + t * du) + s;
                if (place > best) best = place, best_width = w;
                rise = sign * du + (w * grows + off * dv) / s;
                const double room = std::abs(rise) * (to - from) / 2;
                if (room < kBracket || place + room <= known) break;
            }
            if (rise == 0 || to - from < 1e-14) break;
            (rise > 0 ? from : to) = t;
        }
        return std::pair{best, best_width};
    };
    if (!ends.low_is_sure) {
        const auto [place, width] = farthest(-1, -ends.low);
        if (-place < ends.low) ends.offer_low(-place, nz_at(width));
    }
    if (!ends.high_is_sure) {
        const auto [place, width] = farthest(1, ends.high);
        if (place > ends.high) ends.offer_high(place, nz_at(width));
    }
}

RevolvedStretch FacetOverTip::stretch(double v) const {
    Ends ends;
    if (count_ > 0 && v > v_low_ && v < v_high_) {
        if (has_plane_) meet_plane(v, ends);
        if (!(ends.low_is_sure && ends.high_is_sure)) {
            for (int k = 0; k < count_; ++k) meet_corner(corners_[k], v, ends);
            for (int k = 0; k < count_; ++k) meet_edge(corners_[k], corners_[(k + 1) % count_], v, ends);
        }
    }
    return {ends.low, ends.high, ends.nz_low, ends.nz_high};
}

}  // namespace slabwright
