#include "io/posts/program_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/moves/motion_time.h"

namespace slabwright {

namespace {

constexpr double kRpm = 1e-3;         // programs and plan.json round to the same whole number
constexpr double kWholeRpm = 0.5;     // by which that may pass a limit
constexpr double kFeed = 1e-6;        // mm/min: rounding
constexpr double kSeconds = 1e-3;     // the last decimal of a dwell
constexpr double kBlend = 1e-4;       // mm: the last decimal of G64 P
constexpr double kMillimetre = 2e-6;  // mm: plan.json's lengths and centres have six decimals
constexpr double kShare = 2e-10;      // of a length: sums of doubles

class Checker {
public:
    Checker(const Program& program, const ProgramPlan& planned, const Tool* tool, const Machine& machine)
        : program_(program), planned_(planned), tool_(tool), machine_(machine) {}

    std::vector<Violation> run() {
        begin_and_end();
        spindle();
        dwells();
        feeds();
        path_mode();
        if (planned_.feeds) lengths();
        return std::move(found_);
    }

private:
    void violate(const char* code, const std::string& message, std::uint32_t line, double size) {
        found_.push_back({code, message, program_.file, line, {}, size});
    }

    void begin_and_end() {
        const std::vector<ProgramStep>& steps = program_.steps;
        if (steps.empty()) {
            violate("program.begin", "moves nothing", 0, 0);
            return;
        }
        const ProgramStep &first = steps.front(), &last = steps.back();
        if (!first.rapid() || std::isfinite(first.x) || std::isfinite(first.y))
            violate("program.begin", "does not begin with a rapid (G0) in z alone to the clearance height",
                    first.line, 0);
        const bool upright =
            steps.size() > 1 && last.x == steps[steps.size() - 2].x && last.y == steps[steps.size() - 2].y;
        if (!last.rapid() || !upright)
            violate("program.end", "does not end with a rapid (G0) in z alone to the clearance height",
                    last.line, 0);
        else if (!(last.z >= first.z))
            violate("program.end",
                    fmt::format("ends {:.3f} mm lower than it began, where the next tool change finds it",
                                first.z - last.z),
                    last.line, first.z - last.z);
    }

    void spindle() {
        const ProgramWord &slow = program_.slowest_spindle, &fast = program_.fastest_spindle;
        if (fast.line == 0) return;  // it feeds nowhere
        const double limit = std::min(tool_ ? tool_->max_rpm : machine_.max_rpm, machine_.max_rpm);
        if (fast.value > limit + kWholeRpm)
            violate("program.spindle",
                    fmt::format("the spindle turns at {:.0f} rpm; tool and machine bear {:.0f}", fast.value,
                                limit),
                    fast.line, fast.value - limit);
        if (slow.value == 0) {
            violate("program.spindle", "the spindle stands before the cutter is out of the work", slow.line,
                    0);
            return;
        }
        if (!planned_.spindle_rpm) return;
        for (const ProgramWord& speed : {slow, fast})
            if (std::abs(speed.value - *planned_.spindle_rpm) > kRpm) {
                violate("program.spindle",
                        fmt::format("cuts at {:.0f} rpm where the plan says {:.0f}", speed.value,
                                    *planned_.spindle_rpm),
                        speed.line, std::abs(speed.value - *planned_.spindle_rpm));
                return;
            }
    }

    void dwells() {
        const double dwell = machine_.spindle_dwell_s;
        const ProgramWord& least = program_.shortest_spin_up;
        if (least.line != 0 && least.value < dwell - kSeconds)
            violate("program.spin_up",
                    fmt::format("feeds {:.3f} s after the spindle started; the machine takes {:.3f} s",
                                least.value, dwell),
                    least.line, dwell - least.value);
        if (program_.dwell_s > dwell + kSeconds)
            violate("program.dwell",
                    fmt::format("dwells {:.3f} s in all; the spindle's start takes {:.3f} s",
                                program_.dwell_s, dwell),
                    program_.longest_dwell.line, program_.dwell_s - dwell);
    }

    void feeds() {
        const double limit = std::min(tool_ ? tool_->max_feed : machine_.max_feed, machine_.max_feed);
        const auto fastest =
            std::max_element(program_.steps.begin(), program_.steps.end(),
                             [](const ProgramStep& a, const ProgramStep& b) { return a.feed < b.feed; });
        if (fastest != program_.steps.end() && fastest->feed > limit + kFeed)
            violate("program.feed",
                    fmt::format("feeds at {:.0f} mm/min; tool and machine bear {:.0f}", fastest->feed, limit),
                    fastest->line, fastest->feed - limit);
        axes();
    }

    // Where an axis cannot do what a motion asks of it, the machine slows down by itself.
    void axes() {
        const AxisLimits limits = axis_limits(machine_);
        double worst = kFeed;
        std::size_t axis = 0, at = 0;
        for (std::size_t i = 1; i < program_.steps.size(); ++i) {
            const ProgramStep &a = program_.steps[i - 1], &b = program_.steps[i];
            if (b.rapid() || !a.known() || !b.known()) continue;
            const MotionLeg leg = straight_leg({a.x, a.y, a.z}, {b.x, b.y, b.z}, b.feed, machine_);
            if (leg.length <= 0) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                const double over = b.feed * std::fabs(leg.direction[k]) - limits.speed[k] * 60;
                if (over > worst) worst = over, axis = k, at = i;
            }
        }
        if (at == 0) return;
        violate("program.axis",
                fmt::format("asks the {} axis for {:.0f} mm/min; it does {:.0f}", "xyz"[axis],
                            limits.speed[axis] * 60 + worst, limits.speed[axis] * 60),
                program_.steps[at].line, worst);
    }

    void path_mode() {
        const double planned = planned_.blend.value_or(kJunction);
        if (program_.strays > planned + kBlend / 2)
            violate("program.path_mode",
                    fmt::format("lets the machine leave its path by {:.4f} mm; the plan counts on {:.4f}",
                                program_.strays, planned),
                    program_.strays_line, program_.strays - planned);
        else if (program_.blend < planned - kBlend / 2)
            violate("program.path_mode",
                    fmt::format("rounds corners by {:.4f} mm only; the plan's times count on {:.4f}",
                                program_.blend, planned),
                    program_.strays_line, planned - program_.blend);
    }

    /// What the program does at each feed, as feed_lengths() counts the plan's.
    std::vector<FeedLength> own_lengths() const {
        std::vector<FeedLength> lengths;
        FeedLength at_hand{-1, 0, {}};  // most motions keep their feed
        const auto add = [&](const FeedLength& more) {
            if (more.feed != at_hand.feed) {
                if (at_hand.mm > 0) add_length(lengths, at_hand);
                at_hand = more;
                return;
            }
            at_hand.mm += more.mm;
            for (std::size_t k = 0; k < 3; ++k) at_hand.moment[k] += more.moment[k];
        };
        auto arc = program_.arcs.begin();
        for (std::size_t i = 1; i < program_.steps.size(); ++i) {
            const ProgramStep &a = program_.steps[i - 1], &b = program_.steps[i];
            if (arc != program_.arcs.end() && arc->begin == i) {
                add(arc_length(b.feed, arc->arc));
                i = arc->end - 1;
                ++arc;
            } else if (a.known() && b.known()) {
                add(straight_length(b.feed, {a.x, a.y, a.z}, {b.x, b.y, b.z}));
            }
        }
        if (at_hand.mm > 0) add_length(lengths, at_hand);
        return lengths;
    }

    /// The first line that feeds so; 0: none does.
    std::uint32_t first_line(double feed) const {
        for (std::size_t i = 1; i < program_.steps.size(); ++i)
            if (program_.steps[i].feed == feed && program_.steps[i - 1].known())
                return program_.steps[i].line;
        return 0;
    }

    /// The feed whose length differs most from the plan's is told of; where all agree, the first that is done
    /// elsewhere.
    void lengths() {
        const std::vector<FeedLength> own = own_lengths();
        std::vector<FeedLength> difference = own;
        double total = 0;
        for (const FeedLength& f : *planned_.feeds) {
            add_length(difference, {f.feed, -f.mm, {-f.moment[0], -f.moment[1], -f.moment[2]}});
            total += f.mm;
        }
        const double rounding = kMillimetre + kShare * total;
        const auto at = [](const std::vector<FeedLength>& all, double feed) {
            const auto found =
                std::find_if(all.begin(), all.end(), [&](const FeedLength& f) { return f.feed == feed; });
            return found == all.end() ? 0.0 : found->mm;
        };
        const auto where = [](double feed) {
            return feed == 0 ? std::string("in rapids") : fmt::format("at {:.0f} mm/min", feed);
        };
        const auto most = std::max_element(
            difference.begin(), difference.end(),
            [](const FeedLength& a, const FeedLength& b) { return std::abs(a.mm) < std::abs(b.mm); });
        if (most != difference.end() && std::abs(most->mm) > rounding) {
            violate("program.lengths",
                    fmt::format("goes {:.6f} mm {} where the plan goes {:.6f}", at(own, most->feed),
                                where(most->feed), at(*planned_.feeds, most->feed)),
                    first_line(most->feed), std::abs(most->mm));
            return;
        }
        for (const FeedLength& f : difference) {
            const double mm = at(own, f.feed);
            double aside = 0, far = 0;  // mm²; mm from the origin
            const auto planned = std::find_if(planned_.feeds->begin(), planned_.feeds->end(),
                                              [&](const FeedLength& p) { return p.feed == f.feed; });
            if (planned == planned_.feeds->end() || !(planned->mm > 0)) continue;  // a way without length
            for (std::size_t k = 0; k < 3; ++k) {
                aside = std::max(aside, std::abs(f.moment[k]));
                far = std::max(far, std::abs(planned->centre()[k]));
            }
            if (aside <= rounding * (mm + far)) continue;
            violate("program.lengths",
                    fmt::format("its {:.4f} mm {} lie elsewhere than planned, by {:.6f} mm on average", mm,
                                where(f.feed), aside / mm),
                    first_line(f.feed), aside / mm);
            return;
        }
    }

    const Program& program_;
    const ProgramPlan& planned_;
    const Tool* tool_;
    const Machine& machine_;
    std::vector<Violation> found_;
};

}  // namespace

std::vector<Violation> check_program(const Program& program, const ProgramPlan& planned, const Tool* tool,
                                     const Machine& machine) {
    return Checker(program, planned, tool, machine).run();
}

}  // namespace slabwright
