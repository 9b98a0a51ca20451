// The OpenGL functions that the renderer calls, loaded through a context. Every context has its own table,
// because the same function has other addresses in another back-end of the same process.
#pragma once

#include <GL/glcorearb.h>

#include "render/context/context.h"

namespace duet::render {

/// Calls X(name, NAME) for each function: its name without the prefix gl, and that name in capitals. All of
/// them belong to OpenGL 3.3 core.
#define DUET_GL_FUNCTIONS(X)                          \
  X(ActiveTexture, ACTIVETEXTURE)                     \
  X(AttachShader, ATTACHSHADER)                       \
  X(BindBuffer, BINDBUFFER)                           \
  X(BindBufferBase, BINDBUFFERBASE)                   \
  X(BindFramebuffer, BINDFRAMEBUFFER)                 \
  X(BindTexture, BINDTEXTURE)                         \
  X(BindVertexArray, BINDVERTEXARRAY)                 \
  X(BufferData, BUFFERDATA)                           \
  X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS)   \
  X(Clear, CLEAR)                                     \
  X(ClearBufferfv, CLEARBUFFERFV)                     \
  X(ClearColor, CLEARCOLOR)                           \
  X(CompileShader, COMPILESHADER)                     \
  X(CreateProgram, CREATEPROGRAM)                     \
  X(CreateShader, CREATESHADER)                       \
  X(CullFace, CULLFACE)                               \
  X(DeleteBuffers, DELETEBUFFERS)                     \
  X(DeleteFramebuffers, DELETEFRAMEBUFFERS)           \
  X(DeleteProgram, DELETEPROGRAM)                     \
  X(DeleteShader, DELETESHADER)                       \
  X(DeleteTextures, DELETETEXTURES)                   \
  X(DeleteVertexArrays, DELETEVERTEXARRAYS)           \
  X(Disable, DISABLE)                                 \
  X(DrawArrays, DRAWARRAYS)                           \
  X(DrawBuffer, DRAWBUFFER)                           \
  X(DrawBuffers, DRAWBUFFERS)                         \
  X(DrawElements, DRAWELEMENTS)                       \
  X(Enable, ENABLE)                                   \
  X(EnableVertexAttribArray, ENABLEVERTEXATTRIBARRAY) \
  X(FramebufferTexture, FRAMEBUFFERTEXTURE)           \
  X(FramebufferTextureLayer, FRAMEBUFFERTEXTURELAYER) \
  X(GenBuffers, GENBUFFERS)                           \
  X(GenerateMipmap, GENERATEMIPMAP)                   \
  X(GenFramebuffers, GENFRAMEBUFFERS)                 \
  X(GenTextures, GENTEXTURES)                         \
  X(GenVertexArrays, GENVERTEXARRAYS)                 \
  X(GetError, GETERROR)                               \
  X(GetIntegerv, GETINTEGERV)                         \
  X(GetProgramInfoLog, GETPROGRAMINFOLOG)             \
  X(GetProgramiv, GETPROGRAMIV)                       \
  X(GetShaderInfoLog, GETSHADERINFOLOG)               \
  X(GetShaderiv, GETSHADERIV)                         \
  X(GetString, GETSTRING)                             \
  X(GetUniformBlockIndex, GETUNIFORMBLOCKINDEX)       \
  X(GetUniformLocation, GETUNIFORMLOCATION)           \
  X(LinkProgram, LINKPROGRAM)                         \
  X(PixelStorei, PIXELSTOREI)                         \
  X(ReadBuffer, READBUFFER)                           \
  X(ReadPixels, READPIXELS)                           \
  X(ShaderSource, SHADERSOURCE)                       \
  X(TexImage2D, TEXIMAGE2D)                           \
  X(TexImage3D, TEXIMAGE3D)                           \
  X(TexParameterfv, TEXPARAMETERFV)                   \
  X(TexParameteri, TEXPARAMETERI)                     \
  X(Uniform1f, UNIFORM1F)                             \
  X(Uniform1i, UNIFORM1I)                             \
  X(Uniform2f, UNIFORM2F)                             \
  X(Uniform2i, UNIFORM2I)                             \
  X(Uniform3f, UNIFORM3F)                             \
  X(UniformBlockBinding, UNIFORMBLOCKBINDING)         \
  X(UniformMatrix4fv, UNIFORMMATRIX4FV)               \
  X(UseProgram, USEPROGRAM)                           \
  X(VertexAttribPointer, VERTEXATTRIBPOINTER)         \
  X(Viewport, VIEWPORT)

/// Table of pointers to functions of OpenGL: gl.BindBuffer is glBindBuffer.
struct Gl {
#define DUET_GL_MEMBER(name, NAME) PFNGL##NAME##PROC name = nullptr;
  DUET_GL_FUNCTIONS(DUET_GL_MEMBER)
#undef DUET_GL_MEMBER
};

/// Loads the table through `context`, which must be current. Throws FileError if a function is missing.
Gl load_gl(const Context& context);

}  // namespace duet::render
