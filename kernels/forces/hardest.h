// Which of many cuts are the hardest, group by group: a device looks at all of them, the double model decides.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "kernels/forces/forces.h"

namespace slabwright {

/// Indices into the cuts: of the largest peak resultant, of the largest force in the plane, and of the largest across the way (y). The
/// first of equals; kNoCut in an empty group.
struct HardestCuts {
    std::size_t resultant, in_plane, across;
    friend bool operator==(const HardestCuts&, const HardestCuts&) = default;
};
inline constexpr std::size_t kNoCut = static_cast<std::size_t>(-1);

struct HardestSearch {
    std::vector<HardestCuts> groups;
    std::string device;  ///< that looked at them; "" when there were too few to ask one
    std::string note;    ///< why none did though there were enough; "" else
};

/// What a device must save before it is started, seconds of one thread in the double model: compiling the kernel takes PoCL 0.8 s
/// the first time and 0.1 s after that.
inline constexpr double kDeviceWorthSeconds = 1.0;

/// The hardest cuts of groups [starts[g], starts[g + 1]), by the closed form (flat) and the reference (ball) at kForceAccuracy. From
/// `worth_seconds` of work on, cuts are screened by a ForceSolver: as its forces are within 1e-4 of a cut's peak resultant, only cuts that near to
/// the largest are asked again in double precision, and the answer is the same on every device and without one.
/// @param starts ascending, from 0 to cuts.size()
/// @param device as for ForceSolver
/// @throws Error(usage, "forces.segment") naming the first bad cut; Error(usage, "forces.device"); Error(cancelled)
[[nodiscard]] HardestSearch hardest_cuts(Context& context, std::span<const CutSegment> cuts, std::span<const std::size_t> starts,
                                         const std::string& device = {}, double worth_seconds = kDeviceWorthSeconds);

}  // namespace slabwright
