// What is quoted at once, beside what a plan says.
#include <gtest/gtest.h>

#include <numbers>
#include <numeric>
#include <string_view>

#include "engine/tools/tools.h"
#include "io/quote.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"
#include "tests/mesh_shapes.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

TEST(Quote, SaysWhatThePlanSays) {
    Context context;
    const support::TemporaryFolder folder;
    for (const auto& [name, facets] :
         {std::pair{"half-sphere.stl", half_sphere()}, {"pump-cover.stl", pump_cover()}}) {
        const std::string stl = folder / name;
        write_stl(stl, weld(context, facets));
        const Quote q = quote_model(context, stl, Job{}).quote;
        const Plan planned = plan(context, stl, Job{});
        EXPECT_EQ(q.outcome.layers, planned.totals.layers) << name;
        EXPECT_NEAR(q.stock[0], planned.stock_max[0] - planned.stock_min[0], 1e-3);
        EXPECT_NEAR(q.stock[1], planned.stock_max[1] - planned.stock_min[1], 1e-3);
        int quoted = 0, slabs = 0;
        for (const QuotedSlabs& s : q.slabs) quoted += s.count;
        double glue = 0;
        for (const Layer& layer : planned.layers) {
            slabs += layer.slabs;
            for (const Joint& joint : layer.joints) glue += joint.area_mm2 * 1e-6;
        }
        EXPECT_EQ(quoted, slabs) << name;
        EXPECT_NEAR(q.slab_m2, slabs * q.stock[0] * q.stock[1] * 1e-6, 1e-9);
        EXPECT_NEAR(q.glue_m2, glue, 0.2 * glue) << name;
        EXPECT_NEAR(q.mass_kg, planned.totals.stack_mass_kg, 1e-6) << name;
        EXPECT_NEAR(q.build_minutes, planned.totals.build_minutes, 0.5 * planned.totals.build_minutes)
            << name;
        EXPECT_LT(q.outcome.unmade_mm3, 1);
        double work = 0;
        for (const QuotedWork& w : q.work) work += w.minutes;
        EXPECT_NEAR(work, q.cutting_minutes, 1e-9);
        EXPECT_NEAR(q.build_minutes, q.cutting_minutes + q.bonding_minutes + q.tool_change_minutes, 1e-9);
    }
}

TEST(Quote, ReckonsBoardsAndMoneyAsThePlanDoes) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "half-sphere.stl";
    write_stl(stl, weld(context, half_sphere()));
    for (const Blanks blanks : {Blanks::pattern, Blanks::layer}) {
        Job job;
        job.slabs.blanks = blanks;
        const QuotedModel free = quote_model(context, stl, job);
        EXPECT_FALSE(free.quote.cost);
        EXPECT_EQ(quote_text(free).find("cost"), std::string::npos);
        job.prices = {"EUR", {20}, 0, 0, 60};
        const QuotedModel priced = quote_model(context, stl, job);
        const Plan planned = plan(context, stl, job);
        const CutList list = cut_list(planned);
        EXPECT_NEAR(priced.quote.boards.sawn_m2(), list.sawn_m2(), 1e-9);
        EXPECT_NEAR(priced.quote.slab_m2,
                    list.sawn_m2() - list.blanks[0].size.length * list.blanks[0].size.width * 1e-6, 1e-9);
        ASSERT_TRUE(priced.quote.cost);
        EXPECT_NEAR(*priced.quote.cost->boards, *cost_of(job, amounts_of(planned, list))->boards, 1e-9);
        EXPECT_NEAR(*priced.quote.cost->machine, priced.quote.build_minutes, 1e-9);
        EXPECT_NE(quote_text(priced).find("EUR (boards"), std::string::npos) << quote_text(priced);
        EXPECT_NE(quote_json(priced).find("\"total\""), std::string::npos);
    }
}

TEST(Quote, TakesTheThinnestSlabThatHoldsALayer) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "block.stl";
    write_stl(stl, weld(context, shapes::box({0, 0, 0}, {100, 80, 17})));
    Job job;
    job.slabs.thicknesses = {12, 19, 25};
    const Quote q = quote_model(context, stl, job).quote;
    ASSERT_EQ(q.slabs.size(), 1U);
    EXPECT_EQ(q.slabs[0].thickness, 19);
    EXPECT_EQ(q.slabs[0].count, 1);
    EXPECT_NEAR(q.glue_m2, 100 * 80 * 1e-6, 1e-6);
    EXPECT_NE(quote_json({{}, q}).find("slabwright.quote/1"), std::string::npos);
    EXPECT_NE(quote_text({{}, q}).find("1 of 19 x"), std::string::npos) << quote_text({{}, q});
}

// Every figure with as many digits as are told.
TEST(Quote, IsWrittenToTheDigitsThatMeanSomething) {
    QuotedModel model;
    model.input.file = "part.stl";
    Quote& q = model.quote;
    q.outcome.layers = 3;
    q.outcome.unmade_mm3 = 1.26;
    q.stock = {120.12345, 80.98765};
    q.slabs = {{19.123456, 3}};
    q.slab_m2 = 0.123456, q.glue_m2 = 0.654321, q.mass_kg = 4.5678;
    q.work = {{"rough", 1.23456, 2.34567}};
    q.cutting_minutes = 10.26, q.bonding_minutes = 20.26, q.tool_change_minutes = 0.26,
    q.build_minutes = 30.78;
    q.spread = 0.2567;
    const std::string text = quote_json(model);
    std::string packed;
    for (const char c : text)
        if (c != ' ' && c != '\n') packed += c;
    for (const char* part :
         {"\"layers\":3,\"unmade_mm3\":1.3,", "\"stock\":[120.123,80.988]",
          "{\"thickness\":19.1235,\"count\":3}", "\"slab_m2\":0.1235,\"glue_m2\":0.6543,\"mass_kg\":4.57,",
          "{\"name\":\"rough\",\"ideal_minutes\":1.235,\"minutes\":2.35}",
          "\"cutting_minutes\":10.3,\"bonding_minutes\":20.3,\"tool_change_minutes\":0.3,\"build_minutes\":"
          "30.8,"
          "\"spread\":0.26,\"boards\":0,\"bought_m2\":0,\"cost\":null"})
        EXPECT_NE(packed.find(part), std::string::npos) << part << " in\n" << text;
}

// Walls of less than 8 mm, and air where the face mill does not fit, as wide as they are.
TEST(Quote, MeasuresThinWallsAndNarrowAir) {
    Context context;
    const support::TemporaryFolder folder;
    const Job job;
    const auto ideal = [&](const shapes::Facets& facets, std::string_view name) {
        const std::string stl = folder / "part.stl";
        write_stl(stl, weld(context, facets));
        for (const QuotedWork& w : quote_model(context, stl, job).quote.work)
            if (w.name == name) return w.ideal_minutes;
        return -1.0;
    };
    const LayerTools tools = fixed_tools(job);
    const double levels = 17 / tools.finish.stepdown_max;
    const auto wall = [](float thick) { return shapes::box({0, 0, 0}, {100, thick, 17}); };
    const auto minutes = [](double mm, const Tool& tool) { return mm / tool.max_feed; };
    EXPECT_NEAR(ideal(wall(4), "thin walls"), minutes(levels * 100 * 4 / 8, tools.finish), 1e-6);
    EXPECT_NEAR(ideal(wall(7.9F), "thin walls"), minutes(levels * 100 * 7.9 / 8, tools.finish), 1e-6);
    // Of a thick one the four corners, outside a circle.
    const double corners = 4 * 4 * (4 - std::numbers::pi);
    EXPECT_NEAR(ideal(wall(30), "thin walls"), minutes(levels * corners / 8, tools.finish),
                minutes(levels * 4 / 8, tools.finish));
    EXPECT_NEAR(ideal(wall(30), "narrow places"), 0, 1e-6);
    // A frame of four bars around a hole that is square, too narrow for the face mill, or wide enough.
    const auto frame = [](float wide) {
        auto facets = shapes::box({0, 0, 0}, {20, wide + 40, 17});
        shapes::append(facets, shapes::box({wide + 20, 0, 0}, {wide + 40, wide + 40, 17}));
        shapes::append(facets, shapes::box({10, 0, 0}, {wide + 30, 20, 17}));
        shapes::append(facets, shapes::box({10, wide + 20, 0}, {wide + 30, wide + 40, 17}));
        return facets;
    };
    const Tool& rough = tools.rough;
    const double swath = rough.diameter * rough.stepover * rough.stepdown_max;
    EXPECT_NEAR(ideal(frame(30), "narrow places"), minutes(17. * 30 * 30 / swath, rough), 1e-6);
    const double inner = 25 * 25 * (4 - std::numbers::pi);
    EXPECT_NEAR(ideal(frame(100), "narrow places"), minutes(17. * inner / swath, rough),
                minutes(17. * 20 / swath, rough));
}

TEST(Quote, RefusesWhatNoSlabHolds) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "beam.stl";
    write_stl(stl, weld(context, shapes::box({0, 0, 0}, {3000, 80, 17})));
    try {
        (void)quote_model(context, stl, Job{});
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), "fit.slab");
    }
}

}  // namespace
}  // namespace slabwright
