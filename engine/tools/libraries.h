// The libraries of tools that the house knows by name.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "engine/job.h"

namespace slabwright {

/// The library of LUO table 5.4: flat and ball end mills of 1/8, 1/4, 1/2, 3/4 and 1 in with their stepdowns,
/// numbers 2 … 6 and 12 … 16, and the default face mill. Their flutes reach through a 19 mm slab; what LUO
/// does not give is ours.
[[nodiscard]] std::vector<Tool> luo_library();

/// What a shop that mills wood has: the three tools of the fixed set with their numbers, then flat end mills
/// of 1, 1/4 and 1/8 in and ball end mills of 1/2 and 1/8 in, numbers 4 … 8, those of 1/8 in on shanks of 1/4
/// in. Flats of 1/4 in and wider cut as deep as published chip loads allow at their feed (METHOD.md section
/// 7), balls half a diameter; other stepdowns are LUO table 5.4's. Lengths, holders and which sizes there
/// are, are ours.
[[nodiscard]] std::vector<Tool> shop_library();

/// The same in millimetres: face mill 50, flat 12 and ball 6 with the numbers of the fixed set, then flat end
/// mills of 25, 6 and 3 and ball end mills of 12 and 3. Stepdowns are in proportion to the diameter those of
/// the shop's nearest size in inches; the rest is ours.
[[nodiscard]] std::vector<Tool> metric_library();

/// A cutter of each form that a shop has, eight tools: the three of the fixed set with their numbers, a
/// bull-nose of 1 in and 3 mm, a ball end mill of 1/2 in, a tapered ball of 1.5 mm at its tip and 5° to 1/4
/// in, a cone of 90° and 12 mm, and a drill of 8 mm and 118°, numbers 4 … 8. Stepdowns are LUO
/// table 5.4's.
[[nodiscard]] std::vector<Tool> forms_library();

/// The names that named_library() knows, for people: "fixed, shop, forms, metric or luo".
inline constexpr std::string_view kLibraryNames = "fixed, shop, forms, metric or luo";

/// A library by its name: `fixed` is what a job has that names no tools. None where no library has the name.
[[nodiscard]] std::optional<std::vector<Tool>> named_library(std::string_view name);

}  // namespace slabwright
