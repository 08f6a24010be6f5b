// The cutters of one layer and how deep they cut (LUO 5.5.3): which of the job's library does what.
#pragma once

#include <optional>
#include <vector>

#include "engine/job.h"

namespace slabwright {

/// The tools of one layer. Each is a copy of the library's, with the stepdown that this layer allows it as
/// stepdown_max.
struct LayerTools {
    Tool rough;  ///< flat or bull-nose: roughing, then floors, walls and the corners that the finish tool
                 ///< leaves
    std::vector<Tool>
        semi_rough;          ///< flat, none or one: level by level where the roughing cutter did not fit
    Tool finish;             ///< ball: slopes, and waste between walls before them
    std::vector<Tool> rest;  ///< flats, balls and tapered balls with falling tips: only where something is
                             ///< left that they reach
};

/// The fixed set: the first flat (the first bull-nose where there is no flat) and the first ball end mill of
/// the job, LUO's 1/2 and 1/4 in where the library has them; for what these leave, the smaller tools of the
/// library.
/// @throws Error(usage, "job.tool") when the library has no flat or no ball
[[nodiscard]] LayerTools fixed_tools(const Job& job);

/// Whether what cutters leave is cleared on contours (Cutting::rest_pattern).
[[nodiscard]] bool clears_on_contours(const Job& job);

/// The thinnest wood that is called a slab under this tool, mm: its least step; where its range begins at
/// nothing, half of the largest, with which the ranges of Luo's other tools begin. Thinner wood that hangs
/// over is a sliver that tears off when it is cut.
[[nodiscard]] double least_slab(const Tool& tool);

/// How deep a tool cuts where its push matters more than time, mm: one and a half times least_slab().
[[nodiscard]] double shallow_step(const Tool& tool);

/// The set with the stiffest twin of each tool in its place: as wide, of its kind, that bends less under
/// the same force; none where no tool has one. Stepdowns stay.
[[nodiscard]] std::optional<LayerTools> stiffer_tools(const Job& job, const LayerTools& tools);

/// What follows a finish tool (mm across) and a roughing tool so that nothing is left which a tool of the
/// library reaches: the smaller flats and balls of the library, tapered ones by their tips, in falling size;
/// after a bull-nose also a flat that is no smaller, the largest of those no wider or else the narrowest of
/// all, for what its corners leave. Only the smallest of either kind is sure to be used: those before it are
/// where much is left.
[[nodiscard]] std::vector<Tool> rest_tools(const Job& job, const Tool& rough, double finish_diameter);

}  // namespace slabwright
