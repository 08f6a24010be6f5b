// Which steps of a sequence must be done before which, by what they say that they need.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// Steps are named by their place in the list, from 0. Steps are added in that order.
class StepOrder {
public:
    explicit StepOrder(const std::vector<SequenceStep>& steps);

    /// Takes the next step's needs. @returns what is wrong with its id and its needs, each with its code;
    /// empty when nothing is
    [[nodiscard]] std::vector<std::pair<const char*, std::string>> add_next();

    /// Whether the step added last waits for `other`, directly or by way of others.
    [[nodiscard]] bool last_waits_for(std::size_t other);

private:
    const std::vector<SequenceStep>& steps_;
    std::unordered_map<int, std::size_t> place_of_;  // the first step of each id
    std::vector<std::vector<std::size_t>> needs_;    // those that exist and come earlier
    std::vector<std::uint32_t> seen_;
    std::uint32_t stamp_ = 0;
};

}  // namespace slabwright
