// verify.json: what the simulation of a folder's programs found, schema slabwright.verify/1.
#pragma once

#include <string>
#include <vector>

#include "engine/simulate/missing_tools.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

/// @param pattern the file's name. @param job_stated whether plan.json says by which limits it is judged
/// @param missing tools that would reach what is out of reach, `missing_tools` in the document
[[nodiscard]] std::string verify_json(const SimulationInput& input, const SimulationReport& report,
                                      const SimulationOptions& options, const std::string& pattern,
                                      bool job_stated, const std::vector<MissingTool>& missing = {});

}  // namespace slabwright
