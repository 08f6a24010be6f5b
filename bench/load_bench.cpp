// How fast an STL becomes a mesh: read, weld, adjacency, beside what the machine's memory can do in the same
// run.
//     build/release/load_bench --benchmark_counters_tabular=true
// The generated pattern (metre_pattern) is written to a temporary folder, in the order it is made and
// shuffled, and removed at the end. `read_mesh` is what other programs' loaders do too; `read_pattern_mesh`
// adds the SHA-256 of the file and the report of all that is wrong. A file that does not load, or not with
// all of its facets, stops the program.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "bench/peak_memory.h"
#include "io/read/pattern_mesh.h"
#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

[[noreturn]] void stop(const std::string& why) {
    std::fprintf(stderr, "load_bench: %s\n", why.c_str());
    std::exit(1);
}

/// The files that the benchmarks read; each is written when it is first asked for.
class Files {
public:
    Files()
        : folder_(std::filesystem::temp_directory_path() /
                  ("slabwright-load-" + std::to_string(::getpid()))) {
        std::filesystem::create_directory(folder_);
    }
    ~Files() {
        std::error_code ignored;
        std::filesystem::remove_all(folder_, ignored);
    }
    Files(const Files&) = delete;
    Files& operator=(const Files&) = delete;

    struct File {
        std::string path;
        std::uint64_t facets = 0;
    };
    const File& get(std::uint64_t facets, bool shuffled) {
        const std::pair key(facets, shuffled);
        if (const auto it = made_.find(key); it != made_.end()) return it->second;
        MetrePattern pattern;
        pattern.facets = facets;
        File file{(folder_ / (std::to_string(facets) + (shuffled ? "-shuffled.stl" : ".stl"))).string(),
                  metre_pattern_facets(pattern)};
        std::ofstream out(file.path, std::ios::binary);
        const std::string head = stl_head("metre", file.facets);
        out.write(head.data(), static_cast<std::streamsize>(head.size()));
        if (shuffled) {
            std::vector<std::array<char, 50>> records;
            records.reserve(file.facets);
            metre_pattern(pattern, [&](const Facet& facet) { records.push_back(stl_facet(facet)); });
            std::mt19937_64 random(1);
            for (std::size_t i = records.size(); i > 1; --i) std::swap(records[i - 1], records[random() % i]);
            out.write(records.front().data(),
                      static_cast<std::streamsize>(records.size() * sizeof records[0]));
        } else {
            metre_pattern(pattern, [&](const Facet& facet) {
                const auto record = stl_facet(facet);
                out.write(record.data(), record.size());
            });
        }
        if (!out.flush()) stop(file.path + " cannot be written");
        return made_.emplace(key, std::move(file)).first->second;
    }

private:
    std::filesystem::path folder_;
    std::map<std::pair<std::uint64_t, bool>, File> made_;
};

Files& files() {
    static Files all;
    return all;
}

/// STREAM's triad, a = b + s·c, on arrays far larger than the caches: what all else is to be compared with.
/// Bytes as STREAM counts them: two read, one written.
void triad(benchmark::State& state) {
    const std::size_t n = std::size_t{1} << 25;
    Context context({.threads = static_cast<int>(state.range(0))});
    std::vector<double> a(n, 1), b(n, 2), c(n, 3);
    for (auto _ : state) {
        parallel_for(context, n, std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) a[i] = b[i] + 0.5 * c[i];
        });
        benchmark::DoNotOptimize(a.data());
        benchmark::ClobberMemory();
    }
    state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                            static_cast<std::int64_t>(3 * n * sizeof(double)));
}
BENCHMARK(triad)->ArgName("threads")->Arg(1)->Arg(2)->MeasureProcessCPUTime()->UseRealTime()->Unit(
    benchmark::kMillisecond);

/// Loads the file of the arguments (facets, threads, shuffled) with `load(context, path)`, which returns the
/// number of facets.
template <class Load>
void measure(benchmark::State& state, Load&& load) {
    const Files::File& file = files().get(static_cast<std::uint64_t>(state.range(0)), state.range(2) != 0);
    Context context({.threads = static_cast<int>(state.range(1))});
    double peak = 0;
    for (auto _ : state) {
        try {
            PeakMemory memory;
            const std::uint64_t facets = load(context, file.path);
            peak = std::max(peak, memory.finish());
            if (facets != file.facets)
                stop(file.path + " was read with " + std::to_string(facets) + " facets");
        } catch (const Error& error) {
            stop(error.what());
        }
    }
    const double facets = static_cast<double>(file.facets);
    state.counters["facets/s"] = benchmark::Counter(facets, benchmark::Counter::kIsIterationInvariantRate);
    state.counters["anonymous bytes/facet"] = peak / facets;
    state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                            static_cast<std::int64_t>(std::filesystem::file_size(file.path)));
}

void read_whole(benchmark::State& state) {
    measure(state, [](Context& context, const std::string& path) {
        const PatternMesh stl = read_pattern_mesh(context, path);
        if (stl.report.open_edges.count != 0) stop(path + " is not closed");
        return static_cast<std::uint64_t>(stl.mesh.facets.size());
    });
}

void read_only(benchmark::State& state) {
    measure(state, [](Context& context, const std::string& path) {
        const Mesh mesh = read_mesh(context, path);
        if (mesh.neighbours.size() != mesh.facets.size()) stop(path + " was read without adjacency");
        return static_cast<std::uint64_t>(mesh.facets.size());
    });
}

void sizes(benchmark::internal::Benchmark* bench) {
    bench->ArgNames({"facets", "threads", "shuffled"})
        ->MeasureProcessCPUTime()
        ->UseRealTime()
        ->Unit(benchmark::kMillisecond);
    for (const std::int64_t facets : {100'000, 1'000'000, 10'000'000})
        for (const std::int64_t shuffled : {0, 1})
            for (const std::int64_t threads : {1, 2}) bench->Args({facets, threads, shuffled});
}
BENCHMARK(read_only)->Name("read_mesh")->Apply(sizes);
BENCHMARK(read_whole)->Name("read_pattern_mesh")->Apply(sizes);

}  // namespace
}  // namespace slabwright

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    if (benchmark::RunSpecifiedBenchmarks() == 0) {
        std::fprintf(stderr, "load_bench: nothing ran\n");
        return 1;
    }
    return 0;
}
