// Checks the tables of a scene that expansion replaces: [parameters], [prefabs] and [[instances]]. Internal
// to the reader: includes toml++.
#pragma once

#include "sim/scene/reader/document.h"
#include "sim/scene/schema.h"

namespace duet::scene {

/// Reports tables of [parameters], [prefabs] and [[instances]] that are written in a wrong form, such as
/// [instances] with single brackets, and unknown keys of prefabs. Expansion would pass over them, and the
/// bodies would be missing without a word.
void check_expanded_tables(const toml::table& document, Problems& problems);

/// Reports keys of the table of an instance, at `path`, that contradict each other or are no tables.
/// `instance` is what the table says.
void check_instance(const toml::table& table, const Instance& instance, const std::string& path,
                    Problems& problems);

/// Reports a key `advance` of the table `repeat`, of the element at `path`, that is no table.
void check_advance(const toml::table& repeat, const std::string& path, Problems& problems);

/// Reports the override `key` if it names a parameter or a prefab that the document does not declare. `value`
/// is the value of the override. Returns whether the override may be applied.
bool check_declared(const toml::table& document, const std::string& key, const toml::node& value,
                    Problems& problems);

}  // namespace duet::scene
