// Areas, winding, nesting, booleans and offsets against brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "kernels/errors.h"
#include "kernels/polygons/farthest.h"
#include "kernels/polygons/hull.h"
#include "kernels/polygons/loops.h"
#include "kernels/polygons/runs_inside.h"
#include "kernels/polygons/thinned.h"

namespace {

using namespace slabwright;

std::uint64_t seed_of(const char* test) {
    std::uint64_t seed = 20240607;
    for (const char* c = test; *c; ++c) seed = seed * 131 + static_cast<unsigned char>(*c);
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    return seed;
}

void add(Loops& loops, const std::vector<Point2>& points) {
    loops.points.insert(loops.points.end(), points.begin(), points.end());
    loops.close_loop();
}

std::vector<Point2> rectangle(int x0, int y0, int x1, int y1) {
    return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}
std::vector<Point2> reversed(std::vector<Point2> points) { return {points.rbegin(), points.rend()}; }

/// One loop by itself.
Loops alone(const Loops& loops, std::size_t i) {
    Loops one;
    add(one, {loops.loop(i).begin(), loops.loop(i).end()});
    return one;
}

double distance_to_segment(double px, double py, Point2 a, Point2 b) {
    const double dx = b.x - static_cast<double>(a.x), dy = b.y - static_cast<double>(a.y);
    const double length2 = dx * dx + dy * dy;
    const double t = length2 > 0 ? std::clamp(((px - a.x) * dx + (py - a.y) * dy) / length2, 0.0, 1.0) : 0.0;
    return std::hypot(px - (a.x + t * dx), py - (a.y + t * dy));
}

double distance_to_boundary(const Loops& loops, Point2 p) {
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < loops.size(); ++i) {
        const auto loop = loops.loop(i);
        for (std::size_t k = 0; k < loop.size(); ++k)
            best = std::min(best, distance_to_segment(p.x, p.y, loop[k], loop[(k + 1) % loop.size()]));
    }
    return best;
}

// Of several that are as far the first, in lines of any length; of a segment that is a point as well.
TEST(Farthest, IsThatOfOnePointAfterAnother) {
    std::mt19937_64 random(seed_of("farthest"));
    for (int trial = 0; trial < 2000; ++trial) {
        const std::size_t n = 2 + random() % 70;
        const int range = trial % 3 == 0 ? 3 : 2000000;
        PointRows points;
        for (std::size_t i = 0; i < n; ++i)
            for (std::vector<double>* row : {&points.x, &points.y, &points.z})
                row->push_back(static_cast<double>(
                    static_cast<int>(random() % static_cast<unsigned>(2 * range + 1)) - range));
        const std::size_t first = random() % (n - 1), last = first + 1 + random() % (n - 1 - first);
        if (trial % 5 == 0)
            points.x[last] = points.x[first], points.y[last] = points.y[first],
            points.z[last] = points.z[first];
        Farthest expected{-1, first};
        const double ax = points.x[first], ay = points.y[first], az = points.z[first];
        const double dx = points.x[last] - ax, dy = points.y[last] - ay, dz = points.z[last] - az,
                     l2 = dx * dx + dy * dy + dz * dz;
        for (std::size_t i = first + 1; i < last; ++i) {
            const double wx = points.x[i] - ax, wy = points.y[i] - ay, wz = points.z[i] - az;
            const double t = l2 > 0 ? std::clamp((wx * dx + wy * dy + wz * dz) / l2, 0.0, 1.0) : 0.0;
            const double ex = wx - t * dx, ey = wy - t * dy, ez = wz - t * dz,
                         d2 = ex * ex + ey * ey + ez * ez;
            if (d2 > expected.distance2) expected = {d2, i};
        }
        const Farthest found = farthest_between(points, first, last);
        EXPECT_EQ(found.distance2, expected.distance2) << "trial " << trial;
        EXPECT_EQ(found.at, expected.at) << "trial " << trial;
    }
}

TEST(Polygons, AreaAndWindingOfKnownShapes) {
    Loops loops;
    EXPECT_EQ(area(loops), 0);
    EXPECT_EQ(winding(loops, {0, 0}), 0);
    add(loops, rectangle(0, 0, 100000, 200000));                   // 10 × 20 mm
    add(loops, reversed(rectangle(20000, 20000, 40000, 120000)));  // hole, 2 × 10 mm
    add(loops, {{25000, 30000}, {35000, 30000}, {35000, 50000}});  // island, half of 1 × 2 mm
    EXPECT_DOUBLE_EQ(signed_area(loops.loop(0)), 200);
    EXPECT_DOUBLE_EQ(signed_area(loops.loop(1)), -20);
    EXPECT_DOUBLE_EQ(area(loops), 181);
    EXPECT_EQ(winding(loops, {10000, 10000}), 1);
    EXPECT_EQ(winding(loops, {30000, 100000}), 0);
    EXPECT_EQ(winding(loops, {34000, 35000}), 1);
    EXPECT_EQ(winding(loops, {26000, 45000}), 0);
    EXPECT_EQ(winding(loops, {-1, 5}), 0);
    nest(loops);
    EXPECT_EQ(loops.parents, (std::vector<std::int32_t>{-1, 0, 1}));
}

TEST(Polygons, ExactAtTheEndsOfTheRange) {
    constexpr std::int32_t low = std::numeric_limits<std::int32_t>::min(),
                           high = std::numeric_limits<std::int32_t>::max();
    Loops loops;
    add(loops, rectangle(low, low, high, high));
    const double side = 4294967295.0 / kUnitsPerMm;
    EXPECT_NEAR(area(loops), side * side, side * side * 1e-15);
    EXPECT_EQ(winding(loops, {0, 0}), 1);
    add(loops, {{low, low}, {high, low}, {high, high}});
    // One unit on either side of the diagonal.
    EXPECT_EQ(winding(loops, {5, 3}), 2);
    EXPECT_EQ(winding(loops, {3, 5}), 1);
    EXPECT_EQ(winding(loops, {high - 1, high - 3}), 2);
    nest(loops);
    EXPECT_EQ(loops.parents, (std::vector<std::int32_t>{-1, 0}));
}

/// A polygon that is star-shaped about (x, y), with radii in [inner, outer].
std::vector<Point2> star(std::mt19937_64& random, double x, double y, double inner, double outer) {
    const int corners = 3 + static_cast<int>(random() % 20);
    std::uniform_real_distribution<double> radius(inner, outer);
    std::vector<Point2> points;
    for (int k = 0; k < corners; ++k) {
        const double angle = 2 * std::numbers::pi * k / corners, r = radius(random);
        points.push_back({static_cast<std::int32_t>(std::lround(x + r * std::cos(angle))),
                          static_cast<std::int32_t>(std::lround(y + r * std::sin(angle)))});
    }
    return points;
}

// Inside the spans of a line the winding number is over 0, beside them it is not; many lines at once say the
// same as each alone.
TEST(Polygons, LineSpansAgreeWithWinding) {
    std::mt19937_64 random(seed_of("LineSpansAgreeWithWinding"));
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    std::size_t inside = 0, outside = 0;
    for (int trial = 0; trial < 60; ++trial) {
        Loops loops;
        for (int l = pick(1, 4); l > 0; --l) {
            std::vector<Point2> points;
            for (int k = pick(3, 12); k > 0; --k) points.push_back({pick(-40, 40), pick(-20, 20)});
            add(loops, points);
        }
        std::vector<double> lines;
        for (double y = -22; y <= 22; y += trial % 2 == 0 ? 1 : 0.5) lines.push_back(y);
        const std::vector<std::vector<Span>> all = line_spans(loops, lines);
        ASSERT_EQ(all.size(), lines.size());
        for (std::size_t j = 0; j < lines.size(); ++j) {
            const std::vector<Span> one = line_spans(loops, {&lines[j], 1}).front();
            ASSERT_EQ(all[j].size(), one.size());
            for (std::size_t k = 0; k < one.size(); ++k)
                ASSERT_TRUE(all[j][k].low == one[k].low && all[j][k].high == one[k].high);
            if (std::floor(lines[j]) != lines[j]) continue;  // points are whole
            for (int x = -42; x <= 42; ++x) {
                const Point2 p{x, static_cast<std::int32_t>(lines[j])};
                if (distance_to_boundary(loops, p) < 1e-9) continue;
                const bool in = std::any_of(all[j].begin(), all[j].end(),
                                            [&](const Span& s) { return s.low <= x && x <= s.high; });
                ASSERT_EQ(in, winding(loops, p) > 0) << "trial " << trial << " at " << x << ' ' << lines[j];
                ++(in ? inside : outside);
            }
        }
    }
    EXPECT_GT(inside, 1000U);
    EXPECT_GT(outside, 10000U);
}

TEST(Polygons, NestAgreesWithBruteForceOnRandomTrees) {
    std::mt19937_64 random(seed_of("nest trees"));
    for (int round = 0; round < 300; ++round) {
        struct Made {
            std::vector<Point2> points;
            int parent;
        };
        std::vector<Made> made;
        // Stars within discs; children keep within discs that fit their parent's inner disc (corners >= 3:
        // cos 60° = 1/2).
        std::function<void(double, double, double, int, int)> grow = [&](double x, double y, double r,
                                                                         int parent, int depth) {
            if (r < 40 || depth > 6 || made.size() > 200) return;
            const int self = static_cast<int>(made.size());
            auto points = star(random, x, y, 0.8 * r, r);
            made.push_back({depth % 2 ? reversed(points) : points, parent});
            const double room = 0.8 * r * 0.5 - 3;  // a circle that lies inside of every such star
            const int children = static_cast<int>(random() % 5);
            if (children == 1) {
                grow(x, y, room, self, depth + 1);
            } else {
                for (int c = 0; c < children; ++c) {
                    const double angle = 2 * std::numbers::pi * c / children, away = room / 2;
                    const double most =
                        std::min(room - away, away * std::sin(std::numbers::pi / children)) - 2;
                    grow(x + away * std::cos(angle), y + away * std::sin(angle), most, self, depth + 1);
                }
            }
        };
        for (int root = 0; root < 4; ++root)
            grow(root * 50000, static_cast<double>(random() % 40000), 20000, -1, 0);
        std::vector<std::size_t> order(made.size());
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
        std::shuffle(order.begin(), order.end(), random);
        Loops loops;
        std::vector<std::int32_t> place(made.size()), expected(made.size());
        for (std::size_t i = 0; i < order.size(); ++i) {
            auto points = made[order[i]].points;
            std::rotate(points.begin(),
                        points.begin() + static_cast<std::ptrdiff_t>(random() % points.size()), points.end());
            add(loops, points);
            place[order[i]] = static_cast<std::int32_t>(i);
        }
        for (std::size_t i = 0; i < made.size(); ++i)
            expected[static_cast<std::size_t>(place[i])] =
                made[i].parent < 0 ? -1 : place[static_cast<std::size_t>(made[i].parent)];
        nest(loops);
        ASSERT_EQ(loops.parents, expected) << "round " << round;
    }
}

/// The outlines of the filled cells of a grid, solid on the left; where cells touch in corners loops touch in
/// points.
Loops trace(const std::vector<std::vector<int>>& cell, int pitch) {
    const int rows = static_cast<int>(cell.size()), columns = static_cast<int>(cell[0].size());
    auto filled = [&](int i, int j) {
        return i >= 0 && j >= 0 && i < columns && j < rows &&
               cell[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)] != 0;
    };
    std::multimap<Point2, Point2> edges;  // from, to, in grid corners
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            if (!filled(i, j)) continue;
            if (!filled(i, j - 1)) edges.insert({{i, j}, {i + 1, j}});
            if (!filled(i + 1, j)) edges.insert({{i + 1, j}, {i + 1, j + 1}});
            if (!filled(i, j + 1)) edges.insert({{i + 1, j + 1}, {i, j + 1}});
            if (!filled(i - 1, j)) edges.insert({{i, j + 1}, {i, j}});
        }
    }
    Loops loops;
    while (!edges.empty()) {
        const Point2 start = edges.begin()->first;
        Point2 from = start, to = edges.begin()->second;
        edges.erase(edges.begin());
        std::vector<Point2> points{{from.x * pitch, from.y * pitch}};
        while (to != start) {
            points.push_back({to.x * pitch, to.y * pitch});
            // At a corner of two loops turn left, so that each loop bounds one filled cell group on its own.
            const auto [first, last] = edges.equal_range(to);
            auto best = first;
            for (auto it = first; it != last; ++it) {
                const int cross =
                    (to.x - from.x) * (it->second.y - to.y) - (to.y - from.y) * (it->second.x - to.x);
                if (cross > 0) best = it;
            }
            from = to;
            to = best->second;
            edges.erase(best);
        }
        add(loops, points);
    }
    return loops;
}

/// The smallest larger loop around a point of loop i that is on no loop: a quarter pitch inside of its first
/// edge.
std::vector<std::int32_t> brute_parents(const Loops& loops, int pitch) {
    std::vector<std::int32_t> parents(loops.size(), -1);
    for (std::size_t i = 0; i < loops.size(); ++i) {
        const auto loop = loops.loop(i);
        const Point2 a = loop[0], b = loop[1];
        const int sign =
            signed_area(loop) > 0 ? 1 : -1;  // the loop's own inside lies left of a counter-clockwise one
        const double length = std::hypot(b.x - a.x, b.y - a.y);
        const Point2 inside{
            static_cast<std::int32_t>((a.x + b.x) / 2 - sign * (b.y - a.y) / length * pitch / 4),
            static_cast<std::int32_t>((a.y + b.y) / 2 + sign * (b.x - a.x) / length * pitch / 4)};
        EXPECT_NE(winding(alone(loops, i), inside), 0);
        for (std::size_t j = 0; j < loops.size(); ++j) {
            if (j == i || winding(alone(loops, j), inside) == 0) continue;
            const double size = std::abs(signed_area(loops.loop(j)));
            if (size <= std::abs(signed_area(loop))) continue;
            if (parents[i] < 0 ||
                size < std::abs(signed_area(loops.loop(static_cast<std::size_t>(parents[i])))))
                parents[i] = static_cast<std::int32_t>(j);
        }
    }
    return parents;
}

TEST(Polygons, NestAgreesWithBruteForceWhereLoopsTouchInPoints) {
    std::mt19937_64 random(seed_of("nest touching"));
    for (int round = 0; round < 200; ++round) {
        const int size = 3 + static_cast<int>(random() % 22), share = 20 + static_cast<int>(random() % 70);
        std::vector<std::vector<int>> cell(static_cast<std::size_t>(size),
                                           std::vector<int>(static_cast<std::size_t>(size)));
        for (auto& row : cell)
            for (int& c : row) c = static_cast<int>(random() % 100) < share;
        Loops loops = trace(cell, 8);
        nest(loops);
        ASSERT_EQ(loops.parents, brute_parents(loops, 8)) << "round " << round;
    }
}

/// polyclipping decides what is a hole by what lies to the left of a loop's start. Where slivers lie along an
/// edge, as shadows of steep facets do, it took this outline for one: a whole layer then had nothing under
/// it.
TEST(Polygons, BooleansTurnWhatRunsWithinAUnitOfSlivers) {
    using Region = std::vector<std::vector<Point2>>;
    const Region outline{{{1180622, 5665405}, {1156709, 5672185}, {1098020, 5688822}, {4000106, 21489}}};
    const Region around{{{4488302, 308497},
                         {1296090, 5632671},
                         {995514, 5717882},
                         {1046083, 5703546},
                         {1122491, 5681885},
                         {1213710, 5656025},
                         {1053040, 5701574},
                         {778726, 5779340}},
                        {{1123894, 5681487}, {1126063, 5680873}, {1173338, 5667470}},
                        {{1173338, 5667470}, {1166768, 5669333}, {1283266, 5636307}}};
    std::mt19937_64 random(seed_of("BooleansTurnWhatRunsWithinAUnitOfSlivers"));
    for (int round = 0; round < 2000; ++round) {
        const auto moved = [&](const Region& region) {
            Loops loops;
            for (const std::vector<Point2>& loop : region) {
                for (const Point2 p : loop) {
                    const int x = static_cast<int>(random() % 3) - 1, y = static_cast<int>(random() % 3) - 1;
                    loops.points.push_back(round == 0 ? p : Point2{p.x + x, p.y + y});
                }
                loops.close_loop();
            }
            return loops;
        };
        const Loops a = moved(outline), b = moved(around);
        const double whole = area(a), common = area(intersect(a, b)), rest = area(subtract(a, b));
        ASSERT_GT(common, 0) << "round " << round;
        ASSERT_NEAR(common + rest, whole, 1) << "round " << round;
    }
}

TEST(Polygons, NestWhereLoopsShareEdges) {
    Loops loops;
    add(loops, rectangle(0, 0, 100, 100));
    add(loops, rectangle(100, 0, 200, 100));         // beside it, one whole edge in common
    add(loops, reversed(rectangle(0, 0, 50, 100)));  // a hole along the left wall
    add(loops, rectangle(0, 20, 50, 40));            // across the hole, touching both its walls
    add(loops, {{100, 0}, {200, 50}, {100, 100}});  // a triangle on an edge of its parent, its tip on another
    add(loops, rectangle(300, 0, 400, 100));
    add(loops, {{300, 0}, {400, 100}, {300, 100}});  // all its corners are corners of the one before
    nest(loops);
    EXPECT_EQ(loops.parents[0], -1);
    EXPECT_EQ(loops.parents[1], -1);
    EXPECT_EQ(loops.parents[2], 0);
    EXPECT_EQ(loops.parents[3], 2);
    EXPECT_EQ(loops.parents[4], 1);
    EXPECT_EQ(loops.parents[5], -1);
    EXPECT_EQ(loops.parents[6], 5);
}

/// A plate with rows of fins on it (or holes in it), every one given `times` over, in random order; and
/// the parents that they must have: fins and holes that of the plate, copies that of the copy before.
void nest_fins(std::mt19937_64& random, int side, int times) {
    std::vector<int> order;
    for (int i = 0; i < side * side * times; ++i) order.push_back(i / times);
    std::shuffle(order.begin(), order.end(), random);
    const std::size_t plate = random() % (order.size() + 1);
    Loops loops;
    std::vector<std::int32_t> expected, last(static_cast<std::size_t>(side * side), -1);
    for (std::size_t i = 0; i <= order.size(); ++i) {
        if (i == plate) {
            add(loops, rectangle(-5, -5, 10 * side + 5, 10 * side + 5));
            expected.push_back(-1);
        }
        if (i == order.size()) break;
        const int x = order[i] % side * 10, y = order[i] / side * 10;
        std::int32_t& before = last[static_cast<std::size_t>(order[i])];
        expected.push_back(before >= 0 ? before : static_cast<std::int32_t>(plate));
        before = static_cast<std::int32_t>(loops.size());
        const auto fin = rectangle(x, y, x + 3, y + 8);
        add(loops, random() % 2 == 0 ? fin : reversed(fin));
    }
    nest(loops);
    ASSERT_EQ(loops.parents, expected) << side << " x " << side << ", each " << times << " times";
}

TEST(Polygons, NestOfManyFinsAndOfLoopsGivenManyTimes) {
    std::mt19937_64 random(seed_of("nest fins"));
    for (int round = 0; round < 40; ++round)
        nest_fins(random, 1 + static_cast<int>(random() % 12), 1 + static_cast<int>(random() % 5));
    nest_fins(random, 400, 1);
    nest_fins(random, 1, 3000);
}

TEST(Polygons, NestSurvivesCrossingFlatAndEqualLoops) {
    std::mt19937_64 random(seed_of("nest crossing"));
    for (int round = 0; round < 100; ++round) {
        Loops loops;
        for (int i = 0; i < 40; ++i) {
            std::vector<Point2> points;
            const int corners = static_cast<int>(random() % 12);
            for (int k = 0; k < corners; ++k)
                points.push_back({static_cast<std::int32_t>(random() % 40) - 20,
                                  static_cast<std::int32_t>(random() % 40) - 20});
            add(loops, points);
            if (i % 7 == 0) add(loops, points);
        }
        nest(loops);
        for (std::size_t i = 0; i < loops.size(); ++i) {
            std::size_t steps = 0;
            for (std::int32_t p = static_cast<std::int32_t>(i); p >= 0;
                 p = loops.parents[static_cast<std::size_t>(p)])
                ASSERT_LE(++steps, loops.size());
        }
    }
}

TEST(Polygons, BooleansAgreeWithGridCells) {
    std::mt19937_64 random(seed_of("booleans"));
    for (int round = 0; round < 60; ++round) {
        constexpr int size = 16, pitch = 10000;  // 1 mm cells
        std::vector<std::vector<int>> in_a(size, std::vector<int>(size)), in_b = in_a;
        Loops a, b;
        for (int k = 0; k < 8; ++k) {
            const int x0 = static_cast<int>(random() % (size - 1)),
                      y0 = static_cast<int>(random() % (size - 1));
            const int x1 = x0 + 1 + static_cast<int>(random() % static_cast<unsigned>(size - x0 - 1));
            const int y1 = y0 + 1 + static_cast<int>(random() % static_cast<unsigned>(size - y0 - 1));
            add(k % 2 ? a : b, rectangle(x0 * pitch, y0 * pitch, x1 * pitch, y1 * pitch));
            for (int y = y0; y < y1; ++y)
                for (int x = x0; x < x1; ++x)
                    (k % 2 ? in_a : in_b)[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] = 1;
        }
        const Loops results[] = {unite(a, b), intersect(a, b), subtract(a, b), simplify(a)};
        double expected[4] = {};
        for (std::size_t y = 0; y < size; ++y) {
            for (std::size_t x = 0; x < size; ++x) {
                const bool p = in_a[y][x] != 0, q = in_b[y][x] != 0;
                const bool inside[4] = {p || q, p && q, p && !q, p};
                const Point2 middle{static_cast<std::int32_t>(x * pitch + pitch / 2),
                                    static_cast<std::int32_t>(y * pitch + pitch / 2)};
                for (int r = 0; r < 4; ++r) {
                    expected[r] += inside[r];
                    ASSERT_EQ(winding(results[r], middle), inside[r] ? 1 : 0)
                        << "round " << round << " operation " << r;
                }
            }
        }
        for (int r = 0; r < 4; ++r) {
            ASSERT_EQ(area(results[r]), expected[r]);
            ASSERT_EQ(results[r].parents.size(), results[r].size());
            for (std::size_t i = 0; i < results[r].size();
                 ++i) {  // outer loops and holes alternate from the outside in
                const std::int32_t parent = results[r].parents[i];
                const bool hole = signed_area(results[r].loop(i)) < 0;
                if (parent < 0) ASSERT_FALSE(hole);
                else ASSERT_NE(hole, signed_area(results[r].loop(static_cast<std::size_t>(parent))) < 0);
            }
        }
    }
}

TEST(Polygons, OffsetOfStraightEdgesIsExact) {
    Loops square;
    add(square, rectangle(0, 0, 100000, 100000));
    EXPECT_DOUBLE_EQ(area(offset(square, -1, 0.01)), 64);
    EXPECT_DOUBLE_EQ(area(offset(square, 0, 0.01)), 100);
    EXPECT_TRUE(offset(square, -5.1, 0.01).empty());
    const double grown = area(offset(square, 2, 0.001)), exact = 100 + 4 * 10 * 2 + std::numbers::pi * 4;
    EXPECT_GE(grown, exact);
    EXPECT_LE(grown, exact + 0.001 * 2 * std::numbers::pi * 2);
    Loops ring = square;
    add(ring, reversed(rectangle(40000, 40000, 60000, 60000)));
    EXPECT_TRUE(offset(ring, -2.9, 0.01).empty());
    const Loops closed = offset(ring, 1.0001, 0.01);
    EXPECT_EQ(closed.size(), 1u);  // the hole is gone
    // An L, shrunk: the arc of its inner corner must leave too much rather than too little.
    Loops angle;
    add(angle, {{0, 0}, {100000, 0}, {100000, 50000}, {50000, 50000}, {50000, 100000}, {0, 100000}});
    const double rest = area(offset(angle, -1, 0.001));
    // Outer square 8 × 8 less the corner square 5 × 5, whose inner corner (1 mm) is rounded away from the
    // region.
    const double expected = 64 - 25 + (1 - std::numbers::pi / 4);
    EXPECT_GE(rest, expected - 1e-9);
    EXPECT_LE(rest, expected + 0.001 * std::numbers::pi / 2);
}

TEST(Polygons, OffsetErrsToTheLargerRegionOnly) {
    std::mt19937_64 random(seed_of("offset"));
    for (int round = 0; round < 240; ++round) {
        Loops region;
        const int bodies = 1 + static_cast<int>(random() % 4);
        for (int k = 0; k < bodies; ++k) {
            const auto x = static_cast<double>(random() % 100000), y = static_cast<double>(random() % 100000);
            add(region, star(random, x, y, 15000, 40000));
        }
        if (round % 2)
            region = subtract(region, [&] {
                Loops hole;
                add(hole, star(random, 50000, 50000, 5000, 30000));
                return hole;
            }());
        const double tolerance = round % 3 == 0 ? 0.05 : 0.002;  // mm
        const double delta = (round % 4 < 2 ? 1 : -1) * (0.05 + static_cast<double>(random() % 1000) / 300);
        const Loops outline = simplify(region), moved = round % 5 < 2
                                                            ? offset_outline(outline, delta, tolerance)
                                                            : offset(region, delta, tolerance);
        std::uniform_int_distribution<std::int32_t> coordinate(-80000, 180000);
        const double slack = 2.5;  // units: rounding of the region's crossings and of the result's points
        int tested = 0;
        for (int k = 0; k < 1500; ++k) {
            Point2 p{coordinate(random), coordinate(random)};
            if (k % 3 != 0 &&
                !moved.empty()) {  // most points near the result's boundary, within 1.5 tolerances
                const Point2 near = moved.points[random() % moved.points.size()];
                const int reach = static_cast<int>(tolerance * kUnitsPerMm * 1.5) + 4;
                p = {near.x + static_cast<std::int32_t>(random() % static_cast<unsigned>(2 * reach)) - reach,
                     near.y + static_cast<std::int32_t>(random() % static_cast<unsigned>(2 * reach)) - reach};
            }
            const double boundary = distance_to_boundary(outline, p);
            const double depth =
                winding(outline, p) != 0 ? -boundary : boundary;  // signed distance to the region
            const double past = depth - delta * kUnitsPerMm;
            const bool inside = winding(moved, p) != 0;
            if (past < -slack) {
                ASSERT_TRUE(inside) << "round " << round << ": too small by " << -past << " units at " << p.x
                                    << ", " << p.y;
                ++tested;
            } else if (past > tolerance * kUnitsPerMm + slack) {
                ASSERT_FALSE(inside) << "round " << round << ": too large by " << past << " units at " << p.x
                                     << ", " << p.y;
                ++tested;
            }
        }
        EXPECT_GT(tested, 300);
    }
}

TEST(Polygons, RefusesWhatDoesNotFit) {
    Loops square;
    add(square, rectangle(2000000000, 0, 2100000000, 1000000));
    EXPECT_THROW((void)offset(square, 10000, 0.1), Error);
    EXPECT_THROW((void)offset(square, std::nan(""), 0.1), Error);
    EXPECT_THROW((void)offset(square, std::numeric_limits<double>::infinity(), 0.1), Error);
    EXPECT_THROW((void)offset(square, 1, 0), Error);
    EXPECT_THROW((void)offset(square, 1, std::nan("")), Error);
    EXPECT_NO_THROW((void)offset(square, 1, 0.1));
    // Loops that enclose nothing vanish.
    Loops flat;
    add(flat, {{0, 0}, {10, 10}});
    add(flat, {{0, 0}, {10, 0}, {5, 0}});
    add(flat, {{3, 3}, {3, 3}, {3, 3}});
    EXPECT_TRUE(simplify(flat).empty());
    EXPECT_TRUE(offset(flat, 1, 0.01).empty());
    EXPECT_TRUE(offset(Loops{}, 1, 0.01).empty());
}

// Loops that are much wider than the tolerance keep their places, triangles too; those that are not vanish.
TEST(Polygons, ThinnedLoopsLieWithinTheToleranceOfThoseGiven) {
    std::mt19937_64 random(seed_of("ThinnedLoopsLieWithinTheToleranceOfThoseGiven"));
    int left_out = 0;
    for (int round = 0; round < 60; ++round) {
        constexpr double mm = 0.05;
        Loops loops;
        for (int k = 0; k < 8; ++k) {
            const int corners = 3 + static_cast<int>(random() % (k % 2 == 0 ? 2 : 60));
            std::vector<Point2> points;
            for (int i = 0; i < corners; ++i) {
                const double turn = 2 * std::numbers::pi * i / corners,
                             r = 20'000 * (0.5 + static_cast<double>(random() % 1000) / 1000);
                points.push_back({static_cast<std::int32_t>(100'000 * k + r * std::cos(turn)),
                                  static_cast<std::int32_t>(r * std::sin(turn))});
            }
            add(loops, points);
        }
        const Loops thin = thinned(loops, mm);
        ASSERT_EQ(thin.size(), loops.size()) << round;
        for (std::size_t i = 0; i < loops.size(); ++i) {
            const Loops before = alone(loops, i), now = alone(thin, i);
            for (const Point2 p : before.points)
                EXPECT_LE(distance_to_boundary(now, p), mm * kUnitsPerMm + 1e-6) << round << " loop " << i;
            for (const Point2 p : now.points) EXPECT_EQ(distance_to_boundary(before, p), 0);
            left_out += static_cast<int>(before.points.size() - now.points.size());
        }
    }
    EXPECT_GT(left_out, 100);
    Loops slivers;
    add(slivers, {{0, 0}, {100'000, 0}, {50'000, 400}});
    add(slivers, {{0, 0}, {100, 0}, {100, 100}, {0, 100}});
    EXPECT_TRUE(thinned(slivers, 0.05).empty());
}

// Of each line, every place lies in a run exactly when it lies in the region; runs end on its border.
TEST(Polygons, RunsInsideAreWhatLiesInside) {
    std::mt19937_64 random(seed_of("RunsInsideAreWhatLiesInside"));
    auto star = [&](double x, double y, double size, int corners) {
        std::vector<Point2> points;
        for (int k = 0; k < corners; ++k) {
            const double turn = 2 * std::numbers::pi * k / corners,
                         r = size * (0.3 + 0.7 * static_cast<double>(random() % 1000) / 1000);
            points.push_back({static_cast<std::int32_t>(x + r * std::cos(turn)),
                              static_cast<std::int32_t>(y + r * std::sin(turn))});
        }
        return points;
    };
    int open_runs = 0, whole = 0;
    for (int round = 0; round < 60; ++round) {
        Loops parts, lines;
        for (int k = 0; k < 8; ++k)
            add(parts,
                star(static_cast<double>(random() % 1'000'000), static_cast<double>(random() % 1'000'000),
                     200'000, 3 + static_cast<int>(random() % 40)));
        const Loops region = simplify(parts);
        for (int k = 0; k < 5; ++k)
            add(lines,
                star(static_cast<double>(random() % 1'000'000), static_cast<double>(random() % 1'000'000),
                     k % 2 ? 30'000 : 300'000, 3 + static_cast<int>(random() % 60)));
        const std::vector<RunInside> runs = runs_inside(lines, region);
        std::vector<double> inside(lines.size(), 0);  // length of runs by line
        for (const RunInside& run : runs) {
            ++(run.closed ? whole : open_runs);
            ASSERT_GE(run.points.size(), 2U);
            for (std::size_t k = 0; k + 1 < run.points.size(); ++k)
                inside[run.loop] += std::hypot(static_cast<double>(run.points[k + 1].x) - run.points[k].x,
                                               static_cast<double>(run.points[k + 1].y) - run.points[k].y);
            if (run.closed) {
                inside[run.loop] +=
                    std::hypot(static_cast<double>(run.points.front().x) - run.points.back().x,
                               static_cast<double>(run.points.front().y) - run.points.back().y);
                continue;
            }
            EXPECT_LT(distance_to_boundary(region, run.points.front()), 2);
            EXPECT_LT(distance_to_boundary(region, run.points.back()), 2);
        }
        for (std::size_t l = 0; l < lines.size(); ++l) {
            double expected = 0;
            const auto loop = lines.loop(l);
            for (std::size_t k = 0; k < loop.size(); ++k) {
                const Point2 a = loop[k], b = loop[(k + 1) % loop.size()];
                const double length =
                    std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y);
                const int places = 1 + static_cast<int>(length / 500);
                for (int i = 0; i < places; ++i) {
                    const double t = (i + 0.5) / places;
                    if (winding(region, {static_cast<std::int32_t>(a.x + t * (b.x - a.x)),
                                         static_cast<std::int32_t>(a.y + t * (b.y - a.y))}) > 0)
                        expected += length / places;
                }
            }
            EXPECT_NEAR(inside[l], expected, 0.002 * expected + 10'000) << round << " line " << l;
        }
    }
    EXPECT_GT(open_runs, 200);
    EXPECT_GT(whole, 10);
    // Along the border itself, and where nothing is.
    Loops square;
    add(square, rectangle(0, 0, 1000, 1000));
    for (const RunInside& run : runs_inside(square, square)) EXPECT_TRUE(run.closed);
    EXPECT_TRUE(runs_inside(square, Loops{}).empty());
}

TEST(Polygons, HullIsItsCornersOnceCounterClockwise) {
    const std::vector<Point2> square{{0, 0}, {10, 0}, {10, 10}, {0, 10}};
    EXPECT_EQ(convex_hull({{10, 10}, {5, 0}, {0, 10}, {4, 6}, {10, 0}, {0, 0}, {0, 5}, {10, 10}, {0, 0}}),
              square);
    const std::vector<Point2> line{{-3, 4}, {7, 4}}, one{{2, 1}};
    EXPECT_EQ(convex_hull({{7, 4}, {0, 4}, {-3, 4}, {2, 4}}), line);
    EXPECT_EQ(convex_hull({{2, 1}, {2, 1}}), one);
    EXPECT_TRUE(convex_hull({}).empty());
    // Of random points: those, in turn, with all others on their left.
    std::mt19937 random(7);
    for (int round = 0; round < 200; ++round) {
        std::vector<Point2> points(3 + random() % 12);
        for (Point2& p : points)
            p = {static_cast<std::int32_t>(random() % 9), static_cast<std::int32_t>(random() % 9)};
        const std::vector<Point2> hull = convex_hull(points);
        if (hull.size() < 3) continue;
        for (std::size_t i = 0; i < hull.size(); ++i) {
            const Point2 a = hull[i], b = hull[(i + 1) % hull.size()];
            for (const Point2 p : points) {
                const int left = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
                EXPECT_TRUE(left > 0 || (left == 0 &&
                                         (p == a || p == b || std::count(hull.begin(), hull.end(), p) == 0)));
            }
        }
    }
}

}  // namespace
