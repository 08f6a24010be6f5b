// Rings around what must stay: how a region is entered and travelled, and how the last level of a layer is cleared.
#pragma once

#include <vector>

#include "engine/paths/layer_cut.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// The places from which a tool touches the solid, as a region, from level contours at one height.
[[nodiscard]] Loops forbidden_region(const Contours& contours);

/// The places that a layer's flask leaves to the middle of a cutter of radius `r` mm: the opening, shrunk. Straight walls are
/// exact, round ones keep the cutter off by up to 0.02 mm. Only with a flask.
[[nodiscard]] Loops flask_room(const LayerCut& cut, double r);

/// The rest of the plane, as far as it matters: what lies outside `room`, up to well past the stock.
[[nodiscard]] Loops beyond_room(const LayerCut& cut, double r, const Loops& room);

/// A level's forbidden stretches with the flask's added: whatever lies outside `room`. Unchanged where there is no flask.
[[nodiscard]] Fibres beside_flask(const LayerCut& cut, const Loops& room, Fibres forbidden, Axis axis, std::span<const std::int32_t> lines);

/// Cuts once around a closed ring (its first point is repeated at the end), entered at its start from `above` down a ramp
/// along the ring itself; the stretch of the ramp is cut again. Heights in 0.1 µm.
void cut_ring(PathBuilder& path, const std::vector<PathPoint>& ring, std::int32_t above, std::int32_t z, double ramp_deg);

/// Clears everything between `forbidden` and the edge of the stock at one height: first in rectangles from the stock's edge as far
/// as these surround the forbidden region, then in rings around that region from the farthest to its border. The forbidden region
/// is on the right of every ring (but see Cutting::climb), so the cutter climbs. A ring is cut once all rings within its part of the free
/// area are; of those whose turn it is the nearest comes next, and from ring to next ring the cutter stays down. With `hold`, all
/// rings of one distance are cut before any nearer one: the pieces that hang over a cavity below, or over the edge of the stack, go from the
/// middle or from the free edge inwards, and what still stands hangs on what stays, for from each of its points the shortest way
/// to the forbidden region runs through standing stock. Neighbouring rings are at most 0.45 of the tool's diameter apart.
/// @param forbidden of the tool's middle, outer loops counter-clockwise; the flask's included
/// @param tip_z mm
/// @return the largest distance of two rings, mm; 0 when the forbidden region is nowhere near the stock, and nothing was cut
double clear_from_afar(PathBuilder& path, const LayerCut& cut, const Tool& tool, const Loops& forbidden, double tip_z, bool hold);

}  // namespace slabwright
