// What a verification says to those who asked for it.
#pragma once

#include "io/slabwright.h"
#include "io/verify.h"

namespace slabwright {

[[nodiscard]] VerifyResult verdict(const Verification& found);

/// @throws Error(usage, "verify.cell") for a distance between the stock's points that is neither 0 nor 0.01
/// to 10 mm
void check_cell(double cell_mm);

}  // namespace slabwright
