// A part of the running phase's steps, told by the share of it that is done.
#pragma once

#include <algorithm>
#include <cstdint>

#include "kernels/parallel/context.h"

namespace slabwright {

/// Of one thread. A part may be divided among the works that make it up, each of which counts from 0 to 1.
class ProgressPart {
public:
    /// @param steps of the phase that began last
    ProgressPart(Context& context, std::uint64_t steps) : context_(&context), steps_(steps) {}
    /// From one share of `whole` to another.
    ProgressPart(ProgressPart& whole, double from, double to) : whole_(&whole), from_(from), to_(to) {}

    /// This share is done; less than was told before tells nothing.
    void reach(double share) {
        share = std::clamp(share, 0.0, 1.0);
        if (whole_) {
            whole_->reach(from_ + (to_ - from_) * share);
            return;
        }
        const auto now = static_cast<std::uint64_t>(share * static_cast<double>(steps_));
        if (now > told_) context_->advance(now - told_), told_ = now;
    }

private:
    Context* context_ = nullptr;
    ProgressPart* whole_ = nullptr;
    double from_ = 0, to_ = 1;
    std::uint64_t steps_ = 0, told_ = 0;
};

}  // namespace slabwright
