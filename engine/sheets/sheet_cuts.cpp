#include "engine/sheets/sheet_cuts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "engine/sheets/fitted_heights.h"
#include "engine/sheets/majorant.h"
#include "engine/sheets/near_part.h"
#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/border_distance.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kArcTolerance = 0.005;  ///< mm, of round joins of upright cuts
constexpr double kThinned = 0.002;       ///< mm by which outlines are thinned under tilted cuts
constexpr double kLongestMitre = 6;

struct Vec2 {
    double x = 0, y = 0;
};

Vec2 to_vec(Point2 p) { return {p.x / kUnitsPerMm, p.y / kUnitsPerMm}; }
Point2 to_point(Vec2 v) { return {to_units(v.x), to_units(v.y)}; }
double length(Vec2 v) { return std::hypot(v.x, v.y); }

/// Leaves out points nearer than kThinned to the chord of those around them (Douglas, Peucker), of a closed
/// loop from its first and its farthest point.
void thin_between(std::span<const Point2> loop, std::size_t first, std::size_t last,
                  std::vector<bool>& kept) {
    std::vector<std::pair<std::size_t, std::size_t>> open{{first, last}};
    while (!open.empty()) {
        const auto [a, b] = open.back();
        open.pop_back();
        const Vec2 p = to_vec(loop[a]), q = to_vec(loop[b % loop.size()]);
        const double l = std::hypot(q.x - p.x, q.y - p.y);
        double most = kThinned;
        std::size_t at = 0;
        for (std::size_t i = a + 1; i < b; ++i) {
            const Vec2 v = to_vec(loop[i]);
            const double away = l > 0 ? std::abs((v.x - p.x) * (q.y - p.y) - (v.y - p.y) * (q.x - p.x)) / l
                                      : std::hypot(v.x - p.x, v.y - p.y);
            if (away > most) most = away, at = i;
        }
        if (at == 0) continue;
        kept[at] = true;
        open.push_back({a, at});
        open.push_back({at, b});
    }
}

std::vector<Vec2> thinned(std::span<const Point2> loop) {
    std::vector<bool> kept(loop.size(), false);
    std::size_t far = 0;
    double most = -1;
    for (std::size_t i = 1; i < loop.size(); ++i) {
        const double d = std::hypot(double(loop[i].x) - loop[0].x, double(loop[i].y) - loop[0].y);
        if (d > most) most = d, far = i;
    }
    kept[0] = kept[far] = true;
    thin_between(loop, 0, far, kept);
    thin_between(loop, far, loop.size(), kept);
    std::vector<Vec2> points;
    for (std::size_t i = 0; i < loop.size(); ++i)
        if (kept[i]) points.push_back(to_vec(loop[i]));
    return points;
}

/// A place of the outline from which the part is looked for along `out`, inwards.
struct Sample {
    Vec2 at, out;               ///< mm; out is of length 1
    double mitre = 1;           ///< along `out`, what is 1 square to the outline
    double along = 0;           ///< mm of the outline before it
    double turn = 0;            ///< by which the outline turns there, positive where it is convex
    std::vector<double> reach;  ///< r of the part at each section: 0 or less
};

std::vector<Sample> samples_of(const std::vector<Vec2>& points, double step) {
    std::vector<Sample> samples;
    const std::size_t n = points.size();
    double along = 0;
    const auto direction = [&](std::size_t i) {
        const Vec2 a = points[i % n], b = points[(i + 1) % n];
        const double l = std::hypot(b.x - a.x, b.y - a.y);
        return Vec2{(b.x - a.x) / l, (b.y - a.y) / l};
    };
    for (std::size_t i = 0; i < n; ++i) {
        const Vec2 before = direction(i + n - 1), after = direction(i);
        const double turn =
            std::atan2(before.x * after.y - before.y * after.x, before.x * after.x + before.y * after.y);
        Vec2 out{before.y + after.y, -before.x - after.x};
        const double l = length(out);
        if (l > 1e-9) out = {out.x / l, out.y / l};
        else out = {after.y, -after.x};
        const double mitre = std::min(kLongestMitre, 1 / std::max(1e-9, std::cos(turn / 2)));
        samples.push_back({points[i], out, mitre, along, turn, {}});
        const Vec2 a = points[i], b = points[(i + 1) % n];
        const double edge = std::hypot(b.x - a.x, b.y - a.y);
        const int pieces = std::max(1, static_cast<int>(std::ceil(edge / step)));
        for (int k = 1; k < pieces; ++k) {
            const double t = double(k) / pieces;
            samples.push_back({{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)},
                               {after.y, -after.x},
                               1,
                               along + t * edge,
                               0,
                               {}});
        }
        along += edge;
    }
    return samples;
}

/// How far inwards of a sample a section begins: as far as circles about the ray that hold nothing of its
/// border lead. Never past it. −`most` where it does not begin before that.
double reach_of(const Sample& sample, const Loops& section, const BorderDistance& border, double most) {
    const Point2 start = to_point(sample.at);
    constexpr double touching = 3 / kUnitsPerMm;
    if (border(start) <= touching || winding(section, start) > 0) return 0;
    double travelled = 0;
    for (int i = 0; i < 200 && travelled < most; ++i) {
        const double free = border(
            to_point({sample.at.x - travelled * sample.out.x, sample.at.y - travelled * sample.out.y}));
        if (free < touching) return -travelled;
        travelled += free - 1 / kUnitsPerMm;
    }
    return -std::min(travelled, most);
}

/// Places beside a convex corner whose rays pass the part are left out: the corner's own ray finds it.
void leave_out_beside_corners(std::vector<Sample>& samples, double whole) {
    std::vector<std::pair<double, double>> ranges;
    for (const Sample& s : samples) {
        if (s.turn <= 1e-6) continue;
        const double deepest = -*std::min_element(s.reach.begin(), s.reach.end());
        const double wide = deepest * std::sin(std::min(s.turn / 2, std::numbers::pi / 2));
        if (wide > 1e-4) ranges.push_back({s.along - wide, s.along + wide});
    }
    std::erase_if(samples, [&](const Sample& s) {
        if (s.turn != 0) return false;
        return std::any_of(ranges.begin(), ranges.end(), [&](const auto& range) {
            for (const double shift : {-whole, 0.0, whole})
                if (s.along + shift > range.first && s.along + shift < range.second) return true;
            return false;
        });
    });
}

/// Between two heights a part may begin anywhere that the head cannot follow: where what a place reaches
/// changes faster than the head leans, the place and its neighbours keep clear of the farther of both ends at
/// both of them. A corner of the part that runs along the outline between the two heights is spared so.
void spare_what_the_head_cannot_follow(std::vector<Sample>& samples, const std::vector<double>& heights,
                                       double most_slope) {
    constexpr double rounding = 0.001;  // mm
    const std::size_t n = samples.size();
    std::vector<std::vector<double>> spared;
    for (const Sample& s : samples) spared.push_back(s.reach);
    for (std::size_t i = 0; i < n; ++i) {
        const Sample& s = samples[i];
        for (std::size_t k = 0; k + 1 < heights.size(); ++k) {
            const double follows = most_slope * s.mitre * (heights[k + 1] - heights[k]) + rounding;
            if (std::abs(s.reach[k + 1] - s.reach[k]) <= follows) continue;
            const double farther = std::max(s.reach[k], s.reach[k + 1]) / s.mitre;
            for (const std::size_t at : {(i + n - 1) % n, i, (i + 1) % n})
                for (const std::size_t end : {k, k + 1})
                    spared[at][end] = std::max(spared[at][end], farther * samples[at].mitre);
        }
    }
    for (std::size_t i = 0; i < n; ++i) samples[i].reach = std::move(spared[i]);
}

/// The cuts of one loop, as many passes as `passes`, and how much they leave over the majorants.
struct LoopPasses {
    std::vector<std::vector<StraightCut>> cuts;  ///< of every pass, of every sample
    double left = 0;
};

LoopPasses passes_of(const std::vector<Sample>& samples, const std::vector<double>& heights, int passes,
                     double most_slope) {
    LoopPasses result;
    result.cuts.assign(static_cast<std::size_t>(passes), {});
    const double z0 = heights.front(), height = heights.back() - z0;
    for (const Sample& s : samples) {
        std::vector<ProfilePoint> profile;
        for (std::size_t k = 0; k < heights.size(); ++k) profile.push_back({heights[k], s.reach[k]});
        const std::vector<ProfilePoint> majorant = concave_majorant(profile);
        std::vector<StraightCut> own;
        for (int j = 0; j < passes; ++j) {
            own.push_back(supporting_cut(majorant, z0 + (j + 0.5) / passes * height, most_slope));
            result.cuts[static_cast<std::size_t>(j)].push_back(own.back());
        }
        for (const double z : heights) {
            double least = 1e300;
            for (const StraightCut& cut : own)
                least = std::min(least, cut.bottom + (cut.top - cut.bottom) * (z - z0) / height);
            result.left = std::max(result.left, (least - majorant_at(majorant, z)) / s.mitre);
        }
    }
    return result;
}

AxisLoop axis_loop(const std::vector<Sample>& samples, const std::vector<StraightCut>& cuts, double height,
                   const Kerf& kerf) {
    AxisLoop loop;
    const double taper = (kerf.top - kerf.bottom) / 2 / height;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const Sample& s = samples[i];
        const double lean = (cuts[i].top - cuts[i].bottom) / s.mitre / height + taper;
        const double square = std::sqrt(1 + lean * lean) * s.mitre;
        const auto at = [&](double r, double wide) {
            const double aside = wide / 2 * square;
            return to_point({s.at.x + (r + aside) * s.out.x, s.at.y + (r + aside) * s.out.y});
        };
        loop.bottom.push_back(at(cuts[i].bottom, kerf.bottom));
        loop.top.push_back(at(cuts[i].top, kerf.top));
    }
    return loop;
}

double tilt_of(const AxisLoop& loop, double height) {
    double most = 0;
    for (std::size_t i = 0; i < loop.top.size(); ++i)
        most = std::max(most, std::hypot(double(loop.top[i].x) - loop.bottom[i].x,
                                         double(loop.top[i].y) - loop.bottom[i].y) /
                                  kUnitsPerMm / height);
    return std::atan(most);
}

SheetCuts upright_cuts(const Loops& outline, double kerf) {
    SheetCuts cuts;
    const Loops axis = kerf > 0 ? offset(outline, kerf / 2, kArcTolerance) : outline;
    for (const bool holes : {true, false})
        for (std::size_t i = 0; i < axis.size(); ++i) {
            if ((signed_area(axis.loop(i)) < 0) != holes) continue;
            const auto loop = axis.loop(i);
            AxisLoop way;
            way.bottom.assign(loop.begin(), loop.end());
            way.top = way.bottom;
            way.loop = static_cast<int>(i);
            way.is_hole = holes;
            cuts.loops.push_back(std::move(way));
        }
    return cuts;
}

/// One closed way under way: the places it is made of and its cut at each.
struct Way {
    const std::vector<Sample>& samples;
    std::vector<StraightCut> cuts;
    AxisLoop axis;
};

/// Moves the places of a way outwards by what they lack.
void push_out(Way& way, const std::vector<double>& lacks, double height, const Kerf& kerf) {
    for (std::size_t i = 0; i < lacks.size(); ++i) {
        way.cuts[i].bottom += lacks[i] * way.samples[i].mitre;
        way.cuts[i].top += lacks[i] * way.samples[i].mitre;
    }
    const AxisLoop fresh = axis_loop(way.samples, way.cuts, height, kerf);
    way.axis.bottom = fresh.bottom;
    way.axis.top = fresh.top;
}

/// The ways of one loop of the outline, one for each pass.
std::vector<Way> ways_of(const std::vector<Sample>& samples, const Fitted& sheet, std::size_t loop,
                         bool is_hole, const SheetCutRules& rules) {
    const double height = sheet.heights.back() - sheet.heights.front();
    // The head leans by the taper on top of what a cut leans.
    const double most_slope = std::tan(rules.most_tilt_deg * std::numbers::pi / 180) -
                              std::abs(std::tan(rules.taper_deg * std::numbers::pi / 180));
    LoopPasses found;
    for (int passes = 1; passes <= rules.most_passes; ++passes) {
        found = passes_of(samples, sheet.heights, passes, most_slope);
        if (found.left <= rules.leave) break;
    }
    std::vector<Way> ways;
    for (std::size_t j = 0; j < found.cuts.size(); ++j) {
        AxisLoop axis = axis_loop(samples, found.cuts[j], height, kerf_through(rules, height));
        axis.loop = static_cast<int>(loop);
        axis.pass = static_cast<int>(j);
        axis.is_hole = is_hole;
        ways.push_back({samples, std::move(found.cuts[j]), std::move(axis)});
    }
    return ways;
}

/// What the cuts of a sheet leave at each of the heights that were looked at.
using LeftAtHeights = std::vector<Loops>;

double deviation_of(const LeftAtHeights& left, const Fitted& sheet) {
    double most = 0;
    for (std::size_t k = 0; k < left.size(); k += 3) {
        if (left[k].empty() || sheet.sections[k]->empty()) continue;  // no border to be far from
        most = std::max(most, farthest_from_border(left[k], BorderDistance(*sheet.sections[k]), 1));
        most = std::max(most, farthest_from_border(*sheet.sections[k], BorderDistance(left[k]), 1));
    }
    return most;
}

/// Between the axis and what it leaves lies half a kerf; a pass of every loop together bounds the part.
LeftAtHeights left_by(const std::vector<AxisLoop>& edges, const Fitted& sheet) {
    int passes = 0;
    for (const AxisLoop& edge : edges) passes = std::max(passes, edge.pass + 1);
    LeftAtHeights left;
    const double height = sheet.heights.back() - sheet.heights.front();
    for (const double z : sheet.heights) {
        for (int pass = 0; pass < passes; ++pass) {
            // A loop that has no such pass takes part with its first one.
            Loops all;
            for (const AxisLoop& edge : edges) {
                const bool has = std::any_of(edges.begin(), edges.end(), [&](const AxisLoop& other) {
                    return other.loop == edge.loop && other.pass == pass;
                });
                if (edge.pass != (has ? pass : 0)) continue;
                const std::vector<Point2> points = axis_at(edge, (z - sheet.heights.front()) / height);
                all.points.insert(all.points.end(), points.begin(), points.end());
                all.close_loop();
            }
            Loops region = unite(all, {});
            if (pass == 0) left.push_back(std::move(region));
            else left.back() = intersect(left.back(), region);
        }
    }
    return left;
}

struct Tilted {
    SheetCuts cuts;
    bool spares = true;  ///< no cut comes nearer to the part than it may
};

/// Pushing one place moves its neighbours' lines too, so it is done again until nothing is too near.
Tilted tilted_cuts(const Fitted& sheet, const SheetCutRules& rules) {
    constexpr int most_pushes = 12;
    Tilted result;
    SheetCuts& cuts = result.cuts;
    const double height = sheet.heights.back() - sheet.heights.front();
    const double most_slope = std::tan(rules.most_tilt_deg * std::numbers::pi / 180);
    const Kerf kerf = kerf_through(rules, height);
    const NearPart part(sheet, kerf);
    std::vector<AxisLoop> edges;
    for (const bool holes : {true, false})
        for (std::size_t l = 0; l < sheet.outline.size(); ++l) {
            if ((signed_area(sheet.outline.loop(l)) < 0) != holes) continue;
            const std::vector<Vec2> points = thinned(sheet.outline.loop(l));
            if (points.size() < 3) continue;
            std::vector<Sample> samples = samples_of(points, rules.step);
            for (Sample& s : samples)
                for (std::size_t k = 0; k < sheet.sections.size(); ++k)
                    s.reach.push_back(
                        reach_of(s, *sheet.sections[k], part.border(k), most_slope * height * s.mitre));
            const double whole = samples.back().along + std::hypot(points[0].x - samples.back().at.x,
                                                                   points[0].y - samples.back().at.y);
            leave_out_beside_corners(samples, whole);
            spare_what_the_head_cannot_follow(samples, sheet.heights, most_slope);
            for (Way& way : ways_of(samples, sheet, l, holes, rules)) {
                for (int i = 0; i <= most_pushes; ++i) {
                    const double allowed = i < most_pushes ? rules.gouge / 4 : rules.gouge / 2;
                    const std::vector<double> lacks = part.too_near(way.axis, allowed);
                    const bool is_clear =
                        std::all_of(lacks.begin(), lacks.end(), [](double lack) { return lack == 0; });
                    if (is_clear) break;
                    if (i < most_pushes) push_out(way, lacks, height, kerf);
                    else result.spares = false;
                }
                cuts.most_tilt_deg =
                    std::max(cuts.most_tilt_deg, tilt_of(way.axis, height) * 180 / std::numbers::pi);
                edges.push_back(axis_loop(samples, way.cuts, height, {}));
                edges.back().loop = way.axis.loop;
                edges.back().pass = way.axis.pass;
                cuts.loops.push_back(std::move(way.axis));
            }
        }
    cuts.upright = cuts.most_tilt_deg < 0.05;
    if (result.spares) cuts.deviation = deviation_of(left_by(edges, sheet), sheet);
    return result;
}

/// Heights halfway between those that cuts are fitted to, where these are not next to each other.
std::vector<double> halfway(const std::vector<double>& heights) {
    constexpr double next_to = 0.02;  // mm
    std::vector<double> between;
    for (std::size_t k = 0; k + 1 < heights.size(); ++k)
        if (heights[k + 1] - heights[k] > next_to) between.push_back((heights[k] + heights[k + 1]) / 2);
    return between;
}

/// One sheet with what is known of it. Sections of tilted cuts are at its heights, then halfway.
struct Sheet {
    const Loops& outline;
    const std::vector<double>& heights;
    std::vector<double> between;
    std::span<const Section> sections;
    const SheetHold* hold = nullptr;
};

/// Tilted cuts that are fitted to the sections at the heights and spare those halfway; if they do not, they
/// are fitted to all of them.
Tilted tilted_cuts_of(const Sheet& sheet, const std::vector<const Loops*>& sections,
                      const SheetCutRules& rules) {
    const std::size_t n = sheet.heights.size();
    Fitted fitted{sheet.outline, sheet.heights, {sections.begin(), sections.begin() + static_cast<long>(n)}};
    Tilted tilted = tilted_cuts(fitted, rules);
    if (!tilted.spares || tilted.cuts.upright || sheet.between.empty()) return tilted;
    std::vector<std::pair<double, const Loops*>> all;
    for (std::size_t k = 0; k < n; ++k) all.emplace_back(sheet.heights[k], sections[k]);
    Fitted beside{sheet.outline, {sheet.heights.front()}, {sections[0]}};
    for (std::size_t k = 0; k < sheet.between.size(); ++k) {
        all.emplace_back(sheet.between[k], sections[n + k]);
        beside.heights.push_back(sheet.between[k]);
        beside.sections.push_back(sections[n + k]);
    }
    beside.heights.push_back(sheet.heights.back());
    beside.sections.push_back(sections[n - 1]);
    const NearPart part(beside, kerf_through(rules, sheet.heights.back() - sheet.heights.front()));
    const bool spares =
        std::all_of(tilted.cuts.loops.begin(), tilted.cuts.loops.end(), [&](const AxisLoop& axis) {
            const std::vector<double> lacks = part.too_near(axis, rules.gouge);
            return std::all_of(lacks.begin(), lacks.end(), [](double lack) { return lack == 0; });
        });
    if (spares) return tilted;
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Fitted finer{sheet.outline, {}, {}};
    for (const auto& [z, section] : all) {
        finer.heights.push_back(z);
        finer.sections.push_back(section);
    }
    return tilted_cuts(finer, rules);
}

SheetCuts cuts_of_one(const Sheet& sheet, const SheetCutRules& rules, double dowel) {
    std::vector<Loops> held;  // what is to stay, with its tabs and without its holes
    if (sheet.hold != nullptr)
        for (const Section& section : sheet.sections)
            held.push_back(with_hold(section.loops, *sheet.hold, dowel));
    std::vector<const Loops*> sections;
    for (std::size_t k = 0; k < sheet.sections.size(); ++k)
        sections.push_back(sheet.hold == nullptr ? &sheet.sections[k].loops : &held[k]);
    bool gave_up_tilt = false;
    if (rules.most_tilt_deg > 0) {
        Tilted tilted = tilted_cuts_of(sheet, sections, rules);
        if (tilted.spares && !tilted.cuts.upright) return std::move(tilted.cuts);
        gave_up_tilt = !tilted.spares;
    }
    const Kerf kerf = kerf_through(rules, sheet.heights.back() - sheet.heights.front());
    SheetCuts cuts = upright_cuts(sheet.outline, kerf.widest());
    cuts.gave_up_tilt = gave_up_tilt;
    Loops axis;
    for (const AxisLoop& loop : cuts.loops) {
        axis.points.insert(axis.points.end(), loop.top.begin(), loop.top.end());
        axis.close_loop();
    }
    const Loops left = kerf.widest() > 0 ? offset(axis, -kerf.widest() / 2, kArcTolerance) : axis;
    sections.resize(sheet.heights.size());
    cuts.deviation = deviation_of(LeftAtHeights(sheet.heights.size(), left),
                                  {sheet.outline, sheet.heights, std::move(sections)}) +
                     std::abs(kerf.top - kerf.bottom) / 2;
    return cuts;
}

void require_rules(const SheetCutRules& rules) {
    if (!(rules.kerf >= 0) || rules.kerf > 100 || !(rules.most_tilt_deg >= 0) || rules.most_tilt_deg > 80 ||
        !(rules.leave > 0) || rules.most_passes < 1 || rules.most_passes > 100 || !(rules.gouge > 0) ||
        !(rules.step > 0) || !(std::abs(rules.taper_deg) <= 10) ||
        (rules.most_tilt_deg > 0 && rules.most_tilt_deg < 2 * std::abs(rules.taper_deg)))
        throw Error(ErrorKind::usage, "sheets.cut",
                    "kerf, taper, tilt, tolerances or passes are out of range", "",
                    "kerf 0 to 100 mm, tilt 0 to 80 degrees, taper to 10 and half of the tilt, tolerances "
                    "over 0, passes 1 to 100");
}

}  // namespace

Kerf kerf_through(const SheetCutRules& rules, double thickness) {
    return {rules.kerf, rules.kerf - 2 * thickness * std::tan(rules.taper_deg * std::numbers::pi / 180)};
}

std::vector<Point2> axis_at(const AxisLoop& loop, double share) {
    std::vector<Point2> points;
    for (std::size_t i = 0; i < loop.top.size(); ++i) {
        const auto between = [&](std::int32_t a, std::int32_t b) {
            return static_cast<std::int32_t>(std::lround(a + share * (double(b) - a)));
        };
        points.push_back(
            {between(loop.bottom[i].x, loop.top[i].x), between(loop.bottom[i].y, loop.top[i].y)});
    }
    return points;
}

std::vector<SheetCuts> cuts_of(Context& context, MeshView mesh, const std::vector<SheetSpan>& spans,
                               const std::vector<SheetStair>& stairs, const SheetCutRules& rules,
                               const std::vector<SheetHold>& holds, double dowel) {
    require_rules(rules);
    for (const SheetSpan& span : spans)
        if (rules.taper_deg != 0 && !(kerf_through(rules, span.top - span.bottom).bottom > 0))
            throw Error(ErrorKind::usage, "sheets.cut", "a cut of that taper closes above the sheet's bottom",
                        "", "give less to --taper, or thinner sheets");
    const std::vector<std::vector<double>> heights = heights_to_fit(mesh, spans, rules.most_tilt_deg);
    const double top = bounds(mesh).max.z;
    std::vector<SheetCuts> cuts(spans.size());
    // Some sheets at a time: the sections of all of them are larger than the mesh.
    constexpr std::size_t at_once = 8;
    for (std::size_t first = 0; first < spans.size(); first += at_once) {
        const std::size_t end = std::min(first + at_once, spans.size());
        std::vector<Plane> planes;
        std::vector<std::size_t> starts;
        std::vector<std::vector<double>> between(end - first);
        for (std::size_t i = first; i < end; ++i) {
            starts.push_back(planes.size());
            if (rules.most_tilt_deg > 0) between[i - first] = halfway(heights[i]);
            const auto cut = [&](double z) {
                planes.push_back(z >= std::min(spans[i].top, top) ? Plane{std::min(z, top), Side::below}
                                                                  : Plane{z, Side::above});
            };
            std::for_each(heights[i].begin(), heights[i].end(), cut);
            std::for_each(between[i - first].begin(), between[i - first].end(), cut);
        }
        starts.push_back(planes.size());
        const std::vector<Section> sections = slice(context, mesh, planes);
        parallel_each(context, end - first, [&](std::size_t k) {
            const std::size_t i = first + k;
            const std::span own = std::span(sections).subspan(starts[k], starts[k + 1] - starts[k]);
            cuts[i] = cuts_of_one({stairs[i].outline, heights[i], std::move(between[k]), own,
                                   holds.empty() ? nullptr : &holds[i]},
                                  rules, dowel);
        });
    }
    return cuts;
}

}  // namespace slabwright
