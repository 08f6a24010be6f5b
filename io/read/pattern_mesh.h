// A pattern's mesh: read from any source in any format, placed, welded, and judged.
#pragma once

#include <string>
#include <vector>

#include "engine/plan.h"
#include "engine/prepare/preparation.h"
#include "io/read/pattern_source.h"
#include "kernels/mesh/report.h"
#include "kernels/mesh/weld.h"

namespace slabwright {

/// What of a job decides how a pattern is read: two plans that agree in it mean the same solid.
struct ReadingOptions {
    LengthUnit units = LengthUnit::mm;  ///< of files that do not state theirs
    double weld_mm = 0;                 ///< 0: bit-exact only
    Repair repair = Repair::none;       ///< of a mesh that is no solid, once it is welded
    double deviation_mm = 0.01;         ///< of facets from the surfaces of a format that has such (STEP)
    Preparation preparation = {};       ///< what is done to the model, before it is planned
    friend bool operator==(const ReadingOptions&, const ReadingOptions&) = default;
};

/// @throws Error(usage) as preparation_of()
[[nodiscard]] ReadingOptions reading_options(const Job& job);

struct PatternMesh {
    /// Millimetres, prepared, set on z = 0 (the lowest vertex); x and y as in the file where nothing was
    /// done. Facets in the file's order; where a sound file of 50 000 facets or more does not have neighbours
    /// follow each other, in an order in space in which they do.
    Mesh mesh;
    MeshReport report;
    InputInfo input;
    std::string family;                   ///< of its format, with which the codes of its errors begin: "stl"
    std::vector<Diagnostic> diagnostics;  ///< every finding of the report, welds, suspicious units
};

/// Reads a source. The content says the format (mesh_formats()), the name's ending where content does not.
/// Decimal points do not depend on the locale.
/// @throws Error(input) with the file, and the facet, offset or line: missing, empty, truncated, wrong count,
/// unparsable,
///         non-finite or absurd (over 1e6 mm) coordinates, no facets. Codes begin with the format's family;
///         of STL: stl.missing, directory, unreadable, changed, empty, not_stl, no_facets, facet_count,
///         truncated, unparsable, non_finite, absurd, flat (of no height)
/// Facets without area that hang together with no body bound nothing and are left out of box and base
/// (mesh.stray). Diagnostics: units.suspicious, units.stated (the file's own unit is not the job's),
/// mesh.welded, mesh.stray, and mesh.open, open_base, misoriented, inverted, non_manifold, duplicate,
/// degenerate, each with its count and the centre of its first facet. Where a repair was asked for, they are
/// of what it left, and what it did is told as repair_mesh() does. A skin that was asked for is added last,
/// to a solid (skin.added); box and volume are with it. @throws as that, and as add_skin()
[[nodiscard]] PatternMesh read_pattern_mesh(Context& context, const PatternSource& source,
                                            const ReadingOptions& options = {});

/// Only the mesh of read_pattern_mesh(), without digest, report and weld within a tolerance. @throws as that
[[nodiscard]] Mesh read_mesh(Context& context, const PatternSource& source,
                             LengthUnit units = LengthUnit::mm);

/// Whether a planner may use this mesh: closed (but for open edges in the base plane), consistently oriented,
/// not inside out. @throws Error(input) with the count, the first facet and its place, and the remedy (for
/// open edges: the --weld tolerance that closes them all, found by trying, when there is one). Codes:
/// stl.open, misoriented, inverted
void require_solid(Context& context, const PatternMesh& pattern, const std::string& path);

}  // namespace slabwright
