// Facets and boxes as rows of numbers, so that many of them are compared with one place or way in a step: what is certainly out of reach is
// left out at once.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

namespace slabwright {

/// What is compared of a facet.
struct NearFacet {
    double nx, ny, nz, offset;  ///< signed distance from its plane: n·p + offset
    double needs;               ///< a place so far above the plane, or farther, does not meet the facet
    double x, y, far2;          ///< nor does one whose horizontal distance from (x, y), squared, is far2 or more
    double highest;             ///< z
};

/// A way of what is compared, and the height that a facet must exceed.
struct NearWay {
    std::array<double, 3> a, b;
    double above;
};

class NearFacets {
public:
    void clear();
    void add(const NearFacet& facet);
    /// keep[i] is 1 where the way may meet facet i, else 0. Its size becomes a multiple of eight, filled with 0.
    void near(const NearWay& way, std::vector<unsigned char>& keep) const;

private:
    std::array<std::vector<double>, 9> rows_;
};

/// x0, x1, y0, y1
using NearBox = std::array<float, 4>;

class NearBoxes {
public:
    void clear();
    void add(const NearBox& box);
    /// The same for the boxes that hold (x, y), their borders included.
    void around(double x, double y, std::vector<unsigned char>& keep) const;

private:
    std::array<std::vector<float>, 4> rows_;
};

/// fn(i) for all that is kept, ascending.
template <class Fn>
void for_each_kept(const std::vector<unsigned char>& keep, Fn&& fn) {
    static_assert(std::endian::native == std::endian::little);
    for (std::size_t i = 0; i + 8 <= keep.size(); i += 8) {
        std::uint64_t eight;
        std::memcpy(&eight, keep.data() + i, 8);
        for (; eight != 0; eight &= eight - 1) fn(i + static_cast<std::size_t>(std::countr_zero(eight)) / 8);
    }
}

}  // namespace slabwright
