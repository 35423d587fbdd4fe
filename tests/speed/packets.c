/* Packets by hand, in AVX (WIDTH 8) or AVX-512 (WIDTH 16): the loops that packets_against_c.py
   times against rtbench's, over the same records in memory, operation by operation. */

#include <immintrin.h>
#include <stdint.h>

#if WIDTH == 16
typedef __m512 V;
typedef __m512i I;
typedef __mmask16 M;
#define LOAD _mm512_loadu_ps
#define STORE _mm512_storeu_ps
#define STOREI(p, x) _mm512_storeu_si512((p), (x))
#define ALL _mm512_set1_ps
#define ALLI _mm512_set1_epi32
#define ADD _mm512_add_ps
#define SUB _mm512_sub_ps
#define MUL _mm512_mul_ps
#define DIV _mm512_div_ps
#define NEG(x) _mm512_xor_ps((x), ALL(-0.0f))
#define LESS(a, b) _mm512_cmp_ps_mask((a), (b), _CMP_LT_OQ)
#define NOT_MORE(a, b) _mm512_cmp_ps_mask((a), (b), _CMP_LE_OQ)
#define AND(m, n) ((M)((m) & (n)))
#define CHOOSE(m, a, b) _mm512_mask_blend_ps((m), (b), (a))
#define CHOOSEI(m, a, b) _mm512_mask_blend_epi32((m), (b), (a))
#else
typedef __m256 V;
typedef __m256i I;
typedef __m256 M;
#define LOAD _mm256_loadu_ps
#define STORE _mm256_storeu_ps
#define STOREI(p, x) _mm256_storeu_si256((__m256i *)(p), (x))
#define ALL _mm256_set1_ps
#define ALLI _mm256_set1_epi32
#define ADD _mm256_add_ps
#define SUB _mm256_sub_ps
#define MUL _mm256_mul_ps
#define DIV _mm256_div_ps
#define NEG(x) _mm256_xor_ps((x), ALL(-0.0f))
#define LESS(a, b) _mm256_cmp_ps((a), (b), _CMP_LT_OQ)
#define NOT_MORE(a, b) _mm256_cmp_ps((a), (b), _CMP_LE_OQ)
#define AND _mm256_and_ps
#define CHOOSE(m, a, b) _mm256_blendv_ps((b), (a), (m))
#define CHOOSEI(m, a, b) \
    _mm256_castps_si256(_mm256_blendv_ps(_mm256_castsi256_ps(b), _mm256_castsi256_ps(a), (m)))
#endif

typedef struct { float orig[3][WIDTH], dir[3][WIDTH], tmax[WIDTH]; } ray_t;

/* One triangle against a packet: its numbers the same in all lanes. */
typedef struct {
    float nu, nv, nd, au, av, eou, eov, eiu, eiv;
    uint32_t w, u, v;
    int32_t axis, index;
} shevtsov_one_t;
typedef struct { float n[3], nd, nb[3], bd, nc[3], cd; int32_t axis, index; } planes_one_t;

/* W triangles of W pairs. */
typedef struct {
    float nu[WIDTH], nv[WIDTH], nd[WIDTH], au[WIDTH], av[WIDTH];
    float eou[WIDTH], eov[WIDTH], eiu[WIDTH], eiv[WIDTH];
    uint32_t w, u, v;
    int32_t axis, index[WIDTH];
} shevtsov_block_t;
typedef struct {
    float n[3][WIDTH], nd[WIDTH], nb[3][WIDTH], bd[WIDTH], nc[3][WIDTH], cd[WIDTH];
    int32_t axis, index[WIDTH];
} planes_block_t;

typedef struct { M hit; V t; } hit_t;

static inline hit_t inside(V t, V tmax, V b, V c)
{
    V zero = ALL(0.0f);
    M within = AND(AND(NOT_MORE(zero, b), NOT_MORE(zero, c)), NOT_MORE(ADD(b, c), ALL(1.0f)));
    return (hit_t){AND(AND(LESS(zero, t), LESS(t, tmax)), within), t};
}

/* GET reads a triangle's number: broadcast, or a row. */
#define SHEVTSOV(NAME, TRIANGLE, GET)                                                          \
    static inline hit_t NAME(const TRIANGLE *tri, const ray_t *ray, V tmax)                    \
    {                                                                                          \
        V du = LOAD(ray->dir[tri->u]), dv = LOAD(ray->dir[tri->v]), dw = LOAD(ray->dir[tri->w]); \
        V ou = LOAD(ray->orig[tri->u]), ov = LOAD(ray->orig[tri->v]);                          \
        V ow = LOAD(ray->orig[tri->w]);                                                        \
        V nu = GET(tri->nu), nv = GET(tri->nv);                                                \
        V inverse = DIV(ALL(1.0f), ADD(ADD(MUL(du, nu), MUL(dv, nv)), dw));                    \
        V t = MUL(SUB(GET(tri->nd), ADD(ADD(MUL(ou, nu), MUL(ov, nv)), ow)), inverse);         \
        V tu = SUB(MUL(du, t), SUB(GET(tri->au), ou));                                         \
        V tv = SUB(MUL(dv, t), SUB(GET(tri->av), ov));                                         \
        V b = SUB(MUL(GET(tri->eiv), tu), MUL(GET(tri->eiu), tv));                             \
        V c = SUB(MUL(GET(tri->eou), tv), MUL(GET(tri->eov), tu));                             \
        return inside(t, tmax, b, c);                                                          \
    }

#define DOT(a, x, y, z, GET) \
    ADD(ADD(MUL(GET((a)[0]), (x)), MUL(GET((a)[1]), (y))), MUL(GET((a)[2]), (z)))

#define PLANES(NAME, TRIANGLE, GET)                                                            \
    static inline hit_t NAME(const TRIANGLE *tri, const ray_t *ray, V tmax)                    \
    {                                                                                          \
        V dx = LOAD(ray->dir[0]), dy = LOAD(ray->dir[1]), dz = LOAD(ray->dir[2]);              \
        V ox = LOAD(ray->orig[0]), oy = LOAD(ray->orig[1]), oz = LOAD(ray->orig[2]);           \
        V inverse = DIV(ALL(1.0f), DOT(tri->n, dx, dy, dz, GET));                              \
        V t = MUL(NEG(ADD(DOT(tri->n, ox, oy, oz, GET), GET(tri->nd))), inverse);              \
        V px = ADD(ox, MUL(dx, t)), py = ADD(oy, MUL(dy, t)), pz = ADD(oz, MUL(dz, t));        \
        V b = ADD(DOT(tri->nb, px, py, pz, GET), GET(tri->bd));                                \
        V c = ADD(DOT(tri->nc, px, py, pz, GET), GET(tri->cd));                                \
        return inside(t, tmax, b, c);                                                          \
    }

SHEVTSOV(shevtsov_one, shevtsov_one_t, ALL)
SHEVTSOV(shevtsov_block, shevtsov_block_t, LOAD)
PLANES(planes_one, planes_one_t, ALL)
PLANES(planes_block, planes_block_t, LOAD)

#define RAYS(NAME, TEST, TRIANGLE)                                                             \
    void NAME(int64_t triangles, int64_t outer, int64_t inner, const uint64_t *first,          \
              const uint64_t *second, const TRIANGLE *tri, const ray_t *rays,                  \
              int32_t *restrict outcome, float *restrict t)                                    \
    {                                                                                          \
        for (int64_t a = 0; a < outer; a++)                                                    \
            for (int64_t b = 0; b < inner; b++) {                                              \
                uint64_t k = first[a] + second[b];                                             \
                V tmax = LOAD(rays[k].tmax);                                                   \
                I hit = ALLI(-1);                                                              \
                for (int64_t i = 0; i < triangles; i++) {                                      \
                    hit_t got = TEST(tri + i, rays + k, tmax);                                 \
                    hit = CHOOSEI(got.hit, ALLI(tri[i].index), hit);                           \
                    tmax = CHOOSE(got.hit, got.t, tmax);                                       \
                }                                                                              \
                STOREI(outcome + k * WIDTH, hit);                                              \
                STORE(t + k * WIDTH, tmax);                                                    \
            }                                                                                  \
    }

#define PAIRS(NAME, TEST, TRIANGLE)                                                            \
    void NAME(int64_t triangles, int64_t outer, int64_t inner, const uint64_t *first,          \
              const uint64_t *second, const TRIANGLE *tri, const ray_t *rays,                  \
              int32_t *restrict outcome, float *restrict t)                                    \
    {                                                                                          \
        for (int64_t a = 0; a < outer; a++)                                                    \
            for (int64_t b = 0; b < inner; b++) {                                              \
                uint64_t k = first[a] + second[b];                                             \
                hit_t got = TEST(tri + k, rays + k, LOAD(rays[k].tmax));                       \
                STOREI(outcome + k * WIDTH, CHOOSEI(got.hit, ALLI(0), ALLI(1)));               \
                STORE(t + k * WIDTH, got.t);                                                   \
            }                                                                                  \
    }

RAYS(shevtsov_rays, shevtsov_one, shevtsov_one_t)
RAYS(perpendicular_planes_rays, planes_one, planes_one_t)
PAIRS(shevtsov_pairs, shevtsov_block, shevtsov_block_t)
PAIRS(perpendicular_planes_pairs, planes_block, planes_block_t)
