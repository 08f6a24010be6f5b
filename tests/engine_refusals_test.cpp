// Refusals and complaints of engine and kernels that no other test meets: mostly of what the planner and the
// commands never hand them, meshes and plans that do not belong together, numbers out of range.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "engine/bonding/bond_study.h"
#include "engine/flask/flask.h"
#include "engine/forces/feeds.h"
#include "engine/layers/layers.h"
#include "engine/planner/cut_layers.h"
#include "engine/planner/planner.h"
#include "engine/planner/quote.h"
#include "engine/planner/replan.h"
#include "engine/planner/underside.h"
#include "engine/planner/ways_out.h"
#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/sheet_cost.h"
#include "engine/sheets/sheet_plan.h"
#include "engine/simulate/build_replay.h"
#include "engine/undersides/underside_target.h"
#include "io/read/sequence_reader.h"
#include "io/write/sequence_json.h"
#include "kernels/access/accessibility.h"
#include "kernels/access/closest_point.h"
#include "kernels/access/printed_accessibility.h"
#include "kernels/access/standing_part.h"
#include "kernels/cutting/drop.h"
#include "kernels/cutting/level_contours.h"
#include "kernels/errors.h"
#include "kernels/forces/deflection.h"
#include "kernels/forces/forces.h"
#include "kernels/halves/halves.h"
#include "kernels/mesh/report.h"
#include "kernels/mesh/weld.h"
#include "kernels/skin/skin.h"
#include "kernels/voxels/level_set.h"
#include "tests/mesh_shapes.h"
#include "tests/support/block_build.h"

namespace slabwright {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Code and message of what a call throws; "" where it throws nothing.
std::string refused_as(const std::function<void()>& call) {
    try {
        call();
    } catch (const Error& error) {
        return error.code() + ": " + error.message();
    }
    return "";
}

/// The code alone.
std::string refusal(const std::function<void()>& call) {
    const std::string words = refused_as(call);
    return words.substr(0, words.find(": "));
}

Mesh box_of(Context& context, float height) {
    return weld(context, shapes::box({0, 0, 0}, {20, 20, height}));
}

Mesh open_box(Context& context, float height) {
    shapes::Facets facets = shapes::box({0, 0, 0}, {20, 20, height});
    facets.erase(facets.begin(), facets.begin() + 2);
    return weld(context, facets);
}

/// A plate of 60 x 40 x 8 mm on a foot 10 mm high: under the plate is air.
Mesh plate_on_foot(Context& context) {
    shapes::Facets facets = shapes::box({20, 10, 0}, {40, 30, 10});
    shapes::append(facets, shapes::box({0, 0, 10}, {60, 40, 18}));
    return weld(context, facets);
}

/// A block of 20 x 20 x 20 mm with a shaft whose wall pokes through the block's, `beyond` mm: no solid has
/// such a section, but all edges are paired.
Mesh block_with_shaft(Context& context, float beyond) {
    const std::array<Vec3f, 4> outer{{{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}}},
        inner{{{5, 5, 0}, {20 + beyond, 10, 0}, {12, 15, 0}, {5, 15, 0}}};
    const auto at = [](Vec3f p, float z) { return Vec3f{p.x, p.y, z}; };
    shapes::Facets facets;
    const auto quad = [&](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
        facets.push_back({a, b, c});
        facets.push_back({a, c, d});
    };
    for (std::size_t k = 0; k < 4; ++k) {
        const std::size_t n = (k + 1) % 4;
        quad(at(outer[k], 0), at(outer[n], 0), at(outer[n], 20), at(outer[k], 20));
        quad(at(inner[n], 0), at(inner[k], 0), at(inner[k], 20), at(inner[n], 20));
        quad(at(outer[k], 20), at(outer[n], 20), at(inner[n], 20), at(inner[k], 20));
        quad(at(outer[n], 0), at(outer[k], 0), at(inner[k], 0), at(inner[n], 0));
    }
    return weld(context, facets);
}

/// A needle on four sides, so sharp that no skin goes around its tip by moving vertices.
Mesh needle(Context& context, bool closed) {
    const std::array<Vec3f, 4> base{{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}};
    const Vec3f tip{1, 1, 20};
    shapes::Facets facets;
    for (std::size_t k = 0; k < 4; ++k) facets.push_back({base[k], base[(k + 1) % 4], tip});
    if (closed) {
        facets.push_back({base[0], base[2], base[1]});
        facets.push_back({base[0], base[3], base[2]});
    }
    return weld(context, facets);
}

TEST(EngineRefusals, JobsOutOfRange) {
    const auto refused = [](const std::function<void(Job&)>& change) {
        Job job;
        change(job);
        try {
            validate(job);
        } catch (const Error& error) {
            return error.code() + ' ' + error.place();
        }
        return std::string();
    };
    EXPECT_EQ(refused([](Job&) {}), "");
    EXPECT_EQ(refused([](Job& job) {
                  Tool& tool = job.tools[1];
                  tool.kind = ToolKind::bull_nose;
                  tool.corner_radius = 5;
                  tool.flute_length = 4.5;
              }),
              "job.range tool[2].corner_radius");
    EXPECT_EQ(refused([](Job& job) {
                  job.tools[1].diameter = 0.3;
                  job.tools[1].stepover = 0.1;
              }),
              "job.range tool[2].stepover");
    EXPECT_EQ(refused([](Job& job) {
                  job.machine.glue_head = GlueHead::slab;
                  job.machine.handler_speed = 0;
              }),
              "job.range machine.glue_head");
    EXPECT_EQ(refused([](Job& job) {
                  KeepOut& bolt = job.machine.keep_outs.emplace_back();
                  bolt.name = "bolt";
                  bolt.height = 10;
                  bolt.rectangle = {0, 0, 10};
              }),
              "job.range machine.keep_out[1].rectangle");
}

TEST(EngineRefusals, TermsThatRunsDoNotTellApart) {
    BondTests tests;
    tests.factors = {{"glue", {"thin", "thick"}, {-1, 1}, false}};
    tests.levels = {{0}, {0}, {1}, {1}};
    tests.strength = {1, 2, 3, 5};
    BondStudyOptions options;
    options.terms = {1, 1};
    const BondStudy study = study_bonds(tests, options);
    EXPECT_FALSE(study.regression.made);
    EXPECT_EQ(study.regression.why_not, "the runs do not tell its terms apart");
}

/// A slab of 19 mm around a part of 60 x 40 x 18 mm.
Plan one_layer() {
    Plan plan;
    plan.stock_min = {-10, -10};
    plan.stock_max = {70, 50};
    Layer& layer = plan.layers.emplace_back();
    layer.index = 1;
    layer.z_top = 18;
    layer.slab_thickness = 19;
    return plan;
}

TEST(EngineRefusals, PlansOfNothing) {
    Context context;
    EXPECT_EQ(refusal([&] { (void)make_plan(context, {}, {}, {}); }), "input.empty");
    const Mesh box = box_of(context, 10);
    Plan none;
    EXPECT_EQ(refusal([&] { cut_layers(context, none, box.view(), {}, {}, {}, {}); }), "plan.empty");

    Plan idle = one_layer();
    idle.layers[0].operations = {support::operation(OperationKind::rough, 2, 0, 30, 1)};
    idle.layers[0].operations[0].spindle_rpm = 12000;
    LayerFaults faults;
    faults.operations.emplace_back().empty = true;
    const StandingPart part(context, box.view());
    Replanner replanner(context, box.view(), part);
    EXPECT_EQ(refusal([&] { (void)replanner.mend(idle, {&faults, 1}, 1); }), "plan.empty");
}

TEST(EngineRefusals, PlansThatDoNotFit) {
    Context context;
    const Mesh box = box_of(context, 10);
    Job job;
    job.layers.strategy = LayerStrategy::combined;
    KeepOut& bolt = job.machine.keep_outs.emplace_back();
    bolt.name = "bolt";
    bolt.rectangle = {5, 5, 10, 10};
    bolt.height = 5;
    EXPECT_EQ(refusal([&] { (void)make_plan(context, box, {}, job); }), "keep_out.entered")
        << "of all placements that were tried";

    Job no_face;
    no_face.tools.erase(no_face.tools.begin());
    EXPECT_EQ(refused_as([&] { (void)quote(context, box.view(), no_face); }),
              "job.tool: the library has no face mill");

    Plan tight = one_layer();
    tight.job.flask.enabled = true;
    tight.stock_min = {-1, -1};
    tight.stock_max = {21, 21};
    EXPECT_EQ(refusal([&] { (void)place_flask(context, box.view(), tight); }), "fit.flask");

    Plan at_rest = one_layer();
    at_rest.layers[0].operations = {support::operation(OperationKind::rough, 2, 5, 30, 1)};
    std::vector<Diagnostic> told;
    EXPECT_EQ(refusal([&] { rate_layer(context, at_rest.layers[0], at_rest, told); }), "forces.spindle");

    LayerRequest request;
    request.height = 40;
    request.max_layer = 20;
    EXPECT_EQ(refusal([&] { (void)place_layers_uniform(request); }), "");
    request.alpha = kNaN;
    EXPECT_EQ(refusal([&] { (void)place_layers_uniform(request); }), "layers.request");
}

TEST(EngineRefusals, Undersides) {
    Context context;
    const Mesh pattern = plate_on_foot(context), open = open_box(context, 18);
    Plan plan = one_layer();
    Job job;
    job.layers.sides = SlabSides::two;
    EXPECT_EQ(refusal([&] { check_two_sided(job, pattern.view()); }), "");
    EXPECT_EQ(refusal([&] { check_two_sided(job, open.view()); }), "underside.open");
    const TurnedSlab slab = turned_slab(plan, plan.layers[0], 0);
    EXPECT_EQ(refusal([&] { (void)underside_target(context, pattern.view(), slab); }), "");
    EXPECT_EQ(refusal([&] { (void)underside_target(context, open.view(), slab); }), "underside.open");
    const Mesh block = weld(context, shapes::box({0, 0, 0}, {60, 40, 18}));
    EXPECT_EQ(refusal([&] { (void)underside_target(context, block.view(), slab); }), "underside.none");

    const AirGaps gaps = air_gaps(context, pattern.view(), 1);
    const std::vector<MilledLayer> above{{18, MilledFrom::above}}, both{{18, MilledFrom::both_sides}};
    EXPECT_EQ(refusal([&] { settle_unmade(context, plan, gaps, both, {}); }), "");
    EXPECT_EQ(refusal([&] { settle_unmade(context, plan, gaps, above, {}); }), "undercut.unmade");

    const auto planned = [&](const std::function<void(Plan&)>& change) {
        Plan changed = one_layer();
        change(changed);
        return refused_as([&] { plan_undersides(context, changed, pattern.view(), both, {}, {}); });
    };
    EXPECT_TRUE(planned([](Plan& changed) {
                    changed.layers[0].slab_thickness = 500;
                }).starts_with("underside.tall: its slab is 500.00 mm"));
    EXPECT_TRUE(planned([](Plan& changed) {
                    KeepOut& bolt = changed.job.machine.keep_outs.emplace_back();
                    bolt.name = "bolt";
                    bolt.rectangle = {5, 5, 10, 10};
                    bolt.height = 5;
                }).starts_with("keep_out.entered: underside of layer 1: "));
}

TEST(EngineRefusals, StacksOfSheets) {
    Context context;
    const Mesh box = box_of(context, 10);
    SheetJob job;
    job.slicing.thicknesses = {5};
    const SheetsPlan plan = plan_sheets(context, box, job);
    EXPECT_EQ(plan.pieces.size(), 2U);
    SheetsPlan no_stock = plan;
    no_stock.job.counts = {{5, 0}};
    const std::vector<SheetCost> costs = compare_costs(context, box, no_stock, 680, {});
    ASSERT_EQ(costs.size(), 2U);
    EXPECT_EQ(costs[0].way, "uniform");
    EXPECT_TRUE(costs[0].why_not.starts_with("the pieces of 5 mm take 1 whole sheet")) << costs[0].why_not;
    EXPECT_EQ(costs[1].why_not, "") << "the plan itself";

    shapes::Facets apart = shapes::box({0, 0, 0}, {20, 20, 5});
    shapes::append(apart, shapes::box({0, 0, 15}, {20, 20, 20}));
    EXPECT_EQ(refusal([&] { (void)plan_sheets(context, weld(context, apart), job); }), "sheets.empty");

    SheetRules rules;
    rules.thicknesses = {5};
    EXPECT_EQ(refusal([&] { (void)stack_of_sheets(context, box.view(), rules); }), "");
    rules.bond = -1;
    EXPECT_EQ(refusal([&] { (void)stack_of_sheets(context, box.view(), rules); }), "sheets.rules");

    const std::vector<SheetSpan> spans{{.bottom = 0, .top = 5}, {.bottom = 5, .top = 10}};
    const std::vector<Loops> over{disc({0, 0}, 100), disc({0, 0}, 100)},
        beside{disc({0, 0}, 100), disc({2'000'000, 0}, 100)};
    AlignmentRules holes;
    holes.way = SheetAlignment::holes;
    EXPECT_EQ(refusal([&] { (void)holds_of(spans, over, over, holes, false); }), "");
    EXPECT_EQ(refusal([&] { (void)holds_of(spans, beside, beside, holes, false); }), "sheets.hold");

    const SheetProof proof = prove_sheets(context, box.view(), {}, {});
    ASSERT_EQ(proof.violations.size(), 1U);
    EXPECT_EQ(proof.violations[0].code, "sheets.stack");
    EXPECT_EQ(proof.violations[0].message, "the programs place no piece");
}

/// What the replay of some steps tells, each with its code.
std::string told(const BuildPlan& plan, const BuildSequence& sequence) {
    std::string all;
    for (const Violation& v : replay_build(plan, sequence)) all += v.code + ": " + v.message + '\n';
    return all;
}

bool tells(const std::string& all, const char* code, const char* words) {
    for (std::size_t from = 0; from < all.size();) {
        const std::size_t end = all.find('\n', from);
        const std::string line = all.substr(from, end - from);
        if (line.starts_with(std::string(code) + ": ") && line.find(words) != std::string::npos) return true;
        from = end + 1;
    }
    return false;
}

SequenceStep step_of(int id, const char* action, const char* program = nullptr) {
    SequenceStep step;
    step.id = id;
    step.layer = 1;
    step.action = action;
    if (program != nullptr) step.words = {{"program", program}};
    return step;
}

TEST(EngineRefusals, SequencesWithOtherGlueAndPress) {
    Job job;
    job.machine.feed_height = 60;
    const Plan plan = support::block(job, {2, 1, false});
    const BuildPlan build = support::stated(plan);
    const BuildSequence good = read_sequence(sequence_json(plan));
    EXPECT_EQ(told(build, good), "");
    BuildSequence changed = good;
    changed.glue[1].layer = 7;
    EXPECT_TRUE(tells(told(build, changed), "sequence.glue", "glue/1 is not that of layer 2"));
    changed = good;
    changed.glue[0].max[1] = 1e6;
    EXPECT_TRUE(
        tells(told(build, changed), "sequence.glue_path", "its polygons are more than any head lays"));
    changed = good;
    for (SequenceStep& step : changed.steps)
        if (step.action == "press")
            for (auto& [key, value] : step.numbers)
                if (key == "force_n") value = 1e9;
    EXPECT_TRUE(tells(told(build, changed), "sequence.press", "presses harder than the machine's press can"));
}

TEST(EngineRefusals, StepsThatThePlanDoesNotKnow) {
    BuildPlan build = support::stated(support::block(Job{}, {2, 1, false}));
    build.probes = {{"nc/probe.ngc", 0, 9}};
    build.face_offs = {build.programs[0]};
    build.face_offs[0].file = "nc/off.ngc";
    const auto replayed = [&](const std::vector<SequenceStep>& steps) {
        BuildSequence sequence;
        sequence.steps = steps;
        return told(build, sequence);
    };
    EXPECT_TRUE(tells(replayed({step_of(1, "mill_underside")}), "sequence.layer",
                      "the plan mills no underside of layer 1"));
    EXPECT_TRUE(tells(replayed({step_of(1, "probe", "nc/probe.ngc")}), "sequence.tool",
                      "nc/probe.ngc wants tool 9 in the spindle, where tool 0 is"));
    const std::string once = replayed({step_of(1, "face_off", "nc/off.ngc")}),
                      twice = replayed({step_of(1, "take_slab"), step_of(2, "face_off", "nc/off.ngc"),
                                        step_of(3, "face_off", "nc/off.ngc")});
    EXPECT_FALSE(tells(once, "sequence.program", "nc/off.ngc has run already"));
    EXPECT_TRUE(tells(twice, "sequence.program", "nc/off.ngc has run already, in "));
    EXPECT_FALSE(tells(once, "sequence.order", "slabs wait in the handler"));
    EXPECT_TRUE(tells(twice, "sequence.order", "slabs wait in the handler"));
}

TEST(EngineRefusals, MeshesThatAreNoSolids) {
    Context context;
    Mesh box = box_of(context, 10);
    box.vertices[3].y = std::numeric_limits<float>::infinity();
    EXPECT_EQ(refusal([&] { const ClosestPoint closest(context, box.view()); }), "mesh.not_finite");
    EXPECT_EQ(refusal([&] { const AccessScene scene(context, box.view()); }), "mesh.not_finite");
    std::swap(box.vertices[0], box.vertices[3]);
    EXPECT_EQ(refusal([&] { const AccessScene scene(context, box.view()); }), "mesh.not_finite");

    const auto split = [&](const Mesh& mesh) {
        return refused_as([&] {
            (void)split_solid(context, mesh.view(), report_mesh(context, mesh.view()), {.offset_mm = 10},
                              {.diameter_mm = 0});
        });
    };
    EXPECT_EQ(split(box_of(context, 20)), "");
    EXPECT_EQ(split(block_with_shaft(context, -5)), "");
    const Mesh poked = block_with_shaft(context, 10);
    EXPECT_EQ(split(poked), "split.crossing: the section crosses itself");
    EXPECT_EQ(split(open_box(context, 20)), "split.crossing: the half below is no solid");
    const std::vector<WayOut> ways =
        ways_out(context, poked.view(), report_mesh(context, poked.view()), Job{}, {.unmade_mm3 = 1e9});
    EXPECT_FALSE(ways.empty());
    const Vec3d up{0, 0, 1};
    for (const WayOut& way : ways)
        EXPECT_FALSE(way.plane && way.plane->normal == up) << "a plane that cannot be cut";
}

TEST(EngineRefusals, SkinsOfNeedles) {
    Context context;
    const Mesh closed = needle(context, true), open = needle(context, false);
    const Skinned whole = add_skin(context, closed.view(), {.mm = 1});
    EXPECT_EQ(whole.method, SkinMethod::level_set);
    EXPECT_EQ(whole.reason, "1 vertices have no place near enough");
    const Skin one_side{.mm = 1, .normal = std::array<double, 3>{1, 0, 0}};
    EXPECT_EQ(refusal([&] { (void)add_skin(context, closed.view(), one_side); }), "skin.impossible");
    EXPECT_EQ(refusal([&] { (void)add_skin(context, open.view(), {.mm = 1}); }), "skin.open");
}

TEST(EngineRefusals, CuttersThatAreNone) {
    Context context;
    const Mesh box = box_of(context, 10);
    ToolShape tool;
    tool.cutter = flat_cutter(2);
    AccessOptions options;
    EXPECT_EQ(refusal([&] { (void)accessible(context, box.view(), 0, 5, tool, options); }), "");
    options.tolerance = 2;
    EXPECT_EQ(refusal([&] { (void)accessible(context, box.view(), 0, 5, tool, options); }), "access.options");
    for (const double radius : {0.0, -1.0, kNaN, HUGE_VAL})
        EXPECT_EQ(refusal([&] { (void)printed_accessibility(Loops{}, radius); }), "access.printed") << radius;
    const std::vector<std::uint8_t> one(1, 1);
    EXPECT_EQ(refusal([&] { (void)printed_accessibility(Loops{}, 1, 2, one); }), "access.printed");

    const LayerSolid solid = layer_solid(context, box.view(), 0, 8);
    const auto dropped = [&](double radius) {
        CutterShape cutter = flat_cutter(2);
        cutter.radius = radius;
        return refusal([&] { const DropIndex index(solid, cutter); });
    };
    EXPECT_EQ(dropped(2), "");
    EXPECT_EQ(dropped(0), "drop.radius");
    EXPECT_EQ(dropped(1000), "");
    EXPECT_EQ(dropped(1001), "drop.radius");
    EXPECT_EQ(dropped(kNaN), "drop.radius");

    const auto contoured = [&](FibreGrid grid) {
        Loops inside;
        return refusal([&] { (void)level_contours(context, solid, inside, flat_cutter(2), 4, grid); });
    };
    const FibreGrid whole = fibre_grid(solid, flat_cutter(2), 5000);
    EXPECT_EQ(contoured(whole), "");
    FibreGrid half = whole;
    half.y.resize(half.y.size() / 2);
    EXPECT_EQ(contoured(half), "contours.open") << "a grid that ends within the part";
}

TEST(EngineRefusals, ForcesOnNoCutters) {
    Context context;
    EXPECT_EQ(refusal([] { (void)cutter_deflection(1, 1, 0); }), "forces.tool");
    EXPECT_EQ(refusal([] { (void)cutter_deflection(1, 1, 1, 0); }), "forces.tool");
    EXPECT_EQ(refusal([] { (void)cutter_stress(-1, 1, 1); }), "forces.tool");
    EXPECT_EQ(refusal([] { (void)allowed_tool_length(1, kNaN, 1); }), "forces.tool");
    const auto cut = [](double corner_mm, double taper_rad) {
        CutSegment segment;
        segment.radius_mm = 3;
        segment.high_mm = 1;
        segment.corner_mm = corner_mm;
        segment.taper_rad = taper_rad;
        return refusal([&] { (void)reference_forces(segment); });
    };
    EXPECT_EQ(cut(1, 0.1), "");
    EXPECT_EQ(cut(-1, 0), "forces.segment");
    EXPECT_EQ(cut(4, 0), "forces.segment");
    EXPECT_EQ(cut(1, -0.1), "forces.segment");
    EXPECT_EQ(cut(1, 2), "forces.segment");

    const bool has_device = ForceSolver(context).device() != "reference";
    context.cancel();
    EXPECT_EQ(refusal([&] { const ForceSolver solver(context); }), has_device ? "cancelled" : "");
}

TEST(EngineRefusals, GridsOfTooManyCells) {
    Context context;
    const Mesh box = box_of(context, 10);
    const auto made = [&](std::uint64_t most_cells) {
        const auto winding = [](const std::array<double, 3>& p) {
            return p[0] > 0 && p[0] < 20 && p[1] > 0 && p[1] < 20 && p[2] > 0 && p[2] < 10 ? 1.0 : 0.0;
        };
        LevelSetOptions options;
        options.most_cells = most_cells;
        return refusal([&] { (void)surface_of_winding(context, box.view(), winding, options); });
    };
    EXPECT_EQ(made(64'000'000), "");
    EXPECT_EQ(made(100), "repair.cells");
}

}  // namespace
}  // namespace slabwright
