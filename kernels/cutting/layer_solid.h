// The solid that a cutter must spare while one layer is machined: the pattern up to the layer's top. What the
// layers above will add is not there yet; what the layers below have finished is.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/cutting/cap_cells.h"
#include "kernels/cutting/facet_tree.h"
#include "kernels/geometry/vectors.h"
#include "kernels/mesh/bulk_memory.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// A facet of the layer's solid, cut off kTopSheet below the layer's top.
struct SolidFacet {
    std::array<Vec3d, 3> p;
    Vec3d normal{};  ///< unit, outward; zero for a facet without area
    double z_min = 0, z_max = 0;
    std::uint8_t edges : 3 =
        0;  ///< bit k: the edge (p[k], p[k + 1]) is not concave, and this facet is the one to test it
    bool top : 1 = false;  ///< it reaches up to where the solid is cut off
    std::uint8_t ends : 3 =
        7;  ///< bit k: this facet is the one to test the corner p[k], in which edges end that are tested
    static constexpr std::uint8_t kAnyTurn = 255;
    static constexpr double kTurn = 1.0 / 127;
    static constexpr double kNormalRounding = 1e-6;  ///< of a unit vector that is computed
    /// How far from the direction in which this one faces, seen from above, those end of all facets that
    /// share this corner and are not level, at most, in kTurn; kAnyTurn: nothing is known. Where the solid is
    /// cut off what is known of all of the facet's corners.
    std::array<std::uint8_t, 3> aside{kAnyTurn, kAnyTurn, kAnyTurn};
    float nz = 0;  ///< of the facet before cutting
};

/// Between which x, y and z the outward normals lie with which a ball outside the solid can touch a facet,
/// its edges and its corners: within the cone of the normals around it, and where the solid is cut off
/// between them and upright.
struct Facing {
    std::array<float, 3> low, high;
};

/// Between which x, y and z unit normals lie, in SolidFacet::kTurn.
struct NormalBox {
    std::array<std::int8_t, 3> low{-127, -127, -127}, high{127, 127, 127};
};
/// The normals with which a ball outside the solid can touch a facet's edges between their ends, and its
/// corners.
struct FacetNormals {
    std::array<NormalBox, 3> edge, corner;
};

/// What FacetGroup::kFacets facets that follow one another have in common, mm, rounded outward.
struct FacetGroup {
    static constexpr std::size_t kFacets = 8;
    std::array<float, 2> low{}, high{};  ///< x and y
    float z_min = 0, z_max = 0;
    float overhang = 0;  ///< the highest point of those whose own nz is under 0; −infinity: none
    /// A disc that they lie in: no point of theirs is farther than `radius` from the line through `middle`
    /// along the unit vector `axis`, nor than `thickness` from the plane square to it.
    std::array<float, 3> middle{}, axis{};
    float radius = 0, thickness = 0;
    Facing facing{};
};
/// Of each eight facets, in their order; the last may have fewer. @param normals of the facets; none: nothing
/// is known
[[nodiscard]] std::vector<FacetGroup> facet_groups(Context& context, std::span<const SolidFacet> facets,
                                                   std::span<const FacetNormals> normals = {});

/// The same facets side by side, for tests of all of them at once: corners, each an x, y and z relative to
/// the group's middle, and normals. Where a group has fewer facets, the others lie far below everything.
struct GroupCorners {
    template <class T>
    using Each = std::array<T, FacetGroup::kFacets>;
    alignas(32) std::array<std::array<Each<float>, 3>, 3> p;
    alignas(32) std::array<Each<float>, 3> normal;
    alignas(32) Each<float> nz;
    /// How far from the direction in which a facet faces, seen from above, a disc's may end that touches a
    /// corner from outside; kAny: nowhere in particular.
    alignas(32) std::array<Each<float>, 3> aside;
    alignas(32) Each<std::int32_t> edges;  ///< SolidFacet::edges, and three bits up SolidFacet::ends
    /// FacetNormals, by edge or corner and x, y and z.
    struct Normals {
        std::array<std::array<Each<std::int8_t>, 3>, 3> low, high;
    };
    alignas(8) Normals edge, corner;
    static constexpr float kAny = 3;
};
[[nodiscard]] BulkVector<GroupCorners> group_corners(Context& context, std::span<const SolidFacet> facets,
                                                     std::span<const FacetGroup> groups,
                                                     std::span<const FacetNormals> normals = {});

struct LayerSolid {
    double z_low = 0, z_top = 0;  ///< facets wholly below z_low are left out
    BulkVector<SolidFacet>
        facets;  ///< in Morton order of the mesh's facets: neighbours in space are near in memory
    Loops cap;   ///< the section kTopSheet below z_top: the solid's flat upper end
    std::array<double, 2> min{}, max{};  ///< of the facets, in x and y
    std::vector<FacetGroup> groups;      ///< of the facets, for fibres
    BulkVector<GroupCorners> corners;    ///< of the groups; none: fibres look at each facet by itself
    FacetTree tree;                      ///< of the facets, for drops
    CapCells cap_cells;                  ///< of the cap
    bool part = false;  ///< of a solid, or with unsure facets: it may be touched with any normal anywhere
};

/// Material thinner than this under the layer's top is not counted, mm: a facet that lies in the top plane to
/// within rounding belongs to the next layer.
inline constexpr double kTopSheet = 0.001;

/// Facets of the mesh that are turned stand the other way about, unsure ones both ways, inner ones are left
/// out.
/// @param z_low how far down a cutter of this layer can touch anything
[[nodiscard]] LayerSolid layer_solid(Context& context, MeshView mesh, double z_low, double z_top);

/// Of a solid's facets all that come within `reach` mm of some others, seen from above, and a few more. Where
/// a cutter of radius r covers some of those others, its contours on a grid are the whole solid's if `reach`
/// is 2r and twice the grid's pitch. For fibres: without cap and tree; extent and heights are the whole
/// solid's.
[[nodiscard]] LayerSolid solid_near(Context& context, const LayerSolid& solid,
                                    std::span<const SolidFacet> facets, double reach);

}  // namespace slabwright
