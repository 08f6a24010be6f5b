// Whether tool.tbl says of the tools what the plan says: what LinuxCNC believes of a tool is what the paths
// were made for.
#pragma once

#include <string_view>
#include <vector>

#include "engine/job.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

/// Violations "tool.table" of a LinuxCNC tool table's text, each with its line: a tool that the plan lacks or
/// the table lacks, a tool or pocket named twice, a pocket that is not the tool's number (a changer would
/// fetch another tool), with a magazine one that is not its place there or, for a tool in none, one of its
/// places, another diameter, any offset or angle that is not zero (lengths are what the machine
/// measured; x and y offsets shift the path), a lathe's orientation, a word that LinuxCNC would skip.
/// @param magazine the tool in each place when the sequence begins, 0 for none; empty: there is no magazine
/// @param file goes into the violations and, as it is, before the line into errors
/// @throws Error(verification, "verify.tool_table") with file:line where a word's number cannot be read
[[nodiscard]] std::vector<Violation> check_tool_table(std::string_view text, const std::string& file,
                                                      const std::vector<Tool>& tools,
                                                      const std::vector<int>& magazine = {});

}  // namespace slabwright
