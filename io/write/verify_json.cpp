#include "io/write/verify_json.h"

#include <algorithm>
#include <cmath>

#include "io/text/json_text.h"

namespace slabwright {

namespace {

void put_point(JsonText& text, const Point3& p) {
    text.begin_array(JsonText::Shape::line);
    for (const double v : p) text.rounded(v, 4);
    text.end();
}

void put_extreme(JsonText& text, const char* key, const Extreme& e) {
    text.key(key).begin_object(JsonText::Shape::line).key("mm").rounded(e.size, 5);
    text.key("where");
    if (e.size > 0) put_point(text, e.where);
    else text.null();
    text.end();
}

void put_missing(JsonText& text, const std::vector<MissingTool>& missing) {
    text.key("missing_tools").begin_array();
    for (const MissingTool& m : missing) {
        text.begin_object(JsonText::Shape::line);
        text.key("name").string(m.tool.name);
        text.key("kind").string(m.tool.kind == ToolKind::ball ? "ball" : "flat");
        text.key("diameter_mm").rounded(m.tool.diameter, 4);
        text.key("flute_length_mm").rounded(m.tool.flute_length, 3);
        text.key("stickout_mm").rounded(m.tool.stickout, 3);
        text.key("gain_mm2").rounded(m.gain_mm2, 1).key("depth_mm").rounded(m.depth_mm, 4).key("where");
        put_point(text, m.where);
        text.key("minutes").rounded(m.minutes, 1).key("reason").string(name(m.reason));
        text.key("layers").begin_array();
        for (const int layer : m.layers) text.integer(layer + 1);
        text.end().end();
    }
    text.end();
}

void put_undersides(JsonText& text, const std::vector<UndersideFindings>& undersides) {
    if (undersides.empty()) return;
    text.key("undersides").begin_array();
    for (const UndersideFindings& under : undersides) {
        const SimulationReport& r = under.report;
        double left = 0, missed = 0;
        for (const LayerFindings& f : r.layers) {
            left = std::max(left, f.left.size);
            missed = std::max(missed, f.missed_left.size);
        }
        text.begin_object(JsonText::Shape::line);
        text.key("layer").integer(under.layer).key("folder").string(under.folder);
        text.key("gouge_max_mm").rounded(r.gouge_max, 5);
        text.key("left_over_max_mm").rounded(left, 4);
        text.key("left_over_missed_max_mm").rounded(missed, 4);
        text.key("unreachable_mm2").rounded(r.unreachable_mm2(), 1);
        text.key("removed_mm3").rounded(r.removed_mm3, 0);
        text.key("cutting_mm").rounded(r.cutting_mm, 1);
        text.key("rapid_mm").rounded(r.rapid_mm, 1);
        text.key("minutes").rounded(r.seconds / 60, 2);
        if (under.floor) {
            const LoadedFloor& floor = *under.floor;
            text.key("floor").begin_object(JsonText::Shape::line);
            text.key("thickness").rounded(floor.thickness_mm, 2).key("reach").rounded(floor.reach_mm, 2);
            text.key("press_mpa").rounded(floor.press_mpa, 2).key("where");
            put_point(text, floor.at);
            text.end();
        }
        text.end();
    }
    text.end();
}

}  // namespace

std::string verify_json(const SimulationInput& input, const SimulationReport& r,
                        const SimulationOptions& options, const std::string& pattern, bool job_stated,
                        const std::vector<MissingTool>& missing,
                        const std::vector<UndersideFindings>& undersides) {
    JsonText text;
    text.begin_object();
    text.key("schema").string("slabwright.verify/1");
    text.key("passed").boolean(r.passed());
    text.key("pattern").string(pattern);
    text.key("limits").begin_object();
    text.key("stated_by").string(job_stated ? "plan.json" : "defaults");
    text.key("gouge_mm").exact(options.gouge);
    text.key("left_over_mm").exact(options.cusp + options.slack);
    text.key("left_over_share").exact(options.leftover_share);
    text.key("left_over_max_mm").exact(options.leftover_limit);
    text.key("board_cut_mm");
    if (options.board_cut >= 0) text.exact(options.board_cut);
    else text.null();
    text.end();
    text.key("resolution").begin_object();
    text.key("cell_mm").exact(r.cell);
    text.key("cells").begin_array(JsonText::Shape::line).integer(r.nx).integer(r.ny).end();
    double arc_error = 0;
    for (const Program& p : input.programs) arc_error = std::max(arc_error, p.arc_error);
    text.key("exact_check_error_mm").exact(StandingPart::kSheet + arc_error);
    text.key("arc_error_mm").exact(arc_error);
    text.end();
    double gouge_stock = 0, left = 0, missed = 0, squares = 0;
    std::uint64_t cells = 0, unreachable = 0, missed_cells = 0;
    for (const LayerFindings& f : r.layers) {
        gouge_stock = std::max(gouge_stock, f.gouge.size), left = std::max(left, f.left.size),
        missed = std::max(missed, f.missed_left.size);
        squares += f.left_rms * f.left_rms * static_cast<double>(f.cells);
        cells += f.cells, unreachable += f.unreachable, missed_cells += f.missed;
    }
    const double n = static_cast<double>(std::max<std::uint64_t>(1, cells)),
                 reachable = static_cast<double>(std::max<std::uint64_t>(1, cells - unreachable));
    text.key("totals").begin_object();
    text.key("gouge_max_mm").rounded(r.gouge_max, 5);
    text.key("gouge_stock_max_mm").rounded(gouge_stock, 5);
    text.key("left_over_max_mm").rounded(left, 4);
    text.key("left_over_rms_mm").rounded(std::sqrt(squares / n), 5);
    text.key("left_over_missed_max_mm").rounded(missed, 4);
    text.key("within_tolerance_share").rounded(1 - static_cast<double>(missed_cells) / reachable, 6);
    text.key("pattern_mm2").rounded(r.pattern_mm2, 1);
    text.key("unreachable_share").rounded(static_cast<double>(unreachable) / n, 6);
    text.key("unreachable_mm2").rounded(r.unreachable_mm2(), 1);
    text.key("unreachable_of_pattern_share")
        .rounded(r.pattern_mm2 > 0 ? r.unreachable_mm2() / r.pattern_mm2 : 0, 6);
    text.key("unreachable_max_mm").rounded(r.unreachable().size, 4);
    text.key("unmade_mm3").rounded(r.unmade_mm3(), 1);
    text.key("unmade_height_mm").rounded(r.unmade().size, 3);
    text.key("removed_mm3").rounded(r.removed_mm3, 0);
    text.key("cutting_mm").rounded(r.cutting_mm, 1);
    text.key("rapid_mm").rounded(r.rapid_mm, 1);
    text.key("minutes").rounded(r.seconds / 60, 2);
    text.key("board_cut_mm").rounded(r.board_cut, 4);
    text.key("violations").count(r.violations.size());
    text.end();
    text.key("violations").begin_array();
    for (const Violation& v : r.violations) {
        text.begin_object(JsonText::Shape::line);
        text.key("code").string(v.code).key("message").string(v.message);
        text.key("file");
        if (v.file.empty()) text.null();
        else text.string(v.file);
        text.key("line");
        if (v.line == 0) text.null();
        else text.count(v.line);
        text.key("where");
        if (v.where) put_point(text, *v.where);
        else text.null();
        text.key("size").rounded(v.size, 5).end();
    }
    text.end();
    put_missing(text, missing);
    text.key("layers").begin_array();
    for (std::size_t l = 0; l < r.layers.size(); ++l) {
        const LayerFindings& f = r.layers[l];
        const double area = r.cell * r.cell;
        text.begin_object();
        text.key("index").count(l + 1);
        text.key("z_bottom").exact(input.layers[l].z_bottom).key("z_top").exact(input.layers[l].z_top);
        put_extreme(text, "gouge", f.gouge);
        text.key("gouge_mm2").rounded(static_cast<double>(f.gouge_cells) * area, 3);
        put_extreme(text, "left_over", f.left);
        text.key("left_over_rms_mm").rounded(f.left_rms, 5);
        text.key("over_mm2").rounded(static_cast<double>(f.over) * area, 3);
        text.key("unreachable_mm2").rounded(static_cast<double>(f.unreachable) * area, 3);
        put_extreme(text, "unreachable", f.unreachable_left);
        text.key("unmade_mm3").rounded(f.unmade_mm3, 0);
        put_extreme(text, "unmade", f.unmade);
        text.key("missed_mm2").rounded(static_cast<double>(f.missed) * area, 3);
        put_extreme(text, "missed", f.missed_left);
        text.key("within_tolerance_share").rounded(f.within_share, 6);
        text.key("waste_mm2").rounded(static_cast<double>(f.waste) * area, 3);
        text.key("waste_mm3").rounded(f.waste_mm3, 1);
        text.end();
    }
    text.end();
    text.key("programs").begin_array();
    for (std::size_t i = 0; i < r.programs.size(); ++i) {
        const ProgramFindings& f = r.programs[i];
        const Program& p = input.programs[i];
        text.begin_object(JsonText::Shape::line);
        text.key("file")
            .string("nc/" + p.file)
            .key("layer")
            .integer(p.layer + 1)
            .key("kind")
            .string(name(p.kind))
            .key("tool")
            .integer(p.tool);
        text.key("gouge_mm").rounded(f.gouge.cutter.depth, 5);
        text.key("gouge_line");
        if (f.gouge.cutter.line != 0) text.count(f.gouge.cutter.line);
        else text.null();
        text.key("shank_in_part_mm")
            .rounded(f.gouge.shank.depth, 5)
            .key("holder_in_part_mm")
            .rounded(f.gouge.holder.depth, 5);
        text.key("rapid_takes_mm")
            .rounded(f.rapid.size, 4)
            .key("removed_mm3")
            .rounded(f.removed_mm3, 1)
            .key("lowest_z")
            .rounded(f.lowest, 4);
        text.key("cutting_mm")
            .rounded(f.cutting_mm, 1)
            .key("rapid_mm")
            .rounded(f.rapid_mm, 1)
            .key("minutes")
            .rounded(f.seconds / 60, 3)
            .end();
    }
    text.end();
    put_undersides(text, undersides);
    text.end();
    return text.take();
}

}  // namespace slabwright
