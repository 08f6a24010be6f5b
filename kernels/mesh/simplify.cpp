#include "kernels/mesh/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

using Place = std::array<double, 3>;

constexpr std::size_t kBlockFacets = 1 << 15;  // that a block has on the average
constexpr int kMostAround = 16;                // a vertex with more facets around it stays
constexpr double kLeastFacing = 0.2;           // cosine between the mean normal and any facet's: below, the gap along it says too much
constexpr double kSameFacing = 0.99985;        // cosine of one degree
constexpr double kLeastHeight = 0.05;          // mm: of a new facet, unless one was flatter before
constexpr double kNearlyLevel = 0.866;         // cosine of 30°
constexpr double kBesidePlane = 5;             // tolerances
constexpr double kRounding = 1e-9;             // mm
constexpr double kLeastRound = 0.002;          // of a block's facets; a round in which fewer vertices go is the last

Place minus(const Place& a, const Place& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Place cross(const Place& a, const Place& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
double dot(const Place& a, const Place& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// A facet and between which distances from it, counted outward, the surface lies that it stands for, mm.
struct Face {
    Index3 v;
    float low = 0, high = 0;
};

/// The facets of one block, with vertices of its own numbering.
class Block {
public:
    Block(MeshView mesh, std::span<const Face> faces, double tolerance, std::span<const double> planes) : tolerance_(tolerance), planes_(planes) {
        ids_.reserve(3 * faces.size());
        for (const Face& f : faces) ids_.insert(ids_.end(), f.v.begin(), f.v.end());
        std::sort(ids_.begin(), ids_.end());
        ids_.erase(std::unique(ids_.begin(), ids_.end()), ids_.end());
        faces_.assign(faces.begin(), faces.end());
        for (Face& f : faces_)
            for (std::uint32_t& v : f.v) v = static_cast<std::uint32_t>(std::lower_bound(ids_.begin(), ids_.end(), v) - ids_.begin());
        place_.reserve(ids_.size());
        for (const std::uint32_t id : ids_) place_.push_back({mesh.vertices[id].x, mesh.vertices[id].y, mesh.vertices[id].z});
    }

    std::vector<Face> simplified() {
        find_around();
        // Whether all facets around a vertex are in this block, as far as an open fan tells.
        inner_.assign(ids_.size(), 0);
        for (std::uint32_t v = 0; v < ids_.size(); ++v) inner_[v] = gather(v);
        // What costs little goes first: rounding in a plane adds up less then.
        for (const double share : {0.25, 0.5, 1.0}) {
            allowed_ = share * tolerance_;
            awake_.assign(ids_.size(), 1);
            for (std::size_t gone = faces_.size(); static_cast<double>(gone) > kLeastRound * static_cast<double>(faces_.size());) {
                gone = 0;
                touched_.assign(ids_.size(), 0);
                for (std::uint32_t v = 0; v < ids_.size(); ++v) gone += inner_[v] && awake_[v] && !touched_[v] && remove(v);
                std::erase_if(faces_, [](const Face& f) { return f.v[0] == f.v[1]; });
                find_around();
            }
        }
        for (Face& f : faces_)
            for (std::uint32_t& v : f.v) v = ids_[v];
        return std::move(faces_);
    }

private:
    void find_around() {
        starts_.assign(ids_.size() + 1, 0);
        for (const Face& f : faces_)
            for (const std::uint32_t v : f.v) ++starts_[v + 1];
        for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
        around_.resize(starts_.back());
        next_.assign(starts_.begin(), starts_.end() - 1);
        for (std::size_t f = 0; f < faces_.size(); ++f)
            for (const std::uint32_t v : faces_[f].v) around_[next_[v]++] = static_cast<std::uint32_t>(f);
    }

    // The facets around v and the vertices around it, counter-clockwise: facet i is (v, ring_[i], ring_[i + 1]). False where they are not one closed fan.
    bool gather(std::uint32_t v) {
        const auto n = static_cast<int>(starts_[v + 1] - starts_[v]);
        if (n < 3 || n > kMostAround) return false;
        std::array<std::uint32_t, kMostAround> from{}, to{};
        for (int i = 0; i < n; ++i) {
            const Index3& f = faces_[around_[starts_[v] + static_cast<std::uint32_t>(i)]].v;
            if (f[0] == f[1] || f[1] == f[2] || f[2] == f[0]) return false;
            const std::size_t k = f[0] == v ? 0 : f[1] == v ? 1 : 2;
            from[static_cast<std::size_t>(i)] = f[(k + 1) % 3];
            to[static_cast<std::size_t>(i)] = f[(k + 2) % 3];
        }
        n_ = n;
        std::uint32_t at = from[0];
        for (int i = 0; i < n; ++i) {
            int found = -1;
            for (int j = 0; j < n; ++j)
                if (from[static_cast<std::size_t>(j)] == at) {
                    if (found >= 0) return false;
                    found = j;
                }
            if (found < 0 || (found == 0 && i > 0)) return false;
            ring_[static_cast<std::size_t>(i)] = at;
            fan_[static_cast<std::size_t>(i)] = around_[starts_[v] + static_cast<std::uint32_t>(found)];
            at = to[static_cast<std::size_t>(found)];
        }
        return at == from[0];
    }

    // Takes a vertex away where one of its edges allows it.
    bool remove(std::uint32_t v) {
        awake_[v] = 0;
        if (!gather(v) || !look(v)) return false;
        // Of the neighbours that it may go to the one that leaves the least flat facets.
        int best = -1;
        double best_height = 0, low = 0, high = 0;
        for (int k = 0; k < n_; ++k)
            if (may_go_to(k) && new_height_ > best_height) best = k, best_height = new_height_, low = new_low_, high = new_high_;
        if (best < 0) return false;
        new_low_ = low, new_high_ = high;
        go_to(v, best);
        return true;
    }

    // Whether the fan has a facet of less than 30° from level, and reaches as near to one of the planes as it may move.
    [[nodiscard]] bool crosses_nearly_level(std::uint32_t v) const {
        if (planes_.empty()) return false;
        double low = place_[v][2], high = low, most = 0;
        for (int i = 0; i < n_; ++i) {
            const auto a = static_cast<std::size_t>(i);
            low = std::min(low, place_[ring_[a]][2]), high = std::max(high, place_[ring_[a]][2]);
            most = std::max(most, std::abs(facing_[a][2]));
        }
        if (most < kNearlyLevel) return false;
        const double beside = kBesidePlane * tolerance_;
        const auto plane = std::lower_bound(planes_.begin(), planes_.end(), low - beside);
        return plane != planes_.end() && *plane <= high + beside;
    }

    // The vertices around v as (u, v, w) from v, w along the facets' mean normal.
    bool look(std::uint32_t v) {
        Place sum{0, 0, 0};
        std::array<Place, kMostAround> arm;
        low_ = high_ = 0;
        least_height_ = kLeastHeight;
        for (int i = 0; i < n_; ++i) arm[static_cast<std::size_t>(i)] = minus(place_[ring_[static_cast<std::size_t>(i)]], place_[v]);
        for (int i = 0; i < n_; ++i) {
            const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>((i + 1) % n_);
            const Place n = cross(arm[a], arm[b]);
            const double area2 = std::sqrt(dot(n, n));
            if (area2 == 0) return false;
            for (std::size_t k = 0; k < 3; ++k) sum[k] += n[k];
            facing_[a] = {n[0] / area2, n[1] / area2, n[2] / area2};
            const Place third = minus(arm[b], arm[a]);
            const double longest = std::sqrt(std::max({dot(arm[a], arm[a]), dot(arm[b], arm[b]), dot(third, third)}));
            least_height_ = std::min(least_height_, area2 / longest);
            low_ = std::min(low_, faces_[fan_[a]].low);
            high_ = std::max(high_, faces_[fan_[a]].high);
        }
        const double length = std::sqrt(dot(sum, sum));
        if (length == 0) return false;
        const Place w{sum[0] / length, sum[1] / length, sum[2] / length};
        for (int i = 0; i < n_; ++i)
            if (dot(facing_[static_cast<std::size_t>(i)], w) < kLeastFacing) return false;
        exactly_ = crosses_nearly_level(v);
        const Place side = std::abs(w[0]) < 0.6 ? Place{1, 0, 0} : Place{0, 1, 0};
        Place u = cross(side, w);
        const double ul = std::sqrt(dot(u, u));
        for (double& x : u) x /= ul;
        const Place t = cross(w, u);
        for (int i = 0; i < n_; ++i) {
            const auto a = static_cast<std::size_t>(i);
            flat_[a] = {dot(arm[a], u), dot(arm[a], t), dot(arm[a], w)};
        }
        for (int i = 0; i < n_; ++i) {
            const auto a = static_cast<std::size_t>(i);
            flat_normal_[a] = cross(flat_[a], flat_[static_cast<std::size_t>((i + 1) % n_)]);
            same_facing_[a] = kSameFacing * std::sqrt(dot(flat_normal_[a], flat_normal_[a]));
        }
        return true;
    }

    static double turn(const Place& a, const Place& b) { return a[0] * b[1] - a[1] * b[0]; }  // of the plan views

    // Whether all facets around a vertex are known: in this block, and as they were when the round began.
    [[nodiscard]] bool known(std::uint32_t v) const { return inner_[v] && !touched_[v]; }

    // Whether the edge (a, b) exists, as a facet of the one of them that is known tells; true where neither is.
    [[nodiscard]] bool joined(std::uint32_t a, std::uint32_t b) const {
        if (!known(a)) std::swap(a, b);
        if (!known(a)) return true;
        for (std::uint32_t i = starts_[a]; i < starts_[a + 1]; ++i) {
            const Index3& f = faces_[around_[i]].v;
            if (f[0] == b || f[1] == b || f[2] == b) return true;
        }
        return false;
    }

    // Whether v may be drawn into the vertex k of its ring.
    bool may_go_to(int k) {
        auto at = [&](int i) { return static_cast<std::size_t>((k + i) % n_); };
        const Place& a = flat_[at(0)];
        // How far what was there stands over what follows.
        double low = 0, high = 0;
        auto fits = [&](double gap) {
            low = std::min(low, gap);
            high = std::max(high, gap);
            if (exactly_) return std::max(high, -low) <= kRounding && low_ == 0 && high_ == 0;
            return low + low_ >= -allowed_ && high + high_ <= allowed_;
        };
        // The new facets: upright, and the gap at v itself.
        for (int i = 1; i + 1 < n_; ++i) {
            const Place p = minus(flat_[at(i)], a), q = minus(flat_[at(i + 1)], a);
            const double area2 = turn(p, q);
            if (!(area2 > 0)) return false;
            const double of_q = -turn(a, q), of_p = -turn(p, a);  // v = 0 is a + s·p + t·q, s = of_q / area2, t = of_p / area2
            if (of_p >= 0 && of_q >= 0) {
                const double s = of_q / area2, t = of_p / area2;
                if (!fits(-(a[2] + s * p[2] + t * q[2]))) return false;
            }
        }
        // Where the new edges cross those that meet in v.
        for (int i = 2; i + 1 < n_; ++i) {
            const Place d = minus(flat_[at(i)], a);
            for (int j = 1; j < n_; ++j) {
                if (j == i) continue;
                const Place& r = flat_[at(j)];
                // a + s·d = t·r
                const double det = turn(r, d);
                if (det == 0) continue;
                const double t = turn(a, d) / det, s = turn(a, r) / det;
                if (t <= 0 || t >= 1 || s <= 0 || s >= 1) continue;
                if (!fits(t * r[2] - (a[2] + s * d[2]))) return false;
            }
        }
        new_height_ = std::numeric_limits<double>::infinity();
        for (int i = 1; i + 1 < n_; ++i) {
            const Place p = minus(flat_[at(i)], a), q = minus(flat_[at(i + 1)], a), third = minus(q, p), n = cross(p, q);
            const double area2 = std::sqrt(dot(n, n)), longest = std::sqrt(std::max({dot(p, p), dot(q, q), dot(third, third)}));
            new_height_ = std::min(new_height_, area2 / longest);
            if (new_height_ < least_height_ * (1 - 1e-9)) return false;
            new_facing_[static_cast<std::size_t>(i)] = {n[0] / area2, n[1] / area2, n[2] / area2};
        }
        for (int i = 1; i + 1 < n_; ++i) {
            bool found = false;
            for (std::size_t j = 0; j < static_cast<std::size_t>(n_) && !found; ++j)
                found = dot(flat_normal_[j], new_facing_[static_cast<std::size_t>(i)]) >= same_facing_[j];
            if (!found) return false;
        }
        // None of the new edges may exist already: the surface would be pinched there.
        const std::uint32_t target = ring_[at(0)];
        for (int i = 2; i + 1 < n_; ++i)
            if (joined(target, ring_[at(i)])) return false;
        if (n_ == 3 && joined_across(target, ring_[at(1)], ring_[at(2)])) return false;
        new_low_ = low;
        new_high_ = high;
        return true;
    }

    // With three facets around, the one that follows may be there already, turned over: a tetrahedron must stay one.
    [[nodiscard]] bool joined_across(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        for (const std::uint32_t v : {a, b, c})
            if (known(v)) {
                for (std::uint32_t i = starts_[v]; i < starts_[v + 1]; ++i) {
                    const Index3& f = faces_[around_[i]].v;
                    int of = 0;
                    for (const std::uint32_t w : f) of += w == a || w == b || w == c;
                    if (of == 3) return true;
                }
                return false;
            }
        return true;
    }

    void go_to(std::uint32_t v, int k) {
        auto at = [&](int i) { return static_cast<std::size_t>((k + i) % n_); };
        const std::uint32_t target = ring_[at(0)];
        // Outward to the next float: the sum must stay a bound.
        constexpr float inf = std::numeric_limits<float>::infinity();
        const float low = new_low_ < 0 ? std::nextafter(static_cast<float>(low_ + new_low_), -inf) : low_,
                    high = new_high_ > 0 ? std::nextafter(static_cast<float>(high_ + new_high_), inf) : high_;
        for (int i = 0; i < n_; ++i) {
            Face& f = faces_[fan_[at(i)]];
            if (i == 0 || i == n_ - 1) {
                f.v = {v, v, v};
                continue;
            }
            f = {{target, ring_[at(i)], ring_[at(i + 1)]}, low, high};
        }
        for (int i = 0; i < n_; ++i) touched_[ring_[at(i)]] = awake_[ring_[at(i)]] = 1;
        touched_[v] = 1;
    }

    double tolerance_, allowed_ = 0;
    std::span<const double> planes_;  // ascending
    std::vector<std::uint32_t> ids_;  // of the mesh, ascending
    std::vector<Place> place_;
    std::vector<Face> faces_;
    std::vector<std::uint32_t> starts_, around_, next_;
    std::vector<char> inner_, awake_, touched_;
    // Around the vertex in work.
    int n_ = 0;
    std::array<std::uint32_t, kMostAround> ring_{}, fan_{};
    std::array<Place, kMostAround> flat_{}, flat_normal_{}, facing_{}, new_facing_{};  // facing_ as the pattern stands, the others as flat_
    std::array<double, kMostAround> same_facing_{};                                    // what a normal along flat_normal_ makes with it at least
    bool exactly_ = false;                                                             // nothing may move
    float low_ = 0, high_ = 0;                                                         // of the facets around it
    double new_low_ = 0, new_high_ = 0;                                                // that going to the last neighbour looked at adds
    double least_height_ = 0, new_height_ = 0;
};

// The faces by cells of a grid whose origin is `shift` of a cell lower, so that other places lie at its borders each time.
std::vector<Face> pass(Context& context, MeshView mesh, const std::vector<Face>& faces, double tolerance, std::span<const double> planes,
                       double shift) {
    const Box3 box = bounds(mesh);
    const std::array<double, 3> low{box.min.x, box.min.y, box.min.z},
        size{double{box.max.x} - low[0], double{box.max.y} - low[1], double{box.max.z} - low[2]};
    // A surface meets about the square of cells to a side.
    const double cells = std::max(1.0, std::sqrt(static_cast<double>(faces.size()) / kBlockFacets));
    const double cell = std::max({size[0], size[1], size[2], 1e-6}) / cells;
    std::array<std::uint32_t, 3> count{};
    for (std::size_t k = 0; k < 3; ++k) count[k] = static_cast<std::uint32_t>(size[k] / cell + shift) + 1;
    const std::size_t blocks = std::size_t{count[0]} * count[1] * count[2];
    auto block_of = [&](const Face& f) {
        const Vec3f& p = mesh.vertices[std::min({f.v[0], f.v[1], f.v[2]})];
        const std::array<double, 3> at{p.x, p.y, p.z};
        std::size_t block = 0;
        for (std::size_t k = 3; k-- > 0;)
            block = block * count[k] + std::min(count[k] - 1, static_cast<std::uint32_t>(std::max(0.0, (at[k] - low[k]) / cell + shift)));
        return block;
    };
    std::vector<std::size_t> starts(blocks + 1, 0);
    std::vector<std::uint32_t> of(faces.size());
    parallel_for(context, faces.size(), std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) of[i] = static_cast<std::uint32_t>(block_of(faces[i]));
    });
    for (const std::uint32_t b : of) ++starts[b + 1];
    for (std::size_t b = 1; b <= blocks; ++b) starts[b] += starts[b - 1];
    std::vector<Face> dealt(faces.size());
    {
        std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
        for (std::size_t i = 0; i < faces.size(); ++i) dealt[next[of[i]]++] = faces[i];
    }
    std::vector<std::vector<Face>> parts(blocks);
    parallel_each(context, blocks, [&](std::size_t b) {
        if (starts[b] == starts[b + 1]) return;
        parts[b] = Block(mesh, std::span(dealt).subspan(starts[b], starts[b + 1] - starts[b]), tolerance, planes).simplified();
    });
    std::vector<Face> all;
    std::size_t total = 0;
    for (const std::vector<Face>& part : parts) total += part.size();
    all.reserve(total);
    for (const std::vector<Face>& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

}  // namespace

Mesh simplify(Context& context, MeshView mesh, double tolerance_mm, std::span<const double> planes) {
    if (!(tolerance_mm > 0) || !std::isfinite(tolerance_mm))
        throw Error(ErrorKind::usage, "simplify.tolerance", "the tolerance of simplifying must be positive", {}, "give a length in mm");
    const MemoryCharge charge(context, 100 * mesh.facets.size(), "the facets that a tolerance needs");
    std::vector<Face> faces(mesh.facets.size());
    for (std::size_t i = 0; i < faces.size(); ++i) faces[i].v = mesh.facets[i];
    std::vector<double> ascending(planes.begin(), planes.end());
    std::sort(ascending.begin(), ascending.end());
    for (const double shift : {0.0, 0.5}) faces = pass(context, mesh, faces, tolerance_mm, ascending, shift);
    Mesh result;
    constexpr std::uint32_t unused = 0xFFFFFFFFu;
    std::vector<std::uint32_t> to(mesh.vertices.size(), unused);
    result.facets.resize(faces.size());
    for (std::size_t i = 0; i < faces.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t& id = to[faces[i].v[k]];
            if (id == unused) {
                id = static_cast<std::uint32_t>(result.vertices.size());
                result.vertices.push_back(mesh.vertices[faces[i].v[k]]);
            }
            result.facets[i][k] = id;
        }
    pair_edges(context, result);
    return result;
}

}  // namespace slabwright
