#include "engine/moves/path_builder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/moves/motion_time.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr double kPointMiddle = 0.1;  // mm: the same of a point
constexpr double kBallMiddle = 0.75;  // of a ball's radius: what counts as head-on
constexpr double kRecessShare = 0.9;  // of a core's recess that helices and ramps fill

double distance_mm(const PathPoint& a, const PathPoint& b) {
    return std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y) / kUnitsPerMm;
}

// How far along a line from its beginning, seen from above, it first is `far` mm from there; none where it
// never is.
template <class Iterator>
std::optional<double> way_until_far(Iterator begin, Iterator end, double far) {
    double way = 0;
    for (Iterator p = begin, q = std::next(begin); q != end; p = q++) {
        const double ax = to_mm(p->x) - to_mm(begin->x), ay = to_mm(p->y) - to_mm(begin->y);
        const double dx = to_mm(q->x) - to_mm(p->x), dy = to_mm(q->y) - to_mm(p->y);
        const double length = std::hypot(dx, dy);
        if (std::hypot(ax + dx, ay + dy) >= far && length > 0) {
            // Within this segment: |a + t·d/length| = far.
            const double along = (ax * dx + ay * dy) / length;
            return way - along + std::sqrt(std::max(0.0, along * along + far * far - ax * ax - ay * ay));
        }
        way += length;
    }
    return std::nullopt;
}

// The longest way along a line between two of its points that are no farther than `far` mm from each other,
// the first of them a point of the list, as far as the line leads that far away.
double longest_within(std::span<const PathPoint> line, double far) {
    double longest = 0;
    for (std::size_t k = 0; k + 1 < line.size(); ++k)
        if (const auto way = way_until_far(line.begin() + static_cast<std::ptrdiff_t>(k), line.end(), far))
            longest = std::max(longest, *way);
    return longest;
}

}  // namespace

PathBuilder::PathBuilder(Operation& operation, const Tool& tool, double feed, double clearance_z,
                         double link_z)
    : operation_(operation),
      feed_(static_cast<std::uint32_t>(std::lround(std::min(feed, tool.max_feed)))),
      plunge_feed_(static_cast<std::uint32_t>(std::lround(tool.plunge_feed))),
      sink_feed_(static_cast<std::uint32_t>(std::lround(tool.max_feed))),
      clearance_(to_units(clearance_z)),
      link_(to_units(link_z)),
      plunges_(tool.plunges),
      face_(tool.kind == ToolKind::face),
      core_(core_diameter_of(tool) / 2),
      recess_(core_recess(tool)),
      ramp_limit_deg_(ramp_limit_deg(tool)) {
    operation_.clearance_z = clearance_z;
}

// The middle of a cutter: what stands there is entered head-on. Of a face mill that is nearly all of it.
CutterShape PathBuilder::middle() const {
    const CutterShape& cutter = around_.cutter;
    if (cutter.is_ball()) return ball_cutter(kBallMiddle * cutter.radius);
    if (cutter.taper_rad > 0)
        return cutter.corner > 0 ? ball_cutter(kBallMiddle * cutter.corner) : flat_cutter(kPointMiddle);
    const bool whole = face_ && !plunges_;
    return flat_cutter(std::max(core_, whole ? cutter.radius - kRim : kMiddle * cutter.radius));
}

// The steepest slope on which no more stands under the core than its recess, where a point is under it for
// `way` mm.
double PathBuilder::slope_under_core(double way) const {
    const double most = std::tan(std::min(around_.ramp_deg, ramp_limit_deg_) * std::numbers::pi / 180);
    return core_ > 0 ? std::min(most, kRecessShare * recess_ / way) : most;
}

// The same to and fro over a line; 0 where it is so short that a post would stay under the core. Two places
// from which the core covers the same point are no farther apart than the core is wide. So a point is under
// it no longer than the line takes to lead that far away, and at the line's ends twice as long, there and
// back.
double PathBuilder::slope_to_and_fro(std::span<const PathPoint> line) const {
    if (core_ <= 0) return slope_under_core(1);
    const auto first = way_until_far(line.begin(), line.end(), 2 * core_),
               last = way_until_far(line.rbegin(), line.rend(), 2 * core_);
    if (!first || !last) return 0;
    return slope_under_core(std::max({2 * *first, 2 * *last, longest_within(line, 2 * core_)}));
}

double PathBuilder::slope_around(std::span<const PathPoint> ring) const {
    if (core_ <= 0) return slope_under_core(1);
    std::vector<PathPoint> twice(ring.begin(), ring.end());
    twice.insert(twice.end(), ring.begin() + 1, ring.end());
    if (!way_until_far(ring.begin(), ring.end(), 2 * core_)) return 0;
    return slope_under_core(longest_within(twice, 2 * core_));
}

void PathBuilder::add(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t feed) {
    if (started_ && x == x_ && y == y_ && z == z_) return;
    if (feed > 0 &&
        !operation_.moves.empty()) {  // one long move instead of two that go on the same way along one axis
        Move& last = operation_.moves.back();
        const std::size_t n = operation_.moves.size();
        if (n >= 2 && last.feed == feed) {
            const Move& before = operation_.moves[n - 2];
            const std::int64_t ax = std::int64_t{last.x} - before.x, ay = std::int64_t{last.y} - before.y,
                               az = std::int64_t{last.z} - before.z;
            const std::int64_t bx = std::int64_t{x} - last.x, by = std::int64_t{y} - last.y,
                               bz = std::int64_t{z} - last.z;
            const int axes = (ax != 0) + (ay != 0) + (az != 0);
            const bool same =
                axes == 1 && (ax == 0) == (bx == 0) && (ay == 0) == (by == 0) && (az == 0) == (bz == 0);
            if (same && (ax > 0) == (bx > 0) && (ay > 0) == (by > 0) && (az > 0) == (bz > 0)) {
                last = {x, y, z, feed};
                learnt_ = std::min(learnt_, n - 1);
                x_ = x;
                y_ = y;
                z_ = z;
                return;
            }
        }
    }
    operation_.moves.push_back({x, y, z, feed});
    x_ = x;
    y_ = y;
    z_ = z;
    started_ = true;
}

void PathBuilder::set_surroundings(const Surroundings& around) {
    around_ = around;
    learnt_ = operation_.moves.size();
}

// Cuts the moves made since the last question into what stands. Of moves much shorter than a cell only some
// are needed: whatever is left out, the bound stays a bound.
void PathBuilder::learn() {
    const std::vector<Move>& moves = operation_.moves;
    double since = 0;
    for (std::size_t i = std::max<std::size_t>(learnt_, 1); i < moves.size(); ++i) {
        if (moves[i].feed == 0) continue;
        const std::array<double, 3> from{to_mm(moves[i - 1].x), to_mm(moves[i - 1].y), to_mm(moves[i - 1].z)},
            to{to_mm(moves[i].x), to_mm(moves[i].y), to_mm(moves[i].z)};
        since += std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
        if (since < around_.standing->cell() && i + 1 < moves.size() && moves[i + 1].feed > 0) continue;
        around_.standing->cut(around_.cutter, from, to, core_);
        since = 0;
    }
    learnt_ = moves.size();
}

double PathBuilder::standing_tip(Point2 at) {
    if (around_.standing == nullptr) return to_mm(link_);
    learn();
    const std::array<double, 2> p{to_mm(at.x), to_mm(at.y)};
    return around_.standing->free_tip(around_.cutter, p, p);
}

double PathBuilder::standing_middle(Point2 at) {
    if (around_.standing == nullptr) return to_mm(link_);
    learn();
    const std::array<double, 2> p{to_mm(at.x), to_mm(at.y)};
    // Of a flat end every cell counts that its middle may touch; the walls beside the cutter are farther off.
    const CutterShape inner = middle();
    return inner.is_flat() ? around_.standing->top(inner.radius, p, p)
                           : around_.standing->free_tip(inner, p, p);
}

void PathBuilder::go_above(Point2 p) {
    if (!started_) {
        add(p.x, p.y, clearance_, 0);
        z_ = clearance_;
    } else if (around_.standing == nullptr) {
        if (down_) retract();
    } else if (p.x != x_ || p.y != y_) {
        learn();
        const double top =
            around_.standing->top(around_.cutter.radius, {to_mm(x_), to_mm(y_)}, {to_mm(p.x), to_mm(p.y)});
        const double lowest = std::max({top + kOver, to_mm(z_), around_.lowest_rapid});
        const std::int32_t over = lowest < to_mm(link_) ? to_units(lowest) : std::max(z_, link_);
        add(x_, y_, over, 0);
        add(p.x, p.y, over, 0);
    }
    down_ = false;
    if (around_.standing == nullptr) return add(p.x, p.y, link_, 0);
    learn();
    const double top =
        around_.standing->top(around_.cutter.radius, {to_mm(p.x), to_mm(p.y)}, {to_mm(p.x), to_mm(p.y)});
    above_ = std::min(link_, to_units(std::max(top + kStop, around_.lowest_rapid)));
}

// The way between two free places at one height, looked at in steps that no part can hide between.
bool PathBuilder::straight_is_free(Point2 to, std::int32_t z) {
    const std::array<double, 2> a{to_mm(x_), to_mm(y_)}, b{to_mm(to.x), to_mm(to.y)};
    if (std::hypot(b[0] - a[0], b[1] - a[1]) > kLongestWay) return false;
    learn();
    return around_.standing->free_tip(around_.cutter, a, b) <= to_mm(z) + kBite &&
           part_leaves_way({x_, y_}, to, z);
}

// The same of the part alone, between two free places.
bool PathBuilder::part_leaves_way(Point2 from, Point2 to, std::int32_t z) const {
    const std::array<double, 2> a{to_mm(from.x), to_mm(from.y)}, b{to_mm(to.x), to_mm(to.y)};
    const int steps = static_cast<int>(std::ceil(std::hypot(b[0] - a[0], b[1] - a[1]) / around_.chord));
    for (int k = 1; k < steps; ++k) {
        const double t = static_cast<double>(k) / steps, x = a[0] + t * (b[0] - a[0]),
                     y = a[1] + t * (b[1] - a[1]);
        if (around_.part->stands_over(x, y, to_mm(z) - around_.under) ||
            !has_room({to_units(x), to_units(y)}))
            return false;
    }
    return true;
}

// By rapid to where stock may stand, and never quite to the cut.
void PathBuilder::land(std::int32_t z) {
    if (down_ || around_.standing == nullptr) return;
    const std::int32_t stop = std::max(above_, z + to_units(kStop));
    if (stop < z_) add(x_, y_, stop, 0);
}

// On from there fast to where the cutter meets something.
void PathBuilder::descend(const PathPoint& to) {
    land(to.z);
    const double tip = standing_tip({x_, y_});
    const std::int32_t met = tip > -1e9 ? to_units(tip + kStop) : to.z;
    if (std::max(met, to.z) < z_) sink(std::max(met, to.z));
}

// Where the tool is down, at its height or that of a cut, whichever is higher, to over that, if the way is
// free.
bool PathBuilder::go_straight(Point2 to, std::int32_t z) {
    const std::int32_t level = std::max(z_, z);
    if (!started_ || z_ >= link_ || around_.part == nullptr || !straight_is_free(to, level)) return false;
    sink(level);
    cut(to, level);
    return true;
}

// Whether a tool with a core would go down to a place more steeply than on a ramp, where its core meets what
// stands.
bool PathBuilder::comes_down_on_stock(const PathPoint& to) {
    if (core_ <= 0 || around_.standing == nullptr || to.z >= z_) return false;
    const double way = distance_mm({x_, y_, z_}, to);
    if (to_mm(z_ - to.z) <= way * slope_under_core(2 * core_)) return false;
    learn();
    return around_.standing->top(core_, {to_mm(x_), to_mm(y_)}, {to_mm(to.x), to_mm(to.y)}) >
           to_mm(to.z) + kScrape;
}

// How many points of a run may be followed at once, or, where that is none, may not; `top` then is how high
// there stands what is too much. The last of them is the next stretch's first.
std::size_t PathBuilder::stretch_at_once(std::span<const PathPoint> run, double& top) {
    learn();
    top = -1e300;
    // The borders of two levels on an upright wall are not the same to the last digit.
    CutterShape cutter = around_.cutter;
    if (cutter.is_flat()) cutter.radius = std::max(0.5 * cutter.radius, cutter.radius - kSliver);
    bool too_much = false;
    for (std::size_t k = run.size() > 1 ? 1 : 0; k < run.size(); ++k) {
        const PathPoint &p = run[k > 0 ? k - 1 : 0], &q = run[k];
        const double stands =
            around_.standing->free_tip(cutter, {to_mm(p.x), to_mm(p.y)}, {to_mm(q.x), to_mm(q.y)});
        const bool here = stands > to_mm(std::min(p.z, q.z)) + around_.deepest + kBite;
        if (k <= 1) too_much = here;
        else if (here != too_much) return k;
        if (here) top = std::max(top, stands);
    }
    return run.size();
}

void PathBuilder::follow(std::span<const PathPoint> run) {
    if (around_.deepest <= 0 || around_.standing == nullptr) return follow_at_once(run);
    while (!run.empty()) {
        double top = 0;
        const std::span<const PathPoint> stretch = run.first(stretch_at_once(run, top));
        run = stretch.size() < run.size() ? run.subspan(stretch.size() - 1) : run.last(0);
        if (top > -1e299 && !cut_down_to(stretch, top)) leave_out(stretch);
        else follow_at_once(stretch);
    }
}

void PathBuilder::leave_out(std::span<const PathPoint> run) {
    left_out_.emplace_back(run.begin(), run.end());
}

void PathBuilder::follow_left_out(std::size_t from) {
    for (std::size_t points = 0;;) {
        std::vector<std::vector<PathPoint>> again(left_out_.begin() + static_cast<std::ptrdiff_t>(from),
                                                  left_out_.end());
        std::size_t still = 0;
        for (const std::vector<PathPoint>& run : again) still += run.size();
        if (still == 0 || still == points) return;
        points = still;
        left_out_.resize(from);
        for (const std::vector<PathPoint>& run : again) follow(run);
    }
}

// From `top` down, as far along as the cutter is wide on either side: room for a ramp. Says whether what
// stands then may be cut at once.
bool PathBuilder::cut_down_to(std::span<const PathPoint> stretch, double top) {
    std::vector<PathPoint> raised(stretch.begin(), stretch.end());
    const double low = to_mm(
        std::min_element(stretch.begin(), stretch.end(), [](auto& a, auto& b) { return a.z < b.z; })->z);
    const int steps = static_cast<int>(std::ceil((top - low) / around_.deepest));
    for (int s = steps - 1; s > 0; --s) {
        for (std::size_t k = 0; k < raised.size(); ++k)
            raised[k].z = std::max(stretch[k].z, to_units(low + (top - low) * s / steps));
        follow_at_once(raised);
    }
    const std::size_t n = stretch_at_once(stretch, top);
    return !(top > -1e299) && n == stretch.size();
}

void PathBuilder::follow_at_once(std::span<const PathPoint> run) {
    while (!run.empty()) run = run.subspan(follow_part(run));
}

// Follows a run to where it has to be entered anew; where there is no way in, leaves out what goes on at that
// height. Returns how many points that are.
std::size_t PathBuilder::follow_part(std::span<const PathPoint> run) {
    const Point2 first{run.front().x, run.front().y};
    if (around_.standing == nullptr) {
        go_above(first);
        plunge(run.front().z);
    } else if (!enter(run)) {
        std::size_t past = 1;
        while (past < run.size() && run[past].z == run.front().z) ++past;
        leave_out(run.first(past));
        return past;
    }
    for (std::size_t k = 1; k < run.size(); ++k) {
        if (comes_down_on_stock(run[k])) return k;
        cut({run[k].x, run[k].y}, run[k].z);
    }
    return run.size();
}

void PathBuilder::plunge(std::int32_t z) {
    land(z);
    add(x_, y_, z, plunge_feed_);
    down_ = true;
}

void PathBuilder::sink(std::int32_t z) {
    land(z);
    add(x_, y_, z, sink_feed_);
    down_ = true;
}

void PathBuilder::cut(Point2 to, std::int32_t z) {
    add(to.x, to.y, z, feed_);
    down_ = true;
}

void PathBuilder::retract() {
    if (!down_) return;
    if (around_.standing == nullptr) add(x_, y_, link_, 0);
    down_ = false;
}

bool PathBuilder::finish() {
    if (around_.no_way_in != nullptr)
        for (const std::vector<PathPoint>& run : left_out_)
            around_.no_way_in->push_back({to_mm(run.front().x), to_mm(run.front().y), to_mm(run.front().z)});
    left_out_.clear();
    if (!started_) return false;
    retract();
    add(x_, y_, clearance_, 0);
    if (around_.standing != nullptr) learn();
    return true;
}

}  // namespace slabwright
