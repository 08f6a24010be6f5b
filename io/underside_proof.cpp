#include "io/underside_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <span>

#include "engine/schedule/keep_outs.h"
#include "engine/simulate/dowel_proof.h"
#include "engine/simulate/keep_out_check.h"
#include "engine/undersides/floors.h"
#include "engine/undersides/loose_pieces.h"
#include "engine/undersides/underside_target.h"
#include "io/folder_checks.h"
#include "kernels/errors.h"
#include "kernels/features/filled_columns.h"
#include "kernels/features/unmade_air.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

/// Two programs of one number, one of the plan and one of an underside, or of two of these.
void check_numbers(const std::vector<Program>& programs, const std::vector<UndersideFindings>& undersides,
                   std::vector<Violation>& violations) {
    std::map<int, std::string> numbers;
    std::set<std::string> told;
    const auto check = [&](const Program& program, const std::string& file) {
        if (program.number == 0) return;
        const auto other = numbers.emplace(program.number, file).first;
        // Those of one folder are told where it is read.
        if (fs::path(other->second).parent_path() == fs::path(file).parent_path()) return;
        if (!told.insert(file).second) return;
        violations.push_back(
            {"program.number",
             fmt::format("is O{}, as {} is: a control that holds both would keep one of them", program.number,
                         other->second),
             file,
             0,
             {},
             0});
    };
    for (const Program& program : programs) check(program, std::string(file_of(program.file)));
    for (const UndersideFindings& under : undersides)
        for (const Program& program : under.programs)
            check(program, under.folder + "/" + std::string(file_of(program.file)));
}

/// The slab that a layer of the plan is milled from below of, as the plan states it; the web and the room are
/// the underside's own to choose.
TurnedSlab slab_of(const BuildPlan& build, std::size_t layer, const TurnedSlab& stated) {
    const LayerToBuild& from = build.layers[layer];
    return {from.index,
            from.z_bottom,
            from.z_top,
            from.slab_thickness,
            from.blank.value_or(Blank{build.stock_min, build.stock_max}),
            stated.web,
            stated.room};
}

/// Whether an underside's plan is of that slab, and drills its dowels where they stand in the joint.
void check_turned(const PlannedFolder& under, const TurnedSlab& slab, std::span<const JointDowel> dowels,
                  std::vector<Violation>& found) {
    constexpr double kSame = 1e-3;  // mm
    const auto complain = [&](const char* code, const std::string& message, double size = 0) {
        found.push_back({code, message, "plan.json", 0, {}, size});
    };
    const TurnedSlab& stated = *under.turned;
    const auto differs = [](double a, double b) { return !(std::abs(a - b) <= kSame); };
    bool other = stated.layer != slab.layer || differs(stated.z_bottom, slab.z_bottom) ||
                 differs(stated.z_top, slab.z_top) || differs(stated.slab_thickness, slab.slab_thickness);
    for (std::size_t k = 0; k < 2; ++k)
        other |= differs(stated.blank.min[k], slab.blank.min[k]) ||
                 differs(stated.blank.max[k], slab.blank.max[k]) || differs(under.build.stock_min[k], 0);
    const std::vector<LayerToBuild>& layers = under.build.layers;
    other |= differs(under.build.stock_max[0], slab.blank.length()) ||
             differs(under.build.stock_max[1], slab.blank.width()) || layers.size() != 1 ||
             differs(layers.front().z_bottom, 0) || differs(layers.front().z_top, slab.slab_thickness) ||
             differs(layers.front().slab_thickness, slab.slab_thickness);
    if (other) complain("underside.slab", "is of another slab than that which the plan lays");
    if (!(slab.web >= 0) || slab.web >= slab.z_top - slab.z_bottom || !(slab.room >= 0))
        complain("underside.slab", "leaves no web that a layer can have");
    std::vector<JointDowel> due = turned_dowels(slab, dowels);
    for (const JointDowel& made : layers.front().dowels) {
        const auto at = std::find_if(due.begin(), due.end(), [&](const JointDowel& d) {
            return !differs(d.x, made.x) && !differs(d.y, made.y) && !differs(d.diameter, made.diameter) &&
                   !differs(d.below, made.below);
        });
        if (at != due.end()) due.erase(at);
        else
            complain("dowel.underside",
                     fmt::format("drills a hole at x {:.3f} y {:.3f} mm, where no dowel of the joint stands",
                                 made.x, made.y));
    }
    for (const JointDowel& missing : due)
        complain("dowel.underside",
                 fmt::format("drills no hole at x {:.3f} y {:.3f} mm for a dowel of the joint", missing.x,
                             missing.y),
                 missing.below);
}

/// Proves the programs that mill one slab from below, as those of any plan, on the target that follows from
/// the pattern.
UndersideFindings prove_underside(Context& context, const PlannedFolder& folder, std::size_t layer,
                                  const UndersideToMill& planned, MeshView pattern,
                                  const VerifyOptions& options, const std::vector<KeepOut>& keep_outs,
                                  std::vector<Violation>& violations) {
    const FolderRefusal refusal;
    const fs::path path = folder.path / planned.folder;
    const PlannedFolder under = read_planned_folder(path, refusal);
    if (!under.turned)
        throw Error(ErrorKind::verification, refusal.plan, "is no plan of a slab's underside",
                    (path / "plan.json").string(), "plan again");
    std::vector<Violation> found;
    const TurnedSlab slab = slab_of(folder.build, layer, *under.turned);
    UndersideFindings result{planned.layer, planned.folder, slab, {}, {}};
    check_turned(under, slab,
                 layer > 0 ? std::span<const JointDowel>(folder.build.layers[layer - 1].dowels)
                           : std::span<const JointDowel>(),
                 found);
    SimulationInput input = under.simulation;
    read_programs(context, under, refusal, input.programs, found);
    input.machine.keep_outs = moved(keep_outs, {folder.build.zero[0] - folder.build.stock_min[0],
                                                folder.build.zero[1] - folder.build.stock_min[1]});
    check_probes(context, under, input.machine.keep_outs, found);
    find_strangers(under, found);
    const std::vector<Violation> entered = check_keep_outs(context, input, under.build.zero);
    found.insert(found.end(), entered.begin(), entered.end());
    BuildPlan build = under.build;
    set_heights(build, input.programs);
    check_sequence(path / "sequence.json", build, found);
    const Mesh target = underside_target(context, pattern, slab);
    if (slab.web < kWholeWeb && !hangs_together(context, target, slab))
        found.push_back({"underside.loose", "pieces of the slab come loose before it is laid", "", 0, {}, 0});
    const StandingPart part(context, target.view());
    input.mesh = target.view();
    SimulationOptions simulation = simulation_options(folder.build.job, options, input.tools);
    simulation.whole = false;
    simulation.maps = false;
    result.report = simulate(context, input, part, simulation);
    const std::vector<Violation> dowels = check_dowels(context, input, part, -1);
    found.insert(found.end(), dowels.begin(), dowels.end());
    found.insert(found.end(), result.report.violations.begin(), result.report.violations.end());
    result.report.violations = found;
    result.programs = std::move(input.programs);
    for (Violation& v : found) {
        v.file = v.file.empty() ? planned.folder : planned.folder + "/" + v.file;
        if (v.where)
            v.message += fmt::format(" (on the turned slab at x {:.2f} y {:.2f} z {:.2f} mm)", (*v.where)[0],
                                     (*v.where)[1], (*v.where)[2]);
        v.where.reset();
        v.layer.reset();
    }
    violations.insert(violations.end(), found.begin(), found.end());
    return result;
}

/// What stays filled in the layers, some of which are milled from both sides.
void measure_unmade(Context& context, const AirGaps& gaps, const std::vector<MilledLayer>& layers,
                    SimulationReport& report) {
    const UnmadeAir left = unmade_air(context, gaps, layers);
    for (std::size_t l = 0; l < layers.size() && l < report.layers.size(); ++l) {
        if (layers[l].milled == MilledFrom::above) continue;
        LayerFindings& f = report.layers[l];
        f.unmade_mm3 = left.of_layers[l];
        f.unmade = {};
        for (const UnmadePocket& p : left.pockets)
            if (p.layer == l && p.height_mm > f.unmade.size) f.unmade = {p.height_mm, p.at};
    }
}

/// The floors over what was milled from below, under the press that the plan states.
void measure_floors(Context& context, MeshView pattern, const AirGaps& gaps, const BuildPlan& build,
                    const std::vector<MilledLayer>& layers, std::vector<UndersideFindings>& undersides) {
    const FloorMap floors(context, pattern, gaps);
    for (UndersideFindings& under : undersides) {
        const auto at = std::find_if(build.layers.begin(), build.layers.end(),
                                     [&](const LayerToBuild& l) { return l.index == under.layer; });
        const auto l = static_cast<std::size_t>(at - build.layers.begin());
        if (at + 1 != build.layers.end() && !(at + 1)->joints.empty()) {
            const PlannedJoint& joint = (at + 1)->joints.front();
            if (joint.press_force_n && joint.glue_area_mm2.value_or(0) > 0)
                under.floor_pressure_mpa = *joint.press_force_n / *joint.glue_area_mm2;
        }
        under.floor = floors.weakest(context, layers[l], at->z_bottom, {0, under.floor_pressure_mpa});
    }
}

}  // namespace

std::vector<UndersideFindings> prove_undersides(Context& context, const PlannedFolder& folder,
                                                MeshView pattern, const VerifyOptions& options,
                                                const std::vector<KeepOut>& keep_outs,
                                                const std::vector<Program>& programs,
                                                SimulationReport& report,
                                                std::vector<Violation>& violations) {
    std::vector<UndersideFindings> undersides;
    std::vector<MilledLayer> milled;
    const std::vector<LayerToBuild>& layers = folder.build.layers;
    for (const LayerToBuild& layer : layers) milled.push_back({layer.z_top, MilledFrom::above, 0});
    for (const UndersideToMill& planned : folder.build.undersides)
        for (std::size_t l = 0; l < layers.size(); ++l) {
            if (layers[l].index != planned.layer) continue;
            undersides.push_back(
                prove_underside(context, folder, l, planned, pattern, options, keep_outs, violations));
            milled[l] = milled_layer(undersides.back().slab);
        }
    if (undersides.empty()) return undersides;
    const AirGaps gaps = air_gaps(context, pattern, filled_cell(pattern));
    measure_unmade(context, gaps, milled, report);
    measure_floors(context, pattern, gaps, folder.build, milled, undersides);
    check_numbers(programs, undersides, violations);
    return undersides;
}

}  // namespace slabwright
