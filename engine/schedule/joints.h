// What holds the build together (METHOD.md section 18): where glue goes at every joint, how hard the press
// may press there, and what of it cannot hold.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The wood at a joint, seen from above. A boundary is not exactly as high as the vertices that it was laid
/// on, so all is asked for clearly beside it (kBesideJoint).
struct JointWood {
    double z = 0;  ///< mm
    /// What the slab lies on when it is glued: what the layer below keeps at its top; the board, or the slab
    /// below within one layer, as far as the stock reaches.
    Loops below;
    /// What its layer will keep above the joint: the union of its sections up to its top, for what stays
    /// filled under an overhang is wood too.
    Loops above;
    Loops both;  ///< where wood stands on both sides
    /// What of `above` still stands one, two and three quarters of the way up to its layer's top.
    static constexpr std::size_t kRungs = 3;
    std::array<Loops, kRungs> higher{};
};

/// How far beside a joint, mm, wood counts: faces that lie nearer belong to the joint, being off by rounding.
/// Far less than what cutters leave, far more than the last digit of a coordinate.
inline constexpr double kBesideJoint = 0.06;

/// Less wood on both sides than this is none, mm².
inline constexpr double kNoContact = 1e-3;

/// The joints of every layer, upwards, each layer's own first and then those between the slabs that are
/// bonded into it; those above its top are faced off with what lies over them, and left out.
/// @param plan its stock, flask and layers' heights and slabs
/// @throws as slice() and shadows()
[[nodiscard]] std::vector<std::vector<JointWood>> wood_at_joints(Context& context, MeshView mesh,
                                                                 const Plan& plan);

/// Where glue goes on a region: held back from its edges by `setback_mm`, on ribs too narrow for that by the
/// largest of its half, quarter and eighth that leaves them half as wide; a piece of the region that is left
/// with glue on less than half of it is held back less, likewise.
[[nodiscard]] Loops glue_within(const Loops& region, double setback_mm);

/// Why a joint cannot hold.
struct WeakJoint {
    std::string code, message;
    std::array<double, 3> where{};
    std::string remedy;
    bool refused = true;  ///< false: it deserves care, and the build goes on
    double lost_mm2 = 0;  ///< of joint.weak: what of the layer may break off, in plan
};

/// Fills layer.joints: glue, force and pressure of each. The force is the press's own, less where the glue
/// lies off the table's middle, unless the glued area would see more than its allowed pressure; no joint
/// within the layer is pressed harder than the one under it bears. Notes go to `diagnostics`.
/// @param wood of this layer, from wood_at_joints
/// @return what cannot hold, whatever is cut: joint.floating, joint.no_glue, joint.pressure
std::vector<WeakJoint> bond_layer(Layer& layer, std::span<const JointWood> wood, const Plan& plan,
                                  std::vector<Diagnostic>& diagnostics);

/// Whether each layer's joint bears what stands on it, from when its slab is whole until the last layer is
/// cut: weights, and the hardest cut of the face mill and the flat end mills; a quarter of it for refusals.
/// While glue sets, the press holds the slab. A first layer that the pattern's foot would not hold is glued
/// all over the board; where a whole slab would break off, a piece of one is laid.
/// @param plan its layers bonded; the first one's joint may change
/// @param wood of every layer
/// @return layer by layer what no distribution of the glue's stress can bear: joint.tips. What deserves care
/// (joint.overhang, joint.board, joint.small_slab) goes to `diagnostics`.
std::vector<std::vector<WeakJoint>> slabs_that_tip(Plan& plan, std::span<const std::vector<JointWood>> wood,
                                                   std::vector<Diagnostic>& diagnostics);

/// Whether the glue bears the cutters, every piece of the layer by itself: once it stands free of its slab,
/// at its own height.
/// @param layer its joints filled, its operations with their forces (peak_force_n)
/// @return joint.weak, the weakest piece of each joint
[[nodiscard]] std::vector<WeakJoint> joints_under_load(const Layer& layer, std::span<const JointWood> wood,
                                                       const Plan& plan);

}  // namespace slabwright
