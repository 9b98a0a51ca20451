// OpenGL objects that delete themselves. The context that made them must be current when they die.
#pragma once

#include <span>
#include <string>
#include <utility>

#include "render/context/gl.h"
#include "render/projection.h"

namespace duet::render {

class Texture {
 public:
  Texture(const Gl& gl, GLenum target) : gl_(&gl), target_(target) { gl.GenTextures(1, &id_); }
  ~Texture() { gl_->DeleteTextures(1, &id_); }
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;

  GLuint id() const { return id_; }
  GLenum target() const { return target_; }
  void bind(int unit) const;
  // Unfiltered storage for a picture that is drawn into and then read texel by texel.
  void allocate(int width, int height, GLenum internal_format, GLenum format, GLenum type);

 private:
  const Gl* gl_;
  GLenum target_;
  GLuint id_ = 0;
};

class Buffer {
 public:
  explicit Buffer(const Gl& gl) : gl_(&gl) { gl.GenBuffers(1, &id_); }
  ~Buffer() { gl_->DeleteBuffers(1, &id_); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  GLuint id() const { return id_; }
  template <class T>
  void fill(GLenum target, std::span<const T> items, GLenum usage = GL_STREAM_DRAW) {
    gl_->BindBuffer(target, id_);
    gl_->BufferData(target, static_cast<GLsizeiptr>(items.size_bytes()), items.data(), usage);
  }

 private:
  const Gl* gl_;
  GLuint id_ = 0;
};

class VertexArray {
 public:
  explicit VertexArray(const Gl& gl) : gl_(&gl) { gl.GenVertexArrays(1, &id_); }
  ~VertexArray() { gl_->DeleteVertexArrays(1, &id_); }
  VertexArray(const VertexArray&) = delete;
  VertexArray& operator=(const VertexArray&) = delete;

  void bind() const { gl_->BindVertexArray(id_); }
  // Attribute `location`: `components` floats at `offset` in vertices of `stride` bytes of the buffer.
  void attribute(const Buffer& buffer, GLuint location, int components, int stride, std::size_t offset);

 private:
  const Gl* gl_;
  GLuint id_ = 0;
};

class Framebuffer {
 public:
  explicit Framebuffer(const Gl& gl) : gl_(&gl) { gl.GenFramebuffers(1, &id_); }
  ~Framebuffer() { gl_->DeleteFramebuffers(1, &id_); }
  Framebuffer(const Framebuffer&) = delete;
  Framebuffer& operator=(const Framebuffer&) = delete;

  void bind() const { gl_->BindFramebuffer(GL_FRAMEBUFFER, id_); }
  // Attaches pictures and checks that they can be drawn into; `depth` may be null. Throws Error.
  void attach(std::span<const Texture* const> colors, const Texture* depth);
  // The same for one layer of array textures; `depth` has no layers.
  void attach_layers(std::span<const Texture* const> colors, int layer, const Texture& depth);

 private:
  void draw_into(std::size_t colors);

  const Gl* gl_;
  GLuint id_ = 0;
};

class Program {
 public:
  // Compiles and links; throws FileError with the compiler's words. `name` is for messages.
  Program(const Gl& gl, const std::string& name, const std::string& vertex, const std::string& fragment);
  ~Program() { gl_->DeleteProgram(id_); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void use() const { gl_->UseProgram(id_); }
  void bind_block(const char* block, GLuint binding) const;
  // The program must be in use.
  void set(const char* uniform, int value) const { gl_->Uniform1i(location(uniform), value); }
  void set(const char* uniform, int x, int y) const { gl_->Uniform2i(location(uniform), x, y); }
  void set(const char* uniform, float value) const { gl_->Uniform1f(location(uniform), value); }
  void set(const char* uniform, float x, float y) const { gl_->Uniform2f(location(uniform), x, y); }
  void set(const char* uniform, const Vec3& value) const;
  void set(const char* uniform, const Mat4& value) const;

 private:
  GLint location(const char* uniform) const { return gl_->GetUniformLocation(id_, uniform); }

  const Gl* gl_;
  GLuint id_ = 0;
};

}  // namespace duet::render
