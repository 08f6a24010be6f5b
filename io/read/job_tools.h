// The tools of a job: its [[tool]], and the library that [tools] names.
#pragma once

#include <toml++/toml.h>

#include <string>
#include <vector>

#include "engine/job.h"
#include "io/read/key_reader.h"
#include "io/read/tool_library.h"

namespace slabwright {

/// A [[tool]] that states all that has no default. @param reader has entered `values`
/// @throws Error(usage) as KeyReader does
[[nodiscard]] Tool tool_of(const toml::table& values, KeyReader& reader);

/// The tools of a library, each with what [[tool]] and [tools] add (parse_job()), then the [[tool]] of other
/// numbers. @param shared [tools], null where the job has none. @param listed the [[tool]].
/// @throws Error(usage) as parse_job() does
[[nodiscard]] std::vector<Tool> library_tools(const toml::node* shared,
                                              std::vector<const toml::table*> listed, KeyReader& reader,
                                              const std::string& file, const ToolSource& source);

}  // namespace slabwright
