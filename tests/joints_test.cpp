// What holds the build together: wood on both sides wherever glue goes, pressure, and what cannot hold.
#include "engine/schedule/joints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/layers/layers.h"
#include "engine/planner/planner.h"
#include "engine/schedule/fit.h"
#include "engine/schedule/footing.h"
#include "engine/schedule/schedule.h"
#include "engine/schedule/supports.h"
#include "io/read/pattern_mesh.h"
#include "io/write/sequence_json.h"
#include "kernels/errors.h"
#include "kernels/features/section_areas.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/places.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;

namespace {

void add_rectangle(Loops& loops, double x0, double y0, double x1, double y1, bool hole = false) {
    std::vector<Point2> points{{to_units(x0), to_units(y0)},
                               {to_units(x1), to_units(y0)},
                               {to_units(x1), to_units(y1)},
                               {to_units(x0), to_units(y1)}};
    if (hole) std::reverse(points.begin(), points.end());
    loops.points.insert(loops.points.end(), points.begin(), points.end());
    loops.close_loop();
}

Plan plan_of_one_layer() {
    Plan plan;
    plan.stock_min = {0, 0};
    plan.stock_max = {200, 100};
    Layer layer;
    layer.index = 1;
    layer.z_top = 18;
    layer.slab_thickness = 19;
    plan.layers = {layer};
    return plan;
}

// Wood that stands the same above and below.
std::vector<JointWood> wood_of(const Loops& region, double z = 0) {
    JointWood wood;
    wood.z = z;
    wood.below = wood.above = wood.both = region;
    for (Loops& higher : wood.higher) higher = region;
    return {wood};
}

struct Bonded {
    std::vector<WeakJoint> weak;
    std::vector<Diagnostic> notes;
    [[nodiscard]] bool has(const std::string& code) const {
        return std::any_of(weak.begin(), weak.end(), [&](const WeakJoint& w) { return w.code == code; });
    }
};

Bonded bond(Plan& plan, const Loops& region) {
    Bonded bonded;
    bonded.weak = bond_layer(plan.layers[0], wood_of(region), plan, bonded.notes);
    return bonded;
}

// ------------------------------------------------------------------------- an independent look at the wood

// Where a vertical line enters (+1) and leaves (−1) facets, upwards.
using Column = std::vector<std::pair<double, int>>;

struct Columns {
    double x0 = 0, y0 = 0, cell = 1;
    int nx = 0, ny = 0;
    std::vector<Column> at;

    Columns(MeshView mesh, double cell_mm) : cell(cell_mm) {
        const Box3 box = bounds(mesh);
        x0 = box.min.x + 0.37 * cell;
        y0 = box.min.y + 0.41 * cell;
        nx = static_cast<int>((box.max.x - x0) / cell) + 1;
        ny = static_cast<int>((box.max.y - y0) / cell) + 1;
        at.resize(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny));
        for (const Index3& f : mesh.facets) {
            std::array<std::array<double, 3>, 3> p;
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3f& v = mesh.vertices[f[k]];
                p[k] = {v.x, v.y, v.z};
            }
            const double turn =
                (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
            if (turn == 0) continue;
            const auto [lx, hx] = std::minmax({p[0][0], p[1][0], p[2][0]});
            const auto [ly, hy] = std::minmax({p[0][1], p[1][1], p[2][1]});
            for (int i = std::max(0, static_cast<int>((lx - x0) / cell)); i < nx && x(i) <= hx; ++i)
                for (int j = std::max(0, static_cast<int>((ly - y0) / cell)); j < ny && y(j) <= hy; ++j) {
                    std::array<double, 3> w;
                    for (std::size_t k = 0; k < 3; ++k) {
                        const auto &a = p[(k + 1) % 3], &b = p[(k + 2) % 3];
                        w[k] = ((b[0] - a[0]) * (y(j) - a[1]) - (b[1] - a[1]) * (x(i) - a[0])) / turn;
                    }
                    if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
                    at[index(i, j)].emplace_back(w[0] * p[0][2] + w[1] * p[1][2] + w[2] * p[2][2],
                                                 turn < 0 ? 1 : -1);
                }
        }
        for (Column& c : at) std::sort(c.begin(), c.end());
    }
    [[nodiscard]] std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
    }
    [[nodiscard]] double x(int i) const { return x0 + i * cell; }
    [[nodiscard]] double y(int j) const { return y0 + j * cell; }
    // Whether wood lies anywhere between two heights.
    [[nodiscard]] static bool wood(const Column& c, double low, double high) {
        int winding = 0;
        double z = -1e9;
        for (const auto& [at, sign] : c) {
            if (winding != 0 && at > low && z < high) return true;
            winding += sign;
            z = at;
        }
        return false;
    }
    // Whether a surface lies between two heights.
    [[nodiscard]] static bool borders(const Column& c, double low, double high) {
        return std::any_of(c.begin(), c.end(),
                           [&](const auto& at) { return at.first > low && at.first < high; });
    }
};

// Layers without their programs.
Plan layers_of(Context& context, MeshView mesh, Job job, bool bonded_slabs = false) {
    Plan plan;
    job.allow_undercut = true;
    plan.job = job;
    const Box3 box = bounds(mesh);
    place_stock(plan, box);
    LayerRequest request;
    request.height = box.max.z;
    request.max_layer = max_layer_thickness(job);
    request.min_layer = job.layers.min_layer;
    request.min_material = job.material.min_thickness;
    request.slab_thicknesses = job.slabs.thicknesses;
    request.facing_allowance = job.slabs.facing_allowance;
    request.filled_underside = job.tolerances.undercut;
    request.features = find_features(context, mesh, feature_options(job)).features;
    request.section_area = SectionAreas(context, mesh);
    // Of two slabs each, whatever that breaks, or as they are planned.
    std::vector<Boundary> boundaries;
    if (bonded_slabs)
        for (double z = 0; z < request.height;)
            boundaries.push_back({z = std::min(z + 37.5, request.height), 38, ""});
    else boundaries = place_layers_optimal(request).boundaries;
    double bottom = 0;
    for (const Boundary& b : boundaries) {
        Layer& layer = plan.layers.emplace_back();
        layer.index = static_cast<int>(plan.layers.size());
        layer.z_bottom = bottom;
        layer.z_top = bottom = b.z;
        layer.slab_thickness = b.slab_thickness;
        layer.slabs = static_cast<int>(std::lround(b.slab_thickness / job.slabs.thicknesses.back()));
    }
    return plan;
}

std::vector<std::vector<JointWood>> bond_all(Context& context, MeshView mesh, Plan& plan) {
    std::vector<std::vector<JointWood>> wood = wood_at_joints(context, mesh, plan);
    std::vector<Diagnostic> notes;
    for (std::size_t i = 0; i < plan.layers.size(); ++i)
        (void)bond_layer(plan.layers[i], wood[i], plan, notes);
    return wood;
}

// Every joint on a grid: wood within .06 mm below it, and above it up to the layer's top, for what lies under
// an overhang stays filled. Where surfaces come within .2 mm of the joint without lying in it, the joint may
// hold less than the grid sees, never more.
void expect_wood_at_joints(Context& context, MeshView mesh, Plan plan) {
    (void)bond_all(context, mesh, plan);
    const Box3 box = bounds(mesh);
    const Columns columns(mesh, std::max(box.max.x - box.min.x, box.max.y - box.min.y) / 400);
    for (const Layer& layer : plan.layers)
        for (std::size_t k = 0; k < layer.joints.size(); ++k) {
            const Joint& joint = layer.joints[k];
            SCOPED_TRACE("layer " + std::to_string(layer.index) + " joint at " + std::to_string(joint.z));
            const double beside = std::min(0.06, (layer.z_top - layer.z_bottom) / 4);
            if (joint.z > layer.z_top - 0.2) continue;
            std::size_t both = 0, glued = 0, bare = 0, either = 0, warped = 0;
            const auto beside_it = [&](const Column& c) {
                return Columns::borders(c, joint.z - 0.2, joint.z - 0.005) ||
                       Columns::borders(c, joint.z + 0.005, joint.z + 0.2);
            };
            std::vector<double> rows;
            for (int j = 0; j < columns.ny; ++j) rows.push_back(columns.y(j) * kUnitsPerMm);
            const auto spans = line_spans(joint.glue, rows);
            for (int j = 0; j < columns.ny; ++j)
                for (int i = 0; i < columns.nx; ++i) {
                    const Column& c = columns.at[columns.index(i, j)];
                    const bool board = layer.index == 1 || k > 0;
                    const bool above = Columns::wood(c, joint.z + beside, layer.z_top - 0.001),
                               below = board || Columns::wood(c, joint.z - 0.06, joint.z - 0.001);
                    both += above && below ? 1 : 0;
                    warped += above && below && beside_it(c) ? 1 : 0;
                    either += above || (below && !board) ? 1 : 0;
                    const double x = columns.x(i) * kUnitsPerMm;
                    const auto& row = spans[static_cast<std::size_t>(j)];
                    if (std::none_of(row.begin(), row.end(),
                                     [&](const Span& s) { return s.low <= x && x <= s.high; }))
                        continue;
                    ++glued;
                    bare += above && below ? 0 : 1;
                }
            const double mm2 = columns.cell * columns.cell;
            if (k == 0) {
                EXPECT_LE(static_cast<double>(bare), 0.02 * static_cast<double>(glued) + 2);
            }
            // A grid is as wrong as its cells along the border: a twentieth of a small region's.
            const double off =
                0.02 * joint.standing_mm2 + 0.01 * static_cast<double>(either) * mm2 + 20 * mm2;
            EXPECT_LE(joint.standing_mm2, static_cast<double>(both) * mm2 + off);
            EXPECT_GE(joint.standing_mm2, static_cast<double>(both - warped) * mm2 - off);
            if (joint.area_mm2 > 0) {
                EXPECT_NEAR(joint.pressure_mpa, joint.force_n / joint.area_mm2, 1e-9);
            }
            EXPECT_LE(joint.pressure_mpa, plan.job.bonding.max_pressure_mpa * (1 + 1e-9));
            EXPECT_LE(joint.force_n, plan.job.bonding.press_force);
            if (k == 0) {
                EXPECT_LE(joint.area_mm2, joint.standing_mm2 * 1.001);
            }
        }
}

Mesh stepped(Context& context, float bump = 0) {
    shapes::Facets facets = shapes::box({0, 0, 0}, {120, 80, 15});
    shapes::append(facets, shapes::box({10, 10, 15}, {110, 70, 40}));
    for (auto& facet : facets)
        for (Vec3f& v : facet)
            if (v.z == 0 && (v.x > 60) == (v.y > 40)) v.z = bump;
    return weld(context, facets);
}

}  // namespace

TEST(Bonding, GlueKeepsItsSetbackAndPressItsPressure) {
    Plan plan = plan_of_one_layer();
    Loops below;
    add_rectangle(below, 20, 10, 180, 90);
    Bonded bonded = bond(plan, below);
    EXPECT_NEAR(plan.layers[0].joints[0].area_mm2, (160 - 6.2) * (80 - 6.2), 1);
    EXPECT_NEAR(plan.layers[0].joints[0].centroid[0], 100, 1e-3);
    EXPECT_NEAR(plan.layers[0].joints[0].centroid[1], 50, 1e-3);
    EXPECT_NEAR(plan.layers[0].joints[0].force_n, std::min(17000.0, 0.5 * plan.layers[0].joints[0].area_mm2),
                10);
    EXPECT_TRUE(bonded.weak.empty()) << bonded.weak[0].message;
    EXPECT_TRUE(bonded.notes.empty());
    for (const Point2 p : plan.layers[0].joints[0].glue.points) {
        EXPECT_GE(to_mm(p.x), 23 - 1e-4);
        EXPECT_LE(to_mm(p.x), 177 + 1e-4);
    }
    plan.stock_max = {2000, 1000};  // a joint so large that the press itself is the limit
    Loops wide;
    add_rectangle(wide, 0, 0, 2000, 1000);
    bonded = bond(plan, wide);
    EXPECT_EQ(plan.layers[0].joints[0].force_n, 17000);
}

// An outline as a section of many facets has it: the glue keeps its distance from it everywhere, with far
// fewer points.
TEST(Bonding, GlueOfAnOutlineOfManyPointsKeepsItsSetback) {
    constexpr int points = 40000;
    Plan plan = plan_of_one_layer();
    Loops below;
    for (int k = 0; k < points; ++k) {
        const double a = 2 * std::numbers::pi * k / points,
                     r = 60 + 8 * std::sin(7 * a) + 0.02 * std::sin(900 * a);
        below.points.push_back({to_units(100 + r * std::cos(a)), to_units(80 + r * std::sin(a))});
    }
    below.close_loop();
    Bonded bonded = bond(plan, below);
    const Loops& glue = plan.layers[0].joints[0].glue;
    ASSERT_EQ(glue.size(), 1U);
    EXPECT_LT(glue.points.size(), 2000U);
    const double setback = plan.job.bonding.edge_setback;
    double farthest = 0;
    for (std::size_t k = 0; k < glue.points.size(); ++k) {
        const Point2 a = glue.points[k], b = glue.points[(k + 1) % glue.points.size()];
        const double dx = to_mm(b.x - a.x), dy = to_mm(b.y - a.y), l2 = dx * dx + dy * dy;
        double nearest = 1e300;
        for (const Point2 p : below.points) {
            const double x = to_mm(p.x - a.x), y = to_mm(p.y - a.y),
                         t = std::clamp((x * dx + y * dy) / l2, 0.0, 1.0);
            nearest = std::min(nearest, std::hypot(x - t * dx, y - t * dy));
        }
        ASSERT_GE(nearest, setback - 1e-3) << "at " << to_mm(a.x) << ' ' << to_mm(a.y);
        farthest = std::max(farthest, nearest);
    }
    EXPECT_LE(farthest, setback + 0.25) << "and no farther from it than that";
}

// Statics of a joint against sums over a grid of small squares, for frames with a hole, turned in the plane.
TEST(Footings, PullAndTurningAgreeWithBruteForce) {
    const unsigned seed = 20260;
    std::mt19937 random(seed);
    RecordProperty("seed", static_cast<int>(seed));
    std::printf("seed %u\n", seed);
    for (int round = 0; round < 20; ++round) {
        const auto pick = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        const double turn = pick(0, 2 * std::numbers::pi), c = std::cos(turn), s = std::sin(turn);
        const double w = pick(20, 80), h = pick(10, 60), hole = pick(0.1, 0.4);
        const auto place = [&](double x, double y) {
            return std::array<double, 2>{300 + c * x - s * y, 100 + s * x + c * y};
        };
        // [0, w] x [0, h] less a hole of that share in its first corner's half.
        const double hx0 = 0.1 * w, hx1 = (0.1 + hole) * w, hy0 = 0.2 * h, hy1 = (0.2 + hole) * h;
        Loops glue;
        const auto add = [&](double x0, double y0, double x1, double y1, bool inner) {
            std::vector<std::array<double, 2>> at{place(x0, y0), place(x1, y0), place(x1, y1), place(x0, y1)};
            if (inner) std::reverse(at.begin(), at.end());
            for (const auto& p : at) glue.points.push_back({to_units(p[0]), to_units(p[1])});
            glue.close_loop();
        };
        add(0, 0, w, h, false);
        add(hx0, hy0, hx1, hy1, true);
        const Footing footing(glue, glue);

        // Forces, in the frame's own directions.
        const double wx = pick(-100, 100), wy = pick(-100, 100), n = pick(1, 200), push = pick(0, 20);
        const double side = pick(0, 1500);
        const auto at = place(wx, wy);
        std::vector<std::array<double, 2>> ends{{-90, -70}, {120, -50}, {100, 90}};
        std::vector<std::array<double, 2>> corners;
        for (const auto& e : ends) corners.push_back(place(e[0], e[1]));
        const FootingLoad load{{{n, at[0], at[1]}}, push, corners, side};

        double a = 0, sx = 0, sy = 0, xx = 0, yy = 0, xy = 0;
        constexpr int cells = 600;
        const double dx = w / cells, dy = h / cells;
        for (int i = 0; i < cells; ++i)
            for (int j = 0; j < cells; ++j) {
                const double x = (i + 0.5) * dx, y = (j + 0.5) * dy;
                if (x > hx0 && x < hx1 && y > hy0 && y < hy1) continue;
                a += 1, sx += x, sy += y, xx += x * x, yy += y * y, xy += x * y;
            }
        const double cx = sx / a, cy = sy / a, cell = dx * dy;
        const double ixx = (xx - a * cx * cx) * cell, iyy = (yy - a * cy * cy) * cell,
                     ixy = (xy - a * cx * cy) * cell, mm2 = a * cell;
        EXPECT_NEAR(footing.glue().area, mm2, 0.01 * mm2);
        const double det = ixx * iyy - ixy * ixy;
        double pull = 0;
        for (const auto& p : {std::array{0.0, 0.0}, {w, 0.0}, {w, h}, {0.0, h}}) {
            const auto stress = [&](double mx, double my) {
                return ((iyy * mx - ixy * my) * (p[0] - cx) + (ixx * my - ixy * mx) * (p[1] - cy)) / det;
            };
            double from_push = 0, from_side = 0;
            for (const auto& e : ends)
                from_push = std::max(from_push,
                                     std::abs(push / mm2 + stress(push * (e[0] - cx), push * (e[1] - cy))));
            for (int k = 0; k < 360; ++k)
                from_side = std::max(from_side, stress(side * std::cos(k * 0.01745329252),
                                                       side * std::sin(k * 0.01745329252)));
            pull = std::max(pull, from_push + from_side - n / mm2 - stress(n * (wx - cx), n * (wy - cy)));
        }
        EXPECT_NEAR(footing.pull_mpa(load), pull, 0.02 * pull + 1e-3);

        // Turning over each edge of the rectangle.
        const double bears = 0.5;
        double turning = 0;
        const auto over = [&](double nx, double ny, double offset) {
            const auto beyond = [&](double x, double y) { return nx * x + ny * y - offset; };
            double turns = side + n * beyond(wx, wy), far = 0;
            for (const auto& e : ends) far = std::max(far, std::abs(beyond(e[0], e[1])));
            turning = std::max(turning, (turns + push * far) / (bears * mm2 * -beyond(cx, cy)));
        };
        over(-1, 0, 0);
        over(1, 0, w);
        over(0, -1, 0);
        over(0, 1, h);
        EXPECT_NEAR(footing.turning(load, bears), turning, 0.02 * turning + 1e-3);
        const double out = std::hypot(std::max({-wx, wx - w, 0.0}), std::max({-wy, wy - h, 0.0}));
        EXPECT_NEAR(footing.outside_by(at[0], at[1]), out, 1e-3);
    }
}

TEST(Footings, NoGlueBearsNothing) {
    const Footing none(Loops{}, Loops{});
    EXPECT_EQ(none.pull_mpa({}), INFINITY);
    EXPECT_EQ(none.turning({}, 0.5), INFINITY);
}

// Table and platen stay parallel: glue in a corner is pressed evenly, only the screws there limit the force.
TEST(Bonding, AJointInTheCornerIsPressedEvenly) {
    Plan plan = plan_of_one_layer();
    Loops below;
    add_rectangle(below, 10, 10, 40, 40);
    Bonded bonded = bond(plan, below);
    EXPECT_TRUE(bonded.weak.empty());
    EXPECT_NEAR(plan.layers[0].joints[0].pressure_mpa, 0.5, 1e-9);
    plan.stock_min = {-500, -500};
    plan.stock_max = {700, 600};
    plan.job.bonding.max_pressure_mpa = 1e3;
    (void)bond(plan, below);
    EXPECT_NEAR(plan.layers[0].joints[0].force_n, 17000 / ((1 + 75 / 610.0) * (1 + 25 / 610.0)), 1);
}

// Layers one on the other, each keeping one region; the lowest on the board.
struct Stack {
    Plan plan = plan_of_one_layer();
    std::vector<std::vector<JointWood>> wood;
    std::vector<Diagnostic> notes;
    std::vector<std::vector<WeakJoint>> weak;

    Stack(std::initializer_list<Loops> regions, double size = 200) {
        plan.stock_max = {size, size};
        plan.layers.clear();
        Loops under;
        for (const Loops& region : regions) {
            Layer& layer = plan.layers.emplace_back();
            layer.index = static_cast<int>(plan.layers.size());
            layer.z_bottom = 18.0 * (layer.index - 1);
            layer.z_top = 18.0 * layer.index;
            layer.slab_thickness = 19;
            std::vector<JointWood> own = wood_of(region, layer.z_bottom);
            if (layer.index == 1) {
                own[0].below = {};
                add_rectangle(own[0].below, 0, 0, size, size);
            } else {
                own[0].below = under;
                own[0].both = intersect(under, region);
            }
            under = region;
            wood.push_back(own);
        }
        for (std::size_t i = 0; i < plan.layers.size(); ++i)
            (void)bond_layer(plan.layers[i], wood[i], plan, notes);
        weak = slabs_that_tip(plan, wood, notes);
    }
    [[nodiscard]] const Diagnostic* note(const std::string& code) const {
        for (const Diagnostic& d : notes)
            if (d.code == code) return &d;
        return nullptr;
    }
    [[nodiscard]] std::size_t refused() const {
        std::size_t count = 0;
        for (const auto& of_layer : weak) count += of_layer.size();
        return count;
    }
};

Loops square(double x, double y, double side) {
    Loops loops;
    add_rectangle(loops, x, y, x + side, y + side);
    return loops;
}

// What overhangs by a little over much glue is held; a plate on a pin is not.
TEST(Footings, AnOverhangIsWeighedAgainstTheGlue) {
    const Loops wide = square(20, 20, 150), foot = square(20, 20, 70);
    // The slab's middle (100, 100) lies 14 mm outside the foot.
    const Stack held({wide, foot, foot});
    EXPECT_EQ(held.refused(), 0u);
    const Diagnostic* note = held.note("joint.overhang");
    ASSERT_NE(note, nullptr);
    EXPECT_EQ(note->severity, Severity::note) << note->message;
    EXPECT_NE(note->message.find("overhangs the wood under it by 14.1 mm"), std::string::npos)
        << note->message;

    const Stack on_pin({square(20, 20, 10), wide, wide, wide, wide});
    ASSERT_EQ(on_pin.weak[0].size(), 1u);
    EXPECT_EQ(on_pin.weak[0][0].code, "joint.tips");
    EXPECT_TRUE(on_pin.weak[0][0].refused);
    EXPECT_NE(on_pin.weak[0][0].message.find("while layer 5 is cut"), std::string::npos)
        << on_pin.weak[0][0].message;
    EXPECT_EQ(on_pin.weak[1].size(), 1u) << "the joint on the pin carries the same";
    EXPECT_TRUE(on_pin.weak[2].empty());
}

// The board is sacrificial: the first slab is glued all over it where the pattern's foot would not hold it.
TEST(Footings, TheFirstSlabIsGluedAllOverTheBoardWhereItsFootIsSmall) {
    const Stack small({square(90, 90, 12)});
    EXPECT_NE(small.note("joint.board"), nullptr);
    EXPECT_EQ(small.refused(), 0U);
    EXPECT_EQ(small.note("joint.overhang"), nullptr) << "glued so, it holds";
    EXPECT_NEAR(small.plan.layers[0].joints[0].area_mm2, 200 * 200, 1);
    EXPECT_NEAR(small.plan.layers[0].joints[0].standing_mm2, 12 * 12, 0.1);
    const Stack large({square(50, 50, 100)});
    EXPECT_EQ(large.note("joint.board"), nullptr);
    EXPECT_LT(large.plan.layers[0].joints[0].area_mm2, 100 * 100);
}

// A boss at the edge of a wide plate: a piece of a slab is laid on it, not a slab of 14 kg.
TEST(Footings, APieceOfASlabIsLaidWhereAWholeOneWouldBreakOff) {
    const Stack boss({square(20, 20, 900), square(60, 60, 30)}, 1000);
    EXPECT_EQ(boss.refused(), 0u);
    const Diagnostic* note = boss.note("joint.small_slab");
    ASSERT_NE(note, nullptr);
    EXPECT_NE(note->message.find("layer 2: lay a piece of 60 x 60 mm, 45 mm in x and 45 mm in y from"),
              std::string::npos)
        << note->message;
}

// A rib narrower than the setback allows is glued in its middle; one too thin for any glue is refused.
TEST(Bonding, ThinRibsGetGlueInTheirMiddle) {
    for (const double width : {14.0, 10.0, 7.4, 6.0, 4.0, 2.0, 1.2}) {
        SCOPED_TRACE(width);
        Plan plan = plan_of_one_layer();
        Loops rib;
        add_rectangle(rib, 50, 50 - width / 2, 150, 50 + width / 2);
        const Bonded bonded = bond(plan, rib);
        EXPECT_TRUE(bonded.weak.empty()) << bonded.weak[0].message;
        const Joint& joint = plan.layers[0].joints[0];
        EXPECT_GT(joint.area_mm2, 100 * width * (width < 2 ? 0.2 : 0.4));
        for (const Point2 p : joint.glue.points) {
            EXPECT_LE(std::abs(to_mm(p.y) - 50), width / 2 - 0.3);
        }
    }
    // A rib that grows out of a block, too.
    Plan plan = plan_of_one_layer();
    Loops block;
    add_rectangle(block, 20, 10, 120, 90);
    Loops rib;
    add_rectangle(rib, 100, 48, 180, 52);
    (void)bond(plan, unite(block, rib));
    Loops tip;
    add_rectangle(tip, 130, 45, 185, 55);
    EXPECT_GT(area(intersect(plan.layers[0].joints[0].glue, tip)), 48 * 1.0);

    plan = plan_of_one_layer();
    Loops thin;
    add_rectangle(thin, 50, 49.8, 150, 50.2);
    const Bonded bonded = bond(plan, thin);
    ASSERT_TRUE(bonded.has("joint.no_glue"));
    EXPECT_NE(bonded.weak[0].message.find("40 mm2, 100.0 x 0.4 mm"), std::string::npos)
        << bonded.weak[0].message;
    EXPECT_EQ(plan.layers[0].joints[0].force_n, 0);
    EXPECT_TRUE(bond(plan, Loops{}).has("joint.no_glue"));
}

TEST(Bonding, APieceWithNothingUnderItIsRefusedWithItsPlace) {
    Plan plan = plan_of_one_layer();
    Loops carried, both;
    add_rectangle(carried, 60, 20, 140, 80);
    both = carried;
    add_rectangle(both, 10, 40, 30, 60);
    std::vector<JointWood> wood = wood_of(carried, 18);
    wood[0].above = both;
    std::vector<Diagnostic> notes;
    std::vector<WeakJoint> weak = bond_layer(plan.layers[0], wood, plan, notes);
    ASSERT_EQ(weak.size(), 1u);
    EXPECT_EQ(weak[0].code, "joint.floating");
    EXPECT_NEAR(weak[0].where[0], 20, 1e-3);
    EXPECT_NEAR(weak[0].where[1], 50, 1e-3);
    EXPECT_EQ(weak[0].where[2], 18);
    // What is as small as a chip is told, not refused.
    both = carried;
    add_rectangle(both, 10, 40, 14, 44);
    wood[0].above = both;
    weak = bond_layer(plan.layers[0], wood, plan, notes);
    EXPECT_TRUE(weak.empty());
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_EQ(notes[0].code, "joint.chips");
}

TEST(Bonding, APostBreaksUnderTheCutterWhereItIsHigh) {
    Plan plan = plan_of_one_layer();
    Loops region;
    add_rectangle(region, 60, 20, 140, 80);
    add_rectangle(region, 20, 45, 28, 53);
    std::vector<JointWood> wood = wood_of(region);
    std::vector<Diagnostic> notes;
    ASSERT_TRUE(bond_layer(plan.layers[0], wood, plan, notes).empty());
    Operation finish;
    finish.kind = OperationKind::finish;
    finish.peak_force_n = 12;
    plan.layers[0].operations = {finish};
    std::vector<WeakJoint> weak = joints_under_load(plan.layers[0], wood, plan);
    ASSERT_EQ(weak.size(), 1u);
    EXPECT_EQ(weak[0].code, "joint.weak");
    EXPECT_NEAR(weak[0].where[0], 24, 1e-3);
    // By hand: the post turns over an edge 4 mm from its middle.
    Loops post;
    add_rectangle(post, 19, 44, 29, 54);
    const double glue = area(intersect(plan.layers[0].joints[0].glue, post)), stress = 12 * 18 / (glue * 4);
    EXPECT_NE(weak[0].message.find(fmt::format("{:.2f} MPa", stress)), std::string::npos)
        << weak[0].message << stress;
    // A quarter as high it holds.
    for (Loops& higher : wood[0].higher) {
        higher = {};
        add_rectangle(higher, 60, 20, 140, 80);
    }
    EXPECT_TRUE(joints_under_load(plan.layers[0], wood, plan).empty());
    // Roughing bends it over its last step only.
    wood = wood_of(region);
    plan.layers[0].operations[0].kind = OperationKind::rough;
    plan.layers[0].operations[0].stepdown = 3;
    EXPECT_TRUE(joints_under_load(plan.layers[0], wood, plan).empty());
}

TEST(Bonding, TooLittlePressureIsRefused) {
    Plan plan = plan_of_one_layer();
    Loops region;
    add_rectangle(region, 20, 10, 180, 90);
    plan.job.bonding.press_force = 100;
    Bonded bonded = bond(plan, region);
    ASSERT_TRUE(bonded.has("joint.pressure"));
    EXPECT_NE(bonded.weak[0].message.find("100 N"), std::string::npos) << bonded.weak[0].message;
    plan.job.bonding.min_pressure_mpa = 0.005;
    EXPECT_TRUE(bond(plan, region).weak.empty());
}

TEST(Joints, OwnModelsHaveWoodWhereverGlueGoes) {
    for (const char* name : {"pump-cover", "half-sphere", "luo-tool-sample", "luo-layer-sample"}) {
        SCOPED_TRACE(name);
        Context context;
        const Mesh mesh = read_mesh(context, support::checkout("tests/data/") + name + ".stl");
        for (const bool bonded : {false, true}) {
            const Plan plan = layers_of(context, mesh.view(), {}, bonded);
            expect_wood_at_joints(context, mesh.view(), plan);
        }
    }
}

// Every casting, relief and mesh of the pool, with slabs that are bonded into layers and without.
TEST(Joints, MeshesOfOthersHaveWoodWhereverGlueGoes) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr || *corpus == '\0') {
        std::printf("skipped: SLABWRIGHT_CORPUS is not set\n");
        return;
    }
    // A terrain of 2.6 m and a broken mesh are no patterns.
    const auto no_pattern = [](const std::string& name) {
        return name == "gmsh_terrain_open_2649m" || name == "mount_rushmore_broken";
    };
    std::vector<std::string> names;
    for (const std::string folder : {"castings", "relief", "pool"})
        for (const auto& file : std::filesystem::directory_iterator(std::string(corpus) + "/" + folder))
            if (file.path().extension() == ".stl" && !no_pattern(file.path().stem().string()))
                names.push_back(folder + "/" + file.path().stem().string());
    std::sort(names.begin(), names.end());
    std::size_t layers = 0;
    for (const std::string& name : names) {
        SCOPED_TRACE(name);
        const std::string path = std::string(corpus) + "/" + name + ".stl";
        ASSERT_TRUE(std::filesystem::exists(path)) << path;
        Context context;
        ReadingOptions options;
        options.repair = Repair::mend;
        const Mesh mesh = read_pattern_mesh(context, path, options).mesh;
        for (const bool bonded : {false, true}) {
            const Plan plan = layers_of(context, mesh.view(), {}, bonded);
            expect_wood_at_joints(context, mesh.view(), plan);
            layers += plan.layers.size();
        }
    }
    std::printf("%zu meshes, %zu layers\n", names.size(), layers);
    EXPECT_GE(names.size(), 50U);
}

// Bodies stacked on one another, whose faces lie as near the joint as rounding, or a careless export, leaves
// them: glue where the two lie on each other, whichever is higher.
TEST(Joints, RoofsNearTheJointBelongToIt) {
    std::mt19937 random(test::seed());
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto near = [&] { return (uniform(0, 1) < 0.5 ? -1 : 1) * std::pow(10, uniform(-6, -3)); };
    for (int round = 0; round < 60; ++round) {
        SCOPED_TRACE(round);
        const double joint = 18;
        const auto box = [&](double x, double y, double low, double high) {
            return shapes::box(
                {static_cast<float>(x), static_cast<float>(y), static_cast<float>(low)},
                {static_cast<float>(x + 60), static_cast<float>(y + 50), static_cast<float>(high)});
        };
        const double dx = uniform(-40, 40), dy = uniform(-30, 30);
        shapes::Facets facets = box(0, 0, 0, joint + near());
        shapes::append(facets, box(dx, dy, joint + near(), 30));
        Context context;
        const Mesh mesh = weld(context, facets);
        Plan plan;
        place_stock(plan, bounds(mesh.view()));
        Layer low, high;
        low.index = 1, low.z_top = high.z_bottom = joint + (round % 3 == 0 ? near() : 0);
        high.index = 2, high.z_top = 30;
        low.slab_thickness = high.slab_thickness = 19;
        plan.layers = {low, high};
        const auto wood = bond_all(context, mesh.view(), plan);
        const double overlap = (60 - std::abs(dx)) * (50 - std::abs(dy));
        EXPECT_NEAR(plan.layers[1].joints[0].standing_mm2, overlap, 0.1);
        EXPECT_NEAR(area(wood[1][0].above), 60 * 50, 0.1);
        EXPECT_NEAR(area(wood[1][0].below), 60 * 50, 0.1);
        EXPECT_NEAR(plan.layers[0].joints[0].standing_mm2, 60 * 50, 0.1);
    }
}

// What lies under an overhang stays filled, and is wood that glue may hold.
TEST(Joints, FilledUndercutsAreWoodAboveAJoint) {
    shapes::Facets facets = shapes::box({0, 0, 0}, {100, 60, 18});
    shapes::append(facets, shapes::box({40, 20, 18}, {60, 40, 24}));
    shapes::append(facets, shapes::box({20, 10, 24}, {80, 50, 30}));
    Context context;
    const Mesh mesh = weld(context, facets);
    Plan plan;
    place_stock(plan, bounds(mesh.view()));
    Layer low, high;
    low.index = 1, low.z_top = high.z_bottom = 18;
    high.index = 2, high.z_top = 30;
    low.slab_thickness = high.slab_thickness = 19;
    plan.layers = {low, high};
    (void)bond_all(context, mesh.view(), plan);
    EXPECT_NEAR(plan.layers[1].joints[0].standing_mm2, 60 * 40, 0.1);
}

TEST(Joints, ABaseFlatToTheLastDigitsIsTheBase) {
    Context context;
    const Mesh flat = stepped(context);
    Plan even = layers_of(context, flat.view(), {});
    (void)bond_all(context, flat.view(), even);
    EXPECT_NEAR(even.layers[0].joints[0].standing_mm2, 120 * 80, 0.1);
    std::mt19937 random(test::seed());
    for (int round = 0; round < 20; ++round) {
        SCOPED_TRACE(round);
        Mesh mesh = flat;
        if (round < 10) {  // one corner up
            std::uniform_real_distribution<float> shake(0, 2e-7F);
            for (Vec3f& v : mesh.vertices)
                if (v.z == 0) v.z = shake(random);
        } else {  // turned away and back in single precision
            const float a = std::uniform_real_distribution<float>(0.1F, 3)(random);
            const float c = std::cos(a), s = std::sin(a);
            float lowest = 1e9F;
            for (Vec3f& v : mesh.vertices) {
                const float y = c * v.y - s * v.z, z = s * v.y + c * v.z;
                v.y = c * y + s * z;
                v.z = -s * y + c * z;
                lowest = std::min(lowest, v.z);
            }
            for (Vec3f& v : mesh.vertices) v.z -= lowest;
        }
        Plan plan = layers_of(context, mesh.view(), {});
        (void)bond_all(context, mesh.view(), plan);
        ASSERT_EQ(plan.layers.size(), even.layers.size());
        for (std::size_t i = 0; i < plan.layers.size(); ++i) {
            const Joint &got = plan.layers[i].joints[0], &want = even.layers[i].joints[0];
            EXPECT_NEAR(got.z, want.z, 1e-3);
            EXPECT_NEAR(got.area_mm2, want.area_mm2, 1e-3 * want.area_mm2);
            EXPECT_NEAR(got.force_n, want.force_n, 1e-3 * want.force_n);
        }
    }
}

// A body that stands a few micrometres higher than another on the same board stands on the board, too.
TEST(Joints, ABodyHardlyAboveTheBaseStandsOnTheBoard) {
    for (const float gap : {1e-6F, 1e-4F, 2e-3F, 9e-3F}) {
        SCOPED_TRACE(gap);
        shapes::Facets facets = shapes::box({0, 0, 0}, {40, 40, 30});
        shapes::append(facets, shapes::box({60, 0, gap}, {100, 40, 30}));
        Context context;
        const Mesh mesh = weld(context, facets);
        Plan plan = layers_of(context, mesh.view(), {});
        EXPECT_EQ(plan.layers.size(), 2u);
        (void)bond_all(context, mesh.view(), plan);
        EXPECT_NEAR(plan.layers[0].joints[0].standing_mm2, 2 * 40 * 40, 0.1);
    }
    // So do open edges: an open base needs no lid, though its rim is shaken.
    shapes::Facets facets = shapes::box({0, 0, 0}, {40, 40, 30});
    std::erase_if(facets, [](const auto& f) { return f[0].z == 0 && f[1].z == 0 && f[2].z == 0; });
    for (auto& facet : facets)
        for (Vec3f& v : facet)
            if (v.z == 0 && v.x > 0) v.z = 1e-6F;
    Context context;
    const Mesh mesh = weld(context, facets);
    const MeshReport report = report_mesh(context, mesh.view());
    EXPECT_EQ(report.open_edges.count, 4u);
    EXPECT_EQ(report.open_edges_off_base.count, 0u);
    Plan plan = layers_of(context, mesh.view(), {});
    (void)bond_all(context, mesh.view(), plan);
    EXPECT_NEAR(plan.layers[0].joints[0].standing_mm2, 40 * 40, 0.1);
}

// Between whole slabs glue goes everywhere: polygons, area and press all say so, and the first joint bears
// every press.
TEST(Joints, JointsBetweenSlabsHaveGlueAndPressOfTheirOwn) {
    Context context;
    const Mesh mesh = stepped(context);
    Plan plan;
    place_stock(plan, bounds(mesh.view()));
    Layer layer;
    layer.index = 1;
    layer.z_top = 40;
    layer.slab_thickness = 57;
    layer.slabs = 3;
    plan.layers = {layer};
    (void)bond_all(context, mesh.view(), plan);
    schedule(plan);
    const std::vector<Joint>& joints = plan.layers[0].joints;
    ASSERT_EQ(joints.size(), 3u);
    EXPECT_NEAR(joints[0].standing_mm2, 120 * 80, 0.1);
    EXPECT_NEAR(joints[1].standing_mm2, 100 * 60, 0.1);
    EXPECT_NEAR(joints[2].standing_mm2, 100 * 60, 0.1);
    const double stock = (plan.stock_max[0] - plan.stock_min[0]) * (plan.stock_max[1] - plan.stock_min[1]);
    EXPECT_LT(joints[0].area_mm2, 120 * 80);
    EXPECT_NEAR(joints[1].area_mm2, stock, 0.1);
    EXPECT_LE(joints[1].force_n, joints[0].force_n);
    const nlohmann::json sequence = nlohmann::json::parse(sequence_json(plan));
    std::size_t k = 0;
    for (const auto& step : sequence["steps"]) {
        if (step["action"] == "press") {
            EXPECT_NEAR(step["force_n"].get<double>(), joints[k - 1].force_n, 1e-3);
        }
        if (step["action"] != "glue") continue;
        const auto& polygons =
            sequence.at(nlohmann::json::json_pointer(step["polygons"].get<std::string>().substr(1)));
        Loops loops;
        for (const auto& loop : polygons["loops"]) {
            for (const auto& p : loop) loops.points.push_back({to_units(p[0]), to_units(p[1])});
            loops.close_loop();
        }
        ASSERT_LT(k, joints.size());
        EXPECT_NEAR(polygons["z_mm"].get<double>(), joints[k].z, 1e-4);
        EXPECT_NEAR(area(loops), step["area_mm2"].get<double>(), 0.1);
        EXPECT_NEAR(area(loops), joints[k].area_mm2, 0.1);
        ++k;
    }
    EXPECT_EQ(k, 3u);
}

// Facets without area that hang together with nothing: they neither lift the pattern nor enlarge its stock.
TEST(Joints, StrayFacetsWithoutAreaLiftNothing) {
    const support::TemporaryFolder folder;
    const shapes::Facets block = shapes::box({0, 0, 0}, {60, 40, 30});
    const auto read = [&](const shapes::Facets& facets) {
        // As a file holds them: header, count, and 50 bytes a facet.
        const std::string path = folder / "part.stl";
        std::ofstream file(path, std::ios::binary);
        file << std::string(80, ' ');
        const auto count = static_cast<std::uint32_t>(facets.size());
        file.write(reinterpret_cast<const char*>(&count), 4);
        for (const auto& facet : facets) {
            file.write("\0\0\0\0\0\0\0\0\0\0\0\0", 12);
            for (const Vec3f& v : facet) {
                file.write(reinterpret_cast<const char*>(&v.x), 4);
                file.write(reinterpret_cast<const char*>(&v.y), 4);
                file.write(reinterpret_cast<const char*>(&v.z), 4);
            }
            file.write("\0\0", 2);
        }
        file.close();
        Context context;
        return read_pattern_mesh(context, path);
    };
    const std::vector<std::array<Vec3f, 3>> strays{
        {Vec3f{5, 5, -7}, Vec3f{5, 5, -7}, Vec3f{5, 5, -7}},         // a point
        {Vec3f{5, 5, -7}, Vec3f{9, 5, -7}, Vec3f{5, 5, -7}},         // a line there and back
        {Vec3f{-90, 5, -7}, Vec3f{-88, 5, -7}, Vec3f{-86, 5, -7}},   // three points on a line
        {Vec3f{200, 5, 70}, Vec3f{200, 5, 71}, Vec3f{200, 5, 72}}};  // upright, above
    for (std::size_t s = 0; s <= strays.size(); ++s) {
        SCOPED_TRACE(s);
        shapes::Facets facets = block;
        for (std::size_t k = 0; k < strays.size(); ++k)
            if (k == s || s == strays.size())
                facets.insert(facets.begin() + static_cast<std::ptrdiff_t>(k), strays[k]);
        const PatternMesh stl = read(facets);
        const Box3 box = bounds(stl.mesh.view());
        EXPECT_EQ(box.min, (Vec3f{0, 0, 0}));
        EXPECT_EQ(box.max, (Vec3f{60, 40, 30}));
        EXPECT_EQ(stl.input.min, (std::array<double, 3>{0, 0, 0}));
        EXPECT_EQ(stl.input.max, (std::array<double, 3>{60, 40, 30}));
        EXPECT_EQ(stl.report.open_edges.count, 0u);
        EXPECT_TRUE(std::any_of(stl.diagnostics.begin(), stl.diagnostics.end(),
                                [](const Diagnostic& d) { return d.code == "mesh.stray"; }));
        Context context;
        EXPECT_NO_THROW(require_solid(context, stl, "part.stl"));
        Plan plan = layers_of(context, stl.mesh.view(), {});
        (void)bond_all(context, stl.mesh.view(), plan);
        EXPECT_NEAR(plan.layers[0].joints[0].standing_mm2, 60 * 40, 0.1);
    }
}

// A boss that hangs from a plate, over air and over a step: columns under it, from the board and from the
// step.
TEST(Joints, SupportsStandUnderWhatNothingCarries) {
    shapes::Facets facets = shapes::box({0, 0, 0}, {200, 60, 15});
    shapes::append(facets, shapes::box({0, 0, 14}, {40, 60, 60}));
    shapes::append(facets, shapes::box({10, 10, 59}, {190, 150, 75}));
    shapes::append(facets, shapes::box({140, 20, 40}, {170, 50, 60}));    // over the step
    shapes::append(facets, shapes::box({140, 100, 40}, {170, 130, 60}));  // over the board
    Context context;
    Mesh mesh = weld(context, facets);
    mesh.roles = facet_roles(context, mesh.view());
    Plan plan = layers_of(context, mesh.view(), Job{});
    std::vector<std::vector<JointWood>> wood = wood_at_joints(context, mesh.view(), plan);
    const auto floats = [&] {
        std::vector<Diagnostic> notes;
        std::size_t count = 0;
        for (std::size_t i = 0; i < plan.layers.size(); ++i)
            for (const WeakJoint& w : bond_layer(plan.layers[i], wood[i], plan, notes))
                count += w.code == "joint.floating" ? 1 : 0;
        return count;
    };
    EXPECT_EQ(floats(), 1u);
    plan.supports = place_supports(plan, wood);
    const auto under = [&](double y) {
        return std::find_if(plan.supports.begin(), plan.supports.end(), [&](const Support& s) {
            return s.x > 140 && s.x < 170 && s.y > y && s.y < y + 30 && std::abs(s.z_high - 40) < 0.5;
        });
    };
    ASSERT_NE(under(20), plan.supports.end());
    ASSERT_NE(under(100), plan.supports.end());
    EXPECT_LE(under(20)->z_low, 15);  // from within the step's wood, at the layer that its top lies in
    EXPECT_GT(under(20)->z_low, 12);
    EXPECT_EQ(under(100)->z_low, 0);
    EXPECT_NEAR(under(100)->width, 20, 0.5);
    const Mesh propped = with_supports(context, mesh.view(), plan.supports);
    EXPECT_EQ(propped.facets.size(), mesh.facets.size() + 12 * plan.supports.size());
    wood = wood_at_joints(context, propped.view(), plan);
    EXPECT_EQ(floats(), 0u);
    EXPECT_TRUE(place_supports(plan, wood).empty());
}

TEST(Joints, APlanWithAJointThatCannotHoldIsRefusedUnlessAccepted) {
    shapes::Facets facets = shapes::box({56, 56, 0}, {64, 64, 12});
    shapes::append(facets, shapes::box({0, 0, 12}, {160, 140, 45}));
    Context context;
    const Mesh mesh = weld(context, facets);
    Job job;
    job.layers.supports = SupportRule::none;
    try {
        (void)make_plan(context, mesh, {}, job);
        FAIL() << "half a kilogram on a pin of 8 mm";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::no_plan);
        EXPECT_EQ(e.code(), "joint.tips");
        EXPECT_NE(e.message().find("mm2 of glue carry"), std::string::npos) << e.message();
        EXPECT_TRUE(e.place().starts_with("x 60.00 y 60.00 z ")) << e.place();
        EXPECT_NE(e.remedy().find("--accept-weak-joints"), std::string::npos);
    }
    // Columns of stock under the plate carry it.
    job.layers.supports = SupportRule::automatic;
    const Plan propped = make_plan(context, mesh, {}, job);
    ASSERT_GE(propped.supports.size(), 2u);
    for (const Support& s : propped.supports) {
        EXPECT_EQ(s.z_low, 0);
        EXPECT_NEAR(s.z_high, 12, 0.5);
        EXPECT_TRUE(s.x - s.width / 2 >= 0 && s.x + s.width / 2 <= 160) << s.x;
        EXPECT_TRUE(s.y - s.width / 2 >= 0 && s.y + s.width / 2 <= 140) << s.y;
    }
    EXPECT_EQ(std::count_if(propped.diagnostics.begin(), propped.diagnostics.end(),
                            [](const Diagnostic& d) { return d.code == "support.stands"; }),
              static_cast<std::ptrdiff_t>(propped.supports.size()));
    job.layers.supports = SupportRule::none;
    // A flask carries slabs, but not the pattern once that is cut out of them.
    job.flask.enabled = true;
    EXPECT_THROW((void)make_plan(context, mesh, {}, job), Error);
    job.flask.enabled = false;
    job.bonding.accept_weak = true;
    const Plan accepted = make_plan(context, mesh, {}, job);
    EXPECT_TRUE(std::any_of(
        accepted.diagnostics.begin(), accepted.diagnostics.end(),
        [](const Diagnostic& d) { return d.code == "joint.tips" && d.severity == Severity::warning; }));
}
