// The front door's results as JSON.
#include "io/slabwright.h"
#include "io/text/json_text.h"
#include "io/write/plan_json.h"

namespace slabwright {

namespace {

const char* kind_name(ErrorKind kind) {
    switch (kind) {
        case ErrorKind::usage:
            return "usage";
        case ErrorKind::input:
            return "input";
        case ErrorKind::no_plan:
            return "no_plan";
        case ErrorKind::verification:
            return "verification";
        case ErrorKind::cancelled:
            return "cancelled";
    }
    return "";
}

}  // namespace

std::string error_json(const Error& error, std::span<const Error> also) {
    JsonText json;
    const auto put = [&](const Error& e) {
        json.key("code").string(e.code()).key("message").string(e.message());
        json.key("place").string(e.place()).key("remedy").string(e.remedy());
    };
    json.begin_object(JsonText::Shape::line).key("error").begin_object();
    json.key("kind").string(kind_name(error.kind())).key("exit").integer(static_cast<int>(error.kind()));
    put(error);
    if (!also.empty()) {
        json.key("also").begin_array(JsonText::Shape::line);
        for (const Error& e : also) {
            json.begin_object(JsonText::Shape::line);
            put(e);
            json.end();
        }
        json.end();
    }
    json.end().end();
    return json.take();
}

std::string plan_summary_json(const Plan& plan, const std::string& out, const VerifyResult* found) {
    JsonText json;
    json.begin_object();
    json.key("plan").string(out + "/plan.json");
    json.key("layers").integer(plan.totals.layers).key("operations").integer(plan.totals.operations);
    json.key("build_minutes").rounded(plan.totals.build_minutes, 4);
    json.key("diagnostics");
    put_diagnostics(json, plan.diagnostics);
    if (found) {
        json.key("verified").boolean(found->passed).key("whole").boolean(found->is_whole());
        json.key("unmade_mm3").rounded(found->unmade_mm3, 0);
        json.key("unreachable_mm2").rounded(found->unreachable_mm2, 1).key("violations");
        put_diagnostics(json, found->violations);
        json.key("advice");
        put_diagnostics(json, found->advice);
    }
    json.end();
    return json.take();
}

std::string repair_summary_json(const RepairResult& result, const std::string& out) {
    JsonText json;
    json.begin_object().key("stl").string(out).key("repair");
    put_repair(json, result.repair);
    json.key("diagnostics");
    put_diagnostics(json, result.diagnostics);
    json.end();
    return json.take();
}

std::string report_summary_json(const std::string& directory) {
    JsonText json;
    json.begin_object().key("report").string(directory + "/report.html").end();
    return json.take();
}

}  // namespace slabwright
