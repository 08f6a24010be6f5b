// Lines of rest passes lie along what is to be lowered, and cover all of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "engine/paths/operations/line_directions.h"
#include "kernels/geometry/units.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

const CellGrid kGrid{-31.3, 17.7, 0.2, 400, 300};

std::vector<CellRuns> rows_of(const auto& is_target) {
    std::vector<CellRuns> rows(static_cast<std::size_t>(kGrid.ny));
    for (int j = 0; j < kGrid.ny; ++j)
        for (int i = 0; i < kGrid.nx; ++i) {
            if (!is_target(kGrid.x(i), kGrid.y(j))) continue;
            CellRuns& row = rows[static_cast<std::size_t>(j)];
            if (!row.empty() && row.back()[1] + 1 == i) row.back()[1] = i;
            else row.push_back({i, i});
        }
    return rows;
}

/// Whether the line of a place (0.1 µm along it and across it) covers it: within a stretch, to a unit.
bool lies_in(const Spans& spans, double along) {
    return std::any_of(spans.begin(), spans.end(), [&](const auto& s) {
        return along * kUnitsPerMm >= s[0] - 1 && along * kUnitsPerMm <= s[1] + 1;
    });
}

TEST(LineDirections, BandsAreFollowed) {
    Context context({.threads = 2});
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> turn(0, std::numbers::pi), offset(-5, 5), wide(0.4, 2);
    for (int trial = 0; trial < 40; ++trial) {
        const double angle = turn(random), c = std::cos(angle), s = std::sin(angle), at = offset(random),
                     w = wide(random), x0 = kGrid.x(200), y0 = kGrid.y(150);
        const std::vector<CellRuns> rows = rows_of([&](double x, double y) {
            return std::abs(-s * (x - x0) + c * (y - y0) - at) < w / 2 &&
                   std::abs(c * (x - x0) + s * (y - y0)) < 20;
        });
        const LineDirections directions(context, kGrid, rows, 3);
        for (std::size_t d = 0; d < directions.all().size(); ++d) {
            const LineDirection& line = directions.all()[d];
            const double off = std::abs(std::remainder(std::atan2(line.s, line.c) - angle, std::numbers::pi));
            const auto [low, high] = directions.across(d);
            // Eight directions lie 18 to 27 degrees apart; along x is kept where others are not much longer.
            if (off > (d == 0 ? 0.6 : 0.42)) {
                EXPECT_GT(low, high) << trial << ": " << angle << ' ' << line.p << ' ' << line.q;
            }
        }
    }
}

TEST(LineDirections, WideAreasAreCrossedAlongX) {
    Context context({.threads = 2});
    const std::vector<CellRuns> rows =
        rows_of([&](double x, double y) { return std::hypot(x - kGrid.x(200), y - kGrid.y(150)) < 20; });
    const LineDirections directions(context, kGrid, rows, 3);
    for (std::size_t d = 1; d < directions.all().size(); ++d)
        EXPECT_GT(directions.across(d)[0], directions.across(d)[1]) << d;
}

TEST(LineDirections, WideAreasAreCrossedAlongTheUsualAxis) {
    Context context({.threads = 2});
    const std::vector<CellRuns> rows =
        rows_of([&](double x, double y) { return std::hypot(x - kGrid.x(200), y - kGrid.y(150)) < 20; });
    const LineDirections directions(context, kGrid, rows, 3, LineDirections::along_y);
    const LineDirection& y = directions.all()[LineDirections::along_y];
    EXPECT_EQ(y.p, 0);
    EXPECT_EQ(y.q, 1);
    for (std::size_t d = 0; d < directions.all().size(); ++d)
        EXPECT_EQ(directions.across(d)[0] <= directions.across(d)[1], d == LineDirections::along_y) << d;
}

/// By the directions that the places of single targets have.
TEST(LineDirections, KnowWhichLinesGoOverAPlaceOrARectangle) {
    Context context({.threads = 2});
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> x(kGrid.x(0) - 3, kGrid.x(399) + 3),
        y(kGrid.y(0) - 3, kGrid.y(299) + 3), size(0, 12);
    const auto is_target = [&](double u, double v) {
        return std::abs(std::remainder(v + 8 * std::sin(0.5 * u), 15)) < 0.6 && u + v < 60;
    };
    const LineDirections directions(context, kGrid, rows_of(is_target), 2.5);
    std::vector<std::vector<std::uint32_t>> counts;
    for (std::size_t d = 0; d < directions.all().size(); ++d) counts.push_back(directions.counts(d));
    std::vector<std::size_t> met(directions.all().size(), 0);
    for (int trial = 0; trial < 400; ++trial) {
        const std::array<double, 2> low{x(random), y(random)},
            high{low[0] + size(random), low[1] + size(random)};
        std::vector<char> some(directions.all().size(), 0);
        for (int j = 0; j < kGrid.ny; ++j)
            for (int i = 0; i < kGrid.nx; ++i) {
                const double u = kGrid.x(i), v = kGrid.y(j);
                if (u < low[0] || u > high[0] || v < low[1] || v > high[1] || !is_target(u, v)) continue;
                std::size_t own = 0, others = 0;
                for (std::size_t d = 0; d < some.size(); ++d) {
                    if (directions.is_another(d, u, v)) ++others;
                    else ++own, some[d] = 1;
                }
                ASSERT_EQ(own, 1U) << "a target has lines of one direction";
                ASSERT_EQ(others, some.size() - 1);
            }
        for (std::size_t d = 0; d < some.size(); ++d)
            if (some[d] != 0) {
                ++met[d];
                ASSERT_TRUE(directions.has_some(counts[d], low, high)) << trial << ' ' << d;
            }
    }
    EXPECT_GT(std::count_if(met.begin(), met.end(), [](std::size_t n) { return n > 0; }), 2);
    // Far from all targets there are none, and no lines.
    const double far = kGrid.x(399);
    EXPECT_FALSE(directions.has_some(counts[0], {far, kGrid.y(299)}, {far, kGrid.y(299)}));
    EXPECT_FALSE(directions.is_another(0, far, kGrid.y(299)));
}

/// Every target lies in the stretches of all lines of one direction that pass it no farther than the radius,
/// and nothing else does.
TEST(LineDirections, StretchesCoverEveryTarget) {
    Context context({.threads = 2});
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> shape(0.2, 1), aside(-1, 1);
    const double radius = 2.5;
    std::size_t turned = 0;
    for (int trial = 0; trial < 10; ++trial) {
        const double a = 6 + 4 * shape(random), b = 0.4 + 0.4 * shape(random), w = shape(random);
        // Winding bands, whose directions change.
        const auto is_target = [&](double x, double y) {
            return std::abs(std::remainder(y + a * std::sin(b * x), 15)) < w && x + y < 60;
        };
        const std::vector<CellRuns> rows = rows_of(is_target);
        const LineDirections directions(context, kGrid, rows, radius);
        for (std::size_t d = 1; d < directions.all().size(); ++d)
            turned += directions.across(d)[0] <= directions.across(d)[1] ? 1 : 0;
        const std::array<double, 2> ends{-1000, 1000};
        for (int j = 0; j < kGrid.ny; j += 7)
            for (int i = 0; i < kGrid.nx; i += 5) {
                if (!is_target(kGrid.x(i), kGrid.y(j))) continue;
                std::size_t covering = 0;
                for (std::size_t d = 0; d < directions.all().size(); ++d) {
                    const LineDirection& line = directions.all()[d];
                    const double along = line.c * kGrid.x(i) + line.s * kGrid.y(j),
                                 across = line.c * kGrid.y(j) - line.s * kGrid.x(i);
                    const auto [low, high] = directions.across(d);
                    if (across < low - 1e-6 || across > high + 1e-6) continue;
                    const double beside = aside(random) * 0.99 * radius,
                                 reach = std::sqrt(radius * radius - beside * beside) - 1e-3;
                    const Spans spans = directions.around(d, across + beside, radius, ends);
                    covering += lies_in(spans, along - reach) && lies_in(spans, along) &&
                                        lies_in(spans, along + reach)
                                    ? 1
                                    : 0;
                }
                EXPECT_GE(covering, 1U) << trial << ": " << i << ' ' << j;
            }
    }
    EXPECT_GT(turned, 3U) << "directions of ten trials, but for those along x";
}

TEST(LineDirections, LinesEndAtTheBorder) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-40, 40);
    for (const auto& [p, q] : {std::array{1, 0}, {2, 1}, {0, 1}, {-1, 1}}) {
        const double far = std::hypot(p, q);
        const LineDirection line{p, q, p / far, q / far};
        for (int trial = 0; trial < 200; ++trial) {
            const double along = place(random), across = place(random), x = line.c * along - line.s * across,
                         y = line.s * along + line.c * across;
            const auto ends = line.within(across, {-20, 10}, {-5, 25});
            EXPECT_EQ(along >= ends[0] && along <= ends[1], x >= -20 && x <= 10 && y >= -5 && y <= 25);
            const auto at = line.place(to_units(along), to_units(across));
            EXPECT_NEAR(at[0], x * kUnitsPerMm, 2);
            EXPECT_NEAR(at[1], y * kUnitsPerMm, 2);
        }
    }
}

}  // namespace
}  // namespace slabwright
