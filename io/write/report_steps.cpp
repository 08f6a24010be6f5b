#include "io/write/report_steps.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

namespace slabwright {

using json = nlohmann::ordered_json;

json step_times(const json& sequence) {
    json steps = json::array();
    if (sequence.is_object())
        for (const json& step : sequence.at("steps"))
            steps.push_back({step.at("layer").get<int>(), step.at("action").get<std::string>(),
                             step.at("seconds").get<double>(),
                             step.contains("program") ? step.at("program") : json()});
    return steps;
}

json magazine_loads(const json& sequence) {
    json loads = json::array();
    if (!sequence.is_object()) return loads;
    const json& steps = sequence.at("steps");
    std::string next;
    for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
        if (step->contains("program")) next = step->at("program").get<std::string>();
        if (step->at("action") != "load_tool") continue;
        const bool swaps = step->contains("tool_out");
        loads.push_back({{"layer", step->at("layer").get<int>()},
                         {"place", step->at("place").get<int>()},
                         {"tool", step->at("tool").get<int>()},
                         {"out", swaps ? step->at("tool_out").get<int>() : 0},
                         {"from_spindle", step->contains("from")},
                         {"before", swaps ? next : std::string()}});
    }
    std::reverse(loads.begin(), loads.end());
    return loads;
}

}  // namespace slabwright
