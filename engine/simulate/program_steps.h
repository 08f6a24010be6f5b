// What the steps that run programs must say of them, and what of the machine they ask.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/simulate/build_replay.h"
#include "engine/simulate/build_state.h"
#include "engine/simulate/planned_build.h"
#include "engine/simulate/sequence_findings.h"
#include "engine/simulate/step_order.h"

namespace slabwright {

/// The part of the replay that knows programs. A step runs one file, which holds one program of the plan or
/// several, one after another (file_of); a face_off runs one of BuildPlan::face_offs.
class ProgramSteps : public SequenceFindings {
protected:
    /// @param plan has a layer; it and `steps` outlive this
    ProgramSteps(const BuildPlan& plan, const std::vector<SequenceStep>& steps, BuildState from)
        : SequenceFindings(steps), plan_(plan), build_(plan), s_(std::move(from)), order_(steps) {}

    static constexpr double kLength = 1e-3;   ///< mm by which stated lengths may differ: both are rounded
    static constexpr double kSeconds = 0.02;  ///< a program's minutes are rounded to four places

    void expect_layer(std::size_t layer);
    /// The programs of the plan in the file that the step names, first and past the last; none where no
    /// program lies in such a file.
    std::optional<std::array<std::size_t, 2>> named_file();
    /// The place of the program that a face_off names; none where the list has no such program.
    std::optional<std::size_t> named_face_off();
    /// Where `cause` has happened, the step must not begin before it.
    void wait_for(Cause cause);
    /// Holds the step against the programs [begin, end) of its file.
    void check_file(std::size_t begin, std::size_t end);
    /// The tool that the step names, and the one in the spindle, against the program that runs first.
    void check_tool(const PlannedProgram& planned);
    /// Whether the tools of the programs stand in the magazine, where the machine has one, and since when.
    void check_magazine(std::span<const PlannedProgram> programs);
    /// The index of the place that a tool stands in; none where it stands in none.
    [[nodiscard]] std::optional<std::size_t> place_of(int tool) const;
    /// What the step says of the heights of its file's programs, and where they bring the spindle.
    void check_heights(std::span<const PlannedProgram> programs);

    const BuildPlan& plan_;
    const PlannedBuild build_;
    BuildState s_;
    StepOrder order_;

private:
    /// What the step says of its file: purposes, time, and the changes of tool in it.
    void check_contents(std::size_t begin, std::size_t end);
    void check_travel(const PlannedProgram& planned);

    bool spindle_told_ = false;
};

}  // namespace slabwright
