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

/// Whether something about a fan needs a closer look than its adjacency gives: an edge that is not shared by just two facets which run
/// along it in opposite directions; two facets that share two edges, as duplicates do; or so many uses that this is not asked.
bool is_odd(std::span<const EdgeUse> fan) {
    if (fan.size() > kPlainFan || fan.size() % 2 != 0) return true;
    for (std::size_t i = 0; i < fan.size(); i += 2) {
        if (fan[i].high != fan[i + 1].high || fan[i].reversed() == fan[i + 1].reversed()) return true;
        if (i > 0 && fan[i].high == fan[i - 1].high) return true;
        const std::uint32_t a = fan[i].facet(), b = fan[i + 1].facet();
        for (std::size_t j = 0; j < i; j += 2)
            if (fan[j].facet() == a && fan[j + 1].facet() == b) return true;
    }
    return false;
}

}  // namespace

void pair_edges(Context& context, Mesh& mesh, std::vector<std::uint32_t>* odd) {
    EdgeScratch scratch;
    pair_edges(context, mesh, scratch, odd);
}

void pair_edges(Context& context, Mesh& mesh, EdgeScratch& scratch, std::vector<std::uint32_t>* odd) {
    mesh.neighbours.resize(mesh.facets.size());
    parallel_for(context, mesh.neighbours.size(), std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) mesh.neighbours[f] = {kNoFacet, kNoFacet, kNoFacet};
    });
    using Vertices = std::vector<std::uint32_t>;
    Vertices found = reduce_fans(
        context, mesh.facets, mesh.vertices.size(), scratch, Vertices{}, [](std::uint32_t) { return true; },
        [&](Vertices& part, std::span<const EdgeUse> fan) {
            if (odd != nullptr && is_odd(fan)) part.push_back(fan[0].low);
            each_edge(fan, [&](std::span<const EdgeUse> uses) {
                if (uses.size() == 2) {
                    if (uses[0].reversed() != uses[1].reversed()) link(mesh, uses[0], uses[1]);
                } else if (uses.size() > 2) {
                    pair_around_edge(mesh, uses);
                }
            });
        },
        [](Vertices a, const Vertices& b) {
            a.insert(a.end(), b.begin(), b.end());
            return a;
        });
    if (odd != nullptr) *odd = std::move(found);
}

}  // namespace slabwright
