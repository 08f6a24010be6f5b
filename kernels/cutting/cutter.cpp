#include "kernels/cutting/cutter.h"

namespace slabwright {

Cutter cutter_of(const CutterShape& shape) {
    (void)under_side(shape);  // refuses measures that make no cutter
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
    return {Cutter::Profile::other, shape.radius, shape.corner, shape.taper_rad};
}

Envelope under_side(const Cutter& cutter) {
    const double corner = cutter.profile == Cutter::Profile::ball ? cutter.radius : cutter.corner;
    return under_side(CutterShape{cutter.radius, corner, cutter.taper_rad});
}

}  // namespace slabwright
