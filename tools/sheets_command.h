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
    double kerf = -1, tilt = -1, bond = -1, triangle = 2.9, area = 4, most_inset = 0, leave = 0.05, gap = 4,
           margin = 10;
    double lead = 3, feed = 3000, stepdown = 6, plunge = 800, rpm = 18000;
    double pressure = 350, orifice = 0.35, insert = 1.02, abrasive = 0.12, energy = 13.6;
    int tool = 1;
    bool grain = false;
    double tolerance = 0, keep_flats = 0;
    std::vector<double> joints;  ///< mm over the foot
    std::string align = "none", material = "mdf", bonding;
    double dowel = 8, wall = 4, tab = 24, neck = 6, tab_gap = 6;
    double engrave = 0, engrave_width = -1, digits = 10, engrave_feed = 1500, engrave_power = 20, power = 100;
    double taper = 0, pivot = 0, corner_feed = 50, corner = 1;
    int engrave_tool = 2;
    std::string on, off, codes;   ///< "": of the codes, or as SheetJob has it; none
    std::vector<double> offcuts;  ///< thickness, length and width, one after another
    std::vector<double> counts;   ///< thickness and number of whole sheets, one after another
    double price = 0, rate = 0;
    bool compare = false, nest = false, crate = false;
};

/// Adds what is asked of sheets to the command; pattern, folder and reading are added by the caller.
void add_sheets_options(CLI::App& command, SheetsOptions& options);

/// The job that the options describe. @throws Error(usage)
[[nodiscard]] SheetJob sheet_job(const SheetsOptions& options);

/// What is told and drawn beside the sheets, as the options ask.
[[nodiscard]] SheetExtras sheet_extras(const SheetsOptions& options);

/// What `slabwright feed` is asked: how fast a jet cuts, or what a test cut says of the material.
struct FeedOptions {
    SheetsOptions jet;
    double depth = 0, tilt = 0;
    double feed = 0;  ///< mm/min at which a test cut just held; 0: none was made
    bool json = false;
};

/// Adds the subcommand. @param options live as long as the command
CLI::App* add_feed_command(CLI::App& app, FeedOptions& options);

/// @returns what goes to stdout. @throws Error
[[nodiscard]] std::string run_feed(const FeedOptions& options);

/// What a terminal or a program (`json`) is told.
[[nodiscard]] std::string sheets_summary(const SheetsResult& result, const std::string& out, bool json);
[[nodiscard]] std::string sheets_verdict(const SheetProof& proof, const std::string& out);

}  // namespace slabwright
