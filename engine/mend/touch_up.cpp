#include "engine/mend/touch_up.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "engine/mend/free_cutter.h"
#include "engine/moves/path_builder.h"
#include "engine/simulate/reach.h"

namespace slabwright {

namespace {

constexpr double kFine = 0.01;     // mm to which the deepest that a tool reaches is looked for
constexpr double kWorth = 0.02;    // mm: less is not worth going for
constexpr double kAsDeep = 0.03;   // mm by which another place may cover a point less deep
constexpr double kScrape = 0.15;   // mm that may stand under a core that goes straight down
constexpr double kBeside = 3;      // mm: so near, a tool goes across without leaving the stock
constexpr double kStraight = 0.5;  // mm over what stands, from where a tool goes down slowly
constexpr double kLink = 2;        // mm over the layer's top, where rapids go
constexpr double kShare = 0.5;     // of the gouge tolerance that a place may use up

struct Touch {
    Point3 tip{};
    double from = 0;  // mm: how high what it takes stands
};

/// What is left, in squares of `kSide` mm, so that what lies near a place is found.
class Left {
public:
    explicit Left(std::span<const MissedPlace> missed) {
        for (const MissedPlace& m : missed) squares_[square(m.surface[0], m.surface[1])].push_back(m.surface);
    }
    /// The highest of what is left within `radius` mm of a place, seen from above; `none` where nothing is.
    [[nodiscard]] double highest(const Point3& at, double radius, double none) const {
        double top = none;
        for (int i = cell(at[0] - radius); i <= cell(at[0] + radius); ++i)
            for (int j = cell(at[1] - radius); j <= cell(at[1] + radius); ++j)
                if (const auto found = squares_.find({i, j}); found != squares_.end())
                    for (const Point3& s : found->second)
                        if (std::hypot(s[0] - at[0], s[1] - at[1]) <= radius) top = std::max(top, s[2]);
        return top;
    }

private:
    static constexpr double kSide = 2;
    static int cell(double v) { return static_cast<int>(std::floor(v / kSide)); }
    static std::pair<int, int> square(double x, double y) { return {cell(x), cell(y)}; }
    std::map<std::pair<int, int>, std::vector<Point3>> squares_;
};

/// The deepest under a point that the tools reach, as far as `height` down.
std::optional<Reach::Covering> deepest(Reach& reach, const MissedPlace& m) {
    const auto at = [&](double down) {
        return reach.covering({m.surface[0], m.surface[1], m.surface[2] - down});
    };
    if (auto whole = at(m.height)) return whole;
    double low = 0, high = m.height;
    std::optional<Reach::Covering> best;
    while (high - low > kFine) {
        const double mid = (low + high) / 2;
        if (auto found = at(mid)) best = found, low = mid;
        else high = mid;
    }
    return low > kWorth ? best : std::nullopt;
}

class TouchUp {
public:
    TouchUp(const Job& job, const StandingPart& part, const Layer& layer, const Tool& tool)
        : job_(job),
          layer_(layer),
          tool_(tool),
          free_(part, layer.z_top, tool, 0, kShare * job.tolerances.gouge) {}

    /// @param touches in any order
    Operation operation(std::vector<Touch> touches) const {
        Operation op;
        op.kind = tool_.kind == ToolKind::flat ? OperationKind::corner : OperationKind::finish;
        op.purpose = "what the proof found left";
        op.tool = tool_.number;
        op.spindle_rpm = std::min(tool_.max_rpm, job_.machine.max_rpm);
        PathBuilder path(op, tool_, std::min(job_.cutting.finish_feed, job_.machine.max_feed),
                         layer_.z_top + job_.machine.clearance, layer_.z_top + kLink);
        std::optional<Touch> last;
        for (const Touch& t : nearest_first(std::move(touches))) {
            const Point2 at{to_units(t.tip[0]), to_units(t.tip[1])};
            const std::int32_t z = units_up(t.tip[2]);
            if (last && may_cross(*last, t)) {
                const std::int32_t over = std::max(path.z(), z);
                path.sink(over);
                path.cut(at, over);
            } else {
                path.retract();
                path.go_above(at);
                path.sink(std::max(z, units_up(std::max(t.tip[2], t.from) + kStraight)));
            }
            path.plunge(z);
            last = t;
        }
        if (!path.finish()) op.moves.clear();
        return op;
    }

private:
    static std::int32_t units_up(double mm) {
        return static_cast<std::int32_t>(std::ceil(mm * kUnitsPerMm - 0.01));
    }

    /// Straight across at the height of the higher of two places.
    [[nodiscard]] bool may_cross(const Touch& from, const Touch& to) const {
        if (std::hypot(to.tip[0] - from.tip[0], to.tip[1] - from.tip[1]) > kBeside) return false;
        const double z = std::max(from.tip[2], to.tip[2]);
        return free_.is_free({from.tip[0], from.tip[1], z}, {to.tip[0], to.tip[1], z});
    }

    /// Each followed by the nearest that is left; of equals by the first.
    static std::vector<Touch> nearest_first(std::vector<Touch> touches) {
        for (std::size_t k = 1; k < touches.size(); ++k) {
            std::size_t best = k;
            double least = 1e300;
            for (std::size_t m = k; m < touches.size(); ++m)
                if (const double way = std::hypot(touches[m].tip[0] - touches[k - 1].tip[0],
                                                  touches[m].tip[1] - touches[k - 1].tip[1]);
                    way < least)
                    least = way, best = m;
            std::swap(touches[k], touches[best]);
        }
        return touches;
    }

    const Job& job_;
    const Layer& layer_;
    const Tool& tool_;
    FreeCutter free_;
};

}  // namespace

std::vector<Operation> touch_up(const Job& job, const StandingPart& part, const Layer& layer,
                                std::span<const MissedPlace> missed, double lowest_tip) {
    std::vector<MissedPlace> largest(missed.begin(), missed.end());
    std::stable_sort(largest.begin(), largest.end(),
                     [](const MissedPlace& a, const MissedPlace& b) { return a.height > b.height; });
    std::vector<Tool> plunging;
    for (const Tool& t : job.tools)
        if (core_diameter_of(t) <= 0) plunging.push_back(t);
    Reach any(part, job.tools, layer.z_bottom, layer.z_top, lowest_tip),
        straight(part, plunging, layer.z_bottom, layer.z_top, lowest_tip);
    const Left left(missed);
    const auto tool_of = [&](int number) -> const Tool& {
        return *std::find_if(job.tools.begin(), job.tools.end(),
                             [&](const Tool& t) { return t.number == number; });
    };
    // Whether the core would come down on what is left.
    const auto crushes = [&](const Reach::Covering& at) {
        const double core = core_diameter_of(tool_of(at.tool)) / 2;
        return core > 0 && left.highest(at.tip, core, at.tip[2]) > at.tip[2] + kScrape;
    };
    std::map<int, std::vector<Touch>> touches;  // by tool
    // Whether a place that was found for another covers this one as far down.
    const auto is_touched = [&](const MissedPlace& m) {
        const double down = m.surface[2] - m.height + kAsDeep;
        for (const auto& [number, of] : touches) {
            const Tool& tool = tool_of(number);
            const double R = tool.diameter / 2;
            for (const Touch& t : of) {
                const double dx = m.surface[0] - t.tip[0], dy = m.surface[1] - t.tip[1],
                             r2 = dx * dx + dy * dy;
                if (r2 > R * R) continue;
                const double up = under_side(cutter_shape(tool)).height(std::sqrt(r2));
                if (t.tip[2] + up <= down) return true;
            }
        }
        return false;
    };
    for (const MissedPlace& m : largest) {
        if (is_touched(m)) continue;
        std::optional<Reach::Covering> at = deepest(any, m);
        if (at && crushes(*at)) at = deepest(straight, m);
        if (!at) continue;
        std::vector<Touch>& of = touches[at->tool];
        const Touch touch{at->tip, left.highest(at->tip, tool_of(at->tool).diameter / 2, at->tip[2])};
        if (std::none_of(of.begin(), of.end(), [&](const Touch& t) { return t.tip == touch.tip; }))
            of.push_back(touch);
    }
    std::vector<Operation> operations;
    for (const ToolKind kind : {ToolKind::flat, ToolKind::ball, ToolKind::tapered_ball})
        for (auto& [number, of] : touches) {
            const Tool& tool = tool_of(number);
            if (tool.kind != kind) continue;
            Operation op = TouchUp(job, part, layer, tool).operation(std::move(of));
            if (!op.moves.empty()) operations.push_back(std::move(op));
        }
    return operations;
}

}  // namespace slabwright
