// Which cuts of an operation are taken in several passes, and in how many (METHOD.md section 9).
#pragma once

#include <functional>
#include <vector>

#include "engine/forces/feed_choice.h"
#include "engine/forces/split_cuts.h"
#include "engine/job.h"
#include "engine/plan.h"

namespace slabwright {

/// What is asked of a stretch whose feed is chosen, in so many passes.
struct PassQuestions {
    std::function<CutLoad(const SeenStretch&, int)> load;  ///< in the lowest, which the least wood carries
    std::function<double(const SeenStretch&, int)> pace;   ///< s/mm of all of them
};

/// Runs of stretches that no feed makes light enough and that several passes would; and, in the first round,
/// those of a cylinder that are faster in several passes than at the low feed that one of them bears.
/// @param seen  of the operation, with feeds
/// @param round of dividing, from 0
[[nodiscard]] std::vector<DeepRun> deep_runs(const std::vector<SeenStretch>& seen, const Operation& op,
                                             const Tool& tool, int round, const PassQuestions& ask);

}  // namespace slabwright
