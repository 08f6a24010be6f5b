#include "engine/schedule/slab_steps.h"

#include <fmt/format.h>

#include "engine/schedule/dowels.h"
#include "engine/schedule/glue_path.h"

namespace slabwright {

SequenceStep& add_step(std::vector<SequenceStep>& steps, int layer, const char* action,
                       std::vector<int> needs, double seconds) {
    SequenceStep step;
    step.id = static_cast<int>(steps.size()) + 1;
    step.layer = layer;
    step.action = action;
    step.needs = std::move(needs);
    step.seconds = seconds;
    steps.push_back(std::move(step));
    return steps.back();
}

std::string pile_of(std::span<const FeedSlab> slabs) {
    std::string pile;
    for (std::size_t i = 0, end = 0; i < slabs.size(); i = end) {
        while (end < slabs.size() && slabs[end].thickness == slabs[i].thickness) ++end;
        pile += fmt::format("{}{} x {:.6g}", i == 0 ? "" : ", ", end - i, slabs[i].thickness);
    }
    return pile;
}

void FeedChamber::load(SequenceStep& step, const Machine& machine) {
    left_ = loads_[next_load_++];
    const std::span<const FeedSlab> loaded{slabs_.data() + next_slab_, static_cast<std::size_t>(left_)};
    height_ = 0;
    double kg = 0;
    for (const FeedSlab& slab : loaded) {
        height_ += slab.thickness;
        kg += slab.kg;
    }
    step.numbers = {{"slabs", left_}, {"height_mm", height_}, {"mass_kg", kg}};
    if (has_handler(machine)) step.words = {{"pile", pile_of(loaded)}};
    stack_ = step.id;
}

double FeedChamber::take() {
    const double stack = height_;
    if (left_ > 0) {
        --left_;
        height_ = left_ == 0 ? 0 : height_ - slabs_[next_slab_].thickness;
    }
    ++next_slab_;
    return stack;
}

SlabSteps::SlabSteps(Plan& plan)
    : plan_(plan),
      machine_(plan.job.machine),
      handled_(has_handler(plan.job.machine)),
      feed_(plan),
      carried_kg_(board_mass_kg(plan)) {
    for (Layer& layer : plan.layers)
        for (Joint& joint : layer.joints) joint.beads = glue_beads(plan, joint.glue);
}

SequenceStep& SlabSteps::add(const Layer& layer, const char* action, std::vector<int> needs, double seconds) {
    seconds_ += seconds;
    return add_step(plan_.sequence, layer.index, action, std::move(needs), seconds);
}

int SlabSteps::bond(const Layer& layer, int k, int ready) {
    const Bonding& bonding = plan_.job.bonding;
    const Blank blank = slab_of(plan_, layer);
    if (plan_.turned) {
        const int slab = take(layer, layer.slab_thickness, blank);
        const int lies = place(layer, 0, {ready, slab}, blank);
        return add(layer, "hold_down", {lies}, bonding.handling_s / 3).id;
    }
    const int taken = take(layer, layer.slab_thickness / layer.slabs, blank);
    const int clamped = add(layer, "clamp", {taken}, handled_ ? machine_.grip_s : bonding.handling_s / 3).id;
    const int glued = glue(layer, k, ready, clamped);
    std::vector<int> laid_on{clamped, glued};
    if (const int set = k == 0 ? set_dowels(layer, glued) : 0; set != 0) laid_on.push_back(set);
    const int placed = place(layer, k, std::move(laid_on), blank);
    // The handler holds the slab against the rising table (RPM) and lets go of it then.
    SequenceStep& press = add(layer, "press", {placed}, press_seconds(plan_.job));
    handler_free_ = handled_ ? press.id : placed;
    const auto at = static_cast<std::size_t>(k);
    press.numbers = {{"force_n", at < layer.joints.size() ? layer.joints[at].force_n : 0},
                     {"time_s", bonding.press_time_s}};
    if (handled_) press.numbers.emplace_back("lift_mm", machine_.press_lift);
    return press.id;
}

int SlabSteps::turned_over(int layer) const {
    for (const SequenceStep& step : plan_.sequence)
        if (step.action == "turn_over" && step.layer == layer) return step.id;
    return 0;
}

// Fetching the slab and clamping it only needs the handler; it may go on while the layer below is milled.
int SlabSteps::take(const Layer& layer, double thickness, const Blank& blank) {
    std::vector<int> needs;
    if (feed_.is_empty()) {
        std::vector<int> after;
        if (last_taken_ != 0) after.push_back(last_taken_);
        else if (!plan_.undersides.empty())
            after.push_back(turned_over(plan_.undersides.back().turned->layer));
        SequenceStep& load = add(layer, "load_feed", std::move(after), 0);
        feed_.load(load, machine_);
        needs.push_back(load.id);
    }
    if (handler_free_ != 0) needs.push_back(handler_free_);
    if (const int turned = turned_over(layer.index); turned != 0) needs.push_back(turned);
    const double seconds =
        handled_ ? handler_seconds(machine_, handler_, 0) : plan_.job.bonding.handling_s / 3;
    SequenceStep& step = add(layer, "take_slab", std::move(needs), seconds);
    step.numbers = {{"thickness_mm", thickness},
                    {"length_mm", blank.length()},
                    {"width_mm", blank.width()},
                    {"mass_kg", slab_mass_kg(plan_, blank, thickness)},
                    {"feed_stack_mm", feed_.take()}};
    step.words = {{"material", plan_.job.material.name}};
    if (handled_) {
        step.numbers.emplace_back("stack", feed_.stack());
        step.numbers.emplace_back("handler_mm", handler_ = 0);
    }
    return last_taken_ = step.id;
}

int SlabSteps::glue(const Layer& layer, int k, int ready, int clamped) {
    static const Joint kNone;  // of a layer that nobody has bonded
    const auto at = static_cast<std::size_t>(k);
    const Joint& joint = at < layer.joints.size() ? layer.joints[at] : kNone;
    const Bonding& bonding = plan_.job.bonding;
    const GlueHead head = glue_head_of(machine_);
    const GluePass pass = head == GlueHead::none ? GluePass{} : glue_pass(plan_, joint.beads);
    std::vector<int> needs{ready};
    if (head == GlueHead::slab) needs.push_back(clamped);
    SequenceStep& step =
        add(layer, "glue", std::move(needs),
            head == GlueHead::none ? bonding.glue_s_per_m2 * joint.area_mm2 * 1e-6 : pass.seconds);
    step.numbers = {{"area_mm2", joint.area_mm2}, {"setback_mm", k == 0 ? bonding.edge_setback : 0}};
    step.words = {{"glue", bonding.glue}};
    if (head == GlueHead::none) return step.id;
    step.words.emplace_back("side", head == GlueHead::slab ? "slab" : "stack");
    step.numbers.emplace_back("bead_mm", pass.bead_mm);
    step.numbers.emplace_back("speed_mm_min", pass.speed);
    if (bonding.glue_g_per_m2 > 0) {
        step.numbers.emplace_back("glue_g", pass.grams);
        step.numbers.emplace_back("pump_g_min", pass.pump_g_min);
    }
    if (head == GlueHead::slab) {
        if (!joint.beads.empty()) handler_ = pass.handler_end;
        step.numbers.emplace_back("handler_mm", handler_);
    }
    return step.id;
}

int SlabSteps::set_dowels(const Layer& layer, int glued) {
    const std::span<const JointDowel> dowels = dowels_under(plan_, layer);
    if (dowels.empty()) return 0;
    const auto count = static_cast<double>(dowels.size());
    SequenceStep& step = add(layer, "set_dowels", {glued}, count * plan_.job.dowels.set_s);
    step.numbers = {{"count", count},
                    {"diameter_mm", dowels.front().diameter},
                    {"length_mm", dowels.front().length()},
                    {"hole_mm", dowels.front().above}};
    return step.id;
}

int SlabSteps::place(const Layer& layer, int k, std::vector<int> needs, const Blank& blank) {
    const double slab = layer.slab_thickness / layer.slabs, way = handler_way(machine_);
    SequenceStep& step =
        add(layer, "place", std::move(needs),
            handled_ ? handler_seconds(machine_, handler_, way) : plan_.job.bonding.handling_s / 3);
    carried_kg_ += slab_mass_kg(plan_, blank, slab);
    step.numbers = {{"x_mm", blank.min[0]},
                    {"y_mm", blank.min[1]},
                    {"z_bottom_mm", layer.z_bottom + k * slab},
                    {"table_load_kg", carried_kg_}};
    if (handled_) step.numbers.emplace_back("handler_mm", handler_ = way);
    return step.id;
}

}  // namespace slabwright
