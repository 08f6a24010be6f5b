// What facets forbid on a block of lines, level by level. Internal to fibres: U is the lines' direction, V
// the other one in the plane.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/cutting/fibre_facets.h"
#include "kernels/cutting/forbidden_lines.h"
#include "kernels/cutting/tool_shape.h"

namespace slabwright {

// What a ball forbids is kept ascending and disjoint as it is found, so that each facet is held against all
// that was met before it. Facets that meet in a corner touch a disc at one place, and whose nz stands there
// goes by the order in which intervals are joined: for a flat cutter these are sorted in the end, and what
// reaches out is told from two states of them.
template <int U, int V>
class BlockOfLines : public ForbiddenLines {
public:
    BlockOfLines(const LayerSolid& solid, const CutterShape& cutter, std::span<const std::int32_t> lines)
        : ForbiddenLines(cutter.is_ball(), cutter.radius, lines), solid_(solid) {}

    // Goes down to a level: what those above it forbid, which are merged(), it forbids too.
    void begin(double zc) {
        zc_ = zc;
        // Where a section's border lies, the centre is no farther from the solid than it is over the plane.
        const double over_plane = ball_ ? std::max(0.0, zc - (solid_.z_top - kTopSheet)) : 0;
        inside_nz_ = by_touch() && over_plane < r_ - kTouchMargin ? static_cast<float>(kWithin) : 0.0F;
        begin_cover();
        for (int l = 0; l < n_; ++l) crossings_[l].clear();
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
        std::fill(low, low + n, kNowhere);
        std::fill(high, high + n, -kNowhere);
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

    // Whether a ball can touch a group's facets, and on some line.
    [[nodiscard]] bool can_touch(const FacetGroup& group) const {
        const Facing& facing = group.facing;
        return zc_ - r_ * facing.high[2] <= group.z_max + kTouchMargin &&
               zc_ - r_ * facing.low[2] >= group.z_min - kTouchMargin &&
               group.low[V] + r_ * facing.low[V] <= at_[n_ - 1] + kTouchMargin &&
               group.high[V] + r_ * facing.high[V] >= at_[0] - kTouchMargin;
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

private:
    [[nodiscard]] bool active(const SolidFacet& f) const {
        return may_touch(f.z_min, f.z_max, f.nz < 0 ? f.z_max : -kNowhere, ball_, r_, zc_);
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

    [[nodiscard]] std::array<std::size_t, 2> facets_of(std::uint32_t group) const {
        const std::size_t first = group * FacetGroup::kFacets;
        return {first, std::min(solid_.facets.size(), first + FacetGroup::kFacets)};
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

    static constexpr float kTouchMargin = 1e-4F;  // mm
    static constexpr double kTurnMargin = 1e-3;   // of a unit vector
    static constexpr double kStretches = 1024;    // of the solid's extent along the lines
    static constexpr std::size_t kTogether = 8;
    struct Crossing {
        double u;
        int turn;
    };
    const LayerSolid& solid_;
    double zc_ = 0;
    double stretches_per_mm_ = 0;
    std::array<std::uint64_t, static_cast<std::size_t>(kStretches)>
        gaps_{};  // by stretch the lines that have a gap's middle there
    float inside_nz_ = 0;
    HullRows hulls_;
    GroupRows rows_;
    std::array<GroupTouched, kTogether> touched_;
    std::array<std::vector<Crossing>, kLinesTogether> crossings_;
};

}  // namespace slabwright
