// This engine in the form of its peers: reads an STL into a mesh with adjacency, then cuts it by planes into
// closed loops.
//     slabwright_peer FILE.stl PLANES [THREADS]      (0 planes: only load; 0 threads: all)
// Prints seconds and counts, a line each, as all peers do.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "io/read/pattern_mesh.h"
#include "kernels/errors.h"
#include "kernels/slicing/slicing.h"

namespace {

using namespace slabwright;

/// Of all threads of this process.
double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void load_and_slice(const char* path, int planes, int threads) {
    Context context({.threads = threads});
    double begin = seconds();
    const Mesh mesh = read_mesh(context, path);
    std::printf("facets %zu\nvertices %zu\nload_s %.4f\n", mesh.facets.size(), mesh.vertices.size(),
                seconds() - begin);
    if (planes == 0) return;
    const Box3 box = bounds(mesh.view());
    std::vector<Plane> request;
    for (int i = 0; i < planes; ++i)
        request.push_back(
            {box.min.z + (static_cast<double>(box.max.z) - box.min.z) * (i + 0.5) / planes, Side::above});
    begin = seconds();
    const double processor = processor_seconds();
    const std::vector<Section> sections = slice(context, mesh.view(), request);
    const double took = seconds() - begin, processor_took = processor_seconds() - processor;
    std::size_t segments = 0, loops = 0;
    for (const Section& section : sections) {
        segments += section.loops.points.size();
        loops += section.loops.size();
        if (section.open_chains.size() != 0)
            throw Error(ErrorKind::input, "peer.open", "the sections are not closed", path);
    }
    if (segments == 0) throw Error(ErrorKind::input, "peer.empty", "the sections are empty", path);
    std::printf("slice_s %.4f\nslice_processor_s %.4f\nsegments %zu\nloops %zu\n", took, processor_took,
                segments, loops);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3 && argc != 4) {
        std::fprintf(stderr, "usage: slabwright_peer FILE.stl PLANES [THREADS]\n");
        return 1;
    }
    try {
        load_and_slice(argv[1], std::atoi(argv[2]), argc == 4 ? std::atoi(argv[3]) : 0);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "slabwright_peer: %s\n", error.what());
        return 1;
    }
    return 0;
}
