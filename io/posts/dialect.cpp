#include "io/posts/dialect.h"

#include "io/text/job_keys.h"

namespace slabwright {

namespace {

// In tenths: G0 to G3, G4, G17 to G21, G40, G43, G49, G53 to G59, G61, G64, G80, G90, G91, G94, and each
// control's own.
constexpr int kLinuxcncG[] = {0,   10,  20,  30,  40,  80,  170, 180, 190, 200, 210, 400,
                              430, 431, 490, 540, 550, 560, 570, 580, 590, 591, 592, 593,
                              610, 611, 640, 800, 900, 901, 910, 911, 940, 970};
constexpr int kMachG[] = {0,   10,  20,  30,  40,  170, 180, 190, 200, 210, 400, 430, 490, 540,
                          550, 560, 570, 580, 590, 610, 640, 800, 900, 901, 910, 911, 940};
constexpr int kFanucG[] = {0,   10,  20,  30,  40,  170, 180, 190, 200, 210, 400, 430, 490,
                           540, 550, 560, 570, 580, 590, 610, 640, 800, 900, 910, 940};
constexpr int kHaasG[] = {0,   10,  20,  30,  40,  170, 180, 190, 200, 210, 400, 430, 490,
                          540, 550, 560, 570, 580, 590, 610, 800, 900, 910, 940, 1870};
constexpr int kGrblG[] = {0,   10,  20,  30,  40,  170, 180, 190, 200, 210, 400, 431, 490,
                          540, 550, 560, 570, 580, 590, 610, 800, 900, 910, 911, 940};
constexpr int kSiemensG[] = {0,   10,  20,  30,  40,  170, 180, 190,  400,  540,
                             550, 560, 570, 600, 900, 910, 940, 6410, 7000, 7100};
constexpr int kLinuxcncM[] = {0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 300, 480, 600};
constexpr int kCommonM[] = {0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 300};
constexpr int kGrblM[] = {0, 10, 20, 30, 40, 50, 70, 80, 90, 300};

constexpr std::string_view kCornerNote = "set the control to round corners by 0.02 mm at most";  // kJunction

Dialect linuxcnc() {
    Dialect d;
    d.semicolon = true;
    d.head =
        "{unit} G17 G90 G94 G40 G49 G80\nG8 G97\nG64 P{blend} Q0\nG54\nT{tool} M6\nG43 H{tool}\nS{speed} "
        "M3\nG4 P{dwell}\n";
    d.change = "M5\nT{tool} M6\nG43 H{tool}\n";
    d.next = "S{speed} M3\nG64 P{blend} Q0\nG4 P{dwell}\n";
    d.first = "G0 Z{z}\n";
    d.end = "M5\nM2\n";
    d.centres = "G91.1\n";
    d.centres_incremental = false;
    d.percent = Dialect::Percent::may;
    d.lathe_words = true;
    d.g = kLinuxcncG;
    d.m = kLinuxcncM;
    d.letters = "FHIJKPQRSTXYZ";
    return d;
}

/// What Fanuc, Haas and a plain ISO control have in common.
Dialect with_points(std::string_view name) {
    Dialect d;
    d.name = name;
    d.decimals = 3;
    d.point = d.needs_point = true;
    d.capitals = true;
    d.longest_comment = 60;
    d.longest_line = 128;
    d.change = "M5\nT{tool} M6\n";
    d.first = "G0 G43 H{tool} Z{z}\n";
    d.end = "M5\nM30\n%\n";
    d.percent = Dialect::Percent::must;
    d.m = kCommonM;
    d.letters = "FHIJKPRSTXYZ";
    return d;
}

Dialect fanuc() {
    Dialect d = with_points("Fanuc");
    d.begin = "%\nO{number:04}\n";
    d.head = "{unit} G17 G90 G94 G40 G49 G80\nG64\nG54\nT{tool} M6\nS{speed} M3\nG4 P{dwell_ms}\n";
    d.next = "S{speed} M3\nG4 P{dwell_ms}\n";
    d.notes = kCornerNote;
    d.numbered = true;
    d.dwell = Dialect::Dwell::p_milliseconds;
    d.rounding = Dialect::Rounding::setting;
    d.g = kFanucG;
    d.letters = "FHIJKOPRSTXYZ";
    return d;
}

Dialect haas() {
    Dialect d = with_points("Haas");
    d.begin = "%\nO{number:05}\n";
    d.head = "{unit} G17 G90 G94 G40 G49 G80\nG187 P2 E{blend}\nG54\nT{tool} M6\nS{speed} M3\nG4 P{dwell}\n";
    d.next = "S{speed} M3\nG187 P2 E{blend}\nG4 P{dwell}\n";
    d.numbered = true;
    d.dwell = Dialect::Dwell::p_by_point;
    d.rounding = Dialect::Rounding::g187;
    d.g = kHaasG;
    d.letters = "EFHIJKOPRSTXYZ";
    return d;
}

Dialect iso() {
    Dialect d = with_points("ISO");
    d.begin = "%\n";
    d.head = "{unit} G17 G90 G94 G40 G49 G80\nG64\nG54\nT{tool} M6\nS{speed} M3\nG4 X{dwell}\n";
    d.next = "S{speed} M3\nG4 X{dwell}\n";
    d.notes = kCornerNote;
    d.dwell = Dialect::Dwell::x_seconds;
    d.rounding = Dialect::Rounding::setting;
    d.g = kFanucG;
    return d;
}

Dialect mach() {
    Dialect d;
    d.name = "Mach";
    d.longest_comment = 100;
    d.head = "{unit} G17 G90 G94 G40 G49 G80\nG64\nG54\nT{tool} M6\nS{speed} M3\nG4 P{dwell}\n";
    d.change = "M5\nT{tool} M6\n";
    d.next = "S{speed} M3\nG4 P{dwell}\n";
    d.notes = "set the control to round corners by 0.02 mm at most, and G4 to count seconds";
    d.first = "G0 G43 H{tool} Z{z}\n";
    d.end = "M5\nM30\n";
    d.centres = "G91.1\n";
    d.centres_incremental = false;
    d.percent = Dialect::Percent::may;
    d.rounding = Dialect::Rounding::setting;
    d.g = kMachG;
    d.m = kCommonM;
    d.letters = "FHIJKPRSTXYZ";
    return d;
}

Dialect grbl() {
    Dialect d;
    d.name = "GRBL";
    d.semicolon = true;
    d.longest_comment = 70;
    d.longest_line = 79;
    d.forbidden = "?!~$";
    d.head = "{unit} G17 G90 G94 G40 G49 G80\nG61\nG54\nT{tool}\nS{speed} M3\nG4 P{dwell}\n";
    d.next = "S{speed} M3\nG4 P{dwell}\n";
    d.notes =
        "before the start: tool {tool} in the spindle, its tip touched off\nsetting 11 at 0.02 mm at most, "
        "laser mode (32) off";
    d.first = "G0 Z{z}\n";
    d.end = "M5\nM2\n";
    d.changes_tools = false;
    d.length = Dialect::Length::touch_off;
    d.rounding = Dialect::Rounding::exact;
    d.g = kGrblG;
    d.m = kGrblM;
    d.letters = "FIJKPRSTXYZ";
    return d;
}

Dialect siemens() {
    Dialect d;
    d.name = "Siemens";
    d.parentheses = false;
    d.semicolon = true;
    d.longest_comment = 100;
    d.head =
        "{unit} G17 G90 G94 G40\nG641 ADIS={blend} ADISPOS={blend}\nG54\nT{tool} M6\nD1\nS{speed} M3\nG4 "
        "F{dwell}\n";
    d.change = "M5\nT{tool} M6\nD1\n";
    d.next = "S{speed} M3\nG641 ADIS={blend} ADISPOS={blend}\nG4 F{dwell}\n";
    d.first = "G0 Z{z}\n";
    d.end = "M5\nM30\n";
    d.dwell = Dialect::Dwell::f_seconds;
    d.length = Dialect::Length::edge;
    d.rounding = Dialect::Rounding::adis;
    d.g = kSiemensG;
    d.m = kCommonM;
    d.letters = "DFIJKSTXYZ";
    d.named_words = true;
    return d;
}

Dialect heidenhain() {
    Dialect d;
    d.name = "Heidenhain";
    d.conversational = true;
    d.parentheses = false;
    d.semicolon = true;
    d.longest_comment = 80;
    d.longest_line = 128;
    d.begin = "BEGIN PGM {name} {unit}\n";
    d.head =
        "TOOL CALL {tool} Z S{speed}\nCYCL DEF 32.0 TOLERANCE\nCYCL DEF 32.1 T{blend}\nM3\nCYCL DEF 9.0 "
        "DWELL "
        "TIME\nCYCL DEF 9.1 DWELL {dwell}\n";
    d.change = "M5\nTOOL CALL {tool} Z S{speed}\n";
    d.again = "TOOL CALL {tool} Z S{speed}\n";
    d.next =
        "M3\nCYCL DEF 32.0 TOLERANCE\nCYCL DEF 32.1 T{blend}\nCYCL DEF 9.0 DWELL TIME\nCYCL DEF 9.1 DWELL "
        "{dwell}\n";
    d.notes = "the active preset is the zero that the setup sheet shows";
    d.first = "L Z{z} R0 FMAX\n";
    d.end = "M5\nM30\nEND PGM {name} {unit}\n";
    d.dwell = Dialect::Dwell::cycle;
    d.length = Dialect::Length::call;
    d.rounding = Dialect::Rounding::cycle;
    return d;
}

Dialect metric(Post post) {
    switch (post) {
        case Post::linuxcnc:
            return linuxcnc();
        case Post::fanuc:
            return fanuc();
        case Post::haas:
            return haas();
        case Post::grbl:
            return grbl();
        case Post::mach:
            return mach();
        case Post::iso:
            return iso();
        case Post::siemens:
            return siemens();
        case Post::heidenhain:
            return heidenhain();
    }
    return linuxcnc();
}

}  // namespace

Dialect dialect_of(Post post, LengthUnit units) {
    Dialect d = metric(post);
    d.post = post;
    d.units = units;
    if (!d.inch()) return d;
    d.decimals = 5;
    d.feed_decimals = 3;
    d.feed_unit = d.conversational ? kInch / 10 : kInch;  // a TNC takes F in tenths of an inch a minute
    return d;
}

Dialect dialect_of(const Machine& machine) {
    if (!machine.own_post) return dialect_of(machine.post, machine.units);
    const auto& own = dynamic_cast<const OwnDialect&>(*machine.own_post);
    return machine.units == LengthUnit::inch ? own.inch : own.mm;
}

std::string in_words(Post post, LengthUnit units) {
    return std::string(word_of(kPostWords, post)) + (units == LengthUnit::inch ? " in inch" : "");
}

std::string in_words(const Dialect& dialect) {
    if (!dialect.own) return in_words(dialect.post, dialect.units);
    return '"' + dialect.name + '"' + (dialect.inch() ? " in inch" : "");
}

}  // namespace slabwright
