#include "engine/simulate/stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/simulate/stack_check.h"
#include "kernels/errors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

void check(const SimulationInput& input) {
    auto bad = [](const std::string& what) {
        throw Error(ErrorKind::usage, "simulate.input", what, {}, "plan again");
    };
    if (input.layers.empty()) bad("no layers");
    for (int k = 0; k < 2; ++k)
        if (!(input.stock_max[k] > input.stock_min[k]) || !std::isfinite(input.stock_min[k]) ||
            !std::isfinite(input.stock_max[k]))
            bad("the stock has no extent");
    double below = -1e-6;
    for (const SimulatedLayer& layer : input.layers) {
        if (!(layer.z_top > layer.z_bottom) || !(layer.slab_thickness > 0) || !(layer.z_bottom >= below) ||
            !std::isfinite(layer.z_top))
            bad("a layer that lies not on the one before, or has no height");
        below = layer.z_top - 1e-6;
    }
    int layer = 0;
    for (const Program& program : input.programs) {
        if (program.layer < layer || static_cast<std::size_t>(program.layer) >= input.layers.size())
            bad("programs that are not in the order of the layers");
        layer = program.layer;
    }
}

/// The flasks of the layers with the tolerances of their walls. The grid's last cells may lie past the
/// stock's edge, where no cutter has to go because of them: they count as border too.
void place_flasks(SimulationStage& stage) {
    Loops slab;
    const Point2 low{to_units(stage.input.stock_min[0]), to_units(stage.input.stock_min[1])},
        high{to_units(stage.input.stock_max[0]), to_units(stage.input.stock_max[1])};
    slab.points = {low, {high.x, low.y}, high, {low.x, high.y}};
    slab.close_loop();
    for (const SimulatedLayer& layer : stage.input.layers) {
        stage.flasks.emplace_back();
        if (layer.flask.empty()) continue;
        stage.flasks.back().core = offset(layer.flask, -stage.options.gouge, 1e-3);
        stage.flasks.back().border =
            unite(offset(layer.flask, stage.options.cusp + stage.options.slack, 1e-2),
                  subtract(offset(slab, 2 * stage.cell, 1e-2), slab));
    }
}

const Tool* tool_of(const SimulationInput& input, int number) {
    for (const Tool& t : input.tools)
        if (t.number == number) return &t;
    return nullptr;
}

void prepare(SimulationStage& stage, SimulationReport& report) {
    for (const Program& program : stage.input.programs) {
        PreparedProgram p;
        p.program = &program;
        p.tool = tool_of(stage.input, program.tool);
        if (!p.tool)
            violate(report, "tool.unknown",
                    fmt::format("loads tool {}, which the plan's library does not hold", program.tool),
                    &program, 0, {}, 0);
        else if (program.tool != program.planned_tool)
            violate(
                report, "tool.wrong",
                fmt::format("loads tool {} where the plan names tool {}", program.tool, program.planned_tool),
                &program, 0, {}, 0);
        if (p.tool) p.end = cutter_end(cutter_shape(*p.tool));
        stage.programs.push_back(std::move(p));
    }
    parallel_each(stage.context, stage.programs.size(), [&](std::size_t i) {
        PreparedProgram& p = stage.programs[i];
        const auto& steps = p.program->steps;
        p.blocks.reserve(steps.size() / kBlockSteps + 1);
        p.parts.reserve(p.blocks.capacity() * (kBlockSteps / kPartSteps));
        for (std::size_t first = 1; first < steps.size(); first += kPartSteps) {
            StepBox box;
            for (std::size_t k = first; k < std::min(steps.size(), first + kPartSteps); ++k) {
                const ProgramStep &a = steps[k - 1], &b = steps[k];
                if (!a.known() || !b.known()) continue;
                box.add(a), box.add(b);
                if (!b.rapid()) p.cut_mm += std::hypot(b.x - a.x, b.y - a.y);
            }
            if (p.parts.size() % (kBlockSteps / kPartSteps) == 0) p.blocks.emplace_back();
            p.parts.push_back(box);
            p.blocks.back().add(box);
        }
    });
}

}  // namespace

double SimulationStage::lowest_tip(std::size_t layer) const {
    return layer == 0 && options.board_cut >= 0 ? input.layers[layer].z_bottom - options.board_cut
                                                : -std::numeric_limits<double>::infinity();
}

void violate(SimulationReport& report, const std::string& code, const std::string& message,
             const Program* program, std::uint32_t line, std::optional<Point3> where, double size,
             std::optional<std::size_t> layer) {
    report.violations.push_back({code, message, program ? program->file : "", line, where, size, layer});
}

SimulationStage set_stage(Context& context, const SimulationInput& input, const StandingPart& part,
                          const SimulationOptions& options, SimulationReport& report) {
    check(input);
    SimulationStage stage{context, input, part, options};
    report.cell = stage.cell = options.cell > 0 ? options.cell : simulation_cell(input.tools, options.cusp);
    const double width = input.stock_max[0] - input.stock_min[0],
                 depth = input.stock_max[1] - input.stock_min[1];
    report.nx = stage.nx = std::max(1, static_cast<int>(std::ceil(width / stage.cell - 1e-9)));
    report.ny = stage.ny = std::max(1, static_cast<int>(std::ceil(depth / stage.cell - 1e-9)));
    place_flasks(stage);
    check_stack(stage, report);
    prepare(stage, report);
    return stage;
}

}  // namespace slabwright
