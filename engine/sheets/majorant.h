// Straight cuts through a sheet that never enter the part (METHOD.md section 13; FDFF chapter V).
#pragma once

#include <span>
#include <vector>

namespace slabwright {

/// How far the part reaches at a height, in one normal plane of a sheet's outline.
struct ProfilePoint {
    double z = 0, r = 0;  ///< mm; r grows out of the part
};

/// One straight cut through the whole sheet, by where it leaves bottom and top.
struct StraightCut {
    double bottom = 0, top = 0;  ///< r in mm at the profile's lowest and highest z
};

/// The least concave function over a profile: no straight cut that spares the part passes below it. Its
/// corners are some of the profile's points, the first and the last among them; z ascends.
/// @param profile z ascending, two points at least, the first below the last; of points at one height the
/// farthest counts
[[nodiscard]] std::vector<ProfilePoint> concave_majorant(std::span<const ProfilePoint> profile);

/// The majorant's r at z; beyond its ends, its last edges go on.
[[nodiscard]] double majorant_at(std::span<const ProfilePoint> majorant, double z);

/// A cut that touches the majorant at height z and lies on or over it everywhere. At a corner it has the
/// slope halfway between the edges'. @param most_slope |dr/dz| is no more than this
[[nodiscard]] StraightCut supporting_cut(std::span<const ProfilePoint> majorant, double z, double most_slope);

/// The fewest cuts that leave at most `leave` mm (square to the majorant) over it, none below it; of so many,
/// those that leave least; a thousand at most. From bottom to top. Along an arc of radius ρ that turns by Δφ
/// they are ⌈Δφ / (2 acos(ρ / (ρ + leave)))⌉.
/// @param leave over 0
[[nodiscard]] std::vector<StraightCut> cuts_along(std::span<const ProfilePoint> majorant, double leave);

/// What straight cuts leave over a profile at its own points, the greatest, mm along r: on a concave arc of
/// radius R through a sheet of thickness h that is at least R − √(R² − (h/2)²).
[[nodiscard]] double left_over(std::span<const ProfilePoint> profile, std::span<const StraightCut> cuts);

}  // namespace slabwright
