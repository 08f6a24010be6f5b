#include "engine/schedule/dowels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "engine/schedule/fit.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/hull.h"
#include "kernels/polygons/loops.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kBesideEnds = 0.06;  // mm: a face so near a layer's end belongs to the layer beside it
constexpr double kSections = 2;       // mm between the sections that places are looked for in
constexpr double kMargin = 0.02;      // mm by which places keep farther off than asked, for roundings
constexpr double kFine = 0.005;       // mm by which offset() may err
constexpr double kSnap = 0.01;        // mm: of the grid that middles lie on, as drawings tell them
constexpr int kDirections = 64;       // in which the farthest corners are looked for
constexpr std::size_t kBetweenCancels = 1 << 16;  // facets
constexpr double kGrid = 24;                      // places along the longer side of the region
constexpr double kLeastPitch = 2;                 // mm between them
constexpr double kDryAround = 0.5;                // mm around a hole without glue, which would fill it
constexpr double kApart = 3;                      // diameters between two dowels of a joint, at least
constexpr double kShorter = 0.5;  // of the longest pair: less is not given for a slab that tells its way
constexpr double kTurned = 2;     // diameters within which a turned slab still goes over a dowel

double point_mm(double diameter) {
    constexpr double kHalfAngle = 59 * std::numbers::pi / 180;
    return diameter / 2 / std::tan(kHalfAngle);
}

struct Place {
    double x = 0, y = 0;
    friend auto operator<=>(const Place&, const Place&) = default;
};

double distance(const Place& a, const Place& b) { return std::hypot(a.x - b.x, a.y - b.y); }

double distance_to_segment(double ax, double ay, double bx, double by, double x, double y) {
    const double dx = bx - ax, dy = by - ay, square = dx * dx + dy * dy;
    const double along = square > 0 ? std::clamp(((x - ax) * dx + (y - ay) * dy) / square, 0.0, 1.0) : 0;
    return std::hypot(ax + along * dx - x, ay + along * dy - y);
}

// What of a facet lies between two heights, seen from above: up to five corners.
struct Shadow {
    std::array<std::array<double, 2>, 6> corners{};
    std::size_t count = 0;
    void add(double x, double y) { corners[count++] = {x, y}; }
};

// Corners on the inner side of one height, and where edges cross it.
std::size_t clip(const std::array<std::array<double, 3>, 6>& from, std::size_t count, double z, double side,
                 std::array<std::array<double, 3>, 6>& to) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const auto &a = from[i], &b = from[(i + 1) % count];
        const double u = side * (a[2] - z), v = side * (b[2] - z);
        if (u >= 0) to[kept++] = a;
        if ((u > 0 && v < 0) || (u < 0 && v > 0)) {
            const double t = u / (u - v);
            to[kept++] = {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), z};
        }
    }
    return kept;
}

Shadow shadow_between(const std::array<std::array<double, 3>, 3>& facet,
                      const std::array<double, 2>& heights) {
    std::array<std::array<double, 3>, 6> whole{facet[0], facet[1], facet[2]}, above, between;
    const std::size_t count = clip(whole, 3, heights[0], 1, above);
    Shadow shadow;
    const std::size_t corners = count > 0 ? clip(above, count, heights[1], -1, between) : 0;
    for (std::size_t i = 0; i < corners; ++i) shadow.add(between[i][0], between[i][1]);
    return shadow;
}

// A joint between two layers with the places that its dowels may take.
struct DowelJoint {
    double z = 0;
    JointDowel dowel;           // how its holes are; no place
    std::vector<Place> places;  // ascending
    std::string why_none;
};

class DowelPlacer {
public:
    DowelPlacer(Context& context, MeshView pattern, Plan& plan)
        : context_(context),
          mesh_(pattern),
          plan_(plan),
          rules_(plan.job.dowels),
          reach_(rules_.diameter / 2 + rules_.clearance) {}

    void run() {
        for (Layer& layer : plan_.layers) layer.dowels.clear();
        std::vector<DowelJoint> joints = joints_of_layers();
        const std::vector<Loops> wood = wood_of(joints);
        parallel_each(context_, joints.size(), [&](std::size_t i) {
            if (joints[i].why_none.empty()) joints[i].places = free_places(joints[i], wood[i]);
        });
        for (std::size_t i = 0; i < joints.size(); ++i) settle(joints[i], i);
    }

private:
    [[nodiscard]] std::vector<DowelJoint> joints_of_layers() const {
        std::vector<DowelJoint> joints;
        for (std::size_t i = 0; i + 1 < plan_.layers.size(); ++i) {
            const Layer &lower = plan_.layers[i], &upper = plan_.layers[i + 1];
            DowelJoint& joint = joints.emplace_back();
            joint.z = lower.z_top;
            joint.dowel.diameter = rules_.diameter;
            joint.dowel.below = dowel_depth(rules_, lower.z_top - lower.z_bottom);
            // Its hole is drilled into one slab, even where more are bonded onto that.
            const double whole = std::min(upper.z_top - upper.z_bottom, upper.slab_thickness / upper.slabs);
            joint.dowel.above = dowel_depth(rules_, whole);
            for (const auto& [depth, layer] :
                 {std::pair(joint.dowel.below, lower.index), std::pair(joint.dowel.above, upper.index)})
                if (depth == 0)
                    joint.why_none = fmt::format("layer {} is too thin for a hole of {:.1f} mm", layer,
                                                 rules_.diameter / 2);
        }
        return joints;
    }

    // Where wood stands in all sections around each joint.
    [[nodiscard]] std::vector<Loops> wood_of(const std::vector<DowelJoint>& joints) const {
        std::vector<Plane> planes;
        std::vector<std::size_t> starts;
        for (const DowelJoint& joint : joints) {
            starts.push_back(planes.size());
            if (!joint.why_none.empty()) continue;
            planes.push_back({joint.z, Side::below});
            planes.push_back({joint.z, Side::above});
            const auto [low, high] = wood_around(joint.dowel, joint.z);
            const int steps = std::max(1, static_cast<int>(std::ceil((high - low) / kSections)));
            for (int k = 0; k <= steps; ++k)
                planes.push_back({low + (high - low) * k / steps, k == steps ? Side::below : Side::above});
        }
        starts.push_back(planes.size());
        std::vector<Section> sections = slice(context_, mesh_, planes, {plan_.job.tolerances.gap});
        std::vector<Loops> wood(joints.size());
        parallel_each(context_, joints.size(), [&](std::size_t i) {
            for (std::size_t k = starts[i]; k < starts[i + 1]; ++k)
                wood[i] =
                    k == starts[i] ? std::move(sections[k].loops) : intersect(wood[i], sections[k].loops);
        });
        return wood;
    }

    // Corners of what is left of the wood, in many directions the farthest, and a grid over it.
    [[nodiscard]] std::vector<Place> places_in(const Loops& wood) const {
        const Loops inside = offset(wood, -(reach_ + kMargin), kFine);
        std::vector<Place> places;
        if (inside.empty()) return places;
        const auto add = [&](double x, double y) {
            places.push_back({std::round(x / kSnap) * kSnap, std::round(y / kSnap) * kSnap});
        };
        const std::vector<Point2> hull = convex_hull(inside.points);
        for (int k = 0; k < kDirections; ++k) {
            const double angle = 2 * std::numbers::pi * k / kDirections;
            const auto far = [&](Point2 p) { return p.x * std::cos(angle) + p.y * std::sin(angle); };
            const Point2 p = *std::max_element(hull.begin(), hull.end(),
                                               [&](Point2 a, Point2 b) { return far(a) < far(b); });
            add(to_mm(p.x), to_mm(p.y));
        }
        Point2 low = inside.points.front(), high = low;
        for (const Point2 p : inside.points) {
            low = {std::min(low.x, p.x), std::min(low.y, p.y)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y)};
        }
        const double pitch = std::max(
            kLeastPitch, to_mm(std::max(std::int64_t{high.x} - low.x, std::int64_t{high.y} - low.y)) / kGrid);
        // Rows and the places on them lie evenly within the region's ends, so that strips narrower than the
        // pitch have some too.
        const double across = to_mm(std::int64_t{high.y} - low.y);
        const int count = 1 + static_cast<int>(across / pitch);
        std::vector<double> rows;
        for (int k = 0; k < count; ++k) rows.push_back(low.y + across * kUnitsPerMm * (k + 0.5) / count);
        const std::vector<std::vector<Span>> spans = line_spans(inside, rows);
        for (std::size_t r = 0; r < rows.size(); ++r)
            for (const Span& span : spans[r]) {
                const double begin = span.low / kUnitsPerMm, length = (span.high - span.low) / kUnitsPerMm;
                const int steps = 1 + static_cast<int>(length / pitch);
                for (int k = 0; k <= steps; ++k) add(begin + length * k / steps, rows[r] / kUnitsPerMm);
            }
        std::sort(places.begin(), places.end());
        places.erase(std::unique(places.begin(), places.end()), places.end());
        return places;
    }

    [[nodiscard]] std::array<std::array<double, 3>, 3> corners_of(std::size_t facet) const {
        std::array<std::array<double, 3>, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f& v = mesh_.vertices[mesh_.facets[facet][k]];
            corners[k] = {v.x, v.y, v.z};
        }
        return corners;
    }

    // Sections may miss what lies between them: every facet beside a joint is looked at.
    [[nodiscard]] std::vector<Place> free_places(const DowelJoint& joint, const Loops& wood) const {
        std::vector<Place> places = places_in(wood);
        const std::array<double, 2> heights = wood_around(joint.dowel, joint.z);
        std::vector<char> taken(places.size(), 0);
        for (std::size_t f = 0; f < mesh_.size() && !places.empty(); ++f) {
            if (f % kBetweenCancels == 0) context_.throw_if_cancelled();
            const auto corners = corners_of(f);
            const auto [low, high] = std::minmax({corners[0][2], corners[1][2], corners[2][2]});
            if (high < heights[0] || low > heights[1]) continue;
            const auto [left, right] = std::minmax({corners[0][0], corners[1][0], corners[2][0]});
            const auto [front, back] = std::minmax({corners[0][1], corners[1][1], corners[2][1]});
            const auto begin =
                std::lower_bound(places.begin(), places.end(), Place{left - reach_, front - reach_});
            for (auto p = begin; p != places.end() && p->x <= right + reach_; ++p) {
                if (p->y < front - reach_ || p->y > back + reach_) continue;
                char& is_taken = taken[static_cast<std::size_t>(p - places.begin())];
                if (is_taken == 0) is_taken = plan_distance(corners, heights, p->x, p->y) < reach_ ? 1 : 0;
            }
        }
        std::vector<Place> free;
        for (std::size_t i = 0; i < places.size(); ++i)
            if (taken[i] == 0) free.push_back(places[i]);
        return free;
    }

    // Not where the hole would run into one from below.
    void keep_from_below(DowelJoint& joint, std::size_t layer) const {
        if (layer == 0) return;
        const Layer& lower = plan_.layers[layer];
        for (const JointDowel& under : plan_.layers[layer - 1].dowels) {
            const double between = lower.z_top - lower.z_bottom - under.above - joint.dowel.below -
                                   2 * point_mm(rules_.diameter);
            if (between >= kLeastWoodAtDowel) continue;
            std::erase_if(joint.places, [&](const Place& p) {
                return distance(p, {under.x, under.y}) < rules_.diameter + kLeastWoodAtDowel;
            });
        }
    }

    [[nodiscard]] std::vector<JointDowel> dowels_at(const DowelJoint& joint,
                                                    std::span<const Place> places) const {
        std::vector<JointDowel> dowels;
        for (const Place& p : places) {
            dowels.push_back(joint.dowel);
            dowels.back().x = p.x;
            dowels.back().y = p.y;
        }
        return dowels;
    }

    [[nodiscard]] bool is_turned(const DowelJoint& joint, std::span<const Place> places,
                                 const Blank& slab) const {
        return fits_turned(dowels_at(joint, places), slab);
    }

    // The two that lie farthest apart; where two are all, the longest that tell which way the slab lies.
    [[nodiscard]] std::vector<Place> farthest_pair(const DowelJoint& joint, const Blank& slab) const {
        const std::vector<Place>& places = joint.places;
        std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
        for (std::size_t i = 0; i < places.size(); ++i)
            for (std::size_t k = i + 1; k < places.size(); ++k)
                if (const double far = distance(places[i], places[k]); far >= kApart * rules_.diameter)
                    pairs.emplace_back(-far, i, k);
        if (pairs.empty()) return {};
        const auto pair = [&](const auto& p) {
            return std::vector<Place>{places[std::get<1>(p)], places[std::get<2>(p)]};
        };
        const auto longest = *std::min_element(pairs.begin(), pairs.end());
        if (rules_.per_joint > 2 || !is_turned(joint, pair(longest), slab)) return pair(longest);
        std::sort(pairs.begin(), pairs.end());
        for (const auto& p : pairs)
            if (-std::get<0>(p) < -std::get<0>(longest) * kShorter) break;
            else if (!is_turned(joint, pair(p), slab)) return pair(p);
        return pair(longest);
    }

    // Adds the place that is farthest from its nearest; none where all are too near.
    // @param one_way only a place with which the slab does not fit turned
    [[nodiscard]] bool add_farthest(const DowelJoint& joint, std::vector<Place>& chosen, bool one_way,
                                    const Blank& slab) const {
        std::optional<Place> best;
        double most = 0;
        for (const Place& p : joint.places) {
            double nearest = std::numeric_limits<double>::infinity();
            for (const Place& c : chosen) nearest = std::min(nearest, distance(p, c));
            if (nearest < kApart * rules_.diameter || nearest <= most) continue;
            if (one_way) {
                std::vector<Place> with = chosen;
                with.push_back(p);
                if (is_turned(joint, with, slab)) continue;
            }
            best = p;
            most = nearest;
        }
        if (best) chosen.push_back(*best);
        return best.has_value();
    }

    [[nodiscard]] std::vector<Place> choose(const DowelJoint& joint, const Blank& slab) const {
        if (joint.places.empty()) return {};
        std::vector<Place> chosen = farthest_pair(joint, slab);
        if (chosen.empty()) return {joint.places.front()};
        const auto asked = static_cast<std::size_t>(rules_.per_joint);
        while (chosen.size() < asked) {
            const bool is_last = chosen.size() + 1 == asked;
            if (is_last && add_farthest(joint, chosen, true, slab)) break;
            if (!add_farthest(joint, chosen, false, slab)) break;
        }
        if (is_turned(joint, chosen, slab)) (void)add_farthest(joint, chosen, true, slab);
        std::sort(chosen.begin(), chosen.end());
        return chosen;
    }

    void settle(DowelJoint& joint, std::size_t layer) {
        keep_from_below(joint, layer);
        const Layer& upper = plan_.layers[layer + 1];
        const Blank slab = slab_of(plan_, upper);
        const std::vector<Place> chosen = choose(joint, slab);
        std::vector<JointDowel>& dowels = plan_.layers[layer].dowels;
        dowels = dowels_at(joint, chosen);
        const auto tell = [&](const char* code, const std::string& message) {
            std::optional<std::array<double, 3>> where;
            if (!dowels.empty()) where = {dowels.front().x, dowels.front().y, joint.z};
            plan_.diagnostics.push_back({Severity::warning, code, message, where});
        };
        if (dowels.empty()) return tell_none(joint, upper.index);
        if (dowels.size() < static_cast<std::size_t>(rules_.per_joint))
            tell(
                "dowel.few",
                fmt::format("the joint at z {:.2f} mm, under layer {}, has room for {} of {} dowels; ask for "
                            "less dowels.clearance or thinner dowels{}",
                            joint.z, upper.index, dowels.size(), rules_.per_joint,
                            dowels.size() == 1 ? ", or lay the slab by its edges" : ""));
        else if (fits_turned(dowels, slab))
            tell("dowel.turned",
                 fmt::format("the slab of layer {} fits on its dowels turned, too: mark its front edge",
                             upper.index));
    }

    void tell_none(const DowelJoint& joint, int layer) {
        const std::string why =
            !joint.why_none.empty()
                ? joint.why_none
                : fmt::format("no place has {:.2f} mm of wood around it on both sides", reach_);
        const std::string what =
            fmt::format("the joint at z {:.2f} mm, under layer {}, has no dowel: {}", joint.z, layer, why);
        const std::string remedy = "ask for less dowels.clearance, thinner or shorter dowels";
        if (rules_.required)
            throw refusal("dowel.none", what, fmt::format("z {:.2f} mm", joint.z),
                          remedy + ", or for none of this joint with dowels.required = false");
        plan_.diagnostics.push_back({Severity::warning, "dowel.none", what + "; " + remedy, {}});
    }

    Context& context_;
    MeshView mesh_;
    Plan& plan_;
    const JointDowels& rules_;
    const double reach_;  // mm around a dowel's middle without surface
};

}  // namespace

double dowel_depth(const JointDowels& rules, double layer_mm) {
    const double room = layer_mm - kLeastWoodAtDowel - point_mm(rules.diameter);
    const double depth = std::floor(std::min(rules.depth, room) * 10 + 1e-6) / 10;
    return depth < rules.diameter / 2 ? 0 : depth;
}

double least_layer_for_dowels(const JointDowels& rules) {
    return std::ceil(rules.diameter / 2 * 10) / 10 + kLeastWoodAtDowel + point_mm(rules.diameter);
}

std::array<double, 2> wood_around(const JointDowel& dowel, double z) {
    const double beyond = point_mm(dowel.diameter) + kLeastWoodAtDowel - kBesideEnds;
    return {z - dowel.below - beyond, z + dowel.above + beyond};
}

double plan_distance(const std::array<std::array<double, 3>, 3>& facet, const std::array<double, 2>& heights,
                     double x, double y) {
    const Shadow shadow = shadow_between(facet, heights);
    double nearest = std::numeric_limits<double>::infinity();
    bool left = false, right = false;  // of its edges
    for (std::size_t i = 0; i < shadow.count; ++i) {
        const auto &a = shadow.corners[i], &b = shadow.corners[(i + 1) % shadow.count];
        nearest = std::min(nearest, distance_to_segment(a[0], a[1], b[0], b[1], x, y));
        const double side = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
        left |= side > 0;
        right |= side < 0;
    }
    return shadow.count > 2 && left != right ? 0 : nearest;
}

Loops outside_dowels(const Loops& glue, std::span<const JointDowel> dowels) {
    constexpr int kSides = 48;
    Loops holes;
    for (const JointDowel& d : dowels) {
        const double radius = d.diameter / 2 + kDryAround;
        for (int k = 0; k < kSides; ++k) {
            const double angle = 2 * std::numbers::pi * k / kSides;
            holes.points.push_back(
                {to_units(d.x + radius * std::cos(angle)), to_units(d.y + radius * std::sin(angle))});
        }
        holes.close_loop();
    }
    return dowels.empty() ? glue : subtract(glue, holes);
}

std::span<const JointDowel> dowels_under(const Plan& plan, const Layer& layer) {
    const Layer* below = nullptr;
    for (const Layer& l : plan.layers)
        if (l.index == layer.index - 1) below = &l;
    return below != nullptr ? std::span<const JointDowel>(below->dowels) : std::span<const JointDowel>();
}

std::vector<UndersideHole> underside_holes(const Plan& plan) {
    std::vector<UndersideHole> holes;
    for (const Layer& layer : plan.layers) {
        const bool by_program =
            std::any_of(plan.undersides.begin(), plan.undersides.end(),
                        [&](const Plan& under) { return under.turned->layer == layer.index; });
        if (by_program) continue;
        const Blank slab = slab_of(plan, layer);
        int number = 0;
        for (const JointDowel& d : dowels_under(plan, layer))
            holes.push_back({layer.index, ++number, slab.max[0] - d.x, d.y - slab.min[1], d.diameter, d.above,
                             d.length()});
    }
    return holes;
}

bool fits_turned(std::span<const JointDowel> dowels, const Blank& slab) {
    const double x0 = (slab.min[0] + slab.max[0]) / 2, y0 = (slab.min[1] + slab.max[1]) / 2;
    const auto over_all = [&](double cosine, double sine) {
        return std::all_of(dowels.begin(), dowels.end(), [&](const JointDowel& d) {
            const double x = x0 + cosine * (d.x - x0) - sine * (d.y - y0),
                         y = y0 + sine * (d.x - x0) + cosine * (d.y - y0);
            return std::any_of(dowels.begin(), dowels.end(), [&](const JointDowel& o) {
                return std::hypot(o.x - x, o.y - y) <= kTurned * d.diameter;
            });
        });
    };
    if (dowels.empty() || over_all(-1, 0)) return true;
    const double within = kTurned * dowels.front().diameter;
    return std::abs(slab.length() - slab.width()) <= within && over_all(0, 1);
}

void place_dowels(Context& context, MeshView pattern, Plan& plan) {
    if (plan.job.dowels.per_joint > 0) DowelPlacer(context, pattern, plan).run();
}

}  // namespace slabwright
