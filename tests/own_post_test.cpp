// Posts of the user's own: one that says nothing else writes the same bytes as its base, others plan, prove
// and verify, and whatever would lose, move or hide something is refused before a program is written.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "engine/schedule/schedule.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/program_check.h"
#include "io/posts/program_grid.h"
#include "io/read/own_post.h"
#include "io/read/planned_folder.h"
#include "io/resume.h"
#include "io/slabwright.h"
#include "io/text/job_keys.h"
#include "io/verify.h"
#include "kernels/errors.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using slabwright::support::schema_complaint;
using slabwright::support::slurp;
using slabwright::support::spit;
using slabwright::support::TemporaryFolder;

namespace {

constexpr Post kBases[] = {Post::linuxcnc, Post::fanuc, Post::haas,   Post::grbl,
                           Post::mach,     Post::iso,   Post::siemens};
constexpr LengthUnit kUnits[] = {LengthUnit::mm, LengthUnit::inch};
const std::string kModel = support::checkout("tests/data/half-sphere.stl");

/// A shop's router: numbered lines, all decimals, arcs by radius, dust switched by M10 and M11.
const std::string kRouter = R"toml(base = "fanuc"
name = "Router 3"
ending = ".cnc"

[numbers]
trailing_zeros = true

[text]
line_numbers = 10
carriage_returns = true

[control]
dwell = "x_seconds"
switches = [10, 11]

[program]
arcs = "radius"
repeat_motion = true
head = [
    "{unit} G17 G90 G94 G40 G49 G80",
    "G64",
    "G54",
    "(TOOL {tool:02} COMES)",
    "T{tool:02} M6",
    "S{speed} M3",
    "G4 X{dwell}",
]
next = ["S{speed} M3", "G4 X{dwell}"]

[extra]
start = ["M10 (DUST ON)"]
before_change = ["M11"]
after_change = ["M10"]
end = ["M11"]
)toml";

std::shared_ptr<const OwnDialect> post_of(const std::string& text) { return parse_own_post(text, "my.toml"); }

/// "code place", "" where the post is taken.
std::string refusal(const std::string& text) {
    try {
        (void)post_of(text);
        return "";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
        EXPECT_FALSE(error.remedy().empty()) << error.what();
        return error.code() + " " + error.place();
    }
}

std::string message(const std::string& text) {
    try {
        (void)post_of(text);
        return "";
    } catch (const Error& error) {
        return error.what();
    }
}

std::string with(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string based_on(const char* base, const std::string& rest) {
    return fmt::format("base = \"{}\"\nname = \"own\"\n{}", base, rest);
}

/// Moves with arcs of every turn, one operation or three in a program.
Plan plan_for(const Machine& machine) {
    Plan plan;
    plan.job.machine = machine;
    plan.input.file = "pump.stl";
    Layer& layer = plan.layers.emplace_back();
    layer.index = 2;
    layer.z_bottom = 18.5;
    layer.z_top = 37;
    layer.slab_thickness = 19;
    for (const int tool : {2, 2, 3}) {
        Operation operation;
        operation.kind = OperationKind::rough;
        operation.purpose = "levels";
        operation.tool = tool;
        operation.spindle_rpm = tool == 2 ? 18000 : 17000;
        operation.clearance_z = 47;
        operation.moves = {{10000, -20000, 470000, 0},          {10000, -20000, 470000, 0},
                           {10000, -20000, 320000, 1500},       {30000, 0, 320000, 9000, 0, 20000},
                           {0, 17321, 320000, 9000, -20000, 0}, {-500004, 1234567, 300000, 8999},
                           {-500004, 1234567, 470000, 0}};
        layer.operations.push_back(operation);
    }
    name_programs(plan);
    return plan;
}

std::string text_of(const Plan& plan) {
    std::string text;
    for (std::size_t i = 0; i < plan.layers[0].operations.size(); i = file_end(plan.layers[0], i))
        write_file(plan, plan.layers[0], i, [&](std::string_view piece) { text += piece; });
    return text;
}

}  // namespace

TEST(OwnPost, OneThatSaysNothingElseWritesTheSameBytes) {
    for (const Post base : kBases) {
        const std::string whole = post_toml(base);
        ASSERT_EQ(message(whole), "");
        const std::string bare = based_on(word_of(kPostWords, base), "");
        for (const std::string& text : {whole, bare})
            for (const LengthUnit units : kUnits)
                for (const ProgramSpan span :
                     {ProgramSpan::operation, ProgramSpan::tool, ProgramSpan::layer}) {
                    if (span == ProgramSpan::layer && !changes_tools(base)) continue;
                    Machine machine;
                    machine.post = base;
                    machine.units = units;
                    machine.programs = span;
                    const Plan built_in = plan_for(machine);
                    machine.own_post = post_of(text);
                    const Plan own = plan_for(machine);
                    EXPECT_EQ(own.layers[0].operations[2].file, built_in.layers[0].operations[2].file);
                    EXPECT_EQ(text_of(own), text_of(built_in)) << in_words(base, units);
                }
    }
}

TEST(OwnPost, SaysWhatItSaysOtherwise) {
    Machine machine;
    machine.post = Post::fanuc;
    machine.programs = ProgramSpan::layer;
    machine.own_post = post_of(kRouter);
    const Plan plan = plan_for(machine);
    const Layer& layer = plan.layers[0];
    EXPECT_EQ(layer.operations[0].file, "L002.cnc#1");
    const std::string text = text_of(plan);
    const std::size_t at = text.find("N130 G54");
    ASSERT_NE(at, std::string::npos) << text;
    EXPECT_EQ(text.substr(at, text.find("G1 X-50.0", at) - at),
              "N130 G54\r\n(TOOL 02 COMES)\r\nN150 T02 M6\r\nN160 S18000 M3\r\nN170 G4 X3.\r\n"
              "N180 M10 (DUST ON)\r\nN190 G0 G43 H2 Z10.000\r\nN200 G0 X1.000 Y-2.000\r\n"
              "N210 G1 Z-5.000 F1500.\r\nN220 G3 X3.000 Y0.000 R2.000 F9000.\r\n"
              "N230 G3 X2.000 Y1.732 R2.000\r\nN240 G3 X0.000 R2.000\r\nN250 ");
    const std::size_t change = text.find("M11\r\n");
    ASSERT_NE(change, std::string::npos);
    EXPECT_EQ(text.substr(change, 44), "M11\r\nN440 M5\r\nN450 T3 M6\r\nN460 M10\r\nN470 S17") << text;
    // Each line is counted, whatever it holds, and what the plan says of its program is what its text does.
    for (std::size_t i = 0; i < 3; ++i) {
        const Operation& op = layer.operations[i];
        const std::vector<std::uint32_t> lines = move_lines(plan, layer, op);
        EXPECT_EQ(program_line(plan, layer, op, 4, lines_before(plan, layer, op)), lines[4]);
        EXPECT_EQ(lines[4], lines[3] + 2) << "a long arc is two lines";
    }
    EXPECT_EQ(
        std::count(text.begin(), text.end(), '\n'),
        lines_before(plan, layer, layer.operations[2]) +
            line_count(plan, layer, layer.operations[2], lines_before(plan, layer, layer.operations[2])));
}

TEST(OwnPost, ArcsByRadiusReadBackAsTheArcsThatWereMeant) {
    std::mt19937 random(test::seed());
    const auto share = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (const Post base : {Post::linuxcnc, Post::haas, Post::grbl})
        for (const LengthUnit units : kUnits) {
            Machine machine;
            machine.post = base;
            machine.units = units;
            machine.own_post = post_of(based_on(word_of(kPostWords, base), "[program]\narcs = \"radius\"\n"));
            Plan plan = plan_for(machine);
            Operation& op = plan.layers[0].operations[0];
            std::vector<Move> moves(op.moves.begin(), op.moves.begin() + 3);
            Move at = moves.back();
            at.feed = 3000;
            for (int n = 0; n < 3000; ++n) {
                const double size = std::pow(10, share(1, 6.5)), begin = share(-3.1, 3.1),
                             turn = share(-3.1, 3.1);
                const Move from = at;
                at.i = static_cast<std::int32_t>(std::lround(-size * std::cos(begin)));
                at.j = static_cast<std::int32_t>(std::lround(-size * std::sin(begin)));
                at.x += at.i + static_cast<std::int32_t>(std::lround(size * std::cos(begin + turn)));
                at.y += at.j + static_cast<std::int32_t>(std::lround(size * std::sin(begin + turn)));
                const bool none = (at.x == from.x && at.y == from.y) || !at.is_arc();
                const double sweep = none ? 0 : arc_shape(from, at).sweep;
                const bool far = std::max(std::abs(at.x), std::abs(at.y)) > 100000000;
                if (none || far || std::abs(sweep) > 3.1 || (sweep > 0) != (turn > 0)) at = from;
                else moves.push_back(at);
            }
            at.i = at.j = 0;
            at.feed = 0;
            at.z = 470000;
            moves.push_back(at);
            op.moves = std::move(moves);
            const Dialect dialect = dialect_of(machine);
            Program program = read_program_text(program_text(plan, plan.layers[0], op), op.file, dialect);
            EXPECT_GT(program.arcs.size(), 1000u);
            const std::vector<std::uint32_t> lines = move_lines(plan, plan.layers[0], op);
            std::map<std::uint32_t, std::size_t> move_at;  // by the last of its lines
            for (std::size_t i = 0; i < lines.size(); ++i)
                if (lines[i] != 0) move_at.emplace(lines[i], i);
            for (const ProgramArc& arc : program.arcs) {
                const std::uint32_t line = program.steps[arc.begin].line;
                const std::size_t i = move_at.lower_bound(line)->second;
                const ArcShape meant = arc_shape(op.moves[i - 1], op.moves[i]);
                for (const double part : {0.0, 0.5, 1.0}) {
                    const auto [x, y] = arc.at(part);
                    EXPECT_LT(std::abs(std::hypot(x - meant.x, y - meant.y) - meant.radius), 2.5e-3)
                        << in_words(base, units) << " line " << line;
                }
                EXPECT_GT(arc.arc.turn * meant.sweep, 0) << line;
            }
            for (ProgramStep& step : program.steps) step.z += 37;
            for (ProgramArc& arc : program.arcs) arc.arc.z += 37;
            ProgramPlan said;
            said.spindle_rpm = op.spindle_rpm;
            said.feeds = written_feed_lengths(dialect, op.moves, program_origin(plan, plan.layers[0]));
            for (const Violation& v : check_program(program, said, &plan.job.tools[1], plan.job.machine))
                ADD_FAILURE() << in_words(base, units) << " " << v.code << " " << v.message;
        }
}

TEST(OwnPost, DamagedPostsAreRefusedClearlyOrWriteWhatIsMeant) {
    std::mt19937 random(test::seed());
    const auto pick = [&](std::size_t most) {
        return std::uniform_int_distribution<std::size_t>(0, most)(random);
    };
    const std::string alphabet = "{}[]()%;,.:=\"\\\n GMTSXYZIJRFHPNO0123456789tolespd";
    int taken = 0;
    for (int round = 0; round < 1500; ++round) {
        std::string text = round % 3 == 0 ? post_toml(kBases[pick(6)]) : kRouter;
        for (std::size_t n = 0; n <= pick(2); ++n) {
            const std::size_t at = pick(text.size() - 1);
            const char c = alphabet[pick(alphabet.size() - 1)];
            if (pick(2) == 0) text.erase(at, 1 + pick(3));
            else if (pick(1) == 0) text.insert(at, 1, c);
            else text[at] = c;
        }
        try {
            (void)post_of(text);
            ++taken;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what() << "\n" << text;
            EXPECT_EQ(error.code().substr(0, 5), "post.") << error.what();
            EXPECT_EQ(error.place().substr(0, 7), "my.toml") << error.what();
        }
    }
    EXPECT_GT(taken, 100);
    EXPECT_LT(taken, 1400);
}

TEST(OwnPost, TheExampleOfTheFormatsPageIsTaken) {
    const std::string page = slurp(support::checkout("io/FORMATS.md"));
    const std::size_t begin = page.find("```toml\nbase = ");
    ASSERT_NE(begin, std::string::npos);
    EXPECT_EQ(message(page.substr(begin + 8, page.find("\n```", begin + 8) - begin - 8)), "");
}

TEST(OwnPost, LineNumbersBeginAnewWhereFiveDigitsEnd) {
    Machine machine;
    machine.post = Post::linuxcnc;
    machine.own_post = post_of(based_on("linuxcnc", "[text]\nline_numbers = 1000\n"));
    Plan plan = plan_for(machine);
    std::vector<Move>& moves = plan.layers[0].operations[0].moves;
    for (int i = 0; i < 150; ++i) moves.insert(moves.begin() + 3, {10000 + i, -20000, 320000, 1500});
    const std::string text = program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
    EXPECT_NE(text.find("\nN99000 "), std::string::npos);
    EXPECT_EQ(text.find("\nN100000 "), std::string::npos);
    EXPECT_NO_THROW((void)read_program_text(text, "t", dialect_of(machine)));
}

TEST(OwnPost, PlansProvesAndVerifiesFromItsFolderAlone) {
    const TemporaryFolder folder;
    spit(folder / "router.toml", kRouter);
    for (const char* span : {"operation", "layer"})
        for (const char* units : {"mm", "in"}) {
            spit(folder / "job.toml",
                 fmt::format("[machine]\npost = \"router.toml\"\nunits = \"{}\"\nprograms = \"{}\"\n", units,
                             span));
            const Job job = read_job(folder / "job.toml");
            ASSERT_NE(job.machine.own_post, nullptr);
            EXPECT_EQ(job.machine.post, Post::fanuc);
            const std::string out = folder / "out";
            Context context;
            const PatternSource source(kModel);
            const VerifyResult result = write_verified(context, plan(context, source, job), out, source, 1);
            EXPECT_TRUE(result.passed) << (result.violations.empty() ? "" : result.violations[0].message);
            EXPECT_EQ(slurp(out + "/post.toml"), kRouter);
            EXPECT_FALSE(std::filesystem::exists(out + "/tool.tbl"));
            const std::string text = slurp(out + "/plan.json");
            EXPECT_EQ(schema_complaint(text, support::checkout("io/plan.schema.json")), "");
            const auto document = nlohmann::json::parse(text);
            EXPECT_EQ(document["job"]["machine"]["post"], "post.toml");
            EXPECT_EQ(document["post"]["name"], "Router 3");
            EXPECT_EQ(document["post"]["base"], "fanuc");
            // The folder alone, elsewhere, without the file that the job named.
            const std::string moved = folder / "moved";
            std::filesystem::remove_all(moved);
            std::filesystem::copy(out, moved, std::filesystem::copy_options::recursive);
            EXPECT_TRUE(verify(context, moved, source, {}, 1).passed);
        }
}

TEST(OwnPost, AFolderIsReplacedAndALayerMadeAgain) {
    const TemporaryFolder folder;
    spit(folder / "router.toml", kRouter);
    const Job job = read_job("", {}, folder / "router.toml");
    const std::string out = folder / "out";
    Context context;
    const Plan made = plan(context, PatternSource(kModel), job);
    write(context, made, out);
    EXPECT_NO_THROW(require_replaceable(out));
    write(context, made, out);
    int after = 0;
    for (const SequenceStep& step : made.sequence)
        if (step.layer == 2 && step.action == "face") after = step.id;
    const ResumeStatus status = resume_build(context, out, {after, 1, 1'795'617'730});
    ASSERT_FALSE(status.programs.empty());
    EXPECT_EQ(status.programs[0], "resume_001/nc/F001_L002_face_off_T1.cnc");
    const std::string text = slurp(out + "/" + status.programs[0]);
    EXPECT_NE(text.find("M10 (DUST ON)\r\n"), std::string::npos);
    EXPECT_NE(text.find("O8001"), std::string::npos);
}

TEST(OwnPost, AFolderTellsOfADamagedProgramOrPost) {
    const TemporaryFolder folder;
    spit(folder / "router.toml", kRouter);
    const std::string out = folder / "out";
    Context context;
    const PatternSource source(kModel);
    write(context, plan(context, source, read_job("", "fixed", folder / "router.toml")), out);
    const auto told = [&] {
        try {
            const SimulationReport report = verify_folder(context, out, {.source = source, .cell = 1}).report;
            return report.violations.empty() ? std::string() : report.violations[0].code;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::verification) << error.what();
            return error.code();
        }
    };
    ASSERT_EQ(told(), "");
    const std::string program = out + "/nc/L001_02_rough_T2.cnc", text = slurp(program);
    struct Damage {
        const char *from, *to, *code;
    };
    for (const Damage& d :
         {Damage{"T02 M6", "T03 M6", "gcode.offset"}, Damage{"Z10.000", "Z10", "gcode.decimal_point"},
          Damage{"G4 X3.", "G4 X0.3", "program.spin_up"}, Damage{"M10", "M12", "gcode.unknown_word"},
          Damage{"M10 (DUST ON)", "M10 S9", "gcode.switch"},
          Damage{"M10 (DUST ON)", "M10 P1 P2", "gcode.twice"},
          Damage{" R72.213", " R-72.213", "program.lengths"}, Damage{"G21", "G20", "gcode.left_in_force"}}) {
        spit(program, with(text, d.from, d.to));
        EXPECT_EQ(told(), d.code) << d.from << " > " << d.to;
    }
    // The switch is named, not what stands before it.
    spit(program, with(text, "M10 (DUST ON)", "M5 M10"));
    try {
        (void)verify_folder(context, out, {.source = source, .cell = 1});
        ADD_FAILURE() << "a switch beside another word passes";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "gcode.switch");
        EXPECT_NE(std::string(error.what()).find("M10 beside other words"), std::string::npos)
            << error.what();
    }
    spit(program, text);
    const std::string post = out + "/post.toml";
    spit(post, kRouter + "# a word more\n");
    EXPECT_EQ(told(), "verify.post");
    spit(post, "");
    EXPECT_EQ(told(), "verify.post");
    std::filesystem::remove(post);
    EXPECT_EQ(told(), "verify.post");
    // A post that is none of ours, with the right sum.
    spit(post, kRouter);
    ASSERT_EQ(told(), "");
    auto document = nlohmann::json::parse(slurp(out + "/plan.json"));
    document.erase("post");
    spit(out + "/plan.json", document.dump());
    EXPECT_EQ(told(), "verify.plan");
}

TEST(OwnPost, ProbesTellWhatAPostLoses) {
    struct Loss {
        const char *base, *rest, *told;
    };
    for (const Loss& loss : {
             Loss{"linuxcnc", "[numbers]\ndecimals = 0\n", "is read where"},
             Loss{"linuxcnc", "[numbers]\ndecimals = 2\n", "is read where"},
             Loss{"iso", "[numbers]\ninch_decimals = 3\n", "in inches"},
             Loss{"iso", "[numbers]\ninch_feed_decimals = 0\n", "a feed of zero"},
             Loss{"fanuc", "[numbers]\npoint = false\n", "without its decimal point"},
             Loss{"haas", "[numbers]\npoint = false\nneeds_point = false\n",
                  "0.003 s after the spindle started"},
             Loss{"mach", "[program]\nfirst = [\"G0 G43 H{tool}\"]\n", "z 10.0000 is meant"},
             Loss{"mach", "[program]\nfirst = [\"G0 G43 H{tool} Z10\"]\n", "z 12.5000 is meant"},
             Loss{"mach", "[program]\nfirst = [\"G0 Z{z}\"]\n", "G43"},
             Loss{"mach", "[program]\nfirst = [\"G0 G43 H7 Z{z}\"]\n", "length offset of another tool"},
             Loss{"mach", "[program]\nfirst = []\n", "without a motion"},
             Loss{"mach", "[program]\nchange = [\"M5\"]\n", "tool"},
             Loss{"mach", "[program]\nchange = [\"T{tool} M6\"]\n", "while the spindle turns"},
             Loss{"mach", "[program]\nnext = [\"S9000 M3\", \"G4 P{dwell}\"]\n", "9000 rpm"},
             Loss{"mach", "[program]\nnext = [\"S{speed} M3\"]\n", "started"},
             Loss{"mach", "[program]\nnext = [\"S{speed} M3\", \"G4 P{dwell_ms}\"]\n", "dwells"},
             Loss{"mach", "[control]\ndwell = \"x_seconds\"\n", "G4"},
             Loss{"mach", "[program]\nend = [\"M5\"]\n", "does not end"},
             Loss{"mach", "[program]\nend = [\"M5\", \"M30\", \"M5\"]\n", "after the program's end"},
             Loss{"siemens", "[program]\narcs = \"radius\"\n", "a word R"},
             Loss{"mach", "[program]\ncentres = []\n", "G91.1"},
             Loss{"mach", "[text]\nforbidden = \"-\"\n", "acts on"},
             Loss{"mach", "[text]\nforbidden = \"G\"\n", "acts on"},
             Loss{"fanuc", "[program]\nbegin = [\"O{number:04}\"]\n", "% mark"},
             Loss{"fanuc", "[program]\nbegin = [\"%\"]\n", "O"},
             Loss{"fanuc", "[program]\nbegin = [\"%\", \"O1234\"]\n", "program number 1234"},
             Loss{"linuxcnc",
                  "[program]\nhead = [\"{unit} G17 G90 G94 G40 G49 G80\", \"G8 G97\", \"G54\", \"T{tool} "
                  "M6\", "
                  "\"G43 H{tool}\", \"S{speed} M3\", \"G4 P{dwell}\"]\n",
                  "G64"},
             Loss{"linuxcnc",
                  "[program]\nhead = [\"{unit} G17 G90 G94 G40 G49 G80\", \"G8 G97\", \"G64 P0.5\", \"G54\", "
                  "\"T{tool} M6\", \"G43 H{tool}\", \"S{speed} M3\", \"G4 P{dwell}\"]\n",
                  "leave its path"},
             Loss{"linuxcnc",
                  "[program]\nhead = [\"{unit} G18 G90 G94 G40 G49 G80\", \"G8 G97\", \"G64 P{blend} Q0\", "
                  "\"G54\", \"T{tool} M6\", \"G43 H{tool}\", \"S{speed} M3\", \"G4 P{dwell}\"]\n",
                  "plane"},
         }) {
        const std::string text = based_on(loss.base, loss.rest);
        const std::string what = message(text);
        EXPECT_EQ(refusal(text), "post.probe my.toml") << loss.rest << what;
        EXPECT_NE(what.find(loss.told), std::string::npos) << loss.rest << what;
    }
}

TEST(OwnPost, OtherWaysOfSayingItAreTaken) {
    for (const char* rest : {
             "[numbers]\ndecimals = 3\ntrailing_zeros = true\n",
             "[numbers]\npoint = true\n",
             "[numbers]\ninch_decimals = 4\n",
             "[text]\ncomments = \"none\"\n",
             "[text]\ncomments = \"parentheses\"\n",
             "[text]\ncapitals = true\nlongest_comment = 30\nlongest_line = 60\nforbidden = \"#*\"\n",
             "[text]\nline_numbers = 1\n",
             "[program]\narcs = \"radius\"\n",
             "[program]\nrepeat_motion = true\n",
             "[program]\nfirst = [\"G0 Z{z}\"]\n",
             "[control]\nswitches = [7, 64, 65]\n[extra]\nstart = [\"M7\", \"M64 P1\"]\nend = [\"M65 P1\"]\n",
             "[extra]\nbefore_change = [\"(tool {tool:02} of program {number}, {name})\", \"\"]\n",
         })
        EXPECT_EQ(message(based_on("linuxcnc", rest)), "") << rest;
    EXPECT_EQ(message(based_on("fanuc", "[numbers]\npoint = false\nneeds_point = false\n")), "");
    EXPECT_EQ(message(based_on("linuxcnc", "[text]\ncomments = \"semicolon\"\n")), "");
}

TEST(OwnPost, LinesThatMoveOrChangeWhatTheProofReliesOnAreRefusedByName) {
    for (const char* line :
         {"G0 X0 Y0", "G1 Z5", "G2 X0 I1", "G3 X0 I1",     "G28",    "G30",       "G53 G0 Z0", "X5",
          "G91",      "G20",   "G21",      "G55",          "G56",    "G57",       "G58",       "G59",
          "G59.1",    "G59.2", "G59.3",    "G10 L2 P1 X0", "G52 X1", "G92 X0",    "G43.1 Z1",  "M0",
          "M1",       "M4",    "M7",       "M8",           "M60",    "M98 P1000", "M99",       "G90.1"})
        for (const char* part : {"program]\nend", "program]\nbegin", "program]\nchange", "extra]\nstart"}) {
            const std::string text = based_on("linuxcnc", fmt::format("[{} = [\n  \"{}\"]\n", part, line));
            const std::string found = refusal(text);
            EXPECT_TRUE(found == "post.state my.toml:5" || found == "post.template my.toml:5")
                << part << " " << line << ": " << message(text);
            const std::string word = std::string(line).substr(0, std::string(line).find(' '));
            EXPECT_NE(message(text).find(word), std::string::npos) << message(text);
        }
    for (const char* line :
         {"M3", "S9000", "T2", "M6", "G4 P1", "G49", "M9", "M10", "G64 P1", "{unit}", "M5"})
        EXPECT_EQ(refusal(based_on("linuxcnc", fmt::format("[extra]\nend = [\"{}\"]\n", line))).substr(0, 5),
                  "post.")
            << line;
}

TEST(OwnPost, NothingIsInjectedByALine) {
    for (const char* line :
         {"M5\\nM30",     "M5\\rM30",      "M5 \\u0000", "M5 \\u00e4",      "%",          "M5 %",  "%%",
          "(LOGOPEN, x)", "(PROBEOPEN x)", "(MSG, x)",   "(a (b) c)",       "(open",      "{tool", "tool}",
          "{}",           "{0}",           "{tool:x}",   "{tool:99999999}", "{tool:02d}", "{z}",   "{file}",
          "{{tool}}",     "O<sub> call",   "#1=5",       "M5 ;py,x",        "(py, x)",    "[1+2]", "/M5"}) {
        const std::string text =
            based_on("linuxcnc", fmt::format("[program]\nchange = [\n  \"{}\"]\n", line));
        EXPECT_EQ(refusal(text), "post.template my.toml:5") << line << message(text);
    }
    EXPECT_EQ(refusal(based_on("linuxcnc", "[program]\nnotes = [\"a\\nM30\"]\n")), "post.template my.toml:4");
    EXPECT_EQ(refusal(based_on("linuxcnc", "[text]\nforbidden = \"\\n\"\n")), "post.range my.toml:4");
}

TEST(OwnPost, KeysAndValuesAreHeldToTheTable) {
    struct Wrong {
        const char *text, *found;
    };
    for (const Wrong& w : {
             Wrong{"base = \"fanuc\"\nname = \"a\"\nnmae = \"b\"\n", "post.unknown_key my.toml:3"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[numbers]\ndecimal = 3\n", "post.unknown_key my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[text]\ndecimals = 3\n", "post.unknown_key my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[text]\nline_end = \"crlf\"\n",
                   "post.unknown_key my.toml:4"},
             Wrong{"name = \"a\"\n", "post.missing_key my.toml"},
             Wrong{"base = \"fanuc\"\n", "post.missing_key my.toml"},
             Wrong{"base = \"heidenhain\"\nname = \"a\"\n", "post.base my.toml:1"},
             Wrong{"base = \"fanoc\"\nname = \"a\"\n", "post.base my.toml:1"},
             Wrong{"base = 3\nname = \"a\"\n", "post.type my.toml:1"},
             Wrong{"base = \"fanuc\"\nname = \"\"\n", "post.range my.toml:2"},
             Wrong{"base = \"fanuc\"\nname = \"a\\nb\"\n", "post.range my.toml:2"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\nending = \".exe\"\n", "post.word my.toml:3"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\nending = \"/../x.nc\"\n", "post.word my.toml:3"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\nnumbers = 3\n", "post.type my.toml:3"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[numbers]\ndecimals = 5\n", "post.range my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[numbers]\ndecimals = -1\n", "post.range my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[numbers]\ndecimals = 2.5\n", "post.type my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[text]\nlongest_line = 100000\n", "post.range my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[control]\ndwell = \"p_minutes\"\n",
                   "post.word my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[control]\nswitches = [6]\n", "post.range my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[control]\nswitches = [30]\n", "post.range my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[control]\nswitches = [10, \"x\"]\n",
                   "post.type my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[program]\nend = \"M5\"\n", "post.type my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[program]\nend = [5]\n", "post.type my.toml:4"},
             Wrong{"base = \"fanuc\"\nname = \"a\"\n[text]\ncomments = \"both\"\n", "post.range my.toml:4"},
             Wrong{"base = \"siemens\"\nname = \"a\"\n[text]\ncomments = \"parentheses\"\n",
                   "post.range my.toml:4"},
             Wrong{"base = \"grbl\"\nname = \"a\"\n[text]\nlongest_line = 100\n", "post.range my.toml:4"},
             Wrong{"base = \"grbl\"\nname = \"a\"\n[text]\nlongest_comment = 71\n", "post.range my.toml:4"},
             Wrong{"base = \"fanuc\nname = \"a\"\n", "post.syntax my.toml:1"},
             Wrong{"a.b.c.d.e.f.g.h.i.j.k = 1\n", "post.syntax my.toml:1"},
         })
        EXPECT_EQ(refusal(w.text), w.found) << w.text << message(w.text);
    EXPECT_NE(message("base = \"fanuc\"\nname = \"a\"\n[numbers]\ndecimal = 3\n")
                  .find("did you mean numbers.decimals?"),
              std::string::npos);
    std::string many = "base = \"fanuc\"\nname = \"a\"\n[program]\nnotes = [";
    for (int i = 0; i < 70; ++i) many += "\"a\",";
    EXPECT_EQ(refusal(many + "]\n"), "post.range my.toml:4");
    EXPECT_EQ(refusal("base = \"fanuc\"\nname = \"a\"\n" + std::string(100000, '[')).substr(0, 11),
              "post.syntax");
}

TEST(OwnPost, OnlyARegularFileOfSomeKilobytesIsRead) {
    const TemporaryFolder folder;
    const auto code = [&](const std::string& post) {
        spit(folder / "job.toml", "[machine]\npost = \"" + post + "\"\n");
        try {
            (void)read_job(folder / "job.toml");
            return std::string();
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::usage);
            return error.code();
        }
    };
    spit(folder / "own.toml", post_toml(Post::mach));
    EXPECT_EQ(code("own.toml"), "");
    EXPECT_EQ(code("./own.toml"), "");
    EXPECT_EQ(code("none.toml"), "post.missing");
    std::filesystem::create_directory(folder / "a.toml");
    EXPECT_EQ(code("a.toml"), "post.directory");
    ASSERT_EQ(::mkfifo((folder / "pipe.toml").c_str(), 0600), 0);
    EXPECT_EQ(code("pipe.toml"), "post.unreadable");
    std::filesystem::create_symlink("/dev/zero", folder / "zero.toml");
    EXPECT_EQ(code("zero.toml"), "post.unreadable");
    spit(folder / "huge.toml", std::string(1 << 17, '#'));
    EXPECT_EQ(code("huge.toml"), "post.too_large");
    EXPECT_EQ(code("heidenhein"), "job.word");
    // A job that is no file reads no others.
    EXPECT_THROW((void)job_from_toml("machine.post = \"own.toml\"\n", "line"), Error);
}

TEST(OwnPost, AnOptionGoesBeforeTheJob) {
    const TemporaryFolder folder;
    spit(folder / "own.toml", post_toml(Post::mach));
    spit(folder / "job.toml", "[machine]\npost = \"own.toml\"\n");
    EXPECT_EQ(read_job(folder / "job.toml").machine.post, Post::mach);
    const Job haas = read_job(folder / "job.toml", {}, "haas");
    EXPECT_EQ(haas.machine.post, Post::haas);
    EXPECT_EQ(haas.machine.own_post, nullptr);
    EXPECT_NE(read_job("", {}, folder / "own.toml").machine.own_post, nullptr);
    EXPECT_THROW((void)read_job("", {}, "haaas"), Error);
    // Keys that come later leave the post as it is, unless they name one.
    const Job job = read_job(folder / "job.toml");
    EXPECT_NE(job_from_toml("units = \"in\"\n", "line", job).machine.own_post, nullptr);
    EXPECT_EQ(job_from_toml("machine.post = \"grbl\"\n", "line", job).machine.own_post, nullptr);
}

TEST(OwnPost, AProgramOfAnotherControlIsToldByTheName) {
    Machine machine;
    machine.post = Post::fanuc;
    machine.own_post = post_of(kRouter);
    Plan plan = plan_for(machine);
    Machine other;
    other.post = Post::siemens;
    const Plan foreign = plan_for(other);
    const std::string text = program_text(foreign, foreign.layers[0], foreign.layers[0].operations[0]);
    try {
        (void)read_planned_program(text, "nc/x", plan.job);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), kForeignProgram);
        EXPECT_NE(error.message().find("siemens where the plan's are for \"Router 3\""), std::string::npos)
            << error.message();
    }
}
