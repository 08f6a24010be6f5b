// Arcs (G2, G3) and longer chords in place of the short chords that paths are computed with.
#pragma once

#include <vector>

#include "engine/plan.h"

namespace slabwright {

struct ArcFit {
    double tolerance = 0;                                                    ///< 0.1 µm units
    bool arcs = true;                                                        ///< false: chords only
    double min_radius = 0.1 * kUnitsPerMm, max_radius = 2000 * kUnitsPerMm;  ///< 0.1 µm units
    double max_sweep = 2.2;  ///< radians, under π: a circle becomes three arcs, none of them a stub
    int min_chords = 3;      ///< that an arc must replace
    double acceleration =
        0;  ///< mm/s²: no arc is so narrow that this does not let it be run at the moves' feed; 0: any may be
};

/// Fits arcs to the feed moves that follow one another at one z and one feed, and chords to the rest (in
/// three dimensions); rapids stay as they are. Every arc and chord begins and ends in points of the path
/// given. An arc and the chords that it replaces lie within `tolerance` of one another, both ways: seen from
/// the centre they advance together, and at no angle do their distances from it differ by more. Chords as
/// `simplify` in thinning.h. Where a chord would do, no arc is used. The same moves give the same result;
/// moves that are arcs already stay.
void fit_arcs(std::vector<Move>& moves, const ArcFit& fit);

}  // namespace slabwright
