// The finished stack as the report draws it: heights of wood, and boxes of what stays filled.
#include "io/write/report_as_built.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"

using namespace slabwright;

namespace {

std::vector<int> bytes_of(const std::string& base64) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::vector<int> bytes;
    unsigned bits = 0, held = 0;
    for (const char c : base64) {
        if (c == '=') break;
        bits = bits << 6U | static_cast<unsigned>(digits.find(c));
        held += 6;
        if (held < 8) continue;
        held -= 8;
        bytes.push_back(static_cast<int>(bits >> held & 255U));
    }
    return bytes;
}

/// Numbers of 16 bits, the lower byte first.
std::vector<int> words_of(const std::string& base64) {
    const std::vector<int> bytes = bytes_of(base64);
    std::vector<int> words;
    for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) words.push_back(bytes[i] + 256 * bytes[i + 1]);
    return words;
}

SimulatedLayer layer_of(double z_bottom, double z_top) {
    SimulatedLayer layer;
    layer.z_bottom = z_bottom, layer.z_top = z_top;
    return layer;
}

}  // namespace

TEST(ReportAsBuilt, WoodIsInBytesOrInRunsOfThem) {
    const SimulatedLayer layer = layer_of(10, 20);
    const PackedHeights each = packed_wood(layer, {10, 15, 20, 25, 5, 12.5F});
    EXPECT_FALSE(each.in_runs);
    EXPECT_EQ(bytes_of(each.base64), (std::vector<int>{0, 128, 255, 255, 0, 65}));
    std::vector<float> level(300, 20);
    level.push_back(10);
    const PackedHeights runs = packed_wood(layer, level);
    EXPECT_TRUE(runs.in_runs);
    EXPECT_EQ(bytes_of(runs.base64), (std::vector<int>{255, 255, 45, 255, 1, 0}));
}

// A plate that stands out over a block: under it the stock of its own layer stays, as one box a row.
TEST(ReportAsBuilt, FillingIsABoxARow) {
    shapes::Facets facets = shapes::box({0, 0, 0}, {10, 10, 6});
    shapes::append(facets, shapes::box({0, 0, 5}, {30, 10, 10}));
    Context context;
    const Mesh mesh = weld(context, facets);
    const SimulatedLayer layers[] = {layer_of(0, 4), layer_of(4, 10)};
    const PackedFilling filling =
        packed_filling(context, mesh.view(), layers, {false, false}, {-1.5, 0.5}, 1, 34, 10);
    EXPECT_EQ(filling.z0, 0);
    EXPECT_EQ(filling.height, 10);
    ASSERT_EQ(filling.layers.size(), 2U);
    EXPECT_EQ(filling.layers[0].mm3, 0) << "which is milled before the plate lies over it";
    EXPECT_TRUE(filling.layers[0].boxes.empty());
    EXPECT_EQ(filling.layers[1].mm3, 200);
    const std::vector<int> words = words_of(filling.layers[1].boxes);
    ASSERT_EQ(words.size(), 50U) << "five numbers of ten boxes";
    for (std::size_t row = 0; row < 10; ++row) {
        EXPECT_EQ(words[5 * row], static_cast<int>(row));
        EXPECT_EQ(words[5 * row + 1], 12) << "the columns from x 10.5 on";
        EXPECT_EQ(words[5 * row + 2], 20);
        EXPECT_NEAR(words[5 * row + 3], 0.4 * 65535, 1);
        EXPECT_NEAR(words[5 * row + 4], 0.5 * 65535, 1);
    }
    const PackedFilling turned =
        packed_filling(context, mesh.view(), layers, {false, true}, {-1.5, 0.5}, 1, 34, 10);
    EXPECT_EQ(turned.layers[1].mm3, 0) << "which is milled from below";
    EXPECT_TRUE(turned.layers[1].boxes.empty());
    EXPECT_EQ(turned.layers[1].below, filling.layers[1].boxes) << "which is drawn as milled";
    EXPECT_TRUE(filling.layers[1].below.empty());
}

// A hollow inside a layer opens to neither side.
TEST(ReportAsBuilt, WhatTwoSidesLeaveStays) {
    shapes::Facets facets = shapes::box({0, 0, 0}, {20, 20, 3});
    shapes::append(facets, shapes::box({0, 0, 2}, {5, 20, 8}));
    shapes::append(facets, shapes::box({15, 0, 2}, {20, 20, 8}));
    shapes::append(facets, shapes::box({0, 0, 7}, {20, 20, 10}));
    Context context;
    const Mesh mesh = weld(context, facets);
    const SimulatedLayer layers[] = {layer_of(0, 10)};
    const PackedFilling filling =
        packed_filling(context, mesh.view(), layers, {true}, {-1.5, 0.5}, 1, 24, 20);
    EXPECT_EQ(filling.layers[0].mm3, 10 * 20 * 4);
}
