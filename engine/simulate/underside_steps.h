// What the steps that mill slabs from below must say, and what the build asks of them.
#pragma once

#include "engine/simulate/probe_steps.h"

namespace slabwright {

/// The part of the replay that knows undersides. Each is milled by a sequence of its own; here it counts that
/// this was done, in the time that the plan states, and that the slab was turned.
class UndersideSteps : public ProbeSteps {
protected:
    UndersideSteps(const BuildPlan& plan, const std::vector<SequenceStep>& steps, BuildState from)
        : ProbeSteps(plan, steps, std::move(from)) {
        s_.undersides_milled.resize(plan.undersides.size());
        s_.slabs_turned.resize(plan.undersides.size());
    }

    /// Seconds that only the job can tell.
    void expect_job_seconds(double planned) {
        if (plan_.job_stated) expect_seconds(planned, kSeconds);
    }

    /// A slab lies upside down on a spoil board and is milled by a sequence of its own.
    void mill_underside();
    void turn_over();
    /// An upside-down slab is held on its board for as long as it is milled.
    void hold_down();
    /// The step presupposes that all undersides are milled and their slabs turned.
    void require_all_turned();
    /// The same of a layer's, where that has one. @param layer index as the plan states it
    void require_turned(int layer);
    /// Tells the undersides that were not milled, or whose slabs were not turned.
    void check_undersides_at_end();

private:
    /// Which of the plan's undersides the step is about; none, and told, where it is about no such.
    [[nodiscard]] std::optional<std::size_t> named_underside();
};

}  // namespace slabwright
