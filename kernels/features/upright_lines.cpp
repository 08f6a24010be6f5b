#include "kernels/features/upright_lines.h"

#include <array>
#include <cmath>

#include "kernels/features/facet_classes.h"

namespace slabwright {

void RowCrossings::by_column(std::size_t columns) {
    ends.assign(columns + 2, 0);
    sorted.resize(found.size());
    for (const LineCrossing& c : found) ++ends[c.column + 2];
    for (std::size_t c = 2; c < ends.size(); ++c) ends[c] += ends[c - 1];
    for (const LineCrossing& c : found) sorted[ends[c.column + 1]++] = c;
}

UprightLines::UprightLines(MeshView mesh, const ColumnGrid& grid) : mesh_(mesh), grid_(grid) {
    list_facets();
}

// Facets in the order of their index, for each row that they may cross: small ones cross none.
void UprightLines::list_facets() {
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

void UprightLines::cross_row(std::size_t row, RowCrossings& of_row) const {
    of_row.found.clear();
    for (std::size_t e = starts_[row]; e < starts_[row + 1]; ++e)
        cross(entries_[e], grid_.y0 + static_cast<double>(row) * grid_.cell, of_row.found);
    of_row.by_column(grid_.columns);
}

// Corners decide by y alone and both facets of an edge compute one crossing with the row, so no column is
// counted twice or missed.
void UprightLines::cross(std::uint32_t f, double y, std::vector<LineCrossing>& crossings) const {
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

}  // namespace slabwright
