#include "io/proof.h"

#include <algorithm>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "engine/planner/replan.h"
#include "engine/schedule/schedule.h"
#include "engine/undersides/underside_target.h"
#include "io/posts/gcode_writer.h"

namespace slabwright {

namespace {

constexpr double kWorthTouching = 0.5;  // of SimulationOptions::leftover_limit, mm

/// Where an operation stands in its plan.
struct InPlan {
    std::size_t layer = 0, operation = 0;
};

std::map<std::string, InPlan> by_file(const Plan& plan) {
    std::map<std::string, InPlan> places;
    for (std::size_t l = 0; l < plan.layers.size(); ++l)
        for (std::size_t o = 0; o < plan.layers[l].operations.size(); ++o)
            places[plan.layers[l].operations[o].file] = {l, o};
    return places;
}

/// The move that a line of a program makes.
class LineMoves {
public:
    explicit LineMoves(const std::vector<std::uint32_t>& lines) {
        for (std::size_t m = 0; m < lines.size(); ++m)
            if (lines[m] != 0) written_.emplace_back(lines[m], m);
    }
    /// Adds the fault to the move of a line, where that has one.
    void add(std::vector<FaultyMove>& faults, FaultyMove::Fault fault, std::uint32_t line,
             double size) const {
        const auto found =
            std::lower_bound(written_.begin(), written_.end(), std::pair{line, std::size_t{0}});
        if (found != written_.end() && found->first == line) faults.push_back({fault, found->second, size});
    }

private:
    std::vector<std::pair<std::uint32_t, std::size_t>> written_;
};

/// Violations of one program.
struct OfProgram {
    bool gouge = false, crush = false, rapid = false, too_deep = false, contact = false, empty = false;
    void note(std::string_view code) {
        gouge = gouge || code == "gouge.cutter";
        crush = crush || code == "plunge.not_center_cutting";
        rapid = rapid || code == "rapid.through_stock";
        too_deep = too_deep || code == "cut.too_deep" || code == "flute.too_deep";
        contact = contact || code.starts_with("contact.");
        empty = empty || code == "operation.empty";
    }
};

std::vector<FaultyMove> faulty_moves(const OfProgram& what, const ProgramFindings& found,
                                     const LineMoves& moves) {
    std::vector<FaultyMove> faults;
    const auto gouges = [&](const std::vector<std::uint32_t>& lines) {
        for (const std::uint32_t line : lines) moves.add(faults, FaultyMove::Fault::gouge, line, 0);
    };
    if (what.gouge) gouges(found.gouge.gouge_lines);
    if (what.contact) gouges(found.gouge.contact_lines);
    for (const FaultyMotion& f : found.faults) {
        using From = FaultyMotion::Fault;
        using To = FaultyMove::Fault;
        if (f.fault == From::crush && what.crush) moves.add(faults, To::crush, f.line, f.size);
        if (f.fault == From::rapid && what.rapid) moves.add(faults, To::rapid, f.line, f.size);
        if (f.fault == From::too_deep && what.too_deep) moves.add(faults, To::too_deep, f.line, f.size);
        if (f.fault == From::in_standing && what.contact) moves.add(faults, To::in_standing, f.line, f.size);
    }
    std::stable_sort(faults.begin(), faults.end(), [](const FaultyMove& a, const FaultyMove& b) {
        return std::pair{a.fault, a.move} < std::pair{b.fault, b.move};
    });
    return faults;
}

/// What of a kind was found in a layer.
struct Found {
    std::size_t count = 0;
    double most = 0;
};

std::string in_words(const std::map<std::string, Found>& found) {
    std::string words;
    for (const auto& [code, f] : found) {
        words += fmt::format("{}{}", words.empty() ? "" : ", ", code);
        if (f.count > 1) words += fmt::format(" ({})", f.count);
        if (f.most > 0) words += fmt::format(" {:.3f} mm", f.most);
    }
    return words;
}

std::string_view remedy(std::string_view code) {
    if (code.starts_with("left."))
        return "give a tool that gets there, smaller, longer or one that plunges, or another strategy of "
               "layers";
    if (code.starts_with("gouge.")) return "mend the mesh there, or give other tools";
    if (code.starts_with("contact.")) return "give a tool with a longer stick-out or longer flutes";
    if (code.starts_with("plunge.")) return "give a tool that plunges, or one with a smaller core_diameter";
    if (code == "cut.too_deep" || code == "flute.too_deep")
        return "give a tool with longer flutes, or a smaller stepdown";
    if (code.starts_with("travel.") || code.starts_with("stack."))
        return "turn or split the pattern, or choose other slabs";
    if (code.starts_with("keep_out."))
        return "move the keep-out farther from the stock, make it lower, or hold the slab in another way";
    if (code.starts_with("dowel."))
        return "give a drill of the dowels' diameter, or plan without dowels (dowels.per_joint = 0)";
    if (code == "board.too_deep") return "allow a deeper machine.base_board_cut";
    return "give other tools";
}

}  // namespace

bool is_of_the_part(const SimulationReport& report) {
    return std::all_of(report.violations.begin(), report.violations.end(), [](const Violation& v) {
        for (const char* family :
             {"gouge.", "contact.", "plunge.", "rapid.through", "flute.", "cut.", "board.", "operation.",
              "left.", "travel.", "stack.", "keep_out.", "dowel."})
            if (v.code.starts_with(family)) return true;
        return false;
    });
}

std::vector<LayerFaults> faults_of(const Plan& plan, const Verification& found) {
    const std::map<std::string, InPlan> places = by_file(plan);
    const SimulationReport& report = found.report;
    std::vector<std::map<std::string, Found>> told(plan.layers.size());
    std::map<std::string, OfProgram> programs;
    std::vector<char> too_much(plan.layers.size()), too_often(plan.layers.size());
    for (const Violation& v : report.violations) {
        std::optional<std::size_t> layer = v.layer;
        if (const auto at = places.find(v.file); at != places.end()) {
            layer = at->second.layer;
            programs[v.file].note(v.code);
        }
        if (!layer || *layer >= plan.layers.size()) continue;
        Found& f = told[*layer][v.code];
        ++f.count;
        f.most = std::max(f.most, v.size);
        if (v.code == "left.too_much") too_much[*layer] = 1;
        if (v.code == "left.missed") too_often[*layer] = 1;
    }
    std::vector<LayerFaults> faults(plan.layers.size());
    for (std::size_t i = 0; i < found.input.programs.size(); ++i) {
        const std::string& file = found.input.programs[i].file;
        const auto what = programs.find(file);
        if (what == programs.end()) continue;
        const InPlan at = places.at(file);
        const Layer& layer = plan.layers[at.layer];
        const Operation& op = layer.operations[at.operation];
        faults[at.layer].operations.push_back(
            {at.operation, what->second.empty,
             faulty_moves(what->second, report.programs[i], LineMoves(move_lines(plan, layer, op)))});
    }
    std::vector<LayerFaults> with_faults;
    for (std::size_t l = 0; l < faults.size(); ++l) {
        if (told[l].empty()) continue;
        LayerFaults& of = faults[l];
        of.layer = l;
        of.lowest_tip = report.layers[l].lowest_tip;
        of.found = in_words(told[l]);
        if (too_much[l] || too_often[l])
            for (const MissedPlace& m : report.layers[l].missed_places)
                if (too_often[l] || m.left > kWorthTouching * SimulationOptions{}.leftover_limit)
                    of.missed.push_back(m);
        with_faults.push_back(std::move(of));
    }
    return with_faults;
}

bool mend_undersides(Context& context, Plan& plan, const Verification& found, int round) {
    bool other = false;
    for (const UndersideFindings& under : found.undersides) {
        const auto at = std::find_if(plan.undersides.begin(), plan.undersides.end(),
                                     [&](const Plan& p) { return p.turned->layer == under.layer; });
        if (at == plan.undersides.end() || under.report.violations.empty()) continue;
        Verification own;
        own.report = under.report;
        own.input.programs = under.programs;
        const std::vector<LayerFaults> faults = faults_of(*at, own);
        if (faults.empty()) continue;
        const Mesh target = underside_target(context, found.pattern->read.mesh.view(), *at->turned);
        const StandingPart part(context, target.view());
        if (!Replanner(context, target.view(), part).mend(*at, faults, round).empty()) other = true;
    }
    if (other) schedule(plan);
    return other;
}

std::vector<Error> refusals_of(const SimulationReport& report, const std::string& stl) {
    std::vector<Error> errors;
    for (const Violation& v : report.violations) {
        std::string place = stl;
        if (!v.file.empty()) place += fmt::format(", {}", v.file);
        if (!v.file.empty() && v.line > 0) place += fmt::format(":{}", v.line);
        if (v.where)
            place +=
                fmt::format(", x {:.2f} y {:.2f} z {:.2f} mm", (*v.where)[0], (*v.where)[1], (*v.where)[2]);
        errors.emplace_back(
            ErrorKind::no_plan, v.code, v.message, place,
            fmt::format("{}; --keep-failed writes the programs all the same", remedy(v.code)));
    }
    return errors;
}

}  // namespace slabwright
