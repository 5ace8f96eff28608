// Leaves out collision tests of pairs of geoms that cannot touch. See contact_filter.c.

#ifndef FETCH_SHIM_CONTACT_FILTER_H_
#define FETCH_SHIM_CONTACT_FILTER_H_

#include "shapes.h"

typedef struct fs_filter fs_filter;

// Puts the filter before the collision routines of a library, once.
void fs_install_filter(void* library);

// The filter of one simulation; NULL if there is no memory for it. Needs the shapes while it lives.
fs_filter* fs_make_filter(const fs_shapes* shapes, const mjData* d);
void fs_delete_filter(fs_filter* filter);

// The filter at work on this thread; returns the one that was. NULL is none.
fs_filter* fs_use_filter(fs_filter* filter);

typedef struct {
  // Pairs that passed MuJoCo's own filters, and those of them that this one left out.
  unsigned long long pairs, rejected;
  // Rejections that were checked, and those of them that MuJoCo's routine contradicted.
  unsigned long long checked, refuted;
} fs_filter_counts;

void fs_get_filter_counts(const fs_filter* filter, fs_filter_counts* counts);

// Whether every rejection is checked against MuJoCo's own collision routine.
void fs_check_filter(fs_filter* filter, int check);

#endif
