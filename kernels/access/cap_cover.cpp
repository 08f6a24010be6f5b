#include "kernels/access/cap_cover.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

constexpr double kParallel = 1e-12;  // of a sine, squared: circles about one axis do not cross
constexpr double kClose =
    1e-5;  // the same, where rounding may put a crossing into the caps whose circles it lies on
constexpr std::size_t kAtOnce = 8;  // rows are filled up to a multiple of this, with caps of no direction
constexpr double kNowhere = 2;      // a cosine
constexpr double kNeither = 3;      // how deep what is no crossing counts to be

}  // namespace

// Where the circle of `own` crosses those of n others: u = a·own + b·other ± c·(own × other) lies on both and
// on the sphere. Twice n directions, which are so far in no cap. Says whether there are two circles about
// nearly the same axis.
SLABWRIGHT_WIDE static bool cross_circles(const Cap& own, const double* __restrict x,
                                          const double* __restrict y, const double* __restrict z,
                                          const double* __restrict cosine, int n, double* __restrict ux,
                                          double* __restrict uy, double* __restrict uz,
                                          double* __restrict depth) {
    const double ox = own.axis[0], oy = own.axis[1], oz = own.axis[2], oc = own.cosine;
    long close = 0;
    for (int i = 0; i < n; ++i) {
        const double g = ox * x[i] + oy * y[i] + oz * z[i], square = 1 - g * g, per = 1 / square;
        const double a = (oc - g * cosine[i]) * per, b = (cosine[i] - g * oc) * per;
        const double rest = (1 - a * a - b * b - 2 * a * b * g) * per;
        const double c = std::sqrt(rest > 0 ? rest : 0.0);
        const double along_x = a * ox + b * x[i], along_y = a * oy + b * y[i], along_z = a * oz + b * z[i];
        const double aside_x = c * (oy * z[i] - oz * y[i]), aside_y = c * (oz * x[i] - ox * z[i]),
                     aside_z = c * (ox * y[i] - oy * x[i]);
        const double none = rest >= 0 ? -kNeither : kNeither, state = square >= kParallel ? none : kNeither;
        ux[i] = along_x + aside_x;
        uy[i] = along_y + aside_y;
        uz[i] = along_z + aside_z;
        ux[n + i] = along_x - aside_x;
        uy[n + i] = along_y - aside_y;
        uz[n + i] = along_z - aside_z;
        depth[i] = state;
        depth[n + i] = state;
        close += square < kClose;
    }
    return close > 0;
}

static_assert(sizeof(Doubles8) == kAtOnce * sizeof(double));

// How deep n directions are in caps. In its own two a crossing is by rounding at most, which is less than
// what counts, unless their axes are close.
SLABWRIGHT_WIDE static void deepen(const double* __restrict x, const double* __restrict y,
                                   const double* __restrict z, const double* __restrict cosine, int caps,
                                   int n, const double* __restrict ux, const double* __restrict uy,
                                   const double* __restrict uz, double* __restrict depth) {
    for (int i = 0; i < n; i += static_cast<int>(kAtOnce)) {
        Doubles8 vx, vy, vz, most;
        std::memcpy(&vx, ux + i, sizeof(Doubles8));
        std::memcpy(&vy, uy + i, sizeof(Doubles8));
        std::memcpy(&vz, uz + i, sizeof(Doubles8));
        std::memcpy(&most, depth + i, sizeof(Doubles8));
        for (int k = 0; k < caps; ++k) {
            const Doubles8 in = x[k] * vx + y[k] * vy + z[k] * vz - cosine[k];
            most = in > most ? in : most;
        }
        std::memcpy(depth + i, &most, sizeof(Doubles8));
    }
}

void CapCover::begin(const Cap& cap) {
    size_ = 0;
    corners_.clear();
    all_ = false;
    add(cap);
}

// A point of the circle along the axis, and aside in the direction that the axis has least of.
void CapCover::keep_own(const Cap& cap) {
    Point3 aside{};
    const Point3 length{std::abs(cap.axis[0]), std::abs(cap.axis[1]), std::abs(cap.axis[2])};
    aside[length[0] <= length[1] && length[0] <= length[2] ? 0 : length[1] <= length[2] ? 1 : 2] = 1;
    const double along = dot(aside, cap.axis), sine = std::sqrt(1 - cap.cosine * cap.cosine),
                 scale = sine / std::sqrt(1 - along * along);
    Point3 u;
    for (int k = 0; k < 3; ++k) u[k] = cap.cosine * cap.axis[k] + scale * (aside[k] - along * cap.axis[k]);
    for (std::size_t i = 0; i < size_; ++i)
        if (cap_at(i).margin(u) > kInside) return;
    corners_.push_back(u);
}

// Crossings of circles about nearly the same axis once more, each in others than its own.
void CapCover::leave_out_own(const Cap& cap, std::size_t n) {
    for (std::size_t i = 0; i < 2 * n; ++i) {
        const std::size_t other = i % n;
        const double g = dot(cap.axis, cap_at(other).axis);
        if (crossings_[3][i] >= kNeither || 1 - g * g >= kClose) continue;
        const Point3 u{crossings_[0][i], crossings_[1][i], crossings_[2][i]};
        double& depth = crossings_[3][i];
        depth = -kNeither;
        for (std::size_t k = 0; k < size_; ++k)
            if (k != other) depth = std::max(depth, cap_at(k).margin(u));
    }
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
    const std::size_t n = (size_ + kAtOnce - 1) / kAtOnce * kAtOnce;
    bool crosses = false;
    if (n > 0) {
        if (crossings_[0].size() < 2 * n)
            for (std::vector<double>& row : crossings_) row.resize(2 * n);
        const double *x = caps_[0].data(), *y = caps_[1].data(), *z = caps_[2].data(),
                     *cosine = caps_[3].data();
        double *ux = crossings_[0].data(), *uy = crossings_[1].data(), *uz = crossings_[2].data(),
               *depth = crossings_[3].data();
        const bool close = cross_circles(cap, x, y, z, cosine, static_cast<int>(n), ux, uy, uz, depth);
        deepen(x, y, z, cosine, static_cast<int>(size_), static_cast<int>(2 * n), ux, uy, uz, depth);
        if (close) leave_out_own(cap, n);
        for (const std::size_t from : {std::size_t{0}, n})
            for (std::size_t i = from; i < from + size_; ++i) {
                crosses = crosses || depth[i] < kNeither;
                if (depth[i] <= kInside) corners_.push_back({ux[i], uy[i], uz[i]});
            }
    }
    if (!crosses) keep_own(cap);
    if (size_ == n)
        for (std::size_t k = 0; k < caps_.size(); ++k) {
            if (caps_[k].size() < n + kAtOnce) caps_[k].resize(n + kAtOnce);
            for (std::size_t i = n; i < n + kAtOnce; ++i) caps_[k][i] = k == 3 ? kNowhere : 0.0;
        }
    for (int k = 0; k < 3; ++k) caps_[k][size_] = cap.axis[k];
    caps_[3][size_] = cap.cosine;
    ++size_;
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
