// Which of many cuts are the hardest, group by group: a device looks at all of them, the double model
// decides.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "kernels/forces/forces.h"

namespace slabwright {

/// Indices into the cuts: of the largest peak resultant, of the largest force in the plane, of the largest
/// across the way (y), of the largest peak torque, and of the largest mean power. The first of equals; kNoCut
/// in an empty group.
struct HardestCuts {
    std::size_t resultant, in_plane, across, torque, power;
    [[nodiscard]] std::array<std::size_t, 5> all() const {
        return {resultant, in_plane, across, torque, power};
    }
    friend bool operator==(const HardestCuts&, const HardestCuts&) = default;
};
inline constexpr std::size_t kNoCut = static_cast<std::size_t>(-1);

struct HardestSearch {
    std::vector<HardestCuts> groups;
    std::string device;  ///< that looked at them; "" when there were too few to ask one
    std::string note;    ///< why none did though there were enough; "" else
};

/// What a device must save before it is started, seconds of one thread in the double model: compiling the
/// kernel takes PoCL 0.8 s the first time and 0.1 s after that.
inline constexpr double kDeviceWorthSeconds = 1.0;

/// Opens a solver beside the work that finds out what it will be asked: a driver whose libraries no program
/// has read lately makes one wait for half a second of reading.
class SolverAhead {
public:
    explicit SolverAhead(Context& context, double worth_seconds = kDeviceWorthSeconds);
    ~SolverAhead();  ///< waits for what is being opened
    SolverAhead(const SolverAhead&) = delete;
    SolverAhead& operator=(const SolverAhead&) = delete;

    /// Some of the cuts that are to come; from the first on with which all that are expected take the double
    /// model `worth_seconds`, a solver for the context's device is opened, unless that is "reference". Any
    /// thread may call it.
    void expect(std::span<const CutSegment> cuts);
    /// The solver that is open then; none where it is not worth one. @throws as ForceSolver does
    [[nodiscard]] ForceSolver* solver();

private:
    Context& context_;
    const double worth_seconds_;
    std::mutex mutex_;
    std::uint64_t flats_ = 0, balls_ = 0;
    std::future<std::unique_ptr<ForceSolver>> opening_;
    std::unique_ptr<ForceSolver> solver_;
};

/// The hardest cuts of groups [starts[g], starts[g + 1]), by the closed form (flat) and the reference (ball)
/// at kForceAccuracy. A solver with a device screens them: as its forces are within 1e-4 of a cut's peak
/// resultant, only cuts that near to the largest are asked again in double precision, and the answer is the
/// same on every device and without one.
/// @param starts ascending, from 0 to cuts.size()
/// @param solver none: the double model alone
/// @throws Error(usage, "forces.segment") naming the first bad cut; Error(usage, "forces.device");
/// Error(cancelled)
[[nodiscard]] HardestSearch hardest_cuts(Context& context, std::span<const CutSegment> cuts,
                                         std::span<const std::size_t> starts, ForceSolver* solver);

}  // namespace slabwright
