#include "engine/paths/operations/edges.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/flask_room.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/features/edge_chains.h"
#include "kernels/features/facet_classes.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kClear = 0.001;  // mm that a cutter keeps off the faces that it touches, for rounding
constexpr double kMiss = 0.01;    // mm over the place that touches an edge: higher, it is kept away
constexpr double kAlong = 0.5;    // mm between places along an edge, at most
constexpr double kNear = 3;       // mm from run to run along the surface
constexpr double kShortest = 5;   // mm that a tool follows in a layer, at least
constexpr double kBetter = 0.05;  // of what stands, that a later tool must leave less to be preferred
constexpr double kDown = -0.01;   // z of a normal that looks down
constexpr double kWall = 0.2;     // z of a normal that a flat end mill takes for a wall

/// A sharp edge of the mesh and the normals of the faces beside it.
struct SharpEdge {
    Vec3d from{}, to{};
    std::array<Vec3d, 2> normals{};
    bool convex = false;
};

/// Where a cutter's tip lies against the point of an edge that it touches, mm.
using TipOffset = Vec3d;

/// A tool with what its places are found by.
struct EdgeTool {
    const Tool* tool = nullptr;
    const DropIndex* drops = nullptr;
    CutterEnd end;
    Loops room;                  ///< where its middle may be beside a flask
    double radius = 0, tip = 0;  ///< of the cutter, and of the ball that its tip is
    bool ball = false;           ///< its tip is one

    [[nodiscard]] bool ends_in_point() const { return tool->kind == ToolKind::cone; }
    /// Height of its lower end over the tip at a distance from the axis; infinite beside it, mm.
    [[nodiscard]] double height(double from_axis) const {
        if (from_axis > radius) return kUncovered;
        if (end.form == CutterEnd::Form::cone) return end.slope * from_axis;
        if (ball && end.form == CutterEnd::Form::ball)
            return radius - std::sqrt(std::max(0.0, radius * radius - from_axis * from_axis));
        return end.form == CutterEnd::Form::other ? end.under.height(from_axis) : 0;
    }
};

/// What a tool does at one point of an edge.
struct EdgePlaces {
    std::array<PathPoint, 2> at{};  ///< on each side; of a concave edge there is one
    std::array<bool, 2> is_there{};
    int tool = -1;  ///< none: nothing is to do
};

Vec3d unit_normal(MeshView mesh, std::uint32_t facet) {
    const Vec3d n = area_normal(mesh, facet);
    const double size = length(n);
    return size > 0 ? scaled(1 / size, n) : Vec3d{};
}

std::vector<SharpEdge> edges_in(const LayerCut& cut) {
    const MeshView mesh = cut.layer.mesh;
    std::vector<SharpEdge> edges;
    for (const EdgeChain& chain : find_edge_chains(cut.context, mesh, cut.job.cutting.edge_angle_deg))
        for (std::size_t i = 0; i < chain.sides.size(); ++i) {
            const std::size_t after = (i + 1) % chain.vertices.size();
            SharpEdge edge{to_double(mesh.vertices[chain.vertices[i]]),
                           to_double(mesh.vertices[chain.vertices[after]]),
                           {unit_normal(mesh, chain.sides[i][0]), unit_normal(mesh, chain.sides[i][1])},
                           chain.convex};
            if (std::max(edge.from[2], edge.to[2]) < cut.layer.z_bottom) continue;
            if (std::min(edge.from[2], edge.to[2]) > cut.layer.z_top) continue;
            edges.push_back(edge);
        }
    return edges;
}

// A ball's tip lies R under its centre, and the centre R from both faces.
std::vector<TipOffset> ball_offsets(const SharpEdge& edge, double radius) {
    std::vector<TipOffset> offsets;
    const double r = radius + kClear;
    const auto& [a, b] = edge.normals;
    if (edge.convex) {
        for (const Vec3d& n : edge.normals)
            if (n[2] > kDown) offsets.push_back({r * n[0], r * n[1], r * n[2] - radius});
        return offsets;
    }
    const double share = r / (1 + dot(a, b));
    if (a[2] > kDown && b[2] > kDown)
        offsets.push_back({share * (a[0] + b[0]), share * (a[1] + b[1]), share * (a[2] + b[2]) - radius});
    return offsets;
}

// A flat or bull-nose end mill has its rim at a wall: beside a convex edge at either, as low as the edge; on
// a concave one it stands on the other face.
std::vector<TipOffset> flat_offsets(const SharpEdge& edge, double radius) {
    std::vector<TipOffset> offsets;
    for (const Vec3d& n : edge.normals) {
        const double level = std::hypot(n[0], n[1]);
        if (n[2] > kWall || n[2] < kDown) continue;
        offsets.push_back({(radius + kClear) * n[0] / level, (radius + kClear) * n[1] / level, 0});
    }
    if (!edge.convex && offsets.size() > 1) offsets.clear();  // it has no floor
    return offsets;
}

// A cone goes along a concave edge with its point in it; whether its flanks are free there, drops tell.
std::vector<TipOffset> point_offsets(const SharpEdge& edge) {
    const auto& [a, b] = edge.normals;
    if (edge.convex || !(a[2] > kDown && b[2] > kDown)) return {};
    return {{0, 0, kClear}};
}

class EdgePaths {
public:
    /// @param points by cones; else by all other tools
    EdgePaths(const LayerCut& cut, LayerStock& stock, bool points)
        : cut_(cut), stock_(stock), points_(points), limit_(2 * cut.job.tolerances.gouge) {}

    std::vector<Operation> run() {
        list_tools();
        if (tools_.empty()) return {};
        const std::vector<SharpEdge> edges = edges_in(cut_);
        if (edges.empty()) return {};
        std::vector<std::vector<EdgePlaces>> places(edges.size());
        parallel_each(cut_.context, edges.size(), [&](std::size_t e) { places[e] = places_along(edges[e]); });
        std::vector<Operation> operations;
        for (std::size_t t = 0; t < tools_.size(); ++t)
            if (std::optional<Operation> op = operation(t, places)) operations.push_back(std::move(*op));
        return operations;
    }

private:
    // The finish tool is preferred; then smaller ones, then the flats.
    void list_tools() {
        const LayerTools& tools = cut_.layer.tools;
        if (points_) {
            for (const Tool& tool : cut_.job.tools)
                if (tool.kind == ToolKind::cone) add(tool);
            return;
        }
        add(tools.finish);
        for (const Tool& tool : tools.rest) add(tool);
        add(tools.rough);
        double finest = kAlong * kUnitsPerMm;
        for (const EdgeTool& t : tools_)
            if (!t.ends_in_point())
                finest = std::min(finest, static_cast<double>(safe_step(t.tip, cut_.job.tolerances.gouge)));
        along_ = finest / kUnitsPerMm;
    }
    void add(const Tool& tool) {
        EdgeTool& t = tools_.emplace_back();
        t.tool = &tool;
        t.drops = &cut_.drops(cutter_shape(tool));
        t.end = cutter_end(tool);
        t.radius = tool.diameter / 2;
        t.tip = tip_diameter(tool) / 2;
        t.ball = has_ball_tip(tool.kind);
        if (!cut_.layer.opening.empty()) t.room = flask_room(cut_, t.radius);
    }

    [[nodiscard]] std::vector<EdgePlaces> places_along(const SharpEdge& edge) const {
        const Vec3d way = minus(edge.to, edge.from);
        const double mm = length(way);
        const auto n = static_cast<std::size_t>(std::ceil(mm / along_));
        std::vector<std::vector<TipOffset>> offsets;
        for (const EdgeTool& t : tools_)
            offsets.push_back(t.ball              ? ball_offsets(edge, t.tip)
                              : t.ends_in_point() ? point_offsets(edge)
                                                  : flat_offsets(edge, t.radius));
        std::vector<EdgePlaces> places;
        std::vector<MetPoints> met(tools_.size());
        for (std::size_t k = 0; k <= n; ++k) {
            const double share = n == 0 ? 0 : static_cast<double>(k) / static_cast<double>(n);
            const Vec3d at = plus(edge.from, way, share);
            const bool inside = at[2] >= cut_.layer.z_bottom - kMiss && at[2] <= cut_.layer.z_top - kMiss;
            places.push_back(inside && most_left(at) > limit_ ? best_at(at, offsets, met) : EdgePlaces{});
        }
        return places;
    }

    /// Calls fn(cell, x, y) for the cells beside a point.
    template <class Fn>
    void each_beside(const Vec3d& at, Fn&& fn) const {
        const CellGrid& grid = stock_.grid();
        const auto index = [&](double v, double from, int count) {
            return std::clamp(static_cast<int>(std::lround((v - from) / grid.cell)), 0, count - 1);
        };
        const int i0 = index(at[0] - kEdgeBand, grid.x0, grid.nx),
                  i1 = index(at[0] + kEdgeBand, grid.x0, grid.nx),
                  j0 = index(at[1] - kEdgeBand, grid.y0, grid.ny),
                  j1 = index(at[1] + kEdgeBand, grid.y0, grid.ny);
        for (int j = j0; j <= j1; ++j)
            for (int i = i0; i <= i1; ++i) fn(grid.index(i, j), grid.x(i), grid.y(j));
    }
    [[nodiscard]] double most_left(const Vec3d& at) const {
        double most = 0;
        each_beside(at, [&](std::size_t c, double, double) {
            most = std::max(most, static_cast<double>(stock_.left(c)));
        });
        return most;
    }

    [[nodiscard]] EdgePlaces best_at(const Vec3d& at, const std::vector<std::vector<TipOffset>>& offsets,
                                     std::vector<MetPoints>& met) const {
        EdgePlaces best;
        double least = kUncovered;
        for (std::size_t t = 0; t < tools_.size(); ++t) {
            EdgePlaces here;
            std::array<Vec3d, 2> tips{};
            for (std::size_t k = 0; k < offsets[t].size(); ++k) {
                const std::optional<Vec3d> tip = tip_at(tools_[t], plus(at, offsets[t][k]), met[t]);
                if (!tip) continue;
                here.is_there[k] = true;
                tips[k] = *tip;
                here.at[k] = {to_units((*tip)[0]), to_units((*tip)[1]), to_units((*tip)[2]) + 1};
            }
            if (!here.is_there[0] && !here.is_there[1]) continue;
            const auto [stands, leaves, gains] = left_by(tools_[t], at, here, tips);
            if (!gains || leaves > least - kBetter * stands) continue;
            least = leaves;
            best = here;
            best.tool = static_cast<int>(t);
        }
        return best;
    }

    // How deep under the layer's top it may go, mm: a shank no wider than the cutter may follow it.
    [[nodiscard]] double depth_of(const Tool& tool) const {
        if (tool.shank_diameter > tool.diameter) return max_layer_of(cut_.job, tool);
        return tool.stickout - cut_.job.cutting.holder_clearance;
    }

    // The tip where it touches the edge; none where something keeps it away from there.
    [[nodiscard]] std::optional<Vec3d> tip_at(const EdgeTool& t, const Vec3d& wanted, MetPoints& met) const {
        const LayerJob& layer = cut_.layer;
        const double x = to_mm(to_units(wanted[0])), y = to_mm(to_units(wanted[1]));
        const double lowest =
            std::max(t.ball ? layer.floor_below : std::max(layer.floor_below, layer.z_bottom),
                     layer.z_top - depth_of(*t.tool));
        if (x < cut_.low(0, t.radius) || x > cut_.high(0, t.radius) || y < cut_.low(1, t.radius) ||
            y > cut_.high(1, t.radius))
            return std::nullopt;
        if (!t.room.empty() && winding(t.room, {to_units(x), to_units(y)}) <= 0) return std::nullopt;
        const double most = wanted[2] + kMiss;
        if (lowest > most || most >= layer.z_top) return std::nullopt;
        const std::optional<Rest> rest = t.drops->drop_within(x, y, wanted[2] - kMiss, most, &met);
        if (!rest || rest->on_cap) return std::nullopt;
        return Vec3d{x, y, std::max({rest->tip_z, wanted[2], lowest})};
    }

    struct Left {
        double stands, leaves;  ///< mm along the normal, summed over the cells beside the point
        bool gains;             ///< it lowers a cell by what is worth it
    };
    [[nodiscard]] Left left_by(const EdgeTool& t, const Vec3d& at, const EdgePlaces& here,
                               const std::array<Vec3d, 2>& tips) const {
        Left sum{0, 0, false};
        each_beside(at, [&](std::size_t c, double x, double y) {
            const double left = static_cast<double>(stock_.left(c));
            if (left <= 0) return;
            double z = static_cast<double>(stock_.height(c)) + stock_.z_bottom();
            const double surface = static_cast<double>(stock_.surface(c)) + stock_.z_bottom(), stood = z;
            for (std::size_t k = 0; k < tips.size(); ++k)
                if (here.is_there[k])
                    z = std::min(z, tips[k][2] + t.height(std::hypot(x - tips[k][0], y - tips[k][1])));
            const double gain = (stood - std::max(z, surface)) * static_cast<double>(stock_.nz(c));
            sum.stands += left;
            sum.leaves += left - gain;
            if (left > limit_ && gain > limit_ / 2) sum.gains = true;
        });
        return sum;
    }

    // The runs of one tool, joined and cut; none where they are too short to change the tool for.
    [[nodiscard]] std::optional<Operation> operation(std::size_t tool,
                                                     const std::vector<std::vector<EdgePlaces>>& places) {
        const EdgeTool& t = tools_[tool];
        // A point goes straight from place to place along its edge, as a ball does that fits there.
        const double chord =
            t.ends_in_point() ? 1.5 * along_ : safe_chord_mm(t.tip, cut_.job.tolerances.gouge);
        const Slide slide{t.drops, t.ball || t.ends_in_point(), chord, cut_.layer.z_top, kNear, 0};
        std::vector<std::vector<PathPoint>> runs;
        double mm = 0;
        for (const std::vector<EdgePlaces>& edge : places)
            for (std::size_t side = 0; side < 2; ++side) {
                std::vector<PathPoint> run;
                for (std::size_t k = 0; k <= edge.size(); ++k) {
                    const bool goes_on =
                        k < edge.size() && edge[k].tool == static_cast<int>(tool) && edge[k].is_there[side];
                    if (goes_on) append_free(run, edge[k].at[side], slide);
                    else if (!run.empty()) {
                        mm += along_ * static_cast<double>(run.size());
                        runs.push_back(simplify(run, simplify_tolerance_units(cut_.job.tolerances.gouge)));
                        run.clear();
                    }
                }
            }
        if (mm < kShortest) return std::nullopt;
        Operation op = cut_.operation(OperationKind::edge, "sharp edges", *t.tool);
        PathBuilder path(op, *t.tool, std::min(cut_.job.cutting.finish_feed, cut_.job.machine.max_feed),
                         cut_.layer.z_top + cut_.job.machine.clearance, cut_.layer.z_top + 2);
        path.set_surroundings(cut_.around(*t.tool, t.drops));
        follow_nearest(path, chained(std::move(runs), slide));
        if (!path.finish()) return std::nullopt;
        (void)stock_.cut(cut_.context, op, *t.tool);
        return op;
    }

    const LayerCut& cut_;
    LayerStock& stock_;
    bool points_;
    double limit_, along_ = kAlong;  // mm
    std::vector<EdgeTool> tools_;
};

}  // namespace

std::vector<Operation> follow_edges(const LayerCut& cut, LayerStock& stock) {
    // What balls leave in a hollow is for points.
    std::vector<Operation> operations = EdgePaths(cut, stock, false).run();
    for (Operation& op : EdgePaths(cut, stock, true).run()) operations.push_back(std::move(op));
    return operations;
}

}  // namespace slabwright
