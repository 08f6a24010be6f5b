// A tool that is named as missing gains what is foretold: it is added to the job, and the part is planned
// again.
#include "engine/simulate/missing_tools.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include "io/slabwright.h"
#include "io/verify.h"
#include "tests/mesh_shapes.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

namespace fs = std::filesystem;
using support::TemporaryFolder;

/// Ribs on a plate, 40 mm long, with gaps between them that are as wide as given.
void write_ribs(const fs::path& path, const std::vector<float>& gaps) {
    shapes::Facets facets;
    float x = 8;
    const auto rib = [&] {
        shapes::append(facets, shapes::box({x, 5, 2}, {x + 6, 45, 14}));
        x += 6;
    };
    rib();
    for (const float gap : gaps) {
        x += gap;
        rib();
    }
    shapes::append(facets, shapes::box({0, 0, 0}, {x + 8, 50, 4}));
    std::ofstream file(path);
    file << "solid ribs\n";
    for (const auto& f : facets) {
        file << "facet normal 0 0 0\nouter loop\n";
        for (const Vec3f& v : f) file << "vertex " << v.x << ' ' << v.y << ' ' << v.z << '\n';
        file << "endloop\nendfacet\n";
    }
    file << "endsolid ribs\n";
}

Verification planned_and_verified(const std::string& stl, const Job& job, const fs::path& out) {
    Context context({.threads = 1});
    const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
    Plan made = plan(context, *pattern, job);
    (void)write_proven(context, made, out.string(), pattern, true);  // keeps what does not pass
    return verify_folder(context, out.string(), {.source = stl, .write = false});
}

/// The tool with all that a job says of one.
Job with(Job job, Tool tool) {
    tool.number = 1;
    for (const Tool& t : job.tools) tool.number = std::max(tool.number, t.number + 1);
    job.tools.push_back(tool);
    return job;
}

void expect_gain(const std::string& stl, const Job& job, const fs::path& folder, const Verification& before,
                 const MissingTool& missing) {
    SCOPED_TRACE(missing.tool.name);
    const Verification after = planned_and_verified(stl, with(job, missing.tool), folder / "again");
    EXPECT_TRUE(after.report.passed());
    const double gained = before.report.unreachable_mm2() - after.report.unreachable_mm2();
    EXPECT_NEAR(gained, missing.gain_mm2, std::max(0.05 * missing.gain_mm2, 1.0))
        << "of " << before.report.unreachable_mm2() << " mm²; " << missing.minutes << " min foretold";
    std::printf("%s: %.1f of %.1f mm² foretold, %.1f gained; %.1f min foretold, %.1f more taken\n",
                missing.tool.name.c_str(), missing.gain_mm2, before.report.unreachable_mm2(), gained,
                missing.minutes, (after.report.seconds - before.report.seconds) / 60);
}

TEST(MissingTools, GapsBetweenRibsAskForWhatFitsThem) {
    TemporaryFolder folder;
    const std::string stl = folder / "ribs.stl";
    const std::vector<float> gaps{2.6F, 3.5F, 5.2F};
    write_ribs(stl, gaps);
    Job job;
    job.allow_undercut = true;
    const Verification found = planned_and_verified(stl, job, folder.path / "out");
    ASSERT_FALSE(found.missing.empty());
    // A flat end mill gains all gaps that are wider than it.
    for (const MissingTool& m : found.missing) {
        EXPECT_EQ(m.reason, OutOfReach::radius);
        EXPECT_EQ(m.layers, std::vector<int>{0});
        EXPECT_GE(max_layer_of(job, m.tool), 14) << m.tool.name << " makes the layer thinner";
        if (m.tool.kind != ToolKind::flat) continue;
        double wide = 0;
        for (const float gap : gaps)
            if (gap > m.tool.diameter) wide += 40.0 * gap;
        // At their open ends thicker tools reach in a little.
        EXPECT_LE(m.gain_mm2, 1.02 * wide + 20) << m.tool.name;
        EXPECT_GE(m.gain_mm2, 0.85 * wide) << m.tool.name;
        EXPECT_LE(m.depth_mm, 2.7) << "half of the widest gap, along the normal";
    }
    const auto narrow = std::find_if(found.missing.begin(), found.missing.end(),
                                     [](const MissingTool& m) { return m.tool.diameter == 2.5; });
    ASSERT_NE(narrow, found.missing.end()) << "the narrowest gap has no tool";
    expect_gain(stl, job, folder.path, found, found.missing.front());
}

TEST(MissingTools, NothingIsMissingWhereAllIsReached) {
    TemporaryFolder folder;
    const std::string stl = folder / "ribs.stl";
    write_ribs(stl, {20.0F});
    Job job;
    const Verification found = planned_and_verified(stl, job, folder.path / "out");
    EXPECT_TRUE(found.missing.empty());
}

/// A casting of the corpus with the default job; none where there is no corpus.
void expect_gain_of_casting(const std::string& name, const Job& job) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr) {
        std::puts("skipped: SLABWRIGHT_CORPUS is not set");
        return;
    }
    TemporaryFolder folder;
    const std::string stl = fs::path(corpus) / "castings" / name;
    const Verification found = planned_and_verified(stl, job, folder.path / "out");
    ASSERT_FALSE(found.missing.empty());
    EXPECT_LE(found.missing.size(), 10u);
    expect_gain(stl, job, folder.path, found, found.missing.front());
}

TEST(MissingToolsCorpus, AMouldCavityGainsWhatIsForetold) {
    expect_gain_of_casting("mold_cavity_ktool.stl", {});
}

// Two minutes of planning with ever smaller tools: a soak.
TEST(MissingToolsCorpus, ACylinderHeadGainsWhatIsForetold) {
    if (std::getenv("SLABWRIGHT_SOAK") == nullptr) GTEST_SKIP() << "set SLABWRIGHT_SOAK=1; it takes minutes";
    Job job;
    job.allow_undercut = true;
    expect_gain_of_casting("wallaby_cylinder_head_casting.stl", job);
}

TEST(MissingToolsCorpus, ABearingHousingGainsWhatIsForetold) {
    Job job;
    job.allow_undercut = true;
    expect_gain_of_casting("bearing_block.stl", job);
}

}  // namespace
}  // namespace slabwright
