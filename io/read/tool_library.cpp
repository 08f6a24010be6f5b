#include "io/read/tool_library.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "engine/job.h"
#include "io/read/input_file.h"
#include "io/read/words.h"
#include "io/text/job_keys.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

[[noreturn]] void refuse(const char* code, const std::string& place, const std::string& message,
                         const std::string& remedy) {
    throw Error(ErrorKind::usage, std::string("tools.") + code, message, place, remedy);
}

std::string place_at(const fs::path& path, std::size_t line) {
    return fmt::format("{}:{}", path.string(), line);
}

double number_in(std::string_view word, const std::string& place) {
    double value = 0;
    if (!read_number(word, value) || !std::isfinite(value))
        refuse("value", place, fmt::format("{} is not a number", quoted_word(word)), "write a number in mm");
    return value;
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
    return text;
}

template <class Take>
void each_line(std::string_view text, Take&& take) {
    std::size_t line = 1;
    for (std::size_t at = 0; at < text.size(); ++line) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        take(trimmed(text.substr(at, end - at)), line);
        at = end + 1;
    }
}

std::string text_of(const fs::path& path) {
    return read_whole(path, {ErrorKind::usage, "tools.", kMostToolTableBytes, "check the path of the tools"});
}

// The measures of a form as tool_table() writes them behind its word, "R1" and "A5"; false for anything else.
bool read_form(std::string_view text, ToolKind kind, LibraryTool& tool) {
    Words words{text};
    std::vector<StatedValue> found;
    const auto measure = [&](char letter, const char* key) {
        const std::string_view word = words.next();
        double value = 0;
        if (word.size() < 2 || word[0] != letter || !read_number(word.substr(1), value)) return false;
        found.emplace_back(key, value);
        return true;
    };
    if (has_corner(kind) && !measure('R', "corner_radius")) return false;
    if (has_taper(kind) && !measure('A', "taper_deg")) return false;
    if (has_point(kind) && !measure('A', "point_deg")) return false;
    if (!words.next().empty()) return false;
    tool.values.insert(tool.values.end(), found.begin(), found.end());
    return true;
}

// A row's remark is the tool's name. Of a tool with a corner, a taper or a point it ends as tool_table()
// writes it: ", bull-nose R1.5".
void add_remark(std::string_view remark, LibraryTool& tool) {
    for (const Word<ToolKind>& kind : kToolWords) {
        if (!has_corner(kind.value) && !has_taper(kind.value) && !has_point(kind.value)) continue;
        const std::string mark = fmt::format("{} ", kind.text);
        const std::size_t at = remark.rfind(mark);
        if (at == std::string_view::npos || !read_form(remark.substr(at + mark.size()), kind.value, tool))
            continue;
        tool.values.emplace_back("kind", std::string(kind.text));
        remark = trimmed(remark.substr(0, at));
        if (!remark.empty() && remark.back() == ',') remark = trimmed(remark.substr(0, remark.size() - 1));
        break;
    }
    if (!remark.empty()) tool.values.emplace_back("name", std::string(remark));
}

// T and D of every row, and its remark. Pockets, offsets, angles and a lathe's words say nothing of a cutter.
std::vector<LibraryTool> read_linuxcnc(const fs::path& path) {
    std::vector<LibraryTool> tools;
    const std::string text = text_of(path);
    each_line(text, [&](std::string_view row, std::size_t line) {
        const std::string place = place_at(path, line);
        const std::size_t remark = std::min(row.find(';'), row.size());
        Words words{row.substr(0, remark)};
        LibraryTool tool{place, {}};
        std::string seen;
        for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
            const char letter = static_cast<char>(lower(word[0]) - 'a' + 'A');
            if (std::string_view("TPDXYZABCUVWIJQ").find(letter) == std::string_view::npos)
                refuse("syntax", place, fmt::format("{} is no word of a tool table", quoted_word(word)),
                       "words begin with T, P, D, X, Y, Z, A, B, C, U, V, W, I, J or Q");
            if (seen.find(letter) != std::string::npos)
                refuse("syntax", place, fmt::format("the word {} stands twice", letter), "leave one");
            seen += letter;
            const double value = number_in(word.substr(1), place);
            if (letter == 'T') {
                if (value != std::floor(value) || value < 0 || value > 1e6)
                    refuse("value", place, fmt::format("T{:g} is no tool's number", value),
                           "write T1, T2, …");
                tool.values.emplace_back("number", static_cast<std::int64_t>(value));
            }
            if (letter == 'D' && value != 0) tool.values.emplace_back("diameter", value);
        }
        if (seen.empty()) return;
        if (seen.find('T') == std::string::npos)
            refuse("syntax", place, "a row without a tool's number", "begin the row with T and the number");
        add_remark(trimmed(row.substr(std::min(remark + 1, row.size()))), tool);
        tools.push_back(std::move(tool));
    });
    return tools;
}

// The cells of a row, with commas or semicolons between, in quotes where they hold one; "" is a quote.
std::vector<std::string> cells_of(std::string_view row, const std::string& place, char between) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (std::size_t i = 0; i < row.size(); ++i) {
        const char c = row[i];
        if (c == '"' && quoted && i + 1 < row.size() && row[i + 1] == '"') cells.back() += row[++i];
        else if (c == '"') quoted = !quoted;
        else if (c == between && !quoted) cells.emplace_back();
        else cells.back() += c;
    }
    if (quoted) refuse("syntax", place, "a quote is not closed", "close it in the same line");
    for (std::string& cell : cells) cell = std::string(trimmed(cell));
    return cells;
}

// What kind of value each key takes.
struct KeyTypes {
    std::vector<std::pair<std::string, char>> types;  // n: number, i: whole number, b: true or false, t: text
    void required() {}
    void key(const char* name, double, const char*) { types.emplace_back(name, 'n'); }
    void key(const char* name, int, const char*) { types.emplace_back(name, 'i'); }
    void key(const char* name, bool, const char*) { types.emplace_back(name, 'b'); }
    void key(const char* name, const std::string&, const char*) { types.emplace_back(name, 't'); }
    void key(const char*, const std::vector<double>&, const char*) {}  // a list is no cell
    void degrees(const char* name, double, const char*) { types.emplace_back(name, 'n'); }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum, const Word<Enum> (&)[N], const char*) {
        types.emplace_back(name, 't');
    }
};

StatedValue stated(const std::pair<std::string, char>& key, const std::string& cell,
                   const std::string& place) {
    const auto& [name, type] = key;
    if (type == 't') return {name, cell};
    if (type == 'b') {
        if (cell != "true" && cell != "false")
            refuse("value", place, fmt::format("{} is {}, not true or false", name, quoted_word(cell)),
                   "write true or false");
        return {name, cell == "true"};
    }
    const double value = number_in(cell, place);
    if (type == 'n') return {name, value};
    if (value != std::floor(value) || std::abs(value) > 1e9)
        refuse("value", place, fmt::format("{} is {}, not a whole number", name, cell),
               "write a whole number");
    return {name, static_cast<std::int64_t>(value)};
}

std::vector<LibraryTool> read_csv(const fs::path& path) {
    KeyTypes known;
    const Tool tool;
    visit_tool_keys(tool, known);
    std::vector<std::pair<std::string, char>> columns;
    std::vector<LibraryTool> tools;
    const std::string text = text_of(path);
    char between = ',';
    each_line(text, [&](std::string_view row, std::size_t line) {
        if (row.empty() || row.front() == '#') return;
        const std::string place = place_at(path, line);
        const bool is_head = columns.empty();
        if (is_head && row.find(';') != std::string_view::npos) between = ';';
        const std::vector<std::string> cells = cells_of(row, place, between);
        if (is_head) {
            for (const std::string& cell : cells) {
                const auto found = std::find_if(known.types.begin(), known.types.end(),
                                                [&](const auto& key) { return key.first == cell; });
                if (found == known.types.end())
                    refuse("key", place, fmt::format("{} is no key of a tool", quoted_word(cell)),
                           "the first row names keys of [[tool]], as `slabwright job --defaults` has them");
                if (std::find(columns.begin(), columns.end(), *found) != columns.end())
                    refuse("key", place, fmt::format("{} stands twice", cell), "leave one column");
                columns.push_back(*found);
            }
            return;
        }
        if (cells.size() != columns.size())
            refuse("syntax", place, fmt::format("{} cells under {} keys", cells.size(), columns.size()),
                   "give each key a cell; an empty one states nothing");
        LibraryTool& read = tools.emplace_back(LibraryTool{place, {}});
        for (std::size_t i = 0; i < cells.size(); ++i)
            if (!cells[i].empty()) read.values.push_back(stated(columns[i], cells[i], place));
    });
    return tools;
}

// A JSON document with the lines on which its keys stand.
class FreecadFile {
public:
    explicit FreecadFile(fs::path path)
        : path_(std::move(path)),
          text_(read_document(path_, ErrorKind::usage, "tools.unreadable", "check the path of the tools")) {
        try {
            root_ = json::parse(text_);
        } catch (const json::parse_error& error) {
            refuse("syntax", place_at(path_, line_of(text_, error.byte > 0 ? error.byte - 1 : 0)), "not JSON",
                   "export the library from FreeCAD again");
        }
        if (!root_.is_object())
            refuse("syntax", place_at(path_, 1), "no object", "name a .fctb or .fctl file");
    }
    [[nodiscard]] const json& root() const { return root_; }
    [[nodiscard]] const fs::path& path() const { return path_; }
    /// Of the `nth` time that a key stands in the file, from 0.
    [[nodiscard]] std::string place_of(const std::string& key, std::size_t nth = 0) const {
        std::size_t at = text_.find('"' + key + '"');
        for (; nth > 0 && at != std::string::npos; --nth) at = text_.find('"' + key + '"', at + 1);
        return place_at(path_, at == std::string::npos ? 1 : line_of(text_, at));
    }

private:
    fs::path path_;
    std::string text_;
    json root_;
};

// "5.0000 mm", "0.25 in", 1/4 " is none; or a plain number, in mm.
double length_in(const json& value, const std::string& key, const std::string& place) {
    if (value.is_number()) return value.get<double>();
    if (!value.is_string()) refuse("value", place, key + " is no length", "write it as \"5.0 mm\"");
    const std::string text = value.get<std::string>();
    Words words{text};
    std::string_view digits = words.next(), unit = trimmed(std::string_view(text).substr(words.at));
    if (unit.empty()) {
        const std::size_t end = digits.find_first_not_of("+-0123456789.eE");
        if (end != std::string_view::npos) unit = digits.substr(end), digits = digits.substr(0, end);
    }
    constexpr std::pair<std::string_view, double> kUnits[] = {
        {"mm", 1}, {"um", 1e-3}, {"µm", 1e-3}, {"cm", 10}, {"m", 1000}, {"in", kInch}, {"\"", kInch}};
    for (const auto& [name, mm] : kUnits)
        if (unit == name) return number_in(digits, place) * mm;
    refuse("unit", place, fmt::format("{} is {}, without a unit of length", key, quoted_word(text)),
           "write mm, um, cm, m or in behind the number");
}

const char* kind_of(const std::string& shape) {
    const std::string stem = fs::path(shape).stem().string();
    if (stem == "endmill") return "flat";
    if (stem == "ballend") return "ball";
    if (stem == "bullnose" || stem == "torus") return "bull-nose";
    if (stem == "v-bit" || stem == "vbit") return "cone";
    if (stem == "taperedballnose") return "tapered-ball";
    return stem == "drill" ? "drill" : nullptr;
}

// "118.00 °" or a plain number, degrees; none where the bit does not state it.
std::optional<double> angle_of(const FreecadFile& file, const json& given, const char* key) {
    const auto found = given.find(key);
    if (found == given.end()) return std::nullopt;
    const std::string text = found->is_string() ? found->get<std::string>() : found->dump();
    Words words{text};
    std::string_view digits = words.next();
    digits = digits.substr(0, digits.find_first_not_of("+-0123456789.eE"));
    return number_in(digits, file.place_of(key));
}

std::optional<double> length_of(const FreecadFile& file, const json& given, const char* key) {
    const auto found = given.find(key);
    if (found == given.end()) return std::nullopt;
    return length_in(*found, key, file.place_of(key));
}

// The corner of a bull-nose; until 2024 FreeCAD gave the radius of its floor instead.
void add_corner(const FreecadFile& file, const json& given, LibraryTool& tool) {
    if (const auto corner = length_of(file, given, "CornerRadius")) {
        tool.values.emplace_back("corner_radius", *corner);
        return;
    }
    const auto floor = length_of(file, given, "FlatRadius"), diameter = length_of(file, given, "Diameter");
    if (!floor || !diameter)
        refuse("shape", file.place_of("shape"), "a bull-nose without CornerRadius",
               "give the bit a CornerRadius in FreeCAD");
    tool.values.emplace_back("corner_radius", *diameter / 2 - *floor);
}

// FreeCAD's TaperAngle is the whole angle, and its Diameter that of the ball.
void add_taper(const FreecadFile& file, const json& given, LibraryTool& tool) {
    const auto ball = length_of(file, given, "Diameter"), wide = length_of(file, given, "TaperDiameter"),
               angle = angle_of(file, given, "TaperAngle");
    if (!ball || !wide || !angle)
        refuse("shape", file.place_of("shape"),
               "a tapered ball without Diameter, TaperDiameter or TaperAngle",
               "give the bit all three in FreeCAD");
    tool.values.emplace_back("diameter", *wide);
    tool.values.emplace_back("corner_radius", *ball / 2);
    tool.values.emplace_back("taper_deg", *angle / 2);
}

// A V-bit whose TipDiameter is no more than what FreeCAD gives sharp ones has a point.
void add_point(const FreecadFile& file, const json& given, LibraryTool& tool) {
    constexpr double kSharp = 0.1;  // mm
    const auto angle = angle_of(file, given, "CuttingEdgeAngle"), tip = length_of(file, given, "TipDiameter");
    if (!angle)
        refuse("shape", file.place_of("shape"), "a V-bit without CuttingEdgeAngle",
               "give the bit a CuttingEdgeAngle in FreeCAD");
    if (tip && *tip > kSharp + 1e-9)
        refuse("shape", file.place_of("TipDiameter"), fmt::format("a V-bit with a tip of {} mm", *tip),
               "only V-bits with a point can be planned with; leave it out of [tools] numbers");
    tool.values.emplace_back("point_deg", *angle);
}

// FreeCAD's Length is the whole bit's, not what stands out of a holder: it states nothing here.
LibraryTool read_bit(const FreecadFile& file) {
    LibraryTool tool{place_at(file.path(), 1), {}};
    const json& root = file.root();
    if (const auto name = root.find("name"); name != root.end() && name->is_string())
        tool.values.emplace_back("name", name->get<std::string>());
    const auto shape = root.find("shape");
    if (shape == root.end() || !shape->is_string())
        refuse("shape", file.place_of("shape"), "the bit has no shape", "export it from FreeCAD again");
    const char* const kind = kind_of(shape->get<std::string>());
    if (kind == nullptr)
        refuse(
            "shape", file.place_of("shape"),
            fmt::format("a bit of the shape {} cannot be planned with",
                        quoted_word(fs::path(shape->get<std::string>()).stem().string())),
            "name the tools to take in [tools] numbers; endmill, bullnose, ballend, taperedballnose, v-bit "
            "and drill can be");
    tool.values.emplace_back("kind", std::string(kind));
    const json none = json::object();
    const auto parameters = root.find("parameter");
    const json& given = parameters != root.end() && parameters->is_object() ? *parameters : none;
    const bool tapers = kind_of("taperedballnose") == std::string(kind);
    for (const auto& [theirs, ours] : {std::pair{"Diameter", "diameter"},
                                       {"CuttingEdgeHeight", "flute_length"},
                                       {"ShankDiameter", "shank_diameter"}})
        if (const auto mm = length_of(file, given, theirs);
            mm && !(tapers && ours == std::string("diameter")))
            tool.values.emplace_back(ours, *mm);
    if (kind_of("bullnose") == std::string(kind)) add_corner(file, given, tool);
    if (tapers) add_taper(file, given, tool);
    if (kind_of("v-bit") == std::string(kind)) add_point(file, given, tool);
    const auto attributes = root.find("attribute");
    for (const json* const table : {&given, attributes != root.end() ? &*attributes : &none}) {
        const auto flutes = table->is_object() ? table->find("Flutes") : table->end();
        if (!table->is_object() || flutes == table->end()) continue;
        const std::string text = flutes->is_string() ? flutes->get<std::string>() : flutes->dump();
        tool.values.push_back(stated({"flutes", 'i'}, text, file.place_of("Flutes")));
        break;
    }
    if (const auto angle = angle_of(file, given, "TipAngle"); angle && kind_of("drill") == std::string(kind))
        tool.values.emplace_back("point_deg", *angle);
    return tool;
}

std::vector<LibraryTool> read_freecad_library(const FreecadFile& file,
                                              const std::vector<std::int64_t>& wanted) {
    const auto list = file.root().find("tools");
    if (list == file.root().end() || !list->is_array())
        refuse("syntax", file.place_of("tools"), "the library has no list of tools",
               "export it from FreeCAD again");
    std::vector<LibraryTool> tools;
    for (std::size_t i = 0; i < list->size(); ++i) {
        const json& entry = (*list)[i];
        const std::string place = file.place_of("nr", i);
        if (!entry.is_object() || !entry.contains("nr") || !entry["nr"].is_number_integer() ||
            !entry.contains("path") || !entry["path"].is_string())
            refuse("syntax", place, "a tool without nr and path", "export the library from FreeCAD again");
        const auto number = entry["nr"].get<std::int64_t>();
        if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), number) == wanted.end()) continue;
        // Bits lie beside the library, or in the folder Bit beside the library's.
        const fs::path bit = entry["path"].get<std::string>(), folder = file.path().parent_path();
        fs::path found = folder / bit;
        if (!fs::exists(found) && fs::exists(folder / ".." / "Bit" / bit))
            found = folder / ".." / "Bit" / bit;
        if (!fs::exists(found))
            refuse("missing", file.place_of("path", i),
                   fmt::format("there is no {}", quoted_word(bit.string())),
                   "lay the bits beside the library, or in Bit beside its folder");
        LibraryTool tool = read_bit(FreecadFile(found));
        tool.place = place;
        tool.values.insert(tool.values.begin(), {"number", number});
        tools.push_back(std::move(tool));
    }
    return tools;
}

bool is_wanted(const LibraryTool& tool, const std::vector<std::int64_t>& wanted) {
    for (const auto& [key, value] : tool.values)
        if (const auto* number = std::get_if<std::int64_t>(&value); key == "number" && number != nullptr)
            return std::find(wanted.begin(), wanted.end(), *number) != wanted.end();
    return true;
}

}  // namespace

std::vector<LibraryTool> read_tool_library(const fs::path& path, const std::vector<std::int64_t>& wanted) {
    std::string ending = path.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), lower);
    std::vector<LibraryTool> tools;
    if (ending == ".tbl") tools = read_linuxcnc(path);
    else if (ending == ".csv") tools = read_csv(path);
    else if (ending == ".fctb") tools.push_back(read_bit(FreecadFile(path)));
    else if (ending == ".fctl") tools = read_freecad_library(FreecadFile(path), wanted);
    else
        refuse("format", path.string(), "tools are not read from files of this kind",
               "name a .tbl of LinuxCNC, a .fctl or .fctb of FreeCAD, or a .csv");
    if (!wanted.empty()) std::erase_if(tools, [&](const LibraryTool& t) { return !is_wanted(t, wanted); });
    if (tools.empty()) refuse("empty", path.string(), "there are no tools in it", "name another file");
    return tools;
}

}  // namespace slabwright
