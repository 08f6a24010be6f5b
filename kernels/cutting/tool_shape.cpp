#include "kernels/cutting/tool_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "kernels/errors.h"

namespace slabwright {

void check_tool_shape(const ToolShape& tool) {
    auto require = [](bool good, const char* what) {
        if (!good)
            throw Error(ErrorKind::usage, "tool.shape", what, "tool shape", "correct the tool's measures");
    };
    const Envelope under = under_side(tool.cutter);
    if (tool.cutter.form() == CutterForm::cone) refuse_form(tool.cutter.form(), "what it reaches");
    for (const double length : {tool.flute_length, tool.shank_radius, tool.stickout, tool.holder_radius})
        require(std::isfinite(length) && length >= 0, "a measure of the tool is negative or not finite");
    require(tool.flute_length == 0 || tool.flute_length >= under.rounding * (1 - under.sin_taper),
            "the flutes end below the top of the tip's rounding");
}

double Envelope::height(double distance) const {
    if (distance > radius) return std::numeric_limits<double>::infinity();
    const double x = distance - core;
    if (x <= 0) return low;
    if (x <= rounding * cos_taper)
        return low + rounding - std::sqrt(std::max(0.0, rounding * rounding - x * x));
    if (sin_taper <= 0) return low + rounding;
    return low + rounding * (1 - sin_taper) + (x - rounding * cos_taper) * cos_taper / sin_taper;
}

double Envelope::slope(double distance) const {
    const double x = distance - core;
    if (x <= 0) return 0;
    if (x < rounding * cos_taper) return x / std::sqrt(rounding * rounding - x * x);
    return sin_taper > 0 ? cos_taper / sin_taper : std::numeric_limits<double>::infinity();
}

double Envelope::width(double height) const {
    const double over = height - low;
    if (!(over >= 0)) return -1;
    const double top_of_rounding = rounding * (1 - sin_taper);
    if (over < top_of_rounding) return core + std::sqrt(over * (2 * rounding - over));
    if (sin_taper <= 0) return radius;
    return std::min(radius, core + rounding * cos_taper + (over - top_of_rounding) * sin_taper / cos_taper);
}

// Depth is the distance from the surface: the rounding shrinks, and once it is used up the disc does. Where a
// flank stands on a disc, its offset meets the raised floor nearer to the axis.
Envelope Envelope::eroded(double depth) const {
    Envelope e = *this;
    e.low += depth;
    e.radius -= depth;
    if (depth <= rounding) {
        e.rounding -= depth;
    } else {
        e.rounding = 0;
        e.core -= (depth - rounding) * (1 - sin_taper) / cos_taper;
        if (e.core < 0) {
            // The offset flanks meet over the axis, above the floor.
            if (sin_taper > 0) e.low += -e.core * cos_taper / sin_taper;
            else e.radius = -1;
            e.core = 0;
        }
    }
    return e;
}

Envelope under_side(const CutterShape& cutter) {
    const bool has_sense = std::isfinite(cutter.radius) && cutter.radius > 0 && cutter.corner >= 0 &&
                           cutter.corner <= cutter.radius && cutter.taper_rad >= 0 &&
                           cutter.taper_rad < std::numbers::pi / 2;
    if (!has_sense)
        throw Error(ErrorKind::usage, "tool.shape", "radius, corner and taper make no cutter", "tool shape",
                    "correct the tool's measures");
    Envelope under;
    under.radius = cutter.radius;
    under.rounding = cutter.corner;
    if (cutter.taper_rad > 0) {
        under.sin_taper = std::sin(cutter.taper_rad);
        under.cos_taper = std::cos(cutter.taper_rad);
    } else {
        under.core = cutter.radius - cutter.corner;
    }
    return under;
}

std::vector<Envelope> envelopes(const ToolShape& tool) {
    check_tool_shape(tool);
    Envelope cutter = under_side(tool.cutter);
    if (cutter.sin_taper > 0 && tool.flute_length > 0) {
        // The flank ends with the flutes, if it is not as wide as the cutter before.
        const double above = tool.flute_length - cutter.rounding * (1 - cutter.sin_taper);
        cutter.radius = std::min(
            cutter.radius, cutter.rounding * cutter.cos_taper + above * cutter.sin_taper / cutter.cos_taper);
    }
    std::vector<Envelope> parts{cutter};
    auto above = [&](double from, double radius) {
        if (from > 0 && radius > parts.back().radius) {
            Envelope disc;
            disc.low = from;
            disc.core = disc.radius = radius;
            parts.push_back(disc);
        }
    };
    above(tool.flute_length, tool.shank_radius);
    above(tool.stickout, tool.holder_radius);
    for (const ToolShape::Disc& disc : tool.holder) above(disc.height, disc.radius);
    return parts;
}

}  // namespace slabwright
