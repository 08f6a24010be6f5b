#include "io/write/report_reach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include "engine/simulate/reach.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kReachCells = 2'500;  // of the surface, that the accessibility map aims at

}  // namespace

ReachMap reach_map(Context& context, const StandingPart& part, const SimulationInput& input, double board,
                   MeshView model) {
    const auto reach_of = [&](std::size_t l) {
        const SimulatedLayer& layer = input.layers[l];
        return std::make_unique<Reach>(part, input.tools, layer.z_bottom, layer.z_top,
                                       l == 0 ? layer.z_bottom - board : -kUnbounded);
    };

    struct FacetSide {
        Point3 middle{}, normal{};
        double area = 0;
    };
    const auto side_of = [&](std::size_t f) {
        const Vec3f &a = model.vertices[model.facets[f][0]], &b = model.vertices[model.facets[f][1]],
                    &c = model.vertices[model.facets[f][2]];
        const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z;
        const double vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
        const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx,
                     n = std::sqrt(nx * nx + ny * ny + nz * nz);
        FacetSide side{
            {(double{a.x} + b.x + c.x) / 3, (double{a.y} + b.y + c.y) / 3, (double{a.z} + b.z + c.z) / 3},
            {},
            n / 2};
        if (n > 0) side.normal = {nx / n, ny / n, nz / n};
        return side;
    };
    ReachMap map;
    map.codes.assign(model.facets.size(), '\0');
    double area = 0;
    for (std::size_t f = 0; f < model.facets.size(); ++f) area += side_of(f).area;
    map.cell_mm = std::max(0.1, std::sqrt(area / kReachCells));
    std::map<std::array<long, 6>, std::size_t> groups;
    std::vector<FacetSide> asked;
    std::vector<std::size_t> group(model.facets.size(), 0);
    for (std::size_t f = 0; f < model.facets.size(); ++f) {
        const FacetSide side = side_of(f);
        if (!(side.area > 0) || side.normal[2] < -1e-3) continue;
        std::array<long, 6> key{};
        for (std::size_t k = 0; k < 3; ++k) {
            key[k] = std::lround(std::floor(side.middle[k] / map.cell_mm));
            key[k + 3] = std::lround(2 * side.normal[k]);
        }
        const auto [entry, fresh] = groups.try_emplace(key, asked.size());
        if (fresh) asked.push_back(side);
        group[f] = entry->second + 1;
    }
    std::string answers(asked.size(), '\0');
    parallel_for(context, asked.size(), 64, [&](std::size_t begin, std::size_t end) {
        std::vector<std::unique_ptr<Reach>> reaches(
            input.layers.size());  // a search remembers, so that no two threads may share it
        for (std::size_t i = begin; i < end; ++i) {
            Point3 p = asked[i].middle;
            std::size_t layer = 0;
            while (layer + 1 < input.layers.size() && p[2] > input.layers[layer].z_top) ++layer;
            for (std::size_t k = 0; k < 3; ++k) p[k] += kReachDistance * asked[i].normal[k];
            if (!reaches[layer]) reaches[layer] = reach_of(layer);
            answers[i] = reaches[layer]->reachable(p) ? 1 : 2;
        }
    });
    for (std::size_t f = 0; f < model.facets.size(); ++f)
        if (group[f] > 0) map.codes[f] = answers[group[f] - 1];
    return map;
}

}  // namespace slabwright
