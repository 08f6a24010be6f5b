#include "io/read/job_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <variant>

#include "engine/tools/libraries.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

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

}  // namespace

Tool tool_of(const toml::table& values, KeyReader& reader) {
    Tool tool;
    visit_tool_keys(tool, reader);
    if (values.get("plunges") == nullptr) tool.plunges = plunges_by_default(tool.kind);
    return tool;
}

std::vector<Tool> library_tools(const toml::node* shared, std::vector<const toml::table*> listed,
                                KeyReader& reader, const std::string& file, const ToolSource& source) {
    return LibraryTools(shared, std::move(listed), reader, file).of(source);
}

}  // namespace slabwright
