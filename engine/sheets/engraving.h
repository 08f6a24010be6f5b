// Numbers and match marks that are engraved into sheets where the next sheet will cover them (METHOD.md
// section 13).
#pragma once

#include <string>
#include <vector>

#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

struct EngraveRules {
    double depth = 0;    ///< mm below the sheet's top; 0: nothing is engraved
    double width = 1;    ///< mm of a stroke
    double height = 10;  ///< mm of a digit, at most
    double least = 4;    ///< mm of a digit, at least
    double wall = 0.5;   ///< mm between a stroke and the border of what covers it
    double feed = 1500;  ///< mm/min, router and laser; a jet's feed follows from the depth
    int tool = 2;        ///< of a router
    double power = 20;   ///< of a laser: its S word while it engraves
};

/// A number or a match mark, in the stack's frame unless told otherwise.
struct Engraving {
    std::string text;  ///< digits and hyphens; empty: a match mark
    Point2 middle;
    std::vector<std::vector<Point2>> strokes;  ///< open lines of the cutter's middle
};

/// What of a sheet's top may be engraved.
struct EngravedFace {
    Loops covered;  ///< what the next sheet lies on, without the holes of dowels and rods
    Loops tabs;     ///< that are cut off after bonding, without their rods' holes
    Loops outline;  ///< of the sheet with its tabs: its islands
    Loops next;     ///< outline of the next sheet at its bottom
};

/// Of every sheet, from below, its number on each island that has room, with a bar under it that is to the
/// front (−y); "12-2" on the second island of sheet 12. Numbers stand in what is covered, else on a tab. Then
/// up to four match marks: strokes square to the next sheet's edge, under the sheet, where the edge reaches
/// farthest to the left, right, front and back. They begin `wall` inside of the edge.
/// @throws Error(usage, "sheets.engrave") for rules out of range, Error(cancelled)
[[nodiscard]] std::vector<std::vector<Engraving>> engravings_of(Context& context,
                                                                const std::vector<EngravedFace>& faces,
                                                                const EngraveRules& rules);

/// The strokes of a text of digits and hyphens, its lower left corner at (0, 0), with the bar under it.
/// @param height mm. A digit is two thirds as wide as high, and a third apart from the next.
[[nodiscard]] std::vector<std::vector<Point2>> digit_strokes(const std::string& text, double height);

}  // namespace slabwright
