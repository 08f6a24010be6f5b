// What to saw, for the saw and for a CAD program: OUT/cut_list.csv and OUT/cut_list.dxf.
#pragma once

#include <string>
#include <vector>

#include "engine/schedule/cut_list.h"
#include "engine/schedule/dowels.h"

namespace slabwright {

/// A line for each board and for what lies on it: pieces, cuts in their order, offcuts; mm from the board's
/// corner (io/FORMATS.md).
[[nodiscard]] std::string cut_list_csv(const CutList& list);

/// The boards side by side: layers BOARD, PIECE, CUT, OFFCUT, LABEL, and DOWELS where there are any: the
/// boards lie with the slabs' undersides up then.
[[nodiscard]] std::string cut_list_dxf(const CutList& list, const std::vector<UndersideHole>& holes = {});

}  // namespace slabwright
