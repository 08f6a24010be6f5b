#include "engine/paths/operations/rest_places.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/operations/roughing.h"
#include "engine/paths/runs/flask_room.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr double kFinest = 0.04;  // mm between places where the rest jumps: a wall is met within this, or
                                  // within twice the allowance kept off it
constexpr double kOver = 0.5;     // mm over all that stands for it: how much higher a place lies is not asked

}  // namespace

RestPlaces::RestPlaces(const LayerCut& cut, LayerStock& stock, const Tool& tool, const RestPass& pass)
    : cut_(cut),
      stock_(stock),
      tool_(tool),
      pass_(pass),
      ball_(has_ball_tip(tool.kind)),
      r_(tool.diameter / 2),
      tip_r_(tip_diameter(tool) / 2),
      wide_(tip_r_ + pass.allowance),
      under_(ball_ ? pass.allowance : 0),
      end_(cutter_end(tool)),
      lowering_(has_taper(tool.kind) ? under_side(cutter_shape(tool)).eroded(pass.skin) : Envelope{}),
      targets_(cut.context, stock, pass, finish_slopes(cut.job.cutting).levels_from,
               (!pass.in_steps || pass.skin > 0)
                   ? &cut.drops(flat_cutter(pass.in_steps ? std::min(pass.limit, tip_r_ / 2) : pass.limit))
                   : nullptr,
               r_),
      tolerance_(std::max(cut.job.tolerances.gouge, pass.allowance)),
      chord_(safe_chord_mm(wide_, tolerance_)),
      step_(safe_step(wide_, tolerance_)),
      finest_(to_units(std::max(kFinest, 2 * pass.allowance))),
      finest_step_(safe_step(tip_r_, cut.job.tolerances.gouge)) {}

double RestPlaces::worth(std::size_t cell) const {
    return pass_.in_steps ? pass_.limit / 2
                          : std::clamp(0.2 * static_cast<double>(stock_.left(cell)), 0.015, 0.05);
}

bool RestPlaces::lowers(double x, double y, double tip, double slack) const {
    const CellGrid& grid = stock_.grid();
    const double core = r_ - pass_.skin;
    const double above = tip + (ball_ ? pass_.skin : 0) - stock_.z_bottom();
    return targets_.any_near(x, y, core + slack, above, [&](int i, int j) {
        const std::size_t c = grid.index(i, j);
        if (stock_.height(c) <= above) return false;
        if (static_cast<double>(stock_.left(c)) <= enough()) return false;
        double z = above;
        if (lowering_.radius > 0) {
            const double from_axis = std::max(0.0, std::hypot(grid.x(i) - x, grid.y(j) - y) - slack);
            z += lowering_.height(std::min(core, from_axis)) - lowering_.low;
        } else if (ball_) {
            const double dx = grid.x(i) - x, dy = grid.y(j) - y,
                         from_axis = std::max(0.0, std::sqrt(dx * dx + dy * dy) - slack);
            z += core - std::sqrt(std::max(0.0, core * core - from_axis * from_axis));
        } else if (end_.form == CutterEnd::Form::other) {
            const double from_axis = std::max(0.0, std::hypot(grid.x(i) - x, grid.y(j) - y) - slack);
            z += end_.under.height(std::min(r_, from_axis));
        }
        z = std::max(z, static_cast<double>(stock_.surface(c)));
        return (stock_.height(c) - z) * stock_.nz(c) > worth(c);
    });
}

bool RestPlaces::beside_flask(double x, double y) const {
    if (room_.empty()) return true;
    const CellGrid& grid = stock_.grid();
    const long i = std::lround((x - grid.x0) / grid.cell), j = std::lround((y - grid.y0) / grid.cell);
    return i >= 0 && j >= 0 && i < grid.nx && j < grid.ny &&
           room_[grid.index(static_cast<int>(i), static_cast<int>(j))];
}

void RestPlaces::find_room() {
    if (cut_.layer.opening.empty()) return;
    const CellGrid& grid = stock_.grid();
    const Loops room =
        flask_room(cut_, r_ + 0.75 * grid.cell);  // a cell's corners are as clear as its middle
    room_.assign(grid.count(), 0);
    const std::vector<std::vector<Span>> inside = line_spans(room, rows_of(grid));
    for (int j = 0; j < grid.ny; ++j)
        for (const Span& s : inside[static_cast<std::size_t>(j)])
            for (int i = 0; i < grid.nx; ++i)
                if (const double x = grid.x(i) * kUnitsPerMm; x >= s.low && x <= s.high)
                    room_[grid.index(i, j)] = 1;
}

RestPlace RestPlaces::place(std::int32_t ux, std::int32_t uy, MetPoints& met, bool high) const {
    const double x = to_mm(ux), y = to_mm(uy);
    // How far a flat end mill would go under the layer's bottom does not matter.
    const double matters = ball_ ? -std::numeric_limits<double>::infinity()
                                 : std::max(cut_.layer.z_bottom, cut_.layer.floor_below);
    Place p;
    p.x = ux;
    p.y = uy;
    // A flat end mill's leaning walls lead down into slots that are hardly wider (settle), from as high
    // as they are.
    p.tip = ball_ && !high
                ? stock_.z_bottom() + std::max(0.0, static_cast<double>(targets_.highest_near(x, y))) + kOver
                : std::numeric_limits<double>::infinity();
    const std::optional<Rest> found = index_->drop_within(x, y, matters, p.tip - under_, &met);
    if (!found) return p;
    const Rest& rest = *found;
    const double on_surface = rest.tip_z + under_;
    const auto stand = [&](double lowest) {
        p.tip = std::max(on_surface, std::max(lowest, cut_.layer.floor_below));
        p.touches = p.tip == on_surface;
        p.contact = {x - wide_ * rest.nx, y - wide_ * rest.ny, p.tip - under_ + wide_ * (1 - rest.nz)};
        p.reachable = !rest.on_cap && p.tip < cut_.layer.z_top - 1e-3 && beside_flask(x, y);
        if (!p.reachable) return;
        p.z = to_units(p.tip) + 1;
        p.useful = lowers(x, y, p.tip);
    };
    // A flat end mill stands on the layer's bottom; a ball may pass it where its shape needs it, over
    // waste only for what it leaves beside its tip there.
    const bool waste = ball_ && on_surface <= cut_.layer.z_bottom - tip_r_;
    stand(ball_ && !waste ? cut_.layer.floor_below : cut_.layer.z_bottom);
    if (waste && p.reachable && !p.useful && !pass_.in_steps &&
        lowers(x, y, std::max(on_surface, cut_.layer.floor_below)))
        stand(cut_.layer.floor_below);
    return p;
}

RestPlace RestPlaces::on_line(const LineDirection& direction, std::int32_t along, std::int32_t across,
                              MetPoints& met) const {
    const auto [x, y] = direction.place(along, across);
    Place p = place(x, y, met);
    p.along = along;
    return p;
}

double RestPlaces::lowest_between(const Place& a, const Place& b, double beside) const {
    double lowest = std::max(cut_.layer.floor_below, -std::numeric_limits<double>::max());
    const double ax = to_mm(a.x), ay = to_mm(a.y), way = std::hypot(to_mm(b.x) - ax, to_mm(b.y) - ay);
    const double c = way > 0 ? (to_mm(b.x) - ax) / way : 1, s = way > 0 ? (to_mm(b.y) - ay) / way : 0;
    for (const Place* p : {&a, &b}) {
        if (!p->touches) continue;
        const double x = p->contact[0] - ax, y = p->contact[1] - ay, along = c * x + s * y,
                     ahead = std::max(std::abs(along), std::abs(way - along)),
                     aside = std::abs(c * y - s * x) + beside,
                     over2 = wide_ * wide_ - ahead * ahead - aside * aside;
        if (over2 > 0) lowest = std::max(lowest, p->contact[2] + std::sqrt(over2) - wide_ + under_);
    }
    return lowest;
}

bool RestPlaces::too_far(const Place& a, const Place& b, double beside) const {
    if (!a.reachable && !b.reachable) return false;
    const double apart = std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y));
    if (!ball_) {
        if (std::abs(a.tip - b.tip) <= kJump) return false;
        if (a.useful || b.useful) return true;
        // Neither place helps, but one between them may, where the lower of them is stopped by a wall.
        const Place& low = a.tip < b.tip ? a : b;
        return lowers(to_mm(low.x), to_mm(low.y), low.tip, apart);
    }
    if (a.reachable && b.reachable) {
        const double c =
            std::hypot(a.contact[0] - b.contact[0], a.contact[1] - b.contact[1], a.contact[2] - b.contact[2]);
        const double d = std::hypot(to_mm(a.x) - to_mm(b.x), to_mm(a.y) - to_mm(b.y), a.tip - b.tip);
        if (c * d <= 8 * wide_ * (pass_.in_steps ? pass_.limit / 2 : cut_.job.tolerances.cusp)) return false;
    }
    if (a.useful || b.useful) return true;
    return lowers((to_mm(a.x) + to_mm(b.x)) / 2, (to_mm(a.y) + to_mm(b.y)) / 2, lowest_between(a, b, beside),
                  std::hypot(apart / 2, beside));
}

bool RestPlaces::too_steep(const Place& a, const Place& b) const {
    if (!ball_ || !(a.useful || b.useful) || b.along - a.along <= finest_step_ || !a.reachable ||
        !b.reachable)
        return false;
    return std::hypot(to_mm(a.x) - to_mm(b.x), to_mm(a.y) - to_mm(b.y), a.tip - b.tip) > chord_;
}

RestPlace RestPlaces::slide(const Place& from) const {
    std::int32_t x = from.x, y = from.y;
    double tip = from.tip - under_;  // of the cutter that is dropped
    MetPoints met;
    for (std::int32_t stride = to_units(0.1); stride >= to_units(0.0005); stride /= 2)
        for (bool moved = true; moved;) {
            moved = false;
            for (const auto& [dx, dy] :
                 {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}) {
                const double at_x = to_mm(x + dx * stride), at_y = to_mm(y + dy * stride), less = tip - 1e-4;
                if (!(less < tip)) continue;  // under nothing there is no lower
                const std::optional<double> lower = index_->tip_within(at_x, at_y, just_under(less), &met);
                if (!lower) continue;
                x += dx * stride, y += dy * stride, tip = *lower, moved = true;
                break;
            }
            if (tip + under_ < cut_.layer.floor_below) break;
            if (std::hypot(to_mm(x - from.x), to_mm(y - from.y)) > 2 * r_) return {};
        }
    return place(x, y, met);
}

}  // namespace slabwright
