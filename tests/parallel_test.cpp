// kernels/parallel: the same results as serial code on any number of threads, and the promises on errors,
// cancel, memory and progress.
#include "kernels/parallel/parallel.h"
#include "kernels/parallel/progress_part.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "kernels/errors.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

constexpr int kThreads[] = {1, 2, 4};

TEST(Parallel, ForVisitsEveryIndexOnceInChunksOfTheGrain) {
    for (const int threads : kThreads) {
        Context context({.threads = threads});
        for (const std::size_t n : {0u, 1u, 7u, 1000u, 100001u}) {
            for (const std::size_t grain : {0u, 1u, 13u, 4096u, 200000u}) {
                if (n > 10000 && grain < 2) continue;
                std::vector<std::atomic<int>> seen(n);
                parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
                    const std::size_t step = grain == 0 ? 1 : grain;
                    EXPECT_EQ(begin % step, 0u);
                    EXPECT_EQ(end, std::min(n, begin + step));
                    for (std::size_t i = begin; i < end; ++i) ++seen[i];
                });
                for (std::size_t i = 0; i < n; ++i)
                    ASSERT_EQ(seen[i].load(), 1) << i << " of " << n << " by " << grain;
            }
        }
    }
}

TEST(Parallel, EachVisitsEveryIndexOnce) {
    Context context({.threads = 4});
    std::vector<std::atomic<int>> seen(777);
    parallel_each(context, seen.size(), [&](std::size_t i) { ++seen[i]; });
    for (const auto& count : seen) EXPECT_EQ(count.load(), 1);
}

TEST(Parallel, NestedLoopsFinish) {
    Context context({.threads = 2});
    std::atomic<int> total{0};
    parallel_each(context, 20,
                  [&](std::size_t) { parallel_each(context, 20, [&](std::size_t) { ++total; }); });
    EXPECT_EQ(total.load(), 400);
}

TEST(Parallel, ReduceJoinsFromLeftToRight) {
    for (const int threads : kThreads) {
        Context context({.threads = threads});
        const std::string text = parallel_reduce(
            context, 1000, 7, std::string(),
            [](std::size_t begin, std::size_t end) {
                std::string part;
                for (std::size_t i = begin; i < end; ++i) part += std::to_string(i) + ",";
                return part;
            },
            [](std::string a, const std::string& b) { return std::move(a) + b; });
        std::string expected;
        for (int i = 0; i < 1000; ++i) expected += std::to_string(i) + ",";
        EXPECT_EQ(text, expected);
        EXPECT_EQ(parallel_reduce(
                      context, 0, 7, 42, [](std::size_t, std::size_t) { return 1; },
                      [](int a, int b) { return a + b; }),
                  42);
    }
}

TEST(Parallel, SumsOfDoublesHaveTheSameBitsOnAnyNumberOfThreads) {
    std::mt19937_64 random(test::seed());
    std::vector<double> values(300007);
    for (double& value : values) value = std::uniform_real_distribution(-1e6, 1e6)(random);
    std::vector<double> sums;
    for (const int threads : kThreads) {
        Context context({.threads = threads});
        sums.push_back(parallel_reduce(
            context, values.size(), 1000, 0.0,
            [&](std::size_t begin, std::size_t end) {
                return std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(begin),
                                       values.begin() + static_cast<std::ptrdiff_t>(end), 0.0);
            },
            [](double a, double b) { return a + b; }));
    }
    EXPECT_EQ(sums[0], sums[1]);
    EXPECT_EQ(sums[0], sums[2]);
    EXPECT_NEAR(sums[0], std::accumulate(values.begin(), values.end(), 0.0), 1e-3);
}

TEST(Parallel, SortEqualsStdSort) {
    std::mt19937_64 random(test::seed());
    struct Item {
        std::uint32_t key, id;
        bool operator==(const Item&) const = default;
    };
    auto less = [](const Item& a, const Item& b) { return a.key != b.key ? a.key < b.key : a.id < b.id; };
    const std::size_t serial = std::size_t{1} << 14;
    for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{2}, serial - 1, serial,
                                serial + 1, 2 * serial + 1, std::size_t{100000}, std::size_t{1200001}}) {
        for (const std::uint32_t keys : {1u, 5u, 0xFFFFFFFFu}) {
            for (const int order : {0, 1, 2}) {  // as drawn, ascending, descending
                std::vector<Item> items(n);
                for (std::size_t i = 0; i < n; ++i)
                    items[i] = {static_cast<std::uint32_t>(random() % (std::uint64_t{keys} + 1)),
                                static_cast<std::uint32_t>(i)};
                if (order == 1) std::sort(items.begin(), items.end(), less);
                if (order == 2)
                    std::sort(items.begin(), items.end(),
                              [&](const Item& a, const Item& b) { return less(b, a); });
                std::vector<Item> expected = items;
                std::sort(expected.begin(), expected.end(), less);
                for (const int threads : kThreads) {
                    std::vector<Item> sorted = items;
                    Context context({.threads = threads});
                    parallel_sort(context, sorted.begin(), sorted.end(), less);
                    ASSERT_TRUE(sorted == expected)
                        << n << " items, " << keys << " keys, order " << order << ", threads " << threads;
                }
                if (n > 1000000) break;
            }
        }
    }
}

TEST(Parallel, TheExceptionOfTheLowestChunkArrives) {
    std::mt19937_64 random(test::seed());
    for (const int threads : kThreads) {
        Context context({.threads = threads});
        for (int round = 0; round < 30; ++round) {
            std::set<std::size_t> failing;
            while (failing.size() < 5) failing.insert(random() % 500);
            std::string message;
            try {
                parallel_each(context, 500, [&](std::size_t i) {
                    // The lowest is made to fail last in time.
                    if (i == *failing.begin()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
                    if (failing.count(i) != 0) throw Error(ErrorKind::input, "test.fail", std::to_string(i));
                });
                FAIL() << "nothing was thrown";
            } catch (const Error& error) {
                message = error.message();
            }
            EXPECT_EQ(message, std::to_string(*failing.begin())) << "threads " << threads;
        }
    }
}

TEST(Parallel, ExceptionsOfOtherTypesPassThrough) {
    Context context({.threads = 2});
    EXPECT_THROW(parallel_each(context, 10,
                               [](std::size_t i) {
                                   if (i == 3) throw std::out_of_range("three");
                               }),
                 std::out_of_range);
}

TEST(Parallel, CancelFromAnotherThreadStopsSoon) {
    for (const int threads : kThreads) {
        Context context({.threads = threads});
        std::atomic<std::size_t> done{0};
        std::thread canceller([&] {
            while (done.load() < 5) std::this_thread::yield();
            context.cancel();
        });
        bool cancelled = false;
        try {
            parallel_each(context, 1000000, [&](std::size_t) {
                ++done;
                std::this_thread::sleep_for(std::chrono::microseconds(200));
            });
        } catch (const Error& error) {
            cancelled = error.kind() == ErrorKind::cancelled;
        }
        canceller.join();
        EXPECT_TRUE(cancelled);
        EXPECT_LT(done.load(), 100000u);
        EXPECT_TRUE(context.cancelled());
        EXPECT_THROW(parallel_each(context, 1, [](std::size_t) {}), Error)
            << "a cancelled context stays cancelled";
    }
}

TEST(Parallel, MemoryIsChargedUpToTheLimit) {
    Context context({.threads = 1, .memory_bytes = 1000});
    EXPECT_EQ(context.memory_limit(), 1000u);
    {
        const MemoryCharge first(context, 600, "the first");
        EXPECT_EQ(context.memory_charged(), 600u);
        try {
            const MemoryCharge second(context, 401, "the second");
            FAIL() << "over the limit";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::no_plan);
            EXPECT_EQ(error.code(), "memory.limit");
            EXPECT_NE(error.message().find("the second"), std::string::npos);
            EXPECT_FALSE(error.remedy().empty());
        }
        EXPECT_EQ(context.memory_charged(), 600u);
        const MemoryCharge third(context, 400, "the third");
        EXPECT_EQ(context.memory_charged(), 1000u);
    }
    EXPECT_EQ(context.memory_charged(), 0u);
    EXPECT_GT(Context().memory_limit(), 0u);
}

TEST(Parallel, ProgressNeverFallsAndStaysInItsPhase) {
    for (const int threads : kThreads) {
        std::vector<double> fractions;
        std::vector<std::string> phases;
        std::atomic<int> inside{0};
        bool overlapped = false;
        Context context({.threads = threads, .progress = [&](const Progress& progress) {
                             overlapped |= ++inside != 1;
                             fractions.push_back(progress.fraction);
                             phases.emplace_back(progress.phase);
                             --inside;
                         }});
        context.begin_phase("one", 0.0, 0.5, 1000);
        parallel_each(context, 1500, [&](std::size_t) { context.advance(); });  // more steps than announced
        context.begin_phase("two", 0.5, 1.0, 10);
        parallel_each(context, 10, [&](std::size_t) { context.advance(); });
        EXPECT_FALSE(overlapped);
        ASSERT_GT(fractions.size(), 2u);
        for (std::size_t i = 0; i < fractions.size(); ++i) {
            if (i > 0) {
                EXPECT_GE(fractions[i], fractions[i - 1]);
            }
            if (phases[i] == "one") {
                EXPECT_LE(fractions[i], 0.5);
            }
        }
        EXPECT_EQ(phases.front(), "one");
        EXPECT_EQ(phases.back(), "two");
        EXPECT_DOUBLE_EQ(fractions.back(), 1.0);
    }
}

TEST(Parallel, PartsOfAPhaseTellAllTheirStepsOnce) {
    std::vector<double> fractions;
    Context context({.threads = 2,
                     .progress = [&](const Progress& progress) { fractions.push_back(progress.fraction); }});
    context.advance(7);
    EXPECT_TRUE(fractions.empty()) << "no phase has begun";
    context.begin_phase("work", 0.0, 1.0, 300);
    {
        ProgressPart whole(context, 100), first(whole, 0, 0.4), second(whole, 0.4, 1);
        first.reach(0.5);
        EXPECT_NEAR(fractions.back(), 20 / 300.0, 1e-12);
        first.reach(1);
        EXPECT_NEAR(fractions.back(), 40 / 300.0, 1e-12);
        second.reach(0.1);
        first.reach(0.7);  // has been told
        EXPECT_NEAR(fractions.back(), 46 / 300.0, 1e-12);
        second.reach(7);
        EXPECT_NEAR(fractions.back(), 100 / 300.0, 1e-12);
    }
    parallel_each(context, 2, [&](std::size_t) {
        ProgressPart part(context, 100);
        for (int i = 0; i <= 1000; ++i) part.reach(i / 1000.0);
    });
    EXPECT_DOUBLE_EQ(fractions.back(), 1.0);
}

TEST(Parallel, ThreadsAreAsAskedFor) {
    EXPECT_EQ(Context({.threads = 3}).threads(), 3);
    EXPECT_GE(Context().threads(), 1);
    Context context({.threads = 2});
    std::mutex mutex;
    std::set<std::thread::id> ids;
    parallel_each(context, 2000, [&](std::size_t) {
        std::this_thread::sleep_for(std::chrono::microseconds(20));
        const std::lock_guard lock(mutex);
        ids.insert(std::this_thread::get_id());
    });
    EXPECT_LE(ids.size(), 2u);
}

}  // namespace
}  // namespace slabwright
