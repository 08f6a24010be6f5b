// A plate of square tiles with one feature in each. Every tile is meshed by rings of equally many vertices,
// from its square border inward, so neighbours share their border vertices and the whole is closed, whatever
// the number of facets; and nothing but one ring is ever held.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "tests/data/sweep.h"

namespace slabwright {

namespace {

constexpr double kPlate = 0.12;            // thickness of the plate, share of the height
constexpr double kDraft = 3;               // degrees from vertical
constexpr std::uint64_t kFewestRings = 8;  // the longest profile has seven segments and a cap

/// splitmix64: the same numbers on every machine, unlike the distributions of <random>.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next() {
        std::uint64_t v = state_ += 0x9E3779B97F4A7C15u;
        v = (v ^ v >> 30) * 0xBF58476D1CE4E5B9u;
        v = (v ^ v >> 27) * 0x94D049BB133111EBu;
        return v ^ v >> 31;
    }
    std::uint64_t below(std::uint64_t n) { return next() % n; }
    double between(double low, double high) {
        return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53;
    }

private:
    std::uint64_t state_;
};

/// How the facets are shared out: tiles × tiles, `around` vertices to a ring, `rings` strips and a fan in
/// each tile.
struct Grid {
    std::uint64_t tiles = 1, around = 16, rings = kFewestRings;
    [[nodiscard]] std::uint64_t facets() const {
        return around * (tiles * tiles * (2 * rings + 1) + 3 * tiles);
    }
};

Grid share_out(const MetrePattern& pattern) {
    if (!(pattern.size_mm > 0) || !(pattern.height_mm > 0) || pattern.facets == 0)
        throw std::invalid_argument("metre_pattern: size, height and facets must be positive");
    Grid best;
    best.tiles = pattern.facets >= 12'000 ? 8 : pattern.facets >= 3000 ? 4 : pattern.facets >= 800 ? 2 : 1;
    if (pattern.height_mm > 3 * pattern.size_mm / static_cast<double>(best.tiles))
        throw std::invalid_argument(
            "metre_pattern: the height is over 3 × size / tiles, drafted walls do not fit");
    // Twice as many vertices around as rings, so that facets keep their shape as they grow in number, and
    // hardly more than were wished for: one per cent too many counts as much as a shape that is a tenth off.
    const double area = static_cast<double>(pattern.facets) / static_cast<double>(best.tiles * best.tiles);
    const std::uint64_t middle =
        std::max<std::uint64_t>(kFewestRings, static_cast<std::uint64_t>(std::sqrt(area / 4)));
    double least = std::numeric_limits<double>::infinity();
    for (std::uint64_t rings = std::max(kFewestRings, middle / 2); rings <= middle + middle / 2 + 4;
         ++rings) {
        Grid grid{best.tiles, 1, rings};
        grid.around =
            std::max<std::uint64_t>(16, (pattern.facets + 8 * grid.facets() - 1) / (8 * grid.facets()) * 8);
        const double excess = static_cast<double>(grid.facets()) / static_cast<double>(pattern.facets) - 1;
        const double shape = std::log(static_cast<double>(grid.around) / static_cast<double>(2 * rings));
        if (const double cost = excess + 0.1 * std::abs(shape); cost < least) least = cost, best = grid;
    }
    return best;
}

/// What stands on a tile: an outline (a rectangle with rounded corners around the tile's centre), a profile,
/// and a cap.
struct Feature {
    double half_x = 0, half_y = 0, corner = 0;
    Profile profile;
    double dome = 0;  ///< height of the paraboloid over the last ring; 0: a flat
};

/// The outline's point number i of `around`, counter-clockwise. A quarter of them belongs to each side of the
/// tile, from the middle of one corner's arc to that of the next, shared out by length but always with one
/// where an arc begins, so that walls are true planes and cones and ends of ribs as smooth as bosses. Both
/// this and the border run monotonically along the side, with the border further out, so that nothing between
/// them folds over.
OutlinePoint outline_point(const Feature& f, std::size_t i, std::size_t around) {
    const std::size_t quarter = around / 4, half = quarter / 2, side = i / quarter, k = i % quarter;
    // Outward normal and running direction of the sides: bottom, right, top, left.
    constexpr double normals[4][2] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};
    const double nx = normals[side][0], ny = normals[side][1], tx = -ny, ty = nx;
    const double out = side % 2 ? f.half_x : f.half_y, straight = (side % 2 ? f.half_y : f.half_x) - f.corner;
    const double arc = f.corner * std::numbers::pi / 4;
    // Steps from the side's middle to the end of its straight part, and from there to the middle of the arc.
    std::size_t on_straight = 0;
    if (straight > 1e-9)
        on_straight = std::clamp<std::size_t>(
            static_cast<std::size_t>(static_cast<double>(half) * straight / (straight + arc) + 0.5), 1,
            half - 1);
    const std::size_t step = k < half ? half - k : k - half;
    const double sign = k < half ? -1 : 1;
    double angle = 0, run = straight;
    if (step < on_straight) run = straight * static_cast<double>(step) / static_cast<double>(on_straight);
    else
        angle = std::numbers::pi / 4 * static_cast<double>(step - on_straight) /
                static_cast<double>(half - on_straight);
    const double across = out - f.corner * (1 - std::cos(angle)),
                 along = sign * (run + f.corner * std::sin(angle));
    const double c = std::cos(angle), d = sign * std::sin(angle);
    return {nx * across + tx * along, ny * across + ty * along, nx * c + tx * d, ny * c + ty * d};
}

/// @param base the plate's top, @param top the tile's highest point
Feature make_feature(Random& random, double tile, double base, double top) {
    const double draft = std::tan(kDraft * std::numbers::pi / 180);
    const std::uint64_t kind = random.below(5);
    Feature f;
    double offset = 0;
    const auto wall = [&](double from, double to) {
        offset -= std::abs(to - from) * draft;
        f.profile.push_back({offset, to});
    };
    const auto ledge = [&](double width) {
        offset -= width;
        f.profile.push_back({offset, f.profile.back().z});
    };
    f.profile.push_back({0, base});
    const double rise = top - base;
    if (kind == 0) {  // round boss under a dome
        f.dome = rise * random.between(0.1, 0.3);
        wall(base, top - f.dome);
    } else if (kind == 1) {  // stepped boss
        const double step = base + rise * random.between(0.3, 0.7);
        wall(base, step), ledge(tile * random.between(0.03, 0.05)), wall(step, top);
    } else if (kind == 2) {  // crater
        wall(base, top), ledge(tile * random.between(0.03, 0.05)),
            wall(top, top - rise * random.between(0.2, 0.6));
    } else if (kind == 3) {  // rib
        wall(base, top);
    } else {  // a low wall that carries a high dome
        const double step = base + rise * random.between(0.2, 0.4);
        wall(base, step);
        f.dome = top - step;
    }
    // Corners must be rounder than all that is taken off them; ribs are no wider than that.
    const double room = 0.42 * tile;
    const bool rib = kind == 3, round = kind == 0 || kind == 4;
    f.corner =
        std::min(room, -offset + tile * (rib ? random.between(0.03, 0.06) : random.between(0.12, 0.22)));
    f.half_x = round ? f.corner : f.corner + (room - f.corner) * random.between(0.3, 1.0);
    f.half_y = round || rib ? f.corner : f.corner + (room - f.corner) * random.between(0.0, 1.0);
    if (random.below(2)) std::swap(f.half_x, f.half_y);
    return f;
}

/// Shares `rings` strips among segments by their lengths, at least one each: what is left goes where strips
/// are longest.
std::vector<std::uint64_t> strips_of(const std::vector<double>& lengths, std::uint64_t rings) {
    std::vector<std::uint64_t> strips(lengths.size(), 1);
    double total = 0;
    for (const double length : lengths) total += length;
    std::uint64_t used = lengths.size();
    const std::uint64_t spare = rings - used;
    for (std::size_t i = 0; i < lengths.size(); ++i) {
        const auto share = static_cast<std::uint64_t>(lengths[i] / total * static_cast<double>(spare));
        strips[i] += share, used += share;
    }
    for (; used < rings; ++used) {
        std::size_t longest = 0;
        for (std::size_t i = 1; i < lengths.size(); ++i)
            if (lengths[i] / static_cast<double>(strips[i]) >
                lengths[longest] / static_cast<double>(strips[longest]))
                longest = i;
        ++strips[longest];
    }
    return strips;
}

void send(std::vector<Facet>& facets, const std::function<void(const Facet&)>& sink) {
    for (const Facet& facet : facets) sink(facet);
    facets.clear();
}

/// Meshes one tile from its border ring inward.
void mesh_tile(const Ring& border, const Feature& f, double centre_x, double centre_y, std::uint64_t rings,
               const std::function<void(const Facet&)>& sink) {
    Outline outline;
    for (std::size_t i = 0; i < border.size(); ++i) outline.push_back(outline_point(f, i, border.size()));

    // Lengths of the flat around the feature, of the profile's segments, and of the cap.
    std::vector<double> lengths{std::max(1e-3, border[border.size() / 8].x - centre_x - f.half_x)};
    for (std::size_t i = 1; i < f.profile.size(); ++i)
        lengths.push_back(
            std::hypot(f.profile[i].offset - f.profile[i - 1].offset, f.profile[i].z - f.profile[i - 1].z));
    const double end_offset = f.profile.back().offset, end_z = f.profile.back().z;
    lengths.push_back(std::hypot(std::max(f.half_x, f.half_y) + end_offset, f.dome));
    const std::vector<std::uint64_t> strips = strips_of(lengths, rings);

    std::vector<Facet> facets;
    Ring last = border;
    const auto step_to = [&](Ring next) {
        strip(facets, last, next);
        send(facets, sink);
        last = std::move(next);
    };
    for (std::size_t segment = 0; segment < strips.size(); ++segment) {
        const bool around = segment == 0, cap = segment + 1 == strips.size();
        const std::uint64_t n = strips[segment];
        // The cap's last step is the fan that follows.
        for (std::uint64_t k = 1; k <= n; ++k) {
            const double share = static_cast<double>(k) / static_cast<double>(cap ? n + 1 : n);
            Ring next;
            for (std::size_t i = 0; i < border.size(); ++i) {
                const OutlinePoint& p = outline[i];
                double x = 0, y = 0, z = 0;
                if (around) {
                    x = border[i].x + share * (centre_x + p.x - border[i].x);
                    y = border[i].y + share * (centre_y + p.y - border[i].y);
                    z = border[i].z;
                } else if (cap) {
                    const double s = 1 - share;
                    x = centre_x + s * (p.x + end_offset * p.nx);
                    y = centre_y + s * (p.y + end_offset * p.ny);
                    z = end_z + f.dome * (1 - s * s);
                } else {
                    const ProfilePoint &a = f.profile[segment - 1], &b = f.profile[segment];
                    const double offset = a.offset + share * (b.offset - a.offset);
                    x = centre_x + p.x + offset * p.nx;
                    y = centre_y + p.y + offset * p.ny;
                    z = k == n ? b.z : a.z + share * (b.z - a.z);
                }
                next.push_back({on_grid(x), on_grid(y), on_grid(z)});
            }
            step_to(std::move(next));
        }
    }
    fan(facets, last, {on_grid(centre_x), on_grid(centre_y), on_grid(end_z + f.dome)});
    send(facets, sink);
}

}  // namespace

std::uint64_t metre_pattern_facets(const MetrePattern& pattern) { return share_out(pattern).facets(); }

void metre_pattern(const MetrePattern& pattern, const std::function<void(const Facet&)>& sink) {
    const Grid grid = share_out(pattern);
    const std::uint64_t side = grid.around / 4, steps = grid.tiles * side;
    const double base = pattern.height_mm * kPlate;
    const double inset = base * std::tan(kDraft * std::numbers::pi / 180);
    const auto at_foot = [&](std::uint64_t i) {
        return on_grid(pattern.size_mm * static_cast<double>(i) / static_cast<double>(steps));
    };
    const auto at_top = [&](std::uint64_t i) {
        return on_grid(inset +
                       (pattern.size_mm - 2 * inset) * static_cast<double>(i) / static_cast<double>(steps));
    };
    // The square from (i, j), n steps wide, counter-clockwise.
    const auto square = [](std::uint64_t i, std::uint64_t j, std::uint64_t n, auto&& at, float z) {
        Ring ring;
        for (std::uint64_t k = 0; k < n; ++k) ring.push_back({at(i + k), at(j), z});
        for (std::uint64_t k = 0; k < n; ++k) ring.push_back({at(i + n), at(j + k), z});
        for (std::uint64_t k = 0; k < n; ++k) ring.push_back({at(i + n - k), at(j + n), z});
        for (std::uint64_t k = 0; k < n; ++k) ring.push_back({at(i), at(j + n - k), z});
        return ring;
    };

    const Ring foot = square(0, 0, steps, at_foot, 0), rim = square(0, 0, steps, at_top, on_grid(base));
    std::vector<Facet> facets;
    const float middle = on_grid(pattern.size_mm / 2);
    fan(facets, Ring(foot.rbegin(), foot.rend()), {middle, middle, 0});
    strip(facets, foot, rim);
    send(facets, sink);

    Random random(pattern.seed);
    const std::uint64_t tallest = random.below(grid.tiles * grid.tiles);
    const double tile = (pattern.size_mm - 2 * inset) / static_cast<double>(grid.tiles);
    for (std::uint64_t j = 0; j < grid.tiles; ++j) {
        for (std::uint64_t i = 0; i < grid.tiles; ++i) {
            // Seven heights, the middle ones oftener, so that flats of several tiles lie level as in real
            // patterns.
            const double step = static_cast<double>(1 + random.below(4) + random.below(4)) / 12;
            const bool full = j * grid.tiles + i == tallest;
            const Feature feature = make_feature(
                random, tile, base, full ? pattern.height_mm : base + (pattern.height_mm - base) * step);
            const double centre_x = inset + tile * (static_cast<double>(i) + 0.5),
                         centre_y = inset + tile * (static_cast<double>(j) + 0.5);
            mesh_tile(square(i * side, j * side, side, at_top, on_grid(base)), feature, centre_x, centre_y,
                      grid.rings, sink);
        }
    }
}

}  // namespace slabwright
