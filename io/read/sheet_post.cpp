#include "io/read/sheet_post.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <utility>

#include "io/read/input_file.h"
#include "io/read/toml_text.h"
#include "io/text/json_text.h"
#include "io/text/nearest_word.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::size_t kMostLines = 64;
constexpr std::size_t kLongestWord = 40;

/// Reads the table of one head.
class CodesReader {
public:
    CodesReader(const toml::table& table, std::string head, const std::string& file)
        : table_(table), head_(std::move(head)), file_(file) {}

    SheetCodes read() const {
        const bool is_router = head_ == "router";
        std::vector<std::string> known{"clearance", "begin", "end"};
        if (!is_router) known.insert(known.end(), {"on", "off", "pierce_s"});
        for (auto&& [key, node] : table_) {
            const std::string name(key.str());
            if (std::find(known.begin(), known.end(), name) == known.end())
                fail(&node, "post.unknown_key",
                     fmt::format("unknown key {}.{}", head_, name.substr(0, kLongestWord)),
                     fmt::format("did you mean {}.{}?", head_, nearest_word(name, known)));
        }
        SheetCodes codes;
        codes.on = text("on");
        codes.off = text("off");
        codes.pierce_s = number("pierce_s", 0, 60);
        codes.clearance = number("clearance", 0.1, 1000);
        codes.begin = lines("begin");
        codes.end = lines("end");
        return codes;
    }

private:
    [[noreturn]] void fail(const toml::node* node, const char* code, const std::string& message,
                           const std::string& remedy) const {
        throw Error(ErrorKind::usage, code, quoting_line(message),
                    fmt::format("{}:{}", file_, node->source().begin.line), remedy);
    }
    [[noreturn]] void wrong_type(const toml::node* node, const char* name, const char* what) const {
        fail(node, "post.type", fmt::format("{}.{} must be {}", head_, name, what),
             fmt::format("write {} there", what));
    }
    [[nodiscard]] std::optional<std::string> text(const char* name) const {
        const toml::node* node = table_.get(name);
        if (node == nullptr) return std::nullopt;
        auto value = node->value_exact<std::string>();
        if (!value) wrong_type(node, name, "a text in quotes, such as \"M62 P0\"");
        return value;
    }
    [[nodiscard]] std::optional<double> number(const char* name, double low, double high) const {
        const toml::node* node = table_.get(name);
        if (node == nullptr) return std::nullopt;
        const auto value = node->value<double>();
        if (!value || node->is_boolean()) wrong_type(node, name, "a number");
        if (!(*value >= low) || !(*value <= high))
            fail(node, "post.range", fmt::format("{}.{} is {:g}", head_, name, *value),
                 fmt::format("give {:g} to {:g}", low, high));
        return value;
    }
    [[nodiscard]] std::optional<std::vector<std::string>> lines(const char* name) const {
        const toml::node* node = table_.get(name);
        if (node == nullptr) return std::nullopt;
        const toml::array* all = node->as_array();
        if (all == nullptr) wrong_type(node, name, "a list of texts");
        if (all->size() > kMostLines)
            fail(node, "post.range", fmt::format("{}.{} has {} lines", head_, name, all->size()),
                 fmt::format("give {} at most", kMostLines));
        std::vector<std::string> lines;
        for (const toml::node& element : *all) {
            const auto line = element.value_exact<std::string>();
            if (!line) wrong_type(&element, name, "a list of texts, each in quotes");
            lines.push_back(*line);
        }
        return lines;
    }

    const toml::table& table_;
    std::string head_;
    const std::string& file_;
};

}  // namespace

const SheetCodes& SheetPost::of(SheetHead head) const {
    return head == SheetHead::router ? router : head == SheetHead::laser ? laser : jet;
}

SheetPost parse_sheet_post(std::string_view text, const std::string& file) {
    require_shallow_keys(text, file, "post.syntax");
    toml::table root;
    try {
        root = toml::parse(text, file);
    } catch (const toml::parse_error& error) {
        throw Error(ErrorKind::usage, "post.syntax",
                    quoting_line(fmt::format("not TOML: {}", error.description())),
                    fmt::format("{}:{}", file, error.source().begin.line),
                    "io/FORMATS.md, A post for sheets, shows one that is right");
    }
    SheetPost post;
    const std::vector<std::pair<std::string, SheetCodes*>> heads{
        {"router", &post.router}, {"laser", &post.laser}, {"jet", &post.jet}};
    for (auto&& [key, node] : root) {
        const std::string name(key.str());
        const auto head =
            std::find_if(heads.begin(), heads.end(), [&](const auto& known) { return known.first == name; });
        const std::string place = fmt::format("{}:{}", file, node.source().begin.line);
        if (head == heads.end())
            throw Error(ErrorKind::usage, "post.unknown_key",
                        quoting_line(fmt::format("unknown key {}", name.substr(0, kLongestWord))), place,
                        "a post for sheets has the tables [router], [laser] and [jet]");
        if (!node.is_table())
            throw Error(ErrorKind::usage, "post.type", fmt::format("{} is no table", name), place,
                        fmt::format("write [{}] on a line of its own", name));
        *head->second = CodesReader(*node.as_table(), name, file).read();
    }
    return post;
}

SheetPost read_sheet_post(const std::filesystem::path& path) {
    const std::string text =
        read_whole(path, {ErrorKind::usage, "post.", kMostPostBytes, "check the path of the post"});
    return parse_sheet_post(text, path.string());
}

void apply(const SheetPost& post, SheetJob& job) {
    const SheetCodes& codes = post.of(job.head);
    if (codes.on) job.on = *codes.on;
    if (codes.off) job.off = *codes.off;
    if (codes.pierce_s) job.pierce_s = *codes.pierce_s;
    if (codes.clearance) job.clearance = *codes.clearance;
    if (codes.begin) job.begin = *codes.begin;
    if (codes.end) job.end = *codes.end;
}

}  // namespace slabwright
