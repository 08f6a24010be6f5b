// Slabs as large as their layers: planned, proven from the text, and told where one is too small.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "engine/schedule/blanks.h"
#include "io/quote.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/mesh/part.h"
#include "kernels/mesh/weld.h"
#include "kernels/slicing/slicing.h"
#include "nlohmann/json.hpp"
#include "tests/data/models.h"
#include "tests/mesh_shapes.h"
#include "tests/support/files.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using nlohmann::json;
using slabwright::support::slurp;
using slabwright::support::spit;
using slabwright::support::TemporaryFolder;

namespace {

Job by_layer() { return job_from_toml("[slabs]\nblanks = \"layer\"\n", "t"); }

PlanBox box_of(const Loops& loops) {
    PlanBox box;
    for (const Point2 p : loops.points) box.grow(to_mm(p.x), to_mm(p.y));
    return box;
}

/// A block with a smaller one on it, one body.
Mesh stepped(Context& context, double foot, double head) {
    std::vector<std::array<Vec3f, 3>> facets = shapes::box({0, 0, 0}, {100, 80, static_cast<float>(foot)});
    const auto top = shapes::box({60, 10, static_cast<float>(foot)}, {90, 30, static_cast<float>(head)});
    facets.insert(facets.end(), top.begin(), top.end());
    return weld(context, facets);
}

/// The codes of what a folder's proof finds.
std::string found(const std::string& out, const std::string& stl) {
    Context context;
    std::string codes;
    for (const Diagnostic& d : verify(context, out, stl, "", 1).violations)
        if (codes.find(d.code) == std::string::npos) codes += (codes.empty() ? "" : " ") + d.code;
    return codes;
}

}  // namespace

TEST(Blanks, ABoxHoldsAllSectionsBetweenAndNoMore) {
    Context context;
    std::mt19937 random(test::seed());
    for (const auto& facets : {half_sphere(), pump_cover()}) {
        const Mesh mesh = weld(context, facets);
        const double height = bounds(mesh.view()).max.z;
        std::vector<double> ends(9);
        for (double& z : ends) z = std::uniform_real_distribution(0.01, height - 0.01)(random);
        std::sort(ends.begin(), ends.end());
        std::vector<std::array<double, 2>> ranges;
        for (std::size_t i = 0; i + 2 < ends.size(); ++i)
            ranges.push_back({ends[i], ends[i + 1 + i % 2]});  // some overlap the next
        const std::vector<PlanBox> boxes = boxes_between(context, mesh.view(), ranges);
        for (std::size_t i = 0; i < ranges.size(); ++i) {
            std::vector<Plane> planes;
            constexpr int steps = 60;
            for (int k = 0; k <= steps; ++k)
                planes.push_back({ranges[i][0] + (ranges[i][1] - ranges[i][0]) * k / steps,
                                  k == steps ? Side::below : Side::above});
            PlanBox sections;
            for (const Section& s : slice(context, mesh.view(), planes)) {
                const PlanBox b = box_of(s.loops);
                if (b.is_empty()) continue;
                sections.grow(b.min[0], b.min[1]);
                sections.grow(b.max[0], b.max[1]);
            }
            for (std::size_t k = 0; k < 2; ++k) {
                EXPECT_LE(boxes[i].min[k], sections.min[k] + 1e-4);
                EXPECT_GE(boxes[i].max[k], sections.max[k] - 1e-4);
                // Between two of the sixty heights the widest place may hide.
                EXPECT_NEAR(boxes[i].min[k], sections.min[k], 1.5);
                EXPECT_NEAR(boxes[i].max[k], sections.max[k], 1.5);
            }
        }
        const std::vector<PlanBox> none =
            boxes_between(context, mesh.view(), std::vector<std::array<double, 2>>{{height + 1, height + 2}});
        EXPECT_TRUE(none[0].is_empty());
    }
}

TEST(Blanks, AreAsLargeAsTheirLayerWithItsMargin) {
    Context context;
    const Mesh mesh = stepped(context, 18, 40);
    Plan plan;
    plan.stock_min = {-25.4, -25.4};
    plan.stock_max = {125.4, 105.4};
    for (const auto& [low, high] : {std::pair{0.0, 18.0}, {18.0, 36.0}, {36.0, 40.0}}) {
        Layer& layer = plan.layers.emplace_back();
        layer.z_bottom = low, layer.z_top = high;
    }
    saw_blanks(context, mesh.view(), plan);
    for (const Layer& layer : plan.layers) EXPECT_FALSE(layer.blank) << "by default all are alike";
    plan.job.slabs.blanks = Blanks::layer;
    saw_blanks(context, mesh.view(), plan);
    EXPECT_EQ(slab_of(plan, plan.layers[0]), (Blank{plan.stock_min, plan.stock_max}))
        << "the foot takes the whole stock, rounded to no more";
    for (const std::size_t l : {std::size_t{1}, std::size_t{2}}) {
        const Blank& blank = plan.layers[l].blank.value();
        EXPECT_DOUBLE_EQ(blank.length(), 81) << "30 and two margins of 25.4, up to a whole millimetre";
        EXPECT_DOUBLE_EQ(blank.width(), 71);
        EXPECT_LE(blank.min[0], 60 - 25.4 + 1e-9);
        EXPECT_GE(blank.max[0], 90 + 25.4 - 1e-9);
        EXPECT_LE(blank.max[0], plan.stock_max[0]);
        EXPECT_GE(blank.min[1], plan.stock_min[1]);
    }
    plan.job.flask.enabled = true;
    saw_blanks(context, mesh.view(), plan);
    EXPECT_FALSE(plan.layers[1].blank) << "a flask is of every slab's whole size";
}

TEST(Blanks, APlanOfSmallSlabsIsProvenFromItsText) {
    const TemporaryFolder folder;
    Context context;
    const std::string stl = folder / "stepped.stl", out = folder / "out", whole = folder / "whole";
    write_stl(stl, stepped(context, 17, 50));
    Job small_slabs = by_layer();
    small_slabs.slabs.layout = BoardLayout::nested;
    const Plan small = plan(context, stl, small_slabs);
    // Fine enough that whole tiles of the stock lie beside the upper slabs.
    ASSERT_TRUE(write_verified(context, small, out, stl, 0.25).passed);
    const Plan large = plan(context, stl, Job{});
    ASSERT_TRUE(write_verified(context, large, whole, stl, 1).passed);
    EXPECT_LT(small.totals.stock_volume_mm3, 0.75 * large.totals.stock_volume_mm3);
    EXPECT_LT(small.totals.cutting_minutes, large.totals.cutting_minutes) << "less is milled away";
    EXPECT_LT(small.totals.stack_mass_kg, large.totals.stack_mass_kg);
    const json document = json::parse(slurp(out + "/plan.json"));
    EXPECT_LT(document["wood"]["sawn_m2"], document["wood"]["uniform"]["sawn_m2"]);
    EXPECT_EQ(document["wood"]["uniform"]["sawn_m2"],
              json::parse(slurp(whole + "/plan.json"))["wood"]["sawn_m2"]);
    EXPECT_TRUE(document["cost"].is_null());
    EXPECT_EQ(document["job"]["slabs"]["layout"], "nested");
    EXPECT_NE(slurp(out + "/cut_list.csv").find("\nnest,1,"), std::string::npos);
    EXPECT_NE(slurp(whole + "/cut_list.csv").find("\nboard,1,"), std::string::npos);
    // No feed goes past its slab by more than the face mill reaches.
    for (const Layer& layer : small.layers) {
        const Blank blank = slab_of(small, layer);
        for (const Operation& op : layer.operations)
            for (const Move& m : op.moves)
                if (m.feed > 0)
                    for (std::size_t k = 0; k < 2; ++k) {
                        const double at = to_mm(k == 0 ? m.x : m.y);
                        EXPECT_GT(at, blank.min[k] - 60);
                        EXPECT_LT(at, blank.max[k] + 60);
                    }
    }
    const Quote quoted = quote_model(context, stl, by_layer()).quote;
    EXPECT_NEAR(quoted.boards.sawn_m2(), document["wood"]["sawn_m2"].get<double>(), 1e-3);

    // What a plan or a sequence says of a slab is held against the pattern, and against each other.
    ASSERT_EQ(found(out, stl), "");
    const std::string plan_text = slurp(out + "/plan.json"), steps_text = slurp(out + "/sequence.json");
    const std::size_t upper = document["layers"].size() - 1;
    const auto with_plan = [&](auto&& change) {
        json changed = json::parse(plan_text);
        change(changed["layers"][upper]["blank"]);
        spit(out + "/plan.json", changed.dump());
        const std::string codes = found(out, stl);
        spit(out + "/plan.json", plan_text);
        return codes;
    };
    const std::string shifted = with_plan([](json& blank) {
        for (const char* end : {"min", "max"}) blank[end][0] = blank[end][0].get<double>() - 40;
    });
    EXPECT_NE(shifted.find("stack.blank"), std::string::npos) << shifted;
    EXPECT_NE(shifted.find("gouge.stock"), std::string::npos)
        << "the stock shows what is missing: " << shifted;
    EXPECT_NE(shifted.find("sequence.place"), std::string::npos) << shifted;
    const std::string narrow = with_plan([](json& blank) { blank["max"][1] = 25; });
    EXPECT_NE(narrow.find("stack.blank"), std::string::npos) << narrow;
    EXPECT_NE(narrow.find("sequence.glue"), std::string::npos) << "glue reaches past the slab: " << narrow;
    EXPECT_NE(narrow.find("sequence.slab"), std::string::npos) << narrow;
    EXPECT_THROW((void)with_plan([](json& blank) { blank["max"][0] = 400; }), Error) << "past the stock";
    spit(out + "/plan.json", plan_text);
    // A slab sawn or laid otherwise than planned.
    json steps = json::parse(steps_text);
    for (json& step : steps["steps"])
        if (step["action"] == "take_slab" && step["layer"] == static_cast<int>(upper) + 1)
            step["length_mm"] = step["length_mm"].get<double>() - 10;
    spit(out + "/sequence.json", steps.dump());
    EXPECT_EQ(found(out, stl), "sequence.slab");
}

TEST(Blanks, MillingThroughALargerSlabMakesTheSamePart) {
    // The curved top of a half sphere: each layer is smaller than the one below.
    const TemporaryFolder folder;
    Context context;
    const std::string stl = folder / "half-sphere.stl";
    write_stl(stl, weld(context, half_sphere()));
    const Plan planned = plan(context, stl, by_layer());
    EXPECT_TRUE(write_verified(context, planned, folder / "out", stl, 1).passed);
    for (std::size_t l = 1; l < planned.layers.size(); ++l)
        EXPECT_LE(slab_of(planned, planned.layers[l]).mm2(), slab_of(planned, planned.layers[l - 1]).mm2());
    EXPECT_LT(slab_of(planned, planned.layers.back()).mm2(), slab_of(planned, planned.layers[0]).mm2());
}
