// The job file, read from TOML. Its keys are those of io/text/job_keys.h.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "engine/job.h"
#include "io/posts/dialect.h"
#include "io/read/tool_library.h"

namespace slabwright {

/// Where a post of the user's own comes from.
struct PostSource {
    /// Reads the file that machine.post names; none: files are refused, the controls' own posts are not.
    std::function<std::shared_ptr<const OwnDialect>(const std::string& name)> read;
    std::string post = {};  ///< a file or a control instead of machine.post; "": as the job says
};

/// Reads a job from TOML text; what it leaves out is as in `base`, but any [[tool]] replaces the whole
/// library. With [tools] library the tools are those of that file: what a tool does not state there, a
/// [[tool]] of its number states, or [tools] for all; a [[tool]] of another number is one more tool. A word
/// without an ending is a library of the house (engine/tools/libraries.h), in which a [[tool]] of a tool's
/// number goes before what the library says. machine.post is the word of a control, or a file: a text with a
/// point or a slash.
/// @param file names the text in errors
/// @throws Error(usage) with file:line: not TOML, unknown key (names the nearest known one), wrong type,
/// unknown word, missing key of a tool, whatever validate() and read_tool_library() refuse, "tools.conflict"
/// where a [[tool]] says other than the library, "tools.library" for a name that no library has, and as
/// PostSource::read does
[[nodiscard]] Job parse_job(std::string_view text, const std::string& file, const Job& base = {},
                            const ToolSource& tools = {}, const PostSource& posts = {});

}  // namespace slabwright
