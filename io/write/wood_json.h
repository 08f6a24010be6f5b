// What a build takes of boards and money, in words and for programs.
#pragma once

#include <optional>
#include <string>

#include "engine/schedule/cut_list.h"
#include "io/text/json_text.h"

namespace slabwright {

/// The value of "wood" in plan.json: boards with what is sawn from each, and how much that is.
/// @param uniform the cut list with every slab as large as the pattern
void put_wood(JsonText& json, const CutList& list, const CutList& uniform);

/// The value of "cost": null where the job states no price.
void put_cost(JsonText& json, const Job& job, const std::optional<Cost>& cost);

/// "3 boards of 19 x 1160 x 1160 mm", one for each kind.
[[nodiscard]] std::string boards_text(const CutList& list);

/// "cost    84.20 EUR (boards 60.55, glue 3.65, machine 20.00)", a line; "" without prices.
[[nodiscard]] std::string cost_text(const Job& job, const std::optional<Cost>& cost);

}  // namespace slabwright
