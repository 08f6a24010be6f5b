// Cuts of sheets against closed forms and against the sections that they must spare.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/sheets/fitted_heights.h"
#include "engine/sheets/sheet_cuts.h"
#include "kernels/slicing/slicing.h"
#include "tests/support/loft.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using support::circle;
using support::loft;
using support::Ring;
using support::turned;

/// What a jet of this kerf leaves at a height, found anew: no point of the part may lie nearer to an axis
/// line than half the kerf, or on its right.
bool spares(const SheetCuts& cuts, const Loops& section, double share, double height, double kerf,
            double allowance) {
    for (const AxisLoop& loop : cuts.loops) {
        const std::vector<Point2> axis = axis_at(loop, share);
        for (std::size_t i = 0; i < section.size(); ++i)
            for (const Point2 p : section.loop(i))
                for (std::size_t k = 0; k < axis.size(); ++k) {
                    // The distance in space from p to the nearer of the lines at the ends of this piece, and
                    // in the level from the piece between them.
                    const Point2 a = axis[k], b = axis[(k + 1) % axis.size()];
                    const double dx = double(b.x) - a.x, dy = double(b.y) - a.y, l2 = dx * dx + dy * dy;
                    const double px = double(p.x) - a.x, py = double(p.y) - a.y;
                    const double t = l2 > 0 ? std::clamp((px * dx + py * dy) / l2, 0.0, 1.0) : 0;
                    const double level = std::hypot(px - t * dx, py - t * dy) / kUnitsPerMm;
                    const auto lean_at = [&](std::size_t at) {  // square to the piece
                        const Point2 top = loop.top[at], bottom = loop.bottom[at];
                        return ((double(top.x) - bottom.x) * dy - (double(top.y) - bottom.y) * dx) /
                               std::sqrt(std::max(1.0, l2)) / kUnitsPerMm / height;
                    };
                    const double lean = (1 - t) * lean_at(k) + t * lean_at((k + 1) % axis.size());
                    double apart = level / std::sqrt(1 + lean * lean);
                    if (l2 < 400 * 400) {  // hardly a piece: the line itself
                        const double jx = (double(loop.top[k].x) - loop.bottom[k].x) / kUnitsPerMm / height,
                                     jy = (double(loop.top[k].y) - loop.bottom[k].y) / kUnitsPerMm / height;
                        const double vx = px / kUnitsPerMm, vy = py / kUnitsPerMm;
                        apart = std::sqrt((vx * vx + vy * vy + std::pow(vx * jy - vy * jx, 2)) /
                                          (1 + jx * jx + jy * jy));
                    }
                    if (apart < kerf / 2 - allowance) {
                        std::printf(
                            "  %.4f mm from the axis (%.4f in its level, %.3f mm piece, leaning %.3f; %.3f "
                            "and %.3f)\n",
                            apart, level, std::sqrt(l2) / kUnitsPerMm, lean, lean_at(k),
                            lean_at((k + 1) % axis.size()));
                        return false;
                    }
                }
    }
    return true;
}

struct Cut {
    std::vector<SheetSpan> spans;
    std::vector<SheetStair> stairs;
    std::vector<SheetCuts> cuts;
};

Cut cut(Context& context, const Mesh& mesh, double thickness, const SheetCutRules& rules) {
    Cut result;
    const double height = bounds(mesh.view()).max.z;
    for (double z = 0; z + thickness <= height + 1e-4; z += thickness)
        result.spans.push_back({z, z + thickness, 0});
    result.stairs = stairs_of(context, mesh.view(), result.spans, StairSide::outside);
    result.cuts = cuts_of(context, mesh.view(), result.spans, result.stairs, rules);
    return result;
}

// Besides the ends of even parts these are the heights of corners, and those just below level facets.
TEST(SheetCuts, AreFittedAtCornersAndAtLevelFacets) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<float> height(0.01F, 17.99F);
    const std::vector<SheetSpan> spans{{0, 9, 0}, {9, 18, 0}};
    int level = 0, level_edges = 0;
    for (int round = 0; round < 300; ++round) {
        // Facets between a few heights, so that many have a level edge and some are level.
        const std::array<float, 3> some{height(random), height(random), height(random)};
        Mesh mesh;
        std::vector<double> corners, below;
        for (std::uint32_t f = 0; f < 4; ++f) {
            std::array<float, 3> z{};
            for (float& one : z) one = some[random() % some.size()];
            for (const float one : z) {
                mesh.vertices.push_back({height(random), height(random), one});
                corners.push_back(one);
            }
            mesh.facets.push_back({3 * f, 3 * f + 1, 3 * f + 2});
            const bool is_level = z[0] == z[1] && z[1] == z[2];
            if (is_level) below.push_back(z[0] - 1e-3);
            level += is_level ? 1 : 0;
            level_edges += !is_level && (z[0] == z[1] || z[1] == z[2] || z[2] == z[0]) ? 1 : 0;
        }
        const auto found = heights_to_fit(mesh.view(), spans, 0);
        ASSERT_EQ(found.size(), spans.size());
        for (std::size_t i = 0; i < spans.size(); ++i) {
            const auto within = [&](double z) { return z > spans[i].bottom && z < spans[i].top; };
            const auto holds = [](const std::vector<double>& all, double z, double off) {
                return std::any_of(all.begin(), all.end(), [&](double h) { return std::abs(h - z) <= off; });
            };
            std::vector<double> even;
            for (int k = 0; k <= kCutSections; ++k) even.push_back(spans[i].bottom + 9.0 * k / kCutSections);
            EXPECT_TRUE(std::is_sorted(found[i].begin(), found[i].end()));
            for (const double h : found[i])
                EXPECT_TRUE(holds(even, h, 1e-9) || holds(corners, h, 1e-9) || holds(below, h, 1e-9)) << h;
            for (const double h : even) EXPECT_TRUE(holds(found[i], h, 1e-9)) << h;
            for (const double h : corners) EXPECT_TRUE(!within(h) || holds(found[i], h, 1e-3)) << h;
            for (const double h : below) EXPECT_TRUE(!within(h) || holds(found[i], h, 2.5e-4)) << h;
        }
    }
    EXPECT_GT(level, 50);
    EXPECT_GT(level_edges, 200);
}

TEST(SheetCuts, ConeIsCutInOnePassAtItsAngle) {
    Context context;
    const Mesh cone = turned(context, 30, 1, 96, [](double z) { return 50 - 0.6 * z; });
    SheetCutRules rules;
    rules.most_tilt_deg = 60;
    const Cut c = cut(context, cone, 6, rules);
    for (const SheetCuts& cuts : c.cuts) {
        ASSERT_EQ(cuts.loops.size(), 1u);
        EXPECT_FALSE(cuts.gave_up_tilt);
        EXPECT_NEAR(cuts.most_tilt_deg, std::atan(0.6) * 180 / std::numbers::pi, 0.1);
        EXPECT_LT(cuts.deviation, 0.01);
    }
    rules.most_tilt_deg = 0;
    for (const SheetCuts& cuts : cut(context, cone, 6, rules).cuts) {
        EXPECT_TRUE(cuts.upright);
        EXPECT_NEAR(cuts.deviation, 6 * 0.6, 0.02);
    }
    rules.most_tilt_deg = 20;  // less than the wall's
    for (const SheetCuts& cuts : cut(context, cone, 6, rules).cuts) {
        EXPECT_NEAR(cuts.most_tilt_deg, 20, 0.1);
        EXPECT_NEAR(cuts.deviation, 6 * (0.6 - std::tan(20 * std::numbers::pi / 180)), 0.05);
    }
}

// Each sheet of a hemisphere: n passes along supporting lines at even heights leave no more than the widest
// corner between two of them.
TEST(SheetCuts, HemisphereLeavesWhatItsPassesMust) {
    Context context;
    const double radius = 40;
    const Mesh ball =
        turned(context, 30, 300, 180, [&](double z) { return std::sqrt(radius * radius - z * z); });
    SheetCutRules rules;
    rules.most_tilt_deg = 60;
    rules.leave = 0.03;
    const Cut c = cut(context, ball, 6, rules);
    for (std::size_t i = 0; i < c.cuts.size(); ++i) {
        const SheetCuts& cuts = c.cuts[i];
        EXPECT_FALSE(cuts.gave_up_tilt) << i;
        int passes = 0;
        for (const AxisLoop& loop : cuts.loops) passes = std::max(passes, loop.pass + 1);
        const double low = c.spans[i].bottom, high = c.spans[i].top;
        // Lines that touch at the middles of n even parts: farthest from the sphere at the sheet's ends and
        // where two of them meet.
        double closed = 0;
        const auto line = [&](double touch, double z) {
            const double r = std::sqrt(radius * radius - touch * touch);
            return r - touch / r * (z - touch);
        };
        for (double z = low; z <= high + 1e-9; z += 0.01) {
            double r = 1e9;
            for (int j = 0; j < passes; ++j)
                r = std::min(r, line(low + (j + 0.5) / passes * (high - low), z));
            closed = std::max(closed, r - std::sqrt(radius * radius - z * z));
        }
        std::printf("  sheet %zu: %d passes, deviation %.4f mm, closed form %.4f\n", i, passes,
                    cuts.deviation, closed);
        EXPECT_NEAR(cuts.deviation, closed, 0.02) << i;
    }
}

TEST(SheetCuts, NoCutEntersRandomSolids) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(-1, 1);
    int tilted = 0, gave_up = 0, sheets = 0;
    double with_tilt = 0, without = 0;
    for (int round = 0; round < 12; ++round) {
        const int n = 5 + static_cast<int>(random() % 20);
        std::vector<double> radii;
        for (int i = 0; i < n; ++i) radii.push_back(20 + 8 * unit(random));
        std::vector<Ring> rings;
        double size = 1, x = 0, y = 0;
        for (int z = 0; z <= 24; z += 2 + static_cast<int>(random() % 5)) {
            Ring ring{double(z), {}};
            for (int i = 0; i < n; ++i) {
                const double a = 2 * std::numbers::pi * i / n, r = size * radii[static_cast<std::size_t>(i)];
                ring.points.push_back({x + r * std::cos(a), y + r * std::sin(a)});
            }
            rings.push_back(ring);
            size *= 1 + 0.12 * unit(random);
            x += unit(random), y += unit(random);
        }
        const Mesh mesh = loft(context, rings);
        SheetCutRules rules;
        rules.most_tilt_deg = 50;
        const Cut c = cut(context, mesh, 6, rules);
        rules.most_tilt_deg = 0;
        const Cut upright = cut(context, mesh, 6, rules);
        for (std::size_t i = 0; i < c.spans.size(); ++i) {
            ++sheets;
            tilted += !c.cuts[i].upright;
            gave_up += c.cuts[i].gave_up_tilt;
            with_tilt += c.cuts[i].deviation;
            without += upright.cuts[i].deviation;
            std::vector<Plane> planes;
            for (int k = 0; k <= 20; ++k)
                planes.push_back({c.spans[i].bottom + 0.01 + 5.98 * k / 20, Side::above});
            const std::vector<Section> sections = slice(context, mesh.view(), planes);
            for (std::size_t k = 0; k < sections.size(); ++k)
                EXPECT_TRUE(spares(c.cuts[i], sections[k].loops, (0.01 + 5.98 * double(k) / 20) / 6, 6,
                                   rules.kerf, rules.gouge + 0.005))
                    << round << " sheet " << i << " section " << k;
        }
    }
    std::printf(
        "  %d sheets, %d tilted, %d upright since tilted cuts would enter; mean deviation %.2f mm, "
        "upright %.2f mm\n",
        sheets, tilted, gave_up, with_tilt / sheets, without / sheets);
    EXPECT_GT(tilted, sheets / 2);
    EXPECT_LT(with_tilt, without);
}

TEST(SheetCuts, HolesComeFirstAndRunClockwise) {
    Context context;
    // A tube: the caps of both are replaced by a ring between them.
    std::vector<std::array<Vec3f, 3>> tube;
    const Ring outer = circle(0, 40, 64), inner = circle(0, 10, 64);
    const auto at = [](const Ring& ring, int i, float z) {
        const auto& p = ring.points[static_cast<std::size_t>(i % 64)];
        return Vec3f{static_cast<float>(p[0]), static_cast<float>(p[1]), z};
    };
    for (int i = 0; i < 64; ++i) {
        tube.push_back({at(outer, i, 0), at(outer, i + 1, 0), at(outer, i + 1, 6)});
        tube.push_back({at(outer, i, 0), at(outer, i + 1, 6), at(outer, i, 6)});
        tube.push_back({at(inner, i, 0), at(inner, i + 1, 6), at(inner, i + 1, 0)});
        tube.push_back({at(inner, i, 0), at(inner, i, 6), at(inner, i + 1, 6)});
        tube.push_back({at(outer, i, 6), at(outer, i + 1, 6), at(inner, i + 1, 6)});
        tube.push_back({at(outer, i, 6), at(inner, i + 1, 6), at(inner, i, 6)});
        tube.push_back({at(outer, i, 0), at(inner, i + 1, 0), at(outer, i + 1, 0)});
        tube.push_back({at(outer, i, 0), at(inner, i, 0), at(inner, i + 1, 0)});
    }
    const Mesh mesh = weld(context, tube);
    for (const double tilt : {0.0, 60.0}) {
        SheetCutRules rules;
        rules.most_tilt_deg = tilt;
        const Cut c = cut(context, mesh, 6, rules);
        ASSERT_EQ(c.cuts[0].loops.size(), 2u);
        EXPECT_TRUE(c.cuts[0].loops[0].is_hole);
        EXPECT_LT(signed_area(c.cuts[0].loops[0].top), 0);
        EXPECT_NEAR(-signed_area(c.cuts[0].loops[0].top), std::numbers::pi * 9.6 * 9.6, 1.5);
        EXPECT_NEAR(signed_area(c.cuts[0].loops[1].top), std::numbers::pi * 40.4 * 40.4, 10);
        EXPECT_TRUE(c.cuts[0].upright);
        EXPECT_LT(c.cuts[0].deviation, 0.02);
    }
}

}  // namespace
}  // namespace slabwright
