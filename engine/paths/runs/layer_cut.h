// What all operations of one layer share: what is cut, from what, with which tools.
#pragma once

#include <memory>
#include <vector>

#include "engine/layer_job.h"
#include "engine/moves/path_builder.h"
#include "kernels/cutting/drop.h"
#include "kernels/cutting/level_contours.h"
#include "kernels/features/alpha_map.h"

namespace slabwright {

/// Facets this near in height belong to one floor, mm.
inline constexpr double kSameFloor = 0.005;

class LayerStock;

struct LayerCut {
    Context& context;
    const LayerJob& layer;
    const Job& job;
    LayerSolid solid;
    double stock_top = 0;  ///< of the slab as bonded, mm

    /// The place of x or y stretched past the stock's edge by `beyond`, kept within the travel of the
    /// machine.
    [[nodiscard]] double low(int axis, double beyond) const;
    [[nodiscard]] double high(int axis, double beyond) const;
    /// The stock, seen from above.
    [[nodiscard]] Loops stock_outline() const;
    /// Smallest slope (radians from level) of the facets to be machined between z0 and z1 that are at least
    /// `steepest_flat` steep; π/2 where there are none.
    [[nodiscard]] double least_slope(double z0, double z1, double at_least) const {
        return alpha.least(z0, z1, at_least);
    }
    /// Sections of the mesh for the tip heights of a cutter, in their order.
    [[nodiscard]] std::vector<Section> insides(const CutterShape& cutter,
                                               std::span<const double> tip_z) const;
    /// The contour of every level, levels in parallel.
    [[nodiscard]] std::vector<Contours> contours(const CutterShape& cutter, std::span<const double> tip_z,
                                                 std::int32_t pitch) const;
    [[nodiscard]] Operation operation(OperationKind kind, const char* purpose, const Tool& tool) const;

    /// Heights of the floors that the flat end mill finishes, descending: the highest vertex of each flat,
    /// for the facets of a flat may differ in their last bits. Flats within kSameFloor are one.
    std::vector<double> floors;
    AlphaMap alpha;  ///< from floor_below to the layer's top

    /// Drops of a cutter; made at the first call and kept. Call it from the layer's own thread only.
    [[nodiscard]] const DropIndex& drops(const CutterShape& cutter) const;
    /// What a tool's links must know; `part` as for Surroundings.
    [[nodiscard]] Surroundings around(const Tool& tool, const DropIndex* part) const;
    Standing* standing = nullptr;       ///< what stands after the operations so far; null: not known
    const LayerStock* stock = nullptr;  ///< the same, finer, and what is to be made of it; null: not known
    mutable std::vector<std::pair<CutterShape, std::unique_ptr<DropIndex>>> made_drops{};
    mutable std::vector<std::array<double, 3>> no_way_in{};  ///< where runs were left out (Surroundings)
};

}  // namespace slabwright
