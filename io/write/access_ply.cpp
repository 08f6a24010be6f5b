#include "io/write/access_ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kernels/errors.h"

namespace slabwright {

namespace {

void put(std::string& text, std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8)
        text += static_cast<char>(static_cast<unsigned char>(value >> shift));
}
void put(std::string& text, float value) { put(text, std::bit_cast<std::uint32_t>(value)); }

// Two colours that all eyes tell apart.
constexpr std::array<double, 3> kMissed{230, 120, 0}, kReached{0, 114, 178};

}  // namespace

std::string access_ply(MeshView mesh, std::span<const float> shares, const std::string& comment) {
    if (shares.size() != mesh.size())
        throw Error(ErrorKind::usage, "access_ply.shares", "there are not as many shares as facets", {},
                    "ask accessibility for shares");
    constexpr std::uint32_t unused = 0xFFFFFFFFu;
    std::vector<std::uint32_t> number(mesh.vertices.size(), unused), used;
    std::uint32_t faces = 0;
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        if (shares[f] < 0) continue;
        ++faces;
        for (const std::uint32_t v : mesh.facets[f])
            if (number[v] == unused) {
                number[v] = static_cast<std::uint32_t>(used.size());
                used.push_back(v);
            }
    }
    std::string text =
        "ply\nformat binary_little_endian 1.0\ncomment " + comment + "\nelement vertex " +
        std::to_string(used.size()) +
        "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(faces) +
        "\nproperty list uchar uint vertex_indices\nproperty float reached\nproperty uint facet\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    text.reserve(text.size() + 12 * used.size() + 24 * std::size_t{faces});
    for (const std::uint32_t v : used) {
        const Vec3f& p = mesh.vertices[v];
        put(text, p.x), put(text, p.y), put(text, p.z);
    }
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        if (shares[f] < 0) continue;
        text += static_cast<char>(3);
        for (const std::uint32_t v : mesh.facets[f]) put(text, number[v]);
        put(text, shares[f]);
        put(text, static_cast<std::uint32_t>(f));
        const double share = std::clamp(static_cast<double>(shares[f]), 0.0, 1.0);
        for (std::size_t c = 0; c < 3; ++c)
            text += static_cast<char>(
                static_cast<unsigned char>(std::lround(kMissed[c] + share * (kReached[c] - kMissed[c]))));
    }
    return text;
}

}  // namespace slabwright
