#include "io/folder_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "engine/base_board.h"
#include "engine/schedule/probes.h"
#include "engine/simulate/keep_out_check.h"
#include "engine/simulate/planned_build.h"
#include "io/posts/probe_check.h"
#include "io/posts/program_check.h"
#include "io/read/input_file.h"
#include "io/read/sequence_reader.h"
#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kMostProbeBytes = kMebibyte;

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

/// What of the table the tip runs into where z 0 is found: as if it came from over the place, to half of
/// probing.search under the touch.
std::vector<Violation> probes_in_keep_outs(Context& context, const PlannedFolder& folder,
                                           const std::vector<KeepOut>& keep_outs) {
    SimulationInput input = folder.simulation;
    input.machine.keep_outs = keep_outs;
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

}  // namespace

std::string read_file(const fs::path& path, const char* code, std::uint64_t most_bytes) {
    return read_whole(path, {ErrorKind::verification, code, most_bytes, "plan again"});
}

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

void check_probes(Context& context, const PlannedFolder& folder, const std::vector<KeepOut>& keep_outs,
                  std::vector<Violation>& violations) {
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
    const std::vector<Violation> entered = probes_in_keep_outs(context, folder, keep_outs);
    violations.insert(violations.end(), entered.begin(), entered.end());
}

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

}  // namespace slabwright
