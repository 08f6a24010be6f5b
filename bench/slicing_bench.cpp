// How many segments a second the slicer cuts from a relief (a height field closed to a solid), on one thread
// and on two. An input that yields no segments stops the program: a benchmark of nothing looks fast.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numeric>
#include <random>

#include "kernels/mesh/weld.h"
#include "kernels/slicing/slicing.h"

namespace {

using namespace slabwright;

/// A closed relief of about `facets` facets, 1 m wide, 20 mm base, waves of three lengths up to 180 mm over
/// it.
Mesh make_relief(Context& context, std::size_t facets) {
    const auto n = static_cast<std::uint32_t>(
        std::sqrt(static_cast<double>(facets) / 4));  // a top and a bottom of 2 n² each
    Mesh mesh;
    const std::uint32_t row = n + 1, layer = row * row;
    for (int top = 0; top < 2; ++top) {
        for (std::uint32_t j = 0; j < row; ++j) {
            for (std::uint32_t i = 0; i < row; ++i) {
                const double x = 1000.0 * i / n, y = 1000.0 * j / n;
                const double z = 110 + 60 * std::sin(x / 90) * std::cos(y / 110) +
                                 25 * std::sin(x / 23 + y / 31) + 5 * std::cos(x / 5) * std::sin(y / 4);
                mesh.vertices.push_back(
                    {static_cast<float>(x), static_cast<float>(y), top ? static_cast<float>(z) : 0.0f});
            }
        }
    }
    auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
        mesh.facets.push_back({a, b, c});
        mesh.facets.push_back({a, c, d});
    };
    for (std::uint32_t j = 0; j < n; ++j) {
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * row + i, b = a + 1, c = b + row, d = a + row;
            quad(layer + a, layer + b, layer + c, layer + d);
            quad(a, d, c, b);
        }
    }
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t south = i, north = n * row + i, west = i * row, east = i * row + n;
        quad(south, south + 1, layer + south + 1, layer + south);
        quad(north + 1, north, layer + north, layer + north + 1);
        quad(west + row, west, layer + west, layer + west + row);
        quad(east, east + row, layer + east + row, layer + east);
    }
    pair_edges(context, mesh);
    return mesh;
}

/// The same facets in random order, as an STL writer may leave them.
Mesh shuffled(Context& context, Mesh mesh) {
    std::mt19937_64 random(1);
    for (std::size_t i = mesh.facets.size(); i > 1; --i)
        std::swap(mesh.facets[i - 1], mesh.facets[random() % i]);
    pair_edges(context, mesh);
    return mesh;
}

const Mesh& relief(std::size_t facets, bool shuffle) {
    static std::map<std::pair<std::size_t, bool>, Mesh> made;
    const std::pair key(facets, shuffle);
    if (const auto it = made.find(key); it != made.end()) return it->second;
    Context context;
    Mesh mesh = shuffle ? shuffled(context, relief(facets, false)) : make_relief(context, facets);
    if (mesh.facets.empty()) {
        std::fprintf(stderr, "slicing_bench: the relief has no facets\n");
        std::exit(1);
    }
    return made.emplace(key, std::move(mesh)).first->second;
}

/// Arguments: facets, planes, threads, shuffled.
void slice_relief(benchmark::State& state) {
    const Mesh& mesh = relief(static_cast<std::size_t>(state.range(0)), state.range(3) != 0);
    std::vector<Plane> planes(static_cast<std::size_t>(state.range(1)));
    for (std::size_t i = 0; i < planes.size(); ++i)
        planes[i].z = 200.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(planes.size());
    Context context({.threads = static_cast<int>(state.range(2))});
    std::size_t segments = 0;
    for (auto _ : state) {
        const auto sections = slice(context, mesh.view(), planes);
        segments = 0;
        for (const Section& section : sections) segments += section.loops.points.size();
        if (segments == 0) {
            std::fprintf(stderr, "slicing_bench: the sections are empty\n");
            std::exit(1);
        }
    }
    state.counters["segments"] = static_cast<double>(segments);
    state.counters["segments/s"] =
        benchmark::Counter(static_cast<double>(segments), benchmark::Counter::kIsIterationInvariantRate);
}

}  // namespace

BENCHMARK(slice_relief)
    ->ArgNames({"facets", "planes", "threads", "shuffled"})
    ->Args({100000, 600, 1, 0})
    ->Args({100000, 600, 2, 0})
    ->Args({1000000, 600, 1, 0})
    ->Args({1000000, 600, 2, 0})
    ->Args({1000000, 600, 2, 1})
    ->Args({4000000, 600, 2, 0})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    if (benchmark::RunSpecifiedBenchmarks() == 0) {
        std::fprintf(stderr, "slicing_bench: nothing ran\n");
        return 1;
    }
    return 0;
}
