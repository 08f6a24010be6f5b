#include "engine/simulate/keep_out_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kTouching = 1e-3;  // mm: a fence may touch the slab

struct Spot {
    double x = 0, y = 0;
};

Spot operator-(const Spot& a, const Spot& b) { return {a.x - b.x, a.y - b.y}; }
double length(const Spot& a) { return std::hypot(a.x, a.y); }
double cross(const Spot& a, const Spot& b) { return a.x * b.y - a.y * b.x; }
double dot(const Spot& a, const Spot& b) { return a.x * b.x + a.y * b.y; }

// How far something is from an area, and where on the way.
struct Nearest {
    double distance = kInfinite;
    Spot at;
    void take(double d, const Spot& where) {
        if (d < distance) distance = d, at = where;
    }
};

struct Side {
    Spot from, to;
    [[nodiscard]] Spot nearest(const Spot& p) const {
        const Spot along = to - from;
        const double square = dot(along, along);
        if (square == 0) return from;
        const double t = std::clamp(dot(p - from, along) / square, 0.0, 1.0);
        return {from.x + t * along.x, from.y + t * along.y};
    }
};

// Straight way to side: they cross, or an end of one is nearest.
void measure(const Side& way, const Side& side, Nearest& nearest) {
    const Spot u = way.to - way.from, v = side.to - side.from, w = side.from - way.from;
    if (const double d = cross(u, v); d != 0) {
        const double s = cross(w, v) / d, t = cross(w, u) / d;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1) {
            nearest.take(0, {way.from.x + s * u.x, way.from.y + s * u.y});
            return;
        }
    }
    for (const Spot& end : {way.from, way.to}) nearest.take(length(end - side.nearest(end)), end);
    for (const Spot& end : {side.from, side.to}) {
        const Spot on = way.nearest(end);
        nearest.take(length(end - on), on);
    }
}

Spot on_arc(const LevelArc& arc, double angle) {
    return {arc.x + arc.radius * std::cos(angle), arc.y + arc.radius * std::sin(angle)};
}

bool covers(const LevelArc& arc, double angle) {
    constexpr double kFull = 2 * std::numbers::pi;
    double past = std::fmod(arc.turn >= 0 ? angle - arc.start : arc.start - angle, kFull);
    if (past < 0) past += kFull;
    return past <= std::abs(arc.turn);
}

// The arc to a place: straight away from the centre, or from one of its ends.
void measure(const LevelArc& arc, const Spot& p, double bonus, Nearest& nearest) {
    const double angle = std::atan2(p.y - arc.y, p.x - arc.x);
    if (covers(arc, angle))
        nearest.take(std::abs(length(p - Spot{arc.x, arc.y}) - arc.radius) - bonus, on_arc(arc, angle));
    for (const double end : {arc.start, arc.start + arc.turn})
        nearest.take(length(p - on_arc(arc, end)) - bonus, on_arc(arc, end));
}

// The arc to a side: they cross; or an end of one is nearest; or the foot of the centre on the side is.
void measure(const LevelArc& arc, const Side& side, Nearest& nearest) {
    const Spot centre{arc.x, arc.y}, along = side.to - side.from, to_centre = side.from - centre;
    const double a = dot(along, along), b = dot(to_centre, along),
                 c = dot(to_centre, to_centre) - arc.radius * arc.radius;
    if (const double root = b * b - a * c; root >= 0 && a > 0)
        for (const double t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a}) {
            const Spot at{side.from.x + t * along.x, side.from.y + t * along.y};
            if (t >= 0 && t <= 1 && covers(arc, std::atan2(at.y - arc.y, at.x - arc.x))) nearest.take(0, at);
        }
    for (const Spot& p : {side.from, side.to, side.nearest(centre)}) measure(arc, p, 0, nearest);
    for (const double end : {arc.start, arc.start + arc.turn}) {
        const Spot at = on_arc(arc, end);
        nearest.take(length(at - side.nearest(at)), at);
    }
}

// What stands in a layer, mm, pattern-base.
struct Obstacle {
    const KeepOut* keep_out = nullptr;
    std::vector<Spot> corners;  // empty: the circle
    Spot centre;
    double radius = 0;
    double top = 0;
    Spot low, high;  // of its area

    [[nodiscard]] bool holds(const Spot& p) const {
        // How often the corners go round it.
        double angle = 0;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const Spot a = corners[i] - p, b = corners[(i + 1) % corners.size()] - p;
            angle += std::atan2(cross(a, b), dot(a, b));
        }
        return std::abs(angle) > std::numbers::pi;
    }
    template <class Way>
    void measure_sides(const Way& way, Nearest& nearest) const {
        for (std::size_t i = 0; i < corners.size(); ++i)
            measure(way, Side{corners[i], corners[(i + 1) % corners.size()]}, nearest);
    }
    [[nodiscard]] Nearest to(const Side& way) const {
        Nearest nearest;
        if (corners.empty()) {
            const Spot at = way.nearest(centre);
            nearest.take(std::max(0.0, length(at - centre) - radius), at);
            return nearest;
        }
        if (holds(way.from)) nearest.take(0, way.from);
        measure_sides(way, nearest);
        return nearest;
    }
    [[nodiscard]] Nearest to(const LevelArc& way) const {
        Nearest nearest;
        if (corners.empty()) {
            measure(way, centre, radius, nearest);
            nearest.distance = std::max(0.0, nearest.distance);
            return nearest;
        }
        if (holds(on_arc(way, way.start))) nearest.take(0, on_arc(way, way.start));
        measure_sides(way, nearest);
        return nearest;
    }
};

Obstacle obstacle_of(const KeepOut& keep_out, const std::array<double, 2>& zero) {
    Obstacle obstacle;
    obstacle.keep_out = &keep_out;
    const auto placed = [&](double x, double y) { return Spot{x + zero[0], y + zero[1]}; };
    for (const auto& [x, y] : keep_out.polygon) obstacle.corners.push_back(placed(x, y));
    if (const std::vector<double>& r = keep_out.rectangle; r.size() == 4)
        obstacle.corners = {placed(r[0], r[1]), placed(r[0], r[3]), placed(r[2], r[3]), placed(r[2], r[1])};
    if (const std::vector<double>& c = keep_out.circle; c.size() == 3) {
        obstacle.centre = placed(c[0], c[1]);
        obstacle.radius = c[2];
        obstacle.low = {obstacle.centre.x - c[2], obstacle.centre.y - c[2]};
        obstacle.high = {obstacle.centre.x + c[2], obstacle.centre.y + c[2]};
        return obstacle;
    }
    obstacle.low = {kInfinite, kInfinite};
    obstacle.high = {-kInfinite, -kInfinite};
    for (const Spot& p : obstacle.corners) {
        obstacle.low = {std::min(obstacle.low.x, p.x), std::min(obstacle.low.y, p.y)};
        obstacle.high = {std::max(obstacle.high.x, p.x), std::max(obstacle.high.y, p.y)};
    }
    return obstacle;
}

// Whether an area and a layer's slab have more in common than an edge.
bool share(const Obstacle& obstacle, const Blank& slab) {
    const Spot low{slab.min[0] + kTouching, slab.min[1] + kTouching},
        high{slab.max[0] - kTouching, slab.max[1] - kTouching};
    const Spot inner = obstacle.corners.empty() ? obstacle.centre : obstacle.corners[0];
    if (inner.x > low.x && inner.x < high.x && inner.y > low.y && inner.y < high.y) return true;
    const Spot corners[] = {low, {high.x, low.y}, high, {low.x, high.y}};
    for (std::size_t k = 0; k < 4; ++k)
        if (obstacle.to(Side{corners[k], corners[(k + 1) % 4]}).distance == 0) return true;
    return false;
}

struct LayerObstacles {
    std::vector<Obstacle> standing;
    std::vector<Violation> violations;
};

LayerObstacles obstacles_in(const SimulationInput& input, std::size_t l, const std::array<double, 2>& zero) {
    const SimulatedLayer& layer = input.layers[l];
    const Blank slab = layer.blank.value_or(Blank{input.stock_min, input.stock_max});
    LayerObstacles found;
    for (const KeepOut& keep_out : input.machine.keep_outs) {
        Obstacle obstacle = obstacle_of(keep_out, zero);
        const bool on_board = keep_out.from == KeepOutBase::board, covered = share(obstacle, slab);
        if (!on_board && !covered) continue;
        obstacle.top = keep_out.height + (on_board ? 0 : layer.z_bottom + layer.slab_thickness);
        if (on_board && covered && layer.z_bottom < keep_out.height)
            found.violations.push_back(
                {"keep_out.slab",
                 fmt::format(
                     "layer {}: the slab would lie where \"{}\" stands {:.1f} mm high on the base board",
                     l + 1, keep_out.name, keep_out.height),
                 "", 0,
                 Point3{(obstacle.low.x + obstacle.high.x) / 2, (obstacle.low.y + obstacle.high.y) / 2,
                        layer.z_bottom},
                 keep_out.height - layer.z_bottom, l});
        found.standing.push_back(std::move(obstacle));
    }
    return found;
}

// A cylinder of the tool, its lower end over the tip.
struct Cylinder {
    const char* name;
    double radius, height;
};

// One program against one obstacle.
class ProgramClearance {
public:
    ProgramClearance(const Program& program, const Tool& tool, const Obstacle& obstacle)
        : program_(program), obstacle_(obstacle), cylinders_{{"cutter", tool.diameter / 2, 0}} {
        for (const ToolSection& s : cylinders_of(tool)) cylinders_.push_back({s.name, s.radius, s.above});
    }

    void run(std::vector<Violation>& violations) {
        auto arc = program_.arcs.begin();
        for (std::size_t i = 0; i < program_.steps.size(); ++i) {
            const ProgramStep& step = program_.steps[i];
            while (arc != program_.arcs.end() && arc->end <= i) ++arc;
            const bool turns = arc != program_.arcs.end() && arc->begin <= i;
            if (i == 0 || !program_.steps[i - 1].known()) come(i);
            else if (!turns) go(program_.steps[i - 1], step);
            else if (arc->begin == i) go_round(arc->arc, step.line);
        }
        const KeepOut& keep_out = *obstacle_.keep_out;
        if (approach_ < kInfinite)
            violations.push_back(
                {"keep_out.approach",
                 fmt::format(
                     "comes from where the machine stood at z {:.2f} mm, lower than the top of \"{}\" "
                     "at {:.2f} mm",
                     approach_, keep_out.name, obstacle_.top),
                 program_.file, approach_line_, std::nullopt, obstacle_.top - approach_});
        if (motions_ == 0) return;
        violations.push_back(
            {"keep_out.cut",
             fmt::format("the {} {} \"{}\", which must stay {:.2f} mm away; {} motion{} enter{}", part_,
                         away_ > 0 ? fmt::format("comes within {:.3f} mm of", away_) : "runs into",
                         keep_out.name, keep_out.clearance, motions_, motions_ == 1 ? "" : "s",
                         motions_ == 1 ? "s" : ""),
             program_.file, line_, where_, most_});
    }

private:
    // A motion from a place that nobody knows, perhaps across the table.
    void come(std::size_t i) {
        const ProgramStep& step = program_.steps[i];
        const double before = i > 0 ? program_.steps[i - 1].z : kUnknown;
        if (!step.known()) return;
        const double z = std::isfinite(before) ? std::min(before, step.z) : step.z;
        if (z < obstacle_.top - kKeepOutTolerance && z < approach_) approach_ = z, approach_line_ = step.line;
        go(step, step);
    }

    void go(const ProgramStep& from, const ProgramStep& to) {
        if (!from.known() || !to.known()) return;
        bool entered = false;
        for (const Cylinder& c : cylinders_) {
            // Of the way what is so low that the cylinder's end is under the top.
            const double below = obstacle_.top - kKeepOutTolerance - c.height, reach = reach_of(c);
            if (std::min(from.z, to.z) >= below || !is_near({from.x, from.y}, {to.x, to.y}, reach)) continue;
            double begin = 0, end = 1;
            if (from.z > below) begin = (from.z - below) / (from.z - to.z);
            if (to.z > below) end = (below - from.z) / (to.z - from.z);
            const auto at = [&](double t) {
                return Spot{from.x + t * (to.x - from.x), from.y + t * (to.y - from.y)};
            };
            entered |= take(c, obstacle_.to(Side{at(begin), at(end)}), std::min(from.z, to.z), to.line);
        }
        motions_ += entered ? 1 : 0;
    }

    void go_round(const LevelArc& arc, std::uint32_t line) {
        bool entered = false;
        const Spot low{arc.x - arc.radius, arc.y - arc.radius}, high{arc.x + arc.radius, arc.y + arc.radius};
        for (const Cylinder& c : cylinders_)
            if (arc.z < obstacle_.top - kKeepOutTolerance - c.height && is_near(low, high, reach_of(c)))
                entered |= take(c, obstacle_.to(arc), arc.z, line);
        motions_ += entered ? 1 : 0;
    }

    [[nodiscard]] double reach_of(const Cylinder& c) const {
        return c.radius + obstacle_.keep_out->clearance - kKeepOutTolerance;
    }
    [[nodiscard]] bool is_near(const Spot& a, const Spot& b, double reach) const {
        return std::min(a.x, b.x) < obstacle_.high.x + reach &&
               std::max(a.x, b.x) > obstacle_.low.x - reach &&
               std::min(a.y, b.y) < obstacle_.high.y + reach && std::max(a.y, b.y) > obstacle_.low.y - reach;
    }
    bool take(const Cylinder& c, const Nearest& nearest, double z, std::uint32_t line) {
        const double lacks = reach_of(c) - nearest.distance;
        if (lacks <= 0) return false;
        if (lacks > most_) {
            most_ = lacks;
            away_ = nearest.distance - c.radius;
            part_ = c.name;
            line_ = line;
            where_ = {nearest.at.x, nearest.at.y, z};
        }
        return true;
    }

    const Program& program_;
    const Obstacle& obstacle_;
    std::vector<Cylinder> cylinders_;
    std::size_t motions_ = 0;
    double most_ = 0, away_ = 0;
    const char* part_ = "";
    std::uint32_t line_ = 0, approach_line_ = 0;
    double approach_ = kInfinite;
    Point3 where_{};
};

}  // namespace

std::vector<Violation> check_keep_outs(Context& context, const SimulationInput& input,
                                       const std::array<double, 2>& zero) {
    std::vector<Violation> violations;
    if (input.machine.keep_outs.empty()) return violations;
    std::vector<LayerObstacles> layers;
    for (std::size_t l = 0; l < input.layers.size(); ++l) {
        layers.push_back(obstacles_in(input, l, zero));
        violations.insert(violations.end(), layers[l].violations.begin(), layers[l].violations.end());
    }
    std::vector<std::vector<Violation>> found(input.programs.size());
    parallel_each(context, input.programs.size(), [&](std::size_t i) {
        const Program& program = input.programs[i];
        const auto tool = std::find_if(input.tools.begin(), input.tools.end(),
                                       [&](const Tool& t) { return t.number == program.tool; });
        const auto l = static_cast<std::size_t>(program.layer);
        if (tool == input.tools.end() || l >= layers.size()) return;
        for (const Obstacle& obstacle : layers[l].standing) {
            context.throw_if_cancelled();
            ProgramClearance(program, *tool, obstacle).run(found[i]);
        }
    });
    for (const std::vector<Violation>& of : found) violations.insert(violations.end(), of.begin(), of.end());
    return violations;
}

}  // namespace slabwright
