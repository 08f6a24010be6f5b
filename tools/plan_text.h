// What a terminal is told of a plan and of its proof.
#pragma once

#include <string>

#include "engine/plan.h"
#include "io/slabwright.h"

namespace slabwright {

/// "12.5", with no more decimals than it needs.
[[nodiscard]] std::string number(double value, int decimals);

/// One line on a finding.
[[nodiscard]] std::string told(const Diagnostic& d);

/// What the person at the router needs to know before the build: how long, what to load, what to mind.
[[nodiscard]] std::string summary(const Plan& plan, const std::string& out);

/// What the simulation of the programs says.
[[nodiscard]] std::string verdict(const VerifyResult& result, const std::string& out);

/// What was done to a mesh that was repaired. @param out the file that holds it
[[nodiscard]] std::string repair_text(const RepairResult& result, const std::string& out);

}  // namespace slabwright
