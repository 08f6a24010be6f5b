// Whether a tool reaches points of a part's surface: places from which it would touch them are looked for,
// and what is in the way there rules out others.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "kernels/access/accessibility.h"
#include "kernels/access/facet_scene.h"
#include "kernels/access/poke.h"

namespace slabwright {

/// What a search took.
struct ReachCounts {
    std::uint64_t points = 0, queries = 0, rays = 0, undecided = 0;
    void add(const ReachCounts& c) {
        points += c.points;
        queries += c.queries;
        rays += c.rays;
        undecided += c.undecided;
    }
};

/// The layer and the tool that points are tested for.
struct ReachQuestion {
    const FacetScene* scene = nullptr;
    double top = 0;
    double margin = 0;       ///< mm that places and distances in single precision may be wrong by
    bool overhangs = false;  ///< some may hang over a place of the tool
    std::vector<Envelope> tool, shrunken;  ///< its parts, and what of them is deeper than the tolerance
    AccessOptions options;
    // The under side of the cutter grown by the tolerance, along its profile from the tip outwards: the disc,
    // the arc, the flank.
    double disc = 0, arc = 0, flank = 0, rounding = 0, angle = 0;

    [[nodiscard]] double length() const { return disc + arc + flank; }
    /// The profile at a length along it: distance from the axis, height over the tip, and the direction,
    /// outwards and upwards.
    struct Spot {
        double distance, height, outwards, upwards;
    };
    [[nodiscard]] Spot at(double l) const {
        const double centre = tool[0].low + tool[0].rounding;
        if (l <= disc) return {l, centre - rounding, 1, 0};
        const double u = std::min(l - disc, arc) / rounding, more = std::max(0.0, l - disc - arc);
        const double sine = std::sin(u), cosine = std::cos(u);
        return {disc + rounding * sine + more * cosine, centre - rounding * cosine + more * sine, cosine,
                sine};
    }
};

/// @param z_low, z_high of the layer, mm
/// @throws Error(usage, "access.options")
[[nodiscard]] ReachQuestion reach_question(const FacetScene& scene, double z_low, double z_high,
                                           const ToolShape& tool, const AccessOptions& options);

/// Tests points one after the other; what it remembers makes neighbours cheap. One thread.
class ReachSearcher {
public:
    /// @param question outlives it
    explicit ReachSearcher(const ReachQuestion& question);
    ~ReachSearcher();
    ReachSearcher(const ReachSearcher&) = delete;
    ReachSearcher& operator=(const ReachSearcher&) = delete;

    /// @param p, n a point of the surface and its outward normal
    /// @param corner of the piece, from which the point is no farther than `around`: others are tested near
    /// it, and may be missed for the same reason
    [[nodiscard]] bool reaches(const Point3& p, const Point3& n, const Point3& corner = {},
                               double around = 0);

    /// Looks whether a whole piece is missed, if others have been of late.
    void try_proving_missed(const Point3& middle, const Point3& n, double around);

    [[nodiscard]] ReachCounts& counts();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace slabwright
