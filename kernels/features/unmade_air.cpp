#include "kernels/features/unmade_air.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>

#include "kernels/errors.h"
#include "kernels/features/upright_lines.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kRows = 8;  // that one task looks at

/// A gap's part that stays filled.
struct Kept {
    std::uint32_t column = 0, layer = 0;
    double low = 0, high = 0;
    [[nodiscard]] double height() const { return high - low; }
};

// @param layers between the borders; @param y of the line
bool is_kept(const AirGap& gap, std::span<const double> borders, std::span<const MilledLayer> layers,
             double y, Kept& kept) {
    const auto above = std::upper_bound(borders.begin(), borders.end(), gap.high);
    if (above == borders.begin() || above == borders.end() || *above - gap.high <= kLeastGap) return false;
    double bottom = *(above - 1);
    const auto at = static_cast<std::size_t>(above - borders.begin() - 1);
    const MilledLayer layer = at < layers.size() ? layers[at] : MilledLayer{};
    if (layer.milled == MilledFrom::both_sides && (!gap.has_floor || bottom >= gap.low - kLeastGap))
        bottom = layer.web > 0 ? std::max(bottom, layer.top - layer.web_at(y)) : HUGE_VAL;
    kept = {gap.column, static_cast<std::uint32_t>(above - borders.begin() - 1), std::max(bottom, gap.low),
            gap.high};
    return kept.height() > kLeastGap;
}

/// All rows' kept gaps one after the other, and which of them hang together.
class Pockets {
public:
    Pockets(const std::vector<std::vector<Kept>>& rows) : rows_(rows), starts_(rows.size() + 1, 0) {
        for (std::size_t r = 0; r < rows.size(); ++r) starts_[r + 1] = starts_[r] + rows[r].size();
        parent_.resize(starts_.back());
        std::iota(parent_.begin(), parent_.end(), std::size_t{0});
        neighbours_.assign(parent_.size(), 0);
        for (std::size_t r = 0; r < rows.size(); ++r) {
            join(r, r, 1);
            if (r + 1 < rows.size()) join(r, r + 1, 0);
        }
    }

    [[nodiscard]] std::vector<UnmadePocket> list(const ColumnGrid& grid) {
        std::vector<UnmadePocket> found;
        std::vector<std::size_t> of(parent_.size(), parent_.size());
        for (std::size_t r = 0; r < rows_.size(); ++r)
            for (std::size_t k = 0; k < rows_[r].size(); ++k) {
                const std::size_t root = root_of(starts_[r] + k);
                if (of[root] == parent_.size()) {
                    of[root] = found.size();
                    found.emplace_back();
                }
                const Kept& kept = rows_[r][k];
                UnmadePocket& pocket = found[of[root]];
                pocket.layer = kept.layer;
                pocket.volume_mm3 += kept.height() * grid.cell * grid.cell;
                if (neighbours_[starts_[r] + k] != kAllSides || kept.height() <= pocket.height_mm) continue;
                pocket.height_mm = kept.height();
                pocket.at = {grid.x0 + kept.column * grid.cell, grid.y0 + static_cast<double>(r) * grid.cell,
                             (kept.low + kept.high) / 2};
            }
        std::erase_if(found, [](const UnmadePocket& p) { return p.height_mm == 0; });
        std::stable_sort(found.begin(), found.end(), [](const UnmadePocket& a, const UnmadePocket& b) {
            return a.volume_mm3 > b.volume_mm3;
        });
        return found;
    }

private:
    static constexpr std::uint8_t kLeft = 1, kRight = 2, kFront = 4, kBack = 8, kAllSides = 15;

    std::size_t root_of(std::size_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }

    // Joins gaps of row `a` with those of row `b` that are `step` columns on, where they overlap in height.
    void join(std::size_t a, std::size_t b, std::uint32_t step) {
        auto j = rows_[b].begin();
        for (std::size_t i = 0; i < rows_[a].size(); ++i) {
            const Kept& one = rows_[a][i];
            while (j != rows_[b].end() && j->column < one.column + step) ++j;
            for (auto k = j; k != rows_[b].end() && k->column == one.column + step; ++k) {
                if (k->layer != one.layer || std::min(k->high, one.high) <= std::max(k->low, one.low))
                    continue;
                const std::size_t p = starts_[a] + i,
                                  q = starts_[b] + static_cast<std::size_t>(k - rows_[b].begin());
                neighbours_[p] |= step != 0 ? kRight : kBack;
                neighbours_[q] |= step != 0 ? kLeft : kFront;
                const std::size_t u = root_of(p), v = root_of(q);
                parent_[std::max(u, v)] = std::min(u, v);
            }
        }
    }

    const std::vector<std::vector<Kept>>& rows_;
    std::vector<std::size_t> starts_, parent_;
    std::vector<std::uint8_t> neighbours_;  ///< on which sides one hangs together with another
};

}  // namespace

double MilledLayer::web_at(double y) const {
    if (!(strip_pitch > 0)) return web;
    const double turns = (y - front) / strip_pitch, beside = std::abs(turns - std::floor(turns) - 0.5);
    return beside * strip_pitch <= strip_width / 2 ? web : film;
}

AirGaps air_gaps(Context& context, MeshView mesh, double cell) {
    AirGaps gaps;
    const Box3 box = bounds(context, mesh);
    const auto lines = [&](double extent) {
        return static_cast<std::size_t>(std::max(1.0, std::ceil(extent / cell)));
    };
    if (mesh.size() == 0) return gaps;
    gaps.bottom = box.min.z;
    gaps.top = box.max.z;
    gaps.grid = {double{box.min.x} + cell / 2, double{box.min.y} + cell / 2, cell,
                 lines(double{box.max.y} - box.min.y), lines(double{box.max.x} - box.min.x)};
    gaps.rows.resize(gaps.grid.rows);
    const MemoryCharge charge(context, mesh.size() * 16 + 4'000'000, "looking for undercuts");
    const UprightLines grid(mesh, gaps.grid);
    parallel_for(context, gaps.rows.size(), kRows, [&](std::size_t begin, std::size_t end) {
        RowCrossings scratch;
        for (std::size_t row = begin; row < end; ++row)
            grid.air_under(row, scratch, [&](const AirUnder& air) {
                const double low = air.has_floor ? air.floor : gaps.bottom;
                if (air.roof - low > kLeastGap)
                    gaps.rows[row].push_back({air.column, air.facet, low, air.roof, air.has_floor});
            });
    });
    std::size_t count = 0;
    for (const std::vector<AirGap>& row : gaps.rows) count += row.size();
    gaps.charge = std::make_shared<MemoryCharge>(context, count * sizeof(AirGap), "looking for undercuts");
    return gaps;
}

UnmadeAir unmade_air(Context& context, const AirGaps& gaps, std::span<const double> layer_tops,
                     MilledFrom milled) {
    std::vector<MilledLayer> layers;
    for (const double top : layer_tops) layers.push_back({top, milled, 0});
    return unmade_air(context, gaps, layers);
}

UnmadeAir unmade_air(Context& context, const AirGaps& gaps, std::span<const MilledLayer> layers) {
    std::vector<double> layer_tops;
    for (const MilledLayer& layer : layers) layer_tops.push_back(layer.top);
    const std::vector<double> borders = layer_borders(gaps.bottom, layer_tops);
    UnmadeAir air;
    air.of_layers.assign(borders.size() - 1, 0);
    std::vector<std::vector<Kept>> rows(gaps.rows.size());
    parallel_for(context, rows.size(), kRows, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row)
            for (const AirGap& gap : gaps.rows[row])
                if (Kept kept; is_kept(gap, borders, layers,
                                       gaps.grid.y0 + static_cast<double>(row) * gaps.grid.cell, kept))
                    rows[row].push_back(kept);
    });
    const double area = gaps.grid.cell * gaps.grid.cell;
    std::array<double, 4> quarters{};
    for (std::size_t row = 0; row < rows.size(); ++row)
        for (const Kept& kept : rows[row]) {
            air.of_layers[kept.layer] += kept.height() * area;
            quarters[row % 2 * 2 + kept.column % 2] += kept.height() * area;
        }
    air.volume_mm3 = std::accumulate(air.of_layers.begin(), air.of_layers.end(), 0.0);
    const auto [least, most] = std::minmax_element(quarters.begin(), quarters.end());
    air.error_mm3 = 4 * (*most - *least) / 2;
    air.pockets = Pockets(rows).list(gaps.grid);
    for (const UnmadePocket& p : air.pockets) air.height_mm = std::max(air.height_mm, p.height_mm);
    return air;
}

}  // namespace slabwright
