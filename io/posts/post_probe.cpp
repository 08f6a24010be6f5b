#include "io/posts/post_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/program_check.h"
#include "io/posts/program_grid.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kNear = 1.3e-3;             // mm: half a step of 0.001 mm, or of 0.0001 in
constexpr double kNearCentre = 0.02;         // mm: what coarse steps move an arc's centre
constexpr double kTop = 37;                  // mm, of the probes' layer
constexpr double kAbove[] = {10, 10, 12.5};  // mm over it: the clearance of each operation
constexpr int kTools[] = {7, 12};

/// A motion as a program makes it; an arc is one, however many lines or chords it has.
struct ProbeMotion {
    double x = 0, y = 0, z = 0, feed = 0;
    bool arc = false;
    double cx = 0, cy = 0, turn = 0;  // of an arc
    std::uint32_t line = 0;
};

/// Moves from place to place, mm from the layer's top.
class ProbeMoves {
public:
    ProbeMoves(double above, double x, double y)
        : above_(above), at_{units(x), units(y), units(kTop + above)} {
        moves_ = {at_, at_};
    }
    ProbeMoves& to(double x, double y, double z, std::uint32_t feed) {
        at_ = {units(x), units(y), units(kTop + z), feed};
        moves_.push_back(at_);
        return *this;
    }
    /// @param begin where on its circle it begins, degrees
    ProbeMoves& arc(double radius, double begin, double sweep, std::uint32_t feed) {
        const double a = begin * std::numbers::pi / 180, b = (begin + sweep) * std::numbers::pi / 180;
        at_.i = units(-radius * std::cos(a));
        at_.j = units(-radius * std::sin(a));
        at_.x += at_.i + units(radius * std::cos(b));
        at_.y += at_.j + units(radius * std::sin(b));
        at_.feed = feed;
        moves_.push_back(at_);
        at_.i = at_.j = 0;
        return *this;
    }
    std::vector<Move> end() {
        at_.z = units(kTop + above_);
        at_.feed = 0;
        moves_.push_back(at_);
        return moves_;
    }

private:
    static std::int32_t units(double mm) { return static_cast<std::int32_t>(to_units(mm)); }
    double above_;
    std::vector<Move> moves_;
    Move at_;
};

std::vector<Move> moves_of(int operation) {
    const double above = kAbove[operation];
    switch (operation) {
        case 0:  // signs, decimals, whole numbers, all axes
            return ProbeMoves(above, -12.3456, 7)
                .to(-12.3456, 7, 0.003, 0)
                .to(-12.3456, 7, -0.003, 777)
                .to(100, 7, -0.003, 9000)
                .to(100, -0.003, -0.003, 9000)
                .to(0.003, -100, -0.003, 1)
                .to(250.1254, -250.1254, -5.5446, 1501)
                .to(0, 0, -1, 1501)
                .to(-2134.5684, -1134.5684, -18.4324, 8999)
                .end();
        case 1:  // arcs
            return ProbeMoves(above, 10, -3)
                .to(10, -3, -2, 500)
                .arc(10, 0, 90, 3000)
                .arc(25.4, 200, -171, 3000)
                .to(-30, 40.0044, -2, 3000)
                .arc(0.5, 90, 120, 600)
                .arc(812.3, -10, -20, 4000)
                .end();
        default:
            return ProbeMoves(above, -1, -1).to(-1, -1, -3.25, 1200).to(1, 1, -3.25, 1200).end();
    }
}

/// A plan of three operations: the second with the tool of the first, the third with another.
Plan probe_plan(const Machine& machine, double dwell_s) {
    Plan plan;
    plan.input.file = std::string(300, 'p') + ".stl";  // a comment as long as may be
    plan.job.machine = machine;
    plan.job.machine.spindle_dwell_s = dwell_s;
    plan.job.tools.resize(2);
    for (std::size_t i = 0; i < 2; ++i) {
        plan.job.tools[i] = Job{}.tools[i];
        plan.job.tools[i].number = kTools[i];
        plan.job.tools[i].name = "probe";
    }
    Layer& layer = plan.layers.emplace_back();
    layer.index = 3;
    layer.z_bottom = kTop - 18.5;
    layer.z_top = kTop;
    layer.slab_thickness = 19;
    constexpr double kSpeeds[] = {18000, 9001, 12340};
    for (int i = 0; i < 3; ++i) {
        Operation operation;
        operation.kind = OperationKind::rough;
        operation.purpose = "probe";
        operation.tool = kTools[i / 2];
        operation.spindle_rpm = kSpeeds[i];
        operation.clearance_z = kTop + kAbove[i];
        operation.blend = i == 1 && says_rounding(machine.post) ? 0.1 : kJunction;
        operation.moves = moves_of(i);
        layer.operations.push_back(std::move(operation));
    }
    const auto one_file = static_cast<std::size_t>(machine.programs == ProgramSpan::operation ? 1
                                                   : machine.programs == ProgramSpan::tool    ? 2
                                                                                              : 3);
    for (std::size_t i = 0; i < 3; ++i) {
        Operation& operation = layer.operations[i];
        const std::size_t first = i / one_file * one_file, last = std::min<std::size_t>(3, first + one_file);
        operation.number = 301 + static_cast<int>(first);
        operation.file = program_file(machine, fmt::format("L003_{:02}_probe", first + 1));
        if (last - first > 1) operation.file += fmt::format("#{}", i - first + 1);
    }
    return plan;
}

std::vector<ProbeMotion> motions_of(const Program& program) {
    std::vector<ProbeMotion> motions;
    auto arc = program.arcs.begin();
    for (std::size_t i = 0; i < program.steps.size(); ++i) {
        const ProgramStep& step = program.steps[i];
        if (arc == program.arcs.end() || arc->begin != i) {
            motions.push_back({step.x, step.y, step.z, step.feed, false, 0, 0, 0, step.line});
            continue;
        }
        const ProgramStep& end = program.steps[arc->end - 1];
        ProbeMotion motion{end.x,      end.y,      end.z,         end.feed, true,
                           arc->arc.x, arc->arc.y, arc->arc.turn, step.line};
        const ProbeMotion* before = motions.empty() ? nullptr : &motions.back();
        const bool goes_on = before != nullptr && before->arc && before->turn * motion.turn > 0 &&
                             std::hypot(before->cx - motion.cx, before->cy - motion.cy) < kNearCentre;
        if (goes_on) motions.pop_back();
        motions.push_back(motion);
        i = arc->end - 1;
        ++arc;
    }
    return motions;
}

/// Where it ends, of the axes that are known.
std::string place_text(const ProbeMotion& m) {
    std::string text;
    for (const auto& [letter, value] : {std::pair{'x', m.x}, std::pair{'y', m.y}, std::pair{'z', m.z}})
        if (std::isfinite(value)) text += fmt::format("{}{} {:.4f}", text.empty() ? "" : " ", letter, value);
    return text.empty() ? "no place" : text;
}

/// What two motions differ in; "" where they do not.
std::string lost(const ProbeMotion& meant, const ProbeMotion& read) {
    const auto far = [](double a, double b) { return std::isfinite(a) && !(std::abs(a - b) <= kNear); };
    if ((meant.feed == 0) != (read.feed == 0))
        return meant.feed == 0 ? "a rapid is read as a feed motion" : "a feed motion is read as a rapid";
    if (far(meant.x, read.x) || far(meant.y, read.y) || far(meant.z, read.z))
        return fmt::format("{} is read where {} is meant", place_text(read), place_text(meant));
    if (std::abs(meant.feed - read.feed) > 1e-6)
        return fmt::format("a feed of {:g} mm/min is read where {:g} is meant", read.feed, meant.feed);
    if (meant.arc != read.arc)
        return meant.arc ? "an arc is read as a straight motion" : "a straight motion is read as an arc";
    if (!meant.arc) return {};
    if (meant.turn * read.turn < 0) return "an arc is read the other way round";
    // A radius far larger than the arc says little of where the middle lies.
    const double allowed = std::max(kNearCentre, 1e-2 * std::hypot(meant.cx - meant.x, meant.cy - meant.y));
    if (std::hypot(meant.cx - read.cx, meant.cy - read.cy) > allowed)
        return "an arc is read about another centre";
    return {};
}

/// One file of a probe: the text of the post, and what LinuxCNC's exact text means.
class Probe {
public:
    Probe(const std::shared_ptr<const OwnDialect>& post, const std::string& file, LengthUnit units,
          ProgramSpan span, double dwell_s)
        : file_(file) {
        Machine machine;
        machine.post = post->base;
        machine.own_post = post;
        machine.units = units;
        machine.programs = span;
        machine.max_feed = 10000;
        plan_ = probe_plan(machine, dwell_s);
        machine.own_post = nullptr;
        machine.post = Post::linuxcnc;
        machine.units = LengthUnit::mm;
        meant_ = probe_plan(machine, dwell_s);
        for (Plan* plan : {&plan_, &meant_})
            for (Tool& tool : plan->job.tools) {
                tool.max_feed = 10000;
                tool.max_rpm = 18000;
            }
    }

    void run() {
        const Layer& layer = plan_.layers[0];
        for (std::size_t begin = 0; begin < layer.operations.size(); begin = file_end(layer, begin))
            check(begin, file_end(layer, begin));
    }

private:
    void check(std::size_t begin, std::size_t end) {
        text_.clear();
        write_file(plan_, plan_.layers[0], begin, [&](std::string_view piece) { text_ += piece; });
        std::string exact;
        write_file(meant_, meant_.layers[0], begin, [&](std::string_view piece) { exact += piece; });
        std::vector<Program> read;
        try {
            read = programs(text_, dialect_of(plan_.job.machine), end - begin);
        } catch (const Error& error) {
            const std::size_t colon = error.place().rfind(':');
            refuse(static_cast<std::uint32_t>(std::atoi(error.place().substr(colon + 1).c_str())),
                   error.message());
        }
        const std::vector<Program> meant = programs(exact, dialect_of(meant_.job.machine), end - begin);
        if (read.size() != end - begin)
            refuse(0, fmt::format("{} operations are read where {} are meant", read.size(), end - begin));
        for (std::size_t i = 0; i < read.size(); ++i) compare(begin + i, meant[i], read[i]);
    }

    static std::vector<Program> programs(const std::string& text, const Dialect& dialect, std::size_t count) {
        if (count > 1) return read_operations(text, "probe", dialect);
        std::vector<Program> one;
        one.push_back(read_program_text(text, "probe", dialect));
        return one;
    }

    void compare(std::size_t i, const Program& meant, Program read) {
        const Layer& layer = plan_.layers[0];
        const Operation& operation = layer.operations[i];
        if (read.tool != operation.tool)
            refuse(0, fmt::format("tool {} is read where {} is meant", read.tool, operation.tool));
        if (dialect_of(plan_.job.machine).numbered && read.number != operation.number)
            refuse(0,
                   fmt::format("program number {} is read where {} is meant", read.number, operation.number));
        const std::vector<ProbeMotion> a = motions_of(meant), b = motions_of(read);
        for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
            if (const std::string what = lost(a[k], b[k]); !what.empty()) refuse(b[k].line, what);
        if (a.size() != b.size())
            refuse(0, fmt::format("{} motions are read where {} are meant", b.size(), a.size()));
        // As verify will look at it: spindle, dwell, path mode, feeds.
        const ProgramOrigin origin = program_origin(plan_, layer);
        const double up = to_mm(origin.z);
        for (ProgramStep& step : read.steps) step.z += up;
        for (ProgramArc& arc : read.arcs) arc.arc.z += up;
        ProgramPlan planned;
        planned.spindle_rpm = operation.spindle_rpm;
        planned.blend = operation.blend;
        planned.feeds = written_feed_lengths(dialect_of(plan_.job.machine), operation.moves, origin);
        const Tool& tool = plan_.job.tools[i / 2];
        for (const Violation& v : check_program(read, planned, &tool, plan_.job.machine))
            refuse(v.line, v.message);
    }

    [[noreturn]] void refuse(std::uint32_t line, const std::string& what) const {
        std::string quoted;
        std::size_t at = 0;
        for (std::uint32_t n = 1; n < line && at != std::string::npos; ++n) at = text_.find('\n', at) + 1;
        if (line > 0 && at < text_.size())
            quoted = fmt::format(
                ", line {} \"{}\"", line,
                text_.substr(at, std::min<std::size_t>(60, text_.find_first_of("\r\n", at) - at)));
        throw Error(
            ErrorKind::usage, "post.probe",
            quoting_line(fmt::format("a program that this post writes in {} loses what was meant{}: {}",
                                     plan_.job.machine.units == LengthUnit::inch ? "inches" : "millimetres",
                                     quoted, what)),
            file_, "correct the post until its programs read back as they were meant");
    }

    std::string file_, text_;
    Plan plan_, meant_;
};

}  // namespace

void probe_post(const std::shared_ptr<const OwnDialect>& post, const std::string& file) {
    for (const LengthUnit units : {LengthUnit::mm, LengthUnit::inch})
        for (const ProgramSpan span : {ProgramSpan::operation, ProgramSpan::tool, ProgramSpan::layer}) {
            if (span == ProgramSpan::layer && !changes_tools(post->base)) continue;
            for (const double dwell_s : {2.5, 3.0}) Probe(post, file, units, span, dwell_s).run();
        }
}

}  // namespace slabwright
