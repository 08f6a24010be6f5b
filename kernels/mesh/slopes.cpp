#include "kernels/mesh/slopes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/parallel/parallel.h"

namespace slabwright {

SlopeProfile slope_profile(Context& context, MeshView mesh, int steps, double horizontal_rad,
                           double least_flat_mm2) {
    SlopeProfile empty;
    const Box3 box = bounds(context, mesh);
    empty.z_low = box.min.z;
    empty.z_high = box.max.z;
    steps = std::max(1, steps);
    empty.least_deg.assign(static_cast<std::size_t>(steps), 90.0);
    empty.area_mm2.assign(90, 0.0);
    const double height = empty.z_high - empty.z_low, step = height / steps;
    const auto of_some = [&](std::size_t begin, std::size_t end) {
        SlopeProfile profile = empty;
        for (const Index3& f : mesh.facets.subspan(begin, end - begin)) {
            const Vec3f &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
            const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z;
            const double vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
            const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
            const double across = std::sqrt(nx * nx + ny * ny),
                         area = std::sqrt(across * across + nz * nz) / 2;
            if (!(area > 0)) continue;
            const double slope = std::atan2(across, nz);  // 0 … π: past a right angle it faces down
            if (slope >= std::numbers::pi - horizontal_rad) {
                profile.down_flat_mm2 += area;
                continue;
            }
            if (slope > std::numbers::pi / 2 + horizontal_rad) {
                profile.undercut_mm2 += area;
                continue;
            }
            const double degrees = std::min(90.0, slope * 180 / std::numbers::pi);
            profile.area_mm2[std::min<std::size_t>(89, static_cast<std::size_t>(degrees))] += area;
            if (!(step > 0) || (slope < horizontal_rad && area < least_flat_mm2)) continue;
            const double low = std::min({a.z, b.z, c.z}) - profile.z_low,
                         high = std::max({a.z, b.z, c.z}) - profile.z_low;
            const int first = std::clamp(static_cast<int>(std::floor(low / step + 1e-9)), 0, steps - 1);
            const int last =
                std::clamp(static_cast<int>(std::ceil(high / step - 1e-9)) - 1, first, steps - 1);
            for (int i = first; i <= last; ++i) {
                double& least = profile.least_deg[static_cast<std::size_t>(i)];
                least = std::min(least, degrees);
            }
        }
        return profile;
    };
    return parallel_reduce(context, mesh.facets.size(), std::size_t{1} << 16, empty, of_some,
                           [](SlopeProfile all, const SlopeProfile& some) {
                               for (std::size_t i = 0; i < all.least_deg.size(); ++i)
                                   all.least_deg[i] = std::min(all.least_deg[i], some.least_deg[i]);
                               for (std::size_t i = 0; i < all.area_mm2.size(); ++i)
                                   all.area_mm2[i] += some.area_mm2[i];
                               all.down_flat_mm2 += some.down_flat_mm2;
                               all.undercut_mm2 += some.undercut_mm2;
                               return all;
                           });
}

}  // namespace slabwright
