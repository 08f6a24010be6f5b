#include "io/posts/gcode_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/text/decimal.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::size_t kPiece = std::size_t{1} << 20;

std::string decimal(double value, int decimals) {
    std::string text;
    append_rounded(text, value, decimals);
    return text;
}

/// What a program needs to be safe to start and to leave the spindle where the next one can start.
void require_safe(const Layer& layer, const Operation& operation, const Tool* tool) {
    const auto refuse = [&](const std::string& message) {
        throw Error(ErrorKind::no_plan, "program.unsafe",
                    fmt::format("{} of layer {}: {}", name(operation.kind), layer.index, message),
                    operation.file, "report this with the pattern and the job");
    };
    if (tool == nullptr) refuse(fmt::format("tool {} is not in the library", operation.tool));
    if (!(operation.spindle_rpm >= 1)) refuse("the spindle does not turn");
    const std::vector<Move>& moves = operation.moves;
    const std::int32_t clearance = to_units(operation.clearance_z);
    if (moves.size() < 2) refuse("it has no moves");
    if (moves.front().feed != 0 || moves.front().z != clearance)
        refuse("it does not begin with a rapid to the clearance height");
    const Move &last = moves.back(), &before = moves[moves.size() - 2];
    if (last.feed != 0 || last.z != clearance || last.x != before.x || last.y != before.y)
        refuse("it does not end with a Z-only rapid to the clearance height");
    for (std::size_t i = 0; i < moves.size(); ++i) {
        const Move& arc = moves[i];
        if (!arc.is_arc()) continue;
        if (i == 0 || arc.feed == 0 || arc.z != moves[i - 1].z) refuse("an arc is rapid or leaves its plane");
        if (std::abs(arc_shape(moves[i - 1], arc).sweep) >= std::numbers::pi * (1 - 1e-9) ||
            (arc.x == moves[i - 1].x && arc.y == moves[i - 1].y))
            refuse("an arc turns by half a circle or more");
    }
}

/// Writes modal motion: a word appears when its value changes, and G when the kind of motion does.
class MotionText {
public:
    MotionText(std::string& text, std::int64_t z_origin) : text_(text), z_origin_(z_origin) {}

    /// A motion in Z alone, always spelled out with its G0: the first and the last of a program.
    void rapid_z(std::int64_t z) {
        text_ += "G0 Z";
        append_mm(text_, z - z_origin_);
        text_ += '\n';
        motion_ = 0;
        z_ = z;
    }
    /// Where x and y are unknown (at the start of a program) both are written.
    void move(const Move& to) {
        const bool x = !xy_known_ || to.x != x_, y = !xy_known_ || to.y != y_, z = to.z != z_;
        if (!x && !y && !z) return;
        int motion = to.feed == 0 ? 0 : 1;
        if (to.is_arc()) {  // against the clock (G3) where the centre lies left of the chord
            const std::int64_t dx = to.x - x_, dy = to.y - y_;
            motion = dx * to.j > dy * to.i ? 3 : 2;
        }
        if (motion != motion_) {
            text_ += 'G';
            text_ += static_cast<char>('0' + motion);
            text_ += ' ';
            motion_ = motion;
        }
        const std::size_t start = text_.size();
        if (x) word('X', to.x, start);
        if (y) word('Y', to.y, start);
        if (z) word('Z', to.z - z_origin_, start);
        if (to.is_arc()) {
            word('I', to.i, start);
            word('J', to.j, start);
        }
        if (motion != 0 && to.feed != feed_) {
            feed_ = to.feed;
            text_ += fmt::format(" F{}", feed_);
        }
        text_ += '\n';
        x_ = to.x;
        y_ = to.y;
        z_ = to.z;
        xy_known_ = true;
    }

private:
    void word(char letter, std::int64_t units, std::size_t start) {
        if (text_.size() != start) text_ += ' ';
        text_ += letter;
        append_mm(text_, units);
    }
    std::string& text_;
    std::int64_t z_origin_, x_ = 0, y_ = 0, z_ = 0;
    bool xy_known_ = false;
    int motion_ = -1;
    std::uint32_t feed_ = 0;
};

}  // namespace

std::string comment_text(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (out.size() == 200) break;
        const unsigned char byte = static_cast<unsigned char>(c);
        if (c == '(') out += '[';
        else if (c == ')') out += ']';
        else if (byte >= 0x80 && byte < 0xC0)
            continue;  // inside a UTF-8 letter: one mark for the whole letter
        else out += byte >= 0x80 ? '?' : byte < 0x20 || byte == 0x7F ? ' ' : c;
    }
    return out;
}

namespace {

// As write_program; stops before the first line after move `until`, with a piece that ends there.
// @param lines gets the line of each move, 0 where it has none; may be null
void write_until(const Plan& plan, const Layer& layer, const Operation& operation, const TextSink& sink,
                 std::size_t until, std::vector<std::uint32_t>* lines = nullptr) {
    const std::vector<Tool>& tools = plan.job.tools;
    const auto tool =
        std::find_if(tools.begin(), tools.end(), [&](const Tool& t) { return t.number == operation.tool; });
    require_safe(layer, operation, tool == tools.end() ? nullptr : &*tool);

    const bool layer_top = frame_of(plan.job.machine) == Frame::layer_top;
    std::string text;
    text.reserve(kPiece + 4096);
    const auto comment = [&](const std::string& line) { text += fmt::format("({})\n", comment_text(line)); };
    comment(fmt::format("Slabwright {}: {}", SLABWRIGHT_VERSION, operation.file));
    comment(fmt::format("pattern {}", plan.input.file));
    comment(fmt::format("layer {} of {}, z {} to {} mm from the pattern's bottom", layer.index,
                        plan.layers.size(), decimal(layer.z_bottom, 4), decimal(layer.z_top, 4)));
    comment(fmt::format("z = 0 at {}", layer_top ? "the layer's top" : "the pattern's bottom"));
    comment(fmt::format("{}: {}", name(operation.kind), operation.purpose));
    comment(fmt::format("tool {}: {}, diameter {} mm", tool->number, tool->name, decimal(tool->diameter, 4)));
    comment(fmt::format("cutting {} mm, {} min", decimal(operation.cutting_mm, 1),
                        decimal(operation.minutes, 2)));
    text += fmt::format(
        "G21 G17 G90 G94 G40 G49 G80\nG8 G97\nG64 P{3} Q0\nG54\nT{0} M6\nG43 H{0}\nS{1} M3\nG4 P{2}\n",
        tool->number, decimal(operation.spindle_rpm, 0), decimal(plan.job.machine.spindle_dwell_s, 3),
        decimal(operation.blend, 4));

    const std::vector<Move>& moves = operation.moves;
    // Centres count from where an arc begins, whatever the program before has left in force.
    if (std::any_of(moves.begin(), moves.end(), [](const Move& m) { return m.is_arc(); })) text += "G91.1\n";
    const std::int32_t clearance = to_units(operation.clearance_z);
    MotionText motion(text, layer_top ? to_units(layer.z_top) : 0);
    motion.rapid_z(clearance);
    auto line = static_cast<std::uint32_t>(std::count(text.begin(), text.end(), '\n'));
    if (lines != nullptr) lines->assign(moves.size(), 0);
    const auto write = [&](std::size_t i) {
        const std::size_t size = text.size();
        motion.move(moves[i]);
        if (text.size() == size) return;
        ++line;
        if (lines != nullptr) (*lines)[i] = line;
    };
    // The first move's x and y are where the program's work starts. The next move goes there by itself when
    // it is a rapid at clearance height; else the tool is brought over that place before it may go down.
    if (moves[1].feed != 0 || moves[1].z != clearance) write(0);
    for (std::size_t i = 1; i + 1 < moves.size(); ++i) {
        write(i);
        if (text.size() >= kPiece || i == until) {
            sink(text);
            text.clear();
            if (i == until) return;
        }
    }
    motion.rapid_z(clearance);
    text += "M5\nM2\n";
    sink(text);
}

}  // namespace

void write_program(const Plan& plan, const Layer& layer, const Operation& operation, const TextSink& sink) {
    write_until(plan, layer, operation, sink, operation.moves.size());
}

std::size_t program_line(const Plan& plan, const Layer& layer, const Operation& operation, std::size_t move) {
    if (move == 0 || move + 1 >= operation.moves.size()) return 0;
    const auto lines = [&](std::size_t until) {
        std::size_t count = 0;
        write_until(
            plan, layer, operation,
            [&](std::string_view piece) {
                count += static_cast<std::size_t>(std::count(piece.begin(), piece.end(), '\n'));
            },
            until);
        return count;
    };
    const std::size_t line = lines(move);
    return move == 1 || lines(move - 1) < line ? line : 0;
}

std::vector<std::uint32_t> move_lines(const Plan& plan, const Layer& layer, const Operation& operation) {
    std::vector<std::uint32_t> lines;
    write_until(
        plan, layer, operation, [](std::string_view) {}, operation.moves.size(), &lines);
    return lines;
}

std::string program_text(const Plan& plan, const Layer& layer, const Operation& operation) {
    std::string text;
    write_program(plan, layer, operation, [&](std::string_view piece) { text += piece; });
    return text;
}

}  // namespace slabwright
