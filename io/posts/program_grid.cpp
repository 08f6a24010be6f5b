#include "io/posts/program_grid.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "io/text/json_text.h"

namespace slabwright {

namespace {

constexpr std::int64_t kShortestArc = 10;  // steps between its ends
constexpr int kUnitDecimals = 4;           // 0.1 µm

std::int64_t power_of_ten(int exponent) {
    std::int64_t power = 1;
    for (int i = 0; i < exponent; ++i) power *= 10;
    return power;
}

std::int64_t divide_rounding(std::int64_t a, std::int64_t b) {
    return a >= 0 ? (a + b / 2) / b : -((-a + b / 2) / b);
}

}  // namespace

ProgramGrid::ProgramGrid(const Dialect& dialect)
    : dialect_(&dialect),
      exact_(!dialect.inch() && dialect.decimals == kUnitDecimals),
      plain_(exact_ && !dialect.point && !dialect.conversational && !dialect.trailing_zeros),
      per_unit_(power_of_ten(dialect.decimals)) {}

std::int64_t ProgramGrid::rounded(std::int64_t units) const {
    // A unit of 0.1 µm is 1/254000 in.
    const std::int64_t units_of_length = dialect_->inch() ? 254000 : power_of_ten(kUnitDecimals);
    return divide_rounding(units * per_unit_, units_of_length);
}

double ProgramGrid::mm(std::int64_t steps) const {
    return static_cast<double>(steps) / static_cast<double>(per_unit_) * dialect_->unit_mm();
}

double ProgramGrid::mm(double steps) const {
    return steps / static_cast<double>(per_unit_) * dialect_->unit_mm();
}

void ProgramGrid::append_spelled(std::string& text, std::int64_t steps) const {
    if (steps < 0) text += '-';
    else if (dialect_->conversational) text += '+';
    const std::int64_t size = steps < 0 ? -steps : steps;
    char digits[24];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, size / per_unit_).ptr);
    std::int64_t rest = size % per_unit_;
    const bool zeros = dialect_->trailing_zeros;
    if (rest != 0 || zeros || dialect_->point) text += '.';
    for (std::int64_t place = per_unit_ / 10; place > 0 && (rest != 0 || zeros); place /= 10) {
        text += static_cast<char>('0' + rest / place);
        rest %= place;
    }
}

namespace {

std::string number_text(double value, int decimals, bool point) {
    std::string text;
    append_rounded(text, value, decimals);
    if (point && text.find('.') == std::string::npos) text += '.';
    return text;
}

}  // namespace

std::string ProgramGrid::feed(std::uint32_t mm_min) const {
    return number_text(mm_min / dialect_->feed_unit, dialect_->feed_decimals, dialect_->point);
}

std::string ProgramGrid::length(double mm) const {
    if (!dialect_->inch()) return number_text(mm, kUnitDecimals, dialect_->point);
    constexpr double kMillionths = 1e6;  // of an inch
    return number_text(std::floor(mm / kInch * kMillionths) / kMillionths, 6, dialect_->point);
}

std::int64_t WrittenMoves::height(std::int64_t z_units) { return z_ = grid_.steps(z_units - origin_.z); }

WrittenMove WrittenMoves::next(const Move& to) {
    using Kind = WrittenMove::Kind;
    WrittenMove move;
    move.x = grid_.steps(to.x - origin_.x);
    move.y = grid_.steps(to.y - origin_.y);
    move.z = grid_.steps(to.z - origin_.z);
    const bool moves = !known_ || move.x != x_ || move.y != y_ || move.z != z_;
    if (moves) move.kind = Kind::line;
    if (moves && to.is_arc()) {
        move.cx = grid_.steps(ux_ + to.i - origin_.x);
        move.cy = grid_.steps(uy_ + to.j - origin_.y);
        const std::int64_t dx = to.x - ux_, dy = to.y - uy_;
        // Against the clock where the centre lies left of the chord.
        const Kind turn = dx * to.j > dy * to.i ? Kind::counter_clockwise : Kind::clockwise;
        const bool turns = (grid_.exact() && !grid_.by_radius()) ||
                           std::hypot(static_cast<double>(move.x - x_), static_cast<double>(move.y - y_)) >=
                               static_cast<double>(kShortestArc);
        if (turns) move.kind = turn;
    }
    known_ = true;
    ux_ = to.x;
    uy_ = to.y;
    x_ = move.x;
    y_ = move.y;
    z_ = move.z;
    return move;
}

namespace {

constexpr double kWidestRadiusArc = 100 * std::numbers::pi / 180;  // turn of an arc that is written by R

/// Of two places on a circle the line with R that goes from one to the other by less than half of it.
RadiusArc radius_arc(std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1, double radius,
                     bool clockwise) {
    RadiusArc arc{x1, y1, std::llround(radius), 0, 0};
    const double dx = static_cast<double>(x1 - x0), dy = static_cast<double>(y1 - y0);
    const double chord = std::hypot(dx, dy), r = static_cast<double>(arc.radius);
    const double h = std::sqrt(std::max(0.0, r * r - chord * chord / 4)), side = clockwise ? 1 : -1;
    arc.cx = static_cast<double>(x0) + dx / 2 + side * h * dy / chord;
    arc.cy = static_cast<double>(y0) + dy / 2 - side * h * dx / chord;
    return arc;
}

}  // namespace

std::vector<RadiusArc> radius_arcs(std::int64_t x, std::int64_t y, const WrittenMove& arc) {
    const bool clockwise = arc.kind == WrittenMove::Kind::clockwise;
    const double cx = static_cast<double>(arc.cx), cy = static_cast<double>(arc.cy);
    const double ax = static_cast<double>(x) - cx, ay = static_cast<double>(y) - cy;
    const double bx = static_cast<double>(arc.x) - cx, by = static_cast<double>(arc.y) - cy;
    const double radius = (std::hypot(ax, ay) + std::hypot(bx, by)) / 2, start = std::atan2(ay, ax);
    double sweep = std::atan2(by, bx) - start;
    if (clockwise && sweep >= 0) sweep -= 2 * std::numbers::pi;
    if (!clockwise && sweep <= 0) sweep += 2 * std::numbers::pi;
    if (std::abs(sweep) <= kWidestRadiusArc) return {radius_arc(x, y, arc.x, arc.y, radius, clockwise)};
    const std::int64_t mx = std::llround(cx + radius * std::cos(start + sweep / 2)),
                       my = std::llround(cy + radius * std::sin(start + sweep / 2));
    return {radius_arc(x, y, mx, my, radius, clockwise), radius_arc(mx, my, arc.x, arc.y, radius, clockwise)};
}

namespace {

/// The way of one written arc, with the mean of its two radii as whoever reads the text takes it.
FeedLength written_arc(double feed, const std::array<double, 3>& from, const std::array<double, 3>& to,
                       double cx, double cy, bool clockwise) {
    const double r0 = std::hypot(from[0] - cx, from[1] - cy), r1 = std::hypot(to[0] - cx, to[1] - cy);
    const double start = std::atan2(from[1] - cy, from[0] - cx);
    double sweep = std::atan2(to[1] - cy, to[0] - cx) - start;
    constexpr double turn = 2 * std::numbers::pi;
    if (clockwise && sweep >= 0) sweep -= turn;
    if (!clockwise && sweep <= 0) sweep += turn;
    return arc_length(feed, {cx, cy, to[2], (r0 + r1) / 2, start, sweep});
}

}  // namespace

std::vector<FeedLength> written_feed_lengths(const Dialect& dialect, std::span<const Move> moves,
                                             const ProgramOrigin& origin) {
    const ProgramGrid grid(dialect);
    if ((grid.exact() && !dialect.radius_arcs) || moves.size() < 2) return feed_lengths(moves);
    WrittenMoves written(grid, origin);
    std::vector<FeedLength> lengths;
    const double right = to_mm(origin.x), back = to_mm(origin.y), up = to_mm(origin.z);
    written.height(moves[0].z);
    // The way to the first place whose x and y are written begins nowhere that is known.
    const std::size_t first = moves[1].feed == 0 && moves[1].z == moves[0].z ? 2 : 1;
    std::array<double, 3> at{};
    std::int64_t x = 0, y = 0;  // steps of `at`
    for (std::size_t i = first - 1; i < moves.size(); ++i) {
        const WrittenMove w = written.next(moves[i]);
        const std::array<double, 3> to{grid.mm(w.x) + right, grid.mm(w.y) + back, grid.mm(w.z) + up};
        using Kind = WrittenMove::Kind;
        FeedLength more;
        const bool arc = w.kind != Kind::none && w.kind != Kind::line;
        if (i >= first && arc && dialect.radius_arcs) {
            for (const RadiusArc& r : radius_arcs(x, y, w)) {
                const std::array<double, 3> end{grid.mm(r.x) + right, grid.mm(r.y) + back, to[2]};
                add_length(lengths, written_arc(moves[i].feed, at, end, grid.mm(r.cx) + right,
                                                grid.mm(r.cy) + back, w.kind == Kind::clockwise));
                at = end;
            }
        } else if (i >= first && w.kind == Kind::line) more = straight_length(moves[i].feed, at, to);
        else if (i >= first && arc)
            more = written_arc(moves[i].feed, at, to, grid.mm(w.cx) + right, grid.mm(w.cy) + back,
                               w.kind == Kind::clockwise);
        if (more.mm > 0) add_length(lengths, more);
        at = to;
        x = w.x;
        y = w.y;
    }
    return lengths;
}

ProgramOrigin program_origin(const Plan& plan, const Layer& layer) {
    const Point2 zero = work_zero(plan);
    return {zero.x, zero.y, to_units(zero_height(plan.job.machine, layer.z_top))};
}

}  // namespace slabwright
