// A wall begins at a concave edge: both its facets lie along the edge, so the edge is as good as the axis
// where the rulings of a cylinder are drawn. From there facets are gathered that stand along the axis and
// follow each other without a sharp or convex edge; the axis is taken anew from their normals, and again with
// a narrower tolerance (rings of different corners have slanted edges). Then a cylinder through the corners,
// and the facets that lie on it. Last, the band must close: its border has one loop once around the axis at
// each end.
#include "kernels/features/round_walls.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <unordered_map>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kWidestChord = 46.5 * kDegree;  // 8 sides, and what rounding adds
constexpr double kLeastBend = 0.5 * kDegree;     // of an edge to begin at: 720 sides
constexpr double kConvexNoise = 3 * kDegree;     // diagonals of a wall's facets may stand out a little
constexpr double kSureNormal = 1 * kDegree;
constexpr double kGatherTilts[] = {12 * kDegree, 5 * kDegree, 2 * kDegree};
constexpr double kWallTilt = 35 * kDegree;  // of a facet whose corners lie on the cylinder
constexpr double kRoundness = 0.02;         // of the radius: the most that corners may miss it
constexpr std::size_t kGrain = 8192;

}  // namespace

std::array<Vec3d, 2> across(const Vec3d& axis) {
    std::size_t least = 0;
    for (std::size_t i = 1; i < 3; ++i)
        if (std::abs(axis[i]) < std::abs(axis[least])) least = i;
    Vec3d unit{};
    unit[least] = 1;
    const Vec3d v = cross(axis, unit);
    const Vec3d w = scaled(1 / length(v), v);
    return {cross(w, axis), w};
}

FacetBends::FacetBends(Context& context, MeshView mesh)
    : mesh_(mesh), normals_(mesh.size()), sure_(mesh.size()) {
    parallel_for(context, mesh.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            const auto facet = static_cast<std::uint32_t>(f);
            const Vec3d a = corner(facet, 0), b = corner(facet, 1), c = corner(facet, 2);
            const Vec3d n = cross(minus(b, a), minus(c, a));
            const double area = length(n);
            const double side = std::max({length(minus(b, a)), length(minus(c, b)), length(minus(a, c))});
            double largest = 0;
            for (const Vec3d& p : {a, b, c})
                for (const double x : p) largest = std::max(largest, std::abs(x));
            if (!(area > 0)) continue;
            const double sign = mesh_.role(f) == FacetRole::turned ? -1 : 1;
            normals_[f] = scaled(sign / area, n);
            // Half a unit of float32 at each corner, over the facet's height.
            const double rounding = largest * 0x1p-24 * side / area;
            sure_[f] = rounding < kSureNormal && mesh_.role(f) != FacetRole::inner;
        }
    });
}

Bend FacetBends::at(FacetEdge edge) const {
    const std::uint32_t other = mesh_.neighbours[edge.facet][edge.corner];
    if (other == kNoFacet || !is_sure(edge.facet) || !is_sure(other)) return {};
    const Vec3d &n = normals_[edge.facet], &m = normals_[other];
    const double rad = std::atan2(length(cross(n, m)), dot(n, m));
    // The corner of each facet that lies off the other's plane the farther decides.
    const Vec3d on = corner(edge.facet, edge.corner);
    double beyond = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
        const double of_other = dot(n, minus(corner(other, k), on));
        const double of_this = dot(m, minus(corner(edge.facet, k), on));
        if (std::abs(of_other) > std::abs(beyond)) beyond = of_other;
        if (std::abs(of_this) > std::abs(beyond)) beyond = of_this;
    }
    return {beyond >= 0 ? rad : -rad, true};
}

namespace {

class WallFinder {
public:
    WallFinder(Context& context, const FacetBends& bends, const HoleOptions& options)
        : context_(context),
          bends_(bends),
          options_(options),
          stamps_(bends.mesh().size(), 0),
          taken_(bends.mesh().size(), 0),
          tried_(bends.mesh().size(), 0) {}

    std::vector<RoundWall> all() {
        const MeshView& mesh = bends_.mesh();
        std::vector<RoundWall> walls;
        for (std::uint32_t f = 0; f < mesh.size(); ++f) {
            if (f % 4096 == 0) context_.throw_if_cancelled();
            for (std::uint32_t k = 0; k < 3 && taken_[f] == 0; ++k) {
                const std::uint32_t g = mesh.neighbours[f][k];
                if (g == kNoFacet || g < f || taken_[g] != 0 || (tried_[f] >> k & 1) != 0) continue;
                const Bend bend = bends_.at({f, k});
                if (!bend.is_sure || bend.rad < kLeastBend || bend.rad > kWidestChord) continue;
                std::optional<RoundWall> wall = from({f, k});
                if (!wall) continue;
                for (const std::uint32_t w : wall->facets) taken_[w] = 1;
                walls.push_back(std::move(*wall));
            }
        }
        std::sort(walls.begin(), walls.end(),
                  [](const RoundWall& a, const RoundWall& b) { return a.facets.front() < b.facets.front(); });
        return walls;
    }

private:
    // The edge's direction; and, where rings of other corners have edges that slant to and fro, between it
    // and the facet's other such edge.
    std::optional<RoundWall> from(FacetEdge seed) {
        const Vec3d way = edge_way(seed);
        if (std::optional<RoundWall> wall = about(seed.facet, way)) return wall;
        mark_tried();
        for (std::uint32_t k = 1; k < 3; ++k) {
            const FacetEdge next{seed.facet, (seed.corner + k) % 3};
            const Bend bend = bends_.at(next);
            if (!bend.is_sure || bend.rad < kLeastBend || bend.rad > kWidestChord) continue;
            Vec3d other = edge_way(next);
            const double along = dot(way, other);
            if (std::abs(along) > std::cos(kDegree)) continue;
            const Vec3d between_them = plus(way, other, along < 0 ? -1 : 1);
            if (std::optional<RoundWall> wall =
                    about(seed.facet, scaled(1 / length(between_them), between_them)))
                return wall;
        }
        return std::nullopt;
    }

    Vec3d edge_way(FacetEdge e) const {
        const Vec3d way = minus(bends_.corner(e.facet, e.corner + 1), bends_.corner(e.facet, e.corner));
        return scaled(1 / length(way), way);
    }

    std::optional<RoundWall> about(std::uint32_t seed, Vec3d axis) {
        std::vector<std::uint32_t> wider;
        for (const double tilt : kGatherTilts) {
            if (!gather(seed, axis, tilt) || !looks_all_around(axis)) {
                // Facets between rings of other corners may all stand askew: the wider tolerance had them.
                if (wider.empty()) return std::nullopt;
                ++stamp_;
                found_.clear();
                for (const std::uint32_t f : wider) add(f);
                break;
            }
            wider = found_;
            axis = axis_of_normals();
        }
        Cylinder cylinder;
        return through_corners(axis, cylinder) ? on_cylinder(seed, cylinder) : std::nullopt;
    }

    // Facets about the seed that stand along the axis and are joined by edges that are neither sharp nor
    // convex, into found_. False when they spread wider than any hole.
    bool gather(std::uint32_t seed, const Vec3d& axis, double tilt) {
        const double most_slope = std::sin(tilt);
        const std::array<Vec3d, 2> uv = across(axis);
        double low[2] = {kUnbounded, kUnbounded}, high[2] = {-kUnbounded, -kUnbounded};
        const auto is_within = [&](std::uint32_t f) {
            for (std::uint32_t k = 0; k < 3; ++k) {
                const Vec3d p = bends_.corner(f, k);
                const double xy[2] = {dot(p, uv[0]), dot(p, uv[1])};
                for (int i = 0; i < 2; ++i) {
                    low[i] = std::min(low[i], xy[i]);
                    high[i] = std::max(high[i], xy[i]);
                    if (high[i] - low[i] > 1.05 * options_.most_diameter_mm) return false;
                }
            }
            return true;
        };
        start(seed);
        for (std::size_t i = 0; i < found_.size(); ++i) {
            const std::uint32_t f = found_[i];
            if (bends_.is_sure(f) && !is_within(f)) return false;
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint32_t g = bends_.mesh().neighbours[f][k];
                if (g == kNoFacet || stamps_[g] == stamp_ || taken_[g] != 0) continue;
                if (bends_.is_sure(g) && std::abs(dot(bends_.normal(g), axis)) > most_slope) continue;
                const Bend bend = bends_.at({f, k});
                if (bend.is_sure && (bend.rad > kWidestChord || bend.rad < -kConvexNoise)) continue;
                add(g);
            }
        }
        return true;
    }

    // Whether the normals of found_ leave out no sixth of a turn.
    bool looks_all_around(const Vec3d& axis) const {
        const auto [u, v] = across(axis);
        unsigned seen = 0;
        for (const std::uint32_t f : found_) {
            if (!bends_.is_sure(f)) continue;
            const Vec3d& n = bends_.normal(f);
            const double turn = std::atan2(dot(n, v), dot(n, u)) / std::numbers::pi + 1;
            seen |= 1u << std::min(5, static_cast<int>(3 * turn));
        }
        return seen == 63;
    }

    // The direction to which the normals are most nearly upright: least eigenvector of Σ A·N·Nᵀ.
    Vec3d axis_of_normals() const {
        Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
        for (const std::uint32_t f : found_) {
            if (!bends_.is_sure(f)) continue;
            const Vec3d a = bends_.corner(f, 0);
            const double area = length(cross(minus(bends_.corner(f, 1), a), minus(bends_.corner(f, 2), a)));
            const Vec3d& n = bends_.normal(f);
            const Eigen::Vector3d normal(n[0], n[1], n[2]);
            sum += area * normal * normal.transpose();
        }
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
        const Eigen::Vector3d least = solver.eigenvectors().col(0);
        return {least[0], least[1], least[2]};
    }

    // Least squares of the corners' distances from the cylinder (Gauss–Newton: place, tilt, radius).
    bool through_corners(Vec3d axis, Cylinder& cylinder) const {
        std::vector<std::uint32_t> ids;
        // Of the edges between sides: other corners may lie on a side, where another hole opens into it.
        for (const std::uint32_t f : found_)
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint32_t g = bends_.mesh().neighbours[f][k];
                if (g == kNoFacet || stamps_[g] != stamp_) continue;
                const Bend bend = bends_.at({f, k});
                if (!bend.is_sure || std::abs(bend.rad) < kLeastBend) continue;
                const Index3& corners = bends_.mesh().facets[f];
                ids.push_back(corners[k]);
                ids.push_back(corners[(k + 1) % 3]);
            }
        std::sort(ids.begin(), ids.end());
        ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
        if (ids.size() < 8) return false;
        Vec3d middle{};
        for (const std::uint32_t v : ids) middle = plus(middle, to_double(bends_.mesh().vertices[v]));
        middle = scaled(1 / static_cast<double>(ids.size()), middle);
        double radius = 0;
        for (int turn = 0; turn < 8; ++turn) {
            const auto [u, v] = across(axis);
            Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
            Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
            for (const std::uint32_t id : ids) {
                const Vec3d p = minus(to_double(bends_.mesh().vertices[id]), middle);
                const double x = dot(p, u), y = dot(p, v), t = dot(p, axis), rho = std::hypot(x, y);
                if (!(rho > 0)) return false;
                // The first turn takes x² + y² = 2·a·x + 2·b·y + c, which needs no radius to begin with.
                Eigen::Matrix<double, 5, 1> row;
                if (turn == 0) row << 2 * x, 2 * y, 0, 0, 1;
                else row << x / rho, y / rho, x / rho * t, y / rho * t, 1;
                normal += row * row.transpose();
                right += row * (turn == 0 ? rho * rho : rho);
            }
            if (turn == 0) normal(2, 2) = normal(3, 3) = 1;
            const Eigen::Matrix<double, 5, 1> b = normal.ldlt().solve(right);
            if (!b.allFinite()) return false;
            middle = plus(plus(middle, u, b[0]), v, b[1]);
            radius = turn == 0 ? 0 : b[4];
            const Vec3d tilted = plus(plus(axis, u, b[2]), v, b[3]);
            axis = scaled(1 / length(tilted), tilted);
        }
        cylinder = {middle, axis, radius};
        return 2 * radius >= options_.least_diameter_mm && 2 * radius <= options_.most_diameter_mm;
    }

    // The facets about the seed all of whose corners lie on the cylinder, if they close around it.
    std::optional<RoundWall> on_cylinder(std::uint32_t seed, const Cylinder& cylinder) {
        double tolerance = std::max(options_.noise_mm, kRoundness * cylinder.radius);
        for (int turn = 0; turn < 2; ++turn) {
            if (!lies_on(seed, cylinder, tolerance)) return std::nullopt;
            start(seed);
            for (std::size_t i = 0; i < found_.size(); ++i)
                for (const std::uint32_t g : bends_.mesh().neighbours[found_[i]])
                    if (g != kNoFacet && stamps_[g] != stamp_ && taken_[g] == 0 &&
                        lies_on(g, cylinder, tolerance))
                        add(g);
            std::optional<RoundWall> wall = closed(cylinder);
            if (!wall) return std::nullopt;
            // Corners miss the circle by no more than its chords do.
            const double narrow = std::max(options_.noise_mm, std::min(tolerance, wall->chord_mm));
            if (turn == 1 || narrow == tolerance) {
                wall->tolerance_mm = tolerance;
                return wall;
            }
            tolerance = narrow;
        }
        return std::nullopt;
    }

    // All corners on the cylinder; or, on a side into which another hole opens, on a plane that spans a
    // chord.
    bool lies_on(std::uint32_t facet, const Cylinder& cylinder, double tolerance) const {
        Vec3d middle{};
        double nearest = kUnbounded;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const Vec3d p = bends_.corner(facet, k);
            const double radius = cylinder.place(p).radius;
            if (radius > cylinder.radius + tolerance) return false;
            nearest = std::min(nearest, radius);
            middle = plus(middle, p, 1.0 / 3);
        }
        const bool all_on = nearest >= cylinder.radius - tolerance;
        if (!bends_.is_sure(facet)) return all_on;
        const Vec3d& n = bends_.normal(facet);
        const double slope = std::abs(dot(n, cylinder.axis));
        const double inwards = dot(n, minus(cylinder.at, middle));  // of the plane, to the axis
        if (all_on) return slope <= std::sin(kWallTilt) && inwards > 0;
        return slope <= std::sin(kGatherTilts[2]) &&
               inwards >= std::cos(kWidestChord / 2) * cylinder.radius - tolerance;
    }

    // found_ as a wall, if its border goes once around the axis at each end.
    std::optional<RoundWall> closed(const Cylinder& cylinder) const;

    void start(std::uint32_t seed) {
        ++stamp_;
        found_.clear();
        add(seed);
    }
    void add(std::uint32_t facet) {
        stamps_[facet] = stamp_;
        found_.push_back(facet);
    }
    // No other wall begins at an edge inside what was gathered in vain.
    void mark_tried() {
        for (const std::uint32_t f : found_)
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint32_t g = bends_.mesh().neighbours[f][k];
                if (g != kNoFacet && stamps_[g] == stamp_)
                    tried_[f] = static_cast<std::uint8_t>(tried_[f] | 1u << k);
            }
    }

    Context& context_;
    const FacetBends& bends_;
    const HoleOptions& options_;
    std::vector<std::uint32_t> stamps_;
    std::vector<std::uint8_t> taken_, tried_;
    std::vector<std::uint32_t> found_;
    std::uint32_t stamp_ = 0;
};

// Edges at the border, joined where they share a corner.
class BorderLoops {
public:
    void add(std::uint32_t from, std::uint32_t to) { parent(root(from)) = root(to); }
    std::uint32_t root(std::uint32_t v) {
        while (parent(v) != v) v = parent(v) = parent(parent(v));
        return v;
    }

private:
    std::uint32_t& parent(std::uint32_t v) { return parents_.try_emplace(v, v).first->second; }
    std::unordered_map<std::uint32_t, std::uint32_t> parents_;
};

std::optional<RoundWall> WallFinder::closed(const Cylinder& cylinder) const {
    const MeshView& mesh = bends_.mesh();
    const std::array<Vec3d, 2> uv = across(cylinder.axis);
    std::vector<FacetEdge> border;
    BorderLoops loops;
    for (const std::uint32_t f : found_)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t g = mesh.neighbours[f][k];
            if (g != kNoFacet && stamps_[g] == stamp_) continue;
            border.push_back({f, k});
            loops.add(mesh.facets[f][k], mesh.facets[f][(k + 1) % 3]);
        }
    const auto turn_of = [&](FacetEdge e) {
        const Vec3d p = minus(bends_.corner(e.facet, e.corner), cylinder.at);
        const Vec3d q = minus(bends_.corner(e.facet, e.corner + 1), cylinder.at);
        const double px = dot(p, uv[0]), py = dot(p, uv[1]), qx = dot(q, uv[0]), qy = dot(q, uv[1]);
        const double sign = mesh.role(e.facet) == FacetRole::turned ? -1 : 1;
        return sign * std::atan2(px * qy - py * qx, px * qx + py * qy);
    };
    std::unordered_map<std::uint32_t, double> turns;
    for (const FacetEdge& e : border) turns[loops.root(mesh.facets[e.facet][e.corner])] += turn_of(e);
    std::size_t rising = 0, falling = 0;
    for (const auto& [root, turn] : turns) {
        const double rounds = turn / (2 * std::numbers::pi);
        if (std::abs(rounds) > 1.5) return std::nullopt;
        rising += rounds > 0.5 ? 1 : 0;
        falling += rounds < -0.5 ? 1 : 0;
    }
    if (rising != 1 || falling != 1) return std::nullopt;
    RoundWall wall;
    wall.cylinder = cylinder;
    wall.facets = found_;
    std::sort(wall.facets.begin(), wall.facets.end());
    wall.low = wall.round_high = kUnbounded;
    wall.high = wall.round_low = -kUnbounded;
    for (const std::uint32_t f : found_)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const double along = cylinder.place(bends_.corner(f, k)).along;
            wall.low = std::min(wall.low, along);
            wall.high = std::max(wall.high, along);
        }
    double widest = 0;
    for (const FacetEdge& e : border) {
        const double turn = turns[loops.root(mesh.facets[e.facet][e.corner])];
        if (std::abs(turn) < std::numbers::pi) continue;
        // Seen from the axis a facet runs counter-clockwise: its upper edge turns the right-handed way.
        wall.ends[turn > 0 ? 1 : 0].push_back(e);
        widest = std::max(widest, std::abs(turn_of(e)));
        const double along = cylinder.place(bends_.corner(e.facet, e.corner)).along;
        if (turn > 0) wall.round_high = std::min(wall.round_high, along);
        else wall.round_low = std::max(wall.round_low, along);
    }
    if (widest > kWidestChord) return std::nullopt;
    wall.chord_mm = cylinder.radius * (1 - std::cos(widest / 2));
    for (std::vector<FacetEdge>& end : wall.ends)
        std::sort(end.begin(), end.end(), [](const FacetEdge& a, const FacetEdge& b) {
            return a.facet != b.facet ? a.facet < b.facet : a.corner < b.corner;
        });
    return wall;
}

}  // namespace

std::vector<RoundWall> find_round_walls(Context& context, const FacetBends& bends,
                                        const HoleOptions& options) {
    return WallFinder(context, bends, options).all();
}

}  // namespace slabwright
