// Sections as a DXF drawing.
#pragma once

#include <span>
#include <string>

#include "kernels/slicing/slicing.h"

namespace slabwright {

/// DXF R12 (AC1009) in millimetres: a closed POLYLINE per loop at its height, one layer per height, named
/// "Z_12_7" (R12 allows no point in a name; "_BELOW" follows for the lower side). Open chains are open
/// polylines on "…_OPEN".
[[nodiscard]] std::string sections_dxf(std::span<const Section> sections);

}  // namespace slabwright
