// How it works. The two sides of a plane are told apart by one float threshold: a vertex lies above exactly
// if its z is greater. So a facet in the plane is all below or all above and yields nothing, and every other
// facet that meets the plane has exactly one edge that goes up through it and one that goes down. The
// section's segment on a facet, solid on its left, runs from the down edge to the up edge, and the facet
// across the up edge continues it: no search, no comparing of coordinates. On closed adjacency this is a
// permutation of the crossed facets, and its cycles are the loops.
//
// Each vertex is ranked among the sorted thresholds, each facet is thereby crossed by one run of planes.
// Those that any plane crosses are listed with their runs, so that a few planes of a large mesh cost little
// more than one look at it, and two passes over that list (count, scatter) give every plane the ascending
// list of its facets. Planes are then walked independently.
#include "kernels/slicing/slicing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <queue>
#include <string>
#include <utility>

#include "kernels/errors.h"
#include "kernels/mesh/bulk_memory.h"
#include "kernels/parallel/parallel.h"
#include "kernels/parallel/scratch_pool.h"

namespace slabwright {

namespace {

constexpr std::size_t kVertexGrain = std::size_t{1} << 15;
constexpr std::size_t kFacetGrain = std::size_t{1} << 16;
/// Facet chunks of the scatter; more would only make the counters (chunks × planes) larger.
constexpr std::size_t kMaxChunks = 64;
/// Crossed facets listed at a time (64 MB of indices), unless one plane alone has more.
constexpr std::size_t kBatchCrossings = std::size_t{1} << 24;
/// Planes that are counted at a time, so that the counters stay small on any request.
constexpr std::size_t kBatchPlanes = 4096;
/// Neighbouring planes cross mostly the same facets, so a thread does a few in a row.
constexpr std::size_t kPlaneGrain = 4;
/// Past this |x| or |y| in mm a point does not fit 32 bits.
constexpr float kReach = 214000.0f;

/// The largest float t such that "vertex above the plane on this side" is the same as "vertex z > t".
float threshold(const Plane& plane) {
    constexpr float lowest = -std::numeric_limits<float>::infinity();
    if (plane.z > static_cast<double>(std::numeric_limits<float>::max()))
        return std::numeric_limits<float>::max();
    if (plane.z < -static_cast<double>(std::numeric_limits<float>::max())) return lowest;
    const auto nearest = static_cast<float>(plane.z);
    const bool too_high = plane.side == Side::above ? static_cast<double>(nearest) > plane.z
                                                    : static_cast<double>(nearest) >= plane.z;
    return too_high ? std::nextafterf(nearest, lowest) : nearest;
}

/// Counts the thresholds under a height. Buckets of equal height narrow the search; as the bucket is a
/// monotonic function of the height, only the thresholds of the height's own bucket are in doubt.
class Ranking {
public:
    explicit Ranking(const std::vector<float>& thresholds) : thresholds_(thresholds) {
        low_ = thresholds.front();
        const double span = static_cast<double>(thresholds.back()) - low_;
        const std::size_t buckets = 4 * thresholds.size() + 1;
        last_ = static_cast<double>(buckets - 1);
        per_mm_ = std::isfinite(span) && span > 0 ? last_ / span : 0;
        starts_.assign(buckets + 1, 0);
        for (const float t : thresholds) ++starts_[bucket(t) + 1];
        std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    }
    [[nodiscard]] std::uint32_t operator()(float z) const {
        const std::size_t b = bucket(z);
        const float* base = thresholds_.data();
        return static_cast<std::uint32_t>(std::lower_bound(base + starts_[b], base + starts_[b + 1], z) -
                                          base);
    }

private:
    [[nodiscard]] std::size_t bucket(float z) const {
        const double b = per_mm_ == 0 ? 0 : (static_cast<double>(z) - low_) * per_mm_;
        return b <= 0 ? 0 : b >= last_ ? static_cast<std::size_t>(last_) : static_cast<std::size_t>(b);
    }
    const std::vector<float>& thresholds_;
    std::vector<std::uint32_t> starts_;
    double low_ = 0, per_mm_ = 0, last_ = 0;
};

/// A facet, and the planes [first, last) of the sorted request that cross it.
struct Run {
    std::uint32_t facet = 0, first = 0, last = 0;
};

/// By the corners above the plane (bit i for corner i): the edge along which the facet rises through it, and
/// the edge along which it falls; edge k goes from corner k to corner k + 1, and 3 is none.
constexpr std::uint8_t kUpEdge[8] = {3, 2, 0, 2, 1, 1, 0, 3};
constexpr std::uint8_t kDownEdge[8] = {3, 0, 1, 1, 2, 0, 2, 3};
constexpr std::uint8_t kNextCorner[3] = {1, 2, 0};

unsigned corners_above(MeshView mesh, const Index3& facet, float limit) {
    return static_cast<unsigned>(mesh.vertices[facet[0]].z > limit) |
           static_cast<unsigned>(mesh.vertices[facet[1]].z > limit) << 1 |
           static_cast<unsigned>(mesh.vertices[facet[2]].z > limit) << 2;
}

/// Nearest unit, halves away from zero; the same as to_units() on every coordinate a float can hold, and
/// inlined.
std::int32_t nearest_unit(double mm) {
    const double units = mm * kUnitsPerMm;
    return static_cast<std::int32_t>(units + (units < 0 ? -0.5 : 0.5));
}

/// Where an edge meets the plane. Both facets of an edge must find the same point, so it is computed from the
/// end of lower index. The ends lie on different sides, so the share t is in [0, 1], and a plane exactly at
/// an end gives that end.
Point2 crossing(MeshView mesh, std::uint32_t a, std::uint32_t b, double z) {
    if (b < a) std::swap(a, b);
    const Vec3f &p = mesh.vertices[a], &q = mesh.vertices[b];
    const double rise = static_cast<double>(q.z) - p.z;
    const double t = (z - p.z) / rise;
    return {nearest_unit(p.x + t * (static_cast<double>(q.x) - p.x)),
            nearest_unit(p.y + t * (static_cast<double>(q.y) - p.y))};
}

/// What walking one plane needs; kept from plane to plane, and clean between them.
struct Scratch {
    std::vector<std::uint64_t> pending;  // one bit per facet: crossed, not walked yet
    std::vector<Point2> points, backward;
    Loops loops, chains;
};

bool is_pending(const Scratch& scratch, std::uint32_t facet) {
    return (scratch.pending[facet >> 6] >> (facet & 63) & 1) != 0;
}
void set_pending(Scratch& scratch, std::uint32_t facet) {
    scratch.pending[facet >> 6] |= std::uint64_t{1} << (facet & 63);
}
void clear_pending(Scratch& scratch, std::uint32_t facet) {
    scratch.pending[facet >> 6] &= ~(std::uint64_t{1} << (facet & 63));
}

void drop_repeats(std::vector<Point2>& points) {
    points.erase(std::unique(points.begin(), points.end()), points.end());
}

/// Adds a loop unless it encloses nothing. Exact, as twice the area may not fit 64 bits.
void add_loop(std::vector<Point2>& points, Loops& loops) {
    drop_repeats(points);
    while (points.size() > 1 && points.back() == points.front()) points.pop_back();
    if (points.size() < 3 || signed_area(points) == 0) return;
    loops.points.insert(loops.points.end(), points.begin(), points.end());
    loops.close_loop();
}

/// Follows the section through one facet after the other from `start`, along up edges (`kUpEdge`) or against
/// its direction
/// (`kDownEdge`), and appends the crossing on every edge it goes through.
/// @return true when it came back to `start`, false when it ended at an open edge
bool walk(MeshView mesh, double z, float limit, std::uint32_t start, const std::uint8_t (&edge_of)[8],
          Scratch& scratch, std::vector<Point2>& points) {
    const std::size_t facets = mesh.facets.size();
    for (std::uint32_t f = start;;) {
        const Index3& facet = mesh.facets[f];
        const unsigned edge = edge_of[corners_above(mesh, facet, limit)];
        points.push_back(crossing(mesh, facet[edge], facet[kNextCorner[edge]], z));
        const std::uint32_t next = mesh.neighbours[f][edge];
        if (next == start) return true;
        // Beside an open edge this ends a walk only where adjacency is not mutual.
        if (next >= facets || !is_pending(scratch, next)) return false;
        clear_pending(scratch, next);
        f = next;
    }
}

/// Joins chains whose ends are within the gap, the nearest pair of ends first, ties to the lower index. Only
/// an end and a beginning are joined, so that the solid stays on the left.
std::uint32_t join_chains(const Loops& chains, double gap_mm, Loops& loops, Loops& open,
                          std::vector<Point2>& points) {
    const std::size_t n = chains.size();
    const double gap = gap_mm * kUnitsPerMm;
    const double gap2 = gap * gap;
    struct Pair {
        double distance2 = 0;
        std::uint32_t tail = 0, head = 0;
    };
    auto after = [](const Pair& a, const Pair& b) {
        if (a.distance2 != b.distance2) return a.distance2 > b.distance2;
        return a.tail != b.tail ? a.tail > b.tail : a.head > b.head;
    };
    auto head_of = [&](std::uint32_t c) { return chains.loop(c).front(); };
    auto tail_of = [&](std::uint32_t c) { return chains.loop(c).back(); };
    std::vector<std::uint32_t> by_x(n);
    std::iota(by_x.begin(), by_x.end(), 0u);
    std::sort(by_x.begin(), by_x.end(), [&](std::uint32_t a, std::uint32_t b) {
        return head_of(a).x != head_of(b).x ? head_of(a).x < head_of(b).x : a < b;
    });
    std::vector<std::uint32_t> next(n, kNoFacet), previous(n, kNoFacet);

    // The nearest free beginning to an end: outwards in x from the end, until x alone is too far.
    auto nearest = [&](std::uint32_t tail, Pair& best) {
        const Point2 p = tail_of(tail);
        best = {std::nextafter(gap2, std::numeric_limits<double>::infinity()), tail, kNoFacet};
        auto consider = [&](std::uint32_t head) {
            const double dx = static_cast<double>(head_of(head).x) - p.x,
                         dy = static_cast<double>(head_of(head).y) - p.y;
            if (dx * dx > best.distance2) return false;
            const bool itself = head == tail && chains.loop(head).size() < 3;
            const double distance2 = dx * dx + dy * dy;
            if (previous[head] == kNoFacet && !itself && distance2 <= gap2 &&
                (distance2 < best.distance2 || (distance2 == best.distance2 && head < best.head))) {
                best = {distance2, tail, head};
            }
            return true;
        };
        const auto from = std::lower_bound(by_x.begin(), by_x.end(), p.x,
                                           [&](std::uint32_t c, std::int32_t x) { return head_of(c).x < x; });
        for (auto it = from; it != by_x.end() && consider(*it);) ++it;
        for (auto it = from; it != by_x.begin() && consider(*std::prev(it));) --it;
        return best.head != kNoFacet;
    };
    std::priority_queue<Pair, std::vector<Pair>, decltype(after)> queue(after);
    Pair pair;
    for (std::uint32_t c = 0; c < n; ++c)
        if (nearest(c, pair)) queue.push(pair);
    std::uint32_t joined = 0;
    while (!queue.empty()) {
        const Pair top = queue.top();
        queue.pop();
        if (previous[top.head] != kNoFacet) {
            if (nearest(top.tail, pair)) queue.push(pair);
            continue;
        }
        next[top.tail] = top.head;
        previous[top.head] = top.tail;
        ++joined;
    }

    std::vector<bool> done(n, false);
    auto gather = [&](std::uint32_t first) {
        points.clear();
        for (std::uint32_t c = first; c != kNoFacet && !done[c]; c = next[c]) {
            done[c] = true;
            points.insert(points.end(), chains.loop(c).begin(), chains.loop(c).end());
        }
    };
    for (std::uint32_t c = 0; c < n; ++c) {
        if (previous[c] != kNoFacet) continue;
        gather(c);
        drop_repeats(points);
        if (points.size() < 2) continue;
        open.points.insert(open.points.end(), points.begin(), points.end());
        open.close_loop();
    }
    for (std::uint32_t c = 0; c < n; ++c) {
        if (done[c]) continue;
        gather(c);
        add_loop(points, loops);
    }
    return joined;
}

/// An exact copy: the scratch keeps its room, the result takes no more than it needs.
Loops taken(const Loops& from) {
    Loops to;
    to.points = std::vector<Point2>(from.points.begin(), from.points.end());
    to.starts = std::vector<std::uint32_t>(from.starts.begin(), from.starts.end());
    return to;
}

void clear(Loops& loops) {
    loops.points.clear();
    loops.starts.assign(1, 0);
    loops.parents.clear();
}

void cut(MeshView mesh, float limit, std::span<const std::uint32_t> crossed, const SliceOptions& options,
         Scratch& scratch, Section& section) {
    const double z = section.plane.z;
    for (const std::uint32_t f : crossed) set_pending(scratch, f);
    clear(scratch.loops);
    clear(scratch.chains);
    for (const std::uint32_t f : crossed) {
        if (!is_pending(scratch, f)) continue;
        clear_pending(scratch, f);
        scratch.points.clear();
        if (walk(mesh, z, limit, f, kUpEdge, scratch, scratch.points)) {
            add_loop(scratch.points, scratch.loops);
            continue;
        }
        // The walk fell off an open edge: the same chain may also reach back from where it began.
        scratch.backward.clear();
        walk(mesh, z, limit, f, kDownEdge, scratch, scratch.backward);
        std::reverse(scratch.backward.begin(), scratch.backward.end());
        scratch.backward.insert(scratch.backward.end(), scratch.points.begin(), scratch.points.end());
        drop_repeats(scratch.backward);
        scratch.chains.points.insert(scratch.chains.points.end(), scratch.backward.begin(),
                                     scratch.backward.end());
        scratch.chains.close_loop();
    }
    if (options.close_gap_mm > 0 && !scratch.chains.empty()) {
        section.closed_gaps = join_chains(scratch.chains, options.close_gap_mm, scratch.loops,
                                          section.open_chains, scratch.points);
    } else {
        for (std::size_t c = 0; c < scratch.chains.size(); ++c) {
            const auto chain = scratch.chains.loop(c);
            if (chain.size() < 2) continue;
            section.open_chains.points.insert(section.open_chains.points.end(), chain.begin(), chain.end());
            section.open_chains.close_loop();
        }
    }
    // Where facets meet others, or bodies overlap or are inside out, loops cross, or wind around the solid
    // otherwise than once; elsewhere they are the outline already.
    const bool plain = mesh.roles.empty() ||
                       std::all_of(crossed.begin(), crossed.end(),
                                   [&](std::uint32_t f) { return mesh.roles[f] == FacetRole::surface; });
    if (!plain) {
        section.loops = simplify(scratch.loops);
        return;
    }
    section.loops = taken(scratch.loops);
    nest(section.loops);
}

void check(MeshView mesh, std::span<const Plane> planes, const SliceOptions& options) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
        if (std::isfinite(planes[i].z)) continue;
        throw Error(ErrorKind::usage, "slice.plane", "a plane's height is not a finite number",
                    "plane " + std::to_string(i));
    }
    if (!std::isfinite(options.close_gap_mm) || options.close_gap_mm < 0) {
        throw Error(ErrorKind::usage, "slice.gap", "the gap to close must be 0 mm or more");
    }
    if (mesh.neighbours.size() != mesh.facets.size()) {
        throw Error(ErrorKind::input, "slice.adjacency", "the mesh has no adjacency", {}, "weld it first");
    }
    if (mesh.facets.size() >= kNoFacet)
        throw Error(ErrorKind::input, "slice.facets", "the mesh has more than 4294967294 facets");
}

// Many planes through one mesh.
class Slicer {
public:
    Slicer(Context& context, MeshView mesh, std::span<const Plane> planes, const SliceOptions& options)
        : context_(context),
          mesh_(mesh),
          options_(options),
          facets_(mesh.facets.size()),
          vertices_(mesh.vertices.size()),
          order_(ascending(planes)),
          grain_(std::max(kFacetGrain, (facets_ + kMaxChunks - 1) / kMaxChunks / 64 * 64 + 64)),
          chunks_((facets_ + grain_ - 1) / grain_),
          chunk_runs_(chunks_ + 1, 0) {
        limits_.resize(planes.size());
        for (std::size_t p = 0; p < order_.size(); ++p) limits_[p] = threshold(planes[order_[p]]);
    }

    void run(std::vector<Section>& sections) {
        const MemoryCharge ranks_charge(context_, vertices_ * sizeof(std::uint32_t) + facets_ / 8, "slicing");
        rank_vertices();
        const std::uint64_t crossings = find_crossed();
        const std::uint64_t listed =
            std::min<std::uint64_t>(std::max<std::uint64_t>(kBatchCrossings, chunk_runs_.back()), crossings);
        const MemoryCharge charge(context_, chunk_runs_.back() * sizeof(Run) + listed * sizeof(std::uint32_t),
                                  "slicing");
        list_runs();
        for (std::size_t window = 0; window < order_.size(); window += kBatchPlanes)
            cut_window(window, std::min(kBatchPlanes, order_.size() - window), sections);
    }

private:
    static std::vector<std::uint32_t> ascending(std::span<const Plane> planes) {
        std::vector<std::uint32_t> order(planes.size());
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            if (planes[a].z != planes[b].z) return planes[a].z < planes[b].z;
            return planes[a].side != planes[b].side ? planes[a].side < planes[b].side : a < b;
        });
        return order;
    }

    // A vertex is above the first rank_[v] planes of the order, and below the others.
    void rank_vertices() {
        const Ranking ranking(limits_);
        rank_.resize(vertices_);
        parallel_for(context_, vertices_, kVertexGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t v = begin; v < end; ++v) {
                const Vec3f& p = mesh_.vertices[v];
                if (!(std::abs(p.x) <= kReach && std::abs(p.y) <= kReach && std::isfinite(p.z))) {
                    throw Error(ErrorKind::input, "slice.range",
                                "a vertex is not finite, or reaches past 214 m from the origin",
                                "vertex " + std::to_string(v), "check the units of the model");
                }
                rank_[v] = ranking(p.z);
            }
        });
    }
    [[nodiscard]] Run run_of(std::size_t f) const {
        const Index3& facet = mesh_.facets[f];
        const auto [low, high] = std::minmax({rank_[facet[0]], rank_[facet[1]], rank_[facet[2]]});
        return {static_cast<std::uint32_t>(f), low, high};
    }

    // Which facets are crossed, a bit for each. @returns how often by all planes together
    std::uint64_t find_crossed() {
        is_crossed_.assign((facets_ + 63) / 64, 0);
        std::vector<std::uint64_t> chunk_crossings(chunks_, 0);
        parallel_for(context_, facets_, grain_, [&](std::size_t begin, std::size_t end) {
            std::uint64_t crossings = 0;
            std::size_t count = 0;
            for (std::size_t f = begin; f < end; ++f) {
                const Index3& facet = mesh_.facets[f];
                if (facet[0] >= vertices_ || facet[1] >= vertices_ || facet[2] >= vertices_) {
                    throw Error(ErrorKind::input, "slice.index", "a facet names a vertex that does not exist",
                                "facet " + std::to_string(f));
                }
                const Run run = run_of(f);
                crossings += run.last - run.first;
                count += run.first != run.last;
                is_crossed_[f >> 6] |= std::uint64_t{run.first != run.last} << (f & 63);
            }
            chunk_crossings[begin / grain_] = crossings;
            chunk_runs_[begin / grain_ + 1] = count;
        });
        std::partial_sum(chunk_runs_.begin(), chunk_runs_.end(), chunk_runs_.begin());
        return std::accumulate(chunk_crossings.begin(), chunk_crossings.end(), std::uint64_t{0});
    }

    // The crossed facets with their planes; ranks are not needed after that.
    void list_runs() {
        runs_ = BulkVector<Run>(chunk_runs_.back());
        parallel_for(context_, chunks_, 1, [&](std::size_t chunk, std::size_t) {
            std::size_t at = chunk_runs_[chunk];
            for (std::size_t word = chunk * grain_ / 64;
                 word < std::min(is_crossed_.size(), (chunk + 1) * grain_ / 64); ++word)
                for (std::uint64_t bits = is_crossed_[word]; bits != 0; bits &= bits - 1)
                    runs_[at++] = run_of(64 * word + static_cast<std::size_t>(std::countr_zero(bits)));
        });
        rank_ = {};
    }

    static std::pair<std::size_t, std::size_t> clip(const Run& run, std::size_t first, std::size_t last) {
        return {std::max<std::size_t>(run.first, first), std::min<std::size_t>(run.last, last)};
    }

    // Some planes, in batches of as many as have room in the list of crossings.
    void cut_window(std::size_t window, std::size_t planes, std::vector<Section>& sections) {
        // slots[chunk * stride + p]: first how many facets of the chunk plane window + p crosses, then where
        // they go.
        const std::size_t stride = planes + 1;
        std::vector<std::uint64_t> slots(chunks_ * stride, 0);
        parallel_for(context_, chunks_, 1, [&](std::size_t chunk, std::size_t) {
            std::uint64_t* count = slots.data() + chunk * stride;
            for (std::size_t i = chunk_runs_[chunk]; i < chunk_runs_[chunk + 1]; ++i) {
                const auto [first, last] = clip(runs_[i], window, window + planes);
                if (first >= last) continue;
                ++count[first - window];
                --count[last - window];  // wraps below zero, and back when summed
            }
            for (std::size_t p = 1; p < stride; ++p) count[p] += count[p - 1];
        });
        std::vector<std::uint64_t> totals(planes, 0);
        for (std::size_t c = 0; c < chunks_; ++c)
            for (std::size_t p = 0; p < planes; ++p) totals[p] += slots[c * stride + p];
        for (std::size_t first = 0, last = 0; first < planes; first = last) {
            std::uint64_t room = 0;
            while (last < planes && (last == first || room + totals[last] <= kBatchCrossings))
                room += totals[last++];
            std::vector<std::uint64_t> starts(last - first + 1, 0);
            for (std::size_t p = first; p < last; ++p) {
                starts[p - first + 1] = starts[p - first] + totals[p];
                std::uint64_t at = starts[p - first];
                for (std::size_t c = 0; c < chunks_; ++c) at += std::exchange(slots[c * stride + p], at);
            }
            crossed_.resize(room);
            parallel_for(context_, chunks_, 1, [&](std::size_t chunk, std::size_t) {
                std::uint64_t* slot = slots.data() + chunk * stride;
                for (std::size_t r = chunk_runs_[chunk]; r < chunk_runs_[chunk + 1]; ++r) {
                    const auto [low, high] = clip(runs_[r], window + first, window + last);
                    for (std::size_t p = low; p < high; ++p) crossed_[slot[p - window]++] = runs_[r].facet;
                }
            });
            cut_planes(window + first, starts, sections);
        }
    }
    // @param starts of the crossings of the planes from `first` on
    void cut_planes(std::size_t first, std::span<const std::uint64_t> starts,
                    std::vector<Section>& sections) {
        const auto clean = [this] {
            auto scratch = std::make_unique<Scratch>();
            scratch->pending.assign((facets_ + 63) / 64, 0);
            return scratch;
        };
        parallel_for(context_, starts.size() - 1, kPlaneGrain, [&](std::size_t begin, std::size_t end) {
            auto scratch = pool_.take(clean);
            for (std::size_t i = begin; i < end; ++i) {
                context_.throw_if_cancelled();
                cut(mesh_, limits_[first + i],
                    std::span<const std::uint32_t>(crossed_).subspan(starts[i], starts[i + 1] - starts[i]),
                    options_, *scratch, sections[order_[first + i]]);
            }
            pool_.give(std::move(scratch));
        });
    }

    Context& context_;
    const MeshView mesh_;
    const SliceOptions& options_;
    const std::size_t facets_, vertices_;
    const std::vector<std::uint32_t> order_;  // of the planes, ascending
    std::vector<float> limits_;               // in that order
    BulkVector<std::uint32_t> rank_;
    const std::size_t grain_, chunks_;  // of facets
    std::vector<std::uint64_t> is_crossed_;
    std::vector<std::size_t> chunk_runs_;
    BulkVector<Run> runs_;
    BulkVector<std::uint32_t> crossed_;
    ScratchPool<Scratch> pool_;  // clean ones
};

}  // namespace

std::vector<Section> slice(Context& context, MeshView mesh, std::span<const Plane> planes,
                           const SliceOptions& options) {
    check(mesh, planes, options);
    std::vector<Section> sections(planes.size());
    for (std::size_t i = 0; i < planes.size(); ++i) sections[i].plane = planes[i];
    if (!planes.empty() && !mesh.facets.empty()) Slicer(context, mesh, planes, options).run(sections);
    return sections;
}

}  // namespace slabwright
