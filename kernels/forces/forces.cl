R"CL(
// One work item: one segment over one pitch, eight instants at a time (forces.h states the model, turn.h the pieces).
// Flat ends and shanks by the closed form, balls by Gauss's rule in q = sin(kappa/2). Sines by polynomials: the angles that
// are needed lie within half a turn, and a device's own sin() is often scalar. The polynomials are good to 4e-6.
#pragma OPENCL FP_CONTRACT OFF

typedef struct {
    float radius, lag, entry, exit, low, high, pitch, ball;  // ball: 1 or 0
    float tc, rc, ac, te, re, ae;                            // per mm of edge at sin(phi) = 1, and of the edge itself, N/mm
    int pieces, padding;
    float4 piece[4];  // angle of the first tooth at the beginning, length, number of teeth, number of instants
} Segment;

#define LARGER(a, b) ((a) > (b) ? (a) : (b))
#define SMALLER(a, b) ((a) < (b) ? (a) : (b))

// x in [-pi/2, pi/2]: x2 = x*x gives sin(x)/x and cos(x).
#define SINC(x2) (1.0f + (x2) * (-1.6666666e-1f + (x2) * (8.3333333e-3f + (x2) * (-1.9841270e-4f + (x2) * 2.7180e-6f))))
#define COSINE(x2) (1.0f + (x2) * (-0.5f + (x2) * (4.1666667e-2f + (x2) * (-1.3888889e-3f + (x2) * (2.4801587e-5f + (x2) * -2.7152e-7f)))))

__constant float node[6] = {-0.93246951f, -0.66120939f, -0.23861919f, 0.23861919f, 0.66120939f, 0.93246951f};
__constant float weight[6] = {0.17132449f, 0.36076157f, 0.46791393f, 0.46791393f, 0.36076157f, 0.17132449f};

float largest(float8 v) {
    float4 a = fmax(v.lo, v.hi);
    float2 b = fmax(a.lo, a.hi);
    return fmax(b.x, b.y);
}
float total(float8 v) {
    float4 a = v.lo + v.hi;
    float2 b = a.lo + a.hi;
    return b.x + b.y;
}

__kernel void forces(__global const Segment* segments, __global float* out, const uint count) {
    const size_t id = get_global_id(0);
    if (id >= count) return;
    const Segment s = segments[id];
    const float8 lane = (float8)(0, 1, 2, 3, 4, 5, 6, 7);
    float8 peak_x = 0, peak_y = 0, peak_z = 0, peak_plane = 0, peak_all = 0, peak_torque = 0;
    float8 mean_plane = 0;
    const float inverse_lag = s.lag > 0 ? 1.0f / s.lag : 0.0f;
    for (int p = 0; p < s.pieces; ++p) {
        const float first = s.piece[p].x, length = s.piece[p].y, step = length / (s.piece[p].w - 1.0f);
        const int teeth = (int)s.piece[p].z, blocks = (int)s.piece[p].w / 8;
        for (int b = 0; b < blocks; ++b) {
            const float8 index = lane + (float)(8 * b);
            float8 x = 0, y = 0, z = 0, torque = 0;
            for (int m = 0; m < teeth; ++m) {
                const float begin = first + (float)m * s.pitch, middle = begin + 0.5f * length;
                const float8 u = begin + index * step;
                float8 zl = s.low, zh = s.high;
                if (s.lag > 0) {
                    if (middle - s.lag * s.high < s.entry) {
                        zh = (u - s.entry) * inverse_lag;
                        zh = SMALLER(LARGER(zh, (float8)s.low), (float8)s.high);
                    }
                    if (middle - s.lag * s.low > s.exit) {
                        zl = (u - s.exit) * inverse_lag;
                        zl = SMALLER(LARGER(zl, (float8)s.low), (float8)s.high);
                    }
                }
                zh = LARGER(zh, zl);
                if (s.ball > 0 && s.low < s.radius) {
                    const float half_inverse = 0.5f / s.radius;
                    const float8 qa = sqrt(SMALLER(zl, (float8)s.radius) * half_inverse), qb = sqrt(SMALLER(zh, (float8)s.radius) * half_inverse);
                    const float8 half_q = 0.5f * (qb - qa), mid_q = 0.5f * (qb + qa);
                    const float lag_q = 2.0f * s.radius * s.lag;
                    float8 bx = 0, by = 0, bz = 0, bt = 0;
#pragma unroll
                    for (int i = 0; i < 6; ++i) {
                        const float8 q = mid_q + half_q * node[i], q2 = q * q, root = sqrt(1.0f - q2);
                        const float8 sin_k = 2.0f * q * root, cos_k = 1.0f - 2.0f * q2;
                        const float8 a = u - lag_q * q2 - 1.57079633f, a2 = a * a;
                        const float8 sin_p = COSINE(a2), cos_p = -a * SINC(a2);
                        const float8 h = sin_p * sin_k, db = weight[i] / root;
                        const float8 ft = (s.tc * h + s.te) * db, fr = (s.rc * h + s.re) * db, fa = (s.ac * h + s.ae) * db;
                        const float8 inward = fr * sin_k + fa * cos_k;
                        bx -= ft * cos_p + inward * sin_p;
                        by += ft * sin_p - inward * cos_p;
                        bz += fa * sin_k - fr * cos_k;
                        bt += ft * sin_k;
                    }
                    const float8 edge = 2.0f * s.radius * half_q;
                    x += bx * edge;
                    y += by * edge;
                    z += bz * edge;
                    torque += bt * edge;
                    zl = LARGER(zl, (float8)s.radius);
                    zh = LARGER(zh, (float8)s.radius);
                }
                if (s.ball == 0 || s.high > s.radius) {
                    const float8 edge = zh - zl, a = u - 0.5f * s.lag * (zh + zl) - 1.57079633f, delta = 0.5f * s.lag * edge;
                    const float8 a2 = a * a, d2 = delta * delta, one = SINC(d2), two = one * COSINE(d2);
                    const float8 sin_p = COSINE(a2), cos_p = -a * SINC(a2);
                    const float8 s1 = sin_p * one, c1 = cos_p * one, s2 = sin_p * cos_p * two;
                    const float8 ss = 0.5f - (0.5f - sin_p * sin_p) * two;
                    x -= edge * (s.tc * s2 + s.te * c1 + s.rc * ss + s.re * s1);
                    y += edge * (s.tc * ss + s.te * s1 - s.rc * s2 - s.re * c1);
                    z += edge * (s.ac * s1 + s.ae);
                    torque += edge * (s.tc * s1 + s.te);
                }
            }
            torque *= s.radius;
            const float8 plane2 = x * x + y * y, plane = sqrt(plane2), all = plane2 + z * z;
            float8 share = step;
            if (b == 0) share.s0 *= 0.5f;
            if (b + 1 == blocks) share.s7 *= 0.5f;
            const float8 ax = fabs(x), ay = fabs(y), az = fabs(z), at = fabs(torque);
            peak_x = LARGER(ax, peak_x);
            peak_y = LARGER(ay, peak_y);
            peak_z = LARGER(az, peak_z);
            peak_torque = LARGER(at, peak_torque);
            peak_plane = LARGER(plane, peak_plane);
            peak_all = LARGER(all, peak_all);
            mean_plane += share * plane;
        }
    }
    vstore8((float8)(largest(peak_x), largest(peak_y), largest(peak_z), largest(peak_plane), sqrt(largest(peak_all)), largest(peak_torque),
                     total(mean_plane) / s.pitch, 0),
            id, out);
}
)CL"
