#include "io/posts/program_builder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slabwright {

namespace {

constexpr double kFarthest = 214000;  // mm: what paths in 0.1 µm can say

/// By how much an arc's two radii may differ, mm, where begin, end and centre are rounded to a last decimal
/// that is coarser than the plan's own 0.1 µm.
double rounded_radii(const Dialect& dialect) {
    const double step = std::pow(10, -dialect.decimals) * dialect.unit_mm();
    return step > 1.5e-4 ? 3 * step : 0;
}

}  // namespace

ProgramBuilder::ProgramBuilder(std::string_view text, const Dialect& dialect, const GcodeLimits& limits,
                               const GcodePlace& place)
    : text_(text),
      limits_(limits),
      level_radius_error_(std::max(2 * limits.arc_error, rounded_radii(dialect))),
      place_(place) {}

void ProgramBuilder::begin_operation(int tool) {
    if (program.steps.empty()) {
        program.tool = tool;
        return;
    }
    Program next;
    next.file = program.file;
    next.number = program.number;
    next.tool = tool;
    next.blend = program.blend;
    next.strays = program.strays;
    next.strays_line = program.strays_line;
    done_.push_back(std::move(program));
    program = std::move(next);
    spin_up_s_ = 0;
    spinning_up_ = blended_ = false;
    at_ = {kUnknown, kUnknown, kUnknown};
}

std::vector<Program> ProgramBuilder::take(int tool) {
    if (done_.empty()) program.tool = tool;
    done_.push_back(std::move(program));
    return std::move(done_);
}

void ProgramBuilder::turn(double rpm) {
    rpm_ = rpm;
    if (rpm > 0) program.spindle_rpm = std::max(program.spindle_rpm, rpm);
}

void ProgramBuilder::spin_up() {
    spin_up_s_ = 0;
    spinning_up_ = true;
}

void ProgramBuilder::dwell(double seconds) {
    program.dwell_s += seconds;
    spin_up_s_ += seconds;
    if (seconds > program.longest_dwell.value) program.longest_dwell = {seconds, place_.line};
}

void ProgramBuilder::blend(double rounds, double leaves_out) {
    if (!blended_ || rounds + leaves_out > program.strays) program.strays_line = place_.line;
    program.strays = blended_ ? std::max(program.strays, rounds + leaves_out) : rounds + leaves_out;
    program.blend = blended_ ? std::min(program.blend, rounds) : rounds;
    blended_ = true;
}

void ProgramBuilder::check_place(const std::array<double, 3>& to) const {
    for (const double v : to)
        if (std::abs(v) > kFarthest) place_.fail("gcode.number", "a coordinate beyond 214 m");
}

void ProgramBuilder::rapid(const std::array<double, 3>& to) {
    check_place(to);
    if (program.slowest_spindle.line != 0) note_spindle();
    step(to, 0);
}

void ProgramBuilder::line(const std::array<double, 3>& to, double feed) {
    check_place(to);
    require_known(to);
    note_spindle();
    end_spin_up();
    step(to, feed);
}

void ProgramBuilder::require_known(const std::array<double, 3>& to) const {
    for (std::size_t k = 0; k < 3; ++k)
        if (!std::isfinite(to[k]) || !std::isfinite(at_[k]))
            place_.fail("gcode.unknown_place", "a feed motion from or to an unknown place");
}

void ProgramBuilder::note_spindle() {
    const ProgramWord speed{rpm_, place_.line};
    ProgramWord &slow = program.slowest_spindle, &fast = program.fastest_spindle;
    if (slow.line == 0 || speed.value < slow.value) slow = speed;
    if (fast.line == 0 || speed.value > fast.value) fast = speed;
}

void ProgramBuilder::end_spin_up() {
    ProgramWord& least = program.shortest_spin_up;
    if (spinning_up_ && (least.line == 0 || spin_up_s_ < least.value)) least = {spin_up_s_, place_.line};
    spinning_up_ = false;
}

ProgramBuilder::Sweep ProgramBuilder::sweep_of(const std::array<double, 3>& to, const ReadArc& arc) const {
    const auto [a, b, c] = arc.plane;
    const double da = to[a] - at_[a], db = to[b] - at_[b];
    const double r0 = std::hypot(at_[a] - arc.ca, at_[b] - arc.cb),
                 r1 = std::hypot(to[a] - arc.ca, to[b] - arc.cb);
    if (std::max(r0, r1) > kFarthest) place_.fail("gcode.number", "an arc of a radius beyond 214 m");
    if (!(r0 > 0) || std::abs(r0 - r1) > limits_.arc_radius_error)
        place_.fail("gcode.arc", "an arc whose start and end lie at different radii");
    const double start = std::atan2(at_[b] - arc.cb, at_[a] - arc.ca);
    double sweep = std::atan2(to[b] - arc.cb, to[a] - arc.ca) - start;
    constexpr double turn = 2 * std::numbers::pi;
    const bool full = da == 0 && db == 0;
    if (arc.clockwise) {
        while (sweep >= 0) sweep -= turn;
        if (full) sweep = -turn;
    } else {
        while (sweep <= 0) sweep += turn;
        if (full) sweep = turn;
    }
    return {r0, r1, start, sweep};
}

void ProgramBuilder::arc(const std::array<double, 3>& to, const ReadArc& arc, double feed) {
    check_place(to);
    require_known(to);
    note_spindle();
    end_spin_up();
    const auto [r0, r1, start, sweep] = sweep_of(to, arc);
    const auto [a, b, c] = arc.plane;
    // A chord of angle φ misses the arc by r(1 − cos(φ/2)) = 2r·sin²(φ/4), which stays exact where the
    // cosine is near one.
    const double r = std::max(r0, r1), angle = std::abs(sweep);
    const auto chords_within = [&](double error) {
        const double widest =
            std::min(std::numbers::pi / 2, 4 * std::asin(std::sqrt(std::min(1.0, error / (2 * r)))));
        return std::max(1, static_cast<int>(std::min(1e7, std::ceil(angle / widest))));
    };
    const auto error_of = [&](int chords) { return 2 * r * std::pow(std::sin(angle / chords / 4), 2); };
    const bool level = c == 2 && at_[2] == to[2] && std::abs(r0 - r1) <= level_radius_error_;
    const int close = chords_within(limits_.arc_error),
              chords = level && limits_.level_arc_error > 0
                           ? std::min(close, chords_within(limits_.level_arc_error))
                           : close;
    const std::array<double, 3> from = at_;
    const std::size_t begin = program.steps.size();
    for (int i = 1; i < chords; ++i) {
        const double t = static_cast<double>(i) / chords, at = start + sweep * t, radius = r0 + (r1 - r0) * t;
        std::array<double, 3> p{};
        p[a] = arc.ca + radius * std::cos(at);
        p[b] = arc.cb + radius * std::sin(at);
        p[c] = from[c] + (to[c] - from[c]) * t;
        step(p, feed);
    }
    step(to, feed);
    // Whoever takes a level arc itself takes it with one radius.
    program.chord_error = std::max(program.chord_error, error_of(chords));
    program.arc_error = std::max(program.arc_error, error_of(close) + (level ? std::abs(r0 - r1) / 2 : 0));
    if (level)
        program.arcs.push_back({begin,
                                program.steps.size(),
                                {arc.ca, arc.cb, to[2], (r0 + r1) / 2, start, sweep},
                                static_cast<std::size_t>(close)});
}

/// Arcs have many chords: as many are foreseen in what is left of the text as have come of what was read.
void ProgramBuilder::make_room() {
    std::vector<ProgramStep>& steps = program.steps;
    if (steps.size() < steps.capacity()) return;
    const double so_far = static_cast<double>(steps.size() + 1),
                 all = so_far * static_cast<double>(text_.size()) / static_cast<double>(read_ + 1);
    steps.reserve(static_cast<std::size_t>(std::clamp(1.05 * all, 1.25 * so_far, 4 * so_far)) + 64);
}

void ProgramBuilder::step(const std::array<double, 3>& to, double feed) {
    make_room();
    program.steps.push_back({to[0], to[1], to[2], feed, place_.line, rpm_ > 0});
    at_ = to;
}

}  // namespace slabwright
