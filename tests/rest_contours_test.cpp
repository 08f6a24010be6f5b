// What cutters leave, cleared on contours: a semi-roughing takes all that stands outside the finish tool's
// swath and no more than its tool reaches, and a layer whose roughing cutter does not fit everywhere is
// faster and as well made as on a raster.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <vector>

#include "engine/paths/operations/roughing.h"
#include "engine/paths/operations/semi_rough.h"
#include "engine/paths/paths.h"
#include "engine/planner/planner.h"
#include "engine/tool_choice/select.h"
#include "engine/tools/libraries.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"
#include "tests/support/end_mill_job.h"
#include "tests/support/height_field.h"
#include "tests/support/places.h"
#include "tests/support/plate_with.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

constexpr double kTop = 14;

// A block with a notch of 18 mm that a 1 in cutter does not enter, open to +x.
double notched_or_base(double x, double y) { return std::abs(y) < 9 && x > -12 ? 0.5 : kTop; }

struct Notch {
    Context context;
    Job job = test::end_mill_job();
    Mesh mesh = test::height_field(context, 60, 1, notched_or_base);
    LayerJob layer;
    LayerCut cut;
    Standing standing;

    Notch()
        : cut{context,
              layer,
              job,
              layer_solid(context, mesh.view(), 0, kTop),
              kTop,
              {},
              alpha_map(context, mesh.view(), 0, kTop),
              nullptr,
              {}},
          standing({-40, -40}, {40, 40}, kTop) {
        job.tools = luo_library();
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_bottom = 0;
        layer.z_top = layer.slab_thickness = kTop;
        layer.stock_min = {-40, -40};
        layer.stock_max = {40, 40};
        layer.tools = fixed_tools(job);
        cut.standing = &standing;
        cut.floors = {0.5};
    }
    [[nodiscard]] Tool tool(ToolKind kind, double inches) const {
        for (const Tool& t : job.tools)
            if (t.kind == kind && std::abs(t.diameter - inches * kInch) < 1e-9) return t;
        return {};
    }
    [[nodiscard]] Tool flat(double inches) const { return tool(ToolKind::flat, inches); }
};

// However a layer's stock puts the moves of an operation in order, it stands as it does after one move after
// another.
TEST(LayerStock, StandsAsAfterOneMoveAfterAnother) {
    std::mt19937 random(test::seed());
    Notch n;
    auto somewhere = [&](double low, double high) {
        return to_units(std::uniform_real_distribution(low, high)(random));
    };
    for (const ToolKind kind : {ToolKind::flat, ToolKind::ball}) {
        const Tool tool = tool_of_kind(n.job, kind);
        Operation op;
        for (const double level :
             {11.0, 7.5, 4.0, 0.0, 9.0}) {  // a level over others comes last, as finish passes do
            op.moves.push_back({somewhere(-40, 40), somewhere(-40, 40), to_units(kTop + 2), 0});
            std::int32_t z = to_units(level);
            for (int k = 0; k < 300; ++k) {
                const Move& at = op.moves.back();
                if (k % 40 == 39) z = to_units(level) + somewhere(-0.5, 1);
                op.moves.push_back({std::clamp(at.x + somewhere(-12, 12), to_units(-45), to_units(45)),
                                    std::clamp(at.y + somewhere(-12, 12), to_units(-45), to_units(45)), z,
                                    k % 50 == 49 ? 0U : 1000U});
            }
        }
        LayerStock together(n.cut.context, n.cut.layer, n.cut.solid, 0.25), singly = together,
                                                                            tried = together;
        const std::vector<float> whole(together.heights().begin(), together.heights().end());
        const Taken taken = together.cut(n.cut.context, op, tool);
        for (std::size_t i = 1; i < op.moves.size(); ++i) {
            Operation one;
            one.moves = {op.moves[i - 1], op.moves[i]};
            singly.cut(n.cut.context, one, tool);
        }
        // But for rounding, which the way that several moves are laid together may change near nothing.
        EXPECT_TRUE(std::ranges::equal(together.heights(), singly.heights(),
                                       [](float a, float b) { return std::abs(a - b) < 1e-9F; }));
        std::size_t cells = 0;
        for (std::size_t c = 0; c < whole.size(); ++c) cells += whole[c] - together.height(c) > kEmpty;
        EXPECT_LE(taken.cells, cells);
        EXPECT_FALSE(taken.few());
        EXPECT_GT(cells, whole.size() / 2);
        // In a trial all of it is kept, and counted.
        LayerStock::Trial trial(tried);
        EXPECT_EQ(tried.cut(n.cut.context, op, tool).cells, cells);
        EXPECT_TRUE(std::ranges::equal(together.heights(), tried.heights()));
        trial.undo();
        EXPECT_TRUE(std::ranges::equal(whole, tried.heights()));
        // Again nothing is there to be taken.
        EXPECT_TRUE(together.cut(n.cut.context, op, tool).nothing());
    }
}

TEST(LayerStock, ATraceOffManyCellsIsNothing) {
    EXPECT_TRUE((Taken{.most = 0.1F, .mm3 = 0.4, .cells = 50}.nothing())) << "a trace";
    EXPECT_FALSE((Taken{.most = 0.1F, .mm3 = 0.6, .cells = 50}.nothing()));
    EXPECT_FALSE((Taken{.most = 0.3F, .mm3 = 0.1, .cells = 8}.nothing())) << "little, but thick";
    EXPECT_TRUE((Taken{.most = 0.3F, .mm3 = 0.1, .cells = 3}.nothing())) << "a few cells";
    EXPECT_TRUE((Taken{.most = 0.3F, .mm3 = 0.6, .cells = 3}.nothing())) << "a few cells";
    EXPECT_TRUE((Taken{.most = 3.6F, .mm3 = 0.47, .cells = 6}.nothing())) << "centres that lie on a wall";
    EXPECT_FALSE((Taken{.most = 3.6F, .mm3 = 0.6, .cells = 6}.nothing()));
    EXPECT_FALSE((Taken{.most = 0.5F, .mm3 = 0.6, .cells = 1}.nothing())) << "thick enough for any number";
}

// A trial within another: what the inner one undoes is gone, what it leaves is undone with the outer.
TEST(LayerStock, StandsAsBeforeWhenATrialIsUndone) {
    std::mt19937 random(test::seed());
    Notch n;
    auto somewhere = [&](double low, double high) {
        return std::uniform_real_distribution(low, high)(random);
    };
    const Tool tool = tool_of_kind(n.job, ToolKind::ball);
    LayerStock stock(n.cut.context, n.cut.layer, n.cut.solid, 0.25);
    const auto cut = [&] {
        for (int k = 0; k < 20; ++k)
            stock.cut_at(cutter_end(tool), somewhere(-45, 45), somewhere(-45, 45), somewhere(0, kTop));
        Operation op;
        for (int k = 0; k < 10; ++k)
            op.moves.push_back({to_units(somewhere(-45, 45)), to_units(somewhere(-45, 45)),
                                to_units(somewhere(0, kTop)), k == 0 ? 0U : 1000U});
        stock.cut(n.cut.context, op, tool);
    };
    const auto heights = [&] { return std::vector<float>(stock.heights().begin(), stock.heights().end()); };
    // Whatever was asked before, on whatever stood then.
    const auto expect_left = [&] {
        for (const double limit : {1.0, 5.0, 0.06}) {
            std::size_t cells = 0;
            for (std::size_t c = 0; c < stock.grid().count(); ++c) cells += stock.left(c) > limit;
            const double cell = stock.grid().cell;
            EXPECT_NEAR(stock.area_over(n.context, limit), static_cast<double>(cells) * cell * cell, 1e-6)
                << limit;
        }
    };
    for (int round = 0; round < 4; ++round) {
        cut();
        expect_left();
        const std::vector<float> first = heights();
        {
            LayerStock::Trial outer(stock);
            if (round % 2 == 0) cut();
            const std::vector<float> second = heights();
            {
                LayerStock::Trial undone(stock);
                cut();
                ASSERT_NE(heights(), second);
                expect_left();
                undone.undo();
                ASSERT_EQ(heights(), second);
                expect_left();
            }
            {
                const LayerStock::Trial stays(stock);
                cut();
            }
            ASSERT_NE(heights(), second);
            if (round < 2) {
                outer.undo();
                ASSERT_EQ(heights(), first);
                expect_left();
            }
        }
        if (round >= 2) {
            ASSERT_NE(heights(), first);
        }
    }
}

TEST(RestContours, SemiRoughingTakesWhatStandsOutsideTheSwathAndReachesIt) {
    for (const double swath : {0.0, 3.0, 6.0}) {
        Notch n;
        const Tool rough = n.flat(1), semi = n.flat(0.5);
        n.layer.tools.rough = rough;
        LayerStock stock(n.cut.context, n.cut.layer, n.cut.solid, 0.25);
        const Operation roughing = rough_layer(n.cut).back();
        stock.cut(n.cut.context, roughing, rough);
        const LayerStock before = stock;
        const Operation op = semi_rough_layer(n.cut, stock, semi, {"waste", 1.0, swath, 0.3});
        ASSERT_FALSE(op.moves.empty());
        EXPECT_LE(op.stepdown, semi.stepdown_max + 1e-9);
        // Nothing of the part is entered.
        const double gouge = n.job.tolerances.gouge;
        const DropIndex part(n.cut.solid, flat_cutter(semi.diameter / 2 - gouge));
        for (std::size_t i = 1; i < op.moves.size(); ++i) {
            const Move &a = op.moves[i - 1], &b = op.moves[i];
            if (b.feed == 0) continue;
            for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0}) {
                const double x = to_mm(a.x) + t * (to_mm(b.x) - to_mm(a.x)),
                             y = to_mm(a.y) + t * (to_mm(b.y) - to_mm(a.y)),
                             z = to_mm(a.z) + t * (to_mm(b.z) - to_mm(a.z));
                ASSERT_GE(z, part.drop(x, y).tip_z - gouge)
                    << "swath " << swath << " at " << x << ' ' << y << ' ' << z;
            }
        }
        // Of what stood on the notch's floor, the middle is gone; nothing stands that the cutter reaches
        // outside the swath. Facets of the height field are 1 mm wide, so its walls lean over the cells
        // beside them.
        int stood = 0, left = 0;
        for (int j = 0; j < stock.grid().ny; ++j)
            for (int i = 0; i < stock.grid().nx; ++i) {
                const std::size_t c = stock.grid().index(i, j);
                const double x = stock.grid().x(i), y = stock.grid().y(j),
                             wall = std::min(9.0 - std::abs(y), x + 12.0), clear = std::max(swath, 0.3);
                // The corner's round is out of a flat end mill's reach.
                const double r = semi.diameter / 2, in_x = x + 12, in_y = 9 - std::abs(y);
                const bool in_corner = in_x < r + 1 && in_y < r + 1;
                if (wall < clear + 1.3 || x > 28 || in_corner || before.left(c) <= 1) continue;
                ++stood;
                left += stock.left(c) > 1;
            }
        EXPECT_GT(stood, 500);
        EXPECT_EQ(left, 0) << "swath " << swath;
    }
}

// A ball's rings keep off the surface on floors, slopes and walls alike, also where these go on below the
// layer, and take most of the waste.
TEST(RestContours, ABallsRingsKeepOffTheSurface) {
    constexpr double allowance = 0.1;
    auto slopes = [](double x, double y) {  // a valley with one steep and one gentle side, closed at -x
        const double side = y > 0 ? (y - 4) * 12 : (-y - 4) * 0.9;
        return std::clamp(std::max(side, x < -10 ? (-10 - x) * 4 : -4.0), -4.0, kTop);
    };
    for (const bool below : {false, true}) {
        Notch n;
        n.mesh = test::height_field(n.context, 60, 1, [&](double x, double y) {
            return std::max(slopes(x, y), below ? -4.0 : 0.5) + (below ? 4 : 0);
        });
        if (below)
            for (Vec3f& v : n.mesh.vertices) v.z -= 4;
        n.layer.mesh = n.mesh.view();
        n.layer.floor_below = below ? -3 : 0;
        n.cut.solid = layer_solid(n.context, n.mesh.view(), n.layer.floor_below, kTop);
        n.cut.alpha = alpha_map(n.context, n.mesh.view(), n.layer.floor_below, kTop);
        n.cut.floors.clear();
        const Tool rough = n.flat(1), ball = n.tool(ToolKind::ball, 0.25);
        n.layer.tools.rough = rough;
        LayerStock stock(n.cut.context, n.cut.layer, n.cut.solid, 0.25);
        stock.cut(n.cut.context, rough_layer(n.cut).back(), rough);
        const double before = stock.area_over(n.context, 1);
        const Operation op = semi_rough_layer(n.cut, stock, ball, {"waste", 1.0, 0, allowance});
        ASSERT_FALSE(op.moves.empty());
        EXPECT_LE(op.stepdown, ball.stepdown_max + 1e-9);
        EXPECT_EQ(op.spare, allowance);
        // Chords may take a part of the allowance.
        const double kept = 0.3 * allowance;
        const DropIndex part(n.cut.solid, ball_cutter(ball.diameter / 2 + kept));
        double lowest = kTop;
        for (std::size_t i = 1; i < op.moves.size(); ++i) {
            const Move &a = op.moves[i - 1], &b = op.moves[i];
            if (b.feed == 0) continue;
            lowest = std::min(lowest, to_mm(b.z));
            for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0}) {
                const double x = to_mm(a.x) + t * (to_mm(b.x) - to_mm(a.x)),
                             y = to_mm(a.y) + t * (to_mm(b.y) - to_mm(a.y)),
                             z = to_mm(a.z) + t * (to_mm(b.z) - to_mm(a.z));
                ASSERT_GE(z, part.drop(x, y).tip_z + kept)
                    << "below " << below << " at " << x << ' ' << y << ' ' << z;
            }
        }
        EXPECT_EQ(lowest < -0.5, below);
        EXPECT_GE(lowest, n.layer.floor_below);
        EXPECT_GT(before, 200);
        EXPECT_LT(stock.area_over(n.context, 1), 0.3 * before) << "below " << below;
    }
}

// A channel with an upright and a slanted side: a flat that may cut it at once follows the upright side once,
// and terraces the other; one that cuts in steps as fine as the stairs goes along both at every step.
TEST(RestContours, SemiRoughingGoesAsDeepAsItsCutterAndTerracesSlopes) {
    std::vector<double> length, left, deepest;
    for (const double step : {1.0, 5.0, kTop}) {
        Notch n;
        n.mesh = test::height_field(n.context, 60, 1, [](double x, double y) {
            const double side = y > 0 ? 1.5 * (y - 5) : (-y - 5) * 100, end = (-12 - x) * 100;
            return std::clamp(std::max(side, end), 0.5, kTop);
        });
        n.layer.mesh = n.mesh.view();
        n.cut.solid = layer_solid(n.context, n.mesh.view(), 0, kTop);
        n.cut.alpha = alpha_map(n.context, n.mesh.view(), 0, kTop);
        Tool semi = n.flat(0.25);
        semi.stepdown_min = 1;
        semi.stepdown_max = step;
        n.layer.tools.rough = n.flat(1);
        LayerStock stock(n.cut.context, n.cut.layer, n.cut.solid, 0.25);
        stock.cut(n.cut.context, rough_layer(n.cut).back(), n.layer.tools.rough);
        const double before = stock.area_over(n.context, 1);
        const Operation op = semi_rough_layer(n.cut, stock, semi, {"waste", 1.0, 0, 0.3});
        double mm = 0;
        for (std::size_t i = 1; i < op.moves.size(); ++i)
            if (op.moves[i].feed > 0)
                mm += std::hypot(to_mm(op.moves[i].x) - to_mm(op.moves[i - 1].x),
                                 to_mm(op.moves[i].y) - to_mm(op.moves[i - 1].y));
        length.push_back(mm);
        left.push_back(stock.area_over(n.context, 1));
        deepest.push_back(op.stepdown);
        EXPECT_LT(left.back(), 0.2 * before) << step;
    }
    std::printf("steps of 1, 5, %.0f mm: %.0f, %.0f, %.0f mm of feed, %.0f, %.0f, %.0f mm2 left\n", kTop,
                length[0], length[1], length[2], left[0], left[1], left[2]);
    EXPECT_LE(deepest[1], 5 + 1e-9);
    EXPECT_GT(deepest[2], 5);
    EXPECT_LT(length[1], 0.8 * length[0]);
    EXPECT_LT(length[2], 0.7 * length[0]);
    for (const double mm2 : left) EXPECT_NEAR(mm2, left[0], 0.15 * left[0] + 5);
}

// Wider roughing cutters keep the whole range of their steps, and what they leave is for a much narrower one.
TEST(RestContours, AMuchNarrowerFlatFollowsAWiderOne) {
    int followed = 0;
    for (const auto& library : {luo_library(), shop_library()}) {
        Notch n;
        n.job.tools = library;
        for (const double finish : {0.5, 0.25}) {
            LayerTools base = fixed_tools(n.job);
            base.finish = n.tool(ToolKind::ball, finish);
            for (const LayerTools& set : with_wider_rough(n.cut.context, n.layer, base)) {
                const Tool own = n.flat(set.rough.diameter / kInch);
                EXPECT_EQ(set.rough.stepdown_min, own.stepdown_min);
                EXPECT_EQ(set.rough.stepdown_max, own.stepdown_max);
                for (const Tool& semi : set.semi_rough) {
                    ++followed;
                    EXPECT_LE(semi.diameter, 0.7 * set.rough.diameter);
                    EXPECT_GE(semi.diameter, 0.5 * base.finish.diameter);
                    for (const Tool& tool : library)
                        if (tool.kind == ToolKind::flat && tool.diameter > semi.diameter + 1e-9) {
                            EXPECT_GT(tool.diameter, 0.7 * set.rough.diameter) << "would follow sooner";
                        }
                }
            }
        }
    }
    EXPECT_GE(followed, 3);
}

// A pocket whose corners are a little tighter than the 1/2 in cutter: of one it leaves 1.4 mm².
TEST(RestContours, NoToolIsTakenForNextToNothing) {
    const auto narrow_corners = [](std::size_t tight) {
        std::vector<Corner> corners{{-40, -30, 10}, {40, -30, 10}, {40, 30, 10}, {-40, 30, 10}};
        for (std::size_t k = 0; k < tight; ++k) corners[k].radius = 5.8;
        const std::vector<Corner> block{{-70, -60, 10}, {70, -60, 10}, {70, 60, 10}, {-70, 60, 10}};
        const Outline outside = rounded_polygon(block, 0.01), inside = rounded_polygon(corners, 0.005);
        Context context;
        const Mesh mesh = weld(context, test::plate_with(outside, 12, inside, 4));
        Job job;
        job.tools = shop_library();
        std::size_t count = 0;
        for (const Layer& layer : make_plan(context, mesh, {}, job).layers)
            for (const Operation& op : layer.operations)
                count += op.purpose == "narrow corners" || op.purpose == "waste in narrow places";
        return count;
    };
    EXPECT_EQ(narrow_corners(1), 0U);
    EXPECT_GT(narrow_corners(4), 0U);
}

TEST(RestContours, AWiderSwathLeavesLessToSemiRoughing) {
    std::vector<double> length;
    for (const double swath : {0.5, 2.0, 4.0, 8.5}) {
        Notch n;
        n.cut.floors.clear();  // on a floor the swath leaves nothing to the ball
        const Tool rough = n.flat(1), semi = n.flat(0.25);
        n.layer.tools.rough = rough;
        LayerStock stock(n.cut.context, n.cut.layer, n.cut.solid, 0.25);
        stock.cut(n.cut.context, rough_layer(n.cut).back(), rough);
        double mm = 0;
        const Operation op = semi_rough_layer(n.cut, stock, semi, {"waste", 1.0, swath, 0.3});
        for (std::size_t i = 1; i < op.moves.size(); ++i)
            if (op.moves[i].feed > 0)
                mm += std::hypot(to_mm(op.moves[i].x) - to_mm(op.moves[i - 1].x),
                                 to_mm(op.moves[i].y) - to_mm(op.moves[i - 1].y));
        length.push_back(mm);
    }
    EXPECT_TRUE(std::is_sorted(length.rbegin(), length.rend()))
        << length[0] << ' ' << length[1] << ' ' << length[2] << ' ' << length[3];
    EXPECT_LT(length.back(), 0.5 * length.front());
}

// LUO's sample with print's two tools, and with all of them: contours are faster than the raster, and the
// part is made.
TEST(RestContours, LuosSampleIsFasterOnContoursAndVerifies) {
    Context context;
    const Mesh mesh = weld(context, luo_tool_sample());
    const std::string stl = support::checkout("tests/data/luo-tool-sample.stl");
    for (const bool all : {false, true}) {
        Job job;
        if (all) job.tools = luo_library();
        job.selection.mode = SelectionMode::fixed;
        job.cutting.engagement = Engagement::nominal;
        std::vector<double> minutes;
        for (const RestPattern pattern : {RestPattern::raster, RestPattern::contour}) {
            job.cutting.rest_pattern = pattern;
            const Plan plan = make_plan(context, mesh, {}, job);
            minutes.push_back(plan.totals.cutting_minutes + plan.totals.tool_change_minutes);
        }
        EXPECT_LT(minutes[1], 0.95 * minutes[0]) << "all tools: " << all;
    }
    Job job;
    job.cutting.rest_pattern = RestPattern::contour;
    const support::TemporaryFolder folder;
    write(context, plan(context, stl, job), folder / "out");
    const VerifyResult result = verify(context, folder / "out", stl);
    EXPECT_TRUE(result.passed) << (result.violations.empty() ? "" : result.violations[0].message);
}

// A set of tools is given up once it cannot come near the best one, and not before.
TEST(RestContours, ToolsThatFallTooFarBehindAreGivenUp) {
    Notch n;
    n.layer.paced = true;
    const LayerResult best = plan_layer_paths(n.context, n.layer);
    EXPECT_FALSE(best.given_up);
    EXPECT_GT(best.pace[0], 0);
    EXPECT_TRUE(std::is_sorted(best.pace.begin(), best.pace.end()));
    const auto beside = [&](double times, std::size_t from, LayerPace least) {
        PaceAhead ahead{best.pace, least};
        for (std::size_t s = from; s < ahead.pace.size(); ++s) ahead.pace[s] *= times;
        n.layer.ahead = ahead;
        return plan_layer_paths(n.context, n.layer);
    };
    const LayerResult same = beside(1, 0, {1, 1, 1, 1});
    EXPECT_FALSE(same.given_up);
    EXPECT_EQ(same.operations.size(), best.operations.size());
    const LayerResult behind = beside(0.5, 0, {1, 1, 1, 1});
    EXPECT_TRUE(behind.given_up);
    EXPECT_LT(behind.operations.size(), best.operations.size());
    EXPECT_EQ(behind.pace[1], 0) << "given up after the first stage";
    // As far behind, it may still make up for it in what comes after that stage.
    const double first = best.pace[0], all = best.pace.back();
    ASSERT_LT(first, 0.5 * 1.2 * all) << "else there is no such case";
    EXPECT_FALSE(beside(1 / 1.19, 3, {0, 0, 0, 1}).given_up);
    EXPECT_TRUE(beside(1 / 1.21, 3, {0, 0, 0, 1}).given_up) << "at the end";
    // What has as much to do afterwards need not be followed so far.
    const auto alike = [&](double times) {
        n.layer.ahead = PaceAhead{best.pace, {1, 1, 1, 1}, 1.01};
        for (double& minutes : n.layer.ahead->pace) minutes -= times * all;
        return plan_layer_paths(n.context, n.layer);
    };
    EXPECT_FALSE(alike(0.005).given_up);
    const LayerResult alike_behind = alike(0.02);
    EXPECT_TRUE(alike_behind.given_up);
    EXPECT_EQ(alike_behind.pace[1], 0) << "given up after the first stage";
}

// Slots hardly wider than the end mill. Seed 2 has one that is .05 mm wider where it is narrowest: the place
// in it is found by sliding down between walls that its neighbours on either side stand on, and other slots
// put a dozen lines between these. Seed 6 has a pocket .12 mm wider, whose rim is level: the raster's places
// on both sides of it stand on that, and nothing shows but what is left.
TEST(RestContours, SlotsHardlyWiderAreFound) {
    for (const std::uint64_t seed : {2U, 6U}) {
        const MetrePattern pattern{150, 25, 8000, seed};
        const support::TemporaryFolder folder;
        const std::string stl = folder / "pattern.stl";
        {
            std::ofstream file(stl, std::ios::binary);
            file << stl_head("pattern", metre_pattern_facets(pattern));
            metre_pattern(pattern, [&](const Facet& facet) {
                const auto record = stl_facet(facet);
                file.write(record.data(), record.size());
            });
        }
        Context context;
        Job job;
        write(context, plan(context, stl, job), folder / "out");
        const Verification v = verify_folder(context, folder / "out", {.source = stl, .write = false});
        for (const Violation& violation : v.report.violations)
            ADD_FAILURE() << seed << ": " << violation.code << ": " << violation.message;
    }
}

}  // namespace
}  // namespace slabwright
