#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "kernels/errors.h"
#include "kernels/mesh/clusters.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// A vertex in the cell of a grid.
struct Cell {
    std::int64_t x, y, z;
    std::uint32_t vertex;
};

bool before(const Cell& a, const Cell& b) {
    return std::tie(a.x, a.y, a.z, a.vertex) < std::tie(b.x, b.y, b.z, b.vertex);
}

double distance_squared(const Vec3f& a, const Vec3f& b) {
    const double x = double(a.x) - b.x, y = double(a.y) - b.y, z = double(a.z) - b.z;
    return x * x + y * y + z * z;
}

}  // namespace

ToleranceWeld weld_within(Context& context, MeshView mesh, double tolerance_mm) {
    if (!(tolerance_mm > 0) || !std::isfinite(tolerance_mm))
        throw Error(ErrorKind::usage, "weld.tolerance", "the weld tolerance must be a positive length",
                    "--weld", "give millimetres, e.g. --weld 0.001");
    const std::size_t n = mesh.vertices.size();
    const MemoryCharge charge(context,
                              std::uint64_t{n} * (2 * sizeof(Cell) + 8) + mesh.size() * sizeof(Index3),
                              "welding within a tolerance");

    // Cells are a little wider than the tolerance, so that rounding cannot put near vertices two cells apart.
    constexpr std::size_t grain = std::size_t{1} << 14;
    const double width = tolerance_mm * 1.000001;
    auto cell_of =
        [&](float coordinate) {  // the clamp only matters where float32 is coarser than the tolerance anyway
            return static_cast<std::int64_t>(
                std::clamp(std::floor(static_cast<double>(coordinate) / width), -4e18, 4e18));
        };
    RawArray<Cell> cells(n);
    std::vector<std::uint32_t> lowest(n);
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const Vec3f& p = mesh.vertices[v];
            cells[v] = {cell_of(p.x), cell_of(p.y), cell_of(p.z), static_cast<std::uint32_t>(v)};
            lowest[v] = static_cast<std::uint32_t>(v);
        }
    });
    parallel_sort(context, cells.data(), cells.data() + n, before);

    // Each vertex meets those of its own cell and of the cells after it; in sorted order these are five runs,
    // (x, y) and (x, y + 1), (x + 1, y − 1 … y + 1), each over z − 1 … z + 1, and each run's start only moves
    // forward.
    constexpr std::array<std::array<int, 2>, 5> rows{{{0, 0}, {0, 1}, {1, -1}, {1, 0}, {1, 1}}};
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        std::array<std::size_t, 5> starts;
        for (std::size_t r = 0; r < rows.size(); ++r) {
            const Cell& c = cells[begin];
            const Cell target{c.x + rows[r][0], c.y + rows[r][1], c.z - 1, 0};
            starts[r] = static_cast<std::size_t>(
                std::lower_bound(cells.data(), cells.data() + n, target, before) - cells.data());
        }
        for (std::size_t i = begin; i < end; ++i) {
            const Cell& c = cells[i];
            for (std::size_t r = 0; r < rows.size(); ++r) {
                const Cell target{c.x + rows[r][0], c.y + rows[r][1], c.z - 1, 0};
                std::size_t& start = starts[r];
                while (start < n && before(cells[start], target)) ++start;
                for (std::size_t j = r == 0 ? i + 1 : start; j < n; ++j) {
                    const Cell& d = cells[j];
                    if (d.x != target.x || d.y != target.y || d.z > c.z + 1) break;
                    if (distance_squared(mesh.vertices[c.vertex], mesh.vertices[d.vertex]) <
                        tolerance_mm * tolerance_mm)
                        join_clusters(lowest, c.vertex, d.vertex);
                }
            }
        }
    });
    cells = {};

    ToleranceWeld result;
    result.merged = parallel_reduce(
        context, n, grain, std::uint64_t{0},
        [&](std::size_t begin, std::size_t end) {
            std::uint64_t count = 0;
            for (std::size_t v = begin; v < end; ++v)
                count += cluster_root(lowest, static_cast<std::uint32_t>(v)) != v;
            return count;
        },
        [](std::uint64_t a, std::uint64_t b) { return a + b; });

    // Facets that kept three different corners stay, in their order.
    BulkVector<Index3>& facets = result.mesh.facets;
    facets.reserve(mesh.size());
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        if (f % grain == 0) context.throw_if_cancelled();
        const Index3& old = mesh.facets[f];
        const Index3 now{cluster_root(lowest, old[0]), cluster_root(lowest, old[1]),
                         cluster_root(lowest, old[2])};
        if (now[0] == now[1] || now[1] == now[2] || now[2] == now[0]) ++result.removed_facets;
        else facets.push_back(now);
    }
    // Vertices are numbered by first use again, and those that only lost facets used go.
    std::vector<std::uint32_t> number(n, 0xFFFFFFFFu);
    for (Index3& facet : facets) {
        for (std::uint32_t& v : facet) {
            if (number[v] == 0xFFFFFFFFu) {
                number[v] = static_cast<std::uint32_t>(result.mesh.vertices.size());
                result.mesh.vertices.push_back(mesh.vertices[v]);
            }
            v = number[v];
        }
    }
    pair_edges(context, result.mesh);
    return result;
}

}  // namespace slabwright
