// What a proof has found wrong goes back into the layers that it was found in, and only these are planned
// again (METHOD.md section 14).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/mend/faults.h"
#include "engine/plan.h"
#include "kernels/access/standing_part.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct JointWood;
struct StandingFoot;

/// How often a plan is proven again after its layers were mended, at most.
inline constexpr int kProofRounds = 4;

/// Mends the layers of one plan, round after round. What it borrows outlives it.
class Replanner {
public:
    /// @param pattern that was planned, pattern-base. @param part of it
    Replanner(Context& context, MeshView pattern, const StandingPart& part);
    ~Replanner();
    Replanner(const Replanner&) = delete;
    Replanner& operator=(const Replanner&) = delete;

    /// One round: the layers with faults get other programs (mend_layer), with feeds that their forces bear;
    /// sequence and totals follow. Each layer's round is told in a diagnostic "proof.round" and counted in
    /// Layer::rounds.
    /// @param faults ascending by layer. @param round 1 …
    /// @returns for each layer whether its programs, or what they say of themselves, are other now; empty:
    /// nothing is known that would help
    /// @throws as make_plan, of what the other programs make of joints, travel and mass
    std::vector<bool> mend(Plan& plan, std::span<const LayerFaults> faults, int round);

private:
    Context& context_;
    MeshView pattern_;
    const StandingPart& part_;
    std::optional<std::vector<std::vector<JointWood>>> joints_;  // once they are needed
    std::vector<std::vector<StandingFoot>> feet_;                // with them
};

}  // namespace slabwright
