#include "tools/sheets_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "io/read/sheet_post.h"
#include "io/text/json_text.h"
#include "io/write/plan_json.h"

namespace slabwright {

namespace {

void add_jet_options(CLI::App& command, SheetsOptions& options) {
    const CLI::Range over_0(1e-6, 1e6);
    command.add_option("--pressure", options.pressure, "MPa, jet")->check(over_0);
    command.add_option("--orifice", options.orifice, "mm, jet")->check(over_0);
    command.add_option("--insert", options.insert, "mm of the focusing tube, jet")->check(over_0);
    command.add_option("--abrasive", options.abrasive, "mass of abrasive to mass of water, jet")
        ->check(over_0);
    command.add_option("--energy", options.energy, "J/mm3 that the material takes, jet")->check(over_0);
}

AbrasiveJet jet_of(const SheetsOptions& options) {
    AbrasiveJet jet;
    jet.pressure_mpa = options.pressure;
    jet.orifice_mm = options.orifice;
    jet.insert_mm = options.insert;
    jet.abrasive_ratio = options.abrasive;
    jet.specific_energy_j_mm3 = options.energy;
    return jet;
}

void add_head_options(CLI::App& command, SheetsOptions& options) {
    command.add_option("--on", options.on, "what switches a laser or a jet on: M3, or like \"M62 P0\"");
    command.add_option("--off", options.off, "what switches it off: M5, or like \"M63 P0\"");
    command.add_option(
        "--codes", options.codes,
        "TOML: what the machine's codes are, for each head (io/FORMATS.md, A post for sheets)");
    command
        .add_option(
            "--pivot", options.pivot,
            "mm from where a jet's head turns to the sheet's top, if the control does not keep its tip "
            "in place")
        ->check(CLI::Range(0.0, 2000.0));
    command
        .add_option(
            "--taper", options.taper,
            "degrees that each side of a jet's or laser's cut leans, narrower below; --kerf is at the top")
        ->check(CLI::Range(-10.0, 10.0));
    command.add_option("--corner-feed", options.corner_feed, "percent of a jet's feed at corners; 50")
        ->check(CLI::Range(1.0, 100.0));
    command.add_option("--corner", options.corner, "mm before and after a corner at that feed; 1")
        ->check(CLI::Range(0.0, 1000.0));
}

void add_alignment_options(CLI::App& command, SheetsOptions& options) {
    const CLI::Range length(0.0, 1e5), over_0(1e-6, 1e6);
    command
        .add_option("--align", options.align,
                    "what holds sheets while they are bonded: none, holes, dowels, tabs")
        ->check(CLI::IsMember({"none", "holes", "dowels", "tabs"}));
    command.add_option("--dowel", options.dowel, "mm: diameter of dowels and rods; 8")->check(over_0);
    command.add_option("--wall", options.wall, "mm of the part around a dowel; 4")->check(over_0);
    command.add_option("--tab", options.tab, "mm: side of a tab; 24")->check(over_0);
    command.add_option("--neck", options.neck, "mm: widest neck of a tab; 6")->check(over_0);
    command.add_option("--tab-gap", options.tab_gap, "mm between tabs and part; 6")->check(length);
    command.add_flag("--nest", options.nest, "draw the full nest around the sheets too");
    command.add_flag("--crate", options.crate, "draw an egg crate under the part too");
}

void add_engraving_options(CLI::App& command, SheetsOptions& options) {
    const CLI::Range length(0.0, 1e5), over_0(1e-6, 1e6);
    command
        .add_option("--engrave", options.engrave,
                    "mm deep: numbers and match marks, where the next sheet covers them; 0: none")
        ->check(length);
    command
        .add_option("--engrave-width", options.engrave_width, "mm of a stroke; 1 of a router, else the kerf")
        ->check(over_0);
    command.add_option("--digits", options.digits, "mm: height of digits, at most; 10")->check(over_0);
    command
        .add_option("--engrave-tool", options.engrave_tool,
                    "router's tool number for it; that of --tool: strokes as wide as the kerf")
        ->check(CLI::Range(1, 9999));
    command.add_option("--engrave-feed", options.engrave_feed, "mm/min, router and laser")->check(over_0);
    command.add_option("--engrave-power", options.engrave_power, "S word of a laser that engraves")
        ->check(over_0);
    command.add_option("--power", options.power, "S word of a laser that cuts, where it engraves too")
        ->check(over_0);
}

void add_cost_options(CLI::App& command, SheetsOptions& options) {
    const CLI::Range length(0.0, 1e5), over_0(1e-6, 1e6);
    command.add_option("--material", options.material, "of the sheets: mdf, plywood, aluminium, steel")
        ->check(CLI::IsMember({"mdf", "plywood", "aluminium", "steel"}));
    command
        .add_option("--bonding", options.bonding,
                    "glue, solder or braze: sets --bond, tells what joints bear")
        ->check(CLI::IsMember({"glue", "solder", "braze"}));
    command
        .add_option("--offcut", options.offcuts, "mm: thickness, length, width of a rest; may be given again")
        ->expected(3)
        ->take_all()
        ->check(over_0);
    command
        .add_option("--count", options.counts,
                    "mm and number: how many whole sheets of a thickness there are; may be given again")
        ->expected(2)
        ->take_all()
        ->check(length);
    command.add_option("--price", options.price, "money for a cubic metre of sheets")->check(length);
    command.add_option("--rate", options.rate, "money for an hour of the machine")->check(length);
    command.add_flag("--compare", options.compare, "plan uniform, adaptive and tilted cuts side by side");
}

}  // namespace

void add_sheets_options(CLI::App& command, SheetsOptions& options) {
    const CLI::Range length(0.0, 1e5), over_0(1e-6, 1e6);
    command
        .add_option("--thickness", options.thicknesses, "mm of the sheets in stock, one or more; 6 9 12 18")
        ->check(over_0)
        ->expected(1, 64);
    command.add_option("--stock", options.stock, "mm: length and width of a stock sheet; 1220 1220")
        ->expected(2)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)
        ->check(over_0);
    command.add_option("--axis", options.axis, "along which sheets are stacked")
        ->check(CLI::IsMember({"x", "y", "z"}));
    command.add_option("--strategy", options.strategy, "optimal, printed (FDFF) or uniform")
        ->check(CLI::IsMember({"optimal", "printed", "uniform"}));
    command
        .add_option("--side", options.side, "of the stair where sheets are cut: outside, inside or middle")
        ->check(CLI::IsMember({"outside", "inside", "middle"}));
    command.add_option("--bond", options.bond, "mm between two sheets")->check(length);
    command.add_option("--triangle", options.triangle, "mm2 of a stair, printed")->check(length);
    command.add_option("--area", options.area, "percent by which areas may differ, printed")->check(length);
    command.add_option("--inset", options.most_inset, "mm: deepest stair of thicker sheets, optimal")
        ->check(length);
    command
        .add_option("--joint", options.joints,
                    "mm over the foot where two sheets must meet, optimal; may be given again")
        ->expected(1)
        ->take_all()
        ->check(over_0);
    command
        .add_option("--keep-flats", options.keep_flats,
                    "mm2: sheets meet at every height that has level faces of so much, optimal")
        ->check(over_0);
    command.add_option("--head", options.head, "what cuts: router, laser or jet (abrasive)")
        ->check(CLI::IsMember({"router", "laser", "jet"}));
    command.add_option("--kerf", options.kerf, "mm of the cut; the router's cutter")->check(length);
    command.add_option("--tilt", options.tilt, "degrees a jet's head may lean; 0: upright")
        ->check(CLI::Range(0.0, 80.0));
    command.add_option("--leave", options.leave, "mm that tilted cuts may leave on convex walls")
        ->check(over_0);
    command.add_option("--gap", options.gap, "mm between cuts of two pieces")->check(length);
    command.add_option("--margin", options.margin, "mm between pieces and the stock's edge")->check(length);
    command.add_flag("--grain", options.grain, "pieces keep the grain: they are turned by half a turn only");
    command.add_option("--lead", options.lead, "mm of waste in which a cut begins")->check(length);
    command.add_option("--feed", options.feed, "mm/min, router and laser")->check(over_0);
    command.add_option("--stepdown", options.stepdown, "mm, router")->check(over_0);
    command.add_option("--plunge", options.plunge, "mm/min, router")->check(over_0);
    command.add_option("--rpm", options.rpm, "router")->check(over_0);
    command.add_option("--tool", options.tool, "router's tool number")->check(CLI::Range(1, 9999));
    add_jet_options(command, options);
    add_head_options(command, options);
    add_alignment_options(command, options);
    add_engraving_options(command, options);
    add_cost_options(command, options);
    command
        .add_option("--tolerance", options.tolerance,
                    "mm that the proof lets the sheets stand over the part; any if not given")
        ->check(length);
}

namespace {

EngraveRules engraving_of(const SheetsOptions& options, double kerf) {
    EngraveRules rules;
    rules.depth = options.engrave;
    const bool is_cutter = options.head != "router" || options.engrave_tool == options.tool;
    rules.width = options.engrave_width > 0 ? options.engrave_width : is_cutter ? kerf : 1;
    rules.height = options.digits;
    rules.least = std::min(rules.least, rules.height);
    rules.tool = options.engrave_tool;
    rules.feed = options.engrave_feed;
    rules.power = options.engrave_power;
    return rules;
}

}  // namespace

SheetJob sheet_job(const SheetsOptions& options) {
    SheetJob job;
    job.slicing.thicknesses = options.thicknesses;
    std::sort(job.slicing.thicknesses.begin(), job.slicing.thicknesses.end());
    job.slicing.bond = options.bond;
    if (const SheetBond* bond = sheet_bond(options.bonding); bond != nullptr && options.bond < 0)
        job.slicing.bond = bond->thickness_mm;
    if (job.slicing.bond < 0) job.slicing.bond = 0;
    job.slicing.strategy = options.strategy == "optimal"   ? SheetStrategy::optimal
                           : options.strategy == "printed" ? SheetStrategy::printed
                                                           : SheetStrategy::uniform;
    job.slicing.side = options.side == "outside"  ? StairSide::outside
                       : options.side == "inside" ? StairSide::inside
                                                  : StairSide::middle;
    job.slicing.triangle_mm2 = options.triangle;
    job.slicing.area_percent = options.area;
    job.slicing.most_inset = options.most_inset;
    job.slicing.joints = options.joints;
    job.keep_flats_mm2 = options.keep_flats;
    job.head = options.head == "router"  ? SheetHead::router
               : options.head == "laser" ? SheetHead::laser
                                         : SheetHead::jet;
    const bool is_jet = job.head == SheetHead::jet;
    job.cutting.kerf = options.kerf >= 0              ? options.kerf
                       : is_jet                       ? options.insert
                       : job.head == SheetHead::laser ? 0.2
                                                      : 6;
    job.cutting.most_tilt_deg = options.tilt >= 0                                  ? options.tilt
                                : is_jet && job.slicing.side == StairSide::outside ? 55
                                                                                   : 0;
    job.engraving = engraving_of(options, job.cutting.kerf);
    job.power = options.power;
    job.cutting.taper_deg = options.taper;
    job.pivot = options.pivot;
    job.corners.share = options.corner_feed / 100;
    job.corners.reach = options.corner;
    if (!options.codes.empty()) apply(read_sheet_post(options.codes), job);
    if (!options.on.empty()) job.on = options.on;
    if (!options.off.empty()) job.off = options.off;
    job.cutting.leave = options.leave;
    job.nesting.spacing = options.gap;
    job.nesting.margin = options.margin;
    if (options.grain) job.nesting.turns = {0, 180};
    job.stock = {options.stock[0], options.stock[1]};
    job.nesting.cell = std::max(1.0, std::max(options.stock[0], options.stock[1]) / 2000);
    job.axis = options.axis[0];
    job.lead = options.lead;
    job.feed = options.feed;
    job.stepdown = options.stepdown;
    job.plunge_feed = options.plunge;
    job.rpm = options.rpm;
    job.tool = options.tool;
    job.jet = jet_of(options);
    job.alignment.way = options.align == "none"     ? SheetAlignment::none
                        : options.align == "holes"  ? SheetAlignment::holes
                        : options.align == "dowels" ? SheetAlignment::dowels
                                                    : SheetAlignment::tabs;
    job.alignment.dowel = options.dowel;
    job.alignment.wall = options.wall;
    job.alignment.tab = options.tab;
    job.alignment.neck = options.neck;
    job.alignment.gap = options.tab_gap;
    for (std::size_t i = 0; i + 2 < options.offcuts.size(); i += 3)
        job.offcuts.push_back({options.offcuts[i], {options.offcuts[i + 1], options.offcuts[i + 2]}});
    for (std::size_t i = 0; i + 1 < options.counts.size(); i += 2)
        job.counts.push_back({options.counts[i], static_cast<int>(options.counts[i + 1])});
    return job;
}

SheetExtras sheet_extras(const SheetsOptions& options) {
    SheetExtras extras;
    extras.material = sheet_material(options.material);
    extras.bond = sheet_bond(options.bonding);
    extras.prices = {options.price, options.rate};
    extras.compare = options.compare;
    extras.nest = options.nest;
    extras.crate = options.crate;
    extras.fixture.thickness = *std::min_element(options.thicknesses.begin(), options.thicknesses.end());
    return extras;
}

CLI::App* add_feed_command(CLI::App& app, FeedOptions& options) {
    CLI::App* command =
        app.add_subcommand("feed", "how fast an abrasive jet cuts, or what a test cut says of the material");
    const CLI::Range over_0(1e-6, 1e6);
    command->add_option("THICKNESS", options.depth, "mm of the sheet")->required()->check(over_0);
    command->add_option("--tilt", options.tilt, "degrees that the head leans")->check(CLI::Range(0.0, 80.0));
    command
        ->add_option("--test-cut", options.feed,
                     "mm/min at which a test cut just went through: fits the material's --energy")
        ->check(over_0);
    add_jet_options(*command, options.jet);
    command->add_flag("--json", options.json, "the result as JSON, errors as JSON on stderr");
    return command;
}

std::string run_feed(const FeedOptions& options) {
    AbrasiveJet jet = jet_of(options.jet);
    const double depth = options.depth / std::cos(options.tilt * std::numbers::pi / 180);
    if (options.feed > 0) jet.specific_energy_j_mm3 = fitted_energy(jet, depth, options.feed);
    const double feed = jet_feed(jet, depth);
    if (options.json) {
        JsonText text;
        text.begin_object().key("schema").string("slabwright.feed/1");
        text.key("depth_mm").rounded(depth, 4).key("feed_mm_min").rounded(feed, 3);
        text.key("energy_j_mm3").rounded(jet.specific_energy_j_mm3, 6).end();
        return text.take();
    }
    return options.feed > 0
               ? fmt::format("the material takes {} J/mm3: give --energy {} to slabwright sheets\n",
                             rounded_text(jet.specific_energy_j_mm3, 4),
                             rounded_text(jet.specific_energy_j_mm3, 4))
               : fmt::format("{} mm/min through {} mm along the jet at {} J/mm3\n", rounded_text(feed, 1),
                             rounded_text(depth, 3), rounded_text(jet.specific_energy_j_mm3, 3));
}

std::string sheets_verdict(const SheetProof& proof, const std::string& out) {
    std::string text = fmt::format(
        "{}: the programs {} the part: deepest cut into it {} mm, most left over {} mm, volume {}{} %\n", out,
        proof.passed ? "make" : "do NOT make", rounded_text(proof.gouge, 3), rounded_text(proof.left_over, 3),
        proof.made_mm3 >= proof.part_mm3 ? "+" : "",
        rounded_text(100 * (proof.made_mm3 / proof.part_mm3 - 1), 2));
    constexpr std::size_t shown = 20;  // verify.json holds them all
    for (std::size_t i = 0; i < std::min(shown, proof.violations.size()); ++i)
        text += fmt::format("{}: {}\n", proof.violations[i].code, proof.violations[i].message);
    if (proof.violations.size() > shown)
        text += fmt::format("{} more in verify.json\n", proof.violations.size() - shown);
    return text;
}

namespace {

/// How each way stands beside the first, as FDFF's table 4.1 has it: time and sheets.
std::string compared_text(const std::vector<SheetCost>& costs) {
    std::string text;
    if (costs.size() < 2 || !costs[0].why_not.empty()) return text;
    const auto change = [](double of, double from, const char* less) {
        const double percent = 100 * (1 - of / from);
        return fmt::format("{} % {}", rounded_text(std::abs(percent), 0), percent < 0 ? "more" : less);
    };
    for (std::size_t i = 1; i < costs.size(); ++i)
        if (costs[i].why_not.empty())
            text += fmt::format("{} beside {}: {} minutes, {} sheets\n", costs[i].way, costs[0].way,
                                change(costs[i].minutes, costs[0].minutes, "fewer"),
                                change(double(costs[i].sheets), double(costs[0].sheets), "fewer"));
    return text;
}

}  // namespace

std::string sheets_summary(const SheetsResult& result, const std::string& out, bool json) {
    const SheetsPlan& plan = result.plan;
    if (json) {
        JsonText text;
        text.begin_object().key("sheets").string(out + "/sheets.json");
        text.key("pieces").count(plan.pieces.size()).key("programs").count(plan.programs.size());
        text.key("verified").boolean(result.proof.passed);
        text.key("left_over_mm").rounded(result.proof.left_over, 4);
        text.key("gouge_mm").rounded(result.proof.gouge, 4).key("violations");
        put_diagnostics(text, result.proof.violations);
        text.key("diagnostics");
        put_diagnostics(text, plan.diagnostics);
        text.end();
        return text.take();
    }
    double minutes = 0, metres = 0;
    for (const SheetProgram& program : plan.programs)
        minutes += program.minutes, metres += program.cut_mm / 1000;
    std::string text =
        fmt::format("{}: {} sheets ({} of the thinnest alone), {} programs, {} m of cut, {} min\n", out,
                    plan.pieces.size(), plan.uniform_sheets, plan.programs.size(), rounded_text(metres, 1),
                    rounded_text(minutes, 1));
    std::map<double, std::pair<int, int>> stock;
    for (const SheetProgram& program : plan.programs) {
        ++stock[program.thickness].first;
        stock[program.thickness].second += static_cast<int>(program.pieces.size());
    }
    for (const auto& [thickness, counts] : stock)
        text += fmt::format("stock   {} of {} mm, for {} {}\n", counts.first, rounded_text(thickness, 3),
                            counts.second, counts.second == 1 ? "piece" : "pieces");
    if (result.proof.dowels > 0)
        text += fmt::format("held    {} holes for dowels and rods; {} islands are held by nothing\n",
                            result.proof.dowels, result.proof.islands);
    if (result.proof.engraved > 0)
        text += fmt::format("marked  {} numbers and match marks are engraved\n", result.proof.engraved);
    for (const SheetCost& cost : result.costs) {
        text += fmt::format("{:<9}", cost.way);
        if (!cost.why_not.empty()) {
            text += "no: " + cost.why_not + '\n';
            continue;
        }
        text += fmt::format("{} sheets from {} of stock, {} m, {} min, up to {} mm off, {} of {} kg",
                            cost.sheets, cost.stock_sheets, rounded_text(cost.cut_mm / 1000, 1),
                            rounded_text(cost.minutes, 1), rounded_text(cost.deviation, 3),
                            rounded_text(cost.part_kg, 2), rounded_text(cost.stock_kg, 2));
        text += cost.money > 0 ? fmt::format(", {} of money\n", rounded_text(cost.money, 2)) : "\n";
    }
    text += compared_text(result.costs);
    for (const Diagnostic& d : plan.diagnostics)
        if (d.severity != Severity::note) text += fmt::format("{}: {}\n", name(d.severity), d.message);
    return text + sheets_verdict(result.proof, out);
}

}  // namespace slabwright
