// Whole plans of the project's own models: what fits and what does not, and that no program touches the part,
// judged by the exact check of engine/simulate from the emitted text.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/moves/path_builder.h"
#include "engine/planner/planner.h"
#include "engine/schedule/fit.h"
#include "io/slabwright.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "kernels/stock/stock.h"
#include "tests/data/models.h"
#include "tests/mesh_shapes.h"
#include "tests/support/files.h"
#include "tests/support/height_field.h"
#include "tests/support/loft.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

Mesh box(Context& context, double x, double y, double z) {
    Mesh mesh = test::height_field(context, 1, 1.0, [](double, double) { return 1.0; });
    for (Vec3f& v : mesh.vertices)
        v = {static_cast<float>(v.x * x), static_cast<float>(v.y * y), static_cast<float>(v.z * z)};
    return mesh;
}

std::string refusal(const Mesh& mesh, const Job& job, const char* code) {
    Context context;
    try {
        (void)make_plan(context, mesh, {}, job);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::no_plan);
        EXPECT_EQ(error.code(), code);
        EXPECT_FALSE(error.remedy().empty());
        return error.what();
    }
    ADD_FAILURE() << "planned, though " << code << " was due";
    return {};
}

TEST(Planner, SaysByHowMuchAPartIsTooLarge) {
    Context context;
    const Job job;
    EXPECT_NE(refusal(box(context, 1172.5, 100, 20), job, "fit.slab")
                  .find("12.5 mm more than the slab's 1160.0 mm"),
              std::string::npos);
    EXPECT_NE(refusal(box(context, 100, 1161, 20), job, "fit.slab").find("1.0 mm more"), std::string::npos);
    // As wide as the slab it is all of the stock.
    Plan whole;
    whole.job = job;
    place_stock(whole, {{0, 0, 0}, {1160, 100, 20}});
    EXPECT_EQ(whole.stock_min[0], 0);
    EXPECT_EQ(whole.stock_max[0], 1160);
    EXPECT_NE(refusal(box(context, 100, 100, 1230), job, "fit.chamber")
                  .find("30.0 mm more than the build chamber's 1200.0 mm"),
              std::string::npos);
    Job short_travel;
    short_travel.machine.travel_x = 400;
    EXPECT_NE(refusal(box(context, 401, 100, 20), short_travel, "fit.travel")
                  .find("1.0 mm more than the machine's travel of 400.0 mm"),
              std::string::npos);
    Job heavy;
    heavy.machine.build_mass_kg = 2;
    EXPECT_NE(refusal(box(context, 200, 200, 100), heavy, "fit.mass")
                  .find("kg more than the build platform carries"),
              std::string::npos);
    Job low;
    low.machine.travel_z = 15;
    EXPECT_NE(refusal(box(context, 100, 100, 30), low, "machine.travel_z").find("tools' lengths included: "),
              std::string::npos)
        << "a program that is too high by itself is told with what all of them need";
    // Each program by itself stays within the travel; from the first to the last layer they do not.
    Job fixed;
    fixed.machine.table = BuildTable::fixed;
    fixed.machine.travel_z = 70;
    const std::string said = refusal(box(context, 60, 60, 60), fixed, "machine.travel_z");
    EXPECT_NE(said.find("in layer 1"), std::string::npos) << said;
    EXPECT_NE(said.find("in layer 4"), std::string::npos) << said;
    EXPECT_NE(said.find("machine.travel_z of 70.0 mm"), std::string::npos) << said;
    fixed.machine.table = BuildTable::moving;
    EXPECT_EQ(make_plan(context, box(context, 60, 60, 60), {}, fixed).layers.size(), 4U);
    Job shallow;
    shallow.machine.build_height = 70;
    (void)refusal(box(context, 60, 60, 60), shallow, "machine.build_height");
}

TEST(Planner, APartThatFillsTheSlabStaysWithinTheTravel) {
    Context context;
    MetrePattern pattern;
    pattern.facets = 20'000;
    pattern.height_mm = 60;
    std::vector<Facet> facets;
    metre_pattern(pattern, [&](const Facet& f) { facets.push_back(f); });
    const Mesh mesh = weld(context, facets);
    const Box3 size = bounds(mesh.view());
    ASSERT_NEAR(size.max.x - size.min.x, 1160, 0.01);
    Job job;
    const Plan plan = make_plan(context, mesh, {}, job);
    EXPECT_NEAR(plan.stock_max[0] - plan.stock_min[0], 1160, 0.01);
    const double cx = 0.5 * (plan.stock_min[0] + plan.stock_max[0]),
                 cy = 0.5 * (plan.stock_min[1] + plan.stock_max[1]);
    std::size_t moves = 0;
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations)
            for (const Move& m : op.moves) {
                ++moves;
                ASSERT_LE(std::abs(to_mm(m.x) - cx), 610.0001) << op.purpose;
                ASSERT_LE(std::abs(to_mm(m.y) - cy), 610.0001) << op.purpose;
            }
    EXPECT_GT(moves, 10'000U);
}

// The stock is exact at its points, so what a rapid takes of it shows, however low the rapids run.
TEST(Planner, RapidsTakeNoStockAndMovesStayAboveTheirFloor) {
    Context context;
    const Mesh mesh = weld(context, pump_cover());
    const Plan plan = make_plan(context, mesh, {}, Job{});
    CellGrid grid{plan.stock_min[0], plan.stock_min[1], 0.5, 0, 0};
    grid.nx = static_cast<int>((plan.stock_max[0] - plan.stock_min[0]) / grid.cell) + 1;
    grid.ny = static_cast<int>((plan.stock_max[1] - plan.stock_min[1]) / grid.cell) + 1;
    Stock stock(grid);
    std::size_t low = 0;
    for (const Layer& layer : plan.layers) {
        stock.add_slab(layer.z_bottom, layer.slab_thickness);
        for (const Operation& op : layer.operations) {
            ASSERT_GE(op.moves.size(), 3U);
            EXPECT_EQ(to_mm(op.moves.front().z), to_mm(to_units(op.clearance_z)));
            EXPECT_EQ(op.moves.back().z, op.moves.front().z);
            const Tool& tool = *std::find_if(plan.job.tools.begin(), plan.job.tools.end(),
                                             [&](const Tool& t) { return t.number == op.tool; });
            const CutterEnd end{tool.kind == ToolKind::ball ? CutterEnd::Form::ball : CutterEnd::Form::flat,
                                tool.diameter / 2, 0};
            for (std::size_t k = 1; k < op.moves.size(); ++k) {
                const Move &a = op.moves[k - 1], &b = op.moves[k];
                const CutEffect effect = stock.cut(end, {to_mm(a.x), to_mm(a.y), to_mm(a.z)},
                                                   {to_mm(b.x), to_mm(b.y), to_mm(b.z)});
                if (b.feed == 0) {
                    EXPECT_LE(effect.deepest, 1e-4) << op.purpose << " move " << k;
                    low += to_mm(b.z) < layer.z_top && (a.x != b.x || a.y != b.y);
                }
                EXPECT_GE(to_mm(b.z), layer.z_bottom - 3.175 - 1e-4);
            }
        }
    }
    EXPECT_GT(low, 10U) << "no rapid makes use of what has been cleared";
}

// Straight down no tool that does not plunge meets more than a scrape with its middle. The stock is exact at
// its points; both ways of roughing.
TEST(Planner, OnlyToolsThatPlungeGoStraightDownIntoStock) {
    for (const RoughPattern pattern : {RoughPattern::contour, RoughPattern::zigzag}) {
        Context context;
        const Mesh mesh = weld(context, pump_cover());
        Job job;
        job.cutting.rough_pattern = pattern;
        const Plan plan = make_plan(context, mesh, {}, job);
        CellGrid grid{plan.stock_min[0], plan.stock_min[1], 0.5, 0, 0};
        grid.nx = static_cast<int>((plan.stock_max[0] - plan.stock_min[0]) / grid.cell) + 1;
        grid.ny = static_cast<int>((plan.stock_max[1] - plan.stock_min[1]) / grid.cell) + 1;
        Stock stock(grid);
        std::size_t down = 0, sloping = 0;
        for (const Layer& layer : plan.layers) {
            stock.add_slab(layer.z_bottom, layer.slab_thickness);
            for (const Operation& op : layer.operations) {
                const Tool& tool = *std::find_if(plan.job.tools.begin(), plan.job.tools.end(),
                                                 [&](const Tool& t) { return t.number == op.tool; });
                const CutterEnd end{
                    tool.kind == ToolKind::ball ? CutterEnd::Form::ball : CutterEnd::Form::flat,
                    tool.diameter / 2, 0};
                const CutterEnd middle{CutterEnd::Form::flat, PathBuilder::kMiddle * tool.diameter / 2, 0};
                for (std::size_t k = 1; k < op.moves.size(); ++k) {
                    const Move &a = op.moves[k - 1], &b = op.moves[k];
                    const std::array<double, 3> from{to_mm(a.x), to_mm(a.y), to_mm(a.z)},
                        to{to_mm(b.x), to_mm(b.y), to_mm(b.z)};
                    const bool vertical = a.x == b.x && a.y == b.y && b.z < a.z;
                    if (vertical && !tool.plunges) {
                        ++down;
                        EXPECT_LE(stock.cut(middle, from, to).deepest, PathBuilder::kScrape + 1e-3)
                            << op.purpose << " move " << k;
                    }
                    sloping += op.kind == OperationKind::rough && !vertical && b.feed > 0 && b.z < a.z;
                    if (b.is_arc()) {
                        const ArcShape arc = arc_shape(a, b);
                        stock.cut(end, LevelArc{arc.x, arc.y, to[2], arc.radius, arc.start, arc.sweep});
                    } else {
                        stock.cut(end, from, to);
                    }
                }
            }
        }
        EXPECT_GT(down, 10U);
        EXPECT_GT(sloping, 10U) << "no pocket was entered on a helix or a ramp";
    }
}

// What links cost: the cuts of one operation lie near each other, and the cutter stays down or lifts just
// over what stands. Retracting above the layer after every run, raster and level contours of this part have
// 57 and 5.5 m of rapids.
TEST(Planner, RapidsAreAFractionOfTheCuts) {
    Context context;
    const Mesh mesh = weld(context, pump_cover());
    const Plan plan = make_plan(context, mesh, {}, Job{});
    double cutting = 0, rapid = 0;
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations) {
            cutting += op.cutting_mm, rapid += op.rapid_mm;
            const double most = op.purpose == "projected raster" ? 0.1
                                : op.purpose == "level contours" ? 0.25
                                                                 : 1e9;
            EXPECT_LT(op.rapid_mm, most * op.cutting_mm) << op.purpose << " of layer " << layer.index;
        }
    EXPECT_LT(rapid, 0.2 * cutting);
}

// A block with one sloping side: the ball goes along that side, and not around the rim of the vertical walls,
// which a lower level and the flat end mill make.
TEST(Planner, LevelsDoNotRoundTheRimsOfVerticalWalls) {
    Context context;
    constexpr double ramp = 10, high = 15;
    const std::vector<support::Ring> rings{{0, {{0, 0}, {80, 0}, {80, 50}, {0, 50}}},
                                           {high, {{ramp, 0}, {80, 0}, {80, 50}, {ramp, 50}}}};
    const Mesh mesh = support::loft(context, rings);
    double levels = 0;
    for (const Layer& layer : make_plan(context, mesh, {}, Job{}).layers)
        for (const Operation& op : layer.operations) {
            if (op.purpose != "level contours") continue;
            levels += op.cutting_mm;
            for (const Move& m : op.moves)
                if (m.feed != 0) {
                    EXPECT_LT(to_mm(m.x), 2 * ramp) << to_mm(m.y) << ' ' << to_mm(m.z);
                }
        }
    EXPECT_GT(levels, 500.0);
}

// What the face mill takes beside a block: replayed on a grid of its own, hardly any of its way is in air.
// The stock ends where a ring around the block already reaches.
TEST(Planner, OpenWasteMeetsWood) {
    for (const double margin : {40.0, 50.0, 55.0, 60.0, 70.0}) {
        SCOPED_TRACE(margin);
        Context context;
        const std::vector<support::Ring> rings{{0, {{0, 0}, {160, 0}, {160, 90}, {0, 90}}},
                                               {30, {{0, 0}, {160, 0}, {160, 90}, {0, 90}}}};
        Job job;
        job.slabs.margin = margin;
        const Plan plan = make_plan(context, support::loft(context, rings), {}, job);
        double feed = 0, air = 0;
        for (const Layer& layer : plan.layers)
            for (const Operation& op : layer.operations) {
                if (op.purpose != "open waste") continue;
                const double r = job.tools[0].diameter / 2;
                const int nx = static_cast<int>(plan.stock_max[0] - plan.stock_min[0]),
                          ny = static_cast<int>(plan.stock_max[1] - plan.stock_min[1]);
                std::vector<double> top(static_cast<std::size_t>(nx * ny), layer.z_top);
                for (std::size_t k = 1; k < op.moves.size(); ++k) {
                    const Move &a = op.moves[k - 1], &b = op.moves[k];
                    if (b.feed == 0 || a.z != b.z || b.is_arc()) continue;
                    const double length = std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y));
                    const int steps = 1 + static_cast<int>(length);
                    for (int step = 1; step <= steps; ++step) {
                        const double t = static_cast<double>(step) / steps,
                                     x = to_mm(a.x) + t * to_mm(b.x - a.x) - plan.stock_min[0],
                                     y = to_mm(a.y) + t * to_mm(b.y - a.y) - plan.stock_min[1];
                        bool met = false;
                        for (int j = std::max(0, static_cast<int>(y - r)); j < std::min<double>(ny, y + r);
                             ++j)
                            for (int i = std::max(0, static_cast<int>(x - r));
                                 i < std::min<double>(nx, x + r); ++i) {
                                double& h = top[static_cast<std::size_t>(j * nx + i)];
                                if (std::hypot(i + 0.5 - x, j + 0.5 - y) >= r || h <= to_mm(b.z)) continue;
                                h = to_mm(b.z);
                                met = true;
                            }
                        feed += length / steps;
                        if (!met) air += length / steps;
                    }
                }
            }
        EXPECT_GT(feed, 500.0);
        EXPECT_LT(air, 0.1 * feed) << feed;
        std::printf("margin %.1f mm: %.0f of %.0f mm in air\n", margin, air, feed);
    }
}

// The ball crosses the floors that no flat end mill finishes, and those only.
TEST(Planner, TheRasterCutsFloorsWhereNoFlatEndMillStands) {
    for (const double wide : {5.0, 40.0}) {
        Context context;
        const Mesh mesh = test::height_field(context, 121, 0.5, [&](double x, double y) {
            return std::abs(x) < wide && std::abs(y) < 20 ? 6.0 : 10.0;
        });
        double cutting = 0;
        for (const Layer& layer : make_plan(context, mesh, {}, Job{}).layers)
            for (const Operation& op : layer.operations)
                if (op.purpose == "projected raster") cutting += op.cutting_mm;
        if (wide < 6) EXPECT_GT(cutting, 40.0) << "a floor 10 mm wide";
        else EXPECT_EQ(cutting, 0.0) << "a floor as wide as the part";
    }
}

// The models as files, planned, written, read back and simulated.
TEST(Planner, NoProgramTouchesTheOwnModels) {
    for (const char* name : {"pump-cover", "half-sphere", "luo-tool-sample", "luo-layer-sample"}) {
        SCOPED_TRACE(name);
        Context context;
        Job job;
        job.allow_undercut = true;
        const std::string stl = support::checkout("tests/data/") + name + ".stl";
        const support::TemporaryFolder folder;
        const std::string out = folder / "out";
        write(context, plan(context, stl, job), out);
        const VerifyResult result = verify(context, out, stl);
        EXPECT_LE(result.gouge_mm, 0.01);
        EXPECT_GT(result.gouge_mm, 0) << "nothing touches: the check has seen nothing";
        for (const Diagnostic& d :
             result.violations)  // what stays on the part is another matter than what touches it
            EXPECT_TRUE(d.code.starts_with("left.")) << d.code << ' ' << d.message;
    }
}

// Totals know the wood: half a sphere of 50 mm, whose vertices lie on the sphere.
// Whoever waits sees it move: within the layers too, from the beginning of planning to the end of the report.
TEST(Planner, ProgressIsToldAllTheWay) {
    std::vector<std::pair<std::string, double>> told;
    Context context({.progress = [&](const Progress& p) { told.emplace_back(p.phase, p.fraction); }});
    context.share_progress(0, kPlanningShare);
    const std::string stl = support::checkout("tests/data/half-sphere.stl");
    const Plan result = plan(context, stl, Job{});
    ASSERT_FALSE(told.empty());
    EXPECT_LE(told.back().second, kPlanningShare + 1e-9);
    const support::TemporaryFolder folder;
    (void)write_verified(context, result, folder / "out", stl);
    double before = 0, widest = 0;
    std::size_t in_paths = 0;
    for (const auto& [phase, fraction] : told) {
        EXPECT_GE(fraction, before);
        widest = std::max(widest, fraction - before);
        in_paths += phase == "paths";
        before = fraction;
    }
    EXPECT_DOUBLE_EQ(before, 1);
    EXPECT_GT(in_paths, 5 * result.layers.size());
    EXPECT_LT(widest, 0.2);
}

// A level step of 272 cm² is no more work than roughing four times as much away: its layer, which is planned
// first, is told to be three quarters of it all, not nearly all.
TEST(Planner, ProgressGoesByTheWorkOfALayer) {
    std::vector<double> told;
    Context context({.threads = 1, .progress = [&](const Progress& p) {
                         if (p.phase == "paths") told.push_back(p.fraction);
                     }});
    shapes::Facets facets = shapes::box({0, 0, 0}, {200, 200, 9});
    shapes::append(facets, shapes::box({20, 20, 0}, {100, 180, 36}));
    const std::size_t layers = make_plan(context, weld(context, facets), {}, Job{}).layers.size();
    ASSERT_GT(layers, 1U);
    ASSERT_EQ(told.size() % layers, 1U) << "as often in each";
    const double first = told.front(), last = told.back(),
                 share = (told[told.size() / layers] - first) / (last - first);
    EXPECT_NEAR(share, 0.77, 0.08);
}

// Read once for both, or for each: the same plan and the same findings.
TEST(Planner, APatternIsReadOnceForPlanAndVerification) {
    Context context;
    const std::string stl = support::checkout("tests/data/half-sphere.stl");
    const support::TemporaryFolder folder;
    const Job job;
    (void)write_verified(context, plan(context, stl, job), folder / "twice", stl);
    const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
    const Plan planned = plan(context, *pattern, job);
    std::size_t reads = 0;
    Context counting({.progress = [&](const Progress& p) { reads += p.phase == "read"; }});
    (void)write_verified(counting, planned, folder / "once", pattern);
    EXPECT_EQ(reads, 0u);
    for (const char* file : {"/plan.json", "/verify.json"})
        EXPECT_EQ(support::slurp(folder / "once" + file), support::slurp(folder / "twice" + file)) << file;

    Job inches;
    inches.units = LengthUnit::inch;
    try {
        (void)plan(context, *pattern, inches);
        FAIL() << "planned in other units than it was read in";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage) << error.what();
    }
    const auto other = read_pattern(context, support::checkout("tests/data/pump-cover.stl"), job);
    try {
        (void)write_verified(context, planned, folder / "other", other);
        FAIL() << "verified against another pattern than was planned";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "verify.other_pattern") << error.what();
    }
}

TEST(Planner, TotalsHoldThePartsVolume) {
    Context context;
    const Plan result = plan(context, support::checkout("tests/data/half-sphere.stl"), Job{});
    const double whole = 2.0 / 3.0 * std::numbers::pi * 50 * 50 * 50;
    EXPECT_NEAR(result.totals.part_volume_mm3, whole, 0.002 * whole);
    EXPECT_LT(result.totals.part_volume_mm3, result.totals.stock_volume_mm3);
}

// The pump cover is made as planned: nothing above the cusp stays where a tool reaches.
TEST(Planner, ThePumpCoverVerifies) {
    Context context;
    const std::string stl = support::checkout("tests/data/pump-cover.stl");
    const support::TemporaryFolder folder;
    write(context, plan(context, stl, Job{}), folder / "out");
    const VerifyResult result = verify(context, folder / "out", stl);
    EXPECT_TRUE(result.passed) << (result.violations.empty() ? "" : result.violations[0].message);
}

// A slow z and y: no feed asks them for more, which verify() would refuse, and it takes longer.
TEST(Planner, FeedsKeepToTheAxes) {
    Context context;
    const std::string stl = support::checkout("tests/data/pump-cover.stl");
    Job job;
    const double minutes = plan(context, stl, job).totals.cutting_minutes;
    job.machine.rapid_y = 6000, job.machine.rapid_z = 900;
    const Plan slow = plan(context, stl, job);
    EXPECT_GT(slow.totals.cutting_minutes, 1.1 * minutes);
    for (const Layer& layer : slow.layers)
        for (const Operation& op : layer.operations)
            for (std::size_t k = 1; k < op.moves.size(); ++k) {
                const Move &a = op.moves[k - 1], &b = op.moves[k];
                if (b.feed == 0 || b.is_arc()) continue;
                const double y = std::abs(to_mm(b.y) - to_mm(a.y)), z = std::abs(to_mm(b.z) - to_mm(a.z));
                const double length = std::hypot(to_mm(b.x) - to_mm(a.x), y, z);
                ASSERT_LE(b.feed * z, 900.001 * length) << op.purpose << " move " << k;
                ASSERT_LE(b.feed * y, 6000.001 * length) << op.purpose << " move " << k;
            }
    const support::TemporaryFolder folder;
    write(context, slow, folder / "out");
    const VerifyResult result = verify(context, folder / "out", stl);
    EXPECT_TRUE(result.passed) << (result.violations.empty() ? "" : result.violations[0].message);
}

}  // namespace
}  // namespace slabwright
