#include "io/read/placed_corners.h"

#include <algorithm>
#include <vector>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// Calls body(f, corners) for facets [begin, end) of one run of what a format says.
struct DecodedRuns {
    const DecodedMesh& decoded;
    std::vector<std::size_t> firsts;  ///< the first facet of each piece

    explicit DecodedRuns(const DecodedMesh& mesh) : decoded(mesh) {
        for (const std::vector<FileFacet>& piece : mesh.pieces) {
            firsts.push_back(count);
            count += piece.size();
        }
        count += mesh.records.count + mesh.facets.size();
    }
    std::size_t count = 0;

    template <class Body>
    void each(std::size_t begin, std::size_t end, Body&& body) const {
        if (decoded.records.count > 0) {
            for (std::size_t f = begin; f < end; ++f) {
                std::array<FileVertex, 3> corners;
                for (std::size_t c = 0; c < 3; ++c) {
                    const Vec3f p = decoded.records.corner(f, c);
                    corners[c] = {p.x, p.y, p.z};
                }
                body(f, corners);
            }
        } else if (!decoded.pieces.empty()) {
            std::size_t piece = static_cast<std::size_t>(
                std::upper_bound(firsts.begin(), firsts.end(), begin) - firsts.begin() - 1);
            for (std::size_t f = begin; f < end; ++f) {
                while (f - firsts[piece] >= decoded.pieces[piece].size()) ++piece;
                const FileFacet& p = decoded.pieces[piece][f - firsts[piece]];
                body(f,
                     std::array<FileVertex, 3>{{{p[0], p[1], p[2]}, {p[3], p[4], p[5]}, {p[6], p[7], p[8]}}});
            }
        } else {
            for (std::size_t f = begin; f < end; ++f) {
                const Index3& i = decoded.facets[f];
                body(f, std::array<FileVertex, 3>{
                            {decoded.vertices[i[0]], decoded.vertices[i[1]], decoded.vertices[i[2]]}});
            }
        }
    }
};

constexpr std::size_t kPlaceGrain = std::size_t{1} << 15;

}  // namespace

PlacedCorners place_corners(Context& context, const DecodedMesh& decoded, double mm_per_unit,
                            const AffineMap& map) {
    const DecodedRuns runs(decoded);
    const bool mapped = !map.is_identity();
    const auto place = [&](const FileVertex& p) {
        const FileVertex mm{p[0] * mm_per_unit, p[1] * mm_per_unit, p[2] * mm_per_unit};
        return mapped ? map.of(mm) : mm;
    };
    PlacedCorners corners;
    if (decoded.box && !mapped) {
        corners.min = place(decoded.box->min);
        corners.max = place(decoded.box->max);
    } else {
        const Extent box = parallel_reduce(
            context, runs.count, kPlaceGrain, Extent::none(),
            [&](std::size_t begin, std::size_t end) {
                Extent part = Extent::none();
                runs.each(begin, end, [&](std::size_t, const std::array<FileVertex, 3>& from) {
                    for (const FileVertex& p : from) part.add(place(p));
                });
                return part;
            },
            [](Extent a, const Extent& b) {
                a.merge(b);
                return a;
            });
        corners.min = box.min;
        corners.max = box.max;
    }
    const double lowest = corners.min[2];
    if (decoded.records.count > 0 && !mapped) {
        corners.facets = decoded.records;
        corners.facets.mm_per_unit = mm_per_unit;
        corners.facets.lowest_mm = lowest;
        return corners;
    }
    const bool mirrors = mapped && map.mirrors();
    corners.placed = RawArray<std::array<Vec3f, 3>>(runs.count);
    parallel_for(context, runs.count, kPlaceGrain, [&](std::size_t begin, std::size_t end) {
        runs.each(begin, end, [&](std::size_t f, const std::array<FileVertex, 3>& from) {
            for (std::size_t c = 0; c < 3; ++c) {
                const FileVertex p = place(from[mirrors && c > 0 ? 3 - c : c]);
                corners.placed[f][c] = {static_cast<float>(p[0]), static_cast<float>(p[1]),
                                        static_cast<float>(p[2] - lowest)};
            }
        });
    });
    corners.facets = {reinterpret_cast<const char*>(corners.placed.data()), runs.count};
    return corners;
}

}  // namespace slabwright
