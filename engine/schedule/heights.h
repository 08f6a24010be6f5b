// The heights of the build on the machine: where table, programs' zero and spindle stand in every layer, and
// whether all of them lie within their travels (RPM).
//
// Heights of the machine count from where the programs' z = 0 lies in the first layer. A table that moves
// sinks by every layer, so that each layer's top is cut where the first one's was; the spindle then needs the
// travel of one layer. On a fixed table it needs that of the whole build.
#pragma once

#include <span>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// Where a layer stands on the machine, mm.
struct LayerHeights {
    double origin = 0;       ///< the programs' z = 0, pattern-base
    double table = 0;        ///< the build table's surface, machine
    double work_offset = 0;  ///< the programs' z = 0, machine: by how much the control's offset has moved
};

/// @param first_top, layer_top z_top of the first layer and of the one asked for, pattern-base, mm
[[nodiscard]] LayerHeights layer_heights(const Machine& machine, double first_top, double layer_top);

/// Seconds that the table takes from one height to another; 0 where it is fixed.
[[nodiscard]] double table_seconds(const Machine& machine, double from, double to);

/// Seconds that pressing a slab takes: glue under pressure and, where a handler holds the slab, the table's
/// way up to it and back, and its clamps.
[[nodiscard]] double press_seconds(const Job& job);

/// kg of a slab of this size and thickness.
[[nodiscard]] double slab_mass_kg(const Plan& plan, const Blank& blank, double thickness);
/// kg of the base board, which is as large as the plan's stock.
[[nodiscard]] double board_mass_kg(const Plan& plan);

/// A slab in the feed chamber.
struct FeedSlab {
    double thickness = 0;  ///< mm
    double kg = 0;
};

/// Every slab of the build from a layer on, in the order in which they are taken.
[[nodiscard]] std::vector<FeedSlab> feed_slabs(const Plan& plan, std::size_t from_layer = 0);

/// How many slabs are stacked in the feed chamber at a time: as many as its height and its table's load
/// allow, in the order of the build. Empty where slabs are laid by hand.
/// @throws as check_chambers
[[nodiscard]] std::vector<int> feed_loads(const Plan& plan);
/// The same of any slabs, whether or not each fits. @param slabs in the order in which they are taken
[[nodiscard]] std::vector<int> feed_loads(const Machine& machine, std::span<const FeedSlab> slabs);

/// Tells a step the lowest and the highest z of its program, as the program counts them: z_low_mm, z_high_mm.
/// @param operations that the program holds, @param origin of its z = 0, mm, pattern-base
void add_heights(SequenceStep& step, std::span<const Operation> operations, double origin);

/// Looks at layers and slabs alone, before any path is made.
/// @throws Error(no_plan, "machine.build_height") where the table would have to sink farther than its
/// chamber, "machine.feed_height" or "machine.feed_mass" where a slab is more than the feed chamber takes;
/// and as check_handler
void check_chambers(const Plan& plan);

/// Every program of every layer against the spindle's travel, with what its tool sticks out: the lengths of
/// the tools differ, and the offset of the tool's length moves the spindle by as much.
/// @throws Error(no_plan, "machine.travel_z") that names layer, height and limit
void check_spindle(const Plan& plan);

}  // namespace slabwright
