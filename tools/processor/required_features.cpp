// The extensions that the rest of the program was compiled for. This file is compiled with the flags of the
// rest. It holds a constant and no code, so that the check of the processor can read it on any processor.
#include "tools/processor/features.h"
#include "tools/processor/processor.h"

namespace duet::processor {
namespace {

// A macro that the compiler defines expands to 1; any other stays the text of its name. The first letter
// tells which.
#define DUET_TEXT(value) #value
#define DUET_FIRST_LETTER(name, macro, level, leaf, subleaf, place, bit, state) DUET_TEXT(macro)[0],
constexpr char first_letters[] = {DUET_PROCESSOR_FEATURES(DUET_FIRST_LETTER)};
#undef DUET_FIRST_LETTER
#undef DUET_TEXT

consteval FeatureSet collect() {
  FeatureSet set = 0;
  for (unsigned i = 0; i < sizeof first_letters; ++i)
    if (first_letters[i] == '1') set |= FeatureSet{1} << i;
  return set;
}

}  // namespace

constinit const FeatureSet required_features = collect();

}  // namespace duet::processor
