#include "io/read/job_toml.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "engine/tools/libraries.h"
#include "io/read/toml_text.h"
#include "io/text/job_keys.h"
#include "io/text/json_text.h"
#include "io/text/nearest_word.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::size_t kShownLetters = 60;  ///< of what is wrong, that an error repeats

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

/// Fills a job from one parsed document, walking the table of keys; remembers the line of each key it meets.
class KeyReader {
public:
    KeyReader(const toml::table& root, const std::string& file) : file_(file), table_(&root) {}

    /// Goes on with a table of its own: one of the [[tool]] entries.
    void enter(const toml::table* values, std::string prefix) {
        table_ = values;
        prefix_ = std::move(prefix);
    }
    void enter_root_table(const toml::table& root, const char* name) {
        prefix_ = std::string(name) + ".";
        table_ = nullptr;
        const toml::node* node = root.get(name);
        if (node == nullptr) return;
        table_ = node->as_table();
        if (table_ == nullptr)
            fail(*node, "job.type", fmt::format("{} is {}, not a table", name, type_name(*node)),
                 fmt::format("write [{}] on a line of its own", name));
    }

    void required() { required_ = true; }
    void set_missing_remedy(const char* remedy) { missing_remedy_ = remedy; }

    void key(const char* name, double& value, const char*) {
        if (const toml::node* node = find(name)) value = number(*node, prefix_ + name);
    }
    void key(const char* name, int& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto integer = node->value_exact<std::int64_t>();
        if (!integer || *integer < -2147483647 || *integer > 2147483647)
            wrong_type(*node, prefix_ + name, "a whole number");
        value = static_cast<int>(*integer);
    }
    void key(const char* name, bool& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto truth = node->value_exact<bool>();
        if (!truth) wrong_type(*node, prefix_ + name, "true or false");
        value = *truth;
    }
    void key(const char* name, std::string& value, const char*) {
        if (const toml::node* node = find(name)) value = text(*node, prefix_ + name);
    }
    void key(const char* name, std::vector<double>& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const toml::array* array = node->as_array();
        if (array == nullptr) wrong_type(*node, prefix_ + name, "a list of numbers");
        value.clear();
        for (const toml::node& element : *array) value.push_back(number(element, prefix_ + name));
    }
    void key(const char* name, std::vector<std::array<double, 2>>& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        constexpr const char* kPoints = "a list of points [x, y]";
        if (node->as_array() == nullptr) wrong_type(*node, prefix_ + name, kPoints);
        value.clear();
        for (const toml::node& element : *node->as_array()) {
            const toml::array* const point = element.as_array();
            if (point == nullptr || point->size() != 2) wrong_type(*node, prefix_ + name, kPoints);
            value.push_back({number((*point)[0], prefix_ + name), number((*point)[1], prefix_ + name)});
        }
    }
    void degrees(const char* name, double& radians, const char*) {
        if (const toml::node* node = find(name))
            radians = number(*node, prefix_ + name) * std::numbers::pi / 180;
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum& value, const Word<Enum> (&words)[N], const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const std::string given = text(*node, prefix_ + name).substr(0, kShownLetters);
        std::vector<std::string> known;
        for (const Word<Enum>& w : words) {
            if (given == w.text) {
                value = w.value;
                return;
            }
            known.emplace_back(w.text);
        }
        fail(*node, "job.word",
             fmt::format("{}{} is \"{}\", none of {}", prefix_, name, given, fmt::join(known, ", ")),
             fmt::format("did you mean \"{}\"?", nearest_word(given, known)));
    }

    /// The control that programs are for; a file is kept for whoever can read it.
    template <std::size_t N>
    void word(const char* name, Post& value, const Word<Post> (&words)[N], const char* comment) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        post_ = text(*node, prefix_ + name);
        if (!is_post_file(post_)) word<Post, N>(name, value, words, comment);
    }
    /// What machine.post says; "" where it says nothing.
    [[nodiscard]] const std::string& post() const { return post_; }
    static bool is_post_file(const std::string& post) {
        return post.find_first_of("./\\") != std::string::npos;
    }

    [[nodiscard]] const std::map<std::string, std::string>& places() const { return places_; }
    void learn_places(const KeyReader& other) { places_.insert(other.places_.begin(), other.places_.end()); }
    [[nodiscard]] std::string place_of(const toml::node& node) const {
        return node.source().begin.line > 0 ? fmt::format("{}:{}", file_, node.source().begin.line) : file_;
    }
    [[noreturn]] void fail(const toml::node& node, const char* code, const std::string& message,
                           const std::string& remedy) const {
        throw Error(ErrorKind::usage, code, quoting_line(message), place_of(node), remedy);
    }
    static const char* type_name(const toml::node& node) {
        switch (node.type()) {
            case toml::node_type::string:
                return "a text";
            case toml::node_type::integer:
                return "a whole number";
            case toml::node_type::floating_point:
                return "a number";
            case toml::node_type::boolean:
                return "true or false";
            case toml::node_type::array:
                return "a list";
            case toml::node_type::table:
                return "a table";
            default:
                return "a date or time";
        }
    }

protected:
    const toml::node* find(const char* name) {
        const bool required = std::exchange(required_, false);
        const toml::node* node = table_ != nullptr ? table_->get(name) : nullptr;
        if (node != nullptr) places_[prefix_ + name] = place_of(*node);
        else if (required)
            fail(*table_, "job.missing_key", fmt::format("{}{} is missing", prefix_, name), missing_remedy_);
        return node;
    }
    double number(const toml::node& node, const std::string& key) const {
        if (const auto real = node.value_exact<double>()) {
            if (!std::isfinite(*real)) wrong_type(node, key, "a finite number");
            return *real;
        }
        if (const auto integer = node.value_exact<std::int64_t>()) return static_cast<double>(*integer);
        wrong_type(node, key, "a number");
    }
    std::string text(const toml::node& node, const std::string& key) const {
        const auto value = node.value_exact<std::string>();
        if (!value) wrong_type(node, key, "a text in quotes");
        return *value;
    }
    [[noreturn]] void wrong_type(const toml::node& node, const std::string& key, const char* wanted) const {
        fail(node, "job.type", fmt::format("{} is {}, not {}", key, type_name(node), wanted),
             fmt::format("give {}", wanted));
    }

private:
    std::string file_, prefix_;
    const toml::table* table_;
    bool required_ = false;
    std::string post_;
    const char* missing_remedy_ = "every [[tool]] needs it; see `slabwright job --defaults`";
    std::map<std::string, std::string> places_;
};

/// The walk over a tool whose every key has a value already.
class OverridingReader : public KeyReader {
public:
    using KeyReader::KeyReader;
    void required() {}
};

/// The same walk over the whole job: table() moves to the next [table].
class JobReader : public KeyReader {
public:
    JobReader(const toml::table& root, const std::string& file) : KeyReader(root, file), root_(root) {}
    void table(const char* name, const char*) { enter_root_table(root_, name); }

private:
    const toml::table& root_;
};

KeyNames all_keys() {
    const Job job;
    KeyNames names;
    visit_job_keys(job, names);
    names.names.emplace_back("machine.keep_out");
    names.prefix = "machine.keep_out.";
    const KeepOut none;
    visit_keep_out_keys(none, names);
    names.names.emplace_back("material.cutting");
    names.prefix = "material.cutting.";
    const CuttingData line;
    visit_cutting_data_keys(line, names);
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

/// The tables of a list, [[name]]; none where there is no such key.
/// @param node the list. @param name its full name
std::vector<const toml::table*> listed_tables(const toml::node* node, const std::string& name,
                                              const KeyReader& reader, const KeyNames& known) {
    std::vector<const toml::table*> listed;
    if (node == nullptr) return listed;
    const toml::array* const tables = node->as_array();
    if (tables == nullptr || (!tables->empty() && !tables->is_array_of_tables()))
        reader.fail(*node, "job.type",
                    fmt::format("{} is {}, not a list of tables", name, KeyReader::type_name(*node)),
                    fmt::format("write [[{}]] in double brackets", name));
    for (const toml::node& entry : *tables) listed.push_back(entry.as_table());
    for (const toml::table* const values : listed) refuse_unknown(*values, name + ".", known, reader);
    return listed;
}

/// What a list of tables within a table holds, [[machine.keep_out]], in place of what the job had.
/// @param walk(entry, reader) takes the keys of one
template <class Entry, class Walk>
void read_entries(const toml::node* list, const std::string& name, const char* missing_remedy,
                  const KeyNames& known, KeyReader& reader, std::vector<Entry>& entries, Walk&& walk) {
    if (list == nullptr) return;
    entries.clear();
    KeyReader own = reader;
    own.set_missing_remedy(missing_remedy);
    for (const toml::table* const values : listed_tables(list, name, reader, known)) {
        own.enter(values, fmt::format("{}[{}].", name, entries.size() + 1));
        walk(entries.emplace_back(), own);
    }
    reader.learn_places(own);
}

void read_keep_outs(const toml::table& root, const KeyNames& known, KeyReader& reader, Machine& machine) {
    read_entries(root["machine"]["keep_out"].node(), "machine.keep_out",
                 "every [[machine.keep_out]] needs it: a name, a shape and a height", known, reader,
                 machine.keep_outs, [](KeepOut& entry, KeyReader& own) { visit_keep_out_keys(entry, own); });
}

void read_cutting_data(const toml::table& root, const KeyNames& known, KeyReader& reader,
                       Material& material) {
    read_entries(root["material"]["cutting"].node(), "material.cutting",
                 "every [[material.cutting]] needs it: a chip load and its source", known, reader,
                 material.cutting,
                 [](CuttingData& entry, KeyReader& own) { visit_cutting_data_keys(entry, own); });
}

/// Speed and feed that are left out are infinite until with_cutting_data().
Tool tool_of(const toml::table& values, KeyReader& reader) {
    Tool tool;
    tool.max_rpm = tool.max_feed = std::numeric_limits<double>::infinity();
    visit_tool_keys(tool, reader);
    if (values.get("plunges") == nullptr) tool.plunges = plunges_by_default(tool.kind);
    return tool;
}

// Whether two values of a key are the same, whole numbers and others alike.
bool are_same(const toml::node& a, const toml::node& b) {
    const auto x = a.value<double>(), y = b.value<double>();
    if (x && y) return *x == *y;
    const auto p = a.value_exact<std::string>(), q = b.value_exact<std::string>();
    if (p && q) return *p == *q;
    const auto s = a.value_exact<bool>(), t = b.value_exact<bool>();
    return s && t && *s == *t;
}

// The tools of a library, each completed by the [[tool]] of its number, then by [tools]; then the [[tool]]
// that it does not have. A library is a file, or one that the house knows by name.
class LibraryTools {
public:
    LibraryTools(const toml::node* shared, std::vector<const toml::table*> listed, KeyReader& reader,
                 const std::string& file)
        : listed_(std::move(listed)), is_used_(listed_.size(), false), reader_(reader), file_(file) {
        if (shared == nullptr) return;
        shared_ = shared->as_table();
        if (shared_ == nullptr)
            reader.fail(*shared, "job.type",
                        fmt::format("tools is {}, not a table", KeyReader::type_name(*shared)),
                        "write [tools] on a line of its own");
    }

    std::vector<Tool> of(const ToolSource& source) {
        const std::string library = source.library.empty() ? named() : source.library;
        const std::vector<std::int64_t> wanted = numbers();
        // A file is known by its ending, so a word without one is a name.
        const bool is_file = library.find_first_of("./\\") != std::string::npos;
        std::vector<Tool> tools =
            is_file ? read(source, library, wanted) : known(library, wanted, !source.library.empty());
        for (const std::int64_t number : wanted)
            if (std::none_of(tools.begin(), tools.end(), [&](const Tool& t) { return t.number == number; }))
                throw Error(ErrorKind::usage, "tools.number", fmt::format("it has no tool {}", number),
                            library, "correct [tools] numbers");
        for (std::size_t i = 0; i < listed_.size(); ++i) {
            if (is_used_[i]) continue;
            reader_.enter(listed_[i], fmt::format("tool[{}].", tools.size() + 1));
            tools.push_back(tool_of(*listed_[i], reader_));
        }
        return tools;
    }

private:
    std::vector<Tool> read(const ToolSource& source, const std::string& library,
                           const std::vector<std::int64_t>& wanted) {
        if (!source.read)
            throw Error(ErrorKind::usage, "tools.no_files", "a job that is no file has no tool library",
                        file_, fmt::format("list the tools as [[tool]], or name {}", kLibraryNames));
        std::vector<Tool> tools;
        for (const LibraryTool& stated : source.read(library, wanted))
            tools.push_back(completed(stated, tools.size() + 1));
        return tools;
    }

    // A library of the house states every key; a [[tool]] of a tool's number says otherwise for that one.
    std::vector<Tool> known(const std::string& library, const std::vector<std::int64_t>& wanted,
                            bool by_option) {
        const std::optional<std::vector<Tool>> found = named_library(library);
        if (!found) {
            const toml::node* const node = by_option ? nullptr : shared_->get("library");
            const std::string shown = library.substr(0, kShownLetters);
            throw Error(
                ErrorKind::usage, "tools.library",
                quoting_line(fmt::format("there is no tool library \"{}\"", shown)),
                node != nullptr ? reader_.place_of(*node) : "",
                fmt::format("name {}, or a file that ends in .tbl, .fctl, .fctb or .csv", kLibraryNames));
        }
        if (shared_ != nullptr)
            for (auto&& [key, node] : *shared_)
                if (key.str() != "library" && key.str() != "numbers")
                    reader_.fail(node, "tools.conflict",
                                 fmt::format("the library {} states {} of every tool", library,
                                             std::string(key.str()).substr(0, kShownLetters)),
                                 "change it in a [[tool]] of the tool's number");
        std::vector<Tool> tools;
        for (Tool tool : *found) {
            if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), tool.number) == wanted.end())
                continue;
            for (std::size_t i = 0; i < listed_.size(); ++i)
                if (const toml::node* const number = listed_[i]->get("number");
                    number != nullptr && number->value_exact<std::int64_t>() == tool.number) {
                    is_used_[i] = true;
                    change(tool, *listed_[i], tools.size() + 1);
                }
            tools.push_back(std::move(tool));
        }
        return tools;
    }

    void change(Tool& tool, const toml::table& values, std::size_t position) {
        OverridingReader own(values, file_);
        own.enter(&values, fmt::format("tool[{}].", position));
        visit_tool_keys(tool, own);
        if (values.contains("kind") && !values.contains("plunges"))
            tool.plunges = plunges_by_default(tool.kind);
        reader_.learn_places(own);
    }

    std::string named() const {
        const toml::node* const node = shared_ != nullptr ? shared_->get("library") : nullptr;
        if (node == nullptr)
            throw Error(ErrorKind::usage, "job.missing_key", "tools.library is missing",
                        shared_ != nullptr ? reader_.place_of(*shared_) : file_,
                        fmt::format("name {}, a file, or list the tools as [[tool]]", kLibraryNames));
        const auto name = node->value_exact<std::string>();
        if (!name)
            reader_.fail(
                *node, "job.type",
                fmt::format("tools.library is {}, not a text in quotes", KeyReader::type_name(*node)),
                "give the file's name in quotes");
        return *name;
    }

    std::vector<std::int64_t> numbers() const {
        std::vector<std::int64_t> wanted;
        const toml::node* const node = shared_ != nullptr ? shared_->get("numbers") : nullptr;
        if (node == nullptr) return wanted;
        const toml::array* const list = node->as_array();
        if (list != nullptr)
            for (const toml::node& element : *list)
                if (const auto number = element.value_exact<std::int64_t>()) wanted.push_back(*number);
        if (list == nullptr || wanted.empty() || wanted.size() != list->size())
            reader_.fail(*node, "job.type", "tools.numbers is not a list of whole numbers",
                         "write [1, 2, 5]; leave it out for all tools");
        return wanted;
    }

    Tool completed(const LibraryTool& stated, std::size_t position) {
        toml::table values;
        for (const StatedValue& value : stated.values)
            std::visit([&](const auto& v) { values.insert_or_assign(value.first, v); }, value.second);
        const auto number_of = [](const toml::table& table) {
            const toml::node* const node = table.get("number");
            return node != nullptr ? node->value_exact<std::int64_t>() : std::nullopt;
        };
        if (!values.contains("number") && shared_ != nullptr && shared_->contains("number"))
            values.insert_or_assign("number", *shared_->get("number"));
        for (std::size_t i = 0; i < listed_.size(); ++i) {
            if (!number_of(values) || number_of(*listed_[i]) != number_of(values)) continue;
            is_used_[i] = true;
            for (auto&& [key, node] : *listed_[i]) {
                const toml::node* const there = values.get(key.str());
                if (there != nullptr && !are_same(*there, node))
                    reader_.fail(node, "tools.conflict",
                                 fmt::format("{} is not what {} states of this tool",
                                             std::string(key.str()).substr(0, kShownLetters), stated.place),
                                 "say it in one of both places only");
                if (there == nullptr) values.insert_or_assign(key.str(), node);
            }
        }
        if (shared_ != nullptr)
            for (auto&& [key, node] : *shared_)
                if (key.str() != "library" && key.str() != "numbers" && !values.contains(key.str()))
                    values.insert_or_assign(key.str(), node);
        KeyReader own(values, stated.place);
        own.set_missing_remedy("state it in a [[tool]] of this number, or for all tools in [tools]");
        own.enter(&values, fmt::format("tool[{}].", position));
        Tool tool = tool_of(values, own);
        reader_.learn_places(own);
        return tool;
    }

    std::vector<const toml::table*> listed_;
    std::vector<bool> is_used_;
    KeyReader& reader_;
    const std::string& file_;
    const toml::table* shared_ = nullptr;
};

std::vector<Tool> library_tools(const toml::node* shared, std::vector<const toml::table*> listed,
                                KeyReader& reader, const std::string& file, const ToolSource& source) {
    return LibraryTools(shared, std::move(listed), reader, file).of(source);
}

/// Takes the post that a job names, or the one that is asked for in its place.
void take_post(Machine& machine, const std::string& named, const std::string& file,
               const PostSource& source) {
    const std::string& post = source.post.empty() ? named : source.post;
    if (post.empty()) return;
    machine.own_post = nullptr;
    if (KeyReader::is_post_file(post)) {
        if (!source.read)
            throw Error(ErrorKind::usage, "post.no_files", "a job that is no file has no post file", file,
                        "name a control: linuxcnc, fanuc, haas, grbl, mach, iso, siemens or heidenhain");
        const std::shared_ptr<const OwnDialect> own = source.read(post);
        machine.post = own->base;
        machine.own_post = own;
        return;
    }
    for (const Word<Post>& word : kPostWords) {
        if (post != word.text) continue;
        machine.post = word.value;
        return;
    }
    throw Error(
        ErrorKind::usage, "job.word",
        quoting_line(fmt::format("there is no post \"{}\"", post.substr(0, kShownLetters))), "--post",
        "name linuxcnc, fanuc, haas, grbl, mach, iso, siemens or heidenhain, or a file that ends in .toml");
}

}  // namespace

Job parse_job(std::string_view text, const std::string& file, const Job& base, const ToolSource& tools,
              const PostSource& posts) {
    require_shallow_keys(text, file, "job.syntax");
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
    take_post(job.machine, reader.post(), file, posts);
    read_keep_outs(root, known, reader, job.machine);
    read_cutting_data(root, known, reader, job.material);
    const std::vector<const toml::table*> listed = listed_tables(root.get("tool"), "tool", reader, known);
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
    state_feeds(job);
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

}  // namespace slabwright
