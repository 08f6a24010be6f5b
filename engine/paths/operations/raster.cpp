// Finishing by a projected raster: the ball is dropped on the surface along parallel lines wherever its
// contact lies on a slope under 45°. The step-over is chosen for every pass from the slopes under it (FINISH
// eq. 9).
#include "engine/paths/operations/raster.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "engine/moves/motion_time.h"
#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/operations/raster_lines.h"
#include "engine/paths/operations/raster_runs.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/idle_runs.h"
#include "engine/paths/runs/layer_cut.h"
#include "kernels/cutting/cusp.h"
#include "kernels/geometry/vectors.h"

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

// Along x, or along y where that is shorter by more than the estimate is worth, and a sample of the lines
// takes less time too: a line along a fin is run faster than one across it.
RasterLines chosen_lines(const LayerCut& cut, const RasterFacets& facets, const DropIndex& ball) {
    constexpr double clearly = 0.95;
    constexpr std::size_t groups = 8, together = 5;
    RasterLines x = raster_lines(cut, facets, Axis::x);
    if (cut.job.cutting.uniform_steps) return x;
    RasterLines y = raster_lines(cut, facets, Axis::y);
    if (!(length_mm(y) < clearly * length_mm(x))) return x;
    const auto seconds = [&](const RasterLines& lines) {
        const RasterLines some = some_of(lines, groups, together);
        return seconds_of(cut, raster_runs(cut, facets, some, ball)) *
               static_cast<double>(lines.across.size()) / static_cast<double>(some.across.size());
    };
    return seconds(y) < clearly * seconds(x) ? y : x;
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
    const RasterLines raster = chosen_lines(cut, facets, ball);
    op.stepover = raster.widest_mm;
    if (raster.kept_wide)
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
    follow_nearest(
        path, chained(without_idle(cut, raster_runs(cut, facets, raster, ball)), raster_slide(cut, ball)));
    path.finish();
    return op;
}

}  // namespace slabwright
