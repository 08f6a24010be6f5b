#include "engine/simulate/sequence_findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace slabwright {

bool SequenceFindings::full() const { return found_.size() >= kMostSequenceViolations; }

std::string SequenceFindings::title(std::size_t place) const {
    const SequenceStep& s = steps_[place];
    return fmt::format("step {} ({})", s.id, s.action);
}

void SequenceFindings::complain(const char* code, const std::string& message, double size) {
    if (full()) return;
    const std::string about =
        at_ ? fmt::format("step {} ({}, layer {}): ", step().id, step().action, step().layer) : "";
    found_.push_back({code, about + message, "sequence.json", 0, {}, size});
}

bool SequenceFindings::states(std::string_view key) const {
    return std::any_of(step().numbers.begin(), step().numbers.end(),
                       [&](const auto& number) { return number.first == key; });
}

bool SequenceFindings::has_word(std::string_view key) const {
    return std::any_of(step().words.begin(), step().words.end(),
                       [&](const auto& word) { return word.first == key; });
}

std::optional<double> SequenceFindings::number(const char* key) {
    for (const auto& [name, value] : step().numbers)
        if (name == key) return value;
    complain("sequence.value", fmt::format("has no {}", key));
    return std::nullopt;
}

std::optional<std::string> SequenceFindings::word(const char* key) {
    for (const auto& [name, value] : step().words)
        if (name == key) return value;
    complain("sequence.value", fmt::format("has no {}", key));
    return std::nullopt;
}

std::optional<int> SequenceFindings::whole(const char* key) {
    const std::optional<double> value = number(key);
    if (value && *value == std::floor(*value) && std::abs(*value) < 1e9) return static_cast<int>(*value);
    if (value) complain("sequence.value", fmt::format("{} is {}, no whole number", key, *value));
    return std::nullopt;
}

void SequenceFindings::expect(const char* code, const char* key, double planned, double tolerance) {
    const std::optional<double> stated = number(key);
    if (stated && !(std::abs(*stated - planned) <= tolerance))
        complain(code, fmt::format("{} is {:.3f} where the plan asks for {:.3f}", key, *stated, planned),
                 std::abs(*stated - planned));
}

void SequenceFindings::expect_word(const char* code, const char* key, const std::string& planned) {
    const std::optional<std::string> stated = word(key);
    if (stated && *stated != planned)
        complain(code, fmt::format("{} is \"{}\" where the plan says \"{}\"", key, *stated, planned));
}

void SequenceFindings::expect_seconds(double planned, double tolerance) {
    if (!(std::abs(step().seconds - planned) <= tolerance))
        complain("sequence.time",
                 fmt::format("takes {:.2f} s where the plan reckons {:.2f} s", step().seconds, planned),
                 std::abs(step().seconds - planned));
}

}  // namespace slabwright
