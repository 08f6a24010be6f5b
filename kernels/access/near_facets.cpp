#include "kernels/access/near_facets.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

struct Rows {
    /// @param row gives the k-th
    template <class Row>
    explicit Rows(const Row& row)
        : nx(row(0)),
          ny(row(1)),
          nz(row(2)),
          offset(row(3)),
          needs(row(4)),
          x0(row(5)),
          y0(row(6)),
          z0(row(7)),
          x1(row(8)),
          y1(row(9)),
          z1(row(10)),
          x2(row(11)),
          y2(row(12)),
          z2(row(13)),
          highest(row(15)),
          wrong(row(14)) {}
    const float *nx, *ny, *nz, *offset;  // signed distance from the facet's plane
    const float* needs;  // a place so far above the plane, or farther, does not meet the facet
    const float *x0, *y0, *z0, *x1, *y1, *z1, *x2, *y2, *z2, *highest;
    const float* wrong;  // what distances from the facet may be wrong by
};
struct Way {
    float ax, ay, az, dx, dy, dz;
    float per_length2;  // of the way in plan; 0 where it has none
    float end;          // of it: 1, or 0 where it has none
    float upwards;      // 1 where heights count as distance, 0 where they do not
    float reach, above, slack;
    float nearer;  // than the farthest reach that there may be, so far this one is
};

/// The rows as pointers: compilers make no vectors of what is read from arrays within a structure.
struct Corners {
    explicit Corners(const FacetRows& f)
        : x0(f.x0.data()),
          y0(f.y0.data()),
          z0(f.z0.data()),
          x1(f.x1.data()),
          y1(f.y1.data()),
          z1(f.z1.data()),
          x2(f.x2.data()),
          y2(f.y2.data()),
          z2(f.z2.data()) {}
    const float *x0, *y0, *z0, *x1, *y1, *z1, *x2, *y2, *z2;
};

/// For ways in a box around the middle that facets are measured from.
struct Box {
    double mx, my, mz, hx, hy, hz;  // its middle and half its extent
    double top, lowest;             // of the facets and of the ways, above the middle
    double upwards,
        up;  // 1 where heights count as distance, 0 where they do not; mm that the ways are above the box
    double round,
        flat;       // what is so far away is out of reach, and what is so far horizontally: one of them is 0
    double reach2;  // square of the other
    double under;   // what is so far under the ways is out of reach
    double wrong;   // what distances may be wrong by beside what the facet's own place makes
};

constexpr double kHair = 1e-9;  // mm: rounding of a bound
constexpr float third = 1.0F / 3, tiny = 1e-30F;

// The same as std::min and std::max, but for lists of three no loop.
template <class Number>
Number min3(Number a, Number b, Number c) {
    const Number d = a < b ? a : b;
    return d < c ? d : c;
}
template <class Number>
Number max3(Number a, Number b, Number c) {
    const Number d = a > b ? a : b;
    return d > c ? d : c;
}

}  // namespace

// No branch differs from facet to facet, so that a compiler can do several in one step. Two planes are tried
// between facet and way: the facet's own, and one across the line from the facet's middle to where the way
// comes nearest to it. What is above such a plane stays so upwards.
SLABWRIGHT_WIDE static void near_rows(const Rows& r, const Way& w, int n, unsigned char* __restrict keep) {
    for (int i = 0; i < n; ++i) {
        const float nx = r.nx[i], ny = r.ny[i], nz = r.nz[i];
        const float begin = nx * w.ax + ny * w.ay + nz * w.az + r.offset[i],
                    end = begin + (nx * w.dx + ny * w.dy + nz * w.dz);
        const float above = (begin < end ? begin : end) + w.nearer;
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
        const float d0 = ux * x0 + uy * y0 + uz * z0, d1 = ux * x1 + uy * y1 + uz * z1,
                    d2 = ux * x2 + uy * y2 + uz * z2;
        float most = d0 > d1 ? d0 : d1;
        most = most > d2 ? most : d2;
        const float forward = ux * w.dx + uy * w.dy + uz * w.dz, first = -most, last = forward - most,
                    reach = w.reach + w.slack + r.wrong[i];
        const float gap = first < last ? first : last;
        keep[i] &= (above - w.slack < r.needs[i]) &
                   ((gap <= 0.0F) | (gap * gap < reach * reach * (ux * ux + uy * uy + uz * uz))) &
                   (r.highest[i] > w.above);
    }
}

// The same with a plane across the line from the way to the nearest point of the facet's edges, which parts
// the two wherever anything but the facet's own plane does. Of the way the place nearest to the facet's
// middle is taken, and then the one nearest to what was the nearest point for that. Where such a point is
// higher, what counts is what is above the way at its height, and the line is level.
SLABWRIGHT_WIDE static void chosen_near(const Corners& r, const float* wrong, const Way& w, int n,
                                        unsigned char* __restrict keep) {
    for (int i = 0; i < n; ++i) {
        const float x0 = r.x0[i] - w.ax, y0 = r.y0[i] - w.ay, z0 = (r.z0[i] - w.az) * w.upwards;
        const float x1 = r.x1[i] - w.ax, y1 = r.y1[i] - w.ay, z1 = (r.z1[i] - w.az) * w.upwards;
        const float x2 = r.x2[i] - w.ax, y2 = r.y2[i] - w.ay, z2 = (r.z2[i] - w.az) * w.upwards;
        const float ax = x1 - x0, ay = y1 - y0, az = z1 - z0, bx = x2 - x1, by = y2 - y1, bz = z2 - z1,
                    cx = x0 - x2, cy = y0 - y2, cz = z0 - z2;
        const float per_a = 1 / (ax * ax + ay * ay + az * az + tiny),
                    per_b = 1 / (bx * bx + by * by + bz * bz + tiny),
                    per_c = 1 / (cx * cx + cy * cy + cz * cz + tiny);
        float lowest = z0 < z1 ? z0 : z1;
        lowest = lowest < z2 ? lowest : z2;
        float t = ((x0 + x1 + x2) * w.dx + (y0 + y1 + y2) * w.dy) * (third * w.per_length2);
        t = t < 0.0F ? 0.0F : t;
        t = t > w.end ? w.end : t;
        float px = t * w.dx, py = t * w.dy, low = t * w.dz * w.upwards, pz = low > lowest ? low : lowest;
        // From each corner to the place, how far along the edge that begins there its nearest point lies, and
        // the square of what is left across.
        const float fx = px - x0, fy = py - y0, fz = pz - z0, gx = px - x1, gy = py - y1, gz = pz - z1,
                    hx = px - x2, hy = py - y2, hz = pz - z2;
        float s0 = (fx * ax + fy * ay + fz * az) * per_a, s1 = (gx * bx + gy * by + gz * bz) * per_b,
              s2 = (hx * cx + hy * cy + hz * cz) * per_c;
        s0 = s0 < 0.0F ? 0.0F : s0, s1 = s1 < 0.0F ? 0.0F : s1, s2 = s2 < 0.0F ? 0.0F : s2;
        s0 = s0 > 1.0F ? 1.0F : s0, s1 = s1 > 1.0F ? 1.0F : s1, s2 = s2 > 1.0F ? 1.0F : s2;
        const float ux0 = fx - s0 * ax, uy0 = fy - s0 * ay, uz0 = fz - s0 * az,
                    e0 = ux0 * ux0 + uy0 * uy0 + uz0 * uz0;
        const float ux1 = gx - s1 * bx, uy1 = gy - s1 * by, uz1 = gz - s1 * bz,
                    e1 = ux1 * ux1 + uy1 * uy1 + uz1 * uz1;
        const float ux2 = hx - s2 * cx, uy2 = hy - s2 * cy, uz2 = hz - s2 * cz,
                    e2 = ux2 * ux2 + uy2 * uy2 + uz2 * uz2;
        // The nearest edge: its begin, its direction and how far along it the nearest point lies.
        const float e01 = e1 < e0 ? e1 : e0;
        float kx = e1 < e0 ? x1 : x0, ky = e1 < e0 ? y1 : y0, kz = e1 < e0 ? z1 : z0, lx = e1 < e0 ? bx : ax,
              ly = e1 < e0 ? by : ay, lz = e1 < e0 ? bz : az, per = e1 < e0 ? per_b : per_a,
              s = e1 < e0 ? s1 : s0;
        kx = e2 < e01 ? x2 : kx, ky = e2 < e01 ? y2 : ky, kz = e2 < e01 ? z2 : kz, lx = e2 < e01 ? cx : lx,
        ly = e2 < e01 ? cy : ly;
        lz = e2 < e01 ? cz : lz, per = e2 < e01 ? per_c : per, s = e2 < e01 ? s2 : s;
        const float qx = kx + s * lx, qy = ky + s * ly, qz = kz + s * lz;
        t = (qx * w.dx + qy * w.dy) * w.per_length2;
        t = t < 0.0F ? 0.0F : t;
        t = t > w.end ? w.end : t;
        px = t * w.dx, py = t * w.dy, low = t * w.dz * w.upwards, pz = low > qz ? low : qz;
        s = ((px - kx) * lx + (py - ky) * ly + (pz - kz) * lz) * per;
        s = s < 0.0F ? 0.0F : s;
        s = s > 1.0F ? 1.0F : s;
        const float ux = px - kx - s * lx, uy = py - ky - s * ly, away = pz - kz - s * lz,
                    uz = pz > low ? 0.0F : (away + std::abs(away)) / 2;
        const float d0 = ux * x0 + uy * y0 + uz * z0, d1 = ux * x1 + uy * y1 + uz * z1,
                    d2 = ux * x2 + uy * y2 + uz * z2;
        float most = d0 > d1 ? d0 : d1;
        most = most > d2 ? most : d2;
        const float forward = ux * w.dx + uy * w.dy + uz * w.dz, begins = -most, ends = forward - most,
                    reach = w.reach + w.slack + wrong[i];
        const float gap = begins < ends ? begins : ends;
        keep[i] = static_cast<unsigned char>((gap <= 0.0F) |
                                             (gap * gap < reach * reach * (ux * ux + uy * uy + uz * uz)));
    }
}

// Which facets a way within the box may meet, by their boxes and planes, and the rows of all: each row is
// FacetRows::kMost long.
SLABWRIGHT_WIDE static void box_rows(const Corners& r, const Box& box, int n, float* __restrict to,
                                     unsigned char* __restrict keep) {
    const Box b = box;
    constexpr int most = FacetRows::kMost;
    for (int i = 0; i < n; ++i) {
        const double x0 = r.x0[i] - b.mx, y0 = r.y0[i] - b.my, z0 = r.z0[i] - b.mz;
        const double x1 = r.x1[i] - b.mx, y1 = r.y1[i] - b.my, z1 = r.z1[i] - b.mz;
        const double x2 = r.x2[i] - b.mx, y2 = r.y2[i] - b.my, z2 = r.z2[i] - b.mz;
        const double left = min3(x0, x1, x2), right = max3(x0, x1, x2), front = min3(y0, y1, y2),
                     back = max3(y0, y1, y2);
        const double lowest = min3(z0, z1, z2), highest = max3(z0, z1, z2);
        // Horizontally from the box of the ways to the facet's, and upwards to the ways.
        const double dx = max3(0.0, left - b.hx, -b.hx - right), dy = max3(0.0, front - b.hy, -b.hy - back);
        const double under = b.lowest - (highest < b.top ? highest : b.top),
                     dz = b.upwards * (under > 0 ? under : 0.0);
        // The facet's plane.
        const double ex = x1 - x0, ey = y1 - y0, ez = z1 - z0, gx = x2 - x0, gy = y2 - y0, gz = z2 - z0;
        double nx = ey * gz - ez * gy, ny = ez * gx - ex * gz, nz = ex * gy - ey * gx;
        const double area = std::sqrt(nx * nx + ny * ny + nz * nz), sign = nz < 0 ? -1.0 : 1.0,
                     scale = area > 1e-9 ? sign / (area > 1e-9 ? area : 1.0) : 0.0;
        nx *= scale, ny *= scale, nz *= scale;
        const double offset = -(nx * x0 + ny * y0 + nz * z0), across = std::sqrt(nx * nx + ny * ny);
        const double reach = scale == 0 ? 1e30 : b.round + b.flat * across;  // of none that has no plane
        const double nearest =
            offset + nz * b.up - std::abs(nx) * b.hx - std::abs(ny) * b.hy - std::abs(nz) * b.hz;
        const double far_x = -left > right ? -left : right, far_y = -front > back ? -front : back,
                     far_z = -lowest > highest ? -lowest : highest;
        const double wrong = 1.5e-6 * (max3(far_x, far_y, far_z) + b.wrong);
        keep[i] = static_cast<unsigned char>((lowest < b.top) & (dx * dx + dy * dy + dz * dz < b.reach2) &
                                             (under < b.under) & (nearest < reach));
        to[0 * most + i] = static_cast<float>(nx), to[1 * most + i] = static_cast<float>(ny),
                      to[2 * most + i] = static_cast<float>(nz);
        to[3 * most + i] = static_cast<float>(offset), to[4 * most + i] = static_cast<float>(reach + wrong);
        to[5 * most + i] = static_cast<float>(x0), to[6 * most + i] = static_cast<float>(y0),
                      to[7 * most + i] = static_cast<float>(z0);
        to[8 * most + i] = static_cast<float>(x1), to[9 * most + i] = static_cast<float>(y1),
                      to[10 * most + i] = static_cast<float>(z1);
        to[11 * most + i] = static_cast<float>(x2), to[12 * most + i] = static_cast<float>(y2),
                       to[13 * most + i] = static_cast<float>(z2);
        to[14 * most + i] = static_cast<float>(wrong);
        to[15 * most + i] = static_cast<float>(highest + 1e-6 * std::abs(highest));
    }
}

WayAround::WayAround(const NearWay& way, bool ball, double lowest_z, double top_z, double reach)
    : ax(static_cast<float>(way.a[0])),
      ay(static_cast<float>(way.a[1])),
      az(static_cast<float>(way.a[2])),
      dx(static_cast<float>(way.b[0] - way.a[0])),
      dy(static_cast<float>(way.b[1] - way.a[1])),
      dz(static_cast<float>(way.b[2] - way.a[2])),
      ux(1),
      uy(0),
      length(0),
      per_length2(0),
      end(0),
      lowest(static_cast<float>(lowest_z)),
      upwards(ball ? 1.0F : 0.0F),
      above(std::nextafter(static_cast<float>(way.above), -std::numeric_limits<float>::infinity())),
      top(std::nextafter(static_cast<float>(top_z), std::numeric_limits<float>::infinity())),
      reach2(static_cast<float>(reach * reach)) {
    const double x = way.b[0] - way.a[0], y = way.b[1] - way.a[1], length2 = x * x + y * y,
                 l = std::sqrt(length2);
    if (l > 0) ux = static_cast<float>(x / l), uy = static_cast<float>(y / l), length = static_cast<float>(l);
    if (length2 > 1e-12) per_length2 = static_cast<float>(1 / length2), end = 1;
}

// Written with vectors of eight, since compilers take such a short loop apart into smaller ones.
SLABWRIGHT_WIDE static void around_eights(const ManyEights& many, const WayAround& way,
                                          unsigned* __restrict keep) {
    const WayAround w = way;
    const Floats8 none{};
    const auto bits_of = [](const Ints8& signs) {
        const Ints8 own{1, 2, 4, 8, 16, 32, 64, 128}, bits = signs & own;
        std::array<std::uint64_t, 4> pairs;
        std::memcpy(pairs.data(), &bits, sizeof(pairs));
        const std::uint64_t all = pairs[0] | pairs[1] | pairs[2] | pairs[3];
        return static_cast<unsigned>(all | all >> 32);
    };
    const float forward_x = w.dx, forward_y = w.dy, forward_z = w.dz * w.upwards;
    for (std::size_t i = 0; i < many.count; ++i) {
        const EightFacets& f = *many.eights[i];
        Floats8 x0, y0, z0, x1, y1, z1, x2, y2, z2;
        std::memcpy(&x0, f.x0.data(), sizeof(Floats8)), std::memcpy(&y0, f.y0.data(), sizeof(Floats8)),
            std::memcpy(&z0, f.z0.data(), sizeof(Floats8));
        std::memcpy(&x1, f.x1.data(), sizeof(Floats8)), std::memcpy(&y1, f.y1.data(), sizeof(Floats8)),
            std::memcpy(&z1, f.z1.data(), sizeof(Floats8));
        std::memcpy(&x2, f.x2.data(), sizeof(Floats8)), std::memcpy(&y2, f.y2.data(), sizeof(Floats8)),
            std::memcpy(&z2, f.z2.data(), sizeof(Floats8));
        Floats8 lowest = z0 < z1 ? z0 : z1, highest = z0 > z1 ? z0 : z1;
        lowest = lowest < z2 ? lowest : z2, highest = highest > z2 ? highest : z2;
        x0 -= w.ax, y0 -= w.ay, x1 -= w.ax, y1 -= w.ay, x2 -= w.ax, y2 -= w.ay;
        const Floats8 l0 = x0 * w.ux + y0 * w.uy, l1 = x1 * w.ux + y1 * w.uy, l2 = x2 * w.ux + y2 * w.uy;
        const Floats8 c0 = y0 * w.ux - x0 * w.uy, c1 = y1 * w.ux - x1 * w.uy, c2 = y2 * w.ux - x2 * w.uy;
        Floats8 l_low = l0 < l1 ? l0 : l1, l_high = l0 > l1 ? l0 : l1, c_low = c0 < c1 ? c0 : c1,
                c_high = c0 > c1 ? c0 : c1;
        l_low = l_low < l2 ? l_low : l2, l_high = l_high > l2 ? l_high : l2, c_low = c_low < c2 ? c_low : c2,
        c_high = c_high > c2 ? c_high : c2;
        Floats8 l = l_low - w.length, c = c_low > -c_high ? c_low : -c_high,
                under = w.lowest - (highest < w.top ? highest : none + w.top);
        l = l > -l_high ? l : -l_high, l = l > none ? l : none, c = c > none ? c : none,
        under = (under > none ? under : none) * w.upwards;
        const Ints8 kept =
            (lowest < w.top) & (highest > w.above) & (l * l + c * c + under * under < w.reach2);
        if (keep[i] = bits_of(kept); keep[i] != 0) {
            z0 -= w.az, z1 -= w.az, z2 -= w.az;
            const Floats8 mx = (x0 + x1 + x2) * third, my = (y0 + y1 + y2) * third,
                          mz = (z0 + z1 + z2) * third;
            Floats8 t = (mx * w.dx + my * w.dy) * w.per_length2;
            t = t > none ? t : none, t = t < w.end ? t : none + w.end;
            const Floats8 ux = t * w.dx - mx, uy = t * w.dy - my, over = (t * w.dz - mz) * w.upwards,
                          uz = over > none ? over : none;
            const Floats8 d0 = ux * x0 + uy * y0 + uz * z0, d1 = ux * x1 + uy * y1 + uz * z1,
                          d2 = ux * x2 + uy * y2 + uz * z2;
            Floats8 most = d0 > d1 ? d0 : d1;
            most = most > d2 ? most : d2;
            const Floats8 forward = ux * forward_x + uy * forward_y + uz * forward_z,
                          gap = (forward < none ? forward : none) - most;
            keep[i] =
                bits_of(kept & ((gap <= none) | (gap * gap < w.reach2 * (ux * ux + uy * uy + uz * uz))));
        }
    }
}

void facets_around(const ManyEights& eights, const WayAround& way,
                   std::array<unsigned, ManyEights::kMost>& keep) {
    around_eights(eights, way, keep.data());
}

namespace {
float upwards_of(double v) {
    return std::nextafter(static_cast<float>(v), std::numeric_limits<float>::infinity());
}

/// A number in single precision and what is left of it. Not inline: of three in a row g++ 12 takes what is
/// left to be zero (-O2, -ftree-slp-vectorize).
struct Split {
    float near, rest;
};
[[gnu::noinline]] Split split(double v) {
    const auto near = static_cast<float>(v);
    return {near, static_cast<float>(v - near)};
}
}  // namespace

LevelWay::LevelWay(const std::array<double, 3>& a, const std::array<double, 3>& b, double top_z,
                   double within)
    : ux(1),
      uy(0),
      before(0),
      after(0),
      bow(0),
      curvature(0),
      top(upwards_of(top_z)),
      reach(upwards_of(within)) {
    const double x = (a[0] + b[0]) / 2, y = (a[1] + b[1]) / 2, dx = b[0] - a[0], dy = b[1] - a[1],
                 length = std::sqrt(dx * dx + dy * dy);
    if (length > 0)
        ux = static_cast<float>(dx / length), uy = static_cast<float>(dy / length),
        before = after = upwards_of(length / 2);
    begin_at(x, y, a[2]);
}

LevelWay::LevelWay(double x, double y, double radius, const std::array<double, 3>& about,
                   double length_before, double length_after, double aside, double top_z, double within)
    : before(upwards_of(length_before)),
      after(upwards_of(length_after)),
      bow(upwards_of(aside)),
      curvature(static_cast<float>(1 / radius)),
      top(upwards_of(top_z)),
      reach(upwards_of(within)) {
    const double px = about[0] - x, py = about[1] - y,
                 per = 1 / std::max(std::sqrt(px * px + py * py), 1e-12);
    ux = static_cast<float>(-py * per), uy = static_cast<float>(px * per);
    begin_at(x + radius * px * per, y + radius * py * per, about[2]);
}

void LevelWay::begin_at(double x, double y, double z) {
    const Split sx = split(x), sy = split(y), sz = split(z);
    ox = sx.near, oy = sy.near, oz = sz.near, rest_x = sx.rest, rest_y = sy.rest, rest_z = sz.rest;
}

// In the plane across the way an upward ray begins at the way, and each facet becomes a triangle between its
// corners. Around a circle what is between them is truly nearer to the axis, by no more than the distance
// from the axis bends over the facet. Ray and triangle are parted by a line across the way to a corner, or
// along an edge, if at all; what is below such a line stays so upwards. No branch differs from facet to
// facet.
SLABWRIGHT_WIDE static void along_eights(const ManyEights& many, const LevelWay& way,
                                         unsigned* __restrict keep) {
    const LevelWay w = way;
    const Floats8 none{}, one = none + 1.0F;
    const auto bits_of = [](const Ints8& signs) {
        const Ints8 own{1, 2, 4, 8, 16, 32, 64, 128}, bits = signs & own;
        std::array<std::uint64_t, 4> pairs;
        std::memcpy(pairs.data(), &bits, sizeof(pairs));
        const std::uint64_t all = pairs[0] | pairs[1] | pairs[2] | pairs[3];
        return static_cast<unsigned>(all | all >> 32);
    };
    // (What a function gives back as a vector depends on the instruction set.)
    const auto root = [](Floats8& v) {
        for (std::size_t k = 0; k < 8; ++k) v[k] = std::sqrt(v[k]);
    };
    const auto least_of = [](const Floats8& a, const Floats8& b, const Floats8& c, Floats8& least) {
        least = a < b ? a : b, least = least < c ? least : c;
    };
    const auto most_of = [](const Floats8& a, const Floats8& b, const Floats8& c, Floats8& most) {
        most = a > b ? a : b, most = most > c ? most : c;
    };
    const float straight = w.curvature == 0 ? 1.0F : 0.0F;
    constexpr float rounding = 2e-6F;  // of a length
    for (std::size_t i = 0; i < many.count; ++i) {
        const EightFacets& f = *many.eights[i];
        Floats8 x0, y0, z0, x1, y1, z1, x2, y2, z2;
        std::memcpy(&x0, f.x0.data(), sizeof(Floats8)), std::memcpy(&y0, f.y0.data(), sizeof(Floats8)),
            std::memcpy(&z0, f.z0.data(), sizeof(Floats8));
        std::memcpy(&x1, f.x1.data(), sizeof(Floats8)), std::memcpy(&y1, f.y1.data(), sizeof(Floats8)),
            std::memcpy(&z1, f.z1.data(), sizeof(Floats8));
        std::memcpy(&x2, f.x2.data(), sizeof(Floats8)), std::memcpy(&y2, f.y2.data(), sizeof(Floats8)),
            std::memcpy(&z2, f.z2.data(), sizeof(Floats8));
        Floats8 lowest, l_low, l_high, c_low, c_high, h_low, h_high;
        least_of(z0, z1, z2, lowest);
        x0 = x0 - w.ox - w.rest_x, y0 = y0 - w.oy - w.rest_y, z0 = z0 - w.oz - w.rest_z;
        x1 = x1 - w.ox - w.rest_x, y1 = y1 - w.oy - w.rest_y, z1 = z1 - w.oz - w.rest_z;
        x2 = x2 - w.ox - w.rest_x, y2 = y2 - w.oy - w.rest_y, z2 = z2 - w.oz - w.rest_z;
        const Floats8 l0 = x0 * w.ux + y0 * w.uy, l1 = x1 * w.ux + y1 * w.uy, l2 = x2 * w.ux + y2 * w.uy;
        const Floats8 c0 = x0 * w.uy - y0 * w.ux, c1 = x1 * w.uy - y1 * w.ux, c2 = x2 * w.uy - y2 * w.ux;
        least_of(l0, l1, l2, l_low), most_of(l0, l1, l2, l_high), least_of(c0, c1, c2, c_low),
            most_of(c0, c1, c2, c_high);
        least_of(z0, z1, z2, h_low), most_of(z0, z1, z2, h_high);
        const Floats8 far_l = l_high > -l_low ? l_high : -l_low, far_c = c_high > -c_low ? c_high : -c_low,
                      far_h = h_high > -h_low ? h_high : -h_low;
        const Floats8 far = far_l + far_c + far_h,
                      reach = w.reach + rounding * (far + w.curvature * far * far);
        Floats8 l = l_low - w.after > -l_high - w.before ? l_low - w.after : -l_high - w.before;
        l = l > none ? l : none;
        Floats8 c = c_low > -c_high - w.bow ? c_low : -c_high - w.bow,
                under = -h_high > none ? -h_high : none, reach2 = reach * reach;
        c = c > none ? c : none;
        const Ints8 within = (lowest < w.top) & (l * l + c * c + under * under < reach2);
        keep[i] = bits_of(within);
        if (keep[i] == 0) continue;
        reach2 -= straight * (l * l);
        // Distance from the circle in plan, outwards.
        Floats8 a0 = c0, a1 = c1, a2 = c2, bend = none;
        if (straight == 0) {
            const auto outwards = [&](const Floats8& along, Floats8& across) {
                const Floats8 a = w.curvature * along, b = one + w.curvature * across,
                              twice = across + across + w.curvature * (along * along + across * across);
                Floats8 from_axis = a * a + b * b;
                root(from_axis);
                across = twice / (from_axis + one);
            };
            outwards(l0, a0), outwards(l1, a1), outwards(l2, a2);
            const Floats8 e0 = (x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0),
                          e1 = (x2 - x1) * (x2 - x1) + (y2 - y1) * (y2 - y1),
                          e2 = (x0 - x2) * (x0 - x2) + (y0 - y2) * (y0 - y2), least = none + 1e-3F;
            Floats8 edge2, edge, outmost;
            most_of(e0, e1, e2, edge2), most_of(a0, a1, a2, outmost);
            edge = edge2, root(edge);
            const Floats8 inmost = one + w.curvature * (outmost - edge);
            // A second derivative of 1 / radius at most, over a circle of the longest edge / √3 that holds
            // the facet; near the axis, no more than an edge.
            bend = inmost > least ? w.curvature * edge2 / (6.0F * inmost) : edge;
        }
        Ints8 parted{};
        const auto part = [&](const Floats8& ua, const Floats8& uh) {
            Floats8 gap;
            least_of(ua * a0 + uh * z0, ua * a1 + uh * z1, ua * a2 + uh * z2, gap);
            gap -= (ua > none ? ua : none) * bend;
            parted |= (gap > none) & (gap * gap >= reach2 * (ua * ua + uh * uh));
        };
        const auto to_corner = [&](const Floats8& a, const Floats8& h) { part(a, h < none ? h : none); };
        const auto by_edge = [&](const Floats8& a, const Floats8& h) {
            part(a > none ? h : -h, a > none ? -a : a);
        };
        to_corner(a0, z0), to_corner(a1, z1), to_corner(a2, z2);
        by_edge(a1 - a0, z1 - z0), by_edge(a2 - a1, z2 - z1), by_edge(a0 - a2, z0 - z2);
        keep[i] = bits_of(within & ~parted);
    }
}

void facets_along(const ManyEights& eights, const LevelWay& way,
                  std::array<unsigned, ManyEights::kMost>& keep) {
    along_eights(eights, way, keep.data());
}

static Way way_from(const NearWay& way, const std::array<double, 3>& middle, bool ball, double reach) {
    auto single = [&](double v, std::size_t k) { return static_cast<float>(v - middle[k]); };
    const double dx = way.b[0] - way.a[0], dy = way.b[1] - way.a[1], length2 = dx * dx + dy * dy;
    return {single(way.a[0], 0),
            single(way.a[1], 1),
            single(way.a[2], 2),
            static_cast<float>(dx),
            static_cast<float>(dy),
            static_cast<float>(way.b[2] - way.a[2]),
            length2 > 1e-12 ? static_cast<float>(1 / length2) : 0.0F,
            length2 > 1e-12 ? 1.0F : 0.0F,
            ball ? 1.0F : 0.0F,
            static_cast<float>(way.reach),
            std::nextafter(single(way.above, 2), -std::numeric_limits<float>::infinity()),
            static_cast<float>(way.slack),
            ball ? static_cast<float>(reach - way.reach) : 0.0F};
}

/// Keeps of what is kept what the way may meet.
static void keep_near(const Rows& rows, const Way& w, std::size_t size, bool closely,
                      std::vector<unsigned char>& keep) {
    near_rows(rows, w, static_cast<int>(size), keep.data());
    if (!closely) return;
    FacetRows chosen;
    std::array<float, FacetRows::kMost> wrong;
    std::array<std::size_t, FacetRows::kMost> which;
    std::array<unsigned char, FacetRows::kMost> met;
    std::size_t count = 0;
    auto look = [&] {
        chosen_near(Corners(chosen), wrong.data(), w, static_cast<int>((count + 7) / 8 * 8), met.data());
        for (std::size_t k = 0; k < count; ++k) keep[which[k]] = met[k];
        count = 0;
    };
    for_each_kept(keep, [&](std::size_t i) {
        chosen.x0[count] = rows.x0[i], chosen.y0[count] = rows.y0[i], chosen.z0[count] = rows.z0[i];
        chosen.x1[count] = rows.x1[i], chosen.y1[count] = rows.y1[i], chosen.z1[count] = rows.z1[i];
        chosen.x2[count] = rows.x2[i], chosen.y2[count] = rows.y2[i], chosen.z2[count] = rows.z2[i];
        wrong[count] = rows.wrong[i];
        which[count++] = i;
        if (count == FacetRows::kMost) look();
    });
    if (count > 0) look();
}

void NearFacets::place(const std::array<double, 3>& low, const std::array<double, 3>& high, double reach,
                       bool ball, double top, double up) {
    for (std::size_t k = 0; k < 3; ++k)
        middle_[k] = (low[k] + high[k]) / 2, half_[k] = (high[k] - low[k]) / 2;
    reach_ = reach, top_ = top, up_ = up;
    ball_ = ball;
    size_ = 0;
}

void NearFacets::add(const FacetRows& facets, std::size_t count, const NearWay* way, bool closely,
                     std::vector<unsigned char>& keep) {
    keep.assign((count + 7) / 8 * 8, 0);
    std::array<std::array<float, FacetRows::kMost>, kRows> values;
    const Box box{middle_[0],
                  middle_[1],
                  middle_[2],
                  half_[0],
                  half_[1],
                  half_[2],
                  top_ - middle_[2],
                  up_ - half_[2],
                  ball_ ? 1.0 : 0.0,
                  up_,
                  ball_ ? reach_ : 0.0,
                  ball_ ? 0.0 : reach_,
                  reach_ * reach_,
                  ball_ ? 1e30 : kHair,
                  half_[0] + half_[1] + half_[2] + reach_ + up_};
    box_rows(Corners(facets), box, static_cast<int>(count), values[0].data(), keep.data());
    if (way)
        keep_near(Rows([&](std::size_t k) { return values[k].data(); }),
                  way_from(*way, middle_, ball_, reach_), count, closely, keep);
    if (size_ + count > rows_[0].size())
        for (auto& row : rows_) row.resize(std::max<std::size_t>(256, 2 * (size_ + count)));
    for_each_kept(keep, [&](std::size_t i) {
        for (std::size_t row = 0; row < kRows; ++row) rows_[row][size_] = values[row][i];
        ++size_;
    });
}

void NearFacets::near(const NearWay& way, bool closely, std::vector<unsigned char>& keep) const {
    keep.assign((size_ + 7) / 8 * 8, 0);
    std::fill_n(keep.begin(), size_, static_cast<unsigned char>(1));
    keep_near(Rows([&](std::size_t k) { return rows_[k].data(); }), way_from(way, middle_, ball_, reach_),
              size_, closely, keep);
}

}  // namespace slabwright
