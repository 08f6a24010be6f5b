// On which side to build a model: the front door of `slabwright orient`.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "engine/planner/orientations.h"
#include "io/read/pattern_source.h"
#include "kernels/export.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A way to lay a model down, and what its plan would take.
struct OrientedWay {
    Orientation way;
    double minutes = 0;   ///< of the whole build; 0: not planned
    std::string refused;  ///< why no plan comes of it; "" where one does, or none was tried
};

struct OrientModel {
    InputInfo input;
    std::vector<OrientedWay> ways;  ///< the best first
};

/// Looks at the ways to lay a model down (orientations()) and plans the best of them, whose undercuts and
/// weak joints are accepted for that. Of those that leave as much unmade the one that is built soonest comes
/// first. Scale and contraction count; mirroring, skin and shift, which come after turning, change little and
/// are left to the plan.
/// @param planned how many of the best are planned, each as long as a plan takes
/// @throws Error(usage, "orient.turned") when the job turns the model itself or scales it unevenly, which
/// turning would change; as read_pattern() and lying()
[[nodiscard]] SLABWRIGHT_API OrientModel orient_model(Context& context, const PatternSource& source,
                                                      const Job& job, std::size_t planned = 3);

/// The job that lays its model down as the best way does.
[[nodiscard]] SLABWRIGHT_API Job oriented(const Job& job, const OrientModel& model);

/// The result for programs, schema slabwright.orient/1, and for people.
[[nodiscard]] SLABWRIGHT_API std::string orient_json(const OrientModel& model);
[[nodiscard]] SLABWRIGHT_API std::string orient_text(const OrientModel& model);

}  // namespace slabwright
