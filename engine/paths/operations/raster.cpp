// Finishing by a projected raster: the ball is dropped on the surface along parallel lines wherever its
// contact lies on a slope under 45°, along narrow bands of such slopes rather than across them. The step-over
// is chosen for every pass from the slopes under it (FINISH eq. 9).
#include "engine/paths/operations/raster.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "engine/moves/motion_time.h"
#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/operations/raster_lines.h"
#include "engine/paths/operations/raster_runs.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/idle_runs.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/stock/layer_stock.h"
#include "kernels/cutting/cusp.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

RasterFacets raster_facets(const LayerCut& cut) {
    RasterFacets facets;
    facets.slopes = finish_slopes(cut.job.cutting);
    facets.radius = cut.layer.tools.finish.diameter / 2;
    facets.top = cut.layer.z_top - 1.5 * kTopSheet;
    if (facets.slopes.projection_to < 0) return facets;
    const double keep_nz = std::cos(facets.slopes.projection_to);
    const auto is_floor = [&](const SolidFacet& f) {
        return std::any_of(cut.floors.begin(), cut.floors.end(),
                           [&](double z) { return lies_on_floor(f, z); });
    };
    for (const SolidFacet& f : cut.solid.facets) {
        if (f.nz < keep_nz || f.z_max <= cut.layer.z_bottom || f.z_min == cut.layer.z_top) continue;
        facets.shallow.push_back(f);
        if (f.z_min < facets.top && !is_floor(f)) facets.made.push_back(f);
    }
    return facets;
}

// Of the runs one by one, s, with what it takes to come to the next.
double seconds_of(const LayerCut& cut, const RasterRuns& runs) {
    constexpr double to_the_next = 0.2;  // s
    const double speed = std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed) / 60;
    double sum = to_the_next * static_cast<double>(runs.size());
    for (const std::vector<PathPoint>& run : runs) {
        Travel travel(axis_limits(cut.job.machine));
        for (std::size_t k = 1; k < run.size(); ++k) {
            const PathPoint &a = run[k - 1], &b = run[k];
            const Vec3d way{to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z)};
            const double mm = length(way);
            if (mm > 0) travel.add({.length = mm, .speed = speed, .direction = scaled(1 / mm, way)});
        }
        sum += travel.seconds();
    }
    return sum;
}

// Of the cells that something stands on, those on shallow slopes of the pattern.
std::vector<CellRuns> what_stands(const LayerCut& cut, const RasterFacets& facets) {
    constexpr float on_bottom = 1e-3F;                 // mm
    const double least = cut.job.tolerances.cusp / 4;  // what is no more is idle where no more stands near it
    const LayerStock& stock = *cut.stock;
    const auto keep_nz = static_cast<float>(std::cos(facets.slopes.projection_to) - 1.0 / 255);
    std::vector<CellRuns> rows(static_cast<std::size_t>(stock.grid().ny));
    parallel_each(cut.context, rows.size(), [&](std::size_t j) {
        CellRuns& row = rows[j];
        stock.each_left(static_cast<int>(j), least, [&](int i) {
            const std::size_t c = stock.grid().index(i, static_cast<int>(j));
            if (stock.nz(c) < keep_nz || stock.surface(c) < on_bottom) return;
            if (!row.empty() && row.back()[1] + 1 == i) row.back()[1] = i;
            else row.push_back({i, i});
        });
    });
    return rows;
}

// Lines over all that the ball is to make, each part of it in its own direction.
struct Raster {
    std::optional<LineDirections> directions;  // none: all along x
    std::vector<RasterLines> lines;

    [[nodiscard]] double mm() const {
        double sum = 0;
        for (const RasterLines& of_one : lines) sum += length_mm(of_one);
        return sum;
    }
};

Raster raster_over(const LayerCut& cut, const RasterFacets& facets, std::span<const CellRuns> rows,
                   LineDirections::Usual usual) {
    constexpr double worth = 15;  // mm: turns spared along shorter bands are lost on the ways there
    Raster raster;
    raster.directions.emplace(cut.context, cut.stock->grid(), rows, facets.radius, usual, worth);
    for (std::size_t d = 0; d < raster.directions->all().size(); ++d)
        if (RasterLines lines = raster_lines(cut, facets, *raster.directions, d); !lines.across.empty())
            raster.lines.push_back(std::move(lines));
    return raster;
}

RasterRuns runs_of(const LayerCut& cut, const RasterFacets& facets, const Raster& raster,
                   const DropIndex& ball) {
    RasterRuns all;
    for (const RasterLines& lines : raster.lines) {
        RasterRuns runs =
            raster_runs(cut, facets, lines, ball, raster.directions ? &*raster.directions : nullptr);
        std::move(runs.begin(), runs.end(), std::back_inserter(all));
    }
    return all;
}

// What is no band runs along x, or along y where that is shorter by more than the estimate is worth, and a
// sample of the lines takes less time too: a line along a fin is run faster than one across it.
Raster chosen_raster(const LayerCut& cut, const RasterFacets& facets, const DropIndex& ball) {
    constexpr double clearly = 0.95;
    constexpr std::size_t groups = 8, together = 5;
    if (cut.stock == nullptr) return {std::nullopt, {raster_lines(cut, facets)}};
    const std::vector<CellRuns> rows = what_stands(cut, facets);
    Raster x = raster_over(cut, facets, rows, LineDirections::along_x);
    Raster y = raster_over(cut, facets, rows, LineDirections::along_y);
    if (!(y.mm() < clearly * x.mm())) return x;
    const auto seconds = [&](const Raster& raster) {
        double sum = 0;
        for (const RasterLines& lines : raster.lines) {
            const RasterLines some = some_of(lines, groups, together);
            sum += seconds_of(cut, raster_runs(cut, facets, some, ball, &*raster.directions)) *
                   static_cast<double>(lines.across.size()) / static_cast<double>(some.across.size());
        }
        return sum;
    };
    return seconds(y) < clearly * seconds(x) ? std::move(y) : std::move(x);
}

RasterRuns without_idle(const LayerCut& cut, RasterRuns runs) {
    constexpr double kWorthLeaving = 30;  // mm: the next line is near
    std::vector<std::vector<LevelRun>> lines(1);
    for (std::vector<PathPoint>& run : runs) lines[0].push_back({std::move(run), false});
    take_out_idle(cut, ball_cutter(cut.layer.tools.finish.diameter / 2), kWorthLeaving, lines);
    runs.clear();
    for (LevelRun& run : lines[0]) runs.push_back(std::move(run.points));
    return runs;
}

}  // namespace

Operation finish_raster(const LayerCut& cut, std::vector<Diagnostic>& diagnostics) {
    const Tool& tool = cut.layer.tools.finish;
    Operation op = cut.operation(OperationKind::finish, "projected raster", tool);
    const RasterFacets facets = raster_facets(cut);
    if (facets.shallow.empty()) return op;
    const DropIndex& ball = cut.drops(ball_cutter(facets.radius));
    const Raster raster = chosen_raster(cut, facets, ball);
    bool kept_wide = false;
    for (const RasterLines& lines : raster.lines) {
        op.stepover = std::max(op.stepover, lines.widest_mm);
        kept_wide |= lines.kept_wide;
    }
    if (kept_wide)
        diagnostics.push_back(
            {Severity::warning,
             "finish.stepover_floor",
             fmt::format(
                 "layer {}: the raster's step-over was kept at {:.2f} mm, cusps there exceed {:.3f} mm",
                 cut.layer.index, cut.job.cutting.min_stepover, cut.job.tolerances.cusp),
             {}});

    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed),
                     cut.layer.z_top + cut.job.machine.clearance, cut.layer.z_top + 2);
    path.set_surroundings(cut.around(tool, &ball));
    follow_nearest(path,
                   chained(without_idle(cut, runs_of(cut, facets, raster, ball)), raster_slide(cut, ball)));
    path.finish();
    return op;
}

}  // namespace slabwright
