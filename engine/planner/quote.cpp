#include "engine/planner/quote.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "engine/plan.h"
#include "engine/planner/underside.h"
#include "engine/schedule/blanks.h"
#include "engine/schedule/fit.h"
#include "engine/schedule/glue_path.h"
#include "engine/tool_choice/select.h"
#include "engine/tools/tools.h"
#include "engine/undersides/underside_target.h"
#include "kernels/cutting/cusp.h"
#include "kernels/errors.h"
#include "kernels/features/facet_classes.h"
#include "kernels/features/filled_columns.h"
#include "kernels/features/unmade_air.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/loops.h"
#include "kernels/polygons/thinned.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kBeside = 0.05;  // mm from a layer's ends to where it is cut by a plane
constexpr double kUpright = 89.5, kLevel = 0.5, kSteep = 45;  // degrees

/// What milling takes over its ways at full feed, and minutes of a place in a layer: fitted to the programs
/// of castings and of a pool (bench/quote --fit), least squares of relative errors, those over a quarter
/// weighing less. Walls and floors are small beside these and go with the places.
struct Rates {
    double facing = 1.685, roughing = 0.590, contours = 2.270, raster = 3.288;
    double narrow =
        14.55;            // narrow air is roughed by the end mill and again by the finishing tool, and slowly
    double thin = 13.93;  // thin walls are spared by feed and by passes
    double place = 2.441;  // min
    double turn = 0.0259;  // min a radian: machines slow down where an outline turns
    double small = 0;      // min, of a layer's radians to the power of kManyTurns
};
/// Of chosen tools, which clear deeper and reach into small corners, fitted likewise to plans with the
/// shop's.
constexpr Rates kChosen{.facing = 1.761,
                        .roughing = 3.231,
                        .contours = 0.722,
                        .raster = 3.394,
                        .narrow = 76.2,
                        .thin = 72.97,
                        .place = 0.776,
                        .turn = 0,
                        .small = 1.062};
/// What corners leave to smaller tools takes a change and a way of its own in each layer, and grows more
/// slowly than the turns of its outlines do.
constexpr double kManyTurns = 0.3;

constexpr double kSmallPlace = 150;  // mm: a loop so long counts as half a place
constexpr double kSeenTurn = 0.03;   // mm from a loop's chords, within which it may turn
constexpr double kChanges = 3.2;     // of tools in a layer
constexpr double kHandlings = 4;     // of a slab that is milled from below
/// Of what its ways take over a layer: places count the facing and the floors of layers, too, which an
/// underside has not. Least squares of relative errors over four castings with LUO's tools and a tunnel.
constexpr double kBelow = 0.8;
constexpr double kThin = 8;          // mm: walls that are thinner count
constexpr double kSeenWidth = 0.05;  // mm, to which widths of wood and air are measured

Rates rates_of(const Job& job) { return selects_tools(job) ? kChosen : Rates{}; }

/// Ways of one kind in all layers, mm.
struct Ways {
    double facing = 0, roughing = 0, contours = 0, raster = 0;
    double places = 0;  ///< loops of sections, small ones by their length
    double turns = 0;   ///< rad by which outlines turn back, over all levels
    double small = 0;   ///< of that in each layer the power kManyTurns
    double thin = 0;    ///< mm along walls thinner than kThin, over all levels
    double narrow = 0;  ///< mm of roughing where clearing_tool() does not fit
};

const Tool& face_mill(const Job& job) {
    for (const Tool& tool : job.tools)
        if (tool.kind == ToolKind::face) return tool;
    throw Error(ErrorKind::usage, "job.tool", "the library has no face mill", "tool", "give one");
}

/// What clears what lies open: the face mill, or of chosen tools the widest roughing cutter, which cuts
/// deeper.
const Tool& clearing_tool(const Job& job, const Tool& face) {
    if (!selects_tools(job)) return face;
    const Tool* widest = nullptr;
    for (const Tool& tool : job.tools)
        if (roughs_layers(tool.kind) && (widest == nullptr || tool.diameter > widest->diameter))
            widest = &tool;
    return widest != nullptr ? *widest : face;
}

/// mm, to which rates of a volume are fitted: LUO's for 1/2 in.
constexpr double kDeepest = 0.15 * kInch;

/// mm³ that a tool takes away over a millimetre of clearing.
double swath(const Tool& tool) {
    return tool.diameter * tool.stepover * std::min(tool.stepdown_max, kDeepest);
}

/// mm that clear so much of a layer: with chosen tools of the flat whose way is the shortest, in levels as
/// deep as it may cut; else as the rate of roughing is fitted, by the volume.
double clearing_way(const Job& job, const LayerTools& tools, double mm2, double height) {
    if (!selects_tools(job)) return mm2 * height / swath(tools.rough);
    double least = std::numeric_limits<double>::infinity();
    for (const Tool& tool : job.tools)
        if (roughs_layers(tool.kind))
            least = std::min(
                least, mm2 * std::ceil(height / tool.stepdown_max - 1e-9) / (tool.diameter * tool.stepover));
    return least;
}

double perimeter(std::span<const Point2> loop) {
    double sum = 0;
    for (std::size_t k = 0; k < loop.size(); ++k) {
        const Point2 a = loop[k], b = loop[(k + 1) % loop.size()];
        sum += std::hypot(to_mm(b.x) - to_mm(a.x), to_mm(b.y) - to_mm(a.y));
    }
    return sum;
}

/// rad by which a loop turns back at its corners, of what it turns besides going round once.
double turning_back(std::span<const Point2> loop) {
    double sum = 0;
    const std::size_t n = loop.size();
    for (std::size_t k = 0; k < n; ++k) {
        const Point2 a = loop[k], b = loop[(k + 1) % n], c = loop[(k + 2) % n];
        const double ux = to_mm(b.x) - to_mm(a.x), uy = to_mm(b.y) - to_mm(a.y);
        const double vx = to_mm(c.x) - to_mm(b.x), vy = to_mm(c.y) - to_mm(b.y);
        sum += std::abs(std::atan2(ux * vy - uy * vx, ux * vx + uy * vy));
    }
    return std::max(0.0, (sum - 2 * std::numbers::pi) / 2);
}

/// mm² of wood where no circle of this diameter fits: walls that are thinner, and sharp outer corners.
double thin_area(const Loops& solid, double diameter) {
    const Loops thick = offset(offset(solid, -diameter / 2, kSeenWidth), diameter / 2, kSeenWidth);
    return std::max(0.0, area(solid) - area(thick));
}

/// mm² of air where no circle of this diameter fits, between walls and in inner corners.
double narrow_area(const Loops& solid, double diameter) {
    const Loops filled = offset(offset(solid, diameter / 2, kSeenWidth), -diameter / 2, kSeenWidth);
    return std::max(0.0, area(filled) - area(solid));
}

/// What one section counts for.
struct SectionCount {
    double mm2 = 0;
    double places = 0, turns = 0, thin = 0, narrow = 0;  ///< of Ways
};

/// @param height mm, of the part of a layer that it stands for
SectionCount count_section(const Loops& section, double height, const LayerTools& tools, const Tool& wide) {
    const Loops solid = simplify(section);
    SectionCount ways{.mm2 = area(solid)};
    for (std::size_t i = 0; i < solid.size(); ++i) {
        const double length = perimeter(solid.loop(i));
        ways.places += length / (length + kSmallPlace) / 3;
    }
    const double levels = height / tools.finish.stepdown_max;
    const Loops coarse = thinned(solid, kSeenTurn);
    for (std::size_t i = 0; i < coarse.size(); ++i) ways.turns += levels * turning_back(coarse.loop(i));
    const Loops seen = thinned(solid, kSeenWidth);
    ways.thin = levels * thin_area(seen, kThin) / kThin;
    ways.narrow = height * narrow_area(seen, wide.diameter) / swath(tools.rough);
    return ways;
}

/// Layers with the slabs that they are milled from, of the stocked thicknesses.
std::vector<Layer> slabbed_layers(const Slabs& slabs, const std::vector<double>& tops) {
    std::vector<Layer> layers;
    double bottom = 0;
    for (const double top : tops) {
        const double height = top - bottom;
        const auto fits = std::find_if(slabs.thicknesses.begin(), slabs.thicknesses.end(),
                                       [&](double t) { return t - slabs.facing_allowance >= height - 1e-9; });
        const double slab = fits != slabs.thicknesses.end() ? *fits : slabs.thicknesses.back();
        Layer& layer = layers.emplace_back();
        layer.index = static_cast<int>(layers.size());
        layer.z_bottom = bottom;
        layer.z_top = bottom = top;
        layer.slabs =
            std::max(1, static_cast<int>(std::ceil((height + slabs.facing_allowance) / slab - 1e-9)));
        layer.slab_thickness = layer.slabs * slab;
    }
    return layers;
}

/// mm² of the surface over the distance between its ways, by its slope.
struct SurfaceWays {
    double contours = 0, raster = 0;  // mm
};

/// Heights, mm.
struct HeightSpan {
    double low = -kUnbounded, high = kUnbounded;
};

/// The share of a facet that lies under z.
double share_below(const std::array<double, 3>& corners, double z) {
    const auto& [a, b, c] = corners;
    if (z <= a) return 0;
    if (z >= c) return 1;
    return z < b ? (z - a) * (z - a) / ((b - a) * (c - a)) : 1 - (c - z) * (c - z) / ((c - b) * (c - a));
}

/// The share of a facet that lies between two heights.
double share_of(MeshView mesh, std::uint32_t facet, const HeightSpan& between) {
    if (between.low == -kUnbounded && between.high == kUnbounded) return 1;
    std::array<double, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) corners[k] = mesh.vertices[mesh.facets[facet][k]].z;
    std::sort(corners.begin(), corners.end());
    return share_below(corners, between.high) - share_below(corners, between.low);
}

void add_surface(Context& context, MeshView mesh, const Job& job, const LayerTools& tools,
                 const HeightSpan& between, Ways& ways) {
    const double ball = tools.finish.diameter / 2, cusp = job.tolerances.cusp,
                 most = tools.finish.stepdown_max;
    constexpr std::size_t grain = std::size_t{1} << 14;
    const SurfaceWays sum = parallel_reduce(
        context, mesh.size(), grain, SurfaceWays{},
        [&](std::size_t begin, std::size_t end) {
            SurfaceWays part;
            for (std::size_t f = begin; f < end; ++f) {
                const Vec3d n = area_normal(mesh, static_cast<std::uint32_t>(f));
                const double twice = length(n);
                if (!(twice > 0)) continue;
                const double mm2 = twice / 2 * share_of(mesh, static_cast<std::uint32_t>(f), between);
                const double slope = std::acos(std::clamp(n[2] / twice, -1.0, 1.0));
                const double degrees = slope * 180 / std::numbers::pi;
                if (degrees >= kUpright || degrees <= kLevel) continue;
                if (degrees > kSteep) {
                    // The cusp grows with the stepdown: mostly the largest one leaves little enough.
                    const double down = ball_level_cusp(ball, slope, most) <= cusp
                                            ? most
                                            : std::min(most, ball_level_stepdown(ball, slope, cusp));
                    part.contours += mm2 * std::sin(slope) / down;
                } else {
                    part.raster += mm2 / raster_stepover(ball, cusp, 0);
                }
            }
            return part;
        },
        [](SurfaceWays x, const SurfaceWays& y) {
            x.contours += y.contours;
            x.raster += y.raster;
            return x;
        });
    ways.contours += sum.contours;
    ways.raster += sum.raster;
}

/// Of three sections in each layer, from below: near its bottom, in the middle, near its top.
/// @param tops of the plan's layers, mm
std::vector<SectionCount> count_sections(Context& context, MeshView mesh, const Plan& plan,
                                         const std::vector<double>& tops, const LayerTools& tools,
                                         const Tool& wide) {
    std::vector<Plane> planes;
    double bottom = 0;
    for (const double top : tops) {
        const double beside = std::min(kBeside, (top - bottom) / 4);
        planes.push_back({bottom + beside, Side::above});
        planes.push_back({(bottom + top) / 2, Side::above});
        planes.push_back({top - beside, Side::above});
        bottom = top;
    }
    const std::vector<Section> sections = slice(context, mesh, planes);
    std::vector<SectionCount> counts(sections.size());
    parallel_each(context, sections.size(), [&](std::size_t i) {
        const Layer& layer = plan.layers[i / 3];
        counts[i] = count_section(sections[i].loops, (layer.z_top - layer.z_bottom) / 3, tools, wide);
    });
    return counts;
}

/// Of a layer's slabs. @param glued mm² of the joint under it; those between its slabs are glued all over
double bonding_minutes(const Job& job, const Box3& box, double glued, const Blank& slab, int slabs) {
    return (bonding_seconds(job, glued, double{box.max.x} - box.min.x) +
            (slabs - 1) * bonding_seconds(job, slab.mm2(), slab.length())) /
           60;
}

/// Changes of tools in a layer. The probe is put in once more, where it is a tool of its own.
double changes_of(const Machine& machine) {
    const bool probed = machine.probe == ProbeMode::cycle && knows_tool_lengths(machine.post);
    return probed ? kChanges + 1 : kChanges;
}

/// Adds what sections count, three of each layer.
void add_counts(std::span<const SectionCount> counts, Ways& ways) {
    for (std::size_t k = 0; k + 2 < counts.size(); k += 3)
        ways.small += std::pow(counts[k].turns + counts[k + 1].turns + counts[k + 2].turns, kManyTurns);
    for (const SectionCount& count : counts) {
        ways.places += count.places;
        ways.turns += count.turns;
        ways.thin += count.thin;
        ways.narrow += count.narrow;
    }
}

/// mm² of three sections from below, in each of which what is under it stays filled.
std::array<double, 3> filled_areas(std::span<const SectionCount> counts) {
    std::array<double, 3> areas{};
    for (std::size_t k = 3; k-- > 0;) areas[k] = std::max(counts[k].mm2, k < 2 ? areas[k + 1] : 0);
    return areas;
}

/// Simpson's rule.
double mean_area(const std::array<double, 3>& areas) { return (areas[0] + 4 * areas[1] + areas[2]) / 6; }

/// The slabs that are milled from below.
class Undersides {
public:
    Undersides(Context& context, MeshView mesh, const Plan& plan)
        : context_(context), mesh_(mesh), plan_(plan) {}

    /// @returns how many there are
    int add(const std::vector<MilledLayer>& milled, const LayerTools& tools, const Tool& wide, Ways& ways) {
        int count = 0;
        for (std::size_t l = 0; l < milled.size(); ++l) {
            if (milled[l].milled != MilledFrom::both_sides) continue;
            ++count;
            add(turned_slab(plan_, plan_.layers[l], milled[l].web), tools, wide, ways);
        }
        return count;
    }

private:
    void add(const TurnedSlab& slab, const LayerTools& tools, const Tool& wide, Ways& ways) {
        const Mesh target = underside_target(context_, mesh_, slab);
        const double floor = recess_floor(slab), top = slab.slab_thickness, height = top - floor;
        const double beside = std::min(kBeside, height / 4);
        const std::vector<Plane> planes{
            {floor + beside, Side::above}, {(floor + top) / 2, Side::above}, {top - beside, Side::above}};
        const std::vector<Section> sections = slice(context_, target.view(), planes);
        std::array<SectionCount, 3> counts;
        parallel_each(context_, counts.size(), [&](std::size_t k) {
            counts[k] = count_section(sections[k].loops, height / 3, tools, wide);
        });
        add_counts(counts, ways);
        const Box3 tray = bounds(context_, target.view());
        const double whole = (double{tray.max.x} - tray.min.x) * (double{tray.max.y} - tray.min.y);
        ways.roughing +=
            clearing_way(plan_.job, tools, std::max(0.0, whole - mean_area(filled_areas(counts))), height);
        add_surface(context_, target.view(), plan_.job, tools, {floor, top}, ways);
    }

    Context& context_;
    MeshView mesh_;
    const Plan& plan_;
};

/// Layers as a plan would have them, and which slabs are milled from below.
struct QuotedLayers {
    LayersOf layers;
    std::optional<AirGaps> gaps;  ///< none: all slabs are milled from above
};

QuotedLayers quoted_layers(Context& context, MeshView mesh, const Job& job) {
    if (job.layers.sides == SlabSides::one) return {layers_of(context, mesh, job), std::nullopt};
    check_two_sided(job, mesh);
    const LayerRequest request = quick_layer_request(context, mesh, job);
    QuotedLayers found;
    found.gaps = air_gaps(context, mesh, filled_cell(mesh));
    const LayerPlacement placement =
        place_two_sided(context, job, request, *found.gaps, place_layers(job.layers.strategy, request));
    for (const Boundary& b : placement.boundaries) found.layers.tops.push_back(b.z);
    found.layers.lying.layers = static_cast<int>(found.layers.tops.size());
    found.layers.lying.has_room = has_room(bounds(context, mesh), job);
    return found;
}

/// What stays filled, higher than tolerances.undercut.
void tell_unmade(const UnmadeAir& left, double undercut, Lying& outcome) {
    for (const UnmadePocket& pocket : left.pockets) {
        if (pocket.height_mm <= undercut) continue;
        outcome.unmade_mm3 += pocket.volume_mm3;
        outcome.unmade_mm = std::max(outcome.unmade_mm, pocket.height_mm);
    }
}

/// Slabs, wood and glue, and what facing and roughing from above take.
/// @param counts three of each layer
void reckon_layers(const Plan& plan, const Box3& box, std::span<const SectionCount> counts,
                   const LayerTools& tools, const Tool& face, Quote& result, Ways& ways) {
    std::map<double, int> slabs;
    double stack_mm3 = 0;
    for (std::size_t l = 0; l < plan.layers.size(); ++l) {
        const Layer& layer = plan.layers[l];
        const double height = layer.z_top - layer.z_bottom, stock_mm2 = slab_of(plan, layer).mm2();
        const int together = layer.slabs;
        const double slab = layer.slab_thickness / together;
        slabs[slab] += together;
        result.slab_m2 += together * stock_mm2 * 1e-6;
        stack_mm3 += stock_mm2 * slab * together;
        const std::array<double, 3> area_at = filled_areas(counts.subspan(3 * l, 3));
        const double takes = slab * together - height;
        ways.facing += std::ceil(std::max(takes, 1e-3) / face.stepdown_max) * stock_mm2 /
                       (face.diameter * face.stepover);
        ways.roughing += clearing_way(plan.job, tools, std::max(0.0, stock_mm2 - mean_area(area_at)), height);
        const double below = l == 0 ? area_at[0] : counts[3 * l - 1].mm2;
        const double glued = std::min(area_at[0], below);
        result.glue_m2 += glued * 1e-6;
        result.bonding_minutes += bonding_minutes(plan.job, box, glued, slab_of(plan, layer), together);
    }
    for (const auto& [thickness, count] : slabs) result.slabs.push_back({thickness, count});
    result.mass_kg = (stack_mm3 + result.stock[0] * result.stock[1] * plan.job.machine.base_board_thickness) *
                     1e-9 * plan.job.material.density_kg_m3;
}

/// What the ways take on the machine.
std::vector<QuotedWork> work_of(const Ways& ways, const LayerTools& tools, const Tool& face,
                                const Rates& rates, const Machine& machine) {
    std::vector<QuotedWork> found;
    const auto work = [&](std::string_view name, double mm, const Tool& tool, double rate) {
        const double ideal = mm / std::min(tool.max_feed, machine.max_feed);
        found.push_back({name, ideal, rate * ideal});
    };
    work("facing", ways.facing, face, rates.facing);
    work("roughing", ways.roughing, tools.rough, rates.roughing);
    work("contours", ways.contours, tools.finish, rates.contours);
    work("raster", ways.raster, tools.finish, rates.raster);
    work("thin walls", ways.thin, tools.finish, rates.thin);
    work("narrow places", ways.narrow, tools.rough, rates.narrow);
    found.push_back({"places", ways.places, rates.place * ways.places});
    found.push_back({"turns", 0, rates.turn * ways.turns + rates.small * ways.small});
    return found;
}

double minutes_of(const std::vector<QuotedWork>& work) {
    double sum = 0;
    for (const QuotedWork& w : work) sum += w.minutes;
    return sum;
}

}  // namespace

Quote quote(Context& context, MeshView mesh, const Job& asked) {
    const Job job = with_cutting_data(asked);
    Plan plan;
    plan.job = job;
    const Box3 box = bounds(context, mesh);
    place_stock(plan, box);
    const QuotedLayers found = quoted_layers(context, mesh, job);
    const std::vector<double>& tops = found.layers.tops;
    const LayerTools tools = fixed_tools(job);
    const Tool &face = face_mill(job), &wide = clearing_tool(job, face);
    const Rates rates = rates_of(job);
    Quote result;
    result.outcome = found.layers.lying;
    result.stock = {plan.stock_max[0] - plan.stock_min[0], plan.stock_max[1] - plan.stock_min[1]};
    plan.layers = slabbed_layers(job.slabs, tops);
    saw_blanks(context, mesh, plan);
    result.boards = cut_list(plan);

    const std::vector<SectionCount> counts = count_sections(context, mesh, plan, tops, tools, wide);
    Ways ways, below;
    add_counts(counts, ways);
    reckon_layers(plan, box, counts, tools, face, result, ways);
    add_surface(context, mesh, job, tools, {}, ways);
    if (found.gaps) {
        const std::vector<MilledLayer> milled = milled_layers(context, plan, mesh, *found.gaps);
        tell_unmade(unmade_air(context, *found.gaps, milled), job.tolerances.undercut, result.outcome);
        result.undersides = Undersides(context, mesh, plan).add(milled, tools, wide, below);
    }
    result.work = work_of(ways, tools, face, rates, job.machine);
    result.cutting_minutes = minutes_of(result.work);
    const double changes = changes_of(job.machine) * job.machine.tool_change_s / 60;
    result.tool_change_minutes = changes * static_cast<double>(tops.size());
    // A slab is taken, laid on the spoil board, held there and turned.
    if (result.undersides > 0)
        result.underside_minutes =
            kBelow * minutes_of(work_of(below, tools, face, rates, job.machine)) +
            result.undersides * (changes + kHandlings * job.bonding.handling_s / 3 / 60);
    result.build_minutes = result.cutting_minutes + result.bonding_minutes + result.tool_change_minutes +
                           result.underside_minutes;
    Amounts amounts = amounts_of(plan, result.boards);
    amounts.glue_m2 = result.glue_m2;
    amounts.minutes = result.build_minutes;
    // As many as are asked for: places for them are found by a plan.
    amounts.dowels =
        (std::max<std::size_t>(tops.size(), 1) - 1) * static_cast<std::size_t>(job.dowels.per_joint);
    result.cost = cost_of(job, amounts);
    return result;
}

}  // namespace slabwright
