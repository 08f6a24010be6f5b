// Whether what is engraved is hidden once the sheets are bonded (METHOD.md section 13).
#pragma once

#include <set>
#include <vector>

#include "engine/sheet_proof/sheet_proof.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// Numbers of the pieces that are engraved.
[[nodiscard]] std::set<int> engraved_pieces(const std::vector<ReadSheetProgram>& programs);

/// What the cuts leave of a piece at its top and at its bottom, in the part's frame; the top of engraved
/// pieces and the bottom of those above them are needed.
struct EngravedPiece {
    const ReadSheetProgram* program = nullptr;
    const ReadPiece* piece = nullptr;
    Loops top, bottom;
};

/// Every engraving lies within the top of its piece and under the piece above it, or in a tab; it goes no
/// deeper than half of the sheet nor than the text states, is made before the piece is cut out, and says the
/// number of its piece. What does not is a violation "sheets.engraving". @returns how many there are
[[nodiscard]] int require_engravings(const std::vector<ReadSheetProgram>& programs,
                                     const std::vector<EngravedPiece>& pieces,
                                     std::vector<Diagnostic>& violations);

}  // namespace slabwright
