#include "kernels/mesh/simplify_block.h"

#include <algorithm>
#include <bit>
#include <cmath>

#pragma GCC diagnostic ignored "-Wpsabi"

namespace slabwright::simplifying {

namespace {

constexpr double kLeastFacing =
    0.2;  // cosine between the mean normal and any facet's: below, the gap along it says too much
constexpr double kSameFacing = 0.99985;  // cosine of one degree
constexpr double kLeastHeight = 0.05;    // mm: of a new facet, unless one was flatter before
constexpr double kNearlyLevel = 0.866;   // cosine of 30°
constexpr double kBesidePlane = 5;       // tolerances
constexpr double kRounding = 1e-9;       // mm
constexpr std::size_t kSparse =
    8;  // of a block's facets: words of 64 vertices from which on sorting numbers them sooner
constexpr double kLeastRound = 0.002;  // of a block's facets; a round in which fewer vertices go is the last

}  // namespace

std::span<const Face> SimplifyBlock::simplified(const Task& task) {
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

void SimplifyBlock::number_vertices() {
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
                v = static_cast<std::uint32_t>(std::lower_bound(ids_.begin(), ids_.end(), v) - ids_.begin());
        return;
    }
    used_.assign(words, 0);
    before_.resize(words);
    for (const Face& f : faces_)
        for (const std::uint32_t v : f.v) used_[(v - lowest) / 64] |= std::uint64_t{1} << (v - lowest) % 64;
    for (std::size_t w = 0; w < words; ++w) {
        before_[w] = static_cast<std::uint32_t>(ids_.size());
        for (std::uint64_t bits = used_[w]; bits != 0; bits &= bits - 1)
            ids_.push_back(lowest + static_cast<std::uint32_t>(64 * w) +
                           static_cast<std::uint32_t>(std::countr_zero(bits)));
    }
    for (Face& f : faces_)
        for (std::uint32_t& v : f.v) {
            const std::uint32_t i = v - lowest;
            v = before_[i / 64] +
                static_cast<std::uint32_t>(std::popcount(used_[i / 64] & ((std::uint64_t{1} << i % 64) - 1)));
        }
}

void SimplifyBlock::find_around() {
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

bool SimplifyBlock::gather(std::uint32_t v) {
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

bool SimplifyBlock::remove(std::uint32_t v) {
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

bool SimplifyBlock::crosses_nearly_level(std::uint32_t v) const {
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

bool SimplifyBlock::look(std::uint32_t v) {
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

void SimplifyBlock::look_at_old_facets() {
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

bool SimplifyBlock::joined(std::uint32_t a, std::uint32_t b) const {
    if (!known(a)) std::swap(a, b);
    if (!known(a)) return true;
    for (std::uint32_t i = starts_[a]; i < starts_[a + 1]; ++i) {
        const Index3& f = faces_[around_[i] / 4].v;
        if (f[0] == b || f[1] == b || f[2] == b) return true;
    }
    return false;
}

bool SimplifyBlock::fits(std::uint32_t v, double gap) {
    new_low_ = std::min(new_low_, gap);
    new_high_ = std::max(new_high_, gap);
    if (exactly_) return std::max(new_high_, -new_low_) <= kRounding && low_ == 0 && high_ == 0;
    const double asks = std::max(-(new_low_ + low_), new_high_ + high_);
    if (asks <= allowed_) return true;
    need_[v] = std::min(need_[v], asks);
    return false;
}

bool SimplifyBlock::gap_allows(std::uint32_t v, std::size_t start) {
    const std::size_t n = count();
    const Place a = flat_.get(start);
    const Places fours_a{Doubles4{} + a.x, Doubles4{} + a.y, Doubles4{} + a.z};
    auto from_a = [&](std::size_t i) { return flat_.at(start + i) - fours_a; };
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
        if (!fits(v, -(a.z + s * (flat_.z[start + i] - a.z) + t * (flat_.z[start + i + 1] - a.z))))
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
        const std::size_t first = in_one && i > holds_v ? i + 1 : 1, last = in_one && i <= holds_v ? i : n;
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
                if (!fits(v, gap[std::countr_zero(crossing)])) return false;
        }
    }
    return true;
}

bool SimplifyBlock::shapes_well(std::size_t start) {
    const std::size_t n = count();
    const Place a = flat_.get(start);
    const Places fours_a{Doubles4{} + a.x, Doubles4{} + a.y, Doubles4{} + a.z};
    auto from_a = [&](std::size_t i) { return flat_.at(start + i) - fours_a; };
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
    return true;
}

bool SimplifyBlock::may_go_to(std::uint32_t v, int k) {
    new_low_ = new_high_ = 0;
    const auto start = static_cast<std::size_t>(k);
    if (!gap_allows(v, start) || !shapes_well(start)) return false;
    // None of the new edges may exist already: the surface would be pinched there.
    const std::uint32_t target = ring_[at(k, 0)];
    bool pinched = n_ == 3 && joined_across(target, ring_[at(k, 1)], ring_[at(k, 2)]);
    for (int i = 2; i + 1 < n_ && !pinched; ++i) pinched = joined(target, ring_[at(k, i)]);
    if (pinched) {
        need_[v] = 0;  // what is known of the vertices around changes from round to round
        return false;
    }
    return true;
}

std::size_t SimplifyBlock::at(int k, int i) const {
    return static_cast<std::size_t>(k + i < n_ ? k + i : k + i - n_);
}

bool SimplifyBlock::joined_across(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
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

void SimplifyBlock::go_to(std::uint32_t v, int k) {
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

}  // namespace slabwright::simplifying
