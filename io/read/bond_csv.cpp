#include "io/read/bond_csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "io/read/input_file.h"

namespace slabwright {

namespace {

constexpr std::uint64_t kMostBondBytes = 16 * kMebibyte;

std::string trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
    return first == std::string_view::npos ? std::string()
                                           : std::string(text.substr(first, last - first + 1));
}

std::optional<double> number_in(const std::string& text) {
    double value = 0;
    const char* first = text.data();
    const char* last = first + text.size();
    if (first != last && *first == '+') ++first;
    const auto [end, error] = std::from_chars(first, last, value);
    if (error != std::errc() || end != last || !std::isfinite(value)) return std::nullopt;
    return value;
}

struct Line {
    std::size_t number = 0;  ///< in the file, from 1
    std::vector<std::string> cells;
};

class BondTable {
public:
    BondTable(std::string path, std::string_view text) : path_(std::move(path)) { split(text); }

    [[nodiscard]] const std::vector<Line>& lines() const { return lines_; }

    [[noreturn]] void refuse(const char* code, std::size_t line, const std::string& message,
                             const std::string& remedy) const {
        throw Error(ErrorKind::input, code, message, path_ + " line " + std::to_string(line), remedy);
    }

private:
    void split(std::string_view text) {
        if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
        std::size_t at = 0, line = 1;
        while (at < text.size()) {
            Line read{line, {}};
            std::string cell;
            bool was_quoted = false, ended = false;
            while (!ended) {
                if (at < text.size() && text[at] == '"' && trimmed(cell).empty() && !was_quoted) {
                    cell = quoted(text, at, line);
                    was_quoted = true;
                    continue;
                }
                const char c = at < text.size() ? text[at++] : '\n';
                if (c == ',' || c == '\n') {
                    read.cells.push_back(was_quoted ? cell : trimmed(cell));
                    cell.clear();
                    was_quoted = false;
                    ended = c == '\n';
                } else if (c == '\0') {
                    refuse("bond.text", line, "a byte of zero: this is no text", "export the table as CSV");
                } else if (c != '\r') {
                    if (was_quoted && c != ' ' && c != '\t')
                        refuse("bond.quotes", line, "text behind a closing quotation mark",
                               "double quotation marks inside quoted cells");
                    if (!was_quoted) cell += c;
                }
            }
            ++line;
            const bool blank = read.cells.size() == 1 && read.cells[0].empty();
            if (!blank && !read.cells[0].starts_with('#')) lines_.push_back(std::move(read));
        }
    }

    /// What stands between quotation marks from text[at] on; `at` is moved behind them.
    std::string quoted(std::string_view text, std::size_t& at, std::size_t line) const {
        std::string cell;
        for (++at; at < text.size(); ++at) {
            if (text[at] == '\n') break;
            if (text[at] != '"') {
                cell += text[at];
            } else if (at + 1 < text.size() && text[at + 1] == '"') {
                cell += '"';
                ++at;
            } else {
                ++at;
                return cell;
            }
        }
        refuse("bond.quotes", line, "a quotation mark that is not closed in its line",
               "close it, or leave it out");
    }

    std::string path_;
    std::vector<Line> lines_;
};

/// The rank of a word in a scale that everybody knows, or nothing.
std::optional<double> known_rank(std::string word) {
    for (char& c : word)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    struct Known {
        const char* word;
        double rank;
    };
    for (const Known& known :
         {Known{"low", -1}, Known{"medium", 0}, Known{"high", 1}, Known{"thin", -1}, Known{"thick", 1},
          Known{"small", -1}, Known{"large", 1}, Known{"no", -1}, Known{"yes", 1}})
        if (word == known.word) return known.rank;
    return std::nullopt;
}

/// The factor of one column, and the level of each of its rows.
BondFactor factor_of(const std::string& name, const std::vector<std::string>& cells,
                     std::vector<int>& levels) {
    struct Seen {
        std::string word;
        double rank;
    };
    std::vector<Seen> seen;
    const auto all = [&](const auto& rank) {
        return std::all_of(cells.begin(), cells.end(), [&](const std::string& cell) { return rank(cell); });
    };
    BondFactor factor;
    factor.name = name;
    factor.is_number = all(number_in);
    const bool is_scale = !factor.is_number && all(known_rank);
    for (const std::string& cell : cells) {
        const double rank = factor.is_number ? *number_in(cell)
                            : is_scale       ? *known_rank(cell)
                                             : static_cast<double>(seen.size());
        if (std::none_of(seen.begin(), seen.end(), [&](const Seen& s) {
                return factor.is_number || is_scale ? s.rank == rank : s.word == cell;
            }))
            seen.push_back({cell, rank});
    }
    std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) { return a.rank < b.rank; });
    for (const std::string& cell : cells)
        for (std::size_t i = 0; i < seen.size(); ++i)
            if (factor.is_number ? *number_in(cell) == seen[i].rank
                : is_scale       ? *known_rank(cell) == seen[i].rank
                                 : cell == seen[i].word)
                levels.push_back(static_cast<int>(i));
    const double low = seen.front().rank, high = seen.back().rank;
    const bool has_order = factor.is_number || is_scale || seen.size() == 2;
    for (const Seen& s : seen) {
        factor.levels.push_back(s.word);
        if (has_order && high > low) factor.coded.push_back(2 * (s.rank - low) / (high - low) - 1);
    }
    return factor;
}

}  // namespace

BondTests read_bond_csv(const std::string& path, const BondCsvOptions& options) {
    const BondTable table(path, read_whole(path, {ErrorKind::input, "bond.", kMostBondBytes}));
    const std::vector<Line>& lines = table.lines();
    if (lines.size() < 2)
        throw Error(ErrorKind::input, "bond.rows", "no header line with tests below it", path,
                    "write the names of the columns on its first line, a test on each line below");
    if (lines.size() - 1 > kMostBondRows)
        throw Error(ErrorKind::input, "bond.rows", "more than " + std::to_string(kMostBondRows) + " tests",
                    path, "study fewer at once");
    const std::vector<std::string>& names = lines[0].cells;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i].empty())
            table.refuse("bond.header", lines[0].number, "column " + std::to_string(i + 1) + " has no name",
                         "name it");
        if (std::find(names.begin(), names.begin() + static_cast<long>(i), names[i]) !=
            names.begin() + static_cast<long>(i))
            table.refuse("bond.header", lines[0].number, "two columns are called " + names[i],
                         "give each a name of its own");
    }
    const auto column = [&](const std::string& name) {
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) {
            std::string all;
            for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
            throw Error(ErrorKind::usage, "bond.column", "there is no column " + name, path,
                        "its columns are " + all);
        }
        return static_cast<std::size_t>(found - names.begin());
    };
    const std::size_t response = options.response.empty() ? names.size() - 1 : column(options.response);
    std::vector<bool> ignored(names.size(), false);
    for (const std::string& name : options.ignored) ignored[column(name)] = true;
    if (ignored[response])
        throw Error(ErrorKind::usage, "bond.column", "the column that was measured is ignored", path,
                    "name another with --response");

    BondTests tests;
    tests.strength_name = names[response];
    for (std::size_t r = 1; r < lines.size(); ++r) {
        const Line& line = lines[r];
        if (line.cells.size() != names.size())
            table.refuse("bond.cells", line.number,
                         std::to_string(line.cells.size()) + " cells where the header has " +
                             std::to_string(names.size()),
                         "see whether numbers are written with a decimal comma");
        const std::optional<double> value = number_in(line.cells[response]);
        if (!value)
            table.refuse("bond.number", line.number,
                         names[response] + " is \"" + line.cells[response] + "\", which is no number",
                         "write 5302 or 53.02");
        if (std::abs(*value) > 1e15)
            table.refuse("bond.number", line.number, names[response] + " is past 1e15", "use a larger unit");
        tests.strength.push_back(*value);
        for (std::size_t c = 0; c < names.size(); ++c)
            if (c != response && !ignored[c] && line.cells[c].empty())
                table.refuse("bond.cells", line.number, names[c] + " is empty",
                             "every test needs a level of every factor");
    }
    tests.levels.resize(tests.strength.size());
    for (std::size_t c = 0; c < names.size(); ++c) {
        if (c == response || ignored[c]) continue;
        std::vector<std::string> cells;
        for (std::size_t r = 1; r < lines.size(); ++r) cells.push_back(lines[r].cells[c]);
        std::vector<int> levels;
        tests.factors.push_back(factor_of(names[c], cells, levels));
        for (std::size_t r = 0; r < levels.size(); ++r) tests.levels[r].push_back(levels[r]);
    }
    return tests;
}

}  // namespace slabwright
