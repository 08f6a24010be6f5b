#include "engine/simulate/resume_point.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/simulate/planned_build.h"

namespace slabwright {

namespace {

constexpr double kThinSlab = 19, kThinSlabError = 0.2, kThickSlabError = 0.3;  // mm, EN 622-5

/// By how much a board of this thickness may miss it, mm.
double board_error(double thickness) {
    return thickness <= 0 ? 0 : thickness <= kThinSlab ? kThinSlabError : kThickSlabError;
}

/// A length for people: three decimals at most, no trailing zeros.
std::string mm(double value) {
    std::string text = fmt::format("{:.3f}", value);
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
    return text == "-0" ? "0" : text;
}

void say_glue(ResumePoint& point, const BuildPlan& plan, const BuildSequence& sequence,
              const BuildState& state, double waited_s) {
    const double open = plan.job.bonding.open_time_s;
    point.glue_lost = point.glue != GlueState::none && open > 0 && waited_s > open;
    if (point.glue == GlueState::none) return;
    const std::string waited = fmt::format("the glue has waited for {:.0f} s or more", waited_s);
    const std::string judged =
        open == 0         ? waited + "; compare that with its open time (bonding.open_time_s does not say)"
        : point.glue_lost ? waited + fmt::format(", longer than its open time of {:.0f} s", open)
                          : waited + fmt::format(" of its open time of {:.0f} s", open);
    if (point.glue == GlueState::spread) {
        point.checks.push_back(
            fmt::format("{}; if it has set, clean the joint and go on with step {}, the glue", judged,
                        sequence.steps[*state.glued].id));
        return;
    }
    point.checks.push_back(fmt::format(
        "{}; if it had set before the slab is pressed, that slab is lost: press it all the same, say --after "
        "that step, and make it again with --remake {}",
        judged, point.layer));
}

void say_touch_off(ResumePoint& point, const PlannedBuild& build, const BuildState& state,
                   std::size_t layer) {
    const double origin = build.origin_of(layer);
    point.touch_off_mm = build.stack_top(state) - origin;
    const Tool* tool = build.tool_of(state.spindle_tool);
    if (tool) point.nose_mm = build.bottom_at(layer) + build.stack_top(state) + tool->stickout;
    const std::string with = tool ? fmt::format("T{}", tool->number) : std::string("the next tool");
    point.checks.push_back(
        fmt::format("measure the length of {} again and touch off: the stack's top lies at z = {} mm in the "
                    "programs, the "
                    "base board's at z = {} mm; the work offset has moved by {} mm since the first layer",
                    with, mm(*point.touch_off_mm), mm(-origin), mm(*point.work_offset_mm)));
}

/// Before a build whose slabs are milled on both sides: which of them are done.
void say_undersides(ResumePoint& point, const BuildPlan& plan, const BuildState& state) {
    for (std::size_t u = 0; u < plan.undersides.size(); ++u) {
        const UndersideToMill& under = plan.undersides[u];
        if (state.slabs_turned[u]) continue;
        point.checks.push_back(
            state.undersides_milled[u]
                ? fmt::format(
                      "layer {}'s slab is milled from below and lies upside down; turn it over, left to "
                      "right, and mark its front edge",
                      under.layer)
                : fmt::format("layer {}'s slab is to be milled from below; where that was begun, slabwright "
                              "resume OUT/{} says how far",
                              under.layer, under.folder));
    }
    const auto turned = static_cast<std::size_t>(std::count_if(
        state.slabs_turned.begin(), state.slabs_turned.end(), [](const Cause& c) { return c; }));
    if (turned > 0)
        point.checks.push_back(
            fmt::format("{} of {} slabs are milled from below and turned", turned, plan.undersides.size()));
}

/// Where the tools stand, and which of them is in the spindle.
void say_magazine(ResumePoint& point) {
    std::string places;
    for (std::size_t i = 0; i < point.magazine.size(); ++i) {
        if (point.magazine[i] == 0) continue;
        places += fmt::format("{}T{} in place {}{}", places.empty() ? "" : ", ", point.magazine[i], i + 1,
                              point.magazine[i] == point.tool ? " (now in the spindle)" : "");
    }
    if (!point.magazine.empty())
        point.checks.push_back(places.empty()
                                   ? "the magazine is empty"
                                   : fmt::format("the magazine has {}, and no other tool", places));
}

}  // namespace

std::string_view name(GlueState state) {
    switch (state) {
        case GlueState::spread:
            return "spread";
        case GlueState::unpressed:
            return "unpressed";
        case GlueState::none:
            break;
    }
    return "none";
}

ResumePoint resume_point(const BuildPlan& plan, const BuildSequence& sequence, const BuildState& state,
                         double waited_s) {
    const PlannedBuild build(plan);
    ResumePoint point;
    point.slabs = static_cast<int>(state.placed);
    point.bonded_mm = build.stack_top(state);
    point.stack_mm = state.board ? state.board_thickness + point.bonded_mm : 0;
    point.load_kg = state.load_kg;
    point.in_feed = state.in_feed;
    point.in_hand = state.in_hand.has_value();
    point.tool = state.spindle_tool;
    point.magazine = state.magazine;
    point.table_mm = state.table;
    point.glue = state.to_press ? GlueState::unpressed : state.glued ? GlueState::spread : GlueState::none;
    if (state.unloaded) {
        point.checks.emplace_back("the stack is off the machine; nothing on it is left to check");
        return point;
    }
    if (!state.board) {
        say_undersides(point, plan, state);
        if (point.checks.empty()) point.checks.emplace_back("nothing is mounted yet; begin with step 1");
        return point;
    }
    point.checks.emplace_back(state.in_hand ? "the clamps hold the base board, and the handler its slab"
                                            : "the clamps hold the base board");
    say_magazine(point);
    double thickest = 0;
    std::size_t layer = 0;
    if (state.placed > 0) {
        const DueSlab& top = build.slabs()[state.placed - 1];
        layer = top.layer;
        thickest = top.thickness;
        point.layer = plan.layers[layer].index;
        point.faced = point.bonded_mm < top.z_bottom + top.thickness;
        for (std::size_t p = 0; p < state.ran_in.size(); ++p)
            if (plan.programs[p].layer == layer && plan.programs[p].kind == OperationKind::face)
                point.faced = point.faced || state.ran_in[p].has_value();
    }
    point.tolerance_mm = board_error(state.board_thickness) + (point.faced ? 0 : board_error(thickest));
    point.checks.push_back(fmt::format(
        "the stack stands {} mm above the table, base board included, to {} mm{}", mm(point.stack_mm),
        mm(point.tolerance_mm),
        point.layer == 0
            ? ""
            : fmt::format(" ({} of layer {})", point.faced ? "the top" : "the raw slab", point.layer)));
    if (state.done > 0 && sequence.steps[state.done - 1].action == "face_off")
        point.checks.emplace_back("the joint shows bare wood; scrape off what glue has stayed on it");
    say_glue(point, plan, sequence, state, waited_s);
    if (state.table) point.work_offset_mm = *state.table + state.board_thickness + build.origin_of(layer);
    if (state.table_at) say_touch_off(point, build, state, layer);
    else point.work_offset_mm.reset();
    return point;
}

}  // namespace slabwright
