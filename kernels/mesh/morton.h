// Morton order: what is near in space is mostly near in it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "kernels/mesh/mesh.h"

namespace slabwright {

/// A grid of 2²¹ cubic cells along a box's longest side, numbered in Morton order.
class MortonGrid {
public:
    static constexpr int kBits = 21;  ///< along each axis
    explicit MortonGrid(const Box3& box);
    /// The number of the cell that holds a point; that of the nearest one for a point outside.
    [[nodiscard]] std::uint64_t code(double x, double y, double z) const {
        return spread(x, x0_) | spread(y, y0_) << 1 | spread(z, z0_) << 2;
    }
    /// The first 24 bits of that number, sooner.
    [[nodiscard]] std::uint32_t coarse_code(double x, double y, double z) const {
        return kSpread[cell(x, x0_) >> 13] | kSpread[cell(y, y0_) >> 13] << 1 |
               kSpread[cell(z, z0_) >> 13] << 2;
    }

private:
    [[nodiscard]] std::uint64_t cell(double at, double from) const {
        return static_cast<std::uint64_t>(
            static_cast<std::int64_t>(std::clamp((at - from) * per_mm_, 0.0, kLast)));
    }
    // 21 bits, two zeros after each.
    [[nodiscard]] std::uint64_t spread(double at, double from) const {
        std::uint64_t v = cell(at, from);
        v = (v | v << 32) & 0x1F00000000FFFFull;
        v = (v | v << 16) & 0x1F0000FF0000FFull;
        v = (v | v << 8) & 0x100F00F00F00F00Full;
        v = (v | v << 4) & 0x10C30C30C30C30C3ull;
        return (v | v << 2) & 0x1249249249249249ull;
    }
    static constexpr std::array<std::uint32_t, 256> kSpread = [] {
        std::array<std::uint32_t, 256> spread{};
        for (std::uint32_t v = 0; v < 256; ++v)
            for (std::uint32_t bit = 0; bit < 8; ++bit) spread[v] |= (v >> bit & 1) << 3 * bit;
        return spread;
    }();
    static constexpr double kLast = (1 << 21) - 1;
    double x0_, y0_, z0_, per_mm_;
};

inline MortonGrid::MortonGrid(const Box3& box) : x0_(box.min.x), y0_(box.min.y), z0_(box.min.z) {
    per_mm_ =
        kLast / std::max({1e-6, double{box.max.x} - x0_, double{box.max.y} - y0_, double{box.max.z} - z0_});
}

}  // namespace slabwright
