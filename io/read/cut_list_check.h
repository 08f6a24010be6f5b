// Whether cut_list.csv is a list that a saw can follow, and gives the slabs that the plan lays.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/simulate/build_replay.h"

namespace slabwright {

/// Follows the text line by line, as whoever stands at the saw: a board is taken, each cut goes from edge to
/// edge of a part and parts it, each piece is one of the parts that are left. From a nested board pieces and
/// offcuts are milled, each on the board and at least slabs.kerf (where the job is stated, else nothing) from
/// those before it, along x or along y. Violations, each with its line: cut_list.unreadable (a line that is
/// none, after which nothing more is read), cut_list.cut (a cut that a saw cannot make, or any in a nested
/// board; a board cut otherwise than slabs.layout says), cut_list.piece (no such part, one too near to
/// another, another size or thickness than the plan's slab, a slab twice or never).
/// @param build its stock, layers and, where the job is stated, its base board
[[nodiscard]] std::vector<Violation> check_cut_list(std::string_view text, const BuildPlan& build);

}  // namespace slabwright
