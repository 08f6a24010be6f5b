// A model in two halves, as files: the front door of `slabwright split`.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "io/read/pattern_source.h"
#include "kernels/export.h"
#include "kernels/halves/halves.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct SplitRequest {
    CutPlane plane;  ///< in the frame of plans: prepared, bottom on z = 0, x and y as in the file
    DowelRules dowels;
    bool mirror_below = false;
    std::array<std::string, 2> out;  ///< .stl or .3mf: the half above the plane, and the one below
};

struct SplitModel {
    InputInfo input;
    std::array<std::string, 2> out;
    std::array<AffineMap, 2> maps;  ///< from the frame of the request to that of each file
    std::array<double, 2> volume_mm3{}, height_mm{};
    std::array<std::uint64_t, 2> facets{};
    std::vector<Dowel> dowels;
    double cut_mm2 = 0;
    std::vector<Diagnostic> diagnostics;
};

/// Reads a model as the job says, cuts it, and writes each half with its cut face down on z = 0, as it is
/// built. Each file is replaced when it is complete; both are made before the first is written.
/// @throws Error(usage | input | cancelled) as prepare_model() and split_solid()
[[nodiscard]] SLABWRIGHT_API SplitModel split_model(Context& context, const PatternSource& source,
                                                    const Job& job, const SplitRequest& request);

/// The result for programs, schema slabwright.split/1, and for people.
[[nodiscard]] SLABWRIGHT_API std::string split_json(const SplitModel& model);
[[nodiscard]] SLABWRIGHT_API std::string split_text(const SplitModel& model);

}  // namespace slabwright
