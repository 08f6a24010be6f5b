// Layers and finish tools decided together (LUO 6.4.2; METHOD.md section 10): with slabs bonded to any
// thickness a layer may be as tall as its tool is allowed to be long, so layers begin and end where the tool
// changes.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "engine/layers/layers.h"

namespace slabwright {

/// A range of heights, mm, and the finish tool that makes it: an index into a library in rising size.
struct ToolSlice {
    double z_low = 0, z_high = 0;
    std::size_t tool = 0;
    friend bool operator==(const ToolSlice&, const ToolSlice&) = default;
};

/// Neighbouring slices of one tool become one layer. Layers thinner than `least_mm` join the neighbour whose
/// tool is nearest in the library, the thicker one where both are as near, and the smaller tool makes both.
/// Then a layer taller than its tool is allowed to be long is cut into as few equal ones as keep to that.
/// @param slices     the map over z, ascending, each beginning where the one before ended
/// @param allowed_mm per tool, over 0: how tall a layer it may make
/// @throws Error(usage, "layers.tools") for slices that are not such a map, or a tool without a length
[[nodiscard]] std::vector<ToolSlice> join_slices(std::span<const ToolSlice> slices,
                                                 std::span<const double> allowed_mm, double least_mm);

/// The boundaries of `optimal` within each of these layers, which begin and end where they are told, whatever
/// that breaks at their ends; no layer is taller than its tool allows nor than the request's max_layer.
/// @param layers as join_slices gives them, from 0 to the pattern's height
/// @throws Error(usage, "layers.request"), Error(usage, "layers.tools")
[[nodiscard]] LayerPlacement place_layers_by_tools(const LayerRequest& request,
                                                   std::span<const ToolSlice> layers,
                                                   std::span<const double> allowed_mm);

/// The placement with these tops, with its slabs, cost, reasons and diagnostics.
/// @param tops ascending, the last the pattern's height
[[nodiscard]] LayerPlacement placement_of(const LayerRequest& request, const std::vector<double>& tops);

}  // namespace slabwright
