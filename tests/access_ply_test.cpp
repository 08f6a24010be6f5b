// The map of what a tool reaches, written and read back.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "engine/planner/planner.h"
#include "engine/tool_choice/access_map.h"
#include "engine/tools/libraries.h"
#include "io/write/access_ply.h"
#include "kernels/errors.h"
#include "tests/support/height_field.h"

using namespace slabwright;

namespace {

struct Face {
    std::array<Vec3f, 3> corners;
    float reached;
    std::uint32_t facet;
    std::array<int, 3> colour;
};

/// As any reader of PLY would take it: by its header.
std::vector<Face> read(const std::string& text, std::string& comment) {
    std::size_t vertices = 0, faces = 0, at = text.find("end_header\n");
    EXPECT_NE(at, std::string::npos);
    std::istringstream header(text.substr(0, at));
    at += 11;
    std::string line, properties;
    std::getline(header, line);
    EXPECT_EQ(line, "ply");
    std::getline(header, line);
    EXPECT_EQ(line, "format binary_little_endian 1.0");
    while (std::getline(header, line)) {
        if (line.starts_with("comment ")) comment = line.substr(8);
        else if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
        else if (line.starts_with("element face ")) faces = std::stoul(line.substr(13));
        else properties += line + ";";
    }
    EXPECT_EQ(properties,
              "property float x;property float y;property float z;property list uchar uint "
              "vertex_indices;property float reached;"
              "property uint facet;property uchar red;property uchar green;property uchar blue;");
    EXPECT_EQ(text.size(), at + 12 * vertices + 24 * faces);
    auto byte = [&] { return static_cast<unsigned char>(text.at(at++)); };
    auto number = [&] {
        std::uint32_t value = 0;
        for (int shift = 0; shift < 32; shift += 8) value |= static_cast<std::uint32_t>(byte()) << shift;
        return value;
    };
    auto real = [&] { return std::bit_cast<float>(number()); };
    std::vector<Vec3f> points(vertices);
    for (Vec3f& p : points) p.x = real(), p.y = real(), p.z = real();
    std::vector<Face> found(faces);
    for (Face& face : found) {
        EXPECT_EQ(byte(), 3);
        for (Vec3f& corner : face.corners) corner = points.at(number());
        face.reached = real();
        face.facet = number();
        for (int& c : face.colour) c = byte();
    }
    EXPECT_EQ(at, text.size());
    return found;
}

double area_of(const std::array<Vec3f, 3>& t) {
    const double ux = double{t[1].x} - t[0].x, uy = double{t[1].y} - t[0].y, uz = double{t[1].z} - t[0].z;
    const double vx = double{t[2].x} - t[0].x, vy = double{t[2].y} - t[0].y, vz = double{t[2].z} - t[0].z;
    return std::hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx) / 2;
}

}  // namespace

TEST(AccessMap, OfAPlanReadsBackAsItWasMeasured) {
    Context context;
    // A shallow pit that every tool enters, and a channel of 4 mm for the smallest ones only.
    const Mesh mesh = test::height_field(context, 40, 2, [](double x, double y) {
        if (std::hypot(x, y + 8) < 20) return 9.0;
        return std::abs(y - 29) < 3 && std::abs(x) < 25 ? 6.0 : 14.0;
    });
    Job job;
    job.tools = luo_library();
    job.slabs.thicknesses = {15};
    job.selection.compare = false;
    job.selection.accessibility = AccessRule::exact;
    const Plan plan = make_plan(context, mesh, {}, job);
    std::map<int, double> ratio;
    int maps = 0;
    access_maps(context, mesh.view(), plan, [&](const AccessMap& map) {
        ++maps;
        ASSERT_EQ(map.layer, 1);
        ASSERT_EQ(map.accessibility.share.size(), mesh.facets.size());
        std::string comment;
        const std::vector<Face> faces =
            read(access_ply(mesh.view(), map.accessibility.share, "layer 1"), comment);
        EXPECT_EQ(comment, "layer 1");
        ASSERT_EQ(static_cast<std::ptrdiff_t>(faces.size()),
                  std::count_if(map.accessibility.share.begin(), map.accessibility.share.end(),
                                [](float s) { return s >= 0; }));
        double area = 0, reached = 0;
        for (const Face& face : faces) {
            ASSERT_LT(face.facet, mesh.facets.size());
            EXPECT_EQ(face.reached, map.accessibility.share[face.facet]);
            for (int k = 0; k < 3; ++k)
                EXPECT_EQ(
                    std::memcmp(&face.corners[k], &mesh.vertices[mesh.facets[face.facet][k]], sizeof(Vec3f)),
                    0);
            if (face.reached == 0) {
                EXPECT_EQ(face.colour, (std::array<int, 3>{230, 120, 0}));
            } else if (face.reached == 1) {
                EXPECT_EQ(face.colour, (std::array<int, 3>{0, 114, 178}));
            }
            // All of a facet that is to be machined here lies in the layer, but for upright ones that go on
            // to the ground.
            const auto [low, high] = std::minmax({face.corners[0].z, face.corners[1].z, face.corners[2].z});
            if (low >= 0 && high < 14)
                area += area_of(face.corners), reached += face.reached * area_of(face.corners);
        }
        EXPECT_GT(area, 1000);
        ratio[map.tool] = reached / area;
    });
    EXPECT_GE(maps, 2);
    ASSERT_TRUE(plan.layers[0].selection);
    // Balls, from the largest looked at down: each reaches more than the one before, and none all of the
    // channel but the smallest.
    double last = -1;
    int balls = 0;
    for (const ToolCandidate& candidate : plan.layers[0].selection->candidates)
        if (candidate.purpose == "finish") {
            EXPECT_GE(ratio.at(candidate.tool), last - 1e-3);
            last = ratio.at(candidate.tool);
            ++balls;
        }
    EXPECT_GE(balls + (plan.layers[0].selection->vertical ? 2 : 0), 2);
}

TEST(AccessMap, RefusesSharesOfAnotherMesh) {
    Context context;
    const Mesh mesh = test::height_field(context, 10, 5, [](double, double) { return 5.0; });
    EXPECT_THROW((void)access_ply(mesh.view(), std::vector<float>(3, 1.0F), ""), Error);
}
