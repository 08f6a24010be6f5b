// Pieces on stock: no two overlap, none leaves its sheet, and the layout is no worse than shelves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/nesting/nesting.h"
#include "engine/sheets/head.h"
#include "engine/sheets/jet_feed.h"
#include "kernels/errors.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

Loops ring(double radius, double hole, int n = 40) {
    Loops loops;
    for (int i = 0; i < n; ++i)
        loops.points.push_back({to_units(radius * std::cos(2 * std::numbers::pi * i / n)),
                                to_units(radius * std::sin(2 * std::numbers::pi * i / n))});
    loops.close_loop();
    if (hole <= 0) return loops;
    for (int i = n; i > 0; --i)
        loops.points.push_back({to_units(hole * std::cos(2 * std::numbers::pi * i / n)),
                                to_units(hole * std::sin(2 * std::numbers::pi * i / n))});
    loops.close_loop();
    return loops;
}

Loops random_piece(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    if (random() % 4 == 0) return ring(20 + 60 * unit(random), 15 * unit(random));
    Loops loops;
    const int n = 3 + static_cast<int>(random() % 12);
    const double x = 300 * unit(random) - 150, y = 300 * unit(random) - 150, size = 20 + 60 * unit(random);
    const double flat = 0.3 + 0.7 * unit(random);
    for (int i = 0; i < n; ++i) {
        const double a = 2 * std::numbers::pi * i / n, r = size * (0.4 + 0.6 * unit(random));
        loops.points.push_back({to_units(x + r * std::cos(a)), to_units(y + flat * r * std::sin(a))});
    }
    loops.close_loop();
    return loops;
}

/// Proof by intersection: pieces grown by half of the spacing have nothing in common, and lie on their stock.
void expect_apart(const std::vector<Loops>& pieces, const Nest& nest, const NestRules& rules) {
    std::vector<Loops> grown;
    for (std::size_t i = 0; i < pieces.size(); ++i)
        grown.push_back(offset(placed(pieces[i], nest.places[i]), rules.spacing / 2 - 0.06, 0.05));
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const StockSheet& stock = nest.stock.at(static_cast<std::size_t>(nest.places[i].stock));
        for (const Point2 p : placed(pieces[i], nest.places[i]).points) {
            ASSERT_GE(to_mm(p.x), rules.margin - 1e-6);
            ASSERT_GE(to_mm(p.y), rules.margin - 1e-6);
            ASSERT_LE(to_mm(p.x), stock.length - rules.margin + 1e-6);
            ASSERT_LE(to_mm(p.y), stock.width - rules.margin + 1e-6);
        }
        for (std::size_t j = 0; j < i; ++j)
            if (nest.places[i].stock == nest.places[j].stock) {
                ASSERT_TRUE(intersect(grown[i], grown[j]).empty()) << i << " and " << j;
            }
    }
}

TEST(Nesting, PiecesNeverOverlap) {
    Context context;
    std::mt19937 random(test::seed());
    double used = 0, offered = 0, shelves = 0;
    for (int round = 0; round < 12; ++round) {
        std::vector<Loops> pieces;
        for (int i = 0; i < 25; ++i) pieces.push_back(random_piece(random));
        NestRules rules;
        rules.spacing = static_cast<double>(random() % 3) * 4;
        rules.margin = static_cast<double>(random() % 2) * 10;
        if (random() % 2 == 0) rules.turns = {0, 180};
        const Nest nest = nest_pieces(context, pieces, {600, 400}, {}, rules);
        expect_apart(pieces, nest, rules);
        for (const Loops& piece : pieces) used += area(piece);
        offered += 600 * 400 * static_cast<double>(nest.stock.size());
        // Beside it: shelves of bounding boxes, the tallest first.
        std::vector<std::pair<double, double>> boxes;
        for (const Loops& piece : pieces) {
            std::int32_t x0 = INT32_MAX, y0 = INT32_MAX, x1 = INT32_MIN, y1 = INT32_MIN;
            for (const Point2 p : piece.points)
                x0 = std::min(x0, p.x), x1 = std::max(x1, p.x), y0 = std::min(y0, p.y),
                y1 = std::max(y1, p.y);
            boxes.push_back({to_mm(y1) - to_mm(y0) + rules.spacing, to_mm(x1) - to_mm(x0) + rules.spacing});
        }
        std::sort(boxes.rbegin(), boxes.rend());
        double x = 0, y = 0, high = 0;
        int sheets = 1;
        const double length = 600 - 2 * rules.margin + rules.spacing,
                     width = 400 - 2 * rules.margin + rules.spacing;
        for (const auto& [h, w] : boxes) {
            if (x + w > length) x = 0, y += high, high = 0;
            if (y + h > width) ++sheets, x = y = 0, high = 0;
            x += w;
            high = std::max(high, h);
        }
        shelves += 600 * 400 * sheets;
    }
    std::printf("  utilisation %.3f, of shelves %.3f\n", used / offered, used / shelves);
    EXPECT_LT(offered, shelves);
}

TEST(Nesting, PiecesLieInHolesOfPieces) {
    Context context;
    const std::vector<Loops> pieces{ring(90, 70), ring(50, 0)};
    NestRules rules;
    const Nest nest = nest_pieces(context, pieces, {206, 206}, {}, rules);
    EXPECT_EQ(nest.stock.size(), 1u);
    expect_apart(pieces, nest, rules);
}

TEST(Nesting, OffcutsAreUsedFirstAndOnce) {
    Context context;
    const std::vector<Loops> pieces(5, ring(40, 0));
    NestRules rules;
    const Nest nest = nest_pieces(context, pieces, {400, 300}, {{50, 50}, {110, 110}, {120, 110}}, rules);
    expect_apart(pieces, nest, rules);
    ASSERT_EQ(nest.stock.size(), 3u) << "the offcut of 50 mm holds nothing";
    EXPECT_EQ(nest.stock[0].length, 110);
    EXPECT_EQ(nest.stock[1].length, 120);
    EXPECT_EQ(nest.stock[2].length, 400);
    EXPECT_EQ(std::count_if(nest.places.begin(), nest.places.end(),
                            [](const NestPlace& p) { return p.stock == 2; }),
              3);
}

// A piece that fits one offcut and no whole sheet finds it, whatever else would lie there; two of them do
// not.
TEST(Nesting, APieceThatOnlyAnOffcutHoldsIsLaidThereOrRefused) {
    Context context;
    NestRules rules;
    std::vector<Loops> pieces(4, ring(40, 0));
    pieces.push_back(ring(55, 0));
    const Nest nest = nest_pieces(context, pieces, {110, 110}, {{140, 140}}, rules);
    expect_apart(pieces, nest, rules);
    EXPECT_EQ(nest.stock.at(static_cast<std::size_t>(nest.places[4].stock)).length, 140);
    pieces.push_back(ring(55, 0));
    EXPECT_THROW((void)nest_pieces(context, pieces, {110, 110}, {{140, 140}}, rules), Error);
}

// Changes of the order are kept where they are better, so more tries never take more.
TEST(Nesting, MoreTriesNeverTakeMore) {
    Context context;
    std::mt19937 random(test::seed());
    double first = 0, last = 0;
    for (int round = 0; round < 4; ++round) {
        std::vector<Loops> pieces;
        for (int i = 0; i < 20; ++i) pieces.push_back(random_piece(random));
        double before = 1e300;
        for (const int tries : {1, 4, 64}) {
            NestRules rules;
            rules.tries = tries;
            const Nest nest = nest_pieces(context, pieces, {500, 9000}, {}, rules);
            expect_apart(pieces, nest, rules);
            double high = 0;
            for (std::size_t i = 0; i < pieces.size(); ++i)
                for (const Point2 p : placed(pieces[i], nest.places[i]).points)
                    high = std::max(high, to_mm(p.y));
            EXPECT_LE(high, before + 2 * rules.cell) << tries;
            before = high;
            (tries == 1 ? first : last) += tries == 4 ? 0 : high;
        }
    }
    std::printf("  %.0f mm of a strip in the first order, %.0f mm in the best of 64\n", first, last);
    EXPECT_LT(last, first);
}

TEST(Nesting, IsTheSameOnAnyNumberOfThreadsAndRefusesWhatDoesNotFit) {
    std::vector<NestPlace> first;
    for (const int threads : {1, 4}) {
        Context context({.threads = threads});
        std::mt19937 random(9);
        std::vector<Loops> pieces;
        for (int i = 0; i < 20; ++i) pieces.push_back(random_piece(random));
        const Nest nest = nest_pieces(context, pieces, {500, 500}, {}, {});
        if (threads == 1) first = nest.places;
        for (std::size_t i = 0; i < first.size(); ++i) {
            EXPECT_EQ(nest.places[i].shift, first[i].shift);
            EXPECT_EQ(nest.places[i].turn, first[i].turn);
        }
    }
    Context context;
    EXPECT_THROW((void)nest_pieces(context, {ring(60, 0)}, {100, 500}, {}, {}), Error);
    NestRules odd;
    odd.turns = {45};
    EXPECT_THROW((void)nest_pieces(context, {ring(10, 0)}, {100, 500}, {}, odd), Error);
    EXPECT_TRUE(nest_pieces(context, {}, {100, 500}, {}, {}).stock.empty());
}

// FDFF equation 3 with the values of Limbachiya and Patel.
TEST(JetFeed, IsTheAbrasivesPowerOverWhatTheCutTakes) {
    const AbrasiveJet jet;
    EXPECT_NEAR(jet_feed(jet, 6.35), 1835.8, 0.05);
    EXPECT_NEAR(jet_feed(jet, 6.35 / std::cos(std::numbers::pi / 3)), 1835.8 / 2, 0.05);
    EXPECT_NEAR(fitted_energy(jet, 6.35, jet_feed(jet, 6.35)), 13.6, 1e-9);
    AbrasiveJet fitted = jet;
    fitted.specific_energy_j_mm3 = fitted_energy(jet, 12, 500);
    EXPECT_NEAR(jet_feed(fitted, 12), 500, 1e-9);
    AbrasiveJet none = jet;
    none.pressure_mpa = 0;
    EXPECT_THROW((void)jet_feed(none, 6), Error);
    EXPECT_THROW((void)jet_feed(jet, 0), Error);
}

// The head's angles put the jet through both ends; between points the bottom stays on its line; C never
// turns back by a full turn.
TEST(Head, AnglesPutTheJetThroughBothEnds) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int round = 0; round < 50; ++round) {
        AxisLoop loop;
        const int n = 5 + static_cast<int>(random() % 60);
        const double thickness = 3 + 15 * std::abs(unit(random));
        for (int i = 0; i < n; ++i) {
            const double a = 2 * std::numbers::pi * i / n;
            const double r = 30 + unit(random),
                         lean = (round % 3 - 1) * thickness * 0.8 * std::abs(unit(random));
            const bool upright = random() % 6 == 0;
            loop.top.push_back({to_units(r * std::cos(a)), to_units(r * std::sin(a))});
            loop.bottom.push_back(
                upright ? loop.top.back()
                        : Point2{to_units((r + lean) * std::cos(a)), to_units((r + lean) * std::sin(a))});
        }
        const std::vector<HeadPoint> way = head_way(loop, thickness, 0.005);
        ASSERT_GE(way.size(), loop.top.size() + 1);
        std::size_t at = 0;
        for (std::size_t i = 0; i < way.size(); ++i) {
            ASSERT_GE(way[i].a_deg, 0);
            if (i > 0) {
                ASSERT_LE(std::abs(way[i].c_deg - way[i - 1].c_deg), 180 + 1e-9);
            }
            if (way[i].top != loop.top[at % loop.top.size()]) continue;
            const Point2 bottom = bottom_of(way[i], thickness), wanted = loop.bottom[at % loop.top.size()];
            ASSERT_LE(std::hypot(double(bottom.x) - wanted.x, double(bottom.y) - wanted.y), 3);
            ++at;
        }
        ASSERT_EQ(at, loop.top.size() + 1);
        EXPECT_EQ(way.front().top, way.back().top);
        for (std::size_t i = 0; i + 1 < way.size(); ++i) {
            const HeadPoint &p = way[i], &q = way[i + 1];
            const Point2 b0 = bottom_of(p, thickness), b1 = bottom_of(q, thickness);
            // Nearly straight: within a few times the tolerance, but where the head turns over while it is
            // upright.
            for (const double t : {0.25, 0.5, 0.75}) {
                const HeadPoint between{{static_cast<std::int32_t>(p.top.x + t * (q.top.x - p.top.x)),
                                         static_cast<std::int32_t>(p.top.y + t * (q.top.y - p.top.y))},
                                        p.a_deg + t * (q.a_deg - p.a_deg),
                                        p.c_deg + t * (q.c_deg - p.c_deg)};
                const Point2 b = bottom_of(between, thickness);
                EXPECT_LE(std::hypot(b.x - b0.x - t * (double(b1.x) - b0.x),
                                     b.y - b0.y - t * (double(b1.y) - b0.y)) /
                              kUnitsPerMm,
                          0.02);
            }
        }
    }
}

}  // namespace
}  // namespace slabwright
