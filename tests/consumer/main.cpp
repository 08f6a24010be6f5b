// Plans an STL through the installed library and checks that the plan makes sense.
#include <slabwright/io/slabwright.h>

#include <cstdio>

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    try {
        slabwright::Context context({.threads = 2});
        const slabwright::Plan plan = slabwright::plan(context, argv[1], slabwright::Job{});
        std::printf("slabwright %s: %zu layers\n", slabwright::version().c_str(), plan.layers.size());
        if (plan.layers.empty()) return 1;
        double below = 0;
        for (const slabwright::Layer& layer : plan.layers) {
            if (layer.z_bottom != below || layer.z_top <= layer.z_bottom || layer.operations.empty())
                return 1;
            below = layer.z_top;
        }
        if (below < 49.99 || below > 50.01) return 1;
    } catch (const slabwright::Error& error) {
        std::printf("%s\n", error.what());
        return static_cast<int>(error.kind());
    }
    // An error must cross the library's border with its type.
    try {
        slabwright::Context context;
        (void)slabwright::plan(context, "/nowhere/no.stl", slabwright::Job{});
    } catch (const slabwright::Error& error) {
        return error.kind() == slabwright::ErrorKind::input ? 0 : 1;
    }
    return 1;
}
