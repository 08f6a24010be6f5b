// The narrow cavities of a plan's report.
#pragma once

#include <span>
#include <string>

#include "engine/job.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The object that `inspect` prints as "cavities", of the layers of a plan, as JSON; "null" where the
/// context's memory does not suffice to look for them.
/// @param layer_tops z, ascending @throws Error(cancelled)
[[nodiscard]] std::string report_cavities(Context& context, MeshView mesh, const Job& job,
                                          std::span<const double> layer_tops);

}  // namespace slabwright
