// The one table of a job's keys: their names, comments and places in engine/job.h. Reading, printing the
// defaults, naming unknown keys and writing the job into plan.json all walk it, so they cannot disagree.
#pragma once

#include <iterator>
#include <utility>

#include "engine/job.h"
#include "io/text/job_words.h"

namespace slabwright {

// Those of a form of cutter stand with its keys.
inline constexpr Word<ToolKind> kToolWords[] = {
    {"flat", ToolKind::flat},   {"ball", ToolKind::ball},           {"face", ToolKind::face},
    {"drill", ToolKind::drill}, {"bull-nose", ToolKind::bull_nose}, {"tapered-ball", ToolKind::tapered_ball},
    {"cone", ToolKind::cone}};
inline constexpr Word<CuttingScope> kCuttingScopeWords[] = {{"any", CuttingScope::any},
                                                            {"end-mill", CuttingScope::end_mill},
                                                            {"flat", CuttingScope::flat},
                                                            {"ball", CuttingScope::ball},
                                                            {"face", CuttingScope::face},
                                                            {"drill", CuttingScope::drill},
                                                            {"bull-nose", CuttingScope::bull_nose},
                                                            {"tapered-ball", CuttingScope::tapered_ball},
                                                            {"cone", CuttingScope::cone}};

template <class Enum, std::size_t N>
[[nodiscard]] const char* word_of(const Word<Enum> (&words)[N], Enum value) {
    for (const Word<Enum>& word : words)
        if (word.value == value) return word.text;
    return "";
}

/// Walks the keys of one tool. `visit.required(…)` announces that the next key has no default.
template <class ToolLike, class Visit>
void visit_tool_keys(ToolLike& tool, Visit& visit) {
    visit.required();
    visit.key("number", tool.number, "T number in the machine's magazine");
    visit.required();
    visit.word("kind", tool.kind, kToolWords, "flat, bull-nose, ball, tapered-ball, cone, face or drill");
    visit.key("name", tool.name, "for the operator");
    visit.required();
    visit.key("diameter", tool.diameter, "mm");
    visit.required();
    visit.key("flute_length", tool.flute_length, "mm");
    visit.required();
    visit.key("stickout", tool.stickout, "mm, from the holder's nose to the tip");
    visit.required();
    visit.key("shank_diameter", tool.shank_diameter, "mm");
    visit.required();
    visit.key("holder_diameter", tool.holder_diameter, "mm, of the holder's nose");
    if (shows(visit, !tool.holder_profile.empty()))
        visit.key("holder_profile", tool.holder_profile,
                  "mm, of each piece from the nose up: height, lower and upper diameter");
    visit.key("flutes", tool.flutes, "cutting edges");
    visit.degrees("helix_deg", tool.helix_rad, "degrees");
    visit.key("max_rpm", tool.max_rpm, "turns a minute");
    visit.key("max_feed", tool.max_feed, "mm/min along the path");
    visit.key("plunge_feed", tool.plunge_feed, "mm/min straight down");
    visit.key("stepdown_min", tool.stepdown_min, "mm");
    visit.required();
    visit.key("stepdown_max", tool.stepdown_max, "mm, the deepest that it cuts at once");
    visit.key("stepover", tool.stepover, "share of the diameter, for clearing");
    visit.key("strength_mpa", tool.strength_mpa,
              "MPa, the cutter's own in bending, as its maker states it; 0: not checked");
    visit.key("modulus_gpa", tool.modulus_gpa,
              "GPa, by which it bends: 200 of steel, as LUO reckons with; 550 or more of cemented carbide");
    visit.key("plunges", tool.plunges,
              "cuts straight down into stock; when left out: false for flat, bull-nose and face");
    visit.key(
        "core_diameter", tool.core_diameter,
        "mm within which a flat, bull-nose or face mill has no edge; negative: 0 where it plunges, else "
        "0.3 of a flat's or bull-nose's diameter and 0.8 of a face mill's");
    visit.key("ramp_deg", tool.ramp_deg,
              "degrees, steepest ramp into stock; negative: 2 of a face mill, any of what plunges, else 10");
    if (shows(visit, has_corner(tool.kind)))
        visit.key("corner_radius", tool.corner_radius, "mm, of a bull-nose's edge, of a tapered ball's tip");
    if (shows(visit, has_taper(tool.kind)))
        visit.key("taper_deg", tool.taper_deg, "degrees, of a tapered ball, between axis and flank");
    if (shows(visit, has_point(tool.kind) && tool.point_deg != Tool{}.point_deg))
        visit.key("point_deg", tool.point_deg, "degrees, of a drill or a cone, across its point");
}

/// Walks the keys of one keep-out.
template <class KeepOutLike, class Visit>
void visit_keep_out_keys(KeepOutLike& keep_out, Visit& visit) {
    visit.required();
    visit.key("name", keep_out.name, "its own, by which messages name it");
    visit.key("rectangle", keep_out.rectangle, "mm, [x0, y0, x1, y1]; or polygon or circle");
    visit.key("polygon", keep_out.polygon, "mm, [[x, y], ...], its corners in turn");
    visit.key("circle", keep_out.circle, "mm, [x, y, radius]");
    visit.required();
    visit.key("height", keep_out.height, "mm that it stands up from its base");
    visit.word("from", keep_out.from, kKeepOutWords,
               "its base: board (the base board's top) or slab (the top of the layer's slab before facing)");
    visit.key("clearance", keep_out.clearance, "mm that tools keep away from it");
}

/// Walks the keys of one line of cutting data.
template <class DataLike, class Visit>
void visit_cutting_data_keys(DataLike& data, Visit& visit) {
    visit.word("kind", data.kind, kCuttingScopeWords,
               "of tools: any, end-mill, flat, ball, face, drill, bull-nose, tapered-ball or cone");
    visit.key("diameter_min", data.diameter_min, "mm");
    visit.key("diameter_max", data.diameter_max, "mm; 0: any");
    visit.key("flutes", data.flutes, "cutting edges; 0: any number");
    visit.required();
    visit.key("chip_load", data.chip_load, "mm a tooth");
    visit.key("surface_speed", data.surface_speed, "m/min at the rim; 0: not stated");
    visit.key("spindle_rpm", data.spindle_rpm, "turns a minute, at which it is stated; 0: not stated");
    visit.required();
    visit.key("source", data.source, "whose figures these are");
}

/// Walks the keys of what is done to the model before it is planned.
template <class PrepareLike, class Visit>
void visit_prepare_keys(PrepareLike& prepare, Visit& visit) {
    visit.table("prepare", "what is done to the model before it is planned, in this order");
    visit.key("turn", prepare.turn, "degrees about x, then y, then z");
    visit.key("scale", prepare.scale, "along x, y and z");
    visit.key("shrink", prepare.shrink,
              "contraction of the metal that is cast: a percentage, or grey_iron, malleable_iron, steel, "
              "aluminium, magnesium, copper, brass, bronze");
    visit.word("mirror", prepare.mirror, kMirrorWords,
               "none, x, y or z: the coordinate that changes its sign");
    visit.key("skin", prepare.skin, "mm of machining stock on the model, along the normal");
    visit.key("skin_normal", prepare.skin_normal, "only on facets whose normal lies this way; []: on all");
    visit.key("skin_angle_deg", prepare.skin_angle_deg, "degrees that it may be off");
    visit.key("skin_box", prepare.skin_box,
              "mm, least and greatest x y z: only on facets in it, before shift; []: anywhere");
    visit.key("shift", prepare.shift, "mm; the pattern is set on z = 0 all the same");
}

/// Walks the keys of speeds and accelerations, axis by axis.
template <class MachineLike, class Visit>
void visit_motion_keys(MachineLike& machine, Visit& visit) {
    visit.key("max_feed", machine.max_feed, "mm/min");
    visit.key("rapid_feed", machine.rapid_feed, "mm/min along the path, and of the x axis");
    visit.key("rapid_y", machine.rapid_y, "mm/min that this axis can do, feeding as well; 0: as x");
    visit.key("rapid_z", machine.rapid_z, "mm/min that this axis can do, feeding as well; 0: as x");
    visit.key("acceleration", machine.acceleration, "mm/s^2 of the x axis");
    visit.key("acceleration_y", machine.acceleration_y, "mm/s^2; 0: as x");
    visit.key("acceleration_z", machine.acceleration_z, "mm/s^2; 0: as x");
}

/// Walks the keys of what carries slabs and glues them.
template <class MachineLike, class Visit>
void visit_handler_keys(MachineLike& machine, Visit& visit) {
    visit.key("handler_speed", machine.handler_speed,
              "mm/min, of what carries slabs from the feed to the build chamber; 0: done by hand");
    visit.key("handler_travel", machine.handler_travel,
              "mm between the chambers' middles, the glue head half-way; 0: 1.4 times travel_x");
    visit.key("grip_s", machine.grip_s, "s, to close or to open its clamps");
    visit.key("press_lift", machine.press_lift,
              "mm that the table rises to press a slab against it, and sinks again");
    visit.word("glue_head", machine.glue_head, kGlueHeadWords,
               "slab (on the underside of the slab that the handler carries over it), stack (beside the "
               "spindle, on the stack's top), none (by hand), or auto: slab where there is a handler");
    visit.key("glue_pitch", machine.glue_pitch, "mm between its beads");
    visit.key("glue_speed", machine.glue_speed, "mm/min along its beads, at most");
    visit.key("pump_g_min", machine.pump_g_min, "g/min that its pump gives at most; 0: no limit");
}

/// Walks the keys of the router.
template <class MachineLike, class Visit>
void visit_machine_keys(MachineLike& machine, Visit& visit) {
    visit.table("machine", "the router");
    visit.key("name", machine.name, "");
    visit.key("travel_x", machine.travel_x, "mm");
    visit.key("travel_y", machine.travel_y, "mm");
    visit.key("travel_z", machine.travel_z, "mm, of the spindle");
    visit.word("table", machine.table, kTableWords,
               "moving: the build table sinks by every layer; fixed: a router whose table stays");
    visit.key("table_speed", machine.table_speed, "mm/min, of a table that moves");
    visit.key("build_height", machine.build_height,
              "mm, of the build chamber: how far a table that moves goes down");
    visit.key("build_mass_kg", machine.build_mass_kg, "kg that the build table carries");
    visit.key("feed_height", machine.feed_height,
              "mm, of the feed chamber, which slabs are taken from; 0: they are laid by hand");
    visit.key("feed_mass_kg", machine.feed_mass_kg, "kg that the feed table carries");
    visit_handler_keys(machine, visit);
    visit_motion_keys(machine, visit);
    visit.key("max_rpm", machine.max_rpm, "turns a minute");
    if (shows(visit, machine.min_rpm > 0))
        visit.key("min_rpm", machine.min_rpm, "turns a minute, the spindle's slowest; 0: not stated");
    visit.key("spindle_power_w", machine.spindle_power_w,
              "W that the spindle has for cutting, kept by feed and stepdown; 0: no limit");
    visit.key("spindle_torque_nm", machine.spindle_torque_nm, "Nm, likewise");
    visit.key("spindle_dwell_s", machine.spindle_dwell_s, "s, from spindle start to the first motion");
    visit.key("tool_change_s", machine.tool_change_s, "s");
    visit.key("magazine", machine.magazine,
              "places for tools in its magazine; 0: tools are changed by hand, no limit");
    visit.key("magazine_swap_s", machine.magazine_swap_s,
              "s, by hand: one tool out of a place of the magazine, another in");
    visit.key("clearance", machine.clearance, "mm of air between a rapid and the highest stock");
    visit.word(
        "frame", machine.frame, kFrameWords,
        "z 0 of the programs: pattern-base (the pattern's bottom, the base board's top), layer-top (each "
        "layer's top as faced), table-top (the machine table's top), or auto: layer-top where the table "
        "moves, else pattern-base");
    visit.word("post", machine.post, kPostWords,
               "the control that the programs are for: linuxcnc, fanuc, haas, grbl, mach, iso, siemens or "
               "heidenhain; or a file, a post of your own");
    visit.word("units", machine.units, kUnitWords,
               "of the programs: mm or in; this file and plan.json stay in mm");
    visit.word("programs", machine.programs, kProgramWords,
               "what one program holds: an operation, a tool (all that it does in a layer between two "
               "changes), or a layer, which changes tools by itself");
    visit.word("zero", machine.zero, kZeroWords,
               "x 0, y 0 of the programs: model (as the model has it), corner (left front corner of the base "
               "board), centre (its middle) or pin (machine.pin)");
    if (shows(visit, !machine.pin.empty()))
        visit.key("pin", machine.pin,
                  "mm, [x, y] of a pin or bored hole from the base board's left front corner; []: none");
    if (shows(visit, machine.probe != ProbeMode::none))
        visit.word("probe", machine.probe, kProbeWords,
                   "who finds z 0: none (the operator, touch_off) or cycle (a probing program in nc/, see "
                   "[probing])");
    visit.key("base_board_thickness", machine.base_board_thickness,
              "mm, the sacrificial board under the first layer");
    visit.key("base_board_cut", machine.base_board_cut,
              "mm that may be cut into it; negative: as deep as the finish tool overruns, but for 2 mm of "
              "the board");
}

/// Walks the keys of the probing programs.
template <class ProbingLike, class Visit>
void visit_probing_keys(ProbingLike& probing, Visit& visit) {
    visit.table("probing", "how machine.probe = \"cycle\" finds z 0");
    visit.key("tool", probing.tool, "T number of the probe, or of a tool of the library with a touch plate");
    visit.key("tip_diameter", probing.tip_diameter, "mm, of the probe");
    visit.key("fast_feed", probing.fast_feed, "mm/min, until it touches for the first time");
    visit.key("slow_feed", probing.slow_feed, "mm/min, the second time, which counts");
    visit.key("plate", probing.plate,
              "mm, thickness of the touch plate that lies on what is touched; 0: none");
    visit.key("search", probing.search,
              "mm that it goes down at most; it begins half of that over what it touches");
    visit.key("retract", probing.retract, "mm that it goes up when it is done");
    visit.key("reference", probing.reference,
              "mm, [x, y, z] of what is touched: x and y from the base board's left front corner, z from the "
              "table's top, which stays");
}

/// Walks the keys of what lies in stock.
template <class SlabsLike, class Visit>
void visit_slab_keys(SlabsLike& slabs, Visit& visit) {
    visit.table("slabs", "what lies in stock");
    visit.key("thicknesses", slabs.thicknesses, "mm, ascending");
    visit.key("length", slabs.length, "mm in x, the largest slab");
    visit.key("width", slabs.width, "mm in y");
    visit.key("margin", slabs.margin, "mm of stock past the pattern, where the slab allows");
    visit.key("facing_allowance", slabs.facing_allowance,
              "mm that the face mill takes off at least, to find the whole slab");
    visit.word("blanks", slabs.blanks, kBlankWords,
               "pattern: every slab as large as the pattern with its margin; layer: each as its own layer, "
               "with the same margin");
    visit.key("board_length", slabs.board_length, "mm, of the boards that slabs are sawn from; 0: as length");
    visit.key("board_width", slabs.board_width, "mm; 0: as width");
    visit.key("kerf", slabs.kerf, "mm, of the saw, or of the cutter that mills slabs out");
    visit.word(
        "layout", slabs.layout, kBoardLayoutWords,
        "guillotine: every cut goes from edge to edge, as a panel saw does; nested: slabs are milled out "
        "of their board one by one");
}

/// Walks the keys of glue and press.
template <class BondingLike, class Visit>
void visit_bonding_keys(BondingLike& bonding, Visit& visit) {
    visit.table("bonding", "glue and press");
    visit.key("glue", bonding.glue, "");
    visit.key("press_force", bonding.press_force, "N, at most");
    visit.key("press_time_s", bonding.press_time_s, "s");
    visit.key("open_time_s", bonding.open_time_s, "s, from the glue to the press; 0: not stated");
    visit.key("max_pressure_mpa", bonding.max_pressure_mpa, "MPa on the glue, so that no rib is crushed");
    visit.key("min_pressure_mpa", bonding.min_pressure_mpa,
              "MPa that close a joint, by the glue; cyanoacrylate on RPM's machine: 17 kN on 1.2 m2");
    visit.key("edge_setback", bonding.edge_setback, "mm that glue keeps from finished edges");
    visit.key("handling_s", bonding.handling_s, "s, to fetch, clamp and place a slab by hand");
    visit.key("glue_s_per_m2", bonding.glue_s_per_m2, "s for each square metre of glue, put on by hand");
    visit.key("glue_g_per_m2", bonding.glue_g_per_m2, "g for each square metre of glue; 0: not stated");
    visit.key("accept_weak", bonding.accept_weak, "plan although a joint may not hold");
}

/// Walks the keys of what things cost.
template <class PricesLike, class Visit>
void visit_price_keys(PricesLike& prices, Visit& visit) {
    visit.table("prices", "in your own currency; with a price of 0 nothing is reckoned");
    visit.key("currency", prices.currency, "as it is to be printed");
    visit.key("board_m2", prices.board_m2,
              "of a square metre of board: one for all slabs.thicknesses, or one for each; []: not stated");
    visit.key("base_board_m2", prices.base_board_m2,
              "of a square metre of base board; 0: as slabs of its thickness, else not stated");
    visit.key("glue_kg", prices.glue_kg, "of a kilogram of glue; needs bonding.glue_g_per_m2");
    visit.key("machine_hour", prices.machine_hour, "of an hour of the whole build");
    if (shows(visit, prices.dowel > 0)) visit.key("dowel", prices.dowel, "of one dowel (dowels.per_joint)");
}

/// Walks the keys of the machine, and of its probing programs where it has some.
template <class JobLike, class Visit>
void visit_machine_and_probing_keys(JobLike& job, Visit& visit) {
    visit_machine_keys(job.machine, visit);
    if (shows(visit, job.machine.probe != ProbeMode::none)) visit_probing_keys(job.probing, visit);
}

/// Walks the keys of the flask.
template <class FlaskLike, class Visit>
void visit_flask_keys(FlaskLike& flask, Visit& visit) {
    visit.table("flask",
                "a frame of every slab that stays around the pattern, to carry it while it is cut and as "
                "moulding box");
    visit.key("enabled", flask.enabled, "leave a flask");
    visit.key("gap", flask.gap,
              "mm from the pattern's outline to the opening, at the bottom; the widest end mill must pass");
    visit.key("wall", flask.wall, "mm, the thinnest wall around the opening");
    visit.key("draft_deg", flask.draft_deg,
              "degrees by which the opening widens upwards, in one step a layer");
}

/// Walks the keys of dowels in joints.
template <class DowelsLike, class Visit>
void visit_dowel_keys(DowelsLike& dowels, Visit& visit) {
    visit.table("dowels", "in the joints between layers, for slabs that are laid by hand");
    visit.key("per_joint", dowels.per_joint, "how many, 2 to 12; 0: none");
    visit.key("diameter", dowels.diameter, "mm");
    visit.key("depth", dowels.depth, "mm into each slab, at most");
    visit.key("clearance", dowels.clearance, "mm of wood between a hole and the pattern's surface");
    visit.key("required", dowels.required, "refuse a plan with a joint that has no place for any");
    visit.key("set_s", dowels.set_s, "s, to set one by hand");
}

template <class LayersLike, class Visit>
void visit_sides_key(LayersLike& layers, Visit& visit) {
    if (shows(visit, layers.sides != SlabSides::one))
        visit.word("sides", layers.sides, kSidesWords,
                   "one: slabs are milled from above; two: under overhangs from below too, before they are "
                   "turned and laid; auto: two where that makes more");
}

/// Walks the keys of what the slabs are made of.
template <class MaterialLike, class Visit>
void visit_material_keys(MaterialLike& material, Visit& visit) {
    visit.table("material", "what the slabs are made of");
    visit.key("name", material.name, "");
    visit.key("strength_mpa", material.strength_mpa, "MPa");
    visit.key("min_thickness", material.min_thickness,
              "mm, MTmin: thinnest material above a layer boundary; 0: what bears the cutters where the slab "
              "hangs over (Luo 6.3)");
    visit.key("shallow_limit_deg", material.shallow_limit_deg,
              "degrees from horizontal: shallower slopes are features (Type III)");
    visit.key("density_kg_m3", material.density_kg_m3, "kg/m^3");
    visit.key("ktc", material.ktc, "N/mm^2, cutting coefficient along the cut (LUO 6.5.1)");
    visit.key("kte", material.kte, "N/mm, edge coefficient along the cut");
    visit.key("kfc", material.kfc, "N/mm^2, cutting coefficient across the cut");
    visit.key("kfe", material.kfe, "N/mm, edge coefficient across the cut");
    visit.key("source", material.source, "where these four come from: orthogonal cutting of this material");
    visit.word("transform", material.transform, kTransformWords,
               "of the four to a helical edge: oblique, or printed (Luo 6.2.2, whose matrix repeats a row)");
    if (shows(visit, material.chart != CuttingChart::none))
        visit.word("chart", material.chart, kChartWords,
                   "published chip loads: mdf, pine, plywood or foam (Amana, AST); none; no chart of tooling "
                   "boards is known, state [[material.cutting]] for them");
}

/// Walks the keys of edges that are followed.
template <class CuttingLike, class Visit>
void visit_edge_keys(CuttingLike& cutting, Visit& visit) {
    if (!shows(visit, cutting.edges)) return;
    visit.key("edges", cutting.edges,
              "follow sharp edges where something stands beside them, both sides of convex ones");
    visit.key("edge_angle_deg", cutting.edge_angle_deg,
              "degrees by which faces turn at a sharp edge, at least");
}

template <class CuttingLike, class Visit>
void visit_boring_key(CuttingLike& cutting, Visit& visit) {
    if (shows(visit, cutting.bore_holes))
        visit.key("bore_holes", cutting.bore_holes,
                  "upright round holes that no drill of the library makes are bored on a helix by a flat end "
                  "mill");
}

/// Walks every key that any plan has: all of visit_job_keys but those of dowels.
template <class JobLike, class Visit>
void visit_plain_job_keys(JobLike& job, Visit& visit) {
    visit.word("units", job.units, kUnitWords, "of the STL: mm or in; every length in this file is in mm");
    visit.key("allow_undercut", job.allow_undercut, "plan although undercuts stay unmade");
    visit_prepare_keys(job.prepare, visit);
    visit.table("input", "how the STL becomes the pattern");
    visit.word(
        "repair", job.input.repair, kRepairWords,
        "of a mesh that is no solid: none (it is refused), mend, or rebuild where mending does not close it");

    visit_material_keys(job.material, visit);
    visit_slab_keys(job.slabs, visit);
    visit_machine_and_probing_keys(job, visit);

    visit_bonding_keys(job.bonding, visit);

    visit.table("tolerances", "");
    visit.key("gouge", job.tolerances.gouge, "mm along the normal: no move cuts deeper into the part");
    visit.key("cusp", job.tolerances.cusp, "mm, scallop height of the finish passes");
    visit.key("rough_cusp", job.tolerances.rough_cusp, "mm, L of the roughing stepdown (LUO 5.5.3.3)");
    visit.key("chordal_deviation", job.tolerances.chordal_deviation, "mm, of the STL");
    visit.key("undercut", job.tolerances.undercut,
              "mm: an undercut that leaves less is a remark, not a refusal");
    visit.key("gap", job.tolerances.gap, "mm: open chains this near are closed, and reported");
    visit.key("weld", job.tolerances.weld,
              "mm: vertices this near are merged, and reported; 0: only equal ones");
    visit.key("simplify", job.tolerances.simplify,
              "share of gouge for which 200 000 facets and more are made fewer, under the paths; 0: never");

    visit.table("layers", "where layers end");
    visit.word("strategy", job.layers.strategy, kStrategyWords,
               "optimal, printed (LUO 4.2.5), combined: slabs bonded to any thickness, whatever is built "
               "fastest (LUO 6.4.2), or uniform: as thick as they may be, for comparing");
    visit_sides_key(job.layers, visit);
    visit.word(
        "supports", job.layers.supports, kSupportWords,
        "auto: columns of stock stay under what nothing of the pattern carries, to be sawn off; or none");
    visit.word("finder", job.layers.finder, kFinderWords, "of features: exact, halving or both");
    visit.key("min_layer", job.layers.min_layer, "mm: thinner layers are reported");
    visit.key("alpha", job.layers.alpha, "per inch, in Q = alpha DT + beta A (LUO 4.2.4)");
    visit.key("beta", job.layers.beta, "per square inch");
    visit.key("saddles_constrain", job.layers.saddles_constrain, "saddles keep boundaries away as peaks do");
    visit.key("flat_merge", job.layers.flat_merge,
              "mm: a peak or valley this near an up-facing flat is no feature of its own");
    visit.key("halving_coarse", job.layers.halving_coarse,
              "mm between the first sections of the halving search");
    visit.key("halving_resolution", job.layers.halving_resolution, "mm at which it ends");

    visit.table("cutting", "tool paths");
    visit.key("wall_allowance", job.cutting.wall_allowance, "mm that roughing leaves on walls");
    visit.key("floor_allowance", job.cutting.floor_allowance, "mm that roughing leaves on floors");
    visit.key("rough_blend", job.cutting.rough_blend,
              "mm by which the machine may round corners of roughing (G64 P); 0.02 to a third of the smaller "
              "allowance is what it gets");
    visit.key("steep_limit_deg", job.cutting.steep_limit_deg,
              "degrees from horizontal: level contours from here up, projected raster below");
    visit.key("overlap_deg", job.cutting.overlap_deg, "degrees that both cut past the limit");
    visit.key("vertical_deg", job.cutting.vertical_deg,
              "degrees: walls from here up go to the flat end mill");
    visit.key("min_stepdown", job.cutting.min_stepdown,
              "mm, floor of the finish stepdown; reported where it bites");
    visit.key("min_stepover", job.cutting.min_stepover,
              "mm, floor of the finish stepover; reported where it bites");
    visit.key("min_flat_area", job.cutting.min_flat_area,
              "mm^2: smaller up-facing flats get no level of their own");
    visit.key("face_depth", job.cutting.face_depth, "mm, deepest step of the face mill");
    visit.key("ramp_deg", job.cutting.ramp_deg,
              "degrees, entry into stock: on a helix where there is room, else to and fro");
    visit.word("rough_pattern", job.cutting.rough_pattern, kRoughWords,
               "contour: rings around what stays; zigzag: parallel lines to and fro");
    visit.word("rest_pattern", job.cutting.rest_pattern, kRestWords,
               "what cutters leave: raster, on lines where it stands; contour, on rings, and along the feet "
               "of walls; by_library: contour where "
               "there is more than one flat or one ball");
    visit.key("open_waste", job.cutting.open_waste,
              "contour roughing leaves what lies open from beside the stock to the face mill");
    visit.key("climb", job.cutting.climb,
              "contour roughing climbs, but the face mill in open waste; false: either way");
    visit.key("max_engagement", job.cutting.max_engagement,
              "share of the diameter that roughing meets at full feed; slower in proportion where it meets "
              "more; 1: no limit");
    visit.key("holder_clearance", job.cutting.holder_clearance,
              "mm between the holder and anything that stands");
    visit.key("finish_feed", job.cutting.finish_feed,
              "mm/min; faster where the chip is thin, see adapt_feed");
    visit.word(
        "finish_strategy", job.cutting.finish_strategy, kFinishWords,
        "split at the steep limit, levels alone, projection alone, or both over everything (SHAPING 5)");
    visit.word("projection", job.cutting.projection, kProjectionWords,
               "raster: parallel lines; offset: curves offset inwards from the border");
    visit.key("uniform_steps", job.cutting.uniform_steps,
              "one stepdown and one stepover a layer, for its worst slope, and no rest machining: to compare "
              "methods");
    visit.word("engagement", job.cutting.engagement, kEngagementWords,
               "what forces are computed from: simulated, what stands when a move cuts; nominal, an "
               "operation's largest steps");
    visit.key("adapt_feed", job.cutting.adapt_feed,
              "feeds lowered where the cutter would bend too far, with simulated engagement also "
              "raised where the chip is thin");
    visit.key("adapt_stepdown", job.cutting.adapt_stepdown,
              "deep cuts in several passes where no feed keeps cutter and wood within their limits; needs "
              "simulated engagement");
    visit.key("arcs", job.cutting.arcs,
              "arcs (G2, G3) where a path turns evenly; false: straight moves only");
    visit_edge_keys(job.cutting, visit);
    visit_boring_key(job.cutting, visit);

    visit.table(
        "selection",
        "which tools of the library cut a layer (LUO 5.5); nothing to select with one flat and one ball");
    visit.word(
        "mode", job.selection.mode, kSelectionWords,
        "select: layer by layer; fixed: 1/2 in flat and 1/4 in ball, or the first of each, and smaller "
        "ones for what these leave");
    visit.word("accessibility", job.selection.accessibility, kAccessWords,
               "exact: by area in 3D, with shank and holder; sections: by the length of sections that is "
               "touched; printed: as LUO 5.5.1");
    visit.key("threshold", job.selection.threshold, "share of a layer that its finish tool must reach (AR)");
    visit.key("overlap_weight", job.selection.overlap_weight,
              "W, weight of walls too near each other, of the printed AR");
    visit.word("rough_limit", job.selection.rough_limit, kRoughLimitWords,
               "L of the roughing stepdown (LUO 5.5.3.3): finish_radius, cusp (tolerances.rough_cusp), or "
               "the smaller");
    visit.key("semi_rough", job.selection.semi_rough, "a semi-roughing tool where it saves time");
    visit.key("compare", job.selection.compare,
              "lay the paths of several sets of tools in every layer, and keep what is fastest");
    visit.key("foresee", job.selection.foresee,
              "of these only sets that are foreseen to be fast; false: all, which takes two to three times "
              "as long");
    visit.key("voxel", job.selection.voxel, "mm, on which the semi-roughing area AS is measured");

    visit_flask_keys(job.flask, visit);
    visit_price_keys(job.prices, visit);
}

/// Walks every key of the job but the tools and the keep-outs: first those of the top, then table by table.
template <class JobLike, class Visit>
void visit_job_keys(JobLike& job, Visit& visit) {
    visit_plain_job_keys(job, visit);
    visit_dowel_keys(job.dowels, visit);
}

}  // namespace slabwright
