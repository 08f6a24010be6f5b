// The job file: TOML in, and the defaults out with a comment for every key. The keys are those of
// io/text/job_keys.h.
#pragma once

#include <string>
#include <string_view>

#include "engine/job.h"

namespace slabwright {

/// Reads a job from TOML text; what it leaves out is as in `base`, but any [[tool]] replaces the whole
/// library.
/// @param file names the text in errors
/// @throws Error(usage) with file:line: not TOML, unknown key (names the nearest known one), wrong type,
/// unknown word,
///         missing key of a tool, and whatever validate() refuses
[[nodiscard]] Job parse_job(std::string_view text, const std::string& file, const Job& base = {});

/// A job file with every key of `job`, commented. parse_job() of it gives `job` again.
[[nodiscard]] std::string job_toml(const Job& job);

}  // namespace slabwright
