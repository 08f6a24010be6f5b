// The LinuxCNC tool table: geometry only. Lengths are zero, because the machine keeps what it measured.
#pragma once

#include <string>

#include "engine/job.h"

namespace slabwright {

/// One line a tool, by ascending number: `T1 P1 D50 Z0 ;face mill 50 mm`.
[[nodiscard]] std::string tool_table(const Job& job);

}  // namespace slabwright
