#include "engine/forces/cuts.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

ForceCoefficients coefficients_of(const Material& material, double helix_rad) {
    return resolve_coefficients({material.ktc, material.kte, material.kfc, material.kfe}, helix_rad,
                                material.transform);
}

CutSegment idle_cut(const Job& job, const Tool& tool) {
    CutSegment cut = segment_of(cutter_shape(tool));
    cut.flutes = tool.flutes;
    cut.helix_rad = tool.helix_rad;
    cut.coefficients = coefficients_of(job.material, tool.helix_rad);
    cut.spindle_rpm = std::min(tool.max_rpm, job.machine.max_rpm);
    return cut;
}

CutSegment slot_cut(const Job& job, const Tool& tool, double depth_mm) {
    CutSegment cut = idle_cut(job, tool);
    cut.chip_load_mm = std::min(tool.max_feed, job.machine.max_feed) / (cut.spindle_rpm * tool.flutes);
    cut.high_mm = depth_mm;
    cut.arc = engagement_arc(cut.radius_mm, tool.diameter, MillingSense::up);
    return cut;
}

CutSegment hardest_cut(const Job& job, const Tool& tool, double depth_mm) {
    CutSegment cut = slot_cut(job, tool, depth_mm);
    if (!has_ball_tip(tool.kind)) return cut;
    cut.chip_load_mm = std::min({tool.max_feed, job.machine.max_feed, job.cutting.finish_feed}) /
                       (cut.spindle_rpm * tool.flutes);
    cut.arc = engagement_arc(radius_at(cut, depth_mm), job.cutting.wall_allowance + job.tolerances.rough_cusp,
                             MillingSense::up);
    return cut;
}

}  // namespace slabwright
