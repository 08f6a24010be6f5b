#include "engine/sheets/alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "kernels/errors.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

constexpr double kArcTolerance = 0.01;  ///< mm, where regions shrink and grow
constexpr double kNeckStep = 4;         ///< mm between places of a border that a neck may go to
constexpr double kNeckOverlap = 1;      ///< mm that a neck goes into the part
constexpr std::size_t kMostTargets = 400;

double apart(Point2 a, Point2 b) { return std::hypot(double(a.x) - b.x, double(a.y) - b.y) / kUnitsPerMm; }

void require_rules(const AlignmentRules& rules, double thinnest) {
    const auto refuse = [](const char* what, const char* remedy) {
        throw Error(ErrorKind::usage, "sheets.align", what, "", remedy);
    };
    for (const double mm : {rules.dowel, rules.wall, rules.tab, rules.neck})
        if (!(mm > 0) || mm > 1000) refuse("dowel, wall, tab and neck must be over 0", "give mm over 0");
    if (!(rules.gap >= 0) || rules.gap > 1000) refuse("the tabs' gap must be 0 or more", "give --tab-gap");
    if (rules.way == SheetAlignment::tabs && rules.tab < rules.dowel + 2 * std::min(rules.wall, thinnest))
        refuse("a tab is too small for its rod", "give a larger --tab, or a thinner --dowel");
}

/// The two places of a region that lie farthest apart, or nearly: the border's place farthest from the
/// middle, and the one farthest from that.
std::vector<Point2> far_pair(const Loops& region, double least) {
    if (region.points.empty()) return {};
    double x = 0, y = 0;
    for (const Point2 p : region.points) x += p.x, y += p.y;
    const double n = static_cast<double>(region.points.size());
    const auto farthest = [&](Point2 from) {
        std::size_t at = 0;
        for (std::size_t i = 1; i < region.points.size(); ++i)
            if (apart(region.points[i], from) > apart(region.points[at], from) + 1e-3) at = i;
        return region.points[at];
    };
    const Point2 a = farthest({static_cast<std::int32_t>(x / n), static_cast<std::int32_t>(y / n)});
    const Point2 b = farthest(a);
    return apart(a, b) >= least ? std::vector<Point2>{a, b} : std::vector<Point2>{};
}

Point2 farthest_from(const Loops& region, Point2 from) {
    return *std::max_element(region.points.begin(), region.points.end(),
                             [&](Point2 a, Point2 b) { return apart(a, from) < apart(b, from) - 1e-3; });
}

/// Which islands hang together.
class Bodies {
public:
    explicit Bodies(std::size_t n) : parents_(n) { std::iota(parents_.begin(), parents_.end(), 0); }
    std::size_t root(std::size_t i) {
        while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
        return i;
    }
    void join(std::size_t a, std::size_t b) {
        parents_[std::max(root(a), root(b))] = std::min(root(a), root(b));
    }

private:
    std::vector<std::size_t> parents_;
};

class Holder {
public:
    Holder(const std::vector<SheetSpan>& spans, const std::vector<Loops>& outlines,
           const std::vector<Loops>& cores, const AlignmentRules& rules, bool must_reach_core)
        : spans_(spans),
          outlines_(outlines),
          cores_(cores),
          rules_(rules),
          must_reach_core_(must_reach_core),
          holds_(spans.size()),
          bodies_(0) {
        for (const Loops& outline : outlines) {
            first_.push_back(count_);
            islands_.emplace_back(outline);
            count_ += islands_.back().size();
        }
        // The last index stands for the rods beside the part.
        bodies_ = Bodies(count_ + 1);
        rooted_.assign(count_, false);
    }

    std::vector<SheetHold> run() {
        if (rules_.way == SheetAlignment::tabs) tabs();
        if (rules_.way == SheetAlignment::holes) rods();
        else dowels();
        require_all_held();
        return std::move(holds_);
    }

private:
    [[nodiscard]] double room() const { return rules_.dowel / 2 + rules_.wall; }
    [[nodiscard]] double least_apart() const {
        return rules_.dowel + std::max(rules_.dowel / 2, rules_.wall);
    }

    void rods() {
        Loops common = cores_[0];
        for (std::size_t i = 1; i < cores_.size(); ++i) {
            common = intersect(common, cores_[i]);
            if (far_pair(offset(common, -room(), kArcTolerance), least_apart()).empty())
                throw Error(
                    ErrorKind::no_plan, "sheets.hold",
                    fmt::format("no two rods of {:.4g} mm go through sheets 1 to {} and leave {:.4g} mm "
                                "of the part around them",
                                rules_.dowel, i + 1, rules_.wall),
                    fmt::format("z {:.4g} to {:.4g}", spans_[i].bottom, spans_[i].top),
                    "give a thinner --dowel, or --align dowels or tabs");
        }
        const std::vector<Point2> pair = far_pair(offset(common, -room(), kArcTolerance), least_apart());
        for (SheetHold& hold : holds_) hold.holes = pair;
        for (std::size_t i = 0; i + 1 < spans_.size(); ++i)
            for (std::size_t a = 0; a < islands_[i].size(); ++a)
                for (std::size_t b = 0; b < islands_[i + 1].size(); ++b)
                    if (holes_in(i, islands_[i].regions[a]) >= 2 &&
                        holes_in(i + 1, islands_[i + 1].regions[b]) >= 2)
                        bodies_.join(first_[i] + a, first_[i + 1] + b);
    }

    [[nodiscard]] int holes_in(std::size_t i, const Loops& region) const {
        int n = 0;
        for (const Point2 hole : holds_[i].holes) n += winding(region, hole) > 0;
        return n;
    }

    /// Two dowels through every joint of two islands that hang on nothing else yet.
    void dowels() {
        for (std::size_t i = 0; i + 1 < spans_.size(); ++i)
            for (std::size_t a = 0; a < islands_[i].size(); ++a)
                for (std::size_t b = 0; b < islands_[i + 1].size(); ++b) {
                    if (rooted_[first_[i] + a] && rooted_[first_[i + 1] + b]) continue;
                    join(i, a, b);
                }
    }

    void join(std::size_t i, std::size_t a, std::size_t b) {
        const Loops both = intersect(intersect(cores_[i], islands_[i].regions[a]),
                                     intersect(cores_[i + 1], islands_[i + 1].regions[b]));
        if (both.empty()) return;
        Loops free = offset(both, -room(), kArcTolerance);
        const Loops loose = offset(both, 2 * kArcTolerance - room(), kArcTolerance);
        // Dowels of the joint below that also fit here go through both.
        std::vector<Point2> chosen;
        for (const Point2 hole : holds_[i].holes) {
            if (winding(loose, hole) > 0) chosen.push_back(hole);
            else free = subtract(free, disc(hole, 2 * (rules_.dowel + rules_.wall)));
        }
        for (const Point2 hole : holds_[i + 1].holes)
            if (std::find(chosen.begin(), chosen.end(), hole) == chosen.end())
                free = subtract(free, disc(hole, 2 * (rules_.dowel + rules_.wall)));
        if (chosen.size() < 2 && !free.empty()) {
            if (chosen.size() == 1) {
                const Point2 other = farthest_from(free, chosen[0]);
                if (apart(other, chosen[0]) >= least_apart()) chosen.push_back(other);
            } else {
                chosen = far_pair(free, least_apart());
            }
        }
        if (chosen.size() < 2) return;
        for (const std::size_t s : {i, i + 1})
            for (const Point2 hole : chosen)
                if (std::find(holds_[s].holes.begin(), holds_[s].holes.end(), hole) == holds_[s].holes.end())
                    holds_[s].holes.push_back(hole);
        bodies_.join(first_[i] + a, first_[i + 1] + b);
    }

    /// The middles of tabs around the silhouette: left, right, front and back.
    [[nodiscard]] std::array<Point2, 4> columns() const {
        Box2 box;
        for (const Loops& outline : outlines_)
            for (const Point2 p : outline.points) box.grow(p);
        const std::int32_t out = to_units(rules_.gap + rules_.tab / 2);
        const Point2 middle{box.min.x + (box.max.x - box.min.x) / 2, box.min.y + (box.max.y - box.min.y) / 2};
        return {{{box.min.x - out, middle.y},
                 {box.max.x + out, middle.y},
                 {middle.x, box.min.y - out},
                 {middle.x, box.max.y + out}}};
    }

    struct Neck {
        std::size_t column = 0;
        Point2 to;
    };

    /// Two necks to every island where they reach it; the two sides that reach most islands, or all four.
    void tabs() {
        const std::array<Point2, 4> places = columns();
        std::vector<std::array<std::optional<Point2>, 4>> reached(count_);
        for (std::size_t i = 0; i < spans_.size(); ++i)
            for (std::size_t a = 0; a < islands_[i].size(); ++a)
                for (std::size_t c = 0; c < 4; ++c) reached[first_[i] + a][c] = target(i, a, places[c]);
        const auto held = [&](std::initializer_list<std::size_t> columns) {
            std::size_t n = 0;
            for (const auto& island : reached) {
                std::size_t necks = 0;
                for (const std::size_t c : columns) necks += island[c].has_value();
                n += necks >= 2;
            }
            return n;
        };
        std::vector<std::size_t> used{0, 1, 2, 3};
        if (held({0, 1}) == held({0, 1, 2, 3})) used = {0, 1};
        else if (held({2, 3}) == held({0, 1, 2, 3})) used = {2, 3};
        for (std::size_t i = 0; i < spans_.size(); ++i) {
            std::array<bool, 4> needed{};
            for (std::size_t a = 0; a < islands_[i].size(); ++a) {
                const auto& to = reached[first_[i] + a];
                std::vector<Neck> necks;
                for (const std::size_t c : used)
                    if (to[c]) necks.push_back({c, *to[c]});
                if (necks.size() < 2) continue;
                std::stable_sort(necks.begin(), necks.end(), [&](const Neck& p, const Neck& q) {
                    return apart(places[p.column], p.to) < apart(places[q.column], q.to) - 1e-3;
                });
                for (std::size_t k = 0; k < 2; ++k) {
                    add_neck(i, places[necks[k].column], necks[k].to);
                    needed[necks[k].column] = true;
                }
                rooted_[first_[i] + a] = true;
                bodies_.join(first_[i] + a, count_);
            }
            for (std::size_t c = 0; c < 4; ++c)
                if (needed[c]) add_tab(i, places[c]);
        }
    }

    [[nodiscard]] double neck_of(std::size_t i) const {
        return std::min(rules_.neck, spans_[i].top - spans_[i].bottom);
    }

    static Loops stroke(Point2 from, Point2 to, double width, double beyond) {
        const double l = std::max(apart(from, to), 1e-6);
        const double ux = to_mm(std::int64_t{to.x} - from.x) / l, uy = to_mm(std::int64_t{to.y} - from.y) / l;
        const auto at = [&](Point2 p, double along, double aside) {
            return Point2{to_units(to_mm(p.x) + along * ux - aside * uy),
                          to_units(to_mm(p.y) + along * uy + aside * ux)};
        };
        Loops loops;
        loops.points = {at(from, 0, -width / 2), at(to, beyond, -width / 2), at(to, beyond, width / 2),
                        at(from, 0, width / 2)};
        loops.close_loop();
        return loops;
    }

    void add_neck(std::size_t i, Point2 from, Point2 to) {
        append_loops(stroke(from, to, neck_of(i), kNeckOverlap), holds_[i].added);
    }

    void add_tab(std::size_t i, Point2 middle) {
        const std::int32_t half = to_units(rules_.tab / 2);
        append_loops(stroke({middle.x - half, middle.y}, {middle.x + half, middle.y}, rules_.tab, 0),
                     holds_[i].added);
        holds_[i].holes.push_back(middle);
    }

    /// The nearest place of an island that a straight neck reaches from a tab without touching another island
    /// or a hole of the part.
    [[nodiscard]] std::optional<Point2> target(std::size_t i, std::size_t a, Point2 from) const {
        const Loops& island = islands_[i].regions[a];
        Loops aim = must_reach_core_ ? intersect(cores_[i], island) : island;
        if (aim.empty()) aim = island;  // it ends within the sheet
        std::vector<Point2> places;
        for (std::size_t l = 0; l < aim.size(); ++l) {
            const auto loop = aim.loop(l);
            if (signed_area(loop) <= 0) continue;
            for (std::size_t k = 0; k < loop.size(); ++k) {
                const Point2 p = loop[k], q = loop[(k + 1) % loop.size()];
                const int steps = std::clamp(static_cast<int>(apart(p, q) / kNeckStep), 1, 1000);
                for (int s = 0; s < steps; ++s)
                    places.push_back({static_cast<std::int32_t>(p.x + (double(q.x) - p.x) * s / steps),
                                      static_cast<std::int32_t>(p.y + (double(q.y) - p.y) * s / steps)});
            }
        }
        std::stable_sort(places.begin(), places.end(),
                         [&](Point2 p, Point2 q) { return apart(p, from) < apart(q, from) - 1e-3; });
        if (places.size() > kMostTargets) places.resize(kMostTargets);
        Loops holes;
        for (std::size_t l = 1; l < island.size(); ++l) {
            const auto loop = island.loop(l);
            holes.points.insert(holes.points.end(), loop.rbegin(), loop.rend());
            holes.close_loop();
        }
        Box2 reach;
        for (const Point2 p : island.points) reach.grow(p);
        reach.grow(from);
        for (const Point2 to : places) {
            const Loops neck = stroke(from, to, neck_of(i), kNeckOverlap);
            bool is_clear = holes.empty() || intersect(neck, holes).empty();
            for (std::size_t b = 0; b < islands_[i].size() && is_clear; ++b)
                is_clear = b == a || !islands_[i].boxes[b].meets(reach) ||
                           intersect(neck, islands_[i].regions[b]).empty();
            if (is_clear) return to;
        }
        return std::nullopt;
    }

    void require_all_held() {
        std::size_t root =
            bodies_.root(rules_.way == SheetAlignment::tabs &&
                                 std::find(rooted_.begin(), rooted_.end(), true) != rooted_.end()
                             ? count_
                             : 0);
        for (std::size_t i = 0; i < spans_.size(); ++i)
            for (std::size_t a = 0; a < islands_[i].size(); ++a) {
                if (bodies_.root(first_[i] + a) == root || count_ == 1) continue;
                const Box2& box = islands_[i].boxes[a];
                throw Error(
                    ErrorKind::no_plan, "sheets.hold",
                    fmt::format(
                        "an island of sheet {}, {:.1f} x {:.1f} mm, has no room for what would hold it: "
                        "{}two dowels of {:.4g} mm with {:.4g} mm of the part around them",
                        i + 1, to_mm(std::int64_t{box.max.x} - box.min.x),
                        to_mm(std::int64_t{box.max.y} - box.min.y),
                        rules_.way == SheetAlignment::tabs ? "two necks from tabs, or " : "", rules_.dowel,
                        rules_.wall),
                    fmt::format("x {:.1f} y {:.1f} z {:.4g} to {:.4g}",
                                to_mm((std::int64_t{box.min.x} + box.max.x) / 2),
                                to_mm((std::int64_t{box.min.y} + box.max.y) / 2), spans_[i].bottom,
                                spans_[i].top),
                    rules_.way == SheetAlignment::tabs
                        ? "give a thinner --dowel or --neck"
                        : "give a thinner --dowel, a smaller --wall, or --align tabs");
            }
    }

    const std::vector<SheetSpan>& spans_;
    const std::vector<Loops>&outlines_, &cores_;
    const AlignmentRules& rules_;
    bool must_reach_core_;
    std::vector<SheetHold> holds_;
    std::vector<Pieces> islands_;
    std::vector<std::size_t> first_;  ///< of each sheet, the index of its first island
    std::size_t count_ = 0;
    Bodies bodies_;
    std::vector<bool> rooted_;  ///< of each island: it hangs on two tabs
};

}  // namespace

Loops disc(Point2 middle, double diameter) {
    const double r = diameter / 2;
    // Corners on the circle: what is cut is never wider than the dowel.
    const int n = std::max(
        16, static_cast<int>(std::ceil(std::numbers::pi / std::acos(1 - 0.005 / std::max(r, 0.01)))));
    Loops loops;
    for (int i = 0; i < n; ++i) {
        const double a = 2 * std::numbers::pi * i / n;
        loops.points.push_back({middle.x + to_units(r * std::cos(a)), middle.y + to_units(r * std::sin(a))});
    }
    loops.close_loop();
    return loops;
}

Loops with_hold(const Loops& region, const SheetHold& hold, double dowel) {
    if (hold.added.empty() && hold.holes.empty()) return region;
    Loops held = hold.added.empty() ? region : unite(region, hold.added);
    for (const Point2 hole : hold.holes) held = subtract(held, disc(hole, dowel));
    return held;
}

std::array<Point2, 4> pins_of(const Loops& outline) {
    if (outline.points.empty()) return {};
    std::array<Point2, 4> pins;
    pins.fill(outline.points[0]);
    for (const Point2 p : outline.points) {
        if (p.x < pins[0].x) pins[0] = p;
        if (p.x > pins[1].x) pins[1] = p;
        if (p.y < pins[2].y) pins[2] = p;
        if (p.y > pins[3].y) pins[3] = p;
    }
    return pins;
}

std::vector<SheetHold> holds_of(const std::vector<SheetSpan>& spans, const std::vector<Loops>& outlines,
                                const std::vector<Loops>& cores, const AlignmentRules& rules,
                                bool must_reach_core) {
    if (rules.way == SheetAlignment::none || spans.empty()) return std::vector<SheetHold>(spans.size());
    double thinnest = spans[0].top - spans[0].bottom;
    for (const SheetSpan& span : spans) thinnest = std::min(thinnest, span.top - span.bottom);
    require_rules(rules, thinnest);
    return Holder(spans, outlines, cores, rules, must_reach_core).run();
}

}  // namespace slabwright
