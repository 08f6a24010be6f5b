#include "kernels/access/cap_cover.h"

#include <cmath>

namespace slabwright {

namespace {

constexpr double kParallel = 1e-12;  // of a sine, squared: circles about one axis do not cross

double dot(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point3 cross(const Point3& a, const Point3& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }

}  // namespace

void CapCover::begin(const Cap& cap) {
    caps_.clear();
    corners_.clear();
    all_ = false;
    add(cap);
}

void CapCover::keep(const Point3& u, std::size_t a, std::size_t b) {
    for (std::size_t k = 0; k < caps_.size(); ++k)
        if (k != a && k != b && caps_[k].margin(u) > kInside) return;
    corners_.push_back(u);
}

void CapCover::add(const Cap& cap) {
    if (cap.cosine >= 1) return;
    if (cap.cosine <= -1) {
        all_ = true;
        return;
    }
    std::size_t left = 0;
    for (const Point3& u : corners_)
        if (cap.margin(u) <= kInside) corners_[left++] = u;
    corners_.resize(left);
    const std::size_t own = caps_.size();
    caps_.push_back(cap);
    // The circle's own point: along the axis, and aside in the direction that the axis has least of.
    Point3 aside{};
    const Point3 size{std::abs(cap.axis[0]), std::abs(cap.axis[1]), std::abs(cap.axis[2])};
    aside[size[0] <= size[1] && size[0] <= size[2] ? 0 : size[1] <= size[2] ? 1 : 2] = 1;
    const double along = dot(aside, cap.axis), sine = std::sqrt(1 - cap.cosine * cap.cosine), scale = sine / std::sqrt(1 - along * along);
    Point3 u;
    for (int k = 0; k < 3; ++k) u[k] = cap.cosine * cap.axis[k] + scale * (aside[k] - along * cap.axis[k]);
    keep(u, own, own);
    for (std::size_t i = 0; i < own; ++i) {
        // u = x·a + y·b ± z·(a × b) lies on both circles, and on the sphere.
        const Cap& other = caps_[i];
        const double g = dot(cap.axis, other.axis), square = 1 - g * g;
        if (square < kParallel) continue;
        const double x = (cap.cosine - g * other.cosine) / square, y = (other.cosine - g * cap.cosine) / square;
        const double rest = (1 - x * x - y * y - 2 * x * y * g) / square;
        if (rest < 0) continue;
        const double z = std::sqrt(rest);
        const Point3 normal = cross(cap.axis, other.axis);
        for (const double way : {z, -z}) {
            for (int k = 0; k < 3; ++k) u[k] = x * cap.axis[k] + y * other.axis[k] + way * normal[k];
            keep(u, own, i);
        }
    }
}

std::optional<Point3> CapCover::uncovered(const Point3& wanted) const {
    if (all_ || corners_.empty()) return std::nullopt;
    const Point3* best = &corners_.front();
    double most = dot(*best, wanted);
    for (const Point3& u : corners_)
        if (const double d = dot(u, wanted); d > most) most = d, best = &u;
    return *best;
}

}  // namespace slabwright
