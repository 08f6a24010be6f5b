#include "engine/planner/local_frame.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "engine/schedule/fit.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kSteps = 16;      // of a millimetre
constexpr double kFarthest = 2e5;  // mm: 32 bits of 0.1 µm reach 214 m

template <std::size_t n>
void move(std::array<double, n>& place, const std::array<double, 2>& by) {
    place[0] += by[0];
    place[1] += by[1];
}

void move(Loops& loops, const Point2& by) {
    for (Point2& p : loops.points) p = {p.x + by.x, p.y + by.y};
}

}  // namespace

std::array<double, 2> local_origin(const Box3& box) {
    const double farthest = std::max({std::abs(double{box.min.x}), std::abs(double{box.max.x}),
                                      std::abs(double{box.min.y}), std::abs(double{box.max.y})});
    if (farthest > kFarthest)
        throw refusal(
            "input.far",
            fmt::format("the pattern reaches {:.0f} mm from the origin; paths are told up to {:.0f} mm",
                        farthest, kFarthest),
            fmt::format("x {:.0f} y {:.0f} mm", box.min.x, box.min.y),
            "export the pattern nearer to its origin");
    return {std::floor(double{box.min.x} * kSteps) / kSteps, std::floor(double{box.min.y} * kSteps) / kSteps};
}

BulkVector<Vec3f> in_local_frame(Context& context, MeshView mesh, const std::array<double, 2>& origin) {
    BulkVector<Vec3f> moved(mesh.vertices.size());
    parallel_for(context, moved.size(), std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            moved[v] = {static_cast<float>(mesh.vertices[v].x - origin[0]),
                        static_cast<float>(mesh.vertices[v].y - origin[1]), mesh.vertices[v].z};
    });
    return moved;
}

void leave_local_frame(Plan& plan, const std::array<double, 2>& by) {
    const Point2 units{to_units(by[0]), to_units(by[1])};
    move(plan.stock_min, by);
    move(plan.stock_max, by);
    if (plan.flask) {
        move(plan.flask->outer, units);
        for (Loops& inner : plan.flask->inner) move(inner, units);
    }
    for (Support& s : plan.supports) {
        s.x += by[0];
        s.y += by[1];
    }
    for (Feature& f : plan.features) {
        f.x += by[0];
        f.y += by[1];
    }
    for (Layer& layer : plan.layers) {
        for (Operation& op : layer.operations) {
            for (Move& m : op.moves) {
                m.x += units.x;
                m.y += units.y;
            }
            if (op.peak_at) move(*op.peak_at, by);
        }
        if (layer.blank) {
            move(layer.blank->min, by);
            move(layer.blank->max, by);
        }
        for (JointDowel& dowel : layer.dowels) {
            dowel.x += by[0];
            dowel.y += by[1];
        }
        for (Joint& joint : layer.joints) {
            move(joint.centroid, by);
            move(joint.glue, units);
            for (GlueRun& bead : joint.beads)
                bead = {bead.y + units.y, bead.from + units.x, bead.to + units.x};
        }
    }
    // Edges count from the model's zero or from a place that moves with all else.
    const bool of_model = plan.job.machine.zero == WorkZero::model;
    for (SequenceStep& step : plan.sequence)
        for (auto& [name, number] : step.numbers) {
            if (name == "x_mm" || (of_model && (name == "slab_left_mm" || name == "touch_x_mm")))
                number += by[0];
            if (name == "y_mm" || (of_model && (name == "slab_front_mm" || name == "touch_y_mm")))
                number += by[1];
        }
    for (ProbeProgram& probe : plan.probes)
        for (std::size_t k = 0; of_model && k < 2; ++k) probe.touches[k] += by[k];
    for (Plan& under : plan.undersides) {  // all else of it counts from its slab's corner
        move(under.turned->blank.min, by);
        move(under.turned->blank.max, by);
    }
    for (Diagnostic& d : plan.diagnostics)
        if (d.where) move(*d.where, by);
}

}  // namespace slabwright
