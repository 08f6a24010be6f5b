// Programs for every control: written, read back in their own dialect, and held against the planner's moves;
// texts that were damaged, or are another control's, are told.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "engine/schedule/schedule.h"
#include "engine/simulate/build_replay.h"
#include "io/posts/dialect.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/program_check.h"
#include "io/posts/program_grid.h"
#include "io/posts/tool_table.h"
#include "io/read/planned_folder.h"
#include "io/read/sequence_reader.h"
#include "io/resume.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/sequence_json.h"
#include "kernels/errors.h"
#include "tests/support/block_build.h"
#include "tests/support/every_control.h"
#include "tests/support/files.h"
#include "tests/support/grbl_toolpath.h"
#include "tests/support/places.h"
#include "tests/support/rs274.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using namespace slabwright::support;

namespace {

constexpr double kNear = 0.5e-3 + 1e-9;  // mm

Job job_for(Post post, LengthUnit units) {
    Job job;
    job.machine.post = post;
    job.machine.units = units;
    return job;
}

/// A plan of one layer and one operation of these moves, z = 0 at the layer's top.
Plan plan_with(Post post, LengthUnit units, std::vector<Move> moves, double z_top = 37) {
    Plan plan;
    plan.job = job_for(post, units);
    plan.input.file = "pump.stl";
    Layer& layer = plan.layers.emplace_back();
    layer.index = 2;
    layer.z_bottom = 18.5;
    layer.z_top = z_top;
    layer.slab_thickness = 19;
    Operation operation;
    operation.kind = OperationKind::rough;
    operation.purpose = "levels";
    operation.tool = 2;
    operation.spindle_rpm = 18000;
    operation.clearance_z = to_mm(moves.front().z);
    operation.moves = std::move(moves);
    layer.operations.push_back(operation);
    name_programs(plan);
    return plan;
}

std::string text_of(const Plan& plan) {
    return program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
}

/// Holds one program, read back from its text, against the moves that it was written from.
/// @returns what differs, "" where nothing does
std::string difference(const Plan& plan, const Layer& layer, const Operation& op) {
    const Dialect dialect = dialect_of(plan.job.machine);
    Program program =
        read_program_text(program_text(plan, layer, op), op.file, dialect, gcode_limits(plan.job.tolerances));
    const ProgramOrigin origin = program_origin(plan, layer);
    for (ProgramStep& step : program.steps) step.x += to_mm(origin.x), step.y += to_mm(origin.y);
    for (ProgramArc& arc : program.arcs) arc.arc.x += to_mm(origin.x), arc.arc.y += to_mm(origin.y);
    if (program.tool != op.tool || std::abs(program.spindle_rpm - op.spindle_rpm) > 0.5)
        return "another tool or speed";
    const std::vector<std::uint32_t> lines = move_lines(plan, layer, op);
    const double up = to_mm(origin.z);
    std::map<std::uint32_t, std::pair<std::size_t, std::size_t>> steps;  // of a line, first and last
    for (std::size_t s = 0; s < program.steps.size(); ++s) {
        const auto [at, first] = steps.emplace(program.steps[s].line, std::pair{s, s});
        if (!first) at->second.second = s;
    }
    bool begun = false;
    std::size_t here = 0, written = 2;
    for (std::size_t i = 0; i + 1 < op.moves.size(); ++i) {
        const Move& move = op.moves[i];
        if (lines[i] != 0) {
            begun = true;
            ++written;
            const auto found = steps.find(lines[i]);
            if (found == steps.end()) return fmt::format("move {} has no step", i);
            here = found->second.second;
            if (program.steps[here].feed != move.feed) return fmt::format("move {} at another feed", i);
            // An arc that rounding turned around would go far.
            double way = 0;
            for (std::size_t s = found->second.first; s <= here && s > 0; ++s)
                if (program.steps[s - 1].known())
                    way += std::hypot(program.steps[s].x - program.steps[s - 1].x,
                                      program.steps[s].y - program.steps[s - 1].y);
            if (move.is_arc() && way > arc_shape(op.moves[i - 1], move).length() + 0.01)
                return fmt::format("move {} goes {} mm", i, way);
        }
        if (!begun) continue;
        const ProgramStep& step = program.steps[here];
        const double off = std::max({std::abs(step.x - to_mm(std::int64_t{move.x})),
                                     std::abs(step.y - to_mm(std::int64_t{move.y})),
                                     std::abs(step.z + up - to_mm(std::int64_t{move.z}))});
        if (!(off <= kNear)) return fmt::format("move {} ends {} mm elsewhere", i, off);
    }
    for (const ProgramArc& arc : program.arcs) {
        const auto at = std::find(lines.begin(), lines.end(), program.steps[arc.begin].line) - lines.begin();
        const Move& from = op.moves[static_cast<std::size_t>(at) - 1];
        const ArcShape shape = arc_shape(from, op.moves[static_cast<std::size_t>(at)]);
        if (std::max(std::abs(shape.x - arc.arc.x), std::abs(shape.y - arc.arc.y)) > kNear)
            return "an arc about another centre";
        if ((shape.sweep > 0) != (arc.arc.turn > 0)) return "an arc that turns the other way";
    }
    // What plan.json will say of it is what the text does, and what checks it finds nothing.
    ProgramPlan said;
    said.spindle_rpm = op.spindle_rpm;
    said.blend = op.blend;
    said.feeds = written_feed_lengths(dialect, op.moves, program_origin(plan, layer));
    Program raised = program;
    for (ProgramStep& step : raised.steps) step.z += up;
    for (ProgramArc& arc : raised.arcs) arc.arc.z += up;
    const auto tool = std::find_if(plan.job.tools.begin(), plan.job.tools.end(),
                                   [&](const Tool& t) { return t.number == op.tool; });
    for (const Violation& v : check_program(raised, said, &*tool, plan.job.machine))
        return v.code + ": " + v.message;
    return steps.size() > written ? "motions that nobody planned" : "";
}

/// Moves that begin and end as a program must, arcs of every size among them, down to a radius of 1 µm.
std::vector<Move> random_moves(std::mt19937& random, std::size_t count, double least_exponent = 1) {
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    const auto share = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    constexpr std::int32_t kClearance = 470003;
    std::vector<Move> moves{{pick(-500000, 500000), pick(-500000, 500000), kClearance, 0}};
    Move at = moves[0];
    for (std::size_t n = 0; n < count; ++n) {
        const double size = std::pow(10, share(least_exponent, 5.5));
        at.i = at.j = 0;
        at.feed = pick(0, 5) == 0 ? 0 : static_cast<std::uint32_t>(pick(1, 6) * 1500 - pick(0, 3));
        if (pick(0, 2) == 0 && at.feed != 0) {
            const double begin = share(-3.1, 3.1), turn = share(-3.1, 3.1);
            const Move from = at;
            at.i = static_cast<std::int32_t>(std::lround(-size * std::cos(begin)));
            at.j = static_cast<std::int32_t>(std::lround(-size * std::sin(begin)));
            at.x = from.x + at.i + static_cast<std::int32_t>(std::lround(size * std::cos(begin + turn)));
            at.y = from.y + at.j + static_cast<std::int32_t>(std::lround(size * std::sin(begin + turn)));
            const bool none = (at.x == from.x && at.y == from.y) || !at.is_arc();
            const double sweep = none ? 0 : arc_shape(from, at).sweep;
            if (none || std::abs(sweep) > 3.1 || (sweep > 0) != (turn > 0)) at = from;
        } else {
            at.x += pick(0, 2) != 0 ? static_cast<std::int32_t>(share(-size, size)) : 0;
            at.y += pick(0, 2) != 0 ? static_cast<std::int32_t>(share(-size, size)) : 0;
            if (pick(0, 3) == 0) at.z = pick(-30, 46) * 10000 + pick(0, 9999);
        }
        moves.push_back(at);
    }
    at.i = at.j = 0;
    at.feed = 0;
    moves.push_back(at);
    at.z = kClearance;
    moves.push_back(at);
    return moves;
}

std::string name_of(Post post, LengthUnit units) { return in_words(post, units); }

/// The code of the refusal, or of the first violation; "" where the text passes.
std::string verdict(const Plan& plan, const std::string& text) {
    const Operation& op = plan.layers[0].operations[0];
    try {
        const Program program =
            read_program_text(text, op.file, dialect_of(plan.job.machine), gcode_limits(plan.job.tolerances));
        ProgramPlan said;
        said.spindle_rpm = op.spindle_rpm;
        said.blend = op.blend;
        said.feeds = written_feed_lengths(dialect_of(plan.job.machine), op.moves,
                                          program_origin(plan, plan.layers[0]));
        Program raised = program;
        const double up = to_mm(program_origin(plan, plan.layers[0]).z);
        for (ProgramStep& step : raised.steps) step.z += up;
        for (ProgramArc& arc : raised.arcs) arc.arc.z += up;
        if (program.tool != op.tool) return "tool";
        for (const Violation& v : check_program(raised, said, &plan.job.tools[1], plan.job.machine))
            return v.code;
        return "";
    } catch (const Error& error) {
        return error.code();
    }
}

/// A square with a round corner, 10 mm above the layer's top to 5 mm under it.
std::vector<Move> square() {
    constexpr std::int32_t mm = 10000;
    return {{0, 0, 47 * mm, 0},
            {29 * mm, 3 * mm, 47 * mm, 0},
            {29 * mm, 3 * mm, 32 * mm, 1500},
            {49 * mm, 3 * mm, 32 * mm, 9000},
            {59 * mm, 13 * mm, 32 * mm, 9000, 0, 10 * mm},
            {59 * mm, 33 * mm, 32 * mm, 9000},
            {59 * mm, 33 * mm, 47 * mm, 0}};
}

}  // namespace

TEST(Posts, WordForWord) {
    const auto body = [](Post post, LengthUnit units) {
        const std::string text = text_of(plan_with(post, units, square()));
        // Without what stands in comments.
        std::string out;
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = text.find('\n', at);
            const std::string line = text.substr(at, end - at);
            if (line[0] != '(' && line.find("; ") == std::string::npos) out += line + "\n";
            at = end + 1;
        }
        return out;
    };
    EXPECT_EQ(body(Post::fanuc, LengthUnit::mm),
              "%\nO0201\nG21 G17 G90 G94 G40 G49 G80\nG64\nG54\nT2 M6\nS18000 M3\nG4 P3000\nG0 G43 H2 Z10.\n"
              "X29. Y3.\nG1 Z-5. F1500.\nX49. F9000.\nG3 X59. Y13. I0. J10.\nG1 Y33.\nG0 Z10.\nM5\nM30\n%\n");
    EXPECT_EQ(body(Post::haas, LengthUnit::inch),
              "%\nO00201\nG20 G17 G90 G94 G40 G49 G80\nG187 P2 E0.000787\nG54\nT2 M6\nS18000 M3\nG4 P3.\n"
              "G0 G43 H2 Z0.3937\nX1.14173 Y0.11811\nG1 Z-0.19685 F59.055\nX1.92913 F354.331\n"
              "G3 X2.32283 Y0.51181 I0. J0.3937\nG1 Y1.29921\nG0 Z0.3937\nM5\nM30\n%\n");
    EXPECT_EQ(body(Post::grbl, LengthUnit::mm),
              "G21 G17 G90 G94 G40 G49 G80\nG61\nG54\nT2\nS18000 M3\nG4 P3\nG0 Z10\nX29 Y3\nG1 Z-5 F1500\n"
              "X49 F9000\nG3 X59 Y13 I0 J10\nG1 Y33\nG0 Z10\nM5\nM2\n");
    EXPECT_EQ(body(Post::mach, LengthUnit::mm),
              "G21 G17 G90 G94 G40 G49 G80\nG64\nG54\nT2 M6\nS18000 M3\nG4 P3\nG91.1\nG0 G43 H2 Z10\n"
              "X29 Y3\nG1 Z-5 F1500\nX49 F9000\nG3 X59 Y13 I0 J10\nG1 Y33\nG0 Z10\nM5\nM30\n");
    EXPECT_EQ(body(Post::iso, LengthUnit::mm),
              "%\nG21 G17 G90 G94 G40 G49 G80\nG64\nG54\nT2 M6\nS18000 M3\nG4 X3.\nG0 G43 H2 Z10.\n"
              "X29. Y3.\nG1 Z-5. F1500.\nX49. F9000.\nG3 X59. Y13. I0. J10.\nG1 Y33.\nG0 Z10.\nM5\nM30\n%\n");
    EXPECT_EQ(body(Post::siemens, LengthUnit::mm),
              "G710 G17 G90 G94 G40\nG641 ADIS=0.02 ADISPOS=0.02\nG54\nT2 M6\nD1\nS18000 M3\nG4 F3\nG0 Z10\n"
              "X29 Y3\nG1 Z-5 F1500\nX49 F9000\nG3 X59 Y13 I0 J10\nG1 Y33\nG0 Z10\nM5\nM30\n");
    EXPECT_EQ(body(Post::heidenhain, LengthUnit::inch),
              "0 BEGIN PGM L002_01_rough_T2 INCH\n9 TOOL CALL 2 Z S18000\n10 CYCL DEF 32.0 TOLERANCE\n"
              "11 CYCL DEF 32.1 T0.000787\n12 M3\n13 CYCL DEF 9.0 DWELL TIME\n14 CYCL DEF 9.1 DWELL 3\n"
              "15 L Z+0.3937 R0 FMAX\n16 L X+1.14173 Y+0.11811 FMAX\n17 L Z-0.19685 F590.551\n"
              "18 L X+1.92913 F3543.307\n19 CC X+1.92913 Y+0.51181\n20 C X+2.32283 Y+0.51181 DR+\n"
              "21 L Y+1.29921\n22 L Z+0.3937 FMAX\n23 M5\n24 M30\n25 END PGM L002_01_rough_T2 INCH\n");
}

TEST(Posts, RandomMovesReadBackTheSame) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 6; ++round) {
        const std::vector<Move> moves = random_moves(random, 1500);
        const double top = 37 + std::uniform_int_distribution<int>(0, 9999)(random) * 1e-4;
        for (const Post post : kPosts)
            for (const LengthUnit units : kUnits) {
                Plan plan = plan_with(post, units, moves, top);
                plan.stock_min = {-123.45678, 17.00004};
                plan.stock_max = {999.9, 17.5};
                for (const WorkZero zero : {WorkZero::model, WorkZero::corner, WorkZero::centre}) {
                    plan.job.machine.zero = zero;
                    EXPECT_EQ(difference(plan, plan.layers[0], plan.layers[0].operations[0]), "")
                        << name_of(post, units);
                }
            }
    }
}

TEST(Posts, ProgramsOfPartsReadBackTheSame) {
    std::vector<std::string> parts{kModels + "half-sphere.stl", kModels + "luo-tool-sample.stl",
                                   kModels + "pump-cover.stl"};
    if (const char* corpus = std::getenv("SLABWRIGHT_CORPUS")) {
        std::vector<std::string> castings;
        for (const auto& entry : std::filesystem::directory_iterator(std::string(corpus) + "/castings"))
            if (entry.path().extension() == ".stl" && entry.file_size() < (2u << 20))
                castings.push_back(entry.path().string());
        std::sort(castings.begin(), castings.end());
        // What a dialect says hardly depends on the part: five with SLABWRIGHT_SOAK.
        castings.resize(std::min<std::size_t>(castings.size(), std::getenv("SLABWRIGHT_SOAK") ? 5 : 2));
        parts.insert(parts.end(), castings.begin(), castings.end());
    }
    const bool has_toolpath = support::has_grbl_toolpath();
    if (!has_toolpath)
        std::printf("  gcode-toolpath is not here: GRBL's programs are read by our reader alone\n");
    for (const std::string& part : parts) {
        Context context;
        Plan made = plan(context, PatternSource(part),
                         job_from_toml("allow_undercut = true\n[bonding]\naccept_weak = true\n", "t"));
        for (const Post post : kPosts)
            for (const LengthUnit units : kUnits) {
                made.job.machine.post = post;
                made.job.machine.units = units;
                name_programs(made);
                std::set<int> numbers;
                std::size_t checked = 0;
                std::map<std::string, std::string> texts;
                for (const Layer& layer : made.layers)
                    for (Operation op : layer.operations) {
                        if (!says_rounding(post)) op.blend = kJunction;
                        EXPECT_EQ(difference(made, layer, op), "")
                            << part << " " << op.file << " " << name_of(post, units);
                        EXPECT_TRUE(numbers.insert(op.number).second) << op.file;
                        if (post == Post::grbl)
                            texts[std::to_string(op.number)] = program_text(made, layer, op);
                        ++checked;
                    }
                EXPECT_GT(checked, 4u);
                if (post != Post::grbl || !has_toolpath) continue;
                const auto run = support::grbl_toolpaths(texts);
                for (const Layer& layer : made.layers)
                    for (const Operation& op : layer.operations) {
                        const auto found = run.find(std::to_string(op.number));
                        ASSERT_NE(found, run.end()) << part;
                        EXPECT_EQ(support::grbl_difference(made, layer, op, found->second, kNear), "")
                            << part << " " << op.file << " " << name_of(post, units) << ", by gcode-toolpath";
                    }
            }
    }
}

TEST(Posts, EveryPlanPassesItsOwnProof) {
    for (const Post post : kPosts)
        for (const LengthUnit units : kUnits) {
            const TemporaryFolder folder;
            const std::string out = folder / "out";
            Context context;
            const PatternSource source(kModels + "half-sphere.stl");
            const Job job = job_for(post, units);
            const VerifyResult result = write_verified(context, plan(context, source, job), out, source, 1);
            EXPECT_TRUE(result.passed)
                << name_of(post, units) << (result.violations.empty() ? "" : result.violations[0].message);
            EXPECT_EQ(std::filesystem::exists(out + "/tool.tbl"), post == Post::linuxcnc);
            // Its last program cut short is told, whoever it is for.
            std::vector<std::string> files;
            for (const auto& entry : std::filesystem::directory_iterator(out + "/nc"))
                files.push_back(entry.path().string());
            std::sort(files.begin(), files.end());
            const std::string text = slurp(files.back());
            spit(files.back(), text.substr(0, text.size() / 2));
            EXPECT_THROW((void)verify_folder(context, out, {.source = source, .cell = 1}), Error)
                << name_of(post, units);
        }
}

TEST(Posts, TheZeroLiesWhereTheJobPutsIt) {
    const PatternSource source(kModels + "half-sphere.stl");
    for (const char* zero : {"corner", "centre"}) {
        const TemporaryFolder folder;
        const std::string out = folder / "out";
        Context context;
        const Job job =
            job_from_toml(fmt::format("[machine]\nzero = \"{}\"\n[slabs]\nblanks = \"layer\"\n", zero), "t");
        const Plan made = plan(context, source, job);
        ASSERT_TRUE(write_verified(context, made, out, source, 1).passed) << zero;
        const auto document = nlohmann::json::parse(slurp(out + "/plan.json"));
        const bool corner = zero == std::string("corner");
        for (const std::size_t k : {std::size_t{0}, std::size_t{1}})
            EXPECT_NEAR(document["zero"][k].get<double>(),
                        corner ? made.stock_min[k] : (made.stock_min[k] + made.stock_max[k]) / 2, 1e-4);
        // The first layer's slab begins at the corner, or as far left of its middle as right of it.
        const double left = corner ? 0 : -(made.stock_max[0] - made.stock_min[0]) / 2;
        nlohmann::json steps = nlohmann::json::parse(slurp(out + "/sequence.json"));
        bool touched = false;
        for (auto& step : steps["steps"])
            if (step["action"] == "touch_off" && !touched) {
                touched = true;
                EXPECT_NEAR(step["slab_left_mm"].get<double>(), left, 1e-3);
                step["slab_left_mm"] = left + 1;
            }
        ASSERT_TRUE(touched);
        const auto codes = [&] {
            std::string found;
            for (const Violation& v :
                 verify_folder(context, out, {.source = source, .cell = 1}).report.violations)
                if (found.find(v.code) == std::string::npos) found += v.code + " ";
            return found;
        };
        const std::string sequence = slurp(out + "/sequence.json"), text = slurp(out + "/plan.json");
        spit(out + "/sequence.json", steps.dump());
        EXPECT_EQ(codes(), "sequence.touch_off ") << zero;
        spit(out + "/sequence.json", sequence);
        // Programs that count from elsewhere do not make the part.
        auto moved = document;
        moved["zero"][0] = document["zero"][0].get<double>() + 1;
        spit(out + "/plan.json", moved.dump());
        EXPECT_NE(codes().find("gouge.cutter"), std::string::npos) << zero;
    }
}

TEST(Posts, ALayerIsMadeAgainInEachDialect) {
    for (const Post post : kPosts) {
        const TemporaryFolder folder;
        const std::string out = folder / "out";
        Context context;
        Job job = job_for(post, LengthUnit::inch);
        job.machine.zero = WorkZero::corner;
        job.slabs.blanks = Blanks::layer;
        const Plan made = plan(context, PatternSource(kModels + "half-sphere.stl"), job);
        write(context, made, out);
        EXPECT_EQ(schema_complaint(slurp(out + "/plan.json"), support::checkout("io/plan.schema.json")), "");
        EXPECT_EQ(
            schema_complaint(slurp(out + "/sequence.json"), support::checkout("io/sequence.schema.json")),
            "");
        int after = 0;  // into layer 2
        for (const SequenceStep& step : made.sequence)
            if (step.layer == 2 && step.action == "face") after = step.id;
        const ResumeStatus status = resume_build(context, out, {after, 1, 1'795'617'730});
        ASSERT_EQ(status.programs.size(), 2u) << name_of(post, LengthUnit::mm);
        EXPECT_EQ(status.programs[0], "resume_001/nc/" + program_file(post, "F001_L002_face_off_T1"));
        EXPECT_EQ(schema_complaint(slurp(out + "/resume_001/sequence.json"),
                                   support::checkout("io/sequence.schema.json")),
                  "");
        // What has not run yet is read and proven again each time.
        (void)resume_build(context, out, {{}, {}, 1'795'617'790});
        spit(out + "/" + status.programs[0], slurp(out + "/nc/" + made.layers[0].operations[0].file));
        EXPECT_THROW((void)resume_build(context, out, {{}, {}, 1'795'617'790}), Error);
    }
}

TEST(Posts, WhereTheControlKeepsNoLengthsTheSequenceSaysWhoDoes) {
    for (const Post post : kPosts) {
        Job job;
        job.machine.post = post;
        const Plan plan = support::block(job, {});
        nlohmann::json sequence = nlohmann::json::parse(sequence_json(plan));
        const BuildPlan build = support::stated(plan);
        ASSERT_TRUE(replay_build(build, read_sequence(sequence.dump())).empty());
        int said = 0;
        for (nlohmann::json& step : sequence["steps"])
            if (step.contains("length")) {
                step["length"] = "keep";
                ++said;
            }
        EXPECT_EQ(said > 0, post == Post::grbl);
        std::vector<Violation> found = replay_build(build, read_sequence(sequence.dump()));
        EXPECT_EQ(found.empty(), post != Post::grbl);
        if (found.empty()) continue;
        EXPECT_EQ(found[0].code, "sequence.tool_length") << found[0].message;
        for (nlohmann::json& step : sequence["steps"]) step.erase("length");
        found = replay_build(build, read_sequence(sequence.dump()));
        ASSERT_FALSE(found.empty());
        EXPECT_EQ(found[0].code, "sequence.value") << found[0].message;
    }
}

TEST(Posts, AnotherDialectIsToldByName) {
    for (const Post post : kPosts)
        for (const LengthUnit units : kUnits) {
            const std::string text = text_of(plan_with(post, units, square()));
            for (const Post other : kPosts)
                for (const LengthUnit other_units : kUnits) {
                    if (post == other && units == other_units) continue;
                    const Plan expecting = plan_with(other, other_units, square());
                    try {
                        (void)read_planned_program(text, "nc/x", expecting.job);
                        ADD_FAILURE() << name_of(post, units) << " passes as " << name_of(other, other_units);
                    } catch (const Error& error) {
                        if (post == other) {  // one of the wrong unit
                            EXPECT_EQ(error.code(),
                                      post == Post::heidenhain ? "gcode.units" : "gcode.left_in_force");
                            continue;
                        }
                        EXPECT_EQ(error.code(), "program.dialect");
                        EXPECT_EQ(error.message(), "is a program for " + name_of(post, units) +
                                                       " where the plan's are for " +
                                                       name_of(other, other_units));
                    }
                }
        }
}

TEST(Posts, AFolderOfAnotherControlIsToldByBothNames) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    Context context;
    const PatternSource source(kModels + "half-sphere.stl");
    const Plan made = plan(context, source, job_for(Post::haas, LengthUnit::mm));
    write(context, made, out);
    // One program of the same name, as a Fanuc would have it; then all of them, by what plan.json says.
    Plan fanuc = made;
    fanuc.job.machine.post = Post::fanuc;
    const Operation& first = made.layers[0].operations[0];
    spit(out + "/nc/" + first.file, program_text(fanuc, fanuc.layers[0], fanuc.layers[0].operations[0]));
    const auto told = [&] {
        std::vector<Violation> of_dialects;
        for (const Violation& v :
             verify_folder(context, out, {.source = source, .cell = 2}).report.violations)
            if (v.code == "program.dialect") of_dialects.push_back(v);
        return of_dialects;
    };
    std::vector<Violation> found = told();
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].file, first.file);
    EXPECT_EQ(found[0].message, "is a program for fanuc where the plan's are for haas");
    const std::string document = slurp(out + "/plan.json"), says = "\"post\": \"haas\"";
    std::string other = document;
    other.replace(other.find(says), says.size(), "\"post\": \"fanuc\"");
    spit(out + "/plan.json", other);
    found = told();
    std::size_t programs = 0;
    for (const Layer& layer : made.layers) programs += layer.operations.size();
    EXPECT_EQ(found.size(), programs - 1);
    // Two of one number.
    const Operation& second = made.layers[0].operations[1];
    std::string text = program_text(made, made.layers[0], second);
    text.replace(text.find("O00102"), 6, "O00101");
    spit(out + "/plan.json", document);
    spit(out + "/nc/" + first.file, program_text(made, made.layers[0], first));
    spit(out + "/nc/" + second.file, text);
    const auto report = verify_folder(context, out, {.source = source, .cell = 2}).report;
    const auto twice = std::find_if(report.violations.begin(), report.violations.end(),
                                    [](const Violation& v) { return v.code == "program.number"; });
    ASSERT_NE(twice, report.violations.end());
    EXPECT_EQ(twice->file, second.file);
}

TEST(Posts, DamagedTextsAreTold) {
    struct Damage {
        Post post;
        const char *from, *to, *found;
    };
    const Damage damages[] = {
        {Post::fanuc, "X29.", "X29", "gcode.decimal_point"},
        {Post::fanuc, "F9000.", "F9000", "gcode.decimal_point"},
        {Post::fanuc, "J10.", "J10", "gcode.decimal_point"},
        {Post::fanuc, "G21", "G20", "gcode.left_in_force"},
        {Post::fanuc, "G4 P3000", "G4 P3", "program.spin_up"},
        {Post::fanuc, "G4 P3000", "G4 P3.", "gcode.dwell"},
        {Post::fanuc, "G43 H2 ", "", "gcode.offset"},
        {Post::fanuc, "H2", "H3", "gcode.offset"},
        {Post::fanuc, "M30\n%\n", "", "gcode.no_end"},
        {Post::fanuc, "M30\n%\n", "M30\n", "gcode.no_end"},
        {Post::fanuc, "%\nO0201\n", "%\n", "gcode.program_number"},
        {Post::fanuc, "O0201", "O0000", "gcode.program_number"},
        {Post::fanuc, "%\nO0201\n", "O0201\n", "gcode.percent"},
        {Post::fanuc, "G64\n", "", "gcode.unset"},
        {Post::fanuc, "G64\n", "G64 P0.02\n", "gcode.unused_word"},
        {Post::fanuc, "Y33.", "Y32.", "program.lengths"},
        {Post::fanuc, "I0. J10.", "R10.", ""},
        {Post::haas, "Z-5.", "Z-5", "gcode.decimal_point"},
        {Post::haas, "G21", "G20", "gcode.left_in_force"},
        {Post::haas, "G4 P3.", "G4 P3", "program.spin_up"},
        {Post::haas, "G4 P3.", "G4 P3000.", "program.dwell"},
        {Post::haas, "G4 P3.", "G4 P3000", ""},
        {Post::haas, "E0.02", "E0.2", "program.path_mode"},
        {Post::haas, " E0.02", "", "gcode.path_mode"},
        {Post::haas, "G187 P2 E0.02", "G64", "gcode.unknown_word"},
        {Post::haas, "G43 H2 ", "", "gcode.offset"},
        {Post::haas, "%\nO00201", "%\nO00201\nO00202", "gcode.program_number"},
        {Post::grbl, "G21", "G20", "gcode.left_in_force"},
        {Post::grbl, "T2\n", "T2 M6\n", "gcode.unknown_word"},
        {Post::grbl, "T2\n", "", "gcode.tool"},
        {Post::grbl, "T2\n", "T3\n", "tool"},
        {Post::grbl, "G61", "G64", "gcode.unknown_word"},
        {Post::grbl, "G0 Z10", "G0 G43 H2 Z10", "gcode.unknown_word"},
        {Post::grbl, "G4 P3", "G4 P3000", "program.dwell"},
        {Post::grbl, "(pattern", "(! pattern", "gcode.character"},
        {Post::grbl, "M5\nM2\n", "M5\n", "gcode.no_end"},
        {Post::grbl, "G94", "G94 G8", "gcode.unknown_word"},
        {Post::mach, "G21", "G20", "gcode.left_in_force"},
        {Post::mach, "G4 P3", "G4 P3000", "program.dwell"},
        {Post::mach, "G43 H2 ", "", "gcode.offset"},
        {Post::mach, "G91.1\n", "", "gcode.unset"},
        {Post::mach, "M30", "", "gcode.no_end"},
        {Post::mach, "(pattern", "(MSG,pattern", "gcode.comment"},
        {Post::iso, "Y33.", "Y33", "gcode.decimal_point"},
        {Post::iso, "G4 X3.", "G4 P3.", "gcode.dwell"},
        {Post::iso, "G21", "G20", "gcode.left_in_force"},
        {Post::iso, "G43 H2 ", "", "gcode.offset"},
        {Post::iso, "M30\n%\n", "%\n", "gcode.percent"},
        {Post::siemens, "G710", "G700", "gcode.left_in_force"},
        {Post::siemens, "G710", "G21", "gcode.unknown_word"},
        {Post::siemens, "D1\n", "", "gcode.offset"},
        {Post::siemens, "D1\n", "D2\n", "gcode.offset"},
        {Post::siemens, "D1\n", "D1\nD0\n", "gcode.offset"},
        {Post::siemens, "G4 F3", "G4 P3", "gcode.unknown_word"},
        {Post::siemens, "G4 F3", "G4 F0.003", "program.spin_up"},
        {Post::siemens, "ADIS=0.02", "ADIS=0.5", "program.path_mode"},
        {Post::siemens, " ADISPOS=0.02", "", "gcode.path_mode"},
        {Post::siemens, "ADISPOS", "ADISPO", "gcode.unknown_word"},
        {Post::siemens, "G641 ADIS=0.02 ADISPOS=0.02\n", "", "gcode.unset"},
        {Post::siemens, "M30\n", "", "gcode.no_end"},
        {Post::siemens, "; pattern", "(pattern", "gcode.unknown_word"},
        {Post::heidenhain, "MM\n", "INCH\n", "gcode.units"},
        {Post::heidenhain, "0 BEGIN PGM L002_01_rough_T2 MM", "0 M3", "gcode.begin"},
        {Post::heidenhain, "BEGIN PGM L002_01_rough_T2 MM", "END PGM L002_01_rough_T2 MM", "gcode.begin"},
        {Post::heidenhain, "BEGIN PGM L002_01_rough_T2 MM", "BEGIN PGM L002_01_rough_T2", "gcode.begin"},
        {Post::heidenhain, "BEGIN PGM L002_01_rough_T2 MM", "BEGIN PGM L002_01_rough_T2 CM", "gcode.begin"},
        {Post::heidenhain, "END PGM", "BEGIN PGM", "gcode.begin"},
        {Post::heidenhain, "R0 ", "", "gcode.unset"},
        {Post::heidenhain, "R0 ", "RL ", "gcode.unknown_word"},
        {Post::heidenhain, "T0.02", "T0.5", "program.path_mode"},
        {Post::heidenhain, "DWELL 3", "DWELL 3000", "program.dwell"},
        {Post::heidenhain, "DWELL 3", "DWELL 0.003", "program.spin_up"},
        {Post::heidenhain, "M3\n", "M4\n", "gcode.spindle"},
        {Post::heidenhain, "TOOL CALL 2", "TOOL CALL 0", "gcode.tool"},
        {Post::heidenhain, "TOOL CALL 2", "TOOL CALL 3", "tool"},
        {Post::heidenhain, "DR+", "DR-", "program.lengths"},
        {Post::heidenhain, " DR+", "", "gcode.arc"},
        {Post::heidenhain, "FMAX\n", "\n", "gcode.feed"},
        {Post::heidenhain, "L X+49", "L IX+49", "gcode.unknown_word"},
        {Post::heidenhain, "CC X", "CX X", "gcode.unknown_word"},
        {Post::heidenhain, "\n16 ", "\n17 ", "gcode.block"},
        {Post::heidenhain, "M30\n", "M5\n", "gcode.no_end"},
        {Post::heidenhain, "25 END PGM L002_01_rough_T2 MM\n", "", "gcode.no_end"},
        {Post::heidenhain, "END PGM L002", "END PGM L003", "gcode.no_end"},
        {Post::heidenhain, "25 END PGM L002_01_rough_T2 MM\n", "25 END PGM L002_01_rough_T2 MM\n26 M5\n",
         "gcode.after_end"},
    };
    std::map<Post, int> told;
    for (const Damage& d : damages) {
        const Plan plan = plan_with(d.post, LengthUnit::mm, square());
        std::string text = text_of(plan);
        ASSERT_EQ(verdict(plan, text), "") << name_of(d.post, LengthUnit::mm);
        const std::size_t at = text.find(d.from);
        ASSERT_NE(at, std::string::npos) << name_of(d.post, LengthUnit::mm) << ": " << d.from << "\n" << text;
        text.replace(at, std::string(d.from).size(), d.to);
        EXPECT_EQ(verdict(plan, text), d.found)
            << name_of(d.post, LengthUnit::mm) << ": " << d.from << " > " << d.to;
        ++told[d.post];
    }
    EXPECT_EQ(told.size(), std::size(kPosts) - 1) << "LinuxCNC's are in gcode_reader_test";
}

TEST(Posts, MillimetresInAnInchProgramAreTold) {
    for (const Post post : kPosts) {
        const Plan plan = plan_with(post, LengthUnit::inch, square());
        const std::string text = text_of(plan);
        ASSERT_EQ(verdict(plan, text), "") << name_of(post, LengthUnit::inch);
        const auto changed = [&](const std::string& from, const std::string& to) {
            std::string other = text;
            const std::size_t at = other.find(from);
            EXPECT_NE(at, std::string::npos) << from << "\n" << text;
            return verdict(plan, other.replace(at, from.size(), to));
        };
        const bool words = post != Post::heidenhain, siemens = post == Post::siemens;
        EXPECT_EQ(words ? changed(siemens ? "G700" : "G20", siemens ? "G710" : "G21") : changed("INCH", "MM"),
                  words ? "gcode.left_in_force" : "gcode.units")
            << name_of(post, LengthUnit::inch);
        EXPECT_EQ(changed("-0.19685", words ? "-5." : "-5"), "program.lengths");
        EXPECT_EQ(changed(words ? "F59.055" : "F590.551", "F1500."),
                  words ? "program.feed" : "program.lengths");
        // A feed that is off in its last decimal but one is another feed.
        EXPECT_EQ(changed(words ? "F59.055" : "F590.551", words ? "F59.065" : "F590.651"), "program.lengths");
    }
}

TEST(Posts, EveryLineLostIsToldOrDoesNothing) {
    // Whatever one line of a program is missing, the rest is refused or is another program than planned.
    for (const Post post : kPosts) {
        const Plan plan = plan_with(post, LengthUnit::mm, square());
        const std::string text = text_of(plan);
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = text.find('\n', at) + 1;
            const std::string line = text.substr(at, end - at);
            // M5 before the end stops what the end stops too; a comment says nothing.
            const bool idle = line[0] == '(' || line[0] == ';' || line == "M5\n" || line == "G64 P0.02 Q0\n";
            if (!idle) {
                std::string without = text;
                without.erase(at, end - at);
                EXPECT_NE(verdict(plan, without), "") << name_of(post, LengthUnit::mm) << ": " << line;
            }
            at = end;
        }
    }
}

/// A program as LinuxCNC's interpreter takes it: lines that it has other words for are left out.
std::string for_rs274(std::string text, Post post, LengthUnit units) {
    const auto replace = [&](const std::string& from, const std::string& to) {
        const std::size_t at = text.find(from);
        ASSERT_NE(at, std::string::npos) << in_words(post, units) << ": " << from;
        text.replace(at, from.size(), to);
    };
    const bool inch = units == LengthUnit::inch;
    if (post == Post::fanuc) replace("O0201\n", "");
    if (post == Post::haas) replace("O00201\n", "");
    if (post == Post::haas) replace(inch ? "G187 P2 E0.000787" : "G187 P2 E0.02", "G64");
    if (post == Post::iso) replace("G4 X3.", "G4 P3.");
    if (post == Post::grbl) replace("T2\n", "T2 M6\n");
    if (post == Post::siemens) {
        replace(inch ? "G700" : "G710", inch ? "G20" : "G21");
        replace(inch ? "G641 ADIS=0.000787 ADISPOS=0.000787" : "G641 ADIS=0.02 ADISPOS=0.02", "G64");
        replace("D1\n", "G43 H2\n");
        replace("G4 F3", "G4 P3");
    }
    return text;
}

TEST(Posts, AnIndependentInterpreterMovesWhereTheEngineSaid) {
    // All but HEIDENHAIN's are RS-274 in their motions. Radii of a µm, which no path has, are none to it.
    std::mt19937 random(test::seed());
    for (const Post post : kPosts)
        for (const LengthUnit units : kUnits) {
            if (post == Post::heidenhain) continue;
            const Plan plan = plan_with(post, units, random_moves(random, 1000, 1.5), 37.1234);
            const Operation& op = plan.layers[0].operations[0];
            Job table;
            const auto canon =
                support::interpret_rs274(for_rs274(text_of(plan), post, units), tool_table(table));
            EXPECT_EQ(canon.tool, 2);
            EXPECT_EQ(canon.spindle_rpm, 18000);
            EXPECT_TRUE(canon.ended);
            // Places that the planner names, one after another; each motion ends at the next that is written.
            const double up = 37.1234, unit = units == LengthUnit::inch ? kInch : 1;
            const std::vector<std::uint32_t> lines = move_lines(plan, plan.layers[0], op);
            std::vector<const Move*> written;
            for (std::size_t i = 0; i < lines.size(); ++i)
                if (lines[i] != 0) written.push_back(&op.moves[i]);
            ASSERT_EQ(canon.motions.size(), written.size() + 2) << in_words(post, units);
            for (std::size_t i = 0; i < written.size(); ++i) {
                const auto& at = canon.motions[i + 1];
                const Move& move = *written[i];
                const double off = std::max({std::abs(at.x * unit - to_mm(std::int64_t{move.x})),
                                             std::abs(at.y * unit - to_mm(std::int64_t{move.y})),
                                             std::abs(at.z * unit + up - to_mm(std::int64_t{move.z}))});
                // The judge prints four decimals, of an inch too.
                ASSERT_LE(off, units == LengthUnit::inch ? 0.5e-4 * kInch + 0.2e-3 : kNear)
                    << in_words(post, units) << " " << i;
                ASSERT_EQ(at.rapid, move.feed == 0) << i;
            }
        }
}

TEST(Posts, NamesFromOutsideStayInTheirComments) {
    for (const Post post : kPosts) {
        Plan plan = plan_with(post, LengthUnit::mm, square());
        plan.input.file = "a) G0 X999 (b\nG0 X999 ; M30 ?!~$ %\n.stl";
        plan.job.tools[1].name = "mill)\nM30\n(; " + std::string(500, 'y');
        EXPECT_EQ(verdict(plan, text_of(plan)), "") << name_of(post, LengthUnit::mm) << text_of(plan);
    }
}

TEST(Posts, WhatNoProgramCanSayIsNotPlannedWith) {
    for (const Post post : kPosts) {
        const Job job = job_for(post, LengthUnit::mm);
        const bool says =
            post == Post::linuxcnc || post == Post::haas || post == Post::siemens || post == Post::heidenhain;
        EXPECT_DOUBLE_EQ(rough_blend(job), says ? 0.1 : kJunction) << name_of(post, LengthUnit::mm);
    }
}

TEST(Posts, ToolsAreNumberedAsTheirTablesGo) {
    for (const auto& [post, highest] : {std::pair{Post::linuxcnc, 99999},
                                        {Post::fanuc, 999},
                                        {Post::haas, 200},
                                        {Post::grbl, 255},
                                        {Post::mach, 254},
                                        {Post::iso, 999},
                                        {Post::siemens, 32000},
                                        {Post::heidenhain, 32767}}) {
        Job job = job_for(post, LengthUnit::mm);
        job.tools[2].number = highest;
        EXPECT_NO_THROW(validate(job)) << name_of(post, LengthUnit::mm);
        job.tools[2].number = highest + 1;
        EXPECT_THROW(validate(job), Error) << name_of(post, LengthUnit::mm);
    }
}

TEST(Posts, ProgramsAreNamedAsTheirControlsWantThem) {
    EXPECT_EQ(program_file(Post::linuxcnc, "L003_02_rough_T2"), "L003_02_rough_T2.ngc");
    EXPECT_EQ(program_file(Post::siemens, "L003_02_rough_T2"), "_L003_02_rough_T2.mpf");
    Plan plan = plan_with(Post::heidenhain, LengthUnit::mm, square());
    EXPECT_EQ(plan.layers[0].operations[0].file, "L002_01_rough_T2.h");
    EXPECT_EQ(plan.layers[0].operations[0].number, 201);
    // Where layer and place do not fit into four digits, programs are counted.
    plan.layers.resize(300, plan.layers[0]);
    for (std::size_t l = 0; l < plan.layers.size(); ++l) plan.layers[l].index = static_cast<int>(l) + 1;
    name_programs(plan);
    EXPECT_EQ(plan.layers[299].operations[0].number, 300);
    Plan fanuc = plan_with(Post::fanuc, LengthUnit::mm, square());
    fanuc.layers[0].operations[0].number = 10000;
    EXPECT_THROW((void)text_of(fanuc), Error);
}
