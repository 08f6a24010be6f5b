#include "io/text/progress_json.h"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_map>

#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

using Json = nlohmann::json;

/// Walks what a state holds beside its programs, the same way for who writes and who reads.
template <class State, class Visitor>
void visit_state(State& s, Visitor& visit) {
    visit.count("slabs_taken", s.taken);
    visit.count("slabs_placed", s.placed);
    visit.count("programs_begun", s.next_program);
    visit.whole("feed_slabs", s.in_feed);
    visit.number("feed_height_mm", s.feed_height);
    visit.whole("tool", s.spindle_tool);
    visit.truth("tool_unused", s.unused_change);
    visit.number("table_load_kg", s.load_kg);
    visit.number("board_thickness_mm", s.board_thickness);
    visit.maybe("table_height_mm", s.table);
    visit.number("handler_mm", s.handler);
    visit.number("spindle_low_mm", s.lowest);
    visit.number("spindle_high_mm", s.highest);
    visit.cause("board", s.board);
    visit.cause("loaded", s.loaded);
    visit.cause("last_taken", s.last_taken);
    visit.cause("in_hand", s.in_hand);
    visit.cause("clamped", s.clamped);
    visit.cause("hand_free", s.hand_free);
    visit.cause("glued", s.glued);
    visit.cause("unpressed", s.to_press);
    visit.cause("pressed", s.pressed);
    visit.cause("stack_ready", s.stack_ready);
    visit.cause("table_set", s.table_at);
    visit.cause("touched_off", s.touched);
    visit.cause("tool_put_in", s.tool_in);
    visit.cause("last_cut", s.last_cut);
    visit.cause("unloaded", s.unloaded);
    visit.cause("mould_box", s.boxed);
    visit.cause_if_any("dowels_set", s.dowels);
}

class StateWriter {
public:
    StateWriter(JsonText& json, const BuildSequence& sequence) : json_(json), sequence_(sequence) {}
    void count(const char* key, std::size_t value) { json_.key(key).count(value); }
    void whole(const char* key, int value) { json_.key(key).integer(value); }
    void truth(const char* key, bool value) { json_.key(key).boolean(value); }
    void number(const char* key, double value) {
        json_.key(key);
        if (std::isfinite(value)) json_.exact(value);
        else json_.null();
    }
    void maybe(const char* key, const std::optional<double>& value) {
        number(key, value.value_or(std::nan("")));
    }
    void cause(const char* key, const Cause& value) {
        json_.key(key);
        if (value) json_.integer(sequence_.steps[*value].id);
        else json_.null();
    }
    void cause_if_any(const char* key, const Cause& value) {
        if (value) cause(key, value);
    }

private:
    JsonText& json_;
    const BuildSequence& sequence_;
};

/// A text of progress.json, asked for its keys.
class ProgressText {
public:
    ProgressText(std::string_view text, const std::string& place) : place_(place) {
        try {
            document_ = Json::parse(text);
        } catch (const Json::exception& e) {
            refuse(fmt::format("is no JSON: {}", e.what()));
        }
        if (!document_.is_object()) refuse("is no object");
    }
    [[noreturn]] void refuse(const std::string& message) const {
        throw Error(ErrorKind::input, "resume.progress", quoting_line(message), place_,
                    "move it away, and say --after the last step that was finished");
    }
    [[nodiscard]] const Json& document() const { return document_; }
    [[nodiscard]] const Json& at(const Json& object, const char* key) const {
        const auto found = object.find(key);
        if (found == object.end()) refuse(fmt::format("has no {}", key));
        return *found;
    }
    [[nodiscard]] std::string text(const char* key) const {
        const Json& value = at(document_, key);
        if (!value.is_string()) refuse(fmt::format("{} is no text", key));
        return value.get<std::string>();
    }
    /// 0 … 1e9
    [[nodiscard]] std::int64_t whole(const Json& value, const char* key) const {
        if (!value.is_number_integer() || value < 0 || value > 1'000'000'000)
            refuse(fmt::format("{} is no count", key));
        return value.get<std::int64_t>();
    }

private:
    Json document_;
    const std::string& place_;
};

class StateReader {
public:
    StateReader(const ProgressText& text, const BuildSequence& sequence)
        : text_(text), state_(text.at(text.document(), "state")) {
        if (!state_.is_object()) text.refuse("state is no object");
        for (std::size_t i = 0; i < sequence.steps.size(); ++i) place_of_.emplace(sequence.steps[i].id, i);
    }
    void count(const char* key, std::size_t& value) {
        value = static_cast<std::size_t>(text_.whole(text_.at(state_, key), key));
    }
    void whole(const char* key, int& value) {
        value = static_cast<int>(text_.whole(text_.at(state_, key), key));
    }
    void truth(const char* key, bool& value) {
        const Json& from = text_.at(state_, key);
        if (!from.is_boolean()) text_.refuse(fmt::format("{} is neither true nor false", key));
        value = from.get<bool>();
    }
    /// Null leaves the value as it is: without bound.
    void number(const char* key, double& value) {
        const Json& from = text_.at(state_, key);
        if (from.is_null()) return;
        if (!from.is_number() || !std::isfinite(from.get<double>()))
            text_.refuse(fmt::format("{} is no number", key));
        value = from.get<double>();
    }
    void maybe(const char* key, std::optional<double>& value) {
        if (text_.at(state_, key).is_null()) return;
        number(key, value.emplace());
    }
    void cause(const char* key, Cause& value) {
        const Json& from = text_.at(state_, key);
        if (!from.is_null()) value = place(from, key);
    }
    /// Of a key that may be missing.
    void cause_if_any(const char* key, Cause& value) {
        if (state_.contains(key)) cause(key, value);
    }
    [[nodiscard]] std::size_t place(const Json& id, const char* key) const {
        const auto found = place_of_.find(static_cast<int>(text_.whole(id, key)));
        if (found == place_of_.end()) text_.refuse(fmt::format("{} names a step that does not exist", key));
        return found->second;
    }
    /// Of each place of the magazine its tool and the step that put it in, 0 for none.
    void magazine(std::size_t places, BuildState& state) const {
        if (places == 0) return;
        const Json& from = text_.at(state_, "magazine");
        if (!from.is_array() || from.size() != places) text_.refuse("magazine has not the machine's places");
        for (const Json& entry : from) {
            if (!entry.is_array() || entry.size() != 2) text_.refuse("magazine has a place that is no pair");
            state.magazine.push_back(static_cast<int>(text_.whole(entry[0], "magazine")));
            const bool set = text_.whole(entry[1], "magazine") != 0;
            state.magazine_set.push_back(set ? Cause(place(entry[1], "magazine")) : std::nullopt);
        }
    }
    /// What of the programs ran, and in which step.
    void programs(const BuildPlan& plan, BuildState& state) const {
        const Json& ran = text_.at(state_, "programs");
        if (!ran.is_object()) text_.refuse("programs is no object");
        std::unordered_map<std::string, Cause*> causes;
        for (std::size_t p = 0; p < plan.programs.size(); ++p)
            causes.emplace(plan.programs[p].file, &state.ran_in[p]);
        for (std::size_t p = 0; p < plan.face_offs.size(); ++p)
            causes.emplace(plan.face_offs[p].file, &state.faced_off[p]);
        for (const auto& [file, id] : ran.items()) {
            const auto found = causes.find(file);
            if (found == causes.end()) text_.refuse(fmt::format("{} is no program of this build", file));
            *found->second = place(id, "programs");
        }
    }

    /// Of each underside the step that milled it, and the one that turned its slab, 0 for none.
    void undersides(const BuildPlan& plan, BuildState& state) const {
        if (plan.undersides.empty()) return;
        const Json& told = text_.at(state_, "undersides");
        if (!told.is_object() || told.size() != plan.undersides.size())
            text_.refuse("undersides are not those of this build");
        for (std::size_t u = 0; u < plan.undersides.size(); ++u) {
            const Json& steps = text_.at(told, plan.undersides[u].folder.c_str());
            if (!steps.is_array() || steps.size() != 2) text_.refuse("undersides has one that is no pair");
            if (text_.whole(steps[0], "undersides") != 0)
                state.undersides_milled[u] = place(steps[0], "undersides");
            if (text_.whole(steps[1], "undersides") != 0)
                state.slabs_turned[u] = place(steps[1], "undersides");
        }
    }

private:
    const ProgressText& text_;
    const Json& state_;
    std::unordered_map<int, std::size_t> place_of_;
};

/// "2026-11-25T14:42:10Z"; none where it is no such text.
std::optional<std::int64_t> seconds_of(const std::string& text) {
    constexpr std::string_view kForm = "0000-00-00T00:00:00Z";
    if (text.size() != kForm.size()) return std::nullopt;
    for (std::size_t i = 0; i < text.size(); ++i)
        if (kForm[i] == '0' ? text[i] < '0' || text[i] > '9' : text[i] != kForm[i]) return std::nullopt;
    const auto part = [&](std::size_t at, std::size_t digits) {
        int value = 0;
        std::from_chars(text.data() + at, text.data() + at + digits, value);
        return value;
    };
    using namespace std::chrono;
    const year_month_day day{year(part(0, 4)), month(static_cast<unsigned>(part(5, 2))),
                             std::chrono::day(static_cast<unsigned>(part(8, 2)))};
    const int h = part(11, 2), m = part(14, 2), s = part(17, 2);
    if (!day.ok() || h > 23 || m > 59 || s > 60) return std::nullopt;
    return std::int64_t{sys_days(day).time_since_epoch().count()} * 86400 + h * 3600 + m * 60 + s;
}

}  // namespace

std::string utc_text(std::int64_t seconds) {
    using namespace std::chrono;
    const std::int64_t days = seconds >= 0 ? seconds / 86400 : -((86399 - seconds) / 86400);
    const std::int64_t rest = seconds - days * 86400;
    const year_month_day day{sys_days(std::chrono::days(days))};
    return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", static_cast<int>(day.year()),
                       static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()), rest / 3600,
                       rest / 60 % 60, rest % 60);
}

std::string progress_json(const BuildProgress& progress, const BuildPlan& plan,
                          const BuildSequence& sequence) {
    JsonText json;
    json.begin_object();
    json.key("schema").string("slabwright.progress/1");
    json.key("plan_sha256").string(progress.plan_sha256);
    json.key("sequence").string(progress.sequence);
    json.key("sequence_sha256").string(progress.sequence_sha256);
    json.key("after").integer(progress.after);
    json.key("time").string(utc_text(progress.time_s));
    json.key("state").begin_object();
    StateWriter writer(json, sequence);
    visit_state(progress.state, writer);
    if (!progress.state.magazine.empty()) {
        json.key("magazine").begin_array(JsonText::Shape::line);
        for (std::size_t i = 0; i < progress.state.magazine.size(); ++i) {
            const Cause& since = progress.state.magazine_set[i];
            json.begin_array().integer(progress.state.magazine[i]);
            json.integer(since ? sequence.steps[*since].id : 0).end();
        }
        json.end();
    }
    if (!plan.undersides.empty()) {
        const auto id = [&](const std::vector<Cause>& causes, std::size_t u) {
            return u < causes.size() && causes[u] ? sequence.steps[*causes[u]].id : 0;
        };
        json.key("undersides").begin_object();
        for (std::size_t u = 0; u < plan.undersides.size(); ++u)
            json.key(plan.undersides[u].folder)
                .begin_array(JsonText::Shape::line)
                .integer(id(progress.state.undersides_milled, u))
                .integer(id(progress.state.slabs_turned, u))
                .end();
        json.end();
    }
    json.key("programs").begin_object();
    const auto put = [&](const std::vector<PlannedProgram>& programs, const std::vector<Cause>& ran) {
        for (std::size_t p = 0; p < ran.size(); ++p)
            if (ran[p]) json.key(programs[p].file).integer(sequence.steps[*ran[p]].id);
    };
    put(plan.programs, progress.state.ran_in);
    put(plan.face_offs, progress.state.faced_off);
    json.end().end().end();
    return json.take();
}

BuildProgress parse_progress(std::string_view text, const std::string& place) {
    const ProgressText from(text, place);
    if (from.text("schema") != "slabwright.progress/1") from.refuse("is not of schema slabwright.progress/1");
    BuildProgress progress;
    progress.plan_sha256 = from.text("plan_sha256");
    progress.sequence = from.text("sequence");
    progress.sequence_sha256 = from.text("sequence_sha256");
    progress.after = static_cast<int>(from.whole(from.at(from.document(), "after"), "after"));
    const std::optional<std::int64_t> time = seconds_of(from.text("time"));
    if (!time) from.refuse("time is none of the form 2026-11-25T14:42:10Z");
    progress.time_s = *time;
    return progress;
}

BuildState parse_progress_state(std::string_view text, const BuildPlan& plan, const BuildSequence& sequence,
                                const std::string& place) {
    const ProgressText from(text, place);
    BuildState state;
    state.done = static_cast<std::size_t>(from.whole(from.at(from.document(), "after"), "after"));
    state.ran_in.resize(plan.programs.size());
    state.faced_off.resize(plan.face_offs.size());
    state.undersides_milled.resize(plan.undersides.size());
    state.slabs_turned.resize(plan.undersides.size());
    StateReader reader(from, sequence);
    visit_state(state, reader);
    if (plan.job_stated) reader.magazine(static_cast<std::size_t>(plan.job.machine.magazine), state);
    reader.undersides(plan, state);
    reader.programs(plan, state);
    return state;
}

}  // namespace slabwright
