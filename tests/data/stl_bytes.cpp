#include <cmath>
#include <cstring>
#include <stdexcept>

#include "tests/data/models.h"

namespace slabwright {

std::string stl_head(const std::string& name, std::uint64_t facets) {
    if (facets > 0xFFFFFFFFu) throw std::invalid_argument("a binary STL holds at most 4 294 967 295 facets");
    std::string head = "slabwright model " + name + ", millimetres";
    head.resize(80, ' ');
    for (int i = 0; i < 4; ++i) head.push_back(static_cast<char>(facets >> (8 * i) & 0xFF));
    return head;
}

std::array<char, 50> stl_facet(const Facet& f) {
    const double ux = double{f[1].x} - f[0].x, uy = double{f[1].y} - f[0].y, uz = double{f[1].z} - f[0].z;
    const double vx = double{f[2].x} - f[0].x, vy = double{f[2].y} - f[0].y, vz = double{f[2].z} - f[0].z;
    const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
    const float values[12] = {static_cast<float>(nx / length),
                              static_cast<float>(ny / length),
                              static_cast<float>(nz / length),
                              f[0].x,
                              f[0].y,
                              f[0].z,
                              f[1].x,
                              f[1].y,
                              f[1].z,
                              f[2].x,
                              f[2].y,
                              f[2].z};
    std::array<char, 50> bytes{};
    std::memcpy(bytes.data(), values, sizeof values);
    return bytes;
}

std::string stl_bytes(const std::string& name, const std::vector<Facet>& facets) {
    std::string bytes = stl_head(name, facets.size());
    bytes.reserve(bytes.size() + 50 * facets.size());
    for (const Facet& facet : facets) {
        const std::array<char, 50> record = stl_facet(facet);
        bytes.append(record.data(), record.size());
    }
    return bytes;
}

}  // namespace slabwright
