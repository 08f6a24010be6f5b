// `slabwright prepare IN -o OUT.stl|.3mf`, and the same options on every command that reads a pattern.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace slabwright {

/// What the command line asks to be done to the model; what is not given stays as the job has it.
struct PrepareOptions {
    std::vector<double> turn, scale, shift, skin_normal, skin_box;
    std::string shrink, mirror;
    double skin = -1;
};

/// Adds --turn, --scale, --shrink, --mirror, --skin, --skin-normal, --skin-box and --shift.
void add_prepare_options(CLI::App& command, PrepareOptions& options);

/// The same as keys of a job file, in TOML: "prepare.turn = [90, 0, 0]\n"; "" for nothing.
[[nodiscard]] std::string prepare_keys(const PrepareOptions& options);

}  // namespace slabwright
