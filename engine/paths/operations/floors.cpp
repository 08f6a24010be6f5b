// Finishing of up-facing flats by the flat end mill: roughing left its allowance on them.
#include "engine/paths/operations/floors.h"

#include <algorithm>
#include <cmath>

#include "engine/moves/order.h"
#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/leads.h"
#include "engine/paths/runs/tolerances.h"
#include "engine/paths/runs/zigzag.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

Operation finish_floors(const LayerCut& cut) {
    const Tool& tool = cut.layer.tools.rough;
    Operation op = cut.operation(OperationKind::finish, "floors", tool);
    const double r = tool.diameter / 2;
    const CutterShape cutter = flat_cutter(r);
    const std::vector<double>& heights = cut.floors;
    if (heights.empty()) return op;
    const std::vector<Section> inside = cut.insides(cutter, heights);
    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed),
                     cut.layer.z_top + cut.job.machine.clearance, cut.layer.z_top + 2);
    const DropIndex& part = cut.drops(cutter);
    path.set_surroundings(cut.around(tool, &part));
    op.stepover = clearing_step(tool);
    for (std::size_t i = 0; i < heights.size(); ++i) {
        const std::vector<SolidFacet> facets = floor_facets(cut, heights[i]);
        double y_low = kUnbounded, y_high = -kUnbounded;
        for (const SolidFacet& f : facets)
            for (const Vec3d& p : f.p) y_low = std::min(y_low, p[1]), y_high = std::max(y_high, p[1]);
        if (facets.empty()) continue;
        y_low = std::max(y_low - 0.4 * r, cut.low(1, r));
        y_high = std::min(y_high + 0.4 * r, cut.high(1, r));
        const int gaps = std::max(1, static_cast<int>(std::ceil((y_high - y_low) / op.stepover - 1e-9)));
        std::vector<std::int32_t> lines;
        for (int k = 0; k <= gaps; ++k) lines.push_back(to_units(y_low + (y_high - y_low) * k / gaps));
        lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
        const Fibres forbidden =
            fibres(cut.context, cut.solid, inside[i].loops, cutter, heights[i], Axis::x, lines);
        const Fibres reach = covering(cut.context, facets, r, Axis::x, lines);
        std::vector<std::vector<Stretch>> free(lines.size());
        for (std::size_t l = 0; l < lines.size(); ++l)
            for (const Forbidden& near : reach.line(l))
                for (const Stretch& s :
                     free_stretches(forbidden.line(l), std::max(near.low, cut.low(0, r + 2)),
                                    std::min(near.high, cut.high(0, r + 2)), 0.01))
                    free[l].push_back(s);
        zigzag(path, cut, tool, lines, free, heights[i], [&](std::span<const std::int32_t> at) {
            return fibres(cut.context, cut.solid, inside[i].loops, cutter, heights[i], Axis::y, at);
        });
        // Once along the border of the free region, where the zigzag's ends leave scallops.
        const std::int32_t pitch = safe_pitch(r, cut.job.tolerances.gouge), z = to_units(heights[i]);
        const FibreGrid grid = fibre_grid(cut.solid, cutter, pitch);
        const LayerSolid around = solid_near(cut.context, cut.solid, facets, 2 * (r + to_mm(pitch)));
        const Contours border = std::move(
            contours_near(cut.context, around, {&heights[i], 1}, {&inside[i], 1}, cutter, grid).front());
        const NearFloor near_floor(cut, facets, r, grid);
        std::vector<std::vector<PathPoint>> runs;
        for (std::size_t c = 0; c < border.size(); ++c) {
            const std::size_t first = border.starts[c], n = border.starts[c + 1] - first;
            std::vector<char> wanted(n);
            std::size_t start = 0;
            for (std::size_t k = 0; k < n; ++k)
                if (!(wanted[k] = near_floor(border.points[first + k]))) start = k;
            std::vector<PathPoint> run;
            auto close = [&] {
                if (run.size() > 1)
                    runs.push_back(simplify(run, simplify_tolerance_units(cut.job.tolerances.gouge)));
                run.clear();
            };
            for (std::size_t k = 0; k <= n; ++k) {
                const std::size_t at = (start + k) % n;
                if (wanted[at]) run.push_back({border.points[first + at].x, border.points[first + at].y, z});
                else close();
            }
            close();
        }
        std::vector<Beginning> beginnings;
        for (const std::vector<PathPoint>& run : runs)
            beginnings.push_back({{run.front().x, run.front().y},
                                  {run.back().x, run.back().y},
                                  static_cast<std::uint32_t>(beginnings.size()),
                                  0});
        for (const Beginning& next : nearest_order(std::move(beginnings), runs.size(), path.at())) {
            add_leads(path, cut, part, safe_chord_mm(r, cut.job.tolerances.gouge), runs[next.run]);
            path.follow(runs[next.run]);
        }
        if (!clears_on_contours(cut.job)) continue;
        std::vector<std::vector<LevelRun>> feet;
        append_foot_runs(cut, tool, heights[i], grid, {}, feet);
        if (!feet.empty()) op.stepdown = std::max(op.stepdown, foot_heights(cut, heights[i]).back());
        cut_levels(path, cut, tool, part, feet, true, LevelWays::climbing);
    }
    path.finish();
    return op;
}

}  // namespace slabwright
