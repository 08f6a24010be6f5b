#include "io/posts/gcode_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/posts/dialect.h"
#include "io/posts/program_grid.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::size_t kPiece = std::size_t{1} << 20;

/// What a program needs to be safe to start and to leave the spindle where the next one can start.
void require_safe(const Layer& layer, const Operation& operation, const Tool* tool, const Dialect& dialect) {
    const auto refuse = [&](const std::string& message) {
        throw Error(ErrorKind::no_plan, "program.unsafe",
                    fmt::format("{} of layer {}: {}", name(operation.kind), layer.index, message),
                    operation.file, "report this with the pattern and the job");
    };
    if (tool == nullptr) refuse(fmt::format("tool {} is not in the library", operation.tool));
    if (!(operation.spindle_rpm >= 1)) refuse("the spindle does not turn");
    if (dialect.numbered && (operation.number < 1 || operation.number > 9999))
        refuse(fmt::format("{} takes no program O{}", dialect.name, operation.number));
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
    MotionText(std::string& text, const Dialect& dialect, const ProgramOrigin& origin, std::size_t blocks)
        : text_(text), dialect_(dialect), grid_(dialect), moves_(grid_, origin), blocks_(blocks) {}

    /// The first motion, in Z alone, by the dialect's template, which is given the height as a text.
    template <class Template>
    void begin(std::int64_t z, Template&& filled) {
        std::string height;
        grid_.append(height, z_ = moves_.height(z));
        begin_block();
        text_ += filled(height);
        motion_ = 0;
    }
    /// A motion in Z alone, always spelled out with its G0: the last of a program.
    void rapid_z(std::int64_t z) {
        begin_block();
        text_ += dialect_.conversational ? "L Z" : "G0 Z";
        grid_.append(text_, z_ = moves_.height(z));
        text_ += dialect_.conversational ? " FMAX\n" : "\n";
        motion_ = 0;
    }
    /// Where x and y are unknown (at the start of a program) both are written. @returns lines written
    std::uint32_t move(const Move& to) {
        const WrittenMove w = moves_.next(to);
        if (w.kind == WrittenMove::Kind::none) return 0;
        const std::uint32_t lines = dialect_.conversational ? conversational(to, w) : words(to, w);
        x_ = w.x;
        y_ = w.y;
        z_ = w.z;
        xy_known_ = true;
        return lines;
    }
    [[nodiscard]] std::size_t blocks() const { return blocks_; }

private:
    std::uint32_t words(const Move& to, const WrittenMove& w) {
        using Kind = WrittenMove::Kind;
        const int motion = to.feed == 0                        ? 0
                           : w.kind == Kind::counter_clockwise ? 3
                           : w.kind == Kind::clockwise         ? 2
                                                               : 1;
        if (motion > 1 && dialect_.radius_arcs) return by_radius(to, w, motion);
        if (motion != motion_ || dialect_.repeat_motion) {
            text_ += 'G';
            text_ += static_cast<char>('0' + motion);
            text_ += ' ';
            motion_ = motion;
        }
        const std::size_t start = text_.size();
        if (!xy_known_ || w.x != x_) word('X', w.x, start);
        if (!xy_known_ || w.y != y_) word('Y', w.y, start);
        if (w.z != z_) word('Z', w.z, start);
        if (motion > 1) {
            word('I', w.cx - x_, start);
            word('J', w.cy - y_, start);
        }
        if (motion != 0) feed(to.feed);
        text_ += '\n';
        return 1;
    }
    std::uint32_t by_radius(const Move& to, const WrittenMove& w, int motion) {
        const std::vector<RadiusArc> arcs = radius_arcs(x_, y_, w);
        for (const RadiusArc& arc : arcs) {
            if (motion != motion_ || dialect_.repeat_motion) text_ += fmt::format("G{} ", motion);
            motion_ = motion;
            const std::size_t start = text_.size();
            if (arc.x != x_) word('X', arc.x, start);
            if (arc.y != y_) word('Y', arc.y, start);
            word('R', arc.radius, start);
            feed(to.feed);
            text_ += '\n';
            x_ = arc.x;
            y_ = arc.y;
        }
        return static_cast<std::uint32_t>(arcs.size());
    }
    /// An arc is a block with its centre and one with its end.
    std::uint32_t conversational(const Move& to, const WrittenMove& w) {
        using Kind = WrittenMove::Kind;
        const bool arc = to.feed != 0 && w.kind != Kind::line;
        begin_block();
        if (arc) {
            text_ += "CC";
            word('X', w.cx, 0);
            word('Y', w.cy, 0);
            text_ += '\n';
            begin_block();
        }
        text_ += arc ? "C" : "L";
        if (arc || !xy_known_ || w.x != x_) word('X', w.x, 0);
        if (arc || !xy_known_ || w.y != y_) word('Y', w.y, 0);
        if (!arc && w.z != z_) word('Z', w.z, 0);
        if (arc) text_ += w.kind == Kind::clockwise ? " DR-" : " DR+";
        if (to.feed == 0) text_ += " FMAX";
        else feed(to.feed);
        text_ += '\n';
        return arc ? 2 : 1;
    }
    void feed(std::uint32_t feed) {
        if (feed == feed_) return;
        feed_ = feed;
        text_ += " F";
        text_ += grid_.feed(feed);
    }
    void begin_block() {
        if (dialect_.conversational) text_ += fmt::format("{} ", blocks_++);
    }
    void word(char letter, std::int64_t steps, std::size_t start) {
        if (text_.size() != start) text_ += ' ';
        text_ += letter;
        grid_.append(text_, steps);
    }
    std::string& text_;
    const Dialect& dialect_;
    ProgramGrid grid_;
    WrittenMoves moves_;
    std::size_t blocks_;
    std::int64_t x_ = 0, y_ = 0, z_ = 0;  // steps
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

/// A comment as a dialect takes it.
std::string comment_line(const Dialect& dialect, std::string_view text) {
    if (!dialect.parentheses && !dialect.semicolon) return {};
    std::string inside = comment_text(text);
    if (inside.size() > dialect.longest_comment) inside.resize(dialect.longest_comment);
    for (char& c : inside) {
        if (dialect.capitals && c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
        const bool plain = (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                           std::string_view(" .,:+-/=").find(c) != std::string_view::npos;
        if ((dialect.capitals && !plain) || dialect.forbidden.find(c) != std::string_view::npos) c = '-';
    }
    return dialect.parentheses ? "(" + inside + ")\n" : "; " + inside + "\n";
}

/// What a dialect's templates are filled with.
class Templates {
public:
    Templates(const Plan& plan, const Operation& operation, const Dialect& dialect)
        : unit_(unit_word(dialect)),
          name_(operation.file.substr(0, operation.file.rfind('.'))),
          blend_(ProgramGrid(dialect).length(operation.blend)),
          dwell_s_(plan.job.machine.spindle_dwell_s),
          operation_(operation) {
        append_rounded(speed_, operation.spindle_rpm, 0);
        append_rounded(dwell_, dwell_s_, 3);
        if (dialect.point && dwell_.find('.') == std::string::npos) dwell_ += '.';
    }
    [[nodiscard]] std::string filled(std::string_view text, const std::string& z = "") const {
        return fmt::format(fmt::runtime(text), fmt::arg("unit", unit_), fmt::arg("name", name_),
                           fmt::arg("number", operation_.number), fmt::arg("tool", operation_.tool),
                           fmt::arg("speed", speed_), fmt::arg("dwell", dwell_),
                           fmt::arg("dwell_ms", std::llround(dwell_s_ * 1000)), fmt::arg("blend", blend_),
                           fmt::arg("z", z));
    }

private:
    static std::string_view unit_word(const Dialect& dialect) {
        if (dialect.conversational) return dialect.inch() ? "INCH" : "MM";
        if (dialect.post == Post::siemens) return dialect.inch() ? "G700" : "G710";
        return dialect.inch() ? "G20" : "G21";
    }
    std::string_view unit_;
    std::string name_, speed_, dwell_, blend_;
    double dwell_s_;
    const Operation& operation_;
};

/// What a program says of the operation that follows.
std::vector<std::string> remarks(const Operation& operation, const Tool& tool) {
    return {
        fmt::format("{}: {}", name(operation.kind), operation.purpose),
        fmt::format("tool {}: {}, diameter {} mm", tool.number, tool.name, rounded_text(tool.diameter, 4)),
        fmt::format("cutting {} mm, {} min", rounded_text(operation.cutting_mm, 1),
                    rounded_text(operation.minutes, 2))};
}

/// What z = 0 is.
std::string_view height_words(Frame frame) {
    switch (frame) {
        case Frame::layer_top:
            return "the layer's top";
        case Frame::table_top:
            return "the machine table's top";
        case Frame::pattern_base:
        case Frame::automatic:
            break;
    }
    return "the pattern's bottom";
}

/// Where x = y = 0 lies; "" where the model has it.
std::string zero_words(const Machine& machine) {
    switch (machine.zero) {
        case WorkZero::corner:
            return "the base board's left front corner";
        case WorkZero::centre:
            return "the base board's middle";
        case WorkZero::pin:
            return fmt::format("the pin, x {} y {} mm from the base board's corner",
                               rounded_text(machine.pin.at(0), 3), rounded_text(machine.pin.at(1), 3));
        case WorkZero::model:
            break;
    }
    return "";
}

/// All that comes before the first motion of a program.
std::string head_text(const Plan& plan, const Layer& layer, const Operation& operation, const Tool& tool,
                      const Dialect& dialect) {
    const Templates templates(plan, operation, dialect);
    std::string text = templates.filled(dialect.begin);
    const auto comment = [&](const std::string& line) { text += comment_line(dialect, line); };
    comment(fmt::format("Slabwright {}: {}", SLABWRIGHT_VERSION, file_of(operation.file)));
    comment(fmt::format("pattern {}", plan.input.file));
    if (plan.turned)
        comment(fmt::format("side bottom of layer {}: the slab lies upside down, turned from left to right",
                            layer.index));
    else
        comment(fmt::format("layer {} of {}, z {} to {} mm from the pattern's bottom", layer.index,
                            plan.layers.size(), rounded_text(layer.z_bottom, 4),
                            rounded_text(layer.z_top, 4)));
    comment(fmt::format("z = 0 at {}", height_words(frame_of(plan.job.machine))));
    if (const std::string at = zero_words(plan.job.machine); !at.empty()) comment("x = y = 0 at " + at);
    for (const std::string& line : remarks(operation, tool)) comment(line);
    const std::string notes = templates.filled(dialect.notes);
    for (std::size_t at = 0; at < notes.size();) {
        const std::size_t end = std::min(notes.find('\n', at), notes.size());
        comment(notes.substr(at, end - at));
        at = end + 1;
    }
    return text + templates.filled(dialect.head);
}

/// All that comes before the first motion of a later operation of a program. @param before whose moves have
/// just ended, at clearance height
std::string next_text(const Plan& plan, const Operation& before, const Operation& operation, const Tool& tool,
                      const Dialect& dialect) {
    const Templates templates(plan, operation, dialect);
    std::string text;
    for (const std::string& line : remarks(operation, tool)) text += comment_line(dialect, line);
    text += templates.filled(operation.tool != before.tool ? dialect.change : dialect.again);
    return text + templates.filled(dialect.next);
}

/// The operation that comes before one in its program; none before the first.
const Operation* before_in_file(const Layer& layer, const Operation& operation) {
    if (part_of(operation.file) <= 1) return nullptr;
    const std::string name = fmt::format("{}#{}", file_of(operation.file), part_of(operation.file) - 1);
    const auto found = std::find_if(layer.operations.begin(), layer.operations.end(),
                                    [&](const Operation& o) { return o.file == name; });
    if (found == layer.operations.end())
        throw Error(ErrorKind::no_plan, "program.unsafe",
                    fmt::format("layer {} has nothing before {} in its program", layer.index, operation.file),
                    operation.file, "report this with the pattern and the job");
    return &*found;
}

bool is_last_of_file(const Layer& layer, const Operation& operation) {
    if (part_of(operation.file) == 0) return true;
    const std::string name = fmt::format("{}#{}", file_of(operation.file), part_of(operation.file) + 1);
    return std::none_of(layer.operations.begin(), layer.operations.end(),
                        [&](const Operation& o) { return o.file == name; });
}

/// Lines with numbers before them, from `first` on.
std::string in_blocks(const std::string& text, std::size_t first) {
    std::string out;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        out += fmt::format("{} {}\n", first++, text.substr(at, end - at));
        at = end + 1;
    }
    return out;
}

/// What a dialect puts around lines, whatever they say: numbers before them, carriage returns behind.
class LineDress {
public:
    /// @param line that the next one is, from 0
    LineDress(const Dialect& dialect, std::uint32_t line) : dialect_(dialect), line_(line) {}

    /// @param text whole lines. @returns what stands in the file, valid until the next call or as long as
    /// text
    std::string_view operator()(const std::string& text) {
        if (dialect_.line_numbers == 0 && !dialect_.carriage_returns) return text;
        dressed_.clear();
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = text.find('\n', at);
            if (dialect_.line_numbers != 0 && takes_number(text[at]))
                dressed_ += fmt::format("N{} ", number());
            dressed_.append(text, at, end - at);
            dressed_ += dialect_.carriage_returns ? "\r\n" : "\n";
            ++line_;
            at = end + 1;
        }
        return dressed_;
    }

private:
    /// Words do; comments, % marks and the program's own number do not.
    static bool takes_number(char first) { return first >= 'A' && first <= 'Z' && first != 'O'; }
    /// Five digits are what every control takes; after the last it begins anew.
    [[nodiscard]] std::uint32_t number() const {
        constexpr std::uint32_t kHighest = 99999;
        const auto step = static_cast<std::uint32_t>(dialect_.line_numbers);
        return step * (1 + line_ % (kHighest / step));
    }
    const Dialect& dialect_;
    std::uint32_t line_;
    std::string dressed_;
};

// As write_program; stops before the first line after move `until`, with a piece that ends there.
// @param lines_before that its program has before it
// @param lines gets the line of each move, 0 where it has none; may be null
void write_until(const Plan& plan, const Layer& layer, const Operation& operation, std::uint32_t lines_before,
                 const TextSink& sink, std::size_t until, std::vector<std::uint32_t>* lines = nullptr) {
    const std::vector<Tool>& tools = plan.job.tools;
    const auto tool =
        std::find_if(tools.begin(), tools.end(), [&](const Tool& t) { return t.number == operation.tool; });
    const Dialect dialect = dialect_of(plan.job.machine);
    require_safe(layer, operation, tool == tools.end() ? nullptr : &*tool, dialect);
    const Templates templates(plan, operation, dialect);
    std::string text;
    text.reserve(kPiece + 4096);
    const Operation* before = before_in_file(layer, operation);
    text += before == nullptr ? head_text(plan, layer, operation, *tool, dialect)
                              : next_text(plan, *before, operation, *tool, dialect);
    const std::vector<Move>& moves = operation.moves;
    // Centres count from where an arc begins, whatever the program before has left in force.
    if (std::any_of(moves.begin(), moves.end(), [](const Move& m) { return m.is_arc(); }))
        text += dialect.centres;
    auto line = lines_before + static_cast<std::uint32_t>(std::count(text.begin(), text.end(), '\n'));
    if (dialect.conversational) text = in_blocks(text, lines_before);
    const std::int32_t clearance = to_units(operation.clearance_z);
    MotionText motion(text, dialect, program_origin(plan, layer), line);
    LineDress dressed(dialect, lines_before);
    motion.begin(clearance, [&](const std::string& z) { return templates.filled(dialect.first, z); });
    ++line;
    if (lines != nullptr) lines->assign(moves.size(), 0);
    const auto write = [&](std::size_t i) {
        const std::uint32_t written = motion.move(moves[i]);
        line += written;
        if (written != 0 && lines != nullptr) (*lines)[i] = line;
    };
    // The first move's x and y are where the program's work starts. The next move goes there by itself when
    // it is a rapid at clearance height; else the tool is brought over that place before it may go down.
    if (moves[1].feed != 0 || moves[1].z != clearance) write(0);
    for (std::size_t i = 1; i + 1 < moves.size(); ++i) {
        write(i);
        if (text.size() >= kPiece || i == until) {
            sink(dressed(text));
            text.clear();
            if (i == until) return;
        }
    }
    motion.rapid_z(clearance);
    if (is_last_of_file(layer, operation)) {
        const std::string end = templates.filled(dialect.end);
        text += dialect.conversational ? in_blocks(end, motion.blocks()) : end;
    }
    sink(dressed(text));
}

std::uint32_t count_lines(std::string_view text) {
    return static_cast<std::uint32_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

std::uint32_t lines_before(const Plan& plan, const Layer& layer, const Operation& operation) {
    const Operation* before = before_in_file(layer, operation);
    if (before == nullptr) return 0;
    const std::uint32_t first = lines_before(plan, layer, *before);
    return first + line_count(plan, layer, *before, first);
}

std::uint32_t line_count(const Plan& plan, const Layer& layer, const Operation& operation,
                         std::uint32_t lines_before) {
    std::uint32_t count = 0;
    write_until(
        plan, layer, operation, lines_before, [&](std::string_view piece) { count += count_lines(piece); },
        operation.moves.size());
    return count;
}

void write_program(const Plan& plan, const Layer& layer, const Operation& operation, const TextSink& sink) {
    std::uint32_t before = lines_before(plan, layer, operation);
    write_until(plan, layer, operation, before, sink, operation.moves.size());
}

void write_file(const Plan& plan, const Layer& layer, std::size_t begin, const TextSink& sink) {
    std::uint32_t before = 0;
    const std::size_t end = file_end(layer, begin);
    for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t written = before;
        const auto count = [&](std::string_view piece) {
            before += count_lines(piece);
            sink(piece);
        };
        write_until(plan, layer, layer.operations[i], written, count, layer.operations[i].moves.size());
    }
}

std::size_t program_line(const Plan& plan, const Layer& layer, const Operation& operation, std::size_t move,
                         std::uint32_t lines_before) {
    if (move == 0 || move + 1 >= operation.moves.size()) return 0;
    const auto lines = [&](std::size_t until) {
        std::size_t count = lines_before;
        write_until(
            plan, layer, operation, lines_before,
            [&](std::string_view piece) { count += count_lines(piece); }, until);
        return count;
    };
    const std::size_t line = lines(move);
    return move == 1 || lines(move - 1) < line ? line : 0;
}

std::vector<std::uint32_t> move_lines(const Plan& plan, const Layer& layer, const Operation& operation) {
    std::vector<std::uint32_t> lines;
    write_until(
        plan, layer, operation, lines_before(plan, layer, operation), [](std::string_view) {},
        operation.moves.size(), &lines);
    return lines;
}

std::string program_text(const Plan& plan, const Layer& layer, const Operation& operation) {
    std::string text;
    write_program(plan, layer, operation, [&](std::string_view piece) { text += piece; });
    return text;
}

}  // namespace slabwright
