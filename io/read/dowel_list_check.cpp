#include "io/read/dowel_list_check.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/format.h>

namespace slabwright {

namespace {

constexpr double kNear = 0.1;        // mm
constexpr double kSameLength = 0.5;  // mm, of dowels that are whole millimetres long
constexpr std::size_t kColumns = 8;
constexpr std::string_view kHead =
    "layer,slab,hole,diameter_mm,depth_mm,from_left_mm,from_front_mm,dowel_length_mm";

/// A dowel that stands in the stack, and whether a hole of the list goes over it.
struct Standing {
    int layer = 0;  ///< Layer::index, whose slab is laid on it
    JointDowel dowel;
    bool covered = false;
};

/// The numbers of a line; none where it has others.
std::optional<std::array<double, kColumns>> numbers_of(std::string_view line) {
    std::array<double, kColumns> numbers{};
    std::size_t count = 0;
    for (std::size_t at = 0; at <= line.size(); ++count) {
        const std::size_t end = std::min(line.find(',', at), line.size());
        if (count == kColumns) return std::nullopt;
        const char *first = line.data() + at, *last = line.data() + end;
        const auto [stop, error] = std::from_chars(first, last, numbers[count]);
        if (error != std::errc{} || stop != last || !(std::abs(numbers[count]) < 1e6)) return std::nullopt;
        at = end + 1;
    }
    return count == kColumns ? std::optional(numbers) : std::nullopt;
}

}  // namespace

std::vector<Violation> check_dowel_list(std::string_view text, const BuildPlan& build) {
    std::vector<Violation> found;
    std::uint32_t line = 0;
    const auto complain = [&](const char* code, const std::string& message) {
        found.push_back({code, message, "dowels.csv", line, {}, 0});
    };
    std::vector<Standing> standing;
    for (std::size_t l = 0; l + 1 < build.layers.size(); ++l)
        for (const JointDowel& dowel : build.layers[l].dowels)
            if (const int above = build.layers[l + 1].index; !mills_underside(build, above))
                standing.push_back({above, dowel});
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view words = text.substr(at, end - at);
        at = end + 1;
        if (++line == 1 && words == kHead) continue;
        const auto numbers = line > 1 ? numbers_of(words) : std::nullopt;
        if (!numbers) {
            complain("dowel.list_unreadable",
                     line == 1 ? "the first line does not name the columns" : "has other than eight numbers");
            return found;
        }
        const auto [layer, slab, hole, diameter, depth, from_left, from_front, length] = *numbers;
        const auto of_layer = std::find_if(build.layers.begin(), build.layers.end(),
                                           [&, of = layer](const LayerToBuild& b) { return b.index == of; });
        if (of_layer == build.layers.end() || slab != 1) {
            complain("dowel.list", "is of a slab that the plan does not have");
            continue;
        }
        const Blank blank = of_layer->blank.value_or(Blank{build.stock_min, build.stock_max});
        const double x = blank.max[0] - from_left, y = blank.min[1] + from_front;
        const auto under = std::find_if(standing.begin(), standing.end(),
                                        [&, of = layer, wide = diameter, deep = depth](const Standing& s) {
                                            return s.layer == of && !s.covered &&
                                                   std::hypot(s.dowel.x - x, s.dowel.y - y) <= kNear &&
                                                   std::abs(s.dowel.diameter - wide) <= kNear &&
                                                   std::abs(s.dowel.above - deep) <= kNear;
                                        });
        if (under == standing.end())
            complain("dowel.list",
                     fmt::format("layer {}, hole {}: no dowel of its size stands under it, at x "
                                 "{:.2f} y {:.2f} mm",
                                 layer, hole, x, y));
        else if (std::abs(under->dowel.length() - length) > kSameLength)
            complain("dowel.list", fmt::format("layer {}, hole {}: its dowel is {:g} mm long, not {:g}",
                                               layer, hole, under->dowel.length(), length));
        if (under != standing.end()) under->covered = true;
    }
    line = 0;
    for (const Standing& s : standing)
        if (!s.covered)
            complain("dowel.list",
                     fmt::format("layer {}: no hole goes over the dowel at x {:.2f} y {:.2f} mm", s.layer,
                                 s.dowel.x, s.dowel.y));
    return found;
}

}  // namespace slabwright
