// OpenGL objects that delete themselves. The context that made them must be current when they are destroyed,
// and in every member function.
#pragma once

#include <span>
#include <string>
#include <utility>

#include "render/context/gl.h"
#include "render/projection.h"

namespace duet::render {

/// A texture of OpenGL.
class Texture {
 public:
  /// Creates a texture without storage. `target` is its kind, such as GL_TEXTURE_2D. `gl` must outlive it.
  Texture(const Gl& gl, GLenum target) : gl_(&gl), target_(target) { gl.GenTextures(1, &id_); }
  ~Texture() { gl_->DeleteTextures(1, &id_); }
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;

  /// Returns the name of the texture in OpenGL.
  GLuint id() const { return id_; }
  /// Returns the kind of the texture.
  GLenum target() const { return target_; }
  /// Makes the texture the one that the texture unit `unit` (from 0) samples.
  void bind(int unit) const;
  /// Allocates unfiltered storage for a picture of `width` x `height` pixels that is drawn into and then read
  /// texel by texel. The other parameters are those of glTexImage2D. Binds the texture to unit 0.
  void allocate(int width, int height, GLenum internal_format, GLenum format, GLenum type);

 private:
  const Gl* gl_;
  GLenum target_;
  GLuint id_ = 0;
};

/// A buffer of OpenGL.
class Buffer {
 public:
  /// Creates an empty buffer. `gl` must outlive it.
  explicit Buffer(const Gl& gl) : gl_(&gl) { gl.GenBuffers(1, &id_); }
  ~Buffer() { gl_->DeleteBuffers(1, &id_); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  /// Returns the name of the buffer in OpenGL.
  GLuint id() const { return id_; }
  /// Replaces the content by a copy of `items`, which are plain data `T`, and leaves the buffer bound to
  /// `target`.
  template <class T>
  void fill(GLenum target, std::span<const T> items, GLenum usage = GL_STREAM_DRAW) {
    gl_->BindBuffer(target, id_);
    gl_->BufferData(target, static_cast<GLsizeiptr>(items.size_bytes()), items.data(), usage);
  }

 private:
  const Gl* gl_;
  GLuint id_ = 0;
};

/// A vertex array of OpenGL: where the attributes of vertices lie in buffers.
class VertexArray {
 public:
  /// Creates a vertex array without attributes. `gl` must outlive it.
  explicit VertexArray(const Gl& gl) : gl_(&gl) { gl.GenVertexArrays(1, &id_); }
  ~VertexArray() { gl_->DeleteVertexArrays(1, &id_); }
  VertexArray(const VertexArray&) = delete;
  VertexArray& operator=(const VertexArray&) = delete;

  /// Makes it the vertex array that is drawn from.
  void bind() const { gl_->BindVertexArray(id_); }
  /// Declares the attribute `location`: `components` floats at `offset` in vertices of `stride` bytes of
  /// `buffer`.
  void attribute(const Buffer& buffer, GLuint location, int components, int stride, std::size_t offset);

 private:
  const Gl* gl_;
  GLuint id_ = 0;
};

/// A framebuffer of OpenGL: the textures that are drawn into.
class Framebuffer {
 public:
  /// Creates a framebuffer without attachments. `gl` must outlive it.
  explicit Framebuffer(const Gl& gl) : gl_(&gl) { gl.GenFramebuffers(1, &id_); }
  ~Framebuffer() { gl_->DeleteFramebuffers(1, &id_); }
  Framebuffer(const Framebuffer&) = delete;
  Framebuffer& operator=(const Framebuffer&) = delete;

  /// Makes it the framebuffer that is drawn into.
  void bind() const { gl_->BindFramebuffer(GL_FRAMEBUFFER, id_); }
  /// Attaches `colors` in their order and `depth`, which may be null, and leaves the framebuffer bound.
  /// Throws FileError if the library cannot draw into such textures.
  void attach(std::span<const Texture* const> colors, const Texture* depth);
  /// Attaches the layer `layer` of the array textures `colors` and the plain texture `depth`, and leaves the
  /// framebuffer bound. Throws FileError if the library cannot draw into such textures.
  void attach_layers(std::span<const Texture* const> colors, int layer, const Texture& depth);

 private:
  // Directs the outputs of fragment shaders to the first `colors` attachments and checks that the set is
  // complete.
  void draw_into(std::size_t colors);

  const Gl* gl_;
  GLuint id_ = 0;
};

/// A vertex shader and a fragment shader, linked.
class Program {
 public:
  /// Compiles and links the two shaders from their GLSL source. `name` appears in messages. Throws FileError
  /// with the log of the compiler. `gl` must outlive the program.
  Program(const Gl& gl, const std::string& name, const std::string& vertex, const std::string& fragment);
  ~Program() { gl_->DeleteProgram(id_); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// Makes it the program that draws and whose uniforms set() changes.
  void use() const { gl_->UseProgram(id_); }
  /// Connects the uniform block called `block` with a binding point. A block that the program lacks is
  /// ignored.
  void bind_block(const char* block, GLuint binding) const;
  /// Sets an integer or sampler uniform. The program must be in use; unknown names are ignored. This holds
  /// for all overloads.
  void set(const char* uniform, int value) const { gl_->Uniform1i(location(uniform), value); }
  /// Sets an ivec2 uniform.
  void set(const char* uniform, int x, int y) const { gl_->Uniform2i(location(uniform), x, y); }
  /// Sets a float uniform.
  void set(const char* uniform, float value) const { gl_->Uniform1f(location(uniform), value); }
  /// Sets a vec2 uniform.
  void set(const char* uniform, float x, float y) const { gl_->Uniform2f(location(uniform), x, y); }
  /// Sets a vec3 uniform; the value is rounded to floats.
  void set(const char* uniform, const Vec3& value) const;
  /// Sets a mat4 uniform; the value is rounded to floats.
  void set(const char* uniform, const Mat4& value) const;

 private:
  GLint location(const char* uniform) const { return gl_->GetUniformLocation(id_, uniform); }

  const Gl* gl_;
  GLuint id_ = 0;
};

}  // namespace duet::render
