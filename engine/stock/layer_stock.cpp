#include "engine/stock/layer_stock.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr int kBand = 2 * KeptTiles::kTile;  // rows of cells that one task cuts
constexpr std::size_t kBlock = 128;          // moves that share one box
constexpr std::size_t kPart = 16;            // of those

struct Box {
    double x0 = kUnbounded, x1 = -kUnbounded, y0 = kUnbounded, y1 = -kUnbounded, z0 = kUnbounded;
    void add(const Move& m) {
        x0 = std::min(x0, to_mm(m.x));
        x1 = std::max(x1, to_mm(m.x));
        y0 = std::min(y0, to_mm(m.y));
        y1 = std::max(y1, to_mm(m.y));
        z0 = std::min(z0, to_mm(m.z));
    }
    void add(const Box& b) {
        x0 = std::min(x0, b.x0);
        x1 = std::max(x1, b.x1);
        y0 = std::min(y0, b.y0);
        y1 = std::max(y1, b.y1);
        z0 = std::min(z0, b.z0);
    }
};

// Of each part of kPart moves, with where it begins.
std::vector<Box> boxes_of_parts(const std::vector<Move>& moves) {
    std::vector<Box> parts((moves.size() + kPart - 1) / kPart);
    for (std::size_t i = 0; i < moves.size(); ++i) {
        parts[i / kPart].add(moves[i]);
        if (i % kPart == 0 && i > 0) parts[i / kPart].add(moves[i - 1]);
    }
    return parts;
}

// Lowers cells of a band of rows.
struct Lowering {
    float* height;
    std::size_t nx;
    void operator()(std::size_t cell, double z) {
        height[cell] = std::min(height[cell], static_cast<float>(std::max(0.0, z)));
    }
    void row(std::size_t first, int n, const double* h, double /*lowest*/) { lower_to(height + first, n, h); }
    void spans(std::size_t first, int rows, const RowSpans& s, double z) {
        lower_spans(height + first, nx, rows, s, z);
    }
};

// What stands at most in the tiles of a band of rows: a bound, as near as kStale cuts of a tile ago.
class TileTops {
public:
    TileTops(const float* height, const CellGrid& band)
        : height_(height),
          band_(band),
          nx_((band.nx + kTile - 1) / kTile),
          tops_(static_cast<std::size_t>(nx_) * static_cast<std::size_t>((band.ny + kTile - 1) / kTile),
                std::numeric_limits<float>::infinity()),
          cuts_(tops_.size(), kStale) {}

    // Whether anything may stand over a level within a rectangle, mm, of the band; if so it counts as cut.
    // `cells` gets the columns and the rows of its cells.
    [[nodiscard]] bool cut_over(double x0, double x1, double y0, double y1, double level,
                                std::array<int, 4>& cells) {
        const int i0 = tile((x0 - band_.x0) / band_.cell, band_.nx),
                  i1 = tile((x1 - band_.x0) / band_.cell, band_.nx);
        const int j0 = tile((y0 - band_.y0) / band_.cell, band_.ny),
                  j1 = tile((y1 - band_.y0) / band_.cell, band_.ny);
        cells = {i0 * kTile, std::min((i1 + 1) * kTile, band_.nx) - 1, j0 * kTile,
                 std::min((j1 + 1) * kTile, band_.ny) - 1};
        const bool over = any_over(i0, i1, j0, j1, level);
        for (int j = j0; j <= j1 && over; ++j)
            for (int i = i0; i <= i1; ++i) {
                std::uint8_t& cuts = cuts_[index(i, j)];
                if (cuts < kStale) ++cuts;
            }
        return over;
    }
    // Whether anything may stand over a level where a cutter comes that stays within a box.
    [[nodiscard]] bool any_over(const Box& box, double radius, double level) {
        return any_over(tile((box.x0 - radius - band_.x0) / band_.cell, band_.nx),
                        tile((box.x1 + radius - band_.x0) / band_.cell, band_.nx),
                        tile((box.y0 - radius - band_.y0) / band_.cell, band_.ny),
                        tile((box.y1 + radius - band_.y0) / band_.cell, band_.ny), level);
    }

private:
    static constexpr int kTile = 16;  // cells
    static constexpr std::uint8_t kStale = 4;

    [[nodiscard]] bool any_over(int i0, int i1, int j0, int j1, double level) {
        const float most =
            std::max(0.0F, static_cast<float>(level));  // no height that is lowered to it gets under this
        for (int j = j0; j <= j1; ++j) {
            // By what was known last, which nothing has come to stand over since: many tiles at once.
            const float* const known = tops_.data() + index(0, j);
            int over = 0;
            for (int i = i0; i <= i1; ++i) over |= static_cast<int>(known[i] > most);
            for (int i = i0; i <= i1 && over != 0; ++i)
                if (known[i] > most && stands_over(i, j, most)) return true;
        }
        return false;
    }

    static int tile(double cell, int cells) {
        return static_cast<int>(std::clamp(cell, 0.0, static_cast<double>(cells - 1))) / kTile;
    }
    [[nodiscard]] std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(i);
    }
    [[nodiscard]] bool stands_over(int i, int j, float level) {
        float& top = tops_[index(i, j)];
        std::uint8_t& cuts = cuts_[index(i, j)];
        if (cuts == kStale) {
            const int first = std::max(0, std::min(i * kTile, band_.nx - kTile)),
                      n = std::min(kTile, band_.nx);
            const int row = j * kTile;
            top = highest_of(height_ + band_.index(first, row), static_cast<std::size_t>(band_.nx), n,
                             std::min(kTile, band_.ny - row));
            cuts = 0;
        }
        return top > level;
    }

    const float* height_;
    CellGrid band_;
    int nx_;
    std::vector<float> tops_;
    std::vector<std::uint8_t> cuts_;
};

}  // namespace

KeptTiles::KeptTiles(const CellGrid& grid, BulkVector<float> memory)
    : nx_(grid.nx),
      ny_(grid.ny),
      tiles_x_(static_cast<std::size_t>((nx_ + kTile - 1) / kTile)),
      is_kept_(tiles_x_ * static_cast<std::size_t>((ny_ + kTile - 1) / kTile), 0),
      memory_(std::move(memory)) {}

void KeptTiles::keep(const float* height, int i0, int i1, int j0, int j1) {
    for (int tj = j0 / kTile; tj <= j1 / kTile; ++tj)
        for (int ti = i0 / kTile; ti <= i1 / kTile; ++ti) {
            const std::size_t t = static_cast<std::size_t>(tj) * tiles_x_ + static_cast<std::size_t>(ti);
            if (is_kept_[t] != 0) continue;
            make_room();
            is_kept_[t] = 1;
            const int n = std::min(kTile, nx_ - ti * kTile);
            float* kept = memory_.data() + t * kCells;
            for (int j = tj * kTile; j < std::min(ny_, (tj + 1) * kTile); ++j, kept += kTile)
                std::copy_n(height + static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_) +
                                static_cast<std::size_t>(ti) * kTile,
                            n, kept);
        }
}

void KeptTiles::add(int tile_row, const KeptTiles& row) {
    for (std::size_t i = 0; i < row.is_kept_.size(); ++i) {
        const std::size_t t = static_cast<std::size_t>(tile_row) * tiles_x_ + i;
        if (row.is_kept_[i] == 0 || is_kept_[t] != 0) continue;
        is_kept_[t] = 1;
        std::copy_n(row.memory_.data() + i * kCells, kCells, memory_.data() + t * kCells);
    }
}

void KeptTiles::add(const KeptTiles& later) {
    make_room();
    add(0, later);
}

void KeptTiles::put_back(float* height) const {
    rows([&](const float* kept, std::size_t first, int n) { std::copy_n(kept, n, height + first); });
}

LayerStock::Trial::~Trial() {
    if (over_) return;
    if (outer_ != nullptr) outer_->kept_.add(kept_);
    end();
}

void LayerStock::Trial::undo() {
    kept_.put_back(stock_.memory_.height.data());
    end();
}

void LayerStock::Trial::end() {
    over_ = true;
    stock_.trial_ = outer_;
    stock_.memory_.kept = kept_.release();
}

std::vector<double> rows_of(const CellGrid& grid) {
    std::vector<double> y;
    for (int j = 0; j < grid.ny; ++j) y.push_back(to_units(grid.y(j)));
    return y;
}

namespace {

double cell_for(double finest, double cusp, double plane) {
    return std::clamp(std::max(std::sqrt(2 * (finest / 2) * cusp) / 2, std::sqrt(plane / kStockCells)), 0.05,
                      1.0);
}

}  // namespace

double stock_cell(const LayerJob& layer) {
    double finest = layer.tools.finish.diameter;
    for (const Tool& tool : layer.tools.rest)
        if (has_ball_tip(tool.kind)) finest = std::min(finest, tip_diameter(tool));
    const double width = layer.stock_max[0] - layer.stock_min[0],
                 depth = layer.stock_max[1] - layer.stock_min[1];
    return cell_for(finest, layer.job->tolerances.cusp, width * depth);
}

std::uint64_t LayerStock::bytes(const Job& job, double plane_mm2) {
    double finest = kUnbounded;
    for (const Tool& tool : job.tools)
        if (has_ball_tip(tool.kind)) finest = std::min(finest, tip_diameter(tool));
    const double cell = cell_for(finest, job.tolerances.cusp, plane_mm2);
    return static_cast<std::uint64_t>(13 * plane_mm2 / (cell * cell));
}

LayerStock::LayerStock(Context& context, const LayerJob& layer, const LayerSolid& solid, double cell,
                       StockMemory memory)
    : z_bottom_(layer.z_bottom), z_top_(layer.z_top), memory_(std::move(memory)) {
    const auto &lo = layer.stock_min, &hi = layer.stock_max;
    grid_ = {lo[0] + cell / 2, lo[1] + cell / 2, cell,
             std::max(1, static_cast<int>(std::ceil((hi[0] - lo[0]) / cell - 0.5))),
             std::max(1, static_cast<int>(std::ceil((hi[1] - lo[1]) / cell - 0.5)))};
    const double top = layer.z_top - z_bottom_;
    // Cleared first, so that nothing is copied where there must be more room.
    memory_.height.clear();
    memory_.height.resize(grid_.count());
    memory_.surface.clear();
    memory_.surface.resize(grid_.count());
    memory_.nz.clear();
    memory_.nz.resize(grid_.count());
    float* const surface = memory_.surface.data();
    std::uint8_t* const nz = memory_.nz.data();
    words_ = static_cast<std::size_t>((grid_.nx + kWord - 1) / kWord);
    most_left_.assign(words_ * static_cast<std::size_t>(grid_.ny), std::numeric_limits<float>::infinity());
    // Facets by the bands of rows that they meet, so that bands can be drawn in parallel.
    const int bands = (grid_.ny + kBand - 1) / kBand;
    auto band_of = [&](double y) {
        return std::clamp(static_cast<int>((y - grid_.y0) / cell) / kBand, 0, bands - 1);
    };
    std::vector<std::uint32_t> starts(static_cast<std::size_t>(bands) + 1, 0), members;
    auto rows = [&](const SolidFacet& f) { return std::minmax({f.p[0][1], f.p[1][1], f.p[2][1]}); };
    auto matters = [&](const SolidFacet& f) { return f.normal[2] > 0 && f.z_max > z_bottom_; };
    for (const SolidFacet& f : solid.facets)
        if (matters(f))
            for (int b = band_of(rows(f).first); b <= band_of(rows(f).second); ++b)
                ++starts[static_cast<std::size_t>(b) + 1];
    for (std::size_t b = 1; b < starts.size(); ++b) starts[b] += starts[b - 1];
    members.resize(starts.back());
    std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
    for (std::size_t i = 0; i < solid.facets.size(); ++i)
        if (matters(solid.facets[i]))
            for (int b = band_of(rows(solid.facets[i]).first); b <= band_of(rows(solid.facets[i]).second);
                 ++b)
                members[next[static_cast<std::size_t>(b)]++] = static_cast<std::uint32_t>(i);
    const std::vector<std::vector<Span>> capped = line_spans(solid.cap, rows_of(grid_));
    parallel_each(context, static_cast<std::size_t>(bands), [&](std::size_t band) {
        const int first = static_cast<int>(band) * kBand, last = std::min(first + kBand, grid_.ny) - 1;
        const std::size_t begin = grid_.index(0, first), cells = grid_.index(0, last + 1) - begin;
        std::fill_n(memory_.height.data() + begin, cells, static_cast<float>(top));
        std::fill_n(surface + begin, cells, 0.0F);
        std::fill_n(nz + begin, cells, std::uint8_t{255});
        for (std::uint32_t m = starts[band]; m < starts[band + 1]; ++m) {
            const SolidFacet& f = solid.facets[members[m]];
            const auto [y_low, y_high] = rows(f);
            const int j0 = std::max(first, static_cast<int>(std::ceil((y_low - grid_.y0) / cell)));
            const int j1 = std::min(last, static_cast<int>(std::floor((y_high - grid_.y0) / cell)));
            const auto share =
                static_cast<std::uint8_t>(std::lround(255 * std::clamp(f.normal[2], 0.0, 1.0)));
            for (int j = j0; j <= j1; ++j) {
                const double y = grid_.y(j);
                double low = kUnbounded, high = -kUnbounded;
                for (int k = 0; k < 3; ++k) {
                    const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
                    if ((a[1] <= y) == (b[1] <= y)) continue;
                    const double x = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                    low = std::min(low, x);
                    high = std::max(high, x);
                }
                const int i0 = std::max(0, static_cast<int>(std::ceil((low - grid_.x0) / cell)));
                const int i1 =
                    std::min<int>(grid_.nx - 1, static_cast<int>(std::floor((high - grid_.x0) / cell)));
                for (int i = i0; i <= i1; ++i) {
                    const double z =
                        f.p[0][2] - (f.normal[0] * (grid_.x(i) - f.p[0][0]) + f.normal[1] * (y - f.p[0][1])) /
                                        f.normal[2];
                    const auto rise = static_cast<float>(std::min(z, f.z_max) - z_bottom_);
                    const std::size_t c = grid_.index(i, j);
                    if (rise > surface[c]) surface[c] = rise, nz[c] = std::max<std::uint8_t>(1, share);
                }
            }
        }
        for (int j = first; j <= last; ++j)
            for (const Span& s : capped[static_cast<std::size_t>(j)]) {
                const int i0 =
                    std::max(0, static_cast<int>(std::ceil((s.low / kUnitsPerMm - grid_.x0) / cell)));
                const int i1 = std::min<int>(
                    grid_.nx - 1, static_cast<int>(std::floor((s.high / kUnitsPerMm - grid_.x0) / cell)));
                for (int i = i0; i <= i1; ++i)
                    surface[grid_.index(i, j)] = static_cast<float>(top), nz[grid_.index(i, j)] = 255;
            }
    });
    if (layer.opening.empty()) return;
    // The flask is to stay, so nothing is left over on it; nor is what roughing keeps off its wall.
    constexpr double beside = 0.1;  // mm
    const Loops opening = offset(layer.opening, -beside, 0.01);
    const std::vector<std::vector<Span>> open = line_spans(opening, rows_of(grid_));
    for (int j = 0; j < grid_.ny; ++j) {
        std::vector<char> free(static_cast<std::size_t>(grid_.nx), 0);
        for (const Span& s : open[static_cast<std::size_t>(j)])
            for (int i = 0; i < grid_.nx; ++i)
                if (const double x = grid_.x(i) * kUnitsPerMm; x >= s.low && x <= s.high)
                    free[static_cast<std::size_t>(i)] = 1;
        for (int i = 0; i < grid_.nx; ++i)
            if (!free[static_cast<std::size_t>(i)])
                surface[grid_.index(i, j)] = static_cast<float>(top), nz[grid_.index(i, j)] = 255;
    }
}

namespace {

// The squares of a grid, `side` cells wide, that a rectangle meets: first and last column, first and last
// row.
std::array<int, 4> squares_of(const CellGrid& grid, int side, const std::array<double, 2>& low,
                              const std::array<double, 2>& high) {
    const auto square = [&](double at, double first, int cells) {
        return static_cast<int>(std::clamp((at - first) / grid.cell, 0.0, cells - 1.0)) / side;
    };
    return {square(low[0], grid.x0, grid.nx), square(high[0], grid.x0, grid.nx),
            square(low[1], grid.y0, grid.ny), square(high[1], grid.y0, grid.ny)};
}

}  // namespace

void LayerStock::note_hidden(std::span<const Move> moves, double radius) {
    const int across = (grid_.nx + kHiding - 1) / kHiding, down = (grid_.ny + kHiding - 1) / kHiding;
    hides_.resize(static_cast<std::size_t>(across) * static_cast<std::size_t>(down), 0);
    for (std::size_t k = 1; k < moves.size(); ++k) {
        if (moves[k].feed == 0) continue;
        const auto x = std::minmax({to_mm(moves[k - 1].x), to_mm(moves[k].x)}),
                   y = std::minmax({to_mm(moves[k - 1].y), to_mm(moves[k].y)});
        const auto [i0, i1, j0, j1] = squares_of(grid_, kHiding, {x.first - radius, y.first - radius},
                                                 {x.second + radius, y.second + radius});
        for (int j = j0; j <= j1; ++j)
            std::fill_n(hides_.begin() + static_cast<std::ptrdiff_t>(j) * across + i0, i1 - i0 + 1, char{1});
    }
}

bool LayerStock::may_hide_remains(const std::array<double, 2>& low, const std::array<double, 2>& high) const {
    if (hides_.empty()) return false;
    const int across = (grid_.nx + kHiding - 1) / kHiding;
    const auto [i0, i1, j0, j1] = squares_of(grid_, kHiding, low, high);
    for (int j = j0; j <= j1; ++j) {
        const auto row = hides_.begin() + static_cast<std::ptrdiff_t>(j) * across;
        if (std::find(row + i0, row + i1 + 1, char{1}) != row + i1 + 1) return true;
    }
    return false;
}

Taken LayerStock::cut(Context& context, const Operation& operation, const Tool& tool) {
    const std::vector<Move>& moves = operation.moves;
    if (moves.size() < 2) return {};
    const CutterEnd end = cutter_end(cutter_shape(tool));
    if (operation.spare > 0 && operation.spare < grid_.cell) note_hidden(moves, end.radius);
    const double r = end.radius, top = z_top_, cell_mm2 = grid_.cell * grid_.cell;
    auto over_bottom = [&](const Move& m) {
        return std::array<double, 3>{to_mm(m.x), to_mm(m.y), to_mm(m.z) - z_bottom_};
    };
    const std::vector<Box> parts = boxes_of_parts(moves);
    std::vector<Box> boxes((moves.size() + kBlock - 1) / kBlock);
    for (std::size_t i = 0; i < parts.size(); ++i) boxes[i / (kBlock / kPart)].add(parts[i]);
    // The lowest first, whatever their order is: of what they leave a cell keeps the least, and over places
    // cut low the higher levels of a roughing need not be looked at cell by cell.
    std::vector<std::uint32_t> upwards(boxes.size());
    std::iota(upwards.begin(), upwards.end(), 0U);
    std::stable_sort(upwards.begin(), upwards.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return boxes[a].z0 < boxes[b].z0; });
    const int bands = (grid_.ny + kBand - 1) / kBand;
    std::vector<Taken> taken(static_cast<std::size_t>(bands));
    if (trial_ != nullptr) trial_->kept_.make_room();
    parallel_each(context, static_cast<std::size_t>(bands), [&](std::size_t band) {
        const int first = static_cast<int>(band) * kBand, rows = std::min(kBand, grid_.ny - first);
        const CellGrid part{grid_.x0, grid_.y(first), grid_.cell, grid_.nx, rows};
        const double y0 = part.y0 - r, y1 = part.y(rows - 1) + r;
        float* const height = memory_.height.data() + grid_.index(0, first);
        const std::uint8_t* const nz = memory_.nz.data() + grid_.index(0, first);
        Lowering lowering{height, static_cast<std::size_t>(grid_.nx)};
        KeptTiles before(part);  // of what the operation comes to
        TileTops tops(height, part);
        const auto misses = [&](const Box& box) { return box.y1 < y0 || box.y0 > y1 || box.z0 >= top; };
        // A unit more than may count: rounding.
        const auto y_low = static_cast<std::int64_t>(std::floor(y0 * kUnitsPerMm)) - 1,
                   y_high = static_cast<std::int64_t>(std::ceil(y1 * kUnitsPerMm)) + 1;
        Lost lost;
        const auto count_lost = [&] {
            lost = {};
            before.rows([&](const float* kept, std::size_t cell, int n) {
                add_lost(kept, height + cell, nz + cell, n, kEmpty, lost);
            });
        };
        bool keeps = true;  // what the operation comes to, for a trial or until so much is taken that more is
                            // not asked for
        unsigned looked = 0;  // moves that were cut until then
        for (const std::uint32_t b : upwards) {
            if (misses(boxes[b])) continue;
            for (std::size_t i = std::max<std::size_t>(1, b * kBlock);
                 i < std::min(moves.size(), (b + 1) * kBlock); ++i) {
                if (i == 1 || i % kPart == 0) {
                    const Box& part_box = parts[i / kPart];
                    if (misses(part_box) || !tops.any_over(part_box, r, part_box.z0 - z_bottom_)) {
                        i = (i / kPart + 1) * kPart - 1;
                        continue;
                    }
                }
                const Move &p = moves[i - 1], &q = moves[i];
                if (q.feed == 0) continue;
                if (std::max(p.y, q.y) < y_low || std::min(p.y, q.y) > y_high) continue;
                const double px = to_mm(p.x), qx = to_mm(q.x), py = to_mm(p.y), qy = to_mm(q.y),
                             pz = to_mm(p.z), qz = to_mm(q.z);
                if (std::min(pz, qz) >= top) continue;
                std::array<int, 4> cells{};
                if (!tops.cut_over(std::min(px, qx) - r, std::max(px, qx) + r, std::min(py, qy) - r,
                                   std::max(py, qy) + r, std::min(pz, qz) - z_bottom_, cells))
                    continue;
                if (keeps) before.keep(height, cells[0], cells[1], cells[2], cells[3]);
                std::array<double, 3> previous{}, next{};
                ChainedSweep chain;
                if (p.feed != 0 && i > 1) previous = over_bottom(moves[i - 2]), chain.before = &previous;
                if (i + 1 < moves.size() && moves[i + 1].feed != 0)
                    next = over_bottom(moves[i + 1]), chain.after = &next;
                sweep_above(part, end, over_bottom(p), over_bottom(q), StandingHeights{height, 0}, lowering,
                            chain);
                if (!keeps || trial_ != nullptr || !std::has_single_bit(++looked)) continue;
                count_lost();
                keeps = lost.cells < Taken::kFew || lost.sum * cell_mm2 < Taken::kTrace;
            }
        }
        if (keeps) count_lost();
        taken[band] = {lost.most, lost.sum * cell_mm2, lost.cells};
        if (trial_ != nullptr) trial_->kept_.add(first / KeptTiles::kTile, before);
    });
    Taken all;
    for (const Taken& t : taken)
        all.most = std::max(all.most, t.most), all.mm3 += t.mm3, all.cells += t.cells;
    return all;
}

double LayerStock::area_over(Context& context, double limit) const {
    const auto cells = parallel_reduce(
        context, static_cast<std::size_t>(grid_.ny), std::size_t{16}, std::size_t{0},
        [&](std::size_t begin, std::size_t end) {
            std::size_t over = 0;
            for (std::size_t j = begin; j < end; ++j)
                each_left(static_cast<int>(j), limit, [&](int) { ++over; });
            return over;
        },
        std::plus<>());
    return static_cast<double>(cells) * grid_.cell * grid_.cell;
}

double LayerStock::volume_over(Context& context, double limit) const {
    const double mm = parallel_reduce(
        context, static_cast<std::size_t>(grid_.ny), std::size_t{16}, 0.0,
        [&](std::size_t begin, std::size_t end) {
            double over = 0;
            for (std::size_t j = begin; j < end; ++j)
                each_left(static_cast<int>(j), limit, [&](int i) {
                    const std::size_t c = grid_.index(i, static_cast<int>(j));
                    over += height(c) - surface(c);
                });
            return over;
        },
        std::plus<>());
    return mm * grid_.cell * grid_.cell;
}

void LayerStock::cut_at(const CutterEnd& end, double x, double y, double tip_z) {
    cut_along(end, {x, y, tip_z}, {x, y, tip_z});
}

void LayerStock::cut_along(const CutterEnd& end, const std::array<double, 3>& from,
                           const std::array<double, 3>& to, bool been) {
    float* const height = memory_.height.data();
    if (trial_ != nullptr) {
        const auto cell = [&](double mm, double begin, int cells) {
            return static_cast<int>(
                std::clamp((mm - begin) / grid_.cell, 0.0, static_cast<double>(cells - 1)));
        };
        trial_->kept_.keep(height, cell(std::min(from[0], to[0]) - end.radius, grid_.x0, grid_.nx),
                           cell(std::max(from[0], to[0]) + end.radius, grid_.x0, grid_.nx),
                           cell(std::min(from[1], to[1]) - end.radius, grid_.y0, grid_.ny),
                           cell(std::max(from[1], to[1]) + end.radius, grid_.y0, grid_.ny));
    }
    // What stands a hair higher is asked too: heights over this bottom are compared, not z.
    constexpr double hair = 1e-3;
    struct LoweringTo {
        float* height;
        double bottom;
        void operator()(std::size_t cell, double z) {
            height[cell] = std::min(height[cell], static_cast<float>(std::max(0.0, z - bottom)));
        }
        void row(std::size_t first, int n, const double* h, double /*lowest*/) {
            lower_to(height + first, n, h, bottom);
        }
    } lowering{height, z_bottom_};
    sweep_above(grid_, end, from, to, StandingHeights{height, z_bottom_ + hair}, lowering, {.been = been});
}

}  // namespace slabwright
