// Which tool would reach what no tool of the library reaches (METHOD.md section 6): its size, what it would
// gain and what it would cost.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/simulate/simulate.h"

namespace slabwright {

/// What keeps the library's tools away from most of what a missing tool would reach.
enum class OutOfReach : std::uint8_t {
    radius,  ///< they are too thick
    length   ///< as thick as they are they would reach it, but shank or holder meet the part
};
[[nodiscard]] const char* name(OutOfReach reason);  ///< "radius", "length"

/// A tool that a shop can buy, which reaches some of it.
struct MissingTool {
    Tool tool;  ///< of kind flat or ball, number 0
    double gain_mm2 =
        0;  ///< seen from above: what this tool alone, added to the library, brings within limits
    double depth_mm = 0;  ///< the most that is left there now, along the normal
    Point3 where{};       ///< there
    double minutes = 0;   ///< what it would take, estimated
    OutOfReach reason{};
    std::vector<int> layers;  ///< in which it gains, from 0
};

struct MissingToolOptions {
    bool inch = false;             ///< sizes of inch catalogues, else of metric ones
    double limit = 0.09;           ///< mm that may be left: cusp + slack
    double board_cut = -1;         ///< as SimulationOptions
    double holder_clearance = 5;   ///< Cutting::holder_clearance
    double vertical_rad = 1.5708;  ///< Cutting::vertical_deg
    double cusp = 0.04;            ///< mm that finish passes may leave
    double bends = 0.04;           ///< mm that a cutter may bend
    Material material;             ///< whose edge forces are used
};

/// Up to ten tools, the one that gains most first. Each gains at least 2 % more than every thicker one of its
/// kind; thicker and shorter ones are named where they do. Flutes are long enough that no layer becomes
/// thinner for the tool's sake, and at most twelve diameters.
/// @param report of a simulation of this input: its LayerFindings::unreached
/// @param part of the input's mesh
/// @throws Error(no_plan, "memory.limit"), Error(cancelled)
[[nodiscard]] std::vector<MissingTool> missing_tools(Context& context, const SimulationInput& input,
                                                     const SimulationReport& report, const StandingPart& part,
                                                     const MissingToolOptions& options);

}  // namespace slabwright
