// How a path gets down to where its next run begins.
#include "engine/moves/path_builder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slabwright {

namespace {

constexpr std::array kHelixRadii{
    0.9, 0.65, 0.45};  // of the cutter's radius: under it, so that no post is left in the middle
constexpr int kSideRings = 6,
              kSideWays = 16;          // places looked at beside a run that no helix and no ramp reaches
constexpr double kSideStep = 0.4;      // of the cutter's radius, between their rings
constexpr double kClearOfPost = 1.02;  // of the core's radius: the least radius of a helix
constexpr double kOverStock = 0.1;     // mm of air where a helix or a ramp begins
constexpr double kMostTurns = 100, kMostLegs = 1000;
constexpr double kLongestRamp = 4;     // of the cutter's radius
constexpr double kShortestRamp = 0.5;  // of it, where that is less than 1 mm
constexpr double kRampStep = 0.1;      // of it, to which the free length of a way is looked for

}  // namespace

PathBuilder::Mark PathBuilder::here() const {
    return {operation_.moves.size(),
            operation_.moves.empty() ? Move{} : operation_.moves.back(),
            x_,
            y_,
            z_,
            above_,
            started_,
            down_};
}

// Nothing may have been cut since.
void PathBuilder::go_back(const Mark& mark) {
    operation_.moves.resize(mark.moves);
    if (!operation_.moves.empty()) operation_.moves.back() = mark.last;
    learnt_ = std::min(learnt_, mark.moves);
    x_ = mark.x, y_ = mark.y, z_ = mark.z, above_ = mark.above;
    started_ = mark.started, down_ = mark.down;
}

// To the start of a run and down to it. A slice along a wall is no plunge: only what stands under the middle
// of the cutter asks for a helix or a ramp; of a short way down, what no edge has passed over on the ways
// before it. Says whether there was a way in. Where there was none, the tool is where it was, or went
// straight to over the start through air.
bool PathBuilder::enter(std::span<const PathPoint> run) {
    const PathPoint& first = run.front();
    const Point2 at{first.x, first.y};
    const double most = plunges_ ? kPlunge : kScrape;
    if (around_.from_side && standing_middle(at) > to_mm(first.z) + most && enter_from_side(first))
        return true;
    Mark mark = here();
    if (go_straight(at, first.z)) mark = here();
    else go_above(at);
    descend(first);
    const bool far = to_mm(z_ - first.z) > most;
    if (far ? standing_middle(at) > to_mm(first.z) + most : comes_down_on_stock(first)) {
        if (!enter_on_helix(run) && !enter_on_ramp(run) && !plunges_) {
            go_back(mark);
            return enter_from_side(first) || enter_beside(first);
        }
    }
    plunge(first.z);
    return true;
}

// Round a circle, from the direction (ux, uy) of its middle; none where the part does not leave it free.
// @param known whether its first place is free
std::optional<PathBuilder::Helix> PathBuilder::helix(std::array<double, 2> middle, double radius, double ux,
                                                     double uy, std::int32_t z, bool known) const {
    // Round a circle wider than the core, no point is under it for longer.
    Helix helix{{}, slope_under_core(2 * radius * std::asin(core_ / radius)), radius};
    // Chords that the machine takes as fast as the circle: no farther from it than it may pass by a corner.
    const double chord = std::min(around_.chord, std::sqrt(8 * radius * operation_.blend));
    const int chords = static_cast<int>(std::ceil(2 * std::numbers::pi * radius / chord));
    for (int k = 0; k <= chords; ++k) {
        const double turn = 2 * std::numbers::pi * (k % chords) / chords, c = std::cos(turn),
                     s = std::sin(turn);
        helix.circle.push_back(
            {middle[0] + radius * (ux * c - uy * s), middle[1] + radius * (uy * c + ux * s)});
        const std::array<double, 2>& p = helix.circle.back();
        if (known && k % chords == 0) continue;
        if (around_.part->stands_over(p[0], p[1], to_mm(z)) || !has_room({to_units(p[0]), to_units(p[1])}))
            return std::nullopt;
    }
    return helix;
}

// Whole turns, none steeper than the ramp, that end at a place of the circle, its first.
bool PathBuilder::wind_down(const Helix& helix, const PathPoint& end) {
    const int chords = static_cast<int>(helix.circle.size()) - 1;
    double top = standing_middle({end.x, end.y});
    for (std::size_t k = 0; k + 1 < helix.circle.size(); ++k)
        top = std::max(top, around_.standing->free_tip(around_.cutter, helix.circle[k], helix.circle[k + 1]));
    const double drop = (top + kOverStock - to_mm(end.z)) * kUnitsPerMm;
    const double turns = std::ceil(drop / (2 * std::numbers::pi * helix.radius * kUnitsPerMm * helix.slope));
    if (turns > kMostTurns) return false;
    sink(end.z + static_cast<std::int32_t>(drop));
    const int places = static_cast<int>(turns) * chords, level = core_ > 0 ? chords : 0;
    for (int k = 1; k <= places + level; ++k) {
        const std::array<double, 2>& p = helix.circle[static_cast<std::size_t>(k % chords)];
        const Point2 at = k % chords == 0 ? Point2{end.x, end.y} : Point2{to_units(p[0]), to_units(p[1])};
        const double left = std::max(0.0, 1 - static_cast<double>(k) / places);
        cut(at, end.z + static_cast<std::int32_t>(std::ceil(drop * left)));
    }
    return true;
}

// Around a circle on the left of the run, where it is free, that ends in the run's direction. The part lies
// on the right of a run that climbs, so the circle's room is looked for on the other side.
bool PathBuilder::enter_on_helix(std::span<const PathPoint> run) {
    if (around_.part == nullptr || around_.cutter.is_ball() || around_.cutter.taper_rad > 0) return false;
    const PathPoint& first = run.front();
    double ux = 0, uy = 0;
    for (std::size_t k = 1; k < run.size() && ux == 0 && uy == 0; ++k) {
        if (run[k].z != first.z) return false;
        ux = static_cast<double>(run[k].x) - first.x;
        uy = static_cast<double>(run[k].y) - first.y;
    }
    const double length = std::hypot(ux, uy);
    if (length == 0) return false;
    ux /= length;
    uy /= length;
    for (const double share : kHelixRadii) {
        const double radius = share * around_.cutter.radius;
        if (radius < kClearOfPost * core_) return false;
        // The first place lies at the angle of the run's right side, seen from the centre.
        if (const auto way = helix({to_mm(first.x) - radius * uy, to_mm(first.y) + radius * ux}, radius, uy,
                                   -ux, first.z, true))
            return wind_down(*way, first);
    }
    return false;
}

// To and fro over the run's beginning, every point of it raised by what is still to go down.
bool PathBuilder::enter_on_ramp(std::span<const PathPoint> run) {
    const PathPoint& first = run.front();
    const double longest = kLongestRamp * around_.cutter.radius * kUnitsPerMm;
    double length = 0;
    std::vector<PathPoint> stretch{first};
    for (std::size_t k = 1; k < run.size() && length < longest; ++k) {
        const PathPoint& p = run[k - 1];
        PathPoint q = run[k];
        if (core_ > 0 && q.z != first.z) break;
        const double way = std::hypot(static_cast<double>(q.x) - p.x, static_cast<double>(q.y) - p.y);
        if (length + way > longest) {
            const double t = (longest - length) / way;
            q = {p.x + static_cast<std::int32_t>(t * (static_cast<double>(q.x) - p.x)),
                 p.y + static_cast<std::int32_t>(t * (static_cast<double>(q.y) - p.y)), std::max(p.z, q.z)};
        }
        length += std::min(way, longest - length);
        stretch.push_back(q);
    }
    return ramp_down(stretch, length);
}

// @param length of the stretch seen from above, 0.1 µm
bool PathBuilder::ramp_down(std::vector<PathPoint> stretch, double length) {
    const PathPoint first = stretch.front();
    double height = standing_middle({first.x, first.y}) - to_mm(first.z);
    for (std::size_t k = 1; k < stretch.size(); ++k) {
        const PathPoint &p = stretch[k - 1], &q = stretch[k];
        height = std::max(
            height, around_.standing->free_tip(middle(), {to_mm(p.x), to_mm(p.y)}, {to_mm(q.x), to_mm(q.y)}) -
                        to_mm(std::min(p.z, q.z)));
    }
    const double drop = (height + kOverStock) * kUnitsPerMm, slope = slope_to_and_fro(stretch);
    const double shortest = std::min(1.0, kShortestRamp * around_.cutter.radius) * kUnitsPerMm;
    const double legs = length > shortest && slope > 0 ? 2 * std::ceil(drop / (2 * length * slope)) : 0;
    if (legs <= 0 || legs >= kMostLegs) return false;
    sink(first.z + static_cast<std::int32_t>(drop));
    double done = 0;
    const int level = core_ > 0 ? 2 : 0;
    for (int leg = 0; leg < static_cast<int>(legs) + level; ++leg) {
        if (leg > 0) std::reverse(stretch.begin(), stretch.end());
        for (std::size_t k = 1; k < stretch.size(); ++k) {
            const PathPoint &p = stretch[k - 1], &q = stretch[k];
            done += std::hypot(static_cast<double>(q.x) - p.x, static_cast<double>(q.y) - p.y);
            cut({q.x, q.y}, q.z + static_cast<std::int32_t>(
                                      std::ceil(std::max(0.0, drop * (1 - done / (length * legs))))));
        }
    }
    return true;
}

// The nearest place beside a run's beginning where the cutter is free and its middle meets nothing, and from
// which it may go straight across; of places as near the one nearest to where the tool is.
std::optional<Point2> PathBuilder::place_beside(const PathPoint& first) {
    if (around_.part == nullptr) return std::nullopt;
    std::optional<Point2> best;
    double least = kUnbounded;
    for (int ring = 1; ring <= kSideRings && !best; ++ring)
        for (int k = 0; k < kSideWays; ++k) {
            const double turn = 2 * std::numbers::pi * k / kSideWays,
                         far = ring * kSideStep * around_.cutter.radius * kUnitsPerMm;
            const Point2 beside{first.x + static_cast<std::int32_t>(std::lround(far * std::cos(turn))),
                                first.y + static_cast<std::int32_t>(std::lround(far * std::sin(turn)))};
            const double way =
                std::hypot(static_cast<double>(beside.x) - x_, static_cast<double>(beside.y) - y_);
            if (way >= least || !has_room(beside) ||
                around_.part->stands_over(to_mm(beside.x), to_mm(beside.y), to_mm(first.z) - around_.under) ||
                standing_middle(beside) > to_mm(first.z) + kScrape ||
                !part_leaves_way(beside, {first.x, first.y}, first.z))
                continue;
            least = way;
            best = beside;
        }
    return best;
}

// Down there, and from there straight across: into the corner of a pocket that was cleared before.
bool PathBuilder::enter_from_side(const PathPoint& first) {
    const std::optional<Point2> beside = place_beside(first);
    if (!beside) return false;
    if (!go_straight(*beside, first.z)) go_above(*beside);
    descend({beside->x, beside->y, first.z});
    plunge(first.z);
    cut({first.x, first.y}, first.z);
    return true;
}

// Beside a run, at the nearest place from which the cutter may go straight across: round a circle, the widest
// that is free there; else to and fro over the longest straight way that is, through that place.
bool PathBuilder::enter_beside(const PathPoint& first) {
    if (around_.part == nullptr || around_.cutter.is_ball() || around_.cutter.taper_rad > 0) return false;
    for (int ring = 0; ring <= kSideRings; ++ring)
        for (int k = 0; k < (ring == 0 ? 1 : kSideWays); ++k) {
            const double turn = 2 * std::numbers::pi * k / kSideWays, c = std::cos(turn), s = std::sin(turn),
                         far = ring * kSideStep * around_.cutter.radius * kUnitsPerMm;
            const PathPoint beside{first.x + static_cast<std::int32_t>(std::lround(far * c)),
                                   first.y + static_cast<std::int32_t>(std::lround(far * s)), first.z};
            if (ring > 0 && !is_free(beside)) continue;
            // The circle's end is its place that is nearest to the run.
            if (wind_down_around(beside, -c, -s, first) || ramp_down_from(beside, first)) return true;
        }
    return false;
}

// Whether the part and the room of the machine leave a place free.
bool PathBuilder::is_free(const PathPoint& p) const {
    return !around_.part->stands_over(to_mm(p.x), to_mm(p.y), to_mm(p.z)) && has_room({p.x, p.y});
}

bool PathBuilder::wind_down_around(const PathPoint& middle, double ux, double uy, const PathPoint& to) {
    for (const double share : kHelixRadii) {
        const double radius = share * around_.cutter.radius;
        if (radius < kClearOfPost * core_) return false;
        const auto way = helix({to_mm(middle.x), to_mm(middle.y)}, radius, ux, uy, to.z, false);
        if (!way) continue;
        const PathPoint end{to_units(way->circle[0][0]), to_units(way->circle[0][1]), to.z};
        if (!part_leaves_way({end.x, end.y}, {to.x, to.y}, to.z)) continue;
        const Mark mark = here();
        go_above({end.x, end.y});
        descend(end);
        if (wind_down(*way, end)) {
            cut({to.x, to.y}, to.z);
            return true;
        }
        go_back(mark);
    }
    return false;
}

bool PathBuilder::ramp_down_from(const PathPoint& from, const PathPoint& to) {
    if (!part_leaves_way({from.x, from.y}, {to.x, to.y}, to.z)) return false;
    const double step = std::min(around_.chord, kRampStep * around_.cutter.radius),
                 longest = kLongestRamp * around_.cutter.radius;
    const auto place = [&](double far, double turn) {
        return PathPoint{from.x + to_units(far * std::cos(turn)), from.y + to_units(far * std::sin(turn)),
                         to.z};
    };
    const auto free_way = [&](double turn) {
        double far = 0;
        while (far + step <= longest / 2 && is_free(place(far + step, turn))) far += step;
        return far;
    };
    PathPoint begin = from, end = from;
    double length = 0;
    for (int k = 0; k < kSideWays / 2; ++k) {
        const double turn = 2 * std::numbers::pi * k / kSideWays, ahead = free_way(turn),
                     back = free_way(turn + std::numbers::pi);
        if (ahead + back > length)
            length = ahead + back, begin = place(back, turn + std::numbers::pi), end = place(ahead, turn);
    }
    if (length < 2 * core_) return false;
    const Mark mark = here();
    go_above({begin.x, begin.y});
    descend(begin);
    if (ramp_down({begin, end},
                  std::hypot(static_cast<double>(end.x) - begin.x, static_cast<double>(end.y) - begin.y))) {
        cut({from.x, from.y}, to.z);
        cut({to.x, to.y}, to.z);
        return true;
    }
    go_back(mark);
    return false;
}

}  // namespace slabwright
