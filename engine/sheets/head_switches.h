// The M words that switch a cutting head, and those that switch what stands beside it.
#pragma once

#include <string_view>

namespace slabwright {

/// Whether a text is an M word that may switch something, as it is always written: M3, M4, M5, M7, M8, M9;
/// M62 to M65 with the P of an output, "M62 P0"; M100 to M199, which a machine defines itself, with a P or
/// without. No number begins with a zero, so that two words that do the same are the same text but for M62
/// and M64, M63 and M65, which switch one output.
[[nodiscard]] bool is_switch(std::string_view text);

/// Whether two words switch one thing on and off: M3 or M4 and M5, M7 or M8 and M9, M62 or M64 and M63 or M65
/// of one output, or any two of M100 to M199.
[[nodiscard]] bool is_switch_pair(std::string_view on, std::string_view off);

/// Whether a word that is_switch() switches the head: its own on or off, the output that these switch, or a
/// spindle, by which a router cuts.
[[nodiscard]] bool switches_head(std::string_view word, std::string_view on, std::string_view off);

}  // namespace slabwright
