// progress.json: how far the shop has come with a build, and the state that the machine is in then.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "engine/simulate/build_replay.h"

namespace slabwright {

/// What progress.json holds (schema slabwright.progress/1).
struct BuildProgress {
    std::string plan_sha256;                 ///< of the bytes of plan.json
    std::string sequence = "sequence.json";  ///< that is in force, from OUT
    std::string sequence_sha256;             ///< of its bytes
    int after = 0;                           ///< the last step that was finished; 0: none
    std::int64_t time_s = 0;                 ///< when that was said, seconds since 1970, UTC
    BuildState state;                        ///< after that step
};

/// @param sequence the one that is in force. Steps of the state are told by their ids
[[nodiscard]] std::string progress_json(const BuildProgress& progress, const BuildPlan& plan,
                                        const BuildSequence& sequence);

/// Reads all but the state, which needs the sequence that the rest names. Strict: every key must be there,
/// with its type. @param place of the file, for errors
/// @throws Error(input, "resume.progress") that says what is wrong
[[nodiscard]] BuildProgress parse_progress(std::string_view text, const std::string& place);

/// Reads the state of the same text. @throws as parse_progress(), also for a step or a program that plan and
/// sequence do not have
[[nodiscard]] BuildState parse_progress_state(std::string_view text, const BuildPlan& plan,
                                              const BuildSequence& sequence, const std::string& place);

/// "2026-11-25T14:42:10Z"
[[nodiscard]] std::string utc_text(std::int64_t seconds);

}  // namespace slabwright
