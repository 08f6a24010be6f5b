// What keeps a pattern from being drawn, as JSON and for people.
#pragma once

#include <string>

#include "io/text/json_text.h"
#include "kernels/features/draw.h"

namespace slabwright {

/// An object: the limits, and of each kind of finding its size, how many places there are, and the largest
/// dozen.
void put_draw(JsonText& json, const DrawReport& report);

/// Lines of `inspect`, the largest places of each kind; empty where nothing was found.
[[nodiscard]] std::string draw_text(const DrawReport& report);

}  // namespace slabwright
