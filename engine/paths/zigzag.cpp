// Zigzag clearing of free stretches on parallel lines.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/paths/layer_cut.h"

namespace slabwright {

namespace {

struct Node {
    std::size_t line = 0;
    std::int32_t low = 0, high = 0;
    bool done = false;
};

// Two stretches on neighbouring lines, and the x at which the tool may pass from one to the other.
struct Link {
    std::size_t a = 0, b = 0;
    std::int32_t x_low = 0, x_high = 0;
    bool low_free = false, high_free = false;
};

}  // namespace

void zigzag(PathBuilder& path, const LayerCut& cut, const Tool& tool, std::span<const std::int32_t> line_y,
            const std::vector<std::vector<Stretch>>& free, double tip_z, double above_z,
            const std::function<Fibres(std::span<const std::int32_t>)>& links) {
    std::vector<Node> nodes;
    std::vector<std::size_t> first(line_y.size() + 1, 0);
    for (std::size_t i = 0; i < line_y.size(); ++i) {
        first[i] = nodes.size();
        for (const Stretch& s : free[i]) {
            // Rounded inwards: a unit outside a free stretch is not free.
            const auto low = static_cast<std::int32_t>(std::ceil(s.low * kUnitsPerMm)),
                       high = static_cast<std::int32_t>(std::floor(s.high * kUnitsPerMm));
            if (low < high) nodes.push_back({i, low, high});
        }
    }
    first[line_y.size()] = nodes.size();

    std::vector<Link> pairs;
    std::vector<std::int32_t> at;
    for (std::size_t i = 0; i + 1 < line_y.size(); ++i)
        for (std::size_t a = first[i]; a < first[i + 1]; ++a)
            for (std::size_t b = first[i + 1]; b < first[i + 2]; ++b) {
                const std::int32_t low = std::max(nodes[a].low, nodes[b].low), high = std::min(nodes[a].high, nodes[b].high);
                if (low > high) continue;
                pairs.push_back({a, b, low, high});
                at.insert(at.end(), {low, high});
            }
    std::sort(at.begin(), at.end());
    at.erase(std::unique(at.begin(), at.end()), at.end());
    const Fibres across = links(at);
    auto is_free = [&](std::int32_t x, std::size_t line) {
        const std::size_t k = static_cast<std::size_t>(std::lower_bound(at.begin(), at.end(), x) - at.begin());
        const double y0 = to_mm(line_y[line]), y1 = to_mm(line_y[line + 1]);
        for (const Forbidden& f : across.line(k))
            if (f.low < y1 - 1e-4 && f.high > y0 + 1e-4) return false;
        return true;
    };
    for (Link& l : pairs) {
        l.low_free = is_free(l.x_low, nodes[l.a].line);
        l.high_free = is_free(l.x_high, nodes[l.a].line);
    }
    // Links by their lower stretch; the pairs are already in that order.
    std::vector<std::size_t> of(nodes.size() + 1, 0);
    for (const Link& l : pairs) ++of[l.a + 1];
    for (std::size_t k = 1; k < of.size(); ++k) of[k] += of[k - 1];

    const std::int32_t z = to_units(tip_z), above = to_units(above_z);
    const double slope = std::tan(cut.job.cutting.ramp_deg * std::numbers::pi / 180);
    const auto outside_low = to_units(cut.layer.stock_min[0] - tool.diameter / 2),
               outside_high = to_units(cut.layer.stock_max[0] + tool.diameter / 2);

    auto enter = [&](const Node& n, bool from_low) {
        const std::int32_t y = line_y[n.line], start = from_low ? n.low : n.high, end = from_low ? n.high : n.low;
        path.go_above({start, y});
        if (start <= outside_low || start >= outside_high) {
            path.sink(z);
            return;
        }
        path.sink(above);
        // Down the slope to and fro along the stretch, to end at its start again.
        const double drop = static_cast<double>(above) - z,
                     length = std::min(std::abs(static_cast<double>(end) - start), 2.0 * tool.diameter * kUnitsPerMm);
        if (drop <= 0 || length <= 0) return path.plunge(z);
        const auto legs = std::max<long>(2, 2 * static_cast<long>(std::ceil(drop / (length * slope) / 2)));
        const double leg = std::min(length, drop / slope / static_cast<double>(legs) + 1);
        for (long k = 1; k <= legs; ++k) {
            const std::int32_t x = k % 2 ? start + static_cast<std::int32_t>((end > start ? 1 : -1) * leg) : start;
            path.cut({x, y}, k == legs ? z : above - static_cast<std::int32_t>(drop * static_cast<double>(k) / static_cast<double>(legs)));
        }
    };

    for (std::size_t begin = 0; begin < nodes.size(); ++begin) {
        if (nodes[begin].done) continue;
        std::size_t n = begin;
        bool upward = true;  // along x
        if (nodes[n].low > outside_low && nodes[n].high >= outside_high) upward = false;
        enter(nodes[n], upward);
        for (;;) {
            nodes[n].done = true;
            path.cut({upward ? nodes[n].high : nodes[n].low, line_y[nodes[n].line]}, z);
            // The nearest free way to an uncut stretch of the next line.
            const Link* best = nullptr;
            std::int32_t best_x = 0;
            std::int64_t best_way = 0;
            for (std::size_t k = of[n]; k < of[n + 1]; ++k) {
                const Link& l = pairs[k];
                if (nodes[l.b].done) continue;
                for (const bool high : {true, false}) {
                    if (!(high ? l.high_free : l.low_free)) continue;
                    const std::int32_t x = high ? l.x_high : l.x_low;
                    const std::int64_t way = std::abs(std::int64_t{x} - path.at().x) +
                                             std::min(std::abs(std::int64_t{x} - nodes[l.b].low), std::abs(std::int64_t{x} - nodes[l.b].high));
                    if (!best || way < best_way) best = &l, best_x = x, best_way = way;
                }
            }
            if (!best) break;
            path.cut({best_x, line_y[nodes[n].line]}, z);
            n = best->b;
            path.cut({best_x, line_y[nodes[n].line]}, z);
            // From here to the nearer end first, then all the way to the other.
            const bool low_nearer = std::abs(std::int64_t{best_x} - nodes[n].low) <= std::abs(std::int64_t{nodes[n].high} - best_x);
            path.cut({low_nearer ? nodes[n].low : nodes[n].high, line_y[nodes[n].line]}, z);
            upward = low_nearer;
        }
        path.retract();
    }
}

}  // namespace slabwright
