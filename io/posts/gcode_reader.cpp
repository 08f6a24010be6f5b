#include "io/posts/gcode_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "io/posts/gcode_line.h"
#include "io/posts/modal_state.h"

namespace slabwright {

namespace {

constexpr double kFarthest = 214000;  // mm: what paths in 0.1 µm can say

using Motion = ModalState::Motion;

class Reader {
public:
    Reader(std::string_view text, const std::string& file, const GcodeLimits& limits)
        : text_(text), limits_(limits), place_{file, 0} {
        program_.file = file;
    }

    Program run() {
        program_.steps.reserve(static_cast<std::size_t>(std::count(text_.begin(), text_.end(), '\n')));
        GcodeLine line;
        std::size_t at = 0;
        while (at < text_.size()) {
            std::size_t end = text_.find('\n', at);
            if (end == std::string_view::npos) end = text_.size();
            ++place_.line;
            read_ = end;
            const std::string_view text = text_.substr(at, end - at);
            read_gcode_line(text, place_, line);
            if (line.percent && begun_ && !ended_)
                fail("gcode.percent", "a % mark within the program: the machine stops there");
            begun_ = begun_ || text.find_first_not_of(" \t\r") != std::string_view::npos;
            if (!line.empty()) execute(line);
            at = end + 1;
        }
        if (!ended_)
            fail("gcode.no_end", "the program does not end with M2 or M30", "its end may be missing");
        program_.tool = state_.tool();
        return std::move(program_);
    }

private:
    [[noreturn]] void fail(const char* code, const std::string& message,
                           const char* remedy = "plan again") const {
        place_.fail(code, message, remedy);
    }

    void execute(const GcodeLine& line) {
        if (ended_)
            fail("gcode.after_end", "words after the program's end (M2): the machine never reads them");
        state_.apply(line, place_);
        if (state_.spins_up()) {
            spin_up_s_ = 0;
            spinning_up_ = true;
        }
        if (const auto seconds = state_.dwell()) {
            program_.dwell_s += *seconds;
            spin_up_s_ += *seconds;
            if (*seconds > program_.longest_dwell.value) program_.longest_dwell = {*seconds, place_.line};
        }
        if (state_.turning()) program_.spindle_rpm = std::max(program_.spindle_rpm, state_.speed());
        if (const auto& mode = state_.named_path_mode()) blend(mode->rounds, mode->leaves_out);
        const bool axes = line.has('X') || line.has('Y') || line.has('Z');
        const bool arc_words = line.has('I') || line.has('J') || line.has('K') || line.has('R');
        if (axes || state_.motion_named()) move(line, axes);
        else if (arc_words) fail("gcode.unused_word", "an arc's word (I, J, K or R) without an arc");
        if (line.m.has(20) || line.m.has(300)) {
            state_.require_at_end(place_);
            ended_ = true;
        }
    }

    // Of several in one program the widest counts where the cutter may get, the narrowest for its time.
    void blend(double rounds, double leaves_out) {
        if (!blended_ || rounds + leaves_out > program_.strays) program_.strays_line = place_.line;
        program_.strays = blended_ ? std::max(program_.strays, rounds + leaves_out) : rounds + leaves_out;
        program_.blend = blended_ ? std::min(program_.blend, rounds) : rounds;
        blended_ = true;
    }

    void move(const GcodeLine& line, bool axes) {
        const Motion motion = state_.motion();
        if (motion == Motion::none) fail("gcode.motion", "coordinates without a motion (G0 to G3)");
        state_.require_for_motion(place_);
        const bool is_arc = motion == Motion::clockwise || motion == Motion::counter_clockwise;
        if (!is_arc && (line.has('I') || line.has('J') || line.has('K') || line.has('R')))
            fail("gcode.unused_word", "an arc's word (I, J, K or R) without an arc");
        if (!is_arc && !axes) return;  // G0 or G1 alone goes nowhere
        std::array<double, 3> to = at_;
        const char letters[3] = {'X', 'Y', 'Z'};
        for (int k = 0; k < 3; ++k) {
            if (!line.has(letters[k])) continue;
            const double value = line[letters[k]] * state_.unit();
            if (state_.incremental() && !std::isfinite(at_[k]))
                fail("gcode.unknown_place", "an incremental motion from an unknown place");
            to[k] = state_.incremental() ? at_[k] + value : value;
            if (std::abs(to[k]) > kFarthest) fail("gcode.number", "a coordinate beyond 214 m");
        }
        if (motion == Motion::rapid) {
            if (program_.slowest_spindle.line != 0) note_spindle();
            step(to, 0);
            return;
        }
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(to[k]) || !std::isfinite(at_[k]))
                fail("gcode.unknown_place", "a feed motion from or to an unknown place");
        note_spindle();
        end_spin_up();
        if (motion == Motion::line) step(to, state_.feed());
        else arc(line, to);
    }

    void note_spindle() {
        const ProgramWord speed{state_.turning() ? state_.speed() : 0, place_.line};
        ProgramWord &slow = program_.slowest_spindle, &fast = program_.fastest_spindle;
        if (slow.line == 0 || speed.value < slow.value) slow = speed;
        if (fast.line == 0 || speed.value > fast.value) fast = speed;
    }

    void end_spin_up() {
        ProgramWord& least = program_.shortest_spin_up;
        if (spinning_up_ && (least.line == 0 || spin_up_s_ < least.value)) least = {spin_up_s_, place_.line};
        spinning_up_ = false;
    }

    void arc(const GcodeLine& line, const std::array<double, 3>& to) {
        const auto [a, b, c] = state_.plane();
        const double da = to[a] - at_[a], db = to[b] - at_[b];
        const bool clockwise = state_.motion() == Motion::clockwise;
        double ca = 0, cb = 0;
        const char letters[3] = {'I', 'J', 'K'};
        if (line.has(letters[c]))
            fail("gcode.unused_word", std::string("the word ") + letters[c] + " in an arc of another plane");
        if (line.has('R')) {
            if (line.has(letters[a]) || line.has(letters[b]))
                fail("gcode.arc", "an arc with both a radius and a centre");
            const double r = line['R'] * state_.unit(), chord = std::hypot(da, db);
            if (chord <= 0 || chord > 2 * std::abs(r) + limits_.arc_radius_error)
                fail("gcode.arc", "an arc whose radius does not reach its end");
            const double h = std::sqrt(std::max(0.0, r * r - chord * chord / 4));
            const double turn =
                (clockwise == (r > 0))
                    ? -1
                    : 1;  // the centre lies left of the chord for a short counter-clockwise arc
            ca = at_[a] + da / 2 - turn * h * db / chord;
            cb = at_[b] + db / 2 + turn * h * da / chord;
        } else {
            if (!line.has(letters[a]) && !line.has(letters[b])) fail("gcode.arc", "an arc without a centre");
            if (!state_.absolute_centres())
                fail("gcode.unset", "an arc before where its centre counts from (G91.1)",
                     "the machine would take what the program before left in force");
            const bool absolute = *state_.absolute_centres();
            const double u = line[letters[a]] * state_.unit(), v = line[letters[b]] * state_.unit();
            ca = absolute ? u : at_[a] + u;
            cb = absolute ? v : at_[b] + v;
        }
        const double r0 = std::hypot(at_[a] - ca, at_[b] - cb), r1 = std::hypot(to[a] - ca, to[b] - cb);
        if (!(r0 > 0) || std::abs(r0 - r1) > limits_.arc_radius_error)
            fail("gcode.arc", "an arc whose start and end lie at different radii");
        const double start = std::atan2(at_[b] - cb, at_[a] - ca);
        double sweep = std::atan2(to[b] - cb, to[a] - ca) - start;
        constexpr double turn = 2 * std::numbers::pi;
        const bool full = da == 0 && db == 0;
        if (clockwise) {
            while (sweep >= 0) sweep -= turn;
            if (full) sweep = -turn;
        } else {
            while (sweep <= 0) sweep += turn;
            if (full) sweep = turn;
        }
        // A chord of angle φ misses the arc by r(1 − cos(φ/2)) = 2r·sin²(φ/4), which stays exact where the
        // cosine is near one.
        const double r = std::max(r0, r1);
        const auto chords_within = [&](double error) {
            const double widest =
                std::min(turn / 4, 4 * std::asin(std::sqrt(std::min(1.0, error / (2 * r)))));
            return std::max(1, static_cast<int>(std::min(1e7, std::ceil(std::abs(sweep) / widest))));
        };
        const auto error_of = [&](int chords) {
            return 2 * r * std::pow(std::sin(std::abs(sweep) / chords / 4), 2);
        };
        const bool level = c == 2 && at_[2] == to[2] && std::abs(r0 - r1) <= 2 * limits_.arc_error;
        const int close = chords_within(limits_.arc_error),
                  chords = level && limits_.level_arc_error > 0
                               ? std::min(close, chords_within(limits_.level_arc_error))
                               : close;
        const std::array<double, 3> from = at_;
        const std::size_t begin = program_.steps.size();
        for (int i = 1; i < chords; ++i) {
            const double t = static_cast<double>(i) / chords, angle = start + sweep * t,
                         radius = r0 + (r1 - r0) * t;
            std::array<double, 3> p{};
            p[a] = ca + radius * std::cos(angle);
            p[b] = cb + radius * std::sin(angle);
            p[c] = from[c] + (to[c] - from[c]) * t;
            step(p, state_.feed());
        }
        step(to, state_.feed());
        // Whoever takes a level arc itself takes it with one radius.
        program_.chord_error = std::max(program_.chord_error, error_of(chords));
        program_.arc_error =
            std::max(program_.arc_error, error_of(close) + (level ? std::abs(r0 - r1) / 2 : 0));
        if (level)
            program_.arcs.push_back({begin,
                                     program_.steps.size(),
                                     {ca, cb, to[2], (r0 + r1) / 2, start, sweep},
                                     static_cast<std::size_t>(close)});
    }

    /// Arcs have many chords: as many are foreseen in what is left of the text as have come of what was read.
    void make_room() {
        std::vector<ProgramStep>& steps = program_.steps;
        if (steps.size() < steps.capacity()) return;
        const double so_far = static_cast<double>(steps.size() + 1),
                     all = so_far * static_cast<double>(text_.size()) / static_cast<double>(read_ + 1);
        steps.reserve(static_cast<std::size_t>(std::clamp(1.05 * all, 1.25 * so_far, 4 * so_far)) + 64);
    }

    void step(const std::array<double, 3>& to, double feed) {
        make_room();
        program_.steps.push_back({to[0], to[1], to[2], feed, place_.line, state_.turning()});
        at_ = to;
    }

    std::string_view text_;
    GcodeLimits limits_;
    GcodePlace place_;
    Program program_;
    ModalState state_;
    std::size_t read_ = 0;  // of the text
    bool begun_ = false, ended_ = false, blended_ = false;
    double spin_up_s_ = 0;  // of dwell since the spindle was started or its speed changed
    bool spinning_up_ = false;
    std::array<double, 3> at_{kUnknown, kUnknown, kUnknown};
};

}  // namespace

Program read_gcode(std::string_view text, const std::string& file, const GcodeLimits& limits) {
    return Reader(text, file, limits).run();
}

}  // namespace slabwright
