// sequence.json read back, as a stranger's text: strict where a machine would go wrong, and bounded.
#pragma once

#include <string_view>

#include "engine/simulate/build_replay.h"

namespace slabwright {

/// The largest sequence.json that is read, bytes.
inline constexpr std::size_t kLargestSequence = std::size_t{256} << 20;

/// Reads a text of schema slabwright.sequence/1. Every value has its type, no name stands twice in an object,
/// and no number is beyond what a double holds. Quantities of a step that this version does not know are kept
/// beside those that it knows. Whether the steps make sense is replay_build's question.
/// @throws Error(verification, "verify.sequence") that says what is wrong and in which step
[[nodiscard]] BuildSequence read_sequence(std::string_view text);

}  // namespace slabwright
