// assembly.html of a sheets folder: stack, assembly order, cut list and nests, as one page without a network.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/sheet_proof/sheet_proof.h"

namespace slabwright {

/// The page; "" when the library was built without it (SLABWRIGHT_REPORT). The same arguments give the same
/// bytes.
/// @param sheets the text of sheets.json. @param verify of verify.json
/// @param programs in the order in which sheets.json names them; ways are thinned to a twentieth of a mm
[[nodiscard]] std::string assembly_html(std::string_view sheets, std::string_view verify,
                                        const std::vector<ReadSheetProgram>& programs);

}  // namespace slabwright
