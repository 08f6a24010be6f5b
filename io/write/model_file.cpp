#include "io/write/model_file.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstdint>
#include <string_view>
#include <vector>

#include "io/write/output_file.h"
#include "io/write/stl_writer.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

bool ends_in(const std::string& path, std::string_view ending) {
    if (path.size() < ending.size()) return false;
    for (std::size_t i = 0; i < ending.size(); ++i)
        if (std::tolower(static_cast<unsigned char>(path[path.size() - ending.size() + i])) != ending[i])
            return false;
    return true;
}

/// CRC-32 of a ZIP archive's entries (ISO 3309, reflected 0xEDB88320).
std::uint32_t crc32(std::string_view bytes) {
    static const std::array<std::uint32_t, 256> table = [] {
        std::array<std::uint32_t, 256> made{};
        for (std::uint32_t i = 0; i < made.size(); ++i) {
            std::uint32_t c = i;
            for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
            made[i] = c;
        }
        return made;
    }();
    std::uint32_t c = 0xFFFFFFFFu;
    for (const char byte : bytes) c = table[(c ^ static_cast<unsigned char>(byte)) & 0xFF] ^ (c >> 8);
    return ~c;
}

/// A ZIP archive of entries that are stored as they are.
class StoredArchive {
public:
    explicit StoredArchive(OutputFile& file) : file_(file) {}
    void add(std::string_view name, std::string_view bytes) {
        std::string head = fields(name, bytes);
        directory_ += number(0x02014B50u, 4) + number(20, 2) + head + number(0, 2) + number(0, 2) +
                      number(0, 2) + number(0, 4) + number(at_, 4) + std::string(name);
        ++entries_;
        write(number(0x04034B50u, 4) + head + std::string(name));
        write(bytes);
    }
    void close() {
        const std::uint64_t start = at_;
        const std::string end = number(0x06054B50u, 4) + number(0, 4) + number(entries_, 2) +
                                number(entries_, 2) + number(directory_.size(), 4) + number(start, 4) +
                                number(0, 2);
        write(directory_);
        write(end);
    }

private:
    /// What a local head and the directory have in common: version, flags, method, date, sums, lengths.
    static std::string fields(std::string_view name, std::string_view bytes) {
        constexpr std::uint64_t first_day = 33;  // 1 January 1980, the earliest that the format has
        return number(20, 2) + number(0, 2) + number(0, 2) + number(0, 2) + number(first_day, 2) +
               number(crc32(bytes), 4) + number(bytes.size(), 4) + number(bytes.size(), 4) +
               number(name.size(), 2) + number(0, 2);
    }
    static std::string number(std::uint64_t value, int bytes) {
        std::string text;
        for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 0xFF);
        return text;
    }
    void write(std::string_view bytes) {
        file_.write(bytes);
        at_ += bytes.size();
    }
    OutputFile& file_;
    std::string directory_;
    std::uint64_t at_ = 0, entries_ = 0;
};

constexpr std::string_view kTypes =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
)";
constexpr std::string_view kRelations =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
)";

std::string model_xml(const Mesh& mesh) {
    fmt::memory_buffer text;
    const auto out = std::back_inserter(text);
    fmt::format_to(out,
                   "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" "
                   "xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n"
                   " <resources>\n  <object id=\"1\" type=\"model\">\n   <mesh>\n    <vertices>\n");
    for (const Vec3f& v : mesh.vertices)
        fmt::format_to(out, "     <vertex x=\"{}\" y=\"{}\" z=\"{}\"/>\n", v.x, v.y, v.z);
    fmt::format_to(out, "    </vertices>\n    <triangles>\n");
    for (const Index3& f : mesh.facets)
        fmt::format_to(out, "     <triangle v1=\"{}\" v2=\"{}\" v3=\"{}\"/>\n", f[0], f[1], f[2]);
    fmt::format_to(out,
                   "    </triangles>\n   </mesh>\n  </object>\n </resources>\n <build>\n  <item "
                   "objectid=\"1\"/>\n </build>\n</model>\n");
    return fmt::to_string(text);
}

}  // namespace

void require_model_ending(const std::string& path) {
    if (!ends_in(path, ".stl") && !ends_in(path, ".3mf"))
        throw Error(ErrorKind::usage, "prepare.format", "no format that is written has this ending", path,
                    "end the name in .stl or .3mf");
}

void write_model(const std::string& path, const Mesh& mesh) {
    require_model_ending(path);
    if (ends_in(path, ".stl")) {
        write_stl(path, mesh);
        return;
    }
    const std::string xml = model_xml(mesh);
    constexpr std::uint64_t most = 0xFFF00000u;  // of an archive without 64-bit records
    if (xml.size() > most)
        throw Error(ErrorKind::no_plan, "prepare.large", "a 3MF of this mesh would pass 4 GB", path,
                    "write it as .stl");
    const std::filesystem::path place(path);
    OutputFile file(place.has_parent_path() ? place.parent_path() : ".", place.filename().string());
    StoredArchive archive(file);
    archive.add("[Content_Types].xml", kTypes);
    archive.add("_rels/.rels", kRelations);
    archive.add("3D/3dmodel.model", xml);
    archive.close();
    file.close();
}

}  // namespace slabwright
