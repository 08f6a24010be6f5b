// What the steps that find z = 0 by a program must say, and what of the machine they ask.
#pragma once

#include "engine/simulate/glue_steps.h"

namespace slabwright {

/// The part of the replay that knows probing programs.
class ProbeSteps : public GlueSteps {
protected:
    ProbeSteps(const BuildPlan& plan, const std::vector<SequenceStep>& steps, BuildState from)
        : GlueSteps(plan, steps, std::move(from)), list_(steps) {}

    /// The step presupposes what `cause` brought about; without it, the machine is not in a state for the
    /// step.
    void require(Cause cause, const char* lacking) {
        if (!cause) complain("sequence.order", lacking);
        else wait_for(cause);
    }

    /// A program finds z = 0 in place of the operator.
    void probe();
    /// At a change of tool on a control that keeps no lengths: the operator touches the new tip off, or a
    /// probing program follows, and until then z = 0 is not known.
    void find_length();
    /// Whether a probing program comes before any other.
    [[nodiscard]] bool is_for_probe() const;
    /// Whether a probing program is run with a tool.
    [[nodiscard]] bool probes_with(int tool) const;

private:
    const std::vector<SequenceStep>& list_;
};

}  // namespace slabwright
