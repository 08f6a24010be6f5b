// Numbers and match marks on sheets: where they lie, and what the proof says of those that do not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <set>

#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/engraving.h"
#include "engine/sheets/head_switches.h"
#include "engine/sheets/sheet_plan.h"
#include "io/posts/sheet_reader.h"
#include "kernels/errors.h"
#include "kernels/polygons/border_distance.h"
#include "tests/support/loft.h"
#include "tests/support/rs274.h"
#include "tests/support/seed.h"
#include "tests/support/sheet_proofs.h"

namespace slabwright {
namespace {

using namespace support;

SheetJob job_of(SheetHead head) {
    SheetJob job = sheet_job(head, 400);
    job.engraving.depth = 1;
    if (head != SheetHead::router) job.engraving.width = job.cutting.kerf;
    return job;
}

Mesh vase(Context& context) {
    return turned(context, 48, 48, 48, [](double z) { return 40 + 8 * std::sin(z / 9); });
}

std::size_t count_of(const SheetsPlan& plan) {
    std::size_t n = 0;
    for (const SheetPiece& piece : plan.pieces) n += piece.engravings.size();
    return n;
}

Loops rectangle(double x0, double y0, double x1, double y1) {
    Loops loops;
    for (const auto& [x, y] : {std::pair{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}})
        loops.points.push_back({to_units(x), to_units(y)});
    loops.close_loop();
    return loops;
}

/// Points of a stroke every .2 mm.
std::vector<Point2> along(const std::vector<Point2>& stroke) {
    std::vector<Point2> points;
    for (std::size_t i = 1; i < stroke.size(); ++i) {
        const double dx = stroke[i].x - stroke[i - 1].x, dy = stroke[i].y - stroke[i - 1].y;
        const int n = 1 + static_cast<int>(std::hypot(dx, dy) / 2000);
        for (int k = 0; k <= n; ++k)
            points.push_back({stroke[i - 1].x + static_cast<std::int32_t>(dx * k / n),
                              stroke[i - 1].y + static_cast<std::int32_t>(dy * k / n)});
    }
    return points;
}

TEST(SheetEngraving, DigitsAreTheirOwn) {
    std::set<std::vector<std::pair<int, int>>> all;
    for (char c = '0'; c <= '9'; ++c) {
        std::vector<std::pair<int, int>> points;
        for (const auto& stroke : digit_strokes(std::string(1, c), 6))
            for (const Point2 p : stroke) {
                EXPECT_GE(p.x, 0);
                EXPECT_LE(p.x, to_units(4));
                EXPECT_GE(p.y, -to_units(1.5));
                EXPECT_LE(p.y, to_units(6));
                points.emplace_back(p.x, p.y);
            }
        EXPECT_TRUE(all.insert(points).second) << c;
    }
    // "17": the second digit begins a digit and a half to the right of the first.
    const auto pair = digit_strokes("17", 6);
    ASSERT_EQ(pair.size(), 3u);
    EXPECT_EQ(pair[1][0].x - digit_strokes("7", 6)[0][0].x, to_units(6));
    EXPECT_EQ(pair[2][1].x, to_units(10)) << "the bar is as long as both";
}

// Random sheets of rectangles on each other, with holes and several islands: strokes keep their distance.
TEST(SheetEngraving, StrokesStayWithinWhatIsCovered) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    EngraveRules rules;
    rules.depth = 0.5;
    std::size_t numbers = 0, marks = 0;
    for (int round = 0; round < 300; ++round) {
        rules.width = 0.2 + 1.5 * unit(random);
        const auto region = [&] {
            Loops all;
            for (int k = 0; k < 3; ++k) {
                const double x = 80 * unit(random), y = 80 * unit(random);
                all = unite(all, rectangle(x, y, x + 5 + 40 * unit(random), y + 5 + 40 * unit(random)));
            }
            const double x = 80 * unit(random), y = 80 * unit(random);
            return subtract(all, rectangle(x, y, x + 15 * unit(random), y + 15 * unit(random)));
        };
        EngravedFace face;
        face.outline = region();
        face.next = region();
        face.covered = intersect(face.outline, face.next);
        const auto engraved = engravings_of(context, {face, {{}, {}, face.next, {}}}, rules);
        EXPECT_TRUE(engraved[1].empty()) << "nothing covers the last";
        const BorderDistance to_border(face.covered), to_next(face.next);
        for (std::size_t i = 0; i < engraved[0].size(); ++i) {
            const Engraving& one = engraved[0][i];
            for (const auto& stroke : one.strokes)
                for (const Point2 p : along(stroke)) {
                    ASSERT_GT(winding(face.covered, p), 0) << round;
                    ASSERT_GE(to_border(p), rules.width / 2 + rules.wall - 0.005) << round;
                    for (std::size_t j = 0; j < i; ++j)
                        for (const auto& other : engraved[0][j].strokes)
                            for (const Point2 q : along(other))
                                ASSERT_GT(std::hypot(to_mm(p.x) - to_mm(q.x), to_mm(p.y) - to_mm(q.y)),
                                          rules.width);
                }
            if (one.text.empty()) {
                ++marks;
                EXPECT_NEAR(to_next(one.strokes[0][0]), rules.width / 2 + rules.wall, 0.03);
            } else {
                ++numbers;
                EXPECT_EQ(one.text[0], '1');
            }
        }
    }
    EXPECT_GT(numbers, 100u);
    EXPECT_GT(marks, 80u);
    std::printf("  %zu numbers, %zu marks on 300 sheets\n", numbers, marks);
}

TEST(SheetEngraving, EveryIslandHasItsNumberAndTabsTakeWhatNothingCovers) {
    Context context;
    EngravedFace face;
    face.outline = unite(rectangle(0, 0, 40, 40), rectangle(60, 0, 100, 40));
    face.covered = face.next = face.outline;
    EngravedFace last;
    last.outline = unite(rectangle(0, 0, 40, 40), rectangle(40, 10, 70, 30));
    last.tabs = rectangle(40, 10, 70, 30);
    const EngraveRules rules{.depth = 0.5};
    const auto engraved = engravings_of(context, {face, last}, rules);
    std::set<std::string> texts;
    for (const Engraving& one : engraved[0]) texts.insert(one.text);
    EXPECT_EQ(texts, (std::set<std::string>{"", "1-1", "1-2"}));
    ASSERT_EQ(engraved[1].size(), 1u);
    EXPECT_EQ(engraved[1][0].text, "2");
    EXPECT_GT(engraved[1][0].middle.x, to_units(40));
    EXPECT_THROW((void)engravings_of(context, {face}, {.depth = 0.5, .width = -1}), Error);
    EXPECT_THROW((void)engravings_of(context, {face}, {.depth = 0.5, .height = 3, .least = 4}), Error);
}

TEST(SheetEngraving, ProgramsOfEveryHeadAreProvenAndLinuxCncReadsThem) {
    Context context;
    const Mesh mesh = vase(context);
    for (const auto& [head, way] : {std::pair{SheetHead::router, SheetAlignment::tabs},
                                    {SheetHead::router, SheetAlignment::none},
                                    {SheetHead::laser, SheetAlignment::dowels},
                                    {SheetHead::jet, SheetAlignment::tabs}}) {
        SheetJob job = job_of(head);
        job.alignment.way = way;
        const SheetsPlan plan = plan_sheets(context, mesh, job);
        const std::vector<std::string> texts = texts_of(plan);
        const SheetProof proof = proof_of(context, mesh, texts);
        EXPECT_TRUE(proof.passed) << told(proof);
        EXPECT_EQ(static_cast<std::size_t>(proof.engraved), count_of(plan));
        // A number on all but the last, which only a tab carries; four marks on each that has a next one.
        for (const SheetPiece& piece : plan.pieces) {
            const bool is_last = piece.number == static_cast<int>(plan.pieces.size());
            const auto numbers = std::count_if(piece.engravings.begin(), piece.engravings.end(),
                                               [](const Engraving& e) { return !e.text.empty(); });
            EXPECT_EQ(numbers, is_last && way != SheetAlignment::tabs ? 0 : 1) << piece.number;
        }
        for (const std::string& text : texts)
            EXPECT_TRUE(support::interpret_rs274(text, "T1 P1 D6 Z0\nT2 P2 D1 Z0\n").ended);
    }
}

/// A text of programs changed, and what the proof or the reader says of it.
class Changed {
public:
    Changed(Context& context, const Mesh& mesh, const SheetJob& job)
        : context_(context), mesh_(mesh), good_(texts_of(plan_sheets(context, mesh, job))) {}

    [[nodiscard]] const std::vector<std::string>& good() const { return good_; }

    std::string says(const std::string& from, const std::string& to) {
        std::vector<std::string> texts = good_;
        for (std::string& text : texts)
            if (const std::size_t at = text.find(from); at != std::string::npos) {
                text.replace(at, from.size(), to);
                return says(texts);
            }
        return from + " is in no text";
    }

    std::string says(const std::vector<std::string>& texts) {
        try {
            const SheetProof proof = proof_of(context_, mesh_, texts);
            return proof.passed ? "passes" : proof.violations[0].code;
        } catch (const Error& error) {
            return error.code();
        }
    }

private:
    Context& context_;
    const Mesh& mesh_;
    std::vector<std::string> good_;
};

TEST(SheetEngraving, ProofFindsWhatIsWrongInARoutersText) {
    Context context;
    const Mesh mesh = vase(context);
    Changed changed(context, mesh, job_of(SheetHead::router));
    EXPECT_EQ(changed.says(changed.good()), "passes");
    EXPECT_EQ(changed.says("G1 Z-1 F800", "G1 Z-1.5 F800"), "sheets.engraving") << "deeper than stated";
    EXPECT_EQ(changed.says("depth 1)", "depth 0.5)"), "sheets.engraving");
    EXPECT_EQ(changed.says("(engraving of piece 1 1)", "(engraving of piece 1 2)"), "sheets.engraving");
    EXPECT_EQ(changed.says("(engraving of piece 1 1)", "(engraving of piece 99 99)"), "sheets.engraving");
    EXPECT_EQ(changed.says("width 1 depth", "width 30 depth"), "sheets.engraving")
        << "out of what is covered";
    EXPECT_EQ(changed.says("(engraver tool 2", "(engraver tool 3"), "gcode.tool");
    EXPECT_EQ(changed.says("T1 M6\nG43 H1", "T2 M6\nG43 H2"), "gcode.tool") << "cut with the engraver";
    EXPECT_EQ(changed.says("T1 M6\nG43 H1", "T1 M6\nG43 H2"), "gcode.tool_length");
    EXPECT_EQ(changed.says("T1 M6\nG43 H1\n", "T1 M6\n"), "gcode.tool_length");
    EXPECT_EQ(changed.says("T1 M6\n", "M6\n"), "gcode.tool");
    EXPECT_EQ(changed.says("T1 M6\nG43 H1\nS18000 M3\n", "T1 M6\nG43 H1\n"), "gcode.spindle");
    EXPECT_EQ(changed.says("(engraver tool 2 width 1 depth 1)\n", ""), "gcode.engraver");
    EXPECT_EQ(changed.says("(engraver tool 2", "(engraver feed 2"), "gcode.engraver");
    // The first engraving after the first cut: its piece is loose.
    std::vector<std::string> late = changed.good();
    const std::size_t first = late[0].find("(engraving of"), next = late[0].find("(engraving of", first + 1);
    const std::string moved = late[0].substr(first, next - first);
    late[0].erase(first, next - first);
    const std::size_t m5 = late[0].rfind("M5\n");
    late[0].insert(m5, "M5\nT2 M6\nG43 H2\nS18000 M3\nG4 P3\nG0 Z5\n" + moved);
    EXPECT_EQ(changed.says(late), "sheets.engraving");
}

TEST(SheetEngraving, TheTextStatesWidthAndDepthToATenthOfAMicrometre) {
    SheetsPlan plan;
    plan.job = job_of(SheetHead::router);
    plan.job.engraving.width = 0.80056;
    plan.job.engraving.depth = 1.23456;
    plan.pieces.resize(1);
    plan.pieces[0].number = 1;
    plan.pieces[0].engravings.resize(1);
    plan.programs.resize(1);
    plan.programs[0].pieces = {1};
    const std::string text = sheet_program_text(plan, 0);
    EXPECT_NE(text.find("(engraver tool 2 width 0.8006 depth 1.2346)\n"), std::string::npos) << text;
}

TEST(SheetEngraving, ProofFindsWhatIsWrongInALasersAndAJetsText) {
    Context context;
    const Mesh mesh = vase(context);
    Changed laser(context, mesh, job_of(SheetHead::laser));
    EXPECT_EQ(laser.says("S20\n", "S100\n"), "gcode.power") << "engraves at the power that cuts";
    EXPECT_EQ(laser.says("S100\n", ""), "gcode.power");
    EXPECT_EQ(laser.says("(engraver power 20", "(engraver power 20.5"), "gcode.power");
    SheetJob job = job_of(SheetHead::jet);
    job.on = "M62 P0";
    job.off = "M63 P0";
    Changed jet(context, mesh, job);
    EXPECT_EQ(jet.says(jet.good()), "passes");
    EXPECT_EQ(jet.says("(head on M62 P0 off M63 P0)\n", ""), "gcode.unknown_word");
    EXPECT_EQ(jet.says("(head on M62 P0 off M63 P0)", "(head on M62 P0 off M2)"), "gcode.switch");
    EXPECT_EQ(jet.says("(head on M62 P0 off M63 P0)", "(head on M62 P0 off M62 P0)"), "gcode.switch");
    EXPECT_EQ(jet.says("M63 P0\n", ""), "gcode.rapid");
    const std::string feed = jet.good()[0].substr(jet.good()[0].find("(engraver feed ") + 15);
    const std::string stated = feed.substr(0, feed.find(' '));
    EXPECT_EQ(jet.says(" F" + stated + "\n", " F" + stated + "1\n"), "gcode.feed");
    for (const std::string& text : jet.good()) EXPECT_TRUE(support::interpret_rs274(text, "").ended);
}

TEST(SheetEngraving, JobsThatCannotBeEngravedAreRefused) {
    Context context;
    const Mesh mesh = vase(context);
    const auto refuses = [&](const std::function<void(SheetJob&)>& change, SheetHead head, const char* part) {
        SheetJob job = job_of(head);
        change(job);
        try {
            (void)plan_sheets(context, mesh, job);
            ADD_FAILURE() << part;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::usage);
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
    };
    refuses([](SheetJob& job) { job.engraving.depth = 3.1; }, SheetHead::router, "half of the thinnest");
    refuses([](SheetJob& job) { job.engraving.power = 100; }, SheetHead::laser,
            "engraves at its cutting power");
    refuses([](SheetJob& job) { job.engraving.depth = 0.1; }, SheetHead::jet, "15000");
    for (const char* text :
         {"M2", "M6", "G1", "M62 Q0", "M62 P", "M62 P0 P1", "M200", "m3", "", "M99", "M30"})
        refuses([&](SheetJob& job) { job.on = text; }, SheetHead::jet,
                "is switched on and off by two M words");
    // A switch that is another one's, or the same one written otherwise.
    for (const auto& [on, off] : {std::pair{"M3", "M3"},
                                  {"M5", "M3"},
                                  {"M3", "M9"},
                                  {"M03", "M5"},
                                  {"M62 P0", "M63 P1"},
                                  {"M62 P0", "M062 P0"},
                                  {"M62 P0", "M62 P00"},
                                  {"M62", "M63"},
                                  {"M3 P1", "M5"},
                                  {"M7", "M109"},
                                  {"M100", "M100"}})
        refuses([&](SheetJob& job) { job.on = on, job.off = off; }, SheetHead::laser, "switched on and off");
    for (const auto& [on, off] : {std::pair{"M3", "M5"},
                                  {"M4", "M5"},
                                  {"M7", "M9"},
                                  {"M62 P3", "M63 P3"},
                                  {"M64 P12", "M65 P12"},
                                  {"M100", "M199 P2"},
                                  {"M100 P1", "M100 P0"}})
        EXPECT_TRUE(is_switch_pair(on, off)) << on << ' ' << off;
    for (const char* text : {"M03", "M3", "M4", "M05", "M62 P0", "M64 P0", "M65 P0", "M063 P1"})
        refuses([&](SheetJob& job) { job.on = "M62 P0", job.off = "M63 P0", job.begin = {text}; },
                SheetHead::laser, "switches nothing beside the head");
}

}  // namespace
}  // namespace slabwright
