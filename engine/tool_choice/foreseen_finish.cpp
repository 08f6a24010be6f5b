#include "engine/tool_choice/foreseen_finish.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/tools/tools.h"
#include "kernels/cutting/cusp.h"
#include "kernels/cutting/drop.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLevel = 0.5;   // degrees
constexpr double kPointMm2 = 1;  // of surface to a point, or more:
constexpr double kMostPoints = 4000;
constexpr std::size_t kGrain = 64;  // points

// Fitted to the plans of 36 layers of castings with each ball of shop_library(), so that the sum of those
// layers is least with the balls that are chosen by it.
constexpr double kContours = 1.5, kLines = 3.5;  // times as long as at full feed
constexpr double kLeft = 0.0012;                 // min/mm² that narrower tools take instead
constexpr double kNarrower = 1.1;                // than the fixed set's ball: it clears more slowly, too
constexpr double kStill = 0.2;                   // of what came after the ball, what comes after any

// Of a facet's area, what lies between two heights.
double area_between(const SolidFacet& f, double area, double low, double high) {
    const double below = std::clamp(low, f.z_min, f.z_max), above = std::clamp(high, f.z_min, f.z_max);
    return f.z_max > f.z_min ? area * (above - below) / (f.z_max - f.z_min) : 0;
}

// u, v of [0, 1).
Vec3d point_on(const SolidFacet& f, double u, double v) {
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return plus(plus(f.p[0], minus(f.p[1], f.p[0]), u), minus(f.p[2], f.p[0]), v);
}

FinishWork operator+(const FinishWork& a, const FinishWork& b) {
    return {a.contours_mm + b.contours_mm, a.lines_mm + b.lines_mm, a.left_mm2 + b.left_mm2};
}

}  // namespace

FinishWork finish_work(Context& context, const LayerJob& layer, const LayerSolid& solid, const Tool& ball) {
    const Job& job = *layer.job;
    const double r = ball.diameter / 2, cusp = job.tolerances.cusp;
    const double upright = std::cos(job.cutting.vertical_deg * kDegree), level = std::cos(kLevel * kDegree);
    const double steep = std::cos(job.cutting.steep_limit_deg * kDegree);
    std::vector<double> sum{0};
    std::vector<std::uint32_t> facets;
    for (std::size_t f = 0; f < solid.facets.size(); ++f) {
        const SolidFacet& facet = solid.facets[f];
        if (facet.nz <= upright || facet.nz >= level) continue;
        const double area = length(cross(minus(facet.p[1], facet.p[0]), minus(facet.p[2], facet.p[0]))) / 2;
        const double within = area_between(facet, area, layer.z_bottom, layer.z_top);
        if (within <= 0) continue;
        facets.push_back(static_cast<std::uint32_t>(f));
        sum.push_back(sum.back() + within);
    }
    const auto points = static_cast<std::size_t>(std::min(kMostPoints, std::floor(sum.back() / kPointMm2)));
    if (points == 0) return {};
    const double each = sum.back() / static_cast<double>(points);
    const DropIndex drops(solid, cutter_shape(ball));
    return parallel_reduce(
        context, points, kGrain, FinishWork{},
        [&](std::size_t begin, std::size_t end) {
            FinishWork work;
            MetPoints met;
            for (std::size_t k = begin; k < end; ++k) {
                const double at = (static_cast<double>(k) + 0.5) * each;
                const auto s =
                    static_cast<std::size_t>(std::upper_bound(sum.begin(), sum.end(), at) - sum.begin()) - 1;
                const SolidFacet& facet = solid.facets[facets[std::min(s, facets.size() - 1)]];
                const auto n = static_cast<double>(k);
                Vec3d p = point_on(facet, std::fmod(0.7548776662466927 * n, 1),
                                   std::fmod(0.5698402909980532 * n, 1));
                if (facet.nz <= steep) {
                    const double alpha = std::acos(facet.nz);
                    const double down = std::min(ball.stepdown_max, ball_level_stepdown(r, alpha, cusp));
                    work.contours_mm += each * std::sin(alpha) / down;
                } else {
                    work.lines_mm += each / raster_stepover(r, cusp, 0);
                }
                if (p[2] < layer.z_bottom || p[2] > layer.z_top) continue;
                const double tip = p[2] + r * (facet.normal[2] - 1);
                if (drops.stands_over(p[0] + r * facet.normal[0], p[1] + r * facet.normal[1], tip + cusp,
                                      &met))
                    work.left_mm2 += each;
            }
            return work;
        },
        [](const FinishWork& a, const FinishWork& b) { return a + b; });
}

bool finish_is_foreseeable(const Job& job) {
    const double edges = std::hypot(job.material.kte, job.material.kfe);  // N for each mm of depth
    return std::none_of(job.tools.begin(), job.tools.end(), [&](const Tool& tool) {
        return tool.kind == ToolKind::ball &&
               tip_bent_by(tool, edges * tool.stepdown_max) > job.tolerances.cusp;
    });
}

ForeseenFinish::ForeseenFinish(Context& context, const LayerJob& layer, const Tool& preferred) {
    const Job& job = *layer.job;
    const LayerSolid solid = layer_solid(context, layer.mesh, layer.floor_below, layer.z_top);
    const double usual = fixed_tools(job).finish.diameter;
    for (const Tool& tool : job.tools) {
        if (tool.kind != ToolKind::ball) continue;
        Ball ball{tool, finish_work(context, layer, solid, tool)};
        const double feed = std::min({tool.max_feed, job.cutting.finish_feed, job.machine.max_feed});
        ball.minutes = (kContours * ball.work.contours_mm + kLines * ball.work.lines_mm) / feed +
                       kLeft * ball.work.left_mm2;
        if (tool.diameter < usual) ball.minutes *= kNarrower;
        balls_.push_back(std::move(ball));
    }
    std::stable_sort(balls_.begin(), balls_.end(), [&](const Ball& a, const Ball& b) {
        const auto rank = [&](const Ball& ball) {
            return std::pair(ball.minutes, ball.tool.number != preferred.number);
        };
        return rank(a) < rank(b);
    });
}

std::vector<Tool> ForeseenFinish::ranked() const {
    std::vector<Tool> tools;
    for (const Ball& ball : balls_) tools.push_back(ball.tool);
    return tools;
}

std::optional<double> ForeseenFinish::minutes(int tool) const {
    for (const Ball& ball : balls_)
        if (ball.tool.number == tool) return ball.minutes;
    return std::nullopt;
}

std::optional<Tool> ForeseenFinish::better_than(const Tool& done, const LayerPace& pace, double share,
                                                std::span<const int> tried) const {
    const auto of = std::find_if(balls_.begin(), balls_.end(),
                                 [&](const Ball& ball) { return ball.tool.number == done.number; });
    if (of == balls_.end()) return std::nullopt;
    const FinishWork& was = of->work;
    const auto scaled = [](double minutes, double before, double now) {
        return before > 0 ? minutes * now / before : minutes;
    };
    const double after = pace[3] - pace[2];
    const Ball* better = nullptr;
    double least = share * pace[3];
    for (const Ball& ball : balls_) {
        if (&ball == &*of || std::find(tried.begin(), tried.end(), ball.tool.number) != tried.end()) continue;
        const FinishWork& work = ball.work;
        const double minutes = pace[0] + scaled(pace[1] - pace[0], was.contours_mm, work.contours_mm) +
                               scaled(pace[2] - pace[1], was.lines_mm, work.lines_mm) +
                               std::max(kStill * after, after + kLeft * (work.left_mm2 - was.left_mm2));
        if (minutes < least) least = minutes, better = &ball;
    }
    return better != nullptr ? std::optional(better->tool) : std::nullopt;
}

}  // namespace slabwright
