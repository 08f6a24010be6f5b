// What each ball end mill would have to do where a layer slopes, before any path is laid.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/layer_job.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Of the surface of a layer that is neither level nor upright.
struct FinishWork {
    double contours_mm = 0;  ///< of level contours, on slopes from cutting.steep_limit_deg up
    double lines_mm = 0;     ///< of projected lines, on the others
    double left_mm2 = 0;     ///< where the ball, which would touch it, meets something else first
};

/// Measured at points that lie evenly on the surface, a few thousand at most; the same on any number of
/// threads.
/// @param layer all but its tools
/// @param solid of the layer's mesh, from its floor_below up
/// @throws Error(usage) as DropIndex
[[nodiscard]] FinishWork finish_work(Context& context, const LayerJob& layer, const LayerSolid& solid,
                                     const Tool& ball);

/// Whether no ball end mill of the job bends by more than the cusp by its edges alone, at its largest
/// stepdown. One that does goes in many passes, slowly: what it takes is not foreseen.
[[nodiscard]] bool finish_is_foreseeable(const Job& job);

/// Which of a job's ball end mills finishes a layer first, with what it leaves to narrower ones.
class ForeseenFinish {
public:
    /// @param layer all but its tools
    /// @param preferred a ball of the job's tools, where several take as long
    ForeseenFinish(Context& context, const LayerJob& layer, const Tool& preferred);

    /// The job's balls, the one that is foreseen to be the fastest first.
    [[nodiscard]] std::vector<Tool> ranked() const;
    /// None for a tool that is no ball of the job's.
    [[nodiscard]] std::optional<double> minutes(int tool) const;
    /// The ball that should take less than one with which the layer was planned, its pace given.
    /// @param done one of the job's balls
    /// @param share of the time of that one, which it should stay under
    /// @param tried numbers of balls that are not asked for any more
    [[nodiscard]] std::optional<Tool> better_than(const Tool& done, const LayerPace& pace, double share = 1,
                                                  std::span<const int> tried = {}) const;

private:
    struct Ball {
        Tool tool;
        FinishWork work;
        double minutes = 0;
    };
    std::vector<Ball> balls_;  // ranked
};

}  // namespace slabwright
