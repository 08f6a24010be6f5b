#include "kernels/features/filled_columns.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "kernels/features/facet_classes.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kColumns = 500'000;
constexpr double kFinest = 0.05;       // mm between columns
constexpr double kAtBoundary = 1e-3;   // mm: a roof this near a boundary is made by it
constexpr double kLeastHeight = 1e-3;  // mm: faces of two bodies this near are one joint
constexpr std::size_t kRows = 8;       // that one task looks at

struct Crossing {
    std::uint32_t column, facet;
    double z;
    std::int32_t turns;
};

/// What a row's columns cross: as it is found, and by column.
struct RowOfColumns {
    std::vector<Crossing> found, sorted;
    std::vector<std::uint32_t> ends;  ///< column c has [ends[c], ends[c + 1])

    void by_column(std::size_t columns) {
        ends.assign(columns + 2, 0);
        sorted.resize(found.size());
        for (const Crossing& c : found) ++ends[c.column + 2];
        for (std::size_t c = 2; c < ends.size(); ++c) ends[c] += ends[c - 1];
        for (const Crossing& c : found) sorted[ends[c.column + 1]++] = c;
    }
};

class Columns {
public:
    Columns(MeshView mesh, std::span<const double> borders, const ColumnGrid& grid)
        : mesh_(mesh), borders_(borders), grid_(grid) {
        list_facets();
    }

    /// Gaps of a row by column, and from above in each.
    void gaps(std::size_t row, RowOfColumns& of_row, std::vector<FilledGap>& found) const {
        of_row.found.clear();
        for (std::size_t e = starts_[row]; e < starts_[row + 1]; ++e)
            cross(entries_[e], grid_.y0 + static_cast<double>(row) * grid_.cell, of_row.found);
        of_row.by_column(grid_.columns);
        for (std::size_t column = 0; column < grid_.columns; ++column) {
            const auto begin = of_row.sorted.begin();
            auto c = begin + of_row.ends[column];
            const auto end = begin + of_row.ends[column + 1];
            std::sort(c, end, [](const Crossing& a, const Crossing& b) {
                return std::tie(b.z, a.facet) < std::tie(a.z, b.facet);
            });
            int winding = 0;
            for (; c != end; ++c) {
                winding += c->turns;
                if (winding != 0) continue;
                // Out of the solid, downwards: air as far as the next crossing, or below everything.
                const double floor = c + 1 == end ? borders_.front() : (c + 1)->z;
                const double roof = c->z;
                const auto layer = std::upper_bound(borders_.begin(), borders_.end(), roof) - 1;
                if (layer < borders_.begin() || layer + 1 == borders_.end()) continue;
                if (*(layer + 1) - roof <= kAtBoundary) continue;
                const double low = std::max(*layer, floor);
                if (roof - low <= kLeastHeight) continue;
                found.push_back(
                    {c->column, static_cast<std::uint32_t>(layer - borders_.begin()), c->facet, low, roof});
            }
        }
    }

private:
    // Facets in the order of their index, for each row that they may cross: small ones cross none.
    void list_facets() {
        const auto spans = [&](auto&& visit) {
            constexpr double slack = 1e-6;  // rows
            for (std::uint32_t f = 0; f < mesh_.size(); ++f) {
                const Index3 t = mesh_.facets[f];
                const auto [low, high] =
                    std::minmax({mesh_.vertices[t[0]].y, mesh_.vertices[t[1]].y, mesh_.vertices[t[2]].y});
                const double first = std::ceil((low - grid_.y0) / grid_.cell - slack),
                             last = std::floor((high - grid_.y0) / grid_.cell + slack);
                if (last < 0 || last < first || first >= static_cast<double>(grid_.rows)) continue;
                visit(f, static_cast<std::size_t>(std::max(0.0, first)),
                      std::min(grid_.rows - 1, static_cast<std::size_t>(last)));
            }
        };
        starts_.assign(grid_.rows + 1, 0);
        spans([&](std::uint32_t, std::size_t first, std::size_t last) {
            for (std::size_t r = first; r <= last; ++r) ++starts_[r + 1];
        });
        for (std::size_t r = 0; r < grid_.rows; ++r) starts_[r + 1] += starts_[r];
        entries_.resize(starts_.back());
        std::vector<std::size_t> next(starts_.begin(), starts_.end() - 1);
        spans([&](std::uint32_t f, std::size_t first, std::size_t last) {
            for (std::size_t r = first; r <= last; ++r) entries_[next[r]++] = f;
        });
    }

    // Corners decide by y alone and both facets of an edge compute one crossing with the row, so no column is
    // counted twice or missed.
    void cross(std::uint32_t f, double y, std::vector<Crossing>& crossings) const {
        std::array<double, 2> at{};
        std::array<int, 2> turn{};
        std::size_t count = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d a = to_double(mesh_.vertices[mesh_.facets[f][k]]),
                        b = to_double(mesh_.vertices[mesh_.facets[f][(k + 1) % 3]]);
            if ((a[1] <= y) == (b[1] <= y)) continue;
            const Vec3d &low = a[1] < b[1] ? a : b, &high = a[1] < b[1] ? b : a;
            at[count] = low[0] + (high[0] - low[0]) * ((y - low[1]) / (high[1] - low[1]));
            turn[count++] = a[1] < b[1] ? 1 : -1;
        }
        if (count != 2 || at[0] == at[1]) return;
        const Vec3d n = area_normal(mesh_, f);
        if (n[2] == 0) return;
        const std::size_t right = at[0] > at[1] ? 0 : 1;
        const Vec3d corner = to_double(mesh_.vertices[mesh_.facets[f][0]]);
        // Columns from the left end on, without the right one.
        const auto first = static_cast<std::int64_t>(std::ceil((at[1 - right] - grid_.x0) / grid_.cell)),
                   last = static_cast<std::int64_t>(std::ceil((at[right] - grid_.x0) / grid_.cell));
        const std::int64_t end = std::min(last, static_cast<std::int64_t>(grid_.columns));
        for (std::int64_t c = std::max<std::int64_t>(0, first); c < end; ++c) {
            const double x = grid_.x0 + static_cast<double>(c) * grid_.cell;
            const double z = corner[2] - (n[0] * (x - corner[0]) + n[1] * (y - corner[1])) / n[2];
            crossings.push_back({static_cast<std::uint32_t>(c), f, z, turn[right]});
        }
    }

    MeshView mesh_;
    std::span<const double> borders_;
    ColumnGrid grid_;
    std::vector<std::size_t> starts_;  ///< of each row in entries_
    std::vector<std::uint32_t> entries_;
};

bool holds(const std::vector<FilledGap>& row, std::uint32_t column, std::uint32_t layer) {
    const auto first = std::lower_bound(row.begin(), row.end(), column,
                                        [](const FilledGap& g, std::uint32_t c) { return g.column < c; });
    return std::any_of(first,
                       std::find_if(first, row.end(), [&](const FilledGap& g) { return g.column != column; }),
                       [&](const FilledGap& g) { return g.layer == layer; });
}

}  // namespace

double filled_cell(MeshView mesh) {
    const Box3 box = bounds(mesh);
    const double plan = (double{box.max.x} - box.min.x) * (double{box.max.y} - box.min.y);
    return std::max(kFinest, std::sqrt(plan / kColumns));
}

std::vector<std::vector<FilledGap>> filled_gaps(Context& context, MeshView mesh,
                                                std::span<const double> borders, const ColumnGrid& grid) {
    std::vector<std::vector<FilledGap>> rows(grid.rows);
    if (mesh.size() == 0 || grid.rows == 0 || borders.size() < 2) return rows;
    const MemoryCharge charge(context, mesh.size() * 16 + 4'000'000, "measuring undercuts");
    const Columns columns(mesh, borders, grid);
    parallel_for(context, rows.size(), kRows, [&](std::size_t begin, std::size_t end) {
        RowOfColumns of_row;
        for (std::size_t row = begin; row < end; ++row) columns.gaps(row, of_row, rows[row]);
    });
    return rows;
}

std::vector<FilledUnder> filled_under(Context& context, MeshView mesh, std::span<const double> borders,
                                      double cell) {
    std::vector<FilledUnder> found(mesh.size());
    if (mesh.size() == 0) return found;
    const Box3 box = bounds(context, mesh);
    const auto lines = [&](double extent) {
        return static_cast<std::size_t>(std::max(1.0, std::ceil(extent / cell)));
    };
    const ColumnGrid grid{double{box.min.x} + cell / 2, double{box.min.y} + cell / 2, cell,
                          lines(double{box.max.y} - box.min.y), lines(double{box.max.x} - box.min.x)};
    const std::vector<std::vector<FilledGap>> rows = filled_gaps(context, mesh, borders, grid);
    const std::vector<FilledGap> none;
    for (std::size_t row = 0; row < rows.size(); ++row) {
        const std::vector<FilledGap>&before = row > 0 ? rows[row - 1] : none,
              &after = row + 1 < rows.size() ? rows[row + 1] : none;
        for (const FilledGap& gap : rows[row]) {
            FilledUnder& under = found[gap.facet];
            const double height = gap.high - gap.low;
            under.volume_mm3 += height * cell * cell;
            if (height <= under.height_mm || gap.column == 0) continue;
            if (!holds(before, gap.column, gap.layer) || !holds(after, gap.column, gap.layer) ||
                !holds(rows[row], gap.column - 1, gap.layer) || !holds(rows[row], gap.column + 1, gap.layer))
                continue;
            under.height_mm = height;
            under.x = grid.x0 + gap.column * cell;
            under.y = grid.y0 + static_cast<double>(row) * cell;
            under.z = gap.high;
            under.layer = gap.layer;
        }
    }
    return found;
}

}  // namespace slabwright
