// Steps of a sequence in another order that their needs allow.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

namespace slabwright::support {

/// The steps in another order that their needs allow.
inline nlohmann::json shuffled(const nlohmann::json& steps, std::mt19937& random) {
    std::vector<nlohmann::json> open(steps.begin(), steps.end());
    std::map<int, bool> done;
    nlohmann::json ordered = nlohmann::json::array();
    while (!open.empty()) {
        std::vector<std::size_t> ready;
        for (std::size_t i = 0; i < open.size(); ++i)
            if (std::all_of(open[i]["needs"].begin(), open[i]["needs"].end(),
                            [&](const nlohmann::json& need) { return done[need.get<int>()]; }))
                ready.push_back(i);
        const std::size_t chosen = ready[random() % ready.size()];
        done[open[chosen]["id"].get<int>()] = true;
        ordered.push_back(open[chosen]);
        open.erase(open.begin() + static_cast<std::ptrdiff_t>(chosen));
    }
    return ordered;
}

}  // namespace slabwright::support
