// Rectangles on boards, milled out one by one, so that no cut needs to go from edge to edge.
#pragma once

#include <span>
#include <vector>

#include "engine/schedule/guillotine.h"

namespace slabwright {

/// Lays pieces on as few boards as it finds, turned where that helps, each at least a kerf from every other
/// and from every offcut along x or along y: by the nester of sheets on a grid of 1 mm (nest_pieces), and as
/// a panel saw would (lay_on_boards), without its cuts. Of the two stays the one with fewer boards, then the
/// one with the largest single offcut, then the saw's. Offcuts are the largest free rectangles, one after
/// another, as long as their shorter side is at least kLeastOffcut.
/// @param kerf mm of the cutter; at the board's edge none is needed
/// @return the boards, whose cuts are none; none where a piece is larger than a board, whichever way it is
/// turned
[[nodiscard]] std::vector<SawnBoard> nest_on_boards(std::span<const SawnSize> pieces, const SawnSize& board,
                                                    double kerf);

inline constexpr double kLeastOffcut = 50;  ///< mm

}  // namespace slabwright
