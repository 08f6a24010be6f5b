#include "engine/forces/feeds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "engine/forces/bent_cutter.h"
#include "kernels/forces/deflection.h"
#include "kernels/forces/hardest.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

using Place = std::array<double, 3>;

Place place_of(const std::array<float, 3>& at) { return {at[0], at[1], at[2]}; }

/// A peak and where it is met.
struct Peak {
    double value = 0;
    Place at{};
    std::uint32_t move = 0;
    void raise(double to, const std::array<float, 3>& where, std::uint32_t by) {
        if (to > value) *this = {to, place_of(where), by};
    }
};

/// The peaks of one operation.
struct Peaks {
    Peak resultant, in_plane, across, torque, power;
    void raise(const SegmentForces& f, const std::array<float, 3>& at, std::uint32_t move) {
        resultant.raise(f.peak_resultant_n, at, move);
        in_plane.raise(f.peak_in_plane_n, at, move);
        across.raise(f.peak_y_n, at, move);
        torque.raise(f.peak_torque_nmm, at, move);
        power.raise(f.mean_power_w, at, move);
    }
};

/// What passes a limit by most, in words: its operation, how much of what, and the remedy.
struct Passed {
    double share = 1 + kFineRounding;  // of the limit; a fine class may be heavier than its cut by so much
    std::string words;
    Place at{};
    std::size_t operations = 0;
};

/// Of one layer, for each limit and tool: a tool that bends too far in three operations is told once.
class PassedLimits {
public:
    void add(const char* code, const Tool& tool, const Peak& peak, double is, double limit,
             const std::string& words) {
        if (!(limit > 0) || is <= (1 + kFineRounding) * limit) return;
        Passed& passed = passed_[{code, tool.number}];
        ++passed.operations;
        if (is / limit > passed.share) passed = {is / limit, words, peak.at, passed.operations};
    }
    void tell(int layer, std::vector<Diagnostic>& diagnostics) const {
        for (const auto& [of, passed] : passed_)
            diagnostics.push_back(
                {Severity::warning, of.first,
                 fmt::format(
                     "layer {}, {}{}", layer, passed.words,
                     passed.operations > 1 ? fmt::format(" (in {} of its programs)", passed.operations) : ""),
                 passed.at});
    }

private:
    std::map<std::pair<std::string, int>, Passed> passed_;
};

void check_limits(const Operation& op, const Tool& tool, const Job& job, const Peaks& peaks,
                  PassedLimits& passed) {
    const bool lowered = job.cutting.adapt_feed && job.cutting.adapt_stepdown;
    const char* held = lowered ? " at the least feed and in several passes" : "";
    const double limit = bending_limit(op, job);
    passed.add("cut.deflection", tool, peaks.across, op.wall_error_mm, limit,
               fmt::format("{}: the cutter T{} may bend by {:.4f} mm{}, more than the {:.4f} mm allowed; use "
                           "a shorter, thicker or stiffer tool{}",
                           op.purpose, tool.number, op.wall_error_mm, held, limit,
                           lowered ? "" : " or a smaller stepdown"));
    const double stress = cutter_stress(peaks.in_plane.value, tool.stickout, strength_diameter(tool));
    passed.add("cut.strength", tool, peaks.in_plane, stress, tool.strength_mpa,
               fmt::format("{}: the cutter T{} would bear {:.0f} MPa in bending{}, more than its {:.0f} MPa; "
                           "use a shorter or thicker tool",
                           op.purpose, tool.number, stress, held, tool.strength_mpa));
    const double torque = op.peak_torque_nmm / 1000, power = op.peak_power_w;
    passed.add("cut.torque", tool, peaks.torque, torque, job.machine.spindle_torque_nm,
               fmt::format("{}: T{} asks for {:.3f} Nm{}, more than the spindle's {:.3f} Nm; use a thinner "
                           "tool or one with fewer flutes",
                           op.purpose, tool.number, torque, held, job.machine.spindle_torque_nm));
    passed.add(
        "cut.power", tool, peaks.power, power, job.machine.spindle_power_w,
        fmt::format("{}: T{} asks for {:.0f} W{}, more than the spindle's {:.0f} W; use a thinner tool "
                    "or a slower spindle",
                    op.purpose, tool.number, power, held, job.machine.spindle_power_w));
}

}  // namespace

std::vector<std::vector<Diagnostic>> rate_layers(Context& context, Plan& plan,
                                                 std::span<const LayerCuts> layers, ForceSolver* solver) {
    const Job& job = plan.job;
    std::vector<std::size_t> starts, bases;
    std::size_t count = 0;
    for (const LayerCuts& layer : layers) {
        for (std::size_t i = 0; i + 1 < layer.starts.size(); ++i) starts.push_back(count + layer.starts[i]);
        bases.push_back(count);
        count += layer.cuts.size();
    }
    starts.push_back(count);
    const MemoryCharge memory(context, count * (sizeof(CutSegment) + sizeof(SegmentForces)),
                              "the cuts of a plan");
    RawArray<CutSegment> cuts(count);
    parallel_each(context, layers.size(), [&](std::size_t l) {
        std::copy(layers[l].cuts.begin(), layers[l].cuts.end(), cuts.data() + bases[l]);
    });
    const HardestSearch hardest = hardest_cuts(context, cuts.span(), starts, solver);
    std::vector<std::vector<Diagnostic>> found(layers.size());
    if (!hardest.note.empty())
        plan.diagnostics.push_back(
            {Severity::note,
             "forces.no_device",
             fmt::format("the forces of {} cuts were computed without an OpenCL device: {}", cuts.size(),
                         hardest.note),
             {}});
    std::size_t group = 0;
    for (std::size_t l = 0; l < layers.size(); ++l) {
        const std::size_t base = bases[l];
        PassedLimits passed;
        for (Operation& op : plan.layers[l].operations) {
            Peaks peaks;
            for (const std::size_t i : hardest.groups[group].all())
                if (i != kNoCut)
                    peaks.raise(stated_forces(cuts[i]), layers[l].places[i - base],
                                layers[l].moves[i - base]);
            ++group;
            if (!(peaks.resultant.value > 0)) continue;
            const Tool& tool = *std::find_if(job.tools.begin(), job.tools.end(),
                                             [&](const Tool& t) { return t.number == op.tool; });
            op.peak_force_n = peaks.resultant.value;
            op.peak_at = peaks.resultant.at;
            op.peak_move = peaks.resultant.move;
            op.deflection_mm = tip_bent_by(tool, peaks.in_plane.value);
            op.wall_error_mm = tip_bent_by(tool, peaks.across.value);
            op.peak_torque_nmm = peaks.torque.value;
            op.peak_power_w = peaks.power.value;
            check_limits(op, tool, job, peaks, passed);
        }
        passed.tell(plan.layers[l].index, found[l]);
    }
    return found;
}

void rate_layer(Context& context, Layer& layer, const Plan& plan, std::vector<Diagnostic>& diagnostics) {
    const LayerCuts cuts = adapt_layer(context, layer, plan, {}, diagnostics);
    Plan one;
    one.job = plan.job;
    one.layers.push_back(std::move(layer));
    SolverAhead ahead(context);
    ahead.expect(cuts.cuts);
    const auto found = rate_layers(context, one, {&cuts, 1}, ahead.solver());
    layer = std::move(one.layers[0]);
    diagnostics.insert(diagnostics.end(), found[0].begin(), found[0].end());
}

double allowed_length(const Operation& operation, const Tool& tool, const Job& job) {
    if (!(operation.wall_error_mm > 0)) return 0;
    return tool.stickout * std::cbrt(bending_limit(operation, job) / operation.wall_error_mm);
}

}  // namespace slabwright
