// A part as sheets, from the plan to the text of its programs and back to the part.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/sheet_plan.h"
#include "io/posts/sheet_reader.h"
#include "io/sheets.h"
#include "kernels/errors.h"
#include "tests/support/files.h"
#include "tests/support/loft.h"
#include "tests/support/places.h"
#include "tests/support/rs274.h"
#include "tests/support/seed.h"
#include "tests/support/sheet_proofs.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using namespace support;

SheetJob job_of(SheetHead head) {
    SheetJob job = sheet_job(head, 300);
    if (head == SheetHead::router) job.nesting.spacing = 4;
    return job;
}

Mesh vase(Context& context) {
    return turned(context, 48, 96, 120, [](double z) { return 40 + 8 * std::sin(z / 9); });
}

TEST(Sheets, ProgramsOfEveryHeadMakeThePart) {
    Context context;
    const Mesh mesh = vase(context);
    double upright = 0;
    for (const SheetHead head : {SheetHead::router, SheetHead::laser, SheetHead::jet}) {
        const SheetsPlan plan = plan_sheets(context, mesh, job_of(head));
        const SheetProof proof = proof_of(context, mesh, texts_of(plan));
        EXPECT_TRUE(proof.passed) << told(proof);
        EXPECT_LT(proof.gouge, 0.02);
        EXPECT_GE(proof.made_mm3, proof.part_mm3);
        std::printf("  %zu sheets, left over %.3f mm, volume %+.2f %%\n", plan.pieces.size(), proof.left_over,
                    100 * (proof.made_mm3 / proof.part_mm3 - 1));
        if (head == SheetHead::router) upright = proof.left_over;
        if (head == SheetHead::jet) {
            EXPECT_LT(proof.left_over, 0.4 * upright);
        }
    }
}

TEST(Sheets, NothingIsDrawnOrComparedThatWasNotAskedFor) {
    Context context;
    const TemporaryFolder folder;
    SheetJob job = job_of(SheetHead::laser);
    job.slicing.thicknesses = {12};
    const SheetsResult made =
        make_sheets(context, checkout("tests/data/half-sphere.stl"), {}, job, folder / "out", {});
    EXPECT_TRUE(made.proof.passed) << told(made.proof);
    EXPECT_EQ(made.costs.size(), 1u);
    for (const auto& [name, bytes] : tree(folder / "out"))
        EXPECT_EQ(name.find("fixture"), std::string::npos) << name;
}

// Every kind of fault in the text is found in the text.
TEST(Sheets, ProofFindsWhatIsWrongInTheText) {
    Context context;
    const Mesh mesh = vase(context);
    const SheetsPlan plan = plan_sheets(context, mesh, job_of(SheetHead::router));
    const std::vector<std::string> good = texts_of(plan);
    const auto changed = [&](const std::string& from, const std::string& to) {
        std::vector<std::string> texts = good;
        for (std::string& text : texts)
            if (const std::size_t at = text.find(from); at != std::string::npos) {
                text.replace(at, from.size(), to);
                return texts;
            }
        ADD_FAILURE() << from << " is in no text";
        return texts;
    };
    const auto has = [&](const std::vector<std::string>& texts, const char* code) {
        const SheetProof proof = proof_of(context, mesh, texts);
        EXPECT_FALSE(proof.passed);
        for (const Diagnostic& d : proof.violations)
            if (d.code == code) return;
        ADD_FAILURE() << code << " is missing among\n" << told(proof);
    };
    has(changed("kerf 6 ", "kerf 7 "), "sheets.gouge");
    has(changed("from 0 ", "from 6 "), "sheets.thickness");
    has(changed("stock 300 x 300", "stock 100 x 300"), "sheets.leaves_stock");
    const std::vector<std::string> shallow = [&] {
        std::vector<std::string> texts = good;
        for (std::string& text : texts)
            for (std::size_t at = text.find("G1 Z-"); at != std::string::npos;
                 at = text.find("G1 Z-", at + 1)) {
                const std::size_t end = text.find(' ', at + 5);
                if (std::stod(text.substr(at + 5, end - at - 5)) > 5.9)
                    text.replace(at, end - at, "G1 Z-5.5");
            }
        return texts;
    }();
    has(shallow, "sheets.depth");
    // A piece that is nowhere.
    std::vector<std::string> fewer(good.begin(), good.end() - 1);
    if (good.size() > 1) has(fewer, "sheets.stack");
    // A point of the last loop moved into the part, at every depth.
    std::vector<std::string> dented = good;
    const std::size_t last = dented[0].rfind("G0 Z5\n");
    std::size_t line = last;
    for (int i = 0; i < 12; ++i) line = dented[0].rfind('\n', line - 1);
    const std::size_t end = dented[0].find('\n', line + 1);
    const ReadSheetProgram read = read_sheet_program(good[0], "x");
    double cx = 0, cy = 0;
    for (const ReadHead& h : read.ways.back().points) {
        cx += h.x / static_cast<double>(read.ways.back().points.size());
        cy += h.y / static_cast<double>(read.ways.back().points.size());
    }
    const std::string was = dented[0].substr(line, end - line + 1),
                      middle = "\nX" + std::to_string(cx) + " Y" + std::to_string(cy) + '\n';
    for (std::size_t at = 0; (at = dented[0].find(was, at)) != std::string::npos; at += middle.size())
        dented[0].replace(at, was.size(), middle);
    has(dented, "sheets.gouge");
    const auto refuses = [&](const std::string& from, const std::string& to, const char* code) {
        try {
            (void)proof_of(context, mesh, changed(from, to));
            ADD_FAILURE() << code;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), code);
            EXPECT_NE(std::string(error.what()).find("sheet_1.ngc:"), std::string::npos);
        }
    };
    refuses("G21 ", "", "gcode.unset");
    refuses("G54\n", "G55\n", "gcode.unknown_word");
    refuses("M2\n", "", "gcode.no_end");
    refuses("X", "X1e", "gcode.number");
    refuses("(cut of", "(cat of", "gcode.unnamed");
    refuses("(stock ", "(stack ", "gcode.no_stock");
}

// A cut that narrows: a head that tilts leans by it and leaves upright walls, one that does not leaves as
// much more at the bottom, and neither enters the part.
TEST(Sheets, TaperIsLeanedOutOrKeptClearOf) {
    Context context;
    const support::Ring square{0, {{0, 0}, {60, 0}, {60, 60}, {0, 60}}};
    support::Ring top = square;
    top.z = 24;
    const Mesh box = loft(context, {square, top});
    for (const double taper : {1.5, -1.5})
        for (const double tilt : {30.0, 0.0}) {
            SheetJob job = job_of(SheetHead::jet);
            job.slicing.thicknesses = {12};
            job.cutting.taper_deg = taper;
            job.cutting.most_tilt_deg = tilt;
            const SheetsPlan plan = plan_sheets(context, box, job);
            const std::vector<std::string> texts = texts_of(plan);
            const SheetProof proof = proof_of(context, box, texts);
            EXPECT_TRUE(proof.passed) << taper << ' ' << tilt << '\n' << told(proof);
            // Middles of nine levels: the outermost is 12 * 17 / 18 from the end where the cut is widest.
            const double stays = 12 * std::tan(1.5 * std::numbers::pi / 180);
            if (tilt > 0) EXPECT_LT(proof.left_over, 0.03);
            else EXPECT_NEAR(proof.left_over, stays * 17 / 18, 0.02);
            double most = 0;
            for (const HeadPoint& p : plan.programs[0].ways[0].points) most = std::max(most, p.a_deg);
            EXPECT_NEAR(most, tilt > 0 ? 1.5 * std::sqrt(2) : 0, 0.1) << "at the corners";
            // Left out of the text: the proof sees the other walls.
            std::string untold = texts[0];
            const std::size_t at = untold.find("(taper");
            untold.erase(at, untold.find('\n', at) + 1 - at);
            const SheetProof other = proof_of(context, box, {untold});
            if (tilt > 0) EXPECT_EQ(other.passed, taper < 0) << "leaned towards the part";
            else EXPECT_LT(other.left_over, taper < 0 ? stays + 0.02 : 0.02);
        }
    const Mesh mesh = vase(context);
    SheetJob job = job_of(SheetHead::jet);
    job.cutting.taper_deg = 0.8;
    const SheetProof proof = proof_of(context, mesh, texts_of(plan_sheets(context, mesh, job)));
    EXPECT_TRUE(proof.passed) << told(proof);
    job.cutting.taper_deg = 5;  // .8 mm wide, closed after 4.6 mm
    EXPECT_THROW((void)plan_sheets(context, mesh, job), Error);
}

// A control that knows no tip is told where the pivot goes: the tip runs as with one that does.
TEST(Sheets, PivotsMoveSoThatTipsStayOnTheirWays) {
    Context context;
    const Mesh mesh = vase(context);
    SheetJob job = job_of(SheetHead::jet);
    job.pivot = 180;
    const std::vector<std::string> texts = texts_of(plan_sheets(context, mesh, job));
    const SheetProof proof = proof_of(context, mesh, texts);
    EXPECT_TRUE(proof.passed) << told(proof);
    job.pivot = 0;
    const SheetProof plain = proof_of(context, mesh, texts_of(plan_sheets(context, mesh, job)));
    EXPECT_NEAR(proof.made_mm3, plain.made_mm3, 1e-4 * plain.made_mm3);
    EXPECT_TRUE(support::interpret_rs274(texts[0], "").ended);
    const auto says = [&](const std::string& from, const std::string& to) -> std::string {
        std::string text = texts[0];
        const std::size_t at = text.find(from);
        if (at == std::string::npos) return "not there";
        text.replace(at, from.size(), to);
        try {
            (void)read_sheet_program(text, "x");
        } catch (const Error& error) {
            return error.code();
        }
        return "passes";
    };
    EXPECT_EQ(says("(pivot 180)", "(pivot 180)"), "passes");
    EXPECT_EQ(says("(pivot 180)\n", ""), "gcode.height");
    EXPECT_EQ(says("(pivot 180)", "(pivot 0)"), "gcode.pivot");
    EXPECT_EQ(says("(pivot 180)", "(pivot 190)"), "gcode.height");
    // Moves left out, so that the head turns far in one.
    std::string text = texts[0];
    const std::size_t first = text.find("G93\n") + 4;
    std::size_t end = first;
    for (int i = 0; i < 12; ++i) end = text.find('\n', end) + 1;
    EXPECT_EQ(says(text.substr(first, end - first), ""), "gcode.pivot");
}

// Along a square with rounded corners, and along a circle: only corners are slow, by as far as they reach.
TEST(Sheets, JetsSlowDownAtCorners) {
    const auto way_around = [](const std::vector<std::array<double, 2>>& corners) {
        AxisLoop loop;
        for (const auto& [x, y] : corners) loop.top.push_back({to_units(x), to_units(y)});
        loop.bottom = loop.top;
        return head_way(loop, 10, 0.005);
    };
    const auto slow_mm = [](const PacedWay& paced) {
        double slow = 0;
        for (std::size_t i = 1; i < paced.points.size(); ++i)
            if (paced.shares[i] < 1)
                slow += std::hypot(to_mm(paced.points[i].top.x) - to_mm(paced.points[i - 1].top.x),
                                   to_mm(paced.points[i].top.y) - to_mm(paced.points[i - 1].top.y));
        return slow;
    };
    const auto square = way_around({{0, 0}, {30, 0}, {30, 30}, {0, 30}});
    const PacedWay paced = slowed_at_corners(square, {.share = 0.5, .reach = 2});
    EXPECT_NEAR(slow_mm(paced), 4 * 2 * 2, 1e-3);
    EXPECT_EQ(paced.points.size(), paced.shares.size());
    EXPECT_EQ(paced.points.front().top, paced.points.back().top);
    // The same way: every point of the square is there, and nothing is off it.
    for (const HeadPoint& p : square)
        EXPECT_TRUE(std::any_of(paced.points.begin(), paced.points.end(),
                                [&](const HeadPoint& q) { return q.top == p.top; }));
    for (const HeadPoint& p : paced.points) {
        const double x = to_mm(p.top.x), y = to_mm(p.top.y);
        EXPECT_LT(std::min({std::abs(x), std::abs(y), std::abs(x - 30), std::abs(y - 30)}), 1e-3);
    }
    std::vector<std::array<double, 2>> round, small;
    for (int k = 0; k < 90; ++k) {
        const double a = k * 4 * std::numbers::pi / 180;
        round.push_back({40 * std::cos(a), 40 * std::sin(a)});
        small.push_back({0.4 * std::cos(a), 0.4 * std::sin(a)});
    }
    EXPECT_EQ(slow_mm(slowed_at_corners(way_around(round), {})), 0);
    EXPECT_NEAR(slow_mm(slowed_at_corners(way_around(small), {})), 2 * std::numbers::pi * 0.4, 0.02);
    EXPECT_EQ(slow_mm(slowed_at_corners(square, {.share = 1})), 0);
    EXPECT_EQ(slowed_at_corners(square, {.share = 1}).points.size(), square.size());
    // In the programs: half of the feed, twice the time, there.
    Context context;
    const Mesh box = loft(
        context, {{0, {{0, 0}, {40, 0}, {40, 40}, {0, 40}}}, {12, {{0, 0}, {40, 0}, {40, 40}, {0, 40}}}});
    SheetJob job = job_of(SheetHead::jet);
    const SheetsPlan slowed = plan_sheets(context, box, job);
    job.corners.share = 1;
    const SheetsPlan even = plan_sheets(context, box, job);
    EXPECT_GT(slowed.programs[0].minutes, even.programs[0].minutes);
    const double feed = slowed.programs[0].ways[0].feed;
    const double more_mm = (slowed.programs[0].minutes - even.programs[0].minutes) * feed;
    EXPECT_GE(more_mm, 4 * 2);
    EXPECT_LE(more_mm, 4 * (2 + 0.7)) << "with the rounds of the kerf at the corners";
    EXPECT_TRUE(proof_of(context, box, texts_of(slowed)).passed);
}

TEST(Sheets, LinuxCncReadsEveryProgram) {
    Context context;
    const Mesh mesh = vase(context);
    for (const SheetHead head : {SheetHead::router, SheetHead::laser, SheetHead::jet})
        for (const std::string& text : texts_of(plan_sheets(context, mesh, job_of(head))))
            EXPECT_TRUE(support::interpret_rs274(text, "T1 P1 D6 Z0\n").ended);
}

// A step between two of the sections that cuts are fitted to, in a sheet with too many vertices to fit each:
// the flange reaches up to the step, the neck begins there.
TEST(Sheets, TiltedCutsSpareAStepNearASheetsTop) {
    Context context;
    std::vector<support::Ring> rings;
    for (int k = 0; k <= 40; ++k) rings.push_back(circle(11.27 * k / 40, 40 - 0.1 * std::sin(k * 0.3), 64));
    rings.push_back(circle(11.27, 33, 64));
    for (int k = 1; k <= 30; ++k) rings.push_back(circle(11.27 + 12.73 * k / 30, 33 - 0.2 * k, 64));
    const Mesh mesh = loft(context, rings);
    SheetJob job = job_of(SheetHead::jet);
    job.slicing.thicknesses = {12};
    const SheetProof proof = proof_of(context, mesh, texts_of(plan_sheets(context, mesh, job)));
    EXPECT_TRUE(proof.passed) << told(proof);
}

// Walls that lean far more than the head, between upright ones: their corners run along the outline from
// section to section, as those of a horizontal bore do.
TEST(Sheets, TiltedCutsSpareCornersThatRunAlongTheOutline) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < 8; ++round) {
        std::vector<support::Ring> rings;
        for (double z = 0; z < 18; z += 0.7 + 5 * unit(random)) {
            const double x0 = 40 * unit(random), x1 = 60 + 40 * unit(random);
            rings.push_back({z, {{x0, 0}, {x1, 0}, {x1, 30}, {x0, 30}}});
        }
        const Mesh mesh = loft(context, rings);
        SheetJob job = job_of(SheetHead::jet);
        job.slicing.thicknesses = {3, 6};
        const SheetsPlan plan = plan_sheets(context, mesh, job);
        const SheetProof proof = proof_of(context, mesh, texts_of(plan));
        EXPECT_TRUE(proof.passed) << round << told(proof);
        for (const SheetProgram& program : plan.programs)
            for (const SheetWay& way : program.ways)
                for (const HeadPoint& p : way.points) EXPECT_LE(p.a_deg, job.cutting.most_tilt_deg + 0.2);
    }
}

TEST(Sheets, StacksAlongEveryAxis) {
    Context context;
    const Mesh mesh = loft(context, {circle(0, 20, 40), circle(36, 30, 40)});
    for (const char axis : {'x', 'y', 'z'}) {
        const Mesh up = along_axis(mesh, axis);
        SheetJob job = job_of(SheetHead::laser);
        job.axis = axis;
        const SheetsPlan plan = plan_sheets(context, up, job);
        const SheetProof proof = proof_of(context, up, texts_of(plan));
        EXPECT_TRUE(proof.passed) << axis << told(proof);
    }
    EXPECT_THROW((void)along_axis(mesh, 'w'), Error);
}

// Gas before the first cut and after the last; words that would switch a head, or stand undeclared, are none.
TEST(Sheets, WhatStandsBesideTheHeadIsSwitchedToo) {
    Context context;
    const Mesh mesh = vase(context);
    for (const SheetHead head : {SheetHead::router, SheetHead::laser, SheetHead::jet}) {
        SheetJob job = job_of(head);
        job.begin = {"M7", "M64 P1"};
        job.end = {"M65 P1", "M9"};
        const std::vector<std::string> texts = texts_of(plan_sheets(context, mesh, job));
        for (const std::string& text : texts) {
            EXPECT_NE(text.find("\nM7\nM64 P1\n"), std::string::npos);
            EXPECT_LT(text.rfind("X"), text.rfind("M65 P1\nM9\n"));
            EXPECT_TRUE(support::interpret_rs274(text, "T1 P1 D6 Z0\n").ended);
        }
        EXPECT_TRUE(proof_of(context, mesh, texts).passed);
        std::string untold = texts[0];
        untold.erase(untold.find("(beside the head M7)\n"), 21);
        EXPECT_THROW((void)read_sheet_program(untold, "x"), Error);
        for (const char* wrong : {"M3", "M5", "M2", "M6", "G1 X5", "M7\nM3", ""}) {
            job.begin = {wrong};
            EXPECT_THROW((void)plan_sheets(context, mesh, job), Error) << wrong;
        }
    }
}

TEST(Sheets, ThereAreOnlySoManySheets) {
    Context context;
    const Mesh mesh = loft(context, {circle(0, 40, 48), circle(24, 40, 48)});
    SheetJob job = job_of(SheetHead::laser);
    job.slicing.thicknesses = {6};
    job.stock = {210, 110};  // two pieces on each
    EXPECT_EQ(plan_sheets(context, mesh, job).programs.size(), 2u);
    job.counts = {{6, 2}};
    EXPECT_EQ(plan_sheets(context, mesh, job).programs.size(), 2u);
    job.counts = {{6, 1}};
    try {
        (void)plan_sheets(context, mesh, job);
        ADD_FAILURE() << "two sheets from one";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "sheets.stock");
        EXPECT_NE(std::string(error.what()).find("take 2 whole sheets, and there is 1"), std::string::npos)
            << error.what();
    }
    job.offcuts = {{6, {120, 120}}, {6, {130, 110}}};  // one piece on each
    EXPECT_EQ(plan_sheets(context, mesh, job).programs.size(), 3u);
    job.counts = {{7, 1}};
    EXPECT_THROW((void)plan_sheets(context, mesh, job), Error);
}

// Of a step of 25 mm2, and one that no sheets in stock add up to.
TEST(Sheets, HeightsOfLevelFacesAreJoints) {
    Context context;
    const Mesh mesh = loft(context, {circle(0, 40, 48), circle(9, 40, 48), circle(9, 39.9, 48),
                                     circle(20, 39.9, 48), circle(20, 39.8, 48), circle(36, 39.8, 48)});
    SheetJob job = job_of(SheetHead::laser);
    job.slicing.thicknesses = {9, 18};
    const auto joints_of = [&](double keep) {
        job.keep_flats_mm2 = keep;
        return plan_sheets(context, mesh, job);
    };
    EXPECT_EQ(joints_of(0).pieces.size(), 2u);
    EXPECT_EQ(joints_of(30).pieces.size(), 2u);
    const SheetsPlan plan = joints_of(20);
    ASSERT_EQ(plan.pieces.size(), 3u);
    EXPECT_NEAR(plan.pieces[0].span.top, 9, 1e-6);
    EXPECT_EQ(plan.job.slicing.joints.size(), 0u) << "the job stays as it was given";
    const auto told_joint = std::find_if(plan.diagnostics.begin(), plan.diagnostics.end(),
                                         [](const Diagnostic& d) { return d.code == "sheets.joint"; });
    ASSERT_NE(told_joint, plan.diagnostics.end());
    EXPECT_NE(told_joint->message.find("at 20 mm"), std::string::npos) << told_joint->message;
    EXPECT_TRUE(proof_of(context, mesh, texts_of(plan)).passed);
}

TEST(Sheets, SameTextOnAnyNumberOfThreads) {
    std::vector<std::string> first;
    for (const int threads : {1, 2, 4}) {
        Context context({.threads = threads});
        const std::vector<std::string> texts =
            texts_of(plan_sheets(context, vase(context), job_of(SheetHead::jet)));
        if (threads == 1) first = texts;
        EXPECT_EQ(texts, first);
    }
}

TEST(Sheets, RandomSolidsPassTheirProof) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int round = 0; round < 3; ++round) {
        std::vector<support::Ring> rings;
        const int n = 8 + static_cast<int>(random() % 12);
        double r = 30, x = 0, y = 0;
        for (int z = 0; z <= 18; z += 3) {
            rings.push_back(circle(z, r, n, x, y));
            r = std::clamp(r + 3 * unit(random), 15.0, 45.0), x += unit(random), y += unit(random);
        }
        const Mesh mesh = loft(context, rings);
        for (const SheetHead head : {SheetHead::router, SheetHead::jet}) {
            const SheetsPlan plan = plan_sheets(context, mesh, job_of(head));
            const SheetProof proof = proof_of(context, mesh, texts_of(plan));
            EXPECT_TRUE(proof.passed) << round << told(proof);
        }
    }
}

}  // namespace
}  // namespace slabwright
