#include "kernels/features/filled_columns.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "kernels/errors.h"
#include "kernels/features/upright_lines.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kColumns = 500'000;
constexpr double kFinest = 0.05;       // mm between columns
constexpr double kAtBoundary = 1e-3;   // mm: a roof this near a boundary is made by it
constexpr double kLeastHeight = 1e-3;  // mm: faces of two bodies this near are one joint
constexpr std::size_t kRows = 8;       // that one task looks at

/// The part of air under solid that stays filled, if any does.
void keep_filled(const AirUnder& air, std::span<const double> borders, std::vector<FilledGap>& found) {
    const double floor = air.has_floor ? air.floor : borders.front();
    const auto layer = std::upper_bound(borders.begin(), borders.end(), air.roof) - 1;
    if (layer < borders.begin() || layer + 1 == borders.end()) return;
    if (*(layer + 1) - air.roof <= kAtBoundary) return;
    const double low = std::max(*layer, floor);
    if (air.roof - low <= kLeastHeight) return;
    found.push_back(
        {air.column, static_cast<std::uint32_t>(layer - borders.begin()), air.facet, low, air.roof});
}

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
    const UprightLines lines(mesh, grid);
    parallel_for(context, rows.size(), kRows, [&](std::size_t begin, std::size_t end) {
        RowCrossings scratch;
        for (std::size_t row = begin; row < end; ++row)
            lines.air_under(row, scratch, [&](const AirUnder& air) { keep_filled(air, borders, rows[row]); });
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

std::vector<double> layer_borders(double bottom, std::span<const double> layer_tops) {
    std::vector<double> borders{bottom};
    for (const double top : layer_tops) {
        if (!std::isfinite(top) || top <= borders.back())
            throw Error(ErrorKind::usage, "features.layer_tops",
                        "layer tops do not ascend from the mesh's bottom", std::to_string(top) + " mm");
        borders.push_back(top);
    }
    if (borders.size() == 1) borders.push_back(HUGE_VAL);
    borders.back() = HUGE_VAL;
    return borders;
}

}  // namespace slabwright
