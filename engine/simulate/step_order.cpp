#include "engine/simulate/step_order.h"

#include <fmt/format.h>

namespace slabwright {

StepOrder::StepOrder(const std::vector<SequenceStep>& steps) : steps_(steps), seen_(steps.size()) {
    for (std::size_t i = 0; i < steps.size(); ++i) place_of_.emplace(steps[i].id, i);
}

std::vector<std::pair<const char*, std::string>> StepOrder::add_next() {
    std::vector<std::pair<const char*, std::string>> wrong;
    const std::size_t at = needs_.size();
    const SequenceStep& step = steps_[at];
    if (step.id < 1 || static_cast<std::size_t>(step.id) > steps_.size())
        wrong.emplace_back("sequence.id",
                           fmt::format("ids run from 1 to the count of the steps, {}", steps_.size()));
    if (place_of_.at(step.id) != at) wrong.emplace_back("sequence.id", "another step has the same id");
    std::vector<std::size_t>& needs = needs_.emplace_back();
    for (const int need : step.needs) {
        const auto found = place_of_.find(need);
        if (found == place_of_.end())
            wrong.emplace_back("sequence.needs", fmt::format("needs step {}, which does not exist", need));
        else if (found->second >= at)
            wrong.emplace_back("sequence.needs", fmt::format("needs step {}, which comes no earlier", need));
        else needs.push_back(found->second);
    }
    return wrong;
}

bool StepOrder::last_waits_for(std::size_t other) {
    ++stamp_;
    std::vector<std::size_t> open = needs_.back();
    while (!open.empty()) {
        const std::size_t i = open.back();
        open.pop_back();
        if (i == other) return true;
        // What a step needs comes before it, so no way to `other` leads through a step before that.
        if (i < other || seen_[i] == stamp_) continue;
        seen_[i] = stamp_;
        open.insert(open.end(), needs_[i].begin(), needs_[i].end());
    }
    return false;
}

}  // namespace slabwright
