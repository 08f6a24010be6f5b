// `slabwright sheets IN.stl -o OUT`: a part as sheets from stock.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "io/sheets.h"

namespace slabwright {

struct SheetsOptions {
    std::vector<double> thicknesses{6, 9, 12, 18};
    std::vector<double> stock{1220, 1220};
    std::string head = "router", axis = "z", strategy = "optimal", side = "outside";
    double kerf = -1, tilt = -1, bond = 0, triangle = 2.9, area = 4, most_inset = 0, leave = 0.05, gap = 4,
           margin = 10;
    double lead = 3, feed = 3000, stepdown = 6, plunge = 800, rpm = 18000;
    double pressure = 350, orifice = 0.35, insert = 1.02, abrasive = 0.12, energy = 13.6;
    int tool = 1;
    bool grain = false;
    double tolerance = 0;
};

/// Adds what is asked of sheets to the command; pattern, folder and reading are added by the caller.
void add_sheets_options(CLI::App& command, SheetsOptions& options);

/// The job that the options describe. @throws Error(usage)
[[nodiscard]] SheetJob sheet_job(const SheetsOptions& options);

/// What a terminal or a program (`json`) is told.
[[nodiscard]] std::string sheets_summary(const SheetsResult& result, const std::string& out, bool json);
[[nodiscard]] std::string sheets_verdict(const SheetProof& proof, const std::string& out);

}  // namespace slabwright
