/* The kernels in C: what the Python ones are compared with, bit for bit and nanosecond for
 * nanosecond.
 *
 * moller1, badouel and chirkov are the listings of Blecha 2007, section 4.5, as printed: only the
 * type is REAL instead of float, the scan's ppx and pvx are one variable, and EPSILON has the type
 * of what it is compared with. moller0, moller2 and moller3 are the variants of Loefstedt &
 * Akenine-Moller 2005 in the same words. The _uv forms also give the barycentric weights of v1 and
 * v2 (Blecha 2007, section 4.6).
 *
 *     cc -O2 -ffp-contract=off -shared -fPIC [-DREAL=double] listings.c -o listings.so
 *
 * run_NAME tests n pairs once and returns the number of hits; what a test does not tell is NAN.
 * nest_NAME is the loop that is timed: tests k = first[a] + second[b] for all a and b. badouel
 * tells t before it knows whether it hits, and so with its codes 2, 3 and 4 too.
 */
#include <math.h>
#include <stdint.h>

#ifndef REAL
#define REAL float
#endif

#define EPSILON ((REAL)0.000001)

typedef struct {
    REAL v0[3], v1[3], v2[3];
    REAL normal[3], d;
    uint32_t i0, i1, i2;
} TRIANGLE;

typedef struct {
    REAL orig[3], end[3], dir[3];
} RAY;

static inline int moller0(const TRIANGLE *tri, const RAY *ray, REAL *t)
{
    REAL e1x = tri->v1[0] - tri->v0[0];
    REAL e1y = tri->v1[1] - tri->v0[1];
    REAL e1z = tri->v1[2] - tri->v0[2];
    REAL e2x = tri->v2[0] - tri->v0[0];
    REAL e2y = tri->v2[1] - tri->v0[1];
    REAL e2z = tri->v2[2] - tri->v0[2];

    REAL pvx = ray->dir[1] * e2z - ray->dir[2] * e2y;
    REAL pvy = ray->dir[2] * e2x - ray->dir[0] * e2z;
    REAL pvz = ray->dir[0] * e2y - ray->dir[1] * e2x;

    REAL det = e1x * pvx + e1y * pvy + e1z * pvz;
    if (det > -EPSILON && det < EPSILON)
        return 5;

    REAL inv_det = 1.0f / det;

    REAL tvx = ray->orig[0] - tri->v0[0];
    REAL tvy = ray->orig[1] - tri->v0[1];
    REAL tvz = ray->orig[2] - tri->v0[2];

    REAL u = (tvx * pvx + tvy * pvy + tvz * pvz) * inv_det;
    if (u < 0.0 || u > 1.0)
        return 1;

    REAL qvx = tvy * e1z - tvz * e1y;
    REAL qvy = tvz * e1x - tvx * e1z;
    REAL qvz = tvx * e1y - tvy * e1x;

    REAL v = (ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz) * inv_det;
    if (v < 0.0 || u + v > 1.0)
        return 2;

    *t = (e2x * qvx + e2y * qvy + e2z * qvz) * inv_det;

    return 0;
}

static inline int moller1(const TRIANGLE *tri, const RAY *ray, REAL *t)
{
    REAL e1x = tri->v1[0] - tri->v0[0];
    REAL e1y = tri->v1[1] - tri->v0[1];
    REAL e1z = tri->v1[2] - tri->v0[2];
    REAL e2x = tri->v2[0] - tri->v0[0];
    REAL e2y = tri->v2[1] - tri->v0[1];
    REAL e2z = tri->v2[2] - tri->v0[2];

    REAL pvx = ray->dir[1] * e2z - ray->dir[2] * e2y;
    REAL pvy = ray->dir[2] * e2x - ray->dir[0] * e2z;
    REAL pvz = ray->dir[0] * e2y - ray->dir[1] * e2x;

    REAL det = e1x * pvx + e1y * pvy + e1z * pvz;

    REAL qvx, qvy, qvz;
    if (det > EPSILON) {
        REAL tvx = ray->orig[0] - tri->v0[0];
        REAL tvy = ray->orig[1] - tri->v0[1];
        REAL tvz = ray->orig[2] - tri->v0[2];

        REAL u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u < 0.0 || u > det)
            return 1;

        qvx = tvy * e1z - tvz * e1y;
        qvy = tvz * e1x - tvx * e1z;
        qvz = tvx * e1y - tvy * e1x;

        REAL v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v < 0.0 || u + v > det)
            return 2;
    } else if (det < -EPSILON) {
        REAL tvx = ray->orig[0] - tri->v0[0];
        REAL tvy = ray->orig[1] - tri->v0[1];
        REAL tvz = ray->orig[2] - tri->v0[2];

        REAL u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u > 0.0 || u < det)
            return 3;

        qvx = tvy * e1z - tvz * e1y;
        qvy = tvz * e1x - tvx * e1z;
        qvz = tvx * e1y - tvy * e1x;

        REAL v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v > 0.0 || u + v < det)
            return 4;
    } else
        return 5;

    REAL inv_det = 1.0f / det;
    *t = (e2x * qvx + e2y * qvy + e2z * qvz) * inv_det;

    return 0;
}

static inline int moller2(const TRIANGLE *tri, const RAY *ray, REAL *t)
{
    REAL e1x = tri->v1[0] - tri->v0[0];
    REAL e1y = tri->v1[1] - tri->v0[1];
    REAL e1z = tri->v1[2] - tri->v0[2];
    REAL e2x = tri->v2[0] - tri->v0[0];
    REAL e2y = tri->v2[1] - tri->v0[1];
    REAL e2z = tri->v2[2] - tri->v0[2];

    REAL pvx = ray->dir[1] * e2z - ray->dir[2] * e2y;
    REAL pvy = ray->dir[2] * e2x - ray->dir[0] * e2z;
    REAL pvz = ray->dir[0] * e2y - ray->dir[1] * e2x;

    REAL det = e1x * pvx + e1y * pvy + e1z * pvz;

    REAL tvx = ray->orig[0] - tri->v0[0];
    REAL tvy = ray->orig[1] - tri->v0[1];
    REAL tvz = ray->orig[2] - tri->v0[2];

    REAL inv_det = 1.0f / det;

    REAL qvx, qvy, qvz;
    if (det > EPSILON) {
        REAL u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u < 0.0 || u > det)
            return 1;

        qvx = tvy * e1z - tvz * e1y;
        qvy = tvz * e1x - tvx * e1z;
        qvz = tvx * e1y - tvy * e1x;

        REAL v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v < 0.0 || u + v > det)
            return 2;
    } else if (det < -EPSILON) {
        REAL u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u > 0.0 || u < det)
            return 3;

        qvx = tvy * e1z - tvz * e1y;
        qvy = tvz * e1x - tvx * e1z;
        qvz = tvx * e1y - tvy * e1x;

        REAL v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v > 0.0 || u + v < det)
            return 4;
    } else
        return 5;

    *t = (e2x * qvx + e2y * qvy + e2z * qvz) * inv_det;

    return 0;
}

static inline int moller3(const TRIANGLE *tri, const RAY *ray, REAL *t)
{
    REAL e1x = tri->v1[0] - tri->v0[0];
    REAL e1y = tri->v1[1] - tri->v0[1];
    REAL e1z = tri->v1[2] - tri->v0[2];
    REAL e2x = tri->v2[0] - tri->v0[0];
    REAL e2y = tri->v2[1] - tri->v0[1];
    REAL e2z = tri->v2[2] - tri->v0[2];

    REAL pvx = ray->dir[1] * e2z - ray->dir[2] * e2y;
    REAL pvy = ray->dir[2] * e2x - ray->dir[0] * e2z;
    REAL pvz = ray->dir[0] * e2y - ray->dir[1] * e2x;

    REAL det = e1x * pvx + e1y * pvy + e1z * pvz;

    REAL tvx = ray->orig[0] - tri->v0[0];
    REAL tvy = ray->orig[1] - tri->v0[1];
    REAL tvz = ray->orig[2] - tri->v0[2];

    REAL inv_det = 1.0f / det;

    REAL qvx = tvy * e1z - tvz * e1y;
    REAL qvy = tvz * e1x - tvx * e1z;
    REAL qvz = tvx * e1y - tvy * e1x;

    if (det > EPSILON) {
        REAL u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u < 0.0 || u > det)
            return 1;

        REAL v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v < 0.0 || u + v > det)
            return 2;
    } else if (det < -EPSILON) {
        REAL u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u > 0.0 || u < det)
            return 3;

        REAL v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v > 0.0 || u + v < det)
            return 4;
    } else
        return 5;

    *t = (e2x * qvx + e2y * qvy + e2z * qvz) * inv_det;

    return 0;
}

static inline int badouel(const TRIANGLE *tri, const RAY *ray, REAL *t)
{
    REAL dot = ray->dir[0] * tri->normal[0] + ray->dir[1] * tri->normal[1]
        + ray->dir[2] * tri->normal[2];
    if (dot > -EPSILON && dot < EPSILON)
        return 1;

    REAL dot2 = ray->orig[0] * tri->normal[0] + ray->orig[1]
        * tri->normal[1] + ray->orig[2] * tri->normal[2];
    *t = -(tri->d + dot2) / dot;

    REAL pointa = ray->orig[tri->i1] + ray->dir[tri->i1] * *t;
    REAL pointb = ray->orig[tri->i2] + ray->dir[tri->i2] * *t;

    REAL uu0 = pointa - tri->v0[tri->i1];
    REAL uu1 = tri->v1[tri->i1] - tri->v0[tri->i1];
    REAL uu2 = tri->v2[tri->i1] - tri->v0[tri->i1];
    REAL vv0 = pointb - tri->v0[tri->i2];
    REAL vv1 = tri->v1[tri->i2] - tri->v0[tri->i2];
    REAL vv2 = tri->v2[tri->i2] - tri->v0[tri->i2];

    REAL alpha, beta;
    if (uu1 == 0.0) {
        beta = uu0 / uu2;
        if (beta < 0.0 || beta > 1.0)
            return 2;
        alpha = (vv0 - beta * vv2) / vv1;
    } else {
        beta = (vv0 * uu1 - uu0 * vv1) / (vv2 * uu1 - uu2 * vv1);
        if (beta < 0.0 || beta > 1.0)
            return 3;
        alpha = (uu0 - beta * uu2) / uu1;
    }

    if (alpha < 0 || (alpha + beta) > 1.0)
        return 4;

    return 0;
}

static inline int chirkov(const TRIANGLE *tri, const RAY *ray, REAL *t)
{
    REAL signSrc = tri->normal[0] * ray->orig[0] + tri->normal[1]
        * ray->orig[1] + tri->normal[2] * ray->orig[2] + tri->d;
    REAL signDst = tri->normal[0] * ray->end[0] + tri->normal[1]
        * ray->end[1] + tri->normal[2] * ray->end[2] + tri->d;

    REAL dd = signSrc - signDst;

    REAL ay = tri->v1[tri->i1] - tri->v0[tri->i1];
    REAL az = tri->v1[tri->i2] - tri->v0[tri->i2];
    REAL by = tri->v2[tri->i1] - tri->v0[tri->i1];
    REAL bz = tri->v2[tri->i2] - tri->v0[tri->i2];

    REAL dely = ray->end[tri->i1] - ray->orig[tri->i1];
    REAL delz = ray->end[tri->i2] - ray->orig[tri->i2];

    REAL basey = ray->orig[tri->i1] - tri->v0[tri->i1];
    REAL basez = ray->orig[tri->i2] - tri->v0[tri->i2];

    REAL adelxbase = signSrc * (ay * delz - az * dely)
        + dd * (ay * basez - az * basey);

    if (adelxbase * (signSrc * (dely * bz - delz * by)
        + dd * (basey * bz - basez * by)) >= 0.0) {
        REAL cy = tri->v2[tri->i1] - tri->v1[tri->i1];
        REAL cz = tri->v2[tri->i2] - tri->v1[tri->i2];
        basey = ray->orig[tri->i1] - tri->v1[tri->i1];
        basez = ray->orig[tri->i2] - tri->v1[tri->i2];
        if (adelxbase * (signSrc * (dely * cz - delz * cy)
            + dd * (basey * cz - basez * cy)) < 0.0) {
            *t = - signSrc / (ray->dir[0] * tri->normal[0] + ray->dir[1]
                * tri->normal[1] + ray->dir[2] * tri->normal[2]);
            return 0;
        }
    }
    return 1;
}

static inline int moller0_uv(const TRIANGLE *tri, const RAY *ray, REAL *t, REAL *tu, REAL *tv)
{
    REAL e1x = tri->v1[0] - tri->v0[0];
    REAL e1y = tri->v1[1] - tri->v0[1];
    REAL e1z = tri->v1[2] - tri->v0[2];
    REAL e2x = tri->v2[0] - tri->v0[0];
    REAL e2y = tri->v2[1] - tri->v0[1];
    REAL e2z = tri->v2[2] - tri->v0[2];

    REAL pvx = ray->dir[1] * e2z - ray->dir[2] * e2y;
    REAL pvy = ray->dir[2] * e2x - ray->dir[0] * e2z;
    REAL pvz = ray->dir[0] * e2y - ray->dir[1] * e2x;

    REAL det = e1x * pvx + e1y * pvy + e1z * pvz;
    if (det > -EPSILON && det < EPSILON)
        return 5;

    REAL inv_det = 1.0f / det;

    REAL tvx = ray->orig[0] - tri->v0[0];
    REAL tvy = ray->orig[1] - tri->v0[1];
    REAL tvz = ray->orig[2] - tri->v0[2];

    REAL u = (tvx * pvx + tvy * pvy + tvz * pvz) * inv_det;
    if (u < 0.0 || u > 1.0)
        return 1;

    REAL qvx = tvy * e1z - tvz * e1y;
    REAL qvy = tvz * e1x - tvx * e1z;
    REAL qvz = tvx * e1y - tvy * e1x;

    REAL v = (ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz) * inv_det;
    if (v < 0.0 || u + v > 1.0)
        return 2;

    *t = (e2x * qvx + e2y * qvy + e2z * qvz) * inv_det;
    *tu = u;
    *tv = v;

    return 0;
}

static inline int moller1_uv(const TRIANGLE *tri, const RAY *ray, REAL *t, REAL *tu, REAL *tv)
{
    REAL e1x = tri->v1[0] - tri->v0[0];
    REAL e1y = tri->v1[1] - tri->v0[1];
    REAL e1z = tri->v1[2] - tri->v0[2];
    REAL e2x = tri->v2[0] - tri->v0[0];
    REAL e2y = tri->v2[1] - tri->v0[1];
    REAL e2z = tri->v2[2] - tri->v0[2];

    REAL pvx = ray->dir[1] * e2z - ray->dir[2] * e2y;
    REAL pvy = ray->dir[2] * e2x - ray->dir[0] * e2z;
    REAL pvz = ray->dir[0] * e2y - ray->dir[1] * e2x;

    REAL det = e1x * pvx + e1y * pvy + e1z * pvz;

    REAL qvx, qvy, qvz;
    REAL u, v;
    if (det > EPSILON) {
        REAL tvx = ray->orig[0] - tri->v0[0];
        REAL tvy = ray->orig[1] - tri->v0[1];
        REAL tvz = ray->orig[2] - tri->v0[2];

        u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u < 0.0 || u > det)
            return 1;

        qvx = tvy * e1z - tvz * e1y;
        qvy = tvz * e1x - tvx * e1z;
        qvz = tvx * e1y - tvy * e1x;

        v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v < 0.0 || u + v > det)
            return 2;
    } else if (det < -EPSILON) {
        REAL tvx = ray->orig[0] - tri->v0[0];
        REAL tvy = ray->orig[1] - tri->v0[1];
        REAL tvz = ray->orig[2] - tri->v0[2];

        u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u > 0.0 || u < det)
            return 3;

        qvx = tvy * e1z - tvz * e1y;
        qvy = tvz * e1x - tvx * e1z;
        qvz = tvx * e1y - tvy * e1x;

        v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v > 0.0 || u + v < det)
            return 4;
    } else
        return 5;

    REAL inv_det = 1.0f / det;
    *t = (e2x * qvx + e2y * qvy + e2z * qvz) * inv_det;
    *tu = u * inv_det;
    *tv = v * inv_det;

    return 0;
}

static inline int moller2_uv(const TRIANGLE *tri, const RAY *ray, REAL *t, REAL *tu, REAL *tv)
{
    REAL e1x = tri->v1[0] - tri->v0[0];
    REAL e1y = tri->v1[1] - tri->v0[1];
    REAL e1z = tri->v1[2] - tri->v0[2];
    REAL e2x = tri->v2[0] - tri->v0[0];
    REAL e2y = tri->v2[1] - tri->v0[1];
    REAL e2z = tri->v2[2] - tri->v0[2];

    REAL pvx = ray->dir[1] * e2z - ray->dir[2] * e2y;
    REAL pvy = ray->dir[2] * e2x - ray->dir[0] * e2z;
    REAL pvz = ray->dir[0] * e2y - ray->dir[1] * e2x;

    REAL det = e1x * pvx + e1y * pvy + e1z * pvz;

    REAL tvx = ray->orig[0] - tri->v0[0];
    REAL tvy = ray->orig[1] - tri->v0[1];
    REAL tvz = ray->orig[2] - tri->v0[2];

    REAL inv_det = 1.0f / det;

    REAL qvx, qvy, qvz;
    REAL u, v;
    if (det > EPSILON) {
        u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u < 0.0 || u > det)
            return 1;

        qvx = tvy * e1z - tvz * e1y;
        qvy = tvz * e1x - tvx * e1z;
        qvz = tvx * e1y - tvy * e1x;

        v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v < 0.0 || u + v > det)
            return 2;
    } else if (det < -EPSILON) {
        u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u > 0.0 || u < det)
            return 3;

        qvx = tvy * e1z - tvz * e1y;
        qvy = tvz * e1x - tvx * e1z;
        qvz = tvx * e1y - tvy * e1x;

        v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v > 0.0 || u + v < det)
            return 4;
    } else
        return 5;

    *t = (e2x * qvx + e2y * qvy + e2z * qvz) * inv_det;
    *tu = u * inv_det;
    *tv = v * inv_det;

    return 0;
}

static inline int moller3_uv(const TRIANGLE *tri, const RAY *ray, REAL *t, REAL *tu, REAL *tv)
{
    REAL e1x = tri->v1[0] - tri->v0[0];
    REAL e1y = tri->v1[1] - tri->v0[1];
    REAL e1z = tri->v1[2] - tri->v0[2];
    REAL e2x = tri->v2[0] - tri->v0[0];
    REAL e2y = tri->v2[1] - tri->v0[1];
    REAL e2z = tri->v2[2] - tri->v0[2];

    REAL pvx = ray->dir[1] * e2z - ray->dir[2] * e2y;
    REAL pvy = ray->dir[2] * e2x - ray->dir[0] * e2z;
    REAL pvz = ray->dir[0] * e2y - ray->dir[1] * e2x;

    REAL det = e1x * pvx + e1y * pvy + e1z * pvz;

    REAL tvx = ray->orig[0] - tri->v0[0];
    REAL tvy = ray->orig[1] - tri->v0[1];
    REAL tvz = ray->orig[2] - tri->v0[2];

    REAL inv_det = 1.0f / det;

    REAL qvx = tvy * e1z - tvz * e1y;
    REAL qvy = tvz * e1x - tvx * e1z;
    REAL qvz = tvx * e1y - tvy * e1x;

    REAL u, v;
    if (det > EPSILON) {
        u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u < 0.0 || u > det)
            return 1;

        v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v < 0.0 || u + v > det)
            return 2;
    } else if (det < -EPSILON) {
        u = tvx * pvx + tvy * pvy + tvz * pvz;
        if (u > 0.0 || u < det)
            return 3;

        v = ray->dir[0] * qvx + ray->dir[1] * qvy + ray->dir[2] * qvz;
        if (v > 0.0 || u + v < det)
            return 4;
    } else
        return 5;

    *t = (e2x * qvx + e2y * qvy + e2z * qvz) * inv_det;
    *tu = u * inv_det;
    *tv = v * inv_det;

    return 0;
}

static inline int badouel_uv(const TRIANGLE *tri, const RAY *ray, REAL *t, REAL *tu, REAL *tv)
{
    REAL dot = ray->dir[0] * tri->normal[0] + ray->dir[1] * tri->normal[1]
        + ray->dir[2] * tri->normal[2];
    if (dot > -EPSILON && dot < EPSILON)
        return 1;

    REAL dot2 = ray->orig[0] * tri->normal[0] + ray->orig[1]
        * tri->normal[1] + ray->orig[2] * tri->normal[2];
    *t = -(tri->d + dot2) / dot;

    REAL pointa = ray->orig[tri->i1] + ray->dir[tri->i1] * *t;
    REAL pointb = ray->orig[tri->i2] + ray->dir[tri->i2] * *t;

    REAL uu0 = pointa - tri->v0[tri->i1];
    REAL uu1 = tri->v1[tri->i1] - tri->v0[tri->i1];
    REAL uu2 = tri->v2[tri->i1] - tri->v0[tri->i1];
    REAL vv0 = pointb - tri->v0[tri->i2];
    REAL vv1 = tri->v1[tri->i2] - tri->v0[tri->i2];
    REAL vv2 = tri->v2[tri->i2] - tri->v0[tri->i2];

    REAL alpha, beta;
    if (uu1 == 0.0) {
        beta = uu0 / uu2;
        if (beta < 0.0 || beta > 1.0)
            return 2;
        alpha = (vv0 - beta * vv2) / vv1;
    } else {
        beta = (vv0 * uu1 - uu0 * vv1) / (vv2 * uu1 - uu2 * vv1);
        if (beta < 0.0 || beta > 1.0)
            return 3;
        alpha = (uu0 - beta * uu2) / uu1;
    }

    if (alpha < 0 || (alpha + beta) > 1.0)
        return 4;

    *tu = alpha;
    *tv = beta;
    return 0;
}

static inline int chirkov_uv(const TRIANGLE *tri, const RAY *ray, REAL *t, REAL *tu, REAL *tv)
{
    REAL signSrc = tri->normal[0] * ray->orig[0] + tri->normal[1]
        * ray->orig[1] + tri->normal[2] * ray->orig[2] + tri->d;
    REAL signDst = tri->normal[0] * ray->end[0] + tri->normal[1]
        * ray->end[1] + tri->normal[2] * ray->end[2] + tri->d;

    REAL dd = signSrc - signDst;

    REAL ay = tri->v1[tri->i1] - tri->v0[tri->i1];
    REAL az = tri->v1[tri->i2] - tri->v0[tri->i2];
    REAL by = tri->v2[tri->i1] - tri->v0[tri->i1];
    REAL bz = tri->v2[tri->i2] - tri->v0[tri->i2];

    REAL dely = ray->end[tri->i1] - ray->orig[tri->i1];
    REAL delz = ray->end[tri->i2] - ray->orig[tri->i2];

    REAL basey = ray->orig[tri->i1] - tri->v0[tri->i1];
    REAL basez = ray->orig[tri->i2] - tri->v0[tri->i2];

    REAL adelxbase = signSrc * (ay * delz - az * dely)
        + dd * (ay * basez - az * basey);

    REAL bdelxbase = signSrc * (dely * bz - delz * by)
        + dd * (basey * bz - basez * by);

    if (adelxbase * bdelxbase >= 0.0) {
        REAL cy = tri->v2[tri->i1] - tri->v1[tri->i1];
        REAL cz = tri->v2[tri->i2] - tri->v1[tri->i2];
        basey = ray->orig[tri->i1] - tri->v1[tri->i1];
        basez = ray->orig[tri->i2] - tri->v1[tri->i2];
        if (adelxbase * (signSrc * (dely * cz - delz * cy)
            + dd * (basey * cz - basez * cy)) < 0.0) {
            *t = - signSrc / (ray->dir[0] * tri->normal[0] + ray->dir[1]
                * tri->normal[1] + ray->dir[2] * tri->normal[2]);
            REAL inv = 1.0f / (dd * (ay * bz - az * by));
            *tu = bdelxbase * inv;
            *tv = adelxbase * inv;
            return 0;
        }
    }
    return 1;
}

/* What is left of the loop when nothing is tested. */
static inline int empty(const TRIANGLE *tri, const RAY *ray, REAL *t)
{
    (void)tri, (void)ray, (void)t;
    return 1;
}

#define RUN(name, ...)                                                                            \
    int run_##name(int64_t n, const TRIANGLE *tris, const RAY *rays, int32_t *outcome, REAL *t,   \
                   REAL *u, REAL *v)                                                              \
    {                                                                                             \
        int hits = 0;                                                                             \
        for (int64_t k = 0; k < n; k++) {                                                         \
            t[k] = u[k] = v[k] = (REAL)NAN;                                                       \
            outcome[k] = name(&tris[k], &rays[k], &t[k], ##__VA_ARGS__);                          \
            hits += outcome[k] == 0;                                                              \
        }                                                                                         \
        return hits;                                                                              \
    }

#define NEST(name)                                                                                \
    void nest_##name(int64_t na, int64_t nb, const uint64_t *first, const uint64_t *second,       \
                     const TRIANGLE *tris, const RAY *rays, int32_t *outcome, REAL *t)            \
    {                                                                                             \
        for (int64_t a = 0; a < na; a++)                                                          \
            for (int64_t b = 0; b < nb; b++) {                                                    \
                uint64_t k = first[a] + second[b];                                                \
                REAL found = (REAL)NAN;                                                           \
                outcome[k] = name(&tris[k], &rays[k], &found);                                    \
                t[k] = found;                                                                     \
            }                                                                                     \
    }

#define NEST_UV(name)                                                                             \
    void nest_##name(int64_t na, int64_t nb, const uint64_t *first, const uint64_t *second,       \
                     const TRIANGLE *tris, const RAY *rays, int32_t *outcome, REAL *t, REAL *u,   \
                     REAL *v)                                                                     \
    {                                                                                             \
        for (int64_t a = 0; a < na; a++)                                                          \
            for (int64_t b = 0; b < nb; b++) {                                                    \
                uint64_t k = first[a] + second[b];                                                \
                REAL found = (REAL)NAN, weight1 = (REAL)NAN, weight2 = (REAL)NAN;                 \
                outcome[k] = name(&tris[k], &rays[k], &found, &weight1, &weight2);                \
                t[k] = found;                                                                     \
                u[k] = weight1;                                                                   \
                v[k] = weight2;                                                                   \
            }                                                                                     \
    }

#define PLAIN(name) RUN(name) NEST(name)
#define WITH_UV(name) RUN(name, &u[k], &v[k]) NEST_UV(name)

PLAIN(moller0)
PLAIN(moller1)
PLAIN(moller2)
PLAIN(moller3)
PLAIN(badouel)
PLAIN(chirkov)
WITH_UV(moller0_uv)
WITH_UV(moller1_uv)
WITH_UV(moller2_uv)
WITH_UV(moller3_uv)
WITH_UV(badouel_uv)
WITH_UV(chirkov_uv)
PLAIN(empty)
