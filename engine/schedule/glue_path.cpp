#include "engine/schedule/glue_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "engine/schedule/fit.h"
#include "engine/schedule/heights.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

namespace {

constexpr const char* kMissedGlue = "glue.missed";
constexpr double kLeastTold = 10;  // mm²

/// The heights of the rows, 0.1 µm.
class Rows {
public:
    explicit Rows(const Plan& plan)
        : low_(plan.stock_min[1] * kUnitsPerMm), pitch_(plan.job.machine.glue_pitch * kUnitsPerMm) {}
    [[nodiscard]] std::int32_t y(std::int64_t row) const {
        return static_cast<std::int32_t>(std::llround(low_ + (static_cast<double>(row) + 0.5) * pitch_));
    }
    /// The first row at or above a height.
    [[nodiscard]] std::int64_t first_from(std::int32_t height) const {
        auto row = static_cast<std::int64_t>(std::floor((height - low_) / pitch_ - 0.5));
        while (y(row) < height) ++row;
        return row;
    }

private:
    double low_, pitch_;
};

/// Least and greatest y.
std::pair<std::int32_t, std::int32_t> heights_of(std::span<const Point2> points) {
    const auto [low, high] = std::minmax_element(points.begin(), points.end(),
                                                 [](const Point2& a, const Point2& b) { return a.y < b.y; });
    return {low->y, high->y};
}

double length_of(const GlueRun& bead) { return to_mm(std::abs(std::int64_t{bead.to} - bead.from)); }

/// The most beads that one x crosses.
int most_at_once(const std::vector<GlueRun>& beads) {
    std::vector<std::pair<std::int32_t, int>> ends;
    for (const GlueRun& b : beads) {
        ends.emplace_back(std::min(b.from, b.to), 1);
        ends.emplace_back(std::max(b.from, b.to), -1);
    }
    std::sort(ends.begin(), ends.end());  // one that ends where another begins is closed first
    int open = 0, most = 0;
    for (const auto& [x, change] : ends) most = std::max(most, open += change);
    return most;
}

}  // namespace

std::vector<GlueRun> glue_beads(const Plan& plan, const Loops& glue) {
    const GlueHead head = glue_head_of(plan.job.machine);
    std::vector<GlueRun> beads;
    if (head == GlueHead::none) return beads;
    if (glue.points.empty()) return beads;
    const auto [low, high] = heights_of(glue.points);
    const Rows rows(plan);
    std::vector<double> y;
    for (std::int64_t row = rows.first_from(low); rows.y(row) < high; ++row) y.push_back(rows.y(row));
    const std::vector<std::vector<Span>> spans = line_spans(glue, y);
    bool to_least = head == GlueHead::slab;
    for (std::size_t r = 0; r < y.size(); ++r) {
        const std::size_t first = beads.size();
        for (const Span& span : spans[r]) {  // inwards, to whole units
            const auto from = static_cast<std::int32_t>(std::ceil(span.low)),
                       to = static_cast<std::int32_t>(std::floor(span.high));
            if (to - from >= kShortestBead * kUnitsPerMm)
                beads.push_back({static_cast<std::int32_t>(y[r]), from, to});
        }
        if (to_least) {
            std::reverse(beads.begin() + static_cast<std::ptrdiff_t>(first), beads.end());
            for (std::size_t i = first; i < beads.size(); ++i) std::swap(beads[i].from, beads[i].to);
        }
        if (head == GlueHead::stack && beads.size() > first) to_least = !to_least;
    }
    return beads;
}

double glue_between_rows(const Plan& plan, const Loops& glue) {
    if (glue_head_of(plan.job.machine) == GlueHead::none) return 0;
    const Rows rows(plan);
    double missed = 0;
    for (std::size_t i = 0; i < glue.size(); ++i) {
        const auto loop = glue.loop(i);
        if (loop.empty()) continue;
        const auto [low, high] = heights_of(loop);
        if (rows.y(rows.first_from(low)) < high) continue;
        missed += signed_area(loop);  // a hole takes its own away
    }
    return std::max(0.0, missed);
}

GluePass glue_pass(const Plan& plan, const std::vector<GlueRun>& beads) {
    const Machine& machine = plan.job.machine;
    const bool under_way = glue_head_of(machine) == GlueHead::slab;
    GluePass pass;
    if (beads.empty()) return pass;
    for (const GlueRun& b : beads) pass.bead_mm += length_of(b);
    const double g_mm = plan.job.bonding.glue_g_per_m2 * machine.glue_pitch * 1e-6;
    pass.grams = g_mm * pass.bead_mm;
    pass.speed = under_way ? std::min(machine.glue_speed, machine.handler_speed) : machine.glue_speed;
    const double most_g_mm = g_mm * (under_way ? most_at_once(beads) : 1);
    if (machine.pump_g_min > 0 && most_g_mm > 0)
        pass.speed = std::min(pass.speed, machine.pump_g_min / most_g_mm);
    pass.pump_g_min = most_g_mm * pass.speed;
    if (!under_way) {
        double between = 0;
        for (std::size_t i = 1; i < beads.size(); ++i)
            between += std::hypot(to_mm(std::int64_t{beads[i].from} - beads[i - 1].to),
                                  to_mm(std::int64_t{beads[i].y} - beads[i - 1].y));
        pass.seconds = (pass.bead_mm / pass.speed + between / machine.rapid_feed) * 60;
        return pass;
    }
    std::int32_t least = beads[0].to, most = beads[0].from;
    for (const GlueRun& b : beads) {
        least = std::min(least, b.to);
        most = std::max(most, b.from);
    }
    // The stock's middle lies at the handler's; what is nearer to the build chamber meets the head first.
    const double middle = (plan.stock_min[0] + plan.stock_max[0]) / 2, head = handler_way(machine) / 2;
    pass.handler_begin = head - (to_mm(most) - middle);
    pass.handler_end = head - (to_mm(least) - middle);
    pass.seconds = handler_seconds(machine, 0, pass.handler_begin) +
                   (pass.handler_end - pass.handler_begin) / pass.speed * 60;
    return pass;
}

double handler_seconds(const Machine& machine, double from, double to) {
    return has_handler(machine) ? std::abs(to - from) / machine.handler_speed * 60 : 0;
}

double bonding_seconds(const Job& job, double glue_mm2, double length) {
    const Machine& machine = job.machine;
    const Bonding& bonding = job.bonding;
    double seconds = press_seconds(job);
    if (has_handler(machine))
        seconds += 2 * handler_seconds(machine, 0, handler_way(machine)) + machine.grip_s;
    else seconds += bonding.handling_s;
    switch (glue_head_of(machine)) {
        case GlueHead::slab:
            return seconds + length * 60 * std::max(0.0, 1 / machine.glue_speed - 1 / machine.handler_speed);
        case GlueHead::stack:
            return seconds + glue_mm2 / machine.glue_pitch / machine.glue_speed * 60;
        default:
            return seconds + bonding.glue_s_per_m2 * glue_mm2 * 1e-6;
    }
}

void note_missed_glue(Plan& plan) {
    std::erase_if(plan.diagnostics, [](const Diagnostic& d) { return d.code == kMissedGlue; });
    for (const Layer& layer : plan.layers)
        for (const Joint& joint : layer.joints) {
            const double missed = glue_between_rows(plan, joint.glue);
            if (missed < kLeastTold) continue;
            plan.diagnostics.push_back(
                {Severity::note,
                 kMissedGlue,
                 fmt::format("joint at {:.2f} mm, layer {}: {:.1f} cm2 of its {:.1f} cm2 of glue lie between "
                             "the beads of the glue head, {:.1f} mm apart: put them on by hand",
                             joint.z, layer.index, missed / 100, joint.area_mm2 / 100,
                             plan.job.machine.glue_pitch),
                 {}});
        }
}

void check_handler(const Plan& plan) {
    const Machine& machine = plan.job.machine;
    if (glue_head_of(machine) != GlueHead::slab) return;
    const double way = handler_way(machine), middle = (plan.stock_min[0] + plan.stock_max[0]) / 2;
    for (const Layer& layer : plan.layers) {
        const Blank slab = slab_of(plan, layer);
        const double over = std::max(slab.max[0] - middle, middle - slab.min[0]) - way / 2;
        if (over <= 0) continue;
        throw refusal(
            "machine.handler_travel",
            fmt::format("the slab of layer {} is {:.1f} mm long; the handler, which carries it {:.1f} mm, "
                        "ends {:.1f} mm before all of it has passed the glue head half-way",
                        layer.index, slab.length(), way, over),
            fmt::format("layer {}", layer.index),
            "give the machine's own machine.handler_travel, or machine.glue_head = \"none\"");
    }
}

}  // namespace slabwright
