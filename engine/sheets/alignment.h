// What holds the sheets of a stack in place while they are bonded (METHOD.md section 13; FDFF chapter II).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/sheets/sheet_slicing.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// `holes`: rods through the whole stack. `dowels`: two through every joint of two islands. `tabs`: rods in
/// columns beside the part, a neck to every island; dowels hold what no neck reaches.
enum class SheetAlignment : std::uint8_t { none, holes, dowels, tabs };

struct AlignmentRules {
    SheetAlignment way = SheetAlignment::none;
    double dowel = 8;  ///< mm: diameter of dowels and rods
    double wall = 4;   ///< mm of the part around a hole, at least
    double tab = 24;   ///< mm: side of a tab, square; a rod goes through its middle
    double neck = 6;   ///< mm: width of a neck; never more than the sheet is thick
    double gap = 6;    ///< mm between tabs and the part's silhouette
};

/// What holds one sheet, in the stack's frame.
struct SheetHold {
    Loops added;  ///< tabs and necks: four corners each, counter-clockwise, one over the other; cut off later
    std::vector<Point2> holes;  ///< middles of holes of AlignmentRules::dowel, through the whole sheet
};

/// Of every sheet what holds it. Islands are joined where two dowels or rods go through both; all islands of
/// all sheets hang together by such joints.
/// @param outlines of the sheets as they are cut, upright
/// @param cores of the sheets: what is of the part at all of their heights
/// @param must_reach_core necks end in the core where an island has one, not at the outline: where cuts tilt
/// @throws Error(no_plan, "sheets.hold") with the place of the lowest island that cannot be held;
/// Error(usage, "sheets.align") for rules out of range
[[nodiscard]] std::vector<SheetHold> holds_of(const std::vector<SheetSpan>& spans,
                                              const std::vector<Loops>& outlines,
                                              const std::vector<Loops>& cores, const AlignmentRules& rules,
                                              bool must_reach_core);

/// A hole as a region, counter-clockwise.
[[nodiscard]] Loops disc(Point2 middle, double diameter);

/// The sheet with what holds it: tabs and necks added, holes cut out.
[[nodiscard]] Loops with_hold(const Loops& region, const SheetHold& hold, double dowel);

/// Where pins stand that a sheet is laid between: the places of its outline of least and greatest x, least
/// and greatest y. Of several the first.
[[nodiscard]] std::array<Point2, 4> pins_of(const Loops& outline);

}  // namespace slabwright
