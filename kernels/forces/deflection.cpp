#include "kernels/forces/deflection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/errors.h"

namespace slabwright {

namespace {

double stiffness(double diameter, double modulus_mpa) {  // 3EJ, N·mm²
    const double d = kFluteDiameterShare * diameter;
    return 3 * modulus_mpa * std::numbers::pi * d * d * d * d / 64;
}

}  // namespace

OverhangThickness least_overhang_thickness(const OverhangCut& c) {
    if (!(c.width_mm > 0 && c.strength_mpa > 0 && c.force_x_n >= 0 && c.force_y_n >= 0 && c.force_z_n >= 0 &&
          c.overhang_mm >= 0 && c.cut_height_mm >= 0))
        throw Error(ErrorKind::usage, "forces.overhang",
                    "an overhang needs a positive width and strength, and no negative force or length");
    OverhangThickness t;
    t.sideways_mm = 6 * c.force_x_n * c.overhang_mm / (c.width_mm * c.width_mm * c.strength_mpa);
    t.upwards_mm = std::sqrt(6 * (c.force_z_n * c.overhang_mm + c.force_y_n * c.cut_height_mm) /
                             (c.width_mm * c.strength_mpa));
    t.least_mm = std::max(t.sideways_mm, t.upwards_mm);
    return t;
}

bool overhang_holds(const OverhangCut& cut, double thickness) {
    return thickness >= least_overhang_thickness(cut).least_mm;
}

double cutter_deflection(double force, double length, double diameter, double modulus_mpa) {
    if (!(diameter > 0 && modulus_mpa > 0 && force >= 0 && length >= 0))
        throw Error(ErrorKind::usage, "forces.tool",
                    "a cutter needs a positive diameter and modulus, and no negative force or length");
    return force * length * length * length / stiffness(diameter, modulus_mpa);
}

double cutter_stress(double force, double length, double diameter) {
    if (!(diameter > 0 && force >= 0 && length >= 0))
        throw Error(ErrorKind::usage, "forces.tool",
                    "a cutter needs a positive diameter, and no negative force or length");
    const double d = kFluteDiameterShare * diameter;
    return force * length / (std::numbers::pi * d * d * d / 32);
}

double allowed_tool_length(double force, double deflection, double diameter, double modulus_mpa) {
    if (!(diameter > 0 && modulus_mpa > 0 && force >= 0 && deflection >= 0))
        throw Error(ErrorKind::usage, "forces.tool",
                    "a cutter needs a positive diameter and modulus, and no negative force or deflection");
    if (force == 0) return std::numeric_limits<double>::infinity();
    return std::cbrt(stiffness(diameter, modulus_mpa) * deflection / force);
}

}  // namespace slabwright
