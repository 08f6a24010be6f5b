#include "io/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "engine/schedule/magazine.h"
#include "engine/schedule/probes.h"
#include "engine/simulate/dowel_proof.h"
#include "engine/simulate/keep_out_check.h"
#include "io/folder_checks.h"
#include "io/posts/tool_table_check.h"
#include "io/read/cut_list_check.h"
#include "io/read/dowel_list_check.h"
#include "io/read/input_file.h"
#include "io/read/planned_folder.h"
#include "io/read/sequence_reader.h"
#include "io/underside_proof.h"
#include "io/write/output_file.h"
#include "io/write/verify_json.h"
#include "kernels/errors.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kMostCutListBytes = 16 * kMebibyte;

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
    if (folder.build.job_stated) result.strength_mpa = job.material.strength_mpa;
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
    find_strangers(folder, violations);
    const std::vector<Violation> entered = check_keep_outs(context, input, folder.build.zero);
    violations.insert(violations.end(), entered.begin(), entered.end());
    check_probes(context, folder, input.machine.keep_outs, violations);
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
    result.undersides = prove_undersides(context, folder, input.mesh, options, input.machine.keep_outs,
                                         input.programs, result.report, violations);
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
