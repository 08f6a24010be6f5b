#include "io/posts/sheet_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "engine/sheets/head_switches.h"
#include "engine/sheets/sheet_plan.h"
#include "io/posts/dialect.h"
#include "io/posts/gcode_line.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kAtTop = 1e-3;         ///< mm: heights are written in steps
constexpr double kLeastSpinUp = 1;      ///< s of dwell that a router's spindle is given
constexpr double kMostBlending = 0.01;  ///< mm by which a control may round corners (G64 P)

/// What words of a group change: one of each may stand in a line, and all but the first and the last must be
/// stated before the head moves.
enum Group : unsigned {
    kMotion,
    kPlane,
    kUnits,
    kDistances,
    kFeedMode,
    kRadius,
    kLength,
    kPath,
    kFrame,
    kDwell
};
constexpr unsigned kHead = 1u << kPlane | 1u << kUnits | 1u << kDistances | 1u << kFeedMode | 1u << kRadius |
                           1u << kLength | 1u << kPath | 1u << kFrame;
struct KnownWord {
    double number;
    Group group;
};
constexpr KnownWord kKnownWords[] = {{0, kMotion},  {1, kMotion},     {80, kMotion},   {17, kPlane},
                                     {21, kUnits},  {90, kDistances}, {93, kFeedMode}, {94, kFeedMode},
                                     {40, kRadius}, {43, kLength},    {49, kLength},   {64, kPath},
                                     {54, kFrame},  {4, kDwell}};

/// Reads one program line by line.
class SheetReader {
public:
    explicit SheetReader(const std::string& file) { program_.file = file; }

    void line(std::string_view text, std::uint32_t number) {
        number_ = number;
        check_characters(text, {program_.file, number_}, dialect_);
        if (ended_ && !text.empty()) fail("gcode.after_end", "words after the program's end");
        if (!text.empty() && text.front() == '(') comment(text);
        else if (!text.empty()) words(text);
    }

    ReadSheetProgram take() {
        if (!has_stock_) fail("gcode.no_stock", "no comment says which stock it is for");
        if (!ended_) fail("gcode.no_end", "the program ends without M2");
        require_alike_depths();
        return std::move(program_);
    }

private:
    [[noreturn]] void fail(const char* code, const std::string& message) const {
        throw Error(ErrorKind::verification, code, message, fmt::format("{}:{}", program_.file, number_),
                    "write the programs again with `slabwright sheets`");
    }

    double number_of(std::string_view text) const {
        double value = 0;
        const auto [end, error] =
            std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
        if (error != std::errc() || end != text.data() + text.size() || !(std::abs(value) < 1e6))
            fail("gcode.number", "\"" + std::string(text.substr(0, 40)) + "\" is no number");
        return value;
    }

    static std::vector<std::string_view> split(std::string_view text) {
        std::vector<std::string_view> parts;
        std::size_t i = 0;
        while (i < text.size()) {
            while (i < text.size() && text[i] == ' ') ++i;
            const std::size_t begin = i;
            while (i < text.size() && text[i] != ' ') ++i;
            if (i > begin) parts.push_back(text.substr(begin, i - begin));
        }
        return parts;
    }

    void comment(std::string_view text) {
        if (text.find_first_of("()", 1) != text.size() - 1)
            fail("gcode.comment", "a comment that is not all of its line");
        check_comment(text.substr(1, text.size() - 2), {program_.file, number_});
        const auto w = split(text.substr(1, text.size() - 2));
        const auto value = [&](std::size_t i) { return number_of(w[i]); };
        const auto whole = [&](std::size_t i) {
            const double v = value(i);
            if (v != std::floor(v)) fail("gcode.number", "\"" + std::string(w[i]) + "\" is not whole");
            return static_cast<int>(v);
        };
        if (w.size() == 9 && w[0] == "stock" && w[2] == "x" && w[4] == "thickness" && w[6] == "kerf") {
            if (has_stock_) fail("gcode.twice", "a second stock");
            has_stock_ = true;
            program_.length = value(1), program_.width = value(3);
            program_.thickness = value(5), program_.kerf = value(7);
            program_.is_routed = w[8] == "router";
            if (!(program_.thickness > 0) || !(program_.kerf >= 0))
                fail("gcode.number", "a thickness or kerf of nothing");
        } else if (w.size() == 11 && w[0] == "piece" && w[2] == "from" && w[4] == "to" && w[6] == "turn" &&
                   w[8] == "at") {
            ReadPiece piece{whole(1), value(3), value(5), whole(7), value(9), value(10), {}, {}};
            if (piece.turn % 90 != 0) fail("gcode.number", "a turn that is no quarter");
            program_.pieces.push_back(piece);
        } else if (w.size() == 9 && w[0] == "dowel" && w[2] == "piece" && w[4] == "at") {
            const double diameter = value(8);
            if (!(diameter > 0)) fail("gcode.comment", "a dowel without a diameter");
            piece_of(whole(3)).holes.push_back({value(5), value(6), diameter});
        } else if (w.size() == 12 && w[0] == "tab" && w[2] == "piece") {
            std::array<double, 8> corners{};
            for (std::size_t i = 0; i < 8; ++i) corners[i] = value(4 + i);
            piece_of(whole(3)).tabs.push_back(corners);
        } else if (w.size() == 7 && w[0] == "engraver" && w[3] == "width" && w[5] == "depth") {
            engraver({w[1], value(2), value(4), value(6)});
        } else if (w.size() == 5 && w[0] == "engraving" && w[2] == "piece") {
            if (!program_.engraver) fail("gcode.engraver", "an engraving, and no comment says with what");
            program_.engravings.push_back({whole(3), std::string(w[4]), {}, 0, number_});
            is_engraving_ = true;
        } else if (w.size() == 2 && w[0] == "taper") {
            if (program_.is_routed || is_set_ || !(std::abs(value(1)) <= 10))
                fail("gcode.taper", "a taper out of place");
            program_.taper = std::tan(value(1) * kDegree);
        } else if (w.size() == 2 && w[0] == "pivot") {
            if (program_.is_routed || is_set_ || !(value(1) > 0)) fail("gcode.pivot", "a pivot out of place");
            pivot_ = value(1);
        } else if (w.size() >= 5 && w[0] == "head" && w[1] == "on") {
            switches(text.substr(1, text.size() - 2));
        } else if (w.size() >= 4 && w[0] == "beside" && w[1] == "the" && w[2] == "head") {
            beside(std::string(text.substr(17, text.size() - 18)));
        } else if (w.size() == 9 && w[0] == "cut" && w[2] == "piece" && w[4] == "loop" && w[6] == "pass") {
            if (w[8] != "hole" && w[8] != "outline")
                fail("gcode.comment", "a cut that is neither hole nor outline");
            next_ = ReadWay{whole(3), whole(5), whole(7), w[8] == "hole", {}, 0, number_};
            named_ = true;
            is_engraving_ = false;
        }
    }

    struct Stated {
        std::string_view by;
        double value = 0, width = 0, depth = 0;
    };

    void engraver(const Stated& stated) {
        if (program_.engraver) fail("gcode.twice", "a second engraver");
        if (!has_stock_) fail("gcode.no_stock", "no comment says which stock it is for");
        ReadEngraver engraver;
        engraver.width = stated.width;
        engraver.depth = stated.depth;
        if (stated.by == "tool" && program_.is_routed) engraver.tool = static_cast<int>(stated.value);
        else if (stated.by == "power" && !program_.is_routed) engraver.power = stated.value;
        else if (stated.by == "feed" && !program_.is_routed) engraver.feed = stated.value;
        else
            fail("gcode.engraver",
                 "engraved by \"" + std::string(stated.by) + "\", which is no such thing here");
        if (!(stated.value > 0) || !(stated.width > 0) || !(stated.depth > 0))
            fail("gcode.number", "an engraver of nothing");
        program_.engraver = engraver;
    }

    /// "head on M62 P0 off M63 P0"
    void switches(std::string_view text) {
        const std::size_t off = text.find(" off ");
        if (off == std::string_view::npos || off < 8 || program_.is_routed || is_set_)
            fail("gcode.switch", "a comment that does not say what switches the head");
        on_text_ = text.substr(8, off - 8);
        off_text_ = text.substr(off + 5);
        if (!is_switch_pair(on_text_, off_text_)) fail("gcode.switch", "words that do not switch a head");
        for (const std::string& line : beside_) check_beside(line);
    }

    /// A line that switches something else: gas, dust, abrasive.
    void beside(std::string line) {
        if (is_set_) fail("gcode.switch", "words beside the head after its settings");
        check_beside(line);
        beside_.push_back(std::move(line));
    }
    void check_beside(const std::string& line) const {
        if (!is_switch(line) || switches_head(line, on_text_, off_text_))
            fail("gcode.switch", "words beside the head that do not switch something else");
    }

    ReadPiece& piece_of(int number) {
        for (ReadPiece& piece : program_.pieces)
            if (piece.number == number) return piece;
        fail("gcode.comment", fmt::format("piece {} is not placed before it is spoken of", number));
    }

    struct Block {
        double x = 0, y = 0, z = 0, a = 0, c = 0;
        double feed = -1, tool = -1, length = -1, p = -1;
        bool moves = false, moves_z = false, changes = false, offsets = false;
        std::uint32_t letters = 0;  ///< that stand in it, G aside
        unsigned groups = 0;        ///< of its G words
    };

    void words(std::string_view text) {
        if (!has_stock_) fail("gcode.no_stock", "no comment says which stock it is for");
        if (!program_.is_routed && (text == on_text_ || text == off_text_)) return switched(text == on_text_);
        if (std::find(beside_.begin(), beside_.end(), text) != beside_.end()) return;
        Block block{x_, y_, z_, a_, c_};
        for (const std::string_view word : split(text)) take(word, block);
        check_numbers(block);
        if (block.changes || block.offsets) change_tool(block);
        if (block.feed >= 0 && !(block.feed > 0)) fail("gcode.feed", "a feed of nothing");
        if (block.feed > 0) feed_ = block.feed;
        if (inverse_ && !rapid_ && block.moves && block.feed < 0)
            fail("gcode.feed", "a move without its time while G93 is in force");
        if (block.moves || block.moves_z) motion(block.x, block.y, block.z, block.a, block.c);
    }

    /// What belongs to a G word stands beside it, and nothing else does.
    void check_numbers(const Block& block) {
        const bool dwells = (block.groups >> kDwell & 1u) != 0, blends = (block.groups >> kPath & 1u) != 0;
        if (dwells && !(block.p >= 0)) fail("gcode.dwell", "a dwell without its time");
        if (dwells && on_ && (!program_.is_routed || block.p >= kLeastSpinUp)) is_ready_ = true;
        if (blends && !(block.p >= 0 && block.p <= kMostBlending))
            fail("gcode.path_mode", fmt::format("corners may be rounded by more than {} mm", kMostBlending));
        if ((block.letters >> ('P' - 'A') & 1u) != 0 && !dwells && !blends)
            fail("gcode.unused_word", "a P that belongs to no word");
        if (block.length >= 0 && !block.offsets) fail("gcode.unused_word", "an H that belongs to no word");
    }

    void take(std::string_view word, Block& block) {
        const double v = number_of(word.substr(1));
        if (word[0] >= 'A' && word[0] <= 'Z' && word[0] != 'G') {
            const std::uint32_t letter = 1u << (word[0] - 'A');
            if ((block.letters & letter) != 0)
                fail("gcode.twice", std::string("two words ") + word[0] + " in a line");
            block.letters |= letter;
        }
        switch (word[0]) {
            case 'G':
                g(v, block);
                break;
            case 'M':
                m(v);
                block.changes = block.changes || v == 6;
                break;
            case 'X':
                block.x = v, block.moves = true;
                break;
            case 'Y':
                block.y = v, block.moves = true;
                break;
            case 'Z':
                block.z = v, block.moves_z = true;
                break;
            case 'A':
                block.a = v, block.moves = true;
                break;
            case 'C':
                block.c = v, block.moves = true;
                break;
            case 'F':
                block.feed = v;
                break;
            case 'T':
                block.tool = v;
                break;
            case 'H':
                block.length = v;
                break;
            case 'S':
                if (!(v > 0))
                    fail(program_.is_routed ? "gcode.spindle" : "gcode.power", "a speed or power of nothing");
                power_ = v;
                break;
            case 'P':
                block.p = v;
                break;
            default:
                fail("gcode.unknown_word", std::string("no word ") + word[0] + " is known here");
        }
    }

    void change_tool(const Block& block) {
        if (block.changes) {
            if (!program_.is_routed) fail("gcode.unknown_word", "M6, and only a router changes its tool");
            if (z_ < 0) fail("gcode.tool", "a tool change with the cutter in the sheet");
            if (on_) fail("gcode.spindle", "a tool change with the spindle on");
            if (block.tool < 1) fail("gcode.tool", "a tool change that names no tool");
            tool_ = static_cast<int>(block.tool);
            has_length_ = on_ = false;
            z_ = NAN;
        }
        if (!block.offsets) return;
        if (block.length != tool_)
            fail("gcode.tool_length", "the length of a tool that is not in the spindle");
        has_length_ = true;
    }

    void motion(double x, double y, double z, double a, double c) {
        if (!is_set_)
            fail("gcode.unset",
                 "a motion before G17, G21, G40, G49, G54, G64, G90 and G94 have all been stated");
        if (!has_mode_) fail("gcode.unset", "a motion, and neither G0 nor G1 is in force");
        if (std::isnan(z)) fail("gcode.start", "a motion sideways before the height is stated");
        const bool is_sideways = (x != x_ && !std::isnan(x)) || (y != y_ && !std::isnan(y));
        if (is_sideways && std::isnan(z_))
            fail("gcode.start", "a motion sideways from a height that is not known");
        if (!rapid_ && (std::isnan(x) || std::isnan(y) || std::isnan(z_)))
            fail("gcode.start", "a cut from a place that is not known");
        if (!rapid_ && !(feed_ > 0)) fail("gcode.feed", "a cut without a feed");
        if (program_.is_routed && !has_length_)
            fail("gcode.tool_length", "a motion without the tool's length");
        const bool cuts = program_.is_routed ? z < 0 || z_ < 0 : on_;
        if (cuts && rapid_ && !(program_.is_routed && x == x_ && y == y_ && z >= z_))
            fail("gcode.rapid", "a rapid that cuts");
        if (cuts && (!on_ || (program_.is_routed && power_ == 0)))
            fail("gcode.spindle", "a cut with the spindle at rest");
        if (cuts && program_.is_routed && !is_ready_)
            fail("gcode.spin_up", "a cut before the spindle was given time to start (G4 P)");
        if (cuts && !program_.is_routed && !is_ready_ && !is_engraving_)
            fail("gcode.dwell", "a cut without a dwell where it pierces");
        if (!cuts && !program_.is_routed && is_sideways && !(tip_height(z_, a_) > kAtTop))
            fail("gcode.rapid", "a motion over the sheet with the head down");
        if (!cuts && !rapid_ && is_sideways)
            fail("gcode.air", "a motion that should cut and stays above the sheet, or has its head off");
        if (cuts && !program_.is_routed && std::abs(tip_height(z, a)) > kAtTop)
            fail("gcode.height", "the jet is on away from the sheet's top");
        if (program_.is_routed && (a != 0 || c != 0)) fail("gcode.head", "a router's head that leans");
        if (!(a >= 0) || a >= 85) fail("gcode.head", "the head leans to an angle that it cannot have");
        if (program_.is_routed && z < 0 && !(z_ < 0)) begin(x_, y_, a_, c_);
        x_ = x, y_ = y, z_ = z, a_ = a, c_ = c;
        if (!cuts || (program_.is_routed && rapid_)) return;  // or out of the sheet
        if (is_engraving_) engraved(head_at(x, y, a, c), z);
        else cut(head_at(x, y, a, c), z);
    }

    /// mm of a jet's tip over the sheet.
    [[nodiscard]] double tip_height(double z, double a) const {
        return z + pivot_ * (1 - std::cos(a * kDegree));
    }

    /// The head by where its axis meets the sheet's top, from where its pivot is.
    [[nodiscard]] ReadHead head_at(double x, double y, double a, double c) const {
        const double aside = pivot_ * std::sin(a * kDegree);
        return {x + aside * std::cos(c * kDegree), y + aside * std::sin(c * kDegree), a, c};
    }

    /// Between two places of the pivot the tip swings off its line by no more than the proof sees.
    void require_steady(const ReadHead& p, const ReadHead& q) const {
        constexpr double most = 0.01;  // mm
        const double turn =
            std::hypot(q.a - p.a, std::sin(std::max(p.a, q.a) * kDegree) * (q.c - p.c)) * kDegree;
        if (pivot_ * turn * turn / 8 > most)
            fail("gcode.pivot", "the head turns so far in one move that its tip leaves the line");
    }

    /// A depth's points, less its way back to where it went in.
    static std::span<const ReadHead> there(const std::vector<ReadHead>& points) {
        const bool is_back =
            points.size() > 1 && points.back().x == points[0].x && points.back().y == points[0].y;
        return {points.data(), points.size() - (is_back ? 1 : 0)};
    }

    /// The proof looks at the last depth of a cut; those before it go the same way.
    void require_alike_depths() const {
        if (depth_before_.empty()) return;
        const auto before = there(depth_before_), last = there(program_.ways.back().points);
        if (!std::equal(before.begin(), before.end(), last.begin(), last.end(),
                        [](const ReadHead& p, const ReadHead& q) { return p.x == q.x && p.y == q.y; }))
            fail("gcode.depths", "two depths of a cut go other ways");
    }

    void cut(const ReadHead& head, double z) {
        if (const auto& engraver = program_.engraver; engraver) {
            if (program_.is_routed && tool_ == engraver->tool && engraver->width != program_.kerf)
                fail("gcode.tool", "a cut with the engraver's tool");
            if (engraver->power > 0 && power_ <= engraver->power)
                fail("gcode.power", "a cut with no more power than the engraver's");
        }
        ReadWay& way = program_.ways.back();
        const ReadHead& last = way.points.back();
        require_steady(last, head);
        if (program_.is_routed && -z > way.deepest) {
            // The next depth begins where the cutter went in; only the last one is the cut.
            if (std::hypot(head.x - way.points[0].x, head.y - way.points[0].y) > 1e-9)
                fail("gcode.plunge", "the cutter goes deeper beside where it went in");
            way.deepest = -z;
            if (way.points.size() > 1) {
                require_alike_depths();
                depth_before_ = way.points;
            }
            way.points.resize(1);
            return;
        }
        const bool moved = last.x != head.x || last.y != head.y || last.a != head.a || last.c != head.c;
        if (moved || way.points.size() == 1) way.points.push_back(head);
    }

    void engraved(const ReadHead& head, double z) {
        const ReadEngraver& engraver = *program_.engraver;
        if (head.a != 0) fail("gcode.head", "an engraving with the head leaned");
        if (program_.is_routed && tool_ != engraver.tool)
            fail("gcode.tool", "an engraving with a tool that is not the engraver's");
        if (engraver.power > 0 && power_ != engraver.power)
            fail("gcode.power", "an engraving at another power than the engraver's");
        if (engraver.feed > 0 && feed_ != engraver.feed)
            fail("gcode.feed", "an engraving at another feed than the engraver's");
        ReadEngraving& engraving = program_.engravings.back();
        engraving.deepest = std::max(engraving.deepest, program_.is_routed ? -z : engraver.depth);
        engraving.strokes.back().push_back(head);
    }

    void switched(bool on) {
        if (on && on_) fail("gcode.switch", "the head is switched on twice");
        if (on && (std::isnan(x_) || std::isnan(y_) || std::isnan(z_)))
            fail("gcode.start", "a cut from a place that is not known");
        if (on) begin(x_, y_, a_, c_);
        on_ = on;
        is_ready_ = false;
    }

    void begin(double x, double y, double a, double c) {
        if (is_engraving_) {
            program_.engravings.back().strokes.push_back({head_at(x, y, a, c)});
            return;
        }
        if (!named_) fail("gcode.unnamed", "a cut that no comment names");
        require_alike_depths();
        depth_before_.clear();
        named_ = false;
        next_.points = {head_at(x, y, a, c)};
        program_.ways.push_back(next_);
    }

    void g(double v, Block& block) {
        const KnownWord* known = std::find_if(std::begin(kKnownWords), std::end(kKnownWords),
                                              [&](const KnownWord& word) { return word.number == v; });
        if (known == std::end(kKnownWords))
            fail("gcode.unknown_word", fmt::format("G{} is none of these programs' words", v));
        const unsigned group = 1u << known->group;
        if ((block.groups & group) != 0)
            fail("gcode.twice", fmt::format("G{} beside another word for the same in a line", v));
        block.groups |= group;
        stated_ |= group;
        is_set_ = (stated_ & kHead) == kHead;
        if (known->group == kMotion) has_mode_ = v != 80, rapid_ = v == 0;
        if (known->group == kFeedMode) inverse_ = v == 93;
        if (v == 43) block.offsets = true;
        if (v == 49) has_length_ = false;
    }

    void m(double v) {
        if (v == 2) {
            if (on_ && !program_.is_routed) fail("gcode.left_on", "the program ends with the jet on");
            if (z_ < 0 && program_.is_routed)
                fail("gcode.left_on", "the program ends with the cutter in the sheet");
            ended_ = true;
        } else if (program_.is_routed && (v == 3 || v == 5)) {
            if (v == 5 && z_ < 0) fail("gcode.spindle", "the spindle stops with the cutter in the sheet");
            on_ = v == 3;
            is_ready_ = false;
        } else if (v != 6) {
            fail("gcode.unknown_word", fmt::format("M{} is none of these programs' words", v));
        }
    }

    const Dialect dialect_ = dialect_of(Post::linuxcnc);
    ReadSheetProgram program_;
    ReadWay next_;
    std::vector<ReadHead> depth_before_;  // of the last way
    std::uint32_t number_ = 0;
    double x_ = NAN, y_ = NAN, z_ = NAN;  // until they are stated; Z again after a tool change
    double a_ = 0, c_ = 0, feed_ = 0, power_ = 0;
    double pivot_ = 0;  // mm
    int tool_ = 0;
    std::string on_text_ = "M3", off_text_ = "M5";
    std::vector<std::string> beside_;
    bool has_stock_ = false, ended_ = false, named_ = false, rapid_ = true, on_ = false, inverse_ = false;
    unsigned stated_ = 0;  // groups
    bool has_mode_ = false, is_set_ = false, has_length_ = false;
    bool is_engraving_ = false, is_ready_ = false;
};

}  // namespace

ReadSheetProgram read_sheet_program(std::string_view text, const std::string& file) {
    SheetReader reader(file);
    std::uint32_t number = 0;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        reader.line(text.substr(0, end), ++number);
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return reader.take();
}

}  // namespace slabwright
