#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/tolerances.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "kernels/cutting/cusp.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSteepFoot = 75 * kDegree;  // over flatter feet a flat end mill would need too many passes
constexpr double kMostFeet = 6;

}  // namespace

bool lies_on_floor(const SolidFacet& facet, double z) {
    return facet.z_min >= z - kSameFloor && facet.z_max <= z && facet.normal[2] >= 0.9999;
}

std::vector<SolidFacet> floor_facets(const LayerCut& cut, double z) {
    std::vector<SolidFacet> facets;
    for (const SolidFacet& f : cut.solid.facets)
        if (lies_on_floor(f, z)) facets.push_back(f);
    return facets;
}

NearFloor::NearFloor(const LayerCut& cut, std::span<const SolidFacet> facets, double r, const FibreGrid& grid)
    : grid_(grid),
      x_(covering(cut.context, facets, r, Axis::x, grid.y)),
      y_(covering(cut.context, facets, r, Axis::y, grid.x)) {}

bool NearFloor::operator()(Point2 p) const {
    const bool on_row = p.y % grid_.pitch == 0;
    const std::int32_t line = (on_row ? p.y - grid_.y[0] : p.x - grid_.x[0]) / grid_.pitch;
    const double along = to_mm(on_row ? p.x : p.y);
    const auto near = (on_row ? x_ : y_).line(static_cast<std::size_t>(line));
    return std::any_of(near.begin(), near.end(),
                       [&](const Forbidden& f) { return f.low < along && along < f.high; });
}

namespace {

// A box in the plane, mm.
struct Box2 {
    std::array<double, 2> low{kUnbounded, kUnbounded}, high{-kUnbounded, -kUnbounded};
    void add(const Box2& other) {
        for (std::size_t k = 0; k < 2; ++k)
            low[k] = std::min(low[k], other.low[k]), high[k] = std::max(high[k], other.high[k]);
    }
};

// Where facets lie, in tiles.
class Occupied {
public:
    explicit Occupied(std::span<const FacetGroup> groups) : before_((kTiles + 1) * (kTiles + 1), 0) {
        for (const FacetGroup& g : groups) all_.add({{g.low[0], g.low[1]}, {g.high[0], g.high[1]}});
        for (const FacetGroup& g : groups)
            for (std::size_t j = tile(g.low[1], 1); j <= tile(g.high[1], 1); ++j)
                for (std::size_t i = tile(g.low[0], 0); i <= tile(g.high[0], 0); ++i)
                    before_[(j + 1) * (kTiles + 1) + i + 1] = 1;
        for (std::size_t j = 1; j <= kTiles; ++j)
            for (std::size_t i = 1; i <= kTiles; ++i)
                before_[at(i, j)] +=
                    before_[at(i - 1, j)] + before_[at(i, j - 1)] - before_[at(i - 1, j - 1)];
    }
    [[nodiscard]] const Box2& box() const { return all_; }
    [[nodiscard]] bool meets(const Box2& b) const {
        for (std::size_t k = 0; k < 2; ++k)
            if (b.low[k] > all_.high[k] || b.high[k] < all_.low[k]) return false;
        const std::size_t i0 = tile(b.low[0], 0), i1 = tile(b.high[0], 0) + 1, j0 = tile(b.low[1], 1),
                          j1 = tile(b.high[1], 1) + 1;
        return before_[at(i1, j1)] - before_[at(i0, j1)] - before_[at(i1, j0)] + before_[at(i0, j0)] != 0;
    }

private:
    static constexpr std::size_t kTiles = 256;  // along x and along y
    [[nodiscard]] static std::size_t at(std::size_t i, std::size_t j) { return j * (kTiles + 1) + i; }
    [[nodiscard]] std::size_t tile(double v, std::size_t axis) const {
        const double extent = all_.high[axis] - all_.low[axis];
        return extent > 0 ? static_cast<std::size_t>(
                                std::clamp((v - all_.low[axis]) / extent * kTiles, 0.0, kTiles - 1.0))
                          : 0;
    }
    Box2 all_;
    std::vector<std::uint32_t> before_;  // occupied tiles before a corner
};

// The loops that come where facets lie or are around some; `all` grows by theirs.
Loops loops_at(const Loops& loops, const Occupied& occupied, Box2& all) {
    Loops kept;
    for (std::size_t l = 0; l < loops.size(); ++l) {
        Box2 box;
        for (const Point2 p : loops.loop(l)) box.add({{to_mm(p.x), to_mm(p.y)}, {to_mm(p.x), to_mm(p.y)}});
        if (!occupied.meets(box)) continue;
        all.add(box);
        kept.points.insert(kept.points.end(), loops.loop(l).begin(), loops.loop(l).end());
        kept.close_loop();
    }
    return kept;
}

// Those of ascending lines that lie between, and one more on either side.
std::vector<std::int32_t> lines_between(const std::vector<std::int32_t>& lines, double low, double high) {
    auto first = std::lower_bound(lines.begin(), lines.end(), low * kUnitsPerMm),
         last = std::upper_bound(lines.begin(), lines.end(), high * kUnitsPerMm);
    if (first != lines.begin()) --first;
    if (last != lines.end()) ++last;
    return first < last ? std::vector<std::int32_t>(first, last) : std::vector<std::int32_t>();
}

}  // namespace

std::vector<Contours> contours_near(Context& context, const LayerSolid& around, std::span<const double> tips,
                                    std::span<const Section> inside, const CutterShape& cutter,
                                    const FibreGrid& grid) {
    if (around.groups.empty()) return std::vector<Contours>(tips.size());
    const Occupied occupied(around.groups);
    Box2 all = occupied.box();
    std::vector<Loops> loops;
    for (std::size_t i = 0; i < tips.size(); ++i) loops.push_back(loops_at(inside[i].loops, occupied, all));
    std::vector<FibreLevel> levels;
    for (std::size_t i = 0; i < tips.size(); ++i) levels.push_back({tips[i], &loops[i]});
    const double reach = cutter.radius + 2 * to_mm(grid.pitch);
    const FibreGrid part{grid.pitch, lines_between(grid.x, all.low[0] - reach, all.high[0] + reach),
                         lines_between(grid.y, all.low[1] - reach, all.high[1] + reach)};
    return level_contours(context, around, levels, cutter, part);
}

std::vector<double> foot_heights(const LayerCut& cut, double floor) {
    const double cusp = cut.job.tolerances.cusp, r = cut.layer.tools.finish.diameter / 2,
                 alpha = cut.least_slope(floor, floor + r, kSteepFoot);
    if (alpha >= cut.job.cutting.vertical_deg * kDegree) return {};
    const double high = r * (1 - std::cos(alpha)) - std::sqrt(2 * r * cusp),
                 steps = std::ceil(high / flat_level_stepdown(alpha, cusp));
    std::vector<double> heights;
    if (steps > kMostFeet) return heights;
    for (double k = steps - 1; k > 0.5; --k) heights.push_back(high * k / steps);
    return heights;
}

void append_foot_runs(const LayerCut& cut, const Tool& tool, double floor, const FibreGrid& grid,
                      std::span<const std::pair<const DropIndex*, double>> wider,
                      std::vector<std::vector<LevelRun>>& levels) {
    const std::vector<double> heights = foot_heights(cut, floor);
    if (heights.empty()) return;
    const double r = tool.diameter / 2, wall_nz = std::cos(cut.job.cutting.vertical_deg * kDegree),
                 foot_nz = std::cos(kSteepFoot);
    const CutterShape cutter = flat_cutter(r);
    const std::vector<SolidFacet> facets = floor_facets(cut, floor);
    const NearFloor near(cut, facets, r, grid);
    const LayerSolid around = solid_near(cut.context, cut.solid, facets, 2 * (r + to_mm(grid.pitch)));
    std::vector<double> tips;
    for (const double above : heights) tips.push_back(floor + above);
    const std::vector<Section> inside = cut.insides(cutter, tips);
    const std::vector<Contours> contours = contours_near(cut.context, around, tips, inside, cutter, grid);
    for (std::size_t i = 0; i < tips.size(); ++i) {
        const double tip = tips[i];
        const Contours& foot = contours[i];
        levels.emplace_back();
        for (std::size_t c = 0; c < foot.size(); ++c) {
            const std::size_t first = foot.starts[c], n = foot.starts[c + 1] - first;
            std::vector<char> wanted(n, 0);
            for (std::size_t k = 0; k < n; ++k) {
                const Point2 a = foot.points[first + (k + n - 1) % n], p = foot.points[first + k],
                             b = foot.points[first + (k + 1) % n];
                if (foot.nz[first + k] <= wall_nz || foot.nz[first + k] > foot_nz || !near(p)) continue;
                wanted[k] = 1;
                const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y,
                             l = std::hypot(dx, dy);
                for (const auto& [drops, radius] : wider)
                    // The solid is on the right, so the free side is on the left.
                    if (l > 0 && !drops->stands_over(to_mm(p.x) - dy / l * (radius + 0.02 - r),
                                                     to_mm(p.y) + dx / l * (radius + 0.02 - r), tip))
                        wanted[k] = 0;
            }
            append_level_runs(foot, c, to_units(tip), wanted,
                              simplify_tolerance_units(cut.job.tolerances.gouge), levels.back());
        }
    }
}

}  // namespace slabwright
