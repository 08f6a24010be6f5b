// Print's placement (LUO 4.2.4–4.2.5): bottom-up, each boundary as high as it may be, non-deposition regions
// of Type I features avoided, down-facing flats met, shallow ranges avoided where that costs nothing.
// Corrections: METHOD.md section 4.
//
// Print searches the boundaries inside a tall region by branch and bound. Fewest boundaries first and the
// largest sum of Q among those is a shortest path over the candidates, so a dynamic program with a sliding
// window finds the same optimum in linear time; branch and bound takes exponential time on a relief with
// thousands of peaks.
#include <algorithm>
#include <deque>
#include <map>

#include "engine/layers/rules.h"

namespace slabwright {

namespace {

struct Region {
    Ticks low = 0, high = 0;
    std::size_t first = 0, last = 0;  // the Type I levels it was merged from
    [[nodiscard]] bool holds(Ticks z) const { return z > low + kSame && z < high - kSame; }
};

// Regions (h − MTmin, h), cut at the base, overlapping ones merged, and split where a Type II height lies
// inside.
std::vector<Region> non_deposition_regions(const LayerRules& rules) {
    std::vector<Region> merged;
    const auto& levels = rules.type1();
    for (std::size_t i = 0; i < levels.size(); ++i) {
        const Ticks low = std::max<Ticks>(0, rules.highest_below(levels[i].z)), high = levels[i].z;
        if (high - low <= kSame) continue;
        // Features ascend, but where MTmin rises with height a later region may begin under an earlier one.
        while (merged.size() > 1 && low < merged[merged.size() - 2].high - kSame) {
            merged[merged.size() - 2].last = merged.back().last;
            merged.pop_back();
        }
        if (!merged.empty() && low < merged.back().high - kSame) {
            merged.back().low = std::min(merged.back().low, low);
            merged.back().high = high;
            merged.back().last = i + 1;
        } else merged.push_back({low, high, i, i + 1});
    }
    std::vector<Region> regions;
    for (Region r : merged) {
        for (const Level& flat : rules.type2()) {
            if (!r.holds(flat.z)) continue;
            Region lower = r;
            lower.high = r.low = flat.z;
            regions.push_back(lower);
        }
        regions.push_back(r);
    }
    return regions;
}

const Region* region_around(const std::vector<Region>& regions, Ticks z) {
    auto it = std::upper_bound(regions.begin(), regions.end(), z,
                               [](Ticks t, const Region& r) { return t < r.low; });
    return it != regions.begin() && std::prev(it)->holds(z) ? &*std::prev(it) : nullptr;
}

// Shallow ranges that overlap count as one: its heights are no better for being shallow twice.
std::vector<Region> shallow_ranges(const LayerRules& rules) {
    std::vector<Region> ranges;
    for (const Range& r : rules.type3()) {
        if (!ranges.empty() && r.low < ranges.back().high - kSame)
            ranges.back().high = std::max(ranges.back().high, r.high);
        else ranges.push_back({r.low, r.high, 0, 0});
    }
    return ranges;
}

// Boundaries inside a region taller than a layer, ascending: from its lower end on, none further apart than a
// layer, the last near enough to `next`, the next height that must be a boundary; or, where that is too far,
// to the region's upper end, from where more layers lead to `next` and are counted. Fewest layers first, then
// the largest sum of Q.
std::vector<Ticks> boundaries_within(const LayerRules& rules, const Region& region, Ticks next) {
    const Ticks step = rules.max_layer();
    std::vector<Ticks> wanted{region.low};
    for (std::size_t i = region.first; i < region.last; ++i) {
        const Ticks z = rules.highest_below(rules.type1()[i].z);
        if (region.holds(z)) wanted.push_back(z);
    }
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    // Where features leave a gap that no layer bridges (MTmin over LTmax), full layers fill it.
    std::vector<Ticks> candidates;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        candidates.push_back(wanted[i]);
        const Ticks end = i + 1 < wanted.size() ? wanted[i + 1] : region.high;
        while (end - candidates.back() > step + kSame) candidates.push_back(candidates.back() + step);
    }
    struct Best {
        std::int64_t count = 0, minus_q = 0;
        auto operator<=>(const Best&) const = default;
    };
    std::vector<Best> best(candidates.size());
    std::vector<std::size_t> before(candidates.size(), 0);
    std::deque<std::size_t> window;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        if (i > 0) {
            while (candidates[i] - candidates[window.front()] > step + kSame) window.pop_front();
            before[i] = window.front();
            const double q = std::clamp(rules.printed_q(candidates[i]), -1e6, 1e6);
            best[i] = {best[before[i]].count + 1,
                       best[before[i]].minus_q - static_cast<std::int64_t>(q * 1e6)};
        }
        while (!window.empty() && best[window.back()] > best[i]) window.pop_back();
        window.push_back(i);
    }
    std::size_t end = candidates.size();
    Best least;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        Best total = best[i];
        if (next - candidates[i] > step + kSame) {
            if (candidates[i] + step < region.high - kSame) continue;
            total.count += (next - candidates[i] - kSame + step - 1) / step - 1;
        }
        if (end == candidates.size() || total < least) {
            least = total;
            end = i;
        }
    }
    std::vector<Ticks> chosen;
    for (std::size_t i = end;; i = before[i]) {
        chosen.push_back(candidates[i]);
        if (i == 0) break;
    }
    std::reverse(chosen.begin(), chosen.end());
    return chosen;
}

}  // namespace

LayerPlacement place_printed(const LayerRules& rules) {
    const Ticks top = rules.height(), step = rules.max_layer();
    const std::vector<Region> regions = non_deposition_regions(rules), shallow = shallow_ranges(rules);
    auto tall = [&](const Region& r) { return r.high - r.low > step + kSame; };

    // Data Set II: heights that must be boundaries, and why.
    std::map<Ticks, std::string> mandatory;
    for (const Level& flat : rules.type2()) mandatory.emplace(flat.z, rules.describe(flat.z, flat.z));
    std::vector<Ticks> fixed;
    for (const Level& flat : rules.type2()) fixed.push_back(flat.z);
    for (const Region& r : regions)
        if (tall(r) && r.low > 0) fixed.push_back(r.low);
    fixed.push_back(top);
    std::sort(fixed.begin(), fixed.end());
    for (const Region& r : regions) {
        if (!tall(r)) continue;
        const Ticks next = *std::lower_bound(fixed.begin(), fixed.end(), std::min(top, r.high - kSame));
        for (const Ticks z : boundaries_within(rules, r, next)) {
            if (z <= kSame || z >= top - kSame) continue;
            mandatory.emplace(z, rules.describe(z, z) + ", in a region of features taller than a layer");
        }
    }

    LayerPlacement placement;
    auto place = [&](Ticks z, std::string reason) {
        placement.boundaries.push_back({static_cast<double>(z) / kTicksPerMm, 0, std::move(reason)});
    };
    for (Ticks below = 0;;) {
        Ticks z = below + step;
        std::string reason;
        const auto must = mandatory.upper_bound(below + kSame);
        if (must != mandatory.end() && must->first <= z + kSame) {
            z = must->first;
            reason = must->second;
        } else if (z >= top - kSame) break;
        else if (const Region* r = region_around(regions, z)) {
            // A lower end at or under the layer below would never end: then the height stays, and the
            // diagnostics tell.
            if (r->low > below + kSame) {
                z = r->low;
                reason = rules.below_words(z, rules.type1()[r->first]);
                if (z != rules.highest_below(rules.type1()[r->first].z)) reason = rules.describe(below, z);
            } else reason = rules.describe(below, z);
        } else {
            if (const Region* range = region_around(shallow, z))
                if (range->low >= below + std::max(rules.min_material(below), kSame + 1) &&
                    !region_around(regions, range->low))
                    z = range->low;
            reason = rules.describe(below, z);
        }
        place(z, std::move(reason));
        below = z;
    }
    // The top is the request's own number, not its ticks.
    placement.boundaries.push_back({rules.request().height, 0, rules.describe(top, top)});
    finish_placement(rules, placement);
    return placement;
}

LayerPlacement place_layers_printed(const LayerRequest& request) {
    return place_printed(LayerRules(request));
}

}  // namespace slabwright
