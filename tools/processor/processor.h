// Compares the instructions that a program was compiled for with those of the processor. All functions are
// compiled for the baseline of the architecture, call nothing that is inline elsewhere, and allocate nothing,
// so that they can run on any processor before all other code.
#pragma once

#include <cstdint>

namespace duet::processor {

// A set of extensions of the instruction set: bit i is line i of features.h.
using FeatureSet = std::uint64_t;

// The extensions that the compiler was allowed to use in this program. Empty on other architectures than
// x86-64.
extern const FeatureSet required_features;

// Returns the extensions that this processor has and the operating system supports. On other architectures
// than x86-64 these are all.
FeatureSet present_features();

// Returns the extensions of a level of the x86-64 psABI (1 to 4), including those of lower levels. Level 1
// has none.
FeatureSet features_of_level(int level);

// Returns the highest level of the x86-64 psABI (1 to 4) whose extensions are all in the set.
int level_of(FeatureSet features);

// Returns the name of a level (1 to 4) as compilers take it after -march=: "x86-64" for 1, "x86-64-v3" for 3.
const char* level_name(int level);

// The levels that a portable program has code for, in ascending order.
inline constexpr int portable_levels[] = {1, 3, 4};

// The choice of a program among those of a portable build.
struct Choice {
  int level;     // of the x86-64 psABI; 0: there is no such program
  bool lacking;  // the processor cannot run the level that was asked for
};

// Chooses the level called `wanted`, or the best of `portable_levels` for these features if `wanted` is null
// or empty. The level is 0 if no program has that name.
Choice choose(const char* wanted, FeatureSet present);

// Size of the text that the functions below write at most, including the final null (bytes).
inline constexpr int sentence_size = 512;

// Writes a sentence to `text` that names the extensions which `program` was compiled for and the processor
// lacks, and returns true. Returns false if it lacks none. Only the last name of a path `program` appears.
bool describe_lack(const char* program, FeatureSet required, FeatureSet present, char (&text)[sentence_size]);

// Writes a sentence to `text` that says why choose() found no program for `wanted`, a value of DUET_ISA.
void describe_refusal(const char* wanted, Choice choice, FeatureSet present, char (&text)[sentence_size]);

}  // namespace duet::processor
