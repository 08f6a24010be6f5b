// Backwards in time the slab grows: every move puts back what it cut through. Pieces only ever join, so a
// union-find follows them. A piece that hangs on nothing, and is joined to what is held by putting back one
// move's cut, is what that move cut off. All that is held is one piece from the start, and nearly every cell
// is put back beside it.
#include "engine/stock/loose.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/stock/layer_stock.h"
#include "kernels/mesh/bulk_memory.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

namespace {

constexpr std::uint32_t kNever = std::numeric_limits<std::uint32_t>::max();
constexpr double kThrough = 0.01;  // mm: a cut this near to the bottom has gone through
constexpr double kMostCells = 4e6;

// When cells are cut through first: by moves, counted through all operations.
struct CutThrough {
    std::uint32_t* when;
    float* uncut;  // over the level that counts: a great height, until it is cut
    double level;
    std::uint32_t count = 0;

    void operator()(std::size_t cell, double z) {
        if (z <= level) when[cell] = count, uncut[cell] = std::numeric_limits<float>::lowest();
    }
};

// Pieces of cells that are there, joined as they grow; what is held is the first of them, whose cells are not
// counted.
class Pieces {
public:
    static constexpr std::uint32_t kNone = kNever, kHeld = 0;
    struct Piece {
        std::uint64_t cells = 0, i = 0, j = 0;  // and the sums of their columns and rows
        bool cut_at_all = true;                 // whether all of its cells are cut through some time
    };

    Pieces() : parent_{kHeld}, pieces_(1) {}
    [[nodiscard]] std::uint32_t make() {
        parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
        pieces_.emplace_back();
        ++hanging_;
        return parent_.back();
    }
    [[nodiscard]] std::uint32_t root(std::uint32_t p) {
        while (parent_[p] != p) p = parent_[p] = parent_[parent_[p]];
        return p;
    }
    /// Of two roots, the one that both are now.
    std::uint32_t join(std::uint32_t a, std::uint32_t b) {
        if (a == b) return a;
        if (b < a) std::swap(a, b);  // what is held stays the first
        parent_[b] = a;
        --hanging_;
        Piece &to = pieces_[a], &from = pieces_[b];
        to.cells += from.cells;
        to.i += from.i;
        to.j += from.j;
        to.cut_at_all &= from.cut_at_all;
        return a;
    }
    [[nodiscard]] Piece& operator[](std::uint32_t root) { return pieces_[root]; }
    /// How many are not held.
    [[nodiscard]] std::size_t hanging() const { return hanging_; }

private:
    std::vector<std::uint32_t> parent_;
    std::vector<Piece> pieces_;
    std::size_t hanging_ = 0;
};

}  // namespace

std::vector<LoosePiece> loose_pieces(Context& context, const HeldSlab& slab,
                                     std::span<const Operation> operations, std::span<const Tool> tools,
                                     double smallest_mm2, double cell) {
    const double width = slab.max[0] - slab.min[0], depth = slab.max[1] - slab.min[1];
    if (!(cell > 0)) cell = std::max(1.0, std::sqrt(width * depth / kMostCells));
    const CellGrid grid{slab.min[0] + cell / 2, slab.min[1] + cell / 2, cell,
                        std::max(1, static_cast<int>(std::ceil(width / cell - 0.5))),
                        std::max(1, static_cast<int>(std::ceil(depth / cell - 0.5)))};
    const auto nx = static_cast<std::size_t>(grid.nx);
    const MemoryCharge memory(context, grid.count() * (3 * sizeof(std::uint32_t) + sizeof(float) + 1),
                              "loose pieces");

    BulkVector<std::uint32_t> when(grid.count(), kNever);
    std::vector<std::pair<std::size_t, std::size_t>> place;  // of each counted move
    double web = slab.z_top - slab.z_bottom;  // how thick the slab still is when the last level begins
    {
        BulkVector<float> uncut(grid.count(), std::numeric_limits<float>::max());
        for (std::size_t o = 0; o < operations.size(); ++o) {
            const Operation& op = operations[o];
            const auto tool =
                std::find_if(tools.begin(), tools.end(), [&](const Tool& t) { return t.number == op.tool; });
            if (op.kind == OperationKind::face || tool == tools.end()) continue;
            context.throw_if_cancelled();
            const CutterEnd end = cutter_end(*tool);
            for (std::size_t i = 1; i < op.moves.size(); ++i) {
                const Move &a = op.moves[i - 1], &b = op.moves[i];
                if (b.feed == 0) continue;
                const double low = to_mm(std::min(a.z, b.z)) - slab.z_bottom;
                if (op.kind == OperationKind::rough && a.z == b.z && low > kThrough) web = std::min(web, low);
                if (low > kThrough) continue;
                CutThrough through{when.data(), uncut.data(), slab.z_bottom + kThrough,
                                   static_cast<std::uint32_t>(place.size())};
                place.emplace_back(o, i);
                // Where a level move of a flat cutter begins, the move before it has cut all that the cutter
                // covers.
                const bool been = i > 1 && op.moves[i - 1].feed != 0 && a.z == b.z;
                sweep_above(grid, end, {to_mm(a.x), to_mm(a.y), to_mm(a.z)},
                            {to_mm(b.x), to_mm(b.y), to_mm(b.z)}, StandingHeights{uncut.data(), 0}, through,
                            {.been = been && end.form == CutterEnd::Form::flat});
            }
        }
    }

    BulkVector<char> holds(grid.count(), 0);
    for (const Loops* region : {&slab.kept, &slab.glued}) {
        const std::vector<std::vector<Span>> held = line_spans(*region, rows_of(grid));
        for (int j = 0; j < grid.ny; ++j)
            for (const Span& s : held[static_cast<std::size_t>(j)]) {
                const int i0 =
                    std::max(0, static_cast<int>(std::ceil((s.low / kUnitsPerMm - grid.x0) / cell)));
                const int i1 = std::min(
                    grid.nx - 1, static_cast<int>(std::floor((s.high / kUnitsPerMm - grid.x0) / cell)));
                if (i0 <= i1) std::fill_n(holds.data() + grid.index(i0, j), i1 - i0 + 1, char{1});
            }
    }

    Pieces pieces;
    BulkVector<std::uint32_t> of(
        grid.count(),
        Pieces::kNone);  // by cell: its piece, or what has become a part of one; none: not there yet
    // Cells that are never cut through are there from the start, stretch by stretch of a row.
    for (std::size_t row = 0; row < grid.count(); row += nx)
        for (std::size_t i = 0; i < nx;) {
            if (when[row + i] != kNever) {
                ++i;
                continue;
            }
            const std::size_t begin = i;
            while (i < nx && when[row + i] == kNever) ++i;
            const bool held = std::find(holds.data() + row + begin, holds.data() + row + i, char{1}) !=
                              holds.data() + row + i;
            std::uint32_t piece = held ? Pieces::kHeld : Pieces::kNone;
            std::uint32_t last = Pieces::kNone;
            for (std::size_t k = begin; k < i && row > 0; ++k) {
                const std::uint32_t below = of[row + k - nx];
                if (below == Pieces::kNone || below == last) continue;
                last = below;
                piece = piece == Pieces::kNone ? pieces.root(below) : pieces.join(piece, pieces.root(below));
            }
            if (piece == Pieces::kNone) piece = pieces.make();
            std::fill(of.data() + row + begin, of.data() + row + i, piece);
            Pieces::Piece& p = pieces[piece];
            const std::size_t n = i - begin;
            p.cells += n;
            p.i += n * (begin + i - 1) / 2;
            p.j += n * (row / nx);
            p.cut_at_all = false;
        }

    // The others in the order in which they are put back: the last move's first; of one move's by number.
    BulkVector<std::uint32_t> order;
    {
        std::vector<std::uint32_t> begins(place.size() + 1, 0);
        for (const std::uint32_t move : when)
            if (move != kNever) ++begins[place.size() - move];
        for (std::size_t t = 1; t < begins.size(); ++t) begins[t] += begins[t - 1];
        order.resize(begins.back());
        for (std::size_t c = 0; c < when.size(); ++c)
            if (when[c] != kNever)
                order[begins[place.size() - 1 - when[c]]++] = static_cast<std::uint32_t>(c);
    }
    const auto each_neighbour = [&](std::size_t c, std::size_t i, auto&& fn) {
        if (i > 0 && of[c - 1] != Pieces::kNone) fn(of[c - 1]);
        if (i + 1 < nx && of[c + 1] != Pieces::kNone) fn(of[c + 1]);
        if (c >= nx && of[c - nx] != Pieces::kNone) fn(of[c - nx]);
        if (c + nx < of.size() && of[c + nx] != Pieces::kNone) fn(of[c + nx]);
    };

    std::vector<LoosePiece> found;
    std::vector<std::uint32_t> beside;  // pieces that hang on nothing, next to what this move puts back
    std::vector<Pieces::Piece> before;
    for (std::size_t first = 0; first < order.size();) {
        std::size_t last = first;
        const std::uint32_t now = when[order[first]];
        while (last < order.size() && when[order[last]] == now) ++last;
        beside.clear();
        before.clear();
        for (std::size_t k = first; k < last && pieces.hanging() > 0; ++k)
            each_neighbour(order[k], order[k] % nx, [&](std::uint32_t p) {
                if (const std::uint32_t r = pieces.root(p); r != Pieces::kHeld) beside.push_back(r);
            });
        std::sort(beside.begin(), beside.end());
        beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
        for (const std::uint32_t r : beside) before.push_back(pieces[r]);
        for (std::size_t k = first; k < last; ++k) {
            const std::size_t c = order[k], i = c % nx;
            std::uint32_t piece = holds[c] != 0 ? Pieces::kHeld : Pieces::kNone;
            each_neighbour(c, i, [&](std::uint32_t p) {
                if (p == piece) return;
                p = pieces.root(p);
                piece = piece == Pieces::kNone ? p : pieces.join(piece, p);
            });
            if (piece == Pieces::kNone) piece = pieces.make();
            of[c] = piece;
            if (piece == Pieces::kHeld) continue;
            Pieces::Piece& p = pieces[piece];
            ++p.cells;
            p.i += i;
            p.j += c / nx;
        }
        for (std::size_t k = 0; k < beside.size(); ++k) {
            const Pieces::Piece& p = before[k];
            const auto cells = static_cast<double>(p.cells);
            const double area = cells * cell * cell;
            if (area < smallest_mm2 || pieces.root(beside[k]) != Pieces::kHeld) continue;
            const auto [o, i] = place[now];
            found.push_back({area, p.cut_at_all ? web : slab.z_top - slab.z_bottom,
                             grid.x0 + cell * (static_cast<double>(p.i) / cells),
                             grid.y0 + cell * (static_cast<double>(p.j) / cells), o, i});
        }
        first = last;
    }
    std::reverse(found.begin(), found.end());
    return found;
}

}  // namespace slabwright
