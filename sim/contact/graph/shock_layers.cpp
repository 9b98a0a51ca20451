#include "sim/contact/graph/shock_layers.h"

#include <algorithm>
#include <tuple>

namespace duet {
namespace {}  // namespace

void ShockLayers::build(const ContactSet& contacts, std::span<const int> pairs, const std::vector<int>& level,
                        const std::vector<char>& supported) {
  groups_.reset(level.size());
  members_.clear();
  for (const int p : pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    if (pair.guest_rigid < 0) continue;
    const int host_level = level[as_index(pair.host)], guest_level = level[as_index(pair.guest_rigid)];
    const bool host_is_upper = host_level > guest_level;
    if (!supported[as_index(host_is_upper ? pair.guest_rigid : pair.host)]) continue;
    const int upper = host_is_upper ? pair.host : pair.guest_rigid;
    if (host_level == guest_level) groups_.join(pair.host, pair.guest_rigid);
    members_.push_back({std::max(host_level, guest_level), upper, static_cast<int>(members_.size()), p});
  }
  for (Member& member : members_) member.group = groups_.first(member.group);
  std::sort(members_.begin(), members_.end(), [](const Member& a, const Member& b) {
    return std::tie(a.level, a.group, a.position) < std::tie(b.level, b.group, b.position);
  });

  pairs_.clear();
  group_begin_.clear();
  level_begin_.clear();
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const bool new_level = i == 0 || members_[i].level != members_[i - 1].level;
    if (new_level) level_begin_.push_back(group_begin_.size());
    if (new_level || members_[i].group != members_[i - 1].group) group_begin_.push_back(i);
    pairs_.push_back(members_[i].pair);
  }
  level_begin_.push_back(group_begin_.size());
  group_begin_.push_back(members_.size());
}

}  // namespace duet
