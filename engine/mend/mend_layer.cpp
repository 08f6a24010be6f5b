#include "engine/mend/mend_layer.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "engine/mend/patches.h"
#include "engine/mend/touch_up.h"
#include "engine/tools/tools.h"

namespace slabwright {

namespace {

constexpr double kSafe = 0.8;     // of the gouge tolerance that a raised way may use up
constexpr double kMargin = 0.05;  // mm by which shank and holder are raised over what stands

using Fault = FaultyMove::Fault;

class OperationMender {
public:
    OperationMender(const Job& job, const StandingPart& part, const Layer& layer, Operation& op, int round)
        : job_(job),
          op_(op),
          tool_(*std::find_if(job.tools.begin(), job.tools.end(),
                              [&](const Tool& t) { return t.number == op.tool; })),
          // What the machine may round off wider corners counts as thickness, as in the proof.
          free_(part, layer.z_top, tool_, op.blend > kJunction ? op.blend : 0, kSafe * job.tolerances.gouge),
          clearance_(to_units(op.clearance_z)),
          round_(round) {}

    /// @returns what was done, "" where nothing was
    std::string run(const std::vector<FaultyMove>& faults) {
        std::size_t done[5] = {};
        std::vector<MovePatch> patches;
        for (std::size_t k = 0; k < faults.size();) {
            // Moves of one fault that follow one another are one.
            std::size_t next = k + 1;
            double size = faults[k].size;
            for (; next < faults.size() && faults[next].fault == faults[k].fault &&
                   faults[next].move == faults[next - 1].move + 1 && is_feed(faults[next].move) &&
                   is_feed(faults[k].move);
                 ++next)
                size = std::max(size, faults[next].size);
            MovePatch patch = patch_of(faults[k].fault, faults[k].move, faults[next - 1].move + 1, size);
            if (patch.first < patch.last) {
                patches.push_back(std::move(patch));
                ++done[static_cast<std::size_t>(faults[k].fault)];
            }
            k = next;
        }
        if (apply_patches(op_.moves, std::move(patches)) == 0) return {};
        std::string words;
        const auto say = [&](Fault fault, const char* what) {
            if (const std::size_t n = done[static_cast<std::size_t>(fault)]; n > 0)
                words += fmt::format("{}{} {}", words.empty() ? "" : ", ", n, what);
        };
        say(Fault::gouge, "raised over the part");
        say(Fault::crush, round_ > 1 ? "left out" : "entered on a ramp");
        say(Fault::rapid, "above what stands");
        say(Fault::too_deep, "in passes");
        say(Fault::in_standing, "raised over what stands");
        return words;
    }

private:
    [[nodiscard]] bool is_feed(std::size_t move) const { return op_.moves[move].feed != 0; }

    [[nodiscard]] MovePatch patch_of(Fault fault, std::size_t first, std::size_t last, double size) const {
        const std::vector<Move>& moves = op_.moves;
        if (first == 0 || last >= moves.size()) return {};
        const auto plunge =
            static_cast<std::uint32_t>(std::max(1.0, std::min(tool_.plunge_feed, job_.machine.max_feed)));
        if (!is_feed(first)) return rapids_above(moves, first, clearance_, plunge, free_);
        switch (fault) {
            case Fault::gouge:
                return lifted_over_part(moves, first, last, free_);
            case Fault::crush:
                if (round_ == 1)
                    if (MovePatch ramp = ramped_in(moves, first, size, tool_, job_.cutting.ramp_deg);
                        ramp.first < ramp.last)
                        return ramp;
                return left_out(moves, first, clearance_);
            case Fault::rapid:
                return {};
            case Fault::too_deep: {
                const double step = op_.stepdown > 0 ? std::min(op_.stepdown, flutes()) : flutes();
                const int passes = std::max(2, static_cast<int>(std::ceil(size / std::max(step, 0.1))));
                return in_passes(moves, first, last, size, passes, plunge);
            }
            case Fault::in_standing:
                return raised_by(moves, first, last, size + kMargin);
        }
        return {};
    }

    [[nodiscard]] double flutes() const { return tool_.flute_length > 0 ? tool_.flute_length : 1e3; }

    const Job& job_;
    Operation& op_;
    const Tool& tool_;
    FreeCutter free_;
    std::int32_t clearance_;
    int round_;
};

bool cuts(const Operation& op) {
    return std::any_of(op.moves.begin(), op.moves.end(), [](const Move& m) { return m.feed != 0; });
}

}  // namespace

MendedLayer mend_layer(Context& context, const Job& job, const StandingPart& part, const Layer& layer,
                       const LayerFaults& faults, int round) {
    MendedLayer mended{layer, false, {}};
    const auto say = [&](const std::string& words) {
        mended.changed = true;
        mended.done += fmt::format("{}{}", mended.done.empty() ? "" : "; ", words);
    };
    std::vector<std::size_t> dropped;
    for (const OperationFaults& of : faults.operations) {
        context.throw_if_cancelled();
        Operation& op = mended.layer.operations[of.operation];
        if (of.empty) {
            say(fmt::format("{} dropped", op.purpose));
            dropped.push_back(of.operation);
            continue;
        }
        if (std::string words = OperationMender(job, part, layer, op, round).run(of.moves); !words.empty())
            say(fmt::format("{}: {}", op.purpose, words));
        if (!cuts(op)) dropped.push_back(of.operation);
    }
    std::sort(dropped.begin(), dropped.end(), std::greater<>());
    for (const std::size_t k : dropped)
        mended.layer.operations.erase(mended.layer.operations.begin() + static_cast<std::ptrdiff_t>(k));
    if (!faults.missed.empty()) {
        context.throw_if_cancelled();
        for (Operation& op : touch_up(job, part, layer, faults.missed, faults.lowest_tip)) {
            const auto tool = std::find_if(job.tools.begin(), job.tools.end(),
                                           [&](const Tool& t) { return t.number == op.tool; });
            say(fmt::format("touched up by tool {}, {}", op.tool, tool->name));
            mended.layer.operations.push_back(std::move(op));
        }
    }
    return mended;
}

}  // namespace slabwright
