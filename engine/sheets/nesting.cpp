#include "engine/sheets/nesting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>

#include "kernels/errors.h"

namespace slabwright {

namespace {

/// Cells of a grid, a bit each, rows from below.
class Cells {
public:
    Cells(int columns, int rows)
        : columns_(columns),
          rows_(rows),
          words_(static_cast<std::size_t>((columns + 63) / 64)),
          bits_(words_ * static_cast<std::size_t>(rows), 0) {}

    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] int rows() const { return rows_; }

    void mark(int row, int first, int last) {
        if (row < 0 || row >= rows_) return;
        for (int c = std::max(first, 0); c <= std::min(last, columns_ - 1); ++c)
            bits_[at(row) + static_cast<std::size_t>(c / 64)] |= std::uint64_t{1} << (c % 64);
    }

    /// Whether `piece` moved by (column, row) meets a marked cell.
    [[nodiscard]] bool meets(const Cells& piece, int column, int row) const {
        for (int r = 0; r < piece.rows_; ++r)
            for (std::size_t w = 0; w < piece.words_; ++w) {
                const std::uint64_t own = piece.bits_[piece.at(r) + w];
                if (own != 0 && (window(row + r, column + static_cast<int>(w) * 64) & own) != 0) return true;
            }
        return false;
    }

    void add(const Cells& piece, int column, int row) {
        for (int r = 0; r < piece.rows_; ++r)
            for (int c = 0; c < piece.columns_; ++c)
                if ((piece.bits_[piece.at(r) + static_cast<std::size_t>(c / 64)] >> (c % 64) & 1) != 0)
                    mark(row + r, column + c, column + c);
    }

private:
    [[nodiscard]] std::size_t at(int row) const { return static_cast<std::size_t>(row) * words_; }
    /// 64 cells from a column on; none beyond the grid.
    [[nodiscard]] std::uint64_t window(int row, int column) const {
        const std::size_t word = static_cast<std::size_t>(column / 64);
        const int shift = column % 64;
        std::uint64_t bits = word < words_ ? bits_[at(row) + word] >> shift : 0;
        if (shift != 0 && word + 1 < words_) bits |= bits_[at(row) + word + 1] << (64 - shift);
        return bits;
    }

    int columns_, rows_;
    std::size_t words_;
    std::vector<std::uint64_t> bits_;
};

struct Box {
    Point2 low{INT32_MAX, INT32_MAX}, high{INT32_MIN, INT32_MIN};
};

Box box_of(const Loops& loops) {
    Box box;
    for (const Point2 p : loops.points) {
        box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y)};
        box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y)};
    }
    return box;
}

/// A piece in one turn: the cells that it and half of the spacing touch, from the low corner of its box.
struct Turned {
    int turn = 0;
    Point2 low;  ///< of the box that the cells begin at
    Cells cells;
};

/// Every cell that the region touches is marked: those that its edges pass, and those on whose lower line it
/// lies.
Cells cells_of(const Loops& region, const Box& box, std::int64_t cell) {
    const int columns = static_cast<int>((std::int64_t{box.high.x} - box.low.x) / cell) + 1;
    const int rows = static_cast<int>((std::int64_t{box.high.y} - box.low.y) / cell) + 1;
    Cells cells(columns, rows);
    const auto column = [&](double x) {
        return static_cast<int>(std::floor((x - box.low.x) / double(cell)));
    };
    for (std::size_t i = 0; i < region.size(); ++i) {
        const auto loop = region.loop(i);
        for (std::size_t k = 0; k < loop.size(); ++k) {
            Point2 a = loop[k], b = loop[(k + 1) % loop.size()];
            if (a.y > b.y) std::swap(a, b);
            const int r0 = static_cast<int>((std::int64_t{a.y} - box.low.y) / cell),
                      r1 = static_cast<int>((std::int64_t{b.y} - box.low.y) / cell);
            for (int r = r0; r <= r1; ++r) {
                const double y0 = std::max<double>(a.y, double(box.low.y) + double(r) * double(cell)),
                             y1 = std::min<double>(b.y, double(box.low.y) + double(r + 1) * double(cell));
                const auto x_at = [&](double y) {
                    return b.y == a.y ? double(a.x)
                                      : a.x + (double(b.x) - a.x) * (y - a.y) / (double(b.y) - a.y);
                };
                double x0 = x_at(y0), x1 = x_at(y1);
                if (b.y == a.y) x0 = a.x, x1 = b.x;
                cells.mark(r, column(std::min(x0, x1) - 1), column(std::max(x0, x1) + 1));
            }
        }
    }
    std::vector<double> lines;
    for (int r = 0; r < rows; ++r) lines.push_back(double(box.low.y) + double(r) * double(cell) + 0.5);
    const std::vector<std::vector<Span>> spans = line_spans(region, lines);
    for (int r = 0; r < rows; ++r)
        for (const Span& span : spans[static_cast<std::size_t>(r)])
            cells.mark(r, column(span.low), column(span.high));
    return cells;
}

std::vector<Turned> turns_of(const Loops& piece, const NestRules& rules, std::int64_t cell) {
    std::vector<Turned> turned;
    for (const int turn : rules.turns) {
        const Loops grown = offset(placed(piece, {0, turn, {0, 0}}), rules.spacing / 2, 0.05);
        const Box box = box_of(grown);
        turned.push_back({turn, box.low, cells_of(grown, box, cell)});
    }
    return turned;
}

struct Spot {
    int column = 0, row = 0;
    std::size_t turn = 0;
};

/// The lowest spot, then the leftmost, of each turn; of these the one that ends lowest, then leftmost.
std::optional<Spot> spot_on(const Cells& taken, const std::vector<Turned>& turned) {
    std::optional<Spot> best;
    const auto ends = [&](const Spot& spot) {
        return std::pair{spot.row + turned[spot.turn].cells.rows(),
                         spot.column + turned[spot.turn].cells.columns()};
    };
    for (std::size_t t = 0; t < turned.size(); ++t) {
        const Cells& cells = turned[t].cells;
        bool found = false;
        for (int row = 0; row + cells.rows() <= taken.rows() && !found; ++row)
            for (int column = 0; column + cells.columns() <= taken.columns() && !found; ++column) {
                if (taken.meets(cells, column, row)) continue;
                const Spot spot{column, row, t};
                if (!best || ends(spot) < ends(*best)) best = spot;
                found = true;
            }
    }
    return best;
}

void require_rules(const StockSheet& sheet, const std::vector<StockSheet>& offcuts, const NestRules& rules) {
    bool good = rules.spacing >= 0 && rules.margin >= 0 && rules.cell > 0.01 && !rules.turns.empty();
    for (const int turn : rules.turns) good = good && turn % 90 == 0;
    std::vector<StockSheet> all = offcuts;
    all.push_back(sheet);
    for (const StockSheet& s : all)
        good = good && s.length > 0 && s.width > 0 && s.length < 1e5 && s.width < 1e5 &&
               s.length / rules.cell < 20000 && s.width / rules.cell < 20000;
    if (!good)
        throw Error(ErrorKind::usage, "sheets.nest", "stock, spacing or turns are out of range", "",
                    "sizes over 0 and under 100 m, spacing 0 or more, turns of 0, 90, 180 or 270 degrees");
}

}  // namespace

Point2 placed(Point2 p, const NestPlace& place) {
    switch (((place.turn % 360) + 360) % 360) {
        case 90:
            p = {-p.y, p.x};
            break;
        case 180:
            p = {-p.x, -p.y};
            break;
        case 270:
            p = {p.y, -p.x};
            break;
        default:
            break;
    }
    return {p.x + place.shift.x, p.y + place.shift.y};
}

Loops placed(const Loops& loops, const NestPlace& place) {
    Loops moved = loops;
    for (Point2& p : moved.points) p = placed(p, place);
    return moved;
}

Nest nest_pieces(Context& context, const std::vector<Loops>& pieces, const StockSheet& sheet,
                 const std::vector<StockSheet>& offcuts, const NestRules& rules) {
    require_rules(sheet, offcuts, rules);
    const std::int64_t cell = to_units(rules.cell);
    // Half of the spacing may reach into the margin.
    const double inset = std::max(0.0, rules.margin - rules.spacing / 2);
    const auto grid_of = [&](const StockSheet& s) {
        return Cells(std::max(0, static_cast<int>((s.length - 2 * inset) / rules.cell)),
                     std::max(0, static_cast<int>((s.width - 2 * inset) / rules.cell)));
    };
    Nest nest;
    nest.places.resize(pieces.size());
    std::vector<Cells> taken;
    for (const StockSheet& s : offcuts) {
        nest.stock.push_back(s);
        taken.push_back(grid_of(s));
    }
    std::vector<std::size_t> order(pieces.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::vector<double> size;
    for (const Loops& piece : pieces) {
        const Box box = box_of(piece);
        size.push_back(piece.points.empty() ? 0
                                            : to_mm(box.high.x - std::int64_t{box.low.x}) *
                                                  to_mm(box.high.y - std::int64_t{box.low.y}));
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return size[a] > size[b]; });
    double used = 0;
    for (const std::size_t i : order) {
        context.throw_if_cancelled();
        if (pieces[i].points.empty()) continue;
        used += area(pieces[i]);
        const std::vector<Turned> turned = turns_of(pieces[i], rules, cell);
        std::optional<Spot> spot;
        std::size_t s = 0;
        for (; s < taken.size() && !spot; ++s) spot = spot_on(taken[s], turned);
        if (spot) {
            --s;
        } else {
            nest.stock.push_back(sheet);
            taken.push_back(grid_of(sheet));
            s = taken.size() - 1;
            spot = spot_on(taken[s], turned);
            if (!spot) {
                const Box box = box_of(pieces[i]);
                throw Error(
                    ErrorKind::no_plan, "sheets.size",
                    fmt::format("a piece of {:.1f} x {:.1f} mm does not fit on stock of {} x {} mm",
                                to_mm(box.high.x - std::int64_t{box.low.x}),
                                to_mm(box.high.y - std::int64_t{box.low.y}), sheet.length, sheet.width),
                    fmt::format("piece {}", i + 1), "give larger sheets, or stack along another axis");
            }
        }
        const Turned& t = turned[spot->turn];
        taken[s].add(t.cells, spot->column, spot->row);
        const std::int32_t low = to_units(inset);
        nest.places[i] = {static_cast<int>(s),
                          t.turn,
                          {static_cast<std::int32_t>(low + spot->column * cell - t.low.x),
                           static_cast<std::int32_t>(low + spot->row * cell - t.low.y)}};
    }
    // Offcuts on which nothing lies are not in use.
    std::set<int> in_use;
    for (std::size_t i = 0; i < pieces.size(); ++i)
        if (!pieces[i].points.empty()) in_use.insert(nest.places[i].stock);
    std::vector<StockSheet> kept;
    for (const int s : in_use) kept.push_back(nest.stock[static_cast<std::size_t>(s)]);
    for (NestPlace& place : nest.places)
        place.stock = static_cast<int>(std::distance(in_use.begin(), in_use.lower_bound(place.stock)));
    nest.stock = std::move(kept);
    double offered = 0;
    for (const StockSheet& s : nest.stock) offered += s.length * s.width;
    nest.utilisation = offered > 0 ? used / offered : 0;
    return nest;
}

}  // namespace slabwright
