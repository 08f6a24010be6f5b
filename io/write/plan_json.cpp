#include "io/write/plan_json.h"

#include <algorithm>
#include <numbers>
#include <span>

#include "engine/forces/feeds.h"
#include "engine/moves/feed_lengths.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/program_grid.h"
#include "io/text/job_keys.h"
#include "io/text/sha256.h"
#include "io/write/wood_json.h"

namespace slabwright {

namespace {

using Shape = JsonText::Shape;

// Decimals of derived quantities. What the job or the engine decided is written exactly.
constexpr int kLength = 4, kMinutes = 4, kForce = 3, kArea = 3, kDeflection = 6, kExact = 6;

void put_xy(JsonText& json, const std::array<double, 2>& xy) {
    json.begin_array(Shape::line).exact(xy[0]).exact(xy[1]).end();
}

/// Writes the keys of a job as they are spelled in the job file.
struct JobPrinter {
    static constexpr bool kUsedKeysOnly = true;
    JsonText& json;
    const OwnPost* own_post = nullptr;  // null: none
    bool in_table = false;
    void table(const char* name, const char*) {
        close();
        json.key(name).begin_object();
        in_table = true;
    }
    void close() {
        if (in_table) json.end();
        in_table = false;
    }
    void required() {}
    void key(const char* name, double value, const char*) { json.key(name).exact(value); }
    void key(const char* name, int value, const char*) { json.key(name).integer(value); }
    void key(const char* name, bool value, const char*) { json.key(name).boolean(value); }
    void key(const char* name, const std::string& value, const char*) { json.key(name).string(value); }
    void key(const char* name, const std::vector<double>& values, const char*) {
        json.key(name).begin_array(Shape::line);
        for (const double value : values) json.exact(value);
        json.end();
    }
    void key(const char* name, const std::vector<std::array<double, 2>>& points, const char*) {
        json.key(name).begin_array(Shape::line);
        for (const std::array<double, 2>& point : points) put_xy(json, point);
        json.end();
    }
    void degrees(const char* name, double radians, const char*) {
        json.key(name).rounded(radians * 180 / std::numbers::pi, 9);
    }
    /// A post of the user's own is a file in the plan's folder.
    template <std::size_t N>
    void word(const char* name, Post value, const Word<Post> (&words)[N], const char*) {
        json.key(name).string(own_post != nullptr ? kOwnPostFile : word_of(words, value));
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum value, const Word<Enum> (&words)[N], const char*) {
        json.key(name).string(word_of(words, value));
    }
};

void put_tool(JsonText& json, const Plan& plan, const Tool& tool) {
    json.begin_object(Shape::line);
    json.key("number").integer(tool.number);
    json.key("kind").string(word_of(kToolWords, tool.kind));
    json.key("name").string(tool.name);
    json.key("diameter").exact(tool.diameter);
    if (has_corner(tool.kind)) json.key("corner_radius").exact(tool.corner_radius);
    if (has_taper(tool.kind)) json.key("taper_deg").exact(tool.taper_deg);
    if (has_point(tool.kind) && tool.point_deg != Tool{}.point_deg)
        json.key("point_deg").exact(tool.point_deg);
    json.key("flute_length").exact(tool.flute_length);
    json.key("shank_diameter").exact(tool.shank_diameter);
    json.key("holder")
        .begin_object()
        .key("diameter")
        .exact(tool.holder_diameter)
        .key("stickout")
        .exact(tool.stickout);
    if (!tool.holder_profile.empty()) {
        json.key("profile").begin_array();
        for (const double mm : tool.holder_profile) json.exact(mm);
        json.end();
    }
    json.end();
    json.key("flutes").integer(tool.flutes);
    json.key("helix_deg").rounded(tool.helix_rad * 180 / std::numbers::pi, 9);
    json.key("max_rpm").exact(tool.max_rpm);
    json.key("max_feed").exact(tool.max_feed);
    json.key("plunge_feed").exact(tool.plunge_feed);
    json.key("stepdown").begin_array().exact(tool.stepdown_min).exact(tool.stepdown_max).end();
    json.key("stepover").exact(tool.stepover);
    json.key("plunges").boolean(tool.plunges);
    json.key("core_diameter").exact(core_diameter_of(tool));
    json.key("ramp_deg").exact(ramp_limit_deg(tool));
    json.key("strength_mpa").exact(tool.strength_mpa);
    json.key("modulus_gpa").exact(tool.modulus_gpa);
    double allowed = 0;
    for (const Layer& layer : plan.layers)
        for (const Operation& operation : layer.operations)
            if (const double length =
                    operation.tool == tool.number ? allowed_length(operation, tool, plan.job) : 0;
                length > 0)
                allowed = allowed > 0 ? std::min(allowed, length) : length;
    json.key("allowed_length");
    if (allowed > 0) json.rounded(allowed, kLength);
    else json.null();
    json.end();
}

/// Those of the job; nothing where it has none.
void put_keep_outs(JsonText& json, const std::vector<KeepOut>& keep_outs) {
    if (keep_outs.empty()) return;
    json.key("keep_outs").begin_array();
    for (const KeepOut& keep_out : keep_outs) {
        json.begin_object(Shape::line);
        JobPrinter keys{json};
        visit_keep_out_keys(keep_out, keys);
        json.end();
    }
    json.end();
}

/// The job's own lines of cutting data; nothing where it has none.
void put_cutting_data(JsonText& json, const std::vector<CuttingData>& lines) {
    if (lines.empty()) return;
    json.key("cutting_data").begin_array();
    for (const CuttingData& data : lines) {
        json.begin_object(Shape::line);
        JobPrinter keys{json};
        visit_cutting_data_keys(data, keys);
        json.end();
    }
    json.end();
}

void put_place(JsonText& json, const std::optional<std::array<double, 3>>& place) {
    if (!place) {
        json.null();
        return;
    }
    json.begin_array();
    for (const double v : *place) json.rounded(v, kLength);
    json.end();
}

/// @param lines that its program has before the operation
void put_operation(JsonText& json, const Plan& plan, const Layer& layer, const Operation& operation,
                   std::uint32_t lines) {
    json.begin_object(Shape::line);
    json.key("kind").string(name(operation.kind));
    json.key("purpose").string(operation.purpose);
    json.key("tool").integer(operation.tool);
    json.key("stepdown").rounded(operation.stepdown, kLength);
    json.key("stepover").rounded(operation.stepover, kLength);
    json.key("bands").begin_array(Shape::line);
    for (const StepBand& band : operation.bands) {
        json.begin_object(Shape::line);
        json.key("z_low").rounded(band.z_low, kLength);
        json.key("z_high").rounded(band.z_high, kLength);
        json.key("least_slope_deg").rounded(band.least_slope_deg, kLength);
        json.key("stepdown").rounded(band.stepdown, kLength);
        json.end();
    }
    json.end();
    json.key("file").string("nc/" + operation.file);
    json.key("cutting_mm").rounded(operation.cutting_mm, kLength);
    json.key("rapid_mm").rounded(operation.rapid_mm, kLength);
    json.key("minutes").rounded(operation.minutes, kMinutes);
    json.key("spindle_rpm").rounded(operation.spindle_rpm, 0);
    json.key("blend").rounded(operation.blend, kLength);
    json.key("feeds").begin_array(Shape::line);
    for (const FeedLength& f :
         written_feed_lengths(dialect_of(plan.job.machine), operation.moves, program_origin(plan, layer))) {
        json.begin_object(Shape::line).key("feed").exact(f.feed).key("mm").rounded(f.mm, kExact);
        json.key("centre").begin_array(Shape::line);
        for (const double v : f.centre()) json.rounded(v, kExact);
        json.end().end();
    }
    json.end();
    json.key("bending_limit").rounded(bending_limit(operation, plan.job), kLength);
    json.key("peak_force_n").rounded(operation.peak_force_n, kForce);
    json.key("deflection_mm").rounded(operation.deflection_mm, kDeflection);
    json.key("wall_error_mm").rounded(operation.wall_error_mm, kDeflection);
    json.key("peak_torque_nmm").rounded(operation.peak_torque_nmm, kForce);
    json.key("peak_power_w").rounded(operation.peak_power_w, kForce);
    json.key("peak_at");
    put_place(json, operation.peak_at);
    json.key("peak_line");
    if (const std::size_t line =
            operation.peak_move ? program_line(plan, layer, operation, *operation.peak_move, lines) : 0;
        line > 0)
        json.integer(static_cast<std::int64_t>(line));
    else json.null();
    json.end();
}

void put_selection(JsonText& json, const std::optional<LayerSelection>& selection) {
    if (!selection) {
        json.null();
        return;
    }
    auto put = [&](const char* key, const std::optional<double>& value, int decimals) {
        json.key(key);
        if (value) json.rounded(*value, decimals);
        else json.null();
    };
    json.begin_object();
    json.key("least_slope_deg").rounded(selection->least_slope_deg, kLength);
    json.key("vertical").boolean(selection->vertical);
    json.key("finish_stepdown").rounded(selection->finish_stepdown, kLength);
    json.key("finish_stepdown_printed").rounded(selection->finish_stepdown_printed, kLength);
    json.key("rough_stepdown").rounded(selection->rough_stepdown, kLength);
    json.key("candidates").begin_array();
    for (const ToolCandidate& candidate : selection->candidates) {
        json.begin_object(Shape::line);
        json.key("purpose").string(candidate.purpose);
        json.key("tool").integer(candidate.tool);
        json.key("chosen").boolean(candidate.chosen);
        put("accessibility", candidate.accessibility, kDeflection);
        put("semi_rough_mm2", candidate.semi_rough_mm2, kArea);
        put("stepdown", candidate.stepdown, kLength);
        put("minutes", candidate.minutes, kMinutes);
        json.key("reason").string(candidate.reason);
        json.end();
    }
    json.end().key("sets").begin_array();
    for (const ToolSet& set : selection->sets) {
        json.begin_object(Shape::line);
        json.key("name").string(set.name);
        json.key("tools").begin_array();
        for (const int tool : set.tools) json.integer(tool);
        json.end();
        json.key("minutes").rounded(set.minutes, kMinutes);
        put("left_mm2", set.left_mm2, kArea);
        json.key("chosen").boolean(set.chosen);
        json.key("reason").string(set.reason);
        json.end();
    }
    json.end().end();
}

void put_centroid(JsonText& json, const Joint& joint) {
    json.begin_array(Shape::line)
        .rounded(joint.centroid[0], kLength)
        .rounded(joint.centroid[1], kLength)
        .end();
}

void put_dowels(JsonText& json, const std::vector<JointDowel>& dowels) {
    json.key("dowels").begin_array();
    for (const JointDowel& dowel : dowels) {
        json.begin_object(Shape::line);
        json.key("x").rounded(dowel.x, kLength).key("y").rounded(dowel.y, kLength);
        json.key("diameter").exact(dowel.diameter);
        json.key("below").rounded(dowel.below, kLength).key("above").rounded(dowel.above, kLength).end();
    }
    json.end();
}

void put_underside(JsonText& json, const Plan& under) {
    json.key("underside").begin_object(Shape::line);
    json.key("folder").string(underside_folder(under.turned->layer));
    json.key("minutes").rounded(under.totals.build_minutes, kMinutes).end();
}

void put_turned(JsonText& json, const TurnedSlab& slab) {
    json.key("turned").begin_object(Shape::line);
    json.key("layer").integer(slab.layer);
    json.key("z_bottom").exact(slab.z_bottom).key("z_top").exact(slab.z_top);
    json.key("slab_thickness").exact(slab.slab_thickness);
    json.key("min");
    put_xy(json, slab.blank.min);
    json.key("max");
    put_xy(json, slab.blank.max);
    json.key("web").exact(slab.web).key("room").exact(slab.room).end();
}

void put_layer(JsonText& json, const Plan& plan, const Layer& layer) {
    json.begin_object();
    json.key("index").integer(layer.index);
    json.key("z_bottom").exact(layer.z_bottom);
    json.key("z_top").exact(layer.z_top);
    json.key("slab_thickness").exact(layer.slab_thickness);
    json.key("slabs").integer(layer.slabs);
    json.key("blank").begin_object(Shape::line);
    const Blank blank = slab_of(plan, layer);
    json.key("min");
    put_xy(json, blank.min);
    json.key("max");
    put_xy(json, blank.max);
    json.end();
    json.key("reason").string(layer.reason);
    json.key("rounds").integer(layer.rounds);
    json.key("selection");
    put_selection(json, layer.selection);
    const Joint own = layer.joints.empty() ? Joint{} : layer.joints.front();
    json.key("glue_area_mm2").rounded(own.area_mm2, kArea);
    json.key("glue_centroid");
    put_centroid(json, own);
    json.key("press_force_n").rounded(own.force_n, kForce);
    json.key("joints").begin_array();
    for (const Joint& joint : layer.joints) {
        json.begin_object(Shape::line);
        json.key("z").rounded(joint.z, kLength);
        json.key("standing_mm2").rounded(joint.standing_mm2, kArea);
        json.key("glue_area_mm2").rounded(joint.area_mm2, kArea);
        json.key("glue_centroid");
        put_centroid(json, joint);
        json.key("press_force_n").rounded(joint.force_n, kForce);
        json.key("pressure_mpa").rounded(joint.pressure_mpa, kDeflection);
        json.end();
    }
    json.end();
    if (!layer.dowels.empty()) put_dowels(json, layer.dowels);
    for (const Plan& under : plan.undersides)
        if (under.turned->layer == layer.index) put_underside(json, under);
    json.key("operations").begin_array();
    std::uint32_t lines = 0;  // of the program so far that the operation is a part of
    for (const Operation& operation : layer.operations) {
        if (part_of(operation.file) <= 1) lines = 0;
        put_operation(json, plan, layer, operation, lines);
        if (part_of(operation.file) > 0) lines += line_count(plan, layer, operation, lines);
    }
    json.end().end();
}

void put_loop(JsonText& json, const Loops& region) {
    json.begin_array(Shape::line);
    for (const Point2 p : region.loop(0)) json.begin_array().units(p.x).units(p.y).end();
    json.end();
}

void put_flask(JsonText& json, const Plan& plan) {
    if (!plan.flask) {
        json.null();
        return;
    }
    const Flask& flask = *plan.flask;
    json.begin_object();
    json.key("gap_mm").exact(plan.job.flask.gap);
    json.key("wall_mm").rounded(flask.wall_mm, kLength);
    json.key("draft_deg").exact(plan.job.flask.draft_deg);
    json.key("mass_kg").rounded(flask.volume_mm3 * 1e-9 * plan.job.material.density_kg_m3, kForce);
    json.key("outer");
    put_loop(json, flask.outer);
    json.key("inner");
    put_loop(json, flask.inner.front());
    json.key("inner_by_layer").begin_array();
    for (const Loops& inner : flask.inner) put_loop(json, inner);
    json.end().end();
}

void put_totals(JsonText& json, const Totals& totals) {
    json.begin_object();
    json.key("layers").integer(totals.layers);
    json.key("operations").integer(totals.operations);
    json.key("tool_changes").integer(totals.tool_changes);
    json.key("magazine_swaps").integer(totals.magazine_swaps);
    json.key("cutting_mm").rounded(totals.cutting_mm, kLength);
    json.key("rapid_mm").rounded(totals.rapid_mm, kLength);
    json.key("cutting_minutes").rounded(totals.cutting_minutes, kMinutes);
    json.key("bonding_minutes").rounded(totals.bonding_minutes, kMinutes);
    json.key("tool_change_minutes").rounded(totals.tool_change_minutes, kMinutes);
    json.key("table_minutes").rounded(totals.table_minutes, kMinutes);
    json.key("magazine_minutes").rounded(totals.magazine_minutes, kMinutes);
    if (totals.underside_minutes > 0)
        json.key("underside_minutes").rounded(totals.underside_minutes, kMinutes);
    json.key("build_minutes").rounded(totals.build_minutes, kMinutes);
    json.key("stock_volume_mm3").rounded(totals.stock_volume_mm3, kArea);
    json.key("part_volume_mm3").rounded(totals.part_volume_mm3, kArea);
    json.key("stack_mass_kg").rounded(totals.stack_mass_kg, kForce);
    json.end();
}

}  // namespace

void put_repair(JsonText& json, const InputRepair& repair) {
    json.begin_object();
    json.key("how").string(repair.how);
    json.key("triangles").count(repair.triangles);
    json.key("moved").rounded(repair.moved_mm, 6);
    if (repair.how == "rebuild") {
        json.key("cell").rounded(repair.cell_mm, 6);
        json.key("deviation").rounded(repair.deviation_mm, 6);
        json.key("missed").rounded(repair.missed_mm, 6);
    }
    json.key("defects").begin_array();
    for (const RepairedDefect& d : repair.defects) {
        json.begin_object(Shape::line).key("kind").string(d.kind).key("count").count(d.count);
        if (!d.unit.empty()) json.key("size").rounded(d.size, 6).key("unit").string(d.unit);
        json.key("where").begin_array();
        for (const double v : d.where) json.rounded(v, 4);
        json.end().end();
    }
    json.end().end();
}

void put_preparation(JsonText& json, const InputPreparation& prepared) {
    json.begin_object().key("matrix").begin_array();
    for (const auto& row : prepared.map.rows) {
        json.begin_array(Shape::line);
        for (const double v : row) json.exact(v);
        json.end();
    }
    json.end();
    if (!prepared.skin_how.empty()) {
        json.key("skin").begin_object(Shape::line).key("mm").exact(prepared.skin_mm);
        json.key("how").string(prepared.skin_how).key("least").rounded(prepared.skin_least_mm, 4);
        json.key("most").rounded(prepared.skin_most_mm, 4).end();
    }
    json.end();
}

void put_input(JsonText& json, const InputInfo& input) {
    json.begin_object();
    json.key("file").string(input.file);
    json.key("sha256").string(input.sha256);
    json.key("triangles").count(input.triangles);
    json.key("bbox").begin_object(Shape::line);
    json.key("min").begin_array();
    for (const double v : input.min) json.rounded(v, 6);
    json.end().key("max").begin_array();
    for (const double v : input.max) json.rounded(v, 6);
    json.end().end();
    if (input.repair) {
        json.key("repair");
        put_repair(json, *input.repair);
    }
    if (input.prepared) {
        json.key("prepared");
        put_preparation(json, *input.prepared);
    }
    json.end();
}

void put_post(JsonText& json, const Machine& machine) {
    const std::string& text = machine.own_post->text;
    json.key("post").begin_object(Shape::line).key("file").string(kOwnPostFile);
    json.key("name").string(machine.own_post->name);
    json.key("base").string(word_of(kPostWords, machine.post));
    json.key("sha256").string(sha256(std::as_bytes(std::span(text)))).end();
}

void put_features(JsonText& json, const std::vector<Feature>& features) {
    json.begin_array();
    for (const Feature& feature : features) {
        json.begin_object(Shape::line);
        json.key("type").string(name(feature.type));
        // A patch has a range of heights, whatever its extent; everything else has one height.
        if (feature.type == FeatureType::shallow || feature.type == FeatureType::undercut)
            json.key("z").begin_array().rounded(feature.z_low, 6).rounded(feature.z_high, 6).end();
        else json.key("z").rounded(feature.z_low, 6);
        json.key("xy").begin_array().rounded(feature.x, 6).rounded(feature.y, 6).end();
        json.key("area").rounded(feature.area, kArea);
        json.key("found_by").string(name(feature.found_by));
        json.end();
    }
    json.end();
}

void put_diagnostics(JsonText& json, const std::vector<Diagnostic>& diagnostics) {
    json.begin_array();
    for (const Diagnostic& diagnostic : diagnostics) {
        json.begin_object(Shape::line);
        json.key("severity").string(name(diagnostic.severity));
        json.key("code").string(diagnostic.code);
        json.key("message").string(diagnostic.message);
        json.key("where");
        put_place(json, diagnostic.where);
        json.end();
    }
    json.end();
}

std::string plan_json(const Plan& plan) {
    JsonText json;
    json.begin_object();
    json.key("schema").string("slabwright.plan/1");
    json.key("version").string(SLABWRIGHT_VERSION);
    json.key("units").string("mm");
    json.key("frame").string(word_of(kFrameWords, frame_of(plan.job.machine)));
    json.key("input");
    put_input(json, plan.input);
    json.key("job").begin_object();
    JobPrinter job{json, plan.job.machine.own_post.get()};
    visit_plain_job_keys(plan.job, job);
    if (plan.job.dowels.per_joint > 0) visit_dowel_keys(plan.job.dowels, job);
    job.close();
    json.end();
    if (plan.job.machine.own_post) put_post(json, plan.job.machine);
    json.key("stock").begin_object(Shape::line);
    json.key("min");
    put_xy(json, plan.stock_min);
    json.key("max");
    put_xy(json, plan.stock_max);
    json.end();
    if (plan.turned) put_turned(json, *plan.turned);
    const Point2 zero = work_zero(plan);
    json.key("zero").begin_array(Shape::line).units(zero.x).units(zero.y).end();
    json.key("flask");
    put_flask(json, plan);
    json.key("supports").begin_array();
    for (const Support& s : plan.supports) {
        json.begin_object();
        json.key("layer").integer(s.layer);
        json.key("x").exact(s.x);
        json.key("y").exact(s.y);
        json.key("width").exact(s.width);
        json.key("z_low").exact(s.z_low);
        json.key("z_high").exact(s.z_high);
        json.end();
    }
    json.end();
    put_keep_outs(json, plan.job.machine.keep_outs);
    put_cutting_data(json, plan.job.material.cutting);
    json.key("tools").begin_array();
    for (const Tool& tool : plan.job.tools) put_tool(json, plan, tool);
    json.end();
    json.key("features");
    put_features(json, plan.features);
    json.key("layers").begin_array();
    for (const Layer& layer : plan.layers) put_layer(json, plan, layer);
    json.end();
    if (!plan.probes.empty()) {
        json.key("probes").begin_array();
        for (const ProbeProgram& probe : plan.probes) {
            json.begin_object(Shape::line).key("file").string("nc/" + probe.file);
            json.key("layer").integer(probe.layer);
            json.key("tool").integer(probe.tool).end();
        }
        json.end();
    }
    json.key("totals");
    put_totals(json, plan.totals);
    if (!plan.turned) {  // the wood of an underside is counted where its slab is laid
        const CutList list = cut_list(plan);
        json.key("wood");
        put_wood(json, list, cut_list(plan, Blanks::pattern));
        json.key("cost");
        put_cost(json, plan.job, cost_of(plan.job, amounts_of(plan, list)));
    }
    json.key("diagnostics");
    put_diagnostics(json, plan.diagnostics);
    json.end();
    return json.take();
}

}  // namespace slabwright
