#include <algorithm>
#include <utility>

#include "engine/schedule/joints.h"
#include "kernels/polygons/pieces.h"
#include "kernels/polygons/thinned.h"

namespace slabwright {

namespace {

constexpr int kHalvings = 3;  // of the setback, at most

/// Glue held back from a region's edges by the setback, from those of ribs narrower than four times that by
/// its half, and so on.
Loops held_back(const Loops& region, double setback, int halvings) {
    Loops glue, left = region;
    for (int halved = 0; halved <= halvings && !left.empty(); ++halved, setback /= 2) {
        // A section has a point at every facet that it cuts, more than where glue goes needs. Thinned it may
        // be too wide by as much as it is thinned, and offset() errs towards the larger region by up to its
        // tolerance; that much more setback keeps the promised distance.
        const double fine = std::clamp(setback / 20, 1e-4, 0.05);  // offset() is no finer
        const Loops inside = offset(thinned(region, fine), -(setback + 2 * fine), fine);
        // Wide enough is where a disc of twice the setback finds room.
        const Loops wide = offset(offset(inside, -setback, fine), 2 * setback + 4 * fine, fine);
        Loops here = halved < halvings ? intersect(inside, wide) : inside;
        if (halved > 0) {
            // Corners that the discs do not sweep are no ribs; of them slivers are left, which opening with a
            // small disc takes away.
            here = intersect(here, left);
            here = intersect(here, offset(offset(here, -setback / 4, fine), setback / 4, fine));
        }
        glue = halved == 0 ? std::move(here) : unite(glue, here);
        left = subtract(left, wide);
    }
    return glue;
}

}  // namespace

Loops glue_within(const Loops& region, double setback_mm) {
    if (region.empty() || !(setback_mm > 0)) return region;
    const Pieces pieces(region);
    Pieces glued(held_back(region, setback_mm, kHalvings));
    Loops glue;
    for (std::size_t p = 0; p < pieces.size(); ++p) {
        const Loops& piece = pieces.regions[p];
        const double half = area(piece) / 2;
        Loops of_piece = glued.within(piece, pieces.boxes[p]);
        double setback = setback_mm / 2;
        for (int k = kHalvings - 1; k >= 0 && area(of_piece) < half; --k, setback /= 2)
            of_piece = held_back(piece, setback, k);
        append_loops(of_piece, glue);
    }
    nest(glue);
    return glue;
}

}  // namespace slabwright
