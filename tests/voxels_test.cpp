// AS on voxels (LUO 5.5.2; METHOD.md section 7): closed forms of slots and corners, and brute force over
// every cell.
#include "kernels/voxels/voxels.h"
#include "tests/support/seed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace slabwright {
namespace {

void add_rectangle(Loops& loops, double x0, double y0, double x1, double y1, bool hole = false) {
    std::vector<Point2> p{{to_units(x0), to_units(y0)},
                          {to_units(x1), to_units(y0)},
                          {to_units(x1), to_units(y1)},
                          {to_units(x0), to_units(y1)}};
    if (hole) std::swap(p[1], p[3]);
    loops.points.insert(loops.points.end(), p.begin(), p.end());
    loops.close_loop();
}

void add_circle(Loops& loops, double x, double y, double r) {
    constexpr int n = 48;
    for (int i = 0; i < n; ++i) {
        const double t = 2 * std::numbers::pi * i / n;
        loops.points.push_back({to_units(x + r * std::cos(t)), to_units(y + r * std::sin(t))});
    }
    loops.close_loop();
}

// A block of 100 × 60 with a pocket of w × 40 in its middle, the same at all heights.
LayerVoxels pocket(Context& context, double w, double voxel, double height = 4) {
    const VoxelBox box = voxel_box({-10, -10, 0}, {110, 70, height}, voxel);
    Loops loops;
    add_rectangle(loops, 0, 0, 100, 60);
    add_rectangle(loops, 50 - w / 2, 10, 50 + w / 2, 50, true);
    return LayerVoxels(context, box, std::vector<Loops>(static_cast<std::size_t>(box.nz), loops), 30);
}

double corners(double r) { return 4 * r * r * (1 - std::numbers::pi / 4); }

TEST(Voxels, ASlotStaysWhereTheCutterIsTooWide) {
    Context context;
    LayerVoxels slot = pocket(context, 8, 0.25);
    EXPECT_NEAR(slot.left(context, {4.5, 0, {0}, {}}, 0).rough_area, 8 * 40, 1e-9) << "nothing is cleared";
    EXPECT_NEAR(slot.left(context, {3.5, 0, {0}, {}}, 0).rough_area, corners(3.5), 2.5)
        << "but for four corners";
    EXPECT_NEAR(slot.left(context, {3.5, 0.6, {0}, {}}, 1).area, 6 * 38, 2.5) << "the allowance closes it";
    // 3 mm from either wall and end leave a strip of 2 × 34 in the middle.
    const RoughLeft left = slot.left(context, {4.5, 0, {0}, {}}, 3);
    EXPECT_NEAR(left.area, 2 * 34, 2.5);
    EXPECT_NEAR(left.volume, left.area * 4, 1e-9);
    EXPECT_NEAR(left.where[0], 49, 0.3);
    EXPECT_NEAR(left.where[1], 13, 0.3);
    EXPECT_TRUE(slot.left(context, {4.5, 0, {0}, {}}, 4).nothing(0.25));
    EXPECT_FALSE(left.nothing(0.25));
}

TEST(Voxels, WhatADiscTouches) {
    Context context;
    LayerVoxels slot = pocket(context, 8, 0.25);
    constexpr double outside = 2 * (100 + 60), inside = 2 * (8 + 40);
    EXPECT_NEAR(slot.reached_share(context, 4.5, 4), outside / (outside + inside), 0.01);
    // A disc that lies in a corner touches either wall at r from it; nearer than half a voxel it lies from r
    // − √(r·voxel) on.
    const double r = 3, apart = r - std::sqrt(r * 0.25);
    EXPECT_NEAR(slot.reached_share(context, r, 4), (outside + inside - 8 * apart) / (outside + inside), 0.01);
    EXPECT_GT(slot.reached_share(context, 0.3, 4), 0.99);
}

TEST(Voxels, CornersOfASquarePocket) {
    Context context;
    for (const double r : {3.0, 6.35, 12.7}) {
        const double within_cell =
            4 * r * 0.125 + 0.5;  // the cutter may stand up to a cell off either wall of a corner
        LayerVoxels square = pocket(context, 40, 0.125, 1);
        const RoughLeft left = square.left(context, {r, 0, {0}, {}}, 0);
        EXPECT_NEAR(left.rough_area, corners(r), within_cell) << r;
        // Farther than s from both walls of a corner there stays what a corner of the middle r - s leaves.
        const double s = 0.15 * r, a = r - s;
        const double cut = std::acos(a / r),
                     within =
                         a * a - (0.5 * r * r * (std::numbers::pi / 2 - 2 * cut) + a * r * std::sin(cut));
        EXPECT_NEAR(square.left(context, {r, 0, {0}, {}}, s).area, 4 * within, within_cell) << r;
    }
}

TEST(Voxels, StepsOnASlopeLeaveTriangles) {
    // A wall at 45° along y, 12 mm high: between levels 3 mm apart stands at most a strip of 3 mm.
    Context context;
    const VoxelBox box = voxel_box({0, 0, 0}, {40, 20, 12}, 0.25);
    std::vector<Loops> sections(static_cast<std::size_t>(box.nz));
    for (int k = 0; k < box.nz; ++k)
        add_rectangle(sections[static_cast<std::size_t>(k)], -20, -20, 20 - box.z(k), 40);
    LayerVoxels slope(context, box, sections, 10);
    const RoughLeft left = slope.left(context, {5, 0, {9, 6, 3, 0}, {}}, 0);
    EXPECT_NEAR(left.rough_area, 20 * 3, 20 * 0.5);
    EXPECT_NEAR(static_cast<double>(left.voxels) * std::pow(0.25, 3), 20 * 4 * 4.5, 20 * 4 * 1.5);
    EXPECT_TRUE(slope.left(context, {5, 0, {9, 6, 3, 0}, {}}, 3).nothing(0.25));
    EXPECT_NEAR(slope.area_to_clear(6), 20 * (40 - 14), 20 * 0.3);
}

// Random boxes and cylinders standing on each other, over a small grid.
struct Scene {
    VoxelBox box = voxel_box({0, 0, 0}, {24, 20, 6}, 0.5);
    std::vector<Loops> sections;
    explicit Scene(unsigned seed) : sections(static_cast<std::size_t>(box.nz)) {
        std::mt19937 random(seed);
        auto real = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        for (int n = 0; n < 6; ++n) {
            const double x = real(0, 24), y = real(0, 20), w = real(1, 6), d = real(1, 6), low = real(0, 3),
                         high = real(3, 6);
            const bool round = n % 2 == 0;
            for (int k = 0; k < box.nz; ++k) {
                if (box.z(k) < low || box.z(k) > high) continue;
                if (round) add_circle(sections[static_cast<std::size_t>(k)], x, y, w / 2);
                else add_rectangle(sections[static_cast<std::size_t>(k)], x, y, x + w, y + d);
            }
        }
    }
};

TEST(Voxels, EveryCellAsByBruteForce) {
    const unsigned seed = test::seed();
    for (unsigned round = 0; round < 6; ++round) {
        Context context;
        const Scene scene(seed + round);
        const VoxelBox& box = scene.box;
        const double h = box.voxel, r = 1.7, allowance = 0.3, swath = 1.3;
        const std::vector<double> tips{3.9, 2.0, 0};
        constexpr int border = 10;
        const int nx = box.nx + 2 * border, ny = box.ny + 2 * border;
        auto inside = [&](int k, int i, int j) {
            for (int up = k; up < box.nz; ++up)
                if (winding(scene.sections[static_cast<std::size_t>(up)],
                            {to_units(box.min[0] + (i + 0.5) * h), to_units(box.min[1] + (j + 0.5) * h)}) > 0)
                    return true;
            return false;
        };
        std::vector<std::vector<char>> kept(static_cast<std::size_t>(box.nz));
        for (int k = 0; k < box.nz; ++k)
            for (int j = -border; j < box.ny + border; ++j)
                for (int i = -border; i < box.nx + border; ++i)
                    kept[static_cast<std::size_t>(k)].push_back(inside(k, i, j));
        auto near = [&](const std::vector<char>& cells, int i, int j, double within, bool strict) {
            const int n = static_cast<int>(within / h) + 1;
            for (int b = std::max(0, j - n); b <= std::min(ny - 1, j + n); ++b)
                for (int a = std::max(0, i - n); a <= std::min(nx - 1, i + n); ++a) {
                    const double d = h * std::hypot(a - i, b - j);
                    if (cells[static_cast<std::size_t>(b * nx + a)] &&
                        (strict ? d < within - 1e-6 : d <= within + 1e-9))
                        return true;
                }
            return false;
        };
        std::uint64_t left = 0;
        double as = 0;
        for (int k = 0; k < box.nz; ++k) {
            int level = -1;
            for (const double tip : tips)
                if (box.z(k) >= tip && level < 0)
                    level = static_cast<int>(std::ceil((tip - box.min[2]) / h - 0.5 - 1e-6));
            const auto& bar = kept[static_cast<std::size_t>(std::max(0, level))];
            std::vector<char> places;
            for (int j = 0; j < ny; ++j)
                for (int i = 0; i < nx; ++i) places.push_back(!near(bar, i, j, r + allowance + h / 2, true));
            int outside = 0;
            for (int j = border; j < ny - border; ++j)
                for (int i = border; i < nx - border; ++i) {
                    if (kept[static_cast<std::size_t>(k)][static_cast<std::size_t>(j * nx + i)] ||
                        near(places, i, j, r + h / 2, false))
                        continue;
                    ++left;
                    const int below = std::max(0, k - static_cast<int>(swath / h + 1e-6));
                    outside += !near(kept[static_cast<std::size_t>(k)], i, j, swath + h / 2, false) &&
                               !kept[static_cast<std::size_t>(below)][static_cast<std::size_t>(j * nx + i)];
                }
            as = std::max(as, outside * h * h);
        }
        LayerVoxels voxels(context, box, scene.sections, 4);
        const RoughLeft found = voxels.left(context, {r, allowance, tips, {}}, swath);
        EXPECT_EQ(found.voxels, left) << round;
        EXPECT_NEAR(found.area, as, 1e-9) << round;
    }
}

TEST(Voxels, ASNeverRisesAsTheToolShrinks) {
    const unsigned seed = test::seed();
    for (unsigned round = 0; round < 20; ++round) {
        Context context;
        const Scene scene(seed + round);
        LayerVoxels voxels(context, scene.box, scene.sections, 6);
        for (const double swath : {0.0, 1.0, 2.0}) {
            double area = 1e300, rough = 1e300;
            std::vector<double> wider;
            for (const double r : {4.0, 3.3, 2.9, 2.1, 1.5, 0.8}) {
                const RoughLeft left = voxels.left(context, {r, 0.2, {4, 2, 0}, wider}, swath);
                EXPECT_LE(left.area, area) << round << " " << r;
                EXPECT_LE(left.rough_area, rough) << round << " " << r;
                area = left.area, rough = left.rough_area;
                wider.push_back(r);
            }
        }
    }
}

TEST(Voxels, TheSameOnAnyNumberOfThreads) {
    const Scene scene(7);
    RoughLeft first;
    for (const int threads : {1, 2, 4}) {
        Context context({.threads = threads});
        LayerVoxels voxels(context, scene.box, scene.sections, 6);
        const RoughLeft left = voxels.left(context, {2.5, 0.2, {4, 2, 0}, {}}, 1);
        if (threads == 1) first = left;
        EXPECT_EQ(left.area, first.area);
        EXPECT_EQ(left.voxels, first.voxels);
        EXPECT_EQ(left.where, first.where);
        EXPECT_EQ(left.sparse_bytes, first.sparse_bytes);
    }
    EXPECT_GT(first.area, 0);
}

}  // namespace
}  // namespace slabwright
