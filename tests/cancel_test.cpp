// Cancel from another thread in every phase of a whole plan with verification, and progress that never falls.
//     SLABWRIGHT_SCALE=1000000 build/release/cancel_test
// does the same on a pattern of so many facets and a metre's width, where every phase must end within half a
// second of cancel().
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "io/slabwright.h"
#include "kernels/errors.h"
#include "tests/data/models.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using support::TemporaryFolder;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// A phase that was reported, and how long it ran.
struct Phase {
    std::string name;
    Clock::time_point begin;
    double seconds = 0;
};

/// Runs `work` once to the end. @return its phases, in their order
std::vector<Phase> phases_of(const std::function<void(Context&)>& work) {
    std::vector<Phase> phases;
    double last = 0;
    Context context({.threads = 2, .progress = [&](const Progress& progress) {
                         EXPECT_GE(progress.fraction, last) << progress.phase;
                         EXPECT_LE(progress.fraction, 1);
                         last = progress.fraction;
                         if (!phases.empty() && phases.back().name == progress.phase) return;
                         if (!phases.empty()) phases.back().seconds = seconds_since(phases.back().begin);
                         phases.push_back({std::string(progress.phase), Clock::now()});
                     }});
    work(context);
    EXPECT_FALSE(phases.empty());
    if (!phases.empty()) phases.back().seconds = seconds_since(phases.back().begin);
    EXPECT_EQ(context.memory_charged(), 0u);
    return phases;
}

/// Runs `work` until its phase number `index` has lasted for `delay_s`, then cancels it from a thread of its
/// own.
/// @return seconds from cancel() to the end; negative when the work ended before
double cancel_in(const std::function<void(Context&)>& work, const std::vector<Phase>& phases,
                 std::size_t index, double delay_s) {
    std::mutex mutex;
    std::condition_variable reached;
    std::size_t at = 0;  // phases begun so far
    std::string now;
    bool finished = false;
    Clock::time_point asked{};
    std::atomic<int> begun_after{0};
    std::atomic<bool> was_cancelled{false};
    Context context({.threads = 2, .progress = [&](const Progress& progress) {
                         const std::lock_guard lock(mutex);
                         if (now == progress.phase) return;
                         now = progress.phase;
                         if (was_cancelled) ++begun_after;
                         if (++at > index) reached.notify_all();
                     }});
    std::thread canceller([&] {
        std::unique_lock lock(mutex);
        reached.wait(lock, [&] { return at > index || finished; });
        reached.wait_for(lock, std::chrono::duration<double>(delay_s), [&] { return finished; });
        if (finished) return;
        lock.unlock();
        asked = Clock::now();
        context.cancel();
        was_cancelled = true;
    });
    bool cancelled = false;
    try {
        work(context);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::cancelled) << phases[index].name << ": " << error.what();
        cancelled = error.kind() == ErrorKind::cancelled;
    }
    const Clock::time_point end = Clock::now();
    {
        const std::lock_guard lock(mutex);
        finished = true;
    }
    reached.notify_all();
    canceller.join();
    EXPECT_EQ(context.memory_charged(), 0u) << phases[index].name;
    // One phase may just be beginning while cancel() is called.
    EXPECT_LE(begun_after.load(), 1) << "phases begin after " << phases[index].name << " was cancelled";
    return cancelled ? std::chrono::duration<double>(end - asked).count() : -1;
}

/// Cancels `work` in each of its phases, as it begins and in its middle.
/// @param brief_s a phase shorter than this is cancelled as it begins only: wherever it is cancelled, it is
/// over in time by itself, and the
///                next one's beginning is tested too. At a million facets every case costs all phases before
///                it once more.
void cancel_everywhere(const std::function<void(Context&)>& work, double limit_s, double brief_s,
                       const std::function<void()>& check) {
    const std::vector<Phase> phases = phases_of(work);
    std::size_t cancelled = 0;
    for (std::size_t i = 0; i < phases.size(); ++i) {
        for (const double share : {0.0, 0.5}) {
            if (share > 0 && phases[i].seconds < brief_s) continue;
            const double took = cancel_in(work, phases, i, share * phases[i].seconds);
            std::printf("%-16s %7.3f s, cancelled at %.1f: %s%.3f s\n", phases[i].name.c_str(),
                        phases[i].seconds, share, took < 0 ? "had ended; " : "", std::max(0.0, took));
            std::fflush(stdout);
            if (took < 0) continue;
            ++cancelled;
            EXPECT_LT(took, limit_s) << phases[i].name;
            check();
        }
    }
    // The middle of a short phase may be missed, its beginning hardly.
    EXPECT_GE(2 * cancelled, phases.size());
}

TEST(Cancel, StopsEveryPhaseAndLeavesNothing) {
    const char* wish = std::getenv("SLABWRIGHT_SCALE");
    MetrePattern pattern;
    pattern.facets = wish != nullptr ? std::strtoull(wish, nullptr, 10) : 3000;
    pattern.size_mm = wish != nullptr ? 1160 : 100;
    pattern.height_mm = wish != nullptr ? 300 : 20;
    // Without a wish it is not the time that is tested: a machine may be busy with much else.
    const double limit_s = wish != nullptr ? 0.5 : 20, brief_s = wish != nullptr ? limit_s / 2 : 0;
    if (wish == nullptr)
        std::printf("SLABWRIGHT_SCALE is not set: %llu facets\n",
                    static_cast<unsigned long long>(pattern.facets));

    const TemporaryFolder folder;
    const std::string stl = folder / "pattern.stl", out = folder / "out";
    {
        std::ofstream file(stl, std::ios::binary);
        const std::string head = stl_head("metre", metre_pattern_facets(pattern));
        file.write(head.data(), static_cast<std::streamsize>(head.size()));
        metre_pattern(pattern, [&](const Facet& facet) {
            const auto record = stl_facet(facet);
            file.write(record.data(), record.size());
        });
    }
    Job job;
    job.allow_undercut = true;
    job.bonding.accept_weak = true;
    Plan kept;
    cancel_everywhere(
        [&](Context& context) {
            Plan planned = plan(context, stl, job);
            if (kept.layers.empty()) kept = std::move(planned);
        },
        limit_s, brief_s, [] {});
    ASSERT_FALSE(kept.layers.empty());
    cancel_everywhere(
        [&](Context& context) {
            std::filesystem::remove_all(out);
            static_cast<void>(write_verified(context, kept, out, stl, wish != nullptr ? 0.5 : 0.0));
        },
        limit_s, brief_s,
        [&] {
            EXPECT_FALSE(std::filesystem::exists(out));
            std::size_t left = 0;
            for (const auto& entry : std::filesystem::directory_iterator(folder.path))
                left += entry.path() != stl;
            EXPECT_EQ(left, 0u) << "a half-written folder stays";
        });
}

}  // namespace
}  // namespace slabwright
