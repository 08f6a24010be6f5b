#include "kernels/access/closest_point.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "kernels/access/tree_memory.h"
#include "kernels/errors.h"
#include "kernels/geometry/triangle.h"
#include "kernels/mesh/morton.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// Embree works in float32: every box, query point and radius is widened by this share of the coordinates'
/// size, so that rounding never hides a candidate. What is nearest is decided in double afterwards.
constexpr double kFloatMargin = 4e-7;

float up(double v) { return std::nextafter(static_cast<float>(v), std::numeric_limits<float>::infinity()); }
float down(double v) {
    return std::nextafter(static_cast<float>(v), -std::numeric_limits<float>::infinity());
}

}  // namespace

struct ClosestPoint::Impl {
    explicit Impl(Context& context) : memory(context) {}

    TreeMemory memory;
    MeshView mesh;
    double margin = 0;  ///< mm
    Box3 box;
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;

    ~Impl() {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }

    [[nodiscard]] std::array<Vec3f, 3> facet(std::uint32_t f) const {
        const Index3& i = mesh.facets[f];
        return {mesh.vertices[i[0]], mesh.vertices[i[1]], mesh.vertices[i[2]]};
    }

    static void facet_bounds(const RTCBoundsFunctionArguments* args) {
        const auto& self = *static_cast<const Impl*>(args->geometryUserPtr);
        const auto v = self.facet(args->primID);
        RTCBounds& b = *args->bounds_o;
        b.lower_x = down(std::min({v[0].x, v[1].x, v[2].x}) - self.margin);
        b.upper_x = up(std::max({v[0].x, v[1].x, v[2].x}) + self.margin);
        b.lower_y = down(std::min({v[0].y, v[1].y, v[2].y}) - self.margin);
        b.upper_y = up(std::max({v[0].y, v[1].y, v[2].y}) + self.margin);
        b.lower_z = down(std::min({v[0].z, v[1].z, v[2].z}) - self.margin);
        b.upper_z = up(std::max({v[0].z, v[1].z, v[2].z}) + self.margin);
    }
};

namespace {

struct Nearest {
    const std::array<Vec3f, 3> (*corners)(const void*, std::uint32_t) = nullptr;
    const void* owner = nullptr;
    Point3 point{};
    double margin = 0;
    ClosestHit hit;
};

bool consider(RTCPointQueryFunctionArguments* args) {
    auto& n = *static_cast<Nearest*>(args->userPtr);
    const auto v = n.corners(n.owner, args->primID);
    Triangle t;
    for (int k = 0; k < 3; ++k) t[k] = {v[k].x, v[k].y, v[k].z};
    const Point3 q = closest_on_triangle(n.point, t);
    const double d = std::hypot(q[0] - n.point[0], q[1] - n.point[1], q[2] - n.point[2]);
    // Ties go to the lowest facet, so that the order in which Embree visits them does not show.
    if (d < n.hit.distance || (d == n.hit.distance && args->primID < n.hit.facet)) {
        const bool nearer = d < n.hit.distance;
        n.hit = {d, q, args->primID};
        if (nearer) {
            const float radius = up(d + n.margin);
            if (radius < args->query->radius) {
                args->query->radius = radius;
                return true;
            }
        }
    }
    return false;
}

#if defined(RTC_VERSION_MAJOR) && RTC_VERSION_MAJOR >= 4
struct Column : RTCRayQueryContext {
#else
struct Column : RTCIntersectContext {
#endif
    const void* owner = nullptr;
    const std::array<Vec3f, 3> (*corners)(const void*, std::uint32_t) = nullptr;
    Point3 point{};
    int winding = 0;
};

void count_crossing(const RTCOccludedFunctionNArguments* args) {
    auto& c = *static_cast<Column*>(args->context);
    const auto v = c.corners(c.owner, args->primID);
    const int w = facet_winding(v, c.point[0], c.point[1]);
    if (w != 0 && facet_height(v, c.point[0], c.point[1]) > c.point[2]) c.winding += w;
    // The ray is never said to be hit, so every facet of the column comes by.
}

}  // namespace

ClosestPoint::ClosestPoint(Context& context, MeshView mesh) : impl_(std::make_unique<Impl>(context)) {
    impl_->mesh = mesh;
    impl_->box = bounds(mesh);
    double size = 1;
    for (const Index3& f : mesh.facets)
        for (const std::uint32_t i : f) {
            const Vec3f& v = mesh.vertices[i];
            if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
                throw Error(ErrorKind::input, "mesh.not_finite", "a vertex is not finite",
                            "vertex " + std::to_string(i), "repair the mesh");
            size = std::max({size, std::abs(static_cast<double>(v.x)), std::abs(static_cast<double>(v.y)),
                             std::abs(static_cast<double>(v.z))});
        }
    impl_->margin = size * kFloatMargin;
    context.throw_if_cancelled();
    impl_->device = rtcNewDevice(nullptr);  // "threads=…" here would clamp TBB for the whole process
    if (!impl_->device)
        throw Error(ErrorKind::no_plan, "embree.device", "Embree offers no device", {},
                    "check the installation of libembree");
    rtcSetDeviceMemoryMonitorFunction(impl_->device, &TreeMemory::monitor, &impl_->memory);
    impl_->scene = rtcNewScene(impl_->device);
    rtcSetSceneFlags(impl_->scene,
                     static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
    RTCGeometry geometry = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(mesh.size()));
    rtcSetGeometryUserData(geometry, impl_.get());
    rtcSetGeometryBoundsFunction(geometry, &Impl::facet_bounds, nullptr);
    rtcSetGeometryOccludedFunction(geometry, &count_crossing);
    rtcSetGeometryPointQueryFunction(geometry, &consider);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(impl_->scene);
    impl_->memory.charge();
    if (rtcGetDeviceError(impl_->device) != RTC_ERROR_NONE)
        throw Error(ErrorKind::no_plan, "embree.build", "Embree could not build its tree", {},
                    "free memory, or plan with fewer facets");
}

ClosestPoint::~ClosestPoint() = default;

namespace {
template <class Impl>
const std::array<Vec3f, 3> corners_of(const void* owner, std::uint32_t f) {
    return static_cast<const Impl*>(owner)->facet(f);
}
}  // namespace

ClosestHit ClosestPoint::query_unsigned(const Point3& point, double max_radius) const {
    Nearest n;
    n.corners = &corners_of<Impl>;
    n.owner = impl_.get();
    n.point = point;
    const double size = std::max({std::abs(point[0]), std::abs(point[1]), std::abs(point[2])});
    n.margin = impl_->margin + 2 * size * kFloatMargin;
    n.hit.distance = max_radius;
    RTCPointQuery query{};
    query.x = static_cast<float>(point[0]);
    query.y = static_cast<float>(point[1]);
    query.z = static_cast<float>(point[2]);
    query.time = 0;
    query.radius = up(max_radius + n.margin);
    RTCPointQueryContext stack;
    rtcInitPointQueryContext(&stack);
    rtcPointQuery(impl_->scene, &query, &stack, nullptr, &n);
    return n.hit;
}

ClosestHit ClosestPoint::query(const Point3& point, double max_radius) const {
    ClosestHit hit = query_unsigned(point, max_radius);
    if (hit.facet != kNoFacet && hit.distance > 0 && winding(point) != 0) hit.distance = -hit.distance;
    return hit;
}

std::vector<ClosestHit> ClosestPoint::query(Context& context, std::span<const Point3> points,
                                            double max_radius) const {
    std::vector<ClosestHit> hits(points.size());
    struct Key {
        std::uint64_t code;
        std::size_t index;
    };
    std::vector<Key> order(points.size());
    const MortonGrid grid(impl_->box);
    for (std::size_t i = 0; i < points.size(); ++i)
        order[i] = {grid.code(points[i][0], points[i][1], points[i][2]), i};
    parallel_sort(context, order.begin(), order.end(), [](const Key& a, const Key& b) {
        return a.code != b.code ? a.code < b.code : a.index < b.index;
    });
    parallel_for(context, points.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (const Key& key : std::span(order).subspan(begin, end - begin))
            hits[key.index] = query(points[key.index], max_radius);
    });
    return hits;
}

int ClosestPoint::winding(const Point3& point) const {
    const Box3& b = impl_->box;
    if (point[0] < b.min.x || point[0] > b.max.x || point[1] < b.min.y || point[1] > b.max.y ||
        point[2] > b.max.z)
        return 0;
    Column column;
#if defined(RTC_VERSION_MAJOR) && RTC_VERSION_MAJOR >= 4
    rtcInitRayQueryContext(&column);
#else
    rtcInitIntersectContext(&column);
#endif
    column.owner = impl_.get();
    column.corners = &corners_of<Impl>;
    column.point = point;
    RTCRay ray{};
    ray.org_x = static_cast<float>(point[0]);
    ray.org_y = static_cast<float>(point[1]);
    ray.org_z = down(std::max<double>(point[2], b.min.z) - impl_->margin);
    ray.dir_z = 1;
    ray.tnear = 0;
    ray.tfar = std::numeric_limits<float>::infinity();
    ray.mask = 0xFFFFFFFFu;
#if defined(RTC_VERSION_MAJOR) && RTC_VERSION_MAJOR >= 4
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &column;
    rtcOccluded1(impl_->scene, &ray, &arguments);
#else
    rtcOccluded1(impl_->scene, &column, &ray);
#endif
    return column.winding;
}

}  // namespace slabwright
