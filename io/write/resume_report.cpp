// What `slabwright resume` tells programs and people.
#include <fmt/format.h>

#include <algorithm>

#include "engine/simulate/resume_point.h"
#include "io/resume.h"
#include "io/text/json_text.h"
#include "io/text/progress_json.h"

namespace slabwright {

namespace {

constexpr std::size_t kShown = 12;  // steps of those that are left
constexpr int kLength = 4;          // decimals

std::string mm(double value) { return rounded_text(value, 3); }

/// Where a touch-off must find the slab, whatever the order of its numbers in the file; "" of other steps.
std::string touched_off(const SequenceStep& step) {
    const auto number = [&](std::string_view key) {
        const auto found = std::find_if(step.numbers.begin(), step.numbers.end(),
                                        [&](const auto& pair) { return pair.first == key; });
        return found == step.numbers.end() ? std::optional<double>{} : std::optional(found->second);
    };
    const auto left = number("slab_left_mm"), front = number("slab_front_mm"), top = number("slab_top_mm");
    std::string text;
    if (left && front) text = ": the slab's edges at x = " + mm(*left) + " mm, y = " + mm(*front) + " mm";
    if (top) text += (text.empty() ? ": the slab's top at z = " : ", its top at z = ") + mm(*top) + " mm";
    return text;
}

/// "step 12, layer 2: mill nc/L002_02_rough_T2.ngc"
std::string told(const SequenceStep& step) {
    std::string text = fmt::format("step {}, layer {}: {}", step.id, step.layer, step.action);
    for (const auto& [key, value] : step.words)
        if (key == "program" || key == "sequence") text += " " + value;
    for (const auto& [key, value] : step.numbers) {
        if ((step.action == "tool_change" || step.action == "load_tool") && key == "tool")
            text += fmt::format(" T{:.0f}", value);
        if (step.action == "load_tool" && key == "place") text += fmt::format(" place {:.0f}:", value);
        if (step.action == "load_tool" && key == "tool_out") text += fmt::format(" for T{:.0f}", value);
        if (step.action == "set_dowels" && key == "count") text += fmt::format(", {:.0f} of", value);
        if (step.action == "set_dowels" && key == "diameter_mm") text += fmt::format(" {:g}", value);
        if (step.action == "set_dowels" && key == "length_mm") text += fmt::format(" x {:g} mm", value);
        if (key == "table_height_mm") text += " to " + mm(value) + " mm";
        if (key == "force_n") text += fmt::format(" with {:.0f} N", value);
    }
    for (const auto& [key, value] : step.words)
        if (key == "length") text += ", " + value + " its tip";
    text += touched_off(step);
    if (step.action == "clear") text += " the handler and the feed chamber by hand, wipe wet glue off";
    if (step.seconds >= 1) text += fmt::format(", {:.0f} s", step.seconds);
    return text;
}

void put(JsonText& json, const char* key, const std::optional<double>& value) {
    json.key(key);
    if (value) json.rounded(*value, kLength);
    else json.null();
}

}  // namespace

std::string resume_json(const ResumeStatus& status) {
    const ResumePoint& p = *status.point;
    JsonText json;
    json.begin_object();
    json.key("schema").string("slabwright.resume/1");
    json.key("sequence").string(status.sequence);
    json.key("after").integer(status.after);
    json.key("time");
    if (status.time_s) json.string(utc_text(*status.time_s));
    else json.null();
    json.key("machine").begin_object();
    json.key("layer").integer(p.layer);
    json.key("slabs").integer(p.slabs);
    json.key("bonded_mm").rounded(p.bonded_mm, kLength);
    json.key("stack_mm").rounded(p.stack_mm, kLength);
    json.key("tolerance_mm").rounded(p.tolerance_mm, kLength);
    json.key("faced").boolean(p.faced);
    json.key("load_kg").rounded(p.load_kg, 3);
    json.key("feed_slabs").integer(p.in_feed);
    json.key("in_hand").boolean(p.in_hand);
    json.key("tool").integer(p.tool);
    if (!p.magazine.empty()) {
        json.key("magazine").begin_array(JsonText::Shape::line);
        for (const int tool : p.magazine) json.integer(tool);
        json.end();
    }
    json.key("glue").string(name(p.glue));
    json.key("glue_lost").boolean(p.glue_lost);
    put(json, "table_height_mm", p.table_mm);
    put(json, "work_offset_z_mm", p.work_offset_mm);
    put(json, "touch_off_mm", p.touch_off_mm);
    put(json, "spindle_nose_mm", p.nose_mm);
    json.end();
    json.key("checks").begin_array();
    for (const std::string& check : p.checks) json.string(check);
    json.end();
    json.key("left").begin_array(JsonText::Shape::line);
    for (auto i = static_cast<std::size_t>(status.after); i < status.steps.size(); ++i)
        json.integer(status.steps[i].id);
    json.end();
    json.key("minutes_left").rounded(status.minutes_left, 2);
    json.key("programs").begin_array();
    for (const std::string& program : status.programs) json.string(program);
    json.end().end();
    return json.take();
}

std::string resume_text(const ResumeStatus& status, const std::string& directory) {
    const ResumePoint& p = *status.point;
    const auto after = static_cast<std::size_t>(status.after);
    std::string text;
    for (const std::string& program : status.programs)
        text += fmt::format("wrote   {}/{}\n", directory, program);
    if (!status.time_s)
        text += fmt::format(
            "{}: nothing has been written down yet; --after STEP says which step was finished "
            "last\n",
            directory);
    text += fmt::format("{}/{}: {} of {} steps done", directory, status.sequence, status.after,
                        status.steps.size());
    if (status.time_s) text += ", as of " + utc_text(*status.time_s);
    text += '\n';
    if (after > 0) text += fmt::format("done    {}\n", told(status.steps[after - 1]));
    const auto slabs = [](int count) {
        return count == 0 ? std::string("no slab")
                          : fmt::format("{} {}", count, count == 1 ? "slab" : "slabs");
    };
    text +=
        fmt::format("stack   {}{}, {} mm above the table with the base board, {:.1f} kg\n", slabs(p.slabs),
                    p.layer == 0 ? "" : fmt::format(", layer {} on top", p.layer), mm(p.stack_mm), p.load_kg);
    text += fmt::format("machine table {}, {}, {} in the feed chamber, {} in the handler, glue: {}\n",
                        p.table_mm ? "at " + mm(*p.table_mm) + " mm" : "not moved yet",
                        p.tool ? fmt::format("T{} in the spindle", p.tool) : "no tool in the spindle",
                        slabs(p.in_feed), slabs(p.in_hand ? 1 : 0), name(p.glue));
    for (const std::string& check : p.checks) text += "check   " + check + '\n';
    if (after == status.steps.size()) return text + "left    nothing: the build is done\n";
    const SequenceStep& next = status.steps[after];
    if (next.action == "face" || next.action == "mill" || next.action == "face_off")
        text += "check   a program that had begun is run from its start\n";
    text += fmt::format("left    {} steps, {:.0f} min\n", status.steps.size() - after, status.minutes_left);
    for (std::size_t i = after; i < std::min(after + kShown, status.steps.size()); ++i)
        text += "        " + told(status.steps[i]) + '\n';
    if (status.steps.size() > after + kShown)
        text += fmt::format("        {} more in {}/{}\n", status.steps.size() - after - kShown, directory,
                            status.sequence);
    return text;
}

}  // namespace slabwright
