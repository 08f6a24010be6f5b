#include "io/write/draw_ply.h"

#include <array>
#include <bit>
#include <cstdint>

#include "kernels/errors.h"

namespace slabwright {

namespace {

void put(std::string& text, std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8)
        text += static_cast<char>(static_cast<unsigned char>(value >> shift));
}
void put(std::string& text, float value) { put(text, std::bit_cast<std::uint32_t>(value)); }

using Colour = std::array<unsigned char, 3>;

// Colours that all eyes tell apart.
constexpr Colour kGood{190, 190, 190}, kUndercut{213, 94, 0}, kThin{0, 114, 178}, kLittleDraft{240, 228, 66};

Colour colour_of(const DrawReport& report, std::size_t f) {
    if (report.finding[f] == DrawFinding::undercut) return kUndercut;
    if (report.thickness_mm[f] > 0) return kThin;
    return report.finding[f] == DrawFinding::little_draft ? kLittleDraft : kGood;
}

}  // namespace

std::string draw_ply(MeshView mesh, const DrawReport& report, const std::string& comment) {
    if (report.finding.size() != mesh.size())
        throw Error(ErrorKind::usage, "draw_ply.report", "the report is of another mesh", {},
                    "check the draw of this mesh");
    std::string text =
        "ply\nformat binary_little_endian 1.0\ncomment " + comment + "\nelement vertex " +
        std::to_string(mesh.vertices.size()) +
        "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
        std::to_string(mesh.size()) +
        "\nproperty list uchar uint vertex_indices\nproperty float draft\nproperty float thickness\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    text.reserve(text.size() + 12 * mesh.vertices.size() + 24 * mesh.size());
    for (const Vec3f& p : mesh.vertices) put(text, p.x), put(text, p.y), put(text, p.z);
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        text += static_cast<char>(3);
        for (const std::uint32_t v : mesh.facets[f]) put(text, v);
        put(text, report.draft_deg[f]);
        put(text, report.thickness_mm[f]);
        for (const unsigned char c : colour_of(report, f)) text += static_cast<char>(c);
    }
    return text;
}

}  // namespace slabwright
