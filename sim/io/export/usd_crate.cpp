#include "sim/io/export/usd_crate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <numeric>
#include <span>

#include "sim/base/assert.h"

namespace duet::io {
namespace {

static_assert(std::endian::native == std::endian::little, "crate files are written as they are in memory");

// Numbers of the types of values in the format.
enum class CrateType : std::uint8_t {
  boolean = 1,
  floats = 8,
  token = 11,
  quatd = 16,
  vec3d = 23,
  vec3f = 24,
  token_vector = 41,
  specifier = 42,
  variability = 44,
  time_samples = 46,
  double_vector = 48
};

// Numbers of the kinds of specs in the format.
enum class CrateSpec : std::uint32_t { attribute = 1, prim = 6, layer = 7 };

constexpr std::uint64_t specifier_over = 1;     // number of the specifier `over`
constexpr std::uint64_t varying = 0;            // number of the variability of attributes that change
constexpr std::size_t head_bytes = 88;          // length of the head of a file
constexpr std::size_t toc_position = 16;        // place of the position of the table of sections in the head
constexpr std::size_t section_name_bytes = 16;  // length of the name of a section, with zeros at its end

// A value representation has 48 bits of payload, the type above them, and flags in the highest bits.
std::uint64_t representation(CrateType type, std::uint64_t payload, std::uint64_t flags) {
  return payload | static_cast<std::uint64_t>(type) << 48 | flags;
}
constexpr std::uint64_t is_array = std::uint64_t{1} << 63;    // the value is an array
constexpr std::uint64_t is_inlined = std::uint64_t{1} << 62;  // the payload is the value, not its position

template <class Number>
void append_raw(std::string& bytes, const Number& value) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &value, sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

template <class Number>
void append_raw(std::string& bytes, std::span<const Number> values) {
  const std::size_t at = bytes.size();
  bytes.resize(at + values.size_bytes());
  if (!values.empty()) std::memcpy(bytes.data() + at, values.data(), values.size_bytes());
}

// Values are at multiples of 8 bytes, so that readers can use arrays in place.
std::uint64_t aligned_end(std::string& bytes) {
  bytes.resize((bytes.size() + 7) / 8 * 8);
  return bytes.size();
}

// Returns `plain` as one chunk of USD's "fast compression": a zero, and a block in the format of LZ4 whose
// only sequence has literals alone. Names and indices of a layer are too short for compression to matter.
std::string uncompressed_block(const std::string& plain) {
  constexpr std::size_t nibble = 15, whole = 255;
  std::string block(1, '\0');
  block += static_cast<char>(std::min(plain.size(), nibble) << 4);
  if (plain.size() >= nibble) {
    std::size_t rest = plain.size() - nibble;
    for (; rest >= whole; rest -= whole) block += static_cast<char>(whole);
    block += static_cast<char>(rest);
  }
  return block + plain;
}

void append_block(std::string& bytes, const std::string& plain) {
  const std::string block = uncompressed_block(plain);
  append_raw(bytes, std::uint64_t{block.size()});
  bytes += block;
}

// Appends integers in USD's coding: a common difference of successive integers, two bits for each integer
// that say how long its difference is, and the differences that are not the common one.
void append_integers(std::string& bytes, const std::vector<std::int32_t>& integers) {
  constexpr std::int32_t common = 1;
  std::string coded, codes((integers.size() + 3) / 4, '\0'), differences;
  append_raw(coded, common);
  std::int32_t last = 0;
  for (std::size_t i = 0; i < integers.size(); ++i) {
    // Differences wrap around, as those of the reader do.
    const auto difference =
        static_cast<std::int32_t>(static_cast<std::uint32_t>(integers[i]) - static_cast<std::uint32_t>(last));
    last = integers[i];
    unsigned code = 0;
    if (difference == common) {
      code = 0;
    } else if (difference == static_cast<std::int8_t>(difference)) {
      code = 1;
      append_raw(differences, static_cast<std::int8_t>(difference));
    } else if (difference == static_cast<std::int16_t>(difference)) {
      code = 2;
      append_raw(differences, static_cast<std::int16_t>(difference));
    } else {
      code = 3;
      append_raw(differences, difference);
    }
    codes[i / 4] = static_cast<char>(static_cast<unsigned char>(codes[i / 4]) | code << (2 * (i % 4)));
  }
  append_block(bytes, coded + codes + differences);
}

// Sections of a file with their positions.
struct Sections {
  std::vector<std::pair<const char*, std::array<std::uint64_t, 2>>> all;  // name, position and length

  // Appends a section to the file.
  void add(std::string& file, const char* name, const std::string& section) {
    all.push_back({name, {file.size(), section.size()}});
    file += section;
  }
};

}  // namespace

UsdCrate::UsdCrate(double time) : data_(head_bytes, '\0') {
  const std::string_view head("PXR-USDC\0\10\0", 11);  // the version, 0.8.0, in three bytes of eight
  std::copy(head.begin(), head.end(), data_.begin());
  tokens_.reserve(32);
  token("");  // the first name belongs to no attribute, because names of attributes have a negative index
  const std::uint64_t at = aligned_end(data_);
  append_raw(data_, std::uint64_t{1});
  append_raw(data_, time);
  times_ = representation(CrateType::double_vector, at, 0);
  add_spec("");
  open_.push_back(0);
}

std::uint32_t UsdCrate::token(std::string_view text) {
  const auto found = token_indices_.find(text);
  if (found != token_indices_.end()) return found->second;
  const auto index = static_cast<std::uint32_t>(tokens_.size());
  tokens_.emplace_back(text);
  token_indices_.emplace(text, index);
  return index;
}

std::int32_t UsdCrate::field(std::string_view name, std::uint64_t value) {
  const std::pair<std::uint32_t, std::uint64_t> field{token(name), value};
  const auto [found, is_new] = field_indices_.emplace(field, static_cast<std::int32_t>(fields_.size()));
  if (is_new) fields_.push_back(field);
  return found->second;
}

std::size_t UsdCrate::add_spec(std::string_view name) {
  specs_.emplace_back().name = token(name);
  return specs_.size() - 1;
}

void UsdCrate::begin_prim(const std::string& name) {
  const std::size_t spec = add_spec(name);
  specs_[open_.back()].prims.push_back(spec);
  open_.push_back(spec);
}

void UsdCrate::end_prim() {
  DUET_ASSERT(open_.size() > 1);
  close_prim(open_.back());
  open_.pop_back();
}

// Writes the names of specs as a list, and returns its representation.
std::uint64_t UsdCrate::write_names(const std::vector<std::size_t>& specs) {
  const std::uint64_t at = aligned_end(data_);
  append_raw(data_, std::uint64_t{specs.size()});
  for (const std::size_t spec : specs) append_raw(data_, specs_[spec].name);
  return representation(CrateType::token_vector, at, 0);
}

// Sets the fields of a prim, or of the layer, that has all its children.
void UsdCrate::close_prim(std::size_t spec) {
  std::vector<std::int32_t> fields;
  if (spec != 0)
    fields.push_back(field("specifier", representation(CrateType::specifier, specifier_over, is_inlined)));
  if (!specs_[spec].prims.empty()) fields.push_back(field("primChildren", write_names(specs_[spec].prims)));
  if (!specs_[spec].attributes.empty())
    fields.push_back(field("properties", write_names(specs_[spec].attributes)));
  specs_[spec].field_set = std::move(fields);
}

// Writes a value, and returns its representation.
std::uint64_t UsdCrate::write_value(const UsdData& value) {
  const std::uint64_t at = aligned_end(data_);
  if (const auto* vector = std::get_if<Vec3>(&value)) {
    append_raw(data_, std::span<const double>(vector->data(), 3));
    return representation(CrateType::vec3d, at, 0);
  }
  if (const auto* rotation = std::get_if<Quat>(&value)) {
    const std::array<double, 4> xyzw{rotation->x(), rotation->y(), rotation->z(), rotation->w()};
    append_raw(data_, std::span<const double>(xyzw));
    return representation(CrateType::quatd, at, 0);
  }
  const auto* vectors = std::get_if<std::vector<Vec3f>>(&value);
  const CrateType type = vectors != nullptr ? CrateType::vec3f : CrateType::floats;
  const std::size_t count = vectors != nullptr ? vectors->size() : std::get<std::vector<float>>(value).size();
  if (count == 0) return representation(type, 0, is_array);  // position 0 stands for an empty array
  append_raw(data_, std::uint64_t{count});
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  append_raw(data_, vectors != nullptr ? std::span<const float>(vectors->front().data(), 3 * count)
                                       : std::span<const float>(std::get<std::vector<float>>(value)));
  return representation(type, at, is_array);
}

void UsdCrate::add(std::string_view declaration, const UsdData& value) {
  if (std::holds_alternative<std::monostate>(value)) return;
  const std::size_t space = declaration.find(' ');
  DUET_ASSERT(open_.size() > 1 && space != std::string_view::npos);
  const std::uint64_t written = write_value(value);
  // A table of samples: the distance to the representation of the times, which follows at once; likewise the
  // distance to the number of values, and the representation of each.
  const std::uint64_t at = aligned_end(data_);
  append_raw(data_, std::int64_t{sizeof(std::int64_t)});
  append_raw(data_, times_);
  append_raw(data_, std::int64_t{sizeof(std::int64_t)});
  append_raw(data_, std::uint64_t{1});
  append_raw(data_, written);

  const std::size_t spec = add_spec(declaration.substr(space + 1));
  specs_[spec].is_attribute = true;
  specs_[spec].field_set = {
      field("custom", representation(CrateType::boolean, 0, is_inlined)),
      field("typeName", representation(CrateType::token, token(declaration.substr(0, space)), is_inlined)),
      field("variability", representation(CrateType::variability, varying, is_inlined)),
      field("timeSamples", representation(CrateType::time_samples, at, 0))};
  specs_[open_.back()].attributes.push_back(spec);
}

namespace {

// Sections that list names, fields and sets of fields.
std::string tokens_section(const std::vector<std::string>& tokens) {
  std::string plain, section;
  for (const std::string& token : tokens) plain += token + '\0';
  append_raw(section, std::uint64_t{tokens.size()});
  append_raw(section, std::uint64_t{plain.size()});
  append_block(section, plain);
  return section;
}

std::string fields_section(const std::vector<std::pair<std::uint32_t, std::uint64_t>>& fields) {
  std::string section, values;
  std::vector<std::int32_t> names;
  for (const auto& [name, value] : fields) {
    names.push_back(static_cast<std::int32_t>(name));
    append_raw(values, value);
  }
  append_raw(section, std::uint64_t{fields.size()});
  append_integers(section, names);
  append_block(section, values);
  return section;
}

std::string integers_section(const std::vector<std::int32_t>& integers) {
  std::string section;
  append_raw(section, std::uint64_t{integers.size()});
  append_integers(section, integers);
  return section;
}

// Appends the table of sections, and writes its position into the head.
void append_table(std::string& file, const Sections& sections) {
  const std::uint64_t table = file.size();
  append_raw(file, std::uint64_t{sections.all.size()});
  for (const auto& [name, place] : sections.all) {
    std::string padded(name);
    padded.resize(section_name_bytes);
    file += padded;
    append_raw(file, std::span<const std::uint64_t>(place));
  }
  std::memcpy(file.data() + toc_position, &table, sizeof(table));
}

}  // namespace

// Adds a spec and its children to the list of paths; `has_sibling` says whether another spec of the same
// parent follows. A jump is the distance to that one if there are children, too; 0: only a sibling, -1: only
// children, -2: neither.
void UsdCrate::list_paths(std::size_t spec, bool has_sibling) {
  const Spec& listed = specs_[spec];
  const std::size_t at = paths_.names.size();
  const auto name = static_cast<std::int32_t>(listed.name);
  paths_.names.push_back(listed.is_attribute ? -name : name);
  paths_.specs.push_back(spec);
  paths_.jumps.push_back(has_sibling ? 0 : -2);
  const std::size_t prims = listed.prims.size(), children = prims + listed.attributes.size();
  if (children == 0) return;
  for (std::size_t i = 0; i < children; ++i)
    list_paths(i < prims ? listed.prims[i] : listed.attributes[i - prims], i + 1 < children);
  paths_.jumps[at] = has_sibling ? static_cast<std::int32_t>(paths_.names.size() - at) : -1;
}

std::string UsdCrate::paths_section() const {
  std::vector<std::int32_t> indices(paths_.names.size());
  std::iota(indices.begin(), indices.end(), 0);
  std::string section;
  append_raw(section, std::uint64_t{indices.size()});  // number of paths
  append_raw(section, std::uint64_t{indices.size()});  // number of those in the tree
  append_integers(section, indices);
  append_integers(section, paths_.names);
  append_integers(section, paths_.jumps);
  return section;
}

// Also lists the sets of fields of all specs, each with -1 at its end.
std::string UsdCrate::specs_section(std::vector<std::int32_t>& field_sets) const {
  std::vector<std::int32_t> paths, sets, kinds;
  for (std::size_t i = 0; i < paths_.specs.size(); ++i) {
    const Spec& spec = specs_[paths_.specs[i]];
    paths.push_back(static_cast<std::int32_t>(i));
    sets.push_back(static_cast<std::int32_t>(field_sets.size()));
    kinds.push_back(static_cast<std::int32_t>(i == 0              ? CrateSpec::layer
                                              : spec.is_attribute ? CrateSpec::attribute
                                                                  : CrateSpec::prim));
    field_sets.insert(field_sets.end(), spec.field_set.begin(), spec.field_set.end());
    field_sets.push_back(-1);
  }
  std::string section;
  append_raw(section, std::uint64_t{kinds.size()});
  for (const std::vector<std::int32_t>* list : {&paths, &sets, &kinds}) append_integers(section, *list);
  return section;
}

std::string UsdCrate::finish() {
  DUET_ASSERT(open_.size() == 1 && paths_.names.empty());
  close_prim(0);
  list_paths(0, false);
  std::vector<std::int32_t> field_sets;
  const std::string specs = specs_section(field_sets);
  Sections sections;
  sections.add(data_, "TOKENS", tokens_section(tokens_));
  sections.add(data_, "STRINGS", std::string(sizeof(std::uint64_t), '\0'));  // there are none
  sections.add(data_, "FIELDS", fields_section(fields_));
  sections.add(data_, "FIELDSETS", integers_section(field_sets));
  sections.add(data_, "PATHS", paths_section());
  sections.add(data_, "SPECS", specs);
  append_table(data_, sections);
  return std::move(data_);
}

}  // namespace duet::io
