#include "kernels/cutting/level_contours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// Crossings of the border with grid edges. On row j (a fibre along x) the crossing with cell column i lies
// between the nodes (i, j) and (i + 1, j); on column i it lies between (i, j) and (i, j + 1).
struct EdgeCrossing {
    std::uint32_t cell = 0;  // i on a row, j on a column
    std::int32_t at = 0;     // along the fibre, 0.1 µm
    float nz = 0;
    bool low_is_solid = false;  // the node at the lower coordinate is forbidden
    bool visited = false;
};

struct Lines {
    std::vector<std::uint32_t> starts{0};
    std::vector<EdgeCrossing> crossings;

    EdgeCrossing* find(std::size_t line, std::uint32_t cell) {
        auto first = crossings.begin() + starts[line], last = crossings.begin() + starts[line + 1];
        auto it = std::lower_bound(first, last, cell,
                                   [](const EdgeCrossing& c, std::uint32_t v) { return c.cell < v; });
        return it != last && it->cell == cell ? &*it : nullptr;
    }
};

// Which nodes of a fibre are forbidden, as sorted half-open index ranges [first, last).
struct NodeRange {
    std::uint32_t first, last;
};

// The node test is done on the fibres along x alone, so that both families agree on it.
std::vector<NodeRange> forbidden_nodes(std::span<const Forbidden> intervals,
                                       std::span<const std::int32_t> nodes) {
    std::vector<NodeRange> ranges;
    for (const Forbidden& f : intervals) {
        const auto first = std::upper_bound(nodes.begin(), nodes.end(), f.low * kUnitsPerMm,
                                            [](double v, std::int32_t n) { return v < n; });
        const auto last = std::lower_bound(first, nodes.end(), f.high * kUnitsPerMm,
                                           [](std::int32_t n, double v) { return n < v; });
        if (first == last) continue;
        const NodeRange r{static_cast<std::uint32_t>(first - nodes.begin()),
                          static_cast<std::uint32_t>(last - nodes.begin())};
        if (!ranges.empty() && ranges.back().last >= r.first)
            ranges.back().last = std::max(ranges.back().last, r.last);
        else ranges.push_back(r);
    }
    return ranges;
}

bool contains(const std::vector<NodeRange>& ranges, std::uint32_t node) {
    auto it = std::upper_bound(ranges.begin(), ranges.end(), node,
                               [](std::uint32_t v, const NodeRange& r) { return v < r.first; });
    return it != ranges.begin() && node < std::prev(it)->last;
}

// The end of the forbidden stretch between a free and a forbidden node, as seen from the free one. Where a
// wall touches a grid line exactly, the two families may differ by rounding about the node on it: the end
// then lies on the node.
EdgeCrossing crossing_between(std::span<const Forbidden> intervals, std::int32_t low, std::int32_t high,
                              bool low_is_solid) {
    constexpr double rounding = 1e-5;  // mm
    EdgeCrossing c;
    c.low_is_solid = low_is_solid;
    const double a = low / kUnitsPerMm, b = high / kUnitsPerMm;
    if (low_is_solid) {  // free end above: the highest interval end in [a, b]
        c.at = high;
        auto it = std::upper_bound(intervals.begin(), intervals.end(), b,
                                   [](double v, const Forbidden& f) { return v < f.high; });
        if (it != intervals.begin() && std::prev(it)->high > a - rounding) {
            c.at = std::max(low, to_units(std::prev(it)->high));
            c.nz = std::prev(it)->nz_high;
        }
    } else {  // free end below: the lowest interval start in [a, b]
        c.at = low;
        auto it = std::lower_bound(intervals.begin(), intervals.end(), a,
                                   [](const Forbidden& f, double v) { return f.low < v; });
        if (it != intervals.end() && it->low < b + rounding) {
            c.at = std::min(high, to_units(it->low));
            c.nz = it->nz_low;
        }
    }
    return c;
}

}  // namespace

FibreGrid fibre_grid(const LayerSolid& solid, const CutterShape& cutter, std::int32_t pitch) {
    FibreGrid grid;
    grid.pitch = pitch;
    auto lines = [&](int k) {
        std::vector<std::int32_t> v;
        if (solid.min[k] > solid.max[k]) return v;
        const double reach = cutter.radius * kUnitsPerMm;
        const auto first =
            static_cast<std::int64_t>(std::floor((solid.min[k] * kUnitsPerMm - reach) / pitch)) - 1;
        const auto last =
            static_cast<std::int64_t>(std::ceil((solid.max[k] * kUnitsPerMm + reach) / pitch)) + 1;
        for (std::int64_t i = first; i <= last; ++i) v.push_back(static_cast<std::int32_t>(i * pitch));
        return v;
    };
    grid.x = lines(0);
    grid.y = lines(1);
    return grid;
}

namespace {

// The border between what is forbidden along the fibres and what is free.
// Links the crossings of a border with the grid's lines.
class Linker {
public:
    Linker(const Fibres& along_x, const Fibres& along_y, const FibreGrid& grid, double tip_z)
        : along_x_(along_x),
          along_y_(along_y),
          grid_(grid),
          tip_z_(tip_z),
          columns_(grid.x.size()),
          rows_(grid.y.size()),
          node_rows_(rows_) {
        for (std::size_t j = 0; j < rows_; ++j) node_rows_[j] = forbidden_nodes(along_x.line(j), grid.x);
    }

    Contours run() {
        check_closed();
        cross_rows();
        cross_columns();
        for (std::size_t j = 0; j < rows_; ++j)
            for (std::uint32_t k = on_rows_.starts[j]; k < on_rows_.starts[j + 1]; ++k)
                if (!on_rows_.crossings[k].visited) trace(true, j, &on_rows_.crossings[k]);
        for (std::size_t i = 0; i < columns_; ++i)
            for (std::uint32_t k = on_columns_.starts[i]; k < on_columns_.starts[i + 1]; ++k)
                if (!on_columns_.crossings[k].visited) trace(false, i, &on_columns_.crossings[k]);
        return std::move(contours_);
    }

private:
    // The border is followed from cell to cell, so it has to close within the grid.
    void check_closed() const {
        for (std::size_t j = 0; j < rows_; ++j) {
            const std::vector<NodeRange>& r = node_rows_[j];
            if (!r.empty() && (j == 0 || j + 1 == rows_ || r.front().first == 0 || r.back().last == columns_))
                throw Error(ErrorKind::no_plan, "contours.open",
                            "what a cutter must keep out of reaches past the layer's facets",
                            "y " + std::to_string(grid_.y[j] / 10000) + " mm, tip " +
                                std::to_string(static_cast<long>(tip_z_)) + " mm",
                            "check the mesh with slabwright inspect, and report this");
        }
    }

    void cross_rows() {
        for (std::size_t j = 0; j < rows_; ++j) {
            for (const NodeRange& r : node_rows_[j]) {
                auto add = [&](std::uint32_t cell, bool low_is_solid) {
                    EdgeCrossing c =
                        crossing_between(along_x_.line(j), grid_.x[cell], grid_.x[cell + 1], low_is_solid);
                    c.cell = cell;
                    on_rows_.crossings.push_back(c);
                };
                if (r.first > 0) add(r.first - 1, false);
                if (r.last < columns_) add(r.last - 1, true);
            }
            on_rows_.starts.push_back(static_cast<std::uint32_t>(on_rows_.crossings.size()));
        }
    }

    // Between two rows the border crosses every column whose node is in one row's ranges but not in the
    // other's.
    void cross_columns() {
        std::vector<std::vector<std::uint32_t>> cells_of_column(columns_);
        for (std::size_t j = 0; j + 1 < rows_; ++j) {
            const auto &a = node_rows_[j], &b = node_rows_[j + 1];
            std::vector<std::uint32_t> cuts;
            for (const NodeRange& r : a) cuts.insert(cuts.end(), {r.first, r.last});
            for (const NodeRange& r : b) cuts.insert(cuts.end(), {r.first, r.last});
            std::sort(cuts.begin(), cuts.end());
            for (std::size_t k = 0; k + 1 < cuts.size(); ++k)
                if (cuts[k] != cuts[k + 1] && contains(a, cuts[k]) != contains(b, cuts[k]))
                    for (std::uint32_t i = cuts[k]; i < cuts[k + 1]; ++i)
                        cells_of_column[i].push_back(static_cast<std::uint32_t>(j));
        }
        for (std::size_t i = 0; i < columns_; ++i) {
            for (const std::uint32_t j : cells_of_column[i]) {
                const bool low_is_solid = contains(node_rows_[j], static_cast<std::uint32_t>(i));
                EdgeCrossing c = crossing_between(along_y_.line(i), grid_.y[j], grid_.y[j + 1], low_is_solid);
                c.cell = j;
                on_columns_.crossings.push_back(c);
            }
            on_columns_.starts.push_back(static_cast<std::uint32_t>(on_columns_.crossings.size()));
        }
    }

    // Follows the border with the solid on the right.
    void trace(bool on_row, std::size_t line, EdgeCrossing* start) {
        EdgeCrossing* c = start;
        while (!c->visited) {
            c->visited = true;
            const std::int32_t fixed = on_row ? grid_.y[line] : grid_.x[line];
            contours_.points.push_back(on_row ? Point2{c->at, fixed} : Point2{fixed, c->at});
            contours_.nz.push_back(c->nz);
            EdgeCrossing* next = next_of(*c, on_row, line);
            if (!next) break;  // cannot happen on a grid_ that encloses the solid
            c = next;
        }
        contours_.starts.push_back(static_cast<std::uint32_t>(contours_.points.size()));
    }

    // In a cell, the exit is the edge next to the entry around the free corner that both share, so that in a
    // doubtful cell (solid corners on one diagonal) the solid stays connected. Moves on `on_row` and `line`.
    EdgeCrossing* next_of(const EdgeCrossing& c, bool& on_row, std::size_t& line) {
        // The cell (i, j) ahead, and the free corner beside this crossing.
        std::uint32_t i, j;
        bool free_is_east, free_is_north;
        if (on_row) {  // solid in the west: heading south; in the east: north
            i = c.cell;
            j = static_cast<std::uint32_t>(line);
            free_is_east = c.low_is_solid;
            free_is_north = c.low_is_solid;  // heading south, the row is the next cell's northern edge
            if (c.low_is_solid) --j;
        } else {  // solid in the south: heading east; in the north: west
            i = static_cast<std::uint32_t>(line);
            j = c.cell;
            free_is_north = c.low_is_solid;
            free_is_east = !c.low_is_solid;  // heading east, the column is the next cell's western edge
            if (!c.low_is_solid) --i;
        }
        // Turning around the free corner first (a left turn), then straight on, then around the solid
        // corner.
        const std::uint32_t near_row = free_is_north ? j + 1 : j, far_row = free_is_north ? j : j + 1;
        const std::uint32_t near_column = free_is_east ? i + 1 : i, far_column = free_is_east ? i : i + 1;
        EdgeCrossing* next = nullptr;
        if (on_row) {
            if ((next = on_columns_.find(near_column, j))) on_row = false, line = near_column;
            else if ((next = on_rows_.find(far_row, i))) line = far_row;
            else if ((next = on_columns_.find(far_column, j))) on_row = false, line = far_column;
        } else {
            if ((next = on_rows_.find(near_row, i))) on_row = true, line = near_row;
            else if ((next = on_columns_.find(far_column, j))) line = far_column;
            else if ((next = on_rows_.find(far_row, i))) on_row = true, line = far_row;
        }
        return next;
    }

    const Fibres &along_x_, &along_y_;
    const FibreGrid& grid_;
    const double tip_z_;
    const std::size_t columns_, rows_;
    std::vector<std::vector<NodeRange>> node_rows_;
    Lines on_rows_, on_columns_;
    Contours contours_;
};

}  // namespace

std::vector<Contours> level_contours(Context& context, const LayerSolid& solid,
                                     std::span<const FibreLevel> levels, const CutterShape& cutter,
                                     const FibreGrid& grid) {
    std::vector<Contours> contours(levels.size());
    if (grid.x.size() < 2 || grid.y.size() < 2) return contours;
    std::vector<Fibres> along_x = fibres(context, solid, levels, cutter, Axis::x, grid.y),
                        along_y = fibres(context, solid, levels, cutter, Axis::y, grid.x);
    parallel_each(context, levels.size(), [&](std::size_t i) {
        contours[i] = Linker(along_x[i], along_y[i], grid, levels[i].tip_z).run();
        along_x[i] = along_y[i] = {};
    });
    return contours;
}

Contours level_contours(Context& context, const LayerSolid& solid, const Loops& inside,
                        const CutterShape& cutter, double tip_z, const FibreGrid& grid) {
    const FibreLevel level{tip_z, &inside};
    return std::move(level_contours(context, solid, {&level, 1}, cutter, grid).front());
}

}  // namespace slabwright
