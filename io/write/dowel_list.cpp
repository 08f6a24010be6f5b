#include "io/write/dowel_list.h"

#include <map>
#include <utility>

#include <fmt/format.h>

#include "io/text/decimal.h"

namespace slabwright {

namespace {

std::string mm(double value) {
    std::string text;
    append_mm(text, to_units(value));
    return text;
}

}  // namespace

std::string dowels_csv(const std::vector<UndersideHole>& holes) {
    std::string text = "layer,slab,hole,diameter_mm,depth_mm,from_left_mm,from_front_mm,dowel_length_mm\n";
    for (const UndersideHole& hole : holes)
        text += fmt::format("{},1,{},{},{},{},{},{}\n", hole.layer, hole.number, mm(hole.diameter),
                            mm(hole.depth), mm(hole.x), mm(hole.y), mm(hole.dowel_length));
    return text;
}

std::string dowels_text(const std::vector<UndersideHole>& holes) {
    std::map<std::pair<double, double>, int> counts;
    for (const UndersideHole& hole : holes) ++counts[{hole.diameter, hole.dowel_length}];
    std::string text;
    for (const auto& [size, count] : counts)
        text +=
            fmt::format("{}{} of {:g} x {:g} mm", text.empty() ? "" : ", ", count, size.first, size.second);
    return text;
}

}  // namespace slabwright
