// What a cut takes of a level of a sheet.
#pragma once

#include <span>

#include "engine/sheet_proof/sheet_proof.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// Where the axis is at a level, and how it leans there, mm aside for each mm down.
struct AxisPoint {
    double x = 0, y = 0, lean_x = 0, lean_y = 0;
};

/// What the cut takes of a level: about every piece of the axis, as far as half the kerf square to the
/// surface that the axis sweeps. @param kerf mm
[[nodiscard]] Loops swept(std::span<const AxisPoint> axis, double kerf);

[[nodiscard]] inline Point2 unit_point(double x, double y) { return {to_units(x), to_units(y)}; }

/// A place on the stock in the frame of the part.
[[nodiscard]] ReadHead unplaced(const ReadHead& head, const ReadPiece& piece);

}  // namespace slabwright
