#include "io/write/draw_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace slabwright {

namespace {

using Shape = JsonText::Shape;

constexpr std::size_t kListed = 12, kShown = 3;

void put_place(JsonText& json, const Point3& at) {
    json.key("where").begin_array(Shape::line);
    for (const double x : at) json.rounded(x, 3);
    json.end();
}

void put_patches(JsonText& json, const char* key, double mm2, std::span<const DrawPatch> patches,
                 const char* worst) {
    json.key(key).begin_object().key("area").rounded(mm2, 1).key("places").count(patches.size());
    json.key("largest").begin_array();
    for (const DrawPatch& p : patches.first(std::min(kListed, patches.size()))) {
        json.begin_object(Shape::line).key("area").rounded(p.area_mm2, 1).key(worst).rounded(p.worst, 3);
        put_place(json, p.at);
        json.key("first_facet").count(p.first_facet).end();
    }
    json.end().end();
}

std::string patch_lines(const std::string& name, double mm2, std::span<const DrawPatch> patches,
                        const char* unit) {
    if (patches.empty()) return {};
    std::string text = fmt::format("  {:<11} {:.1f} cm2 in {} place{}\n", name, mm2 / 100, patches.size(),
                                   patches.size() == 1 ? "" : "s");
    for (const DrawPatch& p : patches.first(std::min(kShown, patches.size())))
        text += fmt::format("                {:.2f} cm2, {:.2f} {} at x {:.1f} y {:.1f} z {:.1f}\n",
                            p.area_mm2 / 100, p.worst, unit, p.at[0], p.at[1], p.at[2]);
    return text;
}

}  // namespace

void put_draw(JsonText& json, const DrawReport& report) {
    json.begin_object().key("limits").begin_object(Shape::line);
    json.key("draft_deg").rounded(report.limits.draft_deg, 6);
    json.key("thin").rounded(report.limits.thin_mm, 6);
    json.key("corner_deg").rounded(report.limits.corner_deg, 6).end();
    put_patches(json, "little_draft", report.little_draft_mm2, report.little_draft, "draft_deg");
    put_patches(json, "undercut_to_draw", report.undercut_mm2, report.undercuts, "draft_deg");
    put_patches(json, "thin_walls", report.thin_mm2, report.thin, "thickness");
    json.key("inner_corners").begin_object().key("length").rounded(report.corners_mm, 1);
    json.key("places").count(report.corners.size()).key("largest").begin_array();
    for (std::size_t i = 0; i < std::min(kListed, report.corners.size()); ++i) {
        const InnerCorner& c = report.corners[i];
        json.begin_object(Shape::line).key("length").rounded(c.length_mm, 1);
        json.key("angle_deg").rounded(c.angle_deg, 2);
        put_place(json, c.at);
        json.end();
    }
    json.end().end().end();
}

std::string draw_text(const DrawReport& report) {
    const DrawLimits& limits = report.limits;
    std::string text = patch_lines(fmt::format("draft under {:g} deg:", limits.draft_deg),
                                   report.little_draft_mm2, report.little_draft, "deg") +
                       patch_lines("undercut to the draw:", report.undercut_mm2, report.undercuts, "deg") +
                       patch_lines(fmt::format("walls under {:g} mm, both sides:", limits.thin_mm),
                                   report.thin_mm2, report.thin, "mm");
    if (report.corners.empty()) return text;
    text += fmt::format("  sharp inner corners: {:.0f} mm in {} place{}\n", report.corners_mm,
                        report.corners.size(), report.corners.size() == 1 ? "" : "s");
    for (std::size_t i = 0; i < std::min(kShown, report.corners.size()); ++i) {
        const InnerCorner& c = report.corners[i];
        text += fmt::format("                {:.1f} mm, {:.1f} deg at x {:.1f} y {:.1f} z {:.1f}\n",
                            c.length_mm, c.angle_deg, c.at[0], c.at[1], c.at[2]);
    }
    return text;
}

}  // namespace slabwright
