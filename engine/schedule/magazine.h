// The machine's magazine: which tool stands in which place, and when one is taken out for another.
//
// Tools are put in by hand. Every place that can be filled is filled before the first program, which costs no
// swap; from then on a place is emptied only for a tool that the next program needs and that is not in.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// The tools that a program needs, each once, and the one that it leaves in the spindle.
struct ProgramTools {
    std::vector<int> tools;
    int last = 0;
};

/// A tool that is put into a place of the magazine, from 1, and what is taken out of it; 0: it was empty.
struct ToolLoad {
    int place = 0, tool = 0, tool_out = 0;
    friend bool operator==(const ToolLoad&, const ToolLoad&) = default;
};

/// What is to be put in before each program, with the fewest swaps (METHOD.md section 12): Belady's rule, the
/// tool that is needed again last goes out. Where several are needed no more, that in the spindle goes last
/// and the lowest number first. Places that are empty are filled before the first program: tools in the
/// order in which they are needed, then by number into places by number.
/// @param programs in the order of execution, none with more tools than places
/// @param loaded the tool in each place, 0 for an empty one; its size is the magazine's
/// @param spindle the tool in the spindle before the first program; 0: none. Its place in the magazine is
/// kept for it
/// @returns for each program, in their order
[[nodiscard]] std::vector<std::vector<ToolLoad>> plan_tool_loads(std::span<const ProgramTools> programs,
                                                                 std::vector<int> loaded, int spindle);

/// The tool in each place when a sequence begins: those of its load_tool that take nothing out; 0 where a
/// place is empty.
/// @param places of the magazine
[[nodiscard]] std::vector<int> magazine_at_start(std::span<const SequenceStep> steps, int places);

/// Adds the steps load_tool to a sequence. Without a magazine (Machine::magazine 0) it adds none.
class MagazineSteps {
public:
    /// @param steps, machine outlive this @param loaded, spindle as of plan_tool_loads(); empty: no tool is
    /// in @throws Error(no_plan, "machine.magazine") where a program needs more tools than there are places
    MagazineSteps(std::vector<SequenceStep>& steps, const Machine& machine,
                  std::vector<ProgramTools> programs, std::vector<int> loaded = {}, int spindle = 0);

    /// The steps that fill empty places. @param needs of each
    void fill(int layer, const std::set<int>& needs);
    /// The swaps before a program. @param needs of what comes next, which is told of the steps that put in
    /// what the program uses
    void load_for(std::size_t program, int layer, std::set<int>& needs);
    /// The place that a tool stands in; 0: in none.
    [[nodiscard]] int place_of(int tool) const;
    /// How often a tool was taken out for another.
    [[nodiscard]] int swaps() const { return swaps_; }

private:
    SequenceStep& load(int layer, const ToolLoad& load, const std::set<int>& needs);

    std::vector<SequenceStep>& steps_;
    const Machine& machine_;
    std::vector<ProgramTools> programs_;
    std::vector<std::vector<ToolLoad>> loads_;
    std::vector<int> in_place_;
    std::map<int, int> unused_;  // a tool that no program has used since, and the step that put it in
    int spindle_ = 0, swaps_ = 0;
};

}  // namespace slabwright
