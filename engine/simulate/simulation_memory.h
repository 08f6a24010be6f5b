// What of one simulation holds for another of the same part, slabs and tools, where some programs are other:
// what is the same to the last digit has been simulated already.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "engine/simulate/core_contact.h"
#include "engine/simulate/simulate.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

/// The least box over some places, mm.
struct StepBox {
    double x0 = kUnbounded, y0 = kUnbounded, x1 = -kUnbounded, y1 = -kUnbounded, z0 = kUnbounded,
           z1 = -kUnbounded;
    void add(const ProgramStep& s) {
        x0 = std::min(x0, s.x), x1 = std::max(x1, s.x);
        y0 = std::min(y0, s.y), y1 = std::max(y1, s.y);
        z0 = std::min(z0, s.z), z1 = std::max(z1, s.z);
    }
    /// A level arc goes farthest where it crosses the axes through its centre.
    void add(const ProgramArc& a);
    void add(const StepBox& b) {
        x0 = std::min(x0, b.x0), x1 = std::max(x1, b.x1);
        y0 = std::min(y0, b.y0), y1 = std::max(y1, b.y1);
        z0 = std::min(z0, b.z0), z1 = std::max(z1, b.z1);
    }
    /// Whether it comes within `margin` mm of a grid's cells, seen from above, and below `top`.
    [[nodiscard]] bool meets(const CellGrid& g, double margin, double top) const {
        return z0 < top && x0 - margin <= g.x(g.nx - 1) && g.x0 <= x1 + margin &&
               y0 - margin <= g.y(g.ny - 1) && g.y0 <= y1 + margin;
    }
};

/// What one tile of the stock contributes to a program's and a layer's findings.
struct TileProgram {
    double removed = 0;
    double lowest = kUnbounded, stock_top = -kUnbounded;
    double top_after = -kUnbounded;  ///< z of the highest stock when it has run
    Extreme rapid, over_flute, deepest, shank, holder;
    std::uint32_t rapid_line = 0, over_flute_line = 0, deepest_line = 0, shank_line = 0, holder_line = 0;
    double most = 0;  ///< mm that any cell lost
    CoreContact::Findings core;
    std::vector<FaultyMotion> faults;
};
struct TileLayer {
    LayerFindings findings;
    double squares = 0;
};
struct TileResult {
    std::vector<TileProgram> programs;
    std::vector<TileLayer> layers;
    double board_cut = 0;
    std::uint64_t pattern_cells = 0;  ///< that have part at any height
    Extreme flask;
};

/// What a program's motions were found to do without any stock.
struct CheckedProgram {
    ProgramFindings findings;
    StepBox box;
};

/// Handed from one simulate() to the next. The caller gives back the programs that were simulated.
struct SimulationMemory {
    std::vector<Program> programs;  ///< of the simulation before; empty: nothing is known
    SimulationInput stage;          ///< its stock, layers, tools and machine; no mesh, no programs
    SimulationOptions options;
    double cell = 0;
    std::vector<CheckedProgram> checked;  ///< by program
    std::vector<TileResult> tiles;
};

/// How the programs of a simulation follow from those of the one before.
class ProgramChanges {
public:
    /// @param before the programs of the memory. @param now those that are to be simulated, layers ascending
    ProgramChanges(const std::vector<Program>& before, const std::vector<Program>& now);

    /// The program that this one was, if it was one.
    [[nodiscard]] std::optional<std::size_t> before(std::size_t program) const { return was_[program]; }
    /// Whether it is what it was in every value.
    [[nodiscard]] bool is_same(std::size_t program) const { return same_[program] != 0; }
    /// Whether any step that is other, or was, comes within `margin` mm of a grid's cells. What a program
    /// took nothing with there does not count where the program is gone.
    /// @param tile the findings before
    [[nodiscard]] bool touch(const CellGrid& grid, double margin, const TileResult& tile) const;
    /// A tile's findings that were made before, as those of the programs now: their lines are those of the
    /// same steps now; of a program that was not there before, nothing. None where a line is told whose step
    /// is gone.
    [[nodiscard]] std::optional<TileResult> translated(const TileResult& tile) const;

private:
    using Lines = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  // before and now, ascending
    void add_range(const Program& program, std::size_t first, std::size_t last);
    void compare(const Program& before, const Program& now, Lines& lines);
    std::vector<std::optional<std::size_t>> was_;
    std::vector<char> same_;
    std::vector<Lines> lines_;
    std::vector<StepBox> changed_;
    std::vector<std::pair<std::size_t, StepBox>> gone_;  // programs of before
    std::size_t programs_before_ = 0;
};

/// Whether what a memory holds was found with this stage and these options.
[[nodiscard]] bool is_of(const SimulationMemory& memory, const SimulationInput& input,
                         const SimulationOptions& options, double cell);

}  // namespace slabwright
