#include "kernels/access/near_facets.h"

#include <cmath>

#include "kernels/wide.h"

namespace slabwright {

namespace {

struct Rows {
    const double *nx, *ny, *nz, *offset, *needs, *x, *y, *far2, *highest;
};
/// A way in plan: it starts at (x, y), runs along (ux, uy).
struct Course {
    double x, y, ux, uy, length;
};

}  // namespace

// No branch differs from facet to facet, so that a compiler can do several in one step. A facet is near if it is so by all three tests.
SLABWRIGHT_WIDE static void near_rows(const Rows& r, const NearWay& way, const Course& c, int n, unsigned char* __restrict keep) {
    const double ax = way.a[0], ay = way.a[1], az = way.a[2], bx = way.b[0], by = way.b[1], bz = way.b[2];
    for (int i = 0; i < n; ++i) {
        const double nx = r.nx[i], ny = r.ny[i], nz = r.nz[i], offset = r.offset[i];
        const double begin = nx * ax + ny * ay + nz * az + offset, end = nx * bx + ny * by + nz * bz + offset, above = begin < end ? begin : end;
        const double px = r.x[i] - c.x, py = r.y[i] - c.y;
        double along = px * c.ux + py * c.uy;
        along = along < 0 ? 0 : along;
        along = along > c.length ? c.length : along;
        const double ex = px - along * c.ux, ey = py - along * c.uy;
        keep[i] = (above < r.needs[i]) & (ex * ex + ey * ey < r.far2[i]) & (r.highest[i] > way.above);
    }
}

SLABWRIGHT_WIDE static void around_rows(const float* x0, const float* x1, const float* y0, const float* y1, double x, double y, int n,
                                        unsigned char* __restrict keep) {
    for (int i = 0; i < n; ++i) keep[i] = (x0[i] <= x) & (x <= x1[i]) & (y0[i] <= y) & (y <= y1[i]);
}

void NearFacets::clear() {
    for (auto& row : rows_) row.clear();
}

void NearFacets::add(const NearFacet& f) {
    const std::array<double, 9> values{f.nx, f.ny, f.nz, f.offset, f.needs, f.x, f.y, f.far2, f.highest};
    for (std::size_t k = 0; k < values.size(); ++k) rows_[k].push_back(values[k]);
}

void NearFacets::near(const NearWay& way, std::vector<unsigned char>& keep) const {
    const std::size_t n = rows_[0].size();
    keep.assign((n + 7) / 8 * 8, 0);
    const double dx = way.b[0] - way.a[0], dy = way.b[1] - way.a[1], length = std::sqrt(dx * dx + dy * dy);
    const Course course{way.a[0], way.a[1], length > 0 ? dx / length : 1, length > 0 ? dy / length : 0, length};
    near_rows({rows_[0].data(), rows_[1].data(), rows_[2].data(), rows_[3].data(), rows_[4].data(), rows_[5].data(), rows_[6].data(), rows_[7].data(),
               rows_[8].data()},
              way, course, static_cast<int>(n), keep.data());
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
