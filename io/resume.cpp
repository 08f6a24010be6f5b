#include "io/resume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <span>

#include "engine/paths/operations/facing.h"
#include "engine/planner/remake.h"
#include "engine/simulate/face_off_proof.h"
#include "engine/simulate/keep_out_check.h"
#include "engine/simulate/planned_build.h"
#include "engine/simulate/resume_point.h"
#include "io/front_door.h"
#include "io/posts/gcode_writer.h"
#include "io/read/input_file.h"
#include "io/read/planned_folder.h"
#include "io/read/sequence_reader.h"
#include "io/text/progress_json.h"
#include "io/text/sha256.h"
#include "io/write/output_file.h"
#include "io/write/output_folder.h"
#include "io/write/sequence_json.h"
#include "kernels/errors.h"

namespace slabwright {

namespace fs = std::filesystem;

namespace {

constexpr const char* kProgress = "progress.json";
constexpr int kMostFolders = 999;

std::string digest(const std::string& text) { return sha256(std::as_bytes(std::span(text))); }

std::string folder_name(int number) { return fmt::format("resume_{:03}", number); }

/// The number of a folder that a remade layer has; 0 where the name is none.
int folder_number(const std::string& name) {
    for (int n = 0; n < 3 && name.size() == 10; ++n)
        if (name[7 + static_cast<std::size_t>(n)] < '0' || name[7 + static_cast<std::size_t>(n)] > '9')
            return 0;
    return name.size() == 10 && name.starts_with("resume_") ? std::stoi(name.substr(7)) : 0;
}

/// The highest number of such a folder in OUT; 0: there is none.
int last_folder(const fs::path& out) {
    int last = 0;
    std::error_code error;
    for (fs::directory_iterator at(out, error); !error && at != fs::directory_iterator(); at.increment(error))
        last = std::max(last, folder_number(at->path().filename().string()));
    return last;
}

const double* number_in(const SequenceStep& step, const char* key) {
    for (const auto& [name, value] : step.numbers)
        if (name == key) return &value;
    return nullptr;
}

const std::string* word_in(const SequenceStep& step, const char* key) {
    for (const auto& [name, value] : step.words)
        if (name == key) return &value;
    return nullptr;
}

/// A sequence with its bytes' digest, and the build that it is replayed for.
struct Loaded {
    std::string file;  // from OUT
    std::string sha256;
    BuildSequence sequence;
    BuildPlan build;
    std::vector<Program> face_offs;  // the texts of build.face_offs
};

/// The folder of a layer that is made again, before it is written.
struct RemadeFolder {
    std::string name;                       // in OUT
    std::vector<std::string> files, texts;  // its programs, from OUT
    std::string sequence;                   // the text
};

class Resumption {
public:
    Resumption(Context& context, const std::string& directory, const ResumeOptions& options)
        : context_(context),
          out_(directory),
          options_(options),
          folder_(
              read_planned_folder(out_, {ErrorKind::input, "resume.plan", "resume.program", "resume.post"})),
          place_((out_ / kProgress).string()) {}

    ResumeStatus run() {
        if (folder_.turned && options_.remake)
            throw Error(ErrorKind::usage, "resume.turned",
                        "is a slab's underside: there is no layer under it to go back to",
                        (out_ / "plan.json").string(),
                        "take another slab, and begin its sequence anew with --after 0");
        read_progress();
        if (options_.after) progress_.after = *options_.after;
        if (progress_.after < 0 ||
            static_cast<std::size_t>(progress_.after) > in_force_.sequence.steps.size())
            throw Error(ErrorKind::usage, "resume.step",
                        fmt::format("step {} is none of {}", progress_.after, in_force_.file),
                        options_.after ? "--after" : place_,
                        fmt::format("give 0 to {}, the last step that was finished",
                                    in_force_.sequence.steps.size()));
        const BuildState state = replay(in_force_, progress_.after);
        if (!options_.after && known_) check_state(state);
        prove_left(state);
        progress_.state = state;
        if (options_.after) {
            progress_.time_s = options_.now_s;
            known_ = true;
        }
        RemadeFolder remade;
        if (options_.remake) remade = remake();
        ResumeStatus status;
        status.programs = remade.files;
        status.sequence = in_force_.file;
        status.after = progress_.after;
        if (known_) status.time_s = progress_.time_s;
        status.steps = in_force_.sequence.steps;
        for (const SequenceStep& step : std::span(status.steps).subspan(progress_.state.done))
            status.minutes_left += step.seconds / 60;
        const double waited =
            known_ ? std::max(0.0, static_cast<double>(options_.now_s - progress_.time_s)) : 0;
        status.point = std::make_shared<const ResumePoint>(
            resume_point(in_force_.build, in_force_.sequence, progress_.state, waited));
        // Nothing is written before all that could fail is done, and nothing can fail behind it.
        if (options_.remake) write_remade(remade);
        else if (options_.after) write_progress();
        return status;
    }

private:
    [[nodiscard]] std::string read(const fs::path& file, const char* code, std::uint64_t most) const {
        return read_whole(file,
                          {ErrorKind::input, code, most, "put it back as it was written, or plan again"});
    }

    /// The program that faces a layer off, of its text. @param layer index
    [[nodiscard]] Program face_off_of(const std::string& text, const std::string& file,
                                      std::size_t layer) const {
        Program program = read_planned_program(text, file, folder_.build.job);
        place_program(program, folder_.build, layer);
        program.file = file;
        program.layer = static_cast<int>(layer);
        program.kind = OperationKind::face;
        program.planned_tool = program.tool;
        return program;
    }

    static PlannedProgram planned(const Program& program) {
        PlannedProgram p;
        p.file = program.file;
        p.layer = static_cast<std::size_t>(program.layer);
        p.kind = OperationKind::face;
        p.tool = program.tool;
        for (const ProgramStep& step : program.steps)
            if (std::isfinite(step.z)) {
                p.low = std::min(p.low.value_or(step.z), step.z);
                p.high = std::max(p.high.value_or(step.z), step.z);
            }
        return p;
    }

    /// Reads a sequence of OUT and the programs of it that plan.json does not name.
    [[nodiscard]] Loaded load(const std::string& file) const {
        Loaded loaded;
        loaded.file = file;
        const std::string text = read(out_ / file, "resume.sequence", kLargestSequence);
        loaded.sha256 = digest(text);
        loaded.sequence = read_sequence(text);
        loaded.build = folder_.build;
        const std::vector<SequenceStep>& steps = loaded.sequence.steps;
        for (std::size_t i = 0; i < steps.size(); ++i) {
            if (steps[i].id != static_cast<int>(i) + 1)
                refuse_sequence(loaded, fmt::format("step {} stands at place {}", steps[i].id, i + 1));
            if (steps[i].action == "face_off") add_face_off(loaded, steps[i]);
        }
        set_heights(loaded);
        return loaded;
    }

    void add_face_off(Loaded& loaded, const SequenceStep& step) const {
        const std::string* file = word_in(step, "program");
        const std::vector<LayerToBuild>& layers = loaded.build.layers;
        const auto layer = std::find_if(layers.begin(), layers.end(),
                                        [&](const LayerToBuild& l) { return l.index == step.layer; });
        const bool ours = file && folder_number(file->substr(0, 10)) > 0 && file->substr(10, 4) == "/nc/" &&
                          file->size() > 14 && file->find('/', 14) == std::string::npos &&
                          file->find("..") == std::string::npos;
        if (!ours || layer == layers.end())
            refuse_sequence(loaded, fmt::format("step {} names no program that faces a layer off", step.id));
        const std::string text = read(out_ / *file, "resume.program", kMostProgramBytes);
        loaded.face_offs.push_back(
            face_off_of(text, *file, static_cast<std::size_t>(layer - layers.begin())));
        loaded.build.face_offs.push_back(planned(loaded.face_offs.back()));
    }

    /// Of the plan's own programs the heights that their steps state: `verify` has read the texts. A step of
    /// several programs states none of one of them.
    static void set_heights(Loaded& loaded) {
        const PlannedBuild heights(loaded.build);
        std::map<std::string, PlannedProgram*> programs;
        for (PlannedProgram& p : loaded.build.programs) programs[p.file] = &p;
        for (const SequenceStep& step : loaded.sequence.steps) {
            const std::string* file = word_in(step, "program");
            const auto found = file ? programs.find(*file) : programs.end();
            const double *low = number_in(step, "z_low_mm"), *high = number_in(step, "z_high_mm");
            if (found == programs.end() || !low || !high) continue;
            found->second->low = *low + heights.origin_of(found->second->layer);
            found->second->high = *high + heights.origin_of(found->second->layer);
        }
    }

    [[noreturn]] void refuse_sequence(const Loaded& loaded, const std::string& why) const {
        throw Error(ErrorKind::verification, "resume.sequence", "cannot be run: " + why,
                    (out_ / loaded.file).string(), "slabwright verify OUT tells more; plan again");
    }

    /// All of it is replayed, in two parts. @returns the state between them
    [[nodiscard]] BuildState replay(const Loaded& loaded, int after) const {
        const auto done = static_cast<std::size_t>(after);
        const ReplayedBuild begun = replay_steps(loaded.build, loaded.sequence, {}, done);
        if (!begun.violations.empty()) refuse_sequence(loaded, begun.violations[0].message);
        const ReplayedBuild rest =
            replay_steps(loaded.build, loaded.sequence, begun.state, loaded.sequence.steps.size());
        if (!rest.violations.empty()) refuse_sequence(loaded, rest.violations[0].message);
        return begun.state;
    }

    /// Programs that face layers off and have not run yet, held again against what they may do: somebody may
    /// have changed them since they were written.
    void prove_left(const BuildState& state) const {
        const std::vector<SequenceStep>& steps = in_force_.sequence.steps;
        const BuildPlan& build = in_force_.build;
        BuildState before = state;
        for (std::size_t i = state.done; i < steps.size(); ++i) {
            if (steps[i].action != "face_off") continue;
            before = replay_steps(build, in_force_.sequence, before, i).state;
            for (const Program& program : in_force_.face_offs) {
                if (program.file != *word_in(steps[i], "program")) continue;
                const PlannedBuild planned(build);
                const Tool* tool = planned.tool_of(program.tool);  // the replay has found it
                const BlockToFaceOff block{build.stock_min, build.stock_max,
                                           build.layers[static_cast<std::size_t>(program.layer)].z_bottom,
                                           planned.stack_top(before), face_step(build.job, *tool)};
                std::vector<Violation> found = check_face_off(program, *tool, block);
                if (found.empty()) found = entered_keep_outs(program, block.top);
                if (found.empty()) continue;
                throw Error(ErrorKind::verification, "resume.program", found[0].message,
                            fmt::format("{}:{}", (out_ / program.file).string(), found[0].line),
                            "put the program back as it was written, or move progress.json and its folder "
                            "away and remake the layer again");
            }
        }
    }

    /// What of the table a program that faces a layer off runs into. @param top mm, what the layer stands up
    /// to
    [[nodiscard]] std::vector<Violation> entered_keep_outs(const Program& program, double top) const {
        SimulationInput input = folder_.simulation;
        SimulatedLayer& layer = input.layers[static_cast<std::size_t>(program.layer)];
        layer.slab_thickness = top - layer.z_bottom;
        input.programs = {program};
        return check_keep_outs(context_, input, folder_.build.zero);
    }

    void read_progress() {
        progress_.plan_sha256 = digest(folder_.document);
        std::error_code error;
        if (!fs::exists(out_ / kProgress, error)) {
            // Nothing was written down, or somebody has moved it away: what was made last is in force.
            if (const int last = last_folder(out_); last > 0)
                progress_.sequence = folder_name(last) + "/sequence.json";
            in_force_ = load(progress_.sequence);
            progress_.sequence_sha256 = in_force_.sha256;
            return;
        }
        known_ = true;
        text_ = read_document(out_ / kProgress, ErrorKind::input, "resume.progress",
                              "move it away, and say --after the last step that was finished");
        const BuildProgress read = parse_progress(text_, place_);
        if (read.plan_sha256 != progress_.plan_sha256)
            throw Error(ErrorKind::input, "resume.other_plan", "tells of another plan than plan.json", place_,
                        "put back the plan.json that is being built, or move this file away to begin anew");
        const bool own = read.sequence == "sequence.json";
        if (!own &&
            !(folder_number(read.sequence.substr(0, 10)) > 0 &&
              read.sequence.substr(std::min<std::size_t>(10, read.sequence.size())) == "/sequence.json"))
            throw Error(ErrorKind::input, "resume.progress", "names a sequence that is none of this folder's",
                        place_, "move it away, and say --after the last step that was finished");
        progress_ = read;
        in_force_ = load(read.sequence);
        if (read.sequence_sha256 != in_force_.sha256)
            throw Error(ErrorKind::input, "resume.other_sequence",
                        fmt::format("was written for other steps than {} has now", read.sequence), place_,
                        "put the sequence back, or move this file away and say --after by the steps of now");
    }

    void check_state(const BuildState& state) const {
        const BuildState told = parse_progress_state(text_, in_force_.build, in_force_.sequence, place_);
        if (told == state) return;
        throw Error(
            ErrorKind::input, "resume.state",
            fmt::format("its state is not what {} brings about by step {}", in_force_.file, progress_.after),
            place_, "look which step was finished last, and say --after that one");
    }

    void write_progress() const {
        write_file_in(out_, kProgress, progress_json(progress_, in_force_.build, in_force_.sequence));
    }

    /// Plans a layer once more, and has the sequence that makes it in force. Nothing is written.
    RemadeFolder remake() {
        const Loaded own = load("sequence.json");
        const int number = last_folder(out_) + 1;
        if (number > kMostFolders)
            throw Error(ErrorKind::usage, "resume.folders", "holds as many remade layers as it can",
                        out_.string(), "plan again");
        const std::string name = folder_name(number);
        const Remake made = remake_layer(context_, {folder_.build, in_force_.sequence, own.sequence,
                                                    progress_.state, *options_.remake, name + "/nc/"});
        Loaded remade;
        remade.file = name + "/sequence.json";
        remade.sequence = in_force_.sequence;
        remade.sequence.steps = made.steps;
        RemadeFolder folder{name, {}, {}, sequence_json(remade.sequence)};
        remade.sha256 = digest(folder.sequence);
        remade.sequence = read_sequence(folder.sequence);
        remade.build = in_force_.build;
        remade.face_offs = in_force_.face_offs;
        for (std::size_t k = 0; k < made.layers.size(); ++k) {
            const Layer& layer = made.plan.layers[made.layers[k]];
            folder.texts.push_back(program_text(made.plan, layer, layer.operations[0]));
            folder.files.push_back(name + "/nc/" + layer.operations[0].file);
            remade.face_offs.push_back(prove(made, k, folder.texts.back(), folder.files.back()));
            remade.build.face_offs.push_back(planned(remade.face_offs.back()));
        }
        progress_.state = replay_remade(remade);
        in_force_ = std::move(remade);
        progress_.sequence = in_force_.file;
        progress_.sequence_sha256 = in_force_.sha256;
        known_ = true;
        return folder;
    }

    /// All of it, or nothing.
    void write_remade(const RemadeFolder& remade) const {
        OutputFolder folder((out_ / remade.name).string());
        make_output_directory((folder.path() / "nc").string());
        for (std::size_t k = 0; k < remade.texts.size(); ++k)
            write_file_in(folder.path() / "nc", fs::path(remade.files[k]).filename().string(),
                          remade.texts[k]);
        write_file_in(folder.path(), "sequence.json", remade.sequence);
        folder.commit();
        try {
            write_progress();
        } catch (...) {  // the sequence before stays in force
            std::error_code ignored;
            fs::remove_all(out_ / remade.name, ignored);
            throw;
        }
    }

    [[noreturn]] void refuse_remake(const Violation& v) const {
        throw Error(ErrorKind::no_plan, "resume.remake", v.message,
                    v.file + (v.line > 0 ? fmt::format(":{}", v.line) : ""),
                    "face this layer off by hand, or plan again");
    }

    /// Reads a program back and holds it against what it may do. @param k which of those made
    [[nodiscard]] Program prove(const Remake& made, std::size_t k, const std::string& text,
                                const std::string& file) const {
        const Layer& layer = made.plan.layers[made.layers[k]];
        const Operation& operation = layer.operations[0];
        Program program = face_off_of(text, file, made.layers[k]);
        const Tool* tool = PlannedBuild(folder_.build).tool_of(program.tool);
        ProgramPlan sayings;
        sayings.spindle_rpm = operation.spindle_rpm;
        sayings.blend = operation.blend;
        std::vector<Violation> found = check_program(program, sayings, tool, folder_.build.job.machine);
        if (!found.empty()) refuse_remake(found[0]);
        found = check_face_off(
            program, *tool,
            {made.plan.stock_min, made.plan.stock_max, layer.z_bottom, made.tops[k], made.most_mm});
        if (found.empty()) found = entered_keep_outs(program, made.tops[k]);
        if (!found.empty()) refuse_remake(found[0]);
        return program;
    }

    /// From its first step to its end. @returns the state in which the build is now
    [[nodiscard]] BuildState replay_remade(const Loaded& remade) const {
        const ReplayedBuild begun =
            replay_steps(remade.build, remade.sequence, {}, static_cast<std::size_t>(progress_.after));
        if (!begun.violations.empty()) refuse_remake(begun.violations[0]);
        const ReplayedBuild rest =
            replay_steps(remade.build, remade.sequence, begun.state, remade.sequence.steps.size());
        if (!rest.violations.empty()) refuse_remake(rest.violations[0]);
        return begun.state;
    }

    Context& context_;
    const fs::path out_;
    const ResumeOptions& options_;
    const PlannedFolder folder_;
    const std::string place_;  // of progress.json
    std::string text_;         // of progress.json
    bool known_ = false;       // there is a progress.json
    BuildProgress progress_;
    Loaded in_force_;
};

}  // namespace

ResumeStatus resume_build(Context& context, const std::string& directory, const ResumeOptions& options) {
    return guarded([&] { return Resumption(context, directory, options).run(); });
}

}  // namespace slabwright
