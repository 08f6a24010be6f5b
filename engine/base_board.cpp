#include "engine/base_board.h"

#include <algorithm>

namespace slabwright {

double board_cut_limit(const Machine& machine, const std::vector<Tool>& tools) {
    double limit = machine.base_board_cut;
    if (limit < 0) {
        limit = 0;
        for (const Tool& tool : tools)
            if (tool.kind == ToolKind::ball) limit = std::max(limit, tool.diameter / 2);
    }
    return std::min(limit, machine.base_board_thickness);
}

}  // namespace slabwright
