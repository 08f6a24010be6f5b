// Which word was meant: for messages about words that nobody knows.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace slabwright {

/// Levenshtein's distance, letters without case.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The first of the nearest of `known`; "" where there is none.
[[nodiscard]] std::string nearest_word(std::string_view wanted, const std::vector<std::string>& known);

}  // namespace slabwright
