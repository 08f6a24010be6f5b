// The exact check: how deep does any motion of a program take its cutter into the part? No grid, no sampling;
// nothing of it is shared with the code that plans paths.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/simulate/program.h"
#include "kernels/access/standing_part.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The deepest place of one kind in one program.
struct GougePlace {
    double depth = 0;  ///< mm along the surface normal; 0: none above `ignore`
    std::uint32_t line = 0;
    Point3 tip{};
};

struct GougeReport {
    GougePlace cutter;           ///< of the cutting part
    GougePlace shank, holder;    ///< of what follows it upwards, where that is thicker
    std::uint64_t gouges = 0;    ///< motions whose cutter is deeper in the part than the tolerance
    std::uint64_t contacts = 0;  ///< motions whose shank or holder is
    std::uint64_t motions = 0;   ///< looked at
    double length_mm = 0;        ///< of them
    /// Lines of these gouges and contacts, ascending, each once.
    std::vector<std::uint32_t> gouge_lines, contact_lines;
};

struct GougeOptions {
    double tolerance = 0.01;  ///< mm
    double ignore = 1e-5;     ///< mm: depths up to this are not looked for
};

/// A tool that holds another, moved by up to `by` (mm) any way across its axis.
[[nodiscard]] Tool wider(const Tool& tool, double by);

/// Checks every motion, feed or rapid, from known place to known place. The error of a depth is at most
/// StandingPart::kSheet under the layer's top and StandingPart::kNumericalError elsewhere, and more by
/// Program::arc_error where arcs are. A drill that goes straight up or down is
/// checked with its point; on any other way as a cylinder of its diameter, which can only overstate. All
/// other cutters are checked in their own form, and shank and holder with the cylinders and cones they are
/// made of.
[[nodiscard]] GougeReport check_gouge(Context& context, const StandingPart& part, double z_top,
                                      const Tool& tool, const Program& program,
                                      const GougeOptions& options = {});

}  // namespace slabwright
