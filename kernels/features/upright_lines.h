// Upright lines over a part, and where they cross its facets. Internal to features.
#pragma once

#include <algorithm>
#include <cstdint>
#include <tuple>
#include <vector>

#include "kernels/features/filled_columns.h"
#include "kernels/mesh/mesh.h"

namespace slabwright {

struct LineCrossing {
    std::uint32_t column, facet;
    double z;
    std::int32_t turns;  ///< what the winding number grows by, downwards
};

/// What a row's lines cross: as it is found, and by column.
struct RowCrossings {
    std::vector<LineCrossing> found, sorted;
    std::vector<std::uint32_t> ends;  ///< column c has [ends[c], ends[c + 1])

    void by_column(std::size_t columns);
};

/// Air straight under solid: between two bodies of it, or down to nothing.
struct AirUnder {
    std::uint32_t column = 0, facet = 0;  ///< the facet is its roof
    double roof = 0, floor = 0;
    bool has_floor = false;  ///< whether solid is under it; else `floor` means nothing
};

/// The lines of a grid, each facet listed in the rows that it may cross. Any row may be asked from any
/// thread.
class UprightLines {
public:
    UprightLines(MeshView mesh, const ColumnGrid& grid);

    /// Calls take(AirUnder) for all air under solid of a row: by column, and from above in each. The winding
    /// number tells solid from air.
    template <class Take>
    void air_under(std::size_t row, RowCrossings& scratch, Take&& take) const {
        cross_row(row, scratch);
        for (std::size_t column = 0; column < grid_.columns; ++column) {
            const auto begin = scratch.sorted.begin();
            auto c = begin + scratch.ends[column];
            const auto end = begin + scratch.ends[column + 1];
            std::sort(c, end, [](const LineCrossing& a, const LineCrossing& b) {
                return std::tie(b.z, a.facet) < std::tie(a.z, b.facet);
            });
            int winding = 0;
            for (; c != end; ++c) {
                winding += c->turns;
                if (winding != 0) continue;
                const bool last = c + 1 == end;
                take(AirUnder{c->column, c->facet, c->z, last ? 0.0 : (c + 1)->z, !last});
            }
        }
    }

private:
    void list_facets();
    void cross_row(std::size_t row, RowCrossings& of_row) const;
    void cross(std::uint32_t f, double y, std::vector<LineCrossing>& crossings) const;

    MeshView mesh_;
    ColumnGrid grid_;
    std::vector<std::size_t> starts_;  ///< of each row in entries_
    std::vector<std::uint32_t> entries_;
};

}  // namespace slabwright
