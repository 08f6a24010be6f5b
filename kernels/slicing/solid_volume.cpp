#include "kernels/slicing/solid_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "kernels/polygons/loops.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr std::size_t kSections = 128;
constexpr std::size_t kAtOnce = 32;  // sections that are held

}  // namespace

SolidVolume solid_volume(Context& context, MeshView mesh, double signed_mm3) {
    SolidVolume result{signed_mm3, 0};
    if (mesh.roles.empty()) return result;
    MeshView raw = mesh;
    raw.roles = {};
    const Box3 box = bounds(mesh);
    const double low = box.min.z, step = (double{box.max.z} - low) / kSections;
    std::array<double, 2> excess{};  // mm² over the even and the odd sections
    for (std::size_t first = 0; first < kSections; first += kAtOnce) {
        std::vector<Plane> planes;
        for (std::size_t k = first; k < first + kAtOnce; ++k)
            planes.push_back({low + (static_cast<double>(k) + 0.5) * step, Side::above});
        const std::vector<Section> solid = slice(context, mesh, planes), wound = slice(context, raw, planes);
        for (std::size_t k = 0; k < planes.size(); ++k)
            excess[k % 2] += area(solid[k].loops) - area(wound[k].loops);
    }
    result.mm3 += (excess[0] + excess[1]) * step;
    result.uncertain_mm3 = std::abs(excess[0] - excess[1]) * step;
    return result;
}

}  // namespace slabwright
