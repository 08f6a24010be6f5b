// How much of a layer's surface a tool reaches (METHOD.md section 6, `exact`): by area, in 3D, with Embree.
//
// A point of the part is reached if there is a place of the tool, its axis upright, in which the cutter's
// surface passes within the tolerance of the point and nothing of the part, as it stands while the layer is
// machined (all of it below the layer's top), is deeper in cutter, shank or holder than the tolerance. Like
// all kernels of this folder it lets tools reach upwards without end, so what overhangs counts down to the
// ground.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "kernels/access/standing_part.h"
#include "kernels/cutting/tool_shape.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct AccessOptions {
    double tolerance = 0.01;  ///< mm, over 0; see above
    /// mm: facets are tested in pieces no longer than this, at four points each. Unless `shares` are asked
    /// for, pieces that are smaller than half of its square are tested together with their neighbours, at
    /// four of their middles, so the work does not grow with the facets. 0: a fiftieth of the square's side
    /// that is as large as the surface to be machined, 1 mm at least.
    double spacing = 0;
    /// Pieces whose points disagree are halved until the likely error of AR is at most this: each is wrong by
    /// half of its area, up or down, and none knows of the others. What is left of them goes into
    /// `uncertain`.
    double accuracy = 0.002;
    /// An AR that is asked about, over 0: nothing is measured any finer where AR is over or under it by four
    /// times its likely error. Unless `shares` are asked for, a large surface is then not taken piece by
    /// piece: 512 points dealt evenly over it are tested, where those do not tell 2048, and then 8192.
    double limit = 0;
    double lowest_tip =
        -std::numeric_limits<double>::infinity();  ///< mm: no tip goes lower (base board, flask)
    bool shares = false;                           ///< fill Accessibility::share
};

/// Areas in mm². Flats in the layer's top or bottom plane are not counted: a face mill makes them, or they
/// are glued.
struct Accessibility {
    double area = 0;  ///< to be machined in this layer: facing up or upright (within 1e-4 rad), and nothing
                      ///< of the layer above it
    double reached = 0;       ///< of it
    double undercut = 0;      ///< facing down, or under something that does
    double uncertain = 0;     ///< of pieces on a border, of which `reached` and `undercut` hold their points'
                              ///< shares; all of `area` where points were dealt evenly (AccessOptions::limit)
    double likely_error = 0;  ///< of ratio(): one standard deviation, where borders and points fall by chance
    std::vector<float> share;  ///< on request, per facet of the mesh: reached / area; −1 where nothing of it
                               ///< is to be machined in this layer
    std::uint64_t points = 0, queries = 0, rays = 0;  ///< tested, and asked of Embree
    std::uint64_t undecided = 0;  ///< points given up after 20000 places, counted as not reached

    /// AR; 1 where nothing is to be machined. Its error is at most uncertain/area, and likely some
    /// `likely_error`, unless a spot smaller than the spacing is missed.
    [[nodiscard]] double ratio() const { return area > 0 ? reached / area : 1; }
};

/// Embree's trees over a mesh, built once for all layers and tools, some 120 bytes a facet, charged to the
/// context, which must outlive it. Borrows the mesh's arrays.
/// @throws Error(input, "mesh.not_finite"), Error(no_plan, "memory.limit")
class AccessScene {
public:
    AccessScene(Context& context, MeshView mesh);
    ~AccessScene();
    AccessScene(const AccessScene&) = delete;
    AccessScene& operator=(const AccessScene&) = delete;

    /// Of the facets between z_low and z_high, mm. The same figures on any number of threads.
    /// @throws Error(usage, "tool.shape" | "access.options"), Error(cancelled)
    [[nodiscard]] Accessibility accessible(Context& context, double z_low, double z_high,
                                           const ToolShape& tool, const AccessOptions& options = {}) const;

    /// Whether one point of the surface is reached; `normal` is the surface's there, outward, and only says
    /// where to look first. True: there is a place as above. False: there is none for a tolerance half as
    /// large.
    [[nodiscard]] bool reaches(double z_high, const Point3& point, const Point3& normal,
                               const ToolShape& tool, const AccessOptions& options = {}) const;

    struct Impl;  ///< Embree's part
private:
    std::unique_ptr<Impl> impl_;
};

/// For one layer and one tool; see AccessScene.
[[nodiscard]] Accessibility accessible(Context& context, MeshView mesh, double z_low, double z_high,
                                       const ToolShape& tool, const AccessOptions& options = {});

}  // namespace slabwright
