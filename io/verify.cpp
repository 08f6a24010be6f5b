#include "io/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>

#include "engine/base_board.h"
#include "engine/schedule/magazine.h"
#include "engine/schedule/probes.h"
#include "engine/simulate/dowel_proof.h"
#include "engine/simulate/keep_out_check.h"
#include "engine/simulate/planned_build.h"
#include "engine/undersides/loose_pieces.h"
#include "engine/undersides/underside_target.h"
#include "io/posts/probe_check.h"
#include "io/posts/program_check.h"
#include "io/posts/tool_table_check.h"
#include "io/read/cut_list_check.h"
#include "io/read/dowel_list_check.h"
#include "io/read/input_file.h"
#include "io/read/planned_folder.h"
#include "io/read/sequence_reader.h"
#include "io/write/output_file.h"
#include "io/write/verify_json.h"
#include "kernels/errors.h"
#include "kernels/features/filled_columns.h"
#include "kernels/features/unmade_air.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kMostCutListBytes = 16 * kMebibyte;
constexpr std::uint64_t kMostProbeBytes = kMebibyte;

std::string read_file(const fs::path& path, const char* code, std::uint64_t most_bytes) {
    return read_whole(path, {ErrorKind::verification, code, most_bytes, "plan again"});
}

/// Of each program of the build that was read, how far it goes down and up.
void set_heights(BuildPlan& build, const std::vector<Program>& programs) {
    for (PlannedProgram& planned : build.programs)
        for (const Program& program : programs) {
            if (planned.file.compare(3, std::string::npos, program.file) != 0) continue;
            double low = INFINITY, high = -INFINITY;
            for (const ProgramStep& step : program.steps)
                if (std::isfinite(step.z)) {
                    low = std::min(low, step.z);
                    high = std::max(high, step.z);
                }
            if (low <= high) {
                planned.low = low;
                planned.high = high;
            }
            break;
        }
}

/// sequence.json, replayed. That there is none, or none that can be read, is a violation too.
void check_sequence(const fs::path& path, const BuildPlan& build, std::vector<Violation>& violations) {
    const std::string file = path.filename().string();
    if (std::error_code failed; !fs::exists(path, failed)) {
        violations.push_back({"sequence.no_file", "there is none, or none that can be read", file, 0, {}, 0});
        return;
    }
    const std::string text = read_file(path, "verify.sequence_file", kLargestSequence);
    try {
        const std::vector<Violation> found = replay_build(build, read_sequence(text));
        violations.insert(violations.end(), found.begin(), found.end());
    } catch (const Error& e) {
        if (e.code() != "verify.sequence") throw;
        violations.push_back({"sequence.unreadable", e.message(), file, 0, {}, 0});
    }
}

/// The tools in the magazine when the sequence begins; none where the sequence cannot be read.
std::optional<std::vector<int>> stated_magazine(const fs::path& sequence, int places) {
    if (std::error_code failed; places == 0 || !fs::exists(sequence, failed)) return std::vector<int>();
    try {
        const std::string text = read_file(sequence, "verify.sequence_file", kLargestSequence);
        return magazine_at_start(read_sequence(text).steps, places);
    } catch (const Error& e) {
        if (e.code() != "verify.sequence") throw;
        return std::nullopt;
    }
}

}  // namespace

void write_maps(const SimulationReport& report, const std::string& directory) {
    auto colour = [](CellKind kind) -> std::array<unsigned char, 3> {
        switch (kind) {
            case CellKind::beside:
                return {235, 235, 235};
            case CellKind::pattern:
                return {160, 160, 160};
            case CellKind::left:
                return {240, 228, 66};
            case CellKind::missed:
                return {230, 120, 0};
            case CellKind::unreachable:
                return {0, 114, 178};
            case CellKind::gouge:
                return {220, 0, 0};
            case CellKind::flask:
                break;
        }
        return {60, 60, 60};
    };
    make_output_directory(directory);
    for (std::size_t l = 0; l < report.layers.size(); ++l) {
        const std::vector<CellKind>& kinds = report.layers[l].kinds;
        OutputFile file(directory, fmt::format("layer_{:02}.ppm", l + 1));
        file.write(fmt::format("P6\n{} {}\n255\n", report.nx, report.ny));
        std::string row(3 * static_cast<std::size_t>(report.nx), '\0');
        for (int j = report.ny; j-- > 0 && !kinds.empty();) {
            for (int i = 0; i < report.nx; ++i) {
                const auto c =
                    colour(kinds[static_cast<std::size_t>(j) * static_cast<std::size_t>(report.nx) +
                                 static_cast<std::size_t>(i)]);
                for (std::size_t k = 0; k < 3; ++k)
                    row[3 * static_cast<std::size_t>(i) + k] = static_cast<char>(c[k]);
            }
            file.write(row);
        }
        file.close();
    }
}

namespace {

/// Two programs of one number: a control keeps the one that came last.
void check_numbers(const std::vector<std::vector<Program>>& files,
                   std::vector<std::vector<Violation>>& found) {
    std::map<int, std::string> numbers;
    for (std::size_t k = 0; k < files.size(); ++k) {
        if (files[k].empty() || files[k][0].number == 0) continue;
        const std::string file(file_of(files[k][0].file));
        const auto [other, first] = numbers.emplace(files[k][0].number, file);
        if (first) continue;
        const std::string what = fmt::format("is O{}, as {} is: the control would keep one of them",
                                             files[k][0].number, other->second);
        found[k].push_back({"program.number", what, file, 0, {}, 0});
    }
}

/// Reads the programs that OUT holds of those that plan.json names, in its order, and checks each against
/// what the plan says of it. Those of another control are told and left out, as if they were missing.
void read_programs(Context& context, const PlannedFolder& folder, const FolderRefusal& refusal,
                   std::vector<Program>& programs, std::vector<Violation>& violations) {
    std::vector<std::size_t> present;  // the first programs of the files that are there
    std::size_t count = 0;             // of programs in them
    std::string last;
    for (std::size_t i = 0; i < folder.build.programs.size(); i = folder.file_end(i)) {
        const std::string planned(file_of(folder.build.programs[i].file));
        const std::string file = planned.substr(3);
        if (file <= last)
            violations.push_back({"program.order",
                                  "its name sorts before that of the program before it, " + last,
                                  file,
                                  0,
                                  {},
                                  0});
        last = file;
        if (std::error_code ignored; !fs::exists(folder.path / planned, ignored)) {
            violations.push_back(
                {"program.missing", "plan.json names it, nc/ does not hold it", file, 0, {}, 0});
            continue;
        }
        present.push_back(i);
        count += folder.file_end(i) - i;
    }
    std::vector<std::vector<Program>> files(present.size());
    std::vector<std::vector<Violation>> of_programs(present.size());
    parallel_each(context, present.size(), [&](std::size_t k) {
        try {
            files[k] = folder.read_file(present[k], refusal);
        } catch (const Error& error) {
            if (error.code() != kForeignProgram) throw;
            const std::string file(file_of(folder.build.programs[present[k]].file));
            of_programs[k].push_back({error.code(), error.message(), file.substr(3), 0, {}, 0});
            return;
        }
        const std::vector<Tool>& tools = folder.build.tools;
        for (std::size_t j = 0; j < files[k].size(); ++j) {
            const auto tool = std::find_if(tools.begin(), tools.end(),
                                           [&](const Tool& t) { return t.number == files[k][j].tool; });
            const std::vector<Violation> found =
                check_program(files[k][j], folder.sayings[present[k] + j],
                              tool == tools.end() ? nullptr : &*tool, folder.build.job.machine);
            of_programs[k].insert(of_programs[k].end(), found.begin(), found.end());
        }
    });
    check_numbers(files, of_programs);
    programs.reserve(count);
    for (std::vector<Program>& file : files)
        for (Program& program : file) programs.push_back(std::move(program));
    for (const std::vector<Violation>& found : of_programs)
        violations.insert(violations.end(), found.begin(), found.end());
}

/// The programs that find z = 0, read back.
void check_probes(const PlannedFolder& folder, std::vector<Violation>& violations) {
    if (folder.build.probes.empty()) return;
    const PlannedBuild build(folder.build);
    for (const PlannedProbe& probe : folder.build.probes) {
        const std::string file = probe.file.substr(3);
        if (std::error_code ignored; !fs::is_regular_file(folder.path / probe.file, ignored)) {
            violations.push_back(
                {"program.missing", "plan.json names it, nc/ does not hold it", file, 0, {}, 0});
            continue;
        }
        ProbeTask task{probe.tool, 0};
        for (const DueSlab& slab : build.slabs())
            if (slab.layer == probe.layer) task.touch_z = build.probed_at(slab)[2];
        const std::vector<Violation> found =
            check_probe(read_file(folder.path / probe.file, "verify.program", kMostProbeBytes), file, task,
                        folder.build.job);
        violations.insert(violations.end(), found.begin(), found.end());
    }
}

/// What of the table the tip runs into where z 0 is found: as if it came from over the place, to half of
/// probing.search under the touch.
std::vector<Violation> probes_in_keep_outs(Context& context, const PlannedFolder& folder,
                                           SimulationInput input) {
    const BuildPlan& plan = folder.build;
    if (plan.probes.empty() || input.machine.keep_outs.empty()) return {};
    if (const std::optional<Tool> probe = probe_of(plan.job)) input.tools.push_back(*probe);
    const Probing& probing = plan.job.probing;
    if (probing.reference.size() != 3) return {};
    const double touch = probing.reference[2] - plan.job.machine.base_board_thickness + probing.plate;
    input.programs.clear();
    for (const PlannedProbe& probe : plan.probes) {
        Program& program = input.programs.emplace_back();
        program.file = probe.file.substr(3);
        program.layer = static_cast<int>(probe.layer);
        program.tool = probe.tool;
        for (const double z : {touch + probing.search / 2, touch - probing.search / 2})
            program.steps.push_back({.x = plan.stock_min[0] + probing.reference[0],
                                     .y = plan.stock_min[1] + probing.reference[1],
                                     .z = z});
    }
    std::vector<Violation> found = check_keep_outs(context, input, plan.zero);
    std::erase_if(found, [](const Violation& v) { return v.code != "keep_out.cut"; });
    return found;
}

/// What nc/ holds beside the planned programs.
void find_strangers(const PlannedFolder& folder, std::vector<Violation>& violations) {
    const fs::path programs = folder.path / "nc";
    if (std::error_code ignored; !fs::is_directory(programs, ignored)) return;
    std::set<std::string> planned;
    for (const PlannedProgram& program : folder.build.programs)
        planned.insert(std::string(file_of(program.file).substr(3)));
    for (const PlannedProbe& probe : folder.build.probes) planned.insert(probe.file.substr(3));
    std::vector<std::string> strangers;
    for (const auto& entry : fs::directory_iterator(programs))
        if (const std::string file = entry.path().filename().string(); !planned.contains(file))
            strangers.push_back(file);
    std::sort(strangers.begin(), strangers.end());
    for (const std::string& file : strangers)
        violations.push_back(
            {"program.unplanned", "nc/ holds it, plan.json does not name it", file, 0, {}, 0});
}

/// Follows the cut list at the saw.
void saw_by_list(const fs::path& file, const BuildPlan& build, std::vector<Violation>& violations) {
    std::error_code error;
    if (!fs::is_regular_file(file, error)) {
        violations.push_back(
            {"cut_list.no_file", "there is no list of what to saw", "cut_list.csv", 0, {}, 0});
        return;
    }
    const std::vector<Violation> found =
        check_cut_list(read_file(file, "verify.cut_list", kMostCutListBytes), build);
    violations.insert(violations.end(), found.begin(), found.end());
}

/// Drills the slabs' undersides by the list of dowels; where the plan has none, there is no list.
void drill_by_list(const fs::path& file, const BuildPlan& build, std::vector<Violation>& violations) {
    bool has_dowels = false;
    for (std::size_t l = 0; l + 1 < build.layers.size(); ++l)
        has_dowels |= !build.layers[l].dowels.empty() && !mills_underside(build, build.layers[l + 1].index);
    std::error_code error;
    const bool is_there = fs::is_regular_file(file, error);
    if (has_dowels && !is_there)
        violations.push_back(
            {"dowel.no_list", "there is no list of the holes in undersides", "dowels.csv", 0, {}, 0});
    if (!is_there) return;
    const std::vector<Violation> found =
        check_dowel_list(read_file(file, "verify.dowel_list", kMostCutListBytes), build);
    violations.insert(violations.end(), found.begin(), found.end());
}

/// What a proof goes by, of all programs of a folder.
SimulationOptions simulation_options(const Job& job, const VerifyOptions& options,
                                     const std::vector<Tool>& tools) {
    SimulationOptions simulation;
    simulation.cell = options.cell;
    simulation.maps = options.maps || !options.maps_directory.empty();
    simulation.faults = options.faults;
    simulation.gouge = job.tolerances.gouge;
    simulation.cusp = job.tolerances.cusp;
    simulation.board_cut = board_cut_limit(job.machine, tools);
    return simulation;
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
                                  const VerifyOptions& options, std::vector<Violation>& violations) {
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
    find_strangers(under, found);
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
void measure_unmade(Context& context, MeshView pattern, const PlannedFolder& folder,
                    const std::map<int, MilledLayer>& undersides, SimulationReport& report) {
    const AirGaps gaps = air_gaps(context, pattern, filled_cell(pattern));
    std::vector<MilledLayer> layers;
    for (const LayerToBuild& layer : folder.build.layers) {
        const auto under = undersides.find(layer.index);
        layers.push_back(under != undersides.end() ? under->second
                                                   : MilledLayer{layer.z_top, MilledFrom::above, 0});
    }
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

/// Proves the undersides of a plan's slabs; what they make is then not unmade.
std::vector<UndersideFindings> prove_undersides(Context& context, const PlannedFolder& folder,
                                                MeshView pattern, const VerifyOptions& options,
                                                SimulationReport& report,
                                                std::vector<Violation>& violations) {
    std::vector<UndersideFindings> undersides;
    std::map<int, MilledLayer> milled;
    const std::vector<LayerToBuild>& layers = folder.build.layers;
    for (const UndersideToMill& planned : folder.build.undersides)
        for (std::size_t l = 0; l < layers.size(); ++l) {
            if (layers[l].index != planned.layer) continue;
            undersides.push_back(prove_underside(context, folder, l, planned, pattern, options, violations));
            milled[planned.layer] = milled_layer(undersides.back().slab);
        }
    if (!milled.empty()) measure_unmade(context, pattern, folder, milled, report);
    return undersides;
}

}  // namespace

Verification verify_folder(Context& context, const std::string& directory, const VerifyOptions& options) {
    const fs::path out(directory);
    const FolderRefusal refusal;
    const PlannedFolder folder = read_planned_folder(out, refusal);
    if (folder.turned)
        throw Error(ErrorKind::verification, "verify.underside", "is the underside of a slab of another plan",
                    (out / "plan.json").string(), "verify the folder that holds undersides/");
    const Job& job = folder.build.job;

    Verification result;
    result.input = folder.simulation;
    SimulationInput& input = result.input;
    if (options.keep_outs != nullptr) input.machine.keep_outs = *options.keep_outs;
    std::vector<Violation> violations;
    if (job.machine.post == Post::linuxcnc) {  // the others' tables are kept at the control
        const fs::path table = out / "tool.tbl";
        const std::string text = read_file(table, "verify.tool_table", kMostToolTableBytes);
        if (const auto magazine = stated_magazine(out / "sequence.json", job.machine.magazine)) {
            std::vector<Tool> tools = input.tools;
            if (const std::optional<Tool> probe = probe_of(job)) tools.push_back(*probe);
            violations = check_tool_table(text, table.string(), tools, *magazine);
        }
    }
    read_programs(context, folder, refusal, input.programs, violations);
    check_probes(folder, violations);
    find_strangers(folder, violations);
    const std::vector<Violation> entered = check_keep_outs(context, input, folder.build.zero);
    violations.insert(violations.end(), entered.begin(), entered.end());
    const std::vector<Violation> probed = probes_in_keep_outs(context, folder, input);
    violations.insert(violations.end(), probed.begin(), probed.end());
    BuildPlan build = folder.build;
    set_heights(build, input.programs);
    check_sequence(out / "sequence.json", build, violations);
    drill_by_list(out / "dowels.csv", build, violations);
    if (folder.states_wood) saw_by_list(out / "cut_list.csv", build, violations);

    result.pattern = options.pattern && options.pattern->is(folder.pattern)
                         ? as_planned(context, options.pattern, folder.pattern)
                         : read_planned_pattern(context, directory, folder.pattern, options.source, "verify");
    Pattern& pattern = *result.pattern;
    input.mesh = pattern.read.mesh.view();
    if (!pattern.part) pattern.part.emplace(context, input.mesh);

    const SimulationOptions simulation = simulation_options(job, options, input.tools);
    result.report = simulate(context, input, *pattern.part, simulation, options.memory);
    result.undersides = prove_undersides(context, folder, input.mesh, options, result.report, violations);
    const std::vector<Violation> dowels = check_dowels(context, input, *pattern.part, job.dowels.clearance);
    violations.insert(violations.end(), dowels.begin(), dowels.end());
    MissingToolOptions asked;
    asked.inch = job.units == LengthUnit::inch;
    asked.limit = simulation.cusp + simulation.slack;
    asked.board_cut = simulation.board_cut;
    asked.cusp = simulation.cusp;
    asked.bends = simulation.cusp;
    if (folder.build.job_stated) {
        asked.holder_clearance = job.cutting.holder_clearance;
        asked.vertical_rad = job.cutting.vertical_deg * std::numbers::pi / 180;
    }
    result.missing = missing_tools(context, input, result.report, *pattern.part, asked);
    input.mesh = {};
    result.report.violations.insert(result.report.violations.begin(), violations.begin(), violations.end());
    result.json = verify_json(input, result.report, simulation, fs::path(pattern.place).filename().string(),
                              folder.build.job_stated, result.missing, result.undersides);

    if (!options.maps_directory.empty()) write_maps(result.report, options.maps_directory);
    if (options.write) write_file_in(out, "verify.json", result.json);
    return result;
}

}  // namespace slabwright
