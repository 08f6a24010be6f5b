// What public functions refuse when they are called with what no file and no command can hand them: values
// out of range, lists that do not belong together, names that are none.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>

#include "engine/bonding/bond_study.h"
#include "engine/forces/op_forces.h"
#include "engine/layers/combined.h"
#include "engine/sheets/fixture.h"
#include "engine/sheets/sheet_plan.h"
#include "engine/simulate/replay.h"
#include "engine/simulate/simulate.h"
#include "io/read/bond_csv.h"
#include "io/read/job_toml.h"
#include "io/slabwright.h"
#include "io/split.h"
#include "io/text/json_text.h"
#include "io/write/access_ply.h"
#include "io/write/draw_ply.h"
#include "io/write/model_file.h"
#include "io/write/output_file.h"
#include "io/write/output_folder.h"
#include "kernels/access/standing_part.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/files.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using support::spit;
using support::TemporaryFolder;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The code of what a call throws; "" where it throws nothing.
std::string refusal(const std::function<void()>& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.code();
    }
    return "";
}

Mesh box_of(Context& context, float height) {
    return weld(context, shapes::box({0, 0, 0}, {20, 20, height}));
}

/// Four joints, two of each of two glues.
BondTests four_joints() {
    BondTests tests;
    tests.factors = {{"glue", {"thin", "thick"}, {-1, 1}, false}};
    tests.levels = {{0}, {0}, {1}, {1}};
    tests.strength = {1, 2, 3, 5};
    return tests;
}

TEST(Refusals, StudiesOfJoints) {
    const auto refused = [](const std::function<void(BondTests&, BondStudyOptions&)>& change) {
        BondTests tests = four_joints();
        BondStudyOptions options;
        change(tests, options);
        return refusal([&] { (void)study_bonds(tests, options); });
    };
    EXPECT_EQ(refused([](BondTests&, BondStudyOptions&) {}), "");
    EXPECT_EQ(refused([](BondTests& t, BondStudyOptions&) { t.factors.clear(); }), "bond.factors");
    EXPECT_EQ(refused([](BondTests& t, BondStudyOptions&) { t.factors.resize(7, t.factors[0]); }),
              "bond.factors");
    EXPECT_EQ(refused([](BondTests& t, BondStudyOptions&) { t.factors[0].levels.pop_back(); }),
              "bond.levels");
    EXPECT_EQ(refused([](BondTests& t, BondStudyOptions&) { t.strength.resize(2); }), "bond.rows");
    EXPECT_EQ(refused([](BondTests& t, BondStudyOptions&) { t.strength.assign(4, 3.0); }), "bond.constant");
    EXPECT_EQ(refused([](BondTests&, BondStudyOptions& o) { o.terms = {1}; }), "");
    EXPECT_EQ(refused([](BondTests&, BondStudyOptions& o) { o.terms = {0}; }), "bond.terms");
    EXPECT_EQ(refused([](BondTests&, BondStudyOptions& o) { o.terms = {2}; }), "bond.terms");
    EXPECT_EQ(refused([](BondTests&, BondStudyOptions& o) { o.confidence = 0; }), "bond.options");
    EXPECT_EQ(refused([](BondTests&, BondStudyOptions& o) { o.confidence = 1; }), "bond.options");
    EXPECT_EQ(refused([](BondTests&, BondStudyOptions& o) { o.future_runs = 0; }), "bond.options");
    EXPECT_EQ(refused([](BondTests&, BondStudyOptions& o) { o.order = -1; }), "bond.options");
    BondTests wide;
    wide.factors.resize(2);
    for (BondFactor& factor : wide.factors)
        for (int level = 0; level < 15; ++level) factor.levels.push_back(std::to_string(level));
    for (int row = 0; row < 225; ++row) {
        wide.levels.push_back({row % 15, row / 15});
        wide.strength.push_back(row);
    }
    EXPECT_EQ(refusal([&] { (void)study_bonds(wide); }), "bond.columns") << "14 * 14 + 14 + 14 + 1 are 225";
}

TEST(Refusals, TablesOfJoints) {
    const TemporaryFolder folder;
    const std::string path = folder / "joints.csv";
    spit(path, "glue,MPa\nthin,1\nthin,2\nthick,3\n");
    const auto refused = [&](const BondCsvOptions& options) {
        return refusal([&] { (void)read_bond_csv(path, options); });
    };
    EXPECT_EQ(refused({}), "");
    EXPECT_EQ(refused({.response = "N"}), "bond.column");
    EXPECT_EQ(refused({.ignored = {"day"}}), "bond.column");
    EXPECT_EQ(refused({.ignored = {"MPa"}}), "bond.column");
    std::string long_one = "glue,MPa\n";
    for (std::size_t row = 0; row <= kMostBondRows; ++row)
        long_one += row % 2 == 0 ? "thin,1\n" : "thick,2\n";
    spit(path, long_one);
    EXPECT_EQ(refused({}), "bond.rows");
    spit(path, std::string("glue,MPa\nth\0n,1\n", 16));
    EXPECT_EQ(refused({}), "bond.text");
}

TEST(Refusals, TextsAndFiles) {
    Context context;
    const Mesh mesh = box_of(context, 10);
    const std::vector<float> shares(mesh.view().size() - 1, 1.0F);
    EXPECT_EQ(refusal([&] { (void)access_ply(mesh.view(), shares, ""); }), "access_ply.shares");
    EXPECT_EQ(refusal([&] { (void)draw_ply(mesh.view(), {}, ""); }), "draw_ply.report");
    EXPECT_EQ(refusal([&] { (void)rounded_text(kNaN, 3); }), "number.not_finite");
    EXPECT_EQ(refusal([&] { JsonText().exact(-HUGE_VAL); }), "number.not_finite");

    const TemporaryFolder folder;
    spit(folder / "file", "text");
    EXPECT_EQ(refusal([&] { write_model(folder / "a.obj", mesh); }), "prepare.format");
    EXPECT_EQ(refusal([&] { write_file_whole("", "text"); }), "out.missing");
    EXPECT_EQ(refusal([&] { write_file_whole("/", "text"); }), "out.unusable");
    EXPECT_EQ(refusal([&] { const OutputFolder out(""); }), "out.missing");
    EXPECT_EQ(refusal([&] { const OutputFolder out(folder / "file"); }), "out.unusable");
    EXPECT_EQ(refusal([&] { const OutputFolder out(folder / "file/in it"); }), "out.unusable");
}

TEST(Refusals, TheFrontDoor) {
    Context context;
    EXPECT_EQ(refusal([&] { (void)plan(context, PatternSource{}, Job{}); }), "pattern.none");
    EXPECT_EQ(refusal([&] { (void)job_from_toml("[machine]\npost = \"a.toml\"\n", "job"); }),
              "post.no_files");

    const TemporaryFolder folder;
    const std::string stl = folder / "box.stl";
    write_model(stl, box_of(context, 10));
    const auto sliced = [&](double every_mm, const char* ending) {
        return refusal([&] { slice_to_file(context, PatternSource{stl}, Job{}, every_mm, folder / ending); });
    };
    EXPECT_EQ(sliced(2, "s.svg"), "");
    EXPECT_EQ(sliced(2, "s.png"), "slice.format");
    EXPECT_EQ(sliced(2, "none"), "slice.format");
    for (const double bad : {0.0, -1.0, kNaN, HUGE_VAL, 10.0, 1e-6})
        EXPECT_EQ(sliced(bad, "s.svg"), "slice.every") << bad;

    EXPECT_EQ(refusal([&] { (void)post_file_toml("fanoc"); }), "post.base");

    Job inches;
    inches.units = LengthUnit::inch;
    const std::shared_ptr<Pattern> read = read_pattern(context, PatternSource{stl}, Job{});
    EXPECT_EQ(refusal([&] { (void)plan(context, *read, inches); }), "plan.reading");
}

TEST(Refusals, MeshesInMemory) {
    Context context;
    std::vector<PatternSource::Vertex> vertices{{0, 0, 0}, {20, 0, 0}, {0, 20, 0}, {0, 0, 20}};
    std::vector<PatternSource::Facet> facets{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    const auto refused = [&] {
        return refusal(
            [&] { (void)read_pattern(context, PatternSource::of_mesh(vertices, facets, "m"), Job{}); });
    };
    EXPECT_EQ(refused(), "");
    for (const double bad : {kNaN, HUGE_VAL, 1e9}) {
        vertices[1][0] = bad;
        EXPECT_EQ(refused(), bad == 1e9 ? "mesh.absurd" : "mesh.non_finite") << bad;
    }
    vertices[1][0] = 20;
    facets[3][2] = 4;
    EXPECT_EQ(refused(), "mesh.index");
    facets.clear();
    EXPECT_EQ(refused(), "mesh.no_facets");
}

TEST(Refusals, OtherPatternsAndOpenOnes) {
    Context context;
    const TemporaryFolder folder;
    const std::string stl = folder / "box.stl", other = folder / "other.stl", open = folder / "open.stl";
    write_model(stl, box_of(context, 10));
    write_model(other, box_of(context, 11));
    const Plan planned = plan(context, PatternSource{stl}, Job{});
    EXPECT_EQ(refusal([&] { write_access_maps(context, planned, other, folder / "maps"); }),
              "access_maps.stl");
    EXPECT_FALSE(std::filesystem::exists(folder / "maps"));

    shapes::Facets facets = shapes::box({0, 0, 0}, {20, 20, 10});
    facets.erase(facets.begin(), facets.begin() + 2);
    write_model(open, weld(context, facets));
    SplitRequest halves;
    halves.plane.offset_mm = 5;
    halves.out = {folder / "a.stl", folder / "b.stl"};
    EXPECT_EQ(refusal([&] { (void)split_model(context, PatternSource{stl}, Job{}, halves); }), "");
    EXPECT_EQ(refusal([&] { (void)split_model(context, PatternSource{open}, Job{}, halves); }), "split.open");
    halves.out[1] = halves.out[0];
    EXPECT_EQ(refusal([&] { (void)split_model(context, PatternSource{stl}, Job{}, halves); }), "split.out");
}

TEST(Refusals, MapsOfTools) {
    const std::vector<double> allowed{30, 30};
    const auto joined = [&](const std::vector<ToolSlice>& slices) {
        return refusal([&] { (void)join_slices(slices, allowed, 5); });
    };
    EXPECT_EQ(joined({{0, 20, 0}, {20, 40, 1}}), "");
    EXPECT_EQ(joined({{0, 20, 0}, {21, 40, 1}}), "layers.tools") << "a gap";
    EXPECT_EQ(joined({{0, 20, 0}, {20, 20, 1}}), "layers.tools") << "no height";
    EXPECT_EQ(joined({{0, 20, 0}, {20, 40, 2}}), "layers.tools") << "a tool without a length";
    LayerRequest request;
    request.height = 40;
    const auto placed = [&](const std::vector<ToolSlice>& layers) {
        return refusal([&] { (void)place_layers_by_tools(request, layers, allowed); });
    };
    EXPECT_EQ(placed({}), "layers.tools");
    EXPECT_EQ(placed({{1, 40, 0}}), "layers.tools") << "from above the bottom";
    EXPECT_EQ(placed({{0, 39, 0}}), "layers.tools") << "not to the top";
}

/// One slab of 20 mm, and no program.
SimulationInput one_slab(const Mesh& mesh) {
    SimulationInput input;
    input.mesh = mesh.view();
    input.stock_min = {-10, -10};
    input.stock_max = {30, 30};
    SimulatedLayer layer;
    layer.z_bottom = 0;
    layer.z_top = 10;
    layer.slab_thickness = 20;
    input.layers = {layer};
    return input;
}

TEST(Refusals, SimulationsOfNothing) {
    Context context;
    const Mesh mesh = box_of(context, 10);
    const StandingPart part(context, mesh.view());
    const auto simulated = [&](const std::function<void(SimulationInput&)>& change) {
        SimulationInput input = one_slab(mesh);
        change(input);
        return refusal([&] { (void)simulate(context, input, part); });
    };
    EXPECT_EQ(simulated([](SimulationInput&) {}), "");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.layers.clear(); }), "simulate.input");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.stock_max[1] = in.stock_min[1]; }), "simulate.input");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.stock_min[0] = -HUGE_VAL; }), "simulate.input");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.layers[0].z_top = 0; }), "simulate.input");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.layers[0].z_top = HUGE_VAL; }), "simulate.input");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.layers[0].z_bottom = -1; }), "simulate.input");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.layers[0].slab_thickness = 0; }), "simulate.input");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.programs.emplace_back().layer = 1; }), "simulate.input");
    EXPECT_EQ(simulated([](SimulationInput& in) { in.programs.emplace_back().layer = -1; }),
              "simulate.input");

    // A layer that does not lie on the one before is no nonsense, but a fault of the stack.
    SimulationInput apart = one_slab(mesh);
    apart.layers.push_back(apart.layers[0]);
    const auto has_gap = [&](double z_bottom) {
        apart.layers[1].z_bottom = z_bottom;
        apart.layers[1].z_top = z_bottom + 10;
        const SimulationReport report = simulate(context, apart, part);
        return std::any_of(report.violations.begin(), report.violations.end(),
                           [](const Violation& v) { return v.code == "stack.gap"; });
    };
    EXPECT_FALSE(has_gap(10));
    EXPECT_FALSE(has_gap(10.0009));
    EXPECT_TRUE(has_gap(10.01));

    const auto replayed = [&](const ReplayOptions& options, int layer) {
        SimulationInput input = one_slab(mesh);
        return refusal([&] {
            Replay replay(context, input, options);
            Program program;
            program.layer = layer;
            (void)replay.run(program);
        });
    };
    EXPECT_EQ(replayed({}, 0), "");
    EXPECT_EQ(replayed({}, 1), "replay.layer");
    EXPECT_EQ(replayed({.cell = 0, .material = {}}, 0), "replay.options");
    EXPECT_EQ(replayed({.pieces = 0, .material = {}}, 0), "replay.options");
    SimulationInput none = one_slab(mesh);
    none.layers.clear();
    EXPECT_EQ(refusal([&] { const Replay replay(context, none, {}); }), "replay.options");
}

TEST(Refusals, ASpindleAtRest) {
    Job job;
    Operation operation;
    operation.kind = OperationKind::rough;
    operation.spindle_rpm = 0;
    operation.moves = {{0, 0, 10000, 0}, {0, 0, 0, 500}, {100000, 0, 0, 500}};
    const Tool tool = job.tools.front();
    EXPECT_EQ(refusal([&] { (void)heaviest_cut(operation, tool, job); }), "forces.spindle");
    operation.spindle_rpm = 12000;
    EXPECT_EQ(refusal([&] { (void)heaviest_cut(operation, tool, job); }), "");
}

std::string planned(Context& context, const Mesh& mesh, const std::function<void(SheetJob&)>& change) {
    SheetJob job;
    job.slicing.thicknesses = {5};
    change(job);
    return refusal([&] { (void)plan_sheets(context, mesh, job); });
}

TEST(Refusals, JobsOfSheets) {
    Context context;
    const Mesh mesh = box_of(context, 10);
    const auto refused = [&](const std::function<void(SheetJob&)>& change) {
        return planned(context, mesh, change);
    };
    const auto jet = [](SheetJob& job) { job.head = SheetHead::jet; };
    EXPECT_EQ(refused([](SheetJob&) {}), "");
    EXPECT_EQ(refused(jet), "");
    EXPECT_EQ(refused([](SheetJob& j) { j.cutting.most_tilt_deg = 20; }), "sheets.job") << "a router tilts";
    EXPECT_EQ(refused([&](SheetJob& j) {
                  jet(j);
                  j.cutting.most_tilt_deg = 20;
                  j.slicing.side = StairSide::inside;
              }),
              "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) { j.feed = 0; }), "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) { j.rpm = 2e6; }), "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) { j.cutting.taper_deg = 1; }), "sheets.job") << "a router's cut tapers";
    EXPECT_EQ(refused([](SheetJob& j) { j.pivot = 100; }), "sheets.job") << "a router has a pivot";
    EXPECT_EQ(refused([](SheetJob& j) { j.lead = -1; }), "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) { j.offcuts = {{7, {100, 100}}}; }), "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) { j.cutting.kerf = 0; }), "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) { j.off = j.on; }), "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) { j.corners.share = 0; }), "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) { j.engraving.depth = 3; }), "sheets.job") << "over half of 5 mm";
    EXPECT_EQ(refused([](SheetJob& j) {
                  j.engraving.depth = 1;
                  j.engraving.feed = 0;
              }),
              "sheets.job");
    EXPECT_EQ(refused([](SheetJob& j) {
                  j.alignment.way = SheetAlignment::holes;
                  j.alignment.dowel = 0.5;
                  j.cutting.kerf = 6;
              }),
              "sheets.job")
        << "a cutter wider than the hole";
}

TEST(Refusals, RulesOfSheets) {
    Context context;
    const Mesh mesh = box_of(context, 10);
    const std::vector<SheetSpan> spans{{.bottom = 0, .top = 5}};
    const std::vector<Loops> discs{disc({0, 0}, 50)};
    EXPECT_EQ(refusal([&] { (void)along_axis(mesh, 'w'); }), "sheets.axis");
    EXPECT_EQ(refusal([] { (void)jet_feed({.pressure_mpa = 0}, 5); }), "sheets.jet");
    EXPECT_EQ(refusal([] { (void)jet_feed({}, kNaN); }), "sheets.jet");
    SheetJob deep;
    deep.head = SheetHead::jet;
    deep.engraving.depth = 1e-4;
    EXPECT_EQ(refusal([&] { (void)engraving_feed(deep); }), "sheets.engrave");
    for (const SheetCutRules& rules :
         {SheetCutRules{.kerf = -1}, SheetCutRules{.taper_deg = 11}, SheetCutRules{.most_tilt_deg = 81},
          SheetCutRules{.leave = 0}, SheetCutRules{.most_passes = 0}, SheetCutRules{.gouge = 0},
          SheetCutRules{.taper_deg = 5, .most_tilt_deg = 9}, SheetCutRules{.kerf = 0.8, .taper_deg = 9}})
        EXPECT_EQ(refusal([&] { (void)cuts_of(context, mesh.view(), spans, {}, rules); }), "sheets.cut")
            << rules.kerf << ' ' << rules.taper_deg << ' ' << rules.most_tilt_deg;
    for (const FixtureRules& rules :
         {FixtureRules{.margin = 0}, FixtureRules{.clearance = -1}, FixtureRules{.thickness = 0},
          FixtureRules{.floor = 0}, FixtureRules{.slices_x = 0}, FixtureRules{.slices_y = 101}})
        EXPECT_EQ(refusal([&] { (void)full_nest(spans, discs, rules); }), "sheets.fixture");
    const auto nested = [&](const NestRules& rules, const StockSheet& stock) {
        return refusal([&] { (void)nest_pieces(context, discs, stock, {}, rules); });
    };
    EXPECT_EQ(nested({}, {200, 200}), "");
    EXPECT_EQ(nested({.spacing = -1}, {200, 200}), "sheets.nest");
    EXPECT_EQ(nested({.turns = {}}, {200, 200}), "sheets.nest");
    EXPECT_EQ(nested({.turns = {45}}, {200, 200}), "sheets.nest");
    EXPECT_EQ(nested({.tries = 0}, {200, 200}), "sheets.nest");
    EXPECT_EQ(nested({}, {0, 200}), "sheets.nest");
    const auto held = [&](AlignmentRules rules) {
        rules.way = SheetAlignment::tabs;
        return refusal([&] { (void)holds_of(spans, discs, discs, rules, false); });
    };
    EXPECT_EQ(held({}), "");
    EXPECT_EQ(held({.dowel = 0}), "sheets.align");
    EXPECT_EQ(held({.gap = -1}), "sheets.align");
    EXPECT_EQ(held({.dowel = 8, .wall = 4, .tab = 10}), "sheets.align") << "a tab too small for its rod";
    const auto engraved = [&](const EngraveRules& rules) {
        return refusal([&] { (void)engravings_of(context, {}, rules); });
    };
    EXPECT_EQ(engraved({.depth = 1}), "");
    EXPECT_EQ(engraved({.depth = 0}), "sheets.engrave");
    EXPECT_EQ(engraved({.depth = 1, .height = 3, .least = 4}), "sheets.engrave");
}

}  // namespace
}  // namespace slabwright
