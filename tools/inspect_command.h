// `slabwright inspect IN`: what is looked for.
#pragma once

#include <CLI/CLI.hpp>

#include "io/slabwright.h"

namespace slabwright {

/// Adds the limits of draft, thin walls, corners, sharp edges and narrow cavities to the command, and the
/// map; model and reading are added by the caller.
void add_inspection_options(CLI::App& command, InspectionOptions& options);

}  // namespace slabwright
