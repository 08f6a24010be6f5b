// Where a layer's flask leaves room for a cutter.
#pragma once

#include <cstdint>
#include <span>

#include "engine/paths/runs/layer_cut.h"
#include "kernels/cutting/fibres.h"

namespace slabwright {

/// The places that a layer's flask leaves to the middle of a cutter of radius `r` mm: the opening, shrunk.
/// Straight walls are exact, round ones keep the cutter off by up to 0.02 mm. Only with a flask.
[[nodiscard]] Loops flask_room(const LayerCut& cut, double r);

/// The rest of the plane, as far as it matters: what lies outside `room`, up to well past the stock.
[[nodiscard]] Loops beyond_room(const LayerCut& cut, double r, const Loops& room);

/// A level's forbidden stretches with the flask's added: whatever lies outside `room`. Unchanged where there
/// is no flask.
[[nodiscard]] Fibres beside_flask(const LayerCut& cut, const Loops& room, Fibres forbidden, Axis axis,
                                  std::span<const std::int32_t> lines);

}  // namespace slabwright
