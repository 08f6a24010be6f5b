// Holes hardly wider than an end mill that does not cut straight down, without a floor of their own: what
// rougher steps leave in them is cleared all the same. Random plates with one hole each, planned and proven.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <random>

#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

constexpr int kSides = 24;

using Ring = std::array<Vec3f, kSides>;

template <class Shape>
Ring ring(double z, Shape&& shape) {
    Ring ring{};
    for (int i = 0; i < kSides; ++i) {
        const std::array<double, 2> p = shape(2 * std::numbers::pi * i / kSides);
        ring[static_cast<std::size_t>(i)] = {static_cast<float>(p[0]), static_cast<float>(p[1]),
                                             static_cast<float>(z)};
    }
    return ring;
}

/// A round plate with a bean-shaped hole through it, 1.12 to 1.8 times as wide as a cutter and longer.
std::vector<std::array<Vec3f, 3>> plate_with_bean(std::mt19937& random, double cutter) {
    const auto from = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const double height = from(4, 14), half_width = cutter * from(0.56, 0.9),
                 half_length = half_width * from(1.3, 3), bent = from(-0.5, 0.5),
                 turn = from(0, 2 * std::numbers::pi), c = std::cos(turn), s = std::sin(turn);
    const auto plate = [&](double t) {
        return std::array{16 + 15 * std::cos(t + turn), 16 + 15 * std::sin(t + turn)};
    };
    const auto bean = [&](double t) {
        const double x = half_length * std::cos(t), y = half_width * std::sin(t) * (1 + bent * std::cos(t)) +
                                                        0.15 * half_length * bent * std::cos(2 * t);
        return std::array{16 + c * x - s * y, 16 + s * x + c * y};
    };
    const std::array rings{ring(0, plate), ring(height, plate), ring(height, bean), ring(0, bean)};
    std::vector<std::array<Vec3f, 3>> facets;
    for (std::size_t q = 0; q < rings.size(); ++q) {
        const Ring &a = rings[q], &b = rings[(q + 1) % rings.size()];
        for (std::size_t i = 0; i < kSides; ++i) {
            const std::size_t j = (i + 1) % kSides;
            facets.push_back({a[i], a[j], b[j]});
            facets.push_back({a[i], b[j], b[i]});
        }
    }
    return facets;
}

TEST(NarrowWaste, HolesHardlyWiderThanTheirCutterAreCleared) {
    std::mt19937 random(test::seed());
    support::TemporaryFolder folder;
    for (int round = 0; round < 16; ++round) {
        Job job;
        Tool thin = tool_of_kind(job, ToolKind::flat);
        thin.number = 9;
        thin.name.clear();
        thin.diameter = std::array{1.5, 2.0, 3.0}[static_cast<std::size_t>(round % 3)];
        thin.flute_length = 20, thin.stickout = 23, thin.shank_diameter = 3;
        thin.stepdown_min = thin.diameter / 5, thin.stepdown_max = thin.diameter / 2;
        job.tools.push_back(thin);
        ASSERT_GT(core_diameter_of(thin), 0) << "it does not cut straight down";
        const std::string stl = folder / "bean.stl";
        Context context({.threads = 2});
        write_stl(stl, weld(context, plate_with_bean(random, thin.diameter)));
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
        Plan made = plan(context, *pattern, job);
        const std::string out = folder / ("out" + std::to_string(round));
        (void)write_proven(context, made, out, pattern, true);  // keeps what does not pass
        const Verification found = verify_folder(context, out, {.source = stl, .write = false});
        EXPECT_TRUE(found.report.passed())
            << "round " << round << ", an end mill of " << thin.diameter
            << " mm: " << (found.report.violations.empty() ? "" : found.report.violations.front().message);
    }
}

}  // namespace
}  // namespace slabwright
