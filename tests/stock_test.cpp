// The swept envelope against brute force, and the cusps that a ball leaves against their closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "kernels/stock/stock.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

double end_height(const CutterEnd& end, double r) {
    if (end.form == CutterEnd::Form::ball)
        return end.radius - std::sqrt(std::max(0.0, end.radius * end.radius - r * r));
    return end.form == CutterEnd::Form::cone ? r * end.slope : 0;
}

struct SatisfiedByAny {
    std::vector<std::size_t> cells;
    void operator()(std::size_t cell, double) { cells.push_back(cell); }
    [[nodiscard]] bool enough() const { return !cells.empty(); }
};

}  // namespace

TEST(Sweep, AgreesWithBruteForce) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 11), uz(-3, 3), ur(0.4, 4);
    const CellGrid grid{0.1, 0.2, 0.31, 30, 28};
    for (int trial = 0; trial < 150; ++trial) {
        CutterEnd end{static_cast<CutterEnd::Form>(trial % 3), ur(random), 0.6};
        std::array<double, 3> a{u(random), u(random), uz(random)}, b{u(random), u(random), uz(random)};
        if (trial % 5 == 0) b[2] = a[2];
        if (trial % 7 == 0) b[0] = a[0], b[1] = a[1];
        if (trial % 11 == 0) b[1] = a[1];
        std::vector<double> exact(grid.count(), 1e9), brute(grid.count(), 1e9);
        sweep(grid, end, a, b, [&](std::size_t c, double z) {
            EXPECT_EQ(exact[c], 1e9) << "a cell came twice";
            exact[c] = z;
        });
        const int samples = 4000;
        for (int k = 0; k <= samples; ++k) {
            const double t = static_cast<double>(k) / samples, x = a[0] + t * (b[0] - a[0]),
                         y = a[1] + t * (b[1] - a[1]), z = a[2] + t * (b[2] - a[2]);
            for (int j = 0; j < grid.ny; ++j)
                for (int i = 0; i < grid.nx; ++i) {
                    const double r = std::hypot(grid.x(i) - x, grid.y(j) - y);
                    if (r <= end.radius)
                        brute[grid.index(i, j)] = std::min(brute[grid.index(i, j)], z + end_height(end, r));
                }
        }
        const double step = std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) / samples;
        const double run = std::hypot(b[0] - a[0], b[1] - a[1]),
                     slope = run > 0 ? std::abs(b[2] - a[2]) / run : 0;
        for (std::size_t c = 0; c < grid.count(); ++c) {
            // Brute force can miss a cell that the way only grazes, and is never lower. How much higher it
            // may be at the ball's steep rim is bounded by the sagitta that one step makes there, elsewhere
            // by the way's slope.
            if (brute[c] < 1e8) {
                ASSERT_LT(exact[c], 1e8) << "trial " << trial;
                EXPECT_LE(exact[c], brute[c] + 1e-9) << "trial " << trial;
                EXPECT_GE(exact[c], brute[c] - (step * (1 + slope) + std::sqrt(2 * end.radius * step) + 1e-9))
                    << "trial " << trial;
            }
        }
    }
}

// An arc cuts what many chords of it cut, and whatever stands lower than the cutter gets may be left out.
TEST(Sweep, ArcsAgreeWithChords) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-2, 12), ur(0.4, 4),
        ua(-2 * std::numbers::pi, 2 * std::numbers::pi);
    const CellGrid grid{0.1, 0.2, 0.31, 30, 28};
    for (int trial = 0; trial < 200; ++trial) {
        const CutterEnd end{static_cast<CutterEnd::Form>(trial % 3), ur(random), 0.6};
        LevelArc arc{u(random),  u(random), 1.5, trial % 4 == 0 ? 30 * ur(random) : ur(random),
                     ua(random), ua(random)};
        if (trial % 4 == 0)
            arc.x -= arc.radius * std::cos(arc.start), arc.y -= arc.radius * std::sin(arc.start),
                arc.turn /= 20;
        if (trial % 5 == 0) arc.turn = trial % 2 == 0 ? 2 * std::numbers::pi : -2 * std::numbers::pi;
        std::vector<double> exact(grid.count(), 1e9), chords(grid.count(), 1e9);
        sweep(grid, end, arc, [&](std::size_t c, double z) {
            EXPECT_EQ(exact[c], 1e9) << "a cell came twice";
            exact[c] = z;
        });
        const int n = 2000;  // chords miss the arc by r(turn / n)² / 8
        const double error = arc.radius * std::pow(arc.turn / n, 2) / 8;
        for (int k = 0; k < n; ++k) {
            auto at = [&](int i) {
                const double a = arc.start + arc.turn * i / n;
                return std::array<double, 3>{arc.x + arc.radius * std::cos(a),
                                             arc.y + arc.radius * std::sin(a), arc.z};
            };
            sweep(grid, end, at(k), at(k + 1),
                  [&](std::size_t c, double z) { chords[c] = std::min(chords[c], z); });
        }
        std::vector<double> standing(grid.count());
        for (double& s : standing) s = 1 + u(random) / 4;
        std::vector<char> given(grid.count(), 0);
        sweep_above(
            grid, end, arc, [&](std::size_t c) { return standing[c]; },
            [&](std::size_t c, double z) {
                EXPECT_EQ(z, exact[c]);
                given[c] = 1;
            });
        for (std::size_t c = 0; c < grid.count(); ++c) {
            EXPECT_EQ(given[c] != 0, exact[c] < standing[c]);
            if ((exact[c] > 1e8) != (chords[c] > 1e8)) {  // only where the arc grazes it
                const double d = std::hypot(grid.x(static_cast<int>(c) % grid.nx) - arc.x,
                                            grid.y(static_cast<int>(c) / grid.nx) - arc.y) -
                                 arc.radius;
                EXPECT_NEAR(std::abs(d), end.radius, 2 * error + 1e-9) << "trial " << trial;
            } else if (exact[c] < 1e8) {
                EXPECT_NEAR(exact[c], chords[c], std::sqrt(2 * end.radius * error) + error + 1e-9)
                    << "trial " << trial;
            }
        }
    }
}

// Cells that stand lower than the cutter gets are left out, all others are the same.
TEST(Sweep, LeavesOutWhatStandsLower) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 11), uz(-3, 3), ur(0.4, 4);
    const CellGrid grid{0.1, 0.2, 0.31, 30, 28};
    const auto row = static_cast<std::size_t>(grid.nx);
    for (int trial = 0; trial < 300; ++trial) {
        const CutterEnd end{static_cast<CutterEnd::Form>(trial % 3), ur(random), 0.6};
        const std::array<double, 3> a{u(random), u(random), uz(random)};
        std::array<double, 3> b{u(random), u(random), uz(random)};
        if (trial % 2 == 0) b[2] = a[2];
        std::vector<double> all(grid.count(), 1e9), standing(grid.count());
        for (double& s : standing) s = uz(random) + 1;
        sweep(grid, end, a, b, [&](std::size_t c, double z) { all[c] = z; });
        std::vector<char> given(grid.count(), 0);
        sweep_above(
            grid, end, a, b, [&](std::size_t c) { return standing[c]; },
            [&](std::size_t c, double z) {
                EXPECT_EQ(z, all[c]);
                given[c] = 1;
            });
        for (std::size_t c = 0; c < grid.count(); ++c)
            EXPECT_EQ(given[c] != 0, all[c] < standing[c]) << "trial " << trial;
        // Given as heights over a level, which are compared many at once.
        const double bottom = uz(random);
        std::vector<float> heights(grid.count());
        for (std::size_t c = 0; c < grid.count(); ++c) heights[c] = static_cast<float>(standing[c] - bottom);
        std::fill(given.begin(), given.end(), 0);
        sweep_above(grid, end, a, b, StandingHeights{heights.data(), bottom}, [&](std::size_t c, double z) {
            EXPECT_EQ(z, all[c]);
            given[c] = 1;
        });
        for (std::size_t c = 0; c < grid.count(); ++c)
            EXPECT_EQ(given[c] != 0, all[c] < bottom + static_cast<double>(heights[c])) << "trial " << trial;
        // What asks for no more once it has some gets all of the first row that has any.
        SatisfiedByAny some;
        sweep_above(grid, end, a, b, StandingHeights{heights.data(), bottom}, some);
        const auto first = static_cast<std::size_t>(std::find(given.begin(), given.end(), 1) - given.begin());
        const std::size_t row_end = (first / row + 1) * row;
        for (std::size_t c = 0; c < grid.count(); ++c)
            EXPECT_EQ(std::count(some.cells.begin(), some.cells.end(), c), given[c] != 0 && c < row_end)
                << "trial " << trial;
    }
}

// What is told of many spans at once is what each cell says, at the rows' ends as well; and the level in
// floats parts heights as doubles do.
TEST(Sweep, SpansAgreeWithTheirCells) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(0, 1);
    for (int trial = 0; trial < 400; ++trial) {
        const int nx = 1 + static_cast<int>(random() % 40),
                  rows = 1 + static_cast<int>(random() % RowSpans::kRows);
        const double bottom = trial % 4 == 0 ? 0 : 40 * u(random), share = std::pow(u(random), 3);
        std::vector<float> heights(static_cast<std::size_t>(nx * rows));
        for (float& h : heights) h = u(random) < share ? static_cast<float>(3 * u(random)) : 0.5F;
        // Often the level is that of a cell, to the last bit.
        const float some = heights[random() % heights.size()];
        const double z = trial % 3 == 0 ? bottom + 3 * u(random) : bottom + static_cast<double>(some),
                     level_z = trial % 7 == 0 ? bottom : z;
        const float level = level_over(bottom, level_z);
        EXPECT_LE(bottom + static_cast<double>(level), level_z);
        EXPECT_GT(bottom + static_cast<double>(std::nextafter(level, 1e30F)), level_z);
        RowSpans spans;
        const auto some_span = [&](std::int32_t& first, std::int32_t& last) {
            first = static_cast<std::int32_t>(random() % static_cast<unsigned>(nx + 1));
            last = random() % 3 == 0
                       ? first - 1
                       : std::min<std::int32_t>(nx - 1, first + static_cast<std::int32_t>(random() % 24));
        };
        for (std::size_t k = 0; k < static_cast<std::size_t>(rows); ++k)
            some_span(spans.low[k], spans.left[k]), some_span(spans.right[k], spans.high[k]);
        const OverSpans over = spans_over(heights.data(), static_cast<std::size_t>(nx), rows, spans, level);
        float highest = -std::numeric_limits<float>::infinity();
        std::vector<float> under_zero = heights;
        for (float& h : under_zero) h -= 2;
        std::vector<float> lowered = heights, expected = heights, deep = heights, expected_deep = heights;
        lower_spans(lowered.data(), static_cast<std::size_t>(nx), rows, spans, level_z);
        const auto under = static_cast<float>(2 * u(random) - 1);  // of a level itself, under 0 too
        lower_spans(deep.data(), static_cast<std::size_t>(nx), rows, spans, under);
        for (int k = 0; k < rows; ++k) {
            const auto row = static_cast<std::size_t>(k);
            const auto any = [&](std::int32_t first, std::int32_t last) {
                bool found = false;
                for (std::int32_t i = first; i <= last; ++i) {
                    const std::size_t c = row * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
                    found = found || bottom + static_cast<double>(heights[c]) > level_z;
                    expected[c] = std::min(expected[c], static_cast<float>(std::max(0.0, level_z)));
                    highest = std::max(highest, under_zero[c]);
                    expected_deep[c] = std::min(expected_deep[c], under);
                }
                return found;
            };
            EXPECT_EQ((over.left >> row & 1) != 0, any(spans.low[row], spans.left[row]))
                << "trial " << trial << " row " << k;
            EXPECT_EQ((over.right >> row & 1) != 0, any(spans.right[row], spans.high[row]))
                << "trial " << trial << " row " << k;
        }
        EXPECT_EQ(highest_in(under_zero.data(), static_cast<std::size_t>(nx), rows, spans), highest)
            << "trial " << trial;
        EXPECT_EQ(deep, expected_deep) << "trial " << trial;
        EXPECT_EQ(lowered, expected) << "trial " << trial;
    }
    EXPECT_EQ(level_over(1e300, 5), -std::numeric_limits<float>::infinity());
}

// Of rows beside a point those cells are named whose centres lie in both strips, and within the radius if it
// is about the point.
TEST(Sweep, StripsOfRowsHoldTheirCells) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-4, 14), turn(-std::numbers::pi, std::numbers::pi), wide(-3, 5),
        length(0.2, 8);
    std::size_t inside = 0, about = 0;
    for (int trial = 0; trial < 1000; ++trial) {
        const CellGrid grid{0.1, 0.2, 0.31, 1 + trial % 40, 75};
        const std::array<double, 2> from{u(random), u(random)};
        const auto strips = [&] {
            const auto strip = [&](double& rise) {
                const double angle = trial % 5 == 0 ? std::numbers::pi / 2 * std::round(turn(random))
                                                    : turn(random),
                             least = wide(random) - 3;
                rise = std::sin(angle);
                return Strip(std::cos(angle), least, least + wide(random) + 2);
            };
            double a_rise = 0, b_rise = 0;
            const Strip a = strip(a_rise), b = strip(b_rise);
            return CrossedStrips{a, b, a_rise, b_rise};
        };
        const CrossedStrips way = strips(), near = strips();
        const double low = -length(random), high = length(random), radius = length(random);
        // How far a centre lies within strips, mm at least; negative: outside of one.
        const auto within = [](const CrossedStrips& s, double px, double py) {
            const auto one = [&](const Strip& strip, double rise) {
                const double value = (strip.inverse == 0 ? 0 : px / strip.inverse) + py * rise;
                return std::min(value - strip.least, strip.most - value);
            };
            return std::min(one(s.a, s.a_rise), one(s.b, s.b_rise));
        };
        RowSpans spans;
        const bool has_near = trial % 3 != 0;
        const int first_row = trial % 12, rows = 1 + trial % RowSpans::kRows;
        strips_of_rows(grid, first_row, rows, from, way, low, high, has_near ? &near : nullptr, radius,
                       spans);
        for (int k = 0; k < rows; ++k) {
            const auto at = static_cast<std::size_t>(k);
            if (spans.low[at] <= spans.left[at]) {
                EXPECT_TRUE(spans.low[at] >= 0 && spans.left[at] < grid.nx);
            }
            if (spans.right[at] <= spans.high[at]) {
                EXPECT_TRUE(spans.right[at] >= 0 && spans.high[at] < grid.nx);
            }
            for (int i = 0; i < grid.nx; ++i) {
                constexpr double hair = 1e-6;
                const double px = grid.x(i) - from[0], py = grid.y(first_row + k) - from[1];
                const double in = std::min({within(way, px, py), px - low, high - px});
                const double in_near =
                    has_near ? std::min(within(near, px, py), radius - std::hypot(px, py)) : -1;
                const bool named = i >= spans.low[at] && i <= spans.left[at],
                           named_near = i >= spans.right[at] && i <= spans.high[at];
                inside += named, about += named_near;
                if (std::abs(in) > hair) {
                    EXPECT_EQ(named, in > 0) << "trial " << trial << ", row " << k << ", cell " << i;
                }
                if (std::abs(in_near) > hair) {
                    EXPECT_EQ(named_near, in_near > 0)
                        << "trial " << trial << ", row " << k << ", cell " << i;
                }
            }
        }
    }
    EXPECT_GT(inside, 10000U);
    EXPECT_GT(about, 1000U);
}

// What is told of many cells at once is what each of them says.
TEST(Rows, SayOnWhichCellsMoreThanALimitIsLeft) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(0, 1);
    for (int trial = 0; trial < 2000; ++trial) {
        const auto n = 1 + static_cast<std::size_t>(random() % 64);
        // At its end: past the last nothing may be read.
        std::vector<float> stands(n), surface(n);
        std::vector<std::uint8_t> nz(n);
        const double wide = trial % 3 == 0 ? 0.01 : 1;
        for (std::size_t k = 0; k < n; ++k) {
            surface[k] = static_cast<float>(3 * u(random));
            stands[k] =
                random() % 3 == 0 ? surface[k] : surface[k] + static_cast<float>(wide * (u(random) - 0.2));
            nz[k] = static_cast<std::uint8_t>(1 + random() % 255);
        }
        // Often what one cell has left, to the last bit.
        const float one = (stands[0] - surface[0]) * (static_cast<float>(nz[0]) / 255.0F);
        const float most = trial % 2 == 0 && one >= 0 ? one : static_cast<float>(0.5 * wide * u(random));
        std::uint64_t expected = 0;
        for (std::size_t k = 0; k < n; ++k)
            expected |= std::uint64_t{(stands[k] - surface[k]) * (static_cast<float>(nz[k]) / 255.0F) > most}
                        << k;
        ASSERT_EQ(cells_left(stands.data(), surface.data(), nz.data(), static_cast<int>(n), most), expected)
            << "seed " << seed << " trial " << trial;
        float greatest = 0;
        for (std::size_t k = 0; k < n; ++k)
            greatest = std::max(greatest, (stands[k] - surface[k]) * (static_cast<float>(nz[k]) / 255.0F));
        ASSERT_EQ(most_left(stands.data(), surface.data(), nz.data(), static_cast<int>(n)), greatest)
            << "seed " << seed << " trial " << trial;
    }
}

TEST(Sweep, RowsAgreeWithTheirCells) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(0, 1);
    for (int trial = 0; trial < 2000; ++trial) {
        const int n = 1 + static_cast<int>(random() % 64);
        const auto size = static_cast<std::size_t>(n);
        // At its end: past the last nothing may be read.
        std::vector<float> stands(size), later(size);
        std::vector<std::uint8_t> share(size);
        for (float& s : stands) s = random() % 4 == 0 ? 2.0F : static_cast<float>(3 * u(random));
        std::array<double, 64> h{};
        for (double& z : h) z = random() % 5 == 0 ? kUncovered : random() % 4 == 0 ? 2.0 : 4 * u(random) - 1;
        // Often some stand by the least to the last bit.
        const double floor = trial % 2 == 0 ? 0 : -10, level = h[0],
                     by = std::max(0.1, stands[0] - std::max(floor, h[0]));
        const double least = trial % 3 == 0      ? std::numeric_limits<double>::denorm_min()
                             : std::isfinite(by) ? by
                                                 : 0.4;
        const double bottom = trial % 2 == 0 ? 0 : 7.3, over_bottom = bottom + static_cast<double>(stands[0]);
        const std::uint64_t over = cells_over(stands.data(), n, h.data(), floor, least),
                            over_level = cells_over(stands.data(), n, level, least);
        std::uint64_t expected = 0, expected_level = 0;
        bool any = false;
        std::array<double, 64> kept = h;
        Lost lost, expected_lost;
        float top = 0;
        bool left = false;
        for (std::size_t k = 0; k < size; ++k) {
            expected |= std::uint64_t{stands[k] - std::max(floor, h[k]) >= least} << k;
            expected_level |= std::uint64_t{stands[k] - level >= least} << k;
            any = any || bottom + static_cast<double>(stands[k]) > over_bottom;
            if (!(bottom + static_cast<double>(stands[k]) > h[k])) kept[k] = kUncovered;
            left = left || kept[k] < kUncovered;
            later[k] = random() % 2 == 0 ? stands[k] : stands[k] * static_cast<float>(u(random));
            share[k] = static_cast<std::uint8_t>(random() % 4 == 0 ? 255 : random() % 256);
            const float along = (stands[k] - later[k]) * (static_cast<float>(share[k]) / 255);
            expected_lost.most = std::max(expected_lost.most, along);
            expected_lost.sum += static_cast<double>(along);
            expected_lost.cells += stands[k] - later[k] > 0.3F;
            top = std::max(top, stands[k]);
        }
        EXPECT_EQ(over, expected) << "trial " << trial;
        EXPECT_EQ(over_level, expected_level) << "trial " << trial;
        EXPECT_EQ(any_over(stands.data(), bottom, n, over_bottom), any) << "trial " << trial;
        EXPECT_EQ(keep_lower(stands.data(), bottom, n, h.data()), left) << "trial " << trial;
        for (std::size_t k = 0; k < size; ++k) EXPECT_EQ(h[k], kept[k]) << "trial " << trial;
        add_lost(stands.data(), later.data(), share.data(), n, 0.3F, lost);
        EXPECT_EQ(lost.most, expected_lost.most) << "trial " << trial;
        EXPECT_NEAR(lost.sum, expected_lost.sum, 1e-5 * (1 + expected_lost.sum)) << "trial " << trial;
        EXPECT_EQ(lost.cells, expected_lost.cells) << "trial " << trial;
        const int rows = n % 4 == 0 ? 4 : 1;
        EXPECT_EQ(highest_of(stands.data(), size / static_cast<std::size_t>(rows), n / rows, rows), top)
            << "trial " << trial;
    }
}

// Takes rows of cells over kBottom at once.
constexpr double kBottom = -20;
struct RowsOver {
    float* height;
    void operator()(std::size_t cell, double z) const {
        height[cell] = std::min(height[cell], static_cast<float>(z - kBottom));
    }
    void row(std::size_t first, int n, const double* h, double lowest) const {
        for (int k = 0; k < n; ++k) {
            EXPECT_GE(h[k], lowest - 1e-12);
            (*this)(first + static_cast<std::size_t>(k), h[k]);
        }
    }
    void level(std::size_t first, int n, double z) const {
        for (int k = 0; k < n; ++k) (*this)(first + static_cast<std::size_t>(k), z);
    }
};

// A chain of motions that share their ends leaves what they leave one by one, and asks far fewer cells.
TEST(Sweep, AChainLeavesWhatItsMotionsLeave) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 11), uz(-3, 3), ur(0.4, 4), turn(-3, 3);
    const CellGrid grid{0.1, 0.2, 0.11, 90, 80};
    std::size_t asked_alone = 0, asked_chained = 0, asked_followed = 0, unlike = 0, unlike_rows = 0;
    for (int trial = 0; trial < 120; ++trial) {
        const CutterEnd end{static_cast<CutterEnd::Form>(trial % 3), ur(random), 0.6};
        std::vector<std::array<double, 3>> way{{u(random), u(random), uz(random)}};
        double angle = turn(random);
        for (int k = 0; k < 40; ++k) {
            std::array<double, 3> next = way.back();
            const double length = trial % 4 == 0 ? ur(random) : 0.3;
            angle += k % 9 == 0 ? turn(random) : turn(random) / 20;
            if (k % 13 == 5) angle += std::numbers::pi;
            const bool along = k % 11 != 3;  // otherwise straight up or down, or nowhere at all
            if (along) next[0] += length * std::cos(angle), next[1] += length * std::sin(angle);
            if (k % 22 != 3 && (trial % 2 == 0 || k % 7 == 2)) next[2] += 0.1 * turn(random);
            way.push_back(next);
        }
        std::vector<double> alone(grid.count(), 1), chained(grid.count(), 1), followed(grid.count(), 1);
        std::vector<float> rows_chained(grid.count(), static_cast<float>(1 - kBottom)),
            rows_followed = rows_chained;
        for (std::size_t k = 1; k < way.size(); ++k) {
            auto into = [&](std::vector<double>& height, std::size_t& asked) {
                return std::pair{[&height, &asked](std::size_t c) { return ++asked, height[c]; },
                                 [&height](std::size_t c, double z) { height[c] = std::min(height[c], z); }};
            };
            const auto [stands, take] = into(alone, asked_alone);
            sweep_above(grid, end, way[k - 1], way[k], stands, take);
            ChainedSweep chain;
            if (k > 1) chain.before = &way[k - 2];
            if (k + 1 < way.size()) chain.after = &way[k + 1];
            const auto [stands_chained, take_chained] = into(chained, asked_chained);
            sweep_above(grid, end, way[k - 1], way[k], stands_chained, take_chained, chain);
            const auto [stands_followed, take_followed] = into(followed, asked_followed);
            sweep_above(grid, end, way[k - 1], way[k], stands_followed, take_followed, {.been = k > 1});
            // Given as heights over a level, of which rows are taken at once.
            for (auto& [height, of] :
                 {std::pair{&rows_chained, chain}, {&rows_followed, ChainedSweep{.been = k > 1}}})
                sweep_above(grid, end, way[k - 1], way[k], StandingHeights{height->data(), kBottom},
                            RowsOver{height->data()}, of);
        }
        for (std::size_t c = 0; c < grid.count(); ++c) {
            for (const std::vector<float>* rows : {&rows_chained, &rows_followed})
                unlike_rows += std::abs((*rows)[c] + kBottom - alone[c]) > 1e-5;
        }
        for (std::size_t c = 0; c < grid.count(); ++c)
            if (std::abs(alone[c] - followed[c]) > 1e-9) ++unlike;
        for (std::size_t c = 0; c < grid.count(); ++c) {
            // At the cutter's very rim rounding decides whether it covers a centre.
            if (std::abs(alone[c] - chained[c]) <= 1e-9) continue;
            double nearest = 1e300;
            const double x = grid.x(static_cast<int>(c) % grid.nx), y = grid.y(static_cast<int>(c) / grid.nx);
            for (std::size_t k = 1; k < way.size(); ++k) {
                const double dx = way[k][0] - way[k - 1][0], dy = way[k][1] - way[k - 1][1],
                             l2 = dx * dx + dy * dy;
                const double t =
                    l2 > 0 ? std::clamp(((x - way[k - 1][0]) * dx + (y - way[k - 1][1]) * dy) / l2, 0.0, 1.0)
                           : 0.0;
                nearest = std::min(
                    nearest, std::abs(std::hypot(x - way[k - 1][0] - t * dx, y - way[k - 1][1] - t * dy) -
                                      end.radius));
            }
            EXPECT_LE(nearest, 1e-9) << "trial " << trial << ", form " << static_cast<int>(end.form)
                                     << ", cell " << c << ": " << alone[c] << " and " << chained[c];
        }
    }
    EXPECT_LT(4 * asked_chained, 3 * asked_alone);
    EXPECT_LT(asked_followed, asked_alone);
    EXPECT_LE(unlike, 3U) << "cells that a cutter's rim just touches";
    EXPECT_LE(unlike_rows, 6U) << "cells that a cutter's rim just touches";
}

// What a cut says that it did is what it did to the cells.
TEST(Stock, EffectsAreThoseOfTheCells) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-2, 22), uz(-1, 11), ur(0.3, 4);
    const CellGrid grid{0.1, 0.2, 0.21, 97, 93};
    constexpr double deep = 1.5;
    std::size_t through = 0, lowered = 0;
    for (int trial = 0; trial < 60; ++trial) {
        Stock stock(grid);
        stock.add_slab(0, 4);
        stock.add_slab(4, 6);
        for (int k = 0; k < 12; ++k) {
            const CutterEnd end{static_cast<CutterEnd::Form>(k % 2), ur(random), 0};
            const std::array<double, 3> a{u(random), u(random), uz(random)},
                b{u(random), u(random), k % 3 == 0 ? uz(random) : a[2]};
            std::vector<std::array<double, 2>> before;
            for (std::size_t c = 0; c < grid.count(); ++c)
                before.push_back({stock.surface(0, c), stock.surface(1, c)});
            const CutEffect effect = stock.cut(end, a, b, deep);
            double removed = 0, deepest = 0, highest = -1e300, lowest = 1e300;
            std::uint64_t deep_cells = 0;
            std::map<std::size_t, std::uint64_t> deep_rows;
            for (std::size_t c = 0; c < grid.count(); ++c) {
                double lost = 0;
                for (const std::size_t slab : {0U, 1U}) {
                    const double stood = before[c][slab], now = stock.surface(slab, c);
                    if (now == stood) continue;
                    lost += stood - now;
                    highest = std::max(highest, stood), lowest = std::min(lowest, now);
                }
                if (lost > 0) ++lowered;
                removed += lost;
                deepest = std::max(deepest, lost);
                deep_cells += lost > deep;
                if (lost > deep) ++deep_rows[c / static_cast<std::size_t>(grid.nx)];
            }
            std::uint64_t longer = deep_rows.size();
            for (const auto& [row, cells] : deep_rows) longer = std::max(longer, cells);
            EXPECT_NEAR(effect.removed, removed, 1e-9 * (1 + removed)) << "seed " << seed;
            EXPECT_EQ(effect.deepest, deepest);
            EXPECT_EQ(effect.deep_cells, deep_cells);
            EXPECT_EQ(effect.deep_across,
                      deep_cells == 0 ? 0 : static_cast<double>(deep_cells) / static_cast<double>(longer));
            EXPECT_EQ(effect.highest, highest);
            if (std::min(a[2], b[2]) >= 0) {
                EXPECT_EQ(effect.lowest, lowest);
            }
            through += std::min(a[2], b[2]) < 4 && removed > 0;
        }
    }
    EXPECT_GT(through, 100U);
    EXPECT_GT(lowered, 100000U);
}

// Ways of a disc at one height, taken as one region, leave what they leave one after another, and what they
// took together is the same.
TEST(Stock, ARegionIsCutAsItsWaysAre) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-4, 24), uz(0.5, 11), ur(0.1, 9), turn(-3, 3);
    const CellGrid grid{0.1, 0.2, 0.21, 97, 93};
    std::size_t deep = 0, cut = 0, unlike = 0, cleared = 0;
    LevelRegion region(grid);
    for (int trial = 0; trial < 300; ++trial) {
        Stock alone(grid), together(grid);
        for (Stock* const stock : {&alone, &together})
            stock->add_slab(0, 5), stock->add_slab(trial % 3 == 0 ? 4 : 5, 6);
        for (int k = 0; k < 4; ++k) {  // an uneven surface, cut through to the slab below here and there
            const std::array<double, 3> a{u(random), u(random), uz(random)},
                b{u(random), u(random), trial % 2 == 0 ? a[2] : uz(random)};
            const CutterEnd ball{CutterEnd::Form::ball, ur(random), 0};
            for (Stock* const stock : {&alone, &together}) stock->cut(ball, a, b);
        }
        const double radius = ur(random), z = trial % 10 == 0 ? uz(random) : 5 + uz(random) / 2,
                     most = trial % 4 == 0 ? 2 : 1e300;
        std::vector<std::array<double, 2>> way{{u(random), u(random)}};
        double angle = turn(random);
        for (int k = 0; k < 1 + trial % 40; ++k) {
            angle += turn(random) / 9;
            const double length = trial % 5 == 0 ? ur(random) : k % 9 == 2 ? 0 : 0.7;
            way.push_back(
                {way.back()[0] + length * std::cos(angle), way.back()[1] + length * std::sin(angle)});
            if (k % 17 == 16) way.push_back({u(random), u(random)});
        }
        double removed = 0, deepest = 0, lowest = 1e300;
        for (std::size_t k = 1; k < way.size(); ++k) {
            const CutEffect e = alone.cut({CutterEnd::Form::flat, radius, 0},
                                          {way[k - 1][0], way[k - 1][1], z}, {way[k][0], way[k][1], z});
            removed += e.removed, deepest = std::max(deepest, e.deepest), lowest = std::min(lowest, e.lowest);
            region.add(way[k - 1], way[k], radius);
        }
        std::vector<double> before(grid.count());
        for (std::size_t c = 0; c < grid.count(); ++c) before[c] = together.surface(1, c);
        const auto effect = together.cut(region, z, most);
        const bool whole = z >= (trial % 3 == 0 ? 4 : 5) && deepest <= most;
        ASSERT_EQ(effect.has_value(), whole) << "seed " << seed << ", trial " << trial;
        deep += !whole;
        if (!whole) {
            for (std::size_t c = 0; c < grid.count(); ++c) EXPECT_EQ(together.surface(1, c), before[c]);
            continue;
        }
        cut += effect->removed > 0;
        EXPECT_NEAR(effect->removed, removed, 1e-9 * (1 + removed)) << "seed " << seed << ", trial " << trial;
        EXPECT_EQ(effect->deepest, deepest);
        EXPECT_EQ(effect->lowest, lowest);
        double top = -1e300;
        for (std::size_t c = 0; c < grid.count(); ++c)
            unlike += together.surface(1, c) != alone.surface(1, c), top = std::max(top, together.top(c));
        EXPECT_EQ(together.highest(), top);
        for (int k = 0; k < 8; ++k) {
            const double x0 = u(random), y0 = u(random), x1 = x0 + ur(random), y1 = y0 + ur(random),
                         over = 5 + uz(random) / 2;
            double within = -1e300, all = -1e300;
            for (std::size_t c = 0; c < grid.count(); ++c) {
                const double x = grid.x(static_cast<int>(c) % grid.nx),
                             y = grid.y(static_cast<int>(c) / grid.nx), stands = together.surface(1, c);
                all = std::max(all, stands);
                if (x >= x0 && x <= x1 && y >= y0 && y <= y1) within = std::max(within, stands);
            }
            const bool clear = together.clear(x0, x1, y0, y1, over);
            if (clear) {
                EXPECT_LE(within, over) << "seed " << seed << ", trial " << trial;
            }
            cleared += clear && all > over;
            EXPECT_EQ(together.clear(-1e3, 1e3, -1e3, 1e3, over), all <= over)
                << "seed " << seed << ", trial " << trial;
        }
    }
    EXPECT_EQ(unlike, 0U);
    EXPECT_GT(cleared, 50U);
    EXPECT_GT(deep, 10U);
    EXPECT_GT(cut, 100U);
}

TEST(Stock, TheHighestIsThatOfAllColumns) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 7), uz(-2, 9), ur(0.5, 12);
    const CellGrid grid{0.1, 0.2, 0.31, 20, 18};
    std::size_t below = 0, bare = 0;
    for (int trial = 0; trial < 200; ++trial) {
        Stock stock(grid);
        for (int slab = 0; slab < trial % 4; ++slab) {
            stock.add_slab(3 * slab, 3);
            for (int k = 0; k < 3; ++k)
                stock.cut({CutterEnd::Form::ball, ur(random), 0}, {u(random), u(random), uz(random)},
                          {u(random), u(random), uz(random)});
        }
        double highest = -1e300;
        for (std::size_t c = 0; c < grid.count(); ++c) highest = std::max(highest, stock.top(c));
        EXPECT_EQ(stock.highest(), highest) << "seed " << seed << ", trial " << trial;
        below += trial % 4 > 1 && highest > 0 && highest <= 3.0 * (trial % 4 - 1);  // the topmost is gone
        bare += stock.slabs() > 0 && highest <= 0;
    }
    EXPECT_GT(below, 0U);
    EXPECT_GT(bare, 0U);
}

// Level passes of a ball on a plane at α leave L = R − √(R² − (SD / (2 sin α))²) (METHOD.md section 5).
TEST(Stock, CuspOfLevelPassesOnAPlane) {
    const double R = 3.175, alpha = 50 * std::numbers::pi / 180, cusp = 0.1;
    const double sd = 2 * std::sqrt(2 * R * cusp - cusp * cusp) * std::sin(alpha);
    ASSERT_LE(sd, 2 * (R - cusp) * std::cos(alpha));
    const double cell = cusp / 20;
    // The plane z = x·tan α. The ball touches it from above: centre at distance R along the normal (−sin α,
    // 0, cos α).
    Stock stock({1, 0, cell, 1200, 1});
    stock.add_slab(-20, 60);
    for (double tip = -8; tip < 20; tip += sd) {
        const double zc = tip + R, xc = (zc - R / std::cos(alpha)) / std::tan(alpha);
        stock.cut({CutterEnd::Form::ball, R, 0}, {xc, -5, tip}, {xc, 5, tip});
    }
    double most = 0, least = 1e9;
    for (std::size_t i = 0; i < 1200; ++i) {
        const double x = 1 + static_cast<double>(i) * cell,
                     over = (stock.surface(0, i) - x * std::tan(alpha)) * std::cos(alpha);
        most = std::max(most, over);
        least = std::min(least, over);
    }
    EXPECT_GE(least, -1e-5);
    EXPECT_NEAR(most, cusp, 0.01 * cusp);
}

// Where the shank of the lower pass cuts too: L = R(1 − sin α) + (SD − √(2Ru − u²))·cos α with u = SD·cot α.
TEST(Stock, CuspWhereTheShankCutsToo) {
    const double R = 3.175, alpha = 87 * std::numbers::pi / 180, sd = 0.0639 * 25.4;
    const double u = sd / std::tan(alpha),
                 expected = R * (1 - std::sin(alpha)) + (sd - std::sqrt(2 * R * u - u * u)) * std::cos(alpha);
    const double cell = 0.0002;
    Stock stock({0.5, 0, cell, 3000, 1});
    stock.add_slab(-20, 80);
    for (double tip = -10; tip < 40; tip += sd) {
        const double xc = (tip + R - R / std::cos(alpha)) / std::tan(alpha);
        stock.cut({CutterEnd::Form::ball, R, 0}, {xc, -5, tip}, {xc, 5, tip});
    }
    double most = 0;
    for (std::size_t i = 300; i < 2700; ++i)
        most =
            std::max(most, (stock.surface(0, i) - (0.5 + static_cast<double>(i) * cell) * std::tan(alpha)) *
                               std::cos(alpha));
    EXPECT_NEAR(expected, 0.002 * 25.4, 0.02 * expected);  // LUO's example
    EXPECT_NEAR(most, expected, 0.01 * expected);
}

// On a cone of the same slope the passes are circles, and the cusp along a meridian is the plane's (the
// ball's section through the axis is the same circle, but for the cone's curvature across, which does not
// reach the meridian plane).
TEST(Stock, CuspOnAConeByChords) {
    const double R = 3.175, alpha = 40 * std::numbers::pi / 180, cusp = 0.1, height = 30;
    const double sd = 2 * std::sqrt(2 * R * cusp - cusp * cusp) * std::sin(alpha), cell = cusp / 20;
    Stock stock({8, 0, cell, 1000, 1});
    stock.add_slab(-30, 80);
    for (double tip = 10; tip < 24; tip += sd) {
        const double zc = tip + R,
                     r = (height - zc) / std::tan(alpha) + R / std::sin(alpha);  // the centre's circle
        const int n = 4000;  // chords miss the circle by r(π/n)²/2 < 1e-5
        for (int k = -n / 4; k < n / 4; ++k) {
            const double a = 2 * std::numbers::pi * k / n, b = 2 * std::numbers::pi * (k + 1) / n;
            stock.cut({CutterEnd::Form::ball, R, 0}, {r * std::cos(a), r * std::sin(a), tip},
                      {r * std::cos(b), r * std::sin(b), tip});
        }
    }
    double most = 0, least = 1e9;
    for (std::size_t i = 0; i < 1000; ++i) {
        const double x = 8 + static_cast<double>(i) * cell,
                     over = (stock.surface(0, i) - (height - x * std::tan(alpha))) * std::cos(alpha);
        most = std::max(most, over);
        least = std::min(least, over);
    }
    EXPECT_GE(least, -1e-4);
    EXPECT_NEAR(most, cusp, 0.01 * cusp);
}

// A ball of radius r over a sphere of radius S in level circles: neighbours' centres lie on the sphere S + r
// an angle δ apart, and between them the ball leaves (S + r)·cos(δ/2) − √(r² − (S + r)²·sin²(δ/2)) − S.
TEST(Stock, CuspOnASphere) {
    const double S = 30, r = 3, delta = 0.03, cell = 0.002;
    const double expected =
        (S + r) * std::cos(delta / 2) - std::sqrt(r * r - std::pow((S + r) * std::sin(delta / 2), 2)) - S;
    Stock stock({12, 0, cell, 5000, 1});
    stock.add_slab(0, 40);
    for (double polar = 0.3; polar < 1.0; polar += delta) {
        const double radius = (S + r) * std::sin(polar), tip = (S + r) * std::cos(polar) - r;
        const int n = 6000;
        for (int k = -n / 8; k < n / 8; ++k) {
            const double a = 2 * std::numbers::pi * k / n, b = 2 * std::numbers::pi * (k + 1) / n;
            stock.cut({CutterEnd::Form::ball, r, 0}, {radius * std::cos(a), radius * std::sin(a), tip},
                      {radius * std::cos(b), radius * std::sin(b), tip});
        }
    }
    double most = 0, least = 1e9;
    for (std::size_t i = 0; i < 5000; ++i) {
        const double x = 12 + static_cast<double>(i) * cell, over = std::hypot(x, stock.surface(0, i)) - S;
        most = std::max(most, over);
        least = std::min(least, over);
    }
    EXPECT_GE(least, -1e-4);
    EXPECT_NEAR(most, expected, 0.01 * expected);
}

TEST(Stock, CutThroughShowsTheSlabBelowAndTheBoard) {
    Stock stock({0, 0, 1, 21, 21});
    stock.add_slab(0, 10);
    stock.cut({CutterEnd::Form::flat, 100, 0}, {0, 0, 8}, {20, 20, 8});  // faced
    stock.cut({CutterEnd::Form::flat, 5, 0}, {10, 10, 3}, {10, 10, 3});  // a pocket
    stock.add_slab(8, 10);
    const std::size_t middle = stock.grid().index(10, 10), edge = stock.grid().index(0, 0);
    EXPECT_NEAR(stock.top(middle), 18, 1e-6);
    // The slab spans the pocket. Cut through it: what shows is the pocket's floor.
    CutEffect e = stock.cut({CutterEnd::Form::flat, 2, 0}, {10, 10, 7}, {10, 10, 7});
    EXPECT_NEAR(e.deepest, 10, 1e-6);
    EXPECT_NEAR(e.highest, 18, 1e-6);
    EXPECT_NEAR(stock.top(middle), 3, 1e-6);
    EXPECT_NEAR(stock.surface(1, middle), 8, 1e-6);
    // Again at the same place: nothing there.
    e = stock.cut({CutterEnd::Form::flat, 2, 0}, {10, 10, 4}, {10, 10, 4});
    EXPECT_EQ(e.removed, 0);
    // Past the slab's bottom where the lower one stands: both are cut.
    e = stock.cut({CutterEnd::Form::ball, 2, 0}, {0, 0, 6}, {0, 0, 6});
    EXPECT_NEAR(stock.surface(1, edge), 8, 1e-6);
    EXPECT_NEAR(stock.surface(0, edge), 6, 1e-6);
    EXPECT_NEAR(e.deepest, 12, 1e-6);
    e = stock.cut({CutterEnd::Form::flat, 1, 0}, {20, 20, -1.5}, {20, 20, -1.5});
    EXPECT_NEAR(stock.board_cut(stock.grid().index(20, 20)), 1.5, 1e-6);
    EXPECT_NEAR(e.lowest, -1.5, 1e-6);
    std::array<double, 2> where{};
    EXPECT_NEAR(stock.reach(3, {10, 2, 15}, {10, 18, 15}, where), 3, 1e-6);
    EXPECT_EQ(stock.reach(3, {10, 2, 18}, {10, 18, 18}, where), 0);
}

TEST(Stock, HolesAreFilledAsFarAsTheyAreMeant) {
    const CellGrid grid{0, 0, 0.5, 41, 41};
    Stock stock(grid);
    stock.add_slab(10, 20);
    const CutterEnd drill{CutterEnd::Form::flat, 3};
    (void)stock.cut(drill, {6, 6, 40}, {6, 6, 18});      // as deep as it is meant
    (void)stock.cut(drill, {14, 14, 40}, {14, 14, 12});  // too deep
    (void)stock.cut(drill, {14, 5, 40}, {14, 5, 18});    // at another place
    stock.fill({6, 6}, 3.1, 17.9, 28);
    stock.fill({14, 14}, 3.1, 17.9, 28);
    for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i) {
            const auto away = [&](double x, double y) { return std::hypot(grid.x(i) - x, grid.y(j) - y); };
            const double z = stock.surface(0, grid.index(i, j));
            if (away(14, 14) < 2.9) {
                EXPECT_NEAR(z, 12, 1e-5);
            } else if (away(14, 5) < 2.9) {
                EXPECT_NEAR(z, 18, 1e-5);
            } else if (away(6, 6) < 2.9) {
                EXPECT_NEAR(z, 28, 1e-5);
            } else if (std::min({away(14, 14), away(14, 5), away(6, 6)}) > 3.2) {
                EXPECT_NEAR(z, 30, 1e-5) << "what stands higher stays";
            }
        }
    // What was filled is cut again.
    EXPECT_FALSE(stock.clear(5, 7, 5, 7, 27.5));
    EXPECT_GT(stock.cut(drill, {6, 6, 40}, {6, 6, 20}).removed, 0);
}
