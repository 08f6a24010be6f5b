#include "engine/sheets/fixture.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/errors.h"
#include "kernels/polygons/pieces.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kArcTolerance = 0.02;

Loops rectangle(double x0, double y0, double x1, double y1) {
    Loops loops;
    loops.points = {{to_units(x0), to_units(y0)},
                    {to_units(x1), to_units(y0)},
                    {to_units(x1), to_units(y1)},
                    {to_units(x0), to_units(y1)}};
    loops.close_loop();
    return loops;
}

void require_rules(const FixtureRules& rules) {
    const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
    if (!within(rules.margin, 1, 1000) || !within(rules.clearance, 0, 10) ||
        !within(rules.thickness, 0.1, 100) || !within(rules.floor, 1, 1000) || rules.slices_x < 1 ||
        rules.slices_x > 100 || rules.slices_y < 1 || rules.slices_y > 100)
        throw Error(
            ErrorKind::usage, "sheets.fixture", "a value of the fixture is out of range", "",
            "margin and floor 1 to 1000 mm, clearance 0 to 10, thickness 0.1 to 100, 1 to 100 slices");
}

/// All of a region and what lies above it, up to a height.
Loops swept_up(const Loops& region, std::int32_t top) {
    Loops swept;
    for (std::size_t l = 0; l < region.size(); ++l) {
        const auto loop = region.loop(l);
        for (std::size_t k = 0; k < loop.size(); ++k) {
            Point2 a = loop[k], b = loop[(k + 1) % loop.size()];
            if (a.x == b.x) continue;
            if (a.x > b.x) std::swap(a, b);
            swept.points.insert(swept.points.end(), {a, b, {b.x, top}, {a.x, top}});
            swept.close_loop();
        }
    }
    return unite(swept, region);
}

/// The fixture's slice across the thickness of which the part is looked at in three planes.
/// @param swap whether the plane's coordinates are height first
Loops negative(const std::vector<Section>& sections, std::size_t first, bool swap, const Loops& block,
               const FixtureRules& rules, std::int32_t top) {
    Loops part;
    for (std::size_t k = first; k < first + 3; ++k) {
        Loops section = sections[k].loops;
        if (swap)
            for (std::size_t l = 0; l < section.size(); ++l) {
                const auto begin = section.points.begin() + section.starts[l],
                           end = section.points.begin() + section.starts[l + 1];
                for (auto p = begin; p != end; ++p) std::swap(p->x, p->y);
                std::reverse(begin, end);
            }
        section.parents.clear();
        part = unite(part, section);
    }
    if (part.empty()) return block;
    return subtract(block, swept_up(offset(part, rules.clearance, kArcTolerance), top));
}

/// How high a slice stands in a column that another one crosses.
double height_in(const Loops& slice, double at, const FixtureRules& rules, double height) {
    const double half = rules.thickness / 2;
    const Loops column = rectangle(at - half, -rules.floor, at + half, height);
    double low = height;
    for (const Point2 p : subtract(column, slice).points) low = std::min(low, to_mm(p.y));
    return low;
}

}  // namespace

std::vector<FixturePiece> full_nest(const std::vector<SheetSpan>& spans, const std::vector<Loops>& outlines,
                                    const FixtureRules& rules) {
    require_rules(rules);
    Box2 box;
    for (const Loops& outline : outlines)
        for (const Point2 p : outline.points) box.grow(p);
    const Loops block = rectangle(to_mm(box.min.x) - rules.margin, to_mm(box.min.y) - rules.margin,
                                  to_mm(box.max.x) + rules.margin, to_mm(box.max.y) + rules.margin);
    std::vector<FixturePiece> pieces;
    for (std::size_t i = 0; i < outlines.size(); ++i)
        pieces.push_back({fmt::format("nest_{:02}", i + 1),
                          subtract(block, offset(outlines[i], rules.clearance, kArcTolerance)),
                          spans[i].bottom});
    return pieces;
}

std::vector<FixturePiece> egg_crate(Context& context, const Mesh& mesh, const FixtureRules& rules) {
    require_rules(rules);
    const auto box = bounds(mesh.view());
    const double height = box.max.z;
    const std::int32_t top = to_units(height + 1);
    const double half = rules.thickness / 2 + rules.clearance;
    std::vector<FixturePiece> pieces;
    for (const bool along_x : {true, false}) {
        const double low = along_x ? box.min.x : box.min.y, high = along_x ? box.max.x : box.max.y;
        const double low2 = along_x ? box.min.y : box.min.x, high2 = along_x ? box.max.y : box.max.x;
        Mesh turned = mesh;
        for (Vec3f& v : turned.vertices) v = along_x ? Vec3f{v.y, v.z, v.x} : Vec3f{v.z, v.x, v.y};
        const int count = along_x ? rules.slices_x : rules.slices_y;
        std::vector<Plane> planes;
        for (int i = 0; i < count; ++i)
            for (const double aside : {-half, 0.0, half})
                planes.push_back({low + (i + 0.5) / count * (high - low) + aside, Side::above});
        const std::vector<Section> sections = slice(context, turned.view(), planes);
        const Loops block = rectangle(low2 - rules.margin, -rules.floor, high2 + rules.margin, height);
        for (int i = 0; i < count; ++i)
            pieces.push_back(
                {fmt::format("crate_{}{}", along_x ? 'x' : 'y', i + 1),
                 negative(sections, 3 * static_cast<std::size_t>(i), !along_x, block, rules, top),
                 low + (i + 0.5) / count * (high - low)});
    }
    const auto nx = static_cast<std::size_t>(rules.slices_x), ny = static_cast<std::size_t>(rules.slices_y);
    const std::vector<FixturePiece> whole = pieces;
    for (std::size_t i = 0; i < nx; ++i)
        for (std::size_t j = nx; j < nx + ny; ++j) {
            const double up = std::min(height_in(whole[i].region, whole[j].at, rules, height),
                                       height_in(whole[j].region, whole[i].at, rules, height));
            const double middle = (up - rules.floor) / 2;
            pieces[i].region = subtract(
                pieces[i].region, rectangle(whole[j].at - half, middle, whole[j].at + half, height + 1));
            pieces[j].region =
                subtract(pieces[j].region, rectangle(whole[i].at - half, -rules.floor - 1, whole[i].at + half,
                                                     middle + rules.clearance));
        }
    return pieces;
}

}  // namespace slabwright
