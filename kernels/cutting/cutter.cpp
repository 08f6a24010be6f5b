#include "kernels/cutting/cutter.h"

namespace slabwright {

Cutter cutter_of(const CutterShape& shape) {
    switch (shape.form()) {
        case CutterForm::flat:
            return {Cutter::Profile::flat, shape.radius};
        case CutterForm::ball:
            return {Cutter::Profile::ball, shape.radius};
        case CutterForm::bull_nose:
        case CutterForm::tapered_ball:
        case CutterForm::cone:
            break;
    }
    refuse_form(shape.form(), "where it may go");
}

}  // namespace slabwright
