// What every TOML text of a user is looked at for, whatever its keys are.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace slabwright {

/// Levenshtein's distance, letters without case.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known word that is nearest to one that is not; "" where none is known.
[[nodiscard]] std::string nearest_word(std::string_view wanted, const std::vector<std::string>& known);

/// Refuses keys of many parts before they are parsed: the parser calls itself for each part.
/// @throws Error(usage) with this code and file:line
void require_shallow_keys(std::string_view text, const std::string& file, const char* code);

}  // namespace slabwright
