// How the time of a whole plan grows: with facets, with the part's size (and so with the length of what is
// written).
//     build/release/plan_bench --benchmark_counters_tabular=true
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "engine/planner/planner.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

void plan_metre_pattern(benchmark::State& state) {
    const double size = static_cast<double>(state.range(0));
    MetrePattern pattern;
    pattern.size_mm = size;
    pattern.height_mm = 0.1 * size;
    pattern.facets = static_cast<std::uint64_t>(state.range(1));
    Context context({.threads = static_cast<int>(state.range(2))});
    std::vector<Facet> facets;
    metre_pattern(pattern, [&](const Facet& f) { facets.push_back(f); });
    const Mesh mesh = weld(context, facets);
    if (mesh.facets.size() < pattern.facets) {
        std::fprintf(stderr, "plan_bench: the pattern has %zu facets, %llu were asked for\n",
                     mesh.facets.size(), static_cast<unsigned long long>(pattern.facets));
        std::exit(1);
    }
    Job job;
    job.allow_undercut = true;
    job.bonding.accept_weak = true;
    InputInfo input;
    input.file = "metre pattern";
    double metres = 0, moves = 0;
    for (auto _ : state) {
        const Plan plan = make_plan(context, mesh, input, job);
        metres = moves = 0;
        for (const Layer& layer : plan.layers)
            for (const Operation& op : layer.operations) {
                metres += op.cutting_mm / 1000;
                moves += static_cast<double>(op.moves.size());
            }
        if (moves == 0) state.SkipWithError("an empty plan");
    }
    state.counters["facets"] = static_cast<double>(mesh.facets.size());
    state.counters["moves"] = moves;
    state.counters["cut_m"] = metres;
    state.counters["facets+moves/s"] = benchmark::Counter(static_cast<double>(mesh.facets.size()) + moves,
                                                          benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(plan_metre_pattern)
    ->ArgNames({"size_mm", "facets", "threads"})
    ->Args({290, 100'000, 2})
    ->Args({580, 100'000, 2})
    ->Args({1160, 100'000, 2})
    ->Args({1160, 1'000'000, 1})
    ->Args({1160, 1'000'000, 2})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabwright

BENCHMARK_MAIN();
