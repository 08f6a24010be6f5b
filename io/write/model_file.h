// A mesh as a file that other programs read: binary STL or 3MF, by the ending of its name.
#pragma once

#include <string>

#include "kernels/mesh/mesh.h"

namespace slabwright {

/// @throws Error(usage, "prepare.format") unless a name ends in .stl or .3mf
void require_model_ending(const std::string& path);

/// Writes a mesh in millimetres, all or nothing. A 3MF holds each vertex once, with the digits that give the
/// same float32 again; its archive is not compressed and has no date, so the same mesh gives the same bytes.
/// @throws Error(input, "out.unwritable") and as OutputFile, Error(usage, "prepare.format"),
/// Error(no_plan, "prepare.large") where a 3MF would pass 4 GB
void write_model(const std::string& path, const Mesh& mesh);

}  // namespace slabwright
