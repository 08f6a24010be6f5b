// The report without a browser: what it is made of, that it is the same everywhere, and how it refuses.
#include "io/report_html.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "engine/simulate/replay.h"
#include "io/read/pattern_mesh.h"
#include "io/sheets_html.h"
#include "io/slabwright.h"
#include "io/text/base64.h"
#include "io/write/report_outlines.h"
#include "io/write/thinned_path.h"
#include "kernels/access/standing_part.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using support::slurp;
using support::spit;
using support::TemporaryFolder;

const std::string kStl = support::checkout("tests/data/half-sphere.stl");

json data_of(const std::string& page) {
    const std::string begin = "id=\"slabwright-data\">";
    const std::size_t at = page.find(begin) + begin.size();
    return json::parse(page.substr(at, page.find("</script>", at) - at));
}

/// A job whose plan is quick to make and to read.
Job quick_job() {
    Job job;
    job.tolerances.cusp = 0.4;
    return job;
}

TEST(Base64, AgreesWithTheStandard) {
    const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                           {"f", "Zg=="},
                                                           {"fo", "Zm8="},
                                                           {"foo", "Zm9v"},
                                                           {"foob", "Zm9vYg=="},
                                                           {"fooba", "Zm9vYmE="},
                                                           {"foobar", "Zm9vYmFy"}};
    for (const auto& [bytes, text] : vectors) EXPECT_EQ(base64(std::string(bytes)), text);
    std::string little;
    append_little_endian(little, std::uint16_t{0x1234});
    append_little_endian(little, std::uint32_t{0xA1B2C3D4});
    EXPECT_EQ(little, "\x34\x12\xD4\xC3\xB2\xA1");
}

TEST(ThinnedPath, EveryPointLeftOutLiesNearTheWayThatReplacesIt) {
    for (const unsigned seed : {1u, 2u, 3u}) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> step(-1, 1);
        Program program;
        ProgramStep at{0, 0, 0, 1000, 1, true};
        for (int i = 0; i < 3000; ++i) {
            at.x += 0.3 + 0.1 * step(random), at.y = 5 * std::sin(at.x / 7) + 0.01 * step(random),
                                              at.z = std::cos(at.x / 5);
            at.feed = i % 400 < 380 ? 1000 : 0;
            program.steps.push_back(at);
        }
        const std::vector<ReplayPoint> whole = path_of(program, 12000);
        std::vector<ReplayPoint> thinned = whole;
        const double tolerance = 0.05;
        thin(thinned, tolerance);
        EXPECT_LT(thinned.size(), whole.size() / 2);
        const std::vector<ReplayPoint> at_once = path_of(program, 12000, tolerance);
        ASSERT_EQ(at_once.size(), thinned.size());
        for (std::size_t k = 0; k < thinned.size(); ++k)
            ASSERT_EQ(at_once[k].seconds, thinned[k].seconds) << k;
        EXPECT_EQ(thinned.front().x, whole.front().x);
        EXPECT_EQ(thinned.back().seconds, whole.back().seconds);
        std::size_t next = 1;
        for (std::size_t k = 1; k + 1 < whole.size(); ++k) {
            while (thinned[next].seconds < whole[k].seconds) ++next;
            const ReplayPoint &a = thinned[next - 1], &b = thinned[next], &p = whole[k];
            EXPECT_EQ(b.rapid, p.rapid) << k;
            const double ux = b.x - a.x, uy = b.y - a.y, uz = b.z - a.z, uu = ux * ux + uy * uy + uz * uz;
            const double t =
                std::clamp(((p.x - a.x) * ux + (p.y - a.y) * uy + (p.z - a.z) * uz) / uu, 0.0, 1.0);
            ASSERT_LE(std::hypot(p.x - a.x - t * ux, p.y - a.y - t * uy, p.z - a.z - t * uz),
                      tolerance + 1e-9)
                << k;
        }
    }
}

TEST(ReportOutlines, EveryPointLeftOutLiesNearTheOutline) {
    std::mt19937_64 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < 50; ++round) {
        const std::size_t n = 3 + random() % 400;
        const double waves = 1 + 8 * unit(random), begin = 6 * unit(random), deep = 10 * unit(random);
        std::vector<Point2> loop;
        for (std::size_t i = 0; i < n; ++i) {
            const double a = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n),
                         r = 60 + deep * std::sin(waves * a + begin) + 0.02 * unit(random);
            loop.push_back({to_units(r * std::cos(a)), to_units(0.7 * r * std::sin(a))});
        }
        const std::vector<std::int64_t> drawn = outline(loop);
        ASSERT_EQ(drawn.size() % 2, 0u);
        ASSERT_LE(drawn.size(), 2 * n);
        const std::size_t corners = drawn.size() / 2;
        const auto at = [&](std::size_t k) {
            const std::size_t c = k % corners;
            return std::array<double, 2>{static_cast<double>(drawn[2 * c]) / kHundredths,
                                         static_cast<double>(drawn[2 * c + 1]) / kHundredths};
        };
        for (const Point2 p : loop) {
            double nearest = std::numeric_limits<double>::infinity();
            for (std::size_t k = 0; k < corners; ++k) {
                const std::array<double, 2> a = at(k), b = at(k + 1);
                const double ux = b[0] - a[0], uy = b[1] - a[1], wx = to_mm(p.x) - a[0],
                             wy = to_mm(p.y) - a[1], uu = ux * ux + uy * uy,
                             t = uu > 0 ? std::clamp((wx * ux + wy * uy) / uu, 0.0, 1.0) : 0;
                nearest = std::min(nearest, std::hypot(wx - t * ux, wy - t * uy));
            }
            ASSERT_LE(nearest, kOutlineTolerance + 1 / kHundredths) << "round " << round;
        }
    }
}

// A layer of 50 mm from a slab half a millimetre thicker, without programs yet.
SimulationInput one_layer(const PatternMesh& pattern) {
    SimulationInput input;
    input.mesh = pattern.mesh.view();
    input.stock_min = {-80, -80}, input.stock_max = {80, 80};
    input.layers.push_back({0, 50, 50.5, {}});
    input.tools = Job().tools;
    return input;
}

TEST(Replay, AStraightSlotIsAsDeepAndAsWideAsItIs) {
    Context context;
    const PatternMesh stl = read_pattern_mesh(context, kStl);
    SimulationInput input = one_layer(stl);
    ReplayOptions options;
    options.cell = 0.5;
    options.pieces = 20;
    const auto slot = [](double z) {
        Program program;
        program.tool = 2;
        program.spindle_rpm = 18000;
        for (const double x : {-100.0, 100.0}) program.steps.push_back({x, 70, z, 3000, 1, true});
        return program;
    };
    Replay replay(context, input, options);
    const ReplayedProgram found = replay.run(slot(47.5));
    EXPECT_NEAR(found.seconds, 4, 1e-9);
    EXPECT_NEAR(found.removed_mm3, 160 * 12.7 * 3, 0.05 * 160 * 12.7 * 3);
    ASSERT_FALSE(found.pieces.empty());
    const ReplayPiece& middle = found.pieces[found.pieces.size() / 2];
    EXPECT_NEAR(middle.depth_mm, 3, 1e-4);
    EXPECT_NEAR(middle.width_mm, 12.7 * 160 / 200,
                1.5);  // one motion: the way includes what is outside the slab
    EXPECT_GT(middle.force_n, 1);
    EXPECT_GT(middle.deflection_mm, 0);
    // A second pass on the same way finds nothing.
    const ReplayedProgram again = replay.run(slot(47.5));
    EXPECT_EQ(again.removed_mm3, 0);
    for (const ReplayPiece& piece : again.pieces) EXPECT_EQ(piece.force_n, 0);
    // What is left stands over the layer's bottom beside the pattern: where the slot went 47.5, elsewhere the
    // slab's top.
    std::vector<float> left, surface;
    replay.finished(StandingPart(context, input.mesh), [&](std::size_t layer, const ReplayedLayer& of) {
        if (layer != 0) return;
        left = of.left;
        surface = of.surface;
    });
    const auto at = [&](double x, double y) {
        const auto i = static_cast<std::size_t>(std::lround((x - replay.first()[0]) / options.cell)),
                   j = static_cast<std::size_t>(std::lround((y - replay.first()[1]) / options.cell));
        return left[j * static_cast<std::size_t>(replay.nx()) + i];
    };
    EXPECT_NEAR(at(60, 70), 47.5, 17.5);  // never more than stands there, and no nearer than the sphere is
    EXPECT_LT(at(0, 70), at(0, 78) + 3);
    // Wood as cut: the slab's top but in the slot.
    EXPECT_NEAR(*std::min_element(surface.begin(), surface.end()), 47.5, 1e-4);
    EXPECT_NEAR(surface.front(), 50.5, 1e-4);
    EXPECT_THROW(Replay(context, input, {.cell = 0, .material = {}}), Error);
}

// Edges press on the wood however little they take: a cut's force grows with its feed from the least on. A
// spindle at rest has none.
TEST(Replay, EveryCutHasAForceHoweverSlowItIs) {
    Context context;
    const PatternMesh stl = read_pattern_mesh(context, kStl);
    SimulationInput input = one_layer(stl);
    const auto force = [&](double feed, double rpm) {
        Program program;
        program.tool = 2;
        program.spindle_rpm = rpm;
        for (const double x : {-100.0, 100.0}) program.steps.push_back({x, 70, 47.5, feed, 1, true});
        Replay replay(context, input, {});
        return replay.run(program).pieces.back().force_n;
    };
    double slower = 0;
    for (const double feed : {0.5, 1.0, 30.0, 3000.0}) {
        const double found = force(feed, 18000);
        EXPECT_GT(found, slower) << feed;
        slower = found;
    }
    EXPECT_EQ(force(3000, 0), 0);
}

TEST(Report, HoldsWhatLiesInTheFolder) {
    if (!reports_are_built()) {
        std::printf("skipped: the report was not built\n");
        return;
    }
    TemporaryFolder folder;
    const std::string out = folder / "out";
    Context one({.threads = 1}), four({.threads = 4});
    const Plan planned = plan(one, kStl, quick_job());
    write(one, planned, out, kStl);
    const std::string page = slurp(fs::path(out) / "report.html");
    ASSERT_FALSE(page.empty());
    EXPECT_LT(page.size(), 10'000'000u);
    // No byte depends on the number of threads, nor on whether plan or report wrote it.
    EXPECT_EQ(page, report_html(four, out, {kStl}));
    const json data = data_of(page);
    EXPECT_EQ(data["plan"], json::parse(slurp(fs::path(out) / "plan.json")));
    EXPECT_TRUE(data["verify"].is_null());
    EXPECT_EQ(data["paths"]["programs"].size(), static_cast<std::size_t>(planned.totals.operations));
    EXPECT_EQ(data["outlines"]["layers"].size(), planned.layers.size());
    // The half sphere's 2πr² and its base, over 2500 places.
    const double radius = (planned.input.max[0] - planned.input.min[0]) / 2;
    EXPECT_NEAR(data["model"]["reach_cell_mm"].get<double>(),
                std::sqrt(3 * std::numbers::pi * radius * radius / 2500), 0.02);
    EXPECT_EQ(data["left_over"]["layers"].size(), planned.layers.size());
    // A dome draws well; each facet of its picture has a code that says so.
    EXPECT_EQ(data["draw"]["limits"]["draft_deg"], 1);
    EXPECT_EQ(data["draw"]["undercut_to_draw"]["places"], 0);
    const std::string codes = data["model"]["draw"];
    EXPECT_EQ(codes.size(), (data["model"]["facets"].get<std::size_t>() + 2) / 3 * 4) << "of base64";
    EXPECT_EQ(codes.find_first_not_of("A="), std::string::npos);
    // Nothing asks for a network.
    for (const char* asks : {"src=\"http", "href=\"http", "url(http", "@import", "fetch("})
        EXPECT_EQ(page.find(asks), std::string::npos) << asks;

    (void)verify(one, out, kStl);
    report(one, out, kStl, false);
    const std::string light = slurp(fs::path(out) / "report.html");
    const json seen = data_of(light);
    EXPECT_EQ(seen["verify"], json::parse(slurp(fs::path(out) / "verify.json")));
    EXPECT_FALSE(seen.contains("model"));
    EXPECT_EQ(light.find("<canvas"), std::string::npos);
    EXPECT_LT(light.size(), 1'000'000u);
    report(one, out, kStl);
    EXPECT_TRUE(data_of(slurp(fs::path(out) / "report.html")).contains("model"))
        << "where nothing else is asked";
    // What verification has read makes the same page as what the report reads.
    const std::string checked = folder / "checked";
    (void)write_verified(one, planned, checked, kStl, 0.5);
    EXPECT_EQ(slurp(fs::path(checked) / "report.html"), report_html(four, checked, {kStl}));
    // Without the pattern's path no page is written, and the rest is.
    write(one, planned, folder / "bare");
    EXPECT_FALSE(fs::exists(folder.path / "bare/report.html"));
    EXPECT_TRUE(fs::exists(folder.path / "bare/plan.json"));
}

TEST(Report, NothingInAPlanEndsTheScriptThatCarriesIt) {
    if (!reports_are_built()) {
        std::printf("skipped: the report was not built\n");
        return;
    }
    TemporaryFolder folder;
    const std::string out = folder / "out", name = "</script><script>alert(1)<";
    const std::string odd = folder / "odd.stl";
    fs::copy_file(kStl, odd);
    Context context;
    Plan planned = plan(context, odd, quick_job());
    planned.layers.front().reason = name;
    write(context, planned, out, odd);
    const std::string page = slurp(fs::path(out) / "report.html");
    EXPECT_EQ(page.find("alert(1)<"), std::string::npos);
    EXPECT_EQ(data_of(page)["plan"]["layers"][0]["reason"], name);
}

TEST(AssemblyPage, HoldsBothDocumentsAndEachWayOfEachProgram) {
    if (!reports_are_built()) {
        std::printf("skipped: the report was not built\n");
        return;
    }
    std::mt19937 random(test::seed());
    json sheets, verdict;
    sheets["name"] = "</script> & <!--";
    verdict["passed"] = true;
    for (std::size_t count = 0; count < 5; ++count) {
        std::vector<ReadSheetProgram> programs(count);
        json expected = json::array();
        for (ReadSheetProgram& program : programs) {
            program.thickness = 6;
            json ways = json::array();
            for (std::size_t k = random() % 4; k-- > 0;) {
                // From the way in to a polygon, all of whose corners are seen.
                ReadWay& way = program.ways.emplace_back();
                way.piece = static_cast<int>(random() % 9), way.pass = static_cast<int>(random() % 3);
                way.is_hole = random() % 2 == 0;
                way.points.push_back({500, 500});
                const int corners = 3 + static_cast<int>(random() % 9);
                json ends = json::array();
                for (int i = 0; i <= corners; ++i) {
                    const double turn = 2 * std::numbers::pi * (i % corners) / corners,
                                 x = 80 + 20 * std::cos(turn), y = 60 + 20 * std::sin(turn);
                    way.points.push_back({x, y});
                    if (i == corners) continue;
                    ends.push_back(std::llround(100 * x)), ends.push_back(std::llround(100 * y));
                }
                ways.push_back({{"piece", way.piece},
                                {"pass", way.pass},
                                {"hole", way.is_hole},
                                {"top", ends},
                                {"bottom", ends}});
            }
            expected.push_back(ways);
        }
        const json data = data_of(assembly_html(sheets.dump(), verdict.dump(), programs));
        EXPECT_EQ(data["sheets"], sheets);
        EXPECT_EQ(data["verify"], verdict);
        EXPECT_EQ(data["ways"], expected);
    }
}

TEST(Report, RefusesWhatItCannotUnderstand) {
    if (!reports_are_built()) {
        std::printf("skipped: the report was not built\n");
        return;
    }
    TemporaryFolder folder;
    const std::string out = folder / "out";
    Context context;
    write(context, plan(context, kStl, quick_job()), out);
    const fs::path plan_file = fs::path(out) / "plan.json";
    const std::string text = slurp(plan_file);
    const auto code = [&](const ReportOptions& options = {kStl}) -> std::string {
        try {
            (void)report_html(context, out, options);
        } catch (const Error& error) {
            EXPECT_FALSE(error.message().empty());
            return error.code();
        }
        return "none";
    };
    EXPECT_EQ(code(), "none");
    spit(plan_file, "{");
    EXPECT_EQ(code(), "report.plan");
    spit(plan_file, R"({"schema": "slabwright.plan/2"})");
    EXPECT_EQ(code(), "report.plan");
    json broken = json::parse(text);
    broken["layers"][0].erase("z_top");
    spit(plan_file, broken.dump());
    EXPECT_EQ(code(), "report.plan");
    broken = json::parse(text);
    broken["layers"][0]["operations"][0]["file"] = "nc/../../secret";
    spit(plan_file, broken.dump());
    EXPECT_EQ(code(), "report.plan");
    spit(plan_file, text);
    EXPECT_EQ(code({support::checkout("tests/data/pump-cover.stl")}), "report.other_pattern");
    EXPECT_EQ(code({folder / "missing.stl"}), "stl.missing");
    EXPECT_EQ(code({kStl, true, 0.2}), "report.size_limit");
    EXPECT_EQ(code({kStl, true, -1}), "report.size_limit");
    const std::string first = json::parse(text)["layers"][0]["operations"][0]["file"];
    const std::string program = slurp(fs::path(out) / first);
    spit(fs::path(out) / first, "G1 X\n");
    EXPECT_EQ(code(), "report.program");
    fs::remove(fs::path(out) / first);
    EXPECT_EQ(code(), "report.program");
    spit(fs::path(out) / first, program);
    spit(fs::path(out) / "verify.json", "no");
    EXPECT_EQ(code(), "report.verify");
    fs::remove(fs::path(out) / "verify.json");
    EXPECT_EQ(code(), "none");
}

}  // namespace
}  // namespace slabwright
