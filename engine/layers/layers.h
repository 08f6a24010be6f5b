// Where one layer ends and the next begins (LUO 4.2.4–4.2.5; METHOD.md section 4).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"

namespace slabwright {

/// Heights nearer than this (mm) are the same height: paths are written in steps of it, and float vertices
/// say no more.
inline constexpr double kSameHeight = 1e-4;

/// All that placing boundaries needs to know. Millimetres, z = 0 at the pattern's bottom.
struct LayerRequest {
    double height = 0;        ///< of the pattern
    double max_layer = 0;     ///< LTmax; layers keep to it within kSameHeight
    double min_layer = 0;     ///< thinner layers are reported
    double min_material = 0;  ///< MTmin
    /// MTmin above a boundary at z, where it is not the same at every height; a pure function, at least 0 and
    /// at most 1e6. Then `min_material` is not looked at.
    std::function<double(double z)> min_material_at{};
    double alpha = 0.7, beta = 0.3;
    std::vector<double> slab_thicknesses;  ///< in stock; empty: slabs made to fit max_layer
    double facing_allowance = 0;
    bool saddles_constrain = false;
    double filled_underside = 0;  ///< mm of wood that may stay under a down-facing flat, so that flats this
                                  ///< near to each other, or to the base, share a boundary
    std::vector<Feature> features;
    /// Section area in mm² just above z. Must be a pure function. `printed` asks for every candidate inside
    /// regions taller than a layer, `optimal` for candidates that tie in all but Q: see SectionAreas, which
    /// answers in microseconds.
    std::function<double(double z)> section_area;
};

struct Boundary {
    double z = 0;               ///< the layer's top
    double slab_thickness = 0;  ///< the thinnest slab that holds the layer and the facing allowance; where
                                ///< none does, that many of the thickest
    std::string reason;         ///< in words, with the feature that decided
};

/// What a placement breaks, at its boundaries and at the joints between slabs that are bonded into one layer,
/// in the order in which `optimal` minimises it. Sums of whole units (0.001 mm², 0.1
/// nm, 1e-9 of Q), so that equal placements compare equal. The pattern's top is no joint: nothing is glued
/// there.
struct LayerCost {
    double broken_type2 = 0;  ///< area-weighted count: mm² of down-facing flats no boundary meets
    double broken_type1 =
        0;  ///< mm², each feature by its area, at least 1 mm², for every boundary inside (h − MTmin, h)
    int thin_layers = 0;      ///< with them those whose uppermost slab is left so thin
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
    /// layers.type1, .type2, .type3 (broken ranges), .exposed_glue, .thin, .bonded (several slabs in one
    /// layer), joint.thin (little wood over a joint between its slabs): one of a code per joint, with the
    /// count of features and the worst of them.
    std::vector<Diagnostic> diagnostics;
};

/// Print's algorithm, with the corrections of METHOD.md section 4. Ends on every input.
/// @throws Error(usage, "layers.request") when no placement can answer: no height, no tallest layer, slabs
/// that are no lengths
[[nodiscard]] LayerPlacement place_layers_printed(const LayerRequest& request);
/// A dynamic program over candidate heights; never worse than `printed` in the order of LayerCost.
[[nodiscard]] LayerPlacement place_layers_optimal(const LayerRequest& request);
/// Layers as thick as they may be, whatever they break: what the others are measured against.
[[nodiscard]] LayerPlacement place_layers_uniform(const LayerRequest& request);
/// By the strategy of that name; `combined`, which compares whole plans, begins with `optimal`.
[[nodiscard]] LayerPlacement place_layers(LayerStrategy strategy, const LayerRequest& request);
/// The cost of any placement, for comparing them.
[[nodiscard]] LayerCost layer_cost(const LayerRequest& request, const std::vector<double>& tops);

}  // namespace slabwright
