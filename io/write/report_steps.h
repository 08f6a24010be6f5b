// What the report takes from the steps of a sequence.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace slabwright {

/// Of every step of a sequence (sequence.json, read): layer, action, seconds, program (null: none). Of no
/// sequence, null, none.
/// @throws nlohmann::json::exception where a step is none of the schema's
[[nodiscard]] nlohmann::ordered_json step_times(const nlohmann::ordered_json& sequence);

/// The steps of a sequence, likewise, that put tools into the magazine, in their order: layer,
/// place, tool, what is taken out (0: nothing), whether out of the spindle, and before which program; "" for
/// what fills an empty place.
/// @throws nlohmann::json::exception where a step is none of the schema's
[[nodiscard]] nlohmann::ordered_json magazine_loads(const nlohmann::ordered_json& sequence);

}  // namespace slabwright
