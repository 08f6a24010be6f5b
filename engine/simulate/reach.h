// What no tool of the library reaches: computed by the simulator alone, from the part and the tools.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "engine/job.h"
#include "kernels/access/standing_part.h"

namespace slabwright {

/// Decides, for points of air over a layer's finished surface, whether some flat or ball end mill of the
/// library can cover them without touching the part (below z_top), the holder included. Borrows the part. It
/// remembers places and obstacles that it has met, which makes neighbouring points cheap: one object serves
/// one thread.
class Reach {
public:
    /// mm: a point that a tool this much thicker could cover is always called reachable.
    static constexpr double kResolution = 0.005;
    /// mm: a tool may touch the part, and this much is touching; no point out of reach by more than twice
    /// this is called reachable.
    static constexpr double kTouch = 1e-4;

    /// @param z_bottom the layer's bottom; flat end mills stop there, ball end mills may pass it by their
    /// radius, but no tip
    ///        goes below `lowest` (the base board's limit)
    Reach(const StandingPart& part, const std::vector<Tool>& tools, double z_bottom, double z_top,
          double lowest);

    /// A tool with a place of its tip, mm, where it covers a point.
    struct Covering {
        int tool = 0;  ///< Tool::number
        Point3 tip{};
    };
    /// A tool and a place that cover the point; none where no tool does. As exact as reachable().
    [[nodiscard]] std::optional<Covering> covering(const Point3& point);

    /// Whether a tool covers the point. Exact but for kResolution and kTouch: a branch and bound over all of
    /// the tool's places.
    [[nodiscard]] bool reachable(const Point3& point);

private:
    class Search;
    struct Place {
        std::size_t tool;
        Point3 centre;
    };
    /// What one tool can do at a point: cover it, cover it but for its shank or holder (or nobody knows), or
    /// not even so.
    enum class Found { covers, held, blocked };
    [[nodiscard]] Found by(std::size_t tool, const Point3& point);
    [[nodiscard]] bool holder_free(std::size_t tool, const Point3& tip) const;
    void remember(const Point3& obstacle);

    const StandingPart& part_;
    std::vector<Tool> tools_;                      ///< smallest first; a tapered ball as the ball of its tip
    std::vector<std::vector<ToolSection>> above_;  ///< of each what is wider over it
    double z_bottom_, z_top_, lowest_;
    std::vector<Place> places_;      ///< free ones, found lately
    Place found_{};                  ///< by which the last point asked for is reachable
    std::vector<Point3> obstacles_;  ///< points with part at or above them, met lately
    std::size_t next_place_ = 0, next_obstacle_ = 0;
};

}  // namespace slabwright
