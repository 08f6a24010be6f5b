// How thin a slab may be cut and how long a cutter may be (LUO 6.3, 6.4; METHOD.md section 9). Lengths mm,
// forces N, stresses MPa.
#pragma once

namespace slabwright {

/// A slab that overhangs what it is glued to, cut at its end (LUO figure 6.6).
struct OverhangCut {
    double force_x_n = 0, force_y_n = 0, force_z_n = 0;  ///< magnitudes
    double overhang_mm = 0;                              ///< b, from the joint to the cut
    double cut_height_mm = 0;                            ///< a, of the cut above the joint
    double width_mm = 0;      ///< R, of the strip that carries it: the cutter's radius
    double strength_mpa = 0;  ///< σ, in bending
};

/// Both stresses must hold, so the slab must be at least the larger (print's eq. 9 takes the smaller; that is
/// a slip).
struct OverhangThickness {
    double sideways_mm = 0;  ///< t1 = 6·Fx·b / (R²σ), print's eq. 5 and 7
    double upwards_mm = 0;   ///< t2 = √(6(Fz·b + Fy·a) / (Rσ)), print's eq. 6 and 8
    double least_mm = 0;     ///< the larger
};

/// @throws Error(usage, "forces.overhang") unless width and strength are positive and the rest is not
/// negative
[[nodiscard]] OverhangThickness least_overhang_thickness(const OverhangCut& cut);

/// Does a slab of this thickness carry the cut?
[[nodiscard]] bool overhang_holds(const OverhangCut& cut, double thickness_mm);

inline constexpr double kSteelMpa = 200e3;  ///< E of a cutter of steel, as LUO reckons with
inline constexpr double kFluteDiameterShare =
    0.8;  ///< a fluted cylinder bends like a full one this much thinner

/// δ = F·L³ / (3EJ), J = π(0.8 d)⁴/64: the tip of a cutter whose flutes reach to the holder (LUO eq. 10).
/// @throws Error(usage, "forces.tool") unless diameter and modulus are positive and force and length are not
/// negative
[[nodiscard]] double cutter_deflection(double force_n, double length_mm, double diameter_mm,
                                       double modulus_mpa = kSteelMpa);

/// σ = F·L / W, W = π(0.8 d)³/32: the bending stress of such a cutter at the holder.
/// @throws Error(usage, "forces.tool") as cutter_deflection
[[nodiscard]] double cutter_stress(double force_n, double length_mm, double diameter_mm);

/// L = ∛(3EJδ / F): the longest such cutter that bends by no more than `deflection_mm` (LUO eq. 11); infinite
/// at no force.
/// @throws Error(usage, "forces.tool")
[[nodiscard]] double allowed_tool_length(double force_n, double deflection_mm, double diameter_mm,
                                         double modulus_mpa = kSteelMpa);

}  // namespace slabwright
