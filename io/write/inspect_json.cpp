#include "io/write/inspect_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/text/json_text.h"
#include "io/write/cavities_json.h"
#include "io/write/draw_json.h"
#include "io/write/draw_ply.h"
#include "io/write/edges_json.h"
#include "io/write/milled_ways_json.h"
#include "io/write/output_file.h"
#include "io/write/plan_json.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

using Shape = JsonText::Shape;

struct NamedFinding {
    const char* name;
    const char* words;
    const Finding& finding;
};

std::vector<NamedFinding> findings(const MeshReport& report) {
    return {{"open_edges", "open edges", report.open_edges},
            {"open_edges_off_base", "open edges off the base", report.open_edges_off_base},
            {"non_manifold_edges", "edges with more than two facets", report.non_manifold_edges},
            {"misoriented_edges", "edges whose facets disagree on the outside", report.misoriented_edges},
            {"degenerate_facets", "degenerate facets", report.degenerate_facets},
            {"duplicate_facets", "duplicate facets", report.duplicate_facets},
            {"inverted_components", "bodies turned inside out", report.inverted_components}};
}

std::string mm(double value, int decimals = 3) {
    std::string text;
    append_rounded(text, value, decimals);
    return text;
}

void put_holes(JsonText& json, const std::vector<RoundHole>& holes) {
    json.key("holes").begin_array();
    for (const RoundHole& hole : holes) {
        json.begin_object(Shape::line).key("kind").string(name(hole.kind));
        json.key("bottom").string(name(hole.bottom));
        json.key("diameter").rounded(hole.diameter_mm, 4).key("depth").rounded(hole.depth_mm, 4);
        json.key("chord").rounded(hole.chord_mm, 4);
        json.key("mouth").begin_array();
        for (const double x : hole.mouth) json.rounded(x, 4);
        json.end().key("into").begin_array();
        for (const double x : hole.into) json.rounded(x, 6);
        json.end().key("steps").begin_array();
        for (const HoleStep& step : hole.steps) {
            json.begin_object().key("from").rounded(step.from_mm, 4).key("to").rounded(step.to_mm, 4);
            json.key("diameter").rounded(step.diameter_mm, 4);
            json.key("end_diameter").rounded(step.end_diameter_mm, 4).end();
        }
        json.end().key("facets").count(hole.facets.size()).key("first_facet").count(hole.facets.front());
        json.end();
    }
    json.end();
}

std::string hole_line(const RoundHole& hole) {
    std::string line = fmt::format("  hole        {} {} mm", name(hole.kind), mm(hole.diameter_mm));
    line += fmt::format(", {} mm deep, {} at x {} y {} z {}", mm(hole.depth_mm),
                        hole.bottom == HoleBottom::open    ? "open below,"
                        : hole.bottom == HoleBottom::other ? "with a bottom of another form,"
                                                           : fmt::format("{} bottom,", name(hole.bottom)),
                        mm(hole.mouth[0], 2), mm(hole.mouth[1], 2), mm(hole.mouth[2], 2));
    constexpr double upright = 0.99999848;  // cosine of .1°
    if (std::abs(hole.into[2]) < upright)
        line += fmt::format(", into {} {} {}", mm(hole.into[0], 4), mm(hole.into[1], 4), mm(hole.into[2], 4));
    return line + "\n";
}

void look_at_sides(Context& context, MeshView mesh, const Job& job, Inspection& result) {
    constexpr double nothing = 0.5;  // mm³
    try {
        result.ways = {milled_way(context, mesh, job, {0, 0, 0})};
        const MilledWay& lies = result.ways.front();
        if (lies.above.air.volume_mm3 >= nothing || lies.both_sides.air.volume_mm3 >= nothing)
            result.ways = milled_ways(context, mesh, job);
    } catch (const Error& error) {
        if (error.code() != "layers.request") throw;
        result.ways.clear();
        result.diagnostics.push_back(
            {Severity::note, "layers.request", fmt::format("no layers: {}", error.message()), {}});
    }
}

void look_at_cavities(Context& context, MeshView mesh, const Job& job, const CavityOptions& limits,
                      Inspection& result) {
    result.cavity_limits = limits;
    if (result.ways.empty()) return;  // no layers can be placed, which is told
    std::vector<double> tops = result.ways.front().above.tops;
    const double base = bounds(context, mesh).min.z;
    for (double& top : tops) top += base;
    result.cavities = advise_on_cavities(job, find_cavities(context, mesh, tops, result.features, limits));
}

}  // namespace

Inspection inspect_pattern(Context& context, const PatternSource& source, const Job& job,
                           const InspectionOptions& asked) {
    Inspection result;
    PatternMesh pattern = read_pattern_mesh(context, source, reading_options(job));
    result.input = pattern.input;
    result.diagnostics = pattern.diagnostics;
    try {
        require_solid(context, pattern, source.name());
        result.solid = true;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        result.unusable = error.what();
    }
    if (result.solid) {
        const FeatureOptions options = feature_options(job);
        context.begin_phase("features", 0.3, 0.6);
        FeatureSet found = find_features(context, pattern.mesh.view(), options);
        result.features = std::move(found.features);
        result.disagreements = std::move(found.disagreements);
        context.begin_phase("holes", 0.6, 0.7);
        result.holes = find_holes(context, pattern.mesh.view());
        result.edges = find_edge_chains(context, pattern.mesh.view(), asked.edge_deg);
        result.edge_limit_deg = asked.edge_deg;
        context.begin_phase("draw", 0.7, 0.72);
        result.draw = check_draw(context, pattern.mesh.view(), asked.draw);
        if (!asked.map.empty())
            write_file_whole(asked.map, draw_ply(pattern.mesh.view(), result.draw, pattern.input.file));
        context.begin_phase("undercuts", 0.72, 0.75);
        const double tops[] = {double{bounds(pattern.mesh.view()).max.z}};
        result.undercuts = measure_undercuts(context, pattern.mesh.view(), tops, options);
        context.begin_phase("sides", 0.75, 0.9);
        look_at_sides(context, pattern.mesh.view(), job, result);
        context.begin_phase("cavities", 0.9, 1.0);
        look_at_cavities(context, pattern.mesh.view(), job, asked.cavities, result);
    }
    result.report = std::move(pattern.report);
    return result;
}

std::string inspection_json(const Inspection& inspection) {
    const MeshReport& report = inspection.report;
    JsonText json;
    json.begin_object();
    json.key("schema").string("slabwright.inspect/1");
    json.key("units").string("mm");
    json.key("input");
    put_input(json, inspection.input);
    json.key("solid").boolean(inspection.solid);
    json.key("unusable");
    if (inspection.solid) json.null();
    else json.string(inspection.unusable);
    json.key("mesh").begin_object();
    json.key("facets").count(report.facets);
    json.key("vertices").count(report.vertices);
    json.key("components").count(report.components);
    json.key("volume_mm3").rounded(inspection.input.volume_mm3, 3);
    json.key("area_mm2").rounded(report.area_mm2, 3);
    for (const NamedFinding& f : findings(report)) {
        json.key(f.name).begin_object(Shape::line).key("count").count(f.finding.count).key("first_facet");
        if (f.finding.count == 0) json.null();
        else json.count(f.finding.first_facet);
        json.end();
    }
    json.end();
    json.key("features");
    put_features(json, inspection.features);
    json.key("disagreements").begin_array();
    for (const FinderDisagreement& d : inspection.disagreements) {
        json.begin_object(Shape::line).key("type").string(name(d.type)).key("z").rounded(d.z, 6);
        json.key("xy")
            .begin_array()
            .rounded(d.x, 6)
            .rounded(d.y, 6)
            .end()
            .key("found_by")
            .string(name(d.found_by))
            .end();
    }
    json.end();
    put_holes(json, inspection.holes);
    json.key("edges");
    if (inspection.solid) put_edges(json, inspection.edges, inspection.edge_limit_deg);
    else json.null();
    json.key("cavities");
    if (inspection.solid) put_cavities(json, inspection.cavities, inspection.cavity_limits);
    else json.null();
    json.key("undercuts").begin_array();
    for (const UnmadeUndercut& u : inspection.undercuts) {
        json.begin_object(Shape::line).key("type").string(name(u.type));
        json.key("z").begin_array().rounded(u.z_low, 6).rounded(u.z_high, 6).end();
        json.key("area").rounded(u.area_mm2, 3).key("height").rounded(u.height_mm, 4);
        json.key("thickness").rounded(u.thickness_mm, 4).key("volume").rounded(u.volume_mm3, 1);
        json.key("where").begin_array().rounded(u.x, 4).rounded(u.y, 4).rounded(u.z, 4).end().end();
    }
    json.end();
    json.key("draw");
    if (inspection.solid) put_draw(json, inspection.draw);
    else json.null();
    json.key("ways");
    put_milled_ways(json, inspection.ways);
    json.key("diagnostics");
    put_diagnostics(json, inspection.diagnostics);
    json.end();
    return json.take();
}

std::string inspection_text(const Inspection& inspection) {
    const MeshReport& report = inspection.report;
    const InputInfo& input = inspection.input;
    std::string text = fmt::format("{}\n", input.file);
    text += fmt::format("  size        {} x {} x {} mm\n", mm(input.max[0] - input.min[0]),
                        mm(input.max[1] - input.min[1]), mm(input.max[2] - input.min[2]));
    text += fmt::format("  facets      {} in {} {}\n", report.facets, report.components,
                        report.components == 1 ? "body" : "bodies");
    text += fmt::format("  volume      {} cm3, surface {} cm2\n", mm(input.volume_mm3 / 1000, 2),
                        mm(report.area_mm2 / 100, 2));
    for (const NamedFinding& f : findings(report))
        if (f.finding.count > 0)
            text += fmt::format("  {:<11} {}, the first at facet {}\n", f.finding.count, f.words,
                                f.finding.first_facet);
    if (!inspection.solid) text += fmt::format("  not usable: {}\n", inspection.unusable);
    // A castings mesh can have thousands of features of one kind; people need the count and the most
    // important ones.
    constexpr std::size_t shown = 12;
    for (int t = 0; t <= static_cast<int>(FeatureType::saddle); ++t) {
        const FeatureType type = static_cast<FeatureType>(t);
        std::vector<const Feature*> of_type;
        for (const Feature& f : inspection.features)
            if (f.type == type) of_type.push_back(&f);
        if (of_type.empty()) continue;
        text += fmt::format("  {:<11} {}:", name(type), of_type.size());
        for (std::size_t i = 0; i < std::min(shown, of_type.size()); ++i) {
            const Feature& f = *of_type[i];
            text += i == 0 ? " z " : ", ";
            text += f.z_low == f.z_high ? mm(f.z_low) : mm(f.z_low) + "-" + mm(f.z_high);
        }
        text += of_type.size() > shown ? ", ...\n" : "\n";
    }
    for (std::size_t i = 0; i < std::min(shown, inspection.holes.size()); ++i)
        text += hole_line(inspection.holes[i]);
    if (inspection.holes.size() > shown)
        text += fmt::format("  and {} more holes\n", inspection.holes.size() - shown);
    text += edges_text(inspection.edges, inspection.edge_limit_deg) + cavities_text(inspection.cavities);
    text += inspection.undercuts.empty() && inspection.solid ? "  undercuts   none\n" : "";
    for (std::size_t i = 0; i < std::min(shown, inspection.undercuts.size()); ++i) {
        const UnmadeUndercut& u = inspection.undercuts[i];
        text += fmt::format(
            "  undercut    {} mm2, {} mm3 filled, {} mm high at x {} y {} z {} if milled as one layer\n",
            mm(u.area_mm2, 1), mm(u.volume_mm3, 0), mm(u.height_mm), mm(u.x, 2), mm(u.y, 2), mm(u.z, 2));
    }
    if (inspection.undercuts.size() > shown)
        text += fmt::format("  and {} more undercuts\n", inspection.undercuts.size() - shown);
    text += milled_ways_text(inspection.ways) + draw_text(inspection.draw);
    for (const Diagnostic& d : inspection.diagnostics)
        text += fmt::format("  {}: {}\n", name(d.severity), d.message);
    return text;
}

}  // namespace slabwright
