// STL: binary and ASCII, decoded in parallel. A "solid" prefix is no proof of ASCII, the facet count of the
// header no proof of anything: both are checked against the length.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "io/read/mesh_format.h"
#include "io/read/words.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kHeaderBytes = 84;  ///< 80 of text, 4 of facet count
constexpr std::size_t kFacetBytes = 50;   ///< normal, three corners, attribute

[[noreturn]] void refuse(std::string_view code, const std::string& message, const std::string& place,
                         std::string_view remedy) {
    refuse_mesh("stl", code, message, place, remedy);
}

// ---- binary

template <class T>
T load(const char* p) {
    T value;
    std::memcpy(&value, p, sizeof value);
    return value;
}

FileVertex binary_corner(const char* facet, std::size_t corner) {
    const char* p = facet + 12 + 12 * corner;
    return {load<float>(p), load<float>(p + 4), load<float>(p + 8)};
}

/// `bytes` holds exactly `count` facets after the header.
DecodedMesh read_binary(Context& context, std::string_view bytes, std::size_t count, double mm_per_unit,
                        const std::string& path) {
    constexpr std::size_t grain = std::size_t{1} << 15, none = std::numeric_limits<std::size_t>::max();
    const char* facets = bytes.data() + kHeaderBytes;
    struct Scan {
        Extent extent = Extent::none();
        std::size_t bad = none;  ///< first coordinate that is unusable, counted through
    };
    const Scan scan = parallel_reduce(
        context, count, grain, Scan{},
        [&](std::size_t begin, std::size_t end) {
            Scan part;
            for (std::size_t f = begin; f < end; ++f) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const FileVertex p = binary_corner(facets + kFacetBytes * f, c);
                    for (std::size_t k = 0; k < 3; ++k)
                        if (is_absurd(p[k], mm_per_unit)) part.bad = std::min(part.bad, 9 * f + 3 * c + k);
                    part.extent.add(p);
                }
            }
            return part;
        },
        [](Scan one, const Scan& other) {
            one.extent.merge(other.extent);
            one.bad = std::min(one.bad, other.bad);
            return one;
        });
    const std::size_t bad = scan.bad;
    if (bad != none) {
        const std::size_t f = bad / 9, c = bad / 3 % 3, k = bad % 3;
        refuse_coordinate("stl", binary_corner(facets + kFacetBytes * f, c)[k], mm_per_unit,
                          fmt::format("{}, facet {} (counted from 0), {} of corner {}, offset {}", path, f,
                                      "xyz"[k], c, kHeaderBytes + kFacetBytes * f + 12 + 12 * c + 4 * k));
    }
    DecodedMesh decoded;
    decoded.records = {facets + 12, count, kFacetBytes, 1, 0};
    decoded.box = scan.extent;
    return decoded;
}

// ---- ASCII

enum class Fault { none, syntax, coordinate };

/// A piece of the text and what was read from it.
struct Piece {
    std::size_t begin = 0, end = 0;
    std::vector<FileFacet> facets;
    Fault fault = Fault::none;
    std::size_t offset = 0;  ///< of the faulty word
    std::string_view found;  ///< the faulty word; empty at the end of the file
    std::string expected;    ///< what should have stood there
    double value = 0;        ///< the faulty coordinate
    bool ended = false;      ///< the last keyword was endsolid
    bool any_keyword = false;
};

/// Reads facets until a keyword begins at or after piece.end. Stops at the first fault.
void read_piece(std::string_view text, double mm_per_unit, Piece& piece) {
    Words words{text, piece.begin};
    std::string_view word;
    auto fail = [&](std::string expected) {
        piece.fault = Fault::syntax;
        piece.offset = words.at - word.size();
        piece.found = word;
        piece.expected = std::move(expected);
        return false;
    };
    auto expect = [&](std::string_view keyword) {
        word = words.next();
        return is_word(word, keyword) || fail("'" + std::string(keyword) + "'");
    };
    auto read_facet = [&] {
        if (!expect("normal")) return false;
        // Normals are not used, so anything will do, NaN included; some writers leave numbers out.
        int numbers = 0;
        for (word = words.next(); !is_word(word, "outer"); word = words.next())
            if (word.empty() || ++numbers > 3) return fail("'outer loop'");
        if (!expect("loop")) return false;
        FileFacet facet;
        for (std::size_t c = 0; c < 3; ++c) {
            if (!expect("vertex")) return false;
            for (std::size_t k = 0; k < 3; ++k) {
                double& value = facet[3 * c + k];
                word = words.next();
                if (!read_number(word, value)) return fail("a number");
                if (is_absurd(value, mm_per_unit)) {
                    fail("a usable coordinate");
                    piece.fault = Fault::coordinate;
                    piece.value = value;
                    return false;
                }
            }
        }
        if (!expect("endloop") || !expect("endfacet")) return false;
        piece.facets.push_back(facet);
        return true;
    };
    piece.facets.reserve((piece.end - piece.begin) / 200);
    for (;;) {
        words.skip_space();
        if (words.at >= piece.end) return;
        word = words.next();
        piece.any_keyword = true;
        piece.ended = false;
        if (is_word(word, "facet")) {
            if (!read_facet()) return;
        } else if (is_word(word, "solid")) {
            words.skip_line();
        } else if (is_word(word, "endsolid")) {
            words.skip_line();
            piece.ended = true;
        } else {
            fail("'solid', 'facet' or 'endsolid'");
            return;
        }
    }
}

/// The first line at or after `from`, before `to`, that begins a facet: "facet normal". The name of a solid
/// cannot, as it follows its keyword on the line. Returns `to` when there is none.
std::size_t find_facet_line(std::string_view text, std::size_t from, std::size_t to) {
    for (std::size_t at = from; at < to; ++at) {
        if (text[at] != '\n' && text[at] != '\r') continue;
        Words words{text, at};
        words.skip_space();
        if (words.at >= to) return to;
        const std::size_t begin = words.at;
        if (lower(text[begin]) == 'f' && is_word(words.next(), "facet") && is_word(words.next(), "normal"))
            return begin;
        at = begin;
    }
    return to;
}

std::string ascii_place(const std::string& path, std::string_view text, std::size_t offset,
                        std::size_t facet) {
    return fmt::format("{}, line {}, offset {}, facet {} (counted from 0)", path, line_of(text, offset),
                       offset, facet);
}

DecodedMesh read_ascii(Context& context, std::string_view text, std::size_t begin, double mm_per_unit,
                       const std::string& path) {
    constexpr std::size_t piece_bytes = std::size_t{1} << 20;
    const std::size_t shares = (text.size() - begin + piece_bytes - 1) / piece_bytes;
    std::vector<std::size_t> starts(shares);
    parallel_each(context, shares, [&](std::size_t i) {
        const std::size_t from = begin + i * piece_bytes, to = std::min(text.size(), from + piece_bytes);
        starts[i] = i == 0 ? begin : find_facet_line(text, from, to);
    });
    std::vector<Piece> pieces;
    for (std::size_t i = 0; i < shares; ++i) {
        if (i > 0 && starts[i] >= std::min(text.size(), begin + (i + 1) * piece_bytes))
            continue;  // no facet begins in this share
        if (!pieces.empty()) pieces.back().end = starts[i];
        pieces.emplace_back().begin = starts[i];
    }
    pieces.back().end = text.size();
    // Doubles until the lowest z is known: 72 bytes a facet, which takes some 250 bytes of text.
    const MemoryCharge charge(context, text.size() / 3, "the numbers of " + path);
    parallel_each(context, pieces.size(), [&](std::size_t i) { read_piece(text, mm_per_unit, pieces[i]); });

    std::size_t count = 0;
    bool ended = false;
    for (const Piece& piece : pieces) {
        count += piece.facets.size();
        if (piece.any_keyword) ended = piece.ended;
        if (piece.fault == Fault::none) continue;
        const std::string place = ascii_place(path, text, piece.offset, count);
        if (piece.fault == Fault::coordinate) refuse_coordinate("stl", piece.value, mm_per_unit, place);
        if (piece.found.empty())
            refuse("truncated", "the text ends where " + piece.expected + " should stand", place,
                   kExportAgain);
        refuse("unparsable",
               "found " + quoted_word(piece.found) + " where " + piece.expected + " should stand", place,
               "export the file again, or as binary STL");
    }
    if (!ended)
        refuse("truncated", fmt::format("the text ends after {} facets without 'endsolid'", count),
               ascii_place(path, text, text.size(), count), kExportAgain);
    if (count == 0) refuse("no_facets", "the text holds no facets", path, kExportAgain);

    DecodedMesh decoded;
    for (Piece& piece : pieces) decoded.pieces.push_back(std::move(piece.facets));
    return decoded;
}

// ---- which of the two

/// Offset of the word "solid" that begins an ASCII file, or npos. Binary headers may begin with it too; but
/// their numbers hold zero bytes and text does not.
std::size_t ascii_begin(std::string_view bytes) {
    Words words{bytes, bytes.substr(0, 3) == "\xEF\xBB\xBF" ? std::size_t{3} : std::size_t{0}};
    words.skip_space();
    const std::size_t begin = words.at;
    if (!is_word(words.next(), "solid")) return std::string_view::npos;
    if (bytes.substr(0, kHead).find('\0') != std::string_view::npos) return std::string_view::npos;
    return begin;
}

/// The facets that a binary file of so many bytes announces; nothing where its length is another, or it is
/// shorter than a header. The length decides first: it fits a binary file by chance only if its text spells
/// out its own length.
std::optional<std::uint64_t> binary_count(std::string_view head, std::uint64_t size) {
    if (size < kHeaderBytes) return std::nullopt;
    const std::uint64_t count = load<std::uint32_t>(head.data() + 80);
    if (kHeaderBytes + kFacetBytes * count != size) return std::nullopt;
    return count;
}

/// Refuses a file that is neither of the two. @param head its first bytes. @param size of all of it
[[noreturn]] void refuse_format(std::string_view head, std::uint64_t size, const std::string& path) {
    if (head.substr(0, kHead).find('\0') == std::string_view::npos)
        refuse("not_stl",
               "found " + quoted_word(Words{head}.next()) +
                   " where an ASCII STL begins with 'solid', and the length fits no binary STL",
               path + ", line 1", "name an STL file");
    const std::string place = fmt::format("{}, offset {}", path, size);
    if (size < kHeaderBytes)
        refuse("truncated",
               fmt::format("the file ends at offset {}, inside the {} bytes of a binary header", size,
                           kHeaderBytes),
               place, kExportAgain);
    const std::uint64_t count = load<std::uint32_t>(head.data() + 80),
                        expected = kHeaderBytes + kFacetBytes * count,
                        present = (size - kHeaderBytes) / kFacetBytes,
                        rest = (size - kHeaderBytes) % kFacetBytes;
    const std::string both = fmt::format(
        "the header announces {} facets ({} bytes), but the data ends at offset {} after {} facets", count,
        expected, size, present);
    if (rest != 0 && expected > size)
        refuse("truncated", fmt::format("{} and {} bytes of the next", both, rest), place,
               "copy or export the file again; its end is missing");
    if (rest != 0)
        refuse("facet_count", fmt::format("{} and {} bytes more", both, rest), place,
               "export the file again; a transfer as text may have damaged it");
    refuse("facet_count", both, place,
           "export the file again; the writer did not correct its header, or facets are missing");
}

/// Refuses what the first bytes show to be no STL, before all of it is read.
void require_format(std::string_view head, std::uint64_t size, const std::string& path) {
    if (size == 0) refuse("empty", "the file is empty (0 bytes)", path, kExportAgain);
    if (const auto count = binary_count(head, size)) {
        if (*count == 0)
            refuse("no_facets", "the header announces 0 facets and none follow", path, kExportAgain);
        return;
    }
    if (ascii_begin(head) != std::string_view::npos) return;
    Words words{head};
    (void)words.next();
    // Else its first word is not all here.
    const bool known =
        words.at < head.size() || head.size() == size || head.find('\0') != std::string_view::npos;
    if (known) refuse_format(head, size, path);
}

DecodedMesh decode_stl(Context& context, std::string_view bytes, const DecodeOptions& options,
                       const std::string& path) {
    const double mm_per_unit = options.mm_per_unit;
    if (const auto count = binary_count(bytes, bytes.size()))
        return read_binary(context, bytes, *count, mm_per_unit, path);
    const std::size_t begin = ascii_begin(bytes);
    if (begin == std::string_view::npos) refuse_format(bytes, bytes.size(), path);
    return read_ascii(context, bytes, begin, mm_per_unit, path);
}

/// An STL is told by its length or by its first word.
bool recognise_stl(std::string_view head, std::uint64_t size, std::string_view) {
    return binary_count(head, size).has_value() || ascii_begin(head) != std::string_view::npos;
}

}  // namespace

extern const MeshFormat kStlFormat;
const MeshFormat kStlFormat{"STL", "stl", {".stl", ""}, true, recognise_stl, require_format, decode_stl};

}  // namespace slabwright
