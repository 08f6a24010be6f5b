#include "kernels/access/near_facets.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/wide.h"

namespace slabwright {

namespace {

struct Rows {
    const float *nx, *ny, *nz, *offset;  // signed distance from the facet's plane
    const float* needs;                  // a place so far above the plane, or farther, does not meet the facet
    const float *x0, *y0, *z0, *x1, *y1, *z1, *x2, *y2, *z2, *highest;
    const float* wrong;  // what distances from the facet may be wrong by
};
struct Way {
    float ax, ay, az, dx, dy, dz;
    float per_length2;  // of the way in plan; 0 where it has none
    float end;          // of it: 1, or 0 where it has none
    float upwards;      // 1 where heights count as distance, 0 where they do not
    float reach, above, slack;
};

constexpr float third = 1.0F / 3;

}  // namespace

// No branch differs from facet to facet, so that a compiler can do several in one step. Two planes are tried between facet and way: the facet's own,
// and one across the line from the facet's middle to where the way comes nearest to it. What is above such a plane stays so upwards.
SLABWRIGHT_WIDE static void near_rows(const Rows& r, const Way& w, int n, unsigned char* __restrict keep) {
    for (int i = 0; i < n; ++i) {
        const float nx = r.nx[i], ny = r.ny[i], nz = r.nz[i];
        const float begin = nx * w.ax + ny * w.ay + nz * w.az + r.offset[i], end = begin + (nx * w.dx + ny * w.dy + nz * w.dz);
        const float above = begin < end ? begin : end;
        const float x0 = r.x0[i] - w.ax, y0 = r.y0[i] - w.ay, z0 = r.z0[i] - w.az;
        const float x1 = r.x1[i] - w.ax, y1 = r.y1[i] - w.ay, z1 = r.z1[i] - w.az;
        const float x2 = r.x2[i] - w.ax, y2 = r.y2[i] - w.ay, z2 = r.z2[i] - w.az;
        const float mx = (x0 + x1 + x2) * third, my = (y0 + y1 + y2) * third, mz = (z0 + z1 + z2) * third;
        float t = (mx * w.dx + my * w.dy) * w.per_length2;
        t = t < 0.0F ? 0.0F : t;
        t = t > w.end ? w.end : t;
        const float ux = t * w.dx - mx, uy = t * w.dy - my;
        float uz = (t * w.dz - mz) * w.upwards;
        uz = (uz + std::abs(uz)) / 2;  // 0 where negative
        const float d0 = ux * x0 + uy * y0 + uz * z0, d1 = ux * x1 + uy * y1 + uz * z1, d2 = ux * x2 + uy * y2 + uz * z2;
        float most = d0 > d1 ? d0 : d1;
        most = most > d2 ? most : d2;
        const float forward = ux * w.dx + uy * w.dy + uz * w.dz, first = -most, last = forward - most, reach = w.reach + w.slack + r.wrong[i];
        const float gap = first < last ? first : last;
        keep[i] =
            (above - w.slack < r.needs[i]) & ((gap <= 0.0F) | (gap * gap < reach * reach * (ux * ux + uy * uy + uz * uz))) & (r.highest[i] > w.above);
    }
}

SLABWRIGHT_WIDE static void around_rows(const float* x0, const float* x1, const float* y0, const float* y1, double x, double y, int n,
                                        unsigned char* __restrict keep) {
    for (int i = 0; i < n; ++i) keep[i] = (x0[i] <= x) & (x <= x1[i]) & (y0[i] <= y) & (y <= y1[i]);
}

void NearFacets::place(const std::array<double, 3>& low, const std::array<double, 3>& high, double reach, bool ball) {
    for (std::size_t k = 0; k < 3; ++k) middle_[k] = (low[k] + high[k]) / 2, half_[k] = (high[k] - low[k]) / 2;
    reach_ = reach;
    ball_ = ball;
    size_ = 0;
}

bool NearFacets::add(const std::array<std::array<double, 3>, 3>& corners, double up) {
    std::array<std::array<double, 3>, 3> v = corners;
    double far = 0;
    for (auto& p : v)
        for (std::size_t k = 0; k < 3; ++k) p[k] -= middle_[k], far = std::max(far, std::abs(p[k]));
    std::array<double, 3> e{}, g{};
    for (std::size_t k = 0; k < 3; ++k) e[k] = v[1][k] - v[0][k], g[k] = v[2][k] - v[0][k];
    std::array<double, 3> n{e[1] * g[2] - e[2] * g[1], e[2] * g[0] - e[0] * g[2], e[0] * g[1] - e[1] * g[0]};
    const double area = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), wrong = 1.5e-6 * (far + half_[0] + half_[1] + half_[2] + reach_ + up);
    double offset = 0, needs = std::numeric_limits<double>::infinity();
    if (area > 1e-9) {
        for (double& c : n) c *= (n[2] < 0 ? -1 : 1) / area;
        offset = -(n[0] * v[0][0] + n[1] * v[0][1] + n[2] * v[0][2]);
        needs = ball_ ? reach_ : reach_ * std::sqrt(n[0] * n[0] + n[1] * n[1]);
        if (offset + n[2] * up - std::abs(n[0]) * half_[0] - std::abs(n[1]) * half_[1] - std::abs(n[2]) * half_[2] >= needs) return false;
        needs += wrong;
    } else {
        n = {0, 0, 0};
    }
    make_room(size_ + 1);
    const float highest = static_cast<float>(std::max({v[0][2], v[1][2], v[2][2]}));
    const std::array<double, kRows - 1> values{n[0],    n[1],    n[2],    offset,  needs,   v[0][0], v[0][1], v[0][2],
                                               v[1][0], v[1][1], v[1][2], v[2][0], v[2][1], v[2][2], wrong};
    std::size_t row = 0;
    for (const double value : values) rows_[row++][size_] = static_cast<float>(value);
    rows_[row][size_] = std::nextafter(highest, std::numeric_limits<float>::infinity());
    ++size_;
    return true;
}

void NearFacets::make_room(std::size_t size) {
    if (size > rows_[0].size())
        for (auto& row : rows_) row.resize(std::max<std::size_t>(256, 2 * size));
}

void NearFacets::take(const NearFacets& others, const std::vector<unsigned char>& keep) {
    middle_ = others.middle_, half_ = others.half_, reach_ = others.reach_, ball_ = others.ball_;
    std::size_t count = 0;
    for_each_kept(keep, [&](std::size_t) { ++count; });
    make_room(count);
    size_ = 0;
    for_each_kept(keep, [&](std::size_t i) {
        for (std::size_t k = 0; k < kRows; ++k) rows_[k][size_] = others.rows_[k][i];
        ++size_;
    });
}

void NearFacets::near(const NearWay& way, std::vector<unsigned char>& keep) const {
    keep.assign((size_ + 7) / 8 * 8, 0);
    auto single = [&](double v, std::size_t k) { return static_cast<float>(v - middle_[k]); };
    const double dx = way.b[0] - way.a[0], dy = way.b[1] - way.a[1], length2 = dx * dx + dy * dy;
    const Way w{single(way.a[0], 0),
                single(way.a[1], 1),
                single(way.a[2], 2),
                static_cast<float>(dx),
                static_cast<float>(dy),
                static_cast<float>(way.b[2] - way.a[2]),
                length2 > 1e-12 ? static_cast<float>(1 / length2) : 0.0F,
                length2 > 1e-12 ? 1.0F : 0.0F,
                ball_ ? 1.0F : 0.0F,
                static_cast<float>(way.reach),
                std::nextafter(single(way.above, 2), -std::numeric_limits<float>::infinity()),
                static_cast<float>(way.slack)};
    auto row = [&](std::size_t k) { return rows_[k].data(); };
    near_rows({row(0), row(1), row(2), row(3), row(4), row(5), row(6), row(7), row(8), row(9), row(10), row(11), row(12), row(13), row(15), row(14)},
              w, static_cast<int>(size_), keep.data());
}

void NearBoxes::clear() {
    for (auto& row : rows_) row.clear();
}

void NearBoxes::add(const NearBox& box) {
    for (std::size_t k = 0; k < box.size(); ++k) rows_[k].push_back(box[k]);
}

void NearBoxes::around(double x, double y, std::vector<unsigned char>& keep) const {
    const std::size_t n = rows_[0].size();
    keep.assign((n + 7) / 8 * 8, 0);
    around_rows(rows_[0].data(), rows_[1].data(), rows_[2].data(), rows_[3].data(), x, y, static_cast<int>(n), keep.data());
}

}  // namespace slabwright
