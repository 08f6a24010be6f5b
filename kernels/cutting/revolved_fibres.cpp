#include "kernels/cutting/revolved_fibres.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "kernels/cutting/forbidden_lines.h"
#include "kernels/cutting/revolved.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kBlock = 64;  // lines that share one look at the facets

// Lines of one block at one height; what is forbidden on each is kept ascending and disjoint.
class LinesOverTip {
public:
    LinesOverTip(std::span<const std::int32_t> lines, int axis_u) : lines_(lines), u_(axis_u) {
        forbidden_.resize(lines.size());
    }

    // The section's border, of which solid lies to the left.
    void meet_inside(const Loops& inside) {
        struct Crossing {
            double u;
            int turn;
        };
        std::vector<std::vector<Crossing>> crossings(lines_.size());
        const auto coordinate = [](Point2 p, int axis) { return axis == 0 ? p.x : p.y; };
        for (std::size_t l = 0; l < inside.size(); ++l) {
            const auto loop = inside.loop(l);
            for (std::size_t i = 0; i < loop.size(); ++i) {
                const Point2 a = loop[i], b = loop[i + 1 == loop.size() ? 0 : i + 1];
                const std::int32_t va = coordinate(a, 1 - u_), vb = coordinate(b, 1 - u_);
                const auto first = std::lower_bound(lines_.begin(), lines_.end(), std::min(va, vb));
                for (auto line = first; line != lines_.end() && *line < std::max(va, vb); ++line) {
                    const double t = (static_cast<double>(*line) - va) / (static_cast<double>(vb) - va);
                    const double ua = coordinate(a, u_), ub = coordinate(b, u_);
                    crossings[static_cast<std::size_t>(line - lines_.begin())].push_back(
                        {(ua + t * (ub - ua)) / kUnitsPerMm, (va > vb) == (u_ == 0) ? 1 : -1});
                }
            }
        }
        for (std::size_t l = 0; l < lines_.size(); ++l) {
            std::sort(crossings[l].begin(), crossings[l].end(), [](const Crossing& a, const Crossing& b) {
                return a.u != b.u ? a.u < b.u : a.turn > b.turn;
            });
            int depth = 0;
            double entered = 0;
            for (const Crossing& c : crossings[l]) {
                if (depth <= 0 && depth + c.turn > 0) entered = c.u;
                if (depth > 0 && depth + c.turn <= 0 && c.u > entered) forbid(l, {entered, c.u, 0, 0});
                depth += c.turn;
            }
        }
    }

    void meet(const SolidFacet& facet, const Envelope& under, double tip_z) {
        const FacetOverTip over(facet, under, tip_z, u_);
        const auto first = std::upper_bound(lines_.begin(), lines_.end(), over.v_low() * kUnitsPerMm);
        for (auto line = first; line != lines_.end() && *line < over.v_high() * kUnitsPerMm; ++line) {
            const auto l = static_cast<std::size_t>(line - lines_.begin());
            if (covers(forbidden_[l], over.u_low(), over.u_high())) continue;
            const RevolvedStretch s = over.stretch(to_mm(*line));
            if (s.low < s.high)
                forbid(l, {s.low, s.high, static_cast<float>(s.nz_low), static_cast<float>(s.nz_high)});
        }
    }

    [[nodiscard]] Fibres take() {
        Fibres part;
        for (std::vector<Forbidden>& on_line : forbidden_) {
            join_ascending(on_line);
            part.intervals.insert(part.intervals.end(), on_line.begin(), on_line.end());
            part.starts.push_back(static_cast<std::uint32_t>(part.intervals.size()));
        }
        return part;
    }

private:
    static bool covers(const std::vector<Forbidden>& on_line, double low, double high) {
        const auto next = std::upper_bound(on_line.begin(), on_line.end(), low,
                                           [](double v, const Forbidden& f) { return v < f.low; });
        return next != on_line.begin() && high <= std::prev(next)->high;
    }

    void forbid(std::size_t l, const Forbidden& h) {
        std::vector<Forbidden>& on_line = forbidden_[l];
        auto at = std::lower_bound(on_line.begin(), on_line.end(), h.low,
                                   [](const Forbidden& f, double v) { return f.high < v; });
        if (at == on_line.end() || at->low > h.high) {
            on_line.insert(at, h);
            return;
        }
        if (h.low < at->low) at->low = h.low, at->nz_low = h.nz_low;
        if (!(h.high > at->high)) return;
        at->high = h.high, at->nz_high = h.nz_high;
        auto beyond = at + 1;
        for (; beyond != on_line.end() && beyond->low <= h.high; ++beyond)
            if (beyond->high > at->high) at->high = beyond->high, at->nz_high = beyond->nz_high;
        on_line.erase(at + 1, beyond);
    }

    std::span<const std::int32_t> lines_;
    int u_;
    std::vector<std::vector<Forbidden>> forbidden_;
};

// Where the solid is over a place but not at the tip's height, a facet that faces down is over that place
// too: all such are met. Of the others only those that reach down to where the cutter widens no more: the
// border of what stands higher is among them.
bool may_touch(double z_min, double z_max, double overhang, double tip_z, double full_width_z) {
    return overhang > tip_z || (z_max > tip_z && z_min <= full_width_z);
}

}  // namespace

std::vector<Fibres> revolved_fibres(Context& context, const LayerSolid& solid,
                                    std::span<const FibreLevel> levels, const CutterShape& cutter, Axis axis,
                                    std::span<const std::int32_t> lines) {
    const Envelope under = under_side(cutter);
    const double tall = under.height(under.radius);
    const int u = axis == Axis::x ? 0 : 1, v = 1 - u;
    const std::size_t blocks = (lines.size() + kBlock - 1) / kBlock;
    std::vector<Fibres> result(levels.size());
    std::vector<Fibres> parts(levels.size() * blocks);
    parallel_each(context, parts.size(), [&](std::size_t k) {
        const FibreLevel& level = levels[k / blocks];
        const std::size_t begin = k % blocks * kBlock;
        const auto own = lines.subspan(begin, std::min(kBlock, lines.size() - begin));
        const double low = to_mm(own.front()) - under.radius, high = to_mm(own.back()) + under.radius,
                     full = level.tip_z + tall;
        LinesOverTip block(own, u);
        if (level.tip_z < solid.z_top - kTopSheet && level.inside != nullptr)
            block.meet_inside(*level.inside);
        for (std::size_t g = 0; g < solid.groups.size(); ++g) {
            const FacetGroup& group = solid.groups[g];
            if (group.high[static_cast<std::size_t>(v)] < low ||
                group.low[static_cast<std::size_t>(v)] > high ||
                !may_touch(group.z_min, group.z_max, group.overhang, level.tip_z, full))
                continue;
            const std::size_t first = g * FacetGroup::kFacets,
                              last = std::min(first + FacetGroup::kFacets, solid.facets.size());
            for (std::size_t f = first; f < last; ++f) {
                const SolidFacet& facet = solid.facets[f];
                const double overhang = facet.nz < 0 ? facet.z_max : -std::numeric_limits<double>::infinity();
                if (may_touch(facet.z_min, facet.z_max, overhang, level.tip_z, full))
                    block.meet(facet, under, level.tip_z);
            }
        }
        parts[k] = block.take();
    });
    for (std::size_t i = 0; i < levels.size(); ++i) {
        Fibres& all = result[i];
        for (std::size_t b = 0; b < blocks; ++b) {
            const Fibres& part = parts[i * blocks + b];
            const auto base = static_cast<std::uint32_t>(all.intervals.size());
            for (std::size_t l = 1; l < part.starts.size(); ++l) all.starts.push_back(base + part.starts[l]);
            all.intervals.insert(all.intervals.end(), part.intervals.begin(), part.intervals.end());
        }
    }
    return result;
}

}  // namespace slabwright
