// Where an interrupted build stands: what the machine should be found like, and what a person must look at
// before it goes on.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/simulate/build_replay.h"

namespace slabwright {

enum class GlueState : std::uint8_t {
    none,
    spread,    ///< wet on the stack, no slab on it
    unpressed  ///< under a slab that has not been pressed
};
[[nodiscard]] std::string_view name(GlueState state);

struct ResumePoint {
    int layer = 0;                ///< that lies on top; 0: none is placed
    int slabs = 0;                ///< on the stack
    double bonded_mm = 0;         ///< the stack's height above the base board
    double stack_mm = 0;          ///< above the build table, base board included
    double tolerance_mm = 0;      ///< by which a measured height may differ
    bool faced = false;           ///< the layer on top has been faced
    double load_kg = 0;           ///< on the build table
    int in_feed = 0;              ///< slabs in the feed chamber
    bool in_hand = false;         ///< the material handler holds one
    int tool = 0;                 ///< in the spindle; 0: none
    std::vector<int> magazine{};  ///< the tool in each place, 0 for none; empty: there is no magazine
    GlueState glue = GlueState::none;
    bool glue_lost = false;                ///< it has waited longer than its open time
    std::optional<double> table_mm;        ///< the table's surface (LayerHeights::table); none: not moved yet
    std::optional<double> work_offset_mm;  ///< by how much the control's Z offset has moved since layer 1
    /// Where the stack's top must be found now, mm in the programs' frame, and the spindle's nose then, mm
    /// as table_mm counts; none while the table is not at the height of the layer on top.
    std::optional<double> touch_off_mm, nose_mm;
    std::vector<std::string> checks;  ///< what to look at by hand, a sentence each
};

/// @param state of the plan's build, after `state.done` steps. @param waited_s seconds since then
/// A measured height may differ by what the base board does (EN 622-5: .2 mm, .3 mm above 19 mm), and by what
/// the slab on top does until that is faced.
[[nodiscard]] ResumePoint resume_point(const BuildPlan& plan, const BuildSequence& sequence,
                                       const BuildState& state, double waited_s);

}  // namespace slabwright
