// What a cut does to its cutter, to the spindle and to the wood that carries it (METHOD.md sections 8 and 9).
#pragma once

#include <map>
#include <optional>
#include <shared_mutex>

#include "engine/forces/cut_class.h"
#include "engine/job.h"
#include "engine/plan.h"
#include "kernels/forces/forces.h"

namespace slabwright {

inline constexpr double kStatedAccuracy = 1e-5;  ///< of the peaks that a plan states

/// The forces of a cut at the accuracy of a plan: closed form (flat) or reference (ball).
/// @throws Error(usage, "forces.segment")
[[nodiscard]] SegmentForces stated_forces(const CutSegment& cut);

struct Bent {
    double wall_mm = 0;                ///< of the tip, normal to the way
    double stress_mpa = 0;             ///< of the cutter, in bending at the holder
    double x_n = 0, y_n = 0, z_n = 0;  ///< peaks
    double in_plane_n = 0;             ///< peak: what pushes at a wall
    double torque_nmm = 0;             ///< peak over a turn
    double power_w = 0;                ///< mean over a turn
};

/// What these forces do. @param across_n the force that bends the tip normal to the way
[[nodiscard]] Bent bent_by(const SegmentForces& forces, double across_n, const Tool& tool);

/// What a cut bears as a share of its limits, the largest: the wall's error against `limit` (mm), the
/// cutter's stress where its strength is stated, the spindle's torque and power where the machine's are.
[[nodiscard]] double share_of_limits(const Bent& bent, double limit, const Tool& tool, const Job& job);

/// What the cuts of several layers bear, by tool and speed. Several threads may use it at once.
class SharedBents {
public:
    /// A tool at a speed, whose cuts are classed finely or coarsely.
    struct Of {
        int tool = 0;
        double spindle_rpm = 0;
        bool fine = false;
        auto operator<=>(const Of&) const = default;
    };
    [[nodiscard]] std::optional<Bent> find(const Of& of, const ClassAndFeed& key);
    void add(const Of& of, const ClassAndFeed& key, const Bent& bent);

private:
    std::shared_mutex mutex_;
    std::map<Of, ByClassAndFeed<Bent>> known_;
};

/// What the cuts of one operation's cutter bear. One thread.
class BentCutter {
public:
    /// @param shared of this very plan, or null. All that it borrows outlives it.
    BentCutter(const Job& job, const Operation& operation, const Tool& tool, SharedBents* shared);
    [[nodiscard]] const CutSegment& idle() const { return idle_; }

    /// Of a coarse class, to 1 %. @param feed mm/min
    [[nodiscard]] const Bent& at(const CutClass& c, double feed) { return find(known_, c, feed, false); }
    /// Of a fine class, as the plan will state it.
    [[nodiscard]] const Bent& stated(const CutClass& c, double feed) { return find(stated_, c, feed, true); }
    /// How thick the wood must be that carries a cut at this height above the joint, so far from what carries
    /// the wood, mm.
    [[nodiscard]] double needed_wood(const Bent& b, double height, double overhang) const;

    /// The thickest chip of a coarse class, as a share of the feed per tooth.
    [[nodiscard]] double thickest_chip(const CutClass& c) const;

    [[nodiscard]] double share(const Bent& bent, double limit) const {
        return share_of_limits(bent, limit, tool_, job_);
    }

private:
    using Known = ByClassAndFeed<Bent>;
    const Bent& find(Known& known, const CutClass& c, double feed, bool fine);

    const Job& job_;
    const Tool& tool_;
    SharedBents* shared_;
    CutSegment idle_;
    Known known_, stated_;
};

}  // namespace slabwright
