// A build that was interrupted: where it stands, what to check, and what is left; and a spoilt layer made
// again. The front door of `slabwright resume`.
//
// OUT/progress.json says which step was the last one finished, and the state that the machine is in then
// (io/FORMATS.md). It belongs to one plan and one sequence: those of other bytes are refused.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/plan.h"
#include "kernels/export.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct ResumePoint;

struct ResumeOptions {
    std::optional<int> after;  ///< the last step that was finished, 0 for none: it is written down
    std::optional<int>
        remake;              ///< a layer that is spoilt: programs and sequence to make it again are written
    std::int64_t now_s = 0;  ///< seconds since 1970, UTC
};

struct ResumeStatus {
    std::string sequence;                ///< the file that is in force, from OUT
    int after = 0;                       ///< the last step finished; 0: none
    std::optional<std::int64_t> time_s;  ///< when that was written down; none: nothing was
    std::shared_ptr<const ResumePoint> point;
    std::vector<SequenceStep> steps;  ///< of the whole sequence; those behind `after` are left
    double minutes_left = 0;
    std::vector<std::string> programs;  ///< that were written to face layers off, from OUT
};

/// @param directory OUT
/// @throws Error(input) "resume.plan", "resume.progress" (cannot be read), "resume.other_plan",
/// "resume.other_sequence" (progress of another plan or sequence), "resume.state" (not what the sequence
/// brings about); Error(verification, "resume.sequence") where the sequence cannot be run;
/// Error(usage, "resume.step") for a step that it does not have; as remake_layer(); Error(no_plan,
/// "resume.remake") where the machine cannot face the layer off: nothing has been written then
[[nodiscard]] SLABWRIGHT_API ResumeStatus resume_build(Context& context, const std::string& directory,
                                                       const ResumeOptions& options);

/// The result for programs, schema slabwright.resume/1, and for people.
[[nodiscard]] SLABWRIGHT_API std::string resume_json(const ResumeStatus& status);
[[nodiscard]] SLABWRIGHT_API std::string resume_text(const ResumeStatus& status,
                                                     const std::string& directory);

}  // namespace slabwright
