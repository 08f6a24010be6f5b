// What is said of how far facets and their groups may reach along lines, against what they forbid.
#include "kernels/cutting/fibre_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include "kernels/parallel/context.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
using Row = std::array<double, kLinesTogether>;

CoverRows nothing_covered() {
    CoverRows cover{};
    cover.low.fill(-kInfinity);
    cover.high.fill(-kInfinity);
    cover.next.fill(kInfinity);
    return cover;
}

// Widens the hulls on all lines at v by a facet with all its edges.
void meet(const SolidFacet& f, double r, double zc, const Row& v, HullRows& hull) {
    const Vec3d& n = f.normal;
    PrismTerms prism{n[0], n[1], n[2], n[2] * (zc - f.p[0][2]) - n[0] * f.p[0][0] - n[1] * f.p[0][1],
                     r,    {},   {},   {}};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const Vec3d e{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const Vec3d m{n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2], n[0] * e[1] - n[1] * e[0]};
        prism.edge_u[k] = m[0];
        prism.edge_v[k] = m[1];
        prism.edge_c[k] = m[2] * (zc - a[2]) - m[0] * a[0] - m[1] * a[1];
        capsule_rows({a[0], a[1], zc - a[2], b[0], b[1], zc - b[2], r}, v.data(), kLinesTogether,
                     hull.low.data(), hull.high.data(), hull.nz_low.data(), hull.nz_high.data());
    }
    if (n != Vec3d{0, 0, 0})
        prism_rows(prism, v.data(), kLinesTogether, hull.low.data(), hull.high.data(), hull.nz_low.data(),
                   hull.nz_high.data());
}

TEST(FibreRows, FacetsAndGroupsForbidNoMoreThanIsSaid) {
    std::mt19937 random(test::seed());
    auto within = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    Context context;
    const CoverRows none = nothing_covered();
    std::size_t met = 0, narrowed = 0, clipped = 0;
    for (int round = 0; round < 3000; ++round) {
        const double r = within(0.5, 5), size = r * std::pow(10, within(-2, 0.5)), steep = within(0, 2),
                     away = within(-500, 500);
        const double zc = within(-1.2, 1.2) * r;
        const std::array<double, 2> slope{within(-1, 1) * steep, within(-1, 1) * steep};
        std::vector<SolidFacet> facets(FacetGroup::kFacets);
        for (SolidFacet& f : facets) {
            for (Vec3d& p : f.p) {
                p = {away + size * within(-1, 1), size * within(-1, 1), 0};
                p[2] = slope[0] * (p[0] - away) + slope[1] * p[1] + 0.1 * size * within(-1, 1);
            }
            const Vec3d a{f.p[1][0] - f.p[0][0], f.p[1][1] - f.p[0][1], f.p[1][2] - f.p[0][2]},
                b{f.p[2][0] - f.p[0][0], f.p[2][1] - f.p[0][1], f.p[2][2] - f.p[0][2]};
            f.normal = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
            const double length = std::hypot(f.normal[0], f.normal[1], f.normal[2]);
            for (double& n : f.normal) n /= length;
            f.z_min = std::min({f.p[0][2], f.p[1][2], f.p[2][2]});
            f.z_max = std::max({f.p[0][2], f.p[1][2], f.p[2][2]});
        }
        Row v{}, low{}, high{}, box_low{}, box_high{};
        for (std::size_t i = 0; i < v.size(); ++i)
            v[i] = (static_cast<double>(i) - 31.5) * 1.2 * (r + size) / 32;
        alignas(64) std::array<std::int64_t, kLinesTogether> state{};
        HullRows together{};
        together.low.fill(kInfinity);
        together.high.fill(-kInfinity);
        auto spares = [&](const HullRows& hull) {
            for (std::size_t i = 0; i < v.size(); ++i) {
                if (!(hull.low[i] < hull.high[i])) continue;
                ++met;
                ASSERT_LE(low[i], hull.low[i] + 1e-9) << "round " << round;
                ASSERT_GE(high[i], hull.high[i] - 1e-9) << "round " << round;
                ASSERT_EQ(state[i], kReachesOut);
                narrowed += high[i] < box_high[i];
            }
        };
        for (const SolidFacet& f : facets) {
            BoxTerms box{};
            TangentTerms tangent{};
            facet_terms(f, 0, r, zc, box, tangent);
            clipped += tangent.corners > 3;
            HullRows hull{};
            hull.low.fill(kInfinity);
            hull.high.fill(-kInfinity);
            meet(f, r, zc, v, hull);
            meet(f, r, zc, v, together);
            box_out_rows(box, none, v.data(), 0, kLinesTogether, box_low.data(), box_high.data(),
                         state.data());
            low = box_low, high = box_high;
            spares(hull);
            facet_out_rows(box, tangent, none, v.data(), 0, kLinesTogether, low.data(), high.data(),
                           state.data());
            spares(hull);
        }
        const FacetGroup group = facet_groups(context, facets).front();
        const double dz = std::max({0.0, group.z_min - zc, zc - group.z_max});
        const BoxTerms box{group.low[0], group.high[0], group.low[1], group.high[1], r * r - dz * dz};
        const DiscTerms disc{group.middle[0], group.middle[1], zc - group.middle[2],
                             r * r,           group.axis[0],   group.axis[1],
                             group.axis[2],   group.radius,    group.thickness};
        box_out_rows(box, none, v.data(), 0, kLinesTogether, box_low.data(), box_high.data(), state.data());
        disc_out_rows(box, disc, none, v.data(), 0, kLinesTogether, low.data(), high.data(), state.data());
        spares(together);
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(met, 100'000U);
    EXPECT_GT(narrowed, met / 4);
    EXPECT_GT(clipped, 1000U);
}

// What of a facet lies within a ball's reach over and under the lines is a polygon of it. No corner lies
// elsewhere, not even one of those that only fill the row.
TEST(FibreRows, WhatIsLeftOfAFacetLiesInIt) {
    constexpr double r = 2, zc = 1;
    // Of five corners, of four and of three, between z = −1 and 3.
    for (const Vec3d& z : {Vec3d{-4, 0, 8}, Vec3d{-4, -2, 8}, Vec3d{-4, -2, 2}}) {
        SolidFacet f{};
        f.p = {Vec3d{0, 0, z[0]}, Vec3d{4, 0, z[1]}, Vec3d{0, 4, z[2]}};
        const double along_x = (z[1] - z[0]) / 4, along_y = (z[2] - z[0]) / 4,
                     length = std::hypot(along_x, along_y, 1);
        f.normal = {-along_x / length, -along_y / length, 1 / length};
        f.z_min = z[0], f.z_max = z[2];
        for (const std::size_t u : {std::size_t{0}, std::size_t{1}}) {
            BoxTerms box{};
            TangentTerms t{};
            facet_terms(f, u, r, zc, box, t);
            ASSERT_EQ(t.corners, TangentTerms::kMostCorners);
            for (std::size_t k = 0; k < t.corners; ++k) {
                const double x = u == 0 ? t.u[k] : t.v[k], y = u == 0 ? t.v[k] : t.u[k],
                             at = zc - t.z + t.dz[k];
                EXPECT_NEAR(at, z[0] + along_x * x + along_y * y, 1e-12) << k;
                EXPECT_TRUE(x >= -1e-12 && y >= -1e-12 && x + y <= 4 + 1e-12) << k;
                EXPECT_TRUE(at >= zc - r - 1e-12 && at <= zc + r + 1e-12) << k;
            }
        }
    }
}

// All facets of a group at once, against what each of them forbids; some overhang, and the last group has
// fewer.
TEST(FibreRows, FacetsOfAGroupForbidNoMoreThanIsSaid) {
    std::mt19937 random(test::seed());
    auto within = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    Context context;
    std::size_t met = 0, covered = 0, left_out = 0;
    auto rows = std::make_unique<GroupRows>();
    for (int round = 0; round < 3000; ++round) {
        const double r = within(0.5, 5), size = r * std::pow(10, within(-2, 1)), steep = within(0, 3),
                     away = within(-800, 800);
        const double zc = within(-1.2, 1.2) * r;
        const std::array<double, 2> slope{within(-1, 1) * steep, within(-1, 1) * steep};
        std::vector<SolidFacet> facets(round % 3 == 0 ? 5 : FacetGroup::kFacets);
        for (SolidFacet& f : facets) {
            for (Vec3d& p : f.p) {
                p = {away + size * within(-1, 1), size * within(-1, 1), 0};
                p[2] = slope[0] * (p[0] - away) + slope[1] * p[1] + 0.1 * size * within(-1, 1);
            }
            if (random() % 8 == 0) f.p[1][2] = f.p[0][2];
            if (random() % 16 == 0) f.p[2] = f.p[1];
            const Vec3d a{f.p[1][0] - f.p[0][0], f.p[1][1] - f.p[0][1], f.p[1][2] - f.p[0][2]},
                b{f.p[2][0] - f.p[0][0], f.p[2][1] - f.p[0][1], f.p[2][2] - f.p[0][2]};
            f.normal = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
            const double length = std::hypot(f.normal[0], f.normal[1], f.normal[2]);
            if (length > 0)
                for (double& n : f.normal) n /= length;
            f.nz = static_cast<float>(f.normal[2]);
            f.z_min = std::min({f.p[0][2], f.p[1][2], f.p[2][2]});
            f.z_max = std::max({f.p[0][2], f.p[1][2], f.p[2][2]});
        }
        const std::size_t u = random() % 2, axis = 1 - u;
        const double middle_v = axis == 0 ? away : 0;
        Row v{};
        for (std::size_t i = 0; i < v.size(); ++i)
            v[i] = middle_v + (static_cast<double>(i) - 31.5) * 1.2 * (r + size) / 32;
        CoverRows cover = nothing_covered();
        if (round % 2 == 1)
            for (std::size_t i = 0; i < v.size(); ++i) {
                cover.low[i] = (u == 0 ? away : 0) - within(0, 1.5) * r;
                cover.high[i] = cover.low[i] + within(0, 3) * r;
            }
        alignas(64) std::array<std::int64_t, kLinesTogether> state{};
        for (std::int64_t& s : state) s = random() % 8 == 0 ? 0 : kReachesOut;
        const std::vector<FacetGroup> groups = facet_groups(context, facets);
        const BulkVector<GroupCorners> corners = group_corners(context, facets, groups);
        group_out_rows(corners.front(), groups.front(), u, r, zc, cover, v.data(), 3, 61, state.data(),
                       *rows);
        for (std::size_t k = facets.size(); k < FacetGroup::kFacets; ++k)
            ASSERT_GE(rows->first[k], rows->last[k]);
        for (std::size_t k = 0; k < facets.size(); ++k) {
            SolidFacet f = facets[k];
            left_out += rows->first[k] >= rows->last[k];
            if (u == 1) {  // meet() is for lines along x
                for (Vec3d& p : f.p) std::swap(p[0], p[1]);
                std::swap(f.normal[0], f.normal[1]);
            }
            HullRows hull{};
            hull.low.fill(kInfinity);
            hull.high.fill(-kInfinity);
            if (f.z_max > zc - r && f.z_min <= zc) meet(f, r, zc, v, hull);
            if (f.nz < 0 && f.z_max > zc) {  // its shadow: here of its corners and edges that lie above
                for (std::size_t c = 0; c < 3; ++c) {
                    const Vec3d &a = f.p[c], &b = f.p[(c + 1) % 3];
                    if (a[2] > zc && b[2] > zc)
                        capsule_rows({a[0], a[1], 0, b[0], b[1], 0, r, f.nz}, v.data(), kLinesTogether,
                                     hull.low.data(), hull.high.data(), hull.nz_low.data(),
                                     hull.nz_high.data());
                }
            }
            const double middle_u = groups.front().middle[u];
            for (std::size_t i = 3; i < 61; ++i) {
                if (state[i] == 0 || !(hull.low[i] < hull.high[i])) continue;
                ++met;
                ASSERT_LE(rows->low[i][k] + middle_u, hull.low[i]) << "round " << round;
                ASSERT_GE(rows->high[i][k] + middle_u, hull.high[i]) << "round " << round;
                if (cover.low[i] <= hull.low[i] && hull.high[i] <= cover.high[i]) {
                    ++covered;
                    continue;
                }
                ASSERT_LE(rows->first[k], static_cast<int>(i)) << "round " << round;
                ASSERT_GT(rows->last[k], static_cast<int>(i)) << "round " << round;
            }
        }
    }
    EXPECT_GT(met, 100'000U);
    EXPECT_GT(covered, 1000U);
    EXPECT_GT(left_out, 1000U);
}

// Balls are laid against facets with the normals that may be around them, and each must be told.
TEST(FibreRows, WhereABallCanTouchIsTold) {
    Context context;
    std::mt19937 random(test::seed());
    const auto within = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    const auto unit = [](Vec3d v) {
        const double l = std::hypot(v[0], v[1], v[2]);
        return Vec3d{v[0] / l, v[1] / l, v[2] / l};
    };
    std::size_t told = 0, elsewhere = 0;
    for (int round = 0; round < 3000; ++round) {
        const double size = round % 3 == 0 ? 0.3 : 4, r = within(0.5, 8), away = round % 4 == 0 ? 900 : 0;
        std::vector<SolidFacet> facets(1 + random() % FacetGroup::kFacets);
        for (SolidFacet& f : facets) {
            for (Vec3d& p : f.p)
                p = {away + within(-size, size), away + within(-size, size), within(-size, size)};
            f.normal = unit({within(-1, 1), within(-1, 1), within(-0.4, 1)});
            f.nz = static_cast<float>(f.normal[2]);
            f.top = random() % 4 == 0;
            if (f.top && random() % 2 == 0) f.p[0][2] = f.p[1][2] = size;
            f.edges = random() & 7;
            f.ends = random() & 7;
            f.z_min = std::min({f.p[0][2], f.p[1][2], f.p[2][2]});
            f.z_max = std::max({f.p[0][2], f.p[1][2], f.p[2][2]});
        }
        const std::size_t k = random() % facets.size(), v = random() % 2;
        SolidFacet& f = facets[k];
        // On the face, on an edge that is to be tested, or on an end of one: place and normal.
        const std::size_t part = random() % 3, edge = random() % 3, next = (edge + 1) % 3;
        const bool on_end = part == 2;
        if (part == 1) f.edges = f.edges | (1U << edge & 7U);
        if (on_end) f.ends = f.ends | (1U << edge & 7U);
        std::vector<FacetNormals> normals(random() % 4 == 0 ? 0 : facets.size());
        const Vec3d& n = f.normal;
        Vec3d place, d = n;
        if (part == 0) {
            double a = within(0, 1), b = within(0, 1);
            if (a + b > 1) a = 1 - a, b = 1 - b;
            for (std::size_t c = 0; c < 3; ++c)
                place[c] = f.p[0][c] + a * (f.p[1][c] - f.p[0][c]) + b * (f.p[2][c] - f.p[0][c]);
        } else {
            const double a = on_end ? 0 : within(0, 1);
            d = unit({within(-1, 1), within(-1, 1), within(-1, 1)});
            for (std::size_t c = 0; c < 3 && !normals.empty(); ++c) {
                NormalBox& box = on_end ? normals[k].corner[edge] : normals[k].edge[edge];
                box.low[c] = static_cast<std::int8_t>(
                    std::max(-127.0, std::floor(d[c] / SolidFacet::kTurn - within(0, 20))));
                box.high[c] = static_cast<std::int8_t>(
                    std::min(127.0, std::ceil(d[c] / SolidFacet::kTurn + within(0, 20))));
            }
            for (std::size_t c = 0; c < 3; ++c) place[c] = f.p[edge][c] + a * (f.p[next][c] - f.p[edge][c]);
        }
        const std::vector<FacetGroup> groups = facet_groups(context, facets, normals);
        const BulkVector<GroupCorners> corners = group_corners(context, facets, groups, normals);
        for (std::size_t c = 0; c < 3; ++c) {
            ASSERT_LE(groups.front().facing.low[c], d[c]) << "round " << round << " part " << part;
            ASSERT_GE(groups.front().facing.high[c], d[c]) << "round " << round << " part " << part;
        }
        Vec3d centre;
        for (std::size_t c = 0; c < 3; ++c) centre[c] = place[c] + r * d[c];
        GroupTouched touched;
        group_touched(corners.front(), groups.front(), v, r, centre[2], touched);
        const double at = centre[v] - groups.front().middle[v];
        const GroupTouched::Range& range = part == 0   ? touched.face
                                           : part == 1 ? touched.edge[edge]
                                                       : touched.end[edge];
        ASSERT_LE(range.low[k], at) << "round " << round << " part " << part;
        ASSERT_GE(range.high[k], at) << "round " << round << " part " << part;
        ASSERT_LE(touched.all.low[k], range.low[k]);
        ASSERT_GE(touched.all.high[k], range.high[k]);
        for (const GroupTouched::Range& each :
             {touched.face, touched.edge[0], touched.edge[1], touched.edge[2], touched.end[0], touched.end[1],
              touched.end[2]}) {
            for (std::size_t i = 0; i < facets.size(); ++i)
                ++(each.low[i] <= each.high[i] ? told : elsewhere);
            for (std::size_t i = facets.size(); i < FacetGroup::kFacets; ++i)
                ASSERT_GT(each.low[i], each.high[i]);
        }
    }
    EXPECT_GT(told, 3000U);
    EXPECT_GT(elsewhere, 2000U);
}

TEST(FibreRows, WhatReachesOutOfTheCoverIsTold) {
    std::mt19937 random(test::seed());
    std::uniform_int_distribution<int> draw(0, 6);  // few values, so that ends often meet
    CoverRows cover = nothing_covered();
    Row low{}, high{};
    alignas(64) std::array<std::int64_t, kLinesTogether> state{};
    for (int round = 0; round < 2000; ++round) {
        for (std::size_t i = 0; i < low.size(); ++i) {
            cover.low[i] = draw(random);
            cover.high[i] = cover.low[i] + draw(random);
            cover.next[i] = cover.high[i] + 1 + draw(random);
            low[i] = draw(random);
            high[i] = draw(random) + draw(random);
        }
        const int first = kLinesStep * (draw(random) / 2), last = first + kLinesStep * (draw(random) / 2);
        std::int64_t any = 0;
        const std::int64_t said = cover_rows(cover, low.data(), high.data(), first, last, state.data());
        for (int l = first; l < last; ++l) {
            const auto i = static_cast<std::size_t>(l);
            std::int64_t wanted = low[i] < cover.low[i] || low[i] >= cover.next[i] ? kLooksElsewhere
                                  : high[i] > cover.high[i]                        ? kReachesOut
                                                                                   : 0;
            if (low[i] >= high[i]) wanted = 0;
            ASSERT_EQ(state[i], wanted) << low[i] << ' ' << high[i] << " of " << cover.low[i] << ' '
                                        << cover.high[i] << ' ' << cover.next[i];
            any |= wanted;
        }
        ASSERT_EQ(said, any);
    }
}

}  // namespace
}  // namespace slabwright
