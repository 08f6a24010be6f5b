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

// Free stretches line by line, and the ways from each to those of the next line.
class Stretches {
public:
    Stretches(std::span<const std::int32_t> line_y, const std::vector<std::vector<Stretch>>& free,
              const std::function<Fibres(std::span<const std::int32_t>)>& links)
        : line_y_(line_y) {
        std::vector<std::size_t> first(line_y_.size() + 1, 0);
        for (std::size_t i = 0; i < line_y_.size(); ++i) {
            first[i] = nodes_.size();
            for (const Stretch& s : free[i]) {
                // Rounded inwards: a unit outside a free stretch is not free.
                const auto low = static_cast<std::int32_t>(std::ceil(s.low * kUnitsPerMm)),
                           high = static_cast<std::int32_t>(std::floor(s.high * kUnitsPerMm));
                if (low < high) nodes_.push_back({i, low, high});
            }
        }
        first[line_y_.size()] = nodes_.size();

        std::vector<std::int32_t> at;
        for (std::size_t i = 0; i + 1 < line_y_.size(); ++i)
            for (std::size_t a = first[i]; a < first[i + 1]; ++a)
                for (std::size_t b = first[i + 1]; b < first[i + 2]; ++b) {
                    const std::int32_t low = std::max(nodes_[a].low, nodes_[b].low),
                                       high = std::min(nodes_[a].high, nodes_[b].high);
                    if (low > high) continue;
                    pairs_.push_back({a, b, low, high});
                    at.insert(at.end(), {low, high});
                }
        std::sort(at.begin(), at.end());
        at.erase(std::unique(at.begin(), at.end()), at.end());
        const Fibres across = links(at);
        auto is_free = [&](std::int32_t x, std::size_t line) {
            const std::size_t k =
                static_cast<std::size_t>(std::lower_bound(at.begin(), at.end(), x) - at.begin());
            const double y0 = to_mm(line_y_[line]), y1 = to_mm(line_y_[line + 1]);
            for (const Forbidden& f : across.line(k))
                if (f.low < y1 - 1e-4 && f.high > y0 + 1e-4) return false;
            return true;
        };
        for (Link& l : pairs_) {
            l.low_free = is_free(l.x_low, nodes_[l.a].line);
            l.high_free = is_free(l.x_high, nodes_[l.a].line);
        }
        // Links by their lower stretch; the pairs_ are already in that order.
        of_.assign(nodes_.size() + 1, 0);
        for (const Link& l : pairs_) ++of_[l.a + 1];
        for (std::size_t k = 1; k < of_.size(); ++k) of_[k] += of_[k - 1];
    }

    // The chains that cut all stretches, at height z. @param outside_low, outside_high of the stock with the
    // cutter's radius, along the lines
    std::vector<std::vector<PathPoint>> chains(std::int32_t z, std::int32_t outside_low,
                                               std::int32_t outside_high) {
        std::vector<std::vector<PathPoint>> chains;
        for (std::size_t begin = 0; begin < nodes_.size(); ++begin) {
            if (nodes_[begin].done) continue;
            std::size_t n = begin;
            std::vector<PathPoint> chain;
            auto go = [&](std::int32_t x) {
                const PathPoint p{x, line_y_[nodes_[n].line], z};
                if (chain.empty() || !(chain.back() == p)) chain.push_back(p);
            };
            bool upward = nodes_[n].low <= outside_low || nodes_[n].high < outside_high;  // along x
            go(upward ? nodes_[n].low : nodes_[n].high);
            for (;;) {
                nodes_[n].done = true;
                go(upward ? nodes_[n].high : nodes_[n].low);
                const Way way = nearest_way(n, chain.back().x);
                if (!way.link) break;
                go(way.x);
                n = way.link->b;
                go(way.x);
                // From here to the nearer end first, then all the way to the other.
                upward = std::abs(std::int64_t{way.x} - nodes_[n].low) <=
                         std::abs(std::int64_t{nodes_[n].high} - way.x);
                go(upward ? nodes_[n].low : nodes_[n].high);
            }
            chains.push_back(std::move(chain));
        }
        return chains;
    }

private:
    struct Way {
        const Link* link = nullptr;
        std::int32_t x = 0;
        std::int64_t length = 0;
    };
    // The nearest free way from x on a stretch to an uncut one of the next line.
    [[nodiscard]] Way nearest_way(std::size_t n, std::int32_t from) const {
        Way best;
        for (std::size_t k = of_[n]; k < of_[n + 1]; ++k) {
            const Link& l = pairs_[k];
            const Node& to = nodes_[l.b];
            if (to.done) continue;
            for (const bool high : {true, false}) {
                if (!(high ? l.high_free : l.low_free)) continue;
                const std::int32_t x = high ? l.x_high : l.x_low;
                const std::int64_t way =
                    std::abs(std::int64_t{x} - from) +
                    std::min(std::abs(std::int64_t{x} - to.low), std::abs(std::int64_t{x} - to.high));
                if (!best.link || way < best.length) best = {&l, x, way};
            }
        }
        return best;
    }

    std::span<const std::int32_t> line_y_;
    std::vector<Node> nodes_;
    std::vector<Link> pairs_;
    std::vector<std::size_t> of_;  // by stretch where its links begin
};

}  // namespace

void zigzag(PathBuilder& path, const LayerCut& cut, const Tool& tool, std::span<const std::int32_t> line_y,
            const std::vector<std::vector<Stretch>>& free, double tip_z,
            const std::function<Fibres(std::span<const std::int32_t>)>& links) {
    const auto outside_low = to_units(cut.layer.stock_min[0] - tool.diameter / 2),
               outside_high = to_units(cut.layer.stock_max[0] + tool.diameter / 2);
    auto outside = [&](Point2 p) { return p.x <= outside_low || p.x >= outside_high; };
    std::vector<std::vector<PathPoint>> chains =
        Stretches(line_y, free, links).chains(to_units(tip_z), outside_low, outside_high);
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
