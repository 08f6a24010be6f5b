// Closed cylindrical bands of facets that look at their axis: the walls that holes are made of. Internal to
// features.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/features/holes.h"
#include "kernels/mesh/mesh.h"

namespace slabwright {

/// Edge k of a facet: from its corner k to the next.
struct FacetEdge {
    std::uint32_t facet;
    std::uint32_t corner;
};

/// How two facets meet.
struct Bend {
    double rad = 0;        ///< between their normals; positive where the air side is the narrower (concave)
    bool is_sure = false;  ///< false where a facet is too thin for its normal, or there is no neighbour
};

/// Normals of a mesh's facets, towards the air, and how they meet.
class FacetBends {
public:
    FacetBends(Context& context, MeshView mesh);
    [[nodiscard]] const Vec3d& normal(std::uint32_t facet) const { return normals_[facet]; }
    /// Whether a facet has a normal that rounding of its corners turns by less than a degree.
    [[nodiscard]] bool is_sure(std::uint32_t facet) const { return sure_[facet] != 0; }
    [[nodiscard]] Bend at(FacetEdge edge) const;
    [[nodiscard]] Vec3d corner(std::uint32_t facet, std::uint32_t k) const {
        return to_double(mesh_.vertices[mesh_.facets[facet][k % 3]]);
    }
    [[nodiscard]] const MeshView& mesh() const { return mesh_; }

private:
    MeshView mesh_;
    std::vector<Vec3d> normals_;
    std::vector<std::uint8_t> sure_;
};

/// A place along, and a distance from, an axis.
struct AxisPlace {
    double along, radius;
};

struct Cylinder {
    Point3 at{};   ///< on the axis
    Vec3d axis{};  ///< unit
    double radius = 0;
    [[nodiscard]] AxisPlace place(const Point3& p) const {
        const Vec3d d = minus(p, at);
        const double along = dot(d, axis);
        return {along, length(plus(d, axis, -along))};
    }
};

struct RoundWall {
    Cylinder cylinder;
    double tolerance_mm = 0;               ///< by which its corners may miss the cylinder
    double chord_mm = 0;                   ///< sagitta of its widest chord
    double low = 0, high = 0;              ///< mm along the axis: of all corners
    double round_low = 0, round_high = 0;  ///< between these it is whole all around (low > high: nowhere)
    std::array<std::vector<FacetEdge>, 2> ends;  ///< its edges at the low and at the high end
    std::vector<std::uint32_t> facets;           ///< ascending
};

/// All of them, by their first facet; no facet is in two.
[[nodiscard]] std::vector<RoundWall> find_round_walls(Context& context, const FacetBends& bends,
                                                      const HoleOptions& options);

/// Two directions at right angles to a unit one and to each other, right-handed with it.
[[nodiscard]] std::array<Vec3d, 2> across(const Vec3d& axis);

}  // namespace slabwright
