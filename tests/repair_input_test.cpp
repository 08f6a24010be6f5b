// A repair as the library and the command offer it: refused without, told with, and the same solid for who
// verifies.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "io/read/pattern_mesh.h"
#include "io/read/repair.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "kernels/repair/repair.h"
#include "tests/mesh_shapes.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using shapes::Facets;
using support::slurp;
using support::TemporaryFolder;

void save(const std::string& path, const Facets& facets) {
    Context context({.threads = 1});
    write_stl(path, weld(context, facets));
}

/// A block off the origin whose right side stands a little off.
Facets cracked(float width = .02F) {
    Facets facets = shapes::box({10, 20, 5}, {70, 50, 25});
    for (auto& f : facets) {
        if (f[0].x == 70 && f[1].x == 70 && f[2].x == 70)
            for (Vec3f& v : f) v.x += width;
    }
    return facets;
}

Facets open_torus() {
    Facets facets = shapes::torus(48, 15, 5), kept;
    for (const auto& f : facets) {
        const float x = (f[0].x + f[1].x + f[2].x) / 3, y = (f[0].y + f[1].y + f[2].y) / 3;
        const float z = (f[0].z + f[1].z + f[2].z) / 3;
        if ((x - 20) * (x - 20) + y * y + z * z > 3 * 3) kept.push_back(f);
    }
    return kept;
}

const Diagnostic* find(const std::vector<Diagnostic>& all, const std::string& code) {
    for (const Diagnostic& d : all)
        if (d.code == code) return &d;
    return nullptr;
}

Error refusal(const std::string& path, const ReadingOptions& options = {}) {
    Context context({.threads = 1});
    try {
        require_solid(context, read_pattern_mesh(context, path, options), path);
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << "was not refused";
    return {ErrorKind::input, "", ""};
}

TEST(RepairInput, TheRefusalSaysWhatARepairWouldDo) {
    const TemporaryFolder folder;
    save(folder / "cracked.stl", cracked());
    const Error error = refusal(folder / "cracked.stl");
    EXPECT_EQ(error.code(), "stl.open");
    EXPECT_NE(error.remedy().find("--repair would close 1 crack of at most 0.02 mm"), std::string::npos)
        << error.remedy();
    Facets turned = shapes::torus(24, 60, 20);
    for (std::size_t f = 0; f < 20; ++f) std::swap(turned[f][0], turned[f][1]);
    save(folder / "turned.stl", turned);
    EXPECT_NE(refusal(folder / "turned.stl").remedy().find("--repair would turn over 1 patch"),
              std::string::npos);
    save(folder / "open.stl", open_torus());
    EXPECT_NE(refusal(folder / "open.stl").remedy().find("only --repair=rebuild would close it"),
              std::string::npos);
    const Error left = refusal(folder / "open.stl", {.repair = Repair::mend});
    EXPECT_EQ(left.code(), "repair.open");
    EXPECT_NE(left.message().find("1 hole"), std::string::npos) << left.message();
    EXPECT_NE(left.remedy().find("--repair=rebuild"), std::string::npos);
}

TEST(RepairInput, WhatIsMendedIsTold) {
    const TemporaryFolder folder;
    save(folder / "cracked.stl", cracked());
    Context context({.threads = 2});
    const PatternMesh stl = read_pattern_mesh(context, folder / "cracked.stl", {.repair = Repair::mend});
    require_solid(context, stl, "cracked.stl");
    ASSERT_TRUE(stl.input.repair.has_value());
    EXPECT_EQ(stl.input.repair->how, "mend");
    ASSERT_EQ(stl.input.repair->defects.size(), 1u);
    EXPECT_EQ(stl.input.repair->defects[0].kind, "crack");
    EXPECT_NEAR(stl.input.repair->defects[0].size, .02, 1e-5);
    EXPECT_EQ(stl.input.repair->defects[0].unit, "mm");
    EXPECT_EQ(stl.input.triangles, 12u) << "of the file";
    const Diagnostic* crack = find(stl.diagnostics, "repair.crack");
    ASSERT_NE(crack, nullptr);
    EXPECT_EQ(crack->severity, Severity::warning);
    EXPECT_TRUE(crack->where.has_value());
    EXPECT_EQ(find(stl.diagnostics, "mesh.open"), nullptr) << "what is mended is no fault any more";
    save(folder / "good.stl", shapes::box({0, 0, 0}, {10, 10, 10}));
    const PatternMesh good = read_pattern_mesh(context, folder / "good.stl", {.repair = Repair::mend});
    ASSERT_TRUE(good.input.repair.has_value());
    EXPECT_EQ(good.input.repair->how, "none");
    EXPECT_TRUE(good.input.repair->defects.empty());
}

TEST(RepairInput, AMeshThatNeedsNoneKeepsItsBytes) {
    const TemporaryFolder folder;
    std::ofstream(folder / "good.stl")
        << "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 9 0\nvertex 9 0 "
           "0\nendloop\nendfacet\n"
           "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 0 9\nendloop\nendfacet\n"
           "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 9\nvertex 0 9 0\nendloop\nendfacet\n"
           "facet normal 0 0 0\nouter loop\nvertex 9 0 0\nvertex 0 9 0\nvertex 0 0 9\nendloop\nendfacet\n"
           "endsolid a\n";
    Context context({.threads = 1});
    EXPECT_EQ(repair(context, folder / "good.stl", folder / "out.stl", Job{}).repair.how, "none");
    EXPECT_EQ(slurp(folder / "out.stl"), slurp(folder / "good.stl"));
}

TEST(RepairInput, ASolidIsWrittenInTheUnitAndPlaceOfItsFile) {
    const TemporaryFolder folder;
    save(folder / "cracked.stl", cracked(.005F));
    for (const LengthUnit units : {LengthUnit::mm, LengthUnit::inch}) {
        Context context({.threads = 2});
        Job job;
        job.units = units;
        const RepairResult result = repair(context, folder / "cracked.stl", folder / "out.stl", job);
        EXPECT_EQ(result.repair.how, "mend");
        EXPECT_NE(find(result.diagnostics, "repair.crack"), nullptr);
        const PatternMesh stl = read_pattern_mesh(context, folder / "out.stl", {.units = units});
        require_solid(context, stl, "out.stl");
        const double inch = units == LengthUnit::inch ? kInch : 1;
        EXPECT_NEAR(stl.input.min[0], 10 * inch, 1e-3);
        EXPECT_NEAR(stl.input.min[2], 5 * inch, 1e-3);
        EXPECT_NEAR(stl.report.volume_mm3, result.volume_mm3, 1e-5 * result.volume_mm3);
        // What was mended needs nothing, so it is copied.
        EXPECT_EQ(repair(context, folder / "out.stl", folder / "again.stl", job).repair.how, "none");
        EXPECT_EQ(slurp(folder / "again.stl"), slurp(folder / "out.stl"));
    }
}

TEST(RepairInput, APlanOfARepairedPatternIsVerifiedAgainstTheSameSolid) {
    const TemporaryFolder folder;
    save(folder / "cracked.stl", cracked());
    Context context({.threads = 2});
    Job job;
    EXPECT_THROW((void)plan(context, folder / "cracked.stl", job), Error);
    job.input.repair = Repair::mend;
    const Plan result = plan(context, folder / "cracked.stl", job);
    EXPECT_NE(find(result.diagnostics, "repair.crack"), nullptr);
    write(context, result, folder / "out");
    const nlohmann::json json = nlohmann::json::parse(slurp((folder / "out") + "/plan.json"));
    EXPECT_EQ(json["job"]["input"]["repair"], "mend");
    EXPECT_EQ(json["input"]["repair"]["how"], "mend");
    EXPECT_EQ(json["input"]["repair"]["defects"][0]["kind"], "crack");
    EXPECT_TRUE(verify(context, folder / "out", folder / "cracked.stl").passed);
}

TEST(RepairInput, RebuildingTellsItsCellAndDeviation) {
    const TemporaryFolder folder;
    save(folder / "open.stl", open_torus());
    Context context({.threads = 2});
    const PatternMesh stl = read_pattern_mesh(context, folder / "open.stl", {.repair = Repair::rebuild});
    require_solid(context, stl, "open.stl");
    ASSERT_TRUE(stl.input.repair.has_value());
    EXPECT_EQ(stl.input.repair->how, "rebuild");
    EXPECT_GT(stl.input.repair->cell_mm, 0);
    EXPECT_GT(stl.input.repair->deviation_mm, stl.input.repair->missed_mm) << "it spans the hole";
    EXPECT_LT(stl.input.repair->missed_mm, .3);
    EXPECT_NE(find(stl.diagnostics, "repair.rebuilt"), nullptr);
    // Where mending is enough, nothing is rebuilt.
    save(folder / "cracked.stl", cracked());
    EXPECT_EQ(
        read_pattern_mesh(context, folder / "cracked.stl", {.repair = Repair::rebuild}).input.repair->how,
        "mend");
    // A soup encloses nothing.
    Facets soup;
    for (int i = 0; i < 40; ++i) {
        const auto at = static_cast<float>(i);
        soup.push_back({Vec3f{20 * at, 0, at}, Vec3f{20 * at + 3, 1, 0}, Vec3f{20 * at, 4, 2}});
    }
    save(folder / "soup.stl", soup);
    try {
        (void)read_pattern_mesh(context, folder / "soup.stl", {.repair = Repair::rebuild});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "repair.nothing") << error.what();
    }
}

TEST(RepairInput, TheCommandRefusesMendsAndTells) {
    const TemporaryFolder folder;
    save(folder / "cracked.stl", cracked());
    const auto run = [](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), support::built_command());
        return support::run_command(arguments);
    };
    const auto refused = run({"plan", folder / "cracked.stl", "-o", folder / "out"});
    EXPECT_EQ(refused.exit, 3);
    EXPECT_NE(refused.err.find("--repair would close 1 crack"), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
    const auto planned =
        run({"plan", folder / "cracked.stl", "-o", folder / "out", "--repair", "--no-verify"});
    EXPECT_EQ(planned.exit, 0) << planned.err;
    EXPECT_NE(planned.out.find("the repair closed 1 crack of at most 0.02 mm"), std::string::npos)
        << planned.out;
    EXPECT_EQ(run({"plan", folder / "cracked.stl", "-o", folder / "out", "--repair=wrong"}).exit, 2);
    const auto mended = run({"repair", folder / "cracked.stl", "-o", folder / "mended.stl"});
    EXPECT_EQ(mended.exit, 0) << mended.err;
    EXPECT_NE(mended.out.find("mended, 12 facets"), std::string::npos) << mended.out;
    const auto again = run({"repair", folder / "mended.stl", "-o", folder / "again.stl", "--json"});
    EXPECT_EQ(again.exit, 0);
    EXPECT_EQ(nlohmann::json::parse(again.out)["repair"]["how"], "none");
    EXPECT_EQ(slurp(folder / "again.stl"), slurp(folder / "mended.stl"));
    save(folder / "open.stl", open_torus());
    EXPECT_EQ(run({"repair", folder / "open.stl", "-o", folder / "never.stl"}).exit, 3);
    EXPECT_FALSE(std::filesystem::exists(folder / "never.stl"));
}

// Whether borders that hang together loosely close must not hang on how the part is turned and scaled.
TEST(RepairInput, AMeshThatIsMendedIsMendedTurnedAndScaledToo) {
    const char* folder = std::getenv("SLABWRIGHT_CORPUS");
    const std::string file = std::string(folder == nullptr ? "" : folder) + "/pool/yaskawa_13.stl";
    if (folder == nullptr || !std::filesystem::exists(file)) {
        std::printf("skipped: SLABWRIGHT_CORPUS is not set\n");
        return;
    }
    Context context({.threads = 2});
    const PatternMesh stl = read_pattern_mesh(context, file);
    for (const auto& [degrees, scale] : {std::pair{95.26, 1.0609}, {48.37, 1.0609}, {84.98, 0.4042}}) {
        SCOPED_TRACE(degrees);
        Mesh mesh = stl.mesh;
        mesh.roles.clear();
        const double c = std::cos(degrees * 3.14159265358979 / 180),
                     s = std::sin(degrees * 3.14159265358979 / 180);
        for (Vec3f& v : mesh.vertices)
            v = {static_cast<float>(scale * (c * v.x - s * v.y)),
                 static_cast<float>(scale * (s * v.x + c * v.y)), static_cast<float>(scale * v.z)};
        const MeshReport report = report_mesh(context, mesh.view());
        const Mended mended = mend(context, mesh.view(), report);
        EXPECT_TRUE(mended.solid) << mended.left.holes << " holes of " << mended.left.hole_mm << " mm";
        EXPECT_LE(mended.moved_mm, 2 * kMostStitch);
    }
}

TEST(RepairInput, RefusedMeshesOfTheCorpusAreMended) {
    const char* folder = std::getenv("SLABWRIGHT_CORPUS");
    if (folder == nullptr || *folder == '\0') {
        std::printf("skipped: SLABWRIGHT_CORPUS is not set\n");
        return;
    }
    int mended = 0, refused = 0;
    const std::string corpus = folder;
    std::vector<std::string> files{corpus + "/castings/midget_cylinder_half_pattern_cracks.stl"};
    for (const char* name : {"featuretype_unwelded", "inverted_normals_bust", "conrod_mould_random_normals",
                             "kuka_kr150_base_nonmanifold"})
        files.push_back(corpus + "/nasty/" + name + ".stl");
    for (const char* name : {"staubli_1", "staubli_5", "yaskawa_1", "yaskawa_2", "yaskawa_5", "yaskawa_6",
                             "yaskawa_7", "yaskawa_12", "yaskawa_13", "yaskawa_15"})
        files.push_back(corpus + "/pool/" + name + ".stl");
    for (const std::string& file : files) {
        if (!std::filesystem::exists(file)) continue;
        SCOPED_TRACE(file);
        Context context({.threads = 2});
        const PatternMesh stl = read_pattern_mesh(context, file);
        if (is_solid(stl.report)) continue;
        ++refused;
        try {
            const Repaired repaired = repair_mesh(context, stl.mesh.view(), stl.report, Repair::mend, file);
            EXPECT_TRUE(is_solid(repaired.report));
            EXPECT_FALSE(repaired.diagnostics.empty());
            EXPECT_LE(repaired.told.moved_mm, kMostStitch);
            EXPECT_LT(std::abs(repaired.report.volume_mm3 - std::abs(stl.report.volume_mm3)),
                      stl.report.misoriented_edges.count > 100
                          ? std::abs(repaired.report.volume_mm3)  // its own volume was chance
                          : .01 * repaired.report.volume_mm3);
            ++mended;
        } catch (const Error& error) {
            ADD_FAILURE() << error.what();
        }
    }
    std::printf("%d of %d refused meshes were mended\n", mended, refused);
}

}  // namespace
}  // namespace slabwright
