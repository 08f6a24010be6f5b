R"CL(
// One work item: one segment over one pitch, eight instants at a time (forces.h states the model, turn.h the pieces).
// A tooth all of whose edge is engaged gives forces that are trigonometric polynomials of its angle, whose coefficients are
// integrals over the edge and the same at every instant: eight lanes take the eight nodes of Gauss's rule once for the segment. A
// tooth that enters or leaves is integrated at every instant: flat ends and shanks by the closed form, balls by Gauss's rule in
// q = sin(kappa/2). Sines by polynomials: the angles that are needed lie within half a turn, and a device's own sin() is often
// scalar. The polynomials are good to 4e-6.
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

// With phi the angle of the tooth at the middle of its engaged heights, d how far a height lags behind that middle, and the edge
// integrated with sin(kappa) = sk, cos(kappa) = ck:
//     Fx = -v0 - b sin(phi) - a cos(phi) - c sin(2 phi) + d cos(2 phi),   Fy = q0 + a sin(phi) - b cos(phi) - d sin(2 phi) - c cos(2 phi),
//     Fz = w0 + w1 sin(phi) - w2 cos(phi),   torque / radius = t0 + t1 sin(phi) - t2 cos(phi).
typedef struct {
    float a, b, c, d, v0, q0, w0, w1, w2, t0, t1, t2;
} Tooth;

Tooth engaged_tooth(const Segment s) {
    Tooth t = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    const float middle = 0.5f * (s.low + s.high);
    float from = s.low;
    if (s.ball > 0 && s.low < s.radius) {
        const float8 nodes = (float8)(-0.96028986f, -0.79666648f, -0.52553241f, -0.18343464f, 0.18343464f, 0.52553241f, 0.79666648f, 0.96028986f);
        const float8 weights = (float8)(0.10122854f, 0.22238103f, 0.31370665f, 0.36268378f, 0.36268378f, 0.31370665f, 0.22238103f, 0.10122854f);
        from = SMALLER(s.high, s.radius);
        const float qa = sqrt(0.5f * s.low / s.radius), qb = sqrt(0.5f * from / s.radius), half_q = 0.5f * (qb - qa);
        const float8 q = 0.5f * (qa + qb) + half_q * nodes, q2 = q * q, root = sqrt(1.0f - q2);
        const float8 db = 2.0f * s.radius * half_q * weights / root, sk = 2.0f * q * root, ck = 1.0f - 2.0f * q2;
        const float8 d = s.lag * (2.0f * s.radius * q2 - middle), d2 = d * d, sd = d * SINC(d2), cd = COSINE(d2), ss = 2.0f * sd * cd,
                     cc = 1.0f - 2.0f * sd * sd;
        const float8 te = s.te * db, tc = 0.5f * s.tc * sk * db, re = (s.re * sk + s.ae * ck) * db, rc = 0.5f * (s.rc * sk + s.ac * ck) * sk * db;
        const float8 ac = (s.ac * sk - s.rc * ck) * sk * db, torque = s.tc * sk * sk * db;
        t.a = total(te * cd - re * sd);
        t.b = total(te * sd + re * cd);
        t.c = total(tc * cc - rc * ss);
        t.d = total(tc * ss + rc * cc);
        t.v0 = total(rc);
        t.q0 = total(tc);
        t.w0 = total((s.ae * sk - s.re * ck) * db);
        t.w1 = total(ac * cd);
        t.w2 = total(ac * sd);
        t.t0 = total(te * sk);
        t.t1 = total(torque * cd);
        t.t2 = total(torque * sd);
    }
    if (s.high > from) {
        const float edge = s.high - from, half_lag = 0.5f * s.lag * edge, h2 = half_lag * half_lag, one = edge * SINC(h2), two = one * COSINE(h2);
        const float d = 0.5f * s.lag * (from - s.low), d2 = d * d, sd = d * SINC(d2), cd = COSINE(d2), ss = 2.0f * sd * cd, cc = 1.0f - 2.0f * sd * sd;
        t.a += one * (s.te * cd - s.re * sd);
        t.b += one * (s.te * sd + s.re * cd);
        t.c += 0.5f * two * (s.tc * cc - s.rc * ss);
        t.d += 0.5f * two * (s.tc * ss + s.rc * cc);
        t.v0 += 0.5f * edge * s.rc;
        t.q0 += 0.5f * edge * s.tc;
        t.w0 += edge * s.ae;
        t.w1 += one * s.ac * cd;
        t.w2 += one * s.ac * sd;
        t.t0 += edge * s.te;
        t.t1 += one * s.tc * cd;
        t.t2 += one * s.tc * sd;
    }
    return t;
}

__kernel void forces(__global const Segment* segments, __global float* out, const uint count) {
    const size_t id = get_global_id(0);
    if (id >= count) return;
    const Segment s = segments[id];
    const float8 lane = (float8)(0, 1, 2, 3, 4, 5, 6, 7);
    float8 peak_x = 0, peak_y = 0, peak_z = 0, peak_plane = 0, peak_all = 0, peak_torque = 0;
    float8 mean_plane = 0;
    const float inverse_lag = s.lag > 0 ? 1.0f / s.lag : 0.0f, middle_lag = 0.5f * s.lag * (s.low + s.high) + 1.57079633f;
    // Without a piece in which the whole edge is engaged its coefficients are never used.
    Tooth whole = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    if (s.lag * (s.high - s.low) < s.exit - s.entry) whole = engaged_tooth(s);
    for (int p = 0; p < s.pieces; ++p) {
        const float first = s.piece[p].x, length = s.piece[p].y, step = length / (s.piece[p].w - 1.0f);
        const int teeth = (int)s.piece[p].z, blocks = (int)s.piece[p].w / 8;
        for (int b = 0; b < blocks; ++b) {
            const float8 index = lane + (float)(8 * b);
            float8 x = 0, y = 0, z = 0, torque = 0;
            for (int m = 0; m < teeth; ++m) {
                const float begin = first + (float)m * s.pitch, middle = begin + 0.5f * length;
                const float8 u = begin + index * step;
                const int enters = s.lag > 0 && middle - s.lag * s.high < s.entry, leaves = s.lag > 0 && middle - s.lag * s.low > s.exit;
                if (!enters && !leaves) {
                    const float8 a = u - middle_lag, a2 = a * a, s1 = COSINE(a2), c1 = -a * SINC(a2), s2 = 2.0f * s1 * c1,
                                 c2 = 1.0f - 2.0f * s1 * s1;
                    x -= whole.v0 + whole.b * s1 + whole.a * c1 + whole.c * s2 - whole.d * c2;
                    y += whole.q0 + whole.a * s1 - whole.b * c1 - whole.d * s2 - whole.c * c2;
                    z += whole.w0 + whole.w1 * s1 - whole.w2 * c1;
                    torque += whole.t0 + whole.t1 * s1 - whole.t2 * c1;
                    continue;
                }
                float8 zl = s.low, zh = s.high;
                if (enters) {
                    zh = (u - s.entry) * inverse_lag;
                    zh = SMALLER(LARGER(zh, (float8)s.low), (float8)s.high);
                }
                if (leaves) {
                    zl = (u - s.exit) * inverse_lag;
                    zl = SMALLER(LARGER(zl, (float8)s.low), (float8)s.high);
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
