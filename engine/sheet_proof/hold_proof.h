// Whether dowels, rods and tabs hold every island of a stack, by the programs' text (METHOD.md section 13).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "engine/sheet_proof/sheet_proof.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// What the text says holds a piece, as regions in the part's frame.
struct ReadHold {
    Loops tabs;   ///< tabs and necks
    Loops holes;  ///< of dowels and rods, counter-clockwise; round to within 2 µm
};
[[nodiscard]] ReadHold read_hold(const ReadPiece& piece);

/// The bodies of one sheet: what its cuts leave, joined from level to level.
class SheetBodies {
public:
    explicit SheetBodies(const ReadPiece& piece);
    /// The next level, from below or from above: what of the sheet stays at it.
    void add_level(const Loops& made);
    /// Of each hole of the piece the body that it goes through, at the first level; −1: none.
    [[nodiscard]] std::vector<int> holes() const;
    [[nodiscard]] int root(int body) const;
    [[nodiscard]] std::vector<int> roots() const;  ///< ascending; bodies that hang together are one

private:
    const ReadPiece& piece_;
    std::vector<int> parents_;
    std::vector<Loops> last_;  ///< parts of the last level
    std::vector<int> last_bodies_;
    std::vector<int> holes_;
};

struct PieceHold {
    const ReadPiece* piece = nullptr;
    std::string file;
    std::vector<int> bodies;  ///< roots
    std::vector<int> holes;   ///< the root that each hole goes through, or −1
};
[[nodiscard]] PieceHold hold_of(const ReadPiece& piece, const std::string& file, const SheetBodies& bodies);

/// Of all pieces, from below: bodies joined to nothing by two dowels that go through both, or by two rods in
/// tabs. Each is a violation "sheets.hold". @returns how many there are; the pieces of a stack without a
/// hole or a tab are not looked at, and earn 0
[[nodiscard]] int require_held(const std::vector<PieceHold>& pieces, std::vector<Diagnostic>& violations);

}  // namespace slabwright
