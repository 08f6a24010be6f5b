#include "io/posts/tool_table_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>

#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kDiameter = 1e-3;        // mm by which diameters may differ
constexpr std::size_t kLongestRow = 250;  // characters; LinuxCNC reads rows of 256

class TableChecker {
public:
    TableChecker(std::string_view text, const std::string& file, const std::vector<Tool>& tools,
                 const std::vector<int>& magazine)
        : text_(text),
          path_(file),
          file_(std::filesystem::path(file).filename().string()),
          tools_(tools),
          magazine_(magazine) {}

    std::vector<Violation> run() {
        for (std::size_t at = 0; at < text_.size();) {
            const std::size_t end = std::min(text_.find('\n', at), text_.size());
            ++line_;
            row(text_.substr(at, end - at));
            at = end + 1;
        }
        line_ = 0;
        for (const Tool& tool : tools_)
            if (!seen_.contains(tool.number))
                complain(fmt::format("tool {} of the plan is not in the table", tool.number), 0);
        return std::move(found_);
    }

private:
    void complain(const std::string& message, double size) {
        found_.push_back({"tool.table", message, file_, line_, {}, size});
    }
    [[noreturn]] void refuse(const std::string& message) const {
        throw Error(ErrorKind::verification, "verify.tool_table", message,
                    path_ + ":" + std::to_string(line_), "plan again");
    }

    /// One tool's row, its comment cut off.
    void row(std::string_view row) {
        if (row.size() > kLongestRow) complain(fmt::format("a row of {} characters", row.size()), 0);
        row = row.substr(0, row.find(';'));
        values_.assign(26, 0);
        given_.assign(26, false);
        bool any = false;
        for (std::size_t i = 0; i < row.size();) {
            if (row[i] == ' ' || row[i] == '\t' || row[i] == '\r') {
                ++i;
                continue;
            }
            std::size_t stop = i + 1;
            while (stop < row.size() && row[stop] != ' ' && row[stop] != '\t' && row[stop] != '\r') ++stop;
            word(row[i], row.substr(i + 1, stop - i - 1));
            any = true;
            i = stop;
        }
        if (any) tool();
    }

    void word(char letter, std::string_view digits) {
        if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
        if (std::string_view("TPDXYZABCUVWIJQ").find(letter) == std::string_view::npos) {
            const auto byte = static_cast<unsigned char>(letter);
            if (byte > ' ' && byte < 0x7F)
                complain(fmt::format("the word {} names nothing in a tool table", letter), 0);
            else complain(fmt::format("the byte 0x{:02X}", byte), 0);
            return;
        }
        if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
        double value = 0;
        const auto [rest, status] =
            std::from_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed);
        if (status != std::errc{} || rest != digits.data() + digits.size())
            refuse(fmt::format("no number follows {}", letter));
        const auto at = static_cast<std::size_t>(letter - 'A');
        if (given_[at]) complain(fmt::format("the word {} stands twice in a row", letter), 0);
        given_[at] = true;
        values_[at] = value;
    }

    [[nodiscard]] double value(char letter) const { return values_[static_cast<std::size_t>(letter - 'A')]; }
    [[nodiscard]] bool given(char letter) const { return given_[static_cast<std::size_t>(letter - 'A')]; }

    void pocket(int tool, double pocket) {
        if (const int first = pockets_.emplace(pocket, tool).first->second;
            !magazine_.empty() && first != tool)
            complain(fmt::format("tools {} and {} are said to be in one pocket, {}", first, tool, pocket), 0);
        const auto place = std::find(magazine_.begin(), magazine_.end(), tool);
        const auto places = static_cast<double>(magazine_.size());
        const bool right = magazine_.empty() ? pocket == tool
                           : place == magazine_.end()
                               ? pocket > places
                               : pocket == static_cast<double>(place - magazine_.begin()) + 1;
        if (!right)
            complain(fmt::format("tool {} is said to be in pocket {}; a changer would fetch another", tool,
                                 pocket),
                     0);
    }

    void tool() {
        if (!given('T')) return complain("a row that names no tool", 0);
        const double t = value('T');
        const auto tool =
            std::find_if(tools_.begin(), tools_.end(), [&](const Tool& k) { return k.number == t; });
        if (tool == tools_.end()) return complain(fmt::format("tool {} is not in the plan", t), 0);
        if (!seen_.insert(tool->number).second) complain(fmt::format("a second row for tool {}", t), 0);
        if (!given('P')) complain(fmt::format("tool {} has no pocket (P)", t), 0);
        else pocket(tool->number, value('P'));
        if (const double wrong = std::abs(value('D') - tool->diameter); !(wrong <= kDiameter))
            complain(fmt::format("tool {} has the diameter {} where the plan says {}", t, value('D'),
                                 tool->diameter),
                     wrong);
        if (value('Z') != 0)
            complain(fmt::format("tool {} has a length; the machine keeps what it measured", t),
                     std::abs(value('Z')));
        for (const char letter : std::string_view("XYABCUVW"))
            if (value(letter) != 0)
                complain(fmt::format("tool {} has the offset {}{}, which shifts its paths", t, letter,
                                     value(letter)),
                         std::abs(value(letter)));
        for (const char letter : std::string_view("IJQ"))
            if (value(letter) != 0)
                complain(fmt::format("tool {} is a lathe's, with {}{}", t, letter, value(letter)), 0);
    }

    std::string_view text_;
    const std::string& path_;
    std::string file_;
    const std::vector<Tool>& tools_;
    std::vector<Violation> found_;
    const std::vector<int>& magazine_;
    std::set<int> seen_;
    std::map<double, int> pockets_;
    std::uint32_t line_ = 0;
    std::vector<double> values_;
    std::vector<bool> given_;
};

}  // namespace

std::vector<Violation> check_tool_table(std::string_view text, const std::string& file,
                                        const std::vector<Tool>& tools, const std::vector<int>& magazine) {
    return TableChecker(text, file, tools, magazine).run();
}

}  // namespace slabwright
