// What no tool of the library reaches: computed by the simulator alone, from the part and the tools.
#pragma once

#include <vector>

#include "engine/job.h"
#include "kernels/access/standing_part.h"

namespace slabwright {

/// Decides, for points of air over a layer's finished surface, whether some flat or ball end mill of the library can cover
/// them without touching the part (below z_top), the holder included. Const functions may be called from many threads.
class Reach {
public:
    /// @param bottom the layer's bottom; flat end mills stop there, ball end mills may pass it by their radius, but no tip
    ///        goes below `lowest` (the base board's limit)
    Reach(const StandingPart& part, const std::vector<Tool>& tools, double z_bottom, double z_top, double lowest);

    /// True when a place for a tool was found. The search projects in turn onto "covers the point" and "clear of the part",
    /// from several starts; where the free space is contorted it may fail to find a place that exists.
    [[nodiscard]] bool reachable(const Point3& point) const;

private:
    [[nodiscard]] bool by(const Tool& tool, const Point3& point) const;
    const StandingPart& part_;
    std::vector<Tool> tools_;  ///< smallest first
    double z_bottom_, z_top_, lowest_;
};

}  // namespace slabwright
