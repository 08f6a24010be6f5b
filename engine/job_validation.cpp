// What a job may mean: numbers out of range are refused by their key.
#include "engine/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/errors.h"

namespace slabwright {

namespace {

/// Throws with the key as the place; io/read/job_toml puts file and line there when the job came from a file.
[[noreturn]] void refuse(const std::string& key, const std::string& message, const std::string& remedy) {
    throw Error(ErrorKind::usage, "job.range", message, key, remedy);
}

enum class Ends { closed, open_low, open_both };

// Why a number may be no smaller: what a job can mean bounds the work that it makes.
constexpr const char* kNoCutter = "no cutter for wood is smaller";
constexpr const char* kNoRouter = "no router does less";
constexpr const char* kFinerThanProgrammed =
    "programs are written to 0.0001 mm, and some of that is rounding";
constexpr const char* kFinerThanUseful = "finer steps show nowhere in wood, and take without end";

constexpr double kLeastAdvance = 0.05;  ///< mm from one cut to the next beside it: step-over times diameter
constexpr double kWidestFacing = 0.9;   ///< share of a face mill's diameter from pass to pass
constexpr double kLeastLayer = 0.3;     ///< mm that slab and tools must leave a layer

/// One number must lie between low and high; `ends` says which of them it may equal, `why` what speaks
/// against less.
void require(const std::string& key, double value, double low, double high, Ends ends = Ends::closed,
             const char* why = nullptr) {
    const bool low_ok = ends == Ends::closed ? value >= low : value > low;
    const bool high_ok = ends == Ends::open_both ? value < high : value <= high;
    if (low_ok && high_ok) return;  // a NaN fails both
    refuse(key, fmt::format("{} is {}, out of range", key, value),
           fmt::format("give a number {} {} and {} {}{}", ends == Ends::closed ? "from" : "over", low,
                       ends == Ends::open_both ? "under" : "up to", high,
                       why != nullptr && value < low ? fmt::format(" ({})", why) : ""));
}

void validate_corner(const Tool& tool, const std::string& key) {
    if (!has_corner(tool.kind)) {
        if (tool.corner_radius != 0)
            refuse(key, fmt::format("{} is {}, but the tool is no bull-nose", key, tool.corner_radius),
                   "leave it out, or say kind = \"bull-nose\" or \"tapered-ball\"");
        return;
    }
    require(
        key, tool.corner_radius, 0.01, tool.diameter / 2, Ends::closed,
        "a bull-nose has a corner between 0.01 mm and its radius: a sharper one is a flat, a rounder one a "
        "ball; a tapered ball's tip is as small");
    if (tool.corner_radius >= tool.diameter / 2)
        refuse(key, fmt::format("{} is {}, the tool's whole radius", key, tool.corner_radius),
               "say kind = \"ball\"");
    if (tool.corner_radius > tool.flute_length)
        refuse(key, fmt::format("{} is {}, more than the flute length", key, tool.corner_radius),
               "give the radius between floor and side");
}

// A tapered ball's or a cone's flank, which is to be as wide as the tool within its flutes.
void validate_flank(const Tool& tool, const std::string& taper_key, const std::string& point_key,
                    const std::string& diameter_key) {
    if (!has_taper(tool.kind) && tool.taper_deg != 0)
        refuse(taper_key, fmt::format("{} is {}, but the tool has no taper", taper_key, tool.taper_deg),
               "leave it out, or say kind = \"tapered-ball\"");
    if (has_taper(tool.kind))
        require(taper_key, tool.taper_deg, 0.5, 80, Ends::closed, "a ball with no taper is kind = \"ball\"");
    if (has_point(tool.kind)) require(point_key, tool.point_deg, 10, 170);
    else if (tool.point_deg != Tool{}.point_deg)
        refuse(point_key, fmt::format("{} is {}, but the tool has no point", point_key, tool.point_deg),
               "leave it out, or say kind = \"cone\" or \"drill\"");
    if (!has_taper(tool.kind) && tool.kind != ToolKind::cone) return;
    const CutterShape shape = cutter_shape(tool);
    const double flank =
                     (shape.radius - shape.corner * std::cos(shape.taper_rad)) / std::tan(shape.taper_rad),
                 high = shape.corner * (1 - std::sin(shape.taper_rad)) + flank;
    if (high > tool.flute_length + 1e-6)
        refuse(
            diameter_key,
            fmt::format("{} is {}, which the tool is only {:.3f} mm over its tip, above its flutes of {} mm",
                        diameter_key, tool.diameter, high, tool.flute_length),
            "give the diameter where the flutes end");
}

void validate_holder(const Tool& tool, const std::string& key) {
    const std::vector<double>& profile = tool.holder_profile;
    if (profile.empty()) return;
    if (profile.size() % 3 != 0)
        refuse(key, fmt::format("{} has {} numbers", key, profile.size()),
               "give three for each piece: its height, and the diameters of its lower and its upper end");
    for (std::size_t k = 0; k < profile.size(); ++k)
        require(key, profile[k], 0.1, k % 3 == 0 ? 2000 : 1000, Ends::closed, kNoCutter);
    if (std::abs(profile[1] - tool.holder_diameter) > 1e-6)
        refuse(key,
               fmt::format("{} begins {} mm wide, but holder_diameter is {}", key, profile[1],
                           tool.holder_diameter),
               "give the nose's diameter in both");
}

void validate_tool(const Tool& tool, std::size_t position, Post post) {
    const auto key = [&](const char* name) { return fmt::format("tool[{}].{}", position + 1, name); };
    require(key("number"), tool.number, 1, control_of(post).highest_tool);
    require(key("diameter"), tool.diameter, 0.3, 1000, Ends::closed, kNoCutter);
    require(key("flute_length"), tool.flute_length, 0.1, 1000, Ends::closed, kNoCutter);
    require(key("shank_diameter"), tool.shank_diameter, 0.1, 1000, Ends::closed, kNoCutter);
    require(key("stickout"), tool.stickout, 0.1, 2000, Ends::closed, kNoCutter);
    if (tool.stickout < tool.flute_length)
        refuse(key("stickout"),
               fmt::format("{} is {}, less than the flute length {}", key("stickout"), tool.stickout,
                           tool.flute_length),
               "give the length from the holder's nose to the tip");
    require(key("holder_diameter"), tool.holder_diameter, 0.1, 1000, Ends::closed, kNoCutter);
    require(key("flutes"), tool.flutes, 1, 100);
    require(key("helix_deg"), tool.helix_rad * 180 / std::numbers::pi, 0, 80);
    require(key("max_rpm"), tool.max_rpm, 10, 1e6, Ends::closed, kNoRouter);
    require(key("max_feed"), tool.max_feed, 1, 1e6);
    require(key("plunge_feed"), tool.plunge_feed, 1, 1e6);
    require(key("stepdown_min"), tool.stepdown_min, 0, 1000);
    require(key("stepdown_max"), tool.stepdown_max, 0.05, 1000, Ends::closed, kFinerThanUseful);
    if (tool.stepdown_max < tool.stepdown_min)
        refuse(key("stepdown_max"),
               fmt::format("{} is {}, less than stepdown_min {}", key("stepdown_max"), tool.stepdown_max,
                           tool.stepdown_min),
               "swap the two");
    if (tool.stepdown_max > tool.flute_length)
        refuse(key("stepdown_max"),
               fmt::format("{} is {}, deeper than the flutes of {} mm", key("stepdown_max"),
                           tool.stepdown_max, tool.flute_length),
               "give a step that the flutes cut");
    // Passes of a face mill that hardly overlap leave corners between their ends.
    require(key("stepover"), tool.stepover, 0.01, tool.kind == ToolKind::face ? kWidestFacing : 1,
            Ends::closed, kFinerThanUseful);
    if (tool.stepover * tool.diameter < kLeastAdvance)
        refuse(key("stepover"),
               fmt::format("{} is {}: cuts would lie {:g} mm apart", key("stepover"), tool.stepover,
                           tool.stepover * tool.diameter),
               fmt::format("give a share of the diameter that makes {} mm at least", kLeastAdvance));
    require(key("strength_mpa"), tool.strength_mpa, 0, 1e5);
    require(key("modulus_gpa"), tool.modulus_gpa, 1, 2000);
    require(key("core_diameter"), tool.core_diameter, -tool.diameter, tool.diameter, Ends::open_both);
    const bool may_have_core = !tool.plunges && (roughs_layers(tool.kind) || tool.kind == ToolKind::face);
    if (tool.core_diameter > 0 && !may_have_core)
        refuse(key("core_diameter"),
               fmt::format("{} is {}, but the tool cuts at its middle", key("core_diameter"),
                           tool.core_diameter),
               "only flat and bull-nose end mills and face mills with plunges = false have a core; leave it "
               "out");
    require(key("ramp_deg"), tool.ramp_deg, -90, 90);
    validate_corner(tool, key("corner_radius"));
    validate_flank(tool, key("taper_deg"), key("point_deg"), key("diameter"));
    validate_holder(tool, key("holder_profile"));
}

void validate_boards(const Slabs& s) {
    require("slabs.length", s.length, 1, 100000);
    require("slabs.width", s.width, 1, 100000);
    require("slabs.margin", s.margin, 0, 10000);
    require("slabs.board_length", s.board_length, 0, 100000);
    require("slabs.board_width", s.board_width, 0, 100000);
    require("slabs.kerf", s.kerf, 0, 100);
}

void validate_prices(const Prices& p, const Slabs& s) {
    for (const double price : p.board_m2) require("prices.board_m2", price, 0, 1e9);
    if (p.board_m2.size() > 1 && p.board_m2.size() != s.thicknesses.size())
        refuse("prices.board_m2",
               fmt::format("prices.board_m2 has {} prices for {} slabs.thicknesses", p.board_m2.size(),
                           s.thicknesses.size()),
               "give one for all of them, or one for each in the same order");
    require("prices.base_board_m2", p.base_board_m2, 0, 1e9);
    require("prices.glue_kg", p.glue_kg, 0, 1e9);
    require("prices.machine_hour", p.machine_hour, 0, 1e9);
    require("prices.dowel", p.dowel, 0, 1e9);
}

void validate_bonding(const Bonding& b) {
    require("bonding.press_force", b.press_force, 0, 1e7);
    require("bonding.press_time_s", b.press_time_s, 0, 1e6);
    require("bonding.open_time_s", b.open_time_s, 0, 1e6);
    require("bonding.max_pressure_mpa", b.max_pressure_mpa, 0.0001, 1000);
    require("bonding.min_pressure_mpa", b.min_pressure_mpa, 0, b.max_pressure_mpa);
    require("bonding.edge_setback", b.edge_setback, 0, 1000);
    require("bonding.handling_s", b.handling_s, 0, 1e6);
    require("bonding.glue_s_per_m2", b.glue_s_per_m2, 0, 1e6);
    require("bonding.glue_g_per_m2", b.glue_g_per_m2, 0, 1e6);
}

void validate_motion(const Machine& c) {
    require("machine.max_feed", c.max_feed, 1, 1e6);
    require("machine.rapid_feed", c.rapid_feed, 1, 1e6);
    require("machine.acceleration", c.acceleration, 1, 1e6, Ends::closed, kNoRouter);
    for (const auto& [key, value] : {std::pair{"machine.rapid_y", c.rapid_y},
                                     {"machine.rapid_z", c.rapid_z},
                                     {"machine.acceleration_y", c.acceleration_y},
                                     {"machine.acceleration_z", c.acceleration_z}})
        if (value != 0) require(key, value, 1, 1e6, Ends::closed, kNoRouter);
}

void validate_handler(const Machine& c) {
    require("machine.handler_speed", c.handler_speed, 0, 1e6);
    require("machine.handler_travel", c.handler_travel, 0, 100000);
    require("machine.grip_s", c.grip_s, 0, 36000);
    require("machine.press_lift", c.press_lift, 0, 100000);
    require("machine.glue_pitch", c.glue_pitch, 0.5, 1000);
    require("machine.glue_speed", c.glue_speed, 1, 1e6);
    require("machine.pump_g_min", c.pump_g_min, 0, 1e6);
    if (c.glue_head == GlueHead::slab && !has_handler(c))
        refuse("machine.glue_head", "machine.glue_head is \"slab\", but nothing carries the slab over it",
               "give machine.handler_speed and machine.feed_height and a table that moves, or \"stack\"");
}

void validate_cutting(const Cutting& k) {
    require("cutting.wall_allowance", k.wall_allowance, 0, 100);
    require("cutting.floor_allowance", k.floor_allowance, 0, 100);
    require("cutting.rough_blend", k.rough_blend, 0.02, 1);
    require("cutting.steep_limit_deg", k.steep_limit_deg, 1, 89);
    require("cutting.overlap_deg", k.overlap_deg, 0, 45);
    require("cutting.vertical_deg", k.vertical_deg, 45, 90);
    if (k.vertical_deg <= k.steep_limit_deg)
        refuse("cutting.vertical_deg",
               fmt::format("cutting.vertical_deg is {}, not over steep_limit_deg {}", k.vertical_deg,
                           k.steep_limit_deg),
               "vertical walls are steeper than steep ones");
    require("cutting.min_stepdown", k.min_stepdown, 0.01, 100, Ends::closed, kFinerThanUseful);
    require("cutting.min_stepover", k.min_stepover, 0.01, 100, Ends::closed, kFinerThanUseful);
    require("cutting.min_flat_area", k.min_flat_area, 0, 1e6);
    require("cutting.face_depth", k.face_depth, 0.05, 1000, Ends::closed, kFinerThanUseful);
    require("cutting.ramp_deg", k.ramp_deg, 0.1, 90, Ends::closed,
            "the way into the stock grows as it falls");
    require("cutting.max_engagement", k.max_engagement, 0.01, 1, Ends::closed, kFinerThanUseful);
    require("cutting.holder_clearance", k.holder_clearance, 0, 1000);
    require("cutting.finish_feed", k.finish_feed, 1, 1e6);
    require("cutting.edge_angle_deg", k.edge_angle_deg, 1, 179);
}

void validate_machine(const Machine& c, const Probing& probing) {
    require("machine.travel_x", c.travel_x, 1, 100000, Ends::closed, kNoRouter);
    require("machine.travel_y", c.travel_y, 1, 100000, Ends::closed, kNoRouter);
    require("machine.travel_z", c.travel_z, 1, 100000, Ends::closed, kNoRouter);
    require("machine.build_height", c.build_height, 1, 100000, Ends::closed, kNoRouter);
    require("machine.build_mass_kg", c.build_mass_kg, 0.001, 1e6, Ends::closed, kNoRouter);
    require("machine.table_speed", c.table_speed, 1, 1e6, Ends::closed, kNoRouter);
    require("machine.feed_height", c.feed_height, 0, 100000);
    require("machine.feed_mass_kg", c.feed_mass_kg, 0.001, 1e6, Ends::closed, kNoRouter);
    validate_handler(c);
    validate_motion(c);
    validate_probing(probing);
    require("machine.max_rpm", c.max_rpm, 10, 1e6, Ends::closed, kNoRouter);
    require("machine.min_rpm", c.min_rpm, 0, c.max_rpm);
    require("machine.spindle_power_w", c.spindle_power_w, 0, 1e6);
    require("machine.spindle_torque_nm", c.spindle_torque_nm, 0, 1e4);
    require("machine.spindle_dwell_s", c.spindle_dwell_s, 0, 600);
    require("machine.tool_change_s", c.tool_change_s, 0, 36000);
    require("machine.magazine", c.magazine, 0, 1000);
    require("machine.magazine_swap_s", c.magazine_swap_s, 0, 36000);
    if (c.magazine > 0 && !changes_tools(c.post))
        refuse("machine.magazine",
               fmt::format("machine.magazine is {}, but a program for grbl cannot change a tool (no M6)",
                           c.magazine),
               "leave it out: its tools are changed by hand");
    require("machine.clearance", c.clearance, 1, 1000, Ends::closed,
            "rapids pass the stock at that height, on a machine that rounds its corners");
    if (c.programs == ProgramSpan::layer && !changes_tools(c.post))
        refuse("machine.programs",
               "machine.programs is \"layer\", but a program for grbl cannot change a tool (no M6)",
               "give \"tool\", one program for each tool of a layer, or \"operation\"");
    require("machine.base_board_thickness", c.base_board_thickness, 0, 1000);
    require("machine.base_board_cut", c.base_board_cut, -1000, c.base_board_thickness);
    validate_keep_outs(c.keep_outs);
    validate_pin(c.pin, c.zero == WorkZero::pin);
}

void validate_prepare(const PrepareJob& p) {
    const auto numbers = [](const char* key, const std::vector<double>& values, std::size_t count,
                            double least, double most) {
        if (values.size() != count)
            refuse(key, fmt::format("{} has {} numbers", key, values.size()),
                   fmt::format("give {} numbers, e.g. {}", count,
                               count == 6 ? "[0.0, 0.0, 0.0, 100.0, 100.0, 50.0]" : "[0.0, 0.0, 1.0]"));
        for (const double value : values) require(key, value, least, most);
    };
    numbers("prepare.turn", p.turn, 3, -360, 360);
    numbers("prepare.scale", p.scale, 3, 0.0001, 10000);
    numbers("prepare.shift", p.shift, 3, -100000, 100000);
    require("prepare.skin", p.skin, 0, 100);
    require("prepare.skin_angle_deg", p.skin_angle_deg, 0, 180);
    if (!p.skin_normal.empty()) {
        numbers("prepare.skin_normal", p.skin_normal, 3, -1e6, 1e6);
        if (std::hypot(p.skin_normal[0], p.skin_normal[1], p.skin_normal[2]) < 1e-6)
            refuse("prepare.skin_normal", "prepare.skin_normal has no direction",
                   "give e.g. [0.0, 0.0, 1.0]");
    }
    if (!p.skin_box.empty()) {
        numbers("prepare.skin_box", p.skin_box, 6, -1e6, 1e6);
        for (std::size_t k = 0; k < 3; ++k)
            if (!(p.skin_box[k] <= p.skin_box[k + 3]))
                refuse("prepare.skin_box", "prepare.skin_box has its corners the wrong way round",
                       "give the least x, y, z first");
    }
}

void validate_flask(const Job& job) {
    const FlaskShape& f = job.flask;
    require("flask.gap", f.gap, 0, 10000);
    require("flask.wall", f.wall, 0, 10000, Ends::open_low);
    require("flask.draft_deg", f.draft_deg, 0, 45);
    if (f.enabled && f.gap < least_flask_gap(job))
        refuse("flask.gap",
               fmt::format("flask.gap is {}: the cutters do not pass between pattern and flask", f.gap),
               fmt::format("give at least {} (the narrowest flat or ball end mill, whichever is wider, the "
                           "wall allowance and room)",
                           least_flask_gap(job)));
    if (f.enabled && !(f.wall > 2 * job.bonding.edge_setback))
        refuse("flask.wall",
               fmt::format("flask.wall is {}: glue that keeps {} mm from every edge finds no place on it",
                           f.wall, job.bonding.edge_setback),
               fmt::format("give more than {}, or less bonding.edge_setback", 2 * job.bonding.edge_setback));
}

void validate_dowels(const JointDowels& dowels) {
    require("dowels.per_joint", dowels.per_joint, 0, 12);
    if (dowels.per_joint == 1)
        refuse("dowels.per_joint", "dowels.per_joint is 1: a slab turns about one dowel",
               "give 2 or more, or 0 for none");
    require("dowels.diameter", dowels.diameter, 2, 50);
    require("dowels.depth", dowels.depth, 1, 200);
    require("dowels.clearance", dowels.clearance, 1, 200);
    require("dowels.set_s", dowels.set_s, 0, 3600);
    if (dowels.depth < dowels.diameter / 2)
        refuse("dowels.depth", fmt::format("dowels.depth is {}, under half of dowels.diameter", dowels.depth),
               "a dowel does not hold in that: give deeper holes");
}

void validate_joining(const Job& job) {
    validate_dowels(job.dowels);
    if (job.layers.sides != SlabSides::one && job.dowels.per_joint == 0)
        refuse("layers.sides",
               "slabs that are milled on both sides and turned are brought to their place by dowels, and "
               "dowels.per_joint is 0",
               "give dowels.per_joint = 2, or layers.sides = \"one\"");
}

}  // namespace

void validate(const Job& job) {
    const Material& m = job.material;
    require("material.strength_mpa", m.strength_mpa, 0.01, 10000);
    require("material.min_thickness", m.min_thickness, 0, 1000);
    require("material.shallow_limit_deg", m.shallow_limit_deg, 0, 90, Ends::open_both);
    require("material.density_kg_m3", m.density_kg_m3, 1, 30000);
    require("material.ktc", m.ktc, 0, 100000);
    require("material.kte", m.kte, 0, 100000);
    require("material.kfc", m.kfc, 0, 100000);
    require("material.kfe", m.kfe, 0, 100000);
    validate_prepare(job.prepare);
    const Slabs& s = job.slabs;
    if (s.thicknesses.empty())
        refuse("slabs.thicknesses", "slabs.thicknesses is empty",
               "list the thicknesses in stock, e.g. [19.0]");
    for (std::size_t i = 0; i < s.thicknesses.size(); ++i) {
        require("slabs.thicknesses", s.thicknesses[i], 0.5, 1000, Ends::closed, "no board is thinner");
        if (i > 0 && !(s.thicknesses[i] > s.thicknesses[i - 1]))
            refuse("slabs.thicknesses",
                   fmt::format("slabs.thicknesses has {} after {}", s.thicknesses[i], s.thicknesses[i - 1]),
                   "list them in ascending order, each once");
    }
    validate_boards(s);
    require("slabs.facing_allowance", s.facing_allowance, 0, 1000);
    if (s.facing_allowance > s.thicknesses.front() - kLeastLayer)
        refuse("slabs.facing_allowance",
               fmt::format("slabs.facing_allowance is {}: next to nothing is left of the {} mm slab",
                           s.facing_allowance, s.thicknesses.front()),
               "face off less, or take that slab out of the list");

    validate_cutting_data(job.material.cutting);
    validate_machine(job.machine, job.probing);
    validate_bonding(job.bonding);
    validate_prices(job.prices, s);
    validate_joining(job);

    const Tolerances& t = job.tolerances;
    require("tolerances.gouge", t.gouge, 0.001, 1, Ends::closed, kFinerThanProgrammed);
    require("tolerances.cusp", t.cusp, 0.001, 10, Ends::closed, kFinerThanProgrammed);
    require("tolerances.rough_cusp", t.rough_cusp, 0.001, 100, Ends::closed, kFinerThanProgrammed);
    require("tolerances.chordal_deviation", t.chordal_deviation, 0, 10);
    require("tolerances.simplify", t.simplify, 0, 0.5);
    require("tolerances.undercut", t.undercut, 0, 10000);
    require("tolerances.gap", t.gap, 0, 1000);
    require("tolerances.weld", t.weld, 0, 100);

    const LayerPlanning& l = job.layers;
    require("layers.min_layer", l.min_layer, 0, 1000);
    require("layers.alpha", l.alpha, 0, 1e6);
    require("layers.beta", l.beta, 0, 1e6);
    require("layers.flat_merge", l.flat_merge, 0, 1000);
    require("layers.halving_coarse", l.halving_coarse, 0.01, 1000, Ends::closed, kFinerThanUseful);
    require("layers.halving_resolution", l.halving_resolution, 0.01, 1000, Ends::closed, kFinerThanUseful);
    if (l.halving_resolution > l.halving_coarse)
        refuse("layers.halving_resolution",
               fmt::format("layers.halving_resolution is {}, over halving_coarse {}", l.halving_resolution,
                           l.halving_coarse),
               "halving starts at the coarse spacing and ends at the resolution");

    validate_cutting(job.cutting);

    const ToolSelection& select = job.selection;
    require("selection.threshold", select.threshold, 0, 1);
    require("selection.overlap_weight", select.overlap_weight, 0, 100);
    require("selection.voxel", select.voxel, 0.05, 5);

    validate_flask(job);
    if (job.tools.empty())
        throw Error(ErrorKind::usage, "job.tool", "the tool library is empty", "tool",
                    "add a [[tool]] to the job file");
    for (std::size_t i = 0; i < job.tools.size(); ++i) {
        validate_tool(job.tools[i], i, job.machine.post);
        for (std::size_t j = 0; j < i; ++j)
            if (job.tools[j].number == job.tools[i].number)
                refuse(fmt::format("tool[{}].number", i + 1),
                       fmt::format("tool number {} appears twice", job.tools[i].number),
                       "number each tool once");
    }
    const double tallest = max_layer_thickness(job);
    const double least = std::max(kLeastLayer, l.min_layer);
    if (!(tallest >= least))
        throw Error(
            ErrorKind::usage, "job.no_layer",
            fmt::format("the tallest layer that these slabs and tools can cut is {:.3f} mm, under {} {}",
                        tallest, l.min_layer < kLeastLayer ? "the least," : "layers.min_layer", least),
            "", "take thicker slabs or tools with longer flutes, or lower the minimum");
}

}  // namespace slabwright
