// Tools as other programs keep them: LinuxCNC's tool table, FreeCAD's libraries and bits, CSV. A tool is what
// its file states, by the keys of a [[tool]]; what it does not state is for the job to say. Nothing is
// guessed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace slabwright {

/// A key of [[tool]] (io/text/job_keys.h) with its value; lengths in mm.
using StatedValue = std::pair<std::string, std::variant<double, std::int64_t, bool, std::string>>;

struct LibraryTool {
    std::string place;                ///< file:line
    std::vector<StatedValue> values;  ///< each key once
};

/// Where a job's tools come from besides its [[tool]].
struct ToolSource {
    /// Reads the file that [tools] library names, of these numbers (none: of all); none: files are refused,
    /// the house's own libraries are not.
    std::function<std::vector<LibraryTool>(const std::string& name, const std::vector<std::int64_t>& wanted)>
        read;
    std::string library = {};  ///< a file or a name instead of [tools] library; "": as the job says
};

/// Reads a library by the end of its name: .tbl (LinuxCNC, in mm: number, diameter, remark as name), .fctl
/// and .fctb (FreeCAD: number, kind, name, diameter, flute_length, shank_diameter, flutes), .csv (a row of
/// keys, then a row a tool; an empty cell states nothing).
/// @param wanted only tools of these numbers (and such as have none); empty: all
/// @throws Error(usage, "tools.format") for another ending; "tools.empty"; "tools.missing", ".directory",
/// ".unreadable",
/// ".too_large" as the file is; "tools.syntax", "tools.key", "tools.value", "tools.unit", "tools.shape" with
/// file:line for what cannot be taken as it stands
[[nodiscard]] std::vector<LibraryTool> read_tool_library(const std::filesystem::path& path,
                                                         const std::vector<std::int64_t>& wanted = {});

}  // namespace slabwright
