// sheets.json, and verify.json of a sheets folder (io/FORMATS.md, "Sheets").
#pragma once

#include <string>
#include <vector>

#include "engine/plan.h"
#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/sheet_cost.h"
#include "engine/sheets/sheet_plan.h"
#include "io/read/pattern_mesh.h"

namespace slabwright {

/// "sheet_01" for the first program: the name of its files without their endings.
[[nodiscard]] std::string sheet_file(std::size_t index);

/// What is told beside the plan.
struct SheetsTold {
    const std::vector<SheetCost>& costs;
    const SheetMaterial* material = nullptr;
    const SheetBond* bond = nullptr;
    std::vector<std::string> fixture;  ///< names in fixture/
};

/// Schema slabwright.sheets/1.
[[nodiscard]] std::string sheets_json(const SheetsPlan& plan, const InputInfo& input,
                                      const ReadingOptions& reading, const SheetsTold& told);

/// Schema slabwright.sheets-verify/1.
[[nodiscard]] std::string sheets_verify_json(const SheetProof& proof, const std::string& pattern);

}  // namespace slabwright
