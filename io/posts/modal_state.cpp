#include "io/posts/modal_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

namespace slabwright {

namespace {

/// The groups of which a line may hold one word; those without a bit are no words of this project.
std::uint32_t group_of_g(int g) {
    switch (g) {
        case 40:
            return 1u << 0;
        case 0:
        case 10:
        case 20:
        case 30:
        case 800:
            return 1u << 1;
        case 170:
        case 180:
        case 190:
            return 1u << 2;
        case 900:
        case 910:
            return 1u << 3;
        case 901:
        case 911:
            return 1u << 4;
        case 940:
            return 1u << 5;
        case 200:
        case 210:
        case 7000:
        case 7100:
            return 1u << 6;
        case 400:
            return 1u << 7;
        case 430:
        case 431:
        case 490:
            return 1u << 8;
        case 540:
        case 550:
        case 560:
        case 570:
        case 580:
        case 590:
        case 591:
        case 592:
        case 593:
            return 1u << 9;
        case 600:
        case 610:
        case 611:
        case 640:
        case 1870:
        case 6410:
            return 1u << 10;
        case 970:
            return 1u << 11;
        case 80:
            return 1u << 12;
        default:
            return 0;
    }
}

std::uint32_t group_of_m(int m) {
    switch (m) {
        case 0:
        case 10:
        case 20:
        case 300:
        case 600:
            return 1u << 0;
        case 30:
        case 40:
        case 50:
            return 1u << 1;
        case 60:
            return 1u << 2;
        case 70:
        case 80:
        case 90:
            return 1u << 3;
        case 480:
            return 1u << 4;
        default:
            return 0;
    }
}

void check_groups(const GcodeNumbers& numbers, char letter, std::uint32_t (*group_of)(int),
                  std::span<const int> known, const GcodePlace& place) {
    std::uint32_t seen = 0;
    for (const int number : numbers) {
        const std::uint32_t group = group_of(number);
        if (group == 0 || std::find(known.begin(), known.end(), number) == known.end())
            place.fail("gcode.unknown_word",
                       fmt::format("{}{} is no word that this reader knows", letter, gcode_number(number)));
        if ((seen & group) != 0)
            place.fail("gcode.twice", group == 1u << 1 && letter == 'G'
                                          ? std::string("two motion words in one line")
                                          : fmt::format("{}{} beside another word of its group", letter,
                                                        gcode_number(number)));
        seen |= group;
    }
}

int whole(double value, char letter, const GcodePlace& place) {
    if (value < 0 || value > 99999 || value != std::floor(value))
        place.fail("gcode.number", fmt::format("{} needs a whole number", letter));
    return static_cast<int>(value);
}

}  // namespace

void ModalState::apply(const GcodeLine& line, const GcodePlace& place) {
    motion_named_ = spins_up_ = false;
    named_path_mode_.reset();
    dwell_.reset();
    if (line.g.count > 0) check_groups(line.g, 'G', group_of_g, dialect_.g, place);
    if (std::any_of(line.m.begin(), line.m.end(), [&](int m) { return is_switch(m); })) {
        check_switch(line, place);
        return;
    }
    if (line.m.count > 0) check_groups(line.m, 'M', group_of_m, dialect_.m, place);
    check_words(line, place);
    speed_and_feed(line, place);
    if (line.has('T')) {
        if (selected_ != 0 || (loaded_ != 0 && !several_))
            place.fail("gcode.tool", "a second tool in one program");
        selected_ = whole(line['T'], 'T', place);
    }
    if (line.m.has(60)) change_tool(place);
    else if (!dialect_.changes_tools && selected_ > 0) loaded_ = selected_;
    if (line.has('D')) edge(line, place);
    for (const int m : line.m) m_word(m, place);
    if (line.g.has(40)) dwell(line, place);
    for (const int g : line.g) g_word(g, place);
    if (line.g.has(430)) length_offset(line, place);
    if (line.g.has(640)) path_mode(line, place);
    if (line.g.has(1870)) rounding_187(line, place);
    if (line.g.has(6410)) rounding_adis(line, place);
}

bool ModalState::is_switch(int m) const {
    const std::vector<int>& known = dialect_.switches;
    return m % 10 == 0 && std::find(known.begin(), known.end(), m / 10) != known.end();
}

/// Which output it switches (P) is all that a switch may be told: nothing of the state depends on it.
void ModalState::check_switch(const GcodeLine& line, const GcodePlace& place) const {
    if (line.g.count == 0 && line.m.count == 1 && !line.has_letter_beside('P')) return;
    const int word = *std::find_if(line.m.begin(), line.m.end(), [&](int m) { return is_switch(m); });
    place.fail("gcode.switch", fmt::format("M{} beside other words: a switch stands on a line of its own",
                                           gcode_number(word)));
}

void ModalState::dwell(const GcodeLine& line, const GcodePlace& place) {
    using Dwell = Dialect::Dwell;
    const char letter = dialect_.dwell == Dwell::x_seconds   ? 'X'
                        : dialect_.dwell == Dwell::f_seconds ? 'F'
                                                             : 'P';
    if (!line.has(letter) || line[letter] < 0)
        place.fail("gcode.dwell", fmt::format("G4 without a time {}", letter));
    const bool milliseconds = dialect_.dwell == Dwell::p_milliseconds ||
                              (dialect_.dwell == Dwell::p_by_point && !line.pointed('P'));
    if (dialect_.dwell == Dwell::p_milliseconds && line.pointed('P'))
        place.fail("gcode.dwell", "G4 P with a decimal point; this control takes whole milliseconds");
    dwell_ = line[letter] / (milliseconds ? 1000 : 1);
}

/// The length of the tool that is loaded comes into force by its edge.
void ModalState::edge(const GcodeLine& line, const GcodePlace& place) {
    const int number = whole(line['D'], 'D', place);
    if (number > 1) place.fail("gcode.offset", "another edge (D) than the first of the tool");
    if (number == 1 && loaded_ == 0)
        place.fail("gcode.offset", "a tool's edge (D1) before the tool is loaded (M6)");
    length_offset_ = number == 1;
}

/// A parameter that no word of the line takes is a slip that LinuxCNC refuses.
void ModalState::check_words(const GcodeLine& line, const GcodePlace& place) const {
    const bool dwells = line.g.has(40), adis = line.g.has(6410), g187 = line.g.has(1870),
               blends = line.g.has(640) && dialect_.rounding == Dialect::Rounding::g64_p;
    if (line.has('P') && !dwells && !blends && !g187)
        place.fail("gcode.unused_word", dialect_.rounding == Dialect::Rounding::g187 ? "P without G4 or G187"
                                                                                     : "P without G4 or G64");
    if (line.has('Q') && !blends) place.fail("gcode.unused_word", "Q without G64");
    if (line.has('E') && !g187) place.fail("gcode.unused_word", "E without G187");
    if ((line.has(kAdis) || line.has(kAdisPos)) && !adis)
        place.fail("gcode.unused_word", "ADIS without G641");
    if (line.has('H') && !line.g.has(430)) place.fail("gcode.unused_word", "H without G43");
    const bool times_x = dialect_.dwell == Dialect::Dwell::x_seconds;
    if (dwells && (blends || adis || g187 || (line.has('X') && !times_x) || line.has('Y') || line.has('Z')))
        place.fail("gcode.dwell", "G4 beside other words that take numbers");
}

void ModalState::speed_and_feed(const GcodeLine& line, const GcodePlace& place) {
    const bool times = line.g.has(40) && dialect_.dwell == Dialect::Dwell::f_seconds;
    if (line.has('F') && !times) {
        if (!(line['F'] > 0)) place.fail("gcode.number", "a feed of zero or less");
        feed_ = feed_of(line['F'], place);  // in the unit before a G20 or G21 of this line
    }
    if (line.has('S')) {
        if (line['S'] < 0) place.fail("gcode.number", "a negative spindle speed");
        spins_up_ = spindle_ == Spindle::clockwise && line['S'] != speed_;
        speed_ = line['S'];
    }
}

void ModalState::change_tool(const GcodePlace& place) {
    if (loaded_ != 0 && !several_) place.fail("gcode.tool", "a second tool change (M6) in one program");
    if (selected_ <= 0) place.fail("gcode.tool", "a tool change (M6) that names no tool");
    if (loaded_ != 0 && spindle_ != Spindle::off)
        place.fail("gcode.tool", "a tool change (M6) while the spindle turns");
    loaded_ = selected_;
    if (several_) selected_ = 0;
    length_offset_ = false;
    spindle_ = Spindle::off;
}

void ModalState::m_word(int m, const GcodePlace& place) {
    switch (m) {
        case 0:
        case 10:
        case 600:
            place.fail("gcode.pause",
                       fmt::format("a stop in the program (M{}) with the cutter where it is", m / 10),
                       "programs run through; pause the machine by hand");
        case 30:
            spins_up_ = spins_up_ || spindle_ != Spindle::clockwise;
            spindle_ = Spindle::clockwise;
            break;
        case 40:
            place.fail("gcode.spindle", "a spindle turning backwards (M4)",
                       "the cutters are right-hand ones");
        case 50:
            spindle_ = Spindle::off;
            break;
        case 70:
        case 80:
            place.fail("gcode.coolant", fmt::format("coolant (M{}) on wood", m / 10));
        default:
            break;  // M6 and M2 have their own place; M9 and M48 are as a router should be
    }
}

bool ModalState::motion_word(int g) {
    if (g == 0) motion_ = Motion::rapid;
    else if (g == 10) motion_ = Motion::line;
    else if (g == 20) motion_ = Motion::clockwise;
    else if (g == 30) motion_ = Motion::counter_clockwise;
    else if (g == 800) motion_ = Motion::none;
    else return false;
    motion_named_ = motion_ != Motion::none;
    return true;
}

void ModalState::g_word(int g, const GcodePlace& place) {
    if (motion_word(g)) return;
    switch (g) {
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
        case 7000:
            unit_ = kInch;
            break;
        case 210:
        case 7100:
            unit_ = 1;
            break;
        case 80:
            radius_mode_ = true;
            break;
        case 400:
            no_compensation_ = true;
            break;
        case 490:
            length_offset_ = false;
            break;
        case 431:
            place.fail("gcode.offset", "a length offset written into the program (G43.1)",
                       "the machine keeps what it measured");
        case 540:
            work_offset_ = true;
            break;
        case 600:
        case 610:
        case 611:
            // One that never leaves its path slows down at corners by a setting, as if it rounded them.
            named_path_mode_ =
                dialect_.rounding == Dialect::Rounding::exact ? PathMode{kJunction, 0} : PathMode{};
            path_mode_ = true;
            break;
        case 900:
            distance_ = Distance::absolute;
            break;
        case 910:
            distance_ = Distance::incremental;
            break;
        case 901:
            absolute_centres_ = true;
            break;
        case 911:
            absolute_centres_ = false;
            break;
        case 940:
            feed_per_minute_ = true;
            break;
        case 970:
            revolutions_ = true;
            break;
        case 40:
        case 430:
        case 640:
        case 1870:
        case 6410:
            break;  // with their parameters, in apply()
        default:
            place.fail("gcode.offset",
                       fmt::format("the work offset G{}, where every program of a plan counts from G54",
                                   gcode_number(g)));
    }
}

void ModalState::length_offset(const GcodeLine& line, const GcodePlace& place) {
    if (loaded_ == 0)
        place.fail("gcode.offset", "a length offset (G43) before the tool is loaded (M6)",
                   "the machine measures a tool when it loads it");
    if (line.has('H') && whole(line['H'], 'H', place) != loaded_)
        place.fail("gcode.offset", "the length offset of another tool than the one loaded");
    length_offset_ = true;
}

void ModalState::rounding_187(const GcodeLine& line, const GcodePlace& place) {
    const double p = line['P'];
    if (!line.has('P') || (p != 1 && p != 2 && p != 3))
        place.fail("gcode.path_mode", "G187 without a smoothness P1, P2 or P3");
    if (!(line['E'] > 0)) place.fail("gcode.path_mode", "G187 without the rounding E that it allows");
    named_path_mode_ = PathMode{length(line['E'], place), 0};
    path_mode_ = true;
}

void ModalState::rounding_adis(const GcodeLine& line, const GcodePlace& place) {
    if (!(line[kAdis] > 0) || !(line[kAdisPos] > 0))
        place.fail("gcode.path_mode", "G641 without ADIS= and ADISPOS=: the machine's own would count");
    const double feeds = length(line[kAdis], place), rapids = length(line[kAdisPos], place);
    named_path_mode_ = PathMode{std::min(feeds, rapids), std::abs(feeds - rapids)};
    path_mode_ = true;
}

void ModalState::path_mode(const GcodeLine& line, const GcodePlace& place) {
    if (dialect_.rounding != Dialect::Rounding::g64_p) {
        named_path_mode_ = PathMode{kJunction, 0};
        path_mode_ = true;
        return;
    }
    for (const char letter : {'P', 'Q'})
        if (line[letter] < 0)
            place.fail("gcode.number", fmt::format("G64 with a negative tolerance {}", letter));
    // LinuxCNC takes 0 for none, leaves out points within Q of a straight way, and takes P for a Q that is
    // not given.
    if (!(line['P'] > 0))
        place.fail("gcode.path_mode",
                   "G64 without a tolerance P: the machine may leave its path as far as it likes");
    const double rounds = length(line['P'], place);
    named_path_mode_ = PathMode{rounds, line.has('Q') ? length(line['Q'], place) : rounds};
    path_mode_ = true;
}

double ModalState::length(double value, const GcodePlace& place) const {
    if (unit_ == 0)
        place.fail("gcode.unset", "a length or feed before its unit (G21)",
                   "the machine would take what the program before left in force");
    return value * unit_;
}

/// A feed in inches a minute has three decimals: it is the whole millimetre a minute that is written so.
double ModalState::feed_of(double value, const GcodePlace& place) const {
    const double feed = length(value, place);
    const double whole = std::round(feed), written = 0.5e-3 * unit_ + 1e-9;
    return unit_ == kInch && std::abs(feed - whole) <= written ? whole : feed;
}

void ModalState::require_for_motion(const GcodePlace& place) const {
    if (loaded_ == 0) place.fail("gcode.tool", "a motion before a tool is loaded (T… M6)");
    if (!length_offset_ && !no_length_offset_)
        place.fail("gcode.offset", dialect_.length == Dialect::Length::edge
                                       ? "a motion without the length of its tool (D1)"
                                       : "a motion without the length offset of its tool (G43)");
    const auto require = [&](bool known, const char* what) {
        if (!known)
            place.fail("gcode.unset", fmt::format("a motion before {}", what),
                       "the machine would take what the program before left in force");
    };
    require(unit_ != 0, "its unit (G21)");
    require(plane_[0] >= 0, "its plane (G17)");
    require(distance_ != Distance::unknown, "absolute or incremental distances (G90)");
    require(feed_per_minute_, "the meaning of its feed (G94)");
    require(no_compensation_, "cutter compensation is off (G40)");
    require(radius_mode_ || !dialect_.lathe_words, "x as it is, not as a diameter (G8)");
    require(revolutions_ || !dialect_.lathe_words, "a spindle speed in revolutions (G97)");
    require(work_offset_, "its work offset (G54)");
    require(path_mode_, dialect_.rounding == Dialect::Rounding::g64_p
                            ? "how far the machine may leave its path (G64 P…)"
                            : "how far the control may leave its path");
    if (motion_ != Motion::rapid && !(feed_ > 0))
        place.fail("gcode.feed", "a feed motion before any feed (F)");
}

void ModalState::require_at_end(const GcodePlace& place) const {
    const auto refuse = [&](const char* what) {
        place.fail("gcode.left_in_force", fmt::format("the program leaves the machine {}", what),
                   "whoever moves it by hand afterwards does not expect that");
    };
    if (unit_ == kInch && !dialect_.inch()) refuse("in inches (G20)");
    if (unit_ == 1 && dialect_.inch()) refuse("in millimetres, where the plan's programs are in inches");
    if (incremental()) refuse("in incremental distances (G91)");
}

}  // namespace slabwright
