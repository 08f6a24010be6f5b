// STL in: binary and ASCII, decoded and welded in parallel.
#pragma once

#include <string>
#include <vector>

#include "engine/plan.h"
#include "kernels/mesh/report.h"
#include "kernels/mesh/weld.h"

namespace slabwright {

struct StlOptions {
    LengthUnit units = LengthUnit::mm;
    double weld_mm = 0;            ///< 0: bit-exact only
    Repair repair = Repair::none;  ///< of a mesh that is no solid, once it is welded
    friend bool operator==(const StlOptions&, const StlOptions&) = default;
};

struct StlMesh {
    /// Millimetres, set on z = 0 (the lowest vertex); x and y as in the file. Facets in the file's order;
    /// where a sound file of 50 000 facets or more does not have neighbours follow each other, in an order in
    /// space in which they do.
    Mesh mesh;
    MeshReport report;
    InputInfo input;
    std::vector<Diagnostic> diagnostics;  ///< every finding of the report, welds, suspicious units
};

/// Reads a file. A "solid" prefix is no proof of ASCII, the facet count of the header no proof of anything:
/// both are checked against the length. Decimal points do not depend on the locale.
/// @throws Error(input) with the file, and the facet, offset or line: missing, empty, truncated, wrong count,
/// unparsable,
///         non-finite or absurd (over 1e6 mm) coordinates, no facets. Codes: stl.missing, directory,
///         unreadable, changed, empty, not_stl, no_facets, facet_count, truncated, unparsable, non_finite,
///         absurd, flat (of no height)
/// Facets without area that hang together with no body bound nothing and are left out of box and base
/// (mesh.stray). Diagnostics: units.suspicious, mesh.welded, mesh.stray, and mesh.open, open_base,
/// misoriented, inverted, non_manifold, duplicate, degenerate, each with its count and the centre of its
/// first facet. Where a repair was asked for, they are of what it left, and what it did is told as
/// repair_mesh() does. @throws as that
[[nodiscard]] StlMesh read_stl(Context& context, const std::string& path, const StlOptions& options = {});

/// Only the mesh of read_stl(), without digest, report and weld within a tolerance. @throws as read_stl()
[[nodiscard]] Mesh read_mesh(Context& context, const std::string& path, LengthUnit units = LengthUnit::mm);

/// Whether a planner may use this mesh: closed (but for open edges in the base plane), consistently oriented,
/// not inside out. @throws Error(input) with the count, the first facet and its place, and the remedy (for
/// open edges: the
/// --weld tolerance that closes them all, found by trying, when there is one). Codes: stl.open, misoriented,
/// inverted
void require_solid(Context& context, const StlMesh& stl, const std::string& path);

/// Binary STL, for models that the project makes; takes its place at `path` only when complete.
/// @throws Error(input, "out.unwritable") and as OutputFile
void write_stl(const std::string& path, const Mesh& mesh, LengthUnit unit = LengthUnit::mm);

}  // namespace slabwright
