// plan.json: the contract with other programs (design.md, "What OUT holds"; checked by io/plan.schema.json).
#pragma once

#include <string>

#include "engine/plan.h"
#include "io/text/json_text.h"

namespace slabwright {

/// The plan without its moves, schema slabwright.plan/1. Heights count from the pattern's bottom; `frame` is
/// that of the programs. The same plan gives the same bytes.
[[nodiscard]] std::string plan_json(const Plan& plan);

/// Pieces that inspect_json writes the same way.
void put_input(JsonText& json, const InputInfo& input);
void put_repair(JsonText& json, const InputRepair& repair);
void put_features(JsonText& json, const std::vector<Feature>& features);
void put_diagnostics(JsonText& json, const std::vector<Diagnostic>& diagnostics);

}  // namespace slabwright
