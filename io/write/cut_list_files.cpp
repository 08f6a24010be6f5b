#include "io/write/cut_list_files.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "io/text/decimal.h"
#include "io/write/dxf_text.h"

namespace slabwright {

namespace {

constexpr std::array<std::string_view, 6> kLayers{"BOARD", "PIECE", "CUT", "OFFCUT", "LABEL", "DOWELS"};
constexpr double kBetweenBoards = 200;  // mm, in the drawing
constexpr double kHoleLabel = 4;        // mm high

std::string mm(double value) {
    std::string text;
    append_mm(text, to_units(value));
    return text;
}

std::string label_of(const BlankToSaw& blank) {
    if (blank.layer == 0) return "base board";
    return blank.slab == 1 ? fmt::format("layer {}", blank.layer)
                           : fmt::format("layer {} slab {}", blank.layer, blank.slab);
}

std::array<Point2, 4> corners(const SawnRectangle& r, double right) {
    const Point2 low{to_units(r.x + right), to_units(r.y)},
        high{to_units(r.x + r.length + right), to_units(r.y + r.width)};
    return {low, {high.x, low.y}, high, {low.x, high.y}};
}

/// Where on its board a hole lies, underside up, mm. A turned piece lies turned against the clock.
Point2 on_board(const UndersideHole& hole, const SawnPiece& piece, double right) {
    const double x = piece.turned ? piece.place.length - hole.y : hole.x, y = piece.turned ? hole.x : hole.y;
    return {to_units(piece.place.x + x + right), to_units(piece.place.y + y)};
}

void draw_holes(DxfText& text, const BlankToSaw& blank, const SawnPiece& piece, double right,
                const std::vector<UndersideHole>& holes) {
    if (blank.slab != 1) return;
    for (const UndersideHole& hole : holes) {
        if (hole.layer != blank.layer) continue;
        const Point2 at = on_board(hole, piece, right);
        text.circle("DOWELS", at, hole.diameter);
        text.label({at.x + to_units(hole.diameter), at.y},
                   fmt::format("D{:g} x {:g} deep", hole.diameter, hole.depth), kHoleLabel);
    }
}

}  // namespace

std::string cut_list_csv(const CutList& list) {
    std::string text = "kind,board,thickness_mm,name,layer,slab,length_mm,width_mm,x_mm,y_mm,turned\n";
    const char* kind_of_board = list.layout == BoardLayout::nested ? "nest" : "board";
    std::size_t number = 0;
    for (const BoardToSaw& board : list.boards) {
        ++number;
        const auto line = [&](const char* kind, const std::string& name, const std::string& of,
                              const SawnRectangle& r, const char* turned) {
            text += fmt::format("{},{},{},{},{},{},{},{},{},{}\n", kind, number, mm(board.thickness), name,
                                of, mm(r.length), mm(r.width), mm(r.x), mm(r.y), turned);
        };
        line(kind_of_board, fmt::format("board {}", number), ",", {0, 0, board.size.length, board.size.width},
             "");
        std::size_t cut = 0, offcut = 0;
        for (const SawnRectangle& r : board.sawn.cuts) line("cut", fmt::format("cut {}", ++cut), ",", r, "");
        for (const SawnPiece& piece : board.sawn.pieces) {
            const BlankToSaw& blank = list.blanks[piece.piece];
            line("piece", label_of(blank),
                 blank.layer == 0 ? std::string(",") : fmt::format("{},{}", blank.layer, blank.slab),
                 piece.place, piece.turned ? "yes" : "no");
        }
        for (const SawnRectangle& r : board.sawn.offcuts)
            line("offcut", fmt::format("offcut {}", ++offcut), ",", r, "");
    }
    return text;
}

std::string cut_list_dxf(const CutList& list, const std::vector<UndersideHole>& holes) {
    double length = 0, width = 0;
    for (const BoardToSaw& board : list.boards) {
        length += (length > 0 ? kBetweenBoards : 0) + board.size.length;
        width = std::max(width, board.size.width);
    }
    DxfText text({0, 0}, {to_units(length), to_units(width)},
                 std::span(kLayers).first(kLayers.size() - (holes.empty() ? 1 : 0)));
    double right = 0;
    std::size_t number = 0;
    for (const BoardToSaw& board : list.boards) {
        text.loop("BOARD", corners({0, 0, board.size.length, board.size.width}, right));
        text.label({to_units(right), -to_units(30)},
                   fmt::format("board {}, {:g} mm", ++number, board.thickness), 20);
        for (const SawnRectangle& r : board.sawn.cuts) text.loop("CUT", corners(r, right));
        for (const SawnRectangle& r : board.sawn.offcuts) text.loop("OFFCUT", corners(r, right));
        for (const SawnPiece& piece : board.sawn.pieces) {
            text.loop("PIECE", corners(piece.place, right));
            text.label({to_units(piece.place.x + right + 5), to_units(piece.place.y + 5)},
                       label_of(list.blanks[piece.piece]));
            draw_holes(text, list.blanks[piece.piece], piece, right, holes);
        }
        right += board.size.length + kBetweenBoards;
    }
    return text.take();
}

}  // namespace slabwright
