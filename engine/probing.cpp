#include "engine/probing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kernels/errors.h"

namespace slabwright {

namespace {

void require(const char* key, double value, double least, double most) {
    if (std::isfinite(value) && value >= least && value <= most) return;
    throw Error(ErrorKind::usage, "job.range", fmt::format("{} is {}", key, value), key,
                fmt::format("give a number from {} to {}", least, most));
}

void require_places(const char* key, const std::vector<double>& values, std::size_t count,
                    const char* remedy) {
    if (values.size() != count)
        throw Error(ErrorKind::usage, "job.range", fmt::format("{} has {} numbers", key, values.size()), key,
                    remedy);
    for (const double value : values) require(key, value, -10000, 10000);
}

}  // namespace

void validate_probing(const Probing& probing) {
    require("probing.tool", probing.tool, 1, 99999);
    require("probing.tip_diameter", probing.tip_diameter, 0.1, 50);
    require("probing.fast_feed", probing.fast_feed, 1, 500);
    require("probing.slow_feed", probing.slow_feed, 1, std::min(120.0, probing.fast_feed));
    require("probing.plate", probing.plate, 0, 100);
    require("probing.search", probing.search, 6, 100);
    require("probing.retract", probing.retract, kProbeBack, 200);
    if (!probing.reference.empty())
        require_places("probing.reference", probing.reference, 3,
                       "give x and y from the base board's left front corner and z from the table's top");
}

void validate_pin(const std::vector<double>& pin, bool is_zero) {
    constexpr const char* kRemedy =
        "give machine.pin = [x, y] of a pin or bored hole from the base board's left front corner";
    if (pin.empty() && is_zero)
        throw Error(ErrorKind::usage, "job.range", "machine.zero is \"pin\", and machine.pin names none",
                    "machine.pin", std::string(kRemedy) + ", or machine.zero = \"corner\"");
    if (!pin.empty()) require_places("machine.pin", pin, 2, kRemedy);
}

}  // namespace slabwright
