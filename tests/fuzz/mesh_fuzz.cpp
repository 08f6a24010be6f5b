// Mesh files: any bytes are a mesh whose facets name vertices that are there, repaired or not, or one clear
// error.
#include <cmath>

#include "io/read/stl.h"
#include "tests/fuzz/fuzz.h"
#include "tests/support/files.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const support::TemporaryFolder folder;
    static Context context({.threads = 1, .memory_bytes = std::uint64_t{1} << 30});
    const std::string path = folder / "part.stl";
    support::spit(path, std::string(fuzz::text(data, size)));
    for (const Repair repair : {Repair::none, Repair::mend})
        fuzz::expect_clear_error([&] {
            const StlMesh stl = read_stl(context, path, {.repair = repair});
            for (const Index3& facet : stl.mesh.facets)
                for (const std::uint32_t corner : facet)
                    fuzz::require(corner < stl.mesh.vertices.size(), "a facet of a vertex that is not there");
            for (const Vec3f& v : stl.mesh.vertices)
                fuzz::require(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z),
                              "a vertex that is nowhere");
            require_solid(context, stl, path);
        });
    return 0;
}
