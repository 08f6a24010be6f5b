// In which order rings are cut, and where each begins.
#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/paths/runs/plan_view.h"
#include "engine/paths/runs/rings.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr double kBesideSteps =
    1.2;  // steps between rings that lie next to each other, at most, where they are nearest
constexpr double kWedgeStep = 7.5;    // mm: where rings are a smaller step apart, what stays where one closes
                                      // is no more than a chip (kChip)
constexpr double kSameHeight = 1e-3;  // mm
constexpr double kSlide = 1.2;        // steps along the next ring that the way to it slants

// Where a piece may begin.
struct Start {
    double way = kUnbounded;  // 0.1 µm, from where the tool is
    std::size_t segment = 0;
    PathPoint at;
    bool reversed = false;
};

// The nearest beginning of a piece, as long as that is nearer than `best`: of a closed one, the nearest
// point; of an open one its first, or either end.
bool nearer(const RingPlan::Piece& piece, Point2 from, bool either_end, Start& best) {
    const PathPoint q{from.x, from.y, 0};
    const double bx = std::max({piece.box[0] - q.x, q.x - piece.box[2], 0.0}),
                 by = std::max({piece.box[1] - q.y, q.y - piece.box[3], 0.0});
    if (std::hypot(bx, by) >= best.way) return false;
    bool found = false;
    auto offer = [&](std::size_t segment, const PathPoint& p, bool reversed) {
        if (const double d = plan_length(q, p); d < best.way) best = {d, segment, p, reversed}, found = true;
    };
    offer(0, piece.points.front(), false);
    if (!piece.closed) {
        if (either_end) offer(0, piece.points.back(), true);
        return found;
    }
    for (std::size_t k = 0; k + 1 < piece.points.size(); ++k) {
        const PathPoint &a = piece.points[k], &b = piece.points[k + 1];
        const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y,
                     l2 = dx * dx + dy * dy;
        const double t =
            l2 > 0 ? std::clamp(
                         ((static_cast<double>(q.x) - a.x) * dx + (static_cast<double>(q.y) - a.y) * dy) / l2,
                         0.0, 1.0)
                   : 0;
        const double ex = a.x + t * dx - q.x, ey = a.y + t * dy - q.y,
                     reach = best.way + 1;  // a unit more: the place is rounded
        if (ex * ex + ey * ey > reach * reach) continue;
        offer(k, between(a, b, t), false);
    }
    return found;
}

// The place `ahead` (0.1 µm) farther along a closed ring than a start on it.
void advance(const std::vector<PathPoint>& ring, double ahead, Start& start) {
    const std::size_t n = ring.size() - 1;
    for (std::size_t passed = 0; passed <= n; ++passed) {
        const PathPoint& b = ring[start.segment + 1];
        const double left = plan_length(start.at, b);
        if (left >= ahead && left > 0) {
            start.at = between(start.at, b, ahead / left);
            return;
        }
        ahead -= left;
        start.at = b;
        start.segment = (start.segment + 1) % n;
    }
}

// A closed ring that starts and ends at a point of one of its segments.
std::vector<PathPoint> started_at(const std::vector<PathPoint>& ring, std::size_t segment,
                                  const PathPoint& at) {
    std::vector<PathPoint> result{at};
    const std::size_t n = ring.size() - 1;
    for (std::size_t k = 1; k <= n; ++k) {
        const PathPoint& p = ring[(segment + k) % n];
        if (!(p == result.back())) result.push_back(p);
    }
    if (!(result.back() == at)) result.push_back(at);
    return result;
}

// Cuts them in one spiral with the stock on its right: what still stands is one piece then.
void cut_frames(PathBuilder& path, const RingPlan& plan) {
    double south = plan.south;
    for (const std::array<double, 4>& ring : plan.frames) {
        const std::int32_t x0 = to_units(ring[0]), x1 = to_units(ring[2]), y0 = to_units(ring[1]),
                           y1 = to_units(ring[3]), z = plan.z;
        const std::array<PathPoint, 5> run{
            {{x0, to_units(south), z}, {x0, y1, z}, {x1, y1, z}, {x1, y0, z}, {x0, y0, z}}};
        // Beside the stock nothing stands, but the machine's travel may not reach so far.
        if (&ring == &plan.frames.front() || path.z() != z) path.follow(run);
        else
            for (const PathPoint& p : run) path.cut({p.x, p.y}, z);
        south = ring[1];
    }
}

// Whose turn it is: pieces that wait for nothing. With RingPlan::hold a piece waits for all regions within
// its own, without it for the pieces beside it that lie a step farther off: so one place is finished before
// the next is gone to. With RingPlan::from_open it waits for any piece beside it, unless it begins at the
// stock's edge.
class Turns {
public:
    std::vector<std::size_t> ready;

    explicit Turns(RingPlan& plan) : plan_(plan) {
        if (plan.from_open) {
            find_neighbours();
            return;
        }
        if (!plan.hold) {
            wait_for_neighbours();
            return;
        }
        for (const RingPlan::Region& region : plan.regions) left_.push_back(region.pieces.size());
        // Regions without a region within them; the others follow from these.
        std::vector<std::size_t> farthest;
        for (std::size_t k = 0; k < plan.regions.size(); ++k)
            if (plan.regions[k].waits_for == 0) farthest.push_back(k);
        for (const std::size_t k : farthest) release(k);
    }

    /// To be called when a piece has been cut; its points may have been put in another order.
    void cut(std::size_t piece) {
        if (plan_.from_open) {
            state_[piece] = State::cut;
            for (const std::size_t k : waiting_[piece])
                if (state_[k] == State::waits) state_[k] = State::ready, ready.push_back(k);
            if (ready.empty()) make_farthest_ready();
            return;
        }
        if (!plan_.hold) {
            for (const std::size_t k : waiting_[piece])
                if (--waits_for_[k] == 0) ready.push_back(k);
            return;
        }
        const std::size_t region = plan_.pieces[piece].region, around = plan_.regions[region].around;
        if (--left_[region] > 0 || around == SIZE_MAX) return;
        --plan_.regions[around].waits_for;
        release(around);
    }

    /// With RingPlan::from_open, of a piece whose turn it is: whether one beside it has been cut, and whether
    /// one that is farther from the forbidden region has.
    struct Beside {
        bool any = false, farther = false;
    };
    [[nodiscard]] Beside cut_beside(std::size_t piece) const {
        Beside found;
        for (const std::size_t k : waiting_[piece])
            if (state_[k] == State::cut)
                found.any = true, found.farther |= plan_.pieces[k].ring > plan_.pieces[piece].ring;
        return found;
    }
    /// The same: whether a place of it lies beside one that has been cut.
    [[nodiscard]] bool beside_cut(std::size_t piece, const PathPoint& p) const {
        const double reach = kBesideSteps * plan_.step * kUnitsPerMm;
        return std::any_of(waiting_[piece].begin(), waiting_[piece].end(), [&](std::size_t k) {
            return state_[k] == State::cut && near_line(p, plan_.pieces[k].points, reach);
        });
    }

private:
    enum class State : char { waits, ready, cut };
    // Pieces that lie beside each other, on one ring or on the next.
    void find_neighbours() {
        const std::size_t n = plan_.pieces.size();
        waiting_.resize(n);
        boxes_.resize(n);
        state_.assign(n, State::waits);
        for (std::size_t k = 0; k < n; ++k)
            for (std::size_t m = k + 1; m < n && plan_.pieces[m].ring <= plan_.pieces[k].ring + 1; ++m)
                if (beside(plan_.pieces[k], plan_.pieces[m]))
                    waiting_[k].push_back(m), waiting_[m].push_back(k);
        for (std::size_t k = 0; k < n; ++k)
            if (!plan_.pieces[k].closed) state_[k] = State::ready, ready.push_back(k);
        if (ready.empty()) make_farthest_ready();
    }
    // Where no way leads from the edge: of those that wait, the farthest from the forbidden region.
    void make_farthest_ready() {
        std::size_t far = 0;
        for (std::size_t k = 0; k < state_.size(); ++k)
            if (state_[k] == State::waits) far = std::max(far, plan_.pieces[k].ring);
        for (std::size_t k = 0; k < state_.size(); ++k)
            if (state_[k] == State::waits && plan_.pieces[k].ring == far)
                state_[k] = State::ready, ready.push_back(k);
    }

    void release(std::size_t region) {
        RingPlan::Region& of = plan_.regions[region];
        if (of.waits_for > 0) return;
        if (left_[region] > 0) {
            ready.insert(ready.end(), of.pieces.begin(), of.pieces.end());
        } else if (of.around != SIZE_MAX) {
            --plan_.regions[of.around].waits_for;
            release(of.around);
        }
    }

    void wait_for_neighbours() {
        const std::size_t n = plan_.pieces.size();
        waits_for_.assign(n, 0);
        waiting_.resize(n);
        boxes_.resize(n);
        auto ring = [&](std::size_t k) { return plan_.pieces[k].ring; };
        for (std::size_t first = 0, farther = 0, end = 0; first < n;
             first = farther) {  // pieces lie in the order of their rings
            for (farther = first; farther < n && ring(farther) == ring(first);) ++farther;
            for (end = farther; end < n && ring(end) == ring(first) + 1;) ++end;
            for (std::size_t k = first; k < farther; ++k)
                for (std::size_t m = farther; m < end; ++m)
                    if (beside(plan_.pieces[k], plan_.pieces[m])) ++waits_for_[k], waiting_[m].push_back(k);
        }
        for (std::size_t k = 0; k < n; ++k)
            if (waits_for_[k] == 0) ready.push_back(k);
    }

    using Box = std::array<double, 4>;        // smallest x and y, largest x and y
    static constexpr std::size_t kPart = 16;  // segments of a piece that share a box
    static bool apart(const Box& a, const Box& b, double reach) {
        return a[0] > b[2] + reach || b[0] > a[2] + reach || a[1] > b[3] + reach || b[1] > a[3] + reach;
    }
    // The boxes of a piece's parts.
    [[nodiscard]] const std::vector<Box>& boxes_of_parts(const RingPlan::Piece& piece) {
        std::vector<Box>& boxes = boxes_[static_cast<std::size_t>(&piece - plan_.pieces.data())];
        for (std::size_t first = boxes.size() * kPart; first + 1 < piece.points.size(); first += kPart) {
            Box& box = boxes.emplace_back(Box{kUnbounded, kUnbounded, -kUnbounded, -kUnbounded});
            for (std::size_t k = first; k <= std::min(first + kPart, piece.points.size() - 1); ++k) {
                const PathPoint& p = piece.points[k];
                box = {std::min<double>(box[0], p.x), std::min<double>(box[1], p.y),
                       std::max<double>(box[2], p.x), std::max<double>(box[3], p.y)};
            }
        }
        return boxes;
    }

    [[nodiscard]] bool beside(const RingPlan::Piece& a, const RingPlan::Piece& b) {
        const double reach = kBesideSteps * plan_.step * kUnitsPerMm;
        if (apart(a.box, b.box, reach)) return false;
        auto near = [&](const RingPlan::Piece& from, const RingPlan::Piece& to) {
            const std::vector<Box>&from_boxes = boxes_of_parts(from), &to_boxes = boxes_of_parts(to);
            for (std::size_t f = 0; f < from_boxes.size(); ++f) {
                if (apart(from_boxes[f], to.box, reach)) continue;
                for (std::size_t k = f * kPart; k <= std::min((f + 1) * kPart, from.points.size() - 1); ++k) {
                    const PathPoint& p = from.points[k];
                    const Box at{static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.x),
                                 static_cast<double>(p.y)};
                    if (apart(at, to.box, reach)) continue;
                    for (std::size_t t = 0; t < to_boxes.size(); ++t)
                        if (!apart(at, to_boxes[t], reach) &&
                            near_line(p,
                                      std::span(to.points).subspan(
                                          t * kPart, std::min(kPart + 1, to.points.size() - t * kPart)),
                                      reach))
                            return true;
                }
            }
            return false;
        };
        return near(a, b) || near(b, a);
    }

    RingPlan& plan_;
    std::vector<std::size_t> left_;       // by region: pieces not cut yet; with hold
    std::vector<std::size_t> waits_for_;  // by piece, without it: how many others
    std::vector<std::vector<std::size_t>>
        waiting_;                          // and who waits for it; with from_open: who lies beside it
    std::vector<State> state_;             // by piece, with from_open
    std::vector<std::vector<Box>> boxes_;  // of its parts, once they were asked for
};

// With RingPlan::from_open: a closed piece begins at its point nearest to where the tool is of those beside a
// piece that has been cut, and is turned over where that piece is the nearer one to the forbidden region: so
// the stock is on the right again.
void begin_beside(const Turns& turns, std::size_t chosen, Point2 at, RingPlan::Piece& piece, Start& start) {
    if (!piece.closed) return;
    const Turns::Beside beside = turns.cut_beside(chosen);
    if (!beside.any) return;
    if (!beside.farther) std::reverse(piece.points.begin(), piece.points.end());
    const PathPoint from{at.x, at.y, piece.points.front().z};
    start = {};
    for (std::size_t k = 0; k + 1 < piece.points.size(); ++k) {
        const double way = plan_length(from, piece.points[k]);
        if (way < start.way && turns.beside_cut(chosen, piece.points[k]))
            start = {way, k, piece.points[k], false};
    }
    if (start.way == kUnbounded)
        (void)nearer(piece, at, false, start);  // only a place between two points lies beside one
}

// Where a closed piece had better close, with RingPlan::hold. There the cutter meets its own way when it is
// still as far from the beginning as it is wide, and what then stands between that place, halfway, and what
// is clear on the side away from the forbidden region is a wedge that hangs on nothing. It is but a chip
// where the swath of another ring comes near to that place.
class Closing {
public:
    Closing(const RingPlan& plan, const std::vector<std::size_t>& cut, const RingPlan::Piece& piece)
        : piece_(piece), radius_(plan.radius * kUnitsPerMm) {
        for (const std::size_t c : cut)
            if (plan.pieces[c].ring == piece.ring || plan.pieces[c].ring == piece.ring + 1)
                beside_.push_back(&plan.pieces[c]);
    }
    /// Whether a wedge that begins there is low, or none would be lower anywhere.
    [[nodiscard]] bool good(const Start& start) const {
        return beside_.empty() || wedge_within(kLowWedge, start.segment, start.at);
    }
    /// Of the points with the lowest wedges, as far as these are told apart, the nearest to where the tool
    /// is; else `otherwise`.
    [[nodiscard]] Start nearest(Point2 at, const Start& otherwise) const {
        std::vector<std::pair<double, std::size_t>> points;
        for (std::size_t k = 0; k + 1 < piece_.points.size(); ++k)
            points.emplace_back(plan_length(PathPoint{at.x, at.y, 0}, piece_.points[k]), k);
        std::sort(points.begin(), points.end());
        for (const double height : {kLowWedge, 2 * kLowWedge, 4 * kLowWedge, 6 * kLowWedge})
            for (const auto& [way, k] : points)
                if (wedge_within(height, k, piece_.points[k])) return {way, k, piece_.points[k], false};
        return otherwise;
    }

private:
    static constexpr double kLowWedge = 2;  // mm

    // Whether what is clear comes within `height` of halfway between a beginning and where the cutter meets
    // its own way.
    [[nodiscard]] bool wedge_within(double height, std::size_t segment, const PathPoint& at) const {
        const std::size_t n = piece_.points.size() - 1;
        PathPoint meets = at;
        for (std::size_t passed = 0; passed < n && plan_length(at, meets) < 2 * radius_; ++passed)
            meets = piece_.points[(segment + n - passed) % n];
        const PathPoint halfway =
            between(at, meets, std::min(0.5, radius_ / std::max(1.0, plan_length(at, meets))));
        const double reach = radius_ + height * kUnitsPerMm;
        return std::any_of(beside_.begin(), beside_.end(), [&](const RingPlan::Piece* f) {
            return halfway.x > f->box[0] - reach && halfway.x < f->box[2] + reach &&
                   halfway.y > f->box[1] - reach && halfway.y < f->box[3] + reach &&
                   near_line(halfway, f->points, reach);
        });
    }

    const RingPlan::Piece& piece_;
    const double radius_;                           // 0.1 µm
    std::vector<const RingPlan::Piece*> beside_{};  // those that have been cut, as far off and a step farther
};

// The stretches of a piece under which something may stand; those between them are left out where they are
// long enough for it.
std::vector<std::vector<PathPoint>> standing_runs(const Standing& standing, double radius,
                                                  std::span<const PathPoint> points) {
    constexpr double kWorthLeaving = 1000;  // mm: six seconds of feed, or of going up, over and down again
    const double look = radius / 2;         // mm of way that are looked at together
    std::vector<std::vector<PathPoint>> runs;
    double clear = kUnbounded;  // mm since something stood
    std::vector<PathPoint> since;
    for (std::size_t k = 1; k < points.size(); ++k) {
        const double length = plan_length(points[k - 1], points[k]) / kUnitsPerMm;
        const int parts = std::max(1, static_cast<int>(std::ceil(length / look)));
        for (int part = 0; part < parts; ++part) {
            const PathPoint a = between(points[k - 1], points[k], static_cast<double>(part) / parts),
                            b = between(points[k - 1], points[k], static_cast<double>(part + 1) / parts);
            if (standing.top(radius, {to_mm(a.x), to_mm(a.y)}, {to_mm(b.x), to_mm(b.y)}) <=
                to_mm(a.z) + kSameHeight) {
                clear += length / parts;
                since.push_back(b);
                continue;
            }
            if (clear < kWorthLeaving) runs.back().insert(runs.back().end(), since.begin(), since.end());
            else runs.push_back({a});
            clear = 0;
            since.clear();
            runs.back().push_back(b);
        }
    }
    return runs;
}

}  // namespace

void clear_from_afar(PathBuilder& path, const LayerCut& cut, RingPlan plan) {
    if (plan.pieces.empty()) return;
    const double step_units = plan.step * kUnitsPerMm;
    const std::int32_t z = plan.z;
    cut_frames(path, plan);
    for (const std::vector<PathPoint>& strip : plan.strips) path.follow(strip);
    Turns turns(plan);
    const bool either_end = plan.from_open || !cut.job.cutting.climb;
    std::size_t ring = 0;  // that the tool is on, while it is down; none yet
    std::vector<std::size_t> cut_already;
    while (!turns.ready.empty()) {
        cut.context.throw_if_cancelled();
        std::size_t next = SIZE_MAX;
        Start start;
        std::size_t far = 0;
        for (const std::size_t k : turns.ready) far = std::max(far, plan.pieces[k].ring);
        for (std::size_t k = 0; k < turns.ready.size(); ++k)
            if ((!plan.hold || plan.pieces[turns.ready[k]].ring == far) &&
                nearer(plan.pieces[turns.ready[k]], path.at(), either_end, start))
                next = k;
        const std::size_t chosen = turns.ready[next];
        RingPlan::Piece& piece = plan.pieces[chosen];
        turns.ready.erase(turns.ready.begin() + static_cast<std::ptrdiff_t>(next));
        const std::size_t on = piece.ring;
        if (plan.from_open) begin_beside(turns, chosen, path.at(), piece, start);
        std::optional<Closing> closing;
        if (plan.hold && piece.closed && plan.step > kWedgeStep) closing.emplace(plan, cut_already, piece);
        if (closing && !closing->good(start)) start = closing->nearest(path.at(), start);
        // From ring to ring straight: a place `ring` steps from the forbidden region has that much room on
        // all sides. Slantwise, so that the cutter slides into the next ring, where there is room for the
        // longer way too.
        const bool along = path.is_down() && path.z() == z && piece.closed &&
                           start.way <= 1.02 * step_units &&
                           start.way <= 1.02 * static_cast<double>(ring) * step_units;
        if (along && static_cast<double>(ring) * step_units >
                         std::hypot(start.way, kSlide * step_units) + 0.05 * step_units) {
            Start slid = start;
            advance(piece.points, kSlide * step_units, slid);
            if (!closing || closing->good(slid)) start = slid;
        }
        if (piece.closed) piece.points = started_at(piece.points, start.segment, start.at);
        else if (start.reversed) std::reverse(piece.points.begin(), piece.points.end());
        if (plan.from_open && cut.standing != nullptr) {
            // A ring between two that have been cut may have nothing left to do.
            for (const std::vector<PathPoint>& run : standing_runs(*cut.standing, plan.radius, piece.points))
                path.follow(run);
        } else if (along) {
            for (const PathPoint& p : piece.points) path.cut({p.x, p.y}, z);
        } else {
            path.follow(piece.points);
        }
        ring = on;
        turns.cut(chosen);
        if (plan.hold) cut_already.push_back(chosen);
    }
    path.retract();
}

}  // namespace slabwright
