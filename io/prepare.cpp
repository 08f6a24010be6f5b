#include "io/prepare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/prepare/preparation.h"
#include "io/read/pattern_mesh.h"
#include "io/text/json_text.h"
#include "io/write/model_file.h"
#include "io/write/plan_json.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

/// Half of the step between floats at the farthest coordinate of a box, mm.
double float_step(const InputInfo& input) {
    double farthest = 0;
    for (std::size_t k = 0; k < 3; ++k)
        farthest = std::max({farthest, std::abs(input.min[k]), std::abs(input.max[k])});
    const auto value = static_cast<float>(farthest);
    return (double{std::nextafter(value, std::numeric_limits<float>::infinity())} - value) / 2;
}

}  // namespace

PreparedModel prepare_model(Context& context, const PatternSource& source, const Job& job,
                            const std::string& out) {
    validate(job);
    require_model_ending(out);
    PatternMesh pattern = read_pattern_mesh(context, source, reading_options(job));
    for (Vec3f& v : pattern.mesh.vertices) v.z = static_cast<float>(double{v.z} + pattern.input.min[2]);
    PreparedModel result{pattern.input,
                         told(job.prepare),
                         pattern.diagnostics,
                         pattern.mesh.facets.size(),
                         pattern.mesh.vertices.size(),
                         float_step(pattern.input)};
    context.throw_if_cancelled();
    write_model(out, pattern.mesh);
    return result;
}

std::string prepare_json(const PreparedModel& model, const std::string& out) {
    JsonText json;
    json.begin_object().key("schema").string("slabwright.prepare/1").key("units").string("mm");
    json.key("out").string(out).key("input");
    put_input(json, model.input);
    json.key("done").string(model.done).key("facets").count(model.facets);
    json.key("vertices").count(model.vertices).key("volume_mm3").rounded(model.input.volume_mm3, 3);
    json.key("rounding").rounded(model.closest_mm, 9).key("diagnostics").begin_array();
    for (const Diagnostic& d : model.diagnostics)
        json.begin_object(JsonText::Shape::line)
            .key("severity")
            .string(name(d.severity))
            .key("code")
            .string(d.code)
            .key("message")
            .string(d.message)
            .end();
    json.end().end();
    return json.take();
}

std::string prepare_text(const PreparedModel& model, const std::string& out) {
    std::string text;
    for (const Diagnostic& d : model.diagnostics)
        text += fmt::format("{}: {}\n", name(d.severity), d.message);
    const InputInfo& i = model.input;
    text += fmt::format("{}: {}\n", out, model.done.empty() ? "as it was" : model.done);
    text += fmt::format("{}: {:.3f} x {:.3f} x {:.3f} mm, {} facets, {} vertices, {:.2f} cm3\n", out,
                        i.max[0] - i.min[0], i.max[1] - i.min[1], i.max[2] - i.min[2], model.facets,
                        model.vertices, i.volume_mm3 / 1000);
    return text;
}

}  // namespace slabwright
