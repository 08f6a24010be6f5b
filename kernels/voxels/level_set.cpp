// Blocks of 8³ cells, the leaves of an OpenVDB tree: first those near the mesh, where OpenVDB gives the
// distance from it, then block by block along the border where that leaves the mesh. The sign comes from the
// winding number alone.
#include "kernels/voxels/level_set.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kernels/errors.h"
#include "kernels/parallel/confined.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr int kSide = 8;
constexpr int kCells = kSide * kSide * kSide;
constexpr int kPart = 4;  // cells along a part of a block that is looked at as a whole
constexpr int kPartCells = kPart * kPart * kPart;
constexpr float kBand = 3;        // cells beside the mesh whose distance is known
constexpr double kClearly = 0.2;  // so far from a half, the winding number is not near the border
constexpr double kSurely = 2.5;   // cells from a surface at a distance: beyond, OpenVDB tells the right side
constexpr double kBytesPerCell = 24;  // of a block, of the tree, and of the surface
constexpr double kAside = 0.4142;  // cells: no facet of a part that stands square lies on a cell, where its
                                   // sign would be chance

using BlockPlace = std::array<int, 3>;  ///< in blocks

struct BlockHash {
    std::size_t operator()(const BlockPlace& p) const {
        std::size_t h = 0;
        for (const int c : p) h = h * 1'000'003 + static_cast<std::size_t>(c + (1 << 20));
        return h;
    }
};

struct CellBlock {
    BlockPlace at{};
    std::array<float, kCells> winding;  ///< its absolute value
    std::array<float, kCells> value;    ///< cells from the border; negative within
};

int cell(int i, int j, int k) { return (i * kSide + j) * kSide + k; }

/// OpenVDB asks whether to go on.
class Interrupter final : public openvdb::util::NullInterrupter {
public:
    explicit Interrupter(Context& context) : context_(context) {}
    bool wasInterrupted(int /*percent*/ = -1) override { return context_.cancelled(); }

private:
    Context& context_;
};

/// How far cells lie from a mesh. OpenVDB is given its own kind of mesh, whose instance the library holds:
/// one of a kind of ours takes a compiler minutes. Points are rounded to floats, of cells as of millimetres
/// before.
/// @param out, in cells that are wanted on either side
openvdb::FloatGrid::Ptr distance_to(Context& context, MeshView mesh, double cell_mm,
                                    const std::array<double, 3>& origin, float out, float in, int flags = 0) {
    const MemoryCharge charge(
        context, mesh.vertices.size() * sizeof(openvdb::Vec3s) + mesh.facets.size() * sizeof(openvdb::Vec3I),
        "a mesh in cells");
    std::vector<openvdb::Vec3s> points(mesh.vertices.size());
    for (std::size_t v = 0; v < points.size(); ++v) {
        const Vec3f p = mesh.vertices[v];
        points[v] = {static_cast<float>((p.x - origin[0]) / cell_mm),
                     static_cast<float>((p.y - origin[1]) / cell_mm),
                     static_cast<float>((p.z - origin[2]) / cell_mm)};
    }
    std::vector<openvdb::Vec3I> facets(mesh.facets.size());
    for (std::size_t f = 0; f < facets.size(); ++f)
        facets[f] = {mesh.facets[f][0], mesh.facets[f][1], mesh.facets[f][2]};
    Interrupter interrupter(context);
    const auto identity = openvdb::math::Transform::createLinearTransform(1.0);
    auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        static_cast<openvdb::util::NullInterrupter&>(interrupter),
        openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I>(points, facets), *identity,
        out, in, flags);
    context.throw_if_cancelled();
    return grid;
}

/// Samples blocks, and finds which others are needed.
class Sampler {
public:
    Sampler(Context& context, const WindingField& winding, const LevelSetOptions& options,
            const std::array<double, 3>& origin, const openvdb::FloatGrid& distance)
        : context_(context), winding_(winding), options_(options), origin_(origin), distance_(distance) {
        std::vector<BlockPlace> first;
        for (auto leaf = distance.tree().cbeginLeaf(); leaf; ++leaf) {
            const openvdb::Coord o = leaf->origin();
            first.push_back({o.x() / kSide, o.y() / kSide, o.z() / kSide});
        }
        std::sort(first.begin(), first.end());
        for (std::vector<BlockPlace> fresh = std::move(first); !fresh.empty(); fresh = grow(fresh)) {
            context_.throw_if_cancelled();
            if ((places_.size() + fresh.size()) * kCells > options.most_cells)
                throw Error(ErrorKind::no_plan, "repair.cells",
                            "a surface of " + std::to_string(options.cell_mm) + " mm cells needs over " +
                                std::to_string(options.most_cells) + " cells",
                            "", "allow more memory (--memory), or close the largest holes before");
            sample(fresh);
        }
    }

    /// The blocks as a level set, cells apart from the border.
    openvdb::FloatGrid::Ptr grid() {
        settle_values();
        auto result = openvdb::FloatGrid::create(kBand);
        for (const auto& block : blocks_) {
            auto* leaf =
                result->tree().touchLeaf({block->at[0] * kSide, block->at[1] * kSide, block->at[2] * kSide});
            for (int c = 0; c < kCells; ++c)
                leaf->setValueOn(static_cast<openvdb::Index>(c), block->value[static_cast<std::size_t>(c)]);
        }
        openvdb::tools::signedFloodFill(result->tree());
        return result;
    }
    [[nodiscard]] bool anything_inside() const {
        return std::any_of(blocks_.begin(), blocks_.end(), [](const auto& block) {
            return std::any_of(block->winding.begin(), block->winding.end(),
                               [](float w) { return w >= 0.5f; });
        });
    }
    [[nodiscard]] std::size_t cells() const { return blocks_.size() * kCells; }

private:
    [[nodiscard]] double winding_at(const BlockPlace& block, double i, double j, double k) const {
        return std::abs(winding_({origin_[0] + (block[0] * kSide + i) * options_.cell_mm,
                                  origin_[1] + (block[1] * kSide + j) * options_.cell_mm,
                                  origin_[2] + (block[2] * kSide + k) * options_.cell_mm}));
    }

    void sample(const std::vector<BlockPlace>& fresh) {
        const std::size_t first = blocks_.size();
        for (const BlockPlace& at : fresh) {
            places_.emplace(at, blocks_.size());
            blocks_.push_back(std::make_unique<CellBlock>());
            blocks_.back()->at = at;
        }
        parallel_for(context_, fresh.size(), 8, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b) sample(*blocks_[first + b]);
        });
    }

    void sample(CellBlock& block) const {
        const auto* leaf =
            distance_.tree().probeConstLeaf({block.at[0] * kSide, block.at[1] * kSide, block.at[2] * kSide});
        for (int c = 0; c < kCells; ++c)
            block.value[static_cast<std::size_t>(c)] =
                leaf == nullptr ? kBand : leaf->getValue(static_cast<openvdb::Index>(c));
        for (int i = 0; i < kSide; i += kPart)
            for (int j = 0; j < kSide; j += kPart)
                for (int k = 0; k < kSide; k += kPart) sample_part(block, i, j, k);
    }

    /// Two cells side by side whose distances add up to more than one have no facet between them, so the
    /// winding number goes from one to the other without a step. It is asked at two cells of a region that is
    /// connected so, and of all of them only where it is near a half there or differs.
    void sample_part(CellBlock& block, int i0, int j0, int k0) const {
        std::array<std::int8_t, kPartCells> region;
        region.fill(-1);
        std::array<std::uint8_t, kPartCells> queue;
        for (int seed = 0; seed < kPartCells; ++seed) {
            if (region[static_cast<std::size_t>(seed)] >= 0) continue;
            std::size_t count = 0;
            const auto add = [&](int p) {
                region[static_cast<std::size_t>(p)] = 0;
                queue[count++] = static_cast<std::uint8_t>(p);
            };
            add(seed);
            for (std::size_t n = 0; n < count; ++n) {
                const int p = queue[n];
                const float mine = block.value[in_block(p, i0, j0, k0)];
                for (const int step : {1, kPart, kPart * kPart})
                    for (const int q : {p - step, p + step}) {
                        const bool beside =
                            q >= 0 && q < kPartCells && q / (step * kPart) == p / (step * kPart);
                        if (beside && region[static_cast<std::size_t>(q)] < 0 &&
                            mine + block.value[in_block(q, i0, j0, k0)] > 1)
                            add(q);
                    }
            }
            sample_region(block, std::span(queue).first(count), i0, j0, k0);
        }
    }

    static std::size_t in_block(int part_cell, int i0, int j0, int k0) {
        return static_cast<std::size_t>(
            cell(i0 + part_cell / (kPart * kPart), j0 + part_cell / kPart % kPart, k0 + part_cell % kPart));
    }

    void sample_region(CellBlock& block, std::span<const std::uint8_t> cells, int i0, int j0, int k0) const {
        const auto ask = [&](int p) {
            const int i = i0 + p / (kPart * kPart), j = j0 + p / kPart % kPart, k = k0 + p % kPart;
            return winding_at(block.at, i, j, k);
        };
        const double first = ask(cells.front()), last = cells.size() > 1 ? ask(cells.back()) : first;
        const bool clear = std::abs(first - 0.5) > kClearly && std::abs(first - last) < kClearly / 2;
        for (const std::uint8_t p : cells)
            block.winding[in_block(p, i0, j0, k0)] = static_cast<float>(clear ? first : ask(p));
    }

    /// Blocks that the border enters from those that were sampled last: a face between shows both sides, or
    /// two blocks beside one see it on different sides.
    std::vector<BlockPlace> grow(const std::vector<BlockPlace>& last) {
        std::vector<BlockPlace> fresh;
        for (const BlockPlace& at : last) {
            const CellBlock& block = *blocks_[places_.at(at)];
            for (std::size_t axis = 0; axis < 3; ++axis)
                for (const int side : {-1, 1}) {
                    BlockPlace beside = at;
                    beside[axis] += side;
                    if (places_.contains(beside)) continue;
                    const int inside = inside_on_face(block, axis, side);
                    const bool mixed = inside != 0 && inside != kSide * kSide;
                    const auto [known, is_new] = seen_.try_emplace(beside, inside != 0);
                    if (mixed || (!is_new && known->second != (inside != 0))) fresh.push_back(beside);
                }
        }
        std::sort(fresh.begin(), fresh.end());
        fresh.erase(std::unique(fresh.begin(), fresh.end()), fresh.end());
        return fresh;
    }

    static int inside_on_face(const CellBlock& block, std::size_t axis, int side) {
        int inside = 0;
        const int fixed = side < 0 ? 0 : kSide - 1;
        for (int a = 0; a < kSide; ++a)
            for (int b = 0; b < kSide; ++b) {
                const int c = axis == 0   ? cell(fixed, a, b)
                              : axis == 1 ? cell(a, fixed, b)
                                          : cell(a, b, fixed);
                inside += block.winding[static_cast<std::size_t>(c)] >= 0.5f ? 1 : 0;
            }
        return inside;
    }

    /// The winding number of a cell that may lie in a block beside; of one that is not there the cell's own.
    [[nodiscard]] float winding_near(const CellBlock& block, int i, int j, int k, float own) const {
        BlockPlace at = block.at;
        int* const places[] = {&i, &j, &k};
        bool here = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            int& c = *places[axis];
            if (c < 0) --at[axis], c += kSide, here = false;
            else if (c >= kSide) ++at[axis], c -= kSide, here = false;
        }
        if (here) return block.winding[static_cast<std::size_t>(cell(i, j, k))];
        const auto found = places_.find(at);
        return found == places_.end()
                   ? own
                   : blocks_[found->second]->winding[static_cast<std::size_t>(cell(i, j, k))];
    }

    /// From distances to values: near the mesh the distance, elsewhere what the winding number tells by its
    /// slope; the sign is the winding number's.
    void settle_values() {
        parallel_for(context_, blocks_.size(), 8, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b) {
                CellBlock& block = *blocks_[b];
                for (int i = 0; i < kSide; ++i)
                    for (int j = 0; j < kSide; ++j)
                        for (int k = 0; k < kSide; ++k) settle(block, i, j, k);
            }
        });
    }

    void settle(CellBlock& block, int i, int j, int k) const {
        constexpr float least = 1e-3f;  // cells: no value is 0, which has no side
        const auto c = static_cast<std::size_t>(cell(i, j, k));
        const float own = block.winding[c];
        float away = block.value[c];
        if (away > 1) {
            float steepest = 0;
            for (const int d : {-1, 1})
                for (const auto& [di, dj, dk] : {std::tuple{d, 0, 0}, {0, d, 0}, {0, 0, d}})
                    steepest =
                        std::max(steepest, std::abs(winding_near(block, i + di, j + dj, k + dk, own) - own));
            if (steepest > 0) away = std::min(away, std::abs(own - 0.5f) / steepest);
        }
        away = std::clamp(away, least, kBand);
        block.value[c] = own >= 0.5f ? -away : away;
    }

    Context& context_;
    const WindingField& winding_;
    const LevelSetOptions& options_;
    std::array<double, 3> origin_;
    const openvdb::FloatGrid& distance_;
    std::vector<std::unique_ptr<CellBlock>> blocks_;
    std::unordered_map<BlockPlace, std::size_t, BlockHash> places_;
    std::unordered_map<BlockPlace, bool, BlockHash> seen_;  // not sampled: whether it lies within
};

/// The surface where a grid has a value, facets outwards.
/// @param adaptivity how far facets of flat places may grow, 0 to 1
Mesh surface_at(Context& context, const openvdb::FloatGrid& grid, double value, double adaptivity,
                const std::array<double, 3>& origin, double cell_mm) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(grid, points, triangles, quads, value, adaptivity);
    context.throw_if_cancelled();
    Mesh mesh;
    mesh.vertices.reserve(points.size());
    for (const openvdb::Vec3s& p : points)
        mesh.vertices.push_back({static_cast<float>(origin[0] + cell_mm * static_cast<double>(p.x())),
                                 static_cast<float>(origin[1] + cell_mm * static_cast<double>(p.y())),
                                 static_cast<float>(origin[2] + cell_mm * static_cast<double>(p.z()))});
    mesh.facets.reserve(2 * quads.size() + triangles.size());
    for (const openvdb::Vec4I& v : quads) {
        mesh.facets.push_back({v[0], v[2], v[1]});
        mesh.facets.push_back({v[0], v[3], v[2]});
    }
    for (const openvdb::Vec3I& v : triangles) mesh.facets.push_back({v[0], v[2], v[1]});
    return mesh;
}

}  // namespace

Mesh surface_of_winding(Context& context, MeshView near, const WindingField& winding,
                        const LevelSetOptions& options) {
    if (near.facets.empty()) return {};
    const Box3 box = bounds(context, near);
    const std::array<double, 3> origin{box.min.x - kAside * options.cell_mm,
                                       box.min.y - kAside * options.cell_mm,
                                       box.min.z - kAside * options.cell_mm};
    Mesh result;
    // OpenVDB's own parallelism stays within the context's threads.
    run_confined(context, [&] {
        const auto distance = distance_to(context, near, options.cell_mm, origin, kBand, kBand,
                                          openvdb::tools::UNSIGNED_DISTANCE_FIELD);
        const auto about = static_cast<std::uint64_t>(static_cast<double>(distance->tree().leafCount()) *
                                                      kCells * kBytesPerCell);
        const MemoryCharge charge(context, about, "the cells of a rebuilt surface");
        Sampler sampler(context, winding, options, origin, *distance);
        if (!sampler.anything_inside()) return;
        result = surface_at(context, *sampler.grid(), 0, options.adaptivity, origin, options.cell_mm);
    });
    return result;
}

Mesh offset_surface(Context& context, MeshView mesh, const DistanceField& distance,
                    const OffsetSurfaceOptions& options) {
    const Box3 box = bounds(context, mesh);
    const double cell = options.cell_mm, cells_out = options.distance_mm / cell;
    const std::array<double, 3> origin{double{box.min.x} - kAside * cell, double{box.min.y} - kAside * cell,
                                       double{box.min.z} - kAside * cell};
    Mesh result;
    run_confined(context, [&] {
        const auto grid =
            distance_to(context, mesh, cell, origin, static_cast<float>(cells_out) + kBand, kBand);
        std::vector<openvdb::FloatGrid::TreeType::LeafNodeType*> leaves;
        grid->tree().getNodes(leaves);
        parallel_for(context, leaves.size(), 8, [&](std::size_t begin, std::size_t end) {
            context.throw_if_cancelled();
            for (std::size_t l = begin; l < end; ++l)
                for (auto value = leaves[l]->beginValueOn(); value; ++value) {
                    if (std::abs(static_cast<double>(*value) - cells_out) > kSurely) continue;
                    const openvdb::Coord at = value.getCoord();
                    value.setValue(
                        static_cast<float>(distance({origin[0] + cell * at.x(), origin[1] + cell * at.y(),
                                                     origin[2] + cell * at.z()}) /
                                           cell));
                }
        });
        result = surface_at(context, *grid, cells_out, 0, origin, cell);
    });
    return result;
}

}  // namespace slabwright
