// Round holes, told from facets: through, blind, stepped, at any axis (FINISH 3.3; METHOD.md section 3).
//
// A hole is a closed band of facets whose corners lie on one cylinder and which look at its axis, open at one
// end or both, with nothing standing inside. Coaxial bands that a shelf or a cone joins are one hole. Bosses
// (their facets look away), fillets and slots (the band does not close), dishes (it is no cylinder), tapered
// pockets and annular grooves (something stands inside) are none.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "kernels/export.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

enum class HoleKind : std::uint8_t {
    plain,         ///< one diameter
    counterbored,  ///< a wider cylinder at the mouth, on a level shelf
    countersunk,   ///< a cone at a mouth, one diameter otherwise
    stepped,       ///< any other row of diameters
};

enum class HoleBottom : std::uint8_t {
    open,   ///< a through hole, or one that opens into another
    flat,   ///< a plane across the axis
    cone,   ///< as a drill's point leaves it
    other,  ///< rounded, slanted or anything else
};

[[nodiscard]] SLABWRIGHT_API std::string_view name(HoleKind kind);
[[nodiscard]] SLABWRIGHT_API std::string_view name(HoleBottom bottom);

/// A stretch of a hole: a cylinder where both diameters are the same, else a cone.
struct HoleStep {
    double from_mm = 0, to_mm = 0;      ///< along the axis, from the mouth inwards
    double diameter_mm = 0;             ///< at `from`
    double end_diameter_mm = 0;         ///< at `to`; 0 at a point
    double chord_mm = 0;                ///< of a wall, as RoundHole has it
    std::vector<std::uint32_t> facets;  ///< of its wall or flank, ascending; none of a cone between two walls
                                        ///< that neither end leads to
};

struct RoundHole {
    HoleKind kind{};
    HoleBottom bottom{};
    Point3 mouth{};  ///< mm, on the axis, at the height of the mouth's outermost corner
    Vec3d into{};    ///< unit, from the mouth inwards; of a through hole's two ways that from the wider end,
                     ///< else the one that points down more
    std::vector<HoleStep> steps;  ///< from the mouth; a blind cone is the last
    double diameter_mm = 0;       ///< of the narrowest cylinder: that of the corners, which lie on the circle
    double depth_mm = 0;          ///< from the mouth to the end of the last step
    double chord_mm = 0;  ///< by how far the mesh's chords lie within that circle (the largest); what the
                          ///< diameter can be off by
    std::vector<std::uint32_t> facets;  ///< of walls, shelves, cones and bottom; ascending
};

/// What a drill of the least diameter makes of a hole, as a plain hole: from the last wall on, with a conical
/// bottom.
/// @return the hole itself where it is plain; none where a wall before the last is no wider, or something
/// other than a point follows the last
[[nodiscard]] std::optional<RoundHole> narrowest_part(const RoundHole& hole);

struct HoleOptions {
    double least_diameter_mm = 1, most_diameter_mm = 150;
    double noise_mm = 0.005;  ///< by which corners may miss the circle on any mesh, for files with few digits
};

/// Finds every round hole of 8 sides or more, by the place of its first facet. Corners may miss a circle by
/// its chords' sagitta, but 2 % of its radius at most. An octagonal pocket cannot be told from a hole of 8
/// sides. Where the corners at a wall's two ends do not face each other it needs 16. Costs about as much as
/// one pass over the facets for every direction in which their edges run.
/// @throws Error(usage, "holes.options") for diameters out of order or not finite; Error(cancelled)
[[nodiscard]] std::vector<RoundHole> find_holes(Context& context, MeshView mesh,
                                                const HoleOptions& options = {});

}  // namespace slabwright
