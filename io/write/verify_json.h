// verify.json: what the simulation of a folder's programs found, schema slabwright.verify/1.
#pragma once

#include <string>

#include "engine/simulate/simulate.h"

namespace slabwright {

/// @param pattern the file's name. @param job_stated whether plan.json says by which limits it is judged
[[nodiscard]] std::string verify_json(const SimulationInput& input, const SimulationReport& report,
                                      const SimulationOptions& options, const std::string& pattern,
                                      bool job_stated);

}  // namespace slabwright
