// How fast a plan's programs are simulated, and how fast their motions are checked against the part.
//     build/release/simulate_bench --benchmark_counters_tabular=true
#include <benchmark/benchmark.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "engine/planner/planner.h"
#include "engine/simulate/simulate.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "kernels/geometry/vectors.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

/// A planned metre pattern with its programs read back from their text, made once for each size.
struct Planned {
    Mesh mesh;
    Plan plan;
    SimulationInput input;
};

const Planned& planned(int size_mm) {
    static Planned made;
    static int made_size = 0;
    if (made_size == size_mm) return made;
    Context context;
    MetrePattern pattern;
    pattern.size_mm = size_mm;
    pattern.height_mm = 0.1 * size_mm;
    pattern.facets = 100'000;
    std::vector<Facet> facets;
    metre_pattern(pattern, [&](const Facet& f) { facets.push_back(f); });
    made.mesh = weld(context, facets);
    Job job;
    job.allow_undercut = true;
    job.bonding.accept_weak = true;
    InputInfo source;
    source.file = "metre pattern";
    made.plan = make_plan(context, made.mesh, source, job);
    SimulationInput& in = made.input;
    in = {};
    in.mesh = made.mesh.view();
    in.tools = job.tools;
    in.machine = job.machine;
    double low[2] = {kUnbounded, kUnbounded}, high[2] = {-kUnbounded, -kUnbounded};
    for (const Vec3f& v : made.mesh.vertices) {
        low[0] = std::min<double>(low[0], v.x), high[0] = std::max<double>(high[0], v.x);
        low[1] = std::min<double>(low[1], v.y), high[1] = std::max<double>(high[1], v.y);
    }
    for (int k = 0; k < 2; ++k) in.stock_min[k] = low[k] - 25, in.stock_max[k] = high[k] + 25;
    for (std::size_t l = 0; l < made.plan.layers.size(); ++l) {
        const Layer& layer = made.plan.layers[l];
        in.layers.push_back({layer.z_bottom, layer.z_top, layer.slab_thickness});
        for (const Operation& op : layer.operations) {
            Program p = read_gcode(program_text(made.plan, layer, op), "program");
            p.layer = static_cast<int>(l), p.kind = op.kind, p.planned_tool = p.tool;
            in.programs.push_back(std::move(p));
        }
    }
    made_size = size_mm;
    return made;
}

/// MiB of the process at its peak since the last reset (Linux); 0 where that cannot be known.
double peak_mib(bool reset) {
    if (reset) std::ofstream("/proc/self/clear_refs") << "5";
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.rfind("VmHWM:", 0) == 0) return std::stod(line.substr(6)) / 1024;
    return 0;
}

void simulate_metre_pattern(benchmark::State& state) {
    const Planned& p = planned(static_cast<int>(state.range(0)));
    Context context({.threads = static_cast<int>(state.range(1))});
    double metres = 0, cells = 0, square_metres = 0;
    const double before = peak_mib(true);
    for (auto _ : state) {
        const SimulationReport r = simulate(context, p.input, StandingPart(context, p.input.mesh));
        metres = r.cutting_mm / 1000;
        cells = static_cast<double>(r.nx) * r.ny * static_cast<double>(r.layers.size());
        square_metres = r.nx * r.cell * r.ny * r.cell * 1e-6;
    }
    state.counters["cut_m"] = metres;
    state.counters["cut_m/s"] = benchmark::Counter(metres, benchmark::Counter::kIsIterationInvariantRate);
    state.counters["cells/s"] = benchmark::Counter(cells, benchmark::Counter::kIsIterationInvariantRate);
    state.counters["MiB/m2"] = (peak_mib(false) - before) / square_metres;
}
BENCHMARK(simulate_metre_pattern)
    ->ArgNames({"size_mm", "threads"})
    ->Args({290, 1})
    ->Args({290, 2})
    ->Args({580, 1})
    ->Args({580, 2})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void check_gouge_metre_pattern(benchmark::State& state) {
    const Planned& p = planned(290);
    Context context({.threads = static_cast<int>(state.range(0))});
    const StandingPart part(context, p.input.mesh);
    double motions = 0, metres = 0;
    for (auto _ : state) {
        motions = metres = 0;
        for (const Program& program : p.input.programs) {
            for (const Tool& tool : p.input.tools) {
                if (tool.number != program.tool) continue;
                const GougeReport r =
                    check_gouge(context, part, p.input.layers[static_cast<std::size_t>(program.layer)].z_top,
                                tool, program);
                motions += static_cast<double>(r.motions), metres += r.length_mm / 1000;
            }
        }
    }
    state.counters["motions"] = motions;
    state.counters["motions/s"] = benchmark::Counter(motions, benchmark::Counter::kIsIterationInvariantRate);
    state.counters["m/s"] = benchmark::Counter(metres, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(check_gouge_metre_pattern)
    ->ArgName("threads")
    ->Arg(1)
    ->Arg(2)
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabwright

BENCHMARK_MAIN();
