// The project's own models: sample parts of the papers, a pump cover, and patterns of any size for measuring.
// All are closed solids on z = 0 in millimetres, facets counter-clockwise seen from outside. Coordinates are
// multiples of 1/4096 mm, so that float holds them exactly and flats are flat to the last bit.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "kernels/mesh/mesh.h"

namespace slabwright {

/// The three corners of a facet, as STL has them.
using Facet = std::array<Vec3f, 3>;

/// LUO figure 5.15 from its description (5.6): three layers of .75, .75 and .5 in, cut from 10 × 8 in slabs.
/// See the .cpp for what each layer forces upon the choice of tools.
[[nodiscard]] std::vector<Facet> luo_tool_sample();

/// SHAPING figure 4: half a sphere of radius 50 mm, lying on its base, its centre at the origin. Vertices lie
/// on the sphere.
[[nodiscard]] std::vector<Facet> half_sphere();

/// A foundry pattern, 200 × 150 × 60 mm: flange, ribbed body, volute, bosses, pockets and a core print, with
/// 2° of draft and filleted feet that a 1/4 in ball end mill can cut. No undercuts.
[[nodiscard]] std::vector<Facet> pump_cover();

/// A square plate full of drafted bosses, ribs, domes and craters, every wall at 87° from horizontal.
struct MetrePattern {
    double size_mm = 1160;
    double height_mm = 300;
    std::uint64_t facets = 1'000'000;  ///< wished for; metre_pattern_facets() says what comes
    std::uint64_t seed = 1;
};

/// How many facets metre_pattern() gives: at least `facets`, from 20 000 on at most 10 % more. Of tens of
/// millions a few are left out whose corners fall on one another in the file's numbers (248 of 50 M).
/// @throws std::invalid_argument when the walls do not fit (height over 3 × size / tiles) or a number is not
/// positive
[[nodiscard]] std::uint64_t metre_pattern_facets(const MetrePattern& pattern);

/// Hands the facets to `sink` one by one; holds no more than one ring of vertices at a time.
void metre_pattern(const MetrePattern& pattern, const std::function<void(const Facet&)>& sink);

/// The 84 bytes that begin a binary STL, and the 50 bytes of one facet.
[[nodiscard]] std::string stl_head(const std::string& name, std::uint64_t facets);
[[nodiscard]] std::array<char, 50> stl_facet(const Facet& facet);
/// The whole file.
[[nodiscard]] std::string stl_bytes(const std::string& name, const std::vector<Facet>& facets);

}  // namespace slabwright
