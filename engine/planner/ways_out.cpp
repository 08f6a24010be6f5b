#include "engine/planner/ways_out.h"

#include <algorithm>
#include <utility>

#include "engine/forces/min_material.h"
#include "engine/layers/layers.h"
#include "engine/prepare/preparation.h"
#include "kernels/errors.h"
#include "kernels/features/features.h"
#include "kernels/features/section_areas.h"
#include "kernels/polygons/loops.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kThinWood = 0.2 * kInch;  // mm above a boundary, where the job leaves it to the cutters
constexpr int kLevels = 31;                // at which the widest section is looked for
constexpr std::size_t kMostWays = 4;

/// The middle of the widest level sections.
double widest_level(Context& context, MeshView mesh, double height) {
    std::vector<Plane> planes;
    for (int i = 1; i <= kLevels; ++i) planes.push_back({height * i / (kLevels + 1), Side::above});
    double most = 0, best = height / 2;
    for (const Section& section : slice(context, mesh, planes))
        if (const double a = area(section.loops); a > most) most = a, best = section.plane.z;
    return best;
}

Lying both(const Lying& a, const Lying& b) {
    return {a.layers + b.layers, a.unmade_mm3 + b.unmade_mm3, std::max(a.unmade_mm, b.unmade_mm),
            a.has_room && b.has_room};
}

}  // namespace

Mesh laid_down(MeshView mesh, const std::array<double, 3>& degrees) {
    const AffineMap map = turned(degrees);
    Mesh result;
    result.facets.assign(mesh.facets.begin(), mesh.facets.end());
    result.neighbours.assign(mesh.neighbours.begin(), mesh.neighbours.end());
    result.roles.assign(mesh.roles.begin(), mesh.roles.end());
    result.vertices.resize(mesh.vertices.size());
    double lowest = kUnbounded;
    for (const Vec3f& v : mesh.vertices) lowest = std::min(lowest, map.of(to_double(v))[2]);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        const Point3 p = map.of(to_double(mesh.vertices[v]));
        result.vertices[v] = {static_cast<float>(p[0]), static_cast<float>(p[1]),
                              static_cast<float>(p[2] - lowest)};
    }
    return result;
}

LayerRequest quick_layer_request(Context& context, MeshView mesh, const Job& job) {
    // As a plan asks for its layers, but for the wood above a boundary.
    LayerRequest request;
    request.height = bounds(context, mesh).max.z;
    request.max_layer = max_layer_thickness(job);
    request.min_layer = job.layers.min_layer;
    request.min_material = job.material.min_thickness > 0 ? job.material.min_thickness : kThinWood;
    request.alpha = job.layers.alpha;
    request.beta = job.layers.beta;
    request.slab_thicknesses = job.slabs.thicknesses;
    request.facing_allowance = job.slabs.facing_allowance;
    request.saddles_constrain = job.layers.saddles_constrain;
    request.filled_underside = job.tolerances.undercut;
    request.features = find_features(context, mesh, feature_options(job)).features;
    request.section_area = SectionAreas(context, mesh);
    return request;
}

bool has_room(const Box3& box, const Job& job) {
    return double{box.max.x} - box.min.x <= job.slabs.length &&
           double{box.max.y} - box.min.y <= job.slabs.width && box.max.z <= job.machine.build_height;
}

LayersOf layers_of(Context& context, MeshView mesh, const Job& job) {
    const LayerRequest request = quick_layer_request(context, mesh, job);
    LayersOf found;
    for (const Boundary& b : place_layers(job.layers.strategy, request).boundaries) found.tops.push_back(b.z);
    Lying& result = found.lying;
    result.layers = static_cast<int>(found.tops.size());
    for (const UnmadeUndercut& u : measure_undercuts(context, mesh, found.tops, feature_options(job)))
        if (u.thickness_mm > job.tolerances.undercut) {
            result.unmade_mm3 += u.volume_mm3;
            result.unmade_mm = std::max(result.unmade_mm, u.height_mm);
        }
    result.has_room = has_room(bounds(context, mesh), job);
    return found;
}

Lying lying(Context& context, MeshView mesh, const Job& job) { return layers_of(context, mesh, job).lying; }

std::vector<WayOut> ways_out(Context& context, MeshView mesh, const MeshReport& report, const Job& job,
                             const Lying& as_it_lies) {
    std::vector<WayOut> ways;
    const auto keep = [&](const WayOut& way) {
        if (way.outcome.has_room && way.outcome.unmade_mm3 < as_it_lies.unmade_mm3 / 2) ways.push_back(way);
    };
    constexpr std::array<std::array<double, 3>, 5> sides{
        {{180, 0, 0}, {90, 0, 0}, {-90, 0, 0}, {0, 90, 0}, {0, -90, 0}}};
    for (const std::array<double, 3>& side : sides) {
        context.throw_if_cancelled();
        keep({side, std::nullopt, lying(context, laid_down(mesh, side).view(), job)});
    }
    const Box3 box = bounds(context, mesh);
    std::vector<CutPlane> planes{
        {{0, 0, 1}, double{box.max.z} / 2},
        {{1, 0, 0}, (double{box.min.x} + box.max.x) / 2},
        {{0, 1, 0}, (double{box.min.y} + box.max.y) / 2},
        {{0, 0, 1}, widest_level(context, mesh, double{box.max.z})},
    };
    if (planes[3].offset_mm == planes[0].offset_mm) planes.pop_back();
    for (const CutPlane& plane : planes) {
        context.throw_if_cancelled();
        try {
            const Halves halves = split_solid(context, mesh, report, plane, {.diameter_mm = 0});
            keep({std::nullopt, plane,
                  both(lying(context, halves.above.mesh.view(), job),
                       lying(context, halves.below.mesh.view(), job))});
        } catch (const Error& error) {
            if (error.kind() == ErrorKind::cancelled) throw;
        }
    }
    std::stable_sort(ways.begin(), ways.end(), [](const WayOut& a, const WayOut& b) {
        return std::pair(a.outcome.unmade_mm3, a.outcome.layers) <
               std::pair(b.outcome.unmade_mm3, b.outcome.layers);
    });
    if (ways.size() > kMostWays) ways.resize(kMostWays);
    return ways;
}

}  // namespace slabwright
