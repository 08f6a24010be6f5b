// What a format of meshes is to the reader of patterns: how its files are known, and what they say.
//
// A format is one .cpp that defines a MeshFormat, and its line in formats.cpp. It decodes bytes, all in
// memory; who hashes, scales, places, welds and judges the mesh is pattern_mesh.cpp, the same for all.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/plan.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A corner or a vertex, in the file's unit.
using FileVertex = std::array<double, 3>;
/// The three corners of a facet, x y z of each.
using FileFacet = std::array<double, 9>;

/// The box around points; none yet: infinite, turned inside out.
struct Extent {
    FileVertex min, max;
    [[nodiscard]] static Extent none() {
        constexpr double inf = std::numeric_limits<double>::infinity();
        return {{inf, inf, inf}, {-inf, -inf, -inf}};
    }
    void add(const FileVertex& p) {
        for (std::size_t k = 0; k < 3; ++k) {
            min[k] = std::min(min[k], p[k]);
            max[k] = std::max(max[k], p[k]);
        }
    }
    void merge(const Extent& other) {
        for (std::size_t k = 0; k < 3; ++k) {
            min[k] = std::min(min[k], other.min[k]);
            max[k] = std::max(max[k], other.max[k]);
        }
    }
};

/// What the bytes of a file say, in one of three shapes: whichever costs the format least.
struct DecodedMesh {
    FacetRecords records;                        ///< corners that lie in the bytes themselves
    std::vector<std::vector<FileFacet>> pieces;  ///< or facets one by one, in pieces
    std::vector<FileVertex> vertices;            ///< or vertices and
    std::vector<Index3> facets;                  ///< which of them make each facet, all in range
    std::optional<Extent> box;                   ///< of all corners, where the format knows it by the way
    std::optional<double> mm_per_unit;           ///< where the file states its unit
    std::vector<Diagnostic> diagnostics;         ///< what was passed over, and what a tessellation missed
};

/// What is asked of a format beside the bytes.
struct DecodeOptions {
    double mm_per_unit = 1;  ///< of files that do not state their unit
    double deviation_mm =
        0.01;  ///< of facets from the surfaces that they stand for, in formats that have such
};

struct MeshFormat {
    std::string_view name;                    ///< as people write it: "STL"
    std::string_view family;                  ///< its errors' codes begin with it and a point: "stl"
    std::array<std::string_view, 2> endings;  ///< of file names, lower case, with the point; "": none
    bool built;                               ///< false: this build recognises its files and refuses them
    /// Whether a file is of this format, by its first bytes (kHead or all) and its length. @param name of the
    /// file, for formats whose text has no beginning of its own
    bool (*recognise)(std::string_view head, std::uint64_t size, std::string_view name);
    /// Refuses what the first bytes show to be no file of this format or one without facets, before all is
    /// read. @param place of the file, for errors
    void (*require)(std::string_view head, std::uint64_t size, const std::string& place);
    /// Decodes all of it. Charges its scratch. Every coordinate is finite and no farther than kAbsurdMm from
    /// the origin, every index in range. @throws Error(input, "family.…") with place and line, byte or facet
    DecodedMesh (*decode)(Context& context, std::string_view bytes, const DecodeOptions& options,
                          const std::string& place);
};

inline constexpr std::size_t kHead = 4096;  ///< first bytes, by which a format is told
inline constexpr double kAbsurdMm = 1e6;    ///< no pattern lies a kilometre from its origin
inline constexpr std::string_view kExportAgain = "export the file again";

/// All formats that this build reads, in the order in which they are asked. One that was left out of the
/// build is here too: it recognises its files and says what is missing.
[[nodiscard]] std::span<const MeshFormat* const> mesh_formats();

/// The format of a file: the first that recognises it, else the one of its name's ending, else STL.
[[nodiscard]] const MeshFormat& format_of(std::string_view head, std::uint64_t size, std::string_view name);

/// The format of a name's ending; STL where no format has it.
[[nodiscard]] const MeshFormat& format_of_ending(std::string_view name);

/// @throws Error(input) with a code of the format's family
[[noreturn]] void refuse_mesh(std::string_view family, std::string_view code, const std::string& message,
                              const std::string& place, std::string_view remedy);

/// Whether a coordinate is not finite or beyond kAbsurdMm.
[[nodiscard]] bool is_absurd(double value, double mm_per_unit);
/// @throws Error(input, "….non_finite" | "….absurd") that says so
[[noreturn]] void refuse_coordinate(std::string_view family, double value, double mm_per_unit,
                                    const std::string& place);

}  // namespace slabwright
