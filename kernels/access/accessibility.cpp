#include "kernels/access/accessibility.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <string>

#include "kernels/access/cap_cover.h"
#include "kernels/access/obstacles.h"
#include "kernels/access/poke.h"
#include "kernels/access/tree_memory.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/errors.h"
#include "kernels/geometry/triangle.h"
#include "kernels/geometry/wide.h"
#include "kernels/mesh/morton.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kFloatMargin =
    4e-7;  // of the coordinates' size: Embree works in float32 and only finds candidates
constexpr double kUpright = 1e-4;  // rad: what faces down by less counts as upright
constexpr double kResolution =
    0.5;  // of the tolerance: places nearer than this to each other are not told apart
constexpr int kMostPlaces = 20000;     // of one point; some tens are usual
constexpr std::size_t kMostCaps = 48;  // of a proof about one point; some are usual
constexpr double kMostAround =
    0.5;  // of a ball's radius: points farther from each other are proven to be missed one by one
constexpr double kInset = 0.02;  // of a piece: its corners are tested so far within it
constexpr double kShared =
    1.5;  // of a point's distance from the corner: within it other pieces' points are hoped to be
constexpr int kMostLevels = 40;      // of halving
constexpr std::size_t kMissed = 64;  // balls without a reached point remembered
constexpr int kEarlyOutCredit = 8;   // pieces in a row that may fail to be proven at once, until only
constexpr unsigned kTryAgain = 16;   // every so many is tried
constexpr std::size_t kPiecesAtOnce = 128;

float up(double v) { return std::nextafter(static_cast<float>(v), std::numeric_limits<float>::infinity()); }

/// What a facet leaves below a height: none, one or two triangles.
struct Below {
    std::array<Triangle, 2> t;
    int n = 0;
};
Below below(const Triangle& t, double top) {
    Below b;
    const int under = (t[0][2] <= top) + (t[1][2] <= top) + (t[2][2] <= top);
    if (under == 3) {
        b.t[0] = t;
        b.n = 1;
        return b;
    }
    if (under == 0) return b;
    std::array<Point3, 4> q;
    int n = 0;
    for (int k = 0; k < 3; ++k) {
        const Point3 &a = t[k], &c = t[(k + 1) % 3];
        if (a[2] <= top) q[n++] = a;
        if ((a[2] <= top) != (c[2] <= top)) {
            const double s = (top - a[2]) / (c[2] - a[2]);
            q[n++] = {a[0] + s * (c[0] - a[0]), a[1] + s * (c[1] - a[1]), top};
        }
    }
    for (int k = 1; k + 1 < n; ++k) b.t[b.n++] = {q[0], q[k], q[k + 1]};
    return b;
}

struct Counts {
    std::uint64_t points = 0, queries = 0, rays = 0, undecided = 0;
    void add(const Counts& c) {
        points += c.points;
        queries += c.queries;
        rays += c.rays;
        undecided += c.undecided;
    }
};

/// Floats4 planes of a facet, n·p + d: its own, and those upright on it through its edges, which face
/// outward. A line of the cache says how far a place is from most facets, in single precision.
struct Planes {
    Floats4 x, y, z, d;
    /// Whether the square of the distance is more, as far as the planes tell: they do not where a corner is
    /// nearest, and on slivers.
    [[nodiscard]] bool farther(const Vec3f& p, float squared) const {
        const Floats4 at = x * p.x + y * p.y + z * p.z + d, none{}, beside = at > none ? at : none,
                      over{at[0], at[0], at[0], at[0]};
        const auto lanes =
            std::bit_cast<std::array<std::uint64_t, 2>>(over * over + beside * beside > squared);
        return ((lanes[0] >> 32U) | lanes[1]) != 0;  // of the edges' planes
    }
};

Planes planes_of(const Triangle& t) {
    auto sub = [](const Point3& a, const Point3& b) { return Point3{a[0] - b[0], a[1] - b[1], a[2] - b[2]}; };
    auto cross = [](const Point3& a, const Point3& b) {
        return Point3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    Planes planes{};
    const Point3 n = cross(sub(t[1], t[0]), sub(t[2], t[0]));
    const double longest2 =
        std::max({squared_distance(t[0], t[1]), squared_distance(t[1], t[2]), squared_distance(t[2], t[0])});
    constexpr double sliver = 1e-16;  // of twice the area and the longest edge, squared: rounding makes up
                                      // the plane of a facet that is thinner
    if (!(dot(n, n) > sliver * longest2 * longest2)) return planes;
    auto set = [&](int i, const Point3& normal, const Point3& on) {
        const double l = std::sqrt(dot(normal, normal));
        const Point3 unit{static_cast<float>(normal[0] / l), static_cast<float>(normal[1] / l),
                          static_cast<float>(normal[2] / l)};
        planes.x[i] = static_cast<float>(unit[0]);
        planes.y[i] = static_cast<float>(unit[1]);
        planes.z[i] = static_cast<float>(unit[2]);
        planes.d[i] = static_cast<float>(-dot(unit, on));
    };
    set(0, n, t[0]);
    for (int k = 0; k < 3; ++k) set(k + 1, cross(sub(t[(k + 1) % 3], t[k]), n), t[k]);
    return planes;
}

}  // namespace

struct AccessScene::Impl {
    Impl(Context& context, MeshView of)
        : planes_memory(context, of.size() * sizeof(Planes), "the planes of the facets"),
          memory(context),
          mesh(of) {}

    MemoryCharge planes_memory;
    TreeMemory memory;
    MeshView mesh;
    double margin = 0;
    std::vector<Planes> planes;  ///< by facet
    Box3 box;
    std::vector<std::uint32_t> overhangs;  ///< the facets that face down
    RTCDevice device = nullptr;
    RTCScene all = nullptr, hanging = nullptr;

    ~Impl() {
        for (RTCScene scene : {all, hanging})
            if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }
    [[nodiscard]] Triangle triangle(std::uint32_t f) const {
        Triangle t;
        for (int k = 0; k < 3; ++k) {
            const Vec3f& v = mesh.vertices[mesh.facets[f][k]];
            t[k] = {v.x, v.y, v.z};
        }
        return t;
    }
    RTCScene build(std::span<const Index3> facets) {
        RTCScene scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        // Embree reads 16 bytes at a vertex of 12: it gets a copy of its own, which it pads.
        auto* vertices = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), mesh.vertices.size()));
        auto* corners = static_cast<Index3*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Index3), facets.size()));
        if (vertices && corners) {
            std::copy(mesh.vertices.begin(), mesh.vertices.end(), vertices);
            std::copy(facets.begin(), facets.end(), corners);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        if (rtcGetDeviceError(device) != RTC_ERROR_NONE) {
            rtcReleaseScene(scene);
            memory.charge();
            throw Error(ErrorKind::no_plan, "embree.build", "Embree could not build its tree", {},
                        "free memory, or plan with fewer facets");
        }
        return scene;
    }
    /// The first facet that a vertical ray meets, from z towards `limit`; its height, or `none`.
    [[nodiscard]] double first_below(double x, double y, double z, bool& leaves_solid, double none) const {
        RTCRayHit ray{};
        ray.ray.org_x = static_cast<float>(x);
        ray.ray.org_y = static_cast<float>(y);
        ray.ray.org_z = static_cast<float>(z);
        ray.ray.dir_z = -1;
        ray.ray.tfar = std::numeric_limits<float>::infinity();
        ray.ray.mask = 0xFFFFFFFFu;
        ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if defined(RTC_VERSION_MAJOR) && RTC_VERSION_MAJOR >= 4
        rtcIntersect1(all, &ray);
#else
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect1(all, &context, &ray);
#endif
        if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return none;
        leaves_solid = ray.hit.Ng_z < 0;
        return z - static_cast<double>(ray.ray.tfar);
    }
    [[nodiscard]] bool overhung(const Point3& from, double top) const {
        if (!hanging || from[2] >= top) return false;
        RTCRay ray{};
        ray.org_x = static_cast<float>(from[0]);
        ray.org_y = static_cast<float>(from[1]);
        ray.org_z = static_cast<float>(from[2]);
        ray.dir_z = 1;
        ray.tfar = static_cast<float>(top - from[2]);
        ray.mask = 0xFFFFFFFFu;
#if defined(RTC_VERSION_MAJOR) && RTC_VERSION_MAJOR >= 4
        rtcOccluded1(hanging, &ray);
#else
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcOccluded1(hanging, &context, &ray);
#endif
        return ray.tfar < 0;
    }
};

namespace {

using Scene = AccessScene::Impl;

/// A patch of places: its middle, and how the tool moves from there to the others: by up to `dl` along one
/// direction and `ds` along another, and by `second` in any direction besides.
struct Places {
    double x = 0, y = 0, tip = 0;
    Point3 along{}, around{};
    double dl = 0, ds = 0, second = 0;
    double spread = 0;  ///< no place is farther from the middle
    double lift = 0;    ///< nor higher or lower by more
    double tolerance = 0;
};

/// How deep a point of the part is in a part of the tool, and how that changes as the tool moves: by the
/// motion's component along `gradient` at least, less its square over 2·`bend`. No bend: only that depth
/// changes by no more than the tool moves.
struct Depth {
    double mm;
    Point3 gradient;
    double bend;
};

// The tool part is a core, which is a cone on a disc, grown by the rounding. A ball of that radius about the
// core's point nearest to q belongs to the tool wherever the tool goes, so the depth in that ball is a lower
// bound.
Depth depth_of(const Point3& q, const Places& at, const Envelope& e) {
    const double dx = q[0] - at.x, dy = q[1] - at.y, d = std::sqrt(dx * dx + dy * dy),
                 z = q[2] - at.tip - e.low - e.rounding;
    if (e.core == 0 &&
        e.sin_taper ==
            0) {  // a ball under its own cylinder: no more than the distance from its axis or centre
        const double fall = std::min(0.0, z), far = std::sqrt(d * d + fall * fall);
        return far > 0 ? Depth{e.rounding - far, {dx / far, dy / far, fall / far}, far}
                       : Depth{e.rounding, {}, 0};
    }
    const double ex = d > 0 ? dx / d : 1, ey = d > 0 ? dy / d : 0;
    auto depth = [&](double mm, double out, double rise, double bend) {
        return Depth{mm, {out * ex, out * ey, rise}, bend};
    };
    const double beyond = d - e.core, off = beyond * e.cos_taper - z * e.sin_taper,
                 up_flank = beyond * e.sin_taper + z * e.cos_taper;
    if (d > e.radius) return depth(e.radius - d, 1, 0, 0);
    if (z <= 0 && beyond <= 0) return depth(e.rounding + z, 0, -1, -z);
    if (beyond > 0 && up_flank <= 0) {  // below the flank's foot: the disc's border is nearest
        const double far = std::sqrt(beyond * beyond + z * z);
        return far > 0 ? depth(e.rounding - far, beyond / far, z / far, far) : depth(e.rounding, 1, 0, 0);
    }
    Depth side = off > 0 ? depth(e.rounding - off, e.cos_taper, -e.sin_taper, off)
                         : depth(e.rounding - off, e.cos_taper, -e.sin_taper, d);
    if (e.radius - d < side.mm) side = depth(e.radius - d, 1, 0, d);
    if (off > 0) return side;
    // Within the core the depth is the lesser of those from the side and from below. Where one of them is
    // ample all over the patch, the other decides.
    const double rise = e.rounding + z;
    if (rise - at.lift > at.tolerance && side.mm <= rise) return side;
    if (side.mm - at.spread > at.tolerance) return depth(rise, 0, -1, std::numeric_limits<double>::max());
    if (rise - at.lift > at.tolerance) return side;
    return depth(std::min(rise, side.mm), 0, 0, 0);
}

/// What one obstacle proves about a patch: depth is at least floor + by_l·(−1 … 1) + by_s·(−1 … 1).
struct Proof {
    double floor = 0, by_l = 0, by_s = 0;
};
Proof proof_of(const Depth& depth, const Places& at) {
    if (depth.bend <= 0) return {depth.mm - at.spread, 0, 0};
    return {depth.mm - at.second - at.spread * at.spread / (2 * depth.bend),
            dot(depth.gradient, at.along) * at.dl, dot(depth.gradient, at.around) * at.ds};
}
bool rules_out(const Depth& depth, const Places& at) {
    const double tolerance = at.tolerance;
    if (depth.mm - at.spread > tolerance) return true;
    const Proof p = proof_of(depth, at);
    return p.floor - std::abs(p.by_l) - std::abs(p.by_s) > tolerance;
}
/// Whether two obstacles on different sides of the tool leave no room between them: the deeper of two depths
/// is at least any weighted mean of them, and the weights may let their changes cancel.
bool rule_out(const Proof& a, const Proof& b, double tolerance) {
    if (std::max(a.floor, b.floor) <= tolerance) return false;
    auto mean = [&](double w) {
        return w * a.floor + (1 - w) * b.floor - std::abs(w * a.by_l + (1 - w) * b.by_l) -
                   std::abs(w * a.by_s + (1 - w) * b.by_s) >
               tolerance;
    };
    auto cancelling = [&](double p, double q) { return (p > 0) != (q > 0) && p != q && mean(q / (q - p)); };
    return cancelling(a.by_l, b.by_l) || cancelling(a.by_s, b.by_s);
}

/// Looks in the facets around a part of the tool for what is deeper in it than the tolerance, at one place,
/// and as deep as can be.
struct Probe {
    const Scene* scene = nullptr;
    const Places* at = nullptr;
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
        Depth depth;
    };
    std::array<Obstacle, 8> obstacles;  ///< the deepest ones found
    std::size_t count = 0;

    void take(const Point3& q) {
        const Depth depth = depth_of(q, *at, whole);
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
        const Below parts = below(facet, top);
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
    if (probe.scene->planes[args->primID].farther(probe.middle, probe.beyond2)) return false;
    if (!probe.look(args->primID)) return false;
    const float within = probe.ruled_out ? 0 : up(std::sqrt(probe.nearest2) + probe.margin);
    probe.beyond2 = within * within;
    args->query->radius = std::min(args->query->radius, within);
    return true;
}

bool look(RTCPointQueryFunctionArguments* args) {
    auto& probe = *static_cast<Probe*>(args->userPtr);
    const bool nearer = probe.look(probe.hanging ? probe.scene->overhangs[args->primID] : args->primID);
    if (probe.ruled_out) {
        args->query->radius = 0;
        return true;
    }
    if (!nearer) return false;
    args->query->radius = std::min(args->query->radius, up(std::sqrt(probe.nearest2) + probe.margin));
    return true;
}

/// The layer and the tool that points are tested for.
struct Question {
    const Scene* scene = nullptr;
    double top = 0;
    double margin = 0;       ///< mm that places and distances in single precision may be wrong by
    bool overhangs = false;  ///< some may hang over a place of the tool
    std::vector<Envelope> tool, shrunken;  ///< its parts, and what of them is deeper than the tolerance
    AccessOptions options;
    // The under side of the cutter grown by the tolerance, along its profile from the tip outwards: the disc,
    // the arc, the flank.
    double disc = 0, arc = 0, flank = 0, rounding = 0, angle = 0;

    [[nodiscard]] double length() const { return disc + arc + flank; }
    /// The profile at a length along it: distance from the axis, height over the tip, and the direction,
    /// outwards and upwards.
    struct Spot {
        double distance, height, outwards, upwards;
    };
    [[nodiscard]] Spot at(double l) const {
        const double centre = tool[0].low + tool[0].rounding;
        if (l <= disc) return {l, centre - rounding, 1, 0};
        const double u = std::min(l - disc, arc) / rounding, more = std::max(0.0, l - disc - arc);
        const double sine = std::sin(u), cosine = std::cos(u);
        return {disc + rounding * sine + more * cosine, centre - rounding * cosine + more * sine, cosine,
                sine};
    }
};

Question ask(const Scene& scene, double z_low, double z_high, const ToolShape& tool,
             const AccessOptions& options) {
    if (!(options.tolerance > 0) || !(options.spacing >= 0) || !(options.accuracy > 0) ||
        !std::isfinite(options.tolerance) || !std::isfinite(options.spacing))
        throw Error(ErrorKind::usage, "access.options",
                    "tolerance and accuracy of accessibility must be over 0, its spacing not under");
    Question q;
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
    q.margin = scene.margin + 3 * kFloatMargin * reach;
    for (const std::uint32_t f : scene.overhangs) {
        const Triangle t = scene.triangle(f);
        const auto [low, high] = std::minmax({t[0][2], t[1][2], t[2][2]});
        if (low < q.top && high > z_low - reach) {
            q.overhangs = true;
            break;
        }
    }
    return q;
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

/// Tests points one after the other; what it remembers makes neighbours cheap.
class Searcher {
public:
    explicit Searcher(const Question& question)
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

    Counts counts;

private:
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
    Places toward(const Point3& p, const Point3& u) const {
        const double across = u[2] < 0 ? q_.rounding / std::hypot(u[0], u[1]) : q_.rounding;
        Places at;
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

    Places places_of(const Point3& p, const Patch& patch) const {
        const Question::Spot spot = q_.at(patch.l);
        const double c = std::cos(patch.phi), s = std::sin(patch.phi);
        Places at;
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
    Verdict test(const Places& at) {
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
            search(probe, q_.scene->all, middle, radius, part == 0);
            if (!probe.ruled_out && q_.overhangs && q_.scene->hanging) {
                // What hangs over the part, in spheres up the axis that together cover the upright cylinder.
                const double from = at.tip + probe.fine.low;
                const int spheres =
                    std::max(1, static_cast<int>(std::ceil((q_.top - from) / (2 * e.radius))));
                const double half = (q_.top - from) / spheres / 2;
                probe.hanging = true;
                for (int i = 0; i < spheres && !probe.ruled_out; ++i)
                    search(probe, q_.scene->hanging, probe.fine.low + (2 * i + 1) * half,
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
            const Depth buried = depth_of(over, at, e);
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
    bool remembered_rule_out(const Places& at) {
        proven_ = 0;
        for (std::size_t i = 0; i < known_.size(); ++i) {
            const Depth depth = depth_of(known_.point(i), at, q_.tool[0]);
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
    bool paired_rule_out(const Depth& depth, const Places& at) {
        const Proof proof = proof_of(depth, at);
        for (std::size_t k = 0; k < proven_; ++k)
            if (rule_out(proof, proofs_[k], at.tolerance)) return true;
        if (proven_ < proofs_.size()) proofs_[proven_++] = proof;
        return false;
    }

    const Question& q_;
    const bool ball_;    ///< half a ball under its own cylinder
    const bool covers_;  ///< a ball or a flat
    CapCover cover_;
    std::vector<Point3> met_;  ///< obstacles of the last place
    Obstacles known_;
    MissedBalls missed_;
    int early_out_credit_ = kEarlyOutCredit;  ///< that whole pieces are proven to be missed
    unsigned skipped_ = 0;
    std::array<Proof, 2 * Obstacles::kMost> proofs_;  ///< of the obstacles known, about the patch in hand
    std::size_t proven_ = 0;
    std::vector<Patch> stack_;
    double l_ = -1, phi_ = 0;  ///< where the last point was found
};

/// A piece of a facet, in doubles.
struct Piece {
    Triangle t;
    std::uint32_t item = 0;  ///< which of the facets to be machined
};

double area_of(const Triangle& t) {
    const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
    const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
    const double x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    return std::sqrt(x * x + y * y + z * z) / 2;
}

/// Cuts across the longest edge; returns its length before.
double halve(const Triangle& t, Triangle& a, Triangle& b) {
    int longest = 0;
    double length = -1;
    for (int k = 0; k < 3; ++k) {
        const double d = squared_distance(t[k], t[(k + 1) % 3]);
        if (d > length) length = d, longest = k;
    }
    const Point3 &p = t[longest], &q = t[(longest + 1) % 3], &o = t[(longest + 2) % 3];
    const Point3 m{(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2};
    a = {p, m, o};
    b = {m, q, o};
    return std::sqrt(length);
}

double longest_edge(const Triangle& t) {
    return std::sqrt(
        std::max({squared_distance(t[0], t[1]), squared_distance(t[1], t[2]), squared_distance(t[2], t[0])}));
}

template <class F>
void split_to(const Triangle& t, double edge, F&& f) {
    Triangle a, b;
    if (halve(t, a, b) <= edge) {
        f(t);
        return;
    }
    split_to(a, edge, f);
    split_to(b, edge, f);
}

/// Areas of a piece, or of all pieces of a facet.
struct Areas {
    double all = 0, reached = 0, undercut = 0;
    void add(const Areas& a) { all += a.all, reached += a.reached, undercut += a.undercut; }
};

struct Item {
    std::uint32_t facet = 0;
    Point3 normal{};
};

/// What is to be machined: facets cut to the layer, in the order of a space-filling curve, and their facets.
struct Work {
    std::vector<Item> items;
    std::vector<Piece> pieces;
    double undercut = 0;  ///< of facets that face down
};

Work collect(Context& context, const Scene& scene, double low, double high) {
    struct Part {
        std::vector<Item> items;
        std::vector<Piece> pieces;
        double undercut = 0;
    };
    constexpr std::size_t grain = std::size_t{1} << 13;
    const std::size_t n = scene.mesh.size();
    std::vector<Part> parts((n + grain - 1) / grain);
    const double down = -std::sin(kUpright);
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        Part& part = parts[begin / grain];
        for (std::size_t f = begin; f < end; ++f) {
            const Triangle t = scene.triangle(static_cast<std::uint32_t>(f));
            const auto [z0, z1] = std::minmax({t[0][2], t[1][2], t[2][2]});
            if (z0 >= high || z1 <= low) continue;
            const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
            const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
            const Point3 w{uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx};
            const double length = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
            if (!(length > 0)) continue;
            // What lies above the layer's bottom is what its mirror image has below it.
            const Below under = below(t, high);
            std::array<Triangle, 4> pieces;
            int count = 0;
            for (int i = 0; i < under.n; ++i) {
                Triangle mirrored = under.t[i];
                for (Point3& p : mirrored) p[2] = -p[2];
                const Below over = below(mirrored, -low);
                for (int k = 0; k < over.n; ++k) {
                    pieces[count] = over.t[k];
                    for (Point3& p : pieces[count]) p[2] = -p[2];
                    ++count;
                }
            }
            const Point3 normal{w[0] / length, w[1] / length, w[2] / length};
            if (normal[2] < down) {
                for (int i = 0; i < count; ++i) part.undercut += area_of(pieces[i]);
                continue;
            }
            const auto item = static_cast<std::uint32_t>(part.items.size());
            bool any = false;
            for (int i = 0; i < count; ++i)
                if (area_of(pieces[i]) > 0) {
                    part.pieces.push_back({pieces[i], item});
                    any = true;
                }
            if (any) part.items.push_back({static_cast<std::uint32_t>(f), normal});
        }
    });
    Work work;
    struct Key {
        std::uint64_t code;
        std::uint32_t part, index;
    };
    std::vector<Key> keys;
    std::size_t items = 0, pieces = 0;
    for (const Part& part : parts) items += part.items.size(), pieces += part.pieces.size();
    work.items.reserve(items);
    work.pieces.reserve(pieces);
    keys.reserve(pieces);
    const MortonGrid grid(scene.box);
    for (std::size_t p = 0; p < parts.size(); ++p) {
        Part& part = parts[p];
        const auto first = static_cast<std::uint32_t>(work.items.size());
        for (std::size_t i = 0; i < part.pieces.size(); ++i) {
            Piece& piece = part.pieces[i];
            piece.item += first;
            auto middle = [&](int k) { return (piece.t[0][k] + piece.t[1][k] + piece.t[2][k]) / 3; };
            keys.push_back({grid.code(middle(0), middle(1), middle(2)), static_cast<std::uint32_t>(p),
                            static_cast<std::uint32_t>(i)});
        }
        work.items.insert(work.items.end(), part.items.begin(), part.items.end());
        work.undercut += part.undercut;
    }
    parallel_sort(context, keys.begin(), keys.end(), [](const Key& a, const Key& b) {
        if (a.code != b.code) return a.code < b.code;
        return a.part != b.part ? a.part < b.part : a.index < b.index;
    });
    for (const Key& key : keys) work.pieces.push_back(parts[key.part].pieces[key.index]);
    return work;
}

/// Of points that are tested together.
struct Tally {
    int points = 0, reached = 0, undercut = 0;
    [[nodiscard]] bool agree() const {
        return reached == points || undercut == points || (reached == 0 && undercut == 0);
    }
    [[nodiscard]] Areas share(double area) const {
        const double each = area / points;
        return {each * (points - undercut), each * reached, each * undercut};
    }
};

void add_point(Tally& tally, Searcher& searcher, const Question& q, const Point3& p, const Point3& n,
               const Point3& corner = {}, double around = 0) {
    ++tally.points;
    if (q.overhangs) {
        ++searcher.counts.rays;
        const double off = q.options.tolerance;
        if (q.scene->overhung({p[0] + off * n[0], p[1] + off * n[1], p[2] + off * n[2]}, q.top)) {
            ++tally.undercut;
            return;
        }
    }
    if (searcher.reaches(p, n, corner, around)) ++tally.reached;
}

Point3 mixed(const Triangle& t, double a, double b, double c) {
    Point3 p;
    for (int k = 0; k < 3; ++k) p[k] = a * t[0][k] + b * t[1][k] + c * t[2][k];
    return p;
}
Point3 middle_of(const Triangle& t) { return mixed(t, 1.0 / 3, 1.0 / 3, 1.0 / 3); }

/// Tests a piece at its middle and just within its corners.
Areas measure(Searcher& searcher, const Question& q, const Piece& piece, const Point3& n, bool& agree) {
    Tally tally;
    const Point3 middle = middle_of(piece.t);
    add_point(tally, searcher, q, middle, n);
    if (!q.overhangs && tally.reached == 0) {
        double around2 = 0;
        for (const Point3& corner : piece.t) around2 = std::max(around2, squared_distance(corner, middle));
        searcher.try_proving_missed(middle, n, std::sqrt(around2));
    }
    for (int k = 0; k < 3; ++k) {
        std::array<double, 3> w{kInset / 2, kInset / 2, kInset / 2};
        w[k] = 1 - kInset;
        const Point3 p = mixed(piece.t, w[0], w[1], w[2]);
        add_point(tally, searcher, q, p, n, piece.t[k], kShared * std::sqrt(squared_distance(p, piece.t[k])));
    }
    agree = tally.agree();
    return tally.share(area_of(piece.t));
}

}  // namespace

AccessScene::AccessScene(Context& context, MeshView mesh) : impl_(std::make_unique<Impl>(context, mesh)) {
    impl_->box = bounds(mesh);
    double size = 1;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3f& v = mesh.vertices[i];
        if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
            throw Error(ErrorKind::input, "mesh.not_finite", "a vertex is not finite",
                        "vertex " + std::to_string(i), "repair the mesh");
        size = std::max({size, std::abs(static_cast<double>(v.x)), std::abs(static_cast<double>(v.y)),
                         std::abs(static_cast<double>(v.z))});
    }
    impl_->margin = 3 * size * kFloatMargin;
    std::vector<Index3> hanging;
    impl_->planes.resize(mesh.size());
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        const Triangle t = impl_->triangle(static_cast<std::uint32_t>(f));
        impl_->planes[f] = planes_of(t);
        const double nz =
            (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]);
        // The part's own bottom hangs over nothing that a tool could be in.
        const double lowest = impl_->box.min.z;
        if (!(nz < 0) || (t[0][2] <= lowest && t[1][2] <= lowest && t[2][2] <= lowest)) continue;
        impl_->overhangs.push_back(static_cast<std::uint32_t>(f));
        hanging.push_back(mesh.facets[f]);
    }
    context.throw_if_cancelled();
    impl_->device = rtcNewDevice(nullptr);  // "threads=…" here would clamp TBB for the whole process
    if (!impl_->device)
        throw Error(ErrorKind::no_plan, "embree.device", "Embree offers no device", {},
                    "check the installation of libembree");
    rtcSetDeviceMemoryMonitorFunction(impl_->device, &TreeMemory::monitor, &impl_->memory);
    impl_->all = impl_->build(mesh.facets);
    if (!hanging.empty()) impl_->hanging = impl_->build(hanging);
    impl_->memory.charge();
}

AccessScene::~AccessScene() = default;

bool AccessScene::reaches(double z_high, const Point3& point, const Point3& normal, const ToolShape& tool,
                          const AccessOptions& options) const {
    const Question question = ask(*impl_, point[2], z_high, tool, options);
    return Searcher(question).reaches(point, normal);
}

Accessibility AccessScene::accessible(Context& context, double z_low, double z_high, const ToolShape& tool,
                                      const AccessOptions& options) const {
    const Question question = ask(*impl_, z_low, z_high, tool, options);
    constexpr double tasks_per_edge = 16;  // pieces of a large facet that are handed out as one, by length
    Work work = collect(context, *impl_, z_low + kTopSheet, z_high - kTopSheet);
    double spacing = options.spacing;
    if (spacing == 0) {
        double surface = 0;
        for (const Piece& piece : work.pieces) surface += area_of(piece.t);
        spacing = std::max(1.0, std::sqrt(surface) / 50);
    }
    const double longest = spacing * tasks_per_edge;
    if (std::any_of(work.pieces.begin(), work.pieces.end(),
                    [&](const Piece& piece) { return longest_edge(piece.t) > longest; })) {
        std::vector<Piece> tasks;
        for (const Piece& piece : work.pieces)
            split_to(piece.t, longest, [&](const Triangle& t) { tasks.push_back({t, piece.item}); });
        work.pieces.swap(tasks);
    }
    std::vector<Areas> of_item(work.items.size());
    Counts counts;

    // Level by level, so that the share of area on a border is known when it is decided whether to go on.
    struct Outcome {
        std::vector<std::pair<std::uint32_t, Areas>> decided;  // by item
        std::vector<Piece> border;
        std::vector<Areas> shares;  // of the border's pieces
        double mixed = 0,
               mixed2 = 0;  // areas of small pieces that were tested together and disagree, and their squares
        Counts counts;
    };
    const double small = options.shares ? 0 : spacing * spacing / 2;
    auto run = [&](const std::vector<Piece>& pieces, double edge, bool whole) {
        std::vector<Outcome> outcomes((pieces.size() + kPiecesAtOnce - 1) / kPiecesAtOnce);
        parallel_for(context, pieces.size(), kPiecesAtOnce, [&](std::size_t begin, std::size_t end) {
            Outcome& outcome = outcomes[begin / kPiecesAtOnce];
            Searcher searcher(question);
            auto decide = [&](std::uint32_t item, const Areas& areas) {
                if (!outcome.decided.empty() && outcome.decided.back().first == item)
                    outcome.decided.back().second.add(areas);
                else outcome.decided.emplace_back(item, areas);
            };
            auto one = [&](const Piece& piece) {
                if (context.cancelled()) return;
                bool agree = false;
                const Areas areas = measure(searcher, question, piece, work.items[piece.item].normal, agree);
                if (agree) {
                    decide(piece.item, areas);
                } else {
                    outcome.border.push_back(piece);
                    outcome.shares.push_back(areas);
                }
            };
            // Small pieces that follow one another are near to each other; four of them stand for all.
            std::size_t first = begin;
            double gathered = 0;
            auto together = [&](std::size_t last) {
                if (first < last && gathered > 0) {
                    Tally tally;
                    const std::size_t count = last - first, points = std::min<std::size_t>(4, count);
                    for (std::size_t k = 0; k < points; ++k) {
                        const Piece& piece = pieces[first + (2 * k + 1) * count / (2 * points)];
                        add_point(tally, searcher, question, middle_of(piece.t),
                                  work.items[piece.item].normal);
                    }
                    decide(pieces[first].item, tally.share(gathered));
                    if (!tally.agree()) outcome.mixed += gathered, outcome.mixed2 += gathered * gathered;
                }
                gathered = 0;
            };
            for (std::size_t i = begin; i < end; ++i) {
                if (context.cancelled()) return;
                const Piece& piece = pieces[i];
                if (!whole) {
                    Triangle half[2], quarter[2];
                    halve(piece.t, half[0], half[1]);
                    for (const Triangle& h : half) {
                        halve(h, quarter[0], quarter[1]);
                        one({quarter[0], piece.item});
                        one({quarter[1], piece.item});
                    }
                    continue;
                }
                const double area = area_of(piece.t);
                if (area < small && longest_edge(piece.t) <= edge) {
                    if (gathered == 0) first = i;
                    gathered += area;
                    if (gathered >= small) together(i + 1);
                    continue;
                }
                together(i);
                split_to(piece.t, edge, [&](const Triangle& t) { one({t, piece.item}); });
            }
            together(end);
            outcome.counts = searcher.counts;
        });
        context.throw_if_cancelled();
        return outcomes;
    };

    std::vector<Piece> border = std::move(work.pieces);
    std::vector<Areas> shares;
    double total = 0;
    double on_border = 0, disagreeing = 0, disagreeing2 = 0;
    for (int level = 0; level < kMostLevels && !border.empty(); ++level) {
        std::vector<Outcome> outcomes = run(border, spacing, level == 0);
        border.clear();
        shares.clear();
        on_border = 0;
        double squares = 0;
        for (Outcome& outcome : outcomes) {
            for (const auto& [item, areas] : outcome.decided) {
                of_item[item].add(areas);
                total += areas.all;
            }
            for (const Areas& areas : outcome.shares) {
                const double area = areas.all + areas.undercut;
                on_border += area;
                squares += area * area;
            }
            border.insert(border.end(), outcome.border.begin(), outcome.border.end());
            shares.insert(shares.end(), outcome.shares.begin(), outcome.shares.end());
            disagreeing += outcome.mixed;
            disagreeing2 += outcome.mixed2;
            counts.add(outcome.counts);
        }
        const double error = std::sqrt(squares + disagreeing2) / 2;
        if (error <= options.accuracy * (total + on_border) || squares <= disagreeing2) break;
        if (options.limit > 0) {
            Areas sum;
            for (const Areas& areas : of_item) sum.add(areas);
            for (const Areas& areas : shares) sum.add(areas);
            constexpr double surely = 4;
            if (std::abs(sum.reached - options.limit * sum.all) > surely * error) break;
        }
    }
    for (std::size_t i = 0; i < border.size(); ++i) of_item[border[i].item].add(shares[i]);

    Accessibility result;
    result.undercut = work.undercut;
    result.uncertain = on_border + disagreeing;
    if (options.shares) result.share.assign(impl_->mesh.size(), -1.0f);
    for (std::size_t i = 0; i < of_item.size(); ++i) {
        const Areas& a = of_item[i];
        result.area += a.all;
        result.reached += a.reached;
        result.undercut += a.undercut;
        if (options.shares && a.all > 0)
            result.share[work.items[i].facet] = static_cast<float>(std::min(1.0, a.reached / a.all));
    }
    result.points = counts.points;
    result.queries = counts.queries;
    result.rays = counts.rays;
    result.undecided = counts.undecided;
    return result;
}

Accessibility accessible(Context& context, MeshView mesh, double z_low, double z_high, const ToolShape& tool,
                         const AccessOptions& options) {
    return AccessScene(context, mesh).accessible(context, z_low, z_high, tool, options);
}

}  // namespace slabwright
