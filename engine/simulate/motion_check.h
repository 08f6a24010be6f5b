// All that is checked of motions without any stock: the exact depth in the part and in the flask, the
// spindle, the machine's travel, the time.
#pragma once

#include <vector>

#include "engine/simulate/stage.h"

namespace slabwright {

/// Checks every program and fills their findings and the report's sums; programs are independent.
/// @param changes against the memory of the simulation before; null: nothing is known
/// @returns by program, for the memory of the next simulation
std::vector<CheckedProgram> check_motions(const SimulationStage& stage, const ProgramChanges* changes,
                                          const SimulationMemory* memory, SimulationReport& report);

}  // namespace slabwright
