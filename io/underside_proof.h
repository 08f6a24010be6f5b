// The proof of slabs that are milled from below, from the text of their own folders.
#pragma once

#include <vector>

#include "engine/simulate/simulate.h"
#include "io/read/planned_folder.h"
#include "io/verify.h"
#include "io/write/verify_json.h"

namespace slabwright {

/// Proves the undersides of a plan's slabs; what they make is then not unmade in the report.
/// @param keep_outs of the table, as the plan's own programs count
/// @param programs of the plan itself: one control may hold them together with those of its undersides
/// @throws Error(verification) as read_planned_folder(), and where an underside's folder is none
[[nodiscard]] std::vector<UndersideFindings> prove_undersides(Context& context, const PlannedFolder& folder,
                                                              MeshView pattern, const VerifyOptions& options,
                                                              const std::vector<KeepOut>& keep_outs,
                                                              const std::vector<Program>& programs,
                                                              SimulationReport& report,
                                                              std::vector<Violation>& violations);

}  // namespace slabwright
