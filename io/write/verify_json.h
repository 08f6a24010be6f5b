// verify.json: what the simulation of a folder's programs found, schema slabwright.verify/1.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/simulate/missing_tools.h"
#include "engine/simulate/simulate.h"
#include "engine/undersides/floors.h"

namespace slabwright {

/// What was found about a slab's underside.
struct UndersideFindings {
    int layer = 0;       ///< Layer::index
    std::string folder;  ///< within OUT
    TurnedSlab slab;     ///< as the build lays it
    SimulationReport report;
    std::vector<Program> programs;  ///< that it is of
    /// The floor over it that the next slab's press loads most, or the thinnest; none: there is none that
    /// bends.
    std::optional<LoadedFloor> floor{};
    double floor_pressure_mpa = 0;  ///< of that press; 0: not stated
};

/// @param pattern the file's name. @param job_stated whether plan.json says by which limits it is judged
/// @param missing tools that would reach what is out of reach, `missing_tools` in the document
/// @param undersides of slabs; none: the document has no such key
[[nodiscard]] std::string verify_json(const SimulationInput& input, const SimulationReport& report,
                                      const SimulationOptions& options, const std::string& pattern,
                                      bool job_stated, const std::vector<MissingTool>& missing = {},
                                      const std::vector<UndersideFindings>& undersides = {});

}  // namespace slabwright
