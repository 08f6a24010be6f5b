// What every part of a simulation looks at: the input, the part, the cells, and each program with what a tile
// needs to skip most of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/simulate/simulate.h"
#include "engine/simulate/simulation_memory.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"
#include "kernels/stock/stock.h"

namespace slabwright {

constexpr std::size_t kBlockSteps = 128;  // of a program under one box
constexpr std::size_t kPartSteps = 16;    // of a block
constexpr double kTaken = 0.002;          // mm: less is rounding of the text and of the stock's float
constexpr double kDeeper = 0.05;          // mm by which a roughing cut may pass its planned step
constexpr double kStanding = 0.01;        // mm by which shank or holder must reach into stock to be reported

/// A program with what a tile needs to skip most of it.
struct PreparedProgram {
    const Program* program = nullptr;
    const Tool* tool = nullptr;  ///< null: the plan's library does not hold it
    CutterEnd end;
    double cut_mm = 0;                   ///< of feed motions, seen from above
    std::vector<StepBox> blocks, parts;  ///< of kBlockSteps and kPartSteps steps
};

/// A layer's flask with the tolerances of its walls: nothing of the core may be lost, nothing need be gone
/// within the border.
struct KeptFlask {
    Loops core, border;
};

struct SimulationStage {
    Context& context;
    const SimulationInput& input;
    const StandingPart& part;
    SimulationOptions options;
    double cell = 1;     ///< mm
    int nx = 0, ny = 0;  ///< cells of the stock
    std::vector<PreparedProgram> programs{};
    std::vector<KeptFlask> flasks{};  ///< by layer

    /// Below which no tool goes in a layer, mm.
    [[nodiscard]] double lowest_tip(std::size_t layer) const;
};

/// The stage of an input, with its cells. Tools that the library lacks or that are not the planned ones are
/// told in the report.
/// @throws Error (usage, simulate.input) for an input that no plan means
[[nodiscard]] SimulationStage set_stage(Context& context, const SimulationInput& input,
                                        const StandingPart& part, const SimulationOptions& options,
                                        SimulationReport& report);

/// Keeps the greater; of two equal sizes the first stays, so that a result depends on the order of tiles
/// alone.
inline void raise(Extreme& a, double size, const Point3& where) {
    if (size > a.size) a = {size, where};
}
inline void raise(Extreme& a, std::uint32_t& line, const Extreme& b, std::uint32_t b_line) {
    if (b.size > a.size) a = b, line = b_line;
}

/// Adds a violation. @param program null: of the build as a whole
void violate(SimulationReport& report, const std::string& code, const std::string& message,
             const Program* program, std::uint32_t line, std::optional<Point3> where, double size,
             std::optional<std::size_t> layer = {});

}  // namespace slabwright
