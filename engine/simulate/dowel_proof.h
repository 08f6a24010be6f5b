// Whether the holes for dowels are made as planned, from the programs' text, and stand in wood on all sides.
//
// A hole in the pattern's wood is a gouge unless it is a dowel's: within the dowel's radius, from the joint
// down to the hole's depth, both with kDowelTolerance. It is filled by the dowel and covered by the slab
// above, so it is no surface that stays visible; that it keeps off all of these is looked at here too. Below
// the stock's gouges the next layers' cutters need no check of their own: what they may not enter holds the
// dowel with its clearance.
#pragma once

#include <optional>
#include <vector>

#include "engine/simulate/program.h"
#include "engine/simulate/simulate.h"
#include "kernels/access/standing_part.h"
#include "kernels/parallel/context.h"
#include "kernels/stock/stock.h"

namespace slabwright {

/// How far a hole may be off its dowel's place, diameter and depth, mm.
inline constexpr double kDowelTolerance = 0.1;

/// A program with its tip held at the layer's top where it is in a hole of one of the layer's dowels; none
/// where it enters none. What enters a hole or leaves it other than from above stays as it is.
/// @param tool that it loads
[[nodiscard]] std::optional<Program> above_dowels(const Program& program, const SimulatedLayer& layer,
                                                  const Tool& tool);

/// Puts dowels into the holes of the topmost slab's top, as deep and as wide as planned; deeper ones stay.
void fill_dowels(Stock& stock, const SimulatedLayer& layer);

/// Violations, each with the dowel's place and layer: dowel.missing (no program of the layer makes a hole
/// there), dowel.place, dowel.diameter, dowel.depth (by more than kDowelTolerance), dowel.rapid (a rapid goes
/// down in it deeper than was cut before), dowel.wood (a surface of the pattern comes nearer than the
/// clearance, kDowelTolerance less, a hole ends outside of its slab, or two of one slab meet).
/// @param clearance mm of wood around a hole; negative: what is around it is not looked at
/// @throws Error(cancelled)
[[nodiscard]] std::vector<Violation> check_dowels(Context& context, const SimulationInput& input,
                                                  const StandingPart& part, double clearance);

}  // namespace slabwright
