#include "engine/schedule/fit.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "engine/flask/flask.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

Error refusal(const char* code, std::string message, std::string place, std::string remedy) {
    return Error(ErrorKind::no_plan, code, std::move(message), std::move(place), std::move(remedy));
}

void place_stock(Plan& plan, const Box3& box) {
    const Job& job = plan.job;
    const std::array<double, 2> lo{box.min.x, box.min.y}, hi{box.max.x, box.max.y},
        slab{job.slabs.length, job.slabs.width};
    const std::array<double, 2> travel{job.machine.travel_x, job.machine.travel_y};
    constexpr const char* axis[] = {"x", "y"};
    for (int k = 0; k < 2; ++k) {
        const double size = hi[k] - lo[k];
        if (size > slab[k])
            throw refusal(
                "fit.slab",
                fmt::format("the pattern is {:.1f} mm in {}, {:.1f} mm more than the slab's {:.1f} mm", size,
                            axis[k], size - slab[k], slab[k]),
                axis[k], "use larger slabs, turn or split the pattern");
        if (size > travel[k])
            throw refusal(
                "fit.travel",
                fmt::format(
                    "the pattern is {:.1f} mm in {}, {:.1f} mm more than the machine's travel of {:.1f} mm",
                    size, axis[k], size - travel[k], travel[k]),
                axis[k], "use a larger machine, turn or split the pattern");
        // A flask needs its room; without one the stock takes what the slab leaves.
        const double room = std::min((slab[k] - size) / 2, (travel[k] - size) / 2);
        const double needed = job.flask.enabled ? flask_margin(job.flask, box.max.z) : 0;
        if (needed > room)
            throw refusal("fit.flask",
                          fmt::format("the flask needs {:.1f} mm on either side of the pattern in {}, {:.1f} "
                                      "mm more than the {} leaves",
                                      needed, axis[k], needed - room,
                                      slab[k] <= travel[k] ? "slab" : "machine's travel"),
                          axis[k],
                          "use larger slabs, a smaller flask.gap or flask.wall, or turn the pattern");
        const double margin = std::min(std::max(job.slabs.margin, needed), room);
        plan.stock_min[k] = lo[k] - margin;
        plan.stock_max[k] = hi[k] + margin;
    }
    if (box.max.z > job.machine.build_height)
        throw refusal(
            "fit.chamber",
            fmt::format("the pattern is {:.1f} mm high, {:.1f} mm more than the build chamber's {:.1f} mm",
                        box.max.z, box.max.z - job.machine.build_height, job.machine.build_height),
            "z", "split the pattern");
}

void check_travel(const Plan& plan) {
    const Machine& machine = plan.job.machine;
    const double cx = 0.5 * (plan.stock_min[0] + plan.stock_max[0]),
                 cy = 0.5 * (plan.stock_min[1] + plan.stock_max[1]);
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations) {
            double over_x = 0, over_y = 0;
            auto reach = [&](double x, double y) {
                over_x = std::max(over_x, std::abs(x - cx) - machine.travel_x / 2);
                over_y = std::max(over_y, std::abs(y - cy) - machine.travel_y / 2);
            };
            for (std::size_t i = 0; i < op.moves.size(); ++i) {
                const Move& m = op.moves[i];
                reach(to_mm(m.x), to_mm(m.y));
                if (m.is_arc()) {
                    const std::array<double, 4> box = arc_shape(op.moves[i - 1], m).box();
                    reach(box[0], box[1]);
                    reach(box[2], box[3]);
                }
            }
            for (const auto& [over, axis] : {std::pair{over_x, "x"}, {over_y, "y"}})
                if (over > 1e-4)
                    throw refusal(
                        "fit.travel",
                        fmt::format(
                            "the {} program of layer {} leaves the machine's travel in {} by {:.1f} mm",
                            op.purpose, layer.index, axis, over),
                        fmt::format("layer {}", layer.index),
                        "use a smaller margin, a larger machine, or turn the pattern");
        }
}

void check_mass(const Plan& plan) {
    const double carried = plan.job.machine.build_mass_kg;
    if (plan.totals.stack_mass_kg > carried)
        throw refusal(
            "fit.mass",
            fmt::format("the stack weighs {:.0f} kg, {:.0f} kg more than the build platform carries",
                        plan.totals.stack_mass_kg, plan.totals.stack_mass_kg - carried),
            {}, "split the pattern or use a smaller margin");
}

}  // namespace slabwright
