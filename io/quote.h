// What a build takes, at once: the front door of `slabwright quote`.
#pragma once

#include <string>

#include "engine/job.h"
#include "engine/plan.h"
#include "engine/planner/quote.h"
#include "io/read/pattern_source.h"
#include "kernels/export.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct QuotedModel {
    InputInfo input;
    Quote quote;
    Job job{};  ///< that it was reckoned by
};

/// Reads a model as the job says and reckons its build (quote()).
/// @throws as read_pattern() and quote()
[[nodiscard]] SLABWRIGHT_API QuotedModel quote_model(Context& context, const PatternSource& source,
                                                     const Job& job);

/// The result for programs, schema slabwright.quote/1, and for people.
[[nodiscard]] SLABWRIGHT_API std::string quote_json(const QuotedModel& model);
[[nodiscard]] SLABWRIGHT_API std::string quote_text(const QuotedModel& model);

}  // namespace slabwright
