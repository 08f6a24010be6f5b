// `slabwright split IN --z 40 -o ABOVE BELOW`: a model in two halves.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "io/split.h"

namespace slabwright {

struct SplitOptions {
    std::vector<double> z, plane;
    std::vector<std::string> out;
    DowelRules dowels;
    bool mirror_below = false;
};

/// Adds what is asked of a split to the command; model and reading are added by the caller.
void add_split_options(CLI::App& command, SplitOptions& options);

/// @throws Error(usage, "split.plane") unless one of --z and --plane is given
[[nodiscard]] SplitRequest split_request(const SplitOptions& options);

}  // namespace slabwright
