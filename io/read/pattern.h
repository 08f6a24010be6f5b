// The pattern that a plan is made of, and the one that a folder OUT was planned for: found, read, and known
// to be the one.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "engine/prepare/drilled_holes.h"
#include "io/read/pattern_mesh.h"
#include "kernels/access/standing_part.h"

namespace slabwright {

/// What plan.json says of its pattern.
struct PlannedPattern {
    std::string file, sha256;
    ReadingOptions reading;  ///< as it was read for the plan
    std::vector<Support> supports{};
    DrillRule drills{};
};

struct Pattern {
    std::string place;  ///< the path of its file, or the name of what was in memory
    ReadingOptions reading;
    PatternMesh read;
    std::optional<StandingPart> part;  ///< of the mesh, once somebody needs it
    std::vector<Support> supports{};   ///< that the mesh holds as further bodies
    DrillRule drills{};                ///< for which its holes are round

    /// Whether it is what was planned, read alike; its round holes and supports may be missing yet.
    [[nodiscard]] bool is(const PlannedPattern& planned) const;
};

/// The pattern as the plan took it: with round holes for its drills, and with the supports that stand under
/// it; the same where it is so.
/// @pre pattern->is(planned)
[[nodiscard]] std::shared_ptr<Pattern> as_planned(Context& context, std::shared_ptr<Pattern> pattern,
                                                  const PlannedPattern& planned);

/// @param directory OUT
/// @param given the pattern; none looks for the file that the plan names: in OUT, beside OUT, in the working
/// folder
/// @param asker "verify" or "report", the family of the errors' codes
/// @throws Error(input) when the pattern is missing, unreadable, or not the one that was planned (by its
/// SHA-256)
[[nodiscard]] std::shared_ptr<Pattern> read_planned_pattern(Context& context, const std::string& directory,
                                                            const PlannedPattern& planned,
                                                            const PatternSource& given,
                                                            const std::string& asker);

}  // namespace slabwright
