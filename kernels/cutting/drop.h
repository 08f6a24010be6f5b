// Dropping a ball onto the layer's solid: how low its tip may go over a point (the cutter-location surface).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/cutting/cutter.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Where a dropped cutter comes to rest.
struct Rest {
    double tip_z = 0;      ///< mm; −infinity where nothing is in reach
    float nx = 0, ny = 0;  ///< the unit normal at the contact (a flat cutter gives nz only)
    float nz = 0;          ///< its upward part
    bool on_cap = false;   ///< it rests on the layer's flat top
    /// Height of the contact.
    [[nodiscard]] double contact_z(double radius) const { return tip_z + radius * (1 - nz); }
};

/// An index of the layer's solid for drops of one cutter.
class DropIndex {
public:
    DropIndex(Context& context, const LayerSolid& solid, const Cutter& cutter);
    /// Exact over facets, edges and vertices (for a flat cutter over their shadow, tip on the highest of them).
    [[nodiscard]] Rest drop(double x, double y) const;

private:
    [[nodiscard]] bool in_cap(double x, double y) const;
    const LayerSolid& solid_;
    Cutter cutter_;
    double x0_ = 0, y0_ = 0, cell_ = 1;
    std::size_t columns_ = 0, rows_ = 0;
    // Of a facet what decides whether it needs a look: its box, a little wider, and the first cell that lists it.
    struct Bounds {
        float x_low, x_high, y_low, y_high, z_max;
        std::uint16_t column, row;
    };
    std::vector<Bounds> bounds_;
    std::vector<std::uint32_t> starts_, members_;  // facets by cell, highest first
    std::vector<std::uint32_t> cap_starts_;        // cap segments by row of cells
    struct CapSegment {
        Point2 a, b;
    };
    std::vector<CapSegment> cap_segments_;
};

}  // namespace slabwright
