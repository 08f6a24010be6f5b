// The programs of a sheets plan as text, and what their text makes.
#pragma once

#include <string>
#include <vector>

#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/sheet_plan.h"
#include "io/posts/sheet_gcode.h"
#include "io/posts/sheet_reader.h"

namespace slabwright::support {

/// Sheets of 6 and 12 mm from squares of a stock, with the kerf that such a head has; a jet tilts.
inline SheetJob sheet_job(SheetHead head, double stock_mm) {
    SheetJob job;
    job.slicing.thicknesses = {6, 12};
    job.head = head;
    job.stock = {stock_mm, stock_mm};
    job.cutting.kerf = head == SheetHead::router ? 6 : 0.8;
    if (head == SheetHead::jet) job.cutting.most_tilt_deg = 55;
    return job;
}

inline std::vector<std::string> texts_of(const SheetsPlan& plan) {
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < plan.programs.size(); ++i) texts.push_back(sheet_program_text(plan, i));
    return texts;
}

inline SheetProof proof_of(Context& context, const Mesh& mesh, const std::vector<std::string>& texts) {
    std::vector<ReadSheetProgram> programs;
    for (std::size_t i = 0; i < texts.size(); ++i)
        programs.push_back(read_sheet_program(texts[i], "sheet_" + std::to_string(i + 1) + ".ngc"));
    return prove_sheets(context, mesh.view(), programs, {});
}

inline std::string told(const SheetProof& proof) {
    std::string text;
    for (const Diagnostic& d : proof.violations) text += d.code + ": " + d.message + '\n';
    return text;
}

}  // namespace slabwright::support
