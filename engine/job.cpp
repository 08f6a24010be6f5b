#include "engine/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "kernels/errors.h"

namespace slabwright {

double max_layer_of(const Job& job, const Tool& tool) {
    // To touch a wall of slope a at the layer's bottom, a ball's tip passes it by R(1 - cos a); walls steeper
    // than the vertical limit go to the flat end mill, which stops at the bottom.
    const double steepest = job.cutting.vertical_deg * std::numbers::pi / 180;
    const double overrun = has_ball_tip(tool.kind) ? tip_diameter(tool) / 2 * (1 - std::cos(steepest)) : 0.0;
    return tool.flute_length - overrun - job.cutting.holder_clearance;
}

double max_bonded_layer_thickness(const Job& job) {
    double thickness = 1e6;
    for (const Tool& tool : job.tools)
        if (is_end_mill(tool.kind)) thickness = std::min(thickness, max_layer_of(job, tool));
    return thickness;
}

double max_layer_of_longest(const Job& job) {
    double flat = 0, ball = 0;
    for (const Tool& tool : job.tools) {
        if (roughs_layers(tool.kind)) flat = std::max(flat, max_layer_of(job, tool));
        if (tool.kind == ToolKind::ball) ball = std::max(ball, max_layer_of(job, tool));
    }
    return std::min(flat, ball);
}

namespace {

// Between pattern and flask, for a cutter so wide to pass, mm.
double gap_for(const Job& job, double diameter) {
    constexpr double kRoom = 2.5;  // the leads of finish passes swing out by 2
    return diameter + job.cutting.wall_allowance + kRoom;
}

}  // namespace

Job with_tools_for(const Job& job, double height) {
    Job fitted = job;
    constexpr double same = 1e-3;  // mm; layers keep to their limits within less
    std::erase_if(fitted.tools, [&](const Tool& tool) {
        return is_end_mill(tool.kind) && (max_layer_of(job, tool) < height - same ||
                                          (job.flask.enabled && job.flask.gap < gap_for(job, tool.diameter)));
    });
    return fitted;
}

Frame frame_of(const Machine& machine) {
    if (machine.frame != Frame::automatic) return machine.frame;
    return machine.table == BuildTable::moving ? Frame::layer_top : Frame::pattern_base;
}

double zero_height(const Machine& machine, double layer_top) {
    switch (frame_of(machine)) {
        case Frame::layer_top:
            return layer_top;
        case Frame::table_top:
            return -machine.base_board_thickness;
        case Frame::pattern_base:
        case Frame::automatic:
            break;
    }
    return 0;
}

double level_acceleration(const Machine& machine) {
    return machine.acceleration_y > 0 ? std::min(machine.acceleration, machine.acceleration_y)
                                      : machine.acceleration;
}

bool has_handler(const Machine& machine) {
    return machine.table == BuildTable::moving && machine.feed_height > 0 && machine.handler_speed > 0;
}

double handler_way(const Machine& machine) {
    constexpr double kOfTravel = 1.4;  // slabs as long as the router's travel, and room for the head
    return machine.handler_travel > 0 ? machine.handler_travel : kOfTravel * machine.travel_x;
}

GlueHead glue_head_of(const Machine& machine) {
    if (machine.glue_head != GlueHead::automatic) return machine.glue_head;
    return has_handler(machine) ? GlueHead::slab : GlueHead::none;
}

double max_layer_thickness(const Job& job) {
    const double slab = job.slabs.thicknesses.empty()
                            ? 0
                            : *std::max_element(job.slabs.thicknesses.begin(), job.slabs.thicknesses.end());
    return std::min(slab - job.slabs.facing_allowance, max_bonded_layer_thickness(job));
}

static_assert([] {
    std::size_t at = 0;
    for (const Control& control : kControls)
        if (control.post != static_cast<Post>(at++)) return false;
    return true;
}());

bool says_rounding(Post post) { return control_of(post).says_rounding; }
bool knows_tool_lengths(Post post) { return control_of(post).keeps_lengths; }
bool changes_tools(Post post) { return control_of(post).changes_tools; }

std::string program_file(Post post, const std::string& stem) {
    const Control& control = control_of(post);
    return control.before + stem + control.ending;
}

std::string program_file(const Machine& machine, const std::string& stem) {
    std::string file = program_file(machine.post, stem);
    if (!machine.own_post || machine.own_post->ending.empty()) return file;
    return file.substr(0, file.rfind('.')) + machine.own_post->ending;
}

double rough_blend(const Job& job) {
    return says_rounding(job.machine.post) ? rough_blend(job.cutting) : kJunction;
}

double rough_blend(const Cutting& cutting) {
    return std::max(kJunction, std::min(cutting.rough_blend,
                                        std::min(cutting.wall_allowance, cutting.floor_allowance) / 3));
}

double rough_fit(const Cutting& cutting) {
    return std::min(cutting.wall_allowance, cutting.floor_allowance) / 15;
}

double least_flask_gap(const Job& job) {
    const auto narrowest = [&](bool ball) {
        double least = 0;  // none
        for (const Tool& tool : job.tools)
            if (is_end_mill(tool.kind) && (tool.kind == ToolKind::ball) == ball &&
                (least == 0 || tool.diameter < least))
                least = tool.diameter;
        return least;
    };
    return gap_for(job, std::max(narrowest(false), narrowest(true)));
}

FeatureOptions feature_options(const Job& job) {
    FeatureOptions options;
    options.finder = job.layers.finder;
    options.chordal_deviation_mm = job.tolerances.chordal_deviation;
    options.flat_merge_mm = job.layers.flat_merge;
    options.shallow_limit_rad = job.material.shallow_limit_deg * std::numbers::pi / 180;
    options.halving_coarse_mm = job.layers.halving_coarse;
    options.halving_resolution_mm = job.layers.halving_resolution;
    return options;
}

bool plunges_by_default(ToolKind kind) {
    switch (kind) {
        case ToolKind::ball:
        case ToolKind::drill:
        case ToolKind::tapered_ball:
        case ToolKind::cone:
            return true;
        case ToolKind::flat:
        case ToolKind::face:
        case ToolKind::bull_nose:
            break;
    }
    return false;
}

CutterShape cutter_shape(const Tool& tool) {
    const double radius = tool.diameter / 2;
    switch (tool.kind) {
        case ToolKind::flat:
        case ToolKind::face:
            break;
        case ToolKind::ball:
            return {radius, radius, 0};
        case ToolKind::bull_nose:
            return {radius, tool.corner_radius, 0};
        case ToolKind::tapered_ball:
            return {radius, tool.corner_radius, tool.taper_deg * std::numbers::pi / 180};
        case ToolKind::drill:
        case ToolKind::cone:
            return {radius, 0, tool.point_deg / 2 * std::numbers::pi / 180};
    }
    return {radius, 0, 0};
}

bool has_flank_and_holder(const Tool& tool) {
    if (has_taper(tool.kind) && !(tool.taper_deg > 0 && tool.taper_deg < 90)) return false;
    if (has_point(tool.kind) && !(tool.point_deg > 0 && tool.point_deg < 180)) return false;
    return tool.holder_profile.size() % 3 == 0 &&
           std::all_of(tool.holder_profile.begin(), tool.holder_profile.end(),
                       [](double mm) { return mm > 0; });
}

std::vector<ToolSection> sections_of(const Tool& tool) {
    std::vector<ToolSection> sections;
    const double cutter = tool.diameter / 2;
    const auto add = [&](const char* name, double above, double lower, double upper, double height) {
        if (above <= 0 || std::max(lower, upper) <= cutter) return;
        // A frustum begins where it is as wide as the cutter.
        if (lower < cutter && upper > lower) {
            const double share = (cutter - lower) / (upper - lower);
            above += share * height, height *= 1 - share, lower = cutter;
        }
        sections.push_back({name, above, lower, std::max(lower, upper), upper > lower ? height : 0});
    };
    const double shank = tool.shank_diameter / 2, nose = tool.holder_diameter / 2;
    add("shank", tool.flute_length, shank, shank, 0);
    const std::span<const double> profile = tool.holder_profile;
    if (profile.empty()) add("holder", tool.stickout, nose, nose, 0);
    double above = tool.stickout;
    for (std::size_t k = 0; k + 2 < profile.size(); k += 3) {
        add("holder", above, profile[k + 1] / 2, profile[k + 2] / 2, profile[k]);
        above += profile[k];
    }
    return sections;
}

std::vector<ToolSection> cylinders_of(const Tool& tool) {
    constexpr double kStep = 0.5;  // mm
    std::vector<ToolSection> cylinders;
    for (const ToolSection& s : sections_of(tool)) {
        const int steps = s.height > 0 ? static_cast<int>(std::ceil((s.radius - s.lower) / kStep)) : 1;
        for (int k = 0; k < steps; ++k) {
            const double wide = k + 1 == steps ? s.radius : s.lower + (s.radius - s.lower) * (k + 1) / steps;
            cylinders.push_back({s.name, s.above + s.height * k / steps, wide, wide, 0});
        }
    }
    return cylinders;
}

double tip_diameter(const Tool& tool) {
    if (tool.kind == ToolKind::cone) return 0;
    return tool.kind == ToolKind::tapered_ball ? 2 * tool.corner_radius : tool.diameter;
}

namespace {

// What bends like a fluted cylinder of a tool's shank, which is solid.
double shank_bending_as(const Tool& tool) { return tool.shank_diameter / kFluteDiameterShare; }

// Calls fn(z, diameter, dz) for thin slices of a cutter with a taper from where it is loaded up to its
// holder; z over the load, and the diameter of what is fluted and bends as much.
template <class Fn>
void each_slice(const Tool& tool, Fn&& fn) {
    constexpr int kSlices = 200;
    const CutterShape shape = cutter_shape(tool);
    const double load = std::min(tool.stickout / 2, std::max(shape.corner, tool.stepdown_max / 2));
    const double from = shape.corner * (1 - std::sin(shape.taper_rad)), tangent = std::tan(shape.taper_rad);
    const double dz = (tool.stickout - load) / kSlices;
    for (int k = 0; k < kSlices; ++k) {
        const double z = load + (k + 0.5) * dz,
                     radius = shape.corner * std::cos(shape.taper_rad) + std::max(0.0, z - from) * tangent;
        const bool solid = z > tool.flute_length;
        const double width = 2 * std::min(radius, (solid ? tool.shank_diameter : tool.diameter) / 2);
        fn(z - load, solid ? width / kFluteDiameterShare : width, dz);
    }
}

bool is_upright(const Tool& tool) { return !has_taper(tool.kind) && tool.kind != ToolKind::cone; }

double fluted_length(const Tool& tool) { return std::min(tool.flute_length, tool.stickout); }

}  // namespace

double bending_diameter(const Tool& tool) {
    const auto cube = [](double v) { return v * v * v; };
    const double length = tool.stickout;
    double sum = 0;
    if (is_upright(tool)) {
        const double fluted = fluted_length(tool);
        if (fluted == length) return tool.diameter;
        sum = (cube(fluted) / std::pow(tool.diameter, 4) +
               (cube(length) - cube(fluted)) / std::pow(shank_bending_as(tool), 4)) /
              3;
    } else {
        each_slice(tool, [&](double z, double d, double dz) { sum += z * z / (d * d * d * d) * dz; });
    }
    return std::pow(cube(length) / (3 * sum), 0.25);
}

double tip_bent_by(const Tool& tool, double force_n) {
    return cutter_deflection(force_n, tool.stickout, bending_diameter(tool), 1e3 * tool.modulus_gpa);
}

double strength_diameter(const Tool& tool) {
    const auto cube = [](double v) { return v * v * v; };
    double most = 0;
    if (is_upright(tool)) {
        const double fluted = fluted_length(tool);
        if (fluted == tool.stickout) return tool.diameter;
        most = std::max(fluted / cube(tool.diameter), tool.stickout / cube(shank_bending_as(tool)));
    } else {
        each_slice(tool, [&](double z, double d, double) { most = std::max(most, z / (d * d * d)); });
    }
    return std::cbrt(tool.stickout / most);
}

bool is_end_mill(ToolKind kind) {
    switch (kind) {
        case ToolKind::flat:
        case ToolKind::ball:
        case ToolKind::bull_nose:
        case ToolKind::tapered_ball:
            return true;
        case ToolKind::face:
        case ToolKind::drill:
        case ToolKind::cone:
            break;
    }
    return false;
}

bool roughs_layers(ToolKind kind) {
    switch (kind) {
        case ToolKind::flat:
        case ToolKind::bull_nose:
            return true;
        case ToolKind::ball:
        case ToolKind::face:
        case ToolKind::drill:
        case ToolKind::tapered_ball:
        case ToolKind::cone:
            break;
    }
    return false;
}

bool mills(ToolKind kind) {
    switch (kind) {
        case ToolKind::flat:
        case ToolKind::ball:
        case ToolKind::face:
        case ToolKind::bull_nose:
        case ToolKind::tapered_ball:
        case ToolKind::cone:
            return true;
        case ToolKind::drill:
            break;
    }
    return false;
}

bool has_corner(ToolKind kind) { return kind == ToolKind::bull_nose || kind == ToolKind::tapered_ball; }
bool has_taper(ToolKind kind) { return kind == ToolKind::tapered_ball; }
bool has_point(ToolKind kind) { return kind == ToolKind::drill || kind == ToolKind::cone; }
bool has_ball_tip(ToolKind kind) { return kind == ToolKind::ball || kind == ToolKind::tapered_ball; }

double clearing_radius(const Tool& tool) {
    return tool.diameter / 2 - (tool.kind == ToolKind::bull_nose ? tool.corner_radius : 0);
}

double core_diameter_of(const Tool& tool) {
    constexpr double kFlatShare = 0.3, kFaceShare = 0.8;
    const bool face = tool.kind == ToolKind::face;
    if (tool.plunges || (!face && !roughs_layers(tool.kind))) return 0;
    if (tool.core_diameter >= 0) return tool.core_diameter;
    return (face ? kFaceShare : kFlatShare) * tool.diameter;
}

double ramp_limit_deg(const Tool& tool) {
    constexpr double kFlat = 10, kFace = 2, kAny = 90;
    if (tool.ramp_deg >= 0) return tool.ramp_deg;
    if (core_diameter_of(tool) <= 0) return kAny;
    return tool.kind == ToolKind::face ? kFace : kFlat;
}

double core_recess(const Tool& tool) {
    const double core = core_diameter_of(tool);
    return core > 0 ? core * std::tan(ramp_limit_deg(tool) * std::numbers::pi / 180) : 0;
}

double clearing_step(const Tool& tool) {
    return std::min(tool.stepover * tool.diameter, 2 * clearing_radius(tool));
}

const CuttingData* cutting_data_of(const Material& material, const Tool& tool) {
    const auto find = [&](std::span<const CuttingData> lines) {
        const auto found = std::find_if(lines.begin(), lines.end(), [&](const CuttingData& data) {
            return covers(data, tool.kind, tool.diameter, tool.flutes);
        });
        return found != lines.end() ? &*found : nullptr;
    };
    const CuttingData* const own = find(material.cutting);
    return own != nullptr ? own : find(lines_of(material.chart));
}

Job with_cutting_data(const Job& job) {
    Job fed = job;
    const Machine& machine = job.machine;
    for (Tool& tool : fed.tools) {
        const CuttingData* const data = cutting_data_of(job.material, tool);
        if (data != nullptr) {
            if (data->spindle_rpm > 0) tool.max_rpm = std::min(tool.max_rpm, data->spindle_rpm);
            if (data->surface_speed > 0)
                tool.max_rpm =
                    std::min(tool.max_rpm, std::max(machine.min_rpm, 1000 * data->surface_speed /
                                                                         (std::numbers::pi * tool.diameter)));
        }
        if (std::isinf(tool.max_rpm)) tool.max_rpm = Tool{}.max_rpm;
        if (data != nullptr) {
            const double rpm = std::min(tool.max_rpm, machine.max_rpm);
            tool.max_feed = std::min(tool.max_feed, std::max(1.0, data->chip_load * tool.flutes * rpm));
            tool.plunge_feed = std::min(tool.plunge_feed, tool.max_feed);
        }
        if (std::isinf(tool.max_feed)) tool.max_feed = Tool{}.max_feed;
    }
    return fed;
}

void state_feeds(Job& job) {
    const Job fed = with_cutting_data(job);
    for (std::size_t i = 0; i < job.tools.size(); ++i) {
        Tool& tool = job.tools[i];
        if (std::isinf(tool.max_rpm)) tool.max_rpm = fed.tools[i].max_rpm;
        if (std::isinf(tool.max_feed)) tool.max_feed = fed.tools[i].max_feed;
    }
}

const Tool& tool_of_kind(const Job& job, ToolKind kind) {
    static constexpr const char* words[] = {"flat end mill", "ball end mill",      "face mill",
                                            "drill",         "bull-nose end mill", "tapered ball end mill",
                                            "cone"};
    static constexpr const char* keys[] = {"flat",      "ball",         "face", "drill",
                                           "bull-nose", "tapered-ball", "cone"};
    const auto found =
        std::find_if(job.tools.begin(), job.tools.end(), [&](const Tool& tool) { return tool.kind == kind; });
    if (found != job.tools.end()) return *found;
    throw Error(
        ErrorKind::usage, "job.tool",
        fmt::format("the tool library has no {}", words[static_cast<int>(kind)]), "tool",
        fmt::format("add a [[tool]] with kind = \"{}\" to the job file", keys[static_cast<int>(kind)]));
}

}  // namespace slabwright
