// What a cutter sweeps over rows of cells, and the arithmetic on heights that goes eight cells at a time,
// against cell by cell and word for word.
#include "kernels/stock/sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/seed.h"

using namespace slabwright;

namespace {

constexpr int kMostCells = 64;
constexpr double kBoundary = 1e-7;  // mm: cells as near a boundary may fall on either side

/// The distance from (x, y) to the way from a to b.
double distance(double x, double y, const std::array<double, 2>& a, const std::array<double, 2>& b) {
    const double dx = b[0] - a[0], dy = b[1] - a[1], run2 = dx * dx + dy * dy;
    const double s = run2 > 0 ? std::clamp(((x - a[0]) * dx + (y - a[1]) * dy) / run2, 0.0, 1.0) : 0;
    return std::hypot(x - a[0] - s * dx, y - a[1] - s * dy);
}

/// Random rows of heights, and spans of them: of none, of few cells, of all.
class Rows {
public:
    explicit Rows(std::mt19937& random)
        : nx(std::uniform_int_distribution(1, 40)(random)),
          rows(std::uniform_int_distribution(1, 64)(random)) {
        std::uniform_int_distribution level(0, 9), at(0, nx - 1), few(-1, 9);
        height.resize(static_cast<std::size_t>(nx * rows));
        for (float& h : height) h = static_cast<float>(level(random));
        for (std::size_t k = 0; k < RowSpans::kRows; ++k) {
            spans.low[k] = at(random), spans.left[k] = std::min(nx - 1, spans.low[k] + few(random));
            spans.right[k] = at(random), spans.high[k] = std::min(nx - 1, spans.right[k] + few(random));
        }
    }
    [[nodiscard]] bool left(int row, int i) const {
        return i >= spans.low[at(row)] && i <= spans.left[at(row)];
    }
    [[nodiscard]] bool right(int row, int i) const {
        return i >= spans.right[at(row)] && i <= spans.high[at(row)];
    }
    [[nodiscard]] float& at_cell(int row, int i) { return height[static_cast<std::size_t>(row * nx + i)]; }

    int nx, rows;
    std::vector<float> height;
    RowSpans spans;

private:
    static std::size_t at(int row) { return static_cast<std::size_t>(row); }
};

/// Heights and what else is asked of n cells, with room for whole eights.
struct Cells {
    explicit Cells(std::mt19937& random) : n(std::uniform_int_distribution(0, kMostCells)(random)) {
        std::uniform_int_distribution level(0, 9), share(0, 255);
        for (int k = 0; k < n; ++k) {
            const auto i = static_cast<std::size_t>(k);
            stands[i] = static_cast<float>(level(random)), surface[i] = static_cast<float>(level(random));
            h[i] = level(random), nz[i] = static_cast<std::uint8_t>(share(random));
        }
    }
    int n;
    std::array<float, kMostCells> stands{}, surface{};
    std::array<double, kMostCells> h{};
    std::array<std::uint8_t, kMostCells> nz{};
};

}  // namespace

TEST(Sweep, SpansAreTheCellsThatTheDiscComesOver) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-4, 24), radius_of(0.3, 9), cell_of(0.2, 1.5);
    std::uniform_int_distribution kind(0, 3), first_of(0, 6);
    for (int trial = 0; trial < 400; ++trial) {
        const CellGrid grid{place(random) - 10, place(random) - 10, cell_of(random), 31, 27};
        const std::array<double, 2> from{place(random), place(random)};
        std::array<double, 2> to{place(random), place(random)};
        const int way = kind(random);
        if (way == 0) to = from;
        if (way == 1) to[1] = from[1];  // along a row
        if (way == 2) to[0] = from[0];
        const double radius = radius_of(random);
        const bool been = trial % 2 == 0;
        const int first = first_of(random), rows = grid.ny - first;
        RowSpans spans;
        spans_of_rows(grid, first, rows, from, to, radius, been, spans);
        for (int row = 0; row < rows; ++row)
            for (int i = 0; i < grid.nx; ++i) {
                const double x = grid.x(i), y = grid.y(first + row);
                const double off = distance(x, y, from, to) - radius,
                             hole = distance(x, y, from, from) - radius;
                if (std::abs(off) < kBoundary || std::abs(hole) < kBoundary) continue;
                const auto k = static_cast<std::size_t>(row);
                const bool left = i >= spans.low[k] && i <= spans.left[k],
                           right = i >= spans.right[k] && i <= spans.high[k];
                ASSERT_EQ(left || right, off < 0 && !(been && hole < 0))
                    << trial << ": cell " << i << " of row " << first + row;
                ASSERT_FALSE(left && right) << trial << ": cell " << i << " is told twice";
            }
    }
}

TEST(Sweep, StripsAreTheCellsWithinBoth) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-3, 13), turn(0, 6.28), width(-0.5, 4);
    for (int trial = 0; trial < 400; ++trial) {
        const CellGrid grid{place(random) - 6, place(random) - 6, 0.37, 41, 37};
        const std::array<double, 2> from{place(random), place(random)};
        // The value of a strip at (x, y) from there is step·x + rise·y.
        struct Band {
            double step, rise, least, most;
        };
        const auto band = [&](bool level) {
            const double at = level ? std::numbers::pi / 2 : turn(random), least = place(random) - 8;
            const double step = level ? 0 : std::cos(at);
            return Band{step, std::sin(at), least, least + width(random)};
        };
        const Band a = band(trial % 5 == 0), b = band(trial % 7 == 0), c = band(false), d = band(false);
        const auto crossed = [](const Band& p, const Band& q) {
            return CrossedStrips{{p.step, p.least, p.most}, {q.step, q.least, q.most}, p.rise, q.rise};
        };
        const CrossedStrips strips = crossed(a, b), near = crossed(c, d);
        const double low = -6 + width(random), high = 6 - width(random), radius = 1 + std::abs(width(random));
        RowSpans spans;
        strips_of_rows(grid, 0, grid.ny, from, strips, low, high, trial % 2 == 0 ? &near : nullptr, radius,
                       spans);
        for (int row = 0; row < grid.ny; ++row)
            for (int i = 0; i < grid.nx; ++i) {
                const double x = grid.x(i) - from[0], y = grid.y(row) - from[1];
                // How far within, at least; negative outside.
                const auto within = [&](const Band& s) {
                    const double v = s.step * x + s.rise * y;
                    return std::min(v - s.least, s.most - v);
                };
                const double first = std::min({within(a), within(b), x - low, high - x});
                const double second =
                    trial % 2 == 0 ? std::min({within(c), within(d), radius - std::hypot(x, y)}) : -1.0;
                const auto k = static_cast<std::size_t>(row);
                if (std::abs(first) > 1e-5) {
                    ASSERT_EQ(i >= spans.low[k] && i <= spans.left[k], first > 0)
                        << trial << ' ' << i << ' ' << row;
                }
                if (std::abs(second) > 1e-5) {
                    ASSERT_EQ(i >= spans.right[k] && i <= spans.high[k], second > 0)
                        << trial << ' ' << i << ' ' << row;
                }
            }
    }
}

TEST(Sweep, SpansAreComparedAndLoweredCellByCell) {
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < 300; ++trial) {
        Rows all(random);
        const std::size_t nx = static_cast<std::size_t>(all.nx);
        const float level = static_cast<float>(trial % 11) - 0.5F;
        const OverSpans over = spans_over(all.height.data(), nx, all.rows, all.spans, level);
        float highest = -std::numeric_limits<float>::infinity();
        std::vector<float> lowered = all.height;
        for (int row = 0; row < all.rows; ++row) {
            bool left = false, right = false;
            for (int i = 0; i < all.nx; ++i) {
                const float h = all.at_cell(row, i);
                if (!all.left(row, i) && !all.right(row, i)) continue;
                highest = std::max(highest, h);
                left |= all.left(row, i) && h > level, right |= all.right(row, i) && h > level;
                lowered[static_cast<std::size_t>(row * all.nx + i)] = std::min(h, level);
            }
            ASSERT_EQ(over.left >> row & 1, left ? 1U : 0U) << trial << " row " << row;
            ASSERT_EQ(over.right >> row & 1, right ? 1U : 0U) << trial << " row " << row;
        }
        if (all.rows < 64) {
            ASSERT_EQ((over.left | over.right) >> all.rows, 0U);
        }
        ASSERT_EQ(highest_in(all.height.data(), nx, all.rows, all.spans), highest);
        Rows again = all;
        lower_spans(again.height.data(), nx, all.rows, all.spans, level);
        ASSERT_EQ(again.height, lowered) << trial;
        again = all;
        lower_spans(again.height.data(), nx, all.rows, all.spans, -2.0);
        lower_spans(all.height.data(), nx, all.rows, all.spans, 0.0F);
        ASSERT_EQ(again.height, all.height) << "under the bottom nothing stands";
    }
}

TEST(Sweep, RowsAreComparedCellByCell) {
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < 500; ++trial) {
        const Cells c(random);
        const auto n = static_cast<std::size_t>(c.n);
        const double level = trial % 11 - 0.5, bottom = 0.25, least = 1 + trial % 3;
        const auto most = static_cast<float>(trial % 4) / 2;
        std::uint64_t over = 0, over_h = 0, left = 0;
        bool any = false, any_lower = false;
        float most_of = 0;
        Lost lost{.most = 0.5F, .sum = 2, .cells = 3}, expected = lost;
        std::array<double, kMostCells> kept = c.h;
        for (std::size_t k = 0; k < n; ++k) {
            const double stands = double{c.stands[k]};
            any |= bottom + stands > level;
            const bool lower = bottom + stands > c.h[k];
            any_lower |= lower;
            if (!lower) kept[k] = kUncovered;
            over |= std::uint64_t{stands - level >= least} << k;
            over_h |= std::uint64_t{stands - std::max(level, c.h[k]) >= least} << k;
            const float off = c.stands[k] - c.surface[k],
                        share = off * (static_cast<float>(c.nz[k]) / 255.0F);
            left |= std::uint64_t{share > most} << k;
            most_of = std::max(most_of, share);
            expected.most = std::max(expected.most, share);
            expected.sum += double{share};
            expected.cells += off > most;
        }
        EXPECT_EQ(any_over(c.stands.data(), bottom, c.n, level), any) << trial;
        EXPECT_EQ(cells_over(c.stands.data(), c.n, level, least), over) << trial;
        EXPECT_EQ(cells_over(c.stands.data(), c.n, c.h.data(), level, least), over_h) << trial;
        EXPECT_EQ(cells_left(c.stands.data(), c.surface.data(), c.nz.data(), c.n, most), left) << trial;
        EXPECT_EQ(most_left(c.stands.data(), c.surface.data(), c.nz.data(), c.n), most_of) << trial;
        add_lost(c.stands.data(), c.surface.data(), c.nz.data(), c.n, most, lost);
        EXPECT_EQ(lost.most, expected.most) << trial;
        EXPECT_NEAR(lost.sum, expected.sum, 1e-3) << trial;
        EXPECT_EQ(lost.cells, expected.cells) << trial;
        std::array<double, kMostCells> h = c.h;
        EXPECT_EQ(keep_lower(c.stands.data(), bottom, c.n, h.data()), any_lower) << trial;
        EXPECT_TRUE(std::equal(h.begin(), h.begin() + c.n, kept.begin())) << trial;
    }
}

TEST(Sweep, RowsAreLoweredAndTheHighestIsTold) {
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < 300; ++trial) {
        Cells c(random);
        const double bottom = 2.5;
        std::array<float, kMostCells> level = c.stands, each = c.stands;
        for (std::size_t k = 0; k < static_cast<std::size_t>(c.n); ++k) {
            level[k] = std::min(level[k], static_cast<float>(std::max(0.0, trial % 9 - 3.5)));
            each[k] = std::min(each[k], static_cast<float>(std::max(0.0, c.h[k] - bottom)));
        }
        std::array<float, kMostCells> now = c.stands;
        lower_to(now.data(), c.n, trial % 9 - 3.5);
        EXPECT_EQ(now, level) << trial;
        now = c.stands;
        lower_to(now.data(), c.n, c.h.data(), bottom);
        EXPECT_EQ(now, each) << trial;
        Rows rows(random);
        const int n = 1 + trial % rows.nx;
        float highest = 0;
        for (int row = 0; row < rows.rows; ++row)
            for (int i = 0; i < n; ++i) highest = std::max(highest, rows.at_cell(row, i));
        EXPECT_EQ(highest_of(rows.height.data(), static_cast<std::size_t>(rows.nx), n, rows.rows), highest)
            << trial;
    }
}

// bottom + h ≤ level for the height that is told, and for none above it.
TEST(Sweep, LevelOverIsTheGreatestHeightNotOverIt) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> any(-300, 300), tiny(-1e-30, 1e-30);
    for (int trial = 0; trial < 3000; ++trial) {
        const double bottom = trial % 3 == 0 ? 0 : any(random), level = trial % 4 == 0 ? bottom + tiny(random)
                                                                        : trial % 5 == 0 ? bottom
                                                                                         : any(random);
        const float h = level_over(bottom, level);
        EXPECT_LE(bottom + double{h}, level) << bottom << ' ' << level;
        EXPECT_GT(bottom + double{std::nextafter(h, std::numeric_limits<float>::infinity())}, level)
            << bottom << ' ' << level;
    }
}

// The lowest place of a ball or a disc over a cell, by walking along the way.
TEST(Sweep, HeightsOverARowAreTheEnvelope) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> turn(0, 6.28), run_of(0.5, 9), slope_of(-1.5, 1.5), z_of(-5, 5);
    constexpr int kPlaces = 4000;
    for (int trial = 0; trial < 40; ++trial) {
        const double direction = turn(random), slope = trial % 3 == 0 ? 0 : slope_of(random);
        RowWay way;
        way.dx = std::cos(direction), way.dy = std::sin(direction);
        way.run = run_of(random), way.slope = slope, way.z = z_of(random), way.radius = 2.5;
        way.lead = slope / std::sqrt(1 + slope * slope);
        way.s_least = -kUnbounded, way.s_most = kUnbounded;
        way.lowest = std::min(way.z, way.z + slope * way.run);
        way.ball = trial % 2 == 0;
        way.x0 = -12, way.cell = 0.7, way.from_x = 0.1;
        constexpr int n = 37;
        std::array<double, (n + 7) / 8 * 8> h{};
        for (double py = -11; py < 11; py += 1.9) {
            const bool any = row_heights(way, 0, n, py, nullptr, 0, h.data());
            bool finite = false;
            for (int i = 0; i < n; ++i) {
                const double px = way.x0 + i * way.cell - way.from_x;
                double least = kUncovered, nearest = kUncovered;
                for (int k = 0; k <= kPlaces; ++k) {
                    const double s = way.run * k / kPlaces,
                                 off = std::hypot(px - s * way.dx, py - s * way.dy);
                    nearest = std::min(nearest, off);
                    if (off > way.radius) continue;
                    const double over =
                        way.ball ? way.radius - std::sqrt(way.radius * way.radius - off * off) : 0;
                    least = std::min(least, way.z + slope * s + over);
                }
                const double told = h[static_cast<std::size_t>(i)];
                finite |= told < kUncovered;
                if (std::abs(nearest - way.radius) < 1e-3) continue;
                ASSERT_EQ(told < kUncovered, nearest < way.radius) << trial << ' ' << i << ' ' << py;
                if (told < kUncovered) {
                    ASSERT_NEAR(told, least, 0.1 * (way.radius - nearest < 0.05 ? 5 : 0.2)) << trial;
                }
            }
            ASSERT_EQ(any, finite);
        }
    }
}

// On which part of its way the edge of a disc comes to a cell, and on which side of the way that lies.
TEST(Sweep, EdgePartsAreWhereTheDiscFirstReaches) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> turn(0, 6.28), place(-9, 9);
    for (int trial = 0; trial < 100; ++trial) {
        const double direction = turn(random), run = 8;
        const PartedWay way{std::cos(direction), std::sin(direction), 3, 10 / run, 10};
        constexpr int n = 21;
        std::array<std::int32_t, 24> part{};
        std::array<double, 24> across{};
        const double px = place(random) - 6, py = place(random);
        edge_parts(way, px, 0.8, py, n, part.data(), across.data());
        for (int i = 0; i < n; ++i) {
            const double x = px + 0.8 * i, aside = way.dx * py - way.dy * x;
            const auto at = static_cast<std::size_t>(i);
            ASSERT_NEAR(across[at], aside, 1e-12);
            if (std::abs(aside) > way.radius) continue;
            // Where the disc about s on the way first holds the cell.
            const double first = x * way.dx + py * way.dy - std::sqrt(9 - aside * aside);
            const double in_parts = std::clamp(first * way.per_mm, 0.0, 9.0);
            if (std::abs(in_parts - std::round(in_parts)) < 1e-6 && in_parts > 0 && in_parts < 9) continue;
            ASSERT_EQ(part[at], static_cast<int>(in_parts)) << trial << ' ' << i;
        }
    }
}
