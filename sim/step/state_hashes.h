// Hashes of the state in parts: which body and which quantity two states differ in, where the hash of the
// whole state (FrameStats::hash) says only that they do.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace duet {

struct World;

/// What a quantity belongs to, and with it how many hashes it has and in which order.
enum class Owner {
  rigid,       ///< each rigid body
  deformable,  ///< each deformable body
  body,        ///< each body, rigid ones first
  scene,       ///< the scene: one hash
};

/// One quantity of the state, with a hash of its bytes for each owner.
struct QuantityHashes {
  std::string_view name;  ///< "velocity"
  Owner owner = Owner::scene;
  std::vector<std::uint64_t> hashes;
};

/// Hashes everything that the next step reads, in a fixed order: of rigid bodies position, orientation,
/// velocity and angular momentum (of a body that is not dynamic: angular velocity), of deformable bodies the
/// positions and velocities of their particles, of the scene the frequency bound, the accelerations where
/// solves begin, and the contact cache. `out` keeps its storage from call to call.
void hash_state(const World& world, std::vector<QuantityHashes>& out);

/// The same and what a step works with: the time and length of the step, and for each body the contacts in
/// which it is the guest, where they are and what impulses they have.
void hash_step(const World& world, std::vector<QuantityHashes>& out);

struct NamedHash {
  std::string_view name;  ///< of the quantity
  std::uint64_t hash = 0;
};

/// A body, or the scene, with its quantities.
struct BodyHashes {
  Owner owner = Owner::scene;  ///< rigid, deformable or scene
  std::string name;            ///< of the body in the scene file; empty for the scene
  std::vector<NamedHash> quantities;
};

/// The quantities of hash_state, body by body: rigid bodies, deformable bodies, the scene.
std::vector<BodyHashes> state_hashes(const World& world);

}  // namespace duet
