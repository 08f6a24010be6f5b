#include "io/write/report_cavities.h"

#include "io/write/cavities_json.h"
#include "kernels/errors.h"

namespace slabwright {

std::string report_cavities(Context& context, MeshView mesh, const Job& job,
                            std::span<const double> layer_tops) {
    try {
        const FeatureSet features = find_features(context, mesh, feature_options(job));
        const CavityOptions limits;
        JsonText json;
        put_cavities(
            json,
            advise_on_cavities(job, find_cavities(context, mesh, layer_tops, features.features, limits)),
            limits);
        return json.take();
    } catch (const Error& error) {
        if (error.code() != "memory.limit") throw;
    }
    return "null";
}

}  // namespace slabwright
