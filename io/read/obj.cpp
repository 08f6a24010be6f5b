// OBJ: vertices and polygons of a Wavefront text. Groups, materials, normals and textures say nothing of the
// solid; points and lines are passed over and told; free-form surfaces are refused.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "io/read/mesh_format.h"
#include "io/read/polygon_facets.h"
#include "io/read/words.h"
#include "kernels/parallel/context.h"

namespace slabwright {

namespace {

constexpr std::string_view kFamily = "obj";

bool is_any_of(std::string_view word, std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

/// Statements that say nothing of the solid.
bool says_nothing(std::string_view word) {
    return is_any_of(word, {"vn", "vt", "g", "o", "s", "mg", "usemtl", "mtllib", "usemap", "maplib", "bevel",
                            "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj"});
}

bool is_free_form(std::string_view word) {
    return is_any_of(word, {"vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim",
                            "hole", "scrv", "sp", "end", "con"});
}

/// A text without zero bytes whose statements before the first vertex are OBJ's; one without a vertex goes by
/// its name.
bool recognise(std::string_view head, std::uint64_t, std::string_view name) {
    if (head.find('\0') != std::string_view::npos) return false;
    const bool named = name.size() >= 4 && is_word(name.substr(name.size() - 4), ".obj");
    Words words{head};
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
        if (word == "v") return true;
        if (word[0] != '#' && !says_nothing(word)) return named && is_free_form(word);
        words.skip_line();
    }
    return named;
}

void require(std::string_view, std::uint64_t, const std::string&) {}

class ObjReader {
public:
    ObjReader(Context& context, std::string_view text, double mm_per_unit, const std::string& place)
        : context_(context), text_(text), mm_per_unit_(mm_per_unit), place_(place) {}

    DecodedMesh read() {
        std::string joined;
        for (std::size_t at = 0; at < text_.size();) {
            if ((++lines_ & 0xFFF) == 0) context_.throw_if_cancelled();
            std::string_view line = next_line(at);
            // A line that ends in \ goes on in the next.
            if (!line.empty() && line.back() == '\\') {
                joined.clear();
                while (!line.empty() && line.back() == '\\') {
                    joined += line.substr(0, line.size() - 1);
                    joined += ' ';
                    if (at >= text_.size()) break;
                    ++lines_;
                    line = next_line(at);
                }
                if (line.empty() || line.back() != '\\') joined += line;
                line = joined;
            }
            read_statement(line.substr(0, line.find('#')));
        }
        if (decoded_.facets.empty())
            refuse_mesh(kFamily, "no_facets", "the text holds no facets", place_, kExportAgain);
        if (passed_over_ > 0)
            decoded_.diagnostics.push_back(
                {Severity::note, "obj.passed_over",
                 fmt::format("{} points and lines, which bound no solid, were passed over", passed_over_),
                 std::nullopt});
        return std::move(decoded_);
    }

private:
    std::string_view next_line(std::size_t& at) {
        std::size_t end = at;
        while (end < text_.size() && text_[end] != '\n' && text_[end] != '\r') ++end;
        const std::string_view line = text_.substr(at, end - at);
        if (end + 1 < text_.size() && text_[end] == '\r' && text_[end + 1] == '\n') ++end;
        at = end + 1;
        return line;
    }
    [[nodiscard]] std::string here() const { return fmt::format("{}, line {}", place_, lines_); }
    [[noreturn]] void fail(std::string_view found, std::string_view expected) const {
        refuse_mesh(kFamily, "unparsable",
                    fmt::format("found {} where {} should stand",
                                found.empty() ? "the end of the line" : quoted_word(found), expected),
                    here(), kExportAgain);
    }
    void read_statement(std::string_view line) {
        Words words{line};
        const std::string_view word = words.next();
        if (word.empty() || says_nothing(word)) return;
        if (word == "v") {
            read_vertex(words);
        } else if (word == "f" || word == "fo") {
            read_polygon(words);
        } else if (word == "p" || word == "l") {
            ++passed_over_;
        } else if (is_free_form(word)) {
            refuse_mesh(kFamily, "free_form",
                        fmt::format("'{}' belongs to a free-form surface, which has no facets", word), here(),
                        "export it as polygons");
        } else {
            fail(word, "a statement of OBJ");
        }
    }
    void read_vertex(Words& words) {
        FileVertex& v = decoded_.vertices.emplace_back();
        for (double& value : v) {
            const std::string_view word = words.next();
            if (!read_number(word, value)) fail(word, "a number");
            if (is_absurd(value, mm_per_unit_)) refuse_coordinate(kFamily, value, mm_per_unit_, here());
        }
    }
    void read_polygon(Words& words) {
        corners_.clear();
        for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
            // vertex/texture/normal: only the first says where the corner lies; negative ones count back.
            std::int64_t index = 0;
            const std::string_view first = word.substr(0, word.find('/'));
            const auto [end, error] = std::from_chars(first.data(), first.data() + first.size(), index);
            if (error != std::errc{} || end != first.data() + first.size() || index == 0)
                fail(word, "the number of a vertex");
            const auto count = static_cast<std::int64_t>(decoded_.vertices.size());
            const std::int64_t from_0 = index > 0 ? index - 1 : count + index;
            if (from_0 < 0 || from_0 >= count)
                refuse_mesh(kFamily, "index",
                            fmt::format("names vertex {}, and {} stand before it", index, count), here(),
                            kExportAgain);
            corners_.push_back(static_cast<std::uint32_t>(from_0));
            if (corners_.size() > kMostCorners)
                refuse_mesh(kFamily, "polygon",
                            fmt::format("a polygon has more than {} corners", kMostCorners), here(),
                            "export it in triangles");
        }
        if (corners_.size() < 3)
            refuse_mesh(kFamily, "polygon", fmt::format("a polygon has {} corners", corners_.size()), here(),
                        kExportAgain);
        append_polygon(corners_, decoded_.vertices, decoded_.facets);
    }

    Context& context_;
    std::string_view text_;
    double mm_per_unit_;
    const std::string& place_;
    std::size_t lines_ = 0;
    std::uint64_t passed_over_ = 0;
    std::vector<std::uint32_t> corners_;
    DecodedMesh decoded_;
};

DecodedMesh decode(Context& context, std::string_view bytes, const DecodeOptions& options,
                   const std::string& place) {
    // A vertex of 24 bytes takes 8 bytes of text at least and mostly some 30, a facet's 12 likewise.
    const MemoryCharge charge(context, bytes.size() * 2, "the numbers of " + place);
    return ObjReader(context, bytes, options.mm_per_unit, place).read();
}

}  // namespace

extern const MeshFormat kObjFormat;
const MeshFormat kObjFormat{"OBJ", kFamily, {".obj", ""}, true, recognise, require, decode};

}  // namespace slabwright
