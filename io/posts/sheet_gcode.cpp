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

    void engrave(const SheetPiece& piece) {
        for (const Engraving& engraving : piece.engravings) {
            text_ += fmt::format("(engraving of piece {} {})\n", piece.number,
                                 engraving.text.empty() ? "mark" : engraving.text);
            for (const std::vector<Point2>& stroke : engraving.strokes) engrave(stroke, piece.place);
        }
    }

    void write(const SheetWay& way) {
        text_ += fmt::format("(cut of piece {} loop {} pass {} {})\n", way.piece, way.loop, way.pass,
                             way.is_hole ? "hole" : "outline");
        if (job_.head == SheetHead::router) routed(way);
        else jetted(way);
    }

private:
    void engrave(const std::vector<Point2>& stroke, const NestPlace& place) {
        const double feed = engraving_feed(job_);
        const bool is_router = job_.head == SheetHead::router, leans = job_.cutting.most_tilt_deg > 0;
        text_ += fmt::format("G0 {}{}\n", at(placed(stroke[0], place)), leans ? " A0 C0" : "");
        if (is_router)
            text_ += fmt::format("G0 Z1\nG1 Z{} F{}\n", rounded_text(-job_.engraving.depth, 4),
                                 rounded_text(job_.plunge_feed, 1));
        else text_ += fmt::format("G0 Z0\n{}\n", job_.on);
        for (std::size_t i = 1; i < stroke.size(); ++i)
            text_ += fmt::format("G1 {} F{}\n", at(placed(stroke[i], place)), rounded_text(feed, 1));
        if (!is_router) text_ += job_.off + '\n';
        text_ += fmt::format("G0 Z{}\n", rounded_text(job_.clearance, 4));
    }

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
            text_ += fmt::format("G1 Z{} F{}\n", rounded_text(-depth * s / steps, 4),
                                 rounded_text(job_.plunge_feed, 1));
            text_ += fmt::format("G1 {} F{}\n", at(way.points[0].top), rounded_text(way.feed, 1));
            for (std::size_t i = 1; i < way.points.size(); ++i) text_ += at(way.points[i].top) + '\n';
            if (s < steps) text_ += at(way.pierce) + '\n';
        }
        text_ += fmt::format("G0 Z{}\n", rounded_text(job_.clearance, 4));
    }

    /// X and Y that the control is told for the head where its axis meets the sheet's top.
    [[nodiscard]] std::string at_head(Point2 top, const HeadPoint& head) const {
        if (job_.pivot == 0) return at(top);
        const PivotPlace place = pivot_place(top, head.a_deg, head.c_deg, job_.pivot);
        return at({to_units(place.x), to_units(place.y)});
    }
    [[nodiscard]] std::string height_of(const HeadPoint& head) const {
        return rounded_text(pivot_place({}, head.a_deg, head.c_deg, job_.pivot).z, 4);
    }

    void jetted(const SheetWay& way) {
        const bool leans = job_.cutting.most_tilt_deg > 0;
        const HeadPoint& first = way.points[0];
        text_ += "G0 " + at_head(way.pierce, first);
        if (leans)
            text_ += fmt::format(" A{} C{}", rounded_text(first.a_deg, 4), rounded_text(first.c_deg, 4));
        text_ +=
            fmt::format("\nG0 Z{}\n{}\nG4 P{}\n", height_of(first), job_.on, rounded_text(job_.pierce_s, 3));
        text_ += fmt::format("G1 {} F{}\n", at_head(first.top, first), rounded_text(way.feed, 1));
        if (!turns(way)) {
            for (std::size_t i = 1; i < way.points.size(); ++i) {
                text_ += at_head(way.points[i].top, first);
                if (way.shares[i] != way.shares[i - 1])
                    text_ += " F" + rounded_text(way.feed * way.shares[i], 1);
                text_ += '\n';
            }
        } else {
            text_ += "G93\n";
            for (std::size_t i = 1; i < way.points.size(); ++i) turned(way, i);
            text_ += "G94\n";
        }
        text_ += fmt::format("{}\nG0 Z{}\n", job_.off, rounded_text(job_.clearance, 4));
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
        const double minutes = std::max({mm / way.feed / way.shares[i], degrees / 1800, 2e-6});
        const std::string height = job_.pivot > 0 ? " Z" + height_of(q) : "";
        text_ += fmt::format("G1 {}{} A{} C{} F{}\n", at_head(q.top, q), height, rounded_text(q.a_deg, 4),
                             rounded_text(q.c_deg, 4), rounded_text(1 / minutes, 4));
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
        text += fmt::format(" diameter {})\n", rounded_text(dowel, 4));
    }
}

bool is_engraved(const SheetsPlan& plan, const SheetProgram& program) {
    return std::any_of(program.pieces.begin(), program.pieces.end(), [&](int number) {
        return !plan.pieces[static_cast<std::size_t>(number) - 1].engravings.empty();
    });
}

/// With what it is engraved.
std::string engraver(const SheetJob& job) {
    const std::string by = job.head == SheetHead::router  ? fmt::format("tool {}", job.engraving.tool)
                           : job.head == SheetHead::laser ? "power " + rounded_text(job.engraving.power, 3)
                                                          : "feed " + rounded_text(engraving_feed(job), 1);
    return fmt::format("(engraver {} width {} depth {})\n", by, rounded_text(job.engraving.width, 4),
                       rounded_text(job.engraving.depth, 4));
}

std::string tool_change(const SheetJob& job, int tool) {
    return fmt::format("T{} M6\nG43 H{}\nS{} M3\nG4 P3\n", tool, tool, rounded_text(job.rpm, 0));
}

}  // namespace

std::string sheet_program_text(const SheetsPlan& plan, std::size_t index) {
    const SheetProgram& program = plan.programs[index];
    const SheetJob& job = plan.job;
    std::string text = fmt::format(
        "(slabwright sheets: program {} of {})\n(stock {} x {} thickness {} kerf {} {})\n", index + 1,
        plan.programs.size(), rounded_text(program.stock.length, 4), rounded_text(program.stock.width, 4),
        rounded_text(program.thickness, 4), rounded_text(job.cutting.kerf, 4), word_of_head(job.head));
    for (const int number : program.pieces) {
        const SheetPiece& piece = plan.pieces[static_cast<std::size_t>(number) - 1];
        std::string x, y;
        append_mm(x, piece.place.shift.x);
        append_mm(y, piece.place.shift.y);
        text += fmt::format("(piece {} from {} to {} turn {} at {} {})\n", number,
                            rounded_text(piece.span.bottom, 4), rounded_text(piece.span.top, 4),
                            piece.place.turn, x, y);
    }
    for (const int number : program.pieces)
        append_hold(text, plan.pieces[static_cast<std::size_t>(number) - 1], job.alignment.dowel);
    const bool is_router = job.head == SheetHead::router, engraves = is_engraved(plan, program);
    if (engraves) text += engraver(job);
    if (job.cutting.taper_deg != 0)
        text += fmt::format("(taper {})\n", rounded_text(job.cutting.taper_deg, 4));
    if (job.pivot > 0) text += fmt::format("(pivot {})\n", rounded_text(job.pivot, 4));
    if (!is_router && (job.on != "M3" || job.off != "M5"))
        text += fmt::format("(head on {} off {})\n", job.on, job.off);
    std::vector<std::string> beside = job.begin;
    beside.insert(beside.end(), job.end.begin(), job.end.end());
    for (const std::string& line : beside) text += fmt::format("(beside the head {})\n", line);
    text += "G21 G17 G90 G94 G40 G49 G80\nG64 P0.005\nG54\n";
    if (is_router) text += tool_change(job, engraves ? job.engraving.tool : job.tool);
    for (const std::string& line : job.begin) text += line + '\n';
    text += fmt::format("G0 Z{}\n", rounded_text(job.clearance, 4));
    WayText ways(text, job, program);
    if (engraves) {
        if (job.head == SheetHead::laser) text += fmt::format("S{}\n", rounded_text(job.engraving.power, 3));
        for (const int number : program.pieces)
            ways.engrave(plan.pieces[static_cast<std::size_t>(number) - 1]);
        if (is_router && job.engraving.tool != job.tool)
            text +=
                "M5\n" + tool_change(job, job.tool) + fmt::format("G0 Z{}\n", rounded_text(job.clearance, 4));
        if (job.head == SheetHead::laser) text += fmt::format("S{}\n", rounded_text(job.power, 3));
    }
    for (const SheetWay& way : program.ways) ways.write(way);
    for (const std::string& line : job.end) text += line + '\n';
    if (is_router) text += "M5\n";
    return text + "M2\n";
}

}  // namespace slabwright
