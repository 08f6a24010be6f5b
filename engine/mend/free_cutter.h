// Whether a tool is free of the part, by the very check that the proof makes.
#pragma once

#include "engine/job.h"
#include "kernels/access/standing_part.h"

namespace slabwright {

/// A tool over the part as it stands in one layer. Borrows the part. Const functions may be called from many
/// threads.
class FreeCutter {
public:
    /// @param wider mm by which cutter, shank and holder count as thicker on each side
    /// @param most  mm that a free tool may go into the part
    FreeCutter(const StandingPart& part, double z_top, const Tool& tool, double wider, double most);

    /// Whether the tip may go straight from one place to another, mm.
    [[nodiscard]] bool is_free(const Point3& from, const Point3& to) const;
    /// The least that the tool has to be raised over a place to be free there, mm, to within kLift and never
    /// less; 0 where it is free. It is free anywhere straight above.
    [[nodiscard]] double lift(const Point3& at) const;

    static constexpr double kLift = 0.002;

private:
    const StandingPart& part_;
    double z_top_, radius_, most_, lower_ = 0;  // lower_: mm that the thicker tip lies under the tool's
    CutterShape shape_;
    std::vector<ToolSection> cylinders_;  // as thick as they count
};

}  // namespace slabwright
