#include "kernels/mesh/part.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// Some of many things, and how many of them come before each.
struct Chosen {
    std::vector<std::uint64_t> words;
    std::vector<std::uint32_t> before;  // by word

    explicit Chosen(std::size_t n) : words((n + 63) / 64, 0) {}
    [[nodiscard]] bool has(std::uint32_t i) const { return (words[i >> 6] >> (i & 63) & 1) != 0; }
    void add(std::uint32_t i) { words[i >> 6] |= std::uint64_t{1} << (i & 63); }
    std::size_t count() {
        before.resize(words.size());
        std::uint32_t sum = 0;
        for (std::size_t w = 0; w < words.size(); ++w)
            before[w] = sum, sum += static_cast<std::uint32_t>(std::popcount(words[w]));
        return sum;
    }
    [[nodiscard]] std::uint32_t rank(std::uint32_t i) const {
        return before[i >> 6] + static_cast<std::uint32_t>(
                                    std::popcount(words[i >> 6] & ((std::uint64_t{1} << (i & 63)) - 1)));
    }
    /// Calls fn(i) for those in words [begin, end), ascending.
    template <class Fn>
    void each(std::size_t begin, std::size_t end, Fn&& fn) const {
        for (std::size_t w = begin; w < end; ++w)
            for (std::uint64_t bits = words[w]; bits != 0; bits &= bits - 1)
                fn(static_cast<std::uint32_t>(64 * w + static_cast<std::size_t>(std::countr_zero(bits))));
    }
};

constexpr std::size_t kGrain = std::size_t{1} << 10;  // words

}  // namespace

Mesh part_between(Context& context, MeshView mesh, double low, double high) {
    Chosen within(mesh.size()), facets(mesh.size()), vertices(mesh.vertices.size());
    // By whole words, so that no two threads write one.
    auto choose = [&](Chosen& chosen, auto&& wanted) {
        parallel_for(context, chosen.words.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t f = 64 * begin; f < std::min(mesh.size(), 64 * end); ++f)
                if (wanted(f)) chosen.add(static_cast<std::uint32_t>(f));
        });
    };
    choose(within, [&](std::size_t f) {
        const float a = mesh.vertices[mesh.facets[f][0]].z, b = mesh.vertices[mesh.facets[f][1]].z,
                    c = mesh.vertices[mesh.facets[f][2]].z;
        return std::max({a, b, c}) >= low && std::min({a, b, c}) <= high;
    });
    choose(facets, [&](std::size_t f) {
        const Index3& beside = mesh.neighbours[f];
        return within.has(static_cast<std::uint32_t>(f)) ||
               std::any_of(beside.begin(), beside.end(),
                           [&](std::uint32_t g) { return g != kNoFacet && within.has(g); });
    });
    Mesh part;
    part.facets.resize(facets.count());
    part.neighbours.resize(part.facets.size());
    if (!mesh.roles.empty()) part.roles.resize(part.facets.size());
    facets.each(0, facets.words.size(), [&](std::uint32_t f) {
        for (const std::uint32_t v : mesh.facets[f]) vertices.add(v);
    });
    part.vertices.resize(vertices.count());
    parallel_for(context, vertices.words.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        vertices.each(begin, end,
                      [&](std::uint32_t v) { part.vertices[vertices.rank(v)] = mesh.vertices[v]; });
    });
    parallel_for(context, facets.words.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        facets.each(begin, end, [&](std::uint32_t f) {
            const std::uint32_t at = facets.rank(f);
            if (!mesh.roles.empty()) part.roles[at] = mesh.roles[f];
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t g = mesh.neighbours[f][k];
                part.facets[at][k] = vertices.rank(mesh.facets[f][k]);
                part.neighbours[at][k] = g != kNoFacet && facets.has(g) ? facets.rank(g) : kNoFacet;
            }
        });
    });
    return part;
}

namespace {

/// Adds what of a facet lies between two heights.
void grow(PlanBox& box, const std::array<Vec3f, 3>& corners, double low, double high) {
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3f &a = corners[k], &b = corners[(k + 1) % 3];
        if (a.z >= low && a.z <= high) box.grow(a.x, a.y);
        for (const double z : {low, high}) {
            if (!((a.z < z && b.z > z) || (a.z > z && b.z < z))) continue;
            const double share = (z - a.z) / (double{b.z} - a.z);
            box.grow(a.x + share * (double{b.x} - a.x), a.y + share * (double{b.y} - a.y));
        }
    }
}

}  // namespace

std::vector<PlanBox> boxes_between(Context& context, MeshView mesh,
                                   std::span<const std::array<double, 2>> ranges) {
    const std::vector<PlanBox> none(ranges.size());
    return parallel_reduce(
        context, mesh.facets.size(), std::size_t{1} << 16, none,
        [&](std::size_t begin, std::size_t end) {
            std::vector<PlanBox> boxes = none;
            for (std::size_t f = begin; f < end; ++f) {
                const std::array<Vec3f, 3> corners{mesh.vertices[mesh.facets[f][0]],
                                                   mesh.vertices[mesh.facets[f][1]],
                                                   mesh.vertices[mesh.facets[f][2]]};
                const double low = std::min({corners[0].z, corners[1].z, corners[2].z}),
                             high = std::max({corners[0].z, corners[1].z, corners[2].z});
                auto range = std::partition_point(ranges.begin(), ranges.end(),
                                                  [&](const auto& r) { return r[1] < low; });
                for (; range != ranges.end() && (*range)[0] <= high; ++range)
                    grow(boxes[static_cast<std::size_t>(range - ranges.begin())], corners, (*range)[0],
                         (*range)[1]);
            }
            return boxes;
        },
        [](std::vector<PlanBox> a, const std::vector<PlanBox>& b) {
            for (std::size_t i = 0; i < a.size(); ++i)
                if (!b[i].is_empty())
                    a[i].grow(b[i].min[0], b[i].min[1]), a[i].grow(b[i].max[0], b[i].max[1]);
            return a;
        });
}

}  // namespace slabwright
