// The nearest run among those left, against brute force; and the order that comes of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "engine/moves/order.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

std::int64_t way(Point2 a, Point2 b) {
    const std::int64_t dx = std::int64_t{a.x} - b.x, dy = std::int64_t{a.y} - b.y;
    return dx * dx + dy * dy;
}

double length(const std::vector<Beginning>& order, Point2 from) {
    double sum = 0;
    for (const Beginning& b : order) {
        sum += std::sqrt(static_cast<double>(way(from, b.at)));
        from = b.end;
    }
    return sum;
}

// Runs that may be made either way, of which some end where they begin.
std::vector<Beginning> random_ends(std::mt19937& random, std::uint32_t runs, std::int32_t size) {
    std::uniform_int_distribution<std::int32_t> u(0, size), reach(0, size / 10);
    std::vector<Beginning> ends;
    for (std::uint32_t k = 0; k < runs; ++k) {
        const Point2 a{u(random), u(random)}, b{a.x + reach(random), a.y + reach(random)};
        if (k % 4 == 0) {
            ends.push_back({a, a, k, 0});
            continue;
        }
        ends.push_back({a, b, k, 0});
        ends.push_back({b, a, k, 1});
    }
    return ends;
}

}  // namespace

TEST(ShortenedOrder, VisitsTheSameRunsOnAShorterWay) {
    std::mt19937 random(test::seed());
    for (const std::uint32_t runs : {0U, 1U, 2U, 5U, 40U, 600U, 20'000U}) {
        const std::vector<Beginning> ends = random_ends(random, runs, 1'000'000),
                                     nearest = nearest_order(ends, runs, {0, 0}),
                                     order = shortened(nearest, {0, 0});
        ASSERT_EQ(order.size(), runs);
        std::vector<char> seen(runs, 0);
        for (const Beginning& b : order) {
            ASSERT_FALSE(seen[b.run]++);
            EXPECT_TRUE(std::any_of(ends.begin(), ends.end(),
                                    [&](const Beginning& e) {
                                        return e.run == b.run && e.place == b.place && e.at == b.at &&
                                               e.end == b.end;
                                    }) ||
                        runs > 1000);
        }
        EXPECT_LE(length(order, {0, 0}), length(nearest, {0, 0}));
        if (runs == 600) {
            EXPECT_LT(length(order, {0, 0}), 0.9 * length(nearest, {0, 0}));
        }
    }
}

// Few runs in all orders and all ways round.
TEST(ShortenedOrder, IsHardlyLongerThanTheShortest) {
    std::mt19937 random(test::seed());
    constexpr std::uint32_t runs = 6;
    double found = 0, shortest = 0, first = 0;
    for (int trial = 0; trial < 30; ++trial) {
        const std::vector<Beginning> ends = random_ends(random, runs, 1'000'000),
                                     nearest = nearest_order(ends, runs, {0, 0});
        std::array<std::uint32_t, runs> order{0, 1, 2, 3, 4, 5};
        double best = 1e300;
        do
            for (std::uint32_t ways = 0; ways < 1U << runs; ++ways) {
                std::vector<Beginning> visits;
                for (const std::uint32_t run : order)
                    for (const Beginning& b : ends)
                        if (b.run == run && b.place == (run % 4 == 0 ? 0 : ways >> run & 1U))
                            visits.push_back(b);
                best = std::min(best, length(visits, {0, 0}));
            }
        while (std::next_permutation(order.begin(), order.end()));
        const double length_found = length(shortened(nearest, {0, 0}), {0, 0});
        EXPECT_GE(length_found, best - 1);
        found += length_found;
        shortest += best;
        first += length(nearest, {0, 0});
    }
    EXPECT_LT(found, 1.05 * shortest) << "the nearest one by one: " << first / shortest;
}

TEST(NearestRuns, AgreesWithBruteForce) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    for (const std::int32_t size : {6, 1000, 11'600'000}) {  // the first has many ties
        std::uniform_int_distribution<std::int32_t> u(-size, size);
        const std::uint32_t runs = 400;
        std::vector<Beginning> beginnings;
        for (std::uint32_t k = 0; k < runs; ++k)
            for (std::uint32_t p = 0; p < 1 + k % 3; ++p)
                beginnings.push_back({{u(random), u(random)}, {u(random), u(random)}, k, p});
        std::vector<char> done(runs, 0);
        NearestRuns left(beginnings, runs);
        std::uint32_t restored = 0;
        for (std::uint32_t k = 0; k < runs + restored; ++k) {
            ASSERT_FALSE(left.empty());
            const Point2 at{u(random), u(random)};
            const Beginning found = left.nearest(at);
            const auto best = std::min_element(
                beginnings.begin(), beginnings.end(), [&](const Beginning& a, const Beginning& b) {
                    return std::tuple(done[a.run], way(a.at, at), a.run, a.place) <
                           std::tuple(done[b.run], way(b.at, at), b.run, b.place);
                });
            ASSERT_EQ(found.run, best->run);
            ASSERT_EQ(found.place, best->place);
            EXPECT_EQ(found.at, best->at);
            done[found.run] = 1;
            left.remove(found.run);
            // Some that were taken out are put back in.
            if (const auto back = static_cast<std::uint32_t>(random() % runs);
                restored < 100 && done[back] != 0) {
                done[back] = 0;
                left.restore(back);
                ++restored;
            }
        }
        EXPECT_TRUE(left.empty());
    }
}

TEST(NearestRuns, OrderVisitsEveryRunOnceAndGoesOnFromItsEnd) {
    // Three lines, boustrophedon: up the first, down the second, up the third.
    std::vector<Beginning> ends;
    for (std::uint32_t k = 0; k < 3; ++k) {
        const Point2 a{0, static_cast<std::int32_t>(k) * 10}, b{1000, static_cast<std::int32_t>(k) * 10};
        ends.push_back({a, b, k, 0});
        ends.push_back({b, a, k, 1});
    }
    const std::vector<Beginning> order = nearest_order(ends, 3, {0, -5});
    ASSERT_EQ(order.size(), 3U);
    for (std::uint32_t k = 0; k < 3; ++k) {
        EXPECT_EQ(order[k].run, k);
        EXPECT_EQ(order[k].place, k % 2);
    }
    EXPECT_TRUE(nearest_order({}, 0, {0, 0}).empty());
}

TEST(NearestRuns, TakesOneHundredThousand) {
    std::mt19937 random(5);
    std::uniform_int_distribution<std::int32_t> u(0, 11'600'000);
    const std::uint32_t runs = 100'000;
    std::vector<Beginning> ends;
    std::vector<char> seen(runs, 0);
    for (std::uint32_t k = 0; k < runs; ++k) {
        const Point2 a{u(random), u(random)}, b{a.x + 3000, a.y};
        ends.push_back({a, b, k, 0});
        ends.push_back({b, a, k, 1});
    }
    const std::vector<Beginning> order = nearest_order(ends, runs, {0, 0});
    ASSERT_EQ(order.size(), runs);
    double total = 0;
    for (std::size_t k = 0; k < order.size(); ++k) {
        ASSERT_FALSE(seen[order[k].run]++);
        if (k > 0) total += std::sqrt(static_cast<double>(way(order[k - 1].end, order[k].at)));
    }
    // A tour through n even random places in a square of side L is about 0.71 √n L; the nearest neighbour's
    // is a quarter longer.
    EXPECT_LT(total, 1.3 * 0.7124 * std::sqrt(runs) * 11'600'000);
}
