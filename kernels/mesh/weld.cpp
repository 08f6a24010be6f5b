#include "kernels/mesh/weld.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "kernels/errors.h"
#include "kernels/mesh/clusters.h"
#include "kernels/mesh/edges.h"
#include "kernels/mesh/morton.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// A corner's coordinates as bits, −0 turned into +0, with its number: equal points have equal bits.
struct Key {
    std::uint32_t x, y, z, corner;
};

Key key_of(const Vec3f& p, std::size_t corner) {
    return {std::bit_cast<std::uint32_t>(p.x + 0.0f), std::bit_cast<std::uint32_t>(p.y + 0.0f),
            std::bit_cast<std::uint32_t>(p.z + 0.0f), static_cast<std::uint32_t>(corner)};
}

bool same_point(const Key& a, const Key& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// Grids put all their points on a few bits, so every bit must reach every other: two rounds of multiply and
/// fold.
std::uint64_t hash_of(const Key& key) {
    std::uint64_t h = (key.x | std::uint64_t{key.y} << 32) * 0x9E3779B97F4A7C15u;
    h = ((h ^ h >> 32) + key.z) * 0xD6E8FEB86659FD93u;
    h = (h ^ h >> 32) * 0xD6E8FEB86659FD93u;
    return h ^ h >> 32;
}

/// Facets that are searched for equal corners among themselves before all others. Their table fits the cache.
constexpr std::size_t kBlockFacets = 4096;
static_assert(kNumberingChunk % (3 * kBlockFacets) == 0);

constexpr std::uint16_t kFree = 0xFFFF;

/// Finds equal corners within a block of facets.
class BlockTable {
public:
    BlockTable() : table_(kSlots), keys_(3 * kBlockFacets + 1) {}
    /// slots[c] becomes the first corner of the block that has the same point as c. @return how many points
    /// are different
    std::size_t find_firsts(const FacetRecords& facets, std::size_t begin, std::size_t end,
                            std::span<std::uint32_t> slots) {
        std::fill(table_.begin(), table_.end(), kFree);
        std::size_t different = 0;
        for (std::size_t f = begin; f < end; ++f) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Key key = key_of(facets.corner(f, k), 3 * f + k);
                std::size_t slot = hash_of(key) % kSlots;
                // As if the point was a new one, so that a free slot leads to an equal key too: whether it is
                // new takes no branch.
                keys_[different] = key;
                std::size_t at = table_[slot] == kFree ? different : table_[slot];
                while (!same_point(keys_[at], key)) {
                    slot = (slot + 1) % kSlots;
                    at = table_[slot] == kFree ? different : table_[slot];
                }
                table_[slot] = static_cast<std::uint16_t>(at);
                slots[key.corner] = keys_[at].corner;
                different += at == different ? 1 : 0;
            }
        }
        return different_ = different;
    }
    /// The different points that were found.
    [[nodiscard]] std::span<const Key> firsts() const { return {keys_.data(), different_}; }

private:
    static constexpr std::size_t kSlots = std::size_t{1} << 15;
    std::vector<std::uint16_t> table_;
    std::vector<Key> keys_;
    std::size_t different_ = 0;
};

}  // namespace

bool neighbours_follow(const FacetRecords& facets) {
    const std::size_t blocks = (facets.count + kBlockFacets - 1) / kBlockFacets, step = (blocks + 7) / 8;
    BlockTable table;
    std::vector<std::uint32_t> slots(3 * kBlockFacets);
    std::size_t corners = 0, different = 0;
    for (std::size_t block = 0; block < blocks; block += step) {
        FacetRecords some = facets;
        some.data += block * kBlockFacets * facets.stride_bytes;
        some.count = std::min(kBlockFacets, facets.count - block * kBlockFacets);
        corners += 3 * some.count;
        different += table.find_firsts(some, 0, some.count, slots);
    }
    return 4 * different < 3 * corners;
}

BulkVector<std::array<Vec3f, 3>> in_space(Context& context, const FacetRecords& facets, const Box3& box) {
    if (facets.count > kMaxFacets) throw too_many_facets(facets.count);
    using Corners = std::array<Vec3f, 3>;
    // First into no more parts than the memory's pages can be kept at hand, most of which fit a cache then,
    // and within each into its cells.
    constexpr int coarse = 4, finer = 4, subcells = 1 << (3 * finer);
    const MortonGrid grid(box);
    auto cell_of = [&](const Corners& c) { return grid.coarse_code(c[0].x, c[0].y, c[0].z); };
    static_assert(coarse + finer == 8);  // bits along each axis, as coarse_code() gives
    BulkVector<Corners> together(facets.count);
    auto items = [&](std::size_t begin, std::size_t end, auto&& take) {
        for (std::size_t f = begin; f < end; ++f) {
            const Corners c{facets.corner(f, 0), facets.corner(f, 1), facets.corner(f, 2)};
            take(cell_of(c) / subcells, c);
        }
    };
    auto counted = [&](std::size_t begin, std::size_t end, auto&& take) {
        for (std::size_t f = begin; f < end; ++f) take(cell_of({facets.corner(f, 0), {}, {}}) / subcells);
    };
    auto room = [&](std::uint64_t total, std::uint64_t) { return std::pair(together.data(), total); };
    auto within_parts = [&](std::size_t first, std::size_t last, std::span<const std::uint32_t> starts) {
        parallel_for(context, last - first, 16, [&](std::size_t begin, std::size_t end) {
            BulkVector<Corners> part;
            BulkVector<std::uint16_t> cells;
            std::array<std::uint32_t, subcells + 1> next;
            for (std::size_t p = begin; p < end; ++p) {
                const std::size_t n = starts[p + 1] - starts[p];
                if (n < 2) continue;
                const Corners* const unsorted = together.data() + starts[p];
                part.resize(std::max(n, part.size()));
                cells.resize(part.size());
                next.fill(0);
                for (std::size_t i = 0; i < n; ++i) {
                    part[i] = unsorted[i];
                    cells[i] = static_cast<std::uint16_t>(cell_of(part[i]) % subcells);
                    ++next[cells[i] + 1u];
                }
                next[0] = starts[p];
                for (std::size_t k = 1; k < subcells; ++k) next[k] += next[k - 1];
                for (std::size_t i = 0; i < n; ++i) together[next[cells[i]]++] = part[i];
            }
        });
    };
    const std::size_t grain = std::max<std::size_t>(std::size_t{1} << 14, (facets.count + 63) / 64);
    deal(context, facets.count, grain, std::size_t{1} << (3 * coarse), counted, items, room, within_parts);
    return together;
}

namespace {

// @param let_go called when the records are not needed any more
template <class LetGo>
Mesh weld_letting_go(Context& context, const FacetRecords& facets, std::vector<std::uint32_t>* odd,
                     LetGo&& let_go) {
    if (odd != nullptr) odd->clear();
    if (facets.count > kMaxFacets) throw too_many_facets(facets.count);
    Mesh mesh;
    if (facets.count == 0) return mesh;
    const std::size_t n = 3 * facets.count;
    mesh.facets.resize(facets.count);
    // One flat view of all corner slots; while welding, slot c holds the first corner that has the same
    // point, or one before c in its block that leads there.
    const std::span<std::uint32_t> slots(mesh.facets.front().data(), n);

    // Corners are dealt by hash into parts small enough for a hash table in the cache; shuffled facets cost
    // little more than ordered ones. Dealing keeps the order of corners, so the first of a part is the first
    // in the file. Where facets that follow each other share corners, only the first of its block is dealt
    // for each point, which leaves a fifth of them.
    const std::size_t corners_a_part = std::size_t{1} << 14, most_parts = 2048;
    const std::size_t parts = std::min(std::bit_ceil((n + corners_a_part - 1) / corners_a_part), most_parts);
    const unsigned part_bits = static_cast<unsigned>(std::countr_zero(parts));
    auto part_of = [&](const Key& key) {
        return part_bits == 0 ? std::size_t{0} : static_cast<std::size_t>(hash_of(key) >> (64 - part_bits));
    };
    const bool blockwise = neighbours_follow(facets);

    const std::size_t blocks = (facets.count + kBlockFacets - 1) / kBlockFacets;
    const std::size_t grain = kBlockFacets * std::max<std::size_t>(8, (blocks + 63) / 64);
    {
        std::optional<MemoryCharge> charge;
        EdgeScratch scratch;
        std::vector<BulkVector<Key>> firsts(blockwise ? (facets.count + grain - 1) / grain
                                                      : 0);  // of each chunk: the keys that it deals
        std::vector<const Key*> first_of_block(blockwise ? blocks : 0);
        auto counted = [&](std::size_t begin, std::size_t end, auto&& take) {
            if (blockwise) {
                BlockTable table;
                BulkVector<Key>& mine = firsts[begin / grain];
                mine.reserve((end - begin) * 3);  // what is not needed is never touched
                for (std::size_t f = begin; f < end; f += kBlockFacets) {
                    table.find_firsts(facets, f, std::min(end, f + kBlockFacets), slots);
                    first_of_block[f / kBlockFacets] = mine.data() + mine.size();
                    for (const Key& key : table.firsts()) take(part_of(key));
                    mine.insert(mine.end(), table.firsts().begin(), table.firsts().end());
                }
                return;
            }
            for (std::size_t f = begin; f < end; ++f)
                for (std::size_t k = 0; k < 3; ++k) take(part_of(key_of(facets.corner(f, k), 3 * f + k)));
        };
        auto keys = [&](std::size_t begin, std::size_t end, auto&& take) {
            if (blockwise) {
                for (const Key& key : firsts[begin / grain]) take(part_of(key), key);
                return;
            }
            for (std::size_t f = begin; f < end; ++f) {
                for (std::size_t k = 0; k < 3; ++k) {
                    const Key key = key_of(facets.corner(f, k), 3 * f + k);
                    take(part_of(key), key);
                }
            }
        };
        // To bound memory, no more than about half of all corners are dealt at a time.
        auto room = [&](std::uint64_t total, std::uint64_t largest) {
            if (blockwise) let_go();  // what the blocks found tells all
            const std::uint64_t most = std::min(total, std::max<std::uint64_t>(n / 2 + 1, largest) + largest);
            charge.emplace(context, (most + (blockwise ? total : 0)) * sizeof(Key), "welding the facets");
            scratch = EdgeScratch(most * sizeof(Key));
            return std::pair(reinterpret_cast<Key*>(scratch.data()), most);
        };
        auto weld_parts = [&](std::size_t first, std::size_t last, std::span<const std::uint32_t> starts) {
            const Key* const dealt = reinterpret_cast<const Key*>(scratch.data());
            parallel_for(context, last - first, 4, [&](std::size_t begin, std::size_t end) {
                constexpr std::uint32_t empty = 0xFFFFFFFFu;
                std::vector<std::uint32_t> table;
                for (std::size_t i = begin; i < end; ++i) {
                    const std::span<const Key> mine(dealt + starts[i], starts[i + 1] - starts[i]);
                    const std::size_t mask = std::bit_ceil(2 * mine.size() + 1) - 1;
                    table.assign(mask + 1, empty);
                    for (std::uint32_t j = 0; j < mine.size(); ++j) {
                        std::size_t slot = hash_of(mine[j]) & mask;
                        while (table[slot] != empty && !same_point(mine[table[slot]], mine[j]))
                            slot = (slot + 1) & mask;
                        if (table[slot] == empty) table[slot] = j;
                        slots[mine[j].corner] = mine[table[slot]].corner;
                    }
                }
            });
        };
        deal(context, facets.count, grain, parts, counted, keys, room, weld_parts);
        number_by_first(
            context, slots, [&](std::uint32_t count) { mesh.vertices.resize(count); },
            [&](std::size_t c, std::uint32_t number) {
                if (blockwise) {
                    // Asked for by ascending corner, chunk by chunk of whole blocks.
                    const Key*& at = first_of_block[c / (3 * kBlockFacets)];
                    while (at->corner != c) ++at;
                    mesh.vertices[number] = {std::bit_cast<float>(at->x), std::bit_cast<float>(at->y),
                                             std::bit_cast<float>(at->z)};
                    return;
                }
                const Vec3f p = facets.corner(c / 3, c % 3);
                mesh.vertices[number] = {p.x + 0.0f, p.y + 0.0f, p.z + 0.0f};
            });
        firsts.clear();
        if (!blockwise) let_go();
        pair_edges(context, mesh, scratch, odd);
    }
    return mesh;
}

FacetRecords records_of(std::span<const std::array<Vec3f, 3>> corners) {
    return {reinterpret_cast<const char*>(corners.data()), corners.size()};
}

}  // namespace

Mesh weld_records(Context& context, const FacetRecords& facets, std::vector<std::uint32_t>* odd) {
    return weld_letting_go(context, facets, odd, [] {});
}

Mesh weld(Context& context, std::span<const std::array<Vec3f, 3>> corners, std::vector<std::uint32_t>* odd) {
    return weld_records(context, records_of(corners), odd);
}

Mesh weld_and_let_go(Context& context, BulkVector<std::array<Vec3f, 3>>&& corners,
                     std::vector<std::uint32_t>* odd) {
    return weld_letting_go(context, records_of(corners), odd,
                           [&] { BulkVector<std::array<Vec3f, 3>>().swap(corners); });
}

}  // namespace slabwright
