#include "io/posts/gcode_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include "kernels/errors.h"

namespace slabwright {

void GcodePlace::fail(const char* code, const std::string& message, const char* remedy) const {
    throw Error(ErrorKind::verification, code, message, file + ":" + std::to_string(line), remedy);
}

bool GcodeNumbers::has(int number) const { return std::find(begin(), end(), number) != end(); }

std::string gcode_number(int tenths) {
    std::string s = std::to_string(tenths / 10);
    if (tenths % 10 != 0) s += "." + std::to_string(tenths % 10);
    return s;
}

namespace {

bool is_blank(char c) { return c == ' ' || c == '\t'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }
bool is_letter(char c) { return upper(c) >= 'A' && upper(c) <= 'Z'; }

/// Reads one line from left to right.
class LineReader {
public:
    LineReader(std::string_view text, const GcodePlace& place, const Dialect& dialect, GcodeLine& line)
        : text_(text), place_(place), dialect_(dialect), line_(line) {}

    void run() {
        line_.clear();
        check_characters(text_, place_, dialect_);
        while (at_ < text_.size()) {
            const char c = text_[at_];
            if (is_blank(c)) {
                ++at_;
            } else if (c == ';' && dialect_.semicolon) {
                check_comment(text_.substr(at_ + 1), place_);
                break;
            } else if (c == '%' && dialect_.percent != Dialect::Percent::none) {
                if (text_.find_first_not_of(" \t%") != std::string_view::npos)
                    place_.fail("gcode.percent", "text beside a % mark");
                line_.percent = true;
                break;
            } else if (c == '(' && dialect_.parentheses) {
                comment();
            } else if (dialect_.named_words && text_.substr(at_).starts_with("ADIS")) {
                named_word();
            } else {
                word();
            }
        }
    }

private:
    void comment() {
        const std::size_t close = text_.find(')', at_);
        if (close == std::string_view::npos) place_.fail("gcode.comment", "a comment that is not closed");
        const std::string_view inside = text_.substr(at_ + 1, close - at_ - 1);
        if (inside.find('(') != std::string_view::npos)
            place_.fail("gcode.comment", "a comment within a comment");
        check_comment(inside, place_);
        at_ = close + 1;
    }

    void word() {
        const char letter = upper(text_[at_]);
        if (letter < 'A' || letter > 'Z')
            place_.fail("gcode.unknown_word",
                        fmt::format("'{}' begins no word that this reader knows", text_[at_]));
        bool pointed = false;
        const double value = number(letter, pointed);
        if (letter == 'G' || letter == 'M') {
            code(letter == 'G' ? line_.g : line_.m, letter, value);
        } else if (letter == 'N') {
            if (!line_.empty() || numbered_) place_.fail("gcode.unknown_word", "N after another word");
            if (value < 0) place_.fail("gcode.number", "a negative line number");
            numbered_ = true;
        } else {
            if (dialect_.letters.find(letter) == std::string_view::npos)
                place_.fail("gcode.unknown_word",
                            fmt::format("a word {}, which this reader does not know", letter));
            if (dialect_.needs_point && !pointed &&
                std::string_view("EFIJKRXYZ").find(letter) != std::string_view::npos)
                place_.fail("gcode.decimal_point",
                            fmt::format("the word {} without its decimal point: {} counts in its least steps",
                                        letter, dialect_.name));
            set(letter, value, pointed);
        }
    }

    void set(char letter, double value, bool pointed) {
        if (line_.has(letter))
            place_.fail("gcode.twice", fmt::format("the word {} stands twice in one line", letter));
        line_.set(letter, value, pointed);
    }

    /// ADIS=0.02, ADISPOS=0.02
    void named_word() {
        const std::size_t equals = text_.find('=', at_);
        const std::string_view name = text_.substr(at_, equals == std::string_view::npos ? 0 : equals - at_);
        if (name != "ADIS" && name != "ADISPOS")
            place_.fail("gcode.unknown_word", "a name that this reader does not know");
        at_ = equals;
        bool pointed = false;
        const double value = number('=', pointed);
        set(name == "ADIS" ? kAdis : kAdisPos, value, pointed);
    }

    /// The number after a letter, up to the next character that can belong to none.
    double number(char letter, bool& pointed) {
        ++at_;
        while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
        const std::size_t start = at_;
        if (at_ < text_.size() && (text_[at_] == '+' || text_[at_] == '-')) ++at_;
        while (at_ < text_.size() && (is_digit(text_[at_]) || text_[at_] == '.')) ++at_;
        std::string_view digits = text_.substr(start, at_ - start);
        if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
        double value = 0;
        const auto [stop, status] =
            std::from_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed);
        if (status != std::errc{} || stop != digits.data() + digits.size() || digits.empty())
            place_.fail("gcode.number", fmt::format("no number follows {}", letter),
                        "exponents, parameters and expressions are not emitted, so not read");
        pointed = digits.find('.') != std::string_view::npos;
        return value;
    }

    void code(GcodeNumbers& codes, char letter, double value) const {
        const double tenths = value * 10;
        if (std::abs(tenths - std::round(tenths)) > 1e-6 || value < 0 || value > 1000)
            place_.fail("gcode.unknown_word", fmt::format("{} with a number that names nothing", letter));
        if (codes.count == codes.tenths.size())
            place_.fail("gcode.twice",
                        fmt::format("more {} words in one line than there are groups", letter));
        codes.tenths[codes.count++] = static_cast<int>(std::llround(tenths));
    }

    std::string_view text_;
    const GcodePlace& place_;
    const Dialect& dialect_;
    std::size_t at_ = 0;
    bool numbered_ = false;
    GcodeLine& line_;
};

}  // namespace

void check_comment(std::string_view inside, const GcodePlace& place) {
    std::size_t i = 0;
    while (i < inside.size() && is_blank(inside[i])) ++i;
    const std::size_t word = i;
    while (i < inside.size() && (is_letter(inside[i]) || inside[i] == '_')) ++i;
    const std::string_view name = inside.substr(word, i - word);
    while (i < inside.size() && is_blank(inside[i])) ++i;
    const bool sets_off = i < inside.size() && inside[i] == ',';
    std::string known(name);
    std::transform(known.begin(), known.end(), known.begin(), upper);
    if (!name.empty() && (sets_off || known == "PROBEOPEN" || known == "PROBECLOSE" || known == "LOGOPEN" ||
                          known == "LOGCLOSE" || known == "LOGAPPEND"))
        place.fail("gcode.comment",
                   fmt::format("a comment that the control may act on ({})", std::string(name)),
                   "take the comma or the comment out");
}

/// A NUL hides the rest of a line from LinuxCNC; letters beyond ASCII look like others.
void check_characters(std::string_view& line, const GcodePlace& place, const Dialect& dialect) {
    if (line.size() > dialect.longest_line)
        place.fail("gcode.line_length", fmt::format("a line of {} characters; {} takes {}", line.size(),
                                                    dialect.name, dialect.longest_line));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    for (const char c : line) {
        if ((c < ' ' && c != '\t') || c > '~')
            place.fail("gcode.character",
                       fmt::format("the byte 0x{:02X}, which is no printing ASCII character",
                                   static_cast<unsigned char>(c)));
        if (dialect.forbidden.find(c) != std::string_view::npos)
            place.fail("gcode.character",
                       fmt::format("the character {}, which {} acts on wherever it stands", c, dialect.name));
    }
}

void read_gcode_line(std::string_view line, const GcodePlace& place, const Dialect& dialect,
                     GcodeLine& words) {
    LineReader(line, place, dialect, words).run();
}

}  // namespace slabwright
