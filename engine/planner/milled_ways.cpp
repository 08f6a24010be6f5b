#include "engine/planner/milled_ways.h"

#include <algorithm>

#include "engine/layers/both_sides.h"
#include "engine/planner/ways_out.h"
#include "engine/prepare/preparation.h"

namespace slabwright {

namespace {

/// Places of the mesh laid down by `map` and set on z = 0, as places of the mesh.
void put_back(UnmadeAir& air, const AffineMap& map, double lowest) {
    for (UnmadePocket& pocket : air.pockets) {
        const Point3 p{pocket.at[0], pocket.at[1], pocket.at[2] + lowest};
        for (std::size_t c = 0; c < 3; ++c)  // a turn's inverse is its transpose
            pocket.at[c] = map.rows[0][c] * p[0] + map.rows[1][c] * p[1] + map.rows[2][c] * p[2];
    }
}

}  // namespace

MilledWay milled_way(Context& context, MeshView mesh, const Job& job, const std::array<double, 3>& turn) {
    MilledWay way;
    way.turn = turn;
    const AffineMap map = turned(turn);
    double lowest = kUnbounded;
    for (const Vec3f& v : mesh.vertices) lowest = std::min(lowest, map.of(to_double(v))[2]);
    const Mesh laid = laid_down(mesh, turn);
    const Box3 box = bounds(context, laid.view());
    way.size = minus(to_double(box.max), to_double(box.min));
    way.has_room = has_room(box, job);
    const LayerRequest request = quick_layer_request(context, laid.view(), job);
    const AirGaps gaps = air_gaps(context, laid.view(), filled_cell(laid.view()));
    const auto made = [&](const LayerPlacement& placement, MilledFrom milled) {
        MilledLayers layers;
        for (const Boundary& b : placement.boundaries) layers.tops.push_back(b.z);
        layers.air = unmade_air(context, gaps, layers.tops, milled);
        put_back(layers.air, map, lowest);
        return layers;
    };
    way.above = made(place_layers(job.layers.strategy, request), MilledFrom::above);
    way.both_sides =
        made(place_layers_both_sides(request, gaps, {.filled_gap = job.tolerances.undercut, .step_mm3 = 0}),
             MilledFrom::both_sides);
    return way;
}

std::vector<MilledWay> milled_ways(Context& context, MeshView mesh, const Job& job) {
    constexpr std::array<std::array<double, 3>, 6> sides{
        {{0, 0, 0}, {180, 0, 0}, {90, 0, 0}, {-90, 0, 0}, {0, 90, 0}, {0, -90, 0}}};
    std::vector<MilledWay> ways;
    for (const std::array<double, 3>& side : sides) {
        context.throw_if_cancelled();
        ways.push_back(milled_way(context, mesh, job, side));
    }
    return ways;
}

}  // namespace slabwright
