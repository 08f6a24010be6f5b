// A job as the text of a job file, with a comment for every key of io/text/job_keys.h.
#pragma once

#include <string>

#include "engine/job.h"

namespace slabwright {

/// A job file with every key of `job`, commented. parse_job() of it gives `job` again.
[[nodiscard]] std::string job_toml(const Job& job);

}  // namespace slabwright
