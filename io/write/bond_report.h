// A study of joints as text for people and as JSON for programs.
#pragma once

#include <string>

#include "engine/bonding/bond_study.h"

namespace slabwright {

/// Tables of the analysis of variance and of the regression, whether it fits, the tested combinations and
/// where the joint is strongest. Lines end in line feeds.
[[nodiscard]] std::string bond_text(const BondTests& tests, const BondStudy& study,
                                    const BondStudyOptions& options);

/// The same as JSON (schema slabwright.bond/1).
[[nodiscard]] std::string bond_json(const BondTests& tests, const BondStudy& study,
                                    const BondStudyOptions& options);

}  // namespace slabwright
