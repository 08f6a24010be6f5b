// A model that is prepared and written, without a plan: the front door of `slabwright prepare`.
#pragma once

#include <string>

#include "engine/job.h"
#include "engine/plan.h"
#include "io/read/pattern_source.h"
#include "kernels/export.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A model that was prepared.
struct PreparedModel {
    InputInfo input;   ///< of the file; box and volume as prepared, and what was done (InputInfo::prepared)
    std::string done;  ///< in words; "" when nothing was asked for
    std::vector<Diagnostic> diagnostics;
    std::uint64_t facets = 0, vertices = 0;
    double closest_mm = 0;  ///< by which a coordinate may differ for having been written in float32
};

/// Reads a model as the job says, `prepare` and repair among it, and writes it in millimetres where it then
/// lies (not set down). What `plan` of the outcome plans is what `plan` with the same job plans.
/// @param out ends in .stl (binary) or .3mf (vertices shared, as the mesh has them); replaced when complete
/// @throws Error(usage, "prepare.format") for another ending, Error(input) when the file cannot be read or
/// the place not be written, or as add_skin()
[[nodiscard]] SLABWRIGHT_API PreparedModel prepare_model(Context& context, const PatternSource& source,
                                                         const Job& job, const std::string& out);

/// The result for programs, schema slabwright.prepare/1, and for people.
[[nodiscard]] SLABWRIGHT_API std::string prepare_json(const PreparedModel& model, const std::string& out);
[[nodiscard]] SLABWRIGHT_API std::string prepare_text(const PreparedModel& model, const std::string& out);

}  // namespace slabwright
