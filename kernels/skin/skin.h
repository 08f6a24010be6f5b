// Machining stock on a model (FINISH 2.2): a second surface at a distance from the first, never nearer.
//
//     Skinned skinned = add_skin(context, mesh.view(), {.mm = 3});
//     skinned.mesh …                      // at least 3 mm − kSkinTolerance from the model, everywhere
//
// By vertices where that is valid: every vertex moves so that none of its facets ends nearer than asked
// (offset_vertex()), and facets, corners and edges stay what they were. Where a vertex has no such place or
// would go too far, where a facet turns over, or where the measurement says that the skin is too thin
// somewhere, the surface is made anew from the distance to the model, on a grid.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "kernels/mesh/mesh.h"
#include "kernels/mesh/report.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// What skin is asked for.
struct Skin {
    double mm = 0;                                  ///< along the normal; 0: none
    std::optional<std::array<double, 3>> normal{};  ///< only on facets whose normal lies this way
    double angle_deg = 10;                          ///< within this angle
    std::optional<std::array<double, 6>> box{};  ///< only on facets wholly in it: least x y z, greatest x y z
    friend bool operator==(const Skin&, const Skin&) = default;
    [[nodiscard]] bool is_everywhere() const { return !normal && !box; }
};

/// By how much a skin may be thinner than asked, mm.
inline constexpr double kSkinTolerance = 0.01;

enum class SkinMethod : std::uint8_t { vertices, level_set };

struct Skinned {
    Mesh mesh;          ///< with neighbours, where the model lies; not set down
    MeshReport report;  ///< on it
    SkinMethod method = SkinMethod::vertices;
    /// The least distance from the skin to the model's facets that are to have it, or from them to the skin:
    /// measured at vertices, edge middles and facet middles of both. Never under mm − kSkinTolerance.
    double least_mm = 0;
    double most_mm = 0;           ///< the greatest, as far as five skins: at sharp edges, the mitre
    double cell_mm = 0;           ///< of the grid, where one was used
    std::uint64_t facets_on = 0;  ///< facets of the model that have it
    /// Why not by vertices, and where: "12 vertices have no place", "3 facets turn over", "too thin".
    std::string reason;
    std::array<double, 3> where{};
};

/// Adds a skin to a solid. Deterministic.
/// @param mesh a solid with neighbours, mm
/// @param skin mm over 0. On some facets only, those beside stay where they are, and the skin is by vertices
/// or not at all
/// @throws Error(input, "skin.none") where no facet is chosen, "skin.impossible" where the chosen facets
/// cannot move alone, "skin.open" where it would have to be made anew on a grid and the base is open,
/// "skin.thin" where the measurement finds less than asked, Error(no_plan, "memory.limit"), Error(cancelled)
[[nodiscard]] Skinned add_skin(Context& context, MeshView mesh, const Skin& skin);

}  // namespace slabwright
