// Whether the programs of a sheets folder make the part (METHOD.md section 13): the stack is rebuilt from
// what their text says, with code of its own, and held against the solid.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Where the head stands: the axis meets the sheet's top at (x, y) mm, leaned by a from upright towards c,
/// degrees.
struct ReadHead {
    double x = 0, y = 0, a = 0, c = 0;
};

/// One way with the cutter or the jet at work, from where it goes in to where it comes out.
struct ReadWay {
    int piece = 0, loop = 0, pass = 0;  ///< as the comment before it says
    bool is_hole = false;
    std::vector<ReadHead>
        points;              ///< the first is where it goes in; the second, where its loop begins and ends
    double deepest = 0;      ///< mm below the sheet's top, of a router
    std::uint32_t line = 0;  ///< of the program, where it begins
};

/// Where a piece of the part lies on the stock.
struct ReadPiece {
    int number = 0;
    double low = 0, high = 0;                  ///< mm of the part along the stack
    int turn = 0;                              ///< quarters, in degrees
    double x = 0, y = 0;                       ///< mm that it was moved by after the turn
    std::vector<std::array<double, 3>> holes;  ///< of dowels and rods: x, y, diameter, mm of the part
    std::vector<std::array<double, 8>> tabs;   ///< corners of tabs and necks, which are cut off later
};

/// A number or a match mark that is engraved.
struct ReadEngraving {
    int piece = 0;
    std::string text;                            ///< as the comment before it says; "mark" of a match mark
    std::vector<std::vector<ReadHead>> strokes;  ///< on the stock
    double deepest = 0;                          ///< mm below the sheet's top; of laser and jet, as stated
    std::uint32_t line = 0;                      ///< of the program, where it begins
};

/// With what a program engraves, as it states: a router's tool, a laser's power or a jet's feed; mm.
struct ReadEngraver {
    int tool = 0;
    double power = 0, feed = 0, width = 0, depth = 0;
};

/// What one program says.
struct ReadSheetProgram {
    std::string file;
    double thickness = 0, kerf = 0, length = 0, width = 0;  ///< mm
    double taper = 0;  ///< mm by which each side of a cut leans inwards for each mm down
    bool is_routed = false;
    std::vector<ReadPiece> pieces;
    std::vector<ReadWay> ways;
    std::optional<ReadEngraver> engraver;
    std::vector<ReadEngraving> engravings;
};

struct SheetProof {
    bool passed = false;
    double part_mm3 = 0, made_mm3 = 0;  ///< of the part as a solid, and of what the sheets make of it
    double gouge = 0;        ///< mm: the greatest distance of the part's border within what was cut away
    double left_over = 0;    ///< mm: the greatest distance of what was made from the part
    double left_on_top = 0;  ///< mm of the part above the last sheet
    int islands = 0;   ///< parts of sheets that nothing but the glue holds in place: where the programs tell
                       ///< of no dowel, those beyond one for each sheet
    int dowels = 0;    ///< holes of dowels and rods, of all sheets
    int engraved = 0;  ///< numbers and match marks
    std::vector<Diagnostic> violations;
};

struct SheetProofRules {
    double gouge = 0.02;         ///< mm that cuts may enter the part
    double left_over = 0;        ///< mm that may be left; 0: any, told only
    double most_gap = 3;         ///< mm between two sheets that a bond may fill
    bool part_may_lose = false;  ///< cuts on the inside or middle of the stair enter the part by intent
};

/// @param mesh turned so that sheets lie level, on z = 0, with neighbours
[[nodiscard]] SheetProof prove_sheets(Context& context, MeshView mesh,
                                      const std::vector<ReadSheetProgram>& programs,
                                      const SheetProofRules& rules);

}  // namespace slabwright
