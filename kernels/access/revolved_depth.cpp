#include "kernels/access/revolved_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "kernels/access/poke.h"
#include "kernels/access/standing_part.h"

namespace slabwright {

namespace {

/// A face of the prism, and how far along the piece the cutter is at each of its corners.
struct PrismFace {
    Triangle corners;
    std::array<double, 3> t;
};

/// The faces of a triangle's way past the cutter, with the tip at the origin.
class Prism {
public:
    Prism(const Point3& a, const Point3& b, const Triangle& triangle) {
        const bool moves = a != b;
        Triangle from, to;
        for (std::size_t k = 0; k < 3; ++k) from[k] = minus(triangle[k], a), to[k] = minus(triangle[k], b);
        add({from, {0, 0, 0}});
        if (!moves) return;
        add({to, {1, 1, 1}});
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t n = (k + 1) % 3;
            add({{from[k], from[n], to[n]}, {0, 0, 1}});
            add({{from[k], to[n], to[k]}, {0, 1, 1}});
        }
    }
    [[nodiscard]] double top() const { return top_; }
    /// A point of it in the under side, and which face it is on.
    struct Met {
        std::size_t face;
        Point3 at;
    };
    [[nodiscard]] std::optional<Met> meets(const Envelope& under) const {
        Met met{};
        for (; met.face < count_; ++met.face)
            if (pokes(faces_[met.face].corners, 0, 0, 0, under, met.at)) return met;
        return std::nullopt;
    }
    /// How far along the piece the cutter meets a point of a face.
    [[nodiscard]] double along(const Met& met) const {
        const PrismFace& face = faces_[met.face];
        const Triangle& c = face.corners;
        const Point3 u = minus(c[1], c[0]), v = minus(c[2], c[0]), w = minus(met.at, c[0]);
        const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w),
                     area2 = uu * vv - uv * uv;
        if (!(area2 > 0)) return face.t[0];
        const double s = (vv * uw - uv * vw) / area2, r = (uu * vw - uv * uw) / area2;
        return std::clamp(face.t[0] + s * (face.t[1] - face.t[0]) + r * (face.t[2] - face.t[0]), 0.0, 1.0);
    }

private:
    void add(const PrismFace& face) {
        for (const Point3& p : face.corners) top_ = std::max(top_, p[2]);
        faces_[count_++] = face;
    }
    std::array<PrismFace, 8> faces_;
    std::size_t count_ = 0;
    double top_ = -kUnbounded;
};

}  // namespace

double depth_within(const Envelope& under, double from_axis, double height) {
    // What is at least as deep as the rounding is a disc (none of what ends in a point) with a flank around
    // it, and depth is measured from that: into it, or out to it.
    const double u = from_axis - under.core, v = height - under.low - under.rounding;
    const double flank = v * under.sin_taper - u * under.cos_taper;
    double inner = 0;
    const bool ends_in_point = under.core <= 0 && under.sin_taper > 0;
    if (flank >= 0 && (v >= 0 || ends_in_point)) inner = ends_in_point ? flank : std::min(v, flank);
    else if (u <= 0) inner = v;
    else if (u * under.sin_taper + v * under.cos_taper >= 0) inner = flank;
    else inner = -std::hypot(u, v);
    return std::min(under.radius - from_axis, under.rounding + inner);
}

Deepest revolved_piece_depth(const Point3& a, const Point3& b, const Triangle& triangle,
                             const Envelope& under, double best) {
    const Prism prism(a, b, triangle);
    double low = best + StandingPart::kNumericalError,
           high = std::min(under.radius, depth_within(under, 0, prism.top()));
    if (high <= low) return {best, 0};
    std::optional<Prism::Met> deepest = prism.meets(under.eroded(low));
    if (!deepest) return {best, 0};
    const auto raise = [&](const Prism::Met& met) {
        deepest = met;
        low = std::max(low, depth_within(under, std::hypot(met.at[0], met.at[1]), met.at[2]));
    };
    raise(*deepest);
    while (high - low > StandingPart::kNumericalError) {
        const double middle = (low + high) / 2;
        if (const std::optional<Prism::Met> met = prism.meets(under.eroded(middle))) {
            low = middle;
            raise(*met);
        } else {
            high = middle;
        }
    }
    return {low, prism.along(*deepest)};
}

}  // namespace slabwright
