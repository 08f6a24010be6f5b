// How many places a cutter is dropped on a pattern in a second: at random and in the order in which a raster
// comes by.
//     build/release/drop_bench --benchmark_counters_tabular=true
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <random>

#include "kernels/cutting/drop.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/parallel.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

enum Order : std::int64_t { random, raster };

/// The pattern's upper side as one layer; made once for a number of facets.
const LayerSolid& pattern(std::uint64_t facets) {
    static std::uint64_t of = 0;
    static LayerSolid solid;
    if (of != facets) {
        Context context({.threads = 2});
        std::vector<Facet> soup;
        MetrePattern pattern;
        pattern.facets = facets;
        metre_pattern(pattern, [&](const Facet& f) { soup.push_back(f); });
        const Mesh mesh = weld(context, soup);
        solid = layer_solid(context, mesh.view(), 0, 2 * pattern.height_mm);
        of = facets;
    }
    if (solid.facets.size() < facets) {
        std::fprintf(stderr, "drop_bench: the pattern has %zu facets, %llu were asked for\n",
                     solid.facets.size(), static_cast<unsigned long long>(facets));
        std::exit(1);
    }
    return solid;
}

void drop_cutter(benchmark::State& state, CutterShape cutter) {
    const LayerSolid& solid = pattern(static_cast<std::uint64_t>(state.range(0)));
    Context context({.threads = static_cast<int>(state.range(2))});
    constexpr std::size_t n = std::size_t{1} << 17;
    std::vector<std::array<double, 2>> places(n);
    std::mt19937 engine(1);
    std::uniform_real_distribution<double> x(solid.min[0], solid.max[0]), y(solid.min[1], solid.max[1]);
    const double step = 0.4;
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t in_line = i % 2048, line = i / 2048;
        if (state.range(1) == random) places[i] = {x(engine), y(engine)};
        else
            places[i] = {solid.min[0] + 100 + step * static_cast<double>(in_line),
                         solid.min[1] + 100 + 1.5 * static_cast<double>(line)};
    }
    const DropIndex index(solid, cutter);
    std::vector<double> tips(n);
    for (auto _ : state) {
        parallel_for(context, n, 1024, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) tips[i] = index.drop(places[i][0], places[i][1]).tip_z;
        });
        benchmark::ClobberMemory();
    }
    double sum = 0;
    for (const double z : tips) sum += z;
    if (!(sum > 0)) {
        std::fprintf(stderr, "drop_bench: the cutter rests on nothing\n");
        std::exit(1);
    }
    state.counters["mean_tip_mm"] = sum / static_cast<double>(n);
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(n));
}

void make_solid(benchmark::State& state) {
    Context context({.threads = static_cast<int>(state.range(1))});
    std::vector<Facet> soup;
    MetrePattern pattern;
    pattern.facets = static_cast<std::uint64_t>(state.range(0));
    metre_pattern(pattern, [&](const Facet& f) { soup.push_back(f); });
    const Mesh mesh = weld(context, soup);
    if (mesh.facets.size() < pattern.facets) {
        std::fprintf(stderr, "drop_bench: the pattern has only %zu facets\n", mesh.facets.size());
        std::exit(1);
    }
    for (auto _ : state)
        benchmark::DoNotOptimize(
            layer_solid(context, mesh.view(), 0, 2 * pattern.height_mm).tree.tiers.data());
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.facets.size()));
}

const std::vector<std::vector<std::int64_t>> cases{{100'000, 1'000'000}, {random, raster}, {1, 2}};
BENCHMARK_CAPTURE(drop_cutter, ball_6_35, ball_cutter(3.175))
    ->ArgNames({"facets", "raster", "threads"})
    ->ArgsProduct(cases)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(drop_cutter, flat_12_7, flat_cutter(6.35))
    ->ArgNames({"facets", "raster", "threads"})
    ->ArgsProduct(cases)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(make_solid)
    ->ArgNames({"facets", "threads"})
    ->ArgsProduct({{100'000, 1'000'000}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabwright

BENCHMARK_MAIN();
