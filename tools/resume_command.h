// `slabwright resume OUT`: go on after an interruption; make a spoilt layer again.
#pragma once

#include <CLI/CLI.hpp>

#include "io/resume.h"

namespace slabwright {

/// Adds the subcommand; limits of threads and memory are added by the caller.
/// @param directory, options live as long as the command
CLI::App* add_resume_command(CLI::App& app, std::string& directory, ResumeOptions& options);

/// @returns what goes to stdout. @throws Error
[[nodiscard]] std::string run_resume(Context& context, const std::string& directory,
                                     const ResumeOptions& options, bool json);

}  // namespace slabwright
