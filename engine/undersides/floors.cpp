#include "engine/undersides/floors.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "kernels/mesh/facet_roles.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kPlate = 6 * 0.51;          // σ·t²/F
constexpr double kHeld = 2, kOverhangs = 3;  // σ/p·(t/a)²
constexpr double kStub = 3;                  // thicknesses
constexpr double kThinnest = 0.05;           // mm: thinner is where two surfaces meet

constexpr double kLid = 1;        // mm over the part
constexpr double kNowhere = 1e5;  // cells: nothing carries it

/// The part under a lid: the air between them tells where the part ends.
Mesh with_lid(Context& context, MeshView mesh, double top) {
    Mesh lidded;
    lidded.vertices.assign(mesh.vertices.begin(), mesh.vertices.end());
    lidded.facets.assign(mesh.facets.begin(), mesh.facets.end());
    const Box3 box = bounds(context, mesh);
    const auto first = static_cast<std::uint32_t>(lidded.vertices.size());
    for (const double z : {top + kLid, top + 2 * kLid})
        for (const auto& [x, y] : {std::array{box.min.x, box.min.y},
                                   {box.max.x, box.min.y},
                                   {box.max.x, box.max.y},
                                   {box.min.x, box.max.y}})
            lidded.vertices.push_back({x, y, static_cast<float>(z)});
    for (const auto& [a, b, c, d] : std::array<std::array<std::uint32_t, 4>, 6>{
             {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}}) {
        lidded.facets.push_back({first + a, first + b, first + c});
        lidded.facets.push_back({first + a, first + c, first + d});
    }
    return lidded;
}

/// Squares of distances to the nearest cell that is set, in cells: rows first, then columns of those.
class CellDistances {
public:
    CellDistances(Context& context, const std::vector<std::vector<std::uint8_t>>& cells, std::uint8_t kind)
        : rows_(cells.size(), std::vector<float>(cells.empty() ? 0 : cells[0].size())) {
        const std::size_t columns = cells.empty() ? 0 : cells[0].size();
        constexpr float kFar = 1e6F;
        parallel_each(context, cells.size(), [&](std::size_t r) {
            std::vector<float>& row = rows_[r];
            float last = kFar;
            for (std::size_t c = 0; c < columns; ++c) row[c] = last = cells[r][c] == kind ? 0 : last + 1;
            last = kFar;
            for (std::size_t c = columns; c-- > 0;)
                row[c] = std::min(row[c], last = cells[r][c] == kind ? 0 : last + 1);
        });
        parallel_each(context, columns, [&](std::size_t c) { down(c); });
    }
    /// Cells to the nearest.
    [[nodiscard]] double at(std::size_t row, std::size_t column) const {
        return std::sqrt(rows_[row][column]);
    }

private:
    // The lower envelope of the parabolas that stand over a column's rows (Felzenszwalb and Huttenlocher
    // 2012).
    void down(std::size_t c) {
        const std::size_t n = rows_.size();
        std::vector<double> f(n), from(n + 1);
        std::vector<std::size_t> at(n);
        for (std::size_t r = 0; r < n; ++r) f[r] = std::pow(double{rows_[r][c]}, 2);
        std::size_t k = 0;
        from[0] = -kUnbounded;
        const auto meet = [&](std::size_t p, std::size_t q) {
            const double x = static_cast<double>(p), y = static_cast<double>(q);
            return (f[q] + y * y - f[p] - x * x) / (2 * (y - x));
        };
        for (std::size_t q = 1; q < n; ++q) {
            double s = meet(at[k], q);
            while (k > 0 && s <= from[k]) s = meet(at[--k], q);
            at[++k] = q;
            from[k] = s;
        }
        const std::size_t last = k;
        k = 0;
        for (std::size_t q = 0; q < n; ++q) {
            while (k < last && from[k + 1] < static_cast<double>(q)) ++k;
            const double apart = static_cast<double>(q) - static_cast<double>(at[k]);
            rows_[q][c] = static_cast<float>(apart * apart + f[at[k]]);
        }
    }
    std::vector<std::vector<float>> rows_;
};

constexpr std::uint8_t kAir = 0, kCarries = 1, kFloor = 2;

bool is_worse(const LoadedFloor& a, const LoadedFloor& b) {
    if (b.thickness_mm == 0 || a.stress_mpa() != b.stress_mpa())
        return b.thickness_mm == 0 || a.stress_mpa() > b.stress_mpa();
    return a.thickness_mm < b.thickness_mm;
}

struct FloorCell {
    float roof = 0, thickness = 0;  // mm
    bool glued = false;             // the next slab lies on it
};

}  // namespace

FloorMap::FloorMap(Context& context, MeshView pattern, const AirGaps& gaps) : gaps_(gaps) {
    tops_.assign(gaps.grid.rows, std::vector<double>(gaps.grid.columns, -kUnbounded));
    const AirGaps lidded = air_gaps(context, with_lid(context, pattern, gaps.top).view(), gaps.grid.cell);
    for (std::size_t r = 0; r < std::min(lidded.rows.size(), tops_.size()); ++r)
        for (const AirGap& gap : lidded.rows[r])
            if (gap.has_floor && gap.high > gaps.top + kLid / 2 && gap.column < tops_[r].size())
                tops_[r][gap.column] = gap.low;
}

double FloorMap::top_of(std::size_t row, std::uint32_t column) const { return tops_[row][column]; }

std::optional<LoadedFloor> FloorMap::weakest(Context& context, const MilledLayer& layer, double bottom,
                                             const FloorLoads& loads) const {
    const ColumnGrid& grid = gaps_.grid;
    std::vector<std::vector<std::uint8_t>> kinds(grid.rows, std::vector<std::uint8_t>(grid.columns, kAir));
    std::vector<std::vector<FloorCell>> floors(grid.rows);
    parallel_each(context, grid.rows, [&](std::size_t r) {
        // What stands at the layer's bottom carries, but where a gap is open there.
        for (std::uint32_t c = 0; c < grid.columns; ++c)
            if (top_of(r, c) > bottom + kLeastGap) kinds[r][c] = kCarries;
        floors[r].resize(grid.columns);
        double over = 0;  // where the solid over the gap ends
        std::uint32_t column = UINT32_MAX;
        for (const AirGap& gap : gaps_.rows[r]) {
            if (gap.column != column) column = gap.column, over = top_of(r, column);
            const double solid_top = std::exchange(over, gap.low);
            if (gap.low > bottom + kLeastGap || gap.high <= bottom + kLeastGap) continue;
            kinds[r][column] = kAir;
            if (gap.high >= layer.top - kThinnest) continue;
            const double top = std::min(solid_top, layer.top);
            kinds[r][column] = kFloor;
            floors[r][column] = {static_cast<float>(gap.high), static_cast<float>(top - gap.high),
                                 solid_top > layer.top + kLeastGap};
        }
    });
    const CellDistances carried(context, kinds, kCarries), open(context, kinds, kAir);
    std::vector<LoadedFloor> found(grid.rows);
    parallel_each(context, grid.rows, [&](std::size_t r) {
        for (std::size_t c = 1; r > 0 && r + 1 < grid.rows && c + 1 < grid.columns; ++c) {
            const std::array<std::uint8_t, 5> cross{kinds[r][c], kinds[r - 1][c], kinds[r + 1][c],
                                                    kinds[r][c - 1], kinds[r][c + 1]};
            if (std::any_of(cross.begin(), cross.end(), [](std::uint8_t k) { return k != kFloor; })) continue;
            const FloorCell& cell = floors[r][c];
            const double t = cell.thickness, a = carried.at(r, c) * grid.cell;
            if (t < kThinnest || a < kStub * t || carried.at(r, c) > kNowhere) continue;
            LoadedFloor floor{t,
                              a,
                              {grid.x0 + static_cast<double>(c) * grid.cell,
                               grid.y0 + static_cast<double>(r) * grid.cell, cell.roof}};
            floor.push_mpa = kPlate * loads.push_n / (t * t);
            // Beyond the lines there is air.
            const std::size_t edge = std::min({r, grid.rows - 1 - r, c, grid.columns - 1 - c}) + 1;
            const double air = std::min(open.at(r, c), static_cast<double>(edge)) * grid.cell;
            const double held = air < a ? kOverhangs : kHeld;
            if (cell.glued) floor.press_mpa = held * loads.pressure_mpa * (a / t) * (a / t);
            if (is_worse(floor, found[r])) found[r] = floor;
        }
    });
    LoadedFloor worst;
    for (const LoadedFloor& floor : found)
        if (floor.thickness_mm > 0 && is_worse(floor, worst)) worst = floor;
    return worst.thickness_mm > 0 ? std::optional(worst) : std::nullopt;
}

Diagnostic weak_floor(int layer, const LoadedFloor& floor, const FloorLoads& loads, double strength_mpa) {
    const bool pressed = floor.press_mpa > floor.push_mpa;
    return {Severity::warning, "floor.weak",
            fmt::format(
                "layer {}: a floor {:.1f} mm thick reaches {:.1f} mm over what is milled from below, where "
                "{}: {:.0f} MPa, more than the wood's {:.0f} MPa; {}",
                layer, floor.thickness_mm, floor.reach_mm,
                pressed ? fmt::format("the press lays the next slab with {:.2f} MPa", loads.pressure_mpa)
                        : fmt::format("{:.0f} N push at it", loads.push_n),
                floor.stress_mpa(), strength_mpa,
                pressed ? "press that slab with less force (bonding.press_force), or lay wood under it"
                        : "cut it with a smaller tool or stepdown, or lay wood under it"),
            floor.at};
}

}  // namespace slabwright
