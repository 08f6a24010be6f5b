// What a simulation's findings mean: violations, kind by kind.
#pragma once

#include <vector>

#include "engine/simulate/stage.h"

namespace slabwright {

/// @param taken mm, the most that any cell lost, by program. @param flask_cut the most that is gone of a
/// flask
void judge(const SimulationStage& stage, const std::vector<double>& taken, const Extreme& flask_cut,
           SimulationReport& report);

}  // namespace slabwright
