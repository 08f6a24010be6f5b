#include "engine/schedule/joints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/flask/flask.h"
#include "engine/layers/layers.h"
#include "engine/moves/thinning.h"
#include "engine/stock/loose.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/hull.h"
#include "kernels/slicing/silhouette.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kNoContact = 1e-3;  // mm²

/// Area, centroid and second moments about the centroid of a plane region, by Green's theorem over its loops,
/// and how far it reaches from the centroid. Millimetres.
struct AreaMoments {
    double area = 0, x = 0, y = 0;
    double ix = 0, iy = 0;            ///< ∫(x − cx)² dA and ∫(y − cy)² dA
    double reach_x = 0, reach_y = 0;  ///< largest |x − cx| and |y − cy|
};

AreaMoments moments(const Loops& loops) {
    AreaMoments m;
    if (loops.points.empty()) return m;
    // Coordinates count from the first point: far from the origin the second moments would cancel otherwise.
    const double ox = to_mm(loops.points[0].x), oy = to_mm(loops.points[0].y);
    double a2 = 0, sx = 0, sy = 0, sxx = 0, syy = 0;
    for (std::size_t l = 0; l < loops.size(); ++l) {
        const auto loop = loops.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 p = loop[i], q = loop[i + 1 < loop.size() ? i + 1 : 0];
            const double x0 = to_mm(p.x) - ox, y0 = to_mm(p.y) - oy, x1 = to_mm(q.x) - ox,
                         y1 = to_mm(q.y) - oy;
            const double cross = x0 * y1 - x1 * y0;
            a2 += cross;
            sx += cross * (x0 + x1);
            sy += cross * (y0 + y1);
            sxx += cross * (x0 * x0 + x0 * x1 + x1 * x1);
            syy += cross * (y0 * y0 + y0 * y1 + y1 * y1);
        }
    }
    if (!(a2 > 0)) return m;
    m.area = a2 / 2;
    const double cx = sx / 6 / m.area, cy = sy / 6 / m.area;
    m.x = cx + ox;
    m.y = cy + oy;
    m.ix = std::max(0.0, sxx / 12 - m.area * cx * cx);
    m.iy = std::max(0.0, syy / 12 - m.area * cy * cy);
    for (const Point2 p : loops.points) {
        m.reach_x = std::max(m.reach_x, std::fabs(to_mm(p.x) - m.x));
        m.reach_y = std::max(m.reach_y, std::fabs(to_mm(p.y) - m.y));
    }
    return m;
}

/// How far (x, y) lies outside a convex polygon, mm; 0 inside.
double outside_by(const std::vector<Point2>& hull, double x, double y) {
    double nearest = INFINITY;
    bool inside = hull.size() >= 3;
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const Point2 a = hull[i], b = hull[i + 1 < hull.size() ? i + 1 : 0];
        const double ax = to_mm(a.x), ay = to_mm(a.y), dx = to_mm(b.x) - ax, dy = to_mm(b.y) - ay;
        const double length2 = dx * dx + dy * dy;
        if (dx * (y - ay) - dy * (x - ax) < 0) inside = false;
        const double t = length2 > 0 ? std::clamp(((x - ax) * dx + (y - ay) * dy) / length2, 0.0, 1.0) : 0.0;
        nearest = std::min(nearest, std::hypot(x - ax - t * dx, y - ay - t * dy));
    }
    return inside ? 0 : nearest;
}

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

struct Box2 {
    Point2 min{INT32_MAX, INT32_MAX}, max{INT32_MIN, INT32_MIN};
    void grow(Point2 p) {
        min = {std::min(min.x, p.x), std::min(min.y, p.y)};
        max = {std::max(max.x, p.x), std::max(max.y, p.y)};
    }
    [[nodiscard]] bool meets(const Box2& o) const {
        return min.x <= o.max.x && o.min.x <= max.x && min.y <= o.max.y && o.min.y <= max.y;
    }
};

Box2 box_of(std::span<const Point2> points) {
    Box2 box;
    for (const Point2 p : points) box.grow(p);
    return box;
}

/// Loops of a region, each outer one with its holes.
struct Pieces {
    std::vector<Loops> regions;
    std::vector<Box2> boxes;

    explicit Pieces(const Loops& region) {
        Loops nested = region;
        if (nested.parents.size() != nested.size()) nest(nested);
        std::vector<std::size_t> piece_of(nested.size(), 0);
        for (std::size_t i = 0; i < nested.size(); ++i)
            if (signed_area(nested.loop(i)) > 0) {
                piece_of[i] = regions.size();
                regions.emplace_back();
                boxes.push_back(box_of(nested.loop(i)));
                append(nested.loop(i), regions.back());
            }
        for (std::size_t i = 0; i < nested.size(); ++i)
            if (signed_area(nested.loop(i)) < 0 && nested.parents[i] >= 0)
                append(nested.loop(i), regions[piece_of[static_cast<std::size_t>(nested.parents[i])]]);
    }
    [[nodiscard]] std::size_t size() const { return regions.size(); }

    /// What of them lies in a region whose box is given.
    [[nodiscard]] Loops within(const Loops& region, const Box2& box) const {
        Loops near;
        for (std::size_t i = 0; i < size(); ++i)
            if (boxes[i].meets(box))
                for (std::size_t l = 0; l < regions[i].size(); ++l) append(regions[i].loop(l), near);
        return near.empty() ? near : intersect(near, region);
    }

    static void append(const Loops& loops, Loops& to) {
        for (std::size_t i = 0; i < loops.size(); ++i) append(loops.loop(i), to);
    }

private:
    static void append(std::span<const Point2> loop, Loops& to) {
        to.points.insert(to.points.end(), loop.begin(), loop.end());
        to.close_loop();
    }
};

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
    const Loops stock = rectangle(plan.stock_min, plan.stock_max);
    parallel_each(context, joints.size(), [&](std::size_t i) {
        for (std::size_t k = 0; k < joints[i].size(); ++k) {
            JointWood& wood = joints[i][k];
            const bool whole = i == 0 || k > 0;  // the board, or a slab that is not cut yet
            if (whole) wood.below = stock;
            else wood.below = intersect(sections[2 * (i - 1)].loops, sections[2 * (i - 1) + 1].loops);
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

constexpr int kHalvings = 3;  // of the setback, at most

/// Glue held back from a region's edges by the setback, from those of ribs narrower than four times that by
/// its half, and so on.
Loops held_back(const Loops& region, double setback, int halvings) {
    Loops glue, left = region;
    for (int halved = 0; halved <= halvings && !left.empty(); ++halved, setback /= 2) {
        // A section has a point at every facet that it cuts, more than where glue goes needs. Thinned it may
        // be too wide by as much as it is thinned, and offset() errs towards the larger region by up to its
        // tolerance; that much more setback keeps the promised distance.
        const double fine = std::min(0.05, setback / 20);
        const Loops inside = offset(thinned(region, fine), -(setback + 2 * fine), fine);
        // Wide enough is where a disc of twice the setback finds room.
        const Loops wide = offset(offset(inside, -setback, fine), 2 * setback + 4 * fine, fine);
        Loops here = halved < halvings ? intersect(inside, wide) : inside;
        if (halved > 0) {
            // Corners that the discs do not sweep are no ribs; of them slivers are left, which opening with a
            // small disc takes away.
            here = intersect(here, left);
            here = intersect(here, offset(offset(here, -setback / 4, fine), setback / 4, fine));
        }
        glue = halved == 0 ? std::move(here) : unite(glue, here);
        left = subtract(left, wide);
    }
    return glue;
}

}  // namespace

Loops glue_within(const Loops& region, double setback_mm) {
    if (region.empty() || !(setback_mm > 0)) return region;
    const Pieces pieces(region);
    Pieces glued(held_back(region, setback_mm, kHalvings));
    Loops glue;
    for (std::size_t p = 0; p < pieces.size(); ++p) {
        const Loops& piece = pieces.regions[p];
        const double half = area(piece) / 2;
        Loops of_piece = glued.within(piece, pieces.boxes[p]);
        double setback = setback_mm / 2;
        for (int k = kHalvings - 1; k >= 0 && area(of_piece) < half; --k, setback /= 2)
            of_piece = held_back(piece, setback, k);
        Pieces::append(of_piece, glue);
    }
    nest(glue);
    return glue;
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

/// What stands of a layer piece by piece: every piece has to be held by glue of its own. Pieces smaller than
/// chips (kChip) are only remarked on.
void rate_pieces(const Layer& layer, const JointWood& wood, const Joint& joint, std::vector<WeakJoint>& weak,
                 std::vector<Diagnostic>& diagnostics) {
    const Pieces pieces(wood.above), contact(wood.both), glued(joint.glue);
    struct Worst {
        double area = 0;
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
        if (size > worst.area) worst.area = size, worst.piece = p;
    }
    const auto report = [&](const char* code, const char* what, const Worst& worst) {
        if (worst.count == 0) return;
        const Box2& box = pieces.boxes[worst.piece];
        weak.push_back({code,
                        fmt::format("{}: {} piece{} of the layer {}, the largest of {}",
                                    words_of(layer, wood), worst.count, worst.count == 1 ? "" : "s", what,
                                    size_of(pieces.regions[worst.piece], box)),
                        middle_of(box, wood.z), std::string(kOtherJoint) + ", fasten it with dowels"});
    };
    report("joint.floating", "with nothing under it", floating);
    report("joint.no_glue", "on wood too narrow for glue", bare);
    if (chips > 0)
        diagnostics.push_back({Severity::note, "joint.chips",
                               fmt::format("{}: {} piece{} of less than {} mm2 get no glue",
                                           words_of(layer, wood), chips, chips == 1 ? "" : "s", kChip),
                               middle_of(pieces.boxes[chip], wood.z)});
}

/// Glue, force and pressure of one joint.
struct PressedJoint {
    Joint joint;
    double off_middle = 0;  ///< mm, of the glue's centroid from the slab's middle
    double uneven = 0;      ///< the pressure at the most loaded edge over the mean, less 1
};

// The platen presses on the whole slab, so its resultant acts in the slab's middle, off the glue's centroid
// by (ex, ey). On a rigid slab the pressure in the joint is then linear: p = F/A · (1 + ex·x·A/Ix +
// ey·y·A/Iy). The allowed pressure holds at the most loaded edge, and where p would turn negative at the far
// edge (the resultant has left the joint's kern, for a rectangle its middle third) the joint gapes there.
PressedJoint pressed(double z, Loops glue, double middle_x, double middle_y, const Bonding& bonding) {
    PressedJoint p;
    const AreaMoments m = moments(glue);
    p.joint.z = z;
    p.joint.glue = std::move(glue);
    p.joint.area_mm2 = m.area;
    p.joint.centroid = {middle_x, middle_y};
    if (!(m.area > 0)) return p;
    p.joint.centroid = {m.x, m.y};
    const double ex = middle_x - m.x, ey = middle_y - m.y;
    p.off_middle = std::hypot(ex, ey);
    p.uneven = (m.ix > 0 ? std::fabs(ex) * m.reach_x * m.area / m.ix : 0) +
               (m.iy > 0 ? std::fabs(ey) * m.reach_y * m.area / m.iy : 0);
    p.joint.force_n = std::min(bonding.press_force, m.area * bonding.max_pressure_mpa / (1 + p.uneven));
    p.joint.pressure_mpa = p.joint.force_n / m.area;
    return p;
}

void rate_press(const Layer& layer, const JointWood& wood, const PressedJoint& p, const Plan& plan,
                std::vector<WeakJoint>& weak, std::vector<Diagnostic>& diagnostics) {
    const double x = (plan.stock_min[0] + plan.stock_max[0]) / 2,
                 y = (plan.stock_min[1] + plan.stock_max[1]) / 2;
    const Joint& joint = p.joint;
    const double overhang = outside_by(convex_hull(wood.below.points), x, y);
    if (overhang > 0)
        weak.push_back(
            {"joint.tips",
             fmt::format("{}: the slab's middle overhangs the {:.0f} mm2 that it lies on by {:.1f} "
                         "mm, so it tips under the press",
                         words_of(layer, wood), area(wood.below), overhang),
             {x, y, wood.z},
             std::string("carry the slab with a flask (flask.enabled), ") + kOtherJoint});
    if (joint.pressure_mpa < plan.job.bonding.min_pressure_mpa)
        weak.push_back(
            {"joint.pressure",
             fmt::format(
                 "{}: {:.0f} N on {:.0f} mm2 of glue press with {:.4f} MPa, less than the {} MPa that "
                 "close it; the glue lies {:.1f} mm off the slab's middle",
                 words_of(layer, wood), joint.force_n, joint.area_mm2, joint.pressure_mpa,
                 plan.job.bonding.min_pressure_mpa, p.off_middle),
             {joint.centroid[0], joint.centroid[1], wood.z},
             std::string("use a stronger press or a flask, ") + kOtherJoint});
    else if (p.uneven > 1 && overhang == 0)
        diagnostics.push_back(
            {Severity::warning, "joint.uneven_press",
             fmt::format("{}: the glue's centroid lies {:.1f} mm off the slab's middle, outside the part of "
                         "the joint where the press closes it everywhere; the press is held to {:.0f} N",
                         words_of(layer, wood), p.off_middle, joint.force_n),
             std::array<double, 3>{joint.centroid[0], joint.centroid[1], wood.z}});
}

}  // namespace

std::vector<WeakJoint> bond_layer(Layer& layer, std::span<const JointWood> wood, const Plan& plan,
                                  std::vector<Diagnostic>& diagnostics) {
    const Bonding& bonding = plan.job.bonding;
    const double middle_x = (plan.stock_min[0] + plan.stock_max[0]) / 2,
                 middle_y = (plan.stock_min[1] + plan.stock_max[1]) / 2;
    std::vector<WeakJoint> weak;
    layer.joints.clear();
    for (std::size_t k = 0; k < wood.size(); ++k) {
        // Between whole slabs glue goes everywhere, so that no piece of the waste above a joint comes loose.
        PressedJoint p =
            pressed(wood[k].z, k == 0 ? glue_within(wood[k].both, bonding.edge_setback) : wood[k].below,
                    middle_x, middle_y, bonding);
        p.joint.standing_mm2 = area(wood[k].both);
        // Every press goes through the joint under the layer.
        if (k > 0 && p.joint.area_mm2 > 0) {
            p.joint.force_n = std::min(p.joint.force_n, layer.joints.front().force_n);
            p.joint.pressure_mpa = p.joint.force_n / p.joint.area_mm2;
        }
        const std::size_t found = weak.size();
        rate_pieces(layer, wood[k], p.joint, weak, diagnostics);
        if (p.joint.area_mm2 > 0) rate_press(layer, wood[k], p, plan, weak, diagnostics);
        else if (weak.size() == found)
            weak.push_back({"joint.no_glue",
                            fmt::format("{}: nothing of the slab is glued", words_of(layer, wood[k])),
                            {middle_x, middle_y, wood[k].z},
                            kOtherJoint});
        layer.joints.push_back(std::move(p.joint));
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
        double worst = bears, worst_area = 0;
        std::size_t which = pieces.size(), count = 0;
        for (std::size_t p = 0; p < pieces.size(); ++p) {
            const Loops& piece = pieces.regions[p];
            const AreaMoments glue = moments(glued.within(piece, pieces.boxes[p]));
            if (!(glue.area > 0) || area(piece) < kChip) continue;  // said by bond_layer
            const SideLoad load = side_load(layer, height_of(wood[k], piece, layer.z_top - wood[k].z));
            const double lever =
                depth_in(convex_hull(contact.within(piece, pieces.boxes[p]).points), glue.x, glue.y);
            const double stress = std::max(lever > 0 ? load.bending_nmm / (glue.area * lever) : INFINITY,
                                           load.force_n / glue.area);
            if (stress <= bears) continue;
            ++count;
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
             std::string("fasten it with dowels, cut it with less force (smaller tools), ") + kOtherJoint});
    }
    return weak;
}

}  // namespace slabwright
