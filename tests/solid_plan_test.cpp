// Any solid is planned, and every plan passes its own proof: random compositions of bodies, sound patterns
// moved far away, and such with a little noise. SLABWRIGHT_SOAK=N plans N more of each, larger ones too.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "engine/job.h"
#include "io/read/pattern_mesh.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/support/compositions.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;

namespace {

std::size_t soak() {
    const char* wanted = std::getenv("SLABWRIGHT_SOAK");
    return wanted != nullptr ? std::strtoul(wanted, nullptr, 10) : 0;
}

enum class Outcome { passed, refused };

/// What a whole test saw: how many layers, and how often one of them was planned again after its proof.
struct Tally {
    std::size_t passed = 0, refused = 0, layers = 0, rounds = 0;
    double gouge_mm = 0;
};

void expect_none(const std::vector<Diagnostic>& violations, const std::string& what) {
    for (const Diagnostic& v : violations)
        ADD_FAILURE() << what << ": " << v.code << ' ' << v.message
                      << (v.where ? " at " + std::to_string((*v.where)[0]) + ' ' +
                                        std::to_string((*v.where)[1]) + ' ' + std::to_string((*v.where)[2])
                                  : std::string());
}

/// Plans and proves, as the command does; whatever the proof finds at the end is a failure. The mesh, or what
/// the job may ask for, can be a reason to refuse; that the programs did not pass is none.
Outcome plan_and_prove(const shapes::Facets& facets, const Job& job, const std::string& what, Tally& tally) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "part.stl";
    write_stl(stl, weld(context, facets));
    if (const char* keep = std::getenv("SLABWRIGHT_KEEP"); keep != nullptr)
        write_stl(std::string(keep) + "/" + what + ".stl", weld(context, facets));
    try {
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
        Plan planned = plan(context, *pattern, job);
        const VerifyResult result = write_proven(context, planned, folder / "out", pattern, true);
        expect_none(result.violations, what);
        EXPECT_TRUE(result.passed) << what;
        tally.gouge_mm = std::max(tally.gouge_mm, result.gouge_mm);
        tally.layers += planned.layers.size();
        for (const Layer& layer : planned.layers) tally.rounds += static_cast<std::size_t>(layer.rounds);
    } catch (const Error& e) {
        // Bodies that stand free and are inside out are to be mended first; parts may be too large for a job.
        EXPECT_TRUE(e.kind() == ErrorKind::input || e.kind() == ErrorKind::no_plan) << what << e.what();
        std::printf("%s is refused: %s\n", what.c_str(), e.code().c_str());
        ++tally.refused;
        return Outcome::refused;
    }
    ++tally.passed;
    return Outcome::passed;
}

Outcome plan_and_prove(const shapes::Facets& facets, const Job& job, const std::string& what) {
    Tally unused;
    return plan_and_prove(facets, job, what, unused);
}

Job lenient() {
    Job job;
    job.allow_undercut = true;
    job.bonding.accept_weak = true;
    return job;
}

/// A dome on a stepped plate, with a pocket: what an ordinary pattern is made of.
shapes::Facets pattern() {
    shapes::Facets facets = shapes::box({0, 0, 0}, {46, 38, 6});
    std::mt19937 random(7);
    constexpr int n = 24, rings = 8;
    const auto at = [&](int k, int j) {
        const double u = 2 * std::numbers::pi * (k % n) / n, v = std::numbers::pi / 2 * j / rings;
        const double r = j == rings ? 0 : 13 * std::cos(v);
        return Vec3f{static_cast<float>(23 + r * std::cos(u)), static_cast<float>(19 + r * std::sin(u)),
                     static_cast<float>(4 + 16 * std::sin(v))};
    };
    for (int k = 0; k < n; ++k) {
        facets.push_back({Vec3f{23, 19, 4}, at(k + 1, 0), at(k, 0)});
        for (int j = 0; j < rings; ++j) {
            facets.push_back({at(k, j), at(k + 1, j), at(k + 1, j + 1)});
            if (j + 1 < rings) facets.push_back({at(k, j), at(k + 1, j + 1), at(k, j + 1)});
        }
    }
    return facets;
}

}  // namespace

TEST(AnySolid, IsPlannedAndPassesItsProof) {
    const std::size_t more = soak();
    const std::uint32_t first = test::seed();
    constexpr std::size_t usual = 40;
    Tally tally;
    for (std::size_t i = 0; i < usual + more; ++i) {
        const std::uint32_t seed = first + static_cast<std::uint32_t>(i);
        std::mt19937 random(seed);
        test::CompositionOptions options;
        options.most = i < usual ? 6 : 12;
        options.size =
            i < usual ? 42 : 50 * std::pow(22, std::uniform_real_distribution<double>(0, 1)(random));
        Job job = lenient();
        if (i % 2 == 1) job.input.repair = Repair::mend;  // turns bodies that are inside out
        plan_and_prove(test::Composer(random, options).facets(), job, "composition_" + std::to_string(seed),
                       tally);
    }
    std::printf("%zu passed, %zu refused as meshes; %zu rounds in %zu layers; worst gouge %.4f mm\n",
                tally.passed, tally.refused, tally.rounds, tally.layers, tally.gouge_mm);
    EXPECT_GE(tally.passed, tally.refused) << "most are refused";
    EXPECT_LE(tally.gouge_mm, 0.01);
}

TEST(APattern, PassesItsProofWhereverItLies) {
    std::mt19937 random(test::seed());
    for (std::size_t i = 0; i < 3 + soak(); ++i) {
        const double far = std::pow(10, std::uniform_real_distribution<double>(3, 5)(random));
        const double angle = std::uniform_real_distribution<double>(0, 2 * std::numbers::pi)(random);
        shapes::Facets facets = pattern();
        for (auto& f : facets)
            for (Vec3f& p : f) {
                p.x = static_cast<float>(p.x + far * std::cos(angle));
                p.y = static_cast<float>(p.y + far * std::sin(angle));
            }
        plan_and_prove(facets, lenient(), "moved_" + std::to_string(static_cast<int>(far)));
    }
}

TEST(APattern, PassesItsProofWithNoise) {
    std::mt19937 random(test::seed());
    for (std::size_t i = 0; i < 3 + soak(); ++i) {
        const double most = std::pow(10, std::uniform_real_distribution<double>(-5, -3)(random));
        std::uniform_real_distribution<double> noise(-most, most);
        Context context;
        Mesh mesh = weld(context, pattern());
        for (Vec3f& p : mesh.vertices) {
            p.x = static_cast<float>(p.x + noise(random));
            p.y = static_cast<float>(p.y + noise(random));
            if (p.z > 0) p.z = static_cast<float>(p.z + noise(random));
        }
        shapes::Facets facets;
        for (const Index3& t : mesh.facets)
            facets.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
        plan_and_prove(facets, lenient(), "noise_" + std::to_string(i));
    }
}

// Jobs at the edge of what they may ask for.
TEST(APattern, PassesItsProofWithNoAllowanceNoMarginAndShortFlutes) {
    Job allowance = lenient();
    allowance.cutting.wall_allowance = 0;
    plan_and_prove(pattern(), allowance, "no_wall_allowance");
    Job margin = lenient();
    margin.slabs.margin = 0;
    plan_and_prove(pattern(), margin, "no_margin");
    Job flutes = lenient();
    for (Tool& tool : flutes.tools)
        if (tool.kind != ToolKind::face) tool.flute_length = std::min(tool.flute_length, 12.0);
    plan_and_prove(pattern(), flutes, "short_flutes");
}

// The box of the first is 8 cm³, and the second lies in it by half.
TEST(AnySolid, SaysThatBodiesOverlapAndCountsWhatTheyShareOnce) {
    shapes::Facets facets = shapes::box({0, 0, 0}, {20, 20, 20});
    shapes::append(facets, shapes::box({10, 5, 0}, {30, 15, 20}));
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "part.stl";
    write_stl(stl, weld(context, facets));
    const std::string told = inspect(context, stl, Job{});
    EXPECT_NE(told.find("mesh.overlap"), std::string::npos);
    EXPECT_NE(told.find("\"volume_mm3\": 10000"), std::string::npos) << told;
    write_stl(stl, weld(context, shapes::box({0, 0, 0}, {20, 20, 20})));
    EXPECT_EQ(inspect(context, stl, Job{}).find("mesh.overlap"), std::string::npos);
}
