// The facets of one block of space made fewer. Internal to simplify().
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "kernels/mesh/four_places.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace slabwright::simplifying {

inline constexpr int kMostAround = 16;  // a vertex with more facets around it stays

/// A facet and between which distances from it, counted outward, the surface lies that it stands for, mm.
struct Face {
    Index3 v;
    float low = 0, high = 0;
};

/// Of a vertex that no tolerance lets go.
inline constexpr double kNever = std::numeric_limits<double>::infinity();

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
class SimplifyBlock {
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
    std::span<const Face> simplified(const Task& task);

private:
    // Ascending by the mesh's numbers. A bit for each number between the lowest and the highest, and how many
    // are before each 64 of them, tell quickly which one a vertex is; where the block's vertices are few
    // among many they are sorted.
    void number_vertices();

    void find_around();

    static constexpr std::array<std::uint8_t, 4> kNext{1, 2, 0, 1};  // corners of a facet
    // The facets around v and the vertices around it, counter-clockwise: facet i is (v, ring_[i], ring_[i +
    // 1]). False where they are not one closed fan.
    bool gather(std::uint32_t v);

    // Takes a vertex away where one of its edges allows it.
    bool remove(std::uint32_t v);

    // Whether the fan has a facet of less than 30° from level, and reaches as near to one of the planes as it
    // may move.
    [[nodiscard]] bool crosses_nearly_level(std::uint32_t v) const;

    // The vertices around v as (u, v, w) from v, w along the facets' mean normal. False where nothing lets v
    // go.
    bool look(std::uint32_t v);

    // How flat the facets around are and which way they face: asked only where the gap allows going.
    void look_at_old_facets();

    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(n_); }

    // Whether all facets around a vertex are known: in this block, and as they were when the round began.
    [[nodiscard]] bool known(std::uint32_t v) const { return inner_[v] && !touched_[v]; }

    // Whether the edge (a, b) exists, as a facet of the one of them that is known tells; true where neither
    // is.
    [[nodiscard]] bool joined(std::uint32_t a, std::uint32_t b) const;

    // Whether v may be drawn into the vertex k of its ring, and leaves less flat facets than going to the
    // best one so far. need_[v] becomes no more than what a tolerance must allow so that this may change.
    bool may_go_to(std::uint32_t v, int k);
    // Takes note of how far, along the mean normal, what was there stands over what follows at one place.
    bool fits(std::uint32_t v, double gap);
    // Whether what was there and what follows are within the tolerance everywhere; the vertex is its ring's
    // at `start`.
    bool gap_allows(std::uint32_t v, std::size_t start);
    // Whether the new facets are no flatter than they need be and face as old ones did.
    bool shapes_well(std::size_t start);

    [[nodiscard]] std::size_t at(int k, int i) const;

    // With three facets around, the one that follows may be there already, turned over: a tetrahedron must
    // stay one.
    [[nodiscard]] bool joined_across(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;

    void go_to(std::uint32_t v, int k);

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
            SimplifyBlock::put(x, i, p.x), SimplifyBlock::put(y, i, p.y), SimplifyBlock::put(z, i, p.z);
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

}  // namespace slabwright::simplifying

#pragma GCC diagnostic pop
