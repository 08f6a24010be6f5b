// Where a solid is parted into sheets of the thicknesses in stock (METHOD.md section 13; FDFF chapter IV).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// `uniform`: the thinnest sheet everywhere. `printed`: FDFF's three tests, greedy. `optimal`: a dynamic
/// program over all stacks of the sheets in stock.
enum class SheetStrategy : std::uint8_t { uniform, printed, optimal };

/// What an upright cut leaves of the stair between a sheet and the part: all of it, so that the part lies
/// inside; none of it; or what the section at the sheet's middle leaves.
enum class StairSide : std::uint8_t { outside, inside, middle };

struct SheetRules {
    std::vector<double> thicknesses;  ///< mm, ascending, each over 0
    double bond = 0;                  ///< mm between two sheets
    SheetStrategy strategy = SheetStrategy::optimal;
    StairSide side = StairSide::outside;
    double triangle_mm2 = 2.9;  ///< of a stair in XZ and YZ (FDFF: .0045 in²)
    double area_percent = 4;    ///< by which areas of a sheet's bottom and top may differ (FDFF)
    double most_inset = 0;      ///< mm, optimal: sheets over the thinnest whose stair is deeper are not used;
                                ///< 0: no limit
    /// mm, optimal: heights that no sheet reaches across, the most important first. One that no stack meets
    /// which is as high as without it, and meets those before it, is let go.
    std::vector<double> joints;
};

/// One sheet of the stack.
struct SheetSpan {
    double bottom = 0, top = 0;  ///< mm; apart by a thickness in stock
    int stock = 0;               ///< index of SheetRules::thicknesses
};

/// What a sheet that is cut upright differs from the part by.
struct SheetStair {
    Loops outline;          ///< of the cut
    double volume_mm3 = 0;  ///< ∫ area(section(z) Δ outline) dz over its height
    double inset = 0;       ///< mm: the greatest distance between its outline and a section's border
};

struct SheetStack {
    std::vector<SheetSpan> sheets;  ///< from below
    double left_on_top = 0;         ///< mm of the part above the last sheet
    double stair_mm3 = 0;           ///< sum over the sheets
    std::vector<double> missed;     ///< mm: of SheetRules::joints those within a sheet
};

/// The most heights that `optimal` looks at; more earn a refusal that names the cure.
inline constexpr std::size_t kMostSheetHeights = 4000;

/// @param mesh a solid on z = 0, with neighbours
/// @throws Error(usage, "sheets.…") for rules that make no stack, Error(no_plan, "sheets.heights") where the
/// thicknesses add up to too many heights, Error(no_plan, "sheets.too_low") where no sheet is as thin as the
/// part, and as slice() does
[[nodiscard]] SheetStack stack_of_sheets(Context& context, MeshView mesh, const SheetRules& rules);

/// Of each span what an upright cut of it is. Outside is exact (shadows()); the others are of sections
/// kStairSamples to a sheet. @param with_inset false: SheetStair::inset stays 0, which saves half of the time
[[nodiscard]] std::vector<SheetStair> stairs_of(Context& context, MeshView mesh,
                                                const std::vector<SheetSpan>& spans, StairSide side,
                                                bool with_inset = true);

/// Sections in a sheet by which stairs are measured.
inline constexpr int kStairSamples = 16;

/// The same at any height: whether FDFF's tests pass from one section to another, `height` above it.
/// @param last the section a thinnest sheet under `other`, by which a turn of the outline is seen, and the
/// one under that; equal to `first` where there is none
[[nodiscard]] bool printed_tests_pass(const Loops& first, const Loops& before_last, const Loops& last,
                                      const Loops& other, double height, const SheetRules& rules);

}  // namespace slabwright
