// The two widths of a formula: eight particles at once on a processor, one at a time on a card.
// A formula is a template on its number type R; Lanes<R> has what differs between the widths.
#pragma once
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define MPM_RARE
#define MPM_INLINE __forceinline__
#else
#define MPM_RARE __attribute__((noinline))
#define MPM_INLINE __attribute__((always_inline)) inline
#endif
namespace mpm {
// Unnamed in every header: functions of internal linkage are inlined in each module, and which
// products are fused with sums, so the last bit of results, depends on that.
namespace {
template <class R> struct Lanes;

template <> struct Lanes<float> {
  typedef int Mask;   // 0 or 1; also the integer of the same width
  CUDA_CALLABLE static inline float all(float a) { return a; }
  CUDA_CALLABLE static inline float pick(int m, float a, float b) { return m ? a : b; }
  CUDA_CALLABLE static inline float root(float a) { return sqrtf(a); }
  CUDA_CALLABLE static inline float high(float a, float b) { return a > b ? a : b; }
  CUDA_CALLABLE static inline float low(float a, float b) { return a < b ? a : b; }
  CUDA_CALLABLE static inline float size(float a) { return fabsf(a); }
  CUDA_CALLABLE static inline bool any(int m) { return m != 0; }
  CUDA_CALLABLE static inline float flo(int a) { return (float)a; }
  CUDA_CALLABLE static inline int whole(float a) { return (int)a; }
  CUDA_CALLABLE static inline int bits(float a) {
    union { float f; int i; } u;
    u.f = a;
    return u.i;
  }
  CUDA_CALLABLE static inline float from_bits(int a) {
    union { float f; int i; } u;
    u.i = a;
    return u.f;
  }
};

#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
// Vectors are GCC/clang extensions: they compile on any processor.
typedef float f8 __attribute__((vector_size(32)));
typedef int i8 __attribute__((vector_size(32)));
template <> struct Lanes<f8> {
  typedef i8 Mask;
  static inline f8 all(float a) { return f8{a, a, a, a, a, a, a, a}; }
  static inline f8 pick(i8 m, f8 a, f8 b) { return m ? a : b; }
  static inline f8 root(f8 a) { return __builtin_elementwise_sqrt(a); }
  static inline f8 high(f8 a, f8 b) { return a > b ? a : b; }
  static inline f8 low(f8 a, f8 b) { return a < b ? a : b; }
  static inline f8 size(f8 a) { return (f8)((i8)a & 0x7fffffff); }
  static inline int which(i8 m) {     // of a mask: a bit each
#if defined(__AVX__)
    return __builtin_ia32_movmskps256((f8)m);
#else
    int bits = 0;
    for (int i = 0; i < 8; i++) bits |= (m[i] & 1) << i;
    return bits;
#endif
  }
  static inline bool any(i8 m) { return which(m); }
  static inline f8 flo(i8 a) { return __builtin_convertvector(a, f8); }
  static inline i8 whole(f8 a) { return __builtin_convertvector(a, i8); }
  static inline i8 bits(f8 a) { return (i8)a; }
  static inline f8 from_bits(i8 a) { return (f8)a; }
};
#endif
}  // namespace
}  // namespace mpm
