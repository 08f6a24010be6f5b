// How true the time left is that a progress bar shows while a pattern is planned, written and verified: after the first tenth of the
// progress and of the time, the time that was foretold over the time that it took in the end.
//     build/release/time_left_bench --benchmark_counters_tabular=true
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <vector>

#include "io/slabwright.h"
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

void time_left(benchmark::State& state) {
    MetrePattern pattern;
    pattern.size_mm = static_cast<double>(state.range(0));
    pattern.height_mm = 0.25 * pattern.size_mm;
    pattern.facets = static_cast<std::uint64_t>(state.range(1));
    const fs::path folder = fs::temp_directory_path() / ("slabwright_time_left_" + std::to_string(::getpid()));
    fs::create_directories(folder);
    const std::string stl = written(pattern, folder);
    double least = 1e300, most = 0, last = 0, left_when_wrong = 0;
    bool falls = false;
    for (auto _ : state) {
        using Clock = std::chrono::steady_clock;
        const Clock::time_point begin = Clock::now();
        const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
        struct Shown {
            double at, fraction;
        };
        std::vector<Shown> shown;
        Context context({.threads = static_cast<int>(state.range(2)), .progress = [&](const Progress& p) {
                             shown.push_back({elapsed(), p.fraction});
                         }});
        context.share_progress(0, kPlanningShare);
        Job job;
        job.allow_undercut = true;
        const Plan planned = plan(context, stl, job);
        const VerifyResult result = write_verified(context, planned, (folder / "out").string(), stl, 0.5);
        if (!result.passed) state.SkipWithError("the plan does not make the part");
        const double total = elapsed();
        for (const Shown& s : shown) {
            falls = falls || s.fraction < last;
            last = s.fraction;
            // Neither at the very end, where both are nothing.
            if (s.fraction < 0.1 || s.at < 0.1 * total || total - s.at < 0.02 * total) continue;
            const double foretold = s.at * (1 - s.fraction) / s.fraction, was = total - s.at;
            least = std::min(least, foretold / was), most = std::max(most, foretold / was);
            if (foretold < was / 2 || foretold > 2 * was) left_when_wrong = std::max(left_when_wrong, was / total);
        }
        if (falls) state.SkipWithError("progress falls");
    }
    fs::remove_all(folder);
    state.counters["least"] = least;
    state.counters["most"] = most;
    // The share of all time that was left when the time foretold was first wrong by more than a factor of two.
    state.counters["left_when_wrong"] = left_when_wrong;
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

}  // namespace
}  // namespace slabwright

BENCHMARK_MAIN();
