// Holes that a drill of the library makes: planned, written, proven from the text; and what is left to mills.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <regex>

#include "kernels/access/standing_part.h"
#include "kernels/features/rounded_holes.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"
#include "tests/mesh_shapes.h"
#include "tests/support/closed_mesh.h"
#include "tests/support/command.h"
#include "tests/support/drilled_plate.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::CommandResult;
using support::TemporaryFolder;
using test::LoopAxis;

constexpr double kPi = std::numbers::pi, kPoint = 59 * kPi / 180;

CommandResult run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), support::built_command());
    return support::run_command(arguments);
}

// Along x: 6 mm through with a counterbore, 8 mm blind with a drill's cone, 6 mm blind and flat, 6 mm through
// of few sides, 6 mm tilted.
std::string drilled_plate() {
    std::mt19937 random(1);
    test::DrilledPlate plate(50, 40);
    const std::vector<double> many = test::turn(120, 0.1, 0, random), few = test::turn(16, 0.1, 0, random);
    const auto axis = [&] { return LoopAxis{{plate.next_x() + 15, 25, 0}}; };
    LoopAxis a = axis();
    plate.cell(30, a, {a.ring(many, 9, 40), a.ring(many, 9, 36), a.ring(many, 3, 36), a.ring(many, 3, 0)},
               nullptr);
    a = axis();
    const Vec3d point{a.at[0], 25, 20 - 4 / std::tan(kPoint)};
    plate.cell(30, a, {a.ring(many, 4, 40), a.ring(many, 4, 20)}, &point);
    a = axis();
    const Vec3d floor{a.at[0], 25, 30};
    plate.cell(30, a, {a.ring(many, 3, 40), a.ring(many, 3, 30)}, &floor);
    a = axis();
    plate.cell(30, a, {a.ring(few, 3, 40), a.ring(few, 3, 0)}, nullptr);
    a = LoopAxis::along({plate.next_x() + 15, 24, 0}, {0, 0.05, 1});
    plate.cell(30, a, {a.ring_at_z(many, 3, 40), a.ring_at_z(many, 3, 0)}, nullptr);
    return stl_bytes("drilled", test::rounded(plate.closed()));
}

std::string job_with_drills(const std::string& defaults) {
    std::string job = defaults;
    for (const auto& [number, diameter] : {std::pair{11, 6}, {12, 8}})
        job += fmt::format(
            "\n[[tool]]\nnumber = {}\nkind = \"drill\"\nname = \"drill {} mm\"\ndiameter = {}.0\n"
            "flute_length = 45.0\nstickout = 60.0\nshank_diameter = {}.0\nholder_diameter = 30.0\n"
            "max_rpm = 6000.0\nmax_feed = 3000.0\nplunge_feed = 600.0\nstepdown_min = 1.0\n"
            "stepdown_max = 6.0\n",
            number, diameter, diameter, diameter);
    return job;
}

// The places where a program is below the layer's top, as (x, y) with the lowest z.
std::map<std::pair<double, double>, double> lowest_at(const std::string& program) {
    std::map<std::pair<double, double>, double> lowest;
    double x = 0, y = 0, z = 0;
    std::istringstream lines(program);
    for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line[0] == '(' || line.find('M') != std::string::npos) continue;
        std::smatch word;
        const auto read = [&](const char* letter, double& value) {
            if (std::regex_search(line, word, std::regex(std::string(letter) + "(-?[0-9.]+)")))
                value = std::stod(word[1]);
        };
        read("X", x), read("Y", y), read("Z", z);
        double& low = lowest.try_emplace({x, y}, z).first->second;
        low = std::min(low, z);
    }
    std::erase_if(lowest, [](const auto& place) { return place.second >= 0; });
    return lowest;
}

TEST(Drilling, HolesOfADrillsSizeAreDrilledLayerByLayerAndProven) {
    const TemporaryFolder folder;
    support::spit(folder / "plate.stl", drilled_plate());
    support::spit(folder / "job.toml", job_with_drills(run({"job", "--defaults", "--library", "fixed"}).out));
    const std::string out = folder / "out";
    const CommandResult planned =
        run({"plan", folder / "plate.stl", "-o", out, "--job", folder / "job.toml", "--allow-undercut"});
    ASSERT_EQ(planned.exit, 0) << planned.err;
    const json plan = json::parse(support::slurp(out + "/plan.json"));
    const double tip6 = 3 / std::tan(kPoint), tip8 = 4 / std::tan(kPoint);
    std::map<int, int> programs;
    for (const json& layer : plan["layers"]) {
        const double bottom = layer["z_bottom"], top = layer["z_top"];
        for (const json& op : layer["operations"]) {
            if (op["kind"] != "drill") continue;
            ++programs[op["tool"]];
            const bool is_six = op["tool"] == 11;
            const auto lowest = lowest_at(support::slurp(out + "/" + op["file"].get<std::string>()));
            // Nothing but straight down at the holes' middles, as low as the full diameter asks.
            ASSERT_EQ(lowest.size(), is_six ? 2u : 1u);
            const double tip = is_six ? bottom - tip6 : std::max(bottom, 20.0) - tip8;
            for (const auto& [place, low] : lowest) {
                const double nearest = !is_six ? 45 : place.first < 60 ? 15 : 105;
                EXPECT_NEAR(place.first, nearest, 2e-4);
                EXPECT_NEAR(place.second, 25, 2e-4);
                EXPECT_NEAR(low, tip - top, 5e-4);
            }
            EXPECT_LE(op["stepdown"].get<double>(), 6.0001);
        }
    }
    EXPECT_EQ(programs[11], static_cast<int>(plan["layers"].size()));
    EXPECT_GE(programs[12], 1);
    std::map<std::string, int> told;
    for (const json& d : plan["diagnostics"]) ++told[d["code"]];
    EXPECT_EQ(told["hole.milled"], 1);   // the flat one
    EXPECT_EQ(told["hole.rounded"], 1);  // the one of few sides
    EXPECT_EQ(told["hole.tilted"], 1);
    EXPECT_EQ(told["proof.round"], 0);
    const json proof = json::parse(support::slurp(out + "/verify.json"));
    EXPECT_TRUE(proof["passed"].get<bool>());
    EXPECT_TRUE(proof["violations"].empty());
    // Nothing is left in the holes that were drilled.
    const CommandResult bare =
        run({"plan", folder / "plate.stl", "-o", folder / "bare", "--tools", "fixed", "--allow-undercut"});
    ASSERT_EQ(bare.exit, 0) << bare.err;
    const json milled = json::parse(support::slurp(folder / "bare" + "/verify.json"));
    const double drilled = kPi * (9 + 16 + 9);
    EXPECT_GT(
        milled["totals"]["unreachable_mm2"].get<double>() - proof["totals"]["unreachable_mm2"].get<double>(),
        0.6 * drilled);
    for (const json& d : json::parse(support::slurp(folder / "bare" + "/plan.json"))["diagnostics"])
        EXPECT_NE(d["code"].get<std::string>().substr(0, 5), "hole.");
}

TEST(Drilling, ADrillThatGoesTooDeepOrAsideIsFoundInTheText) {
    const TemporaryFolder folder;
    support::spit(folder / "plate.stl", drilled_plate());
    support::spit(folder / "job.toml", job_with_drills(run({"job", "--defaults", "--library", "fixed"}).out));
    const std::string out = folder / "out";
    ASSERT_EQ(
        run({"plan", folder / "plate.stl", "-o", out, "--job", folder / "job.toml", "--allow-undercut"}).exit,
        0);
    const json plan = json::parse(support::slurp(out + "/plan.json"));
    std::string file;  // the lowest layer with the blind hole
    for (const json& layer : plan["layers"])
        for (const json& op : layer["operations"])
            if (op["kind"] == "drill" && op["tool"] == 12 && file.empty()) file = op["file"];
    ASSERT_FALSE(file.empty());
    const std::string path = out + "/" + file, good = support::slurp(path);
    const double deep = lowest_at(good).begin()->second;
    const std::string z = fmt::format("Z{} F600", deep);
    ASSERT_NE(good.find(z), std::string::npos) << good;
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        text.replace(text.find(from), from.size(), to);
        support::spit(path, text);
        return run({"verify", out}).exit;
    };
    EXPECT_EQ(with(z, z), 0);
    EXPECT_EQ(with(z, fmt::format("Z{:.4f} F600", deep - 0.05)), 5);
    EXPECT_EQ(with("X45", "X45.03"), 5);
}

// A cone under a cylinder against corners, edges and faces, each by nested golden sections: depth is concave.
TEST(Drilling, DepthOfADrillInThePartIsThatOfItsSurface) {
    std::mt19937 random(test::seed());
    Context context;
    shapes::Facets facets = shapes::box({0, 0, 0}, {20, 16, 9});
    facets.push_back({Vec3f{24, 2, 1}, Vec3f{31, 3, 7}, Vec3f{25, 11, 4}});
    facets.push_back({Vec3f{24, 2, 1}, Vec3f{25, 11, 4}, Vec3f{31, 3, 7}});
    const Mesh mesh = weld(context, facets);
    const StandingPart part(context, mesh.view());
    const double z_top = 40;
    const auto draw = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    const auto largest = [](auto&& f, double a, double b) {
        const double golden = (std::sqrt(5.0) - 1) / 2;
        double x = b - golden * (b - a), y = a + golden * (b - a), fx = f(x), fy = f(y);
        for (int i = 0; i < 40; ++i) {
            if (fx > fy) b = y, y = x, fy = fx, x = b - golden * (b - a), fx = f(x);
            else a = x, x = y, fx = fy, y = a + golden * (b - a), fy = f(y);
        }
        return std::max({f(a), f(b), fx});
    };
    int deep = 0;
    for (int i = 0; i < 3000; ++i) {
        const double radius = draw(1, 6), taper = draw(0.3, 1.4);
        const Point3 tip{draw(-5, 36), draw(-5, 20), draw(-4, 10)};
        double expected = 0;
        for (const auto& facet : facets) {
            const Vec3d a = to_double(facet[0]), u = minus(to_double(facet[1]), a),
                        v = minus(to_double(facet[2]), a);
            const auto depth = [&](double s, double t) {
                const Vec3d p = minus(plus(plus(a, u, s), v, t), tip);
                const double rho = std::hypot(p[0], p[1]);
                return std::min(radius - rho, p[2] * std::sin(taper) - rho * std::cos(taper));
            };
            expected = std::max(
                expected,
                largest([&](double s) { return largest([&](double t) { return depth(s, t); }, 0, 1 - s); }, 0,
                        1));
        }
        const Penetration found = part.pointed(z_top, tip, radius, taper, 0);
        EXPECT_NEAR(found.depth, expected, 1e-5) << i;
        deep += expected > 0.1 ? 1 : 0;
    }
    EXPECT_GT(deep, 600);
    // From above through the top: the axis itself, at the top.
    EXPECT_NEAR(part.pointed(9, {10, 8, 7}, 3, kPoint, 0).depth,
                (2 - StandingPart::kSheet) * std::sin(kPoint), 1e-6);
    EXPECT_FALSE(part.pointed(9, {10, 8, 9}, 3, kPoint, 0).found);
}

// A hole on chords becomes the circle through its corners, and nothing else moves.
TEST(Drilling, HolesAreMadeRoundWhereTheMeshHasChords) {
    std::mt19937 random(test::seed());
    Context context;
    const int sides = 12;
    for (const bool is_blind : {false, true}) {
        test::DrilledPlate plate(40, 30);
        const LoopAxis axis{{20, 20, 0}};
        const std::vector<double> angles = test::turn(sides, 0.1, 0, random);
        const double tip = 10 - 5 / std::tan(kPoint);
        const Vec3d point{20, 20, tip};
        plate.cell(40, axis, {axis.ring(angles, 5, 30), axis.ring(angles, 5, is_blind ? 10 : 0)},
                   is_blind ? &point : nullptr);
        const Mesh mesh = weld(context, test::rounded(plate.closed()));
        const std::vector<RoundHole> holes = find_holes(context, mesh.view());
        ASSERT_EQ(holes.size(), 1u);
        const auto rounded = with_rounded_holes(context, mesh.view(), holes, 0.001);
        ASSERT_TRUE(rounded);
        EXPECT_TRUE(test::closed(rounded->mesh.view()));
        const double polygon = 25 * sides / 2.0 * std::sin(2 * kPi / sides), circle = 25 * kPi;
        const double deep = is_blind ? 20 + (10 - tip) / 3 : 30;
        EXPECT_NEAR(test::volume(mesh.view()) - test::volume(rounded->mesh.view()), (circle - polygon) * deep,
                    0.01 * (circle - polygon) * deep);
        const std::vector<RoundHole> again = find_holes(context, rounded->mesh.view());
        ASSERT_EQ(again.size(), 1u);
        EXPECT_LE(again[0].chord_mm, 0.0011);
        EXPECT_NEAR(again[0].diameter_mm, 10, 1e-4);
        EXPECT_NEAR(again[0].depth_mm, holes[0].depth_mm, 1e-4);
        EXPECT_EQ(again[0].bottom, holes[0].bottom);
    }
    // A wall so thin beside the hole that the circle would break through it stays as it is.
    test::DrilledPlate thin(40, 30);
    const LoopAxis axis{{5.05, 20, 0}};
    const std::vector<double> angles = test::turn(sides, kPi / sides, 0, random);
    thin.cell(40, axis, {axis.ring(angles, 5.1, 30), axis.ring(angles, 5.1, 0)}, nullptr);
    const Mesh mesh = weld(context, test::rounded(thin.closed()));
    const std::vector<RoundHole> holes = find_holes(context, mesh.view());
    ASSERT_EQ(holes.size(), 1u);
    EXPECT_FALSE(with_rounded_holes(context, mesh.view(), holes, 0.001));
}

// Why a hole of about a drill's size is milled: with the reason, and its place.
TEST(Drilling, WhatIsNotDrilledSaysWhy) {
    std::mt19937 random(1);
    test::DrilledPlate plate(50, 20);
    const std::vector<double> many = test::turn(120, 0.1, 0, random);
    const auto cell = [&](double diameter) {
        const LoopAxis axis{{plate.next_x() + 15, 25, 0}};
        plate.cell(30, axis, {axis.ring(many, diameter / 2, 20), axis.ring(many, diameter / 2, 0)}, nullptr);
    };
    for (const double diameter : {5.9, 6.1, 14.0}) cell(diameter);
    const TemporaryFolder folder;
    support::spit(folder / "plate.stl", stl_bytes("plate", test::rounded(plate.closed())));
    std::string job = job_with_drills(run({"job", "--defaults", "--library", "fixed"}).out);
    job.replace(job.rfind("\ndiameter = 8.0"), 15, "\ndiameter = 14.0");
    support::spit(folder / "job.toml", job);
    const std::string out = folder / "out";
    ASSERT_EQ(run({"plan", folder / "plate.stl", "-o", out, "--job", folder / "job.toml"}).exit, 0);
    std::vector<std::string> told;
    const json plan = json::parse(support::slurp(out + "/plan.json"));
    for (const json& d : plan["diagnostics"])
        if (d["code"] == "hole.milled")
            told.push_back(fmt::format("{:.0f} ", d["where"][0].get<double>()) +
                           d["message"].get<std::string>());
    for (const json& layer : plan["layers"])
        for (const json& op : layer["operations"]) EXPECT_NE(op["kind"], "drill");
    std::sort(told.begin(), told.end());
    ASSERT_EQ(told.size(), 3u);
    EXPECT_EQ(told[0],
              "15 a hole of 5.900 mm is not drilled: the drill of 6 mm is too thick by more than half of "
              "tolerances.gouge");
    EXPECT_EQ(
        told[1],
        "45 a hole of 6.100 mm is not drilled: the drill of 6 mm is too thin by more than tolerances.cusp");
    EXPECT_EQ(told[2],
              "75 a hole of 14.000 mm is not drilled: the drill's point would go 4.21 mm into the base "
              "board, 3.17 mm "
              "are allowed (machine.base_board_cut)");
}

// The housing's foot has holes of 8 to 10 sides with slivers along their rims, whose edges must turn first.
TEST(DrillingCorpus, HolesOfARealPartAreMadeRound) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr) GTEST_SKIP() << "SLABWRIGHT_CORPUS is not set";
    const std::string bytes = support::slurp(std::string(corpus) + "/castings/machine_housing_TR12J.stl");
    ASSERT_GT(bytes.size(), 84u);
    std::vector<std::array<Vec3f, 3>> corners((bytes.size() - 84) / 50);
    for (std::size_t i = 0; i < corners.size(); ++i) std::memcpy(&corners[i], &bytes[84 + 50 * i + 12], 36);
    Context context;
    const Mesh mesh = weld(context, corners);
    std::vector<RoundHole> holes = find_holes(context, mesh.view());
    std::erase_if(holes, [](const RoundHole& hole) {
        return hole.into[2] > -0.99999 || std::abs(hole.diameter_mm - 10) > 0.1;
    });
    ASSERT_EQ(holes.size(), 16u);
    const auto rounded = with_rounded_holes(context, mesh.view(), holes, 0.0015);
    ASSERT_TRUE(rounded);
    EXPECT_GE(rounded->rounded.size(), 15u);
    EXPECT_TRUE(test::closed(rounded->mesh.view()));
    double least = 0, most = 0;
    for (const std::size_t i : rounded->rounded) {
        const double ring = kPi * holes[i].diameter_mm * holes[i].chord_mm * holes[i].depth_mm;
        least += 0.2 * ring, most += ring;
    }
    const double grown = test::volume(mesh.view()) - test::volume(rounded->mesh.view());
    EXPECT_GT(grown, least);
    EXPECT_LT(grown, most);
}

}  // namespace
}  // namespace slabwright
