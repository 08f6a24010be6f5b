#include "engine/forces/op_cuts.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slabwright {

namespace {

constexpr double kFinestCell = 0.2;   // mm
constexpr double kLeastTaken = 1e-4;  // mm: less is rounding, of paths and of heights

CutterEnd end_of(const Tool& tool) { return {tool.kind == ToolKind::ball ? CutterEnd::Form::ball : CutterEnd::Form::flat, tool.diameter / 2, 0}; }

}  // namespace

double StandingSlab::cell_for(const Job& job, std::array<double, 2> stock_min, std::array<double, 2> stock_max) {
    const double plane = (stock_max[0] - stock_min[0]) * (stock_max[1] - stock_min[1]);
    return std::max({kFinestCell, std::min(job.cutting.wall_allowance, 0.5), std::sqrt(plane / kMostCells)});
}

StandingSlab::StandingSlab(std::array<double, 2> stock_min, std::array<double, 2> stock_max, double bottom, double top, double cell)
    : grid_{stock_min[0] + cell / 2, stock_min[1] + cell / 2, cell, std::max(1, static_cast<int>(std::lround((stock_max[0] - stock_min[0]) / cell))),
            std::max(1, static_cast<int>(std::lround((stock_max[1] - stock_min[1]) / cell)))},
      bottom_(bottom),
      height_(grid_.count(), static_cast<float>(top - bottom)) {}

void StandingSlab::run(const Operation& operation, const Tool& tool, const std::function<void(const CutStretch&)>& stretch) {
    const CutterEnd end = end_of(tool);
    const double enough = std::max(end.radius / 2, 3 * grid_.cell), area = grid_.cell * grid_.cell;
    CutStretch now;
    double volume = 0, low = 1e300, high = -1e300, side = 0;
    const auto finish = [&] {
        if (now.length > 0) {
            if (volume > 0) {
                now.low = std::max(0.0, low), now.high = high;
                now.width = std::min(tool.diameter, volume / (std::max(now.length, 2 * grid_.cell) * (now.high - now.low)));
                now.left = side > 0;
            }
            stretch(now);
        }
        now = {};
        volume = 0, low = 1e300, high = -1e300, side = 0;
    };
    // One short straight way.
    const auto step = [&](std::uint32_t move, const std::array<double, 3>& from, const std::array<double, 3>& to) {
        const double dx = to[0] - from[0], dy = to[1] - from[1], length = std::hypot(dx, dy), tip = std::min(from[2], to[2]);
        sweep_above(
            grid_, end, {from[0], from[1], from[2] - bottom_}, {to[0], to[1], to[2] - bottom_}, [&](std::size_t c) { return height_[c]; },
            [&](std::size_t c, double z) {
                const double stood = height_[c], left = std::max(0.0, z);
                if (stood - left < kLeastTaken) return;
                height_[c] = static_cast<float>(left);
                volume += (stood - left) * area;
                low = std::min(low, left + bottom_ - tip);
                high = std::max(high, stood + bottom_ - tip);
                const auto j = static_cast<int>(c / static_cast<std::size_t>(grid_.nx)), i = static_cast<int>(c % static_cast<std::size_t>(grid_.nx));
                side += (stood - left) * (dx * (grid_.y(j) - from[1]) - dy * (grid_.x(i) - from[0]));
            });
        if (length == 0) return;
        if (now.length == 0) now.first = move;
        now.last = move;
        now.length += length;
        now.at = to;
        if (now.length >= enough) finish();
    };
    for (std::size_t k = 1; k < operation.moves.size(); ++k) {
        const Move &a = operation.moves[k - 1], &b = operation.moves[k];
        if (b.feed == 0) {
            finish();
            continue;
        }
        const std::array<double, 3> from{to_mm(a.x), to_mm(a.y), to_mm(a.z)}, to{to_mm(b.x), to_mm(b.y), to_mm(b.z)};
        const auto move = static_cast<std::uint32_t>(k);
        if (now.length > 0 && operation.moves[now.last].feed != b.feed) finish();
        if (a.x == b.x && a.y == b.y) {
            finish();
            step(move, from, to);
            volume = 0, low = 1e300, high = -1e300, side = 0;
            continue;
        }
        if (b.is_arc()) {
            // Chords that miss the arc by less than a tenth of a cell, and are no longer than a stretch.
            const ArcShape arc = arc_shape(a, b);
            const double most = std::min({2 * std::acos(std::max(0.0, 1 - 0.1 * grid_.cell / arc.radius)), enough / arc.radius, 0.5});
            const int parts = std::max(1, static_cast<int>(std::ceil(std::abs(arc.sweep) / most)));
            std::array<double, 3> last = from;
            for (int p = 1; p <= parts; ++p) {
                const double angle = arc.start + arc.sweep * p / parts;
                const std::array<double, 3> next =
                    p == parts ? to : std::array<double, 3>{arc.x + arc.radius * std::cos(angle), arc.y + arc.radius * std::sin(angle), to[2]};
                step(move, last, next);
                last = next;
            }
            continue;
        }
        const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
        const int parts = std::max(1, static_cast<int>(std::ceil(length / (2 * enough))));
        std::array<double, 3> last = from;
        for (int p = 1; p <= parts; ++p) {
            const double t = static_cast<double>(p) / parts;
            const std::array<double, 3> next =
                p == parts ? to
                           : std::array<double, 3>{from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1]), from[2] + t * (to[2] - from[2])};
            step(move, last, next);
            last = next;
        }
    }
    finish();
}

}  // namespace slabwright
