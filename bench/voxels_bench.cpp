// AS of a layer at 1 m²: voxels from sections, then what one roughing tool leaves outside a finish tool's
// swath.
#include <benchmark/benchmark.h>

#include <stdexcept>

#include "kernels/mesh/weld.h"
#include "kernels/slicing/slicing.h"
#include "kernels/voxels/voxels.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

// Arguments: voxel in µm, threads.
void semi_rough_area(benchmark::State& state) {
    Context context({.threads = static_cast<int>(state.range(1))});
    std::vector<Facet> facets;
    metre_pattern({.size_mm = 1000, .height_mm = 100, .facets = 100'000},
                  [&](const Facet& f) { facets.push_back(f); });
    const Mesh mesh = weld(context, facets);
    if (mesh.facets.size() < 90'000) throw std::runtime_error("the pattern failed to build");
    const double voxel = static_cast<double>(state.range(0)) / 1000;
    const Box3 bounds_of = bounds(mesh.view());
    const VoxelBox box =
        voxel_box({bounds_of.min.x, bounds_of.min.y, 40}, {bounds_of.max.x, bounds_of.max.y, 58.5}, voxel);
    std::vector<Plane> planes;
    for (int k = 0; k < box.nz; ++k) planes.push_back({box.z(k), Side::below});
    std::vector<Loops> sections;
    for (Section& s : slice(context, mesh.view(), planes)) sections.push_back(std::move(s.loops));
    RoughLeft left;
    for (auto _ : state) {
        LayerVoxels voxels(context, box, sections, 13);
        left = voxels.left(context, {6.35, 0.3, {54.3, 50.6, 46.9, 43.2, 40}, {}}, 6.35);
        benchmark::DoNotOptimize(left.area);
    }
    state.counters["AS_mm2"] = left.area;
    state.counters["left_Mvoxels"] = static_cast<double>(left.voxels) / 1e6;
    state.counters["tree_MiB"] = static_cast<double>(left.sparse_bytes) / 1048576;
    state.counters["box_Mvoxels"] = 1e-6 * box.nx * box.ny * box.nz;
}
BENCHMARK(semi_rough_area)
    ->Args({500, 2})
    ->Args({250, 1})
    ->Args({250, 2})
    ->Unit(benchmark::kSecond)
    ->UseRealTime();

}  // namespace
}  // namespace slabwright

BENCHMARK_MAIN();
