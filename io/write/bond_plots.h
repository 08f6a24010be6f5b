// What a study of joints shows at a glance, as one SVG.
#pragma once

#include <string>

#include "engine/bonding/bond_study.h"

namespace slabwright {

/// The mean strength at each level of each factor (main effects), of each pair of factors (interactions),
/// and what the regression leaves of each test: against what it foretells, in the order of the rows, and
/// against what a normal distribution would have. Without a regression, what the means of the tested
/// combinations leave. Lines end in line feeds.
[[nodiscard]] std::string bond_plots_svg(const BondTests& tests, const BondStudy& study);

}  // namespace slabwright
