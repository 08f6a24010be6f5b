// Rectangles on boards, laid so that a panel saw can part them: every cut goes from edge to edge of what it
// cuts.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace slabwright {

/// Of a board or of what is sawn from it, mm.
struct SawnSize {
    double length = 0, width = 0;  ///< in x and y
    friend bool operator==(const SawnSize&, const SawnSize&) = default;
};

/// A rectangle on a board, mm from the board's corner.
struct SawnRectangle {
    double x = 0, y = 0, length = 0, width = 0;
    [[nodiscard]] double mm2() const { return length * width; }
    friend bool operator==(const SawnRectangle&, const SawnRectangle&) = default;
};

/// Where a piece lies.
struct SawnPiece {
    std::size_t piece = 0;  ///< index into the sizes
    SawnRectangle place;
    bool turned = false;  ///< by a quarter turn: its length lies in y
    friend bool operator==(const SawnPiece&, const SawnPiece&) = default;
};

/// A board with what is sawn from it. Pieces, offcuts and cuts cover a sawn board whole and nowhere twice.
struct SawnBoard {
    std::vector<SawnPiece> pieces;
    /// What the saw takes, as wide as the kerf or what is left there, in an order in which they can be made;
    /// none where pieces are milled out (nest_on_boards). Each goes across the whole of a rectangle that the
    /// cuts before it have parted from the rest.
    std::vector<SawnRectangle> cuts;
    std::vector<SawnRectangle> offcuts;  ///< what is left, the largest first
    friend bool operator==(const SawnBoard&, const SawnBoard&) = default;
};

/// Whether a board holds a piece, as it is or turned.
[[nodiscard]] bool fits_on(const SawnSize& board, const SawnSize& piece);

/// Lays pieces on as few boards as it finds, turned where that helps: one after another, each where it leaves
/// the least beside it (guillotine best fit; J. Jylänki, A Thousand Ways to Pack the Bin, 2010), in several
/// orders, by several rules of fit and of splitting what is left. Of those with the fewest boards stays the
/// one with the largest single offcut, then the one with the fewest cuts, then the first.
/// Cost: as many tries as rules (96), each pieces times offcuts.
/// @param kerf mm between pieces
/// @return the boards; none where a piece is larger than a board, whichever way it is turned
[[nodiscard]] std::vector<SawnBoard> lay_on_boards(std::span<const SawnSize> pieces, const SawnSize& board,
                                                   double kerf);

}  // namespace slabwright
