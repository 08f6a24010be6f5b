#include "tools/plan_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

namespace slabwright {

namespace {

std::string duration(double minutes) {
    if (minutes < 1) return fmt::format("{:.0f} s", minutes * 60);
    const long total = static_cast<long>(minutes + 0.5);
    return total < 60 ? fmt::format("{} min", total) : fmt::format("{} h {:02} min", total / 60, total % 60);
}

}  // namespace

std::string number(double value, int decimals) { return number_text(value, decimals); }

std::string told(const Diagnostic& d) {
    std::string text = fmt::format("{}: {}", name(d.severity), d.message);
    if (d.where)
        text += fmt::format(" (x {} y {} z {})", number((*d.where)[0], 1), number((*d.where)[1], 1),
                            number((*d.where)[2], 1));
    return text + '\n';
}

std::string summary(const Plan& plan, const std::string& out) {
    const Totals& t = plan.totals;
    int programs = 0;
    for (const Layer& layer : plan.layers)
        for (std::size_t o = 0; o < layer.operations.size(); o = file_end(layer, o)) ++programs;
    std::string text = fmt::format(
        "{}: {} {}, {} {}, {} in all (cutting {}, bonding {}, tool changes {}{})\n", out, t.layers,
        t.layers == 1 ? "layer" : "layers", programs, programs == 1 ? "program" : "programs",
        duration(t.build_minutes), duration(t.cutting_minutes), duration(t.bonding_minutes),
        duration(t.tool_change_minutes),
        t.underside_minutes > 0 ? ", slabs milled from below first " + duration(t.underside_minutes)
                                : std::string());
    if (t.magazine_swaps > 0)
        text += fmt::format("swaps   {} of a tool in the magazine for another, {} of the time\n",
                            t.magazine_swaps, duration(t.magazine_minutes));
    text += fmt::format("stock   {} x {} mm, {} kg with the base board\n",
                        number(plan.stock_max[0] - plan.stock_min[0], 1),
                        number(plan.stock_max[1] - plan.stock_min[1], 1), number(t.stack_mass_kg, 1));
    std::map<double, int> slabs;
    for (const Layer& layer : plan.layers) slabs[layer.slab_thickness / layer.slabs] += layer.slabs;
    for (const auto& [thickness, count] : slabs)
        text += fmt::format("slabs   {} of {} mm {}\n", count, number(thickness, 3), plan.job.material.name);
    text += wood_document(plan);
    for (const Tool& tool : plan.job.tools) {
        double minutes = 0;
        std::set<std::string_view> used;  // the programs that it is used in
        for (const Layer& layer : plan.layers)
            for (const Operation& operation : layer.operations)
                if (operation.tool == tool.number)
                    minutes += operation.minutes, used.insert(file_of(operation.file));
        if (!used.empty())
            text += fmt::format("tool    T{} {}, {} in {} {}\n", tool.number, tool.name, duration(minutes),
                                used.size(), used.size() == 1 ? "program" : "programs");
    }
    for (const Layer& layer : plan.layers)
        text += fmt::format("layer   {}: {} to {} mm, {}\n", layer.index, number(layer.z_bottom, 3),
                            number(layer.z_top, 3), layer.reason);
    for (const Severity severity : {Severity::error, Severity::warning}) {
        // The same finding can come a hundred times; the first few of each code are told, plan.json holds
        // all.
        std::map<std::string, int> seen;
        for (const Diagnostic& d : plan.diagnostics) {
            if (d.severity != severity || ++seen[d.code] > 5) continue;
            text += told(d);
        }
        for (const auto& [code, count] : seen)
            if (count > 5)
                text += fmt::format("{}: {} more of {} in plan.json\n", name(severity), count - 5, code);
    }
    return text;
}

namespace {

/// "makes the part", or what of it is not made.
std::string makes(const VerifyResult& result) {
    if (!result.passed) return "does NOT make the part";
    if (result.is_whole()) return "makes the part";
    std::string text = "makes all but";
    if (result.unmade_mm3 >= 1)
        text += fmt::format(" {} that stay filled under overhangs (up to {} mm high)",
                            result.unmade_mm3 < 1000 ? number(result.unmade_mm3, 0) + " mm³"
                                                     : number(result.unmade_mm3 / 1000, 0) + " cm³",
                            number(result.unmade_mm, 2));
    if (result.unreachable_mm2 > 0.01 * result.pattern_mm2)
        text += fmt::format(
            "{} {} mm² that no tool reaches ({} % of the pattern seen from above, up to {} mm)",
            result.unmade_mm3 >= 1 ? " and" : "", number(result.unreachable_mm2, 0),
            number(100 * result.unreachable_mm2 / result.pattern_mm2, 1), number(result.unreachable_mm, 2));
    return text;
}

}  // namespace

std::string verdict(const VerifyResult& result, const std::string& out) {
    std::string text =
        fmt::format("{}: {}, deepest gouge {:.4f} mm, simulated at {:.3f} mm, programs run {}\n", out,
                    makes(result), result.gouge_mm, result.cell_mm, duration(result.minutes));
    constexpr std::size_t shown = 20;  // verify.json holds them all
    for (std::size_t i = 0; i < std::min(shown, result.violations.size()); ++i)
        text += fmt::format("{}: {}\n", result.violations[i].code, result.violations[i].message);
    if (result.violations.size() > shown)
        text += fmt::format("{} more in verify.json\n", result.violations.size() - shown);
    constexpr std::size_t few = 3;
    for (std::size_t i = 0; i < std::min(few, result.advice.size()); ++i) text += told(result.advice[i]);
    return text;
}

std::string repair_text(const RepairResult& result, const std::string& out) {
    std::string text;
    for (const Diagnostic& d : result.diagnostics) text += told(d);
    return text + fmt::format("{}: {}, {} facets, {} cm3\n", out,
                              result.repair.how == "none"   ? "needed no repair"
                              : result.repair.how == "mend" ? "mended"
                                                            : "made anew",
                              result.repair.triangles, number(result.volume_mm3 / 1000, 2));
}

}  // namespace slabwright
