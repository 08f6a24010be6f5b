#include "kernels/access/obstacles.h"

#include <algorithm>
#include <cmath>

#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

static_assert(Obstacles::kMost % 4 == 0);
constexpr int kRows = static_cast<int>(Obstacles::kMost);

struct Touch {
    double px, py, pz;  // the point
    double ux, uy, uz;  // the direction
    double highest;     // over the point: what is higher forbids what it forbids from there
    double far,
        far_least;  // the tool's reach grown by `around`: twice its inverse's half, and what a distance of 0
                    // needs
    double near, near_least;
};

}  // namespace

// The margins of u in the caps of points that a ball must keep clear of; below 0 outside of them.
SLABWRIGHT_WIDE static void ball_margins(const double* __restrict x, const double* __restrict y,
                                         const double* __restrict z, const Touch& t,
                                         double* __restrict margins) {
    for (int i = 0; i < kRows; ++i) {
        const double dx = x[i] - t.px, dy = y[i] - t.py, dz = z[i] - t.pz,
                     h = dz < t.highest ? dz : t.highest, d2 = dx * dx + dy * dy + h * h;
        const double far = t.far_least + d2 * t.far, near = t.near_least + d2 * t.near,
                     least = far > near ? far : near;
        margins[i] = (dx * t.ux + dy * t.uy + h * t.uz - least) / std::sqrt(d2);
    }
}

Obstacles::Obstacles(Tool tool, double radius, double tolerance)
    : tool_(tool),
      tolerance_(tolerance),
      reach_(radius + tolerance),
      clear2_((radius - tolerance / 2) * (radius - tolerance / 2)) {
    constexpr double nowhere = 1e12;
    x_.fill(nowhere);
    y_.fill(nowhere);
    z_.fill(nowhere);
}

void Obstacles::remember(const Point3& obstacle) {
    size_ = std::min(size_ + 1, kMost);
    for (std::array<double, kMost>* row : {&x_, &y_, &z_})
        std::copy_backward(row->begin(), row->end() - 1, row->end());
    x_[0] = obstacle[0];
    y_[0] = obstacle[1];
    z_[0] = obstacle[2];
}

void Obstacles::use(std::size_t i) {
    if (i == 0) return;
    for (std::array<double, kMost>* row : {&x_, &y_, &z_}) {
        const double v = (*row)[i];
        std::copy_backward(row->begin(), row->begin() + static_cast<std::ptrdiff_t>(i),
                           row->begin() + static_cast<std::ptrdiff_t>(i) + 1);
        (*row)[0] = v;
    }
}

std::size_t Obstacles::strongest(const Point3& p, const Point3& u, double around) const {
    std::size_t best = kMost;
    double most = CapCover::kInside;
    if (tool_ == Tool::ball) {
        const double far = reach_ + around, near = reach_ - around;
        std::array<double, kMost> margins;
        ball_margins(
            x_.data(), y_.data(), z_.data(),
            {p[0], p[1], p[2], u[0], u[1], u[2], reach_ * u[2], 1 / (2 * far),
             (far * far - clear2_) / (2 * far), 1 / (2 * near), (near * near - clear2_) / (2 * near)},
            margins.data());
        for (std::size_t i = 0; i < size_; ++i)
            if (margins[i] > most) most = margins[i], best = i;
        return best;
    }
    for (std::size_t i = 0; i < size_; ++i)
        if (const double margin = cap(point(i), p, u, around).margin(u); margin > most)
            most = margin, best = i;
    return best;
}

Cap Obstacles::cap(const Point3& obstacle, const Point3& p, const Point3& u, double around) const {
    const double x = obstacle[0] - p[0], y = obstacle[1] - p[1];
    if (tool_ == Tool::ball) {
        // Whatever stands forbids what is below it too; beside a ball's centre more than above.
        const double z = std::min(obstacle[2] - p[2], reach_ * u[2]), d2 = x * x + y * y + z * z,
                     d = std::sqrt(d2);
        // The square of the centre's distance from the obstacle is largest at the one or the other end.
        const double far = reach_ + around, near = reach_ - around;
        const double least =
            std::max((far * far - clear2_ + d2) / (2 * far), (near * near - clear2_ + d2) / (2 * near));
        return d > 0 ? Cap{{x / d, y / d, z / d}, least / d} : Cap{{0, 0, 1}, 1};
    }
    if (obstacle[2] <= p[2] + 1.5 * tolerance_) return {{0, 0, 1}, 1};
    const double a = x / reach_, b = y / reach_, k = a * a + b * b - clear2_ / (reach_ * reach_);
    const double length = std::sqrt(4 * (a * a + b * b) + (1 - k) * (1 - k));
    return {{2 * a / length, 2 * b / length, (1 - k) / length}, (1 + k) / length};
}

}  // namespace slabwright
