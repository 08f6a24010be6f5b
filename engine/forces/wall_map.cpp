#include "engine/forces/wall_map.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace slabwright {

namespace {

constexpr double kStripHeights = 1.96;  // of the height, the length of a plate that bends under a point force

}  // namespace

double WallFoot::stress_mpa(double force_n, double height_mm) const {
    if (!(height_mm > 0) || !(force_n > 0)) return 0;
    const double section = thickness_mm * thickness_mm / 6;  // of a millimetre
    if (contact_mm > 0 && reach_mm() < height_mm)
        return force_n * reach_mm() / (std::min(height_mm, kStripHeights * reach_mm()) * section);
    const double strip = std::min(length_mm, kStripHeights * height_mm) * section;
    return force_n * height_mm / (contact_mm > 0 ? strip : std::min(strip, weakest_mm3));
}

double WallFoot::reach_mm() const {
    return contact_mm > 0 ? length_mm / std::max(1.0, contact_mm / thickness_mm) : 0;
}

WallFoot WallFoot::thicker_by(double mm) const {
    WallFoot thicker = *this;
    const double by = 1 + 2 * mm / thickness_mm;
    thicker.thickness_mm *= by;
    thicker.weakest_mm3 *= by * by;
    return thicker;
}

Diagnostic weak_wall(int layer, const LoadedWall& wall, double strength_mpa, WallCare care) {
    const StandingFoot& foot = *wall.foot;
    const bool lost = care == WallCare::lost;
    return {Severity::warning, "wall.weak",
            fmt::format("layer {}: a wall or pin {:.1f} mm thick stands {:.1f} mm high where {:.0f} N push "
                        "at it{}: {:.0f} MPa at its foot, more than the wood's {:.0f} MPa{}; {}, lay a "
                        "boundary nearer under its top, or make it thicker",
                        layer, foot.foot.thickness_mm, wall.height_mm, wall.force_n,
                        care == WallCare::feeds ? " at the least feed and in several passes" : "",
                        wall.stress_mpa, strength_mpa, lost ? ", and no feed or passes would save it" : "",
                        lost ? "hold it from beside while it is cut, turn the pattern"
                             : "cut it with a smaller tool or a lower finish_feed"),
            std::array{foot.middle[0], foot.middle[1], foot.z}};
}

WallMap::WallMap(std::span<const StandingFoot> feet, double strength_mpa, double widest_mm,
                 double allowance_mm)
    : strength_mpa_(strength_mpa), allowance_mm_(allowance_mm) {
    const double reach = 1.5 * widest_mm;
    for (const StandingFoot& foot : feet) {
        Near near;
        near.foot = &foot;
        near.low = {kUnbounded, kUnbounded};
        near.high = {-kUnbounded, -kUnbounded};
        for (const Point2 p : foot.outline->points) {
            const std::array<double, 2> at{to_mm(p.x), to_mm(p.y)};
            for (std::size_t i = 0; i < 2; ++i) {
                near.low[i] = std::min(near.low[i], at[i] - reach);
                near.high[i] = std::max(near.high[i], at[i] + reach);
            }
        }
        // Grown by a cell, so that a wall thinner than that holds the middle of one.
        const double cell = overhang_cell(near.low, near.high);
        const Loops grown = offset(*foot.outline, cell, cell / 4);
        const Loops* const region = &grown;
        near.distance = overhang_map({&region, 1}, near.low, near.high);
        feet_.push_back(std::move(near));
    }
}

WallBears WallMap::bears(const WallPush& push) const {
    WallBears weakest;
    if (push.kind == OperationKind::face) return weakest;
    const bool rough = push.kind == OperationKind::rough;
    for (const Near& near : feet_) {
        const StandingFoot& foot = *near.foot;
        if (push.x < near.low[0] || push.x > near.high[0] || push.y < near.low[1] || push.y > near.high[1])
            continue;
        if (push.low >= foot.top || push.high <= foot.z) continue;
        if (near.distance.at(push.x, push.y) > 1.5 * push.radius + near.distance.cell) continue;
        const bool stands_in_wood = rough && foot.in_layer;
        const double height = stands_in_wood ? std::min(push.high - foot.z, push.high - push.low)
                                             : std::max(0.0, (push.low + push.high) / 2 - foot.z);
        const double per_newton = stands_in_wood ? foot.foot.thicker_by(allowance_mm_).stress_mpa(1, height)
                                                 : foot.foot.stress_mpa(1, height);
        if (!(per_newton > 0)) continue;
        if (const double force = strength_mpa_ / per_newton; force < weakest.force_n)
            weakest = {force, &foot, height};
    }
    return weakest;
}

}  // namespace slabwright
