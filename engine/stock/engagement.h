// How much of the stock's breadth a roughing cutter meets along its way, and the feed that follows from it.
#pragma once

#include <array>
#include <vector>

#include "engine/plan.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/context.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

/// Heights over a grid of cells, cut by a flat end mill; exact at the centres of the cells.
class EngagedStock {
public:
    /// The rectangle [min, max] of stock (mm), full up to `top`, for a cutter of radius `radius`: cells of a
    /// twelfth of it, or larger ones where there would be more than kMostCells.
    EngagedStock(std::array<double, 2> min, std::array<double, 2> max, double top, double radius);
    /// The tip goes straight from `from` to `to`, mm. Returns the volume taken, mm³.
    double cut(const std::array<double, 3>& from, const std::array<double, 3>& to);
    /// The same told by parts: `volumes` has one place for each of that many equal parts of the way and gets
    /// what is taken there, mm³: a cell belongs to the part on which the cutter's edge comes to it.
    void cut(const std::array<double, 3>& from, const std::array<double, 3>& to,
             std::vector<double>& volumes);

    /// From now on the cutter is one of radius `radius`, mm. The cells stay.
    void change_cutter(double radius);

    static constexpr double kMostCells = 6e5;  ///< 2.4 MB

private:
    CellGrid grid_;
    CutterEnd end_;
    double top_;
    std::vector<float> height_;  // under the top
    std::array<double, 3> last_{kUnbounded, kUnbounded,
                                kUnbounded};  // where the cutter is since the last cut
};

/// What a roughing cutter may meet at the feed that its moves have.
struct EngagementCap {
    double share = 0.7;   ///< of its diameter; 1: a slot
    double diameter = 0;  ///< mm
    double stepdown = 0;  ///< mm, over which the share is meant
};

/// Lowers the feed of moves that meet more stock than the cap allows, and parts longer moves where that
/// changes. Measured from the stock itself, over ways of a quarter of the cutter's radius: with V the volume
/// taken on a way of length L in the plane, the mean section of the chip is A = V / L, a slot's is diameter ·
/// stepdown, and
///     feed ≤ F · min(1, share · diameter · stepdown / A)
/// where F is the move's own feed; so the volume cut in a minute nowhere exceeds what a pass of that share
/// has at F. Rounded down to a twentieth of F. Two such places less than half a radius apart are joined by
/// one. Rapids and vertical moves keep their feed. Moves are straight. Returns the way (mm) on which the feed
/// was lowered.
double cap_engagement(Context& context, std::vector<Move>& moves, EngagedStock& stock,
                      const EngagementCap& cap);

}  // namespace slabwright
