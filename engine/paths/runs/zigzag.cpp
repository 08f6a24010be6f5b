// Zigzag clearing of free stretches on parallel lines.
#include "engine/paths/runs/zigzag.h"

#include <algorithm>
#include <cmath>

#include "engine/moves/order.h"
#include "engine/paths/runs/layer_cut.h"

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
            const std::vector<std::vector<Stretch>>& free, double tip_z,
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
                const std::int32_t low = std::max(nodes[a].low, nodes[b].low),
                                   high = std::min(nodes[a].high, nodes[b].high);
                if (low > high) continue;
                pairs.push_back({a, b, low, high});
                at.insert(at.end(), {low, high});
            }
    std::sort(at.begin(), at.end());
    at.erase(std::unique(at.begin(), at.end()), at.end());
    const Fibres across = links(at);
    auto is_free = [&](std::int32_t x, std::size_t line) {
        const std::size_t k =
            static_cast<std::size_t>(std::lower_bound(at.begin(), at.end(), x) - at.begin());
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

    const std::int32_t z = to_units(tip_z);
    const auto outside_low = to_units(cut.layer.stock_min[0] - tool.diameter / 2),
               outside_high = to_units(cut.layer.stock_max[0] + tool.diameter / 2);
    auto outside = [&](Point2 p) { return p.x <= outside_low || p.x >= outside_high; };

    std::vector<std::vector<PathPoint>> chains;
    for (std::size_t begin = 0; begin < nodes.size(); ++begin) {
        if (nodes[begin].done) continue;
        std::size_t n = begin;
        std::vector<PathPoint> chain;
        auto go = [&](std::int32_t x) {
            const PathPoint p{x, line_y[nodes[n].line], z};
            if (chain.empty() || !(chain.back() == p)) chain.push_back(p);
        };
        bool upward = nodes[n].low <= outside_low || nodes[n].high < outside_high;  // along x
        go(upward ? nodes[n].low : nodes[n].high);
        for (;;) {
            nodes[n].done = true;
            go(upward ? nodes[n].high : nodes[n].low);
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
                    const std::int64_t way = std::abs(std::int64_t{x} - chain.back().x) +
                                             std::min(std::abs(std::int64_t{x} - nodes[l.b].low),
                                                      std::abs(std::int64_t{x} - nodes[l.b].high));
                    if (!best || way < best_way) best = &l, best_x = x, best_way = way;
                }
            }
            if (!best) break;
            go(best_x);
            n = best->b;
            go(best_x);
            // From here to the nearer end first, then all the way to the other.
            upward = std::abs(std::int64_t{best_x} - nodes[n].low) <=
                     std::abs(std::int64_t{nodes[n].high} - best_x);
            go(upward ? nodes[n].low : nodes[n].high);
        }
        chains.push_back(std::move(chain));
    }
    // Either way round, but from outside the stock where one end lies there.
    std::vector<Beginning> beginnings;
    for (std::uint32_t k = 0; k < chains.size(); ++k) {
        const Point2 a{chains[k].front().x, chains[k].front().y}, b{chains[k].back().x, chains[k].back().y};
        if (outside(a) || !outside(b)) beginnings.push_back({a, b, k, 0});
        if (outside(b) || !outside(a)) beginnings.push_back({b, a, k, 1});
    }
    for (const Beginning& next : nearest_order(std::move(beginnings), chains.size(), path.at())) {
        if (next.place == 1) std::reverse(chains[next.run].begin(), chains[next.run].end());
        path.follow(chains[next.run]);
    }
}

}  // namespace slabwright
