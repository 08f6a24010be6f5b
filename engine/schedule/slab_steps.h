// The steps that bring a slab onto the stack: taken from the feed chamber, clamped, glued, placed, pressed.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/plan.h"
#include "engine/schedule/heights.h"

namespace slabwright {

/// Adds a step to a sequence, with the next number.
SequenceStep& add_step(std::vector<SequenceStep>& steps, int layer, const char* action,
                       std::vector<int> needs, double seconds);

/// What the feed chamber is filled with, from the top: "2 x 19, 1 x 12" is two slabs of 19 mm over one of 12.
[[nodiscard]] std::string pile_of(std::span<const FeedSlab> slabs);

/// The slabs in the feed chamber, in the order in which they are taken. Where they are laid by hand, none lie
/// there and nothing is loaded.
class FeedChamber {
public:
    explicit FeedChamber(const Plan& plan) : FeedChamber(feed_loads(plan), feed_slabs(plan)) {}
    FeedChamber(std::vector<int> loads, std::vector<FeedSlab> slabs)
        : loads_(std::move(loads)), slabs_(std::move(slabs)) {}

    /// Whether it must be filled before the next slab is taken.
    [[nodiscard]] bool is_empty() const { return left_ == 0 && next_load_ < loads_.size(); }
    /// Fills it. @param step which is told with what, load_feed
    void load(SequenceStep& step, const Machine& machine);
    /// Takes the next slab. @returns the height of the stack that it lay on top of, itself included, mm
    double take();
    /// The step that filled it last; 0: none.
    [[nodiscard]] int stack() const { return stack_; }

private:
    std::vector<int> loads_;
    std::vector<FeedSlab> slabs_;  // of the whole build
    std::size_t next_load_ = 0, next_slab_ = 0;
    int left_ = 0, stack_ = 0;
    double height_ = 0;
};

/// Adds the steps of one slab after another to plan.sequence.
class SlabSteps {
public:
    /// @param plan its layers in the order of the build; it outlives this
    explicit SlabSteps(Plan& plan);

    /// The steps of the k-th slab of a layer, from 0. @param ready the step after which glue may go on what
    /// it lies on. @returns the step that has pressed it
    int bond(const Layer& layer, int k, int ready);
    /// Of all steps so far.
    [[nodiscard]] double minutes() const { return seconds_ / 60; }

private:
    SequenceStep& add(const Layer& layer, const char* action, std::vector<int> needs, double seconds);
    int take(const Layer& layer, double thickness, const Blank& blank);
    /// The step that turned a layer's slab when its underside was milled; 0: it was not.
    [[nodiscard]] int turned_over(int layer) const;
    int glue(const Layer& layer, int k, int ready, int clamped);
    /// Into the joint under a layer. @returns 0 where it has none
    int set_dowels(const Layer& layer, int glued);
    int place(const Layer& layer, int k, std::vector<int> needs, const Blank& blank);

    Plan& plan_;
    const Machine& machine_;
    const bool handled_;
    FeedChamber feed_;
    int last_taken_ = 0;    // the step that took the slab before; 0: none
    int handler_free_ = 0;  // the step after which the material handler is free; 0: from the start
    double handler_ = 0;    // mm, where it stands
    double carried_kg_;
    double seconds_ = 0;
};

}  // namespace slabwright
