#include "engine/simulate/dowel_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kUnder = 1e-3;     // mm under a layer's top, from where a tip is in the wood
constexpr double kOneHole = 0.5;    // diameters of the tool: ways down no farther apart make one hole
constexpr double kPointMost = 0.5;  // diameters that a drill's point is long at most: 90°

double point_of(const Tool& tool) {
    return tool.kind == ToolKind::drill ? tool.diameter / 2 / std::tan(cutter_shape(tool).taper_rad) : 0;
}

/// Where a tool's tip may be for one of the dowels of a layer.
struct TipRoom {
    const JointDowel& dowel;
    double radius = 0, lowest = 0;  // mm
    TipRoom(const JointDowel& of, const SimulatedLayer& layer, const Tool& tool)
        : dowel(of),
          radius((of.diameter - tool.diameter) / 2 + kDowelTolerance),
          lowest(layer.z_top - of.below - point_of(tool) - kDowelTolerance) {}
    [[nodiscard]] bool holds(const ProgramStep& s) const {
        return s.known() && s.z >= lowest && std::hypot(s.x - dowel.x, s.y - dowel.y) <= radius;
    }
};

/// What one tool takes under the layer's top at one place.
struct MadeHole {
    double x0 = kUnbounded, y0 = kUnbounded, x1 = -kUnbounded, y1 = -kUnbounded;  // of the tip
    double lowest = kUnbounded;
    const Program* program = nullptr;
    const Tool* tool = nullptr;
    std::uint32_t line = 0, rapid_line = 0;
    void add(const ProgramStep& s) {
        x0 = std::min(x0, s.x), x1 = std::max(x1, s.x);
        y0 = std::min(y0, s.y), y1 = std::max(y1, s.y);
        if (s.z < lowest) lowest = s.z, line = s.line;
    }
    [[nodiscard]] double x() const { return (x0 + x1) / 2; }
    [[nodiscard]] double y() const { return (y0 + y1) / 2; }
    [[nodiscard]] double diameter() const { return tool->diameter + (x1 - x0 + y1 - y0) / 2; }
};

const Tool* tool_of(const SimulationInput& input, int number) {
    for (const Tool& t : input.tools)
        if (t.number == number) return &t;
    return nullptr;
}

/// A program goes down once or, pecking, several times into one hole.
void add_holes(const Program& program, const Tool& tool, double top, std::vector<MadeHole>& holes) {
    const std::size_t first = holes.size();
    MadeHole* at = nullptr;  // the hole that the tip is in
    for (std::size_t i = 1; i < program.steps.size(); ++i) {
        const ProgramStep &from = program.steps[i - 1], &to = program.steps[i];
        if (!from.known() || !to.known() || std::min(from.z, to.z) >= top - kUnder) {
            at = nullptr;
            continue;
        }
        if (at == nullptr) {
            const ProgramStep& low = to.z < from.z ? to : from;
            const auto same = std::find_if(
                holes.begin() + static_cast<std::ptrdiff_t>(first), holes.end(), [&](const MadeHole& h) {
                    return std::hypot(h.x() - low.x, h.y() - low.y) <= kOneHole * tool.diameter;
                });
            if (same != holes.end()) {
                at = &*same;
            } else {
                at = &holes.emplace_back();
                at->program = &program;
                at->tool = &tool;
            }
        }
        if (to.rapid() && to.z < std::min(at->lowest, top) - kUnder && at->rapid_line == 0)
            at->rapid_line = to.line;
        if (from.z < top - kUnder) at->add(from);
        if (to.z < top - kUnder) at->add(to);
    }
}

class DowelCheck {
public:
    DowelCheck(Context& context, const SimulationInput& input, const StandingPart& part, double clearance)
        : context_(context), input_(input), part_(part), clearance_(clearance) {}

    std::vector<Violation> run() {
        std::vector<std::vector<Violation>> found(input_.layers.size());
        parallel_each(context_, input_.layers.size(), [&](std::size_t l) {
            const std::vector<MadeHole> holes = holes_of(l);
            for (const JointDowel& dowel : input_.layers[l].dowels) {
                check_hole(l, dowel, holes, found[l]);
                if (clearance_ >= 0) check_wood(l, dowel, found[l]);
            }
        });
        std::vector<Violation> all;
        for (const std::vector<Violation>& of : found) all.insert(all.end(), of.begin(), of.end());
        return all;
    }

private:
    [[nodiscard]] std::vector<MadeHole> holes_of(std::size_t l) const {
        std::vector<MadeHole> holes;
        if (input_.layers[l].dowels.empty()) return holes;
        for (const Program& program : input_.programs) {
            if (static_cast<std::size_t>(program.layer) != l || program.kind != OperationKind::drill)
                continue;
            if (const Tool* tool = tool_of(input_, program.tool))
                add_holes(program, *tool, input_.layers[l].z_top, holes);
        }
        return holes;
    }

    void tell(std::vector<Violation>& found, std::size_t l, const JointDowel& dowel, const char* code,
              const std::string& what, double size, const MadeHole* hole = nullptr,
              std::uint32_t line = 0) const {
        const double z = input_.layers[l].z_top;
        found.push_back(
            {code, fmt::format("the dowel at x {:.2f} y {:.2f}, z {:.2f} mm: {}", dowel.x, dowel.y, z, what),
             hole ? hole->program->file : "", hole && line == 0 ? hole->line : line,
             Point3{dowel.x, dowel.y, z}, size, l});
    }

    void check_hole(std::size_t l, const JointDowel& dowel, const std::vector<MadeHole>& holes,
                    std::vector<Violation>& found) const {
        const auto off = [&](const MadeHole& h) { return std::hypot(h.x() - dowel.x, h.y() - dowel.y); };
        const auto nearest =
            std::min_element(holes.begin(), holes.end(),
                             [&](const MadeHole& a, const MadeHole& b) { return off(a) < off(b); });
        if (nearest == holes.end() || off(*nearest) > dowel.diameter)
            return tell(found, l, dowel, "dowel.missing", "no program drills its hole", dowel.below);
        const MadeHole& hole = *nearest;
        if (off(hole) > kDowelTolerance)
            tell(found, l, dowel, "dowel.place", fmt::format("its hole is {:.3f} mm beside it", off(hole)),
                 off(hole), &hole);
        const double wider = hole.diameter() - dowel.diameter;
        if (std::abs(wider) > kDowelTolerance)
            tell(found, l, dowel, "dowel.diameter",
                 fmt::format("its hole is {:.3f} mm wide, not {:.3f}", hole.diameter(), dowel.diameter),
                 std::abs(wider), &hole);
        const double depth = input_.layers[l].z_top - hole.lowest - point_of(*hole.tool);
        if (std::abs(depth - dowel.below) > kDowelTolerance)
            tell(found, l, dowel, "dowel.depth",
                 fmt::format("its hole is {:.3f} mm deep, not {:.3f}", depth, dowel.below),
                 std::abs(depth - dowel.below), &hole);
        if (hole.rapid_line != 0)
            tell(found, l, dowel, "dowel.rapid", "a rapid goes down in its hole", 0, &hole, hole.rapid_line);
    }

    void check_wood(std::size_t l, const JointDowel& dowel, std::vector<Violation>& found) const {
        const SimulatedLayer& layer = input_.layers[l];
        const SimulatedLayer* above = l + 1 < input_.layers.size() ? &input_.layers[l + 1] : nullptr;
        if (!(dowel.below < layer.z_top - layer.z_bottom) || above == nullptr ||
            !(dowel.above < above->z_top - above->z_bottom))
            return tell(found, l, dowel, "dowel.wood", "its holes end outside of their slabs", 0);
        const auto under =
            l > 0 ? std::span<const JointDowel>(input_.layers[l - 1].dowels) : std::span<const JointDowel>();
        for (const JointDowel& other : under)
            if (std::hypot(other.x - dowel.x, other.y - dowel.y) < (other.diameter + dowel.diameter) / 2 &&
                other.above + dowel.below > layer.z_top - layer.z_bottom)
                tell(found, l, dowel, "dowel.wood", "its hole runs into one in the slab's underside", 0);
        const double reach = dowel.diameter / 2 + clearance_ - kDowelTolerance;
        const double low = layer.z_top - dowel.below, high = layer.z_top + dowel.above;
        if (!part_.covered(dowel.x, dowel.y, layer.z_top) ||
            !is_free(dowel, reach, {dowel.x - reach, dowel.y - reach, low},
                     {dowel.x + reach, dowel.y + reach, high}))
            tell(found, l, dowel, "dowel.wood",
                 fmt::format("the pattern's surface comes nearer than {:.2f} mm to its holes", clearance_),
                 clearance_);
    }

    /// Whether no surface is in an upright cylinder: not in the ball around the box, or else in none of the
    /// halves of the box that the cylinder meets. Boxes of kSmall count as surface.
    [[nodiscard]] bool is_free(const JointDowel& dowel, double reach, const Point3& low,
                               const Point3& high) const {
        constexpr double kSmall = 0.05;  // mm
        const double dx = std::max({low[0] - dowel.x, 0.0, dowel.x - high[0]}),
                     dy = std::max({low[1] - dowel.y, 0.0, dowel.y - high[1]});
        if (std::hypot(dx, dy) > reach) return true;
        Point3 middle{}, size{};
        for (std::size_t k = 0; k < 3; ++k) {
            middle[k] = (low[k] + high[k]) / 2;
            size[k] = high[k] - low[k];
        }
        const double ball = std::sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2]) / 2;
        const double nearer = ball * (1 - 1e-9);
        if (part_.from_facets(middle, ball, nearer) > nearer) return true;
        if (ball < kSmall) return false;
        const auto longest =
            static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
        Point3 end = high, begin = low;
        end[longest] = begin[longest] = middle[longest];
        return is_free(dowel, reach, low, end) && is_free(dowel, reach, begin, high);
    }

    Context& context_;
    const SimulationInput& input_;
    const StandingPart& part_;
    const double clearance_;
};

}  // namespace

std::optional<Program> above_dowels(const Program& program, const SimulatedLayer& layer, const Tool& tool) {
    std::optional<Program> lifted;
    for (const JointDowel& dowel : layer.dowels) {
        const TipRoom room(dowel, layer, tool);
        if (room.radius < 0) continue;
        const std::vector<ProgramStep>& steps = program.steps;
        for (std::size_t begin = 0; begin < steps.size();) {
            if (!room.holds(steps[begin])) {
                ++begin;
                continue;
            }
            std::size_t end = begin;
            bool is_down = false;
            for (; end < steps.size() && room.holds(steps[end]); ++end) is_down |= steps[end].z < layer.z_top;
            const bool from_above = steps[begin].z >= layer.z_top && steps[end - 1].z >= layer.z_top;
            const bool has_arc =
                std::any_of(program.arcs.begin(), program.arcs.end(),
                            [&](const ProgramArc& a) { return a.begin < end && a.end > begin; });
            if (is_down && from_above && !has_arc) {
                if (!lifted) lifted = program;
                for (std::size_t i = begin; i < end; ++i)
                    lifted->steps[i].z = std::max(steps[i].z, layer.z_top);
            }
            begin = end;
        }
    }
    return lifted;
}

void fill_dowels(Stock& stock, const SimulatedLayer& layer) {
    for (const JointDowel& dowel : layer.dowels)
        stock.fill({dowel.x, dowel.y}, dowel.diameter / 2 + kDowelTolerance,
                   layer.z_top - dowel.below - kPointMost * dowel.diameter - kDowelTolerance, layer.z_top);
}

std::vector<Violation> check_dowels(Context& context, const SimulationInput& input, const StandingPart& part,
                                    double clearance) {
    return DowelCheck(context, input, part, clearance).run();
}

}  // namespace slabwright
