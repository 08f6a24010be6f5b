#include "engine/forces/min_material.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/flask/flask.h"
#include "engine/forces/cuts.h"
#include "engine/tools/tools.h"
#include "kernels/forces/deflection.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/loops.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr int kCells = 256;            // along the stock's longer side
constexpr std::size_t kHeights = 128;  // at which sections are taken

OverhangThickness thickness_at(const Job& job, const Tool& tool, double depth, double overhang) {
    const CutSegment cut = hardest_cut(job, tool, depth);
    const SegmentForces f = cut.flat() ? closed_form_forces(cut) : reference_forces(cut);
    OverhangCut slab;
    slab.force_x_n = f.peak_x_n;
    slab.force_y_n = f.peak_y_n;
    slab.force_z_n = f.peak_z_n;
    slab.overhang_mm = overhang;
    slab.cut_height_mm = depth / 2;
    slab.width_mm = cut.radius_mm;
    slab.strength_mpa = job.material.strength_mpa;
    return least_overhang_thickness(slab);
}

// Squared distances, in cells, to the nearest marked cell of one row or column: the lower envelope of
// parabolas (Felzenszwalb and Huttenlocher), in place.
void distances(std::vector<double>& f, std::vector<double>& scratch, std::vector<int>& roots,
               std::vector<double>& bounds) {
    const int n = static_cast<int>(f.size());
    scratch = f;
    roots.assign(f.size(), 0);
    bounds.assign(f.size() + 1, 0);
    int k = -1;
    for (int q = 0; q < n; ++q) {
        if (scratch[static_cast<std::size_t>(q)] >= 1e18) continue;
        double s = -kUnbounded;
        while (k >= 0) {
            const int v = roots[static_cast<std::size_t>(k)];
            s = ((scratch[static_cast<std::size_t>(q)] + double{1} * q * q) -
                 (scratch[static_cast<std::size_t>(v)] + double{1} * v * v)) /
                (2.0 * (q - v));
            if (s > bounds[static_cast<std::size_t>(k)]) break;
            --k;
            s = -kUnbounded;
        }
        ++k;
        roots[static_cast<std::size_t>(k)] = q;
        bounds[static_cast<std::size_t>(k)] = s;
    }
    if (k < 0) return;  // nothing marked: all stay infinite
    for (int q = 0, j = 0; q < n; ++q) {
        while (j < k && bounds[static_cast<std::size_t>(j) + 1] < q) ++j;
        const int v = roots[static_cast<std::size_t>(j)];
        f[static_cast<std::size_t>(q)] = double{1} * (q - v) * (q - v) + scratch[static_cast<std::size_t>(v)];
    }
}

}  // namespace

double OverhangMap::at(double x, double y) const {
    const int i = std::clamp(static_cast<int>(std::floor((x - low[0]) / cell)), 0, nx - 1),
              j = std::clamp(static_cast<int>(std::floor((y - low[1]) / cell)), 0, ny - 1);
    return mm[static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i)];
}

double OverhangMap::largest() const { return *std::max_element(mm.begin(), mm.end()); }

double overhang_cell(const std::array<double, 2>& low, const std::array<double, 2>& high) {
    return std::max(high[0] - low[0], high[1] - low[1]) / kCells;
}

OverhangMap overhang_map(std::span<const Loops* const> regions, const std::array<double, 2>& low,
                         const std::array<double, 2>& high) {
    OverhangMap map;
    const double cell = overhang_cell(low, high);
    const int nx = std::max(1, static_cast<int>(std::ceil((high[0] - low[0]) / cell))),
              ny = std::max(1, static_cast<int>(std::ceil((high[1] - low[1]) / cell)));
    map.low = low;
    map.cell = cell;
    map.nx = nx;
    map.ny = ny;
    std::vector<std::vector<double>> rows(static_cast<std::size_t>(ny),
                                          std::vector<double>(static_cast<std::size_t>(nx), 1e18));
    std::vector<double> scratch, bounds, column(static_cast<std::size_t>(ny));
    std::vector<int> roots;
    std::vector<double> heights;
    for (int j = 0; j < ny; ++j) heights.push_back(to_units(low[1] + (j + 0.5) * cell));
    std::vector<std::vector<std::vector<Span>>> spans;
    for (const Loops* region : regions) spans.push_back(line_spans(*region, heights));
    for (int j = 0; j < ny; ++j) {
        std::vector<double>& row = rows[static_cast<std::size_t>(j)];
        for (const std::vector<std::vector<Span>>& of_region : spans)
            for (const Span& s : of_region[static_cast<std::size_t>(j)])
                for (int i = std::max(
                         0, static_cast<int>(std::ceil((s.low / kUnitsPerMm - low[0]) / cell - 0.5)));
                     i < nx && (i + 0.5) * cell + low[0] <= s.high / kUnitsPerMm; ++i)
                    row[static_cast<std::size_t>(i)] = 0;
        distances(row, scratch, roots, bounds);
    }
    map.mm.resize(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny));
    for (std::size_t i = 0; i < static_cast<std::size_t>(nx); ++i) {
        for (std::size_t j = 0; j < rows.size(); ++j) column[j] = rows[j][i];
        distances(column, scratch, roots, bounds);
        for (std::size_t j = 0; j < rows.size(); ++j)
            map.mm[j * static_cast<std::size_t>(nx) + i] =
                static_cast<float>(column[j] >= 1e18 ? std::hypot(high[0] - low[0], high[1] - low[1])
                                                     : std::sqrt(column[j]) * cell);
    }
    return map;
}

double least_material(const Job& job, double overhang_mm) {
    double least = 0;
    for (const Tool& tool : job.tools) {
        if (!is_end_mill(tool.kind)) continue;
        double high = thickness_at(job, tool, tool.stepdown_max, overhang_mm).least_mm;
        if (high < tool.stepdown_max) {
            // Slabs thinner than the step are cut through at once, with less force: the thinnest that bears
            // its own thickness.
            double low = 0;
            high = tool.stepdown_max;
            for (int i = 0; i < 40 && high - low > 1e-6; ++i) {
                const double middle = (low + high) / 2;
                (thickness_at(job, tool, middle, overhang_mm).least_mm <= middle ? high : low) = middle;
            }
        }
        least = std::max(least, high);
    }
    return least;
}

RoughSteps rough_steps(const Job& job, const Tool& tool, double overhang_mm, double layer_mm) {
    if (!(overhang_mm > 0)) return {};
    constexpr double kSliver = 0.9;  // of the thinnest slab
    const double least = least_slab(tool), last = kSliver * least;
    int most = 0;  // last levels that have room
    while (most < 2 && layer_mm - most * last > 1.5 * last) ++most;
    const int finest = most + static_cast<int>(layer_mm / least);
    // Roughing seldom meets as hard a cut as this is reckoned by.
    const auto holds = [&](double step, int count) {
        const bool usual = count == most;
        return thickness_at(job, tool, step, (usual ? 2.0 / 3 : 0.75) * overhang_mm).least_mm <=
               (usual ? layer_mm : count * last + step);
    };
    for (int levels = 1; levels <= finest; ++levels)
        for (int count = std::min(most, levels - 1); count >= 0; --count) {
            const double step = (layer_mm - count * last) / (levels - count);
            if (step >= least && step <= tool.stepdown_max + 1e-9 && holds(step, count))
                return {last, count, step};
        }
    const double deepest = shallow_step(tool);
    return {last, thickness_at(job, tool, deepest, overhang_mm / 2).least_mm <= layer_mm ? most : 0, deepest};
}

SlabOverhang slab_overhang(Context& context, MeshView mesh, const Plan& plan) {
    SlabOverhang result;
    std::vector<double>& heights = result.heights;
    const double height = bounds(context, mesh).max.z;
    for (const Feature& f : plan.features)
        if (f.z_low > 0 && f.z_low < height) heights.push_back(f.z_low);
    for (int i = 1; i <= 16; ++i) heights.push_back(height / 16 * i);
    std::sort(heights.begin(), heights.end());
    heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
    if (heights.size() > kHeights) {
        std::vector<double> spread;
        for (std::size_t i = 0; i < kHeights; ++i)
            spread.push_back(heights[i * (heights.size() - 1) / (kHeights - 1)]);
        heights = std::move(spread);
    }
    std::vector<Plane> planes;
    // Clearly below: a height is that of vertices but for rounding.
    for (const double z : heights) planes.push_back({std::max(z - 0.01, z / 2), Side::below});
    const std::vector<Section> sections = slice(context, mesh, planes, {plan.job.tolerances.gap});

    Loops frame;
    double slope = 0;
    if (plan.job.flask.enabled) {
        // The opening at the bottom; higher up it is wider by what the draft adds.
        Plan whole;
        whole.job = plan.job;
        whole.stock_min = plan.stock_min;
        whole.stock_max = plan.stock_max;
        whole.layers.resize(1);
        whole.layers[0].z_top = height;
        frame = flask_frame(place_flask(context, mesh, whole), 0);
        slope = std::tan(plan.job.flask.draft_deg * std::numbers::pi / 180);
    }
    result.overhangs.resize(heights.size());
    parallel_each(context, heights.size(), [&](std::size_t i) {
        const std::array<const Loops*, 2> regions{&sections[i].loops, &frame};
        // Half a cell's diagonal at the slab's edge and as much at the section's.
        const OverhangMap map = overhang_map(regions, plan.stock_min, plan.stock_max);
        const double most =
            std::hypot(plan.stock_max[0] - plan.stock_min[0], plan.stock_max[1] - plan.stock_min[1]);
        result.overhangs[i] = std::min(map.largest() + std::numbers::sqrt2 * map.cell, most) +
                              slope * heights[i] + plan.job.bonding.edge_setback;
    });
    return result;
}

std::function<double(double)> min_material(Context& context, MeshView mesh, const Plan& plan) {
    const SlabOverhang overhang = slab_overhang(context, mesh, plan);
    std::vector<double> least(overhang.heights.size());
    parallel_each(context, least.size(),
                  [&](std::size_t i) { least[i] = least_material(plan.job, overhang.overhangs[i]); });
    return [heights = overhang.heights, least = std::move(least)](double z) {
        const auto above =
            static_cast<std::size_t>(std::lower_bound(heights.begin(), heights.end(), z) - heights.begin());
        return std::max(least[std::min(above, least.size() - 1)], least[above == 0 ? 0 : above - 1]);
    };
}

}  // namespace slabwright
