// What holds a slab down to what it was glued on, and whether that bears the slab's weight and the cutters
// (METHOD.md section 18). Plane statics of one joint; millimetres, newtons.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

/// Area, centroid and second moments of a plane region about its centroid, by Green's theorem. Millimetres.
struct AreaMoments {
    double area = 0, x = 0, y = 0;
    double ixx = 0, iyy = 0, ixy = 0;  ///< ∫(x − cx)² dA, ∫(y − cy)² dA, ∫(x − cx)(y − cy) dA
};

/// @param region outer loops counter-clockwise, holes clockwise
[[nodiscard]] AreaMoments area_moments(const Loops& region);

/// A force straight down at a place, N and mm.
struct DownForce {
    double n = 0, x = 0, y = 0;
};

/// What acts on a joint.
struct FootingLoad {
    std::vector<DownForce> weights;
    double push_n = 0;  ///< of a cutter, straight up or down, at the worst of `push_at`
    std::span<const std::array<double, 2>> push_at;
    double side_bending_nmm = 0;  ///< of a cutter: its force along the joint times its height above it
};

/// One joint: the glue, and the wood that the slab rests on.
class Footing {
public:
    /// @param glue where glue is
    /// @param contact where wood stands on both sides; it holds the glue
    Footing(const Loops& glue, const Loops& contact);

    [[nodiscard]] const AreaMoments& glue() const { return glue_; }

    /// The largest pull on the glue, MPa, where stress is linear over it, as in a beam. Infinite where there
    /// is no glue.
    [[nodiscard]] double pull_mpa(const FootingLoad& load) const;

    /// The load as a share of what the joint bears while it turns over any edge of the contact's hull and all
    /// of the glue pulls with `bears_mpa`. No distribution of the stress bears more than 1. Infinite where
    /// there is no glue.
    [[nodiscard]] double turning(const FootingLoad& load, double bears_mpa) const;

    /// How far a place lies outside the contact's hull, mm; 0 inside.
    [[nodiscard]] double outside_by(double x, double y) const;

private:
    AreaMoments glue_;
    std::vector<std::array<double, 2>> hull_, glue_hull_;  // mm, counter-clockwise
};

}  // namespace slabwright
