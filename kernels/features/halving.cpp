// Peaks and valleys by LUO's halving search (LUO 4.2.3): sections at a coarse spacing are compared with their
// neighbours, and every bracket in which something differs is halved until it is narrower than the
// resolution.
//
// Two sections agree when they have equally many loops and every body of one shares some (x, y) with a body
// of the other. A body is a component of the section's material, a hollow one of its complement; hollows are
// compared as well, for the bottom of a depression closes a hole. What is found is named by what has no
// partner across the last bracket: a body that ends going up is a peak, a hollow that ends going down is a
// valley. Bodies that begin going up and hollows that end going up face down, which is no Type I. A count
// that changes although all have partners is a saddle.
//
// Both halves of a bracket are searched, so that two features of one coarse step are both found when the
// middle section parts them. What appears and vanishes between two coarse sections stays unseen: that is the
// method's own limit.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "kernels/features/finders.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr std::int32_t kOutside = -1;  // the hollow around everything

// A section prepared for asking which body or hollow a point lies in: its edges in rows of equal height.
class Bodies {
public:
    explicit Bodies(const Loops& loops) : loops_(loops) {
        hole_.resize(loops.size());
        for (std::size_t l = 0; l < loops.size(); ++l) {
            hole_[l] = signed_area(loops.loop(l)) < 0;
            for (const Point2 p : loops.loop(l)) {
                low_ = std::min<std::int64_t>(low_, p.y);
                high_ = std::max<std::int64_t>(high_, p.y);
            }
        }
        if (loops.points.empty()) return;
        rows_ =
            std::clamp<std::int64_t>(static_cast<std::int64_t>(loops.points.size() / 4), 1, high_ - low_ + 1);
        starts_.assign(static_cast<std::size_t>(rows_) + 1, 0);
        auto for_edges = [&](auto&& f) {
            for (std::size_t l = 0; l < loops.size(); ++l) {
                const auto loop = loops.loop(l);
                for (std::size_t i = 0; i < loop.size(); ++i) {
                    const Point2 a = loop[i], b = loop[(i + 1) % loop.size()];
                    for (std::int64_t r = row(std::min(a.y, b.y)); r <= row(std::max(a.y, b.y)); ++r)
                        f(static_cast<std::size_t>(r), Edge{a, b, static_cast<std::int32_t>(l)});
                }
            }
        };
        for_edges([&](std::size_t r, const Edge&) { ++starts_[r]; });
        std::uint32_t sum = 0;
        for (std::uint32_t& s : starts_) s = sum += s;
        edges_.resize(sum);
        for_edges([&](std::size_t r, const Edge& e) { edges_[--starts_[r]] = e; });
    }

    struct Edge {
        Point2 a, b;
        std::int32_t loop = 0;
    };
    [[nodiscard]] const Loops& loops() const { return loops_; }
    [[nodiscard]] bool hole(std::size_t loop) const { return hole_[loop]; }
    /// The body (outer loop) that the loop bounds, and the hollow (hole, or kOutside).
    [[nodiscard]] std::int32_t body(std::size_t loop) const {
        return hole_[loop] ? loops_.parents[loop] : static_cast<std::int32_t>(loop);
    }
    [[nodiscard]] std::int32_t hollow(std::size_t loop) const {
        return hole_[loop] ? static_cast<std::int32_t>(loop) : loops_.parents[loop];
    }

    struct Place {
        bool material = false;
        std::int32_t part = kOutside;  // body or hollow
    };
    /// Where p lies; nothing when it lies on an edge. The nearest edge to its right tells: it runs up past
    /// material.
    [[nodiscard]] std::optional<Place> locate(Point2 p) const {
        Place place;
        if (p.y < low_ || p.y > high_) return place;
        double nearest = HUGE_VAL;
        const auto r = static_cast<std::size_t>(row(p.y));
        for (std::uint32_t i = starts_[r]; i < starts_[r + 1]; ++i) {
            const Edge& e = edges_[i];
            const std::int64_t side = side_of(e, p);
            if (side == 0 && std::min(e.a.y, e.b.y) <= p.y && p.y <= std::max(e.a.y, e.b.y) &&
                std::min(e.a.x, e.b.x) <= p.x && p.x <= std::max(e.a.x, e.b.x))
                return std::nullopt;
            const bool up = e.a.y <= p.y && e.b.y > p.y, down = e.b.y <= p.y && e.a.y > p.y;
            if (!(up && side > 0) && !(down && side < 0)) continue;
            const double x =
                e.a.x + (static_cast<double>(e.b.x) - e.a.x) *
                            ((static_cast<double>(p.y) - e.a.y) / (static_cast<double>(e.b.y) - e.a.y));
            if (x >= nearest) continue;
            nearest = x;
            const auto l = static_cast<std::size_t>(e.loop);
            place = up ? Place{true, body(l)} : Place{false, hollow(l)};
        }
        return place;
    }

    /// True when the segment meets an edge so that material meets material there: they cross, or run on one
    /// another one way.
    template <class F>
    void for_meeting(Point2 a, Point2 b, F&& f) const {
        if (loops_.points.empty() || std::max(a.y, b.y) < low_ || std::min(a.y, b.y) > high_) return;
        const Edge own{a, b, 0};
        for (std::int64_t r = row(std::min(a.y, b.y)); r <= row(std::max(a.y, b.y)); ++r)
            for (std::uint32_t i = starts_[static_cast<std::size_t>(r)];
                 i < starts_[static_cast<std::size_t>(r) + 1]; ++i) {
                const Edge& e = edges_[i];
                const std::int64_t ea = side_of(own, e.a), eb = side_of(own, e.b);
                if (ea == 0 && eb == 0) {
                    const double along =
                        (static_cast<double>(b.x) - a.x) * (static_cast<double>(e.b.x) - e.a.x) +
                        (static_cast<double>(b.y) - a.y) * (static_cast<double>(e.b.y) - e.a.y);
                    const bool overlap = std::max(std::min(a.x, b.x), std::min(e.a.x, e.b.x)) <=
                                             std::min(std::max(a.x, b.x), std::max(e.a.x, e.b.x)) &&
                                         std::max(std::min(a.y, b.y), std::min(e.a.y, e.b.y)) <=
                                             std::min(std::max(a.y, b.y), std::max(e.a.y, e.b.y));
                    if (along > 0 && overlap) f(static_cast<std::size_t>(e.loop));
                } else if ((ea > 0) != (eb > 0) && (side_of(e, a) > 0) != (side_of(e, b) > 0))
                    f(static_cast<std::size_t>(e.loop));
            }
    }

private:
    // Positive when p lies left of the edge. Differences of int32 need 33 bits, so their products are formed
    // in 128.
    static std::int64_t side_of(const Edge& e, Point2 p) {
        __extension__ using Wide = __int128;
        const Wide s = static_cast<Wide>(std::int64_t{e.b.x} - e.a.x) * (std::int64_t{p.y} - e.a.y) -
                       static_cast<Wide>(std::int64_t{e.b.y} - e.a.y) * (std::int64_t{p.x} - e.a.x);
        return s > 0 ? 1 : s < 0 ? -1 : 0;
    }
    [[nodiscard]] std::int64_t row(std::int64_t y) const {
        return std::clamp<std::int64_t>((y - low_) * rows_ / (high_ - low_ + 1), 0, rows_ - 1);
    }

    const Loops& loops_;
    std::vector<std::uint8_t> hole_;
    std::int64_t low_ = INT64_MAX / 4, high_ = -INT64_MAX / 4, rows_ = 1;
    std::vector<std::uint32_t> starts_;
    std::vector<Edge> edges_;
};

// Marks what of `own` shares a point with `other`: bodies with bodies, hollows with hollows. Entry l stands
// for the body of outer loop l or the hollow of hole l.
void mark_partners(const Bodies& own, const Bodies& other, std::vector<std::uint8_t>& own_marks,
                   std::vector<std::uint8_t>& other_marks) {
    auto mark = [](std::vector<std::uint8_t>& marks, std::int32_t part) {
        if (part != kOutside) marks[static_cast<std::size_t>(part)] = 1;
    };
    const Loops& loops = own.loops();
    for (std::size_t l = 0; l < loops.size(); ++l)
        for (const Point2 p : loops.loop(l)) {
            const auto place = other.locate(p);
            if (!place) continue;
            mark(own_marks, place->material ? own.body(l) : own.hollow(l));
            mark(other_marks, place->part);
        }
}

// Where no corner of one lies within the other, boundaries may still cross or coincide.
void mark_meetings(const Bodies& own, const Bodies& other, std::vector<std::uint8_t>& own_marks,
                   std::vector<std::uint8_t>& other_marks) {
    auto mark = [](std::vector<std::uint8_t>& marks, std::int32_t part) {
        if (part != kOutside) marks[static_cast<std::size_t>(part)] = 1;
    };
    const Loops& loops = own.loops();
    for (std::size_t l = 0; l < loops.size(); ++l) {
        auto open = [&](std::int32_t part) {
            return part != kOutside && !own_marks[static_cast<std::size_t>(part)];
        };
        if (!open(own.body(l)) && !open(own.hollow(l))) continue;
        const auto loop = loops.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i)
            other.for_meeting(loop[i], loop[(i + 1) % loop.size()], [&](std::size_t m) {
                mark(own_marks, own.body(l));
                mark(own_marks, own.hollow(l));
                mark(other_marks, other.body(m));
                mark(other_marks, other.hollow(m));
            });
    }
}

struct Comparison {
    bool differ = false;
    std::vector<std::uint8_t> lower_marks, upper_marks;  // which loops' bodies or hollows have a partner
};

Comparison compare_sections(const Section& lower, const Section& upper, bool classify) {
    Comparison c;
    c.differ = lower.loops.size() != upper.loops.size();
    if (c.differ && !classify) return c;
    c.lower_marks.assign(lower.loops.size(), 0);
    c.upper_marks.assign(upper.loops.size(), 0);
    const Bodies a(lower.loops), b(upper.loops);
    mark_partners(a, b, c.lower_marks, c.upper_marks);
    mark_partners(b, a, c.upper_marks, c.lower_marks);
    mark_meetings(a, b, c.lower_marks, c.upper_marks);
    mark_meetings(b, a, c.upper_marks, c.lower_marks);
    auto all = [](const std::vector<std::uint8_t>& marks) {
        return std::find(marks.begin(), marks.end(), 0) == marks.end();
    };
    c.differ = c.differ || !all(c.lower_marks) || !all(c.upper_marks);
    return c;
}

Feature feature_at(FeatureType type, double z, std::span<const Point2> loop) {
    Feature feature;
    feature.type = type;
    feature.found_by = FoundBy::halving;
    feature.z_low = feature.z_high = z;
    // Placed at the loop's point nearest to their mean: unlike the mean, it is on the body.
    if (loop.empty()) return feature;
    double x = 0, y = 0, least = HUGE_VAL;
    for (const Point2 p : loop) {
        x += to_mm(p.x) / static_cast<double>(loop.size());
        y += to_mm(p.y) / static_cast<double>(loop.size());
    }
    for (const Point2 p : loop) {
        const double d = std::hypot(to_mm(p.x) - x, to_mm(p.y) - y);
        if (d >= least) continue;
        least = d;
        feature.x = to_mm(p.x);
        feature.y = to_mm(p.y);
    }
    return feature;
}

std::vector<Feature> name_difference(const Section& lower, const Section& upper) {
    const Comparison c = compare_sections(lower, upper, true);
    const double z = (lower.plane.z + upper.plane.z) / 2;
    std::vector<Feature> found;
    bool partnerless = false;
    for (std::size_t l = 0; l < lower.loops.size(); ++l) {
        if (c.lower_marks[l]) continue;
        partnerless = true;
        if (signed_area(lower.loops.loop(l)) > 0)
            found.push_back(feature_at(FeatureType::peak, z, lower.loops.loop(l)));
    }
    for (std::size_t l = 0; l < upper.loops.size(); ++l) {
        if (c.upper_marks[l]) continue;
        partnerless = true;
        if (signed_area(upper.loops.loop(l)) < 0)
            found.push_back(feature_at(FeatureType::valley, z, upper.loops.loop(l)));
    }
    if (c.differ && !partnerless && !upper.loops.empty() && !lower.loops.empty()) {
        // Placed at a loop that only one of the two sections has, as far as counting tells: the last of the
        // larger set.
        const Loops& more = lower.loops.size() > upper.loops.size() ? lower.loops : upper.loops;
        found.push_back(feature_at(FeatureType::saddle, z, more.loop(more.size() - 1)));
    }
    return found;
}

struct Bracket {
    Section lower, upper;
};

}  // namespace

std::vector<Feature> find_halving(Context& context, MeshView mesh, const FeatureOptions& options) {
    const Box3 box = bounds(context, mesh);
    const double bottom = box.min.z, top = box.max.z;
    if (mesh.size() == 0 || !(top > bottom)) return {};
    std::vector<Plane> planes;
    const auto steps = static_cast<std::size_t>(std::ceil((top - bottom) / options.halving_coarse_mm));
    for (std::size_t i = 0; i < std::max<std::size_t>(1, steps); ++i)
        planes.push_back({bottom + static_cast<double>(i) * options.halving_coarse_mm, Side::above});
    planes.push_back({top, Side::above});  // the limit from above the top is empty: what reaches it ends
    std::vector<Section> coarse = slice(context, mesh, planes);

    std::vector<Bracket> open;
    std::vector<std::uint8_t> differ(coarse.size(), 0);
    parallel_each(context, coarse.size() - 1, [&](std::size_t i) {
        differ[i] = compare_sections(coarse[i], coarse[i + 1], false).differ;
    });
    for (std::size_t i = 0; i + 1 < coarse.size(); ++i)
        if (differ[i]) open.push_back({coarse[i], coarse[i + 1]});
    coarse.clear();

    std::vector<Feature> found;
    while (!open.empty()) {
        std::vector<Bracket> wide, narrow;
        for (Bracket& b : open)
            (b.upper.plane.z - b.lower.plane.z < options.halving_resolution_mm ? narrow : wide)
                .push_back(std::move(b));
        std::vector<std::vector<Feature>> named(narrow.size());
        parallel_each(context, narrow.size(),
                      [&](std::size_t i) { named[i] = name_difference(narrow[i].lower, narrow[i].upper); });
        for (std::vector<Feature>& n : named) found.insert(found.end(), n.begin(), n.end());
        planes.clear();
        for (const Bracket& b : wide)
            planes.push_back({(b.lower.plane.z + b.upper.plane.z) / 2, Side::above});
        std::vector<Section> middles = slice(context, mesh, planes);
        struct Halves {
            bool lower, upper;
        };
        std::vector<Halves> halves(wide.size());
        parallel_each(context, wide.size(), [&](std::size_t i) {
            halves[i] = {compare_sections(wide[i].lower, middles[i], false).differ,
                         compare_sections(middles[i], wide[i].upper, false).differ};
        });
        open.clear();
        for (std::size_t i = 0; i < wide.size(); ++i) {
            if (halves[i].lower) open.push_back({std::move(wide[i].lower), middles[i]});
            if (halves[i].upper) open.push_back({std::move(middles[i]), std::move(wide[i].upper)});
        }
    }
    return found;
}

}  // namespace slabwright
