// OpenGL without a window, from libraries that are loaded at run time.

#pragma once

#include "internal.h"

#pragma GCC visibility push(hidden)

// A desktop OpenGL context (compatibility profile) without a surface, so that drawing needs a
// framebuffer object. It belongs to the thread that made it.
typedef struct fs_gl fs_gl;

// Makes a context and makes it current; returns NULL, with the text of fs_error_text, if there is no
// OpenGL.
fs_gl* fs_gl_make(void);

// Makes the context current on this thread, replacing any other.
fs_status fs_gl_make_current(fs_gl* gl);

// Leaves no context current, and deletes this one.
void fs_gl_delete(fs_gl* gl);

#pragma GCC visibility pop
