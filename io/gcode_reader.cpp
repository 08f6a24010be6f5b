#include "io/gcode_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kInchInMm = 25.4;
constexpr double kFarthest = 214000;  // mm: what paths in 0.1 µm can say

enum class Motion { none, rapid, line, clockwise, counter_clockwise };

/// One line's words. G and M numbers are kept in tenths, as G43.1 and G90.1 need.
struct Line {
    std::vector<int> g, m;
    std::array<std::optional<double>, 26> words;
    [[nodiscard]] const std::optional<double>& operator[](char letter) const {
        return words[static_cast<std::size_t>(letter - 'A')];
    }
    [[nodiscard]] std::optional<double>& operator[](char letter) {
        return words[static_cast<std::size_t>(letter - 'A')];
    }
};

class Reader {
public:
    Reader(std::string_view text, const std::string& file, const GcodeLimits& limits)
        : text_(text), limits_(limits) {
        program_.file = file;
    }

    Program run() {
        program_.steps.reserve(static_cast<std::size_t>(std::count(text_.begin(), text_.end(), '\n')));
        std::size_t at = 0;
        while (at < text_.size() && !ended_) {
            std::size_t end = text_.find('\n', at);
            if (end == std::string_view::npos) end = text_.size();
            std::string_view line = text_.substr(at, end - at);
            if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
            ++line_;
            read_ = end;
            execute(parse(line));
            at = end + 1;
        }
        if (!ended_)
            fail("gcode.no_end", "the program does not end with M2 or M30", "its end may be missing");
        return std::move(program_);
    }

private:
    [[noreturn]] void fail(const std::string& code, const std::string& message,
                           const std::string& remedy = "plan again") const {
        throw Error(ErrorKind::verification, code, message, program_.file + ":" + std::to_string(line_),
                    remedy);
    }

    Line parse(std::string_view s) const {
        Line line;
        std::size_t i = 0;
        auto blank = [](char c) { return c == ' ' || c == '\t'; };
        while (i < s.size()) {
            const char c = s[i];
            if (blank(c)) {
                ++i;
                continue;
            }
            if (c == ';') break;
            if (c == '%') {
                if (s.find_first_not_of(" \t%") != std::string_view::npos)
                    fail("gcode.percent", "text beside a % mark");
                break;
            }
            if (c == '(') {
                const std::size_t close = s.find(')', i);
                if (close == std::string_view::npos) fail("gcode.comment", "a comment that is not closed");
                if (s.substr(i + 1, close - i - 1).find('(') != std::string_view::npos)
                    fail("gcode.comment", "a comment within a comment");
                i = close + 1;
                continue;
            }
            const char letter = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
            if (letter < 'A' || letter > 'Z')
                fail("gcode.unknown_word", std::string("'") + c + "' begins no word that this reader knows");
            ++i;
            while (i < s.size() && blank(s[i])) ++i;
            const std::size_t start = i;
            if (i < s.size() && (s[i] == '+' || s[i] == '-')) ++i;
            while (i < s.size() && ((s[i] >= '0' && s[i] <= '9') || s[i] == '.')) ++i;
            std::string_view digits = s.substr(start, i - start);
            if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
            double value = 0;
            const auto [stop, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value,
                                                        std::chars_format::fixed);
            if (status != std::errc{} || stop != digits.data() + digits.size() || digits.empty())
                fail("gcode.number", std::string("no number follows ") + letter,
                     "exponents, parameters and expressions are not emitted, so not read");
            word(line, letter, value);
        }
        return line;
    }

    void word(Line& line, char letter, double value) const {
        if (letter == 'G' || letter == 'M') {
            const double tenths = value * 10;
            if (std::abs(tenths - std::round(tenths)) > 1e-6 || value < 0 || value > 1000)
                fail("gcode.unknown_word", std::string(1, letter) + " with a number that names nothing");
            (letter == 'G' ? line.g : line.m).push_back(static_cast<int>(std::llround(tenths)));
            return;
        }
        if (letter == 'N') return;
        if (std::string_view("FHIJKPQRSTXYZ").find(letter) == std::string_view::npos)
            fail("gcode.unknown_word", std::string("a word ") + letter + ", which this reader does not know");
        if (line[letter])
            fail("gcode.twice", std::string("the word ") + letter + " stands twice in one line");
        line[letter] = value;
    }

    void execute(const Line& line) {
        bool motion_named = false, dwell = false, path_mode = false;
        int motions = 0;
        bool length_offset = false;
        for (const int g : line.g) {
            switch (g) {
                case 0:
                    motion_ = Motion::rapid, motion_named = true, ++motions;
                    break;
                case 10:
                    motion_ = Motion::line, motion_named = true, ++motions;
                    break;
                case 20:
                    motion_ = Motion::clockwise, motion_named = true, ++motions;
                    break;
                case 30:
                    motion_ = Motion::counter_clockwise, motion_named = true, ++motions;
                    break;
                case 800:
                    motion_ = Motion::none, ++motions;
                    break;
                case 40:
                    dwell = true;
                    break;
                case 170:
                    plane_ = {0, 1, 2};
                    break;
                case 180:
                    plane_ = {2, 0, 1};
                    break;
                case 190:
                    plane_ = {1, 2, 0};
                    break;
                case 200:
                    unit_ = kInchInMm;
                    break;
                case 210:
                    unit_ = 1;
                    break;
                case 400:
                case 490:
                    break;
                case 430:
                    length_offset = true;
                    break;
                case 431:
                    fail("gcode.offset", "a length offset written into the program (G43.1)",
                         "the machine keeps what it measured");
                case 540:
                case 550:
                case 560:
                case 570:
                case 580:
                case 590:
                case 591:
                case 592:
                case 593: {
                    if (work_offset_ != 0 && work_offset_ != g)
                        fail("gcode.offset", "a second work offset in one program");
                    work_offset_ = g;
                    break;
                }
                case 610:
                case 611:
                    blend(0, 0);
                    break;
                case 640:
                    path_mode = true;
                    break;
                case 900:
                    incremental_ = false;
                    break;
                case 910:
                    incremental_ = true;
                    break;
                case 901:
                    absolute_centres_ = true;
                    break;
                case 911:
                    absolute_centres_ = false;
                    break;
                case 940:
                    break;
                default:
                    fail("gcode.unknown_word", "G" + number(g) + " is no word that this reader knows");
            }
        }
        if (motions > 1) fail("gcode.twice", "two motion words in one line");
        if (line['T']) selected_ = whole(*line['T'], 'T');
        if (line['H'] && !length_offset) fail("gcode.unused_word", "H without G43");
        if (line['H'] && program_.tool != 0 && whole(*line['H'], 'H') != program_.tool)
            fail("gcode.offset", "the length offset of another tool than the one loaded");
        if (line['S']) {
            if (*line['S'] < 0) fail("gcode.number", "a negative spindle speed");
            speed_ = *line['S'];
        }
        if (line['F']) {
            if (!(*line['F'] > 0)) fail("gcode.number", "a feed of zero or less");
            feed_ = *line['F'] * unit_;
        }
        bool stop = false;
        for (const int m : line.m) {
            switch (m) {
                case 0:
                case 10:
                    break;
                case 20:
                case 300:
                    stop = true;
                    break;
                case 30:
                    turning_ = true;
                    break;
                case 40:
                    fail("gcode.spindle", "a spindle turning backwards (M4)",
                         "the cutters are right-hand ones");
                case 50:
                    turning_ = false;
                    break;
                case 60:
                    if (selected_ <= 0) fail("gcode.tool", "a tool change (M6) that names no tool");
                    if (program_.tool != 0 && program_.tool != selected_)
                        fail("gcode.tool", "a second tool in one program");
                    program_.tool = selected_;
                    turning_ = false;
                    break;
                case 70:
                case 80:
                case 90:
                    break;
                default:
                    fail("gcode.unknown_word", "M" + number(m) + " is no word that this reader knows");
            }
        }
        if (turning_) program_.spindle_rpm = std::max(program_.spindle_rpm, speed_);
        if (dwell) {
            if (!line['P'] || *line['P'] < 0) fail("gcode.dwell", "G4 without a time P");
            program_.dwell_s += *line['P'];
        } else if (path_mode) {
            for (const char letter : {'P', 'Q'})
                if (line[letter] && *line[letter] < 0)
                    fail("gcode.number", std::string("G64 with a negative tolerance ") + letter);
            // LinuxCNC leaves out points within Q of a straight way, and takes P for a Q that is not given.
            const double rounds = line['P'] ? *line['P'] * unit_ : kJunction;
            if (line['P'] || line['Q']) blend(rounds, line['Q'] ? *line['Q'] * unit_ : rounds);
        } else if (line['P']) {
            fail("gcode.unused_word", "P without G4 or G64");
        }
        if (line['Q'] && !path_mode) fail("gcode.unused_word", "Q without G64");
        const bool axes = line['X'] || line['Y'] || line['Z'];
        const bool arc = motion_ == Motion::clockwise || motion_ == Motion::counter_clockwise;
        if (!arc && (line['I'] || line['J'] || line['K'] || line['R']))
            fail("gcode.unused_word", "an arc's word (I, J, K or R) without an arc");
        if (axes || (arc && motion_named)) move(line);
        else if (line['I'] || line['J'] || line['K'] || line['R'])
            fail("gcode.unused_word", "an arc's word (I, J, K or R) without an arc");
        if (stop) ended_ = true;
    }

    // Of several in one program the widest counts where the cutter may get, the narrowest for its time.
    void blend(double rounds, double leaves_out) {
        program_.strays = blended_ ? std::max(program_.strays, rounds + leaves_out) : rounds + leaves_out;
        program_.blend = blended_ ? std::min(program_.blend, rounds) : rounds;
        blended_ = true;
    }

    void move(const Line& line) {
        if (motion_ == Motion::none) fail("gcode.motion", "coordinates without a motion (G0 to G3)");
        std::array<double, 3> to = at_;
        const char letters[3] = {'X', 'Y', 'Z'};
        for (int k = 0; k < 3; ++k) {
            const auto& value = line[letters[k]];
            if (!value) continue;
            if (incremental_ && !std::isfinite(at_[k]))
                fail("gcode.unknown_place", "an incremental motion from an unknown place");
            to[k] = incremental_ ? at_[k] + *value * unit_ : *value * unit_;
            if (std::abs(to[k]) > kFarthest) fail("gcode.number", "a coordinate beyond 214 m");
        }
        if (motion_ == Motion::rapid) {
            step(to, 0);
            return;
        }
        if (!(feed_ > 0)) fail("gcode.feed", "a feed motion before any feed (F)");
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(to[k]) || !std::isfinite(at_[k]))
                fail("gcode.unknown_place", "a feed motion from or to an unknown place");
        if (motion_ == Motion::line) step(to, feed_);
        else arc(line, to);
    }

    void arc(const Line& line, const std::array<double, 3>& to) {
        const auto [a, b, c] = plane_;
        const double da = to[a] - at_[a], db = to[b] - at_[b];
        const bool clockwise = motion_ == Motion::clockwise;
        double ca = 0, cb = 0;
        const char letters[3] = {'I', 'J', 'K'};
        if (line[letters[c]])
            fail("gcode.unused_word", std::string("the word ") + letters[c] + " in an arc of another plane");
        if (line['R']) {
            if (line[letters[a]] || line[letters[b]])
                fail("gcode.arc", "an arc with both a radius and a centre");
            const double r = *line['R'] * unit_, chord = std::hypot(da, db);
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
            if (!line[letters[a]] && !line[letters[b]]) fail("gcode.arc", "an arc without a centre");
            const double u = line[letters[a]].value_or(0) * unit_, v = line[letters[b]].value_or(0) * unit_;
            ca = absolute_centres_ ? u : at_[a] + u;
            cb = absolute_centres_ ? v : at_[b] + v;
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
            step(p, feed_);
        }
        step(to, feed_);
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
        program_.steps.push_back({to[0], to[1], to[2], feed, line_, turning_ && speed_ > 0});
        at_ = to;
    }

    int whole(double value, char letter) const {
        if (value < 0 || value > 99999 || value != std::floor(value))
            fail("gcode.number", std::string(1, letter) + " needs a whole number");
        return static_cast<int>(value);
    }

    static std::string number(int tenths) {
        std::string s = std::to_string(tenths / 10);
        if (tenths % 10 != 0) s += "." + std::to_string(tenths % 10);
        return s;
    }

    std::string_view text_;
    GcodeLimits limits_;
    Program program_;
    std::uint32_t line_ = 0;
    std::size_t read_ = 0;  // of the text
    bool ended_ = false;
    Motion motion_ = Motion::none;
    std::array<int, 3> plane_{0, 1, 2};
    double unit_ = 1;
    bool incremental_ = false, absolute_centres_ = false, blended_ = false;
    int work_offset_ = 0, selected_ = 0;
    double speed_ = 0, feed_ = 0;
    bool turning_ = false;
    std::array<double, 3> at_{kUnknown, kUnknown, kUnknown};
};

}  // namespace

Program read_gcode(std::string_view text, const std::string& file, const GcodeLimits& limits) {
    return Reader(text, file, limits).run();
}

}  // namespace slabwright
