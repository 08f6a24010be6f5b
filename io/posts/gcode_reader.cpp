#include "io/posts/gcode_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/posts/conversational_reader.h"
#include "io/posts/gcode_line.h"
#include "io/posts/modal_state.h"
#include "io/posts/program_builder.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

using Motion = ModalState::Motion;

class Reader {
public:
    Reader(std::string_view text, const std::string& file, const Dialect& dialect, const GcodeLimits& limits,
           bool several)
        : text_(text),
          dialect_(dialect),
          limits_(limits),
          several_(several),
          place_{file, 0},
          built_(text, dialect, limits, place_),
          state_(dialect, several) {
        built_.program.file = file;
    }

    std::vector<Program> run() {
        built_.program.steps.reserve(static_cast<std::size_t>(std::count(text_.begin(), text_.end(), '\n')));
        GcodeLine line;
        std::size_t at = 0;
        while (at < text_.size()) {
            std::size_t end = text_.find('\n', at);
            if (end == std::string_view::npos) end = text_.size();
            ++place_.line;
            built_.read_to(end);
            const std::string_view text = text_.substr(at, end - at);
            read_gcode_line(text, place_, dialect_, line);
            if (text.find_first_not_of(" \t\r") != std::string_view::npos) frame(line);
            if (!line.empty()) execute(line);
            at = end + 1;
        }
        if (!ended_)
            fail("gcode.no_end", "the program does not end with M2 or M30", "its end may be missing");
        if (changing_) fail("gcode.tool", "a change of tool (M6) that no operation follows");
        if (dialect_.percent == Dialect::Percent::must && !closed_)
            fail("gcode.no_end", "the program does not end with a % mark", "its end may be missing");
        return built_.take(state_.tool());
    }

private:
    [[noreturn]] void fail(const char* code, const std::string& message,
                           const char* remedy = "plan again") const {
        place_.fail(code, message, remedy);
    }

    /// % marks, and the program's number between the first and everything else. @param line not blank
    void frame(const GcodeLine& line) {
        if (line.percent && begun_ && !ended_)
            fail("gcode.percent", "a % mark within the program: the machine stops there");
        if (!line.percent && !begun_ && dialect_.percent == Dialect::Percent::must)
            fail("gcode.percent",
                 fmt::format("no % mark before the program: {} finds no begin", dialect_.name));
        closed_ = closed_ || (line.percent && ended_);
        begun_ = true;
        if (!dialect_.numbered || line.empty()) return;
        if (line.has('O') == (built_.program.number != 0))
            fail("gcode.program_number",
                 line.has('O') ? "a second program number (O)" : "words before the program's number (O)");
        if (!line.has('O')) return;
        const double number = line['O'];
        if (!(number >= 1 && number <= 9999) || number != std::floor(number) || line.has_beside('O'))
            fail("gcode.program_number", "O needs a number of 1 to 9999, on a line of its own");
        built_.program.number = static_cast<int>(number);
    }

    void execute(const GcodeLine& line) {
        if (ended_)
            fail("gcode.after_end", "words after the program's end (M2): the machine never reads them");
        state_.apply(line, place_);
        // A motion between a change of tool and the start of the spindle would be neither operation's.
        if (several_ && line.m.has(60)) changing_ = true;
        if (several_ && line.m.has(30)) {
            built_.begin_operation(state_.tool());
            changing_ = false;
        }
        if (state_.spins_up()) built_.spin_up();
        if (const auto seconds = state_.dwell()) built_.dwell(*seconds);
        built_.turn(state_.turning() ? state_.speed() : 0);
        if (const auto& mode = state_.named_path_mode()) built_.blend(mode->rounds, mode->leaves_out);
        // X in a line with G4 is a time, where it may stand there at all.
        const bool axes = !line.g.has(40) && (line.has('X') || line.has('Y') || line.has('Z'));
        const bool arc_words = line.has('I') || line.has('J') || line.has('K') || line.has('R');
        if (axes || state_.motion_named()) move(line, axes);
        else if (arc_words) fail("gcode.unused_word", "an arc's word (I, J, K or R) without an arc");
        if (line.m.has(20) || line.m.has(300)) {
            state_.require_at_end(place_);
            ended_ = true;
        }
    }

    void move(const GcodeLine& line, bool axes) {
        const Motion motion = state_.motion();
        if (changing_ && (axes || motion == Motion::clockwise || motion == Motion::counter_clockwise))
            fail("gcode.spindle", "a motion after a change of tool (M6) before the spindle starts (M3)");
        if (motion == Motion::none) fail("gcode.motion", "coordinates without a motion (G0 to G3)");
        state_.require_for_motion(place_);
        const bool is_arc = motion == Motion::clockwise || motion == Motion::counter_clockwise;
        if (!is_arc && (line.has('I') || line.has('J') || line.has('K') || line.has('R')))
            fail("gcode.unused_word", "an arc's word (I, J, K or R) without an arc");
        if (!is_arc && !axes) return;  // G0 or G1 alone goes nowhere
        const std::array<double, 3>& at = built_.at();
        std::array<double, 3> to = at;
        const char letters[3] = {'X', 'Y', 'Z'};
        for (int k = 0; k < 3; ++k) {
            if (!line.has(letters[k])) continue;
            const double value = line[letters[k]] * state_.unit();
            if (state_.incremental() && !std::isfinite(at[k]))
                fail("gcode.unknown_place", "an incremental motion from an unknown place");
            to[k] = state_.incremental() ? at[k] + value : value;
        }
        if (motion == Motion::rapid) built_.rapid(to);
        else if (motion == Motion::line) built_.line(to, state_.feed());
        else arc(line, to);
    }

    void arc(const GcodeLine& line, const std::array<double, 3>& to) {
        built_.check_place(to);
        const std::array<double, 3>& at = built_.at();
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(to[k]) || !std::isfinite(at[k]))
                fail("gcode.unknown_place", "a feed motion from or to an unknown place");
        const auto [a, b, c] = state_.plane();
        ReadArc read;
        read.plane = state_.plane();
        read.clockwise = state_.motion() == Motion::clockwise;
        const char letters[3] = {'I', 'J', 'K'};
        if (line.has(letters[c]))
            fail("gcode.unused_word", std::string("the word ") + letters[c] + " in an arc of another plane");
        if (line.has('R')) {
            if (line.has(letters[a]) || line.has(letters[b]))
                fail("gcode.arc", "an arc with both a radius and a centre");
            centre_by_radius(line['R'] * state_.unit(), to, read);
        } else {
            if (!line.has(letters[a]) && !line.has(letters[b])) fail("gcode.arc", "an arc without a centre");
            if (!state_.absolute_centres())
                fail("gcode.unset", "an arc before where its centre counts from (G91.1)",
                     "the machine would take what the program before left in force");
            const bool absolute = *state_.absolute_centres();
            const double u = line[letters[a]] * state_.unit(), v = line[letters[b]] * state_.unit();
            read.ca = absolute ? u : at[a] + u;
            read.cb = absolute ? v : at[b] + v;
        }
        built_.arc(to, read, state_.feed());
    }

    void centre_by_radius(double r, const std::array<double, 3>& to, ReadArc& arc) const {
        const std::array<double, 3>& at = built_.at();
        const auto [a, b, c] = arc.plane;
        const double da = to[a] - at[a], db = to[b] - at[b], chord = std::hypot(da, db);
        if (chord <= 0 || chord > 2 * std::abs(r) + limits_.arc_radius_error)
            fail("gcode.arc", "an arc whose radius does not reach its end");
        const double h = std::sqrt(std::max(0.0, r * r - chord * chord / 4));
        // The centre lies left of the chord for a short counter-clockwise arc.
        const double turn = (arc.clockwise == (r > 0)) ? -1 : 1;
        arc.ca = at[a] + da / 2 - turn * h * db / chord;
        arc.cb = at[b] + db / 2 + turn * h * da / chord;
    }

    std::string_view text_;
    const Dialect& dialect_;
    GcodeLimits limits_;
    bool several_;
    GcodePlace place_;
    ProgramBuilder built_;
    ModalState state_;
    bool begun_ = false, ended_ = false, closed_ = false, changing_ = false;
};

}  // namespace

Program read_gcode(std::string_view text, const std::string& file, const GcodeLimits& limits) {
    return read_program_text(text, file, dialect_of(Post::linuxcnc), limits);
}

Program read_program_text(std::string_view text, const std::string& file, const Dialect& dialect,
                          const GcodeLimits& limits) {
    if (dialect.conversational)
        return std::move(read_conversational(text, file, dialect, limits, false).front());
    return std::move(Reader(text, file, dialect, limits, false).run().front());
}

std::vector<Program> read_operations(std::string_view text, const std::string& file, const Dialect& dialect,
                                     const GcodeLimits& limits) {
    if (dialect.conversational) return read_conversational(text, file, dialect, limits, true);
    return Reader(text, file, dialect, limits, true).run();
}

std::string other_dialect(std::string_view text, const Dialect& expected) {
    for (const LengthUnit units : {expected.units, expected.inch() ? LengthUnit::mm : LengthUnit::inch})
        for (const Post post : {Post::linuxcnc, Post::fanuc, Post::haas, Post::grbl, Post::mach, Post::iso,
                                Post::siemens, Post::heidenhain}) {
            if (post == expected.post) continue;  // whose refusal tells of a wrong unit itself
            try {
                (void)read_operations(text, "", dialect_of(post, units));
                return in_words(post, units);
            } catch (const Error&) {
                continue;  // none of its programs
            }
        }
    return "";
}

}  // namespace slabwright
