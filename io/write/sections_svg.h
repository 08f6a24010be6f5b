// Sections as an SVG drawing.
#pragma once

#include <span>
#include <string>

#include "kernels/slicing/slicing.h"

namespace slabwright {

/// One user unit is one millimetre, y up (coordinates are written negated), the drawing as large as all
/// sections together. One group per section, its id the height ("z12.7", with "-below" for the lower side and
/// "-2", "-3" … for repeats); loops are one path, filled even-odd; open chains are unfilled lines of the
/// class "open".
[[nodiscard]] std::string sections_svg(std::span<const Section> sections);

}  // namespace slabwright
