// How every phase before and under the paths grows with the facets of one pattern (metre_pattern, 1160 × 1160
// × 300 mm), on one thread and on two.
//     build/release/growth_bench --benchmark_counters_tabular=true
// `output` counts what comes out besides: segments, features, facets, points. bench/table makes exponents of
// it. The memory is what a phase takes at its most over the mesh that it is given (30 bytes a facet).
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "bench/peak_memory.h"
#include "engine/job.h"
#include "kernels/cutting/drop.h"
#include "kernels/cutting/level_contours.h"
#include "kernels/features/alpha_map.h"
#include "kernels/features/features.h"
#include "kernels/features/section_areas.h"
#include "kernels/mesh/simplify.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

constexpr double kBottom = 150, kTop = 168.5;  // of the layer that is looked at, mm
const CutterShape kBall = ball_cutter(3.175);

[[noreturn]] void stop(const std::string& why) {
    std::fprintf(stderr, "growth_bench: %s\n", why.c_str());
    std::exit(1);
}

/// The pattern of the last size asked for, and its layer.
struct Pattern {
    std::uint64_t facets = 0;
    Mesh mesh;
    LayerSolid solid;
};

const Pattern& pattern(std::uint64_t facets) {
    static std::unique_ptr<Pattern> made;
    if (made && made->facets == facets) return *made;
    made.reset();
    Context context;
    auto next = std::make_unique<Pattern>();
    next->facets = facets;
    MetrePattern wish;
    wish.facets = facets;
    {
        std::vector<Facet> soup;
        soup.reserve(metre_pattern_facets(wish));
        metre_pattern(wish, [&](const Facet& f) { soup.push_back(f); });
        next->mesh = weld(context, soup);
    }
    if (next->mesh.facets.size() < facets)
        stop("the pattern has only " + std::to_string(next->mesh.facets.size()) + " facets");
    next->solid = layer_solid(context, next->mesh.view(), kBottom - kBall.radius, kTop);
    made = std::move(next);
    return *made;
}

/// Runs `phase(context, pattern)`, which returns the size of its output.
template <class Phase>
void measure(benchmark::State& state, Phase&& phase) {
    const Pattern& of = pattern(static_cast<std::uint64_t>(state.range(0)));
    Context context({.threads = static_cast<int>(state.range(1))});
    std::size_t output = 0;
    PeakMemory memory;
    for (auto _ : state) output = phase(context, of);
    const double peak = memory.finish();
    if (output == 0) stop("nothing comes out");
    state.counters["facets"] = static_cast<double>(of.mesh.facets.size());
    state.counters["anonymous bytes/facet"] = peak / static_cast<double>(of.mesh.facets.size());
    state.counters["output"] = static_cast<double>(output);
    state.counters["output/s"] =
        benchmark::Counter(static_cast<double>(output), benchmark::Counter::kIsIterationInvariantRate);
}

void slice_600(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        std::vector<Plane> planes(600);
        for (std::size_t i = 0; i < planes.size(); ++i)
            planes[i].z = 300.0 * (static_cast<double>(i) + 0.5) / 600;
        std::size_t segments = 0;
        for (const Section& s : slice(context, of.mesh.view(), planes)) segments += s.loops.points.size();
        return segments;
    });
}

void features(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        return find_features(context, of.mesh.view(), feature_options(Job{})).features.size();
    });
}

void undercuts(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        const std::vector<double> tops{75, 150, 225, 300};
        return 1 + measure_undercuts(context, of.mesh.view(), tops, feature_options(Job{})).size();
    });
}

void slopes(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        return alpha_map(context, of.mesh.view(), kBottom, kTop).slopes.size();
    });
}

void fewer_facets(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        return simplify(context, of.mesh.view(), 0.001).facets.size();
    });
}

void solid_of_a_layer(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        return layer_solid(context, of.mesh.view(), kBottom - kBall.radius, kTop).facets.size();
    });
}

void drops(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        constexpr std::size_t lines = 128, places = 1024;
        const DropIndex index(of.solid, kBall);
        std::vector<double> tips(lines * places);
        parallel_for(context, tips.size(), 1024, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                tips[i] = index
                              .drop(of.solid.min[0] + 1.1 * static_cast<double>(i % places),
                                    of.solid.min[1] + 9.0 * static_cast<double>(i / places))
                              .tip_z;
        });
        benchmark::DoNotOptimize(tips.data());
        return tips.size();
    });
}

void areas_of_sections(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        return SectionAreas(context, of.mesh.view())(kBottom) > 0 ? std::size_t{1} : std::size_t{0};
    });
}

// One level at the height of most walls, such that chords stay within 0.01 mm.
void level_contour(benchmark::State& state) {
    measure(state, [](Context& context, const Pattern& of) {
        const double tip = 0.5 * (kBottom + kTop);
        const Plane plane = inside_plane(of.solid, kBall, tip);
        const std::vector<Section> inside = slice(context, of.mesh.view(), {&plane, 1});
        return level_contours(context, of.solid, inside[0].loops, kBall, tip,
                              fibre_grid(of.solid, kBall, 2000))
            .points.size();
    });
}

}  // namespace
}  // namespace slabwright

int main(int argc, char** argv) {
    using namespace slabwright;
    // All phases of one size before the next, so that each pattern is made once.
    using Phase = void (*)(benchmark::State&);
    constexpr std::pair<const char*, Phase> phases[] = {{"slice_600", slice_600},
                                                        {"features", features},
                                                        {"undercuts", undercuts},
                                                        {"slopes", slopes},
                                                        {"fewer_facets", fewer_facets},
                                                        {"solid_of_a_layer", solid_of_a_layer},
                                                        {"areas_of_sections", areas_of_sections},
                                                        {"drops", drops},
                                                        {"level_contour", level_contour}};
    for (const std::int64_t facets : {100'000, 1'000'000, 10'000'000})
        for (const auto& [name, phase] : phases)
            for (const std::int64_t threads : {1, 2})
                benchmark::RegisterBenchmark(name, phase)
                    ->ArgNames({"facets", "threads"})
                    ->Args({facets, threads})
                    ->MeasureProcessCPUTime()
                    ->UseRealTime()
                    ->Unit(benchmark::kMillisecond);
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    if (benchmark::RunSpecifiedBenchmarks() == 0) stop("nothing ran");
    return 0;
}
