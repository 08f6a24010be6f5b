// What stands along a pattern's sharp edges when a plan is cut: told from its moves alone, by the exact
// envelope of each over single points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "kernels/features/edge_chains.h"
#include "kernels/features/facet_classes.h"
#include "kernels/geometry/units.h"
#include "kernels/stock/sweep.h"

namespace slabwright::test {

/// Beside a point of a sharp edge, mm: where the stock is asked for, the surface there, and the upward part
/// of its normal.
struct EdgeProbe {
    double x = 0, y = 0, surface = 0, nz = 1;
    bool convex = false;
    double stands = 0;  ///< height of the stock
    [[nodiscard]] double error() const { return (stands - surface) * nz; }
};

/// Points every millimetre of the edges that face upwards, moved 0.02 mm: into the solid beside a convex
/// edge, out of it beside a concave one.
inline std::vector<EdgeProbe> edge_probes(Context& context, MeshView mesh, double least_deg) {
    constexpr double kAside = 0.02, kApart = 1, kUp = 0.05;
    std::vector<EdgeProbe> probes;
    for (const EdgeChain& chain : find_edge_chains(context, mesh, least_deg))
        for (std::size_t i = 0; i < chain.sides.size(); ++i) {
            const Vec3d from = to_double(mesh.vertices[chain.vertices[i]]),
                        to = to_double(mesh.vertices[chain.vertices[(i + 1) % chain.vertices.size()]]);
            std::array<Vec3d, 2> n{};
            for (std::size_t k = 0; k < 2; ++k) {
                const Vec3d a = area_normal(mesh, chain.sides[i][k]);
                n[k] = scaled(1 / length(a), a);
            }
            if (std::min(n[0][2], n[1][2]) < -0.01 || std::max(n[0][2], n[1][2]) < kUp) continue;
            const double mx = n[0][0] + n[1][0], my = n[0][1] + n[1][1], level = std::hypot(mx, my);
            const double aside = level > 1e-6 ? (chain.convex ? -kAside : kAside) / level : 0;
            const auto steps = static_cast<int>(length(minus(to, from)) / kApart) + 1;
            for (int s = 0; s < steps; ++s) {
                const Vec3d at = between(from, to, (s + 0.5) / steps);
                EdgeProbe p{at[0] + aside * mx, at[1] + aside * my, 0, 1, chain.convex, 0};
                p.surface = chain.convex ? 1e9 : -1e9;
                for (const Vec3d& f : n) {
                    if (f[2] < kUp) continue;
                    const double z = at[2] - (f[0] * (p.x - at[0]) + f[1] * (p.y - at[1])) / f[2];
                    if (chain.convex ? z < p.surface : z > p.surface) p.surface = z, p.nz = f[2];
                }
                probes.push_back(p);
            }
        }
    return probes;
}

/// Puts into each probe what stands there when the layer that it lies in is cut; those in no layer stand at
/// their surface. The plan has straight moves only.
inline void cut_probes(const Plan& plan, std::vector<EdgeProbe>& probes) {
    constexpr double kBin = 4;
    for (EdgeProbe& p : probes) p.stands = p.surface;
    for (const Layer& layer : plan.layers) {
        std::map<std::array<int, 2>, std::vector<std::size_t>> bins;
        for (std::size_t i = 0; i < probes.size(); ++i) {
            EdgeProbe& p = probes[i];
            if (p.surface < layer.z_bottom || p.surface >= layer.z_top) continue;
            p.stands = layer.z_top;
            bins[{static_cast<int>(std::floor(p.x / kBin)), static_cast<int>(std::floor(p.y / kBin))}]
                .push_back(i);
        }
        for (const Operation& op : layer.operations) {
            const auto tool = std::find_if(plan.job.tools.begin(), plan.job.tools.end(),
                                           [&](const Tool& t) { return t.number == op.tool; });
            const CutterEnd end = cutter_end(cutter_shape(*tool));
            const double r = tool->diameter / 2;
            for (std::size_t m = 1; m < op.moves.size(); ++m) {
                if (op.moves[m].feed == 0) continue;
                const auto place = [&](const Move& move) {
                    return std::array<double, 3>{to_mm(move.x), to_mm(move.y), to_mm(move.z)};
                };
                const std::array<double, 3> a = place(op.moves[m - 1]), b = place(op.moves[m]);
                const auto bin = [&](double v) { return static_cast<int>(std::floor(v / kBin)); };
                for (int i = bin(std::min(a[0], b[0]) - r); i <= bin(std::max(a[0], b[0]) + r); ++i)
                    for (int j = bin(std::min(a[1], b[1]) - r); j <= bin(std::max(a[1], b[1]) + r); ++j) {
                        const auto here = bins.find({i, j});
                        if (here == bins.end()) continue;
                        for (const std::size_t k : here->second) {
                            EdgeProbe& p = probes[k];
                            if (std::min(a[2], b[2]) >= p.stands) continue;
                            sweep(CellGrid{p.x, p.y, 0.1, 1, 1}, end, a, b,
                                  [&](std::size_t, double z) { p.stands = std::min(p.stands, z); });
                        }
                    }
            }
        }
    }
}

/// Of the probes at which no more than a millimetre stands: more is what no tool of the plan reaches.
struct EdgeErrors {
    static constexpr double kSeen = 0.02;            ///< mm: as much as cutting.edges leaves alone
    std::size_t points = 0, beyond = 0, seen = 0;    ///< seen: of the points, those over kSeen
    double mean = 0, p95 = 0, worst = 0, least = 0;  ///< mm along the normal
    std::array<double, 3> worst_at{};                ///< mm
};

/// @param convex which edges
inline EdgeErrors edge_errors(const std::vector<EdgeProbe>& probes, bool convex) {
    std::vector<double> errors;
    EdgeErrors all;
    for (const EdgeProbe& p : probes) {
        if (p.convex != convex) continue;
        if (p.error() > 1) ++all.beyond;
        else errors.push_back(p.error());
        if (p.error() <= 1 && p.error() > all.worst) {
            all.worst = p.error();
            all.worst_at = {p.x, p.y, p.surface};
        }
    }
    if (errors.empty()) return all;
    std::sort(errors.begin(), errors.end());
    all.points = errors.size();
    all.seen = static_cast<std::size_t>(
        std::count_if(errors.begin(), errors.end(), [](double e) { return e > EdgeErrors::kSeen; }));
    for (const double e : errors) all.mean += e / static_cast<double>(errors.size());
    all.p95 = errors[errors.size() * 95 / 100];
    all.least = errors.front();
    all.worst = errors.back();
    return all;
}

}  // namespace slabwright::test
