// Which instructions a program was compiled for, which ones this processor has, and what to say or do about
// the difference. All functions are compiled for the baseline of the architecture, call nothing that is
// inline elsewhere, and allocate nothing, so that they run on any processor before anything else does.
#pragma once

#include <cstdint>

namespace duet::processor {

/// A set of extensions of the instruction set: bit i is the i-th one of features.h.
using FeatureSet = std::uint64_t;

/// The extensions that the compiler was allowed to use in this program; empty on other architectures.
extern const FeatureSet required_features;

/// The extensions that this processor has and the operating system supports; on other architectures all.
FeatureSet present_features();

/// The extensions of a level of the x86-64 psABI (1 to 4), those of lower levels included; level 1 has none.
FeatureSet features_of_level(int level);

/// The highest level of the x86-64 psABI, 1 to 4, whose extensions are all in the set.
int level_of(FeatureSet features);

/// The name of a level, 1 to 4, as compilers take it after -march=: "x86-64" for 1, "x86-64-v3" for 3.
const char* level_name(int level);

/// The levels that a portable program has code for, least first.
inline constexpr int portable_levels[] = {1, 3, 4};

/// What a portable program runs.
struct Choice {
  int level;     // of the x86-64 psABI; 0: none
  bool lacking;  // `level` was asked for, and the processor cannot run it
};

/// The level asked for by its name, or where `wanted` is null or empty the best one of `portable_levels` for
/// these features. The level is 0 where no code has the name.
Choice choose(const char* wanted, FeatureSet present);

/// The most that the functions below write, the final null included.
inline constexpr int sentence_size = 512;

/// Writes a sentence to `text` that names what `program` was compiled for and the processor lacks, and
/// returns true; returns false where it lacks nothing. `program` may be a path, of which the last name
/// counts.
bool describe_lack(const char* program, FeatureSet required, FeatureSet present, char (&text)[sentence_size]);

/// Writes the sentence why `choose` gave no code that runs, for a value of DUET_ISA, to `text`.
void describe_refusal(const char* wanted, Choice choice, FeatureSet present, char (&text)[sentence_size]);

}  // namespace duet::processor
