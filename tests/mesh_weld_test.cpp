// Welding and pairing against brute force.
#include "kernels/mesh/weld.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <tuple>

#include "kernels/errors.h"
#include "kernels/mesh/edges.h"
#include "kernels/mesh/morton.h"
#include "tests/mesh_shapes.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using shapes::Facets;

/// Vertices by first use, in the simplest way.
Mesh weld_slowly(const Facets& facets) {
    Mesh mesh;
    std::map<std::tuple<float, float, float>, std::uint32_t> known;  // −0 and +0 compare equal
    for (const auto& corners : facets) {
        Index3 facet{};
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f p = corners[k];
            const auto [at, fresh] =
                known.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(mesh.vertices.size()));
            if (fresh) mesh.vertices.push_back(p);
            facet[k] = at->second;
        }
        mesh.facets.push_back(facet);
    }
    return mesh;
}

bool same_bytes(const Mesh& a, const Mesh& b) {
    auto same = [](const auto& x, const auto& y) {
        return x.size() == y.size() &&
               (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
    };
    return same(a.vertices, b.vertices) && same(a.facets, b.facets) && same(a.neighbours, b.neighbours);
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// What must hold of any adjacency: partners run the other way along the same edge, nobody is anybody's
/// partner twice, and no two half-edges that could be partners are both left alone.
void check_pairs(const Mesh& mesh) {
    ASSERT_EQ(mesh.neighbours.size(), mesh.facets.size());
    std::map<Edge, int> alone;  // directed edges without a partner
    std::map<std::tuple<Edge, std::uint32_t, std::uint32_t>, int>
        partnerships;  // (directed edge, from facet, to facet)
    for (std::uint32_t f = 0; f < mesh.facets.size(); ++f) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Edge edge{mesh.facets[f][k], mesh.facets[f][(k + 1) % 3]};
            const std::uint32_t g = mesh.neighbours[f][k];
            if (edge.first == edge.second) {
                ASSERT_EQ(g, kNoFacet) << "an edge of no length has no partner";
            } else if (g == kNoFacet) {
                ++alone[edge];
            } else {
                ASSERT_LT(g, mesh.facets.size());
                ++partnerships[{edge, f, g}];
            }
        }
    }
    for (const auto& [key, count] : partnerships) {
        const auto& [edge, f, g] = key;
        const auto back = partnerships.find({Edge{edge.second, edge.first}, g, f});
        ASSERT_TRUE(back != partnerships.end())
            << "facet " << f << " has " << g << " for a neighbour, but not the other way";
        ASSERT_EQ(back->second, count);
    }
    for (const auto& [edge, count] : alone)
        ASSERT_EQ(alone.count({edge.second, edge.first}), 0u) << "two that could be partners are alone";
}

TEST(MeshWeld, NothingGivesNothing) {
    Context context({.threads = 2});
    const Mesh mesh = weld(context, {});
    EXPECT_TRUE(mesh.vertices.empty());
    EXPECT_TRUE(mesh.facets.empty());
    EXPECT_TRUE(mesh.neighbours.empty());
}

TEST(MeshWeld, CubeHasEightVerticesAndClosedNeighbours) {
    Context context({.threads = 2});
    const Mesh mesh = weld(context, shapes::box({0, 0, 0}, {1, 2, 3}));
    EXPECT_EQ(mesh.vertices.size(), 8u);
    EXPECT_EQ(mesh.facets.size(), 12u);
    check_pairs(mesh);
    for (const Index3& n : mesh.neighbours)
        for (const std::uint32_t f : n) EXPECT_NE(f, kNoFacet);
    EXPECT_EQ(mesh.facets[0], (Index3{0, 1, 2})) << "numbered by first use";
    const Box3 box = bounds(mesh.view());
    EXPECT_EQ(box.min, (Vec3f{0, 0, 0}));
    EXPECT_EQ(box.max, (Vec3f{1, 2, 3}));
}

TEST(MeshWeld, NegativeZeroIsZeroAndTheNextFloatIsNot) {
    Context context({.threads = 1});
    const float next = std::nextafter(1.0f, 2.0f);
    const Mesh mesh = weld(context, Facets{{Vec3f{0.0f, -0.0f, 0.0f}, {1, 0, 0}, {0, 1, 0}},
                                           {Vec3f{-0.0f, 0.0f, -0.0f}, {0, 1, 0}, {next, 0, 0}}});
    EXPECT_EQ(mesh.vertices.size(), 4u);
    EXPECT_EQ(mesh.facets[1], (Index3{0, 2, 3}));
    for (const Vec3f& v : mesh.vertices)
        EXPECT_FALSE(std::signbit(v.x) || std::signbit(v.y) || std::signbit(v.z));
}

TEST(MeshWeld, EqualsBruteForceOnRandomSoup) {
    std::mt19937_64 random(test::seed());
    for (const std::size_t n : {1u, 10u, 1000u, 70000u}) {
        for (const int grid : {2, 12, 60, 1 << 20}) {
            Facets facets(n);
            for (auto& facet : facets)
                for (Vec3f& p : facet) {
                    auto draw = [&] {
                        const float value =
                            0.1f *
                            static_cast<float>(static_cast<int>(random() % static_cast<std::uint64_t>(grid)) -
                                               grid / 2);
                        return value == 0 && random() % 2 == 0 ? -0.0f : value;
                    };
                    p = {draw(), draw(), draw()};
                }
            const Mesh expected = weld_slowly(facets);
            Mesh first;
            for (const int threads : {1, 2, 4}) {
                Context context({.threads = threads});
                Mesh mesh = weld(context, facets);
                ASSERT_EQ(mesh.facets, expected.facets) << n << " facets, grid " << grid;
                ASSERT_EQ(mesh.vertices, expected.vertices);
                if (threads == 1) first = std::move(mesh);
                else ASSERT_TRUE(same_bytes(mesh, first)) << "threads " << threads;
                EXPECT_EQ(context.memory_charged(), 0u);
            }
            check_pairs(first);
        }
    }
}

TEST(MeshWeld, FansOfAnySizeAreSorted) {
    std::mt19937_64 random(test::seed());
    const std::uint32_t origin = 7, width = 400;
    std::vector<EdgeUse> uses;
    for (std::uint32_t v = 0; v < width; ++v)
        for (std::size_t n = random() % 30; n > 0;
             --n)  // few upper ends, so that some are equal, and up to the largest number
            uses.push_back({origin + v,
                            random() % 2 == 0 ? 0xFFFFFFFFu - static_cast<std::uint32_t>(random() % 4)
                                              : static_cast<std::uint32_t>(random() % 9),
                            0});
    for (std::size_t i = 0; i < uses.size(); ++i)
        uses[i].code = static_cast<std::uint32_t>(7919 * i % uses.size());
    std::shuffle(uses.begin(), uses.end(), random);
    std::vector<std::array<std::uint32_t, 3>> expected, sorted;
    for (const EdgeUse& use : uses) expected.push_back({use.low, use.high, use.code});
    std::sort(expected.begin(), expected.end());
    std::set<std::uint32_t> seen;
    sort_fans(uses, origin, width, [&](std::span<const EdgeUse> fan) {
        EXPECT_TRUE(seen.insert(fan[0].low).second) << "one fan a vertex";
        for (const EdgeUse& use : fan) sorted.push_back({use.low, use.high, use.code});
    });
    EXPECT_EQ(sorted, expected);
}

TEST(MeshWeld, EdgesArePairedWhereFansArePlain) {
    std::mt19937_64 random(test::seed() + 1);
    const std::uint32_t origin = 7, width = 1000;
    std::vector<EdgeUse> uses;
    std::uint32_t facets = 0;
    for (std::uint32_t v = 0; v < width; ++v) {
        const std::uint32_t edges = static_cast<std::uint32_t>(random() % 10),
                            fault = static_cast<std::uint32_t>(random() % 8);
        const std::size_t begin = uses.size();
        const auto use = [&](std::uint32_t high, std::uint32_t facet, bool reversed) {
            uses.push_back(
                {origin + v, high,
                 2 * (3 * facet + static_cast<std::uint32_t>(random() % 3)) + (reversed ? 1u : 0u)});
        };
        std::uint32_t high = origin + v;
        for (std::uint32_t e = 0; e < edges; ++e, facets += 2) {
            high += 1 + static_cast<std::uint32_t>(random() % 3);
            use(high, facets, random() % 2 == 0);
            use(high, facets + 1, !uses.back().reversed());
        }
        if (edges == 0) continue;
        // One of what makes a fan odd, or none.
        EdgeUse& any = uses[begin + random() % (uses.size() - begin)];
        if (fault == 0) any.code ^= 1;
        if (fault == 1) any.high += 1;
        if (fault == 2) use(any.high, facets++, any.reversed());
        if (fault == 3) use(any.high, facets++, true), use(any.high, facets++, false);
        if (fault == 4 && edges > 1)
            uses[begin + 2].code = uses[begin].code ^ 1,
                         uses[begin + 3].code = uses[begin + 1].code ^ 1;  // two facets share two edges
    }
    std::map<std::uint32_t, std::vector<EdgeUse>> fans;  // by brute force
    for (const EdgeUse& use : uses) fans[use.low].push_back(use);
    std::set<std::pair<std::uint32_t, std::uint32_t>> expected, found;
    std::vector<std::uint32_t> odd, handed_out;
    for (auto& [low, fan] : fans) {
        std::sort(fan.begin(), fan.end(), [](const EdgeUse& a, const EdgeUse& b) {
            return a.high != b.high ? a.high < b.high : a.code < b.code;
        });
        bool plain = fan.size() <= 16 && fan.size() % 2 == 0;
        std::set<std::pair<std::uint32_t, std::uint32_t>> pairs, of_facets;
        for (const EdgeUse& use : fan) {
            std::vector<EdgeUse> same;
            for (const EdgeUse& other : fan)
                if (other.high == use.high) same.push_back(other);
            plain &= same.size() == 2 && same[0].reversed() != same[1].reversed();
            if (!plain) break;
            pairs.insert({same[0].code, same[1].code});
            of_facets.insert({same[0].facet(), same[1].facet()});
        }
        if (plain && of_facets.size() == fan.size() / 2) expected.insert(pairs.begin(), pairs.end());
        else odd.push_back(low);
    }
    std::shuffle(uses.begin(), uses.end(), random);
    pair_fans(
        uses, origin, width,
        [&](std::uint32_t a, std::uint32_t b) {
            EXPECT_TRUE(found.insert({a, b}).second);
        },
        [&](std::span<const EdgeUse> fan) {
            handed_out.push_back(fan[0].low);
            const std::vector<EdgeUse>& same = fans[fan[0].low];
            ASSERT_EQ(fan.size(), same.size());
            for (std::size_t i = 0; i < fan.size(); ++i)
                EXPECT_TRUE(fan[i].low == same[i].low && fan[i].high == same[i].high &&
                            fan[i].code == same[i].code);
        });
    EXPECT_EQ(found, expected);
    EXPECT_EQ(handed_out, odd);
    EXPECT_GT(odd.size(), width / 4);
    EXPECT_GT(expected.size(), width);
}

TEST(MeshWeld, MemoryThatIsKeptIsUsedAgain) {
    constexpr std::size_t large = std::size_t{1} << 24;
    const KeptMemory kept;
    char* const first = static_cast<char*>(take_bulk(large));
    std::fill_n(first, large, 'a');
    char* outside = nullptr;
    std::thread([&] {
        outside = static_cast<char*>(take_bulk(large));
    }).join();  // of a thread that keeps nothing
    release_bulk(first, large);
    std::vector<std::pair<char*, std::size_t>> pieces;
    for (const std::size_t bytes : {large / 4, large / 3 + 1, std::size_t{1000}, large, large / 4 + 12345}) {
        pieces.emplace_back(static_cast<char*>(take_bulk(bytes)), bytes);
        std::fill_n(pieces.back().first, bytes, static_cast<char>('b' + pieces.size()));
    }
    const auto within = [&](const char* p) { return p >= first && p < first + large; };
    EXPECT_TRUE(within(pieces[0].first) && within(pieces[1].first) && within(pieces[4].first));
    EXPECT_FALSE(within(pieces[3].first));
    for (std::size_t i = 0; i < pieces.size(); ++i)
        EXPECT_EQ(
            std::count(pieces[i].first, pieces[i].first + pieces[i].second, static_cast<char>('b' + i + 1)),
            static_cast<std::ptrdiff_t>(pieces[i].second));
    std::thread([&] { release_bulk(pieces[0].first, pieces[0].second); }).join();
    for (std::size_t i = 1; i < pieces.size(); ++i) release_bulk(pieces[i].first, pieces[i].second);
    release_bulk(outside, large);
}

// Pieces from the heap, one beside the other once the heap has grown, and small ones between them: as large
// as whole pages, or some bytes more or less, so that nothing is left behind them.
TEST(MeshWeld, LargePiecesHoldEveryByteTheyWereAskedFor) {
    std::mt19937_64 random(test::seed());
    for (int round = 0; round < 4; ++round) {
        std::vector<std::pair<unsigned char*, std::size_t>> pieces;
        for (std::size_t i = 0; i < 6; ++i) {
            std::size_t bytes = 1000 + random() % 100000;
            if (i % 2 == 0) bytes = ((3 + random() % 4) << 21) - 64 + random() % 3 * 64;
            pieces.emplace_back(static_cast<unsigned char*>(take_bulk(bytes)), bytes);
            std::fill_n(pieces.back().first, bytes, static_cast<unsigned char>(i));
        }
        for (std::size_t i = 0; i < pieces.size(); ++i) {
            const auto [data, bytes] = pieces[i];
            EXPECT_EQ(std::count(data, data + bytes, static_cast<unsigned char>(i)),
                      static_cast<std::ptrdiff_t>(bytes))
                << "round " << round;
        }
        for (const auto& [data, bytes] : pieces) release_bulk(data, bytes);
    }
}

// The flags of the mapping that an address lies in, as the system tells them; nothing where it tells none.
std::string flags_of(const void* address) {
    std::ifstream maps("/proc/self/smaps");
    bool within = false;
    for (std::string line; std::getline(maps, line);) {
        std::uintptr_t begin = 0, end = 0;
        if (std::sscanf(line.c_str(), "%" SCNxPTR "-%" SCNxPTR " ", &begin, &end) == 2)
            within = reinterpret_cast<std::uintptr_t>(address) >= begin &&
                     reinterpret_cast<std::uintptr_t>(address) < end;
        else if (within && line.starts_with("VmFlags:")) return line;
    }
    return {};
}

TEST(MeshWeld, LargeArraysAskForHugePages) {
    if (!std::filesystem::exists("/sys/kernel/mm/transparent_hugepage/enabled")) {
        std::printf("skipped: this system has no huge pages\n");
        return;
    }
    constexpr std::size_t large = std::size_t{1} << 25;
    for (const bool keeping : {false, true}) {
        std::optional<KeptMemory> kept;
        if (keeping) kept.emplace();
        char* const data = static_cast<char*>(take_bulk(large));
        std::fill_n(data, large, 'a');
        EXPECT_NE(flags_of(data).find(" hg"), std::string::npos) << flags_of(data);
        EXPECT_NE(flags_of(data + large / 2).find(" hg"), std::string::npos);
        release_bulk(data, large);
    }
    char on_the_stack = 0;
    EXPECT_EQ(flags_of(&on_the_stack).find(" hg"), std::string::npos);
}

TEST(MeshWeld, RecordsAreScaledLoweredAndNotAligned) {
    // As in a binary STL: 50 bytes a facet, its corners behind the normal; inches, lowest at -2.
    const Facets box = shapes::box({1, 1, -2}, {2, 3, 4});
    std::string bytes(1, 'x');
    for (const auto& corners : box) {
        bytes.append(12, 'n');
        bytes.append(reinterpret_cast<const char*>(corners.data()), sizeof corners);
        bytes.append(2, 'a');
    }
    Facets expected = box;
    for (auto& corners : expected)
        for (Vec3f& p : corners)
            p = {static_cast<float>(25.4 * double(p.x)), static_cast<float>(25.4 * double(p.y)),
                 static_cast<float>(25.4 * double(p.z) + 50.8)};
    Context context({.threads = 2});
    const Mesh mesh = weld_records(context, {bytes.data() + 1 + 12, box.size(), 50, 25.4, -50.8});
    ASSERT_EQ(mesh.vertices.size(), 8u);
    ASSERT_TRUE(same_bytes(mesh, weld(context, expected)));
    EXPECT_EQ(mesh.vertices[mesh.facets[0][0]].z, expected[0][0].z);
}

FacetRecords records_of(const Facets& facets) {
    return {reinterpret_cast<const char*>(facets.data()), facets.size()};
}

TEST(MeshWeld, FacetsAreBroughtTogetherInSpace) {
    Facets facets = shapes::torus(300);
    ASSERT_TRUE(neighbours_follow(records_of(facets)));
    std::mt19937_64 random(test::seed());
    std::shuffle(facets.begin(), facets.end(), random);
    ASSERT_FALSE(neighbours_follow(records_of(facets)));
    Context one({.threads = 1});
    const Mesh as_it_lies = weld(one, facets);
    BulkVector<std::array<Vec3f, 3>> first;
    for (const int threads : {1, 2, 4}) {
        Context context({.threads = threads});
        BulkVector<std::array<Vec3f, 3>> together =
            in_space(context, records_of(facets), bounds(as_it_lies.view()));
        ASSERT_EQ(together.size(), facets.size());
        const FacetRecords records{reinterpret_cast<const char*>(together.data()), together.size()};
        EXPECT_TRUE(neighbours_follow(records));
        if (threads == 1) first = together;
        ASSERT_EQ(together, first) << "threads " << threads;
        const Mesh spans = weld(context, std::span<const std::array<Vec3f, 3>>(together)),
                   moved = weld_and_let_go(context, std::move(together));
        ASSERT_TRUE(same_bytes(spans, moved));
        check_pairs(moved);
        EXPECT_EQ(context.memory_charged(), 0u);
    }
    auto sorted = [](auto all) {
        std::sort(all.begin(), all.end(),
                  [](const auto& a, const auto& b) { return std::memcmp(a.data(), b.data(), sizeof a) < 0; });
        return Facets(all.begin(), all.end());
    };
    EXPECT_EQ(sorted(first), sorted(facets)) << "each facet once, its corners as they were";
    // By cells, and as they were within a cell.
    const MortonGrid grid(bounds(as_it_lies.view()));
    std::stable_sort(facets.begin(), facets.end(), [&](const auto& a, const auto& b) {
        return grid.code(a[0].x, a[0].y, a[0].z) >> 39 < grid.code(b[0].x, b[0].y, b[0].z) >> 39;
    });
    EXPECT_EQ(Facets(first.begin(), first.end()), facets);
}

TEST(MeshWeld, CoarseCodesBeginAsCodesDo) {
    std::mt19937_64 random(test::seed());
    const MortonGrid grid({{-3, 10, 0}, {97, 60, 31}});
    std::uniform_real_distribution<double> x(-10, 110), y(0, 70), z(-5, 40);
    for (int i = 0; i < 10'000; ++i) {
        const double at[] = {x(random), y(random), z(random)};
        ASSERT_EQ(grid.coarse_code(at[0], at[1], at[2]), grid.code(at[0], at[1], at[2]) >> 39);
    }
}

TEST(MeshWeld, MemoryStaysUnderEightyBytesAFacet) {
    // Ordered and shuffled, the charge for scratch and the mesh itself together; a limit that is too small is
    // refused.
    Facets facets = shapes::torus(300);
    std::mt19937_64 random(test::seed());
    for (const bool shuffled : {false, true}) {
        if (shuffled) std::shuffle(facets.begin(), facets.end(), random);
        const std::uint64_t mesh_bytes = 30 * facets.size();
        Context enough({.threads = 2, .memory_bytes = 80 * facets.size() - mesh_bytes});
        EXPECT_EQ(weld(enough, facets).vertices.size(), 90000u);
        Context small({.threads = 2, .memory_bytes = 4 * facets.size()});
        EXPECT_THROW(static_cast<void>(weld(small, facets)), Error);
        EXPECT_EQ(small.memory_charged(), 0u);
    }
}

TEST(MeshWeld, LargeClosedMeshInAnyFacetOrder) {
    Facets facets = shapes::torus(500);
    std::mt19937_64 random(test::seed());
    for (const bool shuffled : {false, true}) {
        if (shuffled) std::shuffle(facets.begin(), facets.end(), random);
        Mesh first;
        for (const int threads : {1, 2, 4}) {
            Context context({.threads = threads});
            Mesh mesh = weld(context, facets);
            EXPECT_EQ(mesh.vertices.size(), 250000u);
            for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
                for (std::size_t k = 0; k < 3; ++k) {
                    const std::uint32_t g = mesh.neighbours[f][k];
                    ASSERT_NE(g, kNoFacet);
                    // The neighbour has the same edge, the other way.
                    bool found = false;
                    for (std::size_t j = 0; j < 3; ++j)
                        found |= mesh.facets[g][j] == mesh.facets[f][(k + 1) % 3] &&
                                 mesh.facets[g][(j + 1) % 3] == mesh.facets[f][k] &&
                                 mesh.neighbours[g][j] == f;
                    ASSERT_TRUE(found);
                }
            }
            if (threads == 1) first = std::move(mesh);
            else EXPECT_TRUE(same_bytes(mesh, first));
        }
    }
}

TEST(MeshWeld, MemoryLimitIsRespected) {
    Context context({.threads = 2, .memory_bytes = 1000});
    try {
        static_cast<void>(weld(context, shapes::torus(50)));
        FAIL() << "over the limit";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "memory.limit");
    }
}

TEST(MeshWeld, CancelStops) {
    Context context({.threads = 2});
    context.cancel();
    EXPECT_THROW(static_cast<void>(weld(context, shapes::torus(50))), Error);
}

/// Bodies are told apart by which facets are reached from which through neighbours.
std::vector<int> bodies(const Mesh& mesh) {
    std::vector<int> body(mesh.facets.size(), -1);
    int count = 0;
    for (std::uint32_t seed = 0; seed < mesh.facets.size(); ++seed) {
        if (body[seed] >= 0) continue;
        std::vector<std::uint32_t> stack{seed};
        body[seed] = count;
        while (!stack.empty()) {
            const std::uint32_t f = stack.back();
            stack.pop_back();
            for (const std::uint32_t g : mesh.neighbours[f])
                if (g != kNoFacet && body[g] < 0) body[g] = count, stack.push_back(g);
        }
        ++count;
    }
    return body;
}

TEST(MeshWeld, CubesThatTouchAlongAnEdgeStayTwo) {
    Context context({.threads = 1});
    Facets facets = shapes::box({0, 0, 0}, {1, 1, 1});
    shapes::append(facets, shapes::box({1, 1, 0}, {2, 2, 1}));
    const Mesh mesh = weld(context, facets);
    EXPECT_EQ(mesh.vertices.size(), 14u);
    check_pairs(mesh);
    const std::vector<int> body = bodies(mesh);
    for (std::size_t f = 0; f < body.size(); ++f) EXPECT_EQ(body[f], f < 12 ? 0 : 1);
}

TEST(MeshWeld, CavitiesThatTouchAlongAnEdgeJoinAsTheSolidBetweenThemDoes) {
    // Two cavities that touch along an edge, inside a block: the solid lies on the other two sides of the
    // edge, so the pairs go from one cavity to the other.
    Context context({.threads = 1});
    Facets facets = shapes::flipped(shapes::box({0, 0, 0}, {1, 1, 1}));
    shapes::append(facets, shapes::flipped(shapes::box({1, 1, 0}, {2, 2, 1})));
    const Mesh mesh = weld(context, facets);
    check_pairs(mesh);
    int across = 0;
    for (std::size_t f = 0; f < 12; ++f)
        for (const std::uint32_t g : mesh.neighbours[f]) across += g != kNoFacet && g >= 12;
    EXPECT_EQ(across, 2);
}

TEST(MeshWeld, CubesThatShareAFaceStayTwo) {
    Context context({.threads = 1});
    Facets facets = shapes::box({0, 0, 0}, {1, 1, 1});
    shapes::append(facets, shapes::box({0, 0, 1}, {1, 1, 2}));
    const Mesh mesh = weld(context, facets);
    check_pairs(mesh);
    const std::vector<int> body = bodies(mesh);
    for (std::size_t f = 0; f < body.size(); ++f) EXPECT_EQ(body[f], f < 12 ? 0 : 1);
}

struct Rotation {
    double m[3][3];
    Vec3f operator()(double x, double y, double z) const {
        return {static_cast<float>(m[0][0] * x + m[0][1] * y + m[0][2] * z),
                static_cast<float>(m[1][0] * x + m[1][1] * y + m[1][2] * z),
                static_cast<float>(m[2][0] * x + m[2][1] * y + m[2][2] * z)};
    }
};

Rotation random_rotation(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    double q[4], length = 0;
    for (double& c : q) c = normal(random), length += c * c;
    for (double& c : q) c /= std::sqrt(length);
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

TEST(MeshWeld, AroundAnEdgeTheSolidLiesBetweenPartners) {
    // Wedges of solid around a common edge, facets in random order: a facet's partner at the edge is the
    // other side of its own wedge.
    std::mt19937_64 random(test::seed());
    for (int round = 0; round < 2000; ++round) {
        const std::size_t wedges = 2 + random() % 5;
        std::vector<double> angles(2 * wedges);
        const double offset = std::uniform_real_distribution(0.0, 6.0)(random);
        for (std::size_t i = 0; i < angles.size(); ++i)  // at least 0.05 apart
            angles[i] =
                offset + 6.283185307 *
                             (static_cast<double>(i) + std::uniform_real_distribution(0.0, 0.8)(random)) /
                             static_cast<double>(angles.size());
        const Rotation turn = random_rotation(random);
        const Vec3f low = turn(0, 0, -7), high = turn(0, 0, 12);
        std::vector<std::pair<std::size_t, std::array<Vec3f, 3>>> facets;
        for (std::size_t i = 0; i < angles.size(); ++i) {
            const double r = std::uniform_real_distribution(1.0, 30.0)(random),
                         z = std::uniform_real_distribution(-20.0, 20.0)(random);
            const Vec3f p = turn(r * std::cos(angles[i]), r * std::sin(angles[i]), z);
            // Seen along the edge from low to high, the wedge begins with a facet that has the solid after
            // it.
            if (i % 2 == 0) facets.push_back({i / 2, {high, low, p}});
            else facets.push_back({i / 2, {low, high, p}});
        }
        std::shuffle(facets.begin(), facets.end(), random);
        Facets corners;
        for (auto& [wedge, facet] : facets) {
            std::rotate(facet.begin(), facet.begin() + static_cast<std::ptrdiff_t>(random() % 3),
                        facet.end());
            corners.push_back(facet);
        }
        Context context({.threads = 1});
        const Mesh mesh = weld(context, corners);
        check_pairs(mesh);
        for (std::size_t f = 0; f < corners.size(); ++f) {
            std::set<std::uint32_t> partners;
            for (const std::uint32_t g : mesh.neighbours[f])
                if (g != kNoFacet) partners.insert(g);
            ASSERT_EQ(partners.size(), 1u) << "round " << round;
            ASSERT_EQ(facets[*partners.begin()].first, facets[f].first) << "round " << round;
        }
    }
}

TEST(MeshWeld, RandomVoxelSolidsPairWithinTheirVoxelAcrossSharedEdges) {
    // Boundaries of random voxel sets are full of edges with four facets. There the solid is a quarter on
    // either side: partners are faces of one voxel. Everything is turned, so that coordinates are rounded.
    std::mt19937_64 random(test::seed());
    constexpr int n = 6;
    for (int round = 0; round < 60; ++round) {
        const Rotation turn = random_rotation(random);
        bool solid[n][n][n];
        for (auto& plane : solid)
            for (auto& row : plane)
                for (bool& cell : row) cell = random() % 2 == 0;
        auto filled = [&](int x, int y, int z) {
            return x >= 0 && y >= 0 && z >= 0 && x < n && y < n && z < n && solid[x][y][z];
        };
        Facets facets;
        std::vector<int> voxel;
        for (int x = 0; x < n; ++x)
            for (int y = 0; y < n; ++y)
                for (int z = 0; z < n; ++z) {
                    if (!solid[x][y][z]) continue;
                    const Facets all = shapes::box({float(x), float(y), float(z)},
                                                   {float(x + 1), float(y + 1), float(z + 1)});
                    const bool hidden[6] = {filled(x, y, z - 1), filled(x, y, z + 1), filled(x, y - 1, z),
                                            filled(x, y + 1, z), filled(x - 1, y, z), filled(x + 1, y, z)};
                    for (std::size_t f = 0; f < 12; ++f) {
                        if (hidden[f / 2]) continue;
                        facets.push_back({turn(all[f][0].x, all[f][0].y, all[f][0].z),
                                          turn(all[f][1].x, all[f][1].y, all[f][1].z),
                                          turn(all[f][2].x, all[f][2].y, all[f][2].z)});
                        voxel.push_back((x * n + y) * n + z);
                    }
                }
        Context context({.threads = 1 + static_cast<int>(random() % 3)});
        const Mesh mesh = weld(context, facets);
        check_pairs(mesh);
        std::map<Edge, int> uses;
        for (const Index3& f : mesh.facets)
            for (std::size_t k = 0; k < 3; ++k) ++uses[std::minmax(f[k], f[(k + 1) % 3])];
        for (std::size_t f = 0; f < mesh.facets.size(); ++f)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t g = mesh.neighbours[f][k];
                ASSERT_NE(g, kNoFacet) << "the boundary of a voxel set is closed";
                if (uses[std::minmax(mesh.facets[f][k], mesh.facets[f][(k + 1) % 3])] == 4) {
                    ASSERT_EQ(voxel[f], voxel[g]) << "round " << round;
                }
            }
    }
}

TEST(MeshWeld, UnevenEdgesLeaveTheRestWithoutPartner) {
    Context context({.threads = 1});
    const Vec3f a{0, 0, 0}, b{0, 0, 1};
    // Three facets at one edge, two of them the same way.
    const Mesh three = weld(context, Facets{{a, b, {1, 0, 0}}, {b, a, {0, 1, 0}}, {a, b, {-1, 0, 0}}});
    check_pairs(three);
    int alone = 0;
    for (std::size_t f = 0; f < 3; ++f) {
        const auto& v = three.facets[f];
        for (std::size_t k = 0; k < 3; ++k)
            if (v[k] + v[(k + 1) % 3] == 1) alone += three.neighbours[f][k] == kNoFacet;
    }
    EXPECT_EQ(alone, 1);
    // Two the same way find nobody.
    const Mesh two = weld(context, Facets{{a, b, {1, 0, 0}}, {a, b, {0, 1, 0}}});
    for (const Index3& n : two.neighbours) EXPECT_EQ(n, (Index3{kNoFacet, kNoFacet, kNoFacet}));
}

TEST(MeshWeld, FacetsWithEqualCornersKeepTheMeshClosed) {
    Context context({.threads = 1});
    Facets facets = shapes::box({0, 0, 0}, {1, 1, 1});
    facets.push_back({Vec3f{0, 0, 0}, {1, 0, 0}, {0, 0, 0}});
    facets.push_back({Vec3f{1, 1, 1}, {1, 1, 1}, {1, 1, 1}});
    const Mesh mesh = weld(context, facets);
    ASSERT_EQ(mesh.facets.size(), 14u);
    check_pairs(mesh);
    for (std::size_t f = 0; f < 12; ++f)
        for (const std::uint32_t g : mesh.neighbours[f]) EXPECT_NE(g, kNoFacet);
}

TEST(MeshWeldWithin, EqualsBruteForceClusters) {
    std::mt19937_64 random(test::seed());
    for (int round = 0; round < 200; ++round) {
        const double tolerance = std::pow(10.0, std::uniform_real_distribution(-3.0, 0.0)(random));
        const double size = tolerance * std::uniform_real_distribution(2.0, 12.0)(random);
        Facets facets(5 + random() % 100);
        for (auto& facet : facets)
            for (Vec3f& p : facet) {
                auto draw = [&] {
                    return static_cast<float>(std::uniform_real_distribution(-size, size)(random));
                };
                p = {draw(), draw(), draw()};
            }
        Context context({.threads = 1 + round % 3});
        const Mesh mesh = weld(context, facets);
        const std::size_t n = mesh.vertices.size();
        std::vector<std::uint32_t> lowest(n);
        for (std::uint32_t v = 0; v < n; ++v) lowest[v] = v;
        for (bool changed = true; changed;) {
            changed = false;
            for (std::size_t i = 0; i < n; ++i)
                for (std::size_t j = 0; j < i; ++j) {
                    const Vec3f &a = mesh.vertices[i], &b = mesh.vertices[j];
                    const double x = double(a.x) - b.x, y = double(a.y) - b.y, z = double(a.z) - b.z;
                    if (x * x + y * y + z * z >= tolerance * tolerance || lowest[i] == lowest[j]) continue;
                    lowest[i] = lowest[j] = std::min(lowest[i], lowest[j]);
                    changed = true;
                }
        }
        Facets merged;
        std::uint64_t removed = 0;
        for (const Index3& f : mesh.facets) {
            const std::uint32_t a = lowest[f[0]], b = lowest[f[1]], c = lowest[f[2]];
            if (a == b || b == c || c == a) ++removed;
            else merged.push_back({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]});
        }
        std::uint64_t gone = 0;
        for (std::uint32_t v = 0; v < n; ++v) gone += lowest[v] != v;
        const ToleranceWeld result = weld_within(context, mesh.view(), tolerance);
        EXPECT_EQ(result.merged, gone);
        EXPECT_EQ(result.removed_facets, removed);
        ASSERT_TRUE(same_bytes(result.mesh, weld(context, merged))) << "round " << round;
    }
}

TEST(MeshWeldWithin, SameBytesOnAnyNumberOfThreads) {
    const Facets facets = shapes::torus(250);
    Mesh first;
    for (const int threads : {1, 2, 4}) {
        Context context({.threads = threads});
        const Mesh mesh = weld(context, facets);
        ToleranceWeld result = weld_within(context, mesh.view(), 4.0);
        EXPECT_GT(result.merged, 1000u);
        EXPECT_LT(result.merged, mesh.vertices.size());
        if (threads == 1) first = std::move(result.mesh);
        else EXPECT_TRUE(same_bytes(result.mesh, first));
    }
}

TEST(MeshWeldWithin, RefusesTolerancesThatAreNone) {
    Context context({.threads = 1});
    const Mesh mesh = weld(context, shapes::box({0, 0, 0}, {1, 1, 1}));
    for (const double tolerance : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        try {
            static_cast<void>(weld_within(context, mesh.view(), tolerance));
            FAIL() << tolerance;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), "weld.tolerance");
        }
    }
}

}  // namespace
}  // namespace slabwright
