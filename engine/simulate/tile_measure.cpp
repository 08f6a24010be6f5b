#include "engine/simulate/tile_measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "engine/simulate/reach.h"
#include "kernels/geometry/vectors.h"
#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

constexpr std::size_t kTileUnreached =
    256;  // places of a tile and layer that are kept of what is out of reach

enum class FlaskCell : char { none, border, core };

/// Which cells belong to a layer's flask, row by row.
std::vector<FlaskCell> flask_cells(const KeptFlask& kept, const CellGrid& grid) {
    std::vector<FlaskCell> cells(kept.border.empty() ? 0 : grid.count(), FlaskCell::none);
    if (cells.empty()) return cells;
    std::vector<double> rows;
    for (int j = 0; j < grid.ny; ++j) rows.push_back(grid.y(j) * kUnitsPerMm);
    for (const auto& [region, what] :
         {std::pair{&kept.border, FlaskCell::border}, {&kept.core, FlaskCell::core}}) {
        const std::vector<std::vector<Span>> spans = line_spans(*region, rows);
        for (int j = 0; j < grid.ny; ++j)
            for (const Span& span : spans[static_cast<std::size_t>(j)])
                for (int i = 0; i < grid.nx; ++i)
                    if (const double x = grid.x(i) * kUnitsPerMm; x >= span.low && x < span.high)
                        cells[grid.index(i, j)] = what;
    }
    return cells;
}

/// Keeps one of each equal share, which stands for all of it.
void thin(std::vector<UnreachedCell>& cells) {
    if (cells.size() <= kTileUnreached) return;
    const double share = static_cast<double>(cells.size()) / kTileUnreached;
    for (std::size_t k = 0; k < kTileUnreached; ++k) {
        cells[k] = cells[static_cast<std::size_t>((static_cast<double>(k) + jitter(k)) * share)];
        cells[k].cells = static_cast<float>(share);
    }
    cells.resize(kTileUnreached);
    cells.shrink_to_fit();
}

/// Sums the air that stays filled in one layer. A column at the rim of it does not count: a wall that
/// leans inwards by a hair leaves tall air as thin as that hair.
void measure_unmade(const SimulationStage& stage, const CellGrid& grid, const std::vector<float>& air,
                    double z_bottom, LayerFindings& f) {
    const auto has_air = [&](int i, int j) {
        if (i < 0 || j < 0 || i >= grid.nx || j >= grid.ny) return true;
        return air[static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.nx) +
                   static_cast<std::size_t>(i)] > StandingPart::kSheet;
    };
    std::size_t c = 0;
    for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i, ++c) {
            if (!has_air(i, j) || !has_air(i - 1, j) || !has_air(i + 1, j) || !has_air(i, j - 1) ||
                !has_air(i, j + 1))
                continue;
            f.unmade_mm3 += air[c] * stage.cell * stage.cell;
            raise(f.unmade, air[c], {grid.x0 + i * stage.cell, grid.y0 + j * stage.cell, z_bottom});
        }
}

/// One layer's stock of a tile.
class TileLayerMeasure {
public:
    TileLayerMeasure(const SimulationStage& stage, std::size_t layer, const Stock& stock,
                     const std::vector<float>& envelope, int i0, int j0, TileResult& result,
                     SimulationReport& report)
        : stage_(stage),
          layer_(stage.input.layers[layer]),
          grid_(stock.grid()),
          surface_(stock.standing(layer)),
          envelope_(envelope),
          flask_(flask_cells(stage.flasks[layer], grid_)),
          i0_(i0),
          j0_(j0),
          out_(result.layers[layer]),
          f_(out_.findings),
          flask_cut_(result.flask),
          of_layer_(report.layers[layer]),
          reach_(stage.part, stage.input.tools, layer_.z_bottom, layer_.z_top, stage.lowest_tip(layer)) {}

    void run() {
        const bool plainly = flask_.empty() && !stage_.options.maps;
        for (int j = 0; j < grid_.ny; ++j)
            for (int i = 0; i < grid_.nx;) {
                if (plainly && i + 8 <= grid_.nx && plain()) {
                    i += 8, c_ += 8;
                    continue;
                }
                for (const int end = std::min(i + 8, grid_.nx); i < end; ++i, ++c_) measure(i, j);
            }
        for (int k = 0; k < 8; ++k) out_.squares += squares_[k];
    }

private:
    [[nodiscard]] std::size_t map_cell(int i, int j) const {
        return static_cast<std::size_t>(j0_ + j) * static_cast<std::size_t>(stage_.nx) +
               static_cast<std::size_t>(i0_ + i);
    }

    void measure(int i, int j) {
        const double x = grid_.x(i), y = grid_.y(j), z = surface_(c_);
        const bool maps = stage_.options.maps;
        if (!flask_.empty() && flask_[c_] != FlaskCell::none) {
            if (flask_[c_] == FlaskCell::core) raise(flask_cut_, layer_.z_top - z, {x, y, z});
            if (maps) of_layer_.kinds[map_cell(i, j)] = CellKind::flask;
            return;
        }
        ++f_.cells;
        const bool beside = envelope_[c_] < part_from_;
        const double keep = beside ? layer_.z_bottom : static_cast<double>(envelope_[c_]);
        double over = z - keep;
        CellKind kind = beside ? CellKind::beside : CellKind::pattern;
        if (over < 0) {
            const double gouge = stage_.options.gouge,
                         depth = depth_of_lost({x, y, z}, keep, maps ? 0 : std::min(gouge, f_.gouge.size));
            raise(f_.gouge, depth, {x, y, z});
            f_.gouge_cells += depth > gouge;
            if (depth > gouge) kind = CellKind::gouge;
            over = -depth;
        } else if (over > 0) {
            // Vertical height overstates what is left on a slope. Along the normal it is the distance
            // from the finished surface, which beside the pattern is the layer's bottom.
            if (over > stage_.options.cusp) {
                const bool goes_on_above = envelope_[c_] == static_cast<float>(layer_.z_top);
                const auto near = stage_.part.from_shadow({x, y, z}, layer_.z_top, over, goes_on_above);
                over = std::min(over, near.distance);
                if (over > stage_.options.cusp) kind = CellKind::left;
                if (over > stage_.options.cusp + stage_.options.slack)
                    kind = judge_leftover({x, y, z}, over, near, beside, z - keep);
            }
            raise(f_.left, over, {x, y, z});
            out_.squares += over * over;
        }
        if (maps) {
            of_layer_.map[map_cell(i, j)] = static_cast<float>(over);
            of_layer_.kinds[map_cell(i, j)] = kind;
        }
    }

    /// Most cells have nothing to tell but the square of what little is left: eight are asked at once whether
    /// it is so.
    bool plain() {
        Floats8 height, upper;
        std::memcpy(&height, surface_.height + c_, sizeof height);
        std::memcpy(&upper, envelope_.data() + c_, sizeof upper);
        const Doubles8 z = surface_.bottom + __builtin_convertvector(height, Doubles8),
                       part = __builtin_convertvector(upper, Doubles8);
        const Doubles8 over = z - (part < part_from_ ? Doubles8{} + layer_.z_bottom : part);
        const auto more = (over < 0.0) | (over > std::min(stage_.options.cusp, f_.left.size));
        std::int64_t any = 0;
        for (int k = 0; k < 8; ++k) any |= more[k];
        if (any != 0) return false;
        squares_ += over * over;
        f_.cells += 8;
        return true;
    }

    /// How deep in the part the material was that a column has lost between the stock's surface and the
    /// part's: the greatest distance from the part's surface of those of its points that are within the part.
    /// (The lowest point alone will not do: it may lie on the part's own bottom. Points under an overhang are
    /// in the part's shadow, but no part was lost there.)
    /// @param enough what is no deeper need not be told from 0, mm
    double depth_of_lost(const Point3& surface, double keep, double enough) const {
        const double height = keep - surface[2];
        if (height <= stage_.options.gouge / 5) return height;
        constexpr int kPoints = 8;
        double depth = 0, from = surface[2],
               distance = height;  // that a point below is from a facet at most, and it
        for (int k = 0; k < kPoints; ++k) {
            const double z = surface[2] + height * k / kPoints, cap = std::min(height, keep - z),
                         known = std::max(depth, enough);
            if (cap <= known) break;
            if (k > 0 && distance + (z - from) <= known) continue;
            const Point3 lost{surface[0], surface[1], z};
            from = z, distance = stage_.part.from_facets(lost, cap, known);
            if (distance > known && stage_.part.covered(lost[0], lost[1], lost[2]))
                depth = distance;  // else it is outside of the part
        }
        return depth;
    }

    /// Stock that stands `over` above the finished surface is excused as far as no tool reaches into it. What
    /// could have been taken at a point of its surface is the greatest d for which tools reach the points d
    /// away from it towards the part, straight down and down at 45° to four sides: a lump of that size, not
    /// the sliver beside what is out of reach. Found by halving.
    CellKind judge_leftover(const Point3& s, double over, const StandingPart::Clearance& near, bool beside,
                            double height) {
        const double limit = stage_.options.cusp + stage_.options.slack;
        Point3 n{0, 0, 1};
        if (near.distance < height && near.distance > 0)
            for (int k = 0; k < 3; ++k) n[k] = near.away[k] / near.distance;
        const double h = std::sqrt(0.5);
        const std::array<Point3, 6> ways{Point3{0, 0, 1}, n, {h, 0, h}, {-h, 0, h}, {0, h, h}, {0, -h, h}};
        auto could_take = [&](double d) {
            for (const Point3& w : ways)
                if (!reach_.reachable(
                        {s[0] - w[0] * d, s[1] - w[1] * d, std::max(layer_.z_bottom, s[2] - w[2] * d)}))
                    return false;
            return true;
        };
        ++f_.over;
        if (!could_take(limit)) {
            ++f_.unreachable;
            f_.unreached.push_back({s, over, 1});
            raise(f_.unreachable_left, over, s);
            return CellKind::unreachable;
        }
        ++f_.missed;
        if (stage_.options.faults) f_.missed_places.push_back({s, over, height});
        // Only the most matters, so a cell that cannot exceed it is not asked.
        if (over > f_.missed_left.size) {
            double low = limit, high = over;
            for (int i = 0; i < 5 && high - low > 0.02; ++i) {
                const double mid = (low + high) / 2;
                (could_take(mid) ? low : high) = mid;
            }
            raise(f_.missed_left, low, s);
        }
        if (beside) {
            ++f_.waste;
            f_.waste_mm3 += height * stage_.cell * stage_.cell;
        }
        return CellKind::missed;
    }

    const SimulationStage& stage_;
    const SimulatedLayer& layer_;
    const CellGrid& grid_;
    StandingHeights surface_;
    const std::vector<float>& envelope_;
    std::vector<FlaskCell> flask_;
    int i0_, j0_;
    TileLayer& out_;
    LayerFindings& f_;
    Extreme& flask_cut_;
    LayerFindings& of_layer_;  // its maps
    Reach reach_;
    std::size_t c_ = 0;   // the cell at hand
    Doubles8 squares_{};  // of what is left
    double part_from_ = layer_.z_bottom + StandingPart::kSheet;
};

}  // namespace

void measure_tile(const SimulationStage& stage, const Stock& stock, int i0, int j0, TileResult& result,
                  SimulationReport& report) {
    const CellGrid& grid = stock.grid();
    constexpr float nothing = std::numeric_limits<float>::lowest();
    std::vector<float> heights(grid.count()), air(grid.count());
    RisingEnvelope envelope(stage.part, grid.x0, grid.y0, grid.cell, grid.nx, grid.ny);
    for (std::size_t l = 0; l < stage.input.layers.size(); ++l) {
        const SimulatedLayer& layer = stage.input.layers[l];
        LayerFindings& f = result.layers[l].findings;
        stage.context.throw_if_cancelled();
        envelope.at(layer.z_top, nothing, heights.data());
        TileLayerMeasure(stage, l, stock, heights, i0, j0, result, report).run();
        thin(f.unreached);
        envelope.covered_air(layer.z_bottom, air.data());
        measure_unmade(stage, grid, air, layer.z_bottom, f);
    }
    result.pattern_cells = static_cast<std::uint64_t>(
        std::count_if(heights.begin(), heights.end(), [](float z) { return z != nothing; }));
}

}  // namespace slabwright
