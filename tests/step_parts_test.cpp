// Parts that others drew, read as STEP: closed, and within the stated deviation of their surfaces both ways,
// as OCCT measures it. They come with Debian's occt-misc: some as STEP, others in OCCT's own form, which is
// written as STEP first.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "io/read/mesh_format.h"
#include "io/read/pattern_mesh.h"
#include "kernels/access/closest_point.h"
#include "tests/support/files.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

#ifdef SLABWRIGHT_OCCT
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRepExtrema_DistShapeShape.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <STEPControl_Writer.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#endif

namespace slabwright {
namespace {

#ifdef SLABWRIGHT_OCCT

using support::TemporaryFolder;

constexpr double kRounding = 1e-4;  // mm: single precision, and what OCCT calls one place

TopoDS_Shape read_step(const std::string& file) {
    STEPControl_Reader reader;
    if (reader.ReadFile(file.c_str()) != IFSelect_RetDone) return {};
    reader.TransferRoots();
    return reader.OneShape();
}

std::string step_of(const std::filesystem::path& brep, const TemporaryFolder& folder) {
    TopoDS_Shape shape;
    BRep_Builder builder;
    EXPECT_TRUE(BRepTools::Read(shape, brep.c_str(), builder)) << brep;
    BRepTools::Clean(shape);
    STEPControl_Writer writer;
    writer.Transfer(shape, STEPControl_AsIs);
    std::string file = folder / (brep.stem().string() + ".step");
    EXPECT_EQ(writer.Write(file.c_str()), IFSelect_RetDone) << brep;
    return file;
}

/// The facets as the file places them: a pattern is set on z = 0.
Mesh facets_of(Context& context, const std::string& file, double deviation) {
    const auto formats = mesh_formats();
    const auto step =
        std::find_if(formats.begin(), formats.end(), [](const auto* f) { return f->name == "STEP"; });
    const DecodedMesh decoded =
        (*step)->decode(context, support::slurp(file), {.deviation_mm = deviation}, file);
    Mesh mesh;
    for (const FileVertex& v : decoded.vertices)
        mesh.vertices.push_back(
            {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])});
    mesh.facets.assign(decoded.facets.begin(), decoded.facets.end());
    return mesh;
}

/// The farthest that a point of some facets, the largest among them, lies from the surfaces, mm.
double facets_off(const Mesh& mesh, const TopoDS_Shape& exact, std::mt19937& random) {
    constexpr int kAsked = 12;
    std::uniform_int_distribution<std::size_t> any(0, mesh.facets.size() - 1);
    std::uniform_real_distribution<double> unit(0, 1);
    double most = 0;
    for (int k = 0; k < kAsked; ++k) {
        const Index3& f = mesh.facets[any(random)];
        double a = unit(random), b = unit(random);
        if (a + b > 1) a = 1 - a, b = 1 - b;
        if (k % 3 == 0) a = b = 0.5;  // the middle of an edge
        const Vec3f &p = mesh.vertices[f[0]], &q = mesh.vertices[f[1]], &r = mesh.vertices[f[2]];
        const auto at = [&](float x, float y, float z) { return x + a * (y - x) + b * (z - x); };
        const TopoDS_Shape point =
            BRepBuilderAPI_MakeVertex(gp_Pnt(at(p.x, q.x, r.x), at(p.y, q.y, r.y), at(p.z, q.z, r.z)));
        const BRepExtrema_DistShapeShape distance(point, exact);
        EXPECT_TRUE(distance.IsDone());
        most = std::max(most, distance.Value());
    }
    return most;
}

/// The farthest that a point of the surfaces, a corner of a finer mesh of theirs, lies from the facets, mm.
double surfaces_off(Context& context, const Mesh& mesh, TopoDS_Shape exact, double finer) {
    constexpr int kNodes = 3000;  // of a face
    const ClosestPoint closest(context, mesh.view());
    const BRepMesh_IncrementalMesh meshed(exact, finer, false, 0.1, false);
    double most = 0;
    for (TopExp_Explorer faces(exact, TopAbs_FACE); faces.More(); faces.Next()) {
        TopLoc_Location location;
        const Handle(Poly_Triangulation) triangles =
            BRep_Tool::Triangulation(TopoDS::Face(faces.Current()), location);
        // Of a fine net some.
        const int stride = triangles.IsNull() ? 1 : 1 + triangles->NbNodes() / kNodes;
        for (int n = 1; !triangles.IsNull() && n <= triangles->NbNodes(); n += stride) {
            const gp_Pnt p = triangles->Node(n).Transformed(location.Transformation());
            most = std::max(most, closest.query_unsigned({p.X(), p.Y(), p.Z()}, 10).distance);
        }
    }
    return most;
}

TEST(StepParts, LieWithinTheDeviationThatIsStated) {
    const std::filesystem::path data = "/usr/share/opencascade/data";
    if (!std::filesystem::exists(data / "step")) GTEST_SKIP() << "occt-misc is not installed";
    Message::DefaultMessenger()->ChangePrinters().Clear();
    const TemporaryFolder folder;
    std::vector<std::string> files{data / "step/linkrods.step", data / "step/screw.step"};
    for (const char* name : {"CrankArm.brep", "Pump_TopCover.brep", "Pump_Nut.brep"})
        files.push_back(step_of(data / "occ" / name, folder));
    std::mt19937 random(test::seed());
    for (const std::string& file : files)
        for (const double deviation : {0.02, 0.1}) {
            Context context;
            const PatternMesh found = read_pattern_mesh(context, file, {.deviation_mm = deviation});
            const Mesh mesh = facets_of(context, file, deviation);
            const TopoDS_Shape exact = read_step(file);
            ASSERT_FALSE(exact.IsNull()) << file;
            const double facets = facets_off(mesh, exact, random),
                         surfaces = surfaces_off(context, mesh, exact, deviation / 2);
            std::printf(
                "%s: %zu facets of %g mm, %zu open edges; facets within %.4f mm of the surfaces, these "
                "within %.4f mm of them\n",
                std::filesystem::path(file).filename().c_str(), found.mesh.facets.size(), deviation,
                static_cast<std::size_t>(found.report.open_edges.count), facets, surfaces);
            EXPECT_EQ(found.report.open_edges.count, 0U) << file;
            EXPECT_LE(facets, deviation + kRounding) << file;
            EXPECT_LE(surfaces, deviation + kRounding) << file;
        }
}

#else

TEST(StepParts, LieWithinTheDeviationThatIsStated) { GTEST_SKIP() << "STEP was not built"; }

#endif

}  // namespace
}  // namespace slabwright
