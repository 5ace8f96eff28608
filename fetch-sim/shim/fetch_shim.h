// What the other files of the shim need of fetch_shim.c.

#ifndef FETCH_SHIM_H
#define FETCH_SHIM_H

enum { FS_OK = 0, FS_FAILED = 1, FS_WARNED = 2 };

// Looks a function of a library up; false if it has none of this name.
int fs_symbol(void* library, const char* name, void* target);

// Sets the text of fs_error_text, and returns FS_FAILED.
__attribute__((format(printf, 1, 2))) int fs_fail(const char* format, ...);

// Runs MuJoCo calls that may fail; returns a set of FS_* flags. Nothing that `body` has acquired may
// need to be released when it is left by a failure.
int fs_guarded(void (*body)(void*), void* argument);

// MuJoCo's library, once fs_load has succeeded.
extern void* fs_mujoco;

#endif
