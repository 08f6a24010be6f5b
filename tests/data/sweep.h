// Solids from outlines and profiles: an outline is swept inward or outward while a profile raises it; flats
// fill the rest.
#pragma once

#include <span>
#include <vector>

#include "tests/data/models.h"

namespace slabwright {

/// A corner of a polygon to be rounded, millimetres. A concave corner gets a concave arc.
struct Corner {
    double x = 0, y = 0, radius = 0;
};

/// A point of a smooth closed curve with its outward unit normal; the curve runs counter-clockwise.
struct OutlinePoint {
    double x = 0, y = 0, nx = 0, ny = 0;
};
using Outline = std::vector<OutlinePoint>;

/// A point of a profile: how far outside the outline, and at what height.
struct ProfilePoint {
    double offset = 0, z = 0;
};
using Profile = std::vector<ProfilePoint>;

/// A closed loop of vertices at one height, counter-clockwise seen from above.
using Ring = std::vector<Vec3f>;

/// The nearest multiple of 1/4096 mm.
[[nodiscard]] float on_grid(double mm);

/// The polygon with its corners rounded; arcs deviate by at most `chord_mm`. @throws std::logic_error where
/// arcs do not fit
[[nodiscard]] Outline rounded_polygon(std::span<const Corner> corners, double chord_mm);
[[nodiscard]] Outline circle(double x, double y, double radius, double chord_mm);
/// All points nearer than `radius` to the segment from (x0, y0) to (x1, y1).
[[nodiscard]] Outline stadium(double x0, double y0, double x1, double y1, double radius, double chord_mm);

/// A drafted wall from z0 up to z1, the outline being its sharp foot; a concave fillet at the foot (outside
/// the outline) and a round at the top.
[[nodiscard]] Profile drafted_wall(double z0, double z1, double draft_deg, double fillet_mm, double round_mm,
                                   double chord_mm);
/// A drafted wall from z1 down to z0, the outline being its sharp rim; a fillet towards the floor.
[[nodiscard]] Profile drafted_pocket(double z1, double z0, double draft_deg, double fillet_mm,
                                     double chord_mm);

[[nodiscard]] Ring ring(const Outline& outline, ProfilePoint at);
/// The strip between two rings of equal size. Faces away from the middle when `to` lies higher, towards it
/// when lower.
void strip(std::vector<Facet>& facets, const Ring& from, const Ring& to);
/// All strips of a profile; returns the last ring.
Ring sweep(std::vector<Facet>& facets, const Outline& outline, const Profile& profile);
/// The horizontal region inside `outer` and outside `holes`, facing up or down. @throws std::logic_error when
/// loops cross
void flat(std::vector<Facet>& facets, const Ring& outer, const std::vector<Ring>& holes, bool up);
/// A fan from a ring to one point.
void fan(std::vector<Facet>& facets, const Ring& ring, Vec3f tip);

}  // namespace slabwright
