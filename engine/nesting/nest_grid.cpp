#include "engine/nesting/nest_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

/// Takes the cells that an edge passes.
void take_edge(NestGrid& grid, Point2 low, std::int64_t cell, Point2 a, Point2 b) {
    const auto column = [&](double x) { return static_cast<int>(std::floor((x - low.x) / double(cell))); };
    if (a.y > b.y) std::swap(a, b);
    const int r0 = static_cast<int>((std::int64_t{a.y} - low.y) / cell),
              r1 = static_cast<int>((std::int64_t{b.y} - low.y) / cell);
    for (int r = r0; r <= r1; ++r) {
        const double y0 = std::max<double>(a.y, double(low.y) + double(r) * double(cell)),
                     y1 = std::min<double>(b.y, double(low.y) + double(r + 1) * double(cell));
        const auto x_at = [&](double y) {
            return a.x + (double(b.x) - a.x) * (y - a.y) / (double(b.y) - a.y);
        };
        const double x0 = b.y == a.y ? a.x : x_at(y0), x1 = b.y == a.y ? b.x : x_at(y1);
        grid.take(r, column(std::min(x0, x1) - 1), column(std::max(x0, x1) + 1));
    }
}

}  // namespace

NestGrid::NestGrid(int columns, int rows)
    : columns_(columns),
      rows_(rows),
      words_(static_cast<std::size_t>((columns + 63) / 64)),
      bits_(words_ * static_cast<std::size_t>(rows), 0) {}

int NestGrid::last_taken(int row, int first, int last) const {
    const std::uint64_t* words = bits_.data() + static_cast<std::size_t>(row) * words_;
    for (int w = last / 64; w >= first / 64; --w) {
        std::uint64_t bits = words[w];
        if (w == last / 64) bits &= ~std::uint64_t{0} >> (63 - last % 64);
        if (w == first / 64) bits &= ~std::uint64_t{0} << (first % 64);
        if (bits != 0) return w * 64 + 63 - std::countl_zero(bits);
    }
    return -1;
}

void NestGrid::take(int row, int first, int last) {
    first = std::max(first, 0), last = std::min(last, columns_ - 1);
    if (row < 0 || row >= rows_ || first > last) return;
    std::uint64_t* words = bits_.data() + static_cast<std::size_t>(row) * words_;
    for (int w = first / 64; w <= last / 64; ++w) {
        std::uint64_t bits = ~std::uint64_t{0};
        if (w == last / 64) bits &= ~std::uint64_t{0} >> (63 - last % 64);
        if (w == first / 64) bits &= ~std::uint64_t{0} << (first % 64);
        words[w] |= bits;
    }
}

void NestGrid::take(const CellShape& shape, int column, int row) {
    for (const CellRun& run : shape.runs) take(row + run.row, column + run.first, column + run.last);
}

CellShape cells_of(const Loops& region, std::int64_t cell) {
    Box2 box;
    for (const Point2 p : region.points) box.grow(p);
    CellShape shape;
    shape.low = box.min;
    shape.columns = static_cast<int>((std::int64_t{box.max.x} - box.min.x) / cell) + 1;
    shape.rows = static_cast<int>((std::int64_t{box.max.y} - box.min.y) / cell) + 1;
    NestGrid grid(shape.columns, shape.rows);
    for (std::size_t i = 0; i < region.size(); ++i) {
        const auto loop = region.loop(i);
        for (std::size_t k = 0; k < loop.size(); ++k)
            take_edge(grid, box.min, cell, loop[k], loop[(k + 1) % loop.size()]);
    }
    // A cell that no edge passes is covered where the line along its lower border is.
    std::vector<double> lines;
    for (int r = 0; r < shape.rows; ++r) lines.push_back(double(box.min.y) + double(r) * double(cell) + 0.5);
    const std::vector<std::vector<Span>> spans = line_spans(region, lines);
    for (int r = 0; r < shape.rows; ++r)
        for (const Span& span : spans[static_cast<std::size_t>(r)])
            grid.take(r, static_cast<int>(std::floor((span.low - box.min.x) / double(cell))),
                      static_cast<int>(std::floor((span.high - box.min.x) / double(cell))));
    for (int r = 0; r < shape.rows; ++r)
        for (int c = 0; c < shape.columns; ++c) {
            if (grid.last_taken(r, c, c) < 0) continue;
            const bool goes_on =
                !shape.runs.empty() && shape.runs.back().row == r && shape.runs.back().last == c - 1;
            if (goes_on) shape.runs.back().last = c;
            else shape.runs.push_back({r, c, c});
        }
    return shape;
}

std::optional<CellSpot> lowest_spot(const NestGrid& taken, const CellShape& shape, int most_rows) {
    const std::size_t n = shape.runs.size();
    std::size_t in_the_way = 0;  // the run that was last in the way is asked first
    for (int row = 0; row + shape.rows <= std::min(taken.rows(), most_rows); ++row)
        for (int column = 0; column + shape.columns <= taken.columns();) {
            int next = column;
            for (std::size_t k = 0; k < n && next == column; ++k) {
                const std::size_t at = in_the_way + k < n ? in_the_way + k : in_the_way + k - n;
                const CellRun& run = shape.runs[at];
                const int hit = taken.last_taken(row + run.row, column + run.first, column + run.last);
                // At every place before the run has passed that cell, the cell is in its way.
                if (hit >= 0) next = hit - run.first + 1, in_the_way = at;
            }
            if (next == column) return CellSpot{column, row};
            column = next;
        }
    return std::nullopt;
}

}  // namespace slabwright
