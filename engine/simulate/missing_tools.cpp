#include "engine/simulate/missing_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>

#include "engine/catalogue.h"
#include "engine/simulate/reach.h"
#include "kernels/forces/deflection.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kSamples = 320;   // of all that is out of reach; each stands for an equal share of it
constexpr std::size_t kChunk = 16;      // samples of one search's memory
constexpr double kLeastGain = 1.0;      // mm²: less is not worth a tool
constexpr double kMore = 1.02;          // times what a thicker tool gains
constexpr std::size_t kMostTools = 10;  // that are named

constexpr double kFeedPerTooth = 0.012;  // of the diameter, in MDF
constexpr double kEntry = 0.05;  // minutes for each place that a cutter goes down to: rapids, plunge, leads

/// The shortest tool of a size whose flutes leave the layers as they are; nothing where none is long enough.
std::optional<Tool> tool_of(const CatalogueSize& size, ToolKind kind, const SimulationInput& input,
                            const MissingToolOptions& options) {
    double tallest = 0;
    for (const SimulatedLayer& layer : input.layers)
        tallest = std::max(tallest, layer.z_top - layer.z_bottom);
    const double overrun =
        kind == ToolKind::ball ? size.diameter_mm / 2 * (1 - std::cos(options.vertical_rad)) : 0;
    const double needed = tallest + overrun + options.holder_clearance;
    const std::optional<double> flutes = catalogue_flutes(size.diameter_mm, needed);
    if (!flutes) return {};
    Tool tool;
    tool.kind = kind;
    tool.name = fmt::format("{} end mill {}", kind == ToolKind::ball ? "ball" : "flat", size.words);
    tool.diameter = tool.shank_diameter = size.diameter_mm;
    tool.flute_length = *flutes;
    tool.stickout = tool.flute_length + kCatalogueGrip;
    tool.plunges = plunges_by_default(kind);
    // What else a job must say, as the library's own nearest tool of the kind has it.
    const Tool* like = nullptr;
    for (const Tool& t : input.tools)
        if (t.kind == kind && (like == nullptr || std::abs(t.diameter - size.diameter_mm) <
                                                      std::abs(like->diameter - size.diameter_mm)))
            like = &t;
    tool.holder_diameter = like != nullptr ? like->holder_diameter : 32;
    tool.max_rpm = std::min(tool.max_rpm, input.machine.max_rpm);
    tool.max_feed =
        std::min(input.machine.max_feed, kFeedPerTooth * size.diameter_mm * tool.flutes * tool.max_rpm);
    tool.plunge_feed = tool.max_feed / 3;
    tool.stepdown_min = size.diameter_mm / 4;
    tool.stepdown_max = size.diameter_mm / 2;
    return tool;
}

/// A cell that is out of reach, and how far down in its column a tool must get for no more to be left than
/// the limit.
struct Sample {
    std::size_t layer = 0;
    UnreachedCell cell;
    Point3 within{};
};

/// Whether places are reached by one tool, or by the library.
class Asked {
public:
    Asked(const StandingPart& part, const SimulationInput& input, const MissingToolOptions& options)
        : part_(part), input_(input), options_(options) {}

    bool reached(const Sample& sample, const Tool& tool) {
        return search(sample.layer, tool).reachable(sample.within);
    }
    bool reached_by_library(const Sample& sample) { return library(sample.layer).reachable(sample.within); }

private:
    [[nodiscard]] std::unique_ptr<Reach> make(std::size_t layer, const std::vector<Tool>& tools) const {
        const SimulatedLayer& l = input_.layers[layer];
        const double lowest = layer == 0 && options_.board_cut >= 0
                                  ? l.z_bottom - options_.board_cut
                                  : -std::numeric_limits<double>::infinity();
        return std::make_unique<Reach>(part_, tools, l.z_bottom, l.z_top, lowest);
    }
    Reach& search(std::size_t layer, const Tool& tool) {
        auto& made = searches_[{layer, static_cast<int>(tool.kind), tool.diameter, tool.flute_length}];
        if (!made) made = make(layer, {tool});
        return *made;
    }
    Reach& library(std::size_t layer) {
        auto& made = libraries_[layer];
        if (!made) made = make(layer, input_.tools);
        return *made;
    }

    const StandingPart& part_;
    const SimulationInput& input_;
    const MissingToolOptions& options_;
    std::map<std::tuple<std::size_t, int, double, double>, std::unique_ptr<Reach>> searches_;
    std::map<std::size_t, std::unique_ptr<Reach>> libraries_;
};

/// The lowest place of a column of left-over at which no more is left than the limit, by halving.
Point3 within_limit(const StandingPart& part, const SimulatedLayer& layer, const UnreachedCell& cell,
                    double limit) {
    constexpr double kFine = 0.002;  // mm
    Point3 p = cell.place;
    double low = layer.z_bottom, high = cell.place[2];
    // What is left is never more than what stands over the layer's bottom.
    const auto left = [&](double z) {
        p[2] = z;
        return std::min(part.from_shadow(p, layer.z_top, limit + kFine).distance, z - layer.z_bottom);
    };
    while (high - low > kFine) {
        const double middle = (low + high) / 2;
        (left(middle) > limit - kFine ? high : low) = middle;
    }
    p[2] = low;
    return p;
}

std::vector<Sample> samples_of(const SimulationInput& input, const SimulationReport& report,
                               const StandingPart& part, const MissingToolOptions& options,
                               double& area_each) {
    double cells = 0;
    for (const LayerFindings& f : report.layers)
        for (const UnreachedCell& c : f.unreached) cells += c.cells;
    std::vector<Sample> samples;
    const double every = std::max(1.0, cells / kSamples);
    area_each = every * report.cell * report.cell;
    // One place of each equal share, in the order of layers and tiles: which one differs from share to share,
    // or rows of cells would beat with the shares.
    double passed = 0, share = 0, next = every * jitter(0);
    for (std::size_t l = 0; l < report.layers.size(); ++l)
        for (const UnreachedCell& c : report.layers[l].unreached) {
            passed += c.cells;
            while (next < passed) {
                samples.push_back({l, c, within_limit(part, input.layers[l], c, options.limit)});
                share += 1;
                next = every * (share + jitter(static_cast<std::size_t>(share)));
            }
        }
    return samples;
}

/// How a tool goes down, METHOD.md section 9: where its edges alone, in a full slot of its step, would bend
/// it by more than the limit, it goes down by less and slower, as far as the planner divides cuts and lowers
/// feeds.
struct Descent {
    double step = 0;   ///< mm
    double share = 1;  ///< of its feed
};
Descent descent_of(const Tool& tool, const Material& material, double bends) {
    constexpr double kMostDivided = 64, kSlowest = 0.125;
    const double edges = std::hypot(material.kte, material.kfe);  // N for each mm of depth, whatever the feed
    const double held = bends / tip_bent_by(tool, edges) / tool.stepdown_max;
    return {tool.stepdown_max * std::clamp(held, 1 / kMostDivided, 1.0), std::clamp(held, kSlowest, 1.0)};
}

/// Minutes for what a tool gains: level by level down to it with its clearing step, once more over it with
/// the finishing step, a way in for each place, and the tool's change in each layer. Places are samples that
/// lie more than three diameters apart.
double minutes_for(const Tool& tool, const std::vector<const Sample*>& gained, double area_each,
                   std::size_t layers, const Machine& machine, const MissingToolOptions& options) {
    const double R = tool.diameter / 2, wide = tool.stepover * tool.diameter;
    const double fine =
        tool.kind == ToolKind::ball ? 2 * std::sqrt(options.cusp * (2 * R - options.cusp)) : wide;
    const Descent down = descent_of(tool, options.material, options.bends);
    double way = 0;
    std::vector<const Sample*> places;
    for (const Sample* s : gained) {
        const double levels = std::ceil((s->cell.place[2] - s->within[2]) / down.step);
        way += area_each / fine + area_each / wide * std::max(0.0, levels - 1);
        const bool apart = std::none_of(places.begin(), places.end(), [&](const Sample* p) {
            return p->layer == s->layer && std::hypot(p->cell.place[0] - s->cell.place[0],
                                                      p->cell.place[1] - s->cell.place[1]) < 6 * R;
        });
        if (apart) places.push_back(s);
    }
    return way / std::max(1.0, tool.max_feed * down.share) + kEntry * static_cast<double>(places.size()) +
           static_cast<double>(layers) * (machine.tool_change_s + machine.spindle_dwell_s) / 60;
}

}  // namespace

const char* name(OutOfReach reason) { return reason == OutOfReach::radius ? "radius" : "length"; }

std::vector<MissingTool> missing_tools(Context& context, const SimulationInput& input,
                                       const SimulationReport& report, const StandingPart& part,
                                       const MissingToolOptions& options) {
    double area_each = 0;
    const std::vector<Sample> samples = samples_of(input, report, part, options, area_each);
    if (samples.empty() || static_cast<double>(samples.size()) * area_each < kLeastGain) return {};
    struct Candidate {
        Tool tool;
        std::vector<char> gains;  // of each sample
    };
    std::array<std::vector<Candidate>, 2> kinds;
    for (std::size_t k = 0; k < 2; ++k)
        for (const CatalogueSize& size : catalogue_sizes(options.inch)) {
            const ToolKind kind = k == 0 ? ToolKind::flat : ToolKind::ball;
            if (const auto tool = tool_of(size, kind, input, options))
                kinds[k].push_back({*tool, std::vector<char>(samples.size(), 0)});
        }
    // The library's tools as thin as they are, but as long as one likes: what they reach so, length keeps
    // away.
    std::vector<Tool> bare = input.tools;
    for (Tool& tool : bare) tool.shank_diameter = tool.holder_diameter = tool.diameter;
    std::vector<char> length(samples.size(), 0);
    const std::size_t chunks = (samples.size() + kChunk - 1) / kChunk;
    parallel_each(context, chunks, [&](std::size_t chunk) {
        Asked asked(part, input, options);
        SimulationInput longer;
        longer.layers = input.layers;
        longer.tools = bare;
        Asked long_tools(part, longer, options);
        for (std::size_t i = chunk * kChunk; i < std::min(samples.size(), (chunk + 1) * kChunk); ++i) {
            // Where a tool fits a thinner one of its kind does: the thickest that gains is found by halving.
            for (auto& candidates : kinds) {
                std::size_t low = 0, high = candidates.size();
                while (low < high) {
                    const std::size_t middle = (low + high) / 2;
                    if (asked.reached(samples[i], candidates[middle].tool)) high = middle;
                    else low = middle + 1;
                }
                for (std::size_t c = low; c < candidates.size(); ++c) candidates[c].gains[i] = 1;
            }
            length[i] = static_cast<char>(long_tools.reached_by_library(samples[i]));
        }
    });

    std::vector<MissingTool> found;
    for (const auto& candidates : kinds) {
        double best = 0;
        for (const Candidate& c : candidates) {
            std::vector<const Sample*> gained;
            std::vector<int> layers;
            MissingTool missing;
            std::size_t too_short = 0;
            for (std::size_t i = 0; i < samples.size(); ++i) {
                if (!c.gains[i]) continue;
                const Sample& s = samples[i];
                gained.push_back(&s);
                too_short += static_cast<std::size_t>(length[i]);
                if (s.cell.left > missing.depth_mm) {
                    missing.depth_mm = s.cell.left;
                    missing.where = s.cell.place;
                }
                if (layers.empty() || layers.back() != static_cast<int>(s.layer))
                    layers.push_back(static_cast<int>(s.layer));
            }
            missing.gain_mm2 = static_cast<double>(gained.size()) * area_each;
            if (missing.gain_mm2 < kLeastGain || missing.gain_mm2 < kMore * best) continue;
            best = missing.gain_mm2;
            missing.tool = c.tool;
            missing.reason = 2 * too_short > gained.size() ? OutOfReach::length : OutOfReach::radius;
            missing.minutes = minutes_for(c.tool, gained, area_each, layers.size(), input.machine, options);
            missing.layers = std::move(layers);
            found.push_back(std::move(missing));
        }
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const MissingTool& a, const MissingTool& b) { return a.gain_mm2 > b.gain_mm2; });
    if (found.size() > kMostTools) found.resize(kMostTools);
    return found;
}

}  // namespace slabwright
