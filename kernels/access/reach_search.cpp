#include "kernels/access/reach_search.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "kernels/access/cap_cover.h"
#include "kernels/access/obstacles.h"
#include "kernels/access/place_proofs.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kResolution =
    0.5;  // of the tolerance: places nearer than this to each other are not told apart
constexpr int kMostPlaces = 20000;     // of one point; some tens are usual
constexpr std::size_t kMostCaps = 48;  // of a proof about one point; some are usual
constexpr double kMostAround =
    0.5;  // of a ball's radius: points farther from each other are proven to be missed one by one
constexpr std::size_t kMissed = 64;  // balls without a reached point remembered
constexpr int kEarlyOutCredit = 8;   // pieces in a row that may fail to be proven at once, until only
constexpr unsigned kTryAgain = 16;   // every so many is tried

float up(double v) { return std::nextafter(static_cast<float>(v), std::numeric_limits<float>::infinity()); }

/// Looks in the facets around a part of the tool for what is deeper in it than the tolerance, at one place,
/// and as deep as can be.
struct Probe {
    const FacetScene* scene = nullptr;
    const ToolPlaces* at = nullptr;
    double top = 0;
    double margin = 0;  ///< mm that a distance in single precision may be wrong by
    Envelope whole, fine;
    bool ball = false;     ///< upright above a sphere: distances decide
    bool level = false;    ///< upright above a disc
    bool deepest = false;  ///< looks for the deepest even where less would do
    Point3 centre{};
    double nearest2 = 0;   ///< of a ball: what is farther is of no interest
    bool hanging = false;  ///< the facets are numbered within the overhangs
    Vec3f middle{};  ///< of a ball, and the square of what is of no interest even if distances are wrong by
                     ///< rounding
    float beyond2 = 0;
    bool found = false, ruled_out = false;
    struct Obstacle {
        Point3 point;
        PlaceDepth depth;
    };
    std::array<Obstacle, 8> obstacles;  ///< the deepest ones found
    std::size_t count = 0;

    void take(const Point3& q) {
        const PlaceDepth depth = depth_of(q, *at, whole);
        found = true;
        std::size_t slot = count;
        if (count == obstacles.size()) {
            for (std::size_t i = slot = 0; i < count; ++i)
                if (obstacles[i].depth.mm < obstacles[slot].depth.mm) slot = i;
            if (obstacles[slot].depth.mm >= depth.mm) return;
        } else ++count;
        obstacles[slot] = {q, depth};
        ruled_out = ruled_out || (!deepest && rules_out(depth, *at));
    }
    /// @returns whether it came nearer
    bool look(std::uint32_t f) {
        const Triangle facet = scene->triangle(f);
        const double high = std::max({facet[0][2], facet[1][2], facet[2][2]});
        if ((!ball || hanging) && (high <= at->tip + fine.low || beside(facet))) return false;
        if (high <= top) return look(facet);
        if (std::min({facet[0][2], facet[1][2], facet[2][2]}) >= top) return false;
        const BelowHeight parts = below_height(facet, top);
        bool nearer = false;
        for (int i = 0; i < parts.n; ++i) nearer = look(parts.t[i]) || nearer;
        return nearer;
    }
    /// Whether all of a facet is farther from the axis than the part's radius, by its box.
    [[nodiscard]] bool beside(const Triangle& t) const {
        constexpr double rounding = 1 + 1e-9;
        const double r = fine.radius * rounding;
        return std::min({t[0][0], t[1][0], t[2][0]}) - at->x > r ||
               at->x - std::max({t[0][0], t[1][0], t[2][0]}) > r ||
               std::min({t[0][1], t[1][1], t[2][1]}) - at->y > r ||
               at->y - std::max({t[0][1], t[1][1], t[2][1]}) > r;
    }
    bool look(const Triangle& t) {
        Point3 q;
        if (ball && !hanging) {
            const double d2 = squared_distance(centre, t, q);
            if (d2 >= nearest2) return false;
            nearest2 = d2;
            take(q);
            return true;
        }
        if (level) {
            if (!(nearest_over({at->x, at->y, at->tip + fine.low}, t, q) < fine.radius)) return false;
        } else {
            if (!pokes(t, at->x, at->y, at->tip, fine, q)) return false;
        }
        take(q);
        return false;
    }
};

/// Of a ball, which most facets around miss.
bool look_around(RTCPointQueryFunctionArguments* args) {
    auto& probe = *static_cast<Probe*>(args->userPtr);
    if (probe.scene->planes(args->primID).farther(probe.middle, probe.beyond2)) return false;
    if (!probe.look(args->primID)) return false;
    const float within = probe.ruled_out ? 0 : up(std::sqrt(probe.nearest2) + probe.margin);
    probe.beyond2 = within * within;
    args->query->radius = std::min(args->query->radius, within);
    return true;
}

bool look(RTCPointQueryFunctionArguments* args) {
    auto& probe = *static_cast<Probe*>(args->userPtr);
    const bool nearer = probe.look(probe.hanging ? probe.scene->overhangs()[args->primID] : args->primID);
    if (probe.ruled_out) {
        args->query->radius = 0;
        return true;
    }
    if (!nearer) return false;
    args->query->radius = std::min(args->query->radius, up(std::sqrt(probe.nearest2) + probe.margin));
    return true;
}

/// Balls in which no point is reached, the last ones found.
class MissedBalls {
public:
    void add(const Point3& middle, double radius) {
        x_[next_] = middle[0];
        y_[next_] = middle[1];
        z_[next_] = middle[2];
        radius2_[next_] = radius * radius;
        next_ = (next_ + 1) % kMissed;
        used_ = std::max(used_, next_);
        if (next_ == 0) used_ = kMissed;
    }
    [[nodiscard]] bool hold(const Point3& p) const {
        for (std::size_t i = 0; i < used_; ++i) {
            const double x = x_[i] - p[0], y = y_[i] - p[1], z = z_[i] - p[2];
            if (x * x + y * y + z * z < radius2_[i]) return true;
        }
        return false;
    }

private:
    std::size_t next_ = 0, used_ = 0;
    std::array<double, kMissed> x_, y_, z_, radius2_;
};

}  // namespace

struct ReachSearcher::Impl {
    explicit Impl(const ReachQuestion& question)
        : q_(question),
          ball_(question.tool[0].core == 0 && question.tool[0].sin_taper == 0),
          covers_(ball_ || (question.tool[0].rounding == 0 && question.tool[0].sin_taper == 0)),
          known_(ball_ ? Obstacles::Tool::ball : Obstacles::Tool::flat, question.tool[0].radius,
                 question.options.tolerance) {}

    /// @param corner of the piece, from which the point is no farther than `around`: others are tested near
    /// it, and may be missed for the same reason
    [[nodiscard]] bool reaches(const Point3& p, const Point3& n, const Point3& corner = {},
                               double around = 0) {
        ++counts.points;
        if (missed_.hold(p)) return false;
        // Where the normal says, then where the last point was reached from.
        bool forbidden = false;
        if (ball_) {
            forbidden = n[2] > 0 && known_.strongest(p, n, 0) < Obstacles::kMost;
            if (!forbidden && test(toward(p, n)) == Verdict::free) return true;
        }
        const double across = std::hypot(n[0], n[1]);
        const double u = std::atan2(across, n[2]), phi = across > 0 ? std::atan2(n[1], n[0]) : 0;
        const double l = u <= 1e-9 ? 0 : u >= q_.angle ? q_.length() : q_.disc + q_.rounding * u;
        if (!ball_ && test(p, {l, phi, 0, 0, false}) == Verdict::free) return true;
        if (covers_) {
            if (around > 0 && prove_missed(corner, n, around)) return false;
            const Answer answer = all_around(p, n);
            if (answer != Answer::unknown) return answer == Answer::reached;
        } else if (l_ >= 0 && test(p, {l_, phi_, 0, 0, false}) == Verdict::free) return true;
        // What is known of the middle of a patch can rule all of it out. The rest is halved.
        const double finest = q_.options.tolerance * kResolution;
        stack_.clear();
        constexpr int sectors = 4;
        constexpr double half = std::numbers::pi / sectors;
        auto begin = [&](double from, double length, bool bent) {
            if (length > 0)
                for (int i = 0; i < sectors; ++i)
                    stack_.push_back({from + length / 2, phi + (2 * i + 1) * half, length / 2, half, bent});
        };
        begin(q_.disc + q_.arc, q_.flank, false);
        begin(0, q_.disc, false);
        begin(q_.disc, q_.arc, true);
        for (int tried = 0; !stack_.empty(); ++tried) {
            if (tried == kMostPlaces) {
                ++counts.undecided;
                return false;
            }
            const Patch patch = stack_.back();
            stack_.pop_back();
            const Verdict verdict = test(p, patch);
            if (verdict == Verdict::free) {
                l_ = patch.l;
                phi_ = patch.phi;
                return true;
            }
            const double sideways = q_.at(patch.l).distance * patch.dphi;
            if (verdict == Verdict::ruled_out || patch.dl + sideways <= finest) continue;
            Patch a = patch, b = patch;
            if (patch.dl > sideways) {
                a.dl = b.dl = patch.dl / 2;
                a.l -= a.dl;
                b.l += b.dl;
                if (std::abs(a.l - l) < std::abs(b.l - l)) std::swap(a, b);
            } else {
                a.dphi = b.dphi = patch.dphi / 2;
                a.phi -= a.dphi;
                b.phi += b.dphi;
                if (std::cos(a.phi - phi) > std::cos(b.phi - phi)) std::swap(a, b);
            }
            stack_.push_back(a);
            stack_.push_back(b);  // the nearer to the normal comes first
        }
        return false;
    }

    /// Looks whether a whole piece is missed, if others have been of late.
    void try_proving_missed(const Point3& middle, const Point3& n, double around) {
        if (early_out_credit_ <= 0 && ++skipped_ % kTryAgain != 0) return;
        early_out_credit_ = prove_missed(middle, n, around) ? kEarlyOutCredit : early_out_credit_ - 1;
    }

    ReachCounts counts;

    enum class Verdict : std::uint8_t { free, too_deep, ruled_out };
    enum class Answer : std::uint8_t { reached, missed, unknown };
    struct Patch {
        double l, phi, dl, dphi;  // the middle and half the ranges
        bool bent;                // on the profile's arc
    };

    /// Covers the most around u that something remembered forbids.
    bool add_known(const Point3& p, const Point3& u, double around = 0) {
        const std::size_t i = known_.strongest(p, u, around);
        if (i == Obstacles::kMost) return false;
        cover_.add(known_.cap(known_.point(i), p, u, around));
        known_.use(i);
        return true;
    }

    /// The place of a ball that touches a point from a direction.
    ToolPlaces toward(const Point3& p, const Point3& u) const {
        const double across = u[2] < 0 ? q_.rounding / std::hypot(u[0], u[1]) : q_.rounding;
        ToolPlaces at;
        at.x = p[0] + across * u[0];
        at.y = p[1] + across * u[1];
        at.tip = p[2] - q_.tool[0].rounding + std::max(0.0, across * u[2]);
        at.tolerance = q_.options.tolerance;
        return at;
    }
    /// The place of a flat for a direction.
    Patch place_at(const Point3& u) const {
        const double phi = std::atan2(u[1], u[0]);
        // Farther out than its radius the flat's edge touches, and is lower there: at the last by half of the
        // tolerance.
        const double tolerance = q_.options.tolerance, r = q_.tool[0].radius;
        const double distance = (r + tolerance) * std::hypot(u[0], u[1]) / (1 + std::max(0.0, u[2]));
        if (distance <= r) return {distance, phi, 0, 0, false};
        return {q_.disc + q_.rounding * std::asin(std::min(0.86, (distance - r) / tolerance)), phi, 0, 0,
                false};
    }

    /// Whether what is remembered proves that a ball reaches nothing within `around` of a point; points there
    /// are missed from then on.
    bool prove_missed(const Point3& p, const Point3& n, double around) {
        if (!ball_ || around > kMostAround * (q_.tool[0].radius + q_.options.tolerance)) return false;
        begin_cover(p, around);
        while (cover_.size() < kMostCaps) {
            const std::optional<Point3> u = cover_.uncovered(n);
            if (!u) missed_.add(p, around);
            if (!u || !add_known(p, *u, around)) return !u;
        }
        return false;
    }

    /// Tries a corner of what no obstacle known so far forbids; what is met there forbids it, until a place
    /// is free or nothing is left.
    Answer all_around(const Point3& p, const Point3& n) {
        const double tolerance = q_.options.tolerance, lowest = q_.options.lowest_tip;
        if (ball_ ? lowest - p[2] >= tolerance : p[2] + tolerance < lowest) return Answer::missed;
        begin_cover(p, 0);
        while (cover_.size() < kMostCaps) {
            const std::optional<Point3> u = cover_.uncovered(n);
            if (!u) return Answer::missed;
            if (add_known(p, *u)) continue;
            met_.clear();
            if (test(ball_ ? toward(p, *u) : places_of(p, place_at(*u))) == Verdict::free)
                return Answer::reached;
            bool covered = false;
            for (const Point3& obstacle : met_)
                if (const Cap cap = known_.cap(obstacle, p, *u, 0); cap.margin(*u) > CapCover::kInside) {
                    cover_.add(cap);
                    covered = true;
                }
            if (!covered) break;  // the shank or the holder is in the way
        }
        return Answer::unknown;
    }

    /// No ball's centre is below a point, and no tip lower than it may be; no flat's axis passes farther away
    /// than its radius.
    void begin_cover(const Point3& p, double around) {
        const double reach = q_.tool[0].radius + q_.options.tolerance,
                     lowest = q_.options.lowest_tip - p[2] + q_.tool[0].radius;
        double least = 0;
        if (ball_) least = lowest > 0 ? std::min(lowest / (reach + around), 1.0) : -around / (reach - around);
        cover_.begin({{0, 0, -1}, -least});
    }

    ToolPlaces places_of(const Point3& p, const Patch& patch) const {
        const ReachQuestion::Spot spot = q_.at(patch.l);
        const double c = std::cos(patch.phi), s = std::sin(patch.phi);
        ToolPlaces at;
        at.x = p[0] + spot.distance * c;
        at.y = p[1] + spot.distance * s;
        at.tip = p[2] - spot.height;
        // Farther out along the profile is farther from the point, and lower.
        at.along = {spot.outwards * c, spot.outwards * s, -spot.upwards};
        at.around = {-s, c, 0};
        at.dl = patch.dl;
        at.ds = spot.distance * patch.dphi;
        at.spread = at.dl + at.ds;
        at.lift = patch.bent ? patch.dl : std::abs(at.along[2]) * patch.dl;
        at.tolerance = q_.options.tolerance;
        // From the curvature of the profile, that of the circle about the point, and of both together.
        at.second = (patch.bent ? patch.dl * patch.dl / (2 * q_.rounding) : 0) +
                    (spot.distance + patch.dl) * patch.dphi * patch.dphi / 2 + patch.dl * patch.dphi;
        return at;
    }

    Verdict test(const Point3& p, const Patch& patch) { return test(places_of(p, patch)); }
    Verdict test(const ToolPlaces& at) {
        const double tolerance = q_.options.tolerance, lowest = q_.options.lowest_tip;
        if (at.tip + at.dl < lowest) return Verdict::ruled_out;
        if (!(covers_ && at.spread == 0) && remembered_rule_out(at)) return Verdict::ruled_out;
        bool free = at.tip >= lowest, buried_known = false;
        double highest = -std::numeric_limits<double>::infinity();  // of the part over the axis
        for (std::size_t part = 0; part < q_.tool.size(); ++part) {
            const Envelope& e = q_.tool[part];
            Probe probe;
            probe.scene = q_.scene;
            probe.at = &at;
            probe.top = q_.top;
            probe.margin = q_.margin;
            probe.whole = e;
            probe.fine = q_.shrunken[part];
            if (probe.fine.radius <= 0 || at.tip + probe.fine.low >= q_.top) continue;
            probe.ball = e.core == 0 && e.sin_taper == 0;
            probe.deepest = part == 0 && covers_ && at.spread == 0;
            probe.level = probe.fine.rounding == 0 && e.sin_taper == 0;
            // A sphere about the part's under side, up to the layer's top.
            double middle = probe.fine.low, radius = e.radius;
            if (probe.ball) {
                middle = e.low + e.rounding;
                radius = e.radius - tolerance;
                probe.centre = {at.x, at.y, at.tip + middle};
                probe.nearest2 = radius * radius;
                probe.middle = {static_cast<float>(probe.centre[0]), static_cast<float>(probe.centre[1]),
                                static_cast<float>(probe.centre[2])};
                probe.beyond2 = up(radius + q_.margin) * up(radius + q_.margin);
            } else {
                const double rise = std::min(e.height(e.radius), q_.top - at.tip) - middle;
                if (rise > 0) {
                    const double lift = std::min(rise, (radius * radius + rise * rise) / (2 * rise));
                    middle += lift;
                    radius = std::max(lift, std::hypot(radius, rise - lift));
                }
            }
            search(probe, q_.scene->all(), middle, radius, part == 0);
            if (!probe.ruled_out && q_.overhangs && q_.scene->hanging()) {
                // What hangs over the part, in spheres up the axis that together cover the upright cylinder.
                const double from = at.tip + probe.fine.low;
                const int spheres =
                    std::max(1, static_cast<int>(std::ceil((q_.top - from) / (2 * e.radius))));
                const double half = (q_.top - from) / spheres / 2;
                probe.hanging = true;
                for (int i = 0; i < spheres && !probe.ruled_out; ++i)
                    search(probe, q_.scene->hanging(), probe.fine.low + (2 * i + 1) * half,
                           std::hypot(e.radius, half), part == 0);
            }
            if (probe.ruled_out) return Verdict::ruled_out;
            if (probe.found) {
                if (part == 0 && at.spread > 0)
                    for (std::size_t i = 0; i < probe.count; ++i)
                        if (paired_rule_out(probe.obstacles[i].depth, at)) return Verdict::ruled_out;
                free = false;
                continue;
            }
            // Nothing near: clear, or buried, with the solid all around.
            if (!buried_known) {
                buried_known = true;
                ++counts.rays;
                bool leaves_solid = false;
                highest = q_.scene->first_below(at.x, at.y, q_.top, leaves_solid, highest);
                if (leaves_solid) highest = q_.top;
            }
            if (std::min(e.radius, highest - at.tip - e.low) <= tolerance) continue;
            const Point3 over{at.x, at.y, highest};
            const PlaceDepth buried = depth_of(over, at, e);
            if (part == 0 && (covers_ || at.spread > 0)) remember(over);
            if (rules_out(buried, at) || (part == 0 && paired_rule_out(buried, at)))
                return Verdict::ruled_out;
            free = false;
        }
        return free ? Verdict::free : Verdict::too_deep;
    }

    void search(Probe& probe, RTCScene scene, double middle, double radius, bool keep) {
        ++counts.queries;
        RTCPointQuery query{};
        query.x = static_cast<float>(probe.at->x);
        query.y = static_cast<float>(probe.at->y);
        query.z = static_cast<float>(probe.at->tip + middle);
        query.radius = up(radius + q_.margin);
        RTCPointQueryContext stack;
        rtcInitPointQueryContext(&stack);
        rtcPointQuery(scene, &query, &stack, probe.ball && !probe.hanging ? &look_around : &look, &probe);
        if (!probe.found || !keep) return;
        // The deepest one, and of the others the one that pushes most against it.
        std::size_t first = 0;
        for (std::size_t i = 1; i < probe.count; ++i)
            if (probe.obstacles[i].depth.mm > probe.obstacles[first].depth.mm) first = i;
        std::size_t against = first;
        double least = 0;
        for (std::size_t i = 0; i < probe.count; ++i) {
            const double d = dot(probe.obstacles[i].depth.gradient, probe.obstacles[first].depth.gradient);
            if (d < least) least = d, against = i;
        }
        if (against != first) remember(probe.obstacles[against].point);
        remember(probe.obstacles[first].point);
    }

    void remember(const Point3& obstacle) {
        if (covers_) met_.push_back(obstacle);
        known_.remember(obstacle);
    }

    /// By obstacles met before, alone or in pairs. Keeps what they prove for the ones that are yet to be met
    /// here.
    bool remembered_rule_out(const ToolPlaces& at) {
        proven_ = 0;
        for (std::size_t i = 0; i < known_.size(); ++i) {
            const PlaceDepth depth = depth_of(known_.point(i), at, q_.tool[0]);
            if (depth.mm <= at.tolerance - at.spread) continue;
            if (rules_out(depth, at)) {
                known_.use(i);
                return true;
            }
            proofs_[proven_++] = proof_of(depth, at);
        }
        if (at.spread > 0)
            for (std::size_t i = 1; i < proven_; ++i)
                for (std::size_t k = 0; k < i; ++k)
                    if (rule_out(proofs_[i], proofs_[k], at.tolerance)) return true;
        return false;
    }
    /// By an obstacle met just now and one of the others.
    bool paired_rule_out(const PlaceDepth& depth, const ToolPlaces& at) {
        const DepthProof proof = proof_of(depth, at);
        for (std::size_t k = 0; k < proven_; ++k)
            if (rule_out(proof, proofs_[k], at.tolerance)) return true;
        if (proven_ < proofs_.size()) proofs_[proven_++] = proof;
        return false;
    }

    const ReachQuestion& q_;
    const bool ball_;    ///< half a ball under its own cylinder
    const bool covers_;  ///< a ball or a flat
    CapCover cover_;
    std::vector<Point3> met_;  ///< obstacles of the last place
    Obstacles known_;
    MissedBalls missed_;
    int early_out_credit_ = kEarlyOutCredit;  ///< that whole pieces are proven to be missed
    unsigned skipped_ = 0;
    std::array<DepthProof, 2 * Obstacles::kMost>
        proofs_;  ///< of the obstacles known, about the patch in hand
    std::size_t proven_ = 0;
    std::vector<Patch> stack_;
    double l_ = -1, phi_ = 0;  ///< where the last point was found
};

ReachSearcher::ReachSearcher(const ReachQuestion& question) : impl_(std::make_unique<Impl>(question)) {}
ReachSearcher::~ReachSearcher() = default;
bool ReachSearcher::reaches(const Point3& p, const Point3& n, const Point3& corner, double around) {
    return impl_->reaches(p, n, corner, around);
}
void ReachSearcher::try_proving_missed(const Point3& middle, const Point3& n, double around) {
    impl_->try_proving_missed(middle, n, around);
}
ReachCounts& ReachSearcher::counts() { return impl_->counts; }

ReachQuestion reach_question(const FacetScene& scene, double z_low, double z_high, const ToolShape& tool,
                             const AccessOptions& options) {
    if (!(options.tolerance > 0) || !(options.spacing >= 0) || !(options.accuracy > 0) ||
        !std::isfinite(options.tolerance) || !std::isfinite(options.spacing))
        throw Error(ErrorKind::usage, "access.options",
                    "tolerance and accuracy of accessibility must be over 0, its spacing not under");
    ReachQuestion q;
    q.scene = &scene;
    q.top = z_high - kTopSheet;
    q.options = options;
    q.tool = envelopes(tool);
    for (const Envelope& part : q.tool) q.shrunken.push_back(part.eroded(options.tolerance));
    const Envelope& cutter = q.tool[0];
    if (options.tolerance >= cutter.radius)
        throw Error(ErrorKind::usage, "access.options",
                    "the tolerance of accessibility is not less than the cutter's radius");
    q.rounding = cutter.rounding + options.tolerance;
    q.disc = cutter.core;
    q.angle = std::numbers::pi / 2 - std::asin(cutter.sin_taper);
    q.arc = q.rounding * q.angle;
    if (cutter.sin_taper > 0)
        q.flank = std::max(
            0.0, (cutter.radius - cutter.core - cutter.rounding * cutter.cos_taper) / cutter.sin_taper);
    double reach = 0;
    for (const Envelope& e : q.tool) reach = std::max(reach, e.radius);
    q.margin = scene.margin() + 3 * kFloatMargin * reach;
    for (const std::uint32_t f : scene.overhangs()) {
        const Triangle t = scene.triangle(f);
        const auto [low, high] = std::minmax({t[0][2], t[1][2], t[2][2]});
        if (low < q.top && high > z_low - reach) {
            q.overhangs = true;
            break;
        }
    }
    return q;
}

}  // namespace slabwright
