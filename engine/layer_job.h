// What one layer is planned from: its mesh, heights, stock and tools.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/plan.h"
#include "engine/tools/tools.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/progress_part.h"

namespace slabwright {

template <class T>
class ScratchPool;
struct StockMemory;

/// Of a layer's time, its paths; the forces that follow take the rest.
inline constexpr double kPathsShare = 0.78;

/// An up-facing flat of at least cutting.min_flat_area. Its facets may differ in their last bits.
struct Flat {
    double z = 0, highest = 0;  ///< mm: its height, and that of its highest vertex
};

/// A vertical hole, as a layer's drill or end mill makes it.
struct DrilledHole {
    double x = 0, y = 0;  ///< mm
    double top = 0;       ///< mm: what stands there once all else is cut
    double tip = 0;       ///< mm: how low the tool's tip goes
    int tool = 0;         ///< Tool::number
    double around = 0;    ///< mm: of the circle on which an end mill's middle goes down; 0: straight down
};

/// Minutes of a layer's programs and changes of tool, at the feeds that they are planned with, up to the end
/// of each stage of its paths: waste cleared, level contours, projected finish, all.
using LayerPace = std::array<double, 4>;

/// What a set of tools has to come near.
struct PaceAhead {
    LayerPace pace{};   ///< of the best set so far
    LayerPace least{};  ///< share of what that still has to do after each stage that is left to this one, too
    double times = 1.2;  ///< as long, and it is given up; adapted feeds seldom make up for more
};

/// How deep roughing in terraces may cut where the slab hangs over, mm.
struct RoughSteps {
    double last = 0;     ///< that the last levels go down
    int last_count = 0;  ///< how many these are
    double deepest = 0;  ///< of all other levels; 0: what the tool takes
};

/// A layer's work is a value in and a value out.
struct LayerJob {
    /// The pattern, pattern-base, or a lighter one that lies as near to it as the job's `gouge` leaves room
    /// for; the whole of it, or what of it the layer's cutters may meet (part_between).
    MeshView mesh;
    const Job* job = nullptr;
    double z_bottom = 0, z_top = 0, slab_thickness = 0;
    double floor_below = 0;  ///< the lowest z that a tip may reach: z_bottom less what may be cut under it
    std::array<double, 2> stock_min{}, stock_max{};  ///< mm
    int index = 0;
    LayerTools tools;
    Loops opening;                     ///< of the flask in this layer; empty: no flask
    std::vector<DrilledHole> drilled;  ///< closed in the mesh: nothing else cuts them
    std::vector<Flat> flats;           ///< strictly between z_bottom and z_top
    bool walls_first = false;  ///< vertical walls are finished, level by level, before the floors beside them
    ProgressPart* progress =
        nullptr;             ///< told how far the paths are, up to kPathsShare; the rest is the caller's
    std::vector<Flat> feet;  ///< on which walls of this layer may stand: `flats` and those just below
    bool paced = false;      ///< its pace is asked for
    std::optional<PaceAhead> ahead;  ///< when these tools cannot come near it they are given up
    RoughSteps rough_steps;          ///< of roughing in terraces, for the wood's sake
    ScratchPool<StockMemory>* stock_memory =
        nullptr;  ///< which layers leave to each other; null: this one has its own
};

}  // namespace slabwright
