#include "io/write/stl_writer.h"

#include <cmath>
#include <filesystem>
#include <string>

#include "io/write/output_file.h"

namespace slabwright {

void write_stl(const std::string& path, const Mesh& mesh, LengthUnit unit_of_file) {
    const std::filesystem::path place(path);
    OutputFile file(place.has_parent_path() ? place.parent_path() : ".", place.filename().string());
    std::string buffer = unit_of_file == LengthUnit::mm ? "binary STL, millimetres, written by Slabwright"
                                                        : "binary STL, inches, written by Slabwright";
    buffer.resize(80, '\0');
    auto append = [&](auto value) { buffer.append(reinterpret_cast<const char*>(&value), sizeof value); };
    auto flush = [&] {
        file.write(buffer);
        buffer.clear();
    };
    append(static_cast<std::uint32_t>(mesh.facets.size()));
    for (const Index3& facet : mesh.facets) {
        const Vec3f &a = mesh.vertices[facet[0]], &b = mesh.vertices[facet[1]], &c = mesh.vertices[facet[2]];
        const double ux = double(b.x) - a.x, uy = double(b.y) - a.y, uz = double(b.z) - a.z;
        const double vx = double(c.x) - a.x, vy = double(c.y) - a.y, vz = double(c.z) - a.z;
        const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        const double length = std::sqrt(nx * nx + ny * ny + nz * nz), unit = length > 0 ? 1 / length : 0;
        for (const double n : {nx, ny, nz}) append(static_cast<float>(n * unit));
        for (const Vec3f* p : {&a, &b, &c}) append(p->x), append(p->y), append(p->z);
        append(std::uint16_t{0});
        if (buffer.size() > (std::size_t{1} << 20)) flush();
    }
    flush();
    file.close();
}

}  // namespace slabwright
