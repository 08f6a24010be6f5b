#include "kernels/access/facet_scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "kernels/errors.h"

namespace slabwright {

namespace {

FacetPlanes planes_of(const Triangle& t) {
    auto sub = [](const Point3& a, const Point3& b) { return Point3{a[0] - b[0], a[1] - b[1], a[2] - b[2]}; };
    auto cross = [](const Point3& a, const Point3& b) {
        return Point3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    FacetPlanes planes{};
    const Point3 n = cross(sub(t[1], t[0]), sub(t[2], t[0]));
    const double longest2 =
        std::max({squared_distance(t[0], t[1]), squared_distance(t[1], t[2]), squared_distance(t[2], t[0])});
    constexpr double sliver = 1e-16;  // of twice the area and the longest edge, squared: rounding makes up
                                      // the plane of a facet that is thinner
    if (!(dot(n, n) > sliver * longest2 * longest2)) return planes;
    auto set = [&](int i, const Point3& normal, const Point3& on) {
        const double l = std::sqrt(dot(normal, normal));
        const Point3 unit{static_cast<float>(normal[0] / l), static_cast<float>(normal[1] / l),
                          static_cast<float>(normal[2] / l)};
        planes.x[i] = static_cast<float>(unit[0]);
        planes.y[i] = static_cast<float>(unit[1]);
        planes.z[i] = static_cast<float>(unit[2]);
        planes.d[i] = static_cast<float>(-dot(unit, on));
    };
    set(0, n, t[0]);
    for (int k = 0; k < 3; ++k) set(k + 1, cross(sub(t[(k + 1) % 3], t[k]), n), t[k]);
    return planes;
}

/// Finds what a ray hits first, with from, direction and ends set.
void trace(RTCScene scene, RTCRayHit& ray) {
    ray.ray.mask = 0xFFFFFFFFu;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if defined(RTC_VERSION_MAJOR) && RTC_VERSION_MAJOR >= 4
    rtcIntersect1(scene, &ray);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &ray);
#endif
}

}  // namespace

BelowHeight below_height(const Triangle& t, double top) {
    BelowHeight b;
    const int under = (t[0][2] <= top) + (t[1][2] <= top) + (t[2][2] <= top);
    if (under == 3) {
        b.t[0] = t;
        b.n = 1;
        return b;
    }
    if (under == 0) return b;
    std::array<Point3, 4> q;
    int n = 0;
    for (int k = 0; k < 3; ++k) {
        const Point3 &a = t[k], &c = t[(k + 1) % 3];
        if (a[2] <= top) q[n++] = a;
        if ((a[2] <= top) != (c[2] <= top)) {
            const double s = (top - a[2]) / (c[2] - a[2]);
            q[n++] = {a[0] + s * (c[0] - a[0]), a[1] + s * (c[1] - a[1]), top};
        }
    }
    for (int k = 1; k + 1 < n; ++k) b.t[b.n++] = {q[0], q[k], q[k + 1]};
    return b;
}

FacetScene::FacetScene(Context& context, MeshView mesh)
    : planes_memory_(context, mesh.size() * sizeof(FacetPlanes), "the planes of the facets"),
      memory_(context),
      mesh_(mesh) {
    box_ = bounds(mesh);
    double size = 1;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3f& v = mesh.vertices[i];
        if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
            throw Error(ErrorKind::input, "mesh.not_finite", "a vertex is not finite",
                        "vertex " + std::to_string(i), "repair the mesh");
        size = std::max({size, std::abs(static_cast<double>(v.x)), std::abs(static_cast<double>(v.y)),
                         std::abs(static_cast<double>(v.z))});
    }
    margin_ = 3 * size * kFloatMargin;
    std::vector<Index3> hanging;
    planes_.resize(mesh.size());
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        const Triangle t = triangle(static_cast<std::uint32_t>(f));
        planes_[f] = planes_of(t);
        const double nz =
            (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]);
        // The part's own bottom hangs over nothing that a tool could be in.
        const double lowest = box_.min.z;
        if (!(nz < 0) || (t[0][2] <= lowest && t[1][2] <= lowest && t[2][2] <= lowest)) continue;
        overhangs_.push_back(static_cast<std::uint32_t>(f));
        hanging.push_back(mesh.facets[f]);
    }
    context.throw_if_cancelled();
    device_.reset(rtcNewDevice(nullptr));  // "threads=…" here would clamp TBB for the whole process
    if (!device_)
        throw Error(ErrorKind::no_plan, "embree.device", "Embree offers no device", {},
                    "check the installation of libembree");
    rtcSetDeviceMemoryMonitorFunction(device_.get(), &TreeMemory::monitor, &memory_);
    all_ = build(mesh.facets);
    if (!hanging.empty()) hanging_ = build(hanging);
    memory_.charge();
}

void FacetScene::Release::operator()(RTCDeviceTy* device) const { rtcReleaseDevice(device); }
void FacetScene::Release::operator()(RTCSceneTy* scene) const { rtcReleaseScene(scene); }

Triangle FacetScene::triangle(std::uint32_t f) const {
    Triangle t;
    for (int k = 0; k < 3; ++k) {
        const Vec3f& v = mesh_.vertices[mesh_.facets[f][k]];
        t[k] = {v.x, v.y, v.z};
    }
    return t;
}

FacetScene::EmbreeScene FacetScene::build(std::span<const Index3> facets) {
    EmbreeScene built(rtcNewScene(device_.get()));
    RTCScene scene = built.get();
    rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree reads 16 bytes at a vertex of 12: it gets a copy of its own, which it pads.
    auto* vertices = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), mesh_.vertices.size()));
    auto* corners = static_cast<Index3*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Index3), facets.size()));
    if (vertices && corners) {
        std::copy(mesh_.vertices.begin(), mesh_.vertices.end(), vertices);
        std::copy(facets.begin(), facets.end(), corners);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) {
        built.reset();
        memory_.charge();
        throw Error(ErrorKind::no_plan, "embree.build", "Embree could not build its tree", {},
                    "free memory, or plan with fewer facets");
    }
    return built;
}

double FacetScene::first_below(double x, double y, double z, bool& leaves_solid, double none) const {
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(x);
    ray.ray.org_y = static_cast<float>(y);
    ray.ray.org_z = static_cast<float>(z);
    ray.ray.dir_z = -1;
    ray.ray.tfar = std::numeric_limits<float>::infinity();
    trace(all_.get(), ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return none;
    leaves_solid = ray.hit.Ng_z < 0;
    return z - static_cast<double>(ray.ray.tfar);
}

FacetScene::RayHit FacetScene::first_along(const Point3& from, const Vec3d& direction, double least,
                                           double most) const {
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(from[0]);
    ray.ray.org_y = static_cast<float>(from[1]);
    ray.ray.org_z = static_cast<float>(from[2]);
    ray.ray.dir_x = static_cast<float>(direction[0]);
    ray.ray.dir_y = static_cast<float>(direction[1]);
    ray.ray.dir_z = static_cast<float>(direction[2]);
    ray.ray.tnear = static_cast<float>(least);
    ray.ray.tfar = static_cast<float>(most);
    trace(all_.get(), ray);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    return {ray.hit.primID, static_cast<double>(ray.ray.tfar)};
}

bool FacetScene::overhung(const Point3& from, double top) const {
    if (!hanging_ || from[2] >= top) return false;
    RTCRay ray{};
    ray.org_x = static_cast<float>(from[0]);
    ray.org_y = static_cast<float>(from[1]);
    ray.org_z = static_cast<float>(from[2]);
    ray.dir_z = 1;
    ray.tfar = static_cast<float>(top - from[2]);
    ray.mask = 0xFFFFFFFFu;
#if defined(RTC_VERSION_MAJOR) && RTC_VERSION_MAJOR >= 4
    rtcOccluded1(hanging_.get(), &ray);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(hanging_.get(), &context, &ray);
#endif
    return ray.tfar < 0;
}

}  // namespace slabwright
