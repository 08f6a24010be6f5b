// What the steps of the material handler and the glue head must say, and what of the machine they ask.
#pragma once

#include "engine/simulate/program_steps.h"

namespace slabwright {

/// The part of the replay that knows handler and glue head. The beads are held against the joint's own loops,
/// row by row; glue, pump, places and times follow from the beads that are stated.
class GlueSteps : public ProgramSteps {
protected:
    GlueSteps(const BuildPlan& plan, const std::vector<SequenceStep>& steps, BuildState from)
        : ProgramSteps(plan, steps, std::move(from)) {}

    /// Whether the machine carries slabs, as far as the plan states its job.
    [[nodiscard]] bool handled() const { return plan_.job_stated && has_handler(plan_.job.machine); }
    /// Who glues; none where the plan does not state its job.
    [[nodiscard]] GlueHead head() const {
        return plan_.job_stated ? glue_head_of(plan_.job.machine) : GlueHead::none;
    }

    /// The handler goes to a place, mm; the step says where and how long.
    void move_handler(double to);
    /// What a load_feed says of its slabs, from the top. @param slabs that it loads
    void check_pile(std::span<const DueSlab> slabs);
    /// What a glue step says of its head: side, beads on this joint's loops, their glue, pump and time.
    void check_beads(const StatedGlue& joint);

    /// Those that a slab is laid on.
    [[nodiscard]] std::span<const JointDowel> dowels_of(const DueSlab& slab) const;
    /// What a set_dowels says: how many, their size, how deep the slab's own holes are, and how long it
    /// takes.
    void check_dowels(const DueSlab& slab);

private:
    using Bead = std::array<double, 3>;  // y, x from and to
    void check_cover(const StatedGlue& joint);
    /// The step's place of the handler.
    void check_place(double planned);
    /// @returns mm/min along the beads
    double check_pump(const std::vector<Bead>& beads, double length);
};

}  // namespace slabwright
