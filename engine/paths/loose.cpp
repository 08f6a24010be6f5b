// Backwards in time the slab grows: every move puts back what it cut through. Pieces only ever join, so a union-find follows them. A
// piece that hangs on nothing, and is joined to what is held by putting back one move's cut, is what that move cut off.
#include "engine/paths/loose.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/paths/layer_stock.h"
#include "kernels/mesh/bulk_memory.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

namespace {

constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();
constexpr double kThrough = 0.01;  // mm: a cut this near to the bottom has gone through
constexpr double kMostCells = 4e6;

// What one cell's piece holds, at its root.
struct Piece {
    std::uint32_t cells = 0;
    bool held = false;
    bool cut_at_all = true;  // whether all of its cells are cut through some time
    double x = 0, y = 0;     // sums
};

}  // namespace

std::vector<LoosePiece> loose_pieces(Context& context, const HeldSlab& slab, std::span<const Operation> operations, std::span<const Tool> tools,
                                     double smallest_mm2, double cell) {
    const double width = slab.max[0] - slab.min[0], depth = slab.max[1] - slab.min[1];
    if (!(cell > 0)) cell = std::max(1.0, std::sqrt(width * depth / kMostCells));
    const CellGrid grid{slab.min[0] + cell / 2, slab.min[1] + cell / 2, cell, std::max(1, static_cast<int>(std::ceil(width / cell - 0.5))),
                        std::max(1, static_cast<int>(std::ceil(depth / cell - 0.5)))};
    const MemoryCharge memory(context, grid.count() * (sizeof(Piece) + 3 * sizeof(std::uint32_t) + 1), "loose pieces");

    // When each cell is cut through: by moves, counted through all operations.
    BulkVector<std::uint32_t> when(grid.count(), kNever);
    std::vector<std::pair<std::size_t, std::size_t>> place;  // of each counted move
    double web = slab.z_top - slab.z_bottom;                 // how thick the slab still is when the last level begins
    for (std::size_t o = 0; o < operations.size(); ++o) {
        const Operation& op = operations[o];
        const auto tool = std::find_if(tools.begin(), tools.end(), [&](const Tool& t) { return t.number == op.tool; });
        if (op.kind == OperationKind::face || tool == tools.end()) continue;
        context.throw_if_cancelled();
        const CutterEnd end = cutter_end(*tool);
        for (std::size_t i = 1; i < op.moves.size(); ++i) {
            const Move &a = op.moves[i - 1], &b = op.moves[i];
            if (b.feed == 0) continue;
            const double low = to_mm(std::min(a.z, b.z)) - slab.z_bottom;
            if (op.kind == OperationKind::rough && a.z == b.z && low > kThrough) web = std::min(web, low);
            if (low > kThrough) continue;
            const auto count = static_cast<std::uint32_t>(place.size());
            place.emplace_back(o, i);
            sweep(grid, end, {to_mm(a.x), to_mm(a.y), to_mm(a.z)}, {to_mm(b.x), to_mm(b.y), to_mm(b.z)}, [&](std::size_t c, double z) {
                if (z <= slab.z_bottom + kThrough && when[c] == kNever) when[c] = count;
            });
        }
    }

    std::vector<char> holds(grid.count(), 0);
    for (const Loops* region : {&slab.kept, &slab.glued}) {
        const std::vector<std::vector<Span>> held = line_spans(*region, rows_of(grid));
        for (int j = 0; j < grid.ny; ++j)
            for (const Span& s : held[static_cast<std::size_t>(j)]) {
                const int i0 = std::max(0, static_cast<int>(std::ceil((s.low / kUnitsPerMm - grid.x0) / cell)));
                const int i1 = std::min(grid.nx - 1, static_cast<int>(std::floor((s.high / kUnitsPerMm - grid.x0) / cell)));
                for (int i = i0; i <= i1; ++i) holds[grid.index(i, j)] = 1;
            }
    }

    // Cells in the order in which they are put back: those that are never cut through, then the last move's first; of one move's by number.
    BulkVector<std::uint32_t> order(grid.count());
    {
        const std::size_t count = place.size();
        const auto turn = [&](std::uint32_t move) { return move == kNever ? 0 : count - move; };
        std::vector<std::uint32_t> begins(count + 2, 0);
        for (const std::uint32_t move : when) ++begins[turn(move) + 1];
        for (std::size_t t = 1; t < begins.size(); ++t) begins[t] += begins[t - 1];
        for (std::size_t c = 0; c < when.size(); ++c) order[begins[turn(when[c])]++] = static_cast<std::uint32_t>(c);
    }

    // Apart from what a piece holds, which is asked at its root only.
    BulkVector<std::uint32_t> parent(grid.count(), kNever);  // kNever: not there yet
    BulkVector<Piece> pieces(grid.count());                  // of cells that are there
    auto root = [&](std::uint32_t c) {
        while (parent[c] != c) c = parent[c] = parent[parent[c]];
        return c;
    };
    auto join = [&](std::uint32_t a, std::uint32_t b) {
        a = root(a), b = root(b);
        if (a == b) return;
        if (pieces[a].cells < pieces[b].cells || (pieces[a].cells == pieces[b].cells && b < a)) std::swap(a, b);
        parent[b] = a;
        pieces[a].cells += pieces[b].cells;
        pieces[a].held |= pieces[b].held;
        pieces[a].cut_at_all &= pieces[b].cut_at_all;
        pieces[a].x += pieces[b].x, pieces[a].y += pieces[b].y;
    };
    auto each_neighbour = [&](std::uint32_t c, auto&& fn) {
        const int i = static_cast<int>(c % static_cast<std::uint32_t>(grid.nx)), j = static_cast<int>(c / static_cast<std::uint32_t>(grid.nx));
        if (i > 0) fn(c - 1);
        if (i + 1 < grid.nx) fn(c + 1);
        if (j > 0) fn(c - static_cast<std::uint32_t>(grid.nx));
        if (j + 1 < grid.ny) fn(c + static_cast<std::uint32_t>(grid.nx));
    };

    std::vector<LoosePiece> found;
    std::vector<std::uint32_t> beside;  // pieces that hang on nothing, next to what this move puts back
    for (std::size_t first = 0; first < order.size();) {
        std::size_t last = first;
        const std::uint32_t now = when[order[first]];
        while (last < order.size() && when[order[last]] == now) ++last;
        beside.clear();
        for (std::size_t k = first; k < last; ++k)
            each_neighbour(order[k], [&](std::uint32_t n) {
                if (parent[n] == kNever) return;
                if (const std::uint32_t r = root(n); !pieces[r].held) beside.push_back(r);
            });
        std::sort(beside.begin(), beside.end());
        beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
        std::vector<Piece> before;
        for (const std::uint32_t r : beside) before.push_back(pieces[r]);
        for (std::size_t k = first; k < last; ++k) {
            const std::uint32_t c = order[k];
            const int i = static_cast<int>(c % static_cast<std::uint32_t>(grid.nx)), j = static_cast<int>(c / static_cast<std::uint32_t>(grid.nx));
            parent[c] = c;
            pieces[c] = {1, holds[c] != 0, now != kNever, grid.x(i), grid.y(j)};
        }
        for (std::size_t k = first; k < last; ++k)
            each_neighbour(order[k], [&](std::uint32_t n) {
                if (parent[n] != kNever) join(order[k], n);
            });
        for (std::size_t k = 0; k < beside.size(); ++k) {
            const double area = before[k].cells * cell * cell;
            if (area < smallest_mm2 || !pieces[root(beside[k])].held) continue;
            const auto [o, i] = place[now];
            found.push_back(
                {area, before[k].cut_at_all ? web : slab.z_top - slab.z_bottom, before[k].x / before[k].cells, before[k].y / before[k].cells, o, i});
        }
        first = last;
    }
    std::reverse(found.begin(), found.end());
    return found;
}

}  // namespace slabwright
