#include "kernels/features/cavities.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/medial_axis.h"
#include "kernels/polygons/thinned.h"
#include "kernels/slicing/silhouette.h"

namespace slabwright {

namespace {

constexpr double kUnderFlat = 0.001;  // mm, of the section that stands for what lies just under a flat
constexpr double kAxisStep = 1;       // mm, between points of an axis
constexpr double kMostLevels = 150;
constexpr double kMostFlats = 400;   // the largest of which get levels of their own
constexpr double kSameWidth = 1e-3;  // mm
constexpr double kTip = 0.05;        // share of a level's area: the narrowest may be the tip of a wedge
constexpr double kSmallLevel = 0.1;  // of the largest level: less of a cavity does not say how wide it is
constexpr double kWidthJump = 0.1;   // by which the width may differ from level to level
const double kSteep =
    std::tan(std::numbers::pi / 6);  // and with leaning walls: to either side, up the height

/// A height at which the air is looked at.
struct CutHeight {
    double cut = 0;   ///< where the section is taken
    double told = 0;  ///< of which it tells
    std::size_t layer = 0;
    double layer_top = 0;
};

std::vector<double> flat_heights(std::span<const Feature> features) {
    std::vector<const Feature*> flats;
    for (const Feature& f : features)
        if (f.type == FeatureType::up_flat || f.type == FeatureType::down_flat) flats.push_back(&f);
    std::stable_sort(flats.begin(), flats.end(),
                     [](const Feature* a, const Feature* b) { return a->area > b->area; });
    std::vector<double> heights;
    for (const Feature* f : flats) {
        if (static_cast<double>(heights.size()) >= kMostFlats) break;
        heights.push_back(f->z_low);
    }
    std::sort(heights.begin(), heights.end());
    return heights;
}

std::vector<CutHeight> cut_heights(double base, std::span<const double> layer_tops,
                                   std::span<const Feature> features, double step) {
    const std::vector<double> flats = flat_heights(features);
    std::vector<CutHeight> heights;
    double bottom = base;
    for (std::size_t l = 0; l < layer_tops.size(); ++l) {
        const double top = layer_tops[l];
        double from = bottom;
        const auto up_to = [&](double to) {
            if (to - from < 3 * kUnderFlat) return;
            const auto pieces = std::max(1.0, std::ceil((to - from) / step));
            for (double i = 0; i < pieces; ++i) {
                const double z = from + (to - from) * i / pieces;
                heights.push_back({z, z, l, top});
            }
            heights.push_back({to - kUnderFlat, to, l, top});
            from = to;
        };
        for (auto z = std::upper_bound(flats.begin(), flats.end(), bottom); z != flats.end() && *z < top; ++z)
            up_to(*z);
        up_to(top);
        bottom = top;
    }
    return heights;
}

/// What hangs together of one level's axis.
struct Piece {
    std::vector<MedialPoint> points;
    std::vector<WidthShare> widths;  // ascending
    double length = 0;
};

std::uint32_t root_of(std::vector<std::uint32_t>& parents, std::uint32_t i) {
    while (parents[i] != i) i = parents[i] = parents[parents[i]];
    return i;
}
void join(std::vector<std::uint32_t>& parents, std::uint32_t i, std::uint32_t j) {
    i = root_of(parents, i), j = root_of(parents, j);
    parents[std::max(i, j)] = std::min(i, j);
}
std::vector<std::uint32_t> alone(std::size_t n) {
    std::vector<std::uint32_t> parents(n);
    std::iota(parents.begin(), parents.end(), 0U);
    return parents;
}

/// Ascending, those of the same width together.
void sum_up(std::vector<WidthShare>& widths) {
    std::sort(widths.begin(), widths.end(), [](const WidthShare& a, const WidthShare& b) {
        return std::tie(a.width_mm, a.area_mm2) < std::tie(b.width_mm, b.area_mm2);
    });
    std::vector<WidthShare> sums;
    for (const WidthShare& w : widths) {
        if (sums.empty() || w.width_mm - sums.back().width_mm > kSameWidth) sums.push_back(w);
        else sums.back().area_mm2 += w.area_mm2;
    }
    widths = std::move(sums);
}

std::vector<Piece> pieces_of(const MedialAxis& axis, double least_clearance) {
    const std::size_t n = axis.points.size();
    std::vector<std::uint32_t> parents = alone(n);
    std::vector<int> links(n, 0);
    const auto wide_enough = [&](const MedialLink& l) {
        return std::min(axis.points[l.from].clearance, axis.points[l.to].clearance) >= least_clearance;
    };
    for (const MedialLink& l : axis.links)
        if (wide_enough(l)) join(parents, l.from, l.to), ++links[l.from], ++links[l.to];
    std::vector<std::uint32_t> piece_of(n, UINT32_MAX);
    std::vector<Piece> pieces;
    for (std::uint32_t i = 0; i < n; ++i) {
        const MedialPoint& p = axis.points[i];
        if (p.clearance < least_clearance) continue;
        const std::uint32_t root = root_of(parents, i);
        if (piece_of[root] == UINT32_MAX) {
            piece_of[root] = static_cast<std::uint32_t>(pieces.size());
            pieces.emplace_back();
        }
        Piece& piece = pieces[piece_of[root]];
        piece.points.push_back(p);
        // At an end of the axis half a disc lies beyond it.
        const double discs = links[i] == 0 ? 1 : links[i] == 1 ? 0.5 : 0;
        if (discs > 0)
            piece.widths.push_back({2 * p.clearance, discs * std::numbers::pi * p.clearance * p.clearance});
    }
    for (const MedialLink& l : axis.links) {
        if (!wide_enough(l)) continue;
        const MedialPoint &a = axis.points[l.from], &b = axis.points[l.to];
        const double length = std::hypot(a.x - b.x, a.y - b.y);
        Piece& piece = pieces[piece_of[root_of(parents, l.from)]];
        piece.length += length;
        piece.widths.push_back({a.clearance + b.clearance, length * (a.clearance + b.clearance)});
    }
    for (Piece& piece : pieces) sum_up(piece.widths);
    return pieces;
}

/// Points of some pieces, found by where they lie.
class PointGrid {
public:
    PointGrid(const std::vector<Piece>& pieces, double cell) : cell_(cell) {
        for (std::uint32_t i = 0; i < pieces.size(); ++i)
            for (const MedialPoint& p : pieces[i].points) entries_.push_back({key(p.x, p.y), i, &p});
        std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
            return std::tie(a.cell, a.piece, a.point) < std::tie(b.cell, b.piece, b.point);
        });
    }

    /// take(piece, point) for all in the nine cells about a place.
    template <class Take>
    void near(double x, double y, Take&& take) const {
        for (int dx = -1; dx <= 1; ++dx)
            for (int dy = -1; dy <= 1; ++dy) {
                const std::pair<std::int32_t, std::int32_t> wanted = key(x + dx * cell_, y + dy * cell_);
                auto e = std::lower_bound(entries_.begin(), entries_.end(), wanted,
                                          [](const Entry& a, const auto& cell) { return a.cell < cell; });
                for (; e != entries_.end() && e->cell == wanted; ++e) take(e->piece, *e->point);
            }
    }

private:
    struct Entry {
        std::pair<std::int32_t, std::int32_t> cell;
        std::uint32_t piece;
        const MedialPoint* point;
    };
    [[nodiscard]] std::pair<std::int32_t, std::int32_t> key(double x, double y) const {
        return {static_cast<std::int32_t>(std::floor(x / cell_)),
                static_cast<std::int32_t>(std::floor(y / cell_))};
    }
    double cell_;
    std::vector<Entry> entries_;
};

/// Calls joined(i, j) for the pieces of two levels that lie over each other and are about as wide.
template <class Joined>
void each_over(const std::vector<Piece>& lower, const std::vector<Piece>& upper, double height,
               double most_clearance, Joined&& joined) {
    if (lower.empty() || upper.empty()) return;
    const PointGrid grid(lower, std::max(most_clearance, kAxisStep));
    for (std::uint32_t j = 0; j < upper.size(); ++j)
        for (const MedialPoint& q : upper[j].points)
            grid.near(q.x, q.y, [&](std::uint32_t i, const MedialPoint& p) {
                const double wider = std::max(p.clearance, q.clearance);
                if (2 * std::abs(p.clearance - q.clearance) >
                    kWidthJump * 2 * wider + 2 * height * kSteep + kSameWidth)
                    return;
                if (std::hypot(p.x - q.x, p.y - q.y) <= std::max(wider, 0.6 * kAxisStep)) joined(i, j);
            });
}

/// All but the narrowest twentieth of it is as wide as that.
double narrowest(const CavityLevel& level) {
    double passed = 0;
    const double tip = kTip * level.area_mm2();
    for (const WidthShare& w : level.widths) {
        passed += w.area_mm2;
        if (passed > tip) return w.width_mm;
    }
    return level.widths.back().width_mm;
}

/// A piece and the height that it belongs to.
struct PieceAt {
    const CutHeight* height;
    const Piece* piece;
};

/// Of the lowest of its pieces the point nearest to their middle.
Point3 middle_of_floor(const std::vector<PieceAt>& members) {
    std::vector<const MedialPoint*> points;
    for (const PieceAt& m : members)
        if (m.height == members.front().height)
            for (const MedialPoint& p : m.piece->points) points.push_back(&p);
    double x = 0, y = 0;
    for (const MedialPoint* p : points) x += p->x, y += p->y;
    const auto n = static_cast<double>(points.size());
    const MedialPoint* nearest =
        *std::min_element(points.begin(), points.end(), [&](const MedialPoint* a, const MedialPoint* b) {
            return std::hypot(a->x - x / n, a->y - y / n) < std::hypot(b->x - x / n, b->y - y / n);
        });
    return {nearest->x, nearest->y, members.front().height->told};
}

/// @param members from below
NarrowCavity cavity_of(const std::vector<PieceAt>& members) {
    NarrowCavity cavity;
    cavity.low_mm = members.front().height->told;
    cavity.high_mm = members.back().height->told;
    cavity.at = middle_of_floor(members);
    for (std::size_t i = 0, next = 0; i < members.size(); i = next) {
        const CutHeight& height = *members[i].height;
        CavityLevel level{height.told, {}};
        double length = 0;
        for (next = i; next < members.size() && members[next].height == &height; ++next) {
            const Piece& piece = *members[next].piece;
            level.widths.insert(level.widths.end(), piece.widths.begin(), piece.widths.end());
            length += piece.length;
        }
        sum_up(level.widths);
        cavity.length_mm = std::max(cavity.length_mm, length);
        cavity.widest_mm = std::max(cavity.widest_mm, level.widths.back().width_mm);
        cavity.levels.push_back(std::move(level));
        if (cavity.layers.empty() || cavity.layers.back().layer != height.layer)
            cavity.layers.push_back({height.layer, height.layer_top, height.told, height.told});
        cavity.layers.back().high_mm = height.told;
    }
    const double largest = cavity.area_mm2();
    cavity.width_mm = cavity.widest_mm;
    for (const CavityLevel& level : cavity.levels)
        if (level.area_mm2() >= kSmallLevel * largest)
            cavity.width_mm = std::min(cavity.width_mm, narrowest(level));
    return cavity;
}

void check(std::span<const double> layer_tops, const CavityOptions& o) {
    const auto wrong = [](const std::string& what) {
        throw Error(ErrorKind::usage, "cavities.options", what);
    };
    if (!(o.least_width_mm > 0 && o.least_width_mm < o.most_width_mm && std::isfinite(o.most_width_mm)))
        wrong("the widths of cavities are out of order");
    if (!(o.least_ratio >= 0 && o.least_depth_mm >= 0 && o.step_mm > 0 && std::isfinite(o.step_mm)))
        wrong("the least ratio and depth of cavities must not be negative, the step be over 0");
    if (!std::is_sorted(layer_tops.begin(), layer_tops.end())) wrong("the layers' tops must ascend");
}

}  // namespace

double CavityLevel::area_mm2() const {
    double sum = 0;
    for (const WidthShare& w : widths) sum += w.area_mm2;
    return sum;
}

double CavityLevel::area_under(double diameter_mm) const {
    double sum = 0;
    for (const WidthShare& w : widths)
        if (w.width_mm < diameter_mm - kSameWidth) sum += w.area_mm2;
    return sum;
}

double NarrowCavity::area_mm2() const {
    double most = 0;
    for (const CavityLevel& level : levels) most = std::max(most, level.area_mm2());
    return most;
}

double NarrowCavity::area_under(double diameter_mm) const {
    double most = 0;
    for (const CavityLevel& level : levels) most = std::max(most, level.area_under(diameter_mm));
    return most;
}

std::vector<NarrowCavity> find_cavities(Context& context, MeshView mesh, std::span<const double> layer_tops,
                                        std::span<const Feature> features, const CavityOptions& options) {
    check(layer_tops, options);
    if (mesh.size() == 0 || layer_tops.empty()) return {};
    const double base = bounds(context, mesh).min.z;
    const double step = std::max(options.step_mm, (layer_tops.back() - base) / kMostLevels);
    const std::vector<CutHeight> heights = cut_heights(base, layer_tops, features, step);
    std::vector<HeightRange> ranges;
    for (const CutHeight& h : heights) ranges.push_back({h.cut, h.layer_top});
    std::vector<Loops> solids = shadows(context, mesh, ranges);
    const double most_clearance = options.most_width_mm / 2;
    std::vector<std::vector<Piece>> pieces(heights.size());
    parallel_each(context, heights.size(), [&](std::size_t i) {
        const Loops solid = lighter(std::move(solids[i]));
        const MedialAxis axis =
            narrow_axis(solid, {.most_clearance_mm = most_clearance, .step_mm = kAxisStep});
        pieces[i] = pieces_of(axis, options.least_width_mm / 2);
    });

    std::vector<std::uint32_t> first(heights.size() + 1, 0);
    for (std::size_t i = 0; i < heights.size(); ++i)
        first[i + 1] = first[i] + static_cast<std::uint32_t>(pieces[i].size());
    std::vector<std::uint32_t> parents = alone(first.back());
    for (std::size_t i = 0; i + 1 < heights.size(); ++i)
        each_over(pieces[i], pieces[i + 1], heights[i + 1].told - heights[i].told, most_clearance,
                  [&](std::uint32_t p, std::uint32_t q) { join(parents, first[i] + p, first[i + 1] + q); });
    std::map<std::uint32_t, std::vector<PieceAt>> members;
    for (std::size_t i = 0; i < heights.size(); ++i)
        for (std::uint32_t p = 0; p < pieces[i].size(); ++p)
            members[root_of(parents, first[i] + p)].push_back({&heights[i], &pieces[i][p]});

    std::vector<NarrowCavity> found;
    for (const auto& [root, of_one] : members) {
        NarrowCavity cavity = cavity_of(of_one);
        if (cavity.depth_mm() >= options.least_depth_mm && cavity.ratio() >= options.least_ratio)
            found.push_back(std::move(cavity));
    }
    std::stable_sort(found.begin(), found.end(), [](const NarrowCavity& a, const NarrowCavity& b) {
        const double ra = a.ratio(), rb = b.ratio();
        return ra != rb ? ra > rb : a.at < b.at;
    });
    return found;
}

}  // namespace slabwright
