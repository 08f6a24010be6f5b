#include "io/write/wood_json.h"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

namespace slabwright {

namespace {

constexpr int kLength = 4, kSquareMetres = 4, kMoney = 2;

using Shape = JsonText::Shape;

void put_rectangle(JsonText& json, const SawnRectangle& r) {
    json.key("x").rounded(r.x, kLength).key("y").rounded(r.y, kLength);
    json.key("length").rounded(r.length, kLength).key("width").rounded(r.width, kLength);
}

void put_board(JsonText& json, const CutList& list, const BoardToSaw& board) {
    json.begin_object();
    json.key("thickness").rounded(board.thickness, kLength);
    json.key("length").rounded(board.size.length, kLength).key("width").rounded(board.size.width, kLength);
    json.key("pieces").begin_array();
    for (const SawnPiece& piece : board.sawn.pieces) {
        const BlankToSaw& blank = list.blanks[piece.piece];
        json.begin_object(Shape::line);
        json.key("layer").integer(blank.layer).key("slab").integer(blank.slab);
        put_rectangle(json, piece.place);
        json.key("turned").boolean(piece.turned).end();
    }
    json.end();
    const auto rectangles = [&](const char* key, const std::vector<SawnRectangle>& all) {
        json.key(key).begin_array();
        for (const SawnRectangle& r : all) {
            json.begin_object(Shape::line);
            put_rectangle(json, r);
            json.end();
        }
        json.end();
    };
    rectangles("cuts", board.sawn.cuts);
    rectangles("offcuts", board.sawn.offcuts);
    json.end();
}

/// Parts of a cost, in the order in which they are told; dowels only where they have a price.
std::vector<std::pair<const char*, std::optional<double>>> parts_of(const Cost& cost) {
    std::vector<std::pair<const char*, std::optional<double>>> parts{{"boards", cost.boards},
                                                                     {"base_board", cost.base_board},
                                                                     {"glue", cost.glue},
                                                                     {"machine", cost.machine}};
    if (cost.dowels) parts.emplace_back("dowels", cost.dowels);
    return parts;
}

}  // namespace

void put_wood(JsonText& json, const CutList& list, const CutList& uniform) {
    json.begin_object();
    json.key("bought_m2").rounded(list.bought_m2(), kSquareMetres);
    json.key("sawn_m2").rounded(list.sawn_m2(), kSquareMetres);
    json.key("uniform").begin_object(Shape::line);
    json.key("boards").integer(static_cast<std::int64_t>(uniform.boards.size()));
    json.key("bought_m2").rounded(uniform.bought_m2(), kSquareMetres);
    json.key("sawn_m2").rounded(uniform.sawn_m2(), kSquareMetres).end();
    json.key("boards").begin_array();
    for (const BoardToSaw& board : list.boards) put_board(json, list, board);
    json.end().end();
}

void put_cost(JsonText& json, const Job& job, const std::optional<Cost>& cost) {
    if (!cost) {
        json.null();
        return;
    }
    json.begin_object(Shape::line).key("currency").string(job.prices.currency);
    for (const auto& [name, part] : parts_of(*cost)) {
        json.key(name);
        if (part) json.rounded(*part, kMoney);
        else json.null();
    }
    json.key("total").rounded(cost->total, kMoney).end();
}

std::string boards_text(const CutList& list) {
    std::string text;
    for (std::size_t i = 0; i < list.boards.size();) {
        const BoardToSaw& first = list.boards[i];
        std::size_t end = i;
        while (end < list.boards.size() && list.boards[end].thickness == first.thickness) ++end;
        text += fmt::format("{}{} {} of {:g} x {:g} x {:g} mm", text.empty() ? "" : ", ", end - i,
                            end - i == 1 ? "board" : "boards", first.thickness, first.size.length,
                            first.size.width);
        i = end;
    }
    return text;
}

std::string cost_text(const Job& job, const std::optional<Cost>& cost) {
    if (!cost) return "";
    std::string parts;
    for (const auto& [name, part] : parts_of(*cost))
        if (part)
            parts += fmt::format("{}{} {:.2f}", parts.empty() ? "" : ", ",
                                 std::string_view(name) == "base_board" ? "base board" : name, *part);
    return fmt::format("cost    {:.2f}{}{} ({})\n", cost->total, job.prices.currency.empty() ? "" : " ",
                       job.prices.currency, parts);
}

}  // namespace slabwright
