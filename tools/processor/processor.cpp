#include "tools/processor/processor.h"

#include "tools/processor/features.h"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace duet::processor {
namespace {

// One line of features.h.
struct Feature {
  const char* name;
  int level;                                // of the psABI; 0: none
  std::uint32_t leaf, subleaf, place, bit;  // of cpuid; `place` is the register: eax, ebx, ecx or edx
  std::uint32_t state;                      // required bits of XCR0
};

// Places of the registers in the answer of cpuid.
constexpr std::uint32_t eax = 0, ebx = 1, ecx = 2, edx = 3;

#define DUET_FEATURE(name, macro, level, leaf, subleaf, place, bit, state) \
  {#name, level, leaf, subleaf, place, bit, state},
constexpr Feature features[] = {DUET_PROCESSOR_FEATURES(DUET_FEATURE)};
#undef DUET_FEATURE

constexpr int feature_count = sizeof features / sizeof features[0];
static_assert(feature_count <= 64, "a FeatureSet has 64 bits");

// The leaves of cpuid that features.h names. In a virtual machine every cpuid traps to the host, which takes
// microseconds. Each leaf is therefore read once, and not once for every feature.
struct Leaf {
  std::uint32_t leaf, subleaf;
};
constexpr Leaf leaves[] = {{1, 0}, {7, 0}, {7, 1}, {0x80000001, 0}};

constexpr bool every_feature_has_its_leaf() {
  for (const Feature& feature : features) {
    bool found = false;
    for (const Leaf& leaf : leaves) found |= leaf.leaf == feature.leaf && leaf.subleaf == feature.subleaf;
    if (!found) return false;
  }
  return true;
}
static_assert(every_feature_has_its_leaf());

constexpr const char* level_names[] = {"x86-64", "x86-64-v2", "x86-64-v3", "x86-64-v4"};

constexpr FeatureSet bit_of(int feature) { return FeatureSet{1} << feature; }

// Composes a sentence in a buffer of fixed size. The part that does not fit is left out.
class Sentence {
 public:
  explicit Sentence(char (&text)[sentence_size]) : text_(text) { text_[0] = '\0'; }

  void add(const char* part) {
    for (; *part != '\0' && length_ + 1 < sentence_size; ++part) text_[length_++] = *part;
    text_[length_] = '\0';
  }
  void add(int number) {  // from 0 to 99
    const char digits[] = {static_cast<char>('0' + number / 10), static_cast<char>('0' + number % 10), '\0'};
    add(number < 10 ? digits + 1 : digits);
  }
  // Adds the separator before entry i of a list with `count` entries: "a, b and c".
  void add_separator(int i, int count) { add(i == 0 ? "" : i + 1 == count ? " and " : ", "); }

 private:
  char* text_;
  int length_ = 0;
};

// Adds the names of missing extensions: at most five, or four and the number of the others. An old processor
// may lack twenty.
void add_names(Sentence& sentence, FeatureSet lacking) {
  constexpr int most = 4;
  int count = 0;
  for (int i = 0; i < feature_count; ++i) count += (lacking & bit_of(i)) != 0 ? 1 : 0;
  const int shown = count > most + 1 ? most : count, entries = count > shown ? shown + 1 : shown;
  for (int i = 0, entry = 0; i < feature_count && entry < shown; ++i) {
    if ((lacking & bit_of(i)) == 0) continue;
    sentence.add_separator(entry++, entries);
    sentence.add(features[i].name);
  }
  if (count == shown) return;
  sentence.add(" and ");
  sentence.add(count - shown);
  sentence.add(" more extensions");
}

// Adds the names of the portable levels that need no other than the present features.
void add_levels(Sentence& sentence, FeatureSet present) {
  int count = 0, entry = 0;
  for (const int level : portable_levels) count += level <= level_of(present) ? 1 : 0;
  for (const int level : portable_levels) {
    if (level > level_of(present)) break;
    sentence.add_separator(entry++, count);
    sentence.add(level_name(level));
  }
}

// Returns the last name of a path. The functions of the standard library may be inline elsewhere, and are
// avoided here.
const char* last_name(const char* path) {
  const char* name = path;
  for (; *path != '\0'; ++path)
    if (*path == '/') name = path + 1;
  return name;
}

bool equal(const char* a, const char* b) {
  for (; *a != '\0' && *a == *b; ++a) ++b;
  return *a == *b;
}

#if defined(__x86_64__)
// Returns XCR0: the kinds of registers that the operating system saves for a program. 0 if it supports no
// such query.
std::uint32_t kept_registers() {
  std::uint32_t registers[4] = {};
  constexpr std::uint32_t osxsave = 1U << 27;
  if (__get_cpuid(1, &registers[eax], &registers[ebx], &registers[ecx], &registers[edx]) == 0 ||
      (registers[ecx] & osxsave) == 0)
    return 0;
  std::uint32_t low = 0, high = 0;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}
#endif

}  // namespace

FeatureSet present_features() {
#if defined(__x86_64__)
  FeatureSet present = 0;
  const std::uint32_t kept = kept_registers();
  for (const Leaf& leaf : leaves) {
    std::uint32_t registers[4] = {};
    if (__get_cpuid_count(leaf.leaf, leaf.subleaf, &registers[eax], &registers[ebx], &registers[ecx],
                          &registers[edx]) == 0)
      continue;
    for (int i = 0; i < feature_count; ++i) {
      const Feature& feature = features[i];
      if (feature.leaf == leaf.leaf && feature.subleaf == leaf.subleaf &&
          (registers[feature.place] >> feature.bit & 1) != 0 && (kept & feature.state) == feature.state)
        present |= bit_of(i);
    }
  }
  return present;
#else
  return ~FeatureSet{0};
#endif
}

FeatureSet features_of_level(int level) {
  FeatureSet set = 0;
  for (int i = 0; i < feature_count; ++i)
    if (features[i].level != 0 && features[i].level <= level) set |= bit_of(i);
  return set;
}

int level_of(FeatureSet features) {
  int level = 1;
  while (level < 4 && (features_of_level(level + 1) & ~features) == 0) ++level;
  return level;
}

const char* level_name(int level) { return level_names[level - 1]; }

Choice choose(const char* wanted, FeatureSet present) {
  const int most = level_of(present);
  Choice choice{0, false};
  for (const int level : portable_levels) {
    if (wanted == nullptr || *wanted == '\0') {
      if (level <= most) choice.level = level;
    } else if (equal(wanted, level_name(level))) {
      choice = {level, level > most};
    }
  }
  return choice;
}

bool describe_lack(const char* program, FeatureSet required, FeatureSet present,
                   char (&text)[sentence_size]) {
  const FeatureSet lacking = required & ~present;
  if (lacking == 0) return false;
  Sentence sentence(text);
  sentence.add(last_name(program));
  sentence.add(": this processor lacks ");
  add_names(sentence, lacking);
  sentence.add(
      ", which the program was compiled for; build it on this machine, or with -DDUET_PORTABLE=ON for every "
      "x86-64 processor");
  return true;
}

void describe_refusal(const char* wanted, Choice choice, FeatureSet present, char (&text)[sentence_size]) {
  Sentence sentence(text);
  sentence.add("duet: DUET_ISA=");
  for (int i = 0; i < 40 && wanted[i] != '\0'; ++i) {
    const char letter[] = {wanted[i], '\0'};
    sentence.add(letter);
  }
  if (choice.level == 0) {
    sentence.add(" names no code of this program; it has ");
    add_levels(sentence, features_of_level(4));
  } else {
    sentence.add(": this processor lacks ");
    add_names(sentence, features_of_level(choice.level) & ~present);
    sentence.add("; it runs ");
    add_levels(sentence, present);
  }
}

}  // namespace duet::processor
