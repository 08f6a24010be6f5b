// Narrow deep cavities and the tools for them, as JSON and for people.
#pragma once

#include <span>
#include <string>

#include "engine/tool_choice/cavity_tools.h"
#include "io/text/json_text.h"

namespace slabwright {

/// An object: the limits, how many places there are, and the slenderest fifty.
void put_cavities(JsonText& json, std::span<const CavityAdvice> cavities, const CavityOptions& limits);

/// What is to be done about a cavity, in one line: "no tool of the library enters it; flat end mill 4 mm x 48
/// mm would reach all but 0.2 cm2".
[[nodiscard]] std::string cavity_words(const CavityAdvice& advice);

/// Lines of `inspect`, the slenderest dozen; empty where there is none.
[[nodiscard]] std::string cavities_text(std::span<const CavityAdvice> cavities);

}  // namespace slabwright
