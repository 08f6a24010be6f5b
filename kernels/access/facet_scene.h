// The facets of a part in Embree's trees, and what a tool at a place asks of them.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/access/tree_memory.h"
#include "kernels/geometry/triangle.h"
#include "kernels/geometry/wide.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace slabwright {

/// Of the coordinates' size: Embree works in float32 and only finds candidates.
inline constexpr double kFloatMargin = 4e-7;

/// What a facet leaves below a height: none, one or two triangles.
struct BelowHeight {
    std::array<Triangle, 2> t;
    int n = 0;
};
[[nodiscard]] BelowHeight below_height(const Triangle& t, double top);

/// Floats4 planes of a facet, n·p + d: its own, and those upright on it through its edges, which face
/// outward. A line of the cache says how far a place is from most facets, in single precision.
struct FacetPlanes {
    Floats4 x, y, z, d;
    /// Whether the square of the distance is more, as far as the planes tell: they do not where a corner is
    /// nearest, and on slivers.
    [[nodiscard]] bool farther(const Vec3f& p, float squared) const {
        const Floats4 at = x * p.x + y * p.y + z * p.z + d, none{}, beside = at > none ? at : none,
                      over{at[0], at[0], at[0], at[0]};
        const auto lanes =
            std::bit_cast<std::array<std::uint64_t, 2>>(over * over + beside * beside > squared);
        return ((lanes[0] >> 32U) | lanes[1]) != 0;  // of the edges' planes
    }
};

/// Of a mesh that outlives it. Many threads may ask at once.
class FacetScene {
public:
    /// @throws Error(input, "mesh.not_finite"), Error(no_plan, "embree.device"), Error(no_plan,
    /// "embree.build"), Error(no_plan, "memory.limit"), Error(cancelled)
    FacetScene(Context& context, MeshView mesh);
    FacetScene(const FacetScene&) = delete;
    FacetScene& operator=(const FacetScene&) = delete;

    [[nodiscard]] MeshView mesh() const { return mesh_; }
    [[nodiscard]] const Box3& box() const { return box_; }
    [[nodiscard]] double margin() const { return margin_; }  ///< mm that Embree's distances may be wrong by
    [[nodiscard]] const FacetPlanes& planes(std::uint32_t facet) const { return planes_[facet]; }
    /// The facets that face down, but for those of the bottom.
    [[nodiscard]] const std::vector<std::uint32_t>& overhangs() const { return overhangs_; }
    [[nodiscard]] RTCSceneTy* all() const { return all_.get(); }
    /// By their place in overhangs(); null where there are none.
    [[nodiscard]] RTCSceneTy* hanging() const { return hanging_.get(); }
    [[nodiscard]] Triangle triangle(std::uint32_t facet) const;
    /// The height of the first facet that a ray down from z meets, or `none`.
    /// @param leaves_solid whether it leaves the solid there
    [[nodiscard]] double first_below(double x, double y, double z, bool& leaves_solid, double none) const;
    struct RayHit {
        std::uint32_t facet = kNoFacet;  ///< kNoFacet: none
        double distance = 0;             ///< mm
    };
    /// The first facet that a ray meets, from `least` to `most` mm along a unit direction.
    [[nodiscard]] RayHit first_along(const Point3& from, const Vec3d& direction, double least,
                                     double most) const;
    /// Whether an overhang lies straight above, below a height.
    [[nodiscard]] bool overhung(const Point3& from, double top) const;

private:
    struct Release {
        void operator()(RTCDeviceTy* device) const;
        void operator()(RTCSceneTy* scene) const;
    };
    using EmbreeScene = std::unique_ptr<RTCSceneTy, Release>;

    [[nodiscard]] EmbreeScene build(std::span<const Index3> facets);

    MemoryCharge planes_memory_;
    TreeMemory memory_;
    MeshView mesh_;
    double margin_ = 0;
    std::vector<FacetPlanes> planes_;
    Box3 box_;
    std::vector<std::uint32_t> overhangs_;
    std::unique_ptr<RTCDeviceTy, Release> device_;
    EmbreeScene all_, hanging_;
};

}  // namespace slabwright
