// How one sheet is cut: where the axis of a jet, a beam or a cutter goes through it (METHOD.md section 13).
#pragma once

#include <vector>

#include "engine/sheets/alignment.h"
#include "engine/sheets/sheet_slicing.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// The width of a cut where it goes through a sheet, mm.
struct Kerf {
    double top = 0, bottom = 0;
    /// @param share of the sheet's thickness, from its bottom
    [[nodiscard]] double at(double share) const { return bottom + share * (top - bottom); }
    [[nodiscard]] double widest() const { return top > bottom ? top : bottom; }
};

struct SheetCutRules {
    double kerf = 0.8;     ///< mm: the width of the cut at the sheet's top, or the diameter of the cutter
    double taper_deg = 0;  ///< by which each side of a jet's or a laser's cut leans: narrower below over 0
    double most_tilt_deg = 0;  ///< of the head from upright; 0: it does not tilt
    double leave = 0.05;       ///< mm that tilted cuts may leave over a convex wall before another pass pays
    int most_passes = 6;       ///< along one loop
    double gouge = 0.01;       ///< mm that a cut may enter the part
    double step = 2;           ///< mm: longest piece of a loop that is cut at one angle or between two
};

/// @param thickness mm of the sheet
[[nodiscard]] Kerf kerf_through(const SheetCutRules& rules, double thickness);

/// One closed way of the axis. Material that stays lies on its left: outlines run counter-clockwise, holes
/// clockwise. At the i-th point the axis leaves the sheet's bottom at bottom[i] and its top at top[i];
/// between points both ends move straight.
struct AxisLoop {
    std::vector<Point2> bottom, top;
    int loop = 0;  ///< of which loop of the sheet's outline
    int pass = 0;  ///< from 0; what stays lies on the left of all passes
    bool is_hole = false;
};

struct SheetCuts {
    std::vector<AxisLoop> loops;  ///< holes before outlines, passes of a loop together
    double most_tilt_deg = 0;     ///< that is used
    double deviation = 0;  ///< mm: the greatest distance of the part's border from what the cuts leave, over
                           ///< the sections that were looked at
    bool upright = true;   ///< no cut tilts
    bool gave_up_tilt = false;  ///< tilted cuts would have entered the part, so all are upright
};

/// Tilted cuts are made to fit sections at the ends of so many even parts of a sheet, and at the heights of
/// the mesh's vertices in it where those are no more than kMostVertexHeights.
inline constexpr int kCutSections = 24;
inline constexpr int kFinerSections = 4;  ///< of each where facets lean more than the head
inline constexpr std::size_t kMostVertexHeights = 24;
inline constexpr std::size_t kMostSteps = 32;  ///< heights of level facets that a sheet's cuts are fitted to

/// The cuts of sheets of a part. Upright ones run outside of the outline by half a kerf. Tilted ones follow
/// the concave majorant of the sections in the normal plane of each piece of the outline, and none enters a
/// section by more than rules.gouge; where one would, the sheet is cut upright. A head that tilts leans by
/// the taper too, so that walls do not; one that does not keeps clear by half the widest kerf.
/// @param stairs of the same spans: stairs_of(). Tilted cuts need those of StairSide::outside; outlines hold
/// what `holds` adds and leave out its holes
/// @param holds of the same spans, or none; their holes are of `dowel` mm
/// @throws Error(usage, "sheets.cut") for rules out of range, and as slice()
[[nodiscard]] std::vector<SheetCuts> cuts_of(Context& context, MeshView mesh,
                                             const std::vector<SheetSpan>& spans,
                                             const std::vector<SheetStair>& stairs,
                                             const SheetCutRules& rules,
                                             const std::vector<SheetHold>& holds = {}, double dowel = 0);

/// The axis' ways at a height: share 0 at the bottom, 1 at the top.
[[nodiscard]] std::vector<Point2> axis_at(const AxisLoop& loop, double share);

}  // namespace slabwright
