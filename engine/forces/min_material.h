// How thick the wood above a layer boundary must be to bear being cut where its slab hangs over (LUO 6.3;
// METHOD.md section 9).
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "engine/layer_job.h"
#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The thinnest slab, mm, that bears the hardest cut of every end mill of the job `overhang_mm` from where it
/// is glued: LUO's strip as wide as the cutter's radius, cut as deep as the cutter may step or as it is
/// thick, whichever is less, the force in the middle of that depth above the joint. In LUO 6.5.2 (2 in, 3 mm
/// deep) that is .124 in.
/// @throws Error(usage, "forces.segment") for a tool or material that the force model does not take
[[nodiscard]] double least_material(const Job& job, double overhang_mm);

/// The steps of roughing for the wood's sake, where a slab hangs over by up to `overhang_mm`: the last two
/// levels are shallow, so that the last one cuts through no more than a sliver that tears off (least_slab),
/// for a slab as thin as a whole step would bend; the others are even and no finer than the tool is made for,
/// and the layer bears their cuts two thirds as far out, for roughing seldom meets the hardest cut, which
/// this is reckoned by. Only the last level is shallow, or none is, where that makes a level fewer, and what
/// stands where the lowest of the others is cut bears that three quarters as far out. Where there are no such
/// steps all are shallow, and where the layer would not bear them even half as far out the last two are as
/// the others: what breaks there breaks anyway.
/// @param layer_mm its height
/// @throws Error(usage, "forces.segment") as least_material
[[nodiscard]] RoughSteps rough_steps(const Job& job, const Tool& tool, double overhang_mm, double layer_mm);

/// How far each place of the stock lies from what carries it, on a grid of 1/256 of the stock's longer side.
struct OverhangMap {
    std::array<double, 2> low{};
    double cell = 1;
    int nx = 0, ny = 0;
    std::vector<float>
        mm;  ///< row by row; 0 over a region, the stock's diagonal everywhere when there is none
    /// At a place, by the cell that it lies in or, outside of the stock, the nearest one.
    [[nodiscard]] double at(double x, double y) const;
    [[nodiscard]] double largest() const;
};

/// The side of a cell of the map of a rectangle, mm.
[[nodiscard]] double overhang_cell(const std::array<double, 2>& low, const std::array<double, 2>& high);

/// @param carried the regions that carry, by cells whose middle they hold
[[nodiscard]] OverhangMap overhang_map(std::span<const Loops* const> carried,
                                       const std::array<double, 2>& stock_min,
                                       const std::array<double, 2>& stock_max);

/// How far, in mm, the slab that is glued at height z reaches past what carries it there: the largest
/// distance of any place of the stock's rectangle from the section just below z, or from the flask where
/// there is one, and the glue's setback on top of it. The section is drawn on a grid of 1/256 of the stock's
/// longer side, so the answer is too large by up to three of its cells. Taken at the features' heights (at
/// most 128); between two of them it is the larger of the two.
struct SlabOverhang {
    std::vector<double> heights, overhangs;  ///< mm, heights ascending
};

/// @param plan its job, stock and features
[[nodiscard]] SlabOverhang slab_overhang(Context& context, MeshView mesh, const Plan& plan);

/// least_material over the slab's overhang, as a function of the boundary's height.
[[nodiscard]] std::function<double(double z)> min_material(Context& context, MeshView mesh, const Plan& plan);

}  // namespace slabwright
