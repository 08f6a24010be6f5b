// Backwards in time the slab grows: every move puts back what it cut through. Pieces only ever join, so a
// union-find follows them. A piece that hangs on nothing, and is joined to what is held by putting back one
// move's cut, is what that move cut off. All that is held is one piece from the start, and nearly every cell
// is put back beside it. How thick a piece is then, the moves up to that one tell, run forwards.
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
        std::size_t cell = 0;                   // one of them
    };

    Pieces() : parent_{kHeld}, pieces_(1) {}
    [[nodiscard]] std::uint32_t make(std::size_t cell) {
        parent_.push_back(static_cast<std::uint32_t>(parent_.size()));
        pieces_.push_back({.cell = cell});
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

// The slab from its last move back to its first.
class GrowingSlab {
public:
    GrowingSlab(Context& context, const HeldSlab& slab, double cell)
        : context_(context),
          slab_(slab),
          grid_(grid_of(slab, cell)),
          nx_(static_cast<std::size_t>(grid_.nx)),
          memory_(context, grid_.count() * (3 * sizeof(std::uint32_t) + sizeof(float) + 1), "loose pieces"),
          when_(grid_.count(), kNever),
          holds_(grid_.count(), 0),
          of_(grid_.count(), Pieces::kNone) {}

    std::vector<LoosePiece> run(std::span<const Operation> operations, std::span<const Tool> tools,
                                double smallest_mm2) {
        cut_through(operations, tools);
        mark_held();
        lay_uncut();
        put_in_order();
        for (std::size_t first = 0; first < order_.size();) {
            std::size_t last = first;
            while (last < order_.size() && when_[order_[last]] == when_[order_[first]]) ++last;
            put_back(first, last, smallest_mm2);
            first = last;
        }
        std::reverse(found_.begin(), found_.end());
        if (!found_.empty()) measure(operations, tools);
        std::vector<LoosePiece> pieces;
        for (const Found& f : found_) pieces.push_back(f.piece);
        return pieces;
    }

private:
    struct Found {
        LoosePiece piece;
        std::size_t cell = 0;     // one of its own
        std::uint32_t count = 0;  // of the move that cut it off
    };

    static CellGrid grid_of(const HeldSlab& slab, double cell) {
        const double width = slab.max[0] - slab.min[0], depth = slab.max[1] - slab.min[1];
        if (!(cell > 0)) cell = std::max(1.0, std::sqrt(width * depth / kMostCells));
        return {slab.min[0] + cell / 2, slab.min[1] + cell / 2, cell,
                std::max(1, static_cast<int>(std::ceil(width / cell - 0.5))),
                std::max(1, static_cast<int>(std::ceil(depth / cell - 0.5)))};
    }

    // Calls fn(operation, move, end of its cutter, place before, place after) for every move that cuts, in
    // order. Face milling cuts nothing through.
    template <class Fn>
    void each_cut(std::span<const Operation> operations, std::span<const Tool> tools, Fn&& fn) const {
        for (std::size_t o = 0; o < operations.size(); ++o) {
            const Operation& op = operations[o];
            const auto tool =
                std::find_if(tools.begin(), tools.end(), [&](const Tool& t) { return t.number == op.tool; });
            if (op.kind == OperationKind::face || tool == tools.end()) continue;
            context_.throw_if_cancelled();
            const CutterEnd end = cutter_end(*tool);
            for (std::size_t i = 1; i < op.moves.size(); ++i)
                if (op.moves[i].feed != 0) fn(o, i, end, op.moves[i - 1], op.moves[i]);
        }
    }
    template <class Fn>
    void sweep_cut(const CutterEnd& end, const Move& a, const Move& b, float* height, Fn& fn,
                   bool been) const {
        sweep_above(grid_, end, {to_mm(a.x), to_mm(a.y), to_mm(a.z)}, {to_mm(b.x), to_mm(b.y), to_mm(b.z)},
                    StandingHeights{height, 0}, fn, {.been = been});
    }

    // When cells are cut through first.
    void cut_through(std::span<const Operation> operations, std::span<const Tool> tools) {
        BulkVector<float> uncut(grid_.count(), std::numeric_limits<float>::max());
        each_cut(operations, tools,
                 [&](std::size_t o, std::size_t i, const CutterEnd& end, const Move& a, const Move& b) {
                     if (to_mm(std::min(a.z, b.z)) - slab_.z_bottom > kThrough) return;
                     CutThrough through{when_.data(), uncut.data(), slab_.z_bottom + kThrough,
                                        static_cast<std::uint32_t>(place_.size())};
                     place_.emplace_back(o, i);
                     // Where a level move of a flat cutter begins, the move before it has cut all that the
                     // cutter covers.
                     const bool been = i > 1 && a.feed != 0 && a.z == b.z;
                     sweep_cut(end, a, b, uncut.data(), through, been && end.form == CutterEnd::Form::flat);
                 });
    }

    void mark_held() {
        const std::vector<std::vector<Span>> held = line_spans(slab_.kept, rows_of(grid_));
        for (int j = 0; j < grid_.ny; ++j)
            for (const Span& s : held[static_cast<std::size_t>(j)]) {
                const int i0 =
                    std::max(0, static_cast<int>(std::ceil((s.low / kUnitsPerMm - grid_.x0) / grid_.cell)));
                const int i1 =
                    std::min(grid_.nx - 1,
                             static_cast<int>(std::floor((s.high / kUnitsPerMm - grid_.x0) / grid_.cell)));
                if (i0 <= i1) std::fill_n(holds_.data() + grid_.index(i0, j), i1 - i0 + 1, char{1});
            }
    }

    // Cells that are never cut through are there from the start, stretch by stretch of a row.
    void lay_uncut() {
        for (std::size_t row = 0; row < grid_.count(); row += nx_)
            for (std::size_t i = 0; i < nx_;) {
                if (when_[row + i] != kNever) {
                    ++i;
                    continue;
                }
                const std::size_t begin = i;
                while (i < nx_ && when_[row + i] == kNever) ++i;
                lay_stretch(row, begin, i);
            }
    }
    void lay_stretch(std::size_t row, std::size_t begin, std::size_t end) {
        const char* const last_hold = holds_.data() + row + end;
        const bool held =
            std::find(holds_.data() + row + begin, holds_.data() + row + end, char{1}) != last_hold;
        std::uint32_t piece = held ? Pieces::kHeld : Pieces::kNone;
        std::uint32_t last = Pieces::kNone;
        for (std::size_t k = begin; k < end && row > 0; ++k) {
            const std::uint32_t below = of_[row + k - nx_];
            if (below == Pieces::kNone || below == last) continue;
            last = below;
            piece = piece == Pieces::kNone ? pieces_.root(below) : pieces_.join(piece, pieces_.root(below));
        }
        if (piece == Pieces::kNone) piece = pieces_.make(row + begin);
        std::fill(of_.data() + row + begin, of_.data() + row + end, piece);
        Pieces::Piece& p = pieces_[piece];
        const std::size_t n = end - begin;
        p.cells += n;
        p.i += n * (begin + end - 1) / 2;
        p.j += n * (row / nx_);
    }

    // The others in the order in which they are put back: the last move's first; of one move's by number.
    void put_in_order() {
        std::vector<std::uint32_t> begins(place_.size() + 1, 0);
        for (const std::uint32_t move : when_)
            if (move != kNever) ++begins[place_.size() - move];
        for (std::size_t t = 1; t < begins.size(); ++t) begins[t] += begins[t - 1];
        order_.resize(begins.back());
        for (std::size_t c = 0; c < when_.size(); ++c)
            if (when_[c] != kNever)
                order_[begins[place_.size() - 1 - when_[c]]++] = static_cast<std::uint32_t>(c);
    }

    template <class Fn>
    void each_neighbour(std::size_t c, std::size_t i, Fn&& fn) const {
        if (i > 0 && of_[c - 1] != Pieces::kNone) fn(of_[c - 1]);
        if (i + 1 < nx_ && of_[c + 1] != Pieces::kNone) fn(of_[c + 1]);
        if (c >= nx_ && of_[c - nx_] != Pieces::kNone) fn(of_[c - nx_]);
        if (c + nx_ < of_.size() && of_[c + nx_] != Pieces::kNone) fn(of_[c + nx_]);
    }

    // Puts back what one move cut through, and tells of pieces that this joins to what is held.
    void put_back(std::size_t first, std::size_t last, double smallest_mm2) {
        beside_.clear();
        before_.clear();
        for (std::size_t k = first; k < last && pieces_.hanging() > 0; ++k)
            each_neighbour(order_[k], order_[k] % nx_, [&](std::uint32_t p) {
                if (const std::uint32_t r = pieces_.root(p); r != Pieces::kHeld) beside_.push_back(r);
            });
        std::sort(beside_.begin(), beside_.end());
        beside_.erase(std::unique(beside_.begin(), beside_.end()), beside_.end());
        for (const std::uint32_t r : beside_) before_.push_back(pieces_[r]);
        for (std::size_t k = first; k < last; ++k) put_back(order_[k]);
        for (std::size_t k = 0; k < beside_.size(); ++k) {
            const Pieces::Piece& p = before_[k];
            const auto cells = static_cast<double>(p.cells);
            const double area = cells * grid_.cell * grid_.cell;
            if (area < smallest_mm2 || pieces_.root(beside_[k]) != Pieces::kHeld) continue;
            const auto [o, i] = place_[when_[order_[first]]];
            found_.push_back({{area, slab_.z_top - slab_.z_bottom,
                               grid_.x0 + grid_.cell * (static_cast<double>(p.i) / cells),
                               grid_.y0 + grid_.cell * (static_cast<double>(p.j) / cells), o, i},
                              p.cell,
                              when_[order_[first]]});
        }
    }
    void put_back(std::size_t c) {
        const std::size_t i = c % nx_;
        std::uint32_t piece = holds_[c] != 0 ? Pieces::kHeld : Pieces::kNone;
        each_neighbour(c, i, [&](std::uint32_t p) {
            if (p == piece) return;
            p = pieces_.root(p);
            piece = piece == Pieces::kNone ? p : pieces_.join(piece, p);
        });
        if (piece == Pieces::kNone) piece = pieces_.make(c);
        of_[c] = piece;
        if (piece == Pieces::kHeld) return;
        Pieces::Piece& p = pieces_[piece];
        ++p.cells;
        p.i += i;
        p.j += c / nx_;
    }

    // What stands over the layer's bottom where a piece is, once the move that cuts it off has been made.
    void measure(std::span<const Operation> operations, std::span<const Tool> tools) {
        BulkVector<float> height(grid_.count(), static_cast<float>(slab_.z_top));
        const auto lower = [&](std::size_t cell, double z) {
            height[cell] = std::min(height[cell], static_cast<float>(z));
        };
        auto next = found_.begin();
        each_cut(operations, tools,
                 [&](std::size_t o, std::size_t i, const CutterEnd& end, const Move& a, const Move& b) {
                     if (next == found_.end()) return;
                     sweep_cut(end, a, b, height.data(), lower, false);
                     for (; next != found_.end() && next->piece.operation == o && next->piece.move == i;
                          ++next)
                         next->piece.thickness_mm = std::max(0.0, highest(*next, height) - slab_.z_bottom);
                 });
    }
    // Of the cells of a piece, which hang together and are cut through later or never.
    [[nodiscard]] double highest(const Found& found, const BulkVector<float>& height) const {
        std::vector<char> seen(grid_.count(), 0);
        std::vector<std::size_t> open{found.cell};
        seen[found.cell] = 1;
        float most = std::numeric_limits<float>::lowest();
        const auto look_at = [&](std::size_t c) {
            if (seen[c] != 0 || holds_[c] != 0 || (when_[c] != kNever && when_[c] <= found.count)) return;
            seen[c] = 1;
            open.push_back(c);
        };
        while (!open.empty()) {
            const std::size_t c = open.back(), i = c % nx_;
            open.pop_back();
            most = std::max(most, height[c]);
            if (i > 0) look_at(c - 1);
            if (i + 1 < nx_) look_at(c + 1);
            if (c >= nx_) look_at(c - nx_);
            if (c + nx_ < height.size()) look_at(c + nx_);
        }
        return most;
    }

    Context& context_;
    const HeldSlab& slab_;
    const CellGrid grid_;
    const std::size_t nx_;
    const MemoryCharge memory_;
    BulkVector<std::uint32_t> when_;
    BulkVector<char> holds_;
    BulkVector<std::uint32_t>
        of_;  // by cell: its piece, or what has become a part of one; none: not there yet
    std::vector<std::pair<std::size_t, std::size_t>> place_;  // of each counted move
    BulkVector<std::uint32_t> order_;                         // of cells
    Pieces pieces_;
    std::vector<std::uint32_t> beside_;  // pieces that hang on nothing, next to what a move puts back
    std::vector<Pieces::Piece> before_;
    std::vector<Found> found_;
};

}  // namespace

std::vector<LoosePiece> loose_pieces(Context& context, const HeldSlab& slab,
                                     std::span<const Operation> operations, std::span<const Tool> tools,
                                     double smallest_mm2, double cell) {
    return GrowingSlab(context, slab, cell).run(operations, tools, smallest_mm2);
}

}  // namespace slabwright
