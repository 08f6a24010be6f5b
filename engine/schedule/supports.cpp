#include "engine/schedule/supports.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "engine/stock/loose.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/weld.h"
#include "kernels/polygons/pieces.h"
#include "kernels/polygons/thinned.h"

namespace slabwright {

namespace {

constexpr double kWidest = 20;      // mm, a column's side
constexpr double kNarrowest = 2.5;  // mm
constexpr double kPitch = 100;      // mm between columns under one piece
constexpr std::size_t kMostUnderOne = 16;
constexpr double kEmbedded = 0.3;  // mm that a column reaches into the wood under and over it
constexpr double kBeside = 2;      // mm beside what carries that do not count as overhang
constexpr double kFine = 0.05;     // mm by which outlines may be thinned here

struct Spot {
    double x = 0, y = 0, room = 0;  // mm; a disc of radius room lies in the region
};

// The place of a region with the most room around it, by halving; of equals the lowest, then the leftmost.
std::optional<Spot> roomiest(const Loops& region) {
    if (region.empty()) return std::nullopt;
    Box2 box;
    for (const Point2 p : region.points) box.grow(p);
    double low = 0,
           high =
               to_mm(std::min(std::int64_t{box.max.x} - box.min.x, std::int64_t{box.max.y} - box.min.y)) / 2;
    Loops inside = region;
    while (high - low > std::max(0.1, low / 20)) {
        const double middle = (low + high) / 2;
        Loops smaller = offset(region, -middle, kFine);
        if (smaller.empty()) high = middle;
        else low = middle, inside = std::move(smaller);
    }
    if (low < kNarrowest / std::sqrt(2.0)) return std::nullopt;
    const Point2 p = *std::min_element(inside.points.begin(), inside.points.end(),
                                       [](Point2 a, Point2 b) { return a.y != b.y ? a.y < b.y : a.x < b.x; });
    return Spot{to_mm(p.x), to_mm(p.y), low};
}

Loops square(double x, double y, double side) {
    Loops loops;
    const Point2 a{to_units(x - side / 2), to_units(y - side / 2)},
        b{to_units(x + side / 2), to_units(y + side / 2)};
    loops.points = {a, {b.x, a.y}, b, {a.x, b.y}};
    loops.close_loop();
    nest(loops);
    return loops;
}

// Columns under a region of a layer's wood, `pitch` apart.
void stand_under(const Plan& plan, std::span<const std::vector<JointWood>> wood, std::size_t layer,
                 const Loops& region, double pitch, std::vector<Support>& supports) {
    Loops left = thinned(region, kFine);
    for (std::size_t count = 0; count < kMostUnderOne; ++count) {
        const std::optional<Spot> spot = roomiest(left);
        if (!spot) return;
        Support support;
        support.layer = plan.layers[layer].index;
        support.x = spot->x, support.y = spot->y;
        support.width = std::min(kWidest, spot->room * std::sqrt(2.0));
        const Layer& carried = plan.layers[layer];
        support.z_high = carried.z_bottom + std::min(kEmbedded, (carried.z_top - carried.z_bottom) / 4);
        const Loops foot = square(support.x, support.y, support.width);
        for (std::size_t j = layer; j-- > 1;)
            if (subtract(foot, wood[j].front().below).empty()) {
                support.z_low = plan.layers[j].z_bottom - kEmbedded;
                break;
            }
        supports.push_back(support);
        left = subtract(left, square(support.x, support.y, 2 * pitch));
    }
}

// What of a layer's wood has nothing under it.
Loops hanging(const JointWood& wood) {
    return subtract(thinned(wood.above, kFine), offset(thinned(wood.below, kFine), kBeside, kFine));
}

}  // namespace

std::vector<Support> place_supports(const Plan& plan, std::span<const std::vector<JointWood>> wood) {
    std::vector<Support> supports;
    Plan trial = plan;
    std::vector<Diagnostic> notes;
    for (std::size_t i = 0; i < trial.layers.size(); ++i) {
        (void)bond_layer(trial.layers[i], wood[i], trial, notes);
        if (i == 0) continue;
        // Room is looked for where the piece still stands a quarter of the layer up, if it does.
        const Pieces pieces(wood[i].front().above), contact(wood[i].front().both);
        for (std::size_t p = 0; p < pieces.size(); ++p) {
            if (area(pieces.regions[p]) < kChip ||
                area(contact.within(pieces.regions[p], pieces.boxes[p])) > kNoContact)
                continue;
            const Loops stands = intersect(pieces.regions[p], wood[i].front().higher[0]);
            const std::size_t before = supports.size();
            stand_under(plan, wood, i, stands, kPitch, supports);
            if (supports.size() == before) stand_under(plan, wood, i, pieces.regions[p], kPitch, supports);
        }
    }
    const std::vector<std::vector<WeakJoint>> weak = slabs_that_tip(trial, wood, notes);
    std::vector<bool> done(plan.layers.size(), false);
    for (std::size_t i = 0; i < weak.size(); ++i) {
        if (weak[i].empty()) continue;
        // The first layer on that joint whose overhang is more than what carries it, or else the widest one.
        const double carries = area(wood[i].front().both);
        std::size_t widest = 0;
        double most = 0;
        Loops under;
        for (std::size_t k = std::max<std::size_t>(i, 1); k < plan.layers.size(); ++k) {
            Loops over = hanging(wood[k].front());
            const double mm2 = area(over);
            if (mm2 <= most) continue;
            most = mm2, widest = k, under = std::move(over);
            if (mm2 > 2 * carries) break;
        }
        if (most > 0 && !done[widest]) {
            done[widest] = true;
            stand_under(plan, wood, widest, under, kPitch, supports);
        }
    }
    return supports;
}

Mesh with_supports(Context& context, MeshView pattern, std::span<const Support> supports) {
    Mesh mesh;
    mesh.vertices.assign(pattern.vertices.begin(), pattern.vertices.end());
    mesh.facets.assign(pattern.facets.begin(), pattern.facets.end());
    mesh.neighbours.assign(pattern.neighbours.begin(), pattern.neighbours.end());
    for (const Support& s : supports) {
        const auto vertex = static_cast<std::uint32_t>(mesh.vertices.size()),
                   facet = static_cast<std::uint32_t>(mesh.facets.size());
        for (int k = 0; k < 8; ++k)
            mesh.vertices.push_back({static_cast<float>(s.x + ((k & 1) != 0 ? 0.5 : -0.5) * s.width),
                                     static_cast<float>(s.y + ((k & 2) != 0 ? 0.5 : -0.5) * s.width),
                                     static_cast<float>((k & 4) != 0 ? s.z_high : s.z_low)});
        constexpr std::array<std::array<std::uint32_t, 4>, 6> sides{
            {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
        Mesh box;
        for (const auto& q : sides) {
            box.facets.push_back({q[0], q[1], q[2]});
            box.facets.push_back({q[0], q[2], q[3]});
        }
        box.vertices.assign(mesh.vertices.end() - 8, mesh.vertices.end());
        pair_edges(context, box);
        for (Index3 f : box.facets) {
            for (std::uint32_t& v : f) v += vertex;
            mesh.facets.push_back(f);
        }
        for (Index3 n : box.neighbours) {
            for (std::uint32_t& f : n) f += facet;
            mesh.neighbours.push_back(n);
        }
    }
    mesh.roles = facet_roles(context, mesh.view());
    return mesh;
}

}  // namespace slabwright
