#include "io/posts/tool_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/posts/gcode_writer.h"
#include "io/text/json_text.h"

namespace slabwright {

std::string tool_table(const Job& job) {
    std::vector<const Tool*> tools;
    for (const Tool& tool : job.tools) tools.push_back(&tool);
    std::sort(tools.begin(), tools.end(), [](const Tool* a, const Tool* b) { return a->number < b->number; });
    std::string text;
    for (const Tool* tool : tools) {
        text += fmt::format("T{0} P{0} D", tool->number);
        append_rounded(text, tool->diameter, 4);
        text += fmt::format(" Z0 ;{}\n", comment_text(tool->name));
    }
    return text;
}

}  // namespace slabwright
