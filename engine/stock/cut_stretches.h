// What the moves of a layer's programs meet when they are run one after the other: the engagement of every
// stretch of way, from what stands (METHOD.md section 8).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/plan.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

/// A stretch of a program's way with one engagement: a part of one long move, or several short ones. Lengths
/// mm.
struct CutStretch {
    std::uint32_t first = 0, last = 0;  ///< the moves that it is made of; the first of a program is none
    double length = 0;                  ///< in the plane
    double low = 0, high = 0;           ///< heights over the tip between which something was taken away
    double width = 0;   ///< the cross-section that was taken away, over high − low; at most the diameter
    bool left = false;  ///< most of it lay left of the way: a spindle that turns clockwise mills it up
    std::array<double, 3> at{};  ///< where it ends
    [[nodiscard]] bool cuts() const { return width > 0 && high > low; }
};

/// Moves of an operation, both included.
struct MoveRange {
    std::uint32_t first = 0, last = 0;
};

/// The slab of one layer over a grid of cells, each of which stands for its centre, where it is exact.
class StandingSlab {
public:
    /// @param top of the slab as it is clamped, mm; @param bottom below which nothing counts
    StandingSlab(std::array<double, 2> stock_min, std::array<double, 2> stock_max, double bottom, double top,
                 double cell);

    /// Takes away what the operation's feed moves meet and tells `stretch` of each stretch of their way, in
    /// order. A stretch is about half the cutter's radius long, at least three cells; one that is ended
    /// sooner, by a rapid or a move straight down, is taken as at least two cells long. Moves straight down
    /// take away and tell nothing: they drill.
    void run(const Operation& operation, const Tool& tool,
             const std::function<void(const CutStretch&)>& stretch);

    /// Of the last run(): moves straight down that took away more than a cubic millimetre.
    [[nodiscard]] std::span<const std::uint32_t> plunges() const { return plunges_; }

    /// The same of some moves only, and of what must be gone before them: of all moves before the last of
    /// `parts`, those are cut that come near any of these, and the stretches of the parts are told. Where
    /// none of run()'s stretches is half within a part these are run()'s very stretches; what stands
    /// afterwards is right nowhere else.
    /// @param parts ascending, apart from each other
    void run_parts(const Operation& operation, const Tool& tool, std::span<const MoveRange> parts,
                   const std::function<void(const CutStretch&)>& stretch);

    /// The cells for a job's stock, mm: as fine as what roughing leaves on a wall, coarser where there would
    /// be more than kMostCells. A strip along the grid that is thinner than a cell is met as a whole cell or
    /// not at all.
    [[nodiscard]] static double cell_for(const Job& job, std::array<double, 2> stock_min,
                                         std::array<double, 2> stock_max);
    static constexpr double kMostCells = 1e6;
    [[nodiscard]] std::uint64_t bytes() const { return height_.size() * sizeof(float); }

private:
    void run(const Operation& operation, const Tool& tool, std::span<const MoveRange> parts, bool all,
             const std::function<void(const CutStretch&)>& stretch);

    CellGrid grid_;
    double bottom_ = 0;
    std::vector<float> height_;  // over bottom_
    std::vector<std::uint32_t> plunges_;
};

}  // namespace slabwright
