// Mesh files: any bytes are a mesh whose facets name vertices that are there, repaired or not, or one clear
// error.
#include <cmath>

#include "io/read/pattern_mesh.h"
#include "tests/fuzz/fuzz.h"

using namespace slabwright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static Context context({.threads = 1, .memory_bytes = std::uint64_t{1} << 30});
    for (const Repair repair : {Repair::none, Repair::mend})
        fuzz::expect_clear_error([&] {
            const PatternMesh read = read_pattern_mesh(
                context, PatternSource::of_bytes(fuzz::text(data, size), "part"), {.repair = repair});
            for (const Index3& facet : read.mesh.facets)
                for (const std::uint32_t corner : facet)
                    fuzz::require(corner < read.mesh.vertices.size(),
                                  "a facet of a vertex that is not there");
            for (const Vec3f& v : read.mesh.vertices)
                fuzz::require(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z),
                              "a vertex that is nowhere");
            require_solid(context, read, "part");
        });
    return 0;
}
