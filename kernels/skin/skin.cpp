#include "kernels/skin/skin.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "kernels/access/closest_point.h"
#include "kernels/errors.h"
#include "kernels/mesh/simplify.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/parallel.h"
#include "kernels/repair/repair.h"
#include "kernels/skin/offset_vertex.h"
#include "kernels/voxels/level_set.h"

namespace slabwright {

namespace {

constexpr double kMitre = 4;        // skins that a corner may go: 1/sin of half an edge's angle, 29°
constexpr double kCoarsest = 0.75;  // mm, cell of the grid
constexpr double kCellsAcross = 2;  // of a skin
constexpr double kMostSkinCells = 60e6;
constexpr double kBytesPerSkinCell = 8;
constexpr double kBaseShare = 0.02;  // of a cell: what lies so near to the lowest level lies in it
constexpr double kThinned = 0.005;   // mm, by which facets may move for there to be fewer
constexpr int kMostRounds = 4;       // of a level set that is made a little farther out
constexpr std::size_t kGrain = 4096;

using Normals = std::vector<Vec3d>;  ///< of facets, unit; zero where a facet has no area

Vec3d vertex(MeshView mesh, std::uint32_t v) { return to_double(mesh.vertices[v]); }

Vec3d twice_area(MeshView mesh, const Index3& f) {
    const Vec3d a = vertex(mesh, f[0]);
    return cross(minus(vertex(mesh, f[1]), a), minus(vertex(mesh, f[2]), a));
}

Vec3d middle(MeshView mesh, std::size_t f) {
    const Index3& i = mesh.facets[f];
    return scaled(1.0 / 3, plus(plus(vertex(mesh, i[0]), vertex(mesh, i[1])), vertex(mesh, i[2])));
}

Normals normals_of(Context& context, MeshView mesh) {
    Normals normals(mesh.size());
    parallel_for(context, mesh.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            const Vec3d n = twice_area(mesh, mesh.facets[f]);
            if (const double size = length(n); size > 0) normals[f] = scaled(1 / size, n);
        }
    });
    return normals;
}

/// Which facets are to have the skin.
std::vector<char> chosen_facets(MeshView mesh, const Normals& normals, const Skin& skin) {
    std::vector<char> chosen(mesh.size(), 1);
    Vec3d way{};
    if (skin.normal) way = scaled(1 / length(*skin.normal), *skin.normal);
    const double least = std::cos(skin.angle_deg * std::numbers::pi / 180) - 1e-9;
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        if (skin.normal && !(length(normals[f]) > 0 && dot(normals[f], way) >= least)) chosen[f] = 0;
        if (!skin.box) continue;
        for (const std::uint32_t v : mesh.facets[f])
            for (std::size_t k = 0; k < 3; ++k)
                if (const double x = vertex(mesh, v)[k];
                    x < (*skin.box)[k] - 1e-4 || x > (*skin.box)[k + 3] + 1e-4)
                    chosen[f] = 0;
    }
    return chosen;
}

/// The facets around every vertex: list[starts[v]] … list[starts[v + 1] − 1].
struct Rings {
    std::vector<std::uint32_t> starts, list;
    explicit Rings(MeshView mesh) : starts(mesh.vertices.size() + 1, 0), list(3 * mesh.size()) {
        for (const Index3& f : mesh.facets)
            for (const std::uint32_t v : f) ++starts[v + 1];
        for (std::size_t v = 1; v < starts.size(); ++v) starts[v] += starts[v - 1];
        std::vector<std::uint32_t> at(starts.begin(), starts.end() - 1);
        for (std::size_t f = 0; f < mesh.size(); ++f)
            for (const std::uint32_t v : mesh.facets[f]) list[at[v]++] = static_cast<std::uint32_t>(f);
    }
    [[nodiscard]] std::span<const std::uint32_t> of(std::size_t v) const {
        return std::span(list).subspan(starts[v], starts[v + 1] - starts[v]);
    }
};

/// Where a vertex goes, in skins. Facets without skin stay in their planes where that is possible, else they
/// too go outwards.
std::optional<Vec3d> way_of(std::span<const std::uint32_t> ring, const Normals& normals,
                            const std::vector<char>& chosen) {
    std::vector<OffsetPlane> planes;
    bool moves = false;
    for (const std::uint32_t f : ring) {
        if (!(length(normals[f]) > 0)) continue;
        planes.push_back({normals[f], chosen[f] != 0 ? 1.0 : 0.0});
        moves = moves || chosen[f] != 0;
    }
    if (!moves) return Vec3d{};
    const std::size_t outwards = planes.size();
    for (std::size_t p = 0; p < outwards; ++p)
        if (planes[p].move == 0) planes.push_back({scaled(-1, planes[p].normal), 0});
    if (const std::optional<Vec3d> v = offset_vertex(planes); v && length(*v) <= kMitre) return v;
    planes.resize(outwards);
    return offset_vertex(planes);
}

/// Points of a mesh at which it is measured: vertices, and the middles of edges and facets.
std::vector<Point3> points_of(MeshView mesh, const std::vector<char>& chosen) {
    std::vector<Point3> points;
    std::vector<char> seen(mesh.vertices.size(), 0);
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        if (!chosen.empty() && chosen[f] == 0) continue;
        const Index3& i = mesh.facets[f];
        points.push_back(middle(mesh, f));
        for (std::size_t k = 0; k < 3; ++k) {
            if (seen[i[k]] == 0) points.push_back(vertex(mesh, i[k]));
            seen[i[k]] = 1;
            if (i[k] < i[(k + 1) % 3])
                points.push_back(between(vertex(mesh, i[k]), vertex(mesh, i[(k + 1) % 3]), 0.5));
        }
    }
    return points;
}

struct Measured {
    double least = kUnbounded, most = 0;
    Point3 where{};  ///< of the least
};

void measure(Context& context, const std::vector<Point3>& points, const ClosestPoint& from, double radius,
             Measured& measured) {
    std::vector<double> distances(points.size());
    parallel_for(context, points.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p)
            distances[p] = from.query_unsigned(points[p], radius).distance;
    });
    for (std::size_t p = 0; p < points.size(); ++p) {
        measured.most = std::max(measured.most, distances[p]);
        if (distances[p] < measured.least) measured.least = distances[p], measured.where = points[p];
    }
}

/// Distances between model and skin; of a skin on some facets from the skin to them alone.
Measured measure_skin(Context& context, MeshView model, MeshView skin, const std::vector<char>& chosen,
                      double mm) {
    const bool everywhere = std::find(chosen.begin(), chosen.end(), 0) == chosen.end();
    const double radius = (kMitre + 1) * mm;
    Measured measured;
    if (everywhere) {
        measure(context, points_of(skin, {}), ClosestPoint(context, model), radius, measured);
        measure(context, points_of(model, {}), ClosestPoint(context, skin), radius, measured);
        return measured;
    }
    Mesh part;
    part.vertices.assign(model.vertices.begin(), model.vertices.end());
    for (std::size_t f = 0; f < model.size(); ++f)
        if (chosen[f] != 0) part.facets.push_back(model.facets[f]);
    measure(context, points_of(skin, chosen), ClosestPoint(context, part.view()), radius, measured);
    return measured;
}

/// By vertices; `reason` says why not. @returns whether the skin is valid
bool by_vertices(Context& context, MeshView mesh, const Normals& normals, const std::vector<char>& chosen,
                 double mm, Skinned& result) {
    const Rings rings(mesh);
    std::vector<Vec3d> ways(mesh.vertices.size());
    std::vector<char> lost(mesh.vertices.size(), 0);
    parallel_for(context, ways.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const std::optional<Vec3d> way = way_of(rings.of(v), normals, chosen);
            if (!way || length(*way) > kMitre) lost[v] = 1;
            else ways[v] = *way;
        }
    });
    const auto refuse = [&](std::size_t count, const char* what, const Point3& where) {
        result.reason = fmt::format("{} {}", count, what);
        result.where = where;
        return false;
    };
    if (const auto first = std::find(lost.begin(), lost.end(), 1); first != lost.end())
        return refuse(static_cast<std::size_t>(std::count(lost.begin(), lost.end(), 1)),
                      "vertices have no place near enough",
                      vertex(mesh, static_cast<std::uint32_t>(first - lost.begin())));
    Mesh& moved = result.mesh;
    moved.vertices.resize(mesh.vertices.size());
    for (std::size_t v = 0; v < ways.size(); ++v) {
        const Vec3d p = plus(to_double(mesh.vertices[v]), ways[v], mm);
        moved.vertices[v] = {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
    }
    moved.facets.assign(mesh.facets.begin(), mesh.facets.end());
    moved.neighbours.assign(mesh.neighbours.begin(), mesh.neighbours.end());
    std::size_t turned = 0, first = 0;
    for (std::size_t f = mesh.size(); f-- > 0;)
        if (length(normals[f]) > 0 && !(dot(twice_area(moved.view(), moved.facets[f]), normals[f]) > 0))
            ++turned, first = f;
    if (turned > 0) return refuse(turned, "facets turn over", middle(mesh, first));
    const Measured measured = measure_skin(context, mesh, moved.view(), chosen, mm);
    result.least_mm = measured.least, result.most_mm = measured.most;
    if (measured.least < mm - kSkinTolerance)
        return refuse(1, "place where it would be too thin", measured.where);
    result.report = report_mesh(context, moved.view());
    return true;
}

void by_level_set(Context& context, MeshView mesh, const MeshReport& report, const std::vector<char>& chosen,
                  double mm, Skinned& result) {
    result.method = SkinMethod::level_set;
    const auto cells = [&](double cell) { return report.area_mm2 * (mm / cell + 6) / (cell * cell); };
    double cell = std::min(kCoarsest, mm / kCellsAcross);
    while (cells(cell) > kMostSkinCells) cell *= 1.1;
    result.cell_mm = cell;
    const MemoryCharge charge(context, static_cast<std::uint64_t>(cells(cell) * kBytesPerSkinCell),
                              "the cells of a skin");
    const ClosestPoint closest(context, mesh);
    const double radius = 2 * mm + 4 * cell;
    const auto distance = [&](const Point3& p) { return closest.query_unsigned(p, radius).distance; };
    double farther = 3 * cell * cell / (8 * mm) + kThinned;
    for (int round = 0; round < kMostRounds; ++round) {
        result.mesh = offset_surface(context, mesh, distance, {mm + farther, cell});
        float lowest = bounds(context, result.mesh.view()).min.z;
        for (Vec3f& v : result.mesh.vertices)
            if (double{v.z} - lowest < kBaseShare * cell) v.z = lowest;
        pair_edges(context, result.mesh);
        result.report = report_mesh(context, result.mesh.view());
        if (!is_solid(result.report)) {
            Mended mended = mend(context, result.mesh.view(), result.report);
            result.mesh = std::move(mended.mesh);
            result.report = std::move(mended.report);
        }
        // A grid has far more facets than the surface needs.
        if (is_solid(result.report)) {
            result.mesh = simplify(context, result.mesh.view(), kThinned);
            result.report = report_mesh(context, result.mesh.view());
        }
        const Measured measured = measure_skin(context, mesh, result.mesh.view(), chosen, mm);
        result.least_mm = measured.least, result.most_mm = measured.most;
        if (measured.least >= mm - kSkinTolerance) return;
        result.where = measured.where;
        farther += mm - measured.least;
    }
}

}  // namespace

Skinned add_skin(Context& context, MeshView mesh, const Skin& skin) {
    Skinned result;
    const Normals normals = normals_of(context, mesh);
    const std::vector<char> chosen = chosen_facets(mesh, normals, skin);
    result.facets_on = static_cast<std::uint64_t>(std::count(chosen.begin(), chosen.end(), 1));
    if (result.facets_on == 0)
        throw Error(ErrorKind::input, "skin.none", "no facet lies where the skin is asked for",
                    "prepare.skin_normal, prepare.skin_box", "ask for another normal, or a larger box");
    if (by_vertices(context, mesh, normals, chosen, skin.mm, result)) return result;
    const auto place = [&] {
        return fmt::format("({:.2f}, {:.2f}, {:.2f}) mm", result.where[0], result.where[1], result.where[2]);
    };
    if (result.facets_on < mesh.size())
        throw Error(ErrorKind::input, "skin.impossible",
                    fmt::format("the chosen facets cannot move {:g} mm alone: {}", skin.mm, result.reason),
                    place(), "give less skin, or give it to all facets");
    const MeshReport report = report_mesh(context, mesh);
    if (report.open_edges.count > 0)
        throw Error(ErrorKind::input, "skin.open",
                    "a skin cannot be made by vertices (" + result.reason +
                        "), and the base is open, so it has no inside",
                    place(), "close the base with --repair first");
    by_level_set(context, mesh, report, chosen, skin.mm, result);
    if (result.mesh.facets.empty() || !is_solid(result.report) || result.least_mm < skin.mm - kSkinTolerance)
        throw Error(ErrorKind::input, "skin.thin",
                    fmt::format("a skin of {:g} mm comes out {:.3f} mm thin", skin.mm, result.least_mm),
                    place(), "ask for another skin, or repair the mesh first");
    return result;
}

}  // namespace slabwright
