// Every file of the corpus is read as its MANIFEST.tsv says, or refused with a reason.
//
// Where our words differ from the manifest's: its `watertight` asks only that no edge has a single facet, as
// our open_edges does, whatever the orientation; its `shells` are joined across every edge, ours across
// paired or misoriented edges, which is the same wherever it states them; it reads what is there of files
// whose header contradicts their length or whose coordinates are not finite, where we refuse; its counts of
// open edges include those in the base plane.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "io/read/pattern_mesh.h"
#include "kernels/errors.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

struct Entry {
    std::string file, box, note;
    std::uint64_t triangles = 0;
    bool watertight = false;

    /// A number that the note states as name=number.
    [[nodiscard]] std::optional<std::uint64_t> stated(const std::string& name) const {
        const std::size_t at = note.find(name + "=");
        if (at == std::string::npos || (at > 0 && note[at - 1] != ' ' && note[at - 1] != '['))
            return std::nullopt;
        return std::stoull(note.substr(at + name.size() + 1));
    }
};

std::string corpus() {
    const char* folder = std::getenv("SLABWRIGHT_CORPUS");
    if (folder != nullptr && *folder != '\0') return folder;
    std::printf("skipped: SLABWRIGHT_CORPUS is not set\n");
    return {};
}

std::vector<Entry> manifest(const std::string& folder) {
    std::ifstream file(folder + "/MANIFEST.tsv");
    std::vector<Entry> entries;
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
        std::vector<std::string> fields;
        std::istringstream row(line);
        for (std::string field; std::getline(row, field, '\t');) fields.push_back(field);
        if (fields.size() < 9) continue;
        entries.push_back({fields[0], fields[5], fields[8], std::stoull(fields[4]), fields[6] == "yes"});
    }
    return entries;
}

/// Files that must be refused when read, and as what.
const std::map<std::string, std::string> kRefused{
    {"nasty/zero_byte.stl", "stl.empty"},
    {"nasty/bin_wrong_face_count.stl", "stl.facet_count"},
    {"nasty/bin_utf8_mangled_huge_coords.stl", "stl.facet_count"},
    {"nasty/ascii_unparseable.stl", "stl.unparsable"},
    {"nasty/truncated_valve_body.stl", "stl.truncated"},
    {"nasty/nan_inf_bearing_block.stl", "stl.non_finite"},
};

/// Files that are read but are no solids, and why.
const std::map<std::string, std::string> kNoSolids{
    {"relief/gmsh_terrain_open_2649m.stl", "stl.open"},
    {"relief/mount_rushmore_broken.stl", "stl.open"},
    {"nasty/triangle_soup.stl", "stl.open"},
    {"nasty/inverted_normals_bust.stl", "stl.inverted"},
    {"nasty/conrod_mould_random_normals.stl", "stl.misoriented"},
    {"nasty/kuka_kr150_base_nonmanifold.stl", "stl.open"},
};

/// The manifest calls two facets degenerate here whose areas are 4.4e-11 and 1.9e-10 mm²; ours are those
/// without any.
constexpr const char* kSlivers = "big/midget_crankcase_front_525k.stl";

/// Turns a binary STL by a quarter about x.
void stand_up(const std::string& from, const std::string& to) {
    std::ifstream in(from, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(in)), {});
    constexpr std::size_t head = 84, record = 50, normal = 12;
    for (std::size_t facet = head; facet + record <= bytes.size(); facet += record)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            char* at = bytes.data() + facet + normal + corner * 12;
            float xyz[3];
            std::memcpy(xyz, at, sizeof xyz);
            const float turned[3] = {xyz[0], -xyz[2], xyz[1]};
            std::memcpy(at, turned, sizeof turned);
        }
    std::ofstream(to, std::ios::binary) << bytes;
}

TEST(StlCorpus, EveryFileIsAsItsManifestSays) {
    const std::string folder = corpus();
    if (folder.empty()) return;
    const std::vector<Entry> entries = manifest(folder);
    ASSERT_GE(entries.size(), 30u);
    for (const Entry& entry : entries) {
        SCOPED_TRACE(entry.file);
        Context context({.threads = 2});
        const std::string path = folder + "/" + entry.file;
        PatternMesh stl;
        try {
            stl = read_pattern_mesh(context, path);
        } catch (const Error& error) {
            const auto expected = kRefused.find(entry.file);
            ASSERT_NE(expected, kRefused.end()) << error.what();
            EXPECT_EQ(error.code(), expected->second) << error.what();
            EXPECT_EQ(error.kind(), ErrorKind::input);
            EXPECT_NE(error.place().find(path), std::string::npos);
            EXPECT_FALSE(error.remedy().empty());
            continue;
        }
        EXPECT_EQ(kRefused.count(entry.file), 0u) << "should have been refused";
        const MeshReport& report = stl.report;
        EXPECT_EQ(stl.input.triangles, entry.triangles);
        EXPECT_EQ(stl.mesh.facets.size(), entry.triangles);
        EXPECT_EQ(report.open_edges.count == 0, entry.watertight);
        EXPECT_EQ(report.open_edges.count, entry.stated("open_edges").value_or(0));
        EXPECT_EQ(report.non_manifold_edges.count, entry.stated("nonmanifold_edges").value_or(0));
        EXPECT_EQ(report.misoriented_edges.count, entry.stated("misoriented_edges").value_or(0));
        EXPECT_EQ(report.degenerate_facets.count,
                  entry.file == kSlivers ? 0 : entry.stated("degenerate").value_or(0));
        if (const auto shells = entry.stated("shells")) {
            EXPECT_EQ(report.components, *shells);
        }
        if (entry.watertight) {
            EXPECT_EQ(report.volume_mm3 < 0, entry.note.find("NEGATIVE_VOLUME") != std::string::npos);
        }
        double size[3];
        ASSERT_EQ(std::sscanf(entry.box.c_str(), "%lfx%lfx%lf", &size[0], &size[1], &size[2]), 3);
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(stl.input.max[k] - stl.input.min[k], size[k], 1e-5 * size[k]);
        EXPECT_EQ(report.box.min.z, 0.0f);
        EXPECT_EQ(stl.input.sha256.size(), 64u);
        try {
            require_solid(context, stl, path);
            EXPECT_EQ(kNoSolids.count(entry.file), 0u) << "is no solid";
        } catch (const Error& error) {
            const auto expected = kNoSolids.find(entry.file);
            ASSERT_NE(expected, kNoSolids.end()) << error.what();
            EXPECT_EQ(error.code(), expected->second) << error.what();
            EXPECT_NE(error.place().find("facet "), std::string::npos);
            EXPECT_FALSE(error.remedy().empty());
            EXPECT_FALSE(stl.diagnostics.empty());
        }
    }
}

TEST(StlCorpus, SameBytesOnAnyNumberOfThreads) {
    const std::string folder = corpus();
    if (folder.empty()) return;
    for (const Entry& entry : manifest(folder)) {
        if (kRefused.count(entry.file) != 0) continue;
        SCOPED_TRACE(entry.file);
        PatternMesh first;
        for (const int threads : {1, 2, 4}) {
            Context context({.threads = threads});
            PatternMesh stl = read_pattern_mesh(context, folder + "/" + entry.file);
            if (threads == 1) {
                first = std::move(stl);
                continue;
            }
            auto same = [](const auto& a, const auto& b) {
                return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
            };
            EXPECT_TRUE(same(stl.mesh.vertices, first.mesh.vertices));
            EXPECT_TRUE(same(stl.mesh.facets, first.mesh.facets));
            EXPECT_TRUE(same(stl.mesh.neighbours, first.mesh.neighbours));
            EXPECT_EQ(stl.report.component_of, first.report.component_of);
            EXPECT_EQ(stl.report.volume_mm3, first.report.volume_mm3);
            EXPECT_EQ(stl.report.area_mm2, first.report.area_mm2);
            EXPECT_EQ(stl.diagnostics, first.diagnostics);
            EXPECT_EQ(stl.input.sha256, first.input.sha256);
        }
    }
}

// As they lie, their cracks are in the base plane, where they do not matter; stood up, they do.
TEST(StlCorpus, CracksCloseUnderTheWeldThatIsNamed) {
    const std::string folder = corpus();
    if (folder.empty()) return;
    const support::TemporaryFolder stood_up;
    for (const char* file :
         {"castings/midget_cylinder_half_pattern_cracks.stl", "nasty/featuretype_unwelded.stl"}) {
        SCOPED_TRACE(file);
        Context context({.threads = 2});
        const std::string lying = folder + "/" + file, path = stood_up / "up.stl";
        require_solid(context, read_pattern_mesh(context, lying), lying);
        stand_up(lying, path);
        std::string remedy;
        try {
            require_solid(context, read_pattern_mesh(context, path), path);
        } catch (const Error& error) {
            remedy = error.remedy();
        }
        ASSERT_EQ(remedy.rfind("--weld ", 0), 0u) << remedy;
        const PatternMesh welded = read_pattern_mesh(context, path, {.weld_mm = std::stod(remedy.substr(7))});
        require_solid(context, welded, path);
        EXPECT_EQ(welded.report.open_edges_off_base.count, 0u);
    }
}

}  // namespace
}  // namespace slabwright
