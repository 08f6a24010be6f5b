// The best placement over a finite set of heights, by dynamic programming.
//
// Cost is a sum over joints (what a boundary breaks) and over layers (one more layer, thin or not, its slab).
// A layer's cost depends on its thickness only, by classes, and on where the joints between its slabs lie,
// which is counted from its bottom: so the best predecessor of a boundary is the cheapest one, those joints
// included, in each of a few windows that slide upwards with it, and the whole search is linear in the number
// of candidates. No layer may pass a Type II height, since meeting them all is always possible and comes
// first.
//
// Q comes last, and its section areas are dear. So the search runs without Q first, from below and from
// above; the candidates through which some cheapest placement runs are searched again with it.
#include <algorithm>
#include <deque>

#include "engine/layers/rules.h"

namespace slabwright {

namespace {

struct Candidate {
    Ticks z = 0;
    CostUnits joint;
};

struct Search {
    std::vector<CostUnits> cost;      // cheapest way from the first candidate to each
    std::vector<std::size_t> before;  // the boundary below it on that way
    std::vector<std::uint8_t> reached;
};

enum class From : std::uint8_t { below, above };

// Candidates ascend, the first is where layers start, the last where they end; `stops` are Type II heights,
// ascending. From above all of these are depths under the pattern's top.
Search search(const LayerRules& rules, const std::vector<Candidate>& candidates,
              const std::vector<Ticks>& stops, From from) {
    const std::size_t n = candidates.size(), classes = rules.classes() - 1;
    Search s{std::vector<CostUnits>(n), std::vector<std::size_t>(n, 0), std::vector<std::uint8_t>(n, 0)};
    s.reached[0] = 1;
    // Window c holds the candidates under b whose layer up to b is of class c: [begins[c], begins[c − 1]).
    std::vector<std::size_t> begins(classes, 0), pushed(classes, 0);
    struct Entry {
        std::size_t at;
        CostUnits cost;
    };
    std::vector<std::deque<Entry>> windows(classes);
    std::size_t stop = 0, first = 0;  // no layer begins under `first`: it would pass a stop
    for (std::size_t b = 1; b < n; ++b) {
        while (stop < stops.size() && stops[stop] < candidates[b].z - kSame) {
            while (candidates[first].z < stops[stop] - kSame) ++first;
            ++stop;
        }
        for (std::size_t c = 0; c < classes; ++c) {
            const std::size_t end = c == 0 ? b : begins[c - 1];
            while (begins[c] < b && rules.class_of(candidates[b].z - candidates[begins[c]].z) > c)
                ++begins[c];
            auto& window = windows[c];
            for (std::size_t a = std::max(pushed[c], begins[c]); a < end; ++a) {
                if (!s.reached[a]) continue;
                CostUnits cost = s.cost[a];
                if (from == From::below) cost += rules.slab_joints_cost(candidates[a].z, c);
                // Equal costs keep the lower candidate in front, so ties go to the thicker layer.
                while (!window.empty() && window.back().cost > cost) window.pop_back();
                window.push_back({a, cost});
            }
            pushed[c] = std::max(pushed[c], end);
            while (!window.empty() && window.front().at < std::max(begins[c], first)) window.pop_front();
            if (window.empty()) continue;
            CostUnits total = window.front().cost + rules.class_cost(c) + candidates[b].joint;
            if (from == From::above) total += rules.slab_joints_cost(rules.height() - candidates[b].z, c);
            if (s.reached[b] && !(total < s.cost[b])) continue;
            s.reached[b] = 1;
            s.cost[b] = total;
            s.before[b] = window.front().at;
        }
    }
    return s;
}

// All heights that may be boundaries, ascending, without base and top.
std::vector<Ticks> candidate_heights(const LayerRules& rules, const LayerPlacement& printed) {
    const Ticks top = rules.height(), step = rules.max_layer();
    std::vector<Ticks> heights;
    auto add = [&](Ticks z) {
        if (z > kSame && z < top - kSame) heights.push_back(z);
    };
    for (const Level& l : rules.type1()) {
        add(l.z);
        add(rules.highest_below(l.z));
    }
    // Glue counts as exposed up to and with MTmin under a flat, so a boundary 0.01 mm lower exposes none.
    for (const Level& l : rules.up_flats())
        add(rules.highest_below(l.z) - static_cast<Ticks>(0.01 * kTicksPerMm));
    for (const Range& r : rules.type3()) {
        add(r.low);
        add(r.high);
    }
    // Where slabs are bonded, a joint between two may lie at such a height as well: then the layer begins
    // whole slabs lower.
    const Ticks slab = rules.thickest_slab();
    if (slab > 0 && step > slab)
        for (std::size_t i = 0, own = heights.size(); i < own; ++i)
            for (Ticks z = heights[i] - slab; z > kSame && heights[i] - z < step; z -= slab) add(z);
    std::sort(heights.begin(), heights.end());
    heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
    // Closed under + LTmax: whole columns from the base, from Type II heights and from print's boundaries,
    // which make sure that every stretch can be crossed; from the others as far up as keeps the set within
    // bounds.
    constexpr std::size_t most = 1'000'000;
    const std::size_t own = heights.size();
    std::size_t levels = own == 0 ? 0 : most / own;
    for (std::size_t i = 0; i < own; ++i) {
        Ticks z = heights[i];
        for (std::size_t k = 0; k < levels && z < top; ++k) add(z += step);
    }
    auto column = [&](Ticks z) {
        for (add(z); z < top; add(z)) z += step;
    };
    column(0);
    for (const Level& l : rules.type2()) column(l.z);
    for (const Boundary& b : printed.boundaries) add(to_ticks(b.z));
    std::sort(heights.begin(), heights.end());
    heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
    return heights;
}

// The boundaries of the cheapest way through the candidates, base left out.
std::vector<Ticks> way(const Search& s, const std::vector<Candidate>& candidates) {
    std::vector<Ticks> heights;
    for (std::size_t i = candidates.size() - 1; i > 0; i = s.before[i]) heights.push_back(candidates[i].z);
    std::reverse(heights.begin(), heights.end());
    return heights;
}

}  // namespace

LayerPlacement place_layers_optimal(const LayerRequest& request) {
    const LayerRules rules(request);
    LayerPlacement printed = place_printed(rules);
    const Ticks top = rules.height();

    std::vector<Candidate> candidates{{0, {}}};
    for (const Ticks z : candidate_heights(rules, printed)) candidates.push_back({z, rules.joint(z)});
    candidates.push_back({top, {}});
    std::vector<Ticks> stops, stops_from_above;
    for (const Level& l : rules.type2()) stops.push_back(l.z);
    for (auto it = stops.rbegin(); it != stops.rend(); ++it) stops_from_above.push_back(top - *it);

    const Search up = search(rules, candidates, stops, From::below);
    if (!up.reached.back()) return printed;
    std::vector<Candidate> from_above(candidates.rbegin(), candidates.rend());
    for (Candidate& c : from_above) c.z = top - c.z;
    const Search down = search(rules, from_above, stops_from_above, From::above);
    std::vector<Candidate> tied;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        const std::size_t j = candidates.size() - 1 - i;
        if (!up.reached[i] || !down.reached[j]) continue;
        if (up.cost[i] + down.cost[j] != up.cost.back() + candidates[i].joint)
            continue;  // both ways counted the joint
        tied.push_back(candidates[i]);
        if (i > 0 && i + 1 < candidates.size()) tied.back().joint.minus_q = rules.minus_q(candidates[i].z);
    }
    const Search last = search(rules, tied, stops, From::below);

    LayerPlacement placement;
    Ticks below = 0;
    for (const Ticks z : way(last, tied)) {
        placement.boundaries.push_back(
            {z == top ? request.height : static_cast<double>(z) / kTicksPerMm, 0, rules.describe(below, z)});
        below = z;
    }
    finish_placement(rules, placement);
    return printed.cost < placement.cost ? printed : placement;
}

}  // namespace slabwright
