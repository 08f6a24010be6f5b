// What every TOML text of a user is looked at for, whatever its keys are.
#pragma once

#include <string>
#include <string_view>

namespace slabwright {

/// Refuses keys of many parts before they are parsed: the parser calls itself for each part.
/// @throws Error(usage) with this code and file:line
void require_shallow_keys(std::string_view text, const std::string& file, const char* code);

}  // namespace slabwright
