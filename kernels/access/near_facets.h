// Facets and boxes as rows of numbers, so that many of them are compared with one place or way in a step:
// what is certainly out of reach is left out at once.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

namespace slabwright {

/// The way of a ball's centre or of a cylinder's lower end, straight from a to b, with all that is above it.
struct NearWay {
    std::array<double, 3> a, b;
    double reach;  ///< what is so far away does not meet it, mm; a cylinder's horizontally
    double above;  ///< nor does what is not higher than this, mm
    double slack;  ///< what is meant may be so far from the straight way, mm
};

/// Corners of eight facets, mm.
struct EightFacets {
    std::array<float, 8> x0, y0, z0, x1, y1, z1, x2, y2, z2;
};

/// Corners of up to kMost facets, mm.
struct FacetRows {
    static constexpr std::size_t kMost = 64;
    std::array<float, kMost> x0, y0, z0, x1, y1, z1, x2, y2, z2;
};

/// Facets in single precision around an origin, each with what that can be wrong by: none is left out that
/// may be met.
class NearFacets {
public:
    /// For ways within a box, and a reach of `reach` mm at most, among what is below `top`. Without facets
    /// then.
    /// @param up mm that the ways are above the box at least
    void place(const std::array<double, 3>& low, const std::array<double, 3>& high, double reach, bool ball,
               double top, double up);
    /// Adds those of `count` facets that a way within the box may meet, in their order. @param keep gets 1
    /// for them, else 0, filled up as below
    void add(const FacetRows& facets, std::size_t count, std::vector<unsigned char>& keep) {
        add(facets, count, nullptr, false, keep);
    }
    /// keep[i] is 1 where the way may meet facet i, else 0. Its size becomes a multiple of eight, filled with
    /// 0.
    /// @param closely looks a second time at what is kept, so that little is that does not meet; not worth it
    /// where the slack is more
    void near(const NearWay& way, bool closely, std::vector<unsigned char>& keep) const;
    /// Adds of them only what near() would keep for this way.
    void add(const FacetRows& facets, std::size_t count, const NearWay& way, bool closely,
             std::vector<unsigned char>& keep) {
        add(facets, count, &way, closely, keep);
    }

private:
    static constexpr std::size_t kRows = 16;
    std::array<double, 3> middle_{}, half_{};
    void add(const FacetRows& facets, std::size_t count, const NearWay* way, bool closely,
             std::vector<unsigned char>& keep);
    double reach_ = 0, top_ = 0, up_ = 0;
    bool ball_ = false;
    std::size_t size_ = 0;
    std::array<std::vector<float>, kRows> rows_;
};

/// What a straight way may meet, in single precision: a first look, before anything is computed of a facet.
/// By extents along the way, across it and upwards, and by a plane across the line from the facet's middle to
/// the way. The reach holds what the numbers may be wrong by.
struct WayAround {
    /// @param lowest of the way, mm @param top what is not below it does not count @param reach mm; what is
    /// asked of the way itself does not matter
    WayAround(const NearWay& way, bool ball, double lowest, double top, double reach);

    float ax, ay, az, dx, dy, dz;  ///< where it begins and what it leads by, mm
    float ux, uy, length;          ///< its direction and its length in plan, mm
    float per_length2, end;        ///< 1 / length² and 1, or 0 where it has no length in plan
    float lowest, upwards;         ///< of it, mm, and 1 where heights count as distance, 0 where they do not
    float above, top;              ///< what is no higher, or not below the top, does not count, mm
    float reach2;                  ///< square of the reach, mm²
};

/// Eights to look at in one go.
struct ManyEights {
    static constexpr std::size_t kMost = 8;
    std::array<const EightFacets*, kMost> eights;
    std::size_t count = 0;
};

/// Bit k of keep[i] is 1 where the way may meet facet k of eight i, else 0.
void facets_around(const ManyEights& eights, const WayAround& way,
                   std::array<unsigned, ManyEights::kMost>& keep);

/// A level way of a ball's centre, straight or along a circle, with all that is above it: a closer look than
/// WayAround's. In the plane across the way it is one point, and facets are told from it there. The reach is
/// what it is for numbers without error.
struct LevelWay {
    /// From a to b, both at one height. @param top what is not below it does not count @param reach mm
    LevelWay(const std::array<double, 3>& a, const std::array<double, 3>& b, double top, double reach);
    /// Around (x, y) at a radius, near a point of it that the way is about @param before, after, bow mm that
    /// it reaches back and on along the tangent there, and inwards
    LevelWay(double x, double y, double radius, const std::array<double, 3>& about, double before,
             double after, double bow, double top, double reach);

    float ox, oy, oz, rest_x, rest_y,
        rest_z;                ///< a point of it, mm, and what is left of that in single precision
    float ux, uy;              ///< its direction there; a circle's centre lies to the left
    float before, after, bow;  ///< how far it reaches back, on and to the left, mm
    float curvature;           ///< 1 / mm; 0 of a straight way
    float top, reach;          ///< what is not below the top, or not within reach, does not count, mm

private:
    void begin_at(double x, double y, double z);
};

/// As facets_around().
void facets_along(const ManyEights& eights, const LevelWay& way,
                  std::array<unsigned, ManyEights::kMost>& keep);

/// fn(k) for every bit k that is 1, ascending.
template <class Fn>
void for_each_bit(unsigned bits, Fn&& fn) {
    for (; bits != 0; bits &= bits - 1) fn(static_cast<std::size_t>(std::countr_zero(bits)));
}

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
