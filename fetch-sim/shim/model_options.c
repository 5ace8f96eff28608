// What is changed in a model after it is compiled, and before it is shared.

#include <mujoco/mujoco.h>
#include <string.h>

// Overwrites the first `count` numbers of every weld's data.
void fs_set_weld_data(mjModel* m, const double* values, int count) {
  for (int i = 0; i < (int)m->neq; i++) {
    if (m->eq_type[i] == mjEQ_WELD) memcpy(m->eq_data + mjNEQDATA * i, values, (size_t)count * sizeof *values);
  }
}

// Lowers the numbers of constraints and of stack entries (8 bytes each) that every mjData of 2.x has
// room for. Later versions take memory as they need it.
void fs_limit_sizes(mjModel* m, int njmax, int nstack) {
#if mjVERSION_HEADER < 300
  if (m->njmax > njmax) m->njmax = njmax;
  if (m->nstack > nstack) m->nstack = nstack;
#else
  (void)m, (void)njmax, (void)nstack;
#endif
}

// Tests each pair of geoms of two bodies that are near each other, instead of looking for pairs in
// trees of boxes, as 2.x always does. Finds the same contacts;
// where two bodies touch by several pairs of geoms, in the order of 2.x.
void fs_disable_midphase(mjModel* m) {
#if mjVERSION_HEADER >= 300
  m->opt.disableflags |= mjDSBL_MIDPHASE;
#else
  (void)m;
#endif
}
