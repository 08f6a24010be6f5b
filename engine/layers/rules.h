// A LayerRequest made ready for asking: what one boundary breaks, and what one layer costs. Internal to
// layers.
//
// Heights are counted in ticks (0.1 nm) and costs in whole units, so that sums, windows and comparisons are
// exact: the dynamic program, the comparison of two placements and layer_cost() then agree to the last digit.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/layers/layers.h"

namespace slabwright {

using Ticks = std::int64_t;
inline constexpr double kTicksPerMm = 1e7;
inline constexpr Ticks kSame = 1000;  ///< kSameHeight in ticks

[[nodiscard]] Ticks to_ticks(double mm);
/// Millimetres with up to three decimals, for words.
[[nodiscard]] std::string words_mm(double mm);

/// LayerCost in whole numbers: 0.001 mm², ticks of slab, 1e-9 of Q.
struct CostUnits {
    std::int64_t broken_type2 = 0, broken_type1 = 0, thin_layers = 0, exposed_glue = 0, broken_type3 = 0,
                 layers = 0, wood = 0, minus_q = 0;
    friend auto operator<=>(const CostUnits&, const CostUnits&) = default;
    CostUnits& operator+=(const CostUnits& o);
    friend CostUnits operator+(CostUnits a, const CostUnits& b) { return a += b; }
    [[nodiscard]] LayerCost in_mm() const;
};

/// A feature's height, what breaking it weighs, and which feature of the request it is.
struct Level {
    Ticks z = 0;
    std::int64_t weight = 0;
    std::size_t feature = 0;
};
struct Range {
    Ticks low = 0, high = 0;
    std::int64_t weight = 0;
    std::size_t feature = 0;
};

class LayerRules {
public:
    /// @throws Error(usage, "layers.request") for a request that no placement can answer
    explicit LayerRules(const LayerRequest& request);

    [[nodiscard]] const LayerRequest& request() const { return request_; }
    [[nodiscard]] Ticks height() const { return height_; }
    [[nodiscard]] Ticks max_layer() const { return max_layer_; }
    /// Of the stock; 0 where none is named.
    [[nodiscard]] Ticks thickest_slab() const { return thickest_; }
    /// MTmin above a boundary at z.
    [[nodiscard]] Ticks min_material(Ticks z) const;
    /// The highest boundary under a feature at h that leaves MTmin below it, or near enough to that.
    [[nodiscard]] Ticks highest_below(Ticks h) const;
    [[nodiscard]] const std::vector<Level>& type1() const { return type1_; }  ///< ascending
    [[nodiscard]] const std::vector<Level>& type2() const {
        return type2_;
    }  ///< ascending, equal heights merged
    [[nodiscard]] const std::vector<Range>& type3() const { return type3_; }  ///< ascending by low, then high
    [[nodiscard]] const std::vector<Level>& up_flats() const { return up_flats_; }  ///< ascending

    /// What a boundary (a glue joint) at z breaks, without Q.
    [[nodiscard]] CostUnits joint(Ticks z) const;
    /// −Q of a joint: DT relative to MTmin, A relative to the largest section.
    [[nodiscard]] std::int64_t minus_q(Ticks z) const;
    /// Q as printed, per inch and per square inch.
    [[nodiscard]] double printed_q(Ticks z) const;

    /// Thickness classes: within one class every layer costs the same. Classes ascend with thickness; the
    /// last stands for all that is thicker than max_layer.
    [[nodiscard]] std::size_t classes() const { return class_costs_.size(); }
    [[nodiscard]] std::size_t class_of(Ticks thickness) const;
    /// Cost of a layer of that class, Type II heights apart. @pre not the last class
    [[nodiscard]] const CostUnits& class_cost(std::size_t c) const { return class_costs_[c]; }
    /// Type II and the joints between its slabs included, any thickness.
    [[nodiscard]] CostUnits layer(Ticks bottom, Ticks top) const;
    /// The joints between the slabs that are bonded into a layer, upwards; what lies above its top is faced
    /// off. None where one slab does.
    [[nodiscard]] std::vector<Ticks> slab_joints(Ticks bottom, Ticks top) const;
    /// What those joints break, of a layer of that class with this bottom; nothing for most.
    [[nodiscard]] CostUnits slab_joints_cost(Ticks bottom, std::size_t c) const;
    [[nodiscard]] double slab_for(
        double thickness_mm) const;  ///< several of the thickest, where one does not do

    [[nodiscard]] CostUnits cost(const std::vector<double>& tops) const;
    [[nodiscard]] std::vector<Diagnostic> diagnose(const std::vector<double>& tops) const;
    /// Why a boundary lies there, as far as its height tells.
    [[nodiscard]] std::string describe(Ticks below, Ticks z) const;
    /// "5.08 mm below the peak at 16.51 mm", for a Type I level.
    [[nodiscard]] std::string below_words(Ticks z, const Level& level) const;

private:
    [[nodiscard]] double section_area(Ticks z) const;
    [[nodiscard]] Ticks above(Ticks z) const;  ///< distance up to the next Type I feature
    void diagnose_joint(Ticks z, bool inner, std::vector<Diagnostic>& found) const;
    void diagnose_slabs(Ticks bottom, Ticks top, std::vector<Diagnostic>& found) const;

    const LayerRequest& request_;
    Ticks height_ = 0, max_layer_ = 0, min_layer_ = 0, min_material_ = 0, thickest_ = 0;
    std::vector<Level> type1_, type2_, up_flats_;
    std::vector<Range> type3_;
    std::vector<std::int64_t> type1_sums_, type2_sums_, up_flat_sums_;  // of weights, one more than levels
    std::vector<std::pair<Ticks, std::int64_t>> lows_,
        highs_;                        // of Type III: end, sum of weights up to and with it
    std::vector<Ticks> class_limits_;  // thickest layer of each class but the last
    std::vector<CostUnits> class_costs_;
    std::vector<std::vector<Ticks>>
        class_joints_;  // between the slabs of a class's layers, from their bottom
    mutable double largest_section_ = -1;
    mutable std::unordered_map<Ticks, double> areas_;
};

/// Fills slabs, cost and diagnostics of a placement from its boundaries' heights.
void finish_placement(const LayerRules& rules, LayerPlacement& placement);

/// Print's placement on rules that are made already.
[[nodiscard]] LayerPlacement place_printed(const LayerRules& rules);

}  // namespace slabwright
