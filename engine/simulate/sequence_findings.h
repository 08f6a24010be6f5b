// What the steps of a sequence say, held against what the plan asks, and what is wrong with them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/plan.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

/// Gathers violations about the steps of a sequence. Each message begins with the step that it is about;
/// after kMostSequenceViolations no more are kept.
class SequenceFindings {
public:
    explicit SequenceFindings(const std::vector<SequenceStep>& steps) : steps_(steps) {}

    /// The step that is spoken of from now on; none: the sequence as a whole.
    void speak_of(std::optional<std::size_t> place) { at_ = place; }
    [[nodiscard]] std::size_t here() const { return *at_; }
    [[nodiscard]] const SequenceStep& step() const { return steps_[*at_]; }
    /// "step 12 (glue)"
    [[nodiscard]] std::string title(std::size_t place) const;

    void complain(const char* code, const std::string& message, double size = 0);

    /// Whether the step has such a quantity; no complaint where it has none.
    [[nodiscard]] bool states(std::string_view key) const;
    [[nodiscard]] bool has_word(std::string_view key) const;
    /// A quantity or a word of the step; none, and a complaint, where it has no such thing.
    std::optional<double> number(const char* key);
    std::optional<std::string> word(const char* key);
    /// A quantity that must be whole.
    std::optional<int> whole(const char* key);

    /// Complains where the step's quantity, word or time is not the planned one.
    void expect(const char* code, const char* key, double planned, double tolerance);
    void expect_word(const char* code, const char* key, const std::string& planned);
    void expect_seconds(double planned, double tolerance);

    [[nodiscard]] bool full() const;
    [[nodiscard]] std::vector<Violation> take() { return std::move(found_); }

private:
    const std::vector<SequenceStep>& steps_;
    std::optional<std::size_t> at_;
    std::vector<Violation> found_;
};

inline constexpr std::size_t kMostSequenceViolations = 50;

}  // namespace slabwright
