// What holds sheets while they are bonded, what it costs, and what they are laid into.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/fixture.h"
#include "engine/sheets/sheet_cost.h"
#include "engine/sheets/sheet_plan.h"
#include "io/posts/sheet_reader.h"
#include "kernels/errors.h"
#include "kernels/polygons/border_distance.h"
#include "kernels/slicing/slicing.h"
#include "tests/support/loft.h"
#include "tests/support/rs274.h"
#include "tests/support/seed.h"
#include "tests/support/sheet_proofs.h"

namespace slabwright {
namespace {

using support::proof_of;
using support::texts_of;
using support::told;

using support::circle;
using support::loft;
using support::Ring;

SheetJob job_of(SheetHead head, SheetAlignment way) {
    SheetJob job;
    job.slicing.thicknesses = {6, 12};
    job.head = head;
    job.stock = {600, 600};
    job.nesting.spacing = 4;
    job.cutting.kerf = head == SheetHead::router ? 5 : 0.8;
    if (head == SheetHead::jet) job.cutting.most_tilt_deg = 50;
    job.alignment.way = way;
    return job;
}

bool has(const SheetProof& proof, const char* code) {
    for (const Diagnostic& d : proof.violations)
        if (d.code == code) return true;
    return false;
}

/// Several solids in one.
Mesh together(Context& context, const std::vector<std::vector<Ring>>& solids) {
    std::vector<std::array<Vec3f, 3>> facets;
    for (const std::vector<Ring>& rings : solids) {
        const auto own = support::loft_facets(rings);
        facets.insert(facets.end(), own.begin(), own.end());
    }
    return weld(context, facets);
}

Ring box(double z, double x0, double y0, double x1, double y1) {
    return {z, {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}};
}

/// A part of revolution that narrows upwards by a slope.
Mesh bell(Context& context) {
    return loft(context, {circle(0, 50, 64), circle(18, 44, 64), circle(36, 30, 64)});
}

/// Two legs beside each other and nothing that joins them.
Mesh legs(Context& context) {
    return together(context, {{box(0, 0, 0, 40, 40), box(36, 0, 0, 40, 40)},
                              {box(0, 70, 0, 110, 40), box(36, 70, 0, 110, 40)}});
}

TEST(SheetAlignment, EveryWayHoldsEverySheetByTheProgramsText) {
    Context context;
    const Mesh mesh = bell(context);
    for (const SheetHead head : {SheetHead::router, SheetHead::jet}) {
        double free = 0;
        for (const SheetAlignment way :
             {SheetAlignment::none, SheetAlignment::holes, SheetAlignment::dowels, SheetAlignment::tabs}) {
            const SheetsPlan plan = plan_sheets(context, mesh, job_of(head, way));
            const std::vector<std::string> texts = texts_of(plan);
            const SheetProof proof = proof_of(context, mesh, texts);
            EXPECT_TRUE(proof.passed) << told(proof);
            EXPECT_EQ(proof.islands, 0);
            if (way == SheetAlignment::none) {
                free = proof.made_mm3;
            } else {
                EXPECT_GE(proof.dowels, 2 * static_cast<int>(plan.pieces.size())) << int(way);
            }
            // Dowels fill their holes and tabs are cut off: the same part. Sheets that are cut upright for
            // their tabs' sake hold more.
            EXPECT_GE(proof.made_mm3, free * (1 - 2e-4));
            if (head == SheetHead::router) {
                EXPECT_NEAR(proof.made_mm3, free, 2e-4 * free) << int(way);
            }
            std::printf("  head %d way %d: %d holes, left over %.3f mm\n", int(head), int(way), proof.dowels,
                        proof.left_over);
            if (head != SheetHead::jet || way != SheetAlignment::tabs) continue;
            for (const std::string& text : texts)
                EXPECT_TRUE(support::interpret_rs274(text, "T1 P1 D6 Z0\n").ended);
        }
    }
}

TEST(SheetAlignment, IslandsThatNothingJoinsAreRefusedWithTheirPlaceAndHeldByTabs) {
    Context context;
    const Mesh mesh = legs(context);
    for (const SheetAlignment way : {SheetAlignment::holes, SheetAlignment::dowels}) {
        try {
            (void)plan_sheets(context, mesh, job_of(SheetHead::laser, way));
            ADD_FAILURE() << "two legs that nothing joins";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), "sheets.hold");
            EXPECT_NE(error.place().find("x 90.0 y 20.0 z 0 to 12"), std::string::npos) << error.what();
        }
    }
    const SheetsPlan plan = plan_sheets(context, mesh, job_of(SheetHead::laser, SheetAlignment::tabs));
    const SheetProof proof = proof_of(context, mesh, texts_of(plan));
    EXPECT_TRUE(proof.passed) << told(proof);
    EXPECT_EQ(proof.islands, 0);
    for (const SheetPiece& piece : plan.pieces) {
        EXPECT_GE(piece.hold.holes.size(), 2u);
        for (std::size_t l = 0; l < piece.hold.added.size(); ++l) {
            const auto quad = piece.hold.added.loop(l);
            EXPECT_EQ(quad.size(), 4u);
        }
    }
}

// A pillar within a tube: no neck reaches it, and only the floor joins it.
TEST(SheetAlignment, DowelsHoldWhatNoNeckReaches) {
    Context context;
    const auto ring = [](double z, double r) { return circle(z, r, 48); };
    // The tube's wall as a solid of revolution: outside up, inside down is what loft() cannot; so the tube is
    // a floor, and walls of four boxes that overlap at the corners.
    const Mesh mesh = together(context, {{box(0, -60, -60, 60, 60), box(12, -60, -60, 60, 60)},
                                         {box(12, -60, -60, 60, -44), box(36, -60, -60, 60, -44)},
                                         {box(12, -60, 44, 60, 60), box(36, -60, 44, 60, 60)},
                                         {box(12, -60, -60, -44, 60), box(36, -60, -60, -44, 60)},
                                         {box(12, 44, -60, 60, 60), box(36, 44, -60, 60, 60)},
                                         {ring(12, 25), ring(36, 25)}});
    const SheetsPlan plan = plan_sheets(context, mesh, job_of(SheetHead::laser, SheetAlignment::tabs));
    int inner = 0;
    for (const SheetPiece& piece : plan.pieces)
        for (const Point2 hole : piece.hold.holes) inner += std::hypot(to_mm(hole.x), to_mm(hole.y)) < 25;
    EXPECT_GE(inner, 2 * static_cast<int>(plan.pieces.size() - 1));
    const SheetProof proof = proof_of(context, mesh, texts_of(plan));
    EXPECT_TRUE(proof.passed) << told(proof);
    EXPECT_EQ(proof.islands, 0);
}

TEST(SheetAlignment, ProofFindsWhatDoesNotHold) {
    Context context;
    const Mesh mesh = bell(context);
    const std::vector<std::string> good =
        texts_of(plan_sheets(context, mesh, job_of(SheetHead::laser, SheetAlignment::dowels)));
    const auto with = [&](const std::string& from, const std::string& to) {
        std::vector<std::string> texts = good;
        const std::size_t at = texts[0].find(from);
        EXPECT_NE(at, std::string::npos) << from;
        const std::size_t end = texts[0].find('\n', at);
        texts[0].replace(at, end + 1 - at, to);
        return proof_of(context, mesh, texts);
    };
    // A dowel that the text does not speak of: its hole is a gouge, and the joint has one dowel left.
    const SheetProof missing = with("(dowel of piece 1 ", "");
    EXPECT_TRUE(has(missing, "sheets.hold")) << told(missing);
    EXPECT_TRUE(has(missing, "sheets.gouge")) << told(missing);
    EXPECT_GT(missing.islands, 0);
    // One that lies beside the part.
    const SheetProof beside = with("(dowel of piece 1 ", "(dowel of piece 1 at 49 0 diameter 8)\n");
    EXPECT_TRUE(has(beside, "sheets.hold")) << told(beside);
    // The hole is wider than what is said of it.
    const SheetProof thin =
        with("(dowel of piece 1 ",
             good[0].substr(good[0].find("(dowel of piece 1 "),
                            good[0].find(" diameter 8)") - good[0].find("(dowel of piece 1 ")) +
                 " diameter 7)\n");
    EXPECT_TRUE(has(thin, "sheets.gouge")) << told(thin);
    EXPECT_THROW((void)read_sheet_program("(stock 9 x 9 thickness 6 kerf 1 jet)\n(dowel of piece 1 at 0 0 "
                                          "diameter 8)\n",
                                          "x"),
                 Error);
}

TEST(SheetAlignment, RandomStacksAreHeldOrRefused) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(-1, 1);
    int held = 0, refused = 0;
    for (int round = 0; round < 12; ++round) {
        std::vector<Ring> rings;
        double r = 30, x = 0, y = 0;
        for (int z = 0; z <= 24; z += 6) {
            rings.push_back(circle(z, r, 24, x, y));
            r = std::clamp(r + 9 * unit(random), 9.0, 45.0), x += 5 * unit(random), y += 5 * unit(random);
        }
        const Mesh mesh = loft(context, rings);
        for (const SheetAlignment way : {SheetAlignment::dowels, SheetAlignment::tabs}) {
            try {
                const SheetsPlan plan = plan_sheets(context, mesh, job_of(SheetHead::laser, way));
                const SheetProof proof = proof_of(context, mesh, texts_of(plan));
                EXPECT_TRUE(proof.passed) << round << ' ' << told(proof);
                EXPECT_EQ(proof.islands, 0);
                ++held;
            } catch (const Error& error) {
                EXPECT_EQ(error.code(), "sheets.hold") << error.what();
                EXPECT_NE(way, SheetAlignment::tabs) << "a convex section can be reached from both sides";
                ++refused;
            }
        }
    }
    std::printf("  %d held, %d refused\n", held, refused);
    EXPECT_GE(held, 12);
}

TEST(SheetFixture, NestAndCrateSpareThePartAndFitTogether) {
    Context context;
    const Mesh mesh = bell(context);
    const SheetsPlan plan = plan_sheets(context, mesh, job_of(SheetHead::laser, SheetAlignment::none));
    std::vector<Loops> outlines;
    for (const SheetStair& stair : stairs_of(context, mesh.view(), plan.stack.sheets, StairSide::outside))
        outlines.push_back(stair.outline);
    const FixtureRules rules;
    const std::vector<FixturePiece> nest = full_nest(plan.stack.sheets, outlines, rules);
    ASSERT_EQ(nest.size(), outlines.size());
    for (std::size_t i = 0; i < nest.size(); ++i) {
        EXPECT_TRUE(intersect(nest[i].region, outlines[i]).empty());
        // Nowhere more than the clearance away.
        EXPECT_NEAR(area(nest[i].region) + area(outlines[i]), 160 * 160, 2 * 3.1416 * 50 * 0.25);
    }
    const std::vector<FixturePiece> crate = egg_crate(context, mesh, rules);
    ASSERT_EQ(crate.size(), 6u);
    // Points of the block at random: no slice holds a point of the part, and no two slices hold the same.
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    int in_slices = 0;
    for (int k = 0; k < 20000; ++k) {
        const double z = -rules.floor + unit(random) * (36 + rules.floor);
        const std::size_t i = random() % 3, j = 3 + random() % 3;
        const double x = crate[i].at + (unit(random) - 0.5) * rules.thickness;
        const double y = crate[j].at + (unit(random) - 0.5) * rules.thickness;
        const bool of_x = winding(crate[i].region, {to_units(y), to_units(z)}) > 0;
        const bool of_y = winding(crate[j].region, {to_units(x), to_units(z)}) > 0;
        EXPECT_FALSE(of_x && of_y) << x << ' ' << y << ' ' << z;
        in_slices += of_x || of_y;
        const double r = z < 0 ? 0 : z < 18 ? 50 - z / 3 : 44 - (z - 18) * 14 / 18;
        const double y2 = -80 + 160 * unit(random);
        if (z > 0 && std::hypot(x, y2) < r * std::cos(3.1416 / 64) - 0.01) {
            EXPECT_LE(winding(crate[i].region, {to_units(y2), to_units(z)}), 0) << x << ' ' << y2 << ' ' << z;
        }
    }
    EXPECT_GT(in_slices, 2000);
    FixtureRules wrong;
    wrong.slices_x = 0;
    EXPECT_THROW((void)egg_crate(context, mesh, wrong), Error);
}

TEST(SheetCost, WaysStandSideBySide) {
    Context context;
    const Mesh mesh = bell(context);
    const SheetJob job = job_of(SheetHead::jet, SheetAlignment::none);
    const SheetsPlan plan = plan_sheets(context, mesh, job);
    const double density = sheet_material("steel")->density_kg_m3;
    const std::vector<SheetCost> costs = compare_costs(context, mesh, plan, density, {1000, 60});
    ASSERT_EQ(costs.size(), 3u);
    EXPECT_EQ(costs[0].way, "uniform");
    EXPECT_EQ(costs[0].sheets, 6u);
    EXPECT_EQ(costs[1].way, "adaptive");
    EXPECT_LE(costs[1].sheets, costs[0].sheets);
    EXPECT_EQ(costs[2].way, "curved");
    EXPECT_EQ(costs[2].sheets, plan.pieces.size());
    EXPECT_LT(costs[2].deviation, 0.1 * costs[1].deviation) << "a cone is cut as it is";
    for (const SheetCost& cost : costs) {
        // Part and stock weigh what their volumes weigh; money is stock and time.
        EXPECT_GT(cost.part_kg, 36 * 3.1416 * 40 * 40 * 7850e-9);
        EXPECT_LT(cost.part_kg, 36 * 3.1416 * 50 * 50 * 7850e-9);
        EXPECT_NEAR(cost.money, cost.stock_kg / 7850 * 1000 + cost.minutes, 1e-9);
    }
    // What upright sheets weigh is the closed form: 6 mm at their widest.
    double area = 0;
    for (const double r : {50.0, 48.0, 46.0, 44.0, 44 - 14 / 3.0, 44 - 28 / 3.0})
        area += 32 * r * r * std::sin(2 * 3.141592653589793 / 64);
    EXPECT_NEAR(costs[0].part_kg, area * 6 * 7850e-9, 1e-4 * costs[0].part_kg);
    // A sheet of 1000 mm³ at 8000 kg/m³ is 8 g, and no more; nothing weighs nothing.
    SheetsPlan small;
    EXPECT_EQ(cost_of(small, "none", 8000, {}).part_kg, 0);
    small.pieces.emplace_back();
    small.pieces[0].area_mm2 = 500;
    small.pieces[0].span = {0, 2, 0};
    EXPECT_NEAR(cost_of(small, "small", 8000, {}).part_kg, 0.008, 1e-12);
    EXPECT_EQ(cost_of(small, "small", 8000, {}).stock_kg, 0);
    EXPECT_EQ(sheet_material("cheese"), nullptr);
    EXPECT_NEAR(sheet_bond("braze")->strength_mpa, 32.04, 0.01);
}

TEST(SheetCost, OffcutsOfAThicknessAreUsedAndWhatIsLeftIsTold) {
    Context context;
    const Mesh mesh = bell(context);
    SheetJob job = job_of(SheetHead::laser, SheetAlignment::none);
    job.offcuts = {{6, {130, 130}}};
    const SheetsPlan plan = plan_sheets(context, mesh, job);
    bool used = false;
    for (std::size_t i = 0; i < plan.programs.size(); ++i) {
        used = used || plan.programs[i].stock.length == 130;
        const StockSheet left = offcut_of(plan, i);
        if (left.length == 0) continue;
        for (const SheetWay& way : plan.programs[i].ways)
            for (const HeadPoint& p : way.points) {
                const StockSheet& stock = plan.programs[i].stock;
                EXPECT_TRUE(to_mm(p.top.x) < stock.length - left.length ||
                            to_mm(p.top.y) < stock.width - left.width);
            }
    }
    EXPECT_TRUE(used);
    job.offcuts = {{7, {130, 130}}};
    EXPECT_THROW((void)plan_sheets(context, mesh, job), Error);
}

}  // namespace
}  // namespace slabwright
