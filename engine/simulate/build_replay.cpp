#include "engine/simulate/build_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "engine/simulate/planned_build.h"
#include "engine/simulate/step_order.h"
#include "engine/simulate/underside_steps.h"

namespace slabwright {

namespace {

constexpr double kForce = 0.01;  // N and kg
constexpr double kLitres = 0.01;

class BuildReplay : UndersideSteps {
public:
    BuildReplay(const BuildPlan& plan, const BuildSequence& sequence, BuildState from)
        : UndersideSteps(plan, sequence.steps, std::move(from)), sequence_(sequence), slabs_(build_.slabs()) {
        s_.ran_in.resize(plan.programs.size());
        s_.faced_off.resize(plan.face_offs.size());
        programs_left_.resize(plan.layers.size());
        if (plan.job_stated) s_.magazine.resize(static_cast<std::size_t>(plan.job.machine.magazine), 0);
        s_.magazine_set.resize(s_.magazine.size());
        for (std::size_t p = 0; p < plan.programs.size(); ++p)
            if (!s_.ran_in[p]) ++programs_left_[plan.programs[p].layer];
    }

    ReplayedBuild run(std::size_t until) {
        if (s_.done == 0) check_head();
        if (sequence_.steps.size() > build_.most_steps()) {
            complain("sequence.length", fmt::format("{} steps, where this build has no more than {}",
                                                    sequence_.steps.size(), build_.most_steps()));
            return {std::move(s_), take()};
        }
        for (std::size_t i = 0; i < s_.done; ++i) (void)order_.add_next();  // told when they were replayed
        while (s_.done < until) {
            speak_of(s_.done);
            for (const auto& [code, message] : order_.add_next()) complain(code, message);
            replay_step();
            ++s_.done;
        }
        speak_of({});
        if (until == sequence_.steps.size()) check_end();
        return {std::move(s_), take()};
    }

private:
    // --- the steps

    void check_head() {
        if (sequence_.pattern != plan_.pattern || sequence_.sha256 != plan_.sha256)
            complain("sequence.pattern", "is made for another pattern than plan.json");
        if (sequence_.frame != plan_.frame)
            complain("sequence.frame", "counts its heights in another frame than plan.json");
        for (std::size_t l = 0; l < plan_.layers.size() && !plan_.turned; ++l)
            if (l >= sequence_.glue.size() || sequence_.glue[l].layer != plan_.layers[l].index)
                complain("sequence.glue",
                         fmt::format("glue/{} is not that of layer {}", l, plan_.layers[l].index));
    }

    void replay_step() {
        using Act = void (BuildReplay::*)();
        static const std::unordered_map<std::string, Act> acts{
            {"mill_underside", &BuildReplay::mill_underside},
            {"turn_over", &BuildReplay::turn_over},
            {"hold_down", &BuildReplay::hold_down},
            {"mount_board", &BuildReplay::mount_board},
            {"load_feed", &BuildReplay::load_feed},
            {"take_slab", &BuildReplay::take_slab},
            {"clamp", &BuildReplay::clamp},
            {"glue", &BuildReplay::glue},
            {"set_dowels", &BuildReplay::set_dowels},
            {"place", &BuildReplay::place},
            {"press", &BuildReplay::press},
            {"table", &BuildReplay::table},
            {"touch_off", &BuildReplay::touch_off},
            {"probe", &BuildReplay::probe},
            {"tool_change", &BuildReplay::tool_change},
            {"load_tool", &BuildReplay::load_tool},
            {"face", &BuildReplay::program},
            {"mill", &BuildReplay::program},
            {"clear", &BuildReplay::clear},
            {"face_off", &BuildReplay::face_off},
            {"unload", &BuildReplay::unload},
            {"mould_box", &BuildReplay::mould_box}};
        const auto act = acts.find(step().action);
        if (act == acts.end()) {
            complain("sequence.action", "is no action of this machine");
            return;
        }
        if (s_.unloaded && step().action != "mould_box")
            complain("sequence.order", "comes after the unloading");
        (this->*act->second)();
    }

    void expect_size(const Blank& blank) {
        expect("sequence.slab", "length_mm", blank.length(), kLength);
        expect("sequence.slab", "width_mm", blank.width(), kLength);
    }

    void mount_board() {
        if (s_.board) complain("sequence.order", "a board is mounted already");
        require_all_turned();
        expect_layer(0);
        expect_seconds(0, kSeconds);
        expect_size({plan_.stock_min, plan_.stock_max});
        if (plan_.job_stated) {
            const double thickness = plan_.job.machine.base_board_thickness;
            expect("sequence.slab", "thickness_mm", thickness, kLength);
            expect("sequence.mass", "mass_kg", build_.board_mass(thickness), kForce);
        }
        s_.board = s_.stack_ready = here();
        s_.board_thickness = number("thickness_mm").value_or(0);
        s_.load_kg = build_.board_mass(s_.board_thickness);
        check_load();
    }

    void check_load() {
        if (plan_.job_stated && s_.load_kg > plan_.job.machine.build_mass_kg + kForce)
            complain("sequence.mass",
                     fmt::format("the build table would carry {:.1f} kg, it bears {:.1f} kg", s_.load_kg,
                                 plan_.job.machine.build_mass_kg),
                     s_.load_kg - plan_.job.machine.build_mass_kg);
    }

    void load_feed() {
        expect_seconds(0, kSeconds);
        if (s_.in_feed > 0)
            complain("sequence.feed", fmt::format("{} slabs still lie in the feed chamber", s_.in_feed));
        if (s_.taken < slabs_.size()) expect_layer(slabs_[s_.taken].layer);
        wait_for(s_.last_taken);
        require_all_turned();
        const int count = whole("slabs").value_or(0);
        if (count < 1 || static_cast<std::size_t>(count) > slabs_.size() - std::min(s_.taken, slabs_.size()))
            complain("sequence.feed", fmt::format("loads {} slabs where the build still takes {}", count,
                                                  slabs_.size() - std::min(s_.taken, slabs_.size())));
        s_.in_feed = std::max(0, count);
        double kg = s_.feed_height = 0;
        for (std::size_t i = s_.taken;
             i < std::min(slabs_.size(), s_.taken + static_cast<std::size_t>(s_.in_feed)); ++i) {
            s_.feed_height += slabs_[i].thickness;
            kg += slabs_[i].kg;
        }
        expect("sequence.feed", "height_mm", s_.feed_height, kLength);
        if (plan_.job_stated) {
            const Machine& machine = plan_.job.machine;
            expect("sequence.feed", "mass_kg", kg, kForce);
            if (s_.feed_height > machine.feed_height + kLength)
                complain("sequence.travel",
                         fmt::format("stacks {:.1f} mm in a feed chamber of {:.1f} mm", s_.feed_height,
                                     machine.feed_height),
                         s_.feed_height - machine.feed_height);
            if (kg > machine.feed_mass_kg + kForce)
                complain("sequence.mass",
                         fmt::format("loads {:.1f} kg on a feed table that bears {:.1f} kg", kg,
                                     machine.feed_mass_kg),
                         kg - machine.feed_mass_kg);
        }
        if (handled()) {
            const std::size_t from = std::min(s_.taken, slabs_.size());
            check_pile(
                {slabs_.data() + from, std::min(static_cast<std::size_t>(s_.in_feed), slabs_.size() - from)});
        }
        s_.loaded = here();
    }

    void take_slab() {
        if (s_.in_hand || (handled() && s_.to_press))
            complain("sequence.order", "the material handler holds a slab already");
        wait_for(s_.hand_free);
        const bool from_feed = !plan_.job_stated || plan_.job.machine.feed_height > 0;
        if (from_feed && plan_.job_stated) {
            if (s_.in_feed == 0) complain("sequence.feed", "the feed chamber is empty");
            else wait_for(s_.loaded);
        }
        if (plan_.job_stated) {
            expect("sequence.feed", "feed_stack_mm", from_feed ? s_.feed_height : 0, kLength);
            expect_word("sequence.slab", "material", plan_.job.material.name);
        }
        if (handled()) {
            if (s_.loaded && s_.in_feed > 0)
                expect("sequence.stack", "stack", sequence_.steps[*s_.loaded].id, 0);
            move_handler(0);
        } else expect_job_seconds(plan_.job.bonding.handling_s / 3);
        if (s_.taken >= slabs_.size()) {
            complain("sequence.order", "all slabs of the build have been taken");
        } else {
            const DueSlab& slab = slabs_[s_.taken];
            expect_layer(slab.layer);
            require_turned(plan_.layers[slab.layer].index);
            expect_size(slab.blank);
            expect("sequence.slab", "thickness_mm", slab.thickness, kLength);
            if (plan_.job_stated) expect("sequence.mass", "mass_kg", slab.kg, kForce);
            s_.feed_height = std::max(0.0, s_.feed_height - slab.thickness);
            ++s_.taken;
        }
        if (s_.in_feed > 0 && --s_.in_feed == 0) s_.feed_height = 0;
        s_.in_hand = s_.last_taken = here();
        s_.clamped.reset();
    }

    void clamp() {
        require(s_.in_hand, "the material handler holds no slab");
        if (s_.clamped) complain("sequence.order", "the slab is clamped already");
        if (s_.taken > 0) expect_layer(slabs_[s_.taken - 1].layer);
        expect_job_seconds(handled() ? plan_.job.machine.grip_s : plan_.job.bonding.handling_s / 3);
        s_.clamped = here();
    }

    /// The slab that is to be placed next; the last one when all are.
    [[nodiscard]] const DueSlab& due_slab() const { return slabs_[std::min(s_.placed, slabs_.size() - 1)]; }

    void glue() {
        const DueSlab& slab = due_slab();
        if (s_.placed >= slabs_.size()) complain("sequence.order", "no slab is left for the glue");
        expect_layer(slab.layer);
        if (s_.glued) complain("sequence.order", "there is glue on the stack already");
        if (slab.number == 0)
            require(s_.stack_ready, slab.layer == 0
                                        ? "no board is mounted"
                                        : "the layer below is not done: its programs have not all run");
        else require(s_.pressed, "the slab below is not pressed");
        const double area = number("area_mm2").value_or(0), whole_slab = slab.blank.mm2();
        const double slack = 0.01 + 1e-6 * whole_slab;
        if (const PlannedJoint planned = build_.joint_of(slab); planned.glue_area_mm2)
            expect("sequence.glue", "area_mm2", *planned.glue_area_mm2, slack);
        if (!(area >= 0 && area <= whole_slab + slack))
            complain("sequence.glue",
                     fmt::format("covers {:.0f} mm2, the slab has {:.0f}", area, whole_slab));
        check_glue_place(slab, area, slack);
        if (plan_.job_stated) {
            const Bonding& bonding = plan_.job.bonding;
            expect_word("sequence.glue", "glue", bonding.glue);
            expect("sequence.glue", "setback_mm", slab.number == 0 ? bonding.edge_setback : 0, kLength);
            if (head() == GlueHead::none) expect_seconds(bonding.glue_s_per_m2 * area * 1e-6, kSeconds);
        }
        if (head() == GlueHead::slab) {
            require(s_.in_hand, "the material handler holds no slab over the glue head");
            require(s_.clamped, "the slab over the glue head is not clamped");
        }
        if (head() != GlueHead::none && slab.glue < sequence_.glue.size())
            check_beads(sequence_.glue[slab.glue]);
        s_.glued = here();
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
        if (std::abs(place.z - slab.z_bottom) > kLength)
            complain("sequence.glue", fmt::format("its polygons lie at z = {:.3f} mm, the joint at {:.3f}",
                                                  place.z, slab.z_bottom));
        for (std::size_t k = 0; k < 2; ++k)
            if (place.area_mm2 > 0 &&
                (place.min[k] < slab.blank.min[k] - kLength || place.max[k] > slab.blank.max[k] + kLength)) {
                complain("sequence.glue", "its polygons reach beyond the slab");
                break;
            }
    }

    void set_dowels() {
        require(s_.glued, "there is no glue on the stack");
        if (s_.dowels) complain("sequence.order", "the dowels are set already");
        expect_layer(due_slab().layer);
        check_dowels(due_slab());
        s_.dowels = here();
    }

    void place() {
        const DueSlab& slab = due_slab();
        if (s_.placed >= slabs_.size()) complain("sequence.order", "all slabs of the build are placed");
        expect_layer(slab.layer);
        require(s_.in_hand, "the material handler holds no slab");
        if (plan_.turned) require(s_.stack_ready, "no board is mounted");
        else {
            require(s_.clamped, "the slab is not clamped");
            require(s_.glued, "there is no glue on the stack");
        }
        if (!dowels_of(slab).empty()) require(s_.dowels, "its dowels are not set");
        expect("sequence.place", "x_mm", slab.blank.min[0], kLength);
        expect("sequence.place", "y_mm", slab.blank.min[1], kLength);
        expect("sequence.place", "z_bottom_mm", slab.z_bottom, kLength);
        if (handled()) move_handler(handler_way(plan_.job.machine));
        else expect_job_seconds(plan_.job.bonding.handling_s / 3);
        s_.load_kg += slab.kg;
        if (plan_.job_stated) expect("sequence.mass", "table_load_kg", s_.load_kg, kForce);
        check_load();
        s_.placed = std::min(s_.placed + 1, slabs_.size());
        s_.in_hand.reset();
        s_.clamped.reset();
        s_.glued.reset();
        s_.dowels.reset();
        s_.stack_ready.reset();
        s_.pressed.reset();
        s_.touched.reset();
        s_.table_at.reset();
        s_.hand_free = s_.to_press = here();
    }

    void press() {
        if (plan_.turned) complain("sequence.action", "is no action of this build");
        require(s_.to_press, "no slab waits for the press");
        if (s_.placed > 0) {
            const DueSlab& slab = slabs_[s_.placed - 1];
            expect_layer(slab.layer);
            if (const PlannedJoint planned = build_.joint_of(slab); planned.press_force_n)
                expect("sequence.press", "force_n", *planned.press_force_n, kForce);
        }
        if (plan_.job_stated) {
            expect("sequence.press", "time_s", plan_.job.bonding.press_time_s, kLength);
            if (number("force_n").value_or(0) > plan_.job.bonding.press_force + kForce)
                complain("sequence.press", "presses harder than the machine's press can");
        }
        const double lift = handled() ? plan_.job.machine.press_lift : 0;
        if (lift > 0) expect("sequence.press", "lift_mm", lift, kLength);
        expect_job_seconds(plan_.job.bonding.press_time_s + 120 * lift / plan_.job.machine.table_speed +
                           (handled() ? plan_.job.machine.grip_s : 0));
        s_.to_press.reset();
        s_.pressed = here();
        if (handled()) s_.hand_free = here();  // it has held the slab against the table
    }

    void table() {
        const std::optional<std::size_t> l = build_.whole_layer(s_);
        if (!l) complain("sequence.order", "the layer's slabs are not all placed and pressed");
        wait_for(s_.pressed);
        wait_for(s_.last_cut);
        if (s_.table_at) complain("sequence.order", "the table is at this layer's height already");
        const std::size_t at = l.value_or(s_.placed > 0 ? slabs_[s_.placed - 1].layer : 0);
        expect_layer(at);
        const double bottom = build_.bottom_at(at), planned = bottom - s_.board_thickness;
        expect("sequence.table", "table_height_mm", planned, kLength);
        expect("sequence.table", "work_offset_z_mm", bottom + build_.origin_of(at), kLength);
        const Machine& machine = plan_.job.machine;
        const bool moves = machine.table == BuildTable::moving;
        // How far the table's surface lies under the plane in which layers' tops are cut.
        const double deep = s_.board_thickness + plan_.layers[at].z_top;
        if (plan_.job_stated && moves && deep > machine.build_height + kLength)
            complain("sequence.travel",
                     fmt::format("sinks {:.1f} mm; the table travels {:.1f} mm", deep, machine.build_height),
                     deep - machine.build_height);
        expect_job_seconds(s_.table && moves ? std::abs(planned - *s_.table) / machine.table_speed * 60 : 0);
        s_.table = planned;
        s_.touched.reset();
        s_.table_at = here();
    }

    void touch_off() {
        require(s_.table_at, "the table is not at this layer's height");
        if (s_.touched) complain("sequence.order", "the slab's top has been touched off already");
        expect_seconds(0, kSeconds);
        if (s_.placed > 0) {
            const std::size_t l = slabs_[s_.placed - 1].layer;
            expect_layer(l);
            for (const auto& [key, at] : build_.edges_of(slabs_[s_.placed - 1]))
                if (states(key) || build_.has_own_zero()) expect("sequence.touch_off", key, at, kLength);
            expect("sequence.touch_off", "slab_top_mm", build_.stack_top(s_) - build_.origin_of(l), kLength);
            if (programs_left_[l] == 0) s_.stack_ready = here();
        }
        s_.touched = here();
    }

    /// The program that a tool put in now is for: the next one of the plan, or one that faces off where the
    /// list has such a one before any other. Null when none is left; none where an interruption came first.
    [[nodiscard]] std::optional<const PlannedProgram*> tool_user() const {
        for (std::size_t i = here() + 1; i < sequence_.steps.size(); ++i) {
            const std::string& action = sequence_.steps[i].action;
            if (action == "face_off")
                for (const auto& [key, value] : sequence_.steps[i].words)
                    for (const PlannedProgram& p : plan_.face_offs)
                        if (key == "program" && value == p.file) return &p;
            if (action == "clear") return std::nullopt;
            if (action == "face" || action == "mill") break;
        }
        return s_.next_program < plan_.programs.size() ? &plan_.programs[s_.next_program] : nullptr;
    }

    void tool_change() {
        wait_for(s_.last_cut);
        const std::optional<int> tool = whole("tool");
        if (tool && !build_.tool_of(*tool) && !probes_with(*tool))
            complain("sequence.tool", fmt::format("tool {} is not in the library", *tool));
        if (s_.unused_change) complain("sequence.tool", "the tool before it has not been used");
        if (tool && s_.spindle_tool == *tool)
            complain("sequence.tool", fmt::format("tool {} is in the spindle already", *tool));
        const std::optional<const PlannedProgram*> user = is_for_probe() ? std::nullopt : tool_user();
        if (user && !*user) complain("sequence.order", "no program is left for the tool");
        if (const PlannedProgram* next = user.value_or(nullptr)) {
            expect_layer(next->layer);
            if (tool && *tool != next->tool)
                complain("sequence.tool", fmt::format("puts tool {} into the spindle; {} wants tool {}",
                                                      *tool, file_of(next->file), next->tool));
        }
        if (tool && !s_.magazine.empty()) {
            if (const std::optional<std::size_t> place = place_of(*tool)) {
                expect("sequence.magazine", "place", static_cast<double>(*place) + 1, 0);
                wait_for(s_.magazine_set[*place]);
            } else
                complain("sequence.magazine",
                         fmt::format("tool {} stands in no place of the magazine", *tool));
        }
        expect_job_seconds(plan_.job.machine.tool_change_s);
        if (!build_.keeps_lengths()) find_length();
        s_.spindle_tool = tool.value_or(0);
        s_.tool_in = here();
        s_.unused_change = true;
    }

    /// By hand: a tool is put into a place of the magazine, the one that stood there is taken out.
    void load_tool() {
        if (const std::optional<const PlannedProgram*> user = tool_user(); user && *user)
            expect_layer((*user)->layer);
        const std::optional<int> place = whole("place"), tool = whole("tool");
        if (tool && !build_.tool_of(*tool))
            complain("sequence.tool", fmt::format("tool {} is not in the library", *tool));
        const auto places = static_cast<int>(s_.magazine.size());
        if (!place || *place < 1 || *place > places) {
            if (place && plan_.job_stated)
                complain("sequence.magazine",
                         fmt::format("fills place {} of a magazine of {} places", *place, places));
            return;
        }
        const auto at = static_cast<std::size_t>(*place) - 1;
        const int out = s_.magazine[at], told = states("tool_out") ? whole("tool_out").value_or(0) : 0;
        if (told != out)
            complain("sequence.magazine",
                     fmt::format("takes tool {} out of place {}, where tool {} stands (0: none)", told,
                                 *place, out));
        if (const std::optional<std::size_t> other = place_of(tool.value_or(0)))
            complain("sequence.magazine",
                     fmt::format("puts in tool {}, which stands in place {} already", *tool, *other + 1));
        if (out != 0) {
            wait_for(s_.magazine_set[at]);
            wait_for(s_.last_cut);
        }
        if (out != 0 && out == s_.spindle_tool) {
            expect_word("sequence.magazine", "from", "spindle");
            wait_for(s_.tool_in);
            s_.spindle_tool = 0;
        } else if (has_word("from"))
            complain("sequence.magazine",
                     fmt::format("takes out of the spindle what is not in it: tool {} is", s_.spindle_tool));
        expect_job_seconds(out != 0 ? plan_.job.machine.magazine_swap_s : 0);
        s_.magazine[at] = tool.value_or(0);
        s_.magazine_set[at] = here();
    }

    void program() {
        s_.unused_change = false;
        const std::optional<std::array<std::size_t, 2>> named = named_file();
        if (named) check_file((*named)[0], (*named)[1]);
        require(s_.touched, "the slab's top has not been touched off");
        wait_for(s_.tool_in);
        wait_for(s_.last_cut);
        s_.last_cut = here();
        if (!named || s_.ran_in[(*named)[0]]) return;
        for (std::size_t p = (*named)[0]; p < (*named)[1]; ++p) {
            s_.ran_in[p] = here();
            s_.next_program = p + 1;
            if (--programs_left_[plan_.programs[p].layer] == 0) s_.stack_ready = here();
        }
        if ((*named)[1] - (*named)[0] > 1) s_.spindle_tool = plan_.programs[(*named)[1] - 1].tool;
    }

    /// By hand, after an interruption: handler and feed chamber are emptied, wet glue and dowels taken off.
    void clear() {
        if (s_.to_press) complain("sequence.order", "a slab lies on wet glue; it must be pressed first");
        wait_for(s_.hand_free);
        wait_for(s_.last_taken);
        wait_for(s_.glued);
        wait_for(s_.dowels);
        wait_for(s_.clamped);
        expect_seconds(0, kSeconds);
        s_.in_hand.reset();
        s_.clamped.reset();
        s_.glued.reset();
        s_.dowels.reset();
        s_.in_feed = 0;
        s_.feed_height = 0;
        s_.taken = s_.placed;
        s_.unused_change = false;
        s_.hand_free = s_.last_taken = here();
    }

    /// A layer is milled away, down to the joint under it, to be made again.
    void face_off() {
        s_.unused_change = false;
        const std::optional<std::size_t> p = named_face_off();
        require(s_.touched, "the stack's top has not been touched off");
        wait_for(s_.tool_in);
        wait_for(s_.last_cut);
        s_.last_cut = here();
        if (!p) return;
        const PlannedProgram& planned = plan_.face_offs[*p];
        if (s_.faced_off[*p])
            complain("sequence.program",
                     fmt::format("{} has run already, in {}", planned.file, title(*s_.faced_off[*p])));
        s_.faced_off[*p] = here();
        expect_layer(planned.layer);
        check_tool(planned);
        check_magazine({&planned, 1});
        check_heights({&planned, 1});
        const LayerToBuild& layer = plan_.layers[planned.layer];
        if (planned.low && !(std::abs(*planned.low - layer.z_bottom) <= kLength))
            complain("sequence.height", fmt::format("faces down to {:.3f} mm; the joint under layer {} is at "
                                                    "{:.3f} mm",
                                                    *planned.low, layer.index, layer.z_bottom));
        if (s_.in_hand || s_.glued || s_.in_feed > 0)
            complain("sequence.order",
                     "slabs wait in the handler or the feed chamber, or glue is on the stack");
        if (build_.whole_layer(s_) != planned.layer)
            complain("sequence.order",
                     fmt::format("layer {} is not whole, or lies under others", layer.index));
        else take_off(planned.layer);
    }

    /// What stands is what stood before the layer's first slab.
    void take_off(std::size_t layer) {
        while (s_.placed > 0 && slabs_[s_.placed - 1].layer == layer) s_.load_kg -= slabs_[--s_.placed].kg;
        s_.taken = s_.placed;
        s_.next_program = 0;
        for (std::size_t p = 0; p < plan_.programs.size(); ++p) {
            if (plan_.programs[p].layer < layer) s_.next_program = p + 1;
            if (plan_.programs[p].layer != layer || !s_.ran_in[p]) continue;
            s_.ran_in[p].reset();
            ++programs_left_[layer];
        }
        s_.table_at.reset();
        s_.touched.reset();
        s_.stack_ready = here();
    }

    void unload() {
        if (s_.unloaded) complain("sequence.order", "the stack is unloaded already");
        expect_layer(plan_.layers.size() - 1);
        expect_seconds(0, kSeconds);
        require(s_.stack_ready, "the top layer is not done");
        wait_for(s_.last_cut);
        s_.unloaded = here();
    }

    void mould_box() {
        require(s_.unloaded, "the stack is not unloaded");
        if (!plan_.flask) complain("sequence.order", "the plan has no flask");
        if (s_.boxed) complain("sequence.order", "the moulding box is made already");
        expect_layer(plan_.layers.size() - 1);
        expect_seconds(0, kSeconds);
        expect("sequence.value", "height_mm", plan_.layers.back().z_top, kLength);
        if (plan_.flask_mass_kg) expect("sequence.value", "flask_mass_kg", *plan_.flask_mass_kg, kForce);
        if (plan_.sand_litres) expect("sequence.value", "sand_litres", *plan_.sand_litres, kLitres);
        s_.boxed = here();
    }

    void check_end() {
        if (s_.placed < slabs_.size())
            complain("sequence.missing", fmt::format("{} of {} slabs are never placed",
                                                     slabs_.size() - s_.placed, slabs_.size()));
        check_undersides_at_end();
        for (std::size_t p = 0; p < plan_.programs.size(); ++p)
            if (!s_.ran_in[p])
                complain("sequence.missing", fmt::format("{} is never run", plan_.programs[p].file));
        if (!s_.unloaded) complain("sequence.missing", "the stack is never unloaded");
        if (plan_.flask && !s_.boxed) complain("sequence.missing", "the moulding box is never made");
    }

    const BuildSequence& sequence_;
    const std::vector<DueSlab>& slabs_;       // of the whole build, bottom up
    std::vector<std::size_t> programs_left_;  // of each layer
};

}  // namespace

std::vector<Violation> replay_build(const BuildPlan& plan, const BuildSequence& sequence) {
    if (plan.layers.empty()) return {};
    return replay_steps(plan, sequence, {}, sequence.steps.size()).violations;
}

ReplayedBuild replay_steps(const BuildPlan& plan, const BuildSequence& sequence, const BuildState& from,
                           std::size_t until) {
    return BuildReplay(plan, sequence, from).run(until);
}

}  // namespace slabwright
