#include <cmath>
#include <numbers>

#include "tests/data/sweep.h"

namespace slabwright {

std::vector<Facet> half_sphere() {
    // 144 by 32 keep the volume within 0.1 % of the sphere's and the file under 500 kB.
    constexpr double radius = 50;
    constexpr int around = 144, rings = 32;
    Outline centre;  // all normals leave from the origin, so an offset is a radius
    for (int i = 0; i < around; ++i) {
        const double a = 2 * std::numbers::pi * i / around;
        centre.push_back({0, 0, std::cos(a), std::sin(a)});
    }
    Profile profile;
    for (int k = 0; k < rings; ++k) {
        const double latitude = std::numbers::pi / 2 * k / rings;
        profile.push_back({radius * std::cos(latitude), radius * std::sin(latitude)});
    }
    std::vector<Facet> facets;
    flat(facets, ring(centre, profile.front()), {}, false);
    fan(facets, sweep(facets, centre, profile), {0, 0, static_cast<float>(radius)});
    return facets;
}

}  // namespace slabwright
