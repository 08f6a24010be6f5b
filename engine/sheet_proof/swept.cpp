#include "engine/sheet_proof/swept.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slabwright {

namespace {

/// Outlines of swept() that overlap.
Loops swept_by(std::span<const AxisPoint> axis, double kerf) {
    Loops loops;
    constexpr int around = 8;  // of each half circle
    for (std::size_t i = 0; i + 1 < axis.size(); ++i) {
        const AxisPoint &p = axis[i], &q = axis[i + 1];
        double dx = q.x - p.x, dy = q.y - p.y;
        const double l = std::hypot(dx, dy);
        double half = kerf / 2;
        if (l > 1e-6) {
            dx /= l, dy /= l;
            const double lean =
                std::max(std::abs(p.lean_x * dy - p.lean_y * dx), std::abs(q.lean_x * dy - q.lean_y * dx));
            half *= std::hypot(1, lean);
        } else {
            dx = 1, dy = 0;
        }
        const double first = std::atan2(dx, -dy);  // the left normal
        for (int k = 0; k <= around; ++k) {
            const double a = first + std::numbers::pi * k / around;
            loops.points.push_back(unit_point(p.x + half * std::cos(a), p.y + half * std::sin(a)));
        }
        for (int k = 0; k <= around; ++k) {
            const double a = first + std::numbers::pi * (1 + double(k) / around);
            loops.points.push_back(unit_point(q.x + half * std::cos(a), q.y + half * std::sin(a)));
        }
        loops.close_loop();
    }
    return loops;
}

}  // namespace

// A long axis is put together from halves: clipping is slow where many outlines lie one over
// the other, as they do where a head turns in one place.
Loops swept(std::span<const AxisPoint> axis, double kerf) {
    constexpr std::size_t at_once = 24;
    if (axis.size() <= at_once) return unite(swept_by(axis, kerf), {});
    const std::size_t half = axis.size() / 2;
    return unite(swept(axis.first(half + 1), kerf), swept(axis.subspan(half), kerf));
}

ReadHead unplaced(const ReadHead& head, const ReadPiece& piece) {
    const double x = head.x - piece.x, y = head.y - piece.y;
    switch (((piece.turn % 360) + 360) % 360) {
        case 90:
            return {y, -x, head.a, head.c - 90};
        case 180:
            return {-x, -y, head.a, head.c - 180};
        case 270:
            return {-y, x, head.a, head.c - 270};
        default:
            return {x, y, head.a, head.c};
    }
}

}  // namespace slabwright
