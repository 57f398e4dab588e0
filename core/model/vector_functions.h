#pragma once

// Mathematical functions of a Lane by libmvec, the vector library of the GNU C library, and the
// same of a number by its scalar functions. Those of a Lane are off by less than 4 units in the
// last place, tanh by less than 6; square roots are exact. A point gets the same bits in any lane.

#include <cmath>

#include "core/model/lane.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace polyest::internal {

// The widest vectors of the processor that is compiled for, and libmvec's names of its functions of
// one of them (v) or of two (vv).
#if defined(__x86_64__)
#if defined(__AVX512F__)
using Pack = __m512d;
#define POLYEST_OF_PACKS(form, name) _ZGVeN8##form##_##name
#define POLYEST_ROOT_OF_PACK _mm512_sqrt_pd
#elif defined(__AVX2__)
using Pack = __m256d;
#define POLYEST_OF_PACKS(form, name) _ZGVdN4##form##_##name
#define POLYEST_ROOT_OF_PACK _mm256_sqrt_pd
#else
using Pack = __m128d;
#define POLYEST_OF_PACKS(form, name) _ZGVbN2##form##_##name
#define POLYEST_ROOT_OF_PACK _mm_sqrt_pd
#endif
#define POLYEST_DECLARE(function, ...) extern "C" Pack function(__VA_ARGS__);
#else  // There is no libmvec.
using Pack = double;
#define POLYEST_OF_PACKS(form, name) std::name
#define POLYEST_ROOT_OF_PACK std::sqrt
#define POLYEST_DECLARE(function, ...)
#endif

// Returns function(arguments …), pack by pack.
template <class Function, class... Lanes>
Lane ByPacks(Function function, const Lanes&... arguments) {
  constexpr int kPack = sizeof(Pack) / sizeof(double);
  Lane result;
  for (int i = 0; i < kLanes; i += kPack) {
    *reinterpret_cast<Pack*>(&result[i]) =
        function(*reinterpret_cast<const Pack*>(&arguments[i])...);
  }
  return result;
}

#define POLYEST_UNARY(Name, name)                                                 \
  POLYEST_DECLARE(POLYEST_OF_PACKS(v, name), Pack)                                \
  inline double Name(double a) { return std::name(a); }                           \
  inline Lane Name(const Lane& a) {                                               \
    return ByPacks([](Pack pack) { return POLYEST_OF_PACKS(v, name)(pack); }, a); \
  }
#define POLYEST_BINARY(Name, name)                                                         \
  POLYEST_DECLARE(POLYEST_OF_PACKS(vv, name), Pack, Pack)                                  \
  inline double Name(double a, double b) { return std::name(a, b); }                       \
  inline Lane Name(const Lane& a, const Lane& b) {                                         \
    return ByPacks([](Pack x, Pack y) { return POLYEST_OF_PACKS(vv, name)(x, y); }, a, b); \
  }

POLYEST_UNARY(Sin, sin)
POLYEST_UNARY(Cos, cos)
POLYEST_UNARY(Tan, tan)
POLYEST_UNARY(Asin, asin)
POLYEST_UNARY(Acos, acos)
POLYEST_UNARY(Atan, atan)
POLYEST_UNARY(Sinh, sinh)
POLYEST_UNARY(Cosh, cosh)
POLYEST_UNARY(Expm1, expm1)
POLYEST_UNARY(Log, log)
POLYEST_UNARY(Log10, log10)
POLYEST_BINARY(Atan2, atan2)
POLYEST_BINARY(Hypot, hypot)
POLYEST_BINARY(Pow, pow)

// Eigen's own root is an approximation refined by Newton steps on processors with AVX-512.
inline double Sqrt(double x) { return std::sqrt(x); }
inline Lane Sqrt(const Lane& x) {
  return ByPacks([](Pack pack) { return POLYEST_ROOT_OF_PACK(pack); }, x);
}

// tanh |x| = (1 − e^{−2|x|})/(1 + e^{−2|x|}), which is accurate near 0, too.
inline Lane HyperbolicTangent(const Lane& x) {
  return ByPacks(
      [](Pack pack) {
        const Pack power = POLYEST_OF_PACKS(v, expm1)(pack > 0 ? -2 * pack : 2 * pack);
        const Pack size = power / (power + 2);
        return pack > 0 ? -size : size;
      },
      x);
}

#undef POLYEST_UNARY
#undef POLYEST_BINARY
#undef POLYEST_OF_PACKS
#undef POLYEST_DECLARE
#undef POLYEST_ROOT_OF_PACK

}  // namespace polyest::internal
