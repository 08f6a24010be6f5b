// Sections as JSON.
#pragma once

#include <span>
#include <string>

#include "kernels/slicing/slicing.h"

namespace slabwright {

/// Schema "slabwright.slice/1": {"schema", "units": "mm", "sections": [{"z", "side": "above"|"below",
/// "area_mm2", "closed_gaps", "loops": [{"parent": index or null, "area_mm2" (holes negative), "points": [[x,
/// y], …]}], "open_chains": [[[x, y], …], …]}]}. Points are exact, millimetres with up to four decimals; no
/// number has an exponent.
[[nodiscard]] std::string sections_json(std::span<const Section> sections);

}  // namespace slabwright
