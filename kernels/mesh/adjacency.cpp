#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/mesh/edges.h"
#include "kernels/mesh/weld.h"

namespace slabwright {

namespace {

struct Direction {
    double x = 0, y = 0, z = 0;
};

Direction between(const Vec3f& a, const Vec3f& b) { return {double(b.x) - a.x, double(b.y) - a.y, double(b.z) - a.z}; }
double dot(const Direction& a, const Direction& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Direction cross(const Direction& a, const Direction& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

/// Grows with the angle of (x, y) from +x, 0 … 4 for a whole turn; only divides, so no library's atan2 decides an order.
double diamond_angle(double x, double y) {
    const double sum = std::abs(x) + std::abs(y);
    if (sum == 0) return 0;
    const double t = y / sum;
    if (x < 0) return 2 - t;
    return t < 0 ? 4 + t : t;
}

/// A facet at an edge, seen along the edge from low to high.
struct Blade {
    double angle;
    EdgeUse use;
};

/// Facets nearer than this (diamond angle, about a microradian) count as lying on one another: rounding to float32
/// tilts facets that are one plane in the file's origin by about as much.
constexpr double kSameAngle = 1e-6;

void link(Mesh& mesh, const EdgeUse& a, const EdgeUse& b) {
    mesh.neighbours[a.facet()][a.corner()] = b.facet();
    mesh.neighbours[b.facet()][b.corner()] = a.facet();
}

/// More than two facets at one edge. Seen along the edge from low to high and turning counter-clockwise, a facet that
/// runs high to low has the solid after it, one that runs low to high has it before: they open and close the solid like
/// brackets, and are matched like brackets around the circle. What is left over has no partner.
void pair_around_edge(Mesh& mesh, std::span<const EdgeUse> uses) {
    const Vec3f low = mesh.vertices[uses[0].low];
    const Direction edge = between(low, mesh.vertices[uses[0].high]);
    std::vector<Blade> blades;
    blades.reserve(uses.size());
    Direction u, v;
    bool framed = false;
    for (const EdgeUse& use : uses) {
        const Index3& facet = mesh.facets[use.facet()];
        const Direction arm = between(low, mesh.vertices[facet[(use.corner() + 2) % 3]]);
        const Direction across = cross(edge, arm);  // perpendicular to the edge, a quarter turn ahead of the facet
        double angle = 0;                           // a facet without area lies anywhere: with the first
        if (dot(across, across) > 0) {
            if (!framed) {
                v = across;
                u = cross(across, edge);
                framed = true;
                // Both to unit length, so that the angle is one.
                const double lu = std::sqrt(dot(u, u)), lv = std::sqrt(dot(v, v));
                u = {u.x / lu, u.y / lu, u.z / lu};
                v = {v.x / lv, v.y / lv, v.z / lv};
            }
            // The arm's own direction is `across` turned back by a quarter.
            angle = diamond_angle(dot(across, v), -dot(across, u));
            if (angle > 4 - kSameAngle) angle -= 4;
        }
        blades.push_back({angle, use});
    }
    std::sort(blades.begin(), blades.end(),
              [](const Blade& a, const Blade& b) { return a.angle != b.angle ? a.angle < b.angle : a.use.code < b.use.code; });
    // Where facets lie on one another, closing comes before opening: bodies that share a face stay bodies of their own.
    for (std::size_t begin = 0, end = 0; begin < blades.size(); begin = end) {
        end = begin + 1;
        while (end < blades.size() && blades[end].angle - blades[end - 1].angle < kSameAngle) ++end;
        std::sort(blades.begin() + static_cast<std::ptrdiff_t>(begin), blades.begin() + static_cast<std::ptrdiff_t>(end),
                  [](const Blade& a, const Blade& b) { return a.use.reversed() != b.use.reversed() ? b.use.reversed() : a.use.code < b.use.code; });
    }
    std::vector<std::size_t> open;
    std::vector<bool> done(blades.size(), false);
    for (int turn = 0; turn < 2; ++turn) {  // the second turn closes what began before the start of the circle
        for (std::size_t i = 0; i < blades.size(); ++i) {
            if (done[i]) continue;
            if (blades[i].use.reversed()) {
                if (turn == 0) open.push_back(i);
            } else if (!open.empty()) {
                link(mesh, blades[open.back()].use, blades[i].use);
                done[open.back()] = done[i] = true;
                open.pop_back();
            }
        }
    }
}

}  // namespace

void pair_edges(Context& context, Mesh& mesh) {
    mesh.neighbours.assign(mesh.facets.size(), Index3{kNoFacet, kNoFacet, kNoFacet});
    struct Nothing {};
    reduce_edges(
        context, mesh.facets, mesh.vertices.size(), Nothing{},
        [&](Nothing&, std::span<const EdgeUse> uses) {
            if (uses.size() == 2) {
                if (uses[0].reversed() != uses[1].reversed()) link(mesh, uses[0], uses[1]);
            } else if (uses.size() > 2) {
                pair_around_edge(mesh, uses);
            }
        },
        [](Nothing, Nothing) { return Nothing{}; });
}

}  // namespace slabwright
