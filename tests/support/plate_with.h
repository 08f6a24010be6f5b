// A plate with one post on it, or one pocket in it.
#pragma once

#include <vector>

#include "tests/data/sweep.h"

namespace slabwright::test {

/// @param z of the plate's top, mm; it stands on z = 0
/// @param inside the outline of a post that ends at z_inside above it, or of a pocket whose floor lies there
/// below it
inline std::vector<Facet> plate_with(const Outline& plate, double z, const Outline& inside, double z_inside) {
    const Ring bottom = ring(plate, {0, 0}), edge = ring(plate, {0, z}), foot = ring(inside, {0, z}),
               end = ring(inside, {0, z_inside});
    std::vector<Facet> facets;
    flat(facets, bottom, {}, false);
    strip(facets, bottom, edge);
    flat(facets, edge, {foot}, true);
    strip(facets, foot, end);
    flat(facets, end, {}, true);
    return facets;
}

}  // namespace slabwright::test
