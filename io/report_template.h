// The pages that reports are made from, bundled from io/report by the build.
#pragma once

#include <string_view>

namespace slabwright {

/// The whole page with the places where data go; "" when the library was built without it
/// (SLABWRIGHT_REPORT).
[[nodiscard]] std::string_view report_template();

/// The same for a sheets folder: assembly.html.
[[nodiscard]] std::string_view assembly_template();

}  // namespace slabwright
