#include "io/write/milled_ways_json.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabwright {

namespace {

using Shape = JsonText::Shape;

constexpr std::size_t kPockets = 12;
constexpr double kNothing = 0.5;  // mm³

void put_layers(JsonText& json, const MilledLayers& layers) {
    json.begin_object().key("layers").count(layers.tops.size());
    json.key("tops").begin_array(Shape::line);
    for (const double z : layers.tops) json.rounded(z, 4);
    json.end().key("volume").rounded(layers.air.volume_mm3, 1);
    json.key("volume_error").rounded(layers.air.error_mm3, 1);
    json.key("height").rounded(layers.air.height_mm, 3);
    json.key("pockets").count(layers.air.pockets.size());
    json.key("largest").begin_array();
    for (std::size_t i = 0; i < std::min(kPockets, layers.air.pockets.size()); ++i) {
        const UnmadePocket& p = layers.air.pockets[i];
        json.begin_object(Shape::line).key("layer").integer(static_cast<int>(p.layer) + 1);
        json.key("volume").rounded(p.volume_mm3, 1).key("height").rounded(p.height_mm, 3);
        json.key("where").begin_array(Shape::line);
        for (const double x : p.at) json.rounded(x, 3);
        json.end().end();
    }
    json.end().end();
}

}  // namespace

void put_milled_ways(JsonText& json, std::span<const MilledWay> ways) {
    json.begin_array();
    for (const MilledWay& way : ways) {
        json.begin_object().key("turn_deg").begin_array(Shape::line);
        for (const double d : way.turn) json.rounded(d, 6);
        json.end().key("size").begin_array(Shape::line);
        for (const double d : way.size) json.rounded(d, 3);
        json.end().key("has_room").boolean(way.has_room);
        json.key("milled_from_above");
        put_layers(json, way.above);
        json.key("milled_on_both_sides");
        put_layers(json, way.both_sides);
        json.end();
    }
    json.end();
}

std::string air_words(const UnmadeAir& air) {
    if (air.volume_mm3 < kNothing) return "nothing";
    std::string text = fmt::format("{:.{}f} cm3", air.volume_mm3 / 1000, air.volume_mm3 < 1000 ? 3 : 1);
    if (air.height_mm > 0) text += fmt::format(", up to {:.1f} mm high", air.height_mm);
    return text;
}

std::string pocket_lines(const UnmadeAir& air, std::size_t most, const std::string& indent) {
    std::string text;
    for (std::size_t i = 0; i < std::min(most, air.pockets.size()); ++i) {
        const UnmadePocket& p = air.pockets[i];
        text += fmt::format("{}{:.2f} cm3, {:.1f} mm high at x {:.1f} y {:.1f} z {:.1f}\n", indent,
                            p.volume_mm3 / 1000, p.height_mm, p.at[0], p.at[1], p.at[2]);
    }
    if (air.pockets.size() > most)
        text += fmt::format("{}and in {} more\n", indent, air.pockets.size() - most);
    return text;
}

std::string milled_ways_table(std::span<const MilledWay> ways) {
    std::string text = fmt::format("  {:>12}  {:>21}  {:>19}  {:>19}\n", "--turn", "size, mm",
                                   "from above, cm3", "on both sides, cm3");
    for (const MilledWay& way : ways) {
        const auto cell = [](const MilledLayers& layers) {
            return fmt::format("{:.2f} in {:>2} layers", layers.air.volume_mm3 / 1000, layers.tops.size());
        };
        text += fmt::format("  {:>12}  {:>21}  {:>19}  {:>19}{}\n",
                            fmt::format("{:g},{:g},{:g}", way.turn[0], way.turn[1], way.turn[2]),
                            fmt::format("{:.0f} x {:.0f} x {:.0f}", way.size[0], way.size[1], way.size[2]),
                            cell(way.above), cell(way.both_sides), way.has_room ? "" : "  no room for it");
    }
    return text;
}

std::string milled_ways_text(std::span<const MilledWay> ways) {
    if (ways.empty()) return {};
    const MilledWay& lies = ways.front();
    std::string text = fmt::format("  unmade      milled from above, in {} layers: {}\n",
                                   lies.above.tops.size(), air_words(lies.above.air));
    if (ways.size() == 1) return text;
    text += pocket_lines(lies.above.air, 5, "                ");
    text += fmt::format("              milled on both sides, in {} layers: {}\n", lies.both_sides.tops.size(),
                        air_words(lies.both_sides.air));
    text += pocket_lines(lies.both_sides.air, 5, "                ");
    return text + milled_ways_table(ways);
}

}  // namespace slabwright
