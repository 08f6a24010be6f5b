// CGAL as a peer: reads a binary STL, welds it and fills a surface mesh; then cuts it by planes with a tree
// of its edges.
//     cgal_peer FILE.stl PLANES      (0 planes: only load)
// Prints seconds and counts, a line each, as all peers do.
#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_halfedge_graph_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_slicer.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/helpers.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <vector>

#include "kernels/geometry/vectors.h"

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Surface = CGAL::Surface_mesh<Point>;

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

[[noreturn]] void stop(const char* why) {
    std::fprintf(stderr, "cgal_peer: %s\n", why);
    std::exit(1);
}

/// The facets as they lie in the file; welding is left to CGAL.
void read_facets(const char* path, std::vector<Point>& points,
                 std::vector<std::array<std::size_t, 3>>& facets) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 84> head{};
    std::uint32_t count = 0;
    if (!file.read(head.data(), head.size())) stop("the file cannot be read");
    std::memcpy(&count, head.data() + 80, sizeof count);
    points.reserve(std::size_t{3} * count);
    facets.reserve(count);
    std::array<char, 50> record{};
    for (std::uint32_t f = 0; f < count; ++f) {
        if (!file.read(record.data(), record.size())) stop("the file ends too early");
        std::array<float, 9> p{};
        std::memcpy(p.data(), record.data() + 12, sizeof p);
        for (std::size_t k = 0; k < 3; ++k) points.emplace_back(p[3 * k], p[3 * k + 1], p[3 * k + 2]);
        facets.push_back({points.size() - 3, points.size() - 2, points.size() - 1});
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 3) stop("usage: cgal_peer FILE.stl PLANES");
    const int planes = std::atoi(argv[2]);
    double begin = seconds();
    Surface mesh;
    {
        std::vector<Point> points;
        std::vector<std::array<std::size_t, 3>> facets;
        read_facets(argv[1], points, facets);
        CGAL::Polygon_mesh_processing::merge_duplicate_points_in_polygon_soup(points, facets);
        CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(points, facets, mesh);
    }
    if (!CGAL::is_closed(mesh) || num_faces(mesh) == 0) stop("the mesh is empty or not closed");
    std::printf("facets %zu\nvertices %zu\nload_s %.4f\n", static_cast<std::size_t>(num_faces(mesh)),
                static_cast<std::size_t>(num_vertices(mesh)), seconds() - begin);
    if (planes == 0) return 0;

    double low = kUnbounded, high = -kUnbounded;
    for (const auto v : mesh.vertices()) {
        low = std::min(low, mesh.point(v).z());
        high = std::max(high, mesh.point(v).z());
    }
    begin = seconds();
    using Primitive = CGAL::AABB_halfedge_graph_segment_primitive<Surface>;
    using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
    Tree tree(edges(mesh).first, edges(mesh).second, mesh);
    tree.build();
    CGAL::Polygon_mesh_slicer<Surface, Kernel> slicer(mesh, tree);
    std::printf("tree_s %.4f\n", seconds() - begin);
    begin = seconds();
    const double processor = processor_seconds();
    std::size_t segments = 0, loops = 0;
    for (int i = 0; i < planes; ++i) {
        std::vector<std::vector<Point>> polylines;
        const double z = low + (high - low) * (i + 0.5) / planes;
        slicer(Kernel::Plane_3(0, 0, 1, -z), std::back_inserter(polylines));
        loops += polylines.size();
        for (const auto& line : polylines) segments += line.size() - 1;
    }
    if (segments == 0) stop("the sections are empty");
    std::printf("slice_s %.4f\nslice_processor_s %.4f\nsegments %zu\nloops %zu\n", seconds() - begin,
                processor_seconds() - processor, segments, loops);
    return 0;
}
