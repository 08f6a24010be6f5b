#include "engine/schedule/nested_boards.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/nesting/nesting.h"
#include "kernels/geometry/units.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/context.h"

namespace slabwright {

namespace {

constexpr double kSame = 1e-6;           // mm
constexpr int kTries = 16;               // orders, of which the first four are by size
constexpr double kCellsOnBoard = 10000;  // at most, along its longer side
/// What a rectangle is made smaller by all around, so that one of whole cells does not touch the next cell.
constexpr double kLess = 5e-4;  // mm

/// Of a board, mm between grid lines: whole millimetres, as slabs are sawn.
double cell_of(const SawnSize& board, double kerf) {
    return std::max(1.0, std::ceil((std::max(board.length, board.width) + kerf) / kCellsOnBoard));
}

/// Where lines of free places begin and end: the board's edges and those of what is taken.
std::vector<double> lines_of(double size, std::vector<double> lines) {
    lines.push_back(0);
    lines.push_back(size);
    for (double& line : lines) line = std::clamp(line, 0.0, size);
    std::sort(lines.begin(), lines.end());
    lines.erase(
        std::unique(lines.begin(), lines.end(), [](double a, double b) { return std::abs(a - b) < kSame; }),
        lines.end());
    return lines;
}

/// The largest rectangle of a board that is clear of what is taken; of equal ones that which ends lowest. A
/// histogram of free heights goes down the board's lines, whose largest rectangles end where a
/// lower height follows.
SawnRectangle largest_free(const SawnSize& board, const std::vector<SawnRectangle>& taken) {
    std::vector<double> across, up;
    for (const SawnRectangle& r : taken) {
        across.insert(across.end(), {r.x, r.x + r.length});
        up.insert(up.end(), {r.y, r.y + r.width});
    }
    across = lines_of(board.length, std::move(across));
    up = lines_of(board.width, std::move(up));
    std::vector<double> from(across.size() - 1, 0.0);  // of each column: where its free height begins
    SawnRectangle best;
    for (std::size_t row = 0; row + 1 < up.size(); ++row) {
        const double middle = (up[row] + up[row + 1]) / 2, top = up[row + 1];
        for (const SawnRectangle& r : taken) {
            if (middle < r.y || middle > r.y + r.width) continue;
            for (std::size_t c = 0; c + 1 < across.size(); ++c) {
                const double x = (across[c] + across[c + 1]) / 2;
                if (x > r.x && x < r.x + r.length) from[c] = top;
            }
        }
        std::vector<std::pair<std::size_t, double>> open;  // first column and beginning, ever higher
        for (std::size_t c = 0; c <= from.size(); ++c) {
            const double begin = c < from.size() ? from[c] : top;
            std::size_t first = c;
            while (!open.empty() && open.back().second <= begin) {
                first = open.back().first;
                const SawnRectangle free{across[first], open.back().second, across[c] - across[first],
                                         top - open.back().second};
                if (free.mm2() > best.mm2() + kSame) best = free;
                open.pop_back();
            }
            open.emplace_back(first, begin);
        }
    }
    return best;
}

/// With the kerf around it.
SawnRectangle grown(const SawnRectangle& r, double kerf) {
    return {r.x - kerf, r.y - kerf, r.length + 2 * kerf, r.width + 2 * kerf};
}

void find_offcuts(SawnBoard& board, const SawnSize& size, double kerf) {
    std::vector<SawnRectangle> taken;
    for (const SawnPiece& piece : board.pieces) taken.push_back(grown(piece.place, kerf));
    board.offcuts.clear();
    for (;;) {
        const SawnRectangle free = largest_free(size, taken);
        if (std::min(free.length, free.width) < kLeastOffcut) return;
        board.offcuts.push_back(free);
        taken.push_back(grown(free, kerf));
    }
}

/// By the nester; none where a piece fills a board so far that it does not lie on whole cells of it.
std::vector<SawnBoard> nested(std::span<const SawnSize> pieces, const SawnSize& board, double kerf) {
    const double cell = cell_of(board, kerf);
    // A kerf lies right of each piece and above it; that of the last may lie past the board.
    const StockSheet sheet{board.length + kerf, board.width + kerf};
    const auto cells = [&](double mm) { return std::ceil((mm + kerf) / cell - kSame); };
    const double columns = std::floor(sheet.length / cell), rows = std::floor(sheet.width / cell);
    std::vector<Loops> loops;
    for (const SawnSize& s : pieces) {
        const double l = cells(s.length), w = cells(s.width);
        if (!(l <= columns && w <= rows) && !(w <= columns && l <= rows)) return {};
        const std::int32_t low = to_units(kLess), right = to_units(s.length + kerf - kLess),
                           high = to_units(s.width + kerf - kLess);
        Loops& loop = loops.emplace_back();
        loop.points = {{low, low}, {right, low}, {right, high}, {low, high}};
        loop.close_loop();
    }
    NestRules rules;
    rules.spacing = rules.margin = 0;
    rules.turns = {0, 90};
    rules.cell = cell;
    rules.tries = kTries;
    Context context({.threads = 1});
    const Nest nest = nest_pieces(context, loops, sheet, {}, rules);
    std::vector<SawnBoard> boards(nest.stock.size());
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const NestPlace& place = nest.places[i];
        const bool is_turned = place.turn == 90;
        double x = kUnbounded, y = kUnbounded;
        for (const Point2 p : placed(loops[i], place).points)
            x = std::min(x, to_mm(p.x)), y = std::min(y, to_mm(p.y));
        const auto on_line = [&](double mm) { return std::round(mm / cell) * cell; };
        boards[static_cast<std::size_t>(place.stock)].pieces.push_back(
            {i,
             {on_line(x), on_line(y), is_turned ? pieces[i].width : pieces[i].length,
              is_turned ? pieces[i].length : pieces[i].width},
             is_turned});
    }
    return boards;
}

/// Less is better.
std::pair<std::size_t, double> rank_of(const std::vector<SawnBoard>& boards) {
    double largest = 0;
    for (const SawnBoard& board : boards)
        if (!board.offcuts.empty()) largest = std::max(largest, board.offcuts.front().mm2());
    return {boards.size(), -largest};
}

}  // namespace

std::vector<SawnBoard> nest_on_boards(std::span<const SawnSize> pieces, const SawnSize& board, double kerf) {
    std::vector<SawnBoard> sawn = lay_on_boards(pieces, board, kerf);
    if (sawn.empty()) return {};
    std::vector<SawnBoard> milled = nested(pieces, board, kerf);
    for (std::vector<SawnBoard>* boards : {&sawn, &milled})
        for (SawnBoard& b : *boards) {
            b.cuts.clear();
            find_offcuts(b, board, kerf);
        }
    return milled.empty() || rank_of(sawn) <= rank_of(milled) ? sawn : milled;
}

}  // namespace slabwright
