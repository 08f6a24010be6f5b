#include "engine/base_board.h"

#include <algorithm>

namespace slabwright {

namespace {

constexpr double kLeastBoard =
    2;  // mm of it that stay where nobody says otherwise: boards and their levels are not exact

}  // namespace

double board_cut_limit(const Machine& machine, const std::vector<Tool>& tools) {
    double limit = machine.base_board_cut;
    if (limit < 0) {
        limit = 0;
        for (const Tool& tool : tools)
            if (tool.kind == ToolKind::ball) limit = std::max(limit, tool.diameter / 2);
        limit = std::min(limit, std::max(0.0, machine.base_board_thickness - kLeastBoard));
    }
    return std::min(limit, machine.base_board_thickness);
}

}  // namespace slabwright
