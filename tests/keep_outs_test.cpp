// Keep-outs: their keys, the ways of programs around and over them, and the proof that finds what runs into
// one.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "engine/keep_out.h"
#include "engine/planner/planner.h"
#include "engine/schedule/keep_outs.h"
#include "engine/simulate/keep_out_check.h"
#include "io/read/job_toml.h"
#include "io/resume.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/job_toml.h"
#include "io/write/stl_writer.h"
#include "kernels/errors.h"
#include "tests/support/files.h"
#include "tests/support/height_field.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

Error error_of(const std::string& text) {
    try {
        (void)parse_job(text, "my.toml");
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage);
        EXPECT_FALSE(error.remedy().empty());
        EXPECT_EQ(error.message().find('\n'), std::string::npos);
        return error;
    }
    ADD_FAILURE() << "accepted: " << text;
    return Error(ErrorKind::usage, "", "");
}

const std::string kBolt = "[[machine.keep_out]]\nname = \"bolt\"\ncircle = [10, 20, 6]\nheight = 30\n";

TEST(KeepOutJob, KeysAreReadAndRoundTrip) {
    const Job job = parse_job("[machine]\nzero = \"corner\"\n" + kBolt +
                                  "[[machine.keep_out]]\nname = \"fence\"\nrectangle = [-50, 0, -30, 400.5]\n"
                                  "height = 60\nclearance = 2\n"
                                  "[[machine.keep_out]]\nname = \"clamp\"\npolygon = [[0, 0], [30, 0], [0, "
                                  "30.25]]\nheight = 12\nfrom = \"slab\"\n",
                              "x");
    EXPECT_EQ(job.machine.zero, WorkZero::corner);
    const std::vector<KeepOut>& k = job.machine.keep_outs;
    ASSERT_EQ(k.size(), 3u);
    EXPECT_EQ(k[0], (KeepOut{"bolt", {}, {}, {10, 20, 6}, 30, KeepOutBase::board, 5}));
    EXPECT_EQ(k[1], (KeepOut{"fence", {-50, 0, -30, 400.5}, {}, {}, 60, KeepOutBase::board, 2}));
    EXPECT_EQ(k[2], (KeepOut{"clamp", {}, {{0, 0}, {30, 0}, {0, 30.25}}, {}, 12, KeepOutBase::slab, 5}));
    const std::string text = job_toml(job);
    EXPECT_EQ(parse_job(text, "again").machine.keep_outs, k);
    EXPECT_EQ(job_toml(parse_job(text, "again")), text);
    // A job file's own list replaces that of the job it starts from; one without keeps it.
    EXPECT_EQ(parse_job(kBolt, "x", job).machine.keep_outs.size(), 1u);
    EXPECT_EQ(parse_job("[machine]\nclearance = 12\n", "x", job).machine.keep_outs.size(), 3u);
    EXPECT_TRUE(parse_job("machine.keep_out = []\n", "x", job).machine.keep_outs.empty());
    EXPECT_TRUE(parse_job("", "x").machine.keep_outs.empty());
}

TEST(KeepOutJob, FaultsAreToldWithKeyAndLine) {
    struct Case {
        std::string text, code, words, place;
    };
    const std::string head = "[[machine.keep_out]]\nname = \"a\"\nheight = 5\n";
    for (const Case& c : std::vector<Case>{
             {"[[machine.keep_out]]\ncircle = [1, 2, 3]\nheight = 5\n", "job.missing_key",
              "machine.keep_out[1].name", "my.toml"},
             {"[[machine.keep_out]]\nname = \"a\"\ncircle = [1, 2, 3]\n", "job.missing_key",
              "machine.keep_out[1].height", "my.toml"},
             {head, "job.range", "no shape", "my.toml:2"},
             {head + "circle = [1, 2, 3]\nrectangle = [0, 0, 1, 1]\n", "job.range", "more than one shape",
              "my.toml:2"},
             {kBolt + kBolt, "job.range", "machine.keep_out[1]", "my.toml:6"},
             {head + "circle = [1, 2]\n", "job.range", "has 2 numbers", "my.toml:4"},
             {head + "circle = [1, 2, 0]\n", "job.range", "out of range", "my.toml:4"},
             {head + "circle = [1, nan, 3]\n", "job.type", "finite", "my.toml:4"},
             {head + "circle = [1, inf, 3]\n", "job.type", "finite", "my.toml:4"},
             {head + "rectangle = [5, 0, 1, 1]\n", "job.range", "no area", "my.toml:4"},
             {head + "polygon = [[0, 0], [1, 1]]\n", "job.range", "has 2 points", "my.toml:4"},
             {head + "polygon = [[0, 0], [1, 1], [2, 2]]\n", "job.range", "no area", "my.toml:4"},
             {head + "polygon = [[0, 0], [9, 9], [9, 0], [0, 8]]\n", "job.range", "meets itself",
              "my.toml:4"},
             {head + "polygon = [[0, 0], [9, 0], [9, 9], [9, 5], [0, 5]]\n", "job.range", "meets itself",
              "my.toml:4"},
             {head + "polygon = [[0, 0], [9, 0], [9, 0], [0, 9]]\n", "job.range", "twice", "my.toml:4"},
             {head + "polygon = [[0, 0], [9, 0], [0, 9, 1]]\n", "job.type", "points", "my.toml:4"},
             {head + "polygon = [0, 0, 9, 0]\n", "job.type", "points", "my.toml:4"},
             {head + "circle = [1, 2, 3]\nclearance = 0\n", "job.range", "clearance is 0", "my.toml:5"},
             {head + "circle = [1, 2, 3]\nfrom = \"table\"\n", "job.word", "none of board, slab",
              "my.toml:5"},
             {head + "circel = [1, 2, 3]\n", "job.unknown_key", "machine.keep_out.circel", "my.toml:4"},
             {"[machine]\nkeep_out = 3\n", "job.type", "not a list of tables", "my.toml:2"},
             {"[machine]\nkeep_outs = 3\n", "job.unknown_key", "machine.keep_outs", "my.toml:2"},
             {"[[machine.keep_out]]\nname = \"a\"\nheight = -2\ncircle = [1, 2, 3]\n", "job.range",
              "height is -2", "my.toml:3"}}) {
        const Error error = error_of(c.text);
        EXPECT_EQ(error.code(), c.code) << c.text << error.what();
        EXPECT_NE(error.message().find(c.words), std::string::npos) << c.text << error.what();
        EXPECT_EQ(error.place().substr(0, c.place.size()), c.place) << c.text << error.what();
    }
}

using Grid = std::array<int, 2>;  // a place of whole millimetres

/// Whether two sides have any place in common, by what share of each leads there.
bool have_a_place_in_common(Grid a, Grid b, Grid c, Grid d) {
    const int ux = b[0] - a[0], uy = b[1] - a[1], vx = d[0] - c[0], vy = d[1] - c[1], wx = c[0] - a[0],
              wy = c[1] - a[1];
    const int across = ux * vy - uy * vx;
    if (across != 0) {
        const int sign = across > 0 ? 1 : -1, s = sign * (wx * vy - wy * vx), t = sign * (wx * uy - wy * ux);
        return s >= 0 && s <= sign * across && t >= 0 && t <= sign * across;
    }
    if (wx * uy != wy * ux) return false;  // beside each other
    const int length = ux * ux + uy * uy, from = wx * ux + wy * uy, to = from + vx * ux + vy * uy;
    return std::max(from, to) >= 0 && std::min(from, to) <= length;
}

// Against every pair of sides: neighbours may not fold back, others may not have a place in common.
TEST(KeepOutJob, APolygonIsTakenExactlyWhenItDoesNotMeetItself) {
    std::mt19937 random(test::seed());
    int taken = 0, refused = 0;
    for (int round = 0; round < 20'000; ++round) {
        const std::size_t n = 3 + random() % 4;
        std::vector<Grid> corners(n);
        for (Grid& p : corners) p = {static_cast<int>(random() % 6) - 2, static_cast<int>(random() % 6) - 3};
        bool meets = false;
        std::string said;
        KeepOut bolt;
        bolt.name = "bolt";
        bolt.height = 30;
        for (std::size_t i = 0; i < n; ++i) {
            const Grid a = corners[i], b = corners[(i + 1) % n];
            meets |= a == b;
            const Grid next = corners[(i + 2) % n];
            const int ux = b[0] - a[0], uy = b[1] - a[1], vx = next[0] - b[0], vy = next[1] - b[1];
            meets |= ux * vy == uy * vx && ux * vx + uy * vy < 0;
            for (std::size_t j = i + 2; j < n; ++j)
                meets |= (j + 1) % n != i && have_a_place_in_common(a, b, corners[j], corners[(j + 1) % n]);
            bolt.polygon.push_back({static_cast<double>(a[0]), static_cast<double>(a[1])});
            said += fmt::format(" ({}, {})", a[0], a[1]);
        }
        bool is_taken = true;
        try {
            validate_keep_outs({bolt});
        } catch (const Error& error) {
            is_taken = false;
            EXPECT_EQ(error.code(), "job.range");
        }
        ASSERT_EQ(is_taken, !meets) << said;
        ++(is_taken ? taken : refused);
    }
    EXPECT_GT(taken, 1000);
    EXPECT_GT(refused, 1000);
}

using Spot = std::array<double, 2>;

/// How far a place is from a keep-out's area, by its definition.
double away(const KeepOut& k, const Spot& p) {
    if (!k.circle.empty())
        return std::max(0.0, std::hypot(p[0] - k.circle[0], p[1] - k.circle[1]) - k.circle[2]);
    if (const std::vector<double>& r = k.rectangle; !r.empty())
        return std::hypot(std::max({r[0] - p[0], 0.0, p[0] - r[2]}),
                          std::max({r[1] - p[1], 0.0, p[1] - r[3]}));
    bool inside = false;
    double least = 1e9;
    for (std::size_t i = 0; i < k.polygon.size(); ++i) {
        const Spot &a = k.polygon[i], &b = k.polygon[(i + 1) % k.polygon.size()];
        const double ux = b[0] - a[0], uy = b[1] - a[1], px = p[0] - a[0], py = p[1] - a[1];
        const double t = std::clamp((px * ux + py * uy) / (ux * ux + uy * uy), 0.0, 1.0);
        least = std::min(least, std::hypot(px - t * ux, py - t * uy));
        if ((a[1] > p[1]) != (b[1] > p[1]) && px < ux * py / uy) inside = !inside;
    }
    return inside ? 0 : least;
}

/// One of each shape, about the origin.
KeepOut random_keep_out(std::mt19937& random) {
    const auto real = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    KeepOut k;
    k.name = "x";
    k.height = real(5, 60);
    k.clearance = real(0.5, 8);
    switch (random() % 3) {
        case 0:
            k.rectangle = {real(-30, 0), real(-30, 0), real(1, 30), real(1, 30)};
            break;
        case 1:
            k.circle = {real(-20, 20), real(-20, 20), real(1, 20)};
            break;
        default:  // a star, so that it has hollows; either way round
            const bool left = random() % 2 == 0;
            for (int i = 0; i < 9; ++i) {
                const double angle = (left ? 1 : -1) * i * 2 * std::numbers::pi / 9, r = real(3, 30);
                k.polygon.push_back({r * std::cos(angle), r * std::sin(angle)});
            }
    }
    return k;
}

/// A plan of one layer far from its keep-out, with one program of one cut.
struct OneMove {
    Plan plan;
    SimulationInput input;
    Move from, to;

    [[nodiscard]] std::array<double, 3> at(double t) const {
        if (to.is_arc()) {
            const ArcShape arc = arc_shape(from, to);
            const double angle = arc.start + t * arc.sweep;
            return {arc.x + arc.radius * std::cos(angle), arc.y + arc.radius * std::sin(angle), to_mm(to.z)};
        }
        const auto on = [&](std::int32_t a, std::int32_t b) { return to_mm(a) + t * (to_mm(b) - to_mm(a)); };
        return {on(from.x, to.x), on(from.y, to.y), on(from.z, to.z)};
    }
    /// By how much the tool comes nearer than it may, by places on its way.
    [[nodiscard]] double lacks() const {
        const KeepOut& k = plan.job.machine.keep_outs[0];
        const Tool& tool = plan.job.tools[0];
        double most = -1e9;
        constexpr int kPlaces = 4000;
        for (int i = 0; i <= kPlaces; ++i) {
            const std::array<double, 3> p = at(static_cast<double>(i) / kPlaces);
            for (const auto& [radius, height] : {std::pair{tool.diameter / 2, 0.0},
                                                 {tool.shank_diameter / 2, tool.flute_length},
                                                 {tool.holder_diameter / 2, tool.stickout}})
                if (p[2] + height < k.height)
                    most = std::max(most, radius + k.clearance - away(k, {p[0], p[1]}));
        }
        return most;
    }
};

OneMove random_move(std::mt19937& random) {
    const auto real = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    OneMove one;
    one.plan.job.machine.keep_outs = {random_keep_out(random)};
    Tool& tool = one.plan.job.tools[0];
    tool.diameter = real(2, 30);
    tool.shank_diameter = real(2, 30);
    tool.holder_diameter = real(2, 60);
    one.plan.stock_min = {-500, -500};
    one.plan.stock_max = {-400, -400};
    Layer& layer = one.plan.layers.emplace_back();
    layer.index = 1;
    layer.z_top = 200;
    layer.slab_thickness = 200;
    one.from = {to_units(real(-80, 80)), to_units(real(-80, 80)), to_units(real(-20, 90)), 0};
    if (random() % 3 == 0) {
        const double radius = real(3, 60), start = real(0, 6.28),
                     sweep = real(0.3, 3.0) * (random() % 2 ? 1 : -1);
        const double x = to_mm(one.from.x) - radius * std::cos(start),
                     y = to_mm(one.from.y) - radius * std::sin(start);
        one.to = {to_units(x + radius * std::cos(start + sweep)),
                  to_units(y + radius * std::sin(start + sweep)),
                  one.from.z,
                  1000,
                  to_units(x) - one.from.x,
                  to_units(y) - one.from.y};
    } else {
        one.to = {to_units(real(-80, 80)), to_units(real(-80, 80)), to_units(real(-20, 90)), 1000};
    }
    Program program;
    program.file = "one.ngc";
    program.tool = tool.number;
    for (const Move& m : {one.from, one.to}) {
        ProgramStep& step = program.steps.emplace_back();
        step = {to_mm(m.x), to_mm(m.y), to_mm(m.z), 1000, 7, true};
    }
    if (one.to.is_arc()) {
        const ArcShape arc = arc_shape(one.from, one.to);
        program.arcs.push_back({1, 2, {arc.x, arc.y, to_mm(one.to.z), arc.radius, arc.start, arc.sweep}});
    }
    one.input = {{},        one.plan.stock_min,  one.plan.stock_max, {{0, 200, 200}}, one.plan.job.tools,
                 {program}, one.plan.job.machine};
    return one;
}

/// Whether a violation of this code is among them; the first.
const Violation* find(const std::vector<Violation>& violations, const std::string& code) {
    const auto found = std::find_if(violations.begin(), violations.end(),
                                    [&](const Violation& v) { return v.code == code; });
    return found == violations.end() ? nullptr : &*found;
}

// What planner and proof find on one move, each with its own geometry, is what places on it say.
TEST(KeepOuts, PlannerAndProofFindWhatPlacesOnTheWaySay) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    Context context;
    int entered = 0, free = 0, arcs = 0;
    for (int round = 0; round < 3000; ++round) {
        const OneMove one = random_move(random);
        const double lacks = one.lacks();
        if (std::abs(lacks) < 0.03) continue;  // places lie apart
        const std::string what = "seed " + std::to_string(seed) + " round " + std::to_string(round);
        (lacks > 0 ? entered : free) += 1;
        arcs += one.to.is_arc() && lacks > 0;
        const std::vector<Violation> violations = check_keep_outs(context, one.input, {0, 0});
        const Violation* const cut = find(violations, "keep_out.cut");
        ASSERT_EQ(cut != nullptr, lacks > 0) << what << " lacks " << lacks;
        if (cut != nullptr) {
            EXPECT_NEAR(cut->size, lacks, 0.06) << what;
            EXPECT_EQ(cut->line, 7u);
            EXPECT_EQ(cut->file, "one.ngc");
        }
        const std::vector<KeepOutZone> zones = keep_outs_in(one.plan, one.plan.layers[0]);
        Operation op;
        op.tool = one.plan.job.tools[0].number;
        op.clearance_z = 500;
        op.moves = {one.from, one.to};
        op.moves[1].feed = 0;
        if (one.to.is_arc()) op.moves[1].feed = 1000;
        ASSERT_NO_THROW(keep_clear(one.plan, one.plan.layers[0], 200, op, zones)) << what;
        ASSERT_EQ(op.moves.size() > 2, lacks > 0) << what << " lacks " << lacks;
    }
    EXPECT_GT(entered, 500);
    EXPECT_GT(free, 500);
    EXPECT_GT(arcs, 50);
}

Operation program_of(std::vector<Move> moves) {
    Operation op;
    op.kind = OperationKind::rough;
    op.purpose = "levels";
    op.tool = 2;
    op.clearance_z = 29;
    op.moves = std::move(moves);
    return op;
}

Move at(double x, double y, double z, std::uint32_t feed = 0) {
    return {to_units(x), to_units(y), to_units(z), feed};
}

/// A slab of 100 x 100 x 19 mm with a post beside it, between x 110 and 120.
Plan slab_with_post(double height) {
    Plan plan;
    plan.job.machine.keep_outs = {{"post", {110, 40, 120, 60}, {}, {}, height, KeepOutBase::board, 5}};
    plan.stock_min = {0, 0};
    plan.stock_max = {100, 100};
    Layer& layer = plan.layers.emplace_back();
    layer.index = 1;
    layer.z_top = 18;
    layer.slab_thickness = 19;
    return plan;
}

TEST(KeepOuts, RapidsAndIdleWaysGoOverThem) {
    Plan plan = slab_with_post(40);
    const std::vector<Move> moves{at(115, 0, 29),       at(115, 0, 10),     at(115, 100, 10),
                                  at(115, 100, 8, 900), at(115, 0, 8, 900), at(50, 0, 8, 900),
                                  at(50, 0, 29)};
    plan.layers[0].operations = {program_of(moves)};
    keep_clear(plan);
    const Operation& op = plan.layers[0].operations[0];
    EXPECT_EQ(op.clearance_z, 46) << "over the post's top and clearance";
    const std::vector<Move> expected{at(115, 0, 46),    at(115, 0, 10),      at(115, 0, 45),
                                     at(115, 100, 45),  at(115, 100, 10),    at(115, 100, 8, 900),
                                     at(115, 100, 45),  at(115, 0, 45, 900), at(115, 0, 8, 900),
                                     at(50, 0, 8, 900), at(50, 0, 46)};
    EXPECT_EQ(op.moves, expected);
    // What is clear stays as it is.
    Plan again = plan;
    keep_clear(again);
    EXPECT_EQ(again.layers[0].operations[0].moves, op.moves);
    // With a post that lies lower than all of it, or none, nothing changes.
    Plan low = slab_with_post(7.5);
    low.layers[0].operations = {program_of(moves)};
    keep_clear(low);
    EXPECT_EQ(low.layers[0].operations[0].moves, moves);
    low.job.machine.keep_outs.clear();
    keep_clear(low);
    EXPECT_EQ(low.layers[0].operations[0].moves, moves);
}

TEST(KeepOuts, TheMoveOfThePeakIsFollowed) {
    Plan plan = slab_with_post(40);
    plan.layers[0].operations = {program_of({at(115, 0, 29), at(115, 0, 10), at(115, 100, 10),
                                             at(50, 100, 10, 900), at(50, 50, 10, 900), at(50, 50, 29)})};
    plan.layers[0].operations[0].peak_move = 4;
    keep_clear(plan);
    const Operation& op = plan.layers[0].operations[0];
    ASSERT_TRUE(op.peak_move);
    EXPECT_EQ(op.moves[*op.peak_move], at(50, 50, 10, 900));
}

TEST(KeepOuts, ACutThatEntersIsRefused) {
    Plan plan = slab_with_post(40);
    // The tool's rim is 2 mm from the slab's edge outside when its middle is 8.35 mm out.
    plan.layers[0].operations = {
        program_of({at(50, 50, 29), at(50, 50, 10), at(104, 50, 10, 900), at(104, 50, 29)})};
    plan.job.machine.keep_outs[0].rectangle = {1110, 2040, 1120, 2060};
    try {
        keep_clear(plan, {1000, 2000});
        ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::no_plan);
        EXPECT_EQ(error.code(), "keep_out.entered");
        EXPECT_NE(error.message().find("layer 1, levels: the cutter of T2"), std::string::npos)
            << error.what();
        EXPECT_NE(error.message().find("\"post\""), std::string::npos) << error.what();
        EXPECT_NE(error.place().find("x 1104.00 y 2050.00"), std::string::npos) << error.place();
        EXPECT_FALSE(error.remedy().empty());
    }
}

TEST(KeepOuts, HeightsCountFromBoardOrSlab) {
    Plan plan = slab_with_post(40);
    KeepOut clamp{"clamp", {}, {}, {10, 10, 4}, 12, KeepOutBase::slab, 5};
    plan.job.machine.keep_outs.push_back(clamp);
    Layer upper = plan.layers[0];
    upper.index = 2;
    upper.z_bottom = 18;
    upper.z_top = 36;
    upper.blank = Blank{{40, 40}, {100, 100}};
    plan.layers.push_back(upper);
    std::vector<KeepOutZone> zones = keep_outs_in(plan, plan.layers[0]);
    ASSERT_EQ(zones.size(), 2u);
    EXPECT_EQ(zones[0].top, 40);
    EXPECT_EQ(zones[1].top, 19 + 12);
    zones = keep_outs_in(plan, plan.layers[1]);
    ASSERT_EQ(zones.size(), 1u) << "the upper slab does not carry the clamp";
    EXPECT_EQ(zones[0].top, 40) << "the post stands on the board";
    place_keep_outs(plan);
    ASSERT_EQ(plan.diagnostics.size(), 1u);
    EXPECT_EQ(plan.diagnostics[0].code, "keep_out.slab");
    // Places count from machine.zero.
    plan.job.machine.zero = WorkZero::centre;
    zones = keep_outs_in(plan, plan.layers[0]);
    EXPECT_EQ(zones[0].box_min, (Spot{160, 90}));
    EXPECT_EQ(zones[1].x, 60);
    const auto refused = [](Plan wrong, const char* code) {
        try {
            place_keep_outs(wrong);
            ADD_FAILURE() << "accepted, though " << code << " was due";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), code) << error.what();
        }
    };
    Plan off = slab_with_post(40);
    off.job.machine.keep_outs[0].from = KeepOutBase::slab;
    refused(off, "keep_out.slab");
    Plan under = slab_with_post(40);
    under.job.machine.keep_outs[0].rectangle = {90, 40, 120, 60};
    refused(under, "keep_out.entered");
    Plan beside = slab_with_post(40);
    beside.job.machine.keep_outs[0].rectangle = {100, 0, 120, 100};
    EXPECT_NO_THROW(place_keep_outs(beside)) << "a fence may touch the slab";
}

/// A block of 40 x 30 x 20 mm.
Mesh block(Context& context) {
    Mesh mesh = test::height_field(context, 1, 1.0, [](double, double) { return 1.0; });
    for (Vec3f& v : mesh.vertices) v = {300 + v.x * 40, v.y * 30, v.z * 20};
    return mesh;
}

/// A job that measures from the board's corner, with a bolt beside the board of about 91 x 81 mm.
Job job_with_bolt(double x, double y, double height) {
    Job job;
    job.machine.zero = WorkZero::corner;
    job.machine.keep_outs = {{"bolt", {}, {}, {x, y, 8}, height, KeepOutBase::board, 5}};
    return job;
}

/// Plans the block and writes it, proven.
VerifyResult write_block(Context& context, const Job& job, const support::TemporaryFolder& folder) {
    const std::string stl = folder / "block.stl";
    write_stl(stl, block(context));
    const Plan planned = plan(context, stl, job);
    return write_verified(context, planned, folder / "out", stl, 1.0);
}

TEST(KeepOuts, APlanBesideABoltVerifiesAndPassesOverIt) {
    Context context;
    const support::TemporaryFolder folder;
    const VerifyResult result = write_block(context, job_with_bolt(150, 40, 55), folder);
    EXPECT_TRUE(result.passed) << result.violations.size();
    EXPECT_EQ(support::schema_complaint(support::slurp(folder / "out/plan.json"),
                                        support::checkout("io/plan.schema.json")),
              "");
    // All programs begin and end over the bolt, whose top lies 55 mm over the board.
    const Verification found = verify_folder(context, folder / "out", {.source = {}, .write = false});
    ASSERT_FALSE(found.input.programs.empty());
    for (const Program& program : found.input.programs) {
        EXPECT_NEAR(program.steps.back().z, 61, 1e-9) << program.file;
        EXPECT_TRUE(std::isnan(program.steps.front().x)) << program.file;
        EXPECT_NEAR(program.steps.front().z, 61, 1e-9) << program.file;
    }
    EXPECT_EQ(found.input.machine.keep_outs, job_with_bolt(150, 40, 55).machine.keep_outs);
}

TEST(KeepOuts, EveryControlsProgramsPassOverTheBolt) {
    Context context;
    for (const Post post : {Post::fanuc, Post::grbl, Post::siemens, Post::heidenhain}) {
        const support::TemporaryFolder folder;
        Job job = job_with_bolt(150 - 90.8 / 2, 0, 55);
        job.machine.post = post;
        job.machine.zero = WorkZero::centre;
        job.machine.table = BuildTable::fixed;
        if (post != Post::grbl) job.machine.programs = ProgramSpan::layer;
        const VerifyResult result = write_block(context, job, folder);
        for (const Diagnostic& v : result.violations) ADD_FAILURE() << v.code << ": " << v.message;
        // The same bolt 45 mm nearer is in the way of each.
        job.machine.keep_outs[0].circle[0] -= 45;
        const VerifyResult nearer = verify(context, folder / "out", {}, {}, 1.0, &job.machine.keep_outs);
        EXPECT_TRUE(std::any_of(nearer.violations.begin(), nearer.violations.end(),
                                [](const Diagnostic& v) { return v.code == "keep_out.cut"; }));
    }
}

TEST(KeepOuts, ABoltInTheWayIsRefused) {
    Context context;
    const Mesh mesh = block(context);
    const auto refusal = [&](const Job& job) {
        try {
            (void)make_plan(context, mesh, {}, job);
            ADD_FAILURE() << "planned";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::no_plan);
            return error;
        }
        return Error(ErrorKind::usage, "", "");
    };
    // In the pattern's area.
    Error error = refusal(job_with_bolt(45, 40, 55));
    EXPECT_EQ(error.code(), "keep_out.entered");
    EXPECT_NE(error.message().find("slab of layer 1"), std::string::npos) << error.what();
    EXPECT_NE(error.place().find("x 299.6"), std::string::npos) << "in the model's places: " << error.place();
    // Beside the slab, where the face mill goes.
    error = refusal(job_with_bolt(105, 40, 55));
    EXPECT_EQ(error.code(), "keep_out.entered");
    EXPECT_NE(error.message().find("T1"), std::string::npos) << error.what();
    // So high that the spindle does not get over it.
    error = refusal(job_with_bolt(150, 40, 400));
    EXPECT_EQ(error.code(), "machine.travel_z");
    // A clamp on a slab that is faced.
    Job job = job_with_bolt(10, 10, 12);
    job.machine.keep_outs[0].from = KeepOutBase::slab;
    error = refusal(job);
    EXPECT_EQ(error.code(), "keep_out.entered");
    EXPECT_NE(error.message().find("T1"), std::string::npos) << error.what();
}

// A flask's frame is not milled, so where its slab is not faced either a clamp may stand on it, and the
// pattern in the flask is cut all the same.
TEST(KeepOuts, AClampStandsOnTheFrameOfAFlask) {
    Context context;
    const support::TemporaryFolder folder;
    Job job = job_with_bolt(8, 8, 15);
    job.machine.keep_outs[0].from = KeepOutBase::slab;
    job.machine.keep_outs.push_back({"clamp", {20, -5, 40, 8}, {}, {}, 15, KeepOutBase::slab, 2});
    job.slabs.facing_allowance = 0;
    job.flask.enabled = true;
    job.flask.wall = 80;
    const std::string stl = folder / "block.stl";
    Mesh mesh = block(context);
    for (Vec3f& v : mesh.vertices) v.z *= 19.0F / 20;
    write_stl(stl, mesh);
    const Plan planned = plan(context, stl, job);
    const VerifyResult result = write_verified(context, planned, folder / "out", stl, 1.0);
    EXPECT_TRUE(result.passed);
    for (const Diagnostic& v : result.violations) ADD_FAILURE() << v.code << ": " << v.message;
    for (const Operation& op : planned.layers[0].operations) EXPECT_NE(op.kind, OperationKind::face);
}

// The programs that face a spoilt layer off go over the bolt too.
TEST(KeepOuts, RemadeLayersKeepClear) {
    Context context;
    const support::TemporaryFolder folder;
    ASSERT_TRUE(write_block(context, job_with_bolt(150, 40, 55), folder).passed);
    const std::filesystem::path out = folder / "out";
    const nlohmann::json sequence = nlohmann::json::parse(support::slurp(out / "sequence.json"));
    int last = 0;  // step of layer 1
    for (const nlohmann::json& step : sequence["steps"])
        if (step["layer"] == 1) last = step["id"];
    ResumeOptions options;
    options.after = last;
    (void)resume_build(context, out.string(), options);
    options = {};
    options.remake = 1;
    const ResumeStatus status = resume_build(context, out.string(), options);
    ASSERT_EQ(status.programs.size(), 1u);
    const std::string text = support::slurp(out / status.programs[0]);
    const Plan planned = plan(context, folder / "block.stl", job_with_bolt(150, 40, 55));
    EXPECT_NE(text.find(fmt::format("G0 Z{:g}\n", 61 - planned.layers[0].z_top)), std::string::npos) << text;
}

TEST(KeepOuts, WithoutThemNothingChanges) {
    Context context;
    const Mesh mesh = block(context);
    Job job = job_with_bolt(150, 40, 5);  // lower than everything that runs near it
    const Plan with = make_plan(context, mesh, {}, job);
    job.machine.keep_outs.clear();
    const Plan without = make_plan(context, mesh, {}, job);
    ASSERT_EQ(with.layers.size(), without.layers.size());
    for (std::size_t l = 0; l < with.layers.size(); ++l)
        for (std::size_t o = 0; o < with.layers[l].operations.size(); ++o)
            EXPECT_EQ(with.layers[l].operations[o].moves, without.layers[l].operations[o].moves);
    EXPECT_EQ(plan_document(without).find("keep_out"), std::string::npos);
    EXPECT_NE(plan_document(with).find("\"keep_outs\""), std::string::npos);
}

TEST(KeepOuts, VerifyFindsABoltThatCameLaterAndAProgramThatWasEdited) {
    Context context;
    const support::TemporaryFolder folder;
    ASSERT_TRUE(write_block(context, job_with_bolt(150, 40, 55), folder).passed);
    const std::filesystem::path out = folder / "out";
    const auto violations = [&] {
        return verify_folder(context, out.string(), {.source = {}, .write = false}).report.violations;
    };
    ASSERT_TRUE(violations().empty());
    // The bolt of the plan is moved nearer.
    const std::string plan = support::slurp(out / "plan.json");
    const auto with = [&](const std::string& what, const std::string& by) {
        std::string changed = plan;
        const std::size_t place = changed.find(what);
        EXPECT_NE(place, std::string::npos) << what;
        changed.replace(place, what.size(), by);
        support::spit(out / "plan.json", changed);
    };
    with("[150, 40, 8]", "[105, 40, 8]");
    std::vector<Violation> found = violations();
    const Violation* cut = find(found, "keep_out.cut");
    ASSERT_NE(cut, nullptr);
    EXPECT_NE(cut->message.find("\"bolt\""), std::string::npos) << cut->message;
    EXPECT_GT(cut->line, 0u);
    EXPECT_TRUE(cut->where);
    EXPECT_EQ(find(found, "keep_out.slab"), nullptr);
    with("[150, 40, 8]", "[45, 40, 8]");
    found = violations();
    EXPECT_NE(find(found, "keep_out.cut"), nullptr);
    EXPECT_NE(find(found, "keep_out.slab"), nullptr);
    // A higher one, over which the programs do not come.
    with("\"height\": 55", "\"height\": 70");
    found = violations();
    EXPECT_NE(find(found, "keep_out.approach"), nullptr);
    EXPECT_EQ(find(found, "keep_out.cut"), nullptr) << "beyond all programs";
    support::spit(out / "plan.json", plan);
    // A job file's, in place of the plan's.
    const std::vector<KeepOut> later = job_with_bolt(105, 40, 55).machine.keep_outs;
    const VerifyResult verified = verify(context, out.string(), {}, {}, 1.0, &later);
    EXPECT_FALSE(verified.passed);
    ASSERT_FALSE(verified.violations.empty());
    EXPECT_EQ(verified.violations[0].code, "keep_out.cut");
    EXPECT_TRUE(verify(context, out.string(), {}, {}, 1.0).passed);
    // A rapid runs through the bolt.
    const std::filesystem::path file = std::filesystem::directory_iterator(out / "nc")->path();
    const std::string text = support::slurp(file);
    const std::size_t end = text.rfind("G0 Z");
    ASSERT_NE(end, std::string::npos);
    const std::size_t next = text.find('\n', end) + 1;
    const auto run = [&](const std::string& z) {
        support::spit(
            file, text.substr(0, next) + "G0 X150 Y0\nG0 Z" + z + "\nG0 Y100\nG0 Z100\n" + text.substr(next));
        return violations();
    };
    found = run("30");
    cut = find(found, "keep_out.cut");
    ASSERT_NE(cut, nullptr);
    EXPECT_EQ(cut->file, file.filename().string());
    EXPECT_NE(cut->message.find("1 motion enters"), std::string::npos) << cut->message;
    EXPECT_EQ(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(next), '\n') + 3,
              cut->line);
    EXPECT_EQ(find(run("60"), "keep_out.cut"), nullptr);
}

}  // namespace
}  // namespace slabwright
