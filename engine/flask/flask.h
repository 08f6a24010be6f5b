// The flask (RPM; METHOD.md section 11): a frame of every slab that stays around the pattern. It carries the
// slab where that hangs over while it is cut, and is the moulding box afterwards.
//
// Its opening is the pattern's silhouette, holes filled, grown by the job's gap, round; where that falls into
// several loops, the convex hull of them. It is widest at the top: at height z it is wider by z · tan(draft),
// so that the sand leaves upwards, the way the pattern leaves it. The draft goes in steps, one vertical wall
// to a layer, as wide as the draft asks for at the layer's bottom. Outside it reaches to the edge of the
// slab, so nothing is cut there.
#pragma once

#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// How far the stock must reach past the pattern's bounding box for the flask of a pattern `height` mm high:
/// gap, what the draft adds, and wall.
[[nodiscard]] double flask_margin(const FlaskShape& shape, double height);

/// The flask of a plan whose stock and layers (z_bottom, z_top) are set.
/// @throws Error(no_plan, "fit.flask") when the wall would come out thinner than the job asks for
[[nodiscard]] Flask place_flask(Context& context, MeshView mesh, const Plan& plan);

/// What stays of one layer's slab: the stock's rectangle less the layer's opening.
[[nodiscard]] Loops flask_frame(const Flask& flask, std::size_t layer);

}  // namespace slabwright
