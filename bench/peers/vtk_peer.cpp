// VTK as a peer: reads a binary STL and merges its points, then cuts it by planes and joins the pieces into
// lines.
//     vtk_peer FILE.stl PLANES      (0 planes: only load)
// Prints seconds and counts, a line each, as all peers do.
#include <vtkCellArray.h>
#include <vtkCutter.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkStaticCleanPolyData.h>
#include <vtkStripper.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

[[noreturn]] void stop(const char* why) {
    std::fprintf(stderr, "vtk_peer: %s\n", why);
    std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) stop("usage: vtk_peer FILE.stl PLANES");
    const int planes = std::atoi(argv[2]);
    double begin = seconds();
    vtkNew<vtkSTLReader> reader;
    reader->SetFileName(argv[1]);
    reader->MergingOff();  // what merges points after reading is many times faster than the reader itself
    vtkNew<vtkStaticCleanPolyData> clean;
    clean->SetInputConnection(reader->GetOutputPort());
    clean->ToleranceIsAbsoluteOn();
    clean->SetAbsoluteTolerance(0);
    clean->Update();
    vtkPolyData* mesh = clean->GetOutput();
    mesh->BuildLinks();  // which facets meet at a vertex: what VTK has for adjacency
    if (mesh->GetNumberOfCells() == 0) stop("the mesh is empty");
    std::printf("facets %lld\nvertices %lld\nload_s %.4f\n", static_cast<long long>(mesh->GetNumberOfCells()),
                static_cast<long long>(mesh->GetNumberOfPoints()), seconds() - begin);
    if (planes == 0) return 0;

    double box[6];
    mesh->GetBounds(box);
    begin = seconds();
    const double processor = processor_seconds();
    vtkNew<vtkPlane> plane;
    plane->SetNormal(0, 0, 1);
    plane->SetOrigin(0, 0, 0);
    long long segments = 0, loops = 0;
    // A plane at a time: all of them in one cutter would let the stripper join what lies at different
    // heights.
    for (int i = 0; i < planes; ++i) {
        vtkNew<vtkCutter> cutter;
        cutter->SetInputData(mesh);
        cutter->SetCutFunction(plane);
        cutter->SetValue(0, box[4] + (box[5] - box[4]) * (i + 0.5) / planes);
        vtkNew<vtkStripper> stripper;
        stripper->SetInputConnection(cutter->GetOutputPort());
        stripper->SetMaximumLength(1 << 30);
        stripper->Update();
        vtkCellArray* lines = stripper->GetOutput()->GetLines();
        loops += lines->GetNumberOfCells();
        segments += lines->GetNumberOfConnectivityIds() - lines->GetNumberOfCells();
    }
    if (segments == 0) stop("the sections are empty");
    std::printf("slice_s %.4f\nslice_processor_s %.4f\nsegments %lld\nloops %lld\n", seconds() - begin,
                processor_seconds() - processor, segments, loops);
    return 0;
}
