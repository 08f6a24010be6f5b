// Facets by their place in plan: a grid of square cells, each with the facets whose projection meets it.
// Internal to features.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

class PlanBins {
public:
    /// Indexes `facets`; entries are positions in that list. About as many cells as facets, fewer where long
    /// facets would make the lists longer than a few entries a facet. Deterministic.
    PlanBins(Context& context, MeshView mesh, std::span<const std::uint32_t> facets);

    /// Calls f(position) for all that lies in the cells which the box meets; positions of several cells come
    /// repeatedly.
    template <class F>
    void visit(double x0, double y0, double x1, double y1, F&& f) const {
        if (x1 < x0_ || y1 < y0_ || x0 > x1_ || y0 > y1_) return;
        const std::size_t c0 = column(x0), c1 = column(x1), r0 = row(y0), r1 = row(y1);
        for (std::size_t r = r0; r <= r1; ++r)
            for (std::size_t c = c0; c <= c1; ++c)
                for (std::uint32_t e = starts_[r * columns_ + c]; e < starts_[r * columns_ + c + 1]; ++e)
                    f(entries_[e]);
    }

    [[nodiscard]] double cell() const noexcept { return cell_; }

private:
    [[nodiscard]] std::size_t column(double x) const { return place(x - x0_, columns_); }
    [[nodiscard]] std::size_t row(double y) const { return place(y - y0_, rows_); }
    [[nodiscard]] std::size_t place(double d, std::size_t n) const {
        if (!(d > 0)) return 0;
        const double i = d / cell_;
        return i >= static_cast<double>(n) ? n - 1 : static_cast<std::size_t>(i);
    }
    template <class F>
    void cover(MeshView mesh, std::uint32_t facet, F&& f) const;

    double x0_ = 0, y0_ = 0, x1_ = 0, y1_ = 0, cell_ = 1;
    std::size_t columns_ = 1, rows_ = 1;
    std::vector<std::uint32_t> starts_, entries_;
};

}  // namespace slabwright
