// A plan does not depend on where its pattern lies: moved, it is the same plan moved; turned, mirrored or
// with a little noise, it passes as the pattern does, in about its time. SLABWRIGHT_SOAK=N tries N more, of
// the corpus' castings and pool too where SLABWRIGHT_CORPUS names them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "engine/planner/planner.h"
#include "io/read/pattern_mesh.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/data/luo_layer_sample.h"
#include "tests/data/models.h"
#include "tests/mesh_shapes.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;

namespace {

Job lenient() {
    Job job;
    job.allow_undercut = true;
    job.bonding.accept_weak = true;
    return job;
}

/// What is done to a pattern before it is planned.
struct Placing {
    double dx = 0, dy = 0;  // mm
    int quarter_turns = 0;
    double turn = 0;        // radians, about z
    bool mirrored = false;  // in x
    double noise = 0;       // mm, in x and y
};

/// Vertices that are one stay one.
Mesh placed(const Mesh& mesh, const Placing& placing, std::mt19937& random) {
    std::uniform_real_distribution<double> noise(-1, 1);
    Mesh moved = mesh;
    for (Vec3f& p : moved.vertices) {
        double x = p.x, y = p.y;
        if (placing.mirrored) x = -x;
        for (int k = 0; k < placing.quarter_turns; ++k) {
            const double turned = -y;
            y = x, x = turned;
        }
        if (placing.turn != 0) {
            const double c = std::cos(placing.turn), s = std::sin(placing.turn), turned = c * x - s * y;
            y = s * x + c * y, x = turned;
        }
        p.x = static_cast<float>(x + placing.dx + placing.noise * noise(random));
        p.y = static_cast<float>(y + placing.dy + placing.noise * noise(random));
    }
    if (placing.mirrored)
        for (Index3& facet : moved.facets) std::swap(facet[1], facet[2]);
    return moved;
}

struct Verdict {
    std::string how;  // "passed", the first violation's code, or the refusal's
    double minutes = 0;
};

Verdict verdict(const Mesh& mesh, const Job& job) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "part.stl";
    write_stl(stl, mesh);
    try {
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
        Plan planned = plan(context, *pattern, job);
        const VerifyResult result = write_proven(context, planned, folder / "out", pattern, true);
        return {result.violations.empty() ? "passed" : result.violations.front().code,
                planned.totals.build_minutes};
    } catch (const Error& e) {
        return {e.code(), 0};
    }
}

void expect_indifference(const std::string& name, const Mesh& mesh, const Job& job, const Placing& placing,
                         const Verdict& as_it_lies, std::mt19937& random) {
    const Verdict found = verdict(placed(mesh, placing, random), job);
    std::printf("%s: turns %d turn %.3f mirrored %d noise %g at %.2f %.2f: %s %.2f min (%.2f)\n",
                name.c_str(), placing.quarter_turns, placing.turn, placing.mirrored ? 1 : 0, placing.noise,
                placing.dx, placing.dy, found.how.c_str(), found.minutes, as_it_lies.minutes);
    std::fflush(stdout);
    EXPECT_EQ(found.how, as_it_lies.how) << name;
    if (placing.turn != 0) return;  // askew it takes a larger stock
    // What lies the other way is cut on other lines.
    const double share = placing.quarter_turns % 2 != 0 ? 0.1 : placing.mirrored ? 0.05 : 0.03;
    EXPECT_NEAR(found.minutes, as_it_lies.minutes, share * as_it_lies.minutes) << name;
}

Placing random_placing(std::size_t k, std::mt19937& random) {
    const double far = std::pow(10, std::uniform_real_distribution<double>(0, 5)(random));
    const double angle = std::uniform_real_distribution<double>(0, 6.28)(random);
    Placing placing;
    // A float tells a few micrometres there, which is noise.
    if (k % 4 == 0) placing.dx = far * std::cos(angle), placing.dy = far * std::sin(angle);
    if (k % 4 == 1) placing.noise = 1e-3 * std::uniform_real_distribution<double>(0.1, 1)(random);
    if (k % 8 == 2) placing.quarter_turns = 1 + static_cast<int>(random() % 3);
    if (k % 8 == 6) placing.turn = std::uniform_real_distribution<double>(0.01, 6.27)(random);
    if (k % 4 == 3) placing.mirrored = true;
    return placing;
}

}  // namespace

// To the last bit, where the move is exact.
TEST(Place, APlanMovesWithItsPattern) {
    Context context;
    Mesh mesh = weld(context, luo_layer_sample());
    for (Vec3f& p : mesh.vertices) p.x = std::round(p.x * 64) / 64, p.y = std::round(p.y * 64) / 64;
    InputInfo input;
    input.file = "part.stl";
    const Plan plan = make_plan(context, mesh, input, lenient());
    std::mt19937 random(test::seed());
    for (const double far : {3000.0, 1e5}) {
        std::uniform_real_distribution<double> way(-far, far);
        Placing placing;
        placing.dx = std::round(way(random) * 16) / 16, placing.dy = std::round(way(random) * 16) / 16;
        const Plan moved = make_plan(context, placed(mesh, placing, random), input, lenient());
        const std::int32_t dx = to_units(placing.dx), dy = to_units(placing.dy);
        EXPECT_EQ(moved.totals.build_minutes, plan.totals.build_minutes);
        EXPECT_EQ(moved.stock_min[0], plan.stock_min[0] + placing.dx);
        EXPECT_EQ(moved.stock_max[1], plan.stock_max[1] + placing.dy);
        ASSERT_EQ(moved.layers.size(), plan.layers.size());
        for (std::size_t l = 0; l < plan.layers.size(); ++l) {
            const Layer &a = plan.layers[l], &b = moved.layers[l];
            for (std::size_t j = 0; j < a.joints.size(); ++j) {
                EXPECT_NEAR(b.joints[j].centroid[0], a.joints[j].centroid[0] + placing.dx, 1e-6);
                ASSERT_EQ(b.joints[j].glue.points.size(), a.joints[j].glue.points.size());
                for (std::size_t k = 0; k < a.joints[j].glue.points.size(); ++k)
                    EXPECT_EQ(b.joints[j].glue.points[k].y, a.joints[j].glue.points[k].y + dy);
            }
            ASSERT_EQ(b.operations.size(), a.operations.size());
            for (std::size_t o = 0; o < a.operations.size(); ++o) {
                const std::vector<Move>&from = a.operations[o].moves, &to = b.operations[o].moves;
                ASSERT_EQ(to.size(), from.size());
                for (std::size_t k = 0; k < from.size(); ++k) {
                    Move m = from[k];
                    m.x += dx, m.y += dy;
                    ASSERT_EQ(to[k], m) << "layer " << l << " operation " << o << " move " << k;
                }
            }
        }
        ASSERT_EQ(moved.features.size(), plan.features.size());
        for (std::size_t k = 0; k < plan.features.size(); ++k)
            EXPECT_NEAR(moved.features[k].x, plan.features[k].x + placing.dx, 1e-6);
        ASSERT_EQ(moved.diagnostics.size(), plan.diagnostics.size());
        for (std::size_t k = 0; k < plan.diagnostics.size(); ++k) {
            EXPECT_EQ(moved.diagnostics[k].where.has_value(), plan.diagnostics[k].where.has_value());
            if (!plan.diagnostics[k].where) continue;
            EXPECT_NEAR((*moved.diagnostics[k].where)[1], (*plan.diagnostics[k].where)[1] + placing.dy, 1e-6);
        }
        for (std::size_t s = 0; s < plan.sequence.size(); ++s)
            for (std::size_t n = 0; n < plan.sequence[s].numbers.size(); ++n) {
                const auto& [name, number] = plan.sequence[s].numbers[n];
                const bool in_x = name == "x_mm" || name == "slab_left_mm",
                           in_y = name == "y_mm" || name == "slab_front_mm";
                EXPECT_NEAR(moved.sequence[s].numbers[n].second,
                            number + (in_x   ? placing.dx
                                      : in_y ? placing.dy
                                             : 0),
                            1e-6)
                    << name;
            }
    }
}

TEST(Place, TooFarIsRefused) {
    Context context;
    std::mt19937 random(1);
    Placing placing;
    placing.dx = 3e5;
    InputInfo input;
    try {
        (void)make_plan(context, placed(weld(context, luo_layer_sample()), placing, random), input,
                        lenient());
        FAIL() << "32 bits of 0.1 micrometres do not reach so far";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), "input.far");
    }
}

TEST(Place, TheVerdictStaysThatOfThePattern) {
    Context context;
    std::mt19937 random(test::seed());
    const std::vector<std::pair<std::string, Mesh>> models{
        {"luo-layer-sample", weld(context, luo_layer_sample())},
        {"luo-tool-sample", weld(context, luo_tool_sample())}};
    for (const auto& [name, mesh] : models) {
        const Verdict as_it_lies = verdict(mesh, lenient());
        EXPECT_EQ(as_it_lies.how, "passed") << name;
        for (const std::size_t k : {0, 1, 2, 3, 6})
            expect_indifference(name, mesh, lenient(), random_placing(k, random), as_it_lies, random);
    }
}

TEST(PlaceSoak, TheVerdictStaysThatOfThePart) {
    const char* wanted = std::getenv("SLABWRIGHT_SOAK");
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (wanted == nullptr || corpus == nullptr) {
        std::printf("skipped: SLABWRIGHT_SOAK or SLABWRIGHT_CORPUS is not set\n");
        return;
    }
    constexpr std::uintmax_t most_bytes = 350'000;  // the others take minutes each
    Context reading;
    std::map<std::string, Mesh> parts{{"luo-layer-sample", weld(reading, luo_layer_sample())},
                                      {"luo-tool-sample", weld(reading, luo_tool_sample())},
                                      {"half-sphere", weld(reading, half_sphere())},
                                      {"pump-cover", weld(reading, pump_cover())}};
    for (const char* folder : {"castings", "pool"})
        for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(corpus) / folder))
            if (entry.path().extension() == ".stl" && entry.file_size() < most_bytes)
                parts.emplace(entry.path().stem().string(), read_mesh(reading, entry.path().string()));
    std::mt19937 random(test::seed());
    std::map<std::string, Verdict> as_they_lie;
    Job job = lenient();
    job.input.repair = Repair::mend;
    for (std::size_t k = 0; k < std::strtoul(wanted, nullptr, 10); ++k) {
        const auto& [name, mesh] =
            *std::next(parts.begin(), static_cast<std::ptrdiff_t>(random() % parts.size()));
        const auto [known, first] = as_they_lie.try_emplace(name);
        if (first) known->second = verdict(mesh, job);
        expect_indifference(known->first, mesh, job, random_placing(k, random), known->second, random);
    }
}
