// The programs of a sheets plan as text, and what their text makes.
#pragma once

#include <string>
#include <vector>

#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/sheet_plan.h"
#include "io/posts/sheet_gcode.h"
#include "io/posts/sheet_reader.h"

namespace slabwright::support {

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
