// How true the time left is that a progress bar shows while a pattern is planned, written and verified: after
// the first tenth of the progress and of the time, the time that was foretold over the time that it took in
// the end.
//     SLABWRIGHT_CORPUS=corpus build/release/time_left_bench --benchmark_counters_tabular=true
// Generated patterns, the pump cover, and where SLABWRIGHT_CORPUS is set two of its castings.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "io/slabwright.h"
#include "kernels/geometry/vectors.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

namespace fs = std::filesystem;

std::string written(const MetrePattern& pattern, const fs::path& folder) {
    std::string file = (folder / "pattern.stl").string();
    std::ofstream out(file, std::ios::binary);
    out << stl_head("metre", metre_pattern_facets(pattern));
    metre_pattern(pattern, [&](const Facet& facet) { out.write(stl_facet(facet).data(), 50); });
    return file;
}

/// A folder that goes with all it holds.
struct Scratch {
    fs::path path = fs::temp_directory_path() / ("slabwright_time_left_" + std::to_string(::getpid()));
    Scratch() { fs::create_directories(path); }
    ~Scratch() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
};

double processor_seconds() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The time left that was foretold over the time that it took. By the clock it is what a user sees; by the
/// processor time of all threads it does not depend on what else the machine does.
struct Foretold {
    double least = kUnbounded, most = 0;
    double left_when_wrong =
        0;  ///< the share of all time that was left when it was first wrong by more than a factor of two

    void add(double at, double total, double fraction) {
        // Neither at the very end, where both are nothing.
        if (fraction < 0.1 || at < 0.1 * total || total - at < 0.02 * total) return;
        const double foretold = at * (1 - fraction) / fraction, was = total - at;
        least = std::min(least, foretold / was), most = std::max(most, foretold / was);
        if (foretold < was / 2 || foretold > 2 * was)
            left_when_wrong = std::max(left_when_wrong, was / total);
    }
};

/// @param cell_mm between the points of the stock; 0: as fine as the cutters ask for
void measure(benchmark::State& state, const std::string& stl, const Scratch& scratch, double cell_mm,
             int threads) {
    Foretold clock, processor;
    bool falls = false;
    for (auto _ : state) {
        const auto begin = std::chrono::steady_clock::now();
        const double begin_s = processor_seconds();
        struct Shown {
            double clock_s, processor_s, fraction;
        };
        const auto now = [&](double fraction) {
            return Shown{std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
                         processor_seconds() - begin_s, fraction};
        };
        std::vector<Shown> shown;
        Context context(
            {.threads = threads, .progress = [&](const Progress& p) { shown.push_back(now(p.fraction)); }});
        context.share_progress(0, kPlanningShare);
        Job job;
        job.allow_undercut = true;
        job.bonding.accept_weak = true;
        const Plan planned = plan(context, stl, job);
        const VerifyResult result =
            write_verified(context, planned, (scratch.path / "out").string(), stl, cell_mm);
        if (!result.passed) state.SkipWithError("the plan does not make the part");
        const Shown end = now(1);
        double last = 0;
        for (const Shown& s : shown) {
            falls = falls || s.fraction < last;
            last = s.fraction;
            clock.add(s.clock_s, end.clock_s, s.fraction);
            processor.add(s.processor_s, end.processor_s, s.fraction);
        }
        if (falls) state.SkipWithError("progress falls");
    }
    state.counters["least"] = clock.least;
    state.counters["most"] = clock.most;
    state.counters["left_when_wrong"] = clock.left_when_wrong;
    state.counters["processor_least"] = processor.least;
    state.counters["processor_most"] = processor.most;
}

void time_left(benchmark::State& state) {
    MetrePattern pattern;
    pattern.size_mm = static_cast<double>(state.range(0));
    pattern.height_mm = 0.25 * pattern.size_mm;
    pattern.facets = static_cast<std::uint64_t>(state.range(1));
    const Scratch scratch;
    measure(state, written(pattern, scratch.path), scratch, 0.5, static_cast<int>(state.range(2)));
}
BENCHMARK(time_left)
    ->ArgNames({"size_mm", "facets", "threads"})
    ->Args({290, 60'000, 2})
    ->Args({580, 100'000, 2})
    ->Args({1160, 100'000, 2})
    ->Args({1160, 1'000'000, 2})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kSecond);

void time_left_of_part(benchmark::State& state, const std::string& stl) {
    const Scratch scratch;
    measure(state, stl, scratch, 0, 2);
}

void add_parts() {
    std::vector<std::string> parts{"tests/data/pump-cover.stl"};
    if (const char* const corpus = std::getenv("SLABWRIGHT_CORPUS"); corpus != nullptr)
        for (const char* const part : {"bearing_block", "casting_cover"})
            parts.push_back((fs::path(corpus) / "castings" / part).string() + ".stl");
    for (const std::string& part : parts)
        benchmark::RegisterBenchmark(("time_left_of_part/" + fs::path(part).stem().string()).c_str(),
                                     time_left_of_part, part)
            ->Iterations(1)
            ->UseRealTime()
            ->Unit(benchmark::kSecond);
}

}  // namespace
}  // namespace slabwright

int main(int argc, char** argv) {
    slabwright::add_parts();
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
