#include "kernels/repair/repair.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/mesh/weld.h"
#include "kernels/parallel/parallel.h"
#include "kernels/repair/bodies.h"
#include "kernels/repair/duplicates.h"
#include "kernels/repair/holes.h"
#include "kernels/repair/inner_walls.h"
#include "kernels/repair/orient.h"
#include "kernels/repair/stitch.h"

namespace slabwright {

namespace {

constexpr double kStitchShare = 1e-3;  // of the diagonal
constexpr double kHoleShare = 0.05;    // likewise

// A mesh of many loose borders closes or not by which of them meet first, so a turned or scaled copy of one
// that closes may not. Other distances are tried where the first leaves it open, as shares of that.
constexpr std::array<double, 4> kOtherStitches{0.4, 1.6, 2.0, 0.1};
constexpr std::size_t kMostTriedAgain = 2'000'000;  // facets
constexpr double kThinOfStitch = 4;                 // a slit may be so many times as wide as a crack

double diagonal(const Box3& box) {
    const Xyz d = minus(xyz(box.max), xyz(box.min));
    return length(d);
}

/// The facets with the vertices that they use, numbered by first use, and with neighbours.
Mesh finished(Context& context, const FacetSoup& soup) {
    Mesh mesh;
    std::vector<std::uint32_t> number(soup.vertices.size(), kNoFacet);
    mesh.facets.resize(soup.facets.size());
    for (std::size_t f = 0; f < soup.facets.size(); ++f)
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t& n = number[soup.facets[f][k]];
            if (n == kNoFacet) {
                n = static_cast<std::uint32_t>(mesh.vertices.size());
                mesh.vertices.push_back(soup.vertices[soup.facets[f][k]]);
            }
            mesh.facets[f][k] = n;
        }
    pair_edges(context, mesh);
    return mesh;
}

/// What is said of facets, after some were dropped.
std::vector<bool> kept(const std::vector<bool>& all, const std::vector<bool>& dropped) {
    if (dropped.empty()) return all;
    std::vector<bool> rest;
    for (std::size_t f = 0; f < all.size(); ++f)
        if (!dropped[f]) rest.push_back(all[f]);
    return rest;
}

void note(Mended& mended, Defect defect, std::uint64_t count, double size, const Xyz& where) {
    MendedDefect& to = mended.found[static_cast<std::size_t>(defect)];
    if (count == 0) return;
    if (to.count == 0 || size > to.size) to.size = size, to.where = where;
    to.count += count;
}

void note_left(Mended& mended, const Filled& filled, const Turned& turned) {
    mended.left.holes = filled.left;
    mended.left.hole_mm = filled.left_mm;
    mended.left.sheets = filled.sheets_left;
    mended.left.sheet_mm2 = filled.sheet_mm2;
    mended.left.one_sided = turned.one_sided;
    mended.left.where = filled.left > 0 ? filled.left_at : filled.sheet_at;
}

}  // namespace

bool is_solid(const MeshReport& report) {
    return report.open_edges_off_base.count == 0 && report.misoriented_edges.count == 0 &&
           report.inverted_components.count == 0;
}

namespace {

/// @param stitch_mm how far borders may lie apart to be brought together
Mended mend_within(Context& context, MeshView mesh, const MeshReport& report, const MendOptions& options,
                   double stitch_mm) {
    Mended mended;
    const double size = diagonal(report.box);
    const MemoryCharge charge(context, mesh.facets.size() * 40, "the mesh under repair");
    FacetSoup soup;
    soup.vertices.assign(mesh.vertices.begin(), mesh.vertices.end());
    soup.facets.assign(mesh.facets.begin(), mesh.facets.end());
    const auto drop_useless = [&] {
        const DroppedFacets flat = drop_degenerates(context, soup);
        note(mended, Defect::degenerate, flat.count, 0, flat.where);
        const DroppedFacets twice = drop_duplicates(context, soup);
        note(mended, Defect::duplicate, twice.count, twice.area_mm2, twice.where);
    };
    drop_useless();
    const Stitched stitched = stitch(context, soup, stitch_mm);
    note(mended, Defect::crack, stitched.cracks, stitched.crack_mm, stitched.crack_at);
    note(mended, Defect::t_junction, stitched.t_junctions, stitched.t_junction_mm, stitched.t_junction_at);
    mended.moved_mm = std::max(stitched.crack_mm, stitched.t_junction_mm);
    // Borders that were brought together may have brought the same facets together.
    if (stitched.cracks + stitched.t_junctions > 0) drop_useless();
    const Turned turned = orient(context, soup);
    note(mended, Defect::turned, turned.patches, turned.area_mm2, turned.where);
    const DroppedWalls walls = drop_inner_walls(context, soup);
    note(mended, Defect::stray, walls.count, walls.area_mm2, walls.where);
    const HoleLimits limits{.flat_mm = stitch_mm,
                            .thin_mm = kThinOfStitch * stitch_mm,
                            .size_mm = options.hole_mm > 0 ? options.hole_mm : kHoleShare * size};
    const Filled filled = fill_holes(context, soup, limits);
    note(mended, Defect::hole, filled.holes, filled.area_mm2, filled.hole_at);
    note(mended, Defect::stray, filled.strays, filled.stray_mm2, filled.stray_at);
    std::vector<bool> unsure = kept(kept(turned.unsure, walls.dropped), filled.dropped);
    const auto finish = [&] {
        mended.mesh = finished(context, soup);
        mended.report = report_mesh(context, mended.mesh.view());
    };
    finish();
    if (mended.report.open_edges.count == 0 && mended.report.misoriented_edges.count == 0) {
        const EmptyBodies empty = find_empty_bodies(soup, mended.report.component_of);
        note(mended, Defect::stray, empty.count, empty.area_mm2, empty.where);
        if (empty.count > 0) {
            unsure.resize(soup.facets.size(), false);
            unsure = kept(unsure, empty.facets);
            soup.drop(empty.facets);
            finish();
        }
        const TurnedBodies bodies = turn_bodies(context, soup, mended.report.component_of, unsure);
        note(mended, Defect::inside_out, bodies.count, bodies.volume_mm3, bodies.where);
        if (bodies.count > 0) finish();
    }
    mended.solid = !mended.mesh.facets.empty() && is_solid(mended.report);
    note_left(mended, filled, turned);
    return mended;
}

}  // namespace

Mended mend(Context& context, MeshView mesh, const MeshReport& report, const MendOptions& options) {
    if (is_solid(report)) {
        Mended mended;
        mended.needed = false;
        mended.solid = true;
        mended.mesh.vertices.assign(mesh.vertices.begin(), mesh.vertices.end());
        mended.mesh.facets.assign(mesh.facets.begin(), mesh.facets.end());
        mended.mesh.neighbours.assign(mesh.neighbours.begin(), mesh.neighbours.end());
        mended.report = report;
        return mended;
    }
    if (options.stitch_mm > 0) return mend_within(context, mesh, report, options, options.stitch_mm);
    const double stitch_mm = std::min(kMostStitch, kStitchShare * diagonal(report.box));
    Mended first = mend_within(context, mesh, report, options, stitch_mm);
    if (mesh.size() > kMostTriedAgain) return first;
    for (const double share : kOtherStitches) {
        if (first.solid) break;
        if (Mended other = mend_within(context, mesh, report, options, share * stitch_mm); other.solid)
            return other;
    }
    return first;
}

}  // namespace slabwright
