// Binary STL out.
#pragma once

#include <string>

#include "engine/job.h"
#include "kernels/mesh/mesh.h"

namespace slabwright {

/// Binary STL, for models that the project makes; takes its place at `path` only when complete.
/// @throws Error(input, "out.unwritable") and as OutputFile
void write_stl(const std::string& path, const Mesh& mesh, LengthUnit unit = LengthUnit::mm);

}  // namespace slabwright
