// Choosing the tools of a layer and their stepdowns (LUO 5.5.2 and 5.5.3; METHOD.md section 7).
#pragma once

#include <functional>
#include <optional>

#include "engine/layer_job.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// AR of a tool: the share of the layer's surface that it reaches, up to 1.
using ReachRatio = std::function<double(const Tool&)>;

struct ToolChoice {
    LayerTools tools;
    LayerSelection record;
};

/// A set with the next wider ball of the library as finish tool, and its own where that does not reach; none
/// where there is no wider one.
[[nodiscard]] std::optional<LayerTools> with_wider_finish(const Job& job, LayerTools tools);

/// Whether the job's library leaves anything to choose: two flats or two balls, and not the fixed set by
/// order.
[[nodiscard]] bool selects_tools(const Job& job);

/// How far below a layer's bottom its cutters may reach, mm.
struct Overrun {
    double below = 0;  ///< into the layer below, whichever finish tool is chosen
    double board = 0;  ///< into the base board, under the first layer
};
[[nodiscard]] Overrun overrun_of(const Job& job);

/// LUO's four steps: the largest ball whose AR is at least the threshold, else the smallest; one flat where
/// every wall is upright; the largest flat that leaves no semi-rough area at some stepdown of its range, and
/// the largest such stepdown; a semi-roughing tool where a still larger flat then saves time, its change of
/// tool counted. Then the smaller tools for what all these leave. Where print only looks at one semi-roughing
/// tool after another, one is all that is chosen here.
/// @param layer all but its tools and floor_below
/// @param ratio asked for balls, from the largest down, and in an upright layer for flats; none: the share of
/// the sections' length that a
///        disc of the tool's radius touches (LayerVoxels::reached_share)
/// @throws Error(usage, "job.tool") when the library lacks a flat or a ball; Error(no_plan, "memory.limit"),
/// Error(cancelled)
[[nodiscard]] ToolChoice select_tools(Context& context, const LayerJob& layer, const ReachRatio& ratio = {});

/// Past print: sets with the same finish tool whose roughing cutter is wider, or as wide and goes deeper, the
/// widest first. Where one leaves something outside the finish tool's swath, with stairs no higher than that
/// one's radius allows at the least slope, a narrower flat follows: the widest of at most .7 of its width,
/// unless the finish tool is more than twice as wide.
/// @param layer as above
[[nodiscard]] std::vector<LayerTools> with_wider_rough(Context& context, const LayerJob& layer,
                                                       const LayerTools& tools);

/// Heights of the roughing levels, descending: even steps of at most `stepdown` down to every floor and to
/// the layer's bottom.
[[nodiscard]] std::vector<double> even_levels(double z_top, double z_bottom, std::span<const double> floors,
                                              double stepdown);

}  // namespace slabwright
