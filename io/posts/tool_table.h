// The LinuxCNC tool table: geometry only. Lengths are zero, because the machine keeps what it measured.
#pragma once

#include <string>
#include <vector>

#include "engine/job.h"

namespace slabwright {

/// One line a tool, by ascending number: `T1 P1 D50 Z0 ;face mill 50 mm`. The pocket is the tool's number; of
/// a machine with a magazine it is the place that the tool stands in at the start, and tools that stand in
/// none have pockets of their own behind the last place.
/// @param magazine the tool in each place, 0 for none; empty: there is no magazine
[[nodiscard]] std::string tool_table(const Job& job, const std::vector<int>& magazine = {});

}  // namespace slabwright
