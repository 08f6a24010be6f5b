// What keeps a pattern from being drawn from the sand, or the sand or the casting from coming out well:
// walls with little draft, undercuts to the draw, thin walls, sharp inner corners.
//
// Sand is rammed over the pattern as it stands on the board, and the pattern is drawn out of it along z. So
// all that faces down, but for what lies on the board, is an undercut, whether or not slabs can be milled so;
// a wall's draft is by how much it leans back, and its surface turns up.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/geometry/vectors.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct DrawLimits {
    double draft_deg = 1;    ///< walls with less are listed; 0 to 45
    double thin_mm = 4;      ///< walls that are thinner are listed; 0: not looked for
    double corner_deg = 30;  ///< inner corners are listed whose faces meet under 180° less this; 1 to 179
};

enum class DrawFinding : std::uint8_t { none, little_draft, undercut };

/// Facets that hang together and share a finding.
struct DrawPatch {
    double area_mm2 = 0;
    double worst =
        0;        ///< the least draft in degrees, negative where it is undercut; or the least thickness, mm
    Point3 at{};  ///< there, on the surface
    std::uint32_t first_facet = 0;
};

/// Sharp inner edges that hang together.
struct InnerCorner {
    double length_mm = 0;
    double angle_deg = 0;  ///< the narrowest between its faces, on the side of the air
    Point3 at{};           ///< the middle of that edge
};

struct DrawReport {
    DrawLimits limits;
    /// The largest first. Of a thin wall both sides count; what is under .1 mm² is left out.
    std::vector<DrawPatch> little_draft, undercuts, thin;
    double little_draft_mm2 = 0, undercut_mm2 = 0, thin_mm2 = 0;
    std::vector<InnerCorner> corners;  ///< the longest first
    double corners_mm = 0;
    std::vector<float>
        draft_deg;  ///< of each facet, −90 to 90; of what has no normal or lies on the board 90
    std::vector<DrawFinding> finding;  ///< of each facet
    std::vector<float> thickness_mm;   ///< of each facet that is thin, its least; else 0
};

/// Draft is told to a hundredth of a degree, and no finer than the corners' rounding. Thickness is measured
/// by rays (kernels/access/wall_thickness.h) from half a million points at most, not much nearer than half
/// the limit. Facets count whole, also where they lie partly within another body. Deterministic.
/// @param mesh a solid, with neighbours, and with roles where bodies overlap
/// @throws Error(usage, "draw.limits"), Error(no_plan, "memory.limit"), Error(cancelled)
[[nodiscard]] DrawReport check_draw(Context& context, MeshView mesh, const DrawLimits& limits = {});

}  // namespace slabwright
