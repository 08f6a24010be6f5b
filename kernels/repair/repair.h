// From a mesh that is no solid to one that is: defects are mended one by one, and told.
//
//     if (!is_solid(report)) {
//         Mended mended = mend(context, mesh.view());
//         if (mended.solid) …                        // mended.found says what was wrong, where, how large
//     }
//
// A solid, here as everywhere, is where the winding number is not zero. So bodies may overlap, touch and
// cross themselves; what a mesh needs is that along every edge as many facets run one way as the other.
#pragma once

#include <array>
#include <cstdint>

#include "kernels/mesh/mesh.h"
#include "kernels/mesh/report.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Kinds of defects, in the order in which they are mended.
enum class Defect : std::uint8_t {
    degenerate,  ///< facets without area that close nothing, dropped; size: none
    duplicate,   ///< facets given more than once, dropped; size: area, mm²
    crack,       ///< borders a little apart, brought together; size: how far, mm
    t_junction,  ///< edges split at a vertex of other facets; size: how far it lay off, mm
    turned,      ///< patches of facets turned over; size: area, mm²
    hole,        ///< closed; size: area, mm²
    stray,       ///< fragments that enclose nothing, dropped; size: area, mm²
    inside_out,  ///< bodies turned over; size: volume, mm³
};
inline constexpr std::size_t kDefects = 8;

struct MendedDefect {
    std::uint64_t count = 0;
    double size = 0;                ///< of the largest
    std::array<double, 3> where{};  ///< there, mm
};

/// What keeps a mended mesh from being a solid.
struct LeftDefects {
    std::uint64_t holes = 0;        ///< neither flat nor thin, and larger than hole_mm
    double hole_mm = 0;             ///< diagonal of the largest
    std::uint64_t sheets = 0;       ///< fragments that enclose nothing, too large to be dropped
    double sheet_mm2 = 0;           ///< their area
    std::uint64_t one_sided = 0;    ///< edges whose facets cannot agree on the outside
    std::array<double, 3> where{};  ///< of the largest hole, or else the largest sheet
};

struct MendOptions {
    /// How far borders may lie apart to be brought together, mm; 0: a thousandth of the part's diagonal, and
    /// kMostStitch at most; where that leaves it open, .4, 1.6, 2 and .1 times that, the first that closes
    /// it.
    double stitch_mm = 0;
    /// Diagonal up to which a hole that is neither flat nor thin is closed, mm; 0: a twentieth of the part's.
    double hole_mm = 0;
};
inline constexpr double kMostStitch = 0.25;

struct Mended {
    Mesh mesh;           ///< with neighbours, vertices by first use; as it came where it was a solid
    MeshReport report;   ///< on it
    bool needed = true;  ///< false: it was a solid, and nothing was done
    bool solid = false;  ///< it is one now
    std::array<MendedDefect, kDefects> found{};  ///< by Defect
    double moved_mm = 0;  ///< the farthest that a vertex moved, or an edge was bent, to meet another
    LeftDefects left;

    [[nodiscard]] const MendedDefect& operator[](Defect d) const {
        return found[static_cast<std::size_t>(d)];
    }
};

/// Whether a planner may use the mesh: closed (but for open edges in the base plane), consistently oriented,
/// not inside out.
[[nodiscard]] bool is_solid(const MeshReport& report);

/// Mends what can be: see Defect. Only what lies at defects is changed. Idempotent: a solid comes back as it
/// is. Time near-linear in the facets, and squared in the edges of one flat hole; a hole that is not flat and
/// has over 400 edges is left. Memory: some 200 bytes a facet, charged. Deterministic on any number of
/// threads.
/// @param mesh welded; with the report on it
/// @throws Error(cancelled), Error(no_plan, "memory.limit")
[[nodiscard]] Mended mend(Context& context, MeshView mesh, const MeshReport& report,
                          const MendOptions& options = {});

}  // namespace slabwright
