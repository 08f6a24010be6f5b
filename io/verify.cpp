#include "io/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <nlohmann/json.hpp>
#include <set>

#include "io/posts/program_check.h"
#include "io/posts/tool_table_check.h"
#include "io/read/input_file.h"
#include "io/read/sequence_reader.h"
#include "io/text/job_keys.h"
#include "io/write/output_file.h"
#include "io/write/verify_json.h"
#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr double kArcShare = 0.05;       // of the gouge tolerance, by which an arc may miss its chords
constexpr double kLevelArcError = 0.01;  // mm: what must be nearer to a level arc takes the arc itself

std::string read_file(const fs::path& path, const char* code, std::uint64_t most_bytes) {
    return read_whole(path, {ErrorKind::verification, code, most_bytes, "plan again"});
}

/// A value of plan.json with the way to it, so that what is missing can be named.
class Field {
public:
    Field(const json& value, std::string way, const std::string& file)
        : value_(value), way_(std::move(way)), file_(file) {}

    [[nodiscard]] Field operator[](const char* key) const {
        if (!value_.is_object() || !value_.contains(key)) fail(way_ + "." + key, "is missing");
        return {value_.at(key), way_ + "." + key, file_};
    }
    [[nodiscard]] bool has(const char* key) const {
        return value_.is_object() && value_.contains(key) && !value_.at(key).is_null();
    }
    [[nodiscard]] Field operator[](std::size_t i) const {
        if (!value_.is_array() || i >= value_.size())
            fail(way_ + "[" + std::to_string(i) + "]", "is missing");
        return {value_.at(i), way_ + "[" + std::to_string(i) + "]", file_};
    }
    [[nodiscard]] std::size_t size() const {
        if (!value_.is_array()) fail(way_, "is no list");
        return value_.size();
    }
    [[nodiscard]] double number() const {
        if (!value_.is_number()) fail(way_, "is no number");
        const double v = value_.get<double>();
        if (!std::isfinite(v)) fail(way_, "is not finite");
        return v;
    }
    [[nodiscard]] int whole() const {
        if (!value_.is_number_integer() || std::abs(number()) > 1e9) fail(way_, "is no whole number");
        return value_.get<int>();
    }
    [[nodiscard]] bool boolean() const {
        if (!value_.is_boolean()) fail(way_, "is neither true nor false");
        return value_.get<bool>();
    }
    [[nodiscard]] std::string text() const {
        if (!value_.is_string()) fail(way_, "is no text");
        return value_.get<std::string>();
    }
    [[noreturn]] void fail(const std::string& way, const std::string& what) const {
        throw Error(ErrorKind::verification, "verify.plan", way + " " + what, file_, "plan again");
    }
    [[noreturn]] void fail(const std::string& what) const { fail(way_, what); }

private:
    const json& value_;
    std::string way_;
    const std::string& file_;
};

template <class Enum, std::size_t N>
Enum enumerator(const Word<Enum> (&words)[N], const Field& field) {
    const std::string text = field.text();
    for (const Word<Enum>& word : words)
        if (text == word.text) return word.value;
    field.fail("says \"" + text + "\", which is none of its words");
}

OperationKind operation_kind(const Field& field) {
    const std::string text = field.text();
    for (const OperationKind kind :
         {OperationKind::face, OperationKind::rough, OperationKind::semi_rough, OperationKind::finish,
          OperationKind::corner, OperationKind::drill, OperationKind::edge})
        if (text == name(kind)) return kind;
    field.fail("says \"" + text + "\", which is no kind of operation");
}

Tool read_tool(const Field& t) {
    Tool tool;
    tool.number = t["number"].whole();
    tool.kind = enumerator(kToolWords, t["kind"]);
    tool.diameter = t["diameter"].number();
    tool.flute_length = t["flute_length"].number();
    tool.shank_diameter = t["shank_diameter"].number();
    tool.holder_diameter = t["holder"]["diameter"].number();
    tool.stickout = t["holder"]["stickout"].number();
    if (!(tool.diameter > 0)) t["diameter"].fail("is no diameter");
    if (t.has("name")) tool.name = t["name"].text();
    if (t.has("max_rpm")) tool.max_rpm = t["max_rpm"].number();
    if (t.has("max_feed")) tool.max_feed = t["max_feed"].number();
    tool.plunges = t.has("plunges") ? t["plunges"].boolean() : plunges_by_default(tool.kind);
    if (t.has("core_diameter")) tool.core_diameter = t["core_diameter"].number();
    if (t.has("ramp_deg")) tool.ramp_deg = t["ramp_deg"].number();
    if (tool.core_diameter >= tool.diameter) t["core_diameter"].fail("is no less than the diameter");
    if (tool.ramp_deg > 90) t["ramp_deg"].fail("is no slope");
    return tool;
}

/// What of the job the simulation needs. A plan without a job is judged by the defaults.
struct JobPart {
    Job job;
    bool stated = false;
};
JobPart read_job_part(const Field& plan) {
    JobPart part;
    if (!plan.has("job")) return part;
    part.stated = true;
    const Field job = plan["job"];
    part.job.units = enumerator(kUnitWords, job["units"]);
    if (job.has("input")) part.job.input.repair = enumerator(kRepairWords, job["input"]["repair"]);
    const Field machine = job["machine"], tolerances = job["tolerances"];
    Machine& m = part.job.machine;
    for (const auto& [key, to] : {std::pair{"travel_x", &m.travel_x},
                                  {"travel_y", &m.travel_y},
                                  {"travel_z", &m.travel_z},
                                  {"max_feed", &m.max_feed},
                                  {"rapid_feed", &m.rapid_feed},
                                  {"acceleration", &m.acceleration},
                                  {"max_rpm", &m.max_rpm},
                                  {"spindle_dwell_s", &m.spindle_dwell_s},
                                  {"tool_change_s", &m.tool_change_s},
                                  {"table_speed", &m.table_speed},
                                  {"build_height", &m.build_height},
                                  {"build_mass_kg", &m.build_mass_kg},
                                  {"feed_height", &m.feed_height},
                                  {"feed_mass_kg", &m.feed_mass_kg},
                                  {"base_board_thickness", &m.base_board_thickness},
                                  {"base_board_cut", &m.base_board_cut}}) {
        *to = machine[key].number();
    }
    if (!(m.acceleration > 0) || !(m.rapid_feed > 0) || !(m.max_feed > 0))
        machine.fail("states a machine that does not move");
    m.table = enumerator(kTableWords, machine["table"]);
    part.job.material.name = job["material"]["name"].text();
    part.job.material.density_kg_m3 = job["material"]["density_kg_m3"].number();
    const Field bonding = job["bonding"];
    Bonding& b = part.job.bonding;
    b.glue = bonding["glue"].text();
    for (const auto& [key, to] : {std::pair{"press_force", &b.press_force},
                                  {"press_time_s", &b.press_time_s},
                                  {"edge_setback", &b.edge_setback},
                                  {"handling_s", &b.handling_s},
                                  {"glue_s_per_m2", &b.glue_s_per_m2}})
        *to = bonding[key].number();
    part.job.tolerances.gouge = tolerances["gouge"].number();
    part.job.tolerances.cusp = tolerances["cusp"].number();
    part.job.tolerances.weld = tolerances["weld"].number();
    return part;
}

std::vector<Support> read_supports(const Field& plan) {
    std::vector<Support> supports;
    if (!plan.has("supports")) return supports;
    const Field all = plan["supports"];
    for (std::size_t i = 0; i < all.size(); ++i) {
        const Field s = all[i];
        supports.push_back({s["layer"].whole(), s["x"].number(), s["y"].number(), s["width"].number(),
                            s["z_low"].number(), s["z_high"].number()});
        const Support& read = supports.back();
        for (const double v : {read.x, read.y, read.width, read.z_low, read.z_high})
            if (std::abs(v) > 200000) s.fail("reaches beyond 200 m");
        if (!(read.width > 0) || !(read.z_high > read.z_low) || read.z_low < 0) s.fail("is no column");
    }
    return supports;
}

/// What an operation of plan.json says of its program.
ProgramPlan read_program_plan(const Field& op) {
    ProgramPlan planned;
    if (op.has("spindle_rpm")) planned.spindle_rpm = op["spindle_rpm"].number();
    if (op.has("blend")) planned.blend = op["blend"].number();
    if (op.has("feeds")) {
        const Field feeds = op["feeds"];
        planned.feeds.emplace();
        for (std::size_t i = 0; i < feeds.size(); ++i) {
            FeedLength f{feeds[i]["feed"].number(), feeds[i]["mm"].number(), {}};
            for (std::size_t k = 0; k < 3; ++k) f.moment[k] = f.mm * feeds[i]["centre"][k].number();
            add_length(*planned.feeds, f);
        }
    }
    return planned;
}

/// Closed polygons as plan.json writes them.
void add_polygon(Loops& loops, const Field& polygon) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const double x = polygon[i][std::size_t{0}].number(), y = polygon[i][std::size_t{1}].number();
        if (std::abs(x) > 200000 || std::abs(y) > 200000) polygon.fail("reaches beyond 200 m");
        loops.points.push_back({to_units(x), to_units(y)});
    }
    loops.close_loop();
}

/// What the sequence has to build, by plan.json and the programs that were read.
BuildPlan planned_build(const Field& plan, const JobPart& part, Frame frame, const SimulationInput& input) {
    BuildPlan build;
    build.job = part.job;
    build.job_stated = part.stated;
    build.frame = frame;
    build.pattern = plan["input"]["file"].text();
    build.sha256 = plan["input"]["sha256"].text();
    build.stock_min = input.stock_min, build.stock_max = input.stock_max;
    build.tools = input.tools;
    build.flask = plan.has("flask");
    if (build.flask && plan["flask"].has("mass_kg")) build.flask_mass_kg = plan["flask"]["mass_kg"].number();
    if (build.flask && plan.has("totals")) {
        const double slab =
            (input.stock_max[0] - input.stock_min[0]) * (input.stock_max[1] - input.stock_min[1]);
        double opening = 0;
        for (const SimulatedLayer& layer : input.layers)
            opening += (slab - area(layer.flask)) * (layer.z_top - layer.z_bottom);
        build.sand_litres = std::max(0.0, opening - plan["totals"]["part_volume_mm3"].number()) * 1e-6;
    }
    std::map<std::string, std::array<double, 2>> heights;  // of the programs
    for (const Program& program : input.programs) {
        std::array<double, 2>& z = heights["nc/" + program.file] = {INFINITY, -INFINITY};
        for (const ProgramStep& step : program.steps)
            if (std::isfinite(step.z)) z = {std::min(z[0], step.z), std::max(z[1], step.z)};
    }
    const Field layers = plan["layers"];
    for (std::size_t l = 0; l < layers.size(); ++l) {
        const Field from = layers[l];
        LayerToBuild& layer = build.layers.emplace_back();
        layer.index = from["index"].whole();
        layer.z_bottom = from["z_bottom"].number(), layer.z_top = from["z_top"].number();
        layer.slab_thickness = from["slab_thickness"].number();
        if (from.has("slabs")) layer.slabs = from["slabs"].whole();
        if (layer.slabs < 1 || layer.slabs > 1000) from["slabs"].fail("is no count of slabs");
        const auto joint = [](const Field& of) {
            PlannedJoint planned;
            if (of.has("glue_area_mm2")) planned.glue_area_mm2 = of["glue_area_mm2"].number();
            if (of.has("press_force_n")) planned.press_force_n = of["press_force_n"].number();
            return planned;
        };
        if (from.has("joints"))
            for (std::size_t k = 0; k < from["joints"].size(); ++k)
                layer.joints.push_back(joint(from["joints"][k]));
        const Field operations = from["operations"];
        for (std::size_t o = 0; o < operations.size(); ++o) {
            const Field op = operations[o];
            PlannedProgram& program = build.programs.emplace_back();
            program.file = op["file"].text();
            if (!program.file.starts_with("nc/")) program.file.insert(0, "nc/");
            program.layer = l;
            program.kind = operation_kind(op["kind"]);
            program.tool = op["tool"].whole();
            if (op.has("purpose")) program.purpose = op["purpose"].text();
            if (op.has("minutes")) program.minutes = op["minutes"].number();
            if (const auto z = heights.find(program.file); z != heights.end() && z->second[0] <= z->second[1])
                program.low = z->second[0], program.high = z->second[1];
        }
    }
    return build;
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

GcodeLimits gcode_limits(const Tolerances& tolerances) {
    GcodeLimits limits;
    // Beside kSheet, by which depths may be short, half of that does no harm; twice as near would need 1.4
    // times the chords.
    limits.arc_error = std::clamp(kArcShare * tolerances.gouge, 1e-5, StandingPart::kSheet / 2);
    limits.level_arc_error = kLevelArcError;
    return limits;
}

Verification verify_folder(Context& context, const std::string& directory, const VerifyOptions& options) {
    const fs::path out(directory);
    const std::string plan_path = (out / "plan.json").string();
    json document;
    try {
        document =
            json::parse(read_document(plan_path, ErrorKind::verification, "verify.plan", "plan again"));
    } catch (const json::exception& e) {
        throw Error(ErrorKind::verification, "verify.plan", std::string("is no JSON: ") + e.what(), plan_path,
                    "plan again");
    }
    const Field plan(document, "plan", plan_path);
    if (plan["schema"].text() != "slabwright.plan/1") plan["schema"].fail("is not slabwright.plan/1");
    if (plan["units"].text() != "mm") plan["units"].fail("is not mm");
    const Frame frame = enumerator(kFrameWords, plan["frame"]);
    if (frame == Frame::automatic) plan["frame"].fail("names no frame");
    const JobPart part = read_job_part(plan);

    const GcodeLimits limits = gcode_limits(part.job.tolerances);

    Verification result;
    SimulationInput& input = result.input;
    std::vector<Violation> violations;
    input.machine = part.job.machine;
    for (int k = 0; k < 2; ++k)
        input.stock_min[k] = plan["stock"]["min"][static_cast<std::size_t>(k)].number(),
        input.stock_max[k] = plan["stock"]["max"][static_cast<std::size_t>(k)].number();
    const Field tools = plan["tools"];
    for (std::size_t i = 0; i < tools.size(); ++i) input.tools.push_back(read_tool(tools[i]));
    const fs::path table = out / "tool.tbl";
    violations = check_tool_table(read_file(table, "verify.tool_table", kMostToolTableBytes), table.string(),
                                  input.tools);

    const Field layers = plan["layers"];
    std::set<std::string> planned;
    std::vector<ProgramPlan> sayings;  // of input.programs
    std::string last;
    for (std::size_t l = 0; l < layers.size(); ++l) {
        const SimulatedLayer layer{layers[l]["z_bottom"].number(), layers[l]["z_top"].number(),
                                   layers[l]["slab_thickness"].number()};
        input.layers.push_back(layer);
        if (plan.has("flask")) {
            const Field flask = plan["flask"];
            Loops outer, inner;
            add_polygon(outer, flask["outer"]);
            add_polygon(inner, flask.has("inner_by_layer") ? flask["inner_by_layer"][l] : flask["inner"]);
            input.layers.back().flask = subtract(outer, inner);
        }
        const Field operations = layers[l]["operations"];
        for (std::size_t o = 0; o < operations.size(); ++o) {
            const Field op = operations[o];
            std::string file = op["file"].text();
            if (file.rfind("nc/", 0) == 0) file.erase(0, 3);
            if (file.empty() || file.find('/') != std::string::npos || file.find("..") != std::string::npos)
                op["file"].fail("is no file of nc/");
            if (!planned.insert(file).second) op["file"].fail("names a program a second time");
            if (file <= last)
                violations.push_back({"program.order",
                                      "its name sorts before that of the program before it, " + last,
                                      file,
                                      0,
                                      {},
                                      0});
            last = file;
            const fs::path path = out / "nc" / file;
            if (std::error_code ignored; !fs::exists(path, ignored)) {
                violations.push_back(
                    {"program.missing", "plan.json names it, nc/ does not hold it", file, 0, {}, 0});
                continue;
            }
            Program program;
            program.file = file;
            program.layer = static_cast<int>(l);
            program.kind = operation_kind(op["kind"]);
            program.planned_tool = op["tool"].whole();
            if (op.has("stepdown")) program.planned_stepdown = op["stepdown"].number();
            input.programs.push_back(std::move(program));
            sayings.push_back(read_program_plan(op));
        }
    }
    std::vector<std::vector<Violation>> of_programs(input.programs.size());
    parallel_each(context, input.programs.size(), [&](std::size_t i) {
        Program& program = input.programs[i];
        Program read = read_gcode(read_file(out / "nc" / program.file, "verify.program", kMostProgramBytes),
                                  "nc/" + program.file, limits);
        // Programs count from the top in whole 0.1 µm, as they were written.
        const double up = frame == Frame::layer_top
                              ? to_mm(to_units(input.layers[static_cast<std::size_t>(program.layer)].z_top))
                              : 0;
        for (ProgramStep& s : read.steps) s.z += up;
        for (ProgramArc& a : read.arcs) a.arc.z += up;
        read.file = program.file, read.layer = program.layer, read.kind = program.kind;
        read.planned_tool = program.planned_tool, read.planned_stepdown = program.planned_stepdown;
        program = std::move(read);
        const auto tool = std::find_if(input.tools.begin(), input.tools.end(),
                                       [&](const Tool& t) { return t.number == program.tool; });
        of_programs[i] =
            check_program(program, sayings[i], tool == input.tools.end() ? nullptr : &*tool, input.machine);
    });
    for (const std::vector<Violation>& found : of_programs)
        violations.insert(violations.end(), found.begin(), found.end());
    if (std::error_code ignored; fs::is_directory(out / "nc", ignored)) {
        std::vector<std::string> strangers;
        for (const auto& entry : fs::directory_iterator(out / "nc"))
            if (const std::string file = entry.path().filename().string(); !planned.contains(file))
                strangers.push_back(file);
        std::sort(strangers.begin(), strangers.end());
        for (const std::string& file : strangers)
            violations.push_back(
                {"program.unplanned", "nc/ holds it, plan.json does not name it", file, 0, {}, 0});
    }

    check_sequence(out / "sequence.json", planned_build(plan, part, frame, input), violations);

    const PlannedPattern planned_pattern{plan["input"]["file"].text(),
                                         plan["input"]["sha256"].text(),
                                         {part.job.units, part.job.tolerances.weld, part.job.input.repair},
                                         read_supports(plan)};
    result.pattern =
        options.pattern && options.pattern->is(planned_pattern)
            ? propped(context, options.pattern, planned_pattern.supports)
            : read_planned_pattern(context, directory, planned_pattern, options.source, "verify");
    Pattern& pattern = *result.pattern;
    input.mesh = pattern.read.mesh.view();
    if (!pattern.part) pattern.part.emplace(context, input.mesh);

    SimulationOptions simulation;
    simulation.cell = options.cell;
    simulation.maps = options.maps || !options.maps_directory.empty();
    simulation.faults = options.faults;
    simulation.gouge = part.job.tolerances.gouge;
    simulation.cusp = part.job.tolerances.cusp;
    simulation.board_cut = part.job.machine.base_board_cut;
    if (simulation.board_cut < 0) {
        // As deep as a ball end mill may pass the bottom: its radius.
        simulation.board_cut = 0;
        for (const Tool& tool : input.tools)
            if (tool.kind == ToolKind::ball)
                simulation.board_cut = std::max(simulation.board_cut, tool.diameter / 2);
    }
    simulation.board_cut = std::min(simulation.board_cut, part.job.machine.base_board_thickness);
    result.report = simulate(context, input, *pattern.part, simulation, options.memory);
    MissingToolOptions asked{part.job.units == LengthUnit::inch, simulation.cusp + simulation.slack,
                             simulation.board_cut};
    asked.cusp = asked.bends = simulation.cusp;
    if (part.stated && plan["job"].has("cutting")) {
        asked.holder_clearance = plan["job"]["cutting"]["holder_clearance"].number();
        asked.vertical_rad = plan["job"]["cutting"]["vertical_deg"].number() * std::numbers::pi / 180;
    }
    result.missing = missing_tools(context, input, result.report, *pattern.part, asked);
    input.mesh = {};
    result.report.violations.insert(result.report.violations.begin(), violations.begin(), violations.end());
    result.json = verify_json(input, result.report, simulation, fs::path(pattern.place).filename().string(),
                              part.stated, result.missing);

    if (!options.maps_directory.empty()) write_maps(result.report, options.maps_directory);
    if (options.write) write_file_in(out, "verify.json", result.json);
    return result;
}

}  // namespace slabwright
