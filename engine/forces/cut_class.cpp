#include "engine/forces/cut_class.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

namespace {

double depth_of(int depth, ClassSteps steps) {
    return kLeastDepth * std::exp2(static_cast<double>(depth) / steps.depth);
}

}  // namespace

CutClass class_of(const CutStretch& s, const Tool& tool, ClassSteps steps) {
    CutClass c;
    const double r = tool.diameter / 2;
    if (has_ball_tip(tool.kind))
        c.low = static_cast<std::int16_t>(std::floor(std::min(s.low, r) / r * steps.low));
    const double low = c.low * r / steps.low,
                 depth = std::clamp(s.high - low, kLeastDepth, 30 * tool.diameter);
    c.depth = static_cast<std::int16_t>(std::ceil(std::log2(depth / kLeastDepth) * steps.depth - 1e-9));
    // The class is deeper than the cut; its width is that of the same cross-section.
    const double width = s.width * (s.high - s.low) / (s.high - low);
    c.width = static_cast<std::int16_t>(std::clamp(std::ceil(width / tool.diameter * steps.width - 1e-9), 1.0,
                                                   static_cast<double>(steps.width)));
    c.left = s.left;
    return c;
}

CutClass shallower(CutClass c, int passes, ClassSteps steps) {
    c.depth = static_cast<std::int16_t>(std::max(0.0, c.depth - std::floor(steps.depth * std::log2(passes))));
    return c;
}

CutSegment segment_of(const CutClass& c, const CutSegment& idle, const Tool& tool, double feed,
                      ClassSteps steps) {
    CutSegment cut = idle;
    const double r = tool.diameter / 2;
    cut.low_mm = c.low * r / steps.low;
    cut.high_mm = cut.low_mm + depth_of(c.depth, steps);
    cut.arc = engagement_arc(radius_at(cut, cut.high_mm), c.width * tool.diameter / steps.width,
                             c.left ? MillingSense::up : MillingSense::down);
    cut.chip_load_mm = feed / (cut.spindle_rpm * tool.flutes);
    return cut;
}

}  // namespace slabwright
