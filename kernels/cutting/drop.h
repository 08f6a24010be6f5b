// Dropping a cutter onto the layer's solid: how low its tip may go over a point (the cutter-location
// surface).
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>

#include "kernels/cutting/flat_way.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/cutting/tool_shape.h"

namespace slabwright {

/// Where a dropped cutter comes to rest.
struct Rest {
    double tip_z = 0;      ///< mm; −infinity where nothing is in reach
    float nx = 0, ny = 0;  ///< the unit normal at the contact (of a level floor nz only)
    float nz = 0;          ///< its upward part
    bool on_cap = false;   ///< it rests on the layer's flat top
    /// Height of a ball's contact.
    [[nodiscard]] double contact_z(double radius) const { return tip_z + radius * (1 - nz); }
};

/// The last few points of a solid that cutters met. What they keep up nearby need not be searched for again:
/// for drops along a line, or around a place, of one thread.
class MetPoints {
public:
    void add(const Vec3d& point) {
        points_[next_] = point;
        next_ = (next_ + 1) % points_.size();
    }
    /// Less than the tip of this cutter over a place: what the points keep it up to, less what rounding may
    /// take from that; −infinity where none is in reach.
    [[nodiscard]] double keep_up(const CutterShape& cutter, double x, double y) const;

private:
    static std::array<Vec3d, 8> nowhere() {
        std::array<Vec3d, 8> points;
        points.fill({std::numeric_limits<double>::infinity(), 0, 0});
        return points;
    }
    std::array<Vec3d, 8> points_ = nowhere();
    std::size_t next_ = 0;
};

/// A cutter to be dropped onto a layer's solid. A view: the solid must outlive it. What a drop is given met
/// points for, and adds to them, makes it sooner done and changes nothing else.
class DropIndex {
public:
    /// @throws Error(usage, "tool.shape") as under_side(); Error(usage, "drop.radius") for a radius that is
    /// not positive or over FacetTree::kWidestCutter
    DropIndex(const LayerSolid& solid, const CutterShape& cutter);
    /// Exact over facets, edges and vertices (for a flat cutter over their shadow, tip on the highest of
    /// them). Of contacts that are equally high the one is given that the solid's tree leads to first.
    /// @param above mm: a tip that is no higher need not be told, but may be given as −infinity
    [[nodiscard]] Rest drop(double x, double y, double above = -std::numeric_limits<double>::infinity(),
                            MetPoints* met = nullptr) const;
    /// The same where the tip is no higher than `most`, nothing elsewhere; the latter as soon as that is
    /// known.
    [[nodiscard]] std::optional<Rest> drop_within(double x, double y, double above, double most,
                                                  MetPoints* met = nullptr) const;
    /// Whether drop(x, y).tip_z > z, in a fraction of its time.
    [[nodiscard]] bool stands_over(double x, double y, double z, MetPoints* met = nullptr) const;
    /// drop(x, y).tip_z where that is no more than `most`, nothing elsewhere; the latter as soon as that is
    /// known.
    [[nodiscard]] std::optional<double> tip_within(double x, double y, double most,
                                                   MetPoints* met = nullptr) const;
    /// Whether a flat cutter's straight way between places where it is free is free too, to within `over` mm
    /// (flat_way_is_free).
    [[nodiscard]] bool way_is_free(const Vec3d& a, const Vec3d& b, double over) const {
        return flat_way_is_free(solid_, cutter_.radius, a, b, over);
    }
    [[nodiscard]] const CutterShape& cutter() const { return cutter_; }

private:
    [[nodiscard]] bool nothing_near(double x, double y) const;
    [[nodiscard]] DropProbe probe_at(double x, double y) const;
    const LayerSolid& solid_;
    CutterShape cutter_;
    DropProbe probe_;
};

}  // namespace slabwright
