// Sections become rows of cells, and where a cutter fits is found in rows: grown by the cutter, what is kept
// leaves the places of its middle, and these, grown by the cutter again, what it clears. What it leaves is
// thin and scattered, so that goes into a sparse tree (OpenVDB), whose leaves are then freed of the swath
// eight cells at a time.
#include "kernels/voxels/voxels.h"

#include <openvdb/Types.h>
#include <openvdb/tree/Tree.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// An index that was reckoned in integers, none of them below zero.
std::size_t slot(int index) { return static_cast<std::size_t>(index); }

using MaskTree = openvdb::tree::Tree4<openvdb::ValueMask, 5, 4, 3>::Type;
using Leaf = MaskTree::LeafNodeType;
// Slices run along the tree's x and cells of a row along its z: in a leaf, a slice is one word and a row of
// it one byte.
constexpr int kLeaf = 8;
using Spans = std::span<const std::array<std::int32_t, 2>>;

constexpr std::size_t kRowGrain = 64;

// Calls fill(j, out) for every row, in parallel, and puts the rows together.
template <class Fill>
CellRows make_rows(Context& context, std::size_t rows, Fill&& fill) {
    std::vector<CellRows> parts((rows + kRowGrain - 1) / kRowGrain);
    parallel_for(context, rows, kRowGrain, [&](std::size_t begin, std::size_t end) {
        CellRows& part = parts[begin / kRowGrain];
        for (std::size_t j = begin; j < end; ++j) {
            fill(j, part.spans);
            part.starts.push_back(static_cast<std::uint32_t>(part.spans.size()));
        }
    });
    CellRows all;
    all.starts.reserve(rows + 1);
    std::size_t spans = 0;
    for (const CellRows& part : parts) spans += part.spans.size();
    all.spans.reserve(spans);
    for (CellRows& part : parts) {
        const auto before = static_cast<std::uint32_t>(all.spans.size());
        all.spans.insert(all.spans.end(), part.spans.begin(), part.spans.end());
        for (std::size_t j = 1; j < part.starts.size(); ++j) all.starts.push_back(before + part.starts[j]);
        part = {};
    }
    return all;
}

void append_span(std::vector<std::array<std::int32_t, 2>>& out, std::size_t first, std::int32_t low,
                 std::int32_t high) {
    if (out.size() > first && low <= out.back()[1] + 1) out.back()[1] = std::max(out.back()[1], high);
    else out.push_back({low, high});
}

void append_union(Spans a, Spans b, std::vector<std::array<std::int32_t, 2>>& out) {
    const std::size_t first = out.size();
    std::size_t i = 0, j = 0;
    while (i < a.size() || j < b.size()) {
        const auto& next = j == b.size() || (i < a.size() && a[i][0] <= b[j][0]) ? a[i++] : b[j++];
        append_span(out, first, next[0], next[1]);
    }
}

// What of [low, high] no span covers.
void append_rest(Spans spans, std::int32_t low, std::int32_t high,
                 std::vector<std::array<std::int32_t, 2>>& out) {
    for (const auto& s : spans) {
        if (s[1] < low) continue;
        if (s[0] > high) break;
        if (s[0] > low) out.push_back({low, s[0] - 1});
        low = s[1] + 1;
    }
    if (low <= high) out.push_back({low, high});
}

// How many cells a disc reaches to either side, `dy` rows from its middle; −1 where it does not come.
int half_width(double radius_cells, int dy) {
    const double rest = radius_cells * radius_cells - static_cast<double>(dy) * dy;
    return rest < 0 ? -1 : static_cast<int>(std::floor(std::sqrt(rest) + 1e-9));
}

// The cells of one row, a bit each.
class RowBits {
public:
    void clear(int cells) { words_.assign(slot(cells) / 64 + 1, 0); }
    void set(std::int32_t low, std::int32_t high) {
        const std::size_t first = slot(low) / 64, last = slot(high) / 64;
        const std::uint64_t from = ~std::uint64_t{0} << (low % 64),
                            to = ~std::uint64_t{0} >> (63 - high % 64);
        if (first == last) {
            words_[first] |= from & to;
            return;
        }
        words_[first] |= from;
        for (std::size_t w = first + 1; w < last; ++w) words_[w] = ~std::uint64_t{0};
        words_[last] |= to;
    }
    void append_spans(std::vector<std::array<std::int32_t, 2>>& out) const {
        for (std::int32_t begin = next(0, 0); begin >= 0;) {
            const std::int32_t end = next(begin, ~std::uint64_t{0});  // the last bit is never set
            out.push_back({begin, end - 1});
            begin = next(end, 0);
        }
    }

private:
    // The first cell from i on that is not as `same` has them; −1 where there is none.
    [[nodiscard]] std::int32_t next(std::int32_t i, std::uint64_t same) const {
        std::size_t w = slot(i) / 64;
        std::uint64_t other = (words_[w] ^ same) & (~std::uint64_t{0} << (i % 64));
        while (other == 0)
            if (++w == words_.size()) return -1;
            else other = words_[w] ^ same;
        return static_cast<std::int32_t>(w * 64) + std::countr_zero(other);
    }
    std::vector<std::uint64_t> words_;
};

// What each row holds beyond the row before it (`step` −1) or behind it (1).
struct FreshRows {
    struct Run {
        std::int32_t low, high;
        std::int32_t lead;  // no cell is farther from the nearest one of the other row, if that has cells
                            // right beside the run
    };
    std::vector<std::uint32_t> starts{0};
    std::vector<Run> runs;
    [[nodiscard]] std::span<const Run> row(std::size_t j) const {
        return std::span(runs).subspan(starts[j], starts[j + 1] - starts[j]);
    }
};

FreshRows fresh_rows(const CellRows& rows, int step) {
    FreshRows fresh;
    fresh.starts.reserve(rows.rows() + 1);
    std::vector<std::array<std::int32_t, 2>> rest;
    for (std::size_t j = 0; j < rows.rows(); ++j) {
        const bool outermost = step < 0 ? j == 0 : j + 1 == rows.rows();
        const Spans nearer = outermost ? Spans{} : rows.row(step < 0 ? j - 1 : j + 1);
        std::size_t from = 0;
        for (const auto& s : rows.row(j)) {
            while (from < nearer.size() && nearer[from][1] < s[0] - 1) ++from;
            rest.clear();
            append_rest(nearer.subspan(from), s[0], s[1], rest);
            std::size_t at = from;
            for (const auto& r : rest) {
                while (at < nearer.size() && nearer[at][1] < r[0] - 1) ++at;
                const bool before = at < nearer.size() && nearer[at][1] == r[0] - 1;
                const std::size_t next = before ? at + 1 : at;
                const bool behind = next < nearer.size() && nearer[next][0] == r[1] + 1;
                fresh.runs.push_back({r[0], r[1], before || behind ? r[1] - r[0] + 1 : INT32_MAX});
            }
        }
        fresh.starts.push_back(static_cast<std::uint32_t>(fresh.runs.size()));
    }
    return fresh;
}

// Every cell whose middle lies within the radius of some cell's middle; rows and cells from 0, as many as
// before. A cell that the next nearer row holds as well reaches no farther than that one, nor does one that
// leads it by no more than the disc is narrower here.
CellRows grown(Context& context, const CellRows& rows, double radius_cells, int nx) {
    const int reach = static_cast<int>(std::floor(radius_cells + 1e-9)), n = static_cast<int>(rows.rows());
    std::vector<int> width;
    for (int dy = 0; dy <= reach; ++dy) width.push_back(half_width(radius_cells, dy));
    const FreshRows upwards = fresh_rows(rows, 1), downwards = fresh_rows(rows, -1);
    return make_rows(context, rows.rows(),
                     [&](std::size_t row, std::vector<std::array<std::int32_t, 2>>& out) {
                         const int j = static_cast<int>(row);
                         static thread_local RowBits bits;
                         bits.clear(nx);
                         const auto add = [&](std::int32_t low, std::int32_t high, int w) {
                             bits.set(std::max(0, low - w), std::min(nx - 1, high + w));
                         };
                         for (const auto& s : rows.row(row)) add(s[0], s[1], width[0]);
                         for (int dy = 1; dy <= reach; ++dy) {
                             const int w = width[slot(dy)], narrower = width[slot(dy - 1)] - w;
                             const auto grow = [&](std::span<const FreshRows::Run> runs) {
                                 for (const FreshRows::Run& r : runs)
                                     if (r.lead > narrower) add(r.low, r.high, w);
                             };
                             if (j - dy >= 0) grow(upwards.row(slot(j - dy)));
                             if (j + dy < n) grow(downwards.row(slot(j + dy)));
                         }
                         bits.append_spans(out);
                     });
}

// The cells whose middle lies within the loops. Cell 0 of row 0 has its middle at x, y (mm).
CellRows cells_within(const Loops& loops, double x, double y, double cell, int nx, int ny) {
    struct Crossing {
        double x;
        std::int32_t turn;
    };
    auto each_crossing = [&](auto&& take) {
        for (std::size_t l = 0; l < loops.size(); ++l) {
            const auto loop = loops.loop(l);
            for (std::size_t i = 0; i < loop.size(); ++i) {
                const Point2 a = loop[i], b = loop[(i + 1) % loop.size()];
                if (a.y == b.y) continue;
                const double ax = (to_mm(a.x) - x) / cell, ay = (to_mm(a.y) - y) / cell,
                             bx = (to_mm(b.x) - x) / cell, by = (to_mm(b.y) - y) / cell;
                const bool up = ay < by;
                const int first = std::max(0, static_cast<int>(std::ceil(up ? ay : by))),
                          last = std::min(ny - 1, static_cast<int>(std::ceil(up ? by : ay)) - 1);
                for (int j = first; j <= last; ++j)
                    take(static_cast<std::size_t>(j),
                         Crossing{ax + (j - ay) / (by - ay) * (bx - ax), up ? -1 : 1});
            }
        }
    };
    std::vector<std::uint32_t> starts(static_cast<std::size_t>(ny) + 1, 0);
    each_crossing([&](std::size_t j, const Crossing&) { ++starts[j + 1]; });
    for (std::size_t j = 0; j < static_cast<std::size_t>(ny); ++j) starts[j + 1] += starts[j];
    std::vector<Crossing> crossings(starts.back());
    std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
    each_crossing([&](std::size_t j, const Crossing& c) { crossings[next[j]++] = c; });
    CellRows rows;
    for (std::size_t j = 0; j < static_cast<std::size_t>(ny); ++j) {
        std::sort(
            crossings.begin() + starts[j], crossings.begin() + starts[j + 1],
            [](const Crossing& a, const Crossing& b) { return a.x != b.x ? a.x < b.x : a.turn < b.turn; });
        const std::size_t first = rows.spans.size();
        int winding = 0;
        double begin = 0;
        for (std::size_t c = starts[j]; c < starts[j + 1]; ++c) {
            const int before = winding;
            winding += crossings[c].turn;
            if (before <= 0 && winding > 0) begin = crossings[c].x;
            if (before <= 0 || winding > 0) continue;
            const int low = std::max(0, static_cast<int>(std::ceil(begin))),
                      high = std::min(nx - 1, static_cast<int>(std::ceil(crossings[c].x)) - 1);
            if (low <= high) append_span(rows.spans, first, low, high);
        }
        rows.starts.push_back(static_cast<std::uint32_t>(rows.spans.size()));
    }
    return rows;
}

// Of the eight cells from i on, those that a span covers, as bits.
std::uint8_t covered(Spans spans, std::int32_t i, std::int32_t widened) {
    auto it = std::lower_bound(spans.begin(), spans.end(), i - widened,
                               [](const auto& s, std::int32_t v) { return s[1] < v; });
    unsigned bits = 0;
    for (; it != spans.end() && (*it)[0] - widened < i + kLeaf; ++it) {
        const int low = std::max(0, (*it)[0] - widened - i),
                  high = std::min(kLeaf - 1, (*it)[1] + widened - i);
        bits |= (0xFFU >> (kLeaf - 1 - high + low)) << low;
    }
    return static_cast<std::uint8_t>(bits);
}

std::uint64_t& slice_of(Leaf& leaf, int k) { return leaf.getValueMask().getWord<std::uint64_t>(k); }

}  // namespace

VoxelBox voxel_box(const std::array<double, 3>& low, const std::array<double, 3>& high, double voxel) {
    auto cells = [&](int axis) {
        return std::max(1, static_cast<int>(std::ceil((high[axis] - low[axis]) / voxel - 1e-6)));
    };
    return {low, voxel, cells(0), cells(1), cells(2)};
}

LayerVoxels::LayerVoxels(Context& context, const VoxelBox& box, std::span<const Loops> sections,
                         double widest)
    : box_(box), border_(static_cast<int>(std::ceil(widest / box.voxel)) + 2) {
    const double x = box.min[0] + (0.5 - border_) * box.voxel, y = box.min[1] + (0.5 - border_) * box.voxel;
    kept_.resize(sections.size());
    parallel_each(context, sections.size(), [&](std::size_t k) {
        kept_[k] = cells_within(sections[k], x, y, box_.voxel, box_.nx + 2 * border_, box_.ny + 2 * border_);
    });
    std::uint64_t bytes = 0;
    for (std::size_t k = sections.size(); k-- > 0;) {
        if (k + 1 < sections.size())
            kept_[k] = make_rows(context, kept_[k].rows(), [&](std::size_t j, auto& out) {
                append_union(kept_[k].row(j), kept_[k + 1].row(j), out);
            });
        bytes += kept_[k].spans.size() * sizeof(kept_[k].spans[0]) +
                 kept_[k].starts.size() * sizeof(std::uint32_t);
    }
    memory_.emplace(context, bytes, "the voxels of a layer");
}

int LayerVoxels::slice_at(double tip) const {
    return std::clamp(static_cast<int>(std::ceil((tip - box_.min[2]) / box_.voxel - 0.5 - 1e-6)), 0,
                      box_.nz - 1);
}

double LayerVoxels::area_to_clear(double tip) const {
    const CellRows& kept = kept_[static_cast<std::size_t>(slice_at(tip))];
    std::int64_t cells = static_cast<std::int64_t>(box_.nx) * box_.ny;
    for (int j = 0; j < box_.ny; ++j)
        for (const auto& s : kept.row(slot(j + border_)))
            cells -= std::max(0, std::min(s[1], border_ + box_.nx - 1) - std::max(s[0], border_) + 1);
    return static_cast<double>(cells) * box_.voxel * box_.voxel;
}

const CellRows& LayerVoxels::reached(Context& context, int slice, double radius, double allowance) {
    const auto key = std::pair{slice, std::pair{radius, allowance}};
    if (const auto it = reached_.find(key); it != reached_.end()) return it->second;
    const CellRows& kept = kept_[static_cast<std::size_t>(slice)];
    const int nx = box_.nx + 2 * border_;
    // A wall lies half a cell before the middle of the first cell behind it, and half a cell behind that of
    // the last before it. A cutter that touches is let in.
    const double off = (radius + allowance) / box_.voxel + 0.5;
    const CellRows barred = grown(context, kept, std::nextafter(off - 1e-6, 0.0), nx);
    const CellRows places = make_rows(context, barred.rows(), [&](std::size_t j, auto& out) {
        append_rest(barred.row(j), 0, nx - 1, out);
    });
    return reached_.emplace(key, grown(context, places, radius / box_.voxel + 0.5, nx)).first->second;
}

double LayerVoxels::reached_share(Context& context, double radius, int every) {
    std::int64_t all = 0, touched = 0;
    std::vector<std::array<std::int32_t, 2>> beside;
    for (int k = every / 2; k < box_.nz; k += every) {
        const CellRows& kept = kept_[static_cast<std::size_t>(k)];
        const CellRows with_edge = grown(context, kept, 1, box_.nx + 2 * border_);
        const CellRows reach = reached(context, k, radius, 0);
        reached_.erase({k, {radius, 0.0}});
        for (std::size_t j = static_cast<std::size_t>(border_); j < slot(border_ + box_.ny); ++j)
            for (const auto& s : with_edge.row(j)) {
                beside.clear();
                append_rest(kept.row(j), std::max(s[0], border_), std::min(s[1], border_ + box_.nx - 1),
                            beside);
                for (const auto& edge : beside) {
                    all += edge[1] - edge[0] + 1;
                    for (const auto& r : reach.row(j))
                        touched += std::max(0, std::min(edge[1], r[1]) - std::max(edge[0], r[0]) + 1);
                }
            }
    }
    return all > 0 ? static_cast<double>(touched) / static_cast<double>(all) : 1;
}

namespace {

struct Piece {
    openvdb::Coord at;
    std::unique_ptr<Leaf> leaf;
};

// Leaves of what is left: strips of eight rows and eight slices in parallel, in their order.
// @param kept by slice. @param level by slice the slice of its level's tip, −1: none. @param gone by level
std::vector<std::vector<Piece>> leaves_of(Context& context, const VoxelBox& box, int border,
                                          std::span<const CellRows> kept, std::span<const int> level,
                                          const std::map<int, CellRows>& gone) {
    const int strips = (box.ny + kLeaf - 1) / kLeaf, bands = (box.nz + kLeaf - 1) / kLeaf,
              columns = (box.nx + kLeaf - 1) / kLeaf;
    std::vector<std::vector<Piece>> pieces(static_cast<std::size_t>(strips) * bands);
    parallel_for(context, pieces.size(), 16, [&](std::size_t begin, std::size_t end) {
        std::vector<std::unique_ptr<Leaf>> open(static_cast<std::size_t>(columns));
        std::vector<std::array<std::int32_t, 2>> both, rest;
        for (std::size_t p = begin; p < end; ++p) {
            const int j0 = static_cast<int>(p) % strips * kLeaf, k0 = static_cast<int>(p) / strips * kLeaf;
            for (int k = k0; k < std::min(k0 + kLeaf, box.nz); ++k)
                for (int j = j0; j < std::min(j0 + kLeaf, box.ny); ++j) {
                    const auto row = slot(j + border);
                    const int at = level[static_cast<std::size_t>(k)];
                    both.clear();
                    rest.clear();
                    append_union(kept[static_cast<std::size_t>(k)].row(row),
                                 at < 0 ? Spans{} : gone.at(at).row(row), both);
                    append_rest(both, border, border + box.nx - 1, rest);
                    for (const auto& s : rest)
                        for (int c = (s[0] - border) / kLeaf; c <= (s[1] - border) / kLeaf; ++c) {
                            std::unique_ptr<Leaf>& leaf = open[static_cast<std::size_t>(c)];
                            if (!leaf) leaf = std::make_unique<Leaf>(openvdb::Coord(k0, j0, c * kLeaf));
                            const std::array<std::int32_t, 2> run{s[0] - border, s[1] - border};
                            slice_of(*leaf, k - k0) |=
                                std::uint64_t{covered(std::span(&run, 1), c * kLeaf, 0)} << (8 * (j - j0));
                        }
                }
            for (std::unique_ptr<Leaf>& leaf : open)
                if (leaf) pieces[p].push_back({leaf->origin(), std::move(leaf)});
        }
    });
    return pieces;
}

// Frees leaves of what lies within the swath (mm) of what is kept, sideways at its height and straight above
// it.
void free_of_swath(Context& context, const VoxelBox& box, int border, std::span<const CellRows> kept,
                   double swath, std::span<Leaf* const> leaves) {
    const double reach = swath / box.voxel + 0.5;
    std::vector<int> width;
    for (int dy = 0; half_width(reach, dy) >= 0; ++dy) width.push_back(half_width(reach, dy));
    const int below = static_cast<int>(std::floor(swath / box.voxel + 1e-6)), rows = box.ny + 2 * border;
    parallel_for(context, leaves.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t l = begin; l < end; ++l)
            for (int dk = 0; dk < kLeaf; ++dk) {
                std::uint64_t& slice = slice_of(*leaves[l], dk);
                if (slice == 0) continue;
                const auto [k, j0, i0] =
                    std::array{leaves[l]->origin().x() + dk, leaves[l]->origin().y() + border,
                               leaves[l]->origin().z() + border};
                const CellRows &of_slice = kept[static_cast<std::size_t>(k)],
                               &under = kept[static_cast<std::size_t>(std::max(0, k - below))];
                for (int dj = 0; dj < kLeaf; ++dj) {
                    auto cells = static_cast<std::uint8_t>(slice >> (8 * dj));
                    if (cells == 0) continue;
                    const std::uint8_t before = cells;
                    const int j = j0 + dj;
                    cells &=
                        static_cast<std::uint8_t>(~covered(under.row(static_cast<std::size_t>(j)), i0, 0));
                    for (int dy = 0; dy < static_cast<int>(width.size()) && cells != 0; ++dy)
                        for (const int row : {j - dy, j + dy})
                            if (row >= 0 && row < rows)
                                cells &= static_cast<std::uint8_t>(
                                    ~covered(of_slice.row(static_cast<std::size_t>(row)), i0,
                                             width[static_cast<std::size_t>(dy)]));
                    slice ^= std::uint64_t{static_cast<std::uint8_t>(before ^ cells)} << (8 * dj);
                }
            }
    });
}

// By slice.
std::vector<std::uint64_t> voxels_in(const VoxelBox& box, std::span<Leaf* const> leaves) {
    std::vector<std::uint64_t> voxels(static_cast<std::size_t>(box.nz), 0);
    for (Leaf* leaf : leaves)
        for (int k = 0; k < kLeaf && leaf->origin().x() + k < box.nz; ++k)
            voxels[slot(leaf->origin().x() + k)] +=
                static_cast<std::uint64_t>(std::popcount(slice_of(*leaf, k)));
    return voxels;
}

// The sums of a slice's or a box's voxels. @param voxels, outside by slice, before and after free_of_swath()
void sum_up(const VoxelBox& box, std::span<Leaf* const> leaves, std::span<const std::uint64_t> voxels,
            std::span<const std::uint64_t> outside, RoughLeft& result) {
    const double cell = box.voxel * box.voxel;
    int worst = 0;
    for (int k = 0; k < box.nz; ++k) {
        const auto at = static_cast<std::size_t>(k);
        result.voxels += voxels[at];
        result.rough_area = std::max(result.rough_area, static_cast<double>(voxels[at]) * cell);
        result.volume += static_cast<double>(outside[at]) * cell * box.voxel;
        if (outside[at] > outside[static_cast<std::size_t>(worst)]) worst = k;
    }
    result.area = static_cast<double>(outside[static_cast<std::size_t>(worst)]) * cell;
    std::pair first{INT32_MAX, INT32_MAX};
    for (Leaf* leaf : leaves) {
        const int dk = worst - leaf->origin().x();
        if (dk < 0 || dk >= kLeaf || slice_of(*leaf, dk) == 0) continue;
        const int bit = std::countr_zero(slice_of(*leaf, dk));
        first = std::min(first, {leaf->origin().y() + bit / 8, leaf->origin().z() + bit % 8});
    }
    if (result.area > 0)
        result.where = {box.min[0] + (first.second + 0.5) * box.voxel,
                        box.min[1] + (first.first + 0.5) * box.voxel, box.z(worst)};
}

}  // namespace

RoughLeft LayerVoxels::left(Context& context, const Roughing& roughing, double swath) {
    // Of all levels at or under a slice the highest one clears most of it: what is kept grows downwards.
    std::vector<int> level(static_cast<std::size_t>(box_.nz), -1);  // by slice: the slice of its level's tip
    for (const double tip : roughing.tips)
        for (int k = slice_at(tip);
             k < box_.nz && box_.z(k) >= tip - 1e-6 && level[static_cast<std::size_t>(k)] < 0; ++k)
            level[static_cast<std::size_t>(k)] = slice_at(tip);
    std::map<int, CellRows> gone;
    for (const int at : level) {
        if (at < 0 || gone.contains(at)) continue;
        CellRows rows = reached(context, at, roughing.radius, roughing.allowance);
        for (const double wider : roughing.wider) {
            const CellRows& more = reached(context, at, wider, roughing.allowance);
            rows = make_rows(context, rows.rows(),
                             [&](std::size_t j, auto& out) { append_union(rows.row(j), more.row(j), out); });
        }
        gone.emplace(at, std::move(rows));
    }
    MaskTree tree;
    std::vector<Leaf*> leaves;
    for (auto& strip : leaves_of(context, box_, border_, kept_, level, gone))
        for (Piece& piece : strip) {
            leaves.push_back(piece.leaf.get());
            tree.addLeaf(piece.leaf.release());
        }
    RoughLeft result;
    const std::vector<std::uint64_t> voxels = voxels_in(box_, leaves);
    result.sparse_bytes = tree.memUsage();
    free_of_swath(context, box_, border_, kept_, swath, leaves);
    sum_up(box_, leaves, voxels, voxels_in(box_, leaves), result);
    return result;
}

}  // namespace slabwright
