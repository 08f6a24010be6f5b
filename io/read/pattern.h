// The pattern that a folder OUT was planned for: found, read, and known to be the one.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/job.h"
#include "io/read/stl.h"
#include "kernels/access/standing_part.h"

namespace slabwright {

/// What plan.json says of its pattern.
struct PlannedPattern {
    std::string file, sha256;
    StlOptions reading;  ///< units, tolerance and repair that it was planned with
};

struct Pattern {
    std::string path;
    StlOptions reading;
    StlMesh stl;
    std::optional<StandingPart> part;  ///< of the mesh, once somebody needs it

    /// Whether it is what was planned, read alike.
    [[nodiscard]] bool is(const PlannedPattern& planned) const;
};

/// @param directory OUT
/// @param given the STL; "" looks for the file that the plan names: in OUT, beside OUT, in the working folder
/// @param asker "verify" or "report", the family of the errors' codes
/// @throws Error(input) when the STL is missing, unreadable, or not the one that was planned (by its SHA-256)
[[nodiscard]] std::shared_ptr<Pattern> read_pattern(Context& context, const std::string& directory,
                                                    const PlannedPattern& planned, const std::string& given,
                                                    const std::string& asker);

}  // namespace slabwright
