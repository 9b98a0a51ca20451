// Compares two scenes key by key through the schema, so that no key can be forgotten.
#pragma once

#include <gtest/gtest.h>

#include "sim/scene/schema.h"

namespace duet::scene {

// Visitor that compares the targets of two keys of the schema by value.
struct SameTarget {
  template <class T>
  bool operator()(T* a, T* b) const {
    return *a == *b;
  }
  bool operator()(const Name& a, const Name& b) const { return *a.text == *b.text; }
  bool operator()(const Reference& a, const Reference& b) const { return *a.name == *b.name; }
  bool operator()(const References& a, const References& b) const { return *a.names == *b.names; }
  bool operator()(const Choice& a, const Choice& b) const { return a.selected == b.selected; }
  bool operator()(const Group& a, const Group& b) const {
    for (std::size_t i = 0; i < a.keys.size(); ++i)
      if (!std::visit(*this, a.keys[i].target, b.keys[i].target)) return false;
    return true;
  }
  bool operator()(const List& a, const List& b) const {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto a_keys = a.element(i), b_keys = b.element(i);
      for (std::size_t k = 0; k < a_keys.size(); ++k)
        if (!std::visit(*this, a_keys[k].target, b_keys[k].target)) return false;
    }
    return true;
  }
  template <class A, class B>
  bool operator()(const A&, const B&) const {
    return false;  // Keys of one table have one type.
  }
};

template <class T>
void expect_same_keys(T a, T b) {
  const auto a_keys = keys(a), b_keys = keys(b);
  ASSERT_EQ(a_keys.size(), b_keys.size());
  for (std::size_t i = 0; i < a_keys.size(); ++i)
    EXPECT_TRUE(std::visit(SameTarget{}, a_keys[i].target, b_keys[i].target)) << a_keys[i].name;
}

template <class List, class Wrap>
void expect_same_lists(const List& a, const List& b, Wrap&& wrap) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    SCOPED_TRACE(a[i].name);
    EXPECT_EQ(a[i].name, b[i].name);
    expect_same_keys(wrap(a[i]), wrap(b[i]));
  }
}

inline void expect_same_scene(const Scene& a, const Scene& b) {
  const auto same = [](const auto& element) { return element; };
  expect_same_keys(a, b);
  expect_same_lists(a.materials, b.materials, same);
  expect_same_lists(a.looks, b.looks, same);
  expect_same_lists(a.lights, b.lights, same);
  expect_same_lists(a.rigid, b.rigid, [](const RigidBody& body) { return RigidEntry{body, {}, {}}; });
  expect_same_lists(a.deformable, b.deformable, [](const DeformableBody& body) {
    DeformableEntry entry;
    entry.body = body;
    entry.has_attach_springs = body.attach_springs.has_value();
    entry.attach_springs = body.attach_springs.value_or(AttachSprings{});
    entry.has_skin = body.skin.has_value();
    entry.skin = body.skin.value_or(Skin{});
    return entry;
  });
  expect_same_lists(a.joints, b.joints, [](const Joint& joint) { return JointEntry{joint, {}}; });
  for (std::size_t i = 0; i < a.rigid.size(); ++i) {
    EXPECT_EQ(a.rigid[i].shape.kind, b.rigid[i].shape.kind);
    EXPECT_EQ(a.rigid[i].is_kinematic, b.rigid[i].is_kinematic);
    EXPECT_EQ(a.rigid[i].placement.orientation.coeffs(), b.rigid[i].placement.orientation.coeffs());
  }
  for (std::size_t i = 0; i < a.deformable.size(); ++i) {
    EXPECT_EQ(a.deformable[i].shape.kind, b.deformable[i].shape.kind);
    EXPECT_EQ(a.deformable[i].placement.orientation.coeffs(), b.deformable[i].placement.orientation.coeffs());
  }
  ASSERT_EQ(a.ground.has_value(), b.ground.has_value());
  if (a.ground) expect_same_keys(*a.ground, *b.ground);
  expect_same_keys(a.solver, b.solver);
  expect_same_keys(a.camera, b.camera);
  expect_same_keys(a.sky, b.sky);
  expect_same_keys(a.render, b.render);
}

}  // namespace duet::scene
