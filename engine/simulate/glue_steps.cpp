#include "engine/simulate/glue_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace slabwright {

namespace {

constexpr double kLeastBead = 1;                    // mm, that a head lays; what is left open may be as short
constexpr double kEnds = 0.01;                      // mm of a bead: both its ends are rounded
constexpr double kMass = 1e-3;                      // g
constexpr double kFarthest = 2e5;                   // mm: farther away nothing of a build lies
constexpr std::size_t kMostCrossings = 20'000'000;  // of the rows with the joint's border
constexpr double kRate = 1e-2;                      // mm/min and g/min

using Stretch = std::pair<double, double>;

double length_of(const Stretch& s) { return s.second - s.first; }

double overlap(const Stretch& a, const Stretch& b) {
    return std::max(0.0, std::min(a.second, b.second) - std::max(a.first, b.first));
}

/// What lies in a row of the head: the joint's glue, and the beads.
struct Row {
    std::vector<std::pair<double, int>> crossed;  // where the loops cross it, and which way
    std::vector<Stretch> inside, beads;

    /// Winding number over 0.
    void find_inside() {
        std::sort(crossed.begin(), crossed.end());
        int winding = 0;
        for (const auto& [x, turn] : crossed) {
            if (winding <= 0 && winding + turn > 0) {
                if (inside.empty() || x > inside.back().second) inside.emplace_back(x, x);
            }
            winding += turn;
            if (!inside.empty())
                inside.back().second = winding > 0 ? INFINITY : std::min(x, inside.back().second);
        }
    }
};

/// The head's rows, by their number: a pitch apart, from the stock's edge of least y.
class Head {
public:
    explicit Head(const BuildPlan& plan) : low_(plan.stock_min[1]), pitch_(plan.job.machine.glue_pitch) {}
    [[nodiscard]] double y(double row) const { return std::round((low_ + (row + 0.5) * pitch_) * 1e4) / 1e4; }
    [[nodiscard]] double nearest(double height) const { return std::round((height - low_) / pitch_ - 0.5); }

    /// None where a joint is so large, or has so many corners, that no head would lay it.
    [[nodiscard]] std::optional<std::map<double, Row>> rows(const StatedGlue& joint) const {
        std::map<double, Row> rows;
        std::size_t crossings = 0;
        if (!(std::abs(low_) <= kFarthest && std::abs(joint.min[1]) <= kFarthest &&
              std::abs(joint.max[1]) <= kFarthest))
            return std::nullopt;
        for (const auto& loop : joint.loops)
            for (std::size_t i = 0; i < loop.size(); ++i) {
                const auto &a = loop[i], &b = loop[(i + 1) % loop.size()];
                const double low = std::min(a[1], b[1]), high = std::max(a[1], b[1]);
                for (double row = nearest(low) - 1; y(row) < high; ++row) {
                    if (y(row) < low) continue;
                    if (++crossings > kMostCrossings) return std::nullopt;
                    rows[row].crossed.emplace_back(a[0] + (y(row) - a[1]) / (b[1] - a[1]) * (b[0] - a[0]),
                                                   a[1] > b[1] ? 1 : -1);
                }
            }
        for (auto& [number, row] : rows) row.find_inside();
        for (const auto& [height, from, to] : joint.beads)
            rows[nearest(height)].beads.emplace_back(std::min(from, to), std::max(from, to));
        return rows;
    }

private:
    double low_, pitch_;
};

/// The most beads that one x crosses.
int most_at_once(const std::vector<std::array<double, 3>>& beads) {
    std::map<double, int> changes;
    for (const auto& [y, from, to] : beads) {
        ++changes[std::min(from, to)];
        --changes[std::max(from, to)];
    }
    int open = 0, most = 0;
    for (const auto& [x, change] : changes) most = std::max(most, open += change);
    return most;
}

}  // namespace

void GlueSteps::check_place(double planned) {
    const std::optional<double> stated = number("handler_mm");
    if (!stated) return;
    const double way = handler_way(plan_.job.machine);
    if (*stated < -kLength || *stated > way + kLength)
        complain("sequence.travel",
                 fmt::format("brings the material handler to {:.1f} mm; it travels from 0 to {:.1f} mm",
                             *stated, way),
                 *stated < 0 ? -*stated : *stated - way);
    else expect("sequence.handler", "handler_mm", planned, kLength);
}

void GlueSteps::move_handler(double to) {
    check_place(to);
    expect_seconds(std::abs(to - s_.handler) / plan_.job.machine.handler_speed * 60, kSeconds);
    s_.handler = to;
}

void GlueSteps::check_pile(std::span<const DueSlab> slabs) {
    std::vector<std::pair<int, double>> piles;
    for (const DueSlab& slab : slabs) {
        if (piles.empty() || piles.back().second != slab.thickness) piles.emplace_back(0, slab.thickness);
        ++piles.back().first;
    }
    std::string pile;
    for (const auto& [count, thickness] : piles)
        pile += fmt::format("{}{} x {:.6g}", pile.empty() ? "" : ", ", count, thickness);
    expect_word("sequence.stack", "pile", pile);
}

void GlueSteps::check_cover(const StatedGlue& joint) {
    const Head head(plan_);
    for (const Bead& bead : joint.beads)
        if (const double y = head.y(head.nearest(bead[0])); !(std::abs(bead[0] - y) <= kLength)) {
            complain(
                "sequence.glue_path",
                fmt::format("a bead lies at y {:.4f} mm, the head's nearest row at {:.4f} mm", bead[0], y));
            return;
        }
    double off = 0, open = 0, twice = 0;
    std::optional<std::map<double, Row>> rows = head.rows(joint);
    if (!rows) {
        complain("sequence.glue_path", "its polygons are more than any head lays");
        return;
    }
    for (auto& [number, row] : *rows) {
        std::sort(row.beads.begin(), row.beads.end());
        std::vector<double> covered(row.inside.size());
        double reached = -INFINITY;
        for (const Stretch& bead : row.beads) {
            double on = 0;
            for (std::size_t i = 0; i < row.inside.size(); ++i) {
                on += overlap(bead, row.inside[i]);
                covered[i] += overlap({std::max(bead.first, reached), bead.second}, row.inside[i]);
            }
            if (length_of(bead) - on > kEnds) off += length_of(bead) - on;
            twice += std::max(0.0, std::min(reached, bead.second) - bead.first);
            reached = std::max(reached, bead.second);
        }
        for (std::size_t i = 0; i < row.inside.size(); ++i)
            if (length_of(row.inside[i]) - covered[i] > kLeastBead + kEnds)
                open += length_of(row.inside[i]) - covered[i];
    }
    if (off > 0)
        complain("sequence.glue_path", fmt::format("{:.2f} mm of its beads lie off the joint's glue", off),
                 off);
    if (twice > kEnds)
        complain("sequence.glue_path", fmt::format("{:.2f} mm of its beads lie on others", twice), twice);
    if (open > 0)
        complain("sequence.glue_path", fmt::format("leaves {:.2f} mm of the joint's rows without glue", open),
                 open);
}

double GlueSteps::check_pump(const std::vector<Bead>& beads, double length) {
    const Machine& machine = plan_.job.machine;
    const double g_mm = plan_.job.bonding.glue_g_per_m2 * machine.glue_pitch * 1e-6;  // of one bead
    const double most_g_mm = beads.empty() ? 0 : head() == GlueHead::slab ? g_mm * most_at_once(beads) : g_mm;
    double speed = beads.empty()              ? 0
                   : head() == GlueHead::slab ? std::min(machine.glue_speed, machine.handler_speed)
                                              : machine.glue_speed;
    if (machine.pump_g_min > 0 && most_g_mm * speed > machine.pump_g_min)
        speed = machine.pump_g_min / most_g_mm;
    expect("sequence.pump", "speed_mm_min", speed, kRate);
    if (g_mm == 0) return speed;
    expect("sequence.glue_mass", "glue_g", g_mm * length, kMass);
    if (const std::optional<double> rate = number("pump_g_min");
        rate && machine.pump_g_min > 0 && *rate > machine.pump_g_min + kRate)
        complain("sequence.pump", fmt::format("asks {:.2f} g/min of a pump that gives {:.2f} g/min", *rate,
                                              machine.pump_g_min));
    else expect("sequence.pump", "pump_g_min", most_g_mm * speed, kRate);
    return speed;
}

void GlueSteps::check_beads(const StatedGlue& joint) {
    const Machine& machine = plan_.job.machine;
    const std::vector<Bead>& beads = joint.beads;
    expect_word("sequence.glue_side", "side", head() == GlueHead::slab ? "slab" : "stack");
    check_cover(joint);
    double length = 0, least = INFINITY, most = -INFINITY, between = 0;
    for (std::size_t i = 0; i < beads.size(); ++i) {
        const auto& [y, from, to] = beads[i];
        length += std::abs(to - from);
        least = std::min({least, from, to});
        most = std::max({most, from, to});
        if (i > 0) between += std::hypot(from - beads[i - 1][2], y - beads[i - 1][0]);
    }
    expect("sequence.glue_path", "bead_mm", length, kLength);
    const double speed = check_pump(beads, length);
    if (head() != GlueHead::slab) {
        expect_seconds(beads.empty() ? 0 : (length / speed + between / machine.rapid_feed) * 60, kSeconds);
        return;
    }
    if (beads.empty()) {
        move_handler(s_.handler);
        return;
    }
    // The slab's middle is the handler's place; what of it is nearer to the table passes the head first.
    const double middle = (plan_.stock_min[0] + plan_.stock_max[0]) / 2, way = handler_way(machine);
    const double begin = way / 2 + middle - most, end = way / 2 + middle - least;
    if (begin < -kLength || end > way + kLength)
        complain("sequence.travel",
                 fmt::format("the material handler would go from {:.1f} to {:.1f} mm over the glue head; it "
                             "travels from 0 to {:.1f} mm",
                             begin, end, way),
                 std::max(-begin, end - way));
    check_place(end);
    expect_seconds((std::abs(begin - s_.handler) / machine.handler_speed + (end - begin) / speed) * 60,
                   kSeconds);
    s_.handler = end;
}

std::span<const JointDowel> GlueSteps::dowels_of(const DueSlab& slab) const {
    if (slab.number > 0 || slab.layer == 0) return {};
    return plan_.layers[slab.layer - 1].dowels;
}

void GlueSteps::check_dowels(const DueSlab& slab) {
    const std::span<const JointDowel> dowels = dowels_of(slab);
    if (dowels.empty()) return complain("sequence.dowels", "sets dowels in a joint that has none");
    expect("sequence.dowels", "count", static_cast<double>(dowels.size()), 0);
    expect("sequence.dowels", "diameter_mm", dowels.front().diameter, kLength);
    expect("sequence.dowels", "length_mm", dowels.front().length(), kLength);
    expect("sequence.dowels", "hole_mm", dowels.front().above, kLength);
    if (plan_.job_stated)
        expect_seconds(static_cast<double>(dowels.size()) * plan_.job.dowels.set_s, kSeconds);
}

}  // namespace slabwright
