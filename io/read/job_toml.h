// The job file, read from TOML. Its keys are those of io/text/job_keys.h.
#pragma once

#include <string>
#include <string_view>

#include "engine/job.h"
#include "io/read/tool_library.h"

namespace slabwright {

/// Reads a job from TOML text; what it leaves out is as in `base`, but any [[tool]] replaces the whole
/// library. With [tools] library the tools are those of that file: what a tool does not state there, a
/// [[tool]] of its number states, or [tools] for all; a [[tool]] of another number is one more tool. A word
/// without an ending is a library of the house (engine/tools/libraries.h), in which a [[tool]] of a tool's
/// number goes before what the library says.
/// @param file names the text in errors
/// @throws Error(usage) with file:line: not TOML, unknown key (names the nearest known one), wrong type,
/// unknown word, missing key of a tool, whatever validate() and read_tool_library() refuse, "tools.conflict"
/// where a [[tool]] says other than the library, "tools.library" for a name that no library has
[[nodiscard]] Job parse_job(std::string_view text, const std::string& file, const Job& base = {},
                            const ToolSource& tools = {});

}  // namespace slabwright
