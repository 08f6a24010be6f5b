// Where one layer ends and the next begins (LUO 4.2.4–4.2.5; method.md section 4).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"

namespace slabwright {

/// All that placing boundaries needs to know. Millimetres.
struct LayerRequest {
    double height = 0;        ///< of the pattern
    double max_layer = 0;     ///< LTmax
    double min_layer = 0;     ///< thinner layers are reported
    double min_material = 0;  ///< MTmin
    double alpha = 0.7, beta = 0.3;
    std::vector<double> slab_thicknesses;
    double facing_allowance = 0;
    bool saddles_constrain = false;
    std::vector<Feature> features;
    /// Section area in mm² just above z; asked for few heights. Must be a pure function.
    std::function<double(double z)> section_area;
};

struct Boundary {
    double z = 0;               ///< the layer's top
    double slab_thickness = 0;  ///< the thinnest slab that holds the layer
    std::string reason;         ///< in words, with the feature that decided
};

/// What a placement breaks, in the order in which `optimal` minimises it.
struct LayerCost {
    double broken_type2 = 0;  ///< area-weighted count: mm² of down-facing flats no boundary meets
    double broken_type1 = 0;  ///< mm², each feature by its area
    int thin_layers = 0;
    double exposed_glue = 0;  ///< mm² of finished up-facing flats within [h − MTmin, h] of a boundary, closed
    double broken_type3 = 0;  ///< mm²
    int layers = 0;
    double wood = 0;     ///< mm of slab bonded
    double minus_q = 0;  ///< −Σ Q, DT relative to MTmin and A to the largest section
    friend auto operator<=>(const LayerCost&, const LayerCost&) = default;
};

struct LayerPlacement {
    std::vector<Boundary> boundaries;  ///< ascending; the last is the pattern's height
    LayerCost cost;
    std::vector<Diagnostic> diagnostics;  ///< broken ranges, thin layers, …
};

/// Print's algorithm, with the corrections of method.md section 4. Ends on every input.
[[nodiscard]] LayerPlacement place_layers_printed(const LayerRequest& request);
/// A dynamic program over candidate heights; never worse than `printed` in the order of LayerCost.
[[nodiscard]] LayerPlacement place_layers_optimal(const LayerRequest& request);
/// The cost of any placement, for comparing the two.
[[nodiscard]] LayerCost layer_cost(const LayerRequest& request, const std::vector<double>& tops);

}  // namespace slabwright
