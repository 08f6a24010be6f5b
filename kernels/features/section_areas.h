// The area of a mesh's section as a function of height, without slicing.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Answers "how large is the section at z" in microseconds once it is made, from any thread. The part of a
/// closed surface above a plane and the section close one another, so the section's area is the sum of what
/// the facets above cover in plan, signed: Σ N_z·A over the parts of facets above z. Exact up to rounding
/// where the mesh is closed above z. Where its facets are not all surface (MeshView::roles) it is sliced,
/// since overlaps would count twice; the context must then outlive this. Keeps a view of the mesh, and
/// charges 4 bytes for each slab of 1/1024 of the height that a facet reaches into; while it is made, 4 bytes
/// more for each facet.
class SectionAreas {
public:
    /// @throws Error(no_plan, "memory.limit"), Error(cancelled)
    SectionAreas(Context& context, MeshView mesh);
    [[nodiscard]] double operator()(double z) const;  ///< mm², just above z
    /// ∫ area dz from `low` to `high`, mm³; 0 where high is not above low. By what the facets cover in plan
    /// it is exact up to rounding, Σ N_z·A·(z of the part's centroid − z) over the parts of facets above z,
    /// level facets included; where the mesh is sliced, by Simpson's rule on 64 pieces.
    [[nodiscard]] double volume_between(double low, double high) const;

private:
    [[nodiscard]] std::size_t slab(double z) const;
    [[nodiscard]] double volume_above(double z) const;
    MeshView mesh_;
    Context* context_ = nullptr;  // to slice with, if that is how
    double bottom_ = 0, pitch_ = 1;
    std::vector<double> whole_;    // per slab: area in plan of the facets that lie wholly above it
    std::vector<double> moments_;  // the same, each times its centroid's height, mm³
    std::vector<std::uint32_t> starts_;
    BulkVector<std::uint32_t> facets_;  // per slab: facets that reach into it and cover something in plan
    std::shared_ptr<MemoryCharge> charge_;
};

}  // namespace slabwright
