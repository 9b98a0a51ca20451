// The extensions of the x86-64 instruction set that compilers use for plain C++ if allowed to. Extensions
// that only intrinsics and assembly reach (AES, SHA, RDRAND) are left out: a program runs without them
// wherever it was compiled.
#pragma once

// One line for each extension: F(name, macro, level, leaf, subleaf, register, bit, state). Compilers define
// `macro` if they may use the extension. `level` is the level of the x86-64 psABI that it belongs to (2, 3 or
// 4; 0: none). The processor has it if cpuid(leaf, subleaf) sets `bit` of `register`; the operating system
// supports it if XCR0 has all bits of `state` (0: general and SSE registers, which every system saves).
// Sources: System V ABI, AMD64 supplement 1.0, table 3.1; Intel SDM volume 1, sections 13 to 15, and volume
// 2, CPUID; AMD64 APM volume 3, appendix E.
#define DUET_PROCESSOR_FEATURES(F)                                     \
  F(CX16, __GCC_HAVE_SYNC_COMPARE_AND_SWAP_16, 2, 1, 0, ecx, 13, 0)    \
  F(LAHF, __LAHF_SAHF__, 2, 0x80000001, 0, ecx, 0, 0)                  \
  F(POPCNT, __POPCNT__, 2, 1, 0, ecx, 23, 0)                           \
  F(SSE3, __SSE3__, 2, 1, 0, ecx, 0, 0)                                \
  F(SSSE3, __SSSE3__, 2, 1, 0, ecx, 9, 0)                              \
  F(SSE4_1, __SSE4_1__, 2, 1, 0, ecx, 19, 0)                           \
  F(SSE4_2, __SSE4_2__, 2, 1, 0, ecx, 20, 0)                           \
  F(AVX, __AVX__, 3, 1, 0, ecx, 28, 0x6)                               \
  F(AVX2, __AVX2__, 3, 7, 0, ebx, 5, 0x6)                              \
  F(BMI, __BMI__, 3, 7, 0, ebx, 3, 0)                                  \
  F(BMI2, __BMI2__, 3, 7, 0, ebx, 8, 0)                                \
  F(F16C, __F16C__, 3, 1, 0, ecx, 29, 0x6)                             \
  F(FMA, __FMA__, 3, 1, 0, ecx, 12, 0x6)                               \
  F(LZCNT, __LZCNT__, 3, 0x80000001, 0, ecx, 5, 0)                     \
  F(MOVBE, __MOVBE__, 3, 1, 0, ecx, 22, 0)                             \
  F(AVX512F, __AVX512F__, 4, 7, 0, ebx, 16, 0xe6)                      \
  F(AVX512BW, __AVX512BW__, 4, 7, 0, ebx, 30, 0xe6)                    \
  F(AVX512CD, __AVX512CD__, 4, 7, 0, ebx, 28, 0xe6)                    \
  F(AVX512DQ, __AVX512DQ__, 4, 7, 0, ebx, 17, 0xe6)                    \
  F(AVX512VL, __AVX512VL__, 4, 7, 0, ebx, 31, 0xe6)                    \
  F(AVX512IFMA, __AVX512IFMA__, 0, 7, 0, ebx, 21, 0xe6)                \
  F(AVX512ER, __AVX512ER__, 0, 7, 0, ebx, 27, 0xe6)                    \
  F(AVX512PF, __AVX512PF__, 0, 7, 0, ebx, 26, 0xe6)                    \
  F(AVX512VBMI, __AVX512VBMI__, 0, 7, 0, ecx, 1, 0xe6)                 \
  F(AVX512VBMI2, __AVX512VBMI2__, 0, 7, 0, ecx, 6, 0xe6)               \
  F(AVX512VNNI, __AVX512VNNI__, 0, 7, 0, ecx, 11, 0xe6)                \
  F(AVX512BITALG, __AVX512BITALG__, 0, 7, 0, ecx, 12, 0xe6)            \
  F(AVX512VPOPCNTDQ, __AVX512VPOPCNTDQ__, 0, 7, 0, ecx, 14, 0xe6)      \
  F(AVX512VP2INTERSECT, __AVX512VP2INTERSECT__, 0, 7, 0, edx, 8, 0xe6) \
  F(AVX512FP16, __AVX512FP16__, 0, 7, 0, edx, 23, 0xe6)                \
  F(AVX512BF16, __AVX512BF16__, 0, 7, 1, eax, 5, 0xe6)                 \
  F(AVXVNNI, __AVXVNNI__, 0, 7, 1, eax, 4, 0x6)                        \
  F(AVXIFMA, __AVXIFMA__, 0, 7, 1, eax, 23, 0x6)                       \
  F(AVXVNNIINT8, __AVXVNNIINT8__, 0, 7, 1, edx, 4, 0x6)                \
  F(AVXVNNIINT16, __AVXVNNIINT16__, 0, 7, 1, edx, 10, 0x6)             \
  F(APX, __APX_F__, 0, 7, 1, edx, 21, 0x80000)                         \
  F(GFNI, __GFNI__, 0, 7, 0, ecx, 8, 0)                                \
  F(ADX, __ADX__, 0, 7, 0, ebx, 19, 0)                                 \
  F(SSE4A, __SSE4A__, 0, 0x80000001, 0, ecx, 6, 0)                     \
  F(XOP, __XOP__, 0, 0x80000001, 0, ecx, 11, 0x6)                      \
  F(FMA4, __FMA4__, 0, 0x80000001, 0, ecx, 16, 0x6)                    \
  F(TBM, __TBM__, 0, 0x80000001, 0, ecx, 21, 0)
