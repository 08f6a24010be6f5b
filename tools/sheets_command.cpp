#include "tools/sheets_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "io/text/json_text.h"
#include "io/write/plan_json.h"

namespace slabwright {

namespace {

std::string number(double value, int decimals) {
    std::string text;
    append_rounded(text, value, decimals);
    return text;
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
    command.add_option("--pressure", options.pressure, "MPa, jet")->check(over_0);
    command.add_option("--orifice", options.orifice, "mm, jet")->check(over_0);
    command.add_option("--insert", options.insert, "mm of the focusing tube, jet")->check(over_0);
    command.add_option("--abrasive", options.abrasive, "mass of abrasive to mass of water, jet")
        ->check(over_0);
    command.add_option("--energy", options.energy, "J/mm3 that the material takes, jet")->check(over_0);
    command
        .add_option("--tolerance", options.tolerance,
                    "mm that the proof lets the sheets stand over the part; any if not given")
        ->check(length);
}

SheetJob sheet_job(const SheetsOptions& options) {
    SheetJob job;
    job.slicing.thicknesses = options.thicknesses;
    std::sort(job.slicing.thicknesses.begin(), job.slicing.thicknesses.end());
    job.slicing.bond = options.bond;
    job.slicing.strategy = options.strategy == "optimal"   ? SheetStrategy::optimal
                           : options.strategy == "printed" ? SheetStrategy::printed
                                                           : SheetStrategy::uniform;
    job.slicing.side = options.side == "outside"  ? StairSide::outside
                       : options.side == "inside" ? StairSide::inside
                                                  : StairSide::middle;
    job.slicing.triangle_mm2 = options.triangle;
    job.slicing.area_percent = options.area;
    job.slicing.most_inset = options.most_inset;
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
    job.cutting.leave = options.leave;
    job.nesting.spacing = options.gap;
    job.nesting.margin = options.margin;
    if (options.grain) job.nesting.turns = {0, 180};
    job.stock = {options.stock[0], options.stock[1]};
    job.nesting.cell = std::max(2.0, std::max(options.stock[0], options.stock[1]) / 2000);
    job.axis = options.axis[0];
    job.lead = options.lead;
    job.feed = options.feed;
    job.stepdown = options.stepdown;
    job.plunge_feed = options.plunge;
    job.rpm = options.rpm;
    job.tool = options.tool;
    job.jet.pressure_mpa = options.pressure;
    job.jet.orifice_mm = options.orifice;
    job.jet.insert_mm = options.insert;
    job.jet.abrasive_ratio = options.abrasive;
    job.jet.specific_energy_j_mm3 = options.energy;
    return job;
}

std::string sheets_verdict(const SheetProof& proof, const std::string& out) {
    std::string text = fmt::format(
        "{}: the programs {} the part: deepest cut into it {} mm, most left over {} mm, volume {}{} %\n", out,
        proof.passed ? "make" : "do NOT make", number(proof.gouge, 3), number(proof.left_over, 3),
        proof.made_mm3 >= proof.part_mm3 ? "+" : "", number(100 * (proof.made_mm3 / proof.part_mm3 - 1), 2));
    constexpr std::size_t shown = 20;  // verify.json holds them all
    for (std::size_t i = 0; i < std::min(shown, proof.violations.size()); ++i)
        text += fmt::format("{}: {}\n", proof.violations[i].code, proof.violations[i].message);
    if (proof.violations.size() > shown)
        text += fmt::format("{} more in verify.json\n", proof.violations.size() - shown);
    return text;
}

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
    std::string text = fmt::format(
        "{}: {} sheets ({} of the thinnest alone), {} programs, {} m of cut, {} min\n", out,
        plan.pieces.size(), plan.uniform_sheets, plan.programs.size(), number(metres, 1), number(minutes, 1));
    std::map<double, std::pair<int, int>> stock;
    for (const SheetProgram& program : plan.programs) {
        ++stock[program.thickness].first;
        stock[program.thickness].second += static_cast<int>(program.pieces.size());
    }
    for (const auto& [thickness, counts] : stock)
        text += fmt::format("stock   {} of {} mm, for {} {}\n", counts.first, number(thickness, 3),
                            counts.second, counts.second == 1 ? "piece" : "pieces");
    for (const Diagnostic& d : plan.diagnostics)
        if (d.severity != Severity::note) text += fmt::format("{}: {}\n", name(d.severity), d.message);
    return text + sheets_verdict(result.proof, out);
}

}  // namespace slabwright
