#include "engine/simulate/build_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "engine/simulate/sequence_findings.h"
#include "engine/simulate/step_order.h"

namespace slabwright {

namespace {

constexpr double kLength = 1e-3;   // mm by which stated lengths may differ: both are rounded
constexpr double kSeconds = 0.02;  // a program's minutes are rounded to four places
constexpr double kForce = 0.01;    // N and kg
constexpr double kLitres = 0.01;
constexpr std::size_t kStepsEach = 8;  // for each slab, without its programs and their tool changes

/// A slab of the build.
struct DueSlab {
    std::size_t layer = 0;  // index into the layers
    int number = 0;         // within its layer, from 0
    double thickness = 0, z_bottom = 0;
    std::size_t glue = 0;  // which of the sequence's: those under layers first, then those between slabs
};

/// A state of the machine that a step brought about; none: it does not hold.
using Cause = std::optional<std::size_t>;

class BuildReplay : SequenceFindings {
public:
    BuildReplay(const BuildPlan& plan, const BuildSequence& sequence)
        : SequenceFindings(sequence.steps), plan_(plan), sequence_(sequence), order_(sequence.steps) {
        std::size_t between = plan.layers.size();
        for (std::size_t l = 0; l < plan.layers.size(); ++l) {
            const LayerToBuild& layer = plan.layers[l];
            const double each = layer.slab_thickness / layer.slabs;
            for (int k = 0; k < layer.slabs; ++k)
                slabs_.push_back({l, k, each, layer.z_bottom + k * each, k == 0 ? l : between++});
        }
        programs_left_.resize(plan.layers.size());
        for (const PlannedProgram& program : plan.programs) ++programs_left_[program.layer];
        ran_in_.resize(plan.programs.size());
    }

    std::vector<Violation> run() {
        check_head();
        const std::size_t most = kStepsEach * (slabs_.size() + 1) + 2 * plan_.programs.size() + kStepsEach;
        if (sequence_.steps.size() > most) {
            complain("sequence.length", fmt::format("{} steps, where this build has no more than {}",
                                                    sequence_.steps.size(), most));
            return take();
        }
        for (std::size_t i = 0; i < sequence_.steps.size(); ++i) {
            speak_of(i);
            for (const auto& [code, message] : order_.add_next()) complain(code, message);
            replay_step();
        }
        speak_of({});
        check_end();
        return take();
    }

private:
    // --- what is said of a step
    // -------------------------------------------------------------------------------

    /// Seconds that only the job can tell.
    void expect_job_seconds(double planned) {
        if (plan_.job_stated) expect_seconds(planned, kSeconds);
    }

    void expect_layer(std::size_t layer) {
        if (layer < plan_.layers.size() && step().layer != plan_.layers[layer].index)
            complain("sequence.layer", fmt::format("belongs to layer {}", plan_.layers[layer].index));
    }

    // --- what the steps need
    // ----------------------------------------------------------------------------------

    /// The step presupposes what `cause` brought about; without it, the machine is not in a state for the
    /// step.
    void require(Cause cause, const char* lacking) {
        if (!cause) complain("sequence.order", lacking);
        else wait_for(cause);
    }

    /// Where `cause` has happened, the step must not begin before it.
    void wait_for(Cause cause) {
        if (cause && !full() && !order_.last_waits_for(*cause))
            complain("sequence.needs",
                     fmt::format("does not need {}, before which it must not begin", title(*cause)));
    }

    // --- the steps
    // --------------------------------------------------------------------------------------------

    void check_head() {
        if (sequence_.pattern != plan_.pattern || sequence_.sha256 != plan_.sha256)
            complain("sequence.pattern", "is made for another pattern than plan.json");
        if (sequence_.frame != plan_.frame)
            complain("sequence.frame", "counts its heights in another frame than plan.json");
        for (std::size_t l = 0; l < plan_.layers.size(); ++l)
            if (l >= sequence_.glue.size() || sequence_.glue[l].layer != plan_.layers[l].index)
                complain("sequence.glue",
                         fmt::format("glue/{} is not that of layer {}", l, plan_.layers[l].index));
    }

    void replay_step() {
        using Act = void (BuildReplay::*)();
        static const std::unordered_map<std::string, Act> acts{{"mount_board", &BuildReplay::mount_board},
                                                               {"load_feed", &BuildReplay::load_feed},
                                                               {"take_slab", &BuildReplay::take_slab},
                                                               {"clamp", &BuildReplay::clamp},
                                                               {"glue", &BuildReplay::glue},
                                                               {"place", &BuildReplay::place},
                                                               {"press", &BuildReplay::press},
                                                               {"table", &BuildReplay::table},
                                                               {"touch_off", &BuildReplay::touch_off},
                                                               {"tool_change", &BuildReplay::tool_change},
                                                               {"face", &BuildReplay::program},
                                                               {"mill", &BuildReplay::program},
                                                               {"unload", &BuildReplay::unload},
                                                               {"mould_box", &BuildReplay::mould_box}};
        const auto act = acts.find(step().action);
        if (act == acts.end()) {
            complain("sequence.action", "is no action of this machine");
            return;
        }
        if (unloaded_ && step().action != "mould_box")
            complain("sequence.order", "comes after the unloading");
        (this->*act->second)();
    }

    [[nodiscard]] double slab_mass(double thickness) const {
        return (plan_.stock_max[0] - plan_.stock_min[0]) * (plan_.stock_max[1] - plan_.stock_min[1]) *
               thickness * 1e-9 * plan_.job.material.density_kg_m3;
    }

    void expect_board_size(const char* code) {
        expect(code, "length_mm", plan_.stock_max[0] - plan_.stock_min[0], kLength);
        expect(code, "width_mm", plan_.stock_max[1] - plan_.stock_min[1], kLength);
    }

    void mount_board() {
        if (board_) complain("sequence.order", "a board is mounted already");
        expect_layer(0);
        expect_seconds(0, kSeconds);
        expect_board_size("sequence.slab");
        if (plan_.job_stated) {
            const double thickness = plan_.job.machine.base_board_thickness;
            expect("sequence.slab", "thickness_mm", thickness, kLength);
            expect("sequence.mass", "mass_kg", slab_mass(thickness), kForce);
        }
        board_ = stack_ready_ = here();
        board_thickness_ = number("thickness_mm").value_or(0);
        load_kg_ = slab_mass(board_thickness_);
        check_load();
    }

    void check_load() {
        if (plan_.job_stated && load_kg_ > plan_.job.machine.build_mass_kg + kForce)
            complain("sequence.mass",
                     fmt::format("the build table would carry {:.1f} kg, it bears {:.1f} kg", load_kg_,
                                 plan_.job.machine.build_mass_kg),
                     load_kg_ - plan_.job.machine.build_mass_kg);
    }

    void load_feed() {
        expect_seconds(0, kSeconds);
        if (in_feed_ > 0)
            complain("sequence.feed", fmt::format("{} slabs still lie in the feed chamber", in_feed_));
        if (taken_ < slabs_.size()) expect_layer(slabs_[taken_].layer);
        wait_for(last_taken_);
        const int count = whole("slabs").value_or(0);
        if (count < 1 || static_cast<std::size_t>(count) > slabs_.size() - std::min(taken_, slabs_.size()))
            complain("sequence.feed", fmt::format("loads {} slabs where the build still takes {}", count,
                                                  slabs_.size() - std::min(taken_, slabs_.size())));
        in_feed_ = std::max(0, count);
        feed_height_ = 0;
        for (std::size_t i = taken_; i < std::min(slabs_.size(), taken_ + static_cast<std::size_t>(in_feed_));
             ++i)
            feed_height_ += slabs_[i].thickness;
        expect("sequence.feed", "height_mm", feed_height_, kLength);
        if (plan_.job_stated) {
            const Machine& machine = plan_.job.machine;
            expect("sequence.feed", "mass_kg", slab_mass(feed_height_), kForce);
            if (feed_height_ > machine.feed_height + kLength)
                complain("sequence.travel",
                         fmt::format("stacks {:.1f} mm in a feed chamber of {:.1f} mm", feed_height_,
                                     machine.feed_height),
                         feed_height_ - machine.feed_height);
            if (slab_mass(feed_height_) > machine.feed_mass_kg + kForce)
                complain("sequence.mass",
                         fmt::format("loads {:.1f} kg on a feed table that bears {:.1f} kg",
                                     slab_mass(feed_height_), machine.feed_mass_kg),
                         slab_mass(feed_height_) - machine.feed_mass_kg);
        }
        loaded_ = here();
    }

    void take_slab() {
        if (in_hand_) complain("sequence.order", "the material handler holds a slab already");
        wait_for(hand_free_);
        const bool from_feed = !plan_.job_stated || plan_.job.machine.feed_height > 0;
        if (from_feed && plan_.job_stated) {
            if (in_feed_ == 0) complain("sequence.feed", "the feed chamber is empty");
            else wait_for(loaded_);
        }
        if (plan_.job_stated) {
            expect("sequence.feed", "feed_stack_mm", from_feed ? feed_height_ : 0, kLength);
            expect_word("sequence.slab", "material", plan_.job.material.name);
        }
        expect_job_seconds(plan_.job.bonding.handling_s / 3);
        expect_board_size("sequence.slab");
        if (taken_ >= slabs_.size()) {
            complain("sequence.order", "all slabs of the build have been taken");
        } else {
            const DueSlab& slab = slabs_[taken_];
            expect_layer(slab.layer);
            expect("sequence.slab", "thickness_mm", slab.thickness, kLength);
            if (plan_.job_stated) expect("sequence.mass", "mass_kg", slab_mass(slab.thickness), kForce);
            feed_height_ = std::max(0.0, feed_height_ - slab.thickness);
            ++taken_;
        }
        if (in_feed_ > 0 && --in_feed_ == 0) feed_height_ = 0;
        in_hand_ = last_taken_ = here();
        clamped_.reset();
    }

    void clamp() {
        require(in_hand_, "the material handler holds no slab");
        if (clamped_) complain("sequence.order", "the slab is clamped already");
        if (taken_ > 0) expect_layer(slabs_[taken_ - 1].layer);
        expect_job_seconds(plan_.job.bonding.handling_s / 3);
        clamped_ = here();
    }

    /// The joint under a slab.
    [[nodiscard]] PlannedJoint joint_of(const DueSlab& slab) const {
        const std::vector<PlannedJoint>& joints = plan_.layers[slab.layer].joints;
        const auto k = static_cast<std::size_t>(slab.number);
        return k < joints.size() ? joints[k] : PlannedJoint{};
    }

    /// The slab that is to be placed next; the last one when all are.
    [[nodiscard]] const DueSlab& due_slab() const { return slabs_[std::min(placed_, slabs_.size() - 1)]; }

    void glue() {
        const DueSlab& slab = due_slab();
        if (placed_ >= slabs_.size()) complain("sequence.order", "no slab is left for the glue");
        expect_layer(slab.layer);
        if (glued_) complain("sequence.order", "there is glue on the stack already");
        if (slab.number == 0)
            require(stack_ready_, slab.layer == 0
                                      ? "no board is mounted"
                                      : "the layer below is not done: its programs have not all run");
        else require(pressed_, "the slab below is not pressed");
        const double area = number("area_mm2").value_or(0),
                     whole_slab = (plan_.stock_max[0] - plan_.stock_min[0]) *
                                  (plan_.stock_max[1] - plan_.stock_min[1]);
        const double slack = 0.01 + 1e-6 * whole_slab;
        if (const PlannedJoint planned = joint_of(slab); planned.glue_area_mm2)
            expect("sequence.glue", "area_mm2", *planned.glue_area_mm2, slack);
        if (!(area >= 0 && area <= whole_slab + slack))
            complain("sequence.glue",
                     fmt::format("covers {:.0f} mm2, the slab has {:.0f}", area, whole_slab));
        check_glue_place(slab, area, slack);
        if (plan_.job_stated) {
            const Bonding& bonding = plan_.job.bonding;
            expect_word("sequence.glue", "glue", bonding.glue);
            expect("sequence.glue", "setback_mm", slab.number == 0 ? bonding.edge_setback : 0, kLength);
            expect_seconds(bonding.glue_s_per_m2 * area * 1e-6, kSeconds);
        }
        glued_ = here();
    }

    /// Where the glue goes: the polygons that the step points to.
    void check_glue_place(const DueSlab& slab, double area, double slack) {
        const std::optional<std::string> pointer = word("polygons");
        if (!pointer) return;
        if (*pointer != "#/glue/" + std::to_string(slab.glue) || slab.glue >= sequence_.glue.size() ||
            sequence_.glue[slab.glue].layer != plan_.layers[slab.layer].index) {
            complain("sequence.glue",
                     fmt::format("points to {}, which is not where its glue goes", *pointer));
            return;
        }
        const StatedGlue& place = sequence_.glue[slab.glue];
        if (!(std::abs(place.area_mm2 - area) <= slack))
            complain("sequence.glue",
                     fmt::format("its polygons have {:.3f} mm2, the step says {:.3f}", place.area_mm2, area));
        for (std::size_t k = 0; k < 2; ++k)
            if (place.area_mm2 > 0 && (place.min[k] < plan_.stock_min[k] - kLength ||
                                       place.max[k] > plan_.stock_max[k] + kLength)) {
                complain("sequence.glue", "its polygons reach beyond the slab");
                break;
            }
    }

    void place() {
        const DueSlab& slab = due_slab();
        if (placed_ >= slabs_.size()) complain("sequence.order", "all slabs of the build are placed");
        expect_layer(slab.layer);
        require(in_hand_, "the material handler holds no slab");
        require(clamped_, "the slab is not clamped");
        require(glued_, "there is no glue on the stack");
        expect("sequence.place", "x_mm", plan_.stock_min[0], kLength);
        expect("sequence.place", "y_mm", plan_.stock_min[1], kLength);
        expect("sequence.place", "z_bottom_mm", slab.z_bottom, kLength);
        expect_job_seconds(plan_.job.bonding.handling_s / 3);
        load_kg_ += slab_mass(slab.thickness);
        if (plan_.job_stated) expect("sequence.mass", "table_load_kg", load_kg_, kForce);
        check_load();
        placed_ = std::min(placed_ + 1, slabs_.size());
        in_hand_.reset();
        clamped_.reset();
        glued_.reset();
        stack_ready_.reset();
        pressed_.reset();
        touched_.reset();
        table_at_.reset();
        hand_free_ = to_press_ = here();
    }

    void press() {
        require(to_press_, "no slab waits for the press");
        if (placed_ > 0) {
            const DueSlab& slab = slabs_[placed_ - 1];
            expect_layer(slab.layer);
            if (const PlannedJoint planned = joint_of(slab); planned.press_force_n)
                expect("sequence.press", "force_n", *planned.press_force_n, kForce);
        }
        if (plan_.job_stated) {
            expect("sequence.press", "time_s", plan_.job.bonding.press_time_s, kLength);
            if (number("force_n").value_or(0) > plan_.job.bonding.press_force + kForce)
                complain("sequence.press", "presses harder than the machine's press can");
        }
        expect_job_seconds(plan_.job.bonding.press_time_s);
        to_press_.reset();
        pressed_ = here();
    }

    /// The layer whose slabs are all placed and pressed; none while one is missing.
    [[nodiscard]] std::optional<std::size_t> whole_layer() const {
        if (placed_ == 0 || !pressed_) return std::nullopt;
        const DueSlab& last = slabs_[placed_ - 1];
        if (last.number + 1 != plan_.layers[last.layer].slabs) return std::nullopt;
        return last.layer;
    }

    void table() {
        const std::optional<std::size_t> l = whole_layer();
        if (!l) complain("sequence.order", "the layer's slabs are not all placed and pressed");
        wait_for(pressed_);
        wait_for(last_cut_);
        if (table_at_) complain("sequence.order", "the table is at this layer's height already");
        const std::size_t at = l.value_or(placed_ > 0 ? slabs_[placed_ - 1].layer : 0);
        expect_layer(at);
        const double bottom = bottom_at(at), planned = bottom - board_thickness_;
        expect("sequence.table", "table_height_mm", planned, kLength);
        expect("sequence.table", "work_offset_z_mm", bottom + origin_of(at), kLength);
        const Machine& machine = plan_.job.machine;
        const bool moves = machine.table == BuildTable::moving;
        // How far the table's surface lies under the plane in which layers' tops are cut.
        const double deep = board_thickness_ + plan_.layers[at].z_top;
        if (plan_.job_stated && moves && deep > machine.build_height + kLength)
            complain("sequence.travel",
                     fmt::format("sinks {:.1f} mm; the table travels {:.1f} mm", deep, machine.build_height),
                     deep - machine.build_height);
        expect_job_seconds(
            table_before_ && moves ? std::abs(planned - *table_before_) / machine.table_speed * 60 : 0);
        table_before_ = planned;
        touched_.reset();
        table_at_ = here();
    }

    /// Where a layer's programs have their z = 0, pattern-base.
    [[nodiscard]] double origin_of(std::size_t layer) const {
        return plan_.frame == Frame::layer_top ? plan_.layers[layer].z_top : 0;
    }

    /// Where the pattern's bottom stands while a layer is cut, from where the programs' z = 0 is in the first
    /// layer. A table that moves brings each layer's top to one height.
    [[nodiscard]] double bottom_at(std::size_t layer) const {
        const double risen = plan_.layers[layer].z_top - plan_.layers.front().z_top;
        return -origin_of(0) - (plan_.job.machine.table == BuildTable::moving ? risen : 0);
    }

    void touch_off() {
        require(table_at_, "the table is not at this layer's height");
        if (touched_) complain("sequence.order", "the slab's top has been touched off already");
        expect_seconds(0, kSeconds);
        if (placed_ > 0) {
            const std::size_t l = slabs_[placed_ - 1].layer;
            const LayerToBuild& layer = plan_.layers[l];
            expect_layer(l);
            expect("sequence.touch_off", "slab_top_mm", layer.z_bottom + layer.slab_thickness - origin_of(l),
                   kLength);
            if (programs_left_[l] == 0) stack_ready_ = here();
        }
        touched_ = here();
    }

    [[nodiscard]] const Tool* tool_of(int number) const {
        for (const Tool& tool : plan_.tools)
            if (tool.number == number) return &tool;
        return nullptr;
    }

    void tool_change() {
        wait_for(last_cut_);
        const std::optional<int> tool = whole("tool");
        if (tool && !tool_of(*tool))
            complain("sequence.tool", fmt::format("tool {} is not in the library", *tool));
        if (unused_change_) complain("sequence.tool", "the tool before it has not been used");
        if (tool && spindle_tool_ == *tool)
            complain("sequence.tool", fmt::format("tool {} is in the spindle already", *tool));
        if (next_program_ < plan_.programs.size()) {
            const PlannedProgram& next = plan_.programs[next_program_];
            expect_layer(next.layer);
            if (tool && *tool != next.tool)
                complain("sequence.tool", fmt::format("puts tool {} into the spindle; {} wants tool {}",
                                                      *tool, next.file, next.tool));
        } else {
            complain("sequence.order", "no program is left for the tool");
        }
        expect_job_seconds(plan_.job.machine.tool_change_s);
        spindle_tool_ = tool.value_or(0);
        tool_in_ = here();
        unused_change_ = true;
    }

    /// The program that the step names; none where the plan has no such program.
    std::optional<std::size_t> named_program() {
        const std::optional<std::string> file = word("program");
        if (!file) return std::nullopt;
        for (std::size_t p = 0; p < plan_.programs.size(); ++p)
            if (plan_.programs[p].file == *file) return p;
        complain("sequence.program", fmt::format("{} is none of the plan's programs", *file));
        return std::nullopt;
    }

    void program() {
        unused_change_ = false;
        const std::optional<std::size_t> p = named_program();
        if (p) {
            const PlannedProgram& planned = plan_.programs[*p];
            if (ran_in_[*p])
                complain("sequence.program",
                         fmt::format("{} has run already, in {}", planned.file, title(*ran_in_[*p])));
            else if (*p != next_program_ && next_program_ < plan_.programs.size())
                complain("sequence.program", fmt::format("runs {} where {} is next", planned.file,
                                                         plan_.programs[next_program_].file));
            expect_layer(planned.layer);
            if ((planned.kind == OperationKind::face) != (step().action == "face"))
                complain("sequence.program",
                         fmt::format("{} is a program to {}", planned.file, name(planned.kind)));
            if (!planned.purpose.empty()) expect_word("sequence.program", "purpose", planned.purpose);
            if (planned.minutes) expect_seconds(*planned.minutes * 60, kSeconds);
            check_tool(planned);
            const std::optional<std::size_t> l = whole_layer();
            if (!l || *l != planned.layer)
                complain("sequence.order",
                         fmt::format("the slabs of layer {} are not placed and pressed, or lie under others",
                                     plan_.layers[planned.layer].index));
            check_heights(planned);
        }
        require(touched_, "the slab's top has not been touched off");
        wait_for(tool_in_);
        wait_for(last_cut_);
        last_cut_ = here();
        if (!p || ran_in_[*p]) return;
        ran_in_[*p] = here();
        next_program_ = *p + 1;
        if (--programs_left_[plan_.programs[*p].layer] == 0) stack_ready_ = here();
    }

    void check_tool(const PlannedProgram& planned) {
        const std::optional<int> tool = whole("tool");
        if (tool && !tool_of(*tool))
            complain("sequence.tool", fmt::format("tool {} is not in the library", *tool));
        if (tool && *tool != planned.tool)
            complain("sequence.tool",
                     fmt::format("{} is made for tool {}, not {}", planned.file, planned.tool, *tool));
        if (spindle_tool_ != planned.tool)
            complain("sequence.tool",
                     spindle_tool_ == 0
                         ? fmt::format("no tool has been put into the spindle for {}", planned.file)
                         : fmt::format("tool {} is in the spindle, {} is made for tool {}", spindle_tool_,
                                       planned.file, planned.tool));
    }

    /// What the step says of the program's heights, and where they bring the spindle.
    void check_heights(const PlannedProgram& planned) {
        const double origin = origin_of(planned.layer);
        if (planned.low && planned.high) {
            expect("sequence.height", "z_low_mm", *planned.low - origin, kLength);
            expect("sequence.height", "z_high_mm", *planned.high - origin, kLength);
        }
        const Tool* tool = tool_of(planned.tool);
        if (!planned.low || !planned.high || !tool || !plan_.job_stated) return;
        const double up = bottom_at(planned.layer) + tool->stickout;
        lowest_ = std::min(lowest_, up + *planned.low);
        highest_ = std::max(highest_, up + *planned.high);
        const double over = highest_ - lowest_ - plan_.job.machine.travel_z;
        if (over > kLength && !spindle_told_) {
            spindle_told_ = true;
            complain("sequence.travel",
                     fmt::format("up to here the spindle goes over {:.1f} mm, tools' lengths included; it "
                                 "travels {:.1f} mm",
                                 highest_ - lowest_, plan_.job.machine.travel_z),
                     over);
        }
    }

    void unload() {
        if (unloaded_) complain("sequence.order", "the stack is unloaded already");
        expect_layer(plan_.layers.size() - 1);
        expect_seconds(0, kSeconds);
        require(stack_ready_, "the top layer is not done");
        wait_for(last_cut_);
        unloaded_ = here();
    }

    void mould_box() {
        require(unloaded_, "the stack is not unloaded");
        if (!plan_.flask) complain("sequence.order", "the plan has no flask");
        if (boxed_) complain("sequence.order", "the moulding box is made already");
        expect_layer(plan_.layers.size() - 1);
        expect_seconds(0, kSeconds);
        expect("sequence.value", "height_mm", plan_.layers.back().z_top, kLength);
        if (plan_.flask_mass_kg) expect("sequence.value", "flask_mass_kg", *plan_.flask_mass_kg, kForce);
        if (plan_.sand_litres) expect("sequence.value", "sand_litres", *plan_.sand_litres, kLitres);
        boxed_ = here();
    }

    void check_end() {
        if (placed_ < slabs_.size())
            complain("sequence.missing",
                     fmt::format("{} of {} slabs are never placed", slabs_.size() - placed_, slabs_.size()));
        for (std::size_t p = 0; p < plan_.programs.size(); ++p)
            if (!ran_in_[p])
                complain("sequence.missing", fmt::format("{} is never run", plan_.programs[p].file));
        if (!unloaded_) complain("sequence.missing", "the stack is never unloaded");
        if (plan_.flask && !boxed_) complain("sequence.missing", "the moulding box is never made");
    }

    const BuildPlan& plan_;
    const BuildSequence& sequence_;
    std::vector<DueSlab> slabs_;              // of the whole build, bottom up
    std::vector<std::size_t> programs_left_;  // of each layer
    std::vector<Cause> ran_in_;               // the step in which each program ran

    StepOrder order_;
    Cause board_, loaded_, last_taken_, in_hand_, clamped_, hand_free_, glued_, to_press_, pressed_;
    Cause stack_ready_;  // glue may go on it: the board, or the last program of the layer below
    Cause table_at_, touched_, tool_in_, last_cut_, unloaded_, boxed_;
    std::size_t taken_ = 0, placed_ = 0;  // slabs
    std::size_t next_program_ = 0;
    int in_feed_ = 0;
    int spindle_tool_ = 0;  // 0: none
    bool unused_change_ = false;
    double feed_height_ = 0, load_kg_ = 0, board_thickness_ = 0;
    std::optional<double> table_before_;
    double lowest_ = std::numeric_limits<double>::infinity(),
           highest_ = -std::numeric_limits<double>::infinity();  // of the spindle
    bool spindle_told_ = false;
};

}  // namespace

std::vector<Violation> replay_build(const BuildPlan& plan, const BuildSequence& sequence) {
    if (plan.layers.empty()) return {};
    return BuildReplay(plan, sequence).run();
}

}  // namespace slabwright
