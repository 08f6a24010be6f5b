#include "io/read/stl.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "io/read/input_file.h"
#include "io/read/repair.h"
#include "io/text/sha256.h"
#include "io/write/output_file.h"
#include "kernels/errors.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kHeaderBytes = 84;  ///< 80 of text, 4 of facet count
constexpr std::size_t kFacetBytes = 50;   ///< normal, three corners, attribute
constexpr std::size_t kHead = 4096;       ///< first bytes, in which text has no zero
constexpr std::size_t kWeldBytes = 56;    ///< of memory a facet, for a mesh and its welding
constexpr double kLeastHeight = 0.01;     ///< mm
constexpr double kAbsurdMm = 1e6;         ///< no pattern lies a kilometre from its origin
constexpr double kSmallBox = 5;           ///< in the declared unit; below, the unit is suspicious
constexpr double kLargeBox = 5000;        ///< likewise, above
constexpr std::string_view kExportAgain = "export the file again";

// ---------------------------------------------------------------------------------------------------- the
// file

[[noreturn]] void refuse(const std::string& code, const std::string& message, const std::string& place,
                         std::string_view remedy) {
    throw Error(ErrorKind::input, "stl." + code, message, place, std::string(remedy));
}

std::string hash_file(Context& context, std::string_view bytes) {
    Sha256 hash;
    constexpr std::size_t piece = std::size_t{1} << 24;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
        context.throw_if_cancelled();
        hash.update(std::as_bytes(std::span(bytes.substr(at, piece))));
    }
    return hash.hex();
}

// ---------------------------------------------------------------------------------------------------- what
// is common

/// Facets, to be set on z = 0 in millimetres, and where they lie in the file.
struct Corners {
    FacetRecords facets;                   ///< of the file's bytes, or of what a text said
    RawArray<std::array<Vec3f, 3>> spelt;  ///< the corners of a text
    std::array<double, 3> min{}, max{};    ///< mm, as in the file
};

struct Extent {
    std::array<double, 3> min, max;
    static Extent none() {
        constexpr double inf = std::numeric_limits<double>::infinity();
        return {{inf, inf, inf}, {-inf, -inf, -inf}};
    }
    void add(const std::array<double, 3>& p) {
        for (std::size_t k = 0; k < 3; ++k) {
            min[k] = std::min(min[k], p[k]);
            max[k] = std::max(max[k], p[k]);
        }
    }
    void merge(const Extent& other) {
        for (std::size_t k = 0; k < 3; ++k) {
            min[k] = std::min(min[k], other.min[k]);
            max[k] = std::max(max[k], other.max[k]);
        }
    }
};

/// The one rounding a coordinate suffers: scaled and lowered in double, then to float32 (as FacetRecords do
/// with binary ones).
Vec3f place_corner(const std::array<double, 3>& p, double mm_per_unit, double lowest_mm) {
    return {static_cast<float>(p[0] * mm_per_unit), static_cast<float>(p[1] * mm_per_unit),
            static_cast<float>(p[2] * mm_per_unit - lowest_mm)};
}

void set_box(Corners& corners, const Extent& extent, double mm_per_unit) {
    for (std::size_t k = 0; k < 3; ++k) {
        corners.min[k] = extent.min[k] * mm_per_unit;
        corners.max[k] = extent.max[k] * mm_per_unit;
    }
}

bool absurd(double value, double mm_per_unit) { return !(std::abs(value * mm_per_unit) <= kAbsurdMm); }

[[noreturn]] void refuse_coordinate(double value, double mm_per_unit, const std::string& place) {
    if (!std::isfinite(value))
        refuse("non_finite", fmt::format("a corner has the coordinate {}", value), place,
               "repair the mesh in the program that made it");
    refuse("absurd",
           fmt::format("a corner has the coordinate {:.6g} mm, over the limit of {:.0f} mm",
                       value * mm_per_unit, kAbsurdMm),
           place, "check the unit (--units) and the file, which may be damaged");
}

// ---------------------------------------------------------------------------------------------------- binary

template <class T>
T load(const char* p) {
    T value;
    std::memcpy(&value, p, sizeof value);
    return value;
}

std::array<double, 3> binary_corner(const char* facet, std::size_t corner) {
    const char* p = facet + 12 + 12 * corner;
    return {load<float>(p), load<float>(p + 4), load<float>(p + 8)};
}

/// `bytes` holds exactly `count` facets after the header.
Corners read_binary(Context& context, std::string_view bytes, std::size_t count, double mm_per_unit,
                    const std::string& path) {
    constexpr std::size_t grain = std::size_t{1} << 15;
    const char* facets = bytes.data() + kHeaderBytes;
    struct Scan {
        Extent extent = Extent::none();
        std::size_t bad =
            std::numeric_limits<std::size_t>::max();  ///< first coordinate that is unusable, counted through
    };
    const Scan scan = parallel_reduce(
        context, count, grain, Scan{},
        [&](std::size_t begin, std::size_t end) {
            Scan part;
            for (std::size_t f = begin; f < end; ++f) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const std::array<double, 3> p = binary_corner(facets + kFacetBytes * f, c);
                    for (std::size_t k = 0; k < 3; ++k)
                        if (absurd(p[k], mm_per_unit)) part.bad = std::min(part.bad, 9 * f + 3 * c + k);
                    part.extent.add(p);
                }
            }
            return part;
        },
        [](Scan a, const Scan& b) {
            a.extent.merge(b.extent);
            a.bad = std::min(a.bad, b.bad);
            return a;
        });
    if (scan.bad != std::numeric_limits<std::size_t>::max()) {
        const std::size_t f = scan.bad / 9, c = scan.bad / 3 % 3, k = scan.bad % 3;
        refuse_coordinate(binary_corner(facets + kFacetBytes * f, c)[k], mm_per_unit,
                          fmt::format("{}, facet {} (counted from 0), {} of corner {}, offset {}", path, f,
                                      "xyz"[k], c, kHeaderBytes + kFacetBytes * f + 12 + 12 * c + 4 * k));
    }
    Corners corners;
    set_box(corners, scan.extent, mm_per_unit);
    corners.facets = {facets + 12, count, kFacetBytes, mm_per_unit, corners.min[2]};
    return corners;
}

// ---------------------------------------------------------------------------------------------------- ASCII

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// `word` in any case; `expected` in lower case.
bool is_word(std::string_view word, std::string_view expected) {
    return word.size() == expected.size() && std::equal(word.begin(), word.end(), expected.begin(),
                                                        [](char a, char b) { return lower(a) == b; });
}

/// Words separated by white space; lines matter only for the names of solids.
struct Words {
    std::string_view text;
    std::size_t at = 0;

    void skip_space() {
        while (at < text.size() && is_space(text[at])) ++at;
    }
    /// The next word, empty at the end of the file; `at` then stands behind it.
    std::string_view next() {
        skip_space();
        const std::size_t begin = at;
        while (at < text.size() && !is_space(text[at])) ++at;
        return text.substr(begin, at - begin);
    }
    void skip_line() {
        while (at < text.size() && text[at] != '\n' && text[at] != '\r') ++at;
    }
};

enum class Fault { none, syntax, coordinate };

/// A piece of the text and what was read from it.
struct Piece {
    std::size_t begin = 0, end = 0;
    std::vector<std::array<double, 9>> facets;  ///< in the file's unit
    Extent extent = Extent::none();
    Fault fault = Fault::none;
    std::size_t offset = 0;  ///< of the faulty word
    std::string_view found;  ///< the faulty word; empty at the end of the file
    std::string expected;    ///< what should have stood there
    double value = 0;        ///< the faulty coordinate
    bool ended = false;      ///< the last keyword was endsolid
    bool any_keyword = false;
};

/// Reads one number whatever the locale. @return false when `word` is none
bool read_number(std::string_view word, double& value) {
    const std::string_view digits = !word.empty() && word[0] == '+' ? word.substr(1) : word;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (end != digits.data() + digits.size() || digits.empty() || (digits != word && digits[0] == '-'))
        return false;
    if (error == std::errc::result_out_of_range) {
        // Too small to be told from zero, or too large to be a length.
        const std::size_t exponent = digits.find_first_of("eE");
        const bool tiny = exponent != std::string_view::npos
                              ? digits.substr(exponent).find('-') != std::string_view::npos
                              : digits.find_first_of("123456789") > digits.find('.');
        value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
        return true;
    }
    return error == std::errc{};
}

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
        std::array<double, 9> facet;
        for (std::size_t c = 0; c < 3; ++c) {
            if (!expect("vertex")) return false;
            for (std::size_t k = 0; k < 3; ++k) {
                double& value = facet[3 * c + k];
                word = words.next();
                if (!read_number(word, value)) return fail("a number");
                if (absurd(value, mm_per_unit)) {
                    fail("a usable coordinate");
                    piece.fault = Fault::coordinate;
                    piece.value = value;
                    return false;
                }
            }
            piece.extent.add({facet[3 * c], facet[3 * c + 1], facet[3 * c + 2]});
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

/// A word as it can be printed.
std::string printable(std::string_view word) {
    if (word.empty()) return "the end of the file";
    std::string text = "'";
    for (const char c : word.substr(0, 40)) {
        if (c >= ' ' && c <= '~') text += c;
        else text += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
    return text + (word.size() > 40 ? "…'" : "'");
}

std::string ascii_place(const std::string& path, std::string_view text, std::size_t offset,
                        std::size_t facet) {
    // Lines end with \n, \r\n or \r.
    std::size_t line = 1;
    for (std::size_t i = 0; i < offset; ++i)
        line += text[i] == '\n' || (text[i] == '\r' && (i + 1 == text.size() || text[i + 1] != '\n'));
    return fmt::format("{}, line {}, offset {}, facet {} (counted from 0)", path, line, offset, facet);
}

Corners read_ascii(Context& context, std::string_view text, std::size_t begin, double mm_per_unit,
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
    Extent extent = Extent::none();
    std::vector<std::size_t> firsts;
    bool ended = false;
    for (const Piece& piece : pieces) {
        firsts.push_back(count);
        count += piece.facets.size();
        extent.merge(piece.extent);
        if (piece.any_keyword) ended = piece.ended;
        if (piece.fault == Fault::none) continue;
        const std::string place = ascii_place(path, text, piece.offset, count);
        if (piece.fault == Fault::coordinate) refuse_coordinate(piece.value, mm_per_unit, place);
        if (piece.found.empty())
            refuse("truncated", "the text ends where " + piece.expected + " should stand", place,
                   kExportAgain);
        refuse("unparsable", "found " + printable(piece.found) + " where " + piece.expected + " should stand",
               place, "export the file again, or as binary STL");
    }
    if (!ended)
        refuse("truncated", fmt::format("the text ends after {} facets without 'endsolid'", count),
               ascii_place(path, text, text.size(), count), kExportAgain);
    if (count == 0) refuse("no_facets", "the text holds no facets", path, kExportAgain);

    Corners corners;
    set_box(corners, extent, mm_per_unit);
    corners.spelt = RawArray<std::array<Vec3f, 3>>(count);
    parallel_each(context, pieces.size(), [&](std::size_t i) {
        std::size_t f = firsts[i];
        for (const std::array<double, 9>& facet : pieces[i].facets) {
            for (std::size_t c = 0; c < 3; ++c)
                corners.spelt[f][c] = place_corner({facet[3 * c], facet[3 * c + 1], facet[3 * c + 2]},
                                                   mm_per_unit, corners.min[2]);
            ++f;
        }
        pieces[i].facets = {};
    });
    corners.facets = {reinterpret_cast<const char*>(corners.spelt.data()), count};
    return corners;
}

// ---------------------------------------------------------------------------------------------------- which
// of the two

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
               "found " + printable(Words{head}.next()) +
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

Corners read_facets(Context& context, std::string_view bytes, double mm_per_unit, const std::string& path) {
    if (const auto count = binary_count(bytes, bytes.size()))
        return read_binary(context, bytes, *count, mm_per_unit, path);
    const std::size_t begin = ascii_begin(bytes);
    if (begin == std::string_view::npos) refuse_format(bytes, bytes.size(), path);
    return read_ascii(context, bytes, begin, mm_per_unit, path);
}

/// A file whose bytes are copied into memory that the context accounts for. Mapped memory would end the
/// process where somebody shortens the file while it is read.
class FileBytes {
public:
    /// @throws Error(input) where it is no STL by its first bytes, Error(no_plan, "memory.limit") where
    /// reading it would pass the limit
    FileBytes(Context& context, const std::string& path)
        : file_(path, {ErrorKind::input, "stl.", kMostMeshBytes}) {
        std::string head(std::min<std::uint64_t>(file_.size(), kHead), '\0');
        file_.read(0, head.data(), head.size());
        require_format(head, file_.size(), path);
        // What a mesh of so many bytes takes beside them while it is welded, asked before they are read.
        const MemoryCharge need(context, file_.size() + file_.size() / kFacetBytes * kWeldBytes,
                                "reading " + path);
        load(context, path);
    }
    /// Reads all of it, unless it is there already. @throws Error(input, "stl.changed") where somebody has
    /// written the file since it was opened
    void load(Context& context, const std::string& path) {
        if (charge_) return;
        charge_.emplace(context, file_.size(), "the bytes of " + path);
        bytes_ = RawArray<char>(file_.size());
        constexpr std::size_t piece = std::size_t{1} << 22;
        parallel_for(context, bytes_.size(), piece, [&](std::size_t begin, std::size_t end) {
            file_.read(begin, bytes_.data() + begin, end - begin);
        });
        file_.require_unchanged();
    }
    void let_go() {
        bytes_ = {};
        charge_.reset();
    }
    [[nodiscard]] std::string_view bytes() const noexcept { return {bytes_.data(), bytes_.size()}; }

private:
    InputFile file_;
    std::optional<MemoryCharge> charge_;
    RawArray<char> bytes_;
};

// ----------------------------------------------------------------------------------------------------
// diagnostics

std::array<double, 3> facet_centre(const Mesh& mesh, std::uint32_t facet) {
    std::array<double, 3> centre{};
    for (const std::uint32_t v : mesh.facets[facet]) {
        centre[0] += mesh.vertices[v].x / 3.0;
        centre[1] += mesh.vertices[v].y / 3.0;
        centre[2] += mesh.vertices[v].z / 3.0;
    }
    return centre;
}

std::string number_of(std::uint64_t count, std::string_view one, std::string_view many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

void describe(const Mesh& mesh, const Finding& finding, Severity severity, std::string code,
              std::string message, std::vector<Diagnostic>& diagnostics) {
    if (finding.count == 0) return;
    diagnostics.push_back({severity, std::move(code),
                           fmt::format("{}, first at facet {}", message, finding.first_facet),
                           facet_centre(mesh, finding.first_facet)});
}

void describe_report(const Mesh& mesh, const MeshReport& report, std::vector<Diagnostic>& diagnostics) {
    auto edges = [](const Finding& finding) { return number_of(finding.count, "edge", "edges"); };
    auto facets = [](const Finding& finding) { return number_of(finding.count, "facet", "facets"); };
    describe(mesh, report.open_edges_off_base, Severity::error, "mesh.open",
             edges(report.open_edges_off_base) + " above the base with one facet only: the mesh is open",
             diagnostics);
    if (report.open_edges.count > report.open_edges_off_base.count && report.open_edges_off_base.count == 0)
        describe(
            mesh, report.open_edges, Severity::warning, "mesh.open_base",
            edges(report.open_edges) + " in the base plane with one facet only: the base is taken as closed",
            diagnostics);
    else if (report.open_edges.count > report.open_edges_off_base.count)
        diagnostics.push_back(
            {Severity::warning, "mesh.open_base",
             number_of(report.open_edges.count - report.open_edges_off_base.count, "edge", "edges") +
                 " in the base plane with one facet only: the base is taken as closed",
             std::nullopt});
    describe(mesh, report.misoriented_edges, Severity::error, "mesh.misoriented",
             edges(report.misoriented_edges) + " whose facets do not face the same side", diagnostics);
    describe(mesh, report.inverted_components, Severity::error, "mesh.inverted",
             number_of(report.inverted_components.count, "body", "bodies") + " inside out (negative volume)",
             diagnostics);
    describe(mesh, report.non_manifold_edges, Severity::warning, "mesh.non_manifold",
             edges(report.non_manifold_edges) + " with more than two facets", diagnostics);
    describe(mesh, report.duplicate_facets, Severity::warning, "mesh.duplicate",
             facets(report.duplicate_facets) + " given twice", diagnostics);
    describe(mesh, report.degenerate_facets, Severity::note, "mesh.degenerate",
             facets(report.degenerate_facets) + " without area", diagnostics);
}

/// The unit is never guessed; a box that suggests another is only remarked on.
void question_units(const InputInfo& input, LengthUnit units, std::vector<Diagnostic>& diagnostics) {
    const double mm_per_unit = units == LengthUnit::inch ? kInch : 1.0;
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
        longest = std::max(longest, (input.max[k] - input.min[k]) / mm_per_unit);
    if (longest >= kSmallBox && longest <= kLargeBox) return;
    const bool inch = units == LengthUnit::inch;
    diagnostics.push_back(
        {Severity::warning, "units.suspicious",
         fmt::format("the pattern's longest side is {:.6g} {}, which is {} {:g} {}; if the file is in {} "
                     "(then {:.6g} mm), say --units {}",
                     longest, inch ? "in" : "mm", longest < kSmallBox ? "under" : "over",
                     longest < kSmallBox ? kSmallBox : kLargeBox, inch ? "in" : "mm",
                     inch ? "millimetres" : "inches", inch ? longest : longest * kInch, inch ? "mm" : "in"),
         std::nullopt});
}

/// Welding may take the lowest vertex away; the pattern is then set down again.
void set_on_base(Mesh& mesh) {
    const float lowest = bounds(mesh.view()).min.z;
    if (lowest == 0) return;
    for (Vec3f& v : mesh.vertices) v.z = static_cast<float>(static_cast<double>(v.z) - lowest);
}

/// Facets without area that hang together with no other lie anywhere and are no part of the solid, but would
/// lift it off its base or enlarge its stock. Draws their corners together in a corner of the solid, where
/// they do nothing; their numbers stay. What hangs together with facets that have area fills a gap between
/// them, and stays.
/// @return how many; 0 where no facet has area
std::uint64_t draw_strays_in(Mesh& mesh, const MeshReport& report) {
    const auto has_area = [&](const Index3& f) {
        const Vec3f &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
        const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z,
                     vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
        return uy * vz != uz * vy || uz * vx != ux * vz || ux * vy != uy * vx;
    };
    std::vector<char> solid(report.components, 0);
    std::uint32_t corner = 0;
    for (std::size_t f = mesh.facets.size(); f-- > 0;)
        if (has_area(mesh.facets[f])) {
            solid[report.component_of[f]] = 1;
            corner = mesh.facets[f][0];
        }
    if (std::find(solid.begin(), solid.end(), 1) == solid.end()) return 0;
    std::vector<char> used(mesh.vertices.size(), 0);
    for (std::size_t f = 0; f < mesh.facets.size(); ++f)
        if (solid[report.component_of[f]])
            for (const std::uint32_t v : mesh.facets[f]) used[v] = 1;
    std::uint64_t strays = 0;
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
        if (solid[report.component_of[f]]) continue;
        ++strays;
        mesh.facets[f] = {corner, corner, corner};
        mesh.neighbours[f] = {kNoFacet, kNoFacet, kNoFacet};
    }
    if (strays == 0) return 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        if (!used[v]) mesh.vertices[v] = mesh.vertices[corner];
    return strays;
}

/// In which order a mesh has the facets of its file.
enum class FacetOrder : std::uint8_t {
    file,
    near,  ///< the file's where neighbours follow each other in it, or else one in which they do: all that
           ///< follows is many times faster then
};

constexpr std::size_t kFewFacets = 50'000;  // fewer lie in the caches in any order

/// Decodes and welds the bytes of a file; sets the input's count and box. @param order set to that of the
/// mesh
Mesh load_mesh(Context& context, std::string_view bytes, double mm_per_unit, const std::string& path,
               InputInfo& input, std::vector<std::uint32_t>* odd, FacetOrder& order) {
    // 30 bytes a facet for the mesh; a text has fewer facets than its length could hold in binary.
    const MemoryCharge charge(context, bytes.size() / kFacetBytes * 30, "reading " + path);
    const Corners corners = read_facets(context, bytes, mm_per_unit, path);
    const MemoryCharge spelt(context, corners.spelt.size() * sizeof(corners.spelt[0]),
                             "the corners of " + path);
    context.advance();
    input.triangles = corners.facets.count;
    input.min = corners.min;
    input.max = corners.max;
    if (order == FacetOrder::file || corners.facets.count < kFewFacets || neighbours_follow(corners.facets)) {
        order = FacetOrder::file;
        return weld_records(context, corners.facets, odd);
    }
    const auto at = [&](const std::array<double, 3>& p) {
        return Vec3f{static_cast<float>(p[0]), static_cast<float>(p[1]),
                     static_cast<float>(p[2] - corners.min[2])};
    };
    const KeptMemory kept;
    const MemoryCharge together(context, corners.facets.count * sizeof(std::array<Vec3f, 3>),
                                "bringing facets together");
    return weld_and_let_go(context, in_space(context, corners.facets, {at(corners.min), at(corners.max)}),
                           odd);
}

/// Whether something is wrong that is told by a facet.
bool names_a_facet(const MeshReport& r) {
    const Finding findings[] = {r.open_edges,         r.open_edges_off_base, r.non_manifold_edges,
                                r.misoriented_edges,  r.degenerate_facets,   r.duplicate_facets,
                                r.inverted_components};
    return std::any_of(std::begin(findings), std::end(findings),
                       [](const Finding& f) { return f.count > 0; });
}

}  // namespace

Mesh read_mesh(Context& context, const std::string& path, LengthUnit units) {
    context.begin_phase("read STL", 0.0, 0.05, 2);
    const FileBytes file(context, path);
    InputInfo ignored;
    FacetOrder order = FacetOrder::near;
    Mesh mesh = load_mesh(context, file.bytes(), units == LengthUnit::inch ? kInch : 1.0, path, ignored,
                          nullptr, order);
    context.advance();
    return mesh;
}

StlMesh read_stl(Context& context, const std::string& path, const StlOptions& options) {
    context.begin_phase("read STL", 0.0, 0.01, 4);
    FileBytes file(context, path);
    const double mm_per_unit = options.units == LengthUnit::inch ? kInch : 1.0;
    StlMesh stl;
    stl.input.file = std::filesystem::path(path).filename().string();
    std::vector<std::uint32_t> odd;
    FacetOrder order = FacetOrder::near;
    // The digest is one long chain, so it takes one thread while the others decode and weld.
    parallel_each(context, 2, [&](std::size_t task) {
        if (task == 0) {
            stl.input.sha256 = hash_file(context, file.bytes());
        } else {
            stl.mesh = load_mesh(context, file.bytes(), mm_per_unit, path, stl.input, &odd, order);
            context.advance();
        }
    });
    file.let_go();
    question_units(stl.input, options.units, stl.diagnostics);
    const auto weld_and_report = [&]() -> std::optional<Diagnostic> {
        if (options.weld_mm == 0) {
            stl.report = report_mesh(context, stl.mesh.view(), &odd);
            return std::nullopt;
        }
        ToleranceWeld welded = weld_within(context, stl.mesh.view(), options.weld_mm);
        stl.mesh = std::move(welded.mesh);
        if (stl.mesh.facets.empty())
            refuse("no_facets", fmt::format("no facet is left after welding within {:g} mm", options.weld_mm),
                   path, "weld within less");
        set_on_base(stl.mesh);
        stl.report = report_mesh(context, stl.mesh.view());
        return Diagnostic{Severity::note, "mesh.welded",
                          fmt::format("welding within {:g} mm merged {} and removed {}", options.weld_mm,
                                      number_of(welded.merged, "vertex", "vertices"),
                                      number_of(welded.removed_facets, "facet", "facets")),
                          std::nullopt};
    };
    context.advance();
    std::optional<Diagnostic> note = weld_and_report();
    if (order == FacetOrder::near &&
        names_a_facet(stl.report)) {  // what is wrong is told by the file's facets
        order = FacetOrder::file;
        stl.mesh = {};
        file.load(context, path);
        stl.mesh = load_mesh(context, file.bytes(), mm_per_unit, path, stl.input, &odd, order);
        file.let_go();
        note = weld_and_report();
    }
    const double height = double(stl.report.box.max.z) - stl.report.box.min.z;
    if (!(height >= kLeastHeight))
        refuse("flat", fmt::format("the mesh is {:g} mm high: nothing can be built of it", height), path,
               "check the unit (--units), and which way is up in the file");
    if (note) stl.diagnostics.push_back(std::move(*note));
    if (stl.report.degenerate_facets.count > 0)
        if (const std::uint64_t strays = draw_strays_in(stl.mesh, stl.report)) {
            const double base = stl.input.min[2] + double{bounds(stl.mesh.view()).min.z};
            set_on_base(stl.mesh);
            stl.report = report_mesh(context, stl.mesh.view());
            const Box3& box = stl.report.box;
            stl.input.min = {box.min.x, box.min.y, base};
            stl.input.max = {box.max.x, box.max.y, base + box.max.z};
            stl.diagnostics.push_back({Severity::note, "mesh.stray",
                                       number_of(strays, "facet", "facets") +
                                           " without area that hang together with no body: left out",
                                       std::nullopt});
        }
    if (options.repair != Repair::none) {
        Repaired repaired = repair_mesh(context, stl.mesh.view(), stl.report, options.repair, path);
        if (repaired.told.how != "none") {
            stl.mesh = std::move(repaired.mesh);
            stl.report = std::move(repaired.report);
            if (stl.report.box.min.z != 0) {
                set_on_base(stl.mesh);
                stl.report = report_mesh(context, stl.mesh.view());
            }
        }
        stl.input.repair = std::move(repaired.told);
        stl.diagnostics.insert(stl.diagnostics.end(), repaired.diagnostics.begin(),
                               repaired.diagnostics.end());
    }
    stl.input.volume_mm3 = stl.report.volume_mm3;
    stl.mesh.roles = facet_roles(context, stl.mesh.view());
    context.advance();
    describe_report(stl.mesh, stl.report, stl.diagnostics);
    return stl;
}

void require_solid(Context& context, const StlMesh& stl, const std::string& path) {
    const MeshReport& report = stl.report;
    auto place = [&](const Finding& finding) {
        const std::array<double, 3> at = facet_centre(stl.mesh, finding.first_facet);
        return fmt::format("{}, facet {} at ({:.3f}, {:.3f}, {:.3f}) mm", path, finding.first_facet, at[0],
                           at[1], at[2]);
    };
    if (report.open_edges_off_base.count > 0) {
        // Cracks between vertices that were rounded differently close under a small weld: try, and name what
        // works.
        const Box3& box = report.box;
        const double dx = double(box.max.x) - box.min.x, dy = double(box.max.y) - box.min.y,
                     dz = double(box.max.z) - box.min.z;
        const double diagonal = std::sqrt(dx * dx + dy * dy + dz * dz);
        std::string remedy, largest;
        for (const double share : {1e-6, 1e-5, 1e-4}) {
            // Two digits, rounded up; what is tried is what is printed.
            const double scale = std::pow(10.0, std::floor(std::log10(share * diagonal)) - 1);
            largest = fmt::format("{:g}", std::ceil(share * diagonal / scale) * scale);
            double tolerance = 0;
            std::from_chars(largest.data(), largest.data() + largest.size(), tolerance);
            if (!(tolerance > 0)) continue;
            const ToleranceWeld welded = weld_within(context, stl.mesh.view(), tolerance);
            if (welded.mesh.facets.empty() ||
                report_mesh(context, welded.mesh.view()).open_edges_off_base.count > 0)
                continue;
            remedy = "--weld " + largest + " (mm) closes them all";
            break;
        }
        if (remedy.empty())
            remedy =
                "no weld up to " + largest + " mm closes them: close the mesh in the program that made it";
        refuse("open",
               number_of(report.open_edges_off_base.count, "edge", "edges") +
                   " above the base with one facet only: the mesh is open",
               place(report.open_edges_off_base),
               remedy + "; " + repair_offer(context, stl.mesh.view(), report));
    }
    if (report.misoriented_edges.count > 0)
        refuse("misoriented",
               number_of(report.misoriented_edges.count, "edge", "edges") +
                   " whose facets do not face the same side",
               place(report.misoriented_edges),
               "make the normals consistent in the program that made the mesh; " +
                   repair_offer(context, stl.mesh.view(), report));
    if (report.inverted_components.count > 0)
        refuse("inverted",
               number_of(report.inverted_components.count, "body is", "bodies are") +
                   " inside out (negative volume)",
               place(report.inverted_components),
               "flip its normals in the program that made the mesh; " +
                   repair_offer(context, stl.mesh.view(), report));
}

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
