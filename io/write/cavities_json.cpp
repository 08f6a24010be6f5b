#include "io/write/cavities_json.h"

#include <fmt/format.h>

#include <algorithm>

namespace slabwright {

namespace {

using Shape = JsonText::Shape;

constexpr std::size_t kListed = 50, kShown = 12;
constexpr double kNothing = 1;  // mm²

void put_tool(JsonText& json, const char* key, const std::optional<CavityTool>& tool) {
    json.key(key);
    if (!tool) {
        json.null();
        return;
    }
    json.begin_object(Shape::line).key("number");
    if (tool->number > 0) json.integer(tool->number);
    else json.null();
    json.key("name").string(tool->name).key("diameter").rounded(tool->diameter_mm, 4);
    json.key("flute_length").rounded(tool->flute_length_mm, 3);
    json.key("stickout").rounded(tool->stickout_mm, 3);
    json.key("left").rounded(tool->left_mm2, 1).key("step").rounded(tool->step_mm, 3).end();
}

void put_layers(JsonText& json, const std::vector<CavityInLayer>& layers) {
    json.key("layers").begin_array();
    for (const CavityInLayer& in : layers) {
        json.begin_object(Shape::line).key("layer").count(in.layer + 1);
        json.key("z").begin_array().rounded(in.low_mm, 4).rounded(in.high_mm, 4).end();
        json.key("reach").rounded(in.reach_mm(), 4).end();
    }
    json.end();
}

std::string all_but(double left_mm2) {
    return left_mm2 < kNothing ? "all of it" : fmt::format("all but {:.2f} cm2", left_mm2 / 100);
}

}  // namespace

void put_cavities(JsonText& json, std::span<const CavityAdvice> cavities, const CavityOptions& limits) {
    json.begin_object().key("limits").begin_object(Shape::line);
    json.key("width").rounded(limits.most_width_mm, 6).key("ratio").rounded(limits.least_ratio, 6).end();
    json.key("places").count(cavities.size()).key("slenderest").begin_array();
    for (const CavityAdvice& a : cavities.first(std::min(kListed, cavities.size()))) {
        const NarrowCavity& c = a.cavity;
        json.begin_object().key("width").rounded(c.width_mm, 4).key("widest").rounded(c.widest_mm, 4);
        json.key("depth").rounded(c.depth_mm(), 4).key("ratio").rounded(c.ratio(), 3);
        json.key("length").rounded(c.length_mm, 3).key("area").rounded(c.area_mm2(), 1);
        json.key("where").begin_array(Shape::line);
        for (const double x : c.at) json.rounded(x, 4);
        json.end();
        put_layers(json, c.layers);
        json.key("stickout").rounded(a.stickout_mm, 3);
        put_tool(json, "tool", a.tool);
        put_tool(json, "missing", a.missing);
        json.key("boundary");
        if (a.boundary_mm) json.rounded(*a.boundary_mm, 3);
        else json.null();
        json.key("advice").string(cavity_words(a)).end();
    }
    json.end().end();
}

std::string cavity_words(const CavityAdvice& advice) {
    std::string text;
    if (advice.tool && advice.tool->left_mm2 < kNothing)
        text = fmt::format("tool {} reaches all of it, {:.2f} mm at once", advice.tool->number,
                           advice.tool->step_mm);
    else if (advice.tool)
        text = fmt::format("tool {} reaches {}", advice.tool->number, all_but(advice.tool->left_mm2));
    else text = "no tool of the library enters it";
    if (advice.boundary_mm)
        text += fmt::format("; with a layer boundary at z {:.3f} {}", *advice.boundary_mm,
                            advice.missing
                                ? advice.missing->name + " would reach " + all_but(advice.missing->left_mm2)
                                : "one that is too short would");
    else if (advice.missing)
        text += fmt::format("; {} would reach {}, {:.2f} mm at once", advice.missing->name,
                            all_but(advice.missing->left_mm2), advice.missing->step_mm);
    return text;
}

std::string cavities_text(std::span<const CavityAdvice> cavities) {
    std::string text;
    for (const CavityAdvice& a : cavities.first(std::min(kShown, cavities.size()))) {
        const NarrowCavity& c = a.cavity;
        const std::string wide = c.widest_mm - c.width_mm > 0.01
                                     ? fmt::format("{:.2f} to {:.2f}", c.width_mm, c.widest_mm)
                                     : fmt::format("{:.2f}", c.width_mm);
        text += fmt::format("  cavity      {} mm wide, {:.2f} deep ({:.1f} times), {:.1f} long", wide,
                            c.depth_mm(), c.ratio(), c.length_mm);
        text += fmt::format(" at x {:.2f} y {:.2f} z {:.2f}\n                {}\n", c.at[0], c.at[1], c.at[2],
                            cavity_words(a));
    }
    if (cavities.size() > kShown)
        text += fmt::format("  and {} more narrow cavities\n", cavities.size() - kShown);
    return text;
}

}  // namespace slabwright
