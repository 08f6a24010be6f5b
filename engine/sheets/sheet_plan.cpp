#include "engine/sheets/sheet_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "engine/sheets/head_switches.h"
#include "kernels/errors.h"
#include "kernels/features/features.h"
#include "kernels/polygons/border_distance.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kHeadTolerance = 0.005;  ///< mm by which the bottom of a cut may leave its line

bool is_stocked(const SheetJob& job, double thickness) {
    return std::any_of(job.slicing.thicknesses.begin(), job.slicing.thicknesses.end(),
                       [&](double t) { return std::abs(t - thickness) < 1e-6; });
}

void require_job(const SheetJob& job) {
    const auto refuse = [](const std::string& what, const char* remedy) {
        throw Error(ErrorKind::usage, "sheets.job", what, "", remedy);
    };
    if (job.alignment.way != SheetAlignment::none && job.head == SheetHead::router &&
        job.alignment.dowel < job.cutting.kerf)
        refuse("the router's cutter is wider than a dowel's hole",
               "give a thicker --dowel, or a thinner --kerf");
    if (job.cutting.most_tilt_deg > 0 && job.head != SheetHead::jet)
        refuse("only a jet's head tilts", "give --tilt 0, or --head jet");
    if (job.cutting.most_tilt_deg > 0 && job.slicing.side != StairSide::outside)
        refuse("tilted cuts follow the outside of the part", "give --side outside, or --tilt 0");
    for (const double value : {job.feed, job.plunge_feed, job.stepdown, job.rpm, job.clearance})
        if (!(value > 0) || value > 1e6) refuse("feeds, stepdown, speed and clearance must be over 0", "");
    if (job.cutting.taper_deg != 0 && job.head == SheetHead::router)
        refuse("a router's cut does not taper", "give no --taper");
    if (job.pivot > 0 && job.head != SheetHead::jet)
        refuse("only a jet's head has a pivot", "give no --pivot");
    for (const double value : {job.lead, job.pierce_s, job.through, job.pivot})
        if (!(value >= 0) || value > 2000)
            refuse("lead, pierce, pivot and depth under the sheet must be 0 or more", "");
    for (const SheetOffcut& offcut : job.offcuts)
        if (!is_stocked(job, offcut.thickness))
            refuse(fmt::format("an offcut of {:.4g} mm is of no thickness in stock", offcut.thickness),
                   "give its thickness to --thickness too");
    if (job.head == SheetHead::router && !(job.cutting.kerf > 0))
        refuse("a router's cutter has a diameter", "give --kerf");
    if (!is_switch_pair(job.on, job.off))
        refuse(
            "a laser or a jet is switched on and off by two M words: M3 or M4 and M5, M7 or M8 and M9, M62 "
            "or M64 "
            "and M63 or M65 with the same P, or two of M100 to M199",
            "give --on and --off like \"M62 P0\" and \"M63 P0\"");
    for (const auto* lines : {&job.begin, &job.end})
        for (const std::string& line : *lines)
            if (!is_switch(line) || switches_head(line, job.on, job.off))
                refuse(
                    "\"" + line.substr(0, 40) + "\" switches nothing beside the head",
                    "give M7 to M9, M62 to M65 with the P of another output, or M100 to M199, without zeros "
                    "before a number");
    for (const SheetCount& count : job.counts)
        if (!is_stocked(job, count.thickness) || count.sheets < 0)
            refuse(fmt::format("{} sheets of {:.4g} mm are of no thickness in stock", count.sheets,
                               count.thickness),
                   "give its thickness to --thickness too");
    if (!(job.corners.share > 0) || job.corners.share > 1 || !(job.corners.reach >= 0))
        refuse("at corners the feed is over 0 and no more than the whole", "give --corner-feed in percent");
    if (job.engraving.depth == 0) return;
    if (!(job.engraving.depth <= job.slicing.thicknesses.front() / 2))
        refuse("what is engraved is deeper than half of the thinnest sheet", "give less to --engrave");
    for (const double value : {job.engraving.feed, job.engraving.power, job.power})
        if (!(value > 0) || value > 1e6) refuse("the feed and powers of an engraver must be over 0", "");
    if (job.head == SheetHead::laser && job.engraving.power >= job.power)
        refuse("a laser that engraves at its cutting power cuts", "give less to --engrave-power");
    (void)engraving_feed(job);
}

/// Where a way begins and from where it is led in: the first place with room for the whole lead in the waste,
/// or for a half or a quarter of it, or on the way itself.
struct Start {
    std::size_t at = 0;
    double lead = 0;
    double nx = 0, ny = 0;  ///< towards the pierce
};

Start start_of(const AxisLoop& loop, const std::vector<const BorderDistance*>& borders,
               const std::vector<const Loops*>& regions, double lead) {
    const std::size_t n = loop.top.size();
    for (const double share : {1.0, 0.5, 0.25}) {
        const double wanted = lead * share;
        if (wanted <= 0) break;
        for (std::size_t i = 0; i < n; ++i) {
            // The right of the way, where it does not turn much: halfway between its neighbours.
            const Point2 a = loop.top[(i + n - 1) % n], b = loop.top[(i + 1) % n], p = loop.top[i];
            const double dx = double(b.x) - a.x, dy = double(b.y) - a.y, l = std::hypot(dx, dy);
            if (l < 1) continue;
            const double nx = dy / l, ny = -dx / l;
            bool has_room = true;
            for (std::size_t k = 0; k < borders.size() && has_room; ++k) {
                const Point2 end = k == 0 ? p : loop.bottom[i];
                const Point2 pierce{to_units(to_mm(end.x) + wanted * nx),
                                    to_units(to_mm(end.y) + wanted * ny)};
                has_room = (*borders[k])(pierce) >= 0.9 * wanted && winding(*regions[k], pierce) <= 0;
            }
            if (has_room) return {i, wanted, nx, ny};
        }
    }
    return {};
}

/// The ends of one loop's pass, and of the first pass of all others, at the sheet's bottom or top: what a
/// lead of that pass keeps clear of. Its own other passes run through waste.
Loops ends_of(const SheetCuts& cuts, const AxisLoop& of, bool top) {
    Loops all;
    for (const AxisLoop& loop : cuts.loops) {
        if (loop.loop == of.loop ? loop.pass != of.pass : loop.pass != 0) continue;
        const std::vector<Point2>& points = top ? loop.top : loop.bottom;
        all.points.insert(all.points.end(), points.begin(), points.end());
        all.close_loop();
    }
    return all;
}

double feed_of(const SheetJob& job, double thickness, double tilt_deg) {
    if (job.head != SheetHead::jet) return job.feed;
    return jet_feed(job.jet, thickness / std::cos(tilt_deg * std::numbers::pi / 180));
}

SheetWay way_of(const AxisLoop& loop, const Start& start, const NestPlace& place, double thickness,
                const SheetJob& job) {
    AxisLoop turned = loop;
    std::rotate(turned.top.begin(), turned.top.begin() + static_cast<long>(start.at), turned.top.end());
    std::rotate(turned.bottom.begin(), turned.bottom.begin() + static_cast<long>(start.at),
                turned.bottom.end());
    const Point2 first = turned.top[0];
    const Point2 pierce{to_units(to_mm(first.x) + start.lead * start.nx),
                        to_units(to_mm(first.y) + start.lead * start.ny)};
    for (Point2& p : turned.top) p = placed(p, place);
    for (Point2& p : turned.bottom) p = placed(p, place);
    SheetWay way;
    way.loop = loop.loop;
    way.pass = loop.pass;
    way.is_hole = loop.is_hole;
    PacedWay paced = slowed_at_corners(head_way(turned, thickness, kHeadTolerance, job.pivot),
                                       job.head == SheetHead::jet ? job.corners : CornerRules{.share = 1});
    way.points = std::move(paced.points);
    way.shares = std::move(paced.shares);
    way.pierce = placed(pierce, place);
    return way;
}

struct WayLength {
    double mm = 0, paced = 0;  ///< paced: at the whole feed it would be so long
};

WayLength length_of(const SheetWay& way) {
    const auto apart = [](Point2 p, Point2 q) {
        return std::hypot(to_mm(p.x) - to_mm(q.x), to_mm(p.y) - to_mm(q.y));
    };
    WayLength length;
    length.mm = length.paced = apart(way.pierce, way.points[0].top);
    for (std::size_t i = 1; i < way.points.size(); ++i) {
        const double mm = apart(way.points[i].top, way.points[i - 1].top);
        length.mm += mm;
        length.paced += mm / way.shares[i];
    }
    return length;
}

double engraving_minutes(const SheetPiece& piece, const SheetJob& job) {
    constexpr double each = 0.02;  // down, up and to the next
    double minutes = 0;
    for (const Engraving& engraving : piece.engravings)
        for (const std::vector<Point2>& stroke : engraving.strokes) {
            minutes += each;
            for (std::size_t i = 1; i < stroke.size(); ++i)
                minutes += std::hypot(to_mm(stroke[i].x) - to_mm(stroke[i - 1].x),
                                      to_mm(stroke[i].y) - to_mm(stroke[i - 1].y)) /
                           engraving_feed(job);
        }
    return minutes;
}

/// What a piece takes of its stock: the outside of its cuts with their leads, holes filled.
Loops blank_of(const SheetCuts& cuts, const SheetJob& job, double thickness) {
    const double widest = kerf_through(job.cutting, thickness).widest();
    Loops outside;
    for (const bool top : {true, false})
        for (const AxisLoop& loop : cuts.loops) {
            if (loop.is_hole) continue;
            const std::vector<Point2>& points = top ? loop.top : loop.bottom;
            outside.points.insert(outside.points.end(), points.begin(), points.end());
            outside.close_loop();
        }
    return offset(unite(outside, {}), widest / 2 + job.lead, 0.05);
}

/// The sheets of the stack with what is known of them before they have a place.
void add_pieces(SheetsPlan& plan, const std::vector<SheetStair>& stairs, const std::vector<SheetCuts>& cuts) {
    const std::vector<SheetSpan>& spans = plan.stack.sheets;
    for (std::size_t i = 0; i < spans.size(); ++i) {
        SheetPiece piece;
        piece.number = static_cast<int>(i) + 1;
        piece.span = spans[i];
        piece.islands = 0;
        for (std::size_t l = 0; l < stairs[i].outline.size(); ++l)
            piece.islands += signed_area(stairs[i].outline.loop(l)) > 0;
        piece.stair_mm3 = stairs[i].volume_mm3;
        piece.deviation = cuts[i].deviation;
        piece.tilt_deg = cuts[i].upright ? 0 : cuts[i].most_tilt_deg;
        piece.area_mm2 = area(stairs[i].outline);
        if (cuts[i].loops.empty())
            throw Error(ErrorKind::no_plan, "sheets.empty",
                        fmt::format("sheet {} from {:.4g} to {:.4g} mm holds nothing of the part",
                                    piece.number, piece.span.bottom, piece.span.top),
                        "", "look at the model with `slabwright inspect`");
        plan.pieces.push_back(piece);
    }
}

void tell(SheetsPlan& plan, Severity severity, const char* code, std::string message) {
    plan.diagnostics.push_back({severity, code, std::move(message), {}});
}

/// Sheets that have no room for their number.
void tell_unmarked(SheetsPlan& plan) {
    if (plan.job.engraving.depth == 0) return;
    std::string numbers;
    for (const SheetPiece& piece : plan.pieces) {
        const auto is_number = [](const Engraving& e) { return !e.text.empty(); };
        if (std::count_if(piece.engravings.begin(), piece.engravings.end(), is_number) < piece.islands)
            numbers += fmt::format("{}{}", numbers.empty() ? "" : ", ", piece.number);
    }
    if (!numbers.empty())
        tell(plan, Severity::note, "sheets.unmarked",
             fmt::format("not engraved, or not on every island, for want of a covered place: sheet {}",
                         numbers));
}

void tell_missed_joints(SheetsPlan& plan) {
    std::string heights;
    for (const double z : plan.stack.missed)
        heights += fmt::format("{}{:.4g}", heights.empty() ? "" : ", ", z);
    if (!heights.empty())
        tell(plan, Severity::warning, "sheets.joint",
             fmt::format("no joint lies at {} mm, where one was to be kept: the sheets in stock do not add "
                         "up to that",
                         heights));
}

void tell_findings(SheetsPlan& plan, const std::vector<SheetCuts>& cuts, int on_the_way) {
    if (plan.stack.left_on_top > 0)
        tell(plan, Severity::warning, "sheets.left_on_top",
             fmt::format("{:.4f} mm on top are thinner than any sheet and are not made",
                         plan.stack.left_on_top));
    tell_missed_joints(plan);
    for (std::size_t i = 0; i < plan.pieces.size(); ++i) {
        const SheetPiece& piece = plan.pieces[i];
        if (piece.islands > 1 && plan.job.alignment.way == SheetAlignment::none)
            tell(plan, Severity::warning, "sheets.islands",
                 fmt::format("sheet {} is of {} parts, which nothing but the glue holds in place",
                             piece.number, piece.islands));
        if (cuts[i].gave_up_tilt)
            tell(plan, Severity::warning, "sheets.upright",
                 fmt::format("sheet {} is cut upright: tilted cuts would enter the part", piece.number));
    }
    tell_unmarked(plan);
    if (on_the_way > 0)
        tell(plan, Severity::warning, "sheets.pierce",
             fmt::format("{} cuts have no room for a lead and begin on the edge of the part", on_the_way));
}

}  // namespace

namespace {

/// Heights of level faces, up or down, that are at least so large together; the largest first.
std::vector<double> flats_to_keep(Context& context, MeshView mesh, double least_mm2, double height) {
    if (!(least_mm2 > 0)) return {};
    constexpr double same = 1e-3;
    std::map<std::int64_t, double> areas;  // by height in `same`
    for (const Feature& feature : find_features(context, mesh).features) {
        const bool is_flat = feature.type == FeatureType::up_flat || feature.type == FeatureType::down_flat;
        if (is_flat && feature.z_low > same && feature.z_low < height - same)
            areas[std::llround(feature.z_low / same)] += feature.area;
    }
    std::vector<std::pair<double, double>> flats;
    for (const auto& [z, mm2] : areas)
        if (mm2 >= least_mm2) flats.emplace_back(-mm2, double(z) * same);
    std::sort(flats.begin(), flats.end());
    std::vector<double> heights;
    for (const auto& [mm2, z] : flats) heights.push_back(z);
    return heights;
}

/// What holds the sheets; their outlines take it up. Empty where nothing is asked for.
std::vector<SheetHold> hold_sheets(Context& context, MeshView mesh, const std::vector<SheetSpan>& spans,
                                   const SheetJob& job, std::vector<SheetStair>& stairs) {
    if (job.alignment.way == SheetAlignment::none) return {};
    std::vector<Loops> outlines, cores;
    for (const SheetStair& stair : stairs) outlines.push_back(stair.outline);
    for (SheetStair& core : stairs_of(context, mesh, spans, StairSide::inside, false))
        cores.push_back(std::move(core.outline));
    std::vector<SheetHold> holds =
        holds_of(spans, outlines, cores, job.alignment, job.cutting.most_tilt_deg > 0);
    for (std::size_t i = 0; i < spans.size(); ++i)
        stairs[i].outline = with_hold(stairs[i].outline, holds[i], job.alignment.dowel);
    return holds;
}

/// Where each sheet touches the next: upright ones where their outlines cover each other, tilted ones where
/// the part's sections just below and just above do.
std::vector<Loops> bonded_faces(Context& context, MeshView mesh, const SheetJob& job,
                                const std::vector<SheetSpan>& spans, const std::vector<SheetStair>& stairs) {
    std::vector<Loops> faces;
    if (job.cutting.most_tilt_deg > 0) {
        std::vector<Plane> planes;
        for (std::size_t i = 0; i + 1 < spans.size(); ++i) {
            planes.push_back({spans[i].top, Side::below});
            planes.push_back({spans[i + 1].bottom, Side::above});
        }
        const std::vector<Section> sections = slice(context, mesh, planes);
        for (std::size_t k = 0; k < sections.size(); k += 2)
            faces.push_back(intersect(sections[k].loops, sections[k + 1].loops));
        return faces;
    }
    for (std::size_t i = 0; i + 1 < stairs.size(); ++i)
        faces.push_back(intersect(stairs[i].outline, stairs[i + 1].outline));
    return faces;
}

/// Numbers and match marks of the pieces, where they are asked for.
void engrave(Context& context, SheetsPlan& plan, const std::vector<Loops>& faces,
             const std::vector<SheetHold>& holds, const std::vector<SheetStair>& stairs) {
    const SheetJob& job = plan.job;
    if (job.engraving.depth == 0) return;
    const double dowel = job.alignment.dowel;
    const auto hold = [&](std::size_t i) { return i < holds.size() ? holds[i] : SheetHold{}; };
    std::vector<EngravedFace> engraved(stairs.size());
    for (std::size_t i = 0; i < stairs.size(); ++i) {
        EngravedFace& face = engraved[i];
        face.outline = stairs[i].outline;
        face.tabs = with_hold(unite(hold(i).added, {}), {{}, hold(i).holes}, dowel);
        if (i + 1 == stairs.size()) continue;  // nothing covers it
        face.covered = with_hold(faces[i], {{}, hold(i).holes}, dowel);
        face.covered = with_hold(face.covered, {{}, hold(i + 1).holes}, dowel);
        face.next = job.cutting.most_tilt_deg > 0 ? with_hold(faces[i], {hold(i + 1).added, {}}, dowel)
                                                  : stairs[i + 1].outline;
    }
    auto all = engravings_of(context, engraved, job.engraving);
    for (std::size_t i = 0; i < all.size(); ++i) plan.pieces[i].engravings = std::move(all[i]);
}

/// Indices of cuts, those that more others run around first: what stands in a hole is cut free before the
/// hole falls out.
std::vector<std::size_t> from_inside(const SheetCuts& cuts) {
    std::vector<int> depth(cuts.loops.size(), 0);
    for (std::size_t i = 0; i < cuts.loops.size(); ++i)
        for (const AxisLoop& other : cuts.loops) {
            if (other.pass != 0 || other.loop == cuts.loops[i].loop) continue;
            Loops ring;
            ring.points = other.top;
            ring.close_loop();
            depth[i] += winding(ring, cuts.loops[i].top[0]) != 0;
        }
    std::vector<std::size_t> order(depth.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return depth[a] > depth[b]; });
    return order;
}

/// Offcuts are used before whole sheets.
void require_sheets(const SheetJob& job, double thickness, const Nest& nest,
                    const std::vector<StockSheet>& offcuts) {
    const auto is_offcut = [&](const StockSheet& sheet) {
        return std::any_of(offcuts.begin(), offcuts.end(), [&](const StockSheet& offcut) {
            return offcut.length == sheet.length && offcut.width == sheet.width;
        });
    };
    const bool alike = is_offcut(job.stock);  // then the first ones are offcuts
    const auto rests =
        alike ? std::min(nest.stock.size(), offcuts.size())
              : static_cast<std::size_t>(std::count_if(nest.stock.begin(), nest.stock.end(), is_offcut));
    const std::size_t whole = nest.stock.size() - rests;
    for (const SheetCount& count : job.counts)
        if (std::abs(count.thickness - thickness) < 1e-6 && whole > static_cast<std::size_t>(count.sheets))
            throw Error(
                ErrorKind::no_plan, "sheets.stock",
                fmt::format("the pieces of {:.4g} mm take {} whole {}, and there {} {}", thickness, whole,
                            whole == 1 ? "sheet" : "sheets", count.sheets == 1 ? "is" : "are", count.sheets),
                "", "leave that thickness out of --thickness, or get more");
}

/// Lays the pieces of one thickness on their stock, and their cuts in its programs.
/// @returns how many cuts have no room for a lead
int lay_pieces(Context& context, SheetsPlan& plan, std::size_t t, const std::vector<SheetCuts>& cuts,
               const std::vector<Loops>& blanks) {
    const SheetJob& job = plan.job;
    const std::vector<SheetSpan>& spans = plan.stack.sheets;
    int on_the_way = 0;
    std::vector<std::size_t> own;
    std::vector<Loops> own_blanks;
    for (std::size_t i = 0; i < spans.size(); ++i)
        if (spans[i].stock == static_cast<int>(t)) own.push_back(i), own_blanks.push_back(blanks[i]);
    std::vector<StockSheet> offcuts;
    for (const SheetOffcut& offcut : job.offcuts)
        if (std::abs(offcut.thickness - job.slicing.thicknesses[t]) < 1e-6) offcuts.push_back(offcut.size);
    const Nest nest = nest_pieces(context, own_blanks, job.stock, offcuts, job.nesting);
    require_sheets(job, job.slicing.thicknesses[t], nest, offcuts);
    const std::size_t first = plan.programs.size();
    for (const StockSheet& stock : nest.stock) {
        SheetProgram program;
        program.thickness = job.slicing.thicknesses[t];
        program.stock = stock;
        plan.programs.push_back(program);
    }
    for (std::size_t k = 0; k < own.size(); ++k) {
        SheetPiece& piece = plan.pieces[own[k]];
        piece.place = nest.places[k];
        piece.program = static_cast<int>(first) + piece.place.stock;
        SheetProgram& program = plan.programs[static_cast<std::size_t>(piece.program)];
        program.pieces.push_back(piece.number);
        program.minutes += engraving_minutes(piece, job);
        const SheetCuts& own_cuts = cuts[own[k]];
        for (const std::size_t l : from_inside(own_cuts)) {
            const AxisLoop& loop = own_cuts.loops[l];
            const Loops top = ends_of(own_cuts, loop, true), bottom = ends_of(own_cuts, loop, false);
            const BorderDistance to_top(top), to_bottom(bottom);
            const Start start = start_of(loop, {&to_top, &to_bottom}, {&top, &bottom}, job.lead);
            on_the_way += start.lead == 0 && job.lead > 0;
            SheetWay way = way_of(loop, start, piece.place, program.thickness, job);
            way.piece = piece.number;
            double tilt = 0;
            for (const HeadPoint& p : way.points) tilt = std::max(tilt, p.a_deg);
            way.feed = feed_of(job, program.thickness, tilt);
            const WayLength length = length_of(way);
            const double depths = job.head == SheetHead::router
                                      ? std::ceil((program.thickness + job.through) / job.stepdown)
                                      : 1;
            program.cut_mm += length.mm * depths;
            program.minutes +=
                length.paced * depths / way.feed + (job.head == SheetHead::router ? 0.05 : job.pierce_s / 60);
            program.ways.push_back(std::move(way));
        }
        piece.label = piece.engravings.empty() ? program.ways.back().points[0].top
                                               : placed(piece.engravings[0].middle, piece.place);
    }
    return on_the_way;
}

}  // namespace

double engraving_feed(const SheetJob& job) {
    if (job.head != SheetHead::jet) return job.engraving.feed;
    constexpr double most = 15000;
    const double feed = jet_feed(job.jet, job.engraving.depth);
    if (feed > most)
        throw Error(
            ErrorKind::usage, "sheets.engrave",
            fmt::format("a jet that enters no deeper than {:.4g} mm runs at {:.0f} mm/min, over {:.0f}",
                        job.engraving.depth, feed, most),
            "", "give more to --engrave");
    return feed;
}

Mesh along_axis(Mesh mesh, char axis) {
    if (axis != 'x' && axis != 'y' && axis != 'z')
        throw Error(ErrorKind::usage, "sheets.axis", "sheets are stacked along x, y or z", "",
                    "give one of these");
    if (axis != 'z')
        for (Vec3f& v : mesh.vertices) v = axis == 'x' ? Vec3f{v.y, v.z, v.x} : Vec3f{v.z, v.x, v.y};
    const float low = bounds(mesh.view()).min.z;
    if (low != 0)
        for (Vec3f& v : mesh.vertices) v.z -= low;
    return mesh;
}

SheetsPlan plan_sheets(Context& context, const Mesh& mesh, const SheetJob& job) {
    require_job(job);
    SheetsPlan plan;
    plan.job = job;
    plan.height = bounds(mesh.view()).max.z;
    context.begin_phase("sheets", 0, 0.5);
    SheetRules slicing = job.slicing;
    for (const double flat : flats_to_keep(context, mesh.view(), job.keep_flats_mm2, plan.height))
        slicing.joints.push_back(flat);
    plan.stack = stack_of_sheets(context, mesh.view(), slicing);
    SheetRules uniform = job.slicing;
    uniform.strategy = SheetStrategy::uniform;
    plan.uniform_sheets = static_cast<std::size_t>((plan.height + uniform.bond + 1e-4) /
                                                   (uniform.thicknesses.front() + uniform.bond));
    const std::vector<SheetSpan>& spans = plan.stack.sheets;
    std::vector<SheetStair> stairs = stairs_of(context, mesh.view(), spans, job.slicing.side);
    std::vector<std::array<Point2, 4>> pins;
    for (const SheetStair& stair : stairs) pins.push_back(pins_of(stair.outline));
    const std::vector<Loops> faces = bonded_faces(context, mesh.view(), job, spans, stairs);
    const std::vector<SheetHold> holds = hold_sheets(context, mesh.view(), spans, job, stairs);
    context.begin_phase("cuts", 0.5, 0.8);
    const std::vector<SheetCuts> cuts =
        cuts_of(context, mesh.view(), spans, stairs, job.cutting, holds, job.alignment.dowel);
    add_pieces(plan, stairs, cuts);
    for (std::size_t i = 0; i < holds.size(); ++i) plan.pieces[i].hold = holds[i];
    engrave(context, plan, faces, holds, stairs);
    for (std::size_t i = 0; i < pins.size(); ++i) {
        plan.pieces[i].pins = pins[i];
        if (i >= faces.size()) continue;
        Loops bonded = faces[i];
        for (const std::size_t side : {i, i + 1})
            if (side < holds.size()) bonded = with_hold(bonded, {{}, holds[side].holes}, job.alignment.dowel);
        plan.pieces[i].joint_mm2 = area(bonded);
    }
    std::vector<Loops> blanks;
    for (std::size_t i = 0; i < cuts.size(); ++i)
        blanks.push_back(blank_of(cuts[i], job, spans[i].top - spans[i].bottom));
    context.begin_phase("nesting", 0.8, 1);
    int on_the_way = 0;
    for (std::size_t t = 0; t < job.slicing.thicknesses.size(); ++t)
        on_the_way += lay_pieces(context, plan, t, cuts, blanks);
    tell_findings(plan, cuts, on_the_way);
    return plan;
}

}  // namespace slabwright
