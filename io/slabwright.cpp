#include "io/slabwright.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>

#include "engine/planner/planner.h"
#include "engine/planner/replan.h"
#include "engine/schedule/cut_list.h"
#include "engine/schedule/magazine.h"
#include "engine/schedule/schedule.h"
#include "engine/simulate/simulation_memory.h"
#include "engine/simulate/work.h"
#include "engine/tool_choice/access_map.h"
#include "engine/tools/libraries.h"
#include "io/front_door.h"
#include "io/posts/dialect.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/probe_program.h"
#include "io/posts/tool_table.h"
#include "io/proof.h"
#include "io/read/input_file.h"
#include "io/read/job_toml.h"
#include "io/read/mesh_format.h"
#include "io/read/own_post.h"
#include "io/read/pattern.h"
#include "io/read/pattern_mesh.h"
#include "io/read/repair.h"
#include "io/read/tool_library.h"
#include "io/report_html.h"
#include "io/text/job_keys.h"
#include "io/text/json_text.h"
#include "io/verdict.h"
#include "io/verify.h"
#include "io/write/access_ply.h"
#include "io/write/cut_list_files.h"
#include "io/write/dowel_list.h"
#include "io/write/inspect_json.h"
#include "io/write/job_toml.h"
#include "io/write/output_file.h"
#include "io/write/output_folder.h"
#include "io/write/plan_json.h"
#include "io/write/sections_dxf.h"
#include "io/write/sections_json.h"
#include "io/write/sections_svg.h"
#include "io/write/sequence_json.h"
#include "io/write/stl_writer.h"
#include "io/write/wood_json.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"
#include "kernels/slicing/solid_volume.h"

namespace slabwright {

std::string version() { return SLABWRIGHT_VERSION; }

std::string pattern_formats() {
    std::string built, missing;
    for (const MeshFormat* format : mesh_formats()) {
        std::string& list = format->built ? built : missing;
        list += list.empty() ? "" : ", ";
        list += format->name;
    }
    return missing.empty() ? built : built + "; not built: " + missing;
}

Job default_job() {
    Job job;
    job.tools = shop_library();
    return job;
}

Job read_job(const std::string& path, const std::string& tool_library, const std::string& post) {
    return guarded([&] {
        const std::string text = path.empty()
                                     ? std::string()
                                     : read_whole(path, {ErrorKind::usage, "job.unreadable", kMostJobBytes,
                                                         "check the path after --job"});
        // What a job names lies beside it; what was asked for, where it was asked.
        const std::filesystem::path beside = std::filesystem::path(path).parent_path();
        const std::filesystem::path folder = tool_library.empty() ? beside : std::filesystem::path();
        const std::filesystem::path posts = post.empty() ? beside : std::filesystem::path();
        return parse_job(text, path, default_job(),
                         {[&](const std::string& name, const std::vector<std::int64_t>& wanted) {
                              return read_tool_library(folder / name, wanted);
                          },
                          tool_library},
                         {[&](const std::string& name) { return read_own_post(posts / name); }, post});
    });
}

std::string post_file_toml(std::string_view control) {
    return guarded([&] {
        for (const Word<Post>& word : kPostWords)
            if (control == word.text) return post_toml(word.value);
        throw Error(ErrorKind::usage, "post.base",
                    quoting_line(fmt::format("there is no control \"{}\"", control.substr(0, 60))), "",
                    "name linuxcnc, fanuc, haas, grbl, mach, iso or siemens");
    });
}

Job job_from_toml(std::string_view toml, const std::string& name, const Job& base) {
    return guarded([&] { return parse_job(toml, name, base); });
}

std::string default_job_toml(std::string_view library) {
    return guarded([&] {
        std::optional<std::vector<Tool>> tools = named_library(library);
        if (!tools)
            throw Error(ErrorKind::usage, "job.library",
                        quoting_line(fmt::format("there is no tool library \"{}\"", library.substr(0, 60))),
                        "", fmt::format("name {}", kLibraryNames));
        Job job;
        job.tools = std::move(*tools);
        return job_toml(job);
    });
}

std::shared_ptr<Pattern> read_pattern(Context& context, const PatternSource& source, const Job& job) {
    return guarded([&] {
        validate(job);
        const ReadingOptions reading = reading_options(job);
        return std::make_shared<Pattern>(
            Pattern{source.name(), reading, read_pattern_mesh(context, source, reading), {}, {}});
    });
}

Plan plan(Context& context, const PatternSource& source, const Job& job) {
    return plan(context, *read_pattern(context, source, job), job);
}

namespace {

/// The engine knows no file; the user wants to hear of it.
template <class Body>
auto naming_file(const std::string& path, Body&& body) -> decltype(body()) {
    try {
        return body();
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::no_plan) throw;
        throw Error(error.kind(), error.code(), error.message(),
                    error.place().empty() ? path : path + ", " + error.place(), error.remedy());
    }
}

}  // namespace

Plan plan(Context& context, const Pattern& pattern, const Job& job) {
    return guarded([&] {
        validate(job);
        const PatternMesh& read = pattern.read;
        const std::string& place = pattern.place;
        if (pattern.reading != reading_options(job))
            throw Error(
                ErrorKind::usage, "plan.reading",
                "was read with other units, another tolerance of welding or another repair than the job's",
                place, "read the pattern with the job that it is planned with");
        require_solid(context, read, place);
        Plan result = naming_file(place, [&] { return make_plan(context, read.mesh, read.input, job); });
        result.diagnostics.insert(result.diagnostics.begin(), read.diagnostics.begin(),
                                  read.diagnostics.end());
        if (!reports_are_built())
            result.diagnostics.push_back({Severity::note, "report.not_built",
                                          "this build of slabwright writes no report.html", std::nullopt});
        return result;
    });
}

namespace {

// All of a plan but what is found about it, into a folder under way.
// @param other for each layer whether its programs are other than those that the folder holds; empty: all are
void fill(Context& context, const Plan& plan, const std::filesystem::path& out,
          const std::vector<bool>& other = {}) {
    struct PlannedFile {
        const Layer* layer;
        std::size_t begin;  // its first operation
        std::string name;
    };
    std::vector<PlannedFile> files;
    const std::filesystem::path programs_folder = out / "nc";
    std::filesystem::create_directory(programs_folder);
    std::set<std::string> stale;  // what the folder holds and the plan does not name
    for (const auto& entry : std::filesystem::directory_iterator(programs_folder))
        stale.insert(entry.path().filename().string());
    for (std::size_t l = 0; l < plan.layers.size(); ++l)
        for (std::size_t o = 0; o < plan.layers[l].operations.size(); o = file_end(plan.layers[l], o)) {
            const std::string name(file_of(plan.layers[l].operations[o].file));
            if (stale.erase(name) == 0 || other.empty() || other[l])
                files.push_back({&plan.layers[l], o, name});
        }
    for (const ProbeProgram& probe : plan.probes) {
        stale.erase(probe.file);
        write_file_in(programs_folder, probe.file, probe_text(plan, probe));
    }
    for (const std::string& file : stale) std::filesystem::remove(programs_folder / file);
    context.begin_phase("writing", 0.985, 1.0, files.size() + 1);
    // Each program is a file of its own, so threads cannot mix their texts.
    parallel_each(context, files.size(), [&](std::size_t i) {
        OutputFile file(programs_folder, files[i].name);
        write_file(plan, *files[i].layer, files[i].begin, [&](std::string_view piece) {
            context.throw_if_cancelled();
            file.write(piece);
        });
        file.close();
        context.advance();
    });
    if (plan.job.machine.post == Post::linuxcnc)
        write_file_in(out, "tool.tbl",
                      tool_table(plan.job, magazine_at_start(plan.sequence, plan.job.machine.magazine)));
    if (plan.job.machine.own_post) write_file_in(out, kOwnPostFile, plan.job.machine.own_post->text);
    write_file_in(out, "sequence.json", sequence_json(plan));
    if (!plan.turned) {
        const CutList list = cut_list(plan);
        write_file_in(out, "cut_list.csv", cut_list_csv(list));
        const std::vector<UndersideHole> holes = underside_holes(plan);
        write_file_in(out, "cut_list.dxf", cut_list_dxf(list, holes));
        if (!holes.empty()) write_file_in(out, "dowels.csv", dowels_csv(holes));
    }
    write_file_in(out, "plan.json", plan_json(plan));
    for (const Plan& under : plan.undersides) {
        const std::filesystem::path folder = out / underside_folder(under.turned->layer);
        std::filesystem::create_directories(folder);
        fill(context, under, folder);
    }
    context.throw_if_cancelled();
    context.advance();
}

// Where the progress stands when a plan has been verified and only its report is left.
double verifying_share(const Plan& plan, double cell_mm) {
    SimulationSize size;
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations) {
            const auto tool = std::find_if(plan.job.tools.begin(), plan.job.tools.end(),
                                           [&](const Tool& t) { return t.number == op.tool; });
            size.steps += op.moves.size();
            if (tool != plan.job.tools.end()) size.swept_mm2 += op.cutting_mm * tool->diameter;
        }
    size.stock_mm2 = (plan.stock_max[0] - plan.stock_min[0]) * (plan.stock_max[1] - plan.stock_min[1]);
    size.cell_mm = cell_mm > 0 ? cell_mm : simulation_cell(plan.job.tools, plan.job.tolerances.cusp);
    size.layers = plan.layers.size();
    size.facets = plan.input.triangles;
    const SimulationWork simulating = simulation_work(size);
    const ReportWork reporting = report_work(size.steps, size.facets);
    const double verifying = simulating.checking + simulating.cutting;
    return kPlanningShare +
           (1 - kPlanningShare) * verifying / (verifying + reporting.replay + reporting.page);
}

}  // namespace

void require_replaceable(const std::string& directory) {
    guarded([&] { const OutputFolder probe(directory); });
}

std::string wood_document(const Plan& plan) {
    return guarded([&] {
        const CutList list = cut_list(plan);
        const CutList uniform = cut_list(plan, Blanks::pattern);
        std::string text = fmt::format("wood    {}; {:.2f} m2 of {:.2f} m2 in slabs and board",
                                       boards_text(list), list.sawn_m2(), list.bought_m2());
        if (plan.job.slabs.blanks == Blanks::layer)
            text += fmt::format("; all as large as the pattern {:.2f} m2 of {:.2f} m2", uniform.sawn_m2(),
                                uniform.bought_m2());
        const std::string dowels = dowels_text(underside_holes(plan));
        if (!dowels.empty()) text += fmt::format("\ndowels  {}", dowels);
        return text + '\n' + cost_text(plan.job, cost_of(plan.job, amounts_of(plan, list)));
    });
}

std::string plan_document(const Plan& plan) {
    return guarded([&] { return plan_json(plan); });
}

std::string program_document(const Plan& plan, const Layer& layer, const Operation& operation) {
    return guarded([&] { return program_text(plan, layer, operation); });
}

void write(Context& context, const Plan& plan, const std::string& directory, const PatternSource& source) {
    guarded([&] {
        OutputFolder out(directory);
        fill(context, plan, out.path());
        if (!source.empty() && reports_are_built()) write_report(context, out.path().string(), {source});
        context.throw_if_cancelled();
        out.commit();
    });
}

namespace {

VerifyResult write_and_verify(Context& context, const Plan& plan, const std::string& directory,
                              const VerifyOptions& options) {
    return guarded([&] {
        check_cell(options.cell);
        OutputFolder out(directory);
        fill(context, plan, out.path());
        const bool reports = reports_are_built();
        const double verified = reports ? verifying_share(plan, options.cell) : 1;
        context.share_progress(kPlanningShare, verified);
        Verification found = verify_folder(context, out.path().string(), options);
        VerifyResult result = verdict(found);
        context.share_progress(verified, 1);
        if (reports) write_report(context, out.path().string(), {options.source}, std::move(found));
        context.throw_if_cancelled();
        out.commit();
        return result;
    });
}

}  // namespace

VerifyResult write_verified(Context& context, const Plan& plan, const std::string& directory,
                            const PatternSource& source, double cell_mm) {
    return write_and_verify(context, plan, directory, {.source = source, .cell = cell_mm});
}

VerifyResult write_verified(Context& context, const Plan& plan, const std::string& directory,
                            const std::shared_ptr<Pattern>& pattern, double cell_mm) {
    return write_and_verify(context, plan, directory,
                            {.source = pattern->place, .pattern = pattern, .cell = cell_mm});
}

VerifyResult write_proven(Context& context, Plan& plan, const std::string& directory,
                          const std::shared_ptr<Pattern>& pattern, bool keep_failed, double cell_mm) {
    return guarded([&] {
        check_cell(cell_mm);
        VerifyOptions options{.source = pattern->place, .pattern = pattern, .cell = cell_mm};
        options.faults = true;
        SimulationMemory memory;  // what a round does not change is not simulated again
        options.memory = &memory;
        OutputFolder out(directory);
        fill(context, plan, out.path());
        const bool reports = reports_are_built();
        const double verified = reports ? verifying_share(plan, cell_mm) : 1;
        context.share_progress(kPlanningShare, verified);
        Verification found = verify_folder(context, out.path().string(), options);
        // What did not pass goes back into the layers that it was found in. The text is the judge every time.
        std::optional<Replanner> replanner;
        for (int round = 1; round <= kProofRounds && !found.report.passed() && is_of_the_part(found.report);
             ++round) {
            context.share_progress(verified, verified);
            if (!replanner) replanner.emplace(context, found.pattern->read.mesh.view(), *found.pattern->part);
            const std::vector<LayerFaults> faults = faults_of(plan, found);
            const ProgramNumbers numbers = program_numbers(plan);
            const bool under =
                naming_file(pattern->place, [&] { return mend_undersides(context, plan, found, round); });
            if (faults.empty() && !under) break;
            std::vector<bool> other;
            if (!faults.empty())
                other = naming_file(pattern->place, [&] { return replanner->mend(plan, faults, round); });
            const bool mended = !other.empty() || under;
            other.resize(plan.layers.size());
            note_other_numbers(plan, numbers, other);
            fill(context, plan, out.path(), other);
            if (!mended) break;
            memory.programs = std::move(found.input.programs);
            found = {};
            found = verify_folder(context, out.path().string(), options);
        }
        VerifyResult result = verdict(found);
        if (!result.passed && !keep_failed && is_of_the_part(found.report)) {
            result.written = false;
            result.refusals = refusals_of(found.report, pattern->place);
            return result;
        }
        context.share_progress(verified, 1);
        if (reports) write_report(context, out.path().string(), {options.source}, std::move(found));
        context.throw_if_cancelled();
        out.commit();
        return result;
    });
}

void write_access_maps(Context& context, const Plan& plan, const PatternSource& source,
                       const std::string& directory) {
    guarded([&] {
        const PatternMesh pattern = read_pattern_mesh(context, source, reading_options(plan.job));
        if (pattern.input.sha256 != plan.input.sha256)
            throw Error(ErrorKind::input, "access_maps.stl", "is not the pattern that was planned",
                        source.name(), "give the STL of the plan");
        make_output_directory(directory);
        context.begin_phase("access maps", 1, 1);
        access_maps(context, pattern.mesh.view(), plan, [&](const AccessMap& map) {
            const Accessibility& a = map.accessibility;
            const std::string comment = fmt::format(
                "{}: layer {}, tool {} reaches {:.4f} of the surface to be machined; mm, z = 0 at the bottom",
                plan.input.sha256.substr(0, 12), map.layer, map.tool, a.ratio());
            write_file_in(directory, fmt::format("layer_{:02}_tool_{:02}.ply", map.layer, map.tool),
                          access_ply(pattern.mesh.view(), a.share, comment));
        });
    });
}

std::string inspect(Context& context, const PatternSource& source, const Job& job, InspectionForm form,
                    const InspectionOptions& options) {
    return guarded([&] {
        validate(job);
        const Inspection found = inspect_pattern(context, source, job, options);
        return form == InspectionForm::json ? inspection_json(found) : inspection_text(found);
    });
}

namespace {

/// Copies a file, all or nothing.
void copy_file(Context& context, const std::string& from, const std::string& to) {
    std::ifstream in(from, std::ios::binary);
    const std::filesystem::path place(to);
    OutputFile out(place.has_parent_path() ? place.parent_path() : ".", place.filename().string());
    std::string piece(1 << 20, '\0');
    while (in.read(piece.data(), static_cast<std::streamsize>(piece.size())), in.gcount() > 0) {
        context.throw_if_cancelled();
        out.write(std::string_view(piece).substr(0, static_cast<std::size_t>(in.gcount())));
    }
    if (!in.eof())
        throw Error(ErrorKind::input, "repair.read", "the file cannot be read to its end", from,
                    "check its disk");
    out.close();
}

}  // namespace

namespace {

double volume_of_solid(Context& context, Mesh& mesh, const MeshReport& report) {
    mesh.roles = facet_roles(context, mesh.view());
    return solid_volume(context, mesh.view(), report.volume_mm3).mm3;
}

}  // namespace

RepairResult repair(Context& context, const PatternSource& source, const std::string& out, const Job& job) {
    return guarded([&] {
        validate(job);
        ReadingOptions reading = reading_options(job);
        reading.repair = Repair::none;
        PatternMesh stl = read_pattern_mesh(context, source, reading);
        context.begin_phase("repair", 0.05, 0.95);
        const Repair how = job.input.repair == Repair::none ? Repair::mend : job.input.repair;
        Repaired repaired = repair_mesh(context, stl.mesh.view(), stl.report, how, source.name());
        RepairResult result{std::move(repaired.told), std::move(repaired.diagnostics), stl.input.volume_mm3};
        const bool needed = result.repair.how != "none";
        const bool is_file = source.kind() == PatternSource::Kind::file;
        if (!needed && job.tolerances.weld == 0 && is_file && stl.family == "stl") {
            copy_file(context, source.name(), out);
            return result;
        }
        Mesh mesh = std::move(needed ? repaired.mesh : stl.mesh);
        if (needed) result.volume_mm3 = volume_of_solid(context, mesh, repaired.report);
        // Back to where the file has it, in its unit.
        const double unit = job.units == LengthUnit::inch ? kInch : 1.0, lowest = stl.input.min[2];
        for (Vec3f& v : mesh.vertices)
            v = {static_cast<float>(v.x / unit), static_cast<float>(v.y / unit),
                 static_cast<float>((v.z + lowest) / unit)};
        write_stl(out, mesh, job.units);
        return result;
    });
}

void slice_to_file(Context& context, const PatternSource& source, const Job& job, double every_mm,
                   const std::string& out) {
    guarded([&] {
        validate(job);
        if (!(every_mm > 0) || !std::isfinite(every_mm))
            throw Error(ErrorKind::usage, "slice.every",
                        fmt::format("sections every {} mm are none", every_mm), "--every",
                        "give a distance over 0");
        const std::size_t dot = out.rfind('.');
        const std::string ending = dot == std::string::npos ? "" : out.substr(dot);
        if (ending != ".svg" && ending != ".dxf" && ending != ".json")
            throw Error(ErrorKind::usage, "slice.format",
                        fmt::format("no format has the ending \"{}\"", ending), out,
                        "end the name in .svg, .dxf or .json");
        const PatternMesh stl = read_pattern_mesh(context, source, reading_options(job));
        const double height = bounds(stl.mesh.view()).max.z;
        const double number = std::ceil(height / every_mm) - 1;  // multiples of every_mm inside (0, height)
        constexpr double most = 1e6;
        if (number > most)
            throw Error(ErrorKind::usage, "slice.every",
                        fmt::format("sections every {} mm of {} mm are {:.0f}, over {:.0f}", every_mm, height,
                                    number, most),
                        "--every", "give a larger distance");
        if (number < 1)
            throw Error(
                ErrorKind::usage, "slice.every",
                fmt::format("the pattern is {} mm high: no multiple of {} mm lies inside", height, every_mm),
                "--every", "give a smaller distance");
        std::vector<Plane> planes;
        for (int i = 1; i <= static_cast<int>(number); ++i)
            if (i * every_mm < height) planes.push_back({i * every_mm, Side::above});
        context.begin_phase("slicing", 0.5, 0.9);
        const std::vector<Section> sections = slice(context, stl.mesh.view(), planes, {job.tolerances.gap});
        context.begin_phase("writing", 0.9, 1.0);
        const std::string text = ending == ".svg"   ? sections_svg(sections)
                                 : ending == ".dxf" ? sections_dxf(sections)
                                                    : sections_json(sections);
        context.throw_if_cancelled();
        write_file_whole(out, text);
    });
}

std::string terminal_text(std::string_view text, bool one_line) { return printable(text, one_line); }

std::string number_text(double value, int decimals) { return rounded_text(value, decimals); }

}  // namespace slabwright
