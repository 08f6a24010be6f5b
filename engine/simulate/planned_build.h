// What a plan asks of its build, slab by slab: where each lies, what it weighs, where the machine stands for
// it.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "engine/simulate/build_replay.h"
#include "engine/simulate/build_state.h"

namespace slabwright {

/// A slab of the build.
struct DueSlab {
    std::size_t layer = 0;               ///< index into the layers
    int number = 0;                      ///< within its layer, from 0
    double thickness = 0, z_bottom = 0;  ///< mm, pattern-base
    Blank blank{};                       ///< what it covers
    double kg = 0;
    std::size_t glue = 0;  ///< which of the sequence's: those under layers first, then those between slabs
};

class PlannedBuild {
public:
    /// @param plan has a layer, and outlives this
    explicit PlannedBuild(const BuildPlan& plan);

    [[nodiscard]] const std::vector<DueSlab>& slabs() const { return slabs_; }  ///< bottom up
    /// No sequence of this build has more: of slabs and programs, and again for each layer made again.
    [[nodiscard]] std::size_t most_steps() const;
    /// kg of a base board of this thickness, mm.
    [[nodiscard]] double board_mass(double thickness) const;
    /// The joint under a slab.
    [[nodiscard]] PlannedJoint joint_of(const DueSlab& slab) const;
    /// Where a layer's programs have their z = 0, mm, pattern-base.
    [[nodiscard]] double origin_of(std::size_t layer) const;
    /// Where the pattern's bottom stands while a layer is cut, mm, from where the programs' z = 0 is in the
    /// first layer. A table that moves brings each layer's top to one height.
    [[nodiscard]] double bottom_at(std::size_t layer) const;
    /// Where a slab's edges of least x and y must be found, as the programs count: what a touch_off says.
    [[nodiscard]] std::array<std::pair<const char*, double>, 2> edges_of(const DueSlab& slab) const;
    /// x and y of what a probing program touches, and z that the tip then has, as the programs count, mm.
    /// @param top of the stack then, mm, pattern-base
    [[nodiscard]] std::array<double, 3> probed_at(const DueSlab& slab) const;
    /// Whether the programs do not count x and y as the model does; a sequence must tell the edges then.
    [[nodiscard]] bool has_own_zero() const { return plan_.zero != std::array<double, 2>{}; }
    [[nodiscard]] const Tool* tool_of(int number) const;
    /// Whether the control keeps tools' lengths; else each change of a tool is a touch-off.
    [[nodiscard]] bool keeps_lengths() const { return knows_tool_lengths(plan_.job.machine.post); }

    /// The layer whose slabs are all placed and pressed and that lies on top; none while one is missing.
    [[nodiscard]] std::optional<std::size_t> whole_layer(const BuildState& state) const;
    /// The stack's top, mm, pattern-base: of raw slabs until the layer is faced; 0 on the bare board.
    [[nodiscard]] double stack_top(const BuildState& state) const;

private:
    const BuildPlan& plan_;
    std::vector<DueSlab> slabs_;
};

}  // namespace slabwright
