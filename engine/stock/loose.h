// Pieces of waste that come loose while a layer is cut (METHOD.md section 11, Breakthrough). Nothing of how
// the paths were made is known here: the slab just above its layer's bottom is drawn on a grid, and the moves
// that cut it through are run backwards.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/plan.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A slab and what holds it. Millimetres.
struct HeldSlab {
    std::array<double, 2> min{}, max{};
    double z_bottom = 0, z_top = 0;
    Loops kept;  ///< what of it stays and is glued to what is below: the pattern, the flask
};

/// A piece that nothing holds any more, when that happens.
struct LoosePiece {
    double area_mm2 = 0;
    double thickness_mm = 0;              ///< of what stands of it over the layer's bottom then, at most
    double x = 0, y = 0;                  ///< its centroid, mm
    std::size_t operation = 0, move = 0;  ///< that cut it off
};

/// Pieces smaller than this are chips, mm².
inline constexpr double kChip = 20;

/// The pieces of at least `smallest_mm2` that the operations cut off, in the order in which they come loose.
/// Waste is held when it hangs together, side by side, with what stays: no glue is put under waste.
/// @param operations of one layer in the order of execution, straight moves only; face milling cuts nothing
/// through
/// @param cell mm between the grid's points; 0: 1 mm, coarser over slabs of more than 4 m²
[[nodiscard]] std::vector<LoosePiece> loose_pieces(Context& context, const HeldSlab& slab,
                                                   std::span<const Operation> operations,
                                                   std::span<const Tool> tools, double smallest_mm2 = kChip,
                                                   double cell = 0);

}  // namespace slabwright
