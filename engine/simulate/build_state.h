// The state of the machine between two steps of a sequence: all that the replay must know to go on from
// there.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

namespace slabwright {

/// The step that brought something about, by its place in the list, from 0; none: it does not hold.
using Cause = std::optional<std::size_t>;

/// After the first `done` steps of the list. A fresh one is the machine before the first step.
struct BuildState {
    std::size_t done = 0;
    Cause board, loaded, last_taken, in_hand, clamped, hand_free, glued, to_press, pressed;
    Cause dowels;       ///< they stand in the stack's top
    Cause stack_ready;  ///< glue may go on it: the board, or the last program of the layer below
    Cause table_at;     ///< the table is at the height of the layer on top
    Cause touched, tool_in, last_cut, unloaded, boxed;
    std::size_t taken = 0, placed = 0;  ///< slabs of the build, from the bottom
    std::size_t next_program = 0;       ///< index into the plan's programs
    int in_feed = 0;                    ///< slabs in the feed chamber
    int spindle_tool = 0;               ///< 0: none
    bool unused_change = false;         ///< no program has run since the tool was put in
    double feed_height = 0;             ///< mm, of the stack in the feed chamber
    double handler = 0;                 ///< mm, of the material handler from the feed chamber's middle
    double load_kg = 0;                 ///< on the build table: board and whole slabs
    double board_thickness = 0;         ///< mm
    std::optional<double> table;        ///< mm, the table's surface; none: it has not been moved yet
    double lowest = std::numeric_limits<double>::infinity(),
           highest = -std::numeric_limits<double>::infinity();  ///< mm, of the spindle so far
    std::vector<int> magazine;        ///< the tool in each of its places, 0 for none; empty: no magazine
    std::vector<Cause> magazine_set;  ///< the step that put each of them in
    std::vector<Cause> ran_in;  ///< of each program of the plan, the step in which it ran on what stands
    std::vector<Cause> undersides_milled, slabs_turned;  ///< of each underside of the plan
    std::vector<Cause> faced_off;  ///< of each program that faces a layer off, the step in which it ran

    friend bool operator==(const BuildState&, const BuildState&) = default;
};

}  // namespace slabwright
