#include "kernels/mesh/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernels/errors.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/mesh/simplify_block.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"
#include "kernels/parallel/scratch_pool.h"

namespace slabwright {

namespace {

using simplifying::Face;
using simplifying::SimplifyBlock;
using simplifying::Task;
using simplifying::VertexBits;

constexpr std::size_t kBlockFacets = 1 << 15;    // that a block has on the average
constexpr std::uint64_t kDealtAtOnce = 1 << 24;  // facets, unless one block has more

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
    ScratchPool<SimplifyBlock> blocks;
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
                auto block = blocks.take([] { return std::make_unique<SimplifyBlock>(); });
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
