#include "kernels/geometry/cutter_shape.h"

#include <string>

#include "kernels/errors.h"

namespace slabwright {

const char* name_of(CutterForm form) {
    switch (form) {
        case CutterForm::flat:
            return "flat";
        case CutterForm::ball:
            return "ball";
        case CutterForm::bull_nose:
            return "bull-nose";
        case CutterForm::tapered_ball:
            return "tapered ball";
        case CutterForm::cone:
            return "cone";
    }
    return "";
}

void refuse_form(CutterForm form, const char* question) {
    throw Error(ErrorKind::usage, "tool.shape",
                std::string(question) + " cannot be told of a " + name_of(form) + " cutter", "tool",
                "use a flat or a ball end mill");
}

}  // namespace slabwright
