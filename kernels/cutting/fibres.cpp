#include "kernels/cutting/fibres.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/cutting/fibre_rows.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kBlock = kLinesTogether;  // lines that share one pass over their facets
constexpr double kMergeGap = 1e-6;              // mm; gaps this small are rounding between neighbouring elements

// A segment met by lines in direction U at height zc.
template <int U, int V>
CapsuleTerms capsule(const Vec3d& a, const Vec3d& b, double radius, double zc, double nz = -2) {
    return {a[U], a[V], zc - a[2], b[U], b[V], zc - b[2], radius, nz};
}

template <int U, int V>
PrismTerms prism(const SolidFacet& f, double radius, double zc) {
    const Vec3d& n = f.normal;
    PrismTerms t{n[U], n[V], n[2], n[2] * (zc - f.p[0][2]) - n[U] * f.p[0][U] - n[V] * f.p[0][V], radius, {}, {}, {}};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const Vec3d e{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const Vec3d m{n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2], n[0] * e[1] - n[1] * e[0]};  // inward
        t.edge_u[k] = m[U];
        t.edge_v[k] = m[V];
        t.edge_c[k] = m[2] * (zc - a[2]) - m[U] * a[U] - m[V] * a[V];
    }
    return t;
}

// The part of a facet above z, seen from above, as a convex polygon at height z.
int part_above(const SolidFacet& f, double z, std::array<Vec3d, 4>& out) {
    int n = 0;
    for (int k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const bool a_in = a[2] > z, b_in = b[2] > z;
        if (a_in) out[n++] = {a[0], a[1], z};
        if (a_in != b_in) {
            const Vec3d &low = a_in ? b : a, &high = a_in ? a : b;
            const double t = (z - low[2]) / (high[2] - low[2]);
            out[n++] = {low[0] + t * (high[0] - low[0]), low[1] + t * (high[1] - low[1]), z};
        }
    }
    return n;
}

// The segment in which the plane just above z cuts a facet.
bool cut_segment(const SolidFacet& f, double z, std::array<Vec3d, 2>& out) {
    int n = 0;
    for (int k = 0; k < 3 && n < 2; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const bool a_in = a[2] > z, b_in = b[2] > z;
        if (a_in == b_in) continue;
        const Vec3d &low = a_in ? b : a, &high = a_in ? a : b;
        const double t = (z - low[2]) / (high[2] - low[2]);
        out[n++] = {low[0] + t * (high[0] - low[0]), low[1] + t * (high[1] - low[1]), z};
    }
    return n == 2;
}

struct Crossing {
    double u;
    int turn;
};

template <int U, int V>
Fibres fibres_along(Context& context, const LayerSolid& solid, const Loops& inside, const Cutter& cutter, double tip_z,
                    std::span<const std::int32_t> lines) {
    const bool ball = cutter.profile == Cutter::Profile::ball;
    const double r = cutter.radius, zc = ball ? tip_z + r : tip_z;  // the ball's centre, or the disc
    Fibres result;
    if (lines.empty()) return result;
    const std::size_t blocks = (lines.size() + kBlock - 1) / kBlock;

    // Which facets can matter, by block of lines.
    auto first_line = [&](double v) {
        return static_cast<std::size_t>(
            std::lower_bound(lines.begin(), lines.end(), v * kUnitsPerMm, [](std::int32_t l, double x) { return l < x; }) - lines.begin());
    };
    auto range = [&](const SolidFacet& f) {
        const double low = std::min({f.p[0][V], f.p[1][V], f.p[2][V]}) - r, high = std::max({f.p[0][V], f.p[1][V], f.p[2][V]}) + r;
        return std::pair{first_line(low), first_line(high)};
    };
    auto active = [&](const SolidFacet& f) {
        if (ball && f.z_max > zc - r && f.z_min <= zc) return true;     // within the ball's lower half
        return f.z_max > zc && (f.nz < 0 || (!ball && f.z_min <= zc));  // cut by the disc's plane, or overhanging
    };
    std::vector<std::uint32_t> counts(blocks + 1, 0), members;
    for (int pass = 0; pass < 2; ++pass) {
        if (pass == 1) {
            std::uint32_t sum = 0;
            for (std::uint32_t& c : counts) sum += std::exchange(c, sum);
            members.resize(sum);
        }
        for (std::size_t i = 0; i < solid.facets.size(); ++i) {
            const SolidFacet& f = solid.facets[i];
            if (!active(f)) continue;
            const auto [first, last] = range(f);
            if (first >= last) continue;
            for (std::size_t b = first / kBlock; b <= (last - 1) / kBlock; ++b) {
                if (pass == 1) members[counts[b]] = static_cast<std::uint32_t>(i);
                ++counts[b];
            }
        }
        if (pass == 1) {  // counts[b] is now the end of block b
            for (std::size_t b = blocks; b > 0; --b) counts[b] = counts[b - 1];
            counts[0] = 0;
        }
    }

    // The inside: which segments cross the lines of a block.
    struct Segment {
        Point2 a, b;
    };
    std::vector<std::vector<Segment>> segments(blocks);
    auto coordinate = [](Point2 p, int axis) { return axis == 0 ? p.x : p.y; };
    for (std::size_t l = 0; l < inside.size(); ++l) {
        const auto loop = inside.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 a = loop[i], b = loop[i + 1 == loop.size() ? 0 : i + 1];
            const std::int32_t va = coordinate(a, V), vb = coordinate(b, V);
            if (va == vb) continue;
            const std::size_t first = static_cast<std::size_t>(std::lower_bound(lines.begin(), lines.end(), std::min(va, vb)) - lines.begin());
            const std::size_t last = static_cast<std::size_t>(std::lower_bound(lines.begin(), lines.end(), std::max(va, vb)) - lines.begin());
            if (first >= last) continue;
            for (std::size_t k = first / kBlock; k <= (last - 1) / kBlock; ++k) segments[k].push_back({a, b});
        }
    }

    std::vector<Fibres> parts(blocks);
    parallel_each(context, blocks, [&](std::size_t block) {
        const std::size_t begin = block * kBlock, end = std::min(lines.size(), begin + kBlock);
        std::array<std::vector<Forbidden>, kBlock> found;
        HullRows hulls;
        std::array<double, kBlock> at{};
        for (std::size_t l = begin; l < end; ++l) at[l - begin] = to_mm(lines[l]);
        for (std::uint32_t m = counts[block]; m < counts[block + 1]; ++m) {
            const SolidFacet& f = solid.facets[members[m]];
            const auto crossed = range(f);
            const std::size_t first = std::max(crossed.first, begin), last = std::min(crossed.second, end), skip = first - begin;
            const int n = static_cast<int>(last - first);
            double *const low = hulls.low.data() + skip, *const high = hulls.high.data() + skip;
            double *const nz_low = hulls.nz_low.data() + skip, *const nz_high = hulls.nz_high.data() + skip;
            std::fill(low, low + n, kInfinity);
            std::fill(high, high + n, -kInfinity);
            auto meet_prism = [&](const PrismTerms& p) { prism_rows(p, at.data() + skip, n, low, high, nz_low, nz_high); };
            auto meet_capsule = [&](const CapsuleTerms& c) { capsule_rows(c, at.data() + skip, n, low, high, nz_low, nz_high); };
            if (ball && f.z_max > zc - r && f.z_min <= zc) {
                if (f.normal != Vec3d{0, 0, 0}) meet_prism(prism<U, V>(f, r, zc));
                for (int k = 0; k < 3; ++k)
                    if (f.edges >> k & 1) meet_capsule(capsule<U, V>(f.p[k], f.p[(k + 1) % 3], r, zc));
            }
            if (f.z_max > zc) {
                if (f.nz < 0) {
                    std::array<Vec3d, 4> polygon;
                    const int corners = part_above(f, zc, polygon);
                    for (int k = 0; k < corners; ++k) meet_capsule(capsule<U, V>(polygon[k], polygon[(k + 1) % corners], r, zc, f.nz));
                } else if (!ball) {
                    std::array<Vec3d, 2> cut;
                    if (cut_segment(f, zc, cut)) meet_capsule(capsule<U, V>(cut[0], cut[1], r, zc, f.nz));
                }
            }
            for (std::size_t l = first; l < last; ++l) {
                const struct {
                    double low, high;
                    float nz_low, nz_high;
                } h{hulls.low[l - begin], hulls.high[l - begin], static_cast<float>(hulls.nz_low[l - begin]),
                    static_cast<float>(hulls.nz_high[l - begin])};
                if (!(h.low < h.high)) continue;
                // Neighbouring facets mostly follow one another, so most intervals only stretch the one before.
                std::vector<Forbidden>& on_line = found[l - begin];
                if (!on_line.empty() && h.low <= on_line.back().high && h.high >= on_line.back().low) {
                    Forbidden& before = on_line.back();
                    if (h.low < before.low) {
                        before.low = h.low;
                        before.nz_low = h.nz_low;
                    }
                    if (h.high > before.high) {
                        before.high = h.high;
                        before.nz_high = h.nz_high;
                    }
                } else on_line.push_back({h.low, h.high, h.nz_low, h.nz_high});
            }
        }
        Fibres& part = parts[block];
        std::vector<Crossing> crossings;
        for (std::size_t l = begin; l < end; ++l) {
            std::vector<Forbidden>& on_line = found[l - begin];
            crossings.clear();
            for (const Segment& s : segments[block]) {
                const std::int64_t va = coordinate(s.a, V), vb = coordinate(s.b, V), v = lines[l];
                if ((va <= v) == (vb <= v)) continue;
                const double t = static_cast<double>(v - va) / static_cast<double>(vb - va);
                const double u = (coordinate(s.a, U) + t * (static_cast<double>(coordinate(s.b, U)) - coordinate(s.a, U))) / kUnitsPerMm;
                // Solid lies left of a segment, so along +x a falling one enters; along +y the handedness is mirrored.
                crossings.push_back({u, ((va > vb) == (U == 0)) ? 1 : -1});
            }
            std::sort(crossings.begin(), crossings.end(),
                      [](const Crossing& a, const Crossing& b) { return a.u != b.u ? a.u < b.u : a.turn > b.turn; });
            int depth = 0;
            double entered = 0;
            for (const Crossing& c : crossings) {
                if (depth <= 0 && depth + c.turn > 0) entered = c.u;
                if (depth > 0 && depth + c.turn <= 0 && c.u > entered) on_line.push_back({entered, c.u, 0, 0});
                depth += c.turn;
            }
            std::sort(on_line.begin(), on_line.end(),
                      [](const Forbidden& a, const Forbidden& b) { return a.low != b.low ? a.low < b.low : a.high < b.high; });
            for (const Forbidden& f : on_line) {
                if (part.intervals.size() > part.starts.back() && f.low <= part.intervals.back().high + kMergeGap) {
                    Forbidden& last = part.intervals.back();
                    if (f.high > last.high) {
                        last.high = f.high;
                        last.nz_high = f.nz_high;
                    }
                } else part.intervals.push_back(f);
            }
            part.starts.push_back(static_cast<std::uint32_t>(part.intervals.size()));
        }
    });
    std::size_t total = 0;
    for (const Fibres& part : parts) total += part.intervals.size();
    result.intervals.reserve(total);
    result.starts.reserve(lines.size() + 1);
    for (const Fibres& part : parts) {
        const std::uint32_t base = static_cast<std::uint32_t>(result.intervals.size());
        for (std::size_t i = 1; i < part.starts.size(); ++i) result.starts.push_back(base + part.starts[i]);
        result.intervals.insert(result.intervals.end(), part.intervals.begin(), part.intervals.end());
    }
    return result;
}

}  // namespace

Plane inside_plane(const LayerSolid& solid, const Cutter& cutter, double tip_z) {
    const double z = cutter.profile == Cutter::Profile::ball ? tip_z + cutter.radius : tip_z;
    // Above the solid's upper end only a ball's cap still matters: over the end's inside it is forbidden as long as it dips below.
    const double end = solid.z_top - kTopSheet;
    if (z < end) return {z, Side::above};
    return {end, Side::below};
}

Fibres fibres(Context& context, const LayerSolid& solid, const Loops& inside, const Cutter& cutter, double tip_z, Axis axis,
              std::span<const std::int32_t> lines) {
    const Loops none;
    const Loops& region = tip_z < solid.z_top - kTopSheet ? inside : none;  // a tip above the upper end stands clear of everything
    return axis == Axis::x ? fibres_along<0, 1>(context, solid, region, cutter, tip_z, lines)
                           : fibres_along<1, 0>(context, solid, region, cutter, tip_z, lines);
}

Fibres covering(Context& context, std::span<const SolidFacet> facets, double radius, Axis axis, std::span<const std::int32_t> lines) {
    // A facet that overhangs a flat cutter's tip forbids exactly the places from which the disc reaches it.
    LayerSolid overhang;
    double low = kInfinity;
    overhang.z_top = -kInfinity;
    for (const SolidFacet& f : facets) {
        low = std::min(low, f.z_min);
        overhang.z_top = std::max(overhang.z_top, f.z_max);
        overhang.facets.push_back(f);
        overhang.facets.back().nz = -1;
    }
    if (facets.empty()) low = overhang.z_top = 0;
    return fibres(context, overhang, {}, {Cutter::Profile::flat, radius}, low - 1, axis, lines);
}

std::vector<Stretch> free_stretches(std::span<const Forbidden> forbidden, double low, double high, double shortest) {
    std::vector<Stretch> free;
    double from = low;
    auto close = [&](double to) {
        if (to - from >= shortest) free.push_back({from, to});
    };
    for (const Forbidden& f : forbidden) {
        if (f.high <= from) continue;
        if (f.low >= high) break;
        close(std::min(f.low, high));
        from = std::max(from, f.high);
    }
    close(high);
    return free;
}

}  // namespace slabwright
