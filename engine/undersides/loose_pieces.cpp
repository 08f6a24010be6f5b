#include "engine/undersides/loose_pieces.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

#include "engine/undersides/underside_target.h"
#include "kernels/polygons/pieces.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kApart = 2;        // mm between sections, at most
constexpr double kInside = 0.1;     // mm: the first and the last lie so far from floor and top
constexpr double kHolds = 20;       // mm² that hold a piece
constexpr double kSplinter = 1;     // mm²: a piece less large is none
constexpr double kCornerMm = 0.05;  // of the rim, which every section has there

/// Sets of pieces that hold together.
class Bonds {
public:
    explicit Bonds(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }
    std::size_t root(std::size_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::size_t a, std::size_t b) { parent_[root(a)] = root(b); }

private:
    std::vector<std::size_t> parent_;
};

struct Level {
    Pieces pieces;
    std::size_t first = 0;  ///< number of its first piece
};

void bind(const Level& lower, const Level& upper, Bonds& bonds) {
    for (std::size_t a = 0; a < lower.pieces.size(); ++a)
        for (std::size_t b = 0; b < upper.pieces.size(); ++b) {
            const Loops &one = lower.pieces.regions[a], &other = upper.pieces.regions[b];
            if (!lower.pieces.boxes[a].meets(upper.pieces.boxes[b])) continue;
            const double least = std::min({kHolds, area(one) / 2, area(other) / 2});
            if (area(intersect(one, other)) >= least) bonds.join(lower.first + a, upper.first + b);
        }
}

}  // namespace

bool hangs_together(Context& context, const Mesh& target, const TurnedSlab& slab) {
    const double low = recess_floor(slab) + kInside, high = slab.slab_thickness - kInside;
    const int steps = std::max(1, static_cast<int>(std::ceil((high - low) / kApart)));
    std::vector<Plane> planes;
    for (int k = 0; k <= steps; ++k) planes.push_back({low + (high - low) * k / steps, Side::above});
    const std::vector<Section> sections = slice(context, target.view(), planes);
    std::vector<Level> levels;
    std::size_t count = 0;
    for (const Section& section : sections) {
        levels.push_back({Pieces(section.loops), count});
        count += levels.back().pieces.size();
    }
    Bonds bonds(count);
    for (std::size_t k = 0; k + 1 < levels.size(); ++k) bind(levels[k], levels[k + 1], bonds);
    const Point2 corner{to_units(kCornerMm), to_units(kCornerMm)};
    std::size_t rim = count;
    for (std::size_t i = 0; i < levels.front().pieces.size(); ++i)
        if (winding(levels.front().pieces.regions[i], corner) != 0) rim = levels.front().first + i;
    if (rim == count) return false;
    for (const Level& level : levels)
        for (std::size_t i = 0; i < level.pieces.size(); ++i)
            if (area(level.pieces.regions[i]) >= kSplinter && bonds.root(level.first + i) != bonds.root(rim))
                return false;
    return true;
}

}  // namespace slabwright
