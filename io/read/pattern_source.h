// Where a pattern comes from: a file, the bytes of one, or a mesh in memory.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "kernels/export.h"

namespace slabwright {

/// One of three places from which a pattern is read. What memory it names is borrowed: it must live until the
/// function that is given it returns.
class SLABWRIGHT_API PatternSource {
public:
    using Vertex = std::array<double, 3>;
    using Facet = std::array<std::uint32_t, 3>;  ///< counter-clockwise seen from outside
    enum class Kind : std::uint8_t { none, file, bytes, mesh };

    /// No pattern: where one is needed, plan.json says which it was.
    PatternSource() = default;
    /// The file of this path; "": none.
    PatternSource(std::string path) : name_(std::move(path)) {  // NOLINT(google-explicit-constructor)
        kind_ = name_.empty() ? Kind::none : Kind::file;
    }
    PatternSource(const char* path)
        : PatternSource(std::string(path)) {}  // NOLINT(google-explicit-constructor)

    /// The bytes of a file that was never on a disk. @param name as a file's: its ending may say the format,
    /// errors and plan.json name it
    [[nodiscard]] static PatternSource of_bytes(std::string_view bytes, std::string name) {
        PatternSource source;
        source.kind_ = Kind::bytes;
        source.name_ = std::move(name);
        source.bytes_ = bytes;
        return source;
    }
    /// A mesh, in the unit that the job names. @param name for errors and plan.json
    [[nodiscard]] static PatternSource of_mesh(std::span<const Vertex> vertices,
                                               std::span<const Facet> facets, std::string name) {
        PatternSource source;
        source.kind_ = Kind::mesh;
        source.name_ = std::move(name);
        source.vertices_ = vertices;
        source.facets_ = facets;
        return source;
    }

    [[nodiscard]] Kind kind() const noexcept { return kind_; }
    [[nodiscard]] bool empty() const noexcept { return kind_ == Kind::none; }
    /// The path of a file, the name of what is in memory.
    [[nodiscard]] const std::string& name() const noexcept { return name_; }
    [[nodiscard]] std::string_view bytes() const noexcept { return bytes_; }
    [[nodiscard]] std::span<const Vertex> vertices() const noexcept { return vertices_; }
    [[nodiscard]] std::span<const Facet> facets() const noexcept { return facets_; }

private:
    Kind kind_ = Kind::none;
    std::string name_;
    std::string_view bytes_;
    std::span<const Vertex> vertices_;
    std::span<const Facet> facets_;
};

}  // namespace slabwright
