// Sheets, from a pattern's file to a folder and back: the front door of `slabwright sheets`.
#pragma once

#include <string>

#include "engine/job.h"
#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/fixture.h"
#include "engine/sheets/sheet_cost.h"
#include "engine/sheets/sheet_plan.h"

namespace slabwright {

/// What is told and drawn beside the sheets themselves.
struct SheetExtras {
    const SheetMaterial* material = nullptr;  ///< by which weight is told
    const SheetBond* bond = nullptr;          ///< by which the weakest joint is told
    SheetPrices prices;
    bool compare = false;  ///< plans the other ways too: uniform, adaptive, curved
    bool nest = false;     ///< OUT/fixture/nest_NN.dxf: the block around each sheet
    bool crate = false;    ///< OUT/fixture/crate_….dxf: an egg crate
    FixtureRules fixture;
};

/// A sheets folder that was written, and what its programs make.
struct SheetsResult {
    SheetsPlan plan;
    SheetProof proof;
    std::vector<SheetCost> costs;  ///< of this plan alone, or of all ways
};

/// Plans a pattern as sheets, writes OUT (sheets.json, nc/, dxf/, svg/, fixture/) and verify.json from the
/// text of the programs, all or nothing.
/// @param pattern the file; `reading` names units, weld and repair
/// @throws Error(input | no_plan | usage | cancelled)
[[nodiscard]] SheetsResult make_sheets(Context& context, const std::string& pattern, const Job& reading,
                                       const SheetJob& job, const std::string& directory,
                                       const SheetProofRules& rules, const SheetExtras& extras = {});

/// Whether a folder holds sheets.
[[nodiscard]] bool holds_sheets(const std::string& directory);

/// Rebuilds the stack from the text of a folder's programs, holds it against the pattern and writes
/// verify.json. sheets.json says no more than which pattern and axis it was, and which programs there are.
/// @param pattern the file; "" looks for the one that sheets.json names: in the folder, beside it, where the
/// caller stands
/// @throws Error(verification) when the folder or a program cannot be understood, Error(input) when the
/// pattern is missing or another one
[[nodiscard]] SheetProof verify_sheets(Context& context, const std::string& directory,
                                       const std::string& pattern, const SheetProofRules& rules);

}  // namespace slabwright
