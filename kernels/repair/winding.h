// The winding number of a point about facets, closed or not.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/repair/xyz.h"

namespace slabwright {

/// The solid angle of a triangle seen from p, over 4π (van Oosterom and Strackee, 1983): positive where its
/// back is seen, for it is counter-clockwise from outside.
[[nodiscard]] double winding_of(const Xyz& a, const Xyz& b, const Xyz& c, const Xyz& p);

/// The generalized winding number, by the fast approximation of Barill, Dickson, Schmidt, Levin and Jacobson
/// ("Fast winding numbers for soups and clouds", ACM TOG 37(4), 2018): 1 inside a closed surface, 0 outside,
/// and in between where something is missing. Clusters of facets that are far away count as one dipole. Build
/// n log n, a query about log n. Const functions may be called from many threads.
class WindingTree {
public:
    /// Copies the facets. 96 bytes a facet, charged while it is built.
    WindingTree(Context& context, std::span<const Vec3f> vertices, std::span<const Index3> facets);

    /// Error under .1, most of it within the nearest clusters. On a facet itself it is half of what lies on
    /// either side.
    [[nodiscard]] double at(const Xyz& p) const;

private:
    struct Node {
        Xyz middle{}, dipole{};  // of the facets by area; their vector area, mm²
        double radius = 0;       // about the middle
        std::uint32_t begin = 0, end = 0, left = 0;
    };
    void split(std::uint32_t node, std::vector<std::uint32_t>& order, const std::vector<Xyz>& middles);

    std::vector<std::array<Vec3f, 3>> facets_;
    std::vector<Node> nodes_;
};

}  // namespace slabwright
