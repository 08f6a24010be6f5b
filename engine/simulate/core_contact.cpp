#include "engine/simulate/core_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace slabwright {

namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr double kSame = 1e-3;          // mm: heights this near are one
constexpr double kTextRounding = 2e-3;  // mm that the text's rounding may add to a fall
constexpr double kRecessMargin = 0.05;  // mm

}  // namespace

/// A straight motion, seen from above.
struct CoreContact::Way {
    double x = 0, y = 0;    // of its begin
    double ux = 0, uy = 0;  // its direction
    double length = 0;
    double z0 = 0, z1 = 0;
    double allowed = 0;   // mm that may stand over the tip's plane under the core
    bool counts = false;  // whether more than that is a finding
    std::uint32_t line = 0;

    /// The tip's height after a share of the way.
    [[nodiscard]] double z(double t) const { return z0 + t * (z1 - z0); }
    /// The lowest that the tip is between two shares of it.
    [[nodiscard]] double lowest(double from, double to) const { return std::min(z(from), z(to)); }
};

CoreContact::CoreContact(const Tool& tool, const CellGrid& grid)
    : grid_(grid),
      radius_(core_diameter_of(tool) / 2),
      rim_(tool.diameter / 2),
      slope_(std::tan(std::min(ramp_limit_deg(tool), 89.9) * std::numbers::pi / 180)),
      allowed_on_ramp_(std::max(kScrape, core_recess(tool) + kRecessMargin)) {}

bool CoreContact::concerns(Stock& stock, const ProgramStep& from, const ProgramStep& to) const {
    if (!remembered_.empty()) return true;
    if (to.rapid() || to.z >= from.z) return false;
    return !stock.clear(std::min(from.x, to.x) - radius_, std::max(from.x, to.x) + radius_,
                        std::min(from.y, to.y) - radius_, std::max(from.y, to.y) + radius_, to.z);
}

void CoreContact::follow(const Stock& stock, const ProgramStep& from, const ProgramStep& to) {
    Way way{from.x, from.y, 0, 0, std::hypot(to.x - from.x, to.y - from.y), from.z, to.z, 0, false, to.line};
    if (way.length > 0) way.ux = (to.x - from.x) / way.length, way.uy = (to.y - from.y) / way.length;
    const double fall = from.z - to.z;
    const bool down = fall > 0 && !to.rapid();
    way.counts = down;
    way.allowed = fall <= slope_ * way.length + kTextRounding ? allowed_on_ramp_ : kScrape;
    for (std::size_t k = 0; k < remembered_.size();) {
        const std::size_t cell = remembered_[k];
        follow_cell(way, cell, stands_[cell], stock.top(cell));
        if (stands_[cell] != kNothing) {
            ++k;
            continue;
        }
        remembered_[k] = remembered_.back();
        remembered_.pop_back();
    }
    if (!down) return;
    const auto index = [&](double at, double first, int count) {
        return std::clamp(static_cast<int>(std::floor((at - first) / grid_.cell)), 0, count);
    };
    const int i0 = index(std::min(from.x, to.x) - radius_, grid_.x0, grid_.nx),
              i1 = index(std::max(from.x, to.x) + radius_ + grid_.cell, grid_.x0, grid_.nx),
              j0 = index(std::min(from.y, to.y) - radius_, grid_.y0, grid_.ny),
              j1 = index(std::max(from.y, to.y) + radius_ + grid_.cell, grid_.y0, grid_.ny);
    for (int j = j0; j < j1; ++j)
        for (int i = i0; i < i1; ++i) {
            const std::size_t cell = grid_.index(i, j);
            if (!stands_.empty() && stands_[cell] != kNothing) continue;
            const double top = stock.top(cell);
            if (top <= to.z + kSame) continue;
            follow_cell(way, cell, top, top);
            if (!stands_.empty() && stands_[cell] != kNothing) remembered_.push_back(cell);
        }
}

// @param stands    z of what stands in the cell, @param simulated what the stock shows, which the motion has
// not met yet
void CoreContact::follow_cell(const Way& way, std::size_t cell, double stands, double simulated) {
    const int i = static_cast<int>(cell % static_cast<std::size_t>(grid_.nx)),
              j = static_cast<int>(cell / static_cast<std::size_t>(grid_.nx));
    const double dx = grid_.x(i) - way.x, dy = grid_.y(j) - way.y;
    const double along = dx * way.ux + dy * way.uy, across2 = dx * dx + dy * dy - along * along;
    const double rim2 = rim_ * rim_ - across2, core2 = radius_ * radius_ - across2;
    if (rim2 <= 0) return;
    // The stretches of the way, in shares of it: under the disc from `first` to `last`, of that under the
    // core from `in` to `out`. A way of no length is under one of them all the time.
    double first = 0, last = 1, in = 1, out = 1;
    if (way.length > 0) {
        const double rim = std::sqrt(rim2), core = core2 > 0 ? std::sqrt(core2) : 0;
        first = std::max(0.0, (along - rim) / way.length), last = std::min(1.0, (along + rim) / way.length);
        if (first > last) return;
        in = std::clamp((along - core) / way.length, first, last);
        out = std::clamp((along + core) / way.length, first, last);
    } else if (core2 > 0) {
        in = 0;
    }
    // A core that takes no share of the way is not there.
    const bool under_core = core2 > 0 && (way.length <= 0 || out > in);
    if (!under_core) in = out = last;
    if (in > first) stands = std::min(stands, way.lowest(first, in));
    const bool known = !stands_.empty() && stands_[cell] != kNothing;
    double borne = known ? static_cast<double>(borne_[cell]) : 0;
    if (under_core && way.counts) {
        const double over = stands - way.lowest(in, out);
        if (over > std::max(way.allowed, borne + kSame)) {
            if (told_.empty()) told_.assign(grid_.count(), 0);
            findings_.cells += told_[cell] == 0;
            told_[cell] = 1;
            if (findings_.lines.empty() || findings_.lines.back().first != way.line)
                findings_.lines.emplace_back(way.line, over);
            else findings_.lines.back().second = std::max(findings_.lines.back().second, over);
            if (over > findings_.deepest) {
                findings_.deepest = over;
                findings_.where = {grid_.x(i), grid_.y(j)};
                findings_.z = way.lowest(in, out);
                findings_.line = way.line;
            }
        } else {
            borne = std::max(borne, over);
        }
    }
    if (out < last) stands = std::min(stands, way.lowest(out, last));
    const double shown = std::min(simulated, way.lowest(first, last));
    if (stands > shown + kSame) {
        if (stands_.empty()) stands_.assign(grid_.count(), kNothing), borne_.assign(grid_.count(), 0);
        stands_[cell] = static_cast<float>(stands);
        borne_[cell] = static_cast<float>(borne);
    } else if (!stands_.empty()) {
        stands_[cell] = kNothing;
    }
}

}  // namespace slabwright
