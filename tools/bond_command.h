// `slabwright bond DATA.csv`: what tests of joints say.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

namespace slabwright {

struct BondOptions {
    std::string csv, response, terms;
    std::string plots;  ///< an SVG; "": none
    std::vector<std::string> ignored;
    int order = 0, future_runs = 3;
    double confidence = 0.95;
    bool json = false;
};

/// Adds the subcommand. @param options live as long as the command
CLI::App* add_bond_command(CLI::App& app, BondOptions& options);

/// @returns what goes to stdout. @throws Error
[[nodiscard]] std::string run_bond(const BondOptions& options);

}  // namespace slabwright
