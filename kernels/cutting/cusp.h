// Cusps, stepdowns and step-overs (LUO 5.4, SHAPING 3, FINISH eq. 9; METHOD.md section 5). Millimetres,
// radians. α is the slope of the surface: 0 flat, π/2 vertical.
#pragma once

namespace slabwright {

/// Height, normal to the surface, of the cusp that a ball of radius `r` leaves on a plane at slope `alpha`
/// between two level passes `stepdown` apart. Where the lower pass's shank cuts too the second formula of
/// METHOD.md section 5 holds, which replaces LUO eq. 5. Infinite where the passes leave an uncut strip
/// (stepdown·cot α > 2r).
[[nodiscard]] double ball_level_cusp(double r, double alpha, double stepdown);

/// The largest stepdown whose cusp stays within `cusp` (< r): the inverse of ball_level_cusp.
[[nodiscard]] double ball_level_stepdown(double r, double alpha, double cusp);

/// Print's rule, SD = 2·√(2RL − L²)·sin α whatever the slope (LUO eq. 4); kept for comparison.
[[nodiscard]] double ball_level_stepdown_printed(double r, double alpha, double cusp);

/// Flat end mill of radius r: L = SD·cos α, where L < 2r·sin α.
[[nodiscard]] double flat_level_cusp(double alpha, double stepdown);
/// Its inverse, for slopes under π/2 (infinite on a vertical wall).
[[nodiscard]] double flat_level_stepdown(double alpha, double cusp);

/// Step-over of raster passes: d = 2·√(L(2R − L)·(1 − (N·Ns)²)) (FINISH eq. 9), N the surface's unit normal
/// and Ns the unit direction of the step; `normal_dot_step` is their product. 0 where the surface faces the
/// step direction.
[[nodiscard]] double raster_stepover(double r, double cusp, double normal_dot_step);

}  // namespace slabwright
