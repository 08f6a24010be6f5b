#include "kernels/cutting/fibres.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <optional>

#include "kernels/cutting/block_of_lines.h"
#include "kernels/cutting/revolved_fibres.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kBlock = kLinesTogether;  // lines that share one pass over their facets

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
    BlocksOfLevel(Context& context, const LayerSolid& solid, const Loops& inside, const CutterShape& cutter,
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
    void list_groups(Context& context, const LayerSolid& solid, const CutterShape& cutter, double zc,
                     std::span<const std::int32_t> lines, std::size_t blocks) {
        const bool ball = cutter.is_ball();
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
                                 std::span<const FibreLevel> levels, const CutterShape& cutter,
                                 std::span<const std::int32_t> lines) {
    std::vector<Fibres> result(levels.size());
    if (lines.empty()) return result;
    const std::size_t blocks = (lines.size() + kBlock - 1) / kBlock;
    // The ball's centre, or the disc.
    auto centre = [&](const FibreLevel& level) {
        return cutter.is_ball() ? level.tip_z + cutter.radius : level.tip_z;
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

Plane inside_plane(const LayerSolid& solid, const CutterShape& cutter, double tip_z) {
    const double z = cutter.is_ball() ? tip_z + cutter.radius : tip_z;
    // Above the solid's upper end only a ball's cap still matters: over the end's inside it is forbidden as
    // long as it dips below.
    const double end = solid.z_top - kTopSheet;
    if (z < end) return {z, Side::above};
    return {end, Side::below};
}

std::vector<Fibres> fibres(Context& context, const LayerSolid& solid, std::span<const FibreLevel> levels,
                           const CutterShape& cutter, Axis axis, std::span<const std::int32_t> lines) {
    if (!cutter.is_plain()) return revolved_fibres(context, solid, levels, cutter, axis, lines);
    return axis == Axis::x ? fibres_along<0, 1>(context, solid, levels, cutter, lines)
                           : fibres_along<1, 0>(context, solid, levels, cutter, lines);
}

Fibres fibres(Context& context, const LayerSolid& solid, const Loops& inside, const CutterShape& cutter,
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
    return fibres(context, overhang, {}, flat_cutter(radius), low - 1, axis, lines);
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
