// Dowels in the joints between layers: where they are placed, against brute force; their programs, proven
// from the text; and what is told where a hole is not as planned.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <set>
#include <sstream>

#include "engine/paths/operations/dowel_holes.h"
#include "engine/schedule/dowels.h"
#include "io/read/dowel_list_check.h"
#include "io/read/job_toml.h"
#include "io/slabwright.h"
#include "io/write/job_toml.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"
#include "tests/mesh_shapes.h"
#include "tests/support/files.h"
#include "tests/support/rs274.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::slurp;
using support::spit;
using support::TemporaryFolder;

struct Box {
    std::array<double, 3> low{}, high{};
};

double apart(const JointDowel& a, const JointDowel& b) { return std::hypot(a.x - b.x, a.y - b.y); }

// A block with hollows, no two of which touch: flat ones that sections may miss, tall ones that reach through
// joints.
struct Hollowed {
    Box block;
    std::vector<Box> hollows;

    [[nodiscard]] Mesh mesh(Context& context) const {
        const auto facets = [](const Box& b) {
            const auto corner = [](const std::array<double, 3>& p) {
                return Vec3f{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
            };
            return shapes::box(corner(b.low), corner(b.high));
        };
        shapes::Facets all = facets(block);
        for (const Box& hollow : hollows) shapes::append(all, shapes::flipped(facets(hollow)));
        return weld(context, all);
    }

    // How far an upright line is from the nearest surface between two heights, mm; negative outside.
    [[nodiscard]] double room(double x, double y, double low, double high) const {
        double least = std::min({x - block.low[0], block.high[0] - x, y - block.low[1], block.high[1] - y});
        if (low < block.low[2] || high > block.high[2]) return -1;
        for (const Box& h : hollows) {
            if (h.high[2] < low || h.low[2] > high) continue;
            const double dx = std::max({h.low[0] - x, 0.0, x - h.high[0]}),
                         dy = std::max({h.low[1] - y, 0.0, y - h.high[1]});
            least = std::min(least, std::hypot(dx, dy));
        }
        return least;
    }
};

Hollowed random_block(std::mt19937& random) {
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution(low, high)(random);
    };
    Hollowed part;
    part.block = {{0, 0, 0}, {between(100, 240), between(80, 160), 80}};
    for (int i = 0; i < 40 && part.hollows.size() < 8; ++i) {
        Box h;
        for (std::size_t k = 0; k < 3; ++k) {
            const double size = k == 2 && i % 2 == 0 ? between(0.2, 1.5) : between(3, 30);
            h.low[k] = between(part.block.low[k] + 1, part.block.high[k] - size - 1);
            h.high[k] = h.low[k] + size;
        }
        const bool is_free = std::none_of(part.hollows.begin(), part.hollows.end(), [&](const Box& o) {
            for (std::size_t k = 0; k < 3; ++k)
                if (h.high[k] + 0.5 < o.low[k] || o.high[k] + 0.5 < h.low[k]) return false;
            return true;
        });
        if (is_free) part.hollows.push_back(h);
    }
    return part;
}

Plan plan_of(const Hollowed& part, const std::vector<double>& tops, const JointDowels& rules) {
    Plan plan;
    plan.job.dowels = rules;
    plan.stock_min = {part.block.low[0] - 20, part.block.low[1] - 20};
    plan.stock_max = {part.block.high[0] + 20, part.block.high[1] + 20};
    double bottom = 0;
    for (const double top : tops) {
        Layer& layer = plan.layers.emplace_back();
        layer.index = static_cast<int>(plan.layers.size());
        layer.z_bottom = bottom;
        layer.z_top = bottom = top;
        layer.slab_thickness = top - layer.z_bottom + 0.5;
    }
    return plan;
}

std::vector<std::string> codes_of(const Plan& plan) {
    std::vector<std::string> codes;
    for (const Diagnostic& d : plan.diagnostics) codes.push_back(d.code);
    return codes;
}

TEST(Dowels, EveryOneStandsInWoodOnBothSidesOfItsJoint) {
    Context context;
    std::mt19937 random(test::seed());
    std::size_t placed = 0, apart_as_can_be = 0;
    for (int round = 0; round < 60; ++round) {
        const Hollowed part = random_block(random);
        JointDowels rules;
        rules.per_joint = 2 + round % 3;
        rules.diameter = 6 + round % 4;
        rules.clearance = 3 + round % 9;
        rules.depth = 8 + round % 13;
        Plan plan = plan_of(part, {16, 34, 45, 62, 80}, rules);
        place_dowels(context, part.mesh(context).view(), plan);
        const double reach = rules.diameter / 2 + rules.clearance;
        ASSERT_TRUE(plan.layers.back().dowels.empty());
        for (std::size_t i = 0; i + 1 < plan.layers.size(); ++i) {
            const Layer &lower = plan.layers[i], &upper = plan.layers[i + 1];
            const double z = lower.z_top;
            for (const JointDowel& d : lower.dowels) {
                ++placed;
                EXPECT_EQ(d.diameter, rules.diameter);
                EXPECT_LE(d.below, std::min(rules.depth, z - lower.z_bottom - kLeastWoodAtDowel));
                EXPECT_LE(d.above, std::min(rules.depth, upper.z_top - z - kLeastWoodAtDowel));
                EXPECT_GE(std::min(d.below, d.above), rules.diameter / 2);
                // Points all over the hole and the wood around it.
                EXPECT_GE(part.room(d.x, d.y, z - d.below, z + d.above), reach);
            }
            // Of all places of a fine grid no two are farther apart than the first two may be.
            double longest = 0, best = 0;
            for (const JointDowel& a : lower.dowels)
                for (const JointDowel& b : lower.dowels) longest = std::max(longest, apart(a, b));
            if (lower.dowels.empty() || rules.per_joint == 2 || i > 0) continue;
            const auto [low, high] = wood_around(lower.dowels[0], z);
            std::vector<JointDowel> grid;
            for (double x = 0; x < part.block.high[0]; x += 3)
                for (double y = 0; y < part.block.high[1]; y += 3)
                    if (part.room(x, y, low, high) >= reach) grid.push_back({x, y, 0, 0, 0});
            for (const JointDowel& a : grid)
                for (const JointDowel& b : grid) best = std::max(best, apart(a, b));
            EXPECT_GE(longest, 0.97 * best);
            ++apart_as_can_be;
        }
    }
    EXPECT_GT(placed, 200u);
    EXPECT_GT(apart_as_can_be, 20u);
}

TEST(Dowels, HolesFromBothSidesOfASlabDoNotMeet) {
    Context context;
    std::mt19937 random(test::seed());
    int side_by_side = 0;
    for (int round = 0; round < 20; ++round) {
        const Hollowed part = random_block(random);
        Plan plan = plan_of(part, {18, 36, 54, 80}, {.per_joint = 3, .clearance = 4});
        place_dowels(context, part.mesh(context).view(), plan);
        for (std::size_t i = 1; i < plan.layers.size(); ++i) {
            const Layer& layer = plan.layers[i];
            for (const JointDowel& under : plan.layers[i - 1].dowels)
                for (const JointDowel& over : layer.dowels) {
                    const double between = layer.z_top - layer.z_bottom - under.above - over.below;
                    if (between >= kLeastWoodAtDowel) continue;
                    ++side_by_side;
                    EXPECT_GE(apart(under, over), 8 + kLeastWoodAtDowel);
                }
        }
    }
    EXPECT_GT(side_by_side, 20);
}

TEST(Dowels, ASlabDoesNotFitTurned) {
    const Blank slab{{0, 0}, {200, 100}}, square{{0, 0}, {100, 100}};
    const auto at = [](double x, double y) { return JointDowel{x, y, 8, 10, 10}; };
    EXPECT_TRUE(fits_turned(std::vector{at(20, 50), at(180, 50)}, slab));
    EXPECT_TRUE(fits_turned(std::vector{at(20, 50), at(170, 50)}, slab));  // within two diameters
    EXPECT_FALSE(fits_turned(std::vector{at(20, 50), at(160, 50)}, slab));
    EXPECT_TRUE(fits_turned(std::vector{at(20, 20), at(180, 20), at(20, 80), at(180, 80)}, slab));
    EXPECT_FALSE(fits_turned(std::vector{at(20, 20), at(180, 20), at(20, 80)}, slab));
    // By a quarter, where that can be laid.
    const std::vector<JointDowel> four{at(20, 20), at(80, 20), at(20, 80), at(80, 80)};
    EXPECT_TRUE(fits_turned(four, square));
    EXPECT_FALSE(fits_turned(std::vector{at(50, 20), at(80, 50), at(50, 80)}, square));
    // Of two, three and four alike on blocks that are the same all around.
    Context context;
    for (int n = 2; n <= 4; ++n) {
        const Hollowed part{{{0, 0, 0}, {160, 120, 40}}, {}};
        Plan plan = plan_of(part, {20, 40}, {.per_joint = n});
        place_dowels(context, part.mesh(context).view(), plan);
        const std::vector<JointDowel>& dowels = plan.layers[0].dowels;
        EXPECT_EQ(dowels.size(), static_cast<std::size_t>(n));
        EXPECT_FALSE(fits_turned(dowels, slab_of(plan, plan.layers[1])));
        EXPECT_TRUE(plan.diagnostics.empty());
    }
}

TEST(Dowels, AJointWithoutAPlaceIsToldOrRefused) {
    Context context;
    const Hollowed thin{{{0, 0, 0}, {160, 25, 60}}, {}}, small{{{0, 0, 0}, {35, 35, 60}}, {}};
    const auto planned = [&](const Hollowed& part, const std::vector<double>& tops, JointDowels rules) {
        Plan plan = plan_of(part, tops, rules);
        place_dowels(context, part.mesh(context).view(), plan);
        return plan;
    };
    using Codes = std::vector<std::string>;
    EXPECT_EQ(codes_of(planned(thin, {30, 60}, {.per_joint = 2})), Codes{"dowel.none"});
    EXPECT_EQ(codes_of(planned(thin, {30, 60}, {.per_joint = 2, .clearance = 8})), Codes{});
    EXPECT_EQ(codes_of(planned(small, {30, 60}, {.per_joint = 2})), Codes{"dowel.few"});
    EXPECT_EQ(codes_of(planned(thin, {8, 60}, {.per_joint = 2, .clearance = 8})), Codes{"dowel.none"});
    EXPECT_EQ(codes_of(planned(thin, {8, 60}, {.clearance = 8})), Codes{});
    try {
        (void)planned(thin, {30, 60}, {.per_joint = 2, .required = true});
        ADD_FAILURE() << "placed";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "dowel.none");
        EXPECT_EQ(error.kind(), ErrorKind::no_plan);
        EXPECT_FALSE(error.remedy().empty());
        EXPECT_NE(error.place().find("30.00"), std::string::npos);
    }
}

TEST(Dowels, AFacetsDistanceIsThatOfWhatLiesBetweenTheHeights) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> any(-10, 10);
    for (int round = 0; round < 2000; ++round) {
        std::array<std::array<double, 3>, 3> facet;
        for (auto& corner : facet) corner = {any(random), any(random), any(random)};
        const double a = any(random), b = any(random), x = any(random), y = any(random);
        const std::array<double, 2> heights{std::min(a, b), std::max(a, b)};
        double sampled = INFINITY;
        constexpr int kSteps = 120;
        for (int i = 0; i <= kSteps; ++i)
            for (int k = 0; i + k <= kSteps; ++k) {
                std::array<double, 3> p{};
                for (std::size_t c = 0; c < 3; ++c)
                    p[c] =
                        (facet[0][c] * i + facet[1][c] * k + facet[2][c] * (kSteps - i - k)) / double{kSteps};
                if (p[2] >= heights[0] && p[2] <= heights[1])
                    sampled = std::min(sampled, std::hypot(p[0] - x, p[1] - y));
            }
        const double found = plan_distance(facet, heights, x, y);
        EXPECT_LE(found, sampled + 1e-9);
        if (std::isfinite(sampled) && heights[1] - heights[0] > 1) EXPECT_GE(found, sampled - 0.6);
    }
}

TEST(Dowels, ADrillIsTakenOrTheWidestMillThatBores) {
    Job job;
    job.dowels.diameter = 8;
    EXPECT_THROW((void)dowel_tool(job, 10), Error);  // 12.7 mm is too wide
    const auto add = [&](int number, ToolKind kind, double diameter, double flutes) {
        Tool tool = job.tools[1];
        tool.number = number;
        tool.kind = kind;
        tool.diameter = tool.shank_diameter = diameter;
        tool.flute_length = flutes;
        job.tools.push_back(tool);
    };
    add(4, ToolKind::flat, 3.9, 30);
    add(5, ToolKind::flat, 7, 30);  // its core would leave a post
    EXPECT_THROW((void)dowel_tool(job, 10), Error);
    add(6, ToolKind::flat, 4, 30);
    add(7, ToolKind::flat, 6, 30);
    EXPECT_EQ(dowel_tool(job, 10).number, 7);
    EXPECT_THROW((void)dowel_tool(job, 31), Error);
    add(8, ToolKind::drill, 8, 12);
    EXPECT_EQ(dowel_tool(job, 10).number, 7);  // its point needs more than its flutes
    add(9, ToolKind::drill, 8, 30);
    EXPECT_EQ(dowel_tool(job, 10).number, 9);
}

TEST(Dowels, KeysAreReadAndChecked) {
    const Job job = parse_job("[dowels]\nper_joint = 3\ndiameter = 6\ndepth = 12.5\nrequired = true\n", "x");
    EXPECT_EQ(job.dowels.per_joint, 3);
    EXPECT_EQ(job.dowels.depth, 12.5);
    EXPECT_TRUE(job.dowels.required);
    EXPECT_EQ(parse_job("", "x").dowels.per_joint, 0);
    for (const char* bad : {"per_joint = -1", "per_joint = 13", "diameter = 0", "depth = 3", "clearance = 0"})
        EXPECT_THROW((void)parse_job(fmt::format("[dowels]\n{}\n", bad), "x"), Error) << bad;
}

// The default job with dowels, and a drill or an end mill for their holes.
Job with_dowels(int per_joint, ToolKind kind = ToolKind::drill, double diameter = 8) {
    Job job;
    job.dowels.per_joint = per_joint;
    Tool tool = job.tools[1];
    tool.number = 11;
    tool.kind = kind;
    tool.name = "for dowels";
    tool.diameter = tool.shank_diameter = diameter;
    tool.flute_length = 45;
    tool.stickout = 60;
    tool.plunge_feed = 600;
    tool.plunges = kind == ToolKind::drill;
    tool.stepdown_min = 1;
    tool.stepdown_max = 6;
    job.tools.push_back(tool);
    return job;
}

// A model planned and written with its proof, to be spoilt and verified again.
struct Built {
    TemporaryFolder folder;
    std::string out = folder / "out", stl = folder / "pattern.stl";
    json plan;
    bool passed = false;

    Built(const std::string& bytes, const Job& job, bool accept = false) {
        spit(stl, bytes);
        Context context;
        Job asked = job;
        asked.allow_undercut = asked.bonding.accept_weak = accept;
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, asked);
        Plan made = slabwright::plan(context, *pattern, asked);
        passed = write_proven(context, made, out, pattern).passed;
        plan = json::parse(slurp(out + "/plan.json"));
    }
    [[nodiscard]] std::string program(std::size_t layer) const {
        for (const json& op : plan["layers"][layer]["operations"])
            if (op["purpose"] == "dowel holes") return out + "/" + op["file"].get<std::string>();
        return "";
    }
    // The codes of what is found when a file holds another text for once, each once, in their order.
    [[nodiscard]] std::string found(const std::string& file, const std::string& text) const {
        const std::string was = slurp(file);
        spit(file, text);
        Context context;
        std::set<std::string> codes;
        for (const Diagnostic& d : verify(context, out, stl, "", 1).violations) codes.insert(d.code);
        spit(file, was);
        std::string all;
        for (const std::string& code : codes) all += (all.empty() ? "" : " ") + code;
        return all;
    }
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    EXPECT_NE(text.find(from), std::string::npos) << from;
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

// Every X, Y or Z word of a program through a function.
std::string with_words(const std::string& program, char letter, const std::function<double(double)>& turn) {
    std::string text;
    std::istringstream lines(program);
    for (std::string line; std::getline(lines, line); text += line + '\n') {
        const std::size_t at = line[0] == '(' ? std::string::npos : line.find(letter);
        if (at == std::string::npos) continue;
        const std::size_t end = line.find_first_not_of("-.0123456789", at + 1);
        const double value = std::stod(line.substr(at + 1));
        line = line.substr(0, at + 1) + fmt::format("{:.4f}", turn(value)) +
               (end == std::string::npos ? "" : line.substr(end));
    }
    return text;
}

TEST(DowelPlans, ArePlannedProvenAndTold) {
    Job job = with_dowels(2);
    job.dowels.clearance = 6;
    const Built built(stl_bytes("pump", pump_cover()), job);
    EXPECT_TRUE(built.passed);
    const json proof = json::parse(slurp(built.out + "/verify.json"));
    EXPECT_TRUE(proof["violations"].empty()) << proof["violations"].dump(1);
    for (const char* name : {"plan", "sequence"})
        EXPECT_EQ(support::schema_complaint(slurp(fmt::format("{}/{}.json", built.out, name)),
                                            fmt::format("{}/io/{}.schema.json", SLABWRIGHT_SOURCE_DIR, name)),
                  "");
    const json sequence = json::parse(slurp(built.out + "/sequence.json"));
    std::istringstream list(slurp(built.out + "/dowels.csv"));
    std::string line;
    std::getline(list, line);
    std::size_t dowels = 0;
    for (std::size_t l = 0; l < built.plan["layers"].size(); ++l) {
        const json& layer = built.plan["layers"][l];
        EXPECT_EQ(layer.contains("dowels"), !built.program(l).empty());
        if (!layer.contains("dowels")) continue;
        EXPECT_EQ(layer["rounds"], 0) << "the proof took a dowel for a gouge";
        EXPECT_EQ(layer["operations"].back()["purpose"], "dowel holes");
        const json& next = built.plan["layers"][l + 1];
        for (const json& step : sequence["steps"])
            if (step["action"] == "set_dowels" && step["layer"] == next["index"]) {
                EXPECT_EQ(step["count"], layer["dowels"].size());
                EXPECT_EQ(step["seconds"], 5 * static_cast<int>(layer["dowels"].size()));
                EXPECT_LT(step["length_mm"].get<double>(), layer["dowels"][0]["below"].get<double>() +
                                                               layer["dowels"][0]["above"].get<double>());
            }
        // LinuxCNC's own interpreter goes down there and nowhere else.
        const support::CanonProgram canon =
            support::interpret_rs274(slurp(built.program(l)), slurp(built.out + "/tool.tbl"));
        EXPECT_TRUE(canon.ended);
        std::set<std::pair<double, double>> places;
        double lowest = 0;
        for (const support::CanonMotion& m : canon.motions)
            if (m.z < 0) {
                places.insert({m.x, m.y});
                lowest = std::min(lowest, m.z);
            }
        EXPECT_EQ(places.size(), layer["dowels"].size());
        for (const json& dowel : layer["dowels"]) {
            ++dowels;
            EXPECT_TRUE(places.contains({dowel["x"].get<double>(), dowel["y"].get<double>()}));
            const double point = 4 / std::tan(59 * std::numbers::pi / 180);
            EXPECT_NEAR(lowest, -dowel["below"].get<double>() - point, 2e-4);
            // The list's hole, turned over, lies above it.
            ASSERT_TRUE(std::getline(list, line));
            std::replace(line.begin(), line.end(), ',', ' ');
            std::istringstream cells(line);
            double index = 0, slab = 0, hole = 0, diameter = 0, depth = 0, left = 0, front = 0;
            cells >> index >> slab >> hole >> diameter >> depth >> left >> front;
            EXPECT_EQ(index, next["index"].get<double>());
            EXPECT_NEAR(next["blank"]["max"][0].get<double>() - left, dowel["x"].get<double>(), 1e-3);
            EXPECT_NEAR(next["blank"]["min"][1].get<double>() + front, dowel["y"].get<double>(), 1e-3);
            EXPECT_NEAR(depth, dowel["above"].get<double>(), 1e-9);
        }
    }
    EXPECT_GE(dowels, 4u);
    EXPECT_FALSE(std::getline(list, line));
    const std::string dxf = slurp(built.out + "/cut_list.dxf");
    std::size_t circles = 0;
    for (std::size_t at = 0; (at = dxf.find("CIRCLE\n8\nDOWELS", at)) != std::string::npos; ++at) ++circles;
    EXPECT_EQ(circles, dowels);
}

TEST(DowelPlans, ASpoiltHoleIsTold) {
    const Built built(stl_bytes("pump", pump_cover()), with_dowels(2));
    ASSERT_TRUE(built.passed);
    const std::string file = built.program(0), text = slurp(file);
    ASSERT_FALSE(text.empty());
    EXPECT_EQ(built.found(file, text), "");
    const auto told = [&](const std::string& other) { return " " + built.found(file, other) + " "; };
    const auto has = [&](const std::string& codes, const char* code) {
        return codes.find(fmt::format(" {} ", code)) != std::string::npos;
    };
    const auto plus = [](double by) { return [by](double v) { return v + by; }; };
    // Moved: by a little as a place, by more as a gouge too, far away as a hole that is missing.
    std::string codes = told(with_words(text, 'X', plus(0.2)));
    EXPECT_TRUE(has(codes, "dowel.place") && has(codes, "gouge.cutter")) << codes;
    codes = told(with_words(text, 'Y', plus(1)));
    EXPECT_TRUE(has(codes, "dowel.place") && has(codes, "gouge.cutter")) << codes;
    codes = told(with_words(text, 'Y', plus(12)));
    EXPECT_TRUE(has(codes, "dowel.missing") && has(codes, "gouge.cutter")) << codes;
    // Deeper and not as deep.
    const auto down = [](double by) { return [by](double z) { return z < -1 ? z - by : z; }; };
    codes = told(with_words(text, 'Z', down(0.3)));
    EXPECT_TRUE(has(codes, "dowel.depth") && has(codes, "gouge.cutter")) << codes;
    codes = told(with_words(text, 'Z', down(-0.3)));
    EXPECT_TRUE(has(codes, "dowel.depth") && !has(codes, "gouge.cutter")) << codes;
    EXPECT_FALSE(has(told(with_words(text, 'Z', down(0.05))), "dowel.depth"));
    // Sideways at the bottom of a hole.
    const std::size_t last = text.rfind("Z-");
    const std::size_t line_end = text.find('\n', last);
    codes = told(text.substr(0, line_end + 1) + "G1 X0 F600\n" + text.substr(line_end + 1));
    EXPECT_TRUE(has(codes, "gouge.cutter")) << codes;
    // A rapid down.
    codes = told(replaced(text, "Z-5.5517 F600", "G0 Z-5.5517\nG1 F600"));
    EXPECT_TRUE(has(codes, "dowel.rapid") && has(codes, "rapid.through_stock")) << codes;
}

TEST(DowelPlans, ASpoiltPlanListOrSequenceIsTold) {
    const Built built(stl_bytes("pump", pump_cover()), with_dowels(2));
    ASSERT_TRUE(built.passed);
    const std::string plan_file = built.out + "/plan.json", list_file = built.out + "/dowels.csv",
                      sequence_file = built.out + "/sequence.json";
    const auto told = [&](const std::string& file, const std::string& text) {
        return " " + built.found(file, text) + " ";
    };
    const auto has = [&](const std::string& codes, const char* code) {
        return codes.find(fmt::format(" {} ", code)) != std::string::npos;
    };
    // A clearance that is not kept, a dowel that is thicker, one that goes through its slab.
    json plan = built.plan;
    plan["job"]["dowels"]["clearance"] = 60;
    EXPECT_TRUE(has(told(plan_file, plan.dump()), "dowel.wood"));
    plan = built.plan;
    plan["layers"][0]["dowels"][0]["diameter"] = 9;
    std::string codes = told(plan_file, plan.dump());
    EXPECT_TRUE(has(codes, "dowel.diameter") && has(codes, "dowel.list")) << codes;
    plan = built.plan;
    plan["layers"][0]["dowels"][1]["above"] = 30;
    EXPECT_TRUE(has(told(plan_file, plan.dump()), "dowel.wood"));
    plan = built.plan;
    plan["layers"][0].erase("dowels");
    codes = told(plan_file, plan.dump());
    EXPECT_TRUE(has(codes, "gouge.cutter") && has(codes, "gouge.stock") && has(codes, "sequence.dowels"))
        << codes;
    // The list: not turned over, shorter, garbage.
    const std::string list = slurp(list_file);
    const std::size_t second = list.find('\n') + 1, third = list.find('\n', second) + 1;
    EXPECT_TRUE(has(told(list_file, list.substr(0, second) + list.substr(third)), "dowel.list"));
    const double x = built.plan["layers"][0]["dowels"][0]["x"],
                 left = built.plan["layers"][1]["blank"]["max"][0].get<double>() - x,
                 not_turned = x - built.plan["layers"][1]["blank"]["min"][0].get<double>();
    EXPECT_TRUE(
        has(told(list_file, replaced(list, fmt::format(",{:g},", left), fmt::format(",{:g},", not_turned))),
            "dowel.list"));
    EXPECT_TRUE(has(told(list_file, list + "2,1,x\n"), "dowel.list_unreadable"));
    EXPECT_TRUE(has(told(list_file, "nothing\n"), "dowel.list_unreadable"));
    // The sequence: a dowel too few, none at all, set before the glue.
    const std::string sequence = slurp(sequence_file);
    EXPECT_TRUE(
        has(told(sequence_file, replaced(sequence, "\"count\": 2", "\"count\": 1")), "sequence.dowels"));
    EXPECT_TRUE(
        has(told(sequence_file, replaced(sequence, "\"set_dowels\"", "\"clear\"")), "sequence.order"));
}

TEST(DowelPlans, AnEndMillBoresWhereNoDrillIs) {
    Job job = with_dowels(3, ToolKind::flat, 5);
    job.dowels.diameter = 7;
    job.dowels.clearance = 5;
    const Built built(stl_bytes("pump", pump_cover()), job);
    EXPECT_TRUE(built.passed);
    const std::string file = built.program(0), text = slurp(file);
    ASSERT_FALSE(text.empty());
    EXPECT_EQ(built.plan["layers"][0]["rounds"], 0);
    EXPECT_EQ(built.found(file, text), "");
    const support::CanonProgram canon = support::interpret_rs274(text, slurp(built.out + "/tool.tbl"));
    EXPECT_TRUE(canon.ended);
    // Wider by .2 mm all around: every way from the middle of the first hole 1.2 times as long.
    const json& dowels = built.plan["layers"][0]["dowels"];
    const auto wider = [&](const char* key) {
        return [&, key](double v) {
            double nearest = 1e9;
            for (const json& d : dowels)
                if (const double at = d[key]; std::abs(at - v) < std::abs(nearest - v)) nearest = at;
            return nearest + 1.2 * (v - nearest);
        };
    };
    const std::string codes =
        built.found(file, with_words(with_words(text, 'X', wider("x")), 'Y', wider("y")));
    EXPECT_NE(codes.find("dowel.diameter"), std::string::npos) << codes;
    EXPECT_NE(codes.find("gouge.cutter"), std::string::npos) << codes;
}

TEST(DowelPlans, WithoutDowelsAPlanIsWhatItWas) {
    Job job = with_dowels(0);
    const Built plain(stl_bytes("pump", pump_cover()), job);
    job.dowels.depth = 9;
    job.dowels.clearance = 33;
    const Built other(stl_bytes("pump", pump_cover()), job);
    for (const char* name : {"plan.json", "sequence.json", "cut_list.csv", "cut_list.dxf"})
        EXPECT_EQ(slurp(plain.out + "/" + name), slurp(other.out + "/" + name)) << name;
    EXPECT_FALSE(std::filesystem::exists(plain.out + "/dowels.csv"));
    EXPECT_EQ(slurp(plain.out + "/plan.json").find("dowel\""), std::string::npos);
    EXPECT_EQ(slurp(plain.out + "/plan.json").find("\"dowels"), std::string::npos);
    EXPECT_EQ(slurp(plain.out + "/cut_list.dxf").find("DOWELS"), std::string::npos);
}

TEST(DowelPlans, GlueLeavesTheHolesOut) {
    Job job = with_dowels(2);
    job.machine.glue_head = GlueHead::stack;
    job.bonding.edge_setback = 2;
    const Built built(stl_bytes("pump", pump_cover()), job);
    EXPECT_TRUE(built.passed);
    const json sequence = json::parse(slurp(built.out + "/sequence.json"));
    const json& dowels = built.plan["layers"][0]["dowels"];
    int beads = 0;
    for (const json& glue : sequence["glue"]) {
        if (glue["layer"] != 2) continue;
        for (const json& bead : glue["beads"]) {
            ++beads;
            for (const json& d : dowels) {
                const double y = bead[0].get<double>() - d["y"].get<double>();
                const auto [low, high] = std::minmax({bead[1].get<double>(), bead[2].get<double>()});
                const double x = std::clamp(d["x"].get<double>(), low, high) - d["x"].get<double>();
                EXPECT_GT(std::hypot(x, y), 4.4);
            }
        }
    }
    EXPECT_GT(beads, 10);
}

TEST(DowelPlans, CastingsAreProvenWithDowels) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr) GTEST_SKIP() << "SLABWRIGHT_CORPUS is not set";
    for (const char* name : {"bearing_block", "casting_cover"}) {
        Job job = with_dowels(2);
        job.dowels.clearance = 5;
        const Built built(slurp(fmt::format("{}/castings/{}.stl", corpus, name)), job, true);
        EXPECT_TRUE(built.passed) << name;
        std::size_t dowels = 0;
        for (const json& layer : built.plan["layers"])
            if (layer.contains("dowels")) dowels += layer["dowels"].size();
        EXPECT_GE(dowels, 4u) << name;
        EXPECT_TRUE(json::parse(slurp(built.out + "/verify.json"))["violations"].empty()) << name;
    }
}

}  // namespace
}  // namespace slabwright
