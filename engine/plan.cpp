#include "engine/plan.h"

namespace slabwright {

std::string_view name(Severity severity) {
    switch (severity) {
        case Severity::note:
            return "note";
        case Severity::warning:
            return "warning";
        case Severity::error:
            return "error";
    }
    return "";
}

std::string_view name(OperationKind kind) {
    switch (kind) {
        case OperationKind::face:
            return "face";
        case OperationKind::rough:
            return "rough";
        case OperationKind::semi_rough:
            return "semi_rough";
        case OperationKind::finish:
            return "finish";
        case OperationKind::corner:
            return "corner";
        case OperationKind::drill:
            return "drill";
        case OperationKind::edge:
            return "edge";
    }
    return "";
}

}  // namespace slabwright
