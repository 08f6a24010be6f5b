// verify on folders: one written by hand, one by the planner; good ones pass, and every corruption is
// reported as what it is.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "io/read/pattern_mesh.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/stl_writer.h"
#include "tests/support/places.h"

using namespace slabwright;
namespace fs = std::filesystem;

namespace {

std::string slurp(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}
void spill(const fs::path& path, const std::string& text) {
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
}

/// A folder of its own for each test, gone at its end.
struct Folder {
    fs::path path;
    explicit Folder(const std::string& name)
        : path(fs::temp_directory_path() / ("slabwright_verify_" + name + "_" + std::to_string(::getpid()))) {
        fs::remove_all(path);
        fs::create_directories(path);
    }
    ~Folder() { fs::remove_all(path); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
};

Mesh block() {
    const float h = 20, z = 10;
    Mesh m;
    m.vertices = {{0, 0, 0}, {h, 0, 0}, {h, h, 0}, {0, h, 0}, {0, 0, z}, {h, 0, z}, {h, h, z}, {0, h, z}};
    m.facets = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
    return m;
}

const char* const kHead =
    "G21 G17 G90 G94 G40 G49 G80\nG54 G8 G97 G91.1 G64 P0.02 Q0\nT%d M6\nG43 H%d\nS12000 M3\nG4 P3\n";
std::string head(int tool) {
    char text[200];
    std::snprintf(text, sizeof text, kHead, tool, tool);
    return text;
}

void write_block_sequence(const fs::path& out, const std::string& sha256, bool layer_top);

/// A block of 20 × 20 × 10 in a slab of 40 × 40 × 12, cleared in two steps by a ring with round corners, and
/// its corners.
void write_block(const fs::path& out) {
    write_stl((out / "block.stl").string(), block());
    Context context;
    const PatternMesh stl = read_pattern_mesh(context, (out / "block.stl").string());
    spill(out / "plan.json", R"({"schema": "slabwright.plan/1", "units": "mm", "frame": "pattern-base",
 "input": {"file": "block.stl", "sha256": ")" +
                                 stl.input.sha256 + R"("},
 "stock": {"min": [-10, -10], "max": [30, 30]}, "flask": null,
 "tools": [{"number": 1, "kind": "face", "diameter": 60, "flute_length": 20, "shank_diameter": 20, "holder": {"diameter": 60, "stickout": 60}},
           {"number": 2, "kind": "flat", "diameter": 10, "flute_length": 32, "shank_diameter": 10, "holder": {"diameter": 40, "stickout": 50}},
           {"number": 3, "kind": "ball", "diameter": 6, "flute_length": 30, "shank_diameter": 6, "holder": {"diameter": 32, "stickout": 45}}],
 "layers": [{"index": 1, "z_bottom": 0, "z_top": 10, "slab_thickness": 12,
   "operations": [{"kind": "face", "tool": 1, "file": "nc/L1_01.ngc"}, {"kind": "rough", "tool": 2, "stepdown": 5, "file": "nc/L1_02.ngc"}]}]})");
    spill(out / "tool.tbl", "T1 P1 D60 Z0 ;face\nT2 P2 D10 Z0 ;flat\nT3 P3 D6 Z0 ;ball\n");
    spill(out / "nc/L1_01.ngc", head(1) + "G0 Z25\nX-45 Y10\nZ10\nG1 X65 F5000\nG0 Z25\nM5\nM2\n");
    std::string rough = head(2) + "G0 Z25\nX-20 Y-9\n";
    for (const char* z : {"5", "0"}) {
        rough += std::string("Z") + z + "\nG1 X29 Y-9 F5000\nY29\nX-9\nY-9\n";
        rough +=
            "X-5 Y0\nG3 X0 Y-5 I5 J0\nG1 X20\nG3 X25 Y0 I0 J5\nG1 Y20\nG3 X20 Y25 I-5 J0\nG1 X0\nG3 X-5 Y20 "
            "I0 J-5\nG1 Y0\n";
        rough += z == std::string("5") ? "G0 Z25\nX-20 Y-9\n" : "G0 Z25\n";
    }
    spill(out / "nc/L1_02.ngc", rough + "M5\nM2\n");
    write_block_sequence(out, stl.input.sha256, false);
}

/// How that block is built.
void write_block_sequence(const fs::path& out, const std::string& sha256, bool layer_top) {
    const int down = layer_top ? 10 : 0;
    const auto n = [&](int z) { return std::to_string(z - down); };
    spill(out / "sequence.json", R"({"schema": "slabwright.sequence/1", "units": "mm", "frame": ")" +
                                     std::string(layer_top ? "layer-top" : "pattern-base") +
                                     R"(", "pattern": "block.stl", "sha256": ")" + sha256 + R"(", "steps": [
{"id": 1, "layer": 1, "action": "mount_board", "needs": [], "seconds": 0, "thickness_mm": 19, "length_mm": 40, "width_mm": 40},
{"id": 2, "layer": 1, "action": "take_slab", "needs": [], "seconds": 20, "thickness_mm": 12, "length_mm": 40, "width_mm": 40},
{"id": 3, "layer": 1, "action": "clamp", "needs": [2], "seconds": 20},
{"id": 4, "layer": 1, "action": "glue", "needs": [1], "seconds": 1, "polygons": "#/glue/0", "area_mm2": 100},
{"id": 5, "layer": 1, "action": "place", "needs": [3, 4], "seconds": 20, "x_mm": -10, "y_mm": -10, "z_bottom_mm": 0},
{"id": 6, "layer": 1, "action": "press", "needs": [5], "seconds": 30},
{"id": 7, "layer": 1, "action": "table", "needs": [6], "seconds": 0, "table_height_mm": )" +
                                     n(-19) + R"(, "work_offset_z_mm": 0},
{"id": 8, "layer": 1, "action": "touch_off", "needs": [7], "seconds": 0, "slab_top_mm": )" +
                                     n(12) + R"(},
{"id": 9, "layer": 1, "action": "tool_change", "needs": [8], "seconds": 15, "tool": 1},
{"id": 10, "layer": 1, "action": "face", "needs": [9], "seconds": 60, "program": "nc/L1_01.ngc", "tool": 1, "z_low_mm": )" +
                                     n(10) + R"(, "z_high_mm": )" + n(25) + R"(},
{"id": 11, "layer": 1, "action": "tool_change", "needs": [10], "seconds": 15, "tool": 2},
{"id": 12, "layer": 1, "action": "mill", "needs": [11], "seconds": 60, "program": "nc/L1_02.ngc", "tool": 2, "z_low_mm": )" +
                                     n(0) + R"(, "z_high_mm": )" + n(25) + R"(},
{"id": 13, "layer": 1, "action": "unload", "needs": [12], "seconds": 0}],
"glue": [{"layer": 1, "loops": [[[5, 5], [15, 5], [15, 15], [5, 15]]]}]})");
}

/// Codes of the violations, or the code and place of the error.
std::string verdict(const fs::path& out, double cell = 0.5) {
    Context context;
    try {
        const Verification v = verify_folder(context, out.string(), {.source = {}, .cell = cell});
        std::string codes;
        for (const Violation& w : v.report.violations)
            if (codes.find(w.code) == std::string::npos) codes += (codes.empty() ? "" : " ") + w.code;
        return codes;
    } catch (const Error& e) {
        const std::string place = e.place();
        return "error " + e.code() + " " +
               place.substr(place.rfind('/') == std::string::npos ? 0 : place.rfind('/') + 1);
    }
}

bool has(const std::string& codes, const std::string& code) {
    return (" " + codes + " ").find(" " + code + " ") != std::string::npos;
}

/// Replaces the first place, or the last.
void replace(const fs::path& file, const std::string& from, const std::string& to, bool last = false) {
    std::string text = slurp(file);
    const std::size_t at = last ? text.rfind(from) : text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " is not in " << file;
    text.replace(at, from.size(), to);
    spill(file, text);
}

std::vector<std::string> lines(const std::string& text) {
    std::vector<std::string> all;
    std::stringstream stream(text);
    for (std::string line; std::getline(stream, line);) all.push_back(line);
    return all;
}

}  // namespace

TEST(Verify, AGoodFolderPassesAndWritesItsReport) {
    Folder f("good");
    write_block(f.path);
    EXPECT_EQ(verdict(f.path), "");
    const std::string first = slurp(f.path / "verify.json");
    const auto json = nlohmann::json::parse(first);
    EXPECT_EQ(json["schema"], "slabwright.verify/1");
    EXPECT_EQ(json["passed"], true);
    EXPECT_LE(json["totals"]["gouge_max_mm"], 0.001) << "the reader's chords lie within 1 µm of the arcs";
    EXPECT_EQ(json["totals"]["within_tolerance_share"], 1);
    EXPECT_NEAR(json["totals"]["removed_mm3"].get<double>(), 15200, 2);
    EXPECT_EQ(json["programs"].size(), 2u);
    EXPECT_EQ(json["resolution"]["cell_mm"], 0.5);
    EXPECT_EQ(verdict(f.path), "");
    EXPECT_EQ(slurp(f.path / "verify.json"), first) << "the same folder gives the same bytes";
    EXPECT_FALSE(fs::exists(f.path / "verify.json.part"));
}

TEST(Verify, MapsShowEachLayer) {
    Folder f("maps");
    write_block(f.path);
    // The second level's first straight cut is gone: the strip beside the block stays 5 mm high. And the top
    // is faced too deep.
    replace(f.path / "nc/L1_02.ngc", "G1 X29 Y-9 F5000\nY29\nX-9\nY-9", "G1 F5000\nY29\nX-9\nY-9", true);
    replace(f.path / "nc/L1_01.ngc", "Z10", "Z9.9");
    Context context;
    const Verification v =
        verify_folder(context, f.path.string(),
                      {.source = {}, .cell = 0.5, .maps_directory = (f.path / "pictures/of").string()});
    const std::string text = slurp(f.path / "pictures/of/layer_01.ppm"), start = "P6\n80 80\n255\n";
    ASSERT_EQ(text.size(), start.size() + 80 * 80 * 3);
    EXPECT_EQ(text.substr(0, start.size()), start);
    auto pixel = [&](double x, double y) {
        const auto i = static_cast<std::size_t>((x + 10) / 0.5), j = static_cast<std::size_t>((30 - y) / 0.5);
        std::array<int, 3> c{};
        for (std::size_t k = 0; k < 3; ++k)
            c[k] = static_cast<unsigned char>(text[start.size() + (j * 80 + i) * 3 + k]);
        return c;
    };
    EXPECT_EQ(pixel(10.1, 10.1), (std::array<int, 3>{220, 0, 0})) << "gouged";
    EXPECT_EQ(pixel(-5, 10.1), (std::array<int, 3>{235, 235, 235})) << "beside";
    std::size_t missed = 0;
    const LayerFindings& l = v.report.layers[0];
    for (const CellKind k : l.kinds) missed += k == CellKind::missed;
    EXPECT_GT(missed, 0u);
    EXPECT_EQ(missed, l.missed);
    const Verification bare = verify_folder(context, f.path.string(), {.source = {}, .cell = 0.5});
    EXPECT_TRUE(bare.report.layers[0].map.empty()) << "nobody asked for maps";
    spill(f.path / "file", "");
    try {
        (void)verify_folder(context, f.path.string(),
                            {.source = {}, .cell = 0.5, .maps_directory = (f.path / "file").string()});
        FAIL() << "a file is no folder";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), "out.unwritable");
    }
}

TEST(Verify, LayerTopFrameMeansTheSame) {
    Folder f("frame");
    write_block(f.path);
    replace(f.path / "plan.json", "pattern-base", "layer-top");
    EXPECT_NE(verdict(f.path), "");  // the programs still count from the bottom: now 10 mm too high
    spill(f.path / "nc/L1_01.ngc", head(1) + "G0 Z15\nX-45 Y10\nZ0\nG1 X65 F5000\nG0 Z15\nM5\nM2\n");
    std::string rough = slurp(f.path / "nc/L1_02.ngc");
    for (const auto& [from, to] :
         {std::pair<std::string, std::string>{"Z25\n", "Z15\n"}, {"Z5\n", "Z-5\n"}, {"Z0\n", "Z-10\n"}})
        for (std::size_t at = rough.find(from); at != std::string::npos;
             at = rough.find(from, at + to.size()))
            rough.replace(at, from.size(), to);
    spill(f.path / "nc/L1_02.ngc", rough);
    const auto plan = nlohmann::json::parse(slurp(f.path / "plan.json"));
    write_block_sequence(f.path, plan["input"]["sha256"].get<std::string>(), true);
    EXPECT_EQ(verdict(f.path), "");
}

TEST(Verify, EachCorruptionIsReportedAsWhatItIs) {
    struct Case {
        const char* name;
        std::function<void(const fs::path&)> corrupt;
        const char* expected;  // the code, or "error code place"
    };
    auto nc = [](const char* file) { return std::string("nc/") + file; };
    const std::vector<Case> cases{
        {"lowered z", [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "\nZ10\n", "\nZ9.9\n"); },
         "gouge.cutter"},
        {"lowered z in stock",
         [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "\nZ10\n", "\nZ9.9\n"); }, "gouge.stock"},
        {"dropped retract",
         [&](const fs::path& p) {
             replace(p / nc("L1_02.ngc"), "G0 Z25\nX-20 Y-9\nZ0\n", "G0 Z5\nX-20 Y-9\nX40 Y40\nZ0\n");
         },
         "gouge.cutter"},
        {"rapid through stock",
         [&](const fs::path& p) {
             replace(p / nc("L1_02.ngc"), "Z5\nG1 X29 Y-9 F5000", "Z5\nX29 Y-9\nG1 F5000");
         },
         "rapid.through_stock"},
        {"wrong tool",
         [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "T2 M6\nG43 H2", "T3 M6\nG43 H3"); },
         "tool.wrong"},
        {"unknown tool",
         [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "T2 M6\nG43 H2", "T9 M6\nG43 H9"); },
         "tool.unknown"},
        {"flipped arc", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "G3 X25 Y0", "G2 X25 Y0"); },
         "gouge.cutter"},
        {"deleted line",
         [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "\nY29\nX-9\n", "\nX-9\n", true); },
         "left.too_much"},
        {"deleted line above",
         [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "\nY29\nX-9\n", "\nX-9\n"); }, "cut.too_deep"},
        {"deleted return",
         [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "X-9\nY-9\nX-5 Y0", "X-9\nX-5 Y0", true); },
         "left.too_much"},
        {"inches", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "G21", "G20"); },
         "error gcode.left_in_force L1_02.ngc:41"},
        {"inches travel",
         [&](const fs::path& p) {
             replace(p / nc("L1_01.ngc"), "G21", "G20");
             replace(p / nc("L1_01.ngc"), "M5\n", "M5\nG21\n");
         },
         "travel.exceeded"},
        {"incremental", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "G90", "G91"); },
         "error gcode.unknown_place L1_02.ngc:7"},
        {"spindle never started",
         [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "S12000 M3", "S12000"); }, "spindle.off"},
        {"spindle backwards", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "M3", "M4"); },
         "error gcode.spindle L1_02.ngc:5"},
        {"low start", [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "G0 Z25\nX", "G0 Z11\nX"); },
         "rapid.unknown_start"},
        {"emptied",
         [&](const fs::path& p) { spill(p / nc("L1_01.ngc"), head(1) + "G0 Z25\nX-45 Y10\nM5\nM2\n"); },
         "operation.empty"},
        {"cut off", [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "M5\nM2\n", ""); },
         "error gcode.no_end L1_01.ngc:11"},
        {"exponent", [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "X65", "X6.5e1"); },
         "error gcode.unknown_word L1_01.ngc:10"},
        {"offset word", [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "G54", "G92 X0"); },
         "error gcode.unknown_word L1_01.ngc:2"},
        {"program missing", [&](const fs::path& p) { fs::remove(p / nc("L1_01.ngc")); }, "program.missing"},
        {"stranger", [&](const fs::path& p) { spill(p / nc("L1_03.ngc"), "M2\n"); }, "program.unplanned"},
        {"order",
         [&](const fs::path& p) {
             fs::rename(p / nc("L1_02.ngc"), p / nc("L1_00.ngc"));
             replace(p / "plan.json", "L1_02.ngc", "L1_00.ngc");
         },
         "program.order"},
        {"fast spindle", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "S12000", "S999999"); },
         "program.spindle"},
        {"no spin-up", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "G4 P3\n", ""); },
         "program.spin_up"},
        {"long dwell", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "G4 P3", "G4 P999999"); },
         "program.dwell"},
        {"fast feed", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "F5000", "F99999"); },
         "program.feed"},
        {"wide corners", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "P0.02 Q0", "P0.5 Q0"); },
         "program.path_mode"},
        {"points left out", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "P0.02 Q0", "P0.02"); },
         "program.path_mode"},
        {"exact corners", [&](const fs::path& p) { replace(p / nc("L1_02.ngc"), "G64 P0.02 Q0", "G61"); },
         "program.path_mode"},
        {"no last retract", [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "G0 Z25\nM5", "M5"); },
         "program.end"},
        {"low last retract", [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "Z25\nM5", "Z15\nM5"); },
         "program.end"},
        {"slanting start",
         [&](const fs::path& p) { replace(p / nc("L1_01.ngc"), "G0 Z25\nX-45", "G0 Z25 X-45"); },
         "program.begin"},
        {"other rpm than planned",
         [&](const fs::path& p) {
             replace(p / "plan.json", "\"file\": \"nc/L1_02", "\"spindle_rpm\": 12001, \"file\": \"nc/L1_02");
         },
         "program.spindle"},
        {"other lengths than planned",
         [&](const fs::path& p) {
             replace(p / "plan.json", "\"file\": \"nc/L1_01",
                     R"("feeds": [{"feed": 0, "mm": 30, "centre": [10, 10, 17.5]},)"
                     R"({"feed": 5000, "mm": 110.001, "centre": [10, 10, 10]}], "file": "nc/L1_01)");
         },
         "program.lengths"},
        {"tool table", [&](const fs::path& p) { replace(p / "tool.tbl", "D10", "D12.7"); }, "tool.table"},
        {"tool table lacks", [&](const fs::path& p) { replace(p / "tool.tbl", "T3 P3 D6 Z0 ;ball\n", ""); },
         "tool.table"},
        {"tool table broken", [&](const fs::path& p) { replace(p / "tool.tbl", "D10", "Dten"); },
         "error verify.tool_table tool.tbl:2"},
        {"no sequence", [&](const fs::path& p) { fs::remove(p / "sequence.json"); }, "sequence.no_file"},
        {"sequence broken", [&](const fs::path& p) { replace(p / "sequence.json", "]", "}"); },
         "sequence.unreadable"},
        {"programs exchanged in the sequence",
         [&](const fs::path& p) {
             replace(p / "sequence.json", "L1_01", "L1_00");
             replace(p / "sequence.json", "L1_02", "L1_01");
             replace(p / "sequence.json", "L1_00", "L1_02");
         },
         "sequence.program"},
        {"tool of the sequence",
         [&](const fs::path& p) { replace(p / "sequence.json", "\"tool\": 2", "\"tool\": 99"); },
         "sequence.tool"},
        {"touch-off",
         [&](const fs::path& p) {
             replace(p / "sequence.json", "\"slab_top_mm\": 12", "\"slab_top_mm\": 5");
         },
         "sequence.touch_off"},
        {"tool table shifts", [&](const fs::path& p) { replace(p / "tool.tbl", "D10", "X50 Y-30 D10"); },
         "tool.table"},
        {"thinner slab",
         [&](const fs::path& p) {
             replace(p / "plan.json", "\"slab_thickness\": 12", "\"slab_thickness\": 9");
         },
         "stack.thin"},
        {"lower layer", [&](const fs::path& p) { replace(p / "plan.json", "\"z_top\": 10", "\"z_top\": 9"); },
         "stack.short"},
        {"other pattern",
         [&](const fs::path& p) { spill(p / "block.stl", slurp(p / "block.stl").replace(100, 1, "x")); },
         "error verify.other_pattern block.stl"},
        {"no pattern", [&](const fs::path& p) { fs::remove(p / "block.stl"); }, "error verify.no_pattern"},
        {"no plan", [&](const fs::path& p) { fs::remove(p / "plan.json"); }, "error verify.plan plan.json"},
        {"no JSON", [&](const fs::path& p) { replace(p / "plan.json", "{", "["); },
         "error verify.plan plan.json"},
        {"other schema", [&](const fs::path& p) { replace(p / "plan.json", "plan/1", "plan/2"); },
         "error verify.plan plan.json"},
        {"missing key", [&](const fs::path& p) { replace(p / "plan.json", "\"z_top\"", "\"top\""); },
         "error verify.plan plan.json"},
        {"file outside",
         [&](const fs::path& p) { replace(p / "plan.json", "nc/L1_01.ngc", "nc/../plan.json"); },
         "error verify.plan plan.json"},
        {"tool that bends without end",
         [&](const fs::path& p) {
             replace(p / "plan.json", "\"diameter\": 10, ", "\"diameter\": 10, \"modulus_gpa\": 0, ");
         },
         "error verify.plan plan.json"},
    };
    for (const Case& c : cases) {
        Folder f("bad");
        write_block(f.path);
        c.corrupt(f.path);
        const std::string found = verdict(f.path), expected = c.expected;
        if (expected.rfind("error", 0) == 0) {
            EXPECT_EQ(found.substr(0, expected.size()), expected) << c.name;
        } else {
            EXPECT_TRUE(has(found, expected))
                << c.name << ": expected " << expected << ", found \"" << found << "\"";
            EXPECT_EQ(nlohmann::json::parse(slurp(f.path / "verify.json"))["passed"], false) << c.name;
        }
    }
}

TEST(Verify, CellsThatAreNoneAndFilesThatAreAway) {
    Folder f("away");
    Context context;
    const std::string stl = support::checkout("tests/data/half-sphere.stl"), out = (f.path / "out").string();
    Job job;
    job.machine.magazine = 8;
    write(context, plan(context, stl, job), out);
    const auto verified = [&](double cell) {
        std::string codes;
        try {
            for (const Diagnostic& d : verify(context, out, stl, "", cell).violations)
                codes += (codes.empty() ? "" : " ") + d.code;
        } catch (const Error& e) {
            codes = "error " + e.code();
        }
        return codes;
    };
    EXPECT_EQ(verified(1), "");
    for (const double cell : {-1.0, 0.001, 50.0}) EXPECT_EQ(verified(cell), "error verify.cell") << cell;
    fs::rename(out + "/cut_list.csv", out + "/sequence.csv");
    EXPECT_TRUE(has(verified(1), "cut_list.no_file")) << verified(1);
    fs::rename(out + "/sequence.csv", out + "/cut_list.csv");
    fs::rename(out + "/sequence.json", f.path / "sequence.json");
    fs::create_directory(out + "/sequence.json");
    EXPECT_TRUE(verified(1).starts_with("error verify.sequence_file")) << verified(1);
}

// The planner's own programs: they pass, and the same corruptions of them do not.
TEST(Verify, PlannedHalfSphere) {
    Folder f("sphere");
    Context context;
    const std::string stl = support::checkout("tests/data/half-sphere.stl");
    write(context, plan(context, stl, Job{}), (f.path / "out").string());
    auto check = [&](const std::string& file, const std::function<void(std::vector<std::string>&)>& corrupt) {
        const fs::path nc = f.path / "out/nc" / file;
        const std::string good = slurp(nc);
        auto all = lines(good);
        corrupt(all);
        std::string text;
        for (const std::string& line : all) text += line + "\n";
        spill(nc, text);
        std::string codes;
        try {
            const Verification v = verify_folder(context, (f.path / "out").string(),
                                                 {.source = stl, .cell = 0.4, .write = false});
            for (const Violation& w : v.report.violations) codes += (codes.empty() ? "" : " ") + w.code;
        } catch (const Error& e) {
            codes = "error " + e.code();
        }
        spill(nc, good);
        return codes;
    };
    std::string face, finish, rough;
    const auto planned = nlohmann::json::parse(slurp(f.path / "out/plan.json"));
    for (const auto& op : planned["layers"][1]["operations"]) {
        const std::string file = op["file"].get<std::string>().substr(3);
        if (op["kind"] == "face") face = file;
        if (op["kind"] == "finish") finish = file;
        if (op["kind"] == "rough") rough = file;
    }
    ASSERT_FALSE(finish.empty());
    ASSERT_FALSE(rough.empty());
    EXPECT_EQ(check(finish, [](auto&) {}), "");
    // A finish move lowered by half a millimetre.
    EXPECT_TRUE(has(check(finish,
                          [](auto& all) {
                              for (std::size_t i = all.size() / 2; i < all.size(); ++i)
                                  if (const std::size_t z = all[i].find('Z');
                                      z != std::string::npos && all[i].find("G0") == std::string::npos) {
                                      std::size_t used = 0;
                                      const double value = std::stod(all[i].substr(z + 1), &used);
                                      all[i].replace(z + 1, used, std::to_string(value - 0.5));
                                      return;
                                  }
                          }),
                    "gouge.cutter"));
    // Its tool is the wrong one.
    EXPECT_TRUE(has(check(finish,
                          [](auto& all) {
                              for (std::string& line : all)
                                  if (line == "T3 M6") line = "T2 M6";
                                  else if (line == "G43 H3") line = "G43 H2";
                          }),
                    "tool.wrong"));
    // Inches for millimetres.
    EXPECT_NE(check(finish,
                    [](auto& all) {
                        for (std::string& line : all)
                            if (line.rfind("G21", 0) == 0) line.replace(0, 3, "G20");
                    }),
              "");
    // The retracts of roughing are gone: every rapid runs at depth.
    const std::string dropped = check(rough, [](auto& all) {
        std::vector<std::size_t> rises;
        for (std::size_t i = 0; i < all.size(); ++i)
            if (all[i].rfind("G0 Z", 0) == 0) rises.push_back(i);
        for (std::size_t k = 1; k + 1 < rises.size(); ++k) all[rises[k]] = "G0";
    });
    EXPECT_TRUE(has(dropped, "rapid.through_stock") || has(dropped, "gouge.cutter")) << dropped;
    // Facing goes around the edge only. (One line of it or of roughing nobody may miss: what it leaves,
    // others take.)
    const std::string stopped = check(face, [](auto& all) {
        const auto is_move = [](const std::string& line) {
            return !line.empty() && (line[0] == 'X' || line[0] == 'Y');
        };
        const auto first = std::find_if(all.begin(), all.end(),
                                        [](const std::string& line) { return line.rfind("G1 Z", 0) == 0; }) +
                           5;
        all.erase(std::remove_if(first, all.end(), is_move), all.end());
    });
    EXPECT_TRUE(has(stopped, "cut.too_deep")) << stopped;
}
