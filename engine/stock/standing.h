// What may still stand of a layer's stock: an upper bound on a grid, cheap enough to ask before every link.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/cutting/tool_shape.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

/// A height for every cell of a grid over the stock that nothing in the whole cell exceeds, not only at its
/// centre.
///
/// With d half the diagonal of a cell, a position of a flat end of radius R clears every cell whose centre
/// lies within R − d of it down to its tip. A ball of radius R clears there down to tip + R − √(R² − (ρ +
/// d)²), ρ being the distance of the centre, for no point of the cell is farther from the axis than ρ + d.
/// So does any other cutter whose under side rises from its floor, a bull-nose: down to that side's height at
/// ρ + d.
///
/// Every cell takes the height from one position of the cutter that really was there, so leaving cuts out, or
/// giving them in another order, keeps the bound a bound.
class Standing {
public:
    /// The rectangle [min, max] of stock (mm), full up to `top`; cells of kCell, or finer ones that a thin
    /// cutter still clears (kCellShare), or larger ones where there would be more than kMostCells.
    /// @param thinnest radius of the cutters that cut it, mm
    Standing(std::array<double, 2> min, std::array<double, 2> max, double top, double thinnest = 1e9);

    /// The cutter goes straight from `from` to `to`, tips in mm.
    /// @param core radius of a flat cutter's middle that has no edge, mm: what it covers at both ends, and so
    /// all along the way, no edge has passed over
    void cut(const CutterShape& cutter, const std::array<double, 3>& from, const std::array<double, 3>& to,
             double core = 0);

    /// Nothing over the disc of `radius` that goes straight from a to b exceeds this; −infinity beside the
    /// stock.
    [[nodiscard]] double top(double radius, const std::array<double, 2>& a,
                             const std::array<double, 2>& b) const;

    /// How low the cutter's tip may go all along the way from a to b without meeting what is known to stand.
    /// Cells that reach beyond the cutter do not count: within a cell's diagonal of the cutter's rim
    /// something may stand all the same. (Beside a finished wall the cells of the wall itself would forbid
    /// everything.) −infinity beside the stock.
    [[nodiscard]] double free_tip(const CutterShape& cutter, const std::array<double, 2>& a,
                                  const std::array<double, 2>& b) const;

    [[nodiscard]] double cell() const { return cell_; }
    [[nodiscard]] static std::uint64_t bytes(std::array<double, 2> min, std::array<double, 2> max,
                                             double thinnest);

    static constexpr double kCell = 0.5;        ///< mm
    static constexpr double kCellShare = 0.25;  ///< of the thinnest cutter's radius, at most
    static constexpr std::uint64_t kMostCells = std::uint64_t{1} << 21;  ///< 8 MiB

private:
    // The under side's height at ρ + d by ρ², of what is no flat; every entry is that of the upper end of its
    // bin.
    struct HeightTable {
        CutterShape cutter;
        double scale = 0;
        std::vector<float> height;
    };
    static double cell_size(std::array<double, 2> min, std::array<double, 2> max, double thinnest);
    [[nodiscard]] HeightTable made_table(const CutterShape& cutter) const;
    /// The table of this cutter, made when it is first asked for; until the next call.
    [[nodiscard]] const HeightTable& table_of(const CutterShape& cutter) const;
    template <class Spans>
    void each_spans(double radius, const std::array<double, 2>& a, const std::array<double, 2>& b, bool been,
                    Spans&& take) const;
    template <class Row>
    void rows(double radius, const std::array<double, 2>& a, const std::array<double, 2>& b, Row&& row) const;
    template <class Row>
    void rows_in_both(double radius, const std::array<double, 2>& a, const std::array<double, 2>& b,
                      Row&& row) const;

    double cell_, d_, x0_, y0_;  // x0_, y0_: the centre of cell (0, 0)
    double top_;                 // heights are kept relative to it
    int nx_, ny_;
    std::vector<float> height_;
    mutable std::vector<HeightTable> tables_;
    std::vector<float> under_core_;  // heights that a cut does not change
    // Where a flat cutter went last, level: what it covers there is no higher.
    std::array<double, 3> last_{kUnbounded, kUnbounded, kUnbounded};
    double last_radius_ = 0;
};

}  // namespace slabwright
