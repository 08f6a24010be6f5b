// The stock of one layer as voxels, and what roughing leaves of it outside the swath of the cutter that
// follows: the semi-rough area AS of LUO 5.5.2 (METHOD.md section 7).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// Cells of a plane grid, row by row: those of row j are the spans spans[starts[j]] … spans[starts[j + 1] −
/// 1], first and last cell of each, ascending, disjoint, and with a cell between two of them.
struct CellRows {
    std::vector<std::uint32_t> starts{0};
    std::vector<std::array<std::int32_t, 2>> spans;
    [[nodiscard]] std::span<const std::array<std::int32_t, 2>> row(std::size_t j) const {
        return std::span(spans).subspan(starts[j], starts[j + 1] - starts[j]);
    }
    [[nodiscard]] std::size_t rows() const noexcept { return starts.size() - 1; }
};

/// A box of voxels, mm. Cell (i, j) of slice k has its centre at min + (i + ½, j + ½, k + ½)·voxel.
struct VoxelBox {
    std::array<double, 3> min{};
    double voxel = 0.25;
    int nx = 0, ny = 0, nz = 0;
    /// The height at which slice k is to be cut.
    [[nodiscard]] double z(int k) const { return min[2] + (k + 0.5) * voxel; }
};
/// The fewest voxels that cover the box from `low` to `high`.
[[nodiscard]] VoxelBox voxel_box(const std::array<double, 3>& low, const std::array<double, 3>& high,
                                 double voxel);

/// What a roughing leaves. Areas are those of the slice where they are largest, mm².
struct RoughLeft {
    double rough_area = 0;           ///< of all that it leaves
    double area = 0;                 ///< AS: of what lies outside the swath too
    double volume = 0;               ///< mm³, of what lies outside the swath
    std::array<double, 3> where{};   ///< in the slice of AS: its first voxel, mm
    std::uint64_t voxels = 0;        ///< that it leaves
    std::uint64_t sparse_bytes = 0;  ///< that these took as a tree
    [[nodiscard]] bool nothing(double voxel) const { return area <= 4 * voxel * voxel; }
};

/// One layer's stock. What must be kept at a height is the pattern's section there and everything that
/// overhangs it within the layer, for all cutters come from above.
class LayerVoxels {
public:
    /// @param sections one for each slice, ascending, at box.z(k): loops of any nesting (non-zero winding),
    /// in 0.1 µm
    /// @param widest   mm: no radius that is asked for later, with what is kept off the walls, is larger
    /// @throws Error(no_plan, "memory.limit"), Error(cancelled)
    LayerVoxels(Context& context, const VoxelBox& box, std::span<const Loops> sections, double widest);

    /// A flat end mill that clears levels from above wherever it fits.
    struct Roughing {
        double radius = 0;         ///< mm
        double allowance = 0;      ///< mm kept off the walls
        std::vector<double> tips;  ///< mm, descending
        /// Radii of wider cutters, whose reach belongs to this one's: a disc of cells is not always made of
        /// smaller discs of cells, and what a tool leaves must not grow as it shrinks.
        std::vector<double> wider;
    };

    /// What the roughing leaves, and of that what lies farther than `swath` (mm) from what is kept, sideways
    /// at its height and straight above it. A gap must be up to half a voxel wider than the cutter to let it
    /// in.
    [[nodiscard]] RoughLeft left(Context& context, const Roughing& roughing, double swath);

    /// The share of the walls' length, over every `every`-th slice, that a disc of this radius touches
    /// without entering what is kept; 1 where there are none. To within half a voxel.
    [[nodiscard]] double reached_share(Context& context, double radius, int every);

    /// mm², of all the stock that is not kept at a tip height (an A_i of t_r = Σ A_i / (2R·f)).
    [[nodiscard]] double area_to_clear(double tip) const;

    [[nodiscard]] const VoxelBox& box() const { return box_; }

private:
    [[nodiscard]] int slice_at(double tip) const;
    /// Where the cutter has been at the height of a slice, in cells of the box.
    const CellRows& reached(Context& context, int slice, double radius, double allowance);

    VoxelBox box_;
    int border_ = 0;              // cells around the box, from where cutters come in
    std::vector<CellRows> kept_;  // by slice, over box and border
    std::map<std::pair<int, std::pair<double, double>>, CellRows> reached_;
    std::optional<MemoryCharge> memory_;
};

}  // namespace slabwright
