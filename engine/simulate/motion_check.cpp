#include "engine/simulate/motion_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "engine/simulate/dowel_proof.h"
#include "engine/simulate/gouge.h"
#include "engine/simulate/laid_slabs.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

double seconds_of(const SimulationStage& stage, std::size_t i) {
    const std::vector<Program>& programs = stage.input.programs;
    return program_seconds(programs[i], stage.input.machine, i > 0 ? &programs[i - 1] : nullptr);
}

/// One program's findings. @return what its steps reach over, as far as known
StepBox check_program(const SimulationStage& stage, std::size_t i, const std::optional<StandingPart>& walls,
                      ProgramFindings& f) {
    const Program& program = stage.input.programs[i];
    const SimulatedLayer& layer = stage.input.layers[static_cast<std::size_t>(program.layer)];
    f.lowest = layer.z_top;
    f.stock_top = -kUnbounded;
    f.seconds = seconds_of(stage, i);
    StepBox box;
    for (const ProgramArc& a : program.arcs) {
        box.add(a);
        f.cutting_mm += a.arc.length();
    }
    auto arc = program.arcs.begin();
    for (std::size_t k = 0; k < program.steps.size(); ++k) {
        const ProgramStep& s = program.steps[k];
        if (s.known()) box.add(s);
        if (std::isfinite(s.z)) box.z1 = std::max(box.z1, s.z), box.z0 = std::min(box.z0, s.z);
        if (!s.rapid() && !s.spindle && f.spindle_off_line == 0) f.spindle_off_line = s.line;
        if (k == 0 || !program.steps[k - 1].known() || !s.known()) continue;
        while (arc != program.arcs.end() && arc->end <= k) ++arc;
        if (arc != program.arcs.end() && arc->begin <= k) continue;
        const ProgramStep& b = program.steps[k - 1];
        (s.rapid() ? f.rapid_mm : f.cutting_mm) +=
            std::sqrt((s.x - b.x) * (s.x - b.x) + (s.y - b.y) * (s.y - b.y) + (s.z - b.z) * (s.z - b.z));
    }
    if (const Tool* const tool = stage.programs[i].tool) {
        // A path whose corners the machine may round farther than a finish pass's is safe as far as it
        // may leave it.
        const Tool wide = program.strays > kJunction ? wider(*tool, program.strays) : *tool;
        const std::optional<Program> above = above_dowels(program, layer, *tool);
        f.gouge = check_gouge(stage.context, stage.part, layer.z_top, wide, above ? *above : program,
                              {stage.options.gouge, 1e-5});
        if (walls)
            f.flask =
                check_gouge(stage.context, *walls, layer.z_top, *tool, program, {stage.options.gouge, 1e-5})
                    .cutter;
    }
    return box;
}

/// Turns findings into violations and sums.
void tell(const SimulationStage& stage, const std::vector<CheckedProgram>& checked,
          SimulationReport& report) {
    for (std::size_t i = 0; i < stage.input.programs.size(); ++i) {
        const Program& program = stage.input.programs[i];
        const ProgramFindings& f = checked[i].findings;
        if (f.spindle_off_line != 0)
            violate(report, "spindle.off", "feeds while the spindle does not turn", &program,
                    f.spindle_off_line, {}, 0);
        const Machine& m = stage.input.machine;
        auto travel = [&](const char* axis, double span, double limit) {
            if (span > limit + 1e-6)
                violate(report, "travel.exceeded",
                        fmt::format("moves over {:.3f} mm in {}; the machine travels {:.3f} mm", span, axis,
                                    limit),
                        &program, 0, {}, span - limit);
        };
        const StepBox& box = checked[i].box;
        if (box.x1 >= box.x0) {
            travel("x", box.x1 - box.x0, m.travel_x);
            travel("y", box.y1 - box.y0, m.travel_y);
        }
        if (box.z1 >= box.z0) travel("z", box.z1 - box.z0, m.travel_z);
        report.gouge_max = std::max(report.gouge_max, f.gouge.cutter.depth);
        report.seconds += f.seconds;
        report.cutting_mm += f.cutting_mm;
        report.rapid_mm += f.rapid_mm;
    }
}

}  // namespace

std::vector<CheckedProgram> check_motions(const SimulationStage& stage, const ProgramChanges* changes,
                                          const SimulationMemory* memory, SimulationReport& report) {
    const SimulationInput& input = stage.input;
    std::vector<std::optional<StandingPart>> walls(input.layers.size());  // of the flasks
    for (const Program& program : input.programs) {
        const auto l = static_cast<std::size_t>(program.layer);
        if (!walls[l] && !input.layers[l].flask.empty())
            walls[l].emplace(stage.context, flask_walls(input.layers, l).view());
    }
    std::vector<CheckedProgram> checked(input.programs.size());
    parallel_each(stage.context, input.programs.size(), [&](std::size_t i) {
        CheckedProgram& c = checked[i];
        if (changes != nullptr && changes->is_same(i)) {
            c = memory->checked[*changes->before(i)];
            c.findings.seconds = seconds_of(stage, i);
        } else {
            c.box =
                check_program(stage, i, walls[static_cast<std::size_t>(input.programs[i].layer)], c.findings);
        }
        stage.context.advance(input.programs[i].steps.size());
    });
    for (const CheckedProgram& c : checked) report.programs.push_back(c.findings);
    tell(stage, checked, report);
    return checked;
}

}  // namespace slabwright
