// Holes: closed loops of edges at which facets do not balance.
#pragma once

#include "kernels/repair/soup.h"

namespace slabwright {

struct HoleLimits {
    double flat_mm = 0.25;  ///< a loop whose points lie this near to one plane is flat
    double thin_mm = 1;     ///< a loop no wider than this on average is a slit
    /// A loop is nearly flat, or thin, if it leaves its plane, or is wide, by this share of its diagonal.
    double bent_share = 0.02;
    double size_mm = 0;  ///< a loop that is neither nearly flat nor thin is closed up to this diagonal
};

struct Filled {
    std::uint64_t holes = 0;
    double area_mm2 = 0;     ///< of the largest
    Xyz hole_at{};           ///< its middle
    std::uint64_t left = 0;  ///< loops that are larger than the limits, or that no triangles close
    double left_mm = 0;      ///< diagonal of the largest of them
    Xyz left_at{};
    std::uint64_t strays = 0;  ///< fragments that enclose nothing, dropped
    double stray_mm2 = 0;      ///< area of the largest
    Xyz stray_at{};
    std::uint64_t sheets_left = 0;  ///< the same, too large to be dropped
    double sheet_mm2 = 0;           ///< area of all sheets
    Xyz sheet_at{};
    std::vector<bool> dropped;  ///< by facet, as they were numbered before; empty: none
};

/// Where facets are oriented, the edges at which more run one way than the other form closed loops. Each is
/// closed: flat ones in their plane (whatever their size, those inside others as holes of these), others by
/// the triangles of least area. Fragments that would enclose nothing, thinner than `flat_mm`, are dropped
/// where they are a twentieth of all area at most. Adds facets behind the others, and no vertices.
Filled fill_holes(Context& context, FacetSoup& soup, const HoleLimits& limits);

}  // namespace slabwright
