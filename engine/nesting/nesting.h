// Flat pieces on stock sheets (METHOD.md section 13). Serves sheets, and the blanks of slabs.
#pragma once

#include <vector>

#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// A rectangle that pieces are laid on, from (0, 0).
struct StockSheet {
    double length = 0, width = 0;  ///< mm along x and y
};

struct NestRules {
    double spacing = 10;  ///< mm of stock between two pieces
    double margin = 10;   ///< mm between pieces and the stock's edge
    std::vector<int> turns{0, 90, 180,
                           270};  ///< degrees that pieces may be turned by; 0 and 180 keep a grain
    double cell = 1;              ///< mm: pieces stand on a grid so fine, and are taken to cover its cells
    int tries = 64;               ///< orders in which pieces are laid; the best is kept
};

/// Where a piece lies: turned about its origin, then moved.
struct NestPlace {
    int stock = 0;  ///< index of StockSheets in use
    int turn = 0;   ///< degrees
    Point2 shift;
};

struct Nest {
    std::vector<NestPlace> places;  ///< of every piece
    std::vector<StockSheet> stock;  ///< that is used: offcuts first, then whole sheets
    double utilisation = 0;         ///< area of pieces over area of stock in use
};

/// A point of a piece where the piece lies. Exact: turns are quarters.
[[nodiscard]] Point2 placed(Point2 p, const NestPlace& place);
[[nodiscard]] Loops placed(const Loops& loops, const NestPlace& place);

/// Lays pieces one after another, each as low as it goes and then as far left, in the turn that ends lowest;
/// on the first stock that has room: offcuts as they are given, then whole sheets. A piece may lie in a hole
/// of another. Orders are tried: from the largest down by box, area, longer and shorter side, then changes of
/// the best one. Kept is what takes the fewest sheets, then the least of the last. The result depends on
/// nothing but the arguments. Time grows with tries.
///
///     Nest nest = nest_pieces(context, blanks, {2440, 1220}, {{600, 400}}, {.spacing = 8, .margin = 10});
///     Loops lies = placed(blanks[0], nest.places[0]);  // on nest.stock[nest.places[0].stock]
/// @param pieces outlines counter-clockwise, holes clockwise
/// @param offcuts each is there once
/// @throws Error(no_plan, "sheets.size") for a piece that no stock holds, Error(usage, "sheets.nest") for
/// rules out of range or turns that are no quarters, Error(cancelled)
[[nodiscard]] Nest nest_pieces(Context& context, const std::vector<Loops>& pieces, const StockSheet& sheet,
                               const std::vector<StockSheet>& offcuts, const NestRules& rules);

}  // namespace slabwright
