#include "io/posts/tool_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/schedule/probes.h"
#include "io/posts/gcode_writer.h"
#include "io/text/job_keys.h"
#include "io/text/json_text.h"

namespace slabwright {

namespace {

// What a table has no word for: ", bull-nose R1.5", ", tapered-ball R1 A5" (the angle to the axis), ", cone
// A90" and ", drill A135" (across the point; of a drill of 118 degrees nothing).
std::string form_remark(const Tool& tool) {
    const bool points =
        has_point(tool.kind) && (tool.kind != ToolKind::drill || tool.point_deg != Tool{}.point_deg);
    if (!has_corner(tool.kind) && !points) return {};
    std::string text = tool.name.empty() ? "" : ", ";
    text += word_of(kToolWords, tool.kind);
    if (has_corner(tool.kind)) append_rounded(text += " R", tool.corner_radius, 4);
    if (has_taper(tool.kind)) append_rounded(text += " A", tool.taper_deg, 4);
    if (points) append_rounded(text += " A", tool.point_deg, 4);
    return text;
}

}  // namespace

std::string tool_table(const Job& job, const std::vector<int>& magazine) {
    std::vector<const Tool*> tools;
    for (const Tool& tool : job.tools) tools.push_back(&tool);
    const std::optional<Tool> probe = probe_of(job);
    if (probe) tools.push_back(&*probe);
    std::sort(tools.begin(), tools.end(), [](const Tool* a, const Tool* b) { return a->number < b->number; });
    std::string text;
    std::size_t outside = magazine.size();  // the last pocket that was given
    for (const Tool* tool : tools) {
        const auto place = std::find(magazine.begin(), magazine.end(), tool->number);
        auto pocket = static_cast<std::size_t>(tool->number);
        if (place != magazine.end()) pocket = static_cast<std::size_t>(place - magazine.begin()) + 1;
        else if (!magazine.empty()) pocket = ++outside;
        text += fmt::format("T{} P{} D", tool->number, pocket);
        append_rounded(text, tool->diameter, 4);
        text += fmt::format(" Z0 ;{}", comment_text(tool->name));
        text += form_remark(*tool) + '\n';
    }
    return text;
}

}  // namespace slabwright
