#include "kernels/access/deviation.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>
#include <utility>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// The room upright over and under a facet: there the facet is as far as its plane.
class Prism {
public:
    explicit Prism(const std::array<Vec3f, 3>& v) {
        const auto less = [](const Vec3f& a, const Vec3f& b) {
            return Point3{double{a.x} - b.x, double{a.y} - b.y, double{a.z} - b.z};
        };
        const auto cross = [](const Point3& a, const Point3& b) {
            return Point3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        };
        const Point3 n = cross(less(v[1], v[0]), less(v[2], v[0]));
        const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (std::size_t k = 0; k < 3; ++k) {
            const Point3 inwards = cross(n, less(v[(k + 1) % 3], v[k]));
            sides_[k] = {inwards[0], inwards[1], inwards[2],
                         -(inwards[0] * v[k].x + inwards[1] * v[k].y + inwards[2] * v[k].z)};
        }
        const double share =
            length > 0 ? 1 / length : std::numeric_limits<double>::infinity();  // of a sliver nothing is told
        plane_ = {n[0] * share, n[1] * share, n[2] * share,
                  -(n[0] * v[0].x + n[1] * v[0].y + n[2] * v[0].z) * share};
    }
    /// Whether a place is in the prism and no farther from the facet than this.
    [[nodiscard]] bool within(const Point3& p, double distance) const {
        const auto over = [&](const std::array<double, 4>& side) {
            return side[0] * p[0] + side[1] * p[1] + side[2] * p[2] + side[3];
        };
        return (over(sides_[0]) >= 0) & (over(sides_[1]) >= 0) & (over(sides_[2]) >= 0) &
               (std::abs(over(plane_)) <= distance);
    }
    /// Whether all places of a box are, by its middle and half its extent: the prism is convex.
    [[nodiscard]] bool within(const Point3& middle, const Point3& half, double distance) const {
        const auto over = [&](const std::array<double, 4>& side) {
            return side[0] * middle[0] + side[1] * middle[1] + side[2] * middle[2] + side[3];
        };
        const auto span = [&](const std::array<double, 4>& side) {
            return std::abs(side[0]) * half[0] + std::abs(side[1]) * half[1] + std::abs(side[2]) * half[2];
        };
        return (over(sides_[0]) >= span(sides_[0])) & (over(sides_[1]) >= span(sides_[1])) &
               (over(sides_[2]) >= span(sides_[2])) & (std::abs(over(plane_)) + span(plane_) <= distance);
    }

private:
    std::array<std::array<double, 4>, 3> sides_{};
    std::array<double, 4> plane_{};
};

/// The facets that places were nearest to lately: places that follow one another go back and forth between a
/// few.
class NearLately {
public:
    explicit NearLately(const std::array<Vec3f, 3>& first)
        : prisms_{Prism(first), Prism(first), Prism(first), Prism(first)} {}
    /// The last one that a place was within or that was taken.
    [[nodiscard]] std::uint32_t facet() const { return facets_[0]; }
    /// Whether a place, or all of a box, is in the prism of one of them and no farther from the facet than
    /// this.
    template <class... Place>
    [[nodiscard]] bool within(const Place&... place) {
        if (prisms_[0].within(place...)) return true;
        for (std::size_t k = 1; k < kMany; ++k)
            if (prisms_[k].within(place...)) {
                std::swap(prisms_[0], prisms_[k]);
                std::swap(facets_[0], facets_[k]);
                return true;
            }
        return false;
    }
    [[nodiscard]] std::span<const std::uint32_t> facets() const { return facets_; }
    void take(std::uint32_t facet, const std::array<Vec3f, 3>& v) {
        if (facet == facets_[0]) return;
        next_ = next_ % (kMany - 1) + 1;
        prisms_[next_] = prisms_[0];
        facets_[next_] = facets_[0];
        prisms_[0] = Prism(v);
        facets_[0] = facet;
    }

private:
    static constexpr std::size_t kMany = 4;
    std::array<Prism, kMany> prisms_;
    std::array<std::uint32_t, kMany> facets_{};
    std::size_t next_ = 0;
};

/// Remembers corners for a while: the facets around one lie near one another in the tree.
class LookedAt {
public:
    LookedAt() { places_.fill({std::numeric_limits<float>::quiet_NaN(), 0, 0}); }
    [[nodiscard]] bool first_time(const Vec3f& v) {
        const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
        const std::uint32_t hash =
            (bits(v.x) * 0x9E3779B1u) ^ (bits(v.y) * 0x85EBCA77u) ^ (bits(v.z) * 0xC2B2AE3Du);
        Vec3f& place = places_[hash >> 24];
        if (place.x == v.x && place.y == v.y && place.z == v.z) return false;
        place = v;
        return true;
    }

private:
    std::array<Vec3f, 256> places_;
};

}  // namespace

// Only the greatest distance matters. A facet of the other part bounds the distance of all that is near it,
// so most of the tree is done with after one look at eight nodes or at one; a place whose bound is beyond the
// greatest known distance is measured. A sample of places is measured before, so that the greatest known is
// near the greatest from the start. The result is exact, so it depends on no order.
double StandingPart::farthest_from(Context& context, const StandingPart& other, double known) const {
    if (facets_.empty() || other.facets_.empty()) return known;
    constexpr std::size_t kFan = std::tuple_size_v<decltype(Nodes::x0)>, kSample = 509;
    const auto corner = [](const Vec3f& v) { return Point3{v.x, v.y, v.z}; };
    const auto larger = [](double a, double b) { return std::max(a, b); };
    const std::size_t samples = known > 0 ? 0 : (facets_.size() + kSample - 1) / kSample;
    const double sampled = parallel_reduce(
        context, samples, 64, known,
        [&](std::size_t begin, std::size_t end) {
            double most = known;
            for (std::size_t i = begin; i < end; ++i)
                for (const Vec3f& v : facets_[i * kSample].v)
                    most = std::max(
                        most, other.nearest(corner(v), {std::numeric_limits<double>::infinity(), 0}, most)
                                  .distance);
            return most;
        },
        larger);
    return parallel_reduce(
        context, levels_[0].size(), 64, sampled,
        [&](std::size_t begin, std::size_t end) {
            double most = sampled;
            NearLately near_lately(other.facets_[0].v);
            LookedAt looked_at;
            // Whether some place of a box may be farther than the greatest known.
            const auto may_be_farther = [&](const Node& box, bool search) {
                const Point3 middle{(double{box.x0} + box.x1) / 2, (double{box.y0} + box.y1) / 2,
                                    (double{box.z0} + box.z1) / 2};
                const double x = double{box.x1} - box.x0, y = double{box.y1} - box.y0,
                             z = double{box.z1} - box.z0;
                if (near_lately.within(middle, Point3{x / 2, y / 2, z / 2}, most)) return false;
                const double half = std::sqrt(x * x + y * y + z * z) / 2;
                if (half > most) return true;  // whatever is near the middle
                Near near{other.distance(middle, near_lately.facet()), near_lately.facet()};
                if (near.distance + half <= most) return false;
                if (!search) return true;
                near = other.nearest(middle, near, most - half);
                near_lately.take(near.facet, other.facets_[near.facet].v);
                return near.distance + half > most;
            };
            const auto look = [&](const Point3& place) {
                if (near_lately.within(place, most)) return;
                Near near{std::numeric_limits<double>::infinity(), 0};  // beside an edge no prism has it
                for (const std::uint32_t facet : near_lately.facets()) {
                    if (const double d = other.distance(place, facet); d < near.distance) near = {d, facet};
                    if (near.distance <= most) return;
                }
                near = other.nearest(place, near, most);
                near_lately.take(near.facet, other.facets_[near.facet].v);
                most = std::max(most, near.distance);
            };
            for (std::size_t i = begin; i < end; ++i) {
                const Nodes& eight = levels_[0][i];
                Node around = eight[0];
                for (std::size_t k = 1; k < kFan; ++k) {
                    around.x0 = std::min(around.x0, eight.x0[k]),
                    around.x1 = std::max(around.x1, eight.x1[k]);
                    around.y0 = std::min(around.y0, eight.y0[k]),
                    around.y1 = std::max(around.y1, eight.y1[k]);
                    around.z0 = std::min(around.z0, eight.z0[k]),
                    around.z1 = std::max(around.z1, eight.z1[k]);
                }
                if (!may_be_farther(around, true)) continue;
                for (std::size_t k = 0; k < kFan; ++k) {
                    if (!(eight.x0[k] <= eight.x1[k]) || !may_be_farther(eight[k], false)) continue;
                    const std::size_t first = (i * kFan + k) * kFan;
                    for (std::size_t f = first; f < std::min(facets_.size(), first + kFan); ++f) {
                        Point3 middle{};
                        for (const Vec3f& v : facets_[f].v) {
                            if (looked_at.first_time(v)) look(corner(v));
                            middle[0] += v.x / 3.0, middle[1] += v.y / 3.0, middle[2] += v.z / 3.0;
                        }
                        look(middle);
                    }
                }
            }
            return most;
        },
        larger);
}

double surface_deviation(Context& context, const StandingPart& a, const StandingPart& b) {
    // What has fewer facets first: of the other, only places that are farther still are looked for.
    const bool in_order = a.facet_count() <= b.facet_count();
    const StandingPart &few = in_order ? a : b, &many = in_order ? b : a;
    return many.farthest_from(context, few, few.farthest_from(context, many, 0));
}

}  // namespace slabwright
