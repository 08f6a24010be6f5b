#include "engine/sheets/engraving.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/border_distance.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

constexpr double kArcTolerance = 0.002;
constexpr double kBarBelow = 0.25;  ///< of a digit's height
constexpr int kPlacesAcross = 24;   ///< of an island that are looked at for a number
constexpr int kMostTried = 64;      ///< of them whose box is held against the border
constexpr double kSmaller = 0.8;    ///< of one height of digits to the next
constexpr double kOnEdge = 0.02;    ///< mm

struct Corner {
    double x = 0, y = 0;
};
using Stroke = std::vector<Corner>;

/// On a field of 4 by 6; what looks like another digit when turned has the bar to tell it.
const std::vector<Stroke>& glyph(char c) {
    static const std::array<std::vector<Stroke>, 11> glyphs{{
        {{{1, 0}, {3, 0}, {4, 1}, {4, 5}, {3, 6}, {1, 6}, {0, 5}, {0, 1}, {1, 0}}},
        {{{1, 5}, {2, 6}, {2, 0}}},
        {{{0, 5}, {1, 6}, {3, 6}, {4, 5}, {4, 4}, {0, 0}, {4, 0}}},
        {{{0, 5}, {1, 6}, {3, 6}, {4, 5}, {4, 4}, {3, 3}, {4, 2}, {4, 1}, {3, 0}, {1, 0}, {0, 1}},
         {{1.5, 3}, {3, 3}}},
        {{{3, 0}, {3, 6}, {0, 2}, {4, 2}}},
        {{{4, 6}, {0, 6}, {0, 3.5}, {3, 3.5}, {4, 2.5}, {4, 1}, {3, 0}, {1, 0}, {0, 1}}},
        {{{4, 5}, {3, 6}, {1, 6}, {0, 5}, {0, 1}, {1, 0}, {3, 0}, {4, 1}, {4, 2.5}, {3, 3.5}, {0, 3.5}}},
        {{{0, 6}, {4, 6}, {1.5, 0}}},
        {{{1, 3},
          {0, 4},
          {0, 5},
          {1, 6},
          {3, 6},
          {4, 5},
          {4, 4},
          {3, 3},
          {1, 3},
          {0, 2},
          {0, 1},
          {1, 0},
          {3, 0},
          {4, 1},
          {4, 2},
          {3, 3}}},
        {{{0, 1}, {1, 0}, {3, 0}, {4, 1}, {4, 5}, {3, 6}, {1, 6}, {0, 5}, {0, 3.5}, {1, 2.5}, {4, 2.5}}},
        {{{0.5, 3}, {3.5, 3}}},
    }};
    return glyphs[c >= '0' && c <= '9' ? static_cast<std::size_t>(c - '0') : 10];
}

double width_of(const std::string& text, double height) {
    return height / 6 * (6 * static_cast<double>(text.size()) - 2);
}

/// Whether the border of a region meets a box, which may be as thin as a line.
bool border_meets(const Loops& region, const Box2& box) {
    for (std::size_t l = 0; l < region.size(); ++l) {
        const auto loop = region.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 a = loop[i], b = loop[(i + 1) % loop.size()];
            if (std::max(a.x, b.x) < box.min.x || std::min(a.x, b.x) > box.max.x ||
                std::max(a.y, b.y) < box.min.y || std::min(a.y, b.y) > box.max.y)
                continue;
            // All four corners on one side of the edge: it passes by.
            int left = 0;
            for (const Point2 c :
                 {box.min, Point2{box.max.x, box.min.y}, box.max, Point2{box.min.x, box.max.y}})
                left +=
                    (double(b.x) - a.x) * (double(c.y) - a.y) - (double(b.y) - a.y) * (double(c.x) - a.x) > 0;
            if (left != 0 && left != 4) return true;
        }
    }
    return false;
}

bool holds_box(const Loops& region, const Box2& box) {
    return winding(region, box.min) > 0 && !border_meets(region, box);
}

/// The place that is farthest from the border among those where a number fits, and how high its digits are.
struct Found {
    Point2 middle;
    double height = 0;
};

/// The box of a number's strokes, about its middle.
Box2 box_of(const std::string& text, double height, Point2 middle) {
    const std::int32_t w = to_units(width_of(text, height) / 2), h = to_units(height * (1 + kBarBelow) / 2);
    return {{middle.x - w, middle.y - h}, {middle.x + w, middle.y + h}};
}

/// @param room where strokes' middles may run. @param island of which room counts here
std::optional<Found> place_of(const std::string& text, const Loops& room, const BorderDistance& to_border,
                              const Loops& island, const EngraveRules& rules) {
    Box2 box;
    for (const Point2 p : island.loop(0)) box.grow(p);
    struct Candidate {
        double away = 0;
        Point2 at;
    };
    std::vector<Candidate> candidates;
    for (int j = 0; j < kPlacesAcross; ++j)
        for (int i = 0; i < kPlacesAcross; ++i) {
            const auto along = [](std::int32_t low, std::int32_t high, int k) {
                return static_cast<std::int32_t>(low + (double(high) - low) * (k + 0.5) / kPlacesAcross);
            };
            const Point2 p{along(box.min.x, box.max.x, i), along(box.min.y, box.max.y, j)};
            if (winding(room, p) <= 0 || winding(island, p) <= 0) continue;
            candidates.push_back({to_border(p), p});
        }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.away > b.away; });
    if (candidates.size() > kMostTried) candidates.resize(kMostTried);
    for (double height = rules.height; height > rules.least * 0.999; height *= kSmaller)
        for (const Candidate& c : candidates) {
            if (c.away < height * (1 + kBarBelow) / 2) break;
            if (holds_box(room, box_of(text, height, c.at))) return Found{c.at, height};
        }
    return std::nullopt;
}

Engraving engraved(const std::string& text, const Found& found) {
    Engraving number{text, found.middle, digit_strokes(text, found.height)};
    const Box2 box = box_of(text, found.height, found.middle);
    const std::int32_t up = to_units(found.height * kBarBelow);
    for (auto& stroke : number.strokes)
        for (Point2& p : stroke) p = {p.x + box.min.x, p.y + box.min.y + up};
    return number;
}

/// Where strokes' middles may run in a region.
Loops room_in(const Loops& region, const EngraveRules& rules) {
    return region.empty() ? Loops{} : offset(region, -(rules.wall + rules.width / 2), kArcTolerance);
}

void add_numbers(const EngravedFace& face, int number, const Loops& covered, const EngraveRules& rules,
                 std::vector<Engraving>& all) {
    const Loops tabs = room_in(face.tabs, rules);
    const BorderDistance to_covered(covered), to_tabs(tabs);
    const Pieces islands(face.outline);
    for (std::size_t i = 0; i < islands.size(); ++i) {
        const std::string text =
            islands.size() == 1 ? fmt::format("{}", number) : fmt::format("{}-{}", number, i + 1);
        std::optional<Found> found = place_of(text, covered, to_covered, islands.regions[i], rules);
        if (!found) found = place_of(text, tabs, to_tabs, islands.regions[i], rules);
        if (found) all.push_back(engraved(text, *found));
    }
}

/// Boxes of the strokes that are there, each with a stroke's width and wall around it.
std::vector<Box2> kept_clear(const std::vector<Engraving>& all, const EngraveRules& rules) {
    const std::int32_t around = to_units(rules.width + rules.wall);
    std::vector<Box2> boxes;
    for (const Engraving& one : all) {
        Box2 box;
        for (const auto& stroke : one.strokes)
            for (const Point2 p : stroke) box.grow(p);
        box.min = {box.min.x - around, box.min.y - around};
        box.max = {box.max.x + around, box.max.y + around};
        boxes.push_back(box);
    }
    return boxes;
}

/// Where a border reaches farthest to one side: the middles of its edges there, the longest first, and the
/// first of its corners.
std::vector<Point2> farthest_places(const Loops& region, std::array<int, 2> inwards) {
    const auto reach = [&](Point2 p) {
        return -(std::int64_t{p.x} * inwards[0] + std::int64_t{p.y} * inwards[1]);
    };
    const auto first = std::max_element(region.points.begin(), region.points.end(),
                                        [&](Point2 a, Point2 b) { return reach(a) < reach(b); });
    struct Edge {
        std::int64_t length = 0;
        Point2 middle;
    };
    std::vector<Edge> edges;
    for (std::size_t l = 0; l < region.size(); ++l) {
        const auto loop = region.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 a = loop[i], b = loop[(i + 1) % loop.size()];
            if (std::min(reach(a), reach(b)) < reach(*first) - to_units(kOnEdge / 2)) continue;
            edges.push_back({std::abs(std::int64_t{a.x} - b.x) + std::abs(std::int64_t{a.y} - b.y),
                             {(a.x + b.x) / 2, (a.y + b.y) / 2}});
        }
    }
    std::stable_sort(edges.begin(), edges.end(),
                     [](const Edge& a, const Edge& b) { return a.length > b.length; });
    std::vector<Point2> places;
    for (const Edge& edge : edges) places.push_back(edge.middle);
    places.push_back(*first);
    return places;
}

void add_marks(const EngravedFace& face, const Loops& covered, const EngraveRules& rules,
               std::vector<Engraving>& all) {
    if (face.covered.empty() || face.next.empty()) return;
    const BorderDistance to_next(face.next);
    constexpr std::array<std::array<int, 2>, 4> sides{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    // A little more than `wall`: corners of the room's border are chords of arcs.
    const std::int32_t from = to_units(rules.wall + rules.width / 2 + 0.01);
    const std::int32_t to = from + to_units(rules.height);
    for (const std::array<int, 2> inwards : sides)
        for (const Point2 end : farthest_places(face.covered, inwards)) {
            if (to_next(end) > kOnEdge) continue;  // the sheet's own edge, not the next one's
            const auto inside = [&](std::int32_t units) {
                return Point2{end.x + inwards[0] * units, end.y + inwards[1] * units};
            };
            Engraving mark{"", inside((from + to) / 2), {{inside(from), inside(to)}}};
            Box2 box;
            for (const Point2 p : mark.strokes[0]) box.grow(p);
            const std::vector<Box2> taken = kept_clear(all, rules);
            if (!holds_box(covered, box) ||
                std::any_of(taken.begin(), taken.end(), [&](const Box2& b) { return b.meets(box); }))
                continue;
            all.push_back(std::move(mark));
            break;
        }
}

void require_rules(const EngraveRules& rules) {
    for (const double mm : {rules.width, rules.height, rules.least, rules.wall, rules.depth})
        if (!(mm > 0) || mm > 1000)
            throw Error(ErrorKind::usage, "sheets.engrave",
                        "depth, width, height and wall of what is engraved must be over 0 mm", "", "");
    if (rules.least > rules.height)
        throw Error(ErrorKind::usage, "sheets.engrave", "the least digit is higher than digits may be", "",
                    "give higher digits");
}

}  // namespace

std::vector<std::vector<Point2>> digit_strokes(const std::string& text, double height) {
    const double unit = height / 6;
    std::vector<std::vector<Point2>> strokes;
    for (std::size_t i = 0; i < text.size(); ++i)
        for (const Stroke& stroke : glyph(text[i])) {
            std::vector<Point2>& points = strokes.emplace_back();
            for (const Corner& c : stroke)
                points.push_back({to_units((c.x + 6 * double(i)) * unit), to_units(c.y * unit)});
        }
    const std::int32_t below = -to_units(height * kBarBelow);
    strokes.push_back({{0, below}, {to_units(width_of(text, height)), below}});
    return strokes;
}

std::vector<std::vector<Engraving>> engravings_of(Context& context, const std::vector<EngravedFace>& faces,
                                                  const EngraveRules& rules) {
    require_rules(rules);
    std::vector<std::vector<Engraving>> all(faces.size());
    parallel_each(context, faces.size(), [&](std::size_t i) {
        const Loops covered = room_in(faces[i].covered, rules);
        add_numbers(faces[i], static_cast<int>(i) + 1, covered, rules, all[i]);
        add_marks(faces[i], covered, rules, all[i]);
    });
    return all;
}

}  // namespace slabwright
