// A solid cut into halves: put together again it is the solid, dowels fit, and each half can be built.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "io/read/pattern_mesh.h"
#include "io/slabwright.h"
#include "io/split.h"
#include "io/write/stl_writer.h"
#include "kernels/access/closest_point.h"
#include "kernels/halves/halves.h"
#include "kernels/mesh/weld.h"
#include "kernels/repair/repair.h"
#include "tests/mesh_shapes.h"
#include "tests/support/command.h"
#include "tests/support/places.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using support::TemporaryFolder;

/// The place in the solid's frame of a point of a half: its map turns and shifts, and may mirror.
Point3 back(const AffineMap& map, const Point3& p) {
    Point3 q{};
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t r = 0; r < 3; ++r) q[c] += map.rows[r][c] * (p[r] - map.rows[r][3]);
    return q;
}

support::CommandResult run_line(const std::string& line) {
    std::vector<std::string> arguments{support::built_command()};
    std::istringstream words(line);
    for (std::string word; words >> word;) arguments.push_back(word);
    return support::run_command(arguments);
}

/// Random points are inside the solid exactly if they are inside one half, and the solid's surface is the
/// halves' surface but for the cut. @returns the greatest distance found
double expect_together(const Mesh& solid, const Halves& halves, const CutPlane& plane, std::mt19937& random) {
    Context context({.threads = 2});
    const ClosestPoint whole(context, solid.view()), above(context, halves.above.mesh.view()),
        below(context, halves.below.mesh.view());
    const Box3 box = bounds(solid.view());
    const auto any = [&](float low, float high) {
        return std::uniform_real_distribution<double>(low - 1, high + 1)(random);
    };
    const double size = length(plane.normal);
    for (int i = 0; i < 4000; ++i) {
        const Point3 p{any(box.min.x, box.max.x), any(box.min.y, box.max.y), any(box.min.z, box.max.z)};
        const double height = dot(plane.normal, p) / size - plane.offset_mm;
        bool in_dowel = false;
        for (const Dowel& d : halves.dowels)
            in_dowel = in_dowel || length(minus(p, d.at)) < d.depth_mm + d.diameter_mm;
        if (in_dowel || std::abs(height) < 1e-3 || whole.query_unsigned(p, 0.01).distance < 0.005) continue;
        const ClosestPoint& mine = height > 0 ? above : below;
        const ClosestPoint& other = height > 0 ? below : above;
        const Half& my_half = height > 0 ? halves.above : halves.below;
        const Half& other_half = height > 0 ? halves.below : halves.above;
        EXPECT_EQ(mine.winding(my_half.map.of(p)) != 0, whole.winding(p) != 0);
        EXPECT_EQ(other.winding(other_half.map.of(p)), 0);
    }
    double most = 0;
    for (const Half* half : {&halves.above, &halves.below})
        for (const Vec3f& v : half->mesh.vertices) {
            if (v.z == 0) continue;  // of the cut
            const Point3 p = back(half->map, to_double(v));
            bool of_dowel = false;
            for (const Dowel& d : halves.dowels)
                of_dowel = of_dowel || length(minus(p, d.at)) < d.depth_mm + d.diameter_mm;
            if (!of_dowel) most = std::max(most, whole.query_unsigned(p, 10).distance);
        }
    for (const Vec3f& v : solid.vertices) {
        const Point3 p = to_double(v);
        const double height = dot(plane.normal, p) / size - plane.offset_mm;
        const Half& half = height > 0 ? halves.above : halves.below;
        most = std::max(most, (height > 0 ? above : below).query_unsigned(half.map.of(p), 10).distance);
    }
    return most;
}

double volume(const Halves& halves) {
    double drilled = 0;
    for (const Dowel& d : halves.dowels)
        drilled += 2 * 3.14159265 * std::pow((d.diameter_mm + 0.1) / 2, 2) * d.depth_mm;
    return halves.above.report.volume_mm3 + halves.below.report.volume_mm3 + drilled;
}

TEST(Split, MakesTwoBoxesOfOneWithDowelsBetween) {
    Context context({.threads = 1});
    const Mesh block = weld(context, shapes::box({0, 0, 0}, {100, 60, 80}));
    const MeshReport report = report_mesh(context, block.view());
    const Halves halves = split_solid(context, block.view(), report, {.offset_mm = 30});
    EXPECT_EQ(halves.above.report.box.max.z, 50);
    EXPECT_EQ(halves.below.report.box.max.z, 30);
    EXPECT_NEAR(halves.cut_mm2, 6000, 1e-6);
    ASSERT_EQ(halves.dowels.size(), 2U);
    EXPECT_NEAR(volume(halves), 100 * 60 * 80, 10);
    // A dowel of the stated diameter passes, in both halves, as deep as stated, and 4 mm of wood are around.
    const ClosestPoint whole(context, block.view());
    for (const Half* half : {&halves.above, &halves.below}) {
        const ClosestPoint closest(context, half->mesh.view());
        for (const Dowel& d : halves.dowels) {
            const Point3 rim = half->map.of(d.at);
            EXPECT_NEAR(rim[2], 0, 1e-9);
            const double radius = d.diameter_mm / 2;
            const Point3 middle{rim[0], rim[1], d.depth_mm / 2};
            EXPECT_EQ(closest.winding(middle), 0);
            EXPECT_GE(closest.query_unsigned(middle, 100).distance, radius + 0.049);
            EXPECT_LE(closest.query_unsigned(middle, 100).distance, radius + 0.06);
            EXPECT_NE(closest.winding({rim[0], rim[1], d.depth_mm + 0.1}), 0);
        }
    }
    // Two widths: turned about, the halves do not fit.
    EXPECT_NE(halves.dowels[0].diameter_mm, halves.dowels[1].diameter_mm);
    const Halves mirrored = split_solid(context, block.view(), report, {.offset_mm = 30}, {}, true);
    EXPECT_LT(mirrored.below.map.determinant(), 0);
    EXPECT_TRUE(is_solid(mirrored.below.report));
    EXPECT_GT(mirrored.below.report.volume_mm3, 0);
}

TEST(Split, IsTheSolidAgainByAnyPlane) {
    Context context({.threads = 2});
    std::mt19937 random(test::seed());
    std::normal_distribution<double> any;
    const Mesh torus = weld(context, shapes::torus(40, 60, 20));
    const MeshReport report = report_mesh(context, torus.view());
    for (int i = 0; i < 12; ++i) {
        // Level and upright planes pass through vertices and along edges.
        CutPlane plane{{any(random), any(random), any(random)}, 5 * any(random)};
        if (i < 3) plane = {{i == 0 ? 1. : 0., i == 1 ? 1. : 0., i == 2 ? 1. : 0.}, 0};
        const Halves halves = split_solid(context, torus.view(), report, plane, {.diameter_mm = 6});
        EXPECT_NEAR(volume(halves) / report.volume_mm3, 1, 2e-4);
        EXPECT_LE(expect_together(torus, halves, plane, random), 1e-3) << "plane " << i;
    }
}

TEST(Split, RefusesWhatItCannotCut) {
    Context context({.threads = 1});
    const Mesh block = weld(context, shapes::box({0, 0, 0}, {10, 10, 10}));
    const MeshReport report = report_mesh(context, block.view());
    for (const CutPlane& plane : {CutPlane{.offset_mm = 11}, CutPlane{.offset_mm = 10},
                                  CutPlane{.offset_mm = 0}, CutPlane{{0, 0, 0}, 5}}) {
        try {
            (void)split_solid(context, block.view(), report, plane);
            FAIL();
        } catch (const Error& error) {
            EXPECT_EQ(error.code().substr(0, 6), "split.");
        }
    }
    EXPECT_TRUE(split_solid(context, block.view(), report, {.offset_mm = 5}).dowels.empty());
    // Holes of 10.1 mm with 4 mm of wood around them need 18.1.
    const auto dowels = [&](float width) {
        const Mesh bar = weld(context, shapes::box({0, 0, 0}, {100, width, 60}));
        return split_solid(context, bar.view(), report_mesh(context, bar.view()), {.offset_mm = 30})
            .dowels.size();
    };
    EXPECT_EQ(dowels(18), 0u);
    EXPECT_EQ(dowels(18.5F), 2u);
}

TEST(Split, ValveBodyIsItselfAgain) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr) GTEST_SKIP() << "SLABWRIGHT_CORPUS is not set";
    Context context({.threads = 2});
    const PatternMesh valve =
        read_pattern_mesh(context, std::string(corpus) + "/castings/valve_body.stl", {});
    std::mt19937 random(test::seed());
    const double middle = (valve.input.min[0] + valve.input.max[0]) / 2;
    for (const CutPlane& plane : {CutPlane{.offset_mm = 150}, CutPlane{{1, 0, 0}, middle}}) {
        const Halves halves = split_solid(context, valve.mesh.view(), valve.report, plane);
        const double most = expect_together(valve.mesh, halves, plane, random);
        std::printf("valve_body: halves within %.6f mm of the whole, %zu dowels, volume %.6f of it\n", most,
                    halves.dowels.size(), volume(halves) / valve.report.volume_mm3);
        EXPECT_LE(most, 1e-3);
        EXPECT_NEAR(volume(halves) / valve.report.volume_mm3, 1, 1e-4);
    }
}

TEST(Split, EachHalfIsInTheFileOfItsName) {
    Context context({.threads = 1});
    const TemporaryFolder folder;
    const std::string block = folder / "block.stl";
    write_stl(block, weld(context, shapes::box({0, 0, 0}, {100, 60, 80})));
    SplitRequest request;
    request.plane.offset_mm = 30;
    request.out = {folder / "above.stl", folder / "below.3mf"};
    const SplitModel model = split_model(context, PatternSource{block}, Job{}, request);
    EXPECT_EQ(model.height_mm[0], 50);
    EXPECT_EQ(model.height_mm[1], 30);
    for (const std::size_t side : {0U, 1U}) {
        const PatternMesh half = read_pattern_mesh(context, request.out[side], {});
        EXPECT_EQ(half.mesh.facets.size(), model.facets[side]);
        EXPECT_EQ(half.report.box.max.z - half.report.box.min.z, model.height_mm[side]);
        EXPECT_NEAR(half.report.volume_mm3, model.volume_mm3[side], 1);
    }
}

/// The command's halves of a ring that cannot be built as one pattern: each plans, and the programs make it.
TEST(SplitCommand, HalvesPlanAndVerify) {
    TemporaryFolder folder;
    shapes::Facets ball = shapes::torus(40, 45, 20);
    {
        Context context({.threads = 1});
        write_stl(folder / "ring.stl", weld(context, ball));
    }
    const std::string ring = folder / "ring.stl", a = folder / "a.stl", b = folder / "b.3mf";
    EXPECT_EQ(run_line("plan " + ring + " -o " + (folder / "whole")).exit, 4);
    const auto split = run_line("split " + ring + " --z 20 --dowel-depth 8 -o " + a + " " + b + " --json");
    ASSERT_EQ(split.exit, 0) << split.err;
    const auto told = nlohmann::json::parse(split.out);
    EXPECT_EQ(told.at("schema"), "slabwright.split/1");
    EXPECT_EQ(told.at("dowels").size(), 2U);
    for (const std::string& half : {a, b}) {
        const auto planned = run_line("plan " + half + " -o " + (folder / "plan") + " --accept-weak-joints");
        EXPECT_EQ(planned.exit, 0) << planned.out << planned.err;
    }
    EXPECT_EQ(run_line("split " + ring + " -o " + a + " " + b).exit, 2);
    EXPECT_EQ(run_line("split " + ring + " --z 14 -o " + a + " " + a).exit, 2);
    EXPECT_EQ(run_line("split " + ring + " --z 99 -o " + a + " " + b).exit, 3);
}

/// The lines of a refusal's help that are commands, in order.
std::vector<std::string> commands_in(const std::string& text) {
    std::vector<std::string> commands;
    std::istringstream lines(text);
    const std::string before = "  slabwright ";
    for (std::string line; std::getline(lines, line);)
        if (line.starts_with(before)) commands.push_back(line.substr(before.size()));
    return commands;
}

/// What is refused for its undercuts names the command that builds it; that very command is run.
TEST(PlanCommand, NamesTheCommandsThatBuildWhatItRefuses) {
    TemporaryFolder folder;
    const auto save = [&](const char* name, const shapes::Facets& facets) {
        Context context({.threads = 1});
        write_stl(folder / name, weld(context, facets));
        return std::string(folder / name);
    };
    // A ring.
    const std::string ring = save("ring.stl", shapes::torus(40, 45, 20));
    const auto refused = run_line("plan " + ring + " -o " + (folder / "ring"));
    EXPECT_EQ(refused.exit, 4);
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
    const std::vector<std::string> ways = commands_in(refused.out);
    ASSERT_FALSE(ways.empty()) << refused.out;
    EXPECT_EQ(ways[0].substr(0, 6), "split ") << refused.out;
    ASSERT_NE(refused.out.find("leaves nothing unmade"), std::string::npos) << refused.out;
    EXPECT_EQ(run_line(ways[0] + " --dowel 0").exit, 0);
    for (const char* half : {"ring-above.stl", "ring-below.stl"}) {
        const auto planned = run_line("plan " + (folder / half) + " -o " + (folder / "half"));
        EXPECT_EQ(planned.exit, 0) << planned.out << planned.err;
    }
    // A pyramid that stands on its top.
    const shapes::Facets pyramid{
        {{{-10, -10, 0}, {-10, 10, 0}, {10, 10, 0}}},    {{{-10, -10, 0}, {10, 10, 0}, {10, -10, 0}}},
        {{{-40, -40, 40}, {40, -40, 40}, {40, 40, 40}}}, {{{-40, -40, 40}, {40, 40, 40}, {-40, 40, 40}}},
        {{{-10, -10, 0}, {10, -10, 0}, {40, -40, 40}}},  {{{-10, -10, 0}, {40, -40, 40}, {-40, -40, 40}}},
        {{{10, -10, 0}, {10, 10, 0}, {40, 40, 40}}},     {{{10, -10, 0}, {40, 40, 40}, {40, -40, 40}}},
        {{{10, 10, 0}, {-10, 10, 0}, {-40, 40, 40}}},    {{{10, 10, 0}, {-40, 40, 40}, {40, 40, 40}}},
        {{{-10, 10, 0}, {-10, -10, 0}, {-40, -40, 40}}}, {{{-10, 10, 0}, {-40, -40, 40}, {-40, 40, 40}}}};
    const auto over = run_line("plan " + save("pyramid.stl", pyramid) + " -o " + (folder / "pyramid"));
    EXPECT_EQ(over.exit, 4);
    const std::vector<std::string> turns = commands_in(over.out);
    ASSERT_FALSE(turns.empty()) << over.out;
    EXPECT_NE(turns[0].find("--turn 180,0,0"), std::string::npos) << over.out;
    const auto planned = run_line(turns[0]);
    EXPECT_EQ(planned.exit, 0) << planned.out << planned.err;
}

}  // namespace
}  // namespace slabwright
