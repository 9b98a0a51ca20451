#include "render/gl_objects.h"

#include <array>
#include <vector>

#include <fmt/format.h>

#include "sim/base/error.h"

namespace duet::render {
namespace {

constexpr const char* update_mesa =
    "OpenGL 3.3 is needed: install a current Mesa (apt install libgl1-mesa-dri)";

GLenum color_attachment(std::size_t i) { return GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i); }

// A shader that is compiled by the constructor and deleted once the program is linked.
class Shader {
 public:
  Shader(const Gl& gl, GLenum stage, const std::string& program, const std::string& source)
      : gl_(gl), id_(gl.CreateShader(stage)) {
    const char* text = source.c_str();
    gl.ShaderSource(id_, 1, &text, nullptr);
    gl.CompileShader(id_);
    GLint good = 0;
    gl.GetShaderiv(id_, GL_COMPILE_STATUS, &good);
    if (good) return;
    std::array<char, 2048> log{};
    gl.GetShaderInfoLog(id_, static_cast<GLsizei>(log.size()), nullptr, log.data());
    gl.DeleteShader(id_);
    throw FileError("shader " + program, fmt::format("does not compile: {}", log.data()), update_mesa);
  }
  ~Shader() { gl_.DeleteShader(id_); }
  Shader(const Shader&) = delete;
  Shader& operator=(const Shader&) = delete;
  GLuint id() const { return id_; }

 private:
  const Gl& gl_;
  GLuint id_;
};

}  // namespace

void Texture::bind(int unit) const {
  gl_->ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  gl_->BindTexture(target_, id_);
}

void Texture::allocate(int width, int height, GLenum internal_format, GLenum format, GLenum type) {
  bind(0);
  gl_->TexImage2D(target_, 0, static_cast<GLint>(internal_format), width, height, 0, format, type, nullptr);
  gl_->TexParameteri(target_, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl_->TexParameteri(target_, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl_->TexParameteri(target_, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl_->TexParameteri(target_, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

void VertexArray::attribute(const Buffer& buffer, GLuint location, int components, int stride,
                            std::size_t offset) {
  bind();
  gl_->BindBuffer(GL_ARRAY_BUFFER, buffer.id());
  gl_->EnableVertexAttribArray(location);
  gl_->VertexAttribPointer(location, components, GL_FLOAT, GL_FALSE, stride,
                           reinterpret_cast<const void*>(offset));
}

void Framebuffer::attach(std::span<const Texture* const> colors, const Texture* depth) {
  bind();
  for (std::size_t i = 0; i < colors.size(); ++i)
    gl_->FramebufferTexture(GL_FRAMEBUFFER, color_attachment(i), colors[i]->id(), 0);
  if (depth) gl_->FramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth->id(), 0);
  draw_into(colors.size());
}

void Framebuffer::attach_layers(std::span<const Texture* const> colors, int layer, const Texture& depth) {
  bind();
  for (std::size_t i = 0; i < colors.size(); ++i)
    gl_->FramebufferTextureLayer(GL_FRAMEBUFFER, color_attachment(i), colors[i]->id(), 0, layer);
  gl_->FramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth.id(), 0);
  draw_into(colors.size());
}

void Framebuffer::draw_into(std::size_t colors) {
  std::vector<GLenum> points;
  for (std::size_t i = 0; i < colors; ++i) points.push_back(color_attachment(i));
  gl_->DrawBuffers(static_cast<GLsizei>(points.size()), points.data());
  if (gl_->CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw FileError("OpenGL", "the library cannot draw into pictures of the kind that the renderer needs",
                    update_mesa);
}

Program::Program(const Gl& gl, const std::string& name, const std::string& vertex,
                 const std::string& fragment)
    : gl_(&gl) {
  const Shader vertex_shader(gl, GL_VERTEX_SHADER, name, vertex);
  const Shader fragment_shader(gl, GL_FRAGMENT_SHADER, name, fragment);
  id_ = gl.CreateProgram();
  gl.AttachShader(id_, vertex_shader.id());
  gl.AttachShader(id_, fragment_shader.id());
  gl.LinkProgram(id_);
  GLint good = 0;
  gl.GetProgramiv(id_, GL_LINK_STATUS, &good);
  if (good) return;
  std::array<char, 2048> log{};
  gl.GetProgramInfoLog(id_, static_cast<GLsizei>(log.size()), nullptr, log.data());
  gl.DeleteProgram(id_);
  throw FileError("shader " + name, fmt::format("does not link: {}", log.data()), update_mesa);
}

void Program::bind_block(const char* block, GLuint binding) const {
  const GLuint index = gl_->GetUniformBlockIndex(id_, block);
  if (index != GL_INVALID_INDEX) gl_->UniformBlockBinding(id_, index, binding);
}

void Program::set(const char* uniform, const Vec3& value) const {
  const Vec3f v = value.cast<float>();
  gl_->Uniform3f(location(uniform), v.x(), v.y(), v.z());
}

void Program::set(const char* uniform, const Mat4& value) const {
  const Eigen::Matrix4f m = value.cast<float>();
  gl_->UniformMatrix4fv(location(uniform), 1, GL_FALSE, m.data());
}

}  // namespace duet::render
