#include "io/read/own_post.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "io/posts/post_lines.h"
#include "io/posts/post_probe.h"
#include "io/read/input_file.h"
#include "io/read/toml_text.h"
#include "io/text/json_text.h"
#include "io/text/nearest_word.h"
#include "io/text/post_keys.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::size_t kShownLetters = 60;  ///< of what is wrong, that an error repeats
constexpr std::size_t kMostLines = 64;     ///< of one template
constexpr std::size_t kLongestName = 40;
constexpr int kHighestSwitch = 999;
/// Numbers of M that stop, start, change or call something on every control.
constexpr int kNoSwitches[] = {0,  1,  2,  3,  4,  5,  6,  9,  19, 29, 30, 47,
                               48, 49, 60, 61, 70, 71, 72, 73, 96, 97, 98, 99};

/// A line of a template, to be checked when all keys are known.
struct StatedLine {
    std::string text;
    PostPart part;
    std::string place;
};

/// Lists the keys, "table.key".
struct PostKeyNames {
    std::string prefix;
    std::vector<std::string> names{"base", "name", "ending"}, tables;
    void table(const char* name) {
        prefix = std::string(name) + ".";
        tables.emplace_back(name);
    }
    void add(const char* name) { names.push_back(prefix + name); }
    template <class Value>
    void key(const char* name, const Value&, const char*) {
        add(name);
    }
    template <class Value>
    void key(const char* name, const Value&, int, int, const char*) {
        add(name);
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum, const Word<Enum> (&)[N], const char*) {
        add(name);
    }
    void lines(const char* name, const std::string&, PostPart, const char*) { add(name); }
};

PostKeyNames all_post_keys() {
    PostKeyNames names;
    const Dialect mm = dialect_of(Post::linuxcnc), inch = dialect_of(Post::linuxcnc, LengthUnit::inch);
    visit_post_keys(mm, names);
    names.prefix = "numbers.";
    visit_decimals(inch, names);
    const ExtraLines extra;
    visit_extra_keys(extra, names);
    return names;
}

/// Fills a dialect from a parsed document, walking the table of keys.
class PostReader {
public:
    PostReader(const toml::table& root, const std::string& file) : root_(root), file_(file), table_(&root) {}

    std::vector<StatedLine> stated;  ///< all lines that it met

    void table(const char* name) {
        prefix_ = std::string(name) + ".";
        const toml::node* node = root_.get(name);
        table_ = nullptr;
        if (node == nullptr) return;
        table_ = node->as_table();
        if (table_ == nullptr)
            fail(node, "post.type", fmt::format("{} is no table", name),
                 fmt::format("write [{}] on a line of its own", name));
    }
    void key(const char* name, bool& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto truth = node->value_exact<bool>();
        if (!truth) wrong_type(node, name, "true or false");
        value = *truth;
    }
    void key(const char* name, int& value, int low, int high, const char*) {
        if (const auto number = whole(name, low, high)) value = *number;
    }
    void key(const char* name, std::size_t& value, int low, int high, const char*) {
        if (const auto number = whole(name, low, high)) value = static_cast<std::size_t>(*number);
    }
    void key(const char* name, std::string& value, const char*) {
        if (const toml::node* node = find(name)) value = text(node, name);
    }
    void key(const char* name, std::vector<int>& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        value.clear();
        for (const toml::node& element : list(node, name, "a list of whole numbers")) {
            const auto number = element.value_exact<std::int64_t>();
            if (!number) wrong_type(&element, name, "a list of whole numbers");
            if (*number < 0 || *number > kHighestSwitch ||
                std::find(std::begin(kNoSwitches), std::end(kNoSwitches), *number) != std::end(kNoSwitches))
                fail(&element, "post.range", fmt::format("M{} is no switch", *number),
                     "list numbers of M that switch dust, vacuum or air, and nothing else");
            value.push_back(static_cast<int>(*number));
        }
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum& value, const Word<Enum> (&words)[N], const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const std::string given = text(node, name).substr(0, kShownLetters);
        std::vector<std::string> known;
        for (const Word<Enum>& w : words) {
            if (given == w.text) {
                value = w.value;
                return;
            }
            known.emplace_back(w.text);
        }
        fail(node, "post.word",
             fmt::format("{}{} is \"{}\", none of {}", prefix_, name, given, fmt::join(known, ", ")),
             fmt::format("did you mean \"{}\"?", nearest_word(given, known)));
    }
    void lines(const char* name, std::string& value, PostPart part, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        value.clear();
        const toml::array& all = list(node, name, "a list of lines");
        if (all.size() > kMostLines)
            fail(node, "post.range", fmt::format("{}{} has {} lines", prefix_, name, all.size()),
                 fmt::format("give {} at most", kMostLines));
        for (const toml::node& element : all) {
            const auto line = element.value_exact<std::string>();
            if (!line) wrong_type(&element, name, "a list of lines, each a text in quotes");
            stated.push_back({*line, part, place_of(&element)});
            value += *line + '\n';
        }
        // What the operator sets has no line feed behind its last line.
        if (part == PostPart::notes && !value.empty()) value.pop_back();
    }

    [[nodiscard]] const toml::node* find(const char* name) const {
        return table_ != nullptr ? table_->get(name) : nullptr;
    }
    [[nodiscard]] std::string required_text(const char* name, const char* remedy) const {
        const toml::node* node = root_.get(name);
        if (node == nullptr)
            throw Error(ErrorKind::usage, "post.missing_key", fmt::format("{} is missing", name), file_,
                        remedy);
        return text(node, name);
    }
    [[nodiscard]] std::string place_of(const toml::node* node) const {
        const auto line = node != nullptr ? node->source().begin.line : 0;
        return line > 0 ? fmt::format("{}:{}", file_, line) : file_;
    }
    [[noreturn]] void fail(const toml::node* node, const char* code, const std::string& message,
                           const std::string& remedy) const {
        throw Error(ErrorKind::usage, code, quoting_line(message), place_of(node), remedy);
    }
    void refuse_unknown() const {
        const PostKeyNames known = all_post_keys();
        refuse_unknown(root_, "", known);
        for (const std::string& table : known.tables)
            if (const toml::node* node = root_.get(table); node != nullptr && node->is_table())
                refuse_unknown(*node->as_table(), table + ".", known);
    }

private:
    void refuse_unknown(const toml::table& values, const std::string& prefix,
                        const PostKeyNames& known) const {
        std::vector<std::pair<std::size_t, std::pair<std::string, const toml::node*>>> given;
        for (auto&& [key, node] : values)
            given.push_back({node.source().begin.line, {std::string(key.str()), &node}});
        std::sort(given.begin(), given.end());
        std::vector<std::string> candidates = known.names;
        candidates.insert(candidates.end(), known.tables.begin(), known.tables.end());
        for (const auto& [line, entry] : given) {
            const std::string full = prefix + entry.first.substr(0, kShownLetters);
            if (entry.first.size() > kShownLetters ||
                std::find(candidates.begin(), candidates.end(), full) == candidates.end())
                fail(entry.second, "post.unknown_key", fmt::format("unknown key {}", full),
                     fmt::format("did you mean {}?", nearest_word(full, candidates)));
        }
    }
    std::optional<int> whole(const char* name, int low, int high) const {
        const toml::node* node = find(name);
        if (node == nullptr) return std::nullopt;
        const auto number = node->value_exact<std::int64_t>();
        if (!number) wrong_type(node, name, "a whole number");
        if (*number < low || *number > high)
            fail(node, "post.range", fmt::format("{}{} is {}", prefix_, name, *number),
                 fmt::format("give {} to {}", low, high));
        return static_cast<int>(*number);
    }
    std::string text(const toml::node* node, const char* name) const {
        const auto value = node->value_exact<std::string>();
        if (!value) wrong_type(node, name, "a text in quotes");
        return *value;
    }
    const toml::array& list(const toml::node* node, const char* name, const char* wanted) const {
        const toml::array* array = node->as_array();
        if (array == nullptr) wrong_type(node, name, wanted);
        return *array;
    }
    [[noreturn]] void wrong_type(const toml::node* node, const char* name, const char* wanted) const {
        fail(node, "post.type", fmt::format("{}{} is not {}", prefix_, name, wanted),
             fmt::format("give {}", wanted));
    }

    const toml::table& root_;
    const std::string& file_;
    const toml::table* table_;
    std::string prefix_;
};

Post base_of(const PostReader& reader, const toml::table& root) {
    const std::string given =
        reader.required_text("base", "name the control that it is based on: base = \"fanuc\"")
            .substr(0, kShownLetters);
    std::vector<std::string> known;
    for (const Word<Post>& word : kPostWords) {
        if (word.value == Post::heidenhain) continue;
        if (given == word.text) return word.value;
        known.emplace_back(word.text);
    }
    const bool conversational = given == word_of(kPostWords, Post::heidenhain);
    reader.fail(
        root.get("base"), "post.base",
        conversational
            ? "heidenhain is conversational: its blocks are no lines of letters and numbers that a post "
              "could say otherwise"
            : fmt::format("base is \"{}\", none of {}", given, fmt::join(known, ", ")),
        conversational ? "base it on one of " + fmt::format("{}", fmt::join(known, ", "))
                       : fmt::format("did you mean \"{}\"?", nearest_word(given, known)));
}

std::string name_of(const PostReader& reader, const toml::table& root) {
    std::string name = reader.required_text("name", "give it a name: name = \"our router\"");
    const bool plain =
        std::all_of(name.begin(), name.end(), [](char c) { return c >= ' ' && c <= '~' && c != '"'; });
    if (name.empty() || name.size() > kLongestName || !plain)
        reader.fail(root.get("name"), "post.range", "name is no name",
                    fmt::format("give 1 to {} plain characters", kLongestName));
    return name;
}

std::string ending_of(const PostReader& reader, const toml::table& root) {
    const toml::node* node = root.get("ending");
    if (node == nullptr) return {};
    std::string ending = reader.required_text("ending", "");
    if (std::find(kProgramEndings.begin(), kProgramEndings.end(), ending) == kProgramEndings.end())
        reader.fail(node, "post.word",
                    fmt::format("ending is \"{}\", which ends no programs", ending.substr(0, kShownLetters)),
                    fmt::format("give one of {}", fmt::join(kProgramEndings, ", ")));
    return ending;
}

/// What a control takes for comments, and how long its lines may be, is the base's to say: a post keeps
/// within.
void require_known_text(const Dialect& d, const Dialect& base, PostReader& reader) {
    reader.table("text");
    for (const auto& [known, wanted, mark] :
         {std::tuple{base.parentheses, d.parentheses, "( … )"}, std::tuple{base.semicolon, d.semicolon, ";"}})
        if (wanted && !known)
            reader.fail(reader.find("comments"), "post.range",
                        fmt::format("{} takes no {} for a comment", base.name, mark),
                        "base the post on a control that does, or write none");
    for (const auto& [key, most, wanted] :
         {std::tuple{"longest_comment", base.longest_comment, d.longest_comment},
          std::tuple{"longest_line", base.longest_line, d.longest_line}})
        if (wanted > most)
            reader.fail(reader.find(key), "post.range",
                        fmt::format("text.{} is {}, more than {} takes", key, wanted, base.name),
                        fmt::format("give {} at most", most));
    for (const char c : d.forbidden)
        if (c < ' ' || c > '~')
            reader.fail(reader.find("forbidden"), "post.range",
                        "text.forbidden holds what no line may hold anyway",
                        "give printing ASCII characters");
}

/// What a post makes of its base, in one unit. @param stated gets its lines
Dialect own_dialect(const toml::table& root, const std::string& file, Post base, LengthUnit units,
                    std::vector<StatedLine>& stated) {
    const Dialect built_in = dialect_of(base, units);
    Dialect d = built_in;
    d.own = true;
    PostReader reader(root, file);
    visit_post_keys(d, reader);
    ExtraLines extra;
    visit_extra_keys(extra, reader);
    require_known_text(d, built_in, reader);
    d.forbidden += built_in.forbidden;
    d.head += extra.start;
    d.change = extra.before_change + d.change + extra.after_change;
    d.end = extra.end + d.end;
    stated = std::move(reader.stated);
    return d;
}

/// Prints keys as lines of TOML under their comments.
struct PostPrinter {
    std::string text;
    void table(const char* name) { text += fmt::format("\n[{}]\n", name); }
    void line(const char* name, const std::string& value, const char* comment) {
        text += fmt::format("{:<32}  # {}\n", fmt::format("{} = {}", name, value), comment);
    }
    static std::string quoted(std::string_view value) {
        std::string out = "\"";
        for (const char c : value) {
            if (c == '"' || c == '\\') out += '\\';
            out += c;
        }
        return out + '"';
    }
    void key(const char* name, bool value, const char* comment) {
        line(name, value ? "true" : "false", comment);
    }
    template <class Number>
    void key(const char* name, Number value, int, int, const char* comment) {
        line(name, std::to_string(value), comment);
    }
    void key(const char* name, const std::string& value, const char* comment) {
        line(name, quoted(value), comment);
    }
    void key(const char* name, const std::vector<int>& value, const char* comment) {
        line(name, fmt::format("[{}]", fmt::join(value, ", ")), comment);
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum value, const Word<Enum> (&words)[N], const char* comment) {
        line(name, quoted(word_of(words, value)), comment);
    }
    void lines(const char* name, const std::string& value, PostPart, const char* comment) {
        text += fmt::format("# {}\n{} = [", comment, name);
        for (std::size_t at = 0; at < value.size();) {
            const std::size_t end = std::min(value.find('\n', at), value.size());
            text += (at == 0 ? "\n    " : "    ") + quoted(value.substr(at, end - at)) + ",\n";
            at = end + 1;
        }
        text += "]\n";
    }
};

}  // namespace

std::shared_ptr<const OwnDialect> parse_own_post(std::string_view text, const std::string& file) {
    require_shallow_keys(text, file, "post.syntax");
    toml::table root;
    try {
        root = toml::parse(text, file);
    } catch (const toml::parse_error& error) {
        throw Error(ErrorKind::usage, "post.syntax",
                    quoting_line(fmt::format("not TOML: {}", error.description())),
                    fmt::format("{}:{}", file, error.source().begin.line),
                    "`slabwright job --post-file fanuc` prints a post that is right");
    }
    const PostReader reader(root, file);
    reader.refuse_unknown();
    auto post = std::make_shared<OwnDialect>();
    post->base = base_of(reader, root);
    post->name = name_of(reader, root);
    post->ending = ending_of(reader, root);
    post->text = text;
    std::vector<StatedLine> stated;
    for (const LengthUnit units : {LengthUnit::inch, LengthUnit::mm}) {
        Dialect& dialect = units == LengthUnit::inch ? post->inch : post->mm;
        dialect = own_dialect(root, file, post->base, units, stated);
        dialect.name = post->name;
    }
    for (const StatedLine& line : stated) check_post_line(line.text, line.part, post->mm, line.place);
    probe_post(post, file);
    return post;
}

std::shared_ptr<const OwnDialect> read_own_post(const std::filesystem::path& path) {
    const std::string text =
        read_whole(path, {ErrorKind::usage, "post.", kMostPostBytes, "check the path of the post"});
    return parse_own_post(text, path.string());
}

std::string post_toml(Post base) {
    const Dialect mm = dialect_of(base), inch = dialect_of(base, LengthUnit::inch);
    if (mm.conversational)
        throw Error(ErrorKind::usage, "post.base",
                    "heidenhain is conversational: its blocks are no lines of letters and numbers", "",
                    "name another control");
    PostPrinter printer;
    printer.text = fmt::format(
        "# A post of your own for Slabwright. What is left out is as in its base.\nbase = \"{}\"\nname = "
        "\"our "
        "{}\"\n",
        word_of(kPostWords, base), mm.name);
    const std::string file = program_file(base, "a");
    printer.text += fmt::format("ending = \"{}\"\n", file.substr(file.rfind('.')));
    visit_post_keys(mm, printer);
    const ExtraLines extra;
    visit_extra_keys(extra, printer);
    PostPrinter inches;
    visit_decimals(inch, inches);
    const std::size_t at = printer.text.find("point = ");
    printer.text.insert(at, inches.text);
    return std::move(printer.text);
}

}  // namespace slabwright
