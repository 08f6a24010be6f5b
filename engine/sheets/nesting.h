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
    double cell = 2;              ///< mm: pieces stand on a grid so fine, and are taken to cover its cells
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

/// Lays pieces from the largest down, each as low as it goes and then as far left, in the turn that ends
/// lowest; on the first stock that has room: offcuts as they are given, then whole sheets. A piece may lie in
/// a hole of another. The result depends on nothing but the arguments.
/// @param pieces outlines counter-clockwise, holes clockwise
/// @param offcuts each is there once
/// @throws Error(no_plan, "sheets.size") for a piece that no stock holds, Error(usage, "sheets.nest") for
/// rules out of range or turns that are no quarters, Error(cancelled)
[[nodiscard]] Nest nest_pieces(Context& context, const std::vector<Loops>& pieces, const StockSheet& sheet,
                               const std::vector<StockSheet>& offcuts, const NestRules& rules);

}  // namespace slabwright
