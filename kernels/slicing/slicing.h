// Sections of a mesh by horizontal planes.
#pragma once

#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// A plane at z is met from one side only, so that a facet lying in it belongs to exactly one side:
/// `above` is the limit z + 0 (vertices at z count as below), `below` the limit z − 0 (vertices at z count as
/// above).
enum class Side : std::uint8_t { below, above };

struct Plane {
    double z = 0;  ///< mm
    Side side = Side::above;
};

/// The polygons of solid ∩ plane. Points lie where mesh edges cross the plane, rounded to 0.1 µm; outer loops
/// run counter-clockwise, holes clockwise. Each starts where it leaves its facet of lowest index; they are in
/// the order of that facet. Where the mesh has facets that are not all surface (MeshView::roles) the loops
/// are the outline of what they wind around, in either sense: where the winding number is not zero.
struct Section {
    Plane plane;
    Loops loops;  ///< nested
    /// Chains that an open mesh leaves unclosed, as point lists in the manner of Loops (not closed).
    Loops open_chains;
    std::uint32_t closed_gaps = 0;  ///< ends of open chains that were joined
};

struct SliceOptions {
    /// Open chains whose ends are this near are joined, nearest ends first, and counted in `closed_gaps`; 0:
    /// none.
    double close_gap_mm = 0;
};

/// Cuts the mesh by all planes at once, in parallel; results come in the order of the request, and are
/// bit-identical on any number of threads. A mesh whose adjacency is closed gives closed loops at every
/// height, those of vertices, edges and flats included. Loops of fewer than three distinct points or no area
/// are dropped.
/// @param mesh adjacency filled; a facet that runs against its neighbour is not linked to it and leaves open
/// chains
/// @param planes any order, any number, repeats allowed
/// @throws Error(usage) for a plane that is not finite or a gap that is not a length, Error(input) for
/// vertices that are not
///         finite or past 214 m in x or y and for indices out of range, Error(no_plan, "memory.limit"),
///         Error(cancelled)
[[nodiscard]] std::vector<Section> slice(Context& context, MeshView mesh, std::span<const Plane> planes,
                                         const SliceOptions& options = {});

}  // namespace slabwright
