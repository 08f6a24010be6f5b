#include "kernels/mesh/simplify.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernels/errors.h"
#include "kernels/geometry/wide.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"
#include "kernels/parallel/scratch_pool.h"

namespace slabwright {

namespace {

// What is asked of all around a vertex is asked of four at once. The functions that return such vectors are
// called in this file alone.
#pragma GCC diagnostic ignored "-Wpsabi"
constexpr std::size_t kLanes = 4;

template <class Real>
struct Space {
    Real x{}, y{}, z{};
    friend Space operator-(const Space& a, const Space& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};
using Place = Space<double>;
using Places = Space<Doubles4>;

constexpr std::size_t kBlockFacets = 1 << 15;  // that a block has on the average
constexpr int kMostAround = 16;                // a vertex with more facets around it stays
constexpr double kLeastFacing =
    0.2;  // cosine between the mean normal and any facet's: below, the gap along it says too much
constexpr double kSameFacing = 0.99985;          // cosine of one degree
constexpr double kLeastHeight = 0.05;            // mm: of a new facet, unless one was flatter before
constexpr double kNearlyLevel = 0.866;           // cosine of 30°
constexpr double kBesidePlane = 5;               // tolerances
constexpr double kRounding = 1e-9;               // mm
constexpr std::uint64_t kDealtAtOnce = 1 << 24;  // facets, unless one block has more
constexpr std::size_t kSparse =
    8;  // of a block's facets: words of 64 vertices from which on sorting numbers them sooner
constexpr double kLeastRound = 0.002;  // of a block's facets; a round in which fewer vertices go is the last

template <class A, class B>
auto dot(const Space<A>& a, const Space<B>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class A, class B>
auto turn(const Space<A>& a, const Space<B>& b) {  // of the plan views
    return a.x * b.y - a.y * b.x;
}
template <class Real>
Space<Real> cross(const Space<Real>& a, const Space<Real>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, turn(a, b)};
}

Doubles4 larger(const Doubles4& a, const Doubles4& b) { return a < b ? b : a; }
Doubles4 smaller(const Doubles4& a, const Doubles4& b) { return b < a ? b : a; }
double smallest(const Doubles4& a) { return std::min(std::min(a[0], a[1]), std::min(a[2], a[3])); }
Doubles4 root(const Doubles4& a) {
    return Doubles4{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}
std::uint64_t joined_bits(const Longs4& s) { return static_cast<std::uint64_t>(s[0] | s[1] | s[2] | s[3]); }
constexpr Longs4 kOwn{1, 2, 4, 8};  // bits
unsigned bits(const Longs4& s) { return static_cast<unsigned>(joined_bits(s & kOwn)); }

/// Heights of facets with one corner at the origin over their longest edges.
Doubles4 heights(const Places& p, const Places& q, const Doubles4& square) {
    const Places third = q - p;
    return root(square) / root(larger(larger(dot(p, p), dot(q, q)), dot(third, third)));
}

/// A facet and between which distances from it, counted outward, the surface lies that it stands for, mm.
struct Face {
    Index3 v;
    float low = 0, high = 0;
};

/// Of a vertex that no tolerance lets go.
constexpr double kNever = std::numeric_limits<double>::infinity();

/// A bit for each vertex of a mesh. Set from several threads.
class VertexBits {
public:
    explicit VertexBits(std::size_t vertices) : words_(vertices / 64 + 1, 0) {}
    [[nodiscard]] bool has(std::uint32_t v) const noexcept { return (words_[v >> 6] >> (v & 63) & 1) != 0; }
    void set(std::uint32_t v) noexcept {
        const std::atomic_ref word(words_[v >> 6]);
        const std::uint64_t bit = std::uint64_t{1} << (v & 63);
        if ((word.load(std::memory_order_relaxed) & bit) == 0) word.fetch_or(bit, std::memory_order_relaxed);
    }

private:
    std::vector<std::uint64_t> words_;
};

/// What all blocks of a pass ask.
struct Task {
    Context& context;
    MeshView mesh;
    double tolerance;
    std::span<const double> planes;  ///< ascending
    const VertexBits* settled;       ///< the vertices that are not set here stay unless something around them
                                     ///< changes; none: nothing is known
    VertexBits* unsettled;           ///< where those are set that a block has not settled; none: nobody asks
};

/// The facets of one block, with vertices of its own numbering. Used for one block after another, its memory
/// stays.
class Block {
public:
    /// @param face_of(i) the face number i of the block's n
    template <class FaceOf>
    void load(const Task& task, std::size_t n, FaceOf&& face_of) {
        tolerance_ = task.tolerance;
        planes_ = task.planes;
        faces_.resize(n);
        for (std::size_t i = 0; i < n; ++i) faces_[i] = face_of(i);
        number_vertices();
        place_.resize(ids_.size());
        for (std::size_t v = 0; v < ids_.size(); ++v) {
            const Vec3f& p = task.mesh.vertices[ids_[v]];
            place_[v] = {p.x, p.y, p.z};
        }
        need_.assign(ids_.size(), 0);
        if (task.settled != nullptr)
            for (std::size_t v = 0; v < ids_.size(); ++v)
                if (!task.settled->has(ids_[v])) need_[v] = kNever;
    }

    /// Takes away what the tolerance allows. @return the faces that stay, with the mesh's vertices, until the
    /// next block is loaded
    std::span<const Face> simplified(const Task& task) {
        find_around();
        // Whether all facets around a vertex are in this block, as far as an open fan tells.
        inner_.resize(ids_.size());
        for (std::uint32_t v = 0; v < ids_.size(); ++v) inner_[v] = gather(v);
        awake_.resize(ids_.size());
        // What costs little goes first: rounding in a plane adds up less then.
        for (const double share : {0.5, 1.0}) {
            allowed_ = share * tolerance_;
            for (std::size_t v = 0; v < ids_.size(); ++v) awake_[v] = inner_[v] && need_[v] <= allowed_;
            for (std::size_t gone = faces_.size();
                 static_cast<double>(gone) > kLeastRound * static_cast<double>(faces_.size());) {
                gone = 0;
                touched_.assign(ids_.size(), 0);
                for (std::uint32_t v = 0; v < ids_.size(); ++v) {
                    if (v % 8192 == 0) task.context.throw_if_cancelled();
                    gone += awake_[v] && !touched_[v] && remove(v);
                }
                if (gone == 0) break;
                std::erase_if(faces_, [](const Face& f) { return f.v[0] == f.v[1]; });
                find_around();
            }
        }
        if (task.unsettled != nullptr)
            for (std::size_t v = 0; v < ids_.size(); ++v)
                if (starts_[v] < starts_[v + 1] && !(inner_[v] && need_[v] > tolerance_))
                    task.unsettled->set(ids_[v]);
        for (Face& f : faces_)
            for (std::uint32_t& v : f.v) v = ids_[v];
        return faces_;
    }

private:
    // Ascending by the mesh's numbers. A bit for each number between the lowest and the highest, and how many
    // are before each 64 of them, tell quickly which one a vertex is; where the block's vertices are few
    // among many they are sorted.
    void number_vertices() {
        ids_.clear();
        if (faces_.empty()) return;
        std::uint32_t lowest = faces_[0].v[0], highest = lowest;
        for (const Face& f : faces_)
            for (const std::uint32_t v : f.v) lowest = std::min(lowest, v), highest = std::max(highest, v);
        const std::size_t words = (highest - lowest) / 64 + 1;
        if (words > kSparse * faces_.size()) {
            for (const Face& f : faces_) ids_.insert(ids_.end(), f.v.begin(), f.v.end());
            std::sort(ids_.begin(), ids_.end());
            ids_.erase(std::unique(ids_.begin(), ids_.end()), ids_.end());
            for (Face& f : faces_)
                for (std::uint32_t& v : f.v)
                    v = static_cast<std::uint32_t>(std::lower_bound(ids_.begin(), ids_.end(), v) -
                                                   ids_.begin());
            return;
        }
        used_.assign(words, 0);
        before_.resize(words);
        for (const Face& f : faces_)
            for (const std::uint32_t v : f.v)
                used_[(v - lowest) / 64] |= std::uint64_t{1} << (v - lowest) % 64;
        for (std::size_t w = 0; w < words; ++w) {
            before_[w] = static_cast<std::uint32_t>(ids_.size());
            for (std::uint64_t bits = used_[w]; bits != 0; bits &= bits - 1)
                ids_.push_back(lowest + static_cast<std::uint32_t>(64 * w) +
                               static_cast<std::uint32_t>(std::countr_zero(bits)));
        }
        for (Face& f : faces_)
            for (std::uint32_t& v : f.v) {
                const std::uint32_t i = v - lowest;
                v = before_[i / 64] + static_cast<std::uint32_t>(
                                          std::popcount(used_[i / 64] & ((std::uint64_t{1} << i % 64) - 1)));
            }
    }

    void find_around() {
        // Counted two places on and dealt one place on, the starts are where they belong in the end.
        starts_.assign(ids_.size() + 2, 0);
        for (const Face& f : faces_)
            for (const std::uint32_t v : f.v) ++starts_[v + 2];
        for (std::size_t i = 2; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
        around_.resize(3 * faces_.size());
        for (std::size_t f = 0; f < faces_.size(); ++f)
            for (std::size_t k = 0; k < 3; ++k)
                around_[starts_[faces_[f].v[k] + 1]++] = static_cast<std::uint32_t>(4 * f + k);
    }

    static constexpr std::array<std::uint8_t, 4> kNext{1, 2, 0, 1};  // corners of a facet
    // The facets around v and the vertices around it, counter-clockwise: facet i is (v, ring_[i], ring_[i +
    // 1]). False where they are not one closed fan.
    bool gather(std::uint32_t v) {
        const auto n = static_cast<int>(starts_[v + 1] - starts_[v]);
        if (n < 3 || n > kMostAround) return false;
        std::array<std::uint32_t, kMostAround> from, to, facet;  // written as far as they are read
        for (int i = 0; i < n; ++i) {
            const std::uint32_t corner = around_[starts_[v] + static_cast<std::uint32_t>(i)];
            const Index3& f = faces_[corner / 4].v;
            from[static_cast<std::size_t>(i)] = f[kNext[corner % 4]];
            to[static_cast<std::size_t>(i)] = f[kNext[corner % 4 + 1]];
            facet[static_cast<std::size_t>(i)] = corner / 4;
        }
        // A bit for each facet that begins where this one ends. Two in a fan that visits all are at the same
        // vertex where a facet is degenerate: then there is no such fan.
        std::array<std::uint32_t, kMostAround> follow;
        for (std::size_t half = 0; half < static_cast<std::size_t>(n); half += 8) {
            Words8 ends, bits{};
            std::memcpy(&ends, &to[half], sizeof(ends));
            for (int j = 0; j < n; ++j)
                bits |= static_cast<Words8>(ends == from[static_cast<std::size_t>(j)]) & (1u << j);
            std::memcpy(&follow[half], &bits, sizeof(bits));
        }
        n_ = n;
        std::size_t at = 0;
        for (int i = 0; i < n; ++i) {
            if ((at == 0 && i > 0) || !std::has_single_bit(follow[at])) return false;
            ring_[static_cast<std::size_t>(i)] = from[at];
            fan_[static_cast<std::size_t>(i)] = facet[at];
            at = static_cast<std::size_t>(std::countr_zero(follow[at]));
        }
        return at == 0;
    }

    // Takes a vertex away where one of its edges allows it.
    bool remove(std::uint32_t v) {
        awake_[v] = 0;
        need_[v] = kNever;
        if (!gather(v) || !look(v)) return false;
        // Of the neighbours that it may go to the one that leaves the least flat facets.
        int best = -1;
        double low = 0, high = 0;
        best_height_ = 0;
        for (int k = 0; k < n_; ++k)
            if (may_go_to(v, k)) best = k, best_height_ = new_height_, low = new_low_, high = new_high_;
        if (best < 0) return false;
        new_low_ = low;
        new_high_ = high;
        go_to(v, best);
        return true;
    }

    // Whether the fan has a facet of less than 30° from level, and reaches as near to one of the planes as it
    // may move.
    [[nodiscard]] bool crosses_nearly_level(std::uint32_t v) const {
        if (planes_.empty()) return false;
        double low = place_[v].z, high = low;
        for (std::size_t a = 0; a < count(); ++a)
            low = std::min(low, place_[ring_[a]].z), high = std::max(high, place_[ring_[a]].z);
        const double beside = kBesidePlane * tolerance_;
        const auto plane = std::lower_bound(planes_.begin(), planes_.end(), low - beside);
        if (plane == planes_.end() || *plane > high + beside) return false;
        for (std::size_t a = 0; a < count(); ++a)
            if (normal_.z[a] * normal_.z[a] >= kNearlyLevel * kNearlyLevel * square_[a]) return true;
        return false;
    }

    // The vertices around v as (u, v, w) from v, w along the facets' mean normal. False where nothing lets v
    // go.
    bool look(std::uint32_t v) {
        low_ = high_ = 0;
        for (std::size_t a = 0; a < count(); ++a) {
            arm_.set(a, place_[ring_[a]] - place_[v]);
            low_ = std::min(low_, faces_[fan_[a]].low);
            high_ = std::max(high_, faces_[fan_[a]].high);
        }
        arm_.repeat(count(), count() + kLanes + 1);
        Longs4 no_area{};
        for (std::size_t a = 0; a < count(); a += kLanes) {
            const Places n = cross(arm_.at(a), arm_.at(a + 1));
            const Doubles4 square = dot(n, n);
            normal_.put(a, n);
            put(square_, a, square);
            no_area |= square == 0;
        }
        if (joined_bits(no_area) != 0) return false;
        Place sum;
        for (std::size_t a = 0; a < count(); ++a)
            sum = {sum.x + normal_.x[a], sum.y + normal_.y[a], sum.z + normal_.z[a]};
        const double length = std::sqrt(dot(sum, sum));
        if (length == 0) return false;
        const Place w{sum.x / length, sum.y / length, sum.z / length};
        Longs4 turned{};
        for (std::size_t a = 0; a < count(); a += kLanes) {
            const Doubles4 along = dot(normal_.at(a), w);
            turned |= (along <= 0) | (along * along < kLeastFacing * kLeastFacing * four(square_, a));
        }
        if (joined_bits(turned) != 0) return false;
        exactly_ = crosses_nearly_level(v);
        const Place side = std::abs(w.x) < 0.6 ? Place{1, 0, 0} : Place{0, 1, 0};
        Place u = cross(side, w);
        const double ul = std::sqrt(dot(u, u));
        u = {u.x / ul, u.y / ul, u.z / ul};
        const Place t = cross(w, u);
        for (std::size_t a = 0; a < count(); a += kLanes) {
            const Places arm = arm_.at(a), flat{dot(arm, u), dot(arm, t), dot(arm, w)};
            flat_.put(a, flat);
        }
        flat_.repeat(count(), 2 * count() + kLanes);
        old_facets_known_ = false;
        return true;
    }

    // How flat the facets around are and which way they face: asked only where the gap allows going.
    void look_at_old_facets() {
        if (old_facets_known_) return;
        old_facets_known_ = true;
        Doubles4 least = Doubles4{} + kLeastHeight;
        for (std::size_t a = 0; a < count(); a += kLanes) {
            least = smaller(least, heights(arm_.at(a), arm_.at(a + 1), four(square_, a)));
            const Places n = cross(flat_.at(a), flat_.at(a + 1));
            flat_normal_.put(a, n);
            put(same_facing2_, a, kSameFacing * kSameFacing * dot(n, n));
        }
        least_height_ = smallest(least);
    }

    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(n_); }

    // Whether all facets around a vertex are known: in this block, and as they were when the round began.
    [[nodiscard]] bool known(std::uint32_t v) const { return inner_[v] && !touched_[v]; }

    // Whether the edge (a, b) exists, as a facet of the one of them that is known tells; true where neither
    // is.
    [[nodiscard]] bool joined(std::uint32_t a, std::uint32_t b) const {
        if (!known(a)) std::swap(a, b);
        if (!known(a)) return true;
        for (std::uint32_t i = starts_[a]; i < starts_[a + 1]; ++i) {
            const Index3& f = faces_[around_[i] / 4].v;
            if (f[0] == b || f[1] == b || f[2] == b) return true;
        }
        return false;
    }

    // Whether v may be drawn into the vertex k of its ring, and leaves less flat facets than going to the
    // best one so far. need_[v] becomes no more than what a tolerance must allow so that this may change.
    bool may_go_to(std::uint32_t v, int k) {
        const std::size_t n = count(), start = static_cast<std::size_t>(k);
        const Place a = flat_.get(start);
        const Places fours_a{Doubles4{} + a.x, Doubles4{} + a.y, Doubles4{} + a.z};
        auto from_a = [&](std::size_t i) { return flat_.at(start + i) - fours_a; };
        // How far what was there stands over what follows.
        double low = 0, high = 0;
        auto fits = [&](double gap) {
            low = std::min(low, gap);
            high = std::max(high, gap);
            if (exactly_) return std::max(high, -low) <= kRounding && low_ == 0 && high_ == 0;
            const double asks = std::max(-(low + low_), high + high_);
            if (asks <= allowed_) return true;
            need_[v] = std::min(need_[v], asks);
            return false;
        };
        // On which side of the way to a each vertex lies (bits from 0 on, from 16 on the other), and which
        // new facets are upright (from 32 on).
        Longs4 found{}, own = kOwn;
        for (std::size_t i = 0; i < n; i += kLanes, own <<= kLanes) {
            const Places p = from_a(i), q = from_a(i + 1);
            const Doubles4 side = turn(fours_a, p), area2 = turn(p, q);
            put(side_, i, side);
            put(area2_, i, area2);
            found |= ((side >= 0) & own) | ((side <= 0) & own << 16) | ((area2 > 0) & own << 32);
        }
        const std::uint64_t all = joined_bits(found);
        const unsigned new_facets = (1u << (n - 1)) - 2,
                       holders = static_cast<unsigned>(all & all >> 17) & new_facets;
        // The gap at v itself, which is a + s·p + t·q with s = of_q / area2, t = of_p / area2 in the new
        // facet that it lies in: what most often forbids to go.
        for (unsigned left = holders; left != 0; left &= left - 1) {
            const auto i = static_cast<std::size_t>(std::countr_zero(left));
            const double area2 = area2_[i];
            if (!(area2 > 0)) return false;
            const double s = -side_[i + 1] / area2, t = side_[i] / area2;
            if (!fits(-(a.z + s * (flat_.z[start + i] - a.z) + t * (flat_.z[start + i + 1] - a.z))))
                return false;
        }
        // The new facets are upright.
        if ((~(all >> 32) & new_facets) != 0) return false;
        // Where the new edges cross those that meet in v. A new edge parts the ring: where v lies in one new
        // facet only, just the vertices that are not on its side have edges to it that cross.
        const bool in_one = std::has_single_bit(holders);
        const auto holds_v = static_cast<std::size_t>(std::countr_zero(holders));
        for (std::size_t i = 2; i + 1 < n; ++i) {
            const Place d = flat_.get(start + i) - a;
            const double of_t = side_[i];
            const std::size_t first = in_one && i > holds_v ? i + 1 : 1,
                              last = in_one && i <= holds_v ? i : n;
            for (std::size_t j = first; j < last; j += kLanes) {
                const Places r = flat_.at(start + j);
                // a + s·d = t·r with s and t between 0 and 1
                const Doubles4 det = turn(r, d), of_s = turn(fours_a, r);
                const Doubles4 t = of_t / det, s = of_s / det;
                const Doubles4 gap = t * r.z - (a.z + s * d.z);
                unsigned crossing = bits((of_t * det > 0) & (of_s * det > 0) & (t < 1) & (s < 1));
                crossing &= (1u << std::min(kLanes, last - j)) - 1;
                if (i - j < kLanes) crossing &= ~(1u << (i - j));
                for (; crossing != 0; crossing &= crossing - 1)
                    if (!fits(gap[std::countr_zero(crossing)])) return false;
            }
        }
        look_at_old_facets();
        Doubles4 least = Doubles4{} + kNever;
        std::array<Places, kMostAround / kLanes> normal;
        std::array<Doubles4, kMostAround / kLanes> square;
        for (std::size_t i = 1; i + 1 < n; i += kLanes) {
            const Places p = from_a(i), q = from_a(i + 1);
            normal[i / kLanes] = cross(p, q);
            square[i / kLanes] = dot(normal[i / kLanes], normal[i / kLanes]);
            const Doubles4 height = heights(p, q, square[i / kLanes]);
            const auto beyond = static_cast<std::int64_t>(n - 1 - i);
            least = smaller(least, Longs4{0, 1, 2, 3} < beyond ? height : least);
        }
        new_height_ = smallest(least);
        if (new_height_ < least_height_ * (1 - 1e-9) || new_height_ <= best_height_) return false;
        for (std::size_t i = 1; i + 1 < n; i += kLanes) {
            Longs4 same = Longs4{0, 1, 2, 3} >= static_cast<std::int64_t>(n - 1 - i);
            for (std::size_t j = 0; j < n; ++j) {
                const Doubles4 along = dot(normal[i / kLanes], flat_normal_.get(j));
                same |= (along > 0) & (along * along >= same_facing2_[j] * square[i / kLanes]);
                if (bits(same) == 15) break;
            }
            if (bits(same) != 15) return false;
        }
        // None of the new edges may exist already: the surface would be pinched there.
        const std::uint32_t target = ring_[at(k, 0)];
        bool pinched = n == 3 && joined_across(target, ring_[at(k, 1)], ring_[at(k, 2)]);
        for (int i = 2; i + 1 < n_ && !pinched; ++i) pinched = joined(target, ring_[at(k, i)]);
        if (pinched) {
            need_[v] = 0;  // what is known of the vertices around changes from round to round
            return false;
        }
        new_low_ = low;
        new_high_ = high;
        return true;
    }

    [[nodiscard]] std::size_t at(int k, int i) const {
        return static_cast<std::size_t>(k + i < n_ ? k + i : k + i - n_);
    }

    // With three facets around, the one that follows may be there already, turned over: a tetrahedron must
    // stay one.
    [[nodiscard]] bool joined_across(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        for (const std::uint32_t v : {a, b, c})
            if (known(v)) {
                for (std::uint32_t i = starts_[v]; i < starts_[v + 1]; ++i) {
                    const Index3& f = faces_[around_[i] / 4].v;
                    int of = 0;
                    for (const std::uint32_t w : f) of += w == a || w == b || w == c;
                    if (of == 3) return true;
                }
                return false;
            }
        return true;
    }

    void go_to(std::uint32_t v, int k) {
        const std::uint32_t target = ring_[at(k, 0)];
        // Outward to the next float: the sum must stay a bound.
        constexpr float inf = std::numeric_limits<float>::infinity();
        const float low = new_low_ < 0 ? std::nextafter(static_cast<float>(low_ + new_low_), -inf) : low_,
                    high = new_high_ > 0 ? std::nextafter(static_cast<float>(high_ + new_high_), inf) : high_;
        for (int i = 0; i < n_; ++i) {
            Face& f = faces_[fan_[at(k, i)]];
            if (i == 0 || i == n_ - 1) {
                f.v = {v, v, v};
                continue;
            }
            f = {{target, ring_[at(k, i)], ring_[at(k, i + 1)]}, low, high};
        }
        for (std::size_t i = 0; i < count(); ++i) {
            const std::uint32_t w = ring_[i];
            touched_[w] = 1;
            awake_[w] = inner_[w];
            need_[w] = 0;
        }
        touched_[v] = 1;
        need_[v] = kNever;
    }

    double tolerance_ = 0, allowed_ = 0;
    std::span<const double> planes_;  // ascending
    std::vector<std::uint32_t> ids_;  // of the mesh, ascending
    std::vector<std::uint64_t> used_;
    std::vector<std::uint32_t> before_;
    std::vector<Place> place_;
    std::vector<Face> faces_;
    std::vector<std::uint32_t> starts_, around_;
    std::vector<char> inner_, awake_, touched_;
    std::vector<double>
        need_;  // what the tolerance must be, at least, so that a vertex that is asleep may go
    // Around the vertex in work.
    template <class T, std::size_t times = 1>
    using Around = std::array<T, times * kMostAround + 2 * kLanes>;
    static Doubles4 four(const auto& from, std::size_t i) {
        Doubles4 values;
        std::memcpy(&values, &from[i], sizeof(values));
        return values;
    }
    static void put(auto& to, std::size_t i, const Doubles4& values) {
        std::memcpy(&to[i], &values, sizeof(values));
    }
    // Once and again from the start, so that four in a row may be asked anywhere.
    struct PlacesAround {
        Around<double, 2> x, y, z;
        [[nodiscard]] Place get(std::size_t i) const { return {x[i], y[i], z[i]}; }
        [[nodiscard]] Places at(std::size_t i) const { return {four(x, i), four(y, i), four(z, i)}; }
        void set(std::size_t i, const Place& p) { x[i] = p.x, y[i] = p.y, z[i] = p.z; }
        void put(std::size_t i, const Places& p) {
            Block::put(x, i, p.x), Block::put(y, i, p.y), Block::put(z, i, p.z);
        }
        void repeat(std::size_t n, std::size_t last) {
            for (std::size_t i = n; i < last; ++i) set(i, get(i - n));
        }
    };
    int n_ = 0;
    Around<std::uint32_t> ring_, fan_;
    PlacesAround arm_,
        normal_;  // as the pattern stands: to the vertices around, and of the facets, twice their area long
    PlacesAround flat_;         // the vertices around
    PlacesAround flat_normal_;  // as flat_
    Around<double> square_;     // of the lengths of normal_
    Around<double> side_, area2_;
    Around<double> same_facing2_;  // what a normal along flat_normal_ makes with it at least
    bool exactly_ = false;         // nothing may move
    bool old_facets_known_ = false;
    float low_ = 0, high_ = 0;           // of the facets around it
    double new_low_ = 0, new_high_ = 0;  // that going to the last neighbour looked at adds
    double least_height_ = 0, new_height_ = 0, best_height_ = 0;
};

/// A grid of cubes, in each of which a surface of so many facets has about kBlockFacets.
class Cells {
public:
    /// @param shift of a cell by which the grid's origin lies lower, so that other places lie at its borders
    Cells(const Box3& box, std::size_t facets, double shift)
        : low_{box.min.x, box.min.y, box.min.z}, shift_(shift) {
        const std::array<double, 3> size{double{box.max.x} - low_[0], double{box.max.y} - low_[1],
                                         double{box.max.z} - low_[2]};
        // A surface meets about the square of cells to a side.
        const double cells = std::max(1.0, std::sqrt(static_cast<double>(facets) / kBlockFacets));
        cell_ = std::max({size[0], size[1], size[2], 1e-6}) / cells;
        for (std::size_t k = 0; k < 3; ++k)
            count_[k] = static_cast<std::uint32_t>(size[k] / cell_ + shift) + 1;
    }
    [[nodiscard]] std::size_t count() const { return std::size_t{count_[0]} * count_[1] * count_[2]; }
    /// Of the cell that holds a facet's lowest vertex.
    [[nodiscard]] std::size_t of(MeshView mesh, const Index3& facet) const {
        const Vec3f& p = mesh.vertices[std::min({facet[0], facet[1], facet[2]})];
        const std::array<double, 3> at{p.x, p.y, p.z};
        std::size_t cell = 0;
        for (std::size_t k = 3; k-- > 0;)
            cell = cell * count_[k] + std::min(count_[k] - 1, static_cast<std::uint32_t>(std::max(
                                                                  0.0, (at[k] - low_[k]) / cell_ + shift_)));
        return cell;
    }

private:
    std::array<double, 3> low_;
    double shift_, cell_ = 1;
    std::array<std::uint32_t, 3> count_{};
};

/// Memory for so many elements, of which each block writes only the first of those that are its own: what is
/// not written takes no memory.
template <class T>
struct Sparse {
    struct Part {
        std::size_t begin = 0, end = 0;
    };
    RawArray<T> all;
    std::vector<Part> parts;
    std::unique_ptr<std::optional<MemoryCharge>[]> charges;  ///< one for each part

    Sparse(std::size_t size, std::size_t blocks)
        : all(size), parts(blocks), charges(new std::optional<MemoryCharge>[blocks]) {}
    [[nodiscard]] std::size_t size() const {
        std::size_t sum = 0;
        for (const Part& part : parts) sum += part.end - part.begin;
        return sum;
    }
    void release() { all = {}, charges.reset(); }
};

// The numbers of the n sources' faces are dealt by cells and each cell made simpler, its faces written as
// keep(face) says.
// @param each_face(begin, end, take) calls take(number, facet) for the faces of these sources @param
// face_of(number) a face
template <class T, class EachFace, class FaceOf, class Keep>
Sparse<T> pass(const Task& task, const Cells& cells, std::size_t faces, std::size_t n, std::size_t grain,
               EachFace&& each_face, FaceOf&& face_of, Keep&& keep) {
    Sparse<T> out(faces, cells.count());
    ScratchPool<Block> blocks;
    RawArray<std::uint32_t> numbers;
    std::optional<MemoryCharge> charge;
    std::size_t before = 0;  // faces dealt in earlier rounds
    deal(
        task.context, n, grain, cells.count(),
        [&](std::size_t begin, std::size_t end, auto&& take) {
            each_face(begin, end,
                      [&](std::uint32_t, const Index3& facet) { take(cells.of(task.mesh, facet)); });
        },
        [&](std::size_t begin, std::size_t end, auto&& take) {
            each_face(begin, end, [&](std::uint32_t number, const Index3& facet) {
                take(cells.of(task.mesh, facet), number);
            });
        },
        [&](std::uint64_t total, std::uint64_t largest) {
            const std::uint64_t most = std::min(total, std::max(kDealtAtOnce, 2 * largest));
            charge.emplace(task.context, most * sizeof(std::uint32_t), "the facets that a tolerance needs");
            numbers = RawArray<std::uint32_t>(most);
            return std::pair(numbers.data(), most);
        },
        [&](std::size_t first, std::size_t last, std::span<const std::uint32_t> starts) {
            parallel_each(task.context, last - first, [&](std::size_t b) {
                const std::span<const std::uint32_t> mine(numbers.data() + starts[b],
                                                          starts[b + 1] - starts[b]);
                if (mine.empty()) return;
                auto block = blocks.take([] { return std::make_unique<Block>(); });
                block->load(task, mine.size(), [&](std::size_t i) { return face_of(mine[i]); });
                const std::span<const Face> few = block->simplified(task);
                out.charges[first + b].emplace(task.context, few.size() * sizeof(T),
                                               "the facets that a tolerance needs");
                const std::size_t begin = before + starts[b];
                out.parts[first + b] = {begin, begin + few.size()};
                std::transform(few.begin(), few.end(), out.all.data() + begin, keep);
                blocks.give(std::move(block));
            });
            before += starts.back();
        });
    return out;
}

/// Twice over blocks that do not share borders.
Sparse<Index3> few_facets(Context& context, MeshView mesh, double tolerance, std::span<const double> planes) {
    const Box3 box = bounds(context, mesh);
    VertexBits unsettled(mesh.vertices.size());
    auto of_mesh = [&](std::size_t begin, std::size_t end, auto&& take) {
        for (std::size_t f = begin; f < end; ++f) take(static_cast<std::uint32_t>(f), mesh.facets[f]);
    };
    const Sparse<Face> some = pass<Face>(
        Task{context, mesh, tolerance, planes, nullptr, &unsettled}, Cells(box, mesh.size(), 0), mesh.size(),
        mesh.size(), std::size_t{1} << 16, of_mesh, [&](std::uint32_t f) { return Face{mesh.facets[f]}; },
        [](const Face& face) { return face; });
    auto of_some = [&](std::size_t begin, std::size_t end, auto&& take) {
        for (std::size_t part = begin; part < end; ++part)
            for (std::size_t f = some.parts[part].begin; f < some.parts[part].end; ++f)
                take(static_cast<std::uint32_t>(f), some.all[f].v);
    };
    const std::size_t left = some.size();
    return pass<Index3>(
        Task{context, mesh, tolerance, planes, &unsettled, nullptr}, Cells(box, left, 0.5), left,
        some.parts.size(), 1, of_some, [&](std::uint32_t f) { return some.all[f]; },
        [](const Face& face) { return face.v; });
}

}  // namespace

Mesh simplify(Context& context, MeshView mesh, double tolerance_mm, std::span<const double> planes) {
    if (!(tolerance_mm > 0) || !std::isfinite(tolerance_mm))
        throw Error(ErrorKind::usage, "simplify.tolerance", "the tolerance of simplifying must be positive",
                    {}, "give a length in mm");
    std::vector<double> ascending(planes.begin(), planes.end());
    std::sort(ascending.begin(), ascending.end());
    Mesh result;
    if (mesh.facets.empty()) return result;
    {
        Sparse<Index3> few = few_facets(context, mesh, tolerance_mm, ascending);
        const std::size_t left = few.size();
        const MemoryCharge charge(context,
                                  left * sizeof(Index3) + mesh.vertices.size() * sizeof(std::uint32_t),
                                  "the facets that a tolerance needs");
        // Vertices are numbered as the facets name them.
        constexpr std::uint32_t unused = 0xFFFFFFFFu;
        std::vector<std::uint32_t> to(mesh.vertices.size(), unused);
        result.facets.reserve(left);
        std::uint32_t used = 0;
        for (std::size_t part = 0; part < few.parts.size(); ++part) {
            context.throw_if_cancelled();
            for (std::size_t i = few.parts[part].begin; i < few.parts[part].end; ++i) {
                Index3 facet = few.all[i];
                for (std::uint32_t& v : facet) {
                    if (to[v] == unused) to[v] = used++;
                    v = to[v];
                }
                result.facets.push_back(facet);
            }
        }
        few.release();
        result.vertices.resize(used);
        parallel_for(context, to.size(), std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t v = begin; v < end; ++v)
                if (to[v] != unused) result.vertices[to[v]] = mesh.vertices[v];
        });
    }
    pair_edges(context, result);
    return result;
}

}  // namespace slabwright
