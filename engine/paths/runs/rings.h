// Rings around what must stay: how a region is entered and travelled, and how the last level of a layer is
// cleared.
#pragma once

#include <array>
#include <vector>

#include "engine/paths/runs/flask_room.h"
#include "engine/paths/runs/layer_cut.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// The places from which a tool touches the solid, as a region, from level contours at one height.
[[nodiscard]] Loops forbidden_region(const Contours& contours);

/// Cuts once around a closed ring (its first point is repeated at the end), entered at its start from `above`
/// down a ramp along the ring itself; the stretch of the ramp is cut again. A ring in which the tool's core
/// would leave a post is followed (PathBuilder::follow). Heights in 0.1 µm.
void cut_ring(PathBuilder& path, const std::vector<PathPoint>& ring, std::int32_t above, std::int32_t z,
              double ramp_deg);

/// How far rings lie apart, mm: the tool's stepover, and less than its radius by more than offsets, thinning
/// and rounded corners may add.
[[nodiscard]] double ring_step(const Tool& tool);

/// What a ring that meets nothing but waste may leave its line by, mm: little of the step between rings, so
/// that they still overlap.
[[nodiscard]] double ring_tolerance(const Tool& tool);

/// A region's loops with as few points as rings around it need that meet nothing but waste, ring_tolerance()
/// at most beside where they were: chords that leave a curve by no more than `blend` (mm), by which the
/// machine rounds corners, are run as fast as the curve.
[[nodiscard]] Loops thinned_rings(const LayerCut& cut, const Tool& tool, const Loops& region, double blend);

/// Rings around a forbidden region at one height, as far as they are of use, and which part of the free area
/// each of them bounds.
struct RingPlan {
    /// What a ring shows near the stock: the whole ring, or pieces of it.
    struct Piece {
        std::vector<PathPoint> points;  ///< closed ones repeat their first point
        std::array<double, 4> box{};    ///< 0.1 µm: smallest x and y, largest x and y
        std::size_t ring = 0;           ///< how many steps off the forbidden region
        std::size_t region = 0;         ///< with hold
        bool closed = false;
    };
    /// A connected part of what is free at one distance from the forbidden region. Within it, farther off,
    /// lie others.
    struct Region {
        std::size_t around = SIZE_MAX;  ///< the region one step nearer that holds this one
        std::size_t waits_for = 0;      ///< regions within this one
        std::vector<std::size_t> pieces;
    };
    std::vector<std::array<double, 4>> frames;  ///< rectangles cut before the rings, from the stock's edge
                                                ///< inwards: smallest x, y, largest x, y, mm
    double south = 0;  ///< mm: y beside the stock, where the first of them is entered
    std::vector<std::vector<PathPoint>>
        strips;  ///< runs along further rectangles, outside of the rings, in the order in which they are cut
    std::vector<Piece> pieces;
    std::vector<Region> regions;  ///< with hold
    double radius = 0;            ///< mm, of the tool
    double step = 0;              ///< mm between rings
    double frame_step = 0;        ///< mm between rectangles
    [[nodiscard]] double widest_step() const { return frames.empty() && strips.empty() ? step : frame_step; }
    std::int32_t z = 0;
    bool hold = false;  ///< all rings of one distance are cut before any nearer one
    /// Each piece is begun beside one that has been cut, from those at the stock's edge on: for a cutter that
    /// does not go down into stock. Open ones go either way. Not with hold.
    bool from_open = false;
};

/// Plans to clear everything between `forbidden` and the edge of the stock at one height: first in rectangles
/// from the stock's edge as far as these surround the forbidden region, then in rings around that region. The
/// forbidden region is on the right of every ring, so the cutter climbs (but see from_open, Cutting::climb).
/// Neighbouring rings are at most ring_step(), with `hold` no more than 0.45 of the diameter,
/// ring_tolerance() and 0.04 mm apart, rectangles ring_step() or, of a face mill, 0.6 of the diameter; the
/// ring next to the forbidden region keeps within 0.02 mm of its border. Without pieces the forbidden region
/// is nowhere near the stock.
/// @param forbidden of the tool's middle, as simplify() or unite() give it; the flask's included
/// @param tip_z mm
/// @param blend mm by which the machine rounds the rings' corners (Operation::blend): chords are as long as
/// it then takes at full feed
/// @param hold  keeps what hangs over a cavity below, or over the edge of the stack, held to the end: it goes
/// from the middle or from the free edge
///              inwards, and what still stands hangs on what stays, for from each of its points the shortest
///              way to the forbidden region runs through standing stock. Without, rectangles go on inwards
///              where what is forbidden is far apart: rings that end at the stock's edge must all be begun at
///              the same end, rectangles go round.
[[nodiscard]] RingPlan plan_rings(const LayerCut& cut, const Tool& tool, const Loops& forbidden, double tip_z,
                                  double blend, bool hold);

/// Plans to clear what stands at one height over slopes and floors, once everything that is free at a lower
/// height has been cleared down to that: rings around `forbidden`, a step apart, as far as they are of use.
/// @param forbidden   as for plan_rings()
/// @param border_over where the ring on the border of `forbidden` is of use: places that are forbidden at the
/// lower height
/// @param over        the same for all other rings
/// @param tip_z       mm
[[nodiscard]] RingPlan plan_terrace(const LayerCut& cut, const Tool& tool, const Loops& forbidden,
                                    const Loops& border_over, const Loops& over, double tip_z, double blend);

/// Cuts frames, strips, and rings from the farthest to the forbidden region's border. A ring is cut once
/// those a step farther off beside it are (with RingPlan::hold, all rings within its part of the free area);
/// of those whose turn it is the nearest comes next, and from ring to next ring the cutter stays down.
void clear_from_afar(PathBuilder& path, const LayerCut& cut, RingPlan plan);

}  // namespace slabwright
