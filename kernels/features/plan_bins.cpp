#include "kernels/features/plan_bins.h"

#include <array>
#include <atomic>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {
constexpr std::size_t kGrain = 2048;
constexpr double kSlack =
    1e-5;  // mm: cells reach this far past their border, so that rounding hides no facet
}  // namespace

// A facet is listed row by row, over the columns that its part in that row spans: a long diagonal facet costs
// the cells it crosses, not those of its bounding box.
template <class F>
void PlanBins::cover(MeshView mesh, std::uint32_t facet, F&& f) const {
    std::array<double, 3> x{}, y{};
    for (int k = 0; k < 3; ++k) {
        x[k] = mesh.vertices[mesh.facets[facet][k]].x;
        y[k] = mesh.vertices[mesh.facets[facet][k]].y;
    }
    const std::size_t r0 = row(std::min({y[0], y[1], y[2]}) - kSlack),
                      r1 = row(std::max({y[0], y[1], y[2]}) + kSlack);
    for (std::size_t r = r0; r <= r1; ++r) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        const double bottom = r == r0 ? -HUGE_VAL : y0_ + static_cast<double>(r) * cell_ - kSlack;
        const double top = r == r1 ? HUGE_VAL : y0_ + static_cast<double>(r + 1) * cell_ + kSlack;
        for (int k = 0; k < 3; ++k) {
            const double ya = y[k], yb = y[(k + 1) % 3], xa = x[k], xb = x[(k + 1) % 3];
            if (std::max(ya, yb) < bottom || std::min(ya, yb) > top) continue;
            auto at = [&](double level) {
                return ya == yb ? xa : xa + (xb - xa) * ((level - ya) / (yb - ya));
            };
            for (const auto& [px, py] : {std::pair{xa, ya}, std::pair{xb, yb}}) {
                const double clipped = py < bottom ? at(bottom) : py > top ? at(top) : px;
                low = std::min(low, clipped);
                high = std::max(high, clipped);
            }
        }
        if (low > high) continue;
        const std::size_t c0 = column(low - kSlack), c1 = column(high + kSlack);
        for (std::size_t c = c0; c <= c1; ++c) f(r * columns_ + c);
    }
}

PlanBins::PlanBins(Context& context, MeshView mesh, std::span<const std::uint32_t> facets) {
    struct Rect {
        double x0 = HUGE_VAL, y0 = HUGE_VAL, x1 = -HUGE_VAL, y1 = -HUGE_VAL;
    };
    const Rect rect = parallel_reduce(
        context, facets.size(), kGrain, Rect{},
        [&](std::size_t begin, std::size_t end) {
            Rect r;
            for (std::size_t i = begin; i < end; ++i)
                for (const std::uint32_t v : mesh.facets[facets[i]]) {
                    const Vec3f& p = mesh.vertices[v];
                    r = {std::min<double>(r.x0, p.x), std::min<double>(r.y0, p.y),
                         std::max<double>(r.x1, p.x), std::max<double>(r.y1, p.y)};
                }
            return r;
        },
        [](Rect a, Rect b) {
            return Rect{std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1),
                        std::max(a.y1, b.y1)};
        });
    if (facets.empty()) {
        starts_.assign(2, 0);
        return;
    }
    x0_ = rect.x0;
    y0_ = rect.y0;
    x1_ = rect.x1;
    y1_ = rect.y1;
    const double width = std::max(x1_ - x0_, 1e-3), depth = std::max(y1_ - y0_, 1e-3);
    std::size_t wanted = std::clamp<std::size_t>(facets.size(), 1, std::size_t{1} << 24);
    for (;; wanted = std::max<std::size_t>(1, wanted / 4)) {
        cell_ =
            std::max(std::sqrt(width * depth / static_cast<double>(wanted)), std::max(width, depth) / 8192);
        if (wanted == 1) cell_ = std::max(width, depth);  // at most four cells, whatever the facets
        columns_ = static_cast<std::size_t>(width / cell_) + 1;
        rows_ = static_cast<std::size_t>(depth / cell_) + 1;
        starts_.assign(columns_ * rows_ + 1, 0);
        std::atomic<std::uint64_t> total{0};
        const std::uint64_t limit = 8 * facets.size() + 4096;
        parallel_for(context, facets.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            std::uint64_t mine = 0;
            for (std::size_t i = begin; i < end && total.load(std::memory_order_relaxed) + mine <= limit; ++i)
                cover(mesh, facets[i], [&](std::size_t c) {
                    std::atomic_ref(starts_[c]).fetch_add(1, std::memory_order_relaxed);
                    ++mine;
                });
            total.fetch_add(mine, std::memory_order_relaxed);
        });
        if (total.load() <= limit || wanted == 1) break;
    }
    // Counts become ends; filling moves every end down to its start.
    std::uint32_t sum = 0;
    for (std::uint32_t& s : starts_) s = sum += s;
    entries_.resize(sum);
    parallel_for(context, facets.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            cover(mesh, facets[i], [&](std::size_t c) {
                entries_[std::atomic_ref(starts_[c]).fetch_sub(1, std::memory_order_relaxed) - 1] =
                    static_cast<std::uint32_t>(i);
            });
    });
    // Threads filled the lists in any order; sorted, they are the same on any number of threads.
    parallel_for(context, columns_ * rows_, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c)
            std::sort(entries_.begin() + static_cast<std::ptrdiff_t>(starts_[c]),
                      entries_.begin() + static_cast<std::ptrdiff_t>(starts_[c + 1]));
    });
}

}  // namespace slabwright
