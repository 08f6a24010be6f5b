// Finishing by level contours: the ball end mill on slopes of 45° and more, the flat end mill on vertical
// walls. Of every contour only the stretches are cut whose contact lies on such a surface, within the layer.
#include "engine/paths/operations/levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/idle_runs.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/level_runs.h"
#include "engine/paths/runs/tolerances.h"
#include "engine/stock/layer_stock.h"
#include "kernels/cutting/cusp.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// Whether a ball that touches a wall this far over the layer's bottom, and none below, leaves more than the
// cusp where the wall reaches the bottom: the pass under it is needed then, though its contact lies in the
// layer below, on the wall that is there already.
bool leaves_foot(double r, double nz, double above_bottom, double cusp) {
    const double along = above_bottom / std::sqrt(1 - nz * nz);
    return along > 0 && (along >= r || r - std::sqrt(r * r - along * along) > cusp);
}

double vertical_nz(const LayerCut& cut) {
    return std::cos(cut.job.cutting.vertical_deg * std::numbers::pi / 180);
}

constexpr double kWorthLeaving = 80;  // mm, a second at a feed of 5000 mm/min

// Whether the stock's cells are so fine that none of what roughing keeps off walls stands between them.
bool sees_allowance(const LayerCut& cut) {
    constexpr double kShare = 0.9;
    return cut.stock != nullptr && cut.stock->grid().cell < kShare * cut.job.cutting.wall_allowance;
}

}  // namespace

Operation finish_walls(const LayerCut& cut) {
    const Tool& tool = cut.layer.tools.rough;
    Operation op = cut.operation(OperationKind::finish, "vertical walls", tool);
    const double r = tool.diameter / 2, gouge = cut.job.tolerances.gouge, vertical = vertical_nz(cut);
    double low = kUnbounded, high = -kUnbounded;  // of the vertical facets
    for (const SolidFacet& f : cut.solid.facets) {
        if (f.nz > vertical || f.z_max <= cut.layer.z_bottom ||
            (f.normal[0] == 0 && f.normal[1] == 0 && f.nz >= 0))
            continue;
        low = std::min(low, std::max(f.z_min, cut.layer.z_bottom));
        high = std::max(high, f.z_max);
    }
    if (low >= high) return op;
    // One level on every floor and on the layer's bottom, so that a wall is cut down to where it stands.
    std::vector<double> fixed{cut.layer.z_bottom};
    fixed.insert(fixed.end(), cut.floors.begin(), cut.floors.end());
    std::sort(fixed.begin(), fixed.end(), std::greater<>());
    fixed.erase(std::unique(fixed.begin(), fixed.end()), fixed.end());
    std::vector<double> tips;
    double z = high;
    for (const double f : fixed) {
        if (f >= high) continue;
        const int steps = std::max(1, static_cast<int>(std::ceil((z - f) / tool.stepdown_max - 1e-9)));
        for (int k = 1; k <= steps; ++k) {
            const double tip = k == steps ? f : z - (z - f) * k / steps;
            op.stepdown = std::max(op.stepdown, (z - f) / steps);
            tips.push_back(tip);
            if (tip < low) break;
        }
        z = f;
        if (tips.back() < low) break;
    }
    const CutterShape cutter = flat_cutter(r);
    const std::vector<Contours> contours = cut.contours(cutter, tips, safe_pitch(r, gouge));
    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed),
                     cut.layer.z_top + cut.job.machine.clearance, cut.layer.z_top + 2);
    const DropIndex& part = cut.drops(cutter);
    path.set_surroundings(cut.around(tool, &part));
    std::vector<std::vector<LevelRun>> runs(tips.size());
    for (std::size_t i = 0; i < tips.size(); ++i)
        for (std::size_t c = 0; c < contours[i].size(); ++c) {
            std::vector<char> wanted;
            for (std::size_t k = contours[i].starts[c]; k < contours[i].starts[c + 1]; ++k)
                wanted.push_back(contours[i].nz[k] <=
                                 vertical);  // under an overhang the shadow's border is the wall
            append_level_runs(contours[i], c, to_units(tips[i]), wanted, simplify_tolerance_units(gouge),
                              runs[i]);
        }
    if (sees_allowance(cut)) take_out_idle(cut, cutter, kWorthLeaving, runs);
    cut_levels(path, cut, tool, part, runs, true, LevelWays::climbing);
    path.finish();
    return op;
}

namespace {

// A level that follows the slope of what it cuts.
struct SpacedLevel {
    double contact = 0;  // height at which it touches the least slope, mm
    double step = 0;     // below the level before, mm
    bool cuts = false;
};

// Bands of α of the layer in which levels cut.
std::vector<StepBand> bands_of(const LayerCut& cut, std::span<const SpacedLevel> levels, double at_least,
                               double least_height) {
    constexpr double same = std::numbers::pi / 180;
    std::vector<StepBand> bands;
    for (const AlphaMap::Band& band : cut.alpha.bands(at_least, same, least_height)) {
        double step = 0;
        for (const SpacedLevel& level : levels)
            if (level.cuts && level.contact >= band.z_low && level.contact < band.z_high)
                step = std::max(step, level.step);
        if (step > 0)
            bands.push_back({std::max(band.z_low, cut.layer.z_bottom), band.z_high,
                             band.alpha * 180 / std::numbers::pi, step});
    }
    std::erase_if(bands, [](const StepBand& band) { return band.z_low >= band.z_high; });
    return bands;
}

// Heights of the floors on which walls of the layer stand, descending; those within kSameFloor are one.
std::vector<double> foot_floors(const LayerCut& cut) {
    std::vector<double> floors;
    for (const Flat& flat : cut.layer.feet) floors.push_back(flat.highest);
    std::sort(floors.begin(), floors.end(), std::greater<>());
    floors.erase(
        std::unique(floors.begin(), floors.end(), [](double a, double b) { return a - b < kSameFloor; }),
        floors.end());
    return floors;
}

constexpr double kNarrower = 0.02;  // mm, than the flat end mill: what stands beside it within its chords

// What a ball touches on an edge that stands out, above a wall. Of the levels that touch one edge the highest
// shapes what lies above it, and the lowest, or a flat end mill on a wall that is vertical, what lies below:
// near the edge each cuts one side of a plane through it, and what one between them would cut, one of these
// two does. Only where the flat end mill stands beside the edge: elsewhere waste stands, which is cut in
// steps.
class EdgeContacts {
public:
    /// @param flat the flat end mill of radius `flat_r`, a little narrower
    /// @param stepdown mm, of the flat end mill's levels along walls
    /// @param least_wall mm: of a lower one `flat` does not tell whether it is vertical
    /// @param flattest upwards part of the normal from which on levels do not cut
    EdgeContacts(const DropIndex& ball, const DropIndex& flat, double flat_r, double stepdown, double bottom,
                 double least_wall, double flattest)
        : ball_(ball),
          flat_(flat),
          flat_r_(flat_r),
          stepdown_(stepdown),
          bottom_(bottom),
          least_wall_(least_wall),
          flattest_(flattest) {}

    /// @param at of the ball's middle on a level, mm; @param out away from the part there
    /// @param nz upwards part of the normal in the contact
    /// @param above, below tips of the next levels, where there are such
    [[nodiscard]] bool made_by_others(const std::array<double, 2>& at, const std::array<double, 2>& out,
                                      double nz, double tip, std::optional<double> above,
                                      std::optional<double> below) const {
        const double r = ball_.cutter().radius, beside = r * std::sqrt(1 - nz * nz);
        const auto flat_stands = [&](double z) {
            const double more = flat_r_ - beside;
            return !flat_.stands_over(at[0] + more * out[0], at[1] + more * out[1], z);
        };
        // The ball about the same point of the edge, on another level, or where it begins to cut flatter
        // slopes.
        const auto ball_stands = [&](double level) {
            const double level_nz = std::min(nz + (level - tip) / r, flattest_);
            if (level_nz <= 0) return false;
            const double more = r * std::sqrt(1 - level_nz * level_nz) - beside;
            return !ball_.stands_over(at[0] + more * out[0], at[1] + more * out[1],
                                      tip + (level_nz - nz) * r + kTouch);
        };
        if (!ball_stands(above.value_or(kUnbounded)) || !flat_stands(tip)) return false;
        if (below && ball_stands(*below)) return true;
        const double contact = tip + r * (1 - nz), foot = std::max(bottom_, contact - stepdown_);
        return contact - foot >= least_wall_ && flat_stands(foot);
    }

private:
    static constexpr double kTouch = 1e-4;  // mm
    const DropIndex &ball_, &flat_;
    double flat_r_, stepdown_, bottom_, least_wall_, flattest_;
};

double way_between(Point2 a, Point2 b) {
    return std::hypot(to_mm(std::int64_t{b.x} - a.x), to_mm(std::int64_t{b.y} - a.y));
}

// Takes stretches that are spared out of what is wanted of a closed contour: all at the ends of what is
// wanted, others where leaving the contour and coming back takes no longer.
void spare_long(std::span<const Point2> contour, const std::vector<char>& spared, std::vector<char>& wanted) {
    const std::size_t n = contour.size();
    std::size_t start = n;
    for (std::size_t k = 0; k < n && start == n; ++k)
        if (spared[k] == 0) start = k;
    if (start == n) {
        std::fill(wanted.begin(), wanted.end(), char{0});
        return;
    }
    for (std::size_t k = 1; k <= n; ++k) {
        if (spared[(start + k) % n] == 0) continue;
        const std::size_t first = k;
        double way = 0;
        for (; spared[(start + k) % n] != 0; ++k) {
            way += way_between(contour[(start + k - 1) % n], contour[(start + k) % n]);
        }
        const bool between = wanted[(start + first - 1) % n] != 0 && wanted[(start + k) % n] != 0;
        if (between && way < kWorthLeaving) continue;
        for (std::size_t i = first; i < k; ++i) wanted[(start + i) % n] = 0;
    }
}

// Calls fn(first, count) for the stretches of a closed contour on which wanted is `which`, unless that is the
// whole of it.
template <class Fn>
void for_each_stretch(const std::vector<char>& wanted, bool which, Fn&& fn) {
    const std::size_t n = wanted.size();
    const auto is = [&](std::size_t k) { return (wanted[k % n] != 0) == which; };
    std::size_t start = 0;
    while (start < n && is(start)) ++start;
    if (start == n) return;
    for (std::size_t k = start; k < start + n;) {
        std::size_t end = k;
        while (end < start + n && is(end)) ++end;
        if (end > k) fn(k, end - k);
        k = std::max(end, k + 1);
    }
}

// Takes out stretches that are nowhere steeper than `limit_nz`: projected paths make them as well, and a few
// millimetres here and there take longer to come to than to cut.
void leave_to_projection(std::span<const float> nz, double limit_nz, std::vector<char>& wanted) {
    std::vector<std::array<std::size_t, 2>> left;
    for_each_stretch(wanted, true, [&](std::size_t first, std::size_t count) {
        for (std::size_t k = first; k < first + count; ++k)
            if (nz[k % wanted.size()] < limit_nz) return;
        left.push_back({first, count});
    });
    for (const auto& [first, count] : left)
        for (std::size_t k = first; k < first + count; ++k) wanted[k % wanted.size()] = 0;
}

// Stays on the contour between stretches, but for the shortest, that are no farther from each other than it
// takes to leave it and to come back.
void bridge(std::span<const Point2> contour, std::vector<char>& wanted) {
    constexpr double longest = 20, shortest = 1;  // mm
    const std::size_t n = wanted.size();
    const auto length = [&](std::size_t first, std::size_t last) {
        double sum = 0;
        for (std::size_t k = first; k < last && sum <= longest; ++k)
            sum += way_between(contour[k % n], contour[(k + 1) % n]);
        return sum;
    };
    std::vector<char> long_ones(n, 0);
    for_each_stretch(wanted, true, [&](std::size_t first, std::size_t count) {
        if (length(first, first + count - 1) < shortest) return;
        for (std::size_t k = first; k < first + count; ++k) long_ones[k % n] = 1;
    });
    for_each_stretch(long_ones, false, [&](std::size_t first, std::size_t count) {
        if (length(first + n - 1, first + n + count) > longest) return;
        for (std::size_t k = first; k < first + count; ++k) wanted[k % n] = 1;
    });
}

constexpr double kDegree = std::numbers::pi / 180;

// The level contours of one layer.
class LevelContours {
public:
    explicit LevelContours(const LayerCut& cut)
        : cut_(cut),
          tool_(cut.layer.tools.finish),
          r_(tool_.diameter / 2),
          slopes_(finish_slopes(cut.job.cutting)),
          cutter_(ball_cutter(r_)),
          op_(cut.operation(OperationKind::finish, "level contours", tool_)) {}

    Operation run(std::vector<Diagnostic>& diagnostics) {
        if (slopes_.levels_from > std::numbers::pi / 2 || !find_walls()) return op_;
        place_levels(diagnostics);
        const FibreGrid grid = fibre_grid(cut_.solid, cutter_, safe_pitch(r_, cut_.job.tolerances.gouge));
        const std::vector<Contours> contours = cut_.contours(cutter_, tips_, grid.pitch);
        // A vertical wall belongs to the flat end mill wherever that can stand against the place of contact.
        const DropIndex flat(cut_.solid, flat_cutter(flat_r_ - kNarrower));
        const DropIndex& part = cut_.drops(cutter_);
        // So high a wall of the least slope that is called vertical leans out by as much as `flat` is
        // narrower.
        const double least_wall = kNarrower / std::tan((90 - cut_.job.cutting.vertical_deg) * kDegree);
        const EdgeContacts edges(part, flat, flat_r_, cut_.layer.tools.rough.stepdown_max,
                                 cut_.layer.z_bottom, least_wall, std::cos(slopes_.levels_from));
        flat_ = &flat, edges_ = &edges;
        std::vector<std::vector<LevelRun>> runs(tips_.size());
        parallel_each(cut_.context, tips_.size(), [&](std::size_t i) {
            append_wanted(contours[i],
                          {tips_[i], i > 0 ? std::optional(tips_[i - 1]) : std::nullopt,
                           i + 1 < tips_.size() ? std::optional(tips_[i + 1]) : std::nullopt},
                          nullptr, runs[i]);
        });
        for (std::size_t i = 0; i < tips_.size(); ++i) spaced_[i].cuts = !runs[i].empty();
        for (FootLevel& foot : feet(grid)) runs.push_back(std::move(foot.runs));
        op_.bands = bands_of(cut_, spaced_, slopes_.levels_keep, tool_.stepdown_max);
        if (sees_allowance(cut_)) take_out_idle(cut_, cutter_, kWorthLeaving, runs);
        PathBuilder path(op_, tool_, std::min(cut_.job.cutting.finish_feed, cut_.job.machine.max_feed),
                         cut_.layer.z_top + cut_.job.machine.clearance, cut_.layer.z_top + 2);
        path.set_surroundings(cut_.around(tool_, &part));
        cut_levels(path, cut_, tool_, part, runs, true, LevelWays::either);
        path.finish();
        return std::move(op_);
    }

private:
    // Between which heights walls are that levels finish; false where none is.
    bool find_walls() {
        low_ = kUnbounded, high_ = -kUnbounded;
        for (const SolidFacet& f : cut_.solid.facets) {
            if (f.nz > std::cos(slopes_.levels_from) || f.z_max <= cut_.layer.z_bottom ||
                (f.normal[0] == 0 && f.normal[1] == 0 && f.nz >= 0))
                continue;
            any_vertical_ |= f.nz <= vertical_;
            low_ = std::min(low_, std::max(f.z_min, cut_.layer.z_bottom));
            high_ = std::max(high_, f.z_max);
        }
        return low_ < high_;
    }

    // From the highest tip that may touch, down to the lowest whose contact is still in the layer.
    void place_levels(std::vector<Diagnostic>& diagnostics) {
        const Job& job = cut_.job;
        lowest_ = std::max(cut_.layer.floor_below, low_ - r_);
        double bite = 0;
        for (double z = high_; z > lowest_;) {
            const bool everywhere = job.cutting.uniform_steps;
            const double alpha =
                cut_.least_slope(everywhere ? low_ : z - tool_.stepdown_max,
                                 everywhere ? high_ : std::min(high_, z + r_), slopes_.levels_keep);
            double step = std::min(ball_level_stepdown(r_, alpha, job.tolerances.cusp), tool_.stepdown_max);
            if (step < job.cutting.min_stepdown) {
                bite = std::max(bite, ball_level_cusp(r_, alpha, job.cutting.min_stepdown));
                step = job.cutting.min_stepdown;
            }
            z = std::max(z - step, lowest_);
            spaced_.push_back({z + r_ * (1 - std::cos(alpha)), step});
            op_.stepdown = std::max(op_.stepdown, step);
            tips_.push_back(z);
        }
        if (bite > 0)
            diagnostics.push_back(
                {Severity::warning,
                 "finish.stepdown_floor",
                 fmt::format("layer {}: the smallest stepdown {:.2f} mm leaves a cusp of up to {:.3f} mm",
                             cut_.layer.index, job.cutting.min_stepdown, bite),
                 {}});
    }

    // A level's tip, and those one level higher and lower, where there are such, mm.
    struct Tips {
        double tip;
        std::optional<double> above, below;
    };
    // What of a level is cut. @param floor on whose walls' feet alone, where it is for them
    void append_wanted(const Contours& level, const Tips& tips, const NearFloor* floor,
                       std::vector<LevelRun>& out) const {
        for (std::size_t c = 0; c < level.size(); ++c) {
            const std::size_t first = level.starts[c], n = level.starts[c + 1] - first;
            std::vector<char> wanted(n, 0), spared(n, 0);
            for (std::size_t k = 0; k < n; ++k) {
                const double nz = std::max(0.0F, level.nz[first + k]);
                const Point2 p = level.points[first + k];
                if (!in_layer(nz, tips)) continue;
                if (floor && (nz < std::cos(80 * kDegree) || !(*floor)(p))) continue;
                wanted[k] = 1;
                const Point2 a = level.points[first + (k + n - 1) % n], b = level.points[first + (k + 1) % n];
                const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y,
                             l = std::hypot(dx, dy);
                if (l == 0) continue;
                // The solid is on the right, so the free side is on the left.
                const std::array<double, 2> out_of{-dy / l, dx / l};
                if (nz > vertical_) {
                    spared[k] = !cut_.job.cutting.uniform_steps &&
                                edges_->made_by_others({to_mm(p.x), to_mm(p.y)}, out_of, nz, tips.tip,
                                                       tips.above, tips.below);
                } else if (any_vertical_ && !flat_->stands_over(to_mm(p.x) + out_of[0] * (flat_r_ - r_),
                                                                to_mm(p.y) + out_of[1] * (flat_r_ - r_),
                                                                tips.tip + r_ * (1 - nz)))
                    wanted[k] = 0;
            }
            const auto contour = std::span(level.points).subspan(first, n);
            if (!cut_.job.cutting.uniform_steps) {
                const auto nz = std::span(level.nz).subspan(first, n);
                if (cut_.job.cutting.finish_strategy == FinishStrategy::split && floor == nullptr)
                    leave_to_projection(nz, std::cos((slopes_.levels_from + slopes_.projection_to) / 2),
                                        wanted);
                bridge(contour, wanted);
            }
            spare_long(contour, spared, wanted);
            append_level_runs(level, c, to_units(tips.tip), wanted,
                              simplify_tolerance_units(cut_.job.tolerances.gouge), out);
        }
    }
    // Whether a contact is steep enough, and made in this layer.
    [[nodiscard]] bool in_layer(double nz, const Tips& tips) const {
        const double contact = tips.tip + r_ * (1 - nz);
        if (nz > std::cos(slopes_.levels_from) || contact > cut_.layer.z_top + 1e-6) return false;
        return contact >= cut_.layer.z_bottom - 0.05 ||
               (tips.above && leaves_foot(r_, nz, *tips.above + r_ * (1 - nz) - cut_.layer.z_bottom,
                                          cut_.job.tolerances.cusp));
    }

    // The foot of a wall on a floor is a hollow: the ball turns from wall to floor within a small part of a
    // step. Levels close above every floor cut what lies there, and only that.
    struct FootLevel {
        double tip;
        std::vector<LevelRun> runs;
    };
    [[nodiscard]] std::vector<FootLevel> feet(const FibreGrid& grid) const {
        struct Foot {
            std::vector<SolidFacet> facets;  // of the floor
            std::vector<double> close;
            std::size_t first;  // of its sections
        };
        std::vector<Foot> on_floors;
        std::vector<double> foot_tips;
        for (const double floor : foot_floors(cut_)) {
            Foot foot{floor_facets(cut_, floor), {}, foot_tips.size()};
            for (double above = tool_.stepdown_max / 4; above > 0.02; above /= 2)
                if (floor + above < high_ && floor + above > lowest_) foot.close.push_back(floor + above);
            if (foot.close.empty() || foot.facets.empty()) continue;
            foot_tips.insert(foot_tips.end(), foot.close.begin(), foot.close.end());
            on_floors.push_back(std::move(foot));
        }
        const std::vector<Section> inside = cut_.insides(cutter_, foot_tips);  // in one look at the mesh
        std::vector<FootLevel> feet;
        for (const Foot& foot : on_floors) {
            const std::vector<double>& close = foot.close;
            const NearFloor near(cut_, foot.facets, r_, grid);
            const LayerSolid around =
                solid_near(cut_.context, cut_.solid, foot.facets, 2 * (r_ + to_mm(grid.pitch)));
            const std::vector<Contours> level =
                contours_near(cut_.context, around, close,
                              std::span(inside).subspan(foot.first, close.size()), cutter_, grid);
            const std::size_t begin = feet.size();
            for (const double tip : close) feet.push_back({tip, {}});
            parallel_each(cut_.context, close.size(), [&](std::size_t i) {
                append_wanted(level[i], {close[i], std::nullopt, std::nullopt}, &near, feet[begin + i].runs);
            });
        }
        std::stable_sort(feet.begin(), feet.end(),
                         [](const FootLevel& a, const FootLevel& b) { return a.tip > b.tip; });
        return feet;
    }

    const LayerCut& cut_;
    const Tool& tool_;
    const double r_;
    const FinishSlopes slopes_;
    const CutterShape cutter_;
    Operation op_;
    const double vertical_ = vertical_nz(cut_), flat_r_ = cut_.layer.tools.rough.diameter / 2;
    bool any_vertical_ = false;  // else nothing goes along walls before, and edges are all that is as steep
    double low_ = 0, high_ = 0, lowest_ = 0;  // of the walls, and of the tips
    std::vector<double> tips_;
    std::vector<SpacedLevel> spaced_;
    const DropIndex* flat_ = nullptr;
    const EdgeContacts* edges_ = nullptr;
};

}  // namespace

Operation finish_levels(const LayerCut& cut, std::vector<Diagnostic>& diagnostics) {
    return LevelContours(cut).run(diagnostics);
}

}  // namespace slabwright
