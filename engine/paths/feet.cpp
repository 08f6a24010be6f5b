#include "engine/paths/feet.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/cutting/cusp.h"

namespace slabwright {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSteepFoot = 75 * kDegree;  // over flatter feet a flat end mill would need too many passes
constexpr double kMostFeet = 6;

}  // namespace

bool lies_on_floor(const SolidFacet& facet, double z) { return facet.z_min >= z - kSameFloor && facet.z_max <= z && facet.normal[2] >= 0.9999; }

std::vector<SolidFacet> floor_facets(const LayerCut& cut, double z) {
    std::vector<SolidFacet> facets;
    for (const SolidFacet& f : cut.solid.facets)
        if (lies_on_floor(f, z)) facets.push_back(f);
    return facets;
}

NearFloor::NearFloor(const LayerCut& cut, std::span<const SolidFacet> facets, double r, const FibreGrid& grid)
    : grid_(grid), x_(covering(cut.context, facets, r, Axis::x, grid.y)), y_(covering(cut.context, facets, r, Axis::y, grid.x)) {}

bool NearFloor::operator()(Point2 p) const {
    const bool on_row = p.y % grid_.pitch == 0;
    const std::int32_t line = (on_row ? p.y - grid_.y[0] : p.x - grid_.x[0]) / grid_.pitch;
    const double along = to_mm(on_row ? p.x : p.y);
    const auto near = (on_row ? x_ : y_).line(static_cast<std::size_t>(line));
    return std::any_of(near.begin(), near.end(), [&](const Forbidden& f) { return f.low < along && along < f.high; });
}

std::vector<double> foot_heights(const LayerCut& cut, double floor) {
    const double cusp = cut.job.tolerances.cusp, r = cut.layer.tools.finish.diameter / 2, alpha = cut.least_slope(floor, floor + r, kSteepFoot);
    if (alpha >= cut.job.cutting.vertical_deg * kDegree) return {};
    const double high = r * (1 - std::cos(alpha)) - std::sqrt(2 * r * cusp), steps = std::ceil(high / flat_level_stepdown(alpha, cusp));
    std::vector<double> heights;
    if (steps > kMostFeet) return heights;
    for (double k = steps - 1; k > 0.5; --k) heights.push_back(high * k / steps);
    return heights;
}

void append_foot_runs(const LayerCut& cut, const Tool& tool, double floor, const FibreGrid& grid,
                      std::span<const std::pair<const DropIndex*, double>> wider, std::vector<std::vector<LevelRun>>& levels) {
    const std::vector<double> heights = foot_heights(cut, floor);
    if (heights.empty()) return;
    const double r = tool.diameter / 2, wall_nz = std::cos(cut.job.cutting.vertical_deg * kDegree), foot_nz = std::cos(kSteepFoot);
    const Cutter cutter{Cutter::Profile::flat, r};
    const std::vector<SolidFacet> facets = floor_facets(cut, floor);
    const NearFloor near(cut, facets, r, grid);
    const LayerSolid around = solid_near(cut.context, cut.solid, facets, 2 * (r + to_mm(grid.pitch)));
    std::vector<double> tips;
    for (const double above : heights) tips.push_back(floor + above);
    const std::vector<Section> inside = cut.insides(cutter, tips);
    std::vector<FibreLevel> at;
    for (std::size_t i = 0; i < tips.size(); ++i) at.push_back({tips[i], &inside[i].loops});
    const std::vector<Contours> contours = level_contours(cut.context, around, at, cutter, grid);
    for (std::size_t i = 0; i < tips.size(); ++i) {
        const double tip = tips[i];
        const Contours& foot = contours[i];
        levels.emplace_back();
        for (std::size_t c = 0; c < foot.size(); ++c) {
            const std::size_t first = foot.starts[c], n = foot.starts[c + 1] - first;
            std::vector<char> wanted(n, 0);
            for (std::size_t k = 0; k < n; ++k) {
                const Point2 a = foot.points[first + (k + n - 1) % n], p = foot.points[first + k], b = foot.points[first + (k + 1) % n];
                if (foot.nz[first + k] <= wall_nz || foot.nz[first + k] > foot_nz || !near(p)) continue;
                wanted[k] = 1;
                const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y, l = std::hypot(dx, dy);
                for (const auto& [drops, radius] : wider)
                    // The solid is on the right, so the free side is on the left.
                    if (l > 0 && !drops->stands_over(to_mm(p.x) - dy / l * (radius + 0.02 - r), to_mm(p.y) + dx / l * (radius + 0.02 - r), tip))
                        wanted[k] = 0;
            }
            append_level_runs(foot, c, to_units(tip), wanted, simplify_tolerance_units(cut.job.tolerances.gouge), levels.back());
        }
    }
}

}  // namespace slabwright
