// The facets of a layer's solid in a tree whose nodes say how high a cutter dropped nearby can rest on what
// they hold.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/mesh/bulk_memory.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct SolidFacet;

/// Children stand eight together, so that all bounds of a node are computed in one go. Places in the plane
/// are whole numbers of a unit far under a machine's: differences of them are exact, which those of floats
/// beside a metre are not.
struct FacetTree {
    static constexpr int kTogether = 8;
    static constexpr double kWidestCutter = 1000;  ///< mm: largest radius that the units leave room for

    /// For each of eight facets, or nodes of eight, a box that holds it and a plane that it nowhere exceeds
    /// within the box. A place that nothing takes has z_max = z_mid = −infinity.
    struct alignas(64) Node {
        std::array<std::int32_t, kTogether> x_low, x_high, y_low, y_high;  ///< units
        std::array<float, kTogether> z_max;                                ///< mm
        std::array<float, kTogether> z_mid, gx,
            gy;  ///< the plane: its height over the middle of the box, mm, and its slopes
    };
    /// Facets of about one size: those that are much larger than the others would widen the others' nodes,
    /// and be looked at first.
    struct Tier {
        BulkVector<Node> nodes;  ///< the leaves first, then level on level; child k of a level's node i is
                                 ///< node 8·i + k of the one below
        std::vector<std::uint32_t> starts;  ///< of each level in `nodes`, and their end
        BulkVector<std::uint32_t> facets;   ///< in the order of the leaves
    };
    std::vector<Tier> tiers;          ///< the smallest facets first; each has some
    double x0 = 0, y0 = 0, unit = 1;  ///< mm

    [[nodiscard]] std::int32_t x_units(double x) const { return static_cast<std::int32_t>((x - x0) / unit); }
    [[nodiscard]] std::int32_t y_units(double y) const { return static_cast<std::int32_t>((y - y0) / unit); }
};

/// The tree of facets whose extent in the plane is [min, max], mm. Neighbours along a Hilbert curve share a
/// node.
[[nodiscard]] FacetTree facet_tree(Context& context, std::span<const SolidFacet> facets,
                                   const std::array<double, 2>& min, const std::array<double, 2>& max);

/// A cutter over a place, for the bounds of many nodes.
struct DropProbe {
    std::int32_t x = 0, y = 0;    ///< units
    float radius = 0;             ///< units
    float unit = 1, inverse = 0;  ///< mm; 1 / 2r of the radius in mm
    float spare = 0;              ///< mm: what rounding may take from a height
};

/// By child of the node what the tip of a ball dropped at the place reaches on it at most, mm; −infinity
/// where it is out of reach. With u the way from the axis to a point of the facet in the plane, the tip over
/// that point of a plane z0 + g·u is
///     f(u) = z0 + g·u + √(r² − u²) − r,  greatest at u* = r·g / √(1 + g²), with f(u) ≤ f(u*) − |u − u*|² /
///     2r,
/// so the distance of u* from the box bounds it, as does the distance of the axis with g = 0 and z_max.
/// @return bit k: the bound of child k is over `least`
[[nodiscard]] std::uint32_t ball_bounds(const FacetTree::Node& node, const DropProbe& probe, float least,
                                        float* bounds);
/// The same for a flat cutter: z_max of what is in reach, and no more than the plane at the disc's uphill
/// rim.
[[nodiscard]] std::uint32_t flat_bounds(const FacetTree::Node& node, const DropProbe& probe, float least,
                                        float* bounds);

}  // namespace slabwright
