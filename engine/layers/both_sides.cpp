#include "engine/layers/both_sides.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/layers/rules.h"

namespace slabwright {

namespace {

constexpr std::size_t kLevels = 1024;    // over the height
constexpr std::size_t kFeatures = 1024;  // heights of features, the weightiest
constexpr std::size_t kEnds = 128;       // heights at which most gaps end
constexpr double kFinestLevel = 0.02;    // mm
constexpr double kStep = 1e-4;           // of the air between solid and solid
constexpr double kLayerOfAir = 1e-3;     // of it: what one layer more must make
constexpr double kLayerOfBox = 3e-5;     // or that of the part's box, where that is more
constexpr double kThinFloor = 3;         // mm of wood that a boundary leaves over a recess: less is thin
constexpr double kShareOfEnds = 1e-3;    // of all gaps, that makes an end frequent

/// Calls f(gap) for what must be stabbed.
template <class F>
void each_gap(const AirGaps& gaps, double least, F&& f) {
    for (const std::vector<AirGap>& row : gaps.rows)
        for (const AirGap& gap : row)
            if (gap.has_floor && gap.high - gap.low > least) f(gap);
}

struct Weighted {
    std::int64_t weight = 0;
    Ticks z = 0;
};

void keep_weightiest(std::vector<Weighted>& heights, std::size_t most) {
    std::sort(heights.begin(), heights.end(), [](const Weighted& a, const Weighted& b) {
        return std::tie(b.weight, a.z) < std::tie(a.weight, b.z);
    });
    if (heights.size() > most) heights.resize(most);
}

/// Heights of flats that are floors or ceilings of many gaps.
std::vector<Weighted> frequent_ends(const LayerRules& rules, const AirGaps& gaps, double least) {
    const double height = rules.request().height, bin = std::max(kLeastGap, height / (1 << 20));
    struct Bin {
        std::int64_t count = 0;
        double sum = 0;
    };
    std::vector<Bin> bins(static_cast<std::size_t>(height / bin) + 2);
    std::int64_t all = 0;
    each_gap(gaps, least, [&](const AirGap& gap) {
        ++all;
        for (const double z : {gap.low, gap.high}) {
            Bin& b = bins[std::min(bins.size() - 1, static_cast<std::size_t>(std::max(0.0, z / bin)))];
            ++b.count;
            b.sum += z;
        }
    });
    std::vector<Weighted> ends;
    for (const Bin& b : bins)
        if (b.count > 0 && static_cast<double>(b.count) >= kShareOfEnds * static_cast<double>(all))
            ends.push_back({b.count, to_ticks(b.sum / static_cast<double>(b.count))});
    keep_weightiest(ends, kEnds);
    return ends;
}

/// All heights that may be boundaries, ascending, base and top among them.
std::vector<Ticks> candidate_heights(const LayerRules& rules, const AirGaps& gaps, double least) {
    const Ticks top = rules.height();
    std::vector<Weighted> own;
    for (const Level& l : rules.type1()) {
        own.push_back({l.weight, l.z});
        own.push_back({l.weight, rules.highest_below(l.z)});
    }
    for (const Level& l : rules.up_flats())
        own.push_back({l.weight, rules.highest_below(l.z) - to_ticks(0.01)});
    for (const Range& r : rules.type3()) {
        own.push_back({r.weight, r.low});
        own.push_back({r.weight, r.high});
    }
    keep_weightiest(own, kFeatures);
    const std::vector<Weighted> ends = frequent_ends(rules, gaps, least);
    own.insert(own.end(), ends.begin(), ends.end());
    std::vector<Ticks> heights{0, top};
    for (const Weighted& w : own)
        if (w.z > kSame && w.z < top - kSame) heights.push_back(w.z);
    // A whole number of levels to the tallest layer, so that whole columns of those can be built.
    const Ticks tallest = rules.max_layer();
    const Ticks aim = std::max(to_ticks(kFinestLevel), top / static_cast<Ticks>(kLevels));
    const Ticks step = std::max<Ticks>(kSame, tallest / std::max<Ticks>(1, tallest / aim));
    for (Ticks z = step; z < top - kSame; z += step) heights.push_back(z);
    std::sort(heights.begin(), heights.end());
    heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
    return heights;
}

/// Gaps by the candidates that stab them: those from `first` to the one before `beyond`. A layer from
/// candidate i to candidate b holds a gap whole exactly when i < first and b ≥ beyond.
struct Stabbed {
    std::uint32_t beyond = 0, first = 0;
    double mm3 = 0;
};

std::vector<Stabbed> stabbed_gaps(const std::vector<Ticks>& heights, const AirGaps& gaps, double least) {
    std::vector<double> mm;
    for (const Ticks z : heights) mm.push_back(static_cast<double>(z) / kTicksPerMm);
    const double area = gaps.grid.cell * gaps.grid.cell;
    std::vector<Stabbed> found;
    each_gap(gaps, least, [&](const AirGap& gap) {
        const auto first = std::lower_bound(mm.begin(), mm.end(), gap.low - kLeastGap),
                   beyond = std::upper_bound(mm.begin(), mm.end(), gap.high + kLeastGap);
        if (beyond == mm.end()) return;  // it ends at the top
        found.push_back({static_cast<std::uint32_t>(beyond - mm.begin()),
                         static_cast<std::uint32_t>(first - mm.begin()), (gap.high - gap.low) * area});
    });
    std::sort(found.begin(), found.end(), [](const Stabbed& a, const Stabbed& b) {
        return std::tie(a.beyond, b.first, a.mm3) < std::tie(b.beyond, a.first, b.mm3);
    });
    return found;
}

/// mm² of each candidate where a boundary there leaves a floor, over air that is milled from below, thinner
/// than it need be: the part goes on above it.
std::vector<double> thin_floors(const std::vector<Ticks>& heights, const AirGaps& gaps) {
    std::vector<double> change(heights.size() + 1, 0);
    const double mm2 = gaps.grid.cell * gaps.grid.cell;
    const auto first_over = [&](double mm) {
        return static_cast<std::size_t>(std::upper_bound(heights.begin(), heights.end(), to_ticks(mm)) -
                                        heights.begin());
    };
    for (const std::vector<AirGap>& row : gaps.rows) {
        std::uint32_t column = UINT32_MAX;
        double solid_top = gaps.top;  // over the gap; of a line's uppermost solid it is not known
        for (const AirGap& gap : row) {
            if (gap.column != column) column = gap.column, solid_top = gaps.top;
            const std::size_t from = first_over(gap.high + kLeastGap),
                              to = first_over(
                                  std::min(gap.high + kThinFloor - kLeastGap, solid_top - kLeastGap));
            if (from < to) change[from] += mm2, change[to] -= mm2;
            solid_top = gap.low;
        }
    }
    for (std::size_t i = 1; i < change.size(); ++i) change[i] += change[i - 1];
    change.pop_back();
    return change;
}

struct Cost {
    std::int64_t steps = 0;     ///< of air that stays
    std::int64_t thin_mm2 = 0;  ///< of floors that are thinner than they need be
    CostUnits rest;
    friend auto operator<=>(const Cost&, const Cost&) = default;
};

struct Way {
    bool reached = false;
    Cost cost;
    std::size_t before = 0;
};

class Search {
public:
    Search(const LayerRules& rules, const std::vector<Ticks>& heights, const std::vector<Stabbed>& gaps,
           const std::vector<double>& thin_mm2, const BothSidesWeights& weights)
        : rules_(rules),
          heights_(heights),
          gaps_(gaps),
          thin_mm2_(thin_mm2),
          step_(weights.step_mm3),
          layer_(weights.layer_mm3),
          ways_(heights.size()) {
        for (const Ticks z : heights) joints_.push_back(rules.joint(z));
        joints_.front() = joints_.back() = {};
    }

    /// The boundaries of the cheapest way up, without the base; none where no way is.
    std::vector<Ticks> run(Ticks thinnest) {
        std::fill(ways_.begin(), ways_.end(), Way{});
        ways_[0].reached = true;
        held_.assign(heights_.size(), 0);
        std::size_t first = 0, gap = 0;
        for (std::size_t b = 1; b < heights_.size(); ++b) {
            while (rules_.class_of(heights_[b] - heights_[first]) + 1 >= rules_.classes()) ++first;
            gap = hold(first, b, gap);
            for (std::size_t a = first; a < b && heights_[b] - heights_[a] >= thinnest; ++a)
                if (ways_[a].reached) try_layer(a, b);
        }
        std::vector<Ticks> tops;
        for (std::size_t i = heights_.size() - 1; ways_[i].reached && i > 0; i = ways_[i].before)
            tops.push_back(heights_[i]);
        std::reverse(tops.begin(), tops.end());
        return tops;
    }

private:
    // Adds the gaps that end just under candidate b to what layers from each candidate up to b hold.
    std::size_t hold(std::size_t first, std::size_t b, std::size_t gap) {
        double sum = 0;
        while (gap < gaps_.size() && gaps_[gap].beyond == b) {
            const std::size_t from = gaps_[gap].first;
            for (; gap < gaps_.size() && gaps_[gap].beyond == b && gaps_[gap].first == from; ++gap)
                sum += gaps_[gap].mm3;
            const std::size_t next = gap < gaps_.size() && gaps_[gap].beyond == b ? gaps_[gap].first : first;
            for (std::size_t i = std::max(first, next); i < from; ++i) held_[i] += sum;
        }
        return gap;
    }

    void try_layer(std::size_t a, std::size_t b) {
        const std::size_t c = rules_.class_of(heights_[b] - heights_[a]);
        Cost cost = ways_[a].cost;
        cost.steps += std::llround((held_[a] + layer_) / step_);
        if (ways_[b].reached && cost.steps > ways_[b].cost.steps) return;
        cost.thin_mm2 += std::llround(thin_mm2_[b]);
        cost.rest += rules_.class_cost(c);
        cost.rest += rules_.slab_joints_cost(heights_[a], c);
        cost.rest += joints_[b];
        // The lower candidate comes first, so ties go to the thicker layer.
        if (!ways_[b].reached || cost < ways_[b].cost) ways_[b] = {true, cost, a};
    }

    const LayerRules& rules_;
    const std::vector<Ticks>& heights_;
    const std::vector<Stabbed>& gaps_;
    const std::vector<double>& thin_mm2_;  // at each candidate
    double step_, layer_;
    std::vector<Way> ways_;
    std::vector<CostUnits> joints_;
    std::vector<double> held_;  // mm³ of gaps in a layer from each candidate up to the one looked at
};

}  // namespace

LayerPlacement place_layers_both_sides(const LayerRequest& request, const AirGaps& gaps,
                                       const BothSidesWeights& weights) {
    LayerRequest asked = request;
    std::erase_if(asked.features, [](const Feature& f) { return f.type == FeatureType::down_flat; });
    const LayerRules rules(asked);
    const std::vector<Ticks> heights = candidate_heights(rules, gaps, weights.filled_gap);
    const std::vector<Stabbed> stabbed = stabbed_gaps(heights, gaps, weights.filled_gap);
    double air = 0;
    for (const Stabbed& s : stabbed) air += s.mm3;
    BothSidesWeights weighed = weights;
    if (weighed.step_mm3 <= 0) weighed.step_mm3 = std::max(1.0, kStep * air);
    if (weighed.layer_mm3 <= 0) {
        const ColumnGrid& grid = gaps.grid;
        const double box =
            static_cast<double>(grid.rows * grid.columns) * grid.cell * grid.cell * request.height;
        weighed.layer_mm3 = std::max(kLayerOfAir * air, kLayerOfBox * box);
    }
    const std::vector<double> thin = thin_floors(heights, gaps);
    Search search(rules, heights, stabbed, thin, weighed);
    std::vector<Ticks> tops = search.run(to_ticks(request.min_layer) - kSame);
    if (tops.empty()) tops = search.run(1);
    LayerPlacement placement;
    Ticks below = 0;
    for (const Ticks z : tops) {
        const bool last = z == rules.height();
        placement.boundaries.push_back(
            {last ? request.height : static_cast<double>(z) / kTicksPerMm, 0, rules.describe(below, z)});
        below = z;
    }
    finish_placement(rules, placement);
    return placement;
}

}  // namespace slabwright
