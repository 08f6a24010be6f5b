// What all operations of one layer share, and the operations themselves, one file each.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "engine/moves/path_builder.h"
#include "engine/paths/paths.h"
#include "kernels/cutting/drop.h"
#include "kernels/cutting/level_contours.h"
#include "kernels/features/alpha_map.h"

namespace slabwright {

/// Facets this near in height belong to one floor, mm.
inline constexpr double kSameFloor = 0.005;

struct LayerCut {
    Context& context;
    const LayerJob& layer;
    const Job& job;
    LayerSolid solid;
    double stock_top = 0;  ///< of the slab as bonded, mm

    /// The place of x or y stretched past the stock's edge by `beyond`, kept within the travel of the
    /// machine.
    [[nodiscard]] double low(int axis, double beyond) const;
    [[nodiscard]] double high(int axis, double beyond) const;
    /// The stock, seen from above.
    [[nodiscard]] Loops stock_outline() const;
    /// Smallest slope (radians from level) of the facets to be machined between z0 and z1 that are at least
    /// `steepest_flat` steep; π/2 where there are none.
    [[nodiscard]] double least_slope(double z0, double z1, double at_least) const {
        return alpha.least(z0, z1, at_least);
    }
    /// Sections of the mesh for the tip heights of a cutter, in their order.
    [[nodiscard]] std::vector<Section> insides(const Cutter& cutter, std::span<const double> tip_z) const;
    /// The contour of every level, levels in parallel.
    [[nodiscard]] std::vector<Contours> contours(const Cutter& cutter, std::span<const double> tip_z,
                                                 std::int32_t pitch) const;
    [[nodiscard]] Operation operation(OperationKind kind, const char* purpose, const Tool& tool) const;

    /// Heights of the floors that the flat end mill finishes, descending: the highest vertex of each flat,
    /// for the facets of a flat may differ in their last bits. Flats within kSameFloor are one.
    std::vector<double> floors;
    AlphaMap alpha;  ///< from floor_below to the layer's top

    /// Drops of a cutter; made at the first call and kept. Call it from the layer's own thread only.
    [[nodiscard]] const DropIndex& drops(const Cutter& cutter) const;
    /// What a tool's links must know; `part` as for Surroundings.
    [[nodiscard]] Surroundings around(const Tool& tool, const DropIndex* part) const;
    Standing* standing = nullptr;  ///< what stands after the operations so far; null: not known
    mutable std::vector<std::pair<Cutter, std::unique_ptr<DropIndex>>> made_drops{};
    mutable std::vector<std::array<double, 3>> no_way_in{};  ///< where runs were left out (Surroundings)
};

/// Longest chord between exact cutter locations that stays within 0.65 of the gouge tolerance (see
/// level_contours), in 0.1 µm for a grid's pitch (chord/√2), and what simplifying may add (0.12 of it). The
/// arcs and longer chords that are fitted to a finished operation may add 0.18 more, so that all of them stay
/// within 0.95; to a roughing, a share of what it leaves.
[[nodiscard]] double safe_chord_mm(double radius, double gouge);
[[nodiscard]] std::int32_t safe_pitch(double radius, double gouge);
/// Between places of a line whose chords are looked at one by one, 0.1 µm: three quarters of that chord. Like
/// a pitch it is never 0, whatever the tolerance.
[[nodiscard]] std::int32_t safe_step(double radius, double gouge);
[[nodiscard]] double simplify_tolerance_units(double gouge);
[[nodiscard]] double arc_tolerance_units(const Job& job, OperationKind kind);

/// Gives a finish run at one level a tangential arc into the cut and one out of it, on its free side, where
/// drops of the cutter prove the room and nothing stands that would be entered head-on. The part is on the
/// right of the run. A closed run (its last point is its first) is cut a little past its beginning, so that
/// no mark stays there.
/// @returns whether the arc into the cut found room
bool add_leads(PathBuilder& path, const LayerCut& cut, const DropIndex& part, double chord,
               std::vector<PathPoint>& run);

/// The slopes, in radians from level, that the job's finish strategy gives to level contours (from
/// `levels_from` up, over π/2: none) and to projected paths (up to `projection_to`, negative: none), and
/// those on which the cusp decides their steps.
struct FinishSlopes {
    double levels_from = 0, levels_keep = 0;
    double projection_to = 0, projection_keep = 0;
};
[[nodiscard]] FinishSlopes finish_slopes(const Cutting& cutting);

/// A level of roughing, mm.
struct RoughLevel {
    double tip = 0;    ///< where the tip runs
    double spare = 0;  ///< what must be spared lies above this height
};
/// The levels of a flat end mill, descending: one `floor` (mm) over every up-facing flat and one on the
/// layer's bottom, and between them the stepdowns that the slopes and the tool allow.
[[nodiscard]] std::vector<RoughLevel> rough_levels(const LayerCut& cut, const Tool& tool, double floor);

/// Clears a region given as free stretches on parallel lines along x, chained into zigzags, the nearest
/// first; each chain is begun outside the stock where one of its ends lies there. `path` must know its
/// surroundings, so that it ramps down elsewhere.
/// @param line_y     0.1 µm, ascending
/// @param free       per line
/// @param tip_z      mm
/// @param links      the fibres along y at given x (0.1 µm, ascending): where the tool may pass from line to
/// line
void zigzag(PathBuilder& path, const LayerCut& cut, const Tool& tool, std::span<const std::int32_t> line_y,
            const std::vector<std::vector<Stretch>>& free, double tip_z,
            const std::function<Fibres(std::span<const std::int32_t>)>& links);

/// How deep the face mill cuts at most, mm.
[[nodiscard]] double face_step(const Job& job, const Tool& face);
[[nodiscard]] Operation face_layer(const LayerCut& cut);
/// The end mill's, which may have no moves, and before it, where it is of use, the face mill's
/// (open_waste.h).
[[nodiscard]] std::vector<Operation> rough_layer(const LayerCut& cut);
[[nodiscard]] Operation finish_floors(const LayerCut& cut);
[[nodiscard]] Operation finish_walls(const LayerCut& cut);
[[nodiscard]] Operation finish_levels(const LayerCut& cut, std::vector<Diagnostic>& diagnostics);
[[nodiscard]] Operation finish_raster(const LayerCut& cut, std::vector<Diagnostic>& diagnostics);
[[nodiscard]] Operation finish_offsets(const LayerCut& cut, std::vector<Diagnostic>& diagnostics);

}  // namespace slabwright
