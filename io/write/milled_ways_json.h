// What milling from above or on both sides leaves, as JSON and for people.
#pragma once

#include <span>
#include <string>

#include "engine/planner/milled_ways.h"
#include "io/text/json_text.h"

namespace slabwright {

/// An array of ways, each with the largest dozen places of what stays.
void put_milled_ways(JsonText& json, std::span<const MilledWay> ways);

/// "12.3 cm3, up to 4.5 mm high", or "nothing".
[[nodiscard]] std::string air_words(const UnmadeAir& air);

/// A line each for the largest pockets: volume, height and place. @param indent before each line
[[nodiscard]] std::string pocket_lines(const UnmadeAir& air, std::size_t most, const std::string& indent);

/// A line for each side down: what stays of it, milled from above and on both sides.
[[nodiscard]] std::string milled_ways_table(std::span<const MilledWay> ways);

/// Lines of `inspect`: what stays as it lies and where, and a table of the sides down where there are more.
[[nodiscard]] std::string milled_ways_text(std::span<const MilledWay> ways);

}  // namespace slabwright
