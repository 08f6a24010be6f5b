// Draft, undercuts to the draw, thin walls and inner corners of solids whose figures are known.
#include "kernels/features/draw.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "io/write/draw_json.h"
#include "io/write/draw_ply.h"
#include "io/write/report_draw.h"
#include "kernels/access/wall_thickness.h"
#include "kernels/errors.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using shapes::Facets;

Mesh solid(const Facets& facets) {
    Context context({.threads = 1});
    Mesh mesh = weld(context, facets);
    mesh.roles = facet_roles(context, mesh.view());
    return mesh;
}

DrawReport checked(const Facets& facets, const DrawLimits& limits = {}) {
    Context context;
    const Mesh mesh = solid(facets);
    return check_draw(context, mesh.view(), limits);
}

void quad(Facets& t, Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
    t.push_back({a, b, c});
    t.push_back({a, c, d});
}

/// A block of 60 x 40 mm at its foot and 30 mm high, whose walls lean back.
Facets leaning(double degrees) {
    const auto in = static_cast<float>(30 * std::tan(degrees * std::numbers::pi / 180));
    const auto foot = [](int i) { return Vec3f{i % 3 == 0 ? 0.0F : 60.0F, i < 2 ? 0.0F : 40.0F, 0}; };
    const auto top = [&](int i) { return Vec3f{i % 3 == 0 ? in : 60 - in, i < 2 ? in : 40 - in, 30}; };
    Facets t;
    quad(t, foot(0), foot(3), foot(2), foot(1));
    quad(t, top(0), top(1), top(2), top(3));
    for (int i = 0; i < 4; ++i) quad(t, foot(i), foot((i + 1) % 4), top((i + 1) % 4), top(i));
    return t;
}

TEST(Draw, WallsWithLittleDraftAreToldByArea) {
    const double walls = (60 + 40) * 2 * 30.0;
    const DrawReport upright = checked(shapes::box({0, 0, 0}, {60, 40, 30}));
    ASSERT_EQ(upright.little_draft.size(), 1U);
    EXPECT_NEAR(upright.little_draft_mm2, walls, 1e-3);
    EXPECT_EQ(upright.little_draft[0].worst, 0);
    EXPECT_TRUE(upright.undercuts.empty()) << "it lies on the board";
    const DrawReport half = checked(leaning(0.5));
    EXPECT_NEAR(half.little_draft_mm2, walls, 0.02 * walls);
    EXPECT_NEAR(half.little_draft.at(0).worst, 0.5, 1e-3);
    EXPECT_NEAR(half.little_draft[0].at[2], 15, 6);
    EXPECT_TRUE(checked(leaning(0.5), {.draft_deg = 0.5}).little_draft.empty())
        << "just as much as asked for";
    EXPECT_TRUE(checked(leaning(2)).little_draft.empty());
    EXPECT_FALSE(checked(leaning(2), {.draft_deg = 2.1}).little_draft.empty());
    EXPECT_TRUE(checked(shapes::box({0, 0, 0}, {60, 40, 30}), {.draft_deg = 0}).little_draft.empty());
}

TEST(Draw, WhatFacesDownOffTheBoardIsUndercut) {
    Facets mushroom = shapes::box({20, 20, 0}, {40, 40, 30});
    shapes::append(mushroom, shapes::box({0, 0, 29}, {60, 60, 40}));
    const DrawReport flat = checked(mushroom);
    ASSERT_EQ(flat.undercuts.size(), 1U);
    EXPECT_NEAR(flat.undercuts[0].worst, -90, 1e-6);
    EXPECT_NEAR(flat.undercuts[0].at[2], 29, 1e-6);
    EXPECT_NEAR(flat.undercut_mm2, 60 * 60, 1e-3) << "with what stands in the stem: no facet is cut";
    const DrawReport in = checked(leaning(-3));
    EXPECT_NEAR(in.undercut_mm2, 200 * 30, 400);
    EXPECT_NEAR(in.undercuts.at(0).worst, -3, 1e-3);
    EXPECT_TRUE(in.little_draft.empty());
}

TEST(Draw, ThinWallsAreToldByBothSides) {
    // A plate on edge, on a foot.
    Facets wall = shapes::box({0, 0, 0}, {60, 40, 10});
    shapes::append(wall, shapes::box({10, 19, 9}, {50, 22, 40}));
    const DrawReport thin = checked(wall);
    EXPECT_NEAR(thin.thin_mm2, 2 * 40 * 30, 120);
    ASSERT_EQ(thin.thin.size(), 2U);
    EXPECT_NEAR(thin.thin[0].worst, 3, 1e-4);
    EXPECT_GT(thin.thin[0].at[2], 9);
    EXPECT_TRUE(checked(wall, {.thin_mm = 2.9}).thin.empty());
    EXPECT_TRUE(checked(wall, {.thin_mm = 0}).thin.empty()) << "not looked for";
    // Bodies that overlap are one: their inner faces end no wall.
    Facets stacked = shapes::box({0, 0, 0}, {60, 40, 3});
    shapes::append(stacked, shapes::box({0, 0, 2}, {60, 40, 6}));
    EXPECT_TRUE(checked(stacked, {.thin_mm = 5}).thin.empty());
    EXPECT_NEAR(checked(stacked, {.thin_mm = 7}).thin_mm2, 2 * 60 * 40, 60);
}

// Boxes turned anyhow: their two largest faces are as far apart as the box is thick, all others farther.
TEST(Draw, ThicknessOfTurnedBoxes) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < 20; ++round) {
        const double a = 6.28 * unit(random), b = 3 * unit(random) - 1.5, c = 6.28 * unit(random),
                     thick = 1 + 4 * unit(random), w = 8 + 20 * unit(random), d = 8 + 20 * unit(random);
        const auto turned = [&](const Vec3f& v) {
            double x = v.x * w, y = v.y * d, z = v.z * thick;
            const auto turn = [](double& p, double& q, double angle) {
                const double u = p * std::cos(angle) - q * std::sin(angle);
                q = p * std::sin(angle) + q * std::cos(angle);
                p = u;
            };
            turn(x, y, a), turn(y, z, b), turn(z, x, c);
            return Vec3f{static_cast<float>(x + 50), static_cast<float>(y - 20), static_cast<float>(z)};
        };
        Facets box = shapes::box({0, 0, 0}, {1, 1, 1});
        for (auto& facet : box)
            for (Vec3f& v : facet) v = turned(v);
        Context context;
        const Mesh mesh = weld(context, box);
        double area = 0;
        for (const ThinFacet& f : thin_facets(context, mesh.view(), thick + 0.5, 1)) {
            EXPECT_NEAR(f.thickness_mm, thick, 1e-3);
            EXPECT_EQ(f.share, 1);
            area += w * d / 2;
        }
        EXPECT_NEAR(area, 2 * w * d, 1e-6) << "round " << round;
        EXPECT_TRUE(thin_facets(context, mesh.view(), thick - 0.01, 1).empty());
    }
}

TEST(Draw, InnerCornersAreToldByLength) {
    // A step: its inner edge is 40 mm long.
    const std::vector<std::array<float, 2>> outline{{0, 0}, {60, 0}, {60, 10}, {20, 10}, {20, 30}, {0, 30}};
    Facets step;
    const auto at = [&](std::size_t i, float y) { return Vec3f{outline[i % 6][0], y, outline[i % 6][1]}; };
    for (std::size_t i = 0; i < 6; ++i) quad(step, at(i, 0), at(i, 40), at(i + 1, 40), at(i + 1, 0));
    for (const auto& [p, q, r, s] : {std::array<std::size_t, 4>{0, 1, 2, 3}, {0, 3, 4, 5}}) {
        quad(step, at(p, 0), at(q, 0), at(r, 0), at(s, 0));
        quad(step, at(s, 40), at(r, 40), at(q, 40), at(p, 40));
    }
    const DrawReport report = checked(step);
    ASSERT_EQ(report.corners.size(), 1U);
    EXPECT_NEAR(report.corners_mm, 40, 1e-4);
    EXPECT_NEAR(report.corners[0].angle_deg, 90, 1e-3);
    EXPECT_NEAR(report.corners[0].at[0], 20, 1e-4);
    EXPECT_NEAR(report.corners[0].at[1], 20, 1e-4);
    EXPECT_NEAR(report.corners[0].at[2], 10, 1e-4);
    const std::string told = draw_text(report);
    EXPECT_EQ(told.substr(told.find("  sharp")),
              "  sharp inner corners: 40 mm in 1 place\n"
              "                40.0 mm, 90.0 deg at x 20.0 y 20.0 z 10.0\n");
    EXPECT_TRUE(checked(step, {.corner_deg = 91}).corners.empty());
    EXPECT_TRUE(checked(shapes::box({0, 0, 0}, {60, 40, 30})).corners.empty()) << "its edges are outer ones";
    EXPECT_TRUE(checked(shapes::torus(60, 40, 10)).corners.empty()) << "round enough";
}

TEST(Draw, APictureOfFewerFacetsHasItsCodes) {
    // A plate of 3 mm on edge under a roof: upright, thin and undercut facets.
    Facets facets = shapes::box({0, 0, 0}, {60, 40, 10});
    shapes::append(facets, shapes::box({10, 19, 9}, {50, 22, 40}));
    shapes::append(facets, shapes::box({0, 0, 39}, {60, 40, 50}));
    Context context;
    const Mesh mesh = solid(facets);
    const DrawReport report = check_draw(context, mesh.view());
    // Facets in the middle of a side of the foot, of its top, of the plate and of the roof's underside.
    const auto at = [](float x, float y, float z) { return Vec3f{x, y, z}; };
    const Mesh picture = solid({{at(20, 0, 3), at(40, 0, 3), at(30, 0, 8)},
                                {at(2, 2, 50), at(8, 2, 50), at(5, 8, 50)},
                                {at(20, 19, 20), at(40, 19, 20), at(30, 19, 30)},
                                {at(2, 2, 39), at(5, 8, 39), at(8, 2, 39)}});
    EXPECT_EQ(draw_codes(context, mesh.view(), report, picture.view()), std::string({1, 0, 3, 2}));
}

TEST(Draw, AMapPaintsWhatIsFoundOfEachFacet) {
    const Mesh mesh = solid(shapes::box({0, 0, 0}, {10, 10, 10}));
    DrawReport report;
    report.draft_deg.assign(mesh.facets.size(), 90);
    report.finding.assign(mesh.facets.size(), DrawFinding::none);
    report.thickness_mm.assign(mesh.facets.size(), 0);
    report.thickness_mm[1] = 0.2F;  // thin as foil
    report.thickness_mm[2] = 3;
    report.finding[2] = report.finding[3] = DrawFinding::little_draft;
    report.thickness_mm[4] = 0.2F;
    report.finding[4] = DrawFinding::undercut;
    const std::string map = draw_ply(mesh.view(), report, "a box");
    constexpr std::size_t bytes = 1 + 3 * 4 + 2 * 4 + 3;  // of a face
    std::string painted;
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
        const std::size_t end = map.size() - (mesh.facets.size() - 1 - f) * bytes;
        const auto part = [&](std::size_t k) { return static_cast<unsigned char>(map[end - 3 + k]); };
        if (part(0) == part(1) && part(1) == part(2)) painted += 'g';            // grey
        else if (part(2) > part(0) && part(2) > part(1)) painted += 'b';         // blue
        else painted += part(1) > part(0) / 2 && part(1) > part(2) ? 'y' : 'v';  // yellow, vermilion
    }
    EXPECT_EQ(painted, "gbbyvggggggg");
}

TEST(Draw, AReportPassesOverThinWallsWhereMemoryEnds) {
    const Mesh mesh = solid(shapes::torus(120, 40, 6));
    const std::uint64_t facets = mesh.facets.size();
    Context plenty, little({.memory_bytes = 70 * facets}), none({.memory_bytes = 20 * facets});
    EXPECT_GT(draw_within_memory(plenty, mesh.view()).limits.thin_mm, 0);
    const DrawReport report = draw_within_memory(little, mesh.view());
    EXPECT_EQ(report.limits.thin_mm, 0);
    EXPECT_GT(report.undercut_mm2, 1000);
    EXPECT_EQ(draw_codes(little, mesh.view(), report, mesh.view()), "");
    EXPECT_EQ(draw_codes(plenty, mesh.view(), report, mesh.view()).size(), facets);
    EXPECT_THROW((void)draw_within_memory(none, mesh.view()), Error);
}

TEST(Draw, LimitsOutOfRangeAreTold) {
    for (const DrawLimits& limits : {DrawLimits{.draft_deg = -1},
                                     {.draft_deg = 46},
                                     {.thin_mm = -1},
                                     {.corner_deg = 0},
                                     {.corner_deg = 180},
                                     {.draft_deg = std::nan("")}})
        EXPECT_THROW((void)checked(shapes::box({0, 0, 0}, {10, 10, 10}), limits), Error);
    Context context;
    EXPECT_EQ(check_draw(context, {}).corners_mm, 0);
}

TEST(Draw, IsTheSameOnAnyNumberOfThreads) {
    const Mesh mesh = solid(shapes::torus(120, 40, 6));
    std::vector<DrawReport> found;
    for (const int threads : {1, 2, 5}) {
        Context context({.threads = threads});
        found.push_back(check_draw(context, mesh.view(), {.thin_mm = 11}));
    }
    for (const DrawReport& report : found) {
        EXPECT_EQ(report.draft_deg, found[0].draft_deg);
        EXPECT_EQ(report.thickness_mm, found[0].thickness_mm);
        EXPECT_EQ(report.thin_mm2, found[0].thin_mm2);
        EXPECT_EQ(report.undercut_mm2, found[0].undercut_mm2);
    }
    EXPECT_GT(found[0].undercut_mm2, 1000);
}

}  // namespace
}  // namespace slabwright
