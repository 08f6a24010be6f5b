// A part as sheets: stack, cuts, nests and the ways of each stock sheet's program (METHOD.md section 13).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/nesting/nesting.h"
#include "engine/plan.h"
#include "engine/sheets/alignment.h"
#include "engine/sheets/corners.h"
#include "engine/sheets/engraving.h"
#include "engine/sheets/head.h"
#include "engine/sheets/jet_feed.h"
#include "engine/sheets/sheet_cuts.h"
#include "engine/sheets/sheet_slicing.h"

namespace slabwright {

/// What cuts: a router's end mill, upright, in several depths; a laser, upright; an abrasive jet, whose head
/// may tilt.
enum class SheetHead : std::uint8_t { router, laser, jet };

/// A rest of an earlier sheet; it is used before whole sheets.
struct SheetOffcut {
    double thickness = 0;  ///< mm
    StockSheet size;
};

/// How many whole sheets of a thickness there are; of one that no such line names, as many as it takes.
struct SheetCount {
    double thickness = 0;  ///< mm
    int sheets = 0;
};

struct SheetJob {
    SheetRules slicing;
    double keep_flats_mm2 = 0;  ///< heights of level faces of so much in all are joints too, the largest
                                ///< first, after those of `slicing`; 0: none
    SheetCutRules cutting;      ///< its kerf is the router's cutter
    AlignmentRules alignment;
    EngraveRules engraving;
    CornerRules corners;  ///< of a jet
    NestRules nesting;    ///< spacing is between kerfs and leads
    StockSheet stock{1220, 1220};
    std::vector<SheetOffcut> offcuts;
    std::vector<SheetCount> counts;
    SheetHead head = SheetHead::router;
    char axis = 'z';        ///< along which sheets are stacked
    double lead = 3;        ///< mm of waste in which a cut begins
    double pierce_s = 0.5;  ///< jet, laser: dwell before the head moves
    double clearance = 5;   ///< mm over the stock
    double pivot = 0;    ///< mm from where a jet's head turns to the sheet's top, for a control that does not
                         ///< keep the jet's tip in place; 0: it does
    double feed = 3000;  ///< mm/min, router and laser
    double plunge_feed = 800, stepdown = 6, rpm = 18000;  ///< router
    double through = 0.2;                                 ///< mm that a router cuts under the sheet
    int tool = 1;
    double power = 100;                   ///< laser: its S word while it cuts; stated where it engraves too
    std::string on = "M3", off = "M5";    ///< what switches a laser or a jet: is_switch_pair()
    std::vector<std::string> begin, end;  ///< what switches gas, dust or abrasive before the first cut and
                                          ///< after the last: is_switch(), none of switches_head()
    AbrasiveJet jet;
};

/// One closed cut with its lead, where it lies on the stock.
struct SheetWay {
    int piece = 0;  ///< from 1
    int loop = 0, pass = 0;
    bool is_hole = false;
    std::vector<HeadPoint> points;  ///< the last at the place of the first
    std::vector<double> shares;     ///< of the feed, of the move to each point
    Point2 pierce;                  ///< at the sheet's top: in the waste, as far as there is room
    double feed = 0;                ///< mm/min at the top of the sheet
};

/// One sheet of the stack.
struct SheetPiece {
    int number = 0;  ///< from 1, from below
    SheetSpan span;
    NestPlace place;
    int program = 0;  ///< index of SheetsPlan::programs
    int islands = 1;
    double joint_mm2 = 0;  ///< that are bonded to the sheet above
    double stair_mm3 = 0, deviation = 0, tilt_deg = 0, area_mm2 = 0;
    Point2 label;                       ///< a place inside, on the stock
    SheetHold hold;                     ///< in the stack's frame
    std::vector<Engraving> engravings;  ///< in the stack's frame
    std::array<Point2, 4> pins;         ///< pins_of() its outline, in the stack's frame
};

/// mm/min: given, or of a jet what enters as deep as is engraved. @throws Error(usage, "sheets.engrave")
/// where a jet would have to run faster than 15 m/min
[[nodiscard]] double engraving_feed(const SheetJob& job);

/// What is cut from one stock sheet.
struct SheetProgram {
    double thickness = 0;  ///< mm
    StockSheet stock;
    std::vector<int> pieces;     ///< numbers
    std::vector<SheetWay> ways;  ///< in order: piece by piece, in each from inside
    double cut_mm = 0, minutes = 0;
};

struct SheetsPlan {
    SheetJob job;
    double height = 0;  ///< mm of the part along the axis
    SheetStack stack;
    std::vector<SheetPiece> pieces;
    std::vector<SheetProgram> programs;
    std::vector<Diagnostic> diagnostics;
    std::size_t uniform_sheets = 0;  ///< of the thinnest, beside it
};

/// The solid turned so that `axis` points up, on z = 0. X: (y, z, x); Y: (z, x, y). @throws
/// Error(usage, "sheets.axis") for other letters
[[nodiscard]] Mesh along_axis(Mesh mesh, char axis);

/// @param mesh as along_axis() makes it, with neighbours
/// @throws as stack_of_sheets(), cuts_of() and nest_pieces(), Error(usage, "sheets.job") for values out of
/// range or a head that does not tilt and should, Error(no_plan, "sheets.stock") where there are too few
/// sheets
[[nodiscard]] SheetsPlan plan_sheets(Context& context, const Mesh& mesh, const SheetJob& job);

}  // namespace slabwright
