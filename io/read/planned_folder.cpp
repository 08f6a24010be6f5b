#include "io/read/planned_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <span>

#include "io/read/input_file.h"
#include "io/read/own_post.h"
#include "io/text/job_keys.h"
#include "io/text/json_text.h"
#include "io/text/sha256.h"

namespace slabwright {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr double kArcShare = 0.05;       // of the gouge tolerance, by which an arc may miss its chords
constexpr double kLevelArcError = 0.01;  // mm: what must be nearer to a level arc takes the arc itself

struct Refuse {
    const FolderRefusal& how;
    const std::string& file;
    [[noreturn]] void because(const std::string& what) const {
        throw Error(how.kind, how.plan, quoting_line(what), file, "plan again");
    }
};

/// A value of plan.json with the way to it, so that what is missing can be named.
class Field {
public:
    Field(const json& value, std::string way, const Refuse& refuse)
        : value_(value), way_(std::move(way)), refuse_(refuse) {}

    [[nodiscard]] Field operator[](const char* key) const {
        if (!value_.is_object() || !value_.contains(key)) fail(way_ + "." + key, "is missing");
        return {value_.at(key), way_ + "." + key, refuse_};
    }
    [[nodiscard]] bool has(const char* key) const {
        return value_.is_object() && value_.contains(key) && !value_.at(key).is_null();
    }
    [[nodiscard]] Field operator[](std::size_t i) const {
        if (!value_.is_array() || i >= value_.size())
            fail(way_ + "[" + std::to_string(i) + "]", "is missing");
        return {value_.at(i), way_ + "[" + std::to_string(i) + "]", refuse_};
    }
    [[nodiscard]] std::size_t size() const {
        if (!value_.is_array()) fail(way_, "is no list");
        return value_.size();
    }
    void numbers(std::vector<double>& all) const {
        all.clear();
        for (std::size_t i = 0; i < size(); ++i) all.push_back((*this)[i].number());
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
        refuse_.because(way + " " + what);
    }
    [[noreturn]] void fail(const std::string& what) const { fail(way_, what); }

private:
    const json& value_;
    std::string way_;
    const Refuse& refuse_;
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
    for (int k = 0; k <= static_cast<int>(OperationKind::edge); ++k)
        if (const auto kind = static_cast<OperationKind>(k); text == name(kind)) return kind;
    field.fail("says \"" + text + "\", which is no kind of operation");
}

Tool read_tool(const Field& t) {
    Tool tool;
    tool.number = t["number"].whole();
    tool.kind = enumerator(kToolWords, t["kind"]);
    if (tool.diameter = t["diameter"].number(); !(tool.diameter > 0)) t["diameter"].fail("is no diameter");
    tool.flute_length = t["flute_length"].number();
    tool.shank_diameter = t["shank_diameter"].number();
    tool.holder_diameter = t["holder"]["diameter"].number();
    tool.stickout = t["holder"]["stickout"].number();
    if (t.has("name")) tool.name = t["name"].text();
    if (t.has("flutes")) tool.flutes = t["flutes"].whole();
    if (t.has("helix_deg")) tool.helix_rad = t["helix_deg"].number() * std::numbers::pi / 180;
    const auto given = [&](const char* key, double& into) {
        if (t.has(key)) into = t[key].number();
    };
    given("max_rpm", tool.max_rpm), given("max_feed", tool.max_feed), given("plunge_feed", tool.plunge_feed);
    given("stepover", tool.stepover), given("core_diameter", tool.core_diameter);
    given("strength_mpa", tool.strength_mpa), given("modulus_gpa", tool.modulus_gpa);
    given("ramp_deg", tool.ramp_deg), given("corner_radius", tool.corner_radius);
    given("taper_deg", tool.taper_deg), given("point_deg", tool.point_deg);
    tool.plunges = t.has("plunges") ? t["plunges"].boolean() : plunges_by_default(tool.kind);
    if (t.has("stepdown")) {
        tool.stepdown_min = t["stepdown"][std::size_t{0}].number();
        tool.stepdown_max = t["stepdown"][std::size_t{1}].number();
    }
    if (!(tool.modulus_gpa > 0)) t["modulus_gpa"].fail("is not positive");
    if (t["holder"].has("profile")) t["holder"]["profile"].numbers(tool.holder_profile);
    if (!has_flank_and_holder(tool)) t["kind"].fail("has a flank or a holder that can be none");
    if (has_corner(tool.kind) && !(tool.corner_radius > 0 && tool.corner_radius < tool.diameter / 2))
        t["corner_radius"].fail(fmt::format("is no corner of a {}", word_of(kToolWords, tool.kind)));
    if (tool.core_diameter >= tool.diameter) t["core_diameter"].fail("is no less than the diameter");
    if (tool.ramp_deg > 90) t["ramp_deg"].fail("is no slope");
    return tool;
}

/// Takes the keys of one table of the job that plan.json states; the others keep their default.
class StatedKeys {
public:
    bool own_post = false;  ///< machine.post is the folder's file
    explicit StatedKeys(const Field& job) : job_(job), table_(job) {}
    void table(const char* name, const char*) {
        stated_ = job_.has(name);
        if (stated_) table_.emplace(job_[name]);
    }
    void required() {}
    void key(const char* name, double& value, const char*) {
        if (has(name)) value = (*table_)[name].number();
    }
    void key(const char* name, int& value, const char*) {
        if (has(name)) value = (*table_)[name].whole();
    }
    void key(const char* name, bool& value, const char*) {
        if (has(name)) value = (*table_)[name].boolean();
    }
    void key(const char* name, std::string& value, const char*) {
        if (has(name)) value = (*table_)[name].text();
    }
    void key(const char* name, std::vector<double>& values, const char*) {
        if (has(name)) (*table_)[name].numbers(values);
    }
    void key(const char* name, std::vector<std::array<double, 2>>& points, const char*) {
        if (!has(name)) return;
        const Field list = (*table_)[name];
        points.clear();
        for (std::size_t i = 0; i < list.size(); ++i)
            points.push_back({list[i][std::size_t{0}].number(), list[i][std::size_t{1}].number()});
    }
    void degrees(const char* name, double& radians, const char*) {
        if (has(name)) radians = (*table_)[name].number() * std::numbers::pi / 180;
    }
    template <std::size_t N>
    void word(const char* name, Post& value, const Word<Post> (&words)[N], const char*) {
        if (!has(name)) return;
        own_post = (*table_)[name].text() == kOwnPostFile;
        if (!own_post) value = enumerator(words, (*table_)[name]);
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum& value, const Word<Enum> (&words)[N], const char*) {
        if (has(name)) value = enumerator(words, (*table_)[name]);
    }

private:
    [[nodiscard]] bool has(const char* name) const { return stated_ && table_->has(name); }
    const Field& job_;
    std::optional<Field> table_;
    bool stated_ = true;
};

/// The post of the user's own that lies beside plan.json, with the very bytes that it was planned with.
void read_post(const Field& plan, const fs::path& out, const FolderRefusal& refusal, Machine& machine) {
    const fs::path file = out / kOwnPostFile;
    const std::string sha256_planned = plan["post"]["sha256"].text(),
                      text = read_whole(file, {refusal.kind, refusal.post, kMostPostBytes,
                                               "put it back as it was written, or plan again"});
    if (sha256(std::as_bytes(std::span(text))) != sha256_planned)
        throw Error(refusal.kind, refusal.post, "is not the post that the programs were written with",
                    file.string(), "put it back as it was written, or plan again");
    try {
        const std::shared_ptr<const OwnDialect> post = parse_own_post(text, file.string());
        machine.post = post->base;
        machine.own_post = post;
    } catch (const Error& error) {
        throw Error(refusal.kind, refusal.post, error.message(), error.place(), error.remedy());
    }
}

/// The job that a plan states. What the proof cannot do without must be there.
/// @returns whether its post is a file of the folder
bool read_job(const Field& job, BuildPlan& build) {
    build.job_stated = true;
    StatedKeys keys(job);
    visit_job_keys(build.job, keys);
    (void)job["units"];
    for (const char* key :
         {"travel_x", "travel_y", "travel_z", "max_feed", "rapid_feed", "acceleration", "max_rpm",
          "spindle_dwell_s", "tool_change_s", "table_speed", "build_height", "build_mass_kg", "feed_height",
          "feed_mass_kg", "base_board_thickness", "base_board_cut", "table"})
        (void)job["machine"][key];
    for (const char* key : {"name", "density_kg_m3"}) (void)job["material"][key];
    for (const char* key :
         {"glue", "press_force", "press_time_s", "edge_setback", "handling_s", "glue_s_per_m2"})
        (void)job["bonding"][key];
    if (!job["machine"].has("glue_head")) {  // planned by a version that knew no such thing
        build.job.machine.handler_speed = 0;
        build.job.machine.glue_head = GlueHead::none;
    }
    if (!job["machine"].has("press_lift")) build.job.machine.press_lift = 0;  // as above
    for (const char* key : {"gouge", "cusp", "weld"}) (void)job["tolerances"][key];
    const Machine& m = build.job.machine;
    if (!(m.glue_pitch >= 0.1) || !(m.glue_speed > 0) || !(m.handler_speed >= 0) || !(m.pump_g_min >= 0))
        job["machine"].fail("states a glue head or a handler that does not work");
    if (m.magazine < 0 || m.magazine > 1000 || !(m.magazine_swap_s >= 0))
        job["machine"].fail("states a magazine of no number of places");
    if (!(m.acceleration > 0) || !(m.rapid_feed > 0) || !(m.max_feed > 0))
        job["machine"].fail("states a machine that does not move");
    return keys.own_post;
}

/// A list that a plan may state. @param check throws Error where its entries are none
template <class Entry, class Walk>
std::vector<Entry> stated_list(const Field& plan, const char* name, void (*check)(const std::vector<Entry>&),
                               Walk&& walk) {
    std::vector<Entry> entries;
    for (std::size_t i = 0; plan.has(name) && i < plan[name].size(); ++i) {
        const Field stated = plan[name][i];
        StatedKeys keys(stated);
        walk(entries.emplace_back(), keys);
    }
    try {
        check(entries);
    } catch (const Error& error) {
        plan[name].fail("are none: " + error.message());
    }
    return entries;
}

/// How the pattern was read: as the job says, placed by the very numbers that the plan states.
ReadingOptions read_reading(const Field& input, const BuildPlan& build) {
    ReadingOptions reading = reading_options(build.job);
    if (!input.has("prepared")) return reading;
    const Field matrix = input["prepared"]["matrix"];
    for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 4; ++c) reading.preparation.map.rows[r][c] = matrix[r][c].number();
    if (reading.preparation.map.determinant() == 0) matrix.fail("flattens the pattern");
    return reading;
}

std::vector<Support> read_supports(const Field& plan) {
    std::vector<Support> supports;
    for (std::size_t i = 0; plan.has("supports") && i < plan["supports"].size(); ++i) {
        const Field s = plan["supports"][i];
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
        planned.feeds.emplace();
        for (std::size_t i = 0; i < op["feeds"].size(); ++i) {
            FeedLength f{op["feeds"][i]["feed"].number(), op["feeds"][i]["mm"].number(), {}};
            for (std::size_t k = 0; k < 3; ++k) f.moment[k] = f.mm * op["feeds"][i]["centre"][k].number();
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

void read_flask(const Field& plan, PlannedFolder& folder) {
    BuildPlan& build = folder.build;
    build.flask = plan.has("flask");
    if (!build.flask) return;
    const Field flask = plan["flask"];
    Loops outer;
    add_polygon(outer, flask["outer"]);
    std::vector<SimulatedLayer>& layers = folder.simulation.layers;
    for (std::size_t l = 0; l < layers.size(); ++l) {
        Loops inner;
        add_polygon(inner, flask.has("inner_by_layer") ? flask["inner_by_layer"][l] : flask["inner"]);
        layers[l].flask = subtract(outer, inner);
    }
    if (flask.has("mass_kg")) build.flask_mass_kg = flask["mass_kg"].number();
    if (!plan.has("totals")) return;
    const double slab = (build.stock_max[0] - build.stock_min[0]) * (build.stock_max[1] - build.stock_min[1]);
    double opening = 0;
    for (const SimulatedLayer& layer : layers)
        opening += (slab - area(layer.flask)) * (layer.z_top - layer.z_bottom);
    build.sand_litres = std::max(0.0, opening - plan["totals"]["part_volume_mm3"].number()) * 1e-6;
}

PlannedJoint read_joint(const Field& joint) {
    PlannedJoint planned;
    if (joint.has("glue_area_mm2")) planned.glue_area_mm2 = joint["glue_area_mm2"].number();
    if (joint.has("press_force_n")) planned.press_force_n = joint["press_force_n"].number();
    return planned;
}

/// Operations that share a file follow each other in it, in one layer: "#2" after "#1".
void check_part(const Field& op, const std::set<std::string>& named, const PlannedProgram& program) {
    const int part = part_of(program.file);
    const std::string file(file_of(program.file));
    if (part < 0) op["file"].fail("has no number after its #");
    if (part > 1 && !named.contains(fmt::format("{}#{}", file, part - 1)))
        op["file"].fail(fmt::format("comes before the part {} of its program", part - 1));
    if (named.contains(file) && part > 0) op["file"].fail("is a part of a program that has none");
}

void read_operation(const Field& op, std::size_t layer, std::set<std::string>& named, PlannedFolder& folder) {
    PlannedProgram& program = folder.build.programs.emplace_back();
    program.file = op["file"].text();
    if (!program.file.starts_with("nc/")) program.file.insert(0, "nc/");
    if (program.file.size() == 3 || program.file.find('/', 3) != std::string::npos ||
        program.file.find("..") != std::string::npos)
        op["file"].fail("is no file of nc/");
    if (!named.insert(program.file).second) op["file"].fail("names a program a second time");
    check_part(op, named, program);
    program.layer = layer;
    if (const std::size_t n = folder.build.programs.size(); part_of(program.file) > 1) {
        const PlannedProgram& before = folder.build.programs[n - 2];
        if (file_of(before.file) != file_of(program.file) || before.layer != layer)
            op["file"].fail("does not follow the operation before it in its program");
    }
    program.kind = operation_kind(op["kind"]);
    program.tool = op["tool"].whole();
    if (op.has("purpose")) program.purpose = op["purpose"].text();
    if (op.has("minutes")) program.minutes = op["minutes"].number();
    folder.sayings.push_back(read_program_plan(op));
    folder.stepdowns.push_back(op.has("stepdown") ? std::optional(op["stepdown"].number()) : std::nullopt);
}

/// What a layer's slabs cover; none where that is the whole stock.
std::optional<Blank> read_blank(const Field& blank, const BuildPlan& build) {
    Blank read;
    for (std::size_t k = 0; k < 2; ++k) {
        read.min[k] = blank["min"][k].number();
        read.max[k] = blank["max"][k].number();
        if (!(read.max[k] > read.min[k])) blank.fail("is of no size");
        if (read.min[k] < build.stock_min[k] - 1e-6 || read.max[k] > build.stock_max[k] + 1e-6)
            blank.fail("reaches beyond the stock");
    }
    if (read == Blank{build.stock_min, build.stock_max}) return std::nullopt;
    return read;
}

/// The dowels in the joint on a layer's top.
std::vector<JointDowel> read_dowels(const Field& all) {
    std::vector<JointDowel> dowels;
    for (std::size_t i = 0; i < all.size(); ++i) {
        const Field d = all[i];
        dowels.push_back({d["x"].number(), d["y"].number(), d["diameter"].number(), d["below"].number(),
                          d["above"].number()});
        const JointDowel& read = dowels.back();
        for (const double v : {read.x, read.y, read.diameter, read.below, read.above})
            if (std::abs(v) > 200000) d.fail("reaches beyond 200 m");
        if (!(read.diameter > 0) || !(read.below > 0) || !(read.above > 0)) d.fail("is no dowel");
    }
    return dowels;
}

void read_underside(const Field& underside, int layer, BuildPlan& build) {
    build.undersides.push_back({layer, underside["folder"].text(), underside["minutes"].number()});
    if (build.undersides.back().folder != underside_folder(layer))
        underside["folder"].fail("is not that of the layer");
}

/// What a plan says of the slab whose underside it is of; none where it is of a build.
std::optional<TurnedSlab> read_turned(const Field& plan) {
    if (!plan.has("turned")) return std::nullopt;
    const Field from = plan["turned"];
    const auto mm = [&](const char* key) { return from[key].number(); };
    TurnedSlab slab{
        from["layer"].whole(), mm("z_bottom"), mm("z_top"), mm("slab_thickness"), {}, mm("web"), mm("room")};
    for (std::size_t k = 0; k < 2; ++k) {
        slab.blank.min[k] = from["min"][k].number();
        slab.blank.max[k] = from["max"][k].number();
    }
    return slab;
}

void read_layers(const Field& layers, PlannedFolder& folder) {
    std::set<std::string> named;
    if (layers.size() == 0) layers.fail("has no layer");
    for (std::size_t l = 0; l < layers.size(); ++l) {
        const Field from = layers[l];
        LayerToBuild& layer = folder.build.layers.emplace_back();
        layer.index = from["index"].whole();
        layer.z_bottom = from["z_bottom"].number();
        layer.z_top = from["z_top"].number();
        layer.slab_thickness = from["slab_thickness"].number();
        folder.simulation.layers.push_back({layer.z_bottom, layer.z_top, layer.slab_thickness, {}});
        if (from.has("blank")) layer.blank = read_blank(from["blank"], folder.build);
        folder.simulation.layers.back().blank = layer.blank;
        if (from.has("dowels")) layer.dowels = read_dowels(from["dowels"]);
        folder.simulation.layers.back().dowels = layer.dowels;
        if (from.has("underside")) read_underside(from["underside"], layer.index, folder.build);
        if (from.has("slabs")) layer.slabs = from["slabs"].whole();
        if (layer.slabs < 1 || layer.slabs > 1000) from["slabs"].fail("is no count of slabs");
        if (from.has("joints"))
            for (std::size_t k = 0; k < from["joints"].size(); ++k)
                layer.joints.push_back(read_joint(from["joints"][k]));
        const Field operations = from["operations"];
        for (std::size_t o = 0; o < operations.size(); ++o) read_operation(operations[o], l, named, folder);
    }
}

/// The programs that find z = 0.
void read_probes(const Field& plan, BuildPlan& build) {
    if (!plan.has("probes")) return;
    const Field all = plan["probes"];
    if (!build.job_stated) all.fail("are there, and no job that says how they probe");
    for (std::size_t i = 0; i < all.size(); ++i) {
        PlannedProbe& probe = build.probes.emplace_back();
        probe.file = all[i]["file"].text();
        const std::string name = fs::path(probe.file).filename().string();
        if (name.empty() || probe.file != "nc/" + name) all[i]["file"].fail("is no file of nc/");
        probe.tool = all[i]["tool"].whole();
        const int index = all[i]["layer"].whole();
        while (probe.layer < build.layers.size() && build.layers[probe.layer].index != index) ++probe.layer;
        if (probe.layer == build.layers.size()) all[i]["layer"].fail("is no layer of the plan");
    }
}

}  // namespace

GcodeLimits gcode_limits(const Tolerances& tolerances) {
    GcodeLimits limits;
    // Beside kSheet, by which depths may be short, half of that does no harm; twice as near would need 1.4
    // times the chords.
    limits.arc_error = std::clamp(kArcShare * tolerances.gouge, 1e-5, StandingPart::kSheet / 2);
    limits.level_arc_error = kLevelArcError;
    return limits;
}

std::vector<Program> read_planned_operations(const std::string& text, const std::string& file, const Job& job,
                                             std::size_t count) {
    const Dialect dialect = dialect_of(job.machine);
    try {
        std::vector<Program> programs;
        if (count > 1) programs = read_operations(text, file, dialect, gcode_limits(job.tolerances));
        else programs.push_back(read_program_text(text, file, dialect, gcode_limits(job.tolerances)));
        if (programs.size() != count)
            throw Error(ErrorKind::verification, "gcode.operations",
                        fmt::format("starts the spindle for {} operations, the plan has {} in it",
                                    programs.size(), count),
                        file, "plan again");
        return programs;
    } catch (const Error& error) {
        const std::string other = other_dialect(text, dialect);
        if (other.empty()) throw;
        throw Error(error.kind(), kForeignProgram,
                    "is a program for " + other + " where the plan's are for " + in_words(dialect),
                    error.place(), "do not mix folders; plan again with the machine.post of your control");
    }
}

Program read_planned_program(const std::string& text, const std::string& file, const Job& job) {
    return std::move(read_planned_operations(text, file, job, 1).front());
}

void place_program(Program& program, const BuildPlan& build, std::size_t layer) {
    // Programs count from there in whole 0.1 µm, as they were written.
    const double from = build.frame == Frame::layer_top   ? build.layers[layer].z_top
                        : build.frame == Frame::table_top ? -build.job.machine.base_board_thickness
                                                          : 0;
    const double up = to_mm(to_units(from));
    for (ProgramStep& s : program.steps) s.x += build.zero[0], s.y += build.zero[1], s.z += up;
    for (ProgramArc& a : program.arcs) a.arc.x += build.zero[0], a.arc.y += build.zero[1], a.arc.z += up;
}

PlannedFolder read_planned_folder(const fs::path& out, const FolderRefusal& refusal) {
    const std::string file = (out / "plan.json").string();
    const Refuse refuse{refusal, file};
    PlannedFolder folder;
    folder.path = out;
    folder.document = read_document(file, refusal.kind, refusal.plan, "plan again");
    json document;
    try {
        document = json::parse(folder.document);
    } catch (const json::exception& e) {
        refuse.because(std::string("is no JSON: ") + e.what());
    }
    const Field plan(document, "plan", refuse);
    if (plan["schema"].text() != "slabwright.plan/1") plan["schema"].fail("is not slabwright.plan/1");
    if (plan["units"].text() != "mm") plan["units"].fail("is not mm");
    BuildPlan& build = folder.build;
    build.frame = enumerator(kFrameWords, plan["frame"]);
    if (build.frame == Frame::automatic) plan["frame"].fail("names no frame");
    if (plan.has("job") && read_job(plan["job"], build)) read_post(plan, out, refusal, build.job.machine);
    if (build.frame == Frame::table_top && !build.job_stated)
        plan["frame"].fail("counts from the machine's table, and no job says how thick the base board is");
    build.job.machine.keep_outs = stated_list(plan, "keep_outs", &validate_keep_outs,
                                              [](auto& k, auto& keys) { visit_keep_out_keys(k, keys); });
    build.job.material.cutting = stated_list(plan, "cutting_data", &validate_cutting_data,
                                             [](auto& d, auto& keys) { visit_cutting_data_keys(d, keys); });
    build.pattern = plan["input"]["file"].text();
    build.sha256 = plan["input"]["sha256"].text();
    folder.pattern = {build.pattern, build.sha256, read_reading(plan["input"], build), read_supports(plan)};
    for (std::size_t k = 0; k < 2; ++k) {
        build.stock_min[k] = plan["stock"]["min"][k].number();
        build.stock_max[k] = plan["stock"]["max"][k].number();
        if (!(build.stock_max[k] > build.stock_min[k])) plan["stock"].fail("is of no size");
    }
    for (std::size_t k = 0; k < 2 && plan.has("zero"); ++k) {
        build.zero[k] = to_mm(to_units(plan["zero"][k].number()));
        if (std::abs(build.zero[k]) > 200000) plan["zero"].fail("lies beyond 200 m");
    }
    const Field tools = plan["tools"];
    for (std::size_t i = 0; i < tools.size(); ++i) build.tools.push_back(read_tool(tools[i]));
    read_layers(plan["layers"], folder);
    read_probes(plan, build);
    folder.turned = read_turned(plan);
    build.turned = folder.turned.has_value();
    folder.states_wood = plan.has("wood");
    SimulationInput& input = folder.simulation;
    input.machine = build.job.machine;
    input.stock_min = build.stock_min;
    input.stock_max = build.stock_max;
    input.tools = build.tools;
    read_flask(plan, folder);
    folder.pattern.drills = drill_rule(folder.simulation.tools, build.job.tolerances.gouge);
    return folder;
}

std::size_t PlannedFolder::file_end(std::size_t begin) const {
    const std::vector<PlannedProgram>& all = build.programs;
    std::size_t end = begin + 1;
    while (end < all.size() && file_of(all[end].file) == file_of(all[begin].file)) ++end;
    return end;
}

std::vector<Program> PlannedFolder::read_file(std::size_t begin, const FolderRefusal& refusal) const {
    const std::string file(file_of(build.programs[begin].file));
    const std::size_t count = file_end(begin) - begin;
    const std::string text =
        read_whole(path / file, {refusal.kind, refusal.program, kMostProgramBytes, "plan again"});
    std::vector<Program> programs = read_planned_operations(text, file, build.job, count);
    for (std::size_t k = 0; k < count; ++k) {
        Program& program = programs[k];
        const PlannedProgram& planned = build.programs[begin + k];
        place_program(program, build, planned.layer);
        program.file = planned.file.substr(3);
        program.layer = static_cast<int>(planned.layer);
        program.kind = planned.kind;
        program.planned_tool = planned.tool;
        if (stepdowns[begin + k]) program.planned_stepdown = *stepdowns[begin + k];
    }
    return programs;
}

Program PlannedFolder::read_program(std::size_t i, const FolderRefusal& refusal) const {
    const auto part = static_cast<std::size_t>(std::max(1, part_of(build.programs[i].file)));
    return std::move(read_file(i + 1 - part, refusal)[part - 1]);
}

}  // namespace slabwright
