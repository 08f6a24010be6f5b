// What a build takes, before it is planned: layers, slabs, glue, time.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/job.h"
#include "engine/planner/ways_out.h"
#include "engine/schedule/cut_list.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A kind of milling, as long as its ways are at full feed, and how long it then takes on the machine.
struct QuotedWork {
    std::string_view name;
    double ideal_minutes = 0;
    double minutes = 0;
};

/// Slabs of one thickness.
struct QuotedSlabs {
    double thickness = 0;  ///< mm
    int count = 0;
};

struct Quote {
    Lying outcome;
    std::array<double, 2> stock{};  ///< of the base board and the largest slab, mm
    std::vector<QuotedSlabs> slabs;
    double slab_m2 = 0;            ///< of all slabs
    double glue_m2 = 0;            ///< on all joints and the board
    double mass_kg = 0;            ///< of the stack with its board
    std::vector<QuotedWork> work;  ///< from above
    /// Of nine builds in ten the time lies within this share of what is quoted.
    double spread = 0.25;
    double cutting_minutes = 0, bonding_minutes = 0, tool_change_minutes = 0, build_minutes = 0;
    int undersides = 0;            ///< slabs that are milled from below before they are laid
    double underside_minutes = 0;  ///< of build_minutes, what is done to them there, changes of tools and all
    CutList boards;
    std::optional<Cost> cost;  ///< none where the job states no price
};

/// Reckons a build from the layers that a plan would have, sections in each and the surface by its slope: no
/// paths are laid. What each kind of milling takes over its ways at full feed is fitted to plans of real
/// castings (bench/quote prints how far it is off). Where slabs are milled on both sides, each underside is
/// reckoned as a layer of what it is milled to.
/// @param mesh a solid on z = 0
/// @throws Error(no_plan) where no slab or machine holds it, Error(usage, "job.tool") without a flat, a ball
/// or a face mill, and as lying(), check_two_sided() and underside_target()
[[nodiscard]] Quote quote(Context& context, MeshView mesh, const Job& job);

}  // namespace slabwright
