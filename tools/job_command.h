// `slabwright job`: job files, and posts of one's own, to begin with.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace slabwright {

struct JobOptions {
    std::string library, post_file;
    bool defaults = false, json = false;
};

/// Adds the subcommand. @param options live as long as the command
CLI::App* add_job_command(CLI::App& app, JobOptions& options);

/// @returns what goes to stdout. @throws Error
[[nodiscard]] std::string run_job(const JobOptions& options);

}  // namespace slabwright
