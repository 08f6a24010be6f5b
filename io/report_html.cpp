#include "io/report_html.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "engine/base_board.h"
#include "engine/simulate/replay.h"
#include "io/read/input_file.h"
#include "io/read/planned_folder.h"
#include "io/report_template.h"
#include "io/text/base64.h"
#include "io/text/json_text.h"
#include "io/write/draw_json.h"
#include "io/write/output_file.h"
#include "io/write/report_as_built.h"
#include "io/write/report_cavities.h"
#include "io/write/report_draw.h"
#include "io/write/report_outlines.h"
#include "io/write/report_reach.h"
#include "io/write/report_undersides.h"
#include "io/write/thinned_path.h"
#include "kernels/access/deviation.h"
#include "kernels/errors.h"
#include "kernels/geometry/vectors.h"
#include "kernels/mesh/decimate.h"
#include "kernels/mesh/slopes.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // keys stay in the order in which plan.json has them

namespace {

constexpr std::size_t kMostFacets = 80'000, kFewestFacets = 2'000;   // of the model in the page
constexpr std::size_t kMostPoints = 400'000, kFewestPoints = 4'000;  // of all paths together
constexpr double kPathTolerance = 0.02;                              // mm, first try
constexpr double kWidestTolerance = 2.0;  // mm; paths that need more are left out, longest first
constexpr double kStockCells = 80'000, kAllStockCells = 800'000;  // of one layer's map, and of all
constexpr double kFinestCell = 0.25;                              // mm
constexpr int kSilhouetteRows = 140, kSlopeRows = 200;

constexpr std::string_view kDataMark = "/*slabwright:data*/null";
constexpr std::string_view kModelBegin = "<!--slabwright:3d-->", kModelEnd = "<!--/slabwright:3d-->";

/// Runs `body` over a document of OUT; what the JSON library says against it becomes an error with its name.
template <class Body>
auto understood(const fs::path& path, const char* code, Body&& body) {
    try {
        return body();
    } catch (const nlohmann::json::exception& e) {
        throw Error(ErrorKind::input, code, quoting_line(std::string("cannot be understood: ") + e.what()),
                    path.string(), "plan again");
    }
}

Json read_json(const fs::path& path, const char* code) {
    const std::string text = read_document(path, ErrorKind::input, code, "plan again");
    return understood(path, code, [&] { return Json::parse(text); });
}

double rounded(double value, int decimals) {
    const double scale = std::pow(10.0, decimals), r = std::round(value * scale) / scale;
    return r == 0 ? 0 : r;  // never −0
}

/// What a report is refused with.
const FolderRefusal kRefusal{ErrorKind::input, "report.plan", "report.program", "report.post"};

/// Loops with the loop that is around each, or −1.
Json outlines(const Loops& loops) {
    Json list = Json::array();
    for (std::size_t i = 0; i < loops.size(); ++i)
        list.push_back(
            {{"parent", loops.parents.empty() ? -1 : loops.parents[i]}, {"points", outline(loops.loop(i))}});
    return list;
}

/// The pattern seen along y and along x: per height, the intervals that it covers, [[x0, x1, …], …] in mm.
Json silhouette(std::span<const Section> sections, bool along_y) {
    Json rows = Json::array();
    for (const Section& section : sections) {
        std::vector<std::pair<double, double>> spans;
        for (std::size_t i = 0; i < section.loops.size(); ++i) {
            double low = kUnbounded, high = -kUnbounded;
            for (const Point2 p : section.loops.loop(i)) {
                const double v = to_mm(along_y ? p.x : p.y);
                low = std::min(low, v), high = std::max(high, v);
            }
            if (section.loops.parents.empty() || section.loops.parents[i] < 0) spans.emplace_back(low, high);
        }
        std::sort(spans.begin(), spans.end());
        std::vector<std::pair<double, double>> merged;
        for (const auto& span : spans)
            if (!merged.empty() && span.first <= merged.back().second)
                merged.back().second = std::max(merged.back().second, span.second);
            else merged.push_back(span);
        Json row = Json::array();
        for (const auto& [low, high] : merged)
            row.push_back(rounded(low, 2)), row.push_back(rounded(high, 2));
        rows.push_back(std::move(row));
    }
    return rows;
}

/// The paths as far as they have been thinned.
struct DrawnPaths {
    std::vector<std::vector<ReplayPoint>> paths;  ///< by program
    double tolerance = kPathTolerance,
           error = kPathTolerance;  ///< mm, of the last thinning and of all together
};

/// What the page is made of.
struct Figures {
    Json data;
    DrawnPaths drawn;
    DrawReport draw;
    Json replay;                 ///< the stock's cells, left-over maps
    Json wood;                   ///< what stands of each layer in the end
    Json feeds = Json::array();  ///< of each program
};

double stock_cell(const SimulationInput& input) {
    const double area = (input.stock_max[0] - input.stock_min[0]) * (input.stock_max[1] - input.stock_min[1]);
    const double cells = std::min(kStockCells, kAllStockCells / static_cast<double>(input.layers.size()));
    return std::max(kFinestCell, std::ceil(std::sqrt(area / cells) * 100) / 100);
}

/// A left-over as one byte: 0 … 253 is the root of its size, so that small ones keep their digits; 254 is cut
/// into the part deeper than the tolerance, 255 the flask.
std::uint8_t left_over_code(float left, double gouge) {
    if (std::isnan(left)) return 255;
    if (left < -gouge) return 254;
    return static_cast<std::uint8_t>(
        std::min(253.0, std::round(100 * std::sqrt(std::max(0.0, static_cast<double>(left))))));
}

/// Reads a file of OUT and its programs. @param first of them
std::vector<Program> read_file(const PlannedFolder& folder, std::size_t first) {
    try {
        return folder.read_file(first, kRefusal);
    } catch (const Error& e) {
        throw Error(ErrorKind::input, "report.program", e.message(), e.place(), e.remedy());
    }
}

/// Between which feeds a program cuts, mm/min, in the plane and straight down; null where it never does.
Json feeds_json(const Program& program) {
    const CuttingFeeds feeds = cutting_feeds(program);
    const auto json = [](double feed) { return feed > 0 ? Json(rounded(feed, 0)) : Json(); };
    return {{"low", json(feeds.low)}, {"high", json(feeds.high)}, {"plunge", json(feeds.plunge)}};
}

/// What stands over in the end takes up to a fifth of the time of the replay: so many programs' steps.
std::size_t left_over_steps(const PlannedFolder& folder) { return 1 + folder.build.programs.size() / 8; }

/// Runs every program, one layer's after the other's. The replay's figures go into the page with a light page
/// too; its maps only with the model.
/// @param programs those that have been read already; each is let go when it has run, the others are read
/// @param part of the input's mesh; none with a light page
void replay_programs(Context& context, const PlannedFolder& folder, const SimulationInput& input,
                     std::vector<Program> programs, const StandingPart* part, Figures& figures) {
    ReplayOptions options;
    options.cell = stock_cell(input);
    options.cusp = folder.build.job.tolerances.cusp;
    options.material = folder.build.job.material;
    Replay replay(context, input, options);
    std::map<std::string, Program*> read;
    for (Program& program : programs) read.emplace("nc/" + program.file, &program);
    Json engagement = Json::array();
    figures.drawn.paths.resize(folder.build.programs.size());
    for (std::size_t begin = 0; begin < folder.build.programs.size();) {
        std::size_t end = begin;
        while (end < folder.build.programs.size() &&
               folder.build.programs[end].layer == folder.build.programs[begin].layer)
            ++end;
        std::vector<Program> of_layer(end - begin);
        std::vector<std::size_t> files;  // the first program of each
        for (std::size_t p = begin; p < end; p = folder.file_end(p)) files.push_back(p);
        parallel_each(context, files.size(), [&](std::size_t f) {
            const std::size_t first = files[f], past = folder.file_end(first);
            const bool known = read.contains(folder.build.programs[first].file);
            std::vector<Program> fresh = known ? std::vector<Program>() : read_file(folder, first);
            for (std::size_t p = first; p < past; ++p) {
                Program& program = of_layer[p - begin];
                program =
                    known ? std::move(*read.at(folder.build.programs[p].file)) : std::move(fresh[p - first]);
                if (part == nullptr) continue;
                figures.drawn.paths[p] = path_of(program, input.machine.rapid_feed, kPathTolerance);
            }
        });
        for (std::size_t i = 0; i < of_layer.size(); ++i) {
            figures.feeds.push_back(feeds_json(of_layer[i]));
            figures.drawn.error = std::max(figures.drawn.error, kPathTolerance + of_layer[i].chord_error);
            const ReplayedProgram found = replay.run(of_layer[i]);
            Json depth = Json::array(), width = Json::array(), force = Json::array(),
                 deflection = Json::array();
            for (const ReplayPiece& piece : found.pieces) {
                depth.push_back(rounded(piece.depth_mm, 3)), width.push_back(rounded(piece.width_mm, 3));
                force.push_back(rounded(piece.force_n, 2)),
                    deflection.push_back(rounded(piece.deflection_mm, 5));
            }
            engagement.push_back({{"file", folder.build.programs[begin + i].file},
                                  {"depth_mm", depth},
                                  {"width_mm", width},
                                  {"force_n", force},
                                  {"deflection_mm", deflection}});
            context.advance();
        }
        begin = end;
    }
    figures.data["engagement"] = std::move(engagement);
    figures.data["feeds"] = std::move(figures.feeds);
    figures.data["stock"] = {{"cell_mm", options.cell},
                             {"nx", replay.nx()},
                             {"ny", replay.ny()},
                             {"x0", replay.first()[0]},
                             {"y0", replay.first()[1]}};
    if (part == nullptr) return;
    figures.replay = Json::array();
    figures.wood = Json::array();
    replay.finished(*part, [&](std::size_t layer, const ReplayedLayer& found) {
        std::string codes;
        for (const float left : found.left)
            codes += static_cast<char>(left_over_code(left, folder.build.job.tolerances.gouge));
        figures.replay.push_back(base64(codes));
        const PackedHeights wood = packed_wood(input.layers[layer], found.surface);
        figures.wood.push_back({{"rle", wood.in_runs}, {"data", wood.base64}});
    });
    const PackedFilling filled = packed_filling(context, input.mesh, input.layers, milled_below(folder),
                                                replay.first(), options.cell, replay.nx(), replay.ny());
    Json layers = Json::array();
    for (const PackedFilling::Layer& l : filled.layers)
        layers.push_back({{"boxes", l.boxes}, {"mm3", l.mm3}, {"below", l.below}});
    figures.data["filled"] = {{"z0", filled.z0},
                              {"height", filled.height},
                              {"tolerance_mm", filled.tolerance},
                              {"layers", std::move(layers)}};
    context.advance(left_over_steps(folder));
}

/// Where glue goes under each layer, and what the machine's glue head does there.
void draw_glue(const Json& sequence, Json& layers) {
    const Json& glue = sequence.at("glue");
    for (std::size_t l = 0; l < std::min(glue.size(), layers.size()); ++l) {
        for (const Json& loop : glue[l].at("loops")) {
            std::vector<Point2> points;
            for (const Json& p : loop)
                points.push_back({to_units(p.at(0).get<double>()), to_units(p.at(1).get<double>())});
            layers[l]["glue"].push_back(outline(points));
        }
        if (!glue[l].contains("beads")) continue;
        Json& beads = layers[l]["beads"] = Json::array();
        for (const Json& bead : glue[l].at("beads"))
            for (const Json& at : bead) beads.push_back(std::llround(at.get<double>() * kHundredths));
        const std::string pointer = "#/glue/" + std::to_string(l);
        for (const Json& step : sequence.at("steps"))
            if (step.at("action") == "glue" && step.value("polygons", "") == pointer)
                for (const char* key : {"side", "bead_mm", "speed_mm_min", "glue_g", "pump_g_min"})
                    if (step.contains(key)) layers[l]["glue_head"][key] = step.at(key);
    }
}

/// Sections at the layers' ends, glue, silhouettes, slopes: what pictures are drawn from.
void draw_figures(Context& context, MeshView mesh, const PlannedFolder& folder, const Json& sequence,
                  Json& data) {
    const SimulationInput& input = folder.simulation;
    const Box3 box = bounds(context, mesh);
    std::vector<Plane> planes;
    for (const SimulatedLayer& layer : input.layers) {
        // Clearly within the layer: its ends are as high as vertices there but for rounding.
        const double top = std::min(layer.z_top, static_cast<double>(box.max.z)),
                     within = std::min(0.01, (top - layer.z_bottom) / 4);
        planes.push_back({layer.z_bottom + within, Side::above});
        planes.push_back({top - within, Side::below});
    }
    const double step = (static_cast<double>(box.max.z) - box.min.z) / kSilhouetteRows;
    for (int i = 0; i < kSilhouetteRows; ++i) planes.push_back({box.min.z + (i + 0.5) * step, Side::above});
    const std::vector<Section> sections = slice(context, mesh, planes);
    const std::size_t ends = 2 * input.layers.size();
    const auto between = std::span<const Section>(sections).subspan(ends);
    std::vector<Json> drawn(ends + 2);
    parallel_each(context, drawn.size(), [&](std::size_t i) {
        drawn[i] = i < ends ? outlines(sections[i].loops) : silhouette(between, i == ends);
    });
    Json layers = Json::array();
    for (std::size_t l = 0; l < input.layers.size(); ++l)
        layers.push_back({{"bottom", std::move(drawn[2 * l])},
                          {"top", std::move(drawn[2 * l + 1])},
                          {"glue", Json::array()}});
    if (sequence.is_object()) draw_glue(sequence, layers);
    data["outlines"] = {
        {"unit_mm", 1 / kHundredths}, {"tolerance_mm", kOutlineTolerance}, {"layers", std::move(layers)}};
    data["silhouette"] = {{"z0", rounded(box.min.z, 4)},
                          {"dz", step},
                          {"x", std::move(drawn[ends])},
                          {"y", std::move(drawn[ends + 1])}};
    const SlopeProfile slopes = slope_profile(context, mesh, kSlopeRows);
    Json least = Json::array(), areas = Json::array();
    for (const double v : slopes.least_deg) least.push_back(rounded(v, 2));
    for (const double v : slopes.area_mm2) areas.push_back(rounded(v, 1));
    data["slopes"] = {{"z0", rounded(slopes.z_low, 4)},
                      {"dz", (slopes.z_high - slopes.z_low) / kSlopeRows},
                      {"least_deg", std::move(least)},
                      {"area_mm2", std::move(areas)},
                      {"down_flat_mm2", rounded(slopes.down_flat_mm2, 1)},
                      {"undercut_mm2", rounded(slopes.undercut_mm2, 1)}};
}

/// What keeps the pattern from being drawn, and where it is narrow. It is looked for before all else, while
/// memory is left.
void look_at_pattern(Context& context, MeshView mesh, const PlannedFolder& folder, Figures& figures) {
    figures.draw = draw_within_memory(context, mesh);
    JsonText draw;
    put_draw(draw, figures.draw);
    figures.data["draw"] = Json::parse(draw.take());
    Job job = folder.build.job;
    job.tools = folder.simulation.tools;
    std::vector<double> tops;
    for (const SimulatedLayer& layer : folder.simulation.layers) tops.push_back(layer.z_top);
    figures.data["cavities"] = Json::parse(report_cavities(context, mesh, job, tops));
    if (!folder.build.undersides.empty())
        figures.data["undersides"] = Json::parse(report_undersides(context, folder, mesh, kRefusal));
}

/// The pattern for the 3D view: places as 16-bit shares of its box.
/// @param model of the mesh, decimated
Json model_json(Context& context, MeshView mesh, Mesh model, const StandingPart& part,
                const PlannedFolder& folder, const DrawReport& draw) {
    const Box3 box = bounds(context, mesh);
    const float low[3] = {box.min.x, box.min.y, box.min.z}, high[3] = {box.max.x, box.max.y, box.max.z};
    std::string vertices, indices;
    for (Vec3f& v : model.vertices) {
        float* const at[3] = {&v.x, &v.y, &v.z};
        for (std::size_t k = 0; k < 3; ++k) {
            const double extent = std::max(1e-9, static_cast<double>(high[k]) - low[k]);
            const auto share = static_cast<std::uint16_t>(
                std::clamp(std::round((*at[k] - low[k]) / extent * 65535), 0.0, 65535.0));
            append_little_endian(vertices, share);
            *at[k] = static_cast<float>(
                low[k] + share * extent / 65535);  // so that the stated error is that of what is shown
        }
    }
    const SimulationInput& input = folder.simulation;
    const ReachMap reach =
        reach_map(context, part, input, board_cut_limit(folder.build.job.machine, input.tools), model.view());
    const bool narrow = model.vertices.size() <= 65536;
    for (const Index3& f : model.facets)
        for (const std::uint32_t v : f) {
            if (narrow) append_little_endian(indices, static_cast<std::uint16_t>(v));
            else append_little_endian(indices, v);
        }
    return {{"facets", model.facets.size()},
            {"of", mesh.facets.size()},
            {"error_mm", rounded(surface_deviation(context, part, StandingPart(context, model.view())), 4)},
            {"min", {low[0], low[1], low[2]}},
            {"max", {high[0], high[1], high[2]}},
            {"index_bytes", narrow ? 2 : 4},
            {"vertices", base64(vertices)},
            {"indices", base64(indices)},
            {"reach_mm", kReachDistance},
            {"reach_cell_mm", rounded(reach.cell_mm, 2)},
            {"reach", base64(reach.codes)},
            {"draw", base64(draw_codes(context, mesh, draw, model.view()))}};
}

/// All paths within a number of points: the tolerance is doubled until they fit, then the longest are left
/// out.
/// @param drawn thinned further where that is needed: fewer points come from where more ended
Json paths_json(Context& context, DrawnPaths& drawn, const PlannedFolder& folder, std::size_t most) {
    const auto sizes_now = [&] {
        std::vector<std::size_t> sizes;
        for (const auto& path : drawn.paths) sizes.push_back(path.size());
        return sizes;
    };
    std::vector<std::size_t> sizes = sizes_now();
    const auto count = [&] { return std::accumulate(sizes.begin(), sizes.end(), std::size_t{0}); };
    while (count() > most && drawn.tolerance < kWidestTolerance) {
        drawn.tolerance *= 2;
        drawn.error += drawn.tolerance;  // each thinning works on what the one before left
        parallel_each(context, drawn.paths.size(),
                      [&](std::size_t i) { thin(drawn.paths[i], drawn.tolerance); });
        sizes = sizes_now();
    }
    std::vector<char> left_out(sizes.size(), 0);
    while (count() > most) {
        const auto longest = std::max_element(sizes.begin(), sizes.end());
        left_out[static_cast<std::size_t>(longest - sizes.begin())] = 1;
        *longest = 0;
    }
    const auto shown = [&](std::size_t i) {
        return left_out[i] ? std::span<const ReplayPoint>() : std::span<const ReplayPoint>(drawn.paths[i]);
    };
    double low[3] = {kUnbounded, kUnbounded, kUnbounded}, high[3] = {-kUnbounded, -kUnbounded, -kUnbounded};
    for (std::size_t i = 0; i < sizes.size(); ++i)
        for (const ReplayPoint& p : shown(i)) {
            const double at[3] = {p.x, p.y, p.z};
            for (std::size_t k = 0; k < 3; ++k)
                low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
        }
    double quantum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        if (high[k] < low[k]) low[k] = high[k] = 0;
        quantum = std::max(quantum, (high[k] - low[k]) / 65535 / 2);
    }
    Json programs = Json::array();
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const std::span<const ReplayPoint> path = shown(i);
        // x, y, z as shares of the box; time as a share of the program's, its lowest bit says rapid.
        std::string bytes;
        const double seconds = path.empty() ? 0 : path.back().seconds;
        for (const ReplayPoint& p : path) {
            const double at[3] = {p.x, p.y, p.z};
            for (std::size_t k = 0; k < 3; ++k)
                append_little_endian(
                    bytes, static_cast<std::uint16_t>(
                               std::round((at[k] - low[k]) / std::max(1e-9, high[k] - low[k]) * 65535)));
            const auto share =
                static_cast<std::uint16_t>(seconds > 0 ? std::floor(p.seconds / seconds * 32767) : 0);
            append_little_endian(bytes,
                                 static_cast<std::uint16_t>(share << 1 | static_cast<unsigned>(p.rapid)));
        }
        programs.push_back({{"file", folder.build.programs[i].file},
                            {"points", path.size()},
                            {"left_out", left_out[i] != 0},
                            {"data", base64(bytes)}});
    }
    return {{"tolerance_mm", rounded(drawn.error + quantum * std::sqrt(3.0), 4)},
            {"min", {low[0], low[1], low[2]}},
            {"max", {high[0], high[1], high[2]}},
            {"programs", std::move(programs)}};
}

/// A document as it may stand in a script element: nothing in it can end the element.
std::string script_text(const Json& document) {
    const std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
    std::string safe;
    safe.reserve(text.size());
    for (const char c : text) {
        if (c == '<') safe += "\\u003c";
        else safe += c;
    }
    return safe;
}

std::string page(const Json& data, bool three_d) {
    std::string text(report_template());
    if (!three_d)
        for (std::size_t begin = 0; (begin = text.find(kModelBegin)) != std::string::npos;) {
            const std::size_t end = text.find(kModelEnd, begin);
            text.erase(begin, end - begin + kModelEnd.size());
        }
    const std::size_t mark = text.find(kDataMark);
    if (mark == std::string::npos)
        throw Error(ErrorKind::usage, "report.not_built", "the page that was built in has no place for data",
                    "", "build again");
    return text.replace(mark, kDataMark.size(), script_text(data));
}

}  // namespace

ReportWork report_work(std::uint64_t steps, std::uint64_t facets) {
    // Fitted to the metre pattern of 0.1 to 10 M facets, whose programs have 4 M steps. The replay's stock
    // has about as many points whatever its size, and longer programs are those of larger patterns: its time
    // grows as the root of the steps, 1 s at a million.
    const double shown = static_cast<double>(std::min<std::uint64_t>(facets, kMostFacets)),
                 all = static_cast<double>(facets);
    return {1000 * std::sqrt(static_cast<double>(steps)),
            0.15e6 + 2.7 * shown + (facets > kMostFacets ? 1e6 + 0.12 * all : 0)};
}

bool reports_are_built() { return !report_template().empty(); }

std::string report_html(Context& context, const std::string& directory, const ReportOptions& options,
                        std::optional<Verification> verified) {
    if (!reports_are_built())
        throw Error(ErrorKind::usage, "report.not_built", "this build of slabwright has no report page", "",
                    "run tools/setup, which fetches its parts, and build again with SLABWRIGHT_REPORT=ON");
    if (!(options.size_limit_mb > 0))
        throw Error(ErrorKind::usage, "report.size_limit", "a page of no size is none", "--size-limit",
                    "give megabytes");
    const fs::path out(directory);
    const PlannedFolder folder = read_planned_folder(out, kRefusal);
    const Json plan = Json::parse(folder.document);
    const Json sequence =
        fs::exists(out / "sequence.json") ? read_json(out / "sequence.json", "report.sequence") : Json();
    const Json verify =
        fs::exists(out / "verify.json") ? read_json(out / "verify.json", "report.verify") : Json();
    const std::shared_ptr<Pattern> pattern =
        verified ? std::move(verified->pattern)
                 : read_planned_pattern(context, directory, folder.pattern, options.source, "report");
    std::vector<Program> programs;
    if (verified) programs = std::move(verified->input.programs);
    verified.reset();
    const MeshView mesh = pattern->read.mesh.view();
    std::uint64_t moves = 0;
    for (const Program& program : programs) moves += program.steps.size();
    const ReportWork work = report_work(moves, mesh.facets.size());
    const double replayed = options.three_d ? 0.02 + 0.98 * work.replay / (work.replay + work.page) : 1.0;
    context.begin_phase("report", 0.02, replayed, folder.build.programs.size() + left_over_steps(folder));
    Figures figures;
    figures.data = {
        {"schema", "slabwright.report/1"}, {"three_d", options.three_d}, {"plan", plan}, {"verify", verify}};
    look_at_pattern(context, mesh, folder, figures);
    const auto draw = [&] {
        Json& steps = figures.data["steps"] = Json::array();
        if (sequence.is_object())
            for (const Json& step : sequence.at("steps"))
                steps.push_back({step.at("layer").get<int>(), step.at("action").get<std::string>(),
                                 step.at("seconds").get<double>(),
                                 step.value("program", step["action"] == "load_tool" ? step : Json())});
        draw_figures(context, mesh, folder, sequence, figures.data);
        return 0;
    };
    SimulationInput input = folder.simulation;
    input.mesh = mesh;
    if (options.three_d && !pattern->part) pattern->part.emplace(context, mesh);
    // The model needs nothing of the figures, and its rounds keep one thread busy.
    std::size_t facets = kMostFacets, points = kMostPoints;
    Mesh decimated;
    parallel_each(context, options.three_d ? 2 : 1, [&](std::size_t i) {
        if (i > 0) {
            decimated = decimate(context, mesh, facets);
            return;
        }
        understood(out / "sequence.json", "report.sequence", draw);
        replay_programs(context, folder, input, std::move(programs),
                        options.three_d ? &*pattern->part : nullptr, figures);
    });
    context.throw_if_cancelled();
    const auto limit = static_cast<std::size_t>(options.size_limit_mb * 1e6);
    const auto too_large = [&](std::size_t size) {
        return Error(ErrorKind::usage, "report.size_limit",
                     fmt::format("the page has {:.2f} MB at least, {:.2f} MB are allowed",
                                 static_cast<double>(size) / 1e6, options.size_limit_mb),
                     "--size-limit",
                     options.three_d ? "allow more, or leave out the model with --no-3d" : "allow more");
    };
    if (!options.three_d) {
        std::string text = page(figures.data, false);
        if (text.size() > limit) throw too_large(text.size());
        return text;
    }
    figures.data["left_over"] = {{"layers", figures.replay}};
    figures.data["wood"] = {{"layers", figures.wood}};
    context.begin_phase("report's model and paths", replayed, 1.0, 3);
    Json model, paths;
    parallel_each(context, 2, [&](std::size_t i) {
        if (i > 0) paths = paths_json(context, figures.drawn, folder, points);
        else model = model_json(context, mesh, std::move(decimated), *pattern->part, folder, figures.draw);
        context.advance();
    });
    for (;;) {
        figures.data["model"] = model;
        figures.data["paths"] = paths;
        std::string text = page(figures.data, true);
        context.throw_if_cancelled();
        if (text.size() <= limit) {
            context.advance();
            return text;
        }
        // Paths are thinned before the model: they take more, and lose less.
        if (points > kFewestPoints) {
            points /= 2;
            paths = paths_json(context, figures.drawn, folder, points);
        } else if (facets > kFewestFacets) {
            facets /= 2;
            model = model_json(context, mesh, decimate(context, mesh, facets), *pattern->part, folder,
                               figures.draw);
        } else {
            throw too_large(text.size());
        }
    }
}

void write_report(Context& context, const std::string& directory, const ReportOptions& options,
                  std::optional<Verification> verified) {
    write_file_in(directory, "report.html", report_html(context, directory, options, std::move(verified)));
}

}  // namespace slabwright
