// What no tool may run into, as it stands in each layer, and programs that keep clear of it: rapids, and ways
// by feed that cut nothing, go over it; a cut that must enter is refused.
//
// A tool is a stack of cylinders: the cutter from its tip up, the shank from the flutes' end, the holder from
// its nose. It enters a keep-out where one of them is nearer to its area than the clearance, seen from above,
// and lower than its top. What is raised can so never enter where it did not before.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// A keep-out in a layer, mm, in the frame of the plan.
struct KeepOutZone {
    std::string name;
    std::vector<std::array<double, 2>> corners;  ///< of a polygon; empty: a circle
    double x = 0, y = 0, radius = 0;             ///< of the circle
    double top = 0, clearance = 0;               ///< z; around it and over it
    std::array<double, 2> box_min{}, box_max{};  ///< of its area
};

/// How far a straight way is from a zone's area, seen from above, mm; 0 where it meets it. @param near gets
/// the way's place that is nearest
[[nodiscard]] double distance_to(const KeepOutZone& zone, const std::array<double, 2>& from,
                                 const std::array<double, 2>& to, std::array<double, 2>* near = nullptr);

/// The job's keep-outs that stand in a layer: those on the base board, and those on the slab that its blank
/// carries. @param origin that the plan's x and y count from (engine/planner/local_frame.h), mm
[[nodiscard]] std::vector<KeepOutZone> keep_outs_in(const Plan& plan, const Layer& layer,
                                                    const std::array<double, 2>& origin = {});

/// Holds the keep-outs against the layers' slabs, before any path is made: adds a warning "keep_out.slab" for
/// each keep-out on the slab that some layers' slabs do not carry.
/// @throws Error(no_plan, "keep_out.entered") where a slab would lie on what stands on the base board;
/// Error(no_plan, "keep_out.slab") where no layer's slab carries a keep-out that stands on one; of a slab
/// that is milled from below that is only warned of
void place_keep_outs(Plan& plan, const std::array<double, 2>& origin = {});

/// Keep-outs farther along x and y, mm.
[[nodiscard]] std::vector<KeepOut> moved(std::vector<KeepOut> keep_outs, const std::array<double, 2>& by);

/// The plan's keep-outs as the programs of its slabs' undersides count: these slabs lie with their left front
/// corner on the board's. @param origin that the plan's x and y count from, mm
[[nodiscard]] std::vector<KeepOut> keep_outs_below(const Plan& plan,
                                                   const std::array<double, 2>& origin = {});

/// Has an operation of a layer keep clear: its clearance height lies 1 mm over what rapids need to pass over
/// every zone; rapids, and moves by feed beside or above the slab, that would enter a zone go up before it,
/// on the same way over it, and down behind it. With no zones it stays as it is.
/// @param stock_top z of the highest stock in the layer, mm
/// @throws Error(no_plan, "keep_out.entered") where another move enters one
void keep_clear(const Plan& plan, const Layer& layer, double stock_top, Operation& operation,
                const std::vector<KeepOutZone>& zones, const std::array<double, 2>& origin = {});

/// The same of all operations of a plan's layers. @param only these; empty: all
void keep_clear(Plan& plan, const std::array<double, 2>& origin = {}, const std::vector<bool>& only = {});

}  // namespace slabwright
