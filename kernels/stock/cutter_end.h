// What sweeps the stock: a cutter's lower end, and a level arc that it runs along.
#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/cutting/tool_shape.h"
#include "kernels/geometry/cutter_shape.h"

namespace slabwright {

/// The lower end of a cutter: height over its tip at radius r is 0 (flat and face), R − √(R² − r²) (ball),
/// r·slope (a point) or the under side's.
struct CutterEnd {
    enum class Form : std::uint8_t { flat, ball, cone, other } form = Form::flat;
    double radius = 0;  ///< mm
    double slope = 0;   ///< of the cone
    Envelope under{};   ///< of what is none of these
};

/// @throws Error(usage, "tool.shape") for measures that make no cutter
[[nodiscard]] CutterEnd cutter_end(const CutterShape& shape);

/// A part of a circle at one height that the tip runs along, mm and radians: from the angle `start` (from +x,
/// counter-clockwise) on over `turn`, negative for clockwise, a whole circle at most.
struct LevelArc {
    double x = 0, y = 0, z = 0, radius = 0;
    double start = 0, turn = 0;

    [[nodiscard]] double length() const { return radius * std::abs(turn); }
};

}  // namespace slabwright
