#include "io/posts/sheet_gcode.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "io/text/decimal.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

std::string decimal(double value, int decimals) {
    std::string text;
    append_rounded(text, value, decimals);
    return text;
}

std::string at(Point2 p) {
    std::string text = "X";
    append_mm(text, p.x);
    text += " Y";
    append_mm(text, p.y);
    return text;
}

const char* word_of_head(SheetHead head) {
    return head == SheetHead::router ? "router" : head == SheetHead::laser ? "laser" : "jet";
}

/// Writes the motion of one way.
class WayText {
public:
    WayText(std::string& text, const SheetJob& job, const SheetProgram& program)
        : text_(text), job_(job), program_(program) {}

    void write(const SheetWay& way) {
        text_ += fmt::format("(cut of piece {} loop {} pass {} {})\n", way.piece, way.loop, way.pass,
                             way.is_hole ? "hole" : "outline");
        if (job_.head == SheetHead::router) routed(way);
        else jetted(way);
    }

private:
    static bool turns(const SheetWay& way) {
        const HeadPoint& first = way.points[0];
        return std::any_of(way.points.begin(), way.points.end(), [&](const HeadPoint& p) {
            return p.a_deg != first.a_deg || p.c_deg != first.c_deg;
        });
    }

    void routed(const SheetWay& way) {
        const double depth = program_.thickness + job_.through;
        const int steps = std::max(1, static_cast<int>(std::ceil(depth / job_.stepdown - 1e-9)));
        text_ += fmt::format("G0 {}\nG0 Z1\n", at(way.pierce));
        for (int s = 1; s <= steps; ++s) {
            text_ +=
                fmt::format("G1 Z{} F{}\n", decimal(-depth * s / steps, 4), decimal(job_.plunge_feed, 1));
            text_ += fmt::format("G1 {} F{}\n", at(way.points[0].top), decimal(way.feed, 1));
            for (std::size_t i = 1; i < way.points.size(); ++i) text_ += at(way.points[i].top) + '\n';
            if (s < steps) text_ += at(way.pierce) + '\n';
        }
        text_ += fmt::format("G0 Z{}\n", decimal(job_.clearance, 4));
    }

    void jetted(const SheetWay& way) {
        const bool leans = job_.cutting.most_tilt_deg > 0;
        const HeadPoint& first = way.points[0];
        text_ += fmt::format("G0 {}", at(way.pierce));
        if (leans) text_ += fmt::format(" A{} C{}", decimal(first.a_deg, 4), decimal(first.c_deg, 4));
        text_ += fmt::format("\nG0 Z0\nM3\nG4 P{}\n", decimal(job_.pierce_s, 3));
        text_ += fmt::format("G1 {} F{}\n", at(first.top), decimal(way.feed, 1));
        if (!turns(way)) {
            for (std::size_t i = 1; i < way.points.size(); ++i) text_ += at(way.points[i].top) + '\n';
        } else {
            text_ += "G93\n";
            for (std::size_t i = 1; i < way.points.size(); ++i) turned(way, i);
            text_ += "G94\n";
        }
        text_ += fmt::format("M5\nG0 Z{}\n", decimal(job_.clearance, 4));
    }

    /// One move whose time is that of the longer of its two ends, and of the head's turn at 30 degrees a
    /// second.
    void turned(const SheetWay& way, std::size_t i) {
        const HeadPoint &p = way.points[i - 1], &q = way.points[i];
        const auto apart = [](Point2 a, Point2 b) {
            return std::hypot(to_mm(a.x) - to_mm(b.x), to_mm(a.y) - to_mm(b.y));
        };
        const double mm = std::max(apart(p.top, q.top),
                                   apart(bottom_of(p, program_.thickness), bottom_of(q, program_.thickness)));
        const double degrees = std::max(std::abs(q.a_deg - p.a_deg), std::abs(q.c_deg - p.c_deg));
        const double minutes = std::max({mm / way.feed, degrees / 1800, 2e-6});
        text_ += fmt::format("G1 {} A{} C{} F{}\n", at(q.top), decimal(q.a_deg, 4), decimal(q.c_deg, 4),
                             decimal(1 / minutes, 4));
    }

    std::string& text_;
    const SheetJob& job_;
    const SheetProgram& program_;
};

/// What holds a piece, in the part's frame.
void append_hold(std::string& text, const SheetPiece& piece, double dowel) {
    for (std::size_t l = 0; l < piece.hold.added.size(); ++l) {
        text += fmt::format("(tab of piece {}", piece.number);
        for (const Point2 p : piece.hold.added.loop(l)) {
            append_mm(text += ' ', p.x);
            append_mm(text += ' ', p.y);
        }
        text += ")\n";
    }
    for (const Point2 hole : piece.hold.holes) {
        text += fmt::format("(dowel of piece {} at ", piece.number);
        append_mm(text, hole.x);
        append_mm(text += ' ', hole.y);
        text += fmt::format(" diameter {})\n", decimal(dowel, 4));
    }
}

}  // namespace

std::string sheet_program_text(const SheetsPlan& plan, std::size_t index) {
    const SheetProgram& program = plan.programs[index];
    const SheetJob& job = plan.job;
    std::string text = fmt::format(
        "(slabwright sheets: program {} of {})\n(stock {} x {} thickness {} kerf {} {})\n", index + 1,
        plan.programs.size(), decimal(program.stock.length, 4), decimal(program.stock.width, 4),
        decimal(program.thickness, 4), decimal(job.cutting.kerf, 4), word_of_head(job.head));
    for (const int number : program.pieces) {
        const SheetPiece& piece = plan.pieces[static_cast<std::size_t>(number) - 1];
        std::string x, y;
        append_mm(x, piece.place.shift.x);
        append_mm(y, piece.place.shift.y);
        text +=
            fmt::format("(piece {} from {} to {} turn {} at {} {})\n", number, decimal(piece.span.bottom, 4),
                        decimal(piece.span.top, 4), piece.place.turn, x, y);
    }
    for (const int number : program.pieces)
        append_hold(text, plan.pieces[static_cast<std::size_t>(number) - 1], job.alignment.dowel);
    text += "G21 G17 G90 G94 G40 G49 G80\nG64 P0.005\nG54\n";
    if (job.head == SheetHead::router)
        text += fmt::format("T{} M6\nG43 H{}\nS{} M3\nG4 P3\n", job.tool, job.tool, decimal(job.rpm, 0));
    text += fmt::format("G0 Z{}\n", decimal(job.clearance, 4));
    WayText ways(text, job, program);
    for (const SheetWay& way : program.ways) ways.write(way);
    if (job.head == SheetHead::router) text += "M5\n";
    return text + "M2\n";
}

namespace {

/// Reads one program line by line.
class SheetReader {
public:
    explicit SheetReader(const std::string& file) { program_.file = file; }

    void line(std::string_view text, std::uint32_t number) {
        number_ = number;
        if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
        if (ended_ && !text.empty()) fail("gcode.after_end", "words after the program's end");
        if (!text.empty() && text.front() == '(') comment(text);
        else if (!text.empty()) words(text);
    }

    ReadSheetProgram take() {
        if (!has_stock_) fail("gcode.no_stock", "no comment says which stock it is for");
        if (!ended_) fail("gcode.no_end", "the program ends without M2");
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
        if (text.back() != ')') fail("gcode.comment", "a comment that does not end in its line");
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
        } else if (w.size() == 9 && w[0] == "cut" && w[2] == "piece" && w[4] == "loop" && w[6] == "pass") {
            if (w[8] != "hole" && w[8] != "outline")
                fail("gcode.comment", "a cut that is neither hole nor outline");
            next_ = ReadWay{whole(3), whole(5), whole(7), w[8] == "hole", {}, 0, number_};
            named_ = true;
        }
    }

    ReadPiece& piece_of(int number) {
        for (ReadPiece& piece : program_.pieces)
            if (piece.number == number) return piece;
        fail("gcode.comment", fmt::format("piece {} is not placed before it is spoken of", number));
    }

    void words(std::string_view text) {
        double x = x_, y = y_, z = z_, a = a_, c = c_;
        if (!has_stock_) fail("gcode.no_stock", "no comment says which stock it is for");
        bool moves = false, moves_z = false;
        double feed = -1;
        for (const std::string_view word : split(text)) {
            const double v = number_of(word.substr(1));
            switch (word[0]) {
                case 'G':
                    g(v);
                    break;
                case 'M':
                    m(v);
                    break;
                case 'X':
                    x = v, moves = true;
                    break;
                case 'Y':
                    y = v, moves = true;
                    break;
                case 'Z':
                    z = v, moves_z = true;
                    break;
                case 'A':
                    a = v, moves = true;
                    break;
                case 'C':
                    c = v, moves = true;
                    break;
                case 'F':
                    feed = v;
                    break;
                case 'P':
                case 'T':
                case 'H':
                case 'S':
                    break;
                default:
                    fail("gcode.unknown_word", std::string("no word ") + word[0] + " is known here");
            }
        }
        if (feed >= 0 && !(feed > 0)) fail("gcode.feed", "a feed of nothing");
        if (feed > 0) has_feed_ = true;
        if (inverse_ && !rapid_ && moves && feed < 0)
            fail("gcode.feed", "a move without its time while G93 is in force");
        if (moves || moves_z) motion(x, y, z, a, c);
    }

    void motion(double x, double y, double z, double a, double c) {
        if (!is_set_) fail("gcode.unset", "a motion before units, plane and distances are stated");
        if (!rapid_ && !has_feed_) fail("gcode.feed", "a cut without a feed");
        const bool cuts = program_.is_routed ? z < 0 || z_ < 0 : on_;
        if (cuts && rapid_ && !(program_.is_routed && x == x_ && y == y_ && z >= z_))
            fail("gcode.rapid", "a rapid that cuts");
        if (cuts && (!program_.is_routed && z != 0))
            fail("gcode.height", "the jet is on away from the sheet's top");
        if (program_.is_routed && (a != 0 || c != 0)) fail("gcode.head", "a router's head that leans");
        if (!(a >= 0) || a >= 85) fail("gcode.head", "the head leans to an angle that it cannot have");
        if (program_.is_routed && z < 0 && z_ >= 0) begin(x_, y_, a_, c_);
        x_ = x, y_ = y, z_ = z, a_ = a, c_ = c;
        if (!cuts || program_.ways.empty()) return;
        ReadWay& way = program_.ways.back();
        if (program_.is_routed && rapid_) return;  // out of the sheet
        const ReadHead head{x, y, a, c};
        const ReadHead& last = way.points.back();
        if (program_.is_routed && -z > way.deepest) {
            // The next depth begins where the cutter went in; only the last one is the cut.
            if (std::hypot(x - way.points[0].x, y - way.points[0].y) > 1e-9)
                fail("gcode.plunge", "the cutter goes deeper beside where it went in");
            way.deepest = -z;
            way.points.resize(1);
            return;
        }
        const bool moved = last.x != head.x || last.y != head.y || last.a != head.a || last.c != head.c;
        if (moved || way.points.size() == 1) way.points.push_back(head);
    }

    void begin(double x, double y, double a, double c) {
        if (!named_) fail("gcode.unnamed", "a cut that no comment names");
        named_ = false;
        next_.points = {{x, y, a, c}};
        program_.ways.push_back(next_);
    }

    void g(double v) {
        static constexpr double known[] = {4, 17, 21, 40, 43, 49, 54, 64, 80, 90};
        if (v == 0) rapid_ = true;
        else if (v == 1) rapid_ = false;
        else if (v == 93) inverse_ = true;
        else if (v == 94) inverse_ = false;
        else if (std::find(std::begin(known), std::end(known), v) == std::end(known))
            fail("gcode.unknown_word", fmt::format("G{} is none of these programs' words", v));
        if (v == 21) has_mm_ = true;
        if (v == 90) has_absolute_ = true;
        is_set_ = has_mm_ && has_absolute_;
    }

    void m(double v) {
        if (v == 2) {
            if (on_ && !program_.is_routed) fail("gcode.left_on", "the program ends with the jet on");
            ended_ = true;
        } else if (v == 3) {
            if (!program_.is_routed) begin(x_, y_, a_, c_);
            on_ = true;
        } else if (v == 5) {
            on_ = false;
        } else if (v != 6) {
            fail("gcode.unknown_word", fmt::format("M{} is none of these programs' words", v));
        }
    }

    ReadSheetProgram program_;
    ReadWay next_;
    std::uint32_t number_ = 0;
    double x_ = 0, y_ = 0, z_ = 1e9, a_ = 0, c_ = 0;
    bool has_stock_ = false, ended_ = false, named_ = false, rapid_ = true, on_ = false, inverse_ = false;
    bool has_mm_ = false, has_absolute_ = false, is_set_ = false, has_feed_ = false;
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
