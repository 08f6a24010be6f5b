#include "io/posts/conversational_reader.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>
#include <vector>

#include "io/posts/program_builder.h"

namespace slabwright {

namespace {

using Words = std::vector<std::string_view>;

class Reader {
public:
    Reader(std::string_view text, const std::string& file, const Dialect& dialect, const GcodeLimits& limits,
           bool several)
        : text_(text),
          dialect_(dialect),
          several_(several),
          place_{file, 0},
          built_(text, dialect, limits, place_) {
        built_.program.file = file;
    }

    std::vector<Program> run() {
        for (std::size_t at = 0; at < text_.size();) {
            const std::size_t end = std::min(text_.find('\n', at), text_.size());
            ++place_.line;
            built_.read_to(end);
            std::string_view line = text_.substr(at, end - at);
            check_characters(line, place_, dialect_);
            block(line);
            at = end + 1;
        }
        if (!closed_) fail("gcode.no_end", "the program does not end with END PGM", "its end may be missing");
        if (changing_) fail("gcode.tool", "a tool call that no operation follows");
        return built_.take(tool_);
    }

private:
    [[noreturn]] void fail(const char* code, const std::string& message,
                           const char* remedy = "plan again") const {
        place_.fail(code, message, remedy);
    }
    [[noreturn]] void unknown(std::string_view word) const {
        fail("gcode.unknown_word", fmt::format("'{}' is no word that this reader knows", word.substr(0, 40)));
    }

    void block(std::string_view line) {
        line = line.substr(0, line.find(';'));
        words_.clear();
        for (std::size_t at = 0; at < line.size();) {
            if (line[at] == ' ' || line[at] == '\t') {
                ++at;
                continue;
            }
            const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
            words_.push_back(line.substr(at, end - at));
            at = end;
        }
        if (words_.empty()) fail("gcode.block", "a line without a block's number");
        std::uint32_t number = 0;
        const std::string_view digits = words_[0];
        const auto [stop, status] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
        if (status != std::errc{} || stop != digits.data() + digits.size() || number + 1 != place_.line)
            fail("gcode.block", fmt::format("a block that is not numbered {}", place_.line - 1),
                 "a line may be missing; plan again");
        words_.erase(words_.begin());
        if (words_.empty()) return;  // a comment
        execute();
    }

    void execute() {
        const std::string_view first = words_[0];
        if (closed_) fail("gcode.after_end", "a block after the program's end (END PGM)");
        if (!begun_ && first != "BEGIN") fail("gcode.begin", "the program does not begin with BEGIN PGM");
        if (half_cycle_ != 0 && first != "CYCL") fail("gcode.block", "a cycle (CYCL DEF) without its values");
        if (first == "BEGIN" || first == "END") return ends(first == "BEGIN");
        if (ended_) fail("gcode.after_end", "a block after M30: the control never reads it");
        if (first == "TOOL") return tool_call();
        if (first == "CYCL") return cycle();
        if (first == "CC") return pole();
        if (first == "C") return arc();
        if (first == "L") return straight();
        if (first.front() == 'M' && words_.size() == 1) return m_word(first);
        unknown(first);
    }

    void ends(bool begin) {
        const char* unit = dialect_.inch() ? "INCH" : "MM";
        if (begin == begun_) fail("gcode.begin", begin ? "a second BEGIN PGM" : "END PGM before BEGIN PGM");
        if (words_.size() != 4 || words_[1] != "PGM" || (words_[3] != "MM" && words_[3] != "INCH"))
            fail("gcode.begin", "BEGIN PGM and END PGM need the program's name and its unit");
        if (words_[3] != unit)
            fail("gcode.units", fmt::format("a program in {} where the plan's are in {}", words_[3], unit));
        if (begin) name_ = words_[2];
        else if (words_[2] != name_) fail("gcode.no_end", "END PGM of another program");
        else if (!ended_) fail("gcode.no_end", "END PGM without M2 or M30", "its end may be missing");
        begun_ = true;
        closed_ = !begin;
    }

    [[nodiscard]] double number(std::string_view digits, std::string_view word) const {
        if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
        double value = 0;
        const auto [stop, status] =
            std::from_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed);
        if (status != std::errc{} || digits.empty() || stop != digits.data() + digits.size())
            fail("gcode.number", fmt::format("no number in '{}'", word.substr(0, 40)));
        return value;
    }

    void tool_call() {
        if (tool_ != 0 && !several_) fail("gcode.tool", "a second tool call in one program");
        if (words_.size() != 5 || words_[1] != "CALL" || words_[3] != "Z" || words_[4].front() != 'S')
            fail("gcode.tool", "TOOL CALL needs a number, the axis Z and a speed S");
        const double tool = number(words_[2], words_[2]);
        if (!(tool >= 1 && tool <= 99999) || tool != std::floor(tool))
            fail("gcode.tool", "a tool call that names no tool");
        if (tool_ != 0 && turning_ && static_cast<int>(tool) != tool_)
            fail("gcode.tool", "a tool call while the spindle turns");
        changing_ = tool_ != 0;
        tool_ = static_cast<int>(tool);
        speed_ = number(words_[4].substr(1), words_[4]);
        if (speed_ < 0) fail("gcode.number", "a negative spindle speed");
        turning_ = false;
        built_.turn(0);
    }

    /// Two blocks each: the cycle's name, then its value.
    void cycle() {
        if (dwell()) return;
        if (words_.size() != 4 || words_[1] != "DEF") unknown(words_[0]);
        const std::string_view part = words_[2], value = words_[3];
        if (half_cycle_ == 0 && part == "32.0" && value == "TOLERANCE") {
            half_cycle_ = 32;
        } else if (half_cycle_ == 32 && part == "32.1" && value.front() == 'T') {
            half_cycle_ = 0;
            const double tolerance = number(value.substr(1), value) * dialect_.unit_mm();
            if (!(tolerance > 0)) fail("gcode.path_mode", "a tolerance (CYCL DEF 32) of zero or less");
            built_.blend(tolerance, 0);
            tolerance_ = true;
        } else {
            unknown(part);
        }
    }

    /// CYCL DEF 9.0 DWELL TIME, CYCL DEF 9.1 DWELL 3: five words each.
    bool dwell() {
        if (words_.size() != 5 || words_[1] != "DEF" || words_[3] != "DWELL") return false;
        if (half_cycle_ == 0 && words_[2] == "9.0" && words_[4] == "TIME") {
            half_cycle_ = 9;
            return true;
        }
        if (half_cycle_ != 9 || words_[2] != "9.1") return false;
        half_cycle_ = 0;
        const double seconds = number(words_[4], words_[4]);
        if (!(seconds >= 0 && seconds <= 3600)) fail("gcode.dwell", "a dwell of less than 0 or over 3600 s");
        built_.dwell(seconds);
        return true;
    }

    void m_word(std::string_view word) {
        if (word == "M3") {
            if (tool_ == 0) fail("gcode.tool", "the spindle (M3) before a tool is called");
            if (several_) built_.begin_operation(tool_);
            changing_ = false;
            if (!turning_) built_.spin_up();
            turning_ = true;
            built_.turn(speed_);
        } else if (word == "M5") {
            turning_ = false;
            built_.turn(0);
        } else if (word == "M2" || word == "M30") {
            ended_ = true;
        } else if (word == "M4") {
            fail("gcode.spindle", "a spindle turning backwards (M4)", "the cutters are right-hand ones");
        } else if (word == "M7" || word == "M8") {
            fail("gcode.coolant", fmt::format("coolant ({}) on wood", word));
        } else if (word == "M0" || word == "M1" || word == "M6") {
            fail("gcode.pause", fmt::format("a stop in the program ({}) with the cutter where it is", word),
                 "programs run through; pause the machine by hand");
        } else {
            unknown(word);
        }
    }

    /// The words of L, C and CC.
    struct Motion {
        std::optional<double> axes[3];
        std::optional<double> feed;  ///< mm/min
        bool rapid = false;
        int turn = 0;  ///< 1: DR+
    };

    [[nodiscard]] Motion motion() {
        Motion m;
        for (std::size_t i = 1; i < words_.size(); ++i) {
            const std::string_view word = words_[i];
            const char letter = word.front();
            const auto once = [&](bool given) {
                if (given) fail("gcode.twice", fmt::format("{} stands twice in one block", letter));
            };
            if (letter >= 'X' && letter <= 'Z') {
                std::optional<double>& axis = m.axes[letter - 'X'];
                once(axis.has_value());
                axis = number(word.substr(1), word) * dialect_.unit_mm();
            } else if (word == "R0") {
                uncompensated_ = true;
            } else if (word == "FMAX") {
                once(m.rapid || m.feed);
                m.rapid = true;
            } else if (letter == 'F') {
                once(m.rapid || m.feed);
                m.feed = feed_of(number(word.substr(1), word));
            } else if (word == "DR+" || word == "DR-") {
                once(m.turn != 0);
                m.turn = word == "DR+" ? 1 : -1;
            } else {
                unknown(word);
            }
        }
        if (m.feed) feed_ = *m.feed;
        return m;
    }

    /// A feed in inches has three decimals: it is the whole millimetre a minute that is written so.
    [[nodiscard]] double feed_of(double value) const {
        if (!(value > 0)) fail("gcode.number", "a feed of zero or less");
        const double feed = value * dialect_.feed_unit, whole = std::round(feed);
        return dialect_.inch() && std::abs(feed - whole) <= 0.5e-3 * dialect_.feed_unit + 1e-9 ? whole : feed;
    }

    [[nodiscard]] std::array<double, 3> target(const Motion& m) const {
        std::array<double, 3> to = built_.at();
        for (std::size_t k = 0; k < 3; ++k)
            if (m.axes[k]) to[k] = *m.axes[k];
        return to;
    }

    void require_for_motion(bool rapid) const {
        if (tool_ == 0) fail("gcode.tool", "a motion before a tool is called (TOOL CALL)");
        if (changing_) fail("gcode.spindle", "a motion after a tool call before the spindle starts (M3)");
        if (!tolerance_)
            fail("gcode.unset", "a motion before how far the control may leave its path (CYCL DEF 32)",
                 "the machine would take what the program before left in force");
        if (!uncompensated_)
            fail("gcode.unset", "a motion before cutter compensation is off (R0)",
                 "the machine would take what the program before left in force");
        if (!rapid && !(feed_ > 0)) fail("gcode.feed", "a feed motion before any feed (F)");
    }

    void straight() {
        const Motion m = motion();
        if (m.turn != 0) fail("gcode.unused_word", "DR without an arc");
        require_for_motion(m.rapid);
        if (!m.axes[0] && !m.axes[1] && !m.axes[2]) fail("gcode.motion", "L without a coordinate");
        if (m.rapid) built_.rapid(target(m));
        else built_.line(target(m), feed_);
    }

    void pole() {
        const Motion m = motion();
        if (!m.axes[0] || !m.axes[1] || words_.size() != 3)
            fail("gcode.arc", "CC needs the X and the Y of a centre");
        pole_ = {*m.axes[0], *m.axes[1]};
    }

    void arc() {
        const Motion m = motion();
        require_for_motion(false);
        if (m.rapid) fail("gcode.arc", "an arc as a rapid (FMAX)");
        if (!pole_) fail("gcode.arc", "an arc without a centre (CC)");
        if (m.turn == 0) fail("gcode.arc", "an arc without its turn (DR+ or DR-)");
        if (!m.axes[0] || !m.axes[1] || m.axes[2])
            fail("gcode.arc", "an arc needs the X and the Y of its end, and no Z");
        built_.arc(target(m), {(*pole_)[0], (*pole_)[1], m.turn < 0, {0, 1, 2}}, feed_);
    }

    std::string_view text_;
    const Dialect& dialect_;
    bool several_;
    GcodePlace place_;
    ProgramBuilder built_;
    Words words_;  // of the block, without its number
    std::string_view name_;
    bool begun_ = false, ended_ = false, closed_ = false;
    bool uncompensated_ = false, tolerance_ = false, turning_ = false, changing_ = false;
    int tool_ = 0, half_cycle_ = 0;
    double speed_ = 0, feed_ = 0;
    std::optional<std::array<double, 2>> pole_;
};

}  // namespace

std::vector<Program> read_conversational(std::string_view text, const std::string& file,
                                         const Dialect& dialect, const GcodeLimits& limits, bool several) {
    return Reader(text, file, dialect, limits, several).run();
}

}  // namespace slabwright
