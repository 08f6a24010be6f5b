#include "io/read/sequence_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "io/text/job_keys.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostSteps = 2'000'000, kMostNeeds = 1000;
constexpr double kFarthest = 200'000;  // mm: loops are in tenths of a micrometre, 32 bits

[[noreturn]] void refuse(const std::string& message) {
    throw Error(ErrorKind::verification, "verify.sequence", quoting_line(message), "sequence.json",
                "plan again");
}

/// JSON in which a name stands twice says two things; which of them a machine does, nobody knows.
Json parse(std::string_view text) {
    std::vector<std::set<std::string>> names;
    const auto watch = [&](int, Json::parse_event_t event, Json& value) {
        if (event == Json::parse_event_t::object_start) names.emplace_back();
        else if (event == Json::parse_event_t::object_end) names.pop_back();
        else if (event == Json::parse_event_t::key && !names.back().insert(value.get<std::string>()).second)
            refuse(fmt::format("\"{}\" stands twice in one object", value.get<std::string>()));
        return true;
    };
    try {
        return Json::parse(text, watch);
    } catch (const Json::exception& e) {
        refuse(fmt::format("is no JSON: {}", e.what()));
    }
}

const Json& member(const Json& object, const char* key, const std::string& of) {
    if (!object.is_object()) refuse(fmt::format("{} is no object", of));
    const auto found = object.find(key);
    if (found == object.end()) refuse(fmt::format("{} has no {}", of, key));
    return *found;
}

std::string text_of(const Json& value, const std::string& what) {
    if (!value.is_string()) refuse(fmt::format("{} is no text", what));
    return value.get<std::string>();
}

double number_of(const Json& value, const std::string& what) {
    if (!value.is_number()) refuse(fmt::format("{} is no number", what));
    const double number = value.get<double>();
    if (!std::isfinite(number)) refuse(fmt::format("{} is not finite", what));
    return number;
}

int whole_of(const Json& value, const std::string& what) {
    if (!value.is_number_integer() || std::abs(number_of(value, what)) > 1e9)
        refuse(fmt::format("{} is no whole number", what));
    return value.get<int>();
}

const Json& list_of(const Json& value, std::size_t most, const std::string& what) {
    if (!value.is_array()) refuse(fmt::format("{} is no list", what));
    if (value.size() > most) refuse(fmt::format("{} has {} entries, over {}", what, value.size(), most));
    return value;
}

SequenceStep read_step(const Json& from, std::size_t place) {
    const std::string of = fmt::format("steps[{}]", place);
    SequenceStep step;
    step.id = whole_of(member(from, "id", of), of + ".id");
    step.layer = whole_of(member(from, "layer", of), of + ".layer");
    step.action = text_of(member(from, "action", of), of + ".action");
    step.seconds = number_of(member(from, "seconds", of), of + ".seconds");
    if (step.seconds < 0) refuse(of + ".seconds is negative");
    for (const Json& need : list_of(member(from, "needs", of), kMostNeeds, of + ".needs"))
        step.needs.push_back(whole_of(need, of + ".needs"));
    static const std::set<std::string> own{"id", "layer", "action", "seconds", "needs"};
    for (const auto& [key, value] : from.items()) {
        if (own.contains(key)) continue;
        if (value.is_string()) step.words.emplace_back(key, value.get<std::string>());
        else if (value.is_number())
            step.numbers.emplace_back(key, number_of(value, fmt::format("{}.{}", of, key)));
        else if (!value.is_array() && !value.is_object())
            refuse(fmt::format("{}.{} is neither number nor text", of, key));
    }
    return step;
}

StatedGlue read_glue(const Json& from, std::size_t place) {
    const std::string of = fmt::format("glue[{}]", place);
    StatedGlue glue;
    glue.layer = whole_of(member(from, "layer", of), of + ".layer");
    if (from.contains("z_mm")) glue.z = number_of(from["z_mm"], of + ".z_mm");
    bool first = true;
    for (const Json& loop : list_of(member(from, "loops", of), SIZE_MAX, of + ".loops")) {
        std::vector<std::array<double, 2>> points;
        for (const Json& point : list_of(loop, SIZE_MAX, of + ".loops")) {
            if (!point.is_array() || point.size() != 2) refuse(of + ".loops has a point that is no pair");
            std::array<double, 2>& p = points.emplace_back();
            for (std::size_t k = 0; k < 2; ++k) {
                p[k] = number_of(point[k], of + ".loops");
                if (std::abs(p[k]) > kFarthest) refuse(of + ".loops reaches beyond 200 m");
                glue.min[k] = first ? p[k] : std::min(glue.min[k], p[k]);
                glue.max[k] = first ? p[k] : std::max(glue.max[k], p[k]);
            }
            first = false;
        }
        if (points.size() < 3) refuse(of + ".loops has a loop of fewer than three points");
        // Areas count from the loop's first point, so that far from the origin nothing cancels.
        double doubled = 0;
        for (std::size_t i = 1; i + 1 < points.size(); ++i)
            doubled += (points[i][0] - points[0][0]) * (points[i + 1][1] - points[0][1]) -
                       (points[i + 1][0] - points[0][0]) * (points[i][1] - points[0][1]);
        glue.area_mm2 += doubled / 2;
        glue.loops.push_back(std::move(points));
    }
    if (from.contains("beads"))
        for (const Json& bead : list_of(from["beads"], kMostSteps, of + ".beads")) {
            if (!bead.is_array() || bead.size() != 3) refuse(of + ".beads has one that is no three numbers");
            std::array<double, 3>& b = glue.beads.emplace_back();
            for (std::size_t k = 0; k < 3; ++k)
                if (b[k] = number_of(bead[k], of + ".beads"); std::abs(b[k]) > kFarthest)
                    refuse(of + ".beads reaches beyond 200 m");
        }
    return glue;
}

}  // namespace

BuildSequence read_sequence(std::string_view text) {
    if (text.size() > kLargestSequence)
        refuse(fmt::format("has {} bytes, over {}", text.size(), kLargestSequence));
    const Json document = parse(text);
    const std::string of = "sequence";
    if (text_of(member(document, "schema", of), "schema") != "slabwright.sequence/1")
        refuse("is not of schema slabwright.sequence/1");
    if (text_of(member(document, "units", of), "units") != "mm") refuse("its units are not mm");
    BuildSequence sequence;
    const std::string frame = text_of(member(document, "frame", of), "frame");
    if (frame == word_of(kFrameWords, Frame::layer_top)) sequence.frame = Frame::layer_top;
    else if (frame == word_of(kFrameWords, Frame::table_top)) sequence.frame = Frame::table_top;
    else if (frame != word_of(kFrameWords, Frame::pattern_base))
        refuse(fmt::format("its frame \"{}\" is none", frame));
    sequence.pattern = text_of(member(document, "pattern", of), "pattern");
    sequence.sha256 = text_of(member(document, "sha256", of), "sha256");
    const Json& steps = list_of(member(document, "steps", of), kMostSteps, "steps");
    for (std::size_t i = 0; i < steps.size(); ++i) sequence.steps.push_back(read_step(steps[i], i));
    const Json& glue = list_of(member(document, "glue", of), kMostSteps, "glue");
    for (std::size_t i = 0; i < glue.size(); ++i) sequence.glue.push_back(read_glue(glue[i], i));
    return sequence;
}

}  // namespace slabwright
