// PLY: ASCII and binary of both byte orders. The elements `vertex` (x, y, z) and `face` (vertex_indices) make
// the mesh; everything else is passed over by its stated size.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>

#include "io/read/mesh_format.h"
#include "io/read/polygon_facets.h"
#include "io/read/words.h"
#include "kernels/parallel/context.h"

namespace slabwright {

namespace {

constexpr std::string_view kFamily = "ply";
constexpr std::size_t kMostHeader = std::size_t{1} << 16;

enum class Type : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

std::size_t size_of(Type type) {
    constexpr std::array<std::size_t, 8> sizes{1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[static_cast<std::size_t>(type)];
}

std::optional<Type> type_of(std::string_view word) {
    constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                    {"uchar", "uint8"},
                                                                    {"short", "int16"},
                                                                    {"ushort", "uint16"},
                                                                    {"int", "int32"},
                                                                    {"uint", "uint32"},
                                                                    {"float", "float32"},
                                                                    {"double", "float64"}}};
    for (std::size_t i = 0; i < names.size(); ++i)
        if (word == names[i][0] || word == names[i][1]) return static_cast<Type>(i);
    return std::nullopt;
}

struct Property {
    std::string_view name;
    Type type{};
    std::optional<Type> count;  ///< of a list
};

struct Element {
    std::string_view name;
    std::uint64_t count = 0;
    std::vector<Property> properties;

    /// The fewest bytes of one in a binary file; the fewest characters in a text are two for each.
    [[nodiscard]] std::size_t least_bytes(bool ascii) const {
        std::size_t bytes = 0;
        for (const Property& p : properties) bytes += ascii ? 2 : size_of(p.count.value_or(p.type));
        return bytes;
    }
};

enum class Encoding : std::uint8_t { ascii, little, big };

struct Header {
    Encoding encoding{};
    std::vector<Element> elements;
    std::size_t bytes = 0;
};

bool recognise(std::string_view head, std::uint64_t, std::string_view) {
    return head.size() >= 4 && head.substr(0, 3) == "ply" && is_space(head[3]);
}

void require(std::string_view head, std::uint64_t size, const std::string& place) {
    if (!recognise(head, size, {}))
        refuse_mesh(kFamily, "not_ply",
                    fmt::format("found {} where a PLY begins with 'ply'", quoted_word(Words{head}.next())),
                    place + ", line 1", "name a PLY file");
}

class PlyReader {
public:
    PlyReader(Context& context, std::string_view bytes, double mm_per_unit, const std::string& place)
        : context_(context), bytes_(bytes), mm_per_unit_(mm_per_unit), place_(place) {}

    DecodedMesh read() {
        read_header();
        bool faces = false;
        for (const Element& element : header_.elements) {
            const std::uint64_t left = bytes_.size() - at_, least = element.least_bytes(ascii());
            // The last number of a text may lack the space behind it.
            if (element.count > 0 && (least == 0 || element.count > (left + 1) / least))
                refuse_mesh(kFamily, "truncated",
                            fmt::format("the header announces {} of '{}', and {} bytes follow", element.count,
                                        std::string(element.name.substr(0, 40)), left),
                            here(), "copy or export the file again; its end is missing");
            if (element.name == "vertex") read_vertices(element);
            else if (element.name == "face") {
                read_faces(element);
                faces = true;
            } else {
                pass_over(element);
            }
        }
        if (!faces || decoded_.facets.empty())
            refuse_mesh(kFamily, "no_facets",
                        faces ? "the file holds no facets" : "the header announces no element 'face'", place_,
                        "export it with facets, not as points");
        return std::move(decoded_);
    }

private:
    [[nodiscard]] bool ascii() const { return header_.encoding == Encoding::ascii; }
    [[nodiscard]] std::string here() const {
        return ascii() ? fmt::format("{}, line {}", place_, line_of(bytes_, std::min(at_, bytes_.size())))
                       : fmt::format("{}, offset {}", place_, at_);
    }
    [[noreturn]] void fail(std::string_view found, std::string_view expected) const {
        refuse_mesh(kFamily, "unparsable",
                    fmt::format("found {} where {} should stand", quoted_word(found), expected), here(),
                    kExportAgain);
    }

    void read_header() {
        // Lines end with \n or \r\n; a single \r belongs to old files.
        const std::string_view head = bytes_.substr(0, kMostHeader);
        bool format = false;
        for (std::size_t line = 0;; ++line) {
            const std::size_t end = head.find_first_of("\r\n", at_);
            if (end == std::string_view::npos)
                refuse_mesh(kFamily, "truncated", "the header does not end with 'end_header'",
                            fmt::format("{}, line {}", place_, line + 1), kExportAgain);
            Words words{head.substr(at_, end - at_)};
            const std::string_view word = words.next();
            if (word == "format") {
                const std::string_view name = words.next();
                if (name == "ascii") header_.encoding = Encoding::ascii;
                else if (name == "binary_little_endian") header_.encoding = Encoding::little;
                else if (name == "binary_big_endian") header_.encoding = Encoding::big;
                else fail(name, "'ascii', 'binary_little_endian' or 'binary_big_endian'");
                format = true;
            } else if (word == "element") {
                read_element(words);
            } else if (word == "property") {
                read_property(words);
            } else if (line > 0 && word != "comment" && word != "obj_info" && word != "end_header" &&
                       !word.empty()) {
                fail(word, "a line of the header");
            }
            at_ = end + (head.substr(end, 2) == "\r\n" ? 2 : 1);
            if (word == "end_header") break;
        }
        header_.bytes = at_;
        if (!format) refuse_mesh(kFamily, "unparsable", "the header states no format", place_, kExportAgain);
    }
    void read_element(Words& words) {
        Element element;
        element.name = words.next();
        double count = 0;
        const std::string_view word = words.next();
        if (!read_number(word, count) || !(count >= 0) || count > 4294967295.0 || count != std::floor(count))
            fail(word, "a count");
        element.count = static_cast<std::uint64_t>(count);
        header_.elements.push_back(element);
        if (header_.elements.size() > 64) fail(element.name, "the end of the elements");
    }
    void read_property(Words& words) {
        if (header_.elements.empty()) fail("property", "an element");
        Property property;
        std::string_view word = words.next();
        if (word == "list") {
            word = words.next();
            property.count = type_of(word);
            if (!property.count || *property.count >= Type::f32) fail(word, "a whole type");
            word = words.next();
        }
        const std::optional<Type> type = type_of(word);
        if (!type) fail(word, "a type of PLY");
        property.type = *type;
        property.name = words.next();
        header_.elements.back().properties.push_back(property);
        if (header_.elements.back().properties.size() > 256) fail(property.name, "the end of the properties");
    }

    /// The next number, whatever the encoding. @throws Error(input, "ply.truncated" | "ply.unparsable")
    double number(Type type) {
        if (ascii()) {
            Words words{bytes_, at_};
            const std::string_view word = words.next();
            double value = 0;
            if (word.empty())
                refuse_mesh(kFamily, "truncated", "the text ends where a number should stand", here(),
                            "copy or export the file again; its end is missing");
            if (!read_number(word, value)) {
                at_ = words.at - word.size();
                fail(word, "a number");
            }
            at_ = words.at;
            return value;
        }
        const std::size_t size = size_of(type);
        if (bytes_.size() - at_ < size)
            refuse_mesh(kFamily, "truncated", "the data ends inside a number", here(),
                        "copy or export the file again; its end is missing");
        std::uint64_t raw = 0;
        for (std::size_t k = 0; k < size; ++k) {
            const auto byte = static_cast<unsigned char>(bytes_[at_ + k]);
            raw |= std::uint64_t{byte} << (8 * (header_.encoding == Encoding::big ? size - 1 - k : k));
        }
        at_ += size;
        switch (type) {
            case Type::i8:
                return static_cast<std::int8_t>(raw);
            case Type::u8:
                return static_cast<std::uint8_t>(raw);
            case Type::i16:
                return static_cast<std::int16_t>(raw);
            case Type::u16:
                return static_cast<std::uint16_t>(raw);
            case Type::i32:
                return static_cast<std::int32_t>(raw);
            case Type::u32:
                return static_cast<std::uint32_t>(raw);
            case Type::f32:
                return std::bit_cast<float>(static_cast<std::uint32_t>(raw));
            case Type::f64:
                return std::bit_cast<double>(raw);
        }
        return 0;
    }
    /// How many numbers of a list follow; as many could lie in what is left.
    std::size_t list_size(const Property& list) {
        const double count = number(*list.count);
        const std::size_t least = ascii() ? 2 : size_of(list.type);
        const std::size_t most = (bytes_.size() - at_ + 1) / least;
        if (!(count >= 0) || count != std::floor(count) || count > static_cast<double>(most))
            refuse_mesh(kFamily, "list", fmt::format("a list of {} numbers does not fit the file", count),
                        here(), kExportAgain);
        return static_cast<std::size_t>(count);
    }
    void pass(const Property& property) {
        if (!property.count) {
            (void)number(property.type);
            return;
        }
        const std::size_t count = list_size(property);
        for (std::size_t i = 0; i < count; ++i) (void)number(property.type);
    }
    void pass_over(const Element& element) {
        for (std::uint64_t i = 0; i < element.count; ++i) {
            if ((i & 0xFFF) == 0) context_.throw_if_cancelled();
            for (const Property& property : element.properties) pass(property);
        }
    }
    void read_vertices(const Element& element) {
        std::array<bool, 3> named{};
        for (const Property& p : element.properties)
            if (p.name.size() == 1 && p.name[0] >= 'x' && p.name[0] <= 'z' && !p.count)
                named[static_cast<std::size_t>(p.name[0] - 'x')] = true;
        for (std::size_t k = 0; k < 3; ++k)
            if (!named[k])
                refuse_mesh(kFamily, "unparsable", fmt::format("its vertices have no '{}'", "xyz"[k]), place_,
                            kExportAgain);
        decoded_.vertices.reserve(element.count);
        for (std::uint64_t i = 0; i < element.count; ++i) {
            if ((i & 0xFFF) == 0) context_.throw_if_cancelled();
            FileVertex& v = decoded_.vertices.emplace_back();
            for (const Property& p : element.properties) {
                if (p.count || p.name.size() != 1 || p.name[0] < 'x' || p.name[0] > 'z') {
                    pass(p);
                    continue;
                }
                const std::size_t before = at_;
                const double value = number(p.type);
                if (is_absurd(value, mm_per_unit_)) {
                    at_ = before;
                    refuse_coordinate(kFamily, value, mm_per_unit_,
                                      fmt::format("{}, vertex {} (counted from 0)", here(), i));
                }
                v[static_cast<std::size_t>(p.name[0] - 'x')] = value;
            }
        }
    }
    void read_faces(const Element& element) {
        const bool listed =
            std::any_of(element.properties.begin(), element.properties.end(), [](const Property& p) {
                return p.count && (p.name == "vertex_indices" || p.name == "vertex_index");
            });
        if (element.count > 0 && !listed)
            refuse_mesh(kFamily, "unparsable", "its faces have no list 'vertex_indices'", place_,
                        kExportAgain);
        decoded_.facets.reserve(element.count);
        std::vector<std::uint32_t> corners;
        for (std::uint64_t i = 0; i < element.count; ++i) {
            if ((i & 0xFFF) == 0) context_.throw_if_cancelled();
            for (const Property& p : element.properties) {
                if (!p.count || (p.name != "vertex_indices" && p.name != "vertex_index")) {
                    pass(p);
                    continue;
                }
                const std::size_t count = list_size(p);
                if (count < 3 || count > kMostCorners)
                    refuse_mesh(kFamily, "polygon", fmt::format("a polygon has {} corners", count),
                                here_of_face(i), "export it in triangles");
                corners.clear();
                for (std::size_t k = 0; k < count; ++k) {
                    const double index = number(p.type);
                    if (!(index >= 0) || index != std::floor(index) ||
                        index >= static_cast<double>(decoded_.vertices.size()))
                        refuse_mesh(kFamily, "index",
                                    fmt::format("names vertex {} of {}", index, decoded_.vertices.size()),
                                    here_of_face(i), kExportAgain);
                    corners.push_back(static_cast<std::uint32_t>(index));
                }
                append_polygon(corners, decoded_.vertices, decoded_.facets);
            }
        }
    }
    /// Made only where something is wrong: counting lines takes as long as the text.
    [[nodiscard]] std::string here_of_face(std::uint64_t i) const {
        return fmt::format("{}, face {} (counted from 0)", place_, i);
    }

    Context& context_;
    std::string_view bytes_;
    double mm_per_unit_;
    const std::string& place_;
    Header header_;
    std::size_t at_ = 0;
    DecodedMesh decoded_;
};

DecodedMesh decode(Context& context, std::string_view bytes, const DecodeOptions& options,
                   const std::string& place) {
    // A vertex of 24 bytes takes 12 of binary at least, a facet's 12 take 13.
    const MemoryCharge charge(context, bytes.size() * 2, "the numbers of " + place);
    return PlyReader(context, bytes, options.mm_per_unit, place).read();
}

}  // namespace

extern const MeshFormat kPlyFormat;
const MeshFormat kPlyFormat{"PLY", kFamily, {".ply", ""}, true, recognise, require, decode};

}  // namespace slabwright
