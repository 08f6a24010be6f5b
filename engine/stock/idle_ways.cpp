#include "engine/stock/idle_ways.h"

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "kernels/parallel/parallel.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

namespace {

constexpr int kBand = 128;       // rows of cells that one task looks at
constexpr float kTakes = 1e-3F;  // mm: what takes off less cuts nothing
constexpr double kWider = 0.75;  // of a cell: past half of its diagonal
// Of a cell: beside slopes up to 60° the part stands no higher over so much wider a cutter. On those what is
// left is seen, however thin: it lies over the centres of cells.
constexpr double kSteep = 2 * kWider;

// A cutter that covers all that one covers which stands up to `more` mm beside it.
CutterShape wider(const CutterShape& cutter, double more) {
    CutterShape wide = cutter;
    wide.radius += more;
    if (wide.corner > 0) wide.corner += more;
    return wide;
}

struct Lowers {
    float* height;
    void operator()(std::size_t cell, double z) {
        height[cell] = std::min(height[cell], static_cast<float>(std::max(0.0, z)));
    }
};

// What is over the cells that are swept.
struct Over {
    const LayerStock& stock;
    const float* height;
    std::size_t first;  // of these heights in the stock
    double limit, steep;
    bool more = false;  // more than the limit is left
    bool wall = false;  // the part stands higher than the cutter by more than beside a slope
    [[nodiscard]] bool enough() const { return more; }
    void operator()(std::size_t cell, double z) {
        const std::size_t c = first + cell;
        more = more || static_cast<double>((height[cell] - stock.surface(c)) * stock.nz(c)) > limit;
        wall = wall || static_cast<double>(stock.surface(c)) - z > steep;
    }
};

}  // namespace

std::vector<char> which_cut(Context& context, const LayerStock& stock, const CutterShape& cutter,
                            std::span<const StraightPiece> pieces, double limit) {
    std::vector<char> cuts(pieces.size(), 0);
    const CellGrid& grid = stock.grid();
    const CutterEnd end = cutter_end(cutter), wide = cutter_end(wider(cutter, kWider * grid.cell));
    std::vector<float> heights(stock.heights().begin(), stock.heights().end());
    const auto hides = [&](const StraightPiece& piece) {
        const auto [x0, x1] = std::minmax(piece.from[0], piece.to[0]);
        const auto [y0, y1] = std::minmax(piece.from[1], piece.to[1]);
        const double r = wide.radius;
        return stock.may_hide_remains({x0 - r, y0 - r}, {x1 + r, y1 + r});
    };
    const int bands = (grid.ny + kBand - 1) / kBand;
    parallel_each(context, static_cast<std::size_t>(bands), [&](std::size_t band) {
        const int first = static_cast<int>(band) * kBand, rows = std::min(kBand, grid.ny - first);
        const CellGrid part{grid.x0, grid.y(first), grid.cell, grid.nx, rows};
        const double y0 = part.y0 - wide.radius, y1 = part.y(rows - 1) + wide.radius;
        float* const height = heights.data() + grid.index(0, first);
        const StandingHeights standing{height, 0};
        // Where a piece goes on from the one before, what the cutter covers there is known: looked at, with
        // nothing to do, or taken away.
        enum class Known { nothing, idle, cut } known = Known::nothing;
        std::size_t next = 0;
        for (std::size_t p = 0; p < pieces.size(); ++p) {
            std::array<double, 3> from = pieces[p].from, to = pieces[p].to;
            if (std::max(from[1], to[1]) < y0 || std::min(from[1], to[1]) > y1) continue;
            from[2] -= stock.z_bottom();
            to[2] -= stock.z_bottom();
            if (p != next || p == 0 || pieces[p].from != pieces[p - 1].to) known = Known::nothing;
            next = p + 1;
            Over over{stock, height, grid.index(0, first), limit, kSteep * grid.cell};
            sweep_above(part, wide, from, to, standing, over, {.been = known == Known::idle});
            if (!over.more && !(over.wall && hides(pieces[p]))) {
                known = over.wall ? Known::nothing : Known::idle;
                continue;
            }
            // Of a piece that several bands know, any may say so.
            std::atomic_ref(cuts[p]).store(1, std::memory_order_relaxed);
            Lowers lowers{height};
            sweep_above(part, end, from, to, standing, lowers, {.been = known == Known::cut});
            known = Known::cut;
        }
    });
    return cuts;
}

}  // namespace slabwright
