#include "engine/schedule/joints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/flask/flask.h"
#include "engine/forces/cuts.h"
#include "engine/layers/layers.h"
#include "engine/moves/path_builder.h"
#include "engine/schedule/blanks.h"
#include "engine/schedule/dowels.h"
#include "engine/schedule/footing.h"
#include "engine/stock/loose.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/hull.h"
#include "kernels/polygons/pieces.h"
#include "kernels/polygons/thinned.h"
#include "kernels/slicing/silhouette.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

/// The least distance from a point inside a convex polygon to its edges, mm.
double depth_in(const std::vector<Point2>& hull, double x, double y) {
    double least = hull.size() < 3 ? 0 : INFINITY;
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const Point2 a = hull[i], b = hull[i + 1 < hull.size() ? i + 1 : 0];
        const double dx = to_mm(std::int64_t{b.x} - a.x), dy = to_mm(std::int64_t{b.y} - a.y);
        least = std::min(least, (dx * (y - to_mm(a.y)) - dy * (x - to_mm(a.x))) / std::hypot(dx, dy));
    }
    return std::max(0.0, least);
}

Loops rectangle(const std::array<double, 2>& low, const std::array<double, 2>& high) {
    Loops loops;
    const Point2 a{to_units(low[0]), to_units(low[1])}, b{to_units(high[0]), to_units(high[1])};
    loops.points = {a, {b.x, a.y}, b, {a.x, b.y}};
    loops.close_loop();
    nest(loops);
    return loops;
}

/// How far from a joint to look into a layer for what stands there: beside it, but not past a thin layer's
/// middle.
double beside(const Layer& layer) { return std::min(kBesideJoint, (layer.z_top - layer.z_bottom) / 4); }

/// The heights of the joints between a layer's slabs, upwards.
std::vector<double> inner_joints(const Layer& layer) {
    std::vector<double> heights;
    for (int k = 1; k < layer.slabs; ++k)
        heights.push_back(layer.z_bottom + k * layer.slab_thickness / layer.slabs);
    return heights;
}

/// Whether something of the layer stands above a joint at z; if not, the slab above it is faced off.
bool stands_above(const Layer& layer, double z) { return z < layer.z_top - kSameHeight; }

}  // namespace

std::vector<std::vector<JointWood>> wood_at_joints(Context& context, MeshView mesh, const Plan& plan) {
    std::vector<HeightRange> kept;
    const auto keep = [&](double low, double top) {
        for (std::size_t k = 0; k <= JointWood::kRungs; ++k)
            kept.push_back({low + (top - low) * static_cast<double>(k) / (JointWood::kRungs + 1), top});
    };
    std::vector<Plane> under;
    for (std::size_t i = 0; i < plan.layers.size(); ++i) {
        const Layer& layer = plan.layers[i];
        // What lies within kTopSheet of the layer's top belongs to the next one.
        const double top = layer.z_top - 2 * kTopSheet;
        keep(layer.z_bottom + beside(layer), top);
        for (const double z : inner_joints(layer))
            if (stands_above(layer, z)) keep(std::min(z + kBesideJoint, (z + top) / 2), top);
        if (i == 0) continue;
        // A peak that ends just below the joint is not under it, nor is a roof that begins there: what stands
        // at both of two heights is neither.
        const double far = beside(plan.layers[i - 1]);
        under.push_back({layer.z_bottom - far, Side::below});
        under.push_back({layer.z_bottom - far / 6, Side::below});
    }
    // Open edges lie in the base plane only, or the loader would have refused them.
    const std::vector<Section> sections = slice(context, mesh, under, {plan.job.tolerances.gap});
    std::vector<Loops> above = shadows(context, mesh, kept);
    parallel_each(context, above.size(), [&](std::size_t i) { above[i] = lighter(std::move(above[i])); });
    std::vector<std::vector<JointWood>> joints(plan.layers.size());
    std::size_t next = 0;
    for (std::size_t i = 0; i < plan.layers.size(); ++i) {
        const Layer& layer = plan.layers[i];
        const auto add = [&](double z) {
            JointWood& wood = joints[i].emplace_back();
            wood.z = z;
            if (!stands_above(layer, z)) return;
            wood.above = std::move(above[next++]);
            for (Loops& higher : wood.higher) higher = std::move(above[next++]);
        };
        add(layer.z_bottom);
        for (const double z : inner_joints(layer)) add(z);
    }
    parallel_each(context, joints.size(), [&](std::size_t i) {
        const Blank slab = slab_of(plan, plan.layers[i]);
        for (std::size_t k = 0; k < joints[i].size(); ++k) {
            JointWood& wood = joints[i][k];
            const bool whole = i == 0 || k > 0;  // the board, or a slab that is not cut yet
            if (whole) wood.below = rectangle(slab.min, slab.max);
            else
                wood.below = lighter(intersect(sections[2 * (i - 1)].loops, sections[2 * (i - 1) + 1].loops));
            if (plan.flask && stands_above(plan.layers[i], wood.z)) {
                const Loops frame = flask_frame(*plan.flask, i);
                wood.above = unite(wood.above, frame);
                if (!whole) wood.below = unite(wood.below, frame);
            }
            wood.both = whole ? wood.above : intersect(wood.below, wood.above);
        }
    });
    return joints;
}

namespace {

std::array<double, 3> middle_of(const Box2& box, double z) {
    return {to_mm((std::int64_t{box.min.x} + box.max.x) / 2),
            to_mm((std::int64_t{box.min.y} + box.max.y) / 2), z};
}

std::string size_of(const Loops& region, const Box2& box) {
    return fmt::format("{:.0f} mm2, {:.1f} x {:.1f} mm", area(region),
                       to_mm(std::int64_t{box.max.x} - box.min.x),
                       to_mm(std::int64_t{box.max.y} - box.min.y));
}

/// "layer 6: the joint under it at 86.25 mm"
std::string words_of(const Layer& layer, const JointWood& wood) {
    return fmt::format("layer {}: the joint {} it at {:.2f} mm", layer.index,
                       wood.z > layer.z_bottom ? "within" : "under", wood.z);
}

constexpr const char* kOtherJoint =
    "choose other boundaries (layers.strategy, slabs.thicknesses), turn or split the pattern";

/// Pieces that are no more than this share of what stands of their layer may be lost without the build: a
/// pattern maker glues or dowels them on again.
constexpr double kFewPieces = 0.5;

/// Pieces with nothing under them fall off; no more than this share of their layer is made again by hand.
constexpr double kCrumbs = 0.02;

/// What stands of a layer piece by piece: every piece has to be held by glue of its own. Pieces smaller than
/// chips (kChip) are only remarked on.
void rate_pieces(const Layer& layer, const JointWood& wood, const Joint& joint, std::vector<WeakJoint>& weak,
                 std::vector<Diagnostic>& diagnostics) {
    const Pieces pieces(wood.above), contact(wood.both), glued(joint.glue);
    struct Worst {
        double area = 0, sum = 0;
        std::size_t piece = 0, count = 0;
    };
    Worst floating, bare;
    std::size_t chips = 0, chip = 0;
    for (std::size_t p = 0; p < pieces.size(); ++p) {
        const Loops& region = pieces.regions[p];
        if (area(glued.within(region, pieces.boxes[p])) > 0) continue;
        const double size = area(region);
        if (size < kChip) {
            if (size > kNoContact && chips++ == 0) chip = p;
            continue;
        }
        Worst& worst = area(contact.within(region, pieces.boxes[p])) > kNoContact ? bare : floating;
        ++worst.count;
        worst.sum += size;
        if (size > worst.area) worst.area = size, worst.piece = p;
    }
    const double standing = area(wood.above);
    const auto report = [&](const char* code, const char* what, const Worst& worst, bool refused) {
        if (worst.count == 0) return;
        const Box2& box = pieces.boxes[worst.piece];
        weak.push_back({code,
                        fmt::format("{}: {} piece{} of the layer {}, the largest of {}",
                                    words_of(layer, wood), worst.count, worst.count == 1 ? "" : "s", what,
                                    size_of(pieces.regions[worst.piece], box)),
                        middle_of(box, wood.z), std::string(kOtherJoint) + ", fasten it with dowels",
                        refused});
    };
    report("joint.floating", "with nothing under it", floating, floating.sum > kCrumbs * standing);
    report("joint.no_glue", "on wood too narrow for glue", bare, bare.sum > kFewPieces * standing);
    if (chips > 0)
        diagnostics.push_back({Severity::note, "joint.chips",
                               fmt::format("{}: {} piece{} of less than {} mm2 get no glue",
                                           words_of(layer, wood), chips, chips == 1 ? "" : "s", kChip),
                               middle_of(pieces.boxes[chip], wood.z)});
}

// Table and platen stay parallel (RPM: four ball screws), so the pressure is even over the glue, and its
// resultant acts in the glue's centroid. Off the table's middle the nearest screw bears more than a quarter
// of it, (1 + |ex|/a)·(1 + |ey|/b) times that, a and b half the table; none may bear more than a quarter of
// the press's force.
Joint pressed(double z, Loops glue, const Plan& plan) {
    Joint joint;
    const double x = (plan.stock_min[0] + plan.stock_max[0]) / 2,
                 y = (plan.stock_min[1] + plan.stock_max[1]) / 2;
    const AreaMoments m = area_moments(glue);
    joint.z = z;
    joint.glue = std::move(glue);
    joint.area_mm2 = m.area;
    joint.centroid = {x, y};
    if (!(m.area > 0)) return joint;
    joint.centroid = {m.x, m.y};
    const Machine& machine = plan.job.machine;
    const double a = std::max(machine.travel_x, plan.stock_max[0] - plan.stock_min[0]) / 2,
                 b = std::max(machine.travel_y, plan.stock_max[1] - plan.stock_min[1]) / 2;
    const double uneven = (1 + std::fabs(m.x - x) / a) * (1 + std::fabs(m.y - y) / b);
    joint.force_n =
        std::min(plan.job.bonding.press_force / uneven, m.area * plan.job.bonding.max_pressure_mpa);
    joint.pressure_mpa = joint.force_n / joint.area_mm2;
    return joint;
}

void rate_press(const Layer& layer, const JointWood& wood, const Joint& joint, const Plan& plan,
                std::vector<WeakJoint>& weak) {
    if (joint.pressure_mpa >= plan.job.bonding.min_pressure_mpa) return;
    weak.push_back({"joint.pressure",
                    fmt::format("{}: {:.0f} N on {:.0f} mm2 of glue press with {:.4f} MPa, less than the {} "
                                "MPa that close it",
                                words_of(layer, wood), joint.force_n, joint.area_mm2, joint.pressure_mpa,
                                plan.job.bonding.min_pressure_mpa),
                    {joint.centroid[0], joint.centroid[1], wood.z},
                    std::string("use a stronger press or smaller slabs, ") + kOtherJoint});
}

}  // namespace

std::vector<WeakJoint> bond_layer(Layer& layer, std::span<const JointWood> wood, const Plan& plan,
                                  std::vector<Diagnostic>& diagnostics) {
    std::vector<WeakJoint> weak;
    layer.joints.clear();
    for (std::size_t k = 0; k < wood.size(); ++k) {
        // Between whole slabs glue goes everywhere, so that no piece of the waste above a joint comes loose.
        const Loops glue = k > 0 ? wood[k].below
                                 : outside_dowels(glue_within(wood[k].both, plan.job.bonding.edge_setback),
                                                  dowels_under(plan, layer));
        Joint joint = pressed(wood[k].z, glue, plan);
        joint.standing_mm2 = area(wood[k].both);
        // Every press goes through the joint under the layer.
        if (k > 0 && joint.area_mm2 > 0) {
            joint.force_n = std::min(joint.force_n, layer.joints.front().force_n);
            joint.pressure_mpa = joint.force_n / joint.area_mm2;
        }
        const std::size_t found = weak.size();
        rate_pieces(layer, wood[k], joint, weak, diagnostics);
        if (joint.area_mm2 > 0) rate_press(layer, wood[k], joint, plan, weak);
        else if (weak.size() == found)
            weak.push_back({"joint.no_glue",
                            fmt::format("{}: nothing of the slab is glued", words_of(layer, wood[k])),
                            {joint.centroid[0], joint.centroid[1], wood[k].z},
                            kOtherJoint});
        layer.joints.push_back(std::move(joint));
    }
    return weak;
}

namespace {

/// What cutting does to a slab that is whole: the hardest of facing and roughing.
struct SlabCut {
    double side_n = 0;  ///< along the joint
    double push_n = 0;  ///< across it, up or down, wherever the slab ends
};

SlabCut hardest_on_slab(const Job& job) {
    const auto is_face = [](const Tool& tool) { return tool.kind == ToolKind::face; };
    const bool faced = std::any_of(job.tools.begin(), job.tools.end(), is_face);
    SlabCut most;
    for (const Tool& tool : job.tools) {
        if (!is_face(tool) && !roughs_layers(tool.kind)) continue;
        const double depth = is_face(tool) ? job.cutting.face_depth : tool.stepdown_max;
        if (!(depth > 0)) continue;
        CutSegment cut = slot_cut(job, tool, std::min(depth, tool.flute_length));
        cut.arc = engagement_arc(cut.radius_mm, tool.diameter * job.cutting.max_engagement, MillingSense::up);
        const CutForce force = peak_force(cut);
        most.side_n = std::max(most.side_n, force.peak_in_plane_n);
        // The face mill takes the waste that lies open; an end mill works beside the pattern.
        if (is_face(tool) || !faced || !job.cutting.open_waste)
            most.push_n = std::max(most.push_n, force.peak_axial_n);
    }
    return most;
}

constexpr double kGravity = 9.81;  // m/s²

/// To which share of its force a cut can be taken down by feed and depth: what breaks even then is refused.
constexpr double kGentle = 0.25;

/// What stands on a joint may be lost without the build where it is no more than this share of the pattern.
constexpr double kSmallTop = 0.05;

/// A slab needs to reach no farther than this past what its layer keeps, mm: programs pass the rest in air.
constexpr double kPieceMargin = 15;

Blank piece_for(const JointWood& wood, const Blank& stock) {
    Box2 box;
    for (const Loops* region : {&wood.above, &wood.both})
        for (const Point2 p : region->points) box.grow(p);
    const auto clip = [](double v, double low, double high) { return std::clamp(v, low, high); };
    if (box.min.x > box.max.x) return stock;
    return {{clip(to_mm(box.min.x) - kPieceMargin, stock.min[0], stock.max[0]),
             clip(to_mm(box.min.y) - kPieceMargin, stock.min[1], stock.max[1])},
            {clip(to_mm(box.max.x) + kPieceMargin, stock.min[0], stock.max[0]),
             clip(to_mm(box.max.y) + kPieceMargin, stock.min[1], stock.max[1])}};
}

/// The hardest that a joint has to bear, and when.
struct HardestTime {
    double turning = 0;         ///< Footing::turning under gentle cuts
    double pull_mpa = 0;        ///< Footing::pull_mpa under the hardest
    double glue_mm2 = 0;        ///< that holds then
    double kg = 0, off_mm = 0;  ///< what it carries then, and how far that lies outside the wood under it
    std::size_t layer = 0;      ///< that is cut
    double x = 0, y = 0;        ///< the middle of the glue, mm
    void take(const HardestTime& other) {
        if (other.turning > turning || (other.turning == turning && other.pull_mpa > pull_mpa)) *this = other;
    }
};

void rate_footing(const Layer& layer, const JointWood& wood, const Layer& cut, const HardestTime& worst,
                  double bears, bool small_top, std::vector<WeakJoint>& weak,
                  std::vector<Diagnostic>& diagnostics) {
    const std::array<double, 3> where{worst.x, worst.y, wood.z};
    const std::string carries =
        fmt::format("{}: while layer {} is cut, {:.0f} mm2 of glue carry {:.1f} kg{}", words_of(layer, wood),
                    cut.index, worst.glue_mm2, worst.kg,
                    worst.off_mm > 0
                        ? fmt::format(", whose middle overhangs the wood under it by {:.1f} mm", worst.off_mm)
                        : "");
    if (worst.turning > 1 && !small_top)
        weak.push_back(
            {"joint.tips",
             fmt::format("{}: weight and the gentlest cut are {:.1f} times what glue of {} MPa holds",
                         carries, worst.turning, bears),
             where,
             std::string("leave supports (layers.supports) or a flask (flask.enabled), ") + kOtherJoint});
    else if (worst.pull_mpa > bears)
        diagnostics.push_back({Severity::warning, "joint.overhang",
                               fmt::format("{}: the glue is pulled with up to {:.2f} MPa, over {} MPa; prop "
                                           "the free side, cut gently or fasten it with dowels",
                                           carries, worst.pull_mpa, bears),
                               where});
    else if (worst.off_mm > 0 && cut.index == layer.index)
        diagnostics.push_back({Severity::note, "joint.overhang",
                               fmt::format("{}: hold the slab until the glue has set; then it is pulled with "
                                           "up to {:.2f} MPa",
                                           carries, worst.pull_mpa),
                               where});
}

/// Two weights as one.
DownForce together(const DownForce& a, const DownForce& b) {
    const double n = a.n + b.n;
    if (!(n > 0)) return {};
    return {n, (a.n * a.x + b.n * b.x) / n, (a.n * a.y + b.n * b.y) / n};
}

// Of a layer that is done its wood stands: between what it keeps at its bottom and a quarter below its top,
// by the middle of the two.
DownForce weight_of(const Layer& layer, const Loops& bottom, const Loops& top, double density_kg_m3) {
    const double newton_mm2 = (layer.z_top - layer.z_bottom) * 1e-9 * density_kg_m3 * kGravity / 2;
    const AreaMoments low = area_moments(bottom), high = area_moments(top);
    return together({low.area * newton_mm2, low.x, low.y}, {high.area * newton_mm2, high.x, high.y});
}

}  // namespace

std::vector<std::vector<WeakJoint>> slabs_that_tip(Plan& plan, std::span<const std::vector<JointWood>> wood,
                                                   std::vector<Diagnostic>& diagnostics) {
    const std::size_t n = plan.layers.size();
    const double bears = plan.job.bonding.max_pressure_mpa, density = plan.job.material.density_kg_m3;
    const SlabCut cut = hardest_on_slab(plan.job);
    const std::vector<Blank> slabs = slabs_of(plan);
    // What of the wood is the pattern's: nothing ties it to the flask once its layer is cut.
    std::vector<Footing> footings;
    std::vector<DownForce> standing;
    for (std::size_t i = 0; i < n; ++i) {
        const JointWood& under = wood[i].front();
        const Loops& glue = plan.layers[i].joints.front().glue;
        const Loops frame = plan.flask ? flask_frame(*plan.flask, i) : Loops{};
        const auto of_pattern = [&](const Loops& r) { return frame.empty() ? r : subtract(r, frame); };
        footings.emplace_back(of_pattern(glue), of_pattern(under.both));
        standing.push_back(
            weight_of(plan.layers[i], of_pattern(under.above), of_pattern(under.higher.back()), density));
    }
    std::vector<Blank> laid = slabs;
    // Joint i while layer c is cut: `weight` of what stands of the layers between, and the slab of c whole,
    // or what stands of it where a flask holds the slab.
    const auto at = [&](const Footing& footing, std::size_t i, std::size_t c, DownForce weight) {
        const Layer& layer = plan.layers[c];
        const Blank& s = laid[c];
        const DownForce slab{s.mm2() * layer.slab_thickness * 1e-9 * density * kGravity,
                             (s.min[0] + s.max[0]) / 2, (s.min[1] + s.max[1]) / 2};
        weight = together(weight, plan.flask ? standing[c] : slab);
        const std::array<std::array<double, 2>, 4> corners{
            {{s.min[0], s.min[1]}, {s.max[0], s.min[1]}, {s.max[0], s.max[1]}, {s.min[0], s.max[1]}}};
        const FootingLoad load{{weight},
                               plan.flask ? 0 : cut.push_n,
                               corners,
                               cut.side_n * (layer.z_top - plan.layers[i].z_bottom)};
        FootingLoad gentle = load;
        gentle.push_n *= kGentle;
        gentle.side_bending_nmm *= kGentle;
        return HardestTime{.turning = footing.turning(gentle, bears),
                           .pull_mpa = footing.pull_mpa(load),
                           .glue_mm2 = footing.glue().area,
                           .kg = weight.n / kGravity,
                           .off_mm = footing.outside_by(weight.x, weight.y),
                           .layer = c,
                           .x = footing.glue().x,
                           .y = footing.glue().y};
    };
    // A pattern maker lays a piece of a slab where a whole one would break off.
    const auto with_piece = [&](const Footing& footing, std::size_t i, std::size_t c,
                                const DownForce& weight) {
        const HardestTime whole = at(footing, i, c, weight);
        if (whole.pull_mpa <= bears || plan.flask || laid[c].mm2() < slabs[c].mm2()) return whole;
        laid[c] = piece_for(wood[c].front(), slabs[c]);
        const HardestTime piece = at(footing, i, c, weight);
        if (laid[c].mm2() < 0.8 * slabs[c].mm2() &&
            (whole.turning > 1 ? piece.turning < 0.8 * whole.turning : piece.pull_mpa <= bears))
            return piece;
        laid[c] = slabs[c];
        return whole;
    };
    std::vector<HardestTime> worst(n);
    for (std::size_t i = 0; i < n; ++i) {
        Joint& joint = plan.layers[i].joints.front();
        if (!(joint.area_mm2 > 0)) continue;  // said by bond_layer
        if (i > 0) {
            worst[i] = with_piece(footings[i], i, i, {});
        } else if (worst[i] = at(footings[i], i, i, {}); worst[i].pull_mpa > bears) {
            // The board is sacrificial: what the pattern's foot cannot hold, glue all over it does.
            diagnostics.push_back(
                {Severity::note,
                 "joint.board",
                 fmt::format("layer 1 is glued all over the board: the {:.0f} mm2 under the pattern alone "
                             "would not hold the slab while it is cut",
                             joint.area_mm2),
                 {}});
            const double standing_mm2 = joint.standing_mm2;
            joint = pressed(joint.z, wood[i].front().below, plan);
            joint.standing_mm2 = standing_mm2;
            worst[i] = at(Footing(joint.glue, wood[i].front().below), i, i, {});
        }
        DownForce weight;
        for (std::size_t c = i + 1; c < n; ++c)
            worst[i].take(with_piece(footings[i], i, c, weight = together(weight, standing[c - 1])));
    }
    std::vector<double> above(n);  // N
    for (std::size_t i = n; i-- > 0;) above[i] = standing[i].n + (i + 1 < n ? above[i + 1] : 0);
    std::vector<std::vector<WeakJoint>> weak(n);
    for (std::size_t i = 0; i < n; ++i) {
        const Layer& layer = plan.layers[i];
        const Joint& joint = layer.joints.front();
        if (laid[i].mm2() < slabs[i].mm2())
            diagnostics.push_back(
                {Severity::warning, "joint.small_slab",
                 fmt::format(
                     "layer {}: lay a piece of {:.0f} x {:.0f} mm, {:.0f} mm in x and {:.0f} mm in y from "
                     "the whole slab's corner, not the whole slab, which would break off; programs "
                     "pass the rest in air",
                     layer.index, laid[i].max[0] - laid[i].min[0], laid[i].max[1] - laid[i].min[1],
                     laid[i].min[0] - slabs[i].min[0], laid[i].min[1] - slabs[i].min[1]),
                 std::array<double, 3>{joint.centroid[0], joint.centroid[1], joint.z}});
        if (joint.area_mm2 > 0)
            rate_footing(layer, wood[i].front(), plan.layers[worst[i].layer], worst[i], bears,
                         above[i] <= kSmallTop * above[0], weak[i], diagnostics);
    }
    return weak;
}

namespace {

/// How the programs of a layer load a piece that stands free of its slab.
struct SideLoad {
    double bending_nmm = 0;  ///< about the joint
    double force_n = 0;
};

// Above the level that is being cut a piece is clear of its slab, below it they are one. So roughing bends
// the joint when it is on its last level, at most a step above it, and what comes after it up to the piece's
// top.
SideLoad side_load(const Layer& layer, double height) {
    SideLoad load;
    for (const Operation& op : layer.operations) {
        if (op.kind == OperationKind::face) continue;
        const double arm =
            op.kind == OperationKind::rough && op.stepdown > 0 ? std::min(op.stepdown, height) : height;
        load.bending_nmm = std::max(load.bending_nmm, op.peak_force_n * arm);
        load.force_n = std::max(load.force_n, op.peak_force_n);
    }
    return load;
}

/// How high a piece stands over its joint, at most, mm.
double height_of(const JointWood& wood, const Loops& piece, double layer_mm) {
    std::size_t rungs = 0;
    while (rungs < JointWood::kRungs && area(intersect(wood.higher[rungs], piece)) > kNoContact) ++rungs;
    return layer_mm * static_cast<double>(rungs + 1) / (JointWood::kRungs + 1);
}

}  // namespace

std::vector<WeakJoint> joints_under_load(const Layer& layer, std::span<const JointWood> wood,
                                         const Plan& plan) {
    // A piece turns over the edge of what it stands on, and all of its glue holds it down with what the wood
    // bears across its faces: the internal bond of MDF is 0.55 to 0.65 MPa (EN 622-5), near the pressure that
    // the job allows, which is taken for it. More than that no distribution of the stress can bear.
    const double bears = plan.job.bonding.max_pressure_mpa;
    std::vector<WeakJoint> weak;
    for (std::size_t k = 0; k < wood.size() && k < layer.joints.size(); ++k) {
        const Pieces pieces(wood[k].above), contact(wood[k].both), glued(layer.joints[k].glue);
        double worst = bears, worst_area = 0, sum = 0;
        std::size_t which = pieces.size(), count = 0;
        for (std::size_t p = 0; p < pieces.size(); ++p) {
            const Loops& piece = pieces.regions[p];
            const AreaMoments glue = area_moments(glued.within(piece, pieces.boxes[p]));
            if (!(glue.area > 0) || area(piece) < kChip) continue;  // said by bond_layer
            const SideLoad load = side_load(layer, height_of(wood[k], piece, layer.z_top - wood[k].z));
            const double lever =
                depth_in(convex_hull(contact.within(piece, pieces.boxes[p]).points), glue.x, glue.y);
            const double stress = std::max(lever > 0 ? load.bending_nmm / (glue.area * lever) : INFINITY,
                                           load.force_n / glue.area);
            if (stress <= bears) continue;
            ++count;
            sum += area(piece);
            if (stress > worst) {
                worst = stress;
                which = p;
                worst_area = glue.area;
            }
        }
        if (which == pieces.size()) continue;
        weak.push_back(
            {"joint.weak",
             fmt::format(
                 "{}: {} piece{} may break off, the weakest of {} on {:.0f} mm2 of glue: cutting loads "
                 "it with {:.2f} MPa, over {} MPa",
                 words_of(layer, wood[k]), count, count == 1 ? "" : "s",
                 size_of(pieces.regions[which], pieces.boxes[which]), worst_area, worst, bears),
             middle_of(pieces.boxes[which], wood[k].z),
             std::string("fasten it with dowels, cut it with less force (smaller tools), ") + kOtherJoint,
             sum > kFewPieces * area(wood[k].above), sum});
    }
    return weak;
}

}  // namespace slabwright
