#include "kernels/cutting/fibres.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "kernels/cutting/fibre_rows.h"
#include "kernels/cutting/revolved_fibres.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kBlock = kLinesTogether;  // lines that share one pass over their facets
constexpr double kFarAway = 1e30;               // mm; where lines are that fill up a block's last step
constexpr float kTouchMargin = 1e-4F;           // mm
constexpr double kTurnMargin = 1e-3;            // of a unit vector
constexpr double kMergeGap = 1e-6;  // mm; gaps this small are rounding between neighbouring elements

// A segment met by lines in direction U at height zc.
template <int U, int V>
CapsuleTerms capsule(const Vec3d& a, const Vec3d& b, double radius, double zc, double nz = -2) {
    return {a[U], a[V], zc - a[2], b[U], b[V], zc - b[2], radius, nz};
}

template <int U, int V>
PrismTerms prism(const SolidFacet& f, double radius, double zc) {
    const Vec3d& n = f.normal;
    PrismTerms t{n[U],   n[V], n[2], n[2] * (zc - f.p[0][2]) - n[U] * f.p[0][U] - n[V] * f.p[0][V],
                 radius, {},   {},   {}};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const Vec3d e{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const Vec3d m{n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2],
                      n[0] * e[1] - n[1] * e[0]};  // inward
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

// Whether a cutter at this height can touch what lies in [z_min, z_max]: the ball by its lower half, the disc
// by its plane, both by what overhangs them, up to `overhang`.
bool may_touch(double z_min, double z_max, double overhang, bool ball, double r, double zc) {
    if (ball && z_max > zc - r && z_min <= zc) return true;
    return overhang > zc || (!ball && z_max > zc && z_min <= zc);
}

// Whether all of [low, high] is forbidden on a line already; `at` remembers the interval that was looked at
// last.
bool covered(const std::vector<Stretch>& cover, std::uint32_t& at, double low, double high) {
    if (at < cover.size() && cover[at].low <= low && high <= cover[at].high) return true;
    const auto next = std::upper_bound(cover.begin(), cover.end(), low,
                                       [](double v, const Stretch& s) { return v < s.low; });
    if (next == cover.begin()) return false;
    at = static_cast<std::uint32_t>(next - cover.begin()) - 1;
    return high <= cover[at].high;
}

// What a ball forbids is kept ascending and disjoint as it is found, so that each facet is held against all
// that was met before it. Facets that meet in a corner touch a disc at one place, and whose nz stands there
// goes by the order in which intervals are joined: for a flat cutter these are sorted in the end, and what
// reaches out is told from two states of them.
template <int U, int V>
class BlockOfLines {
    struct LineRange {
        int first = 0, last = 0;
        [[nodiscard]] bool any() const { return first < last; }
    };

public:
    BlockOfLines(const LayerSolid& solid, const Cutter& cutter, std::span<const std::int32_t> lines)
        : solid_(solid),
          ball_(cutter.profile == Cutter::Profile::ball),
          r_(cutter.radius),
          n_(static_cast<int>(lines.size())) {
        at_.fill(kFarAway);
        for (int l = 0; l < n_; ++l) at_[l] = to_mm(lines[static_cast<std::size_t>(l)]);
        if (n_ > 1) per_mm_ = (n_ - 1) / (at_[n_ - 1] - at_[0]);
    }

    // Goes down to a level: what those above it forbid, which are merged(), it forbids too.
    void begin(double zc) {
        zc_ = zc;
        amid_gaps_ = false;
        // Where a section's border lies, the centre is no farther from the solid than it is over the plane.
        const double over_plane = ball_ ? std::max(0.0, zc - (solid_.z_top - kTopSheet)) : 0;
        inside_nz_ = by_touch() && over_plane < r_ - kTouchMargin ? static_cast<float>(kWithin) : 0.0F;
        cover_.low.fill(-kInfinity);
        cover_.high.fill(-kInfinity);
        cover_.next.fill(kInfinity);
        for (int l = 0; l < n_; ++l) {
            crossings_[l].clear();
            if (!found_[l].empty()) cover_.next[l] = found_[l].front().low;
        }
    }

    // Forbids the inside, given by the segments of its border that cross these lines.
    void meet_inside(std::span<const std::array<Point2, 2>> segments, std::span<const std::int32_t> lines) {
        auto coordinate = [](Point2 p, int axis) { return axis == 0 ? p.x : p.y; };
        for (const auto& [a, b] : segments) {
            const std::int32_t va = coordinate(a, V), vb = coordinate(b, V);
            const auto first = std::lower_bound(lines.begin(), lines.end(), std::min(va, vb));
            for (auto line = first; line != lines.end() && *line < std::max(va, vb); ++line) {
                const double t = static_cast<double>(std::int64_t{*line} - va) /
                                 static_cast<double>(std::int64_t{vb} - va);
                const double u =
                    (coordinate(a, U) + t * (static_cast<double>(coordinate(b, U)) - coordinate(a, U))) /
                    kUnitsPerMm;
                // Solid lies left of a segment, so along +x a falling one enters; along +y the handedness is
                // mirrored.
                crossings_[static_cast<std::size_t>(line - lines.begin())].push_back(
                    {u, ((va > vb) == (U == 0)) ? 1 : -1});
            }
        }
        for (std::size_t l = 0; l < lines.size(); ++l) {
            std::vector<Crossing>& crossings = crossings_[l];
            std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
                return a.u != b.u ? a.u < b.u : a.turn > b.turn;
            });
            int depth = 0;
            double entered = 0;
            for (const Crossing& c : crossings) {
                if (depth <= 0 && depth + c.turn > 0) entered = c.u;
                if (depth > 0 && depth + c.turn <= 0 && c.u > entered) {
                    if (ball_) forbid(static_cast<int>(l), {entered, c.u, inside_nz_, inside_nz_});
                    else found_[l].push_back({entered, c.u, inside_nz_, inside_nz_});
                }
                depth += c.turn;
            }
        }
    }

    // Most facets only forbid what others around them forbid as well, or what is forbidden already: those are
    // met that could reach past it, on the lines where they could.
    void meet(std::span<const std::uint32_t> groups) {
        if (by_touch()) {
            if (ball_) meet_touched(groups);
            else meet_touched_by_disc(groups);
            for (int l = 0; l < n_; ++l) close_within(found_[l]);
            amid_gaps_ = true;
            for (int l = 0; l < n_; ++l) look(l, found_[l].begin() + (found_[l].empty() ? 0 : 1));
            find_gaps();
        }
        if (ball_) meet_all(groups);
        else if (by_touch()) meet_amid(groups);
        else meet_disc(groups);
    }

    // Whether all ends are found where the cutter can touch the solid from outside.
    [[nodiscard]] bool by_touch() const { return !solid_.part && !solid_.corners.empty(); }

    // Calls meet(facet, group, touched, i), group by group, for those facets that can be touched, and where
    // something overhangs the cutter also for those that face down. Groups lie far apart in memory, and so do
    // their facets: several are looked at together, each step asking for what the next one reads.
    template <class Group, class CanTouch, class Touch, class Meet>
    void look_together(Group g, Group end, CanTouch&& can, Touch&& touch, Meet&& meet) {
        constexpr std::size_t ahead = 2 * kTogether;
        while (g != end) {
            std::array<std::uint32_t, kTogether> some;
            std::size_t n = 0;
            for (; g != end && n < kTogether; ++g) {
                if (end - g > static_cast<std::ptrdiff_t>(ahead)) prefetch(solid_.groups[g[ahead]]);
                const FacetGroup& group = solid_.groups[*g];
                if (!(group.overhang > zc_) && !can(group)) continue;
                some[n++] = *g;
                prefetch(solid_.corners[*g]);
            }
            std::array<std::uint32_t, kTogether> wanted{};  // a bit a facet
            for (std::size_t k = 0; k < n; ++k) {
                const FacetGroup& group = solid_.groups[some[k]];
                const GroupCorners& corners = solid_.corners[some[k]];
                touch(some[k], touched_[k]);
                const auto from = static_cast<float>(at_[0] - group.middle[V]) - kTouchMargin,
                           to = static_cast<float>(at_[n_ - 1] - group.middle[V]) + kTouchMargin;
                const auto [first, last] = facets_of(some[k]);
                for (std::size_t i = 0; i < last - first; ++i) {
                    const GroupTouched::Range& all = touched_[k].all;
                    const bool here = all.low[i] <= all.high[i] && all.low[i] <= to && all.high[i] >= from;
                    if (!here && !(group.overhang > zc_ && corners.nz[i] < 0)) continue;
                    wanted[k] |= 1U << i;
                    prefetch(solid_.facets[first + i]);
                }
            }
            for (std::size_t k = 0; k < n; ++k)
                for (std::uint32_t left = wanted[k]; left != 0; left &= left - 1) {
                    const auto i = static_cast<std::size_t>(std::countr_zero(left));
                    meet(solid_.facets[facets_of(some[k])[0] + i], solid_.groups[some[k]], touched_[k], i);
                }
        }
    }
    template <class T>
    static void prefetch(const T& what) {
        constexpr std::size_t line = 64;
        for (std::size_t at = 0; at < sizeof(T); at += line)
            __builtin_prefetch(reinterpret_cast<const char*>(&what) + at);
    }
    // The lines in which the places of one of a group's facets lie.
    [[nodiscard]] LineRange lines_in(const GroupTouched::Range& range, std::size_t i,
                                     const FacetGroup& group) const {
        if (!(range.low[i] <= range.high[i])) return {};
        return {first_line_from(group.middle[V] + static_cast<double>(range.low[i])),
                first_line_from(group.middle[V] + static_cast<double>(range.high[i]))};
    }

    // What a ball can touch without being in the solid, on the lines where it can: there every end of what is
    // forbidden is found.
    void meet_touched(std::span<const std::uint32_t> groups) {
        look_together(
            groups.rbegin(), groups.rend(), [&](const FacetGroup& group) { return can_touch(group); },
            [&](std::uint32_t g, GroupTouched& touched) {
                group_touched(solid_.corners[g], solid_.groups[g], V, r_, zc_, touched);
            },
            [&](const SolidFacet& f, const FacetGroup& group, const GroupTouched& touched, std::size_t i) {
                if (group.overhang > zc_ && f.nz < 0 && f.z_max > zc_) {
                    const auto [v_low, v_high] = std::minmax({f.p[0][V], f.p[1][V], f.p[2][V]});
                    meet_facet(f, reaches_out(f, lines_between(v_low, v_high)));
                    return;
                }
                if (!(f.z_max > zc_ - r_ && f.z_min <= zc_)) return;
                if (const LineRange met = lines_in(touched.face, i, group);
                    met.any() && f.normal != Vec3d{0, 0, 0})
                    meet_part(met, [&](const double* v, int n, double* low, double* high, double* nz_low,
                                       double* nz_high) {
                        marked_prism_rows(prism<U, V>(f, r_, zc_), v, n, low, high, nz_low, nz_high);
                    });
                for (std::size_t k = 0; k < 3; ++k)
                    if (const LineRange met = lines_in(touched.edge[k], i, group); met.any())
                        meet_part(met, [&](const double* v, int n, double* low, double* high, double* nz_low,
                                           double* nz_high) {
                            cylinder_rows(capsule<U, V>(f.p[k], f.p[(k + 1) % 3], r_, zc_), v, n, low, high,
                                          nz_low, nz_high);
                        });
                for (std::size_t k = 0; k < 3; ++k)
                    if (const LineRange met = lines_in(touched.end[k], i, group); met.any())
                        meet_part(met, [&](const double* v, int n, double* low, double* high, double* nz_low,
                                           double* nz_high) {
                            end_rows(capsule<U, V>(f.p[k], f.p[k], r_, zc_), v, n, low, high, nz_low,
                                     nz_high);
                        });
            });
    }

    // The same for a disc: it touches the sections of facets that do not face down, and what overhangs it
    // anywhere.
    void meet_touched_by_disc(std::span<const std::uint32_t> groups) {
        look_together(
            groups.begin(), groups.end(),
            [&](const FacetGroup& group) { return group.z_max > zc_ && group.z_min <= zc_; },
            [&](std::uint32_t g, GroupTouched& touched) {
                group_touched_by_disc(solid_.corners[g], solid_.groups[g], V, r_, zc_, touched.all);
            },
            [&](const SolidFacet& f, const FacetGroup& group, const GroupTouched& touched, std::size_t i) {
                if (f.z_max <= zc_) return;
                if (f.nz < 0) {
                    const auto [v_low, v_high] = std::minmax({f.p[0][V], f.p[1][V], f.p[2][V]});
                    meet_facet(f, lines_between(v_low, v_high));
                } else if (f.z_min <= zc_) {
                    meet_section(f, lines_in(touched.all, i, group));
                }
            });
        for (int l = 0; l < n_; ++l) join(found_[l]);
    }

    // Adds what a facet's section keeps a disc away from. An end at which it lies where the disc cannot touch
    // it from outside is marked.
    void meet_section(const SolidFacet& f, LineRange lines) {
        std::array<Vec3d, 2> cut;
        if (!lines.any() || !cut_segment(f, zc_, cut)) return;
        const std::uint8_t most = *std::max_element(f.aside.begin(), f.aside.end());
        const double across = std::sqrt(f.normal[0] * f.normal[0] + f.normal[1] * f.normal[1]),
                     du = cut[1][U] - cut[0][U], dv = cut[1][V] - cut[0][V], length2 = du * du + dv * dv;
        const bool known = most != SolidFacet::kAnyTurn && across > 0;
        const double turn = most * SolidFacet::kTurn + kTurnMargin;
        const auto within = [&](double u, double v) {
            if (!known) return false;
            const double s =
                length2 > 0 ? std::clamp(((u - cut[0][U]) * du + (v - cut[0][V]) * dv) / length2, 0.0, 1.0)
                            : 0.0;
            const double off_u = (u - cut[0][U] - s * du) / r_ - f.normal[U] / across,
                         off_v = (v - cut[0][V] - s * dv) / r_ - f.normal[V] / across;
            return off_u * off_u + off_v * off_v > turn * turn;
        };
        lay(lines, [&](const double* v, int n, double* low, double* high, double* nz_low, double* nz_high) {
            capsule_rows(capsule<U, V>(cut[0], cut[1], r_, zc_, f.nz), v, n, low, high, nz_low, nz_high);
        });
        for (int l = lines.first; l < lines.last; ++l) {
            if (!(hulls_.low[l] < hulls_.high[l])) continue;
            Forbidden h = found(l);
            if (within(h.low, at_[l])) h.nz_low += static_cast<float>(kWithin);
            if (within(h.high, at_[l])) h.nz_high += static_cast<float>(kWithin);
            append(found_[l], h);
        }
    }

    // For a disc, all facets that may reach over a gap's middle.
    void meet_amid(std::span<const std::uint32_t> groups) {
        for (const std::uint32_t g : groups) {
            const FacetGroup& group = solid_.groups[g];
            if (group.z_max <= zc_ || (group.overhang <= zc_ && group.z_min > zc_)) continue;
            if (!near_gap(group.low[U], group.high[U], group.low[V], group.high[V])) continue;
            if (!box_reaches_out(group.low[U], group.high[U], group.low[V], group.high[V]).any()) continue;
            const auto [first, last] = facets_of(g);
            for (std::size_t i = first; i < last; ++i) {
                const SolidFacet& f = solid_.facets[i];
                if (f.z_max <= zc_ || (f.nz >= 0 && f.z_min > zc_)) continue;
                std::array<Vec3d, 2> cut;
                if (f.nz >= 0 && !cut_segment(f, zc_, cut)) continue;
                const Vec3d &a = f.nz >= 0 ? cut[0] : f.p[0], &b = f.nz >= 0 ? cut[1] : f.p[1],
                            &c = f.nz >= 0 ? cut[1] : f.p[2];
                const auto [u_low, u_high] = std::minmax({a[U], b[U], c[U]});
                const auto [v_low, v_high] = std::minmax({a[V], b[V], c[V]});
                meet_facet(f, box_reaches_out(u_low, u_high, v_low, v_high));
            }
        }
    }

    // Makes hulls_ that of what rows(v, n, low, high, nz_low, nz_high) adds on some lines. @returns the steps
    // that hold these
    template <class Rows>
    LineRange lay(LineRange lines, Rows&& rows) {
        const LineRange steps = in_steps(lines);
        const int skip = steps.first, n = steps.last - steps.first;
        double *const low = hulls_.low.data() + skip, *const high = hulls_.high.data() + skip;
        std::fill(low, low + n, kInfinity);
        std::fill(high, high + n, -kInfinity);
        rows(at_.data() + skip, n, low, high, hulls_.nz_low.data() + skip, hulls_.nz_high.data() + skip);
        return steps;
    }
    // Adds what a face or an edge forbids on some lines.
    template <class Rows>
    void meet_part(LineRange lines, Rows&& rows) {
        lay(lines, rows);
        for (int l = lines.first; l < lines.last; ++l)
            if (hulls_.low[l] < hulls_.high[l] &&
                !(cover_.low[l] <= hulls_.low[l] && hulls_.high[l] <= cover_.high[l]))
                forbid(l, found(l));
    }
    [[nodiscard]] Forbidden found(int l) const {
        return {hulls_.low[l], hulls_.high[l], static_cast<float>(hulls_.nz_low[l]),
                static_cast<float>(hulls_.nz_high[l])};
    }

    // Notes where the middles of gaps lie.
    void find_gaps() {
        const double extent = solid_.max[U] - solid_.min[U] + 2 * r_;
        stretches_per_mm_ = extent > 0 ? kStretches / extent : 0;
        gaps_.fill(0);
        for (int l = 0; l < n_; ++l)
            for (std::size_t i = 1; i < found_[l].size(); ++i)
                gaps_[stretch_of(0.5 * (found_[l][i - 1].high + found_[l][i].low))] |= std::uint64_t{1} << l;
    }
    [[nodiscard]] std::size_t stretch_of(double u) const {
        return static_cast<std::size_t>(
            std::clamp((u - (solid_.min[U] - r_)) * stretches_per_mm_, 0.0, kStretches - 1.0));
    }
    // Whether the middle of a gap may lie within the radius of a box.
    [[nodiscard]] bool near_gap(double u_low, double u_high, double v_low, double v_high) const {
        std::uint64_t lines = 0;
        for (std::size_t i = stretch_of(u_low - r_), last = stretch_of(u_high + r_); i <= last; ++i)
            lines |= gaps_[i];
        if (lines == 0) return false;
        const LineRange near = lines_between(v_low, v_high);
        if (!near.any()) return false;
        return (lines >> near.first & ~std::uint64_t{0} >> (kLinesTogether - (near.last - near.first))) != 0;
    }

    // All ends of what is forbidden are known, and are at r from what a ball touches there: a gap at an end
    // that is nearer to something is none.
    static void close_within(std::vector<Forbidden>& on_line) {
        constexpr auto within = static_cast<float>(kWithin);
        const auto is = [](float nz) { return nz > within / 2; };
        std::size_t kept = 0;
        for (std::size_t i = 1; i < on_line.size(); ++i) {
            Forbidden& last = on_line[kept];
            if (is(last.nz_high) || is(on_line[i].nz_low))
                last.high = on_line[i].high, last.nz_high = on_line[i].nz_high;
            else on_line[++kept] = on_line[i];
        }
        if (on_line.empty()) return;
        on_line.resize(kept + 1);
        if (is(on_line.front().nz_low)) on_line.front().nz_low -= within;
        if (is(on_line.back().nz_high)) on_line.back().nz_high -= within;
    }

    // Whether a ball can touch a group's facets, and on some line.
    [[nodiscard]] bool can_touch(const FacetGroup& group) const {
        const Facing& facing = group.facing;
        return zc_ - r_ * facing.high[2] <= group.z_max + kTouchMargin &&
               zc_ - r_ * facing.low[2] >= group.z_min - kTouchMargin &&
               group.low[V] + r_ * facing.low[V] <= at_[n_ - 1] + kTouchMargin &&
               group.high[V] + r_ * facing.high[V] >= at_[0] - kTouchMargin;
    }

    // As std::lower_bound among the lines, which mostly are evenly spaced.
    [[nodiscard]] int first_line_from(double v) const {
        const double guess = (v - at_[0]) * per_mm_;
        int l = guess <= 0 ? 0 : guess >= n_ ? n_ : static_cast<int>(guess);
        while (l > 0 && at_[l - 1] >= v) --l;
        while (l < n_ && at_[l] < v) ++l;
        return l;
    }

    void meet_all(std::span<const std::uint32_t> groups) {
        for (std::size_t g = groups.size();
             g-- > 0;) {  // of a wall the upper ones come first, which reach farthest
            const FacetGroup& group = solid_.groups[groups[g]];
            if (amid_gaps_ && !near_gap(group.low[U], group.high[U], group.low[V], group.high[V])) continue;
            const LineRange lines = group_reaches_out(group);
            if (!lines.any()) continue;
            const auto [first, last] = facets_of(groups[g]);
            if (solid_.corners.empty()) {
                for (std::size_t i = first; i < last; ++i) {
                    const SolidFacet& f = solid_.facets[i];
                    if (active(f)) meet_facet(f, reaches_out(f, lines));
                }
                continue;
            }
            look_amid(lines);
            group_out_rows(solid_.corners[groups[g]], group, U, r_, zc_, cover_, at_.data(), lines.first,
                           lines.last, state_.data(), rows_);
            for (std::size_t i = first; i < last; ++i)
                meet_facet(solid_.facets[i], still_out(i - first, group.middle[U]));
        }
    }

    // For a disc where not all of the solid is there: one facet of each group shows about where others forbid
    // nothing more.
    void meet_disc(std::span<const std::uint32_t> groups) {
        constexpr std::uint32_t none = UINT32_MAX;  // the group reaches out of nothing
        cover();
        std::vector<std::uint32_t> shown(groups.size(), none);
        for (std::size_t g = groups.size(); g-- > 0;) {
            if (!disc_reaches_out(solid_.groups[groups[g]])) continue;
            const auto [first, last] = facets_of(groups[g]);
            std::size_t f = first;
            while (f < last && !active(solid_.facets[f])) ++f;
            if (f == last) continue;
            shown[g] = static_cast<std::uint32_t>(f);
            meet_facet(solid_.facets[f], disc_reaches_out(solid_.facets[f]));
        }
        cover();
        for (std::size_t g = 0; g < groups.size(); ++g) {
            if (shown[g] == none || !disc_reaches_out(solid_.groups[groups[g]])) continue;
            const auto [first, last] = facets_of(groups[g]);
            for (std::size_t i = first; i < last; ++i) {
                const SolidFacet& f = solid_.facets[i];
                if (i != shown[g] && active(f)) meet_facet(f, disc_reaches_out(f));
            }
        }
    }

    // Makes one of intervals that meet; a disc's come in any order.
    void join(std::vector<Forbidden>& on_line) const {
        if (!ball_)
            std::sort(on_line.begin(), on_line.end(), [](const Forbidden& a, const Forbidden& b) {
                return a.low != b.low ? a.low < b.low : a.high < b.high;
            });
        std::size_t kept = 0;
        for (const Forbidden& f : on_line) {
            if (kept == 0 || f.low > on_line[kept - 1].high + kMergeGap) {
                on_line[kept++] = f;
                continue;
            }
            Forbidden& last = on_line[kept - 1];
            if (f.high > last.high) last.high = f.high, last.nz_high = f.nz_high;
        }
        on_line.resize(kept);
    }

    // What is forbidden in the end, line by line.
    [[nodiscard]] Fibres merged() {
        Fibres part;
        std::size_t count = 0;
        for (int l = 0; l < n_; ++l) {
            join(found_[l]);
            count += found_[l].size();
        }
        part.intervals.reserve(count);
        part.starts.reserve(static_cast<std::size_t>(n_) + 1);
        for (int l = 0; l < n_; ++l) {
            part.intervals.insert(part.intervals.end(), found_[l].begin(), found_[l].end());
            part.starts.push_back(static_cast<std::uint32_t>(part.intervals.size()));
        }
        return part;
    }

private:
    [[nodiscard]] bool active(const SolidFacet& f) const {
        return may_touch(f.z_min, f.z_max, f.nz < 0 ? f.z_max : -kInfinity, ball_, r_, zc_);
    }

    // Those within the radius of [low, high].
    [[nodiscard]] LineRange lines_between(double low, double high) const {
        return {first_line_from(low - r_), first_line_from(high + r_)};
    }
    // The kernels' steps that hold them.
    [[nodiscard]] static LineRange in_steps(LineRange a) {
        const int n = (a.last - a.first + kLinesStep - 1) / kLinesStep * kLinesStep,
                  first = std::min(a.first, kLinesTogether - n);
        return {first, first + n};
    }

    // Looks at the last stretch that begins no later than `low`.
    void look_at(int l, double low) {
        const std::vector<Forbidden>& on_line = found_[l];
        auto next = std::upper_bound(on_line.begin(), on_line.end(), low,
                                     [](double v, const Forbidden& f) { return v < f.low; });
        if (amid_gaps_ && next != on_line.end() &&
            (next == on_line.begin() || low >= 0.5 * (std::prev(next)->high + next->low)))
            ++next;
        look(l, next);
    }
    void look(int l, std::vector<Forbidden>::const_iterator next) {
        const std::vector<Forbidden>& on_line = found_[l];
        if (amid_gaps_) {
            const bool none = next == on_line.begin(), first = none || next - 1 == on_line.begin(),
                       last = none || next == on_line.end();
            cover_.low[l] = first ? -kInfinity : 0.5 * ((next - 2)->high + (next - 1)->low);
            cover_.high[l] = cover_.next[l] = last ? kInfinity : 0.5 * ((next - 1)->high + next->low);
            return;
        }
        cover_.next[l] = next == on_line.end() ? kInfinity : next->low;
        cover_.low[l] = next == on_line.begin() ? -kInfinity : std::prev(next)->low;
        cover_.high[l] = next == on_line.begin() ? -kInfinity : std::prev(next)->high;
    }

    // Whether [low_, high_] reaches out of what is forbidden on a line.
    [[nodiscard]] bool out(int l) {
        if (state_[l] != kLooksElsewhere) return state_[l] != 0;
        look_at(l, low_[l]);
        return high_[l] > cover_.high[l];
    }

    // Of these lines those, from the first to the last, on which [low_, high_] does.
    LineRange narrowed(LineRange lines) {
        while (lines.any() && !out(lines.first)) ++lines.first;
        while (lines.any() && !out(lines.last - 1)) --lines.last;
        return lines;
    }

    // Where [low_, high_] reaches out, looks at the stretch that its middle may lie in: a group's facets
    // mostly forbid what joins that.
    void look_amid(LineRange lines) {
        for (int l = lines.first; l < lines.last; ++l) {
            const double middle = 0.5 * (low_[l] + high_[l]);
            if (state_[l] != 0 && !(cover_.low[l] <= middle && middle < cover_.next[l])) look_at(l, middle);
        }
    }

    // Of the lines on which one of a group's facets was said to reach out those, from the first to the last,
    // on which it still does, now that others of the group are met. `middle` is the group's.
    [[nodiscard]] LineRange still_out(std::size_t i, double middle) const {
        LineRange lines{rows_.first[i], rows_.last[i]};
        const auto out = [&](int l) {
            return rows_.low[l][i] < static_cast<float>(cover_.low[l] - middle) ||
                   rows_.high[l][i] > static_cast<float>(cover_.high[l] - middle);
        };
        while (lines.any() && !out(lines.first)) ++lines.first;
        while (lines.any() && !out(lines.last - 1)) --lines.last;
        return lines;
    }

    // Adds to what is forbidden on a line, which stays ascending and disjoint.
    void forbid(int l, const Forbidden& h) {
        if (amid_gaps_) return fill(l, h);
        std::vector<Forbidden>& on_line = found_[l];
        auto at = std::lower_bound(on_line.begin(), on_line.end(), h.low,
                                   [](const Forbidden& f, double v) { return f.high < v; });
        if (at == on_line.end() || at->low > h.high) at = on_line.insert(at, h);
        else {
            if (h.low < at->low) {
                at->low = h.low;
                at->nz_low = h.nz_low;
            }
            if (h.high > at->high) {
                at->high = h.high;
                at->nz_high = h.nz_high;
                auto beyond = at + 1;
                for (; beyond != on_line.end() && beyond->low <= h.high; ++beyond)
                    if (beyond->high > at->high) {
                        at->high = beyond->high;
                        at->nz_high = beyond->nz_high;
                    }
                if (beyond != at + 1) at = on_line.erase(at + 1, beyond) - 1;
            }
        }
        look(l, at + 1);
    }

    // A gap between what can be touched is forbidden as a whole where its middle is.
    void fill(int l, const Forbidden& h) {
        std::vector<Forbidden>& on_line = found_[l];
        std::size_t at = 0;
        while (at + 1 < on_line.size() && 0.5 * (on_line[at].high + on_line[at + 1].low) <= h.low) ++at;
        while (at + 1 < on_line.size() && 0.5 * (on_line[at].high + on_line[at + 1].low) < h.high) {
            on_line[at].high = on_line[at + 1].high;
            on_line[at].nz_high = on_line[at + 1].nz_high;
            on_line.erase(on_line.begin() + static_cast<std::ptrdiff_t>(at) + 1);
        }
        look(l, on_line.empty() ? on_line.begin() : on_line.begin() + static_cast<std::ptrdiff_t>(at) + 1);
    }

    [[nodiscard]] std::array<std::size_t, 2> facets_of(std::uint32_t group) const {
        const std::size_t first = group * FacetGroup::kFacets;
        return {first, std::min(solid_.facets.size(), first + FacetGroup::kFacets)};
    }

    // Takes what a disc has been found to meet so far for covered.
    void cover() {
        for (int l = 0; l < n_; ++l) {
            std::vector<Stretch>& cover = covered_[l];
            cover.clear();
            for (const Forbidden& f : found_[l]) cover.push_back({f.low, f.high});
            std::sort(cover.begin(), cover.end(),
                      [](const Stretch& a, const Stretch& b) { return a.low < b.low; });
            std::size_t kept = 0;
            for (const Stretch& s : cover)
                if (kept > 0 && s.low <= cover[kept - 1].high)
                    cover[kept - 1].high = std::max(cover[kept - 1].high, s.high);
                else cover[kept++] = s;
            cover.resize(kept);
            seen_[l] = 0;
        }
    }

    [[nodiscard]] bool is_covered(int l) {
        return low_[l] >= high_[l] || covered(covered_[l], seen_[l], low_[l], high_[l]);
    }

    // How far a disc may be kept away by what lies in a box, on the lines within its reach.
    LineRange disc_reach(double u_low, double u_high, double v_low, double v_high) {
        const LineRange lines = lines_between(v_low, v_high), steps = in_steps(lines);
        box_out_rows({u_low, u_high, v_low, v_high, r_ * r_}, cover_, at_.data(), steps.first, steps.last,
                     low_.data(), high_.data(), state_.data());
        return lines;
    }
    bool disc_reaches_out(const FacetGroup& group) {
        const LineRange lines = disc_reach(group.low[U], group.high[U], group.low[V], group.high[V]);
        for (int l = lines.first; l < lines.last; ++l)
            if (!is_covered(l)) return true;
        return false;
    }
    LineRange disc_reaches_out(const SolidFacet& f) {
        const auto [ul, uh] = std::minmax({f.p[0][U], f.p[1][U], f.p[2][U]});
        const auto [vl, vh] = std::minmax({f.p[0][V], f.p[1][V], f.p[2][V]});
        LineRange lines = disc_reach(ul, uh, vl, vh);
        while (lines.any() && is_covered(lines.first)) ++lines.first;
        while (lines.any() && is_covered(lines.last - 1)) --lines.last;
        return lines;
    }

    // Neighbouring facets mostly follow one another, so most intervals only stretch the one before.
    void append(std::vector<Forbidden>& on_line, const Forbidden& h) {
        if (on_line.empty() || h.low > on_line.back().high || h.high < on_line.back().low) {
            on_line.push_back(h);
            return;
        }
        Forbidden& before = on_line.back();
        if (h.low < before.low) {
            before.low = h.low;
            before.nz_low = h.nz_low;
        }
        if (h.high > before.high) {
            before.high = h.high;
            before.nz_high = h.nz_high;
        }
    }

    // The lines on which what lies within a group's box and disc may reach past what is forbidden.
    LineRange group_reaches_out(const FacetGroup& group) {
        const bool level = group.overhang > zc_;
        const double dz = level ? 0 : std::max({0.0, group.z_min - zc_, zc_ - group.z_max});
        const LineRange lines = lines_between(group.low[V], group.high[V]), steps = in_steps(lines);
        const BoxTerms box{group.low[U], group.high[U], group.low[V], group.high[V], r_ * r_ - dz * dz};
        if (level) {
            if (box_out_rows(box, cover_, at_.data(), steps.first, steps.last, low_.data(), high_.data(),
                             state_.data()) == 0)
                return {};
        } else {
            const DiscTerms t{group.middle[U], group.middle[V], zc_ - group.middle[2],
                              r_ * r_,         group.axis[U],   group.axis[V],
                              group.axis[2],   group.radius,    group.thickness};
            if (disc_out_rows(box, t, cover_, at_.data(), steps.first, steps.last, low_.data(), high_.data(),
                              state_.data()) == 0)
                return {};
        }
        return narrowed(lines);
    }

    // The lines on which what lies in a box may, at any height.
    LineRange box_reaches_out(double u_low, double u_high, double v_low, double v_high) {
        return box_reaches_out(u_low, u_high, v_low, v_high, lines_between(v_low, v_high));
    }
    LineRange box_reaches_out(double u_low, double u_high, double v_low, double v_high, LineRange lines) {
        const LineRange steps = in_steps(lines);
        const BoxTerms box{u_low, u_high, v_low, v_high, r_ * r_};
        if (box_out_rows(box, cover_, at_.data(), steps.first, steps.last, low_.data(), high_.data(),
                         state_.data()) == 0)
            return {};
        return narrowed(lines);
    }

    // Those of these lines on which a facet may.
    LineRange reaches_out(const SolidFacet& f, LineRange lines) {
        if (f.nz < 0 && f.z_max > zc_) {
            const auto [ul, uh] = std::minmax({f.p[0][U], f.p[1][U], f.p[2][U]});
            const auto [vl, vh] = std::minmax({f.p[0][V], f.p[1][V], f.p[2][V]});
            return box_reaches_out(ul, uh, vl, vh, lines);
        }
        BoxTerms box;
        TangentTerms tangent;
        facet_terms(f, U, r_, zc_, box, tangent);
        LineRange steps = in_steps(lines);
        while (steps.any() && at_[steps.first + kLinesStep - 1] <= box.v_low - r_) steps.first += kLinesStep;
        while (steps.any() && at_[steps.last - kLinesStep] >= box.v_high + r_) steps.last -= kLinesStep;
        lines = {std::max(lines.first, steps.first), std::min(lines.last, steps.last)};
        if (!lines.any()) return {};
        if (facet_out_rows(box, tangent, cover_, at_.data(), steps.first, steps.last, low_.data(),
                           high_.data(), state_.data()) == 0)
            return {};
        return narrowed(lines);
    }

    void meet_facet(const SolidFacet& f, LineRange lines) {
        if (!lines.any()) return;
        const LineRange steps = lay(
            lines, [&](const double* v, int n, double* low, double* high, double* nz_low, double* nz_high) {
                auto meet_capsule = [&](const CapsuleTerms& c) {
                    capsule_rows(c, v, n, low, high, nz_low, nz_high);
                };
                if (ball_ && f.z_max > zc_ - r_ && f.z_min <= zc_) {
                    if (f.normal != Vec3d{0, 0, 0})
                        prism_rows(prism<U, V>(f, r_, zc_), v, n, low, high, nz_low, nz_high);
                    for (int k = 0; k < 3; ++k)
                        if (f.edges >> k & 1) meet_capsule(capsule<U, V>(f.p[k], f.p[(k + 1) % 3], r_, zc_));
                }
                if (f.z_max <= zc_) return;
                if (f.nz < 0) {
                    std::array<Vec3d, 4> polygon;
                    const int corners = part_above(f, zc_, polygon);
                    for (int k = 0; k < corners; ++k)
                        meet_capsule(capsule<U, V>(polygon[k], polygon[(k + 1) % corners], r_, zc_, f.nz));
                } else if (!ball_) {
                    std::array<Vec3d, 2> cut;
                    if (cut_segment(f, zc_, cut)) meet_capsule(capsule<U, V>(cut[0], cut[1], r_, zc_, f.nz));
                }
            });
        if (!ball_ && !amid_gaps_) {
            for (int l = lines.first; l < lines.last; ++l)
                if (hulls_.low[l] < hulls_.high[l]) append(found_[l], found(l));
        } else if (cover_rows(cover_, hulls_.low.data(), hulls_.high.data(), steps.first, steps.last,
                              state_.data()) != 0) {
            for (int l = lines.first; l < lines.last; ++l)
                if (state_[l] != 0) forbid(l, found(l));
        }
    }

    static constexpr double kStretches = 1024;  // of the solid's extent along the lines
    bool amid_gaps_ = false;
    double stretches_per_mm_ = 0;
    std::array<std::uint64_t, static_cast<std::size_t>(kStretches)>
        gaps_{};  // by stretch the lines that have a gap's middle there
    float inside_nz_ = 0;
    const LayerSolid& solid_;
    const bool ball_;
    const double r_;
    double zc_ = 0;
    const int n_;
    alignas(64) std::array<double, kLinesTogether> at_{}, low_{}, high_{};
    HullRows hulls_;
    GroupRows rows_;
    static constexpr std::size_t kTogether = 8;
    std::array<GroupTouched, kTogether> touched_;
    double per_mm_ = 0;  // lines
    alignas(64) std::array<std::int64_t, kLinesTogether> state_{};
    std::array<std::vector<Forbidden>, kLinesTogether> found_;  // a ball's: ascending and disjoint
    CoverRows cover_;                                           // of a ball
    std::array<std::vector<Stretch>, kLinesTogether> covered_;  // of a disc: ascending and disjoint
    std::array<std::uint32_t, kLinesTogether> seen_{};
    std::array<std::vector<Crossing>, kLinesTogether> crossings_;
};

// Where numbers stand among ascending ones, found from where they would stand if those were evenly spaced, as
// lines mostly are.
class Among {
public:
    explicit Among(std::span<const std::int32_t> lines)
        : lines_(lines),
          first_(lines.front()),
          per_unit_(lines.back() > lines.front() ? static_cast<double>(lines.size() - 1) /
                                                       (static_cast<double>(lines.back()) - lines.front())
                                                 : 0) {}
    /// As std::lower_bound.
    template <class T>
    [[nodiscard]] std::size_t first_from(T value) const {
        const auto n = static_cast<std::ptrdiff_t>(lines_.size());
        const double guess = (static_cast<double>(value) - first_) * per_unit_;
        std::ptrdiff_t at = guess <= 0                        ? 0
                            : guess >= static_cast<double>(n) ? n
                                                              : static_cast<std::ptrdiff_t>(guess);
        for (int step = 0; step < kSteps; ++step) {
            if (at > 0 && !(before(at - 1, value))) --at;
            else if (at < n && before(at, value)) ++at;
            else return static_cast<std::size_t>(at);
        }
        return static_cast<std::size_t>(std::lower_bound(lines_.begin(), lines_.end(), value) -
                                        lines_.begin());
    }

private:
    static constexpr int kSteps = 4;
    template <class T>
    [[nodiscard]] bool before(std::ptrdiff_t i, T value) const {
        return lines_[static_cast<std::size_t>(i)] < value;
    }
    std::span<const std::int32_t> lines_;
    double first_, per_unit_;
};

// What matters to each block of lines at one height.
template <int V>
class BlocksOfLevel {
public:
    BlocksOfLevel(Context& context, const LayerSolid& solid, const Loops& inside, const Cutter& cutter,
                  double zc, std::span<const std::int32_t> lines) {
        const std::size_t blocks = (lines.size() + kBlock - 1) / kBlock;
        list_groups(context, solid, cutter, zc, lines, blocks);
        list_segments(inside, lines, blocks);
    }
    [[nodiscard]] std::span<const std::uint32_t> groups(std::size_t b) const {
        return std::span(members_).subspan(starts_[b], starts_[b + 1] - starts_[b]);
    }
    /// Of the inside's border, those that cross the block's lines.
    [[nodiscard]] std::span<const std::array<Point2, 2>> segments(std::size_t b) const {
        return segments_[b];
    }

private:
    void list_groups(Context& context, const LayerSolid& solid, const Cutter& cutter, double zc,
                     std::span<const std::int32_t> lines, std::size_t blocks) {
        const bool ball = cutter.profile == Cutter::Profile::ball;
        const double r = cutter.radius;
        const Among among(lines);
        struct Active {
            std::uint32_t group, first, last;  // blocks [first, last)
        };
        constexpr std::size_t grain = 2048;
        std::vector<std::vector<Active>> active((solid.groups.size() + grain - 1) / grain);
        parallel_for(context, solid.groups.size(), grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t g = begin; g < end; ++g) {
                const FacetGroup& group = solid.groups[g];
                if (!may_touch(group.z_min, group.z_max, group.overhang, ball, r, zc)) continue;
                const std::size_t first = among.first_from((group.low[V] - r) * kUnitsPerMm),
                                  last = among.first_from((group.high[V] + r) * kUnitsPerMm);
                if (first < last)
                    active[begin / grain].push_back({static_cast<std::uint32_t>(g),
                                                     static_cast<std::uint32_t>(first / kBlock),
                                                     static_cast<std::uint32_t>((last - 1) / kBlock + 1)});
            }
        });
        starts_.assign(blocks + 1, 0);
        for (const std::vector<Active>& part : active)
            for (const Active& a : part)
                for (std::uint32_t b = a.first; b < a.last; ++b) ++starts_[b + 1];
        for (std::size_t b = 1; b <= blocks; ++b) starts_[b] += starts_[b - 1];
        members_.resize(starts_.back());
        std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
        for (const std::vector<Active>& part : active)
            for (const Active& a : part)
                for (std::uint32_t b = a.first; b < a.last; ++b) members_[next[b]++] = a.group;
    }

    void list_segments(const Loops& inside, std::span<const std::int32_t> lines, std::size_t blocks) {
        segments_.resize(blocks);
        const Among among(lines);
        auto coordinate = [](Point2 p) { return V == 0 ? p.x : p.y; };
        for (std::size_t l = 0; l < inside.size(); ++l) {
            const auto loop = inside.loop(l);
            for (std::size_t i = 0; i < loop.size(); ++i) {
                const Point2 a = loop[i], b = loop[i + 1 == loop.size() ? 0 : i + 1];
                const std::int32_t va = coordinate(a), vb = coordinate(b);
                if (va == vb) continue;
                const std::size_t first = among.first_from(std::min(va, vb));
                const std::size_t last = among.first_from(std::max(va, vb));
                if (first >= last) continue;
                for (std::size_t k = first / kBlock; k <= (last - 1) / kBlock; ++k)
                    segments_[k].push_back({a, b});
            }
        }
    }

    std::vector<std::uint32_t> starts_, members_;
    std::vector<std::vector<std::array<Point2, 2>>> segments_;
};

Fibres joined(std::span<const Fibres> parts, std::size_t lines) {
    Fibres result;
    std::size_t total = 0;
    for (const Fibres& part : parts) total += part.intervals.size();
    result.intervals.reserve(total);
    result.starts.reserve(lines + 1);
    for (const Fibres& part : parts) {
        const std::uint32_t base = static_cast<std::uint32_t>(result.intervals.size());
        for (std::size_t i = 1; i < part.starts.size(); ++i) result.starts.push_back(base + part.starts[i]);
        result.intervals.insert(result.intervals.end(), part.intervals.begin(), part.intervals.end());
    }
    return result;
}

template <int U, int V>
std::vector<Fibres> fibres_along(Context& context, const LayerSolid& solid,
                                 std::span<const FibreLevel> levels, const Cutter& cutter,
                                 std::span<const std::int32_t> lines) {
    std::vector<Fibres> result(levels.size());
    if (lines.empty()) return result;
    const std::size_t blocks = (lines.size() + kBlock - 1) / kBlock;
    // The ball's centre, or the disc.
    auto centre = [&](const FibreLevel& level) {
        return cutter.profile == Cutter::Profile::ball ? level.tip_z + cutter.radius : level.tip_z;
    };
    std::vector<std::size_t> downwards(levels.size());
    std::iota(downwards.begin(), downwards.end(), std::size_t{0});
    std::stable_sort(downwards.begin(), downwards.end(),
                     [&](std::size_t a, std::size_t b) { return levels[a].tip_z > levels[b].tip_z; });
    const Loops none;
    std::vector<std::optional<BlocksOfLevel<V>>> of_level(levels.size());
    parallel_each(context, levels.size(), [&](std::size_t i) {
        // A tip above the solid's upper end stands clear of its inside.
        const Loops& inside = levels[i].tip_z < solid.z_top - kTopSheet ? *levels[i].inside : none;
        of_level[i].emplace(context, solid, inside, cutter, centre(levels[i]), lines);
    });
    std::vector<std::vector<Fibres>> parts(levels.size(), std::vector<Fibres>(blocks));
    parallel_each(context, blocks, [&](std::size_t b) {
        const std::span<const std::int32_t> own =
            lines.subspan(b * kBlock, std::min(kBlock, lines.size() - b * kBlock));
        BlockOfLines<U, V> block(solid, cutter, own);
        for (const std::size_t i : downwards) {
            block.begin(centre(levels[i]));
            block.meet_inside(of_level[i]->segments(b), own);
            block.meet(of_level[i]->groups(b));
            parts[i][b] = block.merged();
        }
    });
    parallel_each(context, levels.size(), [&](std::size_t i) {
        result[i] = joined(parts[i], lines.size());
        parts[i] = {};
    });
    return result;
}

}  // namespace

Plane inside_plane(const LayerSolid& solid, const Cutter& cutter, double tip_z) {
    const double z = cutter.profile == Cutter::Profile::ball ? tip_z + cutter.radius : tip_z;
    // Above the solid's upper end only a ball's cap still matters: over the end's inside it is forbidden as
    // long as it dips below.
    const double end = solid.z_top - kTopSheet;
    if (z < end) return {z, Side::above};
    return {end, Side::below};
}

std::vector<Fibres> fibres(Context& context, const LayerSolid& solid, std::span<const FibreLevel> levels,
                           const Cutter& cutter, Axis axis, std::span<const std::int32_t> lines) {
    if (cutter.profile == Cutter::Profile::other)
        return revolved_fibres(context, solid, levels, cutter, axis, lines);
    return axis == Axis::x ? fibres_along<0, 1>(context, solid, levels, cutter, lines)
                           : fibres_along<1, 0>(context, solid, levels, cutter, lines);
}

Fibres fibres(Context& context, const LayerSolid& solid, const Loops& inside, const Cutter& cutter,
              double tip_z, Axis axis, std::span<const std::int32_t> lines) {
    const FibreLevel level{tip_z, &inside};
    return std::move(fibres(context, solid, {&level, 1}, cutter, axis, lines).front());
}

Fibres covering(Context& context, std::span<const SolidFacet> facets, double radius, Axis axis,
                std::span<const std::int32_t> lines) {
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
    overhang.groups = facet_groups(context, overhang.facets);
    return fibres(context, overhang, {}, {Cutter::Profile::flat, radius}, low - 1, axis, lines);
}

std::vector<Stretch> free_stretches(std::span<const Forbidden> forbidden, double low, double high,
                                    double shortest) {
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
