// What readers of programs, posts, jobs, plans and lists refuse that no other test hands them: one wrong word
// or number in a text that is right otherwise.
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/probe_check.h"
#include "io/posts/sheet_reader.h"
#include "io/read/dowel_list_check.h"
#include "io/read/job_toml.h"
#include "io/read/own_post.h"
#include "io/read/planned_folder.h"
#include "io/read/sequence_reader.h"
#include "io/read/sheet_post.h"
#include "io/slabwright.h"
#include "io/text/sha256.h"
#include "io/write/model_file.h"
#include "io/write/plan_json.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/files.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::spit;
using support::TemporaryFolder;

/// "code place: message" of what a call throws; "" where it throws nothing.
std::string refusal(const std::function<void()>& call) {
    try {
        call();
    } catch (const Error& error) {
        EXPECT_FALSE(error.remedy().empty()) << error.what();
        return error.code() + ' ' + error.place() + ": " + error.message();
    }
    return "";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

struct Change {
    std::string from, to, found;
};

const std::string kBlocks =
    "BEGIN PGM a MM\n"
    "TOOL CALL 2 Z S18000\n"
    "CYCL DEF 32.0 TOLERANCE\n"
    "CYCL DEF 32.1 T0.02\n"
    "M3\n"
    "L Z+10 R0 FMAX\n"
    "L X+0 Y+0 FMAX\n"
    "L Z-1 F500\n"
    "CC X+5 Y+0\n"
    "C X+10 Y+0 DR+ F900\n"
    "L Z+10 FMAX\n"
    "M30\n"
    "END PGM a MM\n";

std::string numbered(const std::string& lines) {
    std::string text;
    int number = 0;
    for (std::size_t at = 0; at < lines.size();) {
        const std::size_t end = lines.find('\n', at) + 1;
        text += std::to_string(number++) + ' ' + lines.substr(at, end - at);
        at = end;
    }
    return text;
}

TEST(ReaderRefusals, ConversationalPrograms) {
    const auto read = [](const std::string& lines) {
        return refusal(
            [&] { (void)read_operations(numbered(lines), "a.h", dialect_of(Post::heidenhain), {}); });
    };
    EXPECT_EQ(read(kBlocks), "");
    const std::string again = "TOOL CALL 2 Z S9000\nM3\nL X+9 FMAX\nL Z+10 FMAX\nM30\n";
    EXPECT_EQ(read(replaced(kBlocks, "M30\n", again)), "") << "the same tool, at another speed";
    for (const Change& c : std::vector<Change>{
             {"CALL 2 Z S18000", "CALL 2 Z",
              "gcode.tool a.h:2: TOOL CALL needs a number, the axis Z and a speed S"},
             {"2 Z S", "2 X S", "gcode.tool a.h:2: TOOL CALL needs a number, the axis Z and a speed S"},
             {"M30\n", replaced(again, "2", "3"), "gcode.tool a.h:12: a tool call while the spindle turns"},
             {"CYCL DEF 32.0 TOLERANCE\nCYCL DEF 32.1 T0.02\n", "",
              "gcode.unset a.h:4: a motion before how far the control may leave its path (CYCL DEF 32)"},
             {"CC X+5 Y+0", "CC X+5", "gcode.arc a.h:9: CC needs the X and the Y of a centre"},
             {"CC X+5 Y+0", "CC X+5 Y+0 Z+0", "gcode.arc a.h:9: CC needs the X and the Y of a centre"},
             {"C X+10 Y+0", "C X+10", "gcode.arc a.h:10: an arc needs the X and the Y of its end, and no Z"},
             {"C X+10 Y+0", "C X+10 Y+0 Z-2",
              "gcode.arc a.h:10: an arc needs the X and the Y of its end, and no Z"}})
        EXPECT_EQ(read(replaced(kBlocks, c.from, c.to)), c.found) << c.from << " -> " << c.to;
}

TEST(ReaderRefusals, ProgramsOfLettersAndNumbers) {
    const std::string head =
        "G21 G17 G90 G94 G40 G49 G80\nG54 G8 G97 G91.1 G64 P0.02 Q0\nT3 M6\nG43 H3\nS18000 M3\nG4 P3\n";
    const auto read = [&](const std::string& body) {
        return refusal([&] { (void)read_gcode(head + body + "M5\nM2\n", "a.ngc"); });
    };
    EXPECT_EQ(read("G0 X0 Y0 Z0\nG2 X10 Y0 I5 F100\n"), "");
    EXPECT_EQ(read("G0 X0 Y0 Z0\nG2 X10 Y0 R5 F100\n"), "");
    EXPECT_EQ(read("G0 X0 Y0 Z0\nG2 X10 Y0 R5 I5 F100\n"),
              "gcode.arc a.ngc:8: an arc with both a radius and a centre");
    EXPECT_EQ(read("G0 Z0\nG2 X10 Y0 I5 F100\n"),
              "gcode.unknown_place a.ngc:8: a feed motion from or to an unknown place");
    EXPECT_EQ(read("% G0 Z0\n"), "gcode.percent a.ngc:7: text beside a % mark");
    EXPECT_EQ(read("G0 Z0 %\n"), "gcode.percent a.ngc:7: text beside a % mark");
    std::string many;
    for (int i = 0; i < 17; ++i) many += "G80 ";
    EXPECT_EQ(read(many + "\n"), "gcode.twice a.ngc:7: more G words in one line than there are groups");
    for (const char* number : {"2.5", "-1", "100000"})
        EXPECT_EQ(refusal([&] { (void)read_gcode("T" + std::string(number) + " M6\nM2\n", "a.ngc"); }),
                  "gcode.number a.ngc:1: T needs a whole number");
    EXPECT_EQ(read("G43 H3.5\n"), "gcode.number a.ngc:7: H needs a whole number");
    for (const char* word : {"ADIS=0.02", "ADISPOS=0.02", "G60 ADIS=0.02"})
        EXPECT_EQ(refusal([&] { (void)read_program_text(word, "a.mpf", dialect_of(Post::siemens)); }),
                  "gcode.unused_word a.mpf:1: ADIS without G641");
}

TEST(ReaderRefusals, APartOfAProgramThatHasNoFirst) {
    Plan plan;
    Layer& layer = plan.layers.emplace_back();
    layer.index = 1;
    layer.z_top = 18;
    Operation& operation = layer.operations.emplace_back();
    operation.tool = 2;
    operation.spindle_rpm = 18000;
    operation.clearance_z = 30;
    operation.moves = {
        {0, 0, 300000, 0}, {0, 0, 100000, 1500}, {500000, 0, 100000, 9000}, {500000, 0, 300000, 0}};
    const auto written = [&](const char* file) {
        operation.file = file;
        return refusal([&] { (void)program_text(plan, layer, operation); });
    };
    EXPECT_EQ(written("a.ngc#1"), "");
    EXPECT_EQ(written("a.ngc#2"),
              "program.unsafe a.ngc#2: layer 1 has nothing before a.ngc#2 in its program");
}

TEST(ReaderRefusals, PostsOfOnesOwn) {
    const auto read = [](const std::string& rest) {
        return refusal(
            [&] { (void)parse_own_post("base = \"linuxcnc\"\nname = \"own\"\n" + rest, "my.toml"); });
    };
    const std::string head =
        "[program]\nhead = [\"{unit} G17 G90 G94 G40 G49 G80\", \"G8 G97\", \"G64 P{blend} Q0\", \"G54\", "
        "\"T{tool} M6\", \"G43 H{tool}\", \"S{speed} M3\", \"G4 P{dwell}\"]\n";
    EXPECT_EQ(read(head), "");
    EXPECT_EQ(read("[text]\nlongest_line = 60\n[program]\nchange = [\n\"(" + std::string(59, 'x') + ")\"]\n"),
              "post.template my.toml:7: the line \"(" + std::string(59, 'x') +
                  "\": 61 characters; text.longest_line is 60");
    EXPECT_EQ(read("[program]\nchange = [\n\"M19\"]\n"),
              "post.template my.toml:5: the line \"M19\": M19, which linuxcnc programs do not use");
    const std::string loses =
        "post.probe my.toml: a program that this post writes in millimetres loses what ";
    EXPECT_EQ(read("[program]\nnext = [\"S{speed}\", \"G64 P{blend} Q0\", \"G4 P{dwell}\"]\n"),
              loses + "was meant: 1 operations are read where 2 are meant");
    EXPECT_EQ(read(replaced(replaced(head, "T{tool}", "T7"), "H{tool}", "H7")),
              loses + "was meant: tool 7 is read where 12 is meant");
    EXPECT_EQ(refusal([] { (void)post_toml(Post::heidenhain); }),
              "post.base : heidenhain is conversational: its blocks are no lines of letters and numbers");
}

/// The codes and messages of what is found, one a line.
std::string told(const std::vector<Violation>& found) {
    std::string all;
    for (const Violation& v : found) all += v.code + ' ' + std::to_string(v.line) + ": " + v.message + '\n';
    return all;
}

TEST(ReaderRefusals, ProbingPrograms) {
    const std::string probe =
        "G21 G17 G40 G49 G80 G90 G94\nG54\nT99 M6\nG43 H99\nM5\nG91\nG38.2 Z-20 F200\nG0 Z2\nG38.2 Z-4 F50\n"
        "G10 L20 P1 Z5\nG0 Z10\nG90\nM2\n";
    Job job;
    const auto found = [&](const std::string& from, const std::string& to) {
        return told(check_probe(replaced(probe, from, to), "a.ngc", {99, 5}, job));
    };
    EXPECT_EQ(found("", ""), "");
    EXPECT_EQ(found("T99 M6", "T99"), "probe.tool 3: names a tool without M6\n");
    EXPECT_EQ(found("Z5", "Z6"),
              "probe.offset 10: says z 6.0000 mm where it touches; the plan says 5.0000 mm\n");
    job.machine.post = Post::grbl;
    EXPECT_EQ(found("T99 M6\nG43 H99", "T99"), "");
    EXPECT_EQ(found("T99 M6\nG43 H99", "T99 M6"), "probe.tool 3: changes the tool\n");
}

TEST(ReaderRefusals, WhatSwitchesBesideTheHeadOfAJet) {
    const auto read = [](const std::string& line) {
        return refusal([&] {
            (void)read_sheet_program(
                "(stock 300 x 200 thickness 6 kerf 0.8 jet)\n(beside the head " + line + ")\nM2\n", "a.ngc");
        });
    };
    EXPECT_EQ(read("M64 P1"), "");
    for (const char* line :
         {"M3", "M4", "M5", "M03", "M005", "M2", "G0 Z5", "M64 P1 S9", "M064 P1", "M64 P01"})
        EXPECT_EQ(read(line), "gcode.switch a.ngc:2: words beside the head that do not switch something else")
            << line;
}

TEST(ReaderRefusals, ListsOfDowels) {
    BuildPlan build;
    build.stock_max = {100, 80};
    build.layers = {{1, 0, 18, 18, 1, {}, {}, {{10, 20, 8, 20, 15}}}, {2, 18, 36, 18, 1, {}, {}}};
    const std::string good =
        "layer,slab,hole,diameter_mm,depth_mm,from_left_mm,from_front_mm,dowel_length_mm\n"
        "2,1,1,8,15,90,20,34\n";
    EXPECT_EQ(told(check_dowel_list(good, build)), "");
    const std::string bare = "dowel.list 0: layer 2: no hole goes over the dowel at x 10.00 y 20.00 mm\n",
                      none = "dowel.list 2: is of a slab that the plan does not have\n" + bare;
    EXPECT_EQ(told(check_dowel_list(replaced(good, "\n2,1,", "\n3,1,"), build)), none);
    EXPECT_EQ(told(check_dowel_list(replaced(good, "\n2,1,", "\n2,2,"), build)), none);
    EXPECT_EQ(told(check_dowel_list(replaced(good, ",34", ",33"), build)),
              "dowel.list 2: layer 2, hole 1: its dowel is 34 mm long, not 33\n");
}

TEST(ReaderRefusals, ToolsOfAJob) {
    const auto read = [](const std::string& text) {
        return refusal([&] { (void)parse_job(text, "job.toml"); });
    };
    EXPECT_EQ(read("[tools]\nlibrary = \"shop\"\n"), "");
    EXPECT_EQ(read("tools = 3\n"), "job.type job.toml:1: tools is a whole number, not a table");
    EXPECT_EQ(read("\n[tools]\nnumbers = [1]\n"), "job.missing_key job.toml:2: tools.library is missing");
    EXPECT_EQ(read("[tools]\nlibrary = 3\n"),
              "job.type job.toml:2: tools.library is a whole number, not a text in quotes");
}

TEST(ReaderRefusals, PostsForSheets) {
    const auto read = [](int lines) {
        std::string text = "[jet]\nbegin = [";
        for (int i = 0; i < lines; ++i) text += "\"M64 P1\",";
        return refusal([&] { (void)parse_sheet_post(text + "]\n", "p.toml"); });
    };
    EXPECT_EQ(read(64), "");
    EXPECT_EQ(read(65), "post.range p.toml:2: jet.begin has 65 lines");
}

TEST(ReaderRefusals, Sequences) {
    const std::string good =
        R"({"schema":"slabwright.sequence/1","units":"mm","frame":"pattern-base","pattern":"a.stl",)"
        R"("sha256":"0","steps":[{"id":1,"layer":1,"action":"clear","seconds":1,"needs":[]}],"glue":[]})";
    const auto read = [](std::string_view text) { return refusal([&] { (void)read_sequence(text); }); };
    EXPECT_EQ(read(good), "");
    EXPECT_EQ(read(replaced(good, "\"seconds\":1", "\"seconds\":\"1\"")),
              "verify.sequence sequence.json: steps[0].seconds is no number");
    const auto bead = [&](const std::string& of) {
        return read(replaced(good, "\"glue\":[]", R"("glue":[{"layer":1,"loops":[],"beads":[)" + of + "]}]"));
    };
    EXPECT_EQ(bead("[1,2,3]"), "");
    for (const char* none : {"[1,2]", "[1,2,3,4]", "5", R"({"x":1,"y":2,"r":3})"})
        EXPECT_EQ(bead(none), "verify.sequence sequence.json: glue[0].beads has one that is no three numbers")
            << none;
    // Zeros that nobody reads take no memory.
    const std::size_t size = kLargestSequence + 1;
    const std::unique_ptr<char, decltype(&std::free)> zeros(static_cast<char*>(std::calloc(size, 1)),
                                                            &std::free);
    ASSERT_NE(zeros, nullptr);
    EXPECT_EQ(read({zeros.get(), size}),
              "verify.sequence sequence.json: has 268435457 bytes, over 268435456");
}

/// A box, planned; plan.json of its folder is changed and read.
class PlannedBox {
public:
    PlannedBox() {
        Context context;
        const std::string stl = folder_ / "box.stl";
        write_model(stl, weld(context, shapes::box({0, 0, 0}, {20, 20, 10})));
        plan_ = json::parse(plan_json(plan(context, PatternSource{stl}, Job{})));
    }
    [[nodiscard]] std::string post_file() const { return folder_ / "post.toml"; }
    /// What is refused, its place without the folder; "" where the changed plan is read.
    [[nodiscard]] std::string found(const std::function<void(json&)>& change) const {
        json changed = plan_;
        change(changed);
        spit(folder_ / "plan.json", changed.dump());
        const std::string all = refusal([&] { (void)read_planned_folder(folder_.path, {}); });
        return all.empty() ? all : replaced(all, folder_ / "", "");
    }

private:
    TemporaryFolder folder_;
    json plan_;
};

TEST(ReaderRefusals, Plans) {
    const PlannedBox box;
    ASSERT_EQ(box.found([](json&) {}), "");
    struct Wrong {
        const char *way, *value, *found;
    };
    for (const Wrong& w : {
             Wrong{"/stock/min", "[0]", "plan.stock.min[1] is missing"},
             Wrong{"/frame", "\"table\"", "plan.frame says \"table\", which is none of its words"},
             Wrong{"/layers/0/operations/0/kind", "\"saw\"",
                   "plan.layers[0].operations[0].kind says \"saw\", which is no kind of operation"},
             Wrong{"/layers/0/underside", R"({"folder":"undersides/L002","minutes":1})",
                   "plan.layers[0].underside.folder is not that of the layer"},
             Wrong{"/job/machine/glue_pitch", "0",
                   "plan.job.machine states a glue head or a handler that does not work"},
             Wrong{"/job/machine/handler_speed", "-1",
                   "plan.job.machine states a glue head or a handler that does not work"},
             Wrong{"/job/machine/magazine", "-1",
                   "plan.job.machine states a magazine of no number of places"},
             Wrong{"/job/machine/magazine", "1001",
                   "plan.job.machine states a magazine of no number of places"},
             Wrong{"/job/machine/max_feed", "0", "plan.job.machine states a machine that does not move"},
             Wrong{"/job/machine/acceleration", "-1", "plan.job.machine states a machine that does not move"},
         })
        EXPECT_EQ(box.found([&](json& p) { p[json::json_pointer(w.way)] = json::parse(w.value); }),
                  std::string("verify.plan plan.json: ") + w.found)
            << w.way;
    for (const double radius : {0.0, 100.0})
        EXPECT_EQ(box.found([&](json& p) {
            p["tools"][0]["kind"] = "bull-nose";
            p["tools"][0]["corner_radius"] = radius;
        }),
                  "verify.plan plan.json: plan.tools[0].corner_radius is no corner of a bull-nose");
    EXPECT_EQ(box.found([](json& p) { p["keep_outs"] = {json::object()}; })
                  .find("verify.plan plan.json: plan.keep_outs are none: "),
              0U);
}

TEST(ReaderRefusals, PlansWhosePartsDoNotFollowEachOther) {
    const PlannedBox box;
    const auto named = [&](const std::vector<const char*>& files) {
        return box.found([&](json& p) {
            json& operations = p["layers"][0]["operations"];
            const json first = operations[0];
            operations = json::array();
            for (const char* file : files) {
                operations.push_back(first);
                operations.back()["file"] = file;
            }
        });
    };
    EXPECT_EQ(named({"a.ngc#1", "a.ngc#2", "b.ngc"}), "");
    EXPECT_EQ(named({"a.ngc#1", "b.ngc", "a.ngc#2"}),
              "verify.plan plan.json: plan.layers[0].operations[2].file does not follow the operation "
              "before it in its program");
}

// A post whose sum is the plan's, and which no version would have written with.
TEST(ReaderRefusals, PlansWithAPostThatIsNone) {
    const PlannedBox box;
    const auto with_post = [&](const std::string& text) {
        spit(box.post_file(), text);
        return box.found([&](json& p) {
            p["job"]["machine"]["post"] = "post.toml";
            p["post"] = {{"sha256", sha256(std::as_bytes(std::span(text)))}};
        });
    };
    EXPECT_EQ(with_post("base = \"grbl\"\nname = \"a\"\n"), "");
    EXPECT_EQ(with_post("base = \"grbl\"\nname = \"a\"\nnmae = 3\n"),
              "verify.post post.toml:3: unknown key nmae");
}

}  // namespace
}  // namespace slabwright
