#include "io/read/job_toml.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "io/read/job_tools.h"
#include "io/read/key_reader.h"
#include "io/text/decimal.h"
#include "io/text/job_keys.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

/// Lists the keys, "table.key", in the order of the table.
struct KeyNames {
    std::string prefix;
    std::vector<std::string> names, tables;
    void table(const char* name, const char*) {
        prefix = std::string(name) + ".";
        tables.emplace_back(name);
    }
    void required() {}
    template <class Value>
    void key(const char* name, const Value&, const char*) {
        names.push_back(prefix + name);
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum, const Word<Enum> (&)[N], const char*) {
        names.push_back(prefix + name);
    }
    void degrees(const char* name, double, const char*) { names.push_back(prefix + name); }
};

/// The same walk over the whole job: table() moves to the next [table].
class JobReader : public KeyReader {
public:
    JobReader(const toml::table& root, const std::string& file) : KeyReader(root, file), root_(root) {}
    void table(const char* name, const char*) { enter_root_table(root_, name); }

private:
    const toml::table& root_;
};

constexpr std::size_t kMostKeyParts = 8;  ///< those of a job have two; a number or a date has one point

/// Refuses keys of many parts before they are parsed: the parser calls itself for each part.
void require_shallow_keys(std::string_view text, const std::string& file) {
    std::size_t line = 1, points = 0;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const char c = text[at];
        if (c == '#') {
            at = std::min(text.find('\n', at), text.size()) - 1;
        } else if (c == '"' || c == '\'') {
            // A text in one or three quotes, in which only " knows \. An unclosed one is the parser's to
            // tell.
            const std::string three(3, c);
            const std::size_t quotes = text.substr(at, 3) == three ? 3 : 1;
            std::size_t end = at + quotes;
            while (end < text.size() && text.substr(end, quotes) != three.substr(0, quotes) &&
                   (quotes == 3 || text[end] != '\n')) {
                if (c == '"' && text[end] == '\\') ++end;
                if (end < text.size() && text[end] == '\n') ++line;
                ++end;
            }
            at = end + quotes - 1;
            if (quotes == 3)  // two more may stand before the closing three
                while (at + 1 < text.size() && at < end + 4 && text[at + 1] == c) ++at;
            if (quotes == 1 && end < text.size() && text[end] == '\n') at = end - 1;
        } else if (c == '.') {
            if (++points < kMostKeyParts) continue;
            throw Error(ErrorKind::usage, "job.syntax",
                        fmt::format("a key of more than {} parts", kMostKeyParts),
                        fmt::format("{}:{}", file, line), "keys have two parts, as in machine.clearance");
        } else if (c == '\n' || c == '=' || c == ',' || c == '[' || c == ']' || c == '{' || c == '}') {
            points = 0;
            line += c == '\n' ? 1 : 0;
        }
    }
}

KeyNames all_keys() {
    const Job job;
    KeyNames names;
    visit_job_keys(job, names);
    names.table("tool", "");
    visit_tool_keys(job.tools.front(), names);
    names.table("tools", "");
    names.names.insert(names.names.end(), {"tools.library", "tools.numbers"});
    visit_tool_keys(job.tools.front(), names);
    return names;
}

/// Refuses the first key (by line) that the table does not have, naming the nearest that it has.
void refuse_unknown(const toml::table& values, const std::string& prefix, const KeyNames& known,
                    const KeyReader& reader) {
    std::vector<std::pair<std::string, const toml::node*>> given;
    for (auto&& [key, node] : values) given.emplace_back(std::string(key.str()), &node);
    std::sort(given.begin(), given.end(), [](const auto& a, const auto& b) {
        const auto& p = a.second->source().begin;
        const auto& q = b.second->source().begin;
        return std::tie(p.line, p.column, a.first) < std::tie(q.line, q.column, b.first);
    });
    for (const auto& [key, node] : given) {
        if (prefix.empty() &&
            std::find(known.tables.begin(), known.tables.end(), key) != known.tables.end()) {
            if (key == "tool") continue;  // a list; its entries are looked at one by one
            if (const toml::table* inner = node->as_table()) refuse_unknown(*inner, key + ".", known, reader);
            continue;
        }
        // A key that is not known may be as long as the file: it is compared and told by its beginning.
        const std::string shown = key.substr(0, kShownLetters), full = prefix + shown;
        if (key == shown && std::find(known.names.begin(), known.names.end(), full) != known.names.end())
            continue;
        // The key may be misspelt, or right but in the wrong table: both are found by the better of two
        // distances.
        std::string best;
        std::size_t best_distance = ~std::size_t{0};
        std::vector<std::string> candidates = known.names;
        if (prefix.empty()) candidates.insert(candidates.end(), known.tables.begin(), known.tables.end());
        for (const std::string& candidate : candidates) {
            const std::size_t dot = candidate.find('.');
            const std::string_view bare = dot == std::string::npos
                                              ? std::string_view(candidate)
                                              : std::string_view(candidate).substr(dot + 1);
            const std::size_t distance =
                std::min(2 * edit_distance(full, candidate), 2 * edit_distance(shown, bare) + 1);
            if (distance < best_distance) {
                best = candidate;
                best_distance = distance;
            }
        }
        reader.fail(*node, "job.unknown_key", fmt::format("unknown key {}", full),
                    fmt::format("did you mean {}?", best));
    }
}

/// Prints keys as lines of TOML with their comments in one column.
struct Printer {
    std::string text;
    void table(const char* name, const char* comment) {
        text += fmt::format("\n[{}]", name);
        if (*comment != '\0') text += fmt::format("  # {}", comment);
        text += '\n';
    }
    void required() {}
    void line(const char* name, const std::string& value, const char* comment) {
        std::string entry = fmt::format("{} = {}", name, value);
        if (*comment != '\0') entry = fmt::format("{:<36}  # {}", entry, comment);
        text += entry + '\n';
    }
    static std::string real(double value) {
        std::string digits;
        append_decimal(digits, value);
        if (digits.find('.') == std::string::npos) digits += ".0";
        return digits;
    }
    static std::string quoted(const std::string& value) {
        std::string out = "\"";
        for (const char c : value) {
            if (c == '"' || c == '\\') (out += '\\') += c;
            else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F)
                out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
            else out += c;
        }
        return out + '"';
    }
    void key(const char* name, double value, const char* comment) { line(name, real(value), comment); }
    void key(const char* name, int value, const char* comment) { line(name, std::to_string(value), comment); }
    void key(const char* name, bool value, const char* comment) {
        line(name, value ? "true" : "false", comment);
    }
    void key(const char* name, const std::string& value, const char* comment) {
        line(name, quoted(value), comment);
    }
    void key(const char* name, const std::vector<double>& values, const char* comment) {
        std::string list;
        for (const double value : values) list += (list.empty() ? "" : ", ") + real(value);
        line(name, "[" + list + "]", comment);
    }
    void degrees(const char* name, double radians, const char* comment) {
        // Degrees that come out of radians carry rounding in the last digits; nine decimals bring 30 back
        // as 30.
        std::string digits;
        append_rounded(digits, radians * 180 / std::numbers::pi, 9);
        if (digits.find('.') == std::string::npos) digits += ".0";
        line(name, digits, comment);
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum value, const Word<Enum> (&words)[N], const char* comment) {
        line(name, quoted(word_of(words, value)), comment);
    }
};

std::vector<const toml::table*> listed_tools(const toml::table& root, const KeyReader& reader,
                                             const KeyNames& known) {
    std::vector<const toml::table*> listed;
    const toml::node* const node = root.get("tool");
    if (node == nullptr) return listed;
    const toml::array* const tools = node->as_array();
    if (tools == nullptr || !tools->is_array_of_tables())
        reader.fail(*node, "job.type",
                    fmt::format("tool is {}, not a list of tables", KeyReader::type_name(*node)),
                    "write [[tool]] in double brackets");
    for (const toml::node& entry : *tools) listed.push_back(entry.as_table());
    for (const toml::table* const values : listed) refuse_unknown(*values, "tool.", known, reader);
    return listed;
}

}  // namespace

Job parse_job(std::string_view text, const std::string& file, const Job& base, const ToolSource& tools) {
    require_shallow_keys(text, file);
    toml::table root;
    try {
        root = toml::parse(text, file);
    } catch (const toml::parse_error& error) {
        throw Error(ErrorKind::usage, "job.syntax",
                    quoting_line(fmt::format("not TOML: {}", error.description())),
                    fmt::format("{}:{}", file, error.source().begin.line),
                    "`slabwright job --defaults` prints a job file that is right");
    }
    Job job = base;
    JobReader reader(root, file);
    const KeyNames known = all_keys();
    refuse_unknown(root, "", known, reader);
    visit_job_keys(job, reader);
    const std::vector<const toml::table*> listed = listed_tools(root, reader, known);
    const toml::node* const shared = root.get("tools");
    if (shared != nullptr || !tools.library.empty()) {
        job.tools = library_tools(shared, listed, reader, file, tools);
    } else if (!listed.empty() || root.contains("tool")) {
        job.tools.clear();
        for (const toml::table* const values : listed) {
            reader.enter(values, fmt::format("tool[{}].", job.tools.size() + 1));
            job.tools.push_back(tool_of(*values, reader));
        }
    }
    try {
        validate(job);
    } catch (const Error& error) {
        // validate() names the key; the reader knows on which line it stands. A key at its default has no
        // line.
        const auto place = reader.places().find(error.place());
        throw Error(error.kind(), error.code(), quoting_line(error.message()),
                    place != reader.places().end() ? place->second : file, error.remedy());
    }
    return job;
}

std::string job_toml(const Job& job) {
    Printer printer;
    printer.text =
        "# A job of Slabwright. Every key may be left out; lengths in mm, forces in N, angles in degrees.\n";
    visit_job_keys(job, printer);
    printer.text += "\n# The tool library. Any [[tool]] replaces the whole default library.\n";
    for (const Tool& tool : job.tools) {
        printer.text += "\n[[tool]]\n";
        visit_tool_keys(tool, printer);
    }
    return std::move(printer.text);
}

}  // namespace slabwright
