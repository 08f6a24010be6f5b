#include "io/split.h"

#include <fmt/format.h>

#include "io/read/pattern_mesh.h"
#include "io/text/json_text.h"
#include "io/write/model_file.h"
#include "io/write/plan_json.h"
#include "kernels/errors.h"

namespace slabwright {

SplitModel split_model(Context& context, const PatternSource& source, const Job& job,
                       const SplitRequest& request) {
    validate(job);
    for (const std::string& out : request.out) require_model_ending(out);
    if (request.out[0] == request.out[1])
        throw Error(ErrorKind::usage, "split.out", "both halves have the same name", request.out[0],
                    "give two names after -o");
    PatternMesh pattern = read_pattern_mesh(context, source, reading_options(job));
    require_solid(context, pattern, source.name());
    const MeshReport& report = pattern.report;
    if (report.open_edges.count > 0)
        throw Error(ErrorKind::input, "split.open", "the base is open, so a half may have no inside",
                    source.name(), "close it with --repair");
    context.begin_phase("split", 0.1, 0.9);
    Halves halves = split_solid(context, pattern.mesh.view(), report, request.plane, request.dowels,
                                request.mirror_below);
    SplitModel result;
    result.input = pattern.input;
    result.out = request.out;
    result.dowels = halves.dowels;
    result.cut_mm2 = halves.cut_mm2;
    result.diagnostics = std::move(pattern.diagnostics);
    if (request.dowels.diameter_mm > 0 && halves.dowels.size() < 2)
        result.diagnostics.push_back(
            {Severity::warning, "split.dowels",
             fmt::format("the cut has room for {} of 2 dowels of {:g} mm, {:g} mm deep, with {:g} mm around",
                         halves.dowels.size(), request.dowels.diameter_mm, request.dowels.depth_mm,
                         request.dowels.wall_mm),
             std::nullopt});
    for (const std::size_t side : {0U, 1U}) {
        const Half& half = side == 0 ? halves.above : halves.below;
        result.maps[side] = half.map;
        result.volume_mm3[side] = half.report.volume_mm3;
        result.height_mm[side] = double{half.report.box.max.z} - half.report.box.min.z;
        result.facets[side] = half.mesh.facets.size();
    }
    context.throw_if_cancelled();
    write_model(request.out[0], halves.above.mesh);
    write_model(request.out[1], halves.below.mesh);
    return result;
}

std::string split_json(const SplitModel& model) {
    JsonText json;
    json.begin_object().key("schema").string("slabwright.split/1").key("units").string("mm").key("input");
    put_input(json, model.input);
    json.key("cut_mm2").rounded(model.cut_mm2, 3).key("halves").begin_array();
    for (const std::size_t side : {0U, 1U}) {
        json.begin_object().key("side").string(side == 0 ? "above" : "below").key("file");
        json.string(model.out[side]).key("facets").count(model.facets[side]);
        json.key("volume_mm3").rounded(model.volume_mm3[side], 3);
        json.key("height").rounded(model.height_mm[side], 4).key("matrix").begin_array();
        for (const auto& row : model.maps[side].rows) {
            json.begin_array(JsonText::Shape::line);
            for (const double v : row) json.exact(v);
            json.end();
        }
        json.end().end();
    }
    json.end().key("dowels").begin_array();
    for (const Dowel& dowel : model.dowels) {
        json.begin_object(JsonText::Shape::line).key("at").begin_array();
        for (const double v : dowel.at) json.rounded(v, 4);
        json.end().key("diameter").exact(dowel.diameter_mm).key("depth").exact(dowel.depth_mm).end();
    }
    json.end().end();
    return json.take();
}

std::string split_text(const SplitModel& model) {
    std::string text;
    for (const Diagnostic& d : model.diagnostics)
        text += fmt::format("{}: {}\n", name(d.severity), d.message);
    for (const std::size_t side : {0U, 1U})
        text += fmt::format("{}: {} the cut, {:.3f} mm high, {} facets, {:.2f} cm3, cut face down\n",
                            model.out[side], side == 0 ? "above" : "below", model.height_mm[side],
                            model.facets[side], model.volume_mm3[side] / 1000);
    for (const Dowel& dowel : model.dowels)
        text += fmt::format("dowel   {:g} mm, {:g} mm into each half, at ({:.2f}, {:.2f}, {:.2f}) mm\n",
                            dowel.diameter_mm, dowel.depth_mm, dowel.at[0], dowel.at[1], dowel.at[2]);
    return text;
}

}  // namespace slabwright
