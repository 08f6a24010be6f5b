// Proof: reads OUT as a stranger would, runs its programs, and says what part results.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/simulate/missing_tools.h"
#include "engine/simulate/simulate.h"
#include "io/read/pattern.h"
#include "io/write/verify_json.h"

namespace slabwright {

struct VerifyOptions {
    PatternSource source;  ///< the pattern; none looks for the file that plan.json names: in OUT, beside OUT,
                           ///< in the working folder
    /// The pattern where it has been read already: it is not read again if it is the one that plan.json
    /// names.
    std::shared_ptr<Pattern> pattern{};
    double cell = 0;                     ///< mm, SimulationOptions::cell
    bool maps = false;                   ///< keep the maps in the report
    std::string maps_directory{};        ///< "": none; write layer_01.ppm and so on there (write_maps())
    bool write = true;                   ///< write OUT/verify.json
    SimulationMemory* memory = nullptr;  ///< of the verification before of the same folder (simulate())
    const std::vector<KeepOut>* keep_outs = nullptr;  ///< in place of those that plan.json states
    bool faults = false;  ///< list every faulty motion in the report (SimulationOptions::faults)
};

/// What was found, and what was read to find it.
struct Verification {
    std::shared_ptr<Pattern> pattern;  ///< with its part
    SimulationInput input;             ///< its mesh is not set: pattern has it
    SimulationReport report;
    std::vector<UndersideFindings> undersides;  ///< their violations stand in `report` too
    double strength_mpa = 0;                    ///< of the wood; 0: plan.json does not say
    std::vector<MissingTool> missing;           ///< tools that would reach what is out of reach
    std::string json;                           ///< what verify.json holds (schema slabwright.verify/1)
};

/// Reads plan.json, every program of nc/, for LinuxCNC tool.tbl, sequence.json and, if it is not given, the
/// pattern, replays the sequence, simulates the programs, and writes OUT/verify.json (a whole file or none).
/// The report's violations say what is wrong with programs and part; `report.passed()` is the verdict.
/// @throws Error(verification) when OUT cannot be understood: plan.json missing or not of schema
/// slabwright.plan/1 or without
///   a key (names it), a program that read_planned_program() refuses (file:line)
/// @throws Error(input) when the STL is missing, unreadable, or not the one that was planned (by its SHA-256)
[[nodiscard]] Verification verify_folder(Context& context, const std::string& directory,
                                         const VerifyOptions& options = {});

/// Writes one picture (binary PPM, a pixel a cell, y upwards) for each layer of a report with maps: beside
/// the pattern light grey, the pattern grey, left-over above the cusp but within tolerance yellow, missed
/// orange, unreachable blue, gouge red, flask dark grey. The directory is made if it is not there. @throws
/// Error(input, "out.unwritable") when it cannot be written
void write_maps(const SimulationReport& report, const std::string& directory);

}  // namespace slabwright
