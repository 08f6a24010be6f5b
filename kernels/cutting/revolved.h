// A cutter whose under side is any convex surface of revolution against one facet: how low its tip may go
// over a place, and where along a line it touches at one height.
#pragma once

#include "kernels/cutting/layer_solid.h"
#include "kernels/cutting/tool_shape.h"

namespace slabwright {

/// Where a dropped cutter touches a facet.
struct RevolvedContact {
    double tip_z;       ///< mm
    Vec3d point;        ///< of the facet
    double nx, ny, nz;  ///< the unit normal of the cutter's under side there, towards the cutter; of its
                        ///< level floor nz alone counts, which is the facet's
};

/// Raises `best` to what the facet holds the tip up to over (x, y), if that is more. With p running over the
/// facet and h the under side's height at a distance from the axis, the tip's height is the greatest
/// p_z − h(|p − axis|): concave in p. On the facet's plane it lies where h is as steep as the plane; on an
/// edge it is bracketed to 1e-8 mm.
/// @return whether it was raised
bool drop_revolved(const SolidFacet& facet, const Envelope& under, double x, double y, RevolvedContact& best);

/// Along the line v = const in the plane, the places u strictly between low and high are those at which the
/// facet lies in a cutter whose tip is at tip_z; nz as Forbidden has it.
struct RevolvedStretch {
    double low, high;  ///< mm; low ≥ high: there is none
    double nz_low, nz_high;
};

/// The part of a facet that is over the tip, laid ready for lines at many v.
class FacetOverTip {
public:
    /// @param axis_u 0 for lines along x, 1 for lines along y
    FacetOverTip(const SolidFacet& facet, const Envelope& under, double tip_z, int axis_u);
    /// No line outside (v_low, v_high) meets it, nor any place outside (u_low, u_high), mm.
    [[nodiscard]] double v_low() const { return v_low_; }
    [[nodiscard]] double v_high() const { return v_high_; }
    [[nodiscard]] double u_low() const { return u_low_; }
    [[nodiscard]] double u_high() const { return u_high_; }
    [[nodiscard]] RevolvedStretch stretch(double v) const;

private:
    struct Corner {
        double u, v, z;  ///< mm; z over the tip
    };
    struct Ends;
    void meet_plane(double v, Ends& ends) const;
    void meet_edge(const Corner& a, const Corner& b, double v, Ends& ends) const;
    void meet_corner(const Corner& a, double v, Ends& ends) const;
    [[nodiscard]] double nz_at(double distance) const;

    const Envelope under_;
    double facet_nz_;
    Corner corners_[4];
    int count_ = 0;
    bool has_plane_ = false;
    double gu_ = 0, gv_ = 0, steep_ = 0, away_ = 0, height_ = 0;  ///< of the plane, and of the contact on it
    double u_low_ = 0, u_high_ = 0, v_low_ = 0, v_high_ = 0;
};

}  // namespace slabwright
