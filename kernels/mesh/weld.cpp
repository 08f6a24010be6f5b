#include "kernels/mesh/weld.h"

#include <bit>
#include <cmath>
#include <utility>

#include "kernels/errors.h"
#include "kernels/mesh/clusters.h"
#include "kernels/mesh/edges.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// A corner's coordinates as bits, −0 turned into +0, with its number: equal points have equal bits.
struct Key {
    std::uint32_t x, y, z, corner;
};

Key key_of(const Vec3f& p, std::size_t corner) {
    return {std::bit_cast<std::uint32_t>(p.x + 0.0f), std::bit_cast<std::uint32_t>(p.y + 0.0f), std::bit_cast<std::uint32_t>(p.z + 0.0f),
            static_cast<std::uint32_t>(corner)};
}

bool same_point(const Key& a, const Key& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// Grids put all their points on a few bits, so every bit must reach every other: two rounds of multiply and fold.
std::uint64_t hash_of(const Key& key) {
    std::uint64_t h = (key.x | std::uint64_t{key.y} << 32) * 0x9E3779B97F4A7C15u;
    h = ((h ^ h >> 32) + key.z) * 0xD6E8FEB86659FD93u;
    h = (h ^ h >> 32) * 0xD6E8FEB86659FD93u;
    return h ^ h >> 32;
}

}  // namespace

Mesh weld(Context& context, std::span<const std::array<Vec3f, 3>> corners) {
    if (corners.size() > kMaxFacets)
        throw Error(ErrorKind::input, "mesh.too_large", "a mesh may have " + std::to_string(kMaxFacets) + " facets at most",
                    std::to_string(corners.size()) + " facets", "reduce the mesh or split the pattern");
    Mesh mesh;
    if (corners.empty()) return mesh;
    const std::size_t n = 3 * corners.size();
    mesh.facets.resize(corners.size());
    // One flat view of all corner slots; while welding, slot c holds the first corner that has the same point.
    const std::span<std::uint32_t> slots(mesh.facets.front().data(), n);

    // Corners are dealt by hash into parts small enough for a hash table in the cache; shuffled facets cost no more than
    // ordered ones. Dealing keeps the order of corners, so the first of a part is the first in the file. To bound memory,
    // only a quarter of the parts is filled at a time.
    const std::size_t corners_a_part = std::size_t{1} << 14, most_parts = 4096;
    const std::size_t parts = std::min(std::bit_ceil((n + corners_a_part - 1) / corners_a_part), most_parts);
    const std::size_t rounds = parts >= 64 ? 4 : 1, parts_a_round = parts / rounds;
    const unsigned part_bits = static_cast<unsigned>(std::countr_zero(parts));
    auto part_of = [&](std::uint64_t hash) { return part_bits == 0 ? std::size_t{0} : static_cast<std::size_t>(hash >> (64 - part_bits)); };
    auto corner_key = [&](std::size_t c) { return key_of(corners[c / 3][c % 3], c); };

    const std::size_t grain = std::max<std::size_t>(std::size_t{1} << 16, (n + 63) / 64);
    const std::size_t chunks = (n + grain - 1) / grain;
    std::vector<std::uint32_t> next(chunks * parts, 0);
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t* count = &next[begin / grain * parts];
        for (std::size_t c = begin; c < end; ++c) ++count[part_of(hash_of(corner_key(c)))];
    });
    std::vector<std::uint32_t> starts(parts + 1);  // within the part's round
    std::size_t largest_round = 0;
    for (std::size_t round = 0; round < rounds; ++round) {
        std::uint32_t total = 0;
        for (std::size_t part = round * parts_a_round; part < (round + 1) * parts_a_round; ++part) {
            starts[part] = total;
            for (std::size_t chunk = 0; chunk < chunks; ++chunk) total += std::exchange(next[chunk * parts + part], total);
        }
        largest_round = std::max<std::size_t>(largest_round, total);
    }
    {
        const MemoryCharge charge(context, largest_round * sizeof(Key), "welding the facets");
        RawArray<Key> keys(largest_round);
        for (std::size_t round = 0; round < rounds; ++round) {
            const std::size_t first_part = round * parts_a_round;
            parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
                std::uint32_t* place = &next[begin / grain * parts];
                for (std::size_t c = begin; c < end; ++c) {
                    const Key key = corner_key(c);
                    const std::size_t part = part_of(hash_of(key));
                    if (part - first_part < parts_a_round) keys[place[part]++] = key;
                }
            });
            // After dealing, the last chunk's place is the end of the part.
            const std::uint32_t* ends = &next[(chunks - 1) * parts];
            parallel_for(context, parts_a_round, 4, [&](std::size_t begin, std::size_t end) {
                constexpr std::uint32_t empty = 0xFFFFFFFFu;
                std::vector<std::uint32_t> table;
                for (std::size_t part = first_part + begin; part < first_part + end; ++part) {
                    const std::span<const Key> mine = std::as_const(keys).span().subspan(starts[part], ends[part] - starts[part]);
                    const std::size_t mask = std::bit_ceil(2 * mine.size() + 1) - 1;
                    table.assign(mask + 1, empty);
                    for (std::uint32_t i = 0; i < mine.size(); ++i) {
                        std::size_t slot = hash_of(mine[i]) & mask;
                        while (table[slot] != empty && !same_point(mine[table[slot]], mine[i])) slot = (slot + 1) & mask;
                        if (table[slot] == empty) table[slot] = i;
                        slots[mine[i].corner] = mine[table[slot]].corner;
                    }
                }
            });
        }
    }
    // Firsts are counted before the vertices are allocated.
    const std::uint64_t vertex_count = parallel_reduce(
        context, n, grain, std::uint64_t{0},
        [&](std::size_t begin, std::size_t end) {
            std::uint64_t count = 0;
            for (std::size_t c = begin; c < end; ++c) count += slots[c] == c;
            return count;
        },
        [](std::uint64_t a, std::uint64_t b) { return a + b; });
    mesh.vertices.resize(vertex_count);
    number_by_first(context, slots, [&](std::size_t c, std::uint32_t number) {
        const Vec3f p = corners[c / 3][c % 3];
        mesh.vertices[number] = {p.x + 0.0f, p.y + 0.0f, p.z + 0.0f};
    });
    pair_edges(context, mesh);
    return mesh;
}

}  // namespace slabwright
